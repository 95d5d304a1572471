//! A hyperelastic body of P1 elements under imposed motion, eq. (3).
//!
//! The displacement `U` (µm) is linear in every cell, so the deformation gradient is constant there:
//! ```text
//! F = I + Σ_a (U_a − U_0) ⊗ ∇λ_a,     W(U) = Σ_cells V w(F),     f = ∂W/∂U,   f_a = V P(F) ∇λ_a.
//! ```
//! Equilibrium is `f = 0` at the free unknowns; at the prescribed ones `f` is the reaction, the force that the clamp exerts on the
//! body. The motion imposed is `U = s·amplitude` with one load `s` (proportional loading). A body may [grow](crate::numerics::grown)
//! as the load does; energies and forces are then functions of displacement and load.
//!
//! Displacements and forces are flat, stride `D`: component `c` of vertex `v` at `v D + c`. In the plane energies and forces
//! are per length of the third direction (Pa µm², Pa µm).

use rayon::prelude::*;
use std::sync::Arc;

pub use crate::numerics::imposed_motion::Prescribed;

use crate::numerics::dissection::nested_dissection;
use crate::numerics::grown::{Grown, Growth};
use crate::numerics::imposed_motion::largest_extent;
use crate::numerics::material::{Material, Tensor, jacobian, principal_stretches};
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::sparse::{PRESCRIBED, SparseError, SymmetricMatrix, SymmetricPattern};

/// Corners of a simplex at most.
const MOST_CORNERS: usize = 4;
/// Cells that one task looks at, at least.
const CELLS_A_TASK: usize = 256;
/// Cells whose element matrices are held at once: as many as a cache holds.
const CELLS_A_BATCH: usize = 4096;

/// Why a body could not be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// The imposed motion is of another mesh.
    #[error("motion is imposed on {given} vertices, but the mesh has {wanted}")]
    Length {
        /// Vertices of the imposed motion.
        given: usize,
        /// Vertices of the mesh.
        wanted: usize,
    },
    /// An amplitude is no finite number.
    #[error("the amplitude imposed on component {component} of vertex {vertex} is {amplitude}")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// The component.
        component: usize,
        /// The amplitude.
        amplitude: f64,
    },
    /// The held unknowns leave a rigid motion free.
    #[error("the body can float: {held} held unknowns leave a rigid motion free; hold one more component somewhere")]
    Floating {
        /// Number of prescribed unknowns.
        held: usize,
    },
    /// A factor of growth is not positive and finite, or not one a cell.
    #[error(
        "{given} factors of growth for {cells} cells, the smallest {smallest}: one a cell belongs here, positive and finite"
    )]
    Growth {
        /// Factors given.
        given: usize,
        /// Cells of the mesh.
        cells: usize,
        /// The smallest factor, NaN if one is not finite.
        smallest: f64,
    },
    /// The pattern of the tangent could not be set up.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

/// The cell that is compressed most: the smallest `det F`.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstCell {
    /// The cell.
    pub cell: usize,
    /// Its centroid at rest (µm).
    pub position: Vec<f64>,
    /// Its `det F`.
    pub jacobian: f64,
    /// Its principal stretches, ascending.
    pub stretches: Vec<f64>,
}

impl std::fmt::Display for WorstCell {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (cell, det) = (self.cell, self.jacobian);
        write!(
            out,
            "cell {cell}, at rest at {:.3?} um, det F = {det:.4}, stretches {:.4?}",
            self.position, self.stretches
        )
    }
}

/// A body: a mesh at rest, a material, an imposed motion, and all that follows from them but not from the displacement.
#[derive(Debug)]
pub struct Body<'m, const D: usize> {
    mesh: &'m SimplexMesh<D>,
    material: Arc<dyn Material<D>>,
    prescribed: Prescribed<D>,
    growth: Growth,
    gradients: Vec<[f64; D]>,
    volumes: Vec<f64>,
    rows: Vec<u32>,
    pattern: Arc<SymmetricPattern>,
    size: f64,
    strain_norm: f64,
}

impl<'m, const D: usize> Body<'m, D> {
    /// Precomputes reference gradients, volumes, the numbering of the free unknowns and the symbolic factorisation.
    ///
    /// # Errors
    /// The imposed motion is of another mesh, is not finite, or leaves the body floating; memory.
    pub fn new(
        mesh: &'m SimplexMesh<D>,
        material: Arc<dyn Material<D>>,
        prescribed: Prescribed<D>,
    ) -> Result<Self, BodyError> {
        check_prescribed(mesh, &prescribed)?;
        let stride = SimplexMesh::<D>::STRIDE;
        let mut gradients = vec![[0.0; D]; mesh.cell_count() * stride];
        let volumes: Vec<f64> = gradients
            .chunks_exact_mut(stride)
            .enumerate()
            .map(|(cell, rows)| mesh.barycentric_gradients(mesh.vertices(), cell, rows))
            .collect();
        let (rows, _) = prescribed.number_free();
        let elements: Vec<u32> =
            mesh.cells().iter().flat_map(|&v| rows[v as usize * D..(v as usize + 1) * D].iter().copied()).collect();
        let order: Vec<u32> = nested_dissection(mesh.vertices(), mesh.cells(), stride)
            .into_iter()
            .flat_map(|v| &rows[v as usize * D..(v as usize + 1) * D])
            .copied()
            .filter(|&row| row != PRESCRIBED)
            .collect();
        let pattern = SymmetricPattern::in_order(&order, &elements, stride * D)?;
        let volume: f64 = volumes.iter().sum();
        let strain_norm = (small_strain_stiffness(material.as_ref()) * volume).sqrt();
        let size = largest_extent(mesh.vertices());
        let growth = Growth::default();
        Ok(Self { mesh, material, prescribed, growth, gradients, volumes, rows, pattern, size, strain_norm })
    }

    /// The body, growing with the load.
    ///
    /// # Errors
    /// Factors that are not one a cell, or not positive and finite.
    pub fn growing(mut self, growth: Growth) -> Result<Self, BodyError> {
        let (given, cells) = (growth.factors().len(), self.mesh.cell_count());
        let unsound = growth.factors().iter().any(|factor| !factor.is_finite());
        let smallest = if unsound { f64::NAN } else { growth.factors().iter().copied().fold(f64::INFINITY, f64::min) };
        if given != 0 && (given != cells || smallest.is_nan() || smallest <= 0.0) {
            return Err(BodyError::Growth { given, cells, smallest });
        }
        self.growth = growth;
        Ok(self)
    }

    /// The law of a cell at a load: the material, after what has grown there.
    pub fn law(&self, load: f64, cell: usize) -> Grown<'_, D> {
        Grown { law: self.material.as_ref(), factor: self.growth.factor(load, cell) }
    }

    /// The mesh at rest.
    pub fn mesh(&self) -> &'m SimplexMesh<D> {
        self.mesh
    }

    /// The material.
    pub fn material(&self) -> &dyn Material<D> {
        self.material.as_ref()
    }

    /// The imposed motion.
    pub fn prescribed(&self) -> &Prescribed<D> {
        &self.prescribed
    }

    /// Pattern of the tangent at the free unknowns.
    pub fn pattern(&self) -> &Arc<SymmetricPattern> {
        &self.pattern
    }

    /// Number of all unknowns, free and prescribed: the length of a displacement.
    pub fn unknowns(&self) -> usize {
        self.rows.len()
    }

    /// Largest extent of the body at rest (µm).
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Energy norm (root of the unit of energy) of a unit strain everywhere, by the stiffness at rest: times a strain it is a
    /// scale for energy norms.
    pub fn strain_norm(&self) -> f64 {
        self.strain_norm
    }

    /// Sets the prescribed components of a displacement to `load` times their amplitude.
    pub fn impose(&self, load: f64, displacement: &mut [f64]) {
        for (slot, amplitude) in displacement.iter_mut().zip(self.prescribed.amplitudes().iter().flatten()) {
            if let Some(amplitude) = amplitude {
                *slot = load * amplitude;
            }
        }
    }

    /// The deformation gradient of a cell (dimensionless).
    pub fn deformation_gradient(&self, displacement: &[f64], cell: usize) -> Tensor<D> {
        self.displacement_gradient(displacement, cell) + Tensor::identity()
    }

    fn displacement_gradient(&self, displacement: &[f64], cell: usize) -> Tensor<D> {
        let corners = self.mesh.cell(cell);
        let gradients = self.cell_gradients(cell);
        let at = |vertex: u32, component: usize| displacement[vertex as usize * D + component];
        Tensor::from_fn(|i, k| (1..=D).map(|a| (at(corners[a], i) - at(corners[0], i)) * gradients[a][k]).sum::<f64>())
    }

    fn cell_gradients(&self, cell: usize) -> &[[f64; D]] {
        let stride = SimplexMesh::<D>::STRIDE;
        &self.gradients[cell * stride..(cell + 1) * stride]
    }

    /// Whether the material may be used in every cell: `det F > 0` everywhere, for the common laws.
    pub fn admissible(&self, load: f64, displacement: &[f64]) -> bool {
        let in_cell = |cell| self.law(load, cell).admissible(&self.deformation_gradient(displacement, cell));
        (0..self.mesh.cell_count()).all(in_cell)
    }

    /// The smallest `det F` and its cell (the first of equals); `(+∞, 0)` for a mesh without cells, NaN counts as smallest.
    pub fn lowest_jacobian(&self, displacement: &[f64]) -> (f64, usize) {
        let mut lowest = (f64::INFINITY, 0);
        for cell in 0..self.mesh.cell_count() {
            let j = jacobian(&self.deformation_gradient(displacement, cell));
            if j.is_nan() || j < lowest.0 {
                lowest = (j, cell);
            }
        }
        lowest
    }

    /// The cell of the smallest `det F`, with what a message needs.
    pub fn worst_cell(&self, displacement: &[f64]) -> WorstCell {
        let (jacobian, cell) = self.lowest_jacobian(displacement);
        if cell >= self.mesh.cell_count() {
            return WorstCell { cell, position: Vec::new(), jacobian, stretches: Vec::new() };
        }
        let corners = self.mesh.cell(cell);
        let mean = |k: usize| corners.iter().map(|&v| self.mesh.vertices()[v as usize][k]).sum::<f64>();
        let position = (0..D).map(|k| mean(k) / corners.len() as f64).collect();
        let stretches = principal_stretches(&self.deformation_gradient(displacement, cell)).to_vec();
        WorstCell { cell, position, jacobian, stretches }
    }

    /// Strain energy `W(U)` (Pa µm^D).
    pub fn energy(&self, load: f64, displacement: &[f64]) -> f64 {
        let density = |cell| self.law(load, cell).energy(&self.deformation_gradient(displacement, cell));
        self.in_each_cell(density).iter().zip(&self.volumes).map(|(density, volume)| volume * density).sum()
    }

    /// Internal forces `f = ∂W/∂U` (Pa µm^(D−1)) at all unknowns: zero at the free ones in equilibrium, the reaction (force of
    /// the clamp on the body) at the prescribed ones.
    pub fn internal_forces(&self, load: f64, displacement: &[f64]) -> Vec<f64> {
        self.assemble_forces(|cell| self.law(load, cell).stress(&self.deformation_gradient(displacement, cell)))
    }

    /// Increment of the internal forces for an increment of the displacement: the tangent of *all* unknowns times `increment`.
    pub fn force_increment(&self, load: f64, displacement: &[f64], increment: &[f64]) -> Vec<f64> {
        self.assemble_forces(|cell| {
            let gradient = self.deformation_gradient(displacement, cell);
            self.law(load, cell).stress_increment(&gradient, &self.displacement_gradient(increment, cell))
        })
    }

    /// Derivative of the internal forces with respect to the load while the displacement changes by `rate` per unit load: the
    /// [increment](Self::force_increment), and `∂P/∂g dg/ds` where the body grows.
    pub fn force_rate(&self, load: f64, displacement: &[f64], rate: &[f64]) -> Vec<f64> {
        if self.growth.factors().is_empty() {
            return self.force_increment(load, displacement, rate);
        }
        self.assemble_forces(|cell| {
            let (law, gradient) = (self.law(load, cell), self.deformation_gradient(displacement, cell));
            law.stress_increment(&gradient, &self.displacement_gradient(rate, cell))
                + law.stress_by_growth(&gradient) * self.growth.slope(cell)
        })
    }

    /// What `of` says of each cell, found in parallel; sums over cells are taken in their order, so that bits do not depend on
    /// the number of threads.
    fn in_each_cell<T: Send>(&self, of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..self.mesh.cell_count()).into_par_iter().with_min_len(CELLS_A_TASK).map(of).collect()
    }

    fn assemble_forces(&self, stress: impl Fn(usize) -> Tensor<D> + Sync + Send) -> Vec<f64> {
        let mut forces = vec![0.0; self.rows.len()];
        for (cell, weighted) in self.in_each_cell(|cell| stress(cell) * self.volumes[cell]).into_iter().enumerate() {
            for (&vertex, gradient) in self.mesh.cell(cell).iter().zip(self.cell_gradients(cell)) {
                for i in 0..D {
                    forces[vertex as usize * D + i] += (0..D).map(|k| weighted[(i, k)] * gradient[k]).sum::<f64>();
                }
            }
        }
        forces
    }

    /// Sum of the forces (see [`Self::internal_forces`]) at some vertices: the resultant reaction of a clamped edge.
    pub fn resultant(&self, forces: &[f64], vertices: impl IntoIterator<Item = usize>) -> [f64; D] {
        let mut sum = [0.0; D];
        for vertex in vertices {
            (0..D).for_each(|i| sum[i] += forces[vertex * D + i]);
        }
        sum
    }

    /// The free entries of a vector over all unknowns, in the order of the rows of the tangent.
    pub fn restrict(&self, all: &[f64]) -> Vec<f64> {
        let free = self.rows.iter().zip(all).filter(|(row, _)| **row != PRESCRIBED);
        free.map(|(_, value)| *value).collect()
    }

    /// `all += factor · free` at the free unknowns.
    pub fn add_free(&self, factor: f64, free: &[f64], all: &mut [f64]) {
        for (row, slot) in self.rows.iter().zip(all) {
            if *row != PRESCRIBED {
                *slot += factor * free[*row as usize];
            }
        }
    }

    /// Assembles the tangent `K = ∂f/∂U` of the free unknowns, `K_(ai)(bk) = V Σ ∂P_iJ/∂F_kL ∂_Jλ_a ∂_Lλ_b`, into a matrix of
    /// this body's [`Self::pattern`].
    pub fn assemble_tangent(&self, load: f64, displacement: &[f64], tangent: &mut SymmetricMatrix) {
        let columns_of = |cell: usize| {
            let (law, gradient) = (self.law(load, cell), self.deformation_gradient(displacement, cell));
            let mut columns = [[Tensor::<D>::zeros(); D]; MOST_CORNERS];
            for (shape, columns) in self.cell_gradients(cell).iter().zip(&mut columns) {
                for (k, column) in columns.iter_mut().enumerate() {
                    let increment = Tensor::from_fn(|i, j| if i == k { self.volumes[cell] * shape[j] } else { 0.0 });
                    *column = law.stress_increment(&gradient, &increment);
                }
            }
            columns
        };
        tangent.clear();
        let mut batch = Vec::new();
        for first in (0..self.mesh.cell_count()).step_by(CELLS_A_BATCH) {
            let cells = first..self.mesh.cell_count().min(first + CELLS_A_BATCH);
            cells.clone().into_par_iter().with_min_len(CELLS_A_TASK).map(columns_of).collect_into_vec(&mut batch);
            for (cell, columns) in cells.zip(&batch) {
                let shapes = self.cell_gradients(cell);
                tangent.add_element(cell, |row, column| {
                    let (shape, stress) = (&shapes[row / D], &columns[column / D][column % D]);
                    (0..D).map(|j| stress[(row % D, j)] * shape[j]).sum()
                });
            }
        }
    }
}

fn check_prescribed<const D: usize>(mesh: &SimplexMesh<D>, prescribed: &Prescribed<D>) -> Result<(), BodyError> {
    let (given, wanted) = (prescribed.amplitudes().len(), mesh.vertex_count());
    if given != wanted {
        return Err(BodyError::Length { given, wanted });
    }
    for (vertex, amplitudes) in prescribed.amplitudes().iter().enumerate() {
        for (component, amplitude) in amplitudes.iter().enumerate() {
            if let Some(amplitude) = amplitude.filter(|value| !value.is_finite()) {
                return Err(BodyError::NotFinite { vertex, component, amplitude });
            }
        }
    }
    if prescribed.holds_rigidly(mesh.vertices()) {
        return Ok(());
    }
    Err(BodyError::Floating { held: prescribed.amplitudes().iter().flatten().flatten().count() })
}

fn small_strain_stiffness<const D: usize>(material: &dyn Material<D>) -> f64 {
    let rest = Tensor::<D>::identity();
    let response = |k: usize| {
        let mut stretch = Tensor::zeros();
        stretch[(k, k)] = 1.0;
        material.stress_increment(&rest, &stretch)[(k, k)]
    };
    (0..D).map(response).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::material::{Lame, NeoHookean, StVenantKirchhoff};
    use crate::numerics::simplex_mesh::structured_rectangle;

    fn lame() -> Lame {
        Lame::from_young_poisson(1.0, 0.3).unwrap()
    }

    fn clamped_below<'m, const D: usize>(
        mesh: &'m SimplexMesh<D>,
        material: Arc<dyn Material<D>>,
    ) -> Result<Body<'m, D>, BodyError> {
        let mut prescribed = Prescribed::none(mesh.vertex_count());
        for (vertex, x) in mesh.vertices().iter().enumerate() {
            if x[D - 1] == 0.0 {
                prescribed.impose_all(vertex, [0.0; D]);
            }
        }
        Body::new(mesh, material, prescribed)
    }

    /// A cube of six tetrahedra around its diagonal.
    fn cube() -> SimplexMesh<3> {
        let vertices = (0..8).map(|v| [f64::from(v & 1), f64::from(v >> 1 & 1), f64::from(v >> 2)]).collect();
        let cells = vec![0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7];
        SimplexMesh::new(vertices, cells).unwrap()
    }

    fn wobble(n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|i| size * (1.7 * i as f64).sin()).collect()
    }

    fn check_forces_and_tangent<const D: usize>(body: &Body<'_, D>) {
        let (u, du) = (wobble(body.unknowns(), 0.02), wobble(2 * body.unknowns(), 1.0).split_off(body.unknowns()));
        let shifted = |h: f64| -> Vec<f64> { u.iter().zip(&du).map(|(u, d)| u + h * d).collect() };
        let h = 1e-4;
        let slope = (body.energy(0.4, &shifted(h)) - body.energy(0.4, &shifted(-h))) / (2.0 * h);
        let work: f64 = body.internal_forces(0.4, &u).iter().zip(&du).map(|(f, d)| f * d).sum();
        assert!((slope - work).abs() < 1e-6 * work.abs().max(1.0), "{slope} {work}");
        let (after, before) = (body.internal_forces(0.4, &shifted(h)), body.internal_forces(0.4, &shifted(-h)));
        for (i, increment) in body.force_increment(0.4, &u, &du).iter().enumerate() {
            assert!(((after[i] - before[i]) / (2.0 * h) - increment).abs() < 1e-5);
        }
        let mut only_free = vec![0.0; body.unknowns()];
        let free = body.restrict(&du);
        body.add_free(1.0, &free, &mut only_free);
        let mut tangent = SymmetricMatrix::zero(body.pattern());
        body.assemble_tangent(0.4, &u, &mut tangent);
        let direct = body.restrict(&body.force_increment(0.4, &u, &only_free));
        for (assembled, direct) in tangent.multiply(&free).iter().zip(&direct) {
            assert!((assembled - direct).abs() < 1e-13 * 50.0);
        }
    }

    #[test]
    fn forces_are_the_derivative_of_the_energy_and_the_tangent_that_of_the_forces() {
        let (plane, solid) = (structured_rectangle(1.5, 1.0, 3, 2).unwrap(), cube());
        check_forces_and_tangent(&clamped_below(&plane, Arc::new(StVenantKirchhoff { lame: lame() })).unwrap());
        check_forces_and_tangent(&clamped_below(&plane, Arc::new(NeoHookean { lame: lame() })).unwrap());
        check_forces_and_tangent(&clamped_below(&solid, Arc::new(StVenantKirchhoff { lame: lame() })).unwrap());
        check_forces_and_tangent(&clamped_below(&solid, Arc::new(NeoHookean { lame: lame() })).unwrap());
    }

    #[test]
    fn internal_forces_balance_and_have_no_moment() {
        let mesh = structured_rectangle(1.5, 1.0, 3, 2).unwrap();
        let body = clamped_below(&mesh, Arc::new(StVenantKirchhoff { lame: lame() })).unwrap();
        let u = wobble(body.unknowns(), 0.03);
        let forces = body.internal_forces(0.4, &u);
        let [x, y] = body.resultant(&forces, 0..mesh.vertex_count());
        let moment: f64 = (0..mesh.vertex_count())
            .map(|v| {
                let [a, b] = mesh.vertices()[v];
                (a + u[2 * v]) * forces[2 * v + 1] - (b + u[2 * v + 1]) * forces[2 * v]
            })
            .sum();
        assert!(x.abs() < 1e-15 * 50.0 && y.abs() < 1e-15 * 50.0 && moment.abs() < 1e-15 * 100.0, "{x} {y} {moment}");
    }

    #[test]
    fn a_body_that_can_float_or_spin_is_refused_and_one_held_at_three_places_is_not() {
        let mesh = structured_rectangle(1.5, 1.0, 3, 2).unwrap();
        let held = |places: &[(usize, usize)]| {
            let mut prescribed = Prescribed::none(mesh.vertex_count());
            places.iter().for_each(|&(vertex, component)| prescribed.impose(vertex, component, 0.1));
            Body::new(&mesh, Arc::new(NeoHookean { lame: lame() }), prescribed).map(|_| ())
        };
        assert_eq!(held(&[]), Err(BodyError::Floating { held: 0 }));
        assert_eq!(held(&[(0, 1), (1, 1), (2, 1)]), Err(BodyError::Floating { held: 3 }));
        assert_eq!(held(&[(0, 0), (0, 1)]), Err(BodyError::Floating { held: 2 }));
        assert_eq!(held(&[(0, 1), (3, 1), (1, 0)]), Ok(()));
    }

    #[test]
    fn motion_of_another_mesh_and_motion_without_measure_are_refused() {
        let mesh = structured_rectangle(1.0, 1.0, 1, 1).unwrap();
        let material = Arc::new(NeoHookean { lame: lame() });
        let body = Body::new(&mesh, material.clone(), Prescribed::none(3)).map(|_| ());
        assert_eq!(body, Err(BodyError::Length { given: 3, wanted: 4 }));
        let mut prescribed = Prescribed::none(4);
        prescribed.impose(2, 1, f64::NAN);
        assert!(matches!(
            Body::new(&mesh, material, prescribed),
            Err(BodyError::NotFinite { vertex: 2, component: 1, .. })
        ));
    }

    #[test]
    fn the_worst_cell_is_the_one_pressed_most() {
        let mesh = structured_rectangle(2.0, 1.0, 2, 1).unwrap();
        let body = clamped_below(&mesh, Arc::new(NeoHookean { lame: lame() })).unwrap();
        let mut u = vec![0.0; body.unknowns()];
        u[2 * 5 + 1] = -0.4;
        let worst = body.worst_cell(&u);
        assert_eq!(worst.cell, 2);
        assert!((worst.jacobian - 0.6).abs() < 1e-15 && (worst.position[0] - 5.0 / 3.0).abs() < 1e-15, "{worst}");
    }
}
