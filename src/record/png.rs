//! SVG figures as PNG, the same bits on every run: text comes as outlines, no font of the system is read.
//!
//! Drawings are rendered by resvg. Images inside the SVG (PNG data) are placed here, **beneath all drawings** whatever
//! their order, so that no decoder for other picture formats is needed; such an image must not stand in a group with an
//! opacity, a mask or a filter of its own, and must not hide a drawing.

use resvg::tiny_skia::{FilterQuality, Pixmap, PixmapPaint, Transform};
use resvg::usvg;

/// Pixels of a picture at most.
const MOST_PIXELS: f32 = 4e8;

/// An SVG could not be turned into a PNG.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The SVG is not well formed.
    #[error("the SVG cannot be read: {0}")]
    Parse(#[from] usvg::Error),
    /// The picture would have no pixels, or too many.
    #[error("a picture of {width} x {height} px at the scale {scale} cannot be made")]
    Size {
        /// Width of the SVG in px.
        width: f32,
        /// Height of the SVG in px.
        height: f32,
        /// Pixels for one px.
        scale: f32,
    },
    /// The SVG holds an image that is no PNG, or one inside a group with effects of its own.
    #[error("the SVG holds an image that cannot be placed: {0}")]
    Image(String),
    /// The encoder failed.
    #[error("the picture cannot be encoded: {0}")]
    Encode(String),
}

/// The scale that makes a figure's 96 px an inch come out at `dpi` dots an inch: dpi/96.
pub fn scale_for_dpi(dpi: f32) -> f32 {
    dpi / 96.0
}

/// Renders an SVG without text elements ([`super::svg::Svg::outlined`]) with `scale` pixels for one px of it, on white.
///
/// # Errors
/// An SVG that cannot be read, a picture too large, an image in it that is no PNG.
pub fn to_png(svg: &str, scale: f32) -> Result<Vec<u8>, PngError> {
    encode(render(svg, scale)?)
}

/// As [`to_png`], the pixels themselves.
///
/// # Errors
/// As [`to_png`].
pub fn render(svg: &str, scale: f32) -> Result<Pixmap, PngError> {
    let to_pixels = Transform::from_scale(scale, scale);
    let images = || {
        let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
        let mut canvas = white_canvas(tree.size(), scale)?;
        draw_images(tree.root(), to_pixels, &mut canvas)?;
        Ok::<_, PngError>(canvas)
    };
    let (canvas, drawings) = rayon::join(images, || usvg::Tree::from_str(svg, &options_without_images()));
    let mut canvas = canvas?;
    resvg::render(&drawings?, to_pixels, &mut canvas.as_mut());
    Ok(canvas)
}

/// A picture as PNG, compressed lightly: a tenth of the time of a thorough compression.
///
/// # Errors
/// An encoder that fails.
pub fn encode(picture: Pixmap) -> Result<Vec<u8>, PngError> {
    let failed = |error: png::EncodingError| PngError::Encode(error.to_string());
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&picture.take_demultiplied()).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}

/// Parser options that leave out images.
fn options_without_images() -> usvg::Options<'static> {
    let image_href_resolver =
        usvg::ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
    usvg::Options { image_href_resolver, ..usvg::Options::default() }
}

/// A white picture for an SVG of a size in px.
fn white_canvas(size: usvg::Size, scale: f32) -> Result<Pixmap, PngError> {
    let refused = PngError::Size { width: size.width(), height: size.height(), scale };
    let [across, down] = [size.width(), size.height()].map(|extent| (extent * scale).ceil());
    if !(across >= 1.0 && down >= 1.0 && across * down <= MOST_PIXELS) {
        return Err(refused);
    }
    let mut canvas = Pixmap::new(across as u32, down as u32).ok_or(refused)?;
    canvas.fill(resvg::tiny_skia::Color::WHITE);
    Ok(canvas)
}

/// Places the images of a group, in order; `to_pixels` maps the SVG's px to pixels.
fn draw_images(group: &usvg::Group, to_pixels: Transform, canvas: &mut Pixmap) -> Result<(), PngError> {
    for node in group.children() {
        match node {
            usvg::Node::Image(_) if group.should_isolate() => {
                return Err(PngError::Image("it stands in a group with effects".to_owned()));
            }
            usvg::Node::Image(image) => draw_image(image, to_pixels, canvas)?,
            usvg::Node::Group(inner) => draw_images(inner, to_pixels, canvas)?,
            _ => {}
        }
    }
    Ok(())
}

/// Places a PNG image.
fn draw_image(image: &usvg::Image, to_pixels: Transform, canvas: &mut Pixmap) -> Result<(), PngError> {
    let usvg::ImageKind::PNG(data) = image.kind() else {
        return Err(PngError::Image("it is no PNG".to_owned()));
    };
    let picture = Pixmap::decode_png(data).map_err(|error| PngError::Image(error.to_string()))?;
    let paint = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
    canvas.draw_pixmap(0, 0, picture.as_ref(), &paint, to_pixels.pre_concat(image.abs_transform()), None);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::svg::{Anchor, Label, Svg};
    use crate::record::theme::{self, Font};

    fn red_dot() -> Vec<u8> {
        let mut dot = Pixmap::new(2, 2).unwrap();
        dot.fill(resvg::tiny_skia::Color::from_rgba8(255, 0, 0, 255));
        dot.encode_png().unwrap()
    }

    #[test]
    fn images_are_placed_where_they_stand_and_drawings_lie_on_them() {
        let mut svg = Svg::new(40.0, 20.0);
        svg.image([10.0, 4.0], [12.0, 12.0], &red_dot());
        svg.open_group(&[("transform", "translate(14 0)"), ("fill", "#0000ff")]);
        svg.element("rect", &[("x", "0"), ("y", "8"), ("width", "4"), ("height", "4")]);
        svg.close_group();
        let vertical = [("x1", "30"), ("x2", "30"), ("y1", "0"), ("y2", "20"), ("stroke", "#0000ff")];
        svg.element("line", &vertical);
        let picture = Pixmap::decode_png(&to_png(&svg.finish(), 2.0).unwrap()).unwrap();
        assert_eq!((picture.width(), picture.height()), (80, 40));
        let colour = |x, y| {
            let pixel = picture.pixel(x, y).unwrap();
            [pixel.red(), pixel.green(), pixel.blue(), pixel.alpha()]
        };
        assert_eq!(colour(4, 4), [255, 255, 255, 255]);
        assert_eq!(colour(24, 12), [255, 0, 0, 255]);
        assert_eq!(colour(32, 20), [0, 0, 255, 255]);
        assert_eq!(colour(40, 20), [255, 0, 0, 255]);
        assert_eq!(colour(60, 20), [0, 0, 255, 255], "a line of no width in x is drawn");
        assert_eq!(colour(50, 20), [255, 255, 255, 255]);
    }

    #[test]
    fn measured_text_is_as_wide_as_it_is_drawn() {
        for font in [Font::regular(20.0), Font::bold(13.0)] {
            for text in ["312 growing, 140 arrived", "Hamburgefonstiv (nM)", "WMQ@{}~"] {
                let mut svg = Svg::new(900.0, 60.0);
                let at = [20.0, 40.0];
                svg.label(&Label { at, anchor: Anchor::Start, font, colour: theme::TEXT, halo: false, text });
                let tree = usvg::Tree::from_str(&svg.outlined(), &usvg::Options::default()).unwrap();
                let drawn = tree.root().children().last().unwrap().abs_bounding_box();
                let measured = font.width(text);
                assert!(
                    (f64::from(drawn.width()) - measured).abs() < 0.03 * measured + 1.0,
                    "{text} {drawn:?} {measured}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_a_picture_is_an_error() {
        let svg = Svg::new(10.0, 10.0).finish();
        assert!(matches!(to_png("no svg", 1.0), Err(PngError::Parse(_))));
        for scale in [0.0, -1.0, f32::NAN, 1e9] {
            assert!(matches!(to_png(&svg, scale), Err(PngError::Size { .. })), "{scale}");
        }
        assert_eq!(scale_for_dpi(300.0), 3.125);
    }

    #[test]
    fn the_same_svg_gives_the_same_bytes() {
        let svg = Svg::new(10.0, 10.0).finish();
        assert_eq!(to_png(&svg, 3.0).unwrap(), to_png(&svg, 3.0).unwrap());
    }
}
