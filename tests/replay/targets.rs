//! What is done with bytes from outside: by the fuzzer (`fuzz/`), and by the test that replays its seeds.
//!
//! Each takes any bytes and may refuse them, but not panic, hang or ask for much memory.

use std::path::Path;

use tropism::model::keep::Keep;
use tropism::model::quantity::{Length, Quantity, Time};
use tropism::model::unit::{Unit, parse_measure};
use tropism::record::checkpoint::Checkpoint;
use tropism::scenario::load::Loaded;
use tropism::scenario::merge::{merge, strip_nulls};
use tropism::scenario::read::parse;
use tropism::simulation::Simulation;
use tropism::study::run::read_document;
use tropism::systems::standard;

/// Cells of a mesh, over the area of a triangle, above which a scene is read but not run.
const LARGEST_MESH: f64 = 2000.0;
/// Axons above which a scene is read but not run.
const MOST_AXONS: u64 = 20;
/// Steps that are taken.
const STEPS: usize = 3;

/// A scenario: read, and run for three steps if it is small.
pub fn scenario(bytes: &[u8]) {
    let Ok(value) = parse(&String::from_utf8_lossy(bytes)) else { return };
    let roster = standard();
    let Ok(loaded) = read_document("fuzzed", value, &roster) else { return };
    if !is_small(&loaded) {
        return;
    }
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
    let with_matrix = loaded.blocks.contains_key("matrix");
    axons <= MOST_AXONS
        && cells <= LARGEST_MESH
        && scene.tissue.refinement.is_none()
        && scene.accuracy.is_none()
        && !with_matrix
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

/// A checkpoint: what is read is written as the same bytes.
pub fn checkpoint(bytes: &[u8]) {
    if let Ok(found) = Checkpoint::from_bytes(bytes) {
        assert_eq!(found.to_bytes(), bytes, "a checkpoint is not written as it was read");
    }
    let _ = Vec::<(u64, String)>::restore(&mut tropism::model::keep::KeptBytes::new(bytes));
}

/// What is done with bytes.
pub type Target = fn(&[u8]);

/// The targets by name.
pub const TARGETS: [(&str, Target); 4] =
    [("scenario", scenario), ("patch", patch), ("units", units), ("checkpoint", checkpoint)];

/// The folder of the seeds of a target.
pub fn seeds(target: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target)
}
