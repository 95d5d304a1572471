//! Plane geometry of closed polygons, given by their corners (µm); the last is joined to the first.

pub(crate) use super::side_tree::Inside;
pub use super::side_tree::SideTree;

/// Relative length (of the bounding box's diagonal) under which two points count as one.
pub const MERGE_TOLERANCE: f64 = 1e-10;

/// The nearest point of a named edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestOnEdge {
    /// Distance (µm).
    pub distance: f64,
    /// The nearest point itself (µm).
    pub point: [f64; 2],
    /// Unit normal of the side there, pointing into the domain.
    pub inner_normal: [f64; 2],
}

/// The sides of a closed polygon, `[from, to]`.
pub fn sides(points: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    (0..points.len()).map(move |i| [points[i], points[(i + 1) % points.len()]])
}

/// Length of all sides of a closed polygon (µm).
pub fn perimeter(points: &[[f64; 2]]) -> f64 {
    sides(points).map(|[a, b]| distance(a, b)).sum()
}

/// Signed area of a closed polygon (µm²), positive if counter-clockwise.
pub fn signed_area(points: &[[f64; 2]]) -> f64 {
    let Some(&origin) = points.first() else { return 0.0 };
    sides(points).map(|[a, b]| 0.5 * cross(minus(a, origin), minus(b, origin))).sum()
}

/// The distance of a point from a segment (µm).
pub fn distance_to_segment(point: [f64; 2], [from, to]: [[f64; 2]; 2]) -> f64 {
    let (along, offset) = (minus(to, from), minus(point, from));
    let squared = dot(along, along);
    let share = if squared > 0.0 { (dot(offset, along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (offset[0] - share * along[0]).hypot(offset[1] - share * along[1])
}

/// Nearest point of a side to a point, with the side's left normal.
pub fn nearest_on_side([from, to]: [[f64; 2]; 2], point: [f64; 2]) -> NearestOnEdge {
    let along = minus(to, from);
    let length_squared = dot(along, along);
    let share =
        if length_squared > 0.0 { (dot(minus(point, from), along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    let nearest = [from[0] + share * along[0], from[1] + share * along[1]];
    let length = length_squared.sqrt().max(f64::MIN_POSITIVE);
    let inner_normal = [-along[1] / length, along[0] / length];
    NearestOnEdge { distance: distance(point, nearest), point: nearest, inner_normal }
}

/// Twice the signed area of the triangle `abc`: positive where the way from a over b to c turns left.
pub(crate) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    cross(minus(b, a), minus(c, a))
}

pub(crate) fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

pub(crate) fn bounding_box(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    points.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
        [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
    })
}

/// Whether a point lies inside a closed polygon (even–odd rule).
pub(crate) fn ring_contains(points: &[[f64; 2]], point: [f64; 2]) -> bool {
    sides(points).filter(|side| crosses_ray(side, point)).count() % 2 == 1
}

/// Whether a side crosses the ray from a point along x.
pub(crate) fn crosses_ray(&[a, b]: &[[f64; 2]; 2], [x, y]: [f64; 2]) -> bool {
    (a[1] > y) != (b[1] > y) && (turn(a, b, [x, y]) > 0.0) == (b[1] > a[1])
}

/// Whether a point lies inside a closed polygon or on its border, to round-off.
pub(crate) fn contains_or_touches(points: &[[f64; 2]], point: [f64; 2]) -> bool {
    let reach = 1e-12 * (1.0 + point[0].abs() + point[1].abs());
    ring_contains(points, point) || sides(points).any(|side| distance_to_segment(point, side) <= reach)
}

/// Two sides of a closed polygon that cross or touch, neighbours in their common corner excepted.
pub(crate) fn meeting_sides(points: &[[f64; 2]]) -> Option<(usize, usize)> {
    let all: Vec<_> = sides(points).collect();
    let [low, high] = bounding_box(points);
    let tolerance = MERGE_TOLERANCE * distance(low, high);
    let tree = SideTree::of(all.clone());
    for (i, &a) in all.iter().enumerate() {
        if distance(a[0], a[1]) <= tolerance {
            return Some((i, i));
        }
        for j in tree.near(&a, tolerance).into_iter().filter(|j| *j > i) {
            let b = all[j];
            let meets = match (j == i + 1, i == 0 && j + 1 == all.len()) {
                (true, _) => folds_back(a, b[1], tolerance),
                (_, true) => folds_back(b, a[1], tolerance),
                _ => sides_touch(a, b, tolerance),
            };
            if meets {
                return Some((i, j));
            }
        }
    }
    None
}

/// Whether the side after `side`, which ends at `next`, runs back over it.
fn folds_back(side: [[f64; 2]; 2], next: [f64; 2], tolerance: f64) -> bool {
    let ahead = [side[1], next];
    nearest_on_side(side, next).distance <= tolerance || nearest_on_side(ahead, side[0]).distance <= tolerance
}

/// Whether two segments cross or touch.
pub(crate) fn sides_touch(a: [[f64; 2]; 2], b: [[f64; 2]; 2], tolerance: f64) -> bool {
    let [a_low, a_high] = bounding_box(&a);
    let [b_low, b_high] = bounding_box(&b);
    if (0..2).any(|i| a_low[i] > b_high[i] + tolerance || b_low[i] > a_high[i] + tolerance) {
        return false;
    }
    let side_of = |[from, to]: [[f64; 2]; 2], point| turn(from, to, point);
    let crosses = side_of(a, b[0]) * side_of(a, b[1]) < 0.0 && side_of(b, a[0]) * side_of(b, a[1]) < 0.0;
    let near = |s, p| nearest_on_side(s, p).distance <= tolerance;
    crosses || near(a, b[0]) || near(a, b[1]) || near(b, a[0]) || near(b, a[1])
}
