//! The recorder: looks at a run after each step, when something is due, and changes nothing.

mod sound;

pub use sound::is_next;

use super::csv::{Cell, CsvTable, RowError};
use super::recording::film::{Film, MOST_BYTES};
use super::snapshot::{Snapshot, TipView, tips};
use crate::kept;
use crate::model::clock::{Clock, TimeGrid};
use bevy_ecs::prelude::World;

/// What to look at, and when.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecorderOptions {
    /// Time between two points of a trajectory (h); `None` to keep no trajectories.
    pub trajectory_interval: Option<f64>,
    /// Times of the pictures (h).
    pub figure_times: Vec<f64>,
    /// Times of the frames of a film (h), besides those of the pictures; none for no film.
    pub frame_times: Vec<f64>,
}

/// Collects trajectories, snapshots and the frames of a film.
#[derive(Debug)]
pub struct Recorder {
    interval: Option<u64>,
    next_point: u64,
    figures: Vec<u64>,
    frames: Vec<u64>,
    film: Option<Film>,
    /// Why there is no film though there should be one.
    pub given_up: Option<String>,
    /// One row a time and axon born.
    pub trajectories: CsvTable,
    /// One snapshot a picture.
    pub snapshots: Vec<Snapshot>,
}

kept! { struct Recorder { interval, next_point, figures, frames, film, given_up, trajectories, snapshots } }

impl Recorder {
    /// A recorder over a grid of time.
    pub fn new(options: &RecorderOptions, grid: &TimeGrid, end: u64) -> Self {
        let instants = |times: &[f64]| {
            let mut instants: Vec<u64> = times.iter().map(|t| grid.nearest(*t).min(end)).collect();
            instants.sort_unstable();
            instants.dedup();
            instants
        };
        let columns = [("time", "h"), ("axon", ""), ("status", ""), ("x", "um"), ("y", "um"), ("heading", "deg")];
        Self {
            interval: options.trajectory_interval.map(|interval| grid.nearest(interval).max(1)),
            next_point: 0,
            figures: instants(&options.figure_times),
            frames: instants(&options.frame_times),
            film: (!options.frame_times.is_empty()).then(Film::default),
            given_up: None,
            trajectories: CsvTable::new(&columns),
            snapshots: Vec::new(),
        }
    }

    /// Instants (ticks) of the pictures that are still to come, ascending.
    pub fn pictures_due(&self) -> &[u64] {
        &self.figures
    }

    /// Number of frames that are still to come, those of pictures that fall on others counted once.
    pub fn frames_due(&self) -> usize {
        let further = self.figures.iter().filter(|figure| self.frames.binary_search(figure).is_err());
        if self.film.is_some() { self.frames.len() + further.count() } else { 0 }
    }

    /// Whether something is to be seen at an instant (ticks).
    pub fn is_due(&self, now: u64) -> bool {
        let due = |instants: &[u64]| instants.first().is_some_and(|due| now >= *due);
        (self.interval.is_some() && now >= self.next_point) || due(&self.figures) || due(&self.frames)
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
        let is_picture = self.figures.first().is_some_and(|due| now >= *due);
        if is_picture || self.frames.first().is_some_and(|due| now >= *due) {
            self.figures.retain(|due| *due > now);
            self.frames.retain(|due| *due > now);
            self.take_frame(world, is_picture);
        }
        if is_picture {
            self.snapshots.push(Snapshot::of(world));
        }
        Ok(())
    }

    /// Looks at a world whose run ends before its time, if it can be drawn.
    pub fn observe_fault(&mut self, world: &World) {
        let last = Snapshot::of(world);
        if last.is_finite() {
            self.take_frame(world, true);
            self.snapshots.push(last);
        }
    }

    /// The film of the run, to be developed.
    pub fn take_film(&mut self) -> Option<Film> {
        self.film.take()
    }

    fn take_frame(&mut self, world: &World, is_picture: bool) {
        let Some(film) = &mut self.film else { return };
        film.observe(world);
        if is_picture {
            film.mark_for_figure();
        }
        if film.bytes() > MOST_BYTES {
            let megabytes = MOST_BYTES / 1_000_000;
            self.given_up = Some(format!(
                "no recording: its frames would take more than {megabytes} MB; `output/frames` may ask for fewer than it does"
            ));
            self.film = None;
            self.frames.clear();
        }
    }

    fn add_points(&mut self, world: &World) -> Result<(), RowError> {
        let tips = tips(world);
        self.trajectories.push_all(tips.len(), trajectory_rows(world, &tips))
    }
}

/// The rows of the trajectories now, by the number of the tip: time, axon, status, x, y, heading.
pub fn trajectory_rows(world: &World, tips: &[TipView]) -> impl Fn(usize) -> [Cell; 6] + Sync {
    let time = world.resource::<Clock>().hours();
    move |i| {
        let tip = &tips[i];
        [
            Cell::from(time),
            Cell::Integer(i64::from(tip.axon)),
            Cell::from(tip.status.word()),
            Cell::from(tip.position[0]),
            Cell::from(tip.position[1]),
            Cell::from(tip.heading[1].atan2(tip.heading[0]).to_degrees()),
        ]
    }
}
