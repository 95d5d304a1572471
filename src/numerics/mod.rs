//! The mathematics: meshes, finite elements, turning law. Knows no ECS, no JSON, no files.

pub mod hermite;
pub mod hyperelasticity;
pub mod imposed_motion;
pub mod load_path;
pub mod material;
pub mod newton;
pub mod runge_kutta;
pub mod simplex_mesh;
pub mod sparse;
pub mod turning;
