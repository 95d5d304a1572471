//! The frames of a recording's movie.

use super::{Frame, MovieError};
use crate::record::moving_figure::MovingFigure;
use crate::record::png::render;
use crate::record::recording::Recording;
use crate::record::scene_figure::{Panel, SceneFigure};
use crate::record::scene_view::panel;
use rayon::prelude::*;

/// Width of the page, px: two colour bars stand side by side.
const WIDTH: f64 = 440.0;

/// What decides on room, colours and legend of all frames at equal times from start to end of a recording.
///
/// The figure's panels have vertices, borders, cues and tips; the last one has everything.
pub fn outline(recording: &Recording, title: &str, frames: u32) -> SceneFigure {
    let panel = |number: u32| {
        let whole = frame_panel(recording, frames, number);
        let is_last = number + 1 == frames;
        if is_last { whole } else { Panel { cells: Vec::new(), shafts: Vec::new(), ..whole } }
    };
    let panels = (0..frames).into_par_iter().map(panel).collect();
    SceneFigure { columns: Some(1), width: Some(WIDTH), compare_outlines: false, ..SceneFigure::new(title, "", panels) }
}

/// The frame of a number, `width` pixels across.
///
/// # Errors
/// A frame that cannot be drawn.
pub fn frame(
    (recording, figure): (&Recording, &MovingFigure),
    (frames, number): (u32, u32),
    width: u32,
) -> Result<Frame, MovieError> {
    let drawing = figure.draw(&frame_panel(recording, frames, number), number as usize)?;
    // A little less, so that rounding up does not add a pixel.
    let scale = (f64::from(width) - 0.01) / figure.size()[0];
    let picture = render(&drawing.outlined(), scale as f32)?;
    let size = [picture.width(), picture.height()];
    let pixels = picture.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    Ok(Frame { size, pixels })
}

fn frame_panel(recording: &Recording, frames: u32, number: u32) -> Panel {
    let (first, last) = recording.span();
    let share = f64::from(number) / f64::from(frames.saturating_sub(1).max(1));
    let time = if number + 1 == frames { last } else { first + share * (last - first) };
    let digits = if last - first >= 24.0 { 0 } else { 1 };
    panel(format!("t = {time:.digits$} h"), &recording.snapshot(time))
}
