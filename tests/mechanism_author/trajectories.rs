//! The independent reference trajectories (assets/reference/trajectories.json): eight cones steered by the direction of a combined
//! signal. Lengths there are in units of the block height and D = 1; here they are simply um and h.

use crate::combined_signal::{ExactSignal, SensedSignal};
use crate::common::{angle_between, assembled, cones, fitted_order};
use crate::disc_field::{Disc, bessel_i1, bessel_k1, gradient};
use serde_json::{Map, Value, json};
use tropism::prelude::*;
use tropism::systems;

pub fn reference(name: &str) -> Value {
    let path = format!("{}/assets/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// The scene of the reference with `steps` steps between two stored times.
pub fn scene(reference: &Value, method: &str, steps: usize, mesh_size: f64) -> Value {
    let cones = &reference["cones"];
    let count = cones["x0"].as_array().unwrap().len();
    let populations: Map<String, Value> = (0..count)
        .map(|i| {
            let heading = cones["theta0"][i].as_f64().unwrap().to_degrees();
            let keys = json!({
                "count": 1, "speed": cones["statement"]["v_g"], "births": { "at": 0 },
                "origin": { "points": [cones["x0"][i]] }, "heading": heading
            });
            (format!("cone{i}"), keys)
        })
        .collect();
    let interval = cones["times"][0].as_f64().unwrap();
    json!({
        "tissue": { "outline": { "rectangle": { "width": 1.5, "height": 1.0 } }, "mesh_size": mesh_size },
        "time": { "duration": cones["statement"]["T"], "step": interval / steps as f64, "method": method },
        "growth": { "turning_rate": cones["statement"]["rate"], "filopodium_length": cones["statement"]["l0"] },
        "populations": populations,
    })
}

pub fn with_exact_field(mut scene: Value) -> Value {
    let field = reference("cue_field");
    let statement = &field["statement"];
    let discs = |ligand: &str, weight: f64| -> Vec<Vec<f64>> {
        let list = statement["discs_cx_cy_radius"][ligand].as_array().unwrap();
        list.iter().map(|disc| [numbers(disc), vec![weight]].concat()).collect()
    };
    let (attract, repel) = (statement["lambda_a"].as_f64().unwrap(), statement["lambda_r"].as_f64().unwrap());
    let signal = [discs("a", attract), discs("r", -repel)].concat();
    scene["exact_signal"] = json!({ "discs": signal });
    scene
}

fn with_own_fields(mut scene: Value) -> Value {
    let field = reference("cue_field");
    let statement = &field["statement"];
    let cue = |ligand: &str| {
        let discs = statement["discs_cx_cy_radius"][ligand].as_array().unwrap();
        let shapes: Vec<Value> =
            discs.iter().map(|d| json!({ "disc": { "centre": [d[0], d[1]], "radius": d[2] } })).collect();
        json!({ "diffusion": 1, "degradation": 100, "release_rate": 100, "sources": shapes })
    };
    scene["cues"] = json!({ "a": cue("a"), "r": cue("r") });
    scene["sensed_signal"] =
        json!({ "weights": { "a": statement["lambda_a"], "r": -statement["lambda_r"].as_f64().unwrap() } });
    scene
}

/// Largest errors of position (um) and heading (rad) over all cones and times, and what the run cost.
pub fn worst_errors_and_cost(reference: &Value, scene: &Value) -> ([f64; 2], Counters) {
    let roster = systems::standard().with::<ExactSignal>().with::<SensedSignal>();
    let mut simulation = assembled(scene, &roster);
    let stored = &reference["cones"];
    let mut worst = [0.0f64; 2];
    for (j, time) in numbers(&stored["times"]).into_iter().enumerate() {
        while simulation.time() < time - 1e-12 {
            simulation.step().unwrap();
        }
        assert!((simulation.time() - time).abs() < 1e-12);
        for (i, cone) in cones(simulation.world()).iter().enumerate() {
            let place = numbers(&stored["xy"][j][i]);
            let heading = cone.spring.heading.y.atan2(cone.spring.heading.x);
            let off = (cone.position.x - place[0]).hypot(cone.position.y - place[1]);
            let turned = angle_between(heading, stored["theta"][j][i].as_f64().unwrap()).abs();
            assert_eq!(cone.position.z.to_bits() | cone.spring.heading.z.to_bits(), 0);
            worst = [worst[0].max(off), worst[1].max(turned)];
        }
    }
    (worst, simulation.counters())
}

fn worst_errors(reference: &Value, scene: &Value) -> [f64; 2] {
    worst_errors_and_cost(reference, scene).0
}

#[test]
fn the_exact_field_of_this_test_is_that_of_the_reference() {
    // Abramowitz & Stegun, tables 9.8 and 9.11.
    assert!((bessel_i1(0.8) - 0.432_864_802_620_639_8).abs() < 1e-15);
    assert!((bessel_k1(1.0) - 0.601_907_230_197_234_6).abs() < 1e-15);
    assert!((bessel_k1(10.0) / 1.864_877_345_382_558_5e-5 - 1.0).abs() < 1e-14);
    let field = reference("cue_field");
    let statement = &field["statement"];
    for (ligand, stored) in [("a", &field["fields"][0]), ("r", &field["fields"][1])] {
        let discs = statement["discs_cx_cy_radius"][ligand].as_array().unwrap();
        for (p, probe) in field["probes"].as_array().unwrap().iter().enumerate() {
            let at = numbers(probe);
            let at = [at[0], at[1]];
            let discs: Vec<Disc> = discs
                .iter()
                .map(numbers)
                .map(|d| Disc { centre: [d[0], d[1]], radius: d[2], inverse_decay_length: 10.0 })
                .collect();
            if discs.iter().any(|d| (at[0] - d.centre[0]).hypot(at[1] - d.centre[1]) <= d.radius) {
                continue;
            }
            let sum =
                discs.iter().map(|d| gradient(d, [1.5, 1.0], at)).fold([0.0; 2], |s, g| [s[0] + g[0], s[1] + g[1]]);
            let wanted = numbers(&stored["grad"][p]);
            let size = wanted[0].hypot(wanted[1]);
            assert!((sum[0] - wanted[0]).hypot(sum[1] - wanted[1]) < 1e-11 * size, "{ligand} at {at:?}");
        }
    }
}

#[test]
fn runge_kutta_in_small_steps_meets_the_reference_to_its_own_error() {
    let reference = reference("trajectories");
    let allowed = 4.0 * reference["cones"]["estimated_error"].as_f64().unwrap();
    let [place, heading] = worst_errors(&reference, &with_exact_field(scene(&reference, "rk4", 48, 0.1)));
    println!("rk4, 48 steps an interval: {place:.2e} um, {heading:.2e} rad");
    assert!(place < allowed && heading < allowed, "{place:e} {heading:e}");
}

#[test]
fn each_method_has_its_order_in_position_and_in_heading() {
    let reference = reference("trajectories");
    for (method, order, steps) in [
        ("euler", 1.0, [8, 16, 32]),
        ("heun", 2.0, [8, 16, 32]),
        ("rk4", 4.0, [2, 4, 8]),
        ("rotation", 2.0, [8, 16, 32]),
    ] {
        let errors = steps.map(|n| worst_errors(&reference, &with_exact_field(scene(&reference, method, n, 0.1))));
        for (kind, what) in ["position", "heading"].into_iter().enumerate() {
            let found = fitted_order(&errors.map(|e| e[kind]));
            println!("{method}: {what}: order {found:.3}, errors {:?}", errors.map(|e| e[kind]));
            assert!((found - order).abs() < 0.15, "{method}: {what}: order {found}, wanted {order}; {errors:?}");
        }
    }
}

#[test]
fn with_the_programs_own_fields_the_error_falls_with_the_mesh_by_order_two() {
    let reference = reference("trajectories");
    let errors = [0.048, 0.024, 0.012].map(|size| {
        let scene = with_own_fields(scene(&reference, "rotation", 8, size));
        worst_errors(&reference, &scene)
    });
    for (kind, bound) in [(0, 1e-4), (1, 5e-4)] {
        let errors = errors.map(|e| e[kind]);
        println!(
            "own fields, {}: order {:.2}, errors {errors:?}",
            ["position", "heading"][kind],
            fitted_order(&errors)
        );
        assert!(fitted_order(&errors) > 1.5 && errors[2] < bound, "{errors:?}");
    }
}
