//! The grammar of units: texts cut into numbers, symbols, powers and operators; see [`unit`](super::unit).

use super::unit::{Unit, UnitError, find_symbol};

/// The largest power of a symbol.
const LARGEST_POWER: i32 = 9;

/// Whether a text begins with a word for a number that is not finite.
pub(super) fn is_non_finite_word(text: &str) -> bool {
    let word = text.trim_start_matches(['+', '-']).to_lowercase();
    let first = word.split(|c: char| !c.is_alphanumeric() && c != '∞').next().unwrap_or_default();
    ["nan", "inf", "infinity", "∞"].contains(&first)
}

/// The number a text begins with, and the rest. An `e` belongs to the number only when digits follow it.
pub(super) fn split_number(text: &str) -> Option<(f64, &str)> {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(sign);
    let mut end = sign + whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let signed = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = bytes.get(signed..).map_or(0, |_| digits(signed));
        if exponent > 0 {
            end = signed + exponent;
        }
    }
    text[..end].parse().ok().map(|number| (number, &text[end..]))
}

/// How the next term joins the product.
#[derive(Clone, Copy, PartialEq)]
enum Operator {
    First,
    Times,
    Over,
    Beside,
}

/// A whole unit; `text` is what messages quote.
pub(super) fn parse_product(unit: &str, text: &str) -> Result<Unit, UnitError> {
    let missing = || UnitError::MissingTerm { text: text.to_owned() };
    let mut product = Unit::ONE;
    let mut divided = false;
    let mut rest = unit;
    let mut operator = Operator::First;
    loop {
        if rest.is_empty() {
            return Err(missing());
        }
        if operator == Operator::Beside && divided {
            return Err(UnitError::Ambiguous { text: text.to_owned() });
        }
        let (term, after) = parse_term(rest, text)?;
        product = product.times(if operator == Operator::Over { term.inverse() } else { term });
        divided |= operator == Operator::Over;
        rest = after.trim_start();
        if rest.is_empty() {
            return Ok(product);
        }
        (operator, rest) = take_operator(rest);
    }
}

fn take_operator(rest: &str) -> (Operator, &str) {
    let signs = [("/", Operator::Over), ("per ", Operator::Over), ("*", Operator::Times)];
    let more = [("·", Operator::Times), ("×", Operator::Times), ("⋅", Operator::Times)];
    for (sign, operator) in signs.into_iter().chain(more) {
        if let Some(after) = rest.strip_prefix(sign) {
            return (operator, after.trim_start());
        }
    }
    (Operator::Beside, rest)
}

/// A symbol with its power, or a number with the symbol it counts.
fn parse_term<'a>(rest: &'a str, text: &str) -> Result<(Unit, &'a str), UnitError> {
    let Some((number, after)) = split_number(rest) else {
        return parse_symbol(rest, text);
    };
    if !(number.is_finite() && number > 0.0) {
        return Err(UnitError::NotFinite { text: text.to_owned() });
    }
    let next = after.trim_start();
    let counted = next.chars().next().is_some_and(is_symbol_character) && !next.starts_with("per ");
    if counted {
        let (unit, after) = parse_symbol(next, text)?;
        return Ok((Unit::number(number).times(unit), after));
    }
    Ok((Unit::number(number), after))
}

fn is_symbol_character(character: char) -> bool {
    character.is_alphabetic() && character != 'º' || matches!(character, '%' | '°' | 'µ' | 'μ')
}

fn parse_symbol<'a>(rest: &'a str, text: &str) -> Result<(Unit, &'a str), UnitError> {
    let end = rest.find(|c| !is_symbol_character(c)).unwrap_or(rest.len());
    let (symbol, after) = rest.split_at(end);
    match rest.chars().next() {
        Some(character) if symbol.is_empty() && "/*·×⋅".contains(character) => {
            return Err(UnitError::MissingTerm { text: text.to_owned() });
        }
        Some(character) if symbol.is_empty() => {
            return Err(UnitError::UnexpectedCharacter { character, text: text.to_owned() });
        }
        _ => {}
    }
    let unit = find_symbol(symbol).ok_or_else(|| UnitError::UnknownSymbol { symbol: symbol.to_owned() })?;
    let (power, after) = split_power(after);
    match power {
        None => Ok((unit, after)),
        Some(power) if power != 0 && power.abs() <= LARGEST_POWER => Ok((unit.power(power), after)),
        Some(_) => Err(UnitError::Power { symbol: symbol.to_owned() }),
    }
}

/// A power after a symbol: `^2`, `^-1`, `2`, `-1`, `²`, `⁻¹`. One that cannot be held reads as 0, which is refused.
fn split_power(rest: &str) -> (Option<i32>, &str) {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let written = rest.strip_prefix('^');
    let body = written.unwrap_or(rest);
    let mut digits = String::new();
    let mut end = 0;
    for character in body.chars() {
        let raised = RAISED.iter().position(|&digit| digit == character);
        match (character, raised) {
            ('-' | '+' | '⁻', _) if end == 0 => digits.push(if character == '+' { '+' } else { '-' }),
            (_, Some(digit)) => digits.push_str(&digit.to_string()),
            (digit, None) if digit.is_ascii_digit() => digits.push(digit),
            _ => break,
        }
        end += character.len_utf8();
    }
    if end == 0 && written.is_none() {
        return (None, rest);
    }
    (Some(digits.parse().unwrap_or(0)), &body[end..])
}
