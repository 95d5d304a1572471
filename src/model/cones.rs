//! How a mechanism meets the growth cones: one view of each that is growing, and the spring state it may add to.

use super::components::{GrowthCone, Position, ReceptorWeights, Site, Spring, SpringState, Status};
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
    pub fn for_each(&mut self, act: impl Fn(Cone, &mut Spring) + Sync) {
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
                    let (index, position) = (first + i, position.in_space());
                    let cone = Cone { index, identity, site: *site, position, receptors: &receptors.0 };
                    spring.change(|spring| act(cone, spring));
                });
            first += count;
        }
    }

    /// What `look` sees of each growing cone, in their order.
    pub fn collect<T: Send>(&self, look: impl Fn(Cone, &Spring) -> T + Sync) -> Vec<T> {
        let columns = self.columns();
        let mut seen = Vec::new();
        for (first, table) in &columns.0 {
            let growing = table.1.par_iter().enumerate().with_min_len(CHUNK);
            let growing = growing.filter(|(_, status)| **status == Status::Growing);
            seen.par_extend(growing.map(|(i, _)| {
                let (cone, spring) = of_table(*first, table, i);
                look(cone, &spring)
            }));
        }
        seen
    }

    /// All cones, to be looked at by place.
    pub fn columns(&self) -> ConeColumns<'_> {
        let mut first = 0;
        let mut tables = Vec::new();
        for table in self.query.contiguous_iter().into_iter().flatten() {
            tables.push((first, table));
            first += table.0.len();
        }
        ConeColumns(tables)
    }

    /// Calls `act` for the cones at some places, each with a value of its own.
    pub fn apply_at<T>(&mut self, values: impl Iterator<Item = (usize, T)>, act: impl Fn(&mut Spring, T)) {
        let mut first = 0;
        let mut tables = Vec::new();
        for (identities, .., springs) in self.query.contiguous_iter_mut().into_iter().flatten() {
            tables.push((first, springs));
            first += identities.len();
        }
        for (index, value) in values {
            let table = tables.partition_point(|(first, _)| *first <= index) - 1;
            let (first, springs) = &mut tables[table];
            springs.bypass_change_detection()[index - *first].change(|spring| act(spring, value));
        }
    }

    /// Adds `pulls`, one a growing cone in the order of [`Self::collect`], times `weight`.
    pub fn add_pulls(&mut self, pulls: &[Vector3<f64>], weight: f64) {
        self.apply(pulls, |spring, pull| spring.pull += pull * weight);
    }

    /// Calls `act` for each growing cone with its own of `values`, which are in the order of [`Self::collect`].
    pub fn apply<T>(&mut self, values: &[T], act: impl Fn(&mut Spring, &T)) {
        let growing = self.query.iter_mut().filter(|(_, status, ..)| **status == Status::Growing);
        for ((.., mut spring), value) in growing.zip(values) {
            spring.change(|spring| act(spring, value));
        }
    }
}

/// Neighbouring cones, component by component.
type Table<'a> = (&'a [GrowthCone], &'a [Status], &'a [Site], &'a [Position], &'a [ReceptorWeights], &'a [SpringState]);

/// The i-th cone of a table whose first has the place `first`.
fn of_table<'a>(first: usize, table: &Table<'a>, i: usize) -> (Cone<'a>, Spring) {
    let (identities, _, sites, positions, receptors, springs) = table;
    let (index, receptors) = (first + i, &*receptors[i].0);
    let cone = Cone { index, identity: &identities[i], site: sites[i], position: positions[i].in_space(), receptors };
    (cone, springs[i].seen())
}

/// All growth cones, to be looked at by place.
pub struct ConeColumns<'a>(Vec<(usize, Table<'a>)>);

/// Where a growth cone is, and which way it heads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bearing {
    /// Material site.
    pub site: Site,
    /// Position (µm).
    pub position: Vector3<f64>,
    /// Unit heading.
    pub heading: Vector3<f64>,
}

impl ConeColumns<'_> {
    /// The bearing of the cone at a place that some view of it [named](Cone::index). Nothing else of it is looked at: cones that lie apart in
    /// memory are waited for.
    #[inline]
    pub fn bearing(&self, index: usize) -> Bearing {
        let table = self.0.partition_point(|(first, _)| *first <= index) - 1;
        let (first, (_, _, sites, positions, _, springs)) = &self.0[table];
        let i = index - first;
        Bearing { site: sites[i], position: positions[i].in_space(), heading: springs[i].seen().heading }
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
    pub fn for_each(&mut self, act: impl Fn(Cone, &Spring, &mut C) + Sync) {
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
                    let (index, position) = (first + i, position.in_space());
                    act(Cone { index, identity, site: *site, position, receptors: &[] }, &spring.seen(), own);
                });
            first += count;
        }
    }
}
