//! Pictures of finished runs, from their recordings: figures at any time or side by side, and movies.

use super::assay::Assay;
use super::run::RunError;
use crate::model::observables::Effect;
use crate::record::movie::strip::{frame, outline};
use crate::record::movie::{MovieError, MovieFormat, Pace, encode};
use crate::record::moving_figure::MovingFigure;
use crate::record::output::write_atomically;
use crate::record::plot;
use crate::record::png::{scale_for_dpi, to_png};
use crate::record::recording::{self, Recording};
use crate::record::scene_figure::{FigureError, Panel, SceneFigure, draw};
use crate::record::scene_view::panel;
use crate::record::snapshot::Snapshot;
use crate::record::svg::Svg;
use std::path::{Path, PathBuf};

/// Resolution of PNG files, dots an inch.
const DPI: f32 = 300.0;
/// µm in a px of 1/96 inch.
const MICROMETRES_A_PX: f64 = 25_400.0 / 96.0;

/// A figure of finished runs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FigureOfRuns {
    /// Folders of runs.
    pub runs: Vec<PathBuf>,
    /// Times to show (h); none for those of the scene's own figure, or the end where there are several runs.
    pub times: Vec<f64>,
    /// The cues to show; none for those that cones turn by.
    pub cues: Vec<String>,
    /// Width (µm); none chooses by the number of panels.
    pub width: Option<f64>,
    /// Whether to draw the paths as a turning assay does, from one start, and how their turning angles are spread.
    pub assay: bool,
    /// File to write, `.svg` or `.png`, or both without an ending; none for `picture` (`assay`) in the first run's folder.
    pub out: Option<PathBuf>,
}

/// A movie of a finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct MovieOfRun {
    /// Folder of the run.
    pub run: PathBuf,
    /// Frames, none for as many as the recording has.
    pub frames: Option<u32>,
    /// Frames a second.
    pub rate: u16,
    /// Pixels across.
    pub width: u32,
    /// The kind of file; none for that of the file's ending, or GIF.
    pub format: Option<MovieFormat>,
    /// File to write; none for `movie` in the run's folder.
    pub out: Option<PathBuf>,
}

/// A run that was recorded, and where.
struct Recorded {
    folder: PathBuf,
    recording: Recording,
}

impl FigureOfRuns {
    /// Draws the figure and writes it; returns the files.
    ///
    /// # Errors
    /// A folder without a recording, a time or a cue that the run does not have, a file that cannot be written.
    pub fn write(&self) -> Result<Vec<PathBuf>, RunError> {
        let runs: Vec<Recorded> = self.runs.iter().map(|run| Recorded::open(run)).collect::<Result<_, _>>()?;
        let files = self.files(&runs)?;
        let figure = if self.assay { self.assay(&runs)? } else { draw(&self.figure(&runs)?).map_err(refused)? };
        for file in &files {
            write_atomically(file, &contents(&figure, file)?)?;
        }
        Ok(files)
    }

    fn files(&self, runs: &[Recorded]) -> Result<Vec<PathBuf>, RunError> {
        let out = match (&self.out, runs.first()) {
            (Some(out), _) => out.clone(),
            (None, Some(first)) => first.folder.join(if self.assay { "assay" } else { "picture" }),
            (None, None) => return Err(RunError::Arguments("a figure needs a run".into())),
        };
        match ending(&out).as_deref() {
            Some("svg" | "png") => Ok(vec![out]),
            None => Ok(["svg", "png"].map(|ending| out.with_extension(ending)).to_vec()),
            Some(other) => {
                let message = format!("--out {}: figures end in .svg or .png, not .{other}", out.display());
                Err(RunError::Arguments(message))
            }
        }
    }

    fn figure(&self, runs: &[Recorded]) -> Result<SceneFigure, RunError> {
        let names = names(runs);
        let mut panels = Vec::new();
        for (run, name) in runs.iter().zip(&names) {
            let times = self.times_of(run, runs.len());
            for &time in &times {
                let label = match (runs.len(), times.len()) {
                    (1, _) => time_label(time),
                    (_, 1) if !self.times.is_empty() => name.clone(),
                    _ => format!("{name}, {}", time_label(time)),
                };
                panels.push(self.panel(run, label, time)?);
            }
        }
        let several = runs.len() > 1;
        let header = runs.first().map(|run| &run.recording.header);
        let (title, subtitle) = match (header, self.times.as_slice()) {
            (Some(header), _) if !several => (header.scene.clone(), header.description.clone()),
            (_, [time]) => (String::new(), time_label(*time)),
            _ => Default::default(),
        };
        Ok(SceneFigure {
            columns: (several && self.times.len() > 1).then_some(self.times.len()),
            width: self.width.map(|width| width / MICROMETRES_A_PX),
            compare_outlines: !several,
            ..SceneFigure::new(title, subtitle, panels)
        })
    }

    /// The turning assay of one run at one time.
    fn assay(&self, runs: &[Recorded]) -> Result<Svg, RunError> {
        let ([run], [] | [_], [] | [_], None) = (runs, &self.times[..], &self.cues[..], self.width) else {
            let message = "--assay draws one run at one time, by one cue, 180 mm wide";
            return Err(RunError::Arguments(message.into()));
        };
        let time = self.times.first().copied().unwrap_or(run.recording.span().1);
        // What the panel refuses is refused here too.
        self.panel(run, String::new(), time)?;
        let Some(assay) = Assay::of(&run.recording, time, self.cues.first().map(String::as_str)) else {
            let message = format!("{} has no first headings in its recording: run it again", run.folder.display());
            return Err(RunError::Arguments(message));
        };
        let subtitle = format!("{}; {}", run.recording.header.description, time_label(time).replace(' ', "\u{a0}"));
        plot::draw(&run.recording.header.scene, &subtitle, &assay.plots()).map_err(refused)
    }

    fn times_of(&self, run: &Recorded, runs: usize) -> Vec<f64> {
        match (self.times.is_empty(), runs) {
            (false, _) => self.times.clone(),
            (true, 1) => run.recording.figure_times(),
            (true, _) => vec![run.recording.span().1],
        }
    }

    fn panel(&self, run: &Recorded, label: String, time: f64) -> Result<Panel, RunError> {
        let (first, last) = run.recording.span();
        // Times of a run are whole ticks, which may miss a round time by less than this.
        let slack = 1e-6 * last;
        if !(first - slack..=last + slack).contains(&time) {
            let span = format!("{} was recorded from {first} h to {last} h", run.folder.display());
            return Err(RunError::Arguments(format!("{} is not there: {span}", time_label(time))));
        }
        let mut snapshot = run.recording.snapshot(time);
        self.choose_cues(run, &mut snapshot)?;
        Ok(panel(label, &snapshot))
    }

    /// Leaves the cues that were asked for, also those that nothing turns by.
    fn choose_cues(&self, run: &Recorded, snapshot: &mut Snapshot) -> Result<(), RunError> {
        if self.cues.is_empty() {
            return Ok(());
        }
        let there: Vec<&str> = snapshot.fields.iter().map(|field| field.name.as_str()).collect();
        if let Some(unknown) = self.cues.iter().find(|cue| !there.contains(&cue.as_str())) {
            let list =
                if there.is_empty() { "there are none".into() } else { format!("there are: {}", there.join(", ")) };
            let message = format!("{} has no cue called `{unknown}`; {list}", run.folder.display());
            return Err(RunError::Arguments(message));
        }
        snapshot.fields.retain(|field| self.cues.contains(&field.name));
        for field in &mut snapshot.fields {
            field.effect.get_or_insert(Effect::Attract);
        }
        Ok(())
    }
}

impl MovieOfRun {
    /// Makes the movie and writes it; returns the file. `tick` is called after each frame with the share done.
    ///
    /// # Errors
    /// A folder without a recording, no ffmpeg for an MP4, a file that cannot be written.
    pub fn write(&self, tick: impl FnMut(f64)) -> Result<PathBuf, RunError> {
        let (file, format) = self.file()?;
        let run = Recorded::open(&self.run)?;
        let recording = &run.recording;
        let frames = self.frames.unwrap_or(recording.header.frames.len() as u32).max(1);
        let outline = outline(recording, &recording.header.scene, frames);
        let figure = MovingFigure::of(&outline).map_err(refused)?;
        let picture = |number: u32| frame((recording, &figure), (frames, number), self.width);
        let bytes = encode(format, Pace { frames, rate: self.rate }, picture, tick, &file).map_err(|error| {
            if matches!(error, MovieError::NoFfmpeg) {
                RunError::Arguments(error.to_string())
            } else {
                RunError::Solve(error.to_string())
            }
        })?;
        write_atomically(&file, &bytes)?;
        Ok(file)
    }

    /// The file and its format.
    fn file(&self) -> Result<(PathBuf, MovieFormat), RunError> {
        let format = match (self.format, self.out.as_deref().map(ending)) {
            (Some(format), _) => format,
            (None, None | Some(None)) => MovieFormat::Gif,
            (None, Some(Some(ending))) => MovieFormat::of(&ending).ok_or_else(|| {
                let known = "movies end in .gif, .png (APNG), .apng or .mp4";
                RunError::Arguments(format!("--out: {known}, not .{ending}; or say --format"))
            })?,
        };
        let mut file = self.out.clone().unwrap_or_else(|| folder(&self.run).join("movie"));
        if file.extension().is_none() {
            file.set_extension(format.ending());
        }
        Ok((file, format))
    }
}

impl Recorded {
    /// Opens the recording of a run's folder.
    fn open(run: &Path) -> Result<Self, RunError> {
        let folder = folder(run);
        let file = folder.join(recording::FILE_NAME);
        let bytes = std::fs::read(&file).map_err(|error| {
            let place = folder.display();
            RunError::Arguments(if !folder.is_dir() {
                format!("{place}: no such folder of results")
            } else if error.kind() == std::io::ErrorKind::NotFound {
                let why = "single runs leave one, unless `output/frames` is 0 or, without that key, axons are more than 20 000";
                format!("{place}: there is no {}; {why}", recording::FILE_NAME)
            } else {
                format!("cannot read {}: {error}", file.display())
            })
        })?;
        let recording = Recording::read(&bytes)
            .map_err(|error| RunError::Arguments(format!("cannot read {}: {error}", file.display())))?;
        Ok(Self { folder, recording })
    }
}

/// The folder of a run, named by itself or by its recording.
fn folder(run: &Path) -> PathBuf {
    let is_file = run.file_name().is_some_and(|name| name == recording::FILE_NAME);
    run.parent().filter(|_| is_file).unwrap_or(run).to_path_buf()
}

/// Names that tell runs apart: those of their scenes, or of their folders where scenes are the same.
fn names(runs: &[Recorded]) -> Vec<String> {
    let scenes: Vec<String> = runs.iter().map(|run| run.recording.header.scene.clone()).collect();
    let distinct = scenes.iter().enumerate().all(|(place, name)| !scenes[..place].contains(name));
    if distinct {
        return scenes;
    }
    runs.iter().map(|run| run.folder.file_name().unwrap_or(run.folder.as_os_str()).to_string_lossy().into()).collect()
}

fn time_label(time: f64) -> String {
    format!("t = {} h", (time * 100.0).round() / 100.0)
}

fn ending(file: &Path) -> Option<String> {
    file.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
}

fn contents(figure: &Svg, file: &Path) -> Result<Vec<u8>, RunError> {
    match ending(file).as_deref() {
        Some("png") => Ok(to_png(&figure.outlined(), scale_for_dpi(DPI))?),
        _ => Ok(figure.finish().into_bytes()),
    }
}

/// A width that is too small is the user's to change.
fn refused(error: FigureError) -> RunError {
    match error {
        FigureError::TooNarrow { .. } => RunError::Arguments(error.to_string()),
        error => RunError::Figure(error),
    }
}
