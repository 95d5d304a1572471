//! Where the wall time of a run goes. It is reported beside the results and never enters them.

use bevy_ecs::prelude::{ResMut, Resource};
use std::collections::BTreeMap;
use std::time::Instant;

/// Seconds by phase.
#[derive(Debug, Clone, Resource)]
pub struct Stopwatch {
    last: Instant,
    seconds: BTreeMap<&'static str, f64>,
}

impl Default for Stopwatch {
    fn default() -> Self {
        Self { last: Instant::now(), seconds: BTreeMap::new() }
    }
}

impl Stopwatch {
    /// Books the time since the last lap on a phase.
    pub fn lap(&mut self, phase: &'static str) {
        let now = Instant::now();
        *self.seconds.entry(phase).or_default() += (now - self.last).as_secs_f64();
        self.last = now;
    }

    /// Seconds booked on all phases together.
    pub fn total(&self) -> f64 {
        self.seconds.values().sum()
    }

    /// Seconds booked on each phase.
    pub fn seconds(&self) -> &BTreeMap<&'static str, f64> {
        &self.seconds
    }
}

/// A system that books the time since the last lap on a phase.
pub fn lap(phase: &'static str) -> impl FnMut(ResMut<Stopwatch>) {
    move |mut stopwatch| stopwatch.lap(phase)
}
