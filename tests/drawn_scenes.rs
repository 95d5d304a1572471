//! Scenes drawn from the schema that the program prints: each runs with finite results, or is refused with a place and a reason.
//!
//! Draws are keyed by their number, so that a case that fails is found again by it.

mod common;

use common::cones;
use serde_json::{Map, Value, json};
use tropism::model::random::{KeyedRng, Stream};
use tropism::scenario::editor_schema::editor_schema;
use tropism::simulation::{AssemblyError, Simulation};
use tropism::study::run::{block_schemas, read_document};
use tropism::systems::standard;

/// Scenes that are drawn.
const SCENES: u64 = 100;
/// Steps taken of each that is accepted.
const STEPS: usize = 6;
/// Objects inside objects.
const DEEPEST: usize = 9;

/// Draws values by a schema.
struct Drawing<'a> {
    root: &'a Value,
    random: KeyedRng,
    /// Whether numbers are sometimes what they cannot be.
    is_wild: bool,
}

impl Drawing<'_> {
    fn chance(&mut self, share: f64) -> bool {
        self.random.share() < share
    }

    fn among<T: Clone>(&mut self, of: &[T]) -> T {
        let place = (self.random.share() * of.len() as f64) as usize;
        of[place.min(of.len() - 1)].clone()
    }

    /// A value by a schema; `key` is where it stands, by which names are chosen.
    fn value(&mut self, schema: &Value, key: &str, depth: usize) -> Value {
        let schema = self.resolved(schema);
        if let Some(value) = schema.get("const") {
            return value.clone();
        }
        if let Some(words) = schema["enum"].as_array() {
            return self.among(words);
        }
        for choice in ["anyOf", "oneOf"] {
            if let Some(branches) = schema[choice].as_array() {
                let real: Vec<Value> = branches.iter().filter(|branch| branch["type"] != "null").cloned().collect();
                let branch = if real.is_empty() { Value::Null } else { self.among(&real) };
                return self.value(&branch, key, depth);
            }
        }
        let kinds: Vec<&str> = match &schema["type"] {
            Value::String(kind) => vec![kind],
            Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).filter(|kind| *kind != "null").collect(),
            _ => vec!["null"],
        };
        match kinds[0] {
            "number" | "integer" => self.number(&schema, kinds.contains(&"string"), kinds[0] == "integer"),
            "boolean" => Value::Bool(self.chance(0.5)),
            "string" => Value::String(self.name(key)),
            "array" => self.list(&schema, key, depth),
            "object" => self.object(&schema, key, depth),
            _ => Value::Null,
        }
    }

    /// The schema behind a reference, with what stands beside the reference.
    fn resolved(&self, schema: &Value) -> Value {
        let Some(name) = schema["$ref"].as_str().and_then(|place| place.strip_prefix("#/$defs/")) else {
            return schema.clone();
        };
        let mut found = self.root["$defs"][name].clone();
        for (key, value) in schema.as_object().into_iter().flatten().filter(|(key, _)| *key != "$ref") {
            found[key] = value.clone();
        }
        found
    }

    fn number(&mut self, schema: &Value, is_quantity: bool, is_whole: bool) -> Value {
        let bound = |names: [&str; 2]| names.iter().find_map(|name| schema[*name].as_f64());
        let usual = schema["x-typical"].as_array().and_then(|range| Some([range[0].as_f64()?, range[1].as_f64()?]));
        let [low, high] = usual.unwrap_or_else(|| {
            let low = bound(["minimum", "exclusiveMinimum"]).unwrap_or(0.0);
            [low, bound(["maximum", "exclusiveMaximum"]).unwrap_or(low + 100.0).min(low + 1e6)]
        });
        let value = low + (high - low) * self.random.share();
        if self.is_wild && self.chance(0.05) {
            return self.among(&[json!(0), json!(-1), json!(1e300), json!(1e-300), json!("many"), json!([])]);
        }
        match (is_whole, is_quantity && self.chance(0.1)) {
            (true, _) => json!(value.round().clamp(0.0, 50.0) as u64),
            (false, true) => json!(format!("{value} {}", schema["x-unit"].as_str().unwrap_or("1"))),
            (false, false) => json!(value),
        }
    }

    /// A name that may mean something where it stands.
    fn name(&mut self, key: &str) -> String {
        let names: &[&str] = match key {
            "motion" | "edge" | "edges" | "source_edges" => &["bottom", "top", "left", "right"],
            "populations" | "population" | "adhesion" => &["axons"],
            "targets" | "target" => &["goal"],
            "cues" | "cue" | "receptors" | "silences" => &["attractant", "repellent"],
            _ => &["attractant", "axons", "bottom", "goal", "band", "no such name"],
        };
        self.among(names).to_owned()
    }

    fn list(&mut self, schema: &Value, key: &str, depth: usize) -> Value {
        let least = schema["minItems"].as_u64().unwrap_or(1);
        let most = schema["maxItems"].as_u64().unwrap_or(least + 3).min(least + 3);
        let count = least + (self.random.share() * (most - least + 1) as f64) as u64;
        (0..count).map(|_| self.value(&schema["items"], key, depth + 1)).collect()
    }

    fn object(&mut self, schema: &Value, key: &str, depth: usize) -> Value {
        let mut found = Map::new();
        let required: Vec<&str> =
            schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let properties: Vec<_> = schema["properties"].as_object().into_iter().flatten().collect();
        // Small objects such as shapes are mostly whole, large ones mostly defaults.
        let share = if depth > 0 && properties.len() <= 3 { 0.85 } else { 0.3 };
        for (name, inner) in properties.into_iter().filter(|(_, inner)| inner["type"] != "null") {
            let is_wanted = depth < DEEPEST && self.chance(share);
            if is_wanted || required.contains(&name.as_str()) {
                found.insert(name.clone(), self.value(inner, name, depth + 1));
            }
        }
        if schema["additionalProperties"].is_object() && depth < DEEPEST {
            for _ in 0..1 + usize::from(self.chance(0.4)) {
                let name = self.name(key);
                found.insert(name, self.value(&schema["additionalProperties"], key, depth + 1));
            }
        }
        Value::Object(found)
    }
}

/// A drawn scene in which what costs time is small.
fn scene(root: &Value, number: u64) -> Value {
    let random = KeyedRng::new(number, 0, Stream::named("drawn scenes"), 0);
    let mut drawing = Drawing { root, random, is_wild: number.is_multiple_of(3) };
    let mut scene = drawing.value(root, "", 0);
    for key in ["$schema", "base", "accuracy", "parameters", "output"] {
        scene.as_object_mut().map(|scene| scene.remove(key));
    }
    if drawing.chance(0.3) {
        scene["tissue"]["max_vertices"] = json!(600);
    } else {
        scene["tissue"] = json!({ "outline": { "rectangle": { "width": 160, "height": 120 } }, "mesh_size": 20 });
    }
    if drawing.chance(0.7) {
        scene["time"] = json!({ "duration": 2, "step": "6 min" });
    }
    for (_, population) in scene["populations"].as_object_mut().into_iter().flatten() {
        population["count"] = json!(6);
    }
    if scene["populations"].is_null() {
        scene["populations"] = json!({ "axons": { "count": 6, "births": { "at": 0 } } });
    }
    scene
}

/// What became of a scene, and the first place at which it was refused; panics where it is neither run nor refused with a reason.
fn outcome(scene: Value, number: u64) -> (&'static str, String) {
    let roster = standard();
    let loaded = match read_document("drawn", scene, &roster) {
        Ok(loaded) => loaded,
        Err(refused) => {
            assert!(!refused.problems.is_empty(), "scene {number} is refused without a problem");
            let has_place =
                refused.problems.iter().all(|problem| problem.pointer.is_empty() || problem.pointer.starts_with('/'));
            assert!(has_place, "scene {number}: {refused}");
            return ("refused", refused.problems[0].pointer.clone());
        }
    };
    let mut simulation = match Simulation::assemble(&loaded, &roster) {
        Ok(simulation) => simulation,
        Err(AssemblyError::Scenario(problems)) => {
            assert!(!problems.is_empty(), "scene {number} is refused without a problem");
            return ("refused in assembly", problems[0].pointer.clone());
        }
        Err(AssemblyError::Solve(account) | AssemblyError::NoRoom(account)) => {
            assert!(!account.is_empty(), "scene {number} cannot be solved, for no reason");
            return ("not solved", String::new());
        }
    };
    for _ in 0..STEPS {
        if simulation.is_over() {
            break;
        }
        if let Err(fault) = simulation.step() {
            assert!(!fault.to_string().is_empty(), "scene {number} ends for no reason");
            return ("ended by a fault", String::new());
        }
    }
    for cone in cones(simulation.world()) {
        let is_finite = cone.position.iter().all(|x| x.is_finite()) && cone.spring.is_finite();
        assert!(is_finite, "scene {number} has a growth cone that is not finite: {cone:?}");
    }
    ("run", String::new())
}

#[test]
fn every_drawn_scene_runs_with_finite_results_or_is_refused_with_a_reason() {
    let schema = editor_schema(&block_schemas(&standard()));
    let mut counts = std::collections::BTreeMap::new();
    for number in 0..SCENES {
        let mut drawn = scene(&schema, number);
        loop {
            let text = drawn.to_string();
            let found = std::panic::catch_unwind(|| outcome(drawn.clone(), number));
            let (found, place) = found.unwrap_or_else(|_| panic!("scene {number}: {text}"));
            *counts.entry(found).or_insert(0) += 1;
            // What is refused is tried again without the block that is wrong, unless its default is large.
            let wrong = place.split('/').nth(1).unwrap_or_default();
            let is_large = ["tissue", "time", "populations"].contains(&wrong);
            if is_large || drawn.as_object_mut().and_then(|scene| scene.remove(wrong)).is_none() {
                break;
            }
        }
    }
    println!("{counts:?}");
    assert!(counts["run"] >= SCENES / 4 && counts["refused"] >= SCENES / 2, "{counts:?} tell little");
}
