//! One run: a scenario in, a folder of results out.

use crate::model::clock::Clock;
use crate::model::health::Fault;
use crate::model::mechanism::{Entry, Facts, Roster};
use crate::model::shelf::Shelf;
use crate::model::violation::Violation;
use crate::record::manifest::Manifest;
use crate::record::output::{WriteError, write_atomically};
use crate::record::png::{PngError, scale_for_dpi, to_png};
use crate::record::recorder::{Recorder, RecorderOptions};
use crate::record::scene_figure::FigureError;
use crate::record::scene_view::scene_figure;
use crate::record::snapshot::Snapshot;
use crate::record::summary::{Summary, SummaryOptions};
use crate::record::svg::Svg;
use crate::scenario::load::{Loaded, Request, ScenarioErrors, load, load_document};
use crate::scenario::schema::{BlockFindings, BlockSchema};
use crate::simulation::{AssemblyError, Simulation};
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Resolution of pictures, dots an inch.
pub(super) const DPI: f32 = 200.0;

/// Why there are no results, or not all of them.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scenario is at fault.
    #[error("{0}")]
    Scenario(#[from] ScenarioErrors),
    /// Something could not be solved before the first step.
    #[error("{0}")]
    Solve(String),
    /// What was asked for does not exist or cannot be.
    #[error("{0}")]
    Arguments(String),
    /// A file could not be written.
    #[error("{0}")]
    Write(#[from] WriteError),
    /// The picture could not be drawn.
    #[error("the figure could not be drawn: {0}")]
    Picture(#[from] PngError),
    /// The picture has nothing to show.
    #[error("the figure could not be drawn: {0}")]
    Figure(#[from] FigureError),
    /// Something that must not happen.
    #[error("internal: {0}")]
    Internal(String),
}

/// What a finished run leaves in memory.
pub struct Finished {
    /// `summary.json`.
    pub summary: Summary,
    /// Trajectories and snapshots.
    pub recorder: Recorder,
}

/// Reads a scenario for a roster.
///
/// # Errors
/// All problems of the file at once.
pub fn read(request: &Request, roster: &Roster) -> Result<Loaded, ScenarioErrors> {
    load(request, &block_schemas(roster))
}

/// Reads a scenario that is a value in memory called `name`, for a roster.
///
/// # Errors
/// All problems of the value at once.
pub fn read_document(name: &str, value: Value, roster: &Roster) -> Result<Loaded, ScenarioErrors> {
    load_document(name, value, &block_schemas(roster))
}

/// The schema and the checks of every mechanism of a roster.
pub fn block_schemas(roster: &Roster) -> Vec<BlockSchema> {
    let block = |entry: &Entry| {
        let (entry, materials) = (*entry, roster.materials().clone());
        BlockSchema::new(entry.name, roster.schema(&entry)).checked_by(move |value, facts| match (entry.read)(value) {
            Ok(law) => {
                let facts = &Facts { materials: materials.clone(), ..facts.clone() };
                let shapes = law.outlines().into_iter().map(|(name, shape)| (format!("/{name}"), shape)).collect();
                BlockFindings { violations: law.check(facts), shapes }
            }
            Err(message) => BlockFindings { violations: Violation::new("", message).into(), shapes: Vec::new() },
        })
    };
    roster.entries.iter().map(block).collect()
}

/// Runs a loaded scene to its end, or to the fault that ends it. `tick` is called after each step with the share done.
///
/// # Errors
/// A scene that cannot be assembled. A fault while running is no error: it stands in the summary.
pub fn simulate(
    loaded: &Loaded,
    roster: &Roster,
    path: &Path,
    keep_trajectories: bool,
    tick: impl FnMut(f64),
) -> Result<Finished, RunError> {
    simulate_from((loaded, &Shelf::default()), roster, path, keep_trajectories, tick)
}

/// As [`simulate`], with a shelf of what other runs have solved.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_from(
    (loaded, shelf): (&Loaded, &Shelf),
    roster: &Roster,
    path: &Path,
    keep_trajectories: bool,
    mut tick: impl FnMut(f64),
) -> Result<Finished, RunError> {
    let mut simulation = Simulation::assemble_from(loaded, roster, shelf).map_err(|error| run_error(error, path))?;
    let clock = *simulation.world().resource::<Clock>();
    let mut recorder = Recorder::new(&recorder_options(loaded, keep_trajectories), &clock.grid, clock.end);
    let fault = run_to_end(&mut simulation, &mut recorder, &mut tick)?;
    simulation.bring_tissue_here();
    let output = &loaded.scene.output;
    let options = SummaryOptions {
        scene: loaded.scene.name.clone(),
        seed: loaded.scene.seed,
        heights: output.heights.iter().map(|share| share.0).collect(),
        linkage: output.linkage_distance.0,
    };
    let summary = Summary::of(simulation.world(), &options, fault.as_ref());
    Ok(Finished { summary, recorder })
}

/// Puts a scene together and solves what must be solved before the first step.
///
/// # Errors
/// A scene that cannot be assembled.
pub fn assembled(loaded: &Loaded, roster: &Roster, path: &Path) -> Result<Simulation, RunError> {
    Simulation::assemble(loaded, roster).map_err(|error| run_error(error, path))
}

fn run_error(error: AssemblyError, path: &Path) -> RunError {
    match error {
        AssemblyError::Scenario(problems) => RunError::Scenario(ScenarioErrors { path: path.to_owned(), problems }),
        AssemblyError::Solve(account) => RunError::Solve(account),
    }
}

pub(super) fn recorder_options(loaded: &Loaded, keep_trajectories: bool) -> RecorderOptions {
    let (output, duration) = (&loaded.scene.output, loaded.scene.time.duration.0);
    RecorderOptions {
        trajectory_interval: keep_trajectories.then_some(output.trajectory_interval.0),
        figure_times: output.figure_times.iter().map(|share| share.0 * duration).collect(),
    }
}

fn run_to_end(
    simulation: &mut Simulation,
    recorder: &mut Recorder,
    tick: &mut impl FnMut(f64),
) -> Result<Option<Fault>, RunError> {
    loop {
        let now = simulation.world().resource::<Clock>().now;
        if recorder.is_due(now) {
            simulation.bring_tissue_here();
            recorder.observe(simulation.world()).map_err(|error| RunError::Internal(error.to_string()))?;
            simulation.lap("record");
        }
        if simulation.is_over() {
            return Ok(None);
        }
        if let Err(fault) = simulation.step() {
            recorder.snapshots.push(Snapshot::of(simulation.world()));
            return Ok(Some(fault));
        }
        tick(simulation.progress());
    }
}

/// Writes everything a single run leaves, into `folder`.
///
/// # Errors
/// The file that could not be written, or the picture that could not be drawn.
pub fn write_results(folder: &Path, loaded: &Loaded, finished: &Finished) -> Result<(), RunError> {
    write_json(&folder.join("summary.json"), &finished.summary)?;
    write_json(&folder.join("manifest.json"), &Manifest::of(loaded))?;
    let Recorder { trajectories, snapshots, .. } = &finished.recorder;
    let (table, figure) = rayon::join(
        || trajectories.write(&folder.join("trajectories.csv")),
        || write_figure(folder, loaded, snapshots),
    );
    table?;
    figure
}

/// Writes `figure.svg` and `figure.png`; nothing if no time was asked for.
///
/// # Errors
/// As [`write_results`].
pub fn write_figure(folder: &Path, loaded: &Loaded, snapshots: &[Snapshot]) -> Result<(), RunError> {
    if snapshots.is_empty() {
        return Ok(());
    }
    let figure = scene_figure(&loaded.scene.name, &loaded.scene.description, snapshots)?;
    write_picture(folder, "figure", &figure)
}

/// Writes a drawing as `<name>.svg` and `<name>.png`.
///
/// # Errors
/// As [`write_results`].
pub fn write_picture(folder: &Path, name: &str, drawing: &Svg) -> Result<(), RunError> {
    write_atomically(&folder.join(format!("{name}.svg")), drawing.finish().as_bytes())?;
    write_atomically(&folder.join(format!("{name}.png")), &to_png(&drawing.outlined(), scale_for_dpi(DPI))?)?;
    Ok(())
}

/// Writes a value as indented JSON.
///
/// # Errors
/// As [`write_results`].
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), RunError> {
    let mut text = serde_json::to_string_pretty(value).map_err(|error| RunError::Internal(error.to_string()))?;
    text.push('\n');
    Ok(write_atomically(path, text.as_bytes())?)
}

/// The folder of a scene's results: the one asked for, or `out/<scene>`.
pub fn folder_of(asked: Option<&PathBuf>, scene: &str) -> PathBuf {
    asked.cloned().unwrap_or_else(|| Path::new("out").join(scene))
}
