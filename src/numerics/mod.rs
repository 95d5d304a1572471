//! The mathematics: meshes, finite elements, turning law. Knows no ECS, no JSON, no files.

pub mod arrangement;
mod cue_element;
pub mod delaunay;
mod lattice;
pub mod locate;
pub mod planar_domain;
pub mod polygon;
pub mod quadrature;
pub mod reaction_diffusion;
pub mod recovery;
pub mod simplex_mesh;
pub mod sparse;
pub mod triangulate;
mod vector;
pub mod walk;
