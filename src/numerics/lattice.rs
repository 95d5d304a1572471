//! The points that fill a domain between its border and its outlines.

use std::collections::HashMap;

use crate::numerics::arrangement::Arrangement;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::planar_domain::{Outline, PlanarDomain};
use crate::numerics::polygon::{MERGE_TOLERANCE, cross, minus, nearest_on_side, sides};
use crate::numerics::side_tree::Inside;

/// Distance that the lattice keeps from border and outlines, in units of the size: far enough that no sampled edge is
/// encroached.
const CLEARANCE: f64 = 0.6;

/// Distance that given vertices keep from outlines of regions, in units of the size.
const BESIDE_OUTLINES: f64 = 0.5;

/// What fills a domain: the vertices that it gives, or a lattice. Outside there is a lattice in either case, where it is of use.
pub(crate) fn filling(
    domain: &PlanarDomain,
    (constraints, outlines): (&Arrangement, &[Outline]),
    size: f64,
    grading: &Grading,
) -> Vec<[f64; 2]> {
    let inside = Inside::of(domain);
    let mut points = lattice(domain, (constraints, &inside), size, grading);
    if !domain.vertices.is_empty() {
        points.retain(|point| !inside.contains(*point));
        points.extend(given(domain, outlines, size));
    }
    points
}

/// The vertices that a domain gives, but for those on its border and those too near to an outline for a good triangle between.
fn given(domain: &PlanarDomain, outlines: &[Outline], size: f64) -> Vec<[f64; 2]> {
    let border: Vec<_> = domain.rings().flat_map(|ring| sides(&ring.points)).collect();
    let inner: Vec<_> = outlines.iter().flat_map(|outline| sides(&outline.points)).collect();
    let clear = |lines: &[[[f64; 2]; 2]], point: [f64; 2], distance: f64| {
        lines.iter().all(|&side| nearest_on_side(side, point).distance > distance)
    };
    let on_border = 10.0 * MERGE_TOLERANCE * domain.diameter();
    let kept = |point: &[f64; 2]| {
        domain.contains(*point) && clear(&border, *point, on_border) && clear(&inner, *point, BESIDE_OUTLINES * size)
    };
    domain.vertices.iter().copied().filter(kept).collect()
}

/// Points of an equilateral lattice that keep their distance from all constraints. Where the domain is not convex the
/// lattice also fills a box around it, so that refinement finds nothing to mend outside. Where the grading asks for a level, the
/// points of a lattice of half the spacing are added, which holds all points of the coarser one.
fn lattice(
    domain: &PlanarDomain,
    (constraints, inside): (&Arrangement, &Inside),
    size: f64,
    grading: &Grading,
) -> Vec<[f64; 2]> {
    let near = NearConstraints::new(constraints, size);
    let convex = is_convex(&domain.outer.points);
    let [mut low, mut high] = domain.bounding_box();
    let mut points = Vec::new();
    if !convex {
        (0..2).for_each(|i| (low[i], high[i]) = (low[i] - 2.0 * size, high[i] + 2.0 * size));
        let frame = Outline::rectangle(low, high);
        let sides: Vec<_> = sides(&frame.points).collect();
        points = Arrangement::new(&sides, 0.0).sampled(size, |_| size).points;
    }
    let columns = ((high[0] - low[0]) / size).round().max(1.0);
    let rows = ((high[1] - low[1]) / (size * 0.75_f64.sqrt())).round().max(1.0);
    let spacing = [(high[0] - low[0]) / columns, (high[1] - low[1]) / rows];
    let mut take = |level: u8, [from, to]: [[f64; 2]; 2]| {
        let share = 0.5f64.powi(i32::from(level));
        let [dx, dy, size] = [spacing[0], spacing[1], size].map(|length| share * length);
        let first = |k: usize, step: f64| ((from[k] - low[k]) / step).floor().max(0.0) as usize;
        let last = |k: usize, count: f64, step: f64| ((to[k] - low[k]) / step).ceil().min(count / share) as usize;
        for row in first(1, dy).max(1)..(last(1, rows, dy) + 1).min((rows / share) as usize) {
            let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
            for column in first(0, dx).saturating_sub(1)..=last(0, columns, dx) {
                let point = [low[0] + dx * (column as f64 + shift), low[1] + dy * row as f64];
                let of_coarser = level > 0 && row % 2 == 0 && column % 2 == row / 2 % 2;
                let here = level == 0 || (0..2).all(|k| from[k] <= point[k] && point[k] < to[k]);
                let away_from_frame = point[0] - low[0] >= CLEARANCE * size && high[0] - point[0] >= CLEARANCE * size;
                let wanted = if convex { inside.is_in_outer_ring(point) } else { away_from_frame };
                if here && !of_coarser && wanted && !near.within(point, CLEARANCE * grading.size_at(point)) {
                    points.push(point);
                }
            }
        }
    };
    take(0, [low, high]);
    for level in 1..=grading.finest() {
        grading.squares(level).for_each(|square| take(level, square));
    }
    points
}

fn is_convex(points: &[[f64; 2]]) -> bool {
    let n = points.len();
    (0..n).all(|i| {
        let (a, b, c) = (points[i], points[(i + 1) % n], points[(i + 2) % n]);
        cross(minus(b, a), minus(c, b)) >= 0.0
    })
}

/// Short segments binned by their middle, so that "is one near?" costs a few look-ups.
struct NearConstraints<'a> {
    constraints: &'a Arrangement,
    size: f64,
    bins: HashMap<[i64; 2], Vec<u32>>,
}

impl<'a> NearConstraints<'a> {
    fn new(constraints: &'a Arrangement, size: f64) -> Self {
        let mut near = Self { constraints, size, bins: HashMap::new() };
        for (index, _) in constraints.segments.iter().enumerate() {
            let [a, b] = near.side(index as u32);
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            near.bins.entry(near.bin(middle)).or_default().push(index as u32);
        }
        near
    }

    fn side(&self, segment: u32) -> [[f64; 2]; 2] {
        self.constraints.segments[segment as usize].map(|point| self.constraints.points[point as usize])
    }

    fn bin(&self, point: [f64; 2]) -> [i64; 2] {
        point.map(|x| (x / self.size).floor() as i64)
    }

    /// `reach` may be up to 1.5 sizes: a segment's middle is at most half a size from its ends.
    fn within(&self, point: [f64; 2], reach: f64) -> bool {
        let [i, j] = self.bin(point);
        (-2..=2).flat_map(|di| (-2..=2).map(move |dj| [i + di, j + dj])).any(|bin| {
            let segments = self.bins.get(&bin);
            segments.is_some_and(|s| s.iter().any(|&s| nearest_on_side(self.side(s), point).distance < reach))
        })
    }
}
