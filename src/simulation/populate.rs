//! Axons and growth cones: who is born where, when, heading which way.
//!
//! Every draw is keyed by (seed, axon), so that axon i has the same birth whatever else is in the scene. Axons are numbered
//! through the populations in the order of their names; their births are drawn within the population's interval.

use super::assemble::AssemblyError;
use crate::model::births::{BirthQueue, FirstHeading, Origin};
use crate::model::clock::Clock;
use crate::model::components::{
    Axon, GrowthCone, Journey, Position, ReceptorWeights, Site, SpringState, Status, Velocity,
};
use crate::model::growth::{Population, Populations, ShaftPopulations};
use crate::model::integrator::BYTES_A_STEP;
use crate::model::random::{KeyedRng, Stream};
use crate::model::remodel::SpareCones;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use crate::model::violation::Violation;
use crate::numerics::simplex_mesh::BorderFacet;
use crate::scenario::scene::{self, Heading, Scene};
use bevy_ecs::entity::Entity;
use bevy_ecs::prelude::{With, World};
use nalgebra::Vector3;
use rand::RngExt;

/// Stream of the draws at birth.
const BIRTHS: Stream = Stream::named("births");
/// Draw of the birth time.
const WHEN: u64 = 0;
/// Birth of a cone that waits for a branch.
const NEVER: u64 = u64::MAX;
/// Draw of the birth place.
const WHERE: u64 = 1;

/// Largest distance between a stored shaft and the true path (µm). Ours.
const SHAFT_TOLERANCE: f64 = 0.5;
/// Longest stored shaft segment (µm). Ours.
const LONGEST_SEGMENT: f64 = 12.0;

/// What is known of a growth cone, besides what mechanisms attach.
type ConeState = (GrowthCone, Origin, Status, Site, Position, Velocity, SpringState, ReceptorWeights, Journey);

/// Bytes of an axon and its growth cone: their components, and what is kept of the cone during a step.
pub(super) const BYTES_AN_AXON: usize = size_of::<Axon>() + size_of::<ConeState>() + BYTES_A_STEP;

/// Spawns axons and growth cones, with `spares` more cones for each axon after those of all axons; returns the cones in order.
pub(super) fn spawn_cones(world: &mut World, scene: &Scene, spares: u32) -> Result<Vec<Entity>, AssemblyError> {
    let mut cones = Vec::new();
    let mut list = Vec::new();
    let mut of_shaft = Vec::new();
    for (index, (name, keys)) in scene.populations.iter().enumerate() {
        list.push(Population { name: name.clone(), speed: keys.speed.0, count: keys.count as usize });
        let places = Places::new(world.resource::<Tissue>(), name, keys)?;
        for _ in 0..keys.count {
            let number = cones.len() as u32;
            let birth = birth_instant(world, scene, keys, number);
            let origin = places.origin(world.resource::<Tissue>(), scene.seed, number);
            let axon = Axon { number, population: index as u16, birth };
            cones.push(spawn(world, axon, origin, keys.speed.0));
            of_shaft.push(index as u16);
        }
    }
    world.insert_resource(Populations(list));
    let births: Vec<u64> = cones.iter().filter_map(|&cone| world.get::<GrowthCone>(cone)).map(|c| c.birth).collect();
    world.insert_resource(BirthQueue::new(births.into_iter()));
    spawn_spares(world, &mut cones, &mut of_shaft, spares);
    world.insert_resource(ShaftPopulations(of_shaft));
    world.insert_resource(Shafts::new(cones.len(), SHAFT_TOLERANCE, LONGEST_SEGMENT));
    Ok(cones)
}

/// Spawns the cones of branches yet to come: like that of their axon, but born at no time.
fn spawn_spares(world: &mut World, cones: &mut Vec<Entity>, of_shaft: &mut Vec<u16>, each: u32) {
    let axons = cones.len();
    for axon in 0..axons {
        let Some((&own, &origin)) = world.get::<GrowthCone>(cones[axon]).zip(world.get::<Origin>(cones[axon])) else {
            continue;
        };
        for _ in 0..each {
            let number = cones.len() as u32;
            let identity = GrowthCone { axon: number, birth: NEVER, birth_time: 0.0, ..own };
            cones.push(spawn_cone(world, identity, origin));
            of_shaft.push(own.population);
        }
    }
    world.insert_resource(SpareCones::new(axons as u32, each));
}

/// The instants of all births (ticks), ascending.
pub(super) fn births_in_order(world: &mut World) -> Vec<u64> {
    let mut cones = world.query_filtered::<&GrowthCone, With<GrowthCone>>();
    let mut births: Vec<u64> = cones.iter(world).map(|cone| cone.birth).filter(|birth| *birth != NEVER).collect();
    births.sort_unstable();
    births
}

fn spawn(world: &mut World, axon: Axon, origin: Origin, speed: f64) -> Entity {
    world.spawn(axon);
    let birth_time = world.resource::<Clock>().grid.hours(axon.birth);
    let identity = GrowthCone { axon: axon.number, population: axon.population, speed, birth: axon.birth, birth_time };
    spawn_cone(world, identity, origin)
}

fn spawn_cone(world: &mut World, identity: GrowthCone, origin: Origin) -> Entity {
    let state: ConeState = (
        identity,
        origin,
        Status::default(),
        origin.site,
        Position::default(),
        Velocity::default(),
        SpringState::default(),
        ReceptorWeights::default(),
        Journey::default(),
    );
    world.spawn(state).id()
}

fn birth_instant(world: &World, scene: &Scene, keys: &scene::Population, number: u32) -> u64 {
    let [from, to] = keys.birth_interval(scene.time.duration);
    let share: f64 = KeyedRng::new(scene.seed, number, BIRTHS, WHEN).random();
    world.resource::<Clock>().grid.nearest_birth(from.0 + share * (to.0 - from.0))
}

/// Where a population can be born.
enum Places {
    /// Facets of an edge with their lengths added up, and the part of the whole in use.
    Edge { facets: Vec<(BorderFacet, f64)>, from: f64, to: f64, heading: Option<Vector3<f64>> },
    /// Given points, and the heading.
    Points { sites: Vec<Site>, heading: Vector3<f64> },
}

impl Places {
    fn new(tissue: &Tissue, name: &str, keys: &scene::Population) -> Result<Self, AssemblyError> {
        let at = |key: &str, message: String| {
            AssemblyError::Scenario(vec![Violation::new(format!("/populations/{name}/{key}"), message)])
        };
        let heading = match keys.heading {
            Heading::Along(_) => None,
            Heading::Angle(angle) => Some(Vector3::new(angle.radians().cos(), angle.radians().sin(), 0.0)),
        };
        match &keys.origin {
            scene::Origin::Edge(edge) => {
                let part = edge.part();
                let index = tissue
                    .edge(&part.name)
                    .ok_or_else(|| at("origin", format!("there is no edge called `{}`", part.name)))?;
                let mut sum = 0.0;
                let facets: Vec<_> = tissue.edges[index]
                    .iter()
                    .map(|facet| {
                        sum += length(tissue, *facet);
                        (*facet, sum)
                    })
                    .collect();
                Ok(Self::Edge { facets, from: part.from.0 * sum, to: part.to.0 * sum, heading })
            }
            scene::Origin::Points(points) => {
                let locate = |point: &[crate::model::quantity::Length; 2]| {
                    tissue.locate([point[0].0, point[1].0]).ok_or_else(|| {
                        at("origin/points", format!("({}, {}) lies outside the tissue", point[0], point[1]))
                    })
                };
                let sites = points.iter().map(locate).collect::<Result<Vec<_>, _>>()?;
                let heading = heading.ok_or_else(|| {
                    at("heading", "axons born at points need an angle: a point has no inner normal".into())
                })?;
                Ok(Self::Points { sites, heading })
            }
        }
    }

    fn origin(&self, tissue: &Tissue, seed: u64, number: u32) -> Origin {
        match self {
            Self::Points { sites, heading } => {
                Origin { site: sites[number as usize % sites.len()], heading: FirstHeading::Fixed(*heading) }
            }
            Self::Edge { facets, from, to, heading } => {
                let share: f64 = KeyedRng::new(seed, number, BIRTHS, WHERE).random();
                let along = from + share * (to - from);
                let place = facets.partition_point(|(_, sum)| *sum <= along).min(facets.len() - 1);
                let (facet, sum) = facets[place];
                let rest = ((sum - along) / length(tissue, facet)).clamp(0.0, 1.0);
                let heading = heading.map_or(FirstHeading::InnerNormal(facet), FirstHeading::Fixed);
                Origin { site: on_facet(facet, rest), heading }
            }
        }
    }
}

/// The site on a facet whose first vertex has weight `first` and whose last has the rest.
fn on_facet(facet: BorderFacet, first: f64) -> Site {
    let face = facet.face as usize;
    let mut all = [0.0; 3];
    all[(face + 1) % 3] = first;
    all[(face + 2) % 3] = 1.0 - first;
    Site { cell: facet.cell, weights: [all[1], all[2], 0.0] }
}

fn length(tissue: &Tissue, facet: BorderFacet) -> f64 {
    let ends: Vec<_> = tissue.mesh.facet_vertices(facet).map(|v| tissue.mesh.vertices()[v as usize]).collect();
    (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1])
}
