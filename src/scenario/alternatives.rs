//! One of several schemas: which one an author meant, so that the message is about that one.

use std::borrow::Cow;

use serde_json::Value;

use super::schema_view::{branches_of, describe, has_type, kind_of, refusal, resolve, types_of, words_of};
use super::schema_walk::{Findings, Walker};
use super::suggest::nearest;

/// Alternatives inside alternatives are opened this deep.
const DEEPEST_NESTING: usize = 8;

impl Walker<'_> {
    /// Accepts a value that fits one branch; else reports the problems of the branch meant, or all that is allowed.
    pub(super) fn check_alternatives(&mut self, branches: &[Value], value: &Value, pointer: &str) {
        let mut open = Vec::new();
        flatten(self.root, branches, 0, &mut open);
        if !value.is_null() {
            open.retain(|branch| !types_of(branch).eq(["null"]));
        }
        let left = without_removed(&open, value);
        let value = left.as_ref().unwrap_or(value);
        if let [only] = open.as_slice() {
            return self.check(only, value, pointer);
        }
        let mut tried: Vec<(&Value, Findings)> = Vec::new();
        for branch in &open {
            let mut walker = Walker::new(self.root);
            walker.check(branch, value, pointer);
            if walker.findings.problems.is_empty() {
                return self.findings.hints.append(&mut walker.findings.hints);
            }
            tried.push((branch, walker.findings));
        }
        tried.retain(|(branch, _)| is_meant(branch, value));
        let tagged = tried.len() > 1 && tried.iter().all(|(branch, _)| external_tag(branch).is_some());
        if tagged {
            let tags: Vec<&str> = tried.iter().filter_map(|(branch, _)| external_tag(branch)).collect();
            return self.problem(pointer, format!("only one of {} can stand here", tags.join(", ")));
        }
        match tried.into_iter().min_by_key(|(_, findings)| findings.problems.len()) {
            Some((_, findings)) => self.findings.problems.extend(findings.problems),
            None => self.problem(pointer, refuse(self.root, &open, value)),
        }
    }
}

/// An object without the variants that it removes, as `{"rectangle": null, "svg": {…}}` does with the variant of a base scene; none if it
/// removes none, or all.
fn without_removed(branches: &[Cow<Value>], value: &Value) -> Option<Value> {
    let object = value.as_object()?;
    let tags: Vec<&str> = branches.iter().filter_map(|branch| external_tag(branch)).collect();
    let is_removed = |(key, member): (&String, &Value)| member.is_null() && tags.contains(&key.as_str());
    let removed = object.iter().filter(|entry| is_removed(*entry)).count();
    let left = || object.iter().filter(|entry| !is_removed(*entry)).map(|(key, member)| (key.clone(), member.clone()));
    (removed > 0 && removed < object.len()).then(|| Value::Object(left().collect()))
}

/// The branches with references resolved and those of nested alternatives put in their place.
fn flatten<'s>(root: &'s Value, branches: &'s [Value], depth: usize, open: &mut Vec<Cow<'s, Value>>) {
    for branch in branches {
        let resolved = resolve(root, branch);
        let nested = branches_of(&resolved).filter(|_| depth < DEEPEST_NESTING && resolved.get("properties").is_none());
        match nested {
            Some(inner) => {
                let mut owned = Vec::new();
                flatten(root, inner, depth + 1, &mut owned);
                open.extend(owned.into_iter().map(|inner| Cow::Owned(inner.into_owned())));
            }
            None => open.push(resolved),
        }
    }
}

/// Whether the form of a value says that its author meant this branch.
fn is_meant(branch: &Value, value: &Value) -> bool {
    match value {
        Value::String(text) => {
            let number_like = text.trim_start().starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
            words_of(branch).is_none() && has_type(branch, value) && (kind_of(branch).is_none() || number_like)
        }
        Value::Object(object) => {
            let tag = external_tag(branch);
            let inner = internal_tag(branch);
            words_of(branch).is_none()
                && has_type(branch, value)
                && tag.is_none_or(|tag| object.contains_key(tag))
                && inner.is_none_or(|(tag, word)| object.get(tag).and_then(Value::as_str) == Some(word))
        }
        _ => words_of(branch).is_none() && has_type(branch, value),
    }
}

/// The one key of an externally tagged variant.
fn external_tag(branch: &Value) -> Option<&str> {
    let properties = branch.get("properties")?.as_object()?;
    let required = branch.get("required")?.as_array()?;
    let key = properties.keys().next()?;
    let only = properties.len() == 1 && required.len() == 1 && required[0].as_str() == Some(key);
    (only && branch.get("additionalProperties") == Some(&Value::Bool(false))).then_some(key.as_str())
}

/// The key and the word by which an internally tagged variant is known.
fn internal_tag(branch: &Value) -> Option<(&str, &str)> {
    let properties = branch.get("properties")?.as_object()?;
    properties.iter().find_map(|(key, property)| Some((key.as_str(), property.get("const")?.as_str()?)))
}

fn refuse(root: &Value, open: &[Cow<'_, Value>], value: &Value) -> String {
    let mut allowed: Vec<String> = Vec::new();
    for branch in open.iter().filter(|branch| !types_of(branch).eq(["null"])) {
        let text = match internal_tag(branch) {
            Some((tag, word)) => format!("{{\"{tag}\": \"{word}\", …}}"),
            None => describe(root, branch),
        };
        if !allowed.contains(&text) {
            allowed.push(text);
        }
    }
    let mut names: Vec<&str> = open.iter().filter_map(|branch| words_of(branch)).flatten().collect();
    let written: Vec<&str> = match value {
        Value::String(text) => vec![text.as_str()],
        Value::Object(object) => {
            names = open.iter().filter_map(|branch| external_tag(branch)).collect();
            names.extend(open.iter().filter_map(|branch| Some(internal_tag(branch)?.1)));
            let words = object.values().filter_map(Value::as_str);
            object.keys().map(String::as_str).chain(words).collect()
        }
        _ => Vec::new(),
    };
    let near = written.iter().find_map(|word| nearest(word, names.iter().copied()));
    refusal(value, near, &allowed.join(", "))
}
