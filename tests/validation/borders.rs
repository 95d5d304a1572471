//! The border and the target are met inside the step, at the crossing point.

use crate::common::{ConeState, cones, ended};
use serde_json::{Value, json};
use tropism::prelude::Status;
use tropism::systems;

const SPEED: f64 = 20.0;

fn scene(outline: Value, rule: &str, from: [f64; 2], heading: f64, duration: f64) -> Value {
    json!({
        "tissue": { "outline": outline, "mesh_size": 13 },
        "time": { "duration": duration, "step": 0.7 },
        "growth": { "on_border": rule },
        "populations": { "axons": {
            "count": 1, "speed": SPEED, "births": { "at": 0 }, "origin": { "points": [from] }, "heading": heading
        } }
    })
}

fn square() -> Value {
    json!({ "rectangle": { "width": 100, "height": 100 } })
}

fn tip(scene: &Value) -> ConeState {
    tip_and_time(scene).0
}

/// The cone and the time reached, which is the duration to the nearest tick.
fn tip_and_time(scene: &Value) -> (ConeState, f64) {
    let end = ended(scene, &systems::standard());
    (cones(end.world())[0], end.time())
}

fn assert_at(cone: &ConeState, place: [f64; 2]) {
    let off = (cone.position.x - place[0]).hypot(cone.position.y - place[1]);
    assert!(off < 1e-9, "at {:?}, wanted {place:?}", cone.position);
}

#[test]
fn a_cone_stalls_or_leaves_at_the_place_and_time_at_which_it_meets_the_wall() {
    for (rule, status) in [("stall", Status::Stalled), ("leave", Status::Left)] {
        for heading in [0.0, 30.0, -17.0, 44.0] {
            let slope = f64::to_radians(heading).tan();
            let way = 50.0 * slope.hypot(1.0);
            let cone = tip(&scene(square(), rule, [50.0, 50.0], heading, 10.0));
            assert_eq!(cone.status, status);
            assert_at(&cone, [100.0, 50.0 + 50.0 * slope]);
            assert!((cone.journey.ended - way / SPEED).abs() < 1e-9, "{rule} at {heading}: {}", cone.journey.ended);
            assert!((cone.journey.length - way).abs() < 1e-8);
        }
    }
}

#[test]
fn a_cone_aimed_at_a_corner_ends_in_the_corner() {
    for (rule, status) in [("stall", Status::Stalled), ("leave", Status::Left), ("slide", Status::Growing)] {
        let cone = tip(&scene(square(), rule, [50.0, 50.0], 45.0, 10.0));
        assert_eq!(cone.status, status);
        assert_at(&cone, [100.0, 100.0]);
        if rule != "slide" {
            assert!((cone.journey.ended - 50.0 * 2f64.sqrt() / SPEED).abs() < 1e-9);
        }
    }
}

#[test]
fn a_sliding_cone_keeps_the_part_of_its_speed_that_lies_along_the_wall() {
    let (sine, cosine) = f64::to_radians(30.0).sin_cos();
    for duration in [1.0, 3.3, 4.1, 12.0] {
        let (cone, time) = tip_and_time(&scene(square(), "slide", [50.0, 50.0], 30.0, duration));
        let way = SPEED * time;
        assert_eq!(cone.status, Status::Growing);
        assert_at(&cone, [(50.0 + way * cosine).min(100.0), (50.0 + way * sine).min(100.0)]);
    }
}

#[test]
fn a_sliding_cone_goes_round_a_re_entrant_corner() {
    let outer = json!({ "points": [[0, 0], [100, 0], [100, 50], [50, 50], [50, 100], [0, 100]] });
    let outline = json!({ "polygon": { "outer": outer } });
    let rate = SPEED / 2f64.sqrt();
    for duration in [1.0, 1.6, 2.0, 2.3, 3.5] {
        let (cone, time) = tip_and_time(&scene(outline.clone(), "slide", [80.0, 30.0], 135.0, duration));
        let free = 50.0 + rate * (time - 30.0 / rate);
        let height = (30.0 + rate * time).min(50.0).max(free);
        assert_at(&cone, [80.0 - rate * time, height]);
    }
}

#[test]
fn a_cone_arrives_where_and_when_it_enters_its_target() {
    for heading in [0.0, 11.0, -20.0] {
        let mut scene = scene(square(), "slide", [20.0, 50.0], heading, 10.0);
        scene["targets"] = json!({ "bulb": { "polygon": { "points": [[70, 10], [90, 10], [90, 90], [70, 90]] } } });
        let slope = f64::to_radians(heading).tan();
        let way = 50.0 * slope.hypot(1.0);
        let cone = tip(&scene);
        assert_eq!(cone.status, Status::Arrived);
        assert_at(&cone, [70.0, 50.0 + 50.0 * slope]);
        assert!((cone.journey.ended - way / SPEED).abs() < 1e-9);
    }
}

#[test]
fn a_cone_that_enters_its_target_through_a_corner_has_arrived_there() {
    let mut scene = scene(square(), "slide", [20.0, 20.0], 45.0, 10.0);
    scene["targets"] = json!({ "bulb": { "polygon": { "points": [[70, 70], [90, 70], [90, 90], [70, 90]] } } });
    let cone = tip(&scene);
    assert_eq!(cone.status, Status::Arrived);
    assert_at(&cone, [70.0, 70.0]);
    assert!((cone.journey.ended - 50.0 * 2f64.sqrt() / SPEED).abs() < 1e-9);
}
