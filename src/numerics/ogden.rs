//! The one-term Ogden material: stiffening or softening as its exponent says.
//!
//! ```text
//! W = 2µ/α² (Σ_i λ_i^α − d − α ln J) + λ/4 (J² − 1 − 2 ln J),     λ_i the principal stretches.
//! ```
//! α = 2 is the [neo-Hookean](crate::numerics::material::NeoHookean) law; µ is the shear modulus whatever α is. With C = FᵀF and its
//! eigenvalues c_i, unit eigenvectors N_i, the second Piola–Kirchhoff stress is
//!
//! ```text
//! S = a(C) + p C⁻¹,   a(c) = (2µ/α)(c^{α/2−1} − 1/c),   p = λ/2 (J² − 1),
//! dS = Σ_ij a[c_i, c_j] (N_i·dC N_j) N_i ⊗ N_j + λ/2 J² (C⁻¹:dC) C⁻¹ − p C⁻¹ dC C⁻¹,
//! ```
//! with the divided differences of a, whose limit is a'. In plane strain a Mooney–Rivlin law is neo-Hookean with another volumetric term
//! (the second invariant of C is J² + tr C); so it is this one that bends curves. Ogden, Proc. R. Soc. A 328 (1972).

use crate::numerics::material::{Lame, Material, Tensor, eigen_decomposition, jacobian};

/// The one-term Ogden material; `+∞` if `J ≤ 0`. Brain tissue is described by α from −20 to −5: it stiffens in compression and in shear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ogden {
    /// Lamé parameters (Pa).
    pub lame: Lame,
    /// Exponent α, not zero.
    pub exponent: f64,
}

/// Eigenvalues nearer to each other than this share of their sum have the derivative for their divided difference.
const NEAR: f64 = 1e-5;

impl Ogden {
    fn isotropic(&self, c: f64) -> f64 {
        2.0 * self.lame.mu / self.exponent * (c.powf(0.5 * self.exponent - 1.0) - 1.0 / c)
    }

    fn isotropic_slope(&self, c: f64) -> f64 {
        let half = 0.5 * self.exponent;
        2.0 * self.lame.mu / self.exponent * ((half - 1.0) * c.powf(half - 2.0) + 1.0 / (c * c))
    }

    fn divided(&self, a: f64, b: f64) -> f64 {
        if (a - b).abs() < NEAR * (a + b) {
            self.isotropic_slope(0.5 * (a + b))
        } else {
            (self.isotropic(a) - self.isotropic(b)) / (a - b)
        }
    }

    fn pressure(&self, j: f64) -> f64 {
        0.5 * self.lame.lambda * (j - 1.0) * (j + 1.0)
    }

    /// S of eigenvalues and eigenvectors of C.
    fn second_stress<const D: usize>(&self, values: &[f64; D], vectors: &Tensor<D>, j: f64) -> Tensor<D> {
        let pressure = self.pressure(j);
        spectral(vectors, |i| self.isotropic(values[i]) + pressure / values[i])
    }
}

/// Σ_i s_i N_i ⊗ N_i.
fn spectral<const D: usize>(vectors: &Tensor<D>, s: impl Fn(usize) -> f64) -> Tensor<D> {
    (0..D).fold(Tensor::zeros(), |sum, i| sum + vectors.column(i) * vectors.column(i).transpose() * s(i))
}

impl<const D: usize> Material<D> for Ogden {
    fn name(&self) -> &'static str {
        "ogden"
    }

    fn energy(&self, gradient: &Tensor<D>) -> f64 {
        let j = jacobian(gradient);
        if j.is_nan() || j <= 0.0 {
            return f64::INFINITY;
        }
        let (Lame { lambda, mu }, alpha) = (self.lame, self.exponent);
        let (values, _) = eigen_decomposition(gradient.transpose() * gradient);
        let shape: f64 = values.iter().map(|c| c.powf(0.5 * alpha) - 1.0).sum::<f64>() - alpha * j.ln();
        2.0 * mu / (alpha * alpha) * shape + 0.25 * lambda * ((j - 1.0) * (j + 1.0) - 2.0 * j.ln())
    }

    fn stress(&self, gradient: &Tensor<D>) -> Tensor<D> {
        let (values, vectors) = eigen_decomposition(gradient.transpose() * gradient);
        gradient * self.second_stress(&values, &vectors, jacobian(gradient))
    }

    fn stress_increment(&self, gradient: &Tensor<D>, increment: &Tensor<D>) -> Tensor<D> {
        let j = jacobian(gradient);
        let (values, vectors) = eigen_decomposition(gradient.transpose() * gradient);
        let mixed = gradient.transpose() * increment;
        // dC, and the increment of S, in the frame of the eigenvectors.
        let turned = vectors.transpose() * (mixed + mixed.transpose()) * vectors;
        let dilation: f64 = (0..D).map(|i| turned[(i, i)] / values[i]).sum();
        let pressure = self.pressure(j);
        let change = Tensor::from_fn(|i, k| {
            let apart = turned[(i, k)] * (self.divided(values[i], values[k]) - pressure / (values[i] * values[k]));
            apart + if i == k { 0.5 * self.lame.lambda * j * j * dilation / values[i] } else { 0.0 }
        });
        increment * self.second_stress(&values, &vectors, j) + gradient * (vectors * change * vectors.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::material::{NeoHookean, acoustic_minimum, check_derivatives};
    use nalgebra::{Matrix2, Matrix3};

    fn law(exponent: f64) -> Ogden {
        Ogden { lame: Lame::from_young_poisson(1.0, 0.3).unwrap(), exponent }
    }

    #[test]
    fn stress_and_tangent_are_derivatives_of_the_energy_in_the_plane_and_in_space() {
        let plane = Matrix2::new(1.1, 0.2, -0.05, 0.85);
        let solid = Matrix3::new(1.1, 0.2, -0.05, 0.1, 0.85, 0.3, 0.0, -0.2, 1.2);
        for exponent in [-8.0, -2.0, 1.3, 2.0, 6.0] {
            let defects = [check_derivatives(&law(exponent), &plane), check_derivatives(&law(exponent), &solid)];
            assert!(defects.iter().all(|defect| *defect < 1e-7), "{exponent}: {defects:?}");
            let even = check_derivatives(&law(exponent), &(Matrix2::identity() * 1.1));
            assert!(even < 1e-7, "{exponent}, equal stretches: {even}");
        }
    }

    #[test]
    fn with_the_exponent_two_it_is_neo_hookean() {
        let gradient = Matrix2::new(1.3, 0.2, -0.1, 0.8);
        let increment = Matrix2::new(0.1, -0.3, 0.2, 0.4);
        let (ogden, neo) = (law(2.0), NeoHookean { lame: law(2.0).lame });
        assert!((ogden.energy(&gradient) - neo.energy(&gradient)).abs() < 1e-14);
        assert!((ogden.stress(&gradient) - neo.stress(&gradient)).norm() < 1e-13);
        let tangents = [ogden.stress_increment(&gradient, &increment), neo.stress_increment(&gradient, &increment)];
        assert!((tangents[0] - tangents[1]).norm() < 1e-12);
    }

    #[test]
    fn at_rest_it_is_hookes_law_whatever_the_exponent() {
        let Lame { lambda, mu } = law(2.0).lame;
        let h = Matrix3::new(0.3, 0.1, -0.2, 0.5, -0.4, 0.2, 0.1, 0.6, 0.7);
        let hooke = Matrix3::identity() * (lambda * h.trace()) + (h + h.transpose()) * mu;
        for exponent in [-18.0, -2.0, 4.0] {
            assert!((law(exponent).stress_increment(&Matrix3::identity(), &h) - hooke).norm() < 1e-13);
            assert!(law(exponent).stress(&Matrix3::identity()).norm() < 1e-15);
            assert!((acoustic_minimum(&law(exponent), &Matrix2::identity()) - mu).abs() < 1e-13);
        }
    }

    #[test]
    fn a_large_exponent_stiffens_in_tension_and_a_negative_one_in_compression() {
        let pulled = |exponent: f64, stretch: f64| {
            law(exponent).stress(&Matrix2::from_diagonal(&[stretch, 1.0 / stretch].into()))[(0, 0)]
        };
        assert!(pulled(8.0, 1.5) > 1.5 * pulled(2.0, 1.5));
        assert!(pulled(-8.0, 0.7) < 1.5 * pulled(2.0, 0.7));
        assert_eq!(Material::<2>::energy(&law(-8.0), &Matrix2::new(-1.0, 0.0, 0.0, 1.0)), f64::INFINITY);
    }
}
