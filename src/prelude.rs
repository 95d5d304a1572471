//! Everything a mechanism author needs: `use tropism::prelude::*;`.

pub use schemars;
pub use serde;
pub use serde_json;

pub use crate::model::quantity::{
    Angle, AngularSpeed, Area, Concentration, ConcentrationGradient, Diffusivity, ElectricField, Factor, Gradient,
    Kind, Length, Pressure, Quantity, Rate, ReleaseRate, Speed, StiffnessGradient, Time,
};
pub use crate::model::shape::{Point, Shape};
pub use crate::model::violation::{Violation, Violations};
pub use crate::{keys, quantity};
