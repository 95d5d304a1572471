//! The reports of runs, ablations and charts: what goes into `report.html`.

use super::ablation::{Ablation, Arm};
use super::chart::Chart;
use super::chart::work_precision::{ErrorKind, Factor, Point};
use super::run::{Finished, RunError};
use crate::record::output::write_atomically;
use crate::record::recording::{self, Recording};
use crate::record::report::{Report, ReportChart, ReportFactor, ReportKind, ReportMethod, ReportPoint};
use crate::scenario::load::Loaded;
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// Name of the file.
const FILE_NAME: &str = "report.html";

/// A scene, and what was typed to have it computed.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// The scene.
    pub loaded: &'a Loaded,
    /// The command line.
    pub command: &'a str,
}

impl Asked<'_> {
    /// Writes the recording of a run and the report with it; nothing if it has none.
    ///
    /// # Errors
    /// The file that could not be written.
    pub fn report_run(&self, folder: &Path, finished: &Finished) -> Result<(), RunError> {
        let Some(recording) = &finished.recording else { return Ok(()) };
        let bytes = bytes(recording)?;
        write_atomically(&folder.join(recording::FILE_NAME), &bytes)?;
        let report = Report {
            summary: json(&finished.summary)?,
            notes: [self.hints(), finished.summary.notes.clone()].concat(),
            measures: recording.header.measures.clone(),
            ..self.report(ReportKind::Run, "")
        };
        write(folder, &report, &[("", bytes)])
    }

    /// Writes the report of an ablation: the first seed's run in each arm; nothing if none has a recording.
    ///
    /// # Errors
    /// The file that could not be written.
    pub fn report_ablation(&self, folder: &Path, ablation: &Ablation) -> Result<(), RunError> {
        let recordings = ablation.arms.iter().filter_map(|arm| Some((arm.name.as_str(), arm.recording.as_ref()?)));
        let Some((_, first)) = recordings.clone().next() else { return Ok(()) };
        let recordings = recordings.map(|(name, recording)| Ok((name, bytes(recording)?)));
        let recordings = recordings.collect::<Result<Vec<_>, RunError>>()?;
        let report = Report {
            summary: json(ablation)?,
            notes: [self.hints(), ablation.arms.iter().flat_map(told).collect()].concat(),
            measures: first.header.measures.clone(),
            ..self.report(ReportKind::Ablation, ": ablation")
        };
        write(folder, &report, &recordings)
    }

    /// Writes the report of a chart.
    ///
    /// # Errors
    /// The file that could not be written.
    pub fn report_chart(&self, folder: &Path, chart: &Chart) -> Result<(), RunError> {
        let factors = chart.factors.iter().flat_map(figures).collect();
        let report = Report {
            notes: self.hints(),
            chart: Some(ReportChart { factors }),
            ..self.report(ReportKind::Chart, ": error against time")
        };
        write(folder, &report, &[])
    }

    fn report(&self, kind: ReportKind, after_name: &str) -> Report {
        let scene = &self.loaded.scene;
        Report {
            description: scene.description.clone(),
            command: self.command.to_owned(),
            linkage_distance: scene.output.linkage_distance.0,
            ..Report::new(kind, format!("{}{after_name}", scene.name), self.loaded.merged.clone())
        }
    }

    fn hints(&self) -> Vec<String> {
        self.loaded.hints.iter().map(ToString::to_string).collect()
    }
}

fn bytes(recording: &Recording) -> Result<Vec<u8>, RunError> {
    recording.to_bytes().map_err(|error| RunError::Internal(error.to_string()))
}

fn write(folder: &Path, report: &Report, recordings: &[(&str, Vec<u8>)]) -> Result<(), RunError> {
    let page = report.page(recordings).map_err(|error| RunError::Internal(error.to_string()))?;
    Ok(write_atomically(&folder.join(FILE_NAME), page.as_bytes())?)
}

fn json(value: &impl Serialize) -> Result<Value, RunError> {
    serde_json::to_value(value).map_err(|error| RunError::Internal(error.to_string()))
}

/// What went wrong in an arm.
fn told(arm: &Arm) -> Vec<String> {
    let skipped = arm.skipped.iter().map(|why| format!("{} was skipped: {why}", arm.name));
    let failed = arm.failures.iter().map(|failure| format!("{}, seed {}: {}", arm.name, failure.seed, failure.account));
    skipped.chain(failed).collect()
}

/// One figure an error; one against the knob where there is none.
fn figures(factor: &Factor) -> Vec<ReportFactor> {
    let figure = |x_label: &str, value: &dyn Fn(&Point) -> f64, front: Vec<&Point>| ReportFactor {
        title: factor.title.clone(),
        sentence: format!("{} {}", factor.advice, factor.remark).trim().to_owned(),
        x_label: x_label.to_owned(),
        y_label: "time (s)".to_owned(),
        methods: factor.methods().into_iter().map(|name| method(factor, name, value, &front)).collect(),
    };
    if factor.errors.is_empty() {
        return vec![figure(&factor.knob, &|point| point.knob, Vec::new())];
    }
    let of = |error: &ErrorKind| {
        let value = |point: &Point| point.errors.get(&error.name).copied().unwrap_or(f64::NAN);
        figure(&error.label, &value, factor.front(error))
    };
    factor.errors.iter().map(of).collect()
}

/// The points of a method that have a value.
fn method(factor: &Factor, name: &str, value: &dyn Fn(&Point) -> f64, front: &[&Point]) -> ReportMethod {
    let of_method = factor.points.iter().filter(|point| point.method == name && value(point).is_finite());
    let point = |point: &Point| ReportPoint {
        time_s: point.seconds.median,
        error: value(point),
        setting: point.setting.clone(),
        front: front.iter().any(|other| std::ptr::eq(*other, point)),
        default: point.default,
    };
    ReportMethod { name: name.to_owned(), points: of_method.map(point).collect() }
}
