//! The schema of scenes for editors: what the program accepts, said in keywords that any validator of JSON Schema knows.
//!
//! It differs from the schema of [`full_schema`], along which the program itself walks, where that walk knows more than
//! keywords say: `null` removes a key wherever one may be absent; a text must have a unit of the right dimension; and a file
//! with a `base` is a patch, which may give some keys of an object only, or `null` for the variant that it replaces; and an expression may stand for any number. So
//! nothing that loads is refused; that a key is missing, only loading tells.

use serde_json::{Map, Value, json};

use super::schema::{BlockSchema, full_schema};
use super::schema_view::{kind_of, unescaped, words_of};
use crate::model::quantity::Kind;
use crate::model::unit_pattern::pattern_of;

/// What a text that is an expression fits.
const EXPRESSION: &str = "^=";

/// The JSON schema (draft 2020-12) of a scene's file with these blocks.
pub fn editor_schema(blocks: &[BlockSchema]) -> Value {
    let mut schema = full_schema(blocks);
    let mut kinds = Map::new();
    loosen(&mut schema, &mut kinds);
    if let Some(Value::Object(definitions)) = schema.get_mut("$defs") {
        definitions.extend(kinds);
    }
    schema
}

/// Changes a schema and all inside it; gathers the definitions of the kinds of quantities.
fn loosen(schema: &mut Value, kinds: &mut Map<String, Value>) {
    match schema {
        Value::Object(keywords) => {
            if let Some(Value::String(text)) = keywords.get_mut("description") {
                *text = unescaped(text);
            }
            for (keyword, member) in keywords.iter_mut() {
                if !["default", "enum", "const", "examples", "x-typical"].contains(&keyword.as_str()) {
                    loosen(member, kinds);
                }
            }
            name_kind(schema, kinds);
            if let Value::Object(keywords) = schema {
                allow_expression(keywords);
                allow_other_tags(keywords);
                allow_absence(keywords);
            }
        }
        Value::Array(entries) => entries.iter_mut().for_each(|entry| loosen(entry, kinds)),
        _ => {}
    }
}

/// Lets the texts of a quantity fit the pattern of its kind.
fn name_kind(schema: &mut Value, kinds: &mut Map<String, Value>) {
    let Some((name, definition)) = kind_of(schema).and_then(definition_of) else { return };
    let known = kinds.entry(name.clone()).or_insert_with(|| definition.clone());
    let same = *known == definition;
    let Value::Object(keywords) = schema else { return };
    if same {
        keywords.insert("$ref".to_owned(), json!(format!("#/$defs/{name}")));
    } else if let Value::Object(definition) = definition {
        keywords.extend(definition);
    }
}

fn definition_of(kind: Kind<'_>) -> Option<(String, Value)> {
    let pattern = format!("{EXPRESSION}|{}", pattern_of(kind).ok()?);
    let message = format!("{} belongs here", kind.wanted(1.0));
    let name = format!("quantity.{}", kind.name.replace(' ', "_"));
    Some((name, json!({ "pattern": pattern, "patternErrorMessage": message })))
}

/// Lets an expression stand for a number that is no quantity.
fn allow_expression(keywords: &mut Map<String, Value>) {
    if let Some(number) = keywords.get("type").filter(|word| **word == "integer" || **word == "number").cloned() {
        keywords.insert("type".to_owned(), json!([number, "string"]));
        keywords.insert("pattern".to_owned(), json!(EXPRESSION));
    }
}

/// The key of an externally tagged variant.
fn tag_of(branch: &Value) -> Option<String> {
    let properties = branch.get("properties")?.as_object()?;
    let required = branch.get("required")?.as_array()?;
    let key = properties.keys().next()?;
    (properties.len() == 1 && required.len() == 1 && required[0] == json!(key)).then(|| key.clone())
}

/// Lets a patch remove the variants that it does not give.
fn allow_other_tags(keywords: &mut Map<String, Value>) {
    for keyword in ["oneOf", "anyOf"] {
        let Some(Value::Array(branches)) = keywords.get_mut(keyword) else { continue };
        let tags: Vec<String> = branches.iter().filter_map(tag_of).collect();
        for branch in branches.iter_mut() {
            let Some(own) = tag_of(branch) else { continue };
            let Some(Value::Object(properties)) = branch.get_mut("properties") else { continue };
            properties
                .extend(tags.iter().filter(|tag| **tag != own).map(|tag| (tag.clone(), json!({ "type": "null" }))));
        }
    }
}

/// Lets every key be `null` or missing that does not tell one variant from another.
fn allow_absence(keywords: &mut Map<String, Value>) {
    let is_variant = keywords.get("properties").and_then(Value::as_object).is_some_and(|keys| {
        let needed = keywords.get("required").and_then(Value::as_array).map_or(0, Vec::len);
        keys.len() == 1 && needed == 1 || keys.values().any(|key| key.get("const").is_some())
    });
    if is_variant {
        return;
    }
    keywords.shift_remove("required");
    if let Some(Value::Object(properties)) = keywords.get_mut("properties") {
        properties.values_mut().for_each(allow_null);
    }
    if let Some(others) = keywords.get_mut("additionalProperties").filter(|others| others.is_object()) {
        allow_null(others);
    }
}

fn allow_null(schema: &mut Value) {
    let is_kind = kind_of(schema).is_some();
    let is_words = words_of(schema).is_some();
    let Value::Object(keywords) = schema else { return };
    let alternatives = ["anyOf", "oneOf"].into_iter().find(|keyword| keywords.contains_key(*keyword));
    if let Some(Value::Array(branches)) = alternatives.and_then(|keyword| keywords.get_mut(keyword)) {
        let null = json!({ "type": "null" });
        if !branches.contains(&null) {
            branches.push(null);
        }
    } else if (!keywords.contains_key("$ref") || is_kind) && !is_words {
        match keywords.get_mut("type") {
            Some(Value::Array(names)) if !names.contains(&json!("null")) => names.push(json!("null")),
            Some(Value::String(name)) => {
                let names = json!([name, "null"]);
                keywords.insert("type".to_owned(), names);
            }
            _ => {}
        }
    } else {
        let kept = ["description", "default"].map(|keyword| (keyword, keywords.get(keyword).cloned()));
        let inner = std::mem::take(keywords);
        keywords.extend(kept.into_iter().filter_map(|(keyword, value)| Some((keyword.to_owned(), value?))));
        keywords.insert("anyOf".to_owned(), json!([inner, { "type": "null" }]));
    }
}
