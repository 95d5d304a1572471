//! The hall: puts a scenario and a roster together, and runs the result step by step.
//!
//! It knows no mechanism by name. What a scene does not need is not built: no matrix without motion, no field that nobody
//! reads, no index without contact.

mod assemble;
mod populate;

pub use assemble::AssemblyError;
pub use populate::BYTES_A_CONE;

use crate::model::adaptive::reach;
use crate::model::births::BirthQueue;
use crate::model::clock::{Clock, StageTime};
use crate::model::components::{GrowthCone, Status};
use crate::model::configuration::Configuration;
use crate::model::health::{Counters, Fault, Health};
use crate::model::integrator::{bring_tissue_to, evaluate_right_hand_side};
use crate::model::keep::Damage;
use crate::model::kept::KeptState;
use crate::model::mechanism::Roster;
use crate::model::remodel::Unrest;
use crate::model::shelf::Shelf;
use crate::model::stopwatch::Stopwatch;
use crate::scenario::load::Loaded;
use bevy_ecs::prelude::{Schedule, With, World};

/// A scene that runs.
pub struct Simulation {
    world: World,
    step: Schedule,
}

impl Simulation {
    /// Builds a scene: mesh, tissue, fields, cones, systems. Solves what must be solved before the first step.
    ///
    /// # Errors
    /// What the scenario has wrong, by JSON pointer; a solve that failed, with place and amount.
    pub fn assemble(loaded: &Loaded, roster: &Roster) -> Result<Self, AssemblyError> {
        Self::assemble_from(loaded, roster, &Shelf::default())
    }

    /// As [`Self::assemble`], but what stands on the shelf is not made again, and what is made is put there.
    ///
    /// # Errors
    /// As [`Self::assemble`].
    pub fn assemble_from(loaded: &Loaded, roster: &Roster, shelf: &Shelf) -> Result<Self, AssemblyError> {
        assemble::assemble(loaded, roster, shelf)
    }

    /// The world, to read from.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Time reached (h).
    pub fn time(&self) -> f64 {
        self.world.resource::<Clock>().hours()
    }

    /// Whether the end is reached.
    pub fn is_over(&self) -> bool {
        self.world.resource::<Clock>().is_over()
    }

    /// Share of the run that is done, in [0, 1].
    pub fn progress(&self) -> f64 {
        let clock = self.world.resource::<Clock>();
        clock.now as f64 / clock.end.max(1) as f64
    }

    /// Books the time since the last lap on a phase.
    pub fn lap(&mut self, phase: &'static str) {
        self.world.resource_mut::<Stopwatch>().lap(phase);
    }

    /// Counts of what was done.
    pub fn counters(&self) -> Counters {
        *self.world.resource::<Counters>()
    }

    /// One step Δt. A step in which no cone grows and none is born only moves the clock.
    ///
    /// # Errors
    /// The fault that ends the run; the state is that of the step's end.
    pub fn step(&mut self) -> Result<(), Fault> {
        let clock = *self.world.resource::<Clock>();
        let to = clock.now + clock.next_step();
        if self.is_idle(to) {
            reach(&mut self.world, to);
            return Ok(());
        }
        self.bring_tissue_here();
        self.world.resource_mut::<Unrest>().0 = false;
        self.step.run(&mut self.world);
        match self.world.resource::<Health>().fault() {
            Some(fault) => Err(fault.clone()),
            None => Ok(()),
        }
    }

    /// Writes down all state that the scene does not give: between two steps.
    pub fn keep(&self) -> Vec<u8> {
        self.world.resource::<KeptState>().write(&self.world)
    }

    /// Brings a simulation that has just been assembled to the state that [`Self::keep`] wrote down of the same scene. What follows is
    /// what would have followed then, bit for bit.
    ///
    /// # Errors
    /// The part that does not fit; the simulation is of no use then.
    pub fn restore(&mut self, kept: &[u8]) -> Result<(), Damage> {
        let state = self.world.resource::<KeptState>().clone();
        state.read(&mut self.world, kept)?;
        let stage = self.world.resource::<StageTime>().0;
        bring_tissue_to(&mut self.world, stage);
        self.lap("assembly");
        Ok(())
    }

    /// Brings the tissue to the time reached, which idle steps leave behind.
    pub fn bring_tissue_here(&mut self) {
        let time = self.time();
        if self.world.resource::<Configuration>().moves && self.world.resource::<Configuration>().time != time {
            bring_tissue_to(&mut self.world, time);
        }
    }

    /// Brings the tissue and what rides on it to any time (h), without a step: for a look at a moment.
    pub fn look_at(&mut self, time: f64) {
        bring_tissue_to(&mut self.world, time);
    }

    /// Brings tissue and fields to any time (h) and evaluates the right-hand side there, for those who look at fields without a step.
    /// Growing cones lose the pull that they felt last.
    pub fn evaluate_at(&mut self, time: f64) {
        bring_tissue_to(&mut self.world, time);
        evaluate_right_hand_side(&mut self.world);
    }

    fn is_idle(&mut self, to: u64) -> bool {
        let next = self.world.resource::<BirthQueue>().waiting().last();
        let none_due = next.is_none_or(|birth| birth.instant >= to);
        let mut cones = self.world.query_filtered::<&Status, With<GrowthCone>>();
        let calm = !self.world.resource::<Unrest>().0;
        none_due && calm && !cones.iter(&self.world).any(|status| *status == Status::Growing)
    }
}
