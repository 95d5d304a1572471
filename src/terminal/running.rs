//! One run on the command line: it is watched, written down now and then, stopped by a signal, taken up again.

use super::interrupt::{Interrupt, Signal};
use super::manners::{alarming, progress_bar};
use super::voice::{alarm, is_loud, note, tell};
use crate::model::mechanism::Roster;
use crate::model::quantity::{Quantity, Time};
use crate::record::checkpoint;
use crate::record::earlier;
use crate::record::output::{claim, try_folder};
use crate::study::plan::memory_of;
use crate::study::report::Asked;
use crate::study::resume::{Checkpoints, Found, Resumed, pick_up};
use crate::study::room::Room;
use crate::study::run::{Ended, Records, Run, RunError, write_results};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::ExitCode;

const SECONDS_AN_HOUR: f64 = 3600.0;

/// Wall seconds from a text with a unit, such as `10min`.
///
/// # Errors
/// A text that is no length of time, or a negative one.
pub fn seconds(text: &str) -> Result<f64, String> {
    let hours = Time::KIND.read(text).map_err(|error| error.to_string())?;
    if hours >= 0.0 { Ok(hours * SECONDS_AN_HOUR) } else { Err("an interval is not negative".into()) }
}

/// Runs a scene to its end and writes its results into a folder.
///
/// # Errors
/// A scene that cannot be assembled, or does not fit into `room`; a file that cannot be written.
pub fn run_once(
    (asked, path): (Asked, &Path),
    roster: &Roster,
    (folder, room): (&Path, Room),
    interval: Option<f64>,
) -> Result<ExitCode, RunError> {
    let mut run = Run::begin(asked.loaded, roster, path, Records::ALL)?;
    room.admit(&asked.loaded.scene.name, &memory_of(&run.simulation, asked.loaded, Records::ALL)?, 1)?;
    earlier::clear(folder, path)?;
    run.writes_into(folder, asked.loaded)?;
    let mut checkpoints = Checkpoints::new(folder, interval, (asked, path));
    checkpoints.begin(&mut run)?;
    watch(run, asked, checkpoints)
}

/// Goes on with the run of a folder from its newest checkpoint. `interval` (s) takes the place of the run's own.
///
/// # Errors
/// A folder without a checkpoint that can be used; a run that does not fit into `room`; a file that cannot be written.
pub fn resume((folder, room): (&Path, Room), roster: &Roster, interval: Option<f64>) -> Result<ExitCode, RunError> {
    // Before anything there is looked at: a run that writes there must not be disturbed.
    let _claim = claim(folder)?;
    let Resumed { loaded, path, command, run, interval: own, refused } = match pick_up(folder, roster)? {
        Found::Stopped(resumed) => *resumed,
        Found::Finished => {
            tell!("{}: the run came to its end; there is nothing to resume", folder.display());
            return Ok(ExitCode::SUCCESS);
        }
    };
    refused.iter().for_each(|reason| alarm!("warning: {reason}; the one before it is used"));
    room.admit(&loaded.scene.name, &memory_of(&run.simulation, &loaded, Records::ALL)?, 1)?;
    try_folder(folder)?;
    note!("{}: resumed at t = {} h", loaded.scene.name, run.simulation.time());
    let asked = Asked { loaded: &loaded, command: &command };
    let checkpoints = Checkpoints::new(folder, interval.or(own), (asked, &path));
    watch(run, asked, checkpoints)
}

/// Steps to the end, or to a signal.
fn watch(mut run: Run, asked: Asked, mut checkpoints: Checkpoints) -> Result<ExitCode, RunError> {
    let interrupt = Interrupt::catch().map_err(|error| RunError::Internal(error.to_string()))?;
    let bar = progress_bar(asked.loaded.scene.time.duration.0, "h");
    let mut signal = None;
    let mut told = BTreeSet::new();
    let ended = run.to_end(|run| {
        bar.set_position((run.simulation.progress() * 1000.0) as u64);
        signal = interrupt.caught();
        if signal.is_some() || checkpoints.is_due() {
            let written = checkpoints.write(run);
            if let Err(error) = &written {
                let reason = error.to_string();
                // Each reason once, or checkpoints that are due after every step would say it as often; but to whom stops the run, again.
                if !told.contains(&reason) || signal.is_some() {
                    alarm!("warning: no checkpoint at t = {} h: {reason}", run.simulation.time());
                    told.insert(reason);
                }
            }
            return signal.map(|signal| stopped(signal, checkpoints.folder, written.is_ok()));
        }
        None
    })?;
    bar.finish_and_clear();
    let is_stopped = matches!(ended, Ended::Stopped(_));
    let mut finished = run.finish(asked.loaded, &ended)?;
    let summary = &finished.summary;
    tell!("{}: t = {} h; {}", summary.scene, (summary.time * 1e6).round() / 1e6, summary.counts);
    if let Some(fraction) = summary.morphology.hits.fraction {
        tell!("hit fraction {fraction:.3}");
    }
    summary.notes.iter().for_each(|note| note!("note: {note}"));
    for (phase, seconds) in summary.cost.seconds.iter().filter(|_| is_loud()) {
        tell!("  {phase}: {seconds:.3} s");
    }
    if let Some(fault) = &summary.fault {
        alarm!("{} the run ended {fault}", alarming("error:"));
    }
    let complete = summary.complete;
    write_results(checkpoints.folder, asked, &mut finished)?;
    if !is_stopped {
        checkpoint::remove(checkpoints.folder)?;
    }
    tell!("results in {}", checkpoints.folder.display());
    let code = signal.filter(|_| is_stopped).map_or(u8::from(!complete), |signal| signal.code);
    Ok(ExitCode::from(code))
}

/// What is said of a run that a signal has stopped.
fn stopped(signal: Signal, folder: &Path, can_go_on: bool) -> String {
    let how =
        if can_go_on { format!("; `tropism resume {}` goes on from here", folder.display()) } else { String::new() };
    format!("stopped by {}{how}", signal.name)
}
