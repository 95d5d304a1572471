//! Whether shafts that were read back hold together: chains that lead through their own blocks and end, vertices in cells that are there.

use super::{BLOCK, Block, Chain, NONE, Shafts};

impl Shafts {
    /// What makes these shafts impossible in a scene whose fresh ones are `fresh`, on a mesh of `cells` cells; none if nothing does.
    pub(in crate::model) fn defect(&self, fresh: &Self, cells: usize) -> Option<&'static str> {
        let (blocks, places) = (self.blocks.all(), self.blocks.all().len().saturating_mul(BLOCK));
        let there = |cell: u32| (cell as usize) < cells;
        let checks: [(&'static str, &dyn Fn() -> bool); 6] = [
            ("they are those of another scene", &|| {
                let own = (self.tolerance, self.longest, self.chains.len());
                own == (fresh.tolerance, fresh.longest, fresh.chains.len())
            }),
            ("a page holds blocks that are taken", &|| self.blocks.pages_are_free(self.chains.len())),
            ("a block holds more than it can", &|| blocks.iter().all(|block| usize::from(block.used) <= BLOCK)),
            ("a vertex lies in no cell", &|| blocks.iter().all(|block| block.lies_in(cells))),
            ("a tip lies in no cell", &|| self.chains.iter().all(|chain| there(chain.tip_cell))),
            ("a vertex that was laid or struck out is none", &|| {
                let laid = self.laid.iter().all(|&vertex| (vertex as usize) < places);
                laid && self.struck.iter().all(|struck| (struck.vertex as usize) < places && there(struck.point.cell))
            }),
        ];
        let broken = checks.iter().find(|(_, fine)| !fine()).map(|(words, _)| *words);
        broken.or_else(|| {
            (!self.chains_lead_through_their_blocks()).then_some("a chain of blocks does not hold together")
        })
    }

    /// Whether each shaft's blocks, none empty, follow each other both ways and belong to no other, and blocks of no shaft are empty.
    fn chains_lead_through_their_blocks(&self) -> bool {
        let blocks = self.blocks.all();
        let mut seen = vec![false; blocks.len()];
        for (shaft, Chain { first, last, .. }) in self.chains.iter().enumerate() {
            let (mut at, mut before) = (*first, NONE);
            while at != NONE {
                let is_next =
                    |block: &&Block| block.used > 0 && block.owner as usize == shaft && block.before == before;
                let Some(block) = blocks.get(at as usize).filter(is_next) else { return false };
                if std::mem::replace(&mut seen[at as usize], true) {
                    return false;
                }
                (at, before) = (block.next, at);
            }
            if before != *last {
                return false;
            }
        }
        seen.iter().zip(blocks).all(|(seen, block)| *seen || block.used == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::components::Site;
    use crate::model::shafts::Blocks;

    fn laid() -> Shafts {
        let mut shafts = Shafts::new(2, 0.5, 12.0);
        shafts.watch();
        for shaft in [0, 1] {
            shafts.start(shaft, Site::default(), [0.0; 2], 0.0);
            let at = |i: i32| [12.0 * f64::from(i), 0.0];
            (1..40).for_each(|i| shafts.extend(shaft, (Site::default(), at(i)), 1.0, |_| at(i - 1)));
        }
        shafts
    }

    #[test]
    fn shafts_that_were_laid_are_sound_and_each_break_is_seen() {
        let fresh = Shafts::new(2, 0.5, 12.0);
        assert_eq!(laid().defect(&fresh, 1), None);
        let breaks: [fn(&mut Shafts); 12] = [
            |shafts| shafts.longest = 0.0,
            |shafts| shafts.chains.truncate(1),
            |shafts| _ = shafts.blocks.get_mut(4).push(Site { cell: 1, ..Site::default() }, 0.0),
            |shafts| shafts.blocks = Blocks::new(2),
            |shafts| shafts.blocks.get_mut(0).used = 17,
            |shafts| shafts.blocks.get_mut(0).used = 0,
            |shafts| shafts.chains[1].tip_cell = 7,
            |shafts| shafts.laid.push(1000),
            |shafts| shafts.blocks.get_mut(shafts.chains[0].last).next = shafts.chains[0].first,
            |shafts| shafts.chains[0].first = 99,
            |shafts| shafts.chains[0].last = shafts.chains[0].first,
            |shafts| shafts.blocks.get_mut(0).owner = 1,
        ];
        for (place, spoil) in breaks.iter().enumerate() {
            let mut spoilt = laid();
            spoil(&mut spoilt);
            assert!(spoilt.defect(&fresh, 1).is_some(), "break {place}");
        }
    }
}
