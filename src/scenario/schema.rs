//! The JSON schema of a whole scene: the core keys and one key for each mechanism.

use serde_json::{Map, Value, json};

use super::scene::Scene;
use crate::model::mechanism::Facts;
use crate::model::shape::Shape;
use crate::model::violation::Violations;
use std::sync::Arc;

/// What a block's own check finds: violations, relative to the block, and shapes that must lie inside the tissue, each with
/// its place from the top of the scene.
#[derive(Debug, Clone, Default)]
pub struct BlockFindings {
    /// What is wrong.
    pub violations: Violations,
    /// What must lie inside the tissue.
    pub shapes: Vec<(String, Shape)>,
}

/// A check of a block that a schema cannot state: relations between keys, names that must exist in the scene.
pub type BlockCheck = Arc<dyn Fn(&Value, &Facts) -> BlockFindings + Send + Sync>;

/// The key of a mechanism, the JSON schema of its block and its own check.
#[derive(Clone)]
pub struct BlockSchema {
    /// The key at the top of a scene.
    pub name: &'static str,
    /// The JSON schema of the block, complete with its `$defs`.
    pub schema: Value,
    /// Runs once the block fits its schema; its pointers are relative to the block.
    pub check: Option<BlockCheck>,
}

impl BlockSchema {
    /// A block without a check of its own.
    pub fn new(name: &'static str, schema: Value) -> Self {
        Self { name, schema, check: None }
    }

    /// The block with its own check.
    #[must_use]
    pub fn checked_by(mut self, check: impl Fn(&Value, &Facts) -> BlockFindings + Send + Sync + 'static) -> Self {
        self.check = Some(Arc::new(check));
        self
    }
}

/// The JSON schema (draft 2020-12) of a scene with these blocks. A block's definitions are named after it, so that two blocks may use
/// the same names.
pub fn full_schema(blocks: &[BlockSchema]) -> Value {
    let mut root = schemars::schema_for!(Scene).to_value();
    for block in blocks {
        let mut schema = block.schema.clone();
        let definitions = schema.as_object_mut().and_then(|object| {
            object.shift_remove("$schema");
            object.shift_remove("$defs")
        });
        let own = format!("#/$defs/{}", block.name);
        rename_references(&mut schema, block.name);
        insert(&mut root, "$defs", block.name.to_owned(), schema);
        insert(
            &mut root,
            "properties",
            block.name.to_owned(),
            json!({ "anyOf": [{ "$ref": own }, { "type": "null" }] }),
        );
        for (name, mut definition) in definitions.as_ref().and_then(Value::as_object).cloned().unwrap_or_default() {
            rename_references(&mut definition, block.name);
            insert(&mut root, "$defs", format!("{}.{name}", block.name), definition);
        }
    }
    root
}

/// The keys that can stand at the top of a scene.
pub fn top_keys(blocks: &[BlockSchema]) -> Vec<String> {
    let schema = full_schema(blocks);
    schema["properties"].as_object().into_iter().flat_map(Map::keys).cloned().collect()
}

fn insert(root: &mut Value, section: &str, key: String, value: Value) {
    let Some(object) = root.as_object_mut() else { return };
    let section = object.entry(section).or_insert_with(|| Value::Object(Map::new()));
    if let Some(members) = section.as_object_mut() {
        members.insert(key, value);
    }
}

/// `#` becomes `#/$defs/block`, `#/$defs/Name` becomes `#/$defs/block.Name`.
fn rename_references(schema: &mut Value, block: &str) {
    match schema {
        Value::Object(object) => {
            for (key, member) in object.iter_mut() {
                match member {
                    Value::String(path) if key == "$ref" => *path = rename(path, block),
                    _ => rename_references(member, block),
                }
            }
        }
        Value::Array(entries) => entries.iter_mut().for_each(|entry| rename_references(entry, block)),
        _ => {}
    }
}

fn rename(path: &str, block: &str) -> String {
    match path.strip_prefix("#/$defs/") {
        Some(name) => format!("#/$defs/{block}.{name}"),
        None => path.replacen('#', &format!("#/$defs/{block}"), 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_blocks_may_define_the_same_name() {
        let part = |kind: &str| json!({"$defs": {"Part": {"type": kind}}, "type": "object", "properties": {"x": {"$ref": "#/$defs/Part"}, "again": {"$ref": "#"}}});
        let schema = full_schema(&[BlockSchema::new("one", part("string")), BlockSchema::new("two", part("boolean"))]);
        assert_eq!(schema["$defs"]["one.Part"]["type"], "string");
        assert_eq!(schema["$defs"]["two.Part"]["type"], "boolean");
        assert_eq!(schema["$defs"]["two"]["properties"]["x"]["$ref"], "#/$defs/two.Part");
        assert_eq!(schema["$defs"]["two"]["properties"]["again"]["$ref"], "#/$defs/two");
        assert_eq!(schema["properties"]["one"]["anyOf"][0]["$ref"], "#/$defs/one");
    }
}
