//! MP4 by ffmpeg, which reads raw frames from its standard input.

use super::{Frame, MovieError, Pace};
use std::ffi::OsStr;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Has ffmpeg encode frames (H.264, which every player knows) into a file beside `beside`, and gives its bytes; the file is removed.
pub(super) fn encode(
    pace: Pace,
    frames: impl Iterator<Item = Result<Frame, MovieError>>,
    beside: &Path,
) -> Result<Vec<u8>, MovieError> {
    let mut frames = frames.peekable();
    let size = match frames.peek() {
        Some(Ok(first)) => first.size,
        _ => [2, 2],
    };
    let made = Made(beside.with_extension("partial.mp4"));
    let mut child = start(pace, size, &made.0)?;
    let fed = feed(&mut child, frames);
    let mut said = String::new();
    if let Some(mut errors) = child.stderr.take() {
        // What cannot be read cannot be told; the exit code counts.
        let _ = errors.read_to_string(&mut said);
    }
    let ended = child.wait().map_err(|error| MovieError::Ffmpeg(error.to_string()))?;
    if !ended.success() {
        return Err(MovieError::Ffmpeg(format!("{ended}: {}", said.trim())));
    }
    fed?;
    std::fs::read(&made.0).map_err(|error| MovieError::Ffmpeg(format!("it left no file: {error}")))
}

/// A file that goes when dropped.
struct Made(PathBuf);

impl Drop for Made {
    fn drop(&mut self) {
        // It may not be there.
        let _ = std::fs::remove_file(&self.0);
    }
}

fn start(pace: Pace, size: [u32; 2], file: &Path) -> Result<Child, MovieError> {
    let (extent, rate) = (format!("{}x{}", size[0], size[1]), pace.rate.to_string());
    let raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", &extent, "-r", &rate, "-i", "-"];
    // The codec wants even numbers of pixels.
    let coded = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-c:v", "libx264", "-pix_fmt", "yuv420p"];
    let arguments = [&["-y", "-loglevel", "error"][..], &raw, &coded, &["-crf", "18", "-movflags", "+faststart"]];
    let arguments = arguments.concat().into_iter().map(OsStr::new).chain([file.as_os_str()]);
    let mut command = Command::new("ffmpeg");
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().map_err(|error| match error.kind() {
        ErrorKind::NotFound => MovieError::NoFfmpeg,
        _ => MovieError::Ffmpeg(error.to_string()),
    })
}

/// Writes all frames, then closes the input.
fn feed(child: &mut Child, frames: impl Iterator<Item = Result<Frame, MovieError>>) -> Result<(), MovieError> {
    let Some(mut input) = child.stdin.take() else { return Ok(()) };
    for frame in frames {
        input.write_all(&frame?.pixels).map_err(|error| MovieError::Ffmpeg(error.to_string()))?;
    }
    Ok(())
}
