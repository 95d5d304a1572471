//! Rasters: a nodal field sampled on pixels, and the coverage of a sheet by lines.
//!
//! A cell covers the samples whose barycentric weights are all non-negative, and a nodal field is there Σ w_i c_i, the
//! finite element's own value. Samples are twice as dense as pixels in each direction; a pixel's colour is the mean of
//! its four samples in linear light, and its opacity the share of them that lie in the tissue.

use super::colour::{LinearRgb, to_srgb};
use resvg::tiny_skia::{IntSize, Pixmap};

/// Samples a pixel in each direction.
const SUPERSAMPLES: usize = 2;

/// Bytes that painting a triangulation takes for each pixel of its sheet, the sheet's own included.
pub const BYTES_A_PIXEL: usize = SUPERSAMPLES * SUPERSAMPLES * size_of::<Option<[f32; 3]>>() + size_of::<u32>();

/// A sheet of pixels over a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheet {
    /// Upper left corner, in the drawing's px (y downward).
    pub corner: [f64; 2],
    /// Pixels across and down.
    pub pixels: [usize; 2],
    /// Pixels of the sheet for one px of the drawing.
    pub density: f64,
}

impl Sheet {
    /// The smallest sheet of a density that covers a rectangle from `low` to `high` (px); none if the rectangle has no
    /// area, is not finite, or needs more than 64 million pixels.
    pub fn covering(low: [f64; 2], high: [f64; 2], density: f64) -> Option<Self> {
        let size = [0, 1].map(|axis| (density * (high[axis] - low[axis])).ceil());
        let drawable = size.iter().all(|extent| *extent >= 1.0) && size[0] * size[1] <= 6.4e7;
        drawable.then(|| Self { corner: low, pixels: size.map(|extent| extent as usize), density })
    }

    /// The size of the sheet in px of the drawing.
    pub fn size(&self) -> [f64; 2] {
        self.pixels.map(|pixels| pixels as f64 / self.density)
    }

    /// A point of the drawing in pixels of the sheet.
    fn locate(&self, point: [f64; 2], per_pixel: usize) -> [f64; 2] {
        let scale = self.density * per_pixel as f64;
        [scale * (point[0] - self.corner[0]), scale * (point[1] - self.corner[1])]
    }
}

/// A triangulation in px of the drawing.
#[derive(Debug, Clone, Copy)]
pub struct Triangles<'a> {
    /// Corners, px.
    pub points: &'a [[f64; 2]],
    /// Three corners a triangle; triangles that name a missing corner are not drawn.
    pub cells: &'a [u32],
}

/// Paints a triangulation: `paint` gives the light of a sample from the corners and barycentric weights it lies at.
/// None if an image of that size cannot be made.
pub fn paint_cells(
    sheet: &Sheet,
    triangles: Triangles,
    paint: impl Fn([usize; 3], [f64; 3]) -> LinearRgb,
) -> Option<Pixmap> {
    let size = sheet.pixels.map(|pixels| pixels * SUPERSAMPLES);
    let mut samples: Vec<Option<[f32; 3]>> = vec![None; size[0] * size[1]];
    for cell in triangles.cells.chunks_exact(3) {
        let corners = [cell[0] as usize, cell[1] as usize, cell[2] as usize];
        if corners.iter().all(|&corner| corner < triangles.points.len()) {
            let located = corners.map(|corner| sheet.locate(triangles.points[corner], SUPERSAMPLES));
            for_each_sample(located, size, |sample, weights| {
                samples[sample] = Some(paint(corners, weights).map(|channel| channel as f32));
            });
        }
    }
    pixmap(sheet, |x, y| mean_of_samples(&samples, size[0], x, y))
}

/// Calls `visit` with the index and weights of every sample that a triangle covers.
fn for_each_sample(corners: [[f64; 2]; 3], size: [usize; 2], mut visit: impl FnMut(usize, [f64; 3])) {
    let [a, b, c] = corners;
    let doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if doubled == 0.0 || !doubled.is_finite() {
        return;
    }
    let range = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
        let high = a[axis].max(b[axis]).max(c[axis]).ceil().max(0.0) as usize;
        low..high.min(size[axis])
    };
    for y in range(1) {
        for x in range(0) {
            let p = [x as f64 + 0.5, y as f64 + 0.5];
            let opposite =
                |u: [f64; 2], v: [f64; 2]| ((u[0] - p[0]) * (v[1] - p[1]) - (u[1] - p[1]) * (v[0] - p[0])) / doubled;
            let weights = [opposite(b, c), opposite(c, a), opposite(a, b)];
            if weights.iter().all(|weight| *weight >= -1e-9) {
                visit(y * size[0] + x, weights);
            }
        }
    }
}

/// Mean light of the covered samples of a pixel, and the share of samples that are covered.
fn mean_of_samples(samples: &[Option<[f32; 3]>], stride: usize, x: usize, y: usize) -> (LinearRgb, f64) {
    let mut sum = [0.0; 3];
    let mut covered = 0.0;
    for row in 0..SUPERSAMPLES {
        let first = (y * SUPERSAMPLES + row) * stride + x * SUPERSAMPLES;
        for light in samples[first..first + SUPERSAMPLES].iter().flatten() {
            covered += 1.0;
            (0..3).for_each(|channel| sum[channel] += f64::from(light[channel]));
        }
    }
    let mean = if covered > 0.0 { sum.map(|channel| channel / covered) } else { sum };
    (mean, covered / (SUPERSAMPLES * SUPERSAMPLES) as f64)
}

/// How many polylines pass each pixel of a sheet; each polyline counts once a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    sheet: Sheet,
    counts: Vec<u32>,
}

impl Coverage {
    /// Counts polylines (px of the drawing) on a sheet.
    pub fn of<'a>(sheet: &Sheet, polylines: impl IntoIterator<Item = &'a [[f64; 2]]>) -> Self {
        let mut counts = vec![0_u32; sheet.pixels[0] * sheet.pixels[1]];
        let mut last_visitor = vec![0_u32; counts.len()];
        for (polyline, visitor) in polylines.into_iter().zip(1_u32..) {
            for_each_pixel_on(sheet, polyline, |pixel| {
                if last_visitor[pixel] != visitor {
                    last_visitor[pixel] = visitor;
                    counts[pixel] += 1;
                }
            });
        }
        Self { sheet: *sheet, counts }
    }

    /// The sheet counted on.
    pub fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    /// The most polylines on one pixel.
    pub fn maximum(&self) -> u32 {
        self.counts.iter().copied().max().unwrap_or(0)
    }

    /// The coverage as an image of one colour with the opacity that `opacity` gives for a count above zero.
    /// None if an image of that size cannot be made.
    pub fn paint(&self, colour: LinearRgb, opacity: impl Fn(u32) -> f64) -> Option<Pixmap> {
        pixmap(&self.sheet, |x, y| {
            let count = self.counts[y * self.sheet.pixels[0] + x];
            (colour, if count > 0 { opacity(count) } else { 0.0 })
        })
    }
}

/// Calls `visit` for the pixels along a polyline, in steps of half a pixel; parts off the sheet are left out.
fn for_each_pixel_on(sheet: &Sheet, polyline: &[[f64; 2]], mut visit: impl FnMut(usize)) {
    for ends in polyline.windows(2) {
        let [from, to] = [ends[0], ends[1]].map(|point| sheet.locate(point, 1));
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let longest = (sheet.pixels[0] + sheet.pixels[1]) as f64 * 4.0;
        let steps = (2.0 * length).ceil().clamp(1.0, longest) as usize;
        for step in 0..=steps {
            let along = step as f64 / steps as f64;
            let place = [0, 1].map(|axis| (from[axis] + along * (to[axis] - from[axis])).floor());
            let inside = |axis: usize| place[axis] >= 0.0 && place[axis] < sheet.pixels[axis] as f64;
            if inside(0) && inside(1) {
                visit(place[1] as usize * sheet.pixels[0] + place[0] as usize);
            }
        }
    }
}

/// An image from the light and opacity of each pixel (column, row).
fn pixmap(sheet: &Sheet, pixel: impl Fn(usize, usize) -> (LinearRgb, f64)) -> Option<Pixmap> {
    let mut data = Vec::with_capacity(4 * sheet.pixels[0] * sheet.pixels[1]);
    for y in 0..sheet.pixels[1] {
        for x in 0..sheet.pixels[0] {
            let (light, opacity) = pixel(x, y);
            let alpha = opacity.clamp(0.0, 1.0);
            // The image type holds channels multiplied by the opacity.
            data.extend(to_srgb(light).map(|channel| (f64::from(channel) * alpha).round() as u8));
            data.push((255.0 * alpha).round() as u8);
        }
    }
    let size = IntSize::from_wh(u32::try_from(sheet.pixels[0]).ok()?, u32::try_from(sheet.pixels[1]).ok()?)?;
    Pixmap::from_vec(data, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[10.0, 10.0], [30.0, 10.0], [30.0, 30.0], [10.0, 30.0]];
    const CELLS: [u32; 6] = [0, 1, 2, 0, 2, 3];

    fn sheet() -> Sheet {
        Sheet::covering([0.0, 0.0], [40.0, 40.0], 2.0).unwrap()
    }

    #[test]
    fn a_triangulated_square_covers_its_own_area_and_no_more() {
        let triangles = Triangles { points: &SQUARE, cells: &CELLS };
        let image = paint_cells(&sheet(), triangles, |_, _| [1.0; 3]).unwrap();
        let opaque = image.pixels().iter().filter(|pixel| pixel.alpha() == 255).count();
        let clear = image.pixels().iter().filter(|pixel| pixel.alpha() == 0).count();
        assert_eq!((opaque, clear), (40 * 40, 80 * 80 - 40 * 40));
    }

    #[test]
    fn weights_reproduce_a_linear_field_exactly() {
        // The paint is a linear field of the corners; its value at the sample must be the field at the pixel's centre.
        let field = |point: [f64; 2]| 0.01 * point[0] + 0.015 * point[1];
        let triangles = Triangles { points: &SQUARE, cells: &CELLS };
        let image = paint_cells(&sheet(), triangles, |corners, weights| {
            let value = (0..3).map(|i| weights[i] * field(SQUARE[corners[i]])).sum();
            [value; 3]
        })
        .unwrap();
        for (x, y) in [(20, 20), (59, 20), (33, 47), (59, 59)] {
            let centre = [(f64::from(x) + 0.5) / 2.0, (f64::from(y) + 0.5) / 2.0];
            let expected = to_srgb([field(centre); 3])[0];
            assert_eq!(image.pixel(x, y).unwrap().red(), expected);
        }
    }

    #[test]
    fn a_cell_without_area_or_with_a_missing_corner_paints_nothing() {
        let triangles = Triangles { points: &SQUARE, cells: &[0, 1, 1, 0, 1, 9] };
        let image = paint_cells(&sheet(), triangles, |_, _| [1.0; 3]).unwrap();
        assert!(image.pixels().iter().all(|pixel| pixel.alpha() == 0));
    }

    #[test]
    fn a_polyline_counts_once_a_pixel_however_often_it_passes() {
        let back_and_forth = [[1.1, 1.1], [20.1, 1.1], [1.1, 1.1]];
        let across = [[5.1, 0.0], [5.1, 39.0]];
        let coverage = Coverage::of(&sheet(), [back_and_forth.as_slice(), &across, &across]);
        assert_eq!(coverage.maximum(), 3);
        assert_eq!(coverage.counts[2 * 80 + 30], 1);
        assert_eq!(coverage.counts[40 * 80 + 10], 2);
    }

    #[test]
    fn lines_off_the_sheet_and_impossible_sheets_are_survived() {
        let far = [[-1e12, -1e12], [1e12, 1e12], [f64::NAN, 0.0]];
        let _ = Coverage::of(&sheet(), [far.as_slice()]);
        assert_eq!(Sheet::covering([0.0, 0.0], [0.0, 10.0], 2.0), None);
        assert_eq!(Sheet::covering([0.0, 0.0], [f64::NAN, 10.0], 2.0), None);
        assert_eq!(Sheet::covering([0.0, 0.0], [1e6, 1e6], 2.0), None);
    }
}
