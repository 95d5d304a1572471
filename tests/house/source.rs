//! Rust sources as the house rules see them: without tests, and as code without comments and strings.

use std::path::{Path, PathBuf};

/// One source file.
pub struct Source {
    /// Path from the root of the package, with `/`.
    pub path: String,
    /// The text up to the tests inside the file.
    pub text: String,
    /// That text with comments and the insides of strings blanked; lines keep their numbers.
    pub code: String,
}

/// All sources under a folder of the package, test files left out.
pub fn sources(folder: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    collect(&root.join(folder), &mut files);
    files.sort();
    let rust = files.into_iter().filter(|file| {
        let name = file.file_name().unwrap().to_string_lossy();
        name.ends_with(".rs") && !name.ends_with("_tests.rs")
    });
    rust.map(|file| {
        let whole = std::fs::read_to_string(&file).unwrap();
        let text = whole.split("#[cfg(test)]\nmod tests {").next().unwrap().to_owned();
        let path = file.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
        Source { path, code: without_comments_and_strings(&text), text }
    })
    .collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { collect(&path, files) } else { files.push(path) }
    }
}

/// Blanks comments and the insides of strings and characters.
pub fn without_comments_and_strings(text: &str) -> String {
    let bytes: Vec<char> = text.chars().collect();
    let (mut out, mut at) = (String::with_capacity(text.len()), 0);
    let starts = |at: usize, what: &str| what.chars().enumerate().all(|(i, c)| bytes.get(at + i) == Some(&c));
    while at < bytes.len() {
        let end = if starts(at, "//") {
            (at..bytes.len()).find(|&i| bytes[i] == '\n').unwrap_or(bytes.len())
        } else if starts(at, "r\"") || starts(at, "r#\"") {
            let close = if starts(at, "r\"") { "\"" } else { "\"#" };
            (at + 3..bytes.len()).find(|&i| starts(i, close)).unwrap_or(bytes.len()) + close.len()
        } else if bytes[at] == '"' {
            end_of_string(&bytes, at)
        } else if bytes[at] == '\'' && (bytes.get(at + 2) == Some(&'\'') || bytes.get(at + 1) == Some(&'\\')) {
            (at + 2..bytes.len()).find(|&i| bytes[i] == '\'').unwrap_or(bytes.len()) + 1
        } else {
            out.push(bytes[at]);
            at += 1;
            continue;
        };
        out.extend(bytes[at..end.min(bytes.len())].iter().map(|&c| if c == '\n' { '\n' } else { ' ' }));
        at = end;
    }
    out
}

fn end_of_string(text: &[char], start: usize) -> usize {
    let mut at = start + 1;
    while at < text.len() && text[at] != '"' {
        at += if text[at] == '\\' { 2 } else { 1 };
    }
    at + 1
}

/// A path named in code, such as `crate::model::clock::Clock`, with its line; groups in braces are spelled out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mention {
    pub line: usize,
    pub segments: Vec<String>,
}

impl Source {
    /// All paths of two segments or more that the code names, `super` and `self` resolved to `crate::…`.
    pub fn mentions(&self) -> Vec<Mention> {
        let mut found = mentions(&self.code);
        let module = self.module();
        for mention in &mut found {
            resolve(&mut mention.segments, &module);
        }
        found
    }

    /// The module of the file: `["model", "clock"]`.
    fn module(&self) -> Vec<String> {
        let inside = self.path.strip_prefix("src/").unwrap_or(&self.path).trim_end_matches(".rs");
        let parts = inside.split('/').filter(|part| !["mod", "lib", "main"].contains(part));
        parts.map(str::to_owned).collect()
    }
}

fn resolve(segments: &mut Vec<String>, module: &[String]) {
    let ups = segments.iter().take_while(|segment| *segment == "super").count();
    if ups > 0 || segments[0] == "self" {
        let own = segments.drain(..ups.max(1)).count() * usize::from(ups > 0);
        let kept = module.len().saturating_sub(own);
        segments.splice(0..0, std::iter::once("crate".to_owned()).chain(module[..kept].iter().cloned()));
    } else if segments[0] == "tropism" {
        segments[0] = "crate".to_owned();
    }
}

/// All paths of two segments or more in code.
pub fn mentions(code: &str) -> Vec<Mention> {
    let text: Vec<char> = code.chars().collect();
    let (mut found, mut at, mut line) = (Vec::new(), 0, 1);
    while at < text.len() {
        line += usize::from(text[at] == '\n');
        let begins = is_word(text[at]) && (at == 0 || !is_word(text[at - 1]) && text[at - 1] != '$');
        let inside = at >= 2 && text[at - 1] == ':' && text[at - 2] == ':' && (at < 3 || is_word(text[at - 3]));
        if begins && !inside {
            let mut paths = Vec::new();
            let end = read_path(&text, at, &mut Vec::new(), &mut paths);
            found.extend(paths.into_iter().filter(|p| p.len() > 1).map(|segments| Mention { line, segments }));
            line += text[at + 1..end].iter().filter(|&&c| c == '\n').count();
            at = end;
        } else {
            at += 1;
        }
    }
    found
}

/// Reads `a::b::{c, d::e}` from `at`, adds each path behind `prefix`, and returns where it ends.
fn read_path(text: &[char], at: usize, prefix: &mut Vec<String>, paths: &mut Vec<Vec<String>>) -> usize {
    let depth = prefix.len();
    let mut at = at;
    loop {
        let end = (at..text.len()).find(|&i| !is_word(text[i])).unwrap_or(text.len());
        prefix.push(text[at..end].iter().collect());
        at = end;
        let next = at + 2;
        let more = text.get(at) == Some(&':') && text.get(at + 1) == Some(&':');
        if more && text.get(next) == Some(&'{') {
            at = read_group(text, next + 1, prefix, paths);
            break;
        }
        if !(more && text.get(next).is_some_and(|&c| is_word(c))) {
            paths.push(prefix.clone());
            break;
        }
        at = next;
    }
    prefix.truncate(depth);
    at
}

fn read_group(text: &[char], from: usize, prefix: &mut Vec<String>, paths: &mut Vec<Vec<String>>) -> usize {
    let mut at = from;
    while at < text.len() && text[at] != '}' {
        at = if is_word(text[at]) { read_path(text, at, prefix, paths) } else { at + 1 };
    }
    at + 1
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}
