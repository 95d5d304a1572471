//! Equilibrium of a body at one load, by Newton's method that cannot leave the admissible set.
//!
//! ```text
//! K(U) δ = −f(U),     U ← U + α δ.
//! ```
//! The step is shortened (`α = 1, ½, ¼, …`) until `det F > 0` in every cell and, where the tangent is positive definite, the energy
//! falls enough (Armijo); where it is indefinite, until the residual falls. A factor costs as much as five solves, so that of a
//! stable state near the equilibrium serves for more steps, as long as each is a thousandth of the one before or less. The
//! iteration stops where the energy norm `√|δ·f|` of the step still to come is below the tolerance, relative to `√(2W)`. The number of
//! negative eigenvalues comes from the last LDLT factor: an equilibrium with any is found all the same, but it is not stable.
//!
//! The rate `dU/ds` follows from the factor in hand, `K_ff dU_f/ds = −K_fp a − ∂f_f/∂s` (the last term where the body grows): by one solve
//! if it is that of the equilibrium, else by as many as bring what is left below the tolerance.

use crate::numerics::hyperelasticity::{Body, WorstCell};
use crate::numerics::sparse::{Factor, SparseError, SymmetricMatrix};

/// When Newton's method stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Energy norm of the step still to come, relative to `√(2W)` (default 1e-12).
    pub tolerance: f64,
    /// Factorisations at most (default 25).
    pub max_iterations: usize,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self { tolerance: 1e-12, max_iterations: 25 }
    }
}

/// An equilibrium at one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Displacement `U` (µm), flat, stride `D`.
    pub displacement: Vec<f64>,
    /// `dU/ds` (µm per unit load), flat, stride `D`: the tangent of the path of equilibria.
    pub rate: Vec<f64>,
    /// Strain energy (Pa µm^D).
    pub energy: f64,
    /// Factorisations it took.
    pub iterations: usize,
    /// Energy norm of the last step, or what it bounds that of the next by, relative to `√(2W)` (or to its value at a strain of 0.1 %,
    /// if that is larger).
    pub residual: f64,
    /// The smallest `det F`.
    pub min_jacobian: f64,
    /// The cell of the smallest `det F`.
    pub min_jacobian_cell: usize,
    /// Negative eigenvalues of the tangent: zero for a stable equilibrium. Of that of a state nearby, if one in which a thousandth of an
    /// error was left by each step found the equilibrium.
    pub negative_eigenvalues: usize,
}

/// Why no equilibrium was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Failure {
    /// The starting guess is not admissible.
    #[error("the guess turns a cell inside out")]
    Inverted,
    /// The guess is no finite vector of the right length.
    #[error("the guess is not a finite displacement of this body")]
    Guess,
    /// However short, no step is admissible and lowers the energy (the residual, where the tangent is indefinite).
    #[error("no step lowers the energy without turning a cell inside out")]
    NoDescent,
    /// The cap on iterations came first.
    #[error("Newton's method did not converge")]
    NoConvergence,
    /// The tangent cannot be inverted: a limit point or a branching of the path.
    #[error("the tangent is singular")]
    Singular,
    /// The factorisation failed for another reason.
    #[error(transparent)]
    Sparse(SparseError),
}

impl From<SparseError> for Failure {
    fn from(error: SparseError) -> Self {
        match error {
            SparseError::Singular { .. } => Self::Singular,
            other => Self::Sparse(other),
        }
    }
}

/// No equilibrium at a load: where, how far it got and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "no equilibrium at load {load:.6}: {reason} ({iterations} iterations, relative residual {residual:.2e}); \
     worst is {worst}"
)]
pub struct EquilibriumError {
    /// The load.
    pub load: f64,
    /// Why.
    pub reason: Failure,
    /// Factorisations made.
    pub iterations: usize,
    /// Relative energy norm of the last step that was solved for; infinite if none was.
    pub residual: f64,
    /// The cell of the smallest `det F` in the last state.
    pub worst: Box<WorstCell>,
}

/// Solves for the equilibrium of `body` at `load`, starting at `guess` (flat, stride `D`, µm; its prescribed components are
/// replaced by those of the load). A good guess is the tangent predictor `U + Δs dU/ds` from an equilibrium nearby.
///
/// # Errors
/// [`EquilibriumError`] with the load, the worst cell and the reason; see [`Failure`].
pub fn equilibrium<const D: usize>(
    body: &Body<'_, D>,
    load: f64,
    guess: &[f64],
    options: &NewtonOptions,
) -> Result<Equilibrium, EquilibriumError> {
    let mut newton = Newton::new(body, load, guess);
    newton.solve(options).map_err(|reason| EquilibriumError {
        load,
        reason,
        iterations: newton.iterations,
        residual: newton.residual,
        worst: Box::new(body.worst_cell(&newton.displacement)),
    })
}

/// A step with an old factor may be this share of the one before; if it is more than `NEAR` a new factor is cheaper.
const FAST: f64 = 0.25;
const NEAR: f64 = 1e-3;
/// By how much later steps may shrink less than the last did.
const LATER: f64 = 10.0;

struct Newton<'b, 'm, const D: usize> {
    body: &'b Body<'m, D>,
    load: f64,
    displacement: Vec<f64>,
    tangent: SymmetricMatrix,
    iterations: usize,
    residual: f64,
}

/// A Newton step, free unknowns only, and what judging it needs.
struct Step {
    direction: Vec<f64>,
    /// `f·δ`, negative for a direction of descent.
    slope: f64,
    energy: f64,
    force: f64,
    stable: bool,
}

impl<'b, 'm, const D: usize> Newton<'b, 'm, D> {
    fn new(body: &'b Body<'m, D>, load: f64, guess: &[f64]) -> Self {
        let mut displacement = guess.to_vec();
        displacement.resize(body.unknowns(), f64::NAN);
        body.impose(load, &mut displacement);
        let tangent = SymmetricMatrix::zero(body.pattern());
        Self { body, load, displacement, tangent, iterations: 0, residual: f64::INFINITY }
    }

    fn solve(&mut self, options: &NewtonOptions) -> Result<Equilibrium, Failure> {
        if !self.displacement.iter().all(|u| u.is_finite()) {
            return Err(Failure::Guess);
        }
        if !self.body.admissible(self.load, &self.displacement) {
            return Err(Failure::Inverted);
        }
        while self.iterations < options.max_iterations {
            self.iterations += 1;
            let factor = self.factor()?;
            let step = self.step(&factor)?;
            self.residual = self.relative_norm(&step);
            let converged = self.residual <= options.tolerance && self.is_small(&step);
            self.displacement = self.advance(&step, converged).ok_or(Failure::NoDescent)?;
            let left = if converged {
                Some(0.0)
            } else if step.stable {
                self.use_up(&factor, options.tolerance)?
            } else {
                None
            };
            if let Some(left) = left
                && let Some(rate) = self.rate(&factor, (left, options.tolerance))?
            {
                return Ok(self.finished(rate, &factor));
            }
        }
        Err(Failure::NoConvergence)
    }

    /// Takes more steps with the factor of a state nearby, while they shrink very fast and lead to no cell turned inside out.
    /// What a step leaves of an error, if the last is below the tolerance.
    fn use_up(&mut self, factor: &Factor, tolerance: f64) -> Result<Option<f64>, Failure> {
        loop {
            let step = self.step(factor)?;
            let norm = self.relative_norm(&step);
            let mut trial = self.displacement.clone();
            self.body.add_free(1.0, &step.direction, &mut trial);
            if norm > FAST * self.residual || !self.body.admissible(self.load, &trial) {
                return Ok(None);
            }
            let left = LATER * norm / self.residual;
            (self.displacement, self.residual) = (trial, norm);
            if left > LATER * NEAR {
                return Ok(None);
            }
            if left * norm <= tolerance {
                self.residual = left * norm;
                return Ok(Some(left));
            }
        }
    }

    /// `dU/ds` by a factor of which `left` is known (see [`Self::use_up`]); none where it takes too many solves.
    fn rate(&self, factor: &Factor, (mut left, tolerance): (f64, f64)) -> Result<Option<Vec<f64>>, Failure> {
        const SOLVES: usize = 5;
        let body = self.body;
        let mut rate = vec![0.0; body.unknowns()];
        body.impose(1.0, &mut rate);
        let mut norms: Vec<f64> = Vec::new();
        while norms.len() < SOLVES {
            let forces = body.restrict(&body.force_rate(self.load, &self.displacement, &rate));
            let mut correction = forces.clone();
            factor.solve(&mut correction)?;
            body.add_free(-1.0, &correction, &mut rate);
            let norm = dot(&forces, &correction).abs().sqrt();
            if let Some(before) = norms.last() {
                left = left.max(LATER * norm / before);
            }
            norms.push(norm);
            if left * norm <= tolerance * norms[0] {
                return Ok(Some(rate));
            }
        }
        Ok(None)
    }

    fn factor(&mut self) -> Result<Factor, Failure> {
        self.body.assemble_tangent(self.load, &self.displacement, &mut self.tangent);
        Ok(self.tangent.ldlt()?)
    }

    fn step(&self, factor: &Factor) -> Result<Step, Failure> {
        let forces = self.body.restrict(&self.body.internal_forces(self.load, &self.displacement));
        let mut direction: Vec<f64> = forces.iter().map(|force| -force).collect();
        factor.solve(&mut direction)?;
        if !direction.iter().all(|value| value.is_finite()) {
            return Err(Failure::Singular);
        }
        Ok(Step {
            slope: dot(&forces, &direction),
            energy: self.body.energy(self.load, &self.displacement),
            force: dot(&forces, &forces).sqrt(),
            stable: factor.negative_eigenvalues() == 0,
            direction,
        })
    }

    /// Energy norm of the step over that of the state, or over that of a tiny strain: smaller steps drown in round-off.
    fn relative_norm(&self, step: &Step) -> f64 {
        const TINY_STRAIN: f64 = 1e-3;
        let scale = (2.0 * step.energy).sqrt().max(TINY_STRAIN * self.body.strain_norm());
        step.slope.abs().sqrt() / scale
    }

    /// Where the tangent is indefinite the energy norm of a large step may vanish: its length must be small as well.
    fn is_small(&self, step: &Step) -> bool {
        step.stable || step.direction.iter().all(|value| value.abs() <= 1e-6 * self.body.size())
    }

    /// The longest of the steps 1, ½, ¼, … that is admissible and good enough.
    fn advance(&self, step: &Step, converged: bool) -> Option<Vec<f64>> {
        const HALVINGS: i32 = 16;
        (0..=HALVINGS).map(|halvings| 0.5f64.powi(halvings)).find_map(|length| {
            let mut trial = self.displacement.clone();
            self.body.add_free(length, &step.direction, &mut trial);
            let good = self.body.admissible(self.load, &trial) && (converged || self.is_better(&trial, length, step));
            good.then_some(trial)
        })
    }

    fn is_better(&self, trial: &[f64], length: f64, step: &Step) -> bool {
        const ENOUGH: f64 = 1e-4;
        // Below this the change of energy is round-off, and Newton's method converges by itself.
        const NOISE: f64 = 1e-10;
        if step.stable {
            step.slope.abs() <= NOISE * step.energy
                || self.body.energy(self.load, trial) <= step.energy + ENOUGH * length * step.slope
        } else {
            let forces = self.body.restrict(&self.body.internal_forces(self.load, trial));
            dot(&forces, &forces).sqrt() <= (1.0 - ENOUGH * length) * step.force
        }
    }

    fn finished(&self, rate: Vec<f64>, factor: &Factor) -> Equilibrium {
        let body = self.body;
        let (min_jacobian, min_jacobian_cell) = body.lowest_jacobian(&self.displacement);
        Equilibrium {
            displacement: self.displacement.clone(),
            rate,
            energy: body.energy(self.load, &self.displacement),
            iterations: self.iterations,
            residual: self.residual,
            min_jacobian,
            min_jacobian_cell,
            negative_eigenvalues: factor.negative_eigenvalues(),
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::numerics::hyperelasticity::Prescribed;
    use crate::numerics::material::{Lame, Material, NeoHookean, StVenantKirchhoff};
    use crate::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};

    fn lame() -> Lame {
        Lame::from_young_poisson(1.0, 0.3).unwrap()
    }

    /// The lower edge clamped, the upper lifted by `lift` per unit load.
    fn lifted<const D: usize>(mesh: &SimplexMesh<D>, material: Arc<dyn Material<D>>, lift: f64) -> Body<'_, D> {
        let mut prescribed = Prescribed::none(mesh.vertex_count());
        for (vertex, x) in mesh.vertices().iter().enumerate().filter(|(_, x)| x[D - 1] == 0.0 || x[D - 1] == 1.0) {
            let mut amplitude = [0.0; D];
            amplitude[D - 1] = lift * x[D - 1];
            prescribed.impose_all(vertex, amplitude);
        }
        Body::new(mesh, material, prescribed).unwrap()
    }

    fn solve<const D: usize>(body: &Body<'_, D>, load: f64) -> Result<Equilibrium, EquilibriumError> {
        equilibrium(body, load, &vec![0.0; body.unknowns()], &NewtonOptions::default())
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_equilibrium_and_the_energy_that_of_the_work() {
        let mesh = structured_rectangle(1.5, 1.0, 6, 4).unwrap();
        for material in [
            Arc::new(NeoHookean { lame: lame() }) as Arc<dyn Material<2>>,
            Arc::new(StVenantKirchhoff { lame: lame() }),
        ] {
            let body = lifted(&mesh, material, 0.3);
            let [before, here, after] = [0.199, 0.2, 0.201].map(|load| solve(&body, load).unwrap());
            for (i, rate) in here.rate.iter().enumerate() {
                assert!(((after.displacement[i] - before.displacement[i]) / 0.002 - rate).abs() < 1e-6);
            }
            let forces = body.internal_forces(0.2, &here.displacement);
            let work: f64 = forces.iter().zip(&here.rate).map(|(force, rate)| force * rate).sum();
            assert!(((after.energy - before.energy) / 0.002 - work).abs() < 1e-7);
            assert!(here.negative_eigenvalues == 0 && here.residual <= 1e-12);
        }
    }

    #[test]
    fn a_tetrahedral_bar_that_may_narrow_freely_has_the_uniaxial_closed_form() {
        let vertices = (0..8).map(|v| [f64::from(v & 1), f64::from(v >> 1 & 1), f64::from(v >> 2)]).collect();
        let cells = vec![0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7];
        let mesh = SimplexMesh::<3>::new(vertices, cells).unwrap();
        let mut prescribed = Prescribed::none(8);
        for (vertex, x) in mesh.vertices().iter().enumerate() {
            (0..3).filter(|&c| x[c] == 0.0).for_each(|c| prescribed.impose(vertex, c, 0.0));
            if x[2] == 1.0 {
                prescribed.impose(vertex, 2, 0.2);
            }
        }
        let body = Body::new(&mesh, Arc::new(StVenantKirchhoff { lame: lame() }), prescribed).unwrap();
        let found = solve(&body, 1.0).unwrap();
        // S = 0 across: E_across = −ν E_along, so λ_across² = 1 − ν(λ² − 1) and W = E/8 (λ² − 1)².
        let across = (1.0 - 0.3 * 0.44f64).sqrt();
        assert!((found.displacement[3 * 7] - (across - 1.0)).abs() < 1e-12);
        assert!((found.energy - 0.44f64.powi(2) / 8.0).abs() < 1e-13);
        assert!((found.min_jacobian - 1.2 * across * across).abs() < 1e-12);
    }

    #[test]
    fn failures_name_their_reason_load_and_cell() {
        let mesh = structured_rectangle(1.5, 1.0, 6, 4).unwrap();
        let body = lifted(&mesh, Arc::new(StVenantKirchhoff { lame: lame() }), -0.6);
        let error = solve(&body, 1.0).unwrap_err();
        assert_eq!((error.load, &error.reason, error.iterations), (1.0, &Failure::Inverted, 0));
        assert!((error.worst.jacobian + 1.4).abs() < 1e-12, "{error}");
        assert!(error.worst.position[1] > 0.75, "{error}");
        let guess = vec![f64::NAN; body.unknowns()];
        let error = equilibrium(&body, 0.1, &guess, &NewtonOptions::default()).unwrap_err();
        assert_eq!(error.reason, Failure::Guess);
        assert_eq!(equilibrium(&body, 0.1, &[], &NewtonOptions::default()).unwrap_err().reason, Failure::Guess);
        let hasty = NewtonOptions { max_iterations: 1, ..NewtonOptions::default() };
        let error = equilibrium(&body, 0.1, &vec![0.0; body.unknowns()], &hasty).unwrap_err();
        assert_eq!((error.reason, error.iterations), (Failure::NoConvergence, 1));
    }

    #[test]
    fn a_body_with_nothing_free_is_moved_as_told() {
        let mesh = structured_rectangle(1.0, 1.0, 2, 1).unwrap();
        let body = lifted(&mesh, Arc::new(NeoHookean { lame: lame() }), 0.1);
        let found = solve(&body, 0.5).unwrap();
        assert!((found.min_jacobian - 1.05).abs() < 1e-15 && found.iterations == 1);
        assert!((found.rate[2 * 5 + 1] - 0.1).abs() < 1e-16);
    }

    #[test]
    fn a_step_that_would_invert_is_shortened_and_the_equilibrium_still_found() {
        let mesh = structured_rectangle(1.5, 1.0, 6, 4).unwrap();
        let body = lifted(&mesh, Arc::new(NeoHookean { lame: lame() }), -0.2);
        // The top layer of cells is pressed to a fifth of its height by the bare jump of the border.
        let jumped = solve(&body, 1.0).unwrap();
        let half = solve(&body, 0.5).unwrap();
        let guess: Vec<f64> = half.displacement.iter().zip(&half.rate).map(|(u, du)| u + 0.5 * du).collect();
        let led = equilibrium(&body, 1.0, &guess, &NewtonOptions::default()).unwrap();
        assert!(jumped.iterations > led.iterations);
        for (a, b) in jumped.displacement.iter().zip(&led.displacement) {
            assert!((a - b).abs() < 1e-11);
        }
    }
}
