//! What an earlier run left in a folder of results: a new run there clears it, so that all that is found at its end is its own.
//!
//! Only names that a run writes are looked at, only in a folder with the manifest of a run, and no link is followed or removed.

use super::output::WriteError;
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
/// The path and the system's reason.
pub fn clear(folder: &Path) -> Result<(), WriteError> {
    if !is(&folder.join("manifest.json"), fs::Metadata::is_file) {
        return Ok(());
    }
    let [vtu, swc] = ["vtu", "swc"].map(|name| folder.join(name));
    for name in FILES.iter().filter(|name| !name.starts_with("vtu/") || is(&vtu, fs::Metadata::is_dir)) {
        remove(&folder.join(name))?;
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
    if !is(path, fs::Metadata::is_file) {
        return Ok(());
    }
    match fs::remove_file(path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => Err(WriteError { path: path.to_owned(), source }),
        _ => Ok(()),
    }
}
