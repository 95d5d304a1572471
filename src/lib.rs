//! **tropism** simulates how axons find their way.
//!
//! Growth cones at the tips of axons steer by gradients of diffusible cues and by contact with other axons, and are carried
//! along by the tissue, which itself deforms. The program is an entity-component-system simulation:
//!
//! - `numerics`: the mathematics: meshes, finite elements, Newton's method, the turning law.
//! - `model`: the vocabulary of the world: components, resources, the schedule, the integrator, the public seam.
//! - `systems`: one file a mechanism or provider; [`standard`] is the only list of them.
//! - `scenario`: JSON in. `record`: results out.
//! - `simulation`: puts a scenario and a roster together and runs it.
//! - `study`: runs of runs.
//!
//! An author of a mechanism needs the [`prelude`], [`standard`] and [`run`], and nothing else: they are what the crate promises.
//! The rooms are open for its own tests and benches only; their names and contents may change with any version.

extern crate self as tropism;

mod cli;
#[doc(hidden)]
pub mod model;
mod new_mechanism;
#[doc(hidden)]
pub mod numerics;
pub mod prelude;
#[doc(hidden)]
pub mod record;
#[doc(hidden)]
pub mod scenario;
#[doc(hidden)]
pub mod simulation;
#[doc(hidden)]
pub mod study;
#[doc(hidden)]
#[path = "../systems/mod.rs"]
pub mod systems;

pub use cli::run;
pub use systems::standard;
