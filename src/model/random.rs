//! Random numbers that depend on nothing but their key: Philox4x32-10 (Salmon et al. 2011, Random123).
//!
//! A draw is a function of (seed, axon, stream, index). There is no state to carry or to save: it does not matter in which
//! order axons are visited, on how many threads, after which resume, or which other mechanisms are switched off.

use rand::{RngExt, TryRng};
use std::convert::Infallible;

const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// The block function: ten rounds of Philox on a 128-bit counter under a 64-bit key.
pub fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let mut x = counter;
    let mut k = key;
    for _ in 0..10 {
        let p0 = u64::from(MULTIPLIERS[0]) * u64::from(x[0]);
        let p1 = u64::from(MULTIPLIERS[1]) * u64::from(x[2]);
        x = [(p1 >> 32) as u32 ^ x[1] ^ k[0], p1 as u32, (p0 >> 32) as u32 ^ x[3] ^ k[1], p0 as u32];
        k = [k[0].wrapping_add(WEYL[0]), k[1].wrapping_add(WEYL[1])];
    }
    x
}

/// Names a stream of draws by its mechanism, so that switching one mechanism off leaves all other draws as they were.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream(u32);

impl Stream {
    /// The stream of a name (FNV-1a of its bytes).
    pub const fn named(name: &str) -> Self {
        let bytes = name.as_bytes();
        let mut hash: u32 = 0x811C_9DC5;
        let mut i = 0;
        while i < bytes.len() {
            hash = (hash ^ bytes[i] as u32).wrapping_mul(0x0100_0193);
            i += 1;
        }
        Self(hash)
    }
}

/// The generator of one key, for use under `rand_distr`.
///
/// Draws with different `(seed, axon, stream, index)` are independent as long as each takes at most 1024 32-bit words (then it
/// runs into those of `index + 1`); `index` has 56 bits. A stream with the index 0 alone is as long as anyone needs.
#[derive(Debug, Clone)]
pub struct KeyedRng {
    key: [u32; 2],
    counter: [u32; 4],
    block: [u32; 4],
    used: usize,
}

impl KeyedRng {
    /// The generator of draw `index` of `axon` in `stream` under `seed`.
    pub fn new(seed: u64, axon: u32, stream: Stream, index: u64) -> Self {
        let key = [seed as u32, (seed >> 32) as u32];
        let counter = [(index << 8) as u32, (index >> 24) as u32, axon, stream.0];
        Self { key, counter, block: [0; 4], used: 4 }
    }

    /// The next number, evenly spread in [0, 1).
    pub fn share(&mut self) -> f64 {
        self.random()
    }

    fn next_word(&mut self) -> u32 {
        if self.used == 4 {
            self.block = philox(self.counter, self.key);
            let (low, carry) = self.counter[0].overflowing_add(1);
            (self.counter[0], self.counter[1]) = (low, self.counter[1].wrapping_add(u32::from(carry)));
            self.used = 0;
        }
        self.used += 1;
        self.block[self.used - 1]
    }
}

impl TryRng for KeyedRng {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next_word())
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let low = u64::from(self.next_word());
        Ok(low | u64::from(self.next_word()) << 32)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(4) {
            chunk.copy_from_slice(&self.next_word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    /// Known answers of the Random123 distribution (`kat_vectors`, philox4x32-10).
    #[test]
    fn philox_gives_the_known_answers_of_its_authors() {
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox([u32::MAX; 4], [u32::MAX; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
        assert_eq!(
            philox([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn normals_of_neighbouring_keys_are_uncorrelated_and_have_unit_variance() {
        let stream = Stream::named("test");
        let draws: Vec<f64> = (0..40_000u64)
            .map(|i| StandardNormal.sample(&mut KeyedRng::new(7, (i % 200) as u32, stream, i / 200)))
            .collect();
        let n = draws.len() as f64;
        let mean: f64 = draws.iter().sum::<f64>() / n;
        let variance: f64 = draws.iter().map(|x| x * x).sum::<f64>() / n;
        let lag: f64 = draws.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n;
        assert!(mean.abs() < 4.0 / n.sqrt());
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!(lag.abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn a_key_gives_the_same_draw_whatever_was_drawn_before() {
        let stream = Stream::named("births");
        let mut first = KeyedRng::new(1, 2, stream, 3);
        let _ = first.try_next_u64();
        let mut other = KeyedRng::new(1, 2, stream, 3);
        let mut same = KeyedRng::new(1, 2, stream, 3);
        assert_eq!(other.try_next_u64(), same.try_next_u64());
        assert_ne!(other.try_next_u64(), KeyedRng::new(1, 2, stream, 4).try_next_u64());
    }
}
