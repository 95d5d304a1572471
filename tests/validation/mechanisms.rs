//! The mechanisms from the literature through the whole program: closed forms of what an axon does, no effect at no strength, and the
//! effect that each one's scenario shows.

use crate::common::{cones, ended, hash_of_states, loaded, recorded, to_end, try_load};
use crate::fixed_pull::roster;
use serde_json::{Map, Value, json};
use tropism::numerics::bessel;
use tropism::prelude::{GrowthCone, Site, Tissue, With};
use tropism::scenario::load::Request;
use tropism::simulation::Simulation;
use tropism::study::run::read;

pub(crate) const SPEED: f64 = 20.0;

/// Cones of one axon each, from a place with a heading (degrees) and a time of birth (h), in a wide tissue.
pub(crate) fn scene(axons: &[([f64; 2], f64, f64)], duration: f64, step: f64, blocks: Value) -> Value {
    let population = |(i, (from, heading, birth)): (usize, &([f64; 2], f64, f64))| {
        let origin = json!({ "points": [from] });
        let keys =
            json!({ "count": 1, "speed": SPEED, "births": { "at": birth }, "origin": origin, "heading": heading });
        (format!("axon{i}"), keys)
    };
    let populations: Map<String, Value> = axons.iter().enumerate().map(population).collect();
    let mut scene = json!({
        "tissue": { "outline": { "rectangle": { "width": 1000, "height": 1000 } }, "mesh_size": 100 },
        "time": { "duration": duration, "step": step },
        "populations": populations
    });
    blocks.as_object().unwrap().iter().for_each(|(name, block)| scene[name] = block.clone());
    scene
}

/// Snell's law: sin θ / v is kept across a step of stiffness, θ the angle to the step's normal. The profile is linear in between, so
/// any path through it must keep it; a step across one of its two corners is in error by up to its own turning.
#[test]
fn an_axon_is_refracted_at_a_step_of_stiffness_as_snells_law_says() {
    for (from, to) in [(200.0f64, 1000.0f64), (1000.0, 200.0)] {
        let duro = json!({ "weight": 0, "profile": [[400, from], [500, to]] });
        for angle in [20.0, 35.0f64] {
            let scene = scene(&[([300.0, 300.0], angle, 0.0)], 22.0, 0.005, json!({ "durotaxis": duro }));
            let end = ended(&scene, &roster());
            let cone = cones(end.world())[0];
            assert!(cone.position.x > 520.0, "{}", cone.position.x);
            let expected = (angle.to_radians().sin() * (to / from).powf(0.3)).asin().to_degrees();
            let found = cone.spring.heading.y.atan2(cone.spring.heading.x).to_degrees();
            assert!((found - expected).abs() < 0.06, "{from} to {to} Pa at {angle} deg: {found} for {expected}");
        }
    }
}

/// A cone that spins at Ω and whose shaft resists makes the arc of Ω = v/R + κ λ_B sin(ℓ_b/(2R)).
#[test]
fn a_stiff_shaft_opens_the_arc_of_a_spinning_cone_to_the_radius_of_the_closed_form() {
    let (spin, weight, length, turning_rate) = (1.0, 1.0, 20.0, 0.93);
    let law = |radius: f64| SPEED / radius + turning_rate * weight * (0.5 * length / radius).sin() - spin;
    let (mut low, mut high) = (20.0, 200.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if law(middle) > 0.0 { low = middle } else { high = middle }
    }
    let heading = |duration: f64| {
        let blocks = json!({
            "fixed_pull": { "pull": [0, 0], "spin": spin },
            "bending_stiffness": { "weight": weight, "length": length },
            "growth": { "turning_rate": turning_rate }
        });
        let end = ended(&scene(&[([500.0, 500.0], 0.0, 0.0)], duration, 1.0 / 128.0, blocks), &roster());
        let e = cones(end.world())[0].spring.heading;
        e.y.atan2(e.x)
    };
    let turned = (heading(6.0) - heading(4.0)).rem_euclid(std::f64::consts::TAU);
    let radius = SPEED * 2.0 / turned;
    // The stored shaft is within 0.25 um of the path: 1/80 of ℓ_b, in the direction that it gives.
    assert!((radius / low - 1.0).abs() < 0.02, "{radius} for {low}");
    assert!(low > 1.3 * SPEED / spin, "the shaft matters: {low}");
}

/// A leader takes a decision region of length L in L/(v f), a follower on its shaft in L/v.
#[test]
fn a_leader_slows_down_in_its_region_and_a_follower_on_its_shaft_does_not() {
    let band =
        |low: f64, high: f64| json!({ "polygon": { "points": [[300, low], [700, low], [700, high], [300, high]] } });
    let step = 0.05;
    let blocks = json!({
        "targets": { "goal": band(800.0, 900.0) },
        "leader_follower": { "regions": { "midline": band(400.0, 500.0) }, "leader_speed": 0.25 }
    });
    let axons = [([500.0, 200.0], 90.0, 0.0), ([501.0, 200.0], 90.0, 20.0)];
    let end = ended(&scene(&axons, 70.0, step, blocks), &roster());
    let travelled: Vec<f64> = cones(end.world()).iter().map(|cone| cone.journey.ended - cone.birth_time).collect();
    let (leader, follower) = (500.0 / SPEED + 100.0 / (0.25 * SPEED), 600.0 / SPEED);
    assert!((travelled[0] - leader).abs() < 4.0 * step, "{} for {leader}", travelled[0]);
    assert!((travelled[1] - follower).abs() < 1e-9, "{} for {follower}", travelled[1]);
}

#[test]
fn two_axons_closer_than_the_distance_part_and_others_run_on() {
    let blocks = json!({ "steric_repulsion": { "weight": 2, "distance": 5 } });
    let parted = |apart: f64| {
        let axons = [([500.0, 200.0], 90.0, 0.0), ([500.0 + apart, 190.0], 90.0, 0.0)];
        let end = ended(&scene(&axons, 10.0, 0.02, blocks.clone()), &roster());
        let found = cones(end.world());
        found[1].position.x - found[0].position.x
    };
    assert!(parted(2.0) > 5.0, "{}", parted(2.0));
    assert!((parted(6.0) - 6.0).abs() < 1e-9);
}

/// Two cones side by side at a distance r begin to turn at κ s, s the difference in receptor occupancy in the other one's K₀.
#[test]
fn two_cones_begin_to_turn_to_each_other_as_the_field_of_a_disc_says() {
    let (r, a, length, level) = (40.0, 5.0, 50.0f64, 30.0);
    let (k0, k1, i1) = {
        let ([k0, k1], [_, i1]) = (bessel::decaying(r / length), bessel::growing(a / length));
        (k0, k1, i1)
    };
    let c = level * (a / length) * i1 * k0;
    let slope = level * (a / length) * i1 * k1 / length;
    let (turning_rate, time) = (0.93, 0.01);
    let expected = turning_rate * time * 10.0 * slope / ((1.0 + c) * (1.0 + c)) / 0.025;
    assert!(expected > 1e-3, "{expected}");
    for (effect, sign) in [("attract", 1.0), ("repel", -1.0)] {
        let cue = json!({ "effect": effect, "diffusion": 2500 * 4, "degradation": 4, "release_rate": 4.0 * level });
        let blocks = json!({ "cone_release": { "cues": { "own": cue } }, "growth": { "turning_rate": turning_rate } });
        let axons = [([480.0, 500.0], 90.0, 0.0), ([480.0 + r, 500.0], 90.0, 0.0), ([20.0, 20.0], 90.0, 0.0)];
        let end = ended(&scene(&axons, time, time, blocks), &roster());
        let headings: Vec<f64> = cones(end.world()).iter().map(|cone| cone.spring.heading.x).collect();
        assert!((headings[0] - sign * expected).abs() < 1e-3 * expected, "{} {expected}", headings[0]);
        assert!((headings[1] + sign * expected).abs() < 1e-3 * expected);
        assert!(headings[2].abs() < 1e-15, "beyond eight decay lengths: {}", headings[2]);
    }
}

/// Positions are those of the stage, of all cones.
#[test]
fn cones_that_feel_each_other_are_followed_with_order_two_in_the_step() {
    let places = |step: f64| {
        let cue = json!({ "effect": "repel", "diffusion": 9000, "weight": 2 });
        let blocks = json!({ "cone_release": { "cues": { "own": cue } } });
        let axons = [([480.0, 300.0], 80.0, 0.0), ([510.0, 295.0], 100.0, 0.0), ([530.0, 320.0], 120.0, 0.0)];
        let end = ended(&scene(&axons, 6.0, step, blocks), &roster());
        cones(end.world()).iter().map(|cone| cone.position).collect::<Vec<_>>()
    };
    let fine = places(1.0 / 128.0);
    let error = |step: f64| places(step).iter().zip(&fine).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let errors = [0.25, 0.125, 0.0625].map(error);
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.25) && errors[0] > 1e-4, "{orders:?} {errors:?}");
}

/// Which cones release a repellent that a cue of the tissue switches on.
#[test]
fn a_release_that_a_cue_activates_begins_where_the_cue_is() {
    let disc = json!({ "disc": { "centre": [500, 900], "radius": 60 } });
    let parted = |height: f64| {
        let activation = json!({ "cue": "target", "half_at": 1, "steepness": 4 });
        let blocks = json!({
            "cues": { "target": { "diffusion": "1 um^2/s", "sources": [disc] } },
            "cone_release": { "cues": { "own": { "effect": "repel", "activated_by": activation } } }
        });
        let axons = [([490.0, height], 90.0, 0.0), ([510.0, height], 90.0, 0.0)];
        let end = ended(&scene(&axons, 2.0, 0.02, blocks), &roster());
        let found = cones(end.world());
        found[1].position.x - found[0].position.x
    };
    assert!((parted(200.0) - 20.0).abs() < 1e-6, "{}", parted(200.0));
    assert!(parted(820.0) > 22.0, "{}", parted(820.0));
}

/// Each mechanism with a strength of zero leaves the bits of a scene without it.
#[test]
fn a_mechanism_without_strength_changes_no_bit() {
    let disc = json!({ "disc": { "centre": [500, 700], "radius": 80 } });
    let base = |block: Value| {
        let mut blocks = json!({
            "targets": { "goal": disc },
            "matrix": { "motion": { "top": { "outward": 0.1 }, "bottom": { "outward": 0.1 } } },
            "cues": { "netrin": { "sources": [disc] } },
            "chemotaxis": { "receptors": { "netrin": {} } },
            "fasciculation": {}, "borders": {}, "heading_noise": {}
        });
        block.as_object().unwrap().iter().for_each(|(name, block)| blocks[name] = block.clone());
        let axons = [([480.0, 20.0], 90.0, 0.0), ([500.0, 10.0], 80.0, 0.0), ([490.0, 15.0], 100.0, 1.0)];
        hash_of_states(ended(&scene(&axons, 20.0, 0.1, blocks), &roster()).world())
    };
    let without = base(json!({}));
    for block in [
        json!({ "growth_rate_modulation": { "cue": "netrin", "strength": 0 } }),
        json!({ "bending_stiffness": { "weight": 0 } }),
        json!({ "durotaxis": { "weight": 0, "speed_exponent": 0, "profile": [[0, 100], [800, 2000]] } }),
        json!({ "steric_repulsion": { "weight": 0 } }),
        json!({ "cone_release": { "cues": { "own": { "weight": 0 } } } }),
        json!({ "cone_release": { "cues": { "own": { "release_rate": 0 } } } }),
        json!({ "leader_follower": { "regions": { "goal": disc }, "leader_speed": 1 } }),
        json!({ "retraction": { "prune_after": 100 } }),
        json!({ "zippering": { "adhesion": 0 } }),
    ] {
        assert_eq!(base(block.clone()), without, "{block}");
    }
    assert_ne!(base(json!({ "bending_stiffness": {} })), without);
}

#[test]
fn a_bound_cue_is_the_diffusing_one_at_rest_and_another_one_in_a_stretched_tissue() {
    let disc = json!({ "disc": { "centre": [500, 700], "radius": 80 } });
    let state = |transport: &str, outward: f64| {
        let edge = json!({ "outward": outward });
        let blocks = json!({
            "matrix": { "motion": { "top": edge, "bottom": edge } },
            "cues": { "netrin": { "transport": transport, "sources": [disc] } },
            "chemotaxis": { "receptors": { "netrin": {} } }
        });
        let axons = [([300.0, 200.0], 90.0, 0.0), ([600.0, 300.0], 80.0, 0.0)];
        hash_of_states(ended(&scene(&axons, 20.0, 0.1, blocks), &roster()).world())
    };
    assert_eq!(state("bound", 0.0), state("diffusing", 0.0));
    assert_ne!(state("bound", 0.1), state("diffusing", 0.1));
}

/// From the stationary field on, in a tissue at rest, nothing changes; from nothing on, a cone does not know of the source at first.
#[test]
fn a_transient_cue_that_starts_stationary_steers_as_the_diffusing_one_and_one_that_starts_from_nothing_later() {
    let disc = json!({ "disc": { "centre": [700, 500], "radius": 80 } });
    let at = |cue: Value| {
        let mut netrin = json!({ "diffusion": "1 um^2/s", "degradation": "0.2 /h", "sources": [disc] });
        cue.as_object().unwrap().iter().for_each(|(key, value)| netrin[key] = value.clone());
        let blocks = json!({ "cues": { "netrin": netrin }, "chemotaxis": { "receptors": { "netrin": {} } } });
        let end = ended(&scene(&[([400.0, 300.0], 90.0, 0.0)], 8.0, 0.1, blocks), &roster());
        cones(end.world())[0].position
    };
    let diffusing = at(json!({}));
    let still = at(json!({ "transport": "transient", "start": "stationary" }));
    assert!((still - diffusing).norm() < 1e-7, "{}", (still - diffusing).norm());
    let risen = at(json!({ "transport": "transient" }));
    let later = at(json!({ "transport": "transient", "release_from": 4 }));
    let ended = at(json!({ "transport": "transient", "release_until": 2 }));
    assert!(diffusing.x > risen.x + 5.0 && risen.x > later.x + 5.0 && risen.x > ended.x, "{risen} {later} {ended}");
}

/// Mean way to the right of the axons born first and of those born last, of which the cue has reached the latter only.
#[test]
fn axons_born_before_a_front_arrives_pass_and_later_ones_turn() {
    let ways = |name: &str| {
        let path = format!("{}/scenarios/{name}.json", env!("CARGO_MANIFEST_DIR")).into();
        let scene = read(&Request { path, without: vec![], set: vec![] }, &tropism::systems::standard()).unwrap();
        let mut simulation = Simulation::assemble(&scene, &tropism::systems::standard()).unwrap();
        let origins: Vec<f64> = {
            let (world, tissue) = (simulation.world(), simulation.world().resource::<Tissue>());
            let mut query = world.try_query_filtered::<&Site, With<GrowthCone>>().unwrap();
            query.iter(world).map(|origin| tissue.reference_position(*origin).x).collect()
        };
        to_end(&mut simulation);
        let mut ways: Vec<(f64, f64)> = cones(simulation.world())
            .iter()
            .zip(origins)
            .map(|(cone, origin)| (cone.birth_time, cone.position.x - origin))
            .collect();
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = |part: &[(f64, f64)]| part.iter().map(|(_, way)| way).sum::<f64>() / part.len() as f64;
        [mean(&ways[..ways.len() / 4]), mean(&ways[3 * ways.len() / 4..])]
    };
    let ([early, late], [stationary_early, stationary_late]) = (ways("cue_front"), ways("cue_front_stationary"));
    println!(
        "um to the right, first and last quarter: {early:.0} {late:.0}; stationary {stationary_early:.0} {stationary_late:.0}"
    );
    assert!(late > early + 50.0 && (stationary_late - stationary_early).abs() < 0.5 * (late - early));
}

/// A measure of a scenario of the repository over its first seeds, with some keys set and mechanisms left out.
pub(crate) fn measured(name: &str, without: &[&str], set: &[&str], pick: impl Fn(&Value) -> f64) -> f64 {
    let seeds = 2;
    let of_seed = |seed: u64| {
        let path = format!("{}/scenarios/{name}.json", env!("CARGO_MANIFEST_DIR")).into();
        let mut set: Vec<String> = set.iter().map(|text| (*text).to_owned()).collect();
        set.push(format!("/seed={seed}"));
        let without = without.iter().map(|text| (*text).to_owned()).collect();
        let roster = tropism::systems::standard();
        let scene = read(&Request { path, without, set }, &roster).unwrap_or_else(|error| panic!("{error}"));
        pick(&serde_json::to_value(&recorded(&scene, &roster).summary).unwrap())
    };
    (1..=seeds).map(of_seed).sum::<f64>() / seeds as f64
}

pub(crate) fn at<'a>(pointer: &'a str) -> impl Fn(&Value) -> f64 + 'a {
    move |summary| summary.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {pointer}"))
}

const HITS: &str = "/morphology/hits/fraction";

#[test]
fn axons_cross_the_midline_only_because_they_change_what_they_sense() {
    let with = measured("midline", &[], &[], at(HITS));
    let attracted_for_ever = ["/chemotaxis/receptors/netrin/availability=null", "/chemotaxis/receptors/slit=null"];
    let stuck = measured("midline", &[], &attracted_for_ever, at(HITS));
    let repelled_at_once = measured("midline", &[], &["/chemotaxis/receptors/slit/availability=null"], at(HITS));
    println!("crossed: {with:.2}; attracted for ever {stuck:.2}; repelled from the start {repelled_at_once:.2}");
    assert!(with > stuck + 0.3 && with > repelled_at_once + 0.3);
}

#[test]
fn axons_that_adhere_to_their_kind_sort_themselves() {
    let like = at("/morphology/heights/2/like_neighbours");
    let (typed, untyped) =
        (measured("sorting", &[], &[], &like), measured("sorting", &[], &["/fasciculation/adhesion=null"], &like));
    println!("like neighbours: {typed:.2} typed, {untyped:.2} untyped");
    assert!(typed > untyped + 0.15, "{typed} {untyped}");
}

#[test]
fn cones_bundle_by_what_they_release_and_part_again_where_the_target_switches_a_repellent_on() {
    let size = |height: usize, set: &[&str]| {
        let pointer = format!("/morphology/heights/{height}/fascicles/mean_size_per_axon");
        measured("released_cues", &[], set, at(&pointer))
    };
    let (no_attractant, no_repellent) = ("/cone_release/cues/bundling=null", "/cone_release/cues/debundling=null");
    let (half_way, alone) = (size(1, &[]), size(1, &[no_attractant]));
    let (near_target, still_bundled) = (size(2, &[]), size(2, &[no_repellent]));
    println!(
        "axons a fascicle: half-way {half_way:.1}, {alone:.1} without the attractant; near the target {near_target:.1}, {still_bundled:.1} without the repellent"
    );
    assert!(half_way > 1.5 * alone && still_bundled > 2.5 * near_target);
}

#[test]
fn the_scenario_of_each_mechanism_shows_its_effect() {
    let straightness = "/morphology/straightness/mean";
    let bundled = "/morphology/heights/2/fascicles/mean_size_per_axon";
    for (scenario, mechanism, measure, least) in [
        // The mechanism raises the measure by at least so much, or lowers it.
        ("growth_rate", "growth_rate_modulation", HITS, 0.2),
        ("bending", "bending_stiffness", straightness, 0.05),
        ("durotaxis", "durotaxis", HITS, 0.1),
        ("steric", "steric_repulsion", bundled, -5.0),
        ("leaders", "leader_follower", "/morphology/travel_time_h/mean", 0.5),
    ] {
        let (with, off) =
            (measured(scenario, &[], &[], at(measure)), measured(scenario, &[mechanism], &[], at(measure)));
        println!("{scenario}: {measure} {with:.3} with {mechanism}, {off:.3} without");
        assert!((with - off) / least > 1.0, "{scenario}: {with} {off}");
    }
}

#[test]
fn what_makes_no_sense_is_refused_with_its_place() {
    let cue = |keys: Value| {
        let mut netrin = json!({ "sources": [{ "disc": { "centre": [500, 700], "radius": 80 } }] });
        keys.as_object().unwrap().iter().for_each(|(key, value)| netrin[key] = value.clone());
        json!({ "cues": { "netrin": netrin } })
    };
    for (block, expected) in [
        (json!({ "growth_rate_modulation": { "cue": "netrin" } }), "/growth_rate_modulation/cue: there is no cue"),
        (json!({ "durotaxis": {} }), "/durotaxis/profile: give pairs"),
        (json!({ "cone_release": {} }), "/cone_release/cues: name what cones release"),
        (
            json!({ "cone_release": { "cues": { "own": { "activated_by": { "cue": "netrin" } } } } }),
            "/cone_release/cues/own/activated_by/cue: there is no cue",
        ),
        (cue(json!({ "start": "nothing" })), "/cues/netrin/start: only a transient cue"),
        (cue(json!({ "release_until": 1 })), "/cues/netrin/release_until: only a transient cue"),
        (cue(json!({ "transport": "transient", "element": "quadratic" })), "/cues/netrin/element: a transient cue"),
        (cue(json!({ "transport": "transient", "mass": "consistent" })), "/cues/netrin/mass: a transient cue"),
        (
            cue(json!({ "transport": "transient", "release_from": 3, "release_until": 3 })),
            "/cues/netrin/release_until: 3 h is not after 3 h",
        ),
        (json!({ "durotaxis": { "profile": [[1, 5], [0, 5]] } }), "/durotaxis/profile: places must ascend"),
        (json!({ "durotaxis": { "profile": [[1, -5]] } }), "/durotaxis/profile: a stiffness is positive"),
        (json!({ "leader_follower": {} }), "/leader_follower/regions: give a region"),
        (json!({ "retraction": {} }), "/retraction: give `prune_after`"),
        (json!({ "retraction": { "collapse": { "cue": "slit" } } }), "/retraction/collapse/cue: there is no cue"),
        (json!({ "branching": { "cue": "slit" } }), "/branching/cue: there is no cue"),
        (json!({ "branching": { "most": 65 } }), "/branching/most"),
        (json!({ "zippering": { "adhesion": 2000 } }), "/zippering/adhesion: no angle balances"),
    ] {
        let scene = scene(&[([500.0, 500.0], 0.0, 0.0)], 1.0, 0.1, block);
        let refused = try_load(&scene, &roster(), &[], &[]).map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
    let fine = scene(&[([500.0, 500.0], 0.0, 0.0)], 1.0, 0.1, json!({ "durotaxis": { "profile": [[0, 5]] } }));
    assert!(loaded(&fine, &roster()).blocks.contains_key("durotaxis"));
}
