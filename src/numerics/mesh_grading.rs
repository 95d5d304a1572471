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
//! At a corner with an angle ω > π inside, fields go as r^λ with λ = π/ω < 1, and on an even mesh gradients converge no faster than h^λ
//! there and h^2λ elsewhere. Edges of h = H (r/R)^(1−μ) give back the order of linear elements with μ < λ (Babuška, Kellogg and Pitkäranta, Numer.
//! Math. 33, 1979, doi:10.1007/BF01399326), and that of the recovered gradient, two, with μ < λ/2: ∫ (h² r^(λ−3))² r dr is
//! then finite. Here μ = 0.45 λ.
//!
//! A [`Grading`] keeps places by level: squares of twice the size / 2^level, with the squares around each, so that edges grow by a factor
//! of two over two of them at the most.

use crate::numerics::planar_domain::Corner;
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::vector::{between, norm};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Levels there may be: edges of a thousandth of the size.
pub const MOST_LEVELS: u8 = 10;

/// By how much the angle inside a corner exceeds π (radians) where grading toward it is worth the while: 10°.
pub const LEAST_CORNER: f64 = PI / 18.0;

/// μ over π/ω.
const CORNER: f64 = 0.45;

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
        let wrong = errors.iter().enumerate().filter(|(_, error)| **error > tolerance);
        let wanted: Vec<(usize, u8)> =
            wrong.map(|(cell, _)| (cell, (self.level(centroid(mesh, cell)) + 1).min(most.min(MOST_LEVELS)))).collect();
        let before = self.count();
        for (cell, level) in wanted {
            (1..=level).for_each(|level| corners(mesh, cell).for_each(|corner| self.ask(level, corner)));
        }
        self.count() > before
    }

    /// About how many vertices there will be once all errors are within the tolerance, or edges halved `most` times: half a vertex a cell, four
    /// cells for one where an edge is halved, errors as long as edges.
    pub fn vertices_to_come(&self, mesh: &SimplexMesh<2>, errors: &[f64], tolerance: f64, most: u8) -> f64 {
        let vertices = |(cell, error): (usize, &f64)| {
            let left = most.min(MOST_LEVELS).saturating_sub(self.level(centroid(mesh, cell)));
            0.5 * 4f64.powf((error / tolerance).log2().ceil().clamp(0.0, f64::from(left)))
        };
        errors.iter().enumerate().map(vertices).sum()
    }

    /// Asks for shorter edges around a corner with the angle ω > π inside: h = H (r/R)^(1−μ) at the distance r ≤ R, to within a factor of two, down to h = r,
    /// [`MOST_LEVELS`] at most. R (µm) is `radius`, or the distance to the next corner: behind that lies another field, and places do not
    /// overlap more than a few times however many corners there are.
    pub fn toward_corner(&mut self, corner: &Corner, radius: f64) {
        let (radius, power) = (radius.min(corner.room), 1.0 - CORNER * PI / corner.angle);
        for level in 1..=MOST_LEVELS {
            let (reach, length) = (radius * 0.5f64.powf(f64::from(level) / power), self.length(level));
            if reach < length {
                break;
            }
            let squares = (reach / (2.0 * length)).ceil() as i64;
            let places = || (-squares..=squares).map(|i| 2.0 * length * i as f64);
            let offsets = places().flat_map(|x| places().map(move |y| [x, y]));
            offsets
                .filter(|[x, y]| x.hypot(*y) <= reach)
                .for_each(|[x, y]| self.ask(level, [corner.point[0] + x, corner.point[1] + y]));
        }
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

fn corners(mesh: &SimplexMesh<2>, cell: usize) -> impl Iterator<Item = [f64; 2]> {
    mesh.cell(cell).iter().map(|&vertex| mesh.vertices()[vertex as usize])
}

fn centroid(mesh: &SimplexMesh<2>, cell: usize) -> [f64; 2] {
    let sum = corners(mesh, cell).fold([0.0; 2], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
    sum.map(|x| x / 3.0)
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
    fn edges_grow_from_a_corner_as_a_power_of_the_distance() {
        let (size, angle) = (8.0, 1.5 * PI);
        let mut grading = Grading::even(size);
        grading.toward_corner(&Corner { point: [3.0, 5.0], angle, room: 90.0 }, 64.0);
        let power = 1.0 - 0.45 / 1.5;
        for step in 0..40 {
            let away = 0.01 * 1.3f64.powi(step);
            let wanted = size * (away / 64.0).min(1.0).powf(power);
            for turn in (0..12).map(|i| 0.5 * f64::from(i)) {
                let found = grading.size_at([3.0 + away * turn.cos(), 5.0 + away * turn.sin()]);
                // Sizes go in factors of two, down to h = r; squares are as wide as two edges of their own, and ask for those around them.
                if away > wanted {
                    assert!(found <= 2.0 * wanted, "{away}: {found} for {wanted}");
                }
                let farther = (away - 4.0 * wanted).max(0.0);
                let least = 0.49 * size * (farther / 64.0).min(1.0).powf(power);
                assert!(found >= least, "{away}: {found}, at least {least}");
            }
        }
        let mut short = Grading::even(size);
        short.toward_corner(&Corner { point: [3.0, 5.0], angle, room: 90.0 }, 4.0);
        assert_eq!(short, Grading::even(size));
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
