//! One panel of a figure: tissue and cues as a raster, axons as lines or density, targets, outline and tips on top.

use super::colour::{Effect, from_srgb, glaze, hexadecimal, to_srgb};
use super::cue_scale::{CueScale, total_concentration};
use super::markers::draw_markers;
use super::png::encode;
use super::polyline::simplify;
use super::raster::{Coverage, Sheet, Triangles, paint_cells};
use super::scene_figure::{BorderLine, FigureError, Panel, SceneFigure, TipStatus};
use super::svg::{Anchor, Label, Svg, number, path_data};
use super::theme::{self, Font};
use rayon::prelude::*;
use resvg::tiny_skia::Pixmap;

/// Pixels of the field's image for one px.
pub(super) const FIELD_DENSITY: f64 = 2.0;
/// Pixels of the density of shafts for one px.
const COVERAGE_DENSITY: f64 = 3.0;
/// Polylines are drawn to within this many px.
const VISIBLE: f64 = 0.2;

/// The map from µm (y upward) to px (y downward).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    /// Where the upper left corner of the common frame stands, px.
    pub(super) corner: [f64; 2],
    /// px a µm.
    pub(super) scale: f64,
    /// Smallest x of the common frame, µm.
    pub(super) left: f64,
    /// Largest y of the common frame, µm.
    pub(super) top: f64,
}

impl View {
    /// The same map with the frame's corner at the origin, for images.
    fn at_origin(&self) -> Self {
        Self { corner: [0.0; 2], ..*self }
    }

    fn place(&self, point: [f64; 2]) -> [f64; 2] {
        let right = self.corner[0] + self.scale * (point[0] - self.left);
        [right, self.corner[1] + self.scale * (self.top - point[1])]
    }

    fn place_all(&self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        points.iter().map(|&point| self.place(point)).collect()
    }

    fn place_simply(&self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        simplify(&self.place_all(points), VISIBLE)
    }
}

/// What all panels of a figure have in common.
pub(super) struct PanelPainter<'a> {
    pub(super) scales: Vec<CueScale>,
    pub(super) ghost: Option<&'a [BorderLine]>,
    /// The most shafts on one pixel, where density replaces lines.
    pub(super) densest: Option<u32>,
    pub(super) statuses: Vec<TipStatus>,
    pub(super) targets: bool,
    ghosted: Vec<bool>,
    stroke: Stroke,
    tip_radius: f64,
}

/// Width (px) and opacity of shafts.
struct Stroke {
    width: f64,
    opacity: f64,
}

impl Stroke {
    /// Thinner and clearer the more there are: ink per panel grows slower than the number of shafts.
    fn for_count(count: usize) -> Self {
        let count = count.max(1) as f64;
        Self { width: (2.6 * count.powf(-0.3)).clamp(0.35, 1.1), opacity: (3.2 * count.powf(-0.32)).clamp(0.35, 0.9) }
    }
}

impl<'a> PanelPainter<'a> {
    /// Prepares a figure whose panels are drawn like `view`, wherever its corner.
    pub(super) fn of(figure: &'a SceneFigure, view: &View) -> Self {
        let panels = &figure.panels;
        let most = panels.iter().map(|panel| panel.shafts.len()).max().unwrap_or(0);
        let dense = most > figure.most_lines;
        let coverage = |panel: &Panel| cover(panel, view).map_or(0, |coverage| coverage.maximum());
        let shown =
            |status: &TipStatus| !dense && panels.iter().any(|p| p.tips.iter().any(|tip| tip.status == *status));
        let first = panels.first().map_or(&[][..], |panel| &panel.borders);
        let ghosted: Vec<bool> =
            panels.iter().map(|panel| figure.compare_outlines && shape_differs(first, &panel.borders)).collect();
        Self {
            scales: [Effect::Attract, Effect::Repel].iter().filter_map(|&e| CueScale::of(panels, e)).collect(),
            ghost: ghosted.contains(&true).then_some(first),
            densest: dense.then(|| panels.par_iter().map(coverage).max().unwrap_or(0)),
            statuses: TipStatus::ALL.into_iter().filter(shown).collect(),
            targets: panels.iter().any(|panel| !panel.targets.is_empty()),
            ghosted,
            stroke: Stroke::for_count(most),
            tip_radius: (4.0 * (most.max(1) as f64).powf(-0.2)).clamp(1.1, 2.4),
        }
    }

    /// Writes the gradients of the colour bars.
    pub(super) fn define_gradients(&self, svg: &mut Svg) {
        let tissue = from_srgb(theme::TISSUE);
        for scale in &self.scales {
            let stop = |i: u32| {
                let share = f64::from(i) / 20.0;
                (share, to_srgb(glaze(tissue, scale.ramp.at(share))), 1.0)
            };
            svg.gradient(gradient_name(scale.effect), &(0..=20).map(stop).collect::<Vec<_>>());
        }
        if let Some(densest) = self.densest {
            let stop = |i: u32| {
                let share = f64::from(i) / 10.0;
                (share, theme::SHAFT, opacity_of_density(f64::from(densest).powf(share), densest))
            };
            svg.gradient("density", &(0..=10).map(stop).collect::<Vec<_>>());
        }
    }

    /// Draws a panel.
    pub(super) fn draw(&self, svg: &mut Svg, panel: &Panel, index: usize, view: &View) -> Result<(), FigureError> {
        // Images first: the PNG renderer puts them beneath all drawings.
        self.draw_field(svg, panel, view)?;
        self.draw_density(svg, panel, view)?;
        if let (Some(ghost), true) = (self.ghost, self.ghosted[index]) {
            draw_outline(svg, ghost, view, &ghost_style());
        }
        self.draw_shafts(svg, panel, view);
        draw_targets(svg, panel, view);
        let (colour, width) = (hexadecimal(theme::OUTLINE), "0.9");
        let round = [("stroke-linejoin", "round"), ("stroke-linecap", "round")];
        draw_outline(svg, &panel.borders, view, &[("stroke", &colour), ("stroke-width", width), round[0], round[1]]);
        self.draw_tips(svg, panel, view);
        if index == 0 {
            label_target(svg, panel, view);
        }
        Ok(())
    }

    /// The tissue, glazed by the cues.
    fn draw_field(&self, svg: &mut Svg, panel: &Panel, view: &View) -> Result<(), FigureError> {
        let points = view.at_origin().place_all(&panel.vertices);
        let Some(sheet) = sheet_over(&points, FIELD_DENSITY) else { return Ok(()) };
        let layers: Vec<(&CueScale, Vec<f64>)> =
            self.scales.iter().filter_map(|scale| Some((scale, total_concentration(panel, scale.effect)?))).collect();
        let tissue = from_srgb(theme::TISSUE);
        let light = |corners: [usize; 3], weights: [f64; 3]| {
            layers.iter().fold(tissue, |light, (scale, nodal)| {
                let concentration = (0..3).map(|i| weights[i] * nodal[corners[i]]).sum();
                glaze(light, scale.ramp.at(scale.range.share(concentration)))
            })
        };
        let image = paint_cells(&sheet, Triangles { points: &points, cells: &panel.cells }, light);
        place_image(svg, view, &sheet, image)
    }

    /// The density of many shafts.
    fn draw_density(&self, svg: &mut Svg, panel: &Panel, view: &View) -> Result<(), FigureError> {
        let (Some(densest), Some(coverage)) = (self.densest, cover(panel, view)) else { return Ok(()) };
        let opacity = |count: u32| opacity_of_density(f64::from(count), densest);
        place_image(svg, view, coverage.sheet(), coverage.paint(from_srgb(theme::SHAFT), opacity))
    }

    /// Shafts as lines, unless they are shown by their density.
    fn draw_shafts(&self, svg: &mut Svg, panel: &Panel, view: &View) {
        if self.densest.is_some() {
            return;
        }
        let (colour, width) = (hexadecimal(theme::SHAFT), number(self.stroke.width));
        let opacity = number(self.stroke.opacity);
        svg.open_group(&[
            ("fill", "none"),
            ("stroke", &colour),
            ("stroke-width", &width),
            ("stroke-opacity", &opacity),
            ("stroke-linejoin", "round"),
        ]);
        for shaft in &panel.shafts {
            let data = path_data([view.place_simply(shaft).as_slice()]);
            if !data.is_empty() {
                svg.element("path", &[("d", &data)]);
            }
        }
        svg.close_group();
    }

    fn draw_tips(&self, svg: &mut Svg, panel: &Panel, view: &View) {
        for &status in &self.statuses {
            let tips = panel.tips.iter().filter(|tip| tip.status == status);
            draw_markers(svg, status, self.tip_radius, tips.map(|tip| view.place(tip.position)));
        }
    }
}

/// The name of the gradient of an effect's colour bar.
pub(super) fn gradient_name(effect: Effect) -> &'static str {
    match effect {
        Effect::Attract => "attract",
        Effect::Repel => "repel",
    }
}

/// How a repeated outline of the first panel is drawn, in panels and legend.
pub(super) fn ghost_style() -> [(&'static str, &'static str); 3] {
    [("stroke", theme::GHOST), ("stroke-width", "0.7"), ("stroke-dasharray", "1.2 2.2")]
}

/// How a target is drawn, in panels and legend.
pub(super) fn target_style() -> [(&'static str, &'static str); 3] {
    [("stroke", theme::INK), ("stroke-width", "0.9"), ("stroke-dasharray", "3.2 2")]
}

/// Opacity of a pixel that `count` shafts pass, where `densest` is the most on any: a logarithm, so that single shafts
/// stay visible beside thick bundles.
fn opacity_of_density(count: f64, densest: u32) -> f64 {
    let share = count.max(1.0).ln() / f64::from(densest.max(2)).ln();
    0.1 + 0.85 * share.min(1.0)
}

/// The coverage of a panel by its shafts, in px from the common frame's corner; none without extent.
fn cover(panel: &Panel, view: &View) -> Option<Coverage> {
    let view = view.at_origin();
    let shafts: Vec<Vec<[f64; 2]>> = panel.shafts.iter().map(|shaft| view.place_all(shaft)).collect();
    let sheet = sheet_over(&shafts.concat(), COVERAGE_DENSITY)?;
    Some(Coverage::of(&sheet, shafts.iter().map(Vec::as_slice)))
}

/// A sheet over the box around points; none without points.
fn sheet_over(points: &[[f64; 2]], density: f64) -> Option<Sheet> {
    let (low, high) = (corner(points, f64::min)?, corner(points, f64::max)?);
    // A line of no width still covers the pixels it passes.
    Sheet::covering(low.map(|edge| edge - 0.5), high.map(|edge| edge + 0.5), density)
}

/// Writes an image made on a sheet in px from the common frame's corner.
fn place_image(svg: &mut Svg, view: &View, sheet: &Sheet, image: Option<Pixmap>) -> Result<(), FigureError> {
    let png = image.and_then(|image| encode(image).ok()).ok_or(FigureError::Image)?;
    let corner = [view.corner[0] + sheet.corner[0], view.corner[1] + sheet.corner[1]];
    svg.image(corner, sheet.size(), &png);
    Ok(())
}

fn draw_outline(svg: &mut Svg, borders: &[BorderLine], view: &View, style: &[(&str, &str)]) {
    svg.open_group(&[&[("fill", "none")], style].concat());
    for border in borders {
        svg.titled_path(&border.name, &path_data([view.place_simply(&border.points).as_slice()]));
    }
    svg.close_group();
}

fn draw_targets(svg: &mut Svg, panel: &Panel, view: &View) {
    for target in &panel.targets {
        let mut outline = view.place_simply(target);
        outline.extend(outline.first().copied());
        let data = path_data([outline.as_slice()]);
        let rim = [("stroke", "#ffffff"), ("stroke-width", "2.2"), ("stroke-opacity", "0.6")];
        for style in [rim, target_style()] {
            svg.element("path", &[&[("d", data.as_str()), ("fill", "none")][..], &style].concat());
        }
    }
}

/// Writes "target" beside the first target: to its right, or to its left where the tissue ends too soon.
fn label_target(svg: &mut Svg, panel: &Panel, view: &View) {
    let outline = panel.targets.first().map(|target| view.place_all(target)).unwrap_or_default();
    let (Some([left, top]), Some([right, bottom])) = (corner(&outline, f64::min), corner(&outline, f64::max)) else {
        return;
    };
    let (font, colour, text) = (Font::regular(theme::SMALL), theme::TEXT, "target");
    let tissue = view.place_all(&panel.vertices);
    let side = |choose, of_target: f64| corner(&tissue, choose).map_or(of_target, |tissue| tissue[0]);
    let room = 4.0 + font.width(text);
    let (x, anchor) = if right + room <= side(f64::max, right) {
        (right + 4.0, Anchor::Start)
    } else if left - room >= side(f64::min, left) {
        (left - 4.0, Anchor::End)
    } else {
        (0.5 * (left + right), Anchor::Middle)
    };
    let at = [x, 0.5 * (top + bottom) + 0.35 * font.size];
    svg.label(&Label { at, anchor, font, colour, halo: true, text });
}

/// The smallest or largest coordinates of points; none without points.
fn corner(points: &[[f64; 2]], choose: fn(f64, f64) -> f64) -> Option<[f64; 2]> {
    points.iter().copied().reduce(|one, other| [choose(one[0], other[0]), choose(one[1], other[1])])
}

/// Whether two outlines differ by more than 0.5 % of the first one's extent in any side of their boxes.
fn shape_differs(one: &[BorderLine], other: &[BorderLine]) -> bool {
    let sides = |borders: &[BorderLine]| {
        let points: Vec<[f64; 2]> = borders.iter().flat_map(|border| border.points.iter().copied()).collect();
        Some((corner(&points, f64::min)?, corner(&points, f64::max)?))
    };
    let (Some(one), Some(other)) = (sides(one), sides(other)) else { return false };
    let tolerance = 0.005 * (one.1[0] - one.0[0]).max(one.1[1] - one.0[1]);
    (0..2).any(|axis| (one.0[axis] - other.0[axis]).abs().max((one.1[axis] - other.1[axis]).abs()) > tolerance)
}
