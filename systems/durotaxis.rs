//! Durotaxis: stiffness of the tissue steers axons and sets how fast they grow.
//!
//! Retinal axons of Xenopus turn toward soft tissue where stiffness changes by more than 0.9 Pa/µm (Thompson et al., eLife 8, 2019,
//! doi:10.7554/eLife.39356) and grow faster on stiff tissue (Koser et al., Nat. Neurosci. 19, 2016, doi:10.1038/nn.4394). Ours, the
//! forms: with the stiffness E of the tissue, known along one direction at rest and carried by it,
//!
//! ```text
//! L̂ += −λ_D ∇E/|∇E| (1 − g₀/|∇E|)₊,     v ← v (E/E₀)^γ,     ė_g = −(∇v)⊥.
//! ```
//!
//! The last is `refraction`: the side of a bundle that lies on softer tissue falls behind, so a bundle turns as a wave front does and
//! sin θ / v is kept across a step of stiffness, θ the angle to its normal: Snell's law (Oliveri, Franze and Goriely, Phys. Rev. Lett.
//! 126, 2021, doi:10.1103/PhysRevLett.126.118101).

use crate::numerics::piecewise::value_and_slope;
use crate::prelude::*;

keys! {
    /// Steering by the stiffness of the tissue; L̂ += −λ_D ∇E/|∇E| (1 − g₀/|∇E|)₊, v ← v (E/E₀)^γ, ė_g = −(∇v)⊥.
    pub struct Durotaxis {
        /// Direction along which the stiffness changes, counter-clockwise from the x axis, in the tissue at rest.
        pub direction: Angle = Angle(0.0),
        /// Pairs [place along that direction in µm, stiffness in Pa], ascending, joined by straight lines.
        #[schemars(length(min = 1))]
        pub profile: Vec<[f64; 2]> = Vec::new(),
        /// Strength λ_D of the pull toward soft. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
        pub weight: Factor = Factor(1.0),
        /// Gradient g₀ below which nothing is felt. Source: Thompson 2019.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.1, 2.0]))]
        pub threshold: StiffnessGradient = StiffnessGradient(0.9),
        /// Exponent γ of the speed; 0 leaves the speed alone. Ours: twice as fast on tissue ten times as stiff.
        #[schemars(extend("x-typical" = [-1.0, 1.0]))]
        pub speed_exponent: Factor = Factor(0.3),
        /// Stiffness E₀ at which the speed is the nominal one.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [50.0, 3000.0]))]
        pub reference: Pressure = Pressure(500.0),
        /// Whether headings turn as a bundle's front does where the speed changes.
        pub refraction: bool = true,
    }
}

impl Mechanism for Durotaxis {
    const NAME: &'static str = "durotaxis";

    fn check(&self, _facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        let ascends = self.profile.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        wrong.demand(!self.profile.is_empty(), "/profile", || {
            "give pairs of place and stiffness, such as [[0, 200], [400, 1000]]".into()
        });
        wrong.demand(ascends, "/profile", || "places must ascend".into());
        wrong.demand(self.profile.iter().all(|pair| pair[1] > 0.0), "/profile", || "a stiffness is positive".into());
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.pulls_up_to(self.weight.0);
        model.plan().leads = true;
        model.insert_law(self).term(Term::Turn, feel);
        Ok(())
    }
}

/// Stiffness at a place of the tissue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// E (Pa).
    pub value: f64,
    /// ∇E (Pa/µm), spatial.
    pub gradient: Vector3<f64>,
}

impl Durotaxis {
    /// E (Pa) and dE/ds (Pa/µm) at a place s (µm) along the direction; constant beyond the ends of the profile.
    pub fn along(&self, place: f64) -> (f64, f64) {
        value_and_slope(&self.profile, place).unwrap_or((self.reference.0, 0.0))
    }

    /// The pull (dimensionless) toward soft.
    pub fn pull(&self, stiffness: &Stiffness) -> Vector3<f64> {
        let steepness = stiffness.gradient.norm();
        if steepness > self.threshold.0 {
            -stiffness.gradient * (self.weight.0 * (1.0 - self.threshold.0 / steepness) / steepness)
        } else {
            Vector3::zeros()
        }
    }

    /// The factor on the speed.
    pub fn speed_factor(&self, stiffness: &Stiffness) -> f64 {
        (stiffness.value / self.reference.0).powf(self.speed_exponent.0)
    }

    /// The spin (rad/h) by which a cone with unit `heading` and `speed` (µm/h) turns as a wave front: ω = −e × ∇v.
    pub fn spin(&self, stiffness: &Stiffness, heading: Vector3<f64>, speed: f64) -> Vector3<f64> {
        -heading.cross(&stiffness.gradient) * (self.speed_exponent.0 * speed / stiffness.value)
    }
}

fn feel(law: Res<Law<Durotaxis>>, tissue: Res<Tissue>, configuration: Res<Configuration>, mut cones: Cones) {
    let (sine, cosine) = law.direction.radians().sin_cos();
    let direction = Vector3::new(cosine, sine, 0.0);
    cones.for_each(|cone, spring| {
        let (value, slope) = law.along(tissue.reference_position(cone.site).dot(&direction));
        let gradient = configuration.push_forward_gradient(&tissue.mesh, cone.site.cell, direction * slope);
        let stiffness = Stiffness { value, gradient };
        spring.pull += law.pull(&stiffness);
        spring.speed_factor *= law.speed_factor(&stiffness);
        if law.refraction {
            spring.spin += law.spin(&stiffness, spring.heading, cone.identity.speed * spring.speed_factor);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> Durotaxis {
        Durotaxis { profile: vec![[100.0, 200.0], [300.0, 1000.0]], ..Durotaxis::default() }
    }

    #[test]
    fn stiffness_follows_its_profile_and_is_constant_beyond() {
        let law = law();
        assert_eq!(law.along(0.0), (200.0, 0.0));
        assert_eq!(law.along(200.0), (600.0, 4.0));
        assert_eq!(law.along(900.0), (1000.0, 0.0));
    }

    #[test]
    fn the_pull_starts_at_the_threshold_and_points_to_soft() {
        let law = law();
        let at = |slope: f64| Stiffness { value: 500.0, gradient: Vector3::x() * slope };
        assert_eq!(law.pull(&at(0.9)), Vector3::zeros());
        assert!((law.pull(&at(1.8)) + Vector3::x() * 0.5).norm() < 1e-15);
        assert!((law.pull(&at(-9.0)) - Vector3::x() * 0.9).norm() < 1e-15);
    }

    #[test]
    fn speed_doubles_about_over_a_decade_and_the_spin_is_minus_the_speeds_slope_across_the_heading() {
        let law = law();
        let at = |value: f64| Stiffness { value, gradient: Vector3::x() * 4.0 };
        assert!((law.speed_factor(&at(5000.0)) / law.speed_factor(&at(500.0)) - 10f64.powf(0.3)).abs() < 1e-14);
        let (e, v, step) = (Vector3::new(0.6, 0.8, 0.0), |x: f64| 20.0 * law.speed_factor(&at(500.0 + 4.0 * x)), 1e-4);
        let slope = Vector3::x() * ((v(step) - v(-step)) / (2.0 * step));
        let turned = law.spin(&at(500.0), e, v(0.0)).cross(&e);
        assert!((turned + slope - e * slope.dot(&e)).norm() < 1e-8, "{turned}");
    }

    #[test]
    fn no_strength_does_nothing_and_a_turned_scene_is_the_same() {
        let none = Durotaxis { weight: Factor(0.0), speed_exponent: Factor(0.0), ..law() };
        let stiffness = Stiffness { value: 700.0, gradient: Vector3::new(3.0, -1.0, 0.0) };
        let e = Vector3::new(0.28, 0.96, 0.0);
        assert_eq!(none.pull(&stiffness).norm() + none.spin(&stiffness, e, 20.0).norm(), 0.0);
        assert_eq!(none.speed_factor(&stiffness), 1.0);
        let (law, turned) = (law(), Rotation3::from_euler_angles(0.4, -0.3, 1.1));
        let turned_stiffness = Stiffness { gradient: turned * stiffness.gradient, ..stiffness };
        assert!((law.pull(&turned_stiffness) - turned * law.pull(&stiffness)).norm() < 1e-14);
        let (spin, turned_spin) = (law.spin(&stiffness, e, 20.0), law.spin(&turned_stiffness, turned * e, 20.0));
        assert!((turned_spin - turned * spin).norm() < 1e-14);
    }
}
