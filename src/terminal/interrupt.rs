//! Ctrl-C and the scheduler's signal: the first ends the run after its step, a second one ends the program at once.

use super::voice::alarm;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

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
        let again = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds `again` unset and sets it.
            flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again))?;
            flag::register(signal, Arc::clone(&again))?;
            flag::register_usize(signal, Arc::clone(&caught), signal as usize)?;
        }
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
