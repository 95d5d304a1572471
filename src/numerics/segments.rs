//! Straight segments as columns, and what a cone feels of them.
//!
//! One pass over the columns tells which segments are felt; those are copied together in batches, whole ones before those that
//! the sector cuts, and a second pass integrates and sums them. Both passes run in the widest vector registers that the
//! processor has; every segment is treated by itself with the same operations, and sums are [exact](Sum). So the bits depend
//! neither on that width nor on the order of segments.

use super::contact_integral::{Felt, Sight, View};
use pulp::{Arch, Simd, WithSimd};

/// Segments looked at, and integrated, at a time: what they need lies in the nearest cache.
const BATCH: usize = 64;
/// Values in whole batches; what lies beyond the number of segments is left over.
type Column<T> = Vec<[T; BATCH]>;

/// Segments in D dimensions, column by column.
#[derive(Debug, Clone)]
pub struct Segments<const D: usize> {
    count: usize,
    start: [Column<f64>; D],
    tangent: [Column<f64>; D],
    length: Column<f64>,
    owner: Column<u32>,
    kind: Column<u32>,
}

impl<const D: usize> Default for Segments<D> {
    fn default() -> Self {
        Self {
            count: 0,
            start: [(); D].map(|()| Vec::new()),
            tangent: [(); D].map(|()| Vec::new()),
            length: Vec::new(),
            owner: Vec::new(),
            kind: Vec::new(),
        }
    }
}

impl<const D: usize> Segments<D> {
    /// Number of segments.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Removes all.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds the segment from `start` to `end` (µm) of the shaft `owner`, which is of a `kind`; one without length is left out.
    #[inline]
    pub fn push(&mut self, start: [f64; D], end: [f64; D], (owner, kind): (u32, u32)) {
        let chord: [f64; D] = std::array::from_fn(|k| end[k] - start[k]);
        let length = dot(&chord, &chord).sqrt();
        if length > 0.0 {
            let (batch, lane) = (self.count / BATCH, self.count % BATCH);
            if batch == self.length.len() {
                self.add_batch();
            }
            for k in 0..D {
                self.start[k][batch][lane] = start[k];
                self.tangent[k][batch][lane] = chord[k] / length;
            }
            self.length[batch][lane] = length;
            self.owner[batch][lane] = owner;
            self.kind[batch][lane] = kind;
            self.count += 1;
        }
    }

    fn add_batch(&mut self) {
        let zeros = [0.0; BATCH];
        self.start.iter_mut().chain(&mut self.tangent).chain([&mut self.length]).for_each(|column| column.push(zeros));
        self.owner.push([0; BATCH]);
        self.kind.push([0; BATCH]);
    }
}

/// What a contact law makes of one segment that is felt. Implementations are marked `inline(always)`, so that they are compiled
/// with the loop that calls them, in vector registers.
pub trait ContactPull<const D: usize> {
    /// The pull of a touch, for an adhesion of 1.
    fn pull(&self, touch: &Touch<D>) -> [f64; D];
}

/// One segment that is felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch<const D: usize> {
    /// Vector n from the cone to the nearest point of the segment's line (µm).
    pub normal: [f64; D],
    /// Unit tangent.
    pub tangent: [f64; D],
    /// W₀ (µm) and W₁ (µm²) over the felt part.
    pub moments: [f64; 2],
    /// Cosine of the angle between tangent and heading.
    pub along: f64,
}

/// Partial sums side by side.
const LANES: usize = 8;
const _: () = assert!(BATCH.is_multiple_of(LANES));

/// How a batch of segments is seen: two bits for each, the number of its [`View`].
type Views = [u64; 2];
const PAIRS: usize = BATCH / 2;
/// The bits of those seen whole; the others tell of those seen in part.
const WHOLE: u64 = 0x5555_5555_5555_5555;
const _: () = assert!(PAIRS * 2 == u64::BITS as usize && View::Whole as u64 == 1 && View::Part as u64 == 2);

/// Work memory of a cone that sums what it feels.
#[derive(Debug)]
pub struct Contacts<const D: usize> {
    arch: Arch,
    views: Vec<Views>,
    picked: [Vec<u32>; 2],
    batch: Batch<D>,
}

/// Segments that are felt, copied together, with the adhesion to each.
#[derive(Debug)]
struct Batch<const D: usize> {
    start: [[f64; BATCH]; D],
    tangent: [[f64; BATCH]; D],
    length: [f64; BATCH],
    adhesion: [f64; BATCH],
    pull: [[f64; BATCH]; D],
}

impl<const D: usize> Default for Contacts<D> {
    fn default() -> Self {
        let zeros = [0.0; BATCH];
        let batch = Batch { start: [zeros; D], tangent: [zeros; D], length: zeros, adhesion: zeros, pull: [zeros; D] };
        Self { arch: Arch::new(), views: Vec::new(), picked: Default::default(), batch }
    }
}

impl<const D: usize> Contacts<D> {
    /// The sum of a law over all segments but those of the shaft `own`, each times the adhesion to its kind, as a cone at `x` (µm)
    /// with unit heading `e` feels them. A kind that `adhesion` has no number for is felt like its last.
    pub fn sum(
        &mut self,
        (x, e): ([f64; D], [f64; D]),
        segments: &Segments<D>,
        own: u32,
        (felt, law): (&Felt, &impl ContactPull<D>),
        adhesion: &[f64],
    ) -> [f64; D] {
        self.views.resize(segments.len().div_ceil(BATCH), Views::default());
        self.arch.dispatch(Look { felt, x, e, segments, own, views: &mut self.views });
        let [whole, part] = &mut self.picked;
        select(whole, self.views.iter().flatten().map(|pairs| pairs & WHOLE));
        select(part, self.views.iter().flatten().map(|pairs| pairs & !WHOLE));
        let Self { arch, picked: [whole, part], batch, .. } = self;
        let mut sums = [Sum::default(); D];
        for picked in whole.chunks(BATCH) {
            let count = arch.dispatch(Fill { segments, picked, adhesion, batch });
            arch.dispatch(Integrate::<D, true, _> { felt, x, e, law, count, batch, sums: &mut sums });
        }
        for picked in part.chunks(BATCH) {
            let count = arch.dispatch(Fill { segments, picked, adhesion, batch });
            arch.dispatch(Integrate::<D, false, _> { felt, x, e, law, count, batch, sums: &mut sums });
        }
        sums.map(Sum::rounded)
    }
}

/// Between the passes: picked segments are copied together. What fills up the last lanes is the last of them with no adhesion.
/// Returns the number of lanes in use.
struct Fill<'a, const D: usize> {
    segments: &'a Segments<D>,
    picked: &'a [u32],
    adhesion: &'a [f64],
    batch: &'a mut Batch<D>,
}

impl<const D: usize> WithSimd for Fill<'_, D> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        let Self { segments, picked, adhesion, batch } = self;
        let Some(&last) = picked.last() else { return 0 };
        let count = picked.len().min(BATCH);
        let padded = count.next_multiple_of(LANES);
        let mut places = [last; BATCH];
        places[..count].copy_from_slice(&picked[..count]);
        let places = &places[..padded];
        for k in 0..D {
            copy(&mut batch.start[k], segments.start[k].as_flattened(), places);
            copy(&mut batch.tangent[k], segments.tangent[k].as_flattened(), places);
        }
        copy(&mut batch.length, segments.length.as_flattened(), places);
        let mut kinds = [0; BATCH];
        copy(&mut kinds, segments.kind.as_flattened(), places);
        copy(&mut batch.adhesion, adhesion, &kinds[..padded]);
        batch.adhesion[count..padded].fill(0.0);
        padded
    }
}

/// Copies the values at places together; a place past the end is the last. Without a case for that, gathers are vector code.
#[inline(always)]
fn copy<T: Copy>(to: &mut [T; BATCH], from: &[T], places: &[u32]) {
    if let Some(last) = from.len().checked_sub(1) {
        for (to, &place) in to.iter_mut().zip(places) {
            *to = from[(place as usize).min(last)];
        }
    }
}

/// The first pass: how much of each segment is felt. What implements `WithSimd` is compiled once for each register width; loops
/// that write to a few columns only are turned into vector code.
struct Look<'a, const D: usize> {
    felt: &'a Felt,
    x: [f64; D],
    e: [f64; D],
    segments: &'a Segments<D>,
    own: u32,
    views: &'a mut [Views],
}

impl<const D: usize> WithSimd for Look<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let segments = self.segments;
        let mut seen = [0; BATCH];
        for (batch, views) in self.views.iter_mut().enumerate() {
            let used = BATCH.min(segments.count - batch * BATCH);
            let lanes = used.next_multiple_of(LANES).min(BATCH);
            let start = segments.start.each_ref().map(|column| &column[batch][..lanes]);
            let tangent = segments.tangent.each_ref().map(|column| &column[batch][..lanes]);
            let (length, owner) = (&segments.length[batch][..lanes], &segments.owner[batch][..lanes]);
            let seen_here = &mut seen[..lanes];
            for i in 0..lanes {
                let (sight, _) = look(start.map(|c| c[i]), tangent.map(|c| c[i]), length[i], self.x, self.e);
                let view = self.felt.view(&sight) as u64;
                seen_here[i] = if owner[i] == self.own { View::Nothing as u64 } else { view };
            }
            seen[used..].fill(View::Nothing as u64);
            let pairs = |half: usize| (0..PAIRS).fold(0, |pairs, i| pairs | (seen[half * PAIRS + i] << (2 * i)));
            *views = [pairs(0), pairs(1)];
        }
    }
}

/// The second pass: a batch is integrated and added up; one that is not `WHOLE` is cut by the sector.
struct Integrate<'a, const D: usize, const WHOLE: bool, L> {
    felt: &'a Felt,
    x: [f64; D],
    e: [f64; D],
    law: &'a L,
    count: usize,
    batch: &'a mut Batch<D>,
    sums: &'a mut [Sum; D],
}

impl<const D: usize, const WHOLE: bool, L: ContactPull<D>> WithSimd for Integrate<'_, D, WHOLE, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { felt, x, e, law, count, batch, sums } = self;
        let start = batch.start.each_ref().map(|column| &column[..count]);
        let tangent = batch.tangent.each_ref().map(|column| &column[..count]);
        let (length, adhesion) = (&batch.length[..count], &batch.adhesion[..count]);
        let pull = batch.pull.each_mut().map(|column| &mut column[..count]);
        for i in 0..count {
            let tangent = tangent.map(|c| c[i]);
            let (sight, normal) = look(start.map(|c| c[i]), tangent, length[i], x, e);
            let moments = if WHOLE { felt.moments_within_reach(&sight) } else { felt.moments_within_sector(&sight) };
            let of_touch = law.pull(&Touch { normal, tangent, moments, along: sight.along });
            for k in 0..D {
                pull[k][i] = of_touch[k] * adhesion[i];
            }
        }
        for (sum, pull) in sums.iter_mut().zip(pull) {
            for values in pull.as_chunks().0 {
                sum.add(values);
            }
        }
    }
}

/// A sum that does not depend on the order of what is added: of numbers rounded to multiples of 2⁻³⁰, and of what that left,
/// rounded to multiples of 2⁻⁷⁰. Both sums are exact for up to 2¹⁴ numbers below 2⁹, and what is lost is below 10⁻²¹ a number.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    coarse: [f64; LANES],
    fine: [f64; LANES],
}

impl Sum {
    #[inline(always)]
    fn add(&mut self, values: &[f64; LANES]) {
        // From here to a third more, numbers that can be told apart lie 2⁻³⁰ and 2⁻⁷⁰ apart.
        const COARSE: f64 = 1.5 * (1u64 << 22) as f64;
        const FINE: f64 = 1.5 / (1u64 << 18) as f64;
        for ((value, coarse), fine) in values.iter().zip(&mut self.coarse).zip(&mut self.fine) {
            let rounded = (value + COARSE) - COARSE;
            *coarse += rounded;
            *fine += ((value - rounded) + FINE) - FINE;
        }
    }

    fn rounded(self) -> f64 {
        self.coarse.iter().sum::<f64>() + self.fine.iter().sum::<f64>()
    }
}

/// A segment as the cone at `x` with heading `e` sees it, and the vector n to its line.
#[inline(always)]
fn look<const D: usize>(
    start: [f64; D],
    tangent: [f64; D],
    length: f64,
    x: [f64; D],
    e: [f64; D],
) -> (Sight, [f64; D]) {
    let from_cone: [f64; D] = std::array::from_fn(|k| start[k] - x[k]);
    let first = dot(&from_cone, &tangent);
    let normal: [f64; D] = std::array::from_fn(|k| from_cone[k] - tangent[k] * first);
    let gap = dot(&normal, &normal);
    let sight = Sight { gap, first, last: first + length, along: dot(&tangent, &e), across: dot(&normal, &e) };
    (sight, normal)
}

#[inline(always)]
fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = a[0] * b[0];
    for k in 1..D {
        sum += a[k] * b[k];
    }
    sum
}

/// The places of all pairs of bits with one that is set, ascending.
fn select(places: &mut Vec<u32>, pairs: impl Iterator<Item = u64>) {
    places.clear();
    for (first, mut bits) in (0..).step_by(PAIRS).zip(pairs) {
        while bits != 0 {
            places.push(first + bits.trailing_zeros() / 2);
            bits &= bits - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// W₀ n + W₁ t: pulls toward all that is felt.
    struct Toward;

    impl ContactPull<2> for Toward {
        #[inline(always)]
        fn pull(&self, touch: &Touch<2>) -> [f64; 2] {
            std::array::from_fn(|k| touch.normal[k] * touch.moments[0] + touch.tangent[k] * touch.moments[1])
        }
    }

    const FELT: Felt = Felt { reach: 10.0, cos_sector: -0.5 };

    /// Segments of 40 shafts about the origin, with one far away after every `every`th.
    fn around(count: u32, every: u32) -> Segments<2> {
        let mut segments = Segments::default();
        for i in 0..count {
            let share = |k: u32| (f64::from(i) * 0.618_033_988_75 * f64::from(2 * k + 1)).fract();
            let start = [16.0 * share(0) - 8.0, 16.0 * share(1) - 8.0];
            segments.push(start, [start[0] + 6.0 * share(2) - 3.0, start[1] + 6.0 * share(3)], (i % 40, i % 3));
            if i % every == 0 {
                segments.push([50.0 + f64::from(i), 3.0], [60.0, 9.0], (i % 40, i % 3));
            }
        }
        segments
    }

    #[test]
    fn a_sum_is_exact_in_any_order() {
        let values: Vec<f64> = (0..8 * 500).map(|i| (1.0 + f64::from(i)).sin() * 10f64.powi(i % 40 - 38)).collect();
        let sum_of = |values: &[f64]| {
            let mut sum = Sum::default();
            values.as_chunks().0.iter().for_each(|lanes| sum.add(lanes));
            sum.rounded()
        };
        let forward = sum_of(&values);
        assert_eq!(sum_of(&values.iter().rev().copied().collect::<Vec<_>>()).to_bits(), forward.to_bits());
        // Small ones first lose nothing either.
        let mut sorted = values.clone();
        sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert!((sorted.iter().sum::<f64>() - forward).abs() <= 1e-14 * forward.abs().max(10.0));
        assert_ne!(values.iter().sum::<f64>(), values.iter().rev().sum::<f64>(), "the order would matter");
    }

    fn sum(segments: &Segments<2>, adhesion: &[f64]) -> [f64; 2] {
        Contacts::default().sum(([0.3, -0.2], [0.6, 0.8]), segments, 7, (&FELT, &Toward), adhesion)
    }

    #[test]
    fn the_sum_over_many_is_the_sum_of_each_times_its_adhesion_without_the_own_shaft() {
        let adhesion = [0.7, -0.4, 1.9];
        let many = around(500, 1000);
        let mut expected = [0.0; 2];
        for i in 0..many.len() {
            let mut one = Segments::default();
            let start = many.start.each_ref().map(|c| c.as_flattened()[i]);
            let chord = many.tangent.each_ref().map(|c| many.length.as_flattened()[i] * c.as_flattened()[i]);
            let (owner, kind) = (many.owner.as_flattened()[i], many.kind.as_flattened()[i]);
            one.push(start, std::array::from_fn(|k| start[k] + chord[k]), (owner, kind));
            let pull = if owner == 7 { [0.0; 2] } else { sum(&one, &adhesion) };
            expected = [expected[0] + pull[0], expected[1] + pull[1]];
        }
        let found = sum(&many, &adhesion);
        assert!(expected[0].hypot(expected[1]) > 10.0);
        assert!((found[0] - expected[0]).hypot(found[1] - expected[1]) < 1e-11, "{found:?} {expected:?}");
    }

    #[test]
    fn what_is_not_felt_changes_no_bit() {
        for (count, every) in [(1, 1), (63, 2), (64, 7), (65, 1), (500, 3)] {
            assert_eq!(sum(&around(count, every), &[1.0; 3]), sum(&around(count, 1000), &[1.0; 3]), "{count} {every}");
        }
    }
}
