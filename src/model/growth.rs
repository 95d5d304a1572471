//! How growth cones grow in a scene: the constants of eq. (1), the populations, the targets.

use crate::numerics::runge_kutta::{BOGACKI_SHAMPINE, EULER, HEUN, RK4};
use bevy_ecs::prelude::Resource;
use std::sync::Arc;

/// The integration method of eq. (1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Exact flow of the turning law for the pull at the midpoint; second order, unconditionally stable.
    #[default]
    Rotation,
    /// Explicit Euler on (X, v_g); first order, stable for κΔt < 2.
    Euler,
    /// Heun's method; second order, stable for κΔt < 2.
    Heun,
    /// The classical Runge–Kutta method; fourth order, stable for κΔt < 2.785.
    Rk4,
    /// The embedded pair of Bogacki and Shampine in steps that a tolerance chooses; third order, stable for κΔt < 2.512.
    BogackiShampine,
}

impl Method {
    /// Evaluations of the right-hand side in a step.
    pub fn stages(self) -> usize {
        match self {
            Self::Rotation => 1,
            Self::Euler => EULER.stages(),
            Self::Heun => HEUN.stages(),
            Self::Rk4 => RK4.stages(),
            Self::BogackiShampine => BOGACKI_SHAMPINE.stages(),
        }
    }

    /// The largest κΔt|L̂| for which the method damps what the turning law damps; none for a method that always does.
    pub fn stability_limit(self) -> Option<f64> {
        match self {
            Self::Rotation => None,
            Self::Euler | Self::Heun => Some(2.0),
            Self::Rk4 => Some(2.785),
            Self::BogackiShampine => Some(2.512),
        }
    }
}

/// What a step that would leave the tissue does, decided at the crossing point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnBorder {
    /// The rest of the step slides along the border; the heading stays.
    #[default]
    Slide,
    /// The cone stops there for good.
    Stall,
    /// The cone is gone.
    Leave,
}

/// Constants of eq. (1) and choices that hold for all cones.
#[derive(Debug, Clone, Copy, PartialEq, Resource)]
pub struct Growth {
    /// Turning rate κ = ω² l₀ / (2 v_g) (1/h).
    pub turning_rate: f64,
    /// Natural length l₀ of the spring: that of a filopodium (µm).
    pub filopodium_length: f64,
    /// Time scale δt of turning: the life of a filopodium (h).
    pub filopodia_time: f64,
    /// Whether the rotation of F turns headings as it turns shafts.
    pub heading_spins: bool,
    /// What happens at the border.
    pub on_border: OnBorder,
    /// The integration method.
    pub method: Method,
    /// Whether the scene is planar: one tangent direction for a heading instead of two.
    pub planar: bool,
}

/// One population of axons.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    /// Its name in the scenario.
    pub name: String,
    /// Nominal speed v_g (µm/h).
    pub speed: f64,
    /// How many axons it has.
    pub count: usize,
}

/// The populations of a scene, in the order of the scenario.
#[derive(Debug, Clone, PartialEq, Default, Resource)]
pub struct Populations(pub Vec<Population>);

/// The targets: cells in which a cone has arrived.
#[derive(Debug, Clone, PartialEq, Default, Resource)]
pub struct Targets {
    /// For each cell of the mesh, whether it lies in a target; empty without targets.
    pub cells: Arc<[bool]>,
}

impl Targets {
    /// Whether a cell lies in a target.
    #[inline]
    pub fn contains(&self, cell: u32) -> bool {
        self.cells.get(cell as usize).copied().unwrap_or(false)
    }
}

/// Population index of each shaft, in the order of the shafts.
#[derive(Debug, Clone, PartialEq, Eq, Default, Resource)]
pub struct ShaftPopulations(pub Vec<u16>);
