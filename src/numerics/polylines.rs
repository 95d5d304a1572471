//! Short polylines, and which of their segments meet a box: the coarse test before segments are looked at.

use nalgebra::Vector2;
use pulp::{Arch, Simd, WithSimd};

/// N points of a plane (µm), coordinate by coordinate; at most 17, so that 16 bits tell of the segments between them.
pub type Polyline<const N: usize> = [[f64; N]; 2];

/// Number of a polyline, and a bit for each of its segments that is meant.
pub type Part = (u32, u16);

/// Replaces `met` by the parts of a list whose segments have a bounding box that meets the one from `low` to `high`, rims
/// included. Runs in the widest vector registers that the processor has.
pub fn meeting<const N: usize>(
    polylines: &[Polyline<N>],
    list: impl Iterator<Item = Part>,
    [low, high]: [Vector2<f64>; 2],
    met: &mut Vec<Part>,
) {
    const { assert!(N > 0 && N <= 17) }
    met.clear();
    Arch::new().dispatch(Meet { polylines, list, low, high, met });
}

/// What implements `WithSimd` is compiled once for each register width.
struct Meet<'a, const N: usize, I> {
    polylines: &'a [Polyline<N>],
    list: I,
    low: Vector2<f64>,
    high: Vector2<f64>,
    met: &'a mut Vec<Part>,
}

impl<const N: usize, I: Iterator<Item = Part>> WithSimd for Meet<'_, N, I> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { polylines, list, low, high, met } = self;
        let meets = |line: &[f64; N], i: usize, low: f64, high: f64| {
            (line[i].max(line[i + 1]) >= low) & (line[i].min(line[i + 1]) <= high)
        };
        for (polyline, meant) in list {
            let [x, y] = &polylines[polyline as usize];
            let near = |i: usize| meets(x, i, low.x, high.x) & meets(y, i, low.y, high.y);
            let bits = (0..N - 1).fold(0, |bits, i| bits | (u16::from(near(i)) << i)) & meant;
            if bits != 0 {
                met.push((polyline, bits));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_told_by_their_boxes_and_only_those_that_are_meant() {
        // Segments 0 to 3: left of the box, into it, out of it across a corner, far above.
        let line = [[-9.0, -3.0, 0.5, 3.0, 3.0], [0.5, 0.5, 0.5, 3.0, 9.0]];
        let far = [[20.0; 5], [0.5; 5]];
        let mut met = vec![(7, 7)];
        let unit = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 1.0)];
        meeting(&[line, far], [(0, 0b1111), (1, 0b1111)].into_iter(), unit, &mut met);
        assert_eq!(met, [(0, 0b0110)]);
        meeting(&[line, far], [(0, 0b1011)].into_iter(), unit, &mut met);
        assert_eq!(met, [(0, 0b0010)]);
        meeting(&[line], [(0, 0b0001)].into_iter(), [Vector2::new(-3.0, 0.5), Vector2::new(0.0, 0.5)], &mut met);
        assert_eq!(met, [(0, 0b0001)], "a touch counts");
    }
}
