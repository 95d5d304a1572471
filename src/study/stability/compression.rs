//! Map: the matrix in compression, eq. (3): a block pressed between sliding ends.
//!
//! Four things are told apart, each over the stretch s of the block along the load (1 at rest, 0.6 at 20 % per side):
//!
//! - **force maximum**: uniaxial St. Venant–Kirchhoff has the force `P ∝ s (s² − 1)`, with its extremum at `1/√3`, whatever ν;
//! - **ellipticity**: the smallest eigenvalue of the acoustic tensor over all directions, at the homogeneous F, is positive before it
//!   is lost;
//! - **inertia**: the first negative eigenvalue of the *discrete* tangent, from the signs of its LDLT factor: the structure buckles,
//!   earlier than the material softens;
//! - **Newton's method** along the homogeneous branch: its iterations, and how the path ends.
//!
//! Sides are `free`, or `confined` (no motion across). Stretches across free sides are those of vanishing stress. Young's modulus is 1.

use super::unsolved;
use crate::numerics::hyperelasticity::{Body, Prescribed};
use crate::numerics::load_path::{LoadPath, LoadPathOptions};
use crate::numerics::material::{Lame, Material, NeoHookean, StVenantKirchhoff, Tensor, acoustic_minimum};
use crate::numerics::newton::{NewtonOptions, equilibrium};
use crate::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};
use crate::numerics::sparse::SymmetricMatrix;
use crate::study::run::RunError;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;

/// Width and height of the block at rest.
pub const BLOCK: [f64; 2] = [1.5, 1.0];
/// The farthest stretch of the map.
pub const FARTHEST: f64 = 0.5;

/// A law of the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// St. Venant–Kirchhoff.
    StVenantKirchhoff,
    /// Neo-Hookean.
    NeoHookean,
}

/// What the sides of the block do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sides {
    /// Free of stress.
    Free,
    /// Held across.
    Confined,
}

/// Smallest acoustic eigenvalue (over Young's modulus) along the homogeneous branch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ellipticity {
    /// The law.
    pub law: Law,
    /// Poisson's ratio.
    pub poisson: f64,
    /// The sides.
    pub sides: Sides,
    /// The stretch at which the smallest eigenvalue passes zero; `null` if it does not before [`FARTHEST`].
    pub lost_at: Option<f64>,
    /// Stretch and smallest eigenvalue.
    pub curve: Vec<[f64; 2]>,
}

/// Force on the top of the discrete block along the homogeneous branch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Force {
    /// Poisson's ratio.
    pub poisson: f64,
    /// The sides.
    pub sides: Sides,
    /// The stretch of the largest compressive force.
    pub maximum_at: f64,
    /// Stretch and compressive force over Young's modulus and width.
    pub curve: Vec<[f64; 2]>,
}

/// Where the discrete tangent first has a negative eigenvalue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inertia {
    /// The law.
    pub law: Law,
    /// Poisson's ratio.
    pub poisson: f64,
    /// The sides.
    pub sides: Sides,
    /// Rows of cells (each side of a cell is 1/rows).
    pub rows: usize,
    /// The stretch; `null` if there is none before [`FARTHEST`].
    pub first_negative: Option<f64>,
    /// The same as a motion of each end, in per cent of the height.
    pub per_side: Option<f64>,
}

/// Newton's method along a path of equilibria.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct March {
    /// The law.
    pub law: Law,
    /// Poisson's ratio.
    pub poisson: f64,
    /// The sides.
    pub sides: Sides,
    /// Whether the ends are held across as well (`held`), as is the default of a scene.
    pub clamped: bool,
    /// Rows of cells.
    pub rows: usize,
    /// Stretch and iterations of each level found.
    pub iterations: Vec<[f64; 2]>,
    /// The smallest stretch with an equilibrium, increments being halved where Newton's method fails.
    pub reached: f64,
    /// The first level whose tangent has a negative eigenvalue.
    pub unstable_from: Option<f64>,
    /// The smallest det F of all equilibria found.
    pub min_jacobian: f64,
    /// What ended the path before [`FARTHEST`].
    pub ended_by: Option<String>,
}

/// The map of the matrix in compression.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompressionMap {
    /// Ellipticity.
    pub ellipticity: Vec<Ellipticity>,
    /// Forces.
    pub force: Vec<Force>,
    /// Inertia.
    pub inertia: Vec<Inertia>,
    /// Newton's method.
    pub newton: Vec<March>,
}

/// How much is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Effort {
    /// Poisson's ratios.
    pub poisson: Vec<f64>,
    /// Rows of the meshes on which inertia is counted; multiples of 4.
    pub rows: Vec<usize>,
    /// Rows of the meshes of the clamped block.
    pub clamped_rows: Vec<usize>,
    /// Points of a curve.
    pub points: usize,
}

impl Effort {
    /// That of the command.
    pub fn full() -> Self {
        Self { poisson: vec![0.0, 0.3, 0.45], rows: vec![12, 24], clamped_rows: vec![8, 16, 24], points: 51 }
    }
}

/// A homogeneous compression: law, ν, sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The law.
    pub law: Law,
    /// Poisson's ratio.
    pub poisson: f64,
    /// The sides.
    pub sides: Sides,
}

/// Computes the map.
///
/// # Errors
/// Something other than what is meant to fail.
pub fn compute(effort: &Effort) -> Result<CompressionMap, RunError> {
    let mut cases = Vec::new();
    for law in [Law::StVenantKirchhoff, Law::NeoHookean] {
        for &poisson in &effort.poisson {
            cases.extend([Sides::Free, Sides::Confined].map(|sides| Case { law, poisson, sides }));
        }
    }
    let svk = || cases.iter().filter(|case| case.law == Law::StVenantKirchhoff).copied();
    let ellipticity = cases.par_iter().map(|case| ellipticity(*case, effort.points)).collect::<Result<_, _>>()?;
    let force = svk().map(|case| force(case, effort.points)).collect::<Result<_, _>>()?;
    let meshes: Vec<(Case, usize)> =
        cases.iter().flat_map(|case| effort.rows.iter().map(|&rows| (*case, rows))).collect();
    let inertia = meshes.into_par_iter().map(|(case, rows)| inertia(case, rows)).collect::<Result<_, _>>()?;
    let sliding = cases.iter().map(|case| (*case, effort.rows[0], false));
    let clamped = cases.iter().filter(|case| case.sides == Sides::Free && case.poisson == 0.3);
    let clamped = clamped.flat_map(|case| effort.clamped_rows.iter().map(|&rows| (*case, rows, true)));
    let marches: Vec<_> = sliding.chain(clamped).collect();
    let newton = marches.into_par_iter().map(|(case, rows, held)| march(case, rows, held)).collect::<Result<_, _>>()?;
    Ok(CompressionMap { ellipticity, force, inertia, newton })
}

impl Case {
    /// The law with E = 1.
    ///
    /// # Errors
    /// A Poisson's ratio out of range.
    pub fn material(self) -> Result<Arc<dyn Material<2>>, RunError> {
        let lame = Lame::from_young_poisson(1.0, self.poisson).map_err(unsolved)?;
        Ok(match self.law {
            Law::StVenantKirchhoff => Arc::new(StVenantKirchhoff { lame }),
            Law::NeoHookean => Arc::new(NeoHookean { lame }),
        })
    }

    /// The homogeneous F at a stretch below 1: across free sides the stress vanishes.
    pub fn gradient(self, material: &dyn Material<2>, stretch: f64) -> Tensor<2> {
        let diagonal = |across: f64| Tensor::<2>::new(across, 0.0, 0.0, stretch);
        if self.sides == Sides::Confined {
            return diagonal(1.0);
        }
        let (mut low, mut high) = (1.0, 4.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if material.stress(&diagonal(middle))[(0, 0)] < 0.0 { low = middle } else { high = middle }
        }
        diagonal(0.5 * (low + high))
    }
}

/// `count` stretches from 1 to [`FARTHEST`].
fn stretches(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| 1.0 - (1.0 - FARTHEST) * i as f64 / (count.max(2) - 1) as f64)
}

/// The largest stretch below 1 at which `broken` holds, if there is one among `count` and the ones between are like them.
fn first(count: usize, mut broken: impl FnMut(f64) -> Result<bool, RunError>) -> Result<Option<f64>, RunError> {
    let mut sound = 1.0;
    for stretch in stretches(count) {
        if broken(stretch)? {
            let mut lost = stretch;
            while sound - lost > 1e-5 {
                let middle = 0.5 * (sound + lost);
                if broken(middle)? { lost = middle } else { sound = middle }
            }
            return Ok(Some(0.5 * (sound + lost)));
        }
        sound = stretch;
    }
    Ok(None)
}

/// Ellipticity along the homogeneous branch.
///
/// # Errors
/// A Poisson's ratio out of range.
pub fn ellipticity(case: Case, points: usize) -> Result<Ellipticity, RunError> {
    let Case { law, poisson, sides } = case;
    let material = case.material()?;
    let smallest = |stretch: f64| acoustic_minimum(&*material, &case.gradient(&*material, stretch));
    let curve = stretches(points).map(|stretch| [stretch, smallest(stretch)]).collect();
    let lost_at = first(points, |stretch| Ok(smallest(stretch) <= 0.0))?;
    Ok(Ellipticity { law, poisson, sides, lost_at, curve })
}

fn force(case: Case, points: usize) -> Result<Force, RunError> {
    let mesh = block(4)?;
    let body = pressed(&mesh, case, false)?;
    let at = |stretch: f64| {
        let forces = body.internal_forces(1.0, &homogeneous(&body, case, stretch));
        let top = (0..mesh.vertex_count()).filter(|&v| mesh.vertices()[v][1] == BLOCK[1]);
        -body.resultant(&forces, top)[1] / BLOCK[0]
    };
    let curve: Vec<[f64; 2]> = stretches(points).map(|stretch| [stretch, at(stretch)]).collect();
    // Golden section, on a curve with one maximum.
    let (mut low, mut high, share) = (FARTHEST, 1.0, 0.5 * (5f64.sqrt() - 1.0));
    while high - low > 1e-9 {
        let (a, b) = (high - share * (high - low), low + share * (high - low));
        if at(a) > at(b) { high = b } else { low = a }
    }
    Ok(Force { poisson: case.poisson, sides: case.sides, maximum_at: 0.5 * (low + high), curve })
}

/// Where the discrete tangent on a mesh of `rows` rows first has a negative eigenvalue along the homogeneous branch.
///
/// # Errors
/// A Poisson's ratio out of range; a factorisation that failed but for a zero pivot, which counts as negative.
pub fn inertia(case: Case, rows: usize) -> Result<Inertia, RunError> {
    let Case { law, poisson, sides } = case;
    let mesh = block(rows)?;
    let body = pressed(&mesh, case, false)?;
    let mut tangent = SymmetricMatrix::zero(body.pattern());
    let first_negative = first(26, |stretch| {
        body.assemble_tangent(1.0, &homogeneous(&body, case, stretch), &mut tangent);
        Ok(tangent.ldlt().map_or(true, |factor| factor.negative_eigenvalues() > 0))
    })?;
    let per_side = first_negative.map(|stretch| 50.0 * (1.0 - stretch));
    Ok(Inertia { law, poisson, sides, rows, first_negative, per_side })
}

fn march(case: Case, rows: usize, clamped: bool) -> Result<March, RunError> {
    let mesh = block(rows)?;
    let body = pressed(&mesh, case, clamped)?;
    let stretch = |load: f64| 1.0 - (1.0 - FARTHEST) * load;
    let mut iterations = Vec::new();
    let (mut guess, mut min_jacobian, mut unstable_from) = (vec![0.0; body.unknowns()], 1.0f64, None);
    const LEVELS: u32 = 20;
    for level in 0..=LEVELS {
        let load = f64::from(level) / f64::from(LEVELS);
        let Ok(found) = equilibrium(&body, load, &guess, &NewtonOptions::default()) else { break };
        iterations.push([stretch(load), found.iterations as f64]);
        min_jacobian = min_jacobian.min(found.min_jacobian);
        if found.negative_eigenvalues > 0 {
            unstable_from.get_or_insert(stretch(load));
        }
        guess = found.displacement;
        guess.iter_mut().zip(&found.rate).for_each(|(u, rate)| *u += rate / f64::from(LEVELS));
    }
    let mut reached = stretch(f64::from(LEVELS.min(iterations.len().saturating_sub(1) as u32)) / f64::from(LEVELS));
    let mut ended_by = None;
    if reached > FARTHEST {
        // What a run does where an increment fails: it is halved, and in the end the error says where and how much.
        let options = LoadPathOptions { min_levels: LEVELS as usize + 1, tolerance: 1e-3, ..Default::default() };
        if let Err(error) = LoadPath::solve(&body, &options) {
            reached = stretch(reached_load(&error));
            ended_by = Some(error.to_string());
        } else {
            reached = FARTHEST;
        }
    }
    let Case { law, poisson, sides } = case;
    Ok(March { law, poisson, sides, clamped, rows, iterations, reached, unstable_from, min_jacobian, ended_by })
}

fn reached_load(error: &crate::numerics::load_path::LoadPathError) -> f64 {
    use crate::numerics::load_path::LoadPathError as Error;
    match error {
        Error::Lost { last_good, .. } => *last_good,
        Error::InterpolantInverted { from, .. } => *from,
        Error::TooManyLevels { reached, .. } => *reached,
        Error::Levels(_) => 0.0,
    }
}

fn block(rows: usize) -> Result<SimplexMesh<2>, RunError> {
    structured_rectangle(BLOCK[0], BLOCK[1], rows * 3 / 2, rows).map_err(unsolved)
}

/// The block between ends that press it to [`FARTHEST`] at load 1.
fn pressed(mesh: &SimplexMesh<2>, case: Case, clamped: bool) -> Result<Body<'_, 2>, RunError> {
    let ([width, height], way) = (BLOCK, 0.5 * (1.0 - FARTHEST) * BLOCK[1]);
    let mut prescribed = Prescribed::none(mesh.vertex_count());
    for (vertex, &[x, y]) in mesh.vertices().iter().enumerate() {
        if y == 0.0 || y == height {
            prescribed.impose(vertex, 1, if y == 0.0 { way } else { -way });
            if clamped || (y == 0.0 && x == 0.5 * width) {
                prescribed.impose(vertex, 0, 0.0);
            }
        }
        if case.sides == Sides::Confined && (x == 0.0 || x == width) {
            prescribed.impose(vertex, 0, 0.0);
        }
    }
    Body::new(mesh, case.material()?, prescribed).map_err(unsolved)
}

/// The displacement of the homogeneous F, the middle of the bottom staying on its line.
fn homogeneous(body: &Body<'_, 2>, case: Case, stretch: f64) -> Vec<f64> {
    let gradient = case.gradient(body.material(), stretch);
    let middle = [0.5 * BLOCK[0], 0.5 * BLOCK[1]];
    let moved = |x: &[f64; 2]| [0, 1].map(|k| (gradient[(k, k)] - 1.0) * (x[k] - middle[k]));
    body.mesh().vertices().iter().flat_map(moved).collect()
}
