//! What a scene needs and what it does not, told by those who decide it while the scene is put together; how near the chosen
//! steps and methods come to their limits; and what each part holds in memory and does how often.

use bevy_ecs::prelude::Resource;
use serde::Serialize;
use std::fmt;

/// A part of the program that the scene has work for, or not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// A mechanism, field, solve, index or output.
    pub name: String,
    /// Whether the scene has it.
    pub kept: bool,
    /// Why.
    pub why: String,
}

/// A quantity beside the limit up to which a method or a derivation holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    /// What is compared.
    pub name: String,
    /// Its value in this scene.
    pub value: f64,
    /// The largest value that is advised.
    pub limit: f64,
    /// Share of the limit beyond which little is left.
    pub thin_from: f64,
    /// What to do when it is too near.
    pub advice: String,
}

/// Beyond three quarters of a limit little is left; of one that sound scenes come near to, beyond the whole.
const THIN: f64 = 0.75;

impl Margin {
    /// Whether the limit is passed.
    pub fn is_passed(&self) -> bool {
        self.value > self.limit
    }

    /// Whether little of the limit is left.
    pub fn is_thin(&self) -> bool {
        self.value > self.thin_from * self.limit
    }
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, limit, advice, .. } = self;
        write!(f, "{name}: {value:.3}; {limit:.3} or less is advised ({advice})")
    }
}

/// A number that follows from the scene's keys.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Derived {
    /// What it is.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
}

impl fmt::Display for Derived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {:.2} {}", self.name, self.value, self.unit)
    }
}

/// What a part is needed for: its memory is held, or its work done, once for each of these.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Each {
    /// The run.
    Run,
    /// An axon with its growth cone.
    Axon,
    /// A stored vertex of a shaft.
    ShaftVertex,
    /// A step of the clock in which something grows.
    Step,
    /// A stage of the integrator: one a step, or as many as the method has.
    Stage,
    /// A growing cone at a stage.
    ConeStage,
}

/// Memory that is held to the end of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Holding {
    /// What holds it.
    pub name: String,
    /// Bytes.
    pub bytes: f64,
    /// For each of what.
    pub each: Each,
}

/// Kinds of work whose time for one unit is known; an estimate of seconds multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// An unknown in an iteration of Newton's method.
    NewtonUnknown,
    /// An unknown of a field at a load level: factor, field, gradient and their rates.
    FieldUnknown,
    /// An unknown of a field at a step of time: solution, and gradient where it is kept.
    SteppedUnknown,
    /// A number of a field interpolated between levels.
    Interpolated,
    /// A coordinate of a vertex moved along the load path, with its rate.
    Moved,
    /// A cell whose deformation is looked at.
    DeformedCell,
    /// A cell that is looked at for one that is turned over.
    WatchedCell,
    /// A gradient sampled and sensed.
    Sampled,
    /// A facet of a border looked at.
    BorderFacet,
    /// A cone that asks for shafts.
    Neighbourhood,
    /// A segment within reach of a cone if axons grew evenly spread.
    EvenSegment,
    /// A segment put into the neighbour index.
    Indexed,
}

/// Work that the scene means.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Who does it.
    pub name: String,
    /// What is done.
    pub work: Work,
    /// How often.
    pub amount: f64,
    /// For each of what.
    pub each: Each,
}

/// The plan of a scene.
#[derive(Debug, Clone, Default, PartialEq, Resource, Serialize)]
pub struct Plan {
    /// What is kept and what is left out.
    pub parts: Vec<Part>,
    /// How near the limits are.
    pub margins: Vec<Margin>,
    /// What follows from the keys of mechanisms.
    pub derived: Vec<Derived>,
    /// Memory that is held; the estimate of a plan adds it up.
    #[serde(skip)]
    pub holdings: Vec<Holding>,
    /// Work that is done; the estimate of a plan adds it up.
    #[serde(skip)]
    pub tasks: Vec<Task>,
    /// By how much larger the tissue is than at rest, in the mean over the run: area over area, minus 1.
    #[serde(skip)]
    pub swelling: f64,
    /// Bytes that all that is held to the end of the run may take, if that is bounded.
    #[serde(skip)]
    pub room: Option<f64>,
    /// Whether something besides cues leads cones to where targets may lie.
    #[serde(skip)]
    pub leads: bool,
    /// The strongest pull |L̂| that the scene's mechanisms can add up to.
    pub strongest_pull: f64,
}

impl Plan {
    /// Notes a part that the scene needs.
    pub fn keep(&mut self, name: impl Into<String>, why: impl Into<String>) {
        self.parts.push(Part { name: name.into(), kept: true, why: why.into() });
    }

    /// Notes a part that the scene has no use for.
    pub fn leave_out(&mut self, name: impl Into<String>, why: impl Into<String>) {
        self.parts.push(Part { name: name.into(), kept: false, why: why.into() });
    }

    /// Notes a quantity with its limit.
    pub fn compare(&mut self, name: impl Into<String>, value: f64, limit: f64, advice: impl Into<String>) {
        self.margins.push(Margin { name: name.into(), value, limit, thin_from: THIN, advice: advice.into() });
    }

    /// Notes a quantity that sound scenes bring near to its limit: only passing it counts.
    pub fn bound(&mut self, name: impl Into<String>, value: f64, limit: f64, advice: impl Into<String>) {
        self.margins.push(Margin { name: name.into(), value, limit, thin_from: 1.0, advice: advice.into() });
    }

    /// Notes a number that follows from the keys, with its unit.
    pub fn derive(&mut self, name: impl Into<String>, value: f64, unit: &'static str) {
        self.derived.push(Derived { name: name.into(), value, unit });
    }

    /// Notes memory that a part holds.
    pub fn hold(&mut self, name: impl Into<String>, bytes: f64, each: Each) {
        self.holdings.push(Holding { name: name.into(), bytes, each });
    }

    /// Bytes that are left for what is held to the end of the run; infinite if there is no bound.
    pub fn room_left(&self) -> f64 {
        let held = self.holdings.iter().filter(|held| held.each == Each::Run).map(|held| held.bytes);
        self.room.map_or(f64::INFINITY, |room| room - held.sum::<f64>())
    }

    /// Notes work that a part does.
    pub fn work(&mut self, name: impl Into<String>, work: Work, amount: f64, each: Each) {
        self.tasks.push(Task { name: name.into(), work, amount, each });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_is_thin_before_it_is_passed() {
        let margin = |value| Margin { name: "x".into(), value, limit: 2.0, thin_from: THIN, advice: "less".into() };
        let seen = [1.0, 1.6, 2.0, 2.1].map(|value| (margin(value).is_thin(), margin(value).is_passed()));
        assert_eq!(seen, [(false, false), (true, false), (true, false), (true, true)]);
        assert_eq!(margin(2.1).to_string(), "x: 2.100; 2.000 or less is advised (less)");
    }
}
