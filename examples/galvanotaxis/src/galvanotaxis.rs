//! Galvanotaxis: growth cones turn toward the cathode of an electric field.
//!
//! Neurites of frog embryos turn to the cathode in fields from 7 mV/mm on (Hinkle, McCaig and Robinson, J. Physiol. 314,
//! 1981). Ours: the form, a pull that saturates with the field, and its half point.

use tropism::prelude::*;

keys! {
    /// Turning toward the cathode of an electric field; L̂ += w E/(E + E_h) n for E ≥ E₀, else 0.
    pub struct Galvanotaxis {
        /// Strength E of the field; V/m and mV/mm are the same. Source: 7 to 190 mV/mm.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [7.0, 190.0]))]
        pub field: ElectricField = ElectricField(100.0),
        /// Direction n of the cathode, counter-clockwise from the x axis.
        pub cathode: Angle = Angle(0.0),
        /// Weight w of the pull of a strong field. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 2.0]))]
        pub weight: Factor = Factor(0.5),
        /// Field E_h of half the weight. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [10.0, 200.0]))]
        pub half_field: ElectricField = ElectricField(50.0),
        /// Smallest field E₀ that is felt. Source: 7 mV/mm.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [1.0, 20.0]))]
        pub threshold: ElectricField = ElectricField(7.0),
    }
}

impl Mechanism for Galvanotaxis {
    const NAME: &'static str = "galvanotaxis";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if self.field < self.threshold {
            let why = format!("{} is below the threshold of {}", self.field, self.threshold);
            model.plan().leave_out("electric field", why);
            return Ok(());
        }
        model.plan().keep("electric field", "cones turn toward the cathode");
        model.pulls_up_to(self.weight.0);
        model.insert_law(self).term(Term::Turn, steer);
        Ok(())
    }
}

impl Galvanotaxis {
    /// The pull (dimensionless).
    fn pull(&self) -> Vector3<f64> {
        let (field, half) = (self.field.0, self.half_field.0);
        let (sine, cosine) = self.cathode.radians().sin_cos();
        Vector3::new(cosine, sine, 0.0) * (self.weight.0 * field / (field + half))
    }
}

fn steer(law: Res<Law<Galvanotaxis>>, mut cones: Cones) {
    let pull = law.pull();
    cones.for_each(|_, spring| spring.pull += pull);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pull_saturates_with_the_field_along_the_direction_of_the_cathode() {
        let law = Galvanotaxis { weight: Factor(0.8), ..Galvanotaxis::default() };
        let at = |field: f64| Galvanotaxis { field: ElectricField(field), ..law.clone() }.pull();
        assert_eq!(at(50.0), Vector3::new(0.4, 0.0, 0.0));
        assert!((at(1e12).x - 0.8).abs() < 1e-9 && at(0.0) == Vector3::zeros());
        let [low, middle, high] = [10.0, 100.0, 190.0].map(|field| at(field).x);
        assert!(low < middle && middle < high && high < 0.8);
    }

    #[test]
    fn turning_the_cathode_turns_the_pull() {
        let law = Galvanotaxis { cathode: Angle(20.0), ..Galvanotaxis::default() };
        let turned = Galvanotaxis { cathode: Angle(57.0), ..law.clone() };
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), 37f64.to_radians());
        assert!((rotation * law.pull() - turned.pull()).norm() < 1e-15);
    }
}
