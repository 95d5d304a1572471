//! Paired runs of one scene over several seeds: the seed is the unit of statistics.

use super::run::{Ended, Finished, Records, Run, RunError};
use crate::model::mechanism::Roster;
use crate::model::random::{KeyedRng, Stream};
use crate::record::leaves;
use crate::record::statistics::SummaryOverSeeds;
use crate::record::summary::Summary;
use crate::scenario::load::Loaded;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// `summary.json` of a run over seeds.
#[derive(Debug, Clone, Serialize)]
pub struct SeedsSummary {
    /// Name of the scene.
    pub scene: String,
    /// The seeds.
    pub seeds: Vec<u64>,
    /// Whether every run came to its end.
    pub complete: bool,
    /// Each measure by its place in the summary of a run: mean over seeds and 95 % bootstrap interval of the mean.
    pub measures: BTreeMap<String, SummaryOverSeeds>,
    /// The same measures, one value a seed (`null` where a run has none).
    pub values: BTreeMap<String, Vec<Option<f64>>>,
    /// The summary of each run.
    pub runs: Vec<Summary>,
}

/// Runs a scene for `count` seeds from its own seed on; runs come back in the order of their seeds. Only the first
/// keeps its trajectories.
///
/// # Errors
/// The first seed's error, if any run could not be assembled.
pub fn over_seeds(
    loaded: &Loaded,
    roster: &Roster,
    path: &Path,
    count: u64,
    tick: impl Fn(f64) + Sync,
) -> Result<Vec<Finished>, RunError> {
    over_seeds_until(loaded, roster, path, count, (tick, || None))
}

/// As [`over_seeds`], until `stop` gives a reason: runs that are then on their way, or have not begun, are left out.
///
/// # Errors
/// As [`over_seeds`].
pub fn over_seeds_until(
    loaded: &Loaded,
    roster: &Roster,
    path: &Path,
    count: u64,
    (tick, stop): (impl Fn(f64) + Sync, impl Fn() -> Option<String> + Sync),
) -> Result<Vec<Finished>, RunError> {
    let run = |place: usize| {
        if stop().is_some() {
            return Ok(None);
        }
        let mut own = loaded.clone();
        own.scene.seed += place as u64;
        let mut run =
            Run::begin(&own, roster, path, if place == 0 { Records::TRAJECTORIES } else { Records::NOTHING })?;
        let ended = run.to_end(|_| stop())?;
        (!matches!(ended, Ended::Stopped(_))).then(|| run.finish(&own, &ended)).transpose()
    };
    let runs = in_parallel(count as usize, run, tick).into_iter();
    let runs = runs.map(|run| run.unwrap_or_else(|| Err(RunError::Internal("a run was lost".into()))));
    Ok(runs.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

/// Does `count` pieces of work, each on one thread, as many at once as the present pool has threads. Results come back in the
/// order of their numbers; one is none if its thread was lost.
pub fn in_parallel<T: Send>(
    count: usize,
    work: impl Fn(usize) -> T + Sync,
    tick: impl Fn(f64) + Sync,
) -> Vec<Option<T>> {
    let threads = rayon::current_num_threads().min(count).max(1);
    let (next, done) = (AtomicUsize::new(0), AtomicU64::new(0));
    let slots: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let take_work = || {
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(slot) = slots.get(place) else { break };
            let result = work(place);
            *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
            tick((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                Ok(pool) => pool.install(take_work),
                Err(_) => take_work(),
            });
        }
    });
    slots.into_iter().map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// Puts the runs together.
///
/// # Errors
/// A summary that is no JSON.
pub fn summarise(loaded: &Loaded, runs: &[Finished]) -> Result<SeedsSummary, RunError> {
    let mut values: BTreeMap<String, Vec<Option<f64>>> = BTreeMap::new();
    for (place, run) in runs.iter().enumerate() {
        for (name, value) in leaves(&run.summary)? {
            let row = values.entry(name).or_insert_with(|| vec![None; runs.len()]);
            row[place] = Some(value);
        }
    }
    let mut measures = BTreeMap::new();
    for (name, row) in &values {
        if let Some(summary) = SummaryOverSeeds::of_present(row, &mut bootstrap(loaded)) {
            measures.insert(name.clone(), summary);
        }
    }
    Ok(SeedsSummary {
        scene: loaded.scene.name.clone(),
        seeds: runs.iter().map(|run| run.summary.seed).collect(),
        complete: runs.iter().all(|run| run.summary.complete),
        measures,
        values,
        runs: runs.iter().map(|run| run.summary.clone()).collect(),
    })
}

/// The draws of a bootstrap: the same for every measure of a scene.
pub(super) fn bootstrap(loaded: &Loaded) -> KeyedRng {
    KeyedRng::new(loaded.scene.seed, 0, Stream::named("bootstrap"), 0)
}

/// All numbers of counts and morphology, by their dotted place.
pub(super) fn leaves(summary: &Summary) -> Result<Vec<(String, f64)>, RunError> {
    leaves::leaves(&summary.counts, &summary.morphology).map_err(|error| RunError::Internal(error.to_string()))
}
