//! The recorder: looks at a run after each step, when something is due, and changes nothing.

use super::csv::{Cell, CsvTable, RowError};
use super::snapshot::{Snapshot, tips};
use crate::model::clock::{Clock, TimeGrid};
use bevy_ecs::prelude::World;

/// What to look at, and when.
#[derive(Debug, Clone, PartialEq)]
pub struct RecorderOptions {
    /// Time between two points of a trajectory (h); `None` to keep no trajectories.
    pub trajectory_interval: Option<f64>,
    /// Times of the pictures (h).
    pub figure_times: Vec<f64>,
}

/// Collects trajectories and snapshots.
#[derive(Debug)]
pub struct Recorder {
    interval: Option<u64>,
    next_point: u64,
    figures: Vec<u64>,
    /// One row a time and axon born.
    pub trajectories: CsvTable,
    /// One snapshot a picture.
    pub snapshots: Vec<Snapshot>,
}

impl Recorder {
    /// A recorder over a grid of time.
    pub fn new(options: &RecorderOptions, grid: &TimeGrid, end: u64) -> Self {
        let mut figures: Vec<u64> = options.figure_times.iter().map(|t| grid.nearest(*t).min(end)).collect();
        figures.sort_unstable();
        figures.dedup();
        let columns = [("time", "h"), ("axon", ""), ("status", ""), ("x", "um"), ("y", "um"), ("heading", "deg")];
        Self {
            interval: options.trajectory_interval.map(|interval| grid.nearest(interval).max(1)),
            next_point: 0,
            figures,
            trajectories: CsvTable::new(&columns),
            snapshots: Vec::new(),
        }
    }

    /// Instants (ticks) of the pictures that are still to come, ascending.
    pub fn pictures_due(&self) -> &[u64] {
        &self.figures
    }

    /// Whether something is to be seen at an instant (ticks).
    pub fn is_due(&self, now: u64) -> bool {
        (self.interval.is_some() && now >= self.next_point) || self.figures.first().is_some_and(|due| now >= *due)
    }

    /// Looks at a world whose tissue has been brought to the present.
    ///
    /// # Errors
    /// A row that does not fit the table.
    pub fn observe(&mut self, world: &World) -> Result<(), RowError> {
        let now = world.resource::<Clock>().now;
        if let Some(interval) = self.interval.filter(|_| now >= self.next_point) {
            self.add_points(world)?;
            self.next_point = (now / interval + 1) * interval;
        }
        if self.figures.first().is_some_and(|due| now >= *due) {
            self.figures.retain(|due| *due > now);
            self.snapshots.push(Snapshot::of(world));
        }
        Ok(())
    }

    fn add_points(&mut self, world: &World) -> Result<(), RowError> {
        let time = world.resource::<Clock>().hours();
        let tips = tips(world);
        self.trajectories.push_all(tips.len(), |i| {
            let tip = &tips[i];
            [
                Cell::from(time),
                Cell::Integer(i64::from(tip.axon)),
                Cell::from(tip.status.word()),
                Cell::from(tip.position[0]),
                Cell::from(tip.position[1]),
                Cell::from(tip.heading[1].atan2(tip.heading[0]).to_degrees()),
            ]
        })
    }
}
