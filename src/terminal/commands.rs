//! What the commands do, but for a single run.

use super::arguments::{Cli, SceneArguments};
use super::interrupt::Interrupt;
use super::manners::{alarming, progress_bar};
use super::voice::{alarm, bytes_out, note, say, tell};
use crate::model::mechanism::Roster;
use crate::new_mechanism::{NewMechanism, NewMechanismError};
use crate::record::checkpoint;
use crate::record::earlier;
use crate::record::manifest::Manifest;
use crate::record::output::prepare_folder;
use crate::scenario::catalogue::Catalogue;
use crate::scenario::load::Loaded;
use crate::scenario::schema::top_keys;
use crate::study::ablation::{self, Extent};
use crate::study::bench;
use crate::study::chart;
use crate::study::estimate::yardstick;
use crate::study::laboratory::Laboratory;
use crate::study::plan::plan;
use crate::study::report::Asked;
use crate::study::room::Room;
use crate::study::run::{
    RunError, TRAJECTORIES, block_schemas, folder_of, write_figure, write_json, write_pooled_figure,
};
use crate::study::seeds::{SeedsSummary, over_seeds_until, summarise};
use crate::study::stability::Stability;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Prints the plan of a scene.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn run_plan(scene: &SceneArguments, json: bool, roster: &Roster) -> Result<ExitCode, RunError> {
    let mut loaded = scene.load(roster)?;
    if scene.memory != Room::Any {
        // What `--memory` would refuse is told; only what is not there stops the plan itself.
        loaded.room = Room::Free.beside(&loaded.scene);
    }
    let mut found = plan(&loaded, roster, &scene.path())?;
    found.pace = yardstick::pace();
    let admitted = scene.memory.admit(&found.scene, &found.memory_mb, 1);
    found.notes.extend(admitted.err().map(|refusal| refusal.to_string()));
    if json {
        return print_json(&found);
    }
    say!("{}", found.to_string().trim_end());
    found.notes.iter().for_each(|note| note!("note: {note}"));
    Ok(ExitCode::SUCCESS)
}

/// Lets a scene through of which as many runs fit as threads would have at once, of `count` in all; also one that cannot be assembled, so
/// that its runs tell why.
///
/// # Errors
/// A scene so many runs of which do not fit.
fn admit_many(scene: &SceneArguments, loaded: &Loaded, roster: &Roster, count: u64) -> Result<(), RunError> {
    if scene.memory == Room::Any {
        return Ok(());
    }
    let at_once = (rayon::current_num_threads() as u64).min(count) as usize;
    let Ok(planned) = plan(loaded, roster, &scene.path()) else { return Ok(()) };
    scene.memory.admit(&loaded.scene.name, &planned.memory_mb, at_once)
}

/// Prints a value as JSON.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn print_json(value: &impl Serialize) -> Result<ExitCode, RunError> {
    let text = serde_json::to_string_pretty(value).map_err(|error| RunError::Internal(error.to_string()))?;
    say!("{text}");
    Ok(ExitCode::SUCCESS)
}

pub fn print_bytes(bytes: &[u8]) -> Result<ExitCode, RunError> {
    bytes_out(bytes);
    Ok(ExitCode::SUCCESS)
}

/// Prints the catalogue, or a part of it.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn list_mechanisms(name: Option<&str>, json: bool, roster: &Roster) -> Result<ExitCode, RunError> {
    let mut found = Catalogue::of(&block_schemas(roster));
    if let Some(name) = name {
        found = found.only(name).map_err(RunError::Arguments)?;
    }
    if json {
        return print_json(&found);
    }
    say!("{}", found.to_string().trim_end());
    Ok(ExitCode::SUCCESS)
}

/// Writes the crate of a new mechanism, and says what to do with it.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn new_mechanism(name: &str, parent: &Path, sources: Option<&Path>, roster: &Roster) -> Result<ExitCode, RunError> {
    let taken = top_keys(&block_schemas(roster));
    let written = NewMechanism { name, parent, sources, taken: &taken }.write().map_err(|error| match error {
        NewMechanismError::Refused(message) => RunError::Arguments(message),
        NewMechanismError::Write(error) => RunError::Write(error),
    })?;
    let folder = written.folder.display();
    say!("{folder}: {}", written.files.join(", "));
    say!("It depends on tropism in {}, and shares the dependencies compiled there.", written.sources.display());
    say!("\nNext:\n  cd {folder}\n  cargo test --release");
    say!("  cargo run --release -- scenarios/{name}.json      draws out/{name}/figure.png");
    say!("  cargo run --release -- ablate scenarios/{name}.json --seeds 4\nThen change src/{name}.rs.");
    Ok(ExitCode::SUCCESS)
}

/// Ablates a scene.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn run_ablation(
    cli: &Cli,
    scene: &SceneArguments,
    out: Option<&PathBuf>,
    extent: Extent,
    roster: &Roster,
) -> Result<ExitCode, RunError> {
    let loaded = scene.load(roster)?;
    admit_many(scene, &loaded, roster, u64::MAX)?;
    let folder = folder_of(out, &format!("{}-ablation", loaded.scene.name));
    let _claim = prepare_folder(&folder)?;
    let bar = progress_bar(100.0, "%");
    let tick = |share| bar.set_position((share * 1000.0) as u64);
    let interrupt = Interrupt::catch().map_err(|error| RunError::Internal(error.to_string()))?;
    let stop = || interrupt.caught().map(|signal| format!("stopped by {}", signal.name));
    let found = ablation::ablate(&loaded, roster, &scene.path(), extent, (tick, stop))?;
    bar.finish_and_clear();
    let signal = interrupt.caught().filter(|_| !found.complete);
    if let Some(signal) = signal {
        alarm!("{} stopped by {}: the table has the runs that came to their end", alarming("error:"), signal.name);
    }
    ablation::report::write(&folder, Asked { loaded: &loaded, command: &cli.words }, &found)?;
    tell!("{}", found.to_string().trim_end());
    tell!("results in {}", folder.display());
    Ok(ExitCode::from(signal.map_or(u8::from(!found.complete), |signal| signal.code)))
}

/// Charts a scene.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn run_chart(
    cli: &Cli,
    laboratory: &Laboratory,
    out: Option<&PathBuf>,
    only: &[String],
) -> Result<ExitCode, RunError> {
    let loaded = laboratory.scene()?;
    let name = format!("{}-chart", loaded.scene.name);
    let folder = folder_of(out, &name);
    let _claim = prepare_folder(&folder)?;
    let bar = progress_bar(100.0, "%");
    let chart = chart::chart(laboratory, only, &|share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    chart::report::write(&folder, Asked { loaded: &loaded, command: &cli.words }, &chart)?;
    for factor in &chart.factors {
        tell!("{}\n  {}", factor.title, factor.advice);
        for power in factor.growth().iter().filter(|_| factor.errors.is_empty()) {
            tell!("  time grows with the power {:.2} ({}, {} points)", power.order, power.method, power.points);
        }
        for error in &factor.errors {
            for slope in factor.slopes(error) {
                tell!("  {}: order {:.2} ({}, {} points)", error.name, slope.order, slope.method, slope.points);
            }
        }
    }
    tell!("results in {}", folder.display());
    Ok(ExitCode::SUCCESS)
}

/// Times a scene at several sizes.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn run_bench(laboratory: &Laboratory, out: Option<&PathBuf>, axons: &[u64]) -> Result<ExitCode, RunError> {
    let folder = folder_of(out, &format!("{}-bench", laboratory.scene()?.scene.name));
    let _claim = prepare_folder(&folder)?;
    let bar = progress_bar(100.0, "%");
    let found = bench::bench(laboratory, axons, &|share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    bench::report::write(&folder, &found)?;
    tell!("{}", found.to_string().trim_end());
    tell!("results in {}", folder.display());
    Ok(ExitCode::SUCCESS)
}

/// Maps where methods fail.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn run_stability(folder: &Path, roster: &Roster) -> Result<ExitCode, RunError> {
    let _claim = prepare_folder(folder)?;
    let bar = progress_bar(100.0, "%");
    let maps = Stability::compute(roster, |share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    maps.write(folder)?;
    tell!("results in {}", folder.display());
    Ok(ExitCode::SUCCESS)
}

/// Runs a scene over seeds.
///
/// # Errors
/// Why there are no results, or not all of them.
pub fn run_seeds(cli: &Cli, roster: &Roster, loaded: &Loaded, folder: &Path, count: u64) -> Result<ExitCode, RunError> {
    admit_many(&cli.scene, loaded, roster, count)?;
    let interrupt = Interrupt::catch().map_err(|error| RunError::Internal(error.to_string()))?;
    earlier::clear(folder, &cli.scene.path())?;
    checkpoint::remove(folder)?;
    let bar = progress_bar(count as f64, "seeds");
    let tick = |share| bar.set_position((share * 1000.0) as u64);
    let stop = || interrupt.caught().map(|signal| signal.name.to_owned());
    let mut runs = over_seeds_until(loaded, roster, &cli.scene.path(), count, (tick, stop))?;
    bar.finish_and_clear();
    let signal = interrupt.caught().filter(|_| (runs.len() as u64) < count);
    if let Some(signal) = signal {
        let words = format!("stopped by {}: {} of {count} seeds came to their end", signal.name, runs.len());
        alarm!("{} {words}", alarming("error:"));
        if runs.is_empty() {
            return Ok(ExitCode::from(signal.code));
        }
    }
    let found = summarise(loaded, &runs)?;
    let summary = SeedsSummary { complete: found.complete && signal.is_none(), ..found };
    write_json(&folder.join("summary.json"), &summary)?;
    write_json(&folder.join("manifest.json"), &Manifest::of(loaded))?;
    if let Some(first) = runs.first_mut() {
        if loaded.scene.output.tables.are_csv() {
            first.recorder.trajectories.write(&folder.join(TRAJECTORIES))?;
        }
        write_figure(folder, loaded, &first.recorder.snapshots)?;
        write_pooled_figure(folder, loaded, &runs)?;
    }
    tell!("{}: {} seeds; mean [95 % bootstrap interval]", summary.scene, runs.len());
    for (name, value) in &summary.measures {
        let interval = value.low.zip(value.high).map_or(String::new(), |(l, h)| format!(" [{l:.4}, {h:.4}]"));
        tell!("  {name}: {:.4}{interval}", value.mean);
    }
    tell!("results in {}", folder.display());
    Ok(ExitCode::from(signal.map_or(u8::from(!summary.complete), |signal| signal.code)))
}
