//! Axons as entities.
//!
//! An axon is the entity of its growth cone, its tip; what the tip leaves behind stands in [`Shafts`](super::shafts::Shafts) under the
//! place of the cone. A branch is such an entity too. All growth cones live in one archetype in order of their axon, from the start of
//! the run to its end: none is added, removed or given other components while it runs, so that the storage stays
//! contiguous and the order of iteration is the same always.
//!
//! There are millions of them, and a step passes over all several times: vectors are stored in the plane, two numbers each. Mechanisms
//! see them in space, with a third one that is exactly 0 ([`Cone`](super::cones::Cone), [`Spring`]).

use super::clock::TimeGrid;
use super::tissue::lift;
use crate::kept;
use crate::numerics::locate::MaterialPoint;
use bevy_ecs::prelude::Component;
use nalgebra::{Vector2, Vector3};
use std::sync::Arc;

/// The tip of an axon.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct GrowthCone {
    /// Number of the axon it belongs to, which keys its random draws.
    pub axon: u32,
    /// Index of its population.
    pub population: u16,
    /// Nominal speed v_g (µm/h).
    pub speed: f64,
    /// Instant of birth, in ticks of the [clock](super::clock); [`NEVER`](Self::NEVER) for a cone that waits for a branch.
    pub birth: u64,
}

kept! { struct GrowthCone { axon, population, speed, birth } }

impl GrowthCone {
    /// Instant of birth of a cone that waits for a branch.
    pub const NEVER: u64 = u64::MAX;

    /// Time of birth (h); 0 for a cone that waits for a branch.
    pub fn birth_time(&self, grid: &TimeGrid) -> f64 {
        if self.birth == Self::NEVER { 0.0 } else { grid.hours(self.birth) }
    }
}

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
/// integrated; the [`Position`] follows from it. Before birth: where it will be born.
#[derive(Debug, Clone, Copy, PartialEq, Default, Component)]
pub struct Site {
    /// The cell.
    pub cell: u32,
    /// Weights of the cell's vertices 1 and 2; vertex 0 has the rest.
    pub weights: [f64; 2],
}

kept! { struct Site { cell, weights } }

impl Site {
    /// Whether it names one of so many cells, at finite weights.
    pub fn is_in(self, cells: usize) -> bool {
        (self.cell as usize) < cells && self.weights.iter().all(|weight| weight.is_finite())
    }

    /// The point of a planar mesh.
    pub fn planar(self) -> MaterialPoint<2> {
        MaterialPoint { cell: self.cell, weights: self.weights }
    }
}

impl From<MaterialPoint<2>> for Site {
    fn from(point: MaterialPoint<2>) -> Self {
        Self { cell: point.cell, weights: point.weights }
    }
}

/// Position x = φ(X, t) (µm).
#[derive(Debug, Clone, Copy, PartialEq, Default, Component)]
pub struct Position(pub Vector2<f64>);

kept! { wrapper Position }

impl Position {
    /// In space.
    #[inline]
    pub fn in_space(&self) -> Vector3<f64> {
        lift(self.0.into())
    }
}

/// Velocity Ẋ_d = v_g + v_φ, eq. (1) (µm/h), as of the last step in which the cone grew.
#[derive(Debug, Clone, Copy, PartialEq, Default, Component)]
pub struct Velocity {
    /// v_g, along the heading.
    pub growth: Vector2<f64>,
    /// v_φ, the velocity of the tissue at the cone. Reported only: the site already rides the tissue.
    pub tissue: Vector2<f64>,
}

kept! { struct Velocity { growth, tissue } }

/// The [`Spring`] of a growth cone as it is stored. Before birth its heading is the one the cone will be born with, if that is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct SpringState {
    heading: Vector2<f64>,
    drift: f64,
    pull: Vector2<f64>,
    speed_factor: f64,
    heading_diffusion: f64,
    spin: f64,
}

kept! { struct SpringState { heading, drift, pull, speed_factor, heading_diffusion, spin } }

impl Default for SpringState {
    fn default() -> Self {
        Spring::default().into()
    }
}

impl SpringState {
    /// The spring in space.
    #[inline]
    pub fn seen(&self) -> Spring {
        Spring {
            heading: lift(self.heading.into()),
            drift: self.drift,
            pull: lift(self.pull.into()),
            speed_factor: self.speed_factor,
            heading_diffusion: self.heading_diffusion,
            spin: Vector3::new(0.0, 0.0, self.spin),
        }
    }

    /// Unit heading e_g.
    #[inline]
    pub fn heading(&self) -> Vector2<f64> {
        self.heading
    }

    /// Lets `act` change the spring as it is seen.
    #[inline]
    pub fn change<T>(&mut self, act: impl FnOnce(&mut Spring) -> T) -> T {
        let mut seen = self.seen();
        let result = act(&mut seen);
        *self = seen.into();
        result
    }
}

impl From<Spring> for SpringState {
    #[inline]
    fn from(seen: Spring) -> Self {
        Self {
            heading: seen.heading.xy(),
            drift: seen.drift,
            pull: seen.pull.xy(),
            speed_factor: seen.speed_factor,
            heading_diffusion: seen.heading_diffusion,
            spin: seen.spin.z,
        }
    }
}

/// The lumped spring of the filopodia, eq. (1): where the cone heads, and what pulls it. What lies out of the plane, of a planar scene,
/// is dropped when it is stored: the third number of headings and pulls, the first two of spins.
///
/// Mechanisms add to `pull`, `heading_diffusion` and `spin` and multiply `speed_factor`; the integrator clears the four before
/// each stage and alone changes the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
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

impl Default for Spring {
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

impl Spring {
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

/// Receptor weights λ_i(t), one for each receptor of the cone's population, in the order of the scenario (dimensionless). Cones whose
/// weights never change share them.
#[derive(Debug, Clone, PartialEq, Default, Component)]
pub struct ReceptorWeights(pub Arc<[f64]>);

kept! { wrapper ReceptorWeights }

/// How far a cone had come when it stopped growing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Component)]
pub struct Journey {
    /// Unit heading at birth.
    pub first_heading: [f64; 2],
    /// Time at which it arrived, stalled or left (h); NaN-free: equals the birth time until then.
    pub ended: f64,
    /// Length grown, ∫|v_g| dt (µm).
    pub length: f64,
    /// Largest |v_g| over nominal, minus 1, seen so far.
    pub worst_drift: f64,
}

kept! { struct Journey { first_heading, ended, length, worst_drift } }
