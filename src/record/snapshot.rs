//! What a run looks like at one instant: plain data for pictures and measures.

use crate::kept;
use crate::model::clock::Clock;
use crate::model::components::{GrowthCone, Journey, Site, SpringState, Status};
use crate::model::configuration::Configuration;
use crate::model::observables::{Effect, Observable, Observables};
use crate::model::remodel::SpareCones;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use crate::record::measures::AxonRecord;
use bevy_ecs::prelude::{With, World};
use std::collections::BTreeMap;

/// One field at the vertices of the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldView {
    /// Name of the cue.
    pub name: String,
    /// What it does to cones; `None` if nothing turns by it.
    pub effect: Option<Effect>,
    /// Concentration at each vertex (nM).
    pub concentration: Vec<f64>,
}

kept! { struct FieldView { name, effect, concentration } }

/// A growth cone seen from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipView {
    /// Number of its axon.
    pub axon: u32,
    /// Position (µm).
    pub position: [f64; 2],
    /// Unit heading.
    pub heading: [f64; 2],
    /// What it is doing.
    pub status: Status,
    /// Whether it is the tip of a branch.
    pub is_branch: bool,
}

kept! { struct TipView { axon, position, heading, status, is_branch } }

/// The scene at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Time (h).
    pub time: f64,
    /// Vertex positions (µm).
    pub vertices: Vec<[f64; 2]>,
    /// Triangles, flat, stride 3.
    pub cells: Vec<u32>,
    /// The outline: polylines of named edges.
    pub borders: Vec<(String, Vec<[f64; 2]>)>,
    /// The cue fields that the scene computes.
    pub fields: Vec<FieldView>,
    /// Shafts of all axons born, origin to tip (µm).
    pub shafts: Vec<Vec<[f64; 2]>>,
    /// Tips, in the order of the shafts.
    pub tips: Vec<TipView>,
    /// Targets: name and closed border (first point repeated).
    pub targets: Vec<(String, Vec<[f64; 2]>)>,
}

kept! { struct Snapshot { time, vertices, cells, borders, fields, shafts, tips, targets } }

impl Snapshot {
    /// Looks at a world whose tissue has been brought to the present.
    pub fn of(world: &World) -> Self {
        let tissue = world.resource::<Tissue>();
        let configuration = world.resource::<Configuration>();
        Self {
            time: world.resource::<Clock>().hours(),
            vertices: configuration.coordinates().into_owned(),
            cells: tissue.mesh.cells().to_vec(),
            borders: borders(tissue, configuration),
            fields: fields(world),
            shafts: shafts(world),
            tips: tips(world),
            targets: targets(tissue, configuration),
        }
    }
}

impl Snapshot {
    /// Whether a run may have looked so on its way to `world`: as many vertices, cells, borders, fields, and targets as the scene has, a tip for
    /// each shaft, and every position a number.
    pub fn may_be_of(&self, world: &World) -> bool {
        let (tissue, observables) = (world.resource::<Tissue>(), world.resource::<Observables>());
        let vertices = tissue.mesh.vertex_count();
        let same = |lines: &[(String, Vec<[f64; 2]>)], own: &[(String, Vec<u32>)]| {
            let extents = lines.iter().map(|(name, line)| (name, line.len()));
            let finite = lines.iter().flat_map(|(_, line)| line).flatten().all(|x| x.is_finite());
            finite && extents.eq(own.iter().map(|(name, line)| (name, line.len())))
        };
        let is_field = |(view, field): (&FieldView, &Observable)| {
            view.name == field.name && view.concentration.len() == (field.read)(world, field.index).len()
        };
        let axons = world.resource::<Shafts>().count();
        self.time.is_finite()
            && self.vertices.len() == vertices
            && self.cells == tissue.mesh.cells()
            && same(&self.borders, &border_vertices(tissue))
            && same(&self.targets, &target_vertices(tissue))
            && self.fields.len() == observables.fields.len()
            && self.fields.iter().zip(&observables.fields).all(is_field)
            && self.tips.len() == self.shafts.len()
            && self.tips.iter().all(|tip| (tip.axon as usize) < axons)
            && self.shafts.iter().all(|shaft| !shaft.is_empty())
            && self.is_finite()
    }

    /// Whether every position is a number: one that a fault has spoilt cannot be drawn.
    pub fn is_finite(&self) -> bool {
        let tips = self.tips.iter().flat_map(|tip| [&tip.position, &tip.heading]);
        let mut positions = self.vertices.iter().chain(self.shafts.iter().flatten()).chain(tips);
        positions.all(|x| x[0].is_finite() && x[1].is_finite())
    }
}

/// Shafts of all axons born (µm), in the order of the cones.
pub fn shafts(world: &World) -> Vec<Vec<[f64; 2]>> {
    let lines = (0..world.resource::<Shafts>().count()).map(shaft_lines(world));
    lines.filter(|line| !line.is_empty()).collect()
}

/// The shaft of a cone (µm), origin to tip; empty before birth.
fn shaft_lines(world: &World) -> impl Fn(usize) -> Vec<[f64; 2]> + '_ {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let shafts = world.resource::<Shafts>();
    let place = |point| configuration.place(&tissue.mesh, point);
    move |shaft| shafts.polyline(shaft).into_iter().map(place).collect()
}

/// Tips of all axons born, in the order of the cones.
pub fn tips(world: &World) -> Vec<TipView> {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let spares = world.resource::<SpareCones>();
    let Some(mut cones) = world.try_query_filtered::<(&GrowthCone, &Status, &Site, &SpringState), With<GrowthCone>>()
    else {
        return Vec::new();
    };
    cones
        .iter(world)
        .filter(|(_, status, ..)| **status != Status::Unborn)
        .map(|(cone, status, site, spring)| {
            let x = configuration.position(&tissue.mesh, *site);
            let heading = spring.heading().into();
            let is_branch = spares.is_branch(cone.axon);
            TipView { axon: cone.axon, position: [x.x, x.y], heading, status: *status, is_branch }
        })
        .collect()
}

/// When the first growth cone of each axon arrived, its own or that of a branch (h).
pub fn arrivals(world: &World) -> BTreeMap<u32, f64> {
    let spares = world.resource::<SpareCones>();
    let mut arrivals = BTreeMap::new();
    let Some(mut cones) = world.try_query_filtered::<(&GrowthCone, &Status, &Journey), With<GrowthCone>>() else {
        return arrivals;
    };
    for (cone, _, journey) in cones.iter(world).filter(|(_, status, _)| **status == Status::Arrived) {
        let first = arrivals.entry(spares.root(cone.axon)).or_insert(journey.ended);
        *first = journey.ended.min(*first);
    }
    arrivals
}

/// Calls `act` with what measures need of every axon born, in the order of the cones.
pub fn each_axon(world: &World, mut act: impl FnMut(AxonRecord)) {
    let Some(mut cones) =
        world.try_query_filtered::<(&GrowthCone, &Status, &Journey, &SpringState), With<GrowthCone>>()
    else {
        return;
    };
    let (spares, grid) = (world.resource::<SpareCones>(), &world.resource::<Clock>().grid);
    let (arrivals, line) = (arrivals(world), shaft_lines(world));
    let born = cones.iter(world).enumerate().filter(|(_, (_, status, ..))| **status != Status::Unborn);
    for (shaft, (cone, status, journey, spring)) in born {
        act(AxonRecord {
            population: cone.population,
            shaft: line(shaft),
            birth_time: cone.birth_time(grid),
            arrival_time: arrivals.get(&cone.axon).copied(),
            is_branch: spares.is_branch(cone.axon),
            is_withdrawn: *status == Status::Withdrawn,
            initial_heading: journey.first_heading,
            final_heading: spring.heading().into(),
        });
    }
}

fn fields(world: &World) -> Vec<FieldView> {
    let observables = world.resource::<Observables>();
    let view = |field: &Observable| FieldView {
        name: field.name.clone(),
        effect: observables.effects.get(&field.name).copied(),
        concentration: (field.read)(world, field.index),
    };
    observables.fields.iter().map(view).collect()
}

/// The named edges as they are now; an edge in several pieces gives several polylines.
fn borders(tissue: &Tissue, configuration: &Configuration) -> Vec<(String, Vec<[f64; 2]>)> {
    border_vertices(tissue).into_iter().map(|(name, line)| (name, places(&line, configuration))).collect()
}

/// The vertices along the named edges; an edge in several pieces gives several lists.
pub fn border_vertices(tissue: &Tissue) -> Vec<(String, Vec<u32>)> {
    let mut lines = Vec::new();
    for (name, facets) in tissue.domain.edge_names.iter().zip(&tissue.edges) {
        let mut last = None;
        for facet in facets {
            let ends: Vec<u32> = tissue.mesh.facet_vertices(*facet).collect();
            if last != Some(ends[0]) {
                lines.push((name.clone(), vec![ends[0]]));
            }
            if let Some((_, line)) = lines.last_mut() {
                line.push(ends[1]);
            }
            last = Some(ends[1]);
        }
    }
    lines
}

/// The border of each target as it is now.
fn targets(tissue: &Tissue, configuration: &Configuration) -> Vec<(String, Vec<[f64; 2]>)> {
    target_vertices(tissue).into_iter().map(|(name, ring)| (name, places(&ring, configuration))).collect()
}

/// The vertices along the border of each target, the first one repeated.
pub fn target_vertices(tissue: &Tissue) -> Vec<(String, Vec<u32>)> {
    let named = tissue.regions.iter().filter_map(|(name, cells)| Some((name.strip_prefix("targets/")?, cells)));
    named
        .flat_map(|(name, cells)| region_rings(tissue, cells).into_iter().map(move |ring| (name.to_owned(), ring)))
        .collect()
}

fn places(vertices: &[u32], configuration: &Configuration) -> Vec<[f64; 2]> {
    vertices.iter().map(|&vertex| configuration.vertex(vertex as usize)).collect()
}

/// The closed borders of a set of cells (ascending), as vertices with the first one repeated.
fn region_rings(tissue: &Tissue, cells: &[u32]) -> Vec<Vec<u32>> {
    let mut next = BTreeMap::new();
    for &cell in cells {
        let corners = tissue.mesh.cell(cell as usize);
        for face in 0..3 {
            if cells.binary_search(&tissue.mesh.neighbour(cell as usize, face)).is_err() {
                next.insert(corners[(face + 1) % 3], corners[(face + 2) % 3]);
            }
        }
    }
    let mut rings = Vec::new();
    while let Some((&start, _)) = next.iter().next() {
        let mut ring = vec![start];
        let mut at = start;
        while let Some(to) = next.remove(&at) {
            ring.push(to);
            at = to;
        }
        rings.push(ring);
    }
    rings
}

/// Height of the tissue now: lowest and highest y (µm).
pub fn extent_in_y(configuration: &Configuration) -> (f64, f64) {
    let coordinates = configuration.coordinates();
    let ys = coordinates.iter().map(|x| x[1]);
    ys.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)))
}
