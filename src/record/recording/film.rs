//! What is kept of a world while it runs, frame by frame, and the recording it makes.
//!
//! Vertices and tips are kept in single precision until the end, when the box that they lie in is known. A tissue that rests is
//! kept once, a field only where it differs from the one before.

mod sound;

use super::shaft_history::ShaftHistory;
use super::{FULL, Header, NO_PARENT, RecordedBorder, RecordedCue, RecordedTarget, Recording, STAYS, VERSION};
use crate::kept;
use crate::model::clock::Clock;
use crate::model::components::{GrowthCone, Journey, Status};
use crate::model::configuration::Configuration;
use crate::model::growth::Populations;
use crate::model::observables::{Effect, Observables};
use crate::model::remodel::SpareCones;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use crate::record::snapshot::{border_vertices, target_vertices, tips};
use bevy_ecs::prelude::{With, World};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A film that would take more memory than this (bytes) is given up.
pub const MOST_BYTES: usize = 500_000_000;

/// All states of a cone; the index is what a recording stores.
pub const STATUSES: [Status; 7] = [
    Status::Unborn,
    Status::Growing,
    Status::Stalled,
    Status::Arrived,
    Status::Left,
    Status::Retracting,
    Status::Withdrawn,
];

/// What a run looked like at its frames.
#[derive(Debug, Clone, Default)]
pub struct Film {
    times: Vec<f64>,
    figure_frames: Vec<usize>,
    vertices: Vec<Vec<[f32; 2]>>,
    cues: Vec<FilmedCue>,
    tips: Vec<Vec<FilmedTip>>,
    shafts: ShaftHistory,
}

/// The fields of a cue that differ from the one before.
#[derive(Debug, Clone, Default)]
struct FilmedCue {
    frames: Vec<usize>,
    fields: Vec<Vec<f32>>,
}

/// A growth cone at a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct FilmedTip {
    position: [f32; 2],
    heading: u8,
    status: u8,
}

kept! { struct Film { times, figure_frames, vertices, cues, tips, shafts } }
kept! { struct FilmedCue { frames, fields } }
kept! { struct FilmedTip { position, heading, status } }

/// What a recording says besides what was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmTitle {
    /// Name of the scene.
    pub scene: String,
    /// What it shows.
    pub description: String,
    /// Seed.
    pub seed: u64,
}

/// Numbers of what a film holds, to foretell its memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmExtent {
    /// Frames.
    pub frames: f64,
    /// Growth cones.
    pub cones: f64,
    /// Vertices of all shafts.
    pub shaft_vertices: f64,
}

impl FilmExtent {
    /// Bytes that the film of an assembled scene takes, before it is deflated.
    pub fn bytes(&self, world: &World) -> f64 {
        let vertices = world.resource::<Tissue>().mesh.vertex_count() as f64;
        let moving = if world.resource::<Configuration>().moves { self.frames } else { 1.0 };
        let fields = world.resource::<Observables>().fields.len() as f64 * size_of::<f32>() as f64;
        let of_tissue = vertices * moving * (size_of::<[f32; 2]>() as f64 + fields);
        let of_tips = self.frames * self.cones * size_of::<FilmedTip>() as f64;
        of_tissue + of_tips + self.shaft_vertices * ShaftHistory::bytes_a_vertex() as f64
    }
}

impl Film {
    /// Looks at a world whose tissue has been brought to the present. A second look at the same time is none.
    pub fn observe(&mut self, world: &World) {
        let time = world.resource::<Clock>().hours();
        if self.times.last().is_some_and(|last| *last >= time) {
            return;
        }
        let frame = self.times.len();
        self.times.push(time);
        let configuration = world.resource::<Configuration>();
        if configuration.moves || frame == 0 {
            self.vertices.push(configuration.coordinates().iter().map(|x| x.map(|x| x as f32)).collect());
        }
        let observables = world.resource::<Observables>();
        self.cues.resize_with(observables.fields.len(), FilmedCue::default);
        for (cue, field) in self.cues.iter_mut().zip(&observables.fields) {
            let values: Vec<f32> = (field.read)(world, field.index).iter().map(|value| *value as f32).collect();
            if cue.fields.last() != Some(&values) {
                cue.frames.push(frame);
                cue.fields.push(values);
            }
        }
        let shafts = world.resource::<Shafts>();
        let mut seen = vec![FilmedTip::default(); shafts.count()];
        for tip in tips(world) {
            let turns = tip.heading[1].atan2(tip.heading[0]) / TAU;
            let status = STATUSES.iter().position(|status| *status == tip.status).unwrap_or_default();
            if let Some(place) = seen.get_mut(tip.axon as usize) {
                let heading = (256.0 * turns.rem_euclid(1.0)).round() as u64 as u8;
                *place = FilmedTip { position: tip.position.map(|x| x as f32), heading, status: status as u8 };
            }
        }
        self.tips.push(seen);
        self.shafts.observe(shafts, time);
    }

    /// Marks the present frame as one that the scene's own figure shows.
    pub fn mark_for_figure(&mut self) {
        let frame = self.times.len().saturating_sub(1);
        if !self.times.is_empty() && self.figure_frames.last() != Some(&frame) {
            self.figure_frames.push(frame);
        }
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        let vertices = self.vertices.len() * self.vertices.first().map_or(0, Vec::len);
        let fields: usize = self.cues.iter().flat_map(|cue| &cue.fields).map(Vec::len).sum();
        let tips = self.tips.len() * self.tips.first().map_or(0, Vec::len);
        let frames = vertices * size_of::<[f32; 2]>() + fields * size_of::<f32>() + tips * size_of::<FilmedTip>();
        frames + self.shafts.bytes()
    }

    /// The recording of what was seen; none if nothing was. The world is that of the run, at its end.
    pub fn develop(&self, world: &World, title: &FilmTitle) -> Option<Recording> {
        let last = *self.times.last()?;
        let tissue = world.resource::<Tissue>();
        let bounds = self.bounds();
        let quantised = Quantised { bounds, last };
        let cones = cones(world);
        let (spares, grid) = (world.resource::<SpareCones>(), &world.resource::<Clock>().grid);
        let (mut shaft_start, mut seen) = (vec![0], Vec::new());
        for shaft in self.shafts.shafts() {
            seen.extend_from_slice(shaft);
            shaft_start.push(seen.len() as u32);
        }
        let ends = seen.iter().map(|vertex| quantised.end(vertex.until)).collect();
        let mut recording = Recording {
            header: Header {
                version: VERSION,
                scene: title.scene.clone(),
                description: title.description.clone(),
                seed: title.seed,
                program: env!("CARGO_PKG_VERSION").to_owned(),
                bounds,
                frames: self.times.clone(),
                figure_frames: self.figure_frames.clone(),
                axon_count: cones.len(),
                populations: world.resource::<Populations>().0.iter().map(|p| p.name.clone()).collect(),
                status_words: STATUSES.iter().map(|status| status.word().to_owned()).collect(),
                cues: self.recorded_cues(world),
                borders: borders(tissue),
                targets: self.targets(tissue),
                measures: BTreeMap::new(),
            },
            vertex_count: tissue.mesh.vertex_count(),
            cells: tissue.mesh.cells().to_vec(),
            vertices: self.vertices.iter().flatten().flat_map(|x| quantised.place(*x)).collect(),
            cues: self.cues.iter().map(FilmedCue::quantised).collect(),
            tip_position: self.tips.iter().flatten().flat_map(|tip| quantised.tip(tip)).collect(),
            tip_heading: self.tips.iter().flatten().map(|tip| tip.heading).collect(),
            tip_status: self.tips.iter().flatten().map(|tip| tip.status).collect(),
            axon_population: cones.iter().map(|cone| cone.population).collect(),
            axon_birth: cones.iter().map(|cone| cone.birth_time(grid) as f32).collect(),
            axon_heading: Some(first_headings(world)),
            axon_parent: cones.iter().map(|cone| spares.parent(cone.axon).unwrap_or(NO_PARENT)).collect(),
            shaft_start,
            shaft_cell: seen.iter().map(|vertex| vertex.cell).collect(),
            shaft_weights: seen.iter().flat_map(|vertex| vertex.weights.map(|w| share(f64::from(w)))).collect(),
            shaft_time: seen.iter().map(|vertex| quantised.time(vertex.since)).collect(),
            shaft_end: self.shafts.has_struck().then_some(ends),
        };
        recording.header.measures = recording.measures();
        Some(recording)
    }

    /// The box around all vertices and tips, padded by a thousandth of its longer side.
    fn bounds(&self) -> [f64; 4] {
        let born = self.tips.iter().flatten().filter(|tip| tip.status > 0).map(|tip| tip.position);
        let points = self.vertices.iter().flatten().copied().chain(born).map(|point| point.map(f64::from));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points.filter(|point| point.iter().all(|x| x.is_finite())) {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let room = 1e-3 * (high[0] - low[0]).max(high[1] - low[1]).max(1e-3);
        [low[0] - room, low[1] - room, high[0] + room, high[1] + room]
    }

    fn recorded_cues(&self, world: &World) -> Vec<RecordedCue> {
        let observables = world.resource::<Observables>();
        let cue = |(cue, field): (&FilmedCue, &crate::model::observables::Observable)| {
            let effect = observables.effects.get(&field.name).map(|effect| match effect {
                Effect::Attract => "attract".to_owned(),
                Effect::Repel => "repel".to_owned(),
            });
            RecordedCue { name: field.name.clone(), effect, maximum: cue.maximum(), frames: cue.frames.clone() }
        };
        self.cues.iter().zip(&observables.fields).map(cue).collect()
    }

    fn targets(&self, tissue: &Tissue) -> Vec<RecordedTarget> {
        let corners = corners(tissue);
        let first = self.vertices.first().map(Vec::as_slice).unwrap_or_default();
        let target = |(name, ring): (String, Vec<u32>)| {
            // The first point is not repeated: the polygon is closed.
            let ring = &ring[..ring.len().saturating_sub(1)];
            RecordedTarget {
                name,
                closed: true,
                points: ring.iter().map(|&vertex| first[vertex as usize].map(f64::from)).collect(),
                cells: ring.iter().map(|&vertex| corners[vertex as usize].0).collect(),
                weights: ring.iter().map(|&vertex| corners[vertex as usize].1).collect(),
            }
        };
        target_vertices(tissue).into_iter().map(target).collect()
    }
}

impl FilmedCue {
    fn maximum(&self) -> f64 {
        let values = self.fields.iter().flatten().filter(|value| value.is_finite());
        f64::from(values.copied().fold(0.0, f32::max))
    }

    fn quantised(&self) -> Vec<u16> {
        let maximum = self.maximum().max(f64::MIN_POSITIVE);
        self.fields.iter().flatten().map(|value| share(f64::from(*value) / maximum)).collect()
    }
}

/// How positions and times become whole numbers.
struct Quantised {
    bounds: [f64; 4],
    last: f64,
}

impl Quantised {
    fn place(&self, point: [f32; 2]) -> [u16; 2] {
        let [left, low, right, high] = self.bounds;
        [share((f64::from(point[0]) - left) / (right - left)), share((f64::from(point[1]) - low) / (high - low))]
    }

    fn tip(&self, tip: &FilmedTip) -> [u16; 2] {
        if tip.status == 0 { [0; 2] } else { self.place(tip.position) }
    }

    fn time(&self, time: f32) -> u16 {
        quantised_time(f64::from(time), self.last)
    }

    /// As [`Self::time`], but what is gone at the last frame does not stay.
    fn end(&self, until: f32) -> u16 {
        if until.is_finite() { self.time(until).min(STAYS - 1) } else { STAYS }
    }
}

/// A time as a share of the last one (h), in steps of 1/65535.
pub(super) fn quantised_time(time: f64, last: f64) -> u16 {
    if last > 0.0 { share(time / last) } else { 0 }
}

/// A share in [0, 1] in steps of 1/65535; 0 for what is none.
fn share(share: f64) -> u16 {
    (FULL * share).round() as u16
}

/// Headings at birth (rad), in the order of the cones; 0 for those not born.
fn first_headings(world: &World) -> Vec<f32> {
    let Some(mut journeys) = world.try_query_filtered::<&Journey, With<GrowthCone>>() else { return Vec::new() };
    journeys.iter(world).map(|journey| journey.first_heading[1].atan2(journey.first_heading[0]) as f32).collect()
}

/// All growth cones in the order of their numbers.
fn cones(world: &World) -> Vec<GrowthCone> {
    let Some(mut cones) = world.try_query_filtered::<&GrowthCone, With<GrowthCone>>() else { return Vec::new() };
    let mut cones: Vec<GrowthCone> = cones.iter(world).copied().collect();
    cones.sort_by_key(|cone| cone.axon);
    cones
}

fn borders(tissue: &Tissue) -> Vec<RecordedBorder> {
    border_vertices(tissue).into_iter().map(|(name, vertices)| RecordedBorder { name, vertices }).collect()
}

/// Of each vertex of the mesh, a cell with it and its weights there.
fn corners(tissue: &Tissue) -> Vec<(u32, [u16; 2])> {
    let mut corners = vec![(0, [0; 2]); tissue.mesh.vertex_count()];
    for (cell, vertices) in tissue.mesh.cells().chunks_exact(3).enumerate() {
        for (place, &vertex) in vertices.iter().enumerate() {
            corners[vertex as usize] = (cell as u32, [[0, 0], [u16::MAX, 0], [0, u16::MAX]][place]);
        }
    }
    corners
}
