//! A field in time on a tissue that moves, carried by it and conserved: linear elements, lumped mass.
//!
//! With the vertices fixed to the material, the balance ∂c/∂t + ∇·(c v_φ) = DΔc − kc + q 1_A, no flux at the border, is
//!
//! ```text
//! y' = f(t) − (D K(t) + k M(t)) c,    y = M(t) c    (amounts at the vertices; M lumped, K and f as in eq. 2)
//! ```
//!
//! with y, not c, as the unknown: rows of K add to nothing, so Σ y changes by release and decay alone, whatever the tissue does. It is
//! integrated by TR-BDF2 (γ = 2 − √2, d = γ/2, w = √2/4), of order 2, L-stable, both implicit stages with the matrix M + d h (D K + k M):
//!
//! ```text
//! y₁ = y₀ + d h (k₀ + k₁)    at t + γh          y₂ = y₀ + w h (k₀ + k₁) + d h k₂    at t + h
//! ```
//!
//! The difference to the embedded formula of order 3 weighs the error, h [(4w−1)/3 k₀ − k₁/3 + 2d/3 k₂], taken through the same matrix
//! (Hosea and Shampine 1996, doi 10.1016/0168-9274(95)00115-8). Steps are halves of halves of the time between two kinks, so a factor
//! serves all steps of one length while the tissue rests. What is found is a [`HermitePath`] in time: levels that the cubic through
//! their neighbours gives within the tolerance are left out; a kink is two levels, one of them next to the other.
//!
//! No method of order above 1 keeps c ≥ 0 for every step; a sharp front undershoots by about the tolerance.

use crate::numerics::carried_field::{volume_rates_around, volumes_around};
use crate::numerics::cue_element::{Element, Mass, ReactionDiffusion};
use crate::numerics::delaunay::Monotonicity;
use crate::numerics::field_path::{Along, Configurations, FieldPath, FieldPathError, FieldProblem, FieldSolvers, Room};
use crate::numerics::hermite::{HermitePath, Level, RefinementReport};
use crate::numerics::reaction_diffusion::{
    ReactionDiffusionError, StationarySolver, StationarySystem, check_length, source_load,
};
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::vector::dot;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// γ: where the first stage stands in the step.
const STAGE: f64 = 2.0 - SQRT_2;
/// d = γ/2: share of the step in the matrix.
const SHARE: f64 = 1.0 - FRAC_1_SQRT_2;
/// w = √2/4.
const WEIGHT: f64 = SQRT_2 / 4.0;
/// Weights less those of the embedded formula of order 3.
const ERROR: [f64; 3] = [(4.0 * WEIGHT - 1.0) / 3.0, -1.0 / 3.0, 2.0 * SHARE / 3.0];
/// The step doubles where its error is below this share of the tolerance; at twice the step it is about eight times as large.
const DOUBLE_BELOW: f64 = 1.0 / 16.0;
/// Steps are not halved further than this.
const MOST_HALVINGS: u32 = 40;
/// Steps that one cubic may stand for.
const MOST_BETWEEN: usize = 8;
/// Corners of a cell.
const CORNERS: f64 = 3.0;

/// What is there at the beginning.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// Nothing.
    Nothing,
    /// The stationary field of the sources (with a degradation above zero).
    Stationary,
    /// These concentrations (nM, one entry a vertex).
    Given(Vec<f64>),
}

/// What happens to a field in time, and how closely it is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// What is there at time 0.
    pub start: Start,
    /// Last time (h), positive. Beyond it the path stands still.
    pub end: f64,
    /// Sources release from the first of these times to the second (h).
    pub release: [f64; 2],
    /// Other times at which the tissue's velocity jumps (h), in any order.
    pub kinks: Vec<f64>,
    /// Largest error of a step, and of the cubics between levels: over the largest concentration so far.
    pub tolerance: f64,
    /// The time between two kinks is halved at least so many times to give a step.
    pub halvings: u32,
    /// Cap on the levels; more are an error.
    pub most_levels: usize,
}

impl Course {
    /// Start, end, and all times between at which the right-hand side or the tissue's velocity jumps.
    fn breaks(&self) -> Vec<f64> {
        let inner = self.kinks.iter().chain(&self.release).copied().filter(|&t| 0.0 < t && t < self.end);
        let mut times: Vec<f64> = [0.0, self.end].into_iter().chain(inner).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    fn releases(&self, time: f64) -> bool {
        self.release[0] <= time && time < self.release[1]
    }
}

/// Solves a field of linear elements along the `course`, on a tissue that has `configurations` (coordinates and velocities, µm/h, at a
/// time; at a kink those before it), or rests.
///
/// # Errors
/// A level that cannot be solved; no step short enough; too many levels.
pub fn solve_in_time<'m>(
    problem: &FieldProblem<'m>,
    solvers: &mut FieldSolvers<'m>,
    configurations: Option<Configurations>,
    course: &Course,
) -> Result<FieldPath, FieldPathError> {
    let layout = problem.layout(solvers)?;
    let room = (solvers.room, layout.components(problem.mesh));
    let (solver, recovery) = solvers.linear()?;
    let mut march = March {
        problem,
        solver,
        configurations,
        course,
        room,
        factored: None,
        releasing: false,
        largest: 0.0,
        worst: 0.0,
        steps: 0,
        flipped_from: None,
        monotonicity: None,
    };
    let nodal = march.run()?;
    let with_gradients = |Level { parameter, value, slope }| {
        let (x, velocity) = march.configuration(parameter);
        let (value, slope) = problem.with_gradients(recovery, &layout, (&x, Some(&velocity)), (&value, &slope), true);
        Level { parameter, value, slope }
    };
    let path = HermitePath::new(nodal.into_iter().map(with_gradients).collect())?;
    let report = RefinementReport { solves: march.steps, worst_defect: march.worst, met: true };
    let March { flipped_from, monotonicity, .. } = march;
    solvers.keep(&path);
    Ok(FieldPath { path, along: Along::Time, layout, report, flipped_from, monotonicity })
}

/// The field at an instant.
struct State {
    c: Vec<f64>,
    /// y = M c.
    amount: Vec<f64>,
    /// y'.
    rate: Vec<f64>,
}

struct March<'s, 'm> {
    problem: &'s FieldProblem<'m>,
    solver: &'s mut StationarySolver<'m, 2>,
    configurations: Option<Configurations<'s>>,
    course: &'s Course,
    /// What levels may take, and the numbers of one.
    room: (Room, usize),
    /// The last system, with the step that it was made for.
    factored: Option<(f64, StationarySystem<'m, 2>)>,
    releasing: bool,
    /// Largest concentration so far.
    largest: f64,
    /// Largest error of the steps taken, over the largest concentration.
    worst: f64,
    steps: usize,
    flipped_from: Option<f64>,
    monotonicity: Option<Monotonicity>,
}

impl March<'_, '_> {
    fn run(&mut self) -> Result<Vec<Level>, FieldPathError> {
        let breaks = self.course.breaks();
        let mut levels =
            Levels { stored: Vec::new(), between: Vec::new(), most: self.course.most_levels, room: self.room };
        let mut state = self.start()?;
        for (piece, ends) in breaks.windows(2).enumerate() {
            let (from, to) = (ends[0], ends[1]);
            self.switch(&mut state, (from, self.course.releases(0.5 * (from + to))))?;
            let after = if piece == 0 { from } else { from.next_up() };
            levels.push(self.level(after, &state), f64::INFINITY)?;
            levels.close()?;
            self.march(&mut state, (from, to), &mut levels)?;
            levels.close()?;
        }
        Ok(levels.stored)
    }

    /// Coordinates and velocities; those of the very start are those just after it.
    fn configuration(&self, time: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let rest = self.problem.mesh.vertices();
        match self.configurations {
            Some(configurations) => configurations(time.max(f64::MIN_POSITIVE)),
            None => (rest.to_vec(), vec![[0.0; 2]; rest.len()]),
        }
    }

    /// What all sources release in a configuration (nM µm²/h, one entry a vertex).
    fn release(&self, x: &[[f64; 2]]) -> Result<Vec<f64>, ReactionDiffusionError> {
        source_load((self.problem.mesh, x), &self.problem.sources_at(x, None))
    }

    fn lumped(&self, x: &[[f64; 2]]) -> Vec<f64> {
        volumes_around(self.problem.mesh, x).into_iter().map(|volume| volume / CORNERS).collect()
    }

    fn start(&mut self) -> Result<State, FieldPathError> {
        let (x, _) = self.configuration(0.0);
        let release = self.release(&x)?;
        let (c, rate) = match &self.course.start {
            Start::Nothing => (vec![0.0; x.len()], vec![0.0; x.len()]),
            Start::Stationary => {
                let c = self.solver.system(&self.problem.equation, &x)?.solve_load(release.clone())?;
                (c, release.iter().map(|release| -release).collect())
            }
            Start::Given(c) => {
                check_length("the start", c.len(), x.len())?;
                let ReactionDiffusion { diffusion, degradation, .. } = self.problem.equation;
                // Set up for its connectivity alone, which is flipped where it has to be.
                let law = ReactionDiffusion { diffusion, degradation: 1.0, mass: Mass::Lumped };
                let mut rate = vec![0.0; x.len()];
                subtract_diffusion((self.solver.system(&law, &x)?.mesh(), &x), diffusion, c, &mut rate);
                let kept = c.iter().zip(self.lumped(&x)).map(|(c, mass)| degradation * mass * c);
                (c.clone(), rate.iter().zip(kept).map(|(rate, lost)| rate - lost).collect())
            }
        };
        self.largest = c.iter().fold(0.0, |most, c| c.abs().max(most));
        let amount = c.iter().zip(self.lumped(&x)).map(|(c, mass)| mass * c).collect();
        Ok(State { c, amount, rate })
    }

    /// Switches the release on or off at a time.
    fn switch(&mut self, state: &mut State, (time, on): (f64, bool)) -> Result<(), ReactionDiffusionError> {
        if on != self.releasing {
            let sign = if on { 1.0 } else { -1.0 };
            let release = self.release(&self.configuration(time).0)?;
            state.rate.iter_mut().zip(release).for_each(|(rate, release)| *rate += sign * release);
            self.releasing = on;
        }
        Ok(())
    }

    /// c and ∂c/∂t at fixed material points, M c' = y' − M' c.
    fn level(&self, time: f64, state: &State) -> Level {
        let (x, velocity) = self.configuration(time);
        let growth = volume_rates_around(self.problem.mesh, &x, &velocity);
        let masses = self.lumped(&x).into_iter().zip(growth);
        let slope = masses.zip(state.c.iter().zip(&state.rate));
        let slope = slope.map(|((mass, growth), (c, rate))| (rate - growth / CORNERS * c) / mass).collect();
        Level { parameter: time, value: state.c.clone(), slope }
    }

    /// From one kink to the next: the time between them over 2^n, step by step, n chosen by the error.
    fn march(&mut self, state: &mut State, (from, to): (f64, f64), levels: &mut Levels) -> Result<(), FieldPathError> {
        let tolerance = self.course.tolerance;
        let (mut halvings, mut done) = (self.course.halvings, 0u64);
        while done < 1 << halvings {
            let count = (1u64 << halvings) as f64;
            let at = |step: u64| if step as f64 == count { to } else { from + (to - from) * (step as f64 / count) };
            let (next, error) = self.step(state, (at(done), at(done + 1)), (to - from) / count)?;
            if error <= tolerance {
                *state = next;
                done += 1;
                self.worst = self.worst.max(error);
                self.steps += 1;
                let level = self.level(at(done), state);
                levels.push(level, tolerance * self.largest)?;
                if error < DOUBLE_BELOW * tolerance && done.is_multiple_of(2) && halvings > self.course.halvings {
                    (halvings, done) = (halvings - 1, done / 2);
                }
            } else {
                let excess = if error.is_nan() { f64::INFINITY } else { error / tolerance };
                let more = (excess.log2() / 3.0).ceil().clamp(1.0, 6.0) as u32;
                if halvings + more > MOST_HALVINGS {
                    return Err(FieldPathError::NoStep { time: at(done), tolerance });
                }
                (halvings, done) = (halvings + more, done << more);
            }
        }
        Ok(())
    }

    /// One step, and its error over the largest concentration.
    fn step(
        &mut self,
        state: &State,
        (from, to): (f64, f64),
        step: f64,
    ) -> Result<(State, f64), ReactionDiffusionError> {
        let combined = |parts: &[(f64, &[f64])]| -> Vec<f64> {
            let sum = |i: usize| parts.iter().map(|(weight, values)| weight * values[i]).sum::<f64>();
            (0..state.c.len()).map(sum).collect()
        };
        let base = combined(&[(1.0, &state.amount), (SHARE * step, &state.rate)]);
        let middle = self.stage(step, from + STAGE * (to - from), base)?;
        let weight = WEIGHT * step;
        let base = combined(&[(1.0, &state.amount), (weight, &state.rate), (weight, &middle.rate)]);
        let end = self.stage(step, to, base)?;
        let difference =
            combined(&[(ERROR[0] * step, &state.rate), (ERROR[1] * step, &middle.rate), (ERROR[2] * step, &end.rate)]);
        let (x, _) = self.configuration(to);
        let error = largest_of(&self.system(step, (to, &x))?.solve_load(difference)?);
        let largest = self.largest.max(largest_of(&end.c));
        let relative = if error == 0.0 { 0.0 } else { error / largest };
        if relative <= self.course.tolerance {
            self.largest = largest;
        }
        Ok((end, relative))
    }

    /// An implicit stage, y = base + d h y'.
    fn stage(&mut self, step: f64, time: f64, base: Vec<f64>) -> Result<State, ReactionDiffusionError> {
        let (x, _) = self.configuration(time);
        let share = SHARE * step;
        let mut load = base.clone();
        if self.releasing {
            load.iter_mut().zip(self.release(&x)?).for_each(|(load, release)| *load += share * release);
        }
        let c = self.system(step, (time, &x))?.solve_load(load)?;
        let amount: Vec<f64> = c.iter().zip(self.lumped(&x)).map(|(c, mass)| mass * c).collect();
        let rate = amount.iter().zip(base).map(|(amount, base)| (amount - base) / share).collect();
        Ok(State { c, amount, rate })
    }

    /// The factored M + d h (D K + k M) of a configuration.
    fn system(
        &mut self,
        step: f64,
        (time, x): (f64, &[[f64; 2]]),
    ) -> Result<&StationarySystem<'_, 2>, ReactionDiffusionError> {
        let system = match self.factored.take() {
            Some((made_for, system)) if made_for == step && system.coordinates() == x => system,
            _ => {
                let ReactionDiffusion { diffusion, degradation, .. } = self.problem.equation;
                let share = SHARE * step;
                let law = ReactionDiffusion {
                    diffusion: share * diffusion,
                    degradation: 1.0 + share * degradation,
                    mass: Mass::Lumped,
                };
                let system = self.solver.system(&law, x.to_vec())?;
                if system.is_flipped() {
                    self.flipped_from = Some(self.flipped_from.map_or(time, |first| first.min(time)));
                }
                let edges = system.edge_report().map(|report| report.monotonicity);
                self.monotonicity = edges.map(|edges| self.monotonicity.map_or(edges, |worst| worst.worse(edges)));
                system
            }
        };
        Ok(&self.factored.insert((step, system)).1)
    }
}

/// Subtracts D K c from `rate`.
fn subtract_diffusion((mesh, x): (&SimplexMesh<2>, &[[f64; 2]]), diffusion: f64, c: &[f64], rate: &mut [f64]) {
    for cell in 0..mesh.cell_count() {
        let element = Element::new(mesh, x, cell);
        let mut slope = [0.0; 2];
        for (gradient, &vertex) in element.gradients.iter().zip(element.corners) {
            (0..2).for_each(|k| slope[k] += c[vertex as usize] * gradient[k]);
        }
        for (gradient, &vertex) in element.gradients.iter().zip(element.corners) {
            rate[vertex as usize] -= diffusion * element.volume * dot(gradient, &slope);
        }
    }
}

fn largest_of(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| if value.is_nan() { f64::NAN } else { value.abs().max(most) })
}

/// The levels that are kept, and those that the coming one may make superfluous.
struct Levels {
    stored: Vec<Level>,
    between: Vec<Level>,
    most: usize,
    room: (Room, usize),
}

impl Levels {
    /// Adds a level; those between it and the last stored are left out if the cubic comes within `allowed` of all.
    fn push(&mut self, level: Level, allowed: f64) -> Result<(), FieldPathError> {
        if let (Some(last), false) = (self.stored.last(), self.between.is_empty()) {
            let cubic = HermitePath::new(vec![last.clone(), level.clone()])?;
            let mut guess = vec![0.0; cubic.components()];
            let met = |between: &Level| {
                cubic.evaluate(between.parameter, &mut guess);
                guess.iter().zip(&between.value).all(|(guess, exact)| (guess - exact).abs() <= allowed)
            };
            if self.between.len() >= MOST_BETWEEN || !self.between.iter().all(met) {
                self.close()?;
            }
        }
        self.between.push(level);
        Ok(())
    }

    /// Stores the last level, as at a kink.
    fn close(&mut self) -> Result<(), FieldPathError> {
        if let Some(last) = self.between.pop() {
            if self.stored.len() >= self.most {
                return Err(FieldPathError::TooManyLevels { levels: self.most, time: last.parameter });
            }
            let (room, components) = self.room;
            room.demand(self.stored.len() + 1, components)?;
            self.stored.push(last);
        }
        self.between.clear();
        Ok(())
    }
}
