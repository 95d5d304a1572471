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
//! The rooms are private; the feature `rooms` opens them to the crate's own tests and benches.

#![cfg_attr(not(feature = "rooms"), allow(dead_code, unused_imports))] // what only tests, benches and authors name
#![allow(rustdoc::private_intra_doc_links)]

extern crate self as tropism;

mod new_mechanism;
pub mod prelude;
mod terminal;

#[cfg(not(feature = "rooms"))]
mod model;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod model;

#[cfg(not(feature = "rooms"))]
mod numerics;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod numerics;

#[cfg(not(feature = "rooms"))]
mod record;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod record;

#[cfg(not(feature = "rooms"))]
mod scenario;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod scenario;

#[cfg(not(feature = "rooms"))]
mod simulation;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod simulation;

#[cfg(not(feature = "rooms"))]
mod study;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod study;

#[cfg(not(feature = "rooms"))]
#[path = "../systems/mod.rs"]
mod systems;
#[cfg(feature = "rooms")]
#[doc(hidden)]
#[path = "../systems/mod.rs"]
pub mod systems;

pub use systems::standard;
pub use terminal::run;
