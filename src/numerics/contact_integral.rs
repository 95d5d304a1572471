//! The integral of a contact law over straight segments, in closed form.
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
//! cone behind (Θ ≥ 90°). The values are additive: cutting a segment changes nothing beyond round-off.
//!
//! Every function takes one segment and has no branches, so that a loop over columns of segments runs in vector registers.

use std::f64::consts::PI;

/// A segment as a cone sees it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sight {
    /// n², squared distance of the line (µm²).
    pub gap: f64,
    /// s at the segment's start (µm).
    pub first: f64,
    /// s at its end, not before the start (µm).
    pub last: f64,
    /// t·e of the unit tangent.
    pub along: f64,
    /// n·e (µm).
    pub across: f64,
}

/// What is felt: reach and sector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// Reach R (µm), positive.
    pub reach: f64,
    /// cos Θ; below −1 there is no sector.
    pub cos_sector: f64,
}

/// How much of a segment is felt, as far as a few products tell. For Θ ≥ 90° what lies behind is convex, and the margin by which
/// a point of the line lies in it is a concave function of its place: it is largest at an end, or where the line comes nearest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum View {
    /// Nothing: out of reach, or in the cone behind.
    Nothing,
    /// What is within reach lies in the sector as a whole.
    Whole,
    /// Perhaps a part.
    Part,
}

/// An interval of s.
#[derive(Clone, Copy)]
struct Interval {
    low: f64,
    high: f64,
}

/// W₀ without its logarithm, W₁, and the ratio (above, below) whose logarithm is asinh(high/|n|) − asinh(low/|n|).
struct Parts {
    plain: f64,
    first_moment: f64,
    ratio: [f64; 2],
}

impl Felt {
    /// What lies within `reach` (µm) and within the angle `half_angle` (rad) of the heading; from π on, all around.
    pub fn ahead(reach: f64, half_angle: f64) -> Self {
        Self { reach, cos_sector: if half_angle >= PI { -2.0 } else { half_angle.cos() } }
    }

    /// What lies within `reach` (µm), all around.
    pub fn around(reach: f64) -> Self {
        Self::ahead(reach, PI)
    }

    /// How much of a segment is felt.
    #[inline(always)]
    pub fn view(&self, sight: &Sight) -> View {
        let Sight { gap, first, last, along, across } = *sight;
        let outside = larger(larger(first, -last), 0.0);
        let within = gap + outside * outside < self.reach * self.reach;
        let (everywhere, wide) = (self.cos_sector < -1.0, self.cos_sector <= 0.0);
        let c2 = self.cos_sector * self.cos_sector;
        let ends = [across + along * first, across + along * last];
        let squares = [gap + first * first, gap + last * last];
        let behind = |k: usize| (ends[k] < 0.0) & (ends[k] * ends[k] >= c2 * squares[k]);
        let nothing = !within | (wide & !everywhere & behind(0) & behind(1));
        // A line that is steeper than the cone behind enters it at one end; one less steep misses it, or passes through.
        let flat = c2 - along * along;
        let misses = (flat > 0.0) & ((across >= 0.0) | (across * across < gap * flat));
        let stays_out = (flat <= 0.0) & !behind(0) & !behind(1);
        let ahead = (ends[0] >= 0.0) & (ends[1] >= 0.0);
        let felt = if everywhere | (wide & (ahead | misses | stays_out)) { View::Whole } else { View::Part };
        if nothing { View::Nothing } else { felt }
    }

    /// W₀ (µm) and W₁ (µm²) of the part within reach, whatever the sector.
    #[inline(always)]
    pub fn moments_within_reach(&self, sight: &Sight) -> [f64; 2] {
        self.finish(sight.gap, &self.parts(sight.gap, self.clipped(sight)))
    }

    /// W₀ (µm) and W₁ (µm²) of the part within reach and sector.
    #[inline(always)]
    pub fn moments_within_sector(&self, sight: &Sight) -> [f64; 2] {
        let clipped = self.clipped(sight);
        let sign = if self.cos_sector > 0.0 { 1.0 } else { -1.0 };
        let share = cone_share(sight, sign, self.cos_sector.abs(), clipped);
        let parts = if self.cos_sector > 0.0 {
            self.parts(sight.gap, share)
        } else {
            let all = self.parts(sight.gap, clipped);
            if self.cos_sector < -1.0 { all } else { all.without(&self.parts(sight.gap, share)) }
        };
        self.finish(sight.gap, &parts)
    }

    #[inline(always)]
    fn clipped(&self, sight: &Sight) -> Interval {
        let room = larger(self.reach * self.reach - sight.gap, 0.0).sqrt();
        let low = larger(sight.first, -room);
        Interval { low, high: larger(smaller(sight.last, room), low) }
    }

    #[inline(always)]
    fn finish(&self, gap: f64, parts: &Parts) -> [f64; 2] {
        [parts.plain - gap * logarithm(parts.ratio) * (1.0 / self.reach), parts.first_moment]
    }

    #[inline(always)]
    fn parts(&self, gap: f64, Interval { low, high }: Interval) -> Parts {
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
    #[inline(always)]
    fn without(&self, other: &Self) -> Self {
        Self {
            plain: self.plain - other.plain,
            first_moment: self.first_moment - other.first_moment,
            ratio: [self.ratio[0] * other.ratio[1], self.ratio[1] * other.ratio[0]],
        }
    }
}

/// The larger of two numbers, as one instruction (no case for NaN).
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// exp(asinh(high/|n|) − asinh(low/|n|)) as a ratio, without cancellation for either sign: |s| + ρ is large where s + ρ would
/// cancel.
#[inline(always)]
fn asinh_ratio(gap: f64, (low, rho_low): (f64, f64), (high, rho_high): (f64, f64)) -> [f64; 2] {
    const TINY: f64 = 1e-150;
    let at_low = low.abs() + larger(rho_low, TINY);
    let at_high = high.abs() + larger(rho_high, TINY);
    let (ahead, behind) = (low >= 0.0, high < 0.0);
    let above = if ahead {
        at_high
    } else if behind {
        at_low
    } else {
        at_high * at_low
    };
    let below = if ahead {
        at_low
    } else if behind {
        at_high
    } else {
        larger(gap, TINY)
    };
    [above, below]
}

/// The share of an interval that lies inside the cone across + along·s ≥ c√(gap + s²), 0 ≤ c < 1, about the heading (`sign` 1)
/// or about what is behind (−1); empty shares have equal ends.
#[inline(always)]
fn cone_share(sight: &Sight, sign: f64, c: f64, within: Interval) -> Interval {
    let (along, across) = (sight.along * sign, sight.across * sign);
    let a = along * along - c * c;
    let a = if a.abs() < 1e-14 { 1e-14 } else { a };
    let b = along * across;
    let constant = across * across - sight.gap * (c * c);
    let discriminant = b * b - a * constant;
    let root = larger(discriminant, 0.0).sqrt();
    let q = -(b + if b < 0.0 { -root } else { root });
    let q = if q.abs() < 1e-200 { 1e-200 } else { q };
    let (one, two) = (q / a, constant / q);
    let (lower, upper) = (smaller(one, two), larger(one, two));
    // A line steeper than the cone enters it once; one less steep passes through it, through its mirror image, or neither.
    let steep = a > 0.0;
    let forward = along > 0.0;
    let middle = (lower + upper) * 0.5;
    let passes = (discriminant > 0.0) & (across + along * middle > 0.0);
    let entry = if forward { upper } else { f64::MIN };
    let exit = if forward { f64::MAX } else { lower };
    let start = if steep {
        entry
    } else if passes {
        lower
    } else {
        f64::MAX
    };
    let end = if steep {
        exit
    } else if passes {
        upper
    } else {
        f64::MIN
    };
    let low = smaller(larger(within.low, start), within.high);
    Interval { low, high: larger(smaller(within.high, end), low) }
}

/// Natural logarithm of the ratio of two positive normal numbers, to a few units in the last place, with one division and
/// without branches: above/below = 2ᵏ(1 + s)/(1 − s) with |s| ≤ 0.172, and log((1 + s)/(1 − s)) = 2s + s·R(s²), R the polynomial of
/// least maximum error that Tang's and the C library's methods use.
#[inline(always)]
fn logarithm([above, below]: [f64; 2]) -> f64 {
    const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    const MANTISSA: u64 = 0x000f_ffff_ffff_ffff;
    const TWO_52: u64 = 0x4330_0000_0000_0000;
    const SQRT_2: f64 = std::f64::consts::SQRT_2;
    // Both as 2ᵏm with m in [√½, √2): no case is left but a ratio of the m's outside that range.
    let split = |x: f64| {
        let bits = x.to_bits().wrapping_add(ONE - SQRT_HALF);
        (f64::from_bits((bits >> 52) | TWO_52), f64::from_bits((bits & MANTISSA) + SQRT_HALF))
    };
    let ((k_above, a), (k_below, b)) = (split(above), split(below));
    let (large, small) = (a > b * SQRT_2, b > a * SQRT_2);
    let a = if large { 0.5 * a } else { a };
    let b = if small { 0.5 * b } else { b };
    let k = (k_above - k_below)
        + if large {
            1.0
        } else if small {
            -1.0
        } else {
            0.0
        };
    let s = (a - b) / (a + b);
    let z = s * s;
    let w = z * z;
    let even = w * (0.399_999_999_994_094_2 + w * (0.222_221_984_321_497_84 + w * 0.153_138_376_992_093_73));
    let odd = z
        * (0.666_666_666_666_673_5
            + w * (0.285_714_287_436_623_9 + w * (0.181_835_721_616_180_5 + w * 0.147_981_986_051_165_86)));
    k * std::f64::consts::LN_2 + (2.0 * s + s * (even + odd))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// W₀ and W₁ by brute force, the sector tested point by point.
    fn brute_force(felt: &Felt, sight: &Sight) -> [f64; 2] {
        let n = 400_000;
        let step = (sight.last - sight.first) / n as f64;
        let mut sum = [0.0; 2];
        for i in 0..n {
            let s = sight.first + (i as f64 + 0.5) * step;
            let rho = (sight.gap + s * s).sqrt();
            if rho < felt.reach && sight.across + sight.along * s >= felt.cos_sector * rho {
                let w = (1.0 - rho / felt.reach).powi(2) * step;
                sum = [sum[0] + w, sum[1] + w * s];
            }
        }
        sum
    }

    const FOUR: [Sight; 4] = [
        Sight { gap: 9.0, first: -20.0, last: 20.0, along: 0.9, across: 1.1 },
        Sight { gap: 0.0, first: -3.0, last: 8.0, along: 1.0, across: 0.0 },
        Sight { gap: 30.0, first: 1.0, last: 6.0, along: -0.3, across: -4.0 },
        Sight { gap: 64.0, first: -7.0, last: -0.5, along: 0.1, across: 7.0 },
    ];

    #[test]
    fn closed_forms_equal_the_integrals_for_wide_and_narrow_sectors() {
        for cos_sector in [-2.0, -0.5, 0.0, 0.3, 0.9] {
            let felt = Felt { reach: 10.0, cos_sector };
            for (sight, mirror) in FOUR.iter().flat_map(|sight| [(sight, 1.0), (sight, -1.0)]) {
                let sight = Sight { along: mirror * sight.along, ..*sight };
                let ([w0, w1], [b0, b1]) = (felt.moments_within_sector(&sight), brute_force(&felt, &sight));
                let error = (w0 - b0).abs().max((w1 - b1).abs() / 10.0);
                assert!(error < 2e-4, "cos {cos_sector}, {sight:?}: {w0} {b0}, {w1} {b1}");
            }
        }
    }

    #[test]
    fn what_the_ends_tell_agrees_with_the_integral() {
        let felt = Felt { reach: 10.0, cos_sector: -0.5 };
        for (first, last, along, across, view) in [
            (1.0, 5.0, 0.6, 2.0, View::Whole),
            (-9.0, -6.0, 1.0, 0.0, View::Nothing),
            (9.9, 12.0, 1.0, 0.0, View::Nothing),
            (-9.0, 6.0, 1.0, 0.0, View::Part),
        ] {
            let sight = Sight { gap: 4.0, first, last, along, across };
            assert_eq!(felt.view(&sight), view, "{sight:?}");
            let found = felt.moments_within_sector(&sight);
            match view {
                View::Whole => {
                    let whole = felt.moments_within_reach(&sight);
                    assert!((0..2).all(|k| (whole[k] - found[k]).abs() < 1e-13));
                }
                View::Nothing => assert!(found[0].abs() < 1e-13 && found[1].abs() < 1e-12),
                View::Part => assert!(found[0] > 0.1),
            }
        }
    }

    #[test]
    fn what_is_seen_whole_has_no_part_behind_wherever_it_lies() {
        let felt = Felt { reach: 10.0, cos_sector: -0.5 };
        let (mut whole, mut part) = (0, 0);
        for i in 0..20_000 {
            let share = |k: u32| (f64::from(i) * 0.618_033_988_75 * f64::from(2 * k + 1)).fract();
            let (n, angle, first) = (9.0 * share(0), std::f64::consts::TAU * share(1), 20.0 * share(2) - 10.0);
            let sight =
                Sight { gap: n * n, first, last: first + 12.0 * share(3), along: angle.cos(), across: n * angle.sin() };
            match felt.view(&sight) {
                View::Whole => {
                    let (all, cut) = (felt.moments_within_reach(&sight), felt.moments_within_sector(&sight));
                    assert!((0..2).all(|k| (all[k] - cut[k]).abs() < 1e-12), "{sight:?}: {all:?} {cut:?}");
                    whole += 1;
                }
                View::Part => part += 1,
                View::Nothing => assert!(felt.moments_within_sector(&sight)[0].abs() < 1e-12, "{sight:?}"),
            }
        }
        assert!(whole > 2 * part && part > 100, "{whole} whole, {part} in part");
    }

    #[test]
    fn a_narrow_sector_and_none_are_seen_as_part_and_whole() {
        let sight = FOUR[2];
        assert_eq!(Felt { reach: 10.0, cos_sector: 0.3 }.view(&sight), View::Part);
        assert_eq!(Felt { reach: 10.0, cos_sector: -2.0 }.view(&sight), View::Whole);
        assert_eq!(Felt { reach: 5.0, cos_sector: -2.0 }.view(&sight), View::Nothing);
    }

    #[test]
    fn parts_of_a_segment_add_up_to_it() {
        let felt = Felt { reach: 10.0, cos_sector: -0.5 };
        for (sight, share) in FOUR.iter().flat_map(|sight| [0.1, 0.37, 0.8].map(|share| (sight, share))) {
            let cut = sight.first + share * (sight.last - sight.first);
            let whole = felt.moments_within_sector(sight);
            let (left, right) = (
                felt.moments_within_sector(&Sight { last: cut, ..*sight }),
                felt.moments_within_sector(&Sight { first: cut, ..*sight }),
            );
            assert!((0..2).all(|k| (left[k] + right[k] - whole[k]).abs() < 1e-13), "{sight:?} {share}");
        }
    }

    #[test]
    fn the_logarithm_of_a_ratio_is_good_to_a_few_units_in_the_last_place() {
        for i in 0..200_000 {
            let x = 1e-3 * 1.000_13_f64.powi(i % 100_000) * (1.0 + f64::from(i) * 1e-9);
            let below = 0.3 + f64::from(i % 1009) * 0.01;
            let (found, expected) = (logarithm([x * below, below]), (x * below / below).ln());
            let room = 3.0 * f64::EPSILON * expected.abs().max(1.0);
            assert!((found - expected).abs() <= room, "{x} {below}: {found} {expected}");
        }
        assert_eq!(logarithm([1.0, 1.0]), 0.0);
        assert_eq!(logarithm([1e-150, 1e-150]), 0.0);
    }
}
