//! Figures of a scene: panels side by side with the tissue, its cues, the axons and their targets.
//!
//! All panels share one scale and one frame of axes, so that the tissue is seen to stretch from panel to panel. The cues'
//! concentrations are drawn on a logarithmic scale common to all panels, one ink an effect (see [`super::colour`]).
//! More than [`MOST_LINES`] shafts in a panel, unless a figure says otherwise, are drawn as a density instead of lines, so that a figure
//! of any run stays light. [`draw`] draws; [`super::png::to_png`] makes a picture of it.

use super::colour::Effect;
use super::raster;
use super::scene_layout::Layout;
use super::scene_legend::Legend;
use super::scene_panel::{FIELD_DENSITY, PanelPainter};
use super::svg::Svg;
use super::theme;
use rayon::prelude::*;

/// The usual number of shafts in a panel beyond which their density is shown.
pub const MOST_LINES: usize = 3000;

/// What has become of a growth cone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TipStatus {
    /// On its way.
    Growing,
    /// In the target.
    Arrived,
    /// Stopped for good, at a border or elsewhere.
    Stalled,
    /// Gone across a border.
    Left,
    /// Drawing back.
    Retracting,
    /// Drawn back for good.
    Withdrawn,
}

impl TipStatus {
    /// All of them, in the order of legends.
    pub const ALL: [Self; 6] =
        [Self::Growing, Self::Arrived, Self::Stalled, Self::Left, Self::Retracting, Self::Withdrawn];

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Growing => "growing",
            Self::Arrived => "arrived",
            Self::Stalled => "stalled",
            Self::Left => "left",
            Self::Retracting => "retracting",
            Self::Withdrawn => "withdrawn",
        }
    }
}

/// The end of a shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// Where, µm.
    pub position: [f64; 2],
    /// What has become of it.
    pub status: TipStatus,
}

/// A named edge of the tissue.
#[derive(Debug, Clone, PartialEq)]
pub struct BorderLine {
    /// The edge's name, shown as a tooltip.
    pub name: String,
    /// Its polyline, µm.
    pub points: Vec<[f64; 2]>,
}

/// One cue in one panel.
#[derive(Debug, Clone, PartialEq)]
pub struct CueLayer {
    /// The cue's name.
    pub name: String,
    /// What it does to axons.
    pub effect: Effect,
    /// Its concentration at each vertex of the panel, nM.
    pub concentration: Vec<f64>,
}

/// One picture of the tissue. Positions are those of the moment shown, in µm, y upward.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// What the panel shows: "t = 36 h", or the name of an ablation.
    pub label: String,
    /// A remark under the panel, before the counts of tips; may be empty.
    pub note: String,
    /// Vertices of the mesh, µm.
    pub vertices: Vec<[f64; 2]>,
    /// Triangles, three vertices each.
    pub cells: Vec<u32>,
    /// The tissue's outline by named edge.
    pub borders: Vec<BorderLine>,
    /// The cues.
    pub cues: Vec<CueLayer>,
    /// The shafts, origin → tip, µm.
    pub shafts: Vec<Vec<[f64; 2]>>,
    /// The tips.
    pub tips: Vec<Tip>,
    /// Outlines of the targets, µm.
    pub targets: Vec<Vec<[f64; 2]>>,
}

/// A figure of one panel or more.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneFigure {
    /// The title; may be empty.
    pub title: String,
    /// A line under the title; may be empty.
    pub subtitle: String,
    /// The panels, in reading order; rows wrap.
    pub panels: Vec<Panel>,
    /// Panels a row; none chooses (up to three panels in one row, two rows of two, then rows of three).
    pub columns: Option<usize>,
    /// Width of the figure, px; none chooses by the number of columns.
    pub width: Option<f64>,
    /// Whether the outline of the first panel is repeated in panels whose tissue has another shape.
    pub compare_outlines: bool,
    /// More shafts than this in any panel, and the whole figure shows their density instead of lines.
    pub most_lines: usize,
}

impl SceneFigure {
    /// A figure with the usual choices.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>, panels: Vec<Panel>) -> Self {
        Self {
            title: title.into(),
            subtitle: subtitle.into(),
            panels,
            columns: None,
            width: None,
            compare_outlines: true,
            most_lines: MOST_LINES,
        }
    }
}

/// A figure could not be drawn from the data given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FigureError {
    /// There is nothing to draw.
    #[error("a figure needs at least one panel")]
    NoPanel,
    /// A panel's positions are all equal or not finite.
    #[error("the panels have no extent: x from {low:?} to {high:?} um")]
    NoExtent {
        /// Smallest x and y, µm.
        low: [f64; 2],
        /// Largest x and y, µm.
        high: [f64; 2],
    },
    /// A position is not finite.
    #[error("panel {panel} has a position that is not finite among its {what}")]
    NotFinite {
        /// The panel, counted from 0.
        panel: usize,
        /// Where: vertices, borders, shafts, tips or targets.
        what: &'static str,
    },
    /// A triangle names a vertex that does not exist.
    #[error("panel {panel}: cell entry {entry} names vertex {vertex}, but there are only {count}")]
    NoSuchVertex {
        /// The panel, counted from 0.
        panel: usize,
        /// Position in the flat list of cells.
        entry: usize,
        /// The vertex named.
        vertex: u32,
        /// Vertices of the panel.
        count: usize,
    },
    /// A cue does not have one finite value a vertex.
    #[error("panel {panel}: cue '{cue}' has {found} finite values for {expected} vertices")]
    Concentration {
        /// The panel, counted from 0.
        panel: usize,
        /// The cue.
        cue: String,
        /// Finite values given.
        found: usize,
        /// Vertices of the panel.
        expected: usize,
    },
    /// The width asked for leaves too little for a panel.
    #[error("{columns} panels a row need a width of {:.0} mm at least", least * 25.4 / 96.0)]
    TooNarrow {
        /// Panels a row.
        columns: usize,
        /// Least width, px.
        least: f64,
    },
    /// A raster image could not be made.
    #[error("an image of the figure could not be made")]
    Image,
}

/// Draws a figure: 180 mm wide from three columns on unless it has a width, no text below 7 pt, fonts embedded.
///
/// # Errors
/// A figure without panels or extent, positions or concentrations that are not finite or do not match the mesh.
pub fn draw(figure: &SceneFigure) -> Result<Svg, FigureError> {
    check(figure)?;
    let layout = Layout::of(figure)?;
    let painter = PanelPainter::of(figure, &layout.cell(0).view);
    let legend = Legend::of(figure, &painter);
    let (placed, legend_height) = legend.place(layout.width - 2.0 * theme::MARGIN);
    let mut svg = Svg::new(layout.width, layout.height + legend_height + theme::MARGIN);
    painter.define_gradients(&mut svg);
    layout.draw_heading(&mut svg);
    let draw_panel = |(index, panel): (usize, &Panel)| {
        let (mut part, cell) = (svg.part(), layout.cell(index));
        layout.draw_head(&mut part, &cell, index);
        painter.draw(&mut part, panel, index, &cell.view)?;
        layout.draw_foot(&mut part, &cell, index);
        Ok(part)
    };
    let parts: Vec<Svg> = figure.panels.par_iter().enumerate().map(draw_panel).collect::<Result<_, FigureError>>()?;
    parts.into_iter().for_each(|part| svg.append(part));
    legend.draw(&mut svg, &placed, [theme::MARGIN, layout.height]);
    Ok(svg)
}

/// How large a figure is as a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureSize {
    /// Pixels of the page.
    pub page: f64,
    /// Pixels of the field of one panel.
    pub field: f64,
}

impl PictureSize {
    /// Of a figure of `panels` panels of one extent (µm), with `scale` pixels for a px.
    ///
    /// # Errors
    /// No panel, or no extent.
    pub fn of(panels: usize, extent: [f64; 2], scale: f64) -> Result<Self, FigureError> {
        let empty = Panel { vertices: vec![[0.0; 2], extent], ..Panel::default() };
        let layout = Layout::of(&SceneFigure::new(" ", " ", vec![empty; panels]))?;
        let page = layout.width * layout.height * scale.powi(2);
        Ok(Self { page, field: layout.drawing_area() * FIELD_DENSITY.powi(2) })
    }

    /// Bytes that drawing it takes: the field of one panel, as with one thread, and the page.
    pub fn bytes_to_draw(&self) -> f64 {
        self.page * size_of::<u32>() as f64 + self.field * raster::BYTES_A_PIXEL as f64
    }
}

/// Refuses what cannot be drawn.
pub(super) fn check(figure: &SceneFigure) -> Result<(), FigureError> {
    figure.panels.iter().enumerate().try_for_each(|(index, panel)| check_panel(index, panel))
}

pub(super) fn check_panel(index: usize, panel: &Panel) -> Result<(), FigureError> {
    let finite = |points: &[[f64; 2]]| points.iter().flatten().all(|value| value.is_finite());
    let checks = [
        ("vertices", finite(&panel.vertices)),
        ("borders", panel.borders.iter().all(|border| finite(&border.points))),
        ("shafts", panel.shafts.iter().all(|shaft| finite(shaft))),
        ("tips", panel.tips.iter().all(|tip| finite(&[tip.position]))),
        ("targets", panel.targets.iter().all(|target| finite(target))),
    ];
    if let Some((what, _)) = checks.iter().find(|(_, fine)| !fine) {
        return Err(FigureError::NotFinite { panel: index, what });
    }
    let count = panel.vertices.len();
    if let Some((entry, &vertex)) = panel.cells.iter().enumerate().find(|(_, vertex)| **vertex as usize >= count) {
        return Err(FigureError::NoSuchVertex { panel: index, entry, vertex, count });
    }
    for cue in &panel.cues {
        let found = cue.concentration.iter().filter(|value| value.is_finite()).count();
        if found != count || cue.concentration.len() != count {
            return Err(FigureError::Concentration { panel: index, cue: cue.name.clone(), found, expected: count });
        }
    }
    Ok(())
}
#[cfg(test)]
#[path = "scene_figure_tests.rs"]
mod tests;
