//! The same model as a plain loop over arrays: what an entity-component-system simulation is measured against.
//!
//! No entities, no schedule, no mechanisms, no choice of method: one loop over the cones of the paper's full model (gradients of the cues,
//! contact, borders, noise, a tissue that moves, exact rotation), with the numerics of this crate and an append-only grid for neighbours.
//! It takes its constants from keys that the scene spells out, and its tissue and fields from a simulation in which no cone is born. Its
//! cones end where those of the simulation end.

use crate::model::births::BirthQueue;
use crate::model::brownian::HeadingPaths;
use crate::model::clock::Clock;
use crate::model::components::{GrowthCone, Site, SpringState};
use crate::model::configuration::Configuration;
use crate::model::growth::{Growth, Targets};
use crate::model::shafts::{Shafts, Successor, VertexId};
use crate::model::stopwatch::Stopwatch;
use crate::model::tissue::Tissue;
use crate::numerics::contact_integral::Felt;
use crate::numerics::segments::{ContactPull, Contacts, Segments, Touch};
use crate::numerics::turning::{kick, turn};
use crate::numerics::walk::{BorderRule, WalkEnd, WalkRules, nowhere, walk};
use crate::prelude::CueFields;
use crate::scenario::load::Loaded;
use crate::simulation::Simulation;
use bevy_ecs::prelude::{With, World};
use nalgebra::Vector3;
use serde_json::Value;

/// Blocks of the model that the loop is written for.
const BLOCKS: [&str; 6] = ["matrix", "cues", "chemotaxis", "fasciculation", "borders", "heading_noise"];
/// A border adds less than the rounding of a pull of 1 from so many ranges on.
const RANGES: f64 = 40.0;

/// A receptor: number of its cue, ± weight, dissociation constant (nM).
type Receptor = (usize, f64, f64);

/// The constants of the model.
#[derive(Debug, Clone)]
struct Laws {
    receptors: Vec<Receptor>,
    sensing_length: f64,
    contact: Contact,
    fasciculation: f64,
    border: [f64; 2],
    persistence_length: f64,
}

/// The contact law with its constants.
#[derive(Debug, Clone, Copy)]
struct Contact {
    felt: Felt,
    attraction: f64,
    alignment: f64,
}

impl ContactPull<2> for Contact {
    #[inline(always)]
    fn pull(&self, touch: &Touch<2>) -> [f64; 2] {
        let toward = 6.75 * self.attraction / (self.felt.reach * self.felt.reach);
        let direction = if touch.along > 0.0 { 1.0 } else { 0.0 };
        let [w0, w1] = touch.moments;
        let tangential = toward * w1 + self.alignment / self.felt.reach * direction * w0;
        std::array::from_fn(|k| touch.normal[k] * (toward * w0) + touch.tangent[k] * tangential)
    }
}

impl Laws {
    /// The constants that a scene spells out, in base units.
    fn of(loaded: &Loaded, world: &World) -> Result<Self, String> {
        if let Some(other) = loaded.blocks.keys().find(|name| !BLOCKS.contains(&name.as_str())) {
            return Err(format!("the plain loop has no `{other}`"));
        }
        let number = |pointer: &str| {
            let value = loaded.merged.pointer(pointer).and_then(Value::as_f64);
            value.ok_or_else(|| format!("the plain loop needs a number without unit at {pointer}"))
        };
        let fields = world.resource::<CueFields>();
        let named = loaded.merged.pointer("/chemotaxis/receptors").and_then(Value::as_object);
        let receptor = |(name, keys): (&String, &Value)| {
            let at = format!("/chemotaxis/receptors/{name}");
            let sign = if keys["effect"] == "attract" { 1.0 } else { -1.0 };
            let cue = fields.index(name).ok_or_else(|| format!("there is no field of `{name}`"))?;
            Ok((cue, sign * number(&format!("{at}/weight"))?, number(&format!("{at}/dissociation_constant"))?))
        };
        let mut receptors = named.into_iter().flatten().map(receptor).collect::<Result<Vec<Receptor>, String>>()?;
        receptors.sort_by_key(|(cue, ..)| *cue);
        Ok(Self {
            receptors,
            sensing_length: number("/chemotaxis/sensing_length")?,
            contact: Contact {
                felt: Felt::ahead(number("/fasciculation/reach")?, number("/fasciculation/sector")?.to_radians()),
                attraction: number("/fasciculation/attraction")?,
                alignment: number("/fasciculation/alignment")?,
            },
            fasciculation: number("/fasciculation/weight")?,
            border: [number("/borders/weight")?, number("/borders/range")?],
            persistence_length: number("/heading_noise/persistence_length")?,
        })
    }
}

/// One cone.
#[derive(Debug, Clone, Copy)]
struct PlainCone {
    axon: u32,
    birth: u64,
    birth_time: f64,
    speed: f64,
    site: Site,
    heading: Vector3<f64>,
    pull: Vector3<f64>,
    grows: bool,
}

/// The loop.
pub struct PlainLoop {
    laws: Laws,
    cones: Vec<PlainCone>,
    births: Vec<u32>,
    next_birth: usize,
    shafts: Shafts,
    grid: Grid,
    tissue: Tissue,
    growth: Growth,
    targets: Targets,
    paths: HeadingPaths,
    stopwatch: Stopwatch,
}

impl PlainLoop {
    /// The loop over the cones of a simulation, from their births on; `stage` has the same tissue and fields, and the same cones before birth.
    ///
    /// # Errors
    /// In words, what keeps the loop from running this scene.
    pub fn new(loaded: &Loaded, simulation: &World, stage: &World) -> Result<Self, String> {
        let (world, laws) = (stage, Laws::of(loaded, stage)?);
        if stage.resource::<BirthQueue>().waiting().iter().any(|birth| birth.face.is_some()) {
            return Err("the plain loop needs headings at birth that are fixed".to_owned());
        }
        let identities = simulation.try_query_filtered::<&GrowthCone, With<GrowthCone>>();
        let unborn = stage.try_query_filtered::<(&Site, &SpringState), With<GrowthCone>>();
        let (mut identities, mut unborn) = identities.zip(unborn).ok_or_else(|| "the scene has no cones".to_owned())?;
        let grid = simulation.resource::<Clock>().grid;
        let plain = |(cone, (site, spring)): (&GrowthCone, (&Site, &SpringState))| PlainCone {
            axon: cone.axon,
            birth: cone.birth,
            birth_time: cone.birth_time(&grid),
            speed: cone.speed,
            site: *site,
            heading: spring.seen().heading,
            pull: Vector3::zeros(),
            grows: false,
        };
        let cones: Vec<PlainCone> = identities.iter(simulation).zip(unborn.iter(stage)).map(plain).collect();
        let mut births: Vec<u32> = (0..cones.len() as u32).collect();
        births.sort_by_key(|&i| cones[i as usize].birth);
        let own = world.resource::<Shafts>();
        let mut shafts = Shafts::new(cones.len(), own.tolerance, own.longest);
        shafts.watch();
        let tissue = world.resource::<Tissue>().clone();
        let paths = world.get_resource::<HeadingPaths>().ok_or_else(|| "the scene has no noise".to_owned())?;
        Ok(Self {
            grid: Grid::new(tissue.domain.bounding_box(), laws.contact.felt.reach + own.longest),
            shafts,
            laws,
            births,
            next_birth: 0,
            cones,
            growth: *world.resource::<Growth>(),
            targets: world.resource::<Targets>().clone(),
            paths: *paths,
            tissue,
            stopwatch: Stopwatch::default(),
        })
    }

    /// Takes all steps; `stage` brings tissue and fields to each.
    pub fn run(&mut self, stage: &mut Simulation) {
        let mut clock = *stage.world().resource::<Clock>();
        while !clock.is_over() {
            let (from, to) = (clock.now, clock.now + clock.next_step());
            let hours = [from, to].map(|instant| clock.grid.hours(instant));
            stage.evaluate_at(0.5 * (hours[0] + hours[1]));
            self.stopwatch.lap("scenery");
            self.step(stage.world(), (from, to), (clock.grid.tick(), hours[1]));
            self.stopwatch.lap("cones");
            clock.now = to;
        }
    }

    fn step(&mut self, world: &World, (from, to): (u64, u64), (tick, end): (f64, f64)) {
        let (configuration, fields) = (world.resource::<Configuration>(), world.resource::<CueFields>());
        while let Some(&i) = self.births.get(self.next_birth).filter(|&&i| self.cones[i as usize].birth < to) {
            let cone = &mut self.cones[i as usize];
            cone.grows = true;
            let at = self.tissue.reference_position(cone.site);
            self.shafts.start(i as usize, cone.site, [at.x, at.y], cone.birth_time);
            self.next_birth += 1;
        }
        for vertex in self.shafts.take_laid() {
            let at = self.shafts.point(vertex).position(&self.tissue.mesh, self.tissue.mesh.vertices());
            self.grid.add(vertex, at);
        }
        let margin = self.laws.contact.felt.reach * configuration.inverse_stretch(&self.tissue.mesh);
        let (mut contacts, mut segments, mut near) = (Contacts::default(), Segments::default(), Vec::new());
        let mut moved = Vec::new();
        for i in 0..self.cones.len() {
            if !self.cones[i].grows {
                continue;
            }
            let cone = self.cones[i];
            let duration = (to - cone.birth.max(from)) as f64 * tick;
            let (middle, heading) = self.midpoint(configuration, &cone, duration);
            self.gather(configuration, (middle, margin), (&mut near, &mut segments));
            let touch = self.touched(configuration, (i as u32, middle, heading), (&mut contacts, &segments));
            let pull = self.kept_in(configuration, middle, self.sensed(fields, middle) + touch);
            moved.push((i as u32, self.advanced(configuration, &cone, pull, (cone.birth.max(from), to, duration))));
        }
        for (i, cone) in moved {
            self.cones[i as usize] = cone;
            let at = self.tissue.reference_position(cone.site);
            let reference = |site| self.tissue.reference_position(site).xy().into();
            self.shafts.extend(i as usize, (cone.site, [at.x, at.y]), end, reference);
        }
    }

    /// Site and heading in the middle of a step, by the last pull.
    fn midpoint(&self, configuration: &Configuration, cone: &PlainCone, duration: f64) -> (Site, Vector3<f64>) {
        let half = 0.5 * duration;
        let forward = cone.heading * (cone.speed * half);
        let heading = turn(&cone.heading, &cone.pull, self.growth.turning_rate * half);
        let rules = nowhere(BorderRule::Slide);
        let (mesh, from) = (&self.tissue.mesh, cone.site.planar());
        let walked = walk(mesh, configuration, from, [forward.x, forward.y], &rules);
        (walked.map_or(cone.site, |walked| walked.point.into()), heading)
    }

    fn sensed(&self, fields: &CueFields, site: Site) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for &(cue, weight, dissociation) in &self.laws.receptors {
            let sample = fields.sample(&self.tissue.mesh, cue, site);
            sum += sample.occupancy_difference(dissociation, self.laws.sensing_length) * weight;
        }
        sum / sum.norm().max(1.0)
    }

    /// The segments near a cone, by their first vertices, in their order.
    fn gather(
        &self,
        configuration: &Configuration,
        (site, margin): (Site, f64),
        (near, segments): (&mut Vec<VertexId>, &mut Segments<2>),
    ) {
        let (mesh, coordinates, shafts) = (&self.tissue.mesh, configuration.coordinates(), &self.shafts);
        let at = self.tissue.reference_position(site);
        near.clear();
        self.grid.collect([at.x, at.y], margin + shafts.longest, near);
        near.sort_unstable();
        segments.clear();
        for &vertex in near.iter() {
            let end = match shafts.successor(vertex) {
                Successor::Vertex(next) => shafts.point(next),
                Successor::Tip(shaft) => shafts.tip(shaft),
            };
            let [a, b] = [shafts.point(vertex), end].map(|point| point.position(mesh, &*coordinates));
            segments.push(a, b, (shafts.owner(vertex), 0));
        }
    }

    fn touched(
        &self,
        configuration: &Configuration,
        (own, site, heading): (u32, Site, Vector3<f64>),
        (contacts, segments): (&mut Contacts<2>, &Segments<2>),
    ) -> Vector3<f64> {
        let (x, contact) = (configuration.position(&self.tissue.mesh, site), &self.laws.contact);
        let state = ([x.x, x.y], [heading.x, heading.y]);
        let [x, y] = contacts.sum(state, segments, own, (&contact.felt, contact), &[1.0]);
        let sum = Vector3::new(x, y, 0.0);
        sum / sum.norm().max(1.0) * self.laws.fasciculation
    }

    /// A pull with that of the borders.
    fn kept_in(&self, configuration: &Configuration, site: Site, mut pull: Vector3<f64>) -> Vector3<f64> {
        let ([weight, range], x) = (self.laws.border, configuration.position(&self.tissue.mesh, site));
        for facets in &self.tissue.edges {
            let (mut nearest, mut away, mut along) = (f64::INFINITY, Vector3::zeros(), Vector3::zeros());
            for facet in facets {
                let corners = self.tissue.mesh.cell(facet.cell as usize);
                let end = |k: usize| {
                    let at = configuration.vertex(corners[(facet.face as usize + k) % 3] as usize);
                    Vector3::new(at[0], at[1], 0.0)
                };
                let (a, b) = (end(1), end(2));
                let share = ((x - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                let from_facet = x - (a + (b - a) * share);
                if from_facet.norm_squared() < nearest {
                    (nearest, away, along) = (from_facet.norm_squared(), from_facet, b - a);
                }
            }
            let distance = nearest.sqrt();
            let inward =
                if distance > 0.0 { away / distance } else { Vector3::new(-along.y, along.x, 0.0).normalize() };
            if distance < RANGES * range {
                pull += inward * (-distance / range).exp() * weight;
            }
        }
        pull
    }

    /// The cone after the step.
    fn advanced(
        &self,
        configuration: &Configuration,
        cone: &PlainCone,
        pull: Vector3<f64>,
        (start, to, duration): (u64, u64, f64),
    ) -> PlainCone {
        let half_turn = 0.5 * self.growth.turning_rate * duration;
        let before = turn(&cone.heading, &pull, half_turn);
        let scale = (2.0 * cone.speed / self.laws.persistence_length).sqrt();
        let after = kick(&before, [scale * self.paths.0.increment::<1>(cone.axon, start, to)[0], 0.0], true);
        let displacement = (before + after) * (0.5 * cone.speed * duration);
        let rules = WalkRules { border: BorderRule::Slide, stop_at: |cell: u32| self.targets.contains(cell) };
        let mesh = &self.tissue.mesh;
        let walked = walk(mesh, configuration, cone.site.planar(), [displacement.x, displacement.y], &rules);
        let mut cone = PlainCone { heading: turn(&after, &pull, half_turn), pull, ..*cone };
        if let Ok(walked) = walked {
            cone.site = walked.point.into();
            cone.grows = !matches!(walked.end, WalkEnd::Entered(_));
        }
        cone
    }

    /// Seconds of the loop itself: tissue and fields are not counted.
    pub fn seconds(&self) -> f64 {
        self.stopwatch.seconds().get("cones").copied().unwrap_or_default()
    }

    /// Sites of all cones, in their order.
    pub fn sites(&self) -> impl Iterator<Item = Site> + '_ {
        self.cones.iter().map(|cone| cone.site)
    }

    /// The tissue.
    pub fn tissue(&self) -> &Tissue {
        &self.tissue
    }
}

/// The simplest index there is: square cells over the tissue at rest, each with its vertices and where they are.
#[derive(Debug)]
struct Grid {
    low: [f64; 2],
    side: f64,
    columns: usize,
    cells: Vec<Vec<(VertexId, [f64; 2])>>,
}

impl Grid {
    fn new([low, high]: [[f64; 2]; 2], side: f64) -> Self {
        let [columns, rows] = [0, 1].map(|k| ((high[k] - low[k]) / side) as usize + 2);
        Self { low, side, columns, cells: vec![Vec::new(); columns * rows] }
    }

    fn seat(&self, at: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| ((at[k] - self.low[k]) / self.side).max(0.0) as usize)
    }

    fn add(&mut self, vertex: VertexId, at: [f64; 2]) {
        let [column, row] = self.seat(at);
        self.cells[row * self.columns + column].push((vertex, at));
    }

    /// Appends the vertices nearer than `margin` (µm) to a point.
    fn collect(&self, at: [f64; 2], margin: f64, near: &mut Vec<VertexId>) {
        let [low, high] = [-margin, margin].map(|by| self.seat(at.map(|x| x + by)));
        let last = [self.columns - 1, self.cells.len() / self.columns - 1];
        for row in low[1]..=high[1].min(last[1]) {
            for column in low[0]..=high[0].min(last[0]) {
                let within = |x: &[f64; 2]| (x[0] - at[0]).powi(2) + (x[1] - at[1]).powi(2) <= margin * margin;
                let cell = &self.cells[row * self.columns + column];
                near.extend(cell.iter().filter(|(_, x)| within(x)).map(|(vertex, _)| *vertex));
            }
        }
    }
}
