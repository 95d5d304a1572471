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
//! not count; or where no refinement can be afforded. Some coarser places stand before those: they may be chosen, but
//! do not count as agreement. A mesh that is chosen is graded toward re-entrant corners, without which it converges
//! slowly (`numerics::mesh_grading`). The matrix of a tissue that moves is
//! put, between the two sequences, on the coarsest mesh of its own that moves tips by no more than 0.1 ε, judged by a third one.
//!
//! Pairs of places, and of a step with a mesh size half-way between two, are then tried in order of what the
//! whole scene would take with them (a step that was bad on the middling mesh may be good on a finer one), and the
//! first is taken whose tips lie within ε of those of one run with the finest of both, whose own error is added as an
//! independent one (and that of the matrix' mesh, common to all, as it is), as long as those tried come to 16 runs with the dearest of them (within 0.9 ε where pilots have not all axons). That time is reckoned from counts, not measured, so
//! that the choice is the same everywhere. The tolerance of the load path is ε/1000. Keys that the scene gives itself
//! are kept. Ours: all of this.

mod pairs;
mod search;
mod sequence;

use super::laboratory::{ConeView, Laboratory, root_mean_square};
use super::run::{RunError, read};
use crate::model::mechanism::Roster;
use crate::model::violation::Violation;
use crate::scenario::load::{Loaded, Request, ScenarioErrors};
use search::Search;
use serde::Serialize;

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
    Search::new(laboratory, &scene, asked).found((step_given, mesh_given)).map(Some)
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

/// Root mean square of the distance between tips over the length of their paths; tips that have no path are left out.
pub(super) fn difference(coarse: &[ConeView], fine: &[ConeView]) -> f64 {
    let grown = coarse.iter().zip(fine).filter(|(_, fine)| fine.length > 0.0);
    root_mean_square(grown.map(|(coarse, fine)| (coarse.position - fine.position).norm() / fine.length))
}
