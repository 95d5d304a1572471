//! Values that no model has, and wrong keys beside right ones: each is refused at its own place, before anything is made of it that no memory
//! or no patience holds.

mod common;

use common::try_load;
use serde_json::{Value, json};
use tropism::simulation::{AssemblyError, Simulation};
use tropism::systems::standard;

/// A scene with most keys, each with its usual value, that is put together in no time.
fn scene() -> Value {
    json!({
        "tissue": {
            "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": 50,
            "refinement": { "tolerance": 0.5, "levels": 1 }, "corner_radius": 20, "min_angle": 25, "max_vertices": 20000
        },
        "time": { "duration": 2, "step": 0.1 },
        "growth": { "turning_rate": 0.93, "filopodium_length": 10, "filopodia_time": 0.03 },
        "populations": {
            "early": { "count": 4, "speed": 20, "births": { "uniform": { "from": 0, "to": 0.3 } } },
            "late": { "count": 2, "origin": { "points": [[50, 60]] }, "heading": 90, "births": { "at": 0.1 } }
        },
        "targets": { "bulb": { "disc": { "centre": [100, 40], "radius": 15 } } },
        "output": { "trajectory_interval": 0.1, "figure_times": [0, 1], "frames": 5, "heights": [0.5], "linkage_distance": 10 },
        "matrix": {
            "young_modulus": 500, "poisson_ratio": 0.3, "tolerance": 0.01, "mesh_size": 75,
            "motion": { "top": { "outward": 0.1, "shift": [1, 0] }, "bottom": { "outward": 0.05 } },
            "growth": { "factor": 1.02 }, "load": { "times": [0, 2], "loads": [0, 1] }
        },
        "cues": {
            "attractant": {
                "diffusion": 9000, "degradation": 3.6, "release_rate": 180,
                "sources": [{ "disc": { "centre": [100, 40], "radius": 15 } }]
            },
            "wave": {
                "diffusion": 9000, "degradation": 3.6, "release_rate": 180, "transport": "transient", "release_from": 0.2,
                "release_until": 1, "time_tolerance": 0.1, "sources": [{ "disc": { "centre": [50, 100], "radius": 15 } }]
            }
        },
        "chemotaxis": { "receptors": {
            "attractant": { "weight": 1, "dissociation_constant": 1, "populations": ["early"] },
            "wave": { "effect": "repel", "availability": { "onset": 0.5, "width": 0.1 } }
        } },
        "fasciculation": { "weight": 2, "reach": 10, "sector": 120, "adhesion": { "early": { "late": 0.5 } } },
        "borders": { "weight": 4, "range": 5 },
        "heading_noise": { "persistence_length": 300 },
        "cone_release": { "cone_radius": 5, "cues": { "given_off": { "diffusion": 3600, "degradation": 3.6, "release_rate": 180 } } },
        "steric_repulsion": { "weight": 2, "distance": 3 },
        "branching": { "rate": 0.5, "angle": 60, "most": 2 },
        "retraction": { "speed": 60, "prune_after": 1.5 },
        "zippering": { "tension": 679, "adhesion": 102, "drag": 1.2, "elongational_viscosity": 100, "arm": 5 }
    })
}

/// Pointers of all numbers in a value.
fn numbers(value: &Value, pointer: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(pointer.to_owned()),
        Value::Object(keys) => keys.iter().for_each(|(key, inner)| numbers(inner, &format!("{pointer}/{key}"), found)),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, inner)| numbers(inner, &format!("{pointer}/{i}"), found));
        }
        _ => {}
    }
}

/// What a scene with some keys set is refused with, loading and putting together; none if it is not.
fn refusal(set: &[&str]) -> Option<String> {
    let roster = standard();
    let loaded = match try_load(&scene(), &roster, &[], set) {
        Ok(loaded) => loaded,
        Err(refused) => return Some(refused.problems.iter().map(|problem| format!("{problem}\n")).collect()),
    };
    match Simulation::assemble(&loaded, &roster).err()? {
        AssemblyError::Scenario(problems) => Some(problems.iter().map(|problem| format!("{problem}\n")).collect()),
        AssemblyError::Solve(account) | AssemblyError::NoRoom(account) => Some(format!("{account}\n")),
    }
}

/// The only problem of a scene with some keys set.
fn only(set: &[&str]) -> String {
    let said = refusal(set).unwrap_or_else(|| panic!("{set:?} is taken"));
    assert_eq!(said.lines().count(), 1, "{set:?}: {said}");
    said.trim_end().to_owned()
}

#[test]
fn every_number_at_its_extremes_is_taken_or_refused_with_a_key() {
    assert_eq!(refusal(&[]), None);
    let mut keys = Vec::new();
    numbers(&scene(), "", &mut keys);
    assert!(keys.len() > 70, "{}", keys.len());
    let (mut taken, mut refused) = (0, 0);
    for key in &keys {
        for value in ["1e-9", "1e30"] {
            let set = format!("{key}={value}");
            match refusal(&[&set]) {
                None => taken += 1,
                Some(said) => {
                    refused += 1;
                    let names_a_key = said.lines().any(|line| line.contains("/") && line.contains(": "));
                    assert!(names_a_key && !said.contains("internal"), "{set}: {said}");
                }
            }
        }
    }
    assert!(taken > 40 && refused > 40, "{taken} taken, {refused} refused tell little");
}

#[test]
fn a_mesh_that_no_memory_holds_is_refused_before_it_is_begun_with_its_number_of_vertices() {
    for key in ["/tissue/mesh_size", "/matrix/mesh_size"] {
        let said = only(&[&format!("{key}=1e-9")]);
        let words = format!("{key}: triangles of 1e-9 um would need about 3.5e22 vertices; max_vertices is 20000");
        assert!(said.starts_with(&words), "{said}");
    }
    // A thread of 1 m and a hundredth of an edge: there is hardly an area, but there is a border.
    let thread =
        ["/tissue/outline/rectangle/width=1e6", "/tissue/outline/rectangle/height=1e-3", "/tissue/mesh_size=0.1"];
    let said = refusal(&thread).unwrap();
    assert!(said.contains("/tissue/mesh_size: triangles of 0.1 um would need about 2.0e7 vertices"), "{said}");
    let said = only(&["/tissue/refinement/tolerance=1e-9"]);
    assert!(
        said.starts_with("/tissue/refinement/tolerance: 1e-9 is outside what is possible: tolerance ≥ 0.001"),
        "{said}"
    );
    let said = only(&["/tissue/refinement={\"tolerance\": 0.001, \"levels\": 10}", "/matrix=null"]);
    assert!(said.starts_with("/tissue/refinement/tolerance: errors within 0.001 would need about "), "{said}");
    assert!(said.ends_with(" vertices; max_vertices is 20000"), "{said}");
}

#[test]
fn shapes_that_nearly_touch_are_refused_at_one_of_them_and_not_meshed_vertex_after_vertex() {
    let beside = |gap: f64| {
        let points = format!("[[100, 40], [{0}, 40], [{0}, 70], [100, 70]]", 120.0 - gap);
        format!(
            "/targets={{\"bulb\": {{\"polygon\": {{\"points\": {points}}}}}, \"next\": {{\"polygon\": {{\"points\": [[120, 40], [140, 40], [140, 70], [120, 70]]}}}}}}"
        )
    };
    let room = "/tissue/max_vertices=1000000";
    assert_eq!(refusal(&[&beside(0.1), room]), None);
    for gap in [1e-5, 1e-7] {
        let said = only(&[&beside(gap), room]);
        assert!(
            said.starts_with(&format!("/targets/bulb: sides come within {gap:.1e} µm of one another at (1")),
            "{said}"
        );
        assert!(said.ends_with("Move them apart (shapes may touch), or ask for a smaller size"), "{said}");
    }
}

#[test]
fn a_shape_that_no_mesh_can_be_fitted_to_is_refused_at_its_own_place() {
    let cut = "{\"polygon\": {\"points\": [[80, 40], [80.000000001, 40], [120, 70], [80, 70]]}}";
    for (set, said) in [
        ("/targets/bulb/disc/radius=1e-9", "/targets/bulb: is too small or too thin for this tissue"),
        ("/targets/bulb/disc/radius=1e-30", "/targets/bulb: the shape has the area 0 "),
        ("/cues/wave/sources/0/disc/radius=1e-9", "/cues/wave/sources/0: is too small or too thin for this tissue"),
        (&format!("/targets/bulb={cut}"), "/targets/bulb: the shape is not simple: its sides 0 and 0 meet"),
    ] {
        let found = only(&[set]);
        assert!(found.starts_with(said), "{set}: {found}");
    }
}

#[test]
fn a_cue_that_is_the_same_everywhere_is_refused_at_its_diffusion() {
    for key in ["/cues/attractant/diffusion=1e30", "/cues/wave/diffusion=1e30", "/cues/attractant/degradation=1e-20"] {
        let said = only(&[key]);
        let name = key.split('/').nth(2).unwrap();
        assert!(said.starts_with(&format!("/cues/{name}/diffusion: ")) && said.contains("decay length"), "{said}");
    }
    // Just below what is refused there is an equilibrium: 1000 times the border, 700 um, squared, times k.
    assert_eq!(refusal(&["/cues/attractant/diffusion=1.7e12"]), None);
    assert!(only(&["/cues/attractant/diffusion=1.8e12"]).contains("at most 1.8e12 um2/h"));
}

#[test]
fn a_wrong_key_is_told_alone_and_what_depends_on_it_is_not_called_unknown() {
    let alone = [
        ("/populations/early/sped=20", "/populations/early/sped: unknown key; did you mean `speed`?"),
        ("/populations/early/count=\"20 um\"", "/populations/early/count: "),
        ("/populations/early/births/uniform/from=\"3 um\"", "/populations/early/births"),
        ("/tissue/mesh_siz=3", "/tissue/mesh_siz: unknown key; did you mean `mesh_size`?"),
        ("/tissue/outline={\"rectangle\": {\"width\": \"3 h\", \"height\": 150}}", "/tissue/outline/rectangle/width: "),
        ("/cues/attractant/difusion=3", "/cues/attractant/difusion: unknown key; did you mean `diffusion`?"),
        ("/time/stepp=3", "/time/stepp: unknown key; did you mean `step`?"),
        ("/targets/bulb/disc/radius=\"3 h\"", "/targets/bulb/disc/radius: "),
    ];
    for (set, beginning) in alone {
        let said = only(&[set]);
        assert!(said.starts_with(beginning), "{set}: {said}");
    }
    // An edge that only the outline at fault has.
    let ring = "{\"polygon\": {\"outer\": {\"points\": [[0, 0], [200, 0], [200, 150], [0, 150]], \"edges\": [\"floor\", \"s\", \"roof\", \"s\"]}}}";
    let outline = format!("/tissue/outline={ring}");
    let of_ring = [
        outline.as_str(),
        "/matrix/motion={\"floor\": {}, \"roof\": {\"outward\": 0.1}}",
        "/populations/early/origin={\"edge\": \"floor\"}",
    ];
    assert_eq!(refusal(&of_ring), None);
    let said = only(&[&of_ring[..], &["/tissue/mesh_siz=3"]].concat());
    assert!(said.starts_with("/tissue/mesh_siz: unknown key"), "{said}");
}
