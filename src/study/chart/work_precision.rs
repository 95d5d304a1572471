//! Error against time: what was measured of one choice, what it costs to be right, and which settings are worth their time.

use crate::record::statistics::Distribution;
use serde::Serialize;
use std::collections::BTreeMap;

/// Median, smallest and largest of repeated measurements, in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Seconds {
    /// Median.
    pub median: f64,
    /// Smallest.
    pub low: f64,
    /// Largest.
    pub high: f64,
}

impl Seconds {
    /// Of at least one measurement; none without.
    pub fn of(measured: &[f64]) -> Option<Self> {
        let Distribution { median, min, max, .. } = Distribution::of(measured)?;
        Some(Self { median, low: min, high: max })
    }
}

/// One setting, measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// The method: points of one method make a line.
    pub method: String,
    /// The setting in words.
    pub setting: String,
    /// The keys that make it, as `--set` takes them.
    pub set: Vec<String>,
    /// The number that is refined: a mesh size, a step, a tolerance.
    pub knob: f64,
    /// How long it took.
    pub seconds: Seconds,
    /// Errors by name.
    pub errors: BTreeMap<String, f64>,
    /// Counts worth knowing: unknowns, levels, steps.
    pub counts: BTreeMap<String, f64>,
    /// Whether this is what the scene has.
    pub default: bool,
}

/// One way to be wrong.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorKind {
    /// Its name in [`Point::errors`].
    pub name: String,
    /// What an axis says of it, with its unit.
    pub label: String,
    /// Below this the reference itself is in doubt; 0 where it is exact.
    pub floor: f64,
    /// Levels to compare with, such as the spread from seed to seed.
    pub levels: BTreeMap<String, f64>,
}

/// One choice that a scene offers, measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Factor {
    /// Its name: that of its files.
    pub name: String,
    /// What was measured.
    pub title: String,
    /// Name and unit of the number that is refined.
    pub knob: String,
    /// The errors; the first is the one that settings are chosen by. None where methods agree exactly: then time against the
    /// knob is what counts.
    pub errors: Vec<ErrorKind>,
    /// All settings.
    pub points: Vec<Point>,
    /// How it was done.
    pub remark: String,
    /// What to choose.
    pub advice: String,
}

/// Order of an error in the knob, fitted for one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slope {
    /// The method.
    pub method: String,
    /// p of error ~ knob^p, by least squares over the points above thrice the floor.
    pub order: f64,
    /// Points used.
    pub points: usize,
}

impl Factor {
    /// Names of the methods, in the order in which they come.
    pub fn methods(&self) -> Vec<&str> {
        let mut methods: Vec<&str> = Vec::new();
        for point in &self.points {
            if !methods.contains(&point.method.as_str()) {
                methods.push(&point.method);
            }
        }
        methods
    }

    /// Fitted orders of an error, for methods with three points or more above the floor; none of one that is judged by levels.
    pub fn slopes(&self, error: &ErrorKind) -> Vec<Slope> {
        if !error.levels.is_empty() {
            return Vec::new();
        }
        let fit = |method: &&str| {
            let of_method = self.points.iter().filter(|point| point.method == *method);
            let pairs = of_method.filter_map(|point| Some((point.knob, *point.errors.get(&error.name)?)));
            let above: Vec<[f64; 2]> = pairs
                .filter(|(knob, value)| *value > 3.0 * error.floor && *value > 0.0 && *knob > 0.0)
                .map(|(knob, value)| [knob.ln(), value.ln()])
                .collect();
            let order = slope(&above)?;
            (above.len() >= 3).then(|| Slope { method: (*method).to_owned(), order, points: above.len() })
        };
        self.methods().iter().filter_map(fit).collect()
    }

    /// Exponents p of time ~ knob^p, for methods with three points or more.
    pub fn growth(&self) -> Vec<Slope> {
        let fit = |method: &&str| {
            let of_method = self.points.iter().filter(|point| point.method == *method && point.knob > 0.0);
            let pairs: Vec<[f64; 2]> = of_method.map(|point| [point.knob.ln(), point.seconds.median.ln()]).collect();
            let order = slope(&pairs)?;
            (pairs.len() >= 3).then(|| Slope { method: (*method).to_owned(), order, points: pairs.len() })
        };
        self.methods().iter().filter_map(fit).collect()
    }

    /// The settings that no other beats in both time and error, fastest first.
    pub fn front(&self, error: &ErrorKind) -> Vec<&Point> {
        let value = |point: &Point| point.errors.get(&error.name).copied().filter(|e| e.is_finite());
        let mut sorted: Vec<(&Point, f64)> = self.points.iter().filter_map(|p| Some((p, value(p)?))).collect();
        sorted.sort_by(|a, b| a.0.seconds.median.total_cmp(&b.0.seconds.median).then(a.1.total_cmp(&b.1)));
        let mut best = f64::INFINITY;
        sorted.retain(|(_, error)| {
            let better = *error < best;
            best = best.min(*error);
            better
        });
        sorted.into_iter().map(|(point, _)| point).collect()
    }

    /// What to choose by an error: the scene's own setting against the cheapest that is as accurate.
    pub fn choice(&self, error: &ErrorKind) -> String {
        let front = self.front(error);
        let value = |point: &Point| point.errors.get(&error.name).copied().unwrap_or(f64::NAN);
        let Some(own) = self.points.iter().find(|point| point.default) else { return String::new() };
        let (own_error, own_seconds) = (value(own), own.seconds.median);
        let as_good = front.iter().find(|point| value(point) <= own_error.max(error.floor));
        let Some(best) = as_good else { return String::new() };
        let said = format!("{}, {}: {} in {}", own.method, own.setting, short(own_error), time(own_seconds));
        if own_seconds <= 1.25 * best.seconds.median {
            return format!("The scene's setting ({said}) is on the front or next to it.");
        }
        format!(
            "{}, {} is as accurate ({}) in {} as the scene's setting ({said}): choose it to save {:.0} % of this part's time.",
            best.method,
            best.setting,
            short(value(best)),
            time(best.seconds.median),
            100.0 * (1.0 - best.seconds.median / own_seconds)
        )
    }
}

/// A number with two digits.
pub fn short(value: f64) -> String {
    crate::record::plot_axis::word(format!("{value:.1e}").parse().unwrap_or(value))
}

/// Seconds in words.
pub fn time(seconds: f64) -> String {
    if seconds < 1.0 { format!("{} ms", short(1e3 * seconds)) } else { format!("{} s", short(seconds)) }
}

/// Least-squares slope of y over x; none for fewer than two different x.
pub(in crate::study) fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let n = points.len() as f64;
    let mean = |k: usize| points.iter().map(|point| point[k]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let across = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum::<f64>();
    let spread = points.iter().map(|point| (point[0] - x).powi(2)).sum::<f64>();
    (spread > 0.0).then(|| across / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(method: &str, knob: f64, seconds: f64, error: f64, default: bool) -> Point {
        Point {
            method: method.into(),
            setting: format!("h = {knob}"),
            set: Vec::new(),
            knob,
            seconds: Seconds { median: seconds, low: seconds, high: seconds },
            errors: [("e".to_owned(), error)].into(),
            counts: BTreeMap::new(),
            default,
        }
    }

    fn factor(points: Vec<Point>) -> Factor {
        let error = ErrorKind { name: "e".into(), label: "error".into(), floor: 1e-6, levels: BTreeMap::new() };
        let text = String::new;
        Factor {
            name: text(),
            title: text(),
            knob: text(),
            errors: vec![error],
            points,
            remark: text(),
            advice: text(),
        }
    }

    #[test]
    fn orders_are_those_of_the_power_laws_and_ignore_what_the_floor_hides() {
        let law = |method: &str, p: i32| {
            let method = method.to_owned();
            (0..8)
                .map(move |i| 2f64.powi(-i))
                .map(move |h| point(&method, h, 1.0 / h, (0.3 * h.powi(p)).max(1e-6), false))
        };
        let factor = factor(law("second", 2).chain(law("third", 3)).collect());
        let slopes = factor.slopes(&factor.errors[0]);
        assert_eq!(slopes.len(), 2);
        assert!((slopes[0].order - 2.0).abs() < 1e-12 && (slopes[1].order - 3.0).abs() < 1e-12, "{slopes:?}");
        assert_eq!((slopes[0].points, slopes[1].points), (8, 6));
    }

    #[test]
    fn the_front_holds_what_nothing_beats_and_the_advice_follows_it() {
        let slow_default = vec![
            point("a", 1.0, 1.0, 0.1, false),
            point("a", 0.5, 4.0, 0.01, true),
            point("b", 1.0, 2.0, 0.01, false),
            point("b", 2.0, 1.5, 0.5, false),
        ];
        let factor = factor(slow_default);
        let front: Vec<_> = factor.front(&factor.errors[0]).iter().map(|point| point.seconds.median).collect();
        assert_eq!(front, [1.0, 2.0]);
        let advice = factor.choice(&factor.errors[0]);
        assert!(advice.starts_with("b, h = 1") && advice.contains("save 50 %"), "{advice}");
        let fast_default =
            factor.points.iter().map(|point| Point { default: point.seconds.median == 2.0, ..point.clone() });
        let factor = self::factor(fast_default.collect());
        assert!(factor.choice(&factor.errors[0]).contains("on the front"));
    }

    #[test]
    fn seconds_are_the_median_and_the_ends() {
        let seconds = Seconds::of(&[3.0, 1.0, 2.0, 10.0]).unwrap();
        assert_eq!((seconds.median, seconds.low, seconds.high), (2.5, 1.0, 10.0));
        assert!(Seconds::of(&[]).is_none());
    }
}
