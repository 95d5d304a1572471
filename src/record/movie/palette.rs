//! Few colours for many: boxes of the colours that occur, cut in two at the median until there are enough.
//!
//! The box that is cut next has the largest √n·w, n its pixels and w its widest channel: wide areas of slowly changing colour and rare
//! strong colours both get their share.

use std::collections::{BTreeMap, HashMap};

/// Colours that are told apart while boxes are cut: this many bits a channel.
const BITS: u32 = 6;

/// A table of colours, and which of them is nearest to those met so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Palette {
    colours: Vec<[u8; 3]>,
    known: HashMap<[u8; 3], u8>,
}

/// Pixels of nearly one colour: how many, and the sum of their channels.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    count: u64,
    sums: [u64; 3],
}

impl Bin {
    fn channel(&self, channel: usize) -> u64 {
        self.sums[channel] / self.count.max(1)
    }
}

impl Palette {
    /// At most `most` colours for pixels (three bytes each), at least one.
    pub(super) fn of(pixels: &[u8], most: usize) -> Self {
        let mut bins: BTreeMap<[u8; 3], Bin> = BTreeMap::new();
        for pixel in pixels.chunks_exact(3) {
            let bin = bins.entry([0, 1, 2].map(|channel| pixel[channel] >> (8 - BITS))).or_default();
            bin.count += 1;
            (0..3).for_each(|channel| bin.sums[channel] += u64::from(pixel[channel]));
        }
        let mut boxes = vec![bins.into_values().collect::<Vec<Bin>>()];
        while boxes.len() < most {
            let widest = (0..boxes.len()).max_by(|&a, &b| urgency(&boxes[a]).total_cmp(&urgency(&boxes[b])));
            let Some(place) = widest.filter(|&place| boxes[place].len() > 1) else { break };
            let other = cut(&mut boxes[place]);
            boxes.push(other);
        }
        Self { colours: boxes.iter().map(|bins| mean(bins)).collect(), known: HashMap::new() }
    }

    /// The table: three bytes a colour.
    pub(super) fn table(&self) -> Vec<u8> {
        self.colours.concat()
    }

    /// Number of the nearest colour.
    pub(super) fn index_of(&mut self, pixel: &[u8]) -> u8 {
        let colour = [pixel[0], pixel[1], pixel[2]];
        *self.known.entry(colour).or_insert_with(|| {
            let far = |other: &[u8; 3]| {
                (0..3).map(|channel| u32::from(other[channel].abs_diff(colour[channel])).pow(2)).sum::<u32>()
            };
            let nearest = self.colours.iter().enumerate().min_by_key(|(_, other)| far(other));
            nearest.map_or(0, |(index, _)| index as u8)
        })
    }
}

/// Widest channel of a box, and its extent.
fn widest(bins: &[Bin]) -> (usize, u64) {
    let extent = |channel: usize| {
        let values = bins.iter().map(|bin| bin.channel(channel));
        values.clone().max().unwrap_or_default() - values.min().unwrap_or_default()
    };
    (0..3).map(|channel| (channel, extent(channel))).max_by_key(|(_, extent)| *extent).unwrap_or_default()
}

fn urgency(bins: &[Bin]) -> f64 {
    let count: u64 = bins.iter().map(|bin| bin.count).sum();
    if bins.len() > 1 { (count as f64).sqrt() * widest(bins).1.max(1) as f64 } else { 0.0 }
}

/// Cuts a box at the median of its widest channel; keeps one half and returns the other, neither empty.
fn cut(bins: &mut Vec<Bin>) -> Vec<Bin> {
    let (channel, _) = widest(bins);
    bins.sort_by_key(|bin| bin.channel(channel));
    let half = bins.iter().map(|bin| bin.count).sum::<u64>() / 2;
    let mut passed = 0;
    let below = bins.iter().take_while(|bin| {
        passed += bin.count;
        passed <= half
    });
    let place = below.count().clamp(1, bins.len() - 1);
    bins.split_off(place)
}

fn mean(bins: &[Bin]) -> [u8; 3] {
    let count: u64 = bins.iter().map(|bin| bin.count).sum();
    let sum = |channel: usize| bins.iter().map(|bin| bin.sums[channel]).sum::<u64>();
    [0, 1, 2].map(|channel| ((sum(channel) + count / 2) / count.max(1)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_kept_exactly_and_many_nearly() {
        let four: Vec<u8> = [[0, 0, 0], [255, 255, 255], [213, 94, 0], [0, 158, 115]].concat().repeat(9);
        let mut palette = Palette::of(&four, 255);
        let table = palette.table();
        assert_eq!(table.len(), 12);
        for pixel in four.chunks_exact(3) {
            let index = usize::from(palette.index_of(pixel));
            assert_eq!(&table[3 * index..3 * index + 3], pixel);
        }
        let many: Vec<u8> = (0..=255u8).flat_map(|a| (0..=255u8).flat_map(move |b| [a, b, 128])).collect();
        let mut palette = Palette::of(&many, 255);
        let table = palette.table();
        assert_eq!(table.len(), 3 * 255);
        let far = |pixel: &[u8]| {
            let index = usize::from(palette.index_of(pixel));
            (0..3).map(|channel| table[3 * index + channel].abs_diff(pixel[channel])).max().unwrap()
        };
        // 255 boxes of a square of 256 by 256 are 16 wide.
        assert!(many.chunks_exact(3).map(far).max().unwrap() <= 16);
        assert_eq!(Palette::of(&[], 255).table().len(), 3);
    }
}
