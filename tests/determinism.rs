//! The same seed gives the same bits: again, on other numbers of threads, alone or among seeds.

mod common;

use common::{ConeState, Fnv, cones, ended, hash_of_states, loaded, observed, recorded};
use serde_json::{Value, json};
use tropism::model::shafts::Shafts;
use tropism::numerics::locate::MaterialPoint;
use tropism::prelude::*;
use tropism::scenario::load::Loaded;
use tropism::study::seeds::over_seeds;
use tropism::systems;

/// Everything at once, with more cones than one task handles.
fn scene(count: u64, duration: f64, fasciculation: bool) -> Value {
    let mut scene = json!({
        "seed": 11,
        "tissue": { "outline": { "rectangle": { "width": 400, "height": 300 } }, "mesh_size": 40 },
        "time": { "duration": duration, "step": "3 min" },
        "populations": { "axons": { "count": count, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "targets": { "bulb": { "disc": { "centre": [200, 240], "radius": 40 } } },
        "matrix": {},
        "cues": {
            "attractant": { "sources": [{ "disc": { "centre": [200, 240], "radius": 40 } }] },
            "repellent": { "diffusion": "2.5 um^2/s", "sources": [{ "disc": { "centre": [50, 50], "radius": 20 } }] }
        },
        "chemotaxis": { "receptors": { "attractant": {}, "repellent": { "effect": "repel" } } },
        "borders": {}, "heading_noise": {}
    });
    if fasciculation {
        scene["fasciculation"] = json!({});
    }
    scene
}

/// Hash of the trajectories as written, and of every number of every cone's state at the end.
fn bits(loaded: &Loaded) -> (u64, u64) {
    let roster = systems::standard();
    let (trajectories, simulation) = observed(loaded, &roster);
    let mut table = Fnv::default();
    table.bytes(trajectories.as_bytes());
    (table.0, hash_of_states(simulation.world()))
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn the_number_of_threads_and_repetition_change_no_bit() {
    let loaded = loaded(&scene(200, 4.0, false), &systems::standard());
    let one = on_threads(1, || bits(&loaded));
    for threads in [1, 2, 3] {
        assert_eq!(on_threads(threads, || bits(&loaded)), one, "{threads} threads");
    }
}

#[test]
fn steps_that_a_tolerance_chooses_do_not_depend_on_threads() {
    let mut scene = scene(130, 2.0, true);
    scene["time"]["method"] = json!("bogacki_shampine");
    scene["time"]["step"] = json!("12 min");
    scene["time"]["tolerance"] = json!(0.05);
    assert!(ended(&scene, &systems::standard()).counters().rejected_steps > 0);
    let loaded = loaded(&scene, &systems::standard());
    let one = on_threads(1, || bits(&loaded));
    for threads in [1, 2, 3] {
        assert_eq!(on_threads(threads, || bits(&loaded)), one, "{threads} threads");
    }
}

#[test]
fn contact_between_axons_does_not_depend_on_threads_either() {
    let loaded = loaded(&scene(130, 2.0, true), &systems::standard());
    let one = on_threads(1, || bits(&loaded));
    for threads in [2, 3] {
        assert_eq!(on_threads(threads, || bits(&loaded)), one, "{threads} threads");
    }
}

#[test]
fn grid_and_tree_find_what_looking_at_every_segment_of_a_deforming_tissue_finds() {
    let roster = systems::standard();
    let [grid, tree, all] = ["grid", "tree", "all"].map(|neighbours| {
        let mut scene = scene(60, 8.0, true);
        scene["fasciculation"] = json!({ "neighbours": neighbours });
        bits(&loaded(&scene, &roster))
    });
    assert_eq!(tree, all);
    assert_eq!(grid, all);
}

#[test]
fn a_reach_far_below_a_segment_is_looked_for_in_squares_of_a_segment_and_finds_what_all_find() {
    let roster = systems::standard();
    for reach in ["1e-29 um", "1e-2 um"] {
        let [grid, all] = ["grid", "all"].map(|neighbours| {
            let mut scene = scene(20, 3.0, true);
            scene["fasciculation"] = json!({ "reach": reach, "neighbours": neighbours });
            bits(&loaded(&scene, &roster))
        });
        assert_eq!(grid, all, "{reach}");
    }
}

/// Branches, retraction and zippering strike out what the index holds, in a deforming tissue.
#[test]
fn grid_and_tree_find_what_is_left_when_shafts_are_remodelled_on_any_number_of_threads() {
    let roster = systems::standard();
    let run = |border: &str, neighbours: &str, threads: usize| {
        let mut scene = scene(60, 20.0, true);
        scene["fasciculation"] = json!({ "neighbours": neighbours });
        scene["growth"] = json!({ "on_border": border });
        scene["branching"] = json!({ "rate": 0.1, "most": 3, "kind": "collateral" });
        scene["retraction"] =
            json!({ "prune_after": 9, "collapse": { "cue": "repellent", "above": 5, "distance": 15 } });
        scene["zippering"] = json!({ "arm": 5 });
        on_threads(threads, || bits(&loaded(&scene, &roster)))
    };
    for border in ["slide", "stall"] {
        let all = run(border, "all", 1);
        for neighbours in ["grid", "tree"] {
            assert_eq!(run(border, neighbours, 2), all, "{border} {neighbours}");
        }
    }
}

/// Axons without a random draw, each a population, in memory in the order of these names.
fn axons_named(names: &[String], contact: bool) -> Value {
    let mut scene = scene(0, 4.0, contact);
    let axon = |(i, name): (usize, &String)| {
        let i = i as f64;
        let keys = json!({
            "count": 1, "speed": 18.0 + 0.2 * i, "heading": 80.0 + i, "births": { "at": 0.0 },
            "origin": { "points": [[180.0 + 0.9 * i, 40.0 + 0.4 * i]] }
        });
        (name.clone(), keys)
    };
    scene["populations"] = names.iter().enumerate().map(axon).collect::<serde_json::Map<_, _>>().into();
    scene["heading_noise"] = Value::Null;
    scene
}

/// Where an axon is at the end, and its shaft.
type End = (ConeState, Vec<MaterialPoint<2>>);

/// The ends of those axons in the order of `names`.
fn ends_of(names: &[String], contact: bool) -> Vec<End> {
    let simulation = ended(&axons_named(names, contact), &systems::standard());
    let (cones, shafts) = (cones(simulation.world()), simulation.world().resource::<Shafts>());
    let mut sorted = names.to_vec();
    sorted.sort_unstable();
    let end = |name: &String| {
        let row = sorted.iter().position(|other| other == name).unwrap();
        let mut cone = cones[row];
        assert_eq!(cone.identity.axon as usize, row, "axons lie in memory in the order of their numbers");
        (cone.identity.axon, cone.identity.population) = (0, 0);
        (cone, shafts.polyline(row))
    };
    names.iter().map(end).collect()
}

#[test]
fn axons_that_lie_otherwise_in_memory_end_with_the_same_bits_each() {
    let in_order: Vec<String> = ('a'..='w').map(String::from).collect();
    let orders = [1, 5, 22].map(|stride| (0..23).map(|i| in_order[i * stride % 23].clone()).collect::<Vec<_>>());
    let alone = ends_of(&in_order, false);
    assert!(alone.iter().all(|(cone, shaft)| cone.journey.length > 60.0 && shaft.len() > 4));
    for contact in [false, true] {
        let ends = ends_of(&in_order, contact);
        let apart = |(one, other): (&End, &End)| (one.0.position - other.0.position).norm();
        assert_eq!(
            ends.iter().zip(&alone).filter(|pair| apart(*pair) > 1.0).count() > 15,
            contact,
            "is there contact?"
        );
        for names in &orders {
            assert!(ends_of(names, contact) == ends, "{names:?}");
        }
    }
}

/// The order of keys in a file is no order of anything.
#[test]
fn populations_and_cues_in_another_order_in_the_file_give_the_same_bits() {
    let roster = systems::standard();
    let reversed = |value: &Value| -> Value {
        value.as_object().unwrap().iter().rev().map(|(key, value)| (key.clone(), value.clone())).collect()
    };
    let mut scene = scene(30, 3.0, true);
    scene["populations"]["others"] = json!({ "count": 20, "births": { "at": 0.5 } });
    let mut turned = reversed(&scene);
    for block in ["populations", "cues"] {
        turned[block] = reversed(&scene[block]);
    }
    assert_ne!(turned.to_string(), scene.to_string());
    assert_eq!(bits(&loaded(&turned, &roster)), bits(&loaded(&scene, &roster)));
}

keys! {
    /// Looks at all of the tissue, and does nothing with it.
    pub struct Overview {}
}

impl Mechanism for Overview {
    const NAME: &'static str = "overview";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.world.resource_mut::<Configuration>().is_looked_at_everywhere();
        model.insert_law(self);
        Ok(())
    }
}

#[test]
fn a_tissue_that_is_reckoned_only_where_cones_are_gives_the_bits_of_one_that_is_brought_as_a_whole() {
    let roster = systems::standard().with::<Overview>();
    for (element, heading, method) in [("linear", "none", "rotation"), ("quadratic", "spin", "rk4")] {
        let mut scene = scene(6, 6.0, false);
        scene["tissue"]["mesh_size"] = json!(15);
        scene["growth"] = json!({ "heading_follows": heading });
        scene["time"]["method"] = json!(method);
        scene["cues"]["repellent"]["element"] = json!(element);
        let mut run = |overview: Value| {
            scene["overview"] = overview;
            let (trajectories, simulation) = observed(&loaded(&scene, &roster), &roster);
            let now = simulation.world().resource::<Configuration>();
            let brought: Vec<[u64; 4]> = now
                .coordinates()
                .iter()
                .zip(&*now.velocities())
                .map(|(x, v)| [x[0], x[1], v[0], v[1]].map(f64::to_bits))
                .collect();
            let state = hash_of_states(simulation.world());
            (now.is_looked_at_here_and_there(), (trajectories, state, brought))
        };
        let ((few, here_and_there), (many, everywhere)) = (run(Value::Null), run(json!({})));
        assert!(few && !many && here_and_there.0.lines().count() > 20);
        assert!(here_and_there == everywhere, "{element} {heading} {method}");
    }
}

#[test]
fn another_seed_gives_other_bits() {
    let roster = systems::standard();
    let mut loaded = loaded(&scene(5, 2.0, false), &roster);
    let first = bits(&loaded);
    loaded.scene.seed += 1;
    let second = bits(&loaded);
    assert!(first.0 != second.0 && first.1 != second.1);
}

/// The summary without what the clock on the wall says.
fn results(summary: &tropism::record::summary::Summary) -> Value {
    let mut value = serde_json::to_value(summary).unwrap();
    let cost = value["cost"].as_object_mut().unwrap();
    for key in ["seconds", "share", "peak_memory_mib"] {
        assert!(cost.remove(key).is_some());
    }
    value
}

#[test]
fn each_place_of_a_run_over_seeds_is_the_single_run_of_its_seed() {
    let roster = systems::standard();
    let loaded = loaded(&scene(20, 3.0, true), &roster);
    let runs = on_threads(2, || over_seeds(&loaded, &roster, "scene.json".as_ref(), 3, |_| {})).unwrap();
    assert_eq!(runs.len(), 3);
    for (place, run) in runs.iter().enumerate() {
        let mut own = loaded.clone();
        own.scene.seed += place as u64;
        let alone = recorded(&own, &roster);
        assert_eq!(results(&run.summary), results(&alone.summary), "place {place}");
        if place == 0 {
            assert_eq!(run.recorder.trajectories.as_str(), alone.recorder.trajectories.as_str());
        }
    }
    assert_ne!(results(&runs[0].summary)["morphology"], results(&runs[1].summary)["morphology"]);
}
