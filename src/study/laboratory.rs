//! A scene with some keys changed, put together and timed again and again.

use super::chart::work_precision::{Point, Seconds};
use super::room::Room;
use super::run::{RunError, assembled, read};
use crate::model::components::{GrowthCone, Journey, Site, SpringState};
use crate::model::configuration::Configuration;
use crate::model::mechanism::Roster;
use crate::model::stopwatch::Stopwatch;
use crate::model::tissue::Tissue;
use crate::model::violation::pointer_token;
use crate::scenario::load::{Loaded, Request};
use crate::simulation::Simulation;
use bevy_ecs::prelude::With;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// A scene to experiment with.
pub struct Laboratory<'a> {
    /// The scene as the user gave it.
    pub request: &'a Request,
    /// The mechanisms there are.
    pub roster: &'a Roster,
    /// How often each setting is timed.
    pub repetitions: usize,
    /// Seeds for the measures of whole scenes.
    pub seeds: u64,
    /// The memory that a run may take.
    pub room: Room,
}

/// One setting: a method with its knob, and the keys that make it.
#[derive(Debug, Clone)]
pub struct Setting {
    /// The method.
    pub method: String,
    /// The setting in words.
    pub words: String,
    /// The number that is refined.
    pub knob: f64,
    /// The keys, as `--set` takes them.
    pub set: Vec<String>,
    /// Whether this is what the scene has.
    pub default: bool,
}

impl Setting {
    /// The point that this setting makes, once measured.
    pub fn point(&self, seconds: Seconds, errors: BTreeMap<String, f64>, counts: BTreeMap<String, f64>) -> Point {
        Point {
            method: self.method.clone(),
            setting: self.words.clone(),
            set: self.set.clone(),
            knob: self.knob,
            seconds,
            errors,
            counts,
            default: self.default,
        }
    }
}

/// Where a cone is at some moment and where it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConeView {
    /// Position (µm).
    pub position: Vector3<f64>,
    /// Unit heading.
    pub heading: Vector3<f64>,
    /// Length of its path (µm).
    pub length: f64,
}

impl<'a> Laboratory<'a> {
    /// A laboratory that times nothing twice.
    pub fn new(request: &'a Request, roster: &'a Roster) -> Self {
        Self { request, roster, repetitions: 1, seeds: 1, room: Room::default() }
    }

    /// The scene as it is.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub fn scene(&self) -> Result<Loaded, RunError> {
        self.load(&[], &[])
    }

    /// The scene without some mechanisms and with some keys set.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub fn load(&self, without: &[&str], set: &[String]) -> Result<Loaded, RunError> {
        let mut request = self.request.clone();
        request.without.extend(without.iter().map(|name| (*name).to_owned()));
        request.set.extend(set.iter().cloned());
        Ok(read(&request, self.roster)?)
    }

    /// Puts a scene together.
    ///
    /// # Errors
    /// A scene that cannot be assembled.
    pub fn assemble(&self, loaded: &Loaded) -> Result<Simulation, RunError> {
        assembled(loaded, self.roster, &self.request.path)
    }

    /// Puts a scene together as often as settings are timed; the time is that of the named phases. The last one is kept.
    ///
    /// # Errors
    /// A scene that cannot be assembled.
    pub fn timed_assembly(&self, loaded: &Loaded, phases: &[&str]) -> Result<(Simulation, Seconds), RunError> {
        self.repeated(|| {
            let simulation = self.assemble(loaded)?;
            let booked = simulation.world().resource::<Stopwatch>().seconds();
            let seconds = phases.iter().filter_map(|phase| booked.get(phase)).sum();
            Ok((simulation, seconds))
        })
    }

    /// Runs a scene until `stop` (h) as often as settings are timed; the time is that of the steps, or of some phases of them.
    ///
    /// # Errors
    /// A scene that cannot be assembled, or a fault while running.
    pub fn timed_run(&self, loaded: &Loaded, stop: f64, phases: &[&str]) -> Result<(Simulation, Seconds), RunError> {
        self.repeated(|| {
            let mut simulation = self.assemble(loaded)?;
            let before = simulation.world().resource::<Stopwatch>().total();
            run_until(&mut simulation, stop)?;
            simulation.lap("record");
            let stopwatch = simulation.world().resource::<Stopwatch>();
            let some = phases.iter().filter_map(|phase| stopwatch.seconds().get(phase)).sum();
            let seconds = if phases.is_empty() { stopwatch.total() - before } else { some };
            Ok((simulation, seconds))
        })
    }

    /// Puts a scene together and runs it until `stop` (h) as often as settings are timed; the time is that of both.
    ///
    /// # Errors
    /// A scene that cannot be assembled, or a fault while running.
    pub fn timed_whole(&self, loaded: &Loaded, stop: f64) -> Result<(Simulation, Seconds), RunError> {
        self.repeated(|| {
            let mut simulation = self.assemble(loaded)?;
            run_until(&mut simulation, stop)?;
            simulation.lap("record");
            let seconds = simulation.world().resource::<Stopwatch>().total();
            Ok((simulation, seconds))
        })
    }

    fn repeated(
        &self,
        mut once: impl FnMut() -> Result<(Simulation, f64), RunError>,
    ) -> Result<(Simulation, Seconds), RunError> {
        let (mut last, first) = once()?;
        let mut measured = vec![first];
        for _ in 1..self.repetitions {
            let (simulation, seconds) = once()?;
            last = simulation;
            measured.push(seconds);
        }
        let seconds = Seconds::of(&measured).ok_or_else(|| RunError::Internal("nothing was timed".into()))?;
        Ok((last, seconds))
    }
}

/// Steps until a time (h) or the end.
///
/// # Errors
/// A fault while running.
pub fn run_until(simulation: &mut Simulation, stop: f64) -> Result<(), RunError> {
    while !simulation.is_over() && simulation.time() < stop * (1.0 - 1e-12) {
        simulation.step().map_err(|fault| RunError::Solve(fault.to_string()))?;
    }
    simulation.bring_tissue_here();
    Ok(())
}

/// All cones, in order: where their sites are now. (Positions of cones that have stopped are those of their last step.)
pub fn cones(simulation: &Simulation) -> Vec<ConeView> {
    let world = simulation.world();
    let (mesh, now) = (&world.resource::<Tissue>().mesh, world.resource::<Configuration>());
    let query = world.try_query_filtered::<(&Site, &SpringState, &Journey), With<GrowthCone>>();
    let view = |(site, spring, journey): (&Site, &SpringState, &Journey)| ConeView {
        position: now.position(mesh, *site),
        heading: spring.seen().heading,
        length: journey.length,
    };
    query.map(|mut query| query.iter(world).map(view).collect()).unwrap_or_default()
}

/// The blocks of a scene with which paths are chaotic, so that tips cannot be compared: contact and noise.
pub fn chaotic(scene: &Loaded) -> Vec<&'static str> {
    ["fasciculation", "heading_noise"].into_iter().filter(|name| scene.blocks.contains_key(*name)).collect()
}

/// The keys, as `--set` takes them, that leave each population `most` axons at most.
pub fn few_axons(scene: &Loaded, most: u64) -> Vec<String> {
    let larger = scene.scene.populations.iter().filter(|(_, population)| population.count > most);
    larger.map(|(name, _)| format!("/populations{}/count={most}", pointer_token(name))).collect()
}

/// The angle between two vectors, in degrees; 0 if one of them is none.
pub fn angle_between(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}

/// Root mean square; 0 of nothing.
pub fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0f64), |(sum, count), value| (sum + value * value, count + 1.0));
    (sum / count.max(1.0)).sqrt()
}

/// Points spread evenly over the tissue (Halton's sequence in bases 2 and 3), in the reference configuration (µm).
pub fn spread_points(loaded: &Loaded, simulation: &Simulation, count: usize) -> Vec<[f64; 2]> {
    let tissue = simulation.world().resource::<Tissue>();
    let [low, high] = tissue.domain.bounding_box();
    // A point a whole cell away from the border lies inside whatever the mesh.
    let margin = 0.02 * (high[0] - low[0]).min(high[1] - low[1]).min(loaded.scene.tissue.mesh_size.0);
    let point = |i: u64| [(0, 2), (1, 3)].map(|(k, base)| low[k] + (high[k] - low[k]) * radical_inverse(i, base));
    let inside = |x: &[f64; 2]| {
        let around = [[0.0, 0.0], [margin, 0.0], [-margin, 0.0], [0.0, margin], [0.0, -margin]];
        around.iter().all(|d| tissue.locate([x[0] + d[0], x[1] + d[1]]).is_some())
    };
    (1..20 * count as u64).map(point).filter(inside).take(count).collect()
}

fn radical_inverse(mut index: u64, base: u64) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / base as f64);
    while index > 0 {
        value += (index % base) as f64 * digit;
        index /= base;
        digit /= base as f64;
    }
    value
}
