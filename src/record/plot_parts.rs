//! What plots are drawn with: the frame of the axes, words that keep apart, lines and marks.

use super::colour::hexadecimal;
use super::plot::Stroke;
use super::svg::{Anchor, Label, Svg, number, path_data};

/// Size of marks.
const MARK: f64 = 3.2;
const UNDERLAY: &str = "#f3d9a4";
/// Okabe & Ito's colours, black first.
const COLOURS: [[u8; 3]; 8] = [
    [0x1a, 0x1a, 0x1a],
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x7a, 0x5c, 0x3a],
];

/// Colour of a series, by its place.
pub(super) fn colour_of(index: usize) -> String {
    hexadecimal(COLOURS[index % COLOURS.len()])
}

/// The words inside a frame, kept apart from each other: the boxes (left, top, right, bottom) that are taken.
#[derive(Default)]
pub(super) struct Words(Vec<[f64; 4]>);

impl Words {
    /// Writes a word where it is wanted or, if another stands there, as many lines below as it takes.
    pub(super) fn write(&mut self, svg: &mut Svg, mut label: Label) {
        let width = label.font.width(label.text);
        let left = match label.anchor {
            Anchor::Start => label.at[0],
            Anchor::Middle => label.at[0] - 0.5 * width,
            Anchor::End => label.at[0] - width,
        };
        let area = |bottom: f64| [left, bottom - label.font.size, left + width, bottom];
        let apart = |a: &[f64; 4], b: &[f64; 4]| a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
        while self.0.iter().any(|taken| !apart(taken, &area(label.at[1]))) {
            label.at[1] += label.font.line();
        }
        self.0.push(area(label.at[1]));
        svg.label(&label);
    }
}

/// The rectangle of the axes, in px.
pub(super) struct Frame {
    pub(super) corner: [f64; 2],
    pub(super) size: [f64; 2],
}

impl Frame {
    /// A place by its shares of the axes, y upward.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.corner[0] + x * self.size[0], self.corner[1] + (1.0 - y) * self.size[1]]
    }
}

pub(super) fn draw_line(svg: &mut Svg, [from, to]: [[f64; 2]; 2], style: &[(&str, &str)]) {
    let data = path_data([&[from, to][..]]);
    svg.element("path", &[&[("d", data.as_str()), ("fill", "none")], style].concat());
}

pub(super) fn draw_polylines(svg: &mut Svg, pieces: &[Vec<[f64; 2]>], colour: &str, stroke: Stroke) {
    let data = path_data(pieces.iter().map(Vec::as_slice));
    if data.is_empty() {
        return;
    }
    let (colour, width) = match stroke {
        Stroke::Underlay => (UNDERLAY, "7"),
        Stroke::Hair => (colour, "0.25"),
        _ => (colour, "1.5"),
    };
    let mut style = vec![("d", data.as_str()), ("fill", "none"), ("stroke", colour), ("stroke-width", width)];
    if stroke == Stroke::Dashed {
        style.push(("stroke-dasharray", "5 3"));
    }
    svg.element("path", &style);
}

/// One mark: disc, square, diamond or triangle, filled for the first four series and hollow for the next.
pub(super) fn draw_mark(svg: &mut Svg, index: usize, [x, y]: [f64; 2]) {
    let colour = colour_of(index);
    let fill = if (index / 4).is_multiple_of(2) { colour.as_str() } else { "#ffffff" };
    let style = [("fill", fill), ("stroke", colour.as_str()), ("stroke-width", "1.2")];
    if index.is_multiple_of(4) {
        let [x, y, r] = [x, y, MARK].map(number);
        return svg.element("circle", &[&[("cx", x.as_str()), ("cy", &y), ("r", &r)], &style[..]].concat());
    }
    let corners: &[[f64; 2]] = match index % 4 {
        1 => &[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
        2 => &[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]],
        _ => &[[0.0, -1.3], [1.2, 0.8], [-1.2, 0.8]],
    };
    let points: Vec<[f64; 2]> = corners.iter().map(|c| [x + MARK * c[0], y + MARK * c[1]]).collect();
    let data = format!("{}z", path_data([points.as_slice()]));
    svg.element("path", &[&[("d", data.as_str())], &style[..]].concat());
}
