//! A tissue that grows by itself, from a scenario to where it and its axons are.

use crate::common::{assembled, cones, ended, hash_of_states, try_load};
use serde_json::{Value, json};
use tropism::prelude::*;
use tropism::systems;
use tropism::systems::matrix::Loading;

fn scene(matrix: Value) -> Value {
    json!({
        "seed": 2,
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 300 } }, "mesh_size": 20 },
        "time": { "duration": 6, "step": "6 min" },
        "populations": { "axons": { "count": 8, "births": { "at": 0 } } },
        "matrix": matrix, "borders": {}, "heading_noise": {}
    })
}

/// The left half grows to 1.4 times its length, the right one stays.
fn left_half() -> Value {
    let half = [[0, 0], [100, 0], [100, 300], [0, 300]];
    json!({ "regions": [{ "factor": 1.4, "shape": { "polygon": { "points": half } } }] })
}

/// The tissue at a time: places at rest and then.
fn at(scene: &Value, time: f64) -> Vec<([f64; 2], [f64; 2])> {
    let mut simulation = assembled(scene, &systems::standard());
    simulation.look_at(time);
    let world = simulation.world();
    let (tissue, now) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    tissue.mesh.vertices().iter().copied().zip(now.coordinates().iter().copied()).collect()
}

#[test]
fn a_tissue_that_nothing_holds_grows_about_its_middle_and_keeps_its_shape() {
    for material in systems::standard().materials().names() {
        let grown = at(&scene(json!({ "material": material, "growth": { "factor": 1.3 } })), 6.0);
        let (rest, now) = grown[0];
        for (x, y) in &grown {
            (0..2).for_each(|k| assert!((y[k] - now[k] - 1.3 * (x[k] - rest[k])).abs() < 1e-9, "{material}"));
        }
        let middle = grown.iter().map(|(x, y)| (y[0] - 1.3 * x[0], y[1] - 1.3 * x[1])).next().unwrap();
        let [x, y] = [middle.0 + 130.0, middle.1 + 195.0];
        assert!((x - 100.0).abs() < 10.0 && (y - 150.0).abs() < 10.0, "the middle moves to {x}, {y}");
    }
}

#[test]
fn growth_follows_the_load_in_time() {
    let mut loaded = scene(json!({ "growth": { "factor": 1.3 } }));
    loaded["matrix"]["load"] = json!({ "times": [1, 3], "loads": [0, 0.5] });
    for (time, factor) in [(0.5, 1.0), (2.0, 1.075), (5.0, 1.15)] {
        let grown = at(&loaded, time);
        let width = grown.iter().map(|(_, y)| y[0]).fold(f64::NEG_INFINITY, f64::max)
            - grown.iter().map(|(_, y)| y[0]).fold(f64::INFINITY, f64::min);
        assert!((width - 200.0 * factor).abs() < 1e-9, "{time}: {width}");
    }
}

#[test]
fn a_tissue_of_which_the_left_half_grows_bends_to_the_right_and_carries_its_axons_there() {
    let bent = scene(json!({ "growth": left_half(), "motion": { "bottom": {} } }));
    let top: Vec<_> = at(&bent, 6.0).into_iter().filter(|(x, _)| x[1] == 300.0).collect();
    let shift = top.iter().map(|(x, y)| y[0] - x[0]).sum::<f64>() / top.len() as f64;
    assert!(shift > 40.0, "{shift}");
    let tip = |growth: Value| {
        let mut scene = scene(json!({ "growth": growth, "motion": { "bottom": {} } }));
        let origin = json!({ "points": [[100, 250]] });
        scene["populations"]["axons"] =
            json!({ "count": 1, "speed": 3, "births": { "at": 0 }, "origin": origin, "heading": 90 });
        cones(ended(&scene, &systems::standard()).world())[0].position.x
    };
    let carried = tip(left_half()) - tip(json!({ "factor": 1.0 }));
    assert!(carried > 0.5 * shift && carried < shift, "{carried} of {shift}");
}

#[test]
fn growth_by_a_factor_of_one_keeps_every_bit_of_a_scene_without_it() {
    let hash = |growth: Value| {
        let motion = json!({ "top": { "outward": 0.2 }, "bottom": {} });
        let end = ended(&scene(json!({ "motion": motion, "growth": growth })), &systems::standard());
        hash_of_states(end.world())
    };
    let without = hash(Value::Null);
    assert_eq!(hash(json!({})), without);
    assert_eq!(hash(json!({ "factor": 1 })), without);
    assert_ne!(hash(json!({ "factor": 1.001 })), without);
}

#[test]
fn growth_and_its_regions_decide_what_is_solved_once_and_what_the_plan_says() {
    let of = |growth: Value| {
        let simulation = assembled(&scene(json!({ "growth": growth })), &systems::standard());
        let inputs = simulation.world().get_resource::<Loading>().map(|loading| loading.inputs().to_owned());
        let plan = simulation.world().resource::<Plan>();
        (inputs, serde_json::to_string(plan).unwrap())
    };
    let (inputs, plan) = of(left_half());
    assert!(plan.contains("the tissue grows to 1 to 1.4 times its length"), "{plan}");
    let (other, _) = of(json!({ "factor": 1.3 }));
    assert!(inputs.is_some() && inputs != other);
    let (none, plan) = of(json!({ "factor": 1 }));
    assert_eq!(none, None);
    assert!(plan.contains("nothing grows: the tissue stays at rest"), "{plan}");
}

#[test]
fn growth_that_cannot_be_is_refused_with_its_place() {
    let problems = |growth: Value| -> Vec<String> {
        let errors = try_load(&scene(json!({ "growth": growth })), &systems::standard(), &[], &[]).unwrap_err();
        errors.problems.iter().map(ToString::to_string).collect()
    };
    let first = |growth: Value| problems(growth).swap_remove(0);
    assert!(first(json!({ "factor": 0 })).starts_with("/matrix/growth/factor: 0 is outside what is possible"));
    let seen = first(json!({ "regions": [{ "factor": 1.2 }] }));
    assert!(seen.starts_with("/matrix/growth/regions/0: the key `shape` is missing"), "{seen}");
    let away = json!({ "factor": 1.2, "shape": { "disc": { "centre": [900, 0], "radius": 5 } } });
    let seen = first(json!({ "regions": [away] }));
    assert!(seen.starts_with("/matrix/growth/regions/0/shape"), "{seen}");
}
