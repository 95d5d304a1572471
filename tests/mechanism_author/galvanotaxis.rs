//! Galvanotaxis, as an outside author writes a mechanism: with the prelude alone, in one file.
//!
//! Growth cones turn along an electric field E: L̂ += w (E/E₀) n, E₀ = 100 mV/mm, n the unit vector of the field.

use tropism::prelude::*;

keys! {
    /// Turning along an electric field; L̂ += w (E/E₀) n.
    pub struct Galvanotaxis {
        /// The field E.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [10.0, 200.0]))]
        pub field: ElectricField = ElectricField(100.0),
        /// Its direction, counter-clockwise from the x axis.
        pub direction: Angle = Angle(0.0),
        /// The weight w.
        #[schemars(extend("minimum" = 0.0, "maximum" = 4.0))]
        pub weight: Factor = Factor(1.0),
    }
}

/// The field that pulls with strength 1 (mV/mm).
const REFERENCE_FIELD: f64 = 100.0;

impl Mechanism for Galvanotaxis {
    const NAME: &'static str = "galvanotaxis";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        wrong.demand(self.weight.0 == 0.0 || facts.duration < 1000.0, "/weight", || {
            "no field is held for a thousand hours".to_owned()
        });
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self).term(Term::Turn, steer);
        Ok(())
    }
}

/// The pull of a field (mV/mm) in a direction (rad).
fn pull(weight: f64, field: f64, direction: f64) -> Vector3<f64> {
    Vector3::new(direction.cos(), direction.sin(), 0.0) * (weight * field / REFERENCE_FIELD)
}

fn steer(law: Res<Law<Galvanotaxis>>, mut cones: Cones) {
    let pull = pull(law.weight.0, law.field.0, law.direction.radians());
    cones.for_each(|_, spring| spring.pull += pull);
}
