//! The estimate of memory: the largest resident memory of a run on one thread.
//!
//! What grows with the scene is told by its parts, from the sizes of their types and the lengths of their lists. The constants
//! below are ours, measured on Linux; all together are good for a factor 1.5. More threads draw more panels at a time and take
//! about 1 MB each besides.

use super::{Estimate, Expectation, held};
use crate::model::plan::Plan;
use crate::model::tissue::Tissue;
use crate::record::csv::IN_MEMORY;
use crate::record::scene_figure::PictureSize;
use bevy_ecs::prelude::World;

/// Bytes in a megabyte.
pub(super) const MEGABYTE: f64 = 1e6;
/// The program, its schemas and schedules (bytes).
const PROGRAM: f64 = 9.5e6;
/// Meshing and setting up fields, a vertex of the mesh (bytes): most of it is given back, but stays with the process.
pub(super) const SETTING_UP: f64 = 1100.0;
/// A row of `trajectories.csv`, as it stands in memory until it goes to the disk (bytes).
const ROW: f64 = 80.0;
/// A shaft vertex in a snapshot (bytes), and in its panel and the drawing.
const SEEN_VERTEX: f64 = 18.0;
const DRAWN_VERTEX: f64 = 30.0;
/// What the process keeps of the memory of a run that is over (bytes).
const NOT_GIVEN_BACK: f64 = 64e6;

/// The peak of resident memory (MB) of a scene, and of its figure, if it has one.
pub fn estimate(world: &World, expected: &Expectation, figure: Option<&PictureSize>) -> Estimate {
    let mut estimate = held(world.resource::<Plan>(), expected);
    let given_back = (estimate.parts.iter().map(|part| part.amount).sum::<f64>() - NOT_GIVEN_BACK).max(0.0);
    let tissue = world.resource::<Tissue>();
    estimate.add("program", PROGRAM);
    estimate.add("mesh", SETTING_UP * tissue.mesh.vertex_count() as f64);
    // The rows of one instant stand there twice, piece by piece and together.
    let most = IN_MEMORY as f64 + 2.0 * ROW * expected.axons;
    estimate.add("trajectories", most.min(ROW * expected.trajectory_points));
    estimate.add("recording", expected.recording_bytes);
    let drawing = figure.map_or(0.0, |figure| figure.bytes_to_draw() + DRAWN_VERTEX * expected.drawn_vertices);
    estimate.add("figure", figure.map_or(0.0, |_| SEEN_VERTEX * expected.drawn_vertices));
    // The recording as it is written is a second copy, which has gone when the figure is drawn, and cones, tissue and fields have gone before
    // either: the largest counts.
    match drawing >= expected.recording_bytes {
        true => estimate.add("figure", (drawing - given_back).max(0.0)),
        false => estimate.add("recording", (expected.recording_bytes - given_back).max(0.0)),
    }
    estimate.parts.iter_mut().for_each(|part| part.amount /= MEGABYTE);
    estimate.summed()
}
