//! The recovered gradient: exact for quadratics, of second order, far better than the raw one on the reference field.

use std::f64::consts::{PI, TAU};

use serde_json::Value;
use tropism::numerics::locate::SeedGrid;
use tropism::numerics::planar_domain::{Outline, PlanarDomain};
use tropism::numerics::reaction_diffusion::{Mass, ReactionDiffusion, Source, StationarySolver};
use tropism::numerics::recovery::GradientRecovery;
use tropism::numerics::simplex_mesh::SimplexMesh;
use tropism::numerics::triangulate::{FittedMesh, MeshOptions, triangulate};

use crate::block::fitted_order;
use crate::figures::{self, Curve};

fn unstructured(size: f64) -> SimplexMesh<2> {
    let outlines = [Outline::disc([0.4, 0.6], 0.1, size)];
    triangulate(&PlanarDomain::rectangle(1.5, 1.0), &outlines, &MeshOptions::of_size(size)).unwrap().mesh
}

fn off(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn quadratics_are_recovered_exactly_on_any_mesh_without_a_border_condition() {
    let mesh = unstructured(0.1);
    let x: Vec<_> = mesh.vertices().iter().map(|[x, y]| [1.3 * x + 0.2 * y, 0.8 * y]).collect();
    let c: Vec<f64> = x.iter().map(|[x, y]| 1.0 + 2.0 * x - y + 3.0 * x * x - x * y + 0.5 * y * y).collect();
    let gradient = GradientRecovery::new(&mesh).recover(&x, &c, false);
    for ([x, y], g) in x.iter().zip(gradient) {
        assert!(off(g, [2.0 + 6.0 * x - y, -1.0 - x + y]) < 1e-9, "{g:?}");
    }
}

#[test]
fn quadratics_are_recovered_exactly_in_space() {
    let mut corners: Vec<[f64; 3]> =
        (0..8).map(|i| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)]).collect();
    corners.extend([[0.5, 0.45, 0.55], [0.5, 0.5, 0.0], [0.5, 0.5, 1.0], [0.0, 0.5, 0.5], [1.0, 0.5, 0.5]]);
    corners.extend([[0.5, 0.0, 0.5], [0.5, 1.0, 0.5]]);
    let faces: [([u32; 4], u32); 6] = [
        ([0, 1, 3, 2], 9),
        ([4, 6, 7, 5], 10),
        ([0, 2, 6, 4], 11),
        ([1, 5, 7, 3], 12),
        ([0, 4, 5, 1], 13),
        ([2, 3, 7, 6], 14),
    ];
    let cells = faces
        .iter()
        .flat_map(|(ring, middle)| (0..4).flat_map(move |i| [ring[i], ring[(i + 1) % 4], *middle, 8]))
        .collect();
    let mesh = SimplexMesh::<3>::new(corners, cells).unwrap();
    let x = mesh.vertices();
    let c: Vec<f64> = x.iter().map(|[x, y, z]| x * x + 2.0 * y * z - z + x * y).collect();
    let gradient = GradientRecovery::new(&mesh).recover(x, &c, false);
    for ([x, y, z], g) in x.iter().zip(gradient) {
        let exact = [2.0 * x + y, 2.0 * z + x, 2.0 * y - 1.0];
        assert!((0..3).all(|k| (g[k] - exact[k]).abs() < 1e-9), "{g:?} {exact:?}");
    }
}

#[test]
fn the_recovered_gradient_is_of_second_order_inside_and_at_the_border() {
    let (a, b) = (TAU / 1.5, PI);
    let exact = |[x, y]: [f64; 2]| [-a * (a * x).sin() * (b * y).cos(), -b * (a * x).cos() * (b * y).sin()];
    let sizes = [0.08, 0.04, 0.02, 0.01];
    let (mut errors, mut raw) = (Vec::new(), Vec::new());
    for size in sizes {
        let mesh = unstructured(size);
        let x = mesh.vertices();
        let c: Vec<f64> = x.iter().map(|[x, y]| (a * x).cos() * (b * y).cos()).collect();
        let gradient = GradientRecovery::new(&mesh).recover(x, &c, true);
        let (mut inside, mut border) = ((0.0, 0.0), (0.0, 0.0));
        for (&[x, y], g) in x.iter().zip(gradient) {
            let rim = is_on_rim([x, y]);
            let sum = if rim { &mut border } else { &mut inside };
            *sum = (sum.0 + off(g, exact([x, y])).powi(2), sum.1 + 1.0);
            let normal = if x == 0.0 || x == 1.5 { g[0] } else { g[1] };
            assert!(!rim || normal.abs() < 1e-12);
        }
        errors.push([inside, border].map(|(sum, count): (f64, f64)| (sum / count).sqrt()));
        raw.push(raw_errors(&mesh, &c, exact));
    }
    let order = |place: usize| (errors[0][place] / errors[3][place]).log2() / 3.0;
    assert!(order(0) > 1.8 && order(1) > 1.8, "{errors:?}");
    draw_recovery(&sizes, &errors, &raw);
}

/// Root mean square errors, over the corners of cells inside and at the border, of the gradient of each cell's own values.
fn raw_errors(mesh: &SimplexMesh<2>, c: &[f64], exact: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let x = mesh.vertices();
    let mut sums = [(0.0, 0.0); 2];
    for cell in 0..mesh.cell_count() {
        let mut g = [[0.0; 2]; 3];
        mesh.barycentric_gradients(x, cell, &mut g);
        let corners = mesh.cell(cell);
        let raw = [0, 1].map(|k| (0..3).map(|j| c[corners[j] as usize] * g[j][k]).sum::<f64>());
        for at in corners.iter().map(|&corner| x[corner as usize]) {
            let sum = &mut sums[usize::from(is_on_rim(at))];
            *sum = (sum.0 + off(raw, exact(at)).powi(2), sum.1 + 1.0);
        }
    }
    sums.map(|(sum, count)| (sum / count).sqrt())
}

fn is_on_rim([x, y]: [f64; 2]) -> bool {
    x == 0.0 || y == 0.0 || x == 1.5 || y == 1.0
}

/// Recovered beside raw: inside, and at the border.
fn draw_recovery(sizes: &[f64], recovered: &[[f64; 2]], raw: &[[f64; 2]]) {
    let axes = ["mesh size (height of the domain = 1)", "rms error of ∇c (amplitude = height = 1)"];
    let plots = ["inside", "at the border"].map(|title| {
        let place = usize::from(title != "inside");
        let curve = |name: &str, errors: &[[f64; 2]], theory: f64| {
            let errors: Vec<f64> = errors.iter().map(|e| e[place]).collect();
            Curve::new(name, sizes, &errors, [theory, fitted_order(sizes, &errors)])
        };
        figures::orders(title, axes, &[curve("raw", raw, 1.0), curve("recovered", recovered, 2.0)])
    });
    let words = [
        "Cue fields: the recovered gradient",
        "from nodal values of a smooth field, at the vertices of unstructured meshes; the numbers are fitted orders",
    ];
    figures::write("recovered_gradient", words, &plots);
}

fn reference_mesh(size: f64) -> FittedMesh {
    let discs = [([0.75, 0.85], 0.08), ([0.15, 0.88], 0.06), ([1.35, 0.88], 0.06)];
    let outlines = discs.map(|(centre, radius)| Outline::disc(centre, radius, size));
    triangulate(&PlanarDomain::rectangle(1.5, 1.0), &outlines, &MeshOptions::of_size(size)).unwrap()
}

fn angle(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).to_degrees()
}

/// Root mean squares over the probes: relative error of c, of the raw and the recovered gradient, and their angles (degrees).
fn probe_errors(fitted: &FittedMesh, mass: Mass, ligand: &str) -> [f64; 5] {
    let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/cue_field.json"));
    let reference: Value = serde_json::from_str(text).unwrap();
    let pairs = |value: &Value| -> Vec<[f64; 2]> {
        let pair = |v: &Value| [v[0].as_f64().unwrap(), v[1].as_f64().unwrap()];
        value.as_array().unwrap().iter().map(pair).collect()
    };
    let probes = pairs(&reference["probes"]);
    let field = reference["fields"].as_array().unwrap().iter().find(|f| f["ligand"] == ligand).unwrap();
    let (c, exact) = (&field["c"], pairs(&field["grad"]));
    let law = ReactionDiffusion { diffusion: 1.0, degradation: 100.0, mass };
    let (mesh, x) = (&fitted.mesh, fitted.mesh.vertices());
    let regions = if ligand == "a" { 0..1 } else { 1..3 };
    let sources: Vec<_> = fitted.regions[regions].iter().map(|cells| Source::new(cells, 100.0)).collect();
    let nodal = StationarySolver::new(mesh, &fitted.regions).unwrap().solve(&law, x, &sources).unwrap();
    let recovered = GradientRecovery::new(mesh).recover(x, &nodal, true);
    let grid = SeedGrid::new(mesh, x);
    let mut sums = [0.0; 5];
    for (i, probe) in probes.iter().enumerate() {
        let point = grid.locate(mesh, x, *probe).unwrap();
        let mut g = [[0.0; 2]; 3];
        mesh.barycentric_gradients(x, point.cell as usize, &mut g);
        let corners = mesh.cell(point.cell as usize);
        let raw = [0, 1].map(|k| (0..3).map(|j| nodal[corners[j] as usize] * g[j][k]).sum::<f64>());
        let smooth = point.interpolate_vector(mesh, &recovered);
        let size = exact[i][0].hypot(exact[i][1]);
        let value = c[i].as_f64().unwrap();
        let errors = [
            point.interpolate(mesh, &nodal) / value - 1.0,
            off(raw, exact[i]) / size,
            off(smooth, exact[i]) / size,
            angle(raw, exact[i]),
            angle(smooth, exact[i]),
        ];
        (0..5).for_each(|k| sums[k] += errors[k].powi(2) / probes.len() as f64);
    }
    sums.map(f64::sqrt)
}

#[test]
fn recovery_cuts_the_error_of_the_reference_gradient_fivefold_and_its_angle_tenfold() {
    let fitted = reference_mesh(0.0132);
    for ligand in ["a", "r"] {
        for mass in [Mass::Lumped, Mass::Consistent] {
            let [value, raw, recovered, raw_angle, angle] = probe_errors(&fitted, mass, ligand);
            assert!(value < 0.005 && recovered < 0.01, "{ligand} {mass:?}: {value} {recovered}");
            assert!(recovered < 0.2 * raw && angle < 0.15 && angle < 0.1 * raw_angle, "{raw} {raw_angle} -> {angle}");
        }
    }
}
