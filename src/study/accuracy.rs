//! `"accuracy": ε` in place of mesh size, step and load levels: the program finds them by pilot runs.
//!
//! The error asked for is the root mean square, over growth cones, of the tip's displacement over the length of its
//! path, for the scene without contact and noise (with them paths are chaotic). Pilots run up to 200 axons of a
//! population to the end of the run: one axon whose path splits from its neighbours' may be the whole of a root mean
//! square, so that few are left out.
//!
//! Two sequences of pilots are made, one that halves the step Δt on a middling mesh, one that shrinks the mesh size h
//! by √2. Each place k of a sequence is judged against the finest, K, and what the last refinement changed, which
//! bounds the error of the finest where methods are of order 1 in Δt (kinks of linear fields, borders) and 2 in h:
//!
//! ```text
//! e_k = |x_k − x_K| + |x_(K−1) − x_K|
//! ```
//!
//! A sequence ends when e ≤ 0.4 ε at two refinements in a row, K − 2 and K − 1, so that an agreement by chance does
//! not count; or when three refinements change tips no less than those before, as where paths separate. The two
//! sequences say where to look: pairs of places with √(e_Δt² + e_h²) ≤ 4 ε are tried in order of their work (a step
//! that was bad on the middling mesh may be good on a finer one), and the first is taken whose tips lie within 0.9 ε,
//! the tail of the finest included, of those of one run with the finest of both. Work is counted, not timed, so that
//! the choice is the same everywhere. A matrix that moves is then tried on a mesh of its own, 4 and 2 times coarser.
//! The tolerance of the load path is ε/1000. Keys that the scene gives itself are kept. Ours: all of this.

use super::laboratory::{ConeView, Laboratory, chaotic, cones, few_axons, root_mean_square, run_until};
use super::run::{RunError, read};
use crate::model::health::Counters;
use crate::model::mechanism::Roster;
use crate::model::plan::Plan;
use crate::model::tissue::{Configuration, Tissue};
use crate::model::violation::Violation;
use crate::scenario::load::{Loaded, Request, ScenarioErrors};
use serde::Serialize;

/// What one part of the error may come to where its sequence ends, over the accuracy asked for.
const SHARE: f64 = 0.4;
/// What both parts may come to for a pair to be tried, and what one run may then show.
const TRIED: f64 = 4.0;
const TAKEN: f64 = 0.9;
/// Pairs tried at most.
const MOST_TRIALS: usize = 16;
/// Tolerance of the load path over the accuracy.
const LEVELS: f64 = 1e-3;
/// Mesh sizes tried for the matrix alone, over that of the tissue.
const COARSER_FOR_MATRIX: [f64; 2] = [4.0, 2.0];
/// Axons of a population in a pilot.
const PILOT_AXONS: u64 = 200;
/// The coarsest mesh tried: this share of the tissue's smaller extent.
const COARSEST_MESH: f64 = 1.0 / 6.0;
/// Place in the sequence of meshes of the one on which steps are judged.
const MESH_FOR_STEPS: usize = 2;
/// Steps of the coarsest clock tried.
const FEWEST_STEPS: f64 = 16.0;
/// Refinements of each kind at most.
const MOST_REFINEMENTS: usize = 14;
/// A mesh of more vertices than this is not tried.
const MOST_VERTICES: f64 = 1e5;
/// Work for a vertex each time a mesh, a field or an equilibrium is gone through, in steps of a cone. Ours: a round
/// number, as the next.
const VERTEX_IN_A_PASS: f64 = 10.0;
/// Work for a vertex at each stage of a tissue that moves.
const VERTEX_AT_A_STAGE: f64 = 0.02;

/// What was found for a scene that states an accuracy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The accuracy asked for.
    pub asked: f64,
    /// Estimated error of the choice, as a whole.
    pub estimated: f64,
    /// Estimated error by the step and by the mesh.
    pub by_step: f64,
    /// See `by_step`.
    pub by_mesh: f64,
    /// Whether the estimates meet what was asked.
    pub met: bool,
    /// The keys, as `--set` takes them, that replace the accuracy.
    pub set: Vec<String>,
    /// Runs made to find them.
    pub pilots: usize,
}

/// Reads a scene; where it states an accuracy, finds the keys for it and puts them in its place. Returns the request that gives
/// the scene without further search. `admit` looks at what has been read before any pilot is run.
///
/// # Errors
/// All problems of the scene; one that cannot be assembled or run; what `admit` refuses.
pub fn settled(
    request: &Request,
    roster: &Roster,
    admit: impl FnOnce(&Loaded) -> Result<(), RunError>,
) -> Result<(Request, Loaded), RunError> {
    let mut loaded = read(request, roster)?;
    admit(&loaded)?;
    let mut request = request.clone();
    if loaded.scene.accuracy.is_none() {
        return Ok((request, loaded));
    }
    if let Some(found) = find(&Laboratory::new(&request, roster))? {
        let hints = std::mem::take(&mut loaded.hints);
        request.set.extend(found.set.iter().cloned());
        loaded = Loaded { hints, remarks: vec![found.note()], ..read(&request, roster)? };
    }
    Ok((request, loaded))
}

/// Finds the cheapest settings for a scene that states an accuracy; none for one that does not.
///
/// # Errors
/// A scene that gives step and mesh size itself, or that cannot be assembled or run.
pub fn find(laboratory: &Laboratory) -> Result<Option<Found>, RunError> {
    let scene = laboratory.scene()?;
    let Some(asked) = scene.scene.accuracy.map(|accuracy| accuracy.0) else { return Ok(None) };
    let step_given = given(&scene, "/time/step");
    let mesh_given = given(&scene, "/tissue/mesh_size") || !scene.scene.tissue.outline.vertices().is_empty();
    if step_given && mesh_given {
        let message = "nothing is left to choose: the scene gives /time/step and /tissue/mesh_size (or the vertices inside); leave one of them out";
        let problems = vec![Violation::new("/accuracy", message)];
        return Err(RunError::Scenario(ScenarioErrors { path: laboratory.request.path.clone(), problems }));
    }
    let step = scene.scene.time.step.0;
    let mut search = Search { laboratory, scene: &scene, mesh: None, matrix_mesh: None, step, pilots: 0, asked };
    search.mesh = (!mesh_given).then(|| search.mesh_size(MESH_FOR_STEPS));
    if !step_given {
        search.step = search.longest_step()?;
    }
    let steps = if step_given { Sequence::fixed(search.step) } else { search.refined_steps()? };
    search.step = steps.values[steps.settled];
    let meshes = if mesh_given { Sequence::fixed(0.0) } else { search.refined_meshes()? };
    let Choice { step, mesh, mut error, judge } = search.cheapest(&steps, &meshes)?;
    search.put(&steps, step, &meshes, mesh);
    if let Some(judge) = judge {
        error = search.coarser_matrix(&judge)?.unwrap_or(error);
    }
    let estimated = error;
    let (by_step, by_mesh) = (steps.errors[step], meshes.errors[mesh]);
    let mut set = search.keys();
    set.push("/accuracy=null".to_owned());
    Ok(Some(Found { asked, estimated, by_step, by_mesh, met: estimated <= asked, set, pilots: search.pilots }))
}

impl Found {
    /// What the summary says of it.
    pub fn note(&self) -> String {
        let Self { asked, estimated, by_step, by_mesh, met, set, pilots } = self;
        let keys: Vec<&str> = set.iter().map(String::as_str).filter(|key| !key.ends_with("=null")).collect();
        let verdict = if *met { "chosen for" } else { "as near as could be afforded to" };
        format!(
            "accuracy {asked}: {} {verdict} it; an error of {estimated:.1e} ({by_step:.1e} by the step, {by_mesh:.1e} by the mesh) is \
             estimated from {pilots} pilot runs without contact and noise",
            keys.join(", ")
        )
    }
}

fn given(scene: &Loaded, pointer: &str) -> bool {
    scene.merged.pointer(pointer).is_some_and(|value| !value.is_null())
}

struct Search<'a> {
    laboratory: &'a Laboratory<'a>,
    scene: &'a Loaded,
    /// Mesh size (µm); none where the scene's own is kept.
    mesh: Option<f64>,
    /// Mesh size of the matrix (µm); none where it is that of the tissue, or the scene's own.
    matrix_mesh: Option<f64>,
    /// Step (h).
    step: f64,
    pilots: usize,
    asked: f64,
}

/// Places of a step and a mesh size in their sequences, and how wrong tips are with them.
struct Choice {
    step: usize,
    mesh: usize,
    error: f64,
    /// What it was judged by, if it was found to be good enough.
    judge: Option<Judge>,
}

/// A run with the finest of both, and a bound of its own error.
struct Judge {
    finest: Pilot,
    tail: f64,
}

impl Judge {
    fn error(&self, pilot: &Pilot) -> f64 {
        difference(&pilot.tips, &self.finest.tips) + self.tail
    }
}

/// What a pilot run left.
struct Pilot {
    tips: Vec<ConeView>,
    counts: Counts,
}

/// What the work of a run is reckoned from.
#[derive(Clone, Copy, Default)]
struct Counts {
    cone_steps: f64,
    stages: f64,
    vertices: f64,
    passes: f64,
    moves: bool,
}

/// Values refined from place to place.
struct Sequence {
    values: Vec<f64>,
    errors: Vec<f64>,
    counts: Vec<Counts>,
    /// The coarsest place that ends the sequence well, or the best there is.
    settled: usize,
    /// Bound of the finest's own error.
    tail: f64,
}

impl Sequence {
    /// A value that the scene gives.
    fn fixed(value: f64) -> Self {
        Self { values: vec![value], errors: vec![0.0], counts: vec![Counts::default()], settled: 0, tail: 0.0 }
    }

    fn of(values: Vec<f64>, pilots: &[Pilot], goal: f64) -> Self {
        let mut errors = errors(pilots);
        let (tail, last) = (errors.pop().unwrap_or(0.0), errors.len().saturating_sub(1));
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let good = if errors.last().is_some_and(|error| *error <= goal) { goal } else { 1.5 * least };
        let settled = (0..=last).rev().take_while(|&k| errors[k] <= good).last().unwrap_or(last);
        let counts = pilots.iter().map(|pilot| pilot.counts).collect();
        Self { values, errors, counts, settled, tail }
    }

    fn finest(&self) -> usize {
        self.values.len() - 1
    }
}

/// The error of each pilot by the finest of them; last that of the finest itself.
fn errors(pilots: &[Pilot]) -> Vec<f64> {
    let Some((finest, coarser)) = pilots.split_last() else { return Vec::new() };
    let tail = coarser.last().map_or(0.0, |last| difference(&last.tips, &finest.tips));
    coarser.iter().map(|pilot| difference(&pilot.tips, &finest.tips) + tail).chain([tail]).collect()
}

/// Whether the last three refinements changed tips as much as all before.
fn stagnates(changes: &[f64]) -> bool {
    let least = |changes: &[f64]| changes.iter().copied().fold(f64::INFINITY, f64::min);
    changes.len() >= 8 && least(&changes[changes.len() - 3..]) > 0.8 * least(&changes[..changes.len() - 3])
}

/// Work of a run with the steps of one pilot and the mesh of another, in steps of a cone (about a microsecond).
fn work(steps: &Counts, mesh: &Counts) -> f64 {
    let each_stage = if mesh.moves { VERTEX_AT_A_STAGE * mesh.vertices } else { 0.0 };
    steps.cone_steps + steps.stages * each_stage + VERTEX_IN_A_PASS * mesh.vertices * mesh.passes
}

impl Search<'_> {
    fn keys(&self) -> Vec<String> {
        let mut keys = vec![format!("/time/step={:e}", self.step)];
        keys.extend(self.mesh.map(|size| format!("/tissue/mesh_size={size:e}")));
        if self.scene.blocks.contains_key("matrix") && !given(self.scene, "/matrix/tolerance") {
            keys.push(format!("/matrix/tolerance={:e}", (LEVELS * self.asked).clamp(1e-9, 1e-3)));
        }
        keys.extend(self.matrix_mesh.map(|size| format!("/matrix/mesh_size={size:e}")));
        keys
    }

    fn extent(&self) -> [f64; 2] {
        let points = self.scene.scene.tissue.outline.outer().coordinates();
        [0, 1].map(|k| {
            let ends = points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |e, p| [e[0].min(p[k]), e[1].max(p[k])]);
            ends[1] - ends[0]
        })
    }

    /// Size of a place in the sequence of meshes (µm).
    fn mesh_size(&self, place: usize) -> f64 {
        let [width, height] = self.extent();
        COARSEST_MESH * width.min(height) * 0.5f64.powf(0.5 * place as f64)
    }

    /// The longest step that passes no limit of the scene's plan.
    fn longest_step(&mut self) -> Result<f64, RunError> {
        self.step = self.scene.scene.time.duration.0 / FEWEST_STEPS;
        let simulation = self.laboratory.assemble(&self.laboratory.load(&[], &self.keys())?)?;
        let margins = &simulation.world().resource::<Plan>().margins;
        let of_step = margins.iter().filter(|margin| margin.advice.contains("step") && margin.limit > 0.0);
        let worst = of_step.map(|margin| margin.value / margin.limit).fold(1.0, f64::max);
        Ok(self.step / 2f64.powf(worst.log2().ceil()))
    }

    fn refined_steps(&mut self) -> Result<Sequence, RunError> {
        let start = self.step;
        self.refined(|search, k| {
            search.step = start * 0.5f64.powi(k as i32);
            search.step
        })
    }

    fn refined_meshes(&mut self) -> Result<Sequence, RunError> {
        self.refined(|search, k| {
            let size = search.mesh_size(k);
            search.mesh = Some(size);
            size
        })
    }

    fn affordable(&self) -> bool {
        let [width, height] = self.extent();
        self.mesh.is_none_or(|size| 1.155 * width * height <= MOST_VERTICES * size * size)
    }

    /// Refines until the errors at two places in a row are small, or no refinement helps or can be afforded.
    fn refined(&mut self, mut set: impl FnMut(&mut Self, usize) -> f64) -> Result<Sequence, RunError> {
        let goal = SHARE * self.asked;
        let (mut values, mut pilots, mut changes) = (vec![set(self, 0)], vec![self.pilot()?], Vec::new());
        for k in 1..=MOST_REFINEMENTS {
            let value = set(self, k);
            if !self.affordable() {
                break;
            }
            let pilot = self.pilot()?;
            changes.push(difference(&pilots[k - 1].tips, &pilot.tips));
            values.push(value);
            pilots.push(pilot);
            let settled = k >= 2 && errors(&pilots)[k - 2..k].iter().all(|error| *error <= goal);
            if settled || stagnates(&changes) {
                break;
            }
        }
        Ok(Sequence::of(values, &pilots, goal))
    }

    fn put(&mut self, steps: &Sequence, step: usize, meshes: &Sequence, mesh: usize) {
        self.step = steps.values[step];
        self.mesh = self.mesh.map(|_| meshes.values[mesh]);
    }

    /// The pair of least work among those that meet the accuracy by one run with the finest of both.
    fn cheapest(&mut self, steps: &Sequence, meshes: &Sequence) -> Result<Choice, RunError> {
        let both = |i: usize, j: usize| steps.errors[i].hypot(meshes.errors[j]);
        let (step, mesh) = (steps.settled, meshes.settled);
        let settled = Choice { step, mesh, error: both(step, mesh), judge: None };
        let places = |sequence: &Sequence| 0..sequence.errors.len();
        let all = places(steps).flat_map(|i| places(meshes).map(move |j| (i, j)));
        let mut pairs: Vec<_> = all.filter(|&(i, j)| both(i, j) <= TRIED * self.asked).collect();
        if steps.finest() + meshes.finest() == 0 || pairs.is_empty() {
            return Ok(settled);
        }
        let work_of = |&(i, j): &(usize, usize)| work(&steps.counts[i], &meshes.counts[j]);
        pairs.sort_by(|a, b| work_of(a).total_cmp(&work_of(b)));
        self.put(steps, steps.finest(), meshes, meshes.finest());
        let judge = Judge { finest: self.pilot()?, tail: steps.tail.hypot(meshes.tail) };
        for (step, mesh) in pairs.into_iter().take(MOST_TRIALS) {
            self.put(steps, step, meshes, mesh);
            let error = judge.error(&self.pilot()?);
            if error <= TAKEN * self.asked {
                return Ok(Choice { step, mesh, error, judge: Some(judge) });
            }
        }
        Ok(settled)
    }

    /// Puts a matrix that moves on the coarsest mesh of its own with which the accuracy is met; returns the error then, if there is one.
    fn coarser_matrix(&mut self, judge: &Judge) -> Result<Option<f64>, RunError> {
        let free = self.scene.blocks.contains_key("matrix") && !given(self.scene, "/matrix/mesh_size");
        let (true, true, Some(size)) = (free, judge.finest.counts.moves, self.mesh) else { return Ok(None) };
        let coarsest = self.mesh_size(0);
        for coarser in COARSER_FOR_MATRIX.map(|times| times * size).into_iter().filter(|size| *size <= coarsest) {
            self.matrix_mesh = Some(coarser);
            // A mesh on which there is no equilibrium is none to take.
            let error = self.pilot().map_or(f64::INFINITY, |pilot| judge.error(&pilot));
            if error <= TAKEN * self.asked {
                return Ok(Some(error));
            }
        }
        self.matrix_mesh = None;
        Ok(None)
    }

    fn pilot(&mut self) -> Result<Pilot, RunError> {
        self.pilots += 1;
        let without = chaotic(self.scene);
        let mut set = self.keys();
        set.extend(few_axons(self.scene, PILOT_AXONS));
        let mut simulation = self.laboratory.assemble(&self.laboratory.load(&without, &set)?)?;
        run_until(&mut simulation, self.scene.scene.time.duration.0)?;
        let world = simulation.world();
        let tips = cones(&simulation);
        let (counters, vertices) = (world.resource::<Counters>(), world.resource::<Tissue>().mesh.vertex_count());
        let counts = Counts {
            cone_steps: counters.cone_steps as f64,
            stages: counters.stages as f64,
            vertices: vertices as f64,
            passes: (1 + counters.cue_factorisations + 2 * counters.newton_iterations) as f64,
            moves: world.resource::<Configuration>().moves,
        };
        Ok(Pilot { tips, counts })
    }
}

/// Root mean square of the distance between tips over the length of their paths; tips that have no path are left out.
pub(super) fn difference(coarse: &[ConeView], fine: &[ConeView]) -> f64 {
    let grown = coarse.iter().zip(fine).filter(|(_, fine)| fine.length > 0.0);
    root_mean_square(grown.map(|(coarse, fine)| (coarse.position - fine.position).norm() / fine.length))
}
