//! Births: each axon starts at its own instant, at its own place on the border, heading into the tissue.

use super::clock::Clock;
use super::components::{GrowthCone, Journey, Position, Site, SpringState, Status, Velocity};
use super::configuration::Configuration;
use super::shafts::Shafts;
use super::tissue::Tissue;
use crate::kept;
use crate::numerics::coordinates::AtVertices;
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

kept! { struct BirthQueue { order, next } }

impl BirthQueue {
    /// A queue of births: the instant (ticks) of each cone, in order of the cones.
    pub fn new(births: impl Iterator<Item = u64>) -> Self {
        let mut order: Vec<(u64, u32)> = births.zip(0..).collect();
        order.sort_unstable();
        Self { order, next: 0 }
    }

    /// Whether a queue that nobody was taken from may become `later`.
    pub(super) fn may_become(&self, later: &Self) -> bool {
        later.order == self.order && later.next <= later.order.len()
    }

    fn take_before(&mut self, instant: u64) -> &[(u64, u32)] {
        let due = self.order[self.next..].iter().take_while(|(birth, _)| *birth < instant).count();
        let from = self.next;
        self.next += due;
        &self.order[from..self.next]
    }
}

/// Inner unit normal of a border facet at given coordinates.
pub fn inner_normal(tissue: &Tissue, coordinates: &(impl AtVertices<2> + ?Sized), facet: BorderFacet) -> Vector3<f64> {
    let ends: Vec<_> = tissue.mesh.facet_vertices(facet).map(|v| coordinates.at(v as usize)).collect();
    let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
    let length = along[0].hypot(along[1]);
    Vector3::new(-along[1] / length, along[0] / length, 0.0)
}

/// What may be altered of a cone.
pub(super) struct Altered<'a> {
    pub(super) status: &'a mut Status,
    pub(super) site: &'a mut Site,
    pub(super) position: &'a mut Position,
    pub(super) velocity: &'a mut Velocity,
    pub(super) spring: &'a mut SpringState,
    pub(super) journey: &'a mut Journey,
}

impl Altered<'_> {
    /// Begins at a site with its position (µm), with a unit heading and a speed (µm/h), at a time (h).
    pub(super) fn begin(self, (site, position): (Site, Vector3<f64>), heading: Vector3<f64>, speed: f64, hours: f64) {
        *self.status = Status::Growing;
        (*self.site, self.position.0) = (site, position);
        self.velocity.growth = heading * speed;
        *self.spring = SpringState { heading, ..SpringState::default() };
        (self.journey.first_heading, self.journey.ended) = (heading.into(), hours);
    }
}

/// The same of all cones, in their order. Taken past the detection of changes: else each write would mark the change of every cone, and
/// births would cost their number times that.
pub(super) struct AlteredColumns<'a> {
    pub(super) status: &'a mut [Status],
    pub(super) site: &'a mut [Site],
    pub(super) position: &'a mut [Position],
    pub(super) velocity: &'a mut [Velocity],
    pub(super) spring: &'a mut [SpringState],
    pub(super) journey: &'a mut [Journey],
}

impl AlteredColumns<'_> {
    /// One of them.
    pub(super) fn at(&mut self, i: usize) -> Altered<'_> {
        Altered {
            status: &mut self.status[i],
            site: &mut self.site[i],
            position: &mut self.position[i],
            velocity: &mut self.velocity[i],
            spring: &mut self.spring[i],
            journey: &mut self.journey[i],
        }
    }
}

type Unborn = (
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
    mut cones: Query<Unborn, With<GrowthCone>>,
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
    let mut columns = AlteredColumns {
        status: status.bypass_change_detection(),
        site: site.bypass_change_detection(),
        position: position.bypass_change_detection(),
        velocity: velocity.bypass_change_detection(),
        spring: spring.bypass_change_detection(),
        journey: journey.bypass_change_detection(),
    };
    for &(_, index) in due {
        let i = index as usize;
        let heading = match origins[i].heading {
            FirstHeading::InnerNormal(facet) => inner_normal(&tissue, &*configuration, facet),
            FirstHeading::Fixed(heading) => heading,
        };
        let place = (origins[i].site, configuration.position(&tissue.mesh, origins[i].site));
        columns.at(i).begin(place, heading, cones[i].speed, cones[i].birth_time);
        let at = tissue.reference_position(origins[i].site);
        shafts.start(i, origins[i].site, [at.x, at.y], cones[i].birth_time);
    }
}
