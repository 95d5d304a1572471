//! A small SVG writer: elements, escaped text, compact paths.

use super::lettering::outline;
use super::theme::{self, Font};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::fmt::Write;

/// An SVG document under construction, in CSS pixels, y downward.
#[derive(Debug, Clone, PartialEq)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
    /// Text is kept apart, each line with its place in the body: files carry it as text, pictures as outlines.
    lines: Vec<(usize, Line)>,
}

/// A line of text to be written.
#[derive(Debug, Clone, PartialEq)]
struct Line {
    at: [f64; 2],
    anchor: Anchor,
    font: Font,
    colour: [u8; 3],
    halo: bool,
    text: String,
}

/// Where a line of text hangs on its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins at the point.
    Start,
    /// The text is centred on the point.
    Middle,
    /// The text ends at the point.
    End,
}

/// A line of text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label<'a> {
    /// The baseline's point in px.
    pub at: [f64; 2],
    /// Where the text hangs on the point.
    pub anchor: Anchor,
    /// Size and weight.
    pub font: Font,
    /// Colour, sRGB.
    pub colour: [u8; 3],
    /// A white rim that keeps the text readable on a drawing.
    pub halo: bool,
    /// The text.
    pub text: &'a str,
}

impl Svg {
    /// An empty document of a size in px.
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new(), lines: Vec::new() }
    }

    /// Width and height in px.
    pub fn size(&self) -> [f64; 2] {
        [self.width, self.height]
    }

    /// A drawing to be appended to this one.
    pub fn part(&self) -> Self {
        Self::new(self.width, self.height)
    }

    /// Appends what was drawn on a part.
    pub fn append(&mut self, part: Self) {
        let before = self.body.len();
        self.body.push_str(&part.body);
        self.lines.extend(part.lines.into_iter().map(|(place, line)| (before + place, line)));
    }

    /// Appends an empty element with attributes; values are escaped.
    pub fn element(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.start(name, attributes);
        self.body.push_str("/>\n");
    }

    /// Opens a group with attributes, to be closed by [`Self::close_group`].
    pub fn open_group(&mut self, attributes: &[(&str, &str)]) {
        self.start("g", attributes);
        self.body.push_str(">\n");
    }

    /// Closes the innermost group.
    pub fn close_group(&mut self) {
        self.body.push_str("</g>\n");
    }

    /// Appends a path with a tooltip.
    pub fn titled_path(&mut self, title: &str, data: &str) {
        self.start("path", &[("d", data)]);
        self.body.push_str("><title>");
        escape(&mut self.body, title);
        self.body.push_str("</title></path>\n");
    }

    /// Appends a horizontal gradient named `id`, of (share 0…1, colour, opacity) stops.
    pub fn gradient(&mut self, id: &str, stops: &[(f64, [u8; 3], f64)]) {
        self.start("linearGradient", &[("id", id)]);
        self.body.push_str(">\n");
        for (offset, colour, opacity) in stops {
            let (offset, colour) = (number(*offset), super::colour::hexadecimal(*colour));
            let opacity = number(*opacity);
            self.element("stop", &[("offset", &offset), ("stop-color", &colour), ("stop-opacity", &opacity)]);
        }
        self.body.push_str("</linearGradient>\n");
    }

    /// Appends a PNG image that fills the rectangle at `corner` (upper left) of `size`, in px.
    pub fn image(&mut self, corner: [f64; 2], size: [f64; 2], png: &[u8]) {
        let href = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png));
        let [x, y] = corner.map(number);
        let [width, height] = size.map(number);
        self.element(
            "image",
            &[
                ("x", &x),
                ("y", &y),
                ("width", &width),
                ("height", &height),
                ("preserveAspectRatio", "none"),
                ("xlink:href", &href),
            ],
        );
    }

    /// Appends a line of text.
    pub fn label(&mut self, label: &Label) {
        let Label { at, anchor, font, colour, halo, text } = *label;
        let line = Line { at, anchor, font, colour, halo, text: text.to_owned() };
        self.lines.push((self.body.len(), line));
    }

    /// The whole document, with the fonts inside so that it looks the same on every machine.
    pub fn finish(&self) -> String {
        let face = |weight: &str, data: &[u8]| {
            format!(
                "@font-face{{font-family:'DejaVu Sans';font-weight:{weight};src:url(data:font/woff2;base64,{}) format('woff2')}}\n",
                BASE64_STANDARD.encode(data)
            )
        };
        let faces = [face("normal", theme::WEB_FONT_REGULAR), face("bold", theme::WEB_FONT_BOLD)].concat();
        self.document(&format!("<style>\n{faces}</style>\n"), write_text)
    }

    /// The whole document with its text as outlines, for a renderer that knows no fonts.
    pub fn outlined(&self) -> String {
        self.document("", write_outline)
    }

    fn document(&self, head: &str, write: fn(&mut String, &Line)) -> String {
        let (width, height) = (number(self.width), number(self.height));
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{width}\" \
             height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"{}\" \
             style=\"background:#ffffff\">\n{head}",
            theme::FONT_FAMILY,
        );
        let mut written = 0;
        for (place, line) in &self.lines {
            text.push_str(&self.body[written..*place]);
            write(&mut text, line);
            written = *place;
        }
        text.push_str(&self.body[written..]);
        text.push_str("</svg>\n");
        text
    }

    fn start(&mut self, name: &str, attributes: &[(&str, &str)]) {
        start(&mut self.body, name, attributes);
    }
}

const HALO: [(&str, &str); 5] = [
    ("stroke", "#ffffff"),
    ("stroke-width", "2.5"),
    ("stroke-opacity", "0.85"),
    ("stroke-linejoin", "round"),
    ("paint-order", "stroke"),
];

fn write_text(target: &mut String, line: &Line) {
    let Line { at, anchor, font, colour, halo, text } = line;
    let ([x, y], size, fill) = (at.map(number), number(font.size), super::colour::hexadecimal(*colour));
    let anchor = match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let mut attributes = vec![("x", x.as_str()), ("y", &y), ("font-size", &size), ("fill", &fill)];
    attributes.push(("text-anchor", anchor));
    if font.bold {
        attributes.push(("font-weight", "bold"));
    }
    if *halo {
        attributes.extend(HALO);
    }
    start(target, "text", &attributes);
    target.push('>');
    escape(target, text);
    target.push_str("</text>\n");
}

fn write_outline(target: &mut String, line: &Line) {
    let Line { at, anchor, font, colour, halo, text } = line;
    let (data, fill) = (outline(text, font, *at, *anchor), super::colour::hexadecimal(*colour));
    let mut attributes = vec![("id", "text"), ("d", data.as_str()), ("fill", &fill)];
    if *halo {
        attributes.extend(HALO);
    }
    start(target, "path", &attributes);
    target.push_str("/>\n");
}

/// Writes the beginning of an element, without its closing bracket.
fn start(target: &mut String, name: &str, attributes: &[(&str, &str)]) {
    target.push('<');
    target.push_str(name);
    for (key, value) in attributes {
        target.push(' ');
        target.push_str(key);
        target.push_str("=\"");
        escape(target, value);
        target.push('"');
    }
}

/// The text of a number with at most two decimals; one that is not finite is written as 0.
pub fn number(value: f64) -> String {
    let mut text = String::new();
    append_hundredths(&mut text, hundredths(value));
    text
}

/// The path data of polylines (px): one subpath each, relative steps on a grid of 1/100 px, so rounding never
/// accumulates. Subpaths of fewer than two points are left out.
pub fn path_data<'a>(polylines: impl IntoIterator<Item = &'a [[f64; 2]]>) -> String {
    let mut data = String::new();
    for polyline in polylines.into_iter().filter(|polyline| polyline.len() > 1) {
        append_polyline(&mut data, polyline);
    }
    data
}

fn append_polyline(data: &mut String, polyline: &[[f64; 2]]) {
    let mut last = [0, 0];
    for (index, point) in polyline.iter().enumerate() {
        let here = point.map(hundredths);
        if index == 1 {
            data.push('l');
        }
        let step = if index == 0 { here } else { [here[0] - last[0], here[1] - last[1]] };
        data.push_str(if index == 0 {
            "M"
        } else if index > 1 && step[0] >= 0 {
            " "
        } else {
            ""
        });
        append_hundredths(data, step[0]);
        if step[1] >= 0 {
            data.push(' ');
        }
        append_hundredths(data, step[1]);
        last = here;
    }
}

fn hundredths(value: f64) -> i64 {
    // The clamp keeps differences from overflowing; nothing is drawn that far out.
    (100.0 * value).round().clamp(-1e15, 1e15) as i64
}

fn append_hundredths(text: &mut String, value: i64) {
    let (sign, magnitude) = (if value < 0 { "-" } else { "" }, value.unsigned_abs());
    let (whole, part) = (magnitude / 100, magnitude % 100);
    // Writing to a string cannot fail.
    let _ = match (whole, part) {
        (_, 0) => write!(text, "{sign}{whole}"),
        (0, part) if part % 10 == 0 => write!(text, "{sign}.{}", part / 10),
        (0, part) => write!(text, "{sign}.{part:02}"),
        (_, part) if part % 10 == 0 => write!(text, "{sign}{whole}.{}", part / 10),
        (_, part) => write!(text, "{sign}{whole}.{part:02}"),
    };
}

/// Appends text with XML's special signs escaped and the signs XML forbids left out.
fn escape(target: &mut String, text: &str) {
    for sign in text.chars() {
        match sign {
            '&' => target.push_str("&amp;"),
            '<' => target.push_str("&lt;"),
            '>' => target.push_str("&gt;"),
            '"' => target.push_str("&quot;"),
            '\t' | '\n' | '\r' => target.push(' '),
            '\u{fffe}' | '\u{ffff}' => {}
            sign if sign.is_control() => {}
            sign => target.push(sign),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_nan() {
        let texts = [0.0, -0.001, 1.0, -0.05, 12.345, -7.1, 0.3, f64::NAN].map(number);
        assert_eq!(texts, ["0", "0", "1", "-.05", "12.35", "-7.1", ".3", "0"]);
    }

    #[test]
    fn a_path_ends_where_the_polyline_ends_despite_relative_steps() {
        let third: Vec<[f64; 2]> = (0..=300).map(|i| [f64::from(i) / 3.0, -f64::from(i) / 7.0]).collect();
        let data = path_data([third.as_slice(), &[[5.0, 5.0]]]);
        let path = data.strip_prefix("M0 0l").unwrap();
        let steps: Vec<f64> = path.replace('-', " -").split_whitespace().map(|text| text.parse().unwrap()).collect();
        let end = steps.chunks(2).fold([0.0, 0.0], |sum, step| [sum[0] + step[0], sum[1] + step[1]]);
        assert!((end[0] - 100.0).abs() < 1e-6 && (end[1] + 42.86).abs() < 1e-6, "{end:?}");
    }

    #[test]
    fn text_is_escaped_and_forbidden_signs_vanish() {
        let mut text = String::new();
        escape(&mut text, "a<b & \"c\"\u{0}\u{7}>\n");
        assert_eq!(text, "a&lt;b &amp; &quot;c&quot;&gt; ");
    }
}
