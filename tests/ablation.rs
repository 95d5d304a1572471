//! Off is absence: a mechanism left out leaves the bits of a scene that never had it, all other draws, and no cost.

mod common;

use common::{cones, ended, hash_of_states, loaded, observed, to_end, try_load};
use serde_json::{Value, json};
use tropism::model::health::Counters;
use tropism::prelude::{GrowthCone, Site, With};
use tropism::scenario::load::Loaded;
use tropism::simulation::Simulation;
use tropism::systems;

fn complete_scene() -> Value {
    json!({
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 25 },
        "time": { "duration": 4, "step": "4 min" },
        "populations": { "axons": { "count": 16, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "matrix": { "motion": { "top": { "outward": 0.2 }, "bottom": { "outward": 0.2 } } },
        "cues": {
            "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] },
            "repellent": { "diffusion": "2.5 um^2/s", "sources": [{ "disc": { "centre": [40, 40], "radius": 15 } }] }
        },
        "chemotaxis": { "receptors": { "attractant": {}, "repellent": { "effect": "repel" } } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    })
}

/// The complete scene with every other mechanism of the roster in it.
fn every_mechanism() -> Value {
    let mut scene = complete_scene();
    let band = [[0, 30], [300, 30], [300, 90], [0, 90]];
    scene["growth_rate_modulation"] = json!({ "cue": "attractant" });
    scene["steric_repulsion"] = json!({ "distance": "8 um" });
    scene["leader_follower"] = json!({ "regions": { "midline": { "polygon": { "points": band } } } });
    scene["durotaxis"] = json!({ "profile": [[0, 200], [300, 800]] });
    scene["bending_stiffness"] = json!({});
    scene["retraction"] = json!({ "prune_after": 3 });
    scene["branching"] = json!({ "rate": 0.3 });
    let goal = [[150, 40], [300, 40], [300, 80], [150, 80]];
    scene["targets"] = json!({ "goal": { "polygon": { "points": goal } } });
    for (name, x, heading) in [("leftward", 234, 110), ("rightward", 226, 70)] {
        scene["populations"][name] =
            json!({ "count": 1, "origin": { "points": [[x, 5]] }, "heading": heading, "births": { "at": 0 } });
    }
    scene["zippering"] = json!({ "arm": "2 um" });
    scene["cone_release"] = json!({ "cues": { "attractant": { "effect": "attract" } } });
    scene
}

fn without_block(name: &str) -> Value {
    let mut scene = complete_scene();
    assert!(scene.as_object_mut().unwrap().remove(name).is_some(), "the complete scene has no `{name}`");
    scene
}

fn simulated(loaded: &Loaded) -> Simulation {
    let mut simulation = Simulation::assemble(loaded, &systems::standard()).unwrap_or_else(|error| panic!("{error}"));
    to_end(&mut simulation);
    simulation
}

/// Mechanisms that others need: without its cues, what reads them goes too.
fn with_dependants(name: &'static str) -> Vec<&'static str> {
    if name == "cues" { vec!["cues", "chemotaxis", "growth_rate_modulation"] } else { vec![name] }
}

fn counters(scene: &Value) -> Counters {
    ended(scene, &systems::standard()).counters()
}

#[test]
fn leaving_a_mechanism_out_gives_the_bits_of_a_scene_without_its_block() {
    let roster = systems::standard();
    let complete = hash_of_states(simulated(&loaded(&every_mechanism(), &roster)).world());
    for name in roster.names() {
        let left_out = with_dependants(name);
        let mut scene = every_mechanism();
        left_out.iter().for_each(|name| drop(scene.as_object_mut().unwrap().remove(*name)));
        let never_there = loaded(&scene, &roster);
        let taken_out = try_load(&every_mechanism(), &roster, &left_out, &[]).unwrap();
        let [(path, state), (other_path, other_state)] = [&never_there, &taken_out].map(|loaded| {
            let (trajectories, simulation) = observed(loaded, &roster);
            (trajectories, hash_of_states(simulation.world()))
        });
        assert_eq!(path, other_path, "{name}");
        assert_eq!(state, other_state, "{name}");
        assert_ne!(state, complete, "the scene is too mild to show what `{name}` does");
    }
}

#[test]
fn a_merge_patch_with_null_is_the_same_ablation() {
    let roster = systems::standard();
    for name in ["matrix", "borders", "chemotaxis"] {
        let mut nulled = complete_scene();
        nulled[name] = Value::Null;
        let states = [&nulled, &without_block(name)].map(|scene| hash_of_states(ended(scene, &roster).world()));
        assert_eq!(states[0], states[1], "{name}");
    }
}

#[test]
fn births_are_the_same_draws_whatever_is_left_out() {
    let roster = systems::standard();
    let births = |left_out: &[&str]| {
        let loaded = try_load(&every_mechanism(), &roster, left_out, &[]).unwrap();
        let simulation = Simulation::assemble(&loaded, &roster).unwrap();
        let world = simulation.world();
        let mut origins = world.try_query_filtered::<&Site, With<GrowthCone>>().unwrap();
        let tissue = world.resource::<tropism::prelude::Tissue>();
        // The mesh is fitted to the sources that are left, so a place is compared in space and not by its cell.
        let places: Vec<_> = origins.iter(world).map(|origin| tissue.reference_position(*origin)).collect();
        // Cones that wait for branches have no birth, and stand after all others.
        let times: Vec<_> = cones(world).iter().map(|cone| cone.identity.birth).filter(|&b| b != u64::MAX).collect();
        (times.clone(), places[..times.len()].to_vec())
    };
    let (times, places) = births(&[]);
    assert!(times.windows(2).any(|pair| pair[0] != pair[1]));
    for name in roster.names() {
        let (other_times, other_places) = births(&with_dependants(name));
        assert_eq!(times, other_times, "{name}");
        let apart = places.iter().zip(&other_places).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-10, "{name}: birth places move by {apart} um");
    }
}

/// Without pulls the path is straight but for the noise, so the noise can be read off the headings.
#[test]
fn the_draws_of_heading_noise_do_not_change_with_what_else_is_in_the_scene() {
    let roster = systems::standard();
    let headings = |left_out: &[&str]| {
        let loaded = try_load(&complete_scene(), &roster, left_out, &["/growth/turning_rate=0"]).unwrap();
        cones(simulated(&loaded).world()).iter().map(|cone| cone.spring.heading).collect::<Vec<_>>()
    };
    let all = headings(&[]);
    for left_out in
        [vec!["borders"], vec!["chemotaxis"], vec!["fasciculation"], vec!["chemotaxis", "borders", "fasciculation"]]
    {
        assert_eq!(headings(&left_out), all, "{left_out:?}");
    }
}

#[test]
fn a_scene_without_a_matrix_solves_no_equilibrium() {
    assert!(counters(&complete_scene()).matrix_solves > 0);
    let counters = counters(&without_block("matrix"));
    assert_eq!((counters.matrix_solves, counters.newton_iterations), (0, 0));
}

#[test]
fn cues_that_nobody_reads_are_not_solved() {
    assert!(counters(&complete_scene()).cue_solves > 0);
    let counters = counters(&without_block("chemotaxis"));
    assert_eq!((counters.cue_solves, counters.cue_factorisations), (0, 0));
}

#[test]
fn a_tissue_at_rest_costs_one_solve_and_one_factorisation_a_cue_that_is_read() {
    let at_rest = without_block("matrix");
    let both = counters(&at_rest);
    assert_eq!((both.cue_solves, both.cue_factorisations), (2, 2));
    let mut one_read = at_rest;
    one_read["chemotaxis"]["receptors"].as_object_mut().unwrap().remove("repellent");
    let one = counters(&one_read);
    assert_eq!((one.cue_solves, one.cue_factorisations), (1, 1));
}

#[test]
fn a_single_axon_asks_for_no_neighbours() {
    assert!(counters(&complete_scene()).neighbour_queries > 0);
    let mut alone = complete_scene();
    alone["populations"]["axons"]["count"] = json!(1);
    assert_eq!(counters(&alone).neighbour_queries, 0);
    assert_eq!(counters(&without_block("fasciculation")).neighbour_queries, 0);
    assert_eq!(counters(&without_block("fasciculation")).indexed_segments, 0);
}
