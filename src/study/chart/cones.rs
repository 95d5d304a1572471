//! The growth cones' chart: integrator and step against the error of tips and headings.

use super::work_precision::{ErrorKind, Factor, short};
use crate::scenario::load::Loaded;
use crate::study::laboratory::{
    ConeView, Laboratory, Setting, angle_between, chaotic, cones, few_axons, root_mean_square, run_until,
};
use crate::study::run::RunError;
use serde_json::Value;
use std::collections::BTreeMap;

/// Axons a population at most: enough for a root mean square, few enough for a reference far finer than the rest.
pub(super) const MOST_AXONS: u64 = 60;
/// Steps as powers of two times the scene's own: two decades.
const POWERS: [i32; 7] = [2, 1, 0, -1, -2, -3, -4];
/// Step of the reference, likewise.
const REFERENCE: i32 = -6;
/// The part of the run after which tips that feel each other are compared; later, chaos has forgotten the method.
const CONTACT_SHARE: f64 = 1.0 / 6.0;
const FIXED: [&str; 4] = ["euler", "heun", "rk4", "rotation"];
const ADAPTIVE: &str = "bogacki_shampine";
/// Tolerances of the adaptive pair (µm a step).
const TOLERANCES: [f64; 5] = [1.0, 1e-1, 1e-2, 1e-3, 1e-4];

/// Error of tips against time: of the smooth motion, on the same Brownian paths if the scene has noise, and with contact if it
/// has that.
///
/// # Errors
/// A scene that cannot be assembled or run.
pub fn charts(laboratory: &Laboratory, tick: &dyn Fn(f64)) -> Result<Vec<Factor>, RunError> {
    let scene = laboratory.scene()?;
    let has = |name: &str| scene.blocks.contains_key(name);
    let end = scene.scene.time.duration.0;
    let mut cases = vec![Case {
        name: "cones",
        title: "Growth cones without contact and noise",
        without: chaotic(&scene),
        stop: end,
        adaptive: true,
        exact: "rk4",
        remark: format!(
            "At most {MOST_AXONS} axons a population, to the end. Reference: rk4 with 1/64 of the step. The gradient of P1 fields \
             has kinks at edges, and borders and targets are met within steps: both limit orders."
        ),
    }];
    if has("heading_noise") {
        cases.push(Case {
            name: "cones_with_noise",
            title: "Growth cones with noise, without contact",
            without: ["fasciculation"].into_iter().filter(|name| has(name)).collect(),
            remark: "The same Brownian paths at every step; with them each method is of strong order 1. Reference: rotation with \
                     1/64 of the step."
                .to_owned(),
            exact: "rotation",
            ..cases[0].clone()
        });
    }
    if has("fasciculation") {
        let stop = CONTACT_SHARE * end;
        cases.push(Case {
            name: "cones_with_contact",
            title: "Growth cones with contact",
            without: Vec::new(),
            stop,
            adaptive: false,
            exact: "rotation",
            remark: format!(
                "Up to t = {} h, before chaos forgets the method. Cones read the shafts of the step's start, so contact is of \
                 first order by construction whatever the method. Reference: rotation with 1/64 of the step.",
                short(stop)
            ),
        });
    }
    let of = |(done, case): (usize, &Case)| {
        measure(laboratory, &scene, case, &|share| tick((done as f64 + share) / cases.len() as f64))
    };
    cases.iter().enumerate().map(of).collect()
}

/// What of a scene is run, and how far.
#[derive(Debug, Clone)]
struct Case {
    name: &'static str,
    title: &'static str,
    without: Vec<&'static str>,
    /// Where tips are compared (h).
    stop: f64,
    /// Whether the adaptive pair is tried.
    adaptive: bool,
    /// Method of the reference.
    exact: &'static str,
    remark: String,
}

fn step_key(scene: &Loaded, power: i32) -> (f64, String) {
    let step = scene.scene.time.step.0 * 2f64.powi(power);
    (step, format!("/time/step={step:e}"))
}

fn fixed(scene: &Loaded, method: &str, power: i32) -> Setting {
    let (step, key) = step_key(scene, power);
    Setting {
        method: method.to_owned(),
        words: format!("step {} min", short(60.0 * step)),
        knob: step,
        set: vec![format!("/time/method={method}"), key],
        default: power == 0 && own_method(scene) == method,
    }
}

/// The scene's method; where it names none, the program's.
fn own_method(scene: &Loaded) -> &str {
    scene.merged.pointer("/time/method").and_then(Value::as_str).unwrap_or("rotation")
}

fn adaptive(scene: &Loaded, tolerance: f64) -> Setting {
    let (_, key) = step_key(scene, POWERS[0]);
    Setting {
        method: ADAPTIVE.to_owned(),
        words: format!("tolerance {tolerance:e} um"),
        knob: tolerance,
        set: vec![format!("/time/method={ADAPTIVE}"), format!("/time/tolerance={tolerance:e}"), key],
        default: false,
    }
}

fn measure(laboratory: &Laboratory, scene: &Loaded, case: &Case, tick: &dyn Fn(f64)) -> Result<Factor, RunError> {
    let few = few_axons(scene, MOST_AXONS);
    let load = |set: &[String]| laboratory.load(&case.without, &[&few, set].concat());
    let finest = |power: i32| {
        let mut simulation = laboratory.assemble(&load(&fixed(scene, case.exact, power).set)?)?;
        run_until(&mut simulation, case.stop)?;
        Ok::<_, RunError>(cones(&simulation))
    };
    let reference = finest(REFERENCE)?;
    // What halving the step still changes is more than the error of the finer one.
    let floor = differences(&finest(REFERENCE + 1)?, &reference);
    let mut settings: Vec<Setting> =
        FIXED.iter().flat_map(|method| POWERS.map(|power| fixed(scene, method, power))).collect();
    if case.adaptive {
        settings.extend(TOLERANCES.map(|tolerance| adaptive(scene, tolerance)));
    }
    let mut points = Vec::new();
    for (done, setting) in settings.iter().enumerate() {
        tick(done as f64 / settings.len() as f64);
        let (simulation, seconds) = laboratory.timed_run(&load(&setting.set)?, case.stop, &[])?;
        let counters = simulation.counters();
        let counts = [("steps", counters.steps), ("stages", counters.stages), ("cone_steps", counters.cone_steps)];
        let counts = counts.map(|(name, count)| (name.to_owned(), count as f64)).into();
        points.push(setting.point(seconds, differences(&cones(&simulation), &reference), counts));
    }
    let kind = |(name, label): &(&str, &str)| ErrorKind {
        name: (*name).to_owned(),
        label: (*label).to_owned(),
        floor: floor[*name],
        levels: BTreeMap::new(),
    };
    Ok(Factor {
        name: case.name.to_owned(),
        title: case.title.to_owned(),
        knob: "step (h), or tolerance (um)".into(),
        errors: KINDS.iter().map(kind).collect(),
        points,
        remark: case.remark.clone(),
        advice: String::new(),
    })
}

const KINDS: [(&str, &str); 3] = [
    ("position_median", "median error of the tip's position (um)"),
    ("position", "rms error of the tip's position (um)"),
    ("heading", "rms error of the heading (degrees)"),
];

fn differences(found: &[ConeView], exact: &[ConeView]) -> BTreeMap<String, f64> {
    let pairs = || found.iter().zip(exact);
    let mut apart: Vec<f64> = pairs().map(|(a, b)| (a.position - b.position).norm()).collect();
    apart.sort_by(f64::total_cmp);
    let values = [
        apart.get(apart.len() / 2).copied().unwrap_or(0.0),
        root_mean_square(apart.iter().copied()),
        root_mean_square(pairs().map(|(a, b)| angle_between(&a.heading, &b.heading))),
    ];
    KINDS.iter().zip(values).map(|((name, _), value)| ((*name).to_owned(), value)).collect()
}
