//! Where the blocks of shafts are now, each found once for all cones that look at it.
//!
//! Blocks lie in memory in the order in which they were begun, which is none in space. Those that are looked at are found anew at each
//! stage, into an array in the order of those who look: what is near in space is then near in memory.

use super::ShaftScene;
use crate::model::shafts::BLOCK;
use crate::numerics::locate::MaterialPoint;
use crate::numerics::polylines::{Part, Polyline};
use rayon::prelude::*;
use std::ops::Range;

/// Positions now (µm) of a block's vertices, and of the point that the last of them leads to.
pub type Line = Polyline<{ BLOCK + 1 }>;

/// Bytes held for a block: the number of its line. Lines and heads are those of a batch.
pub const BYTES_A_BLOCK: usize = size_of::<u32>();

/// What the shaft of a block is, and where it goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Head {
    shaft: u32,
    kind: u16,
    /// The point after the last of the block's vertices.
    after: MaterialPoint<2>,
}

/// Polylines of the blocks that something looks at.
#[derive(Debug, Default)]
pub struct Places {
    lines: Vec<Line>,
    heads: Vec<Head>,
    /// The block of each line.
    blocks: Vec<u32>,
    /// For each block the number of its line, good if that line is of the block.
    numbers: Vec<u32>,
    /// What was noted: numbers of lines, with the vertices that are meant.
    parts: Vec<Part>,
}

impl Places {
    /// Forgets what was noted.
    pub fn begin(&mut self, scene: &ShaftScene) {
        let blocks = scene.shafts.block_count();
        if self.numbers.len() != blocks {
            // Zeros that the system gives when they are looked at: most never are.
            self.numbers = vec![0; blocks];
        }
        self.blocks.clear();
        self.parts.clear();
    }

    /// Notes that some parts, named by their blocks, are looked at; returns where they stand among all that are noted.
    pub fn note(&mut self, looked_at: impl Iterator<Item = Part>) -> Range<usize> {
        let first = self.parts.len();
        for (block, vertices) in looked_at {
            let number = &mut self.numbers[block as usize];
            if self.blocks.get(*number as usize) != Some(&block) {
                *number = self.blocks.len() as u32;
                self.blocks.push(block);
            }
            self.parts.push((*number, vertices));
        }
        first..self.parts.len()
    }

    /// Finds where the blocks are now that were noted.
    pub fn find(&mut self, scene: &ShaftScene) {
        // By itself, a loop so short that the processor waits for many of them at once.
        self.heads.clear();
        self.heads.extend(self.blocks.iter().map(|&block| Head::of(scene, block)));
        self.lines.resize(self.blocks.len(), [[0.0; BLOCK + 1]; 2]);
        let lines = self.lines.par_iter_mut().zip(&self.blocks).zip(&self.heads);
        lines.with_min_len(64).for_each(|((line, &block), head)| *line = scene.polyline(block, head.after));
    }

    /// The parts that were noted, by the numbers of their lines.
    pub fn noted(&self, near: &Range<usize>) -> &[Part] {
        &self.parts[near.clone()]
    }

    /// The lines that were found.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// The shaft of a line, and its kind.
    pub fn owner(&self, number: u32) -> (u32, u32) {
        let head = self.heads[number as usize];
        (head.shaft, u32::from(head.kind))
    }
}

impl Head {
    fn of(scene: &ShaftScene, block: u32) -> Self {
        let (shaft, next) = scene.shafts.block_head(block);
        let after = match next {
            Some(next) => scene.shafts.point(scene.shafts.block_vertices(next).start),
            None => scene.shafts.tip(shaft),
        };
        Self { shaft, kind: scene.populations.0[shaft as usize], after }
    }
}
