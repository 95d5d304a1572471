//! One cell's share of eq. (2), and its derivative while the cell deforms: the formulas of
//! [`crate::numerics::reaction_diffusion`].

use std::sync::Arc;

use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::sparse::{SymmetricMatrix, SymmetricPattern};
use crate::numerics::vector::dot;

/// How the decay term is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mass {
    /// Row sums on the diagonal: non-negative solutions on Delaunay meshes; the default.
    #[default]
    Lumped,
    /// The exact integral: smaller errors where `k h²/D` is not small, but solutions may go negative.
    Consistent,
}

/// The coefficients of eq. (2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReactionDiffusion {
    /// Diffusion D (µm²/h), positive.
    pub diffusion: f64,
    /// Degradation k (1/h), positive: without flux through the border `k = 0` has no stationary state.
    pub degradation: f64,
    /// How the decay term is integrated.
    pub mass: Mass,
}

/// Geometry of one cell.
pub(crate) struct Element<'a, const D: usize> {
    pub(crate) corners: &'a [u32],
    gradients: [[f64; D]; 4],
    pub(crate) volume: f64,
}

impl<'a, const D: usize> Element<'a, D> {
    pub(crate) fn new(mesh: &'a SimplexMesh<D>, coordinates: &[[f64; D]], cell: usize) -> Self {
        let mut gradients = [[0.0; D]; 4];
        let volume = mesh.barycentric_gradients(coordinates, cell, &mut gradients[..=D]);
        Self { corners: mesh.cell(cell), gradients, volume }
    }

    /// Entry `(i, j)` of the mass matrix over V.
    fn mass(mass: Mass, i: usize, j: usize) -> f64 {
        let d = D as f64;
        match (mass, i == j) {
            (Mass::Lumped, true) => 1.0 / (d + 1.0),
            (Mass::Lumped, false) => 0.0,
            (Mass::Consistent, true) => 2.0 / ((d + 1.0) * (d + 2.0)),
            (Mass::Consistent, false) => 1.0 / ((d + 1.0) * (d + 2.0)),
        }
    }

    fn matrix(&self, law: &ReactionDiffusion, i: usize, j: usize) -> f64 {
        let stiffness = law.diffusion * dot(&self.gradients[i], &self.gradients[j]);
        self.volume * (stiffness + law.degradation * Self::mass(law.mass, i, j))
    }

    /// `∇w` of a nodal velocity: row k, column l holds ∂w_k/∂x_l.
    pub(crate) fn velocity_gradient(&self, velocity: &[[f64; D]]) -> [[f64; D]; D] {
        let mut gradient = [[0.0; D]; D];
        for (corner, &vertex) in self.corners.iter().enumerate() {
            for k in 0..D {
                (0..D).for_each(|l| gradient[k][l] += velocity[vertex as usize][k] * self.gradients[corner][l]);
            }
        }
        gradient
    }

    /// Subtracts `K' c` of the cell from `rate`.
    pub(crate) fn subtract_matrix_rate(
        &self,
        law: &ReactionDiffusion,
        velocity: &[[f64; D]],
        field: &[f64],
        rate: &mut [f64],
    ) {
        let w = self.velocity_gradient(velocity);
        let divergence = divergence(&w);
        let mut slope = [0.0; D];
        for (corner, &vertex) in self.corners.iter().enumerate() {
            (0..D).for_each(|k| slope[k] += field[vertex as usize] * self.gradients[corner][k]);
        }
        let flux: [f64; D] = std::array::from_fn(|k| {
            let strained: f64 = (0..D).map(|l| (w[k][l] + w[l][k]) * slope[l]).sum();
            law.diffusion * (divergence * slope[k] - strained)
        });
        for (i, &vertex) in self.corners.iter().enumerate() {
            let decay: f64 =
                self.corners.iter().enumerate().map(|(j, &v)| Self::mass(law.mass, i, j) * field[v as usize]).sum();
            let change = dot(&self.gradients[i], &flux) + law.degradation * divergence * decay;
            rate[vertex as usize] -= self.volume * change;
        }
    }
}

/// The matrix K of a mesh in one configuration.
pub(crate) fn assemble<const D: usize>(
    law: &ReactionDiffusion,
    mesh: &SimplexMesh<D>,
    coordinates: &[[f64; D]],
    pattern: &Arc<SymmetricPattern>,
) -> SymmetricMatrix {
    let mut matrix = SymmetricMatrix::zero(pattern);
    for cell in 0..mesh.cell_count() {
        let element = Element::new(mesh, coordinates, cell);
        matrix.add_element(cell, |i, j| element.matrix(law, i, j));
    }
    matrix
}

/// div w, the trace of ∇w.
pub(crate) fn divergence<const D: usize>(gradient: &[[f64; D]; D]) -> f64 {
    (0..D).map(|k| gradient[k][k]).sum()
}
