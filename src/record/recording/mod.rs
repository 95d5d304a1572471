//! A finished run to look at: what was seen at its frames, small enough to lie beside the results.
//!
//! `recording.bin` and the data inside `report.html` are the same bytes, little-endian:
//!
//! | bytes | |
//! |---|---|
//! | 0–7 | `TROPREC1` |
//! | 8–11 | u32: length H of the header |
//! | 12 … 12 + H | the header, UTF-8 JSON: [`Header`], and under `arrays` offset, length, type, shape and coding of each array |
//! | then | zeros to a multiple of 8, then one zlib stream, which inflates to the arrays |
//!
//! Positions are shares of the header's box in steps of 1/65535, concentrations shares of the cue's largest one, times of shaft
//! vertices shares of the last frame's. Shafts are material, so a vertex is stored once for all frames: where a run has struck it
//! out, it has an end beside its birth.
//!
//! [`film`] looks at a world, [`container`] writes and reads, [`check`] refuses what does not fit, [`replay`] makes snapshots.

mod check;
pub mod container;
pub mod film;
pub mod replay;
mod shaft_history;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The version of the header that is written and read.
pub const VERSION: u32 = 1;
/// Name of the file in a run's folder.
pub const FILE_NAME: &str = "recording.bin";
/// Parent of an axon that is no branch.
pub const NO_PARENT: u32 = u32::MAX;
/// End of a shaft vertex that stays.
pub const STAYS: u16 = u16::MAX;
/// Largest quantised number.
pub(super) const FULL: f64 = 65535.0;

/// What a recording says of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// [`VERSION`].
    pub version: u32,
    /// Name of the scene.
    pub scene: String,
    /// What the scene shows.
    pub description: String,
    /// Seed.
    pub seed: u64,
    /// Version of the program.
    pub program: String,
    /// Smallest x and y, largest x and y of whatever is recorded (µm).
    #[serde(rename = "box")]
    pub bounds: [f64; 4],
    /// Times of the frames, ascending (h).
    pub frames: Vec<f64>,
    /// The frames that the scene's own figure shows.
    #[serde(default)]
    pub figure_frames: Vec<usize>,
    /// Growth cones: axons, then those that branches may have.
    pub axon_count: usize,
    /// Names of the populations.
    pub populations: Vec<String>,
    /// What a tip's status means.
    pub status_words: Vec<String>,
    /// The cues.
    pub cues: Vec<RecordedCue>,
    /// The outline by named edge.
    pub borders: Vec<RecordedBorder>,
    /// The targets.
    pub targets: Vec<RecordedTarget>,
    /// Columns over the frames.
    #[serde(default)]
    pub measures: BTreeMap<String, Vec<f64>>,
}

/// A cue of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedCue {
    /// Its name.
    pub name: String,
    /// `attract`, `repel`, or none if nothing turns by it.
    pub effect: Option<String>,
    /// Largest concentration at a vertex over all frames (nM).
    pub maximum: f64,
    /// The frames at which a new field is stored, the first one 0; each holds until the next.
    pub frames: Vec<usize>,
}

/// A piece of a named edge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedBorder {
    /// The edge's name.
    pub name: String,
    /// Vertices of the mesh along it.
    pub vertices: Vec<u32>,
}

/// The closed border of a target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedTarget {
    /// Its name.
    pub name: String,
    /// Always true: the last point is followed by the first.
    pub closed: bool,
    /// Positions at the first frame (µm).
    pub points: Vec<[f64; 2]>,
    /// The cell that each point is a corner of.
    pub cells: Vec<u32>,
    /// Weights of the cell's vertices 1 and 2 at each point, times 65535.
    pub weights: Vec<[u16; 2]>,
}

/// A recording, as it is stored: quantised, and in the order of the contract.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// What it says of itself.
    pub header: Header,
    /// Vertices of the mesh.
    pub vertex_count: usize,
    /// Triangles, flat, stride 3.
    pub cells: Vec<u32>,
    /// Vertex positions, flat: frames (or one, if the tissue never moves), vertices, x and y.
    pub vertices: Vec<u16>,
    /// Of each cue, its fields one after another.
    pub cues: Vec<Vec<u16>>,
    /// Tips, flat: frames, axons, x and y.
    pub tip_position: Vec<u16>,
    /// Headings over 2π in steps of 1/256: frames, axons.
    pub tip_heading: Vec<u8>,
    /// Index in the header's status words: frames, axons.
    pub tip_status: Vec<u8>,
    /// Index of each axon's population.
    pub axon_population: Vec<u16>,
    /// When each axon is born (h).
    pub axon_birth: Vec<f32>,
    /// Heading of each axon at its birth, counter-clockwise from +x (rad); none in recordings of version 0.1.0 before this array came.
    pub axon_heading: Option<Vec<f32>>,
    /// The axon that a branch sprouted from, or [`NO_PARENT`].
    pub axon_parent: Vec<u32>,
    /// Where each shaft's vertices begin; one more entry than axons.
    pub shaft_start: Vec<u32>,
    /// The cell of each shaft vertex.
    pub shaft_cell: Vec<u32>,
    /// Weights of the cell's vertices 1 and 2, times 65535, flat.
    pub shaft_weights: Vec<u16>,
    /// Since when a shaft vertex is there: share of the last frame's time, times 65535.
    pub shaft_time: Vec<u16>,
    /// When it was struck out, likewise, or [`STAYS`]; none if none ever was.
    pub shaft_end: Option<Vec<u16>>,
}

impl Recording {
    /// Number of fields of vertex positions: one, or one a frame.
    pub fn vertex_frames(&self) -> usize {
        self.vertices.len() / (2 * self.vertex_count).max(1)
    }
}

/// Why a file is no recording, or not a whole one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// The first eight bytes are others.
    #[error("it does not begin with TROPREC1: it is no recording of tropism")]
    NotOne,
    /// The file ends too soon.
    #[error("it is cut off: {what} ends at byte {needed}, the file at byte {found}")]
    Cut {
        /// What is not whole.
        what: &'static str,
        /// Bytes that it takes.
        needed: usize,
        /// Bytes there are.
        found: usize,
    },
    /// Another version of the format.
    #[error("it has version {0}; this program reads version {VERSION}")]
    Version(u64),
    /// The header is no JSON, or lacks something.
    #[error("its header cannot be read: {0}")]
    Header(String),
    /// The arrays cannot be inflated, or are more or fewer than the header says.
    #[error("its arrays cannot be read: {0}")]
    Payload(String),
    /// An array is missing, has another type, size or place than it must have, or names what is not there.
    #[error("array `{name}`: {problem}")]
    Array {
        /// The array.
        name: String,
        /// What is wrong.
        problem: String,
    },
}

impl RecordingError {
    /// Something wrong with an array.
    fn array(name: &str, problem: impl Into<String>) -> Self {
        Self::Array { name: name.to_owned(), problem: problem.into() }
    }
}
