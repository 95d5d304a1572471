//! Text as outlines of the embedded fonts, for pictures: no font of the system is read, and no text shaper is needed (signs
//! stand side by side at their advance widths, as `theme` measures them).

use super::svg::{Anchor, number};
use super::theme::{FONT_BOLD, FONT_REGULAR, Font};
use std::sync::LazyLock;
use ttf_parser::{Face, OutlineBuilder};

/// Regular and bold; absent only if the embedded data were broken.
static FACES: LazyLock<[Option<Face<'static>>; 2]> =
    LazyLock::new(|| [FONT_REGULAR, FONT_BOLD].map(|data| Face::parse(data, 0).ok()));

/// Path data (px) of a line of text whose baseline hangs on a point; signs that the fonts lack are shown as `?`.
pub fn outline(text: &str, font: &Font, at: [f64; 2], anchor: Anchor) -> String {
    let Some(face) = &FACES[usize::from(font.bold)] else { return String::new() };
    let scale = font.size / f64::from(face.units_per_em());
    let glyph = |sign| face.glyph_index(sign).or_else(|| face.glyph_index('?')).unwrap_or_default();
    let glyphs: Vec<_> = text.chars().map(|sign| if sign == '\u{a0}' { ' ' } else { sign }).map(glyph).collect();
    let advance = |id| scale * f64::from(face.glyph_hor_advance(id).unwrap_or(0));
    let width: f64 = glyphs.iter().map(|id| advance(*id)).sum();
    let start = match anchor {
        Anchor::Start => at[0],
        Anchor::Middle => at[0] - 0.5 * width,
        Anchor::End => at[0] - width,
    };
    let mut pen = Pen { data: String::new(), x: start, y: at[1], scale };
    for id in glyphs {
        face.outline_glyph(id, &mut pen);
        pen.x += advance(id);
    }
    pen.data
}

/// Writes glyphs, given in font units with y upward, as path data in px with y downward.
struct Pen {
    data: String,
    x: f64,
    y: f64,
    scale: f64,
}

impl Pen {
    fn write(&mut self, command: char, points: &[[f32; 2]]) {
        self.data.push(command);
        for [x, y] in points {
            for value in [self.x + self.scale * f64::from(*x), self.y - self.scale * f64::from(*y)] {
                self.data.push(' ');
                self.data.push_str(&number(value));
            }
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.write('M', &[[x, y]]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.write('L', &[[x, y]]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.write('Q', &[[x1, y1], [x, y]]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.write('C', &[[x1, y1], [x2, y2], [x, y]]);
    }

    fn close(&mut self) {
        self.data.push('Z');
    }
}
