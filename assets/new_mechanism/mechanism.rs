//! Steady pull: growth cones turn toward one direction.
//!
//! The struct is the JSON block, the resource that its system reads, and the law. Change `pull`, then the keys and the
//! system that feed it; units, ranges, "did you mean", `--set` and `--without` follow.

use tropism::prelude::*;

keys! {
    /// Turning toward one direction; L̂ += w (1 − exp(−t/τ)) n.
    pub struct SteadyPull {
        /// Weight w of the pull.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 2.0]))]
        pub weight: Factor = Factor(0.15),
        /// The direction n, counter-clockwise from the x axis.
        pub direction: Angle = Angle(0.0),
        /// The time τ over which the pull rises.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.1, 24.0]))]
        pub rise: Time = Time(2.0),
    }
}

impl Mechanism for SteadyPull {
    const NAME: &'static str = "steady_pull";

    fn check(&self, scene: &Facts) -> Violations {
        let mut wrong = Violations::new();
        wrong.demand(self.rise.0 <= scene.duration, "/rise", || {
            format!("a pull that rises over {} is hardly felt in {} h", self.rise, scene.duration)
        });
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.pulls_up_to(self.weight.0);
        model.insert_law(self).term(Term::Turn, steer);
        Ok(())
    }
}

/// w (1 − exp(−t/τ)) n, dimensionless: `direction` in radians, `time` and `rise` in hours.
fn pull(weight: f64, direction: f64, time: f64, rise: f64) -> Vector3<f64> {
    let (sine, cosine) = direction.sin_cos();
    Vector3::new(cosine, sine, 0.0) * (weight * (1.0 - (-time / rise).exp()))
}

fn steer(law: Res<Law<SteadyPull>>, time: Res<StageTime>, mut cones: Cones) {
    let pull = pull(law.weight.0, law.direction.radians(), time.0, law.rise.0);
    cones.for_each(|_, spring| spring.pull += pull);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pull_rises_to_its_weight_along_its_direction() {
        assert_eq!(pull(0.5, 0.3, 0.0, 2.0), Vector3::zeros());
        let late = pull(0.5, std::f64::consts::FRAC_PI_2, 1e3, 2.0);
        assert!((late - Vector3::new(0.0, 0.5, 0.0)).norm() < 1e-15);
        let share = pull(0.5, 0.3, 2.0, 2.0).norm() / 0.5;
        assert!((share - (1.0 - (-1f64).exp())).abs() < 1e-15);
    }
}
