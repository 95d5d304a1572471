//! Growth-rate modulation: a growth cone that heads up a gradient grows faster, one that heads down it slower.
//!
//! In shallow gradients neurites are guided by how fast they grow rather than by turning (Mortimer et al., PNAS 107, 2010,
//! doi:10.1073/pnas.0909254107). Ours, its form: the speed is multiplied by
//!
//! ```text
//! 1 + σ clip₁(s),   s = a K_d (∇c·e_g)/(K_d + c)² / 0.025,
//! ```
//!
//! s the difference in receptor occupancy between front and back over its value at 10 % per 10 µm and c = K_d. κ is held.

use super::cue_fields::Cues;
use crate::prelude::*;

keys! {
    /// Growth faster up a gradient and slower down it; v = v₀ (1 + σ clip₁(a K_d ∇c·e_g/(K_d + c)²/0.025)).
    pub struct GrowthRateModulation {
        /// The cue that is read.
        pub cue: String = String::new(),
        /// Strength σ; a negative one grows faster down the gradient. Ours.
        #[schemars(extend("minimum" = -1.0, "maximum" = 1.0, "x-typical" = [-0.8, 0.8]))]
        pub strength: Factor = Factor(0.5),
        /// Length a across which a cone compares concentrations.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 15.0]))]
        pub sensing_length: Length = Length(10.0),
        /// Dissociation constant K_d.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.3, 3.0]))]
        pub dissociation_constant: Concentration = Concentration(1.0),
    }
}

/// Number of the cue among the fields.
#[derive(Debug, Resource)]
struct Read(usize);

impl Mechanism for GrowthRateModulation {
    const NAME: &'static str = "growth_rate_modulation";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        Cues::demand_known(facts, &mut wrong, &self.cue, "/cue");
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        CueFields::demand(model, &self.cue);
        let cue = self.cue.clone();
        model.insert_law(self).term(Term::Sample, modulate).at_end(move |world| {
            let number = CueFields::number(world, &cue, "/cue")?;
            world.insert_resource(Read(number));
            Ok(())
        });
        Ok(())
    }
}

impl GrowthRateModulation {
    /// The factor on the speed of a cone with unit `heading` that senses `sample`.
    pub fn factor(&self, sample: CueSample, heading: Vector3<f64>) -> f64 {
        let sensed = sample.occupancy_difference(self.dissociation_constant.0, self.sensing_length.0);
        1.0 + self.strength.0 * sensed.dot(&heading).clamp(-1.0, 1.0)
    }
}

fn modulate(
    law: Res<Law<GrowthRateModulation>>,
    read: Res<Read>,
    tissue: Res<Tissue>,
    fields: Res<CueFields>,
    mut cones: Cones,
) {
    cones.for_each(|cone, spring| {
        spring.speed_factor *= law.factor(fields.sample(&tissue.mesh, read.0, cone.site), spring.heading);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 % per 10 µm at c = K_d, along y.
    fn assay(steepness: f64) -> CueSample {
        CueSample { concentration: 1.0, gradient: Vector3::new(0.0, 0.01 * steepness, 0.0) }
    }

    #[test]
    fn the_factor_is_one_plus_and_minus_the_strength_up_and_down_the_assays_gradient() {
        let law = GrowthRateModulation::default();
        for (heading, expected) in
            [(Vector3::y(), 1.5), (-Vector3::y(), 0.5), (Vector3::x(), 1.0), (Vector3::new(0.6, 0.8, 0.0), 1.4)]
        {
            assert!((law.factor(assay(1.0), heading) - expected).abs() < 1e-14);
        }
        assert!((law.factor(assay(0.1), Vector3::y()) - 1.05).abs() < 1e-14);
        assert_eq!(law.factor(assay(50.0), Vector3::y()), 1.5, "no faster than that");
    }

    #[test]
    fn no_strength_changes_no_bit_and_a_turned_scene_is_the_same() {
        let none = GrowthRateModulation { strength: Factor(0.0), ..GrowthRateModulation::default() };
        assert_eq!(none.factor(assay(1.7), Vector3::new(0.6, 0.8, 0.0)), 1.0);
        let law = GrowthRateModulation::default();
        let turned = Rotation3::from_euler_angles(0.4, -0.3, 1.1);
        let (sample, heading) = (assay(0.7), Vector3::new(0.6, 0.8, 0.0));
        let sample_turned = CueSample { gradient: turned * sample.gradient, ..sample };
        assert!((law.factor(sample_turned, turned * heading) - law.factor(sample, heading)).abs() < 1e-14);
    }
}
