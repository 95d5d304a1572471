//! Charts of error against time: what they measure, mark and write.

mod common;

use common::Folder;
use serde_json::{Value, json};
use std::process::{Command, Output};
use tropism::scenario::load::Request;
use tropism::study::chart::work_precision::{Factor, Point};
use tropism::study::chart::{Chart, chart};
use tropism::study::laboratory::Laboratory;
use tropism::systems;

fn scene() -> Value {
    json!({
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 40 },
        "time": { "duration": 2, "step": "4 min" },
        "populations": { "axons": { "count": 12, "origin": { "edge": "bottom" } } },
        "targets": { "bulb": { "disc": { "centre": [150, 150], "radius": 25 } } },
        "matrix": {},
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "fasciculation": {}, "heading_noise": {}
    })
}

fn charted(scene: &Value, only: &[&str]) -> Chart {
    let folder = Folder::new();
    let request = Request { path: folder.write("scene.json", &scene.to_string()), ..Request::default() };
    let roster = systems::standard();
    let laboratory = Laboratory { repetitions: 2, seeds: 2, ..Laboratory::new(&request, &roster) };
    let only: Vec<String> = only.iter().map(|&name| name.to_owned()).collect();
    chart(&laboratory, &only, &|_| {}).unwrap()
}

fn points<'a>(factor: &'a Factor, method: &str) -> Vec<&'a Point> {
    factor.points.iter().filter(|point| point.method == method).collect()
}

fn order(factor: &Factor, error: &str, method: &str) -> f64 {
    let kind = factor.errors.iter().find(|kind| kind.name == error).unwrap();
    factor.slopes(kind).into_iter().find(|slope| slope.method == method).unwrap().order
}

/// One mark for the scene's own setting, times in order, errors that are numbers.
fn assert_sound(factor: &Factor) {
    assert_eq!(factor.points.iter().filter(|point| point.default).count(), 1, "{}", factor.name);
    for point in &factor.points {
        assert!(point.seconds.low > 0.0 && point.seconds.low <= point.seconds.median, "{}", factor.name);
        assert!(factor.errors.iter().all(|kind| point.errors[&kind.name].is_finite()), "{} {point:?}", factor.name);
    }
    assert!(!factor.advice.is_empty() && !factor.remark.is_empty());
}

#[test]
fn recovery_turns_headings_right_and_quadratic_elements_get_the_concentration_right() {
    let found = charted(&scene(), &["cue_field"]);
    let [factor] = found.factors.as_slice() else { panic!("one factor") };
    assert_sound(factor);
    let finest = |method: &str| points(factor, method).last().unwrap().errors["heading"];
    let (raw, recovered) = (finest("P1, raw gradient"), finest("P1, recovered, lumped"));
    assert!(recovered < 0.2 * raw, "{raw} {recovered}");
    let gain = order(factor, "heading", "P1, recovered, lumped") - order(factor, "heading", "P1, raw gradient");
    assert!(gain > 0.2, "{gain}");
    let error = |method: &str| points(factor, method)[0].errors["concentration"];
    assert!(error("P2") < 0.3 * error("P1, recovered, lumped"));
    let of_method = points(factor, "P1, raw gradient");
    let counts: Vec<f64> = of_method.iter().map(|point| point.counts["vertices"]).collect();
    assert!(counts.len() >= 5 && counts[counts.len() - 1] > 8.0 * counts[0], "{counts:?}");
}

#[test]
fn linear_levels_are_of_order_two_and_cubic_ones_beat_them_with_fewer_equilibria() {
    let found = charted(&scene(), &["matrix"]);
    let names: Vec<&str> = found.factors.iter().map(|factor| factor.name.as_str()).collect();
    assert_eq!(names, ["matrix_mesh", "load_levels"]);
    found.factors.iter().for_each(assert_sound);
    let linear = order(&found.factors[1], "displacement", "linear between levels");
    assert!((1.6..2.4).contains(&linear), "{linear}");
    let at_tightest = |method: &str| {
        let point = *points(&found.factors[1], method).last().unwrap();
        (point.errors["displacement"], point.counts["equilibria"])
    };
    let (cubic, linear) = (at_tightest("cubic between levels"), at_tightest("linear between levels"));
    assert!(cubic.0 < 0.1 * linear.0 && cubic.1 < 0.5 * linear.1, "{cubic:?} {linear:?}");
}

#[test]
fn cones_show_the_orders_of_their_methods_and_neighbour_searches_agree() {
    let mut quiet = scene();
    quiet["matrix"] = Value::Null;
    let found = charted(&quiet, &["cones", "neighbours"]);
    let names: Vec<&str> = found.factors.iter().map(|factor| factor.name.as_str()).collect();
    assert_eq!(names, ["cones", "cones_with_noise", "cones_with_contact", "neighbours"]);
    found.factors.iter().for_each(assert_sound);
    let euler = order(&found.factors[0], "position_median", "euler");
    assert!((0.8..1.2).contains(&euler), "{euler}");
    let rotation = order(&found.factors[0], "position_median", "rotation");
    assert!(rotation > 1.5, "{rotation}");
    assert!(points(&found.factors[0], "bogacki_shampine").len() >= 5);
    assert_eq!(found.factors[3].points.len(), 12);
    assert_eq!(found.factors[3].growth().len(), 3);
}

#[test]
fn mesh_and_step_together_fall_with_order_and_tell_which_of_them_the_error_comes_from() {
    let mut finer = scene();
    finer["tissue"]["mesh_size"] = json!(20);
    let found = charted(&finer, &["together"]);
    let [factor] = found.factors.as_slice() else { panic!("one factor") };
    assert_sound(factor);
    assert_eq!(factor.methods(), ["together", "mesh only", "step only"]);
    let joint = order(factor, "tip", "together");
    assert!((1.2..3.0).contains(&joint), "{joint}");
    let own = factor.points.iter().find(|point| point.default).unwrap();
    assert_eq!((own.method.as_str(), own.knob), ("together", 1.0));
    let at = |method: &str, knob: f64| {
        let point = points(factor, method).into_iter().find(|point| point.knob == knob).unwrap();
        point.errors["tip"]
    };
    for method in ["mesh only", "step only"] {
        assert_eq!(at(method, 1.0), own.errors["tip"], "lines meet in the scene's own setting");
    }
    // Fields on cells of 20 um are worse than steps of 4 min, so that only a finer mesh helps.
    assert!(at("mesh only", 0.5) < 0.6 * own.errors["tip"] && at("step only", 0.5) > 0.9 * own.errors["tip"]);
    assert!(at("together", 0.5) < 1.1 * at("mesh only", 0.5));
    assert!(factor.advice.starts_with("The mesh dominates"), "{}", factor.advice);
    let joint = points(factor, "together")[0];
    assert!(joint.set.iter().any(|key| key == "/matrix/tolerance=1.6e-5"), "{:?}", joint.set);
}

#[test]
fn a_scene_without_cues_motion_or_contact_has_no_chart_of_them() {
    let mut bare = scene();
    for name in ["matrix", "cues", "chemotaxis", "fasciculation"] {
        bare[name] = Value::Null;
    }
    assert!(charted(&bare, &["cue_field", "matrix", "neighbours", "together"]).factors.is_empty());
}

fn tropism(folder: &Folder, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap()
}

#[test]
fn the_command_writes_a_table_a_document_and_a_figure_a_factor() {
    let folder = Folder::new();
    folder.write("scene.json", &scene().to_string());
    let output = tropism(&folder, &["chart", "scene.json", "--only", "neighbours", "--repetitions", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let out = folder.0.join("out/scene-chart");
    let table = std::fs::read_to_string(out.join("chart.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 12, "{table}");
    let document: Value = serde_json::from_str(&std::fs::read_to_string(out.join("chart.json")).unwrap()).unwrap();
    assert_eq!(document["factors"][0]["name"], "neighbours");
    for file in ["chart_neighbours.svg", "chart_neighbours.png"] {
        assert!(out.join(file).metadata().unwrap().len() > 1000, "{file}");
    }
    let unknown = tropism(&folder, &["chart", "scene.json", "--only", "speed"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("cue_field"), "the factors there are must be named");
}
