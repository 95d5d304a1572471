//! Where a problem of a scene stands in its file: the line, and what to mark in it.
//!
//! A JSON text is followed along a pointer token by token, without building a value. What a base or `--set` brought stands elsewhere
//! and has no excerpt.

use crate::model::violation::Violation;

/// Characters of a line that are shown.
const WIDEST: usize = 100;
/// Characters before the mark that are shown of a longer line.
const BEFORE: usize = 40;

/// A line of a file with a mark under it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// Line, from 1.
    pub line: usize,
    /// Column of the mark, from 1, in characters.
    pub column: usize,
    /// The line, or the part of it around the mark.
    pub text: String,
    /// Characters of `text` before the mark.
    pub indent: usize,
    /// Characters marked.
    pub width: usize,
}

/// The excerpt of a problem from the text of its file; none where the text has no such place.
pub fn excerpt(text: &str, problem: &Violation) -> Option<Excerpt> {
    if problem.message.ends_with("(from --set)") {
        return None;
    }
    if problem.pointer.is_empty() {
        return syntax(text, &problem.message);
    }
    let place = find(text, &problem.pointer)?;
    let of_key = problem.message.starts_with("unknown key");
    let span = place.key.filter(|_| of_key).unwrap_or(place.value);
    Some(around(text, span))
}

/// The excerpt of what is not JSON at all, whose line and column stand in the message.
fn syntax(text: &str, message: &str) -> Option<Excerpt> {
    let (_, place) = message.split_once(": not JSON: ")?.1.rsplit_once(" at line ")?;
    let (line, column) = place.split_once(" column ")?;
    let (line, column): (usize, usize) = (line.parse().ok()?, column.parse().ok()?);
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(end, _)| end + 1));
    let start = starts.take(line).last()?;
    let mut at = (start + column.saturating_sub(1)).min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    Some(around(text, (at, at)))
}

/// Bytes from and to.
type Span = (usize, usize);

/// Where a value and the key in front of it stand.
struct Place {
    key: Option<Span>,
    value: Span,
}

/// Follows an RFC 6901 pointer through a JSON text.
fn find(text: &str, pointer: &str) -> Option<Place> {
    let mut scan = Scan { bytes: text.as_bytes(), at: 0 };
    let mut key = None;
    for token in pointer.strip_prefix('/')?.split('/') {
        let token = token.replace("~1", "/").replace("~0", "~");
        key = scan.enter(text, &token)?;
    }
    scan.skip_space();
    let start = scan.at;
    scan.skip_value()?;
    Some(Place { key, value: (start, scan.at) })
}

/// A place in a text that is being read.
struct Scan<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Scan<'_> {
    /// Goes to the member or entry that a token names; gives the key, if it has one.
    fn enter(&mut self, text: &str, token: &str) -> Option<Option<Span>> {
        self.skip_space();
        let open = self.next()?;
        for index in 0.. {
            self.skip_space();
            let key = match open {
                b'{' => {
                    let start = self.at;
                    self.skip_value()?;
                    let span = (start, self.at);
                    self.skip_space();
                    (self.next()? == b':').then_some(())?;
                    Some(span)
                }
                b'[' => None,
                _ => return None,
            };
            let name = key.map(|(start, end)| serde_json::from_str::<String>(&text[start..end]));
            let found = match name {
                Some(name) => name.is_ok_and(|name| name == token),
                None => token.parse() == Ok(index),
            };
            if found {
                return Some(key);
            }
            self.skip_space();
            self.skip_value()?;
            self.skip_space();
            (self.next()? == b',').then_some(())?;
        }
        None
    }

    fn next(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied();
        self.at += 1;
        byte
    }

    fn skip_space(&mut self) {
        while self.bytes.get(self.at).is_some_and(|byte| byte.is_ascii_whitespace() || !byte.is_ascii() && self.at < 3)
        {
            self.at += 1;
        }
    }

    /// Goes behind the value that begins here: brackets are counted outside of texts.
    fn skip_value(&mut self) -> Option<()> {
        let mut depth = 0usize;
        loop {
            match self.next()? {
                b'"' => self.skip_text()?,
                b'{' | b'[' => depth += 1,
                b'}' | b']' => depth = depth.checked_sub(1)?,
                _ => {}
            }
            let ends = |byte: &u8| byte.is_ascii_whitespace() || b",]}:".contains(byte);
            if depth == 0 && self.bytes.get(self.at).is_none_or(ends) {
                return Some(());
            }
        }
    }

    fn skip_text(&mut self) -> Option<()> {
        loop {
            match self.next()? {
                b'\\' => self.at += 1,
                b'"' => return Some(()),
                _ => {}
            }
        }
    }
}

/// The line of a span, cut to what can be shown.
fn around(text: &str, (start, end): Span) -> Excerpt {
    let line_start = text[..start].rfind('\n').map_or(0, |end| end + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |end| start + end);
    let line: Vec<char> = text[line_start..line_end].trim_end().chars().collect();
    let before = text[line_start..start].chars().count();
    let marked = text[start..end.min(line_end)].trim_end().chars().count().max(1);
    let from = if line.len() > WIDEST { before.saturating_sub(BEFORE) } else { 0 };
    let to = line.len().min(from + WIDEST);
    let shown = line[from.min(to)..to].iter().map(|c| if c.is_control() { ' ' } else { *c });
    Excerpt {
        line: text[..start].matches('\n').count() + 1,
        column: before + 1,
        text: shown.collect(),
        indent: before - from,
        width: marked.min(WIDEST - (before - from).min(WIDEST - 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "{\n  \"seed\": 1,\n  \"time\": { \"stepp\": 1, \"µ\": \"a \\\" }\", \"duration\": \"72\" },\n  \"a/b\": [1, [2, {\"x\": -1}]]\n}";

    /// The words marked, with line and column.
    fn marked(pointer: &str, message: &str) -> Option<(usize, usize, String)> {
        let found = excerpt(TEXT, &Violation::new(pointer, message))?;
        Some((found.line, found.column, found.text.chars().skip(found.indent).take(found.width).collect()))
    }

    #[test]
    fn a_pointer_leads_to_its_value_or_to_its_key() {
        let cases = [
            ("/time/stepp", "unknown key", (3, 13, "\"stepp\"")),
            ("/time/stepp", "1 is not", (3, 22, "1")),
            ("/time/duration", "no unit", (3, 52, "\"72\"")),
            ("/a~1b/1/1/x", "is", (4, 24, "-1")),
            ("/a~1b/1", "is", (4, 14, "[2, {\"x\": -1}]")),
            ("/seed", "is", (2, 11, "1")),
        ];
        for (pointer, message, (line, column, words)) in cases {
            assert_eq!(marked(pointer, message), Some((line, column, words.to_owned())), "{pointer}");
        }
    }

    #[test]
    fn what_is_not_in_the_file_has_no_excerpt() {
        for (pointer, message) in
            [("/time/step", "x"), ("/seed", "x (from --set)"), ("", "x"), ("/seed/x", "x"), ("/a~1b/7", "x")]
        {
            assert_eq!(marked(pointer, message), None, "{pointer}");
        }
        for text in ["", "{", "{\"seed\"", "{\"seed\":", "{\"seed\" 1}", "[", "\"\\"] {
            let found = excerpt(text, &Violation::new("/seed", "x"));
            assert!(found.is_none(), "{text}: {found:?}");
        }
    }

    #[test]
    fn a_slip_of_syntax_is_marked_where_the_reader_stopped() {
        let found =
            excerpt("{\n \"a\": 1,\n}", &Violation::new("", "a.json: not JSON: trailing comma at line 3 column 1"));
        assert_eq!(found.map(|found| (found.line, found.column, found.text)), Some((3, 1, "}".to_owned())));
    }

    #[test]
    fn of_a_very_long_line_the_part_around_the_mark_is_shown() {
        let text = format!("{{\"a\": [{} 7], \"b\": true}}", "0, ".repeat(5000));
        let found = excerpt(&text, &Violation::new("/b", "x")).unwrap();
        assert_eq!((found.line, found.indent, found.width), (1, BEFORE, 4));
        assert!(found.text.chars().skip(BEFORE).collect::<String>().starts_with("true}"));
    }
}
