//! What the command leaves.

use serde_json::Value;
use tropism::study::stability::compression::Effort;
use tropism::study::stability::{Stability, compression, cue_mesh, degenerate, noise, stretched_mesh, turning};

use crate::common::Folder;
use crate::roster;

/// Keys for which there may be nothing to say.
const OPTIONAL: [&str; 12] = [
    "limit",
    "wrong_sign_from",
    "negative_from",
    "lost_at",
    "first_negative",
    "per_side",
    "unstable_from",
    "ended_by",
    "account",
    "counts",
    "speed_drift",
    "apart",
];

fn assert_numbers(value: &Value, key: &str) {
    match value {
        Value::Null => assert!(OPTIONAL.contains(&key), "`{key}` is no number"),
        Value::Object(keys) => keys.iter().for_each(|(key, value)| assert_numbers(value, key)),
        Value::Array(items) => items.iter().for_each(|value| assert_numbers(value, key)),
        _ => {}
    }
}

#[test]
fn the_maps_are_written_as_numbers_and_a_figure_each_and_no_number_is_lost() {
    let roster = roster();
    let effort = Effort { poisson: vec![0.3], rows: vec![4], clamped_rows: vec![4], points: 6 };
    let maps = Stability {
        turning: turning::compute(&roster, 3).unwrap(),
        cue_mesh: cue_mesh::compute(2).unwrap(),
        stretched_mesh: stretched_mesh::compute(2).unwrap(),
        compression: compression::compute(&effort).unwrap(),
        degenerate: degenerate::compute(&roster),
        noise: noise::compute(&roster, 4).unwrap(),
    };
    let folder = Folder::new();
    maps.write(&folder.0).unwrap();
    let text = std::fs::read_to_string(folder.0.join("stability.json")).unwrap();
    assert_numbers(&serde_json::from_str(&text).unwrap(), "");
    for figure in maps.figures() {
        assert!(figure.plots.iter().all(|plot| plot.series.iter().any(|series| !series.points.is_empty())));
        for ending in ["svg", "png"] {
            let path = folder.0.join(format!("{}.{ending}", figure.name));
            assert!(std::fs::metadata(&path).unwrap().len() > 0, "{}", path.display());
        }
    }
    assert_eq!(maps.figures().len(), 6);
}
