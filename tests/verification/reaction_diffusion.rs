//! Eq. (2): error tables matched, budgets closed, rates exact, concentrations not negative.

use std::f64::consts::{PI, TAU};

use serde_json::Value;
use tropism::numerics::planar_domain::{Outline, PlanarDomain, Ring};
use tropism::numerics::quadrature::simplex_rule;
use tropism::numerics::reaction_diffusion::{
    Mass, ReactionDiffusion, ReactionDiffusionError, Source, StationarySolver,
};
use tropism::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};
use tropism::numerics::triangulate::{FittedMesh, MeshOptions, triangulate};

const LUMPED: ReactionDiffusion = ReactionDiffusion { diffusion: 1.0, degradation: 100.0, mass: Mass::Lumped };

fn convergence() -> Value {
    let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/convergence.json"));
    serde_json::from_str(text).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Slope of log(error) over log(h) by least squares, for h halved from entry to entry.
pub(crate) fn fitted_order(errors: &[f64]) -> f64 {
    let n = errors.len() as f64;
    let (mean_x, mean_y) = ((n - 1.0) / 2.0, errors.iter().map(|e| e.log2()).sum::<f64>() / n);
    let pairs = errors.iter().enumerate().map(|(i, e)| (i as f64 - mean_x, e.log2() - mean_y));
    -pairs.clone().map(|(x, y)| x * y).sum::<f64>() / pairs.map(|(x, _)| x * x).sum::<f64>()
}

/// The manufactured solution, its gradient, and its source for the degradation k.
fn manufactured([x, y]: [f64; 2], k: f64) -> (f64, [f64; 2], f64) {
    let (a, b) = (TAU / 1.5, PI);
    let wave = (a * x).cos() * (b * y).cos();
    let gradient = [-a * (a * x).sin() * (b * y).cos(), -b * (a * x).cos() * (b * y).sin()];
    (2.0 + wave, gradient, (a * a + b * b + k) * wave + 2.0 * k)
}

/// L2 and H1 errors of P1 for the manufactured solution on the stated mesh with `n` cells in height.
pub(crate) fn manufactured_errors(n: usize, law: &ReactionDiffusion) -> (f64, f64) {
    let mesh = structured_rectangle(1.5, 1.0, 3 * n / 2, n).unwrap();
    let x = mesh.vertices();
    let rule = simplex_rule::<2>(6);
    let mut load = vec![0.0; mesh.vertex_count()];
    let origin = |cell: usize| x[mesh.cell(cell)[0] as usize];
    for cell in 0..mesh.cell_count() {
        let (edges, area) = (mesh.edge_vectors(x, cell), mesh.volume(x, cell));
        for q in &rule {
            let (_, _, f) = manufactured(q.position(origin(cell), &edges), law.degradation);
            mesh.cell(cell).iter().enumerate().for_each(|(i, &v)| load[v as usize] += q.share * area * f * q.weight(i));
        }
    }
    let mut solver = StationarySolver::new(&mesh, &[]).unwrap();
    let c = solver.system(law, x).unwrap().solve_load(load).unwrap();
    let (mut l2, mut h1) = (0.0, 0.0);
    for cell in 0..mesh.cell_count() {
        let mut g = [[0.0; 2]; 3];
        let area = mesh.barycentric_gradients(x, cell, &mut g);
        let edges = mesh.edge_vectors(x, cell);
        let nodal: Vec<f64> = mesh.cell(cell).iter().map(|&v| c[v as usize]).collect();
        let slope = [0, 1].map(|k| (0..3).map(|i| nodal[i] * g[i][k]).sum::<f64>());
        for q in &rule {
            let (exact, gradient, _) = manufactured(q.position(origin(cell), &edges), law.degradation);
            let value: f64 = (0..3).map(|i| nodal[i] * q.weight(i)).sum();
            let off = [gradient[0] - slope[0], gradient[1] - slope[1]];
            l2 += q.share * area * (exact - value).powi(2);
            h1 += q.share * area * dot(off, off);
        }
    }
    (l2.sqrt(), h1.sqrt())
}

#[test]
fn the_error_table_of_the_independent_codes_is_matched_for_both_masses() {
    let table = convergence();
    let mut matched = 0;
    for entry in table["manufactured"]["table"].as_array().unwrap() {
        let n = entry["n"].as_u64().unwrap() as usize;
        if entry["order"] != 1 || n > 32 {
            continue;
        }
        let lumped = entry["mass"].as_str().unwrap().starts_with("lumped");
        let mass = if lumped { Mass::Lumped } else { Mass::Consistent };
        let law = ReactionDiffusion { diffusion: 1.0, degradation: number(&entry["k"]), mass };
        let (l2, h1) = manufactured_errors(n, &law);
        assert!((l2 / number(&entry["L2"]) - 1.0).abs() < 1e-7, "{entry} {l2}");
        assert!((h1 / number(&entry["H1"]) - 1.0).abs() < 1e-7, "{entry} {h1}");
        matched += 1;
    }
    assert!(matched >= 12, "{matched}");
}

#[test]
fn values_converge_with_order_two_and_gradients_with_order_one() {
    for mass in [Mass::Lumped, Mass::Consistent] {
        let law = ReactionDiffusion { mass, ..LUMPED };
        let errors: Vec<_> = [8, 16, 32, 64].map(|n| manufactured_errors(n, &law)).to_vec();
        let order = |pick: fn(&(f64, f64)) -> f64| fitted_order(&errors.iter().map(pick).collect::<Vec<_>>());
        let (values, gradients) = (order(|e| e.0), order(|e| e.1));
        assert!((values - 2.0).abs() < 0.1 && (gradients - 1.0).abs() < 0.05, "{mass:?} {values} {gradients}");
    }
}

/// A disc domain of radius 1 about the origin with a fitted disc source of radius 0.3.
pub(crate) fn radial_mesh(size: f64) -> FittedMesh {
    let points = Outline::disc([0.0, 0.0], 1.0, size).points;
    let outer = Ring { edges: vec![0; points.len()], points };
    let domain = PlanarDomain::new(outer, Vec::new(), vec!["rim".into()]);
    triangulate(&domain, &[Outline::disc([0.0, 0.0], 0.3, size)], &MeshOptions::of_size(size)).unwrap()
}

#[test]
fn a_disc_source_in_a_disc_converges_to_the_bessel_solution() {
    let radial = &convergence()["radial"];
    let field = radial["fields"].as_array().unwrap().iter().find(|f| f["k"] == 100.0).unwrap();
    let numbers = |value: &Value| -> Vec<f64> { value.as_array().unwrap().iter().map(number).collect() };
    let (r, exact) = (numbers(&radial["r"]), numbers(&field["c"]));
    let mut errors = Vec::new();
    for size in [0.1, 0.05, 0.025] {
        let fitted = radial_mesh(size);
        let (mesh, x) = (&fitted.mesh, fitted.mesh.vertices());
        let mut solver = StationarySolver::new(mesh, &fitted.regions).unwrap();
        let law = ReactionDiffusion { mass: Mass::Consistent, ..LUMPED };
        let sources = [Source::new(&fitted.regions[0], 100.0)];
        let system = solver.system(&law, x).unwrap();
        let c = system.solve(&sources).unwrap();
        assert!(system.budget(&c, &sources).unwrap().relative_error() < 1e-12);
        let grid = tropism::numerics::locate::SeedGrid::new(mesh, x);
        let mut squares = 0.0;
        for (&r, &exact) in r.iter().zip(&exact).filter(|(r, _)| **r < 0.95) {
            for turn in 0..16 {
                let (sine, cosine) = (TAU * f64::from(turn) / 16.0).sin_cos();
                let point = grid.locate(mesh, x, [r * cosine, r * sine]).unwrap();
                squares += (point.interpolate(mesh, &c) - exact).powi(2) / (16.0 * 16.0);
            }
        }
        errors.push(squares.sqrt());
    }
    let order = fitted_order(&errors);
    assert!(order > 1.8 && errors[2] < 2e-3, "{errors:?} order {order}");
}

/// The paper's scene: one attractant source at the top, two repellent ones in the corners.
fn paper_mesh(size: f64) -> FittedMesh {
    let outlines = [
        Outline::disc([400.0, 540.0], 50.0, size),
        Outline::disc([60.0, 540.0], 30.0, size),
        Outline::disc([740.0, 540.0], 30.0, size),
    ];
    triangulate(&PlanarDomain::rectangle(800.0, 600.0), &outlines, &MeshOptions::of_size(size)).unwrap()
}

/// A smooth motion of the paper's domain: at s = 1 higher by 1.4 and narrower by 0.77, and bent.
fn moved(x: [f64; 2], s: f64) -> [f64; 2] {
    [
        x[0] * (1.0 - 0.23 * s) + 8.0 * s * (x[1] / 90.0).sin(),
        x[1] * (1.0 + 0.4 * s) + 5.0 * s * s * (x[0] / 100.0).cos(),
    ]
}

fn configuration(mesh: &SimplexMesh<2>, s: f64) -> Vec<[f64; 2]> {
    mesh.vertices().iter().map(|&x| moved(x, s)).collect()
}

#[test]
fn what_is_released_decays_in_every_configuration_and_nothing_is_negative() {
    let fitted = paper_mesh(15.0);
    let mut solver = StationarySolver::new(&fitted.mesh, &fitted.regions).unwrap();
    for (diffusion, degradation) in [(108_000.0, 3.6), (9000.0, 3.6)] {
        let law = ReactionDiffusion { diffusion, degradation, mass: Mass::Lumped };
        for s in [0.0, 0.5, 1.0] {
            let x = configuration(&fitted.mesh, s);
            let sources: Vec<_> = fitted.regions.iter().map(|cells| Source::new(cells, 180.0)).collect();
            let system = solver.system(&law, &x).unwrap();
            let c = system.solve(&sources).unwrap();
            let budget = system.budget(&c, &sources).unwrap();
            assert!(budget.relative_error() < 1e-12, "{s}: {budget:?}");
            assert!(budget.minimum > 0.0, "{s}: {budget:?}");
            let area: f64 = fitted.regions.iter().flatten().map(|&c| fitted.mesh.volume(&x, c as usize)).sum();
            assert!((budget.released / (180.0 * area) - 1.0).abs() < 1e-12);
        }
    }
    let work = solver.work();
    assert_eq!((work.factorisations, work.solves), (6, 6));
    assert!(work.symbolic <= 3, "{work:?}");
}

#[test]
fn a_stretch_breaks_delaunay_and_with_it_positivity_but_flips_mend_both() {
    let outlines = [Outline::disc([75.0, 50.0], 12.0, 5.0)];
    let sheared = |[x, y]: [f64; 2]| [x + 0.9 * y, y];
    let fitted = triangulate(&PlanarDomain::rectangle(150.0, 100.0), &outlines, &MeshOptions::of_size(5.0)).unwrap();
    for map in [|[x, y]: [f64; 2]| [1.4 * x, 0.77 * y], sheared] {
        let x: Vec<_> = fitted.mesh.vertices().iter().map(|&x| map(x)).collect();
        let law = ReactionDiffusion { diffusion: 1.0, degradation: 10.0, mass: Mass::Lumped };
        let sources = [Source::new(&fitted.regions[0], 10.0)];
        let mut solver = StationarySolver::new(&fitted.mesh, &fitted.regions).unwrap();
        let system = solver.system(&law, &x).unwrap();
        let c = system.solve(&sources).unwrap();
        let report = system.edge_report().unwrap();
        let budget = system.budget(&c, &sources).unwrap();
        let one_cell_apart: Vec<Vec<u32>> = (0..fitted.mesh.cell_count() as u32).map(|cell| vec![cell]).collect();
        let mut rigid = StationarySolver::new(&fitted.mesh, &one_cell_apart).unwrap();
        let unmended = rigid.system(&law, &x).unwrap();
        let unmended_report = unmended.edge_report().unwrap();
        let negative = unmended.solve(&sources).unwrap().into_iter().fold(f64::INFINITY, f64::min);
        assert!(system.is_flipped() && !unmended.is_flipped());
        assert!(unmended_report.not_delaunay > 50 && negative < 0.0);
        // Obtuse angles that face the border remain: no flip can mend them, and the maximum principle is not assured. What is
        // left of a negative c is far below anything a cone can sense (q/k is 1 here).
        assert!(report.not_delaunay <= 4 && budget.minimum > -1e-30, "{report:?} {budget:?}");
        assert!(negative < -1e-5, "{negative}");
    }
}

#[test]
fn the_rate_along_the_load_is_the_derivative_of_the_solution() {
    let fitted = paper_mesh(30.0);
    let law = ReactionDiffusion { diffusion: 108_000.0, degradation: 3.6, mass: Mass::Lumped };
    for mass in [Mass::Lumped, Mass::Consistent] {
        let law = ReactionDiffusion { mass, ..law };
        for keep_total in [false, true] {
            let (s, step) = (0.1, 1e-4);
            let x = configuration(&fitted.mesh, s);
            let bent =
                |x: [f64; 2]| [-0.23 * x[0] + 8.0 * (x[1] / 90.0).sin(), 0.4 * x[1] + 10.0 * s * (x[0] / 100.0).cos()];
            let velocity: Vec<_> = fitted.mesh.vertices().iter().map(|&x| bent(x)).collect();
            let all: Vec<Vec<u32>> = (0..fitted.mesh.cell_count() as u32).map(|cell| vec![cell]).collect();
            let mut solver = StationarySolver::new(&fitted.mesh, &all).unwrap();
            let source = |x: &[[f64; 2]], velocity| {
                let cells = &fitted.regions[0][..];
                if keep_total {
                    Source::of_total(&fitted.mesh, x, velocity, (cells, 1e6))
                } else {
                    Source::new(cells, 180.0)
                }
            };
            let (_, rate) = solver.solve_with_rate(&law, &x, &velocity, &[source(&x, Some(&velocity))]).unwrap();
            let mut at = |s: f64| {
                let x = configuration(&fitted.mesh, s);
                solver.solve(&law, &x, &[source(&x, None)]).unwrap()
            };
            let (after, before) = (at(s + step), at(s - step));
            let scale = rate.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
            for i in 0..rate.len() {
                let difference = (after[i] - before[i]) / (2.0 * step);
                assert!((rate[i] - difference).abs() < 1e-7 * scale, "{mass:?} {} {difference}", rate[i]);
            }
        }
    }
}

#[test]
fn a_uniform_source_in_space_gives_a_uniform_field_whatever_the_deformation() {
    let corners = (0..8).map(|i| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)]).collect();
    let cells = vec![0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7];
    let mesh = SimplexMesh::<3>::new(corners, cells).unwrap();
    let all: Vec<u32> = (0..6).collect();
    let x: Vec<_> = mesh.vertices().iter().map(|p| [1.3 * p[0] + 0.2 * p[2], 0.8 * p[1], p[2] - 0.1 * p[0]]).collect();
    let velocity: Vec<_> = mesh.vertices().iter().map(|p| [p[0] * p[1], p[2], -p[0]]).collect();
    for mass in [Mass::Lumped, Mass::Consistent] {
        let law = ReactionDiffusion { diffusion: 2.0, degradation: 0.5, mass };
        let mut solver = StationarySolver::new(&mesh, &[]).unwrap();
        let (c, rate) = solver.solve_with_rate(&law, &x, &velocity, &[Source::new(&all, 1.5)]).unwrap();
        assert!(c.iter().all(|c| (c - 3.0).abs() < 1e-12) && rate.iter().all(|r| r.abs() < 1e-12));
    }
}

#[test]
fn senseless_input_is_refused_with_its_place() {
    let mesh = structured_rectangle(1.0, 1.0, 2, 2).unwrap();
    let x = mesh.vertices();
    let mut solver = StationarySolver::new(&mesh, &[]).unwrap();
    let refused = |law: ReactionDiffusion, solver: &mut StationarySolver<2>| solver.solve(&law, x, &[]).unwrap_err();
    let no_decay = ReactionDiffusion { degradation: 0.0, ..LUMPED };
    assert_eq!(refused(no_decay, &mut solver), ReactionDiffusionError::Degradation(0.0));
    let no_spread = ReactionDiffusion { diffusion: -1.0, ..LUMPED };
    assert_eq!(refused(no_spread, &mut solver), ReactionDiffusionError::Diffusion(-1.0));
    let wrong = solver.solve(&LUMPED, x, &[Source::new(&[0, 9], 1.0)]).unwrap_err();
    assert_eq!(wrong, ReactionDiffusionError::NoSuchCell { source_index: 0, cell: 9, count: 8 });
    let mirrored: Vec<_> = x.iter().map(|p| [-p[0], p[1]]).collect();
    assert!(matches!(solver.solve(&LUMPED, &mirrored, &[]), Err(ReactionDiffusionError::Inverted { cell: 0, .. })));
    assert!(matches!(solver.solve(&LUMPED, &x[1..], &[]), Err(ReactionDiffusionError::Length { given: 8, .. })));
}
