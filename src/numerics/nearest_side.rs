//! The side of an outline that lies nearest to a point, found through a tree of all sides.

use super::planar_domain::PlanarDomain;
use super::polygon::{nearest_on_side, sides};
use rstar::primitives::{GeomWithData, Line};
use rstar::{PointDistance, RTree};

/// By how much the tree's distance may differ from ours, relative.
const ROUND_OFF: f64 = 1e-9;

/// All sides of a domain, ring by ring.
#[derive(Debug)]
pub struct NearestSide {
    sides: Vec<[[f64; 2]; 2]>,
    edges: Vec<u16>,
    tree: RTree<GeomWithData<Line<[f64; 2]>, usize>>,
}

impl NearestSide {
    /// Of a domain.
    pub fn of(domain: &PlanarDomain) -> Self {
        let sides: Vec<_> = domain.rings().flat_map(|ring| sides(&ring.points)).collect();
        let edges = domain.rings().flat_map(|ring| ring.edges.iter().copied()).collect();
        let line = |(i, [from, to]): (usize, &[[f64; 2]; 2])| GeomWithData::new(Line::new(*from, *to), i);
        let tree = RTree::bulk_load(sides.iter().enumerate().map(line).collect());
        Self { sides, edges, tree }
    }

    /// Place of the side that lies nearest to a point (µm), in the order of rings and sides; the first one wins a tie. None where there is no
    /// side.
    pub fn place(&self, point: [f64; 2]) -> Option<usize> {
        let nearest = self.tree.nearest_neighbor(point)?;
        let reach = nearest.distance_2(&point) * (1.0 + ROUND_OFF) + f64::MIN_POSITIVE;
        let near = self.tree.locate_within_distance(point, reach).map(|side| side.data);
        let distance = |i: usize| nearest_on_side(self.sides[i], point).distance;
        near.map(|i| (distance(i), i)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, i)| i)
    }

    /// A side by its place.
    pub fn side(&self, place: usize) -> [[f64; 2]; 2] {
        self.sides[place]
    }

    /// Edge of the side that lies nearest to a point (µm); the first one wins a tie.
    pub fn edge_at(&self, point: [f64; 2]) -> u16 {
        self.place(point).map_or(0, |place| self.edges[place])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::planar_domain::{Outline, Ring};

    #[test]
    fn it_is_the_one_that_looking_at_all_sides_finds_and_the_first_of_two_as_near() {
        let disc = |radius: f64, side: f64| {
            let points = Outline::disc([3.0, -2.0], radius, side).points;
            Ring { edges: vec![0; points.len()], points }
        };
        let domain = PlanarDomain::new(disc(50.0, 1.5), vec![disc(20.0, 2.5)], vec!["wall".into()]);
        let nearest = NearestSide::of(&domain);
        let all: Vec<_> = domain.rings().flat_map(|ring| sides(&ring.points)).collect();
        for i in 0..400 {
            let (angle, radius) = (0.7 * f64::from(i), 0.15 * f64::from(i));
            let point = [3.0 + radius * angle.cos(), -2.0 + radius * angle.sin()];
            let distance = |i: &usize| nearest_on_side(all[*i], point).distance;
            let first = (0..all.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            assert_eq!(nearest.place(point), first, "{point:?}");
        }
        // Corners lie on two sides.
        for (i, [corner, _]) in all.iter().enumerate() {
            let distance = |i: &usize| nearest_on_side(all[*i], *corner).distance;
            let first = (0..all.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            assert_eq!(nearest.place(*corner), first, "corner {i}");
        }
    }
}
