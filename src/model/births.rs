//! Births: each axon starts at its own instant, at its own place on the border, heading into the tissue.

use super::clock::Clock;
use super::components::{GrowthCone, Journey, Position, Site, SpringState, Status, Velocity};
use super::shafts::Shafts;
use super::tissue::{Configuration, Tissue};
use crate::numerics::simplex_mesh::BorderFacet;
use bevy_ecs::prelude::{Component, Query, Res, ResMut, Resource, With};
use nalgebra::Vector3;

/// Where a growth cone starts, and which way.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct Origin {
    /// Material site of birth.
    pub site: Site,
    /// Heading at birth.
    pub heading: FirstHeading,
}

/// The heading a cone is born with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FirstHeading {
    /// Along the inner normal of a border facet, in the configuration at birth.
    InnerNormal(BorderFacet),
    /// A fixed unit vector.
    Fixed(Vector3<f64>),
}

/// The cones in order of birth.
#[derive(Debug, Clone, Default, Resource)]
pub struct BirthQueue {
    order: Vec<(u64, u32)>,
    next: usize,
}

impl BirthQueue {
    /// A queue of births: the instant (ticks) of each cone, in order of the cones.
    pub fn new(births: impl Iterator<Item = u64>) -> Self {
        let mut order: Vec<(u64, u32)> = births.zip(0..).collect();
        order.sort_unstable();
        Self { order, next: 0 }
    }

    fn take_before(&mut self, instant: u64) -> &[(u64, u32)] {
        let due = self.order[self.next..].iter().take_while(|(birth, _)| *birth < instant).count();
        let from = self.next;
        self.next += due;
        &self.order[from..self.next]
    }
}

/// Inner unit normal of a border facet at given coordinates.
pub fn inner_normal(tissue: &Tissue, coordinates: &[[f64; 2]], facet: BorderFacet) -> Vector3<f64> {
    let ends: Vec<_> = tissue.mesh.facet_vertices(facet).map(|v| coordinates[v as usize]).collect();
    let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
    let length = along[0].hypot(along[1]);
    Vector3::new(-along[1] / length, along[0] / length, 0.0)
}

type Newborn = (
    &'static GrowthCone,
    &'static Origin,
    &'static mut Status,
    &'static mut Site,
    &'static mut Position,
    &'static mut Velocity,
    &'static mut SpringState,
    &'static mut Journey,
);

/// Starts the cones whose birth falls into the coming step.
pub fn give_birth(
    clock: Res<Clock>,
    tissue: Res<Tissue>,
    configuration: Res<Configuration>,
    mut queue: ResMut<BirthQueue>,
    mut shafts: ResMut<Shafts>,
    mut cones: Query<Newborn, With<GrowthCone>>,
) {
    let due = queue.take_before(clock.now + clock.next_step());
    if due.is_empty() {
        return;
    }
    let Ok(mut tables) = cones.contiguous_iter_mut() else { return };
    let Some((cones, origins, mut status, mut site, mut position, mut velocity, mut spring, mut journey)) =
        tables.next()
    else {
        return;
    };
    for &(_, index) in due {
        let i = index as usize;
        let heading = match origins[i].heading {
            FirstHeading::InnerNormal(facet) => inner_normal(&tissue, &configuration.coordinates, facet),
            FirstHeading::Fixed(heading) => heading,
        };
        status[i] = Status::Growing;
        site[i] = origins[i].site;
        position[i] = Position(configuration.position(&tissue.mesh, origins[i].site));
        velocity[i].growth = heading * cones[i].speed;
        spring[i] = SpringState { heading, ..SpringState::default() };
        journey[i].first_heading = heading.into();
        journey[i].ended = cones[i].birth_time;
        let at = tissue.reference_position(origins[i].site);
        shafts.start(i, origins[i].site, [at.x, at.y], cones[i].birth_time);
    }
}
