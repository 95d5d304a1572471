//! A scene that states an accuracy reaches it; keys that are given stay; what was chosen is told.

mod common;

use common::{Folder, try_load};
use serde_json::{Value, json};
use tropism::model::mechanism::Roster;
use tropism::prelude::Vector3;
use tropism::record::manifest::Manifest;
use tropism::scenario::load::{Loaded, Request};
use tropism::study::accuracy::settled;
use tropism::study::laboratory::cones;
use tropism::systems;

/// A small scene with an attractant and what is merged into it.
fn scene(more: Value) -> Value {
    let mut scene = json!({
        "seed": 3,
        "accuracy": 0.02,
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } } },
        "time": { "duration": 6 },
        "populations": { "axons": { "count": 12, "speed": 15 } },
        "cues": { "attractant": {
            "diffusion": "2.5 um^2/s", "sources": [{ "disc": { "centre": [100, 120], "radius": 15 } }]
        } },
        "chemotaxis": { "receptors": { "attractant": {} } }
    });
    for (name, value) in more.as_object().into_iter().flatten() {
        scene[name] = value.clone();
    }
    scene
}

fn found(scene: &Value, roster: &Roster) -> Loaded {
    let folder = Folder::new();
    let path = folder.write("scene.json", &scene.to_string());
    settled(&Request { path, without: Vec::new(), set: Vec::new() }, roster, |_| Ok(())).unwrap().1
}

fn number(loaded: &Loaded, pointer: &str) -> f64 {
    loaded.merged.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// Tips and the lengths of their paths.
fn tips(loaded: &Loaded, roster: &Roster) -> Vec<(Vector3<f64>, f64)> {
    let mut simulation = tropism::simulation::Simulation::assemble(loaded, roster).unwrap();
    common::to_end(&mut simulation);
    cones(&simulation).iter().map(|cone| (cone.position, cone.length)).collect()
}

/// A scene with a mesh size (um) and a step (h) of its own in place of an accuracy.
fn fixed(scene: &Value, mesh: f64, step: f64, roster: &Roster) -> Loaded {
    let keys = [format!("/tissue/mesh_size={mesh:e}"), format!("/time/step={step:e}"), "/accuracy=null".to_owned()];
    try_load(scene, roster, &[], &keys.each_ref().map(String::as_str)).unwrap()
}

/// The error that a scene reaches against a run with a quarter of the mesh size and a sixteenth of the step.
fn reached(scene: &Value) -> f64 {
    let roster = systems::standard();
    let loaded = found(scene, &roster);
    let (mesh, step) = (number(&loaded, "/tissue/mesh_size"), number(&loaded, "/time/step"));
    let chosen = tips(&loaded, &roster);
    let fine = tips(&fixed(scene, mesh / 4.0, step / 16.0, &roster), &roster);
    let squares: Vec<f64> = chosen
        .iter()
        .zip(&fine)
        .filter(|(_, fine)| fine.1 > 0.0)
        .map(|(chosen, fine)| (chosen.0 - fine.0).norm_squared() / fine.1.powi(2))
        .collect();
    assert_eq!(squares.len(), 12, "every axon has a path");
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn the_accuracy_is_reached_in_a_tissue_at_rest() {
    let error = reached(&scene(json!({})));
    assert!(error > 0.0 && error <= 0.02, "{error}");
}

#[test]
fn the_accuracy_is_reached_in_a_stretched_tissue() {
    let stretched =
        |accuracy: f64| scene(json!({ "accuracy": accuracy, "matrix": { "motion": { "top": { "outward": 0.15 } } } }));
    let error = reached(&stretched(0.02));
    assert!(error > 0.0 && error <= 0.02, "{error}");
    let error = reached(&stretched(0.002));
    assert!(error > 0.0 && error <= 0.002, "{error}");
    let loaded = found(&stretched(0.002), &systems::standard());
    let coarser = number(&loaded, "/matrix/mesh_size") / number(&loaded, "/tissue/mesh_size");
    assert!(coarser > 1.0 && coarser <= 8.0, "the matrix is smooth enough for a mesh of its own: {coarser}");
}

#[test]
fn the_accuracy_is_reached_with_borders_and_a_sharper_demand() {
    let error = reached(&scene(json!({ "accuracy": 0.005, "borders": {} })));
    assert!(error > 0.0 && error <= 0.005, "{error}");
}

#[test]
fn keys_that_are_given_are_kept_and_those_found_are_told() {
    let scene = scene(json!({ "time": { "duration": 6, "step": "3 min" }, "fasciculation": {}, "heading_noise": {} }));
    let loaded = found(&scene, &systems::standard());
    assert_eq!(loaded.scene.time.step.0, 0.05);
    assert_eq!(loaded.scene.accuracy, None);
    let mesh = loaded.scene.tissue.mesh_size.0;
    assert!(mesh > 1.0 && mesh <= 50.0, "{mesh}");
    let note = &loaded.remarks[0];
    assert!(note.contains("accuracy 0.02") && note.contains("/tissue/mesh_size="), "{note}");
    let manifest = Manifest::of(&loaded);
    assert_eq!(manifest.scenario.pointer("/tissue/mesh_size").and_then(Value::as_f64), Some(mesh));
}

#[test]
fn a_scene_that_leaves_nothing_to_choose_is_refused_with_the_place() {
    let mut scene = scene(json!({ "time": { "duration": 6, "step": "3 min" } }));
    scene["tissue"]["mesh_size"] = json!(20);
    let folder = Folder::new();
    let path = folder.write("scene.json", &scene.to_string());
    let request = Request { path, without: Vec::new(), set: Vec::new() };
    let refused = settled(&request, &systems::standard(), |_| Ok(())).unwrap_err().to_string();
    assert!(refused.contains("/accuracy") && refused.contains("/tissue/mesh_size"), "{refused}");
}

#[test]
fn a_scene_without_accuracy_is_left_as_it_is() {
    let mut scene = scene(json!({}));
    scene.as_object_mut().unwrap().remove("accuracy");
    let roster = systems::standard();
    let loaded = found(&scene, &roster);
    let plain = try_load(&scene, &roster, &[], &[]).unwrap();
    assert_eq!(loaded.merged, plain.merged);
    assert!(loaded.remarks.is_empty());
}
