//! The end of a step: shafts lengthen, positions follow from sites, and a non-finite state ends the run.

use super::clock::Clock;
use super::components::{GrowthCone, Position, Site, SpringState, Status};
use super::configuration::Configuration;
use super::health::Health;
use super::shafts::Shafts;
use super::tissue::Tissue;
use bevy_ecs::prelude::{Query, Res, ResMut, With};

/// Lengthens the shaft of each cone that moved in this step and updates its position.
pub fn settle(
    clock: Res<Clock>,
    tissue: Res<Tissue>,
    configuration: Res<Configuration>,
    mut shafts: ResMut<Shafts>,
    mut health: ResMut<Health>,
    mut cones: Query<(&GrowthCone, &Status, &Site, &mut Position, &SpringState), With<GrowthCone>>,
) {
    let time = clock.hours();
    for (shaft, (cone, status, site, mut position, spring)) in cones.iter_mut().enumerate() {
        if *status == Status::Unborn || shafts.tip(shaft as u32) == site.planar() {
            continue;
        }
        let at = tissue.reference_position(*site);
        position.0 = configuration.position(&tissue.mesh, *site).xy();
        let spring = spring.seen();
        if !(spring.is_finite() && position.0.sum().is_finite() && at.sum().is_finite()) {
            health.report(
                time,
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
                ),
            );
            return;
        }
        shafts.extend(shaft, (*site, [at.x, at.y]), time, |before| tissue.reference_position(before).xy().into());
    }
}
