//! What changes laid shafts: branches, retraction, zippering, against closed forms.

use crate::common::{ConeState, cones, ended};
use crate::fixed_pull::roster;
use crate::mechanisms::{SPEED, at, measured, scene};
use nalgebra::Vector3;
use serde_json::{Value, json};
use tropism::model::components::Status;
use tropism::model::configuration::Configuration;
use tropism::model::remodel::SpareCones;
use tropism::model::shafts::Shafts;
use tropism::model::tissue::Tissue;
use tropism::systems::zippering::Zippers;

fn born(cones: &[ConeState]) -> Vec<ConeState> {
    cones.iter().copied().filter(|cone| cone.status != Status::Unborn).collect()
}

/// Places of a shaft at the end (µm).
fn path(world: &bevy_ecs::prelude::World, shaft: usize) -> Vec<[f64; 2]> {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let points = world.resource::<Shafts>().polyline(shaft).into_iter();
    points.map(|point| configuration.place(&tissue.mesh, point)).collect()
}

fn angle(cone: &ConeState) -> f64 {
    cone.spring.heading.y.atan2(cone.spring.heading.x).to_degrees()
}

#[test]
fn a_cone_that_splits_leaves_two_at_the_angle_from_where_it_was() {
    let blocks = json!({ "branching": { "rate": 0.5, "angle": 50, "most": 1 } });
    let end = ended(&scene(&[([500.0, 200.0], 90.0, 0.0)], 12.0, 0.05, blocks), &roster());
    let found = born(&cones(end.world()));
    assert_eq!(found.len(), 2);
    let mut angles: Vec<f64> = found.iter().map(angle).collect();
    angles.sort_by(f64::total_cmp);
    assert!((angles[0] - 65.0).abs() < 1e-9 && (angles[1] - 115.0).abs() < 1e-9, "{angles:?}");
    // The fork lies on the first axon, at the branch's first point, as far up as the cone had grown by then.
    let (trunk, branch) = (path(end.world(), 0), path(end.world(), 1));
    let fork = branch[0];
    assert!(trunk.iter().any(|point| (point[0] - fork[0]).hypot(point[1] - fork[1]) < 1e-9), "{fork:?}");
    assert!((fork[1] - 200.0 - SPEED * found[1].birth_time).abs() < 1e-9, "{fork:?}");
    assert_eq!(end.world().resource::<SpareCones>().parent(1), Some(0));
}

#[test]
fn a_collateral_leaves_its_shaft_at_the_angle_and_the_cone_goes_on() {
    let blocks = json!({ "branching": { "rate": 0.2, "angle": 80, "most": 1, "kind": "collateral" } });
    let end = ended(&scene(&[([500.0, 200.0], 90.0, 0.0)], 20.0, 0.05, blocks), &roster());
    let found = born(&cones(end.world()));
    assert!((angle(&found[0]) - 90.0).abs() < 1e-9 && (found[0].position.y - 600.0).abs() < 1e-6);
    assert!(((angle(&found[1]) - 90.0).abs() - 80.0).abs() < 1e-6, "{}", angle(&found[1]));
    let fork = path(end.world(), 1)[0];
    assert!((fork[0] - 500.0).abs() < 1e-9 && fork[1] > 200.0 && fork[1] < found[0].position.y);
}

#[test]
fn cones_branch_as_often_as_their_rate_says() {
    let (count, rate, duration) = (400u32, 0.1, 10.0);
    let blocks = json!({ "branching": { "rate": rate, "most": 16 } });
    let mut scene = scene(&[([500.0, 500.0], 90.0, 0.0)], duration, 0.25, blocks);
    scene["populations"]["axon0"]["count"] = json!(count);
    scene["populations"]["axon0"]["speed"] = json!(1.0);
    let end = ended(&scene, &roster());
    // Branches branch too, a pure birth process: the mean is e^(rT) - 1 and the variance e^(rT)(e^(rT) - 1).
    let mean = (rate * duration).exp() - 1.0;
    let (expected, error) = (f64::from(count) * mean, (f64::from(count) * (mean + 1.0) * mean).sqrt());
    let branches = (born(&cones(end.world())).len() - count as usize) as f64;
    println!("{branches} branches for {expected:.0} +- {error:.0}");
    assert!((branches - expected).abs() < 4.0 * error, "{branches} for {expected} +- {error}");
}

#[test]
fn without_a_rate_every_axon_is_as_if_there_were_no_branching() {
    let blocks = |more: Value| {
        let mut blocks = json!({ "heading_noise": {}, "fasciculation": {} });
        more.as_object().unwrap().iter().for_each(|(name, block)| blocks[name] = block.clone());
        let axons = [([480.0, 20.0], 90.0, 0.0), ([500.0, 10.0], 80.0, 0.0)];
        cones(ended(&scene(&axons, 10.0, 0.1, blocks), &roster()).world())
    };
    let (with, without) = (blocks(json!({ "branching": { "rate": 0 } })), blocks(json!({})));
    assert_eq!(with.len(), 10);
    for (a, b) in with.iter().zip(&without) {
        assert_eq!((a.position, a.spring, a.status), (b.position, b.spring, b.status));
    }
}

#[test]
fn a_lost_axon_goes_back_along_its_path_with_its_speed_until_it_is_gone() {
    let blocks = json!({
        "fixed_pull": { "pull": [0, 0], "spin": 0.1 },
        "retraction": { "prune_after": 10, "speed": 50 }
    });
    let reached = |hours: f64| {
        let end = ended(&scene(&[([500.0, 200.0], 90.0, 0.0)], hours, 0.05, blocks.clone()), &roster());
        let cone = cones(end.world())[0];
        (cone.position, cone.status, path(end.world(), 0).len())
    };
    // Where the cone was at 5 h it is again when it has gone back what it grew from 5 to 10 h: 100 um in 2 h.
    let (there, _, stored) = reached(5.0);
    let (back, status, left) = reached(12.0);
    assert_eq!(status, Status::Retracting);
    assert!((there - back).norm() < 1.1, "{there} {back}");
    assert!(left.abs_diff(stored) <= 1, "{left} {stored}");
    let (gone, status, left) = reached(14.2);
    assert_eq!((status, left), (Status::Withdrawn, 2));
    assert!((gone - Vector3::new(500.0, 200.0, 0.0)).norm() < 1e-9, "{gone}");
}

#[test]
fn a_cone_collapses_where_the_repellent_is_strong_and_sets_out_again() {
    let disc = json!({ "disc": { "centre": [500, 600], "radius": 100 } });
    let blocks = json!({
        "cues": { "slit": { "sources": [disc] } },
        "retraction": { "collapse": { "cue": "slit", "above": 5, "distance": 30 }, "speed": 60 }
    });
    let mut scene = scene(&[([500.0, 200.0], 90.0, 0.0)], 40.0, 0.05, blocks);
    scene["tissue"]["mesh_size"] = json!(30);
    let height = |hours: f64, without: bool| {
        let mut scene = scene.clone();
        scene["time"]["duration"] = json!(hours);
        if without {
            scene["retraction"] = Value::Null;
        }
        cones(ended(&scene, &roster()).world())[0].position.y
    };
    let heights: Vec<f64> = (20..60).map(|hours| height(0.5 * f64::from(hours), false)).collect();
    let highest = heights.iter().copied().fold(0.0, f64::max);
    let lowest = heights[10..].iter().copied().fold(f64::INFINITY, f64::min);
    assert!(highest < height(30.0, true) - 50.0, "{highest}");
    // It swings over the distance: 30 um back at 60 um/h, forward again at 20 um/h.
    assert!((highest - lowest - 30.0).abs() < 12.0, "{lowest} to {highest}");
}

/// Both cones of a fork run apart; the target is on the left. What runs right is pruned: a branch altogether, a trunk up to the fork.
#[test]
fn a_fork_whose_branch_stands_holds_the_trunk_and_a_branch_that_goes_frees_it() {
    let left = json!({ "polygon": { "points": [[100, 10], [300, 10], [300, 990], [100, 990]] } });
    let run = |seed: u64, targets: Value| {
        let blocks = json!({
            "targets": targets,
            "branching": { "rate": 0.4, "angle": 120, "most": 1 },
            "retraction": { "prune_after": 25, "speed": 100 }
        });
        let mut scene = scene(&[([500.0, 200.0], 90.0, 0.0)], 70.0, 0.05, blocks);
        scene["seed"] = json!(seed);
        ended(&scene, &roster())
    };
    let (mut trunks_held, mut branches_gone) = (0, 0);
    for seed in 1..=6 {
        let end = run(seed, json!({ "goal": left }));
        let [trunk, branch] = cones(end.world())[..] else { panic!("two cones") };
        let fork = path(end.world(), 1)[0];
        let to_fork = (trunk.position.x - fork[0]).hypot(trunk.position.y - fork[1]);
        match (trunk.status, branch.status) {
            (Status::Stalled, Status::Arrived) if to_fork < 1e-9 && fork[1] > 200.0 => trunks_held += 1,
            (Status::Arrived, Status::Withdrawn) => branches_gone += 1,
            other => panic!("{other:?}, {to_fork} um from the fork"),
        }
    }
    assert!(trunks_held > 0 && branches_gone > 0, "{trunks_held} {branches_gone}");
    let none = cones(run(1, json!({})).world());
    assert!(none.iter().all(|cone| cone.status == Status::Withdrawn), "{:?}", none[0].status);
}

/// Two straight axons that cross at β₀ zip from y = 0 to where tan(β*/2)/tan(β₀/2) = (y + L)/L, L the length of an arm.
#[test]
fn crossing_axons_zip_until_the_angle_of_balance() {
    let (half, arm, stored) = (12.0f64, 40.0, 12.0);
    let goal = json!({ "polygon": { "points": [[0, 800], [1000, 800], [1000, 900], [0, 900]] } });
    let offset = 300.0 * half.to_radians().tan();
    let axons = [([500.0 - offset, 200.0], 90.0 - half, 0.0), ([500.0 + offset, 200.0], 90.0 + half, 0.0)];
    let zipped = |rest: f64, adhesion: f64| {
        let blocks = json!({ "targets": { "goal": goal }, "zippering": { "arm": arm, "adhesion": adhesion } });
        ended(&scene(&axons, 600.0 / SPEED / half.to_radians().cos() + rest, 0.05, blocks), &roster())
    };
    let end = zipped(10.0, 102.0);
    let world = end.world();
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let place = |site| configuration.position(&tissue.mesh, site);
    let angles = world.resource::<Zippers>().angles(place);
    let balance = 2.0 * (1.0 - 102.0 / (2.0 * 679.0f64)).acos();
    assert_eq!(angles.len(), 1);
    for angle in angles[0] {
        assert!((angle - balance).abs() < 2e-3, "{} for {}", angle.to_degrees(), balance.to_degrees());
    }
    let shared = |world: &bevy_ecs::prelude::World| -> Vec<f64> {
        let (one, other) = (path(world, 0), path(world, 1));
        let both = |[x, y]: &[f64; 2]| other.iter().any(|point| (point[0] - x).hypot(point[1] - y) < 1e-6);
        one.into_iter().filter(both).map(|[x, y]| (x - 500.0).hypot(y - 500.0) * (y - 500.0).signum()).collect()
    };
    let middle = shared(world);
    let length = middle.last().unwrap() - middle[0];
    let expected = |arm: f64| 2.0 * arm * ((0.5 * balance).tan() / half.to_radians().tan() - 1.0);
    assert!(length > expected(arm) - 1.0 && length < expected(arm + stored) + 1.0, "{length} for {}", expected(arm));
    assert!(middle.windows(2).all(|two| two[1] - two[0] < stored + 1e-6));
    // S − 2T(1 − cos β/2) at β₀ over η_Z, twice (two points), before it has changed much: within the range of the source.
    let early = shared(zipped(0.1, 102.0).world());
    let speed = (102.0 - 2.0 * 679.0 * (1.0 - half.to_radians().cos())) / 1.2;
    let opened = early.last().unwrap() - early[0];
    assert!(opened > 2.0 * 0.4 * speed * 0.1 && opened < 2.0 * speed * 0.15, "{opened} for {}", 0.2 * speed);
    assert!((18.0..120.0).contains(&speed), "0.3 to 2 um/min: {speed} um/h");
    // Where the shafts meet at more than the angle of balance nothing zips.
    let weak = shared(zipped(5.0, 10.0).world());
    assert!(weak.iter().all(|y| y.abs() < 1e-3), "{weak:?}");
}

type Ends = (Vec<(Status, u32)>, Vec<Vec<[f64; 2]>>, usize);

/// Three axons under these blocks, with the places, headings (turned by so many degrees) and target given.
fn remodelled(more: &Value, turn: f64, place: impl Fn([f64; 2]) -> [f64; 2], band: Value) -> Ends {
    let axons = [([480.0, 300.0], 82.0), ([520.0, 300.0], 98.0), ([300.0, 350.0], 90.0)];
    let axons: Vec<_> = axons.map(|(from, heading)| (place(from), heading + turn, 0.0)).to_vec();
    let mut blocks = json!({ "targets": { "goal": { "polygon": { "points": band } } } });
    more.as_object().unwrap().iter().for_each(|(name, block)| blocks[name] = block.clone());
    // A step that divides the longest segment would leave it to round-off where vertices are stored.
    let end = ended(&scene(&axons, 36.0, 0.0437, blocks), &roster());
    let world = end.world();
    let ends: Vec<_> = born(&cones(world)).iter().map(|cone| (cone.status, cone.identity.axon)).collect();
    let shafts = ends.iter().map(|(_, number)| path(world, *number as usize)).collect();
    let bonds = world.get_resource::<Zippers>().map_or(0, |zippers| zippers.angles(|_| Vector3::zeros()).len());
    (ends, shafts, bonds)
}

/// The same turned by 90 degrees about the middle of the tissue.
#[test]
fn what_remodelling_does_does_not_depend_on_the_directions_of_the_axes() {
    let branching = json!({
        "branching": { "rate": 0.1, "most": 2, "angle": 150 },
        "retraction": { "prune_after": 14, "speed": 60 }
    });
    for blocks in [branching, json!({ "zippering": { "arm": 10 } })] {
        let upright = remodelled(&blocks, 0.0, |place| place, json!([[10, 550], [990, 550], [990, 600], [10, 600]]));
        let band = json!([[450, 10], [450, 990], [400, 990], [400, 10]]);
        let turned = remodelled(&blocks, 90.0, |[x, y]| [1000.0 - y, x], band);
        assert_eq!((&upright.0, upright.2), (&turned.0, turned.2));
        assert!(upright.2 > 0 || upright.0.iter().any(|(status, _)| *status == Status::Withdrawn), "{:?}", upright.0);
        for (a, b) in upright.1.iter().zip(&turned.1) {
            assert_eq!(a.len(), b.len());
            for (place, other) in a.iter().zip(b) {
                let apart = (1000.0 - place[1] - other[0]).hypot(place[0] - other[1]);
                assert!(apart < 1e-6, "{place:?} {other:?}");
            }
        }
    }
}

/// Shafts that have stalled at the border zip, and are drawn back all the same: nothing is laid again that has been struck out.
#[test]
fn zipped_shafts_that_are_pruned_are_gone() {
    let axons = [([480.0, 700.0], 80.0, 0.0), ([520.0, 700.0], 100.0, 0.0)];
    let at_hour = |hours: f64| {
        let blocks = json!({
            "growth": { "on_border": "stall" },
            "zippering": {},
            "retraction": { "prune_after": 20, "speed": 50 }
        });
        ended(&scene(&axons, hours, 0.05, blocks), &roster())
    };
    let zipped = at_hour(19.0);
    assert_eq!(zipped.world().resource::<Zippers>().angles(|_| Vector3::zeros()).len(), 1);
    assert!(cones(zipped.world()).iter().all(|cone| cone.status == Status::Stalled));
    let gone = at_hour(30.0);
    assert!(cones(gone.world()).iter().all(|cone| cone.status == Status::Withdrawn));
    assert!((0..2).all(|shaft| path(gone.world(), shaft).len() == 2));
    assert!(gone.world().resource::<Zippers>().angles(|_| Vector3::zeros()).is_empty());
}

#[test]
fn the_scenarios_of_remodelling_show_its_effect() {
    let branches = measured("branching", &[], &[], at("/counts/branches"));
    let length = |without: &[&str]| measured("branching", without, &[], at("/morphology/length_um/mean"));
    let (with, kept) = (length(&[]), length(&["retraction"]));
    println!("branching: {branches} branches, mean length {with:.0} um, {kept:.0} um if nothing is pruned");
    assert!(branches > 20.0 && with < 0.5 * kept);
    let size =
        |summary: &Value, k: usize| at(&format!("/morphology/heights/{k}/fascicles/mean_size_per_axon"))(summary);
    let fascicles = |without: &[&str]| {
        measured("zippering", without, &[], |summary| (0..3).map(|k| size(summary, k)).sum::<f64>() / 3.0)
    };
    let (zipped, apart) = (fascicles(&[]), fascicles(&["zippering"]));
    println!("zippering: {zipped:.2} axons in an axon's fascicle, {apart:.2} without");
    assert!(zipped > apart + 0.2, "{zipped} {apart}");
}
