//! Merge patches, RFC 7396, with one difference of form: a member that is `null` stays in the document as a mark of removal until
//! [`strip_nulls`], so that the names of removed keys can be checked too. A misspelt `"fasiculation": null` would else pass
//! unnoticed and ablate nothing. `strip_nulls(merge(a, b))` is what the RFC gives for documents in which null means absent.

use serde_json::{Map, Value};

use crate::model::violation::{Violation, pointer_token};

/// Puts `patch` on `target`: objects member by member, anything else replaced as a whole, `null` members kept as marks of removal.
pub fn merge(target: &mut Value, patch: Value) {
    let Value::Object(members) = patch else {
        *target = patch;
        return;
    };
    if !target.is_object() {
        *target = Value::Object(Map::new());
    }
    let Value::Object(object) = target else { return };
    for (key, member) in members {
        if member.is_null() {
            object.insert(key, member);
        } else {
            merge(object.entry(key).or_insert(Value::Null), member);
        }
    }
}

/// Removes every object member that is `null`, at any depth, and keeps the order of the others.
pub fn strip_nulls(value: &mut Value) {
    match value {
        Value::Object(object) => {
            object.retain(|_, member| !member.is_null());
            object.values_mut().for_each(strip_nulls);
        }
        Value::Array(entries) => entries.iter_mut().for_each(strip_nulls),
        _ => {}
    }
}

/// The removals of `patch` that find nothing to remove in `target`.
pub fn idle_removals(target: &Value, patch: &Value, pointer: &str, found: &mut Vec<Violation>) {
    let Value::Object(members) = patch else { return };
    for (key, member) in members {
        let place = format!("{pointer}{}", pointer_token(key));
        match (member, target.get(key)) {
            (Value::Null, None | Some(Value::Null)) => {
                found.push(Violation::new(place, "null removes nothing: the base does not set this key"));
            }
            (Value::Object(_), Some(below)) => idle_removals(below, member, &place, found),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_examples_of_the_standard_hold() {
        let cases = [
            (json!({"a": "b"}), json!({"a": "c"}), json!({"a": "c"})),
            (json!({"a": "b"}), json!({"b": "c"}), json!({"a": "b", "b": "c"})),
            (json!({"a": "b"}), json!({"a": null}), json!({})),
            (json!({"a": "b", "b": "c"}), json!({"a": null}), json!({"b": "c"})),
            (json!({"a": ["b"]}), json!({"a": "c"}), json!({"a": "c"})),
            (json!({"a": "c"}), json!({"a": ["b"]}), json!({"a": ["b"]})),
            (json!({"a": {"b": "c"}}), json!({"a": {"b": "d", "c": null}}), json!({"a": {"b": "d"}})),
            (json!({"a": [{"b": "c"}]}), json!({"a": [1]}), json!({"a": [1]})),
            (json!(["a", "b"]), json!(["c", "d"]), json!(["c", "d"])),
            (json!({"a": "b"}), json!(["c"]), json!(["c"])),
            (json!({"a": "foo"}), json!(null), json!(null)),
            (json!({"a": "foo"}), json!("bar"), json!("bar")),
            // The standard keeps the null of the target; here null is absence everywhere.
            (json!({"e": null}), json!({"a": 1}), json!({"a": 1})),
            (json!([1, 2]), json!({"a": "b", "c": null}), json!({"a": "b"})),
            (json!({}), json!({"a": {"bb": {"ccc": null}}}), json!({"a": {"bb": {}}})),
        ];
        for (mut target, patch, expected) in cases {
            merge(&mut target, patch);
            strip_nulls(&mut target);
            assert_eq!(target, expected);
        }
    }

    #[test]
    fn a_removed_object_can_be_set_anew() {
        let mut value = json!({"a": {"b": 1, "c": 2}});
        merge(&mut value, json!({"a": null}));
        assert_eq!(value, json!({"a": null}));
        merge(&mut value, json!({"a": {"d": 3}}));
        assert_eq!(value, json!({"a": {"d": 3}}));
    }

    #[test]
    fn a_removal_that_finds_nothing_is_told() {
        let mut found = Vec::new();
        idle_removals(&json!({"a": {"b": 1}}), &json!({"a": {"b": null, "c": null}, "x/y": null}), "", &mut found);
        let places: Vec<_> = found.iter().map(|hint| hint.pointer.as_str()).collect();
        assert_eq!(places, ["/a/c", "/x~1y"]);
    }
}
