//! The path of equilibria of a body under a growing load: solved at a few levels, interpolated between them.
//!
//! In quasi-statics the displacement depends on the load `s ∈ [0, 1]` alone, not on time. So `U(s)` is solved at levels that
//! an error check chooses, with `dU/ds` from one tangent solve each, and `U` between them is the cubic Hermite interpolant
//! ([`crate::numerics::hermite`]). The velocity of the tissue is `ṡ` times the derivative *of that interpolant*, so that moving
//! with it and evaluating the path agree to round-off.
//!
//! The march starts at rest, the next level from the tangent predictor `U + Δs dU/ds`, others from the cubic through the last
//! two levels; where Newton's method fails the increment is halved, down to a smallest one, then the path ends in an error
//! that says where. The middle of every interval is then solved too and compared with the interpolant, until the tolerance is met. `det F > 0` is checked of the interpolant as
//! well, between the levels.
//!
//! The load is the path's parameter and nothing else is assumed of it; materials with history will march in time instead.

use crate::numerics::hermite::{
    HermiteError, HermitePath, Interpolation, Level, Refinement, RefinementReport, ValueAndSlope, cubic_guess,
    refine_path, tangent_guess,
};
use crate::numerics::hyperelasticity::{Body, WorstCell};
use crate::numerics::newton::{Equilibrium, EquilibriumError, NewtonOptions, equilibrium};
use std::sync::Arc;

/// How a load path is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPathOptions {
    /// Largest distance between interpolant and equilibrium, over the size of the body (default 1e-6).
    pub tolerance: f64,
    /// Levels of the march where nothing fails, at least 2 (default 5).
    pub min_levels: usize,
    /// Cap on the levels (default 129). Reached in the march: an error; in refining: reported.
    pub max_levels: usize,
    /// The march gives up below this increment of the load (default 1e-3).
    pub smallest_step: f64,
    /// What the path does between levels (default cubic).
    pub interpolation: Interpolation,
    /// Newton's method at each level.
    pub newton: NewtonOptions,
}

impl Default for LoadPathOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            min_levels: 5,
            max_levels: 129,
            smallest_step: 1e-3,
            interpolation: Interpolation::Cubic,
            newton: NewtonOptions::default(),
        }
    }
}

/// Why a load path ends before its load does.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LoadPathError {
    /// Equilibrium was lost between two loads.
    #[error("equilibrium lost between s = {last_good:.6} and s = {failed:.6}: {source}")]
    Lost {
        /// The last load with an equilibrium.
        last_good: f64,
        /// The load without, less than the smallest step farther.
        failed: f64,
        /// Why, and the cell and stretch there.
        source: Box<EquilibriumError>,
    },
    /// The interpolant turns a cell inside out between two equilibria that do not.
    #[error(
        "between the equilibria at s = {from:.6} and s = {to:.6} the interpolant at s = {at:.6} is not admissible: {worst}"
    )]
    InterpolantInverted {
        /// The level before.
        from: f64,
        /// The level after.
        to: f64,
        /// Where it was found.
        at: f64,
        /// The cell.
        worst: Box<WorstCell>,
    },
    /// The march needed more levels than allowed.
    #[error("the load path needs more than {levels} levels: it reached s = {reached:.6}")]
    TooManyLevels {
        /// Levels allowed.
        levels: usize,
        /// The last load with an equilibrium.
        reached: f64,
    },
    /// The levels make no path: the options ask for steps below round-off.
    #[error(transparent)]
    Levels(#[from] HermiteError),
}

/// What solving a path came to.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadPathReport {
    /// Levels stored.
    pub levels: usize,
    /// Equilibria asked for, failed ones included.
    pub solves: usize,
    /// Factorisations in all.
    pub newton_iterations: usize,
    /// Increments that failed and were halved.
    pub halvings: usize,
    /// Largest distance between interpolant and equilibrium found at the middle of an interval, over the body's size. The
    /// middles became levels, so the path is better.
    pub defect: f64,
    /// Whether the tolerance was met everywhere; if not, `max_levels` came first.
    pub met: bool,
    /// Warning: the first level whose tangent has a negative eigenvalue. From there on the equilibria are not stable.
    pub unstable_from: Option<f64>,
    /// The smallest `det F` of all levels and of the interpolant between them.
    pub min_jacobian: f64,
    /// The load where it is found.
    pub min_jacobian_load: f64,
    /// The cell where it is found.
    pub min_jacobian_cell: usize,
}

/// Displacement of a body as a function of the load, with its derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadPath {
    path: Arc<HermitePath>,
    report: LoadPathReport,
}

impl LoadPath {
    /// Solves the path of equilibria of `body` for loads from 0 to 1.
    ///
    /// # Errors
    /// [`LoadPathError`]: equilibrium lost (with both loads, the cell, its stretches), or an interpolant that inverts a cell.
    pub fn solve<const D: usize>(body: &Body<'_, D>, options: &LoadPathOptions) -> Result<Self, LoadPathError> {
        let mut solver = PathSolver { body, options, report: LoadPathReport::empty() };
        let marched = HermitePath::new(solver.march()?)?.interpolated(options.interpolation);
        let (path, refinement) = solver.refine(marched)?;
        let report = solver.finish(&path, refinement)?;
        Ok(Self { path: Arc::new(path), report })
    }

    /// Writes the displacement (µm, flat, stride `D`) at load `s` into `out`; constant outside `[0, 1]`.
    pub fn displacement(&self, load: f64, out: &mut [f64]) {
        self.path.evaluate(load, out);
    }

    /// Writes `dU/ds` (µm) at load `s` into `out`: the derivative of [`Self::displacement`], zero outside `[0, 1]`. Times `ṡ`
    /// it is the velocity of the tissue.
    pub fn rate(&self, load: f64, out: &mut [f64]) {
        self.path.derivative(load, out);
    }

    /// The path of what a linear map makes of the displacement (µm, flat), as that on another mesh; its report stays.
    pub fn mapped(&self, map: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self { path: Arc::new(self.path.mapped(map)), report: self.report.clone() }
    }

    /// The interpolant, for those who need a few components only.
    pub fn path(&self) -> &Arc<HermitePath> {
        &self.path
    }

    /// What solving it came to.
    pub fn report(&self) -> &LoadPathReport {
        &self.report
    }
}

impl LoadPathReport {
    fn empty() -> Self {
        Self {
            levels: 0,
            solves: 0,
            newton_iterations: 0,
            halvings: 0,
            defect: 0.0,
            met: true,
            unstable_from: None,
            min_jacobian: f64::INFINITY,
            min_jacobian_load: 0.0,
            min_jacobian_cell: 0,
        }
    }

    fn count(&mut self, load: f64, solved: &Result<Equilibrium, EquilibriumError>) {
        self.solves += 1;
        match solved {
            Err(error) => self.newton_iterations += error.iterations,
            Ok(found) => {
                self.newton_iterations += found.iterations;
                self.note_jacobian(load, found.min_jacobian, found.min_jacobian_cell);
                if found.negative_eigenvalues > 0 {
                    self.unstable_from = Some(self.unstable_from.map_or(load, |first| first.min(load)));
                }
            }
        }
    }

    fn note_jacobian(&mut self, load: f64, jacobian: f64, cell: usize) {
        if jacobian < self.min_jacobian {
            (self.min_jacobian, self.min_jacobian_load, self.min_jacobian_cell) = (jacobian, load, cell);
        }
    }
}

struct PathSolver<'b, 'm, const D: usize> {
    body: &'b Body<'m, D>,
    options: &'b LoadPathOptions,
    report: LoadPathReport,
}

impl<const D: usize> PathSolver<'_, '_, D> {
    fn equilibrium(&mut self, load: f64, guess: &[f64]) -> Result<ValueAndSlope, EquilibriumError> {
        let solved = equilibrium(self.body, load, guess, &self.options.newton);
        self.report.count(load, &solved);
        solved.map(|found| (found.displacement, found.rate))
    }

    /// Levels from 0 to 1, by the tangent predictor, halving the increment where Newton's method fails.
    fn march(&mut self) -> Result<Vec<Level>, LoadPathError> {
        let widest = 1.0 / (self.options.min_levels.max(2) - 1) as f64;
        let rest = vec![0.0; self.body.unknowns()];
        let lost =
            |last_good: f64, failed: f64, source| LoadPathError::Lost { last_good, failed, source: Box::new(source) };
        let (value, slope) = self.equilibrium(0.0, &rest).map_err(|source| lost(0.0, 0.0, source))?;
        let mut last = Level { parameter: 0.0, value, slope };
        let mut levels = Vec::new();
        let mut step = widest;
        while last.parameter < 1.0 {
            if levels.len() + 1 >= self.options.max_levels.max(2) {
                return Err(LoadPathError::TooManyLevels { levels: self.options.max_levels, reached: last.parameter });
            }
            // A last crumb of a step would only spoil the spacing.
            let target = if last.parameter + 1.01 * step >= 1.0 { 1.0 } else { last.parameter + step };
            match self.equilibrium(target, &self.guess(levels.last(), &last, target)) {
                Ok((value, slope)) => {
                    levels.push(std::mem::replace(&mut last, Level { parameter: target, value, slope }));
                    step = (2.0 * step).min(widest);
                }
                Err(source) => {
                    step = 0.5 * (target - last.parameter);
                    self.report.halvings += 1;
                    if step < self.options.smallest_step {
                        return Err(lost(last.parameter, target, source));
                    }
                }
            }
        }
        levels.push(last);
        Ok(levels)
    }

    /// The cubic through the last two levels where it can be used, else the tangent at the last.
    fn guess(&self, before: Option<&Level>, last: &Level, target: f64) -> Vec<f64> {
        let cubic = before.map(|before| cubic_guess([before, last], target));
        let usable = cubic.filter(|guess| self.body.admissible(target, guess));
        usable.unwrap_or_else(|| tangent_guess(last, target))
    }

    fn refine(&mut self, marched: HermitePath) -> Result<(HermitePath, RefinementReport), LoadPathError> {
        let (body, options) = (self.body, self.options);
        let loads: Vec<f64> = marched.levels().iter().map(|level| level.parameter).collect();
        let goal = Refinement { tolerance: options.tolerance, max_levels: options.max_levels };
        let evaluate = |load: f64, guess: Option<&[f64]>| {
            let below = loads[loads.partition_point(|known| *known < load).saturating_sub(1)];
            self.equilibrium(load, guess.unwrap_or_default()).map_err(|source| LoadPathError::Lost {
                last_good: below,
                failed: load,
                source: Box::new(source),
            })
        };
        let defect = |load: f64, interpolated: &[f64], exact: &[f64]| {
            let distance = interpolated.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if body.admissible(load, interpolated) { distance / body.size() } else { f64::INFINITY }
        };
        refine_path(marched, evaluate, defect, goal)
    }

    /// Checks `det F` of the interpolant inside every interval and completes the report.
    fn finish(mut self, path: &HermitePath, refinement: RefinementReport) -> Result<LoadPathReport, LoadPathError> {
        const SAMPLES: usize = 4;
        let mut displacement = vec![0.0; self.body.unknowns()];
        for pair in path.levels().windows(2) {
            let (from, to) = (pair[0].parameter, pair[1].parameter);
            for sample in 1..SAMPLES {
                let at = from + (to - from) * sample as f64 / SAMPLES as f64;
                path.evaluate(at, &mut displacement);
                if !self.body.admissible(at, &displacement) {
                    let worst = Box::new(self.body.worst_cell(&displacement));
                    return Err(LoadPathError::InterpolantInverted { from, to, at, worst });
                }
                let (jacobian, cell) = self.body.lowest_jacobian(&displacement);
                self.report.note_jacobian(at, jacobian, cell);
            }
        }
        self.report.levels = path.levels().len();
        self.report.defect = refinement.worst_defect;
        self.report.met = refinement.met;
        Ok(self.report)
    }
}
