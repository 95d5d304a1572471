//! What an earlier run left in a folder of results: a new run there clears it, so that all that is found at its end is its own.
//!
//! Only names that a run writes are looked at, only in a folder with the manifest of a run, and no link is followed or removed.

use super::checkpoint::{NAMES, is_checkpoint};
use super::output::{WriteError, remove_if_there, temporary_beside};
use crate::scenario::read::read_file;
use serde_json::Value;
use std::fs;
use std::io;
use std::path::Path;

/// Files of a run; its manifest stays until the next one takes its place.
const FILES: [&str; 17] = [
    "summary.json",
    "figure.svg",
    "figure.png",
    "seeds.svg",
    "seeds.png",
    "recording.bin",
    "report.html",
    "trajectories.csv",
    "trajectories.parquet",
    "measures.csv",
    "measures.parquet",
    "axons.csv",
    "axons.parquet",
    "swc.zip",
    "vtu/tissue.pvd",
    "vtu/fields.pvd",
    "vtu/shafts.pvd",
];

/// Removes the results of an earlier run, and the folders of its own that are empty then.
///
/// # Errors
/// The path and the system's reason; what a new run would replace although no run has written it: its own scenario, or, in a folder
/// that is not that of a run, what is called as a checkpoint and is none.
pub fn clear(folder: &Path, scenario: &Path) -> Result<(), WriteError> {
    demand_apart(folder, scenario)?;
    if !is_of_a_run(&folder.join("manifest.json")) {
        return demand_no_foreign_checkpoint(folder);
    }
    let [vtu, swc] = ["vtu", "swc"].map(|name| folder.join(name));
    for name in FILES.iter().filter(|name| !name.starts_with("vtu/") || is(&vtu, fs::Metadata::is_dir)) {
        let path = folder.join(name);
        remove(&path)?;
        // Of a run that was killed while it wrote.
        remove(&temporary_beside(&path))?;
    }
    if is(&vtu, fs::Metadata::is_dir) {
        for series in ["tissue", "fields", "shafts"] {
            clear_of(&vtu.join(series), &|name| name.strip_suffix(".vtu").is_some_and(is_number))?;
        }
        let _ = fs::remove_dir(&vtu);
    }
    if is(&swc, fs::Metadata::is_dir) {
        let mut numbered = names(&swc).into_iter().filter(|name| is_number(name));
        numbered.try_for_each(|name| clear_of(&swc.join(name), &is_axon))?;
        clear_of(&swc, &|name| is_axon(name) || name.strip_suffix(".zip").is_some_and(is_number))?;
    }
    Ok(())
}

/// A scenario in the folder of its results must not be called as one of them.
fn demand_apart(folder: &Path, scenario: &Path) -> Result<(), WriteError> {
    let (Ok(scenario), Ok(folder)) = (scenario.canonicalize(), folder.canonicalize()) else { return Ok(()) };
    let mut written = FILES.iter().chain(&NAMES).chain(&["manifest.json"]);
    match written.any(|name| folder.join(name) == scenario) {
        true => Err(foreign(&scenario, "it is the scenario of this run; another name or another --out is needed")),
        false => Ok(()),
    }
}

fn demand_no_foreign_checkpoint(folder: &Path) -> Result<(), WriteError> {
    let there = NAMES.iter().map(|name| folder.join(name)).filter(|path| path.symlink_metadata().is_ok());
    match there.into_iter().find(|path| !is_checkpoint(path)) {
        Some(path) => Err(foreign(&path, "no checkpoint of this program, and not replaced; another --out is needed")),
        None => Ok(()),
    }
}

fn foreign(path: &Path, words: &str) -> WriteError {
    WriteError { path: path.to_owned(), source: io::Error::other(words) }
}

/// Whether a file is the manifest of a run.
fn is_of_a_run(manifest: &Path) -> bool {
    let has =
        |value: Value| value["version"].is_string() && value["scene"].is_string() && value["scenario"].is_object();
    is(manifest, fs::Metadata::is_file) && read_file(manifest).is_ok_and(has)
}

/// Removes the files with certain names from a folder, and the folder if it is empty then; what somebody else has put there stays.
fn clear_of(folder: &Path, is_ours: &dyn Fn(&str) -> bool) -> Result<(), WriteError> {
    if is(folder, fs::Metadata::is_dir) {
        names(folder).iter().filter(|name| is_ours(name)).try_for_each(|name| remove(&folder.join(name)))?;
        let _ = fs::remove_dir(folder);
    }
    Ok(())
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.file_name().into_string().ok()).collect()
}

fn is_number(name: &str) -> bool {
    name.len() >= 4 && name.bytes().all(|digit| digit.is_ascii_digit())
}

fn is_axon(name: &str) -> bool {
    let number = name.strip_prefix("axon_").and_then(|name| name.strip_suffix(".swc"));
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|digit| digit.is_ascii_digit()))
}

/// Whether something is there, of a kind, and no link.
fn is(path: &Path, kind: impl Fn(&fs::Metadata) -> bool) -> bool {
    path.symlink_metadata().is_ok_and(|found| kind(&found))
}

fn remove(path: &Path) -> Result<(), WriteError> {
    if is(path, fs::Metadata::is_file) { remove_if_there(path) } else { Ok(()) }
}
