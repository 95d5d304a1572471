//! Where the wall time of a run goes. It is reported beside the results and never enters them.

use super::keep::{Damage, Keep, KeptBytes};
use bevy_ecs::prelude::{ResMut, Resource};
use std::collections::BTreeMap;
use std::time::Instant;

/// Seconds by phase.
#[derive(Debug, Clone, Resource)]
pub struct Stopwatch {
    last: Instant,
    seconds: BTreeMap<&'static str, f64>,
    /// What was booked before the run was resumed, on phases that have not come again yet.
    before: BTreeMap<String, f64>,
}

impl Default for Stopwatch {
    fn default() -> Self {
        Self { last: Instant::now(), seconds: BTreeMap::new(), before: BTreeMap::new() }
    }
}

impl Stopwatch {
    /// Books the time since the last lap on a phase.
    pub fn lap(&mut self, phase: &'static str) {
        let now = Instant::now();
        let booked = self.seconds.entry(phase).or_insert_with(|| self.before.remove(phase).unwrap_or_default());
        *booked += (now - self.last).as_secs_f64();
        self.last = now;
    }

    /// Seconds booked on all phases together.
    pub fn total(&self) -> f64 {
        self.seconds.values().chain(self.before.values()).sum()
    }

    /// Seconds booked on each phase.
    pub fn seconds(&self) -> &BTreeMap<&'static str, f64> {
        &self.seconds
    }
}

impl Keep for Stopwatch {
    fn keep(&self, into: &mut Vec<u8>) {
        let mut seconds = self.before.clone();
        seconds.extend(self.seconds.iter().map(|(phase, seconds)| ((*phase).to_owned(), *seconds)));
        seconds.keep(into);
    }

    /// A watch that goes on from what was booked.
    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        Ok(Self { before: from.read()?, ..Self::default() })
    }
}

/// Seconds of wall time that have passed since this was made: for what is done now and then, and enters no result.
#[derive(Debug, Clone, Copy)]
pub struct Elapsed(Instant);

impl Default for Elapsed {
    fn default() -> Self {
        Self(Instant::now())
    }
}

impl Elapsed {
    /// The seconds.
    pub fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// A system that books the time since the last lap on a phase.
pub fn lap(phase: &'static str) -> impl FnMut(ResMut<Stopwatch>) {
    move |mut stopwatch| stopwatch.lap(phase)
}
