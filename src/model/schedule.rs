//! The order of a step, declared once. It reads like the paper.

use super::stopwatch::lap;
use bevy_ecs::prelude::{IntoScheduleConfigs, Resource, Schedule, SystemSet, World};
use bevy_ecs::schedule::{LogLevel, ScheduleBuildSettings, ScheduleLabel, SingleThreadedExecutor};

/// The phases of one step Δt.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Phase {
    /// Axons on the boundary, each at its birth time.
    Birth,
    /// Shafts indexed for homophilic contact.
    Neighbours,
    /// Eq. (1): brings tissue and fields to each stage's time and runs the right-hand side; alone moves cones.
    Advance,
    /// Shafts lengthen; arrivals, exits; a non-finite state ends the run.
    Settle,
    /// Mechanisms that change what is laid: retraction, branching, zippering (empty in the paper's scenes). The recorder
    /// looks after the step; nothing changes then.
    Remodel,
}

/// What brings the tissue to an instant, run whenever the stage time changes.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Motion {
    /// Eq. (3): −∇·P = 0, U = Û on Γ_D; configuration φ(·, t) and v_φ.
    Matrix,
}

/// The terms of the right-hand side, run once a stage.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Term {
    /// Eq. (2): −DΔc + kc = Σ q 1_A in Ω_M(t), brought to the stage's time; cached while unchanged.
    Fields,
    /// What cones give off (empty in the paper's scenes).
    Release,
    /// Receptor weights λ_i(t).
    Weigh,
    /// Cues: L̂ += clip₁(Σ λ_i s_i).
    Sample,
    /// v_φ into Velocity, spin of the tissue; the site already rides the tissue.
    Carry,
    /// Contact with other axons, and borders.
    Contact,
    /// Everything else that turns the heading: noise, stiffness.
    Turn,
}

/// Place of a mechanism inside a phase or term: the roster's order is the order of summation.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Slot {
    /// The n-th mechanism of a phase.
    Phase(Phase, u32),
    /// The n-th mechanism of the tissue's motion.
    Motion(u32),
    /// The n-th mechanism of a term.
    Term(Term, u32),
}

/// Label of the step.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash)]
struct StepLabel;
/// Label of the motion.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash)]
struct MotionLabel;
/// Label of the right-hand side.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash)]
struct StageLabel;

/// The schedule that brings the tissue to the stage's time.
#[derive(Resource)]
pub struct MotionSchedule {
    /// What moves the tissue.
    pub schedule: Schedule,
    /// Whether any of it is not known to turn no cell over.
    pub cells_may_turn_over: bool,
}

/// The schedule of one stage.
#[derive(Resource)]
pub struct RightHandSide(pub Schedule);

/// The three schedules of a run.
pub struct Schedules {
    /// One step Δt.
    pub step: Schedule,
    /// The tissue's motion.
    pub motion: Schedule,
    /// See [`MotionSchedule`].
    pub cells_may_turn_over: bool,
    /// One stage.
    pub right_hand_side: Schedule,
}

impl Schedules {
    /// Empty schedules with the phases and terms in their order.
    pub fn new() -> Self {
        let mut step = strict(StepLabel);
        step.configure_sets((Phase::Birth, Phase::Neighbours, Phase::Advance, Phase::Settle, Phase::Remodel).chain());
        for (phase, next, name) in [
            (Phase::Birth, Some(Phase::Neighbours), "birth"),
            (Phase::Neighbours, Some(Phase::Advance), "neighbours"),
            (Phase::Advance, Some(Phase::Settle), "integrate"),
            (Phase::Settle, Some(Phase::Remodel), "settle"),
            (Phase::Remodel, None, "remodel"),
        ] {
            let after = lap(name).after(phase);
            match next {
                Some(next) => step.add_systems(after.before(next)),
                None => step.add_systems(after),
            };
        }
        let mut right_hand_side = strict(StageLabel);
        right_hand_side.configure_sets(
            (Term::Fields, Term::Release, Term::Weigh, Term::Sample, Term::Carry, Term::Contact, Term::Turn).chain(),
        );
        for (term, next, name) in [
            (Term::Fields, Some(Term::Release), "cue fields"),
            (Term::Sample, Some(Term::Carry), "sample"),
            (Term::Carry, Some(Term::Contact), "carry"),
            (Term::Contact, Some(Term::Turn), "contact"),
            (Term::Turn, None, "turn"),
        ] {
            let after = lap(name).after(term);
            match next {
                Some(next) => right_hand_side.add_systems(after.before(next)),
                None => right_hand_side.add_systems(after),
            };
        }
        Self { step, motion: strict(MotionLabel), cells_may_turn_over: false, right_hand_side }
    }

    /// Builds the schedules and checks that no two systems conflict without an order.
    ///
    /// # Errors
    /// The library's account of the conflict.
    pub fn initialize(&mut self, world: &mut World) -> Result<(), String> {
        for schedule in [&mut self.step, &mut self.motion, &mut self.right_hand_side] {
            schedule.initialize(world).map_err(|error| format!("{error:?}"))?;
        }
        Ok(())
    }
}

impl Default for Schedules {
    fn default() -> Self {
        Self::new()
    }
}

/// A schedule on one thread in which an unordered conflict is an error.
fn strict(label: impl ScheduleLabel) -> Schedule {
    let mut schedule = Schedule::new(label);
    schedule.set_executor(SingleThreadedExecutor::new());
    schedule.set_build_settings(ScheduleBuildSettings {
        ambiguity_detection: LogLevel::Error,
        ..ScheduleBuildSettings::default()
    });
    schedule
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::prelude::{Res, ResMut};

    #[derive(Resource, Default)]
    struct Sum(f64);

    fn add_a_third(mut sum: ResMut<Sum>) {
        sum.0 += 1.0 / 3.0;
    }

    fn double(mut sum: ResMut<Sum>) {
        sum.0 *= 2.0;
    }

    fn look(sum: Res<Sum>) {
        assert!(sum.0.is_finite());
    }

    fn refusal(add: impl FnOnce(&mut Schedules)) -> Option<String> {
        let mut schedules = Schedules::new();
        let mut world = World::new();
        world.init_resource::<Sum>();
        add(&mut schedules);
        schedules.initialize(&mut world).err()
    }

    /// So whatever order the library takes where none is given, the bits are the same: systems without an order share nothing that one of
    /// them writes.
    #[test]
    fn systems_whose_order_could_change_a_bit_are_refused_without_one_in_every_schedule() {
        let both = || (add_a_third, double);
        assert!(refusal(|all| _ = all.step.add_systems(both().in_set(Phase::Remodel))).is_some());
        assert!(refusal(|all| _ = all.motion.add_systems(both().in_set(Motion::Matrix))).is_some());
        assert!(refusal(|all| _ = all.right_hand_side.add_systems(both().in_set(Term::Turn))).is_some());
        assert!(refusal(|all| _ = all.right_hand_side.add_systems((double, look).in_set(Term::Turn))).is_some());
    }

    #[test]
    fn systems_with_an_order_or_with_nothing_in_common_are_taken() {
        assert_eq!(refusal(|all| _ = all.step.add_systems((add_a_third, double).chain().in_set(Phase::Remodel))), None);
        let apart = |all: &mut Schedules| {
            all.right_hand_side.add_systems((double.in_set(Term::Sample), look.in_set(Term::Turn)));
        };
        assert_eq!(refusal(apart), None);
        assert_eq!(refusal(|all| _ = all.step.add_systems((look, || ()).in_set(Phase::Remodel))), None);
    }
}
