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

impl ReactionDiffusion {
    /// Decay length ℓ = √(D/k) (µm).
    pub fn decay_length(&self) -> f64 {
        (self.diffusion / self.degradation).sqrt()
    }
}

/// Geometry of one cell.
pub(crate) struct Element<'a, const D: usize> {
    pub(crate) corners: &'a [u32],
    pub(crate) gradients: [[f64; D]; 4],
    pub(crate) volume: f64,
}

impl<'a, const D: usize> Element<'a, D> {
    pub(crate) fn new(mesh: &'a SimplexMesh<D>, coordinates: &[[f64; D]], cell: usize) -> Self {
        let mut gradients = [[0.0; D]; 4];
        let volume = mesh.barycentric_gradients(coordinates, cell, &mut gradients[..=D]);
        Self { corners: mesh.cell(cell), gradients, volume }
    }

    /// Entry `(i, j)` of the consistent mass matrix over V.
    fn consistent_mass(i: usize, j: usize) -> f64 {
        let d = D as f64;
        if i == j { 2.0 / ((d + 1.0) * (d + 2.0)) } else { 1.0 / ((d + 1.0) * (d + 2.0)) }
    }

    /// Entry `(i, j)` of what couples vertices: diffusion, and decay if its mass is consistent.
    fn coupling(&self, law: &ReactionDiffusion, i: usize, j: usize) -> f64 {
        let stiffness = law.diffusion * dot(&self.gradients[i], &self.gradients[j]);
        let decay = match law.mass {
            Mass::Lumped => 0.0,
            Mass::Consistent => law.degradation * Self::consistent_mass(i, j),
        };
        self.volume * (stiffness + decay)
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

    /// Subtracts the cell's share of `K' c` from `rate`: that of [`Self::coupling`].
    pub(crate) fn subtract_coupling_rate(
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
        let consistent = f64::from(u8::from(law.mass == Mass::Consistent));
        for (i, &vertex) in self.corners.iter().enumerate() {
            let at = |(j, &v): (usize, &u32)| Self::consistent_mass(i, j) * field[v as usize];
            let decay: f64 = consistent * self.corners.iter().enumerate().map(at).sum::<f64>();
            let change = dot(&self.gradients[i], &flux) + law.degradation * divergence * decay;
            rate[vertex as usize] -= self.volume * change;
        }
    }
}

/// The connectivities of a system in one configuration.
#[derive(Clone, Copy)]
pub(crate) struct Connectivities<'a, const D: usize> {
    /// Carries diffusion (and consistent decay): flipped where the original is not Delaunay.
    pub(crate) coupling: &'a SimplexMesh<D>,
    /// Carries sources and lumped decay, so that these do not jump where an edge flips.
    pub(crate) original: &'a SimplexMesh<D>,
}

/// The matrix K of a mesh in one configuration.
pub(crate) fn assemble<const D: usize>(
    law: &ReactionDiffusion,
    meshes: Connectivities<D>,
    coordinates: &[[f64; D]],
    pattern: &Arc<SymmetricPattern>,
) -> SymmetricMatrix {
    let mut matrix = SymmetricMatrix::zero(pattern);
    for cell in 0..meshes.coupling.cell_count() {
        let element = Element::new(meshes.coupling, coordinates, cell);
        matrix.add_element(cell, |i, j| element.coupling(law, i, j));
    }
    if law.mass == Mass::Lumped {
        let mut decay = vec![0.0; meshes.original.vertex_count()];
        add_lumped(meshes.original, coordinates, &mut decay, |element| law.degradation * element.volume);
        matrix.add_diagonal(&decay);
    }
    matrix
}

/// Subtracts `K' c` from `rate` while the vertices move at `velocity`.
pub(crate) fn subtract_matrix_rate<const D: usize>(
    law: &ReactionDiffusion,
    meshes: Connectivities<D>,
    (coordinates, velocity): (&[[f64; D]], &[[f64; D]]),
    field: &[f64],
    rate: &mut [f64],
) {
    for cell in 0..meshes.coupling.cell_count() {
        let element = Element::new(meshes.coupling, coordinates, cell);
        element.subtract_coupling_rate(law, velocity, field, rate);
    }
    if law.mass == Mass::Lumped {
        let mut change = vec![0.0; field.len()];
        add_lumped(meshes.original, coordinates, &mut change, |element| {
            law.degradation * element.volume * divergence(&element.velocity_gradient(velocity))
        });
        (0..field.len()).for_each(|i| rate[i] -= change[i] * field[i]);
    }
}

/// Adds an amount of each cell to its corners in equal parts.
fn add_lumped<const D: usize>(
    mesh: &SimplexMesh<D>,
    coordinates: &[[f64; D]],
    sum: &mut [f64],
    amount: impl Fn(&Element<D>) -> f64,
) {
    for cell in 0..mesh.cell_count() {
        let element = Element::new(mesh, coordinates, cell);
        let part = amount(&element) / (D + 1) as f64;
        element.corners.iter().for_each(|&vertex| sum[vertex as usize] += part);
    }
}

/// div w, the trace of ∇w.
pub(crate) fn divergence<const D: usize>(gradient: &[[f64; D]; D]) -> f64 {
    (0..D).map(|k| gradient[k][k]).sum()
}
