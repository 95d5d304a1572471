//! The end of a step: shafts lengthen, positions follow from sites, and a non-finite state ends the run.

use super::clock::Clock;
use super::components::{GrowthCone, Position, Site, Spring, SpringState, Status};
use super::configuration::Configuration;
use super::health::Health;
use super::shafts::{Onward, Shafts};
use super::tissue::Tissue;
use bevy_ecs::prelude::{Query, Res, ResMut, With};

type Settled = (&'static GrowthCone, &'static Status, &'static Site, &'static mut Position, &'static SpringState);

/// Lengthens the shaft of each cone that moved in this step and updates its position. One whose state is not finite stays where it was.
pub fn settle(
    clock: Res<Clock>,
    tissue: Res<Tissue>,
    configuration: Res<Configuration>,
    mut shafts: ResMut<Shafts>,
    mut health: ResMut<Health>,
    mut cones: Query<Settled, With<GrowthCone>>,
) {
    let Ok(mut tables) = cones.contiguous_iter_mut() else { return };
    let Some((identities, statuses, sites, mut positions, springs)) = tables.next() else { return };
    let positions = positions.bypass_change_detection();
    let reference = |site: Site| -> [f64; 2] { tissue.reference_position(site).xy().into() };
    let next = |i: usize, tip: Site, position: &mut Position| {
        let site = sites[i];
        if statuses[i] == Status::Unborn || tip == site {
            return Onward::Nowhere;
        }
        position.0 = configuration.position(&tissue.mesh, site).xy();
        let at = reference(site);
        let is_finite = springs[i].seen().is_finite() && (position.0.sum() + at[0] + at[1]).is_finite();
        if is_finite { Onward::To(site, at) } else { Onward::Lost }
    };
    let time = clock.hours();
    if let Some(i) = shafts.extend_each(time, positions, next, reference) {
        health.report(time, account(&identities[i], &positions[i], &springs[i].seen()));
    }
}

/// What is said of a cone whose state is not finite.
fn account(cone: &GrowthCone, position: &Position, spring: &Spring) -> String {
    format!(
        "growth cone of axon {} has a state that is not finite: at ({:.3}, {:.3}) um, heading ({:.3}, {:.3}), pull ({:.3e}, {:.3e}), \
         speed factor {:.3e}, heading diffusion {:.3e} /h; a mechanism adds more than numbers hold",
        cone.axon,
        position.0.x,
        position.0.y,
        spring.heading.x,
        spring.heading.y,
        spring.pull.x,
        spring.pull.y,
        spring.speed_factor,
        spring.heading_diffusion
    )
}
