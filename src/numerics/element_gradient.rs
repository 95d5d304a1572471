//! Gradients as the elements have them, their mean at the nodes, and both their derivatives while the cells deform.
//!
//! A P1 gradient is constant in a cell, a P2 gradient linear: its values at the corners say all. Where the vertices move at
//! `w = dx/ds` a barycentric gradient turns by `dg_a/ds = −∇wᵀ g_a`, so for `∇c = Σ_a s_a g_a`
//!
//! ```text
//! d(∇c)/ds = Σ_a s_a' g_a − ∇wᵀ ∇c.
//! ```
//!
//! The mean at a node weighs the cells around it by their volumes: continuous, of order 2 for P2 elements whatever the mesh,
//! also where a source ends, since each cell knows its own side.

use crate::numerics::cue_element::{Element, divergence};
use crate::numerics::quadratic_element::{local_edges, slopes};
use crate::numerics::quadratic_field::QuadraticNodes;
use crate::numerics::simplex_mesh::SimplexMesh;

/// A field at nodes and the motion of the mesh that carries it.
#[derive(Debug, Clone, Copy)]
pub struct MovingField<'a, const D: usize> {
    /// Where the vertices are (µm).
    pub coordinates: &'a [[f64; D]],
    /// dx/ds of the vertices.
    pub velocity: &'a [[f64; D]],
    /// The field, one entry a node.
    pub values: &'a [f64],
    /// Its derivative along s, one entry a node.
    pub rates: &'a [f64],
}

/// Vectors and their derivatives along s, of the same length.
pub type WithRates<const D: usize> = (Vec<[f64; D]>, Vec<[f64; D]>);

/// ∇c of a P1 field and d(∇c)/ds, one entry a cell (unit of the field per µm).
pub fn linear_gradients<const D: usize>(mesh: &SimplexMesh<D>, field: &MovingField<D>) -> WithRates<D> {
    let of_cell = |cell: usize| {
        let element = Element::new(mesh, field.coordinates, cell);
        let at = |nodal: &[f64]| {
            let mut slope = [0.0; 4];
            element.corners.iter().zip(&mut slope).for_each(|(&v, slope)| *slope = nodal[v as usize]);
            slope
        };
        let w = element.velocity_gradient(field.velocity);
        combine(&element, &w, &at(field.values), &at(field.rates))
    };
    (0..mesh.cell_count()).map(of_cell).unzip()
}

/// ∇c of a P2 field and d(∇c)/ds at the corners of every cell, flat with stride `D + 1` (unit of the field per µm).
pub fn corner_gradients<const D: usize>(
    mesh: &SimplexMesh<D>,
    nodes: &QuadraticNodes<D>,
    field: &MovingField<D>,
) -> WithRates<D> {
    let corners: Vec<_> = (0..=D)
        .map(|corner| {
            let mut weights = [0.0; 4];
            weights[corner] = 1.0;
            slopes::<D>(&weights)
        })
        .collect();
    let of_cell = |cell: usize| {
        let element = Element::new(mesh, field.coordinates, cell);
        let w = element.velocity_gradient(field.velocity);
        corners.iter().map(move |slopes| {
            let at = |nodal: &[f64]| {
                let mut slope = [0.0; 4];
                for (&node, row) in nodes.cell(cell).iter().zip(slopes) {
                    (0..=D).for_each(|a| slope[a] += nodal[node as usize] * row[a]);
                }
                slope
            };
            combine(&element, &w, &at(field.values), &at(field.rates))
        })
    };
    (0..mesh.cell_count()).flat_map(of_cell).unzip()
}

/// Volume-weighted mean of ∇c over the cells around each node, and its derivative along s (unit of the field per µm).
pub fn averaged_gradients<const D: usize>(
    mesh: &SimplexMesh<D>,
    nodes: &QuadraticNodes<D>,
    field: &MovingField<D>,
) -> WithRates<D> {
    let (gradients, rates) = corner_gradients(mesh, nodes, field);
    let mut sums = vec![([0.0; D], [0.0; D], 0.0, 0.0); nodes.count()];
    for cell in 0..mesh.cell_count() {
        let element = Element::new(mesh, field.coordinates, cell);
        let volume = element.volume;
        let growth = divergence(&element.velocity_gradient(field.velocity)) * volume;
        let first = cell * (D + 1);
        let ends = (0..=D).map(|a| (a, a)).chain(local_edges(D));
        for (&node, (a, b)) in nodes.cell(cell).iter().zip(ends) {
            let (sum, rate, total, change) = &mut sums[node as usize];
            for k in 0..D {
                let value = 0.5 * (gradients[first + a][k] + gradients[first + b][k]);
                sum[k] += volume * value;
                rate[k] += volume * 0.5 * (rates[first + a][k] + rates[first + b][k]) + growth * value;
            }
            *total += volume;
            *change += growth;
        }
    }
    let mean = |(sum, rate, total, change): ([f64; D], [f64; D], f64, f64)| {
        let mean = sum.map(|x| x / total);
        (mean, std::array::from_fn(|k| (rate[k] - change * mean[k]) / total))
    };
    sums.into_iter().map(mean).unzip()
}

/// `Σ_a s_a g_a` and its derivative.
fn combine<const D: usize>(
    element: &Element<D>,
    w: &[[f64; D]; D],
    slope: &[f64; 4],
    slope_rate: &[f64; 4],
) -> ([f64; D], [f64; D]) {
    let sum = |slope: &[f64; 4]| -> [f64; D] {
        std::array::from_fn(|k| (0..=D).map(|a| slope[a] * element.gradients[a][k]).sum())
    };
    let (gradient, rate) = (sum(slope), sum(slope_rate));
    let turned = |k: usize| (0..D).map(|l| w[l][k] * gradient[l]).sum::<f64>();
    (gradient, std::array::from_fn(|k| rate[k] - turned(k)))
}
