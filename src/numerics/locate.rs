//! Points that ride the tissue, and where in the mesh a place is.
//!
//! A [`MaterialPoint`] is a cell and barycentric weights: as the tissue moves, its position follows without work or drift.
//! A [`SeedGrid`] finds the material point at an arbitrary position.

use crate::numerics::coordinates::AtVertices;
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::vector::{between, dot};

/// A point fixed in the tissue: a cell and the weights of its vertices `1..=D`; vertex 0 has `1 − Σ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint<const D: usize> {
    /// The cell.
    pub cell: u32,
    /// Barycentric weights of local vertices `1..=D`, each in `[0, 1]`.
    pub weights: [f64; D],
}

/// The `D + 1` barycentric weights, the rest zero.
pub(crate) type Weights = [f64; 4];

impl<const D: usize> MaterialPoint<D> {
    /// The centroid of a cell.
    pub fn centroid(cell: u32) -> Self {
        Self { cell, weights: [1.0 / (D + 1) as f64; D] }
    }

    /// Weight of a local vertex `0..=D`.
    pub fn weight(&self, vertex: usize) -> f64 {
        if vertex == 0 { (1.0 - self.weights.iter().sum::<f64>()).max(0.0) } else { self.weights[vertex - 1] }
    }

    /// Position at the given vertex coordinates (µm): `x = Σ λ_i x_i`.
    #[inline]
    pub fn position(&self, mesh: &SimplexMesh<D>, coordinates: &(impl AtVertices<D> + ?Sized)) -> [f64; D] {
        self.interpolate_vector(mesh, coordinates)
    }

    /// Value at the point of a scalar given at the vertices.
    pub fn interpolate(&self, mesh: &SimplexMesh<D>, values: &[f64]) -> f64 {
        let corners = mesh.cell(self.cell as usize);
        let base = values[corners[0] as usize];
        (0..D).map(|i| self.weights[i] * (values[corners[i + 1] as usize] - base)).sum::<f64>() + base
    }

    /// Value at the point of a vector given at the vertices.
    #[inline]
    pub fn interpolate_vector<const N: usize>(
        &self,
        mesh: &SimplexMesh<D>,
        values: &(impl AtVertices<N> + ?Sized),
    ) -> [f64; N] {
        let corners = mesh.cell(self.cell as usize);
        let base = values.at(corners[0] as usize);
        let others: [[f64; N]; D] = std::array::from_fn(|i| values.at(corners[i + 1] as usize));
        std::array::from_fn(|k| (0..D).map(|i| self.weights[i] * (others[i][k] - base[k])).sum::<f64>() + base[k])
    }

    /// All weights, vertex 0 first.
    pub(crate) fn all_weights(&self) -> Weights {
        let mut weights = [0.0; 4];
        (0..=D).for_each(|i| weights[i] = self.weight(i));
        weights
    }

    /// The point with these weights, clipped to `[0, 1]`.
    pub(crate) fn from_weights(cell: u32, weights: &Weights) -> Self {
        let sum: f64 = weights[..=D].iter().map(|w| w.max(0.0)).sum();
        Self { cell, weights: std::array::from_fn(|i| (weights[i + 1].max(0.0) / sum).min(1.0)) }
    }
}

/// Finds the cell of an arbitrary point in one configuration: births, and places that a user gives.
///
/// A regular grid of bins, each with the cells whose bounding box meets it.
#[derive(Debug, Clone)]
pub struct SeedGrid<const D: usize> {
    low: [f64; D],
    step: [f64; D],
    counts: [usize; D],
    starts: Vec<u32>,
    cells: Vec<u32>,
}

impl<const D: usize> SeedGrid<D> {
    /// Builds the grid for a configuration (one coordinate entry a vertex, µm); about two cells a bin.
    pub fn new(mesh: &SimplexMesh<D>, coordinates: &[[f64; D]]) -> Self {
        let [low, high] = bounds(coordinates.iter());
        let bins = (mesh.cell_count() as f64 / 2.0).max(1.0);
        let extent: [f64; D] = std::array::from_fn(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
        let edge = (extent.iter().product::<f64>() / bins).powf(1.0 / D as f64);
        let counts = extent.map(|x| ((x / edge).ceil() as usize).clamp(1, 1 << 12));
        let step = std::array::from_fn(|k| extent[k] / counts[k] as f64);
        let mut grid = Self { low, step, counts, starts: Vec::new(), cells: Vec::new() };
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for cell in 0..mesh.cell_count() {
            let corners = mesh.cell(cell).iter().map(|&v| &coordinates[v as usize]);
            let [from, to] = bounds(corners);
            grid.for_bins(from, to, |bin| entries.push((bin, cell as u32)));
        }
        entries.sort_unstable();
        let bins = counts.iter().product::<usize>();
        grid.starts = vec![0; bins + 1];
        entries.iter().for_each(|(bin, _)| grid.starts[*bin as usize + 1] += 1);
        (0..bins).for_each(|bin| grid.starts[bin + 1] += grid.starts[bin]);
        grid.cells = entries.into_iter().map(|(_, cell)| cell).collect();
        grid
    }

    /// The material point at position `x` (µm), or `None` if it lies outside. `mesh` and `coordinates` must be those that the
    /// grid was built for. A point within round-off (1e-10 of a cell) of the border counts as inside.
    pub fn locate(&self, mesh: &SimplexMesh<D>, coordinates: &[[f64; D]], x: [f64; D]) -> Option<MaterialPoint<D>> {
        if !x.iter().all(|x| x.is_finite()) {
            return None;
        }
        let bin = self.flat(std::array::from_fn(|k| self.place(x[k], k)));
        let mut best: Option<(f64, MaterialPoint<D>)> = None;
        for &cell in &self.cells[self.starts[bin] as usize..self.starts[bin + 1] as usize] {
            let mut gradients = [[0.0; D]; 4];
            mesh.barycentric_gradients(coordinates, cell as usize, &mut gradients[..=D]);
            let origin = coordinates[mesh.cell(cell as usize)[0] as usize];
            let away = between(&origin, &x);
            let mut weights = [0.0; 4];
            (1..=D).for_each(|i| weights[i] = dot(&gradients[i], &away));
            weights[0] = 1.0 - weights[1..=D].iter().sum::<f64>();
            let least = weights[..=D].iter().copied().fold(f64::INFINITY, f64::min);
            if least >= -1e-10 && best.is_none_or(|(most, _)| least > most) {
                best = Some((least, MaterialPoint::from_weights(cell, &weights)));
            }
        }
        best.map(|(_, point)| point)
    }

    fn place(&self, x: f64, axis: usize) -> usize {
        (((x - self.low[axis]) / self.step[axis]).max(0.0) as usize).min(self.counts[axis] - 1)
    }

    fn flat(&self, place: [usize; D]) -> usize {
        (0..D).rev().fold(0, |flat, k| flat * self.counts[k] + place[k])
    }

    fn for_bins(&self, from: [f64; D], to: [f64; D], mut visit: impl FnMut(u32)) {
        let slack: [f64; D] = std::array::from_fn(|k| 1e-9 * self.step[k]);
        let first: [usize; D] = std::array::from_fn(|k| self.place(from[k] - slack[k], k));
        let last: [usize; D] = std::array::from_fn(|k| self.place(to[k] + slack[k], k));
        let mut place = first;
        loop {
            visit(self.flat(place) as u32);
            let Some(axis) = (0..D).find(|&k| place[k] < last[k]) else { return };
            place[axis] += 1;
            (0..axis).for_each(|k| place[k] = first[k]);
        }
    }
}

fn bounds<'a, const D: usize>(points: impl Iterator<Item = &'a [f64; D]>) -> [[f64; D]; 2] {
    points.fold([[f64::INFINITY; D], [f64::NEG_INFINITY; D]], |[low, high], p| {
        [std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k]))]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::planar_domain::{Outline, PlanarDomain, Ring};
    use crate::numerics::triangulate::{MeshOptions, triangulate};

    /// An L: the square (0, 2)² without its upper right quarter, and a hole of twelve corners.
    fn l_shape() -> SimplexMesh<2> {
        let outer = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let hole = Outline::disc([0.5, 0.5], 0.2, 0.1).points;
        let ring = |points: Vec<[f64; 2]>| Ring { edges: vec![0; points.len()], points };
        let domain = PlanarDomain::new(ring(outer), vec![ring(hole)], vec!["wall".into()]);
        triangulate(&domain, &[], &MeshOptions::of_size(0.1)).unwrap().mesh
    }

    #[test]
    fn a_seed_grid_finds_points_inside_and_none_outside() {
        let mesh = l_shape();
        let grid = SeedGrid::new(&mesh, mesh.vertices());
        for outside in [[1.5, 1.5], [0.5, 0.5], [-0.1, 0.3], [5.0, 5.0], [f64::NAN, 0.0]] {
            assert_eq!(grid.locate(&mesh, mesh.vertices(), outside), None);
        }
        for cell in 0..mesh.cell_count() as u32 {
            let centre = MaterialPoint::centroid(cell);
            let found = grid.locate(&mesh, mesh.vertices(), centre.position(&mesh, mesh.vertices())).unwrap();
            assert_eq!(found.cell, cell);
        }
        assert!(grid.locate(&mesh, mesh.vertices(), [2.0, 1.0]).is_some());
    }
}
