//! The estimate of time: CPU seconds of one thread for a whole run, what is solved before the first step included.
//!
//! Counts times the nanoseconds below, which were measured on the reference machine (two shared x86-64 cores) on 2026-11-23 and
//! are good for a factor 2 each way.

use super::{Estimate, Expectation, done};
use crate::model::plan::{Plan, Work};
use crate::model::tissue::Tissue;
use bevy_ecs::prelude::World;

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;
/// The start of the program (ns).
const START: f64 = 1e7;
/// A vertex of the mesh: meshing, edges, regions (ns).
const MESH_VERTEX: f64 = 6000.0;
/// A step besides its stages and cones (ns).
const STEP: f64 = 20_000.0;
/// A growing cone at a stage: place, turn, walk, shaft (ns).
const CONE_STAGE: f64 = 1400.0;
/// A row of `trajectories.csv` (ns).
const ROW: f64 = 1500.0;
/// A figure, whatever it shows: page, fonts, fields, compression (ns).
const FIGURE: f64 = 3e8;
/// A byte of the recording as it is filmed: looking, deflating, measures (ns).
const RECORDED_BYTE: f64 = 120.0;
/// A shaft vertex in a panel (ns).
const DRAWN_VERTEX: f64 = 3000.0;

/// Nanoseconds of one unit of work that a part of a scene has told.
pub(super) fn unit(work: Work) -> f64 {
    match work {
        Work::NewtonUnknown => 3000.0,
        Work::FieldUnknown => 6500.0,
        Work::Interpolated => 5.0,
        Work::DeformedCell => 90.0,
        Work::Sampled => 100.0,
        Work::BorderFacet => 2.0,
        Work::Neighbourhood => 4500.0,
        // Bundles put many more within reach than even spreading does; that is in it.
        Work::EvenSegment => 800.0,
        Work::Indexed => 5000.0,
    }
}

/// CPU seconds of a run on one thread.
pub fn estimate(world: &World, expected: &Expectation) -> Estimate {
    let mut estimate = done(world.resource::<Plan>(), expected);
    estimate.add("program", START);
    estimate.add("mesh", MESH_VERTEX * world.resource::<Tissue>().mesh.vertex_count() as f64);
    estimate.add("steps", STEP * expected.steps);
    estimate.add("cones", CONE_STAGE * expected.cone_stages);
    estimate.add("trajectories", ROW * expected.trajectory_points);
    estimate.add("recording", RECORDED_BYTE * expected.recording_bytes);
    if expected.pictures > 0 {
        estimate.add("figure", FIGURE + DRAWN_VERTEX * expected.drawn_vertices);
    }
    estimate.parts.iter_mut().for_each(|part| part.amount /= SECOND);
    estimate.summed()
}
