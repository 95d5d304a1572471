//! The mathematics: meshes, finite elements, turning law. Knows no ECS, no JSON, no files.

pub mod arrangement;
pub mod delaunay;
pub mod locate;
pub mod planar_domain;
pub mod quadrature;
pub mod reaction_diffusion;
pub mod recovery;
pub mod simplex_mesh;
pub mod sparse;
pub mod triangulate;
