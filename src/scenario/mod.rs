//! JSON in: typed keys, `base` and merge patches, overrides, and every problem of a scene at once with its JSON pointer.
//!
//! A scene is read in five steps: the files of the chain of `base` ([`read`]), the merge patch (RFC 7396, [`merge`]) with the overrides
//! of the command line ([`overrides`]) and the values of its expressions ([`expressions`]), the walk of the merged value along the JSON schema of all keys ([`schema_walk`]), the typed
//! scene ([`scene`]) by serde, and the checks that compare keys with each other ([`checks`]). [`load::load`] does all five.

mod alternatives;
pub mod catalogue;
mod catalogue_text;
pub mod checks;
pub mod editor_schema;
pub mod excerpt;
mod expressions;
mod files;
mod folder;
pub mod load;
pub mod merge;
mod names;
pub mod outline_file;
pub mod overrides;
mod population;
mod ranges;
pub mod read;
pub mod scene;
pub mod schema;
mod schema_view;
pub mod schema_walk;
pub mod suggest;
mod tissue;
