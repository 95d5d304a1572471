//! The mathematics: meshes, finite elements, turning law. Knows no ECS, no JSON, no files.

pub mod arrangement;
pub mod planar_domain;
pub mod simplex_mesh;
pub mod sparse;
pub mod triangulate;
