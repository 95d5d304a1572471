//! The least that a scene takes, from its scenario alone: known before anything is made of it.
//!
//! Axons and mesh, by the counts that the scenario names; what solves and records take besides is known to the plan of the scene that has
//! been put together. So a number of axons or a mesh that no machine holds is refused before either is begun.

use super::Estimate;
use super::memory::{MEGABYTE, SETTING_UP};
use crate::model::shafts::Shafts;
use crate::scenario::scene::Scene;
use crate::simulation::BYTES_AN_AXON;

/// Vertices of a mesh of equilateral triangles of edge h in an area A, over A/h².
const VERTICES_AN_EDGE_SQUARED: f64 = 1.154_700_538_379_251_5;

/// The memory (MB) that axons and mesh of a scene take at least. A mesh that is refused for its number of vertices counts with
/// as many as are allowed.
pub fn outlook(scene: &Scene) -> Estimate {
    let axons: f64 = scene.populations.values().map(|population| population.count as f64).sum();
    let tissue = &scene.tissue;
    let vertices = VERTICES_AN_EDGE_SQUARED * tissue.outline.area() / tissue.mesh_size.0.powi(2);
    let mut estimate = Estimate::default();
    estimate.add("axons", axons * (BYTES_AN_AXON as f64 + Shafts::bytes_a_shaft()) / MEGABYTE);
    estimate.add("mesh", vertices.min(tissue.max_vertices as f64) * SETTING_UP / MEGABYTE);
    estimate.summed()
}
