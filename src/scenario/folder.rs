//! A scenario reads files in its own folder, and nothing else.

use super::read::NO_FILE;
use std::path::{Component, Path, PathBuf};

/// Where a file lies that a scenario in `folder` names, links followed if it is there.
///
/// # Errors
/// A name, or a link, that leads out of the folder; something that is no file, such as a pipe, which could keep the reader waiting.
pub fn inside(folder: &Path, file: &str) -> Result<PathBuf, String> {
    let path = Path::new(file);
    let stays = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if file.is_empty() || !stays {
        return Err(format!(
            "\"{file}\" is not the name of a file in the folder of the scenario, such as \"olfactory.json\" or \"shapes/tissue.svg\""
        ));
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(path);
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) if !path.starts_with(&folder) => {
            Err(format!("{file}: a link that leads out of the folder of the scenario"))
        }
        (Ok(path), _) if !path.is_file() && !path.is_dir() => Err(format!("{file}: {NO_FILE}")),
        _ => Ok(path),
    }
}
