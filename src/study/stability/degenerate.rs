//! Map: degenerate scenes, run as any scene is: how each ends, what is said, and whether a number was lost on the way.

use super::degenerate_scenes::{Case, scenes};
use crate::model::mechanism::Roster;
use crate::record::summary::Counts;
use crate::study::run::{Records, RunError, read_document, simulate};
use rayon::prelude::*;
use serde::Serialize;

/// How a scene ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// At its end.
    Complete,
    /// Early, by a fault.
    Fault,
    /// Before its first step: something could not be solved.
    Unsolved,
    /// Not read: the scenario is at fault.
    Refused,
}

/// What came of one scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the scene.
    pub name: &'static str,
    /// What is degenerate.
    pub about: &'static str,
    /// How it ended.
    pub end: End,
    /// The account of an early end.
    pub account: Option<String>,
    /// Notes of the summary.
    pub notes: Vec<String>,
    /// How many axons are in which state.
    pub counts: Option<Counts>,
    /// Largest relative drift of |v_g|.
    pub speed_drift: Option<f64>,
    /// Entries missing in the trajectories: numbers that were not finite.
    pub holes: usize,
    /// The path of each axon: time (h), x and y (µm).
    pub paths: Vec<Vec<[f64; 3]>>,
}

/// The map of degenerate scenes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DegenerateMap {
    /// One entry a scene.
    pub scenes: Vec<Outcome>,
}

/// Runs every scene with the mechanisms of a roster that has the constant pull.
pub fn compute(roster: &Roster) -> DegenerateMap {
    DegenerateMap { scenes: scenes().into_par_iter().map(|case| run(case, roster)).collect() }
}

/// Runs one scene.
pub fn run(case: Case, roster: &Roster) -> Outcome {
    let mut outcome = Outcome {
        name: case.name,
        about: case.about,
        end: End::Complete,
        account: None,
        notes: Vec::new(),
        counts: None,
        speed_drift: None,
        holes: 0,
        paths: Vec::new(),
    };
    let finished = read_document(case.name, case.scene, roster)
        .map_err(RunError::from)
        .and_then(|loaded| simulate(&loaded, roster, case.name.as_ref(), Records::TRAJECTORIES, |_| {}));
    match finished {
        Ok(finished) => {
            let summary = finished.summary;
            if !summary.complete {
                outcome.end = End::Fault;
            }
            outcome.account = summary.fault;
            outcome.notes = summary.notes;
            outcome.counts = Some(summary.counts);
            outcome.speed_drift = Some(summary.speed_drift);
            (outcome.holes, outcome.paths) = read_paths(finished.recorder.trajectories.as_str());
        }
        Err(error) => {
            outcome.end = if matches!(error, RunError::Scenario(_)) { End::Refused } else { End::Unsolved };
            outcome.account = Some(error.to_string());
        }
    }
    outcome
}

/// Missing entries, and the path of each axon, in a table of trajectories.
fn read_paths(table: &str) -> (usize, Vec<Vec<[f64; 3]>>) {
    let (mut holes, mut paths) = (0, Vec::new());
    for line in table.lines().skip(1) {
        let entries: Vec<&str> = line.split(',').collect();
        let number = |i: usize| entries.get(i).and_then(|text| text.trim().parse::<f64>().ok());
        let missing = [0, 1, 3, 4, 5].iter().filter(|&&i| number(i).is_none_or(|x| !x.is_finite())).count();
        holes += missing;
        if let (Some(time), Some(axon), Some(x), Some(y)) = (number(0), number(1), number(3), number(4)) {
            let axon = axon as usize;
            if paths.len() <= axon {
                paths.resize_with(axon + 1, Vec::new);
            }
            paths[axon].push([time, x, y]);
        }
    }
    (holes, paths)
}

impl DegenerateMap {
    /// The outcome of a scene.
    pub fn scene(&self, name: &str) -> Option<&Outcome> {
        self.scenes.iter().find(|outcome| outcome.name == name)
    }
}

impl Outcome {
    /// Where the first axon ended (µm).
    pub fn last(&self) -> Option<[f64; 2]> {
        self.paths.first()?.last().map(|[_, x, y]| [*x, *y])
    }

    /// Time (h) and distance (µm) from a point, along the first axon.
    pub fn distances_from(&self, [x, y]: [f64; 2]) -> Vec<[f64; 2]> {
        let path = self.paths.first().map(Vec::as_slice).unwrap_or_default();
        path.iter().map(|[time, px, py]| [*time, (px - x).hypot(py - y)]).collect()
    }

    /// Time (h) and distance (µm) between the first two axons while both are there.
    pub fn gap(&self) -> Vec<[f64; 2]> {
        let [first, second, ..] = self.paths.as_slice() else { return Vec::new() };
        let at = |[time, x, y]: &[f64; 3]| {
            let nearest = first.iter().map(|[_, px, py]| (px - x).hypot(py - y)).fold(f64::INFINITY, f64::min);
            [*time, nearest]
        };
        second.iter().map(at).collect()
    }
}
