//! Quantities with units: what the keys of a scenario are made of.
//!
//! Each is a newtype over the number in its base unit (µm, h, nM, Pa, V/m, degrees). In JSON it is written as a plain number in that
//! unit, or as a string with any unit of the same dimension (`"30 um^2/s"`, `"2 min"`, `"5 %"`); a wrong dimension and a number that
//! is not finite are refused. Its schema says `"x-quantity"` and `"x-unit"`, which is all a reader of the schema needs to check it.
//! The macro [`quantity!`](crate::quantity!) makes another one, also outside this crate.

use std::fmt;

use schemars::{Schema, json_schema};
use serde::de::Visitor;
use serde::{Deserializer, Serializer};
use thiserror::Error;

use super::unit::{Unit, UnitError, parse_measure};
use crate::quantity;

/// What a quantity is called and the unit its plain numbers are in (`1` for none).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind<'a> {
    /// The name in messages, such as `speed`.
    pub name: &'a str,
    /// The base unit, such as `um/h`.
    pub unit: &'a str,
}

/// A number with a kind; [`quantity!`](crate::quantity!) implements it.
pub trait Quantity: Copy {
    /// Its name and base unit.
    const KIND: Kind<'static>;

    /// The quantity of `value` base units.
    fn new(value: f64) -> Self;

    /// The number of base units.
    fn value(self) -> f64;
}

/// Why a text is not a quantity of the kind wanted.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum QuantityError {
    /// The text is no number with a unit.
    #[error("{0}")]
    Unreadable(#[from] UnitError),
    /// The unit has another dimension.
    #[error("\"{text}\" is {found}; {wanted} belongs here")]
    Dimension {
        /// The text as written.
        text: String,
        /// What the text is, with its article.
        found: String,
        /// What belongs here, with an example.
        wanted: String,
    },
    /// A number without a unit was written as a string.
    #[error("\"{text}\" has no unit; {wanted} belongs here")]
    NoUnit {
        /// The text as written.
        text: String,
        /// What belongs here, with an example.
        wanted: String,
    },
    /// In base units the number is too large for a 64-bit float.
    #[error("\"{text}\" is not a finite number of {unit}")]
    NotFinite {
        /// The text as written.
        text: String,
        /// The base unit.
        unit: String,
    },
}

impl Kind<'_> {
    /// The number of base units in a text such as `20 um/h`.
    ///
    /// # Errors
    /// A [`QuantityError`] that names what was found and what belongs here.
    pub fn read(&self, text: &str) -> Result<f64, QuantityError> {
        let base = Unit::parse(self.unit)?;
        let (number, unit) = parse_measure(text)?;
        if unit.dimension() != base.dimension() {
            return Err(self.wrong_dimension(text, number, unit));
        }
        let value = unit.convert(number, &base);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(QuantityError::NotFinite { text: text.to_owned(), unit: self.unit.to_owned() })
        }
    }

    /// What belongs here, by example: `a speed such as 20 or "20 um/h"`.
    pub fn wanted(&self, example: f64) -> String {
        let (name, number) = (with_article(self.name), format_number(example));
        if self.unit == "1" {
            return format!("{name} such as {number}");
        }
        format!("{name} such as {number} or \"{}\"", self.display(example))
    }

    /// `value` with the unit, as in `20 um/h`, `0.93 /h` or, without a unit, `0.5`.
    pub fn display(&self, value: f64) -> String {
        let number = format_number(value);
        match (self.unit, self.unit.strip_prefix("1/")) {
            ("1", _) => number,
            (_, Some(divisor)) => format!("{number} /{divisor}"),
            (unit, None) => format!("{number} {unit}"),
        }
    }

    fn wrong_dimension(&self, text: &str, number: f64, unit: Unit) -> QuantityError {
        let (text, wanted) = (text.to_owned(), self.wanted(number));
        if unit == Unit::ONE {
            return QuantityError::NoUnit { text, wanted };
        }
        let known = KINDS.iter().find(|kind| Unit::parse(kind.unit).is_ok_and(|u| u.dimension() == unit.dimension()));
        let found = known.map_or_else(|| "of another dimension".to_owned(), |kind| with_article(kind.name));
        QuantityError::Dimension { text, found, wanted }
    }
}

/// A number as people write it: the shortest digits that read back as the same bits, with an exponent when far from 1.
pub fn format_number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-4..1e7).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

/// `word` behind the article it takes: `a speed`, `an angle`.
pub fn with_article(word: &str) -> String {
    let article = if word.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {word}")
}

/// The JSON schema of a quantity: a number or a string, with its kind.
pub fn quantity_schema(kind: Kind<'_>) -> Schema {
    json_schema!({ "type": ["number", "string"], "x-quantity": kind.name, "x-unit": kind.unit })
}

/// Writes a quantity as a plain number in base units.
///
/// # Errors
/// Those of the serializer.
pub fn serialize_quantity<S: Serializer>(value: f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(value)
}

/// Reads a quantity from a number in base units or from a text with its unit.
///
/// # Errors
/// Those of the deserializer, or the message of a [`QuantityError`].
pub fn deserialize_quantity<'de, Q: Quantity, D: Deserializer<'de>>(deserializer: D) -> Result<Q, D::Error> {
    deserializer.deserialize_any(QuantityVisitor(Q::KIND)).map(Q::new)
}

struct QuantityVisitor(Kind<'static>);

impl Visitor<'_> for QuantityVisitor {
    type Value = f64;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0.wanted(1.0))
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<f64, E> {
        if value.is_finite() { Ok(value) } else { Err(E::custom(format!("{value} is not a finite number"))) }
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<f64, E> {
        Ok(value as f64)
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<f64, E> {
        Ok(value as f64)
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<f64, E> {
        self.0.read(text).map_err(E::custom)
    }
}

quantity! {
    /// A number without a unit; `"5 %"` is 0.05.
    Factor, "factor", "1"
}
quantity! {
    /// A length \[µm\].
    Length, "length", "um"
}
quantity! {
    /// A time \[h\].
    Time, "time", "h"
}
quantity! {
    /// A rate \[1/h\].
    Rate, "rate", "1/h"
}
quantity! {
    /// A speed \[µm/h\].
    Speed, "speed", "um/h"
}
quantity! {
    /// A diffusivity \[µm²/h\].
    Diffusivity, "diffusivity", "um^2/h"
}
quantity! {
    /// A concentration \[nM\].
    Concentration, "concentration", "nM"
}
quantity! {
    /// A release of molecules per area (in the plane) or volume, as a rate of concentration \[nM/h\].
    ReleaseRate, "release rate", "nM/h"
}
quantity! {
    /// A gradient of a concentration \[nM/µm\].
    ConcentrationGradient, "concentration gradient", "nM/um"
}
quantity! {
    /// A relative gradient |∇c|/c \[1/µm\]; `"1 %/10um"` is 0.001.
    Gradient, "relative gradient", "1/um"
}
quantity! {
    /// A pressure, a stress or a stiffness \[Pa\].
    Pressure, "pressure", "Pa"
}
quantity! {
    /// A gradient of stiffness \[Pa/µm\].
    StiffnessGradient, "stiffness gradient", "Pa/um"
}
quantity! {
    /// A force \[pN\].
    Force, "force", "pN"
}
quantity! {
    /// A drag: force over speed \[pN·h/µm\].
    Drag, "drag", "pN*h/um"
}
quantity! {
    /// An elongational viscosity: force over rate of elongation \[pN·h\].
    ElongationalViscosity, "elongational viscosity", "pN*h"
}
quantity! {
    /// An electric field \[V/m\], which is also mV/mm.
    ElectricField, "electric field", "V/m"
}
quantity! {
    /// An angle \[degrees\]; [`Angle::radians`] for use in formulas.
    Angle, "angle", "deg"
}
quantity! {
    /// An angle per time \[degrees/h\].
    AngularSpeed, "angular speed", "deg/h"
}
quantity! {
    /// An area \[µm²\].
    Area, "area", "um^2"
}

/// The kinds by which a unit of the wrong dimension is named.
const KINDS: [Kind<'static>; 19] = [
    Factor::KIND,
    Length::KIND,
    Time::KIND,
    Rate::KIND,
    Speed::KIND,
    Diffusivity::KIND,
    Concentration::KIND,
    ReleaseRate::KIND,
    ConcentrationGradient::KIND,
    Gradient::KIND,
    Pressure::KIND,
    StiffnessGradient::KIND,
    Force::KIND,
    Drag::KIND,
    ElongationalViscosity::KIND,
    ElectricField::KIND,
    Angle::KIND,
    AngularSpeed::KIND,
    Area::KIND,
];

impl Angle {
    /// The angle in radians.
    pub fn radians(self) -> f64 {
        self.0.to_radians()
    }
}

impl AngularSpeed {
    /// The angle per time in radians per hour.
    pub fn radians_per_hour(self) -> f64 {
        self.0.to_radians()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read<Q: Quantity>(text: &str) -> f64 {
        Q::KIND.read(text).unwrap()
    }

    #[test]
    fn the_numbers_of_the_model_are_read_exactly() {
        assert_eq!(read::<Diffusivity>("30 um^2/s"), 108_000.0);
        assert_eq!(read::<Rate>("1e-3 /s"), 3.6);
        assert_eq!(read::<Speed>("20 µm/h"), 20.0);
        assert_eq!(read::<Time>("2 min"), 2.0 / 60.0);
        assert_eq!(read::<Factor>("5 %"), 0.05);
        assert_eq!(read::<Factor>("0.25"), 0.25);
        assert_eq!(read::<Gradient>("1 %/10um"), 0.001);
        assert_eq!(read::<ElectricField>("100 mV/mm"), 100.0);
        assert_eq!(read::<StiffnessGradient>("0.9 Pa/um"), 0.9);
        assert_eq!(read::<Angle>("3.141592653589793 rad"), 180.0);
        assert_eq!(Angle(90.0).radians(), std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn a_wrong_dimension_is_named_with_what_belongs_there() {
        let cases = [
            (Speed::KIND, "20 um", "\"20 um\" is a length; a speed such as 20 or \"20 um/h\" belongs here"),
            (Angle::KIND, "3 %", "\"3 %\" is a factor; an angle such as 3 or \"3 deg\" belongs here"),
            (Factor::KIND, "2 V/m", "\"2 V/m\" is an electric field; a factor such as 2 belongs here"),
            (Rate::KIND, "5 um^7", "\"5 um^7\" is of another dimension; a rate such as 5 or \"5 /h\" belongs here"),
            (Length::KIND, "5", "\"5\" has no unit; a length such as 5 or \"5 um\" belongs here"),
            (Length::KIND, "1e308 mm", "\"1e308 mm\" is not a finite number of um"),
        ];
        for (kind, text, message) in cases {
            assert_eq!(kind.read(text).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn serde_reads_numbers_and_texts_and_writes_base_units() {
        assert_eq!(serde_json::from_str::<Speed>("20").unwrap(), Speed(20.0));
        assert_eq!(serde_json::from_str::<Speed>("\"1 um/min\"").unwrap(), Speed(60.0));
        assert_eq!(serde_json::to_string(&Speed(60.0)).unwrap(), "60.0");
        let error = serde_json::from_str::<Speed>("\"20 h\"").unwrap_err().to_string();
        assert!(error.starts_with("\"20 h\" is a time; a speed such as 20 or \"20 um/h\" belongs here"), "{error}");
        assert!(serde_json::from_str::<Speed>("1e400").is_err());
        assert!(serde_json::from_str::<Speed>("true").is_err());
    }

    #[test]
    fn the_schema_carries_kind_and_unit() {
        let schema = schemars::schema_for!(Gradient).to_value();
        assert_eq!(schema["x-quantity"], "relative gradient");
        assert_eq!(schema["x-unit"], "1/um");
        assert_eq!(schema["type"], serde_json::json!(["number", "string"]));
    }

    proptest! {
        #[test]
        fn what_is_displayed_reads_back_to_the_same_bits(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO) {
            for kind in KINDS {
                let text = kind.display(value);
                prop_assert_eq!(kind.read(&text).unwrap().to_bits(), value.to_bits(), "{}", text);
            }
        }

        #[test]
        fn no_text_panics(text in "[-+0-9.eE%µu mshPaM/*^²⁻1]{0,16}|\\PC{0,12}") {
            for kind in KINDS {
                let _ = kind.read(&text);
            }
        }
    }
}
