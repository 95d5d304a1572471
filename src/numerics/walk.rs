//! How material points walk through the tissue.
//!
//! [`walk`] moves a [`MaterialPoint`] along a straight line of the *current* configuration, from face to face. Along a displacement `d` the
//! weights change at the constant rates `r_i = ∇λ_i · d`, so the line leaves the cell through the face with the smallest
//! `λ_i / (−r_i)`.
//!
//! Where the line passes through a vertex or an edge of the mesh, or meets the border, all cells around the point are asked
//! which of them the direction enters. At the border the directions asked are, from longest to shortest, `d` and its
//! projections on the border facets (and, in space, on their common lines) there: so sliding follows straight borders,
//! turns round re-entrant corners, and stops in convex ones. Points never leave the mesh.

use crate::numerics::coordinates::AtVertices;
use crate::numerics::locate::{MaterialPoint, Weights};
use crate::numerics::simplex_mesh::{BORDER, SimplexMesh};
use crate::numerics::vector::{dot, norm, without};

/// Weights below this count as zero: the point lies on the face.
const ON_FACE: f64 = 1e-13;

/// Shares of the displacement below this count as used up.
const SPENT: f64 = 1e-14;

/// Rates below this, relative to |∇λ||d|, count as parallel to the face.
const PARALLEL: f64 = 1e-12;

/// What happens where the way leads out of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BorderRule {
    /// The rest of the displacement is projected on the border, and the point goes on along it.
    Slide,
    /// The walk ends at the crossing point.
    Stop,
}

/// Where a walk ends before its displacement is used up.
#[derive(Debug, Clone, Copy)]
pub struct WalkRules<F> {
    /// What happens at the border.
    pub border: BorderRule,
    /// The walk ends on entering a cell for which this is true; the cell of the start does not count.
    pub stop_at: F,
}

/// Rules without a place to stop at.
pub fn nowhere(border: BorderRule) -> WalkRules<fn(u32) -> bool> {
    WalkRules { border, stop_at: |_| false }
}

/// How a walk ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WalkEnd {
    /// The displacement is used up.
    Reached,
    /// At the border: with [`BorderRule::Stop`] at the crossing, with [`BorderRule::Slide`] stuck in a corner (or head-on).
    Border {
        /// The cell that the border facet belongs to.
        cell: u32,
        /// The local vertex opposite the facet.
        face: u8,
    },
    /// On entering this cell, for which `stop_at` is true.
    Entered(u32),
}

/// The result of a walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk<const D: usize> {
    /// Where it ended.
    pub point: MaterialPoint<D>,
    /// Share of the displacement used, 1 if all.
    pub travelled: f64,
    /// Why it ended.
    pub end: WalkEnd,
}

/// Why a walk was impossible.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WalkError {
    /// The displacement or a weight is not finite.
    #[error("the walk from cell {cell} has a displacement or weights that are not finite")]
    NotFinite {
        /// The cell of the start.
        cell: u32,
    },
    /// The start is not in the mesh.
    #[error("there is no cell {cell} among {count}")]
    NoSuchCell {
        /// The cell named.
        cell: u32,
        /// Number of cells.
        count: usize,
    },
    /// A cell on the way is flat or inside out in this configuration.
    #[error("cell {cell} has the signed volume {volume} in this configuration")]
    Inverted {
        /// The cell.
        cell: u32,
        /// Its signed volume.
        volume: f64,
    },
    /// The way went through more cells than there are; the coordinates do not make a mesh.
    #[error("the walk was given up in cell {cell} after {hops} hops")]
    Lost {
        /// The cell reached.
        cell: u32,
        /// Cells passed.
        hops: usize,
    },
}

/// Walks from a material point along a straight displacement (µm) of the configuration `coordinates` (one entry a vertex, µm).
///
/// In any configuration with positive volumes the result lies in the mesh, with weights in `[0, 1]`.
///
/// # Errors
/// A start that is not in the mesh, values that are not finite, a cell without positive volume.
pub fn walk<const D: usize>(
    mesh: &SimplexMesh<D>,
    coordinates: &(impl AtVertices<D> + ?Sized),
    from: MaterialPoint<D>,
    displacement: [f64; D],
    rules: &WalkRules<impl Fn(u32) -> bool>,
) -> Result<Walk<D>, WalkError> {
    if from.cell as usize >= mesh.cell_count() {
        return Err(WalkError::NoSuchCell { cell: from.cell, count: mesh.cell_count() });
    }
    if !displacement.iter().chain(&from.weights).all(|x| x.is_finite()) {
        return Err(WalkError::NotFinite { cell: from.cell });
    }
    let mut walker = Walker {
        mesh,
        coordinates,
        wanted: displacement,
        heading: displacement,
        cell: from.cell,
        weights: from.all_weights(),
        entry: None,
        left: 1.0,
    };
    let limit = 64 + 4 * mesh.cell_count();
    for _ in 0..limit {
        let (gradients, _) = walker.gradients(walker.cell)?;
        if walker.advance(&gradients).is_none() {
            return Ok(walker.ended(WalkEnd::Reached));
        }
        let before = walker.cell;
        if let Some(end) = walker.turn(rules.border)? {
            return Ok(walker.ended(end));
        }
        if walker.cell != before && (rules.stop_at)(walker.cell) {
            return Ok(walker.ended(WalkEnd::Entered(walker.cell)));
        }
    }
    Err(WalkError::Lost { cell: walker.cell, hops: limit })
}

struct Walker<'a, const D: usize, C: ?Sized> {
    mesh: &'a SimplexMesh<D>,
    coordinates: &'a C,
    wanted: [f64; D],
    heading: [f64; D],
    cell: u32,
    weights: Weights,
    /// The face just entered through: the line cannot leave by it.
    entry: Option<usize>,
    left: f64,
}

/// A cell around the walker's point, with the point's weights in it.
struct Incident<const D: usize> {
    cell: u32,
    weights: Weights,
    gradients: [[f64; D]; 4],
}

impl<const D: usize> Incident<D> {
    /// Whether a step along `heading` stays in the cell: no weight that is zero decreases.
    fn admits(&self, heading: &[f64; D]) -> bool {
        let speed = norm(heading);
        (0..=D).filter(|&i| self.weights[i] <= ON_FACE).all(|i| {
            let gradient = &self.gradients[i];
            dot(gradient, heading) >= -PARALLEL * norm(gradient) * speed
        })
    }
}

/// A border facet at the walker's point.
struct Wall<const D: usize> {
    cell: u32,
    face: u8,
    outward: [f64; D],
}

impl<const D: usize, C: AtVertices<D> + ?Sized> Walker<'_, D, C> {
    fn gradients(&self, cell: u32) -> Result<([[f64; D]; 4], f64), WalkError> {
        let mut gradients = [[0.0; D]; 4];
        let volume = self.mesh.barycentric_gradients(self.coordinates, cell as usize, &mut gradients[..=D]);
        if volume > 0.0 { Ok((gradients, volume)) } else { Err(WalkError::Inverted { cell, volume }) }
    }

    fn ended(&self, end: WalkEnd) -> Walk<D> {
        let travelled = if end == WalkEnd::Reached { 1.0 } else { (1.0 - self.left).clamp(0.0, 1.0) };
        Walk { point: MaterialPoint::from_weights(self.cell, &self.weights), travelled, end }
    }

    /// Goes on in the cell until a face is met, `None` if the displacement ends before.
    fn advance(&mut self, gradients: &[[f64; D]; 4]) -> Option<usize> {
        let speed = norm(&self.heading);
        let mut rates = [0.0; 4];
        let mut exit: Option<(f64, usize)> = None;
        for i in 0..=D {
            rates[i] = dot(&gradients[i], &self.heading);
            let parallel = rates[i] >= -PARALLEL * norm(&gradients[i]) * speed;
            if parallel || self.entry == Some(i) {
                continue;
            }
            let share = self.weights[i].max(0.0) / -rates[i];
            if exit.is_none_or(|(best, _)| share < best) {
                exit = Some((share, i));
            }
        }
        let reached = exit.filter(|(share, _)| self.left - *share > SPENT);
        let share = reached.map_or(self.left, |(share, _)| share);
        (0..=D).for_each(|i| self.weights[i] = (self.weights[i] + share * rates[i]).max(0.0));
        self.left -= share;
        reached.map(|(_, face)| {
            self.weights[face] = 0.0;
            face
        })
    }

    /// Decides where to go from a point on faces of the cell: the end of the walk, if there is one.
    fn turn(&mut self, border: BorderRule) -> Result<Option<WalkEnd>, WalkError> {
        let mut zero = (0..=D).filter(|&i| self.weights[i] <= ON_FACE);
        if let (Some(face), None) = (zero.next(), zero.next())
            && self.mesh.neighbour(self.cell as usize, face) != BORDER
        {
            let (cell, weights, entry) = self.across(self.cell, &self.weights, face);
            (self.cell, self.weights, self.entry) = (cell, weights, Some(entry));
            return Ok(None);
        }
        let around = self.cells_around()?;
        let walls = self.walls(&around);
        let mut headings = vec![self.wanted];
        if border == BorderRule::Slide {
            headings.extend(slides(&self.wanted, &walls));
            headings.sort_by(|a, b| norm(b).total_cmp(&norm(a)));
        }
        let shortest = PARALLEL * norm(&self.wanted);
        for heading in headings.iter().filter(|heading| norm(heading) > shortest) {
            if let Some(place) = around.iter().find(|place| place.admits(heading)) {
                (self.cell, self.weights, self.heading) = (place.cell, place.weights, *heading);
                self.entry = None;
                return Ok(None);
            }
        }
        let push = |wall: &Wall<D>| dot(&wall.outward, &self.wanted);
        let hardest = walls.iter().max_by(|a, b| push(a).total_cmp(&push(b)));
        match hardest {
            Some(wall) => Ok(Some(WalkEnd::Border { cell: wall.cell, face: wall.face })),
            None => Err(WalkError::Lost { cell: self.cell, hops: 0 }),
        }
    }

    /// The cell across a face, the same point's weights there, and the face's number there.
    fn across(&self, cell: u32, weights: &Weights, face: usize) -> (u32, Weights, usize) {
        let next = self.mesh.neighbour(cell as usize, face);
        let corners = self.mesh.cell(cell as usize);
        let mut there = [0.0; 4];
        let mut entry = 0;
        for (j, vertex) in self.mesh.cell(next as usize).iter().enumerate() {
            match (0..=D).find(|&i| i != face && corners[i] == *vertex) {
                Some(i) => there[j] = weights[i],
                None => entry = j,
            }
        }
        (next, there, entry)
    }

    /// All cells that contain the point, in the order in which they are reached over its faces.
    fn cells_around(&self) -> Result<Vec<Incident<D>>, WalkError> {
        let (gradients, _) = self.gradients(self.cell)?;
        let mut around = vec![Incident { cell: self.cell, weights: self.weights, gradients }];
        let mut next = 0;
        while next < around.len() {
            let (cell, weights) = (around[next].cell, around[next].weights);
            next += 1;
            for face in (0..=D).filter(|&i| weights[i] <= ON_FACE) {
                let other = self.mesh.neighbour(cell as usize, face);
                if other != BORDER && !around.iter().any(|place| place.cell == other) {
                    let (cell, weights, _) = self.across(cell, &weights, face);
                    let (gradients, _) = self.gradients(cell)?;
                    around.push(Incident { cell, weights, gradients });
                }
            }
        }
        Ok(around)
    }

    /// The border facets that contain the point.
    fn walls(&self, around: &[Incident<D>]) -> Vec<Wall<D>> {
        let mut walls = Vec::new();
        for place in around {
            for face in (0..=D).filter(|&i| place.weights[i] <= ON_FACE) {
                if self.mesh.neighbour(place.cell as usize, face) == BORDER {
                    let gradient = &place.gradients[face];
                    let outward = gradient.map(|g| -g / norm(gradient));
                    walls.push(Wall { cell: place.cell, face: face as u8, outward });
                }
            }
        }
        walls
    }
}

/// Projections of `wanted` on the walls that it runs into, and in space on the lines where two of them meet.
fn slides<const D: usize>(wanted: &[f64; D], walls: &[Wall<D>]) -> Vec<[f64; D]> {
    let mut found = Vec::new();
    for (i, first) in walls.iter().enumerate() {
        found.push(without(*wanted, &[first.outward]));
        for second in walls[..i].iter().filter(|_| D > 2) {
            let across = without(second.outward, &[first.outward]);
            let length = norm(&across);
            if length > 1e-6 {
                found.push(without(*wanted, &[first.outward, across.map(|x| x / length)]));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::locate::SeedGrid;
    use crate::numerics::planar_domain::{Outline, PlanarDomain, Ring};
    use crate::numerics::simplex_mesh::structured_rectangle;
    use crate::numerics::triangulate::{MeshOptions, triangulate};

    fn far<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
        (0..D).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    }

    /// The unit cube, `n³` cubes of six tetrahedra (Kuhn), which share the cube's diagonal.
    fn cube(n: usize) -> SimplexMesh<3> {
        let m = n + 1;
        let at = |i: [usize; 3]| (i[0] + m * (i[1] + m * i[2])) as u32;
        let grid = |count: usize| {
            (0..count.pow(3)).map(move |flat| [flat % count, flat / count % count, flat / (count * count)])
        };
        let vertices = grid(m).map(|i| i.map(|i| i as f64 / n as f64)).collect();
        let mut cells = Vec::new();
        for low in grid(n) {
            for (axes, even) in [
                ([0, 1, 2], true),
                ([1, 2, 0], true),
                ([2, 0, 1], true),
                ([1, 0, 2], false),
                ([0, 2, 1], false),
                ([2, 1, 0], false),
            ] {
                let mut corner = low;
                let mut path = vec![at(corner)];
                for axis in axes {
                    corner[axis] += 1;
                    path.push(at(corner));
                }
                if !even {
                    path.swap(1, 2);
                }
                cells.extend(path);
            }
        }
        SimplexMesh::new(vertices, cells).unwrap()
    }

    /// An L: the square (0, 2)² without its upper right quarter, and a hole of twelve corners.
    fn l_shape() -> SimplexMesh<2> {
        let outer = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let hole = Outline::disc([0.5, 0.5], 0.2, 0.1).points;
        let ring = |points: Vec<[f64; 2]>| Ring { edges: vec![0; points.len()], points };
        let domain = PlanarDomain::new(ring(outer), vec![ring(hole)], vec!["wall".into()]);
        triangulate(&domain, &[], &MeshOptions::of_size(0.1)).unwrap().mesh
    }

    fn inside_l([x, y]: [f64; 2]) -> bool {
        let e = 1e-12;
        x >= -e && y >= -e && x <= 2.0 + e && y <= 2.0 + e && (x <= 1.0 + e || y <= 1.0 + e)
    }

    fn valid<const D: usize>(point: &MaterialPoint<D>) -> bool {
        point.weights.iter().all(|w| (0.0..=1.0).contains(w)) && point.weights.iter().sum::<f64>() <= 1.0 + 1e-15
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

        #[test]
        fn a_walk_inside_ends_where_the_straight_line_ends_and_comes_back(
            a in [0.0..1.0f64, 0.0..1.0], b in [0.0..1.0f64, 0.0..1.0], shear in -0.8..0.8f64,
        ) {
            let mesh = structured_rectangle(1.0, 1.0, 9, 7).unwrap();
            let map = |[x, y]: [f64; 2]| [1.4 * x + shear * y, 0.77 * y + 0.1 * x];
            let now: Vec<_> = mesh.vertices().iter().map(|&x| map(x)).collect();
            let grid = SeedGrid::new(&mesh, &now);
            let (a, b) = (map(a), map(b));
            let start = grid.locate(&mesh, &now, a).unwrap();
            prop_assert!(far(start.position(&mesh, &now), a) < 1e-12);
            let there = walk(&mesh, &now, start, [b[0] - a[0], b[1] - a[1]], &nowhere(BorderRule::Stop)).unwrap();
            prop_assert_eq!(there.end, WalkEnd::Reached);
            prop_assert!(valid(&there.point));
            prop_assert!(far(there.point.position(&mesh, &now), b) < 1e-12);
            let back = walk(&mesh, &now, there.point, [a[0] - b[0], a[1] - b[1]], &nowhere(BorderRule::Slide)).unwrap();
            prop_assert!(far(back.point.position(&mesh, &now), a) < 2e-12);
        }

        #[test]
        fn walks_between_grid_vertices_pass_through_vertices_and_along_faces(
            a in (0usize..8, 0usize..6), b in (0usize..8, 0usize..6), cell in 0usize..70,
        ) {
            let mesh = structured_rectangle(7.0, 5.0, 7, 5).unwrap();
            let x = mesh.vertices();
            let (from, to) = (x[a.1 * 8 + a.0], x[b.1 * 8 + b.0]);
            let start = SeedGrid::new(&mesh, x).locate(&mesh, x, from).unwrap();
            let there = walk(&mesh, x, start, [to[0] - from[0], to[1] - from[1]], &nowhere(BorderRule::Stop)).unwrap();
            prop_assert_eq!(there.end, WalkEnd::Reached);
            prop_assert!(far(there.point.position(&mesh, x), to) < 1e-12);
            let on_face = MaterialPoint { cell: cell as u32, weights: [0.0, 0.4] };
            let at = on_face.position(&mesh, x);
            let there = walk(&mesh, x, on_face, [to[0] - at[0], to[1] - at[1]], &nowhere(BorderRule::Stop)).unwrap();
            prop_assert!(far(there.point.position(&mesh, x), to) < 1e-12);
        }

        #[test]
        fn walks_in_space_pass_through_diagonals_and_stay_inside(
            a in [0usize..4, 0..4, 0..4], b in [0usize..4, 0..4, 0..4], d in [-2.0..2.0f64, -2.0..2.0, -2.0..2.0],
        ) {
            let mesh = cube(3);
            let x = mesh.vertices();
            let place = |i: [usize; 3]| i.map(|i| i as f64 / 3.0);
            let start = SeedGrid::new(&mesh, x).locate(&mesh, x, place(a)).unwrap();
            let line = std::array::from_fn(|k| place(b)[k] - place(a)[k]);
            let there = walk(&mesh, x, start, line, &nowhere(BorderRule::Stop)).unwrap();
            prop_assert!(far(there.point.position(&mesh, x), place(b)) < 1e-12);
            let slid = walk(&mesh, x, start, d, &nowhere(BorderRule::Slide)).unwrap();
            let end: [f64; 3] = std::array::from_fn(|k| (place(a)[k] + d[k]).clamp(0.0, 1.0));
            prop_assert!(valid(&slid.point));
            prop_assert!(far(slid.point.position(&mesh, x), end) < 1e-11, "{:?} {:?}", slid, end);
        }

        #[test]
        fn sliding_never_leaves_a_domain_with_convex_and_reentrant_corners_and_a_hole(
            a in [0.02..0.98f64, 1.0..1.98], turns in proptest::collection::vec((0.0..std::f64::consts::TAU, 0.01..3.0f64), 12),
        ) {
            let mesh = l_shape();
            let x = mesh.vertices();
            let mut point = SeedGrid::new(&mesh, x).locate(&mesh, x, a).unwrap();
            for (angle, length) in turns {
                let step = [length * angle.cos(), length * angle.sin()];
                let walked = walk(&mesh, x, point, step, &nowhere(BorderRule::Slide)).unwrap();
                prop_assert!(valid(&walked.point));
                prop_assert!(inside_l(walked.point.position(&mesh, x)));
                prop_assert!((0.0..=1.0).contains(&walked.travelled));
                point = walked.point;
            }
        }
    }

    #[test]
    fn sliding_goes_along_a_wall_round_a_reentrant_corner_and_stops_in_a_convex_one() {
        let mesh = l_shape();
        let x = mesh.vertices();
        let grid = SeedGrid::new(&mesh, x);
        let from = grid.locate(&mesh, x, [1.5, 0.9]).unwrap();
        let along = walk(&mesh, x, from, [0.3, 0.5], &nowhere(BorderRule::Slide)).unwrap();
        assert!(far(along.point.position(&mesh, x), [1.8, 1.0]) < 1e-12);
        assert_eq!(along.end, WalkEnd::Reached);
        let round = walk(&mesh, x, from, [-1.0, 0.5], &nowhere(BorderRule::Slide)).unwrap();
        assert!(far(round.point.position(&mesh, x), [0.5, 1.25]) < 1e-12, "{:?}", round.point.position(&mesh, x));
        let corner = walk(&mesh, x, from, [1.0, 0.5], &nowhere(BorderRule::Slide)).unwrap();
        assert!(far(corner.point.position(&mesh, x), [2.0, 1.0]) < 1e-12);
        assert!(matches!(corner.end, WalkEnd::Border { .. }));
        assert!((corner.travelled - 0.5).abs() < 1e-12);
        let stuck = walk(&mesh, x, corner.point, [1.0, 1.0], &nowhere(BorderRule::Slide)).unwrap();
        assert!(stuck.travelled == 0.0 && matches!(stuck.end, WalkEnd::Border { .. }));
        let freed = walk(&mesh, x, corner.point, [-0.4, -0.3], &nowhere(BorderRule::Slide)).unwrap();
        assert!(far(freed.point.position(&mesh, x), [1.6, 0.7]) < 1e-12);
    }

    #[test]
    fn stopping_ends_at_the_crossing_and_names_the_facet() {
        let mesh = structured_rectangle(2.0, 1.0, 8, 4).unwrap();
        let x = mesh.vertices();
        let from = SeedGrid::new(&mesh, x).locate(&mesh, x, [0.3, 0.4]).unwrap();
        let stopped = walk(&mesh, x, from, [0.5, 2.0], &nowhere(BorderRule::Stop)).unwrap();
        assert!((stopped.travelled - 0.3).abs() < 1e-12);
        assert!(far(stopped.point.position(&mesh, x), [0.45, 1.0]) < 1e-12);
        let WalkEnd::Border { cell, face } = stopped.end else { panic!("{stopped:?}") };
        assert_eq!(mesh.neighbour(cell as usize, face as usize), BORDER);
        assert_eq!(stopped.point.cell, cell);
    }

    #[test]
    fn entering_a_cell_ends_the_walk_on_its_face_but_the_start_does_not_count() {
        let mesh = structured_rectangle(4.0, 1.0, 4, 1).unwrap();
        let x = mesh.vertices();
        let from = SeedGrid::new(&mesh, x).locate(&mesh, x, [0.6, 0.3]).unwrap();
        let rules = WalkRules { border: BorderRule::Stop, stop_at: |cell| cell == from.cell || cell >= 4 };
        let entered = walk(&mesh, x, from, [3.0, 0.1], &rules).unwrap();
        assert!(matches!(entered.end, WalkEnd::Entered(4 | 5)));
        assert!((entered.travelled - 1.4 / 3.0).abs() < 1e-12);
        assert!((entered.point.position(&mesh, x)[0] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn senseless_walks_are_refused() {
        let mesh = structured_rectangle(1.0, 1.0, 2, 2).unwrap();
        let x = mesh.vertices();
        let rules = nowhere(BorderRule::Stop);
        let at = MaterialPoint::centroid(0);
        assert_eq!(walk(&mesh, x, at, [f64::NAN, 0.0], &rules), Err(WalkError::NotFinite { cell: 0 }));
        let nowhere_cell = walk(&mesh, x, MaterialPoint::centroid(99), [0.1, 0.0], &rules);
        assert_eq!(nowhere_cell, Err(WalkError::NoSuchCell { cell: 99, count: 8 }));
        let mirrored: Vec<_> = x.iter().map(|p| [-p[0], p[1]]).collect();
        assert!(matches!(walk(&mesh, &mirrored, at, [0.1, 0.0], &rules), Err(WalkError::Inverted { cell: 0, .. })));
    }
}
