//! The turning law of a growth cone, eq. (1), in closed form.
//!
//! The heading `e` (a unit vector) turns toward the pull `L̂` at the rate `κ` (1/h):
//! ```text
//! ė = κ (L̂ − (L̂·e) e) = κ (e ∧ L̂) ∧ e.
//! ```
//! For a pull that stays, `u = L̂/|L̂|` and `τ = κ|L̂|Δt`, the angle `β` between `e` and `u` obeys `tan(β/2) → tan(β/2) e^{−τ}`.
//! With `w = |e + u|²/2 = 1 + e·u`, `p` the part of `e` perpendicular to `u` and `q = e^{−τ}` the flow is, in any dimension,
//! ```text
//! e' = { 2q p + [w − q² (2 − w)] u } / { w + q² (2 − w) }.
//! ```
//! This is `e' = [e + (sinh τ + (cosh τ − 1) c) u]/(cosh τ + c sinh τ)` rearranged so that nothing cancels where `e` looks
//! away from the pull (`w → 0`, where `p` is taken from `e + u`) and nothing overflows for large `τ`. It never overshoots,
//! whatever `Δt`.
//!
//! Headings are 3-vectors; in a planar scene `z` is `+0` before and after, to the last bit.

use nalgebra::Vector3;

/// The part of `pull` perpendicular to the unit heading: `(e ∧ L) ∧ e = L − (L·e) e`, in the units of the pull.
///
/// As a double cross product it is perpendicular to `e` to round-off of *itself*, also where `pull` is nearly parallel.
pub fn perpendicular_part(pull: &Vector3<f64>, heading: &Vector3<f64>) -> Vector3<f64> {
    // Adding +0 turns −0 into +0: z keeps its bits in a planar scene.
    heading.cross(pull).cross(heading).map(|component| component + 0.0)
}

/// What a frozen pull does over a step: direction `u`, angle of turning `τ`, and `p` and `w` of the heading.
struct Pull {
    direction: Vector3<f64>,
    tau: f64,
    perpendicular: Vector3<f64>,
    closeness: f64,
}

impl Pull {
    /// `None` where the heading cannot turn: no pull, no time, or looking exactly away.
    fn new(heading: &Vector3<f64>, pull: &Vector3<f64>, rate_times_step: f64) -> Option<Self> {
        let strength = pull.norm();
        let tau = rate_times_step * strength;
        if tau == 0.0 {
            return None;
        }
        let direction = pull / strength;
        let sum = heading + direction;
        let closeness = 0.5 * sum.norm_squared();
        let perpendicular = sum - direction * sum.dot(&direction);
        (closeness > 0.0).then_some(Self { direction, tau, perpendicular, closeness })
    }
}

/// Exact flow of `ė = κ(L̂ − (L̂·e)e)` over a step for a pull that stays: the heading after it.
///
/// `heading`: unit vector; `pull`: `L̂` (dimensionless, any length); `rate_times_step`: `κΔt ≥ 0`. The result has length 1 to
/// 2 ulp. Looking exactly away (`e = −u`) is an unstable equilibrium: the heading stays, as it does bit for bit without a pull.
/// The relative condition number of `tan(β/2)` is `1/sin β`, so near `β = π` errors of the input grow by `1/(π − β)`.
/// Source: closed form of eq. (1) of the paper.
pub fn turn(heading: &Vector3<f64>, pull: &Vector3<f64>, rate_times_step: f64) -> Vector3<f64> {
    let Some(Pull { direction, tau, perpendicular, closeness }) = Pull::new(heading, pull, rate_times_step) else {
        return *heading;
    };
    let decay = (-tau).exp();
    let far = decay * decay * (2.0 - closeness);
    let denominator = closeness + far;
    normalised(perpendicular * (2.0 * decay / denominator) + direction * ((closeness - far) / denominator))
}

/// Exact `∫₀^Δt e dt` (h) for a pull that stays, starting at `heading`: times the speed it is the path of the cone.
///
/// With `τ = κ|L̂|Δt` and the part `p` of `e` perpendicular to `u`, `s = |p|`:
/// ```text
/// ∫e dt = Δt/τ { [τ + ln((w + q²(2−w))/2)] u + (β₀ − β) p/s },     tan((β₀−β)/2) = s (1−q)/(w + q (2−w)).
/// ```
/// `rate`: `κ` (1/h); `step`: `Δt` (h). Without a pull, and looking exactly away from it, the path is straight.
pub fn integral_of_turn(heading: &Vector3<f64>, pull: &Vector3<f64>, rate: f64, step: f64) -> Vector3<f64> {
    let Some(Pull { direction, tau, perpendicular, closeness }) = Pull::new(heading, pull, rate * step) else {
        return heading * step;
    };
    let decay = (-tau).exp();
    let half = 0.5 * closeness;
    let shrunk = half + decay * decay * (1.0 - half);
    // Near 1 the logarithm is taken of the difference from 1, which is known without cancellation.
    let logarithm = if shrunk < 0.5 { shrunk.ln() } else { ((-2.0 * tau).exp_m1() * (1.0 - half)).ln_1p() };
    let sine = perpendicular.norm();
    let along = direction * (1.0 + logarithm / tau);
    if sine == 0.0 {
        return along * step;
    }
    let angle = 2.0 * (-sine * (-tau).exp_m1()).atan2(closeness + decay * (2.0 - closeness));
    (along + perpendicular * (angle / (tau * sine))) * step
}

/// What the paper's parameters are, given those that can be identified.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derived {
    /// `ω = √(2 κ v_g/l₀)` (1/h).
    pub omega: f64,
    /// `ω δt` (dimensionless): the turn in a filopodium's life; the paper's law is a limit for small values.
    pub omega_filopodia_time: f64,
    /// Turning radius `v_g/κ` (µm) under a unit pull square to the heading.
    pub turning_radius: f64,
}

/// The paper's `ω` and what follows from it, from `κ` (1/h), `l₀` (µm), `v_g` (µm/h) and `δt` (h).
///
/// From `κ = ω² l₀/(2 v_g)`. Ours: only `κ` can be identified from turning assays, so `ω` is derived.
pub fn derived(turning_rate: f64, filopodium_length: f64, speed: f64, filopodia_time: f64) -> Derived {
    let omega = (2.0 * turning_rate * speed / filopodium_length).sqrt();
    Derived { omega, omega_filopodia_time: omega * filopodia_time, turning_radius: speed / turning_rate }
}

/// Rotates a vector about z by `angle` (rad, counter-clockwise); z is untouched, and a zero angle keeps every bit.
pub fn rotate_in_plane(vector: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    let (sine, cosine) = angle.sin_cos();
    Vector3::new(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y, vector.z)
}

/// Turns a unit heading by increments (rad) in its tangent directions: a step of heading diffusion.
///
/// `planar`: by the first increment, about z, the second is not used. Otherwise along the geodesic that starts in the direction
/// `dθ₁ a + dθ₂ b`, by the angle `√(dθ₁² + dθ₂²)`, with `(a, b)` a tangent frame that is a fixed function of the heading. A
/// zero kick keeps every bit.
pub fn kick(heading: &Vector3<f64>, increments: [f64; 2], planar: bool) -> Vector3<f64> {
    if planar {
        return if increments[0] == 0.0 { *heading } else { normalised(rotate_in_plane(heading, increments[0])) };
    }
    let angle = increments[0].hypot(increments[1]);
    if angle == 0.0 {
        return *heading;
    }
    let (first, second) = tangent_frame(heading);
    let direction = (first * increments[0] + second * increments[1]) / angle;
    let (sine, cosine) = angle.sin_cos();
    normalised(heading * cosine + direction * sine)
}

/// Two unit vectors square to a unit vector and to each other, smooth but for the plane `z = 0`.
///
/// Source: Duff et al., "Building an orthonormal basis, revisited", JCGT 6 (2017).
pub fn tangent_frame(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let sign = 1.0f64.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let first = Vector3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let second = Vector3::new(b, sign + normal.y * normal.y * a, -normal.y);
    (first, second)
}

fn normalised(vector: Vector3<f64>) -> Vector3<f64> {
    vector / vector.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn at(angle: f64) -> Vector3<f64> {
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    }

    /// A pull of length 0.7 and a heading at the angle `beta` from it, in a tilted plane.
    fn tilted(beta: f64) -> (Vector3<f64>, Vector3<f64>) {
        let u = Vector3::new(0.36, 0.48, 0.8);
        let p = u.cross(&Vector3::new(0.1, -0.9, 0.3)).normalize();
        ((u * beta.cos() + p * beta.sin()).normalize(), u * 0.7)
    }

    fn tan_half(e: &Vector3<f64>, u: &Vector3<f64>) -> f64 {
        let u = u.normalize();
        (e - u).norm() / (e + u).norm()
    }

    #[test]
    fn the_tangent_of_half_the_angle_decays_exponentially_for_any_step() {
        for beta in [1e-6, 0.1, 1.0, PI / 2.0, 2.5, 3.1, PI - 1e-4, PI - 1e-8] {
            for tau in [1e-9, 0.01, 0.5, 3.0, 18.4, 30.0, 100.0] {
                let (e, pull) = tilted(beta);
                let after = turn(&e, &pull, tau / 0.7);
                let exact = 2.0 * (tan_half(&e, &pull) * (-tau).exp()).atan();
                let found = 2.0 * tan_half(&after, &pull).atan();
                // An input known to one ulp moves tan(β/2) by ε/(π − β) relative, hence the angle by that times sin β'.
                let bound = 8.0 * f64::EPSILON * (1.0 + exact.sin() / (PI - beta).min(1.0));
                assert!((found - exact).abs() <= bound, "β {beta} τ {tau}: {found} for {exact}");
            }
        }
    }

    #[test]
    fn near_half_a_turn_an_exactly_given_heading_loses_no_digit() {
        let delta = 1e-8;
        let e = Vector3::new(-1.0, delta, 0.0);
        for tau in [1.0, 10.0, 18.0, 19.0, 25.0] {
            let after = turn(&e, &Vector3::x(), tau);
            let exact = 2.0 * (2.0 / delta * (-tau).exp()).atan();
            let found = after.y.atan2(after.x);
            assert!((found / exact - 1.0).abs() < 1e-15 * 20.0, "τ {tau}: {found} for {exact}");
        }
    }

    #[test]
    fn two_turns_make_one() {
        for beta in [0.3, 1.7, 3.0] {
            let (e, pull) = tilted(beta);
            let twice = turn(&turn(&e, &pull, 0.4), &pull, 1.1);
            assert!((twice - turn(&e, &pull, 1.5)).norm() < 2e-15);
        }
    }

    #[test]
    fn a_heading_keeps_its_length_to_two_ulp() {
        for k in 0..2000 {
            let (e, pull) = tilted(k as f64 * PI / 2000.0);
            for rate_times_step in [1e-3, 0.3, 20.0] {
                let length = turn(&e, &pull, rate_times_step).norm();
                assert!((length - 1.0).abs() <= 2.0 * f64::EPSILON, "{length}");
            }
        }
    }

    #[test]
    fn the_turn_starts_with_the_perpendicular_part_of_the_pull() {
        let (e, pull) = tilted(1.2);
        let h = 1e-4;
        let slope = (turn(&e, &pull, h) - turn(&e, &pull, -h)) / (2.0 * h);
        assert!((slope - perpendicular_part(&pull, &e)).norm() < 1e-8);
        assert!((perpendicular_part(&pull, &e) - (pull - e * e.dot(&pull))).norm() < 1e-15);
    }

    #[test]
    fn a_planar_heading_stays_planar_to_the_last_bit() {
        let zero = 0.0f64.to_bits();
        let mut e = at(0.3);
        for k in 0..1000 {
            let pull = Vector3::new((k as f64).cos(), (1.3 * k as f64).sin(), if k % 2 == 0 { 0.0 } else { -0.0 });
            assert_eq!(perpendicular_part(&pull, &e).z.to_bits(), zero);
            e = kick(&turn(&e, &pull, 0.1), [0.05 * (k as f64).sin(), 3.0], true);
            assert_eq!(e.z.to_bits(), zero);
            assert_eq!(integral_of_turn(&e, &pull, 0.9, 0.1).z, 0.0);
        }
    }

    #[test]
    fn without_a_pull_and_exactly_opposite_the_heading_keeps_its_bits() {
        let (e, pull) = tilted(2.0);
        assert_eq!(turn(&e, &Vector3::zeros(), 0.3), e);
        assert_eq!(turn(&e, &pull, 0.0), e);
        assert_eq!(turn(&Vector3::x(), &-Vector3::x(), 5.0), Vector3::x());
        assert_eq!(kick(&e, [0.0, 0.0], false), e);
        assert_eq!(integral_of_turn(&Vector3::x(), &-Vector3::x(), 1.0, 2.0), Vector3::x() * 2.0);
        assert_eq!(integral_of_turn(&e, &Vector3::zeros(), 1.0, 2.0), e * 2.0);
    }

    #[test]
    fn the_integral_is_the_sum_of_the_turning_heading() {
        let (rate, step, pieces) = (1.3, 0.8, 400);
        for beta in [1e-7, 0.5, 1.5, 3.0, PI - 1e-3] {
            let (e, pull) = tilted(beta);
            // Simpson's rule on the flow itself.
            let sample = |k: usize| turn(&e, &pull, rate * step * k as f64 / pieces as f64);
            let weight = |k: usize| if k == 0 || k == pieces { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
            let sum = (0..=pieces).fold(Vector3::zeros(), |sum, k| sum + sample(k) * weight(k));
            let simpson = sum * (step / (3.0 * pieces as f64));
            let exact = integral_of_turn(&e, &pull, rate, step);
            assert!((simpson - exact).norm() < 1e-11, "β {beta}: {simpson} {exact}");
        }
    }

    #[test]
    fn the_integral_has_its_limits_for_short_and_for_endless_steps() {
        let (e, pull) = tilted(2.0);
        let short = integral_of_turn(&e, &pull, 1.0, 1e-12);
        assert!((short * 1e12 - e).norm() < 1e-11);
        let long = integral_of_turn(&e, &pull, 1.0, 1e6);
        let u = pull.normalize();
        // All but the transient is along u: x = t + ln(cos²(β₀/2))/r, y = β₀/r.
        let rate = 0.7;
        assert!((long.dot(&u) - (1e6 + (1.0f64.cos().powi(2)).ln() / rate)).abs() < 1e-8);
        assert!(((long - u * long.dot(&u)).norm() - 2.0 / rate).abs() < 1e-8);
    }

    #[test]
    fn a_kick_turns_by_its_angle_in_a_frame_square_to_the_heading() {
        for k in 0..50 {
            let (e, _) = tilted(k as f64 * 0.13);
            let (a, b) = tangent_frame(&e);
            for product in [a.dot(&b), a.dot(&e), b.dot(&e), a.norm() - 1.0, b.norm() - 1.0] {
                assert!(product.abs() < 1e-15 * 4.0);
            }
            let kicked = kick(&e, [0.3, -0.4], false);
            assert!((kicked.dot(&e) - 0.5f64.cos()).abs() < 1e-15 * 4.0);
        }
        assert!((kick(&at(0.2), [0.3, 9.0], true) - at(0.5)).norm() < 1e-15);
    }

    #[test]
    fn the_defaults_give_the_figures_of_the_model() {
        let Derived { omega, omega_filopodia_time, turning_radius } = derived(0.93, 10.0, 20.0, 2.0 / 60.0);
        assert!((omega * omega * 10.0 / (2.0 * 20.0) - 0.93).abs() < 1e-15);
        assert!((omega_filopodia_time - 0.064).abs() < 1e-3);
        assert!((turning_radius - 21.5).abs() < 0.01);
    }
}
