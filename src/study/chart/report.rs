//! A chart as files: one table, one JSON document, one figure a factor.

use super::Chart;
use super::work_precision::{ErrorKind, Factor, Slope};
use crate::record::output::write_atomically;
use crate::record::plot::{Axis, Level, Mark, Plot, Series, Stroke, draw};
use crate::study::run::{RunError, write_json, write_picture};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// A factor with what follows from its points.
#[derive(Serialize)]
struct Reported<'a> {
    #[serde(flatten)]
    factor: &'a Factor,
    slopes: Vec<(&'a str, Vec<Slope>)>,
    front: Vec<(&'a str, Vec<String>)>,
}

/// Writes `chart.json`, `chart.csv` and `chart_<factor>.svg/.png`.
///
/// # Errors
/// The file that could not be written, or the picture that could not be drawn.
pub fn write(folder: &Path, chart: &Chart) -> Result<(), RunError> {
    let reported = |factor| Reported {
        factor,
        slopes: factor.errors.iter().map(|error| (error.name.as_str(), factor.slopes(error))).collect(),
        front: factor.errors.iter().map(|error| (error.name.as_str(), front_words(factor, error))).collect(),
    };
    #[derive(Serialize)]
    struct Document<'a> {
        scene: &'a str,
        threads: usize,
        repetitions: usize,
        factors: Vec<Reported<'a>>,
    }
    let document = Document {
        scene: &chart.scene,
        threads: chart.threads,
        repetitions: chart.repetitions,
        factors: chart.factors.iter().map(reported).collect(),
    };
    write_json(&folder.join("chart.json"), &document)?;
    write_atomically(&folder.join("chart.csv"), table(chart).as_bytes())?;
    for factor in &chart.factors {
        let title = format!("{}: {}", chart.scene, factor.title);
        let drawing = draw(&title, &format!("{} {}", factor.advice, factor.remark), &plots(factor))?;
        write_picture(folder, &format!("chart_{}", factor.name), &drawing)?;
    }
    Ok(())
}

fn front_words(factor: &Factor, error: &ErrorKind) -> Vec<String> {
    factor.front(error).iter().map(|point| format!("{}, {}", point.method, point.setting)).collect()
}

/// One row a setting and an error.
fn table(chart: &Chart) -> String {
    let mut text =
        "factor,method,setting,knob,error_kind,error,floor,seconds_median,seconds_low,seconds_high,on_front,default\n"
            .to_owned();
    for factor in &chart.factors {
        for error in &factor.errors {
            let front = factor.front(error);
            for point in &factor.points {
                let value = point.errors.get(&error.name).copied().unwrap_or(f64::NAN);
                let on_front = front.iter().any(|other| std::ptr::eq(*other, point));
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},\"{}\",\"{}\",{:e},{},{value:e},{:e},{:e},{:e},{:e},{on_front},{}",
                    factor.name,
                    point.method,
                    point.setting,
                    point.knob,
                    error.name,
                    error.floor,
                    point.seconds.median,
                    point.seconds.low,
                    point.seconds.high,
                    point.default
                );
            }
        }
    }
    text
}

/// Time against error, one plot an error.
fn plots(factor: &Factor) -> Vec<Plot> {
    factor.errors.iter().map(|error| plot(factor, error)).collect()
}

fn plot(factor: &Factor, error: &ErrorKind) -> Plot {
    let value = |point: &super::work_precision::Point| point.errors.get(&error.name).copied().unwrap_or(f64::NAN);
    let series = |method: &str| {
        let of_method: Vec<_> = factor.points.iter().filter(|point| point.method == method).collect();
        Series {
            whiskers: of_method.iter().map(|point| [point.seconds.low, point.seconds.high]).collect(),
            ..Series::new(
                method,
                of_method.iter().map(|point| [value(point), point.seconds.median]).collect(),
                Stroke::LineAndMarks,
            )
        }
    };
    let mut all: Vec<Series> = factor.methods().into_iter().map(series).collect();
    if error.name != factor.knob {
        let front = factor.front(error).iter().map(|point| [value(point), point.seconds.median]).collect();
        all.push(Series::new("Pareto front", front, Stroke::Underlay));
    }
    let default = factor.points.iter().find(|point| point.default);
    let floor = (error.floor > 0.0).then(|| Level { name: "floor".into(), at: error.floor, vertical: true });
    let levels = error.levels.iter().map(|(name, at)| Level { name: name.clone(), at: *at, vertical: true });
    Plot {
        title: String::new(),
        x: Axis::logarithmic(error.label.clone()),
        y: Axis::logarithmic("time (s)"),
        series: all,
        levels: floor.into_iter().chain(levels).collect(),
        marks: default
            .map(|point| Mark { name: "this scene".into(), at: [value(point), point.seconds.median] })
            .into_iter()
            .collect(),
        note: orders(&factor.slopes(error)),
    }
}

fn orders(slopes: &[Slope]) -> String {
    if slopes.is_empty() {
        return String::new();
    }
    let each: Vec<String> = slopes.iter().map(|slope| format!("{} {:.2}", slope.method, slope.order)).collect();
    format!("Fitted orders: {}.", each.join("; "))
}
