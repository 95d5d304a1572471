//! How axons find their way.

extern crate self as tropism;

pub mod model;
pub mod numerics;
pub mod prelude;
pub mod scenario;
