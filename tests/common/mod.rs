//! Scenes for tests: from a JSON value to a run, and what the run leaves. Each test program uses its own part of this.
#![allow(dead_code)]

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use bevy_ecs::prelude::{With, World};
use serde_json::Value;
use tropism::model::clock::Clock;
use tropism::model::shafts::Shafts;
use tropism::prelude::{GrowthCone, Journey, Position, Roster, Spring, SpringState, Status, Vector3};
use tropism::record::recorder::{Recorder, RecorderOptions};
use tropism::scenario::load::{Loaded, Request, ScenarioErrors};
use tropism::simulation::Simulation;
use tropism::study::run::{Finished, Records, read, simulate};

/// A directory of the test's own that goes when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("tropism-test-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Reads a scene with some mechanisms left out and some keys set.
pub fn try_load(scene: &Value, roster: &Roster, without: &[&str], set: &[&str]) -> Result<Loaded, ScenarioErrors> {
    let folder = Folder::new();
    let path = folder.write("scene.json", &scene.to_string());
    let owned = |texts: &[&str]| texts.iter().map(|&text| text.to_owned()).collect();
    read(&Request { path, without: owned(without), set: owned(set) }, roster)
}

pub fn loaded(scene: &Value, roster: &Roster) -> Loaded {
    try_load(scene, roster, &[], &[]).unwrap_or_else(|error| panic!("{error}"))
}

pub fn assembled(scene: &Value, roster: &Roster) -> Simulation {
    Simulation::assemble(&loaded(scene, roster), roster).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs a scene to its end and returns it there.
pub fn ended(scene: &Value, roster: &Roster) -> Simulation {
    let mut simulation = assembled(scene, roster);
    to_end(&mut simulation);
    simulation
}

pub fn to_end(simulation: &mut Simulation) {
    while !simulation.is_over() {
        simulation.step().unwrap_or_else(|fault| panic!("{fault}"));
    }
    simulation.bring_tissue_here();
}

/// Runs a scene as the program does, with its recorder.
pub fn recorded(loaded: &Loaded, roster: &Roster) -> Finished {
    simulate(loaded, roster, "scene.json".as_ref(), Records::ALL, |_| {}).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs a loaded scene to its end once, and gives its trajectories as written and its end state.
pub fn observed(loaded: &Loaded, roster: &Roster) -> (String, Simulation) {
    let mut simulation = Simulation::assemble(loaded, roster).unwrap_or_else(|error| panic!("{error}"));
    let clock = *simulation.world().resource::<Clock>();
    let interval = Some(loaded.scene.output.trajectory_interval.0);
    let options = RecorderOptions { trajectory_interval: interval, ..RecorderOptions::default() };
    let mut recorder = Recorder::new(&options, &clock.grid, clock.end);
    loop {
        simulation.bring_tissue_here();
        recorder.observe(simulation.world()).unwrap();
        if simulation.is_over() {
            return (recorder.trajectories.as_str().to_owned(), simulation);
        }
        simulation.step().unwrap_or_else(|fault| panic!("{fault}"));
    }
}

/// A growth cone after a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConeState {
    pub identity: GrowthCone,
    /// Time of birth (h).
    pub birth_time: f64,
    pub status: Status,
    pub position: Vector3<f64>,
    pub spring: Spring,
    pub journey: Journey,
}

/// All growth cones, in order.
pub fn cones(world: &World) -> Vec<ConeState> {
    let mut query = world
        .try_query_filtered::<(&GrowthCone, &Status, &Position, &SpringState, &Journey), With<GrowthCone>>()
        .unwrap();
    let grid = &world.resource::<Clock>().grid;
    query
        .iter(world)
        .map(|(identity, status, position, spring, journey)| ConeState {
            identity: *identity,
            birth_time: identity.birth_time(grid),
            status: *status,
            position: position.in_space(),
            spring: spring.seen(),
            journey: *journey,
        })
        .collect()
}

/// FNV-1a of the bits of every number of every cone's state, and of every point of every shaft.
pub fn hash_of_states(world: &World) -> u64 {
    let mut hash = Fnv::default();
    for cone in cones(world) {
        hash.bytes(cone.status.word().as_bytes());
        let spring = cone.spring;
        for vector in [cone.position, spring.heading, spring.pull, spring.spin] {
            vector.iter().for_each(|x| hash.bytes(&x.to_bits().to_le_bytes()));
        }
        for number in [
            spring.drift,
            spring.speed_factor,
            spring.heading_diffusion,
            cone.journey.length,
            cone.journey.ended,
            cone.journey.worst_drift,
        ] {
            hash.bytes(&number.to_bits().to_le_bytes());
        }
    }
    let shafts = world.resource::<Shafts>();
    for point in (0..shafts.count()).flat_map(|shaft| shafts.polyline(shaft)) {
        hash.bytes(&point.cell.to_le_bytes());
        point.weights.iter().for_each(|x| hash.bytes(&x.to_bits().to_le_bytes()));
    }
    hash.0
}

/// The 64-bit Fowler–Noll–Vo hash.
pub struct Fnv(pub u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    pub fn bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    }
}

/// Slope of log(error) over log(step) by least squares, for a step halved from entry to entry.
pub fn fitted_order(errors: &[f64]) -> f64 {
    let middle = (errors.len() as f64 - 1.0) / 2.0;
    let pairs = errors.iter().enumerate().map(|(i, error)| (i as f64 - middle, error.log2()));
    -pairs.clone().map(|(x, y)| x * y).sum::<f64>() / pairs.map(|(x, _)| x * x).sum::<f64>()
}

/// Difference of two angles (rad), in (−π, π].
pub fn angle_between(a: f64, b: f64) -> f64 {
    (a - b).sin().atan2((a - b).cos())
}
