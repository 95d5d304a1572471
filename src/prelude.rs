//! Everything a mechanism author needs: `use tropism::prelude::*;`.

// Derive macros name these crates, and find them here.
pub use bevy_ecs;
pub use schemars;
pub use serde;
pub use serde_json;

pub use bevy_ecs::prelude::{Component, IntoScheduleConfigs, Query, Res, ResMut, Resource, With, World};
pub use bevy_ecs::system::SystemParam;
pub use nalgebra::{Rotation3, Vector3};
pub use schemars::JsonSchema;
pub use serde::{Deserialize, Serialize};

pub use crate::model::brownian::{BrownianTree, HeadingPaths};
pub use crate::model::clock::{Clock, Kinks, StageTime};
pub use crate::model::components::{
    GrowthCone, Journey, Position, ReceptorWeights, Site, Spring, SpringState, Status, Velocity,
};
pub use crate::model::cones::{Cone, Cones, ConesWith};
pub use crate::model::configuration::Configuration;
pub use crate::model::growth::{Growth, Population, Populations, ShaftPopulations, Targets};
pub use crate::model::health::{Counters, Health};
pub use crate::model::keep::{Damage, Keep, KeptBytes};
pub use crate::model::material_law::{MaterialChoice, MaterialLaw, Materials};
pub use crate::model::mechanism::{Demands, Facts, InstallError, Law, Mechanism, ModelBuilder, Roster, unknown_name};
pub use crate::model::mesh_extent::MeshExtent;
pub use crate::model::plan::{Each, Plan, Work};
pub use crate::model::quantity::{
    Angle, AngularSpeed, Area, Concentration, ConcentrationGradient, Diffusivity, Drag, ElectricField,
    ElongationalViscosity, Factor, Force, Gradient, Kind, Length, Pressure, Quantity, Rate, ReleaseRate, Speed,
    StiffnessGradient, Time,
};
// What `quantity!` writes names these.
#[doc(hidden)]
pub use crate::model::quantity::{deserialize_quantity, quantity_schema, serialize_quantity};
pub use crate::model::random::{KeyedRng, Stream};
pub use crate::model::remodel::{Place, Remodelling, Standing};
pub use crate::model::schedule::{Phase, Term};
pub use crate::model::shafts::{ShaftPoint, Shafts, Successor, VertexId};
pub use crate::model::shape::{Point, Shape};
pub use crate::model::shelf::Shelf;
pub use crate::model::tissue::Tissue;
pub use crate::model::violation::{Violation, Violations};
pub use crate::numerics::law_check::{LawDefects, law_defects};
pub use crate::numerics::material::{Lame, Material, Tensor};
pub use crate::systems::cue_fields::{CueFields, CueSample};
pub use crate::{kept, keys, quantity};
