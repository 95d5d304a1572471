//! Files are written whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// An output file could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct WriteError {
    /// The file that was asked for.
    pub path: PathBuf,
    /// What the system said.
    pub source: io::Error,
}

/// Writes `contents` to `path`, making missing folders: first to a temporary file beside it, which is flushed to disk and
/// then renamed. A reader sees the old file or the new one, never a part.
///
/// # Errors
/// The path and the system's reason; the temporary file is removed.
pub fn write_atomically(path: &Path, contents: &[u8]) -> Result<(), WriteError> {
    let temporary = temporary_beside(path);
    write_and_rename(&temporary, path, contents).map_err(|source| {
        // The first failure is the one to report; a leftover that cannot be removed adds nothing.
        let _ = fs::remove_file(&temporary);
        WriteError { path: path.to_owned(), source }
    })
}

/// Makes a folder for results and tries to write into it, so that a long run does not end in one that cannot be written.
///
/// # Errors
/// The path and the system's reason.
pub fn prepare_folder(folder: &Path) -> Result<(), WriteError> {
    if folder.exists() && !folder.is_dir() {
        let source = io::Error::new(io::ErrorKind::NotADirectory, "it is a file, not a folder");
        return Err(WriteError { path: folder.to_owned(), source });
    }
    let trial = folder.join(".trial");
    write_atomically(&trial, b"")?;
    fs::remove_file(&trial).map_err(|source| WriteError { path: trial, source })
}

/// `folder/.name.partial` for `folder/name`.
fn temporary_beside(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".partial");
    path.with_file_name(name)
}

/// The two steps of an atomic write.
fn write_and_rename(temporary: &Path, path: &Path, contents: &[u8]) -> io::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    let mut file = File::create(temporary)?;
    file.write_all(contents)?;
    file.sync_all()?;
    fs::rename(temporary, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("tropism-output-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    #[test]
    fn a_file_is_replaced_whole_and_no_temporary_is_left() {
        let folder = folder("replaced");
        let path = folder.join("deeper/table.csv");
        write_atomically(&path, b"a longer first version").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn an_error_names_the_path_and_leaves_no_temporary() {
        let folder = folder("error");
        let occupied = folder.join("occupied");
        fs::create_dir_all(occupied.join("child")).unwrap();
        let error = write_atomically(&occupied, b"x").unwrap_err();
        assert_eq!(error.path, occupied);
        assert!(error.to_string().contains("occupied"));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }
}
