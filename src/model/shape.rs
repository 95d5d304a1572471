//! Regions of the plane as authors write them: sources of cues and targets.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Length, format_number};
use super::violation::Violations;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::planar_domain::Outline;
use crate::numerics::polygon::{contains_or_touches, sides, signed_area, turn};

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
            Self::Polygon { points } => contains_or_touches(&coordinates(points), point),
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

/// Notes what keeps a closed line from being the border of a region: fewer than three points, a side of no length, no area, a
/// crossing of two sides.
pub fn check_ring(ring: &[[f64; 2]], pointer: &str, violations: &mut Violations) {
    if ring.len() < 3 {
        return violations.push(pointer, format!("{} points do not enclose an area", ring.len()));
    }
    for (index, [a, b]) in sides(ring).enumerate() {
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
    let sides: Vec<_> = sides(ring).collect();
    let span = |index: usize| {
        let [a, b] = sides[index];
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

fn cross_properly([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let opposite = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
    opposite(turn(a, b, c), turn(a, b, d)) && opposite(turn(c, d, a), turn(c, d, b))
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
