//! The smaller seam: one struct, one law of the matrix's material.
//!
//! A law is a struct whose fields are its keys in a scene; it makes a [`Material`], which is energy, stress and tangent as functions of
//! the deformation gradient. A scene names it under `matrix.material`: `"neo_hookean"` is the law with its defaults,
//! `{"ogden": {"exponent": -8}}` one with keys of its own.

use std::fmt;
use std::sync::Arc;

use bevy_ecs::prelude::Resource;
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::mechanism::unknown_name;
use super::violation::{Violation, Violations, pointer_token};
use crate::numerics::material::{Lame, Material};

/// A law of the matrix's material, open to other crates: `Roster::with_material` adds it.
///
/// The type's doc comment and those of its fields are its reference, as those of a mechanism are.
pub trait MaterialLaw: DeserializeOwned + JsonSchema + Send + Sync + 'static {
    /// Its word in a scene; the same as [`Material::name`] of what it makes.
    const NAME: &'static str;

    /// The material, which at small strain is isotropic with these Lamé parameters.
    ///
    /// # Errors
    /// Keys that a schema cannot refuse; pointers are relative to the keys of the law.
    fn material(&self, lame: Lame) -> Result<Arc<dyn Material<2>>, Violations>;
}

/// A law as a scene names it: by its word, or by its word and keys of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum MaterialChoice {
    /// The law with its defaults.
    Word(String),
    /// `{law: {key: value}}`.
    Keyed(Map<String, Value>),
}

/// Keyword of a schema that the laws of a roster take the place of.
const LAWS_BELONG_HERE: &str = "x-materials";

impl JsonSchema for MaterialChoice {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "MaterialChoice".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ LAWS_BELONG_HERE: true })
    }
}

impl MaterialChoice {
    /// A law with its defaults.
    pub fn of(name: &str) -> Self {
        Self::Word(name.to_owned())
    }

    /// The name of the law, and its keys.
    fn parts(&self) -> Option<(&str, Value)> {
        match self {
            Self::Word(name) => Some((name, json!({}))),
            Self::Keyed(keyed) => match keyed.iter().next() {
                Some((name, keys)) if keyed.len() == 1 => Some((name, keys.clone())),
                _ => None,
            },
        }
    }
}

type LawReader = fn(&Value, Lame) -> Result<Arc<dyn Material<2>>, Violations>;

/// One law of the roster.
#[derive(Clone, Copy)]
struct LawEntry {
    name: &'static str,
    schema: fn() -> Value,
    read: LawReader,
}

/// The laws of material a program has, in the order in which they are listed.
#[derive(Clone, Default, Resource)]
pub struct Materials {
    entries: Vec<LawEntry>,
}

impl fmt::Debug for Materials {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Materials").field(&self.names()).finish()
    }
}

impl Materials {
    /// Adds a law at the end. One that has the name of an earlier one takes its place.
    pub(crate) fn add<M: MaterialLaw>(&mut self) {
        let entry = LawEntry {
            name: M::NAME,
            schema: || {
                let inline = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
                inline.into_generator().into_root_schema_for::<M>().into()
            },
            read: |keys, lame| {
                let law: M = serde_path_to_error::deserialize(keys)
                    .map_err(|error| Violations::from(Violation::new("", error.to_string())))?;
                law.material(lame)
            },
        };
        match self.entries.iter_mut().find(|other| other.name == M::NAME) {
            Some(other) => *other = entry,
            None => self.entries.push(entry),
        }
    }

    /// Names of the laws, in order.
    pub fn names(&self) -> Vec<&'static str> {
        self.entries.iter().map(|entry| entry.name).collect()
    }

    /// The material that a scene chose, with these Lamé parameters.
    ///
    /// # Errors
    /// A law that is not there, and what the law refuses; pointers are relative to the choice.
    pub fn material(&self, choice: &MaterialChoice, lame: Lame) -> Result<Arc<dyn Material<2>>, Violations> {
        let Some((name, keys)) = choice.parts() else {
            return Err(Violation::new("", "name one law").into());
        };
        let Some(entry) = self.entries.iter().find(|entry| entry.name == name) else {
            let names: Vec<String> = self.names().into_iter().map(str::to_owned).collect();
            return Err(Violation::new("", unknown_name("material", name, &names)).into());
        };
        (entry.read)(&keys, lame).map_err(|found| {
            let mut placed = Violations::new();
            placed.extend_under(&pointer_token(name), found);
            placed
        })
    }

    /// Puts the laws into a schema wherever a [`MaterialChoice`] stands in it.
    pub(crate) fn complete(&self, schema: &mut Value) {
        match schema {
            Value::Object(keywords) => {
                if keywords.remove(LAWS_BELONG_HERE).is_some() {
                    keywords.insert("oneOf".to_owned(), self.alternatives());
                }
                keywords.values_mut().for_each(|member| self.complete(member));
            }
            Value::Array(entries) => entries.iter_mut().for_each(|entry| self.complete(entry)),
            _ => {}
        }
    }

    /// A word for each law that needs no keys, and an object for each that has some.
    fn alternatives(&self) -> Value {
        let laws: Vec<(&str, Value)> = self.entries.iter().map(|entry| (entry.name, (entry.schema)())).collect();
        let needs_none = |law: &Value| law["required"].as_array().is_none_or(Vec::is_empty);
        let has_some = |law: &Value| law["properties"].as_object().is_some_and(|keys| !keys.is_empty());
        let words = laws.iter().filter(|(_, law)| needs_none(law)).map(|(name, law)| {
            let text = law["description"].as_str().unwrap_or_default();
            json!({ "type": "string", "const": name, "description": text })
        });
        let keyed = laws.iter().filter(|(_, law)| has_some(law)).map(|(name, law)| {
            let mut keys = law.clone();
            if let Some(keywords) = keys.as_object_mut() {
                ["$schema", "title"].iter().for_each(|keyword| drop(keywords.shift_remove(*keyword)));
            }
            let name = (*name).to_owned();
            json!({ "type": "object", "properties": { &name: keys }, "required": [&name], "additionalProperties": false })
        });
        words.chain(keyed).collect()
    }
}
