//! Stationary cue fields, eq. (2), in quadratic Lagrange elements: `−D Δc + k c = Σ_j q_j 1_{A_j}`, no flux at the border.
//!
//! Cells are straight-sided; a node stands at every vertex and in the middle of every edge. Of order 3 in c and 2 in ∇c where
//! the solution is smooth, against 2 and 1 of [`crate::numerics::reaction_diffusion`]. The decay term is integrated exactly, so
//! that where `k h²/D` is not small c may fall below zero; no edge is flipped. `k ∫c = Σ q|A|` holds to round-off. The rate
//! `dc/ds` of vertices that move at `w = dx/ds` follows from the same factor, `K c' = f' − K' c`, with the exact `K'`.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::numerics::cue_element::{Element, ReactionDiffusion, divergence};
use crate::numerics::dissection::nested_dissection;
use crate::numerics::quadratic_element::{Forms, QuadraticConstants, local_edges, node_count};
use crate::numerics::reaction_diffusion::{
    Budget, ReactionDiffusionError, Source, WorkCount, check_law, check_length, check_volumes,
};
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::sparse::{Factor, SymmetricMatrix, SymmetricPattern};

/// Numbers of the nodes: the mesh's vertices, then its edges in the order of their ends.
#[derive(Debug, Clone)]
pub struct QuadraticNodes<const D: usize> {
    vertices: usize,
    edges: Vec<[u32; 2]>,
    cells: Vec<u32>,
}

impl<const D: usize> QuadraticNodes<D> {
    /// Nodes of a cell: its corners, then its edges (0, 1), (0, 2), …, (1, 2), ….
    pub const STRIDE: usize = node_count(D);

    /// Numbers the nodes of a mesh.
    pub fn new(mesh: &SimplexMesh<D>) -> Self {
        let edge = |corners: &[u32], (a, b): (usize, usize)| [corners[a].min(corners[b]), corners[a].max(corners[b])];
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(mesh.cell_count() * (Self::STRIDE - D - 1));
        for cell in 0..mesh.cell_count() {
            edges.extend(local_edges(D).map(|pair| edge(mesh.cell(cell), pair)));
        }
        edges.sort_unstable();
        edges.dedup();
        let vertices = mesh.vertex_count();
        let number = |ends: [u32; 2]| (vertices + edges.partition_point(|other| *other < ends)) as u32;
        let mut cells = Vec::with_capacity(mesh.cell_count() * Self::STRIDE);
        for cell in 0..mesh.cell_count() {
            let corners = mesh.cell(cell);
            cells.extend_from_slice(corners);
            cells.extend(local_edges(D).map(|pair| number(edge(corners, pair))));
        }
        Self { vertices, edges, cells }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.vertices + self.edges.len()
    }

    /// How many of them, the first ones, are vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// The nodes of a cell.
    #[inline]
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.cells[cell * Self::STRIDE..(cell + 1) * Self::STRIDE]
    }

    /// The nodes of all cells, flat.
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }

    /// Where the nodes are (µm) when the vertices are at `coordinates`.
    pub fn positions(&self, coordinates: &[[f64; D]]) -> Vec<[f64; D]> {
        let middle = |&[a, b]: &[u32; 2]| -> [f64; D] {
            std::array::from_fn(|k| 0.5 * (coordinates[a as usize][k] + coordinates[b as usize][k]))
        };
        coordinates.iter().copied().chain(self.edges.iter().map(middle)).collect()
    }
}

/// Solves eq. (2) in quadratic elements on one mesh in any number of configurations, keeping the symbolic factor.
#[derive(Debug)]
pub struct QuadraticSolver<'m, const D: usize> {
    mesh: &'m SimplexMesh<D>,
    nodes: Arc<QuadraticNodes<D>>,
    constants: Arc<QuadraticConstants>,
    pattern: Arc<SymmetricPattern>,
    factorisations: usize,
    solves: Arc<AtomicUsize>,
}

impl<'m, const D: usize> QuadraticSolver<'m, D> {
    /// A solver on `mesh`.
    ///
    /// # Errors
    /// The symbolic factorisation ran out of memory.
    pub fn new(mesh: &'m SimplexMesh<D>) -> Result<Self, ReactionDiffusionError> {
        let nodes = Arc::new(QuadraticNodes::new(mesh));
        let (cells, stride) = (nodes.cells(), QuadraticNodes::<D>::STRIDE);
        let order = nested_dissection(&nodes.positions(mesh.vertices()), cells, stride);
        let pattern = SymmetricPattern::in_order(&order, cells, stride)?;
        let constants = Arc::new(QuadraticConstants::new::<D>());
        Ok(Self { mesh, nodes, constants, pattern, factorisations: 0, solves: Arc::default() })
    }

    /// The nodes that fields are given at.
    pub fn nodes(&self) -> &Arc<QuadraticNodes<D>> {
        &self.nodes
    }

    /// Work done so far, by this solver and the systems that it set up.
    pub fn work(&self) -> WorkCount {
        let solves = self.solves.load(Ordering::Relaxed);
        WorkCount { symbolic: 1, factorisations: self.factorisations, solves }
    }

    /// Sets up and factors the system in a configuration (`coordinates`: one entry a vertex, µm). The law's `mass` is not
    /// read: decay is integrated exactly.
    ///
    /// # Errors
    /// D or k not positive; coordinates that do not fit the mesh or turn a cell inside out; a failing factorisation.
    pub fn system<'a>(
        &mut self,
        law: &ReactionDiffusion,
        coordinates: &'a [[f64; D]],
    ) -> Result<QuadraticSystem<'a, D>, ReactionDiffusionError>
    where
        'm: 'a,
    {
        check_law(law)?;
        check_length("coordinates", coordinates.len(), self.mesh.vertex_count())?;
        check_volumes(self.mesh, coordinates)?;
        let mut matrix = SymmetricMatrix::zero(&self.pattern);
        for cell in 0..self.mesh.cell_count() {
            let forms = Forms::of(&Element::new(self.mesh, coordinates, cell));
            matrix.add_element(cell, |i, j| forms.entry::<D>(law, &self.constants, (i, j)));
        }
        let factor = matrix.cholesky()?;
        self.factorisations += 1;
        Ok(QuadraticSystem {
            law: *law,
            mesh: self.mesh,
            nodes: Arc::clone(&self.nodes),
            constants: Arc::clone(&self.constants),
            coordinates,
            factor,
            solves: Arc::clone(&self.solves),
        })
    }

    /// The field c (nM, one entry a node) of the given sources in a configuration.
    ///
    /// # Errors
    /// Those of [`Self::system`] and [`QuadraticSystem::solve`].
    pub fn solve(
        &mut self,
        law: &ReactionDiffusion,
        coordinates: &[[f64; D]],
        sources: &[Source],
    ) -> Result<Vec<f64>, ReactionDiffusionError> {
        self.system(law, coordinates)?.solve(sources)
    }
}

/// A factored system in one configuration.
#[derive(Debug)]
pub struct QuadraticSystem<'a, const D: usize> {
    law: ReactionDiffusion,
    mesh: &'a SimplexMesh<D>,
    nodes: Arc<QuadraticNodes<D>>,
    constants: Arc<QuadraticConstants>,
    coordinates: &'a [[f64; D]],
    factor: Factor,
    solves: Arc<AtomicUsize>,
}

impl<const D: usize> QuadraticSystem<'_, D> {
    /// The load `f_i = ∫ Σ q 1_A φ_i` of sources (nM µm^D/h, one entry a node).
    ///
    /// # Errors
    /// A source that names a cell outside the mesh.
    pub fn load(&self, sources: &[Source]) -> Result<Vec<f64>, ReactionDiffusionError> {
        self.spread(sources, |element, source| source.density * element.volume)
    }

    /// The field of a general load vector (nM µm^D/h, one entry a node).
    ///
    /// # Errors
    /// A load of the wrong length; no scratch memory.
    pub fn solve_load(&self, mut load: Vec<f64>) -> Result<Vec<f64>, ReactionDiffusionError> {
        check_length("the load", load.len(), self.nodes.count())?;
        self.factor.solve(&mut load)?;
        self.solves.fetch_add(1, Ordering::Relaxed);
        Ok(load)
    }

    /// The field c (nM, one entry a node) of sources.
    ///
    /// # Errors
    /// Those of [`Self::load`] and [`Self::solve_load`].
    pub fn solve(&self, sources: &[Source]) -> Result<Vec<f64>, ReactionDiffusionError> {
        self.solve_load(self.load(sources)?)
    }

    /// The field c and its rate dc/ds at the nodes while the vertices move at `velocity` = dx/ds (one entry a vertex, µm per
    /// unit of s).
    ///
    /// # Errors
    /// Those of [`Self::solve`]; a velocity of the wrong length.
    pub fn solve_with_rate(
        &self,
        velocity: &[[f64; D]],
        sources: &[Source],
    ) -> Result<(Vec<f64>, Vec<f64>), ReactionDiffusionError> {
        check_length("the velocity", velocity.len(), self.mesh.vertex_count())?;
        let field = self.solve(sources)?;
        let mut rate = self.spread(sources, |element, source| {
            let divergence = divergence(&element.velocity_gradient(velocity));
            (source.density_rate + source.density * divergence) * element.volume
        })?;
        for cell in 0..self.mesh.cell_count() {
            let element = Element::new(self.mesh, self.coordinates, cell);
            let forms = Forms::rate(&element, &element.velocity_gradient(velocity));
            let nodes = self.nodes.cell(cell);
            for (i, &node) in nodes.iter().enumerate() {
                let entry = |j: usize| forms.entry::<D>(&self.law, &self.constants, (i, j));
                let change: f64 = nodes.iter().enumerate().map(|(j, &other)| entry(j) * field[other as usize]).sum();
                rate[node as usize] -= change;
            }
        }
        let rate = self.solve_load(rate)?;
        Ok((field, rate))
    }

    /// What is released and what decays, for a field of this system.
    ///
    /// # Errors
    /// Those of [`Self::load`]; a field of the wrong length.
    pub fn budget(&self, field: &[f64], sources: &[Source]) -> Result<Budget, ReactionDiffusionError> {
        check_length("the field", field.len(), self.nodes.count())?;
        let content = |cell: usize| {
            let shares = self.nodes.cell(cell).iter().zip(&self.constants.share);
            let mean: f64 = shares.map(|(&node, share)| share * field[node as usize]).sum();
            self.mesh.volume(self.coordinates, cell) * mean
        };
        let degraded = self.law.degradation * (0..self.mesh.cell_count()).map(content).sum::<f64>();
        let released = self.load(sources)?.iter().sum();
        let minimum = field.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Budget { degraded, released, minimum })
    }

    /// Gives an amount of each source cell to its nodes, by their shares.
    fn spread(
        &self,
        sources: &[Source],
        amount: impl Fn(&Element<D>, &Source) -> f64,
    ) -> Result<Vec<f64>, ReactionDiffusionError> {
        let mut sum = vec![0.0; self.nodes.count()];
        let count = self.mesh.cell_count();
        for (source_index, source) in sources.iter().enumerate() {
            for &cell in source.cells {
                if cell as usize >= count {
                    return Err(ReactionDiffusionError::NoSuchCell { source_index, cell, count });
                }
                let given = amount(&Element::new(self.mesh, self.coordinates, cell as usize), source);
                let shares = self.nodes.cell(cell as usize).iter().zip(&self.constants.share);
                shares.for_each(|(&node, share)| sum[node as usize] += share * given);
            }
        }
        Ok(sum)
    }
}
