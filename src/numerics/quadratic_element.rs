//! One cell's share of eq. (2) in quadratic Lagrange elements, and its derivative while the cell deforms.
//!
//! Nodes are the corners and the middles of the edges, in barycentric coordinates
//!
//! ```text
//! φ_a = λ_a (2λ_a − 1)      φ_ab = 4 λ_a λ_b      ∇φ_i = Σ_a S_ia(λ) g_a,   S_ia = ∂φ_i/∂λ_a
//! K_ij = D Σ_ab A^ij_ab G_ab + k V M_ij           G_ab = V g_a·g_b
//! ```
//!
//! with the constants `A^ij_ab = ∫ S_ia S_jb / V` and `M_ij = ∫ φ_i φ_j / V`. What deforms is in `G` and `V` alone, so the
//! derivative of `K` is the same sum with their derivatives, those of [`crate::numerics::reaction_diffusion`].

use crate::numerics::cue_element::{Element, ReactionDiffusion, divergence};
use crate::numerics::quadrature::simplex_rule;
use crate::numerics::vector::dot;

/// Most nodes of a cell (in space).
pub(crate) const MOST_NODES: usize = 10;

/// Barycentric weights, the rest zero.
type Weights = [f64; 4];

/// Nodes of a cell: 6 in the plane, 10 in space.
pub(crate) const fn node_count(dimension: usize) -> usize {
    (dimension + 1) * (dimension + 2) / 2
}

/// The edges of a cell as pairs of its corners, in the order of their nodes.
pub(crate) fn local_edges(dimension: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..=dimension).flat_map(move |a| (a + 1..=dimension).map(move |b| (a, b)))
}

/// `φ_i` at a place of a cell, corners first.
pub(crate) fn shape<const D: usize>(weights: &Weights) -> [f64; MOST_NODES] {
    let mut shape = [0.0; MOST_NODES];
    (0..=D).for_each(|a| shape[a] = weights[a] * (2.0 * weights[a] - 1.0));
    for (edge, (a, b)) in local_edges(D).enumerate() {
        shape[D + 1 + edge] = 4.0 * weights[a] * weights[b];
    }
    shape
}

/// `S_ia = ∂φ_i/∂λ_a` at a place of a cell.
pub(crate) fn slopes<const D: usize>(weights: &Weights) -> [[f64; 4]; MOST_NODES] {
    let mut slopes = [[0.0; 4]; MOST_NODES];
    (0..=D).for_each(|a| slopes[a][a] = 4.0 * weights[a] - 1.0);
    for (edge, (a, b)) in local_edges(D).enumerate() {
        slopes[D + 1 + edge][a] = 4.0 * weights[b];
        slopes[D + 1 + edge][b] = 4.0 * weights[a];
    }
    slopes
}

/// The constants `A` and `M`, the same for every cell.
#[derive(Debug, Clone)]
pub(crate) struct QuadraticConstants {
    stiffness: Vec<[[f64; 4]; 4]>,
    mass: [[f64; MOST_NODES]; MOST_NODES],
    /// `∫ φ_i / V`, the row sums of `M`.
    pub(crate) share: [f64; MOST_NODES],
}

impl QuadraticConstants {
    pub(crate) fn new<const D: usize>() -> Self {
        let nodes = node_count(D);
        let mut constants = Self {
            stiffness: vec![[[0.0; 4]; 4]; nodes * nodes],
            mass: [[0.0; MOST_NODES]; MOST_NODES],
            share: [0.0; MOST_NODES],
        };
        // Four points a direction are exact to degree 8 − D, and the products have degree 4.
        for point in simplex_rule::<D>(4) {
            let mut weights = [0.0; 4];
            (0..=D).for_each(|a| weights[a] = point.weight(a));
            let (shape, slopes) = (shape::<D>(&weights), slopes::<D>(&weights));
            for i in 0..nodes {
                for j in 0..nodes {
                    constants.mass[i][j] += point.share * shape[i] * shape[j];
                    let table = &mut constants.stiffness[i * nodes + j];
                    for (a, row) in table.iter_mut().enumerate() {
                        (0..=D).for_each(|b| row[b] += point.share * slopes[i][a] * slopes[j][b]);
                    }
                }
            }
        }
        for i in 0..nodes {
            constants.share[i] = constants.mass[i][..nodes].iter().sum();
        }
        constants
    }
}

/// `G` and `V` of a cell, or their derivatives.
pub(crate) struct Forms {
    gram: [[f64; 4]; 4],
    pub(crate) volume: f64,
}

impl Forms {
    /// Those of a cell.
    pub(crate) fn of<const D: usize>(element: &Element<D>) -> Self {
        let volume = element.volume;
        let g = &element.gradients;
        let gram = std::array::from_fn(|a| std::array::from_fn(|b| volume * dot(&g[a], &g[b])));
        Self { gram, volume }
    }

    /// Their derivatives where the vertices move with the velocity gradient `w`:
    /// `dG_ab/ds = V [div w (g_a·g_b) − g_a·(∇w + ∇wᵀ) g_b]`, `dV/ds = V div w`.
    pub(crate) fn rate<const D: usize>(element: &Element<D>, w: &[[f64; D]; D]) -> Self {
        let (volume, divergence) = (element.volume, divergence(w));
        let moved = element.gradients.map(|g| -> [f64; D] {
            std::array::from_fn(|k| divergence * g[k] - (0..D).map(|l| (w[k][l] + w[l][k]) * g[l]).sum::<f64>())
        });
        let g = &element.gradients;
        let gram = std::array::from_fn(|a| std::array::from_fn(|b| volume * dot(&g[a], &moved[b])));
        Self { gram, volume: volume * divergence }
    }

    /// Entry `(i, j)` of `K`, or of its derivative.
    pub(crate) fn entry<const D: usize>(
        &self,
        law: &ReactionDiffusion,
        constants: &QuadraticConstants,
        (i, j): (usize, usize),
    ) -> f64 {
        let table = &constants.stiffness[i * node_count(D) + j];
        let mut stiffness = 0.0;
        for (row, gram) in table.iter().zip(&self.gram).take(D + 1) {
            (0..=D).for_each(|b| stiffness += row[b] * gram[b]);
        }
        law.diffusion * stiffness + law.degradation * self.volume * constants.mass[i][j]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_one_at_their_node_and_zero_at_the_others() {
        let mut places = vec![[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        for (a, b) in local_edges(3) {
            let mut place = [0.0; 4];
            (place[a], place[b]) = (0.5, 0.5);
            places.push(place);
        }
        for (i, place) in places.iter().enumerate() {
            let shape = shape::<3>(place);
            (0..10).for_each(|j| assert_eq!(shape[j], f64::from(u8::from(i == j))));
        }
    }

    #[test]
    fn the_constants_are_those_of_the_books() {
        let plane = QuadraticConstants::new::<2>();
        let space = QuadraticConstants::new::<3>();
        for (value, known) in [
            (plane.mass[0][0], 6.0 / 180.0),
            (plane.mass[0][1], -1.0 / 180.0),
            (plane.mass[3][3], 32.0 / 180.0),
            (plane.mass[3][4], 16.0 / 180.0),
            // Edge (0, 1) does not touch corner 2.
            (plane.mass[2][3], -4.0 / 180.0),
            (plane.share[0], 0.0),
            (plane.share[4], 1.0 / 3.0),
            (space.share[0], -1.0 / 20.0),
            (space.share[9], 1.0 / 5.0),
        ] {
            assert!((value - known).abs() < 1e-15, "{value} {known}");
        }
    }
}
