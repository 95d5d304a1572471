//! The turning law through the whole program.

use crate::common::{cones, ended, loaded, recorded};
use crate::fixed_pull::roster;
use serde_json::{Map, Value, json};
use std::f64::consts::PI;
use tropism::prelude::{GrowthCone, Velocity, With};

const STEP: f64 = 0.125;
const SPEED: f64 = 20.0;

/// One cone for each first angle (rad) to a pull of `strength` along x.
fn scene(method: &str, angles: &[f64], turning_rate: f64, strength: f64, steps: u32) -> Value {
    let populations: Map<String, Value> = angles
        .iter()
        .enumerate()
        .map(|(i, angle)| {
            let origin = json!({ "points": [[500, 500]] });
            let heading = angle.to_degrees();
            let keys =
                json!({ "count": 1, "speed": SPEED, "births": { "at": 0 }, "origin": origin, "heading": heading });
            (format!("cone{i}"), keys)
        })
        .collect();
    json!({
        "tissue": { "outline": { "rectangle": { "width": 1000, "height": 1000 } }, "mesh_size": 200 },
        "time": { "duration": STEP * f64::from(steps), "step": STEP, "method": method },
        "growth": { "turning_rate": turning_rate },
        "populations": populations,
        "fixed_pull": { "pull": [strength, 0] }
    })
}

/// The first angle is known to a few ε, and dβ/dβ₀ = sin β / sin β₀: that is what may be asked of the last one.
#[test]
fn rotation_keeps_the_law_of_the_half_tangent_at_any_step_and_angle() {
    let angles = [0.0, 1e-3, 0.5, 1.5, 2.5, 3.0, PI - 1e-3, PI - 1e-6];
    let steps = 4;
    let mut worst = 0.0f64;
    for product in [0.01, 0.1, 1.0, 2.0, 10.0, 100.0] {
        let strength = 0.5;
        let turning_rate = product / (STEP * strength);
        let end = ended(&scene("rotation", &angles, turning_rate, strength, steps), &roster());
        for (cone, first) in cones(end.world()).iter().zip(angles) {
            let wanted = 2.0 * ((0.5 * first).tan() * (-product * f64::from(steps)).exp()).atan();
            let found = cone.spring.heading.y.atan2(cone.spring.heading.x);
            let growth = if first == 0.0 { 1.0 } else { (wanted.sin() / first.sin()).max(1.0) };
            let bound = f64::from(steps) * f64::EPSILON * growth;
            worst = worst.max((found - wanted).abs() / bound);
            assert!(
                (found - wanted).abs() <= bound,
                "kappa dt = {product}, beta = {first}: {found} for {wanted}, {bound:e}"
            );
        }
    }
    println!("largest error: {worst:.2} of the bound");
}

#[test]
fn rotation_keeps_the_speed_to_the_last_bit_or_two() {
    let angles = [0.3, 1.5, 3.0];
    let scene = scene("rotation", &angles, 40.0, 1.0, 100);
    let end = ended(&scene, &roster());
    let mut velocities = end.world().try_query_filtered::<&Velocity, With<GrowthCone>>().unwrap();
    for velocity in velocities.iter(end.world()) {
        assert!((velocity.growth.norm() / SPEED - 1.0).abs() < 1e-15, "{}", velocity.growth.norm());
    }
    assert!(cones(end.world()).iter().all(|cone| cone.spring.drift == 1.0));
    assert_eq!(recorded(&loaded(&scene, &roster()), &roster()).summary.speed_drift, 0.0);
}

/// |v_g|' = |v_g| √(1 + (κΔt sin β)²) in the first step; then with κΔt over the speed so far.
#[test]
fn the_summary_states_the_drift_of_the_speed_under_euler() {
    let (first, product) = (1.2f64, 0.5);
    for steps in [1, 2, 10] {
        let (mut drift, mut angle) = (1.0f64, first);
        for _ in 0..steps {
            let sideways = product * angle.sin();
            angle -= sideways.atan2(drift);
            drift = drift.hypot(sideways);
        }
        if steps == 1 {
            assert!((drift - (1.0 + (product * first.sin()).powi(2)).sqrt()).abs() < 1e-15);
        }
        let scene = scene("euler", &[first], product / STEP, 1.0, steps);
        let found = recorded(&loaded(&scene, &roster()), &roster()).summary.speed_drift;
        println!("euler, kappa dt = {product}, {steps} steps: drift {found}");
        assert!((found - (drift - 1.0)).abs() < 1e-13, "{steps} steps: {found}, wanted {}", drift - 1.0);
    }
}

/// Beyond its limit an explicit method swings about the pull until the speed has drifted so far that κΔt over it is inside again:
/// the instability shows in the speed. Amplification 1 − z, 1 − z + z²/2, …, z = κΔt.
#[test]
fn explicit_methods_fail_beyond_their_limit_and_rotation_does_not() {
    let after = |method: &str, product: f64| {
        let cone = cones(ended(&scene(method, &[1e-6], product / STEP, 1.0, 200), &roster()).world())[0];
        (cone.spring.heading.y.atan2(cone.spring.heading.x).abs(), cone.journey.worst_drift)
    };
    for (method, limit) in [("euler", 2.0), ("heun", 2.0), ("rk4", 2.785)] {
        let (angle, drift) = after(method, 0.95 * limit);
        assert!(angle < 1e-9 && drift < 1e-9, "{method} below its limit: {angle:e}, {drift:e}");
        let (_, drift) = after(method, 1.05 * limit);
        assert!(drift > 0.03, "{method} above its limit drifts by {drift:e} only");
        assert!(after("rotation", 1.05 * limit).0 < 1e-9);
    }
}
