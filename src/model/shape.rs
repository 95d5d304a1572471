//! Regions of the plane as authors write them: sources of cues and targets.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Length, format_number};
use super::violation::Violations;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::planar_domain::Outline;

/// A point of the plane `[x, y]` \[µm\].
pub type Point = [Length; 2];

/// A region of the plane: a disc or a polygon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// All points within `radius` of `centre`.
    Disc {
        /// The middle `[x, y]` \[µm\].
        centre: Point,
        /// The radius \[µm\].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: Length,
    },
    /// The inside of a closed line.
    Polygon {
        /// The corners in order, either way round; the last is joined to the first.
        #[schemars(length(min = 3))]
        points: Vec<Point>,
    },
}

impl Shape {
    /// The area \[µm²\].
    pub fn area(&self) -> f64 {
        match self {
            Self::Disc { radius, .. } => std::f64::consts::PI * radius.0 * radius.0,
            Self::Polygon { points } => signed_area(&coordinates(points)).abs(),
        }
    }

    /// Whether a point \[µm\] lies inside or on the border, to round-off.
    pub fn contains(&self, point: [f64; 2]) -> bool {
        match self {
            Self::Disc { centre, radius } => {
                (point[0] - centre[0].0).hypot(point[1] - centre[1].0) <= radius.0 * (1.0 + 4.0 * f64::EPSILON)
            }
            Self::Polygon { points } => polygon_contains(&coordinates(points), point),
        }
    }

    /// The line that a mesh of this grading is fitted to.
    pub fn outline(&self, grading: &Grading) -> Outline {
        match self {
            Self::Disc { centre, radius } => {
                let [x, y] = [centre[0].0, centre[1].0];
                Outline::disc([x, y], radius.0, grading.size_at([x + radius.0, y]))
            }
            Self::Polygon { points } => Outline::new(coordinates(points)),
        }
    }

    /// Whether the shape has a positive area and a border that does not cross itself.
    ///
    /// # Errors
    /// The violations, their pointers relative to the shape.
    pub fn check(&self) -> Result<(), Violations> {
        let mut violations = Violations::new();
        match self {
            Self::Disc { radius, .. } => {
                violations.demand(radius.0 > 0.0, "/disc/radius", || format!("{radius} is not a positive length"));
            }
            Self::Polygon { points } => check_ring(&coordinates(points), "/polygon/points", &mut violations),
        }
        violations.into_result()
    }
}

/// The points as plain numbers \[µm\].
pub fn coordinates(points: &[Point]) -> Vec<[f64; 2]> {
    points.iter().map(|point| [point[0].0, point[1].0]).collect()
}

/// The area of a closed line, `½ Σ xᵢ yᵢ₊₁ − xᵢ₊₁ yᵢ`: positive when it runs counter-clockwise.
pub fn signed_area(ring: &[[f64; 2]]) -> f64 {
    let Some(&origin) = ring.first() else { return 0.0 };
    let twice: f64 = segments(ring).map(|(a, b)| cross(origin, a, b)).sum();
    0.5 * twice
}

/// Whether a point lies inside a closed line or on it, to round-off.
pub fn polygon_contains(ring: &[[f64; 2]], point: [f64; 2]) -> bool {
    let mut inside = false;
    for (a, b) in segments(ring) {
        if distance_to_segment(point, a, b) <= 1e-12 * (1.0 + point[0].abs() + point[1].abs()) {
            return true;
        }
        if (a[1] > point[1]) != (b[1] > point[1]) && (cross(a, b, point) > 0.0) == (b[1] > a[1]) {
            inside = !inside;
        }
    }
    inside
}

/// The distance of a point from a segment \[µm\].
pub fn distance_to_segment(point: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (edge, offset) = ([b[0] - a[0], b[1] - a[1]], [point[0] - a[0], point[1] - a[1]]);
    let length_squared = edge[0] * edge[0] + edge[1] * edge[1];
    let share = if length_squared > 0.0 { (offset[0] * edge[0] + offset[1] * edge[1]) / length_squared } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (offset[0] - share * edge[0]).hypot(offset[1] - share * edge[1])
}

/// Notes what keeps a closed line from being the border of a region: fewer than three points, a side of no length, no area, a
/// crossing of two sides.
pub fn check_ring(ring: &[[f64; 2]], pointer: &str, violations: &mut Violations) {
    if ring.len() < 3 {
        return violations.push(pointer, format!("{} points do not enclose an area", ring.len()));
    }
    for (index, (a, b)) in segments(ring).enumerate() {
        let next = (index + 1) % ring.len();
        violations.demand(a != b, &format!("{pointer}/{next}"), || {
            format!("[{}, {}] repeats the point before it", format_number(b[0]), format_number(b[1]))
        });
    }
    if !violations.is_empty() {
        return;
    }
    if let Some((first, second)) = find_crossing(ring) {
        return violations.push(pointer, format!("the sides that start at points {first} and {second} cross"));
    }
    violations.demand(signed_area(ring) != 0.0, pointer, || "the points enclose no area".to_owned());
}

/// The first two sides that cross at an inner point of both, by a sweep along x.
fn find_crossing(ring: &[[f64; 2]]) -> Option<(usize, usize)> {
    let sides: Vec<_> = segments(ring).collect();
    let span = |index: usize| {
        let (a, b) = sides[index];
        (a[0].min(b[0]), a[0].max(b[0]))
    };
    let mut order: Vec<usize> = (0..sides.len()).collect();
    order.sort_by(|&i, &j| span(i).0.total_cmp(&span(j).0).then(i.cmp(&j)));
    let mut open: Vec<usize> = Vec::new();
    for index in order {
        open.retain(|&other| span(other).1 >= span(index).0);
        if let Some(&other) = open.iter().find(|&&other| cross_properly(sides[index], sides[other])) {
            return Some((index.min(other), index.max(other)));
        }
        open.push(index);
    }
    None
}

type Side = ([f64; 2], [f64; 2]);

fn cross_properly((a, b): Side, (c, d): Side) -> bool {
    let opposite = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
    opposite(cross(a, b, c), cross(a, b, d)) && opposite(cross(c, d, a), cross(c, d, b))
}

/// The sides of a closed line, from each point to the next.
pub fn segments(ring: &[[f64; 2]]) -> impl Iterator<Item = Side> + '_ {
    ring.iter().enumerate().map(|(index, &point)| (point, ring[(index + 1) % ring.len()]))
}

/// Twice the signed area of the triangle `abc`.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[[f64; 2]]) -> Shape {
        Shape::Polygon { points: points.iter().map(|p| p.map(Length)).collect() }
    }

    #[test]
    fn a_notched_square_knows_its_area_and_its_inside() {
        let shape = polygon(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        assert_eq!(shape.area(), 16.0 - 0.5 * 4.0 * 3.0);
        for (point, inside) in
            [([2.0, 0.5], true), ([2.0, 2.0], false), ([0.0, 2.0], true), ([2.0, 1.0], true), ([5.0, 1.0], false)]
        {
            assert_eq!(shape.contains(point), inside, "{point:?}");
        }
        assert!(shape.check().is_ok());
        let disc = Shape::Disc { centre: [Length(1.0), Length(2.0)], radius: Length(2.0) };
        assert!(disc.contains([3.0, 2.0]) && !disc.contains([3.01, 2.0]));
        assert_eq!(disc.area(), 4.0 * std::f64::consts::PI);
    }

    #[test]
    fn a_ring_that_bounds_no_region_is_refused() {
        let cases = [
            (
                polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]),
                "/polygon/points: the sides that start at points 0 and 2 cross",
            ),
            (
                polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 1.0]]),
                "/polygon/points/2: [1, 1] repeats the point before it",
            ),
            (polygon(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), "/polygon/points: the points enclose no area"),
            (polygon(&[[0.0, 0.0], [1.0, 1.0]]), "/polygon/points: 2 points do not enclose an area"),
        ];
        for (shape, message) in cases {
            assert_eq!(shape.check().unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn a_ring_of_ten_thousand_sides_is_checked_at_once() {
        let ring: Vec<_> =
            (0..10_000).map(|i| f64::from(i) * std::f64::consts::TAU / 1e4).map(|a| [a.cos(), a.sin()]).collect();
        let mut violations = Violations::new();
        check_ring(&ring, "", &mut violations);
        assert!(violations.is_empty());
        assert!((signed_area(&ring) - std::f64::consts::PI).abs() < 1e-6);
    }
}
