//! Axons and growth cones: who is born where, when, heading which way.
//!
//! Every draw is keyed by (seed, axon), so that axon i has the same birth whatever else is in the scene. Axons are numbered
//! through the populations in the order of their names; their births are drawn within the population's interval.

use super::assemble::AssemblyError;
use crate::model::births::{Birth, BirthQueue};
use crate::model::clock::Clock;
use crate::model::components::{
    GrowthCone, Journey, Position, ReceptorWeights, Site, Spring, SpringState, Status, Velocity,
};
use crate::model::growth::{Population, Populations, ShaftPopulations};
use crate::model::integrator::BYTES_A_STEP;
use crate::model::random::{KeyedRng, Stream};
use crate::model::remodel::SpareCones;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use crate::model::violation::Violation;
use crate::numerics::simplex_mesh::BorderFacet;
use crate::scenario::scene::{self, Direction, Heading, Scene};
use bevy_ecs::entity::Entity;
use bevy_ecs::prelude::World;
use nalgebra::Vector3;
use rand::RngExt;
use std::f64::consts::TAU;

/// Stream of the draws at birth.
const BIRTHS: Stream = Stream::named("births");
/// Draw of the birth time.
const WHEN: u64 = 0;
/// Draw of the birth place.
const WHERE: u64 = 1;
/// Draw of the first heading.
const WHITHER: u64 = 2;

/// Largest distance between a stored shaft and the true path (µm). Ours.
const SHAFT_TOLERANCE: f64 = 0.5;
/// Longest stored shaft segment (µm). Ours.
const LONGEST_SEGMENT: f64 = 12.0;

/// What is known of a growth cone, besides what mechanisms attach.
type ConeState = (GrowthCone, Status, Site, Position, Velocity, SpringState, ReceptorWeights, Journey);

/// Components of a growth cone, and bytes that the ECS keeps for each (two ticks) and for an entity. Of bevy_ecs 0.20.
const COMPONENTS: usize = 8;
const BYTES_A_COMPONENT: usize = 8;
const BYTES_AN_ENTITY: usize = 48;

/// Bytes of a growth cone: its components, what the ECS keeps for it, and what is kept of it during a step.
pub const BYTES_A_CONE: usize =
    size_of::<ConeState>() + COMPONENTS * BYTES_A_COMPONENT + BYTES_AN_ENTITY + BYTES_A_STEP;

/// Entities kept free for the resources that come after the cones. A resource is an entity too, and is looked up in a list as long
/// as the number of that entity: behind the cones it would take eight bytes of each for every resource.
const ROOM_FOR_RESOURCES: usize = 256;

/// Spawns growth cones, with `spares` more for each axon after those of all axons; returns them in order.
pub(super) fn spawn_cones(world: &mut World, scene: &Scene, spares: u32) -> Result<Vec<Entity>, AssemblyError> {
    let room: Vec<Entity> = (0..ROOM_FOR_RESOURCES).map(|_| world.spawn_empty().id()).collect();
    let mut cones = Vec::new();
    let mut list = Vec::new();
    let (mut births, mut of_shaft) = (Vec::new(), Vec::new());
    for (index, (name, keys)) in scene.populations.iter().enumerate() {
        list.push(Population { name: name.clone(), speed: keys.speed.0, count: keys.count as usize });
        let places = Places::new(world.resource::<Tissue>(), name, keys, cones.len() as u32)?;
        for _ in 0..keys.count {
            let number = cones.len() as u32;
            let birth = birth_instant(world, scene, keys, number);
            let (site, facet) = places.origin(world.resource::<Tissue>(), scene.seed, number);
            let (face, heading) = places.first_heading(scene.seed, number, facet);
            let identity = GrowthCone { axon: number, population: index as u16, speed: keys.speed.0, birth };
            cones.push(spawn(world, identity, site, Spring { heading, ..Spring::default() }.into()));
            births.push(Birth { instant: birth, cone: number, face });
            of_shaft.push(index as u16);
        }
    }
    let spare_cones = spawn_spares(world, &mut cones, &mut of_shaft, spares);
    room.into_iter().for_each(|entity| {
        world.despawn(entity);
    });
    world.insert_resource(Populations(list));
    world.insert_resource(BirthQueue::new(births));
    world.insert_resource(spare_cones);
    world.insert_resource(ShaftPopulations(of_shaft));
    world.insert_resource(Shafts::new(cones.len(), SHAFT_TOLERANCE, LONGEST_SEGMENT));
    Ok(cones)
}

/// Spawns the cones of branches yet to come: like that of their axon, but born at no time.
fn spawn_spares(world: &mut World, cones: &mut Vec<Entity>, of_shaft: &mut Vec<u16>, each: u32) -> SpareCones {
    let axons = cones.len();
    for axon in 0..axons {
        let Some((&own, &site)) = world.get::<GrowthCone>(cones[axon]).zip(world.get::<Site>(cones[axon])) else {
            continue;
        };
        for _ in 0..each {
            let identity = GrowthCone { axon: cones.len() as u32, birth: GrowthCone::NEVER, ..own };
            cones.push(spawn(world, identity, site, SpringState::default()));
            of_shaft.push(own.population);
        }
    }
    SpareCones::new(axons as u32, each)
}

fn spawn(world: &mut World, identity: GrowthCone, site: Site, spring: SpringState) -> Entity {
    let state: ConeState = (
        identity,
        Status::default(),
        site,
        Position::default(),
        Velocity::default(),
        spring,
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

/// Where a population can be born, and how it heads then.
struct Places {
    place: Place,
    heading: Heading,
}

enum Place {
    /// Facets of an edge with their lengths added up, and the part of the whole in use.
    Edge { facets: Vec<(BorderFacet, f64)>, from: f64, to: f64 },
    /// Given points.
    Points(Vec<Site>),
    /// The areas of the cells added up, the number of the first axon, and how many there are.
    Tissue { areas: Vec<f64>, first: u32, count: f64 },
}

impl Places {
    fn new(tissue: &Tissue, name: &str, keys: &scene::Population, first: u32) -> Result<Self, AssemblyError> {
        let at = |key: &str, message: String| {
            AssemblyError::Scenario(vec![Violation::new(format!("/populations/{name}/{key}"), message)])
        };
        let place = match &keys.origin {
            scene::Origin::Edge(edge) => {
                let part = edge.part();
                let index = tissue
                    .edge(&part.name)
                    .ok_or_else(|| at("origin", format!("there is no edge called `{}`", part.name)))?;
                let lengths = tissue.edges[index].iter().map(|facet| length(tissue, *facet));
                let sums = added_up(lengths);
                let sum = sums.last().copied().unwrap_or_default();
                let facets = tissue.edges[index].iter().copied().zip(sums).collect();
                Place::Edge { facets, from: part.from.0 * sum, to: part.to.0 * sum }
            }
            scene::Origin::Points(points) => {
                let locate = |point: &[crate::model::quantity::Length; 2]| {
                    tissue.locate([point[0].0, point[1].0]).ok_or_else(|| {
                        at("origin/points", format!("({}, {}) lies outside the tissue", point[0], point[1]))
                    })
                };
                Place::Points(points.iter().map(locate).collect::<Result<Vec<_>, _>>()?)
            }
            scene::Origin::Tissue => {
                let mesh = &tissue.mesh;
                let areas = added_up((0..mesh.cell_count()).map(|cell| mesh.volume(mesh.vertices(), cell)));
                Place::Tissue { areas, first, count: keys.count as f64 }
            }
        };
        let needs_edge = keys.heading == Heading::Along(Direction::InnerNormal);
        if needs_edge && !matches!(place, Place::Edge { .. }) {
            return Err(at("heading", "axons that are not born on an edge have no inner normal".into()));
        }
        Ok(Self { place, heading: keys.heading })
    }

    /// Where a cone is born, and on which facet of the border, if on any.
    fn origin(&self, tissue: &Tissue, seed: u64, number: u32) -> (Site, Option<BorderFacet>) {
        let mut draws = KeyedRng::new(seed, number, BIRTHS, WHERE);
        match &self.place {
            Place::Points(sites) => (sites[number as usize % sites.len()], None),
            Place::Edge { facets, from, to } => {
                let share: f64 = draws.random();
                let along = from + share * (to - from);
                let place = facets.partition_point(|(_, sum)| *sum <= along).min(facets.len() - 1);
                let (facet, sum) = facets[place];
                let rest = ((sum - along) / length(tissue, facet)).clamp(0.0, 1.0);
                (on_facet(facet, rest), Some(facet))
            }
            Place::Tissue { areas, first, count } => {
                let [share, a, b]: [f64; 3] = [draws.random(), draws.random(), draws.random()];
                let along = (f64::from(number - first) + share) / count * areas.last().copied().unwrap_or_default();
                let cell = areas.partition_point(|sum| *sum <= along).min(areas.len() - 1);
                // Folded back, two even draws fill the triangle evenly.
                let weights = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
                (Site { cell: cell as u32, weights }, None)
            }
        }
    }

    /// The face of its cell along whose inner normal a cone heads at birth, or its heading.
    fn first_heading(&self, seed: u64, number: u32, facet: Option<BorderFacet>) -> (Option<u8>, Vector3<f64>) {
        let fixed = |angle: f64| (None, Vector3::new(angle.cos(), angle.sin(), 0.0));
        match (self.heading, facet) {
            (Heading::Angle(angle), _) => fixed(angle.radians()),
            (Heading::Along(Direction::InnerNormal), Some(facet)) => (Some(facet.face), Vector3::zeros()),
            (Heading::Along(_), _) => fixed(TAU * KeyedRng::new(seed, number, BIRTHS, WHITHER).share()),
        }
    }
}

/// The sums of the first one, two, … numbers.
fn added_up(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    numbers
        .scan(0.0, |sum, number| {
            *sum += number;
            Some(*sum)
        })
        .collect()
}

/// The site on a facet whose first vertex has weight `first` and whose last has the rest.
fn on_facet(facet: BorderFacet, first: f64) -> Site {
    let face = facet.face as usize;
    let mut all = [0.0; 3];
    all[(face + 1) % 3] = first;
    all[(face + 2) % 3] = 1.0 - first;
    Site { cell: facet.cell, weights: [all[1], all[2]] }
}

fn length(tissue: &Tissue, facet: BorderFacet) -> f64 {
    let ends: Vec<_> = tissue.mesh.facet_vertices(facet).map(|v| tissue.mesh.vertices()[v as usize]).collect();
    (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_growth_cone_takes_265_bytes() {
        let components = size_of::<GrowthCone>() + size_of::<Status>() + size_of::<Site>() + size_of::<Position>();
        let vectors = size_of::<Velocity>() + size_of::<SpringState>();
        let rest = size_of::<ReceptorWeights>() + size_of::<Journey>();
        assert_eq!(components + vectors + rest + BYTES_A_STEP, 265);
    }
}
