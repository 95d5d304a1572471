//! Ablation: the full model beside itself without each mechanism of the scene, and without each pair, with the same random
//! numbers.
//!
//! An *arm* is the scene without some of its blocks. Births, noise and every other draw depend on seed and axon alone, so arms are
//! paired by seed: what differs is the mechanism's. The mechanisms are those of the roster that the scene has a block for.
//! Runs of equal tissue, matrix and demanded cues share what is solved before the first step ([`Shelf`]).

mod figure;
pub mod report;
mod table;

use super::run::{Records, Run, RunError, read_document};
use super::seeds::{bootstrap, in_parallel, leaves};
use crate::model::health::Counters;
use crate::model::mechanism::Roster;
use crate::model::quantity::Factor;
use crate::model::shelf::Shelf;
use crate::record::recording::Recording;
use crate::record::snapshot::Snapshot;
use crate::record::statistics::SummaryOverSeeds;
use crate::scenario::load::{Loaded, ScenarioErrors};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the arm that has every mechanism.
pub const FULL: &str = "full model";

/// `ablation.json`: all arms of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct Ablation {
    /// Name of the scene.
    pub scene: String,
    /// The seeds, the same in each arm.
    pub seeds: Vec<u64>,
    /// Heights at which spread and fascicles are measured, as shares of the tissue's height; `heights.0…` in the measures.
    pub heights: Vec<f64>,
    /// Whether every run came to its end. Arms that are skipped do not count.
    pub complete: bool,
    /// Runs made.
    pub runs: usize,
    /// What was solved before first steps, in all runs together.
    pub solved: Solved,
    /// The full model, then each mechanism off alone, in the order of the roster, then pairs.
    pub arms: Vec<Arm>,
}

/// How often something was solved, in all runs together that could be put together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Solved {
    /// Equilibria of the matrix.
    pub matrix_solves: u64,
    /// Newton iterations of the matrix.
    pub newton_iterations: u64,
    /// Linear solves for cue fields.
    pub cue_solves: u64,
    /// Factorisations for cue fields.
    pub cue_factorisations: u64,
}

/// The scene without some mechanisms.
#[derive(Debug, Clone, Serialize)]
pub struct Arm {
    /// [`FULL`], or "without" and the names.
    pub name: String,
    /// The mechanisms left out.
    pub off: Vec<String>,
    /// Whether it was run and every run came to its end.
    pub complete: bool,
    /// Why it was not run: what the scene without these blocks has wrong, such as a block that needs one of them.
    pub skipped: Option<String>,
    /// Runs that did not come to their end. Their measures are left out.
    pub failures: Vec<Failure>,
    /// Each measure by its place in the summary of a run: mean over seeds and 95 % bootstrap interval.
    pub measures: BTreeMap<String, SummaryOverSeeds>,
    /// Arm minus full model, seed by seed: mean and 95 % bootstrap interval. Empty for the full model.
    pub differences: BTreeMap<String, SummaryOverSeeds>,
    /// The measures, one value a seed (`null` where a run has none).
    pub values: BTreeMap<String, Vec<Option<f64>>>,
    /// The end of the first seed's run, if it came there.
    #[serde(skip)]
    pub end: Option<Snapshot>,
    /// The first seed's run, if it came to its end and the scene has frames.
    #[serde(skip)]
    pub recording: Option<Recording>,
}

/// A run that did not come to its end.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// Its seed.
    pub seed: u64,
    /// What happened: an error while the scene was put together, or a fault while it ran.
    pub account: String,
}

/// What to run besides the scene itself.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Number of seeds, from the scene's own on.
    pub seeds: u64,
    /// Whether pairs of mechanisms are left out too.
    pub pairs: bool,
}

impl Arm {
    fn new(off: &[&str]) -> Self {
        let name = if off.is_empty() { FULL.to_owned() } else { format!("without {}", off.join(" and ")) };
        Self {
            name,
            off: off.iter().map(|name| (*name).to_owned()).collect(),
            complete: false,
            skipped: None,
            failures: Vec::new(),
            measures: BTreeMap::new(),
            differences: BTreeMap::new(),
            values: BTreeMap::new(),
            end: None,
            recording: None,
        }
    }

    /// Whether the interval of a measure's difference to the full model excludes zero.
    pub fn differs(&self, measure: &str) -> bool {
        let interval = self.differences.get(measure).and_then(|difference| difference.low.zip(difference.high));
        interval.is_some_and(|(low, high)| low > 0.0 || high < 0.0)
    }

    /// In a few words how the arm went.
    pub fn status(&self) -> &'static str {
        match (&self.skipped, self.complete) {
            (Some(_), _) => "skipped",
            (None, true) => "complete",
            (None, false) => "failed",
        }
    }

    /// Takes the run of seed number `place` of `count`.
    fn book(&mut self, (place, count): (usize, usize), seed: u64, run: Result<Ended, String>) {
        match run {
            Ok(ended) => {
                for (name, value) in ended.values {
                    self.values.entry(name).or_insert_with(|| vec![None; count])[place] = Some(value);
                }
                self.end = self.end.take().or(ended.end);
                self.recording = self.recording.take().or(ended.recording);
            }
            Err(account) => self.failures.push(Failure { seed, account }),
        }
    }

    fn summarise(&mut self, loaded: &Loaded, full: Option<&BTreeMap<String, Vec<Option<f64>>>>) {
        self.complete = self.skipped.is_none() && self.failures.is_empty();
        for (name, row) in &self.values {
            if let Some(summary) = SummaryOverSeeds::of_present(row, &mut bootstrap(loaded)) {
                self.measures.insert(name.clone(), summary);
            }
            let Some(control) = full.and_then(|full| full.get(name)) else { continue };
            let pairs = row.iter().zip(control).filter_map(|(own, control)| own.zip(*control));
            let (own, control): (Vec<f64>, Vec<f64>) = pairs.unzip();
            if let Some(difference) = SummaryOverSeeds::of_difference(&own, &control, &mut bootstrap(loaded)) {
                self.differences.insert(name.clone(), difference);
            }
        }
    }
}

/// What is kept of a run that came to its end.
struct Ended {
    values: Vec<(String, f64)>,
    end: Option<Snapshot>,
    recording: Option<Recording>,
}

/// The sets of mechanisms that are left out: none, each, and, if asked for, each pair; in the order of the roster.
fn sets<'n>(names: &[&'n str], pairs: bool) -> Vec<Vec<&'n str>> {
    let mut sets = vec![Vec::new()];
    sets.extend(names.iter().map(|name| vec![*name]));
    if pairs {
        let after = |(i, first): (usize, &&'n str)| {
            let first = *first;
            names[i + 1..].iter().map(move |second| vec![first, *second]).collect::<Vec<_>>()
        };
        sets.extend(names.iter().enumerate().flat_map(after));
    }
    sets
}

/// The scene without some of its blocks. What is taken out is the merged block, so that no `--set` brings it back.
fn without(loaded: &Loaded, off: &[&str], roster: &Roster, path: &Path) -> Result<Loaded, ScenarioErrors> {
    let mut document = loaded.merged.clone();
    if let Some(keys) = document.as_object_mut() {
        off.iter().for_each(|name| drop(keys.shift_remove(*name)));
    }
    let mut left = read_document(&path.display().to_string(), document, roster)?;
    left.remarks.clone_from(&loaded.remarks);
    Ok(left)
}

/// Runs all arms of a scene on the threads of the present pool. `tick` is called after each run with the share done; once `stop` gives a
/// reason, runs that are on their way or have not begun stand among the failures of their arms with it.
///
/// # Errors
/// Only what must not happen: a scene that is refused without some blocks, cannot be put together or ends in a fault is
/// reported in its arm, and the others are run.
pub fn ablate(
    loaded: &Loaded,
    roster: &Roster,
    path: &Path,
    extent: Extent,
    (tick, stop): (impl Fn(f64) + Sync, impl Fn() -> Option<String> + Sync),
) -> Result<Ablation, RunError> {
    let names: Vec<&str> = roster.names().into_iter().filter(|name| loaded.blocks.contains_key(*name)).collect();
    let (mut arms, mut scenes) = (Vec::new(), Vec::new());
    for off in sets(&names, extent.pairs) {
        let mut arm = Arm::new(&off);
        match without(loaded, &off, roster, path) {
            Ok(scene) => scenes.push((arms.len(), scene)),
            Err(refusal) => arm.skipped = Some(one_line(refusal.problems.iter().map(ToString::to_string))),
        }
        arms.push(arm);
    }
    let seeds: Vec<u64> = (0..extent.seeds).map(|place| loaded.scene.seed + place).collect();
    let shelf = Shelf::default();
    // Seed by seed, so that arms that solve different things do so side by side.
    let run = |job: usize| {
        if let Some(reason) = stop() {
            return (Err(reason), Counters::default());
        }
        let mut own = scenes[job % scenes.len()].1.clone();
        let place = job / scenes.len();
        own.scene.seed = seeds[place];
        own.scene.output.figure_times = if place == 0 { vec![Factor(1.0)] } else { Vec::new() };
        let keep = if place == 0 { Records::FRAMES } else { Records::NOTHING };
        run_one((&own, &shelf), roster, path, (keep, &stop))
    };
    let runs = in_parallel(scenes.len() * seeds.len(), run, tick);
    let (mut solved, count) = (Solved::default(), runs.len());
    for (job, run) in runs.into_iter().enumerate() {
        let (place, arm) = (job / scenes.len(), scenes[job % scenes.len()].0);
        let (ended, counters) = run.unwrap_or_else(|| (Err("the run was lost".into()), Counters::default()));
        solved.add(&counters);
        arms[arm].book((place, seeds.len()), seeds[place], ended);
    }
    let full = arms.first().map(|arm| arm.values.clone()).unwrap_or_default();
    for arm in &mut arms {
        let control = (!arm.off.is_empty()).then_some(&full);
        arm.summarise(loaded, control);
    }
    Ok(Ablation {
        scene: loaded.scene.name.clone(),
        heights: loaded.scene.output.heights.iter().map(|share| share.0).collect(),
        complete: arms.iter().all(|arm| arm.failures.is_empty()),
        runs: count,
        solved,
        seeds,
        arms,
    })
}

fn run_one(
    scene: (&Loaded, &Shelf),
    roster: &Roster,
    path: &Path,
    (keep, stop): (Records, &impl Fn() -> Option<String>),
) -> (Result<Ended, String>, Counters) {
    let run = || {
        let mut run = Run::begin_from(scene, roster, path, keep)?;
        let ended = run.to_end(|_| stop())?;
        run.finish(scene.0, &ended)
    };
    let finished = match run() {
        Ok(finished) => finished,
        Err(error) => return (Err(one_line(error.to_string().lines())), Counters::default()),
    };
    let summary = finished.summary;
    let counters = summary.cost.counters;
    let ended = match &summary.fault {
        Some(fault) => Err(format!("the run ended {fault}")),
        None => leaves(&summary)
            .map(|values| {
                let (end, recording) = (finished.recorder.snapshots.into_iter().next_back(), finished.recording);
                Ended { values, end, recording }
            })
            .map_err(|error| error.to_string()),
    };
    (ended, counters)
}

fn one_line(parts: impl Iterator<Item = impl AsRef<str>>) -> String {
    parts.map(|part| part.as_ref().trim().to_owned()).collect::<Vec<_>>().join("; ")
}

impl Solved {
    fn add(&mut self, counters: &Counters) {
        self.matrix_solves += counters.matrix_solves;
        self.newton_iterations += counters.newton_iterations;
        self.cue_solves += counters.cue_solves;
        self.cue_factorisations += counters.cue_factorisations;
    }
}
