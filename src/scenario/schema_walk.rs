//! The walk of a JSON value along a JSON schema that finds every problem at once, each with its pointer, what stands there, what is
//! allowed, and the nearest key or word. It understands what serde and schemars derive: `$ref`, closed objects, maps, lists and
//! tuples, `Option`, unit and externally or internally tagged enums, untagged enums, numbers with ranges, and quantities.
//!
//! An object member that is `null` is absent: it may name any known key, and no unknown one.

use serde_json::{Map, Value};
use std::ops::RangeInclusive;

use super::names::{is_name, no_name};
use super::ranges::{Range, typical, with_unit};
use super::schema_view::{
    branches_of, collect_keys, describe, example_of, fits_format, has_type, kind_of, quoted, refusal, resolve, show,
    types_of, whole_limit, words_of,
};
use super::suggest::{advice, nearest};
use crate::model::quantity::{Kind, with_article};
use crate::model::violation::{Violation, pointer_token};

/// Sizes, in base units, that a number of a model may have if it is not 0: what lies beyond is a slip, and ends in sums that no number
/// holds. Ours.
const MODEL_NUMBERS: RangeInclusive<f64> = 1e-30..=1e30;

/// What a walk found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// What cannot be, in the order of the document.
    pub problems: Vec<Violation>,
    /// What is possible but unusual, in the order of the document.
    pub hints: Vec<Violation>,
}

/// Walks `value` along the schema `root` (which holds its own `$defs`).
pub fn walk(root: &Value, value: &Value) -> Findings {
    let mut walker = Walker::new(root);
    walker.check(root, value, "");
    walker.findings
}

pub(super) struct Walker<'a> {
    pub(super) root: &'a Value,
    pub(super) findings: Findings,
}

impl<'a> Walker<'a> {
    pub(super) fn new(root: &'a Value) -> Self {
        Self { root, findings: Findings::default() }
    }

    pub(super) fn problem(&mut self, pointer: &str, message: impl Into<String>) {
        self.findings.problems.push(Violation::new(pointer, message));
    }

    pub(super) fn check(&mut self, schema: &Value, value: &Value, pointer: &str) {
        let schema = resolve(self.root, schema);
        if let Some(kind) = kind_of(&schema) {
            return self.check_quantity(&schema, kind, value, pointer);
        }
        if let Some(words) = words_of(&schema) {
            return self.check_word(&words, value, pointer);
        }
        for part in schema.get("allOf").and_then(Value::as_array).into_iter().flatten() {
            self.check(part, value, pointer);
        }
        if let Some(branches) = branches_of(&schema) {
            self.check_alternatives(branches, value, pointer);
        }
        if !has_type(&schema, value) {
            let wanted = describe(self.root, &schema);
            return self.problem(pointer, format!("{} is not {wanted}", show(value)));
        }
        match value {
            Value::Object(object) => self.check_object(&schema, object, pointer),
            Value::Array(entries) => self.check_list(&schema, entries, pointer),
            Value::Number(_) => self.check_number(&schema, value, pointer),
            _ => {}
        }
    }

    fn check_quantity(&mut self, schema: &Value, kind: Kind<'_>, value: &Value, pointer: &str) {
        match value {
            Value::Null if has_type(schema, value) => {}
            Value::Number(number) => {
                let number = number.as_f64().unwrap_or(f64::NAN);
                self.check_range(schema, number, &with_unit(number, Some(kind)), pointer);
            }
            Value::String(text) => match kind.read(text) {
                Ok(number) => self.check_range(schema, number, &show(value), pointer),
                Err(error) => self.problem(pointer, error.to_string()),
            },
            _ => {
                let (name, wanted) = (with_article(kind.name), kind.wanted(example_of(schema)));
                self.problem(pointer, format!("{} is not {name}; {wanted} belongs here", show(value)));
            }
        }
    }

    fn check_number(&mut self, schema: &Value, value: &Value, pointer: &str) {
        let shown = show(value);
        if types_of(schema).any(|name| name == "integer") && !types_of(schema).any(|name| name == "number") {
            if !(value.is_i64() || value.is_u64()) {
                return self.problem(pointer, format!("{shown} is not a whole number{}", whole_limit(schema)));
            }
            if !fits_format(schema, value) {
                return self.problem(pointer, format!("{shown} is too large"));
            }
        }
        self.check_range(schema, value.as_f64().unwrap_or(f64::NAN), &shown, pointer);
    }

    fn check_range(&mut self, schema: &Value, number: f64, shown: &str, pointer: &str) {
        let (range, kind) = (Range::of(schema), kind_of(schema));
        let last = pointer.rsplit('/').next().unwrap_or_default();
        let name = if last.is_empty() || last.bytes().all(|byte| byte.is_ascii_digit()) { "value" } else { last };
        if !range.contains(number) {
            let allowed = range.describe(name, kind);
            return self.problem(pointer, format!("{shown} is outside what is possible: {allowed}"));
        }
        if number != 0.0 && !MODEL_NUMBERS.contains(&number.abs()) {
            let (least, most) = (with_unit(*MODEL_NUMBERS.start(), None), with_unit(*MODEL_NUMBERS.end(), kind));
            return self.problem(pointer, format!("{shown} is no number of a model: 0, or {least} to {most} in size"));
        }
        let Some((low, high)) = typical(schema) else { return };
        if !(low..=high).contains(&number) {
            let usual = format!("{} to {}", with_unit(low, None), with_unit(high, kind));
            self.findings.hints.push(Violation::new(pointer, format!("{shown} is outside what is usual: {usual}")));
        }
    }

    fn check_word(&mut self, words: &[&str], value: &Value, pointer: &str) {
        let fits = value.as_str().is_some_and(|word| words.contains(&word));
        if !fits {
            let near = value.as_str().and_then(|word| nearest(word, words.iter().copied()));
            self.problem(pointer, refusal(value, near, &quoted(words)));
        }
    }

    fn check_object(&mut self, schema: &Value, object: &Map<String, Value>, pointer: &str) {
        let properties = schema.get("properties").and_then(Value::as_object);
        let others = schema.get("additionalProperties").filter(|others| others.is_object());
        let known = self.known_keys(schema);
        for (key, member) in object {
            let place = format!("{pointer}{}", pointer_token(key));
            let property = properties.and_then(|all| all.get(key)).or(others);
            let is_free = properties.is_none_or(|all| !all.contains_key(key)) && others.is_some();
            match property {
                _ if is_free && !is_name(key) => self.problem(&place, no_name(key)),
                _ if member.is_null() && (property.is_some() || known.is_none()) => {}
                Some(property) => self.check(property, member, &place),
                None => {
                    if let Some(keys) = known.as_ref().filter(|keys| !keys.contains(key)) {
                        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
                        self.problem(&place, format!("unknown key{}", advice(key, "keys here", &keys, '`')));
                    }
                }
            }
        }
        for key in schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str) {
            if object.get(key).is_none_or(Value::is_null) {
                let wanted = properties.and_then(|all| all.get(key)).map(|property| describe(self.root, property));
                let wanted = wanted.map_or_else(String::new, |wanted| format!(": {wanted}"));
                self.problem(pointer, format!("the key `{key}` is missing{wanted}"));
            }
        }
    }

    /// All keys of a closed object, also those its alternatives evaluate; `None` when other keys are allowed.
    fn known_keys(&self, schema: &Value) -> Option<Vec<String>> {
        let closed = |keyword: &str| schema.get(keyword) == Some(&Value::Bool(false));
        let mut keys = Vec::new();
        collect_keys(schema, &mut keys);
        if closed("unevaluatedProperties") {
            let parts = ["allOf", "oneOf", "anyOf"].into_iter().filter_map(|keyword| schema.get(keyword)?.as_array());
            parts.flatten().for_each(|part| collect_keys(&resolve(self.root, part), &mut keys));
            return Some(keys);
        }
        closed("additionalProperties").then_some(keys)
    }

    fn check_list(&mut self, schema: &Value, entries: &[Value], pointer: &str) {
        let limit = |keyword: &str| schema.get(keyword).and_then(Value::as_u64);
        let (least, most, count) = (limit("minItems"), limit("maxItems"), entries.len() as u64);
        if least.is_some_and(|least| count < least) || most.is_some_and(|most| count > most) {
            let allowed = match (least, most) {
                (Some(least), Some(most)) if least == most => format!("exactly {least}"),
                (Some(least), Some(most)) => format!("{least} to {most}"),
                (Some(least), None) => format!("at least {least}"),
                (None, most) => format!("at most {}", most.unwrap_or(0)),
            };
            let entries = if count == 1 { "entry" } else { "entries" };
            self.problem(pointer, format!("{count} {entries} where {allowed} belong"));
        }
        let first = schema.get("prefixItems").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let rest = schema.get("items");
        for (index, entry) in entries.iter().enumerate() {
            if let Some(part) = first.get(index).or(rest) {
                self.check(part, entry, &format!("{pointer}/{index}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde_json::json;

    use super::*;
    use crate::prelude::*;

    #[derive(JsonSchema)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    #[allow(dead_code)]
    enum Tagged {
        Disc { radius: Length },
        Tree(Tree),
    }

    #[derive(JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Tree {
        weight: f64,
        pair: Option<(u32, String)>,
        children: Option<Vec<Tree>>,
    }

    #[derive(JsonSchema)]
    #[serde(untagged)]
    #[allow(dead_code)]
    enum Untagged {
        One(Length),
        Many(Vec<Length>),
        Named { name: String, at: Time },
    }

    fn problems<T: JsonSchema>(value: Value) -> Vec<String> {
        let findings = walk(&schemars::schema_for!(T).to_value(), &value);
        findings.problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn an_internally_tagged_variant_is_known_by_its_word() {
        assert!(problems::<Tagged>(json!({"kind": "disc", "radius": "2 mm"})).is_empty());
        let seen = problems::<Tagged>(json!({"kind": "disc", "radius": "2 h"}));
        assert_eq!(seen, ["/radius: \"2 h\" is a time; a length such as 2 or \"2 um\" belongs here"]);
        let seen = problems::<Tagged>(json!({"kind": "dics", "radius": 2}));
        let allowed = r#"(allowed: {"kind": "disc", …}, {"kind": "tree", …})"#;
        let message = format!(r#"{{"kind":"dics","radius":2}} is not allowed here; did you mean "disc"? {allowed}"#);
        assert_eq!(seen, [message]);
        assert_eq!(problems::<Tagged>(json!({"kind": "tree", "weight": "x"})), ["/weight: \"x\" is not a number"]);
    }

    #[test]
    fn a_recursive_schema_is_walked_to_its_leaves() {
        let leaf = json!({"weight": 1, "pair": [-1, 2], "colour": 3});
        let seen = problems::<Tree>(json!({"weight": 1, "children": [{"weight": 2, "children": [leaf]}]}));
        let expected = [
            "/children/0/children/0/pair/0: -1 is outside what is possible: value ≥ 0",
            "/children/0/children/0/pair/1: 2 is not a text",
            "/children/0/children/0/colour: unknown key (keys here: weight, pair, children)",
        ];
        assert_eq!(seen, expected);
        let large = problems::<Tree>(json!({"weight": 1, "pair": [4_294_967_296_u64, ""]}));
        assert_eq!(large, ["/pair/0: 4294967296 is too large"]);
    }

    #[test]
    fn an_untagged_variant_is_known_by_its_form() {
        for fit in [json!(3), json!("3 mm"), json!([1, "2 um"]), json!({"name": "a", "at": 3})] {
            assert!(problems::<Untagged>(fit).is_empty());
        }
        let cases = [
            (json!([1, "2 h"]), "/1: \"2 h\" is a time; a length such as 2 or \"2 um\" belongs here"),
            (json!({"name": "a"}), "the key `at` is missing: a time such as 1 or \"1 h\""),
            (
                json!(true),
                "true is not allowed here (allowed: a length such as 1 or \"1 um\", a list, an object with the keys name, at)",
            ),
        ];
        for (value, expected) in cases {
            assert_eq!(problems::<Untagged>(value), [expected]);
        }
    }

    #[test]
    fn keys_with_slashes_have_pointers_that_lead_to_them() {
        let value = json!({"weight": 1, "a/b~": 0});
        let findings = walk(&schemars::schema_for!(Tree).to_value(), &value);
        assert_eq!(value.pointer(&findings.problems[0].pointer), Some(&json!(0)));
    }
}
