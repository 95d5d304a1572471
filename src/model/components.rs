//! Axons and growth cones as entities.
//!
//! A growth cone is the tip of an axon. All growth cones live in one archetype in order of their axon, from the start of
//! the run to its end: none is added, removed or given other components while it runs, so that the storage stays
//! contiguous and the order of iteration is the same always.

use crate::kept;
use crate::numerics::locate::MaterialPoint;
use bevy_ecs::prelude::Component;
use nalgebra::Vector3;

/// An axon: where it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct Axon {
    /// Number of the axon, which keys its random draws.
    pub number: u32,
    /// Index of its population.
    pub population: u16,
    /// Instant of birth, in ticks of the [clock](super::clock).
    pub birth: u64,
}

/// The tip of an axon.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct GrowthCone {
    /// Number of the axon it belongs to.
    pub axon: u32,
    /// Index of its population.
    pub population: u16,
    /// Nominal speed v_g (µm/h).
    pub speed: f64,
    /// Instant of birth, in ticks.
    pub birth: u64,
    /// Time of birth (h).
    pub birth_time: f64,
}

kept! { struct GrowthCone { axon, population, speed, birth, birth_time } }

/// What a growth cone is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Component)]
pub enum Status {
    /// Not yet born.
    #[default]
    Unborn,
    /// Growing: the only state in which anything is computed for it.
    Growing,
    /// Stopped at the border (`on_border: stall`).
    Stalled,
    /// Inside its target.
    Arrived,
    /// Gone across the border (`on_border: leave`).
    Left,
    /// Drawing back along its shaft.
    Retracting,
    /// Drawn back to where it began, for good.
    Withdrawn,
    /// Growing, but not in the part of a step that is under way: seen only within steps of cones' own size.
    Waiting,
}

kept! { enum Status { Unborn, Growing, Stalled, Arrived, Left, Retracting, Withdrawn, Waiting } }

impl Status {
    /// Whether it grows, now or in another part of the step.
    pub fn grows(self) -> bool {
        matches!(self, Status::Growing | Status::Waiting)
    }

    /// The word used in results.
    pub fn word(self) -> &'static str {
        match self {
            Status::Unborn => "unborn",
            Status::Growing | Status::Waiting => "growing",
            Status::Stalled => "stalled",
            Status::Arrived => "arrived",
            Status::Left => "left",
            Status::Retracting => "retracting",
            Status::Withdrawn => "withdrawn",
        }
    }
}

/// Where a growth cone sits in the tissue: a cell of its mesh and barycentric weights. It is this material point that is
/// integrated; the [`Position`] follows from it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Component)]
pub struct Site {
    /// The cell.
    pub cell: u32,
    /// Weights of the cell's vertices 1, 2 (and 3 in space); vertex 0 has the rest.
    pub weights: [f64; 3],
}

kept! { struct Site { cell, weights } }

impl Site {
    /// Whether it names one of so many cells, at finite weights.
    pub fn is_in(self, cells: usize) -> bool {
        (self.cell as usize) < cells && self.weights.iter().all(|weight| weight.is_finite())
    }

    /// The point of a planar mesh.
    pub fn planar(self) -> MaterialPoint<2> {
        MaterialPoint { cell: self.cell, weights: [self.weights[0], self.weights[1]] }
    }
}

impl From<MaterialPoint<2>> for Site {
    fn from(point: MaterialPoint<2>) -> Self {
        Self { cell: point.cell, weights: [point.weights[0], point.weights[1], 0.0] }
    }
}

/// Position x = φ(X, t) (µm); z is exactly 0 in a planar scene.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct Position(pub Vector3<f64>);

kept! { wrapper Position }

impl Default for Position {
    fn default() -> Self {
        Self(Vector3::zeros())
    }
}

/// Velocity Ẋ_d = v_g + v_φ, eq. (1) (µm/h).
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct Velocity {
    /// v_g, along the heading.
    pub growth: Vector3<f64>,
    /// v_φ, the velocity of the tissue at the cone. Reported only: the site already rides the tissue.
    pub tissue: Vector3<f64>,
}

kept! { struct Velocity { growth, tissue } }

impl Default for Velocity {
    fn default() -> Self {
        Self { growth: Vector3::zeros(), tissue: Vector3::zeros() }
    }
}

/// The lumped spring of the filopodia, eq. (1): where the cone heads, and what pulls it.
///
/// Mechanisms add to `pull`, `heading_diffusion` and `spin` and multiply `speed_factor`; the integrator clears the four before
/// each stage and alone changes the rest.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct SpringState {
    /// Unit heading e_g.
    pub heading: Vector3<f64>,
    /// |v_g| over its nominal value: 1 for `rotation`, drifting for the explicit methods, which act on the vector v_g.
    pub drift: f64,
    /// Dimensionless pull L̂ = L₀/l₀ of this stage.
    pub pull: Vector3<f64>,
    /// Factor on the speed (1: none).
    pub speed_factor: f64,
    /// Heading diffusion D_θ (1/h).
    pub heading_diffusion: f64,
    /// Angular velocity that turns the heading besides the pull (1/h).
    pub spin: Vector3<f64>,
}

kept! { struct SpringState { heading, drift, pull, speed_factor, heading_diffusion, spin } }

impl Default for SpringState {
    fn default() -> Self {
        Self {
            heading: Vector3::zeros(),
            drift: 1.0,
            pull: Vector3::zeros(),
            speed_factor: 1.0,
            heading_diffusion: 0.0,
            spin: Vector3::zeros(),
        }
    }
}

impl SpringState {
    /// Clears what mechanisms add to, before a stage.
    pub fn clear(&mut self) {
        self.pull = Vector3::zeros();
        self.speed_factor = 1.0;
        self.heading_diffusion = 0.0;
        self.spin = Vector3::zeros();
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let sum = self.heading.sum() + self.pull.sum() + self.spin.sum();
        (sum + self.drift + self.speed_factor + self.heading_diffusion).is_finite()
    }
}

/// Receptor weights λ_i(t), one for each receptor of the cone's population, in the order of the scenario (dimensionless).
#[derive(Debug, Clone, PartialEq, Default, Component)]
pub struct ReceptorWeights(pub Box<[f64]>);

kept! { wrapper ReceptorWeights }

/// How far a cone had come when it stopped growing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Component)]
pub struct Journey {
    /// Unit heading at birth.
    pub first_heading: [f64; 3],
    /// Time at which it arrived, stalled or left (h); NaN-free: equals the birth time until then.
    pub ended: f64,
    /// Length grown, ∫|v_g| dt (µm).
    pub length: f64,
    /// Largest |v_g| over nominal, minus 1, seen so far.
    pub worst_drift: f64,
}

kept! { struct Journey { first_heading, ended, length, worst_drift } }
