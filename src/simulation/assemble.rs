//! From a scenario to a world.

use super::{Simulation, populate};
use crate::model::adaptive::AdaptiveSteps;
use crate::model::births::give_birth;
use crate::model::carry::{carry, spin_headings};
use crate::model::clock::{Clock, Kinks, StageTime, TimeGrid};
use crate::model::configuration::Configuration;
use crate::model::growth::{Growth, Method, OnBorder, Population, Populations, Targets};
use crate::model::health::{Counters, Health};
use crate::model::integrator::{advance, bring_tissue_to};
use crate::model::mechanism::{Facts, InstallError, Installable, ModelBuilder, Roster};
use crate::model::observables::Observables;
use crate::model::plan::{Each, Plan};
use crate::model::remodel::Unrest;
use crate::model::schedule::{MotionSchedule, Phase, RightHandSide, Schedules, Term};
use crate::model::settle::settle;
use crate::model::shafts::Shafts;
use crate::model::shape::Shape;
use crate::model::shelf::Shelf;
use crate::model::stopwatch::Stopwatch;
use crate::model::tissue::Tissue;
use crate::model::violation::Violation;
use crate::numerics::mesh_grading::{Grading, LEAST_CORNER, MOST_LEVELS};
use crate::numerics::planar_domain::{PlanarDomain, Ring};
use crate::numerics::triangulate::{MeshOptions, TriangulationError};
use crate::numerics::turning::derived;
use crate::scenario::load::{Loaded, facts};
use crate::scenario::scene::{self, Scene};
use bevy_ecs::prelude::{IntoScheduleConfigs, World};
use std::collections::BTreeSet;

/// Why a scene could not be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AssemblyError {
    /// The scenario is at fault, at these places.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Scenario(Vec<Violation>),
    /// Something could not be solved.
    #[error("{0}")]
    Solve(String),
    /// What is solved before the first step takes more memory than there is.
    #[error("{0}")]
    NoRoom(String),
}

impl AssemblyError {
    fn at(pointer: &str, message: impl Into<String>) -> Self {
        Self::Scenario(vec![Violation::new(pointer, message)])
    }
}

/// A mechanism read from its block, with its place in the roster.
struct Chosen {
    slot: u32,
    name: &'static str,
    law: Box<dyn Installable>,
}

pub(super) fn assemble(loaded: &Loaded, roster: &Roster, shelf: &Shelf) -> Result<Simulation, AssemblyError> {
    let scene = &loaded.scene;
    let chosen = read_blocks(loaded, roster)?;
    let mut world = World::new();
    world.init_resource::<Stopwatch>();
    world.init_resource::<Counters>();
    world.init_resource::<Health>();
    world.init_resource::<Observables>();
    world.insert_resource(Plan { room: loaded.room, ..Plan::default() });
    world.insert_resource(shelf.clone());
    world.insert_resource(roster.materials().clone());
    world.insert_resource(clock(scene)?);
    world.insert_resource(StageTime(0.0));
    world.insert_resource(growth(scene));
    if scene.time.method == scene::Method::BogackiShampine {
        world.insert_resource(AdaptiveSteps::new(scene.time.tolerance().0, scene.time.duration.0));
    }
    insert_tissue(&mut world, loaded, &chosen)?;
    world.resource_mut::<Stopwatch>().lap("mesh");
    world.init_resource::<Unrest>();
    let spares = chosen.iter().map(|chosen| chosen.law.spare_cones()).sum();
    let cones = populate::spawn_cones(&mut world, scene, spares)?;
    world.resource_mut::<Configuration>().is_looked_at_about_cones(cones.len());
    let mut schedules = Schedules::new();
    install(&mut world, &mut schedules, chosen, scene.seed, &cones)?;
    stop_at_first_kink(&mut world);
    world.remove_resource::<Shelf>();
    add_core_systems(&world, &mut schedules);
    plan(&mut world, loaded, roster);
    schedules.initialize(&mut world).map_err(AssemblyError::Solve)?;
    let Schedules { motion: schedule, cells_may_turn_over, .. } = schedules;
    world.insert_resource(MotionSchedule { schedule, cells_may_turn_over });
    world.insert_resource(RightHandSide(schedules.right_hand_side));
    bring_tissue_to(&mut world, 0.0);
    loaded.remarks.iter().for_each(|remark| world.resource_mut::<Health>().note(remark.clone()));
    world.resource_mut::<Stopwatch>().lap("assembly");
    Ok(Simulation { world, step: schedules.step })
}

/// Reads the blocks in the roster's order and lets each check itself against the scene.
fn read_blocks(loaded: &Loaded, roster: &Roster) -> Result<Vec<Chosen>, AssemblyError> {
    let facts =
        Facts { materials: roster.materials().clone(), ..facts(&loaded.scene, &loaded.merged, &BTreeSet::new()) };
    let mut chosen = Vec::new();
    let mut wrong = Vec::new();
    for (slot, entry) in roster.entries.iter().enumerate() {
        let Some(block) = loaded.blocks.get(entry.name) else { continue };
        let at = format!("/{}", entry.name);
        match (entry.read)(block) {
            Ok(law) => {
                wrong.extend(law.check(&facts).into_iter().map(|violation| violation.under(&at)));
                chosen.push(Chosen { slot: slot as u32, name: entry.name, law });
            }
            Err(message) => wrong.push(Violation::new(at, message)),
        }
    }
    if wrong.is_empty() { Ok(chosen) } else { Err(AssemblyError::Scenario(wrong)) }
}

fn clock(scene: &Scene) -> Result<Clock, AssemblyError> {
    let grid = TimeGrid::new(scene.time.step.0)
        .ok_or_else(|| AssemblyError::at("/time/step", "a step lies between 2e-6 s and 100 years"))?;
    Ok(Clock::new(grid, grid.nearest(scene.time.duration.0)))
}

/// Lets adaptive steps end at the kinks that the mechanisms have told.
fn stop_at_first_kink(world: &mut World) {
    if world.contains_resource::<AdaptiveSteps>() {
        let first = world.get_resource::<Kinks>().map_or(u64::MAX, |kinks| kinks.after(0));
        world.resource_mut::<Clock>().stop = first;
    }
}

fn growth(scene: &Scene) -> Growth {
    let keys = &scene.growth;
    Growth {
        turning_rate: keys.turning_rate.0,
        filopodium_length: keys.filopodium_length.0,
        filopodia_time: keys.filopodia_time.0,
        heading_spins: keys.heading_follows == scene::HeadingFollows::Spin,
        on_border: match keys.on_border {
            scene::OnBorder::Slide => OnBorder::Slide,
            scene::OnBorder::Stall => OnBorder::Stall,
            scene::OnBorder::Leave => OnBorder::Leave,
        },
        method: match scene.time.method {
            scene::Method::Rotation => Method::Rotation,
            scene::Method::Euler => Method::Euler,
            scene::Method::Heun => Method::Heun,
            scene::Method::Rk4 => Method::Rk4,
            scene::Method::BogackiShampine => Method::BogackiShampine,
        },
        planar: scene.space == scene::Space::Planar,
    }
}

/// Meshes the tissue, fitted to the targets and to every outline that a mechanism names.
fn insert_tissue(world: &mut World, loaded: &Loaded, chosen: &[Chosen]) -> Result<(), AssemblyError> {
    let scene = &loaded.scene;
    let mut named: Vec<(String, String, Shape)> = Vec::new();
    for (name, shape) in &scene.targets {
        named.push((format!("/targets/{name}"), format!("targets/{name}"), shape.clone()));
    }
    for Chosen { law, .. } in chosen {
        named.extend(law.outlines().into_iter().map(|(name, shape)| (format!("/{name}"), name, shape)));
    }
    let mut inputs = format!("{:?} {named:?}", scene.tissue);
    if scene.tissue.refinement.is_some() {
        // What estimates errors on the mesh decides it too: the laws whose outlines it is fitted to.
        let outlined = chosen.iter().filter(|chosen| !chosen.law.outlines().is_empty());
        outlined.for_each(|chosen| inputs += &format!(" {:?}", loaded.blocks.get(chosen.name)));
    }
    let shelf = world.resource::<Shelf>().clone();
    let meshing = Meshing { scene, named, chosen, inputs: &inputs };
    let (tissue, _) = shelf.take(&inputs, || meshing.tissue())?;
    let mut inside = vec![false; tissue.mesh.cell_count()];
    for name in scene.targets.keys() {
        let cells = tissue.regions.get(&format!("targets/{name}"));
        cells.into_iter().flatten().for_each(|&cell| inside[cell as usize] = true);
    }
    let any = inside.iter().any(|&is| is);
    world.insert_resource(Targets { cells: if any { inside.into() } else { [].into() } });
    world.insert_resource(Configuration::at_rest(&tissue.mesh));
    world.insert_resource(Tissue::clone(&tissue));
    Ok(())
}

/// By how much more vertices than there may be must be expected for a mesh not to be begun: errors may fall faster than the length of edges.
const OVERESTIMATE: f64 = 4.0;

/// How the tissue of a scene is meshed.
struct Meshing<'a> {
    scene: &'a Scene,
    /// Pointer, name and shape of each outline.
    named: Vec<(String, String, Shape)>,
    chosen: &'a [Chosen],
    inputs: &'a str,
}

impl Meshing<'_> {
    /// The tissue with a mesh fitted to the outlines, refined where the mechanisms' errors ask for it.
    fn tissue(&self) -> Result<Tissue, AssemblyError> {
        let keys = &self.scene.tissue;
        let mut grading = Grading::even(keys.mesh_size.0);
        if let Some(radius) = keys.corner_radius {
            let corners = domain(&keys.outline).reentrant_corners(LEAST_CORNER);
            corners.iter().for_each(|corner| grading.toward_corner(corner, radius.0));
        }
        let mut tissue = self.fitted(&grading)?;
        let Some(refinement) = &keys.refinement else { return Ok(tissue) };
        let most = refinement.levels.min(u64::from(MOST_LEVELS)) as u8;
        // Each round goes one level deeper; as many again mend what new cells show.
        for _ in 0..2 * most {
            let mut any = false;
            for Chosen { name, law, .. } in self.chosen {
                let errors = law.mesh_errors(&tissue).map_err(|error| refused(name, error))?;
                let expected = grading.vertices_to_come(&tissue.mesh, &errors, refinement.tolerance.0, most);
                if expected > OVERESTIMATE * keys.max_vertices as f64 {
                    let (tolerance, most) = (refinement.tolerance, keys.max_vertices);
                    let words = format!(
                        "errors within {tolerance} would need about {expected:.1e} vertices; max_vertices is {most}"
                    );
                    return Err(AssemblyError::at("/tissue/refinement/tolerance", words));
                }
                any |= grading.refine(&tissue.mesh, &errors, refinement.tolerance.0, most);
            }
            if !any {
                break;
            }
            tissue = self.fitted(&grading)?;
        }
        Ok(tissue)
    }

    fn fitted(&self, grading: &Grading) -> Result<Tissue, AssemblyError> {
        let keys = &self.scene.tissue;
        let domain = domain(&keys.outline);
        let options = MeshOptions {
            size: keys.mesh_size.0,
            min_angle: keys.min_angle.radians(),
            max_vertices: keys.max_vertices as usize,
        };
        let shapes = self.named.iter().map(|(_, name, shape)| (name.as_str(), shape));
        let at_shape = |shape: usize, account| AssemblyError::at(&self.named[shape].0, account);
        Tissue::meshed(domain, shapes, (options, grading), self.inputs).map_err(|error| match error {
            TriangulationError::OutlineOutside { outline, point } => {
                at_shape(outline, format!("lies outside the tissue at ({:.4}, {:.4}) um", point[0], point[1]))
            }
            TriangulationError::Outline { outline, error } => at_shape(outline, error.to_string()),
            TriangulationError::Narrow { outline: Some(outline), .. } => at_shape(outline, error.to_string()),
            TriangulationError::Narrow { outline: None, .. } => AssemblyError::at("/tissue/outline", error.to_string()),
            TriangulationError::NotFitted { outline, area, wanted } => at_shape(
                outline,
                format!("is too small or too thin for this tissue: cells cover {area:e} um^2 of its {wanted:e} um^2"),
            ),
            TriangulationError::TooManyVertices { .. } if grading.finest() > 0 && keys.refinement.is_some() => {
                AssemblyError::at("/tissue/refinement/tolerance", format!("{error}; a larger tolerance asks for fewer"))
            }
            other => AssemblyError::at("/tissue", other.to_string()),
        })
    }
}

fn domain(outline: &scene::Outline) -> PlanarDomain {
    let names = outline.edge_names();
    let ring = |ring: &scene::Ring| {
        let index = |name: &String| names.iter().position(|other| other == name).unwrap_or_default() as u16;
        Ring { points: ring.coordinates(), edges: ring.edges.iter().map(index).collect() }
    };
    let holes = outline.holes().iter().map(ring).collect();
    PlanarDomain { vertices: outline.vertices(), ..PlanarDomain::new(ring(&outline.outer()), holes, names.clone()) }
}

fn install(
    world: &mut World,
    schedules: &mut Schedules,
    chosen: Vec<Chosen>,
    seed: u64,
    cones: &[bevy_ecs::entity::Entity],
) -> Result<(), AssemblyError> {
    let mut builder = ModelBuilder::new(world, schedules, seed);
    for Chosen { slot, name, law } in chosen {
        builder.turn_to(slot, name);
        law.install(&mut builder).map_err(|error| refused(name, error))?;
        builder.world.resource_mut::<Stopwatch>().lap(name);
    }
    let (finishers, attachers) = (builder.finishers, builder.attachers);
    for attach in attachers {
        attach(world, cones);
    }
    for (name, finish) in finishers {
        finish(world).map_err(|error| refused(name, error))?;
        world.resource_mut::<Stopwatch>().lap(name);
    }
    Ok(())
}

fn refused(name: &str, error: InstallError) -> AssemblyError {
    match error {
        InstallError::Scenario(violation) => AssemblyError::Scenario(vec![violation.under(&format!("/{name}"))]),
        InstallError::Solve(account) => AssemblyError::Solve(account),
        InstallError::NoRoom(account) => AssemblyError::NoRoom(account),
    }
}

/// What the core itself knows of the scene's needs and limits; passed limits become notes.
fn plan(world: &mut World, loaded: &Loaded, roster: &Roster) {
    let (growth, clock) = (*world.resource::<Growth>(), *world.resource::<Clock>());
    let step = clock.grid.hours(clock.grid.step_ticks());
    let populations = world.resource::<Populations>().0.clone();
    let tolerance = world.get_resource::<AdaptiveSteps>().map(|steps| steps.tolerance);
    let [low, high] = world.resource::<Tissue>().domain.bounding_box();
    let extent = (high[0] - low[0]).min(high[1] - low[1]);
    let tissue = world.resource::<Tissue>();
    let configuration = 2 * size_of_val(tissue.mesh.vertices());
    let cones = world.resource::<Shafts>().count();
    let mesh = (tissue.mesh.bytes() + configuration) as f64;
    let mut plan = world.resource_mut::<Plan>();
    plan.hold("mesh", mesh, Each::Run);
    plan.hold("axons", cones as f64 * (populate::BYTES_A_CONE + Shafts::BYTES_A_HEAD) as f64, Each::Run);
    plan.hold("shafts", Shafts::bytes_a_begun_shaft(), Each::Axon);
    plan.hold("shafts", Shafts::bytes_a_vertex(), Each::ShaftVertex);
    for entry in roster.entries.iter().filter(|entry| !loaded.blocks.contains_key(entry.name)) {
        plan.leave_out(entry.name, "the scene has no such block");
    }
    if let Some(tolerance) = tolerance {
        plan.keep(
            "adaptive steps",
            format!(
                "each cone takes its own, with an error within {tolerance} um; numbers of steps are those at the largest"
            ),
        );
    }
    for Population { name, speed, .. } in populations {
        let found = derived(growth.turning_rate, growth.filopodium_length, speed, growth.filopodia_time);
        let ratio = found.omega_filopodia_time;
        plan.compare(format!("population `{name}`: omega dt, for which eq. (1) is derived"), ratio, 0.3, "shorter dt");
        let advice = "a shorter step";
        plan.compare(
            format!("population `{name}`: step length over the tissue's smaller extent"),
            speed * step / extent,
            0.1,
            advice,
        );
    }
    if let Some(limit) = growth.method.stability_limit() {
        let value = growth.turning_rate * step * plan.strongest_pull;
        plan.compare("kappa times step times the strongest pull", value, limit, "a shorter step, or `rotation`");
    }
    let passed: Vec<String> =
        plan.margins.iter().filter(|margin| margin.is_passed()).map(ToString::to_string).collect();
    let mut health = world.resource_mut::<Health>();
    passed.into_iter().for_each(|note| health.note(note));
}

fn add_core_systems(world: &World, schedules: &mut Schedules) {
    schedules.step.add_systems((
        give_birth.in_set(Phase::Birth),
        advance.in_set(Phase::Advance),
        settle.in_set(Phase::Settle),
    ));
    if world.resource::<Configuration>().moves {
        schedules.right_hand_side.add_systems(carry.in_set(Term::Carry));
        if world.resource::<Growth>().heading_spins {
            schedules.right_hand_side.add_systems(spin_headings.in_set(Term::Carry).after(carry));
        }
    }
}
