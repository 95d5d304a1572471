//! Being carried: v_φ goes into [`Velocity`], and the rotation of the tissue may turn headings.
//!
//! The site already rides the tissue, so v_φ is reported and never added to the motion again. Installed only in a scene
//! whose tissue moves.

use super::components::Velocity;
use super::cones::{Cones, ConesWith};
use super::configuration::Configuration;
use super::growth::Growth;
use super::tissue::Tissue;
use bevy_ecs::prelude::Res;

/// Writes v_φ of each growing cone.
pub fn carry(tissue: Res<Tissue>, configuration: Res<Configuration>, mut cones: ConesWith<Velocity>) {
    cones.for_each(|cone, _, velocity| velocity.tissue = configuration.velocity(&tissue.mesh, cone.site).xy());
}

/// Ours, `heading_follows: spin`: the rotation R of F = R U turns headings as it turns shafts.
pub fn spin_headings(growth: Res<Growth>, tissue: Res<Tissue>, configuration: Res<Configuration>, mut cones: Cones) {
    if growth.heading_spins {
        cones.for_each(|cone, spring| spring.spin.z += configuration.rotation_rate(&tissue.mesh, cone.site.cell));
    }
}
