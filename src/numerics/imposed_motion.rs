//! Motion imposed on the vertices of a body, proportional to one load.
//!
//! A component is free, or follows `u = s·amplitude`. The held components must leave no rigid motion free: the Gram matrix of
//! the rigid motions at them has to be regular.

use nalgebra::DMatrix;

use crate::numerics::sparse::PRESCRIBED;

/// The imposed motion: for every vertex and component, nothing, or an amplitude (µm) with `u = s·amplitude`.
#[derive(Debug, Clone, PartialEq)]
pub struct Prescribed<const D: usize> {
    amplitudes: Vec<[Option<f64>; D]>,
}

impl<const D: usize> Prescribed<D> {
    /// Nothing imposed on any of `vertices` vertices.
    pub fn none(vertices: usize) -> Self {
        Self { amplitudes: vec![[None; D]; vertices] }
    }

    /// Imposes `u = s·amplitude` (µm) on one component of a vertex; amplitude zero holds it. Out of range: no effect.
    pub fn impose(&mut self, vertex: usize, component: usize, amplitude: f64) {
        if let Some(slot) = self.amplitudes.get_mut(vertex).and_then(|slots| slots.get_mut(component)) {
            *slot = Some(amplitude);
        }
    }

    /// Imposes `u = s·amplitude` on all components of a vertex: a clamp.
    pub fn impose_all(&mut self, vertex: usize, amplitude: [f64; D]) {
        (0..D).for_each(|component| self.impose(vertex, component, amplitude[component]));
    }

    /// The amplitudes, one entry a vertex.
    pub fn amplitudes(&self) -> &[[Option<f64>; D]] {
        &self.amplitudes
    }

    /// Rows of the free unknowns in a system, numbered in order, and their number; [`PRESCRIBED`] where motion is imposed. Flat,
    /// stride `D`.
    pub fn number_free(&self) -> (Vec<u32>, usize) {
        let mut free = 0;
        let row = |amplitude: &Option<f64>| match amplitude {
            Some(_) => PRESCRIBED,
            None => {
                free += 1;
                free - 1
            }
        };
        let rows = self.amplitudes.iter().flatten().map(row).collect();
        (rows, free as usize)
    }

    /// Whether, on a mesh with these vertices (µm), no rigid motion (`D` translations, `D(D−1)/2` rotations) vanishes at all
    /// held components. Assumes that the mesh is connected.
    pub fn holds_rigidly(&self, vertices: &[[f64; D]]) -> bool {
        let size = largest_extent(vertices);
        let origin = vertices.first().copied().unwrap_or([0.0; D]);
        let planes: Vec<(usize, usize)> = (0..D).flat_map(|i| (i + 1..D).map(move |j| (i, j))).collect();
        let motions = D + planes.len();
        let mut gram = DMatrix::<f64>::zeros(motions, motions);
        for (x, held) in vertices.iter().zip(&self.amplitudes) {
            for component in (0..D).filter(|&component| held[component].is_some()) {
                let arm = |axis: usize| (x[axis] - origin[axis]) / size;
                let motion = |m: usize| match m.checked_sub(D).map(|plane| planes[plane]) {
                    None => f64::from(u8::from(m == component)),
                    Some((i, j)) if j == component => arm(i),
                    Some((i, j)) if i == component => -arm(j),
                    Some(_) => 0.0,
                };
                for a in 0..motions {
                    for b in 0..motions {
                        gram[(a, b)] += motion(a) * motion(b);
                    }
                }
            }
        }
        let largest = gram.trace();
        gram.symmetric_eigenvalues().min() > 1e-12 * largest
    }
}

/// Largest side of the box around some points.
pub fn largest_extent<const D: usize>(points: &[[f64; D]]) -> f64 {
    let along = |k: usize| {
        let bounds =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x[k]), high.max(x[k])));
        bounds.1 - bounds.0
    };
    (0..D).map(along).fold(0.0, f64::max)
}
