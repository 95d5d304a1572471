//! What single schemas say: where a `$ref` leads, which types, words, kinds and keys are allowed, and all that in words.

use std::borrow::Cow;

use serde_json::{Map, Value};

use crate::model::quantity::Kind;

/// Values are shown in messages up to this many characters.
const SHOWN_CHARACTERS: usize = 60;

/// References are followed this far; a chain that is longer leads nowhere.
const LONGEST_REFERENCE: usize = 32;

/// The text of a documentation comment without the escapes that rustdoc wants.
pub(super) fn unescaped(text: &str) -> String {
    text.replace("\\[", "[").replace("\\]", "]")
}

/// The schema a `$ref` leads to, with the keywords beside the `$ref` on top.
pub(super) fn resolve<'s>(root: &'s Value, schema: &'s Value) -> Cow<'s, Value> {
    let mut beside = Vec::new();
    let mut target = schema;
    for _ in 0..LONGEST_REFERENCE {
        let Some(next) = target.get("$ref").and_then(Value::as_str).and_then(|path| path.strip_prefix('#')) else {
            break;
        };
        beside.extend(target.as_object().into_iter().flatten().filter(|(key, _)| *key != "$ref"));
        let Some(found) = root.pointer(next) else { break };
        target = found;
    }
    if beside.is_empty() {
        return Cow::Borrowed(target);
    }
    let mut merged = target.as_object().cloned().unwrap_or_default();
    for (key, keyword) in beside.into_iter().rev() {
        match (merged.get_mut(key), keyword) {
            (Some(Value::Object(below)), Value::Object(above)) => below.extend(above.clone()),
            _ => {
                merged.insert(key.clone(), keyword.clone());
            }
        }
    }
    Cow::Owned(Value::Object(merged))
}

/// Adds the property names of a schema that `keys` does not hold yet.
pub(super) fn collect_keys(schema: &Value, keys: &mut Vec<String>) {
    for key in schema.get("properties").and_then(Value::as_object).into_iter().flat_map(Map::keys) {
        if !keys.contains(key) {
            keys.push(key.clone());
        }
    }
}

/// The kind of a quantity's schema.
pub(super) fn kind_of(schema: &Value) -> Option<Kind<'_>> {
    let text = |keyword: &str| schema.get(keyword).and_then(Value::as_str);
    Some(Kind { name: text("x-quantity")?, unit: text("x-unit")? })
}

/// The words of a schema that allows only words.
pub(super) fn words_of(schema: &Value) -> Option<Vec<&str>> {
    if let Some(word) = schema.get("const").and_then(Value::as_str) {
        return Some(vec![word]);
    }
    let words = schema.get("enum")?.as_array()?;
    words.iter().filter(|word| !word.is_null()).map(Value::as_str).collect()
}

/// The alternatives of a schema.
pub(super) fn branches_of(schema: &Value) -> Option<&[Value]> {
    schema.get("oneOf").or_else(|| schema.get("anyOf"))?.as_array().map(Vec::as_slice)
}

/// The JSON types a schema names.
pub(super) fn types_of(schema: &Value) -> impl Iterator<Item = &str> {
    let (one, several) = match schema.get("type") {
        Some(Value::String(name)) => (Some(name.as_str()), &[][..]),
        Some(Value::Array(names)) => (None, names.as_slice()),
        _ => (None, &[][..]),
    };
    one.into_iter().chain(several.iter().filter_map(Value::as_str))
}

/// Whether a schema allows values of this JSON type; a whole number is a number too.
pub(super) fn has_type(schema: &Value, value: &Value) -> bool {
    let names: &[&str] = match value {
        Value::Null => &["null"],
        Value::Bool(_) => &["boolean"],
        Value::Number(_) => &["number", "integer"],
        Value::String(_) => &["string"],
        Value::Array(_) => &["array"],
        Value::Object(_) => &["object"],
    };
    let mut types = types_of(schema).peekable();
    schema != &Value::Bool(false) && (types.peek().is_none() || types.any(|name| names.contains(&name)))
}

/// What a schema allows, in words.
pub(super) fn describe(root: &Value, schema: &Value) -> String {
    let schema = resolve(root, schema);
    if let Some(kind) = kind_of(&schema) {
        return kind.wanted(example_of(&schema));
    }
    if let Some(words) = words_of(&schema) {
        return quoted(&words);
    }
    if let Some(branches) = branches_of(&schema) {
        let named = branches.iter().filter(|branch| !types_of(branch).eq(["null"]));
        return named.map(|branch| describe(root, branch)).collect::<Vec<_>>().join(", ");
    }
    let mut keys = Vec::new();
    collect_keys(&schema, &mut keys);
    let name = types_of(&schema).find(|name| *name != "null");
    match name {
        Some("object") if keys.len() == 1 => format!("{{\"{}\": …}}", keys[0]),
        Some("object") if !keys.is_empty() => format!("an object with the keys {}", keys.join(", ")),
        Some("object") => "an object".to_owned(),
        Some("array") => "a list".to_owned(),
        Some("string") => "a text".to_owned(),
        Some("integer") => "a whole number".to_owned(),
        Some("number") => "a number".to_owned(),
        Some("boolean") => "true or false".to_owned(),
        _ => "allowed here".to_owned(),
    }
}

/// Words in quotation marks, as a list.
pub(super) fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// The message about a value that is none of those allowed.
pub(super) fn refusal(value: &Value, near: Option<&str>, allowed: &str) -> String {
    let near = near.map_or_else(String::new, |near| format!("; did you mean \"{near}\"?"));
    format!("{} is not allowed here{near} (allowed: {allowed})", show(value))
}

/// A value as JSON, cut when long.
pub(super) fn show(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(SHOWN_CHARACTERS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// A number that could stand here: the default, or 1.
pub(super) fn example_of(schema: &Value) -> f64 {
    schema.get("default").and_then(Value::as_f64).unwrap_or(1.0)
}

/// The tail of a message about a number that is not whole.
pub(super) fn whole_limit(schema: &Value) -> &'static str {
    match schema.get("format").and_then(Value::as_str) {
        Some("uint64") => " from 0 to 18446744073709551615, written without point or exponent",
        _ => ", written without point or exponent",
    }
}

/// Whether a whole number fits the integer type behind a schema.
pub(super) fn fits_format(schema: &Value, value: &Value) -> bool {
    match schema.get("format").and_then(Value::as_str) {
        Some("uint32") => value.as_i64().is_some_and(|number| number <= i64::from(u32::MAX)),
        Some("int32") => value.as_i64().is_some_and(|number| i32::try_from(number).is_ok()),
        Some("int64" | "int") => value.is_i64(),
        _ => true,
    }
}
