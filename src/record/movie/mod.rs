//! Moving pictures of a recording, as files that a slide deck plays.
//!
//! Frames come from the same drawings as figures. GIF has 255 colours for the whole movie, chosen from its beginning, middle and end;
//! APNG has all colours; MP4 is made by `ffmpeg`, if there is one. In GIF and APNG only what changes from frame to frame is stored.

mod apng;
mod gif;
mod mp4;
mod palette;
pub mod strip;

use super::png::PngError;
use super::scene_figure::FigureError;
use std::path::Path;

/// Hundredths of a second for which the last frame stays.
const LAST_FRAME: u16 = 150;

/// The kinds of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MovieFormat {
    /// Plays everywhere.
    Gif,
    /// Sharper, plays in browsers and newer programs.
    Apng,
    /// Small, made by ffmpeg.
    Mp4,
}

impl MovieFormat {
    /// Their names, as the command line takes them.
    pub const NAMES: [&'static str; 3] = ["gif", "apng", "mp4"];

    /// The format of a name, or of the ending of a file (`png` is APNG).
    pub fn of(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "gif" => Some(Self::Gif),
            "apng" | "png" => Some(Self::Apng),
            "mp4" => Some(Self::Mp4),
            _ => None,
        }
    }

    /// The usual ending of its files.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Apng => "png",
            Self::Mp4 => "mp4",
        }
    }
}

/// One frame: opaque pixels in rows, red, green, blue.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Three bytes a pixel.
    pub pixels: Vec<u8>,
}

/// How a movie plays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Number of frames.
    pub frames: u32,
    /// Frames a second.
    pub rate: u16,
}

/// Why there is no movie.
#[derive(Debug, thiserror::Error)]
pub enum MovieError {
    /// A frame could not be drawn.
    #[error("a frame could not be drawn: {0}")]
    Figure(#[from] FigureError),
    /// A frame could not be painted.
    #[error("a frame could not be drawn: {0}")]
    Picture(#[from] PngError),
    /// The file could not be encoded.
    #[error("the movie could not be encoded: {0}")]
    Encode(String),
    /// There is no ffmpeg.
    #[error("MP4 needs the program ffmpeg, which is not on the PATH; `--format gif` and `--format apng` need nothing")]
    NoFfmpeg,
    /// Ffmpeg failed.
    #[error("ffmpeg failed: {0}")]
    Ffmpeg(String),
}

/// Encodes a movie. `frame` gives the frame of a number, and is asked for each in order; for GIF some are asked for twice.
/// `beside` is a path next to which ffmpeg may work.
///
/// # Errors
/// A frame that cannot be made, an encoder that fails.
pub fn encode(
    format: MovieFormat,
    pace: Pace,
    frame: impl Fn(u32) -> Result<Frame, MovieError> + Sync,
    tick: impl FnMut(f64),
    beside: &Path,
) -> Result<Vec<u8>, MovieError> {
    match format {
        MovieFormat::Gif => gif::encode(pace, Reel::new(pace, &frame, tick)),
        MovieFormat::Apng => apng::encode(pace, Reel::new(pace, &frame, tick)),
        MovieFormat::Mp4 => mp4::encode(pace, Reel::new(pace, &frame, tick), beside),
    }
}

/// All frames in order, a few at a time made in parallel.
struct Reel<'a, F, T> {
    pace: Pace,
    frame: &'a F,
    tick: T,
    made: std::vec::IntoIter<Result<Frame, MovieError>>,
    next: u32,
}

impl<'a, F: Fn(u32) -> Result<Frame, MovieError> + Sync, T: FnMut(f64)> Reel<'a, F, T> {
    fn new(pace: Pace, frame: &'a F, tick: T) -> Self {
        Self { pace, frame, tick, made: Vec::new().into_iter(), next: 0 }
    }

    /// A frame out of order.
    fn peek(&self, number: u32) -> Result<Frame, MovieError> {
        (self.frame)(number)
    }
}

impl<F: Fn(u32) -> Result<Frame, MovieError> + Sync, T: FnMut(f64)> Iterator for Reel<'_, F, T> {
    type Item = Result<Frame, MovieError>;

    fn next(&mut self) -> Option<Self::Item> {
        use rayon::prelude::*;
        if self.made.len() == 0 {
            let end = self.pace.frames.min(self.next + rayon::current_num_threads() as u32);
            let made: Vec<_> = (self.next..end).into_par_iter().map(self.frame).collect();
            self.made = made.into_iter();
            self.next = end;
        }
        let frame = self.made.next()?;
        let left = self.pace.frames - self.next + self.made.len() as u32;
        (self.tick)(1.0 - f64::from(left) / f64::from(self.pace.frames));
        Some(frame)
    }
}

#[cfg(test)]
#[path = "movie_tests.rs"]
mod tests;
