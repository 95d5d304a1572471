//! Files are written whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
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
    write_whole(&temporary, contents).and_then(|()| put(&temporary, path)).map_err(|source| {
        // The first failure is the one to report; a leftover that cannot be removed adds nothing.
        let _ = fs::remove_file(&temporary);
        WriteError { path: path.to_owned(), source }
    })
}

/// As [`write_atomically`], but the file that was there goes to `previous` first. At any instant one of the two is whole.
///
/// # Errors
/// As [`write_atomically`]; what was there stays.
pub fn write_and_keep_previous(path: &Path, previous: &Path, contents: &[u8]) -> Result<(), WriteError> {
    let temporary = temporary_beside(path);
    let make_room = || if path.exists() { fs::rename(path, previous) } else { Ok(()) };
    let written = write_whole(&temporary, contents).and_then(|()| make_room()).and_then(|()| put(&temporary, path));
    written.map_err(|source| {
        let _ = fs::remove_file(&temporary);
        WriteError { path: path.to_owned(), source }
    })
}

/// As [`write_atomically`], but not flushed to disk: for many small files of which none is worth the wait.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_unsynced(path: &Path, contents: &[u8]) -> Result<(), WriteError> {
    let temporary = temporary_beside(path);
    let written = begun_anew(&temporary).and_then(|mut file| file.write_all(contents));
    let written = written.and_then(|()| fs::rename(&temporary, path));
    written.map_err(|source| WriteError { path: path.to_owned(), source })
}

/// A fresh file under a temporary name. What a run that was killed, or a link that somebody laid, left there goes: it is not written through.
fn begun_anew(temporary: &Path) -> io::Result<File> {
    remove_if_there(temporary).map_err(|error| error.source)?;
    File::options().read(true).write(true).create_new(true).open(temporary)
}

/// A file that grows under a temporary name beside its own, and takes that only when it is complete.
#[derive(Debug)]
pub struct Partial {
    path: PathBuf,
    temporary: PathBuf,
    file: Option<File>,
    /// Bytes appended so far.
    length: u64,
}

impl Partial {
    /// Begins a file, making missing folders.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let temporary = temporary_beside(path);
        let file = make_parent(path).and_then(|()| begun_anew(&temporary));
        let file = file.map_err(|source| WriteError { path: path.to_owned(), source })?;
        Ok(Self { path: path.to_owned(), temporary, file: Some(file), length: 0 })
    }

    /// Appends bytes.
    ///
    /// # Errors
    /// The path and the system's reason; nothing is appended then.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let end = self.length;
        let written = file.write_all(bytes).inspect_err(|_| {
            // A part of them that is there all the same: what cannot be cut off is written over.
            let _ = file.set_len(end).and_then(|()| file.seek(SeekFrom::Start(end)));
        });
        self.length += if written.is_ok() { bytes.len() as u64 } else { 0 };
        written.map_err(|source| self.error(source))
    }

    /// What has been appended so far.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn contents(&self) -> Result<Vec<u8>, WriteError> {
        let read = |mut file: &File| {
            let mut bytes = Vec::new();
            file.seek(SeekFrom::Start(0))?;
            file.take(self.length).read_to_end(&mut bytes)?;
            file.seek(SeekFrom::Start(self.length)).map(|_| bytes)
        };
        self.file.as_ref().map_or(Ok(Vec::new()), read).map_err(|source| self.error(source))
    }

    /// Gives the file its name. Where its folder has gone meanwhile, it is written again.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn commit(mut self) -> Result<(), WriteError> {
        let synced = self.file.as_ref().map_or(Ok(()), File::sync_all);
        match synced.and_then(|()| fs::rename(&self.temporary, &self.path)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => write_atomically(&self.path, &self.contents()?)?,
            named => named.map_err(|source| self.error(source))?,
        }
        self.file = None;
        Ok(())
    }

    fn error(&self, source: io::Error) -> WriteError {
        WriteError { path: self.path.clone(), source }
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            // What was abandoned is of no use; if it cannot be removed, nothing more can be done.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// Makes a folder for files of one ending, and removes those that an earlier run left there.
///
/// # Errors
/// The path and the system's reason; a link in its place.
pub fn clear_folder(folder: &Path, ending: &str) -> Result<(), WriteError> {
    no_link(folder)?;
    let clear = || {
        fs::create_dir_all(folder)?;
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.extension().is_some_and(|found| found == ending) {
                fs::remove_file(path)?;
            }
        }
        Ok(())
    };
    clear().map_err(|source| WriteError { path: folder.to_owned(), source })
}

/// Refuses a link in the place of a folder of results' own: what is written there would land elsewhere.
///
/// # Errors
/// The path.
pub fn no_link(folder: &Path) -> Result<(), WriteError> {
    match folder.symlink_metadata() {
        Ok(found) if found.is_symlink() => {
            let source =
                io::Error::new(io::ErrorKind::NotADirectory, "it is a link; a run writes into folders of its own");
            Err(WriteError { path: folder.to_owned(), source })
        }
        _ => Ok(()),
    }
}

/// Removes a file, or a link, if it is there.
///
/// # Errors
/// The path and the system's reason.
pub fn remove_if_there(path: &Path) -> Result<(), WriteError> {
    match fs::remove_file(path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => Err(WriteError { path: path.to_owned(), source }),
        _ => Ok(()),
    }
}

/// The right to write results into a folder, until it is dropped or the process ends in whatever way.
#[derive(Debug)]
#[must_use]
pub struct Claim {
    /// The folder, open and locked, where the system locks folders.
    _folder: Option<fs::File>,
}

/// Claims a folder, if it is there.
///
/// # Errors
/// A folder that another process, or another part of this one, has claimed.
pub fn claim(folder: &Path) -> Result<Claim, WriteError> {
    let open = fs::File::open(folder).ok();
    if open.as_ref().is_some_and(|open| matches!(open.try_lock(), Err(fs::TryLockError::WouldBlock))) {
        let words = "another run writes into it; another --out is needed, or patience";
        return Err(WriteError { path: folder.to_owned(), source: io::Error::new(io::ErrorKind::ResourceBusy, words) });
    }
    Ok(Claim { _folder: open })
}

/// Makes a folder for results and claims it.
///
/// # Errors
/// As [`try_folder`] and [`claim`].
pub fn prepare_folder(folder: &Path) -> Result<Claim, WriteError> {
    try_folder(folder)?;
    claim(folder)
}

/// Makes a folder for results, if it is not there, and tries to write into it, so that a long run does not end in one that cannot be written.
///
/// # Errors
/// The path and the system's reason.
pub fn try_folder(folder: &Path) -> Result<(), WriteError> {
    if folder.exists() && !folder.is_dir() {
        let source = io::Error::new(io::ErrorKind::NotADirectory, "it is a file, not a folder");
        return Err(WriteError { path: folder.to_owned(), source });
    }
    // A name of its own: another run may try the same folder.
    let trial = folder.join(format!(".trial-{}", std::process::id()));
    write_atomically(&trial, b"")?;
    fs::remove_file(&trial).map_err(|source| WriteError { path: trial, source })
}

/// `folder/.name.partial` for `folder/name`.
pub fn temporary_beside(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".partial");
    path.with_file_name(name)
}

fn make_parent(path: &Path) -> io::Result<()> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => fs::create_dir_all(folder),
        None => Ok(()),
    }
}

/// The first step of an atomic write: all of a file, on disk.
fn write_whole(temporary: &Path, contents: &[u8]) -> io::Result<()> {
    make_parent(temporary)?;
    let mut file = begun_anew(temporary)?;
    file.write_all(contents)?;
    file.sync_all()
}

/// The second step: its name, on disk too.
fn put(temporary: &Path, path: &Path) -> io::Result<()> {
    fs::rename(temporary, path)?;
    if let Some(folder) = folder_of(path).filter(|_| cfg!(unix)) {
        // The file is there; a system that cannot flush folders keeps it all the same.
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
    }
    Ok(())
}

fn folder_of(path: &Path) -> Option<&Path> {
    path.parent().map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
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
    #[cfg(unix)]
    fn a_link_in_the_place_of_a_temporary_file_is_not_written_through() {
        let folder = std::env::temp_dir().join(format!("tropism-link-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (kept, path) = (folder.join("kept"), folder.join("summary.json"));
        fs::write(&kept, "keep me").unwrap();
        let lay = || std::os::unix::fs::symlink(&kept, temporary_beside(&path)).unwrap();
        lay();
        write_atomically(&path, b"{}").unwrap();
        lay();
        write_unsynced(&path, b"{}").unwrap();
        lay();
        let mut partial = Partial::create(&path).unwrap();
        partial.write(b"{}").unwrap();
        partial.commit().unwrap();
        assert_eq!(fs::read_to_string(&kept).unwrap(), "keep me");
        assert!(!path.is_symlink() && fs::read_to_string(&path).unwrap() == "{}");
        fs::remove_dir_all(folder).unwrap();
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
    fn a_file_that_grows_is_written_again_where_its_folder_has_gone() {
        let folder = folder("gone");
        let path = folder.join("deeper/table.csv");
        let mut partial = Partial::create(&path).unwrap();
        partial.write(b"first, ").unwrap();
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(partial.contents().unwrap(), b"first, ");
        partial.write(b"second").unwrap();
        partial.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first, second");
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
