//! The vocabulary of the world.

pub mod keys;
pub mod quantity;
mod quantity_macro;
pub mod shape;
pub mod unit;
mod unit_grammar;
pub mod violation;
