//! The tables that a scene may ask for: trajectories as columns, measures over time, axons.

use super::super::csv::Cell;
use super::super::leaves::leaves;
use super::super::measures::{MeasureOptions, path_length, straightness, turning_angle};
use super::super::output::WriteError;
use super::super::recorder::trajectory_rows;
use super::super::snapshot::{each_axon, extent_in_y, tips};
use super::super::summary::{counts, morphology};
use super::parquet::Kind;
use super::table::{Heading, Table};
use super::{Output, OutputError};
use crate::model::clock::Clock;
use crate::model::configuration::Configuration;
use crate::model::growth::Populations;
use crate::model::keep::{Keep, KeptBytes};
use crate::model::remodel::SpareCones;
use crate::scenario::scene::Tables;
use bevy_ecs::prelude::World;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A table that gets rows at each instant, and its files as they grow.
pub struct RowTable {
    table: Table,
    fill: fn(&mut Table, &World) -> Result<(), OutputError>,
}

impl RowTable {
    /// `trajectories.parquet`: what `trajectories.csv` has.
    ///
    /// # Errors
    /// What could not be written.
    pub fn trajectories(folder: &Path) -> Result<Self, OutputError> {
        let columns = [
            ("time", "h", Kind::Number),
            ("axon", "", Kind::Integer),
            ("status", "", Kind::Text),
            ("x", "um", Kind::Number),
            ("y", "um", Kind::Number),
            ("heading", "deg", Kind::Number),
        ];
        Ok(Self { table: Table::create(folder, "trajectories", Tables::Parquet, &columns)?, fill: add_tips })
    }

    /// `axons`: a row a time and axon or branch.
    ///
    /// # Errors
    /// What could not be written.
    pub fn axons(folder: &Path, forms: Tables) -> Result<Self, OutputError> {
        let columns = [
            ("time", "h", Kind::Number),
            ("axon", "", Kind::Integer),
            ("root", "", Kind::Integer),
            ("parent", "", Kind::Integer),
            ("branch", "", Kind::Flag),
            ("population", "", Kind::Text),
            ("status", "", Kind::Text),
            ("birth", "h", Kind::Number),
            ("arrival", "h", Kind::Number),
            ("length", "um", Kind::Number),
            ("straightness", "", Kind::Number),
            ("turning_angle", "deg", Kind::Number),
        ];
        Ok(Self { table: Table::create(folder, "axons", forms, &columns)?, fill: add_axons })
    }
}

impl Output for RowTable {
    fn look(&mut self, world: &World) -> Result<(), OutputError> {
        (self.fill)(&mut self.table, world)
    }

    fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        self.table.keep(into)
    }

    fn restore(&mut self, from: &mut KeptBytes) -> Result<(), OutputError> {
        self.table.restore(from)
    }

    fn finish(self: Box<Self>) -> Result<Vec<String>, OutputError> {
        self.table.finish().map(|()| Vec::new())
    }
}

fn add_tips(table: &mut Table, world: &World) -> Result<(), OutputError> {
    let tips = tips(world);
    let row = trajectory_rows(world, &tips);
    (0..tips.len()).try_for_each(|i| table.push(&row(i)))
}

fn add_axons(table: &mut Table, world: &World) -> Result<(), OutputError> {
    let (hours, spares) = (world.resource::<Clock>().hours(), world.resource::<SpareCones>());
    let populations = &world.resource::<Populations>().0;
    let (mut tips, mut written) = (tips(world).into_iter(), Ok(()));
    each_axon(world, |axon| {
        let Some(tip) = tips.next().filter(|_| written.is_ok()) else { return };
        let name = populations.get(usize::from(axon.population)).map_or("", |population| &population.name);
        let parent = spares.parent(tip.axon).map_or(Cell::Empty, |parent| Cell::Integer(parent.into()));
        let turned = turning_angle(axon.initial_heading, &axon.shaft).map(f64::to_degrees);
        written = table.push(&[
            hours.into(),
            Cell::Integer(tip.axon.into()),
            Cell::Integer(spares.root(tip.axon).into()),
            parent,
            axon.is_branch.into(),
            name.into(),
            tip.status.word().into(),
            axon.birth_time.into(),
            axon.arrival_time.into(),
            path_length(&axon.shaft).into(),
            straightness(&axon.shaft).into(),
            turned.into(),
        ]);
    });
    written
}

/// `measures`: a row a time, with the numbers of counts and morphology that `summary.json` has.
pub struct MeasureTable {
    folder: PathBuf,
    forms: Tables,
    heights: Vec<f64>,
    linkage: f64,
    rows: Vec<(f64, BTreeMap<String, f64>)>,
}

impl MeasureTable {
    /// A table in a folder, with heights (shares of the tissue's) and linkage distance (µm) of fascicles.
    pub fn new(folder: &Path, forms: Tables, (heights, linkage): (Vec<f64>, f64)) -> Self {
        Self { folder: folder.to_owned(), forms, heights, linkage, rows: Vec::new() }
    }
}

impl Output for MeasureTable {
    fn look(&mut self, world: &World) -> Result<(), OutputError> {
        let (y_min, y_max) = extent_in_y(world.resource::<Configuration>());
        let options = MeasureOptions { shares: self.heights.clone(), y_min, y_max, linkage: self.linkage };
        let found = leaves(&counts(world), &morphology(world, &options))?;
        self.rows.push((world.resource::<Clock>().hours(), found.into_iter().collect()));
        Ok(())
    }

    fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        self.rows.keep(into);
        Ok(())
    }

    fn restore(&mut self, from: &mut KeptBytes) -> Result<(), OutputError> {
        self.rows = from.read()?;
        Ok(())
    }

    /// Writes the table; which columns there are is known only now.
    fn finish(self: Box<Self>) -> Result<Vec<String>, OutputError> {
        let mut names: Vec<&String> = self.rows.iter().flat_map(|(_, row)| row.keys()).collect();
        names.sort_unstable();
        names.dedup();
        let time: Heading = ("time", "h", Kind::Number);
        let columns = names.iter().map(|name| (name.as_str(), "", Kind::Number));
        let columns: Vec<Heading> = std::iter::once(time).chain(columns).collect();
        let mut table = Table::create(&self.folder, "measures", self.forms, &columns)?;
        for (time, row) in &self.rows {
            let values = names.iter().map(|name| Cell::from(row.get(*name).copied()));
            table.push(&std::iter::once(Cell::from(*time)).chain(values).collect::<Vec<_>>())?;
        }
        table.finish().map(|()| Vec::new())
    }
}
