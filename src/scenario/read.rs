//! JSON from a file or a text: limits on size and depth, and no key given twice.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::string::FromUtf8Error;

use serde::de::{DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use thiserror::Error;

use crate::model::violation::pointer_token;

/// The largest file read, in bytes.
pub const LARGEST_FILE: u64 = 16 << 20;

/// What is said of a pipe, a device or a folder in the place of a file.
pub const NO_FILE: &str = "no file to be read from its beginning to its end";

/// Why a file or a text gave no JSON value. Nesting deeper than 128 levels counts as [`ReadError::NotJson`].
#[derive(Debug, Error)]
pub enum ReadError {
    /// There is no such file.
    #[error("{}: no such file", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The path is a directory.
    #[error("{}: a directory, not a file", path.display())]
    Directory {
        /// The path.
        path: PathBuf,
    },
    /// The path is a pipe or a device.
    #[error("{}: {NO_FILE}", path.display())]
    NoFile {
        /// The path.
        path: PathBuf,
    },
    /// The system refused to read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is larger than [`LARGEST_FILE`].
    #[error("{}: larger than {} MiB", path.display(), LARGEST_FILE >> 20)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// The file is no UTF-8 text.
    #[error("{}: not UTF-8 text (the byte at {at} cannot stand there)", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The offset of the first byte at fault.
        at: usize,
    },
    /// The text is no JSON; line and column stand in the message.
    #[error("not JSON: {0}")]
    NotJson(#[from] serde_json::Error),
    /// A key is given more than once; where, as JSON pointers.
    #[error("given more than once: {}", pointers.join(", "))]
    Duplicate {
        /// The places.
        pointers: Vec<String>,
    },
}

/// Reads a JSON file.
///
/// # Errors
/// A [`ReadError`]; those that do not name the file are about its content.
pub fn read_file(path: &Path) -> Result<Value, ReadError> {
    parse(&read_text(path)?)
}

/// Reads a text of at most [`LARGEST_FILE`], without a byte order mark.
///
/// # Errors
/// A [`ReadError`] that names the file.
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    let owned = || path.to_path_buf();
    let unreadable = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => ReadError::Missing { path: owned() },
        std::io::ErrorKind::IsADirectory => ReadError::Directory { path: owned() },
        _ => ReadError::Unreadable { path: owned(), source },
    };
    if path.is_dir() {
        return Err(ReadError::Directory { path: owned() });
    }
    // A pipe with a name may keep the reader waiting for ever; one that a shell hands over, as in `<(…)`, has its writer.
    if std::fs::metadata(path).is_ok_and(|data| !data.is_file())
        && !path.starts_with("/dev")
        && !path.starts_with("/proc")
    {
        return Err(ReadError::NoFile { path: owned() });
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(ReadError::TooLarge { path: owned() });
    }
    let not_text = |error: FromUtf8Error| ReadError::NotText { path: owned(), at: error.utf8_error().valid_up_to() };
    let text = String::from_utf8(bytes).map_err(not_text)?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Reads a JSON text.
///
/// # Errors
/// [`ReadError::NotJson`] with line and column, or [`ReadError::Duplicate`] with all places.
pub fn parse(text: &str) -> Result<Value, ReadError> {
    let mut pointers = Vec::new();
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let reader = Reader { pointer: String::new(), duplicates: &mut pointers };
    let value = reader.deserialize(&mut deserializer)?;
    deserializer.end()?;
    if pointers.is_empty() { Ok(value) } else { Err(ReadError::Duplicate { pointers }) }
}

/// Builds a value and notes the keys that come twice.
struct Reader<'a> {
    pointer: String,
    duplicates: &'a mut Vec<String>,
}

impl<'de> DeserializeSeed<'de> for Reader<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Reader<'_> {
    type Value = Value;

    fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("any JSON value")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Value, E> {
        Number::from_f64(value).map(Value::Number).ok_or_else(|| E::custom("a number that is not finite"))
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(Value::String(value.to_owned()))
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Value, A::Error> {
        let mut entries = Vec::new();
        loop {
            let pointer = format!("{}/{}", self.pointer, entries.len());
            match sequence.next_element_seed(Reader { pointer, duplicates: self.duplicates })? {
                Some(entry) => entries.push(entry),
                None => return Ok(Value::Array(entries)),
            }
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(key) = map.next_key::<String>()? {
            let pointer = format!("{}{}", self.pointer, pointer_token(&key));
            if object.contains_key(&key) {
                self.duplicates.push(pointer.clone());
            }
            let member = map.next_value_seed(Reader { pointer, duplicates: self.duplicates })?;
            object.insert(key, member);
        }
        Ok(Value::Object(object))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_text_reads_as_serde_json_reads_it() {
        let text = r#"{"a": [1, -2, 0.1, 1e-7, true, null, "x"], "b": {"c": 18446744073709551615}}"#;
        assert_eq!(parse(text).unwrap(), serde_json::from_str::<Value>(text).unwrap());
        assert_eq!(parse("3").unwrap(), json!(3));
    }

    #[test]
    fn what_is_not_json_is_refused_with_its_place() {
        let deep = "[".repeat(100_000);
        let cases = [
            ("{\"a\": 1,\n \"b\": }", "not JSON: expected value at line 2 column 7"),
            ("{} x", "not JSON: trailing characters at line 1 column 4"),
            ("", "not JSON: EOF while parsing a value at line 1 column 0"),
            ("{\"a\": 1e400}", "not JSON: number out of range at line 1 column 11"),
            (deep.as_str(), "not JSON: recursion limit exceeded at line 1 column 128"),
            ("{\"a\": 1, \"b\": [{\"c\": 1, \"c\": 2}], \"a\": 3}", "given more than once: /b/0/c, /a"),
        ];
        for (text, message) in cases {
            assert_eq!(parse(text).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn a_file_that_cannot_be_read_says_why() {
        let directory = std::env::temp_dir().join(format!("tropism-read-{}", std::process::id()));
        std::fs::create_dir_all(&directory).unwrap();
        let name = directory.display();
        let missing = read_file(&directory.join("no.json")).unwrap_err();
        assert_eq!(missing.to_string(), format!("{name}/no.json: no such file"));
        assert_eq!(read_file(&directory).unwrap_err().to_string(), format!("{name}: a directory, not a file"));
        let file = directory.join("latin.json");
        std::fs::write(&file, b"{\"name\": \"\xe9\"}").unwrap();
        let message = read_file(&file).unwrap_err().to_string();
        assert_eq!(message, format!("{name}/latin.json: not UTF-8 text (the byte at 10 cannot stand there)"));
        std::fs::write(&file, b"\xef\xbb\xbf{\"seed\": 2}").unwrap();
        assert_eq!(read_file(&file).unwrap(), json!({"seed": 2}));
        std::fs::write(&file, vec![b' '; LARGEST_FILE as usize + 1]).unwrap();
        assert_eq!(read_file(&file).unwrap_err().to_string(), format!("{name}/latin.json: larger than 16 MiB"));
        std::fs::remove_dir_all(&directory).unwrap();
    }
}
