//! **tropism** simulates how axons find their way.
//!
//! Growth cones at the tips of axons steer by gradients of diffusible cues and by contact with other axons, and are carried
//! along by the tissue, which itself deforms. The program is an entity-component-system simulation:
//!
//! - [`numerics`]: the mathematics: meshes, finite elements, Newton's method, the turning law.
//! - [`model`]: the vocabulary of the world: components, resources, the schedule, the integrator, the public seam.
//! - [`systems`]: one file a mechanism or provider; [`systems::standard`] is the only list of them.
//! - [`scenario`]: JSON in. [`record`]: results out.
//! - [`simulation`]: puts a scenario and a roster together and runs it.
//! - [`study`]: runs of runs.
//!
//! An author of a mechanism needs only the [`prelude`].

extern crate self as tropism;

mod cli;
pub mod model;
pub mod numerics;
pub mod prelude;
pub mod record;
pub mod scenario;
pub mod simulation;
pub mod study;
#[path = "../systems/mod.rs"]
pub mod systems;

pub use cli::run;
