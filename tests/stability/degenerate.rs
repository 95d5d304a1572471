//! Degenerate scenes end, or are refused with their place; no number is lost.

use std::sync::LazyLock;

use tropism::study::report::Asked;
use tropism::study::run::{Records, read_document, simulate, write_results};
use tropism::study::stability::degenerate::{DegenerateMap, End, Outcome, compute};
use tropism::study::stability::degenerate_scenes::scenes;

use crate::common::Folder;
use crate::roster;

static MAP: LazyLock<DegenerateMap> = LazyLock::new(|| compute(&roster()));

fn of(name: &str) -> &'static Outcome {
    MAP.scene(name).unwrap_or_else(|| panic!("no scene {name}"))
}

fn ended(name: &str, [x, y]: [f64; 2]) {
    let [found_x, found_y] = of(name).last().unwrap();
    assert!((found_x - x).hypot(found_y - y) < 1e-9, "{name}: ({found_x}, {found_y}) for ({x}, {y})");
}

#[test]
fn every_scene_ends_as_it_should_and_no_number_is_missing() {
    for outcome in &MAP.scenes {
        let wanted = match outcome.name {
            "compression" => End::Unsolved,
            "no_decay" | "no_diffusion" | "source_outside" | "incompressible" | "inside_out" | "backward"
            | "born_outside" | "no_time" => End::Refused,
            _ => End::Complete,
        };
        assert_eq!(outcome.end, wanted, "{outcome:?}");
        assert_eq!(outcome.holes, 0, "{}", outcome.name);
        assert!(outcome.end == End::Complete || outcome.account.is_some(), "{outcome:?}");
    }
}

#[test]
fn refusals_name_the_place_and_the_amount() {
    for (name, place, amount) in [
        ("no_decay", "/cues/attractant/degradation", "0 /h"),
        ("no_diffusion", "/cues/attractant/diffusion", "0 um^2/h"),
        ("source_outside", "/cues/attractant/sources/0", "outside the tissue"),
        ("incompressible", "/matrix/poisson_ratio", "0.5"),
        ("inside_out", "/matrix/motion/top/outward", "-0.5"),
        ("backward", "/populations/cone/speed", "-20 um/h"),
        ("born_outside", "/populations/cone/origin/points/0", "[300, 75]"),
        ("no_time", "/time/step", "0 h"),
    ] {
        let account = of(name).account.as_deref().unwrap();
        assert!(account.contains(place) && account.contains(amount), "{account}");
    }
    let account = of("compression").account.as_deref().unwrap();
    for word in ["load 0.", "cell ", "det F = 0.", "stretches [", "neo_hookean"] {
        assert!(account.contains(word), "{account}");
    }
}

#[test]
fn remedies_are_named_in_the_notes() {
    for (name, words) in [
        ("coarse_consistent", "zero is sensed there"),
        ("coarse_lumped", "long for a decay length"),
        ("stretch", "edges are flipped"),
        ("buckling", "not stable"),
        ("endless_step_slide", "a shorter step"),
        ("unstable_euler", "or `rotation`"),
    ] {
        assert!(of(name).notes.iter().any(|note| note.contains(words)), "{name}: {:?}", of(name).notes);
    }
    assert!(of("coarse_lumped").notes.iter().all(|note| !note.contains("zero is sensed")));
    assert!(of("compression_remedy").notes.is_empty());
}

#[test]
fn without_a_gradient_a_cone_goes_straight() {
    for name in ["zero_gradient", "zero_gradient_direction", "zero_gradient_noise"] {
        for &[time, x, y] in of(name).paths[0].iter().filter(|[time, ..]| *time < 5.0) {
            let way = 20.0 * time;
            let (wanted_x, wanted_y) = (100.0 + way * 0.75f64.sqrt(), 75.0 + 0.5 * way);
            assert!((x - wanted_x).hypot(y - wanted_y) < 1e-6, "{name} at {time} h: ({x}, {y})");
        }
    }
}

#[test]
fn a_cone_that_looks_straight_away_stays_so_and_noise_turns_it_back_to_the_maximum() {
    ended("facing_away", [0.0, 75.0]);
    let farthest =
        |name: &str| of(name).distances_from([100.0, 75.0]).iter().map(|[_, distance]| *distance).fold(0.0, f64::max);
    assert!(farthest("source_maximum_noise") < farthest("source_maximum_direction"));
    assert!(farthest("source_maximum_noise") < 60.0, "{}", farthest("source_maximum_noise"));
}

#[test]
fn cones_on_vertices_and_edges_of_the_mesh_go_their_way() {
    ended("on_vertex", [160.0, 75.0]);
    ended("on_edge", [180.0, 75.0]);
    let way = 60.0 * 0.5f64.sqrt();
    ended("across_vertex", [90.0 + way, 65.0 + way]);
}

#[test]
fn in_a_corner_a_cone_slides_no_farther_stalls_or_leaves() {
    for name in ["corner_slide", "corner_stall", "corner_leave"] {
        ended(name, [200.0, 150.0]);
    }
    let counts = |name: &str| of(name).counts.unwrap();
    assert_eq!((counts("corner_slide").growing, counts("corner_stall").stalled), (1, 1));
    assert_eq!((counts("corner_leave").left, counts("outward_leave").left), (1, 1));
    for name in ["outward_slide", "outward_stall", "outward_leave"] {
        ended(name, [100.0, 0.0]);
    }
}

#[test]
fn a_step_longer_than_the_tissue_ends_at_the_crossing_or_in_a_corner() {
    ended("endless_step_slide", [200.0, 150.0]);
    let crossing = [200.0, 75.0 + 100.0 / 3f64.sqrt()];
    ended("endless_step_stall", crossing);
    ended("endless_step_leave", crossing);
}

#[test]
fn coincident_shafts_stay_together_and_a_cone_without_speed_stays() {
    for name in ["coincident_together", "coincident_later"] {
        assert!(of(name).gap().len() >= 80);
        assert!(of(name).gap().iter().all(|[_, gap]| *gap < 1e-9), "{name}");
        ended(name, [160.0, 75.0]);
    }
    ended("speed_zero", [100.0, 75.0]);
}

#[test]
fn an_unstable_integrator_is_told_by_its_drift_and_keeps_finite() {
    let outcome = of("unstable_euler");
    assert!(outcome.speed_drift.unwrap() > 1.0, "{outcome:?}");
    let others = MAP.scenes.iter().filter(|other| other.name != "unstable_euler");
    assert!(others.filter_map(|other| other.speed_drift).all(|drift| drift == 0.0));
}

/// Places at which `value` is null and `benign` is not.
fn lost_numbers(value: &serde_json::Value, benign: &serde_json::Value, at: &str, found: &mut Vec<String>) {
    use serde_json::Value;
    match value {
        Value::Null if !benign.is_null() => found.push(at.to_owned()),
        Value::Object(keys) => {
            keys.iter().for_each(|(key, v)| lost_numbers(v, &benign[key.as_str()], &format!("{at}/{key}"), found));
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, v)| lost_numbers(v, &benign[i], &format!("{at}/{i}"), found));
        }
        _ => {}
    }
}

#[test]
fn no_file_of_a_degenerate_scene_holds_what_is_no_number() {
    let roster = roster();
    let folder = Folder::new();
    // A straight path of one axon: where its summary has a number the others have one too, but for what cannot be measured.
    let mut benign = None;
    let mut cases = scenes();
    cases.retain(|case| of(case.name).end == End::Complete && case.name != "no_axons");
    cases.sort_by_key(|case| case.name != "on_edge");
    for case in cases {
        let name = case.name;
        let loaded = read_document(name, case.scene, &roster).unwrap();
        let mut finished = simulate(&loaded, &roster, name.as_ref(), Records::ALL, |_| {}).unwrap();
        let summary = serde_json::to_value(&finished.summary).unwrap();
        let mut lost = Vec::new();
        lost_numbers(&summary, benign.get_or_insert_with(|| summary.clone()), "", &mut lost);
        assert!(lost.iter().all(|place| place.starts_with("/morphology/")), "{name}: {lost:?}");
        let mut files = vec![summary.to_string(), finished.recorder.trajectories.as_str().to_owned()];
        if ["speed_zero", "unstable_euler", "endless_step_slide", "flat"].contains(&name) {
            let folder = folder.0.join(name);
            write_results(&folder, Asked { loaded: &loaded, command: "" }, &mut finished).unwrap();
            let read = |file| std::fs::read_to_string(folder.join(file)).unwrap();
            files.extend(["summary.json", "trajectories.csv", "figure.svg", "manifest.json"].map(read));
        }
        for word in ["NaN", "inf,", "inf\"", "-inf", "Infinity"] {
            assert!(files.iter().all(|text| !text.contains(word)), "{name}: a file holds {word}");
        }
    }
}
