//! The matrix' charts: mesh size, and load levels with what lies between them, against the errors of U and v_φ.

use super::work_precision::{ErrorKind, Factor, short};
use crate::model::components::Site;
use crate::model::configuration::Configuration;
use crate::model::tissue::Tissue;
use crate::scenario::load::Loaded;
use crate::simulation::Simulation;
use crate::study::laboratory::{Laboratory, Setting, root_mean_square, spread_points};
use crate::study::run::RunError;
use nalgebra::Vector3;
use std::collections::BTreeMap;

const SIZES: [f64; 7] = [2.828, 2.0, 1.414, 1.0, 0.707, 0.5, 0.354];
const REFERENCE_SIZE: f64 = 0.177;
const SECOND_SIZE: f64 = 0.25;
const TOLERANCES: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
const REFERENCE_TOLERANCE: f64 = 1e-11;
const COURSES: [&str; 2] = ["cubic", "linear"];
const POINTS: usize = 4_000;
/// Moments looked at, as shares of the run: not those of load levels.
const MOMENTS: [f64; 6] = [0.07, 0.19, 0.37, 0.56, 0.73, 0.93];
const KINDS: [(&str, &str); 2] =
    [("displacement", "relative rms error of U"), ("velocity", "relative rms error of the tissue's velocity")];

/// Displacement and velocity at a point and a moment.
type Moved = (Vector3<f64>, Vector3<f64>);
/// Those at all points and moments.
type Motion = Vec<Moved>;

/// Errors of the matrix against its time, by mesh size and by load levels; none where it does not move.
///
/// # Errors
/// A scene that cannot be assembled.
pub fn charts(laboratory: &Laboratory, tick: &dyn Fn(f64)) -> Result<Vec<Factor>, RunError> {
    let scene = laboratory.scene()?;
    let names = laboratory.roster.names();
    let others: Vec<&str> =
        names.into_iter().filter(|name| *name != "matrix" && scene.blocks.contains_key(*name)).collect();
    let own = laboratory.assemble(&laboratory.load(&others, &[])?)?;
    if !own.world().resource::<Configuration>().moves {
        return Ok(Vec::new());
    }
    let points = spread_points(&scene, &own, POINTS);
    let bench = Bench { laboratory, scene: &scene, others: &others, points: &points };
    let mut factors = vec![bench.mesh_sizes(&|done| tick(0.5 * done))?];
    factors.push(bench.load_levels(&|done| tick(0.5 + 0.5 * done))?);
    Ok(factors)
}

struct Bench<'a> {
    laboratory: &'a Laboratory<'a>,
    scene: &'a Loaded,
    others: &'a [&'a str],
    points: &'a [[f64; 2]],
}

impl Bench<'_> {
    fn mesh_sizes(&self, tick: &dyn Fn(f64)) -> Result<Factor, RunError> {
        let own = self.scene.scene.tissue.mesh_size.0;
        let keys = |size: f64| vec![format!("/tissue/mesh_size={:e}", size * own)];
        let setting = |size: f64| Setting {
            method: "P1".into(),
            words: format!("mesh size {} um", short(size * own)),
            knob: size * own,
            set: keys(size),
            default: size == 1.0,
        };
        let exact = self.motion(&keys(REFERENCE_SIZE))?;
        let second = errors(&self.motion(&keys(SECOND_SIZE))?, &exact);
        // What two meshes differ by, shared out by the order 2 of displacements; singular corners have less.
        let ratio: f64 = SECOND_SIZE / REFERENCE_SIZE;
        let floor = second.into_iter().map(|(name, value)| (name, value / (ratio.powi(2) - 1.0))).collect();
        let factor = Factor {
            name: "matrix_mesh".into(),
            title: "Matrix: mesh size".into(),
            knob: "mesh size (um)".into(),
            errors: kinds(&floor),
            points: Vec::new(),
            remark: format!(
                "{} points at {} moments; time for the equilibria. Where held edges meet free ones the field is singular, which \
                 costs order. Reference: {} of the mesh size.",
                self.points.len(),
                MOMENTS.len(),
                short(REFERENCE_SIZE)
            ),
            advice: String::new(),
        };
        self.measure(factor, &SIZES.map(setting), &exact, tick)
    }

    fn load_levels(&self, tick: &dyn Fn(f64)) -> Result<Factor, RunError> {
        let keys = |tolerance: f64, course: &str| {
            vec![format!("/matrix/tolerance={tolerance:e}"), format!("/matrix/interpolation={course}")]
        };
        let own = self.scene.merged.pointer("/matrix/tolerance").and_then(serde_json::Value::as_f64).unwrap_or(1e-6);
        let setting = |tolerance: f64, course: &str| Setting {
            method: format!("{course} between levels"),
            words: format!("tolerance {tolerance:e}"),
            knob: f64::NAN,
            set: keys(tolerance, course),
            default: course == COURSES[0] && tolerance == own,
        };
        let exact = self.motion(&keys(REFERENCE_TOLERANCE, COURSES[0]))?;
        let floor = errors(&self.motion(&keys(100.0 * REFERENCE_TOLERANCE, COURSES[0]))?, &exact);
        let factor = Factor {
            name: "load_levels".into(),
            title: "Matrix: load levels and what lies between them".into(),
            knob: "distance of levels (share of the load)".into(),
            errors: kinds(&floor),
            points: Vec::new(),
            remark: "The scene's own mesh; the number of levels follows from the tolerance; time for the equilibria."
                .into(),
            advice: String::new(),
        };
        let settings: Vec<Setting> =
            COURSES.iter().flat_map(|course| TOLERANCES.map(|tolerance| setting(tolerance, course))).collect();
        self.measure(factor, &settings, &exact, tick)
    }

    fn measure(
        &self,
        mut factor: Factor,
        settings: &[Setting],
        exact: &Motion,
        tick: &dyn Fn(f64),
    ) -> Result<Factor, RunError> {
        for (done, setting) in settings.iter().enumerate() {
            tick(done as f64 / settings.len() as f64);
            let loaded = self.laboratory.load(self.others, &setting.set)?;
            let (mut simulation, seconds) = self.laboratory.timed_assembly(&loaded, &["matrix"])?;
            let counters = simulation.counters();
            let counts = [("equilibria", counters.matrix_solves), ("newton_iterations", counters.newton_iterations)];
            let counts = counts.map(|(name, count)| (name.to_owned(), count as f64)).into();
            let found = self.look(&mut simulation);
            let mut point = setting.point(seconds, errors(&found, exact), counts);
            if point.knob.is_nan() {
                // The tolerance chose the levels: their distance is what is refined.
                point.knob = 1.0 / (counters.matrix_solves.max(2) - 1) as f64;
            }
            factor.points.push(point);
        }
        Ok(factor)
    }

    fn motion(&self, set: &[String]) -> Result<Motion, RunError> {
        let mut simulation = self.laboratory.assemble(&self.laboratory.load(self.others, set)?)?;
        Ok(self.look(&mut simulation))
    }

    fn look(&self, simulation: &mut Simulation) -> Motion {
        let tissue = simulation.world().resource::<Tissue>();
        let sites: Vec<Site> = self.points.iter().filter_map(|point| tissue.locate(*point)).collect();
        let mut found = Vec::new();
        for share in MOMENTS {
            simulation.look_at(share * self.scene.scene.time.duration.0);
            let world = simulation.world();
            let (tissue, now) = (world.resource::<Tissue>(), world.resource::<Configuration>());
            let moved = |site: &Site| {
                let displacement = now.position(&tissue.mesh, *site) - tissue.reference_position(*site);
                (displacement, now.velocity(&tissue.mesh, *site))
            };
            found.extend(sites.iter().map(moved));
        }
        found
    }
}

fn kinds(floor: &BTreeMap<String, f64>) -> Vec<ErrorKind> {
    let kind = |(name, label): &(&str, &str)| ErrorKind {
        name: (*name).to_owned(),
        label: (*label).to_owned(),
        floor: floor.get(*name).copied().unwrap_or(0.0),
        levels: BTreeMap::new(),
    };
    KINDS.iter().map(kind).collect()
}

fn errors(found: &Motion, exact: &Motion) -> BTreeMap<String, f64> {
    let relative = |of: fn(&Moved) -> Vector3<f64>| {
        let difference = root_mean_square(found.iter().zip(exact).map(|(a, b)| (of(a) - of(b)).norm()));
        let size = root_mean_square(exact.iter().map(|b| of(b).norm()));
        if size > 0.0 { difference / size } else { difference }
    };
    let values = [relative(|motion| motion.0), relative(|motion| motion.1)];
    KINDS.iter().zip(values).map(|((name, _), value)| ((*name).to_owned(), value)).collect()
}
