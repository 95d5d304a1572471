//! Whether a state that was read back can be one of its scene. Its checksum tells damage; this tells what has the right checksum and was
//! never written all the same: what the scene alone decides must be as the scene decides it, and what names a cell, a cone or a block must
//! name one that is there. Looked at is the state of the core; mechanisms [look at their own](super::mechanism::ModelBuilder::sound_if).

use super::adaptive::AdaptiveSteps;
use super::births::BirthQueue;
use super::clock::{Clock, StageTime};
use super::components::{GrowthCone, Site, Status};
use super::health::Counters;
use super::keep::Damage;
use super::remodel::SpareCones;
use super::shafts::Shafts;
use super::tissue::Tissue;
use bevy_ecs::prelude::{With, World};

/// The latest stage over the end of the run: it is a sum, which round-off may lift above the end.
const LATEST: f64 = 1.0 + 1e-9;

/// What a world that has just been put together says of any state of its scene.
pub(super) struct Given {
    clock: Option<Clock>,
    steps: Option<AdaptiveSteps>,
    births: Option<BirthQueue>,
    spares: Option<SpareCones>,
    shafts: Option<Shafts>,
    cones: Vec<(u32, u16)>,
}

impl Given {
    /// Of a world that has just been put together.
    pub(super) fn of(world: &World) -> Self {
        Self {
            clock: world.get_resource::<Clock>().copied(),
            steps: world.get_resource::<AdaptiveSteps>().cloned(),
            births: world.get_resource::<BirthQueue>().cloned(),
            spares: world.get_resource::<SpareCones>().cloned(),
            shafts: world.get_resource::<Shafts>().cloned(),
            cones: identities(world),
        }
    }

    /// Whether the world's state, by now read back, fits.
    ///
    /// # Errors
    /// The part that does not.
    pub(super) fn fits(&self, world: &World) -> Result<(), Damage> {
        let cells = world.get_resource::<Tissue>().map_or(usize::MAX, |tissue| tissue.mesh.cell_count());
        let clock = world.get_resource::<Clock>();
        let stage = world.get_resource::<StageTime>();
        let checks = [
            ("clock", both(&self.clock, clock, Clock::may_become)),
            (
                "stage time",
                both(&self.clock, stage, |clock, stage| {
                    (0.0..=LATEST * clock.grid.hours(clock.end)).contains(&stage.0)
                }),
            ),
            ("adaptive steps", both(&self.steps, world.get_resource(), |given, read| self.steps_fit(given, read))),
            ("births", both(&self.births, world.get_resource(), BirthQueue::may_become)),
            ("spare cones", both(&self.spares, world.get_resource(), SpareCones::may_become)),
            ("counters", world.get_resource().is_none_or(Counters::may_be)),
            ("identities", identities(world) == self.cones),
            ("statuses", clock.is_none_or(|clock| nobody_grows_before_birth(clock.now, world))),
            ("sites", sites_are_in(cells, world)),
        ];
        if let Some((name, _)) = checks.iter().find(|(_, fine)| !fine) {
            return Err(Damage(format!("`{name}`: no run of this scene comes to it")));
        }
        let defect = self.shafts.as_ref().zip(world.get_resource::<Shafts>());
        match defect.and_then(|(fresh, read)| read.defect(fresh, cells)) {
            Some(defect) => Err(Damage(format!("`shafts`: {defect}"))),
            None => Ok(()),
        }
    }

    fn steps_fit(&self, given: &AdaptiveSteps, read: &AdaptiveSteps) -> bool {
        let step = self.clock.map_or(1, |clock| clock.grid.step_ticks());
        given.may_become(read, step, self.cones.len())
    }
}

/// Whether two things that are both there, or not, belong together.
fn both<A, B>(given: &Option<A>, read: Option<&B>, belong: impl FnOnce(&A, &B) -> bool) -> bool {
    given.as_ref().zip(read).is_none_or(|(given, read)| belong(given, read))
}

/// Number and population of each cone, in order.
fn identities(world: &World) -> Vec<(u32, u16)> {
    let Some(mut cones) = world.try_query_filtered::<&GrowthCone, With<GrowthCone>>() else { return Vec::new() };
    cones.iter(world).map(|cone| (cone.axon, cone.population)).collect()
}

fn sites_are_in(cells: usize, world: &World) -> bool {
    let Some(mut sites) = world.try_query_filtered::<&Site, With<GrowthCone>>() else { return true };
    sites.iter(world).all(|site| site.is_in(cells))
}

/// Whether all cones that have begun were born by now (ticks).
fn nobody_grows_before_birth(now: u64, world: &World) -> bool {
    let Some(mut cones) = world.try_query::<(&GrowthCone, &Status)>() else { return true };
    let fits = |cone: &GrowthCone, status| match status {
        Status::Unborn => true,
        // Seen only within steps.
        Status::Waiting => false,
        _ => cone.birth <= now,
    };
    cones.iter(world).all(|(cone, status)| fits(cone, *status))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::clock::TimeGrid;

    fn world(now: u64, cones: [(u64, Status); 2]) -> World {
        let mut world = World::new();
        world.insert_resource(Clock { now, ..Clock::new(TimeGrid::new(0.1).unwrap(), 1 << 40) });
        for (axon, (birth, status)) in (0..).zip(cones) {
            world.spawn((GrowthCone { axon, population: 0, speed: 1.0, birth }, status));
        }
        world
    }

    #[test]
    fn counts_beyond_those_of_any_run_are_refused() {
        let with = |indexed_segments: u64| {
            let mut world = world(0, [(0, Status::Unborn); 2]);
            world.insert_resource(Counters { indexed_segments, ..Counters::default() });
            world
        };
        let fits = |count: u64| Given::of(&with(0)).fits(&with(count)).map_err(|damage| damage.to_string());
        assert_eq!(fits(1 << 40), Ok(()));
        assert!(fits(u64::MAX).unwrap_err().contains("`counters`"));
    }

    #[test]
    fn steps_of_no_run_are_refused() {
        let with = |levels: Vec<u8>| {
            let mut world = world(0, [(0, Status::Unborn); 2]);
            world.insert_resource(AdaptiveSteps { levels, ..AdaptiveSteps::new(0.01, 10.0) });
            world
        };
        let fits = |levels| Given::of(&with(Vec::new())).fits(&with(levels)).map_err(|damage| damage.to_string());
        assert_eq!((fits(Vec::new()), fits(vec![0, 3])), (Ok(()), Ok(())));
        for levels in [vec![1], vec![0, 64]] {
            assert!(fits(levels).unwrap_err().contains("`adaptive steps`"));
        }
    }

    #[test]
    fn a_cone_that_grows_before_its_birth_is_of_no_run() {
        let step = TimeGrid::new(0.1).unwrap().step_ticks();
        let fresh = world(0, [(step, Status::Unborn), (u64::MAX, Status::Unborn)]);
        let fits = |now: u64, first: (u64, Status)| {
            Given::of(&fresh)
                .fits(&world(now, [first, (u64::MAX, Status::Unborn)]))
                .map_err(|damage| damage.to_string())
        };
        assert_eq!(fits(step, (step, Status::Growing)), Ok(()));
        assert_eq!(fits(4 * step, (step, Status::Arrived)), Ok(()));
        assert_eq!(fits(step, (2 * step, Status::Unborn)), Ok(()));
        for status in [Status::Growing, Status::Retracting] {
            let refused = fits(step, (2 * step, status)).unwrap_err();
            assert!(refused.contains("`statuses`"), "{refused}");
        }
        assert!(fits(step, (step, Status::Waiting)).is_err(), "none waits between steps");
    }
}
