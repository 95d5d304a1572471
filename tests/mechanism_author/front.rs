//! A test-only mechanism with a sharp feature: a pull that changes its direction within a thin layer of the tissue.

use tropism::prelude::*;

keys! {
    /// L̂ += (tanh((y₀ − y)/w), 0.4); w = 0 is a jump.
    pub struct Front {
        /// y₀.
        pub height: Length = Length(100.0),
        /// w.
        pub width: Length = Length(0.5),
    }
}

impl Mechanism for Front {
    const NAME: &'static str = "front";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self).term(Term::Sample, steer);
        Ok(())
    }
}

fn steer(law: Res<Law<Front>>, mut cones: Cones) {
    cones.for_each(|cone, spring| {
        let away = law.height.0 - cone.position.y;
        let side = if law.width.0 > 0.0 { (away / law.width.0).tanh() } else { away.signum() };
        spring.pull += Vector3::new(side, 0.4, 0.0);
    });
}
