//! Steps of each cone's own size, which a tolerance chooses, for an embedded pair of explicit methods.
//!
//! A pair of orders p and p − 1 gives two results for the price of one. Where they differ by δx in place (µm, as deformed at
//! the step's end) and by δu in the velocity vector over v_g, the error of a cone's step is taken to be, in µm,
//!
//! ```text
//! |δx| + v_g min(1/κ, T) |δu|
//! ```
//!
//! A heading that is off by |δu| leads the tip astray until a full pull has turned it back, which takes 1/κ: the weight is the
//! turning radius v_g/κ, or the length of way v_g T of the whole run T where that is less. A cone's step is accepted if its error is
//! within the tolerance, and the result of order p is kept. Both results start from the heading after the first kick of the noise
//! and are compared before the second, so the kicks are no error.
//!
//! The clock's step Δt is the largest. A cone takes it whole or in parts of Δt/2, Δt/4, …, which end at multiples of themselves, so
//! that they meet the same instants and the same Brownian path. Those of one size step together while the others wait
//! ([`Status::Waiting`]); at multiples of Δt all meet. A step of the clock that takes more than 4000 parts for each growing cone, on
//! average, ends the run: a tolerance may ask for what no computer does. Shafts are those of the step's start for all of them. Where a
//! mechanism lets cones act on one another within a step, all take the steps of the one that needs the shortest.

use super::clock::{Clock, Kinks};
use super::components::{GrowthCone, Status};
use super::explicit::{difference, finish, run_stages, start_again};
use super::health::{Counters, Health};
use super::integrator::bring_tissue_to;
use super::movers::{ConeQuery, Stages, StepStart, each_growing};
use super::pace::{Rule, shorter};
use crate::kept;
use crate::numerics::runge_kutta::ButcherTableau;
use bevy_ecs::change_detection::DetectChangesMut;
use bevy_ecs::prelude::{Resource, World};

/// Parts of a step of the clock that growing cones may take, rejected ones too, on average.
const MOST_PARTS: u64 = 4000;

/// What chooses the steps; absent with a method of fixed steps.
#[derive(Debug, Clone, PartialEq, Resource)]
pub struct AdaptiveSteps {
    /// Largest error of a cone's step (µm).
    pub tolerance: f64,
    /// Duration T of the run (h).
    pub duration: f64,
    /// Whether all cones take steps of one size.
    pub together: bool,
    /// Halvings of the clock's step that each cone takes next, in the order of cones; none before the first step.
    pub levels: Vec<u8>,
    /// Steps of one tick that were accepted with a larger error.
    pub missed: u64,
    /// The largest error of these (µm).
    pub worst: f64,
}

kept! { struct AdaptiveSteps { tolerance, duration, together, levels, missed, worst } }

impl AdaptiveSteps {
    /// Steps to a tolerance (µm) in a run that lasts `duration` (h).
    pub fn new(tolerance: f64, duration: f64) -> Self {
        Self { tolerance, duration, together: false, levels: Vec::new(), missed: 0, worst: 0.0 }
    }

    /// Whether steps that nothing was taken of may become `later`, on a clock whose step has so many ticks, with so many cones.
    pub(super) fn may_become(&self, later: &Self, step: u64, cones: usize) -> bool {
        let given = |steps: &Self| (steps.tolerance, steps.duration, steps.together);
        let fits = later.levels.is_empty() || later.levels.len() == cones;
        given(self) == given(later) && fits && later.levels.iter().all(|level| u64::from(*level) <= step.ilog2().into())
    }

    fn note_misses(&mut self, missed: &[f64], health: &mut Health) {
        if missed.is_empty() {
            return;
        }
        self.missed += missed.len() as u64;
        self.worst = missed.iter().copied().fold(self.worst, f64::max);
        let Self { tolerance, missed, worst, .. } = self;
        health.restate(
            "time: the tolerance was missed ",
            format_args!(
                "in {missed} steps of one tick, by an error of up to {worst:.3e} um instead of {tolerance:.3e} um"
            ),
        );
    }
}

/// Runs one step of the clock over a span of ticks. Returns how many steps cones took in it.
pub(super) fn adaptive_step(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    span: (u64, u64),
    pair: &ButcherTableau,
) -> u64 {
    let whole = world.resource::<Clock>().grid.step_ticks();
    let Some(mut steps) = world.get_resource_mut::<AdaptiveSteps>() else { return 0 };
    let (tolerance, duration, together) = (steps.tolerance, steps.duration, steps.together);
    let mut levels = std::mem::take(&mut steps.levels);
    levels.resize(starts.len(), 0);
    for (start, level) in starts.iter_mut().zip(&levels) {
        let stages = start.stages();
        (stages.level, stages.reached) = (*level, span.0);
    }
    let rule = Rule { whole, tolerance, order: pair.order };
    let growing = cones.iter(world).filter(|cone| cone.1.grows()).count() as u64;
    let left = Some(MOST_PARTS * growing);
    let mut cover = Cover { cones, starts, pair, rule, duration, together, left, taken: 0, missed: Vec::new() };
    cover.cover(world, span, true);
    let Cover { taken, missed, left, .. } = cover;
    for mut cone in cones.iter_mut(world).filter(|cone| *cone.1 == Status::Waiting) {
        cone.1.set_if_neq(Status::Growing);
    }
    for (level, start) in levels.iter_mut().zip(starts) {
        *level = start.stages().level;
    }
    world.resource_scope::<Health, _>(|world, mut health| {
        let mut steps = world.resource_mut::<AdaptiveSteps>();
        steps.levels = levels;
        steps.note_misses(&missed, &mut health);
        if left.is_none() {
            health.report(world.resource::<Clock>().hours(), too_many_parts(tolerance));
        }
    });
    taken
}

/// What is said of a step that was given up, at the time of its start.
fn too_many_parts(tolerance: f64) -> String {
    format!(
        "the step from here takes more than {MOST_PARTS} parts a growing cone to keep errors within {tolerance:e} um, /time/tolerance: a larger \
         one is needed, or a method of fixed steps"
    )
}

/// Brings the clock to an instant (ticks) at which a step ends.
pub fn reach(world: &mut World, to: u64) {
    let stop = match world.contains_resource::<AdaptiveSteps>() {
        true => world.get_resource::<Kinks>().map_or(u64::MAX, |kinks| kinks.after(to)),
        false => u64::MAX,
    };
    let mut clock = world.resource_mut::<Clock>();
    (clock.now, clock.stop) = (to, stop);
}

/// The cones in a step that is covered by parts.
struct Cover<'a> {
    cones: &'a mut ConeQuery,
    starts: &'a mut [StepStart],
    pair: &'a ButcherTableau,
    rule: Rule,
    /// Duration of the run (h).
    duration: f64,
    together: bool,
    /// Steps that cones may still try; none if they have tried too many.
    left: Option<u64>,
    /// Steps of cones taken so far.
    taken: u64,
    /// Errors of steps of one tick beyond the tolerance (µm).
    missed: Vec<f64>,
}

impl Cover<'_> {
    /// Brings all cones from the start of a span of ticks to its end: those whose steps are as long in one, the others in two parts.
    /// `is_fresh` tells that their first stage has not been evaluated yet.
    fn cover(&mut self, world: &mut World, span: (u64, u64), is_fresh: bool) {
        let (from, to) = span;
        let is_due = |cone: &GrowthCone, stages: &Stages| cone.birth.max(stages.reached) < to;
        if is_fresh {
            if self.call_up(world, is_due) == 0 {
                return;
            }
            run_stages(world, self.cones, self.starts, span, (self.pair, 0..1));
        }
        let deepest = if self.together { self.deepest(world, is_due) } else { 0 };
        let whole = self.rule.whole;
        let takes_whole = |stages: &Stages| whole >> stages.level.max(deepest) >= to - from;
        let trying = self.call_up(world, |cone, stages| is_due(cone, stages) && takes_whole(stages));
        if trying > 0 {
            self.left = self.left.and_then(|left| left.checked_sub(trying));
            if !is_fresh {
                let begin = world.resource::<Clock>().grid.hours(from);
                bring_tissue_to(world, begin);
                each_growing(world, self.cones, self.starts, span, start_again);
            }
            run_stages(world, self.cones, self.starts, span, (self.pair, 1..self.pair.stages()));
            self.judge(world, span, deepest);
            let pair = self.pair;
            each_growing(world, self.cones, self.starts, span, |step, mover| {
                finish(step, mover, pair);
                // A cone that was lost goes no further.
                mover.start.stages().reached = if mover.start.fault().is_some() { u64::MAX } else { to };
            });
        }
        if self.left.is_some() && self.take_back(world, is_due) > 0 {
            let half = shorter(to - from);
            let middle = from + half - from % half;
            self.cover(world, (from, middle), false);
            self.cover(world, (middle, to), true);
        }
    }

    /// Lets those growing cones act that `wanted` names, and has the others wait. Returns how many act.
    fn call_up(&mut self, world: &mut World, wanted: impl Fn(&GrowthCone, &Stages) -> bool) -> u64 {
        let mut count = 0;
        for ((cone, mut status, ..), start) in self.cones.iter_mut(world).zip(&mut *self.starts) {
            if status.grows() {
                let acts = wanted(cone, start.stages());
                count += u64::from(acts);
                status.set_if_neq(if acts { Status::Growing } else { Status::Waiting });
            }
        }
        count
    }

    /// Takes those growing cones that `wanted` names back to where their first stage was evaluated. Returns how many.
    fn take_back(&mut self, world: &mut World, wanted: impl Fn(&GrowthCone, &Stages) -> bool) -> u64 {
        let mut count = 0;
        for ((cone, status, mut site, _, _, mut spring, _), start) in self.cones.iter_mut(world).zip(&mut *self.starts)
        {
            if status.grows() && wanted(cone, start.stages()) {
                let (place, state) = start.taken_back();
                (*site, *spring) = (place, state.into());
                count += 1;
            }
        }
        count
    }

    /// The most halvings that one of the growing cones takes that `wanted` names.
    fn deepest(&mut self, world: &World, wanted: impl Fn(&GrowthCone, &Stages) -> bool) -> u8 {
        let growing = self.cones.iter(world).zip(&mut *self.starts);
        let levels = growing.filter_map(|((cone, status, ..), start)| {
            let stages = start.stages();
            (status.grows() && wanted(cone, stages)).then_some(stages.level)
        });
        levels.max().unwrap_or(0)
    }

    /// Has those growing cones wait whose error is too large, and sets how long a step each takes next. An error that is no number
    /// stands: the state it belongs to ends the run.
    fn judge(&mut self, world: &mut World, span: (u64, u64), deepest: u8) {
        let (pair, duration) = (self.pair, self.duration);
        each_growing(world, self.cones, self.starts, span, |step, mover| {
            let (place, vector) = difference(step, mover, pair);
            let radius = mover.cone.speed * duration.min(1.0 / step.growth.turning_rate);
            mover.start.stages().error = place.norm() + radius * vector.norm();
        });
        let errors = self.cones.iter(world).zip(&mut *self.starts).filter(|(cone, _)| *cone.1 == Status::Growing);
        let worst = errors.map(|(_, start)| start.stages().error).fold(0.0, largest);
        let mut rejected = 0;
        for ((_, mut status, ..), start) in self.cones.iter_mut(world).zip(&mut *self.starts) {
            if *status != Status::Growing {
                continue;
            }
            let stages = start.stages();
            let (error, level) = match self.together {
                true => (worst, stages.level.max(deepest)),
                false => (stages.error, stages.level),
            };
            let stands = self.rule.stands(span, error);
            stages.level = self.rule.next_level(span, error, level);
            if stands {
                self.taken += 1;
                self.missed.extend((error > self.rule.tolerance && error.is_finite()).then_some(error));
            } else {
                rejected += 1;
                status.set_if_neq(Status::Waiting);
            }
        }
        world.resource_mut::<Counters>().rejected_steps += rejected;
    }
}

/// The larger of two errors; NaN if one of them is.
fn largest(worst: f64, error: f64) -> f64 {
    if worst.is_nan() || error <= worst { worst } else { error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_the_errors_that_stand_all_the_same_the_largest_is_noted() {
        let (mut steps, mut health) = (AdaptiveSteps::new(1e-3, 10.0), Health::default());
        steps.note_misses(&[], &mut health);
        assert!(health.notes().is_empty());
        steps.note_misses(&[2e-3, 5e-3], &mut health);
        steps.note_misses(&[3e-3], &mut health);
        assert_eq!(
            health.notes(),
            [
                "time: the tolerance was missed in 3 steps of one tick, by an error of up to 5.000e-3 um instead of 1.000e-3 um"
            ]
        );
    }

    #[test]
    fn the_clock_stops_at_the_next_kink_only_where_steps_are_adaptive() {
        use crate::model::clock::TimeGrid;
        let mut world = World::new();
        world.insert_resource(Clock::new(TimeGrid::new(1.0).unwrap(), 1 << 40));
        let mut kinks = Kinks::default();
        kinks.add(12345);
        world.insert_resource(kinks);
        reach(&mut world, 100);
        assert_eq!((world.resource::<Clock>().now, world.resource::<Clock>().stop), (100, u64::MAX));
        world.insert_resource(AdaptiveSteps::new(1e-3, 10.0));
        reach(&mut world, 101);
        assert_eq!(world.resource::<Clock>().stop, 12345);
        reach(&mut world, 12345);
        assert_eq!(world.resource::<Clock>().stop, u64::MAX);
    }
}
