//! Finite elements: time against error for the cases by which such programs are compared. Run on one thread:
//! `cargo bench --bench fem`.
//!
//! Cue field: the rectangle of `assets/reference/cue_field.json` (kL²/D = 100, three discs, two cues): mesh, assembly,
//! factor, solve and recovered gradient of both cues, and both gradients at 100 000 points; error as root mean square of the
//! gradient's relative error at the reference's probes (closed form). Matrix: the block of `svk_clamped_stretch.json`: one load step
//! from rest to 2 % a side, from the tangent at rest by Newton's method to 1e-12, with the rate there.
//!
//! At scale (`cargo bench --bench fem -- scale` runs nothing else): a mesh of a million triangles; a cue at a million unknowns, solved for the
//! first time, and again with everything kept that can be once the domain has been stretched; the whole load path of a block of 1e5
//! unknowns to 5 % a side, at the options that a scene has by default.

use nalgebra::Vector2;
use serde_json::Value;
use std::sync::Arc;
use std::time::Instant;
use tropism::numerics::hyperelasticity::{Body, Prescribed};
use tropism::numerics::load_path::{LoadPath, LoadPathOptions, LoadPathReport};
use tropism::numerics::locate::{MaterialPoint, SeedGrid};
use tropism::numerics::material::{Lame, StVenantKirchhoff};
use tropism::numerics::newton::{NewtonOptions, equilibrium};
use tropism::numerics::planar_domain::{Outline, PlanarDomain};
use tropism::numerics::reaction_diffusion::{Mass, ReactionDiffusion, Source, StationarySolver};
use tropism::numerics::recovery::GradientRecovery;
use tropism::numerics::simplex_mesh::SimplexMesh;
use tropism::numerics::triangulate::{MeshOptions, triangulate};

const REPETITIONS: usize = 5;
const POINTS: usize = 100_000;
const AT_SCALE: usize = 3;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        at_scale();
        if std::env::args().any(|argument| argument == "scale") {
            return;
        }
        println!("cue field, 2 cues, gradients at {POINTS} points; median of {REPETITIONS}, one thread");
        println!("{:>9} {:>10} {:>9} {:>11} {:>10}", "h/L", "vertices", "seconds", "gradient %", "heading");
        for size in [0.05, 0.035, 0.025, 0.0177, 0.0145, 0.0125, 0.0088, 0.00625, 0.0044] {
            cue_field(size);
        }
        println!("matrix, clamped block, first load step; median of {REPETITIONS}, one thread");
        println!("{:>9} {:>10} {:>9} {:>10}", "h/L", "unknowns", "seconds", "iterations");
        for size in [0.0185, 0.00585] {
            matrix(size);
        }
    });
}

/// Median seconds of a piece of work, and what it gave the last time.
fn timed<T>(repetitions: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let mut run = || {
        let start = Instant::now();
        let found = work();
        (start.elapsed().as_secs_f64(), found)
    };
    let (first, mut last) = run();
    let mut seconds = vec![first];
    for _ in 1..repetitions {
        let (again, found) = run();
        seconds.push(again);
        last = found;
    }
    (median(seconds), last)
}

fn at_scale() {
    println!("at scale; median of {AT_SCALE}, one thread");
    let rectangle = PlanarDomain::rectangle(1.5, 1.0);
    let meshed = |size: f64| triangulate(&rectangle, &[], &MeshOptions::of_size(size)).expect("a mesh");
    let (seconds, fitted) = timed(AT_SCALE, || meshed(0.001_86));
    println!("mesh of {} triangles: {seconds:.2} s", fitted.mesh.cell_count());
    let disc = Outline::disc([0.75, 0.85], 0.08, 0.001_32);
    let fitted = triangulate(&rectangle, &[disc], &MeshOptions::of_size(0.001_32)).expect("a mesh");
    let (mesh, x) = (&fitted.mesh, fitted.mesh.vertices());
    let law = ReactionDiffusion { diffusion: 1.0, degradation: 100.0, mass: Mass::Lumped };
    let sources = [Source::new(&fitted.regions[0], 100.0)];
    let (seconds, mut solver) = timed(AT_SCALE, || {
        let mut solver = StationarySolver::new(mesh, &fitted.regions).expect("a solver");
        std::hint::black_box(solver.solve(&law, x, &sources).expect("a field"));
        solver
    });
    println!("cue at {} unknowns, first solve: {seconds:.2} s", mesh.vertex_count());
    let moved: Vec<[f64; 2]> = x.iter().map(|x| [x[0] * (1.0 - 0.02 * x[1]), 1.05 * x[1]]).collect();
    let (seconds, _) = timed(AT_SCALE, || solver.solve(&law, &moved, &sources).expect("a field"));
    println!("the same once the domain has been stretched by 5 %: {seconds:.2} s");
    let fitted = meshed(0.005_85);
    let body = block(&fitted.mesh, 0.05);
    let (seconds, path) = timed(AT_SCALE, || LoadPath::solve(&body, &LoadPathOptions::default()).expect("a path"));
    let LoadPathReport { solves, newton_iterations, defect, .. } = path.report();
    println!(
        "load path at {} unknowns: {seconds:.2} s ({solves} solves, {newton_iterations} Newton iterations, defect {defect:.1e})",
        body.unknowns()
    );
}

/// The clamped block, whose long sides are drawn apart by a share of its height each.
fn block(mesh: &SimplexMesh<2>, share: f64) -> Body<'_, 2> {
    let lame = Lame::from_young_poisson(1.0, 0.3).expect("a material");
    let mut prescribed = Prescribed::none(mesh.vertex_count());
    for (vertex, x) in mesh.vertices().iter().enumerate().filter(|(_, x)| x[1] == 0.0 || x[1] == 1.0) {
        prescribed.impose(vertex, 0, 0.0);
        prescribed.impose(vertex, 1, if x[1] == 0.0 { -share } else { share });
    }
    Body::new(mesh, Arc::new(StVenantKirchhoff { lame }), prescribed).expect("a body")
}

/// Evenly spread points inside the rectangle.
fn points() -> Vec<[f64; 2]> {
    let fraction = |i: usize, step: f64| (i as f64 * step).fract();
    (0..POINTS).map(|i| [1.5 * fraction(i, 0.754_877_666), fraction(i, 0.569_840_29)]).collect()
}

fn median(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

fn cue_field(size: f64) {
    let points = points();
    let (mut seconds, mut errors, mut vertices) = (Vec::new(), (0.0, 0.0), 0);
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        let discs = [([0.75, 0.85], 0.08), ([0.15, 0.88], 0.06), ([1.35, 0.88], 0.06)];
        let outlines = discs.map(|(centre, radius)| Outline::disc(centre, radius, size));
        let domain = PlanarDomain::rectangle(1.5, 1.0);
        let fitted = triangulate(&domain, &outlines, &MeshOptions::of_size(size)).expect("a mesh");
        let (mesh, x) = (&fitted.mesh, fitted.mesh.vertices());
        let mut solver = StationarySolver::new(mesh, &fitted.regions).expect("a solver");
        let recovery = GradientRecovery::new(mesh).operator(x, true);
        let law = ReactionDiffusion { diffusion: 1.0, degradation: 100.0, mass: Mass::Lumped };
        let gradients: Vec<Vec<[f64; 2]>> = [0..1, 1..3]
            .map(|regions| {
                let sources: Vec<_> = fitted.regions[regions].iter().map(|cells| Source::new(cells, 100.0)).collect();
                recovery.apply(&solver.solve(&law, x, &sources).expect("a field"))
            })
            .into();
        let grid = SeedGrid::new(mesh, x);
        let at = |point: MaterialPoint<2>, k: usize| Vector2::from(point.interpolate_vector(mesh, &gradients[k]));
        let located = |point: &[f64; 2]| grid.locate(mesh, x, *point);
        let sum: Vector2<f64> = points.iter().filter_map(located).map(|point| at(point, 0) + at(point, 1)).sum();
        std::hint::black_box(sum);
        seconds.push(start.elapsed().as_secs_f64());
        vertices = mesh.vertex_count();
        errors = probe_errors(|point, k| grid.locate(mesh, x, point).map(|point| at(point, k)));
    }
    println!("{size:>9} {vertices:>10} {:>9.3} {:>11.3} {:>9.3}°", median(seconds), 100.0 * errors.0, errors.1);
}

/// Root mean squares over probes and cues: relative error of the gradient, and angle (degrees).
fn probe_errors(gradient: impl Fn([f64; 2], usize) -> Option<Vector2<f64>>) -> (f64, f64) {
    let reference: Value = serde_json::from_str(include_str!("../assets/reference/cue_field.json")).expect("JSON");
    let pair = |v: &Value| [v[0].as_f64().unwrap_or(f64::NAN), v[1].as_f64().unwrap_or(f64::NAN)];
    let pairs = |v: &Value| -> Vec<[f64; 2]> { v.as_array().into_iter().flatten().map(pair).collect() };
    let probes = pairs(&reference["probes"]);
    let (mut size, mut angle, mut count) = (0.0, 0.0, 0.0f64);
    for (k, ligand) in ["a", "r"].into_iter().enumerate() {
        let fields = reference["fields"].as_array().expect("fields");
        let field = fields.iter().find(|field| field["ligand"] == ligand).expect("a field");
        for (probe, exact) in probes.iter().zip(pairs(&field["grad"])) {
            let (found, exact) = (gradient(*probe, k).expect("inside"), Vector2::from(exact));
            size += ((found - exact).norm() / exact.norm()).powi(2);
            angle += found.perp(&exact).atan2(found.dot(&exact)).to_degrees().powi(2);
            count += 1.0;
        }
    }
    ((size / count).sqrt(), (angle / count).sqrt())
}

fn matrix(size: f64) {
    let fitted = triangulate(&PlanarDomain::rectangle(1.5, 1.0), &[], &MeshOptions::of_size(size)).expect("a mesh");
    let mesh = &fitted.mesh;
    let (mut seconds, mut iterations, mut unknowns) = (Vec::new(), 0, 0);
    for _ in 0..REPETITIONS {
        let body = block(mesh, 0.2);
        let rest = vec![0.0; 2 * mesh.vertex_count()];
        let start_of_path = equilibrium(&body, 0.0, &rest, &NewtonOptions::default()).expect("rest");
        let start = Instant::now();
        let guess: Vec<f64> = start_of_path.rate.iter().map(|rate| 0.1 * rate).collect();
        let found = equilibrium(&body, 0.1, &guess, &NewtonOptions::default()).expect("an equilibrium");
        seconds.push(start.elapsed().as_secs_f64());
        (iterations, unknowns) = (found.iterations, body.unknowns());
    }
    println!("{size:>9} {unknowns:>10} {:>9.3} {iterations:>10}", median(seconds));
}
