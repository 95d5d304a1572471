//! The keys `element` and `gradient` of a cue: what cones sense, at rest and while the tissue deforms.

use serde_json::{Value, json};
use tropism::model::components::Site;
use tropism::model::configuration::Configuration;
use tropism::model::observables::Observables;
use tropism::model::plan::Plan;
use tropism::model::tissue::Tissue;
use tropism::prelude::*;
use tropism::systems::standard;

use crate::common::{assembled, to_end, try_load};

fn scene(mesh_size: f64, cue: Value, moves: bool) -> Value {
    let mut block =
        json!({ "diffusion": "2.5 um^2/s", "sources": [{ "disc": { "centre": [100, 120], "radius": 15 } }] });
    block.as_object_mut().unwrap().extend(cue.as_object().unwrap().clone());
    let matrix = json!({ "motion": { "top": { "outward": 0.1 }, "bottom": { "outward": 0.1 } } });
    json!({
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": mesh_size },
        "time": { "duration": 1, "step": "10 min" },
        "populations": { "axons": { "count": 2, "births": { "at": 0 } } },
        "matrix": if moves { matrix } else { Value::Null },
        "cues": { "attractant": block },
        "chemotaxis": { "receptors": { "attractant": {} } }
    })
}

/// Places in the reference configuration, none at a vertex.
fn places() -> Vec<[f64; 2]> {
    (0..12).flat_map(|i| (0..9).map(move |j| [15.3 + 14.9 * f64::from(i), 10.7 + 14.3 * f64::from(j)])).collect()
}

/// What is sensed at the end of a run at all places, and the plan's sentence on the cue.
fn sensed(scene: &Value) -> (Vec<(f64, Vector3<f64>)>, String) {
    let mut simulation = assembled(scene, &standard());
    to_end(&mut simulation);
    let world = simulation.world();
    let (field, tissue) = (&world.resource::<Observables>().fields[0], world.resource::<Tissue>());
    let sites = places().into_iter().map(|place| tissue.locate(place).unwrap());
    let samples = sites.map(|site| (field.sample)(world, field.index, site)).collect();
    let plan = &world.resource::<Plan>().parts;
    (samples, plan.iter().find(|part| part.name == "cue `attractant`").unwrap().why.clone())
}

/// Root mean square of the relative errors of c and ∇c.
fn errors(found: &[(f64, Vector3<f64>)], exact: &[(f64, Vector3<f64>)]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for ((c, g), (exact_c, exact_g)) in found.iter().zip(exact) {
        sums[0] += (c / exact_c - 1.0).powi(2) / exact.len() as f64;
        sums[1] += (g - exact_g).norm_squared() / exact_g.norm_squared() / exact.len() as f64;
    }
    sums.map(f64::sqrt)
}

#[test]
fn quadratic_elements_sense_closer_to_a_fine_mesh_than_linear_ones_also_in_a_deformed_tissue() {
    for moves in [false, true] {
        let exact = sensed(&scene(3.0, json!({ "element": "quadratic" }), moves)).0;
        let error = |cue: Value| errors(&sensed(&scene(12.0, cue, moves)).0, &exact);
        let linear = error(json!({}));
        let raw = error(json!({ "gradient": "raw" }));
        let quadratic = error(json!({ "element": "quadratic" }));
        let quadratic_raw = error(json!({ "element": "quadratic", "gradient": "raw" }));
        let all = format!("{moves}: {linear:?} {raw:?} {quadratic:?} {quadratic_raw:?}");
        assert!(linear[1] < 0.5 * raw[1] && linear[0] == raw[0], "{all}");
        assert!(quadratic[0] < 0.2 * linear[0] && quadratic[1] < linear[1], "{all}");
        assert!(quadratic_raw[0] == quadratic[0] && quadratic_raw[1] < 0.3 * raw[1], "{all}");
    }
}

#[test]
fn what_is_sensed_as_raw_is_the_slope_of_what_is_sensed_as_concentration() {
    for element in ["linear", "quadratic"] {
        let scene = scene(12.0, json!({ "element": element, "gradient": "raw" }), true);
        let mut simulation = assembled(&scene, &standard());
        to_end(&mut simulation);
        let world = simulation.world();
        let (field, tissue) = (&world.resource::<Observables>().fields[0], world.resource::<Tissue>());
        let configuration = world.resource::<Configuration>();
        let at = |site: Site| (field.sample)(world, field.index, site);
        for place in places() {
            let site = Site { weights: [0.2, 0.5], ..tissue.locate(place).unwrap() };
            let gradient = at(site).1;
            for i in 0..2 {
                let shifted = |sign: f64| {
                    let mut moved = site;
                    moved.weights[i] += sign * 1e-4;
                    (at(moved).0, configuration.position(&tissue.mesh, moved))
                };
                let ((after, to), (before, from)) = (shifted(1.0), shifted(-1.0));
                let way = to - from;
                let slope = (after - before) / way.norm();
                let told = gradient.dot(&way) / way.norm();
                assert!((slope - told).abs() < 1e-6 * gradient.norm(), "{element}: {slope} {told}");
            }
        }
    }
}

#[test]
fn the_plan_counts_the_unknowns_of_the_element_used() {
    let linear = sensed(&scene(12.0, json!({}), false)).1;
    let quadratic = sensed(&scene(12.0, json!({ "element": "quadratic" }), false)).1;
    let count = |text: &str| text.split(' ').find_map(|word| word.parse::<f64>().ok()).unwrap();
    assert!(linear.contains("unknowns, solved once") && quadratic.contains("unknowns of quadratic elements"));
    assert!((3.5..4.0).contains(&(count(&quadratic) / count(&linear))), "{linear} {quadratic}");
}

#[test]
fn a_lumped_mass_of_quadratic_elements_is_refused_and_a_consistent_one_is_not() {
    let refused = scene(12.0, json!({ "element": "quadratic", "mass": "lumped" }), false);
    let message = try_load(&refused, &standard(), &[], &[]).unwrap_err().to_string();
    assert!(message.contains("/cues/attractant/mass") && message.contains("no lumped mass"), "{message}");
    let accepted = scene(12.0, json!({ "element": "quadratic", "mass": "consistent" }), false);
    assert_eq!(sensed(&accepted).0, sensed(&scene(12.0, json!({ "element": "quadratic" }), false)).0);
}
