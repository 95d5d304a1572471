//! Scenes with parameters: a text that begins with `=` stands for the value of an expression of numbers named in `parameters`.
//!
//! `"= 20*sqrt(axons) um"` is an expression and, after a space, a unit; without a unit the value is a number. Expressions have
//! `+ - * / ^`, parentheses, numbers, names of parameters, and `sqrt`, `min`, `max`, `round`. A parameter may itself be such a text over
//! those before it. What is replaced is the text alone: keys, units and ranges are checked afterwards, as if the value had been
//! written there.

use serde_json::{Number, Value};

use super::suggest::advice;
use crate::model::violation::{Violation, pointer_token};

/// Parentheses, signs and powers inside each other at most.
const DEEPEST: usize = 64;
/// Integers of numbers up to here are exact.
const LARGEST_INTEGER: f64 = 9_007_199_254_740_992.0;

type Parameters = Vec<(String, f64)>;

/// Puts values in place of all expressions of a scene; those that have none are noted and stay.
pub fn evaluate(document: &mut Value, problems: &mut Vec<Violation>) {
    let mut known = Parameters::new();
    if let Some(parameters) = document.get_mut("parameters").and_then(Value::as_object_mut) {
        for (name, value) in parameters {
            replace(value, &format!("/parameters{}", pointer_token(name)), &known, problems);
            if let Some(number) = value.as_f64() {
                known.push((name.clone(), number));
            }
        }
    }
    let Some(object) = document.as_object_mut() else { return };
    for (key, value) in object.iter_mut().filter(|(key, _)| !["parameters", "description"].contains(&key.as_str())) {
        walk(value, &pointer_token(key), &known, problems);
    }
}

fn walk(value: &mut Value, pointer: &str, known: &Parameters, problems: &mut Vec<Violation>) {
    match value {
        Value::Object(object) => {
            for (key, member) in object {
                walk(member, &format!("{pointer}{}", pointer_token(key)), known, problems);
            }
        }
        Value::Array(entries) => {
            for (i, entry) in entries.iter_mut().enumerate() {
                walk(entry, &format!("{pointer}/{i}"), known, problems);
            }
        }
        _ => replace(value, pointer, known, problems),
    }
}

/// Replaces a text that is an expression by its value.
fn replace(value: &mut Value, pointer: &str, known: &Parameters, problems: &mut Vec<Violation>) {
    let Some(text) = value.as_str().and_then(|text| text.strip_prefix('=')) else { return };
    match value_of(text.trim(), known) {
        Ok(found) => *value = found,
        Err(message) => problems.push(Violation::new(pointer, message)),
    }
}

/// The value of an expression, with its unit if it has one.
fn value_of(text: &str, known: &Parameters) -> Result<Value, String> {
    let mut reader = Reader { text, at: 0, depth: 0, known };
    let number = reader.sum()?;
    if !number.is_finite() {
        return Err(format!("`{text}` is not a finite number"));
    }
    let unit = &text[reader.at..];
    match unit.trim() {
        "" if number.fract() == 0.0 && number.abs() < LARGEST_INTEGER => Ok(Value::from(number as i64)),
        "" => Ok(Number::from_f64(number).map_or(Value::Null, Value::Number)),
        trimmed
            if unit.starts_with(' ') && trimmed.starts_with(|c: char| c.is_alphabetic() || c == '1' || c == '/') =>
        {
            Ok(Value::String(format!("{number} {trimmed}")))
        }
        trimmed => Err(format!("`{text}`: an operator or, after a space, a unit was expected before `{trimmed}`")),
    }
}

/// Reads an expression by descent.
struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    known: &'a Parameters,
}

impl Reader<'_> {
    fn peek(&self) -> Option<char> {
        self.text[self.at..].trim_start().chars().next()
    }

    /// Takes the next sign if it is one of these.
    fn take(&mut self, signs: &str) -> Option<char> {
        let sign = self.peek().filter(|sign| signs.contains(*sign))?;
        self.at = self.text.len() - self.text[self.at..].trim_start().len() + sign.len_utf8();
        Some(sign)
    }

    fn demand(&mut self, sign: char) -> Result<(), String> {
        match self.take(sign.encode_utf8(&mut [0; 4])) {
            Some(_) => Ok(()),
            None => Err(format!("`{}`: `{sign}` is missing", self.text)),
        }
    }

    /// Reads what stands inside something else.
    fn inside(&mut self, read: impl FnOnce(&mut Self) -> Result<f64, String>) -> Result<f64, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("more than {DEEPEST} parentheses, signs or powers inside each other"));
        }
        let value = read(self)?;
        self.depth -= 1;
        Ok(value)
    }

    fn sum(&mut self) -> Result<f64, String> {
        let mut value = self.product()?;
        while let Some(sign) = self.take("+-") {
            let other = self.product()?;
            value = if sign == '+' { value + other } else { value - other };
        }
        Ok(value)
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut value = self.signed()?;
        // ` /s` is a unit: a division has no space before and none after, or both.
        while !self.is_at_unit() {
            let Some(sign) = self.take("*/") else { break };
            let other = self.signed()?;
            value = if sign == '*' { value * other } else { value / other };
        }
        Ok(value)
    }

    fn is_at_unit(&self) -> bool {
        let rest = &self.text.as_bytes()[self.at..];
        rest.len() > 2 && rest.starts_with(b" /") && rest[2].is_ascii_alphabetic()
    }

    fn signed(&mut self) -> Result<f64, String> {
        match self.take("+-") {
            Some(sign) => {
                let value = self.inside(Self::signed)?;
                Ok(if sign == '-' { -value } else { value })
            }
            None => self.power(),
        }
    }

    fn power(&mut self) -> Result<f64, String> {
        let base = self.atom()?;
        if self.take("^").is_none() {
            return Ok(base);
        }
        let exponent = self.inside(Self::signed)?;
        Ok(base.powf(exponent))
    }

    fn atom(&mut self) -> Result<f64, String> {
        if self.take("(").is_some() {
            let value = self.inside(Self::sum)?;
            self.demand(')')?;
            return Ok(value);
        }
        let start = self.text.len() - self.text[self.at..].trim_start().len();
        let rest = &self.text[start..];
        let number = number_length(rest);
        if number > 0 {
            self.at = start + number;
            return rest[..number].parse().map_err(|_| format!("`{}` is not a number", &rest[..number]));
        }
        let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let name = &rest[..length];
        self.at = start + length;
        match name {
            "" => Err(format!("`{}`: a number, a parameter or a parenthesis is missing", self.text)),
            "sqrt" => Ok(self.arguments::<1>()?[0].sqrt()),
            "round" => Ok(self.arguments::<1>()?[0].round()),
            "min" => Ok(self.arguments::<2>()?.into_iter().fold(f64::INFINITY, f64::min)),
            "max" => Ok(self.arguments::<2>()?.into_iter().fold(f64::NEG_INFINITY, f64::max)),
            _ => self.known.iter().find(|(known, _)| known == name).map(|(_, value)| *value).ok_or_else(|| {
                let names: Vec<&str> = self.known.iter().map(|(name, _)| name.as_str()).collect();
                format!("`{}`: there is no parameter `{name}`{}", self.text, advice(name, "parameters", &names, '`'))
            }),
        }
    }

    fn arguments<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            self.demand(if i == 0 { '(' } else { ',' })?;
            *value = self.inside(Self::sum)?;
        }
        self.demand(')')?;
        Ok(values)
    }
}

/// Length of the number that a text begins with: digits, a point, an exponent.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(0);
    let mut end = whole;
    if bytes.get(end) == Some(&b'.') && (whole > 0 || digits(end + 1) > end + 1) {
        end = digits(end + 1);
    }
    if end > 0 && matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if digits(sign.min(bytes.len())) > sign {
            end = digits(sign);
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn of(text: &str) -> Result<Value, String> {
        value_of(text, &vec![("axons".to_owned(), 1e4), ("side".to_owned(), 2000.0)])
    }

    #[test]
    fn expressions_have_the_values_of_arithmetic() {
        for (text, expected) in [
            ("1e3", json!(1000)),
            ("axons", json!(10_000)),
            ("2 + 3*4 - 6/3", json!(12)),
            ("-2^2", json!(-4)),
            ("2^3^2", json!(512)),
            ("(1 + .5)*2e-1", json!(1.5 * 0.2)),
            ("sqrt(axons)/8", json!(12.5)),
            ("max(min(3, 4), 2) - -1", json!(4)),
            ("round(side/300)", json!(7)),
            ("20*sqrt(axons) um", json!("2000 um")),
            ("side / 8 um", json!("250 um")),
            ("(side/8)^2 um^2/h", json!("62500 um^2/h")),
            ("1/4 /s", json!("0.25 /s")),
        ] {
            assert_eq!(of(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_expression_is_refused_in_words() {
        for (text, word) in [
            ("", "a number, a parameter or a parenthesis is missing"),
            ("axon", "there is no parameter `axon`; did you mean `axons`?"),
            ("(1 + 2", "`)` is missing"),
            ("min(1)", "`,` is missing"),
            ("1/0", "not a finite number"),
            ("sqrt(-1)", "not a finite number"),
            ("2 $", "an operator or, after a space, a unit was expected before `$`"),
            ("2um", "an operator or, after a space, a unit was expected before `um`"),
        ] {
            let message = of(text).unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
        assert!(of(&"(".repeat(100_000)).unwrap_err().contains("inside each other"));
        assert!(of(&"-".repeat(100_000)).unwrap_err().contains("inside each other"));
        assert!(of(&"2^".repeat(100_000)).unwrap_err().contains("inside each other"));
    }

    #[test]
    fn parameters_build_on_those_before_them_and_problems_name_their_place() {
        let mut scene = json!({
            "description": "= no expression",
            "parameters": { "axons": 400, "side": "= 20*sqrt(axons)" },
            "tissue": { "outline": { "rectangle": { "width": "= side um", "height": 600 } } },
            "targets": { "bulb": { "disc": { "centre": ["= side/2", "= sid"], "radius": 50 } } }
        });
        let mut problems = Vec::new();
        evaluate(&mut scene, &mut problems);
        assert_eq!(scene["tissue"]["outline"]["rectangle"]["width"], json!("400 um"));
        assert_eq!(scene["targets"]["bulb"]["disc"]["centre"][0], json!(200));
        assert_eq!(scene["description"], json!("= no expression"));
        assert_eq!(problems.len(), 1);
        assert_eq!(problems[0].pointer, "/targets/bulb/disc/centre/1");
    }
}
