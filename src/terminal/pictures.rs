//! `tropism figure` and `tropism movie`: their arguments, and what they do.

use super::manners::progress_bar;
use super::voice::tell;
use crate::model::quantity::{Kind, Length, Quantity, Time, format_number};
use crate::record::movie::MovieFormat;
use crate::study::pictures::{FigureOfRuns, MovieOfRun};
use crate::study::run::RunError;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Which runs, and how.
#[derive(Debug, Args)]
pub struct FigureArguments {
    /// Folders of finished runs; several stand side by side
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// When, with a unit or in hours (repeatable) [default: as the scene's own figure; the end, of several runs]
    #[arg(long, value_name = "TIME,TIME,…", value_delimiter = ',', value_parser = time)]
    time: Vec<f64>,
    /// Show this cue only (repeatable) [default: all that cones turn by]
    #[arg(long, value_name = "NAME")]
    cue: Vec<String>,
    /// Width of the figure, such as 85mm [default: by the number of panels]
    #[arg(long, value_name = "WIDTH", value_parser = width)]
    size: Option<f64>,
    /// Draw a turning assay: paths from one start, first heading upward, and their turning angles
    #[arg(long)]
    assay: bool,
    /// File, ending in .svg or .png; both without an ending [default: RUN/picture, or RUN/assay]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Which run, and how.
#[derive(Debug, Args)]
pub struct MovieArguments {
    /// Folder of a finished run
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// File [default: RUN/movie.gif]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: u16,
    /// Frames, at equal times from start to end [default: as many as were recorded]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000))]
    frames: Option<u32>,
    /// Pixels across
    #[arg(long, value_name = "N", default_value_t = 800, value_parser = clap::value_parser!(u32).range(64..=4096))]
    width: u32,
    /// Kind of file [default: by the ending of FILE, else gif]
    #[arg(long, value_name = "FORMAT", value_parser = MovieFormat::NAMES)]
    format: Option<String>,
}

impl FigureArguments {
    /// Draws the figure and says where it is.
    ///
    /// # Errors
    /// A run that has no recording; a file that could not be written.
    pub fn draw(&self) -> Result<ExitCode, RunError> {
        self.figure().write()?.iter().for_each(|file| tell!("{}", file.display()));
        Ok(ExitCode::SUCCESS)
    }

    fn figure(&self) -> FigureOfRuns {
        FigureOfRuns {
            runs: self.runs.clone(),
            times: self.time.clone(),
            cues: self.cue.clone(),
            width: self.size,
            assay: self.assay,
            out: self.out.clone(),
        }
    }
}

impl MovieArguments {
    /// Makes the movie and says where it is.
    ///
    /// # Errors
    /// A run that has no recording; a file that could not be written.
    pub fn make(&self) -> Result<ExitCode, RunError> {
        let bar = progress_bar(100.0, "%");
        let file = self.movie().write(|share| bar.set_position((share * 1000.0) as u64))?;
        bar.finish_and_clear();
        tell!("{}", file.display());
        Ok(ExitCode::SUCCESS)
    }

    fn movie(&self) -> MovieOfRun {
        MovieOfRun {
            run: self.run.clone(),
            frames: self.frames,
            rate: self.fps,
            width: self.width,
            format: self.format.as_deref().and_then(MovieFormat::of),
            out: self.out.clone(),
        }
    }
}

/// A time in hours, from a number of hours or a text with a unit.
fn time(text: &str) -> Result<f64, String> {
    quantity(text, Time::KIND, true)
}

/// A width in µm, from a text with a unit.
fn width(text: &str) -> Result<f64, String> {
    let read = quantity(text, Length::KIND, false);
    read.map_err(|_| "a length with its unit belongs here, such as 85mm".to_owned()).and_then(|width| {
        let fits = (20e3..=2e6).contains(&width);
        if fits { Ok(width) } else { Err(format!("{} mm is not from 20 mm to 2 m", format_number(width / 1e3))) }
    })
}

fn quantity(text: &str, kind: Kind, plain: bool) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if plain && number.is_finite() => Ok(number),
        _ => kind.read(text.trim()).map_err(|error| error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_widths_have_units_as_scenes_have() {
        assert_eq!((time("24h"), time("24"), time("90 min")), (Ok(24.0), Ok(24.0), Ok(1.5)));
        assert_eq!((width("85mm"), width("8.5 cm")), (Ok(85e3), Ok(85e3)));
        assert!(time("24 um").unwrap_err().contains("is a length; a time such as 24"));
        assert!(width("85").is_err() && width("1 mm").is_err() && time("inf").is_err());
    }
}
