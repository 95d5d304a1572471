//! The chart of mesh size and step together: which of the two the error of a scene comes from, and the joint settings beside
//! those that refine one alone.
//!
//! The joint path scales mesh size and step by one factor k and the tolerance of the load path by k²: cue fields with recovered
//! gradients and the default integrator are of order 2 both, and what lies between load levels is as wrong as the tolerance, so
//! that all parts of the error keep their ratio and fall as k². Two lines through the scene's own setting refine one alone; each
//! flattens where what is left is the other's.

use super::cones::MOST_AXONS;
use super::work_precision::{ErrorKind, Factor, Point, short, time};
use crate::model::configuration::Configuration;
use crate::model::observables::Observables;
use crate::scenario::load::Loaded;
use crate::study::accuracy::difference;
use crate::study::laboratory::{
    ConeView, Laboratory, Setting, angle_between, chaotic, cones, few_axons, root_mean_square, run_until,
};
use crate::study::run::RunError;
use serde_json::Value;
use std::collections::BTreeMap;

/// Settings over the scene's own, by √2; lines that refine one alone have every other.
const SCALES: [f64; 7] = [4.0, 2.828, 2.0, 1.414, 1.0, 0.707, 0.5];
/// The scene's own among them.
const OWN: f64 = 1.0;
/// The reference on the joint path, and the setting that it is judged by.
const REFERENCE: f64 = 0.25;
const SECOND: f64 = 0.354;
/// A name, and whether mesh size and step are scaled.
type Method = (&'static str, bool, bool);
const METHODS: [Method; 3] = [("together", true, true), ("mesh only", true, false), ("step only", false, true)];
/// The largest tolerance of the load path that a scene may have.
const LARGEST_TOLERANCE: f64 = 0.1;
/// Two errors within this share of one another are alike.
const ALIKE: f64 = 0.1;
const KINDS: [(&str, &str); 2] =
    [("tip", "rms error of the tip over the length of its path"), ("heading", "rms error of the heading (degrees)")];

/// Error of tips against the time to put a scene together and run it, by mesh size and step; none in a scene without axons, or
/// that neither reads a cue nor moves, since no mesh matters to it.
///
/// # Errors
/// A scene that cannot be assembled or run.
pub fn chart(laboratory: &Laboratory, tick: &dyn Fn(f64)) -> Result<Option<Factor>, RunError> {
    let scene = laboratory.scene()?;
    let without = chaotic(&scene);
    let few = few_axons(&scene, MOST_AXONS);
    let own = laboratory.assemble(&laboratory.load(&without, &few)?)?;
    let moves = own.world().resource::<Configuration>().moves;
    let meshed = moves || !own.world().resource::<Observables>().fields.is_empty();
    if !meshed || cones(&own).is_empty() {
        return Ok(None);
    }
    let bench = Bench { laboratory, scene: &scene, without: &without, few: &few, moves };
    bench.chart(tick).map(Some)
}

struct Bench<'a> {
    laboratory: &'a Laboratory<'a>,
    scene: &'a Loaded,
    without: &'a [&'a str],
    few: &'a [String],
    /// Whether there is a load path.
    moves: bool,
}

impl Bench<'_> {
    fn chart(&self, tick: &dyn Fn(f64)) -> Result<Factor, RunError> {
        let exact = self.tips(REFERENCE)?;
        let floor = errors(&self.tips(SECOND)?, &exact);
        let jobs: Vec<_> =
            METHODS.into_iter().flat_map(|method| scales(method).map(move |scale| (method, scale))).collect();
        let mut points: Vec<Point> = Vec::new();
        for (done, (method, scale)) in jobs.iter().enumerate() {
            tick(done as f64 / jobs.len() as f64);
            let setting = self.setting(*method, *scale);
            // All lines meet in the scene's own setting: it is measured once, and marked in the first.
            let point = match points.iter().find(|point| point.default).filter(|_| *scale == OWN) {
                Some(own) => Point { method: setting.method, set: setting.set, default: false, ..own.clone() },
                None => self.measured(&setting, &exact)?,
            };
            points.push(point);
        }
        let kind = |(name, label): &(&str, &str)| ErrorKind {
            name: (*name).to_owned(),
            label: (*label).to_owned(),
            floor: floor[*name],
            levels: BTreeMap::new(),
        };
        let joint = if self.moves {
            "mesh size and step by the same factor, the matrix' tolerance by its square"
        } else {
            "mesh size and step by the same factor"
        };
        let mut factor = Factor {
            name: "together".into(),
            title: "Mesh size and step together".into(),
            knob: "mesh size and step over the scene's own".into(),
            errors: KINDS.iter().map(kind).collect(),
            points,
            remark: format!(
                "At most {MOST_AXONS} axons a population, to the end, without contact and noise; time to put the scene together and \
                 to run it. Together: {joint}. Reference: {} of both; its floor is what {} of both still changes.",
                short(REFERENCE),
                short(SECOND)
            ),
            advice: String::new(),
        };
        factor.advice = advice(&factor);
        Ok(factor)
    }

    fn setting(&self, (method, by_mesh, by_step): Method, scale: f64) -> Setting {
        let size = self.scene.scene.tissue.mesh_size.0 * if by_mesh { scale } else { 1.0 };
        let step = self.scene.scene.time.step.0 * if by_step { scale } else { 1.0 };
        let mut set = vec![format!("/tissue/mesh_size={size:e}"), format!("/time/step={step:e}")];
        if self.moves && by_mesh && by_step {
            let own = self.scene.merged.pointer("/matrix/tolerance").and_then(Value::as_f64).unwrap_or(1e-6);
            set.push(format!("/matrix/tolerance={:e}", (own * scale.powi(2)).min(LARGEST_TOLERANCE)));
        }
        Setting {
            method: method.to_owned(),
            words: format!("mesh size {} um, step {} min", short(size), short(60.0 * step)),
            knob: scale,
            set,
            default: by_mesh && by_step && scale == OWN,
        }
    }

    fn load(&self, setting: &Setting) -> Result<Loaded, RunError> {
        self.laboratory.load(self.without, &[self.few, setting.set.as_slice()].concat())
    }

    /// Where tips end on the joint path.
    fn tips(&self, scale: f64) -> Result<Vec<ConeView>, RunError> {
        let mut simulation = self.laboratory.assemble(&self.load(&self.setting(METHODS[0], scale))?)?;
        run_until(&mut simulation, self.scene.scene.time.duration.0)?;
        Ok(cones(&simulation))
    }

    fn measured(&self, setting: &Setting, exact: &[ConeView]) -> Result<Point, RunError> {
        let end = self.scene.scene.time.duration.0;
        let (simulation, seconds) = self.laboratory.timed_whole(&self.load(setting)?, end)?;
        let counters = simulation.counters();
        let counts = [
            ("steps", counters.steps),
            ("cone_steps", counters.cone_steps),
            ("cue_solves", counters.cue_solves),
            ("equilibria", counters.matrix_solves),
        ];
        let counts = counts.map(|(name, count)| (name.to_owned(), count as f64)).into();
        Ok(setting.point(seconds, errors(&cones(&simulation), exact), counts))
    }
}

fn errors(found: &[ConeView], exact: &[ConeView]) -> BTreeMap<String, f64> {
    let angles = found.iter().zip(exact).map(|(a, b)| angle_between(&a.heading, &b.heading));
    let values = [difference(found, exact), root_mean_square(angles)];
    KINDS.iter().zip(values).map(|((name, _), value)| ((*name).to_owned(), value)).collect()
}

fn scales((_, by_mesh, by_step): Method) -> impl Iterator<Item = f64> {
    SCALES.into_iter().step_by(if by_mesh && by_step { 1 } else { 2 })
}

/// Which of mesh and step the error of the scene's own setting comes from, how far the other may go, and what is the fastest
/// setting with no more error.
fn advice(factor: &Factor) -> String {
    let Some(kind) = factor.errors.first() else { return String::new() };
    let value = |point: &Point| point.errors.get(&kind.name).copied().unwrap_or(f64::NAN);
    let Some(own) = factor.points.iter().find(|point| point.default) else { return String::new() };
    let error = value(own);
    let front = factor.front(kind);
    let fastest = front.iter().find(|point| value(point) <= error.max(kind.floor)).map_or(String::new(), |point| {
        let (setting, found, seconds) = (&point.setting, short(value(point)), time(point.seconds.median));
        format!(
            " Fastest with no more error: {setting} ({found} in {seconds}; the scene's own in {}).",
            time(own.seconds.median)
        )
    });
    format!("{}{fastest}", dominance(factor, kind, error))
}

fn dominance(factor: &Factor, kind: &ErrorKind, own: f64) -> String {
    let line = |method: &str| -> Vec<(f64, f64)> {
        let of_method = factor.points.iter().filter(|point| point.method == method);
        of_method.filter_map(|point| Some((point.knob, *point.errors.get(&kind.name)?))).collect()
    };
    let [meshes, steps] = [line(METHODS[1].0), line(METHODS[2].0)];
    let doubt = kind.floor.max(ALIKE * own);
    if meshes.iter().chain(&steps).all(|(_, error)| (error - own).abs() <= doubt) {
        return "Neither mesh size nor step changes tips by more than a tenth of their error or what the reference leaves in doubt."
            .to_owned();
    }
    if own <= kind.floor {
        return format!("The scene's own error lies below what the reference leaves in doubt ({}).", short(kind.floor));
    }
    let finest = |line: &[(f64, f64)]| line.last().map_or(own, |(_, error)| *error);
    let (mesh, step) = (finest(&meshes), finest(&steps));
    let parts = format!(
        "half the mesh size leaves {} of its error of {}, half the step {}",
        short(mesh),
        short(own),
        short(step)
    );
    if (mesh - step).abs() <= ALIKE * own {
        return format!("Mesh and step weigh alike in the scene's own setting: {parts}.");
    }
    let (leads, other, line) = if mesh < step { ("mesh", "step", &steps) } else { ("step", "mesh size", &meshes) };
    // From the scene's own setting upward, as far as the error stays.
    let coarser = line.iter().rev().filter(|(scale, _)| *scale > OWN);
    let further =
        coarser.take_while(|(_, error)| *error <= (1.0 + ALIKE) * own).last().map_or(String::new(), |(scale, _)| {
            format!("; {} times the {other} adds less than a tenth to it", short(*scale))
        });
    format!("The {leads} dominates the error of the scene's own setting: {parts}{further}.")
}
