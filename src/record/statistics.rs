//! Statistics over seeds: descriptive numbers and bootstrap intervals.
//!
//! The *seed* is the unit of statistics: axons of one bundle follow each other and are not independent, so a measure is
//! first taken per run (one number a seed) and only then averaged. The interval of a mean is the percentile bootstrap
//! (Efron 1979): draw `n` of the `n` values with replacement, take the mean, repeat; the 2.5 % and 97.5 % quantiles of
//! those means are the bounds. For normal values its true coverage is P(|T_{n−1}| < 1.96 √((n−1)/n)): 92.9 % at n = 20,
//! 94.3 % at n = 50, so with few seeds it is a little too narrow.

use rand::{Rng, RngExt};
use serde::Serialize;

/// How many times the bootstrap resamples unless the caller says otherwise.
pub const RESAMPLES: usize = 10_000;

/// The share of probability inside an interval.
pub const CONFIDENCE: f64 = 0.95;

/// Location and spread of a list of values, all in the values' own unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distribution {
    /// How many values.
    pub n: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Sample standard deviation (divisor n − 1); none for a single value.
    pub sd: Option<f64>,
    /// Median.
    pub median: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Distribution {
    /// Describes the values; none if there are none. Values that are not finite are the caller's error and give none.
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.iter().any(|v| !v.is_finite()) {
            return None;
        }
        Some(Self {
            n: values.len(),
            mean: mean(values)?,
            sd: standard_deviation(values),
            median: median(values)?,
            min: values.iter().copied().reduce(f64::min)?,
            max: values.iter().copied().reduce(f64::max)?,
        })
    }
}

/// The mean of one measure over seeds with its 95 % percentile bootstrap interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SummaryOverSeeds {
    /// Mean over the seeds.
    pub mean: f64,
    /// Lower bound of the interval of the mean; none with fewer than two seeds, which carry no spread.
    pub low: Option<f64>,
    /// Upper bound of the interval of the mean; none with fewer than two seeds.
    pub high: Option<f64>,
    /// How many seeds gave a value.
    pub n: usize,
}

impl SummaryOverSeeds {
    /// Summarises one value a seed by [`RESAMPLES`] resamples drawn from `rng`; none if there is no value.
    pub fn of(values: &[f64], rng: &mut impl Rng) -> Option<Self> {
        let mean = mean(values)?;
        let interval = bootstrap_mean_interval(values, RESAMPLES, CONFIDENCE, rng);
        Some(Self { mean, low: interval.map(|i| i.0), high: interval.map(|i| i.1), n: values.len() })
    }

    /// Summarises one optional value a seed, leaving out the seeds without one (`n` says how many had one).
    pub fn of_present(values: &[Option<f64>], rng: &mut impl Rng) -> Option<Self> {
        let present: Vec<f64> = values.iter().copied().flatten().collect();
        Self::of(&present, rng)
    }

    /// Summarises the paired difference `treated − control`, seed by seed: the effect of switching one thing while all
    /// random draws stay. None if the lists are empty or differ in length.
    ///
    /// An interval that excludes zero says that the difference is the mechanism's at the 5 % level.
    pub fn of_difference(treated: &[f64], control: &[f64], rng: &mut impl Rng) -> Option<Self> {
        if treated.len() != control.len() {
            return None;
        }
        let differences: Vec<f64> = treated.iter().zip(control).map(|(t, c)| t - c).collect();
        Self::of(&differences, rng)
    }
}

/// The arithmetic mean Σx/n; none of an empty list.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The sample standard deviation √(Σ(x − x̄)²/(n − 1)), by two passes; none with fewer than two values.
pub fn standard_deviation(values: &[f64]) -> Option<f64> {
    let centre = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - centre).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

/// The median: [`quantile`] at one half.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The quantile at `probability` in 0…1 with linear interpolation between order statistics (position p(n − 1), "type 7",
/// the default of R and NumPy); none of an empty list or for a probability outside 0…1.
pub fn quantile(values: &[f64], probability: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    quantile_of_sorted(&sorted, probability)
}

/// [`quantile`] of values already in ascending order.
fn quantile_of_sorted(sorted: &[f64], probability: f64) -> Option<f64> {
    if sorted.is_empty() || !(0.0..=1.0).contains(&probability) {
        return None;
    }
    let position = probability * (sorted.len() - 1) as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    Some(sorted[below] + (sorted[above] - sorted[below]) * (position - below as f64))
}

/// The percentile bootstrap interval (low, high) of the mean, in the values' unit.
///
/// `resamples` means of `n` draws with replacement; the bounds are their quantiles at (1 ∓ `confidence`)/2. The same
/// generator state gives the same bits. None with fewer than two values, without resamples, or for a confidence outside
/// 0…1.
///
/// Source: Efron & Tibshirani, *An Introduction to the Bootstrap* (1993), § 13.3.
pub fn bootstrap_mean_interval(
    values: &[f64],
    resamples: usize,
    confidence: f64,
    rng: &mut impl Rng,
) -> Option<(f64, f64)> {
    if values.len() < 2 || !(0.0..=1.0).contains(&confidence) {
        return None;
    }
    let mut means: Vec<f64> = (0..resamples).map(|_| resampled_mean(values, rng)).collect();
    means.sort_by(f64::total_cmp);
    let tail = 0.5 * (1.0 - confidence);
    Some((quantile_of_sorted(&means, tail)?, quantile_of_sorted(&means, 1.0 - tail)?))
}

/// The mean of as many draws with replacement as there are values.
fn resampled_mean(values: &[f64], rng: &mut impl Rng) -> f64 {
    let count = values.len() as u32;
    let sum: f64 = (0..count).map(|_| values[rng.random_range(0..count) as usize]).sum();
    sum / f64::from(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution as _, StandardNormal};
    use std::convert::Infallible;

    /// SplitMix64 (Steele, Lea & Flood 2014), enough for tests.
    struct SplitMix(u64);

    impl rand::TryRng for SplitMix {
        type Error = Infallible;
        fn try_next_u32(&mut self) -> Result<u32, Infallible> {
            self.try_next_u64().map(|bits| (bits >> 32) as u32)
        }
        fn try_next_u64(&mut self) -> Result<u64, Infallible> {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            Ok(z ^ (z >> 31))
        }
        fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
            for byte in bytes {
                *byte = self.try_next_u64()? as u8;
            }
            Ok(())
        }
    }

    fn normals(count: usize, centre: f64, rng: &mut SplitMix) -> Vec<f64> {
        (0..count)
            .map(|_| {
                let z: f64 = StandardNormal.sample(rng);
                centre + z
            })
            .collect()
    }

    #[test]
    fn small_lists_have_their_textbook_mean_deviation_and_quantiles() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(mean(&values), Some(2.5));
        assert!((standard_deviation(&values).unwrap() - (5.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(median(&values), Some(2.5));
        assert_eq!(quantile(&values, 0.25), Some(1.75));
        assert_eq!(quantile(&values, 1.0), Some(4.0));
        let all = Distribution::of(&values).unwrap();
        assert_eq!((all.n, all.min, all.max), (4, 1.0, 4.0));
    }

    #[test]
    fn nothing_is_summarised_as_nothing_and_one_value_has_no_interval() {
        let mut rng = SplitMix(1);
        assert_eq!(mean(&[]), None);
        assert_eq!(median(&[]), None);
        assert_eq!(standard_deviation(&[3.0]), None);
        assert_eq!(quantile(&[1.0], 1.5), None);
        assert_eq!(Distribution::of(&[1.0, f64::NAN]), None);
        assert_eq!(SummaryOverSeeds::of(&[], &mut rng), None);
        let one = SummaryOverSeeds::of(&[3.0], &mut rng).unwrap();
        assert_eq!((one.mean, one.low, one.high, one.n), (3.0, None, None, 1));
        assert_eq!(serde_json::to_string(&one).unwrap(), r#"{"mean":3.0,"low":null,"high":null,"n":1}"#);
    }

    #[test]
    fn the_bootstrap_of_two_values_is_the_binomial_law() {
        // The mean of two draws from {0, 1} is 0, ½, 1 with probability ¼, ½, ¼: the quartiles lie at the steps.
        let (low, high) = bootstrap_mean_interval(&[0.0, 1.0], 10_000, 0.4, &mut SplitMix(2)).unwrap();
        assert_eq!((low, high), (0.5, 0.5));
        let (low, high) = bootstrap_mean_interval(&[0.0, 1.0], 10_000, 0.6, &mut SplitMix(2)).unwrap();
        assert_eq!((low, high), (0.0, 1.0));
    }

    #[test]
    fn the_interval_covers_the_true_mean_in_95_percent_of_normal_samples() {
        let (experiments, size) = (400, 50);
        let mut rng = SplitMix(3);
        let covered = (0..experiments)
            .filter(|_| {
                let sample = normals(size, 7.0, &mut rng);
                let (low, high) = bootstrap_mean_interval(&sample, 600, CONFIDENCE, &mut rng).unwrap();
                low <= 7.0 && 7.0 <= high
            })
            .count();
        let share = covered as f64 / f64::from(experiments);
        let standard_error = (0.95 * 0.05 / f64::from(experiments)).sqrt();
        assert!((share - 0.95).abs() < 4.0 * standard_error, "covered {share}");
    }

    #[test]
    fn the_width_of_the_interval_is_the_plug_in_standard_error_of_the_mean() {
        let mut rng = SplitMix(4);
        let sample = normals(200, 0.0, &mut rng);
        let plug_in = standard_deviation(&sample).unwrap() * (199.0_f64 / 200.0).sqrt() / 200.0_f64.sqrt();
        let (low, high) = bootstrap_mean_interval(&sample, RESAMPLES, CONFIDENCE, &mut rng).unwrap();
        // The Monte Carlo error of a 2.5 % quantile of 10,000 normal values is √(p(1−p)/N)/φ(1.96) = 0.027 σ.
        assert!(((high - low) / (2.0 * 1.959_964 * plug_in) - 1.0).abs() < 4.0 * 0.027 / 1.96);
    }

    #[test]
    fn pairing_removes_what_the_seeds_share() {
        let mut rng = SplitMix(5);
        let control: Vec<f64> = normals(20, 0.0, &mut rng).iter().map(|v| 100.0 * v).collect();
        let treated: Vec<f64> = control.iter().zip(normals(20, 3.0, &mut rng)).map(|(c, d)| c + d).collect();
        let effect = SummaryOverSeeds::of_difference(&treated, &control, &mut rng).unwrap();
        assert!(effect.low.unwrap() > 2.0 && effect.high.unwrap() < 4.0);
        assert_eq!(SummaryOverSeeds::of_difference(&treated, &control[1..], &mut rng), None);
    }

    #[test]
    fn the_same_generator_gives_the_same_bits() {
        let values = [1.0, 5.0, 2.5, 8.0];
        let first = SummaryOverSeeds::of(&values, &mut SplitMix(6)).unwrap();
        assert_eq!(Some(first), SummaryOverSeeds::of(&values, &mut SplitMix(6)));
        assert_ne!(Some(first), SummaryOverSeeds::of(&[1.0, 5.0, 2.5, 8.5], &mut SplitMix(6)));
        let with_gaps = [Some(1.0), None, Some(5.0), Some(2.5), Some(8.0)];
        assert_eq!(Some(first), SummaryOverSeeds::of_present(&with_gaps, &mut SplitMix(6)));
    }
}
