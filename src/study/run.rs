//! One run: a scenario in, a folder of results out.

use super::report::Asked;
use crate::model::clock::Clock;
use crate::model::health::Fault;
use crate::model::keep::{Damage, Keep, KeptBytes};
use crate::model::mechanism::{Entry, Facts, Roster};
use crate::model::shelf::Shelf;
use crate::model::violation::Violation;
use crate::record::checkpoint::CheckpointError;
use crate::record::csv::IN_MEMORY;
use crate::record::files::{OutputError, Outputs};
use crate::record::manifest::Manifest;
use crate::record::output::{WriteError, write_atomically};
use crate::record::png::{PngError, scale_for_dpi, to_png};
use crate::record::recorder::{Recorder, RecorderOptions};
use crate::record::recording::Recording;
use crate::record::recording::film::FilmTitle;
use crate::record::scene_figure::FigureError;
use crate::record::scene_view::{pooled_figure, scene_figure};
use crate::record::snapshot::Snapshot;
use crate::record::summary::{Summary, SummaryOptions};
use crate::record::svg::Svg;
use crate::scenario::load::{Loaded, Request, ScenarioErrors, load, load_document};
use crate::scenario::schema::{BlockFindings, BlockSchema};
use crate::simulation::{AssemblyError, Simulation};
use serde::Serialize;
use serde_json::Value;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Resolution of pictures, dots an inch.
pub(super) const DPI: f32 = 200.0;
/// The file of trajectories in a folder of results.
pub const TRAJECTORIES: &str = "trajectories.csv";

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
    /// A run that cannot go on.
    #[error("{0}")]
    Resume(String),
    /// Something that must not happen.
    #[error("internal: {0}")]
    Internal(String),
}

impl From<OutputError> for RunError {
    fn from(error: OutputError) -> Self {
        match error {
            OutputError::Write(error) => Self::Write(error),
            OutputError::Damage(damage) => Self::Resume(CheckpointError::from(damage).to_string()),
            other => Self::Internal(other.to_string()),
        }
    }
}

/// What a finished run leaves in memory.
pub struct Finished {
    /// `summary.json`.
    pub summary: Summary,
    /// Trajectories and snapshots.
    pub recorder: Recorder,
    /// The film of the run, if the scene has frames and they were to be kept.
    pub recording: Option<Recording>,
    /// The first of the files for other tools that could not be written, if there is one.
    pub written: Result<(), RunError>,
}

/// What is kept of a run besides its summary and the snapshots of its figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Records {
    /// Trajectories.
    pub trajectories: bool,
    /// The recording, if the scene has frames.
    pub frames: bool,
}

impl Records {
    /// What a run by itself leaves.
    pub const ALL: Self = Self { trajectories: true, frames: true };
    /// Trajectories alone.
    pub const TRAJECTORIES: Self = Self { trajectories: true, frames: false };
    /// The recording alone.
    pub const FRAMES: Self = Self { trajectories: false, frames: true };
    /// Neither.
    pub const NOTHING: Self = Self { trajectories: false, frames: false };
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
    keep: Records,
    mut tick: impl FnMut(f64),
) -> Result<Finished, RunError> {
    let mut run = Run::begin(loaded, roster, path, keep)?;
    let ended = run.to_end(|run| {
        tick(run.simulation.progress());
        None
    })?;
    run.finish(loaded, &ended)
}

/// A run on its way: the simulation and what has been recorded of it.
pub struct Run {
    /// The simulation.
    pub simulation: Simulation,
    /// Trajectories and snapshots so far.
    pub recorder: Recorder,
    outputs: Outputs,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// At its end.
    Done,
    /// By a fault.
    Fault(Fault),
    /// On the way, because it was stopped or a file for other tools could not be written.
    Stopped(Fault),
}

impl Run {
    /// A loaded scene at its start.
    ///
    /// # Errors
    /// A scene that cannot be assembled.
    pub fn begin(loaded: &Loaded, roster: &Roster, path: &Path, keep: Records) -> Result<Self, RunError> {
        Self::begin_from((loaded, &Shelf::default()), roster, path, keep)
    }

    /// As [`Run::begin`], with a shelf of what other runs have solved.
    ///
    /// # Errors
    /// As [`Run::begin`].
    pub(super) fn begin_from(
        (loaded, shelf): (&Loaded, &Shelf),
        roster: &Roster,
        path: &Path,
        keep: Records,
    ) -> Result<Self, RunError> {
        let simulation = Simulation::assemble_from(loaded, roster, shelf).map_err(|error| run_error(error, path))?;
        let clock = *simulation.world().resource::<Clock>();
        let recorder = Recorder::new(&recorder_options(loaded, keep), &clock.grid, clock.end);
        Ok(Self { simulation, recorder, outputs: Outputs::default() })
    }

    /// Lets a run that has just begun write into `folder`, on its way, the files for other tools that its scene asks for.
    ///
    /// # Errors
    /// A file that could not be written.
    pub fn writes_into(&mut self, folder: &Path, loaded: &Loaded) -> Result<(), RunError> {
        self.recorder.trajectories.stream_into(&folder.join(TRAJECTORIES), IN_MEMORY);
        let grid = self.simulation.world().resource::<Clock>().grid;
        self.outputs = Outputs::create(&loaded.scene.output, folder, &grid)?;
        Ok(())
    }

    /// Writes down what has been recorded, and how far the files for other tools have come.
    ///
    /// # Errors
    /// A file that cannot be read back.
    pub fn keep_records(&self) -> Result<Vec<u8>, WriteError> {
        let mut bytes = Vec::new();
        self.recorder.keep(&mut bytes);
        self.recorder.trajectories.keep_streamed(&mut bytes)?;
        self.outputs.keep(&mut bytes)?;
        Ok(bytes)
    }

    /// Brings a run of the same scene that has just begun to what was written down of simulation and records.
    ///
    /// # Errors
    /// The part that does not fit; the run is of no use then.
    pub fn restore(&mut self, (state, records): (&[u8], &[u8])) -> Result<(), RunError> {
        let damaged = |damage: Damage| RunError::Resume(CheckpointError::from(damage).to_string());
        self.simulation.restore(state).map_err(damaged)?;
        let mut records = KeptBytes::new(records);
        let mut recorder: Recorder = records.read().map_err(damaged)?;
        let fresh = &mut self.recorder.trajectories;
        recorder.trajectories.restore_streamed(&mut records, fresh).map_err(damaged)?;
        if let Some(defect) = recorder.defect(&self.recorder, self.simulation.world()) {
            return Err(damaged(Damage(format!("records: {defect}"))));
        }
        self.recorder = recorder;
        self.outputs.restore(&mut records, self.simulation.world())?;
        match records.left() {
            0 => Ok(()),
            more => Err(damaged(Damage(format!("records: {more} bytes are too many")))),
        }
    }

    /// Steps to the end, or to the fault that ends the run. `between` is called after each step and may stop the run, with the reason.
    ///
    /// # Errors
    /// A record that cannot be kept. A fault while running is no error.
    pub fn to_end(&mut self, mut between: impl FnMut(&mut Self) -> Option<String>) -> Result<Ended, RunError> {
        loop {
            let Self { simulation, recorder, outputs } = self;
            let now = simulation.world().resource::<Clock>().now;
            if recorder.is_due(now) {
                simulation.bring_tissue_here();
                recorder.observe(simulation.world()).map_err(|error| RunError::Internal(error.to_string()))?;
                simulation.lap("record");
            }
            if outputs.are_due(now) {
                simulation.bring_tissue_here();
                let written = outputs.look(simulation.world());
                simulation.lap("record");
                if let Err(error) = written {
                    return Ok(Ended::Stopped(Fault { time: simulation.time(), account: error.to_string() }));
                }
            }
            if simulation.is_over() {
                return Ok(Ended::Done);
            }
            if let Err(fault) = simulation.step() {
                return Ok(Ended::Fault(fault));
            }
            let stopped = between(self);
            self.simulation.lap("record");
            if let Some(account) = stopped {
                return Ok(Ended::Stopped(Fault { time: self.simulation.time(), account }));
            }
        }
    }

    /// What the run leaves; one that did not come to its end shows where it stands in a last snapshot, if that can be drawn.
    ///
    /// # Errors
    /// A file for other tools that could not be written.
    pub fn finish(mut self, loaded: &Loaded, ended: &Ended) -> Result<Finished, RunError> {
        self.simulation.bring_tissue_here();
        let (remarks, written) = self.outputs.finish(self.simulation.world());
        let world = self.simulation.world();
        let fault = match ended {
            Ended::Done => None,
            Ended::Fault(fault) | Ended::Stopped(fault) => {
                self.recorder.observe_fault(world);
                Some(fault)
            }
        };
        let output = &loaded.scene.output;
        let options = SummaryOptions {
            scene: loaded.scene.name.clone(),
            seed: loaded.scene.seed,
            heights: output.heights.iter().map(|share| share.0).collect(),
            linkage: output.linkage_distance.0,
        };
        let title = FilmTitle {
            scene: loaded.scene.name.clone(),
            description: loaded.scene.description.clone(),
            seed: loaded.scene.seed,
        };
        let recording = self.recorder.take_film().and_then(|film| film.develop(world, &title));
        let mut summary = Summary::of(world, &options, fault);
        summary.notes.extend(self.recorder.given_up.clone().into_iter().chain(remarks));
        Ok(Finished { summary, recorder: self.recorder, recording, written: written.map_err(RunError::from) })
    }
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
        AssemblyError::NoRoom(account) => RunError::Arguments(format!(
            "the scene does not fit into memory: {account}; `--memory any` solves it all the same"
        )),
    }
}

pub(super) fn recorder_options(loaded: &Loaded, keep: Records) -> RecorderOptions {
    let (output, duration) = (&loaded.scene.output, loaded.scene.time.duration.0);
    let axons = loaded.scene.populations.values().map(|population| population.count).sum();
    let frames = if keep.frames { output.frames(axons) } else { 0 };
    let gaps = f64::from(frames.saturating_sub(1).max(1));
    RecorderOptions {
        trajectory_interval: (keep.trajectories && output.tables.are_csv()).then_some(output.trajectory_interval.0),
        figure_times: output.figure_times.iter().map(|share| share.0 * duration).collect(),
        frame_times: (0..frames).map(|frame| f64::from(frame) / gaps * duration).collect(),
    }
}

/// Writes everything a single run leaves, into `folder`.
///
/// # Errors
/// The file that could not be written, or the picture that could not be drawn.
pub fn write_results(folder: &Path, asked: Asked, finished: &mut Finished) -> Result<(), RunError> {
    let loaded = asked.loaded;
    let manifest = write_json(&folder.join("manifest.json"), &Manifest::of(loaded));
    let report = asked.report_run(folder, finished);
    let Recorder { trajectories, snapshots, .. } = &mut finished.recorder;
    let (table, figure) = rayon::join(
        || match loaded.scene.output.tables.are_csv() {
            true => trajectories.write(&folder.join(TRAJECTORIES)),
            false => Ok(()),
        },
        || write_figure(folder, loaded, snapshots),
    );
    let others = std::mem::replace(&mut finished.written, Ok(()));
    let written = others.and(manifest).and(report).and(table.map_err(RunError::from)).and(figure);
    // Last, since it says whether the results are whole.
    let mut summary = Cow::Borrowed(&finished.summary);
    if let Err(error) = &written {
        let summary = summary.to_mut();
        summary.complete = false;
        summary.notes.push(format!("results are not whole: {error}"));
    }
    written.and(write_json(&folder.join("summary.json"), &*summary))
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

/// Writes `seeds.svg` and `seeds.png`, the density of the shafts of all runs; nothing if no time was asked for.
///
/// # Errors
/// As [`write_results`].
pub fn write_pooled_figure(folder: &Path, loaded: &Loaded, runs: &[Finished]) -> Result<(), RunError> {
    let runs: Vec<&[Snapshot]> = runs.iter().map(|run| run.recorder.snapshots.as_slice()).collect();
    if runs.first().is_none_or(|first| first.is_empty()) {
        return Ok(());
    }
    write_picture(folder, "seeds", &pooled_figure(&loaded.scene.name, &loaded.scene.description, &runs)?)
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
