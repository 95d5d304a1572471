//! A small validator of JSON Schema, independent of the program's own walk: `$ref`, types, members, items, alternatives, words
//! and bounds. Patterns are left to editors.

use serde_json::{Map, Value};

/// What of `value` does not fit `schema`, each with its pointer.
pub fn misfits(root: &Value, schema: &Value, value: &Value, pointer: &str) -> Vec<String> {
    let Value::Object(keywords) = schema else {
        return if schema == &Value::Bool(false) { vec![format!("{pointer}: not allowed")] } else { Vec::new() };
    };
    let mut found = Vec::new();
    if let Some(path) = keywords.get("$ref").and_then(Value::as_str) {
        let target = root.pointer(path.strip_prefix('#').unwrap()).unwrap_or_else(|| panic!("{path} leads nowhere"));
        found.extend(misfits(root, target, value, pointer));
    }
    for part in list(keywords, "allOf") {
        found.extend(misfits(root, part, value, pointer));
    }
    let fitting =
        |branches: &[Value]| branches.iter().filter(|one| misfits(root, one, value, pointer).is_empty()).count();
    for (keyword, one) in [("anyOf", false), ("oneOf", true)] {
        let branches = list(keywords, keyword);
        let count = fitting(branches);
        if !branches.is_empty() && (count == 0 || one && count > 1) {
            found.push(format!("{pointer}: {value} fits {count} branches of {keyword}"));
        }
    }
    let words = keywords.get("const").map(std::slice::from_ref).unwrap_or(list(keywords, "enum"));
    if !words.is_empty() && !words.contains(value) {
        found.push(format!("{pointer}: {value} is none of {words:?}"));
    }
    let types = match keywords.get("type") {
        Some(Value::Array(types)) => types.as_slice(),
        one => one.map(std::slice::from_ref).unwrap_or_default(),
    };
    // Patterns of units are left to the tests of units; that of an expression is short.
    let is_expression = keywords.get("pattern").and_then(Value::as_str) == Some("^=");
    if is_expression && value.as_str().is_some_and(|text| !text.starts_with('=')) {
        found.push(format!("{pointer}: {value} is no expression"));
    }
    if !types.is_empty() && !types.iter().any(|name| is_of_type(value, name.as_str().unwrap())) {
        found.push(format!("{pointer}: {value} is of none of the types {types:?}"));
    }
    match value {
        Value::Object(members) => found.extend(misfits_of_members(root, keywords, members, pointer)),
        Value::Array(entries) => {
            let count = |keyword: &str| keywords.get(keyword).and_then(Value::as_u64).map(|count| count as usize);
            if count("minItems").is_some_and(|least| entries.len() < least)
                || count("maxItems").is_some_and(|most| entries.len() > most)
            {
                found.push(format!("{pointer}: {} entries", entries.len()));
            }
            for (index, entry) in entries.iter().enumerate() {
                let schema = list(keywords, "prefixItems").get(index).or(keywords.get("items"));
                found.extend(schema.into_iter().flat_map(|s| misfits(root, s, entry, &format!("{pointer}/{index}"))));
            }
        }
        Value::Number(number) => {
            let number = number.as_f64().unwrap();
            let breaks = |keyword: &str, breaks: fn(f64, f64) -> bool| {
                keywords.get(keyword).and_then(Value::as_f64).is_some_and(|bound| breaks(number, bound))
            };
            let low =
                breaks("minimum", |number, least| number < least) || breaks("exclusiveMinimum", |x, above| x <= above);
            let high =
                breaks("maximum", |number, most| number > most) || breaks("exclusiveMaximum", |x, below| x >= below);
            if low || high {
                found.push(format!("{pointer}: {number} is out of range"));
            }
        }
        _ => {}
    }
    found
}

fn misfits_of_members(
    root: &Value,
    keywords: &Map<String, Value>,
    members: &Map<String, Value>,
    pointer: &str,
) -> Vec<String> {
    let mut found = Vec::new();
    for (key, member) in members {
        let property = keywords.get("properties").and_then(|all| all.get(key));
        if let Some(schema) = property.or(keywords.get("additionalProperties")) {
            found.extend(misfits(root, schema, member, &format!("{pointer}/{key}")));
        }
    }
    for key in list(keywords, "required").iter().filter_map(Value::as_str).filter(|key| !members.contains_key(*key)) {
        found.push(format!("{pointer}: {key} is missing"));
    }
    found
}

fn list<'a>(keywords: &'a Map<String, Value>, keyword: &str) -> &'a [Value] {
    keywords.get(keyword).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn is_of_type(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => panic!("{name} is no type"),
    }
}
