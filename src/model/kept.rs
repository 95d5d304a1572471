//! What a run has to remember to go on as if it had never stopped: all state that depends on what happened before.
//!
//! A run is a function of scene, program and time, but for this. Mesh, load path, cue fields, random draws and the lists of
//! neighbours follow from the scene (and from what is kept) bit for bit, and are made anew. The core registers its own state here, and
//! each mechanism what it [keeps](super::mechanism::ModelBuilder::keep) besides.

use super::adaptive::AdaptiveSteps;
use super::births::BirthQueue;
use super::clock::{Clock, StageTime};
use super::components::{GrowthCone, Journey, Position, ReceptorWeights, Site, SpringState, Status, Velocity};
use super::health::{Counters, Health};
use super::keep::{Damage, Keep, KeptBytes};
use super::remodel::{SpareCones, Unrest};
use super::shafts::Shafts;
use super::sound::Given;
use super::stopwatch::Stopwatch;
use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::{Component, Resource, With, World};

type Writer = fn(&World, &mut Vec<u8>);
type Reader = fn(&mut World, &mut KeptBytes) -> Result<(), Damage>;
type Rebuilder = fn(&mut World);
type Check = fn(&World) -> bool;

/// One thing that is kept.
#[derive(Debug, Clone)]
struct Entry {
    name: String,
    write: Writer,
    read: Reader,
}

/// All state of a world that is kept, in a fixed order.
#[derive(Debug, Clone, Default, Resource)]
pub struct KeptState {
    entries: Vec<Entry>,
    rebuilders: Vec<Rebuilder>,
    checks: Vec<(String, Check)>,
}

impl KeptState {
    /// The state of the core of a world that has been put together.
    pub fn of_core(world: &World) -> Self {
        let mut kept = Self::default();
        kept.resource::<Clock>("clock").resource::<StageTime>("stage time").resource::<BirthQueue>("births");
        kept.resource::<Counters>("counters").resource::<Health>("health").resource::<Stopwatch>("stopwatch");
        kept.resource::<Unrest>("unrest").resource::<SpareCones>("spare cones").resource::<Shafts>("shafts");
        if world.contains_resource::<AdaptiveSteps>() {
            kept.resource::<AdaptiveSteps>("adaptive steps");
        }
        kept.of_cones::<GrowthCone>("identities").of_cones::<Status>("statuses").of_cones::<Site>("sites");
        kept.of_cones::<Position>("positions").of_cones::<Velocity>("velocities").of_cones::<SpringState>("springs");
        kept.of_cones::<ReceptorWeights>("receptor weights").of_cones::<Journey>("journeys");
        kept
    }

    /// Keeps a resource under a name.
    pub fn resource<R: Resource<Mutability = Mutable> + Keep>(&mut self, name: &str) -> &mut Self {
        self.add(name, write_resource::<R>, read_resource::<R>)
    }

    /// Keeps a component of all growth cones under a name.
    pub fn of_cones<C: Component<Mutability = Mutable> + Keep>(&mut self, name: &str) -> &mut Self {
        self.add(name, write_components::<C>, read_components::<C>)
    }

    /// Runs `rebuild` once all is read back: for what follows from it and is costly to make at every step.
    pub fn rebuilt_by(&mut self, rebuild: Rebuilder) -> &mut Self {
        self.rebuilders.push(rebuild);
        self
    }

    /// Refuses what was read back unless `fits` says that a run of the scene may come to it; `name` says of what.
    pub fn sound_if(&mut self, name: &str, fits: Check) -> &mut Self {
        self.checks.push((name.to_owned(), fits));
        self
    }

    fn add(&mut self, name: &str, write: Writer, read: Reader) -> &mut Self {
        self.entries.push(Entry { name: name.to_owned(), write, read });
        self
    }

    /// Writes down the state of a world: name and length before each part.
    pub fn write(&self, world: &World) -> Vec<u8> {
        let mut bytes = Vec::new();
        for Entry { name, write, .. } in &self.entries {
            name.keep(&mut bytes);
            let place = bytes.len();
            0u64.keep(&mut bytes);
            write(world, &mut bytes);
            let length = (bytes.len() - place - size_of::<u64>()) as u64;
            bytes[place..place + size_of::<u64>()].copy_from_slice(&length.to_le_bytes());
        }
        bytes
    }

    /// Brings a world that has just been put together to the state that was written down of another one of the same scene.
    ///
    /// # Errors
    /// The first part that does not fit; the world is of no use then.
    pub fn read(&self, world: &mut World, bytes: &[u8]) -> Result<(), Damage> {
        let given = Given::of(world);
        let mut from = KeptBytes::new(bytes);
        for Entry { name, read, .. } in &self.entries {
            let found: String = from.read()?;
            if found != *name {
                return Err(Damage(format!("it holds `{found}` where this scene keeps `{name}`")));
            }
            let length: usize = from.read()?;
            let mut part = KeptBytes::new(from.take(length)?);
            read(world, &mut part).map_err(|damage| Damage(format!("`{name}`: {damage}")))?;
            if part.left() > 0 {
                return Err(Damage(format!("`{name}`: {} bytes are too many", part.left())));
            }
        }
        if from.left() > 0 {
            return Err(Damage(format!("it holds {} bytes more than this scene keeps", from.left())));
        }
        given.fits(world)?;
        if let Some((name, _)) = self.checks.iter().find(|(_, fits)| !fits(world)) {
            return Err(Damage(format!("`{name}`: no run of this scene comes to it")));
        }
        self.rebuilders.iter().for_each(|rebuild| rebuild(world));
        Ok(())
    }
}

fn write_resource<R: Resource + Keep>(world: &World, into: &mut Vec<u8>) {
    world.get_resource::<R>().into_iter().for_each(|resource| resource.keep(into));
}

fn read_resource<R: Resource<Mutability = Mutable> + Keep>(
    world: &mut World,
    from: &mut KeptBytes,
) -> Result<(), Damage> {
    let read = from.read::<R>()?;
    world.insert_resource(read);
    Ok(())
}

fn write_components<C: Component + Keep>(world: &World, into: &mut Vec<u8>) {
    let Some(mut cones) = world.try_query_filtered::<&C, With<GrowthCone>>() else { return };
    cones.iter(world).len().keep(into);
    cones.iter(world).for_each(|component| component.keep(into));
}

fn read_components<C: Component<Mutability = Mutable> + Keep>(
    world: &mut World,
    from: &mut KeptBytes,
) -> Result<(), Damage> {
    let mut cones = world.query_filtered::<&mut C, With<GrowthCone>>();
    let (found, wanted) = (from.read::<usize>()?, cones.iter(world).len());
    if found != wanted {
        return Err(Damage(format!("{found} growth cones instead of {wanted}")));
    }
    for mut component in cones.iter_mut(world) {
        *component = from.read()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Resource)]
    struct Memory {
        number: f64,
    }
    crate::kept! { struct Memory { number } }

    fn world(numbers: &[f64]) -> (World, KeptState) {
        let mut world = World::new();
        world.insert_resource(Memory { number: 0.1 });
        for number in numbers {
            let cone = GrowthCone { axon: 0, population: 0, speed: 1.0, birth: 0 };
            world.spawn((cone, Journey { length: *number, ..Journey::default() }));
        }
        let mut kept = KeptState::default();
        kept.resource::<Memory>("memory").of_cones::<Journey>("journeys");
        (world, kept)
    }

    #[test]
    fn what_is_written_comes_back_into_a_fresh_world_and_what_follows_from_it_is_rebuilt() {
        let (mut world_before, kept) = world(&[1.0, 2.0]);
        world_before.insert_resource(Memory { number: 0.7 });
        let bytes = kept.write(&world_before);
        let (mut fresh, mut kept) = world(&[0.0, 0.0]);
        kept.rebuilt_by(|world| world.resource_mut::<Memory>().number *= 2.0);
        kept.read(&mut fresh, &bytes).unwrap();
        assert_eq!(fresh.resource::<Memory>().number, 1.4);
        let mut journeys = fresh.query::<&Journey>();
        assert_eq!(journeys.iter(&fresh).map(|journey| journey.length).collect::<Vec<_>>(), [1.0, 2.0]);
    }

    #[test]
    fn what_a_mechanism_says_cannot_be_is_refused_before_anything_is_rebuilt() {
        let (before, kept) = world(&[1.0]);
        let bytes = kept.write(&before);
        let (mut fresh, mut kept) = world(&[0.0]);
        kept.sound_if("memory", |world| world.resource::<Memory>().number > 0.5);
        kept.rebuilt_by(|world| world.resource_mut::<Memory>().number = 9.0);
        assert_eq!(
            kept.read(&mut fresh, &bytes).unwrap_err().to_string(),
            "`memory`: no run of this scene comes to it"
        );
        assert_eq!(fresh.resource::<Memory>().number, 0.1);
    }

    #[test]
    fn state_of_another_scene_is_refused_with_the_part_that_does_not_fit() {
        let (before, kept) = world(&[1.0, 2.0]);
        let bytes = kept.write(&before);
        let refused = |kept: &KeptState, cones: &[f64], bytes: &[u8]| {
            kept.read(&mut world(cones).0, bytes).unwrap_err().to_string()
        };
        assert_eq!(refused(&kept, &[1.0], &bytes), "`journeys`: 2 growth cones instead of 1");
        let mut other = KeptState::default();
        other.of_cones::<Journey>("journeys");
        assert_eq!(refused(&other, &[1.0, 2.0], &bytes), "it holds `memory` where this scene keeps `journeys`");
        let mut less = KeptState::default();
        less.resource::<Memory>("memory");
        assert!(refused(&less, &[1.0, 2.0], &bytes).ends_with("more than this scene keeps"));
        for cut in 0..bytes.len() {
            assert!(kept.read(&mut world(&[0.0, 0.0]).0, &bytes[..cut]).is_err(), "cut at {cut}");
        }
    }
}
