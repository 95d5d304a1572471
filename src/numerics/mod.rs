//! The mathematics: meshes, finite elements, turning law. Knows no ECS, no JSON, no files.

pub mod arrangement;
pub mod contact_integral;
mod cue_element;
pub mod delaunay;
pub mod hermite;
pub mod hyperelasticity;
pub mod imposed_motion;
mod lattice;
pub mod load_path;
pub mod locate;
pub mod material;
pub mod newton;
pub mod planar_domain;
pub mod polygon;
pub mod quadrature;
pub mod reaction_diffusion;
pub mod recovery;
pub mod runge_kutta;
pub mod segments;
pub mod simplex_mesh;
pub mod sparse;
pub mod triangulate;
pub mod turning;
mod vector;
pub mod walk;
