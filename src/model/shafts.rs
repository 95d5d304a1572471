//! The shafts Γ: polylines of material points, one for each growth cone, from the origin to the tip.
//!
//! A vertex is stored where the path bends: the stored polyline stays within a tolerance of every point the cone has
//! passed (in the reference configuration). Vertices never move once stored, whatever the tissue does, since they are
//! material. They lie in blocks of a fixed number; blocks are linked shaft by shaft, so that a shaft can
//! grow without moving others and parts can later be struck out. A planar vertex takes 24 bytes.

mod blocks;
mod sound;

use super::components::Site;
use super::open_end::OpenEnd;
use crate::kept;
use crate::numerics::locate::MaterialPoint;
use bevy_ecs::prelude::Resource;
use blocks::{Block, Blocks};
use rayon::prelude::*;

/// Vertices a block.
pub const BLOCK: usize = 8;
/// Shafts that one task extends.
const SHAFTS_A_TASK: usize = 256;
const NONE: u32 = u32::MAX;

/// Number of a stored vertex: its place among those that all blocks have room for.
pub type VertexId = u32;

/// A site and its reference position (µm).
type Placed = (Site, [f64; 2]);

/// What follows a stored vertex along its shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Successor {
    /// Another stored vertex.
    Vertex(VertexId),
    /// The live tip of the shaft.
    Tip(u32),
}

/// The head of a shaft: its first and last block, its tip in pieces that leave no gaps, and what may follow it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Chain {
    first: u32,
    last: u32,
    tip_cell: u32,
    tip_time: f32,
    tip_weights: [f64; 2],
    end: OpenEnd,
}

kept! { struct Chain { first, last, tip_cell, tip_time, tip_weights, end } }

impl Chain {
    /// Of a shaft that has not begun.
    const EMPTY: Self =
        Self { first: NONE, last: NONE, tip_cell: 0, tip_time: 0.0, tip_weights: [0.0; 2], end: OpenEnd::NONE };

    fn tip(&self) -> Site {
        Site { cell: self.tip_cell, weights: self.tip_weights }
    }

    /// Moves the tip on, unless a vertex has to be stored first; returns whether it did. `limits` are the tolerance and the longest segment.
    fn reach(&mut self, (site, at): Placed, time: f64, limits: (f64, f64)) -> bool {
        let Some(end) = self.end.widened(at, limits.0, limits.1) else { return false };
        self.end = end;
        self.put_tip(site, time as f32);
        true
    }

    fn put_tip(&mut self, site: Site, time: f32) {
        (self.tip_cell, self.tip_weights, self.tip_time) = (site.cell, site.weights, time);
    }
}

/// The bit of a vertex among those of its block.
fn bit(vertex: VertexId) -> u16 {
    1 << (vertex as usize % BLOCK)
}

/// All shafts of a run.
#[derive(Debug, Clone, Resource)]
pub struct Shafts {
    /// Largest distance between the stored polyline and the true path (µm, reference configuration).
    pub tolerance: f64,
    /// Longest stored segment (µm, reference configuration).
    pub longest: f64,
    blocks: Blocks,
    chains: Vec<Chain>,
    watched: bool,
    laid: Vec<VertexId>,
    struck: Vec<Struck>,
}

kept! { struct Shafts { tolerance, longest, blocks, chains, watched, laid, struck } }

/// A vertex that is no longer there, and the material point it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Struck {
    /// Its number, which another vertex may have by now.
    pub vertex: VertexId,
    /// Where it was.
    pub point: MaterialPoint<2>,
}

kept! { struct Struck { vertex, point } }

/// Where the tip of a shaft goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Onward {
    /// It stays.
    Nowhere,
    /// To a site, whose reference position (µm) is given too.
    To(Site, [f64; 2]),
    /// Nobody knows.
    Lost,
}

/// A point of a shaft that is laid anew: its site, and when the cone passed it (h).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftPoint {
    /// Material site.
    pub site: Site,
    /// Time (h).
    pub time: f32,
}

kept! { struct ShaftPoint { site, time } }

impl Shafts {
    /// `count` shafts without a point. `tolerance` and `longest` in µm.
    pub fn new(count: usize, tolerance: f64, longest: f64) -> Self {
        Self {
            tolerance,
            longest,
            blocks: Blocks::new(count),
            chains: vec![Chain::EMPTY; count],
            watched: false,
            laid: Vec::new(),
            struck: Vec::new(),
        }
    }

    /// Length of a stored segment to be expected (µm): 0.8 of the longest. Ours, measured.
    pub fn mean_segment(&self) -> f64 {
        0.8 * self.longest
    }

    /// Bytes that a stored vertex takes, with its share of a full block.
    pub fn bytes_a_vertex() -> f64 {
        Block::BYTES as f64 / BLOCK as f64
    }

    /// Bytes of the head of a shaft, which stands ready from the start.
    pub const BYTES_A_HEAD: usize = size_of::<Chain>();

    /// Bytes that a shaft takes besides once it has begun: on average half a block that is not yet full.
    pub fn bytes_a_begun_shaft() -> f64 {
        0.5 * BLOCK as f64 * Self::bytes_a_vertex()
    }

    /// Number of shafts.
    pub fn count(&self) -> usize {
        self.chains.len()
    }

    /// Number of stored vertices.
    pub fn vertex_count(&self) -> usize {
        self.blocks.all().iter().map(|block| usize::from(block.used)).sum()
    }

    /// Number of blocks, those that stand ready without a vertex among them.
    pub fn block_count(&self) -> usize {
        self.blocks.all().len()
    }

    /// The vertices stored in a block, ascending.
    pub fn block_vertices(&self, block: u32) -> std::ops::Range<VertexId> {
        let first = block * BLOCK as u32;
        first..first + u32::from(self.blocks.get(block).used)
    }

    /// The shaft that a block belongs to, and the block in which it goes on.
    #[inline]
    pub fn block_head(&self, block: u32) -> (u32, Option<u32>) {
        let Block { owner, next, .. } = *self.blocks.get(block);
        (owner, Some(next).filter(|&next| next != NONE))
    }

    /// Material points of the vertices stored in a block.
    #[inline]
    pub fn block_points(&self, block: u32) -> impl Iterator<Item = MaterialPoint<2>> + '_ {
        self.blocks.get(block).points()
    }

    /// Starts a shaft at a site, whose reference position is `at` (µm).
    pub fn start(&mut self, shaft: usize, site: Site, at: [f64; 2], time: f64) {
        self.push(shaft, site, time as f32);
        let chain = &mut self.chains[shaft];
        chain.put_tip(site, time as f32);
        chain.end = OpenEnd::at(at);
    }

    /// Moves the tip of a shaft on to a site whose reference position is `at` (µm); stores the former tip when the chord to the
    /// new one would leave the tolerance or grow too long. `reference` is asked for the reference position of the former one then.
    pub fn extend(&mut self, shaft: usize, (site, at): Placed, time: f64, reference: impl FnOnce(Site) -> [f64; 2]) {
        if !self.chains[shaft].reach((site, at), time, (self.tolerance, self.longest)) {
            self.bend(shaft, (site, at), time, reference);
        }
    }

    /// [Extends](Self::extend) each shaft as `next` says from its number, its tip and its own of `with`; returns the first of those that are lost.
    /// In parallel, but for the shafts that store a vertex, which follow in their order.
    pub fn extend_each<T: Send>(
        &mut self,
        time: f64,
        with: &mut [T],
        next: impl Fn(usize, Site, &mut T) -> Onward + Sync,
        reference: impl Fn(Site) -> [f64; 2],
    ) -> Option<usize> {
        let limits = (self.tolerance, self.longest);
        let chains = self.chains.par_iter_mut().zip(with).enumerate().with_min_len(SHAFTS_A_TASK);
        let bent = chains.filter_map(|(shaft, (chain, own))| match next(shaft, chain.tip(), own) {
            Onward::Nowhere => None,
            Onward::Lost => Some((shaft, None)),
            Onward::To(site, at) => (!chain.reach((site, at), time, limits)).then_some((shaft, Some((site, at)))),
        });
        let bent: Vec<(usize, Option<Placed>)> = bent.collect();
        for (shaft, to) in &bent {
            to.iter().for_each(|to| self.bend(*shaft, *to, time, &reference));
        }
        bent.iter().find(|(_, to)| to.is_none()).map(|(shaft, _)| *shaft)
    }

    /// Stores the tip of a shaft, and moves on from there.
    fn bend(&mut self, shaft: usize, (site, at): Placed, time: f64, reference: impl FnOnce(Site) -> [f64; 2]) {
        let chain = self.chains[shaft];
        self.push(shaft, chain.tip(), chain.tip_time);
        let chain_end = OpenEnd::chord(reference(chain.tip()), at, self.tolerance, self.longest);
        let chain = &mut self.chains[shaft];
        chain.end = chain_end;
        chain.put_tip(site, time as f32);
    }

    fn push(&mut self, shaft: usize, site: Site, time: f32) {
        let last = self.chains[shaft].last;
        let full = last == NONE || self.blocks.get(last).is_full();
        let number = if full { self.add_block(shaft) } else { last };
        let block = self.blocks.get_mut(number);
        let vertex = number * BLOCK as u32 + block.push(site, time) as u32;
        if self.watched {
            block.fresh |= bit(vertex);
            self.laid.push(vertex);
        }
    }

    fn add_block(&mut self, shaft: usize) -> u32 {
        let chain = &mut self.chains[shaft];
        let block = self.blocks.begin(shaft, chain.last);
        if chain.last == NONE {
            chain.first = block;
        }
        chain.last = block;
        block
    }

    /// Keeps note of what is laid and struck out from now on, for a neighbour index.
    pub fn watch(&mut self) {
        self.watched = true;
    }

    /// Vertices stored since the last call, in the order they were laid: what a neighbour index has to add.
    pub fn take_laid(&mut self) -> Vec<VertexId> {
        let mut laid = std::mem::take(&mut self.laid);
        // Struck out since then, or laid, struck out and laid again: once is enough.
        laid.retain(|&vertex| self.is_fresh_no_more(vertex));
        laid
    }

    /// Whether a vertex was fresh; it is not from now on.
    fn is_fresh_no_more(&mut self, vertex: VertexId) -> bool {
        let fresh = &mut self.blocks.get_mut(vertex / BLOCK as u32).fresh;
        let was = *fresh & bit(vertex) != 0;
        *fresh &= !bit(vertex);
        was
    }

    /// Vertices that have been taken as laid and still stand, ascending: what an index holds that is up to date with what was taken.
    pub fn taken(&self) -> impl Iterator<Item = VertexId> + '_ {
        let blocks = 0..self.block_count() as u32;
        let stored = blocks.flat_map(|block| self.block_vertices(block));
        stored.filter(|&vertex| self.blocks.get(vertex / BLOCK as u32).fresh & bit(vertex) == 0)
    }

    /// Vertices struck out since the last call that had been taken as laid before: what a neighbour index has to
    /// forget, before it adds what was laid.
    pub fn take_struck(&mut self) -> Vec<Struck> {
        std::mem::take(&mut self.struck)
    }

    /// Strikes out what comes after the first `kept` stored vertices of a shaft (at least one), lays `points` after them, and puts
    /// the tip at `tip`. Consecutive points lie at most [`Self::longest`] apart.
    ///
    /// Nothing happens to a shaft that has not begun.
    pub fn lay_anew(&mut self, shaft: usize, kept: usize, points: &[ShaftPoint], tip: ShaftPoint) {
        let stored = self.vertices(shaft).count();
        if stored == 0 {
            return;
        }
        for _ in kept.max(1)..stored {
            self.strike_last(shaft);
        }
        for point in points {
            self.push(shaft, point.site, point.time);
        }
        self.chains[shaft].put_tip(tip.site, tip.time);
    }

    /// Begins the open end of a shaft anew, from the reference position of its last stored vertex to that of its tip (µm).
    pub fn reopen(&mut self, shaft: usize, last: [f64; 2], tip: [f64; 2]) {
        self.chains[shaft].end = OpenEnd::chord(last, tip, self.tolerance, self.longest);
    }

    fn strike_last(&mut self, shaft: usize) {
        let block = self.chains[shaft].last;
        if block == NONE {
            return;
        }
        let vertex = block * BLOCK as u32 + u32::from(self.blocks.get(block).used) - 1;
        if self.watched && !self.is_fresh_no_more(vertex) {
            self.struck.push(Struck { vertex, point: self.point(vertex) });
        }
        let shortened = self.blocks.get_mut(block);
        shortened.used -= 1;
        if shortened.used == 0 {
            let before = shortened.before;
            let chain = &mut self.chains[shaft];
            chain.last = before;
            match before {
                NONE => chain.first = NONE,
                before => self.blocks.get_mut(before).next = NONE,
            }
        }
    }

    /// The block before a block along its shaft.
    pub fn block_before(&self, block: u32) -> Option<u32> {
        Some(self.blocks.get(block).before).filter(|&before| before != NONE)
    }

    /// The shaft that a stored vertex belongs to.
    #[inline]
    pub fn owner(&self, vertex: VertexId) -> u32 {
        self.blocks.get(vertex / BLOCK as u32).owner
    }

    /// Material point of a stored vertex.
    #[inline]
    pub fn point(&self, vertex: VertexId) -> MaterialPoint<2> {
        self.blocks.get(vertex / BLOCK as u32).point(vertex as usize % BLOCK)
    }

    /// Time (h) at which the cone passed a stored vertex.
    pub fn time(&self, vertex: VertexId) -> f32 {
        self.blocks.get(vertex / BLOCK as u32).time(vertex as usize % BLOCK)
    }

    /// What comes after a stored vertex.
    #[inline]
    pub fn successor(&self, vertex: VertexId) -> Successor {
        let block = self.blocks.get(vertex / BLOCK as u32);
        if (vertex as usize % BLOCK) + 1 < usize::from(block.used) {
            return Successor::Vertex(vertex + 1);
        }
        match block.next {
            NONE => Successor::Tip(block.owner),
            next => Successor::Vertex(next * BLOCK as u32),
        }
    }

    /// The tip of a shaft as it was at the end of the last step.
    #[inline]
    pub fn tip(&self, shaft: u32) -> MaterialPoint<2> {
        self.chains[shaft as usize].tip().planar()
    }

    /// Time (h) at which the cone came to where its tip is, the first time.
    pub fn tip_time(&self, shaft: u32) -> f32 {
        self.chains[shaft as usize].tip_time
    }

    /// The stored vertices of a shaft, from the origin on.
    pub fn vertices(&self, shaft: usize) -> impl Iterator<Item = VertexId> + '_ {
        let mut at = match self.chains[shaft].first {
            NONE => None,
            block => Some(block * BLOCK as u32),
        };
        std::iter::from_fn(move || {
            let here = at?;
            at = match self.successor(here) {
                Successor::Vertex(next) => Some(next),
                Successor::Tip(_) => None,
            };
            Some(here)
        })
    }

    /// The stored vertices of a shaft, from the last one back to the origin.
    pub fn vertices_backwards(&self, shaft: usize) -> impl Iterator<Item = VertexId> + '_ {
        let known = |block: u32| Some(block).filter(|&block| block != NONE);
        let blocks =
            std::iter::successors(known(self.chains[shaft].last), move |&block| known(self.blocks.get(block).before));
        blocks.flat_map(|block| self.block_vertices(block).rev())
    }

    /// All material points of a shaft from the origin to the tip; empty before birth.
    pub fn polyline(&self, shaft: usize) -> Vec<MaterialPoint<2>> {
        let stored = self.vertices(shaft).count();
        let mut points = Vec::with_capacity(stored + usize::from(stored > 0));
        points.extend(self.vertices(shaft).map(|vertex| self.point(vertex)));
        points.extend((stored > 0).then(|| self.tip(shaft as u32)));
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One cell (0,0), (1,0), (0,1): weights are reference coordinates.
    fn site(at: [f64; 2]) -> Site {
        Site { cell: 0, weights: at }
    }

    fn distance_to_polyline(point: [f64; 2], line: &[[f64; 2]]) -> f64 {
        line.windows(2)
            .map(|w| {
                let (d, p) = ([w[1][0] - w[0][0], w[1][1] - w[0][1]], [point[0] - w[0][0], point[1] - w[0][1]]);
                let t = ((d[0] * p[0] + d[1] * p[1]) / (d[0] * d[0] + d[1] * d[1]).max(1e-300)).clamp(0.0, 1.0);
                (p[0] - t * d[0]).hypot(p[1] - t * d[1])
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn grow(path: &[[f64; 2]], tolerance: f64, longest: f64) -> Vec<[f64; 2]> {
        let mut shafts = Shafts::new(2, tolerance, longest);
        shafts.start(1, site(path[0]), path[0], 0.0);
        for (i, &at) in path.iter().enumerate().skip(1) {
            shafts.extend(1, (site(at), at), i as f64, |before| before.weights);
        }
        shafts.polyline(1).iter().map(|p| p.weights).collect()
    }

    #[test]
    fn a_straight_path_keeps_only_its_ends_up_to_the_longest_segment() {
        let path: Vec<_> = (0..=100).map(|i| [0.6 * i as f64, 0.8 * i as f64]).collect();
        assert_eq!(grow(&path, 0.1, 1e9).len(), 2);
        let line = grow(&path, 0.1, 10.0);
        assert_eq!(line.len(), 11);
    }

    #[test]
    fn the_stored_polyline_stays_within_the_tolerance_of_a_winding_path_and_is_far_shorter() {
        let path: Vec<_> = (0..4000)
            .map(|i| {
                let s = 0.05 * i as f64;
                [s, 3.0 * (0.3 * s).sin() + 0.7 * (1.1 * s).cos()]
            })
            .collect();
        for tolerance in [0.05, 0.25, 1.0] {
            let line = grow(&path, tolerance, 20.0);
            let worst = path.iter().map(|&p| distance_to_polyline(p, &line)).fold(0.0, f64::max);
            assert!(worst <= tolerance * (1.0 + 1e-9), "{worst} > {tolerance}");
            assert!(line.len() < path.len() / 10, "{} vertices", line.len());
        }
    }

    #[test]
    fn a_hairpin_is_not_cut_off() {
        let mut path: Vec<[f64; 2]> = (0..=50).map(|i| [0.1 * i as f64, 0.0]).collect();
        path.extend((0..=50).map(|i| [5.0 - 0.1 * i as f64, 0.01]));
        let line = grow(&path, 0.2, 20.0);
        let worst = path.iter().map(|&p| distance_to_polyline(p, &line)).fold(0.0, f64::max);
        assert!(worst <= 0.2, "{worst}");
    }

    #[test]
    fn interleaved_shafts_keep_their_own_order_across_blocks() {
        let mut shafts = Shafts::new(3, 1e-9, 1e9);
        shafts.watch();
        let at = |shaft: usize, i: usize| [i as f64, ((i * (shaft + 1)) as f64).sin()];
        for i in 0..100 {
            for shaft in 0..3 {
                let point = at(shaft, i);
                match i {
                    0 => shafts.start(shaft, site(point), point, 0.0),
                    _ => shafts.extend(shaft, (site(point), point), i as f64, |before| before.weights),
                }
            }
        }
        for shaft in 0..3 {
            let line = shafts.polyline(shaft);
            assert_eq!(line.len(), 100);
            assert!((0..100).all(|i| line[i].weights == at(shaft, i)));
            assert!(shafts.vertices(shaft).all(|v| shafts.owner(v) as usize == shaft));
            let mut backwards: Vec<_> = shafts.vertices_backwards(shaft).collect();
            backwards.reverse();
            assert!(shafts.vertices(shaft).eq(backwards));
        }
        assert_eq!(shafts.take_laid().len(), 3 * 99);
    }

    #[test]
    fn what_is_struck_out_is_told_once_and_what_is_laid_after_it_follows_what_was_kept() {
        let mut shafts = Shafts::new(1, 1e-9, 1e9);
        shafts.watch();
        let at = |i: usize| [i as f64, (i as f64).sin()];
        shafts.start(0, site(at(0)), at(0), 0.0);
        (1..=40).for_each(|i| shafts.extend(0, (site(at(i)), at(i)), i as f64, |before| before.weights));
        assert_eq!(shafts.take_laid().len(), 40);
        let point = |i: usize| ShaftPoint { site: site(at(i)), time: i as f32 };
        shafts.lay_anew(0, 10, &[point(50), point(51)], point(52));
        let struck = shafts.take_struck();
        assert_eq!(struck.len(), 30);
        assert!(struck.iter().enumerate().all(|(k, gone)| gone.point.weights == at(39 - k)));
        assert_eq!(shafts.take_laid().len(), 2);
        let line: Vec<_> = shafts.polyline(0).iter().map(|point| point.weights).collect();
        let expected: Vec<_> = (0..10).chain(50..53).map(at).collect();
        assert_eq!(line, expected);
        // What nobody has heard of yet goes without a word; the first vertex stays.
        shafts.extend(0, (site(at(60)), at(60)), 60.0, |before| before.weights);
        shafts.lay_anew(0, 12, &[], point(5));
        assert!(shafts.take_struck().is_empty() && shafts.take_laid().is_empty());
        shafts.lay_anew(0, 0, &[], point(0));
        assert_eq!((shafts.polyline(0).len(), shafts.vertex_count(), shafts.tip_time(0)), (2, 1, 0.0));
    }

    #[test]
    fn the_head_of_a_shaft_takes_88_bytes() {
        assert_eq!(size_of::<Chain>(), 88);
    }

    #[test]
    fn shafts_extended_together_are_those_extended_one_by_one_and_the_first_lost_one_is_told() {
        let at = |shaft: usize, step: usize| [step as f64, ((step * (shaft + 1)) as f64).sin()];
        let begun = || {
            let mut shafts = Shafts::new(40, 0.05, 6.0);
            (0..40).for_each(|shaft| shafts.start(shaft, site(at(shaft, 0)), at(shaft, 0), 0.0));
            shafts
        };
        let (mut together, mut apart, mut asked) = (begun(), begun(), [0; 40]);
        for step in 1..60 {
            let next = |shaft: usize, tip: Site, own: &mut usize| {
                *own += 1;
                match (shaft, step) {
                    (7, _) => Onward::Nowhere,
                    (9 | 30, 59) => Onward::Lost,
                    _ => {
                        assert_eq!(tip, site(at(shaft, step - 1)));
                        Onward::To(site(at(shaft, step)), at(shaft, step))
                    }
                }
            };
            let lost = together.extend_each(step as f64, &mut asked, next, |before| before.weights);
            assert_eq!(lost, (step == 59).then_some(9));
            for shaft in (0..40).filter(|&shaft| shaft != 7 && (step < 59 || (shaft != 9 && shaft != 30))) {
                apart.extend(shaft, (site(at(shaft, step)), at(shaft, step)), step as f64, |before| before.weights);
            }
        }
        assert!(asked.iter().all(|&times| times == 59));
        assert!((0..40).all(|shaft| together.polyline(shaft) == apart.polyline(shaft)));
        assert!((0..together.block_count() as u32).all(|block| together.block_head(block) == apart.block_head(block)));
    }
}
