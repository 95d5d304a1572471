//! What a scene needs before it runs: everything is put together and solved as for a run, but no step is taken.

use super::estimate::{Estimate, Expectation, memory, seconds};
use super::run::{DPI, Records, RunError, assembled, recorder_options};
use crate::model::clock::Clock;
use crate::model::components::GrowthCone;
use crate::model::health::{Counters, Health};
use crate::model::mechanism::Roster;
use crate::model::plan::Plan;
use crate::model::tissue::Tissue;
use crate::record::files;
use crate::record::png::scale_for_dpi;
use crate::record::recorder::Recorder;
use crate::record::scene_figure::PictureSize;
use crate::record::summary::{DerivedConstants, constants};
use crate::scenario::load::Loaded;
use crate::simulation::Simulation;
use bevy_ecs::prelude::World;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// The plan of a scene, with the work that it means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScenePlan {
    /// Name of the scene.
    pub scene: String,
    /// Parts and margins.
    pub plan: Plan,
    /// Derived constants of eq. (1), by population.
    pub derived: BTreeMap<String, DerivedConstants>,
    /// Vertices of the mesh.
    pub mesh_vertices: usize,
    /// Cells of the mesh.
    pub mesh_cells: usize,
    /// Steps of the clock.
    pub steps: u64,
    /// Steps of growing cones if no cone ends before the run does.
    pub cone_steps_at_most: u64,
    /// Points in `trajectories.csv` if every cone is recorded to the end; 0 when none are kept.
    pub trajectory_points_at_most: u64,
    /// What has been solved already.
    pub solved: Counters,
    /// How much is to be expected of what costs something.
    pub expected: Expectation,
    /// Peak of resident memory of a run on one thread (MB).
    pub memory_mb: Estimate,
    /// CPU seconds of a run on one thread of the reference machine, with what the plan itself has solved.
    pub cpu_seconds: Estimate,
    /// Seconds that this machine takes for one of the reference machine's, if that was measured.
    pub pace: Option<f64>,
    /// What the user should know of.
    pub notes: Vec<String>,
}

/// Puts a scene together and says what it needs.
///
/// # Errors
/// A scene that cannot be assembled.
pub fn plan(loaded: &Loaded, roster: &Roster, path: &Path) -> Result<ScenePlan, RunError> {
    let mut simulation = assembled(loaded, roster, path)?;
    let found = plan_of(&simulation, loaded)?;
    simulation.lap("plan");
    Ok(found)
}

/// What a scene needs that has been put together and has not taken a step.
///
/// # Errors
/// A tissue without extent.
pub fn plan_of(simulation: &Simulation, loaded: &Loaded) -> Result<ScenePlan, RunError> {
    let world: &World = simulation.world();
    let clock = *world.resource::<Clock>();
    let lifetimes = lifetimes(world, &clock);
    let (expected, recorder) = expected_of(world, loaded, Records::ALL);
    let mesh = &world.resource::<Tissue>().mesh;
    let figure = figure_of(world, &expected)?;
    let mut plan = world.resource::<Plan>().clone();
    tell_outputs(&mut plan, loaded, &recorder);
    Ok(ScenePlan {
        scene: loaded.scene.name.clone(),
        plan,
        derived: constants(world),
        mesh_vertices: mesh.vertex_count(),
        mesh_cells: mesh.cell_count(),
        steps: clock.end.div_ceil(clock.grid.step_ticks()),
        cone_steps_at_most: lifetimes.iter().map(|ticks| ticks.div_ceil(clock.grid.step_ticks())).sum(),
        trajectory_points_at_most: expected.trajectory_points as u64,
        solved: simulation.counters(),
        memory_mb: memory::estimate(world, &expected, figure.as_ref()),
        cpu_seconds: seconds::estimate(world, &expected, figure.as_ref()),
        pace: None,
        expected,
        notes: world.resource::<Health>().notes().to_vec(),
    })
}

/// The memory (MB) that goes on with, or begins, the run of a scene that has been put together, with what is kept of it.
///
/// # Errors
/// A tissue without extent.
pub fn memory_of(simulation: &Simulation, loaded: &Loaded, keep: Records) -> Result<Estimate, RunError> {
    let world = simulation.world();
    let (expected, _) = expected_of(world, loaded, keep);
    Ok(memory::estimate(world, &expected, figure_of(world, &expected)?.as_ref()))
}

/// How large the figure will be; none if there will be none.
fn figure_of(world: &World, expected: &Expectation) -> Result<Option<PictureSize>, RunError> {
    let [low, high] = world.resource::<Tissue>().domain.bounding_box();
    let size = || PictureSize::of(expected.pictures, [high[0] - low[0], high[1] - low[1]], scale_for_dpi(DPI).into());
    Ok((expected.pictures > 0).then(size).transpose()?)
}

fn expected_of(world: &World, loaded: &Loaded, keep: Records) -> (Expectation, Recorder) {
    let clock = world.resource::<Clock>();
    // Points are met at steps only.
    let interval = clock.grid.nearest(loaded.scene.output.trajectory_interval.0).max(clock.grid.step_ticks());
    let lifetimes = if keep.trajectories { lifetimes(world, clock) } else { Vec::new() };
    let points = lifetimes.iter().map(|ticks| ticks / interval + 1).sum();
    let recorder = Recorder::new(&recorder_options(loaded, keep), &clock.grid, clock.end);
    (Expectation::of(world, &recorder, points), recorder)
}

/// The files that a run writes, and what for.
fn tell_outputs(plan: &mut Plan, loaded: &Loaded, recorder: &Recorder) {
    let output = &loaded.scene.output;
    plan.keep("summary.json", format!("always: measures at {} heights, plan, cost", output.heights.len()));
    plan.keep("manifest.json", "always: what it takes to run the scene again");
    let each = format!("a point of each axon born every {:.3} h", output.trajectory_interval.0);
    match output.tables.are_csv() {
        true => plan.keep("trajectories.csv", format!("always: {each}")),
        false => plan.leave_out("trajectories.csv", "`output/tables` asks for parquet"),
    };
    files::told(output).into_iter().for_each(|(files, when)| plan.keep(files, when));
    let figure = "figure.svg, figure.png";
    match recorder.pictures_due().len() {
        0 => plan.leave_out(figure, "`output/figure_times` names no time"),
        panels => plan.keep(figure, format!("{panels} panels, one for each of `output/figure_times`")),
    }
    let recording = "recording.bin, report.html";
    match recorder.frames_due() {
        0 if output.frames.is_some() => plan.leave_out(recording, "`output/frames` is 0"),
        0 => plan.leave_out(recording, "more than 20 000 axons; `output/frames` asks for it all the same"),
        frames => plan.keep(recording, format!("{frames} frames: `output/frames`, and those of the figure")),
    }
}

/// Ticks from the birth of each cone to the end of the run, of those born before it.
fn lifetimes(world: &World, clock: &Clock) -> Vec<u64> {
    let Some(mut cones) = world.try_query::<&GrowthCone>() else { return Vec::new() };
    cones.iter(world).filter_map(|cone| clock.end.checked_sub(cone.birth)).filter(|ticks| *ticks > 0).collect()
}

impl fmt::Display for ScenePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} vertices, {} cells", self.scene, self.mesh_vertices, self.mesh_cells)?;
        for (title, kept) in [("needs", true), ("does not need", false)] {
            writeln!(f, "{title}")?;
            let mut parts = self.plan.parts.iter().filter(|part| part.kept == kept).peekable();
            if parts.peek().is_none() {
                writeln!(f, "  nothing")?;
            }
            for part in parts {
                writeln!(f, "  {:<28}{}", part.name, part.why)?;
            }
        }
        let Counters { matrix_solves, newton_iterations, cue_solves, cue_factorisations, .. } = self.solved;
        writeln!(f, "work")?;
        writeln!(f, "  {:<28}{matrix_solves} ({newton_iterations} Newton iterations)", "equilibria solved")?;
        writeln!(f, "  {:<28}{cue_solves} ({cue_factorisations} factorisations)", "cue fields solved")?;
        writeln!(f, "  {:<28}{}, at most {} of cones", "steps", self.steps, self.cone_steps_at_most)?;
        writeln!(f, "  {:<28}at most {}", "points of trajectories", self.trajectory_points_at_most)?;
        let time = match self.pace {
            Some(_) => "s of one thread here",
            None => "s of one thread of the reference machine",
        };
        for (name, estimate, unit, scale) in
            [("memory", &self.memory_mb, "MB", 1.0), ("time", &self.cpu_seconds, time, self.pace.unwrap_or(1.0))]
        {
            let largest = estimate.parts.iter().take(3).map(|part| format!("{} {:.2}", part.name, scale * part.amount));
            let largest = largest.collect::<Vec<_>>().join(", ");
            writeln!(f, "  {name:<28}about {:.2} {unit}: {largest}", scale * estimate.total)?;
        }
        writeln!(f, "derived")?;
        for (population, constants) in &self.derived {
            let radius = constants.turning_radius.map_or("infinite".to_owned(), |r| format!("{r:.2} um"));
            writeln!(
                f,
                "  {population}: kappa = {:.3} /h, omega = {:.3} /h, omega dt = {:.3}, turning radius {radius}",
                constants.turning_rate, constants.omega, constants.omega_filopodia_time
            )?;
        }
        self.plan.derived.iter().try_for_each(|derived| writeln!(f, "  {derived}"))?;
        writeln!(f, "margins")?;
        for margin in &self.plan.margins {
            let mark = if margin.is_passed() {
                "  PASSED: "
            } else if margin.is_thin() {
                "  thin: "
            } else {
                ""
            };
            let advice = if mark.is_empty() { "" } else { &margin.advice };
            writeln!(f, "  {}: {:.3} of {:.3}{mark}{advice}", margin.name, margin.value, margin.limit)?;
        }
        Ok(())
    }
}
