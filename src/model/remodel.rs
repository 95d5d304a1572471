//! What mechanisms of [`Phase::Remodel`](super::schedule::Phase::Remodel) may do to what is laid: let a branch sprout, draw a
//! growth cone back along its shaft, lay a shaft anew. They act at the end of a step, on the state reached.

use super::births::{Altered, AlteredColumns};
use super::clock::Clock;
use super::components::{GrowthCone, Journey, Position, Site, SpringState, Status, Velocity};
use super::configuration::Configuration;
use super::shafts::{ShaftPoint, Shafts, VertexId};
use super::tissue::Tissue;
use crate::kept;
use crate::numerics::walk::{BorderRule, nowhere, walk};
use bevy_ecs::prelude::{Query, Res, ResMut, Resource, With};
use bevy_ecs::system::SystemParam;
use nalgebra::{Vector2, Vector3};

/// Growth cones that wait for branches: a fixed number for each axon, so that what one axon does takes nothing from another.
///
/// Axon a of n has the cones n + a·k … n + (a + 1)·k − 1, where k is the number for each.
#[derive(Debug, Clone, Default, Resource)]
pub struct SpareCones {
    axons: u32,
    each: u32,
    forks: Vec<Option<Fork>>,
}

/// Where a branch sprouted: of which cone, and when that had passed there (h).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fork {
    parent: u32,
    time: f32,
}

kept! { struct SpareCones { axons, each, forks } }
kept! { struct Fork { parent, time } }

impl SpareCones {
    /// `each` spare cones for each of `axons` axons.
    pub fn new(axons: u32, each: u32) -> Self {
        Self { axons, each, forks: vec![None; (axons * each) as usize] }
    }

    /// Whether spare cones of which none is in use may become `later`.
    pub(super) fn may_become(&self, later: &Self) -> bool {
        let same = (later.axons, later.each, later.forks.len()) == (self.axons, self.each, self.forks.len());
        let cones = self.axons as usize + self.forks.len();
        same && later.forks.iter().flatten().all(|fork| (fork.parent as usize) < cones)
    }

    /// The axon that a cone belongs to: its own number, or that of the axon whose branch it is.
    pub fn root(&self, cone: u32) -> u32 {
        if cone < self.axons { cone } else { (cone - self.axons) / self.each.max(1) }
    }

    /// Whether a cone is the tip of a branch.
    pub fn is_branch(&self, cone: u32) -> bool {
        cone >= self.axons
    }

    /// The cone that a branch sprouted from; none for an axon, or before it has sprouted.
    pub fn parent(&self, cone: u32) -> Option<u32> {
        self.forks.get(cone.checked_sub(self.axons)? as usize).copied().flatten().map(|fork| fork.parent)
    }

    /// The branches of a cone, each with the time (h) at which the cone passed its fork.
    fn forks_of(&self, cone: u32) -> impl Iterator<Item = (u32, f32)> + '_ {
        let first = self.root(cone) * self.each;
        (first..first + self.each).filter_map(move |place| {
            let fork = self.forks[place as usize].filter(|fork| fork.parent == cone)?;
            Some((self.axons + place, fork.time))
        })
    }

    /// Place of the next spare cone of a cone's axon; none if all are in use.
    fn next(&self, cone: u32) -> Option<u32> {
        let first = self.root(cone) * self.each;
        (first..first + self.each).find(|&place| self.forks[place as usize].is_none())
    }

    /// Takes the next spare cone of a cone's axon for a branch of that cone; none if all are in use.
    fn take(&mut self, fork: Fork) -> Option<u32> {
        let place = self.next(fork.parent)?;
        self.forks[place as usize] = Some(fork);
        Some(self.axons + place)
    }
}

/// Whether something goes on that no growing cone shows, such as retraction: a step in which nothing grows is then taken all the
/// same. Cleared before each step; mechanisms that go on set it.
#[derive(Debug, Clone, Copy, Default, Resource)]
pub struct Unrest(pub bool);

kept! { wrapper Unrest }

/// Where a branch begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// At the tip of its parent.
    Tip,
    /// At a stored vertex of its parent's shaft.
    Vertex(VertexId),
}

/// What is read of a growth cone after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Who it is.
    pub identity: GrowthCone,
    /// What it is doing.
    pub status: Status,
    /// Material site.
    pub site: Site,
    /// Unit heading.
    pub heading: Vector3<f64>,
}

type ConeParts = (
    &'static mut GrowthCone,
    &'static mut Status,
    &'static mut Site,
    &'static mut Position,
    &'static mut Velocity,
    &'static mut SpringState,
    &'static mut Journey,
);

/// Tissue, shafts and cones, to be remodelled.
#[derive(SystemParam)]
pub struct Remodelling<'w, 's> {
    /// The tissue.
    pub tissue: Res<'w, Tissue>,
    /// Its configuration at the end of the step.
    pub configuration: Res<'w, Configuration>,
    /// The clock; it stands at the end of the step.
    pub clock: Res<'w, Clock>,
    /// The shafts.
    pub shafts: ResMut<'w, Shafts>,
    /// Whether steps are to go on though nothing grows.
    pub unrest: ResMut<'w, Unrest>,
    spares: ResMut<'w, SpareCones>,
    cones: Query<'w, 's, ConeParts, With<GrowthCone>>,
}

impl Remodelling<'_, '_> {
    /// All growth cones as they stand, in their order.
    pub fn standing(&self) -> Vec<Standing> {
        let view = |(identity, status, site, spring): (&GrowthCone, &Status, &Site, &SpringState)| Standing {
            identity: *identity,
            status: *status,
            site: *site,
            heading: spring.seen().heading,
        };
        self.cones
            .iter()
            .map(|(identity, status, site, _, _, spring, _)| view((identity, status, site, spring)))
            .collect()
    }

    /// Lets `act` change one cone.
    fn change(&mut self, cone: u32, act: impl FnOnce(&mut GrowthCone, Altered)) {
        let i = cone as usize;
        let Ok(mut tables) = self.cones.contiguous_iter_mut() else { return };
        let Some((mut identity, mut status, mut site, mut position, mut velocity, mut spring, mut journey)) =
            tables.next()
        else {
            return;
        };
        let identity = identity.bypass_change_detection();
        let mut columns = AlteredColumns {
            status: status.bypass_change_detection(),
            site: site.bypass_change_detection(),
            position: position.bypass_change_detection(),
            velocity: velocity.bypass_change_detection(),
            spring: spring.bypass_change_detection(),
            journey: journey.bypass_change_detection(),
        };
        if i < identity.len() {
            act(&mut identity[i], columns.at(i));
        }
    }

    /// Position of a material site now (µm).
    pub fn position(&self, site: Site) -> Vector3<f64> {
        self.configuration.position(&self.tissue.mesh, site)
    }

    /// Starts a branch of a cone now, at its tip or at a stored vertex of its shaft; returns its number, or none if its axon has no spare
    /// cone left.
    pub fn sprout(&mut self, parent: u32, place: Place, heading: Vector3<f64>) -> Option<u32> {
        let hours = self.clock.hours();
        let (site, time) = match place {
            Place::Tip => (self.shafts.tip(parent).into(), hours as f32),
            Place::Vertex(vertex) => (self.shafts.point(vertex).into(), self.shafts.time(vertex)),
        };
        let number = self.spares.take(Fork { parent, time })?;
        if place == Place::Tip {
            let (stored, tip) = (self.shafts.vertices(parent as usize).count(), ShaftPoint { site, time });
            self.relay(parent, stored, &[tip], tip);
        }
        self.start(number, site, heading);
        Some(number)
    }

    fn start(&mut self, number: u32, site: Site, heading: Vector3<f64>) {
        let (now, hours, position) = (self.clock.now, self.clock.hours(), self.position(site));
        let at = self.tissue.reference_position(site);
        self.change(number, |identity, cone| {
            identity.birth = now;
            cone.begin((site, position), heading, identity.speed, hours);
        });
        self.shafts.start(number as usize, site, [at.x, at.y], hours);
    }

    /// Turns the heading of a cone.
    pub fn head(&mut self, cone: u32, heading: Vector3<f64>) {
        self.change(cone, |_, cone| cone.spring.change(|spring| spring.heading = heading));
    }

    /// Says what a cone is doing from now on.
    pub fn set_status(&mut self, cone: u32, to: Status) {
        let now = self.clock.hours();
        self.change(cone, |_, cone| (*cone.status, cone.journey.ended) = (to, now));
    }

    /// Draws a cone back along its shaft by `length` (µm, in the present configuration), to the origin or to the last fork that holds it
    /// at most; its heading is then that of the shaft where it stands. Returns what is left of `length`, above 0 where it is held.
    pub fn draw_back(&mut self, cone: u32, length: f64) -> f64 {
        let (shaft, hold) = (cone as usize, self.hold(cone));
        let stored: Vec<_> = self.shafts.vertices(shaft).collect();
        let place = |site: Site| self.configuration.position(&self.tissue.mesh, site);
        let mut tip = place(self.shafts.tip(cone).into());
        let (mut left, mut passed) = (length, self.shafts.tip_time(cone));
        for (before, &vertex) in stored.iter().enumerate().rev() {
            let base: Site = self.shafts.point(vertex).into();
            let chord = tip - place(base);
            let (distance, time) = (chord.norm(), self.shafts.time(vertex));
            if distance > left {
                let heading = chord / distance;
                let site = self.walked(base, heading * (distance - left));
                let then = passed - (passed - time) * (left / distance) as f32;
                self.stand(cone, before + 1, (site, then), Some(heading));
                return 0.0;
            }
            left -= distance;
            (tip, passed) = (place(base), time);
            if time <= hold || before == 0 {
                let heading = (distance > 0.0).then(|| chord / distance);
                self.stand(cone, before + 1, (base, time), heading);
                return left;
            }
        }
        left
    }

    /// Times (h) at which a cone passed the forks of its branches.
    pub fn fork_times(&self, cone: u32) -> Vec<f32> {
        self.spares.forks_of(cone).map(|(_, time)| time).collect()
    }

    /// Points between two points of a shaft, on the straight line between them now, as many as keep its segments short enough.
    pub fn between(&self, from: ShaftPoint, to: ShaftPoint) -> Vec<ShaftPoint> {
        let reference = |point: &ShaftPoint| self.tissue.reference_position(point.site);
        let pieces = ((reference(&to) - reference(&from)).norm() / self.shafts.mean_segment()).ceil().max(1.0);
        let chord = self.position(to.site) - self.position(from.site);
        let point = |i: usize| {
            let share = i as f64 / pieces;
            let site = self.walked(from.site, chord * share);
            ShaftPoint { site, time: from.time + (to.time - from.time) * share as f32 }
        };
        (1..pieces as usize).map(point).collect()
    }

    /// Whether the last fork of a cone whose branch still stands is where the cone stands.
    pub fn is_held(&self, cone: u32) -> bool {
        self.shafts.tip_time(cone) <= self.hold(cone)
    }

    /// Whether a cone's axon has a cone left for a branch.
    pub fn may_branch(&self, cone: u32) -> bool {
        self.spares.next(cone).is_some()
    }

    /// Whether a cone has been drawn back to where it began.
    pub fn is_at_origin(&self, cone: u32) -> bool {
        let first = self.shafts.vertices(cone as usize).next();
        first.is_none_or(|first| self.shafts.point(first) == self.shafts.tip(cone))
    }

    /// Time at which the cone passed the last fork whose branch still stands (h); before all time where there is none.
    fn hold(&self, cone: u32) -> f32 {
        let Ok(mut tables) = self.cones.contiguous_iter() else { return f32::NEG_INFINITY };
        let Some((_, statuses, ..)) = tables.next() else { return f32::NEG_INFINITY };
        let stands = |branch: &u32| statuses.get(*branch as usize).is_some_and(|status| *status != Status::Withdrawn);
        let forks = self.spares.forks_of(cone).filter(|(branch, _)| stands(branch));
        forks.map(|(_, time)| time).fold(f32::NEG_INFINITY, f32::max)
    }

    /// The site that lies `by` (µm, spatial) from another, inside the tissue.
    pub fn walked(&self, from: Site, by: Vector3<f64>) -> Site {
        let rules = nowhere(BorderRule::Slide);
        walk(&self.tissue.mesh, &*self.configuration, from.planar(), [by.x, by.y], &rules)
            .map_or(from, |end| end.point.into())
    }

    /// Lays a shaft anew after its first `kept` stored vertices (at least one): `points` and then the tip. Consecutive points lie at most
    /// [`Shafts::longest`] apart, in the reference configuration.
    pub fn relay(&mut self, cone: u32, kept: usize, points: &[ShaftPoint], tip: ShaftPoint) {
        let shaft = cone as usize;
        self.shafts.lay_anew(shaft, kept, points, tip);
        let at = |site: Site| self.tissue.reference_position(site).xy().into();
        let last = self.shafts.vertices_backwards(shaft).next().map(|last| at(self.shafts.point(last).into()));
        if let Some(last) = last {
            self.shafts.reopen(shaft, last, at(tip.site));
        }
    }

    /// Ends a shaft after its first `kept` vertices, with its cone at a site.
    fn stand(&mut self, cone: u32, kept: usize, (site, time): (Site, f32), heading: Option<Vector3<f64>>) {
        self.relay(cone, kept, &[], ShaftPoint { site, time });
        let position = self.position(site);
        self.change(cone, |_, cone| {
            (*cone.site, cone.position.0) = (site, position.xy());
            cone.velocity.growth = Vector2::zeros();
            cone.spring.change(|spring| spring.heading = heading.unwrap_or(spring.heading));
        });
    }
}
