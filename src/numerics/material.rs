//! Hyperelastic materials: energy, stress and tangent as functions of the deformation gradient.
//!
//! A material is an energy per reference volume `W(F)`. The first Piola–Kirchhoff stress and its increment follow:
//! ```text
//! P(F) = ∂W/∂F,     dP = ∂P/∂F : dF.
//! ```
//! In the plane (`D = 2`) the laws below mean plane strain, so the Lamé parameters are those of the solid.
//! St. Venant–Kirchhoff, eq. (3) of the paper, does not resist inversion: its energy is finite at `det F = 0` and its stress
//! vanishes at the mirror image, so whoever uses it has to watch `det F` (see [`Material::admissible`]).

use std::f64::consts::PI;
use std::fmt::Debug;

use nalgebra::{SMatrix, SVector};

use crate::numerics::simplex_mesh::determinant;

/// A second-order tensor: deformation gradient (dimensionless) or stress (Pa). Row: spatial, column: reference direction.
pub type Tensor<const D: usize> = SMatrix<f64, D, D>;

/// Why the parameters of a material were refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Young's modulus is not positive and finite.
    #[error("Young's modulus is {0} Pa, but must be positive and finite")]
    Young(f64),
    /// Poisson's ratio is out of range.
    #[error("Poisson's ratio is {0}, but must lie in [0, 0.5)")]
    Poisson(f64),
}

/// A hyperelastic law. Implement it for a material of your own and show [`check_derivatives`] to be at round-off.
pub trait Material<const D: usize>: Send + Sync + Debug {
    /// Name of the law, as in messages and in scenario files.
    fn name(&self) -> &'static str;

    /// Energy per reference volume `W(F)` (Pa); `+∞` where the law has no finite value.
    fn energy(&self, gradient: &Tensor<D>) -> f64;

    /// First Piola–Kirchhoff stress `P = ∂W/∂F` (Pa). Called with admissible `F` only.
    fn stress(&self, gradient: &Tensor<D>) -> Tensor<D>;

    /// Action of the tangent, `dP = ∂P/∂F : dF` (Pa). Linear in `dF`, and symmetric: `dG : dP(dF) = dF : dP(dG)`.
    fn stress_increment(&self, gradient: &Tensor<D>, increment: &Tensor<D>) -> Tensor<D>;

    /// Whether the law may be used at `F`: by default where `det F > 0`, matter not turned inside out.
    fn admissible(&self, gradient: &Tensor<D>) -> bool {
        jacobian(gradient) > 0.0
    }
}

/// The two parameters of isotropic elasticity at small strain (Pa).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lame {
    /// First Lamé parameter λ (Pa).
    pub lambda: f64,
    /// Shear modulus µ (Pa).
    pub mu: f64,
}

impl Lame {
    /// `λ = Eν/((1+ν)(1−2ν))`, `µ = E/(2(1+ν))` from Young's modulus `E` (Pa) and Poisson's ratio `ν`: of the solid, hence of
    /// plane strain too.
    ///
    /// # Errors
    /// `E ≤ 0`, or `ν` outside `[0, 0.5)`.
    pub fn from_young_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        if !(young > 0.0 && young.is_finite()) {
            return Err(MaterialError::Young(young));
        }
        if !(0.0..0.5).contains(&poisson) {
            return Err(MaterialError::Poisson(poisson));
        }
        let mu = young / (2.0 * (1.0 + poisson));
        Ok(Self { lambda: 2.0 * mu * poisson / (1.0 - 2.0 * poisson), mu })
    }
}

/// St. Venant–Kirchhoff: `W = λ/2 (tr E)² + µ E:E` with the Green–Lagrange strain `E = (FᵀF − I)/2`; paper, eq. (3).
///
/// Valid for large rotations and moderate strain. In compression it loses ellipticity (near a stretch of 0.61 with free sides,
/// 0.71 confined, at ν = 0.3); it does not resist inversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    /// Lamé parameters (Pa).
    pub lame: Lame,
}

impl StVenantKirchhoff {
    /// Second Piola–Kirchhoff stress for a strain, and equally its increment for an increment of strain.
    fn second_stress<const D: usize>(&self, strain: &Tensor<D>) -> Tensor<D> {
        strain * (2.0 * self.lame.mu) + Tensor::identity() * (self.lame.lambda * strain.trace())
    }
}

impl<const D: usize> Material<D> for StVenantKirchhoff {
    fn name(&self) -> &'static str {
        "st_venant_kirchhoff"
    }

    fn energy(&self, gradient: &Tensor<D>) -> f64 {
        let strain = green_lagrange(gradient);
        0.5 * self.lame.lambda * strain.trace().powi(2) + self.lame.mu * strain.norm_squared()
    }

    fn stress(&self, gradient: &Tensor<D>) -> Tensor<D> {
        gradient * self.second_stress(&green_lagrange(gradient))
    }

    fn stress_increment(&self, gradient: &Tensor<D>, increment: &Tensor<D>) -> Tensor<D> {
        let mixed = gradient.transpose() * increment;
        let strain_increment = (mixed + mixed.transpose()) * 0.5;
        increment * self.second_stress(&green_lagrange(gradient)) + gradient * self.second_stress(&strain_increment)
    }
}

/// Compressible neo-Hookean: `W = µ/2 (tr C − d − 2 ln J) + λ/4 (J² − 1 − 2 ln J)`, `C = FᵀF`, `J = det F`; `+∞` if `J ≤ 0`.
///
/// Ours: the remedy a scene may choose where St. Venant–Kirchhoff fails in compression. Both agree at small strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    /// Lamé parameters (Pa).
    pub lame: Lame,
}

impl<const D: usize> Material<D> for NeoHookean {
    fn name(&self) -> &'static str {
        "neo_hookean"
    }

    fn energy(&self, gradient: &Tensor<D>) -> f64 {
        let j = jacobian(gradient);
        if j.is_nan() || j <= 0.0 {
            return f64::INFINITY;
        }
        let Lame { lambda, mu } = self.lame;
        let shape = gradient.norm_squared() - D as f64 - 2.0 * j.ln();
        0.5 * mu * shape + 0.25 * lambda * ((j - 1.0) * (j + 1.0) - 2.0 * j.ln())
    }

    fn stress(&self, gradient: &Tensor<D>) -> Tensor<D> {
        let j = jacobian(gradient);
        let Lame { lambda, mu } = self.lame;
        let inverse_transpose = cofactor(gradient) / j;
        (gradient - inverse_transpose) * mu + inverse_transpose * (0.5 * lambda * (j - 1.0) * (j + 1.0))
    }

    fn stress_increment(&self, gradient: &Tensor<D>, increment: &Tensor<D>) -> Tensor<D> {
        let j = jacobian(gradient);
        let Lame { lambda, mu } = self.lame;
        let inverse_transpose = cofactor(gradient) / j;
        let turned = inverse_transpose * increment.transpose() * inverse_transpose;
        let dilation = inverse_transpose.dot(increment);
        increment * mu
            + turned * (mu - 0.5 * lambda * (j - 1.0) * (j + 1.0))
            + inverse_transpose * (lambda * j * j * dilation)
    }
}

/// `J = det F`: current volume over reference volume.
pub fn jacobian<const D: usize>(gradient: &Tensor<D>) -> f64 {
    determinant(&gradient.data.0)
}

/// The cofactor `J F⁻ᵀ`, which carries reference normals times area to current ones; finite at `J = 0` too. `D ≤ 3`.
pub fn cofactor<const D: usize>(gradient: &Tensor<D>) -> Tensor<D> {
    let f = |i: usize, k: usize| gradient[(i % D, k % D)];
    Tensor::from_fn(|i, k| match D {
        1 => 1.0,
        2 => (if i == k { 1.0 } else { -1.0 }) * f(i + 1, k + 1),
        _ => f(i + 1, k + 1) * f(i + 2, k + 2) - f(i + 1, k + 2) * f(i + 2, k + 1),
    })
}

/// Green–Lagrange strain `E = (FᵀF − I)/2`.
pub fn green_lagrange<const D: usize>(gradient: &Tensor<D>) -> Tensor<D> {
    (gradient.transpose() * gradient - Tensor::identity()) * 0.5
}

/// Principal stretches, ascending: the roots of the eigenvalues of `C = FᵀF`.
pub fn principal_stretches<const D: usize>(gradient: &Tensor<D>) -> [f64; D] {
    symmetric_eigenvalues(gradient.transpose() * gradient).map(|square| square.max(0.0).sqrt())
}

/// Eigenvalues of a symmetric tensor, ascending.
fn symmetric_eigenvalues<const D: usize>(tensor: Tensor<D>) -> [f64; D] {
    let (mut eigenvalues, _) = eigen_decomposition(tensor);
    eigenvalues.sort_by(f64::total_cmp);
    eigenvalues
}

/// Eigenvalues of a symmetric tensor, in no order, and unit eigenvectors as columns, by Jacobi's rotations (exact after one for
/// `D = 2`).
pub(crate) fn eigen_decomposition<const D: usize>(mut tensor: Tensor<D>) -> ([f64; D], Tensor<D>) {
    const SWEEPS: usize = 12;
    let mut vectors = Tensor::identity();
    for _ in 0..SWEEPS {
        for p in 0..D {
            for q in p + 1..D {
                annihilate(&mut tensor, &mut vectors, p, q);
            }
        }
    }
    (std::array::from_fn(|i| tensor[(i, i)]), vectors)
}

/// One Jacobi rotation, after which entry `(p, q)` is zero; the vectors turn with it.
fn annihilate<const D: usize>(tensor: &mut Tensor<D>, vectors: &mut Tensor<D>, p: usize, q: usize) {
    let off = tensor[(p, q)];
    if off == 0.0 {
        return;
    }
    let ratio = (tensor[(q, q)] - tensor[(p, p)]) / (2.0 * off);
    let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let mut rotation = Tensor::<D>::identity();
    rotation[(p, p)] = cosine;
    rotation[(q, q)] = cosine;
    rotation[(p, q)] = tangent * cosine;
    rotation[(q, p)] = -tangent * cosine;
    *tensor = rotation.transpose() * *tensor * rotation;
    *vectors *= rotation;
    tensor[(p, q)] = 0.0;
    tensor[(q, p)] = 0.0;
}

/// Smallest eigenvalue (Pa), over all reference directions `N`, of the acoustic tensor `Q a = dP(a ⊗ N) N` at a homogeneous `F`.
///
/// Positive: strongly elliptic, small waves travel. Negative: the material may localise, and a discrete solution depends on the
/// mesh. `D` is 2 or 3. The directions are scanned (720 in the half plane, 1.5° apart in space), and the best is refined to
/// 1e-9 rad.
pub fn acoustic_minimum<const D: usize>(material: &dyn Material<D>, gradient: &Tensor<D>) -> f64 {
    let at = |angles: [f64; 2]| smallest_acoustic_eigenvalue(material, gradient, &direction(angles));
    let (steps, rows) = if D == 2 { (720, 1) } else { (120, 61) };
    let start = |row: usize| if D == 2 { 0.0 } else { PI * (row as f64 / 60.0 - 0.5) };
    let mut best = ([0.0, 0.0], f64::INFINITY);
    for row in 0..rows {
        for step in 0..steps {
            let angles = [PI * step as f64 / steps as f64, start(row)];
            let value = at(angles);
            if value < best.1 {
                best = (angles, value);
            }
        }
    }
    let mut width = PI / steps.min(60) as f64;
    while width > 1e-9 {
        let axes = if D == 2 { 1 } else { 2 };
        let trials = (0..2 * axes).map(|k| {
            let mut angles = best.0;
            angles[k / 2] += if k % 2 == 0 { width } else { -width };
            (angles, at(angles))
        });
        match trials.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some(trial) if trial.1 < best.1 => best = trial,
            _ => width *= 0.5,
        }
    }
    best.1
}

/// Unit reference direction of azimuth and elevation (rad); the elevation counts in space only.
fn direction<const D: usize>([azimuth, elevation]: [f64; 2]) -> SVector<f64, D> {
    let solid = [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
    let plane = [azimuth.cos(), azimuth.sin(), 0.0];
    SVector::from_fn(|i, _| if D == 2 { plane[i] } else { solid[i] })
}

fn smallest_acoustic_eigenvalue<const D: usize>(
    material: &dyn Material<D>,
    gradient: &Tensor<D>,
    normal: &SVector<f64, D>,
) -> f64 {
    let mut acoustic = Tensor::<D>::zeros();
    for k in 0..D {
        let mut increment = Tensor::<D>::zeros();
        increment.set_row(k, &normal.transpose());
        acoustic.set_column(k, &(material.stress_increment(gradient, &increment) * normal));
    }
    symmetric_eigenvalues((acoustic + acoustic.transpose()) * 0.5)[0]
}

/// How far a material's stress and tangent are from the derivatives of its energy at `F`: the largest defect over the size of
/// the tangent, dimensionless. Below 1e-8 for a correct law of energy scale and curvature near one; an error of sign or factor
/// gives order one.
///
/// Checked: `P:dF` against the difference quotient of the energy, `dP` against that of the stress (central, fourth order), and
/// the symmetry of the tangent. `F` must be admissible with room for changes of 0.4 %.
pub fn check_derivatives<const D: usize>(material: &dyn Material<D>, gradient: &Tensor<D>) -> f64 {
    const STEP: f64 = 1e-3;
    let units: Vec<Tensor<D>> = (0..D * D).map(unit_increment).collect();
    let tangent: Vec<Tensor<D>> = units.iter().map(|unit| material.stress_increment(gradient, unit)).collect();
    let stress = material.stress(gradient);
    let scale = tangent.iter().map(|column| column.norm()).fold(0.0, f64::max);
    let mut worst: f64 = 0.0;
    for (k, unit) in units.iter().enumerate() {
        let energy = |h: f64| material.energy(&(gradient + unit * (h * STEP)));
        let slope = (8.0 * (energy(1.0) - energy(-1.0)) - (energy(2.0) - energy(-2.0))) / (12.0 * STEP);
        worst = worst.max((slope - stress.dot(unit)).abs());
        let shifted = |h: f64| material.stress(&(gradient + unit * (h * STEP)));
        let quotient = ((shifted(1.0) - shifted(-1.0)) * 8.0 - (shifted(2.0) - shifted(-2.0))) / (12.0 * STEP);
        worst = worst.max((quotient - tangent[k]).norm());
        for (l, other) in units.iter().enumerate() {
            worst = worst.max((tangent[k].dot(other) - tangent[l].dot(unit)).abs());
        }
    }
    worst / scale
}

fn unit_increment<const D: usize>(k: usize) -> Tensor<D> {
    let mut unit = Tensor::zeros();
    unit[(k / D, k % D)] = 1.0;
    unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3};

    fn lame() -> Lame {
        Lame::from_young_poisson(1.0, 0.3).unwrap()
    }

    fn both<const D: usize>() -> [Box<dyn Material<D>>; 2] {
        [Box::new(StVenantKirchhoff { lame: lame() }), Box::new(NeoHookean { lame: lame() })]
    }

    #[test]
    fn stress_and_tangent_are_derivatives_of_the_energy_in_the_plane_and_in_space() {
        let plane = Matrix2::new(1.1, 0.2, -0.05, 0.85);
        let solid = Matrix3::new(1.1, 0.2, -0.05, 0.1, 0.85, 0.3, 0.0, -0.2, 1.2);
        for material in both::<2>() {
            let defect = check_derivatives(material.as_ref(), &plane);
            assert!(defect < 1e-9, "{}: {defect}", material.name());
        }
        for material in both::<3>() {
            let defect = check_derivatives(material.as_ref(), &solid);
            assert!(defect < 1e-9, "{}: {defect}", material.name());
        }
    }

    #[derive(Debug)]
    struct WrongTangent(NeoHookean);

    impl Material<2> for WrongTangent {
        fn name(&self) -> &'static str {
            "wrong"
        }
        fn energy(&self, gradient: &Tensor<2>) -> f64 {
            self.0.energy(gradient)
        }
        fn stress(&self, gradient: &Tensor<2>) -> Tensor<2> {
            self.0.stress(gradient)
        }
        fn stress_increment(&self, gradient: &Tensor<2>, increment: &Tensor<2>) -> Tensor<2> {
            self.0.stress_increment(gradient, increment) * 1.01
        }
    }

    #[test]
    fn a_tangent_one_per_cent_too_stiff_is_noticed() {
        let defect =
            check_derivatives(&WrongTangent(NeoHookean { lame: lame() }), &Matrix2::new(1.1, 0.2, -0.05, 0.85));
        assert!(defect > 5e-3, "{defect}");
    }

    #[test]
    fn both_laws_are_hookes_law_at_small_strain() {
        let Lame { lambda, mu } = lame();
        let h = Matrix3::new(0.3, 0.1, -0.2, 0.5, -0.4, 0.2, 0.1, 0.6, 0.7);
        let hooke = Matrix3::identity() * (lambda * h.trace()) + (h + h.transpose()) * mu;
        for material in both::<3>() {
            let increment = material.stress_increment(&Matrix3::identity(), &h);
            assert!((increment - hooke).norm() < 1e-15 * 10.0, "{}", material.name());
            assert!(material.stress(&Matrix3::identity()).norm() == 0.0);
        }
    }

    #[test]
    fn the_cofactor_is_the_determinant_times_the_inverse_transposed() {
        let solid = Matrix3::new(1.1, 0.2, -0.05, 0.1, 0.85, 0.3, 0.0, -0.2, 1.2);
        let plane = Matrix2::new(1.1, 0.2, -0.05, 0.85);
        assert!((cofactor(&solid).transpose() * solid - Matrix3::identity() * jacobian(&solid)).norm() < 1e-15);
        assert!((cofactor(&plane).transpose() * plane - Matrix2::identity() * jacobian(&plane)).norm() < 1e-15);
    }

    #[test]
    fn principal_stretches_do_not_see_rotations() {
        let (sine, cosine) = 0.7f64.sin_cos();
        let turn = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let skew = Matrix3::new(1.0, 0.0, 0.0, 0.0, cosine, -sine, 0.0, sine, cosine);
        let gradient = skew * turn * Matrix3::from_diagonal(&[1.4, 0.6, 0.9].into()) * turn.transpose();
        let stretches = principal_stretches(&gradient);
        for (found, wanted) in stretches.iter().zip([0.6, 0.9, 1.4]) {
            assert!((found - wanted).abs() < 1e-14, "{stretches:?}");
        }
    }

    #[test]
    fn at_rest_the_slowest_wave_is_the_shear_wave_in_the_plane_and_in_space() {
        for material in both::<2>() {
            assert!((acoustic_minimum(material.as_ref(), &Matrix2::identity()) - lame().mu).abs() < 1e-14);
        }
        for material in both::<3>() {
            assert!((acoustic_minimum(material.as_ref(), &Matrix3::identity()) - lame().mu).abs() < 1e-14);
        }
    }

    #[test]
    fn impossible_parameters_are_refused_and_inverted_matter_is_not_admissible() {
        assert_eq!(Lame::from_young_poisson(0.0, 0.3), Err(MaterialError::Young(0.0)));
        assert_eq!(Lame::from_young_poisson(1.0, 0.5), Err(MaterialError::Poisson(0.5)));
        assert!(Lame::from_young_poisson(1.0, f64::NAN).is_err());
        let mirror = Matrix2::new(-1.0, 0.0, 0.0, 1.0);
        for material in both::<2>() {
            assert!(!material.admissible(&mirror));
        }
        assert_eq!(Material::<2>::energy(&NeoHookean { lame: lame() }, &mirror), f64::INFINITY);
    }
}
