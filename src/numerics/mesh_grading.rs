//! How fine a mesh shall be where: cells whose gradient is too wrong ask for edges of half the length.
//!
//! The error of a P1 gradient in a cell T is estimated by what recovery makes of it (Zienkiewicz and Zhu, Int. J. Numer. Methods
//! Eng. 24, 1987, doi:10.1002/nme.1620240206), relative to what there is to sense:
//!
//! ```text
//! η_T = ‖∇c_h − G c_h‖_T / (‖G c_h‖_T + ‖c_h‖_T / ℓ),    ℓ = √(D/k),
//! ```
//!
//! in the root mean square over T. Far from a source c falls by e over ℓ, and both terms of the divisor are equal; where c
//! has its maximum the second keeps cells from being halved without end (ours). G c_h itself is of one order more: its error
//! is about η².
//!
//! A [`Grading`] keeps places by level: squares of twice the size / 2^level, with the squares around each, so that edges grow by a factor
//! of two over two of them at the most.

use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::vector::{between, norm};
use std::collections::BTreeSet;

/// Levels there may be: edges of a thousandth of the size.
pub const MOST_LEVELS: u8 = 10;

/// Levels of refinement by place: edges of about size / 2^level.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grading {
    size: f64,
    /// For each level from 1 on, the squares that want it or more.
    squares: Vec<BTreeSet<[i64; 2]>>,
}

impl Grading {
    /// The same size (µm) everywhere.
    pub fn even(size: f64) -> Self {
        Self { size, squares: Vec::new() }
    }

    /// The finest level anywhere.
    pub fn finest(&self) -> u8 {
        self.squares.len() as u8
    }

    /// The level at a point (µm); 0 is the size itself.
    pub fn level(&self, point: [f64; 2]) -> u8 {
        let wants = |level: &u8| self.squares[usize::from(*level) - 1].contains(&self.square(*level, point));
        (1..=self.finest()).rev().find(wants).unwrap_or(0)
    }

    /// Length of an edge at a point (µm).
    pub fn size_at(&self, point: [f64; 2]) -> f64 {
        self.length(self.level(point))
    }

    /// The squares that want a level or more, by their lower and upper corners (µm). Each point lies in one square of a level.
    pub(crate) fn squares(&self, level: u8) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        let side = 2.0 * self.length(level);
        let of_level = usize::from(level).checked_sub(1).and_then(|index| self.squares.get(index));
        of_level.into_iter().flatten().map(move |square| [0, 1].map(|k| square.map(|i| (i + k) as f64 * side)))
    }

    /// Asks for one level more in the cells (at `coordinates`, µm) whose error is above the tolerance, `most` levels at most. Returns
    /// whether anything is asked for that was not before.
    pub fn refine(&mut self, mesh: &SimplexMesh<2>, errors: &[f64], tolerance: f64, most: u8) -> bool {
        let corners = |cell: usize| mesh.cell(cell).iter().map(|&v| mesh.vertices()[v as usize]);
        let centroid = |cell: usize| {
            let sum = corners(cell).fold([0.0; 2], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
            sum.map(|x| x / 3.0)
        };
        let wrong = errors.iter().enumerate().filter(|(_, error)| **error > tolerance);
        let wanted: Vec<(usize, u8)> =
            wrong.map(|(cell, _)| (cell, (self.level(centroid(cell)) + 1).min(most.min(MOST_LEVELS)))).collect();
        let before = self.count();
        for (cell, level) in wanted {
            (1..=level).for_each(|level| corners(cell).for_each(|corner| self.ask(level, corner)));
        }
        self.count() > before
    }

    fn count(&self) -> usize {
        self.squares.iter().map(BTreeSet::len).sum()
    }

    fn length(&self, level: u8) -> f64 {
        self.size * 0.5f64.powi(i32::from(level))
    }

    fn square(&self, level: u8, point: [f64; 2]) -> [i64; 2] {
        point.map(|x| (x / (2.0 * self.length(level))).floor() as i64)
    }

    /// Marks the square of a point and those around it.
    fn ask(&mut self, level: u8, point: [f64; 2]) {
        let count = usize::from(level).max(self.squares.len());
        self.squares.resize(count, BTreeSet::new());
        let [i, j] = self.square(level, point);
        let around = (-1..=1).flat_map(|di| (-1..=1).map(move |dj| [i + di, j + dj]));
        self.squares[usize::from(level) - 1].extend(around);
    }
}

/// The estimate η of every cell (dimensionless): `values` c and recovered `gradients` G c one entry a vertex, `decay_length` ℓ in µm.
/// A cell where there is nothing has no error.
pub fn gradient_errors<const D: usize>(
    mesh: &SimplexMesh<D>,
    values: &[f64],
    gradients: &[[f64; D]],
    decay_length: f64,
) -> Vec<f64> {
    let mut barycentric = [[0.0; D]; 4];
    let mut of_cell = |cell: usize| {
        mesh.barycentric_gradients(mesh.vertices(), cell, &mut barycentric[..=D]);
        let corners = mesh.cell(cell);
        let of_element: [f64; D] =
            std::array::from_fn(|k| corners.iter().zip(&barycentric).map(|(&v, g)| values[v as usize] * g[k]).sum());
        let mean = |of: &dyn Fn(usize) -> f64| mean_square(corners, of).sqrt();
        let wrong = mean(&|v| norm(&between(&of_element, &gradients[v])));
        let there = mean(&|v| norm(&gradients[v])) + mean(&|v| values[v]) / decay_length;
        if there > 0.0 { wrong / there } else { 0.0 }
    };
    (0..mesh.cell_count()).map(&mut of_cell).collect()
}

/// Mean square over a cell's corners.
fn mean_square(corners: &[u32], of: &dyn Fn(usize) -> f64) -> f64 {
    corners.iter().map(|&v| of(v as usize).powi(2)).sum::<f64>() / corners.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::planar_domain::{Outline, PlanarDomain};
    use crate::numerics::triangulate::{MeshOptions, triangulate, triangulate_graded};

    #[test]
    fn the_estimate_of_an_exponential_is_that_of_its_curvature() {
        let (width, length) = (0.02, 0.5);
        let mesh = triangulate(&PlanarDomain::rectangle(1.0, 1.0), &[], &MeshOptions::of_size(width)).unwrap().mesh;
        let values: Vec<f64> = mesh.vertices().iter().map(|x| (-x[0] / length).exp()).collect();
        let gradients: Vec<[f64; 2]> = values.iter().map(|c| [-c / length, 0.0]).collect();
        let errors = gradient_errors(&mesh, &values, &gradients, length);
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        // In an equilateral triangle of side h the corners are h/√3 from the centroid: √⟨Δx²⟩ = h/√6; c/ℓ doubles the divisor.
        let expected = width / 6f64.sqrt() / length / 2.0;
        assert!((mean / expected - 1.0).abs() < 0.15, "{mean} {expected}");
        let nothing = vec![0.0; values.len()];
        assert!(gradient_errors(&mesh, &nothing, &vec![[0.0; 2]; values.len()], length).iter().all(|e| *e == 0.0));
    }

    #[test]
    fn a_level_is_asked_for_where_the_error_is_and_grows_outward_by_one_a_square() {
        let domain = PlanarDomain::rectangle(100.0, 80.0);
        let options = MeshOptions::of_size(10.0);
        let mut grading = Grading::even(10.0);
        let source = [Outline::disc([50.0, 40.0], 1.0, 10.0)];
        for round in 1..=4u8 {
            let fitted = triangulate_graded(&domain, &source, &options, &grading).unwrap();
            let near = |cell: usize| {
                let x = fitted.mesh.vertices()[fitted.mesh.cell(cell)[0] as usize];
                f64::from((x[0] - 50.0).hypot(x[1] - 40.0) < 3.0)
            };
            let errors: Vec<f64> = (0..fitted.mesh.cell_count()).map(near).collect();
            assert!(grading.refine(&fitted.mesh, &errors, 0.5, 4));
            assert_eq!(grading.finest(), round);
        }
        assert_eq!(grading.level([50.0, 40.0]), 4);
        assert_eq!(grading.size_at([50.0, 40.0]), 0.625);
        assert_eq!(grading.level([5.0, 5.0]), 0);
        let steps: Vec<u8> = (0..=450).map(|i| grading.level([50.0 + 0.1 * f64::from(i), 40.0])).collect();
        assert!(steps.windows(2).all(|pair| pair[0] == pair[1] || pair[0] == pair[1] + 1), "{steps:?}");
        let graded = triangulate_graded(&domain, &source, &options, &grading).unwrap();
        let even = triangulate(&domain, &source, &MeshOptions::of_size(0.625)).unwrap();
        let [few, many] = [&graded, &even].map(|fitted| fitted.mesh.vertex_count());
        assert!(few * 15 < many, "{few} {many}");
        assert!(graded.min_angle > 25f64.to_radians(), "{}", graded.min_angle.to_degrees());
        assert!((graded.mesh.vertices().len()) > 100);
    }
}
