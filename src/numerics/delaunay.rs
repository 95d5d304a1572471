//! Is a stretched mesh still Delaunay, and if not, which edges have to be flipped?
//!
//! The off-diagonal entry of the P1 diffusion matrix for an edge is `−(D/2)(cot α₁ + cot α₂)`, with the angles that face the
//! edge in its two triangles (one at the border). It has the sign that the discrete maximum principle needs exactly where
//! the edge is locally Delaunay, `α₁ + α₂ ≤ π`, and at the border where α is not obtuse. With the consistent mass
//! it needs `k (A₁ + A₂)/12 ≤ (D/2)(cot α₁ + cot α₂)`. Lawson's flips restore the first without moving a vertex. How near
//! a mesh comes to either is a [`Monotonicity`].

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::numerics::polygon::{cross, dot, minus};
use crate::numerics::simplex_mesh::{BORDER, SimplexMesh};

/// Sums of cotangents above this (negative) value count as Delaunay: four points on a circle, to round-off.
const ROUND_OFF: f64 = -1e-10;
/// Sums of cotangents are taken to be no less than this where something is divided by them.
const LEAST_COTANGENTS: f64 = 1e-6;

/// How near a triangulation comes to losing the discrete maximum principle: the worst edge, as a share of what is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Monotonicity {
    /// Largest `(α₁ + α₂)/π` of an interior edge, or `α/(π/2)` of a border edge: up to 1 the edges are Delaunay, and solutions with
    /// lumped mass keep the principle. Exactly 1 for four points on a circle.
    pub angles: f64,
    /// Largest `k (A₁ + A₂)/12` over `(D/2)(cot α₁ + cot α₂)`, border included: up to 1 solutions with consistent mass keep it.
    /// A sum of cotangents below 1e-6 counts as 1e-6, so that it is finite.
    pub consistent_mass: f64,
}

impl Monotonicity {
    /// The worse of two triangulations, each in its own right.
    pub fn worse(self, other: Self) -> Self {
        Self { angles: self.angles.max(other.angles), consistent_mass: self.consistent_mass.max(other.consistent_mass) }
    }
}

/// What the edges of a triangulation look like in one configuration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EdgeReport {
    /// Edges between two cells.
    pub interior: usize,
    /// Of these, edges that are not locally Delaunay (lumped solutions may go negative).
    pub not_delaunay: usize,
    /// Border edges that an obtuse angle faces.
    pub obtuse_at_border: usize,
    /// Edges, border included, for which the consistent mass breaks the discrete maximum principle.
    pub consistent_mass: usize,
    /// Smallest `cot α₁ + cot α₂` of an interior edge, or `cot α` of a border edge.
    pub smallest_cotangents: f64,
    /// How near the worst edges come to the discrete maximum principle.
    pub monotonicity: Monotonicity,
}

impl EdgeReport {
    /// Whether lumped solutions obey the discrete maximum principle.
    pub fn monotone_lumped(&self) -> bool {
        self.not_delaunay == 0 && self.obtuse_at_border == 0
    }
}

/// Triangles, and the neighbour across the face opposite each vertex: what flips work on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Triangles {
    cells: Vec<[u32; 3]>,
    neighbours: Vec<[u32; 3]>,
}

impl Triangles {
    /// The triangles of a planar mesh.
    pub fn of<const D: usize>(mesh: &SimplexMesh<D>) -> Self {
        Self::new(mesh.cells(), mesh.neighbours())
    }

    /// Triangles from flat cells, each counter-clockwise, and the cells across their faces.
    fn new(cells: &[u32], neighbours: &[u32]) -> Self {
        let (cells, neighbours) = (cells.as_chunks().0.to_vec(), neighbours.as_chunks().0.to_vec());
        Self { cells, neighbours }
    }

    /// The cells, flat with stride 3.
    pub fn flat(&self) -> Vec<u32> {
        self.cells.iter().flatten().copied().collect()
    }

    /// Looks at every edge in the configuration `coordinates` (µm). `degradation` k (1/h) and `diffusion` D (µm²/h) enter only
    /// the count for the consistent mass.
    pub fn edge_report(&self, coordinates: &[[f64; 2]], diffusion: f64, degradation: f64) -> EdgeReport {
        let mut report = EdgeReport { smallest_cotangents: f64::INFINITY, ..EdgeReport::default() };
        for cell in 0..self.cells.len() {
            for face in 0..3 {
                let other = self.neighbours[cell][face];
                if other != BORDER && (other as usize) < cell {
                    continue;
                }
                let (mut cotangents, mut area) = self.cotangent_and_area(coordinates, cell, face);
                let mut angles = angle(cotangents);
                if other == BORDER {
                    angles *= 2.0;
                    report.obtuse_at_border += usize::from(cotangents < ROUND_OFF);
                } else {
                    let (more, and) = self.cotangent_and_area(coordinates, other as usize, self.back(other, cell));
                    angles += angle(more);
                    (cotangents, area) = (cotangents + more, area + and);
                    report.interior += 1;
                    report.not_delaunay += usize::from(cotangents < ROUND_OFF);
                }
                let mass = degradation * area / 12.0;
                report.consistent_mass += usize::from(mass > 0.5 * diffusion * cotangents);
                report.smallest_cotangents = report.smallest_cotangents.min(cotangents);
                report.monotonicity = report.monotonicity.worse(Monotonicity {
                    // What is Delaunay to round-off does not pass the limit by round-off.
                    angles: if cotangents < ROUND_OFF { angles / PI } else { (angles / PI).min(1.0) },
                    consistent_mass: mass / (0.5 * diffusion * cotangents.max(LEAST_COTANGENTS)),
                });
            }
        }
        report
    }

    /// Flips edges until all are locally Delaunay at `coordinates` (µm), except border edges and edges between cells with
    /// different `labels` (one a cell; a cell beyond the list has label 0). Cell `i` keeps its label, so regions made of
    /// whole labels stay valid. Returns the number of flips.
    ///
    /// The order is fixed by the cells' numbers, and the result does not depend on anything else.
    pub fn flip_to_delaunay(&mut self, coordinates: &[[f64; 2]], labels: &[u32]) -> usize {
        let label = |cell: usize| labels.get(cell).copied().unwrap_or(0);
        let mut stack: Vec<(u32, u32)> = Vec::new();
        for cell in (0..self.cells.len()).rev() {
            let others = self.neighbours[cell].iter().filter(|&&other| other != BORDER && (other as usize) > cell);
            stack.extend(others.map(|&other| (cell as u32, other)));
        }
        // Lawson's algorithm ends; the bound guards against coordinates that do not make a mesh.
        let limit = 100 * self.cells.len() + 100;
        let mut flips = 0;
        while let Some((a, b)) = stack.pop() {
            let (cell, other) = (a as usize, b as usize);
            let Some(face) = self.neighbours[cell].iter().position(|&n| n == b) else { continue };
            if label(cell) != label(other) || flips >= limit {
                continue;
            }
            let back = self.back(b, cell);
            let (one, _) = self.cotangent_and_area(coordinates, cell, face);
            let (two, _) = self.cotangent_and_area(coordinates, other, back);
            if one + two < ROUND_OFF {
                self.flip(cell, face, other, back);
                flips += 1;
                for flipped in [a, b] {
                    let around = self.neighbours[flipped as usize].iter().filter(|&&n| n != BORDER && n != a && n != b);
                    stack.extend(around.map(|&n| (flipped, n)));
                }
            }
        }
        flips
    }

    fn back(&self, other: u32, cell: usize) -> usize {
        self.neighbours[other as usize].iter().position(|&n| n as usize == cell).unwrap_or(0)
    }

    /// Cotangent of the angle at local vertex `face`, and the area of the cell.
    fn cotangent_and_area(&self, coordinates: &[[f64; 2]], cell: usize, face: usize) -> (f64, f64) {
        let corner = |k: usize| coordinates[self.cells[cell][(face + k) % 3] as usize];
        let (a, b) = (minus(corner(1), corner(0)), minus(corner(2), corner(0)));
        let twice_area = cross(a, b);
        (dot(a, b) / twice_area, 0.5 * twice_area)
    }

    /// Replaces the edge (q, r) of the cells (p, q, r) and (s, r, q) by (p, s): cells (p, q, s) and (s, r, p).
    fn flip(&mut self, cell: usize, face: usize, other: usize, back: usize) {
        let turn = |x: [u32; 3], by: usize| [x[by % 3], x[(by + 1) % 3], x[(by + 2) % 3]];
        let ([p, q, r], [_, across_pr, across_pq]) = (turn(self.cells[cell], face), turn(self.neighbours[cell], face));
        let (s, [_, across_sq, across_sr]) = (self.cells[other][back], turn(self.neighbours[other], back));
        self.cells[cell] = [p, q, s];
        self.neighbours[cell] = [across_sq, other as u32, across_pq];
        self.cells[other] = [s, r, p];
        self.neighbours[other] = [across_pr, cell as u32, across_sr];
        self.relink(across_sq, other, cell);
        self.relink(across_pr, cell, other);
    }

    fn relink(&mut self, at: u32, from: usize, to: usize) {
        if at != BORDER
            && let Some(slot) = self.neighbours[at as usize].iter_mut().find(|n| **n as usize == from)
        {
            *slot = to as u32;
        }
    }
}

/// The angle in (0, π) of a cotangent.
fn angle(cotangent: f64) -> f64 {
    1f64.atan2(cotangent)
}

/// One label a cell that tells apart every combination of `regions` (lists of cells, which may overlap): cells of equal label
/// lie in the same regions. Label 0 lies in none.
pub fn region_labels(cell_count: usize, regions: &[Vec<u32>]) -> Vec<u32> {
    let mut labels = vec![0u32; cell_count];
    let mut count = 1;
    for region in regions {
        let mut inside: HashMap<u32, u32> = HashMap::new();
        for &cell in region {
            if let Some(label) = labels.get_mut(cell as usize) {
                *label = *inside.entry(*label).or_insert_with(|| {
                    count += 1;
                    count - 1
                });
            }
        }
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::planar_domain::{Outline, PlanarDomain};
    use crate::numerics::triangulate::{FittedMesh, MeshOptions, triangulate};

    fn triangles_of(cells: &[u32]) -> Triangles {
        let vertices = cells.iter().max().map_or(0, |&last| last as usize + 1);
        Triangles::new(cells, &SimplexMesh::<2>::match_faces(vertices, cells).unwrap())
    }

    fn stretched() -> (FittedMesh, Vec<[f64; 2]>) {
        let domain = PlanarDomain::rectangle(800.0, 600.0);
        let outlines = [Outline::disc([400.0, 500.0], 50.0, 20.0), Outline::disc([430.0, 480.0], 40.0, 20.0)];
        let fitted = triangulate(&domain, &outlines, &MeshOptions::of_size(20.0)).unwrap();
        let now = fitted.mesh.vertices().iter().map(|[x, y]| [0.77 * x, 1.4 * y]).collect();
        (fitted, now)
    }

    #[test]
    fn a_fitted_mesh_is_delaunay_at_rest_and_not_after_the_papers_stretch() {
        let (fitted, now) = stretched();
        let triangles = Triangles::of(&fitted.mesh);
        let rest = triangles.edge_report(fitted.mesh.vertices(), 1.0, 0.0);
        assert!(rest.monotone_lumped(), "{rest:?}");
        let bad = triangles.edge_report(&now, 1.0, 0.0);
        assert!(bad.not_delaunay > 20, "{bad:?}");
    }

    #[test]
    fn flips_restore_delaunay_and_keep_areas_of_regions_and_neighbours() {
        let (fitted, now) = stretched();
        let labels = region_labels(fitted.mesh.cell_count(), &fitted.regions);
        let mut triangles = Triangles::of(&fitted.mesh);
        let before = triangles.edge_report(&now, 1.0, 0.0);
        let flips = triangles.flip_to_delaunay(&now, &labels);
        let after = triangles.edge_report(&now, 1.0, 0.0);
        assert!(flips > 0 && after.interior == before.interior);
        let between_labels = (0..triangles.cells.len() as u32)
            .flat_map(|c| triangles.neighbours[c as usize].map(|n| (c, n)))
            .filter(|&(c, n)| n != BORDER && n > c && labels[c as usize] != labels[n as usize])
            .filter(|&(c, n)| {
                let at = |cell: u32, other: u32| {
                    triangles.cotangent_and_area(&now, cell as usize, triangles.back(cell, other as usize)).0
                };
                at(c, n) + at(n, c) < ROUND_OFF
            });
        assert_eq!(after.not_delaunay, between_labels.count(), "{before:?} {after:?}");
        assert_eq!(triangles.neighbours, triangles_of(&triangles.flat()).neighbours);
        for region in &fitted.regions {
            let area = |t: &Triangles| region.iter().map(|&c| t.cotangent_and_area(&now, c as usize, 0).1).sum::<f64>();
            assert!((area(&triangles) / area(&Triangles::of(&fitted.mesh)) - 1.0).abs() < 1e-13);
        }
        assert!((0..triangles.cells.len()).all(|c| triangles.cotangent_and_area(&now, c, 0).1 > 0.0));
    }

    #[test]
    fn the_consistent_mass_needs_a_fine_mesh_and_an_equilateral_one_the_known_size() {
        let height = 0.75_f64.sqrt();
        let x = [[0.0, 0.0], [1.0, 0.0], [0.5, height], [1.5, height]];
        let triangles = triangles_of(&[0, 1, 2, 1, 3, 2]);
        let inner = |k: f64| triangles.edge_report(&x, 1.0, k).consistent_mass;
        assert_eq!((inner(7.999), inner(8.001)), (0, 5));
    }

    /// The monotonicity of two triangles over the edge from (−1, 0) to (1, 0), their tips at heights h above and below.
    fn pair(height: f64, diffusion: f64, degradation: f64) -> Monotonicity {
        let x = [[-1.0, 0.0], [1.0, 0.0], [0.0, height], [0.0, -height]];
        triangles_of(&[0, 1, 2, 1, 0, 3]).edge_report(&x, diffusion, degradation).monotonicity
    }

    #[test]
    fn angle_sums_are_those_of_right_equilateral_and_obtuse_triangles() {
        let third = 1.0 / 3f64.sqrt();
        // Right angles at the tips: their sum is pi. 120 degrees: 4/3 pi. Equilateral: 60 degrees face every edge, the border's too.
        for (height, share) in [(1.0, 1.0), (third, 4.0 / 3.0), (3f64.sqrt(), 2.0 / 3.0)] {
            assert!((pair(height, 1.0, 0.0).angles - share).abs() < 1e-14, "{height}: {:?}", pair(height, 1.0, 0.0));
        }
        assert!(pair(1.0, 1.0, 0.0).angles <= 1.0, "a square is Delaunay, and round-off does not say otherwise");
        // One right triangle: its right angle faces the border and is all that is allowed; 120 degrees are a third too many.
        let lone = |height: f64| {
            let x = [[-1.0, 0.0], [1.0, 0.0], [0.0, height]];
            triangles_of(&[0, 1, 2]).edge_report(&x, 1.0, 0.0).monotonicity.angles
        };
        assert!((lone(1.0) - 1.0).abs() < 1e-14 && (lone(third) - 4.0 / 3.0).abs() < 1e-14);
    }

    #[test]
    fn the_consistent_mass_of_equilateral_triangles_is_bounded_by_k_h_squared_over_d_of_eight() {
        // Every edge has as many areas h² √3/4 as cotangents 1/√3: k (√3/4 h²)/12 over (D/2)/√3 is k h²/(8 D).
        for (diffusion, degradation) in [(1.0, 0.5), (3.0, 6.0), (2.0, 40.0)] {
            let found = pair(3f64.sqrt(), diffusion, degradation).consistent_mass;
            let bound = degradation * 4.0 / (8.0 * diffusion);
            assert!((found / bound - 1.0).abs() < 1e-14, "{found} {bound}");
        }
        let right_angles = pair(1.0, 1.0, 1.0).consistent_mass;
        assert!(right_angles > 1e4 && right_angles.is_finite(), "{right_angles}");
        let merged = pair(1.0, 1.0, 1.0).worse(pair(1.0 / 3f64.sqrt(), 1.0, 0.0));
        assert!((merged.angles - 4.0 / 3.0).abs() < 1e-14 && merged.consistent_mass == right_angles);
    }

    #[test]
    fn a_thin_pair_is_flipped_unless_its_cells_differ() {
        let x = [[0.0, 0.0], [1.0, -0.1], [2.0, 0.0], [1.0, 0.1]];
        let flat = [0, 1, 2, 0, 2, 3];
        let mut free = triangles_of(&flat);
        assert_eq!(free.flip_to_delaunay(&x, &[]), 1);
        assert!(free.cells.iter().all(|c| c.contains(&1) && c.contains(&3)));
        assert_eq!(triangles_of(&flat).flip_to_delaunay(&x, &[0, 1]), 0);
    }

    #[test]
    fn labels_tell_every_combination_of_regions_apart() {
        assert_eq!(region_labels(6, &[vec![1, 2, 3], vec![2, 3, 4]]), [0, 1, 2, 2, 3, 0]);
    }
}
