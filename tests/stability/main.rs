//! Where methods fail, and what the program then does: the maps of `tropism stability` against closed forms.

#[path = "../common/mod.rs"]
mod common;
mod compression;
mod cue_mesh;
mod degenerate;
mod files;
mod noise;
mod stretched_mesh;
mod turning;

use tropism::prelude::Roster;
use tropism::study::stability::with_constant_pull;

/// The standard mechanisms and the constant pull.
pub fn roster() -> Roster {
    with_constant_pull(&tropism::systems::standard())
}
