//! The exact cue field of a disc in a rectangle with no flux across its border: a sum over mirror images, in units of q/k.
//! Outside a disc of radius R: c = κR I₁(κR) K₀(κr), so ∇c = −κ · κR I₁(κR) K₁(κr) r̂.

/// A releasing disc.
pub struct Disc {
    pub centre: [f64; 2],
    pub radius: f64,
    pub inverse_decay_length: f64,
}

/// Images farther than this many decay lengths beyond the nearest add less than 1e-16.
const FAR: f64 = 40.0;

/// ∇c at a point outside the disc, in the rectangle from (0, 0) to `size`.
pub fn gradient(disc: &Disc, size: [f64; 2], at: [f64; 2]) -> [f64; 2] {
    let kappa = disc.inverse_decay_length;
    let images = (-2..=2).flat_map(|m| (-2..=2).map(move |n| (m, n))).flat_map(|(m, n)| {
        let corner = [2.0 * f64::from(m) * size[0], 2.0 * f64::from(n) * size[1]];
        let [x, y] = disc.centre;
        [[x, y], [-x, y], [x, -y], [-x, -y]].map(|c| [corner[0] + c[0], corner[1] + c[1]])
    });
    let offsets: Vec<[f64; 2]> = images.map(|c| [at[0] - c[0], at[1] - c[1]]).collect();
    let nearest = offsets.iter().map(|d| d[0].hypot(d[1])).fold(f64::INFINITY, f64::min);
    assert!(nearest > disc.radius, "the formula holds outside the disc");
    let x = kappa * disc.radius;
    let amplitude = kappa * x * bessel_i1(x);
    let mut sum = [0.0; 2];
    for d in offsets {
        let r = d[0].hypot(d[1]);
        if kappa * (r - nearest) < FAR {
            let slope = -amplitude * bessel_k1(kappa * r) / r;
            sum = [sum[0] + slope * d[0], sum[1] + slope * d[1]];
        }
    }
    sum
}

/// I₁ by its power series, for x of order 1.
pub fn bessel_i1(x: f64) -> f64 {
    let (mut term, mut sum) = (0.5 * x, 0.0);
    for n in 1..40 {
        sum += term;
        term *= 0.25 * x * x / f64::from(n * (n + 1));
    }
    sum
}

/// K₁(x) = ∫₀^∞ exp(−x cosh t) cosh t dt by the trapezoidal rule, whose error falls as exp(−π²/h).
pub fn bessel_k1(x: f64) -> f64 {
    let step = 0.2;
    let value = |t: f64| (-x * (t.cosh() - 1.0)).exp() * t.cosh();
    let mut sum = 0.5;
    for i in 1.. {
        let term = value(f64::from(i) * step);
        sum += term;
        if term < 1e-18 * sum {
            break;
        }
    }
    sum * step * (-x).exp()
}
