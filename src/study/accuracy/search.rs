//! The search for the cheapest step and mesh sizes.

use super::pairs::{Judge, Pair};
use super::sequence::{Cost, Pilot, Sequence, errors};
use super::{Found, given};
use crate::model::configuration::Configuration;
use crate::model::plan::Plan;
use crate::model::tissue::Tissue;
use crate::numerics::mesh_grading::LEAST_CORNER;
use crate::numerics::polygon::bounding_box;
use crate::scenario::load::Loaded;
use crate::study::estimate::seconds::Rates;
use crate::study::laboratory::{Laboratory, chaotic, cones, few_axons, run_until};
use crate::study::run::RunError;

/// What one part of the error may come to where its sequence ends, over the accuracy asked for.
const SHARE: f64 = 0.4;
/// What one run with a pair may show for it to be taken: less where pilots have not all axons.
const TAKEN: f64 = 1.0;
const TAKEN_OF_SOME: f64 = 0.9;
/// By how much a mesh of the matrix' own may move tips, over the accuracy asked for.
const BY_MATRIX: f64 = 0.1;
/// What the pairs tried may take together, over one run with the dearest of them.
const TRIALS: f64 = 16.0;
/// Tolerance of the load path over the accuracy.
const LEVELS: f64 = 1e-3;
/// Axons of a population in a pilot.
const PILOT_AXONS: u64 = 200;
/// The mesh with which refinement begins: this share of the tissue's smaller extent.
const COARSEST_MESH: f64 = 1.0 / 6.0;
/// Place in the sequence of meshes of the one on which steps are judged.
const MESH_FOR_STEPS: i32 = 2;
/// Steps of the clock with which refinement begins.
const FEWEST_STEPS: f64 = 16.0;
/// How far a mesh is graded toward re-entrant corners, as a share of the tissue's smaller extent.
const CORNER_RADIUS: f64 = 0.25;
/// Places before those, coarser ones, that may be chosen.
const COARSER_MESHES: i32 = 3;
const COARSER_STEPS: i32 = 2;
/// Refinements of each kind at most.
const MOST_REFINEMENTS: i32 = 14;
/// A mesh of more vertices than this is not tried.
const MOST_VERTICES: f64 = 4e5;
/// Nothing is refined beyond a pilot that takes this time (ns, as the plan reckons).
const MOST_TIME: f64 = 1e10;
/// A mesh of the matrix' own of more vertices than this is not tried.
const MOST_MATRIX_VERTICES: f64 = 5e4;

/// Vertices to be expected of a mesh of so many µm² with edges of so many µm.
fn vertices(area: f64, size: f64) -> f64 {
    1.155 * area / (size * size)
}

pub struct Search<'a> {
    laboratory: &'a Laboratory<'a>,
    scene: &'a Loaded,
    /// Mesh size (µm); none where the scene's own is kept.
    mesh: Option<f64>,
    /// Mesh size of the matrix (µm); none where it is that of the tissue, or the scene's own.
    matrix_mesh: Option<f64>,
    /// Radius of grading toward re-entrant corners (µm), where there are such and the mesh is chosen.
    corner_radius: Option<f64>,
    /// Step (h).
    step: f64,
    pilots: usize,
    asked: f64,
}

/// The whole scene, contact and noise included.
struct Whole {
    /// The longest step that passes no limit of its plan (h).
    longest_step: f64,
    /// What a cone takes at a stage (ns).
    cone: f64,
    /// Share of its axons that pilots have.
    share: f64,
    /// Whether the tissue has re-entrant corners.
    has_corners: bool,
}

impl<'a> Search<'a> {
    pub fn new(laboratory: &'a Laboratory<'a>, scene: &'a Loaded, asked: f64) -> Self {
        let step = scene.scene.time.step.0;
        Self { laboratory, scene, mesh: None, matrix_mesh: None, corner_radius: None, step, pilots: 0, asked }
    }

    /// Searches for what is not given of step and mesh size.
    ///
    /// # Errors
    /// A scene that cannot be assembled or run.
    pub fn found(mut self, (step_given, mesh_given): (bool, bool)) -> Result<Found, RunError> {
        self.mesh = (!mesh_given).then(|| self.mesh_size(MESH_FOR_STEPS));
        if !step_given {
            self.step = self.scene.scene.time.duration.0 / FEWEST_STEPS;
        }
        let whole = self.whole()?;
        if whole.has_corners && !mesh_given && !given(self.scene, "/tissue/corner_radius") {
            let [width, height] = self.extent();
            self.corner_radius = Some(CORNER_RADIUS * width.min(height));
        }
        let steps = if step_given { Sequence::fixed(self.step) } else { self.refined_steps(whole.longest_step)? };
        self.step = steps.values[steps.settled];
        let by_matrix = self.settle_matrix()?;
        let meshes = if mesh_given { Sequence::fixed(0.0) } else { self.refined_meshes()? };
        let (step, mesh, estimated) = self.cheapest(&steps, &meshes, (&whole, by_matrix))?;
        let (by_step, by_mesh) = (steps.errors[step], meshes.errors[mesh]);
        let mut set = self.keys();
        set.push("/accuracy=null".to_owned());
        let (asked, met) = (self.asked, estimated <= self.asked);
        Ok(Found { asked, estimated, by_step, by_mesh, met, set, pilots: self.pilots })
    }

    fn keys(&self) -> Vec<String> {
        let mut keys = vec![format!("/time/step={:e}", self.step)];
        keys.extend(self.mesh.map(|size| format!("/tissue/mesh_size={size:e}")));
        keys.extend(self.corner_radius.map(|radius| format!("/tissue/corner_radius={radius:e}")));
        if self.scene.blocks.contains_key("matrix") && !given(self.scene, "/matrix/tolerance") {
            keys.push(format!("/matrix/tolerance={:e}", (LEVELS * self.asked).clamp(1e-9, 1e-3)));
        }
        keys.extend(self.matrix_mesh.map(|size| format!("/matrix/mesh_size={size:e}")));
        keys
    }

    fn extent(&self) -> [f64; 2] {
        let [low, high] = bounding_box(&self.scene.scene.tissue.outline.outer().coordinates());
        [0, 1].map(|k| high[k] - low[k])
    }

    /// Size of a place in the sequence of meshes (µm).
    fn mesh_size(&self, place: i32) -> f64 {
        let [width, height] = self.extent();
        COARSEST_MESH * width.min(height) * 0.5f64.powf(0.5 * f64::from(place))
    }

    fn whole(&self) -> Result<Whole, RunError> {
        let simulation = self.laboratory.assemble(&self.laboratory.load(&[], &self.keys())?)?;
        let world = simulation.world();
        let of_step = world.resource::<Plan>().margins.iter().filter(|margin| margin.advice.contains("step"));
        let worst =
            of_step.filter(|margin| margin.limit > 0.0).map(|margin| margin.value / margin.limit).fold(0.0, f64::max);
        let populations = self.scene.scene.populations.values().map(|population| population.count);
        let (all, few) = populations.fold((0, 0), |(all, few), count| (all + count, few + count.min(PILOT_AXONS)));
        let share = if all > 0 { few as f64 / all as f64 } else { 1.0 };
        let has_corners = !world.resource::<Tissue>().domain.reentrant_corners(LEAST_CORNER).is_empty();
        Ok(Whole { longest_step: self.step / worst, cone: Rates::of(world).cone_stage, share, has_corners })
    }

    fn refined_steps(&mut self, longest: f64) -> Result<Sequence, RunError> {
        let halvings = (self.step / longest).log2().ceil().max(0.0);
        let start = self.step / 2f64.powf(halvings);
        self.refined(COARSER_STEPS, |search, place| {
            search.step = start * 0.5f64.powi(place);
            (search.step <= longest).then_some(search.step)
        })
    }

    fn refined_meshes(&mut self) -> Result<Sequence, RunError> {
        self.refined(COARSER_MESHES, |search, place| {
            let ([width, height], size) = (search.extent(), search.mesh_size(place));
            search.mesh = Some(size);
            (vertices(width * height, size) <= MOST_VERTICES).then_some(size)
        })
    }

    /// Refines until the errors at two places in a row are small, or no refinement can be afforded; places
    /// below nought are coarser ones, and left out where they cannot be run. `set` puts a place and returns its value,
    /// if it may be had.
    fn refined(
        &mut self,
        coarser: i32,
        mut set: impl FnMut(&mut Self, i32) -> Option<f64>,
    ) -> Result<Sequence, RunError> {
        let goal = SHARE * self.asked;
        let (mut values, mut pilots) = (Vec::new(), Vec::new());
        for place in -coarser..0 {
            if let Some(value) = set(self, place)
                && let Ok(pilot) = self.pilot()
            {
                values.push(value);
                pilots.push(pilot);
            }
        }
        let first = pilots.len();
        for place in 0..=MOST_REFINEMENTS {
            let Some(value) = set(self, place) else { break };
            let pilot = self.pilot()?;
            let is_dear = pilot.time() > MOST_TIME;
            values.push(value);
            pilots.push(pilot);
            let refined = errors(&pilots[first..]);
            let settled =
                refined.len() >= 3 && refined[refined.len() - 3..refined.len() - 1].iter().all(|error| *error <= goal);
            if settled || is_dear {
                break;
            }
        }
        Ok(Sequence::of(values, &pilots, goal))
    }

    fn put(&mut self, (step, mesh): (f64, f64)) {
        self.step = step;
        self.mesh = self.mesh.map(|_| mesh);
    }

    /// Puts the cheapest pair that meets the accuracy by one run with the finest of both, or, if there is none, the pair
    /// where the sequences settled. Returns its places and its error.
    fn cheapest(
        &mut self,
        steps: &Sequence,
        meshes: &Sequence,
        (whole, by_matrix): (&Whole, f64),
    ) -> Result<(usize, usize, f64), RunError> {
        let taken = if whole.share < 1.0 { TAKEN_OF_SOME } else { TAKEN };
        let settled = (steps.settled, meshes.settled);
        let tail = steps.tail.hypot(meshes.tail);
        // A judge that errs by more than was asked finds none good.
        if steps.finest() + meshes.finest() > 0 && tail + by_matrix <= taken * self.asked {
            self.put((steps.values[steps.finest()], meshes.values[meshes.finest()]));
            let judge = Judge { finest: self.pilot()?, tail, by_matrix };
            let pairs = Pair::all(steps, meshes, whole.cone / whole.share);
            let mut left = TRIALS * pairs.iter().map(|pair| pair.time).fold(0.0, f64::max);
            for Pair { values, places, time } in pairs {
                left -= time;
                if left < 0.0 {
                    break;
                }
                self.put(values);
                // A mesh on which there is no equilibrium is none to take.
                let error = self.pilot().map_or(f64::INFINITY, |pilot| judge.error(&pilot));
                if error <= taken * self.asked {
                    return Ok((places.0, places.1, error));
                }
            }
        }
        let (step, mesh) = settled;
        self.put((steps.values[step], meshes.values[mesh]));
        Ok((step, mesh, steps.errors[step].hypot(meshes.errors[mesh]) + by_matrix))
    }

    /// Puts the coarsest mesh of the matrix' own that moves tips by little, judged on a middling mesh of the tissue; none where the scene has
    /// its own, or nothing moves. Returns a bound of its error.
    fn settle_matrix(&mut self) -> Result<f64, RunError> {
        let free = self.scene.blocks.contains_key("matrix") && !given(self.scene, "/matrix/mesh_size");
        if !free || self.mesh.is_none() {
            return Ok(0.0);
        }
        let (goal, [width, height]) = (BY_MATRIX * self.asked, self.extent());
        let (mut sizes, mut pilots): (Vec<f64>, Vec<Pilot>) = (Vec::new(), Vec::new());
        for size in std::iter::successors(Some(self.mesh_size(0)), |size| Some(0.5 * size)) {
            if vertices(width * height, size) > MOST_MATRIX_VERTICES {
                break;
            }
            self.matrix_mesh = Some(size);
            let pilot = self.pilot()?;
            if !pilot.moves {
                self.matrix_mesh = None;
                return Ok(0.0);
            }
            sizes.push(size);
            pilots.push(pilot);
            let errors = errors(&pilots);
            if errors.len() >= 3 && errors[errors.len() - 3..].iter().all(|error| *error <= goal) {
                break;
            }
        }
        let errors = errors(&pilots);
        let chosen = errors.iter().position(|error| *error <= goal).unwrap_or(errors.len().saturating_sub(1));
        self.matrix_mesh = sizes.get(chosen).copied();
        Ok(errors.get(chosen).copied().unwrap_or(0.0))
    }

    fn pilot(&mut self) -> Result<Pilot, RunError> {
        self.pilots += 1;
        let without = chaotic(self.scene);
        let mut set = self.keys();
        set.extend(few_axons(self.scene, PILOT_AXONS));
        let mut simulation = self.laboratory.assemble(&self.laboratory.load(&without, &set)?)?;
        run_until(&mut simulation, self.scene.scene.time.duration.0)?;
        let (tips, world) = (cones(&simulation), simulation.world());
        Ok(Pilot { tips, cost: Cost::of(world), moves: world.resource::<Configuration>().moves })
    }
}
