//! A bad scene is refused with every problem at once, each in words that can be acted on. The mechanisms here are written as an outside
//! crate would write them: with the prelude alone.

use std::collections::BTreeMap;
use std::path::PathBuf;

use tropism::model::mechanism::Facts;
use tropism::prelude::*;
use tropism::scenario::load::{Loaded, Request, ScenarioErrors, load, read_value};
use tropism::scenario::schema::{BlockFindings, BlockSchema, full_schema};

quantity! {
    /// A force per length of membrane.
    Tension, "tension", "nN/um"
}

keys! {
    /// A mechanism of an outside crate.
    pub struct Galvanotaxis {
        /// The field.
        #[schemars(extend("x-typical" = [10.0, 200.0]))]
        pub field: ElectricField = ElectricField(100.0),
        /// The weight of the pull.
        #[schemars(extend("minimum" = 0.0))]
        pub weight: Factor = Factor(1.0),
        /// Poisson's ratio, to have a range closed on one side.
        #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 0.5))]
        pub poisson: Factor = Factor(0.3),
        /// The tension, if there is one.
        pub tension: Option<Tension> = None,
        /// A law with its own keys.
        pub law: Law = Law::Linear,
        /// Electrodes by name.
        pub electrodes: BTreeMap<String, Electrode> = BTreeMap::new(),
    }

    /// An electrode.
    pub struct Electrode {
        /// Its place.
        pub at: Point = [Length(0.0), Length(0.0)],
        /// Whether it attracts.
        pub attracts: bool = true,
    }
}

/// How the pull depends on the field.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields, crate = "tropism::prelude::serde")]
#[schemars(crate = "tropism::prelude::schemars")]
pub enum Law {
    /// In proportion.
    Linear,
    /// Saturating at a field.
    Saturating {
        /// That field.
        at: ElectricField,
    },
}

fn check_galvanotaxis(value: &serde_json::Value, _facts: &Facts) -> BlockFindings {
    let mut violations = Violations::new();
    match read_value::<Galvanotaxis>("", value) {
        Ok(block) => {
            violations.demand(block.weight.0 < 9.0 || block.electrodes.is_empty(), "/weight", || {
                "a weight of 9 or more leaves no room for electrodes".to_owned()
            });
        }
        Err(problem) => violations = problem.into(),
    }
    BlockFindings { violations, shapes: Vec::new() }
}

fn blocks() -> Vec<BlockSchema> {
    let schema = schemars::schema_for!(Galvanotaxis).to_value();
    vec![BlockSchema::new("galvanotaxis", schema).checked_by(check_galvanotaxis)]
}

/// A directory of scene files that goes when dropped.
struct Scenes(PathBuf);

impl Scenes {
    fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let directory = std::env::temp_dir().join(format!("tropism-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&directory).unwrap();
        for (file, text) in files {
            std::fs::write(directory.join(file), text).unwrap();
        }
        Self(directory)
    }

    fn load(&self, file: &str, without: &[&str], set: &[&str]) -> Result<Loaded, ScenarioErrors> {
        let owned = |texts: &[&str]| texts.iter().map(|&text| text.to_owned()).collect();
        load(&Request { path: self.0.join(file), without: owned(without), set: owned(set) }, &blocks())
    }

    /// The problems as text, the directory left out.
    fn problems(&self, file: &str, set: &[&str]) -> Vec<String> {
        let errors = self.load(file, &[], set).unwrap_err();
        let prefix = format!("{}/", self.0.display());
        errors.problems.iter().map(|problem| problem.to_string().replace(&prefix, "")).collect()
    }
}

impl Drop for Scenes {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn each_bad_value_gets_its_own_sentence() {
    let cases = [
        (
            r#"{"growth": {"turning_rate": 1e308}}"#,
            "/growth/turning_rate: 1e308 /h is no number of a model: 0, or 1e-30 to 1e30 /h in size",
        ),
        (
            r#"{"tissue": {"mesh_size": 1e-200}}"#,
            "/tissue/mesh_size: 1e-200 um is no number of a model: 0, or 1e-30 to 1e30 um in size",
        ),
        (
            r#"{"time": {"method": "bogacki_shampine", "tolerance": 1e-20}}"#,
            "/time/tolerance: 1e-20 um is outside what is possible: tolerance ≥ 1e-12 um",
        ),
        (
            r#"{"name": "a\u0007b"}"#,
            "/name: \"a\\u{7}b…\" is no name: at most 100 signs, none of them a control sign such as a line's end",
        ),
        (
            r#"{"targets": {"a\u0007b": {"disc": {"centre": [10, 10], "radius": 5}}}}"#,
            "/targets/a\\u{7}b: \"a\\u{7}b…\" is no name: at most 100 signs, none of them a control sign such as a line's end",
        ),
        (
            r#"{"time": {"stepp": 1}}"#,
            "/time/stepp: unknown key; did you mean `step`? (keys here: duration, step, method, tolerance)",
        ),
        (
            r#"{"populations": {"a": {"speed": "20 um"}}}"#,
            r#"/populations/a/speed: "20 um" is a length; a speed such as 20 or "20 um/h" belongs here"#,
        ),
        (
            r#"{"populations": {"a": {"speed": true}}}"#,
            r#"/populations/a/speed: true is not a speed; a speed such as 20 or "20 um/h" belongs here"#,
        ),
        (
            r#"{"populations": {"a": {"speed": "-1 um/min"}}}"#,
            r#"/populations/a/speed: "-1 um/min" is outside what is possible: speed ≥ 0 um/h"#,
        ),
        (
            r#"{"galvanotaxis": {"poisson": 0.6}}"#,
            "/galvanotaxis/poisson: 0.6 is outside what is possible: 0 ≤ poisson < 0.5",
        ),
        (
            r#"{"galvanotaxis": {"poisson": 0.5}}"#,
            "/galvanotaxis/poisson: 0.5 is outside what is possible: 0 ≤ poisson < 0.5",
        ),
        (
            r#"{"galvanotaxis": {"tension": "1 um"}}"#,
            r#"/galvanotaxis/tension: "1 um" is a length; a tension such as 1 or "1 nN/um" belongs here"#,
        ),
        (
            r#"{"galvanotaxis": {"law": "liner"}}"#,
            r#"/galvanotaxis/law: "liner" is not allowed here; did you mean "linear"? (allowed: "linear", {"saturating": …})"#,
        ),
        (
            r#"{"galvanotaxis": {"law": {"saturatin": {"at": 1}}}}"#,
            r#"/galvanotaxis/law: {"saturatin":{"at":1}} is not allowed here; did you mean "saturating"? (allowed: "linear", {"saturating": …})"#,
        ),
        (
            r#"{"galvanotaxis": {"law": {"saturating": {"att": 1}}}}"#,
            "/galvanotaxis/law/saturating/att: unknown key; did you mean `at`? (keys here: at)\n\
             /galvanotaxis/law/saturating: the key `at` is missing: an electric field such as 1 or \"1 V/m\"",
        ),
        (
            r#"{"galvanotaxis": {"electrodes": {"e": {"at": [1, 2, 3], "attracts": 1}}}}"#,
            "/galvanotaxis/electrodes/e/at: 3 entries where exactly 2 belong\n\
             /galvanotaxis/electrodes/e/attracts: 1 is not true or false",
        ),
        (
            r#"{"galvanotaxis": []}"#,
            "/galvanotaxis: [] is not an object with the keys field, weight, poisson, tension, law, electrodes",
        ),
        (
            r#"{"galvanotaxs": {}}"#,
            "/galvanotaxs: unknown key; did you mean `galvanotaxis`? (keys here: $schema, base, name, description, parameters, seed, accuracy, space, tissue, time, growth, \
             populations, targets, output, galvanotaxis)",
        ),
        (
            r#"{"galvanotaxs": null}"#,
            "/galvanotaxs: unknown key; did you mean `galvanotaxis`? (keys here: $schema, base, name, description, parameters, seed, accuracy, space, tissue, time, growth, \
             populations, targets, output, galvanotaxis)",
        ),
        (r#"{"seed": -1}"#, "/seed: -1 is outside what is possible: seed ≥ 0"),
        (
            r#"{"seed": 1.5}"#,
            "/seed: 1.5 is not a whole number from 0 to 18446744073709551615, written without point or exponent",
        ),
        (
            r#"{"seed": 18446744073709551616}"#,
            "/seed: 1.8446744073709552e+19 is not a whole number from 0 to 18446744073709551615, written without point or exponent",
        ),
        (r#"{"name": "../x"}"#, r#"/name: "../x" cannot be the name of a directory of results"#),
        (r#"{"base": 3}"#, "/base: 3 is not a text"),
        (r#"{"space": "solid"}"#, r#"/space: "solid" is not allowed here (allowed: "planar")"#),
        (
            r#"{"time": {"method": "euller"}}"#,
            r#"/time/method: "euller" is not allowed here; did you mean "euler"? (allowed: "rotation", "euler", "heun", "rk4", "bogacki_shampine")"#,
        ),
        (
            r#"{"time": {"tolerance": 1e-3}}"#,
            r#"/time/tolerance: only the method "bogacki_shampine" chooses its steps by a tolerance; leave the key out or set the method"#,
        ),
        (
            r#"{"time": {"method": "bogacki_shampine", "tolerance": 0}}"#,
            "/time/tolerance: 0 um is outside what is possible: tolerance ≥ 1e-12 um",
        ),
        (
            r#"{"populations": {"a": {"heading": "inner_norml"}}}"#,
            r#"/populations/a/heading: "inner_norml" is not allowed here; did you mean "inner_normal"? (allowed: "inner_normal", "random", an angle such as 1 or "1 deg")"#,
        ),
        (
            r#"{"populations": {"a": {"heading": "3 um"}}}"#,
            r#"/populations/a/heading: "3 um" is a length; an angle such as 3 or "3 deg" belongs here"#,
        ),
        (
            r#"{"populations": {"a": {"births": {"uniform": {"from": 3}}}}}"#,
            r#"/populations/a/births/uniform: the key `to` is missing: a time such as 1 or "1 h""#,
        ),
        (
            r#"{"populations": {"a": {"births": {"uniform": {"from": 30, "to": "18 h"}}}}}"#,
            "/populations/a/births: from 30 h to 18 h runs backwards",
        ),
        (
            r#"{"populations": {"a": {"births": {"at": "3 d"}}}}"#,
            "/populations/a/births: the first birth, at 72 h, is not before the end, 72 h",
        ),
        (
            r#"{"populations": {"a": {"origin": {"edge": "botom"}}}}"#,
            r#"/populations/a/origin/edge: the outline has no edge "botom"; did you mean "bottom"? (edges: bottom, right, top, left)"#,
        ),
        (
            r#"{"populations": {"a": {"origin": {"edge": {"name": "top", "from": 0.5, "to": "120 %"}}}}}"#,
            r#"/populations/a/origin/edge/to: "120 %" is outside what is possible: 0 ≤ to ≤ 1"#,
        ),
        (
            r#"{"populations": {"a": {"origin": {"points": [[1, 1], [-1, 4]]}}}}"#,
            "/populations/a/origin/points/1: [-1, 4] lies outside the tissue\n\
             /populations/a/heading: points have no inner normal; give an angle such as 90, or \"random\"",
        ),
        (
            r#"{"populations": {"a": {"origin": {"points": [], "edge": "top"}}}}"#,
            "/populations/a/origin: only one of edge, points can stand here",
        ),
        (
            r#"{"populations": {"a": {"origin": {"points": []}}}}"#,
            "/populations/a/origin/points: 0 entries where at least 1 belong",
        ),
        (
            r#"{"targets": {"t": {"disc": {"centre": [9000, 0], "radius": 50}}}}"#,
            "/targets/t: the target lies outside the tissue, or partly so",
        ),
        (
            r#"{"targets": {"t": {"disc": {"centre": [400, 0], "raduis": 50}}}}"#,
            "/targets/t/disc/raduis: unknown key; did you mean `radius`? (keys here: centre, radius)\n\
             /targets/t/disc: the key `radius` is missing: a length such as 1 or \"1 um\"",
        ),
        (r#"{"output": {"heights": [0.5, 1.5]}}"#, "/output/heights/1: 1.5 is outside what is possible: 0 ≤ value ≤ 1"),
        (
            r#"{"tissue": {"min_angle": 40}}"#,
            "/tissue/min_angle: 40 deg is outside what is possible: 0 < min_angle ≤ 33 deg",
        ),
        (
            r#"{"tissue": {"mesh_size": "10 nm"}}"#,
            "/tissue/mesh_size: triangles of 0.01 um would need about 5.5e9 vertices; max_vertices is 1000000",
        ),
        (
            r#"{"tissue": {"outline": {"polygon": {"outer": {"points": [[0,0],[9,0],[9,9]], "edges": ["a"]}}}}}"#,
            "/tissue/outline/polygon/outer/edges: 1 names for 3 sides; each side takes one\n\
             /populations/axons/origin/edge: the outline has no edge \"bottom\" (edges: a)",
        ),
        (r#"{"time": {"step": "80 h"}}"#, "/time/step: 80 h is longer than the duration, 72 h"),
        (
            r#"{"time": {"step": 1e-12}}"#,
            "/time/step: 7.2e13 steps of 1e-12 h fill the duration of 72 h; at most 1e9 are run",
        ),
        (r#"{"time": {"step": 0}}"#, "/time/step: 0 h is outside what is possible: step > 0 h"),
        (r#"[1]"#, "case.json: a scene is a JSON object, not [1]"),
        ("{\"seed\": 1,\n}", "case.json: not JSON: trailing comma at line 2 column 1"),
        (r#"{"seed": 1, "time": {"step": 1, "step": 2}}"#, "case.json: given more than once: /time/step"),
        (
            r#"{"galvanotaxis": {"weight": 9, "electrodes": {"e": {}}}}"#,
            "/galvanotaxis/weight: a weight of 9 or more leaves no room for electrodes",
        ),
    ];
    let mut wrong = Vec::new();
    for (text, expected) in cases {
        let scenes = Scenes::new("case", &[("case.json", text)]);
        let seen = scenes.problems("case.json", &[]).join("\n");
        if seen != expected {
            wrong.push(format!("{text}\n  seen: {seen}\n  expected: {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn five_errors_are_five_problems_and_the_sixth_is_semantic() {
    let text = r#"{
        "time": { "stepp": 1, "duration": "72" },
        "growth": { "turning_rate": "0.9 h" },
        "galvanotaxis": { "poisson": 0.6, "fields": 3 },
        "populations": { "a": { "origin": { "edge": "east" } } }
    }"#;
    let scenes = Scenes::new("five", &[("five.json", text)]);
    let errors = scenes.load("five.json", &[], &[]).unwrap_err();
    let expected = format!(
        "{}: 6 problems
  1. /time/stepp: unknown key; did you mean `step`? (keys here: duration, step, method, tolerance)
  2. /time/duration: \"72\" has no unit; a time such as 72 or \"72 h\" belongs here
  3. /growth/turning_rate: \"0.9 h\" is a time; a rate such as 0.9 or \"0.9 /h\" belongs here
  4. /galvanotaxis/poisson: 0.6 is outside what is possible: 0 ≤ poisson < 0.5
  5. /galvanotaxis/fields: unknown key; did you mean `field`? (keys here: field, weight, poisson, tension, law, electrodes)
  6. /populations/a/origin/edge: the outline has no edge \"east\" (edges: bottom, right, top, left)",
        scenes.0.join("five.json").display()
    );
    assert_eq!(errors.to_string(), expected);
}

#[test]
fn bases_merge_from_the_last_and_overrides_come_after() {
    let scenes = Scenes::new(
        "bases",
        &[
            (
                "root.json",
                r#"{"name": "root", "seed": 7, "galvanotaxis": {"field": "2 V/cm", "weight": 2}, "time": {"step": "30 s"}}"#,
            ),
            (
                "middle.json",
                r#"{"base": "root.json", "description": "m", "galvanotaxis": {"weight": null, "poisson": 0.1}}"#,
            ),
            (
                "top.json",
                r#"{"base": "middle.json", "targets": {"t": {"disc": {"centre": ["0.4 mm", 540], "radius": 50}}}}"#,
            ),
        ],
    );
    let loaded = scenes.load("top.json", &[], &["/time/duration=1 d", "/populations/axons/count=50"]).unwrap();
    assert_eq!((loaded.scene.name.as_str(), loaded.scene.description.as_str(), loaded.scene.seed), ("top", "", 7));
    assert_eq!((loaded.scene.time.step, loaded.scene.time.duration), (Time(30.0 / 3600.0), Time(24.0)));
    assert_eq!(loaded.scene.populations["axons"].count, 50);
    let Shape::Disc { centre, .. } = &loaded.scene.targets["t"] else { panic!("a disc") };
    assert_eq!(centre, &[Length(400.0), Length(540.0)]);
    let block: Galvanotaxis = read_value("/galvanotaxis", &loaded.blocks["galvanotaxis"]).unwrap();
    assert_eq!((block.field, block.weight, block.poisson), (ElectricField(200.0), Factor(1.0), Factor(0.1)));
    assert!(loaded.hints.is_empty(), "{:?}", loaded.hints);

    let ablated = scenes.load("top.json", &["galvanotaxis"], &[]).unwrap();
    assert!(ablated.blocks.is_empty());
    assert!(
        scenes.load("top.json", &["galvano"], &[]).unwrap_err().to_string().contains("did you mean `galvanotaxis`?")
    );

    std::fs::write(scenes.0.join("again.json"), loaded.merged.to_string()).unwrap();
    let again = scenes.load("again.json", &[], &[]).unwrap();
    assert_eq!(again.merged, loaded.merged);
    assert_eq!(format!("{:?}", again.scene), format!("{:?}", loaded.scene));
}

#[test]
fn a_problem_names_the_file_or_the_override_it_comes_from() {
    let scenes = Scenes::new(
        "origin",
        &[
            ("base.json", r#"{"seed": "x", "time": {"step": "a"}}"#),
            ("top.json", r#"{"base": "base.json", "time": {"method": 3}}"#),
            ("loop.json", r#"{"base": "pool.json"}"#),
            ("pool.json", r#"{"base": "loop.json"}"#),
            ("orphan.json", r#"{"base": "gone.json"}"#),
            ("outside.json", r#"{"base": "../base.json"}"#),
            ("elsewhere.json", r#"{"base": "/etc/hostname"}"#),
        ],
    );
    let expected = [
        "--set time/step=1: `time/step` is not a JSON pointer; did you mean `/time/step`?",
        "/seed: \"x\" is not a whole number (in base.json)",
        "/time/step: `a` does not begin with a number (in base.json)",
        r#"/time/method: 3 is not allowed here (allowed: "rotation", "euler", "heun", "rk4", "bogacki_shampine")"#,
        "/growth: 3 is not an object with the keys turning_rate, filopodium_length, filopodia_time, heading_follows, on_border (from --set)",
    ];
    assert_eq!(scenes.problems("top.json", &["/growth=3", "time/step=1"]), expected);
    assert_eq!(scenes.problems("loop.json", &[]), ["/base: (in pool.json) loop.json is a base of itself"]);
    assert_eq!(scenes.problems("orphan.json", &[]), ["/base: (in orphan.json) gone.json: no such file"]);
    let set = scenes.problems("top.json", &["/base=\"base.json\""]);
    assert!(set.iter().any(|problem| problem.starts_with("/base: a base stands in a file")), "{set:?}");
    for (name, base) in [("outside.json", "../base.json"), ("elsewhere.json", "/etc/hostname")] {
        let [problem] = scenes.problems(name, &[]).try_into().unwrap();
        let refused = format!("/base: (in {name}) \"{base}\" is not the name of a file in the folder of the scenario");
        assert!(problem.starts_with(&refused), "{problem}");
    }
    assert_eq!(scenes.problems("absent.json", &[]), ["absent.json: no such file"]);
}

#[test]
fn what_is_unusual_is_a_hint_and_null_means_absent() {
    let text = r#"{"galvanotaxis": null, "populations": {"a": {"speed": "2 um/min", "births": null}}, "tissue": {"outline": null}}"#;
    let scenes =
        Scenes::new("hints", &[("a.json", text), ("b.json", r#"{"base": "a.json", "growth": null, "seed": null}"#)]);
    let loaded = scenes.load("b.json", &[], &[]).unwrap();
    assert!(loaded.blocks.is_empty());
    let hints: Vec<String> = loaded.hints.iter().map(ToString::to_string).collect();
    let expected = [
        "/growth: null removes nothing: the base does not set this key",
        "/seed: null removes nothing: the base does not set this key",
        "/populations/a/speed: \"2 um/min\" is outside what is usual: 3 to 50 um/h",
    ];
    assert_eq!(hints, expected);
}

#[test]
fn the_defaults_of_every_key_pass_their_own_schema_and_checks() {
    let scenes = Scenes::new("defaults", &[("empty.json", "{}")]);
    let loaded = scenes.load("empty.json", &[], &[]).unwrap();
    assert!(loaded.hints.is_empty(), "{:?}", loaded.hints);
    let mut all = serde_json::to_value(&loaded.scene).unwrap();
    all["galvanotaxis"] = serde_json::to_value(Galvanotaxis::default()).unwrap();
    std::fs::write(scenes.0.join("all.json"), all.to_string()).unwrap();
    let again = scenes.load("all.json", &[], &[]).unwrap();
    assert_eq!(
        format!("{:?}", again.scene),
        format!("{:?}", tropism::scenario::scene::Scene { name: "empty".to_owned(), ..loaded.scene })
    );
}

#[test]
fn the_schema_of_a_scene_describes_every_key() {
    fn undocumented(path: &str, schema: &serde_json::Value, found: &mut Vec<String>) {
        for (key, property) in schema["properties"].as_object().into_iter().flatten() {
            if property.get("description").is_none()
                && property.get("$ref").is_none()
                && property.get("anyOf").is_none()
            {
                found.push(format!("{path}/{key}"));
            }
        }
    }
    let schema = full_schema(&blocks());
    let mut found = Vec::new();
    undocumented("", &schema, &mut found);
    for (name, definition) in schema["$defs"].as_object().unwrap() {
        undocumented(name, definition, &mut found);
    }
    assert!(found.is_empty(), "{found:?}");
    assert_eq!(schema["properties"]["galvanotaxis"]["anyOf"][0]["$ref"], "#/$defs/galvanotaxis");
    assert_eq!(schema["$defs"]["TimeKeys"]["properties"]["step"]["x-unit"], "h");
}

#[test]
fn no_depth_and_no_nonsense_crashes_the_loader() {
    let deep_array = "[".repeat(200_000);
    let deep_object = format!("{}1{}", "{\"populations\":".repeat(120), "}".repeat(120));
    for text in [
        deep_array.as_str(),
        deep_object.as_str(),
        "",
        "\u{0}",
        "{\"\": null, \"/\": {\"~\": []}}",
        "{\"populations\": {\"\": {}}}",
    ] {
        let scenes = Scenes::new("deep", &[("deep.json", text)]);
        let _ = scenes.load("deep.json", &[], &["/=1", "/targets/x/polygon/points/0/0=1", "/a/b/c=[[[[]]]]"]).map(drop);
    }
    let scenes = Scenes::new("deep-set", &[("a.json", "{}")]);
    let deep = format!("{}=1", "/populations".repeat(10_000));
    assert!(scenes.load("a.json", &[], &[&deep]).is_err());
}
