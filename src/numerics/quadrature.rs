//! Quadrature on simplices of any dimension: Gauss–Legendre products collapsed onto the simplex (Duffy's map).
//!
//! With `n` points a direction the rule integrates polynomials of total degree `2n − D` exactly.

/// A point of a rule: barycentric weights of the simplex's vertices, and its share of the volume (shares sum to one).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraturePoint<const D: usize> {
    /// Weights of vertices `1..=D`; vertex 0 has `1 − Σ`.
    pub weights: [f64; D],
    /// Share of the volume.
    pub share: f64,
}

impl<const D: usize> QuadraturePoint<D> {
    /// Weight of a local vertex `0..=D`.
    pub fn weight(&self, vertex: usize) -> f64 {
        if vertex == 0 { 1.0 - self.weights.iter().sum::<f64>() } else { self.weights[vertex - 1] }
    }

    /// Position in the simplex with vertex 0 at `origin` and the edge vectors `edges` (µm).
    pub fn position(&self, origin: [f64; D], edges: &[[f64; D]; D]) -> [f64; D] {
        std::array::from_fn(|k| origin[k] + (0..D).map(|i| self.weights[i] * edges[i][k]).sum::<f64>())
    }
}

/// Nodes and weights of Gauss–Legendre quadrature on `(0, 1)`, `(node, weight)`, by Newton's method on the recurrence.
pub fn gauss_legendre(points: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (points as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (value, derivative) = legendre(points, x);
            slope = derivative;
            x -= value / derivative;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..points).map(node).collect()
}

fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    for n in 0..degree {
        let n = n as f64;
        (before, value) = (value, ((2.0 * n + 1.0) * x * value - n * before) / (n + 1.0));
    }
    (value, degree as f64 * (x * value - before) / (x * x - 1.0))
}

/// The collapsed rule with `points` nodes a direction, exact to degree `2 points − D`.
pub fn simplex_rule<const D: usize>(points: usize) -> Vec<QuadraturePoint<D>> {
    let line = gauss_legendre(points);
    let factorial: f64 = (1..=D).map(|i| i as f64).product();
    (0..points.pow(D as u32))
        .map(|mut index| {
            let mut point = QuadraturePoint { weights: [0.0; D], share: factorial };
            let mut rest = 1.0;
            for axis in 0..D {
                let (node, weight) = line[index % points];
                index /= points;
                point.weights[axis] = rest * node;
                point.share *= weight * rest;
                rest *= 1.0 - node;
            }
            point
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|i| i as f64).product()
    }

    #[test]
    fn monomials_up_to_the_stated_degree_are_integrated_exactly() {
        let (plane, space) = (simplex_rule::<2>(5), simplex_rule::<3>(5));
        for (a, b, c) in [(0, 0, 0), (8, 0, 0), (3, 5, 0), (4, 4, 0), (2, 3, 2), (0, 0, 7)] {
            let (pa, pb, pc) = (a as i32, b as i32, c as i32);
            let exact = 6.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
            let value: f64 = space
                .iter()
                .map(|q| q.share * q.weight(1).powi(pa) * q.weight(2).powi(pb) * q.weight(3).powi(pc))
                .sum();
            assert!(a + b + c > 7 || (value - exact).abs() < 1e-15);
            let exact = 2.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 2);
            let value: f64 = plane
                .iter()
                .map(|q| q.share * q.weight(1).powi(pa) * q.weight(2).powi(pb) * q.weight(0).powi(pc))
                .sum();
            assert!((value - exact).abs() < 1e-15, "{a} {b} {c}");
        }
    }
}
