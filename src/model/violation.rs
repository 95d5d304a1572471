//! What a check of a block found wrong: a place inside the block and a sentence. A check collects every violation and returns
//! them together, so that an author corrects a scene once.

use std::fmt::{self, Write};

use thiserror::Error;

/// One value that cannot be: a JSON pointer, relative to the block that is checked, and what is wrong there.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct Violation {
    /// Where, as an RFC 6901 pointer such as `/receptors/attractant/weight`; empty for the block as a whole.
    pub pointer: String,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// Every violation of a check, in the order found.
#[derive(Debug, Clone, PartialEq, Eq, Default, Error)]
pub struct Violations(Vec<Violation>);

impl Violation {
    /// A violation at `pointer`, relative to the block.
    pub fn new(pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), message: message.into() }
    }

    /// The same violation seen from outside: `prefix` (such as `/chemotaxis`) in front of its pointer.
    #[must_use]
    pub fn under(mut self, prefix: &str) -> Self {
        self.pointer.insert_str(0, prefix);
        self
    }
}

impl Violations {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Notes a violation at `pointer`.
    pub fn push(&mut self, pointer: impl Into<String>, message: impl Into<String>) {
        self.0.push(Violation::new(pointer, message));
    }

    /// Notes a violation at `pointer` unless `holds`; the message is built only when needed.
    pub fn demand(&mut self, holds: bool, pointer: &str, message: impl FnOnce() -> String) {
        if !holds {
            self.push(pointer, message());
        }
    }

    /// Takes over what another check found, its pointers put under `prefix`.
    pub fn extend_under(&mut self, prefix: &str, other: Self) {
        self.0.extend(other.0.into_iter().map(|violation| violation.under(prefix)));
    }

    /// Whether nothing was found.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The violations in the order found.
    pub fn iter(&self) -> std::slice::Iter<'_, Violation> {
        self.0.iter()
    }

    /// `Ok` when nothing was found.
    ///
    /// # Errors
    /// The violations themselves.
    pub fn into_result(self) -> Result<(), Self> {
        if self.is_empty() { Ok(()) } else { Err(self) }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.pointer.is_empty() {
            return formatter.write_str(&self.message);
        }
        // A name with control signs is told as it is written in JSON, and does nothing to a terminal.
        for sign in self.pointer.chars() {
            match sign.is_control() {
                true => write!(formatter, "{}", sign.escape_unicode())?,
                false => formatter.write_char(sign)?,
            }
        }
        write!(formatter, ": {}", self.message)
    }
}

impl fmt::Display for Violations {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, violation) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(formatter, "{separator}{violation}")?;
        }
        Ok(())
    }
}

impl From<Violation> for Violations {
    fn from(violation: Violation) -> Self {
        Self(vec![violation])
    }
}

impl FromIterator<Violation> for Violations {
    fn from_iter<I: IntoIterator<Item = Violation>>(violations: I) -> Self {
        Self(violations.into_iter().collect())
    }
}

impl IntoIterator for Violations {
    type Item = Violation;
    type IntoIter = std::vec::IntoIter<Violation>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// One key as a token of an RFC 6901 pointer, with its slash: `a/b` becomes `/a~1b`.
pub fn pointer_token(key: &str) -> String {
    format!("/{}", key.replace('~', "~0").replace('/', "~1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn violations_keep_their_order_and_gain_the_prefix_of_their_block() {
        let mut inner = Violations::new();
        inner.demand(2.0 < 1.0, "/reach", || "2 um is not below 1 um".to_owned());
        inner.demand(true, "/never", || unreachable!());
        inner.push("", "no receptor at all");
        let mut outer = Violations::new();
        outer.extend_under("/contact", inner);
        assert_eq!(outer.to_string(), "/contact/reach: 2 um is not below 1 um\n/contact: no receptor at all");
        assert!(outer.into_result().is_err());
        assert_eq!(Violations::new().into_result(), Ok(()));
    }

    #[test]
    fn a_key_with_slash_and_tilde_makes_one_token() {
        assert_eq!(pointer_token("a/b~c"), "/a~1b~0c");
    }
}
