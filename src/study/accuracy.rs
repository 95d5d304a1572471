//! `"accuracy": ε` in place of mesh size, step and load levels: the program finds them by pilot runs.
//!
//! The error asked for is the root mean square, over growth cones, of the tip's displacement over the length of its path, for the
//! scene without contact and noise (with them paths are chaotic). Pilots run a few dozen of the axons to the end of the run.
//! A step Δt is judged by what half of it changes, a mesh size h by what h/√2 changes:
//!
//! ```text
//! e(Δt) = |x(Δt) − x(Δt/2)| / (1 − 2^−1),      e(h) = |x(h) − x(h/√2)| / (1 − 2^−1)
//! ```
//!
//! which is the error itself where methods are of order 1 in Δt (kinks of linear fields, borders) and 2 in h, and more than the
//! error where they are better. The largest Δt and h are taken with e ≤ 0.35 ε, each at two refinements in a row, so that an
//! agreement by chance does not count. The tolerance of the load path is ε/1000. Keys that the scene gives itself are kept.
//! Ours: all of this.

use super::laboratory::{Laboratory, run_until};
use super::run::{RunError, read};
use crate::model::components::{GrowthCone, Journey, Position};
use crate::model::mechanism::Roster;
use crate::model::plan::Plan;
use crate::model::violation::pointer_token;
use crate::scenario::load::{Loaded, Request};
use bevy_ecs::prelude::With;
use nalgebra::Vector3;
use serde::Serialize;

/// What one part of the error may come to, over the accuracy asked for.
const SHARE: f64 = 0.35;
/// Tolerance of the load path over the accuracy.
const LEVELS: f64 = 1e-3;
/// Axons of a population in a pilot.
const PILOT_AXONS: u64 = 40;
/// The coarsest mesh tried: this share of the tissue's smaller extent.
const COARSEST_MESH: f64 = 1.0 / 12.0;
/// Steps of the coarsest clock tried.
const FEWEST_STEPS: f64 = 64.0;
/// Refinements of each kind at most.
const MOST_REFINEMENTS: usize = 14;
/// A mesh of more vertices than this is not tried.
const MOST_VERTICES: f64 = 4e5;
/// What pilots leave out.
const CHAOTIC: [&str; 2] = ["fasciculation", "heading_noise"];

/// What was found for a scene that states an accuracy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The accuracy asked for.
    pub asked: f64,
    /// Estimated error of the choice, by the step and by the mesh.
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
/// the scene without further search.
///
/// # Errors
/// All problems of the scene; one that cannot be assembled or run.
pub fn settled(request: &Request, roster: &Roster) -> Result<(Request, Loaded), RunError> {
    let mut loaded = read(request, roster)?;
    let mut request = request.clone();
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
/// A scene that cannot be assembled or run.
pub fn find(laboratory: &Laboratory) -> Result<Option<Found>, RunError> {
    let scene = laboratory.scene()?;
    let Some(asked) = scene.scene.accuracy.map(|accuracy| accuracy.0) else { return Ok(None) };
    let mut search = Search { laboratory, scene: &scene, mesh: None, step: 0.0, pilots: 0, asked };
    let step_given = given(&scene, "/time/step");
    let mesh_given = given(&scene, "/tissue/mesh_size");
    search.mesh = if mesh_given { None } else { Some(search.coarsest_mesh()) };
    search.step = if step_given { scene.scene.time.step.0 } else { search.longest_step()? };
    // The step is found on a coarse mesh, whose kinks make steps look worse rather than better.
    let by_step = if step_given { 0.0 } else { search.refine_step()? };
    let by_mesh = if mesh_given { 0.0 } else { search.refine_mesh()? };
    let met = by_step + by_mesh <= asked;
    let mut set = search.keys();
    set.push("/accuracy=null".to_owned());
    Ok(Some(Found { asked, by_step, by_mesh, met, set, pilots: search.pilots }))
}

impl Found {
    /// What the summary says of it.
    pub fn note(&self) -> String {
        let Self { asked, by_step, by_mesh, met, set, pilots } = self;
        let keys: Vec<&str> = set.iter().map(String::as_str).filter(|key| !key.ends_with("=null")).collect();
        let verdict = if *met { "chosen for" } else { "as near as could be afforded to" };
        format!(
            "accuracy {asked}: {} {verdict} it; errors of {by_step:.1e} by the step and {by_mesh:.1e} by the mesh are estimated from \
             {pilots} pilot runs without contact and noise",
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
    /// Step (h).
    step: f64,
    pilots: usize,
    asked: f64,
}

/// Tips with the lengths of their paths.
type Tips = Vec<(Vector3<f64>, f64)>;

impl Search<'_> {
    fn keys(&self) -> Vec<String> {
        let mut keys = vec![format!("/time/step={:e}", self.step)];
        keys.extend(self.mesh.map(|size| format!("/tissue/mesh_size={size:e}")));
        if self.scene.blocks.contains_key("matrix") && !given(self.scene, "/matrix/tolerance") {
            keys.push(format!("/matrix/tolerance={:e}", (LEVELS * self.asked).clamp(1e-9, 1e-3)));
        }
        keys
    }

    fn extent(&self) -> [f64; 2] {
        let points = self.scene.scene.tissue.outline.outer().coordinates();
        [0, 1].map(|k| {
            let ends = points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |e, p| [e[0].min(p[k]), e[1].max(p[k])]);
            ends[1] - ends[0]
        })
    }

    fn coarsest_mesh(&self) -> f64 {
        let [width, height] = self.extent();
        COARSEST_MESH * width.min(height)
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

    fn refine_step(&mut self) -> Result<f64, RunError> {
        let start = self.step;
        let (place, error) = self.refine(|search, k| search.step = start * 0.5f64.powi(k as i32), usize::MAX)?;
        self.step = start * 0.5f64.powi(place as i32);
        Ok(error)
    }

    fn refine_mesh(&mut self) -> Result<f64, RunError> {
        let (start, [width, height]) = (self.coarsest_mesh(), self.extent());
        let finest = (1.155 * width * height / MOST_VERTICES).sqrt();
        let most = (2.0 * (start / finest).log2()).floor().max(1.0) as usize;
        let size = |k: usize| start * 0.5f64.powf(0.5 * k as f64);
        let (place, error) = self.refine(|search, k| search.mesh = Some(size(k)), most)?;
        self.mesh = Some(size(place));
        Ok(error)
    }

    /// Refines until two estimates in a row are small; returns the place of the first of them, and the estimate there.
    fn refine(&mut self, mut set: impl FnMut(&mut Self, usize), most: usize) -> Result<(usize, f64), RunError> {
        let goal = SHARE * self.asked;
        set(self, 0);
        let mut last = self.pilot()?;
        let mut estimates: Vec<f64> = Vec::new();
        for k in 0..most.min(MOST_REFINEMENTS) {
            set(self, k + 1);
            let finer = self.pilot()?;
            estimates.push(2.0 * difference(&last, &finer));
            last = finer;
            if k > 0 && estimates[k - 1] <= goal && estimates[k] <= goal {
                return Ok((k - 1, estimates[k - 1]));
            }
        }
        let place = estimates.len().saturating_sub(1);
        Ok((place, estimates.last().copied().unwrap_or(0.0)))
    }

    fn pilot(&mut self) -> Result<Tips, RunError> {
        self.pilots += 1;
        let without: Vec<&str> = CHAOTIC.into_iter().filter(|name| self.scene.blocks.contains_key(*name)).collect();
        let mut set = self.keys();
        for (name, _) in self.scene.scene.populations.iter().filter(|(_, population)| population.count > PILOT_AXONS) {
            set.push(format!("/populations{}/count={PILOT_AXONS}", pointer_token(name)));
        }
        let mut simulation = self.laboratory.assemble(&self.laboratory.load(&without, &set)?)?;
        run_until(&mut simulation, self.scene.scene.time.duration.0)?;
        let world = simulation.world();
        let query = world.try_query_filtered::<(&Position, &Journey), With<GrowthCone>>();
        let tip = |(position, journey): (&Position, &Journey)| (position.0, journey.length);
        Ok(query.map(|mut query| query.iter(world).map(tip).collect()).unwrap_or_default())
    }
}

/// Root mean square of the distance between tips over the length of their paths; tips that have no path are left out.
fn difference(coarse: &Tips, fine: &Tips) -> f64 {
    let grown = coarse.iter().zip(fine).filter(|(_, fine)| fine.1 > 0.0);
    super::laboratory::root_mean_square(grown.map(|(coarse, fine)| (coarse.0 - fine.0).norm() / fine.1))
}
