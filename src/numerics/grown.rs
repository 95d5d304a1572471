//! Isotropic growth: the mass source that eq. (3) leaves out, as a split of the deformation gradient. Ours.
//!
//! Tissue that grows would take, if nothing held it, the shape `F_g = g I`; what is left of `F` is elastic and alone is stored
//! (Rodriguez, Hoger and McCulloch, J. Biomech. 27, 1994, doi:10.1016/0021-9290(94)90021-3):
//! ```text
//! F = F_e F_g,   W(F) = g^d W_e(F/g),   P = g^(d−1) P_e(F/g),   dP = g^(d−2) ∂P_e/∂F_e(F/g) : dF,
//! ∂P/∂g at fixed F = ((d − 1) P − ∂P/∂F : F)/g.
//! ```
//! `g` is a ratio of lengths; mass grows as `g^d` at constant density. Ours: in the plane (`d = 2`) tissue grows in the plane only, and
//! the third direction neither grows nor stretches. `g = 1` leaves every bit of the law as it is.

use crate::numerics::material::{Material, Tensor};

/// A law after growth by a factor: itself a law, of the whole deformation gradient.
#[derive(Debug, Clone, Copy)]
pub struct Grown<'l, const D: usize> {
    /// The law of what is elastic.
    pub law: &'l dyn Material<D>,
    /// Ratio `g` of lengths after and before growth, positive.
    pub factor: f64,
}

impl<const D: usize> Grown<'_, D> {
    /// The elastic part `F_e = F/g`.
    pub fn elastic(&self, gradient: &Tensor<D>) -> Tensor<D> {
        gradient / self.factor
    }

    /// `∂P/∂g` at fixed `F` (Pa).
    pub fn stress_by_growth(&self, gradient: &Tensor<D>) -> Tensor<D> {
        (self.stress(gradient) * (D as f64 - 1.0) - self.stress_increment(gradient, gradient)) / self.factor
    }
}

impl<const D: usize> Material<D> for Grown<'_, D> {
    fn name(&self) -> &'static str {
        self.law.name()
    }

    fn energy(&self, gradient: &Tensor<D>) -> f64 {
        self.factor.powi(D as i32) * self.law.energy(&self.elastic(gradient))
    }

    fn stress(&self, gradient: &Tensor<D>) -> Tensor<D> {
        self.law.stress(&self.elastic(gradient)) * self.factor.powi(D as i32 - 1)
    }

    fn stress_increment(&self, gradient: &Tensor<D>, increment: &Tensor<D>) -> Tensor<D> {
        self.law.stress_increment(&self.elastic(gradient), increment) * self.factor.powi(D as i32 - 2)
    }

    fn admissible(&self, gradient: &Tensor<D>) -> bool {
        self.law.admissible(&self.elastic(gradient))
    }
}

/// Growth of a body: the factor of each cell at full load; none where nothing grows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Growth(Vec<f64>);

impl Growth {
    /// Growth by these factors, one a cell.
    pub fn by(factors: Vec<f64>) -> Self {
        Self(factors)
    }

    /// The factors at full load, one a cell; empty where nothing grows.
    pub fn factors(&self) -> &[f64] {
        &self.0
    }

    /// `g(s) = 1 + s (G − 1)` of a cell. Ours: linear in the load as imposed motion is, so that edges which follow the growth keep the
    /// tissue free of stress all the way.
    pub fn factor(&self, load: f64, cell: usize) -> f64 {
        self.0.get(cell).map_or(1.0, |full| 1.0 + load * (full - 1.0))
    }

    /// The mean factor at full load over all cells; 1 where nothing grows.
    pub fn mean(&self) -> f64 {
        if self.0.is_empty() { 1.0 } else { self.0.iter().sum::<f64>() / self.0.len() as f64 }
    }

    /// `dg/ds = G − 1` of a cell.
    pub fn slope(&self, cell: usize) -> f64 {
        self.0.get(cell).map_or(0.0, |full| full - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::material::{Lame, NeoHookean, StVenantKirchhoff, check_derivatives};
    use crate::numerics::ogden::Ogden;
    use nalgebra::{Matrix2, Matrix3};

    fn laws<const D: usize>() -> [Box<dyn Material<D>>; 3] {
        let lame = Lame::from_young_poisson(1.0, 0.3).unwrap();
        [Box::new(StVenantKirchhoff { lame }), Box::new(NeoHookean { lame }), Box::new(Ogden { lame, exponent: -4.0 })]
    }

    fn check<const D: usize>(gradient: &Tensor<D>) {
        for law in laws::<D>() {
            for factor in [0.7, 1.6] {
                let grown = |factor: f64| Grown { law: law.as_ref(), factor };
                let defect = check_derivatives(&grown(factor), gradient);
                assert!(defect < 1e-8, "{} {factor}: {defect}", law.name());
                let stress = |step: f64| grown(factor + 1e-4 * step).stress(gradient);
                let quotient = ((stress(1.0) - stress(-1.0)) * 8.0 - (stress(2.0) - stress(-2.0))) / 12e-4;
                let slope = grown(factor).stress_by_growth(gradient);
                assert!((quotient - slope).norm() < 1e-8 * slope.norm(), "{} {factor}", law.name());
            }
        }
    }

    #[test]
    fn stress_and_tangent_are_derivatives_of_the_energy_after_growth_and_so_is_what_growth_adds() {
        check(&Matrix2::new(1.1, 0.2, -0.05, 0.85));
        check(&Matrix3::new(1.1, 0.2, -0.05, 0.1, 0.85, 0.3, 0.0, -0.2, 1.2));
    }

    #[test]
    fn tissue_that_follows_its_growth_is_free_of_stress_and_one_that_does_not_grow_keeps_its_bits() {
        let gradient = Matrix2::new(1.1, 0.2, -0.05, 0.85);
        for law in laws::<2>() {
            let free = Grown { law: law.as_ref(), factor: 1.4 };
            assert!(free.stress(&(Matrix2::identity() * 1.4)).norm() < 1e-15, "{}", law.name());
            let same = Grown { law: law.as_ref(), factor: 1.0 };
            assert_eq!(same.energy(&gradient), law.energy(&gradient));
            assert_eq!(same.stress(&gradient), law.stress(&gradient));
            assert_eq!(same.stress_increment(&gradient, &gradient), law.stress_increment(&gradient, &gradient));
        }
    }
}
