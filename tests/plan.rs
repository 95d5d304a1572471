//! The plan of a scene: what it needs, what it does not, how near its limits are; and the run does no more than the plan says.

mod common;

use common::{ended, hash_of_states, loaded};
use serde_json::{Value, json};
use std::path::Path;
use tropism::model::plan::Plan;
use tropism::simulation::Simulation;
use tropism::study::estimate::Estimate;
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

fn part(estimate: &Estimate, name: &str) -> f64 {
    estimate.parts.iter().find(|part| part.name == name).map_or(0.0, |part| part.amount)
}

/// A plan of a scene in which cones grow to the end, so that what is expected is exact.
fn unguided(change: impl FnOnce(&mut Value)) -> ScenePlan {
    planned(&changed(|scene| {
        scene.as_object_mut().unwrap().remove("chemotaxis");
        scene["populations"]["axons"]["births"] = json!({ "at": 0 });
        change(scene);
    }))
}

#[test]
fn twice_the_axons_take_twice_what_axons_take_and_nothing_else() {
    let one = unguided(|_| {});
    let two = unguided(|scene| scene["populations"]["axons"]["count"] = json!(16));
    let twice = |of: &dyn Fn(&ScenePlan) -> f64| {
        let (a, b) = (of(&one), of(&two));
        assert!(a > 0.0 && (b / a - 2.0).abs() < 1e-12, "{a} {b}");
    };
    twice(&|plan| plan.expected.cone_steps);
    twice(&|plan| plan.expected.shaft_vertices);
    for name in ["axons", "shafts", "shaft index", "trajectories"] {
        twice(&|plan| part(&plan.memory_mb, name));
    }
    for name in ["cones", "borders", "trajectories"] {
        twice(&|plan| part(&plan.cpu_seconds, name));
    }
    for name in ["mesh", "matrix", "steps"] {
        assert!(part(&one.cpu_seconds, name) > 0.0, "{name}");
        assert_eq!(part(&one.cpu_seconds, name), part(&two.cpu_seconds, name), "{name}");
        assert_eq!(part(&one.memory_mb, name), part(&two.memory_mb, name), "{name}");
    }
    // Contact grows faster: twice the cones, and twice the shafts in the way of each.
    let contact = |count: u64| {
        let still = unguided(|scene| {
            scene["matrix"] = Value::Null;
            scene["populations"]["axons"]["count"] = json!(count);
        });
        part(&still.cpu_seconds, "shaft index")
    };
    assert!(contact(16) > 2.0 * contact(8) && contact(16) < 4.0 * contact(8));
    assert_eq!(one.expected.cone_steps, one.cone_steps_at_most as f64);
}

#[test]
fn what_a_scene_does_not_need_takes_neither_memory_nor_time() {
    let found = planned(&scene());
    for estimate in [&found.memory_mb, &found.cpu_seconds] {
        for name in ["matrix", "cue `read`", "shaft index", "figure"] {
            assert!(part(estimate, name) > 0.0, "{name}");
        }
        assert_eq!(part(estimate, "cue `unread`"), 0.0);
        let sum: f64 = estimate.parts.iter().map(|part| part.amount).sum();
        assert!((estimate.total - sum).abs() < 1e-12 * sum);
        assert!(estimate.parts.windows(2).all(|pair| pair[0].amount >= pair[1].amount));
    }
    let bare = planned(&changed(|scene| {
        scene["matrix"] = json!({ "motion": { "top": { "outward": 0.0 } } });
        scene["output"] = json!({ "figure_times": [] });
        scene.as_object_mut().unwrap().retain(|name, _| name != "fasciculation");
    }));
    for estimate in [&bare.memory_mb, &bare.cpu_seconds] {
        for name in ["matrix", "shaft index", "figure"] {
            assert_eq!(part(estimate, name), 0.0, "{name}");
        }
    }
    assert!(bare.memory_mb.total < found.memory_mb.total && bare.cpu_seconds.total < found.cpu_seconds.total);
    assert_eq!([kept(&bare, "figure.svg, figure.png"), kept(&bare, "trajectories.csv")], [Some(false), Some(true)]);
    assert_eq!([kept(&found, "figure.svg, figure.png"), kept(&found, "summary.json")], [Some(true); 2]);
}

#[test]
fn what_is_expected_of_a_guided_run_comes_near_what_it_does() {
    let roster = systems::standard();
    let guided = changed(|scene| {
        scene["time"]["duration"] = json!(20);
        scene["targets"] = json!({ "bulb": { "disc": { "centre": [150, 160], "radius": 25 } } });
    });
    let (found, counters) = (planned(&guided), ended(&guided, &roster).counters());
    let near = |expected: f64, found: u64| expected / found as f64 > 0.5 && expected / (found as f64) < 2.0;
    assert!(near(found.expected.cone_steps, counters.cone_steps), "{:?} {counters:?}", found.expected);
    assert!(near(found.expected.shaft_vertices, counters.indexed_segments), "{:?} {counters:?}", found.expected);
    assert!(found.expected.cone_steps < 0.8 * found.cone_steps_at_most as f64);
}

#[test]
fn decay_lengths_and_the_margins_of_the_mesh_are_told_of_each_cue() {
    let with = |cue: Value| planned(&changed(|scene| scene["cues"]["read"] = cue));
    let sources = json!([{ "disc": { "centre": [150, 160], "radius": 25 } }]);
    let lumped = with(json!({ "diffusion": 400, "degradation": 1, "sources": sources }));
    let length = lumped.plan.derived.iter().find(|derived| derived.name == "cue `read`: decay length").unwrap();
    assert_eq!((length.value, length.unit), (20.0, "um"));
    assert!(lumped.to_string().contains("cue `read`: decay length = 20.00 um"));
    let delaunay = margin(&lumped, "`read`: Delaunay").unwrap();
    assert!(delaunay > 2.0 / 3.0 && delaunay < 1.2, "{delaunay}");
    // Edges of about 25 um are far more than a fourth of 20 um; the note says so, once.
    let edges = margin(&lumped, "edge length over a quarter").unwrap();
    assert!(edges > 3.0 && edges < 6.0, "{edges}");
    assert_eq!(lumped.notes.iter().filter(|note| note.contains("long for a decay length of 20.000 um")).count(), 1);
    assert_eq!(margin(&lumped, "consistent mass"), None);
    let consistent = |k: f64| {
        let cue = json!({ "diffusion": 400, "degradation": k, "mass": "consistent", "sources": sources });
        let found = planned(&changed(|scene| {
            scene["cues"]["read"] = cue;
            scene["matrix"] = Value::Null;
        }));
        margin(&found, "consistent mass").unwrap()
    };
    assert!((consistent(2.0) / consistent(1.0) - 2.0).abs() < 1e-9, "the bound is on k h^2/D");
    let quadratic = with(json!({ "diffusion": 400, "degradation": 1, "element": "quadratic", "sources": sources }));
    assert_eq!(kept(&quadratic, "cue `read`: discrete maximum principle"), Some(false));
    assert_eq!([margin(&quadratic, "Delaunay"), margin(&quadratic, "consistent mass")], [None; 2]);
    let coarser = margin(&quadratic, "edge length over half").unwrap();
    assert!((edges / coarser - 2.0).abs() < 1e-12);
}

#[test]
fn a_tissue_that_grows_draws_axons_apart() {
    let crowding = |factor: f64| {
        let grown = changed(|scene| {
            scene["matrix"] =
                json!({ "growth": { "factor": factor }, "motion": { "bottom": { "sideways": "sliding" } } })
        });
        planned(&grown).expected.crowding
    };
    // Free to grow: edges go as 1 + 0.2 s, and the area's mean over four instants s is 1 + 0.4/2 + 0.04 · 21/64.
    let ratio = crowding(1.0 + 1e-9) / crowding(1.2);
    assert!((ratio / (1.2 + 0.04 * 21.0 / 64.0) - 1.0).abs() < 1e-6, "{ratio}");
}

#[test]
fn fields_whose_levels_do_not_fit_are_given_up_while_they_are_solved() {
    let roster = systems::standard();
    for transport in ["diffusing", "transient"] {
        let scene = changed(|scene| scene["cues"]["read"]["transport"] = json!(transport));
        let within = |room: f64| {
            let mut scene = loaded(&scene, &roster);
            scene.room = Some(room);
            Simulation::assemble(&scene, &roster).map(|simulation| simulation.world().resource::<Plan>().clone())
        };
        let plan = within(1e9).unwrap();
        let held = |name: &str| plan.holdings.iter().find(|held| held.name == name).map(|held| held.bytes);
        let (matrix, cue) = (held("matrix").unwrap(), held("cue `read`").unwrap());
        assert!(within(matrix + cue).is_ok(), "{transport}");
        // What stands at a moment is held beside the levels, and is less than half as much as two of these.
        let refused = within(matrix + 0.7 * cue).map(|_| ()).unwrap_err().to_string();
        let words = "cue `read` (eq. 2, /cues/read): levels of its field, ";
        assert!(
            refused.starts_with(words) && refused.contains(" so far, take more than what is left, 0.000 GB"),
            "{refused}"
        );
    }
}

#[test]
fn the_plan_as_json_has_its_estimates_and_a_summary_has_not() {
    let found = serde_json::to_value(planned(&scene())).unwrap();
    for estimate in ["memory_mb", "cpu_seconds"] {
        let parts = found[estimate]["parts"].as_array().unwrap();
        assert!(found[estimate]["total"].as_f64().unwrap() > 0.0 && parts.len() > 5);
        assert!(parts.iter().all(|part| part["name"].is_string() && part["amount"].as_f64().unwrap() > 0.0));
    }
    assert!(found["expected"]["cone_steps"].as_f64().unwrap() > 0.0);
    assert_eq!(found["plan"]["derived"][0]["unit"], json!("um"));
    assert!(found["plan"]["margins"].as_array().unwrap().iter().all(|margin| margin["value"].is_number()));
    assert!(found["plan"].get("holdings").is_none() && found["plan"].get("tasks").is_none());
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
    let still = |time: Option<Value>| {
        planned(&changed(|scene| {
            scene["matrix"] = Value::Null;
            time.into_iter().for_each(|time| scene["time"] = time);
        }))
    };
    let usual = still(None);
    assert!(usual.plan.margins.iter().all(|margin| !margin.is_passed()) && !usual.to_string().contains("PASSED"));
    let stretched = planned(&scene());
    assert!(margin(&stretched, "Delaunay").unwrap() > 1.0, "an edge at the rim of a source is not flipped");
    assert!(
        stretched.notes.iter().any(|note| note.contains("rims of sources")) && stretched.to_string().contains("PASSED")
    );
    let coarse = still(Some(json!({ "duration": 2, "step": 1.5, "method": "euler" })));
    let passed = |what: &str| coarse.plan.margins.iter().any(|m| m.name.contains(what) && m.is_passed());
    // 1.5 h of 0.1 h; 30 um of 200 um; 0.93 /h * 1.5 h * (1 + 2 + 8) of 2.
    assert!(passed("fasciculation") && passed("step length") && passed("strongest pull"));
    let worst = coarse.plan.margins.iter().find(|margin| margin.name.contains("strongest pull")).unwrap();
    assert!((worst.value - 0.93 * 1.5 * 11.0).abs() < 1e-12, "{worst}");
    assert_eq!(coarse.notes.iter().filter(|note| note.contains("or less is advised (")).count(), 3);
    let exact = still(Some(json!({ "duration": 2, "step": 1.5 })));
    assert!(!exact.plan.margins.iter().any(|margin| margin.name.contains("strongest pull")));
    let pair = json!({ "duration": 2, "step": 1.5, "method": "bogacki_shampine", "tolerance": "1 nm" });
    let pair = still(Some(pair));
    let margin = pair.plan.margins.iter().find(|margin| margin.name.contains("strongest pull")).unwrap();
    assert!(margin.limit == 2.512 && margin.is_passed());
    let part = pair.plan.parts.iter().find(|part| part.name == "adaptive steps").unwrap();
    assert!(part.kept && part.why.contains("within 0.001 um"), "{}", part.why);
}

#[test]
fn a_short_interval_gives_no_more_rows_than_there_are_steps() {
    let rows = |interval: Value| {
        let plan = unguided(|scene| scene["output"] = json!({ "trajectory_interval": interval }));
        part(&plan.memory_mb, "trajectories")
    };
    let each_step = rows(json!("4 min"));
    assert!(each_step > 0.0);
    for short in ["1 s", "1e-9 s"] {
        assert_eq!(rows(json!(short)), each_step, "{short}");
    }
    assert!(rows(json!(1)) < each_step);
}
