//! One check for every law of material: what a new law is shown to be right by.
//!
//! Energy → stress → tangent against difference quotients at several deformation gradients, indifference to the observer, rest without
//! stress, Hooke's law at small strain, and the patch test: a border that is moved affinely moves the inside affinely, on an irregular
//! mesh, whatever the law.

use std::f64::consts::FRAC_PI_3;
use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};

use crate::numerics::hyperelasticity::{Body, Prescribed};
use crate::numerics::material::{Lame, Material, Tensor, check_derivatives};
use crate::numerics::newton::{NewtonOptions, equilibrium};
use crate::numerics::planar_domain::PlanarDomain;
use crate::numerics::triangulate::{MeshOptions, triangulate};

/// How far a law is from what it must be; all dimensionless, zero but for round-off and difference quotients (below 1e-7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawDefects {
    /// Stress and tangent against the derivatives of energy and stress: the largest [`check_derivatives`] of several `F`.
    pub derivatives: f64,
    /// `W(QF) − W(F)` and `P(QF) − Q P(F)` for a rotation `Q`, over λ + 2µ.
    pub objectivity: f64,
    /// `P(I)` over λ + 2µ.
    pub stress_at_rest: f64,
    /// Tangent at rest against `λ tr(h) I + µ (h + hᵀ)`, over λ + 2µ.
    pub small_strain: f64,
    /// Patch test: largest distance of a vertex from its affine place, over the size of the body; infinite if no equilibrium was found.
    pub patch: f64,
}

impl LawDefects {
    /// The largest of them.
    pub fn worst(&self) -> f64 {
        let all = [self.derivatives, self.objectivity, self.stress_at_rest, self.small_strain, self.patch];
        all.into_iter().fold(0.0, |worst: f64, defect| if defect.is_nan() { f64::INFINITY } else { worst.max(defect) })
    }
}

/// Deformation gradients at which a law is looked at; those that it does not admit are left out.
const GRADIENTS: [[f64; 4]; 6] = [
    [1.0, 0.0, 0.0, 1.0],
    [1.1, 0.2, -0.05, 0.85],
    [1.1, 0.0, 0.0, 1.1],
    [0.9, 0.35, 0.0, 1.2],
    [0.3, -1.1, 0.9, 0.2],
    [0.82, 0.0, 0.0, 0.94],
];

/// The affine motion of the patch test, `F − I`.
const PATCH: [f64; 4] = [0.09, 0.05, -0.03, -0.04];

/// Measures a law that at small strain should have these Lamé parameters.
pub fn law_defects(law: &Arc<dyn Material<2>>, lame: Lame) -> LawDefects {
    let stiffness = lame.lambda + 2.0 * lame.mu;
    let gradients: Vec<Tensor<2>> = GRADIENTS.into_iter().map(tensor).filter(|f| law.admissible(f)).collect();
    let turn = Matrix2::new(FRAC_PI_3.cos(), -FRAC_PI_3.sin(), FRAC_PI_3.sin(), FRAC_PI_3.cos());
    let turned = |f: &Tensor<2>| {
        let stress = (law.stress(&(turn * f)) - turn * law.stress(f)).norm();
        (law.energy(&(turn * f)) - law.energy(f)).abs().max(stress) / stiffness
    };
    let (rest, units) = (Tensor::<2>::identity(), [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);
    let hooke = |h: Tensor<2>| Tensor::identity() * (lame.lambda * h.trace()) + (h + h.transpose()) * lame.mu;
    let linear = units.into_iter().map(tensor).map(|h| (law.stress_increment(&rest, &h) - hooke(h)).norm() / stiffness);
    LawDefects {
        derivatives: largest(gradients.iter().map(|f| check_derivatives(law.as_ref(), f))),
        objectivity: largest(gradients.iter().map(turned)),
        stress_at_rest: law.stress(&rest).norm() / stiffness,
        small_strain: largest(linear),
        patch: patch_defect(law).unwrap_or(f64::INFINITY),
    }
}

fn tensor([a, b, c, d]: [f64; 4]) -> Tensor<2> {
    Matrix2::new(a, b, c, d)
}

/// The largest, or NaN if there is one.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a: f64, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
}

fn patch_defect(law: &Arc<dyn Material<2>>) -> Option<f64> {
    let fitted = triangulate(&PlanarDomain::rectangle(1.5, 1.0), &[], &MeshOptions::of_size(0.22)).ok()?;
    let places = fitted.mesh.vertices();
    let moved = |x: &[f64; 2]| -> [f64; 2] { (tensor(PATCH) * Vector2::from(*x)).into() };
    let mut prescribed = Prescribed::none(places.len());
    for (vertex, x) in places.iter().enumerate() {
        let [near_x, near_y] = [x[0].min(1.5 - x[0]), x[1].min(1.0 - x[1])];
        if near_x.min(near_y) < 1e-9 {
            prescribed.impose_all(vertex, moved(x));
        }
    }
    let body = Body::new(&fitted.mesh, Arc::clone(law), prescribed).ok()?;
    let found = equilibrium(&body, 1.0, &vec![0.0; body.unknowns()], &NewtonOptions::default()).ok()?;
    let apart = |(x, u): (&[f64; 2], &[f64])| (u[0] - moved(x)[0]).hypot(u[1] - moved(x)[1]);
    Some(largest(places.iter().zip(found.displacement.chunks_exact(2)).map(apart)) / body.size())
}
