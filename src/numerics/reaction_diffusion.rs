//! Stationary cue fields, eq. (2): `−D Δc + k c = Σ_j q_j 1_{A_j}` in the current tissue, no flux at its border; P1 elements.
//!
//! With barycentric gradients `g_i` and volume `V` of a cell in `d` dimensions
//!
//! ```text
//! K_ij = D V g_i·g_j + k M_ij        M lumped: V/(d+1) δ_ij     consistent: V (1 + δ_ij)/((d+1)(d+2))
//! f_i  = Σ q V/(d+1)                 over the source cells around vertex i: Σ q|A| is exact on a fitted mesh
//! ```
//!
//! so that `k ∫c = Σ q|A|` holds to round-off. The rate `dc/ds` when the vertices move at `w = dx/ds` follows from the same
//! factor, `K c' = f' − K' c`, with the exact derivatives of the element matrices
//!
//! ```text
//! d(V g_i·g_j)/ds = V [div w (g_i·g_j) − g_i·(∇w + ∇wᵀ) g_j]        dV/ds = V div w
//! ```
//!
//! In the plane, where the stretched mesh is no longer Delaunay the system is set up on the flipped connectivity
//! (same vertices, see [`crate::numerics::delaunay`]), so that lumped solutions stay non-negative. Lumped decay and sources stay
//! on the original connectivity: the stiffness matrix is continuous through a flip, and so is then the field.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::numerics::cue_element::{Connectivities, Element, assemble, divergence, subtract_matrix_rate};
pub use crate::numerics::cue_element::{Mass, ReactionDiffusion};
use crate::numerics::delaunay::{EdgeReport, Triangles, region_labels};
use crate::numerics::dissection::nested_dissection;
use crate::numerics::simplex_mesh::{MeshError, SimplexMesh};
use crate::numerics::sparse::{Factor, SparseError, SymmetricPattern};

/// Connectivities whose symbolic factor is kept, the original apart.
const KEPT_FLIPS: usize = 8;

/// A release region: the whole cells of a fitted mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source<'a> {
    /// Its cells.
    pub cells: &'a [u32],
    /// Release q per current volume (nM/h).
    pub density: f64,
    /// Its rate dq/ds along the load: `−q (d|A|/ds)/|A|` if the total `q|A|` is kept, 0 if q is.
    pub density_rate: f64,
}

impl<'a> Source<'a> {
    /// A source of constant density q (nM/h).
    pub fn new(cells: &'a [u32], density: f64) -> Self {
        Self { cells, density, density_rate: 0.0 }
    }

    /// A source that keeps its `total` release q|A| (nM µm^D/h) while its region deforms: the density, and its rate for the
    /// vertex velocity `dx/ds`, in the configuration `coordinates`.
    pub fn of_total<const D: usize>(
        mesh: &SimplexMesh<D>,
        coordinates: &[[f64; D]],
        velocity: Option<&[[f64; D]]>,
        (cells, total): (&'a [u32], f64),
    ) -> Self {
        let (mut volume, mut rate) = (0.0, 0.0);
        for &cell in cells {
            let element = Element::new(mesh, coordinates, cell as usize);
            volume += element.volume;
            rate += velocity.map_or(0.0, |w| element.volume * divergence(&element.velocity_gradient(w)));
        }
        Self { cells, density: total / volume, density_rate: -total * rate / (volume * volume) }
    }
}

/// Why a field could not be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReactionDiffusionError {
    /// D is not positive.
    #[error("the diffusion coefficient is {0} µm²/h, which must be positive")]
    Diffusion(f64),
    /// k is not positive.
    #[error(
        "the degradation is {0} /h, which must be positive: without flux at the border nothing else removes the cue"
    )]
    Degradation(f64),
    /// A list does not fit the mesh.
    #[error("{what} has {given} entries where {wanted} are needed")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its entries.
        given: usize,
        /// One for each vertex, or node.
        wanted: usize,
    },
    /// A source names a cell that does not exist.
    #[error("source {source_index} names cell {cell}, but there are only {count} cells")]
    NoSuchCell {
        /// Index of the source.
        source_index: usize,
        /// The cell.
        cell: u32,
        /// Number of cells.
        count: usize,
    },
    /// A cell is flat or inside out in this configuration.
    #[error("cell {cell} has the signed volume {volume} in this configuration")]
    Inverted {
        /// The cell.
        cell: usize,
        /// Its signed volume.
        volume: f64,
    },
    /// The flipped cells do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The linear solver failed.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

/// How much a solver has worked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkCount {
    /// Symbolic factorisations: one a connectivity.
    pub symbolic: usize,
    /// Numeric factorisations.
    pub factorisations: usize,
    /// Right-hand sides solved.
    pub solves: usize,
}

/// Release against decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// k ∫c (nM µm^D/h).
    pub degraded: f64,
    /// Σ q|A| (nM µm^D/h).
    pub released: f64,
    /// Smallest nodal concentration (nM).
    pub minimum: f64,
}

impl Budget {
    /// `|k∫c − Σq|A|| / Σq|A|`.
    pub fn relative_error(&self) -> f64 {
        (self.degraded - self.released).abs() / self.released.abs().max(f64::MIN_POSITIVE)
    }
}

type Topology<const D: usize> = (Arc<SimplexMesh<D>>, Arc<SymmetricPattern>);

/// What a system is set up on: the flipped connectivity, or none while the original is still Delaunay where it can be; and, in
/// the plane, its triangles.
type Chosen<const D: usize> = (Option<Topology<D>>, Option<Triangles>);

/// Solves eq. (2) on one mesh in any number of configurations, keeping the symbolic factor of each connectivity.
///
/// What is kept changes the cost, never the result.
#[derive(Debug)]
pub struct StationarySolver<'m, const D: usize> {
    mesh: &'m SimplexMesh<D>,
    labels: Vec<u32>,
    pattern: Arc<SymmetricPattern>,
    flipped: Vec<Topology<D>>,
    symbolic: usize,
    factorisations: usize,
    solves: Arc<AtomicUsize>,
}

impl<'m, const D: usize> StationarySolver<'m, D> {
    /// A solver on `mesh`; `regions` (lists of cells that may overlap) are kept whole when edges are flipped: give all regions
    /// that are ever a source.
    ///
    /// # Errors
    /// The symbolic factorisation ran out of memory.
    pub fn new(mesh: &'m SimplexMesh<D>, regions: &[Vec<u32>]) -> Result<Self, ReactionDiffusionError> {
        let pattern = pattern(mesh, mesh.cells())?;
        let labels = region_labels(mesh.cell_count(), regions);
        let solves = Arc::new(AtomicUsize::new(0));
        Ok(Self { mesh, labels, pattern, flipped: Vec::new(), symbolic: 1, factorisations: 0, solves })
    }

    /// Work done so far, by this solver and the systems that it set up.
    pub fn work(&self) -> WorkCount {
        let solves = self.solves.load(Ordering::Relaxed);
        WorkCount { symbolic: self.symbolic, factorisations: self.factorisations, solves }
    }

    /// Sets up and factors the system in a configuration (`coordinates`: one entry a vertex, µm). Right-hand sides of equal
    /// coefficients share it.
    ///
    /// # Errors
    /// D or k not positive; coordinates that do not fit the mesh or turn a cell inside out; a failing factorisation.
    pub fn system<'a>(
        &mut self,
        law: &ReactionDiffusion,
        coordinates: impl Into<Cow<'a, [[f64; D]]>>,
    ) -> Result<StationarySystem<'a, D>, ReactionDiffusionError>
    where
        'm: 'a,
    {
        let given = coordinates.into();
        let coordinates = &*given;
        check_law(law)?;
        check_length("coordinates", coordinates.len(), self.mesh.vertex_count())?;
        check_volumes(self.mesh, coordinates)?;
        let (topology, triangles) = self.topology(coordinates)?;
        let (flipped, pattern) = match topology {
            Some((mesh, pattern)) => (Some(mesh), pattern),
            None => (None, Arc::clone(&self.pattern)),
        };
        let meshes = Connectivities { coupling: flipped.as_deref().unwrap_or(self.mesh), original: self.mesh };
        let factor = assemble(law, meshes, coordinates, &pattern).cholesky()?;
        self.factorisations += 1;
        let solves = Arc::clone(&self.solves);
        Ok(StationarySystem { law: *law, original: self.mesh, flipped, triangles, coordinates: given, factor, solves })
    }

    /// The field c (nM, one entry a vertex) of the given sources in a configuration.
    ///
    /// # Errors
    /// Those of [`Self::system`] and [`StationarySystem::solve`].
    pub fn solve(
        &mut self,
        law: &ReactionDiffusion,
        coordinates: &[[f64; D]],
        sources: &[Source],
    ) -> Result<Vec<f64>, ReactionDiffusionError> {
        self.system(law, coordinates)?.solve(sources)
    }

    /// The field c (nM) and its rate dc/ds while the vertices move at `velocity` = dx/ds (µm per unit of s).
    ///
    /// # Errors
    /// Those of [`Self::system`] and [`StationarySystem::solve_with_rate`].
    pub fn solve_with_rate(
        &mut self,
        law: &ReactionDiffusion,
        coordinates: &[[f64; D]],
        velocity: &[[f64; D]],
        sources: &[Source],
    ) -> Result<(Vec<f64>, Vec<f64>), ReactionDiffusionError> {
        self.system(law, coordinates)?.solve_with_rate(velocity, sources)
    }

    /// The connectivity for a configuration.
    fn topology(&mut self, coordinates: &[[f64; D]]) -> Result<Chosen<D>, ReactionDiffusionError> {
        let Some(plane) = in_plane(coordinates) else { return Ok((None, None)) };
        let mut triangles = Triangles::of(self.mesh);
        if triangles.flip_to_delaunay(&plane, &self.labels) == 0 {
            return Ok((None, Some(triangles)));
        }
        let cells = triangles.flat();
        if let Some(known) = self.flipped.iter().find(|(mesh, _)| mesh.cells() == cells) {
            return Ok((Some(known.clone()), Some(triangles)));
        }
        let pattern = pattern(self.mesh, &cells)?;
        let mesh = Arc::new(SimplexMesh::new(coordinates.to_vec(), cells)?);
        self.symbolic += 1;
        if self.flipped.len() == KEPT_FLIPS {
            self.flipped.remove(0);
        }
        self.flipped.push((Arc::clone(&mesh), Arc::clone(&pattern)));
        Ok((Some((mesh, pattern)), Some(triangles)))
    }
}

/// The pattern of a connectivity. Its order is that of the reference configuration, so that it does not depend on which was the first.
fn pattern<const D: usize>(mesh: &SimplexMesh<D>, cells: &[u32]) -> Result<Arc<SymmetricPattern>, SparseError> {
    let order = nested_dissection(mesh.vertices(), cells, D + 1);
    SymmetricPattern::in_order(&order, cells, D + 1)
}

/// A factored system in one configuration.
#[derive(Debug)]
pub struct StationarySystem<'a, const D: usize> {
    law: ReactionDiffusion,
    original: &'a SimplexMesh<D>,
    flipped: Option<Arc<SimplexMesh<D>>>,
    triangles: Option<Triangles>,
    coordinates: Cow<'a, [[f64; D]]>,
    factor: Factor,
    solves: Arc<AtomicUsize>,
}

impl<const D: usize> StationarySystem<'_, D> {
    /// The connectivity in use: the mesh's, or one with the same vertices and flipped edges.
    pub fn mesh(&self) -> &SimplexMesh<D> {
        self.flipped.as_deref().unwrap_or(self.original)
    }

    /// The configuration that the system was set up in (µm).
    pub fn coordinates(&self) -> &[[f64; D]] {
        &self.coordinates
    }

    fn meshes(&self) -> Connectivities<'_, D> {
        Connectivities { coupling: self.mesh(), original: self.original }
    }

    /// Whether edges had to be flipped.
    pub fn is_flipped(&self) -> bool {
        self.flipped.is_some()
    }

    /// What the edges of the connectivity in use look like, in the plane.
    pub fn edge_report(&self) -> Option<EdgeReport> {
        let (plane, triangles) = (in_plane(&self.coordinates)?, self.triangles.as_ref()?);
        Some(triangles.edge_report(&plane, self.law.diffusion, self.law.degradation))
    }

    /// The load `f_i = ∫ Σ q 1_A λ_i` of sources (nM µm^D/h, one entry a vertex).
    ///
    /// # Errors
    /// A source that names a cell outside the mesh.
    pub fn load(&self, sources: &[Source]) -> Result<Vec<f64>, ReactionDiffusionError> {
        source_load((self.original, &self.coordinates), sources)
    }

    /// The field of a general load vector (nM µm^D/h, one entry a vertex).
    ///
    /// # Errors
    /// A load of the wrong length; no scratch memory.
    pub fn solve_load(&self, mut load: Vec<f64>) -> Result<Vec<f64>, ReactionDiffusionError> {
        check_length("the load", load.len(), self.original.vertex_count())?;
        self.factor.solve(&mut load)?;
        self.solves.fetch_add(1, Ordering::Relaxed);
        Ok(load)
    }

    /// The field c (nM, one entry a vertex) of sources.
    ///
    /// # Errors
    /// Those of [`Self::load`] and [`Self::solve_load`].
    pub fn solve(&self, sources: &[Source]) -> Result<Vec<f64>, ReactionDiffusionError> {
        self.solve_load(self.load(sources)?)
    }

    /// The field c and its rate dc/ds while the vertices move at `velocity` = dx/ds (µm per unit of s).
    ///
    /// # Errors
    /// Those of [`Self::solve`]; a velocity of the wrong length.
    pub fn solve_with_rate(
        &self,
        velocity: &[[f64; D]],
        sources: &[Source],
    ) -> Result<(Vec<f64>, Vec<f64>), ReactionDiffusionError> {
        check_length("the velocity", velocity.len(), self.original.vertex_count())?;
        let field = self.solve(sources)?;
        let mut rate = vec![0.0; field.len()];
        for_source_cells((self.original, &self.coordinates), sources, |element, source| {
            let divergence = divergence(&element.velocity_gradient(velocity));
            let density = source.density_rate + source.density * divergence;
            let share = density * element.volume / (D + 1) as f64;
            element.corners.iter().for_each(|&vertex| rate[vertex as usize] += share);
        })?;
        subtract_matrix_rate(&self.law, self.meshes(), (&self.coordinates, velocity), &field, &mut rate);
        let rate = self.solve_load(rate)?;
        Ok((field, rate))
    }

    /// What is released and what decays, for a field of this system.
    ///
    /// # Errors
    /// Those of [`Self::load`]; a field of the wrong length.
    pub fn budget(&self, field: &[f64], sources: &[Source]) -> Result<Budget, ReactionDiffusionError> {
        check_length("the field", field.len(), self.original.vertex_count())?;
        let mesh = if self.law.mass == Mass::Lumped { self.original } else { self.mesh() };
        let content: f64 = (0..mesh.cell_count())
            .map(|cell| {
                let sum: f64 = mesh.cell(cell).iter().map(|&v| field[v as usize]).sum();
                mesh.volume(&self.coordinates, cell) * sum / (D + 1) as f64
            })
            .sum();
        let released = self.load(sources)?.iter().sum();
        let minimum = field.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Budget { degraded: self.law.degradation * content, released, minimum })
    }
}

/// The load `f_i = ∫ Σ q 1_A λ_i` of sources on a mesh at the given coordinates (nM µm^D/h, one entry a vertex).
///
/// # Errors
/// A source that names a cell outside the mesh.
pub fn source_load<const D: usize>(
    place: (&SimplexMesh<D>, &[[f64; D]]),
    sources: &[Source],
) -> Result<Vec<f64>, ReactionDiffusionError> {
    let mut load = vec![0.0; place.0.vertex_count()];
    for_source_cells(place, sources, |element, source| {
        let share = source.density * element.volume / (D + 1) as f64;
        element.corners.iter().for_each(|&vertex| load[vertex as usize] += share);
    })?;
    Ok(load)
}

fn for_source_cells<const D: usize>(
    (mesh, coordinates): (&SimplexMesh<D>, &[[f64; D]]),
    sources: &[Source],
    mut visit: impl FnMut(&Element<D>, &Source),
) -> Result<(), ReactionDiffusionError> {
    for (source_index, source) in sources.iter().enumerate() {
        for &cell in source.cells {
            if cell as usize >= mesh.cell_count() {
                let count = mesh.cell_count();
                return Err(ReactionDiffusionError::NoSuchCell { source_index, cell, count });
            }
            visit(&Element::new(mesh, coordinates, cell as usize), source);
        }
    }
    Ok(())
}

pub(crate) fn check_law(law: &ReactionDiffusion) -> Result<(), ReactionDiffusionError> {
    if !(law.diffusion > 0.0 && law.diffusion.is_finite()) {
        return Err(ReactionDiffusionError::Diffusion(law.diffusion));
    }
    if !(law.degradation > 0.0 && law.degradation.is_finite()) {
        return Err(ReactionDiffusionError::Degradation(law.degradation));
    }
    Ok(())
}

pub(crate) fn check_length(what: &'static str, given: usize, wanted: usize) -> Result<(), ReactionDiffusionError> {
    if given == wanted { Ok(()) } else { Err(ReactionDiffusionError::Length { what, given, wanted }) }
}

pub(crate) fn check_volumes<const D: usize>(
    mesh: &SimplexMesh<D>,
    coordinates: &[[f64; D]],
) -> Result<(), ReactionDiffusionError> {
    let volumes = (0..mesh.cell_count()).map(|cell| (cell, mesh.volume(coordinates, cell)));
    match volumes.into_iter().find(|(_, volume)| *volume <= 0.0 || volume.is_nan()) {
        Some((cell, volume)) => Err(ReactionDiffusionError::Inverted { cell, volume }),
        None => Ok(()),
    }
}

fn in_plane<const D: usize>(coordinates: &[[f64; D]]) -> Option<Vec<[f64; 2]>> {
    (D == 2).then(|| coordinates.iter().map(|x| [x[0], x[D - 1]]).collect())
}
