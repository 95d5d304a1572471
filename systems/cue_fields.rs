//! Provider: the concentration of each cue, eq. (2).
//!
//! −DΔc + kc = Σ_j q 1_{A_j} in Ω_M(t), ∂c/∂n = 0: stationary, so c depends on the load of the tissue alone. It is solved at
//! load levels that an error check chooses and interpolated between them by cubic Hermite polynomials, with the exact dc/ds;
//! once in a tissue at rest; never for a cue that no mechanism reads. What cones sample is the concentration and a *recovered*,
//! continuous gradient. Ours: numbers, lumped mass by default, sources that ride the tissue and release per current area.

use super::matrix::Loading;
use crate::model::observables::{Observable, Observables};
use crate::numerics::hermite::{HermiteError, HermitePath, Refinement, RefinementReport, ValueAndSlope, refine};
use crate::numerics::reaction_diffusion::{
    Mass as MassMatrix, ReactionDiffusion, ReactionDiffusionError, Source, StationarySolver,
};
use crate::numerics::recovery::GradientRecovery;
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What stays the same of a source while the tissue deforms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Release {
    /// q per current area: a source that grows releases more.
    PerArea,
    /// Σ q |A_j|, as at rest: q falls as the source grows.
    Total,
}

/// How the degradation term is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mass {
    /// At the vertices: keeps c ≥ 0 on a Delaunay mesh.
    Lumped,
    /// Exactly: smaller error where the mesh resolves √(D/k), undershoots where it does not.
    Consistent,
}

keys! {
    /// One diffusible cue.
    pub struct Cue {
        /// Diffusivity D. Source: Nodal in zebrafish.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [144.0, 216000.0]))]
        pub diffusion: Diffusivity = Diffusivity(108_000.0),
        /// Degradation rate k; decay length ℓ = √(D/k).
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.36, 18.0]))]
        pub degradation: Rate = Rate(3.6),
        /// Release rate q inside the sources; c → q/k deep inside one. Absent: 50 k · 1 nM. Ours.
        #[schemars(extend("minimum" = 0.0))]
        pub release_rate: Option<ReleaseRate> = None,
        /// What stays the same of the release while the tissue deforms. Ours.
        pub release: Release = Release::PerArea,
        /// How degradation is integrated. Ours.
        pub mass: Mass = Mass::Lumped,
        /// Where it is released.
        #[schemars(length(min = 1))]
        pub sources: Vec<Shape> = Vec::new(),
    }
}

/// The diffusible cues of a scene, by name (eq. 2).
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Cues(pub BTreeMap<String, Cue>);

/// Largest error of the interpolated gradients between load levels: relative, root mean square over the vertices. Ours; well
/// below the error of the gradients themselves.
const LEVEL_TOLERANCE: f64 = 1e-3;
/// Cap on the load levels of a cue.
const MOST_LEVELS: usize = 65;
/// Values a vertex in the stored path: c, ∂c/∂x, ∂c/∂y.
const STRIDE: usize = 3;

impl Mechanism for Cues {
    const NAME: &'static str = "cues";

    fn check(&self, _facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        for (name, cue) in &self.0 {
            wrong.demand(!cue.sources.is_empty(), &format!("/{name}/sources"), || {
                "a cue needs at least one source, such as {\"disc\": {\"centre\": [400, 540], \"radius\": 50}}".into()
            });
            for (i, shape) in cue.sources.iter().enumerate() {
                if let Err(found) = shape.check() {
                    wrong.extend_under(&format!("/{name}/sources/{i}"), found);
                }
            }
        }
        wrong
    }

    fn outlines(&self) -> Vec<(String, Shape)> {
        let of = |(name, cue): (&String, &Cue)| {
            let name = name.clone();
            cue.sources.clone().into_iter().enumerate().map(move |(i, shape)| (region(&name, i), shape))
        };
        self.0.iter().flat_map(of).collect()
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self).at_end(solve_demanded);
        model.term(Term::Fields, bring_fields);
        Ok(())
    }
}

/// Name of the mesh region of a cue's source.
fn region(cue: &str, source: usize) -> String {
    format!("cues/{cue}/sources/{source}")
}

/// Concentration and gradient of a cue at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CueSample {
    /// Concentration c (nM), never negative.
    pub concentration: f64,
    /// Gradient ∇c (nM/µm), spatial.
    pub gradient: Vector3<f64>,
}

/// The cue fields that mechanisms asked for, in the present configuration.
#[derive(Debug, Resource, Default)]
pub struct CueFields {
    names: Vec<String>,
    paths: Vec<HermitePath>,
    current: Vec<Vec<f64>>,
    load: Option<f64>,
}

impl CueFields {
    /// Asks for a cue by name at installation.
    pub fn demand(model: &mut ModelBuilder, cue: &str) {
        model.demand(Cues::NAME, cue);
    }

    /// Number of a cue, under which it is sampled.
    pub fn index(&self, cue: &str) -> Option<usize> {
        self.names.iter().position(|name| name == cue)
    }

    /// Concentration and gradient of cue `index` at a site.
    #[inline]
    pub fn sample(&self, mesh: &SimplexMesh<2>, index: usize, site: Site) -> CueSample {
        let values = &self.current[index];
        let corners = mesh.cell(site.cell as usize);
        let [second, third, _] = site.weights;
        let mut sum = [0.0; STRIDE];
        for (weight, &corner) in [1.0 - second - third, second, third].into_iter().zip(corners) {
            let at = corner as usize * STRIDE;
            (0..STRIDE).for_each(|k| sum[k] += weight * values[at + k]);
        }
        CueSample { concentration: sum[0].max(0.0), gradient: Vector3::new(sum[1], sum[2], 0.0) }
    }

    fn bring_to(&mut self, load: f64) {
        if self.load != Some(load) {
            for (path, values) in self.paths.iter().zip(&mut self.current) {
                path.evaluate(load, values);
            }
            self.load = Some(load);
        }
    }

    fn add(&mut self, name: String, path: HermitePath) {
        self.current.push(vec![0.0; path.components()]);
        self.names.push(name);
        self.paths.push(path);
    }
}

fn bring_fields(configuration: Res<Configuration>, mut fields: ResMut<CueFields>) {
    fields.bring_to(configuration.load);
}

fn read_concentration(world: &World, index: usize) -> Vec<f64> {
    let path = &world.resource::<CueFields>().paths[index];
    let mut values = vec![0.0; path.components()];
    path.evaluate(world.resource::<Configuration>().load, &mut values);
    values.chunks_exact(STRIDE).map(|node| node[0].max(0.0)).collect()
}

fn solve_demanded(world: &mut World) -> Result<(), InstallError> {
    let mut fields = CueFields::default();
    let cues = world.resource::<Law<Cues>>().0.0.clone();
    let demanded = world.resource::<Demands>().of(Cues::NAME);
    let mesh = Arc::clone(&world.resource::<Tissue>().mesh);
    for name in cues.keys().filter(|name| !demanded.contains(name)) {
        world.resource_mut::<Plan>().leave_out(format!("cue `{name}`"), "no mechanism reads it");
    }
    if demanded.iter().any(|name| cues.contains_key(name)) {
        let recovery = GradientRecovery::new(&mesh);
        let regions: Vec<Vec<u32>> = world.resource::<Tissue>().regions.values().cloned().collect();
        let mut solver = StationarySolver::new(&mesh, &regions).map_err(|error| failed("*", error))?;
        for (name, cue) in demanded.iter().filter_map(|name| Some((name, cues.get(name)?))) {
            let mut problem = CueProblem::new(world.resource::<Tissue>(), name, cue, &recovery, &mesh);
            let (path, report) =
                problem.solve(&mut solver, world.get_resource::<Loading>()).map_err(|error| failed(name, error))?;
            problem.note_coarse_mesh(&mut world.resource_mut::<Health>(), name);
            problem.note(&mut world.resource_mut::<Health>(), name, &path, report);
            let index = fields.names.len();
            let observable = Observable { name: name.clone(), index, read: read_concentration };
            world.resource_mut::<Observables>().fields.push(observable);
            let levels = path.levels().len();
            let times = if levels == 1 { "once".to_owned() } else { format!("at {levels} load levels") };
            let why = format!("read; {} unknowns, solved {times}", mesh.vertex_count());
            world.resource_mut::<Plan>().keep(format!("cue `{name}`"), why);
            fields.add(name.clone(), path);
        }
        let work = solver.work();
        let mut counters = world.resource_mut::<Counters>();
        counters.cue_solves += work.solves as u64;
        counters.cue_factorisations += work.factorisations as u64;
    }
    world.insert_resource(fields);
    Ok(())
}

fn failed(cue: &str, error: impl std::fmt::Display) -> InstallError {
    InstallError::Solve(format!("cue `{cue}` (eq. 2): {error}"))
}

/// Why a cue's path could not be solved.
#[derive(Debug, thiserror::Error)]
enum CueError {
    #[error(transparent)]
    Field(#[from] ReactionDiffusionError),
    #[error(transparent)]
    Levels(#[from] HermiteError),
}

/// One cue on the tissue's mesh.
struct CueProblem<'a> {
    mesh: &'a SimplexMesh<2>,
    recovery: &'a GradientRecovery<2>,
    equation: ReactionDiffusion,
    sources: Vec<Vec<u32>>,
    rate: f64,
    release: Release,
    flipped_from: Option<f64>,
}

impl<'a> CueProblem<'a> {
    fn new(
        tissue: &Tissue,
        name: &str,
        cue: &Cue,
        recovery: &'a GradientRecovery<2>,
        mesh: &'a SimplexMesh<2>,
    ) -> Self {
        let mass = match cue.mass {
            Mass::Lumped => MassMatrix::Lumped,
            Mass::Consistent => MassMatrix::Consistent,
        };
        let equation = ReactionDiffusion { diffusion: cue.diffusion.0, degradation: cue.degradation.0, mass };
        let cells = |i: usize| tissue.regions.get(&region(name, i)).cloned().unwrap_or_default();
        let sources = (0..cue.sources.len()).map(cells).collect();
        let rate = cue.release_rate.map_or(50.0 * cue.degradation.0, |q| q.0);
        Self { mesh, recovery, equation, sources, rate, release: cue.release, flipped_from: None }
    }

    fn solve(
        &mut self,
        solver: &mut StationarySolver<2>,
        loading: Option<&Loading>,
    ) -> Result<(HermitePath, RefinementReport), CueError> {
        let goal = Refinement { tolerance: LEVEL_TOLERANCE, max_levels: MOST_LEVELS };
        let rest = self.mesh.vertices();
        let Some(loading) = loading else {
            return refine(&[0.0], |load, _| self.level(solver, load, rest, None), gradient_defect, goal);
        };
        let evaluate = |load: f64, _: Option<&[f64]>| {
            let (moved, slope) = loading.configuration(rest, load);
            self.level(solver, load, &moved, Some(&slope))
        };
        refine(&[0.0, 0.5, 1.0], evaluate, gradient_defect, goal)
    }

    /// c and recovered ∇c at every vertex, interleaved, with their derivatives along a motion of the vertices, if they move.
    fn level(
        &mut self,
        solver: &mut StationarySolver<2>,
        load: f64,
        at: &[[f64; 2]],
        motion: Option<&[[f64; 2]]>,
    ) -> Result<ValueAndSlope, CueError> {
        let system = solver.system(&self.equation, at)?;
        if system.is_flipped() {
            self.flipped_from = Some(self.flipped_from.map_or(load, |first| first.min(load)));
        }
        let sources = self.sources_at(at, motion);
        let interleave = |c: &[f64], g: &[[f64; 2]]| c.iter().zip(g).flat_map(|(c, g)| [*c, g[0], g[1]]).collect();
        let Some(motion) = motion else {
            let c = system.solve(&sources)?;
            let values: Vec<f64> = interleave(&c, &self.recovery.recover(at, &c, true));
            let still = vec![0.0; values.len()];
            return Ok((values, still));
        };
        let (c, slope) = system.solve_with_rate(motion, &sources)?;
        let gradient = self.recovery.recover(at, &c, true);
        let gradient_slope = self.gradient_slope(at, motion, &c, &slope);
        Ok((interleave(&c, &gradient), interleave(&slope, &gradient_slope)))
    }

    fn sources_at<'s>(&'s self, at: &[[f64; 2]], motion: Option<&[[f64; 2]]>) -> Vec<Source<'s>> {
        let source = |cells: &'s Vec<u32>| match self.release {
            Release::PerArea => Source::new(cells, self.rate),
            Release::Total => {
                let rest = self.mesh.vertices();
                let area: f64 = cells.iter().map(|&cell| self.mesh.volume(rest, cell as usize)).sum();
                Source::of_total(self.mesh, at, motion, (cells, self.rate * area))
            }
        };
        self.sources.iter().map(source).collect()
    }

    /// Derivative of the recovered gradient along the motion, by a central difference of the (smooth) recovery.
    fn gradient_slope(&self, at: &[[f64; 2]], motion: &[[f64; 2]], c: &[f64], slope: &[f64]) -> Vec<[f64; 2]> {
        let fastest = motion.iter().flatten().fold(0.0f64, |m, w| m.max(w.abs()));
        if fastest == 0.0 {
            return vec![[0.0; 2]; c.len()];
        }
        let step = 1e-3 / fastest;
        let shifted = |sign: f64| {
            let e = sign * step;
            let x: Vec<[f64; 2]> = at.iter().zip(motion).map(|(x, w)| [x[0] + e * w[0], x[1] + e * w[1]]).collect();
            let value: Vec<f64> = c.iter().zip(slope).map(|(c, dc)| c + e * dc).collect();
            self.recovery.recover(&x, &value, true)
        };
        let (ahead, behind) = rayon::join(|| shifted(1.0), || shifted(-1.0));
        ahead.iter().zip(&behind).map(|(a, b)| [0, 1].map(|k| (a[k] - b[k]) / (2.0 * step))).collect()
    }

    /// Warns of a mesh too coarse for the decay length ℓ = √(D/k): longer edges than ℓ/4.
    fn note_coarse_mesh(&self, health: &mut Health, name: &str) {
        let decay_length = (self.equation.diffusion / self.equation.degradation).sqrt();
        let rest = self.mesh.vertices();
        let areas = (0..self.mesh.cell_count()).map(|cell| self.mesh.volume(rest, cell)).sum::<f64>();
        let edge = (areas / self.mesh.cell_count() as f64 * 4.0 / 3f64.sqrt()).sqrt();
        if edge > 0.3 * decay_length {
            health.note(format!(
                "cue `{name}`: edges of about {edge:.3} um are long for a decay length of {decay_length:.3} um; a quarter is advised"
            ));
        }
    }

    fn note(&self, health: &mut Health, name: &str, path: &HermitePath, report: RefinementReport) {
        if let Some(load) = self.flipped_from {
            health.note(format!(
                "cue `{name}`: by load {load:.3} the tissue's mesh is no longer Delaunay; edges are flipped for its field (vertices stay)"
            ));
        }
        if !report.met {
            let (levels, defect) = (path.levels().len(), report.worst_defect);
            health
                .note(format!("cue `{name}`: {levels} load levels were not enough; gradients are within {defect:.1e}"));
        }
        let nodes = path.levels().iter().flat_map(|level| level.value.iter().step_by(STRIDE));
        let lowest = nodes.fold(0.0f64, |lowest, c| lowest.min(*c));
        if lowest < 0.0 {
            health.note(format!(
                "cue `{name}`: the discrete concentration falls to {lowest:.2e} nM; zero is sensed there"
            ));
        }
    }
}

/// A relative gradient below this (1/µm) is none: a thousandth of the least that is sensed, 1 % per 10 µm. In a convex corner the
/// recovered gradient is zero to round-off, and round-off has no relative error to speak of.
const FLAT: f64 = 1e-6;

/// Root mean square over the vertices of the gradient's relative error.
fn gradient_defect(interpolated: &[f64], exact: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0f64);
    for (a, b) in interpolated.chunks_exact(STRIDE).zip(exact.chunks_exact(STRIDE)) {
        let size = b[1].hypot(b[2]).max(FLAT * b[0].abs());
        if size > 0.0 {
            sum += ((a[1] - b[1]).hypot(a[2] - b[2]) / size).powi(2).min(1.0);
            count += 1.0;
        }
    }
    (sum / count.max(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_off_in_a_corner_is_no_defect_and_a_wrong_gradient_is() {
        let exact = [1.0, 1e-20, 0.0, 1.0, 0.01, 0.0];
        let rounded = [1.0, -3e-20, 1e-20, 1.0, 0.01, 0.0];
        assert!(gradient_defect(&rounded, &exact) < 1e-12);
        let wrong = [1.0, 0.0, 0.0, 1.0, 0.01, 0.002];
        assert!((gradient_defect(&wrong, &exact) - 0.2 / 2f64.sqrt()).abs() < 1e-12);
    }
}
