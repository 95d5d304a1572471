//! Zippering: shafts that cross adhere, and the point where they part moves until adhesion and tension balance.
//!
//! Two shafts under tension T that adhere with a force S part at a zipper point at an angle β. What pulls the point, and its speed, are
//! (Šmít et al., eLife 6:e19907, 2017, doi:10.7554/eLife.19907)
//!
//! ```text
//! F = S − 2T(1 − cos β/2),   dy/dt = F / (2 η_e (cos β/2 − 1)²/L + η_Z),
//! ```
//!
//! which stops at cos β*/2 = 1 − S/(2T). Written for arms that are not alike, F = T(u₁ + u₂) + (2T − S) u_z with the unit vectors along both
//! arms and the zipped part; that is the formula above, along the bisector, where they are alike. Mouse olfactory axons: T = 679 pN, S = 102 pN
//! (52 to 186), β of 51° on average, 0.3 to 2 µm/min.
//!
//! Shafts zip once both have stopped growing, and let go when one begins to retract. A crossing opens into two points
//! that move apart, on the sides where the shafts meet at less than 90°. Ours: an arm is pulled straight over `arm` of its
//! length; a pair zips at its first crossing only; a crossing within `arm` of the end of a shaft, of a fork or of another
//! zipper point is left alone, and zipper points stop there; drag of the zipped part is neglected.

use crate::numerics::zipper::{Arms, Balance, BoxedLine};
use crate::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

keys! {
    /// Shafts that adhere where they cross; dy/dt = (S − 2T(1 − cos β/2))/(2η_e(cos β/2 − 1)²/L + η_Z).
    pub struct Zippering {
        /// Tension T of a shaft. At most 100 nN, ours: a zipper point moves in time steps of L η_Z/(4T).
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "x-typical" = [200.0, 2000.0]))]
        pub tension: Force = Force(679.0),
        /// Force S with which two shafts adhere.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 200.0]))]
        pub adhesion: Force = Force(102.0),
        /// Drag η_Z of a zipper point. Ours: 1.4 µm/min where β is small.
        #[schemars(extend("minimum" = 0.05, "x-typical" = [0.5, 5.0]))]
        pub drag: Drag = Drag(1.2),
        /// Elongational viscosity η_e of a shaft. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 1000.0]))]
        pub elongational_viscosity: ElongationalViscosity = ElongationalViscosity(100.0),
        /// Length L of an arm that is pulled straight. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [10.0, 100.0]))]
        pub arm: Length = Length(30.0),
    }
}

impl From<&Zippering> for Balance {
    fn from(law: &Zippering) -> Self {
        Self {
            tension: law.tension.0,
            adhesion: law.adhesion.0,
            drag: law.drag.0,
            elongational_viscosity: law.elongational_viscosity.0,
        }
    }
}

/// A point of a shaft that takes part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    point: ShaftPoint,
    /// The zipper point that it is, by number of the bond and its end; ends and forks of shafts are held too.
    held: Option<Held>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    End,
    Zipper { bond: usize, forward: bool },
}

kept! { struct Node { point, held } }

impl Keep for Held {
    fn keep(&self, into: &mut Vec<u8>) {
        match *self {
            Self::End => None,
            Self::Zipper { bond, forward } => Some((bond, forward)),
        }
        .keep(into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        let zipper: Option<(usize, bool)> = from.read()?;
        Ok(zipper.map_or(Self::End, |(bond, forward)| Self::Zipper { bond, forward }))
    }
}

/// Two shafts that zip; `same` if they run the same way. Its ends are the zipper points before and after on the first shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bond {
    shafts: [u32; 2],
    same: bool,
}

kept! { struct Bond { shafts, same } }

impl Bond {
    /// The other shaft, if one is bound.
    fn partner(&self, shaft: u32) -> Option<u32> {
        let [one, other] = self.shafts;
        if one == shaft { Some(other) } else { (other == shaft).then_some(one) }
    }
}

/// The zippers of a run.
#[derive(Debug, Clone, Default, Resource)]
pub struct Zippers {
    last: f64,
    resting: BTreeSet<u32>,
    lines: BTreeMap<u32, Vec<Node>>,
    /// None where a shaft has gone back to grow or to retract.
    bonds: Vec<Option<Bond>>,
    /// Shafts that have to be laid anew.
    changed: BTreeSet<u32>,
}

kept! { struct Zippers { last, resting, lines, bonds, changed } }

/// Farthest that a zipper point moves at once (µm).
const STRIDE: f64 = 0.25;
/// Slower than this (µm/h), a point is at rest.
const REST: f64 = 0.3;

/// Moves that the two ends of a pair may take within a step. Far more than the way along any shaft takes: forces that never come to
/// balance end the run.
#[derive(Debug, Clone, Copy, Resource)]
pub struct MostMoves(pub u32);

impl Mechanism for Zippering {
    const NAME: &'static str = "zippering";

    fn check(&self, _facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        wrong.demand(self.adhesion.0 <= 2.0 * self.tension.0, "/adhesion", || {
            format!("no angle balances an adhesion above twice the tension, {} pN", 2.0 * self.tension.0)
        });
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if self.adhesion.0 > 0.0 {
            model.phase(Phase::Remodel, zip);
        }
        model
            .insert(MostMoves(100_000))
            .insert(Zippers::default())
            .keep::<Zippers>()
            .sound_if::<Zippers>(Zippers::are_sound)
            .insert_law(self);
        Ok(())
    }
}

fn zip(
    (law, most): (Res<Law<Zippering>>, Res<MostMoves>),
    mut zippers: ResMut<Zippers>,
    mut remodelling: Remodelling,
    mut health: ResMut<Health>,
) {
    let now = remodelling.clock.hours();
    let span = now - std::mem::replace(&mut zippers.last, now);
    zippers.welcome(&law, &remodelling);
    let fastest = zippers.advance(&law, &remodelling, (span, most.0)).unwrap_or_else(|restless| {
        health.report(now, format!("zippering: {restless} do not come to rest within {} moves in one step", most.0));
        0.0
    });
    zippers.lay(&mut remodelling);
    remodelling.unrest.0 |= fastest > 0.0;
}

impl Zippers {
    /// Whether all that is named is there, and the last look was in the past.
    fn are_sound(world: &World) -> bool {
        let Some(zippers) = world.get_resource::<Self>() else { return true };
        let (cells, shafts) = (world.resource::<Tissue>().mesh.cell_count(), world.resource::<Shafts>().count());
        let sound = |(shaft, line): (&u32, &Vec<Node>)| {
            (*shaft as usize) < shafts
                && line.iter().all(|node| node.point.site.is_in(cells) && node.point.time.is_finite())
        };
        let known = |shaft: &u32| zippers.lines.contains_key(shaft);
        let now = world.resource::<Clock>().hours();
        (0.0..=now).contains(&zippers.last) && zippers.lines.iter().all(sound) && zippers.resting.iter().all(known)
    }

    /// Shafts that zip, in pairs, with the angle β (rad) at both ends now.
    pub fn angles(&self, place: impl Fn(Site) -> Vector3<f64>) -> Vec<[f64; 2]> {
        let angle = |bond: usize, forward: bool| self.arms((bond, forward), &place).map_or(0.0, |arms| arms.angle());
        let bound = (0..self.bonds.len()).filter(|&bond| self.bonds[bond].is_some());
        bound.map(|bond| [angle(bond, false), angle(bond, true)]).collect()
    }

    /// Lets go of shafts that no longer rest, and looks for crossings of those that have come to rest with all that rest.
    fn welcome(&mut self, law: &Zippering, remodelling: &Remodelling) {
        let standing = remodelling.standing();
        let rests = |number: u32| {
            let status = standing.get(number as usize).map(|cone| cone.status);
            matches!(status, Some(Status::Arrived | Status::Stalled | Status::Left))
        };
        for gone in self.resting.iter().copied().filter(|&number| !rests(number)).collect::<Vec<_>>() {
            self.release(gone);
        }
        let known = |number: &u32| self.resting.contains(number);
        let new: Vec<u32> = (0..standing.len() as u32).filter(|number| rests(*number) && !known(number)).collect();
        if new.is_empty() {
            return;
        }
        let mut boxed: BTreeMap<u32, BoxedLine> =
            self.lines.iter().map(|(&number, line)| (number, places(remodelling, line))).collect();
        for number in new {
            let line = nodes(remodelling, number);
            boxed.insert(number, places(remodelling, &line));
            self.lines.insert(number, line);
            for other in self.resting.iter().copied().collect::<Vec<_>>() {
                if self.bind(law, remodelling, ([number, other], &boxed)) {
                    for shaft in [number, other] {
                        boxed.insert(shaft, places(remodelling, &self.lines[&shaft]));
                    }
                }
            }
            self.resting.insert(number);
        }
    }

    /// Forgets a shaft; its partners keep the shape that they have.
    fn release(&mut self, shaft: u32) {
        self.resting.remove(&shaft);
        self.lines.remove(&shaft);
        self.changed.remove(&shaft);
        for (number, bond) in self.bonds.iter_mut().enumerate() {
            let Some(partner) = bond.and_then(|bond| bond.partner(shaft)) else { continue };
            *bond = None;
            let of_bond = |node: &&mut Node| matches!(node.held, Some(Held::Zipper { bond, .. }) if bond == number);
            self.lines.get_mut(&partner).into_iter().flatten().filter(of_bond).for_each(|node| node.held = None);
        }
    }

    /// Binds two shafts at their first crossing, if it is far from whatever holds them; returns whether it did.
    fn bind(
        &mut self,
        law: &Zippering,
        remodelling: &Remodelling,
        (shafts, boxed): ([u32; 2], &BTreeMap<u32, BoxedLine>),
    ) -> bool {
        let [Some(one), Some(other)] = shafts.map(|shaft| boxed.get(&shaft)) else { return false };
        let Some(found) = one.crossing(other) else { return false };
        let places = [one.points(), other.points()];
        let clear = |k: usize| is_clear(&self.lines[&shafts[k]], places[k], found[k], law.arm.0);
        if !(clear(0) && clear(1)) {
            return false;
        }
        let along = |k: usize| places[k][found[k].0 + 1] - places[k][found[k].0];
        let same = along(0).dot(&along(1)) >= 0.0;
        let bond = self.bonds.len();
        self.bonds.push(Some(Bond { shafts, same }));
        let (segment, share) = found[0];
        let site = remodelling.walked(self.lines[&shafts[0]][segment].point.site, along(0) * share);
        for k in 0..2 {
            let (segment, share) = found[k];
            let Some(line) = self.lines.get_mut(&shafts[k]) else { return false };
            let [before, after] = [segment, segment + 1].map(|node| line[node].point.time);
            let point = ShaftPoint { site, time: before + (share as f32) * (after - before) };
            let held = |late: bool| Some(Held::Zipper { bond, forward: late == (k == 0 || same) });
            line.splice(segment + 1..segment + 1, [false, true].map(|late| Node { point, held: held(late) }));
            self.changed.insert(shafts[k]);
        }
        true
    }

    /// Moves all zipper points over a time (h), each pair's by `most` moves; returns the speed of the fastest (µm/h).
    ///
    /// # Errors
    /// The pair that takes more, and where.
    fn advance(&mut self, law: &Zippering, remodelling: &Remodelling, (span, most): (f64, u32)) -> Result<f64, String> {
        let balance = Balance::from(law);
        let mut fastest = 0.0f64;
        for bond in (0..self.bonds.len()).filter(|&bond| self.bonds[bond].is_some()).collect::<Vec<_>>() {
            let (mut left, mut moves) = (span, 0);
            while left > 0.0 {
                if moves == most {
                    return Err(self.whereabouts(bond, remodelling));
                }
                moves += 1;
                let mut taken = left;
                let velocities = [false, true].map(|forward| {
                    self.straighten((bond, forward), law.arm.0, remodelling);
                    let Some(arms) = self.arms((bond, forward), |site| remodelling.position(site)) else {
                        return Vector3::zeros();
                    };
                    taken = taken.min(balance.instant(&arms));
                    let velocity = balance.velocity(&arms);
                    if velocity.norm() > REST { velocity } else { Vector3::zeros() }
                });
                let speed = velocities.iter().map(|velocity| velocity.norm()).fold(0.0, f64::max);
                if speed == 0.0 {
                    break;
                }
                taken = taken.min(STRIDE / speed);
                for (forward, velocity) in [false, true].into_iter().zip(velocities) {
                    self.shift((bond, forward), velocity * taken, remodelling);
                }
                left -= taken;
                fastest = fastest.max(speed);
            }
        }
        Ok(fastest)
    }

    /// A pair and where its ends are, in words.
    fn whereabouts(&self, bond: usize, remodelling: &Remodelling) -> String {
        let end = |forward: bool| {
            let (shaft, at, _) = self.place((bond, forward), 0)?;
            let place = remodelling.position(self.lines.get(&shaft)?.get(at)?.point.site);
            Some(format!("({:.4}, {:.4}) um", place.x, place.y))
        };
        let ends: Vec<String> = [false, true].into_iter().filter_map(end).collect();
        let [one, other] = self.bonds[bond].map_or([0; 2], |bond| bond.shafts);
        format!("the points where the shafts {one} and {other} part, at {}", ends.join(" and "))
    }

    /// Place of a zipper point in the line of one of its shafts, and the direction in which its arm goes on there.
    fn place(&self, (bond, forward): (usize, bool), k: usize) -> Option<(u32, usize, isize)> {
        let Bond { shafts, same } = (*self.bonds.get(bond)?)?;
        let held = Some(Held::Zipper { bond, forward });
        let at = self.lines.get(&shafts[k])?.iter().position(|node| node.held == held)?;
        Some((shafts[k], at, if forward == (k == 0 || same) { 1 } else { -1 }))
    }

    /// Strikes out what keeps an arm shorter than `arm` (µm), unless it is held.
    fn straighten(&mut self, end: (usize, bool), arm: f64, remodelling: &Remodelling) {
        for k in 0..2 {
            while let Some((shaft, at, step)) = self.place(end, k) {
                let next = at.wrapping_add_signed(step);
                let Some(line) = self.lines.get_mut(&shaft) else { return };
                let far = |node: &Node| {
                    node.held.is_some()
                        || (remodelling.position(node.point.site) - remodelling.position(line[at].point.site)).norm()
                            >= arm
                };
                if line.get(next).is_none_or(far) {
                    break;
                }
                line.remove(next);
            }
        }
    }

    /// The arms of a zipper point, and its zipped part; none where an arm has no length left.
    fn arms(&self, end: (usize, bool), place: impl Fn(Site) -> Vector3<f64>) -> Option<Arms> {
        let site = |(shaft, at): (u32, usize)| Some(place(self.lines.get(&shaft)?.get(at)?.point.site));
        let (shaft, at, _) = self.place(end, 0)?;
        let point = site((shaft, at))?;
        let arm = |k: usize| {
            let (shaft, at, step) = self.place(end, k)?;
            Some(site((shaft, at.wrapping_add_signed(step)))? - point)
        };
        let (shaft, other, _) = self.place((end.0, !end.1), 0)?;
        Arms::new([arm(0)?, arm(1)?], site((shaft, other))? - point)
    }

    /// Moves a zipper point on both shafts.
    fn shift(&mut self, end: (usize, bool), by: Vector3<f64>, remodelling: &Remodelling) {
        let Some((shaft, at, _)) = self.place(end, 0).filter(|_| by != Vector3::zeros()) else { return };
        let site = remodelling.walked(self.lines[&shaft][at].point.site, by);
        for k in 0..2 {
            let Some((shaft, at, _)) = self.place(end, k) else { return };
            if let Some(node) = self.lines.get_mut(&shaft).and_then(|line| line.get_mut(at)) {
                node.point.site = site;
            }
            self.changed.insert(shaft);
        }
    }

    /// Lays the shafts anew whose zipper points have moved.
    fn lay(&mut self, remodelling: &mut Remodelling) {
        for shaft in std::mem::take(&mut self.changed) {
            let Some((tip, path)) = self.lines.get(&shaft).and_then(|line| line.split_last()) else { continue };
            let mut points = Vec::with_capacity(path.len());
            for (node, next) in path.iter().zip(path.iter().skip(1).chain([tip])) {
                points.push(node.point);
                points.extend(remodelling.between(node.point, next.point));
            }
            remodelling.relay(shaft, 1, points.get(1..).unwrap_or_default(), tip.point);
        }
    }
}

/// The points of a shaft, its tip last; its ends and forks are held.
fn nodes(remodelling: &Remodelling, shaft: u32) -> Vec<Node> {
    let shafts = &remodelling.shafts;
    let stored = shafts.vertices(shaft as usize);
    let tip = ShaftPoint { site: shafts.tip(shaft).into(), time: shafts.tip_time(shaft) };
    let point = |vertex| ShaftPoint { site: shafts.point(vertex).into(), time: shafts.time(vertex) };
    let forks = remodelling.fork_times(shaft);
    let mut line: Vec<Node> = stored
        .map(point)
        .chain([tip])
        .map(|point| Node { point, held: forks.contains(&point.time).then_some(Held::End) })
        .collect();
    for end in [0, line.len() - 1] {
        line[end].held = Some(Held::End);
    }
    line
}

/// Where the points of a line are now.
fn places(remodelling: &Remodelling, line: &[Node]) -> BoxedLine {
    BoxedLine::new(line.iter().map(|node| remodelling.position(node.point.site)).collect())
}

/// Whether a crossing at a share of a segment is at least `arm` (µm) of path away from every held node, on a line at these places.
fn is_clear(line: &[Node], places: &[Vector3<f64>], (segment, share): (usize, f64), arm: f64) -> bool {
    let at = places[segment].lerp(&places[segment + 1], share);
    let side = |order: &mut dyn Iterator<Item = usize>| {
        let (mut from, mut path) = (at, 0.0);
        for i in order {
            path += (places[i] - from).norm();
            if path >= arm {
                return true;
            }
            if line[i].held.is_some() {
                return false;
            }
            from = places[i];
        }
        false
    };
    side(&mut (0..=segment).rev()) && side(&mut (segment + 1..line.len()))
}
