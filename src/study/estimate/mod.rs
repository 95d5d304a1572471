//! What a run will take, from counts alone: nothing is tried, so an estimate is the same everywhere.
//!
//! The parts of a scene have told its [`Plan`] what they hold in memory and what they do how often, for each axon, stored vertex,
//! step or stage. How many of these there will be is an [`Expectation`]; how long one of them takes stands in [`seconds`], how much
//! memory the program takes besides in [`memory`]. What is known before a scene is put together: [`outlook`]. How fast a machine is beside the one
//! that the seconds are of: [`yardstick`], the only part that reads a clock.

pub mod memory;
pub mod outlook;
pub mod seconds;
pub mod yardstick;

use crate::model::clock::Clock;
use crate::model::components::{GrowthCone, Site};
use crate::model::growth::{Growth, Targets};
use crate::model::observables::Observables;
use crate::model::plan::{Each, Plan, Task, Work};
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use crate::numerics::polygon::bounding_box;
use crate::record::recorder::Recorder;
use crate::record::recording::film::FilmExtent;
use bevy_ecs::prelude::World;
use serde::Serialize;

/// Length of the way to a target over the straight line from the place of birth, at rest. Ours, measured.
const DETOUR: f64 = 1.5;

/// An amount with its parts, the largest first.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Estimate {
    /// The sum.
    pub total: f64,
    /// What it is made of.
    pub parts: Vec<Share>,
}

/// A part of an estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Share {
    /// The part of the scene or of the program.
    pub name: String,
    /// Its amount, in the unit of the whole.
    pub amount: f64,
}

impl Estimate {
    /// Adds an amount to the part of a name.
    fn add(&mut self, name: &str, amount: f64) {
        match self.parts.iter_mut().find(|part| part.name == name) {
            Some(part) => part.amount += amount,
            None if amount > 0.0 => self.parts.push(Share { name: name.to_owned(), amount }),
            None => {}
        }
    }

    /// The parts in order, and their sum.
    fn summed(mut self) -> Self {
        self.parts.sort_by(|a, b| b.amount.total_cmp(&a.amount));
        self.total = self.parts.iter().map(|part| part.amount).sum();
        self
    }
}

/// How much there will be of what costs something.
///
/// A cone of a scene with targets and with cues that turn cones, or stiffness that does, is expected to reach the nearest target by a way half as long
/// again as the straight line, another one to grow to the end of the run; axons evenly spread, the tissue at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expectation {
    /// Axons born before the end.
    pub axons: f64,
    /// Steps of the clock in which something grows.
    pub steps: f64,
    /// Evaluations of the right-hand side.
    pub stages: f64,
    /// Steps of growing cones.
    pub cone_steps: f64,
    /// Growing cones at all stages together.
    pub cone_stages: f64,
    /// Vertices stored of all shafts.
    pub shaft_vertices: f64,
    /// Rows of `trajectories.csv`.
    pub trajectory_points: f64,
    /// Panels of the figure.
    pub pictures: usize,
    /// Shaft vertices in all panels together.
    pub drawn_vertices: f64,
    /// Bytes of the recording in memory, before it is deflated.
    pub recording_bytes: f64,
    /// How much denser axons lie on their way than if they grew evenly spread in the tissue at rest: targets draw them in, growth of the tissue
    /// draws them apart.
    pub crowding: f64,
}

/// One cone's life: ticks, and the length of its shaft over that of a segment.
struct Life {
    birth: u64,
    end: u64,
    vertices_a_tick: f64,
}

impl Life {
    /// Vertices stored by an instant.
    fn vertices_at(&self, instant: u64) -> f64 {
        let grown = instant.min(self.end).saturating_sub(self.birth);
        if instant < self.birth { 0.0 } else { 1.0 + grown as f64 * self.vertices_a_tick }
    }
}

impl Expectation {
    /// Of an assembled scene and the recorder that would look at it.
    pub fn of(world: &World, recorder: &Recorder, trajectory_points: u64) -> Self {
        let clock = world.resource::<Clock>();
        let goals = goals(world);
        let lives = lives(world, clock, &goals);
        let ticks = clock.grid.step_ticks();
        let first = lives.iter().map(|life| life.birth).min().unwrap_or_default();
        let last = lives.iter().map(|life| life.end).max().unwrap_or_default();
        let steps = (last - first).div_ceil(ticks) as f64;
        let cone_steps: f64 = lives.iter().map(|life| (life.end - life.birth).div_ceil(ticks) as f64).sum();
        let stages = world.resource::<Growth>().method.stages() as f64;
        let vertices_at = |instant: u64| lives.iter().map(|life| life.vertices_at(instant)).sum::<f64>();
        let pictures = recorder.pictures_due();
        let shaft_vertices = vertices_at(clock.end);
        let cones = world.resource::<Shafts>().count() as f64;
        let film = FilmExtent { frames: recorder.frames_due() as f64, cones, shaft_vertices };
        Self {
            axons: lives.len() as f64,
            steps,
            stages: steps * stages,
            cone_steps,
            cone_stages: cone_steps * stages,
            shaft_vertices,
            trajectory_points: trajectory_points as f64,
            pictures: pictures.len(),
            drawn_vertices: pictures.iter().map(|&instant| vertices_at(instant)).sum(),
            recording_bytes: if film.frames > 0.0 { film.bytes(world) } else { 0.0 },
            crowding: crowding(world, clock, &goals) / (1.0 + world.resource::<Plan>().swelling),
        }
    }

    /// How many there will be.
    fn count(&self, each: Each) -> f64 {
        match each {
            Each::Run => 1.0,
            Each::Axon => self.axons,
            Each::ShaftVertex => self.shaft_vertices,
            Each::Step => self.steps,
            Each::Stage => self.stages,
            Each::ConeStage => self.cone_stages,
        }
    }
}

/// The lives to be expected of the cones born before the end.
fn lives(world: &World, clock: &Clock, goals: &[[f64; 2]]) -> Vec<Life> {
    let Some(mut cones) = world.try_query::<(&GrowthCone, &Site)>() else { return Vec::new() };
    let (tissue, segment) = (world.resource::<Tissue>(), world.resource::<Shafts>().mean_segment());
    let tick = clock.grid.tick();
    let live = |(cone, site): (&GrowthCone, &Site)| {
        let from = tissue.reference_position(*site);
        let distances = goals.iter().map(|goal| (goal[0] - from.x).hypot(goal[1] - from.y));
        let nearest = distances.fold(f64::INFINITY, f64::min);
        let needed = (DETOUR * nearest / (cone.speed * tick)).ceil();
        let left = clock.end.saturating_sub(cone.birth);
        let end = cone.birth + if needed < left as f64 { needed as u64 } else { left };
        Life { birth: cone.birth, end, vertices_a_tick: cone.speed * tick / segment }
    };
    cones.iter(world).filter(|(cone, _)| cone.birth < clock.end).map(live).collect()
}

/// The mean over the way of births' extent over the extent that is left, which shrinks evenly to that of the targets; 1 where nothing
/// leads to them. Of axons that do not come so far, the part of the way that they come.
fn crowding(world: &World, clock: &Clock, goals: &[[f64; 2]]) -> f64 {
    let Some(mut cones) = world.try_query::<(&GrowthCone, &Site)>() else { return 1.0 };
    let tissue = world.resource::<Tissue>();
    let births: Vec<_> =
        cones.iter(world).map(|(_, site)| tissue.reference_position(*site)).map(|at| [at.x, at.y]).collect();
    let ends = middle_and_side(&births).zip(middle_and_side(goals));
    let Some(((from, wide), (to, narrow))) = ends else { return 1.0 };
    let fastest = cones.iter(world).map(|(cone, _)| cone.speed).fold(0.0, f64::max);
    let (way, needed) = (fastest * clock.grid.hours(clock.end), DETOUR * (to[0] - from[0]).hypot(to[1] - from[1]));
    let come = if way < needed { way / needed } else { 1.0 };
    let left = 1.0 - come * (1.0 - (narrow / wide).min(1.0));
    if left < 1.0 && wide > 0.0 { -left.ln() / (1.0 - left) } else { 1.0 }
}

/// Centre and longer side of the box about some points; none without points.
fn middle_and_side(points: &[[f64; 2]]) -> Option<([f64; 2], f64)> {
    let [low, high] = bounding_box(points);
    let middle = [0, 1].map(|k| 0.5 * (low[k] + high[k]));
    (!points.is_empty()).then_some((middle, (high[0] - low[0]).max(high[1] - low[1])))
}

/// Vertices of the targets (µm, at rest) if anything leads to them.
fn goals(world: &World) -> Vec<[f64; 2]> {
    if world.resource::<Observables>().effects.is_empty() && !world.resource::<Plan>().leads {
        return Vec::new();
    }
    let mesh = &world.resource::<Tissue>().mesh;
    let inside = world.resource::<Targets>().cells.iter().enumerate().filter(|(_, inside)| **inside);
    let mut vertices: Vec<u32> = inside.flat_map(|(cell, _)| mesh.cell(cell)).copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.into_iter().map(|vertex| mesh.vertices()[vertex as usize]).collect()
}

/// Adds up what the parts of a scene have told, `amount` of each in the unit of the estimate.
fn told<T>(estimate: &mut Estimate, told: &[T], expected: &Expectation, amount: impl Fn(&T) -> (&str, f64, Each)) {
    for (name, amount, each) in told.iter().map(amount) {
        estimate.add(name, amount * expected.count(each));
    }
}

/// The plan's own parts of an estimate of memory (bytes).
fn held(plan: &Plan, expected: &Expectation) -> Estimate {
    let mut estimate = Estimate::default();
    told(&mut estimate, &plan.holdings, expected, |held| (&held.name, held.bytes, held.each));
    estimate
}

/// The plan's own parts of an estimate of time (ns).
fn done(plan: &Plan, expected: &Expectation) -> Estimate {
    let mut estimate = Estimate::default();
    let crowded = |work| if work == Work::EvenSegment { expected.crowding } else { 1.0 };
    let time = |task: &Task| task.amount * crowded(task.work) * seconds::unit(task.work);
    told(&mut estimate, &plan.tasks, expected, |task| (&task.name, time(task), task.each));
    estimate
}
