//! The points that fill a domain between its border and its outlines.

use std::collections::HashMap;

use crate::numerics::arrangement::Arrangement;
use crate::numerics::planar_domain::{Outline, PlanarDomain};
use crate::numerics::polygon::{cross, minus, nearest_on_side, ring_contains, sides};

/// Distance that the lattice keeps from border and outlines, in units of the size: far enough that no sampled edge is
/// encroached.
const CLEARANCE: f64 = 0.6;

/// Points of an equilateral lattice that keep their distance from all constraints. Where the domain is not convex the
/// lattice also fills a box around it, so that refinement finds nothing to mend outside.
pub(crate) fn lattice(domain: &PlanarDomain, constraints: &Arrangement, size: f64) -> Vec<[f64; 2]> {
    let near = NearConstraints::new(constraints, size);
    let convex = is_convex(&domain.outer.points);
    let [mut low, mut high] = domain.bounding_box();
    let mut points = Vec::new();
    if !convex {
        (0..2).for_each(|i| (low[i], high[i]) = (low[i] - 2.0 * size, high[i] + 2.0 * size));
        let frame = Outline::rectangle(low, high);
        let sides: Vec<_> = sides(&frame.points).collect();
        points = Arrangement::new(&sides, 0.0).sampled(size).points;
    }
    let columns = ((high[0] - low[0]) / size).round().max(1.0);
    let rows = ((high[1] - low[1]) / (size * 0.75_f64.sqrt())).round().max(1.0);
    let [dx, dy] = [(high[0] - low[0]) / columns, (high[1] - low[1]) / rows];
    for row in 1..rows as usize {
        let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
        for column in 0..=columns as usize {
            let point = [low[0] + dx * (column as f64 + shift), low[1] + dy * row as f64];
            let away_from_frame = point[0] - low[0] >= CLEARANCE * size && high[0] - point[0] >= CLEARANCE * size;
            let wanted = if convex { ring_contains(&domain.outer.points, point) } else { away_from_frame };
            if wanted && !near.within(point, CLEARANCE * size) {
                points.push(point);
            }
        }
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
