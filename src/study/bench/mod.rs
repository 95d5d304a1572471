//! `tropism bench`: how many growth cones a second, at several numbers of axons, beside a plain loop over arrays of the same mathematics.
//!
//! The scene says how it grows: its key `parameters/axons` is set to each number. What counts is the time that cones take: tissue and
//! fields are the same for both and are told apart as the scene's own. Seconds are those of one thread.

mod plain;
pub mod report;

use super::chart::work_precision::{Seconds, slope};
use super::estimate::outlook::outlook;
use super::laboratory::{Laboratory, cones};
use super::plan::memory_of;
use super::run::{Records, RunError};
use crate::model::clock::Clock;
use crate::model::configuration::Configuration;
use crate::model::health::Counters;
use crate::model::shafts::Shafts;
use crate::model::stopwatch::{Elapsed, Stopwatch};
use crate::model::violation::pointer_token;
use crate::record::summary::{cpu_seconds, memory_mib};
use crate::scenario::load::Loaded;
use crate::simulation::Simulation;
use plain::PlainLoop;
use serde::Serialize;
use std::collections::BTreeMap;

/// The key that scales a scene.
const KEY: &str = "/parameters/axons";
/// Phases that are not the cones': what is solved before the run, and what moves tissue and fields.
const SCENERY: [&str; 8] = ["mesh", "assembly", "plan", "matrix", "cues", "matrix motion", "cue fields", "record"];
/// With more axons than this there is no plain loop beside: it would take long.
const MOST_PLAIN: u64 = 200_000;
/// With more axons than this each run is timed once.
const MOST_REPEATED: u64 = 50_000;
/// Bytes of a MiB.
const MIB: f64 = 1_048_576.0;
/// Looks at the clock during a run.
const LOOKS: usize = 8;

/// One number of axons, measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Axons.
    pub axons: u64,
    /// Steps of growing cones.
    pub cone_steps: u64,
    /// Hours that cones grew, all together.
    pub cone_hours: f64,
    /// Seconds on the wall that cones took.
    pub seconds: Seconds,
    /// Seconds of processor time that they took, median: those on the wall times the share of the run in which threads were at work;
    /// none where the system does not tell.
    pub cpu_seconds: Option<f64>,
    /// Seconds of mesh, tissue and fields.
    pub scenery_seconds: f64,
    /// Seconds of the plain loop.
    pub plain_seconds: Option<Seconds>,
    /// Seconds of processor time of cones over those of the plain loop, both medians; on the wall where the system does not tell.
    pub ratio: Option<f64>,
    /// Largest distance between the ends of the same cone in both (µm).
    pub difference: Option<f64>,
    /// Steps of growing cones a second.
    pub cone_steps_a_second: f64,
    /// Cone-hours a second.
    pub cone_hours_a_second: f64,
    /// Steps of growing cones a second of processor time.
    pub cone_steps_a_cpu_second: Option<f64>,
    /// Cone-hours a second of processor time.
    pub cone_hours_a_cpu_second: Option<f64>,
    /// Cone-hours a second, tissue and fields included.
    pub cone_hours_a_second_with_scenery: f64,
    /// Power with which the cones' time grows with the cone-steps of one run.
    pub growth_in_steps: f64,
    /// Bytes of memory an axon that the run had taken by its end, tissue and fields included; none where the system does not say.
    pub bytes_an_axon: Option<f64>,
    /// Stored vertices an axon.
    pub vertices_an_axon: f64,
    /// Share of each phase in the cones' time.
    pub share: BTreeMap<String, f64>,
}

/// All numbers of axons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bench {
    /// Name of the scene.
    pub scene: String,
    /// Threads of the simulation; the plain loop has one.
    pub threads: usize,
    /// Power with which the time of a cone-step grows with the number of axons.
    pub growth_in_axons: Option<f64>,
    /// What kept the plain loop from running, if anything.
    pub without_plain: Option<String>,
    /// The rows, by number of axons.
    pub rows: Vec<Row>,
}

/// What one run of the simulation gave.
struct Timed {
    simulation: Simulation,
    phases: BTreeMap<&'static str, f64>,
    marks: Vec<[f64; 2]>,
    bytes: Option<f64>,
    /// Threads at work, on average.
    busy: Option<f64>,
}

/// What one run of the plain loop gave.
struct TimedPlain {
    seconds: f64,
    busy: Option<f64>,
    /// Largest distance of its cones from those of the simulation (µm).
    apart: f64,
}

/// Processor time and time on the wall since a moment, one over the other.
struct Busy(Option<f64>, Elapsed);

impl Busy {
    fn begin() -> Self {
        Self(cpu_seconds(), Elapsed::default())
    }

    /// How many threads have been at work, on average; none where the system does not tell, or forgot the time of threads that ended.
    fn threads(&self) -> Option<f64> {
        let seconds = cpu_seconds()? - self.0?;
        (seconds > 0.0).then(|| seconds / self.1.seconds().max(f64::MIN_POSITIVE))
    }
}

/// Times a scene at several numbers of axons, ascending.
///
/// # Errors
/// A scene without the key, one that cannot be assembled or does not fit into memory, a fault while running.
pub fn bench(laboratory: &Laboratory, axons: &[u64], tick: &dyn Fn(f64)) -> Result<Bench, RunError> {
    let scene = laboratory.scene()?;
    if scene.merged.pointer(KEY).is_none() {
        let message = format!("{} has no {KEY}, by which a bench scales it", laboratory.request.path.display());
        return Err(RunError::Arguments(message));
    }
    let mut rows = Vec::new();
    let mut without_plain = None;
    for (done, &count) in axons.iter().enumerate() {
        tick(done as f64 / axons.len() as f64);
        rows.push(row(laboratory, count, &mut without_plain)?);
    }
    let costs: Vec<[f64; 2]> = rows.iter().map(|row| [row.axons as f64, 1.0 / row.cone_steps_a_second]).collect();
    Ok(Bench {
        scene: scene.scene.name,
        threads: rayon::current_num_threads(),
        growth_in_axons: fitted_power(&costs),
        without_plain,
        rows,
    })
}

/// The seconds of several runs of the same.
#[derive(Default)]
struct Timings {
    wall: Vec<f64>,
    cpu: Vec<f64>,
}

impl Timings {
    fn push(&mut self, seconds: f64, busy: Option<f64>) {
        self.wall.push(seconds);
        self.cpu.extend(busy.map(|threads| seconds * threads));
    }

    fn wall(&self) -> Option<Seconds> {
        Seconds::of(&self.wall)
    }

    fn cpu(&self) -> Option<f64> {
        Seconds::of(&self.cpu).map(|seconds| seconds.median)
    }
}

fn row(laboratory: &Laboratory, axons: u64, without_plain: &mut Option<String>) -> Result<Row, RunError> {
    let loaded = laboratory.load(&[], &[format!("{KEY}={axons}")])?;
    let name = format!("{} with {KEY}={axons}", loaded.scene.name);
    laboratory.room.admit(&name, &outlook(&loaded.scene), 1)?;
    let repetitions = if axons > MOST_REPEATED { 1 } else { laboratory.repetitions };
    let (mut own, mut plain, mut difference) = (Timings::default(), Timings::default(), None);
    let (mut last, mut bytes) = (None, None);
    for _ in 0..repetitions {
        drop(last.take());
        let timed = run(laboratory, (&name, &loaded))?;
        own.push(cone_seconds(&timed.phases), timed.busy);
        // What one run has given back, the next takes again: the first tells.
        bytes = bytes.or(timed.bytes);
        if axons <= MOST_PLAIN {
            match run_plain(laboratory, (axons, &loaded), &timed.simulation)? {
                Ok(timed) => {
                    plain.push(timed.seconds, timed.busy);
                    difference = Some(timed.apart);
                }
                Err(reason) => *without_plain = Some(reason),
            }
        }
        last = Some(timed);
    }
    let timed = last.ok_or_else(|| RunError::Internal("nothing was timed".into()))?;
    let seconds = own.wall().ok_or_else(|| RunError::Internal("nothing was timed".into()))?;
    let (plain_seconds, cpu_seconds) = (plain.wall(), own.cpu());
    let ratio = match cpu_seconds.zip(plain.cpu()) {
        Some((own, plain)) => Some(own / plain),
        None => plain_seconds.map(|plain| seconds.median / plain.median),
    };
    let Timed { simulation, phases, marks, .. } = timed;
    let world = simulation.world();
    let Counters { cone_steps, .. } = simulation.counters();
    let cone_hours = cone_steps as f64 * loaded.scene.time.step.0;
    let scenery_seconds: f64 = phases.iter().filter(|(phase, _)| SCENERY.contains(phase)).map(|(_, s)| s).sum();
    let own_phases = phases.iter().filter(|(phase, _)| !SCENERY.contains(phase));
    let total = cone_seconds(&phases).max(f64::MIN_POSITIVE);
    Ok(Row {
        axons,
        cone_steps,
        cone_hours,
        seconds,
        cpu_seconds,
        scenery_seconds,
        plain_seconds,
        ratio,
        difference,
        cone_steps_a_second: cone_steps as f64 / seconds.median,
        cone_hours_a_second: cone_hours / seconds.median,
        cone_steps_a_cpu_second: cpu_seconds.map(|seconds| cone_steps as f64 / seconds),
        cone_hours_a_cpu_second: cpu_seconds.map(|seconds| cone_hours / seconds),
        cone_hours_a_second_with_scenery: cone_hours / (seconds.median + scenery_seconds),
        growth_in_steps: fitted_power(&marks).unwrap_or(f64::NAN),
        bytes_an_axon: bytes.map(|bytes| bytes / axons as f64),
        vertices_an_axon: world.resource::<Shafts>().vertex_count() as f64 / axons as f64,
        share: own_phases.map(|(phase, s)| ((*phase).to_owned(), s / total)).collect(),
    })
}

fn cone_seconds(phases: &BTreeMap<&'static str, f64>) -> f64 {
    phases.iter().filter(|(phase, _)| !SCENERY.contains(phase)).map(|(_, seconds)| seconds).sum()
}

/// Assembles a scene and runs it to its end.
fn run(laboratory: &Laboratory, (name, loaded): (&str, &Loaded)) -> Result<Timed, RunError> {
    let before = memory_mib("VmRSS:");
    let busy = Busy::begin();
    let mut simulation = laboratory.assemble(loaded)?;
    laboratory.room.admit(name, &memory_of(&simulation, loaded, Records::NOTHING)?, 1)?;
    simulation.lap("plan");
    let end = simulation.world().resource::<Clock>().end;
    let mut marks = Vec::new();
    let mut next = 1;
    while !simulation.is_over() {
        simulation.step().map_err(|fault| RunError::Solve(fault.to_string()))?;
        if simulation.world().resource::<Clock>().now as f64 >= end as f64 * next as f64 / LOOKS as f64 {
            let seconds = cone_seconds(simulation.world().resource::<Stopwatch>().seconds());
            marks.push([simulation.counters().cone_steps as f64, seconds]);
            next += 1;
        }
    }
    simulation.lap("record");
    let bytes = memory_mib("VmRSS:").zip(before).map(|(after, before)| (after - before) * MIB);
    let phases = simulation.world().resource::<Stopwatch>().seconds().clone();
    Ok(Timed { simulation, phases, marks, bytes, busy: busy.threads() })
}

/// Runs the plain loop beside a simulation that is over, or says why it cannot.
fn run_plain(
    laboratory: &Laboratory,
    (axons, loaded): (u64, &Loaded),
    simulation: &Simulation,
) -> Result<Result<TimedPlain, String>, RunError> {
    let duration = loaded.scene.time.duration.0;
    let late =
        |name: &String| format!("/populations{}/births={{\"at\": {}}}", pointer_token(name), duration * (1.0 - 1e-9));
    let births: Vec<String> = loaded.scene.populations.keys().map(late).collect();
    let empty = laboratory.load(&[], &[births, vec![format!("{KEY}={axons}")]].concat())?;
    let mut stage = laboratory.assemble(&empty)?;
    let mut plain = match PlainLoop::new(loaded, simulation.world(), stage.world()) {
        Ok(plain) => plain,
        Err(reason) => return Ok(Err(reason)),
    };
    let busy = Busy::begin();
    plain.run(&mut stage);
    let busy = busy.threads();
    stage.look_at(simulation.time());
    let (mesh, now) = (&plain.tissue().mesh, stage.world().resource::<Configuration>());
    let ends = plain.sites().map(|site| now.position(mesh, site));
    let apart = cones(simulation).iter().zip(ends).map(|(cone, end)| (cone.position - end).norm()).fold(0.0, f64::max);
    Ok(Ok(TimedPlain { seconds: plain.seconds(), busy, apart }))
}

/// The power p of y ~ x^p through some points.
fn fitted_power(points: &[[f64; 2]]) -> Option<f64> {
    slope(&points.iter().map(|point| point.map(f64::ln)).collect::<Vec<_>>())
}
