//! A test-only mechanism: the same pull and spin for every growth cone.

use tropism::prelude::*;

keys! {
    /// L̂ += (x, y), and a turning besides.
    pub struct FixedPull {
        /// The pull.
        pub pull: [f64; 2] = [1.0, 0.0],
        /// The spin (rad/h), counter-clockwise.
        pub spin: f64 = 0.0,
    }
}

impl Mechanism for FixedPull {
    const NAME: &'static str = "fixed_pull";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self).term(Term::Turn, steer);
        Ok(())
    }
}

fn steer(law: Res<Law<FixedPull>>, mut cones: Cones) {
    let pull = Vector3::new(law.pull[0], law.pull[1], 0.0);
    let spin = Vector3::new(0.0, 0.0, law.spin);
    cones.for_each(|_, spring| {
        spring.pull += pull;
        spring.spin += spin;
    });
}

/// The standard roster and the fixed pull.
pub fn roster() -> Roster {
    tropism::systems::standard().with::<FixedPull>()
}
