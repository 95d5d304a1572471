//! Time as a quantity on a dyadic grid.
//!
//! A step Δt = m·2^e (1 ≤ m < 2, in h) defines the *tick* m·2^−32 h. Times are whole numbers of ticks, so a time is exact,
//! a resumed run meets the same instants, and runs with Δt, Δt/2, Δt/4, … share one grid, which lets them share one
//! Brownian path (see [`super::brownian`]).

use crate::kept;
use bevy_ecs::prelude::Resource;

/// Ticks are `mantissa · 2^TICK_EXPONENT` hours.
const TICK_EXPONENT: i32 = -32;
/// Births are rounded to this many ticks (about 4 ms), which keeps their Brownian increments short sums.
const BIRTH_TICKS: u64 = 1 << 12;

/// The dyadic grid of time that belongs to a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeGrid {
    tick: f64,
    step: u64,
}

kept! { struct TimeGrid { tick, step } }

impl TimeGrid {
    /// The grid of a step Δt (h). Valid for 2^−31 h ≤ Δt < 2^20 h.
    ///
    /// Returns `None` outside that range.
    pub fn new(step: f64) -> Option<Self> {
        if !(step.is_finite() && (2f64.powi(-31)..2f64.powi(20)).contains(&step)) {
            return None;
        }
        let exponent = step.log2().floor() as i32;
        let exponent = if step < 2f64.powi(exponent) { exponent - 1 } else { exponent };
        let mantissa = step / 2f64.powi(exponent);
        Some(Self { tick: mantissa * 2f64.powi(TICK_EXPONENT), step: 1 << (exponent - TICK_EXPONENT) })
    }

    /// Length of a tick (h).
    pub fn tick(&self) -> f64 {
        self.tick
    }

    /// Ticks of one step.
    pub fn step_ticks(&self) -> u64 {
        self.step
    }

    /// Time (h) of an instant given in ticks.
    pub fn hours(&self, ticks: u64) -> f64 {
        ticks as f64 * self.tick
    }

    /// The nearest instant to a time (h ≥ 0), in ticks.
    pub fn nearest(&self, hours: f64) -> u64 {
        (hours / self.tick).round() as u64
    }

    /// The nearest instant at which a birth may happen, in ticks.
    pub fn nearest_birth(&self, hours: f64) -> u64 {
        self.nearest(hours).div_ceil(BIRTH_TICKS).saturating_mul(BIRTH_TICKS)
    }
}

/// Where the run stands: the instant reached, the end, and the grid.
#[derive(Debug, Clone, Copy, Resource)]
pub struct Clock {
    /// The dyadic grid.
    pub grid: TimeGrid,
    /// The instant reached, in ticks.
    pub now: u64,
    /// The last instant of the run, in ticks.
    pub end: u64,
    /// An instant that the coming step may not pass, in ticks; `u64::MAX` if there is none.
    pub stop: u64,
}

kept! { struct Clock { grid, now, end, stop } }

impl Clock {
    /// A clock at the start of a run that ends at `end` (ticks).
    pub fn new(grid: TimeGrid, end: u64) -> Self {
        Self { grid, now: 0, end, stop: u64::MAX }
    }

    /// Time reached (h).
    pub fn hours(&self) -> f64 {
        self.grid.hours(self.now)
    }

    /// Ticks of the step that comes next. It ends at a multiple of the grid's step; the one before a stop, the one after it and the last
    /// one may be shorter.
    pub fn next_step(&self) -> u64 {
        let whole = self.grid.step - self.now % self.grid.step;
        whole.min(self.end - self.now).min(self.stop - self.now)
    }

    /// Whether a clock at the start of a run may stand as `later` does.
    pub(super) fn may_become(&self, later: &Self) -> bool {
        (later.grid, later.end) == (self.grid, self.end) && later.now <= later.end && later.now < later.stop
    }

    /// Whether the end is reached.
    pub fn is_over(&self) -> bool {
        self.now >= self.end
    }
}

/// Instants at which the right-hand side has a kink in time (ticks, ascending). Steps of an adaptive method end there; others
/// take no notice.
#[derive(Debug, Clone, Default, Resource)]
pub struct Kinks(Vec<u64>);

impl Kinks {
    /// Adds an instant (ticks).
    pub fn add(&mut self, instant: u64) {
        if let Err(place) = self.0.binary_search(&instant) {
            self.0.insert(place, instant);
        }
    }

    /// The first one after an instant; `u64::MAX` if there is none.
    pub fn after(&self, now: u64) -> u64 {
        self.0.get(self.0.partition_point(|kink| *kink <= now)).copied().unwrap_or(u64::MAX)
    }
}

/// The instant at which the right-hand side is asked for (h): fields, tissue and receptors are those of this time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Resource)]
pub struct StageTime(pub f64);

kept! { wrapper StageTime }

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_the_step_keeps_the_grid() {
        let coarse = TimeGrid::new(1.0 / 60.0).unwrap();
        let fine = TimeGrid::new(0.25 / 60.0).unwrap();
        assert_eq!(coarse.tick(), fine.tick());
        assert_eq!(coarse.step_ticks(), 4 * fine.step_ticks());
        assert_eq!(coarse.hours(coarse.step_ticks()), 1.0 / 60.0);
    }

    #[test]
    fn a_step_is_exactly_itself_also_at_powers_of_two() {
        for step in [1.0, 0.5, 2.0, 0.1, 1.0 / 3.0, 72.0, 1e-6] {
            let grid = TimeGrid::new(step).unwrap();
            assert_eq!(grid.hours(grid.step_ticks()), step);
            assert!(grid.tick() >= 2f64.powi(TICK_EXPONENT) && grid.tick() < 2f64.powi(TICK_EXPONENT + 1));
        }
        assert!(TimeGrid::new(0.0).is_none() && TimeGrid::new(f64::NAN).is_none());
    }

    #[test]
    fn steps_end_at_multiples_of_the_grid_s_and_at_stops() {
        let grid = TimeGrid::new(1.0).unwrap();
        let whole = grid.step_ticks();
        let mut kinks = Kinks::default();
        [whole + 5, 7, 7].into_iter().for_each(|kink| kinks.add(kink));
        let mut clock = Clock { stop: kinks.after(0), ..Clock::new(grid, 2 * whole + 3) };
        let mut met = Vec::new();
        while !clock.is_over() {
            clock.now += clock.next_step();
            clock.stop = kinks.after(clock.now);
            met.push(clock.now);
        }
        assert_eq!(met, [7, whole, whole + 5, 2 * whole, 2 * whole + 3]);
    }
}
