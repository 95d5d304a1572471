//! The legend of a figure: a colour bar an effect, the density of shafts, and what the marks mean. Entries flow from left
//! to right and wrap, so that nothing overlaps at any width.

use super::colour::{Effect, hexadecimal};
use super::cue_scale::{CueScale, LogRange};
use super::markers::draw_markers;
use super::scene_figure::{SceneFigure, TipStatus};
use super::scene_panel::{PanelPainter, ghost_style, gradient_name, target_style};
use super::svg::{Anchor, Label, Svg, number};
use super::theme::{self, Font};

const BAR_WIDTH: f64 = 168.0;
const BAR_HEIGHT: f64 = 7.0;
const BAR_INSET: f64 = 14.0;
const SYMBOL_WIDTH: f64 = 20.0;
const SPACE: f64 = 18.0;
const FONT: Font = Font::regular(theme::SMALL);

/// One entry.
enum Entry {
    Bar { gradient: &'static str, caption: String, range: LogRange, below: bool },
    Tip(TipStatus),
    Target,
    Ghost(String),
}

/// All entries of a figure, bars first.
pub(super) struct Legend {
    entries: Vec<Entry>,
}

impl Legend {
    pub(super) fn of(figure: &SceneFigure, painter: &PanelPainter) -> Self {
        let mut entries: Vec<Entry> = painter.scales.iter().map(cue_bar).collect();
        if let Some(densest) = painter.densest.filter(|&densest| densest > 1) {
            let range = LogRange { low: 1.0, high: f64::from(densest) };
            entries.push(Entry::Bar {
                gradient: "density",
                caption: "axons at a point".to_owned(),
                range,
                below: false,
            });
        }
        entries.extend(painter.statuses.iter().map(|&status| Entry::Tip(status)));
        entries.extend(painter.targets.then_some(Entry::Target));
        let first = figure.panels.first().map_or("", |panel| &panel.label);
        entries.extend(painter.ghost.map(|_| Entry::Ghost(format!("outline in a ({first})"))));
        Self { entries }
    }

    /// The place of each entry within `width` px, from the legend's corner, and the height of all.
    pub(super) fn place(&self, width: f64) -> (Vec<[f64; 2]>, f64) {
        let mut places = Vec::with_capacity(self.entries.len());
        let (mut x, mut y, mut row) = (0.0, 4.0, 0.0_f64);
        let mut last_is_bar = None;
        for entry in &self.entries {
            let [wide, tall] = entry.size();
            let other_kind = last_is_bar.is_some_and(|bar| bar != entry.is_bar());
            if x > 0.0 && (x + wide > width || other_kind) {
                (x, y, row) = (0.0, y + row, 0.0);
            }
            places.push([x, y]);
            x += wide + SPACE;
            row = row.max(tall);
            last_is_bar = Some(entry.is_bar());
        }
        (places, if self.entries.is_empty() { 0.0 } else { y + row })
    }

    pub(super) fn draw(&self, svg: &mut Svg, places: &[[f64; 2]], corner: [f64; 2]) {
        for (entry, place) in self.entries.iter().zip(places) {
            entry.draw(svg, [corner[0] + place[0], corner[1] + place[1]]);
        }
    }
}

/// The bar of one effect's concentration.
fn cue_bar(scale: &CueScale) -> Entry {
    let kind = match scale.effect {
        Effect::Attract => "attractive",
        Effect::Repel => "repulsive",
    };
    let caption = match scale.names.as_slice() {
        [name] if !name.is_empty() => format!("{kind} cue: {name}, c (nM)"),
        [_] => format!("{kind} cue, c (nM)"),
        _ => format!("{kind} cues, sum of c (nM)"),
    };
    Entry::Bar { gradient: gradient_name(scale.effect), caption, range: scale.range, below: true }
}

impl Entry {
    fn is_bar(&self) -> bool {
        matches!(self, Self::Bar { .. })
    }

    /// Width and height in px.
    fn size(&self) -> [f64; 2] {
        match self {
            Self::Bar { caption, .. } => [FONT.width(caption).max(BAR_WIDTH + 2.0 * BAR_INSET), 47.0],
            Self::Tip(status) => [SYMBOL_WIDTH - 6.0 + FONT.width(status.word()), 16.0],
            Self::Target => [SYMBOL_WIDTH + FONT.width("target"), 16.0],
            Self::Ghost(text) => [SYMBOL_WIDTH + FONT.width(text), 16.0],
        }
    }

    fn draw(&self, svg: &mut Svg, corner: [f64; 2]) {
        let middle = corner[1] + 0.65 * FONT.size;
        match self {
            Self::Bar { gradient, caption, range, below } => {
                draw_bar(svg, corner, (gradient, caption), (range, *below))
            }
            Self::Tip(status) => {
                draw_markers(svg, *status, 2.6, [[corner[0] + 5.0, middle]].into_iter());
                write(svg, [corner[0] + SYMBOL_WIDTH - 6.0, corner[1]], status.word());
            }
            Self::Target => draw_key(svg, corner, &target_style(), "target"),
            Self::Ghost(text) => draw_key(svg, corner, &ghost_style(), text),
        }
    }
}

/// A short piece of line and what it means.
fn draw_key(svg: &mut Svg, corner: [f64; 2], style: &[(&str, &str)], text: &str) {
    let middle = number(corner[1] + 0.65 * FONT.size);
    let (from, to) = (number(corner[0]), number(corner[0] + SYMBOL_WIDTH - 5.0));
    let line = [("x1", from.as_str()), ("x2", &to), ("y1", &middle), ("y2", &middle)];
    svg.element("line", &[&line[..], style].concat());
    write(svg, [corner[0] + SYMBOL_WIDTH, corner[1]], text);
}

fn write(svg: &mut Svg, corner: [f64; 2], text: &str) {
    let at = [corner[0], corner[1] + FONT.size];
    svg.label(&Label { at, anchor: Anchor::Start, font: FONT, colour: theme::TEXT, halo: false, text });
}

/// Caption, bar and ticks.
fn draw_bar(svg: &mut Svg, corner: [f64; 2], (gradient, caption): (&str, &str), (range, below): (&LogRange, bool)) {
    write(svg, corner, caption);
    let [left, top] = [corner[0] + BAR_INSET, corner[1] + 15.0];
    let [x, y, width, height] = [left, top, BAR_WIDTH, BAR_HEIGHT].map(number);
    let (fill, rim) = (format!("url(#{gradient})"), hexadecimal(theme::OUTLINE));
    let place = [("x", x.as_str()), ("y", &y), ("width", &width), ("height", &height)];
    svg.element("rect", &[&place[..], &[("fill", &fill), ("stroke", &rim), ("stroke-width", "0.5")]].concat());
    for (value, major) in ticks(range) {
        let x = left + BAR_WIDTH * range.share(value);
        let length = if major { 3.5 } else { 1.8 };
        let [x_text, from, to] = [x, top + BAR_HEIGHT, top + BAR_HEIGHT + length].map(number);
        let line = [("x1", x_text.as_str()), ("x2", &x_text), ("y1", &from), ("y2", &to)];
        svg.element("line", &[&line[..], &[("stroke", &rim), ("stroke-width", "0.6")]].concat());
        if major {
            let at_low_end = below && value <= range.low * (1.0 + 1e-9);
            let text = if at_low_end { format!("≤{}", power_of_ten(value)) } else { power_of_ten(value) };
            let (at, colour) = ([x, top + BAR_HEIGHT + 4.5 + FONT.size], theme::MUTED);
            svg.label(&Label { at, anchor: Anchor::Middle, font: FONT, colour, halo: false, text: &text });
        }
    }
}

/// The ticks of a bar that begins at a decade: (value, whether it is a decade).
fn ticks(range: &LogRange) -> Vec<(f64, bool)> {
    let first = range.low.log10().round() as i32;
    let last = range.high.log10().floor() as i32;
    let all = (first..=last).flat_map(|decade| (1..=9).map(move |i| (f64::from(i) * 10.0_f64.powi(decade), i == 1)));
    all.filter(|(value, _)| *value <= range.high * (1.0 + 1e-9)).collect()
}

/// A power of ten in digits where that is short, else with a superscript.
fn power_of_ten(value: f64) -> String {
    let exponent = value.log10().round() as i32;
    match exponent {
        0..=3 => format!("{:.0}", value),
        -3..=-1 => format!("{value:.*}", exponent.unsigned_abs() as usize),
        _ => format!("10{}", exponent.to_string().chars().map(superscript).collect::<String>()),
    }
}

fn superscript(digit: char) -> char {
    match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32(0x2070 + (digit as u32 - '0' as u32)).unwrap_or(digit),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_stand_at_the_decades_and_between() {
        let ticks = ticks(&LogRange { low: 0.1, high: 20.0 });
        let decades: Vec<String> = ticks.iter().filter(|tick| tick.1).map(|tick| power_of_ten(tick.0)).collect();
        assert_eq!(decades, ["0.1", "1", "10"]);
        assert_eq!(ticks.len(), 9 + 9 + 2);
    }

    #[test]
    fn far_decades_are_written_with_superscripts() {
        assert_eq!(power_of_ten(1e-12), "10⁻¹²");
        assert_eq!(power_of_ten(1e4), "10⁴");
        assert_eq!(power_of_ten(1e-3), "0.001");
    }
}
