//! Heading noise: its statistics are those of the closed forms whatever the step, and a refined step refines the same path.

use crate::common::{ConeState, cones, ended};
use crate::fixed_pull::roster;
use serde_json::{Value, json};

const SPEED: f64 = 20.0;
const PERSISTENCE: f64 = 100.0;

fn scene(count: u64, duration: f64, step: f64) -> Value {
    json!({
        "seed": 2,
        "tissue": { "outline": { "rectangle": { "width": 1000, "height": 1000 } }, "mesh_size": 200 },
        "time": { "duration": duration, "step": step },
        "populations": { "axons": {
            "count": count, "speed": SPEED, "births": { "at": 0 }, "origin": { "points": [[500, 500]] }, "heading": 0
        } },
        "heading_noise": { "persistence_length": PERSISTENCE }
    })
}

fn run(scene: &Value) -> Vec<ConeState> {
    cones(ended(scene, &roster()).world())
}

/// Mean and its standard error.
fn mean(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

fn assert_within_four_errors((found, error): (f64, f64), wanted: f64, what: &str) {
    println!("{what}: {found:.5} +- {error:.5}, closed form {wanted:.5}");
    assert!((found - wanted).abs() < 4.0 * error, "{what}: {found} +- {error}, wanted {wanted}");
}

#[test]
fn headings_and_paths_persist_as_the_closed_forms_say_at_any_step() {
    let time = 6.0;
    for step in [0.2, 0.05] {
        let tips = run(&scene(1500, time, step));
        let decay = (-SPEED * time / PERSISTENCE).exp();
        assert_within_four_errors(mean(tips.iter().map(|c| c.spring.heading.x)), decay, &format!("<cos>, step {step}"));
        assert_within_four_errors(mean(tips.iter().map(|c| c.spring.heading.y)), 0.0, &format!("<sin>, step {step}"));
        let rate = SPEED / PERSISTENCE;
        let squared = 2.0 * SPEED * SPEED * (rate * time - 1.0 + (-rate * time).exp()) / (rate * rate);
        let distances = tips.iter().map(|c| (c.position.x - 500.0).powi(2) + (c.position.y - 500.0).powi(2));
        assert_within_four_errors(mean(distances), squared, &format!("MSD, step {step}"));
    }
}

/// I₁(x)/I₀(x) from the power series.
fn bessel_ratio(x: f64) -> f64 {
    let (mut zero, mut one, mut term) = (0.0, 0.0, 1.0);
    for n in 0..60 {
        zero += term;
        one += term * 0.5 * x / f64::from(n + 1);
        term *= 0.25 * x * x / f64::from((n + 1) * (n + 1));
    }
    one / zero
}

#[test]
fn under_a_fixed_pull_headings_become_von_mises_at_any_step() {
    let turning_rate = 0.93;
    // Abramowitz & Stegun, table 9.8: I0(1) = 1.2660658778, I1(1) = 0.5651591040.
    assert!((bessel_ratio(1.0) - 0.565_159_104_0 / 1.266_065_877_8).abs() < 1e-9);
    for step in [0.2, 0.05] {
        let mut scene = scene(1500, 8.0, step);
        scene["growth"] = json!({ "turning_rate": turning_rate });
        scene["fixed_pull"] = json!({ "pull": [1, 0] });
        let wanted = bessel_ratio(turning_rate * PERSISTENCE / SPEED);
        let found = mean(run(&scene).iter().map(|c| c.spring.heading.x));
        assert_within_four_errors(found, wanted, &format!("von Mises, step {step}"));
    }
}

#[test]
fn a_refined_step_refines_the_same_brownian_path() {
    for method in ["rotation", "heun"] {
        let tips = [0.4, 0.2, 0.1, 0.05, 0.025].map(|step| {
            let mut scene = scene(60, 8.0, step);
            scene["time"]["method"] = json!(method);
            scene["fixed_pull"] = json!({ "pull": [1, 0] });
            run(&scene)
        });
        let apart: Vec<f64> = tips
            .windows(2)
            .map(|pair| {
                mean(pair[0].iter().zip(&pair[1]).map(|(a, b)| (a.position - b.position).norm_squared())).0.sqrt()
            })
            .collect();
        println!("{method}: tips of successive halvings are apart by {apart:.3?} um (rms)");
        assert!(apart.windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{method}: {apart:?}");
        assert!(apart[3] < 0.5, "{method}: {apart:?}");
    }
}
