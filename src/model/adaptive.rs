//! Steps that a tolerance chooses, for an embedded pair of explicit methods.
//!
//! A pair of orders p and p − 1 gives two results for the price of one. Where they differ by δx in place (µm, as deformed at
//! the step's end) and by δu in the velocity vector over v_g, the error of the step is taken to be, in µm,
//!
//! ```text
//! max over growing cones of  |δx| + v_g min(1/κ, T) |δu|
//! ```
//!
//! A heading that is off by |δu| leads the tip astray until a full pull has turned it back, which takes 1/κ: the weight is the
//! turning radius v_g/κ, or the length of way v_g T of the whole run T where that is less. A step is accepted if its error is
//! within the tolerance, and the result of order p is kept. Both results start from the heading after the first kick of the noise
//! and are compared before the second, so the kicks are no error.
//!
//! Steps are powers of two of the clock's tick and end at multiples of themselves, so that refined steps meet the same
//! instants and the same Brownian path. What decides the next step is kept in the [`Clock`] and nowhere else.

use super::births::{lay_origins, send_back};
use super::clock::{Clock, Kinks};
use super::components::Status;
use super::explicit::{difference, finish, run_stages, start_again};
use super::health::{Counters, Health};
use super::integrator::bring_tissue_to;
use super::movers::{ConeQuery, StepStart, each_growing};
use crate::kept;
use crate::numerics::runge_kutta::ButcherTableau;
use bevy_ecs::prelude::{Resource, World};

/// A longer step is tried if its error is expected to stay within this share of the tolerance.
const SAFETY: f64 = 0.8;

/// What chooses the steps; absent with a method of fixed steps.
#[derive(Debug, Clone, Copy, PartialEq, Resource)]
pub struct AdaptiveSteps {
    /// Largest error of a step (µm).
    pub tolerance: f64,
    /// Duration T of the run (h).
    pub duration: f64,
    /// Steps of one tick that were accepted with a larger error.
    pub missed: u64,
    /// The largest error of these (µm).
    pub worst: f64,
}

kept! { struct AdaptiveSteps { tolerance, duration, missed, worst } }

impl AdaptiveSteps {
    /// Steps to a tolerance (µm) in a run that lasts `duration` (h).
    pub fn new(tolerance: f64, duration: f64) -> Self {
        Self { tolerance, duration, missed: 0, worst: 0.0 }
    }

    fn note_miss(&mut self, error: f64, health: &mut Health) {
        self.missed += 1;
        self.worst = self.worst.max(error);
        let Self { tolerance, missed, worst, .. } = self;
        health.restate(
            "time: the tolerance was missed ",
            format_args!(
                "in {missed} steps of one tick, by an error of up to {worst:.3e} um instead of {tolerance:.3e} um"
            ),
        );
    }
}

/// An accepted step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Taken {
    /// Its end (ticks).
    pub to: u64,
    /// How many cones that were to be born in the first attempt are born later.
    pub sent_back: u64,
}

/// Runs one step of the clock's size, or of the half, the quarter, … of it until the error is within the tolerance.
pub(super) fn adaptive_step(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    pair: &ButcherTableau,
) -> Taken {
    let clock = *world.resource::<Clock>();
    let (from, mut sent_back) = (clock.now, 0);
    let mut to = from + clock.next_step();
    run_stages(world, cones, starts, (from, to), (pair, 0..1));
    let error = loop {
        run_stages(world, cones, starts, (from, to), (pair, 1..pair.stages()));
        let error = largest_error(world, cones, starts, (from, to), pair);
        if is_accepted(world, error, to - from) {
            break error;
        }
        world.resource_mut::<Counters>().rejected_steps += 1;
        let mut clock = world.resource_mut::<Clock>();
        clock.step = shorter(to - from);
        to = from + clock.next_step();
        let begin = clock.grid.hours(from);
        sent_back += send_back(world, cones, starts, to);
        bring_tissue_to(world, begin);
        each_growing(world, cones, starts, (from, to), start_again);
    };
    lay_origins(world, from);
    each_growing(world, cones, starts, (from, to), |step, mover| finish(step, mover, pair));
    pace(world, (from, to), error, pair.order);
    Taken { to, sent_back }
}

/// Lets the clock run on to an instant (ticks) at which nothing has happened.
pub fn idle_until(world: &mut World, to: u64) {
    let from = world.resource::<Clock>().now;
    if world.contains_resource::<AdaptiveSteps>() {
        pace(world, (from, to), 0.0, 1);
    }
    world.resource_mut::<Clock>().now = to;
}

/// Estimated error of a step (µm), the largest over the growing cones; NaN if one of them is.
fn largest_error(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    span: (u64, u64),
    pair: &ButcherTableau,
) -> f64 {
    let Some(duration) = world.get_resource::<AdaptiveSteps>().map(|steps| steps.duration) else { return 0.0 };
    each_growing(world, cones, starts, span, |step, mover| {
        let (place, vector) = difference(step, mover, pair);
        let radius = mover.cone.speed * duration.min(1.0 / step.growth.turning_rate);
        mover.start.stages().error = place.norm() + radius * vector.norm();
    });
    let growing = cones.iter(world).zip(starts).filter(|(cone, _)| *cone.1 == Status::Growing);
    growing
        .map(|(_, start)| start.stages().error)
        .fold(0.0, |worst: f64, error| if worst.is_nan() || error <= worst { worst } else { error })
}

/// Whether a step of so many ticks stands. An error that is no number stands too: the state it belongs to ends the run.
fn is_accepted(world: &mut World, error: f64, ticks: u64) -> bool {
    world.resource_scope::<Health, _>(|world, mut health| {
        let Some(mut steps) = world.get_resource_mut::<AdaptiveSteps>() else { return true };
        if error > steps.tolerance && error.is_finite() {
            if ticks > 1 {
                return false;
            }
            steps.note_miss(error, &mut health);
        }
        true
    })
}

/// The largest power of two below a number of ticks (2 or more).
fn shorter(ticks: u64) -> u64 {
    1 << (ticks - 1).ilog2()
}

/// Sets the next step after one over a span of ticks with an error (µm): twice as long if the error is expected to stay within
/// the tolerance and the instant reached is one of those at which the longer steps begin.
fn pace(world: &mut World, (from, to): (u64, u64), error: f64, order: u32) {
    let Some(tolerance) = world.get_resource::<AdaptiveSteps>().map(|steps| steps.tolerance) else { return };
    let stop = world.get_resource::<Kinks>().map_or(u64::MAX, |kinks| kinks.after(to));
    let mut clock = world.resource_mut::<Clock>();
    clock.stop = stop;
    let longer = 2 * clock.step;
    let growth = (longer as f64 / (to - from) as f64).powi(order as i32);
    if longer <= clock.grid.step_ticks() && to % longer == 0 && error * growth <= SAFETY * tolerance {
        clock.step = longer;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::clock::TimeGrid;

    fn world(step: u64, kink: u64) -> World {
        let mut world = World::new();
        let grid = TimeGrid::new(1.0).unwrap();
        world.insert_resource(Clock { step, ..Clock::new(grid, 10 * grid.step_ticks()) });
        world.insert_resource(AdaptiveSteps::new(1e-3, 10.0));
        world.init_resource::<Health>();
        let mut kinks = Kinks::default();
        kinks.add(kink);
        world.insert_resource(kinks);
        world
    }

    #[test]
    fn a_step_doubles_where_the_grid_allows_and_the_error_will_stay_within_the_tolerance() {
        let whole = TimeGrid::new(1.0).unwrap().step_ticks();
        let step = whole / 4;
        let after = |from: u64, to: u64, error: f64| {
            let mut world = world(step, u64::MAX - 1);
            pace(&mut world, (from, to), error, 3);
            world.resource::<Clock>().step
        };
        assert_eq!(after(step, 2 * step, 0.99e-4), 2 * step);
        assert_eq!(after(step, 2 * step, 1.01e-4), step, "eight times the error is too much");
        assert_eq!(after(2 * step, 3 * step, 0.0), step, "a longer step does not begin here");
        assert_eq!(after(2 * step - 8, 2 * step, 1e-9), step, "the error of a short rest tells little");
        let mut largest = world(whole, u64::MAX - 1);
        pace(&mut largest, (0, whole), 0.0, 3);
        assert_eq!(largest.resource::<Clock>().step, whole);
    }

    #[test]
    fn a_rejected_step_becomes_the_next_smaller_power_of_two() {
        assert_eq!([2, 3, 4, 5, 1 << 40].map(shorter), [1, 2, 2, 4, 1 << 39]);
    }

    #[test]
    fn the_clock_stops_at_the_next_kink_only() {
        let mut world = world(1 << 20, 12345);
        pace(&mut world, (0, 100), 0.0, 3);
        assert_eq!(world.resource::<Clock>().stop, 12345);
        pace(&mut world, (100, 12345), 0.0, 3);
        assert_eq!(world.resource::<Clock>().stop, u64::MAX);
    }

    #[test]
    fn only_one_tick_is_accepted_with_too_large_an_error_and_the_largest_of_these_is_noted() {
        let mut world = world(1, u64::MAX - 1);
        assert!(is_accepted(&mut world, 1e-3, 8) && !is_accepted(&mut world, 1.1e-3, 2));
        assert!(world.resource::<Health>().notes().is_empty());
        for error in [2e-3, 5e-3, 3e-3] {
            assert!(is_accepted(&mut world, error, 1));
        }
        let notes = world.resource::<Health>().notes();
        assert_eq!(
            notes,
            [
                "time: the tolerance was missed in 3 steps of one tick, by an error of up to 5.000e-3 um instead of 1.000e-3 um"
            ]
        );
        assert!(is_accepted(&mut world, f64::NAN, 8));
    }
}
