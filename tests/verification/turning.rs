//! The turning law against the closed form of `trajectories.json`.

use std::f64::consts::PI;

use nalgebra::Vector3;
use tropism::numerics::runge_kutta::{BOGACKI_SHAMPINE, ButcherTableau, EULER, HEUN, RK4};
use tropism::numerics::turning::{integral_of_turn, perpendicular_part, turn};

use crate::block::{array, fitted_order, number, reference};
use crate::figures::{self, Curve};

fn heading(angle: f64) -> Vector3<f64> {
    Vector3::new(angle.cos(), angle.sin(), 0.0)
}

#[test]
fn angle_and_position_under_a_constant_pull_are_those_of_the_table() {
    let data = reference("trajectories.json");
    let form = &data["closed_form"];
    let (rate, speed) = (number(&form["rate"]), number(&form["v_g"]));
    for row in array(&form["values"]) {
        let at = |key: &str| number(&row[key]);
        let (start, time) = (heading(at("beta0")), at("t"));
        // A pull of any length: only κ|L| counts.
        let pull = Vector3::x() * 0.5;
        let end = turn(&start, &pull, 2.0 * rate * time);
        let way = integral_of_turn(&start, &pull, 2.0 * rate, time) * speed;
        let bound = 1e-14 + 4.0 * f64::EPSILON / (PI - at("beta0"));
        assert!((end.y.atan2(end.x) - at("beta")).abs() < bound, "{row}");
        assert!((way.x - at("x")).abs() < bound && (way.y - at("y")).abs() < bound, "{row}: {way}");
    }
}

/// Angle after a time by an explicit method on the vector form, and the length of the heading.
fn explicit(method: &ButcherTableau, start: f64, steps: usize) -> Vector3<f64> {
    let step = 1.0 / steps as f64;
    let mut e = heading(start);
    for _ in 0..steps {
        let mut stages: Vec<Vector3<f64>> = Vec::new();
        for row in method.a {
            let stage = row.iter().zip(&stages).fold(e, |sum, (a, k)| sum + k * (a * step));
            stages.push(perpendicular_part(&Vector3::x(), &stage) * 2.0);
        }
        e = method.b.iter().zip(&stages).fold(e, |sum, (b, k)| sum + k * (b * step));
    }
    e
}

#[test]
fn explicit_methods_approach_the_closed_form_with_their_order() {
    let exact = turn(&heading(2.0), &Vector3::x(), 2.0);
    let second = ButcherTableau { b: BOGACKI_SHAMPINE.embedded, order: 2, name: "embedded", ..BOGACKI_SHAMPINE };
    let steps = [16, 32, 64, 128];
    let mut curves = Vec::new();
    for method in [EULER, HEUN, RK4, BOGACKI_SHAMPINE, second] {
        let errors = steps.map(|steps| (explicit(&method, 2.0, steps) - exact).norm());
        let order = fitted_order(&steps.map(|steps| 1.0 / steps as f64), &errors);
        assert!((order - f64::from(method.order)).abs() < 0.25, "{}: order {order}, {errors:?}", method.name);
        let sizes = steps.map(|steps| 2.0 / steps as f64);
        curves.push(Curve::new(method.name, &sizes, &errors, [f64::from(method.order), order]));
    }
    let (sizes, errors) = half_turns();
    let rotation = [Curve::new("half turns at midpoints", &sizes, &errors, [2.0, fitted_order(&sizes, &errors)])];
    let axes = ["κΔt", "error of the unit heading"];
    let plots =
        [figures::orders("a constant pull", axes, &curves), figures::orders("a pull that turns", axes, &rotation)];
    let words = [
        "The turning law",
        "against closed forms; the numbers are fitted orders; under a constant pull the rotation is exact for any step",
    ];
    figures::write("turning", words, &plots);
}

#[test]
fn an_euler_step_lengthens_the_heading_as_the_model_says() {
    let angle: f64 = 1.1;
    let stretched = (1.0 + (2.0 * angle.sin()).powi(2)).sqrt();
    assert!((explicit(&EULER, angle, 1).norm() - stretched).abs() < 1e-15 * 4.0);
}

/// κΔt and the errors of half turns at midpoints under a pull that turns.
fn half_turns() -> ([f64; 4], [f64; 4]) {
    // The pull rotates at Ω; relative to it β' = Ω − κ sin β has a steady lag asin(Ω/κ): the reference is that closed form.
    let (rate, spin) = (3.0f64, 1.2f64);
    let pull = |time: f64| heading(spin * time);
    let lag = -(spin / rate).asin();
    let error = |steps: usize| {
        let step = 2.0 / steps as f64;
        let mut e = heading(lag);
        for k in 0..steps {
            e = turn(&e, &pull((k as f64 + 0.5) * step), rate * step);
        }
        (e - heading(spin * 2.0 + lag)).norm()
    };
    let steps = [10, 20, 40, 80];
    (steps.map(|steps| rate * 2.0 / steps as f64), steps.map(error))
}

#[test]
fn a_pull_that_turns_is_followed_with_order_two_by_half_turns_at_midpoints() {
    let (sizes, errors) = half_turns();
    let order = fitted_order(&sizes, &errors);
    assert!((order - 2.0).abs() < 0.1, "{order}");
}
