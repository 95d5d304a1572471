//! What a scene may say, as a list to be read: every mechanism with its equation and its keys, from documentation comments and
//! schemas alone. An outside mechanism stands in it like any other.

use serde::Serialize;
use serde_json::Value;

use super::ranges::{Range, typical, with_unit};
use super::schema::{BlockSchema, full_schema};
use super::schema_view::{branches_of, describe, kind_of, resolve, types_of, unescaped, words_of};
use super::suggest::full_advice;
use crate::model::quantity::format_number;

/// Keys inside keys are listed this deep.
const DEEPEST_KEY: usize = 8;

/// The name under which the keys that belong to no mechanism are listed.
const SCENE: &str = "scene";

/// Everything that a scene may hold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Catalogue {
    /// The mechanisms in the order of the roster.
    pub mechanisms: Vec<Block>,
    /// The keys that belong to no mechanism.
    pub scene: Option<Block>,
}

/// A mechanism, or the scene itself, and its keys.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Block {
    /// The key at the top of a scene.
    pub name: String,
    /// What it is, in a sentence.
    pub summary: String,
    /// What it adds or solves: the part of the documentation's first paragraph behind its semicolon.
    pub equation: Option<String>,
    /// Its keys, in the order of the documentation, those inside others behind them.
    pub keys: Vec<Key>,
}

/// One key.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Key {
    /// The path from the block, with dots; `NAME` is any name, `[]` any entry of a list.
    pub key: String,
    /// The type, and the base unit of a quantity.
    pub kind: String,
    /// The range that is possible.
    pub possible: Option<String>,
    /// The range that is usual.
    pub usual: Option<String>,
    /// The value of an absent key, when it is short.
    pub default: Option<String>,
    /// The documentation.
    pub description: String,
    /// The words that can stand here.
    pub words: Vec<Word>,
}

/// A word and what it means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Word {
    /// The word.
    pub word: String,
    /// Its documentation.
    pub description: String,
}

impl Catalogue {
    /// The catalogue of these mechanisms.
    pub fn of(blocks: &[BlockSchema]) -> Self {
        let root = full_schema(&[]);
        let mechanisms = blocks.iter().map(|block| Block::of(block.name, &block.schema)).collect();
        Self { mechanisms, scene: Some(Block::of(SCENE, &root)) }
    }

    /// The part of one name: a mechanism, or `scene`.
    ///
    /// # Errors
    /// A name that does not exist, with the nearest that does.
    pub fn only(mut self, name: &str) -> Result<Self, String> {
        let mut names: Vec<&str> = self.mechanisms.iter().map(|block| block.name.as_str()).collect();
        names.push(SCENE);
        if !names.contains(&name) {
            return Err(format!("there is no mechanism `{name}`{}", full_advice(name, "there are", &names, '`')));
        }
        self.mechanisms.retain(|block| block.name == name);
        self.scene = self.scene.filter(|_| name == SCENE);
        Ok(self)
    }
}

impl Block {
    fn of(name: &str, schema: &Value) -> Self {
        let text = documentation(schema);
        let (summary, equation) = match text.split_once("; ") {
            Some((summary, equation)) if equation.contains('=') => {
                (format!("{summary}."), Some(equation.trim_end_matches('.').to_owned()))
            }
            _ => (text, None),
        };
        let mut list = List { root: schema, keys: Vec::new() };
        list.add_members(schema, "", 0);
        Self { name: name.to_owned(), summary, equation, keys: list.keys }
    }
}

/// Keys on their way into a block.
struct List<'a> {
    root: &'a Value,
    keys: Vec<Key>,
}

impl List<'_> {
    /// The keys inside a value of this schema: named ones, those of any name, those of entries.
    fn add_members(&mut self, schema: &Value, prefix: &str, depth: usize) {
        if depth > DEEPEST_KEY {
            return;
        }
        let join = |key: &str| if prefix.is_empty() { key.to_owned() } else { format!("{prefix}.{key}") };
        let named = schema.get("properties").and_then(Value::as_object);
        // The documentation of a variant stands beside the one key that it is.
        let variant = if named.is_some_and(|all| all.len() == 1) { documentation(schema) } else { String::new() };
        for (key, member) in named.into_iter().flatten() {
            self.add(member, join(key), &variant, depth + 1);
        }
        if let Some(member) = schema.get("additionalProperties").filter(|member| member.is_object()) {
            self.add_inside(member, join("NAME"), depth + 1);
        }
        if let Some(entry) = schema.get("items").filter(|entry| entry.is_object()) {
            self.add_inside(entry, format!("{prefix}[]"), depth + 1);
        }
        for branch in branches_of(schema).into_iter().flatten() {
            self.add_inside(branch, prefix.to_owned(), depth + 1);
        }
    }

    /// The keys inside a value that has no line of its own, because the line before says what it is.
    fn add_inside(&mut self, schema: &Value, prefix: String, depth: usize) {
        let schema = resolve(self.root, schema);
        self.add_members(&schema, &prefix, depth);
    }

    fn add(&mut self, member: &Value, key: String, otherwise: &str, depth: usize) {
        let schema = resolve(self.root, member);
        let open = self.without_null(&schema);
        let kind = kind_of(&open);
        let mut words = Vec::new();
        self.collect_words(&open, &mut words);
        let range = Range::of(&open);
        let own = documentation(&schema);
        let numeric = kind.is_some() || types_of(&open).any(|name| name == "number" || name == "integer");
        let limited = numeric && range != Range::of(&Value::Null);
        self.keys.push(Key {
            kind: self.kind(&open, !words.is_empty()),
            possible: limited.then(|| range.describe("", None).trim().replace("  ", " · ")),
            usual: typical(&open).map(|(low, high)| format!("{} to {}", format_number(low), with_unit(high, None))),
            default: schema.get("default").and_then(short),
            description: if own.is_empty() { otherwise.to_owned() } else { own },
            words,
            key: key.clone(),
        });
        self.add_members(&open, &key, depth);
    }

    /// The schema of an `Option` without its null.
    fn without_null(&self, schema: &Value) -> Value {
        let open = branches_of(schema).map(|all| all.iter().filter(|one| !types_of(one).eq(["null"])));
        match open.map(|mut all| (all.next(), all.next())) {
            Some((Some(only), None)) => resolve(self.root, only).into_owned(),
            _ => schema.clone(),
        }
    }

    fn collect_words(&self, schema: &Value, words: &mut Vec<Word>) {
        if let Some(own) = words_of(schema) {
            let description = if own.len() == 1 { documentation(schema) } else { String::new() };
            words.extend(own.iter().map(|word| Word { word: (*word).to_owned(), description: description.clone() }));
        }
        for branch in branches_of(schema).into_iter().flatten() {
            self.collect_words(&resolve(self.root, branch), words);
        }
    }

    fn kind(&self, schema: &Value, words: bool) -> String {
        if let Some(kind) = kind_of(schema) {
            return kind.unit.to_owned();
        }
        let branches: Vec<_> = branches_of(schema).into_iter().flatten().map(|one| resolve(self.root, one)).collect();
        let other = branches.iter().filter(|branch| {
            let mut own = Vec::new();
            self.collect_words(branch, &mut own);
            own.is_empty()
        });
        let mut named: Vec<String> = other.map(|branch| self.kind(branch, false)).collect();
        if words {
            named.insert(0, "word".to_owned());
        }
        named.dedup();
        if !named.is_empty() {
            return named.join(" or ");
        }
        let name = types_of(schema).find(|name| *name != "null");
        match (name, schema.get("items"), schema.get("additionalProperties")) {
            (Some("array"), Some(entry), _) if entry.is_object() => {
                format!("list of {}", self.kind(&resolve(self.root, entry), false))
            }
            (Some("object"), _, Some(member)) if member.is_object() => "by name".to_owned(),
            (Some("object"), ..) => "keys".to_owned(),
            _ => {
                let text = describe(self.root, schema);
                text.strip_prefix("a ").unwrap_or(&text).to_owned()
            }
        }
    }
}

/// The first paragraph of a documentation comment, on one line.
fn documentation(schema: &Value) -> String {
    let text = schema.get("description").and_then(Value::as_str).unwrap_or_default();
    let first = text.split("\n\n").next().unwrap_or_default();
    unescaped(&first.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Longer defaults are left out, longer numbers rounded.
const LONGEST_DEFAULT: usize = 24;
const LONGEST_NUMBER: usize = 9;

/// A default that fits its column: no keys inside, no null.
fn short(value: &Value) -> Option<String> {
    let text = match value {
        Value::Null => return None,
        Value::Object(keys) if !keys.is_empty() => return None,
        Value::Number(_) => value.as_f64().map(|number| {
            let text = format_number(number);
            if text.len() > LONGEST_NUMBER { format!("{number:.5}") } else { text }
        })?,
        Value::String(word) if !word.is_empty() => word.clone(),
        _ => value.to_string(),
    };
    (text.len() <= LONGEST_DEFAULT).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prelude::*;

    keys! {
        /// Turning along a field; L̂ += w n.
        pub struct Field {
            /// Its strength \[V/m\].
            #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 9.0, "x-typical" = [1.0, 2.0]))]
            pub strength: ElectricField = ElectricField(1.0),
            /// Electrodes.
            pub electrodes: std::collections::BTreeMap<String, Electrode> = std::collections::BTreeMap::new(),
            /// A shape, if there is one.
            pub shape: Option<Shape> = None,
        }

        /// An electrode.
        pub struct Electrode {
            /// Its height.
            pub height: Length = Length(2.0 / 60.0),
        }
    }

    #[test]
    fn a_block_is_read_from_its_documentation_and_its_schema() {
        let block = Block::of("field", &schemars::schema_for!(Field).to_value());
        assert_eq!((block.summary.as_str(), block.equation.as_deref()), ("Turning along a field.", Some("L̂ += w n")));
        let lines: Vec<_> = block.keys.iter().map(|key| (key.key.as_str(), key.kind.as_str())).collect();
        let expected = [
            ("strength", "V/m"),
            ("electrodes", "by name"),
            ("electrodes.NAME.height", "um"),
            ("shape", "keys"),
            ("shape.disc", "keys"),
            ("shape.disc.centre", "list of um"),
            ("shape.disc.radius", "um"),
            ("shape.polygon", "keys"),
            ("shape.polygon.points", "list of list of um"),
        ];
        assert_eq!(block.keys[4].description, "All points within `radius` of `centre`.");
        assert_eq!(lines, expected);
        let strength = &block.keys[0];
        assert_eq!(strength.possible.as_deref(), Some("0 ≤ · < 9"));
        assert_eq!((strength.usual.as_deref(), strength.default.as_deref()), (Some("1 to 2"), Some("1")));
        assert_eq!(strength.description, "Its strength [V/m].");
        assert_eq!(block.keys[2].default.as_deref(), Some("0.03333"));
    }
}
