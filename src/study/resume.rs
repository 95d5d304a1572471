//! A run that is written down now and then, and one that goes on from there.

use super::report::Asked;
use super::run::{Records, Run, RunError, read_document, write_json};
use crate::model::keep::Damage;
use crate::model::mechanism::Roster;
use crate::model::stopwatch::Elapsed;
use crate::record::checkpoint::{self, Checkpoint, CheckpointError};
use crate::record::manifest::Manifest;
use crate::record::output::WriteError;
use crate::scenario::load::Loaded;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Writes checkpoints of a run into its folder.
#[derive(Debug)]
pub struct Checkpoints<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// Wall seconds between two checkpoints; none to write only when asked.
    pub interval: Option<f64>,
    asked: Asked<'a>,
    /// File of the scene, absolute.
    path: PathBuf,
    since: Elapsed,
}

impl<'a> Checkpoints<'a> {
    /// Checkpoints of a run of a scene that was read from `path`.
    pub fn new(folder: &'a Path, interval: Option<f64>, (asked, path): (Asked<'a>, &Path)) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        Self { folder, interval, asked, path, since: Elapsed::default() }
    }

    /// Makes the folder that of a run that begins: checkpoints of another run go, the manifest is written, and a first checkpoint if
    /// there are to be any.
    ///
    /// # Errors
    /// The file that cannot be written or removed.
    pub fn begin(&mut self, run: &mut Run) -> Result<(), RunError> {
        checkpoint::remove(self.folder)?;
        write_json(&self.folder.join("manifest.json"), &Manifest::of(self.asked.loaded))?;
        if self.interval.is_some() {
            self.write(run)?;
        }
        Ok(())
    }

    /// Whether the interval has passed since the last one.
    pub fn is_due(&self) -> bool {
        self.interval.is_some_and(|interval| self.since.seconds() >= interval)
    }

    /// Writes one, between two steps; what that takes is booked under `checkpoint`.
    ///
    /// # Errors
    /// The file that cannot be written; the checkpoints that were there stay.
    pub fn write(&mut self, run: &mut Run) -> Result<(), WriteError> {
        run.simulation.lap("record");
        let written = self.of(run).and_then(|checkpoint| checkpoint.write(self.folder));
        run.simulation.lap("checkpoint");
        self.since = Elapsed::default();
        written
    }

    /// What there is to write.
    ///
    /// # Errors
    /// A file of the run that cannot be read back.
    pub fn of(&self, run: &Run) -> Result<Checkpoint, WriteError> {
        Ok(Checkpoint {
            path: self.path.to_string_lossy().into_owned(),
            command: self.asked.command.to_owned(),
            scene: self.asked.loaded.merged.to_string(),
            remarks: self.asked.loaded.remarks.clone(),
            interval: self.interval,
            time: run.simulation.time(),
            state: run.simulation.keep(),
            recorder: run.keep_records()?,
        })
    }
}

/// A run that goes on.
pub struct Resumed {
    /// Its scene.
    pub loaded: Loaded,
    /// File of the scene, as it was.
    pub path: PathBuf,
    /// What was typed to have it run.
    pub command: String,
    /// The run, at the checkpoint.
    pub run: Run,
    /// Wall seconds between its checkpoints.
    pub interval: Option<f64>,
    /// What was refused on the way, with the reason.
    pub refused: Vec<String>,
}

/// What a folder has for those who want to go on.
pub enum Found {
    /// A run that stopped on the way.
    Stopped(Box<Resumed>),
    /// Nothing: the run came to its end.
    Finished,
}

/// The run of a folder at its newest checkpoint that is whole and fits.
///
/// # Errors
/// A folder without a checkpoint that can be used, each with the reason; a scene that this program refuses.
pub fn pick_up(folder: &Path, roster: &Roster) -> Result<Found, RunError> {
    let there: Vec<PathBuf> = checkpoint::paths(folder).into_iter().filter(|path| path.exists()).collect();
    if there.is_empty() {
        return without_checkpoint(folder);
    }
    let mut refused = Vec::new();
    for path in there {
        let usable = Checkpoint::read(&path).and_then(|found| belongs(folder, &found).map(|()| found));
        match usable.map_err(|error| error.to_string()).and_then(|found| {
            resumed(&found, roster, Some(folder)).map_err(|error| match error {
                RunError::Resume(reason) => reason,
                other => format!("holds a scene that cannot be run here: {other}"),
            })
        }) {
            Ok(resumed) => return Ok(Found::Stopped(Box::new(Resumed { refused, ..resumed }))),
            Err(reason) => refused.push(format!("{} {reason}", path.display())),
        }
    }
    Err(RunError::Resume(format!("there is no checkpoint to go on from:\n  {}", refused.join("\n  "))))
}

/// The run of a checkpoint; with a folder it goes on with the files for other tools there.
///
/// # Errors
/// A scene that this program refuses; state that does not fit it; a file that could not be written.
pub fn resumed(checkpoint: &Checkpoint, roster: &Roster, folder: Option<&Path>) -> Result<Resumed, RunError> {
    let value: Value = serde_json::from_str(&checkpoint.scene)
        .map_err(|error| RunError::Resume(format!("holds a scene that is no JSON: {error}")))?;
    let loaded = Loaded { remarks: checkpoint.remarks.clone(), ..read_document(&checkpoint.path, value, roster)? };
    let path = PathBuf::from(&checkpoint.path);
    let mut run = Run::begin(&loaded, roster, &path, Records::ALL)?;
    folder.map_or(Ok(()), |folder| run.writes_into(folder, &loaded))?;
    run.restore((&checkpoint.state, &checkpoint.recorder))?;
    Ok(Resumed {
        loaded,
        path,
        command: checkpoint.command.clone(),
        run,
        interval: checkpoint.interval,
        refused: Vec::new(),
    })
}

/// Whether a checkpoint is of the scene that the folder's manifest names, if it names one.
fn belongs(folder: &Path, found: &Checkpoint) -> Result<(), CheckpointError> {
    let named = json(&folder.join("manifest.json")).and_then(|mut manifest| Some(manifest.get_mut("scenario")?.take()));
    let own: Option<Value> = serde_json::from_str(&found.scene).ok();
    if named.is_some() && named != own {
        let words = "it is of another scenario than manifest.json beside it";
        return Err(Damage(words.into()).into());
    }
    Ok(())
}

fn without_checkpoint(folder: &Path) -> Result<Found, RunError> {
    let place = folder.display();
    let Some(summary) = json(&folder.join("summary.json")) else {
        return Err(RunError::Arguments(format!("{place} has no checkpoint.bin: there is nothing to resume")));
    };
    match (summary["complete"].as_bool(), summary["fault"].as_str()) {
        (Some(true), _) => Ok(Found::Finished),
        (_, Some(fault)) => {
            Err(RunError::Arguments(format!("{place} has no checkpoint.bin: the run there ended {fault}")))
        }
        _ => Err(RunError::Arguments(format!("{place} has no checkpoint.bin: there is nothing to resume"))),
    }
}

fn json(path: &Path) -> Option<Value> {
    serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
}
