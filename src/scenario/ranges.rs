//! The ranges of a schema: what is possible (`minimum`, `exclusiveMinimum`, `maximum`, `exclusiveMaximum`) and what is usual (`x-typical`).

use serde_json::Value;

use crate::model::quantity::{Kind, format_number};

/// A bound and whether it belongs to the range itself.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bound {
    value: f64,
    included: bool,
}

/// The numbers that are possible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    lower: Option<Bound>,
    upper: Option<Bound>,
}

impl Range {
    /// The range a schema states.
    pub(super) fn of(schema: &Value) -> Self {
        let bound = |keyword: &str, included| {
            schema.get(keyword).and_then(Value::as_f64).map(|value| Bound { value, included })
        };
        let (least, above) = (bound("minimum", true), bound("exclusiveMinimum", false));
        let (most, below) = (bound("maximum", true), bound("exclusiveMaximum", false));
        let tighter = |a: Option<Bound>, b: Option<Bound>, first: fn(f64, f64) -> bool| match (a, b) {
            (Some(a), Some(b)) => Some(if first(a.value, b.value) { a } else { b }),
            (a, b) => a.or(b),
        };
        Self { lower: tighter(least, above, |a, b| a > b), upper: tighter(most, below, |a, b| a < b) }
    }

    /// Whether `value` is possible.
    pub(super) fn contains(&self, value: f64) -> bool {
        let above = self.lower.is_none_or(|low| value > low.value || (low.included && value == low.value));
        let below = self.upper.is_none_or(|high| value < high.value || (high.included && value == high.value));
        above && below
    }

    /// The range as a relation, such as `0 ≤ poisson < 0.5` or `speed ≥ 0 um/h`.
    pub(super) fn describe(&self, name: &str, kind: Option<Kind<'_>>) -> String {
        let sign = |bound: Bound, strict, loose| if bound.included { loose } else { strict };
        match (self.lower, self.upper) {
            (Some(low), Some(high)) => {
                let (left, right) = (sign(low, "<", "≤"), sign(high, "<", "≤"));
                format!("{} {left} {name} {right} {}", format_number(low.value), with_unit(high.value, kind))
            }
            (Some(low), None) => format!("{name} {} {}", sign(low, ">", "≥"), with_unit(low.value, kind)),
            (None, Some(high)) => format!("{name} {} {}", sign(high, "<", "≤"), with_unit(high.value, kind)),
            (None, None) => format!("{name} is any number"),
        }
    }
}

/// The usual range, when a schema states one.
pub(super) fn typical(schema: &Value) -> Option<(f64, f64)> {
    let bounds = schema.get("x-typical")?.as_array()?;
    Some((bounds.first()?.as_f64()?, bounds.get(1)?.as_f64()?))
}

/// A number with the unit of its kind, if it has one.
pub(super) fn with_unit(value: f64, kind: Option<Kind<'_>>) -> String {
    kind.map_or_else(|| format_number(value), |kind| kind.display(value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_range_contains_its_included_bounds_only() {
        let range = Range::of(&json!({"minimum": 0.0, "exclusiveMaximum": 0.5}));
        assert_eq!([-1e-9, 0.0, 0.49, 0.5].map(|value| range.contains(value)), [false, true, true, false]);
        assert_eq!(range.describe("poisson", None), "0 ≤ poisson < 0.5");
        let above = Range::of(&json!({"minimum": -1, "exclusiveMinimum": 0}));
        assert_eq!(above.describe("step", Some(Kind { name: "time", unit: "h" })), "step > 0 h");
        assert!(Range::of(&json!({})).contains(f64::MAX));
    }
}
