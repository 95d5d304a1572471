//! Line segments cut where they meet: what a constrained triangulation can take without surprises.
//!
//! Segments that cross get a common point there, segments that touch or overlap share their points, and points closer than
//! a tolerance become one. All results depend on the order of the input alone.

use crate::numerics::polygon::{NearestOnEdge, bounding_box, cross, distance, minus, nearest_on_side};
use crate::numerics::side_tree::SideTree;
use rstar::primitives::{GeomWithData, Line};
use rstar::{AABB, RTree};

type Segment = [[f64; 2]; 2];

/// Points, and segments between them that meet nowhere but in their ends.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrangement {
    /// Distinct points (µm).
    pub points: Vec<[f64; 2]>,
    /// Segments, each by its two points, none twice.
    pub segments: Vec<[u32; 2]>,
}

impl Arrangement {
    /// Cuts `segments` at all common points; points within `tolerance` (µm) are one.
    pub fn new(segments: &[Segment], tolerance: f64) -> Self {
        Self::within(segments, tolerance, usize::MAX).unwrap_or_default()
    }

    /// The same, but none if there are more than so many points.
    pub fn within(segments: &[Segment], tolerance: f64, most: usize) -> Option<Self> {
        let mut points = Merged::default();
        let ends: Vec<[u32; 2]> =
            segments.iter().map(|&[a, b]| [points.number(a, tolerance), points.number(b, tolerance)]).collect();
        let mut cuts: Vec<Vec<(f64, u32)>> = ends.iter().map(|&[a, b]| vec![(0.0, a), (1.0, b)]).collect();
        let tree = SideTree::of(segments.to_vec());
        for i in 0..segments.len() {
            for j in tree.near(&segments[i], tolerance).into_iter().filter(|j| *j > i) {
                if !apart(&segments[i], &segments[j], tolerance) {
                    let pair = Pair { indices: [i, j], sides: [segments[i], segments[j]], ends: [ends[i], ends[j]] };
                    pair.cut(&mut points, &mut cuts, tolerance);
                }
            }
            if points.points.len() > most {
                return None;
            }
        }
        Some(Self { points: points.points, segments: join(cuts) })
    }

    /// The same segments, each divided evenly into pieces no longer than `size` (µm), and these halved while they are longer than
    /// `size_at` their middle.
    pub fn sampled(&self, size: f64, size_at: impl Fn([f64; 2]) -> f64) -> Self {
        let mut points = self.points.clone();
        let mut segments = Vec::new();
        for &[from, to] in &self.segments {
            let side = [self.points[from as usize], self.points[to as usize]];
            let length = distance(side[0], side[1]);
            let pieces = (length / size - 1e-9).ceil().max(1.0) as usize;
            let mut shares = vec![0.0];
            for piece in 1..=pieces {
                let before = (piece - 1) as f64 / pieces as f64;
                let too_long = |a: f64, b: f64| (b - a) * length > (1.0 + 2e-9) * size_at(along(side, 0.5 * (a + b)));
                halve([before, piece as f64 / pieces as f64], &too_long, &mut shares);
            }
            let mut last = from;
            for &share in &shares[1..shares.len() - 1] {
                points.push(along(side, share));
                let next = (points.len() - 1) as u32;
                segments.push([last, next]);
                last = next;
            }
            segments.push([last, to]);
        }
        Self { points, segments }
    }

    /// The place that is narrowest for its sides: where a point lies nearest to a segment that it is no end of, over the segment's length; of several the
    /// first.
    pub fn narrowest(&self) -> Option<Narrow> {
        let side = |segment: &[u32; 2]| segment.map(|end| self.points[end as usize]);
        let line = |segment: &[u32; 2]| {
            let [from, to] = side(segment);
            GeomWithData::new(Line::new(from, to), *segment)
        };
        let tree = RTree::bulk_load(self.segments.iter().map(line).collect());
        let room = |(place, point): (u32, &[f64; 2])| {
            let other = tree.nearest_neighbor_iter(*point).find(|segment| !segment.data.contains(&place))?;
            let [from, to] = side(&other.data);
            let NearestOnEdge { distance: away, point: opposite, .. } = nearest_on_side([from, to], *point);
            let middle = [0, 1].map(|k| 0.5 * (point[k] + opposite[k]));
            Some(Narrow { point: *point, middle, distance: away, length: distance(from, to) })
        };
        (0..).zip(&self.points).filter_map(room).min_by(|a, b| a.share().total_cmp(&b.share()))
    }
}

/// Where a segment passes a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Narrow {
    /// The point (µm).
    pub point: [f64; 2],
    /// Half-way between it and the segment (µm).
    pub middle: [f64; 2],
    /// How far away the segment is (µm).
    pub distance: f64,
    /// Length of the segment (µm).
    pub length: f64,
}

impl Narrow {
    fn share(&self) -> f64 {
        self.distance / self.length
    }

    /// Whether that is why a mesh has many vertices.
    pub fn is_to_blame(&self) -> bool {
        self.share() < 0.05
    }
}

fn along([a, b]: Segment, share: f64) -> [f64; 2] {
    [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
}

/// Adds the ends of the parts of a piece, the first of which is there already.
fn halve([from, to]: [f64; 2], too_long: &impl Fn(f64, f64) -> bool, ends: &mut Vec<f64>) {
    if too_long(from, to) {
        let middle = 0.5 * (from + to);
        halve([from, middle], too_long, ends);
        halve([middle, to], too_long, ends);
    } else {
        ends.push(to);
    }
}

struct Pair {
    indices: [usize; 2],
    sides: [Segment; 2],
    ends: [[u32; 2]; 2],
}

impl Pair {
    fn cut(&self, points: &mut Merged, cuts: &mut [Vec<(f64, u32)>], tolerance: f64) {
        let mut touched = false;
        for (one, other) in [(0, 1), (1, 0)] {
            for end in self.ends[other] {
                let point = points.points[end as usize];
                if nearest_on_side(self.sides[one], point).distance <= tolerance {
                    cuts[self.indices[one]].push((share_of(self.sides[one], point), end));
                    touched = true;
                }
            }
        }
        let [[a, b], [c, d]] = self.sides;
        let (first, second) = (minus(b, a), minus(d, c));
        let divisor = cross(first, second);
        let s = cross(minus(c, a), second) / divisor;
        let t = cross(minus(c, a), first) / divisor;
        if !touched && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            let point = points.number([a[0] + s * first[0], a[1] + s * first[1]], tolerance);
            cuts[self.indices[0]].push((s, point));
            cuts[self.indices[1]].push((t, point));
        }
    }
}

/// Points of which those that are near one another are one: the first.
#[derive(Default)]
struct Merged {
    points: Vec<[f64; 2]>,
    tree: RTree<GeomWithData<[f64; 2], u32>>,
}

impl Merged {
    /// Number of the first point within a tolerance (µm) of one, which is added if there is none.
    fn number(&mut self, point: [f64; 2], tolerance: f64) -> u32 {
        // Wider than the round-off of distances and of the box itself.
        let reach = 1.001 * tolerance + 1e-15 * (point[0].abs() + point[1].abs());
        let around = AABB::from_corners(point.map(|x| x - reach), point.map(|x| x + reach));
        let near = self.tree.locate_in_envelope(around).filter(|other| distance(*other.geom(), point) <= tolerance);
        near.map(|other| other.data).min().unwrap_or_else(|| {
            let number = self.points.len() as u32;
            self.points.push(point);
            self.tree.insert(GeomWithData::new(point, number));
            number
        })
    }
}

fn apart(a: &Segment, b: &Segment, tolerance: f64) -> bool {
    let ([a_low, a_high], [b_low, b_high]) = (bounding_box(a), bounding_box(b));
    (0..2).any(|i| a_low[i] > b_high[i] + tolerance || b_low[i] > a_high[i] + tolerance)
}

fn share_of([a, b]: Segment, point: [f64; 2]) -> f64 {
    let along = minus(b, a);
    let away = minus(point, a);
    (along[0] * away[0] + along[1] * away[1]) / (along[0] * along[0] + along[1] * along[1])
}

fn join(mut cuts: Vec<Vec<(f64, u32)>>) -> Vec<[u32; 2]> {
    let mut known = std::collections::BTreeSet::new();
    let mut segments = Vec::new();
    for cut in &mut cuts {
        cut.sort_by(|a, b| a.0.total_cmp(&b.0));
        for pair in cut.windows(2) {
            let (a, b) = (pair[0].1, pair[1].1);
            if a != b && known.insert((a.min(b), a.max(b))) {
                segments.push([a, b]);
            }
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cross_becomes_four_segments_with_one_common_point() {
        let cross = Arrangement::new(&[[[0.0, 0.0], [2.0, 2.0]], [[0.0, 2.0], [2.0, 0.0]]], 1e-9);
        assert_eq!((cross.points.len(), cross.segments.len()), (5, 4));
        assert!(distance(cross.points[4], [1.0, 1.0]) < 1e-15);
    }

    #[test]
    fn overlapping_segments_share_their_common_part() {
        let overlap = Arrangement::new(&[[[0.0, 0.0], [3.0, 0.0]], [[1.0, 1e-11], [5.0, 0.0]]], 1e-9);
        assert_eq!((overlap.points.len(), overlap.segments.len()), (4, 3));
        let tee = Arrangement::new(&[[[0.0, 0.0], [3.0, 0.0]], [[1.0, 0.0], [1.0, 5.0]]], 1e-9);
        assert_eq!((tee.points.len(), tee.segments.len()), (4, 3));
    }

    #[test]
    fn sampling_leaves_no_piece_longer_than_asked() {
        let sampled =
            Arrangement::new(&[[[0.0, 0.0], [3.1, 0.0]], [[0.0, 0.0], [0.0, 3.0]]], 1e-9).sampled(1.0, |_| 1.0);
        assert_eq!(sampled.segments.len(), 4 + 3);
        let length = |s: &[u32; 2]| distance(sampled.points[s[0] as usize], sampled.points[s[1] as usize]);
        assert!(sampled.segments.iter().all(|s| length(s) <= 1.0 + 1e-12));
    }

    #[test]
    fn pieces_are_halved_where_they_shall_be_shorter() {
        let line = Arrangement::new(&[[[0.0, 0.0], [4.0, 0.0]]], 1e-9);
        let sampled = line.sampled(1.0, |x| if x[0] > 3.0 { 0.25 } else { 1.0 });
        let length = |s: &[u32; 2]| distance(sampled.points[s[0] as usize], sampled.points[s[1] as usize]);
        let lengths: Vec<f64> = sampled.segments.iter().map(length).collect();
        assert_eq!(lengths, [1.0, 1.0, 1.0, 0.25, 0.25, 0.25, 0.25]);
    }

    #[test]
    fn the_narrowest_place_is_between_sides_that_share_no_point() {
        let comb =
            [[[0.0, 0.0], [9.0, 0.0]], [[9.0, 0.0], [9.0, 5.0]], [[4.0, 3.0], [4.0, 0.25]], [[0.0, 0.0], [0.1, 5.0]]];
        let Narrow { point, middle, distance, length } = Arrangement::new(&comb, 1e-9).narrowest().unwrap();
        assert_eq!((point, middle, distance, length), ([4.0, 0.25], [4.0, 0.125], 0.25, 9.0));
        // A small shape has sides near to one another, but not for their length.
        let small = [[[6.0, 2.0], [6.1, 2.0]], [[6.1, 2.0], [6.05, 2.1]], [[6.05, 2.1], [6.0, 2.0]]];
        let with_small: Vec<_> = comb.into_iter().chain(small).collect();
        assert_eq!(Arrangement::new(&with_small, 1e-9).narrowest().unwrap().point, [4.0, 0.25]);
        assert_eq!(Arrangement::new(&comb[..2], 1e-9).narrowest().map(|narrow| narrow.distance), Some(5.0));
        assert_eq!(Arrangement::new(&comb[..1], 1e-9).narrowest(), None);
        assert_eq!(Arrangement::within(&with_small, 1e-9, 6), None);
    }
}
