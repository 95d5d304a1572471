//! Pilots along one knob, from coarse to fine, and how wrong each of them is.

use super::difference;
use crate::model::growth::Growth;
use crate::model::health::Counters;
use crate::study::estimate::seconds::Rates;
use crate::study::laboratory::ConeView;
use bevy_ecs::prelude::World;

/// What a pilot run left.
pub struct Pilot {
    pub tips: Vec<ConeView>,
    pub cost: Cost,
    /// Whether the tissue moves.
    pub moves: bool,
}

/// What the time of a run is reckoned from.
#[derive(Clone, Copy, Default)]
pub struct Cost {
    pub rates: Rates,
    steps: f64,
    stages: f64,
    cone_stages: f64,
}

impl Cost {
    /// Of a run that came to its end.
    pub fn of(world: &World) -> Self {
        let counters = world.resource::<Counters>();
        let stages = world.resource::<Growth>().method.stages() as f64;
        Self {
            rates: Rates::of(world),
            steps: counters.steps as f64,
            stages: counters.stages as f64,
            cone_stages: stages * counters.cone_steps as f64,
        }
    }

    /// Time (ns) of a run with these steps, on the mesh of another, in which a cone takes `cone` ns at a stage.
    pub fn on(&self, mesh: &Rates, cone: f64) -> f64 {
        mesh.run + mesh.newton + mesh.step * self.steps + mesh.stage * self.stages + cone * self.cone_stages
    }
}

impl Pilot {
    /// Time (ns) that it took, as reckoned.
    pub fn time(&self) -> f64 {
        self.cost.on(&self.cost.rates, self.cost.rates.cone_stage)
    }
}

/// Values refined from place to place.
pub struct Sequence {
    pub values: Vec<f64>,
    pub errors: Vec<f64>,
    pub costs: Vec<Cost>,
    /// The coarsest place that ends the sequence well, or the best there is.
    pub settled: usize,
    /// Bound of the finest's own error.
    pub tail: f64,
}

impl Sequence {
    /// A value that the scene gives.
    pub fn fixed(value: f64) -> Self {
        Self { values: vec![value], errors: vec![0.0], costs: vec![Cost::default()], settled: 0, tail: 0.0 }
    }

    /// Of the pilots at some values; ended well if the last error but that of the finest is within the goal.
    pub fn of(values: Vec<f64>, pilots: &[Pilot], goal: f64) -> Self {
        let mut errors = errors(pilots);
        let (tail, last) = (errors.pop().unwrap_or(0.0), errors.len().saturating_sub(1));
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let good = if errors.last().is_some_and(|error| *error <= goal) { goal } else { 1.5 * least };
        let settled = (0..=last).rev().take_while(|&k| errors[k] <= good).last().unwrap_or(last);
        let costs = pilots.iter().map(|pilot| pilot.cost).collect();
        Self { values, errors, costs, settled, tail }
    }

    /// Places and values whose error is known by a finer one, or that the scene gives.
    pub fn judged(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.values.iter().copied().take(self.errors.len()).enumerate()
    }

    /// The last place.
    pub fn finest(&self) -> usize {
        self.values.len() - 1
    }
}

/// The error of each pilot by the finest of them; last that of the finest itself.
pub fn errors(pilots: &[Pilot]) -> Vec<f64> {
    let Some((finest, coarser)) = pilots.split_last() else { return Vec::new() };
    let tail = coarser.last().map_or(0.0, |last| difference(&last.tips, &finest.tips));
    coarser.iter().map(|pilot| difference(&pilot.tips, &finest.tips) + tail).chain([tail]).collect()
}
