//! A stationary field along the load of its tissue: solved at levels that an error check chooses, cubic Hermite between them.
//!
//! One vector a level holds c and ∇c ([`FieldLayout`]), another their exact derivatives along the load; only that of the gradient
//! recovered from linear elements is a central difference of the (smooth) recovery.

use std::sync::Arc;

use crate::numerics::carried_field::carried;
use crate::numerics::delaunay::Monotonicity;
use crate::numerics::element_gradient::{MovingField, averaged_gradients, corner_gradients, linear_gradients};
use crate::numerics::field_layout::FieldLayout;
use crate::numerics::hermite::{HermiteError, HermitePath, Refinement, RefinementReport, ValueAndSlope, refine};
use crate::numerics::mesh_grading::gradient_errors;
use crate::numerics::quadratic_field::QuadraticSolver;
use crate::numerics::reaction_diffusion::{
    ReactionDiffusion, ReactionDiffusionError, Source, StationarySolver, WorkCount,
};
use crate::numerics::recovery::GradientRecovery;
use crate::numerics::simplex_mesh::SimplexMesh;

/// A relative gradient below this (1/µm) is none: a thousandth of the least that is sensed, 1 % per 10 µm. In a convex corner the
/// recovered gradient is zero to round-off, and round-off has no relative error to speak of.
const FLAT: f64 = 1e-6;

/// Order of the elements of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// P1.
    Linear,
    /// P2.
    Quadratic,
}

/// How the gradient of a field is made from its nodal values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gradient {
    /// Continuous: local quadratic fits of linear elements, volume-weighted means of quadratic ones.
    Recovered,
    /// The element's own, which jumps from cell to cell.
    Raw,
}

/// Why a field's path could not be solved.
#[derive(Debug, thiserror::Error)]
pub enum FieldPathError {
    /// A level could not be solved.
    #[error(transparent)]
    Field(#[from] ReactionDiffusionError),
    /// The levels make no path.
    #[error(transparent)]
    Levels(#[from] HermiteError),
    /// A field in time does not come within its tolerance.
    #[error("at {time:.6} h no step, however short, keeps the error of the field within the tolerance {tolerance:.1e}")]
    NoStep {
        /// Where (h).
        time: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// The levels of a field take more memory than there is for them.
    #[error(
        "levels of its field, {levels} so far, take more than what is left, {gigabytes:.3} GB; a coarser `mesh_size` takes less"
    )]
    NoRoom {
        /// Levels held.
        levels: usize,
        /// What was left for all of them (GB).
        gigabytes: f64,
    },
    /// A field in time needs too many levels.
    #[error(
        "{levels} levels in time reach no farther than {time:.6} h; each corner of the tissue's load and of the release takes two, and of the others a larger `time_tolerance` needs fewer"
    )]
    TooManyLevels {
        /// Levels allowed.
        levels: usize,
        /// Where they end (h).
        time: f64,
    },
}

/// Vertex coordinates (µm) at a load and their derivative with respect to it.
pub type Configurations<'a> = &'a dyn Fn(f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>);

/// Bytes in a gigabyte.
const GIGABYTE: f64 = 1e9;

/// Bytes that levels of fields may take in all.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Room(f64);

impl Room {
    /// Refuses so many levels, of so many components with a value and a slope each, if they take more.
    pub(crate) fn demand(self, levels: usize, components: usize) -> Result<(), FieldPathError> {
        match Self::of(levels, components) <= self.0 {
            true => Ok(()),
            false => Err(FieldPathError::NoRoom { levels, gigabytes: self.0.max(0.0) / GIGABYTE }),
        }
    }

    fn of(levels: usize, components: usize) -> f64 {
        (2 * size_of::<f64>()) as f64 * levels as f64 * components as f64
    }
}

/// The solvers of one mesh, set up when a field first needs them.
#[derive(Debug)]
pub struct FieldSolvers<'m> {
    mesh: &'m SimplexMesh<2>,
    regions: Vec<Vec<u32>>,
    pub(crate) room: Room,
    linear: Option<(StationarySolver<'m, 2>, GradientRecovery<2>)>,
    quadratic: Option<QuadraticSolver<'m, 2>>,
}

impl<'m> FieldSolvers<'m> {
    /// None yet, on `mesh`; `regions` are all that are ever a source.
    pub fn new(mesh: &'m SimplexMesh<2>, regions: Vec<Vec<u32>>) -> Self {
        Self { mesh, regions, room: Room(f64::INFINITY), linear: None, quadratic: None }
    }

    /// The same for fields whose levels may take so many bytes in all; one that needs more is an error.
    pub fn within(self, room: f64) -> Self {
        Self { room: Room(room), ..self }
    }

    /// Takes the room of a path for good.
    pub(crate) fn keep(&mut self, path: &HermitePath) {
        self.room.0 -= Room::of(path.levels().len(), path.components());
    }

    /// Factorisations and solves done so far.
    pub fn work(&self) -> WorkCount {
        let linear = self.linear.as_ref().map(|(solver, _)| solver.work());
        let quadratic = self.quadratic.as_ref().map(QuadraticSolver::work);
        let none = WorkCount { symbolic: 0, factorisations: 0, solves: 0 };
        linear.into_iter().chain(quadratic).fold(none, |sum, work| WorkCount {
            symbolic: sum.symbolic + work.symbolic,
            factorisations: sum.factorisations + work.factorisations,
            solves: sum.solves + work.solves,
        })
    }

    pub(crate) fn linear(
        &mut self,
    ) -> Result<&mut (StationarySolver<'m, 2>, GradientRecovery<2>), ReactionDiffusionError> {
        match &mut self.linear {
            Some(known) => Ok(known),
            none => {
                let solver = StationarySolver::new(self.mesh, &self.regions)?;
                Ok(none.insert((solver, GradientRecovery::new(self.mesh))))
            }
        }
    }

    fn quadratic(&mut self) -> Result<&mut QuadraticSolver<'m, 2>, ReactionDiffusionError> {
        match &mut self.quadratic {
            Some(known) => Ok(known),
            none => Ok(none.insert(QuadraticSolver::new(self.mesh)?)),
        }
    }
}

/// What the parameter of a field's path is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// The load of the tissue, in [0, 1].
    Load,
    /// Time (h).
    Time,
}

/// A field of linear elements in one configuration, one entry a vertex.
struct Nodal {
    c: Vec<f64>,
    /// Its derivative along the motion of the vertices; zeros if they do not move.
    slope: Vec<f64>,
    flipped: bool,
    edges: Option<Monotonicity>,
}

/// A field at one load.
struct Level {
    /// c and ∇c, with their derivatives along a motion of the vertices, if they move.
    found: ValueAndSlope,
    /// Whether edges were flipped.
    flipped: bool,
    /// How near the mesh comes to losing the discrete maximum principle.
    edges: Option<Monotonicity>,
}

/// One field on a mesh.
#[derive(Debug)]
pub struct FieldProblem<'m> {
    /// The mesh, in the reference configuration.
    pub mesh: &'m SimplexMesh<2>,
    /// D, k and (of linear elements) the mass.
    pub equation: ReactionDiffusion,
    /// Order of the elements.
    pub order: Order,
    /// What is sampled as the gradient.
    pub gradient: Gradient,
    /// The cells of each source.
    pub sources: Vec<Vec<u32>>,
    /// Release q (nM/h), at rest.
    pub release_rate: f64,
    /// Whether the field is bound to the matrix: solved at rest, then carried and diluted by it (linear elements only).
    pub bound: bool,
    /// Whether q times the source's area is kept while the tissue deforms; else q is.
    pub keeps_total: bool,
}

/// A solved field.
#[derive(Debug)]
pub struct FieldPath {
    /// c and ∇c along the parameter.
    pub path: HermitePath,
    /// What the parameter is.
    pub along: Along,
    /// What stands where in it.
    pub layout: FieldLayout,
    /// What the choice of levels came to.
    pub report: RefinementReport,
    /// The least parameter at which edges were flipped (linear elements only).
    pub flipped_from: Option<f64>,
    /// How near the meshes of all levels, edges flipped, come to losing the discrete maximum principle; none for quadratic
    /// elements, which have no such principle.
    pub monotonicity: Option<Monotonicity>,
}

impl FieldPath {
    /// Unknowns of a solve.
    pub fn unknowns(&self) -> usize {
        self.layout.concentrations(&self.path.levels()[0].value).count()
    }
}

impl FieldProblem<'_> {
    /// Solves the field at rest, or along the `configurations` for loads in [0, 1].
    ///
    /// # Errors
    /// The first level that cannot be solved.
    pub fn solve(
        &self,
        solvers: &mut FieldSolvers,
        configurations: Option<Configurations>,
        goal: Refinement,
    ) -> Result<FieldPath, FieldPathError> {
        let layout = self.layout(solvers)?;
        let bound = configurations.filter(|_| self.bound);
        let at_rest = bound.map(|_| self.nodal(solvers, self.mesh.vertices(), None)).transpose()?;
        let (mut flipped_from, mut monotonicity) = (None::<f64>, None::<Monotonicity>);
        let defect = |a: &[f64], b: &[f64]| layout.gradient_defect(self.mesh, (a, b), FLAT);
        let mut solved = 0;
        let mut level = |load: f64, at: &[[f64; 2]], motion: Option<&[[f64; 2]]>| {
            let Level { found, flipped, edges } = match self.order {
                Order::Linear => self.linear_level(solvers, &layout, (at, motion), at_rest.as_ref())?,
                Order::Quadratic => self.quadratic_level(solvers, &layout, at, motion)?,
            };
            if flipped {
                flipped_from = Some(flipped_from.map_or(load, |first| first.min(load)));
            }
            monotonicity = edges.map(|edges| monotonicity.map_or(edges, |worst| worst.worse(edges)));
            solved += 1;
            solvers.room.demand(solved, found.0.len())?;
            Ok::<_, FieldPathError>(found)
        };
        let (path, report) = match configurations {
            None => refine(&[0.0], |load, _| level(load, self.mesh.vertices(), None), defect, goal)?,
            Some(configurations) => {
                let evaluate = |load: f64, _: Option<&[f64]>| {
                    let (moved, slope) = configurations(load);
                    level(load, &moved, Some(&slope))
                };
                refine(&[0.0, 0.5, 1.0], evaluate, defect, goal)?
            }
        };
        solvers.keep(&path);
        Ok(FieldPath { path, along: Along::Load, layout, report, flipped_from, monotonicity })
    }

    /// The [estimate](gradient_errors) of every cell at rest, by linear elements whatever the order.
    ///
    /// # Errors
    /// A field that cannot be solved.
    pub fn gradient_errors(&self, solvers: &mut FieldSolvers) -> Result<Vec<f64>, FieldPathError> {
        let rest = self.mesh.vertices();
        let Nodal { c, .. } = self.nodal(solvers, rest, None)?;
        let (_, recovery) = solvers.linear()?;
        Ok(gradient_errors(self.mesh, &c, &recovery.recover(rest, &c, true), self.equation.decay_length()))
    }

    pub(crate) fn layout(&self, solvers: &mut FieldSolvers) -> Result<FieldLayout, ReactionDiffusionError> {
        Ok(match (self.order, self.gradient) {
            (Order::Linear, Gradient::Recovered) => FieldLayout::Vertices,
            (Order::Linear, Gradient::Raw) => FieldLayout::Cells(self.mesh.vertex_count()),
            (Order::Quadratic, Gradient::Recovered) => FieldLayout::Nodes(Arc::clone(solvers.quadratic()?.nodes())),
            (Order::Quadratic, Gradient::Raw) => FieldLayout::Corners(Arc::clone(solvers.quadratic()?.nodes())),
        })
    }

    /// Solves for linear elements in a configuration whose vertices may move.
    fn nodal(
        &self,
        solvers: &mut FieldSolvers,
        at: &[[f64; 2]],
        motion: Option<&[[f64; 2]]>,
    ) -> Result<Nodal, ReactionDiffusionError> {
        let system = solvers.linear()?.0.system(&self.equation, at)?;
        let sources = self.sources_at(at, motion);
        let (c, slope) = match motion {
            Some(motion) => system.solve_with_rate(motion, &sources)?,
            None => (system.solve(&sources)?, vec![0.0; at.len()]),
        };
        let edges = system.edge_report().map(|report| report.monotonicity);
        Ok(Nodal { c, slope, flipped: system.is_flipped(), edges })
    }

    /// The level of a field that diffuses, or of a bound one that is carried from `at_rest`.
    fn linear_level(
        &self,
        solvers: &mut FieldSolvers,
        layout: &FieldLayout,
        (at, motion): (&[[f64; 2]], Option<&[[f64; 2]]>),
        at_rest: Option<&Nodal>,
    ) -> Result<Level, ReactionDiffusionError> {
        let (Nodal { c, slope, flipped, edges }, no_flux) = match at_rest.zip(motion) {
            Some((&Nodal { ref c, flipped, edges, .. }, motion)) => {
                let (c, slope) = carried(self.mesh, c, at, motion);
                // What is carried may have a slope across the border.
                (Nodal { c, slope, flipped, edges }, false)
            }
            None => (self.nodal(solvers, at, motion)?, true),
        };
        let (_, recovery) = solvers.linear()?;
        let found = self.with_gradients(recovery, layout, (at, motion), (&c, &slope), no_flux);
        Ok(Level { found, flipped, edges })
    }

    /// c and ∇c of linear elements in one vector, and their slopes.
    pub(crate) fn with_gradients(
        &self,
        recovery: &GradientRecovery<2>,
        layout: &FieldLayout,
        (at, motion): (&[[f64; 2]], Option<&[[f64; 2]]>),
        (c, slope): (&[f64], &[f64]),
        no_flux: bool,
    ) -> ValueAndSlope {
        let (gradient, gradient_slope) = match (self.gradient, motion) {
            (Gradient::Raw, _) => {
                let still = vec![[0.0; 2]; at.len()];
                let velocity = motion.unwrap_or(&still);
                linear_gradients(self.mesh, &MovingField { coordinates: at, velocity, values: c, rates: slope })
            }
            (Gradient::Recovered, None) => (recovery.recover(at, c, no_flux), vec![[0.0; 2]; at.len()]),
            (Gradient::Recovered, Some(motion)) => {
                let rate = recovered_slope(recovery, (at, motion), (c, slope), no_flux);
                (recovery.recover(at, c, no_flux), rate)
            }
        };
        (layout.pack(c, &gradient), layout.pack(slope, &gradient_slope))
    }

    fn quadratic_level(
        &self,
        solvers: &mut FieldSolvers,
        layout: &FieldLayout,
        at: &[[f64; 2]],
        motion: Option<&[[f64; 2]]>,
    ) -> Result<Level, ReactionDiffusionError> {
        let solver = solvers.quadratic()?;
        let system = solver.system(&self.equation, at)?;
        let sources = self.sources_at(at, motion);
        let (values, rates) = match motion {
            Some(motion) => system.solve_with_rate(motion, &sources)?,
            None => (system.solve(&sources)?, vec![0.0; solver.nodes().count()]),
        };
        let still = vec![[0.0; 2]; at.len()];
        let field = MovingField { coordinates: at, velocity: motion.unwrap_or(&still), values: &values, rates: &rates };
        let (gradient, gradient_slope) = match self.gradient {
            Gradient::Recovered => averaged_gradients(self.mesh, solver.nodes(), &field),
            Gradient::Raw => corner_gradients(self.mesh, solver.nodes(), &field),
        };
        let found = (layout.pack(&values, &gradient), layout.pack(&rates, &gradient_slope));
        Ok(Level { found, flipped: false, edges: None })
    }

    pub(crate) fn sources_at<'s>(&'s self, at: &[[f64; 2]], motion: Option<&[[f64; 2]]>) -> Vec<Source<'s>> {
        let source = |cells: &'s Vec<u32>| {
            if !self.keeps_total {
                return Source::new(cells, self.release_rate);
            }
            let rest = self.mesh.vertices();
            let area: f64 = cells.iter().map(|&cell| self.mesh.volume(rest, cell as usize)).sum();
            Source::of_total(self.mesh, at, motion, (cells, self.release_rate * area))
        };
        self.sources.iter().map(source).collect()
    }
}

/// Derivative of the recovered gradient along the motion, by a central difference of the (smooth) recovery.
fn recovered_slope(
    recovery: &GradientRecovery<2>,
    (at, motion): (&[[f64; 2]], &[[f64; 2]]),
    (c, slope): (&[f64], &[f64]),
    no_flux: bool,
) -> Vec<[f64; 2]> {
    let fastest = motion.iter().flatten().fold(0.0f64, |m, w| m.max(w.abs()));
    if fastest == 0.0 {
        let still = slope.iter().all(|slope| *slope == 0.0);
        return if still { vec![[0.0; 2]; c.len()] } else { recovery.recover(at, slope, no_flux) };
    }
    let step = 1e-3 / fastest;
    let shifted = |sign: f64| {
        let e = sign * step;
        let x: Vec<[f64; 2]> = at.iter().zip(motion).map(|(x, w)| [x[0] + e * w[0], x[1] + e * w[1]]).collect();
        let value: Vec<f64> = c.iter().zip(slope).map(|(c, dc)| c + e * dc).collect();
        recovery.recover(&x, &value, no_flux)
    };
    let (ahead, behind) = rayon::join(|| shifted(1.0), || shifted(-1.0));
    ahead.iter().zip(&behind).map(|(a, b)| [0, 1].map(|k| (a[k] - b[k]) / (2.0 * step))).collect()
}
