//! The vocabulary of the world: components, resources, the schedule, the integrator, random streams, and the public seam.

pub mod births;
pub mod brownian;
pub mod carry;
pub mod clock;
pub mod components;
pub mod cones;
pub mod growth;
pub mod health;
pub mod integrator;
pub mod keys;
pub mod mechanism;
pub mod observables;
pub mod plan;
pub mod quantity;
mod quantity_macro;
pub mod random;
pub mod schedule;
pub mod settle;
pub mod shafts;
pub mod shape;
pub mod stopwatch;
pub mod tissue;
pub mod unit;
mod unit_grammar;
pub mod violation;
