//! Provider: what lies near a growth cone, from an R-tree over the shafts.
//!
//! The tree lives in the *reference* configuration, where stored vertices never move, so that it only ever grows. Each
//! shaft segment stands in it as its first vertex; a segment is at most `Shafts::longest` long, so a ball of radius
//! r‖F⁻¹‖ + longest about a cone holds the first vertices of all segments within the spatial distance r. Segments that
//! end at a live tip need no entry of their own: their end is looked up.
//!
//! The tree is not asked every step. Cones that sit in one square of a coarse grid share a list of candidates, which is asked
//! of the tree when the first cone enters the square, kept up to date as vertices are laid, and dropped when the last cone
//! has gone. A list names blocks of stored vertices, with a bit for each vertex that may be near. Lists hold more than is near
//! and are sorted; what is not within reach adds exactly nothing, so results are those of looking at every segment of every
//! shaft, to the last bit.

use crate::model::births::Origin;
use crate::model::shafts::{BLOCK, Struck};
use crate::numerics::contact_integral::Felt;
use crate::numerics::locate::MaterialPoint;
use crate::numerics::polylines::{Part, Polyline, meeting};
use crate::numerics::segments::{ContactPull, Contacts, Segments};
use crate::prelude::*;
use nalgebra::Vector2;
use rayon::prelude::*;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree, RTreeNode};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

type Entry = GeomWithData<[f64; 2], VertexId>;
type Square = [i32; 2];
const _: () = assert!(BLOCK == u16::BITS as usize);

/// The part of the plan that the index is.
const PART: &str = "shaft index";
/// Side of a square over the reach.
const SIDE: f64 = 3.0;
/// Room for ‖F⁻¹‖ to grow before lists are made anew.
const ROOM: f64 = 1.05;
/// Cones of a square that one task serves: few enough to spread a crowded square over threads.
const SHARED: usize = 32;

/// Work memory that tasks take and give back: one for each that runs at the same time.
struct Pool<T>(Mutex<Vec<T>>);

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self(Mutex::new(Vec::new()))
    }
}

impl<T: Default> Pool<T> {
    fn lend<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = lock().pop();
        let mut memory = taken.unwrap_or_default();
        let result = work(&mut memory);
        lock().push(memory);
        result
    }
}

/// How the shafts near a growth cone are found. Results do not depend on it, to the last bit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// By an R-tree.
    #[default]
    Tree,
    /// By looking at every segment of every shaft: slow, and there to be compared with.
    All,
}

/// A cone that asks for its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asking {
    /// Place of the cone, which is the number of its own shaft.
    pub index: u32,
    /// Index of its population.
    pub population: u16,
    /// Material site.
    pub site: Site,
    /// Position (µm).
    pub position: Vector3<f64>,
    /// Unit heading.
    pub heading: Vector3<f64>,
}

impl Asking {
    /// All growing cones, in their order.
    pub fn all(cones: &Cones) -> Vec<Self> {
        cones.collect(|cone, spring| Self {
            index: cone.index as u32,
            population: cone.identity.population,
            site: cone.site,
            position: cone.position,
            heading: spring.heading,
        })
    }

    /// What the cone makes of segments other than its own by a law, times its adhesion to their kinds.
    #[inline]
    pub fn sum(
        &self,
        contacts: &mut Contacts<2>,
        segments: &Segments<2>,
        felt_by: (&Felt, &impl ContactPull<2>),
        adhesion: &[f64],
    ) -> Vector3<f64> {
        let state = (self.position.xy().into(), self.heading.xy().into());
        let [x, y] = contacts.sum(state, segments, self.index, felt_by, adhesion);
        Vector3::new(x, y, 0.0)
    }
}

/// The neighbour index over all shaft segments.
#[derive(Debug, Resource, Default)]
pub struct ShaftIndex {
    tree: RTree<Entry>,
    search: Search,
    reach: f64,
    radius: f64,
    lists: HashMap<Square, Vec<Part>>,
    places: Places,
}

/// Positions now (µm) of a block's vertices, and of the point that the last of them leads to.
type Line = Polyline<{ BLOCK + 1 }>;

/// Polylines of the blocks that some list names, each found once for all squares.
#[derive(Debug, Default)]
struct Places {
    positions: Vec<Line>,
    /// For each block, one more than the revision of the configuration it was found in; 0 when not yet, or when it still grows.
    revisions: Vec<u64>,
    stale: Vec<bool>,
}

impl Places {
    /// Finds the blocks of all lists.
    fn bring_up_to_date<'a>(&mut self, scene: &ShaftScene, listed: impl Iterator<Item = &'a Part>) {
        let (now, blocks) = (scene.configuration.revision + 1, scene.shafts.block_count());
        self.positions.resize(blocks, [[0.0; BLOCK + 1]; 2]);
        self.revisions.resize(blocks, 0);
        self.stale.resize(blocks, false);
        for &(block, _) in listed {
            self.stale[block as usize] = self.revisions[block as usize] != now;
        }
        let blocks = self.positions.par_iter_mut().zip(&mut self.revisions).zip(&mut self.stale).enumerate();
        blocks.with_min_len(64).filter(|(_, (_, stale))| **stale).for_each(
            |(block, ((positions, revision), stale))| {
                *positions = scene.polyline(block as u32);
                *revision = if scene.shafts.block_after(block as u32).is_some() { now } else { 0 };
                *stale = false;
            },
        );
    }
}

impl Places {
    /// Forgets where a block and the one before it were, whose end it may have been.
    fn forget(&mut self, block: u32, shafts: &Shafts) {
        for block in [Some(block), shafts.block_before(block)].into_iter().flatten() {
            if let Some(revision) = self.revisions.get_mut(block as usize) {
                *revision = 0;
            }
        }
    }
}

impl ShaftIndex {
    /// Puts the index into a model for mechanisms that look `reach` far (µm); the farthest counts, and one that wants
    /// to look at everything. Returns whether there is anything to be found: an axon alone has no neighbours, and gets no index.
    pub fn install(model: &mut ModelBuilder, reach: f64, search: Search) -> bool {
        if model.world.resource::<Shafts>().count() < 2 {
            let mut plan = model.plan();
            if !plan.parts.iter().any(|part| part.name == PART) {
                plan.leave_out(PART, "an axon alone has no neighbours");
            }
            return false;
        }
        match model.world.get_resource_mut::<ShaftIndex>() {
            Some(mut index) => {
                index.reach = index.reach.max(reach);
                index.search = if search == Search::All { search } else { index.search };
            }
            None => {
                tell(model, reach);
                model.world.resource_mut::<Shafts>().watch();
                model.insert(ShaftIndex { search, reach, ..ShaftIndex::default() });
                model.phase(Phase::Neighbours, index_new_vertices);
            }
        }
        true
    }

    /// Calls `act` for each cone with all segments that may lie within `reach` of it, those of its own shaft included, and
    /// returns what it makes of them, in the order of the cones. The order of segments is that of their vertices; `S` is what a
    /// thread works with.
    pub fn for_each<S: Default + Send, T: Send>(
        &mut self,
        scene: &ShaftScene,
        cones: &[Asking],
        act: impl Fn(&mut S, &Asking, &Segments<2>) -> T + Sync,
    ) -> Vec<T> {
        let side = SIDE * self.reach;
        let mut order: Vec<(Square, u32)> =
            cones.iter().zip(0..).map(|(cone, i)| (square(scene.reference(cone.site), side), i)).collect();
        order.sort_unstable();
        self.prepare(scene, &order);
        let groups: Vec<&[(Square, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        let (columns, workplaces) = (Pool::<(Segments<2>, Vec<Part>)>::default(), Pool::<S>::default());
        let serve = |segments: &Segments<2>, part: &[(Square, u32)]| -> Vec<(u32, T)> {
            let each = |work: &mut S| part.iter().map(|&(_, i)| (i, act(work, &cones[i as usize], segments))).collect();
            workplaces.lend(each)
        };
        let serve_group = |group: &&[(Square, u32)]| -> Vec<(u32, T)> {
            columns.lend(|columns| {
                self.gather(scene, group, cones, columns);
                let segments = &columns.0;
                group.par_chunks(SHARED).with_max_len(1).map(|part| serve(segments, part)).flatten_iter().collect()
            })
        };
        let mut found: Vec<(u32, T)> = groups.par_iter().with_max_len(1).map(serve_group).flatten_iter().collect();
        found.sort_unstable_by_key(|(i, _)| *i);
        found.into_iter().map(|(_, value)| value).collect()
    }

    /// Makes sure that there is a valid list for each square in use, and for no other.
    fn prepare(&mut self, scene: &ShaftScene, order: &[(Square, u32)]) {
        let needed = self.reach * scene.configuration.inverse_stretch(&scene.tissue.mesh);
        if needed > self.radius {
            self.radius = needed * if scene.configuration.moves { ROOM } else { 1.0 };
            self.lists.clear();
        }
        if self.search == Search::All {
            return self.name_everything(scene, order);
        }
        self.lists.retain(|square, _| order.binary_search_by_key(square, |(other, _)| *other).is_ok());
        let mut missing: Vec<Square> = order.iter().map(|(square, _)| *square).collect();
        missing.dedup();
        missing.retain(|square| !self.lists.contains_key(square));
        let margin = self.radius + scene.shafts.longest;
        let side = SIDE * self.reach;
        let made: Vec<_> = missing.into_par_iter().map(|at| (at, ask(&self.tree, at, side, margin))).collect();
        self.lists.extend(made);
        self.places.bring_up_to_date(scene, self.lists.values().flatten());
    }

    /// One list of all vertices for each square in use: no cone is spared anything.
    fn name_everything(&mut self, scene: &ShaftScene, order: &[(Square, u32)]) {
        let all = |used: usize| if used == BLOCK { u16::MAX } else { (1 << used) - 1 };
        let blocks = 0..scene.shafts.block_count() as u32;
        let list: Vec<Part> = blocks.map(|block| (block, all(scene.shafts.block_vertices(block).len()))).collect();
        self.places.bring_up_to_date(scene, list.iter());
        self.lists = order.chunk_by(|a, b| a.0 == b.0).map(|group| (group[0].0, list.clone())).collect();
    }

    /// The segments of a square's list that come near any cone of a group.
    fn gather(
        &self,
        scene: &ShaftScene,
        group: &[(Square, u32)],
        cones: &[Asking],
        columns: &mut (Segments<2>, Vec<Part>),
    ) {
        let positions = || group.iter().map(|(_, i)| cones[*i as usize].position.xy());
        let low = positions().fold(Vector2::repeat(f64::INFINITY), |m, x| m.inf(&x)).add_scalar(-self.reach);
        let high = positions().fold(Vector2::repeat(f64::NEG_INFINITY), |m, x| m.sup(&x)).add_scalar(self.reach);
        let list = &self.lists[&group[0].0];
        let (segments, met) = columns;
        segments.clear();
        let near = match self.search {
            Search::All => list,
            Search::Tree => {
                meeting(&self.places.positions, list, [low, high], met);
                &*met
            }
        };
        for &(block, vertices) in near {
            let ([x, y], owner) = (&self.places.positions[block as usize], scene.shafts.block_owner(block));
            let kind = u32::from(scene.populations.0[owner as usize]);
            let mut rest = vertices;
            while rest != 0 {
                let i = rest.trailing_zeros() as usize;
                segments.push([x[i], y[i]], [x[i + 1], y[i + 1]], (owner, kind));
                rest &= rest - 1;
            }
        }
    }

    fn add(&mut self, vertex: VertexId, at: [f64; 2], longest: f64) {
        self.tree.insert(Entry::new(at, vertex));
        self.each_list_near(at, longest, |list| name(list, vertex));
    }

    fn forget(&mut self, vertex: VertexId, at: [f64; 2], longest: f64) {
        self.tree.remove(&Entry::new(at, vertex));
        self.each_list_near(at, longest, |list| unname(list, vertex));
    }

    /// The lists of all squares that a vertex with reference position `at` may be near to.
    fn each_list_near(&mut self, at: [f64; 2], longest: f64, mut act: impl FnMut(&mut Vec<Part>)) {
        let side = SIDE * self.reach;
        let margin = self.radius + longest;
        let low = square(Vector3::new(at[0] - margin, at[1] - margin, 0.0), side);
        let high = square(Vector3::new(at[0] + margin, at[1] + margin, 0.0), side);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                if let Some(list) = self.lists.get_mut(&[x, y]) {
                    act(list);
                }
            }
        }
    }
}

/// Room in the nodes of the tree over what stands in them. Ours, measured.
const SLACK: f64 = 1.5;

/// Says what the index holds and what looking `reach` far (µm) costs.
fn tell(model: &mut ModelBuilder, reach: f64) {
    let block = size_of::<Line>() + size_of::<u64>() + size_of::<bool>();
    let bytes = SLACK * size_of::<RTreeNode<Entry>>() as f64 + block as f64 / BLOCK as f64;
    let looked_at = if model.world.resource::<Configuration>().moves {
        model.world.resource::<Tissue>().mesh.cell_count() as f64
    } else {
        0.0
    };
    let even = evenly_spread(model.world, reach);
    let mut plan = model.plan();
    plan.hold(PART, bytes, Each::ShaftVertex);
    plan.work(PART, Work::Indexed, 1.0, Each::ShaftVertex);
    plan.work(PART, Work::DeformedCell, looked_at, Each::Stage);
    plan.work(PART, Work::Neighbourhood, 1.0, Each::ConeStage);
    plan.work(PART, Work::EvenSegment, even, Each::ConeStage);
}

/// Segments within a square of half side `reach` (µm) about a cone, if half of the axons had gone before it and were evenly spread
/// over the longer side of the box of all births, widened by the reach.
fn evenly_spread(world: &mut World, reach: f64) -> f64 {
    let mut origins = world.query::<&Origin>();
    let tissue = world.resource::<Tissue>();
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for origin in origins.iter(world) {
        let at = tissue.reference_position(origin.site);
        (low, high) = (low.inf(&at), high.sup(&at));
    }
    let shafts = world.resource::<Shafts>();
    let width = (high - low).max().max(0.0) + 2.0 * reach;
    0.5 * shafts.count() as f64 / width * (2.0 * reach).powi(2) / shafts.mean_segment()
}

/// Puts a vertex into a list.
fn name(list: &mut Vec<Part>, vertex: VertexId) {
    let (block, bit) = (vertex / BLOCK as u32, 1 << (vertex as usize % BLOCK));
    match list.binary_search_by_key(&block, |(other, _)| *other) {
        Ok(at) => list[at].1 |= bit,
        Err(at) => list.insert(at, (block, bit)),
    }
}

/// Takes a vertex out of a list.
fn unname(list: &mut Vec<Part>, vertex: VertexId) {
    let (block, bit) = (vertex / BLOCK as u32, 1 << (vertex as usize % BLOCK));
    if let Ok(at) = list.binary_search_by_key(&block, |(other, _)| *other) {
        list[at].1 &= !bit;
        if list[at].1 == 0 {
            list.remove(at);
        }
    }
}

fn square(x: Vector3<f64>, side: f64) -> Square {
    [(x.x / side).floor() as i32, (x.y / side).floor() as i32]
}

/// All vertices within a margin of a square, ascending.
fn ask(tree: &RTree<Entry>, [x, y]: Square, side: f64, margin: f64) -> Vec<Part> {
    let low = [f64::from(x) * side - margin, f64::from(y) * side - margin];
    let high = [f64::from(x + 1) * side + margin, f64::from(y + 1) * side + margin];
    let near = tree.locate_in_envelope_intersecting(AABB::from_corners(low, high));
    let mut vertices: Vec<VertexId> = near.map(|entry| entry.data).collect();
    vertices.sort_unstable();
    let mut list = Vec::new();
    vertices.into_iter().for_each(|vertex| name(&mut list, vertex));
    list
}

/// Tissue, configuration and shafts together: what turns material segments into places.
#[derive(SystemParam)]
pub struct ShaftScene<'w> {
    /// The tissue.
    pub tissue: Res<'w, Tissue>,
    /// Its configuration.
    pub configuration: Res<'w, Configuration>,
    /// The shafts.
    pub shafts: Res<'w, Shafts>,
    /// The population of each of them: the kind by which they adhere.
    pub populations: Res<'w, ShaftPopulations>,
}

impl ShaftScene<'_> {
    fn reference(&self, site: Site) -> Vector3<f64> {
        self.tissue.reference_position(site)
    }

    /// Position of a material point now (µm).
    #[inline]
    fn position(&self, point: MaterialPoint<2>) -> [f64; 2] {
        point.position(&self.tissue.mesh, &self.configuration.coordinates)
    }

    /// Positions now (µm) of a block's vertices and of the point after them; zeros for vertices not yet stored.
    fn polyline(&self, block: u32) -> Line {
        let mut positions = [[0.0; BLOCK + 1]; 2];
        let vertices = self.shafts.block_vertices(block);
        let after = match self.shafts.block_after(block) {
            Some(next) => self.shafts.point(self.shafts.block_vertices(next).start),
            None => self.shafts.tip(self.shafts.block_owner(block)),
        };
        let points = vertices.map(|vertex| self.shafts.point(vertex)).chain([after]);
        for (i, point) in points.enumerate() {
            [positions[0][i], positions[1][i]] = self.position(point);
        }
        positions
    }
}

fn index_new_vertices(
    tissue: Res<Tissue>,
    mut shafts: ResMut<Shafts>,
    mut index: ResMut<ShaftIndex>,
    mut counters: ResMut<Counters>,
) {
    for Struck { vertex, point } in shafts.take_struck() {
        let at = tissue.reference_position(point.into());
        index.forget(vertex, [at.x, at.y], shafts.longest);
        index.places.forget(vertex / BLOCK as u32, &shafts);
    }
    for vertex in shafts.take_laid() {
        let at = tissue.reference_position(shafts.point(vertex).into());
        index.add(vertex, [at.x, at.y], shafts.longest);
        counters.indexed_segments += 1;
    }
}
