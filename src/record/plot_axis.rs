//! An axis of a plot: its range, where its ticks stand and what they say.

/// One axis of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Whether equal steps are equal ratios; values that are not positive are then left out.
    pub logarithmic: bool,
    /// Ends of the axis; fitted to the data if absent.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A logarithmic axis, fitted to the data.
    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: true, range: None }
    }

    /// An axis of equal steps, fitted to the data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: false, range: None }
    }
}

/// An axis with its ends known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    logarithmic: bool,
    low: f64,
    high: f64,
}

/// Decades (or parts of the range) that a fitted axis leaves free at each end.
const ROOM: f64 = 0.06;
/// Ticks with a word at most.
const MOST_TICKS: f64 = 7.0;

impl Scale {
    /// The scale for an axis and the values to be shown on it.
    pub(super) fn of(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let logarithmic = axis.logarithmic;
        let bare = Self { logarithmic, low: 0.0, high: 1.0 };
        let shown = values.filter_map(|value| bare.transform(value));
        let fitted = shown.fold(None, |ends: Option<[f64; 2]>, value| {
            Some(ends.map_or([value, value], |[low, high]| [low.min(value), high.max(value)]))
        });
        let given = axis.range.and_then(|[low, high]| Some([bare.transform(low)?, bare.transform(high)?]));
        let [low, high] = given.or(fitted).unwrap_or([0.0, 1.0]);
        let extent = if high > low { high - low } else { 1.0 };
        let room = if given.is_some() { 0.0 } else { ROOM * extent + if high > low { 0.0 } else { 0.5 } };
        Self { logarithmic, low: low - room, high: high + room }
    }

    /// The value as the axis counts; none where it cannot be shown.
    fn transform(&self, value: f64) -> Option<f64> {
        let counted = if self.logarithmic { value.log10() } else { value };
        counted.is_finite().then_some(counted)
    }

    /// Share 0…1 of the axis at which a value stands; none outside its ends.
    pub(super) fn share(&self, value: f64) -> Option<f64> {
        let share = (self.transform(value)? - self.low) / (self.high - self.low);
        (-1e-9..=1.0 + 1e-9).contains(&share).then_some(share)
    }

    /// Ticks with their words; on a logarithmic axis further ones without.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic { self.logarithmic_ticks() } else { self.linear_ticks() }
    }

    fn logarithmic_ticks(&self) -> Vec<(f64, String)> {
        let decades = self.high - self.low;
        let every = (decades / MOST_TICKS).ceil().max(1.0) as i32;
        let digits: &[i32] = match decades {
            d if d < 0.75 => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
            d if d < 2.0 => &[1, 2, 5],
            _ => &[1],
        };
        let decade_range = self.low.floor() as i32..=self.high.ceil() as i32;
        let all = decade_range.flat_map(|decade| (1..10).map(move |digit| (decade, digit)));
        let tick = |(decade, digit): (i32, i32)| {
            let value = f64::from(digit) * 10f64.powi(decade);
            let worded = digits.contains(&digit) && decade.rem_euclid(every) == 0;
            self.share(value).map(|share| (share, if worded { word(value) } else { String::new() }))
        };
        all.filter(|(_, digit)| every == 1 || *digit == 1).filter_map(tick).collect()
    }

    fn linear_ticks(&self) -> Vec<(f64, String)> {
        let rough = (self.high - self.low) / (MOST_TICKS - 1.0);
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|step| *step >= rough).unwrap_or(rough);
        // An end that is a tick but for round-off has it.
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        let tick = |i: i64| self.share(i as f64 * step).map(|share| (share, word(tidy(i as f64 * step, step))));
        (first..=last).filter_map(tick).collect()
    }
}

/// A multiple of a step without the digits that round-off adds.
fn tidy(value: f64, step: f64) -> f64 {
    let digits = (2.0 - step.log10().floor()).clamp(0.0, 15.0) as usize;
    format!("{value:.digits$}").parse().unwrap_or(value)
}

/// A number as it is written on axes and in notes: plain where that is short, with a power of ten elsewhere.
pub fn word(value: f64) -> String {
    let size = value.abs();
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if size == 0.0 || (1e-3..1e5).contains(&size) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(scale: &Scale) -> Vec<String> {
        scale.ticks().into_iter().map(|(_, word)| word).filter(|word| !word.is_empty()).collect()
    }

    #[test]
    fn a_logarithmic_axis_has_its_decades_in_place_and_says_only_some_of_many() {
        let scale = Scale::of(&Axis::logarithmic("x"), [1e-3, 1e2].into_iter());
        assert_eq!(words(&scale), ["0.001", "0.01", "0.1", "1", "10", "100"]);
        let middle = scale.share(10f64.powf(-0.5)).unwrap();
        assert!((middle - 0.5).abs() < 1e-12);
        let wide = Scale::of(&Axis::logarithmic("x"), [1e-16, 1e4].into_iter());
        assert!((3..=8).contains(&words(&wide).len()), "{:?}", words(&wide));
        assert!(words(&Scale::of(&Axis::logarithmic("x"), [2.0, 4.0].into_iter())).len() >= 2);
    }

    #[test]
    fn a_linear_axis_has_round_ticks_without_round_off() {
        let axis = Axis { range: Some([0.0, 0.3]), ..Axis::linear("x") };
        assert_eq!(words(&Scale::of(&axis, std::iter::empty())), ["0", "0.05", "0.1", "0.15", "0.2", "0.25", "0.3"]);
        assert_eq!(Scale::of(&axis, std::iter::empty()).share(0.4), None);
    }

    #[test]
    fn values_that_cannot_be_shown_are_left_out() {
        let scale = Scale::of(&Axis::logarithmic("x"), [0.0, -1.0, f64::NAN, 5.0].into_iter());
        assert!((scale.share(5.0).unwrap() - 0.5).abs() < 1e-12);
        assert!(scale.share(0.0).is_none() && scale.share(f64::INFINITY).is_none());
        assert!(Scale::of(&Axis::linear("x"), std::iter::empty()).share(0.5).is_some());
    }

    #[test]
    fn words_are_short() {
        assert_eq!([0.0, 0.1234567, 12345.6, 1.5e-7, -2e6].map(word), ["0", "0.123", "12300", "1.5e-7", "-2e6"]);
    }
}
