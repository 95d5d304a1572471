//! The laws of the model through the whole program: from a scenario to what its axons did.

mod births;
mod borders;
#[path = "../common/mod.rs"]
mod common;
mod cue_elements;
mod fixed_pull;
mod mechanisms;
mod noise;
mod remodelling;
mod tissue;
mod tissue_growth;
mod tissue_mesh;
mod turning;
