//! The estimate of time: CPU seconds of one thread for a whole run, what is solved before the first step included.
//!
//! Counts times the nanoseconds below, which were measured on the reference machine (two shared x86-64 cores, nothing beside) on 2026-11-24,
//! those of contact in proportion to it on 2026-11-30. By how much another machine is slower or faster as a whole: [`yardstick`](super::yardstick).

use super::{Estimate, Expectation, done};
use crate::model::observables::{Effect, Observables};
use crate::model::plan::{Each, Plan, Work};
use crate::model::tissue::Tissue;
use crate::record::scene_figure::PictureSize;
use bevy_ecs::prelude::World;

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;
/// The start of the program (ns).
const START: f64 = 6e6;
/// A vertex of the mesh: meshing, edges, regions (ns).
const MESH_VERTEX: f64 = 1750.0;
/// A step besides its stages and cones (ns).
const STEP: f64 = 12_000.0;
/// A growing cone at a stage: place, turn, walk, shaft (ns).
const CONE_STAGE: f64 = 430.0;
/// A row of `trajectories.csv` (ns).
const ROW: f64 = 370.0;
/// A figure, whatever it shows: fonts, legend (ns).
const FIGURE: f64 = 2e7;
/// A pixel of the page: drawing, compression (ns).
const PAGE_PIXEL: f64 = 14.5;
/// A pixel of the tissue in a panel, and of an effect of cues laid over it (ns).
const TISSUE_PIXEL: f64 = 80.0;
const CUE_PIXEL: f64 = 67.0;
/// A shaft vertex in a panel (ns).
const DRAWN_VERTEX: f64 = 770.0;
/// A byte of the recording: looking, deflating, measures (ns).
const RECORDED_BYTE: f64 = 21.0;

/// Nanoseconds of one unit of work that a part of a scene has told.
pub(super) fn unit(work: Work) -> f64 {
    match work {
        Work::NewtonUnknown => 1130.0,
        Work::FieldUnknown => 1700.0,
        Work::SteppedUnknown => 410.0,
        Work::Interpolated => 0.6,
        Work::Moved => 3.9,
        Work::DeformedCell => 24.5,
        Work::WatchedCell => 6.0,
        Work::Sampled => 17.5,
        Work::BorderFacet => 0.09,
        Work::Neighbourhood => 800.0,
        Work::EvenSegment => 51.0,
        Work::Indexed => 240.0,
    }
}

/// CPU seconds of a run on one thread, its figure included, if it has one.
pub fn estimate(world: &World, expected: &Expectation, figure: Option<&PictureSize>) -> Estimate {
    let mut estimate = done(world.resource::<Plan>(), expected);
    estimate.add("program", START);
    estimate.add("mesh", MESH_VERTEX * world.resource::<Tissue>().mesh.vertex_count() as f64);
    estimate.add("steps", STEP * expected.steps);
    estimate.add("cones", CONE_STAGE * expected.cone_stages);
    estimate.add("trajectories", ROW * expected.trajectory_points);
    estimate.add("recording", RECORDED_BYTE * expected.recording_bytes);
    if let Some(figure) = figure {
        let effects = &world.resource::<Observables>().effects;
        let shown = |effect| f64::from(effects.values().any(|other| *other == effect));
        let field = TISSUE_PIXEL + CUE_PIXEL * (shown(Effect::Attract) + shown(Effect::Repel));
        let pixels = PAGE_PIXEL * figure.page
            + field * figure.field * expected.pictures as f64 * shown_of(world.resource::<Plan>().swelling);
        estimate.add("figure", FIGURE + pixels + DRAWN_VERTEX * expected.drawn_vertices);
    }
    estimate.parts.iter_mut().for_each(|part| part.amount /= SECOND);
    estimate.summed()
}

/// Area of the tissue in a panel, in the mean, over that in the panel where it is largest, if it grows or shrinks evenly by so much in the mean.
fn shown_of(swelling: f64) -> f64 {
    (1.0 + swelling) / (1.0 + 2.0 * swelling.max(0.0))
}

/// What a scene takes for the run and for each of what there are many of (ns of one thread), to compare settings by before it is known
/// how many there will be. Axons and stored vertices, the same with all settings, are left out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rates {
    /// The run, Newton's method left out.
    pub run: f64,
    /// Newton's method.
    pub newton: f64,
    /// A step of the clock.
    pub step: f64,
    /// A stage of the integrator.
    pub stage: f64,
    /// A growing cone at a stage.
    pub cone_stage: f64,
}

impl Rates {
    /// Of a scene that was put together.
    pub fn of(world: &World) -> Self {
        let mesh = MESH_VERTEX * world.resource::<Tissue>().mesh.vertex_count() as f64;
        let mut rates = Self { run: START + mesh, step: STEP, cone_stage: CONE_STAGE, ..Self::default() };
        for task in &world.resource::<Plan>().tasks {
            let time = task.amount * unit(task.work);
            match (task.each, task.work) {
                (Each::Run, Work::NewtonUnknown) => rates.newton += time,
                (Each::Run, _) => rates.run += time,
                (Each::Step, _) => rates.step += time,
                (Each::Stage, _) => rates.stage += time,
                (Each::ConeStage, _) => rates.cone_stage += time,
                (Each::Axon | Each::ShaftVertex, _) => {}
            }
        }
        rates
    }
}
