//! The mathematics: meshes, finite elements, turning law. Knows no ECS, no JSON, no files.

pub mod simplex_mesh;
pub mod sparse;
