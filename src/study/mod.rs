//! Runs, and runs of runs.

pub mod ablation;
pub mod accuracy;
pub mod assay;
pub mod bench;
pub mod chart;
pub mod estimate;
pub mod laboratory;
pub mod pictures;
pub mod plan;
pub mod report;
pub mod resume;
pub mod room;
pub mod run;
pub mod seeds;
pub mod stability;
