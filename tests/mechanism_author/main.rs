//! The how-to of a mechanism as a test: mechanisms from outside the crate, written with the prelude alone, run in a roster of
//! their author's making, meet the same checks, and leave everything else as it was.

mod adaptive_steps;
mod combined_signal;
#[path = "../common/mod.rs"]
mod common;
mod disc_field;
#[path = "../../examples/galvanotaxis/src/galvanotaxis.rs"]
mod example;
#[path = "../verification/figures.rs"]
mod figures;
mod front;
mod fung;
mod galvanotaxis;
mod materials;
#[path = "../../assets/new_mechanism/mechanism.rs"]
mod steady_pull;
mod trajectories;

use common::{Folder, cones, ended, hash_of_states, try_load};
use galvanotaxis::Galvanotaxis;
use serde_json::{Value, json};
use tropism::prelude::*;
use tropism::systems;

fn roster() -> Roster {
    systems::standard().with::<Galvanotaxis>()
}

fn field_alone(method: &str, heading: f64, direction: f64, step: f64) -> Value {
    json!({
        "tissue": { "outline": { "rectangle": { "width": 400, "height": 400 } }, "mesh_size": 40 },
        "time": { "duration": 6, "step": step, "method": method },
        "populations": { "axons": {
            "count": 1, "speed": 20, "births": { "at": 0 },
            "origin": { "points": [[200, 200]] }, "heading": heading
        } },
        "galvanotaxis": { "field": "50 mV/mm", "weight": 1.5, "direction": direction }
    })
}

#[test]
fn the_law_of_the_mechanism_is_the_closed_form_of_a_constant_pull() {
    let (strength, kappa, time, first): (f64, f64, f64, f64) = (0.75, 0.93, 6.0, 120f64.to_radians());
    let tip = cones(ended(&field_alone("rotation", 120.0, 0.0, 0.1), &roster()).world())[0];
    let half = (0.5 * first).tan() * (-kappa * strength * time).exp();
    assert!((tip.spring.heading.y.atan2(tip.spring.heading.x) - 2.0 * half.atan()).abs() < 1e-13);
}

#[test]
fn turning_the_field_and_the_heading_turns_the_path() {
    let angle = 37.0;
    for method in ["rotation", "euler", "heun", "rk4", "bogacki_shampine"] {
        let centre = Vector3::new(200.0, 200.0, 0.0);
        let plain = cones(ended(&field_alone(method, 120.0, 10.0, 0.1), &roster()).world())[0];
        let turned = cones(ended(&field_alone(method, 120.0 + angle, 10.0 + angle, 0.1), &roster()).world())[0];
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::to_radians(angle));
        let (place, heading) = (rotation * (plain.position - centre) + centre, rotation * plain.spring.heading);
        assert!((turned.position - place).norm() < 1e-11, "{method}: {}", (turned.position - place).norm());
        assert!((turned.spring.heading - heading).norm() < 1e-13, "{method}");
        assert!((plain.position - centre).norm() > 50.0, "{method}: the path must be long enough to tell");
    }
}

fn full_scene(galvanotaxis: Option<f64>) -> Value {
    let mut scene = json!({
        "seed": 3,
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": 20 },
        "time": { "duration": 4, "step": "4 min" },
        "populations": { "axons": { "count": 20, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "matrix": {},
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [100, 120], "radius": 20 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    });
    if let Some(weight) = galvanotaxis {
        scene["galvanotaxis"] = json!({ "weight": weight });
    }
    scene
}

#[test]
fn a_mechanism_of_no_strength_changes_no_bit_and_neither_does_one_left_out() {
    let hash = |scene: &Value, roster: &Roster| hash_of_states(ended(scene, roster).world());
    let without = hash(&full_scene(None), &systems::standard());
    assert_eq!(hash(&full_scene(None), &roster()), without);
    assert_eq!(hash(&full_scene(Some(0.0)), &roster()), without);
    assert_ne!(hash(&full_scene(Some(1.0)), &roster()), without);
    let left_out = try_load(&full_scene(Some(1.0)), &roster(), &["galvanotaxis"], &[]).unwrap();
    let mut simulation = tropism::simulation::Simulation::assemble(&left_out, &roster()).unwrap();
    common::to_end(&mut simulation);
    assert_eq!(hash_of_states(simulation.world()), without);
}

#[test]
fn problems_of_its_keys_stand_in_the_same_message_as_all_others() {
    let mut scene = full_scene(None);
    scene["galvanotaxis"] = json!({ "field": "50 mV", "weight": 5, "directoin": 3 });
    scene["time"]["stepp"] = json!(1);
    scene["borders"] = json!({ "range": -1 });
    let problems = try_load(&scene, &roster(), &[], &[]).unwrap_err().problems;
    let found: Vec<_> = problems.iter().map(|problem| (problem.pointer.as_str(), problem.message.as_str())).collect();
    for (pointer, words) in [
        ("/galvanotaxis/field", "electric field"),
        ("/galvanotaxis/weight", "outside what is possible: 0 ≤ weight ≤ 4"),
        ("/galvanotaxis/directoin", "did you mean `direction`?"),
        ("/time/stepp", "did you mean `step`?"),
        ("/borders/range", "outside what is possible"),
    ] {
        assert!(found.iter().any(|(at, message)| *at == pointer && message.contains(words)), "{pointer}: {found:#?}");
    }
    assert_eq!(found.len(), 5, "{found:#?}");
}

#[test]
fn its_own_check_of_the_scene_is_asked() {
    let mut scene = full_scene(Some(1.0));
    scene["time"]["duration"] = json!(2000);
    scene["borders"]["range"] = json!(-1);
    let errors = try_load(&scene, &roster(), &[], &[]).unwrap_err();
    let found: Vec<String> = errors.problems.iter().map(ToString::to_string).collect();
    assert_eq!(found.len(), 2, "beside the problems of others: {found:#?}");
    assert!(found.contains(&"/galvanotaxis/weight: no field is held for a thousand hours".to_owned()), "{found:#?}");
}

#[test]
fn a_program_of_its_own_is_one_call() {
    let folder = Folder::new();
    let path = folder.write("scene.json", &field_alone("rotation", 120.0, 0.0, 0.1).to_string());
    let out = folder.0.join("out");
    let run = |roster: Roster| {
        let arguments = ["galvanotaxis".as_ref(), path.as_os_str(), "--out".as_ref(), out.as_os_str()];
        format!("{:?}", tropism::run(arguments, roster))
    };
    assert_eq!(run(roster()), format!("{:?}", std::process::ExitCode::from(0)));
    assert!(out.join("summary.json").exists());
    assert_eq!(
        run(systems::standard()),
        format!("{:?}", std::process::ExitCode::from(2)),
        "an unknown block is refused"
    );
}

/// A law that divides by nothing.
#[derive(Debug, Default, Deserialize, JsonSchema)]
struct Boundless {}

impl Mechanism for Boundless {
    const NAME: &'static str = "boundless";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.term(Term::Turn, |mut cones: Cones| cones.for_each(|_, spring| spring.pull.x = f64::INFINITY));
        Ok(())
    }
}

#[test]
fn a_pull_that_is_not_finite_ends_the_run_with_one_and_keeps_what_there_is() {
    let folder = Folder::new();
    let mut scene = field_alone("rotation", 120.0, 0.0, 0.1);
    scene["boundless"] = json!({});
    let path = folder.write("scene.json", &scene.to_string());
    let out = folder.0.join("out");
    let arguments = ["galvanotaxis".as_ref(), path.as_os_str(), "--out".as_ref(), out.as_os_str()];
    let code = format!("{:?}", tropism::run(arguments, roster().with::<Boundless>()));
    assert_eq!(code, format!("{:?}", std::process::ExitCode::from(1)));
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["complete"], json!(false));
    let fault = summary["fault"].as_str().unwrap();
    assert!(fault.starts_with("at t = ") && fault.contains("finite") && fault.contains("pull (inf, "), "{fault}");
    assert!(out.join("trajectories.csv").exists() && out.join("figure.png").exists());
}

/// The templates of `tropism new-mechanism`, the example, and the chapter that shows them.
const LAW: &str = include_str!("../../assets/new_mechanism/mechanism.rs");
const PROGRAM: &str = include_str!("../../assets/new_mechanism/main.rs");
const EXAMPLE: &str = include_str!("../../examples/galvanotaxis/src/galvanotaxis.rs");
const CHAPTER: &str = include_str!("../../docs/src/first_mechanism.md");

#[test]
fn the_code_of_the_chapter_is_the_code_of_the_template_and_of_the_example() {
    let blocks: Vec<&str> = CHAPTER.split("```rust\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(blocks.len(), 3);
    assert_eq!(blocks[0], LAW);
    assert!(PROGRAM.starts_with(blocks[1]) && blocks[1].contains("fn main() -> ExitCode {"));
    assert!(EXAMPLE.contains(blocks[2]) && blocks[2].contains("impl Mechanism for Galvanotaxis {"));
    let others = CHAPTER.matches("```rust").count();
    assert_eq!(others, blocks.len(), "code that is not compiled");
}

#[test]
fn the_new_mechanism_and_the_example_bend_paths_and_change_no_bit_without_weight() {
    let roster = || systems::standard().with::<steady_pull::SteadyPull>().with::<example::Galvanotaxis>();
    let scenes = [
        (include_str!("../../assets/new_mechanism/scenario.json"), "steady_pull"),
        (include_str!("../../examples/galvanotaxis/scenarios/galvanotaxis.json"), "galvanotaxis"),
    ];
    for (text, name) in scenes {
        let mut scene: Value = serde_json::from_str(text).unwrap();
        scene["time"]["duration"] = json!(8);
        let run = |scene: &Value| ended(scene, &roster());
        let felt = run(&scene);
        scene[name]["weight"] = json!(0);
        let weightless = run(&scene);
        scene[name] = Value::Null;
        let absent = run(&scene);
        assert_eq!(hash_of_states(weightless.world()), hash_of_states(absent.world()), "{name}");
        let mean = |world: &World| cones(world).iter().map(|cone| cone.position.x).sum::<f64>() / 60.0;
        let drift = mean(felt.world()) - mean(absent.world());
        assert!(drift > 10.0, "{name}: {drift}");
    }
}
