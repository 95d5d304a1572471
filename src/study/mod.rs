//! Runs, and runs of runs.

pub mod plan;
pub mod run;
pub mod seeds;
pub mod stability;
