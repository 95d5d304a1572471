//! The numbers of counts and morphology as a flat list of names and values, as statistics over seeds and tables over time want them.

use super::measures::Morphology;
use super::summary::Counts;
use serde_json::Value;

/// All numbers of counts and morphology, by their dotted place (`counts.arrived`, `length_um.mean`, `heights.0.spread_um`).
///
/// # Errors
/// Measures that are no JSON.
pub fn leaves(counts: &Counts, morphology: &Morphology) -> Result<Vec<(String, f64)>, serde_json::Error> {
    let mut found = Vec::new();
    collect("counts", &serde_json::to_value(counts)?, &mut found);
    collect("", &serde_json::to_value(morphology)?, &mut found);
    Ok(found)
}

fn collect(place: &str, value: &Value, found: &mut Vec<(String, f64)>) {
    // Settings and sample sizes stand among the measures of a run; over seeds they say nothing.
    const CONSTANTS: [&str; 5] = ["share", "y_um", "linkage_um", "n", "axons"];
    let inside = |key: &str| if place.is_empty() { key.to_owned() } else { format!("{place}.{key}") };
    match value {
        Value::Number(number) => found.extend(number.as_f64().map(|x| (place.to_owned(), x))),
        Value::Object(keys) => {
            let measures = keys.iter().filter(|(key, _)| !CONSTANTS.contains(&key.as_str()));
            measures.for_each(|(key, value)| collect(&inside(key), value, found));
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, value)| collect(&inside(&i.to_string()), value, found));
        }
        _ => {}
    }
}
