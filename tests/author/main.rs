//! What the program says of itself, and what it writes for an author: the list of mechanisms, the schema, a new crate.

#[path = "../common/mod.rs"]
mod common;
mod validator;

use common::Folder;
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output};
use tropism::study::run::block_schemas;
use validator::misfits;

fn tropism(folder: &Folder, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

/// What the program prints; it must end with 0.
fn said(arguments: &[&str]) -> String {
    let output = tropism(&Folder::new(), arguments);
    assert_eq!((code(&output), String::from_utf8_lossy(&output.stderr).as_ref()), (0, ""));
    String::from_utf8(output.stdout).unwrap()
}

/// What the program answers to arguments that will not do.
fn refusal(folder: &Folder, arguments: &[&str]) -> String {
    let output = tropism(folder, arguments);
    assert_eq!((code(&output), output.stdout.as_slice()), (2, &b""[..]), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn schema() -> Value {
    serde_json::from_str(&said(&["schema"])).unwrap()
}

/// Names of the keys of a schema's `properties`, at any depth.
fn keys_of(schema: &Value, found: &mut Vec<String>) {
    match schema {
        Value::Object(keywords) => {
            found.extend(
                keywords.get("properties").and_then(Value::as_object).into_iter().flat_map(|all| all.keys().cloned()),
            );
            keywords.values().for_each(|member| keys_of(member, found));
        }
        Value::Array(entries) => entries.iter().for_each(|entry| keys_of(entry, found)),
        _ => {}
    }
}

#[test]
fn the_list_has_every_mechanism_with_an_equation_and_every_key_of_its_schema() {
    let text = said(&["mechanisms"]);
    let list: Value = serde_json::from_str(&said(&["mechanisms", "--json"])).unwrap();
    let blocks = block_schemas(&tropism::standard());
    assert!(blocks.len() > 5);
    for (block, listed) in blocks.iter().zip(list["mechanisms"].as_array().unwrap()) {
        assert_eq!(listed["name"], json!(block.name));
        assert!(text.contains(&format!("\n{}\n", block.name)) || text.starts_with(block.name));
        assert!(listed["equation"].is_string(), "{} has no equation", block.name);
        let paths: Vec<&str> =
            listed["keys"].as_array().unwrap().iter().filter_map(|key| key["key"].as_str()).collect();
        let mut keys = Vec::new();
        keys_of(&block.schema, &mut keys);
        for key in keys {
            assert!(
                paths.iter().any(|path| path.split('.').any(|part| part.trim_end_matches("[]") == key)),
                "{key}: {paths:?}"
            );
        }
        for key in listed["keys"].as_array().unwrap() {
            assert!(!key["description"].as_str().unwrap().is_empty(), "{key} is not described");
        }
    }
    assert!(text.lines().all(|line| line.chars().count() <= 120));
    assert_eq!(list["scene"]["name"], json!("scene"));
}

#[test]
fn one_mechanism_is_listed_by_its_name_and_a_slip_is_answered_with_the_nearest() {
    let text = said(&["mechanisms", "borders"]);
    let expected = "borders
  Short-range repulsion along the borders.
    L̂ += λ_b Σ_edges n_in exp(−d/ℓ_b).

  key     unit or type  possible  usual    default
  weight  1             ≥ 0       0 to 8   4
      Strength λ_b of the pull at the border. Ours.
  range   um            > 0       2 to 20  5
      Range ℓ_b over which it decays. Ours; the paper says \"short\".
";
    assert_eq!(text, expected.replace("ℓ_b).\n\n", "ℓ_b)\n\n"));
    assert!(said(&["mechanisms", "scene"]).contains("\n  time.method "));
    let answer = refusal(&Folder::new(), &["mechanisms", "bordres"]);
    assert!(answer.contains("there is no mechanism `bordres`; did you mean `borders`?"), "{answer}");
}

#[test]
fn the_schema_has_every_mechanism_and_every_reference_in_it_leads_somewhere() {
    fn check(root: &Value, schema: &Value) {
        match schema {
            Value::Object(keywords) => {
                if let Some(path) = keywords.get("$ref").and_then(Value::as_str) {
                    assert!(root.pointer(path.strip_prefix('#').unwrap()).is_some(), "{path}");
                }
                keywords.values().for_each(|member| check(root, member));
            }
            Value::Array(entries) => entries.iter().for_each(|entry| check(root, entry)),
            _ => {}
        }
    }
    let schema = schema();
    assert_eq!(schema["$schema"], json!("https://json-schema.org/draft/2020-12/schema"));
    for name in tropism::standard().names().into_iter().chain(["$schema", "base", "accuracy", "tissue", "output"]) {
        assert!(schema["properties"].get(name).is_some(), "{name}");
    }
    assert_eq!(schema["additionalProperties"], json!(false));
    check(&schema, &schema);
}

#[test]
fn every_scenario_fits_the_schema() {
    let schema = schema();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for file in std::fs::read_dir(root.join("scenarios")).unwrap() {
        let path = file.unwrap().path();
        let scene: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(misfits(&schema, &schema, &scene, ""), Vec::<String>::new(), "{}", path.display());
        count += 1;
    }
    assert!(count > 5);
}

#[test]
fn the_schema_accepts_what_loads_and_refuses_what_does_not() {
    let schema = schema();
    let fits = |scene: Value| misfits(&schema, &schema, &scene, "").is_empty();
    for scene in [
        json!({}),
        json!({ "$schema": "scene.schema.json", "base": "other.json", "accuracy": 0.01, "fasciculation": null, "matrix": {} }),
        json!({ "growth": { "turning_rate": "1.5 /h", "on_border": "stall" }, "time": { "step": null, "tolerance": "1 nm" } }),
        json!({ "base": "a.json", "tissue": { "outline": { "rectangle": { "width": 400 } } } }),
        json!({ "base": "a.json", "targets": { "bulb": { "polygon": null, "disc": { "centre": ["1 mm", 2], "radius": 3 } } } }),
        json!({ "base": "a.json", "populations": { "axons": null, "few": { "births": { "at": 0 }, "heading": "inner_normal" } } }),
        json!({ "base": "a.json", "cues": { "attractant": { "release_rate": null, "mass": "lumped" } } }),
    ] {
        assert!(fits(scene.clone()), "{scene}: {:#?}", misfits(&schema, &schema, &scene, ""));
    }
    for scene in [
        json!({ "fasiculation": {} }),
        json!({ "borders": { "rnage": 3 } }),
        json!({ "borders": { "range": 0 } }),
        json!({ "borders": { "range": true } }),
        json!({ "matrix": { "poisson_ratio": 0.5 } }),
        json!({ "time": { "method": "eulre" } }),
        json!({ "seed": -1 }),
        json!({ "seed": "one" }),
        json!({ "growth": [] }),
        json!({ "targets": { "bulb": { "square": {} } } }),
        json!({ "cues": { "attractant": { "sources": [] } } }),
        json!({ "cues": { "attractant": { "sources": [{ "disc": { "centre": [1], "radius": 3 } }] } } }),
    ] {
        assert!(!fits(scene.clone()), "{scene}");
    }
}

#[test]
fn a_scene_may_name_its_schema_and_its_results_do_not_depend_on_it() {
    let folder = Folder::new();
    let scene = |schema: &str| {
        format!(
            "{{ {schema} \"name\": \"x\", \"time\": {{ \"duration\": 0.1 }}, \"output\": {{ \"figure_times\": [] }} }}"
        )
    };
    folder.write("with.json", &scene("\"$schema\": \"scene.schema.json\","));
    folder.write("without.json", &scene(""));
    let manifest = |name: &str| {
        let output = tropism(&folder, &[&format!("{name}.json"), "--out", name]);
        assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.0.join(name).join("manifest.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["scenario"].clone()
    };
    assert_eq!(manifest("with"), manifest("without"));
}

#[test]
fn a_new_mechanism_is_written_whole_under_its_own_name() {
    let folder = Folder::new();
    let output = tropism(&folder, &["new-mechanism", "chemical_wind", "--path", "deeper"]);
    assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let root = folder.0.join("deeper/chemical_wind");
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    for file in [
        "Cargo.toml",
        "Cargo.lock",
        "README.md",
        "rustfmt.toml",
        ".cargo/config.toml",
        "src/main.rs",
        "src/chemical_wind.rs",
        "scenarios/chemical_wind.json",
    ] {
        let text = std::fs::read_to_string(root.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(words.contains(file), "{file}: {words}");
        for placeholder in ["steady_pull", "SteadyPull", "TROPISM", "TARGET", "PROFILES"] {
            assert!(!text.contains(placeholder), "{file}: {placeholder}");
        }
    }
    assert!(
        words.contains(env!("CARGO_MANIFEST_DIR"))
            && words.contains("cargo run --release -- scenarios/chemical_wind.json")
    );
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).unwrap();
    assert!(manifest.contains("name = \"chemical_wind\"") && manifest.contains("[profile.release.package]"));
    assert!(manifest.contains(&format!("tropism = {{ path = \"{}\" }}", env!("CARGO_MANIFEST_DIR"))), "{manifest}");
    let law = std::fs::read_to_string(root.join("src/chemical_wind.rs")).unwrap();
    assert!(law.contains("pub struct ChemicalWind {") && law.contains("NAME: &'static str = \"chemical_wind\";"));
}

#[test]
fn a_program_that_lies_far_from_its_sources_finds_those_above_the_folder_or_asks_for_them() {
    let folder = Folder::new();
    let program = folder.0.join("tropism");
    std::fs::copy(env!("CARGO_BIN_EXE_tropism"), &program).unwrap();
    let run = |at: &Path, more: &[&str]| {
        let parent = folder.0.to_str().unwrap();
        let arguments = [&["new-mechanism", "wind", "--path", parent], more].concat();
        Command::new(&program).current_dir(at).args(arguments).output().unwrap()
    };
    let lost = run(&folder.0, &[]);
    let words = String::from_utf8_lossy(&lost.stderr).into_owned();
    assert_eq!(code(&lost), 2, "{words}");
    assert!(words.contains("name them by --tropism PATH"), "{words}");
    assert!(!folder.0.join("wind").exists());
    let sources = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (at, more) in
        [(sources.join("src/model"), vec![]), (folder.0.clone(), vec!["--tropism", sources.to_str().unwrap()])]
    {
        let found = run(&at, &more);
        assert_eq!(code(&found), 0, "{}", String::from_utf8_lossy(&found.stderr));
        std::fs::remove_dir_all(folder.0.join("wind")).unwrap();
    }
}

#[test]
fn a_bad_name_and_a_folder_in_the_way_are_refused_and_nothing_is_written() {
    let folder = Folder::new();
    for (name, words) in [
        ("Wind", "small letters"),
        ("match", "keyword"),
        ("borders", "key of scenes already"),
        ("tissue", "key of scenes already"),
        ("angle", "another meaning"),
        ("../wind", "small letters"),
    ] {
        let answer = refusal(&folder, &["new-mechanism", name]);
        assert!(answer.contains(words), "{name}: {answer}");
    }
    assert!(refusal(&folder, &["new-mechanism", "wind", "--tropism", "."]).contains("has no Cargo.toml"));
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 0);
    std::fs::create_dir(folder.0.join("wind")).unwrap();
    folder.write("wind/mine.txt", "mine");
    assert!(refusal(&folder, &["new-mechanism", "wind"]).contains("exists already"));
    assert_eq!(std::fs::read_dir(folder.0.join("wind")).unwrap().count(), 1);
}

/// The tables of profiles must be those of the program, else everything is compiled twice.
#[test]
fn the_example_has_the_profiles_and_the_versions_of_the_program() {
    let profiles = |manifest: &str| -> Vec<String> {
        let lines = manifest.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        lines
            .skip_while(|line| !line.starts_with("[profile"))
            .take_while(|line| !line.starts_with("[lints"))
            .map(str::to_owned)
            .collect()
    };
    let own = include_str!("../../Cargo.toml");
    assert_eq!(profiles(include_str!("../../examples/galvanotaxis/Cargo.toml")), profiles(own));
    let example = include_str!("../../examples/galvanotaxis/Cargo.lock");
    // What a package depends on may differ by the features that are on; its version may not.
    fn versions(lock: &str) -> impl Iterator<Item = &str> {
        lock.split("\n[[package]]\n").skip(1).map(|text| text.split("\ndependencies").next().unwrap().trim())
    }
    let packages: Vec<&str> = versions(include_str!("../../Cargo.lock")).collect();
    let own = ["name = \"galvanotaxis\"", "name = \"tropism\""];
    for package in versions(example).filter(|text| !own.iter().any(|name| text.starts_with(name))) {
        assert!(packages.contains(&package), "copy Cargo.lock to examples/galvanotaxis and build there:\n{package}");
    }
}
