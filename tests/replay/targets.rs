//! What is done with bytes from outside: by the fuzzer (`fuzz/`), and by the test that replays its seeds.
//!
//! Each takes any bytes and may refuse them, but not panic, hang or ask for much memory.

use std::path::Path;

use miniz_oxide::deflate::compress_to_vec_zlib;
use serde_json::{Value, json};
use tropism::model::quantity::{Length, Quantity, Time};
use tropism::model::unit::{Unit, parse_measure};
use tropism::record::checkpoint::Checkpoint;
use tropism::record::recording::Recording;
use tropism::record::scene_view::scene_figure;
use tropism::scenario::load::Loaded;
use tropism::scenario::merge::{merge, strip_nulls};
use tropism::scenario::outline_file;
use tropism::scenario::read::parse;
use tropism::simulation::Simulation;
use tropism::study::resume::{Resumed, resumed};
use tropism::study::run::read_document;
use tropism::systems::standard;

/// Cells of a mesh, over the area of a triangle, above which a scene is read but not run.
const LARGEST_MESH: f64 = 2000.0;
/// Axons above which a scene is read but not run.
const MOST_AXONS: u64 = 20;
/// The same of a scene whose tissue is stretched.
const LARGEST_MOVING_MESH: f64 = 60.0;
/// Vertices that a scene may be meshed with.
const MOST_SMALL_VERTICES: u64 = 3000;
/// Steps that are taken.
const STEPS: usize = 3;
/// Mesh sizes in the largest coordinate of an outline from a file.
const COARSE: f64 = 10.0;
/// Vertices that such an outline may be meshed with.
const MOST_VERTICES: u64 = 20_000;
/// Tips in all frames of a recording above which it is read but not drawn.
const MOST_TIPS: usize = 10_000;
/// Bytes before the body of a checkpoint.
const CHECKPOINT_HEADER: usize = 24;

/// A scenario: read, and run for three steps if it is small.
pub fn scenario(bytes: &[u8]) {
    let Ok(value) = parse(&String::from_utf8_lossy(bytes)) else { return };
    let roster = standard();
    let Ok(mut loaded) = read_document("fuzzed", value, &roster) else { return };
    if !is_small(&loaded) {
        return;
    }
    // Outlines that nearly touch ask for short edges, whatever the mesh size is.
    loaded.scene.tissue.max_vertices = loaded.scene.tissue.max_vertices.min(MOST_SMALL_VERTICES);
    let Ok(mut simulation) = Simulation::assemble(&loaded, &roster) else { return };
    for _ in 0..STEPS {
        if simulation.is_over() || simulation.step().is_err() {
            return;
        }
    }
}

fn is_small(loaded: &Loaded) -> bool {
    let scene = &loaded.scene;
    let axons: u64 = scene.populations.values().fold(0, |sum, population| population.count.saturating_add(sum));
    let points = scene.tissue.outline.outer().coordinates();
    let extent = |k: usize| {
        let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x[k]), high.max(x[k])));
        high - low
    };
    let cells = extent(0) * extent(1) / scene.tissue.mesh_size.0.powi(2);
    let most_cells = if loaded.blocks.contains_key("matrix") { LARGEST_MOVING_MESH } else { LARGEST_MESH };
    axons <= MOST_AXONS && cells <= most_cells && scene.tissue.refinement.is_none() && scene.accuracy.is_none()
}

/// A scenario and a merge patch on it, one after the other, parted by a line of three dashes.
pub fn patch(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let Some((base, patch)) = text.split_once("\n---\n") else { return };
    let (Ok(mut base), Ok(patch)) = (parse(base), parse(patch)) else { return };
    merge(&mut base, patch);
    strip_nulls(&mut base);
    let _ = read_document("fuzzed", base, &standard());
}

/// A quantity with its unit: what is read is written and read again as the same number.
pub fn units(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(unit) = Unit::parse(&text) {
        assert!(unit.convert(1.0, &unit).is_finite() || text.len() > 20, "{text}");
    }
    let _ = parse_measure(&text);
    for value in [Length::KIND.read(&text), Time::KIND.read(&text)].into_iter().flatten() {
        assert!(value.is_finite(), "{text} is read as {value}");
    }
}

/// An outline in a file of another program, with the keys that its format takes: taken in, and meshed coarsely.
fn outline(keys: Value, bytes: &[u8]) {
    let Ok(filed) = serde_json::from_value(keys) else { unreachable!("the keys of a format") };
    let Ok(polygon) = outline_file::polygon(&filed, &String::from_utf8_lossy(bytes)) else { return };
    let points = polygon["polygon"]["outer"]["points"].as_array().into_iter().flatten();
    let reach =
        points.flat_map(|point| [&point[0], &point[1]]).filter_map(Value::as_f64).fold(0.0, |a, x| x.abs().max(a));
    let size = reach / COARSE;
    let tissue = json!({ "outline": polygon, "mesh_size": size, "max_vertices": MOST_VERTICES });
    let scene = json!({ "tissue": tissue, "populations": {}, "time": { "duration": 1 } });
    let roster = standard();
    if let Ok(loaded) = read_document("fuzzed", scene, &roster) {
        let _ = Simulation::assemble(&loaded, &roster);
    }
}

/// An outline in GeoJSON.
pub fn geojson(bytes: &[u8]) {
    outline(json!({ "geojson": { "file": "fuzzed" } }), bytes);
}

/// An outline in SVG.
pub fn svg(bytes: &[u8]) {
    outline(json!({ "svg": { "file": "fuzzed", "tolerance": "1 um" } }), bytes);
}

/// A Gmsh mesh with its vertices.
pub fn gmsh(bytes: &[u8]) {
    outline(json!({ "gmsh": { "file": "fuzzed", "keep_vertices": true } }), bytes);
}

/// A checkpoint, as it is and with the length and the checksum that its body asks for: what is read is written as the same bytes, and a
/// state that fits its scene is gone on from.
pub fn checkpoint(bytes: &[u8]) {
    go_on(bytes);
    if bytes.len() >= CHECKPOINT_HEADER {
        let (header, body) = bytes.split_at(CHECKPOINT_HEADER);
        let [length, sum] = [(body.len() as u64).to_le_bytes().to_vec(), crc32fast::hash(body).to_le_bytes().to_vec()];
        go_on(&[&header[..12], &length, &sum, body].concat());
    }
}

fn go_on(bytes: &[u8]) {
    let Ok(found) = Checkpoint::from_bytes(bytes) else { return };
    let roster = standard();
    let Ok(value) = parse(&found.scene) else { return };
    let Ok(loaded) = read_document("fuzzed", value, &roster) else { return };
    if !is_small(&loaded) {
        return;
    }
    let Ok(Resumed { mut run, .. }) = resumed(&found, &roster, None) else { return };
    let mut steps = 0;
    let ended = run.to_end(|_| {
        steps += 1;
        (steps == STEPS).then(|| "far enough".to_owned())
    });
    if let Ok(ended) = ended {
        let _ = run.finish(&loaded, &ended);
    }
}

/// A recording, as it is and with its arrays deflated, so that they can be changed: what is read is written and read as the same, and
/// drawn.
pub fn recording(bytes: &[u8]) {
    look_at(bytes);
    let length = bytes.get(8..12).and_then(|word| Some(u32::from_le_bytes(word.try_into().ok()?) as usize));
    let start = length.and_then(|length| length.checked_add(12)?.checked_next_multiple_of(8));
    if let Some((head, arrays)) = start.and_then(|start| bytes.split_at_checked(start)) {
        look_at(&[head, &compress_to_vec_zlib(arrays, 1)].concat());
    }
}

fn look_at(bytes: &[u8]) {
    let Ok(found) = Recording::read(bytes) else { return };
    let written = found.to_bytes().unwrap_or_default();
    let again = Recording::read(&written).and_then(|again| again.to_bytes());
    assert!(again.is_ok_and(|again| again == written), "a recording is not written as it was read");
    if found.header.frames.len() * found.header.axon_count > MOST_TIPS {
        return;
    }
    let (first, last) = found.span();
    let times = [first, first + 0.3 * (last - first), last];
    let snapshots: Vec<_> = times.into_iter().chain(found.figure_times()).take(5).map(|t| found.snapshot(t)).collect();
    let _ = (found.measures(), scene_figure(&found.header.scene, &found.header.description, &snapshots));
}

/// What is done with bytes.
pub type Target = fn(&[u8]);

/// The targets by name.
pub const TARGETS: [(&str, Target); 8] = [
    ("scenario", scenario),
    ("patch", patch),
    ("units", units),
    ("geojson", geojson),
    ("svg", svg),
    ("gmsh", gmsh),
    ("checkpoint", checkpoint),
    ("recording", recording),
];

/// The folder of the seeds of a target.
pub fn seeds(target: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target)
}
