//! Provider: what lies near a growth cone.
//!
//! Shafts are indexed in the *reference* configuration, where stored vertices never move, so that the index only ever grows. Each
//! shaft segment stands in it as its first vertex; a segment is at most `Shafts::longest` long, so a ball of radius
//! r‖F⁻¹‖ + longest about a cone holds the first vertices of all segments within the spatial distance r. Segments that
//! end at a live tip need no entry of their own: their end is looked up.
//!
//! Cones that sit in one square of a coarse grid share a list of candidates. With `grid`, every vertex is put into the lists of all
//! squares near it as it is laid. With `tree`, it is put into an R-tree, which is asked when the first cone enters a square, and
//! into the lists that there are. A list names blocks of stored vertices, with a bit for each vertex that may be near. Lists hold
//! more than is near and are sorted; what is not within reach adds exactly nothing, so results are those of looking at every segment of
//! every shaft, to the last bit.

mod asking;
mod expected;
mod places;
mod squares;

pub use asking::Asking;

use crate::model::cones::ConeColumns;
use crate::model::shafts::{BLOCK, Struck};
use crate::numerics::locate::MaterialPoint;
use crate::numerics::polylines::{Part, meeting};
use crate::numerics::segments::Segments;
use crate::prelude::*;
use nalgebra::Vector2;
use places::{Line, Places};
use rayon::prelude::*;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};
use squares::{Listed, Square, Squares, corners, name, part_of, parts_near, square, squares_near, unname};
use std::ops::Range;

type Entry = GeomWithData<[f64; 2], VertexId>;
const _: () = assert!(BLOCK <= u16::BITS as usize);

/// The part of the plan that the index is.
const PART: &str = "shaft index";
/// Side of a square over the reach.
const SIDE: f64 = 3.0;
/// Room for ‖F⁻¹‖ to grow before lists are made anew.
const ROOM: f64 = 1.05;
/// Vertices of the tissue that are asked for about a cone: those of the cells that some hundred vertices of shafts lie in. Ours.
const ABOUT_A_CONE: usize = 256;
/// Cones that are served together: few enough for what they look at to stay in the processor's caches, many enough that little is
/// looked at by two batches.
const BATCH: usize = 4096;
/// Batches that are served at a time, in parallel.
const BATCHES: usize = 64;
/// Cones that one task serves: few enough to spread a crowded square over threads.
const TASK: usize = 32;

/// How the shafts near a growth cone are found. Results do not depend on it, to the last bit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// By a grid that every piece of a shaft is put into as it is laid.
    #[default]
    Grid,
    /// By an R-tree that is asked where cones come.
    Tree,
    /// By looking at every segment of every shaft: slow, and there to be compared with.
    All,
}

/// Where a cone that asks sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Seat {
    square: Square,
    /// Its place among all cones.
    cone: u32,
    /// The bit of the part of the square.
    part: u16,
}

impl Seat {
    fn shares_square(&self, other: &Self) -> bool {
        self.square == other.square
    }
}

/// Cones in one square that are served by one task.
struct Group<'a> {
    task: usize,
    seats: &'a [Seat],
    /// Where among the [noted](Places::noted) parts is what may be near them.
    near: Range<usize>,
}

/// What a thread works on: cones that ask, segments about them, the parts that these are of, and what a mechanism needs.
type Desk<S> = (Vec<Asking>, Segments<2>, Vec<Part>, S);

/// The neighbour index over all shaft segments.
#[derive(Debug, Resource, Default)]
pub struct ShaftIndex {
    tree: RTree<Entry>,
    search: Search,
    reach: f64,
    /// The longest segment (µm, reference).
    longest: f64,
    radius: f64,
    squares: Squares,
    everything: Vec<Listed>,
    places: Places,
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
                index.search = index.search.max(search);
            }
            None => {
                expected::tell(model, reach, search);
                let mut shafts = model.world.resource_mut::<Shafts>();
                shafts.watch();
                let longest = shafts.longest;
                model.world.resource_mut::<Configuration>().looks_at_more(ABOUT_A_CONE);
                model.insert(ShaftIndex { search, reach, longest, ..ShaftIndex::default() });
                model.phase(Phase::Neighbours, index_new_vertices).rebuild(index_again);
            }
        }
        true
    }

    /// Calls `act` for each growing cone with all segments that may lie within `reach` of it, those of its own shaft included, and
    /// `write` with what it makes of them; returns the number of cones. The order of segments is that of their vertices; `S` is what a
    /// thread works with.
    pub fn for_each<S: Default + Send, T: Send>(
        &mut self,
        scene: &ShaftScene,
        cones: &mut Cones,
        act: impl Fn(&mut S, &Asking, &Segments<2>) -> T + Sync,
        write: impl Fn(&mut Spring, T),
    ) -> usize {
        let side = self.side();
        let mut order = cones.collect(|cone, _| {
            let at = scene.reference(cone.site);
            Seat { square: square(at, side), part: part_of(at, side), cone: cone.index as u32 }
        });
        order.par_sort_unstable();
        self.prepare(scene, &order);
        let mut places = std::mem::take(&mut self.places);
        for round in order.chunks(BATCHES * BATCH) {
            let columns = cones.columns();
            let serve = |places: &mut Places, batch: &[Seat]| self.serve((scene, &columns), batch, places, &act);
            // Where there is one batch only, its work memory lasts.
            let (first, others) = round.split_at(round.len().min(BATCH));
            let others = others.par_chunks(BATCH).map_init(Places::default, serve);
            let (first, others) = rayon::join(|| serve(&mut places, first), || others.collect::<Vec<_>>());
            cones.apply_at(first.into_iter().chain(others.into_iter().flatten()), &write);
        }
        self.places = places;
        order.len()
    }

    /// Side of a square (µm, reference): no shorter than a segment, which would lie in too many.
    fn side(&self) -> f64 {
        (SIDE * self.reach).max(self.longest)
    }

    /// Makes sure that there is a valid list for each square in use.
    fn prepare(&mut self, scene: &ShaftScene, order: &[Seat]) {
        let needed = self.reach * scene.configuration.inverse_stretch(&scene.tissue.mesh);
        if needed > self.radius {
            self.radius = needed * if scene.configuration.moves { ROOM } else { 1.0 };
            self.begin_anew(scene);
        }
        match self.search {
            Search::All => self.list_everything(scene),
            Search::Tree => self.ask_for_missing(order, scene.shafts.longest),
            Search::Grid => {}
        }
    }

    /// What `act` makes of what is near the cones of a batch, with their places among all cones.
    fn serve<S: Default + Send, T: Send>(
        &self,
        (scene, columns): (&ShaftScene, &ConeColumns),
        batch: &[Seat],
        places: &mut Places,
        act: &(impl Fn(&mut S, &Asking, &Segments<2>) -> T + Sync),
    ) -> Vec<(usize, T)> {
        let groups = self.place(scene, batch, places);
        let places = &*places;
        let serve = |(asking, segments, met, work): &mut Desk<S>, task: &[Group]| -> Vec<_> {
            let mut found = Vec::with_capacity(TASK);
            for group in task {
                asking.clear();
                asking.extend(group.seats.iter().map(|&Seat { cone, .. }| {
                    let (population, bearing) = (scene.populations.0[cone as usize], columns.bearing(cone as usize));
                    Asking::new(cone, population, bearing)
                }));
                self.gather((places, &group.near), asking, (segments, met));
                found.extend(asking.iter().map(|cone| (cone.index as usize, act(work, cone, segments))));
            }
            found
        };
        let tasks = groups.par_chunk_by(|a, b| a.task == b.task).map_init(Default::default, serve);
        let tasks: Vec<Vec<(usize, T)>> = tasks.collect();
        tasks.into_iter().flatten().collect()
    }

    /// Finds where everything is that a batch looks at; returns its cones in groups, each with its share of that.
    fn place<'a>(&self, scene: &ShaftScene, batch: &'a [Seat], places: &mut Places) -> Vec<Group<'a>> {
        places.begin(scene);
        let everything = (self.search == Search::All).then(|| places.note(listed(&self.everything, u16::MAX)));
        let mut groups = Vec::with_capacity(batch.len());
        for (task, seats) in batch.chunks(TASK).enumerate() {
            for seats in seats.chunk_by(Seat::shares_square) {
                let near = everything.clone().unwrap_or_else(|| {
                    let parts = seats.iter().fold(0, |parts, seat| parts | seat.part);
                    places.note(listed(self.squares.get(seats[0].square).unwrap_or_default(), parts))
                });
                groups.push(Group { task, seats, near });
            }
        }
        places.find(scene);
        groups
    }

    /// One list of all vertices: no cone is spared anything.
    fn list_everything(&mut self, scene: &ShaftScene) {
        let all = |used: usize| ((1u32 << used) - 1) as u16;
        let listed = |block| {
            let vertices = all(scene.shafts.block_vertices(block).len());
            Listed { block, vertices, parts: u16::MAX }
        };
        let blocks = (0..scene.shafts.block_count() as u32).map(listed);
        self.everything = blocks.filter(|listed| listed.vertices != 0).collect();
    }

    /// Makes lists for another radius.
    fn begin_anew(&mut self, scene: &ShaftScene) {
        self.squares.clear();
        if self.search == Search::Grid {
            let shafts = &scene.shafts;
            let blocks = 0..shafts.block_count() as u32;
            let all: Vec<VertexId> = blocks.flat_map(|block| shafts.block_vertices(block)).collect();
            let placed = placed(&scene.tissue, shafts, &all);
            self.squares.put(&placed, self.radius + shafts.longest, self.side());
        }
    }

    /// Asks the tree for the lists of squares that cones have come to.
    fn ask_for_missing(&mut self, order: &[Seat], longest: f64) {
        let (side, margin) = (self.side(), self.radius + longest);
        let groups: Vec<Square> = order.chunk_by(Seat::shares_square).map(|group| group[0].square).collect();
        let missing = groups.into_par_iter().filter(|&square| self.squares.get(square).is_none());
        let made: Vec<_> = missing.map(|square| (square, ask(&self.tree, square, margin, side))).collect();
        made.into_iter().for_each(|(square, list)| *self.squares.make(square) = list);
    }

    /// The segments of what may be near that come near any of some cones.
    fn gather(
        &self,
        (places, near): (&Places, &Range<usize>),
        cones: &[Asking],
        (segments, met): (&mut Segments<2>, &mut Vec<Part>),
    ) {
        let positions = || cones.iter().map(|cone| cone.position.xy());
        let low = positions().fold(Vector2::repeat(f64::INFINITY), |m, x| m.inf(&x)).add_scalar(-self.reach);
        let high = positions().fold(Vector2::repeat(f64::NEG_INFINITY), |m, x| m.sup(&x)).add_scalar(self.reach);
        let near = places.noted(near).iter().copied();
        segments.clear();
        match self.search {
            Search::All => {
                met.clear();
                met.extend(near);
            }
            Search::Grid | Search::Tree => meeting(places.lines(), near, [low, high], met),
        }
        for &(number, vertices) in met.iter() {
            let [x, y] = &places.lines()[number as usize];
            let owner = places.owner(number);
            let mut rest = vertices;
            while rest != 0 {
                let i = rest.trailing_zeros() as usize;
                segments.push([x[i], y[i]], [x[i + 1], y[i + 1]], owner);
                rest &= rest - 1;
            }
        }
    }

    /// Adds vertices at reference positions (µm).
    fn add(&mut self, vertices: &[(VertexId, [f64; 2])], longest: f64) {
        let (margin, side) = (self.radius + longest, self.side());
        match self.search {
            Search::All => {}
            Search::Grid => self.squares.put(vertices, margin, side),
            Search::Tree => {
                for &(vertex, at) in vertices {
                    self.tree.insert(Entry::new(at, vertex));
                    for (square, parts) in squares_near(at, margin, side) {
                        if let Some(list) = self.squares.get_mut(square) {
                            name(list, vertex, parts);
                        }
                    }
                }
            }
        }
    }

    fn forget(&mut self, vertex: VertexId, at: [f64; 2], longest: f64) {
        if self.search == Search::Tree {
            self.tree.remove(&Entry::new(at, vertex));
        }
        for (square, _) in squares_near(at, self.radius + longest, self.side()) {
            if let Some(list) = self.squares.get_mut(square) {
                unname(list, vertex);
            }
        }
    }
}

/// Blocks of a list that may be near to some parts of its square, with the vertices that are meant.
fn listed(list: &[Listed], parts: u16) -> impl Iterator<Item = Part> + '_ {
    list.iter().filter(move |listed| listed.parts & parts != 0).map(|listed| (listed.block, listed.vertices))
}

/// All vertices within a margin of a square, ascending.
fn ask(tree: &RTree<Entry>, square: Square, margin: f64, side: f64) -> Vec<Listed> {
    let [low, high] = corners(square, side);
    let envelope = AABB::from_corners(low.map(|x| x - margin), high.map(|x| x + margin));
    let mut near: Vec<_> =
        tree.locate_in_envelope_intersecting(envelope).map(|entry| (entry.data, *entry.geom())).collect();
    near.sort_unstable_by_key(|(vertex, _)| *vertex);
    let mut list = Vec::new();
    for (vertex, at) in near {
        // Those in the corners of the envelope are near to no part.
        match parts_near(low, at, margin, side) {
            0 => {}
            parts => name(&mut list, vertex, parts),
        }
    }
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
    /// Reference position of a site (µm).
    fn reference(&self, site: Site) -> [f64; 2] {
        site.planar().position(&self.tissue.mesh, self.tissue.mesh.vertices())
    }

    /// Position of a material point now (µm).
    #[inline]
    fn position(&self, point: MaterialPoint<2>) -> [f64; 2] {
        self.configuration.place(&self.tissue.mesh, point)
    }

    /// Positions now (µm) of a block's vertices and of the point after them; zeros for vertices not yet stored.
    fn polyline(&self, block: u32, after: MaterialPoint<2>) -> Line {
        let mut positions = [[0.0; BLOCK + 1]; 2];
        for (i, point) in self.shafts.block_points(block).chain([after]).enumerate() {
            [positions[0][i], positions[1][i]] = self.position(point);
        }
        positions
    }
}

/// Fills the index of a run that is resumed with what it held.
fn index_again(world: &mut World) {
    world.resource_scope::<ShaftIndex, _>(|world, mut index| {
        let (tissue, shafts) = (world.resource::<Tissue>(), world.resource::<Shafts>());
        index.add(&placed(tissue, shafts, &shafts.taken().collect::<Vec<_>>()), shafts.longest);
    });
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
    }
    let laid = shafts.take_laid();
    index.add(&placed(&tissue, &shafts, &laid), shafts.longest);
    counters.indexed_segments += laid.len() as u64;
}

/// Vertices with their reference positions (µm).
fn placed(tissue: &Tissue, shafts: &Shafts, vertices: &[VertexId]) -> Vec<(VertexId, [f64; 2])> {
    let place = |&vertex: &VertexId| {
        let at = tissue.reference_position(shafts.point(vertex).into());
        (vertex, [at.x, at.y])
    };
    vertices.par_iter().with_min_len(TASK).map(place).collect()
}
