//! The plan of a scene: what it needs, what it does not, how near its limits are; and the run does no more than the plan says.

mod common;

use common::{ended, hash_of_states, loaded};
use serde_json::{Value, json};
use std::path::Path;
use tropism::study::plan::{ScenePlan, plan};
use tropism::systems;

fn scene() -> Value {
    json!({
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 25 },
        "time": { "duration": 2, "step": "4 min" },
        "populations": { "axons": { "count": 8, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "matrix": { "motion": { "top": { "outward": 0.1 } , "bottom": { "outward": 0.0 } } },
        "cues": {
            "read": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] },
            "unread": { "sources": [{ "disc": { "centre": [50, 160], "radius": 25 } }] }
        },
        "chemotaxis": { "receptors": { "read": {} } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    })
}

fn changed(change: impl FnOnce(&mut Value)) -> Value {
    let mut scene = scene();
    change(&mut scene);
    scene
}

fn planned(scene: &Value) -> ScenePlan {
    let roster = systems::standard();
    plan(&loaded(scene, &roster), &roster, Path::new("scene.json")).unwrap()
}

fn margin(plan: &ScenePlan, name: &str) -> Option<f64> {
    plan.plan.margins.iter().find(|margin| margin.name.contains(name)).map(|margin| margin.value)
}

#[test]
fn the_plan_says_how_much_of_ellipticity_a_compression_uses_up() {
    let squeezed = |outward: f64| {
        let slides = json!({ "outward": outward, "sideways": "sliding" });
        let found = planned(&changed(|scene| {
            scene["matrix"] =
                json!({ "motion": { "top": slides, "bottom": { "outward": 0.0, "sideways": "sliding" } } })
        }));
        margin(&found, "ellipticity").unwrap()
    };
    let (stretched, slightly, strongly) = (squeezed(0.2), squeezed(-0.05), squeezed(-0.2));
    assert!(stretched < 0.2, "{stretched}");
    assert!(slightly > 0.02 && strongly > 2.0 * slightly && strongly < 1.0, "{slightly} {strongly}");
    assert_eq!(margin(&planned(&changed(|scene| scene["matrix"] = Value::Null)), "ellipticity"), None);
}

/// Whether a part is kept; none if the plan does not speak of it.
fn kept(plan: &ScenePlan, name: &str) -> Option<bool> {
    plan.plan.parts.iter().find(|part| part.name == name).map(|part| part.kept)
}

#[test]
fn a_plan_says_what_is_kept_and_what_is_left_out() {
    let found = planned(&scene());
    for (name, expected) in [
        ("matrix", true),
        ("cue `read`", true),
        ("cue `unread`", false),
        ("shaft index", true),
        ("borders", true),
        ("Brownian paths", true),
        ("receptor weights over time", false),
    ] {
        assert_eq!(kept(&found, name), Some(expected), "{name}");
    }
    assert!(found.plan.parts.iter().all(|part| !part.why.is_empty()));
    let bare = planned(&changed(|scene| {
        scene.as_object_mut().unwrap().retain(|name, _| name != "matrix" && name != "heading_noise");
    }));
    assert_eq!([kept(&bare, "matrix"), kept(&bare, "heading_noise")], [Some(false); 2]);
    let text = found.to_string();
    assert!(text.contains("needs\n  matrix") && text.contains("does not need\n") && text.contains("kappa = 0.930 /h"));
}

#[test]
fn the_run_does_what_the_plan_says_and_no_more() {
    let roster = systems::standard();
    let found = planned(&scene());
    let counters = ended(&scene(), &roster).counters();
    assert_eq!(found.steps, 30);
    assert!(counters.steps <= found.steps && counters.cone_steps <= found.cone_steps_at_most);
    assert!(counters.cone_steps > found.cone_steps_at_most / 2);
    assert_eq!(
        [counters.matrix_solves, counters.cue_solves, counters.cue_factorisations],
        [found.solved.matrix_solves, found.solved.cue_solves, found.solved.cue_factorisations]
    );
    let alone = changed(|scene| scene["populations"]["axons"]["count"] = json!(1));
    assert_eq!(kept(&planned(&alone), "shaft index"), Some(false));
    let counters = ended(&alone, &roster).counters();
    assert_eq!([counters.neighbour_queries, counters.indexed_segments], [0, 0]);
}

#[test]
fn edges_that_do_not_move_need_no_mechanics() {
    let roster = systems::standard();
    let still = changed(|scene| scene["matrix"] = json!({ "motion": { "top": { "outward": 0.0 } } }));
    let unloaded = changed(|scene| scene["matrix"]["load"] = json!({ "times": [0, 2], "loads": [0, 0] }));
    let none = changed(|scene| drop(scene.as_object_mut().unwrap().remove("matrix")));
    let expected = hash_of_states(ended(&none, &roster).world());
    for scene in [still, unloaded] {
        assert_eq!(kept(&planned(&scene), "matrix"), Some(false));
        let simulation = ended(&scene, &roster);
        assert_eq!(simulation.counters().matrix_solves, 0);
        assert_eq!(hash_of_states(simulation.world()), expected);
    }
}

#[test]
fn a_limit_that_is_passed_is_marked_and_noted() {
    let usual = planned(&scene());
    assert!(usual.plan.margins.iter().all(|margin| !margin.is_passed()) && !usual.to_string().contains("PASSED"));
    let coarse = planned(&changed(|scene| scene["time"] = json!({ "duration": 2, "step": 1.5, "method": "euler" })));
    let passed = |what: &str| coarse.plan.margins.iter().any(|m| m.name.contains(what) && m.is_passed());
    // 1.5 h of 0.1 h; 30 um of 200 um; 0.93 /h * 1.5 h * (1 + 2 + 8) of 2.
    assert!(passed("fasciculation") && passed("step length") && passed("strongest pull"));
    let worst = coarse.plan.margins.iter().find(|margin| margin.name.contains("strongest pull")).unwrap();
    assert!((worst.value - 0.93 * 1.5 * 11.0).abs() < 1e-12, "{worst}");
    assert_eq!(coarse.notes.iter().filter(|note| note.contains("or less is advised (")).count(), 3);
    let exact = planned(&changed(|scene| scene["time"] = json!({ "duration": 2, "step": 1.5 })));
    assert!(!exact.plan.margins.iter().any(|margin| margin.name.contains("strongest pull")));
    let pair = json!({ "duration": 2, "step": 1.5, "method": "bogacki_shampine", "tolerance": "1 nm" });
    let pair = planned(&changed(|scene| scene["time"] = pair));
    let margin = pair.plan.margins.iter().find(|margin| margin.name.contains("strongest pull")).unwrap();
    assert!(margin.limit == 2.512 && margin.is_passed());
    let part = pair.plan.parts.iter().find(|part| part.name == "adaptive steps").unwrap();
    assert!(part.kept && part.why.contains("within 0.001 um"), "{}", part.why);
}
