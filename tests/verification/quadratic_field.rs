//! Eq. (2) in quadratic elements: orders, closed form, independent reference, budget, rate.

use std::f64::consts::{PI, TAU};

use crate::reaction_diffusion::fitted_order;
use serde_json::Value;
use tropism::numerics::element_gradient::{MovingField, averaged_gradients, corner_gradients, linear_gradients};
use tropism::numerics::locate::{MaterialPoint, SeedGrid};
use tropism::numerics::planar_domain::{Outline, PlanarDomain};
use tropism::numerics::quadratic_field::{QuadraticNodes, QuadraticSolver};
use tropism::numerics::quadrature::simplex_rule;
use tropism::numerics::reaction_diffusion::{Mass, ReactionDiffusion, ReactionDiffusionError, Source};
use tropism::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};
use tropism::numerics::triangulate::{FittedMesh, MeshOptions, triangulate};

use crate::figures::{self, Curve};
use crate::reaction_diffusion::{manufactured_errors as linear_errors, radial_mesh};

const LAW: ReactionDiffusion = ReactionDiffusion { diffusion: 1.0, degradation: 100.0, mass: Mass::Consistent };

fn reference(name: &str) -> Value {
    let path = format!("{}/assets/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn length(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The shapes of the six nodes, written out independently of the code.
fn shape(l: [f64; 3]) -> [f64; 6] {
    let [a, b, c] = l;
    [a * (2.0 * a - 1.0), b * (2.0 * b - 1.0), c * (2.0 * c - 1.0), 4.0 * a * b, 4.0 * a * c, 4.0 * b * c]
}

fn weights(point: &MaterialPoint<2>) -> [f64; 3] {
    [0, 1, 2].map(|i| point.weight(i))
}

/// `(value, gradient, raw gradient)` of a field at a point of the mesh.
fn read(
    nodes: &QuadraticNodes<2>,
    (c, averaged, corners): (&[f64], &[[f64; 2]], &[[f64; 2]]),
    (cell, weights): (usize, [f64; 3]),
) -> (f64, [f64; 2], [f64; 2]) {
    let here: Vec<_> = nodes.cell(cell).iter().zip(shape(weights)).map(|(&node, s)| (node as usize, s)).collect();
    let value = here.iter().map(|&(node, s)| c[node] * s).sum();
    let smooth = [0, 1].map(|k| here.iter().map(|&(node, s)| averaged[node][k] * s).sum());
    let raw = [0, 1].map(|k| (0..3).map(|a| weights[a] * corners[3 * cell + a][k]).sum());
    (value, smooth, raw)
}

fn at_rest<'a>(x: &'a [[f64; 2]], still: &'a [[f64; 2]], c: &'a [f64], zero: &'a [f64]) -> MovingField<'a, 2> {
    MovingField { coordinates: x, velocity: still, values: c, rates: zero }
}

/// A manufactured solution without flux, its gradient, and its source.
fn manufactured([x, y]: [f64; 2]) -> (f64, [f64; 2], f64) {
    let (a, b) = (TAU / 1.5, PI);
    let wave = (a * x).cos() * (b * y).cos();
    let gradient = [-a * (a * x).sin() * (b * y).cos(), -b * (a * x).cos() * (b * y).sin()];
    (2.0 + wave, gradient, (a * a + b * b + LAW.degradation) * wave + 2.0 * LAW.degradation)
}

/// Errors for the manufactured solution: c and ∇c in L2, and the averaged ∇c in L2.
fn manufactured_errors(mesh: &SimplexMesh<2>) -> [f64; 3] {
    let x = mesh.vertices();
    let rule = simplex_rule::<2>(6);
    let mut solver = QuadraticSolver::new(mesh).unwrap();
    let nodes = solver.nodes().clone();
    let mut load = vec![0.0; nodes.count()];
    let all = |q: &tropism::numerics::quadrature::QuadraturePoint<2>| [0, 1, 2].map(|i| q.weight(i));
    let origin = |cell: usize| x[mesh.cell(cell)[0] as usize];
    for cell in 0..mesh.cell_count() {
        let (edges, area) = (mesh.edge_vectors(x, cell), mesh.volume(x, cell));
        for q in &rule {
            let (_, _, f) = manufactured(q.position(origin(cell), &edges));
            let shares = nodes.cell(cell).iter().zip(shape(all(q)));
            shares.for_each(|(&node, s)| load[node as usize] += q.share * area * f * s);
        }
    }
    let c = solver.system(&LAW, x).unwrap().solve_load(load).unwrap();
    let (still, zero) = (vec![[0.0; 2]; x.len()], vec![0.0; c.len()]);
    let field = at_rest(x, &still, &c, &zero);
    let averaged = averaged_gradients(mesh, &nodes, &field).0;
    let corners = corner_gradients(mesh, &nodes, &field).0;
    let mut errors = [0.0; 3];
    for cell in 0..mesh.cell_count() {
        let (edges, area) = (mesh.edge_vectors(x, cell), mesh.volume(x, cell));
        for q in &rule {
            let (exact, slope, _) = manufactured(q.position(origin(cell), &edges));
            let (value, smooth, raw) = read(&nodes, (&c, &averaged, &corners), (cell, all(q)));
            let off = [value - exact, length(raw, slope), length(smooth, slope)];
            (0..3).for_each(|k| errors[k] += q.share * area * off[k].powi(2));
        }
    }
    errors.map(f64::sqrt)
}

#[test]
fn quadratic_values_converge_with_order_three_and_gradients_with_order_two() {
    let errors = [8, 16, 32, 64].map(|n| manufactured_errors(&structured_rectangle(1.5, 1.0, 3 * n / 2, n).unwrap()));
    let orders = [0, 1, 2].map(|k| fitted_order(&errors.map(|e| e[k])));
    assert!((orders[0] - 3.0).abs() < 0.1 && (orders[1] - 2.0).abs() < 0.1, "{orders:?} {errors:?}");
    assert!(orders[2] > 1.9 && errors[3][2] < errors[3][1], "{orders:?} {errors:?}");
    draw_elements(&errors, orders);
}

/// Linear beside quadratic elements: c, and its gradient.
fn draw_elements(errors: &[[f64; 3]; 4], orders: [f64; 3]) {
    let sizes = [8.0, 16.0, 32.0, 64.0].map(|n: f64| 1.0 / n);
    let linear = |mass| [8, 16, 32, 64].map(|n| linear_errors(n, &ReactionDiffusion { mass, ..LAW }));
    let (lumped, consistent) = (linear(Mass::Lumped), linear(Mass::Consistent));
    let curve =
        |name: &str, errors: [f64; 4], theory: f64| Curve::new(name, &sizes, &errors, [theory, fitted_order(&errors)]);
    let quadratic =
        |name: &str, k: usize, theory: f64| Curve::new(name, &sizes, &errors.map(|e| e[k]), [theory, orders[k]]);
    let x = "mesh size (height of the domain = 1)";
    let values = [
        curve("P1, lumped mass", lumped.map(|e| e.0), 2.0),
        curve("P1, consistent mass", consistent.map(|e| e.0), 2.0),
        quadratic("P2", 0, 3.0),
    ];
    let gradients = [
        curve("P1, raw", consistent.map(|e| e.1), 1.0),
        quadratic("P2, raw", 1, 2.0),
        quadratic("P2, averaged at the nodes", 2, 2.0),
    ];
    let plots = [
        figures::orders("concentration", [x, "L2 error of c (amplitude of c = 1)"], &values),
        figures::orders("gradient", [x, "L2 error of ∇c (amplitude = height = 1)"], &gradients),
    ];
    let words = [
        "Cue fields: linear and quadratic elements",
        "manufactured solution of eq. (2) on a rectangle, kL²/D = 100, structured meshes; the numbers are fitted orders",
    ];
    figures::write("elements", words, &plots);
}

/// A disc domain of radius 1 about the origin with a fitted disc source of radius 0.3.
#[test]
fn a_disc_source_in_a_disc_converges_to_the_bessel_solution_in_quadratic_elements() {
    let radial = &reference("convergence")["radial"];
    let field = radial["fields"].as_array().unwrap().iter().find(|f| f["k"] == 100.0).unwrap();
    let (r, exact) = (numbers(&radial["r"]), numbers(&field["c"]));
    let mut errors = Vec::new();
    for size in [0.1, 0.05, 0.025, 0.0125] {
        let fitted = radial_mesh(size);
        let (mesh, x) = (&fitted.mesh, fitted.mesh.vertices());
        let mut solver = QuadraticSolver::new(mesh).unwrap();
        let nodes = solver.nodes().clone();
        let sources = [Source::new(&fitted.regions[0], 100.0)];
        let system = solver.system(&LAW, x).unwrap();
        let c = system.solve(&sources).unwrap();
        assert!(system.budget(&c, &sources).unwrap().relative_error() < 1e-12);
        let grid = SeedGrid::new(mesh, x);
        let mut squares = 0.0;
        for (&r, &exact) in r.iter().zip(&exact).filter(|(r, _)| **r < 0.95) {
            for turn in 0..16 {
                let (sine, cosine) = (TAU * f64::from(turn) / 16.0).sin_cos();
                let point = grid.locate(mesh, x, [r * cosine, r * sine]).unwrap();
                let here = nodes.cell(point.cell as usize).iter().zip(shape(weights(&point)));
                let value: f64 = here.map(|(&node, s)| c[node as usize] * s).sum();
                squares += (value - exact).powi(2) / (16.0 * 16.0);
            }
        }
        errors.push(squares.sqrt());
    }
    let order = fitted_order(&errors);
    assert!(order > 2.8 && errors[3] < 1e-5, "{errors:?} order {order}");
}

fn reference_mesh(size: f64) -> FittedMesh {
    let discs = [([0.75, 0.85], 0.08), ([0.15, 0.88], 0.06), ([1.35, 0.88], 0.06)];
    let outlines = discs.map(|(centre, radius)| Outline::disc(centre, radius, size));
    triangulate(&PlanarDomain::rectangle(1.5, 1.0), &outlines, &MeshOptions::of_size(size)).unwrap()
}

/// Root mean squares over the probes: relative errors of c, of the averaged and of the raw gradient; and the nodes.
fn probe_errors(size: f64, ligand: &str) -> ([f64; 3], usize) {
    let fitted = reference_mesh(size);
    let table = reference("cue_field");
    let pairs = |value: &Value| -> Vec<[f64; 2]> {
        value.as_array().unwrap().iter().map(|v| [v[0].as_f64().unwrap(), v[1].as_f64().unwrap()]).collect()
    };
    let probes = pairs(&table["probes"]);
    let known = table["fields"].as_array().unwrap().iter().find(|f| f["ligand"] == ligand).unwrap();
    let (values, gradients) = (numbers(&known["c"]), pairs(&known["grad"]));
    let (mesh, x) = (&fitted.mesh, fitted.mesh.vertices());
    let regions = if ligand == "a" { 0..1 } else { 1..3 };
    let sources: Vec<_> = fitted.regions[regions].iter().map(|cells| Source::new(cells, 100.0)).collect();
    let mut solver = QuadraticSolver::new(mesh).unwrap();
    let c = solver.solve(&LAW, x, &sources).unwrap();
    let nodes = solver.nodes();
    let (still, zero) = (vec![[0.0; 2]; x.len()], vec![0.0; c.len()]);
    let averaged = averaged_gradients(mesh, nodes, &at_rest(x, &still, &c, &zero)).0;
    let corners = corner_gradients(mesh, nodes, &at_rest(x, &still, &c, &zero)).0;
    let grid = SeedGrid::new(mesh, x);
    let mut sums = [0.0; 3];
    for (i, probe) in probes.iter().enumerate() {
        let point = grid.locate(mesh, x, *probe).unwrap();
        let (value, smooth, raw) = read(nodes, (&c, &averaged, &corners), (point.cell as usize, weights(&point)));
        let size = length(gradients[i], [0.0; 2]);
        let off = [value / values[i] - 1.0, length(smooth, gradients[i]) / size, length(raw, gradients[i]) / size];
        (0..3).for_each(|k| sums[k] += off[k].powi(2) / probes.len() as f64);
    }
    (sums.map(f64::sqrt), nodes.count())
}

#[test]
fn the_reference_field_is_met_closer_than_by_as_many_linear_unknowns() {
    for ligand in ["a", "r"] {
        let (errors, nodes) = probe_errors(0.0264, ligand);
        assert!(nodes < 12_000 && errors[0] < 3e-4 && errors[1] < 4.5e-3 && errors[2] < 6.5e-3, "{nodes} {errors:?}");
    }
}

/// A smooth motion of the unit scene: at s = 1 taller, narrower and bent.
fn moved([x, y]: [f64; 2], s: f64) -> [f64; 2] {
    [x * (1.0 - 0.23 * s) + 0.015 * s * (7.0 * y).sin(), y * (1.0 + 0.4 * s) + 0.01 * s * s * (6.0 * x).cos()]
}

fn motion([x, y]: [f64; 2], s: f64) -> [f64; 2] {
    [-0.23 * x + 0.015 * (7.0 * y).sin(), 0.4 * y + 0.02 * s * (6.0 * x).cos()]
}

#[test]
fn what_is_released_decays_in_every_configuration_of_quadratic_elements() {
    let fitted = reference_mesh(0.04);
    let mut solver = QuadraticSolver::new(&fitted.mesh).unwrap();
    for s in [0.0, 0.5, 1.0] {
        let x: Vec<_> = fitted.mesh.vertices().iter().map(|&x| moved(x, s)).collect();
        let sources: Vec<_> = fitted.regions.iter().map(|cells| Source::new(cells, 100.0)).collect();
        let system = solver.system(&LAW, &x).unwrap();
        let c = system.solve(&sources).unwrap();
        let budget = system.budget(&c, &sources).unwrap();
        let area: f64 = fitted.regions.iter().flatten().map(|&c| fitted.mesh.volume(&x, c as usize)).sum();
        assert!(budget.relative_error() < 1e-12, "{s}: {budget:?}");
        assert!((budget.released / (100.0 * area) - 1.0).abs() < 1e-12);
    }
    assert_eq!(solver.work().symbolic, 1);
    assert_eq!((solver.work().factorisations, solver.work().solves), (3, 3));
}

fn assert_is_derivative(rates: &[[f64; 2]], after: &[[f64; 2]], before: &[[f64; 2]], step: f64) {
    let scale = rates.iter().flatten().fold(0.0f64, |most, r| most.max(r.abs()));
    for ((rate, after), before) in rates.iter().zip(after).zip(before) {
        let difference = [0, 1].map(|k| (after[k] - before[k]) / (2.0 * step));
        assert!(length(*rate, difference) < 1e-7 * scale, "{rate:?} {difference:?} of {scale}");
    }
}

#[test]
fn rates_of_values_and_of_all_gradients_are_derivatives_along_the_load() {
    let fitted = reference_mesh(0.08);
    let mesh = &fitted.mesh;
    let (s, step) = (0.3, 1e-5);
    let place = |s: f64| -> Vec<_> { mesh.vertices().iter().map(|&x| moved(x, s)).collect() };
    let velocity: Vec<_> = mesh.vertices().iter().map(|&x| motion(x, s)).collect();
    let still = vec![[0.0; 2]; velocity.len()];
    let mut solver = QuadraticSolver::new(mesh).unwrap();
    let nodes = solver.nodes().clone();
    for keep_total in [false, true] {
        let source = |x: &[[f64; 2]], velocity| {
            let cells = &fitted.regions[0][..];
            if keep_total { Source::of_total(mesh, x, velocity, (cells, 2.0)) } else { Source::new(cells, 100.0) }
        };
        let x = place(s);
        let given = [source(&x, Some(&velocity))];
        let (c, rate) = solver.system(&LAW, &x).unwrap().solve_with_rate(&velocity, &given).unwrap();
        let moving = MovingField { coordinates: &x, velocity: &velocity, values: &c, rates: &rate };
        let mut at = |s: f64| {
            let x = place(s);
            let c = solver.solve(&LAW, &x, &[source(&x, None)]).unwrap();
            let zero = vec![0.0; c.len()];
            let field = at_rest(&x, &still, &c, &zero);
            let values: Vec<_> = c.iter().map(|&c| [c, 0.0]).collect();
            let linear = linear_gradients(mesh, &field).0;
            [values, corner_gradients(mesh, &nodes, &field).0, averaged_gradients(mesh, &nodes, &field).0, linear]
        };
        let (after, before) = (at(s + step), at(s - step));
        let rates: Vec<_> = rate.iter().map(|&r| [r, 0.0]).collect();
        assert_is_derivative(&rates, &after[0], &before[0], step);
        assert_is_derivative(&corner_gradients(mesh, &nodes, &moving).1, &after[1], &before[1], step);
        assert_is_derivative(&averaged_gradients(mesh, &nodes, &moving).1, &after[2], &before[2], step);
        assert_is_derivative(&linear_gradients(mesh, &moving).1, &after[3], &before[3], step);
    }
}

#[test]
fn a_uniform_source_in_space_gives_a_uniform_quadratic_field() {
    let corners = (0..8).map(|i| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)]).collect();
    let cells = vec![0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7];
    let mesh = SimplexMesh::<3>::new(corners, cells).unwrap();
    let all: Vec<u32> = (0..6).collect();
    let velocity: Vec<_> = mesh.vertices().iter().map(|p| [p[0] * p[1], p[2], -p[0]]).collect();
    let mut solver = QuadraticSolver::new(&mesh).unwrap();
    assert_eq!(solver.nodes().count(), 8 + 19);
    let law = ReactionDiffusion { diffusion: 2.0, degradation: 0.5, mass: Mass::Consistent };
    let system = solver.system(&law, mesh.vertices()).unwrap();
    let (c, rate) = system.solve_with_rate(&velocity, &[Source::new(&all, 1.5)]).unwrap();
    assert!(c.iter().all(|c| (c - 3.0).abs() < 1e-12) && rate.iter().all(|r| r.abs() < 1e-12));
}

#[test]
fn senseless_input_of_quadratic_elements_is_refused_with_its_place() {
    let mesh = structured_rectangle(1.0, 1.0, 2, 2).unwrap();
    let x = mesh.vertices();
    let mut solver = QuadraticSolver::new(&mesh).unwrap();
    let wrong = solver.solve(&LAW, x, &[Source::new(&[0, 9], 1.0)]).unwrap_err();
    assert_eq!(wrong, ReactionDiffusionError::NoSuchCell { source_index: 0, cell: 9, count: 8 });
    let no_decay = ReactionDiffusion { degradation: 0.0, ..LAW };
    assert_eq!(solver.solve(&no_decay, x, &[]), Err(ReactionDiffusionError::Degradation(0.0)));
    let mirrored: Vec<_> = x.iter().map(|p| [-p[0], p[1]]).collect();
    assert!(matches!(solver.solve(&LAW, &mirrored, &[]), Err(ReactionDiffusionError::Inverted { cell: 0, .. })));
    let short = solver.system(&LAW, x).unwrap().solve_load(vec![0.0; 9]);
    assert!(matches!(short, Err(ReactionDiffusionError::Length { given: 9, wanted: 25, .. })));
}
