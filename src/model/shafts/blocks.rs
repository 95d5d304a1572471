//! Blocks of stored vertices, in pages of shafts that follow each other in order.
//!
//! Shafts are numbered along where they begin, so that those of one page lie near each other in the tissue. Were blocks to lie in the
//! order in which they are begun, what a cone looks at would lie all over the memory once there are many axons.

use super::{BLOCK, NONE};
use crate::kept;
use crate::model::components::Site;
use crate::numerics::locate::MaterialPoint;

/// Shafts that share pages.
const SHAFTS: usize = 64;
/// Blocks a page.
const PAGE: u32 = 16;

/// Consecutive vertices of one shaft.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Block {
    weights: [[f64; 2]; BLOCK],
    cells: [u32; BLOCK],
    times: [f32; BLOCK],
    /// The shaft.
    pub owner: u32,
    /// The block in which it goes on, if any.
    pub next: u32,
    /// The block from which it comes, if any.
    pub before: u32,
    /// A bit for each vertex that has been laid and not yet been taken as laid.
    pub fresh: u16,
    /// Vertices stored.
    pub used: u8,
}

kept! { struct Block { weights, cells, times, owner, next, before, fresh, used } }

impl Block {
    /// Bytes that a block takes.
    pub const BYTES: usize = size_of::<Self>();

    /// A block that belongs to no shaft yet.
    fn unused() -> Self {
        Self {
            weights: [[0.0; 2]; BLOCK],
            cells: [0; BLOCK],
            times: [0.0; BLOCK],
            owner: NONE,
            next: NONE,
            before: NONE,
            fresh: 0,
            used: 0,
        }
    }

    /// Whether no vertex more has room.
    pub fn is_full(&self) -> bool {
        usize::from(self.used) == BLOCK
    }

    /// Puts a vertex at the end and returns its place in the block.
    pub fn push(&mut self, site: Site, time: f32) -> usize {
        let place = usize::from(self.used);
        self.cells[place] = site.cell;
        self.times[place] = time;
        self.weights[place] = site.weights;
        self.used += 1;
        place
    }

    /// Material point of the vertex at a place.
    #[inline]
    pub fn point(&self, place: usize) -> MaterialPoint<2> {
        MaterialPoint { cell: self.cells[place], weights: self.weights[place] }
    }

    /// Material points of the stored vertices.
    #[inline]
    pub fn points(&self) -> impl Iterator<Item = MaterialPoint<2>> + '_ {
        (0..usize::from(self.used)).map(|place| self.point(place))
    }

    /// Time (h) of the vertex at a place.
    pub fn time(&self, place: usize) -> f32 {
        self.times[place]
    }

    /// Whether all cells are below a number.
    pub fn lies_in(&self, cells: usize) -> bool {
        self.cells.iter().all(|&cell| (cell as usize) < cells)
    }
}

/// What is left of the page of some shafts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Page {
    next: u32,
    left: u32,
}

kept! { struct Page { next, left } }

/// The blocks of all shafts.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    all: Vec<Block>,
    pages: Vec<Page>,
}

kept! { struct Blocks { all, pages } }

impl Blocks {
    /// No block, for `shafts` shafts.
    pub fn new(shafts: usize) -> Self {
        Self { all: Vec::new(), pages: vec![Page::default(); shafts.div_ceil(SHAFTS)] }
    }

    /// Blocks, those of pages that no shaft has taken yet among them.
    pub fn all(&self) -> &[Block] {
        &self.all
    }

    /// A block.
    #[inline]
    pub fn get(&self, block: u32) -> &Block {
        &self.all[block as usize]
    }

    /// A block, to be changed.
    pub fn get_mut(&mut self, block: u32) -> &mut Block {
        &mut self.all[block as usize]
    }

    /// Begins a block of a shaft after another, if any.
    pub fn begin(&mut self, shaft: usize, before: u32) -> u32 {
        let page = &mut self.pages[shaft / SHAFTS];
        if page.left == 0 {
            *page = Page { next: self.all.len() as u32, left: PAGE };
            self.all.resize(self.all.len() + PAGE as usize, Block::unused());
        }
        let block = page.next;
        *page = Page { next: block + 1, left: page.left - 1 };
        let begun = &mut self.all[block as usize];
        (begun.owner, begun.before) = (shaft as u32, before);
        if before != NONE {
            self.all[before as usize].next = block;
        }
        block
    }

    /// Whether pages are those of `shafts` shafts, and lead to blocks that nobody has, each to its own.
    pub fn pages_are_free(&self, shafts: usize) -> bool {
        let mut promised = vec![false; self.all.len()];
        let mut left = self.pages.iter().flat_map(|page| (0..page.left).map(|i| u64::from(page.next) + u64::from(i)));
        let free = left.all(|block| {
            let is_free = self.all.get(block as usize).is_some_and(|block| block.used == 0 && block.owner == NONE);
            is_free && !std::mem::replace(&mut promised[block as usize], true)
        });
        free && self.pages.len() == shafts.div_ceil(SHAFTS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shafts_that_follow_each_other_share_pages_however_their_blocks_are_begun() {
        let mut blocks = Blocks::new(200);
        // Three groups in turn, as axons grow at the same time.
        let begun: Vec<[u32; 3]> =
            (0..20).map(|i| [i, 64 + i, 130 + i].map(|shaft| blocks.begin(shaft as usize, NONE))).collect();
        for group in 0..3 {
            let own: Vec<u32> = begun.iter().map(|blocks| blocks[group]).collect();
            assert!(own[..16].windows(2).all(|pair| pair[1] == pair[0] + 1), "{own:?}");
            assert!(own[16..].windows(2).all(|pair| pair[1] == pair[0] + 1), "{own:?}");
        }
        let next = blocks.begin(0, begun[0][0]);
        assert_eq!((blocks.get(begun[0][0]).next, blocks.get(next).before), (next, begun[0][0]));
        assert!(blocks.pages_are_free(200) && !blocks.pages_are_free(300));
        blocks.pages[1].next -= 1;
        assert!(!blocks.pages_are_free(200));
    }

    #[test]
    fn a_block_takes_208_bytes() {
        assert_eq!(Block::BYTES, 208);
    }
}
