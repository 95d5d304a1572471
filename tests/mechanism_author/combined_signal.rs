//! Two test-only mechanisms that steer by one signal of two cues, as the independent reference trajectories do:
//! L̂ = ∇S/|∇S|, S = λ_a c_a − λ_r c_r. One has the exact field, the other reads the program's own cue fields.

use crate::disc_field::{Disc, gradient};
use tropism::prelude::*;

keys! {
    /// The signal of exact fields: sums over the mirror images of discs in a rectangle.
    pub struct ExactSignal {
        /// Width of the rectangle.
        pub width: Length = Length(1.5),
        /// Height of the rectangle.
        pub height: Length = Length(1.0),
        /// 1/ℓ = √(k/D) in 1/um.
        pub inverse_decay_length: f64 = 10.0,
        /// Discs as [x, y, radius, weight of their concentration], in um.
        pub discs: Vec<[f64; 4]> = Vec::new(),
    }

    /// The signal of two cues of the scene.
    pub struct SensedSignal {
        /// Weights by the name of the cue.
        pub weights: std::collections::BTreeMap<String, f64> = std::collections::BTreeMap::new(),
    }
}

impl Mechanism for ExactSignal {
    const NAME: &'static str = "exact_signal";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self).term(Term::Sample, steer_by_exact_field);
        Ok(())
    }
}

fn steer_by_exact_field(law: Res<Law<ExactSignal>>, mut cones: Cones) {
    let box_size = [law.width.0, law.height.0];
    cones.for_each(|cone, spring| {
        let at = [cone.position.x, cone.position.y];
        let sum = law.discs.iter().fold(Vector3::zeros(), |sum, &[x, y, radius, weight]| {
            let disc = Disc { centre: [x, y], radius, inverse_decay_length: law.inverse_decay_length };
            let [gx, gy] = gradient(&disc, box_size, at);
            sum + Vector3::new(gx, gy, 0.0) * weight
        });
        spring.pull += sum.normalize();
    });
}

impl Mechanism for SensedSignal {
    const NAME: &'static str = "sensed_signal";

    fn check(&self, facts: &Facts) -> Violations {
        let cues = facts.names_in("cues");
        let mut wrong = Violations::new();
        for name in self.weights.keys().filter(|name| !cues.contains(name)) {
            wrong.push(format!("/weights/{name}"), unknown_name("cue", name, &cues));
        }
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        self.weights.keys().for_each(|cue| CueFields::demand(model, cue));
        model.insert_law(self).term(Term::Sample, steer_by_cue_fields);
        Ok(())
    }
}

fn steer_by_cue_fields(law: Res<Law<SensedSignal>>, fields: Res<CueFields>, tissue: Res<Tissue>, mut cones: Cones) {
    let sensed: Vec<_> = law.weights.iter().filter_map(|(cue, weight)| Some((fields.index(cue)?, *weight))).collect();
    cones.for_each(|cone, spring| {
        let gradient =
            |(index, weight): &(usize, f64)| fields.sample(&tissue.mesh, *index, cone.site).gradient * *weight;
        let sum: Vector3<f64> = sensed.iter().map(gradient).sum();
        spring.pull += sum.try_normalize(0.0).unwrap_or_default();
    });
}
