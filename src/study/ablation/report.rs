//! An ablation as files: one document, one table, one figure.

use super::Ablation;
use crate::record::csv::{Cell, CsvTable, RowError};
use crate::record::manifest::Manifest;
use crate::record::statistics::SummaryOverSeeds;
use crate::study::report::Asked;
use crate::study::run::{RunError, write_json, write_picture};
use std::path::Path;

/// Writes `ablation.json`, `ablation.csv`, `manifest.json` and, if any first run came to its end, `report.html`, `figure.svg` and
/// `figure.png`.
///
/// # Errors
/// The file that could not be written, or the picture that could not be drawn.
pub fn write(folder: &Path, asked: Asked, ablation: &Ablation) -> Result<(), RunError> {
    write_json(&folder.join("ablation.json"), ablation)?;
    write_json(&folder.join("manifest.json"), &Manifest::of(asked.loaded))?;
    let mut table = table(ablation).map_err(|error| RunError::Internal(error.to_string()))?;
    table.write(&folder.join("ablation.csv"))?;
    asked.report_ablation(folder, ablation)?;
    match ablation.figure()? {
        Some(figure) => write_picture(folder, "figure", &figure),
        None => Ok(()),
    }
}

/// One row an arm and measure, in the measure's own unit; an arm without measures has one row without any.
fn table(ablation: &Ablation) -> Result<CsvTable, RowError> {
    let mut table = CsvTable::new(&[
        ("arm", ""),
        ("status", ""),
        ("measure", ""),
        ("unit", ""),
        ("n", "seeds"),
        ("mean", "unit"),
        ("mean low", "unit"),
        ("mean high", "unit"),
        ("pairs", "seeds"),
        ("difference", "unit"),
        ("difference low", "unit"),
        ("difference high", "unit"),
        ("excludes zero", ""),
    ]);
    for arm in &ablation.arms {
        let head = [Cell::from(arm.name.as_str()), Cell::from(arm.status())];
        if arm.measures.is_empty() {
            table.push(&[head.to_vec(), vec![Cell::Empty; 11]].concat())?;
        }
        for (measure, found) in &arm.measures {
            let difference = arm.differences.get(measure);
            let mut row = head.to_vec();
            row.extend([Cell::from(measure.as_str()), Cell::from(unit_of(measure))]);
            row.extend(numbers(Some(found)));
            row.extend(numbers(difference));
            row.push(difference.map_or(Cell::Empty, |_| Cell::from(arm.differs(measure))));
            table.push(&row)?;
        }
    }
    Ok(table)
}

fn numbers(found: Option<&SummaryOverSeeds>) -> [Cell; 4] {
    match found {
        Some(found) => [found.n.into(), found.mean.into(), found.low.into(), found.high.into()],
        None => [Cell::Empty, Cell::Empty, Cell::Empty, Cell::Empty],
    }
}

/// The unit of a measure, which the name of its key ends with; fractions and counts have none.
fn unit_of(measure: &str) -> &'static str {
    let ending = |key: &str| ["um", "deg", "h"].into_iter().find(|unit| key.ends_with(&format!("_{unit}")));
    measure.split('.').find_map(ending).unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_the_names_of_measures() {
        let measures = ["length_um.mean", "heights.2.spread_um", "turning_angle_deg.sd", "travel_time_h.max"];
        assert_eq!(measures.map(unit_of), ["um", "um", "deg", "h"]);
        assert_eq!(["hits.fraction", "counts.axons", "heights.0.fascicles.count"].map(unit_of), [""; 3]);
    }
}
