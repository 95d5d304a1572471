//! Where the panels of a figure stand: columns of one width, rows of one height, one scale and one frame of axes for all.

use super::scene_figure::{FigureError, Panel, SceneFigure, TipStatus};
use super::scene_panel::View;
use super::svg::{Anchor, Label, Svg};
use super::theme::{self, Font};

/// Room for a panel's letter.
const LETTER_WIDTH: f64 = 17.0;
/// Width of a column at least.
const LEAST_WIDTH: f64 = 60.0;
/// Room for the scale bar under a panel.
const SCALE_BAR_ROOM: f64 = 18.0;

/// Where everything stands.
pub(super) struct Layout {
    pub(super) width: f64,
    /// Height of all but the legend and the lower margin.
    pub(super) height: f64,
    columns: usize,
    /// Width of a column.
    cell_width: f64,
    /// px a µm.
    scale: f64,
    low: [f64; 2],
    high: [f64; 2],
    title: Vec<String>,
    subtitle: Vec<String>,
    heads: Vec<Vec<String>>,
    feet: Vec<Vec<String>>,
    row_height: f64,
    head_height: f64,
    /// Whether panels have letters.
    letters: bool,
}

/// A panel's place.
pub(super) struct CellPlace {
    corner: [f64; 2],
    pub(super) view: View,
}

impl Layout {
    /// Finds the places of a figure's panels.
    pub(super) fn of(figure: &SceneFigure) -> Result<Self, FigureError> {
        let count = figure.panels.len();
        let (low, high) = extent(&figure.panels)?;
        let columns = figure.columns.unwrap_or(default_columns(count)).clamp(1, count.max(1));
        let widest = [0.0, 360.0, 310.0].get(columns).copied().filter(|_| figure.width.is_none());
        let shared =
            (figure.width.unwrap_or(theme::FULL_WIDTH) - 2.0 * theme::MARGIN - (columns - 1) as f64 * theme::GAP)
                / columns as f64;
        let cell_width = widest.unwrap_or(shared);
        if cell_width < LEAST_WIDTH {
            return Err(FigureError::TooNarrow { columns, least: total_width(columns, LEAST_WIDTH) });
        }
        let scale = (cell_width / (high[0] - low[0])).min(theme::PANEL_HEIGHT / (high[1] - low[1]));
        let width = total_width(columns, cell_width);
        let inner = width - 2.0 * theme::MARGIN;
        let head = |panel: &Panel| Font::regular(theme::LABEL).wrap(&panel.label, cell_width - LETTER_WIDTH);
        let foot = |panel: &Panel| {
            let font = Font::regular(theme::SMALL);
            [font.wrap(&panel.note, cell_width), font.wrap(&count_tips(panel), cell_width)].concat()
        };
        let mut layout = Self {
            width,
            height: 0.0,
            columns,
            cell_width,
            scale,
            low,
            high,
            title: Font::bold(theme::TITLE).wrap(&figure.title, inner),
            subtitle: Font::regular(theme::SMALL).wrap(&figure.subtitle, inner),
            heads: figure.panels.iter().map(head).collect(),
            feet: figure.panels.iter().map(foot).collect(),
            row_height: 0.0,
            head_height: 0.0,
            letters: count > 1,
        };
        layout.stack(count);
        Ok(layout)
    }

    /// The place of the panels of a moving picture: all in one, with room for the largest of their heads and feet.
    pub(super) fn of_frames(figure: &SceneFigure) -> Result<Self, FigureError> {
        let mut layout = Self { letters: false, ..Self::of(figure)? };
        layout.stack(1);
        Ok(layout)
    }

    /// Finds the heights of rows and of the whole.
    fn stack(&mut self, count: usize) {
        let most = |lines: &[Vec<String>]| lines.iter().map(Vec::len).max().unwrap_or(0) as f64;
        self.head_height = most(&self.heads).max(1.0) * Font::regular(theme::LABEL).line() + 6.0;
        let foot_height = most(&self.feet) * Font::regular(theme::SMALL).line() + 8.0;
        let drawing = self.scale * (self.high[1] - self.low[1]) + SCALE_BAR_ROOM;
        self.row_height = self.head_height + drawing + foot_height;
        self.height = self.top() + count.div_ceil(self.columns) as f64 * self.row_height;
    }

    /// Where the first row begins.
    fn top(&self) -> f64 {
        let title = self.title.len() as f64 * Font::bold(theme::TITLE).line();
        let subtitle = self.subtitle.len() as f64 * Font::regular(theme::SMALL).line();
        let space = if title + subtitle > 0.0 { 8.0 } else { 0.0 };
        theme::MARGIN + title + subtitle + space
    }

    /// Where a panel stands.
    pub(super) fn cell(&self, index: usize) -> CellPlace {
        let (row, column) = (index / self.columns, index % self.columns);
        let corner =
            [theme::MARGIN + column as f64 * (self.cell_width + theme::GAP), self.top() + row as f64 * self.row_height];
        let slack = 0.5 * (self.cell_width - self.scale * (self.high[0] - self.low[0]));
        let view = View {
            corner: [corner[0] + slack, corner[1] + self.head_height],
            scale: self.scale,
            left: self.low[0],
            top: self.high[1],
        };
        CellPlace { corner, view }
    }

    /// Area of the drawing of one panel, px².
    pub(super) fn drawing_area(&self) -> f64 {
        self.drawing_height() * self.scale * (self.high[0] - self.low[0])
    }

    /// Height of the drawing of one panel, px.
    fn drawing_height(&self) -> f64 {
        self.scale * (self.high[1] - self.low[1])
    }

    /// Title and subtitle.
    pub(super) fn draw_heading(&self, svg: &mut Svg) {
        let mut baseline = theme::MARGIN;
        let fonts = [(Font::bold(theme::TITLE), theme::TEXT), (Font::regular(theme::SMALL), theme::MUTED)];
        for ((font, colour), lines) in fonts.into_iter().zip([&self.title, &self.subtitle]) {
            for text in lines {
                let at = [theme::MARGIN, baseline + font.size];
                svg.label(&Label { at, anchor: Anchor::Start, font, colour, halo: false, text });
                baseline += font.line();
            }
        }
    }

    /// Letter and label above a panel.
    pub(super) fn draw_head(&self, svg: &mut Svg, cell: &CellPlace, index: usize) {
        let [x, y] = cell.corner;
        let letter = letter_of(index);
        let indent = if self.letters { LETTER_WIDTH } else { 0.0 };
        let font = Font::bold(theme::LETTER);
        if self.letters {
            let at = [x, y + theme::LABEL];
            svg.label(&Label { at, anchor: Anchor::Start, font, colour: theme::TEXT, halo: false, text: &letter });
        }
        let font = Font::regular(theme::LABEL);
        for (line, text) in self.heads[index].iter().enumerate() {
            let at = [x + indent, y + theme::LABEL + line as f64 * font.line()];
            svg.label(&Label { at, anchor: Anchor::Start, font, colour: theme::TEXT, halo: false, text });
        }
    }

    /// Remark, counts and (under the first panel of a row) the scale bar.
    pub(super) fn draw_foot(&self, svg: &mut Svg, cell: &CellPlace, index: usize) {
        let bottom = cell.view.corner[1] + self.drawing_height();
        if index.is_multiple_of(self.columns) {
            self.draw_scale_bar(svg, [cell.view.corner[0], bottom + 8.0]);
        }
        let font = Font::regular(theme::SMALL);
        for (line, text) in self.feet[index].iter().enumerate() {
            let at = [cell.corner[0], bottom + SCALE_BAR_ROOM + font.size + line as f64 * font.line()];
            svg.label(&Label { at, anchor: Anchor::Start, font, colour: theme::MUTED, halo: false, text });
        }
    }

    fn draw_scale_bar(&self, svg: &mut Svg, at: [f64; 2]) {
        let length = round_length(0.3 * self.cell_width / self.scale);
        let [x, y] = at.map(super::svg::number);
        let width = super::svg::number(length * self.scale);
        svg.element("rect", &[("x", &x), ("y", &y), ("width", &width), ("height", "2.2"), ("fill", theme::INK)]);
        let text = format!("{} µm", super::csv::format_number(length));
        let end = [at[0] + length * self.scale + 5.0, at[1] + 4.6];
        let font = Font::regular(theme::SMALL);
        svg.label(&Label { at: end, anchor: Anchor::Start, font, colour: theme::TEXT, halo: false, text: &text });
    }
}

/// Width of a figure, from that of a column.
fn total_width(columns: usize, cell_width: f64) -> f64 {
    2.0 * theme::MARGIN + columns as f64 * cell_width + (columns - 1) as f64 * theme::GAP
}

/// Panels a row if nobody chose.
fn default_columns(panels: usize) -> usize {
    match panels {
        0..=3 => panels,
        4 => 2,
        _ => 3,
    }
}

/// The box around all positions of all panels, µm.
fn extent(panels: &[Panel]) -> Result<([f64; 2], [f64; 2]), FigureError> {
    if panels.is_empty() {
        return Err(FigureError::NoPanel);
    }
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for point in panels.iter().flat_map(all_points) {
        for axis in 0..2 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    let extended = (0..2).all(|axis| (high[axis] - low[axis]).is_finite() && high[axis] > low[axis]);
    if extended { Ok((low, high)) } else { Err(FigureError::NoExtent { low, high }) }
}

fn all_points(panel: &Panel) -> impl Iterator<Item = [f64; 2]> {
    let borders = panel.borders.iter().flat_map(|border| &border.points);
    let shafts = panel.shafts.iter().flatten();
    let targets = panel.targets.iter().flatten();
    let tips = panel.tips.iter().map(|tip| tip.position);
    panel.vertices.iter().chain(borders).chain(shafts).chain(targets).copied().chain(tips)
}

/// The counts of tips by status: "312 growing, 140 arrived", unbreakable between number and word.
fn count_tips(panel: &Panel) -> String {
    let counts = TipStatus::ALL.iter().filter_map(|&status| {
        let count = panel.tips.iter().filter(|tip| tip.status == status).count();
        (count > 0).then(|| format!("{count}\u{a0}{}", status.word()))
    });
    counts.collect::<Vec<_>>().join(", ")
}

/// The largest of 1, 2, 5 times a power of ten that is not above `length`.
fn round_length(length: f64) -> f64 {
    let decade = 10.0_f64.powi(length.log10().floor() as i32);
    let step = [5.0, 2.0].into_iter().find(|step| step * decade <= length);
    step.unwrap_or(1.0) * decade
}

/// a … z, then aa, ab, …
fn letter_of(index: usize) -> String {
    let sign = |value: usize| char::from(b'a' + (value % 26) as u8);
    if index < 26 { sign(index).to_string() } else { format!("{}{}", letter_of(index / 26 - 1), sign(index)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_round_and_letters_go_on_after_z() {
        assert_eq!([7.0, 240.0, 0.034, 100.0].map(round_length), [5.0, 200.0, 0.02, 100.0]);
        assert_eq!([0, 25, 26, 27, 52].map(letter_of), ["a", "z", "aa", "ab", "ba"]);
    }
}
