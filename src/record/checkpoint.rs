//! Checkpoints: the whole state of a run in one file, `checkpoint.bin`, with the one before it beside it.
//!
//! The file: `tropckpt`, the format (u32), the length of the body (u64), its CRC-32 (u32), the body; all little-endian. The body holds
//! what [`Checkpoint`] lists, in its order. A new one is written whole and flushed to disk before the last one makes room, so at
//! any instant one of the two files is whole.

use super::output::{WriteError, remove_if_there, write_and_keep_previous};
use crate::model::keep::{Damage, Keep, KeptBytes};
use crate::scenario::read::NO_FILE;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// What the files are called: the newest first.
pub const NAMES: [&str; 2] = ["checkpoint.bin", "checkpoint.previous.bin"];
const MAGIC: &[u8; 8] = b"tropckpt";
/// Raised whenever what stands in the body, or its order, changes.
const FORMAT: u32 = 6;
const HEADER: usize = 24;
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// Whether a file begins as a checkpoint does.
pub fn is_checkpoint(path: &Path) -> bool {
    let mut first = [0; MAGIC.len()];
    let is_file = path.symlink_metadata().is_ok_and(|found| found.is_file());
    is_file && File::open(path).is_ok_and(|mut file| file.read_exact(&mut first).is_ok()) && first == *MAGIC
}

/// Everything that a run needs to go on.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// File of the scene, absolute; it gives the scene its name and is not read again.
    pub path: String,
    /// What was typed to have it run.
    pub command: String,
    /// The merged scene, as JSON.
    pub scene: String,
    /// What those who changed the scene had to say of it.
    pub remarks: Vec<String>,
    /// Wall seconds between two checkpoints; none without.
    pub interval: Option<f64>,
    /// Time reached (h).
    pub time: f64,
    /// State of the simulation.
    pub state: Vec<u8>,
    /// State of the recorder.
    pub recorder: Vec<u8>,
}

/// Why a checkpoint is refused.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[from] io::Error),
    /// It begins otherwise.
    #[error("is no checkpoint of tropism")]
    Foreign,
    /// Its end is missing, or something follows it.
    #[error("is cut or too long: {found} bytes instead of {wanted}")]
    Length {
        /// Bytes found.
        found: u64,
        /// Bytes that its header names.
        wanted: u64,
    },
    /// Another format.
    #[error("has format {found}; this program reads format {FORMAT}")]
    Format {
        /// The format.
        found: u32,
    },
    /// Another version of the program, which might find other bits.
    #[error("was written by tropism {found}; this is {PROGRAM}, which could find other numbers")]
    Program {
        /// The version.
        found: String,
    },
    /// Some bytes are not those that were written.
    #[error("is damaged: its checksum is {found:08x} instead of {wanted:08x}")]
    Sum {
        /// CRC-32 of what was found.
        found: u32,
        /// CRC-32 of what was written.
        wanted: u32,
    },
    /// What it holds does not read back, or belongs to another scene.
    #[error("does not fit: {0}")]
    Content(#[from] Damage),
}

impl Checkpoint {
    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let Self { path, command, scene, remarks, interval, time, state, recorder } = self;
        let mut body = Vec::with_capacity(state.len() + recorder.len() + scene.len() + 1024);
        PROGRAM.to_owned().keep(&mut body);
        (path.clone(), command.clone()).keep(&mut body);
        (scene.clone(), remarks.clone()).keep(&mut body);
        (*interval, *time).keep(&mut body);
        for part in [state, recorder] {
            part.len().keep(&mut body);
            body.extend_from_slice(part);
        }
        let mut bytes = Vec::with_capacity(HEADER + body.len());
        bytes.extend_from_slice(MAGIC);
        (FORMAT, body.len() as u64).keep(&mut bytes);
        crc32fast::hash(&body).keep(&mut bytes);
        bytes.extend_from_slice(&body);
        bytes
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// Bytes that are cut, damaged, of another format or program.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let (header, body) = bytes.split_at(HEADER.min(bytes.len()));
        let wanted_sum = checked_header(header, bytes.len() as u64)?;
        let found = crc32fast::hash(body);
        if found != wanted_sum {
            return Err(CheckpointError::Sum { found, wanted: wanted_sum });
        }
        let mut from = KeptBytes::new(body);
        let program: String = from.read()?;
        if program != PROGRAM {
            return Err(CheckpointError::Program { found: program });
        }
        let ((path, command), (scene, remarks), (interval, time)) = (from.read()?, from.read()?, from.read()?);
        let mut part = || -> Result<Vec<u8>, Damage> {
            let length: usize = from.read()?;
            Ok(from.take(length)?.to_vec())
        };
        Ok(Self { path, command, scene, remarks, interval, time, state: part()?, recorder: part()? })
    }

    /// Writes the newest checkpoint of a folder; the one before it stays.
    ///
    /// # Errors
    /// The path and the system's reason; the checkpoints that were there stay as they were.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let [newest, previous] = paths(folder);
        write_and_keep_previous(&newest, &previous, &self.to_bytes())
    }

    /// Reads a file. No more is read than its header names.
    ///
    /// # Errors
    /// A file that cannot be read, or whose content [`Self::from_bytes`] refuses.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        if !fs::metadata(path)?.is_file() {
            return Err(io::Error::other(format!("it is {NO_FILE}")).into());
        }
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut bytes = Vec::new();
        file.by_ref().take(HEADER as u64).read_to_end(&mut bytes)?;
        checked_header(&bytes, length)?;
        file.take(length.saturating_sub(HEADER as u64)).read_to_end(&mut bytes)?;
        Self::from_bytes(&bytes)
    }
}

/// The checksum that a header names, for a file of so many bytes.
fn checked_header(header: &[u8], length: u64) -> Result<u32, CheckpointError> {
    if header.get(..MAGIC.len()).is_some_and(|magic| magic != MAGIC) {
        return Err(CheckpointError::Foreign);
    }
    if header.len() < HEADER {
        return Err(CheckpointError::Length { found: length, wanted: HEADER as u64 });
    }
    let mut from = KeptBytes::new(&header[MAGIC.len()..]);
    let (format, body): (u32, u64) = from.read()?;
    if format != FORMAT {
        return Err(CheckpointError::Format { found: format });
    }
    let wanted = body.saturating_add(HEADER as u64);
    if length != wanted {
        return Err(CheckpointError::Length { found: length, wanted });
    }
    Ok(from.read()?)
}

/// The checkpoints that a folder may have, the newest first.
pub fn paths(folder: &Path) -> [PathBuf; 2] {
    NAMES.map(|name| folder.join(name))
}

/// Removes the checkpoints of a folder, if it has any: those of a run that is over, or of another one.
///
/// # Errors
/// The path and the system's reason.
pub fn remove(folder: &Path) -> Result<(), WriteError> {
    paths(folder).iter().try_for_each(|path| remove_if_there(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint(time: f64) -> Checkpoint {
        Checkpoint {
            path: "/scenes/a.json".into(),
            command: "tropism scene.json".into(),
            scene: "{}".into(),
            remarks: vec!["found by pilot runs".into()],
            interval: Some(600.0),
            time,
            state: vec![1, 2, 3],
            recorder: vec![4; 20],
        }
    }

    fn refusal(bytes: &[u8]) -> String {
        Checkpoint::from_bytes(bytes).unwrap_err().to_string()
    }

    #[test]
    fn a_checkpoint_reads_back_and_is_refused_cut_at_any_byte_or_with_any_bit_flipped() {
        let bytes = checkpoint(1.5).to_bytes();
        assert_eq!(Checkpoint::from_bytes(&bytes).unwrap(), checkpoint(1.5));
        for cut in 0..bytes.len() {
            assert!(refusal(&bytes[..cut]).starts_with("is cut"), "cut at {cut}: {}", refusal(&bytes[..cut]));
        }
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(Checkpoint::from_bytes(&flipped).is_err(), "bit {bit}");
        }
        let longer = [bytes.as_slice(), b"x"].concat();
        assert!(refusal(&longer).contains("too long"));
    }

    #[test]
    fn another_kind_of_file_another_format_and_another_version_are_named() {
        assert_eq!(refusal(b"{\"scene\": \"a\", \"seed\": 1}"), "is no checkpoint of tropism");
        let mut bytes = checkpoint(1.5).to_bytes();
        bytes[8] += 1;
        assert_eq!(refusal(&bytes), format!("has format {}; this program reads format {FORMAT}", FORMAT + 1));
        let mut bytes = checkpoint(1.5).to_bytes();
        bytes[HEADER + 8] = b'9';
        let sum = crc32fast::hash(&bytes[HEADER..]);
        bytes[HEADER - 4..HEADER].copy_from_slice(&sum.to_le_bytes());
        assert!(refusal(&bytes).starts_with(&format!("was written by tropism 9{}", &PROGRAM[1..])));
    }

    #[test]
    fn the_one_before_stays_and_files_are_read_as_written() {
        let folder = std::env::temp_dir().join(format!("tropism-checkpoint-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        for time in [1.0, 2.0, 3.0] {
            checkpoint(time).write(&folder).unwrap();
        }
        let times = paths(&folder).map(|path| Checkpoint::read(&path).unwrap().time);
        assert_eq!(times, [3.0, 2.0]);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2, "no temporary is left");
        remove(&folder).unwrap();
        remove(&folder).unwrap();
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        let missing = Checkpoint::read(&folder.join("none")).unwrap_err().to_string();
        assert!(missing.starts_with("cannot be read"), "{missing}");
        fs::remove_dir_all(folder).unwrap();
    }
}
