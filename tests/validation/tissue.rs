//! Axons in a tissue that deforms: shafts ride it, cones are carried by it, and a plane stays a plane.

use crate::common::{cones, ended, fitted_order};
use crate::fixed_pull::roster;
use serde_json::{Value, json};
use tropism::prelude::*;
use tropism::record::snapshot::shafts;

fn closed_forms() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/closed_forms.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// λ_x of uniaxial plane strain: S_xx = 0 gives λ_x² = 1 − ν/(1−ν) (λ_y² − 1).
fn sideways_stretch(poisson: f64, stretch: f64) -> f64 {
    (1.0 - poisson / (1.0 - poisson) * (stretch * stretch - 1.0)).sqrt()
}

/// Top and bottom move outward by a share of the height each and slide; the sides are free.
fn sliding_block(width: f64, height: f64, outward: f64) -> Value {
    let motion = json!({ "outward": outward, "sideways": "sliding" });
    json!({
        "tissue": { "outline": { "rectangle": { "width": width, "height": height } }, "mesh_size": height / 8.0 },
        "matrix": { "motion": { "top": motion, "bottom": motion }, "tolerance": 1e-9 }
    })
}

/// The affine map from rest to now that the first cell of the mesh goes through.
fn affine_map(world: &World) -> impl Fn([f64; 2]) -> [f64; 2] {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let gradient = configuration.deformation_gradient(&tissue.mesh, 0);
    let corner = tissue.mesh.cell(0)[0] as usize;
    let (from, to) = (tissue.mesh.vertices()[corner], configuration.vertex(corner));
    move |x: [f64; 2]| {
        let offset = [x[0] - from[0], x[1] - from[1]];
        [0, 1].map(|i| to[i] + gradient[(i, 0)] * offset[0] + gradient[(i, 1)] * offset[1])
    }
}

#[test]
fn shafts_ride_an_affine_stretch() {
    let (width, height) = (300.0, 200.0);
    let births = [[40.0, 30.0], [150.0, 20.0], [220.0, 90.0], [111.0, 77.0]];
    for (duration, load) in [(6.0, 1.0), (3.9, 0.65)] {
        let mut scene = sliding_block(width, height, 0.2);
        scene["matrix"]["load"] = json!({ "times": [0, 6], "loads": [0, 1] });
        scene["time"] = json!({ "duration": duration, "step": 0.1 });
        scene["populations"] = json!({ "axons": {
            "count": births.len(), "births": { "at": 0 }, "origin": { "points": births }, "heading": 80
        } });
        scene["heading_noise"] = json!({});
        let end = ended(&scene, &roster());
        let world = end.world();
        let tissue = world.resource::<Tissue>();
        let map = affine_map(world);
        let (mut worst, mut points) = (0.0f64, 0);
        for (shaft, birth) in shafts(world).iter().zip(births) {
            let wanted = map(birth);
            worst = worst.max((shaft[0][0] - wanted[0]).hypot(shaft[0][1] - wanted[1]));
            points += shaft.len();
        }
        let stored = world.resource::<Shafts>();
        for (number, shaft) in shafts(world).iter().enumerate() {
            for (point, now) in stored.polyline(number).into_iter().zip(shaft) {
                let rest = tissue.reference_position(point.into());
                let wanted = map([rest.x, rest.y]);
                worst = worst.max((now[0] - wanted[0]).hypot(now[1] - wanted[1]));
            }
        }
        assert!(points > 4 * births.len(), "shafts of {points} points are too short to tell");
        println!("load {load}: {points} shaft points off the affine map by {:.1e} of the width", worst / width);
        assert!(worst < 1e-12 * width, "{worst:e}");
        let stretch = 1.0 + 0.4 * load;
        let sides = [map([width, 0.0])[0] - map([0.0, 0.0])[0], map([0.0, height])[1] - map([0.0, 0.0])[1]];
        assert!((sides[0] / width - sideways_stretch(0.3, stretch)).abs() < 1e-6, "{}", sides[0] / width);
        assert!((sides[1] / height - stretch).abs() < 1e-6, "{}", sides[1] / height);
    }
}

/// The closed form has the centre of the block at rest; the program holds one vertex, so x is taken from the mid-line.
fn error_of_the_carried_axon(method: &str, steps: u32) -> f64 {
    let reference = &closed_forms()["carried_axon"];
    let pair = |key: &str| [0, 1].map(|i| reference[key][i].as_f64().unwrap());
    let (centre, start, velocity, wanted) = (pair("centre"), pair("x0"), pair("v_g"), pair("x_at_t"));
    let mut scene = sliding_block(1.5, 1.0, 0.5 * reference["b"].as_f64().unwrap());
    scene["matrix"]["poisson_ratio"] = reference["nu"].clone();
    scene["time"] = json!({ "duration": reference["t"], "step": 1.0 / f64::from(steps), "method": method });
    scene["populations"] = json!({ "axons": {
        "count": 1, "speed": velocity[0].hypot(velocity[1]), "births": { "at": 0 },
        "origin": { "points": [start] }, "heading": velocity[1].atan2(velocity[0]).to_degrees()
    } });
    let end = ended(&scene, &roster());
    let middle = affine_map(end.world())(centre);
    let tip = cones(end.world())[0].position;
    let found = [tip.x - middle[0] + centre[0], tip.y - middle[1] + centre[1]];
    (found[0] - wanted[0]).hypot(found[1] - wanted[1])
}

#[test]
fn a_carried_axon_follows_its_closed_form() {
    let error = error_of_the_carried_axon("rk4", 40);
    println!("carried axon, rk4, 40 steps: {error:.1e}");
    assert!(error < 1e-8, "{error:e}");
    for (method, order) in [("euler", 1.0), ("heun", 2.0), ("rotation", 2.0)] {
        let errors = [10, 20, 40].map(|steps| error_of_the_carried_axon(method, steps));
        println!("carried axon, {method}: order {:.2}, {errors:?}", fitted_order(&errors));
        assert!((fitted_order(&errors) - order).abs() < 0.15, "{method}: {errors:?}");
    }
}

#[test]
fn in_a_planar_scene_nothing_that_a_mechanism_sees_leaves_the_plane() {
    let scene = json!({
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 25 },
        "time": { "duration": 4, "step": "4 min" },
        "growth": { "heading_follows": "spin" },
        "populations": { "axons": { "count": 20, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "matrix": {},
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    });
    let end = ended(&scene, &roster());
    let world = end.world();
    let mut query = world.try_query_filtered::<(&Position, &Velocity, &SpringState), With<GrowthCone>>().unwrap();
    for (position, velocity, spring) in query.iter(world) {
        let spring = spring.seen();
        assert_eq!([position.in_space().z, spring.heading.z, spring.pull.z], [0.0; 3]);
        assert_eq!((spring.spin.x, spring.spin.y), (0.0, 0.0));
        // What leaves the plane is not stored: a heading that had would be too short.
        assert!((spring.heading.norm() - 1.0).abs() < 1e-12);
        assert!(velocity.tissue.norm() > 0.0 && spring.spin.z != 0.0, "the scene must move to tell");
    }
}
