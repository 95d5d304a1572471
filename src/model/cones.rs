//! How a mechanism meets the growth cones: one view of each that is growing, and the spring state it may add to.

use super::components::{GrowthCone, Position, ReceptorWeights, Site, SpringState, Status};
use bevy_ecs::prelude::{Component, Query, With};
use bevy_ecs::system::SystemParam;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Cones handled by one task: fixed, so that the work is cut the same way on any number of threads.
const CHUNK: usize = 64;

/// What a mechanism may read of a growth cone at a stage.
#[derive(Debug, Clone, Copy)]
pub struct Cone<'a> {
    /// Place in the order of all cones, which is the number of its shaft.
    pub index: usize,
    /// Identity, population, nominal speed, birth.
    pub identity: &'a GrowthCone,
    /// Material site.
    pub site: Site,
    /// Position (µm).
    pub position: Vector3<f64>,
    /// Receptor weights λ_i(t).
    pub receptors: &'a [f64],
}

/// What a term reads of a cone, and the spring state it writes.
type TermData = (
    &'static GrowthCone,
    &'static Status,
    &'static Site,
    &'static Position,
    &'static ReceptorWeights,
    &'static mut SpringState,
);

/// All growth cones, for a term of the right-hand side.
#[derive(SystemParam)]
pub struct Cones<'w, 's> {
    query: Query<'w, 's, TermData, With<GrowthCone>>,
}

impl Cones<'_, '_> {
    /// Calls `act` for every growing cone, in parallel. `act` reads the cone and writes its own spring state, so the result does not
    /// depend on the number of threads.
    pub fn for_each(&mut self, act: impl Fn(Cone, &mut SpringState) + Sync) {
        let Ok(tables) = self.query.contiguous_iter_mut() else { return };
        let mut first = 0;
        for (identities, statuses, sites, positions, receptors, mut springs) in tables {
            let springs = springs.bypass_change_detection();
            let count = springs.len();
            (identities, statuses, sites, positions, receptors, springs)
                .into_par_iter()
                .with_min_len(CHUNK)
                .enumerate()
                .filter(|(_, (_, status, ..))| **status == Status::Growing)
                .for_each(|(i, (identity, _, site, position, receptors, spring))| {
                    let index = first + i;
                    act(Cone { index, identity, site: *site, position: position.0, receptors: &receptors.0 }, spring);
                });
            first += count;
        }
    }

    /// What `look` sees of each growing cone, in their order.
    pub fn collect<T>(&self, look: impl Fn(Cone, &SpringState) -> T) -> Vec<T> {
        let cones = self.query.iter().enumerate().filter(|(_, (_, status, ..))| **status == Status::Growing);
        cones
            .map(|(index, (identity, _, site, position, receptors, spring))| {
                look(Cone { index, identity, site: *site, position: position.0, receptors: &receptors.0 }, spring)
            })
            .collect()
    }

    /// Adds `pulls`, one a growing cone in the order of [`Self::collect`], times `weight`.
    pub fn add_pulls(&mut self, pulls: &[Vector3<f64>], weight: f64) {
        self.apply(pulls, |spring, pull| spring.pull += pull * weight);
    }

    /// Calls `act` for each growing cone with its own of `values`, which are in the order of [`Self::collect`].
    pub fn apply<T>(&mut self, values: &[T], act: impl Fn(&mut SpringState, &T)) {
        let growing = self.query.iter_mut().filter(|(_, status, ..)| **status == Status::Growing);
        for ((.., mut spring), value) in growing.zip(values) {
            act(&mut spring, value);
        }
    }
}

/// What a term reads of a cone that writes a component of its own.
type OwnData<C> =
    (&'static GrowthCone, &'static Status, &'static Site, &'static Position, &'static SpringState, &'static mut C);

/// All growth cones, for a term that writes a component of its own instead of the spring state.
#[derive(SystemParam)]
pub struct ConesWith<'w, 's, C: Component<Mutability = bevy_ecs::component::Mutable>> {
    query: Query<'w, 's, OwnData<C>, With<GrowthCone>>,
}

impl<C: Component<Mutability = bevy_ecs::component::Mutable>> ConesWith<'_, '_, C> {
    /// Calls `act` for every growing cone, in parallel, with its spring state to read and its component `C` to write.
    /// The view's receptors are empty.
    pub fn for_each(&mut self, act: impl Fn(Cone, &SpringState, &mut C) + Sync) {
        let Ok(tables) = self.query.contiguous_iter_mut() else { return };
        let mut first = 0;
        for (identities, statuses, sites, positions, springs, mut own) in tables {
            let own = own.bypass_change_detection();
            let count = own.len();
            (identities, statuses, sites, positions, springs, own)
                .into_par_iter()
                .with_min_len(CHUNK)
                .enumerate()
                .filter(|(_, (_, status, ..))| **status == Status::Growing)
                .for_each(|(i, (identity, _, site, position, spring, own))| {
                    let index = first + i;
                    act(Cone { index, identity, site: *site, position: position.0, receptors: &[] }, spring, own);
                });
            first += count;
        }
    }
}
