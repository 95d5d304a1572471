//! The whole scene's chart: what a coarser step or mesh changes in the measures that a biologist reads, beside what another
//! seed changes.

use super::work_precision::{ErrorKind, Factor, Point, Seconds, short, time};
use crate::record::statistics;
use crate::record::summary::Summary;
use crate::scenario::load::Loaded;
use crate::study::laboratory::{Laboratory, Setting};
use crate::study::run::{Records, RunError, simulate};
use std::collections::BTreeMap;

/// Steps over the scene's own, the finest first: it is the reference.
const STEPS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// Mesh sizes over the scene's own, beside that itself.
const MESHES: [f64; 2] = [0.5, 2.0];
const KINDS: [(&str, &str); 4] = [
    ("hits", "change of the hit fraction"),
    ("spread", "change of the spread at the highest height (um)"),
    ("fascicles", "change of the number of fascicles there"),
    ("turning", "change of the mean turning angle (degrees)"),
];

/// Measures of one run: hit fraction, spread (µm), fascicles, turning angle (degrees); none where a scene has no such thing.
type Measures = [Option<f64>; 4];

/// Change of the measures against the time for a run, over seeds.
///
/// # Errors
/// A scene that cannot be assembled.
pub fn chart(laboratory: &Laboratory, tick: &dyn Fn(f64)) -> Result<Factor, RunError> {
    let scene = laboratory.scene()?;
    let variants = STEPS.map(|step| (step, 1.0)).into_iter().chain(MESHES.map(|mesh| (1.0, mesh)));
    let jobs = (STEPS.len() + MESHES.len()) as f64;
    let (mut points, mut reference): (Vec<Point>, Vec<Measures>) = (Vec::new(), Vec::new());
    for (done, (step, mesh)) in variants.enumerate() {
        tick(done as f64 / jobs);
        let setting = setting(&scene, step, mesh);
        let (found, seconds) = runs(laboratory, &setting)?;
        if reference.is_empty() {
            reference.clone_from(&found);
        }
        points.push(setting.point(seconds, changes(&found, &reference), BTreeMap::new()));
    }
    let kind = |(k, (name, label)): (usize, &(&str, &str))| {
        let values: Vec<f64> = reference.iter().filter_map(|run| run[k]).collect();
        let spread = statistics::standard_deviation(&values).unwrap_or(0.0);
        let of_mean = 1.96 * spread / (values.len().max(1) as f64).sqrt();
        let levels = [("seed to seed (SD)".to_owned(), spread), ("95 % of the mean".to_owned(), of_mean)];
        ErrorKind { name: (*name).to_owned(), label: (*label).to_owned(), floor: 0.0, levels: levels.into() }
    };
    let told = |(k, _): &(usize, &(&str, &str))| reference.iter().any(|run| run[*k].is_some_and(|value| value != 0.0));
    let errors: Vec<ErrorKind> = KINDS.iter().enumerate().filter(told).map(kind).collect();
    let remark = format!(
        "Means over {} seeds, paired, against a quarter of the step; paths are chaotic, so changes below the 95 % line are those of \
         another draw: numerical error has stopped mattering there.",
        laboratory.seeds
    );
    let advice = advice(&points, &errors);
    Ok(Factor {
        name: "whole_scene".into(),
        title: "The whole scene".into(),
        knob: "step (h), or mesh size (um)".into(),
        errors,
        points,
        remark,
        advice,
    })
}

fn setting(scene: &Loaded, step: f64, mesh: f64) -> Setting {
    let (own_step, own_mesh) = (scene.scene.time.step.0, scene.scene.tissue.mesh_size.0);
    let by_mesh = mesh != 1.0;
    let words = if by_mesh {
        format!("mesh size {} um", short(mesh * own_mesh))
    } else {
        format!("step {} min", short(60.0 * step * own_step))
    };
    Setting {
        method: if by_mesh { "mesh size" } else { "step" }.to_owned(),
        words,
        knob: if by_mesh { mesh * own_mesh } else { step * own_step },
        set: vec![format!("/time/step={:e}", step * own_step), format!("/tissue/mesh_size={:e}", mesh * own_mesh)],
        default: step == 1.0 && mesh == 1.0,
    }
}

fn runs(laboratory: &Laboratory, setting: &Setting) -> Result<(Vec<Measures>, Seconds), RunError> {
    let loaded = laboratory.load(&[], &setting.set)?;
    let (mut found, mut measured) = (Vec::new(), Vec::new());
    for place in 0..laboratory.seeds {
        let mut own = loaded.clone();
        own.scene.seed += place;
        let finished = simulate(&own, laboratory.roster, &laboratory.request.path, Records::NOTHING, |_| {})?;
        measured.push(finished.summary.cost.seconds.values().sum());
        found.push(measures(&finished.summary));
    }
    let seconds = Seconds::of(&measured).ok_or_else(|| RunError::Internal("a chart needs a seed".into()))?;
    Ok((found, seconds))
}

fn measures(summary: &Summary) -> Measures {
    let highest = summary.morphology.heights.last();
    let fascicles = highest.map(|height| height.fascicles.count as f64);
    let turning = summary.morphology.turning_angle_deg.as_ref().map(|angle| angle.mean);
    [summary.morphology.hits.fraction, highest.and_then(|height| height.spread_um), fascicles, turning]
}

/// |mean over seeds of the paired difference|.
fn changes(found: &[Measures], reference: &[Measures]) -> BTreeMap<String, f64> {
    let change = |k: usize| {
        let pairs: Vec<f64> = found.iter().zip(reference).filter_map(|(a, b)| Some(a[k]? - b[k]?)).collect();
        statistics::mean(&pairs).unwrap_or(0.0).abs()
    };
    KINDS.iter().enumerate().map(|(k, (name, _))| ((*name).to_owned(), change(k))).collect()
}

/// The fastest setting whose changes all lie below what the seeds leave undecided.
fn advice(points: &[Point], errors: &[ErrorKind]) -> String {
    let below =
        |point: &&Point| errors.iter().all(|error| point.errors[&error.name] <= error.levels["95 % of the mean"]);
    let fastest = points.iter().skip(1).filter(below).min_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median));
    match fastest {
        Some(point) => format!(
            "The fastest setting whose measures do not differ from the reference's beyond the seeds' own 95 % is {} ({} a run).",
            point.setting,
            time(point.seconds.median)
        ),
        None => "Every setting changes some measure beyond the seeds' own 95 %: take a shorter step.".to_owned(),
    }
}
