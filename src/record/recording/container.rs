//! A recording as bytes, and back. What is read is measured against the file before anything is allocated for it.

use super::{Header, RecordedCue, Recording, RecordingError, VERSION};
use miniz_oxide::deflate::compress_to_vec_zlib;
use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_zlib_with_limit};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

const MAGIC: &[u8; 8] = b"TROPREC1";
/// Bytes before the header.
const PREAMBLE: usize = 12;
/// Bytes that the arrays of a recording have at most.
const MOST_BYTES: usize = 1 << 31;
/// How hard zlib tries, of 10.
const LEVEL: u8 = 6;

/// Where an array lies in the inflated payload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Place {
    offset: usize,
    length: usize,
    #[serde(rename = "type")]
    kind: String,
    shape: Vec<usize>,
    coding: String,
}

/// An array to be written.
#[derive(Debug, Clone, Copy)]
enum Items<'a> {
    Bytes(&'a [u8]),
    /// Differences between rows, in byte planes.
    Rows(&'a [u16]),
    Shorts(&'a [u16]),
    Words(&'a [u32]),
    Floats(&'a [f32]),
}

impl Recording {
    /// The recording as the bytes of `recording.bin`.
    ///
    /// # Errors
    /// A header that is no JSON, or a payload that cannot be deflated: neither happens to what a film has seen.
    pub fn to_bytes(&self) -> Result<Vec<u8>, RecordingError> {
        let mut payload = Payload::default();
        let (frames, axons) = (self.header.frames.len(), self.header.axon_count);
        payload.add("cells", &[self.cells.len() / 3, 3], Items::Words(&self.cells));
        payload.add("vertices", &[self.vertex_frames(), self.vertex_count, 2], Items::Rows(&self.vertices));
        for (index, (cue, fields)) in self.header.cues.iter().zip(&self.cues).enumerate() {
            payload.add(&format!("cue_{index}"), &[cue.frames.len(), self.vertex_count], Items::Rows(fields));
        }
        payload.add("tip_position", &[frames, axons, 2], Items::Rows(&self.tip_position));
        payload.add("tip_heading", &[frames, axons], Items::Bytes(&self.tip_heading));
        payload.add("tip_status", &[frames, axons], Items::Bytes(&self.tip_status));
        payload.add("axon_population", &[axons], Items::Shorts(&self.axon_population));
        payload.add("axon_birth", &[axons], Items::Floats(&self.axon_birth));
        if let Some(headings) = &self.axon_heading {
            payload.add("axon_heading", &[axons], Items::Floats(headings));
        }
        payload.add("axon_parent", &[axons], Items::Words(&self.axon_parent));
        let stored = self.shaft_cell.len();
        payload.add("shaft_start", &[axons + 1], Items::Words(&self.shaft_start));
        payload.add("shaft_cell", &[stored], Items::Words(&self.shaft_cell));
        payload.add("shaft_weights", &[stored, 2], Items::Shorts(&self.shaft_weights));
        payload.add("shaft_time", &[stored], Items::Rows(&self.shaft_time));
        if let Some(ends) = &self.shaft_end {
            payload.add("shaft_end", &[stored], Items::Rows(ends));
        }
        payload.assemble(&self.header)
    }

    /// Reads the bytes of a `recording.bin`.
    ///
    /// # Errors
    /// What is cut off, of another version, of another size than it says, or names what is not there.
    pub fn read(bytes: &[u8]) -> Result<Self, RecordingError> {
        let (header, places, start) = read_header(bytes)?;
        let payload = inflate(&bytes[start..], &places)?;
        let arrays = Arrays { payload: &payload, places: &places };
        let (frames, axons) = (header.frames.len(), header.axon_count);
        let [cell_count, _] = arrays.shape("cells")?;
        let [vertex_frames, vertex_count, _] = arrays.shape("vertices")?;
        let [stored] = arrays.shape("shaft_cell")?;
        if vertex_frames != 1 && vertex_frames != frames {
            let problem = format!("{vertex_frames} fields of positions for {frames} frames");
            return Err(RecordingError::array("vertices", problem));
        }
        let cue = |(index, cue): (usize, &RecordedCue)| {
            arrays.shorts(&format!("cue_{index}"), &[cue.frames.len(), vertex_count])
        };
        let ends = places.contains_key("shaft_end").then(|| arrays.shorts("shaft_end", &[stored])).transpose()?;
        let recording = Self {
            vertex_count,
            cells: arrays.words("cells", &[cell_count, 3])?,
            vertices: arrays.shorts("vertices", &[vertex_frames, vertex_count, 2])?,
            cues: header.cues.iter().enumerate().map(cue).collect::<Result<_, _>>()?,
            tip_position: arrays.shorts("tip_position", &[frames, axons, 2])?,
            tip_heading: arrays.bytes("tip_heading", "u8", &[frames, axons], 1)?.to_vec(),
            tip_status: arrays.bytes("tip_status", "u8", &[frames, axons], 1)?.to_vec(),
            axon_population: arrays.shorts("axon_population", &[axons])?,
            axon_birth: arrays.floats("axon_birth", &[axons])?,
            axon_heading: (places.contains_key("axon_heading").then(|| arrays.floats("axon_heading", &[axons])))
                .transpose()?,
            axon_parent: arrays.words("axon_parent", &[axons])?,
            shaft_start: arrays.words("shaft_start", &[axons.saturating_add(1)])?,
            shaft_cell: arrays.words("shaft_cell", &[stored])?,
            shaft_weights: arrays.shorts("shaft_weights", &[stored, 2])?,
            shaft_time: arrays.shorts("shaft_time", &[stored])?,
            shaft_end: ends,
            header,
        };
        recording.check()?;
        Ok(recording)
    }
}

/// The arrays on their way into a file.
#[derive(Debug, Default)]
struct Payload {
    bytes: Vec<u8>,
    places: BTreeMap<String, Place>,
}

impl Payload {
    fn add(&mut self, name: &str, shape: &[usize], items: Items) {
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        let offset = self.bytes.len();
        let row = shape.iter().skip(1).product();
        let (kind, length) = match items {
            Items::Bytes(items) => {
                self.bytes.extend_from_slice(items);
                ("u8", items.len())
            }
            Items::Rows(items) => {
                self.bytes.extend(delta_planes(items, row));
                ("u16", items.len())
            }
            Items::Shorts(items) => {
                self.bytes.extend(items.iter().flat_map(|item| item.to_le_bytes()));
                ("u16", items.len())
            }
            Items::Words(items) => {
                self.bytes.extend(items.iter().flat_map(|item| item.to_le_bytes()));
                ("u32", items.len())
            }
            Items::Floats(items) => {
                self.bytes.extend(items.iter().flat_map(|item| item.to_le_bytes()));
                ("f32", items.len())
            }
        };
        let coding = if matches!(items, Items::Rows(_)) { "delta-planes" } else { "plain" };
        let place = Place { offset, length, kind: kind.into(), shape: shape.to_vec(), coding: coding.into() };
        self.places.insert(name.to_owned(), place);
    }

    fn assemble(self, header: &Header) -> Result<Vec<u8>, RecordingError> {
        let unwritable = |error: serde_json::Error| RecordingError::Header(error.to_string());
        let mut document = serde_json::to_value(header).map_err(unwritable)?;
        document["arrays"] = serde_json::to_value(&self.places).map_err(unwritable)?;
        let text = document.to_string();
        let length = u32::try_from(text.len()).map_err(|error| RecordingError::Header(error.to_string()))?;
        let mut file = [&MAGIC[..], &length.to_le_bytes(), text.as_bytes()].concat();
        file.resize(file.len().next_multiple_of(8), 0);
        file.extend(compress_to_vec_zlib(&self.bytes, LEVEL));
        Ok(file)
    }
}

/// Each row's difference to the one before it (mod 65536), the first as it is; all low bytes, then all high bytes.
fn delta_planes(items: &[u16], row: usize) -> Vec<u8> {
    let row = row.max(1);
    let before = |at: usize| if at < row { 0 } else { items[at - row] };
    let differences: Vec<u16> = items.iter().enumerate().map(|(at, item)| item.wrapping_sub(before(at))).collect();
    let plane = |place: usize| differences.iter().map(move |difference| difference.to_le_bytes()[place]);
    plane(0).chain(plane(1)).collect()
}

/// The inverse of [`delta_planes`]; an even number of bytes.
fn from_delta_planes(bytes: &[u8], row: usize) -> Vec<u16> {
    let (low, high) = bytes.split_at(bytes.len() / 2);
    let mut items: Vec<u16> = low.iter().zip(high).map(|(&low, &high)| u16::from_le_bytes([low, high])).collect();
    for at in row.max(1)..items.len() {
        items[at] = items[at].wrapping_add(items[at - row.max(1)]);
    }
    items
}

/// The header, the places of the arrays, and where the zlib stream begins.
fn read_header(bytes: &[u8]) -> Result<(Header, BTreeMap<String, Place>, usize), RecordingError> {
    let found = bytes.len();
    if !bytes.starts_with(MAGIC) {
        let cut = MAGIC.starts_with(bytes);
        let beginning = RecordingError::Cut { what: "the beginning", needed: PREAMBLE, found };
        return Err(if cut { beginning } else { RecordingError::NotOne });
    }
    let Some(length) = bytes.get(8..PREAMBLE).and_then(|bytes| Some(u32::from_le_bytes(bytes.try_into().ok()?))) else {
        return Err(RecordingError::Cut { what: "the beginning", needed: PREAMBLE, found });
    };
    let end = PREAMBLE.saturating_add(length as usize);
    let text = bytes.get(PREAMBLE..end).ok_or(RecordingError::Cut { what: "the header", needed: end, found })?;
    let start = end.next_multiple_of(8);
    if start >= found {
        return Err(RecordingError::Cut { what: "the header", needed: start + 1, found });
    }
    let unreadable = |error: serde_json::Error| RecordingError::Header(error.to_string());
    let mut document: Value = serde_json::from_slice(text).map_err(unreadable)?;
    match document["version"].as_u64() {
        Some(version) if version == u64::from(VERSION) => {}
        Some(version) => return Err(RecordingError::Version(version)),
        None => return Err(RecordingError::Header("it has no `version`".into())),
    }
    let places = document["arrays"].take();
    let places = serde_json::from_value(places).map_err(|error| RecordingError::Header(format!("arrays: {error}")))?;
    Ok((serde_json::from_value(document).map_err(unreadable)?, places, start))
}

/// The payload, which is as long as the places say, or refused.
fn inflate(stream: &[u8], places: &BTreeMap<String, Place>) -> Result<Vec<u8>, RecordingError> {
    let mut expected = 0;
    for (name, place) in places {
        let bytes = size(&place.kind).and_then(|size| place.length.checked_mul(size));
        let end = bytes.and_then(|bytes| place.offset.checked_add(bytes)).filter(|end| *end <= MOST_BYTES);
        let end = end.ok_or_else(|| RecordingError::array(name, "its type is unknown, or its end lies too far out"))?;
        expected = expected.max(end);
    }
    let payload = decompress_to_vec_zlib_with_limit(stream, expected).map_err(|error| {
        RecordingError::Payload(match error.status {
            TINFLStatus::FailedCannotMakeProgress | TINFLStatus::NeedsMoreInput => "they are cut off".to_owned(),
            TINFLStatus::HasMoreOutput => format!("there are more bytes than the {expected} announced"),
            _ => "they are damaged".to_owned(),
        })
    })?;
    if payload.len() != expected {
        let problem = format!("{expected} bytes are announced, {} are there", payload.len());
        return Err(RecordingError::Payload(problem));
    }
    Ok(payload)
}

fn size(kind: &str) -> Option<usize> {
    match kind {
        "u8" => Some(1),
        "u16" | "i16" => Some(2),
        "u32" | "f32" => Some(4),
        _ => None,
    }
}

/// The arrays of a file.
struct Arrays<'a> {
    payload: &'a [u8],
    places: &'a BTreeMap<String, Place>,
}

impl<'a> Arrays<'a> {
    fn place(&self, name: &str) -> Result<&'a Place, RecordingError> {
        self.places.get(name).ok_or_else(|| RecordingError::array(name, "it is not there"))
    }

    /// The shape of an array that has `N` axes.
    fn shape<const N: usize>(&self, name: &str) -> Result<[usize; N], RecordingError> {
        let shape = &self.place(name)?.shape;
        shape[..].try_into().map_err(|_| RecordingError::array(name, format!("it has {} axes, not {N}", shape.len())))
    }

    /// The bytes of an array of a type and shape.
    fn bytes(&self, name: &str, kind: &str, shape: &[usize], size: usize) -> Result<&'a [u8], RecordingError> {
        let place = self.place(name)?;
        let length = shape.iter().try_fold(1_usize, |product, extent| product.checked_mul(*extent));
        if place.kind != kind || place.shape != shape || Some(place.length) != length {
            let Place { kind: found, shape: extents, length, .. } = place;
            let problem = format!("it has {length} items of {found} in the shape {extents:?}, not {kind} in {shape:?}");
            return Err(RecordingError::array(name, problem));
        }
        let range =
            place.length.checked_mul(size).and_then(|bytes| Some(place.offset..place.offset.checked_add(bytes)?));
        let whole = range.filter(|_| place.offset.is_multiple_of(8)).and_then(|range| self.payload.get(range));
        whole.ok_or_else(|| RecordingError::array(name, format!("its offset {} is no place for it", place.offset)))
    }

    fn shorts(&self, name: &str, shape: &[usize]) -> Result<Vec<u16>, RecordingError> {
        let bytes = self.bytes(name, "u16", shape, 2)?;
        match self.place(name)?.coding.as_str() {
            "delta-planes" => Ok(from_delta_planes(bytes, shape.iter().skip(1).product())),
            "plain" => Ok(bytes.chunks_exact(2).map(|item| u16::from_le_bytes([item[0], item[1]])).collect()),
            other => Err(RecordingError::array(name, format!("the coding `{other}` is unknown"))),
        }
    }

    fn words(&self, name: &str, shape: &[usize]) -> Result<Vec<u32>, RecordingError> {
        let bytes = self.bytes(name, "u32", shape, 4)?.chunks_exact(4);
        Ok(bytes.map(|item| u32::from_le_bytes([item[0], item[1], item[2], item[3]])).collect())
    }

    fn floats(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, RecordingError> {
        let bytes = self.bytes(name, "f32", shape, 4)?.chunks_exact(4);
        Ok(bytes.map(|item| f32::from_le_bytes([item[0], item[1], item[2], item[3]])).collect())
    }
}
