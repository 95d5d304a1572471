//! The roster: one line a mechanism, in order of summation. One file a mechanism or provider.

pub mod bending_stiffness;
pub mod borders;
pub mod branching;
pub mod chemotaxis;
pub mod cone_release;
pub mod cue_fields;
pub mod cue_keys;
pub mod durotaxis;
pub mod fasciculation;
pub mod growth_rate_modulation;
pub mod heading_noise;
pub mod leader_follower;
pub mod materials;
pub mod matrix;
pub mod retraction;
pub mod shaft_index;
pub mod steric_repulsion;
pub mod zippering;

use crate::model::mechanism::Roster;

/// All mechanisms that come with the program: providers first, then terms in the order in which they are summed; and its laws of material.
pub fn standard() -> Roster {
    Roster::new()
        .with::<matrix::Matrix>()
        .with::<cue_fields::Cues>()
        .with::<chemotaxis::Chemotaxis>()
        .with::<cone_release::ConeRelease>()
        .with::<growth_rate_modulation::GrowthRateModulation>()
        .with::<fasciculation::Fasciculation>()
        .with::<steric_repulsion::StericRepulsion>()
        .with::<leader_follower::LeaderFollower>()
        .with::<borders::Borders>()
        .with::<durotaxis::Durotaxis>()
        .with::<bending_stiffness::BendingStiffness>()
        .with::<heading_noise::HeadingNoise>()
        .with::<retraction::Retraction>()
        .with::<branching::Branching>()
        .with::<zippering::Zippering>()
        .with_material::<materials::StVenantKirchhoffLaw>()
        .with_material::<materials::NeoHookeanLaw>()
        .with_material::<materials::OgdenLaw>()
}
