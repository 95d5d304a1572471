//! A chart as files: one table, one JSON document, one figure a factor.

use super::Chart;
use super::work_precision::{ErrorKind, Factor, Point, Slope};
use crate::record::output::write_atomically;
use crate::record::plot::{Axis, Level, Mark, Plot, Series, Stroke, draw};
use crate::study::report::Asked;
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
    growth: Vec<Slope>,
}

/// Writes `chart.json`, `chart.csv`, `report.html` and `chart_<factor>.svg/.png`.
///
/// # Errors
/// The file that could not be written, or the picture that could not be drawn.
pub fn write(folder: &Path, asked: Asked, chart: &Chart) -> Result<(), RunError> {
    let reported = |factor| Reported {
        factor,
        slopes: factor.errors.iter().map(|error| (error.name.as_str(), factor.slopes(error))).collect(),
        front: factor.errors.iter().map(|error| (error.name.as_str(), front_words(factor, error))).collect(),
        growth: if factor.errors.is_empty() { factor.growth() } else { Vec::new() },
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
    asked.report_chart(folder, chart)?;
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

/// One row a setting and an error; a row without error where methods agree exactly.
fn table(chart: &Chart) -> String {
    let mut text =
        "factor,method,setting,knob,error_kind,error,floor,seconds_median,seconds_low,seconds_high,on_front,default\n"
            .to_owned();
    for factor in &chart.factors {
        let mut row = |point: &Point, error: String, on_front: bool| {
            let Point { method, setting, knob, seconds, default, .. } = point;
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{},\"{method}\",\"{setting}\",{knob:e},{error},{:e},{:e},{:e},{on_front},{default}",
                factor.name, seconds.median, seconds.low, seconds.high
            );
        };
        for error in &factor.errors {
            let front = factor.front(error);
            for point in &factor.points {
                let value = point.errors.get(&error.name).copied().unwrap_or(f64::NAN);
                let on_front = front.iter().any(|other| std::ptr::eq(*other, point));
                row(point, format!("{},{value:e},{:e}", error.name, error.floor), on_front);
            }
        }
        if factor.errors.is_empty() {
            factor.points.iter().for_each(|point| row(point, ",,".to_owned(), false));
        }
    }
    text
}

/// Time against error, one plot an error; against the knob where there is none.
fn plots(factor: &Factor) -> Vec<Plot> {
    if factor.errors.is_empty() {
        let growth = orders("Time grows with the power", &factor.growth());
        return vec![plot(factor, &factor.knob, &|point| point.knob, Vec::new(), growth)];
    }
    let of = |error: &ErrorKind| {
        let value = |point: &Point| point.errors.get(&error.name).copied().unwrap_or(f64::NAN);
        let front = factor.front(error).into_iter().map(|point| [value(point), point.seconds.median]);
        let front = Series::new("Pareto front", front, Stroke::Underlay);
        let floor = (error.floor > 0.0).then(|| Level { name: "floor".into(), at: error.floor, vertical: true });
        let levels = error.levels.iter().map(|(name, at)| Level { name: name.clone(), at: *at, vertical: true });
        let fitted = orders("Fitted orders", &factor.slopes(error));
        let mut plot = plot(factor, &error.label, &value, vec![front], fitted);
        plot.levels = floor.into_iter().chain(levels).collect();
        plot
    };
    factor.errors.iter().map(of).collect()
}

fn plot(factor: &Factor, label: &str, value: &dyn Fn(&Point) -> f64, further: Vec<Series>, note: String) -> Plot {
    let series = |method: &str| {
        let of_method: Vec<&Point> = factor.points.iter().filter(|point| point.method == method).collect();
        Series {
            whiskers: of_method.iter().map(|point| [point.seconds.low, point.seconds.high]).collect(),
            ..Series::new(
                method,
                of_method.iter().map(|point| [value(point), point.seconds.median]),
                Stroke::LineAndMarks,
            )
        }
    };
    let own = factor.points.iter().filter(|point| point.default);
    Plot {
        title: String::new(),
        x: Axis::logarithmic(label),
        y: Axis::logarithmic("time (s)"),
        series: factor.methods().into_iter().map(series).chain(further).collect(),
        levels: Vec::new(),
        marks: own.map(|point| Mark { name: "this scene".into(), at: [value(point), point.seconds.median] }).collect(),
        note,
    }
}

fn orders(what: &str, slopes: &[Slope]) -> String {
    if slopes.is_empty() {
        return String::new();
    }
    let each: Vec<String> = slopes.iter().map(|slope| format!("{} {:.2}", slope.method, slope.order)).collect();
    format!("{what}: {}.", each.join("; "))
}
