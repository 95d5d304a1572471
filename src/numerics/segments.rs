//! Straight segments as columns, and what a cone feels of them.
//!
//! One pass over the columns tells which segments are felt; those are copied together, whole ones before those that the
//! sector cuts, and a second pass integrates them. Both passes run in the widest vector registers that the processor has; since
//! every segment is treated by itself with the same operations, the bits do not depend on that width. The order of what is
//! felt depends only on the segments that are felt.

use super::contact_integral::{Felt, Sight, View};
use pulp::{Arch, Simd, WithSimd};

/// Segments in D dimensions, column by column.
#[derive(Debug, Clone)]
pub struct Segments<const D: usize> {
    start: [Vec<f64>; D],
    tangent: [Vec<f64>; D],
    length: Vec<f64>,
    owner: Vec<u32>,
}

impl<const D: usize> Default for Segments<D> {
    fn default() -> Self {
        Self {
            start: [(); D].map(|()| Vec::new()),
            tangent: [(); D].map(|()| Vec::new()),
            length: Vec::new(),
            owner: Vec::new(),
        }
    }
}

impl<const D: usize> Segments<D> {
    /// Number of segments.
    pub fn len(&self) -> usize {
        self.length.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.length.is_empty()
    }

    /// Removes all.
    pub fn clear(&mut self) {
        self.start.iter_mut().chain(&mut self.tangent).for_each(Vec::clear);
        self.length.clear();
        self.owner.clear();
    }

    /// Adds the segment from `start` to `end` (µm) of the shaft `owner`; one without length is left out.
    #[inline]
    pub fn push(&mut self, start: [f64; D], end: [f64; D], owner: u32) {
        let chord: [f64; D] = std::array::from_fn(|k| end[k] - start[k]);
        let length = dot(&chord, &chord).sqrt();
        if length > 0.0 {
            for k in 0..D {
                self.start[k].push(start[k]);
                self.tangent[k].push(chord[k] / length);
            }
            self.length.push(length);
            self.owner.push(owner);
        }
    }
}

/// What a cone feels of the segments around it, as columns of equal length.
#[derive(Debug)]
pub struct Sensed<const D: usize> {
    arch: Arch,
    views: Vec<u64>,
    picked: [Vec<u32>; 2],
    felt: Segments<D>,
    normal: [Vec<f64>; D],
    moments: [Vec<f64>; 2],
    along: Vec<f64>,
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
    /// The shaft it belongs to.
    pub owner: u32,
}

impl<const D: usize> Default for Sensed<D> {
    fn default() -> Self {
        Self {
            arch: Arch::new(),
            views: Vec::new(),
            picked: Default::default(),
            felt: Segments::default(),
            normal: [(); D].map(|()| Vec::new()),
            moments: Default::default(),
            along: Vec::new(),
        }
    }
}

impl<const D: usize> Sensed<D> {
    /// What a cone at `x` (µm) with unit heading `e` feels of all segments but those of the shaft `own`.
    pub fn sense(&mut self, felt: &Felt, x: [f64; D], e: [f64; D], segments: &Segments<D>, own: u32) {
        let (arch, n) = (self.arch, segments.len());
        fit(&mut self.views, n);
        arch.dispatch(Look { felt, x, e, segments, views: &mut self.views[..n] });
        let whole = self.pick(segments, own);
        let m = self.felt.len();
        self.normal.iter_mut().chain(&mut self.moments).chain([&mut self.along]).for_each(|column| fit(column, m));
        arch.dispatch(Integrate { felt, x, e, whole, sensed: self });
    }

    /// Everything that is felt, in an order that depends on nothing else.
    #[inline]
    pub fn touches(&self) -> impl Iterator<Item = Touch<D>> + '_ {
        let m = self.felt.len();
        let normal = self.normal.each_ref().map(|column| &column[..m]);
        let tangent = self.felt.tangent.each_ref().map(|column| &column[..m]);
        let [w0, w1] = self.moments.each_ref().map(|column| &column[..m]);
        let (along, owner) = (&self.along[..m], &self.felt.owner[..m]);
        (0..m).map(move |i| Touch {
            normal: normal.map(|c| c[i]),
            tangent: tangent.map(|c| c[i]),
            moments: [w0[i], w1[i]],
            along: along[i],
            owner: owner[i],
        })
    }

    /// Copies together what is felt; returns how many of it lie within the sector as a whole.
    fn pick(&mut self, segments: &Segments<D>, own: u32) -> usize {
        let views = &self.views[..segments.len()];
        for (picked, view) in self.picked.iter_mut().zip([View::Whole, View::Part]) {
            select(picked, views, view as u64);
            picked.retain(|&i| segments.owner[i as usize] != own);
        }
        let [whole, part] = &self.picked;
        for k in 0..D {
            copy(&mut self.felt.start[k], &segments.start[k], whole, part);
            copy(&mut self.felt.tangent[k], &segments.tangent[k], whole, part);
        }
        copy(&mut self.felt.length, &segments.length, whole, part);
        copy(&mut self.felt.owner, &segments.owner, whole, part);
        whole.len()
    }
}

/// The first pass: how much of each segment is felt. What implements `WithSimd` is compiled once for each register width; loops
/// that write to a few columns only are turned into vector code.
struct Look<'a, const D: usize> {
    felt: &'a Felt,
    x: [f64; D],
    e: [f64; D],
    segments: &'a Segments<D>,
    views: &'a mut [u64],
}

impl<const D: usize> WithSimd for Look<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let n = self.views.len();
        let start = self.segments.start.each_ref().map(|column| &column[..n]);
        let tangent = self.segments.tangent.each_ref().map(|column| &column[..n]);
        let length = &self.segments.length[..n];
        for i in 0..n {
            let (sight, _) = look(start.map(|c| c[i]), tangent.map(|c| c[i]), length[i], self.x, self.e);
            self.views[i] = self.felt.view(&sight) as u64;
        }
    }
}

/// The second pass: what was picked is integrated, the first `whole` of it without a cut.
struct Integrate<'a, const D: usize> {
    felt: &'a Felt,
    x: [f64; D],
    e: [f64; D],
    whole: usize,
    sensed: &'a mut Sensed<D>,
}

impl<const D: usize> WithSimd for Integrate<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Sensed { felt: segments, normal, moments, along, .. } = self.sensed;
        let (m, whole, felt) = (segments.len(), self.whole, self.felt);
        let start = segments.start.each_ref().map(|column| &column[..m]);
        let tangent = segments.tangent.each_ref().map(|column| &column[..m]);
        let length = &segments.length[..m];
        let normal = normal.each_mut().map(|column| &mut column[..m]);
        let ([w0, w1], along) = (moments.each_mut().map(|column| &mut column[..m]), &mut along[..m]);
        for i in 0..whole {
            let (sight, n) = look(start.map(|c| c[i]), tangent.map(|c| c[i]), length[i], self.x, self.e);
            [w0[i], w1[i]] = felt.moments_within_reach(&sight);
            along[i] = sight.along;
            for k in 0..D {
                normal[k][i] = n[k];
            }
        }
        for i in whole..m {
            let (sight, n) = look(start.map(|c| c[i]), tangent.map(|c| c[i]), length[i], self.x, self.e);
            [w0[i], w1[i]] = felt.moments_within_sector(&sight);
            along[i] = sight.along;
            for k in 0..D {
                normal[k][i] = n[k];
            }
        }
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

/// The places at which a column of marks has a value, ascending.
fn select(places: &mut Vec<u32>, marks: &[u64], value: u64) {
    places.clear();
    places.resize(marks.len(), 0);
    let mut count = 0;
    for (i, &mark) in (0..).zip(marks) {
        places[count] = i;
        count += usize::from(mark == value);
    }
    places.truncate(count);
}

/// Replaces a column by two selections of another.
fn copy<T: Copy>(to: &mut Vec<T>, from: &[T], first: &[u32], second: &[u32]) {
    to.clear();
    to.extend(first.iter().chain(second).map(|&i| from[i as usize]));
}

/// Makes room for n values.
fn fit<T: Clone + Default>(column: &mut Vec<T>, n: usize) {
    if column.len() < n {
        column.resize(n, T::default());
    }
}
