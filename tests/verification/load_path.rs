//! The load path: its order, its derivative, and how it ends where there is no equilibrium.

use tropism::numerics::load_path::{LoadPath, LoadPathError, LoadPathOptions};
use tropism::numerics::newton::{Failure, NewtonOptions, equilibrium};
use tropism::record::plot::{Series, Stroke};

use crate::block::{HEIGHT, WIDTH, block, fitted_order, moved_ends, neo_hookean, svk};
use crate::figures::{self, Curve};

fn fixed_levels(levels: usize) -> LoadPathOptions {
    LoadPathOptions { min_levels: levels, max_levels: levels, ..LoadPathOptions::default() }
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_interpolant_is_of_order_four_in_the_spacing_of_the_levels() {
    let mesh = block(12, 8);
    let body = moved_ends(&mesh, svk(0.3), 0.2, true);
    let mut u = vec![0.0; body.unknowns()];
    let intervals = [8.0, 16.0, 32.0];
    let defects = intervals.map(|intervals: f64| {
        let path = LoadPath::solve(&body, &fixed_levels(intervals as usize + 1)).unwrap();
        assert!(!path.report().met && path.report().levels == intervals as usize + 1);
        (0..intervals as usize)
            .map(|k| {
                let load = (k as f64 + 0.5) / intervals;
                path.displacement(load, &mut u);
                let exact = equilibrium(&body, load, &u, &NewtonOptions::default()).unwrap();
                largest_difference(&u, &exact.displacement)
            })
            .fold(0.0, f64::max)
    });
    let spacings = intervals.map(|intervals| 1.0 / intervals);
    let order = fitted_order(&spacings, &defects);
    assert!((order - 4.0).abs() < 0.2, "order {order}, defects {defects:?}");
    let curves = [Curve::new("cubic between levels", &spacings, &defects, [4.0, order])];
    let spacing = ["spacing of the levels (whole load = 1)", "largest error of u midway (height = 1)"];
    let tolerance = ["tolerance", "largest error of u over the size of the block"];
    let seen = TOLERANCES.map(|tolerance| [tolerance, worst_error_by_the_closed_form(tolerance)]);
    let series = vec![
        Series::new("seen", seen, Stroke::LineAndMarks),
        Series::new("allowed", TOLERANCES.map(|tolerance| [tolerance; 2]), Stroke::Dashed),
    ];
    let mut fixed = figures::orders("clamped ends, levels at fixed distances", spacing, &curves);
    fixed.x.range = Some([0.02, 0.2]);
    let plots = [fixed, figures::plot("sliding ends, levels that a tolerance chooses", tolerance, series)];
    let words = [
        "Matrix: between the levels of the load",
        "a block stretched by 20 % a side, against equilibria (a) and the closed form (b); the number is the fitted order",
    ];
    figures::write("load_path", words, &plots);
}

const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-8];

/// Largest error over the size of the body between levels that are chosen by a tolerance.
fn worst_error_by_the_closed_form(tolerance: f64) -> f64 {
    let mesh = block(4, 2);
    let body = moved_ends(&mesh, svk(0.45), 0.2, false);
    let options = LoadPathOptions { tolerance, max_levels: 2000, ..LoadPathOptions::default() };
    let path = LoadPath::solve(&body, &options).unwrap();
    let report = path.report();
    assert!(report.met && report.defect <= tolerance, "{report:?}");
    assert_eq!(report.solves, report.levels, "nothing is solved twice: {report:?}");
    let mut u = vec![0.0; body.unknowns()];
    let right = mesh.vertices().iter().position(|x| *x == [WIDTH, HEIGHT]).unwrap();
    let mut worst: f64 = 0.0;
    for k in 0..=400 {
        let load = k as f64 / 400.0;
        path.displacement(load, &mut u);
        let across = (1.0 - 0.45 / 0.55 * ((1.0 + 0.4 * load).powi(2) - 1.0)).sqrt();
        worst = worst.max((u[2 * right] - 0.5 * WIDTH * (across - 1.0)).abs());
    }
    worst / body.size()
}

#[test]
fn the_tolerance_is_met_between_the_levels_by_the_closed_form() {
    for tolerance in TOLERANCES {
        let worst = worst_error_by_the_closed_form(tolerance);
        assert!(worst <= tolerance, "{worst:e} above {tolerance:e}");
    }
}

#[test]
fn the_rate_is_the_derivative_of_the_displacement() {
    let mesh = block(12, 8);
    let body = moved_ends(&mesh, svk(0.3), 0.2, true);
    let path = LoadPath::solve(&body, &fixed_levels(4)).unwrap();
    let n = body.unknowns();
    let (mut after, mut before, mut rate) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let h = 1e-5;
    for k in 1..20 {
        let load = k as f64 / 20.0;
        path.displacement(load + h, &mut after);
        path.displacement(load - h, &mut before);
        path.rate(load, &mut rate);
        let quotient: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        assert!(largest_difference(&quotient, &rate) < 1e-9, "at {load}");
    }
}

#[test]
fn a_scene_at_rest_costs_one_factorisation_a_level() {
    let mesh = block(4, 2);
    let body = moved_ends(&mesh, svk(0.3), 0.0, true);
    let path = LoadPath::solve(&body, &LoadPathOptions::default()).unwrap();
    assert_eq!(path.report().newton_iterations, path.report().solves);
    assert!(path.report().defect == 0.0 && path.report().min_jacobian == 1.0);
}

#[test]
fn compression_with_clamped_ends_ends_in_an_error_that_names_load_cell_and_stretch() {
    let mesh = block(24, 16);
    let body = moved_ends(&mesh, svk(0.3), -0.2, true);
    let Err(LoadPathError::Lost { last_good, failed, source }) = LoadPath::solve(&body, &LoadPathOptions::default())
    else {
        panic!("clamped St. Venant-Kirchhoff has no equilibrium at 20 % a side");
    };
    assert!(last_good > 0.1 && last_good < failed && failed <= last_good + 2e-3, "{last_good} {failed}");
    // Two independent codes lose it at 10.7 % a side on this mesh.
    assert!((0.2 * failed - 0.107).abs() < 1e-3, "lost at {} a side", 0.2 * failed);
    assert!(matches!(source.reason, Failure::NoDescent | Failure::Inverted | Failure::NoConvergence), "{source}");
    assert_eq!(source.load, failed);
    // The corners are where it breaks.
    let [x, y] = source.worst.position[..] else { panic!("{source}") };
    assert!(x.min(WIDTH - x) < 0.2 && y.min(HEIGHT - y) < 0.2, "{source}");
    assert!(source.worst.stretches[0] < 0.9 && source.worst.jacobian < 0.95, "{source}");
    let message = LoadPathError::Lost { last_good, failed, source }.to_string();
    for word in ["equilibrium lost between s = ", "cell ", "det F = ", "stretches ", "iterations", "residual"] {
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn the_neo_hookean_material_passes_where_st_venant_kirchhoff_fails() {
    let mesh = block(24, 16);
    let reached =
        |material| match LoadPath::solve(&moved_ends(&mesh, material, -0.2, true), &LoadPathOptions::default()) {
            Ok(path) => {
                assert!(path.report().min_jacobian > 0.0);
                1.0
            }
            Err(LoadPathError::Lost { last_good, .. }) => last_good,
            Err(other) => panic!("{other}"),
        };
    let (soft, hard) = (reached(svk(0.3)), reached(neo_hookean(0.3)));
    assert!(hard > 1.5 * soft, "St. Venant-Kirchhoff to {soft}, neo-Hookean to {hard}");
}

#[test]
fn sliding_ends_pressed_past_their_bifurcation_are_reported_as_unstable() {
    let mesh = block(36, 24);
    let body = moved_ends(&mesh, svk(0.3), -0.19, false);
    let path = LoadPath::solve(&body, &LoadPathOptions { min_levels: 20, ..LoadPathOptions::default() }).unwrap();
    let first = path.report().unstable_from.unwrap();
    assert!((0.19 * first - 0.164).abs() < 0.006, "unstable from {} a side", 0.19 * first);
}

#[test]
fn clamped_compression_breaks_earlier_on_a_finer_mesh() {
    let mesh = block(48, 32);
    let body = moved_ends(&mesh, svk(0.3), -0.1, true);
    let options = LoadPathOptions { min_levels: 9, ..LoadPathOptions::default() };
    let Err(LoadPathError::Lost { failed, .. }) = LoadPath::solve(&body, &options) else {
        panic!("the corner is singular: 10 % a side cannot be reached on 32 cells");
    };
    assert!((0.1 * failed - 0.081).abs() < 1e-3, "lost at {} a side", 0.1 * failed);
}

#[test]
fn a_march_that_may_not_take_enough_levels_says_how_far_it_came() {
    let mesh = block(4, 2);
    let body = moved_ends(&mesh, svk(0.3), 0.2, true);
    let options = LoadPathOptions { min_levels: 21, max_levels: 11, ..LoadPathOptions::default() };
    let Err(LoadPathError::TooManyLevels { levels: 11, reached }) = LoadPath::solve(&body, &options) else {
        panic!("twenty steps do not fit into eleven levels");
    };
    assert!((reached - 0.5).abs() < 0.051, "{reached}");
}
