//! Inhomogeneous equilibria against `svk_discrete_p1.json` (the same discrete problem, solved by others) and
//! `svk_clamped_stretch.json` (the continuum).

use serde_json::Value;
use tropism::numerics::hyperelasticity::Body;
use tropism::numerics::newton::{Equilibrium, NewtonOptions, equilibrium};

use crate::block::{
    HEIGHT, WIDTH, array, block, fitted_order, moved_ends, number, reaction_of_the_top, reference, svk,
};
use crate::figures::{self, Curve};

/// Equilibria at `s = 1/steps, 2/steps, …, 1`, each from the tangent predictor.
fn march(body: &Body<'_, 2>, steps: usize, options: &NewtonOptions) -> Vec<Equilibrium> {
    let mut last = equilibrium(body, 0.0, &vec![0.0; body.unknowns()], options).unwrap();
    let advance = |k: usize| {
        let guess: Vec<f64> = last.displacement.iter().zip(&last.rate).map(|(u, du)| u + du / steps as f64).collect();
        last = equilibrium(body, k as f64 / steps as f64, &guess, options).unwrap();
        last.clone()
    };
    (1..=steps).map(advance).collect()
}

fn largest_defect(found: &[f64], nodes: &[usize], wanted: &Value) -> f64 {
    let defect = |(&node, wanted): (&usize, &Value)| {
        (0..2).map(|c| (found[2 * node + c] - number(&wanted[c])).abs()).fold(0.0, f64::max)
    };
    nodes.iter().zip(array(wanted)).map(defect).fold(0.0, f64::max)
}

#[test]
fn the_discrete_solution_is_that_of_the_independent_codes_in_no_more_iterations() {
    let data = reference("svk_discrete_p1.json");
    let nodes: Vec<usize> = array(&data["nodes"]).iter().map(|node| node.as_u64().unwrap() as usize).collect();
    let mesh = block(36, 24);
    let options = NewtonOptions { tolerance: 1e-13, ..NewtonOptions::default() };
    for case in array(&data["cases"]) {
        let (kind, amplitude) = (case["kind"].as_str().unwrap(), number(&case["amp"]));
        let body = moved_ends(&mesh, svk(number(&case["nu"])), amplitude, kind == "clamped");
        for (k, found) in march(&body, 10, &options).iter().enumerate() {
            let what = format!("{kind} {amplitude}, step {k}");
            let u = largest_defect(&found.displacement, &nodes, &case["u"][k]);
            let rate = largest_defect(&found.rate, &nodes, &case["du_ds"][k]);
            assert!(u < 1e-13 && rate < 1e-12, "{what}: u {u:e}, du/ds {rate:e}");
            let reaction = reaction_of_the_top(&body, &body.internal_forces(1.0, &found.displacement));
            for (found, key) in
                [(found.energy, "energy"), (found.min_jacobian, "min_detF"), (reaction, "reaction_top_y")]
            {
                let defect = (found - number(&case[key][k])).abs();
                assert!(defect < 1e-12, "{what}: {key} off by {defect:e}");
            }
            let theirs = case["newton_own_code"][k].as_u64().unwrap() as usize;
            assert!(found.iterations <= theirs + 1, "{what}: {} iterations for {theirs}", found.iterations);
        }
    }
}

/// Value at a point of the structured block of a field of vertex values with stride 2.
fn at_point(columns: usize, rows: usize, field: &[f64], x: f64, y: f64, component: usize) -> f64 {
    let (a, b) = (x / WIDTH * columns as f64, y / HEIGHT * rows as f64);
    let (i, j) = ((a as usize).min(columns - 1), (b as usize).min(rows - 1));
    let (a, b) = (a - i as f64, b - j as f64);
    let vertex = |di: usize, dj: usize| field[2 * ((j + dj) * (columns + 1) + i + di) + component];
    // Cells are cut from lower left to upper right.
    let middle = if a >= b { vertex(1, 0) } else { vertex(0, 1) };
    (1.0 - a.max(b)) * vertex(0, 0) + (a - b).abs() * middle + a.min(b) * vertex(1, 1)
}

#[test]
fn refined_meshes_converge_to_the_continuum_with_clamped_ends() {
    let data = reference("svk_clamped_stretch.json");
    let (case, probes) = (&data["cases"][0], array(&data["probes"]));
    let last = array(&case["steps"]).last().unwrap();
    let rms = |columns: usize, rows: usize, field: &[f64], wanted: &Value| {
        let square = |(probe, wanted): (&Value, &Value)| {
            let (x, y) = (number(&probe[0]), number(&probe[1]));
            (0..2).map(|c| (at_point(columns, rows, field, x, y, c) - number(&wanted[c])).powi(2)).sum::<f64>()
        };
        (probes.iter().zip(array(wanted)).map(square).sum::<f64>() / probes.len() as f64).sqrt()
    };
    let (mut sizes, mut errors, mut rate_errors) = (Vec::new(), Vec::new(), Vec::new());
    for refinement in [2, 3, 4] {
        let (columns, rows) = (18 * refinement, 12 * refinement);
        let mesh = block(columns, rows);
        let body = moved_ends(&mesh, svk(number(&case["nu"])), number(&case["amp_per_side"]), true);
        let found = march(&body, 3, &NewtonOptions::default()).pop().unwrap();
        sizes.push(1.0 / rows as f64);
        errors.push(rms(columns, rows, &found.displacement, &last["u"]));
        rate_errors.push(rms(columns, rows, &found.rate, &last["du_ds"]));
    }
    // A clamped corner with free sides has strain like r^(0.711 − 1): the error in the mean is of order 2 · 0.711 = 1.42 in the
    // end.
    let (order, rate_order) = (fitted_order(&sizes, &errors), fitted_order(&sizes, &rate_errors));
    assert!((order - 1.42).abs() < 0.06, "u: order {order}, errors {errors:?}");
    assert!((rate_order - 1.42).abs() < 0.06, "du/ds: order {rate_order}, errors {rate_errors:?}");
    assert!(errors[2] < 3.5e-4 && rate_errors[2] < 3e-4, "{errors:?} {rate_errors:?}");
    draw_clamped_block(&sizes, [(&errors, order), (&rate_errors, rate_order)]);
}

fn draw_clamped_block(sizes: &[f64], [displacement, rate]: [(&[f64], f64); 2]) {
    let plot = |title: &str, y: &str, (errors, order): (&[f64], f64)| {
        let axes = ["mesh size (height of the block = 1)", y];
        let mut plot = figures::orders(title, axes, &[Curve::new("P1", sizes, errors, [1.42, order])]);
        (plot.x.range, plot.y.range) = (Some([0.02, 0.05]), Some([2e-4, 1e-3]));
        plot
    };
    let plots = [
        plot("displacement", "rms error of u at the probes (height = 1)", displacement),
        plot("its rate along the load", "rms error of du/ds at the probes (height = 1)", rate),
    ];
    let words = [
        "Matrix: a clamped block, stretched by 20 % a side",
        "against the continuum, known to 2e-6; the numbers are fitted orders; the corners allow 1.42, not 2",
    ];
    figures::write("clamped_block", words, &plots);
}

#[test]
fn a_stretched_block_is_stable_and_one_pressed_beyond_its_bifurcation_is_not() {
    let mesh = block(36, 24);
    let stable = moved_ends(&mesh, svk(0.3), 0.2, false);
    assert!(march(&stable, 4, &NewtonOptions::default()).iter().all(|found| found.negative_eigenvalues == 0));
    // Sliding ends bifurcate at 16.4 % a side.
    let pressed = moved_ends(&mesh, svk(0.3), -0.19, false);
    let states = march(&pressed, 19, &NewtonOptions::default());
    let first = states.iter().position(|found| found.negative_eigenvalues > 0).unwrap();
    assert!((15..=17).contains(&first), "first unstable at {} % a side", first + 1);
}
