//! Ctrl-C and the scheduler's signal: the first ends the run after its step, a second one ends the program at once.

use super::voice::alarm;
use crate::model::stopwatch::Elapsed;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Signals that come within so long (s) are one: some senders send theirs to a process and again to its group.
const ONE: f64 = 0.2;

/// What has been caught so far.
#[derive(Debug, Clone)]
pub struct Interrupt(Arc<AtomicUsize>);

/// A signal that ends the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signal {
    /// Its name.
    pub name: &'static str,
    /// The exit code that belongs to it: 128 and its number.
    pub code: u8,
}

impl Interrupt {
    /// Catches SIGINT and SIGTERM from now on.
    ///
    /// # Errors
    /// The system's reason.
    pub fn catch() -> io::Result<Self> {
        let caught = Arc::new(AtomicUsize::new(0));
        for signal in [SIGINT, SIGTERM] {
            flag::register_usize(signal, Arc::clone(&caught), signal as usize)?;
        }
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        std::thread::spawn(move || {
            let mut first: Option<Elapsed> = None;
            for number in signals.forever() {
                if first.get_or_insert_default().seconds() > ONE {
                    std::process::exit(128 + number);
                }
            }
        });
        Ok(Self(caught))
    }

    /// The signal that has come, if one has.
    pub fn caught(&self) -> Option<Signal> {
        Signal::of(self.0.load(Ordering::Relaxed) as i32)
    }
}

impl Signal {
    fn of(number: i32) -> Option<Self> {
        match number {
            SIGINT => Some(Self { name: "SIGINT", code: 130 }),
            SIGTERM => Some(Self { name: "SIGTERM", code: 143 }),
            _ => None,
        }
    }
}

/// Ends the program at the first signal, and says so: for a command whose results are written at its end.
///
/// # Errors
/// The system's reason.
pub fn end_at_once() -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().find_map(Signal::of) {
            alarm!("stopped by {}: what this command had not written by now is not there", signal.name);
            std::process::exit(signal.code.into());
        }
    });
    Ok(())
}
