//! The integral of a contact law over straight segments, in closed form, four segments at a time.
//!
//! A cone at the origin with unit heading e feels the points of a segment within reach R and within an angle Θ of e. With s
//! the place along the segment from the point nearest to the cone, n the vector to that point and ρ = √(n² + s²), attraction
//! 27/4 u(1−u)² and alignment (1−u)², u = ρ/R, both need only
//!
//! ```text
//! W₀ = ∫(1−u)² ds,   W₁ = ∫(1−u)² s ds,   ∫ρ ds = [sρ + n² asinh(s/|n|)]/2,   ∫ρ s ds = ρ³/3
//! ```
//!
//! over the part of the segment that is felt. What lies within a circular cone of half-angle below 90° is one interval of a line,
//! so the felt part is the clipped segment's share inside the cone (Θ < 90°), or the clipped segment without its share in the
//! cone behind (Θ ≥ 90°). The values are additive: cutting a segment changes nothing beyond round-off. Each lane depends on its
//! own segment alone, so that results do not depend on how segments are grouped.

use wide::f64x4;

/// Segments handled at once.
pub const LANES: usize = 4;

/// Four segments as a cone sees them; unused lanes may hold zeros.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SegmentLanes {
    /// n², squared distance of the line (µm²).
    pub gap: [f64; LANES],
    /// s at the segment's start (µm).
    pub first: [f64; LANES],
    /// s at its end, not before the start (µm).
    pub last: [f64; LANES],
    /// t·e of the unit tangent.
    pub along: [f64; LANES],
    /// n·e (µm).
    pub across: [f64; LANES],
}

/// What is felt: reach and sector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// Reach R (µm), positive.
    pub reach: f64,
    /// cos Θ; below −1 there is no sector.
    pub cos_sector: f64,
}

/// How much of a segment lies within the sector, as far as its ends tell (both sector and what lies behind it are convex for
/// Θ ≥ 90°, up to the rim).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// All of it.
    Whole,
    /// Perhaps a part.
    Part,
    /// Nothing: it lies in the cone behind.
    Nothing,
}

/// An interval of s.
#[derive(Clone, Copy)]
struct Interval {
    low: f64x4,
    high: f64x4,
}

/// W₀ without its logarithm, W₁, and the ratio whose logarithm is asinh(high/|n|) − asinh(low/|n|).
struct Parts {
    plain: f64x4,
    first_moment: f64x4,
    ratio: f64x4,
}

impl Felt {
    /// Which part of a segment can be felt, from its ends alone: `across + along·s` at each end and ρ² there.
    #[inline]
    pub fn view(&self, ends: [f64; 2], squares: [f64; 2]) -> View {
        if self.cos_sector < -1.0 {
            return View::Whole;
        }
        if self.cos_sector > 0.0 {
            return View::Part;
        }
        let c2 = self.cos_sector * self.cos_sector;
        let behind = |k: usize| ends[k] < 0.0 && ends[k] * ends[k] >= c2 * squares[k];
        if ends[0] >= 0.0 && ends[1] >= 0.0 {
            View::Whole
        } else if behind(0) && behind(1) {
            View::Nothing
        } else {
            View::Part
        }
    }

    /// W₀ (µm) and W₁ (µm²) of four segments that lie within the sector as a whole.
    #[inline]
    pub fn moments_of_whole(&self, lanes: &SegmentLanes) -> [[f64; LANES]; 2] {
        let gap = f64x4::from(lanes.gap);
        self.finish(gap, &self.parts(gap, self.clipped(gap, lanes)))
    }

    #[inline]
    fn clipped(&self, gap: f64x4, lanes: &SegmentLanes) -> Interval {
        let room = (f64x4::splat(self.reach * self.reach) - gap).fast_max(f64x4::ZERO).sqrt();
        let low = f64x4::from(lanes.first).fast_max(-room);
        Interval { low, high: f64x4::from(lanes.last).fast_min(room).fast_max(low) }
    }

    #[inline]
    fn finish(&self, gap: f64x4, parts: &Parts) -> [[f64; LANES]; 2] {
        let w0 = parts.plain - gap * parts.ratio.ln() * (1.0 / self.reach);
        [w0.to_array(), parts.first_moment.to_array()]
    }

    /// W₀ (µm) and W₁ (µm²) of four segments.
    #[inline]
    pub fn moments(&self, lanes: &SegmentLanes) -> [[f64; LANES]; 2] {
        let gap = f64x4::from(lanes.gap);
        let clipped = self.clipped(gap, lanes);
        let sign = if self.cos_sector > 0.0 { 1.0 } else { -1.0 };
        let within = || {
            let (along, across) = (f64x4::from(lanes.along) * sign, f64x4::from(lanes.across) * sign);
            cone_share(gap, along, across, self.cos_sector.abs(), clipped)
        };
        let parts = if self.cos_sector > 0.0 {
            self.parts(gap, within())
        } else {
            let all = self.parts(gap, clipped);
            if self.cos_sector < -1.0 { all } else { all.without(&self.parts(gap, within())) }
        };
        self.finish(gap, &parts)
    }

    #[inline]
    fn parts(&self, gap: f64x4, Interval { low, high }: Interval) -> Parts {
        let r = 1.0 / self.reach;
        let (low2, high2) = (low * low, high * high);
        let (rho_low, rho_high) = ((gap + low2).sqrt(), (gap + high2).sqrt());
        let linear = high - low;
        let cubic = (high2 * high - low2 * low) * (1.0 / 3.0);
        let plain = linear - (high * rho_high - low * rho_low) * r + (gap * linear + cubic) * (r * r);
        let (cube_low, cube_high) = (low2 * rho_low + gap * rho_low, high2 * rho_high + gap * rho_high);
        let first_moment = (high2 - low2) * 0.5 - (cube_high - cube_low) * (r * 2.0 / 3.0)
            + (gap * (high2 - low2) * 0.5 + (high2 * high2 - low2 * low2) * 0.25) * (r * r);
        Parts { plain, first_moment, ratio: asinh_ratio(gap, (low, rho_low), (high, rho_high)) }
    }
}

impl Parts {
    fn without(&self, other: &Self) -> Self {
        Self {
            plain: self.plain - other.plain,
            first_moment: self.first_moment - other.first_moment,
            ratio: self.ratio / other.ratio,
        }
    }
}

/// exp(asinh(high/|n|) − asinh(low/|n|)), without cancellation for either sign: |s| + ρ is large where s + ρ would cancel.
#[inline]
fn asinh_ratio(gap: f64x4, (low, rho_low): (f64x4, f64x4), (high, rho_high): (f64x4, f64x4)) -> f64x4 {
    let tiny = f64x4::splat(1e-150);
    let at_low = low.abs() + rho_low.fast_max(tiny);
    let at_high = high.abs() + rho_high.fast_max(tiny);
    let ahead = low.simd_ge(f64x4::ZERO);
    let behind = high.simd_lt(f64x4::ZERO);
    let mixed = at_high * at_low / gap.fast_max(tiny);
    ahead.select(at_high / at_low, behind.select(at_low / at_high, mixed))
}

/// The share of an interval that lies inside the cone across + along·s ≥ c√(gap + s²), 0 ≤ c < 1; empty shares have equal ends.
#[inline]
fn cone_share(gap: f64x4, along: f64x4, across: f64x4, c: f64, within: Interval) -> Interval {
    let zero = f64x4::ZERO;
    let a = along * along - f64x4::splat(c * c);
    let a = a.abs().simd_lt(f64x4::splat(1e-14)).select(f64x4::splat(1e-14), a);
    let b = along * across;
    let constant = across * across - gap * (c * c);
    let discriminant = b * b - a * constant;
    let root = discriminant.fast_max(zero).sqrt();
    let q = -(b + b.simd_lt(zero).select(-root, root));
    let q = q.abs().simd_lt(f64x4::splat(1e-200)).select(f64x4::splat(1e-200), q);
    let (one, two) = (q / a, constant / q);
    let (lower, upper) = (one.fast_min(two), one.fast_max(two));
    let far = f64x4::splat(f64::MAX);
    // A line steeper than the cone enters it once; one less steep passes through it, through its mirror image, or neither.
    let steep = a.simd_gt(zero);
    let forward = along.simd_gt(zero);
    let middle = (lower + upper) * 0.5;
    let passes = discriminant.simd_gt(zero) & (across + along * middle).simd_gt(zero);
    let start = steep.select(forward.select(upper, -far), passes.select(lower, far));
    let end = steep.select(forward.select(far, lower), passes.select(upper, -far));
    let low = within.low.fast_max(start).fast_min(within.high);
    Interval { low, high: within.high.fast_min(end).fast_max(low) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// W₀ and W₁ by brute force, the sector tested point by point.
    fn brute_force(felt: &Felt, lanes: &SegmentLanes, lane: usize) -> [f64; 2] {
        let n = 400_000;
        let (first, last) = (lanes.first[lane], lanes.last[lane]);
        let step = (last - first) / n as f64;
        let mut sum = [0.0; 2];
        for i in 0..n {
            let s = first + (i as f64 + 0.5) * step;
            let rho = (lanes.gap[lane] + s * s).sqrt();
            if rho < felt.reach && lanes.across[lane] + lanes.along[lane] * s >= felt.cos_sector * rho {
                let w = (1.0 - rho / felt.reach).powi(2) * step;
                sum = [sum[0] + w, sum[1] + w * s];
            }
        }
        sum
    }

    fn four() -> SegmentLanes {
        SegmentLanes {
            gap: [9.0, 0.0, 30.0, 64.0],
            first: [-20.0, -3.0, 1.0, -7.0],
            last: [20.0, 8.0, 6.0, -0.5],
            along: [0.9, 1.0, -0.3, 0.1],
            across: [1.1, 0.0, -4.0, 7.0],
        }
    }

    #[test]
    fn closed_forms_equal_the_integrals_for_wide_and_narrow_sectors() {
        for cos_sector in [-2.0, -0.5, 0.0, 0.3, 0.9] {
            let felt = Felt { reach: 10.0, cos_sector };
            for mirror in [1.0, -1.0] {
                let mut lanes = four();
                lanes.along = lanes.along.map(|x| mirror * x);
                let [w0, w1] = felt.moments(&lanes);
                for lane in 0..LANES {
                    let [b0, b1] = brute_force(&felt, &lanes, lane);
                    let error = (w0[lane] - b0).abs().max((w1[lane] - b1).abs() / 10.0);
                    assert!(error < 2e-4, "cos {cos_sector}, lane {lane}: {} {b0}, {} {b1}", w0[lane], w1[lane]);
                }
            }
        }
    }

    #[test]
    fn what_the_ends_tell_agrees_with_the_integral() {
        let felt = Felt { reach: 10.0, cos_sector: -0.5 };
        for (first, last, along, across, view) in [
            (1.0, 5.0, 0.6, 2.0, View::Whole),
            (-9.0, -6.0, 1.0, 0.0, View::Nothing),
            (-9.0, 6.0, 1.0, 0.0, View::Part),
        ] {
            let ends = [across + along * first, across + along * last];
            assert_eq!(felt.view(ends, [4.0 + first * first, 4.0 + last * last]), view);
            let lanes = SegmentLanes {
                gap: [4.0; LANES],
                first: [first; LANES],
                last: [last; LANES],
                along: [along; LANES],
                across: [across; LANES],
            };
            let found = felt.moments(&lanes);
            match view {
                View::Whole => {
                    let whole = felt.moments_of_whole(&lanes);
                    assert!((0..2).all(|k| (whole[k][0] - found[k][0]).abs() < 1e-13));
                }
                View::Nothing => assert!(found[0][0].abs() < 1e-13 && found[1][0].abs() < 1e-12),
                View::Part => assert!(found[0][0] > 0.1),
            }
        }
    }

    #[test]
    fn parts_of_a_segment_add_up_to_it() {
        let felt = Felt { reach: 10.0, cos_sector: -0.5 };
        let whole = felt.moments(&four());
        for share in [0.1, 0.37, 0.8] {
            let (mut left, mut right) = (four(), four());
            for lane in 0..LANES {
                let cut = left.first[lane] + share * (left.last[lane] - left.first[lane]);
                (left.last[lane], right.first[lane]) = (cut, cut);
            }
            let (left, right) = (felt.moments(&left), felt.moments(&right));
            for k in 0..2 {
                for lane in 0..LANES {
                    assert!((left[k][lane] + right[k][lane] - whole[k][lane]).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn a_lane_does_not_feel_the_others_and_empty_lanes_give_zero() {
        let felt = Felt { reach: 10.0, cos_sector: -0.5 };
        let together = felt.moments(&four());
        for lane in 0..LANES {
            let mut alone = SegmentLanes::default();
            alone.gap[3 - lane] = four().gap[lane];
            alone.first[3 - lane] = four().first[lane];
            alone.last[3 - lane] = four().last[lane];
            alone.along[3 - lane] = four().along[lane];
            alone.across[3 - lane] = four().across[lane];
            let found = felt.moments(&alone);
            assert_eq!(found[0][3 - lane].to_bits(), together[0][lane].to_bits());
            assert_eq!(found[1][3 - lane].to_bits(), together[1][lane].to_bits());
            assert!((0..LANES).filter(|other| *other != 3 - lane).all(|other| found[0][other] == 0.0));
        }
    }
}
