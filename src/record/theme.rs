//! The look of figures: sizes, colours and the width of text, in one place.
//!
//! Sizes are CSS pixels of 1/96 inch; three panels make a figure 680 px = 180 mm wide (the full width of most journals)
//! in which no text is smaller than 7 pt = 9.33 px.

/// Width of a figure of three columns and more: 180 mm.
pub const FULL_WIDTH: f64 = 680.0;
/// White space around a figure.
pub const MARGIN: f64 = 14.0;
/// White space between panels.
pub const GAP: f64 = 16.0;
/// Height of a panel at most.
pub const PANEL_HEIGHT: f64 = 430.0;
/// Size of titles.
pub const TITLE: f64 = 13.5;
/// Size of panel letters.
pub const LETTER: f64 = 13.0;
/// Size of panel labels.
pub const LABEL: f64 = 10.5;
/// Size of all other text: 7.2 pt.
pub const SMALL: f64 = 9.6;
/// Distance of lines of text over their size.
pub const LEADING: f64 = 1.3;

/// Colour of text.
pub const TEXT: [u8; 3] = [0x1a, 0x1a, 0x1a];
/// The same colour, as lines that explain the drawing use it.
pub const INK: &str = "#1a1a1a";
/// Colour of secondary text.
pub const MUTED: [u8; 3] = [0x5a, 0x5a, 0x5a];
/// Colour of tissue without cues.
pub const TISSUE: [u8; 3] = [0xf7, 0xf5, 0xf1];
/// Colour of the tissue's outline.
pub const OUTLINE: [u8; 3] = [0x6b, 0x66, 0x60];
/// Colour of the first panel's outline where it is repeated for comparison.
pub const GHOST: &str = "#9a958e";
/// Colour of shafts.
pub const SHAFT: [u8; 3] = [0x1b, 0x13, 0x26];
/// Colour of growing tips (Okabe & Ito's vermillion).
pub const GROWING: [u8; 3] = [0xd5, 0x5e, 0x00];
/// Colour of arrived tips (Okabe & Ito's bluish green).
pub const ARRIVED: [u8; 3] = [0x00, 0x9e, 0x73];
/// Colour of stalled tips.
pub const STALLED: [u8; 3] = [0x2b, 0x2b, 0x2b];
/// Colour of tips that left the tissue.
pub const LEFT: [u8; 3] = [0xf0, 0xd0, 0x30];
/// Colour of retracting tips (Okabe & Ito's blue).
pub const RETRACTING: [u8; 3] = [0x00, 0x72, 0xb2];

/// The font families, best first; the first is embedded.
pub const FONT_FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";
/// Regular face for the PNG renderer.
pub const FONT_REGULAR: &[u8] = include_bytes!("../../assets/fonts/DejaVuSans-subset.ttf");
/// Bold face for the PNG renderer.
pub const FONT_BOLD: &[u8] = include_bytes!("../../assets/fonts/DejaVuSans-Bold-subset.ttf");
/// Regular face for SVG files.
pub const WEB_FONT_REGULAR: &[u8] = include_bytes!("../../assets/fonts/DejaVuSans-subset.woff2");
/// Bold face for SVG files.
pub const WEB_FONT_BOLD: &[u8] = include_bytes!("../../assets/fonts/DejaVuSans-Bold-subset.woff2");

/// Font units an em.
const EM: f64 = 2048.0;
/// Advance widths of the regular face from the space (U+0020) to the tilde (U+007E), in font units.
const REGULAR: [u16; 95] = [
    651, 821, 942, 1716, 1303, 1946, 1597, 563, 799, 799, 1024, 1716, 651, 739, 651, 690, 1303, 1303, 1303, 1303, 1303,
    1303, 1303, 1303, 1303, 1303, 690, 690, 1716, 1716, 1716, 1087, 2048, 1401, 1405, 1430, 1577, 1294, 1178, 1587,
    1540, 604, 604, 1343, 1141, 1767, 1532, 1612, 1235, 1612, 1423, 1300, 1251, 1499, 1401, 2025, 1403, 1251, 1403,
    799, 690, 799, 1716, 1024, 1024, 1255, 1300, 1126, 1300, 1260, 721, 1300, 1298, 569, 569, 1186, 569, 1995, 1298,
    1253, 1300, 1300, 842, 1067, 803, 1298, 1212, 1675, 1212, 1212, 1075, 1303, 690, 1303, 1716,
];
/// Advance widths of the bold face, likewise.
const BOLD: [u16; 95] = [
    713, 934, 1067, 1716, 1425, 2052, 1786, 627, 936, 936, 1071, 1716, 778, 850, 778, 748, 1425, 1425, 1425, 1425,
    1425, 1425, 1425, 1425, 1425, 1425, 819, 819, 1716, 1716, 1716, 1188, 2048, 1585, 1561, 1503, 1700, 1399, 1399,
    1681, 1714, 762, 762, 1587, 1305, 2038, 1714, 1741, 1501, 1741, 1577, 1475, 1397, 1663, 1585, 2259, 1579, 1483,
    1485, 936, 748, 936, 1716, 1024, 1024, 1382, 1466, 1214, 1466, 1389, 891, 1466, 1458, 702, 702, 1362, 702, 2134,
    1458, 1407, 1466, 1466, 1010, 1219, 979, 1458, 1335, 1892, 1321, 1335, 1192, 1458, 748, 1458, 1716,
];
/// Advance width assumed for every other sign: wider than nearly all of the embedded ones, so that text never overlaps.
const OTHER: u16 = 1750;

/// A size and weight of text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Font {
    /// Size of an em in px.
    pub size: f64,
    /// Whether bold.
    pub bold: bool,
}

impl Font {
    /// The regular face at a size in px.
    pub const fn regular(size: f64) -> Self {
        Self { size, bold: false }
    }

    /// The bold face at a size in px.
    pub const fn bold(size: f64) -> Self {
        Self { size, bold: true }
    }

    /// The distance between lines in px.
    pub fn line(&self) -> f64 {
        LEADING * self.size
    }

    /// The width of a line of text in px: exact for ASCII, an upper bound for other signs of the embedded fonts.
    pub fn width(&self, text: &str) -> f64 {
        let advances = if self.bold { &BOLD } else { &REGULAR };
        let advance = |sign: char| {
            let sign = if sign == '\u{a0}' { ' ' } else { sign };
            let index = (sign as usize).checked_sub(0x20);
            f64::from(index.and_then(|index| advances.get(index)).copied().unwrap_or(OTHER))
        };
        text.chars().map(advance).sum::<f64>() * self.size / EM
    }

    /// Breaks text at spaces (but not at no-break spaces) into lines no wider than `width` px; a word wider than that is broken inside.
    pub fn wrap(&self, text: &str, width: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split([' ', '\n', '\t']).filter(|word| !word.is_empty()) {
            let joined = lines.last().map(|line| format!("{line} {word}"));
            match (joined, lines.last_mut()) {
                (Some(joined), Some(line)) if self.width(&joined) <= width => *line = joined,
                _ => lines.extend(self.break_word(word, width)),
            }
        }
        lines
    }

    /// Breaks one word into pieces no wider than `width` px, of one sign at least.
    fn break_word(&self, word: &str, width: f64) -> Vec<String> {
        let mut pieces = vec![String::new()];
        for sign in word.chars() {
            let full =
                pieces.last().is_some_and(|piece| !piece.is_empty() && self.width(&format!("{piece}{sign}")) > width);
            if full {
                pieces.push(String::new());
            }
            if let Some(piece) = pieces.last_mut() {
                piece.push(sign);
            }
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_text_is_seven_points() {
        const { assert!(SMALL * 72.0 / 96.0 >= 7.0) };
        assert!((FULL_WIDTH / 96.0 * 25.4 - 180.0).abs() < 0.5);
    }

    #[test]
    fn wrapped_lines_fit_and_keep_every_word() {
        let font = Font::regular(SMALL);
        let text = "without homophilic attraction but with a supercalifragilisticexpialidocious cue";
        let lines = font.wrap(text, 90.0);
        assert!(lines.iter().all(|line| font.width(line) <= 90.0), "{lines:?}");
        assert_eq!(lines.concat().replace(' ', ""), text.replace(' ', ""));
        assert!(font.wrap("  ", 90.0).is_empty());
        assert_eq!(font.wrap("abc", 0.0), ["a", "b", "c"]);
    }
}
