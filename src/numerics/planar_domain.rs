//! Planar domains: closed polygons, polygons with named sides, and domains with holes.
//!
//! The outer ring runs counter-clockwise and the rings of holes clockwise, so the domain always lies to the *left* of a
//! side `i → i + 1`, and the inner normal of a side is its direction turned by +90°. Lengths are µm.

use std::f64::consts::PI;

use rstar::RTree;

use crate::numerics::polygon::{
    MERGE_TOLERANCE, NearestOnEdge, SideTree, bounding_box, cross, distance, dot, meeting_sides, minus,
    nearest_on_side, ring_contains, sides, signed_area,
};

/// Why a polygon or a domain was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DomainError {
    /// Fewer than three points.
    #[error("{ring} has {count} points; a polygon needs at least three")]
    TooFewPoints {
        /// Which polygon.
        ring: String,
        /// Points given.
        count: usize,
    },
    /// A coordinate is not finite.
    #[error("point {point} of {ring} is not finite")]
    NotFinite {
        /// Which polygon.
        ring: String,
        /// Index of the point.
        point: usize,
    },
    /// Two sides cross or touch, or a side has no length.
    #[error("{ring} is not simple: its sides {first} and {second} meet")]
    NotSimple {
        /// Which polygon.
        ring: String,
        /// Index of the first side.
        first: usize,
        /// Index of the second side.
        second: usize,
    },
    /// The polygon encloses nothing.
    #[error("{ring} has the area {area} µm²")]
    NoArea {
        /// Which polygon.
        ring: String,
        /// Its unsigned area (µm²).
        area: f64,
    },
    /// A ring does not name each of its sides, or names one by an index that has no name.
    #[error("{ring} has {sides} sides and {given} edge indices, of which the largest must be below {names}")]
    EdgeNames {
        /// Which ring.
        ring: String,
        /// Number of sides.
        sides: usize,
        /// Number of edge indices.
        given: usize,
        /// Number of edge names.
        names: usize,
    },
    /// A hole is not inside the outer ring.
    #[error("hole {hole} is not inside the domain at ({}, {}) µm", point[0], point[1])]
    HoleOutside {
        /// Index of the hole.
        hole: usize,
        /// A point of it that is not inside.
        point: [f64; 2],
    },
    /// Two holes overlap or touch.
    #[error("holes {first} and {second} overlap")]
    HolesOverlap {
        /// Index of one hole.
        first: usize,
        /// Index of the other.
        second: usize,
    },
}

/// A closed polygon without names: the shape of a source or of a target. The last point is joined to the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Corners (µm), counter-clockwise once normalised.
    pub points: Vec<[f64; 2]>,
}

impl Outline {
    /// A polygon from its corners, turned counter-clockwise.
    pub fn new(points: Vec<[f64; 2]>) -> Self {
        let mut outline = Self { points };
        if signed_area(&outline.points) < 0.0 {
            outline.points.reverse();
        }
        outline
    }

    /// The rectangle between two opposite corners (µm).
    pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Self {
        Self::new(vec![low, [high[0], low[1]], high, [low[0], high[1]]])
    }

    /// A disc, as the regular polygon of *equal area* πR² with `max(16, ⌈2πR / max_side⌉)` sides.
    ///
    /// `centre`, `radius` and `max_side` in µm. A corner lies at angle 0. Ours: equal area, so that the release of a disc
    /// source is exact whatever the mesh.
    pub fn disc(centre: [f64; 2], radius: f64, max_side: f64) -> Self {
        let wanted = (2.0 * PI * radius / max_side).ceil();
        let sides = if wanted.is_finite() { (wanted as usize).clamp(16, 1 << 16) } else { 16 };
        let step = 2.0 * PI / sides as f64;
        let corner_radius = radius * (step / step.sin()).sqrt();
        let corner = |i: usize| {
            let (sine, cosine) = (step * i as f64).sin_cos();
            [centre[0] + corner_radius * cosine, centre[1] + corner_radius * sine]
        };
        Self::new((0..sides).map(corner).collect())
    }

    /// Enclosed area (µm²), never negative.
    pub fn area(&self) -> f64 {
        signed_area(&self.points).abs()
    }

    /// Whether a point lies inside (even–odd rule; points on a side may fall either way).
    pub fn contains(&self, point: [f64; 2]) -> bool {
        ring_contains(&self.points, point)
    }

    /// Smallest and largest coordinates (µm).
    pub fn bounding_box(&self) -> [[f64; 2]; 2] {
        bounding_box(&self.points)
    }

    /// Checks that the outline is a simple polygon that encloses an area. `name` stands in the error.
    ///
    /// # Errors
    /// Too few points, a point that is not finite, sides that meet, no area.
    pub fn check(&self, name: &str) -> Result<(), DomainError> {
        check_ring(&self.points, name)
    }

    /// Whether no two sides meet, except neighbours in their common corner.
    pub fn is_simple(&self) -> bool {
        meeting_sides(&self.points).is_none()
    }
}

/// A closed polygon whose sides carry the index of a named edge.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    /// Corners (µm).
    pub points: Vec<[f64; 2]>,
    /// For the side `i → i + 1`, the index of its edge in [`PlanarDomain::edge_names`].
    pub edges: Vec<u16>,
}

impl Ring {
    fn turned(mut self, counter_clockwise: bool) -> Self {
        if (signed_area(&self.points) < 0.0) == counter_clockwise {
            self.points.reverse();
            self.edges.reverse();
            if !self.edges.is_empty() {
                self.edges.rotate_left(1);
            }
        }
        self
    }
}

/// A corner of a domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where (µm).
    pub point: [f64; 2],
    /// The angle inside (radians).
    pub angle: f64,
    /// Distance to the nearest other corner of the domain (µm).
    pub room: f64,
}

/// A polygonal domain with holes and named edges.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarDomain {
    /// The outer ring, counter-clockwise.
    pub outer: Ring,
    /// Holes, each clockwise.
    pub holes: Vec<Ring>,
    /// Names of the edges; several sides, also of several rings, may make one edge.
    pub edge_names: Vec<String>,
    /// Points inside that a mesh shall have as vertices (µm): given any, it is filled by these. Those outside do no harm.
    pub vertices: Vec<[f64; 2]>,
}

impl PlanarDomain {
    /// A domain from its rings, the outer turned counter-clockwise and holes clockwise. Call [`Self::check`] before use.
    pub fn new(outer: Ring, holes: Vec<Ring>, edge_names: Vec<String>) -> Self {
        let holes = holes.into_iter().map(|hole| hole.turned(false)).collect();
        Self { outer: outer.turned(true), holes, edge_names, vertices: Vec::new() }
    }

    /// The rectangle `(0, width) × (0, height)` with the edges `bottom`, `right`, `top`, `left` (0 to 3).
    pub fn rectangle(width: f64, height: f64) -> Self {
        let points = vec![[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        let edge_names = ["bottom", "right", "top", "left"].map(String::from).to_vec();
        Self { outer: Ring { points, edges: vec![0, 1, 2, 3] }, holes: Vec::new(), edge_names, vertices: Vec::new() }
    }

    /// Outer ring and holes, in this order.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        std::iter::once(&self.outer).chain(&self.holes)
    }

    /// Area without the holes (µm²).
    pub fn area(&self) -> f64 {
        let holes: f64 = self.holes.iter().map(|hole| signed_area(&hole.points).abs()).sum();
        signed_area(&self.outer.points).abs() - holes
    }

    /// Smallest and largest coordinates (µm).
    pub fn bounding_box(&self) -> [[f64; 2]; 2] {
        bounding_box(&self.outer.points)
    }

    /// Corners at which the angle inside exceeds π by more than `least` (radians).
    pub fn reentrant_corners(&self, least: f64) -> Vec<Corner> {
        let corners = self.rings().flat_map(|ring| {
            let (points, count) = (&ring.points, ring.points.len());
            (0..count).map(move |i| {
                let [before, point, after] = [i + count - 1, i, i + 1].map(|k| points[k % count]);
                let (into, out) = (minus(point, before), minus(after, point));
                (point, PI - cross(into, out).atan2(dot(into, out)))
            })
        });
        let wide: Vec<_> = corners.filter(|(_, angle)| *angle > PI + least).collect();
        if wide.is_empty() {
            return Vec::new();
        }
        let tree = RTree::bulk_load(self.rings().flat_map(|ring| ring.points.iter().copied()).collect());
        let room = |point| tree.nearest_neighbor_iter(point).nth(1).map_or(0.0, |other| distance(point, *other));
        wide.into_iter().map(|(point, angle)| Corner { point, angle, room: room(point) }).collect()
    }

    /// Length of the bounding box's diagonal (µm): the scale of tolerances.
    pub fn diameter(&self) -> f64 {
        let [low, high] = self.bounding_box();
        distance(low, high)
    }

    /// Whether a point lies inside the outer ring and in no hole.
    pub fn contains(&self, point: [f64; 2]) -> bool {
        ring_contains(&self.outer.points, point) && !self.holes.iter().any(|hole| ring_contains(&hole.points, point))
    }

    /// Checks that the domain can be meshed.
    ///
    /// # Errors
    /// A ring that is not simple, not finite, without area, or with missing edge indices; a hole outside the outer ring;
    /// two holes that overlap.
    pub fn check(&self) -> Result<(), DomainError> {
        self.check_named(&self.outer, "the outer ring".into())?;
        let (outer, mut before) = (SideTree::of_ring(&self.outer.points), Vec::new());
        for (index, hole) in self.holes.iter().enumerate() {
            self.check_named(hole, format!("hole {index}"))?;
            let tree = SideTree::of_ring(&hole.points);
            self.check_hole(index, &tree, (&outer, &before))?;
            before.push(tree);
        }
        Ok(())
    }

    fn check_named(&self, ring: &Ring, name: String) -> Result<(), DomainError> {
        check_ring(&ring.points, &name)?;
        let names = self.edge_names.len();
        if ring.edges.len() != ring.points.len() || ring.edges.iter().any(|&edge| edge as usize >= names) {
            let (sides, given) = (ring.points.len(), ring.edges.len());
            return Err(DomainError::EdgeNames { ring: name, sides, given, names });
        }
        Ok(())
    }

    fn check_hole(
        &self,
        index: usize,
        tree: &SideTree,
        (outer, before): (&SideTree, &[SideTree]),
    ) -> Result<(), DomainError> {
        let points = &self.holes[index].points;
        if let Some(&point) = points.iter().find(|point| !outer.enclose(**point)) {
            return Err(DomainError::HoleOutside { hole: index, point });
        }
        if let Some(side) = sides(points).find(|side| outer.touch(*side)) {
            return Err(DomainError::HoleOutside { hole: index, point: side[0] });
        }
        for (first, other) in before.iter().enumerate().filter(|(_, other)| !tree.is_far_from(other)) {
            let nested = other.enclose(points[0]) || tree.enclose(self.holes[first].points[0]);
            if nested || sides(points).any(|side| other.touch(side)) {
                return Err(DomainError::HolesOverlap { first, second: index });
            }
        }
        Ok(())
    }

    /// The nearest point of edge `edge` to a point (µm), over all its sides; the first side wins a tie. `None` if no side
    /// has this edge.
    pub fn nearest_on_edge(&self, edge: u16, point: [f64; 2]) -> Option<NearestOnEdge> {
        let mut best: Option<NearestOnEdge> = None;
        for ring in self.rings() {
            for (side, _) in sides(&ring.points).zip(&ring.edges).filter(|(_, e)| **e == edge) {
                let candidate = nearest_on_side(side, point);
                if best.is_none_or(|best| candidate.distance < best.distance) {
                    best = Some(candidate);
                }
            }
        }
        best
    }
}

fn check_ring(points: &[[f64; 2]], name: &str) -> Result<(), DomainError> {
    let ring = || name.to_string();
    if points.len() < 3 {
        return Err(DomainError::TooFewPoints { ring: ring(), count: points.len() });
    }
    if let Some(point) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(DomainError::NotFinite { ring: ring(), point });
    }
    let [low, high] = bounding_box(points);
    let area = signed_area(points).abs();
    if area.is_nan() || area <= MERGE_TOLERANCE * distance(low, high).powi(2) {
        return Err(DomainError::NoArea { ring: ring(), area });
    }
    match meeting_sides(points) {
        Some((first, second)) => Err(DomainError::NotSimple { ring: ring(), first, second }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::nearest_side::NearestSide;
    use crate::numerics::polygon::{dot, minus};

    fn named(points: &[[f64; 2]]) -> Ring {
        Ring { points: points.to_vec(), edges: vec![0; points.len()] }
    }

    fn square(low: f64, high: f64) -> Ring {
        named(&[[low, low], [high, low], [high, high], [low, high]])
    }

    fn domain(outer: Ring, holes: Vec<Ring>) -> PlanarDomain {
        PlanarDomain::new(outer, holes, vec!["wall".into()])
    }

    #[test]
    fn a_disc_has_the_area_of_its_circle_whatever_its_sides() {
        for (radius, side, count) in [(30.0, 15.0, 16), (50.0, 15.0, 21), (3.0, 0.01, 1885)] {
            let disc = Outline::disc([400.0, 500.0], radius, side);
            assert_eq!(disc.points.len(), count);
            assert!((disc.area() / (PI * radius * radius) - 1.0).abs() < 1e-12);
            assert!(disc.is_simple() && disc.contains([400.0, 500.0]) && !disc.contains([400.0, 500.0 + 1.1 * radius]));
        }
    }

    #[test]
    fn turning_a_ring_keeps_the_name_of_each_side() {
        let clockwise = Ring { points: vec![[0.0, 0.0], [0.0, 1.0], [2.0, 1.0], [2.0, 0.0]], edges: vec![3, 2, 1, 0] };
        let names = ["bottom", "right", "top", "left"].map(String::from).to_vec();
        let domain = PlanarDomain::new(clockwise, Vec::new(), names);
        assert!(signed_area(&domain.outer.points) > 0.0);
        for (point, edge) in [([1.0, 0.1], 0), ([1.9, 0.5], 1), ([1.0, 0.9], 2), ([0.1, 0.5], 3)] {
            assert_eq!(NearestSide::of(&domain).edge_at(point), edge);
            let nearest = domain.nearest_on_edge(edge, point).unwrap();
            assert!((nearest.distance - 0.1).abs() < 1e-15);
            let inward = minus(point, nearest.point);
            assert!((dot(inward, nearest.inner_normal) - 0.1).abs() < 1e-15);
        }
        assert_eq!(domain.nearest_on_edge(7, [1.0, 0.5]), None);
    }

    #[test]
    fn a_bow_tie_a_fold_and_a_flat_polygon_are_refused() {
        let bow_tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.5]];
        let refused = domain(named(&bow_tie), Vec::new()).check();
        assert!(matches!(refused, Err(DomainError::NotSimple { .. })), "{refused:?}");
        let fold = Outline::new(vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 0.5], [0.0, 1.0]]);
        assert!(matches!(fold.check("a"), Err(DomainError::NotSimple { .. })));
        let flat = Outline::new(vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]);
        assert!(matches!(flat.check("a"), Err(DomainError::NoArea { .. })));
        let infinite = Outline::new(vec![[0.0, 0.0], [f64::NAN, 1.0], [2.0, 2.0]]);
        assert!(matches!(infinite.check("a"), Err(DomainError::NotFinite { point: 1, .. })));
    }

    #[test]
    fn holes_must_lie_inside_and_apart() {
        let good = domain(square(0.0, 10.0), vec![square(1.0, 3.0), square(4.0, 6.0)]);
        assert_eq!(good.check(), Ok(()));
        assert!((good.area() - 92.0).abs() < 1e-12 && !good.contains([2.0, 2.0]) && good.contains([3.5, 2.0]));
        let crossing = domain(square(0.0, 10.0), vec![square(8.0, 12.0)]).check();
        assert!(matches!(crossing, Err(DomainError::HoleOutside { hole: 0, .. })));
        let nested = domain(square(0.0, 10.0), vec![square(1.0, 6.0), square(2.0, 3.0)]).check();
        assert_eq!(nested, Err(DomainError::HolesOverlap { first: 0, second: 1 }));
        let touching = domain(square(0.0, 10.0), vec![square(0.0, 3.0)]).check();
        assert!(matches!(touching, Err(DomainError::HoleOutside { .. })));
    }

    #[test]
    fn re_entrant_corners_are_those_of_an_ell_and_of_holes_with_the_room_around_them() {
        let ell = named(&[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [1.0, 3.0], [1.0, 4.0], [0.0, 4.0]]);
        let found = domain(ell, Vec::new()).reentrant_corners(0.1);
        assert_eq!(found, vec![Corner { point: [1.0, 3.0], angle: 1.5 * PI, room: 1.0 }]);
        let hexagon = |x: f64| -> Vec<[f64; 2]> {
            (0..6).map(|i| PI / 3.0 * f64::from(i)).map(|turn| [x + turn.cos(), turn.sin()]).collect()
        };
        // A third hole comes nearer to one corner than its sides are long.
        let dot = named(&[[2.2, -0.1], [2.4, -0.1], [2.4, 0.1], [2.2, 0.1]]);
        let holes = vec![named(&hexagon(-0.4)), named(&hexagon(3.8)), dot];
        let found = domain(square(-9.0, 9.0), holes).reentrant_corners(0.1);
        assert_eq!(found.len(), 16);
        for corner in &found[..12] {
            let room = if distance(corner.point, [2.8, 0.0]) < 1e-9 { 0.4f64.hypot(0.1) } else { 1.0 };
            assert!((corner.angle - 4.0 / 3.0 * PI).abs() < 1e-12 && (corner.room - room).abs() < 1e-12, "{corner:?}");
        }
        assert!(found[12..].iter().all(|corner| (corner.room - 0.2).abs() < 1e-12));
        assert_eq!(domain(square(0.0, 1.0), Vec::new()).reentrant_corners(0.0), Vec::new());
        // A circle of many sides has none.
        let circle = Outline::disc([0.0, 0.0], 1.0, 0.05);
        assert_eq!(domain(square(-9.0, 9.0), vec![named(&circle.points)]).reentrant_corners(0.1), Vec::new());
    }

    #[test]
    fn an_edge_without_a_name_is_refused() {
        let mut unnamed = domain(square(0.0, 1.0), Vec::new());
        unnamed.outer.edges[2] = 5;
        assert!(matches!(unnamed.check(), Err(DomainError::EdgeNames { names: 1, .. })));
    }
}
