//! Modified Bessel functions of order 0 and 1: the radial solutions of Δc = c/ℓ² in the plane.
//!
//! Up to 2 by their power series, beyond by Steed's continued fraction (Temme 1975, doi 10.1016/0021-9991(75)90082-0; Numerical Recipes
//! § 6.7). Relative error below 1e-14.

/// Euler's constant.
const EULER: f64 = 0.577_215_664_901_532_9;
/// Up to here the series are used.
const NEAR: f64 = 2.0;
/// Terms of the series: (x²/4)^n/(n!)² is below 1e-17 for x up to 2 well before; I₀ and I₁ go on until nothing is added.
const TERMS: u32 = 16;
/// Cap on the terms of I₀ and I₁ and of the continued fraction.
const MOST: u32 = 500;

/// I₀(x) and I₁(x) for x ≥ 0.
pub fn growing(x: f64) -> [f64; 2] {
    let quarter = 0.25 * x * x;
    let (mut term, mut zero, mut one) = (1.0, 1.0, 1.0);
    for n in (1..MOST).map(f64::from) {
        term *= quarter / (n * n);
        zero += term;
        one += term / (n + 1.0);
        if term <= f64::EPSILON * 0.1 * zero {
            break;
        }
    }
    [zero, 0.5 * x * one]
}

/// K₀(x) and K₁(x) for x > 0; infinite at 0.
pub fn decaying(x: f64) -> [f64; 2] {
    if x <= NEAR { near(x) } else { far(x) }
}

fn near(x: f64) -> [f64; 2] {
    let (quarter, log) = (0.25 * x * x, (0.5 * x).ln());
    let [i0, i1] = growing(x);
    // ψ(n + 1) = H_n − γ.
    let (mut term, mut harmonic) = (1.0, 0.0);
    let (mut zero, mut one) = (0.0, 1.0 - 2.0 * EULER);
    for n in (1..TERMS).map(f64::from) {
        term *= quarter / (n * n);
        harmonic += 1.0 / n;
        zero += term * harmonic;
        one += term / (n + 1.0) * (2.0 * harmonic + 1.0 / (n + 1.0) - 2.0 * EULER);
    }
    [zero - (log + EULER) * i0, 1.0 / x + log * i1 - 0.25 * x * one]
}

fn far(x: f64) -> [f64; 2] {
    let mut b = 2.0 * (1.0 + x);
    let mut d = 1.0 / b;
    let (mut h, mut step) = (d, d);
    let (mut before, mut last) = (0.0, 1.0);
    let (mut q, mut c, mut a) = (0.25, 0.25, -0.25);
    let mut s = 1.0 + q * step;
    for i in (2..MOST).map(f64::from) {
        a -= 2.0 * (i - 1.0);
        c *= -a / i;
        (before, last) = (last, (before - b * last) / a);
        q += c * last;
        b += 2.0;
        d = 1.0 / (b + a * d);
        step *= b * d - 1.0;
        h += step;
        s += q * step;
        if (q * step / s).abs() < 0.5 * f64::EPSILON {
            break;
        }
    }
    let zero = (std::f64::consts::FRAC_PI_2 / x).sqrt() * (-x).exp() / s;
    [zero, zero * (x + 0.5 - 0.25 * h) / x]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_tables() {
        // Abramowitz and Stegun, tables 9.8 and 9.11, to their digits.
        let table = [
            (0.1, 2.427_069_024_702_017, 9.853_844_780_870_606),
            (1.0, 0.421_024_438_240_708_3, 0.601_907_230_197_234_6),
            (2.0, 0.113_893_872_749_533_4, 0.139_865_881_816_522_4),
            (5.0, 3.691_098_334_042_594e-3, 4.044_613_445_452_164e-3),
            (10.0, 1.778_006_231_616_765e-5, 1.864_877_345_382_558e-5),
        ];
        for (x, k0, k1) in table {
            let found = decaying(x);
            assert!((found[0] / k0 - 1.0).abs() < 1e-13 && (found[1] / k1 - 1.0).abs() < 1e-13, "{x} {found:?}");
        }
        let found = growing(1.0);
        assert!((found[0] - 1.266_065_877_752_008).abs() < 1e-14 && (found[1] - 0.565_159_103_992_485).abs() < 1e-14);
    }

    #[test]
    fn the_wronskian_is_the_inverse_everywhere_and_the_forms_meet() {
        for i in 1..400 {
            let x = 0.05 * f64::from(i);
            let ([i0, i1], [k0, k1]) = (growing(x), decaying(x));
            assert!(((i0 * k1 + i1 * k0) * x - 1.0).abs() < 2e-14, "{x}");
        }
        let (below, above) = (near(NEAR), far(NEAR));
        assert!((0..2).all(|n| (below[n] / above[n] - 1.0).abs() < 1e-14));
    }
}
