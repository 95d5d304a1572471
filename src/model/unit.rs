//! Units as authors write them: `um`, `µm/h`, `um^2/s`, `1 %/10um`, `mV/mm`.
//!
//! A unit is a product of powers of prefixed symbols. It is held as a dimension and an exact scale
//! `10^ten · numerator / denominator` to the base units (µm, h, nM, Pa, V, degrees), so that a value written in the base unit
//! keeps every bit and `2 min` is the number nearest to 2/60 h.
//!
//! The grammar: `term { operator term }`, an operator being `/`, `per`, `*`, `·`, `×` or nothing (a product), a term a number
//! or a symbol with an optional power (`um^2`, `um2`, `um²`, `h^-1`, `h⁻¹`). A number right after an operator belongs to the
//! symbol that follows it: `%/10um` is per 10 µm.

use thiserror::Error;

use super::unit_grammar::{is_non_finite_word, parse_product, split_number};

/// Number of base dimensions.
pub(super) const DIMENSIONS: usize = 6;

/// The powers of length, time, concentration, pressure, voltage and angle in a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension([i32; DIMENSIONS]);

/// A unit: its dimension, and its size `10^ten · numerator / denominator` in base units (µm, h, nM, Pa, V, degrees).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    dimension: Dimension,
    ten: i32,
    numerator: f64,
    denominator: f64,
}

/// Why a text is not a number with a unit.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum UnitError {
    /// The text does not begin with a number.
    #[error("`{text}` does not begin with a number")]
    NoNumber {
        /// The text as written.
        text: String,
    },
    /// The number is infinite, not a number, or too large for a 64-bit float.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// The text as written.
        text: String,
    },
    /// A symbol stands for no unit.
    #[error(
        "`{symbol}` is not a unit (known: m, micron, s, min, h, d, M, Pa, N, V, deg, rad, %; prefixes n, u, m, c, k, …)"
    )]
    UnknownSymbol {
        /// The symbol as written.
        symbol: String,
    },
    /// A character has no meaning in a unit.
    #[error("`{character}` has no meaning in the unit of `{text}`")]
    UnexpectedCharacter {
        /// The character.
        character: char,
        /// The text as written.
        text: String,
    },
    /// An operator stands where a unit should.
    #[error("a unit is missing in `{text}`")]
    MissingTerm {
        /// The text as written.
        text: String,
    },
    /// A power is zero, or larger than 9.
    #[error("the power of `{symbol}` is not a whole number from -9 to 9 other than 0")]
    Power {
        /// The symbol with the power.
        symbol: String,
    },
    /// A product without a sign after a division can be read in two ways.
    #[error("`{text}` can be read in two ways; put `/` or `*` before each unit")]
    Ambiguous {
        /// The text as written.
        text: String,
    },
}

/// Symbol, decimal exponent, numerator, denominator, dimension and the prefixes it takes.
type Symbol = (&'static str, i32, f64, f64, [i32; DIMENSIONS], &'static str);

const DEGREES_OF_HALF_TURN: f64 = 180.0;

const SYMBOLS: [Symbol; 23] = [
    ("m", 6, 1.0, 1.0, [1, 0, 0, 0, 0, 0], "pnumck"),
    ("micron", 0, 1.0, 1.0, [1, 0, 0, 0, 0, 0], ""),
    ("microns", 0, 1.0, 1.0, [1, 0, 0, 0, 0, 0], ""),
    ("s", 0, 1.0, 3600.0, [0, 1, 0, 0, 0, 0], "num"),
    ("sec", 0, 1.0, 3600.0, [0, 1, 0, 0, 0, 0], ""),
    ("min", 0, 1.0, 60.0, [0, 1, 0, 0, 0, 0], ""),
    ("minute", 0, 1.0, 60.0, [0, 1, 0, 0, 0, 0], ""),
    ("minutes", 0, 1.0, 60.0, [0, 1, 0, 0, 0, 0], ""),
    ("h", 0, 1.0, 1.0, [0, 1, 0, 0, 0, 0], ""),
    ("hour", 0, 1.0, 1.0, [0, 1, 0, 0, 0, 0], ""),
    ("hours", 0, 1.0, 1.0, [0, 1, 0, 0, 0, 0], ""),
    ("d", 0, 24.0, 1.0, [0, 1, 0, 0, 0, 0], ""),
    ("day", 0, 24.0, 1.0, [0, 1, 0, 0, 0, 0], ""),
    ("days", 0, 24.0, 1.0, [0, 1, 0, 0, 0, 0], ""),
    ("M", 9, 1.0, 1.0, [0, 0, 1, 0, 0, 0], "fpnum"),
    ("Pa", 0, 1.0, 1.0, [0, 0, 0, 1, 0, 0], "umhkMG"),
    ("N", 12, 1.0, 1.0, [2, 0, 0, 1, 0, 0], "pnumk"),
    ("V", 0, 1.0, 1.0, [0, 0, 0, 0, 1, 0], "numk"),
    ("deg", 0, 1.0, 1.0, [0, 0, 0, 0, 0, 1], ""),
    ("°", 0, 1.0, 1.0, [0, 0, 0, 0, 0, 1], ""),
    ("rad", 0, DEGREES_OF_HALF_TURN, std::f64::consts::PI, [0, 0, 0, 0, 0, 1], "m"),
    ("%", -2, 1.0, 1.0, [0; 6], ""),
    ("percent", -2, 1.0, 1.0, [0; 6], ""),
];

const PREFIXES: [(char, i32); 10] =
    [('f', -15), ('p', -12), ('n', -9), ('u', -6), ('m', -3), ('c', -2), ('h', 2), ('k', 3), ('M', 6), ('G', 9)];

impl Unit {
    /// The unit of a plain number: no dimension, size 1.
    pub const ONE: Self = Self { dimension: Dimension([0; 6]), ten: 0, numerator: 1.0, denominator: 1.0 };

    /// Reads a unit such as `um^2/h`, `%/10um` or `1/h`.
    ///
    /// # Errors
    /// A [`UnitError`] naming the symbol or character at fault.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        parse_product(text.trim(), text)
    }

    /// The power of a base dimension: length, time, concentration, pressure, voltage, angle.
    pub(super) fn power_of(&self, base: usize) -> i32 {
        self.dimension.0[base]
    }

    /// The powers of the base dimensions.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// `value` in this unit, as a number in `other`: correctly rounded up to two operations, exact when the two are one size.
    /// The caller has compared the dimensions.
    pub fn convert(&self, value: f64, other: &Self) -> f64 {
        let ten = self.ten - other.ten;
        let raise = |exponent: i32| 10f64.powi(exponent.max(0));
        let multiplier = self.numerator * other.denominator * raise(ten);
        let divisor = self.denominator * other.numerator * raise(-ten);
        if multiplier == divisor {
            value
        } else if multiplier % divisor == 0.0 {
            value * (multiplier / divisor)
        } else {
            value * multiplier / divisor
        }
    }

    pub(super) fn number(value: f64) -> Self {
        Self { numerator: value, ..Self::ONE }
    }

    pub(super) fn times(self, other: Self) -> Self {
        let mut dimension = self.dimension;
        for (sum, power) in dimension.0.iter_mut().zip(other.dimension.0) {
            *sum = sum.saturating_add(power);
        }
        Self {
            dimension,
            ten: self.ten.saturating_add(other.ten),
            numerator: self.numerator * other.numerator,
            denominator: self.denominator * other.denominator,
        }
    }

    pub(super) fn power(self, exponent: i32) -> Self {
        let steps = exponent.unsigned_abs();
        let product = (0..steps).fold(Self::ONE, |product, _| product.times(self));
        if exponent < 0 { product.inverse() } else { product }
    }

    pub(super) fn inverse(self) -> Self {
        Self {
            dimension: Dimension(self.dimension.0.map(|power| -power)),
            ten: -self.ten,
            numerator: self.denominator,
            denominator: self.numerator,
        }
    }
}

/// Splits `20 um/h` into its number and its unit; a text without a unit has the unit [`Unit::ONE`].
///
/// # Errors
/// A [`UnitError`]: no number in front, a number that is not finite, or a unit that cannot be read.
pub fn parse_measure(text: &str) -> Result<(f64, Unit), UnitError> {
    let trimmed = text.trim();
    if is_non_finite_word(trimmed) {
        return Err(UnitError::NotFinite { text: text.to_owned() });
    }
    let (number, rest) = split_number(trimmed).ok_or_else(|| UnitError::NoNumber { text: text.to_owned() })?;
    if !number.is_finite() {
        return Err(UnitError::NotFinite { text: text.to_owned() });
    }
    let rest = rest.trim_start();
    if rest.is_empty() {
        return Ok((number, Unit::ONE));
    }
    let unit = match rest.strip_prefix('/') {
        Some(denominator) => parse_product(&format!("1/{}", denominator.trim_start()), text)?,
        None => parse_product(rest, text)?,
    };
    Ok((number, unit))
}

/// Every symbol that carries a base dimension, with the prefixes it takes.
pub(super) fn symbols_with(base: usize) -> impl Iterator<Item = (&'static str, &'static str)> {
    SYMBOLS.iter().filter(move |symbol| symbol.4[base] != 0).map(|symbol| (symbol.0, symbol.5))
}

/// The unit behind a symbol with or without a prefix.
pub(super) fn find_symbol(symbol: &str) -> Option<Unit> {
    let plain: String = symbol.chars().map(|c| if matches!(c, 'µ' | 'μ') { 'u' } else { c }).collect();
    let build = |&(_, ten, numerator, denominator, dimension, _): &Symbol| Unit {
        dimension: Dimension(dimension),
        ten,
        numerator,
        denominator,
    };
    if let Some(entry) = SYMBOLS.iter().find(|entry| entry.0 == plain) {
        return Some(build(entry));
    }
    let prefix = plain.chars().next()?;
    let root = &plain[prefix.len_utf8()..];
    let entry = SYMBOLS.iter().find(|entry| entry.0 == root && entry.5.contains(prefix))?;
    let (_, exponent) = PREFIXES.iter().find(|(letter, _)| *letter == prefix)?;
    let unit = build(entry);
    Some(Unit { ten: unit.ten + exponent, ..unit })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base(text: &str) -> f64 {
        let (value, unit) = parse_measure(text).unwrap();
        unit.convert(value, &Unit::ONE)
    }

    #[test]
    fn every_symbol_with_every_prefix_has_its_size_in_base_units() {
        for (symbol, ten, numerator, denominator, _, prefixes) in SYMBOLS {
            assert_eq!(base(&format!("1 {symbol}")), numerator * 10f64.powi(ten) / denominator, "{symbol}");
            for prefix in prefixes.chars() {
                let exponent = PREFIXES.iter().find(|(letter, _)| *letter == prefix).unwrap().1;
                let expected = numerator * 10f64.powi(ten + exponent) / denominator;
                let seen = base(&format!("1 {prefix}{symbol}"));
                assert!((seen - expected).abs() <= 2.0 * f64::EPSILON * expected, "{prefix}{symbol}: {seen}");
            }
        }
    }

    #[test]
    fn decimal_scales_and_times_are_exact() {
        let cases = [
            ("30 um^2/s", 108_000.0),
            ("1e-3 /s", 3.6),
            ("2 min", 2.0 / 60.0),
            ("5 %", 0.05),
            ("0.1 mm", 100.0),
            ("0.3 cm", 3000.0),
            ("7 nm", 0.007),
            ("3 d", 72.0),
            ("0.5 pM", 0.0005),
            ("1 %/10um", 0.001),
            ("10 % per 10 µm", 0.01),
            ("0.5 kPa", 500.0),
            ("1 hPa", 100.0),
            ("1 nN/um^2", 1000.0),
            ("180 deg", 180.0),
        ];
        for (text, expected) in cases {
            assert_eq!(base(text), expected, "{text}");
        }
        assert!((base("1 rad") - 1f64.to_degrees()).abs() < 1e-14);
    }

    #[test]
    fn one_unit_can_be_written_in_many_ways() {
        let expected = Unit::parse("um^2/s").unwrap();
        for text in
            ["µm^2/s", "μm²/s", "um2/s", "um² s⁻¹", "um^2*s^-1", "um·um/s", "µm2 s-1", "microns^2 / sec", "um^+2 per s"]
        {
            let unit = Unit::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(unit.dimension(), expected.dimension(), "{text}");
            assert_eq!(unit.convert(1.0, &Unit::ONE), 3600.0, "{text}");
        }
    }

    #[test]
    fn an_unreadable_text_is_refused_with_its_reason() {
        let unknown =
            "is not a unit (known: m, micron, s, min, h, d, M, Pa, N, V, deg, rad, %; prefixes n, u, m, c, k, …)";
        let cases = [
            ("um", "`um` does not begin with a number".to_owned()),
            ("", "`` does not begin with a number".to_owned()),
            ("3 furlong", format!("`furlong` {unknown}")),
            ("3 cmin", format!("`cmin` {unknown}")),
            ("0,5 um", "`,` has no meaning in the unit of `0,5 um`".to_owned()),
            ("3 um/", "a unit is missing in `3 um/`".to_owned()),
            ("3 um//h", "a unit is missing in `3 um//h`".to_owned()),
            ("3 um^0", "the power of `um` is not a whole number from -9 to 9 other than 0".to_owned()),
            ("3 um^", "the power of `um` is not a whole number from -9 to 9 other than 0".to_owned()),
            ("3 um^99999999999", "the power of `um` is not a whole number from -9 to 9 other than 0".to_owned()),
            ("3 um/s h", "`3 um/s h` can be read in two ways; put `/` or `*` before each unit".to_owned()),
            ("inf um", "`inf um` is not a finite number".to_owned()),
            ("-NaN", "`-NaN` is not a finite number".to_owned()),
            ("1e400 um", "`1e400 um` is not a finite number".to_owned()),
            ("1 um/0 h", "`1 um/0 h` is not a finite number".to_owned()),
        ];
        for (text, expected) in cases {
            assert_eq!(parse_measure(text).unwrap_err().to_string(), expected);
        }
    }
}
