//! What went wrong while running, and what was done how often.

use crate::kept;
use bevy_ecs::prelude::Resource;
use serde::Serialize;
use std::fmt;

/// A fault that ends the run at this step: what, where, how much.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// Time (h).
    pub time: f64,
    /// The account, with place and amounts.
    pub account: String,
}

kept! { struct Fault { time, account } }

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at t = {} h: {}", self.time, self.account)
    }
}

/// Systems report faults here; the run stops at that step and keeps what it has.
#[derive(Debug, Clone, Default, Resource)]
pub struct Health {
    fault: Option<Fault>,
    notes: Vec<String>,
}

kept! { struct Health { fault, notes } }

impl Health {
    /// Reports a fault at time (h). The first one of a step is kept.
    pub fn report(&mut self, time: f64, account: impl Into<String>) {
        if self.fault.is_none() {
            self.fault = Some(Fault { time, account: account.into() });
        }
    }

    /// The fault that ends the run, if any.
    pub fn fault(&self) -> Option<&Fault> {
        self.fault.as_ref()
    }

    /// Notes something the user should know of, once.
    pub fn note(&mut self, text: impl Into<String>) {
        let text = text.into();
        if !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }

    /// The same for a note that changes as the run goes on: it takes the place of the one that begins with the same words.
    pub fn restate(&mut self, beginning: &str, rest: impl fmt::Display) {
        let text = format!("{beginning}{rest}");
        match self.notes.iter_mut().find(|note| note.starts_with(beginning)) {
            Some(note) => *note = text,
            None => self.notes.push(text),
        }
    }

    /// The notes, in the order in which they were made.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// How often each costly thing was done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Resource, Serialize)]
pub struct Counters {
    /// Steps Δt in which something grew.
    pub steps: u64,
    /// Steps of single cones that an adaptive method tried and took back.
    pub rejected_steps: u64,
    /// Steps of growing cones.
    pub cone_steps: u64,
    /// Evaluations of the right-hand side.
    pub stages: u64,
    /// Linear solves for cue fields.
    pub cue_solves: u64,
    /// Factorisations for cue fields.
    pub cue_factorisations: u64,
    /// Equilibria found for the matrix.
    pub matrix_solves: u64,
    /// Newton iterations of the matrix.
    pub newton_iterations: u64,
    /// Queries of the neighbour index.
    pub neighbour_queries: u64,
    /// Segments in the neighbour index.
    pub indexed_segments: u64,
}

impl Counters {
    /// Whether no count is beyond what any run comes to, and a sum over runs holds.
    pub(super) fn may_be(&self) -> bool {
        const MOST: u64 = 1 << 53;
        // Taken apart without a rest, so that a new counter is looked at too.
        let Self {
            steps,
            rejected_steps,
            cone_steps,
            stages,
            cue_solves,
            cue_factorisations,
            matrix_solves,
            newton_iterations,
            neighbour_queries,
            indexed_segments,
        } = *self;
        let of_cones = [steps, rejected_steps, cone_steps, stages, neighbour_queries, indexed_segments];
        let of_fields = [cue_solves, cue_factorisations, matrix_solves, newton_iterations];
        of_cones.into_iter().chain(of_fields).all(|count| count <= MOST)
    }
}

kept! {
    struct Counters {
        steps, rejected_steps, cone_steps, stages, cue_solves, cue_factorisations, matrix_solves, newton_iterations,
        neighbour_queries, indexed_segments,
    }
}
