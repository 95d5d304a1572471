//! Runs, and runs of runs.

pub mod run;
pub mod seeds;
