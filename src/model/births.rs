//! Births: each axon starts at its own instant, at its own place on the border, heading into the tissue.

use super::clock::Clock;
use super::components::{GrowthCone, Journey, Position, Site, Spring, SpringState, Status, Velocity};
use super::configuration::Configuration;
use super::shafts::Shafts;
use super::tissue::Tissue;
use crate::kept;
use crate::numerics::coordinates::AtVertices;
use bevy_ecs::prelude::{Query, Res, ResMut, Resource, With};
use nalgebra::Vector3;

/// The birth of a growth cone. Where it is born says its [`Site`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Birth {
    /// Instant, in ticks.
    pub instant: u64,
    /// Place of the cone among all cones.
    pub cone: u32,
    /// The face of its site's cell along whose inner normal it heads, in the configuration at birth; none for a heading that is fixed, and
    /// stands in its [`SpringState`].
    pub face: Option<u8>,
}

/// The births that are still to come, the next one last.
#[derive(Debug, Clone, Default, Resource)]
pub struct BirthQueue {
    waiting: Vec<Birth>,
}

kept! { struct Birth { instant, cone, face } }
kept! { struct BirthQueue { waiting } }

impl BirthQueue {
    /// A queue of births.
    pub fn new(mut births: Vec<Birth>) -> Self {
        births.sort_unstable_by(|a, b| b.cmp(a));
        Self { waiting: births }
    }

    /// The births that are still to come, the next one last.
    pub fn waiting(&self) -> &[Birth] {
        &self.waiting
    }

    /// Whether a queue that nobody was taken from may become `later`.
    pub(super) fn may_become(&self, later: &Self) -> bool {
        self.waiting.starts_with(&later.waiting)
    }

    /// Takes those before an instant out of the queue, first ones first.
    fn take_before(&mut self, instant: u64) -> Vec<Birth> {
        let left = self.waiting.partition_point(|birth| birth.instant >= instant);
        let due = self.waiting.drain(left..).rev().collect();
        if self.waiting.len() < self.waiting.capacity() / 2 {
            self.waiting.shrink_to_fit();
        }
        due
    }
}

/// Inner unit normal of a face of a cell, opposite its local vertex `face`.
fn inner_normal(tissue: &Tissue, coordinates: &impl AtVertices<2>, cell: u32, face: u8) -> Vector3<f64> {
    let ends: Vec<_> = tissue.mesh.face_vertices(cell, face).map(|v| coordinates.at(v as usize)).collect();
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
        (*self.site, self.position.0) = (site, position.xy());
        self.velocity.growth = heading.xy() * speed;
        *self.spring = Spring { heading, ..Spring::default() }.into();
        (self.journey.first_heading, self.journey.ended) = (heading.xy().into(), hours);
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
    let Some((cones, mut status, mut site, mut position, mut velocity, mut spring, mut journey)) = tables.next() else {
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
    for Birth { cone, face, .. } in due {
        let i = cone as usize;
        let (site, hours) = (columns.site[i], cones[i].birth_time(&clock.grid));
        let heading = match face {
            Some(face) => inner_normal(&tissue, &*configuration, site.cell, face),
            None => columns.spring[i].seen().heading,
        };
        columns.at(i).begin((site, configuration.position(&tissue.mesh, site)), heading, cones[i].speed, hours);
        let at = tissue.reference_position(site);
        shafts.start(i, site, [at.x, at.y], hours);
    }
}
