//! Explicit Runge–Kutta methods as data, and where they are stable.
//!
//! A step of `y' = f(t, y)` by a Butcher tableau `(A, b, c)` is
//! ```text
//! k_i = f(t + c_i Δt, y + Δt Σ_j<i a_ij k_j),     y' = y + Δt Σ_i b_i k_i.
//! ```
//! On `y' = −κ y` it multiplies by the stability polynomial `R(−κΔt)`; the method is stable while `|R| ≤ 1`.

/// An explicit Runge–Kutta method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ButcherTableau {
    /// Name, as in scenario files.
    pub name: &'static str,
    /// Strictly lower triangular: row `i` has the `i` weights of the stages before it.
    pub a: &'static [&'static [f64]],
    /// Weights of the stages in the step.
    pub b: &'static [f64],
    /// Weights of a second step, for an estimate of the error; empty if the method has none.
    pub embedded: &'static [f64],
    /// Times of the stages, in steps.
    pub c: &'static [f64],
    /// Order of accuracy of the step by `b`.
    pub order: u32,
}

/// Euler's method, order 1; stable for `κΔt ≤ 2`.
pub const EULER: ButcherTableau =
    ButcherTableau { name: "euler", a: &[&[]], b: &[1.0], embedded: &[], c: &[0.0], order: 1 };

/// Heun's method (explicit trapezium), order 2; stable for `κΔt ≤ 2`.
pub const HEUN: ButcherTableau =
    ButcherTableau { name: "heun", a: &[&[], &[1.0]], b: &[0.5, 0.5], embedded: &[], c: &[0.0, 1.0], order: 2 };

/// The classical method of Runge and Kutta, order 4; stable for `κΔt ≤ 2.785`.
pub const RK4: ButcherTableau = ButcherTableau {
    name: "rk4",
    a: &[&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
    b: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
    embedded: &[],
    c: &[0.0, 0.5, 0.5, 1.0],
    order: 4,
};

/// The embedded pair of Bogacki and Shampine, order 3 with an estimate of order 2; stable for `κΔt ≤ 2.513`.
///
/// Source: Appl. Math. Lett. 2 (1989) 321–325. Its last stage is the first of the next step.
pub const BOGACKI_SHAMPINE: ButcherTableau = ButcherTableau {
    name: "bogacki_shampine",
    a: &[&[], &[0.5], &[0.0, 0.75], &[2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0]],
    b: &[2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0],
    embedded: &[7.0 / 24.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 8.0],
    c: &[0.0, 0.5, 0.75, 1.0],
    order: 3,
};

impl ButcherTableau {
    /// Number of evaluations of the right-hand side a step.
    pub fn stages(&self) -> usize {
        self.b.len()
    }

    /// The stability polynomial `R(z)`, `z = Δt` times the eigenvalue (negative for decay).
    pub fn stability_polynomial(&self, z: f64) -> f64 {
        let mut stages: Vec<f64> = Vec::with_capacity(self.stages());
        for row in self.a {
            let state = 1.0 + z * weighted(row, &stages);
            stages.push(state);
        }
        1.0 + z * weighted(self.b, &stages)
    }

    /// The largest `κΔt` up to which decay is not amplified: `|R(−x)| ≤ 1` for all `0 ≤ x ≤ stability_limit`.
    pub fn stability_limit(&self) -> f64 {
        const SCAN: f64 = 1e-3;
        const FARTHEST: usize = 100_000;
        let stable = |x: f64| self.stability_polynomial(-x).abs() <= 1.0;
        let Some(first) = (1..FARTHEST).find(|&k| !stable(SCAN * k as f64)) else {
            return f64::INFINITY;
        };
        let (mut low, mut high) = (SCAN * (first - 1) as f64, SCAN * first as f64);
        while high - low > 1e-13 {
            let middle = 0.5 * (low + high);
            if stable(middle) { low = middle } else { high = middle }
        }
        low
    }
}

fn weighted(weights: &[f64], stages: &[f64]) -> f64 {
    weights.iter().zip(stages).map(|(weight, stage)| weight * stage).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ButcherTableau; 4] = [EULER, HEUN, RK4, BOGACKI_SHAMPINE];

    /// The order conditions up to order 4, by rooted trees, of the weights `b`: those of order `p` must hold for all up to `p`.
    fn broken_order(method: &ButcherTableau, b: &[f64]) -> u32 {
        let c = method.c;
        let n = method.stages();
        let ac = |power: i32| -> Vec<f64> {
            method.a.iter().map(|row| row.iter().zip(c).map(|(a, c)| a * c.powi(power)).sum()).collect()
        };
        let (ac1, ac2) = (ac(1), ac(2));
        let aac: Vec<f64> = method.a.iter().map(|row| weighted(row, &ac1)).collect();
        let sum = |term: &dyn Fn(usize) -> f64| -> f64 { (0..n).map(|i| b[i] * term(i)).sum() };
        let conditions = [
            (1, sum(&|_| 1.0), 1.0),
            (2, sum(&|i| c[i]), 1.0 / 2.0),
            (3, sum(&|i| c[i] * c[i]), 1.0 / 3.0),
            (3, sum(&|i| ac1[i]), 1.0 / 6.0),
            (4, sum(&|i| c[i].powi(3)), 1.0 / 4.0),
            (4, sum(&|i| c[i] * ac1[i]), 1.0 / 8.0),
            (4, sum(&|i| ac2[i]), 1.0 / 12.0),
            (4, sum(&|i| aac[i]), 1.0 / 24.0),
        ];
        conditions.iter().find(|(_, found, wanted)| (found - wanted).abs() > 1e-15).map_or(5, |(order, ..)| *order)
    }

    #[test]
    fn every_method_meets_the_conditions_of_its_order_and_no_more() {
        for method in ALL {
            assert_eq!(broken_order(&method, method.b), method.order + 1, "{}", method.name);
            for (row, c) in method.a.iter().zip(method.c) {
                assert!((row.iter().sum::<f64>() - c).abs() < 1e-15);
            }
            if !method.embedded.is_empty() {
                assert_eq!(broken_order(&method, method.embedded), method.order);
            }
        }
    }

    #[test]
    fn decay_is_stable_up_to_the_limits_in_the_books() {
        // RK4: 1 − x/2 + x²/6 − x³/24 = 0; the pair: −2 = z + z²/2 + z³/6.
        for (method, limit) in ALL.iter().zip([2.0, 2.0, 2.785_293_563_405_282, 2.512_745_326_618_329]) {
            assert!((method.stability_limit() - limit).abs() < 1e-11, "{} {}", method.name, method.stability_limit());
        }
    }

    #[test]
    fn the_stability_polynomial_is_the_exponential_up_to_the_order() {
        for method in ALL {
            let defect = |z: f64| (method.stability_polynomial(z) - z.exp()).abs();
            let order = (defect(-0.02) / defect(-0.01)).log2();
            assert!((order - f64::from(method.order + 1)).abs() < 0.05, "{} {order}", method.name);
        }
    }
}
