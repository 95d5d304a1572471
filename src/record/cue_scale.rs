//! The ranges of concentration that colours stand for, common to all panels of a figure.

use super::colour::{Effect, Ramp};
use super::scene_figure::Panel;

/// The ramp and the range of concentrations of one effect, common to all panels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CueScale {
    pub(super) effect: Effect,
    pub(super) ramp: Ramp,
    pub(super) range: LogRange,
    /// Names of the cues of this effect, each once.
    pub(super) names: Vec<String>,
}

impl CueScale {
    /// The scale of an effect over a figure; none if no cue of that effect is anywhere above zero.
    pub(super) fn of(panels: &[Panel], effect: Effect) -> Option<Self> {
        let sums: Vec<Vec<f64>> = panels.iter().filter_map(|panel| total_concentration(panel, effect)).collect();
        let range = LogRange::around(sums.iter().flatten().copied())?;
        let mut names: Vec<String> = Vec::new();
        for cue in panels.iter().flat_map(|panel| &panel.cues).filter(|cue| cue.effect == effect) {
            if !names.contains(&cue.name) {
                names.push(cue.name.clone());
            }
        }
        Some(Self { effect, ramp: Ramp::of(effect), range, names })
    }
}

/// The nodal sum of the concentrations of all cues of an effect, nM; none if the panel has none.
pub(super) fn total_concentration(panel: &Panel, effect: Effect) -> Option<Vec<f64>> {
    let mut layers = panel.cues.iter().filter(|cue| cue.effect == effect);
    let mut sum = layers.next()?.concentration.clone();
    for layer in layers {
        sum.iter_mut().zip(&layer.concentration).for_each(|(sum, value)| *sum += value);
    }
    Some(sum)
}

/// A range of concentrations on a logarithmic scale, nM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LogRange {
    /// Lower end, a power of ten.
    pub(super) low: f64,
    /// Upper end: 1, 2 or 5 times a power of ten.
    pub(super) high: f64,
}

impl LogRange {
    /// A range that ends just above the largest value and begins at the decade below the smallest positive value or a
    /// hundredth of the largest, whichever is higher; none without a positive value.
    fn around(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (least, most) =
            values.filter(|value| *value > 1e-300).fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
        if most <= 0.0 {
            return None;
        }
        let decade = 10.0_f64.powi(most.log10().floor() as i32);
        let step = [1.0, 2.0, 5.0].into_iter().find(|step| step * decade >= most * (1.0 - 1e-9));
        let high = step.unwrap_or(10.0) * decade;
        let lowest = least.max(1e-2 * most).min(0.1 * high) * (1.0 + 1e-9);
        Some(Self { low: 10.0_f64.powi(lowest.log10().floor() as i32), high })
    }

    /// Where a concentration lies: 0 at and below the lower end, 1 at and above the upper.
    pub(super) fn share(&self, concentration: f64) -> f64 {
        if concentration > self.low {
            ((concentration / self.low).ln() / (self.high / self.low).ln()).min(1.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_end_above_the_largest_value_and_begin_at_a_decade() {
        let range = LogRange::around([27.0, 0.3, 0.0].into_iter()).unwrap();
        assert_eq!((range.low, range.high), (0.1, 50.0));
        let range = LogRange::around([10.0, 1e-30].into_iter()).unwrap();
        assert_eq!((range.low, range.high), (0.1, 10.0));
        let flat = LogRange::around([3.0].into_iter()).unwrap();
        assert!(flat.low <= 0.5 && flat.high == 5.0);
        assert_eq!((range.share(1e-9), range.share(10.0), range.share(99.0)), (0.0, 1.0, 1.0));
        assert!((range.share(1.0) - 0.5).abs() < 1e-12);
        assert_eq!(LogRange::around([0.0, -1.0].into_iter()), None);
    }
}
