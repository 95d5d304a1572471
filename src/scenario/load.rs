//! From a file to a checked scene, or to all that is wrong with it.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use thiserror::Error;

use super::checks::check_region;
use super::expressions;
use super::folder::inside;
use super::merge::{idle_removals, merge, strip_nulls};
use super::outline_file::take_in;
use super::overrides;
use super::read::read_file;
use super::scene::{Scene, Tissue};
use super::schema::{BlockSchema, full_schema};
use super::schema_view::show;
use super::schema_walk::walk;
use crate::model::mechanism::Facts;
use crate::model::violation::{Violation, Violations, pointer_token};

/// A base of a base … at most this many files deep.
const LONGEST_CHAIN: usize = 32;

/// Keys that speak of their own file and are not taken over from a base.
const OWN_KEYS: [&str; 4] = ["$schema", "base", "name", "description"];

/// What to load: a file, the mechanisms to leave out, and the keys to set.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The scene's file.
    pub path: PathBuf,
    /// Names of mechanisms to leave out.
    pub without: Vec<String>,
    /// Overrides `/json/pointer=value`, applied after `without`.
    pub set: Vec<String>,
}

/// A checked scene.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The core keys.
    pub scene: Scene,
    /// The blocks of the mechanisms that are on, checked against their schemas, in the order of the document.
    pub blocks: Map<String, Value>,
    /// The whole scene in one document: bases merged, overrides applied, nulls gone. Loading it again gives the same scene.
    pub merged: Value,
    /// What is possible but unusual.
    pub hints: Vec<Violation>,
    /// What those who changed the scene since have to say of it; it becomes notes of its runs.
    pub remarks: Vec<String>,
    /// Bytes that what is solved before the first step may take, if that is bounded.
    pub room: Option<f64>,
    /// The directory of the file, to which paths in blocks are relative.
    pub directory: PathBuf,
}

/// Everything that is wrong with a scene.
#[derive(Debug, Clone, PartialEq, Error)]
pub struct ScenarioErrors {
    /// The file.
    pub path: PathBuf,
    /// The problems, at least one.
    pub problems: Vec<Violation>,
}

impl fmt::Display for ScenarioErrors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.problems.len();
        let noun = if count == 1 { "problem" } else { "problems" };
        write!(formatter, "{}: {count} {noun}", self.path.display())?;
        for (index, problem) in self.problems.iter().enumerate() {
            write!(formatter, "\n  {}. {problem}", index + 1)?;
        }
        Ok(())
    }
}

/// Reads, merges, overrides, walks, deserialises and checks a scene.
///
/// # Errors
/// All problems found, each with its JSON pointer: those of the files, of the overrides, of the walk along the schema, and of the
/// checks whose keys are sound.
pub fn load(request: &Request, blocks: &[BlockSchema]) -> Result<Loaded, ScenarioErrors> {
    let fail = |problems| ScenarioErrors { path: request.path.clone(), problems };
    let chain = read_chain(&request.path).map_err(|problem| fail(vec![problem]))?;
    check(&chain, request, blocks)
}

/// As [`load`], for a scene that is a value in memory called `name`. It may have no `base`.
///
/// # Errors
/// As [`load`]; a value that is no object, or that has a base.
pub fn load_document(name: &str, value: Value, blocks: &[BlockSchema]) -> Result<Loaded, ScenarioErrors> {
    let request = Request { path: PathBuf::from(name), ..Request::default() };
    let refusal = match value.as_object() {
        None => Some(Violation::new("", format!("a scene is a JSON object, not {}", show(&value)))),
        Some(keys) => keys.get("base").map(|_| Violation::new("/base", "a scene that is no file has no base")),
    };
    match refusal {
        Some(problem) => Err(ScenarioErrors { path: request.path, problems: vec![problem] }),
        None => check(&[Document { path: request.path.clone(), value }], &request, blocks),
    }
}

/// Merges a chain and checks the result.
fn check(chain: &[Document], request: &Request, blocks: &[BlockSchema]) -> Result<Loaded, ScenarioErrors> {
    let mut draft = Draft::merge(chain);
    draft.apply_overrides(request, blocks);
    expressions::evaluate(&mut draft.document, &mut draft.problems);
    draft.walk(blocks);
    draft.take_in_outline(chain, request);
    draft.name_origins(chain);
    let stem = request.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let (scene, blocks) = draft.finish(&stem, blocks);
    match scene {
        Some(scene) if draft.problems.is_empty() => {
            let directory = request.path.parent().map(Path::to_path_buf).unwrap_or_default();
            Ok(Loaded {
                scene,
                blocks,
                merged: draft.document,
                hints: draft.hints,
                remarks: Vec::new(),
                room: None,
                directory,
            })
        }
        _ => Err(ScenarioErrors { path: request.path.clone(), problems: draft.problems }),
    }
}

/// Deserialises a checked block; a refusal of serde itself comes with its pointer, which begins with `pointer`.
///
/// # Errors
/// The first problem serde finds.
pub fn read_value<T: DeserializeOwned>(pointer: &str, value: &Value) -> Result<T, Violation> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let mut place = pointer.to_owned();
        for segment in error.path() {
            match segment {
                serde_path_to_error::Segment::Seq { index } => place.push_str(&format!("/{index}")),
                serde_path_to_error::Segment::Map { key } => place.push_str(&pointer_token(key)),
                serde_path_to_error::Segment::Enum { variant } => place.push_str(&pointer_token(variant)),
                serde_path_to_error::Segment::Unknown => {}
            }
        }
        Violation::new(place, error.inner().to_string())
    })
}

/// One file of a chain.
struct Document {
    path: PathBuf,
    value: Value,
}

/// The file and its bases, the file first.
fn read_chain(path: &Path) -> Result<Vec<Document>, Violation> {
    let mut chain: Vec<Document> = Vec::new();
    let mut seen = BTreeSet::new();
    let mut next = Some(path.to_path_buf());
    while let Some(path) = next {
        let named = |message: String| match chain.last() {
            Some(above) => Violation::new("/base", format!("(in {}) {message}", above.path.display())),
            None => Violation::new("", message),
        };
        if chain.len() == LONGEST_CHAIN {
            return Err(named(format!("more than {LONGEST_CHAIN} files in a chain of bases")));
        }
        let identity = path.canonicalize().unwrap_or_else(|_| path.clone());
        if !seen.insert(identity) {
            return Err(named(format!("{} is a base of itself", path.display())));
        }
        let value = read_file(&path).map_err(|error| named(name_file(&path, &error.to_string())))?;
        if !value.is_object() {
            return Err(named(name_file(&path, &format!("a scene is a JSON object, not {}", show(&value)))));
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let base = value.get("base").and_then(Value::as_str).map(str::to_owned);
        chain.push(Document { path, value });
        next = base.map(|base| inside(&folder, &base)).transpose().map_err(|message| {
            Violation::new("/base", format!("(in {}) {message}", chain[chain.len() - 1].path.display()))
        })?;
    }
    Ok(chain)
}

/// Puts the file in front of a message that is about its content.
fn name_file(path: &Path, message: &str) -> String {
    let file = path.display().to_string();
    if message.starts_with(&file) { message.to_owned() } else { format!("{file}: {message}") }
}

/// A scene on its way.
struct Draft {
    document: Value,
    problems: Vec<Violation>,
    hints: Vec<Violation>,
    overridden: Vec<String>,
}

impl Draft {
    /// Merges a chain, the last file first. Nulls stay, as marks of removal.
    fn merge(chain: &[Document]) -> Self {
        let mut draft = Self {
            document: Value::Object(Map::new()),
            problems: Vec::new(),
            hints: Vec::new(),
            overridden: Vec::new(),
        };
        for (depth, file) in chain.iter().enumerate().rev() {
            let mut value = file.value.clone();
            if depth + 1 < chain.len() {
                idle_removals(&draft.document, &value, "", &mut draft.hints);
            }
            if depth > 0
                && let Some(object) = value.as_object_mut()
            {
                OWN_KEYS.iter().for_each(|key| drop(object.shift_remove(*key)));
            }
            merge(&mut draft.document, value);
        }
        draft
    }

    fn apply_overrides(&mut self, request: &Request, blocks: &[BlockSchema]) {
        let names: Vec<&str> = blocks.iter().map(|block| block.name).collect();
        overrides::remove_blocks(&mut self.document, &request.without, &names, &mut self.problems, &mut self.hints);
        for text in &request.set {
            match overrides::set(&mut self.document, text) {
                Ok(pointer) if pointer == "/base" => {
                    let message = "a base stands in a file: what is set comes on top of all files";
                    self.problems.push(Violation::new(pointer, message));
                }
                Ok(pointer) => self.overridden.push(pointer),
                Err(problem) => self.problems.push(problem),
            }
        }
    }

    fn walk(&mut self, blocks: &[BlockSchema]) {
        let findings = walk(&full_schema(blocks), &self.document);
        self.problems.extend(findings.problems);
        self.hints.extend(findings.hints);
        if let Some(object) = self.document.as_object_mut() {
            object.shift_remove("$schema");
            object.shift_remove("base");
        }
    }

    /// Puts the outline of a file in its place; the file lies beside the scenario that names it.
    fn take_in_outline(&mut self, chain: &[Document], request: &Request) {
        let sound = !self.problems.iter().any(|problem| problem.pointer.starts_with("/tissue"));
        let names = |file: &&Document| file.value.pointer("/tissue/outline").is_some();
        let by_set = self.overridden.iter().any(|pointer| pointer.starts_with("/tissue/outline"));
        let source = chain.iter().find(names).filter(|_| !by_set).map_or(&request.path, |file| &file.path);
        if sound && let Err(problem) = take_in(&mut self.document, source.parent().unwrap_or(Path::new(""))) {
            self.problems.push(problem);
        }
    }

    /// Says of a problem which base, or that an override, brought the value.
    fn name_origins(&mut self, chain: &[Document]) {
        for problem in self.problems.iter_mut().filter(|problem| !problem.pointer.is_empty()) {
            if self.overridden.iter().any(|pointer| problem.pointer.starts_with(pointer.as_str())) {
                problem.message.push_str(" (from --set)");
                continue;
            }
            let origin = chain.iter().position(|file| file.value.pointer(&problem.pointer).is_some());
            if let Some(file) = origin.filter(|&depth| depth > 0).map(|depth| &chain[depth]) {
                problem.message.push_str(&format!(" (in {})", file.path.display()));
            }
        }
    }

    /// The scene and its blocks from the keys that are sound, after the checks of both.
    fn finish(&mut self, stem: &str, blocks: &[BlockSchema]) -> (Option<Scene>, Map<String, Value>) {
        strip_nulls(&mut self.document);
        let broken: BTreeSet<String> = self.problems.iter().filter_map(|problem| top_key(&problem.pointer)).collect();
        let mut core = Map::new();
        let mut mechanisms = Map::new();
        if let Some(object) = self.document.as_object_mut() {
            if object.get("name").is_none_or(|name| name == "") {
                object.insert("name".to_owned(), Value::String(stem.to_owned()));
            }
            for (key, member) in object.iter().filter(|(key, _)| !broken.contains(*key)) {
                let part = if blocks.iter().any(|block| block.name == key) { &mut mechanisms } else { &mut core };
                part.insert(key.clone(), member.clone());
            }
        }
        let scene = read_value::<Scene>("", &Value::Object(core)).map_err(|problem| self.problems.push(problem)).ok();
        let found = scene.as_ref().and_then(|scene| scene.check_except(&broken).err()).unwrap_or_default();
        self.problems.extend(found);
        if let Some(scene) = &scene {
            self.check_blocks(scene, &mechanisms, blocks, &broken);
        }
        (scene, mechanisms)
    }
}

impl Draft {
    /// Lets each sound block check itself against the scene, as far as the rest of the scene is sound.
    fn check_blocks(
        &mut self,
        scene: &Scene,
        mechanisms: &Map<String, Value>,
        blocks: &[BlockSchema],
        broken: &BTreeSet<String>,
    ) {
        let facts = facts(scene, &self.document, broken);
        let outline = (!broken.contains("tissue")).then_some(&scene.tissue.outline);
        for block in blocks {
            let Some((check, value)) = block.check.as_ref().zip(mechanisms.get(block.name)) else { continue };
            let found = check(value, &facts);
            let mut placed = Violations::new();
            placed.extend_under(&pointer_token(block.name), found.violations);
            for (pointer, shape) in found.shapes {
                check_region(&shape, outline, (&pointer, "the shape"), &mut placed);
            }
            self.problems.extend(placed);
        }
    }
}

/// What a block's check may know of the scene; the laws of material are the roster's to add. Names of populations and of blocks that are
/// `broken` still count; of a tissue that is, nothing is known, since what stands in its place is the default.
pub fn facts(scene: &Scene, document: &Value, broken: &BTreeSet<String>) -> Facts {
    let written = document.get("populations").and_then(Value::as_object);
    let of_broken = || written.into_iter().flat_map(Map::keys).cloned().collect();
    let is_broken = |key: &str| broken.contains(key);
    let tissue = (!is_broken("tissue")).then_some(&scene.tissue);
    Facts {
        populations: if is_broken("populations") { of_broken() } else { scene.populations.keys().cloned().collect() },
        edges: tissue.map(|tissue| tissue.outline.edge_names()).unwrap_or_default(),
        blocks: document.as_object().cloned().unwrap_or_default(),
        duration: scene.time.duration.0,
        mesh_extent: tissue.map(Tissue::mesh_extent).unwrap_or_default(),
        ..Facts::default()
    }
}

fn top_key(pointer: &str) -> Option<String> {
    let token = pointer.strip_prefix('/')?.split('/').next()?;
    Some(token.replace("~1", "/").replace("~0", "~"))
}
