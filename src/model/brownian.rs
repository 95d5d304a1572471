//! The Brownian path of a heading, on a dyadic tree.
//!
//! Ours: the paper has no noise. The path W(t) of an axon is fixed by (seed, axon, stream) alone. Root intervals of 2^30
//! ticks (0.25 to 0.5 h) carry independent increments N(0, length); each interval is halved by the Brownian bridge,
//! ΔW_left = ΔW/2 + √(length)/2 · z, with z drawn from the key (level, index). A step asks for the increment between two instants,
//! which is a sum over few intervals. So a refined step refines the *same* path, and a step that a cone takes alone meets
//! the same path as well.

use super::random::{KeyedRng, Stream};
use bevy_ecs::prelude::Resource;
use rand_distr::{Distribution, StandardNormal};

/// Root intervals have 2^ROOT_LEVEL ticks.
const ROOT_LEVEL: u32 = 30;

/// The Brownian paths of all axons in one stream.
#[derive(Debug, Clone, Copy)]
pub struct BrownianTree {
    seed: u64,
    stream: Stream,
    tick: f64,
}

/// An interval of 2^level ticks of one axon's path, its length (h) and the increment over it (√h).
struct Interval<const N: usize> {
    level: u32,
    index: u64,
    length: f64,
    increment: [f64; N],
}

/// Increment over the left (0) or right (1) half of an interval with this increment and length, by the Brownian bridge.
fn half_of<const N: usize>((whole, length): ([f64; N], f64), z: [f64; N], side: u64) -> [f64; N] {
    let bridge = 0.5 * length.sqrt() * if side == 0 { 1.0 } else { -1.0 };
    std::array::from_fn(|i| 0.5 * whole[i] + bridge * z[i])
}

/// The Brownian paths of headings; absent in a scene without heading diffusion.
#[derive(Debug, Clone, Copy, Resource)]
pub struct HeadingPaths(pub BrownianTree);

impl BrownianTree {
    /// The tree of a seed and a stream over ticks of length `tick` (h).
    pub fn new(seed: u64, stream: Stream, tick: f64) -> Self {
        Self { seed, stream, tick }
    }

    /// W(`to`) − W(`from`) of an axon in its first `N` components (√h), instants in ticks, `from ≤ to`. A heading has one tangent
    /// direction in the plane and two in space; the first component is the same for both.
    pub fn increment<const N: usize>(&self, axon: u32, from: u64, to: u64) -> [f64; N] {
        let mut sum = [0.0; N];
        if from == to {
            return sum;
        }
        for root in from >> ROOT_LEVEL..to.div_ceil(1 << ROOT_LEVEL) {
            let (from, to) = (from.max(root << ROOT_LEVEL), to.min((root + 1) << ROOT_LEVEL));
            // The smallest interval that holds the span.
            let level = u64::BITS - (from ^ (to - 1)).leading_zeros();
            self.add_part(axon, (from, to), self.interval(axon, level, from >> level), &mut sum);
        }
        sum
    }

    /// The interval `index` of 2^level ticks, from its root down.
    fn interval<const N: usize>(&self, axon: u32, level: u32, index: u64) -> Interval<N> {
        let root = index >> (ROOT_LEVEL - level);
        let mut length = self.tick * 2f64.powi(ROOT_LEVEL as i32);
        let scale = length.sqrt();
        let mut increment = self.normals::<N>(axon, ROOT_LEVEL, root).map(|z| scale * z);
        for below in (level..ROOT_LEVEL).rev() {
            let child = index >> (below - level);
            let z = self.normals::<N>(axon, below, child >> 1);
            increment = half_of((increment, length), z, child & 1);
            length *= 0.5;
        }
        Interval { level, index, length, increment }
    }

    /// Adds the increment over what an interval and a span of ticks have in common, which is something: its own, or those of its halves.
    fn add_part<const N: usize>(&self, axon: u32, span: (u64, u64), whole: Interval<N>, sum: &mut [f64; N]) {
        let Interval { level, index, length, increment } = whole;
        let (start, end) = (index << level, (index + 1) << level);
        if span.0 <= start && end <= span.1 {
            *sum = std::array::from_fn(|i| sum[i] + increment[i]);
            return;
        }
        let z = self.normals::<N>(axon, level - 1, index);
        let middle = start + (1 << (level - 1));
        for (side, is_met) in [(0, span.0 < middle), (1, middle < span.1)] {
            if is_met {
                let increment = half_of((increment, length), z, side);
                let half = Interval { level: level - 1, index: 2 * index + side, length: 0.5 * length, increment };
                self.add_part(axon, span, half, sum);
            }
        }
    }

    fn normals<const N: usize>(&self, axon: u32, level: u32, index: u64) -> [f64; N] {
        let mut rng = KeyedRng::new(self.seed, axon, self.stream, u64::from(level) << 50 | index);
        std::array::from_fn(|_| StandardNormal.sample(&mut rng))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree() -> BrownianTree {
        BrownianTree::new(11, Stream::named("heading_noise"), 1.2 * 2f64.powi(-32))
    }

    #[test]
    fn parts_of_an_interval_add_up_to_it() {
        let tree = tree();
        let (from, to) = (5 << 12, (5 << 12) + (1 << 26) + (3 << 12));
        let whole: [f64; 2] = tree.increment(3, from, to);
        for middle in [from + (1 << 12), 1 << 20, (1 << 25) + (7 << 13)] {
            let (a, b): ([f64; 2], [f64; 2]) = (tree.increment(3, from, middle), tree.increment(3, middle, to));
            assert!((0..2).all(|i| (a[i] + b[i] - whole[i]).abs() < 1e-14));
            assert_eq!(tree.increment::<1>(3, from, middle), [a[0]], "the plane has the first component of space");
        }
    }

    #[test]
    fn an_interval_of_any_ends_is_the_sum_of_its_ticks() {
        let tree = tree();
        for (from, to) in
            [(0, 1), (5, 5), (1021, 1029), ((1 << 26) - 300, (1 << 26) + 5), ((2 << 30) - 7, (2 << 30) + 130)]
        {
            let whole: [f64; 2] = tree.increment(3, from, to);
            let ticks = (from..to).map(|tick| tree.increment::<2>(3, tick, tick + 1));
            let sum = ticks.fold([0.0; 2], |sum, tick| [sum[0] + tick[0], sum[1] + tick[1]]);
            let size = (to - from) as f64 * tree.tick;
            assert!(
                (0..2).all(|i| (sum[i] - whole[i]).abs() <= 1e-11 * size.sqrt()),
                "{from} to {to}: {sum:?} {whole:?}"
            );
        }
    }

    #[test]
    fn increments_have_the_variance_of_their_length_and_are_independent() {
        let tree = tree();
        let step = 1u64 << 26;
        let length = tree.tick * step as f64;
        let draws: Vec<f64> = (0..20_000u64)
            .map(|i| tree.increment::<1>((i % 100) as u32, (i / 100) * step, (i / 100 + 1) * step)[0])
            .collect();
        let n = draws.len() as f64;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / n;
        let neighbours = draws.iter().zip(&draws[100..]).map(|(a, b)| a * b).sum::<f64>() / n;
        assert!((variance / length - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", variance / length);
        assert!((neighbours / length).abs() < 4.0 / n.sqrt());
    }
}
