//! The roster: one line a mechanism, in order of summation. One file a mechanism or provider.

pub mod borders;
pub mod chemotaxis;
pub mod cue_fields;
pub mod fasciculation;
pub mod heading_noise;
pub mod matrix;
pub mod shaft_index;

use crate::model::mechanism::Roster;

/// All mechanisms that come with the program: providers first, then terms in the order in which they are summed.
pub fn standard() -> Roster {
    Roster::new()
        .with::<matrix::Matrix>()
        .with::<cue_fields::Cues>()
        .with::<chemotaxis::Chemotaxis>()
        .with::<fasciculation::Fasciculation>()
        .with::<borders::Borders>()
        .with::<heading_noise::HeadingNoise>()
}
