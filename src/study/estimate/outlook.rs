//! The least that a scene takes, from its scenario alone: known before anything is made of it.
//!
//! Axons and mesh, by the counts that the scenario names; what solves and records take besides is known to the plan of the scene that has
//! been put together. So a number of axons or a mesh that no machine holds is refused before either is begun.

use super::Estimate;
use super::memory::{MEGABYTE, SETTING_UP};
use crate::model::shafts::Shafts;
use crate::scenario::scene::Scene;
use crate::simulation::BYTES_A_CONE;

/// The memory (MB) that axons and mesh of a scene take at least. A mesh that is refused for its number of vertices counts with
/// as many as are allowed.
pub fn outlook(scene: &Scene) -> Estimate {
    let axons: f64 = scene.populations.values().map(|population| population.count as f64).sum();
    let vertices = scene.tissue.expected_vertices().min(scene.tissue.max_vertices as f64);
    let mut estimate = Estimate::default();
    estimate.add("axons", axons * (BYTES_A_CONE + Shafts::BYTES_A_HEAD) as f64 / MEGABYTE);
    estimate.add("mesh", vertices * SETTING_UP / MEGABYTE);
    estimate.summed()
}
