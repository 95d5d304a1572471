//! What the program says: results and answers on standard output, the rest on standard error.
//!
//! A reader that has gone (`| head`) is no fault of the run. Anything else that keeps a line from standard output is told at the end.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, Ordering};

/// What kept a line from standard output, the first time.
static UNSAID: Mutex<Option<String>> = Mutex::new(None);

/// Writes a line on standard output.
pub fn line_out(line: Arguments) {
    let mut out = stdout().lock();
    keep_reason(writeln!(out, "{line}").and_then(|()| out.flush()));
}

/// Writes bytes on standard output.
pub fn bytes_out(bytes: &[u8]) {
    let mut out = stdout().lock();
    keep_reason(out.write_all(bytes).and_then(|()| out.flush()));
}

/// Takes note of how somebody else's writing on standard output went.
pub fn printed(written: std::io::Result<()>) {
    keep_reason(written.and_then(|()| stdout().flush()));
}

/// Keeps the first reason why something could not be written.
fn keep_reason(written: std::io::Result<()>) {
    if let Err(error) = written.map_err(|error| (error.kind(), error.to_string()))
        && error.0 != ErrorKind::BrokenPipe
        && let Ok(mut unsaid) = UNSAID.lock()
    {
        unsaid.get_or_insert(error.1);
    }
}

/// Writes a line on standard error; there is nowhere to say that it could not be written.
pub fn line_err(line: Arguments) {
    let _ = writeln!(stderr().lock(), "{line}");
}

/// What kept a line from standard output, if anything did.
pub fn unsaid() -> Option<String> {
    UNSAID.lock().ok().and_then(|mut unsaid| unsaid.take())
}

/// How much is said besides what was asked for: nothing, the usual, all.
static VOICE: AtomicU8 = AtomicU8::new(USUAL);
const QUIET: u8 = 0;
const USUAL: u8 = 1;
const LOUD: u8 = 2;

/// Chooses how much is said from now on.
pub fn set_voice(quiet: bool, verbose: bool) {
    let voice = if quiet { QUIET } else { USUAL + u8::from(verbose) };
    VOICE.store(voice, Ordering::Relaxed);
}

/// Whether only what was asked for is said, and errors.
pub fn is_quiet() -> bool {
    VOICE.load(Ordering::Relaxed) == QUIET
}

/// Whether more than usual is said.
pub fn is_loud() -> bool {
    VOICE.load(Ordering::Relaxed) == LOUD
}

/// A line on standard output: what was asked for.
macro_rules! say {
    ($($words:tt)*) => { $crate::terminal::voice::line_out(format_args!($($words)*)) };
}

/// A line on standard output that nobody asked for: not with `--quiet`.
macro_rules! tell {
    ($($words:tt)*) => { if !$crate::terminal::voice::is_quiet() { $crate::terminal::voice::line_out(format_args!($($words)*)) } };
}

/// A line on standard error: what went wrong.
macro_rules! alarm {
    ($($words:tt)*) => { $crate::terminal::voice::line_err(format_args!($($words)*)) };
}

/// A line on standard error that nobody asked for: not with `--quiet`.
macro_rules! note {
    ($($words:tt)*) => { if !$crate::terminal::voice::is_quiet() { $crate::terminal::voice::line_err(format_args!($($words)*)) } };
}

pub(crate) use {alarm, note, say, tell};
