//! Whether records that were read back can be those of a run of their scene. What they were made of is not at hand any more, but they
//! must fit each other, the scene that begins them, and the state that was read back with them.

use super::Recorder;
use crate::model::clock::Clock;
use bevy_ecs::prelude::World;

impl Recorder {
    /// What makes these records impossible in a run that began with those of `fresh` and has come to `world`; none if nothing does.
    pub fn defect(&self, fresh: &Self, world: &World) -> Option<&'static str> {
        let now = world.resource::<Clock>().now;
        let checks: [(&'static str, &dyn Fn() -> bool); 5] = [
            ("they look at other instants", &|| {
                let same = self.interval == fresh.interval
                    && self.interval.is_none_or(|every| is_next(self.next_point, every, now));
                same && fresh.figures.ends_with(&self.figures)
                    && (self.film.is_none() || fresh.frames.ends_with(&self.frames))
            }),
            ("a film is there that was not asked for, or not there", &|| match self.given_up {
                Some(_) => fresh.film.is_some() && self.film.is_none() && self.frames.is_empty(),
                None => fresh.film.is_some() == self.film.is_some(),
            }),
            ("the trajectories are those of another table", &|| self.trajectories.continues(&fresh.trajectories)),
            ("a picture shows another scene", &|| {
                let taken = fresh.figures.len() - self.figures.len();
                self.snapshots.len() <= taken && self.snapshots.iter().all(|snapshot| snapshot.may_be_of(world))
            }),
            ("the film shows another scene", &|| self.film.as_ref().is_none_or(|film| film.may_be_of(world))),
        ];
        checks.iter().find(|(_, fine)| !fine()).map(|(words, _)| *words)
    }
}

/// Whether `next` is an instant that something looked at at every multiple of `every` may wait for at `now` (ticks).
pub fn is_next(next: u64, every: u64, now: u64) -> bool {
    next.is_multiple_of(every) && next <= now.saturating_add(every)
}
