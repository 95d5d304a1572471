//! Integrators of the turning law from κΔt = 0.01 to 100.

use std::sync::LazyLock;

use tropism::numerics::runge_kutta::{EULER, HEUN, RK4};
use tropism::study::stability::turning::{MethodMap, SMALL_ANGLE, START, STEPS, TurningMap, compute};

use crate::roster;

static MAP: LazyLock<TurningMap> = LazyLock::new(|| compute(&roster(), 25).unwrap());

fn of(method: &str) -> &'static MethodMap {
    MAP.methods.iter().find(|map| map.method == method).unwrap()
}

#[test]
fn the_map_spans_four_decades_for_every_integrator() {
    for map in &MAP.methods {
        assert_eq!(map.points.len(), 25);
        let (first, last) = (&map.points[0], &map.points[24]);
        assert!((first.rate_times_step - 0.01).abs() < 1e-12 && (last.rate_times_step - 100.0).abs() < 1e-9);
    }
    assert_eq!(MAP.methods.iter().map(|map| map.method).collect::<Vec<_>>(), ["euler", "heun", "rk4", "rotation"]);
}

#[test]
fn a_step_of_an_explicit_integrator_multiplies_a_small_angle_by_its_stability_polynomial() {
    for tableau in [EULER, HEUN, RK4] {
        for point in &of(tableau.name).points {
            let wanted = tableau.stability_polynomial(-point.rate_times_step).abs();
            // Beyond this the angle is small no more.
            if wanted * SMALL_ANGLE < 1e-3 {
                let bound = 1e-5 * wanted + 1e-9;
                assert!((point.amplification - wanted).abs() < bound, "{}: {point:?}, wanted {wanted}", tableau.name);
            }
        }
    }
}

#[test]
fn small_angles_grow_beyond_2_with_euler_and_heun_and_beyond_2785_with_rk4_and_never_with_rotation() {
    // 1 − x + x²/2 − x³/6 + x⁴/24 = 1 where x³ − 4x² + 12x − 24 = 0.
    let root = |mut x: f64| {
        (0..50).for_each(|_| x -= (x.powi(3) - 4.0 * x * x + 12.0 * x - 24.0) / (3.0 * x * x - 8.0 * x + 12.0));
        x
    };
    for (method, wanted) in [("euler", 2.0), ("heun", 2.0), ("rk4", root(2.8))] {
        let found = of(method).limit.unwrap();
        assert!((found - wanted).abs() < 1e-5, "{method}: {found} for {wanted}");
    }
    assert_eq!(of("rotation").limit, None);
}

#[test]
fn a_step_of_euler_lengthens_the_velocity_as_the_model_says() {
    for point in &of("euler").points {
        let wanted = (1.0 + (point.rate_times_step * START.to_radians().sin()).powi(2)).sqrt();
        assert!((point.first_growth / wanted - 1.0).abs() < 1e-12, "{point:?} {wanted}");
    }
}

#[test]
fn rotation_keeps_the_speed_never_overshoots_and_ends_at_the_closed_form() {
    for point in &of("rotation").points {
        assert_eq!((point.growth, point.overshoot), (1.0, 0.0), "{point:?}");
        let x = point.rate_times_step;
        let angle = |steps: f64| 2.0 * ((START.to_radians() / 2.0).tan() * (-x * steps).exp()).atan();
        let residual = angle(STEPS as f64).to_degrees();
        assert!((point.residual - residual).abs() < 1e-10, "{point:?} {residual}");
        if x < 30.0 {
            assert!((point.amplification / (-x).exp() - 1.0).abs() < 1e-8, "{point:?}");
        }
    }
}

#[test]
fn beyond_the_limit_explicit_integrators_lengthen_the_velocity_and_the_scene_warns() {
    for (method, limit) in [("euler", 2.0), ("heun", 2.0), ("rk4", 2.785)] {
        for point in &of(method).points {
            assert_eq!(point.warned, point.rate_times_step > limit, "{method}: {point:?}");
            assert!(!point.warned || point.growth > 1.02, "{method}: {point:?}");
        }
    }
    assert!(of("rotation").points.iter().all(|point| !point.warned));
}

#[test]
fn the_longer_velocity_brings_the_step_back_to_the_limit() {
    // A velocity longer by a factor turns more slowly by it: what counts is κΔt over the growth of |v_g|.
    for (method, limit) in [("euler", 2.0), ("heun", 2.0), ("rk4", 2.786)] {
        for point in of(method).points.iter().filter(|point| point.rate_times_step > limit) {
            let effective = point.rate_times_step / point.growth;
            assert!(effective < limit + 0.02, "{method}: {effective} at {point:?}");
        }
    }
}

#[test]
fn euler_swings_beyond_the_pull_and_heun_does_not() {
    // Under a unit pull one step of Euler from β ends beyond it where κΔt cos β > 1; R(−x) of Heun is positive.
    for point in &of("euler").points {
        assert_eq!(point.overshoot > 0.0, point.rate_times_step * START.to_radians().cos() > 1.0, "{point:?}");
    }
    let largest = of("euler").points.iter().map(|point| point.overshoot).fold(0.0, f64::max);
    assert!(largest > 50.0, "{largest}");
    assert!(of("heun").points.iter().all(|point| point.overshoot == 0.0));
}
