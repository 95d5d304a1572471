//! Overrides from the command line: `--without NAME` and `--set /json/pointer=value`, applied to the merged document in this order.

use serde_json::{Map, Value};

use super::read;
use super::suggest::full_advice;
use crate::model::violation::Violation;

/// Pointers of `--set` may have this many tokens.
const DEEPEST_POINTER: usize = 64;

/// Marks each named mechanism as removed. `names` are all mechanisms there are; one that the scene does not have gives a hint.
pub fn remove_blocks(
    document: &mut Value,
    without: &[String],
    names: &[&str],
    problems: &mut Vec<Violation>,
    hints: &mut Vec<Violation>,
) {
    for name in without {
        if !names.contains(&name.as_str()) {
            let message = format!("--without {name}: no such mechanism{}", full_advice(name, "mechanisms", names, '`'));
            problems.push(Violation::new("", message));
            continue;
        }
        let Some(object) = document.as_object_mut() else { return };
        if object.get(name).is_none_or(Value::is_null) {
            hints.push(Violation::new("", format!("--without {name}: the scene has no `{name}` to begin with")));
        }
        object.insert(name.clone(), Value::Null);
    }
}

/// Sets the value at a pointer, from `/json/pointer=value`, and returns the pointer. The value is JSON, or else a text. Objects on
/// the way are made; a list takes an index or, at its end, `-`; `null` removes.
///
/// # Errors
/// A violation that names the override, when it has no `=`, its pointer is none, or leads through a value that has no keys.
pub fn set(document: &mut Value, override_: &str) -> Result<String, Violation> {
    let refuse = |message: String| Violation::new("", format!("--set {override_}: {message}"));
    let (pointer, text) = override_
        .split_once('=')
        .ok_or_else(|| refuse("no `=`; write /pointer=value, such as /time/step=0.5".to_owned()))?;
    let Some(path) = pointer.strip_prefix('/') else {
        let dotted = pointer.replace('.', "/");
        return Err(refuse(format!("`{pointer}` is not a JSON pointer; did you mean `/{dotted}`?")));
    };
    let tokens: Vec<String> = path.split('/').map(|token| token.replace("~1", "/").replace("~0", "~")).collect();
    if tokens.len() > DEEPEST_POINTER {
        return Err(refuse(format!("the pointer is deeper than {DEEPEST_POINTER} keys")));
    }
    let value = parse_value(text).map_err(refuse)?;
    place(document, &tokens, value).map_err(refuse)?;
    Ok(pointer.to_owned())
}

/// JSON, or a text when it does not look like a list, an object or a quoted text.
fn parse_value(text: &str) -> Result<Value, String> {
    match read::parse(text) {
        Ok(value) => Ok(value),
        Err(error) if text.trim_start().starts_with(['{', '[', '"']) => Err(error.to_string()),
        Err(_) => Ok(Value::String(text.to_owned())),
    }
}

fn place(document: &mut Value, tokens: &[String], value: Value) -> Result<(), String> {
    let mut target = document;
    for (depth, token) in tokens.iter().enumerate() {
        let passed = tokens[..depth].iter().map(|token| format!("/{token}")).collect::<String>();
        if target.is_null() {
            *target = Value::Object(Map::new());
        }
        target = match target {
            Value::Object(object) => object.entry(token.as_str()).or_insert(Value::Null),
            Value::Array(entries) => {
                let count = entries.len();
                let index = if token == "-" { Some(count) } else { token.parse().ok() };
                let index = index.filter(|&index| index <= count).ok_or_else(|| {
                    format!("`{passed}` is a list of {count}; `{token}` is no index into it (`-` adds an entry)")
                })?;
                if index == count {
                    entries.push(Value::Null);
                }
                &mut entries[index]
            }
            other => return Err(format!("`{passed}` is {other}, which has no keys")),
        };
    }
    *target = value;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_pointer_sets_makes_and_removes() {
        let mut value = json!({"time": {"step": 1}, "heights": [0.1, 0.2]});
        for text in [
            "/time/step=20 min",
            "/a/b~1c=1e-3",
            "/heights/1=0.5",
            "/heights/-=0.75",
            "/time/method=heun",
            "/x=null",
            "/e=",
        ] {
            set(&mut value, text).unwrap();
        }
        let expected = json!({"time": {"step": "20 min", "method": "heun"}, "heights": [0.1, 0.5, 0.75], "a": {"b/c": 1e-3}, "x": null, "e": ""});
        assert_eq!(value, expected);
        set(&mut value, "/time={\"step\": 2}").unwrap();
        assert_eq!(value["time"], json!({"step": 2}));
    }

    #[test]
    fn a_bad_override_says_what_is_wrong() {
        let cases = [
            ("time/step=1", "--set time/step=1: `time/step` is not a JSON pointer; did you mean `/time/step`?"),
            ("time.step=1", "--set time.step=1: `time.step` is not a JSON pointer; did you mean `/time/step`?"),
            ("/time/step", "--set /time/step: no `=`; write /pointer=value, such as /time/step=0.5"),
            ("/time/step/x=1", "--set /time/step/x=1: `/time/step` is 1, which has no keys"),
            ("/h/7=1", "--set /h/7=1: `/h` is a list of 1; `7` is no index into it (`-` adds an entry)"),
            ("/time={\"step\"", "--set /time={\"step\": not JSON: EOF while parsing an object at line 1 column 7"),
        ];
        for (text, message) in cases {
            let mut value = json!({"time": {"step": 1}, "h": [0]});
            assert_eq!(set(&mut value, text).unwrap_err().to_string(), message);
        }
        let deep = format!("{}=1", "/a".repeat(100_000));
        assert!(set(&mut json!({}), &deep).is_err());
    }

    #[test]
    fn an_unknown_mechanism_cannot_be_left_out() {
        let (mut problems, mut hints) = (Vec::new(), Vec::new());
        let mut value = json!({"borders": {}});
        let without = ["border", "cues", "borders"].map(str::to_owned);
        remove_blocks(&mut value, &without, &["borders", "cues"], &mut problems, &mut hints);
        assert_eq!(value, json!({"borders": null, "cues": null}));
        assert_eq!(problems.len(), 1);
        assert_eq!(
            problems[0].to_string(),
            "--without border: no such mechanism; did you mean `borders`? (mechanisms: borders, cues)"
        );
        assert_eq!(hints[0].to_string(), "--without cues: the scene has no `cues` to begin with");
    }
}
