//! Plots: series of points over two axes, side by side under one title.
//!
//! Series differ by colour (Okabe & Ito) *and* by the shape of their marks, so that they are told apart in print and by the
//! colour-blind. The label of the y axis stands above it, level with the eye that reads it.

pub use super::plot_axis::Axis;
use super::plot_axis::Scale;
use super::plot_parts::{Frame, Words, colour_of, draw_line, draw_mark, draw_polylines};
use super::scene_figure::FigureError;
use super::svg::{Anchor, Label, Svg, number, path_data};
use super::theme::{self, Font};

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
    /// A hair's breadth, for many lines on top of each other.
    Hair,
    /// Marks alone.
    Marks,
    /// A line through marks.
    LineAndMarks,
    /// A broad pale line under all others.
    Underlay,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What the legend says.
    pub name: String,
    /// x and y.
    pub points: Vec<[f64; 2]>,
    /// Low and high in y for each point; empty: none.
    pub whiskers: Vec<[f64; 2]>,
    /// How it is drawn.
    pub stroke: Stroke,
}

impl Series {
    /// A series without whiskers.
    pub fn new(name: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>, stroke: Stroke) -> Self {
        Self { name: name.into(), points: points.into_iter().collect(), whiskers: Vec::new(), stroke }
    }
}

/// A straight line across a plot, with a word on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The word.
    pub name: String,
    /// Its value in x if `vertical`, else in y.
    pub at: f64,
    /// Whether it runs from bottom to top.
    pub vertical: bool,
}

/// A point singled out, with a word beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// The word.
    pub name: String,
    /// x and y.
    pub at: [f64; 2],
}

/// One pair of axes with what is drawn on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The series, in the order of the legend.
    pub series: Vec<Series>,
    /// Lines across.
    pub levels: Vec<Level>,
    /// Points singled out.
    pub marks: Vec<Mark>,
    /// A remark below; may be empty.
    pub note: String,
}

/// Height of the axes' frame, px.
const FRAME_HEIGHT: f64 = 230.0;
/// Room to the left of a frame for the words of ticks.
const LEFT_ROOM: f64 = 44.0;
/// Room under a frame for ticks and the label.
const FOOT_ROOM: f64 = 36.0;
const SMALL: Font = Font::regular(theme::SMALL);
const GRID: &str = "#e6e3de";

/// Plots side by side under a title, two a row. Points that are not finite, or have no logarithm on such an axis, are left out.
///
/// # Errors
/// No plot.
pub fn draw(title: &str, subtitle: &str, plots: &[Plot]) -> Result<Svg, FigureError> {
    if plots.is_empty() {
        return Err(FigureError::NoPanel);
    }
    let columns = plots.len().min(2);
    let inner = theme::FULL_WIDTH - 2.0 * theme::MARGIN;
    let width = (inner - (columns - 1) as f64 * 1.5 * theme::GAP) / columns as f64;
    let placed: Vec<Placed> = plots.iter().map(|plot| Placed::new(plot, width)).collect();
    let heading = [(title, Font::bold(theme::TITLE), theme::TEXT), (subtitle, SMALL, theme::MUTED)];
    let heading = heading.map(|(text, font, colour)| (font.wrap(text, inner), font, colour));
    let top =
        heading.iter().map(|(lines, font, _)| lines.len() as f64 * font.line()).sum::<f64>() + theme::MARGIN + 8.0;
    let rows: Vec<f64> = placed.chunks(columns).map(|row| row.iter().map(Placed::height).fold(0.0, f64::max)).collect();
    let mut svg = Svg::new(theme::FULL_WIDTH, top + rows.iter().sum::<f64>() + theme::MARGIN);
    let mut at = [theme::MARGIN, theme::MARGIN];
    for (lines, font, colour) in &heading {
        at[1] = write_lines(&mut svg, lines, at, *font, *colour);
    }
    for (index, placed) in placed.iter().enumerate() {
        let (row, column) = (index / columns, index % columns);
        let corner =
            [theme::MARGIN + column as f64 * (width + 1.5 * theme::GAP), top + rows[..row].iter().sum::<f64>()];
        let letter = (plots.len() > 1).then(|| char::from(b'a' + (index % 26) as u8));
        placed.draw(&mut svg, corner, letter);
    }
    Ok(svg)
}

/// Writes lines of text downward from an upper left corner; returns where the next would begin.
fn write_lines(svg: &mut Svg, lines: &[String], at: [f64; 2], font: Font, colour: [u8; 3]) -> f64 {
    let mut top = at[1];
    for text in lines {
        svg.label(&Label { at: [at[0], top + font.size], anchor: Anchor::Start, font, colour, halo: false, text });
        top += font.line();
    }
    top
}

/// A plot with its scales and the lines of its texts.
struct Placed<'a> {
    plot: &'a Plot,
    width: f64,
    x: Scale,
    y: Scale,
    title: Vec<String>,
    legend: Vec<Vec<usize>>,
    note: Vec<String>,
}

impl<'a> Placed<'a> {
    fn new(plot: &'a Plot, width: f64) -> Self {
        let ends = |k: usize| {
            let points = plot.series.iter().flat_map(|series| &series.points).map(move |point| point[k]);
            points.chain(plot.marks.iter().map(move |mark| mark.at[k]))
        };
        let across = |vertical: bool| plot.levels.iter().filter(move |l| l.vertical == vertical).map(|l| l.at);
        let whiskers = plot.series.iter().flat_map(|series| series.whiskers.iter().flatten()).copied();
        Self {
            plot,
            width,
            x: Scale::of(&plot.x, ends(0).chain(across(true))),
            y: Scale::of(&plot.y, ends(1).chain(across(false)).chain(whiskers)),
            title: Font::bold(theme::LABEL).wrap(&plot.title, width - 20.0),
            legend: legend_rows(&plot.series, width),
            note: SMALL.wrap(&plot.note, width),
        }
    }

    fn head(&self) -> f64 {
        self.title.len() as f64 * Font::bold(theme::LABEL).line() + SMALL.line() + 8.0
    }

    fn height(&self) -> f64 {
        self.head() + FRAME_HEIGHT + FOOT_ROOM + (self.legend.len() + self.note.len()) as f64 * SMALL.line() + 18.0
    }

    fn draw(&self, svg: &mut Svg, corner: [f64; 2], letter: Option<char>) {
        let mut title_at = corner;
        if let Some(letter) = letter {
            let (font, text) = (Font::bold(theme::LETTER), letter.to_string());
            write_lines(svg, &[text], [corner[0], corner[1] - 1.5], font, theme::TEXT);
            title_at[0] += 17.0;
        }
        let below = write_lines(svg, &self.title, title_at, Font::bold(theme::LABEL), theme::TEXT);
        let beside_letter = if self.title.is_empty() { title_at[0] } else { corner[0] };
        write_lines(svg, std::slice::from_ref(&self.plot.y.label), [beside_letter, below + 2.0], SMALL, theme::MUTED);
        let frame = Frame {
            corner: [corner[0] + LEFT_ROOM, corner[1] + self.head()],
            size: [self.width - LEFT_ROOM - 6.0, FRAME_HEIGHT],
        };
        self.draw_axes(svg, &frame);
        for under in [true, false] {
            let of_layer = |(_, series): &(usize, &Series)| (series.stroke == Stroke::Underlay) == under;
            for (index, series) in self.plot.series.iter().enumerate().filter(of_layer) {
                self.draw_series(svg, &frame, index, series);
            }
        }
        let mut words = Words::default();
        self.draw_levels(svg, &frame, &mut words);
        self.draw_marks(svg, &frame, &mut words);
        let mut at = [corner[0], frame.corner[1] + FRAME_HEIGHT + FOOT_ROOM + 4.0];
        at[1] = self.draw_legend(svg, at);
        write_lines(svg, &self.note, [at[0], at[1] + 3.0], SMALL, theme::MUTED);
    }

    fn draw_axes(&self, svg: &mut Svg, frame: &Frame) {
        let tick_label = |svg: &mut Svg, at: [f64; 2], anchor: Anchor, text: &str| {
            svg.label(&Label { at, anchor, font: SMALL, colour: theme::MUTED, halo: false, text });
        };
        for (share, word) in self.x.ticks() {
            let ends = [frame.at([share, 0.0]), frame.at([share, 1.0])];
            if !word.is_empty() {
                draw_line(svg, ends, &[("stroke", GRID), ("stroke-width", "0.7")]);
                tick_label(svg, [ends[0][0], ends[0][1] + 4.0 + theme::SMALL], Anchor::Middle, &word);
            }
            let length = if word.is_empty() { 2.0 } else { 4.0 };
            draw_line(svg, [ends[0], [ends[0][0], ends[0][1] - length]], &[("stroke", theme::INK)]);
        }
        for (share, word) in self.y.ticks() {
            let ends = [frame.at([0.0, share]), frame.at([1.0, share])];
            if !word.is_empty() {
                draw_line(svg, ends, &[("stroke", GRID), ("stroke-width", "0.7")]);
                tick_label(svg, [ends[0][0] - 4.0, ends[0][1] + 0.36 * theme::SMALL], Anchor::End, &word);
            }
            let length = if word.is_empty() { 2.0 } else { 4.0 };
            draw_line(svg, [ends[0], [ends[0][0] + length, ends[0][1]]], &[("stroke", theme::INK)]);
        }
        let outline = [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]].map(|share| frame.at(share));
        svg.element("path", &[("d", &path_data([&outline[..]])), ("fill", "none"), ("stroke", theme::INK)]);
        let middle = frame.at([0.5, 0.0]);
        tick_label(svg, [middle[0], middle[1] + FOOT_ROOM - 5.0], Anchor::Middle, &self.plot.x.label);
    }

    /// Where a point stands, if it can be shown.
    fn place(&self, frame: &Frame, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        Some(frame.at([self.x.share(x)?, self.y.share(y)?]))
    }

    fn draw_series(&self, svg: &mut Svg, frame: &Frame, index: usize, series: &Series) {
        let colour = colour_of(index);
        let places: Vec<Option<[f64; 2]>> = series.points.iter().map(|point| self.place(frame, *point)).collect();
        if series.stroke != Stroke::Marks {
            // A point that cannot be shown breaks the line.
            let pieces: Vec<Vec<[f64; 2]>> =
                places.split(Option::is_none).map(|piece| piece.iter().flatten().copied().collect()).collect();
            draw_polylines(svg, &pieces, &colour, series.stroke);
        }
        for (place, [low, high]) in places.iter().zip(&series.whiskers) {
            let ends = |y: f64| self.y.share(y).map(|share| frame.at([0.0, share])[1]);
            if let (Some([x, _]), Some(low), Some(high)) = (place, ends(*low), ends(*high)) {
                draw_line(svg, [[*x, low], [*x, high]], &[("stroke", &colour), ("stroke-width", "1.1")]);
            }
        }
        if matches!(series.stroke, Stroke::Marks | Stroke::LineAndMarks) {
            places.iter().flatten().for_each(|place| draw_mark(svg, index, *place));
        }
    }

    fn draw_levels(&self, svg: &mut Svg, frame: &Frame, words: &mut Words) {
        for level in &self.plot.levels {
            let scale = if level.vertical { &self.x } else { &self.y };
            let Some(share) = scale.share(level.at) else { continue };
            let ends = if level.vertical { [[share, 0.0], [share, 1.0]] } else { [[0.0, share], [1.0, share]] };
            let [from, to] = ends.map(|end| frame.at(end));
            draw_line(svg, [from, to], &[("stroke", "#8a847c"), ("stroke-width", "1"), ("stroke-dasharray", "2 2")]);
            let near_right = level.vertical && share > 0.6;
            let (at, anchor) = match (level.vertical, near_right) {
                (true, true) => ([to[0] - 3.0, to[1] + theme::SMALL], Anchor::End),
                (true, false) => ([to[0] + 3.0, to[1] + theme::SMALL], Anchor::Start),
                (false, _) => ([to[0] - 2.0, to[1] - 3.0], Anchor::End),
            };
            words.write(svg, Label { at, anchor, font: SMALL, colour: theme::MUTED, halo: true, text: &level.name });
        }
    }

    fn draw_marks(&self, svg: &mut Svg, frame: &Frame, words: &mut Words) {
        for mark in &self.plot.marks {
            let Some(at) = self.place(frame, mark.at) else { continue };
            let [x, y] = at.map(number);
            let ring = [("cx", x.as_str()), ("cy", &y), ("r", "7"), ("fill", "none"), ("stroke", theme::INK)];
            svg.element("circle", &ring);
            let right = at[0] > frame.corner[0] + 0.6 * frame.size[0];
            let (dx, anchor) = if right { (-9.0, Anchor::End) } else { (9.0, Anchor::Start) };
            let at = [at[0] + dx, at[1] - 5.0];
            let font = Font::bold(theme::SMALL);
            words.write(svg, Label { at, anchor, font, colour: theme::TEXT, halo: true, text: &mark.name });
        }
    }

    fn draw_legend(&self, svg: &mut Svg, at: [f64; 2]) -> f64 {
        let mut top = at[1];
        for row in &self.legend {
            let mut x = at[0];
            for &index in row {
                let series = &self.plot.series[index];
                let middle = top + 0.62 * theme::SMALL;
                let colour = colour_of(index);
                if series.stroke != Stroke::Marks {
                    draw_polylines(svg, &[vec![[x, middle], [x + 20.0, middle]]], &colour, series.stroke);
                }
                if matches!(series.stroke, Stroke::Marks | Stroke::LineAndMarks) {
                    draw_mark(svg, index, [x + 10.0, middle]);
                }
                write_lines(svg, std::slice::from_ref(&series.name), [x + 24.0, top], SMALL, theme::TEXT);
                x += legend_width(series);
            }
            top += SMALL.line();
        }
        top
    }
}

fn legend_width(series: &Series) -> f64 {
    24.0 + SMALL.width(&series.name) + 12.0
}

/// Which series stand in which row of the legend.
fn legend_rows(series: &[Series], width: f64) -> Vec<Vec<usize>> {
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut used = 0.0;
    for (index, series) in series.iter().enumerate().filter(|(_, series)| !series.name.is_empty()) {
        let own = legend_width(series);
        match rows.last_mut() {
            Some(row) if used + own <= width => row.push(index),
            _ => {
                rows.push(vec![index]);
                used = 0.0;
            }
        }
        used += own;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::png::to_png;

    fn plot() -> Plot {
        let points = |order: i32| (0..6).map(|i| 10f64.powi(-i)).map(|h| [h, 3.0 * h.powi(order)]).collect::<Vec<_>>();
        Plot {
            title: "Error against step".into(),
            x: Axis::logarithmic("step (h)"),
            y: Axis::logarithmic("error (um)"),
            series: vec![
                Series {
                    whiskers: points(1).iter().map(|p| [0.5 * p[1], 2.0 * p[1]]).collect(),
                    ..Series::new("euler", points(1), Stroke::LineAndMarks)
                },
                Series::new("heun", points(2), Stroke::Marks),
                Series::new("best", points(3), Stroke::Dashed),
            ],
            levels: vec![Level { name: "floor".into(), at: 1e-9, vertical: false }],
            marks: vec![Mark { name: "default".into(), at: [0.1, 0.03] }],
            note: "Slopes 1, 2 and 3.".into(),
        }
    }

    #[test]
    fn a_plot_shows_every_series_level_and_mark_by_name_and_stays_on_its_sheet() {
        let svg = draw("Title", "Subtitle", &[plot(), plot(), plot()]).unwrap();
        let text = svg.finish();
        for word in ["euler", "heun", "best", "floor", "default", "step (h)", "error (um)", "Slopes 1, 2 and 3."] {
            assert_eq!(text.matches(&format!(">{word}<")).count(), 3, "{word}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"));
        assert!(to_png(&svg.outlined(), 1.0).is_ok());
    }

    #[test]
    fn points_that_cannot_be_shown_break_a_line_and_nothing_else() {
        let mut broken = plot();
        broken.series =
            vec![Series::new("a", vec![[1.0, 1.0], [2.0, 0.0], [3.0, f64::NAN], [4.0, 4.0]], Stroke::Marks)];
        broken.levels.clear();
        broken.marks.clear();
        let text = draw("", "", &[broken]).unwrap().finish();
        // Two points and the sample in the legend.
        assert_eq!(text.matches("<circle").count(), 3);
        assert!(matches!(draw("", "", &[]), Err(FigureError::NoPanel)));
    }
}
