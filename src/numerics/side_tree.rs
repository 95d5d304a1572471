//! Sides of polygons in a tree of their boxes: which may meet one, and whether a point lies inside, without a look at all of them.
//!
//! What is found is what looking at all finds, to the last bit: the tree only leaves out sides of which boxes tell that they do not matter.

use super::planar_domain::{PlanarDomain, Ring};
use super::polygon::{MERGE_TOLERANCE, bounding_box, crosses_ray, distance, distance_to_segment, sides, sides_touch};
use rstar::primitives::{GeomWithData, Line};
use rstar::{AABB, RTree};

type Side = [[f64; 2]; 2];

/// Sides up to which looking at all is as fast.
const FEW: usize = 32;

/// By how much boxes are widened, over the extent of all: far more than what the round-off of what is asked can reach.
const MARGIN: f64 = 1e-9;

/// Sides by their boxes.
#[derive(Debug)]
pub struct SideTree {
    sides: Vec<Side>,
    /// Empty if there are few.
    tree: RTree<GeomWithData<Line<[f64; 2]>, usize>>,
    right: f64,
    margin: f64,
    /// Length (µm) under which two points count as one.
    merged: f64,
}

impl SideTree {
    /// Of the sides of a closed polygon.
    pub fn of_ring(points: &[[f64; 2]]) -> Self {
        Self::of(sides(points).collect())
    }

    /// Of some sides.
    pub fn of(sides: Vec<Side>) -> Self {
        let [low, high] = bounding_box(sides.as_flattened());
        let line = |(place, [from, to]): (usize, &Side)| GeomWithData::new(Line::new(*from, *to), place);
        let lines = if sides.len() > FEW { sides.iter().enumerate().map(line).collect() } else { Vec::new() };
        let margin = MARGIN * (high[0] - low[0]).max(high[1] - low[1]);
        Self {
            tree: RTree::bulk_load(lines),
            right: high[0] + margin,
            margin,
            merged: MERGE_TOLERANCE * distance(low, high),
            sides,
        }
    }

    /// Places, ascending, of the sides whose boxes come within a reach (µm) of that of a side, and of some others.
    pub(crate) fn near(&self, side: &Side, reach: f64) -> Vec<usize> {
        if self.tree.size() == 0 {
            return (0..self.sides.len()).collect();
        }
        let ([low, high], reach) = (bounding_box(side), reach + self.margin);
        let around = AABB::from_corners(low.map(|x| x - reach), high.map(|x| x + reach));
        let mut places: Vec<usize> = self.tree.locate_in_envelope_intersecting(around).map(|line| line.data).collect();
        places.sort_unstable();
        places
    }

    /// A side by its place.
    pub(crate) fn side(&self, place: usize) -> Side {
        self.sides[place]
    }

    /// Whether a point lies within a reach (µm) of a side.
    pub fn pass(&self, point: [f64; 2], reach: f64) -> bool {
        self.near(&[point, point], reach).into_iter().any(|i| distance_to_segment(point, self.sides[i]) <= reach)
    }

    /// Whether a segment crosses or touches a side.
    pub(crate) fn touch(&self, side: [[f64; 2]; 2]) -> bool {
        self.near(&side, self.merged).into_iter().any(|i| sides_touch(side, self.sides[i], self.merged))
    }

    /// Whether no point of another polygon can be near one of this: their boxes tell.
    pub(crate) fn is_far_from(&self, other: &Self) -> bool {
        let [[low, high], [from, to]] = [self, other].map(|tree| bounding_box(tree.sides.as_flattened()));
        let reach = self.margin + other.margin;
        (0..2).any(|k| from[k] > high[k] + reach || low[k] > to[k] + reach)
    }

    /// Whether a point lies inside the polygon that the sides make (even–odd rule, as `ring_contains`).
    pub(crate) fn enclose(&self, point: [f64; 2]) -> bool {
        let crossings = if self.tree.size() == 0 {
            self.sides.iter().filter(|side| crosses_ray(side, point)).count()
        } else {
            let ray = AABB::from_corners([point[0] - self.margin, point[1]], [self.right, point[1]]);
            let met = self.tree.locate_in_envelope_intersecting(ray);
            met.filter(|line| crosses_ray(&self.sides[line.data], point)).count()
        };
        crossings % 2 == 1
    }
}

/// The inside of a domain.
#[derive(Debug)]
pub(crate) struct Inside {
    outer: SideTree,
    holes: Vec<SideTree>,
}

impl Inside {
    /// Of a domain.
    pub(crate) fn of(domain: &PlanarDomain) -> Self {
        let tree = |ring: &Ring| SideTree::of_ring(&ring.points);
        Self::within(tree(&domain.outer), domain.holes.iter().map(tree).collect())
    }

    /// Between a ring and holes.
    pub(crate) fn within(outer: SideTree, holes: Vec<SideTree>) -> Self {
        Self { outer, holes }
    }

    /// Whether a point lies inside the outer ring and in no hole.
    pub(crate) fn contains(&self, point: [f64; 2]) -> bool {
        self.is_in_outer_ring(point) && !self.holes.iter().any(|hole| hole.enclose(point))
    }

    /// Whether a point lies inside, or within a reach (µm) of the border.
    pub(crate) fn holds(&self, point: [f64; 2], reach: f64) -> bool {
        let in_hole = |hole: &SideTree| hole.enclose(point) && !hole.pass(point, reach);
        (self.outer.enclose(point) || self.outer.pass(point, reach)) && !self.holes.iter().any(in_hole)
    }

    /// Whether a point lies inside the outer ring.
    pub(crate) fn is_in_outer_ring(&self, point: [f64; 2]) -> bool {
        self.outer.enclose(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::polygon::ring_contains;

    /// A star of many points, whose sides lie close to one another and across each other's boxes.
    fn star(points: usize, turn: f64) -> Vec<[f64; 2]> {
        let corner = |i: usize| {
            let (angle, radius) = (turn + i as f64 / points as f64 * std::f64::consts::TAU, [50.0, 17.0][i % 2]);
            [3.0 + radius * angle.cos(), -2.0 + radius * angle.sin()]
        };
        (0..points).map(corner).collect()
    }

    #[test]
    fn a_border_is_held_up_to_the_reach_and_the_inside_of_a_hole_is_not() {
        let square = |low: f64, high: f64| SideTree::of_ring(&[[low, low], [high, low], [high, high], [low, high]]);
        let inside = Inside::within(square(0.0, 9.0), vec![square(3.0, 6.0)]);
        for (x, held) in
            [(-0.2, false), (-0.05, true), (1.0, true), (3.05, true), (3.2, false), (5.95, true), (9.05, true)]
        {
            assert_eq!(inside.holds([x, 4.5], 0.1), held, "{x}");
        }
    }

    #[test]
    fn what_is_inside_and_what_is_near_is_what_looking_at_all_sides_finds() {
        let (outer, hole) = (star(300, 0.1), star(100, 0.4).iter().map(|x| x.map(|x| 0.3 * x)).collect::<Vec<_>>());
        let ring = |points: &[[f64; 2]]| Ring { edges: vec![0; points.len()], points: points.to_vec() };
        let domain = PlanarDomain::new(ring(&outer), vec![ring(&hole)], vec!["wall".into()]);
        let inside = Inside::of(&domain);
        let mut points: Vec<[f64; 2]> =
            (0..3000).map(|i| [0.61 * f64::from(i), 0.37 * f64::from(i)].map(|x| (x % 110.0) - 53.0)).collect();
        // Where ties are: corners, the middles of sides, and points at the height of a corner.
        points.extend(&domain.outer.points);
        points.extend(sides(&domain.outer.points).map(|[a, b]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]));
        points.extend(domain.outer.points.iter().map(|corner| [0.0, corner[1]]));
        for point in points {
            assert_eq!(inside.contains(point), domain.contains(point), "{point:?}");
            assert_eq!(inside.is_in_outer_ring(point), ring_contains(&domain.outer.points, point), "{point:?}");
        }
        let all: Vec<Side> = sides(&outer).collect();
        let tree = SideTree::of(all.clone());
        for side in &all {
            let (reach, found) = (0.7, tree.near(side, 0.7));
            let apart = |other: &Side| {
                let ([low, high], [from, to]) = (bounding_box(side), bounding_box(other));
                (0..2).any(|k| from[k] > high[k] + reach || low[k] > to[k] + reach)
            };
            let near = (0..all.len()).filter(|place| !apart(&all[*place]));
            assert!(near.into_iter().all(|place| found.contains(&place)) && found.is_sorted());
            assert!(found.len() < 100, "{} of {}", found.len(), all.len());
        }
    }
}
