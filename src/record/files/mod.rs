//! Files for other tools: what a scene asks for under `output`, besides figure, summary and trajectories.
//!
//! An [`Output`] says what it does with the world at an instant, and what is left to do at the end; [`asked`] is the one list of them.
//! A new one is a file beside this one, a key in `src/scenario/files.rs` and an entry in that list. What is large goes to the disk
//! as it is seen; nothing of it is kept in memory to the end.

mod parquet;
mod swc;
mod swc_tree;
mod table;
mod tables;
mod thrift;
mod vtu;
mod vtu_series;

use super::csv::RowError;
use super::output::WriteError;
use super::recorder::is_next;
use crate::model::clock::{Clock, TimeGrid};
use crate::model::keep::{Damage, Keep, KeptBytes};
use crate::model::quantity::Time;
use crate::scenario::scene::{Every, Output as Keys};
use bevy_ecs::prelude::World;
use std::path::Path;
use swc::SwcFiles;
use tables::{MeasureTable, RowTable};
use vtu_series::{View, VtuSeries, fields, shafts, tissue};

/// Why an output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The system refused.
    #[error("{0}")]
    Write(#[from] WriteError),
    /// A row does not fit its table.
    #[error("{0}")]
    Row(#[from] RowError),
    /// The measures are no numbers.
    #[error("{0}")]
    Measures(#[from] serde_json::Error),
    /// What was written down of it does not read back.
    #[error("{0}")]
    Damage(#[from] Damage),
}

/// Files of one kind.
pub trait Output: Send {
    /// Looks at a world whose tissue has been brought to the present, at an instant that was asked for.
    ///
    /// # Errors
    /// What could not be written.
    fn look(&mut self, world: &World) -> Result<(), OutputError>;

    /// Writes down how far it has come, for a run that goes on from there.
    ///
    /// # Errors
    /// A file that cannot be read back.
    fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError>;

    /// Brings an output that has just begun to what was written down.
    ///
    /// # Errors
    /// Bytes that are of no such output; what could not be written.
    fn restore(&mut self, from: &mut KeptBytes) -> Result<(), OutputError>;

    /// Ends the files, and says what the user should know of them.
    ///
    /// # Errors
    /// What could not be written.
    fn finish(self: Box<Self>) -> Result<Vec<String>, OutputError> {
        Ok(Vec::new())
    }
}

/// Begins an output in the folder of results.
type Make<'a> = Box<dyn Fn(&Path) -> Result<Box<dyn Output>, OutputError> + 'a>;

/// An output that a scene asks for.
struct Asked<'a> {
    /// Files and folders in the folder of results.
    files: String,
    every: Every,
    /// Whether the end is looked at, even if it is no multiple of the interval.
    with_end: bool,
    make: Make<'a>,
}

/// The list of outputs that a scene asks for.
fn asked(keys: &Keys) -> Vec<Asked<'_>> {
    let mut list = Vec::new();
    let mut ask = |files: String, every: &Every, make: Make<'static>| {
        list.push(Asked { files, every: every.clone(), with_end: true, make });
    };
    let tables = keys.tables;
    if let Some(every) = &keys.measures {
        let options = (heights(keys), keys.linkage_distance.0);
        let make: Make = Box::new(move |folder| Ok(Box::new(MeasureTable::new(folder, tables, options.clone()))));
        ask(tables.files("measures"), every, make);
    }
    if let Some(every) = &keys.axons {
        let make: Make = Box::new(move |folder| Ok(Box::new(RowTable::axons(folder, tables)?)));
        ask(tables.files("axons"), every, make);
    }
    if let Some(swc) = keys.swc.clone() {
        let files = if swc.archive { "swc.zip" } else { "swc/" };
        let every = Every { interval: swc.interval };
        ask(files.to_owned(), &every, Box::new(move |folder| Ok(Box::new(SwcFiles::create(folder, swc.clone())?))));
    }
    let vtu = keys.vtu.clone().unwrap_or_default();
    let series: [(&'static str, &Option<Every>, View); 3] =
        [("tissue", &vtu.tissue, tissue), ("fields", &vtu.fields, fields), ("shafts", &vtu.shafts, shafts)];
    for (name, every, grid) in series {
        if let Some(every) = every {
            let make: Make = Box::new(move |folder| Ok(Box::new(VtuSeries::create(folder, name, grid)?)));
            ask(format!("vtu/{name}.pvd, vtu/{name}/"), every, make);
        }
    }
    if tables.are_parquet() {
        let every = Every { interval: Some(keys.trajectory_interval) };
        let make: Make = Box::new(|folder| Ok(Box::new(RowTable::trajectories(folder)?)));
        list.push(Asked { files: "trajectories.parquet".to_owned(), every, with_end: false, make });
    }
    list
}

fn heights(keys: &Keys) -> Vec<f64> {
    keys.heights.iter().map(|share| share.0).collect()
}

/// What a run writes of what its scene asks for: files, and when.
pub fn told(keys: &Keys) -> Vec<(String, String)> {
    let when =
        |every: &Every| every.interval.map_or("at the end".to_owned(), |Time(hours)| format!("every {hours:.3} h"));
    asked(keys).into_iter().map(|asked| (asked.files, when(&asked.every))).collect()
}

/// All outputs of a run.
#[derive(Default)]
pub struct Outputs(Vec<Timed>);

/// An output with its instants.
struct Timed {
    /// Ticks; none: the end only.
    interval: Option<u64>,
    next: u64,
    with_end: bool,
    seen: Option<u64>,
    output: Box<dyn Output>,
}

impl Outputs {
    /// What a scene asks for, to be written into `folder`.
    ///
    /// # Errors
    /// What could not be written.
    pub fn create(keys: &Keys, folder: &Path, grid: &TimeGrid) -> Result<Self, OutputError> {
        let timed = |asked: Asked| {
            let interval = asked.every.interval.map(|Time(hours)| grid.nearest(hours).max(1));
            let next = if interval.is_some() { 0 } else { u64::MAX };
            Ok(Timed { interval, next, with_end: asked.with_end, seen: None, output: (asked.make)(folder)? })
        };
        asked(keys).into_iter().map(timed).collect::<Result<_, _>>().map(Self)
    }

    /// Whether something is to be seen at an instant (ticks).
    pub fn are_due(&self, now: u64) -> bool {
        self.0.iter().any(|timed| now >= timed.next)
    }

    /// Lets those that are due look at a world whose tissue has been brought to the present.
    ///
    /// # Errors
    /// What could not be written.
    pub fn look(&mut self, world: &World) -> Result<(), OutputError> {
        let now = world.resource::<Clock>().now;
        self.0.iter_mut().filter(|timed| now >= timed.next).try_for_each(|timed| timed.look(world, now))
    }

    /// Writes down how far all have come.
    ///
    /// # Errors
    /// A file that cannot be read back.
    pub fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        for Timed { next, seen, output, .. } in &self.0 {
            (*next, *seen).keep(into);
            output.keep(into)?;
        }
        Ok(())
    }

    /// Brings outputs that have just begun to what was written down of the same scene's.
    ///
    /// # Errors
    /// Bytes that are of no such outputs; what could not be written.
    pub fn restore(&mut self, from: &mut KeptBytes, world: &World) -> Result<(), OutputError> {
        let now = world.resource::<Clock>().now;
        for timed in &mut self.0 {
            (timed.next, timed.seen) = from.read()?;
            let waits = timed.interval.map_or(timed.next == u64::MAX, |every| is_next(timed.next, every, now));
            if !waits || timed.seen.is_some_and(|seen| seen > now) {
                return Err(Damage("files for other tools: they look at other instants".into()).into());
            }
            timed.output.restore(from)?;
        }
        Ok(())
    }

    /// Lets those that have not seen the end look at it, ends all files, and gives what the user should know of them, and the first error: the others
    /// are ended all the same.
    pub fn finish(self, world: &World) -> (Vec<String>, Result<(), OutputError>) {
        let now = world.resource::<Clock>().now;
        let ended = |mut timed: Timed| {
            if timed.with_end && timed.seen != Some(now) {
                timed.look(world, now)?;
            }
            timed.output.finish()
        };
        let (mut notes, mut all) = (Vec::new(), Ok(()));
        for found in self.0.into_iter().map(ended) {
            match found {
                Ok(said) => notes.extend(said),
                Err(error) => all = all.and(Err(error)),
            }
        }
        (notes, all)
    }
}

impl Timed {
    fn look(&mut self, world: &World, now: u64) -> Result<(), OutputError> {
        self.seen = Some(now);
        self.next = self.interval.map_or(u64::MAX, |interval| (now / interval + 1) * interval);
        self.output.look(world)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    struct Spy(Arc<Mutex<Vec<u64>>>);

    impl Output for Spy {
        fn look(&mut self, world: &World) -> Result<(), OutputError> {
            self.0.lock().unwrap().push(world.resource::<Clock>().now);
            Ok(())
        }

        fn keep(&self, _: &mut Vec<u8>) -> Result<(), WriteError> {
            Ok(())
        }

        fn restore(&mut self, _: &mut KeptBytes) -> Result<(), OutputError> {
            Ok(())
        }
    }

    /// The instants that an output sees of a run of 10 ticks of which every second is met.
    fn seen(interval: Option<u64>, with_end: bool) -> Vec<u64> {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let next = if interval.is_some() { 0 } else { u64::MAX };
        let output = Box::new(Spy(seen.clone()));
        let mut outputs = Outputs(vec![Timed { interval, next, with_end, seen: None, output }]);
        let mut world = World::new();
        world.insert_resource(Clock::new(TimeGrid::new(1.0).unwrap(), 10));
        for now in (0..=10).step_by(2) {
            world.resource_mut::<Clock>().now = now;
            if outputs.are_due(now) {
                outputs.look(&world).unwrap();
            }
        }
        outputs.finish(&world).1.unwrap();
        seen.lock().unwrap().clone()
    }

    /// An output on a disk that is full.
    struct Full;

    impl Output for Full {
        fn look(&mut self, _: &World) -> Result<(), OutputError> {
            Err(OutputError::Write(WriteError { path: "full".into(), source: std::io::ErrorKind::StorageFull.into() }))
        }

        fn keep(&self, _: &mut Vec<u8>) -> Result<(), WriteError> {
            Ok(())
        }

        fn restore(&mut self, _: &mut KeptBytes) -> Result<(), OutputError> {
            Ok(())
        }
    }

    #[test]
    fn what_cannot_be_written_does_not_keep_the_others_from_their_end() {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let both: [Box<dyn Output>; 2] = [Box::new(Full), Box::new(Spy(seen.clone()))];
        let timed = |output| Timed { interval: None, next: u64::MAX, with_end: true, seen: None, output };
        let mut world = World::new();
        world.insert_resource(Clock::new(TimeGrid::new(1.0).unwrap(), 10));
        let (_, written) = Outputs(both.into_iter().map(timed).collect()).finish(&world);
        assert!(written.unwrap_err().to_string().contains("full"));
        assert_eq!(*seen.lock().unwrap(), [0]);
    }

    #[test]
    fn an_output_sees_the_first_instant_that_reaches_each_interval_and_the_end_once() {
        assert_eq!(seen(Some(3), true), [0, 4, 6, 10]);
        assert_eq!(seen(Some(4), true), [0, 4, 8, 10]);
        assert_eq!(seen(Some(4), false), [0, 4, 8]);
        assert_eq!(seen(Some(5), true), [0, 6, 10]);
        assert_eq!(seen(None, true), [10]);
    }
}
