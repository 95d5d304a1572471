//! Whether a step of a cone stands, and how long the next one is.

/// A longer step is tried if its error is expected to stay within this share of the tolerance.
const SAFETY: f64 = 0.8;

/// What decides whether a step stands, and the size of the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule {
    /// Ticks of the clock's step.
    pub(super) whole: u64,
    /// Largest error of a step (µm).
    pub(super) tolerance: f64,
    /// Order of the result that is kept.
    pub(super) order: u32,
}

impl Rule {
    /// Whether a step over a span of ticks stands. One of a tick does, whatever its error (µm), and one whose error is no number: the
    /// state it belongs to ends the run.
    pub(super) fn stands(&self, (from, to): (u64, u64), error: f64) -> bool {
        error <= self.tolerance || !error.is_finite() || to - from == 1
    }

    /// Halvings of the step after one with `level` of them over a span of ticks: as many as make it shorter, if that one does not stand;
    /// one less, if with a step of twice the size the error is expected to stay within the tolerance.
    pub(super) fn next_level(&self, span: (u64, u64), error: f64, level: u8) -> u8 {
        let ticks = span.1 - span.0;
        if !self.stands(span, error) {
            return (self.whole.ilog2() - shorter(ticks).ilog2()) as u8;
        }
        let longer = 2.0 * (self.whole >> level) as f64;
        let expected = error * (longer / ticks as f64).powi(self.order as i32);
        if expected <= SAFETY * self.tolerance { level.saturating_sub(1) } else { level }
    }
}

/// The largest power of two below a number of ticks (2 or more).
pub(super) fn shorter(ticks: u64) -> u64 {
    1 << (ticks - 1).ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: u64 = 1 << 20;

    fn rule() -> Rule {
        Rule { whole: WHOLE, tolerance: 1e-3, order: 3 }
    }

    #[test]
    fn a_step_doubles_where_the_error_will_stay_within_the_tolerance() {
        let quarter = (WHOLE / 4, WHOLE / 2);
        assert_eq!(rule().next_level(quarter, 0.99e-4, 2), 1);
        assert_eq!(rule().next_level(quarter, 1.01e-4, 2), 2, "eight times the error is too much");
        assert_eq!(rule().next_level((WHOLE / 2 - 8, WHOLE / 2), 1e-9, 2), 2, "the error of a short rest tells little");
        assert_eq!(rule().next_level((0, WHOLE), 0.0, 0), 0, "none is longer than the clock's");
    }

    #[test]
    fn a_rejected_step_becomes_the_next_smaller_power_of_two() {
        assert_eq!([2, 3, 4, 5, 1 << 40].map(shorter), [1, 2, 2, 4, 1 << 39]);
        assert_eq!(rule().next_level((0, WHOLE), 2e-3, 0), 1);
        assert_eq!(rule().next_level((0, 5), 2e-3, 0), 18, "of a short rest too");
    }

    #[test]
    fn only_one_tick_stands_with_too_large_an_error() {
        assert!(rule().stands((0, 8), 1e-3) && !rule().stands((0, 2), 1.1e-3));
        assert!(rule().stands((7, 8), 2e-3) && rule().stands((0, 8), f64::NAN));
    }
}
