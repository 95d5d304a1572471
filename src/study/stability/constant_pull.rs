//! The same pull for every growth cone: what integrators are exercised with.

use crate::prelude::*;

keys! {
    /// L̂ += (x, y), for ever and everywhere.
    pub struct ConstantPull {
        /// The pull.
        pub pull: [f64; 2] = [1.0, 0.0],
    }
}

impl Mechanism for ConstantPull {
    const NAME: &'static str = "constant_pull";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        let [x, y] = self.pull;
        model.pulls_up_to(x.hypot(y)).insert_law(self).term(Term::Turn, steer);
        Ok(())
    }
}

fn steer(law: Res<Law<ConstantPull>>, mut cones: Cones) {
    let [x, y] = law.pull;
    cones.for_each(|_, spring| spring.pull += Vector3::new(x, y, 0.0));
}
