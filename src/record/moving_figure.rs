//! One panel that changes from frame to frame: the drawings of a moving picture, all with one frame of axes, one scale of colours and
//! one legend.

use super::scene_figure::{FigureError, Panel, SceneFigure, check, check_panel};
use super::scene_layout::Layout;
use super::scene_legend::Legend;
use super::scene_panel::PanelPainter;
use super::svg::Svg;
use super::theme;

/// What all frames have in common.
pub struct MovingFigure<'a> {
    layout: Layout,
    painter: PanelPainter<'a>,
    legend: Legend,
    places: Vec<[f64; 2]>,
    empty: Svg,
}

impl<'a> MovingFigure<'a> {
    /// Prepares frames from an outline of them all: a figure of one column with a panel a frame. Only what decides on room, colours
    /// and legend need be in its panels: vertices, borders, cues, tips, targets, and the most shafts that any frame has, in any one.
    ///
    /// # Errors
    /// As [`super::scene_figure::draw`].
    pub fn of(outline: &'a SceneFigure) -> Result<Self, FigureError> {
        check(outline)?;
        let layout = Layout::of_frames(outline)?;
        let painter = PanelPainter::of(outline, &layout.cell(0).view);
        let legend = Legend::of(outline, &painter);
        let (places, height) = legend.place(layout.width - 2.0 * theme::MARGIN);
        let empty = Svg::new(layout.width, layout.height + height + theme::MARGIN);
        Ok(Self { layout, painter, legend, places, empty })
    }

    /// Width and height of each frame, px.
    pub fn size(&self) -> [f64; 2] {
        self.empty.size()
    }

    /// Draws the frame of a number.
    ///
    /// # Errors
    /// As [`super::scene_figure::draw`].
    pub fn draw(&self, panel: &Panel, number: usize) -> Result<Svg, FigureError> {
        check_panel(number, panel)?;
        let (mut svg, cell) = (self.empty.part(), self.layout.cell(0));
        self.painter.define_gradients(&mut svg);
        self.layout.draw_heading(&mut svg);
        self.layout.draw_head(&mut svg, &cell, number);
        self.painter.draw(&mut svg, panel, 0, &cell.view)?;
        self.layout.draw_foot(&mut svg, &cell, number);
        self.legend.draw(&mut svg, &self.places, [theme::MARGIN, self.layout.height]);
        Ok(svg)
    }
}
