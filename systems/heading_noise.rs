//! Heading noise: growth cones wander.
//!
//! Ours: the paper speaks of "random movements" and gives no law. The heading diffuses with D_θ = v_g / ((d − 1) ℓ_p), so that
//! ⟨cos Δθ⟩ = exp(−v t / ℓ_p) in the plane and in space; dθ = √(2 D_θ) dW in each tangent direction. The Brownian paths lie
//! on a dyadic tree, so a refined step refines the same path. (Planar worm-like-chain papers fit exp(−s/2P): ℓ_p = 2P.)

use crate::prelude::*;

keys! {
    /// Heading noise with a persistence length; D_θ = v_g / ((d − 1) ℓ_p).
    pub struct HeadingNoise {
        /// Persistence length ℓ_p of the path. Source: cultured cortical and tadpole axons.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [90.0, 1300.0]))]
        pub persistence_length: Length = Length(300.0),
    }
}

impl Mechanism for HeadingNoise {
    const NAME: &'static str = "heading_noise";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        let tick = model.world.resource::<Clock>().grid.tick();
        let paths = BrownianTree::new(model.seed(), model.stream(), tick);
        model.plan().keep("Brownian paths", "headings diffuse");
        model.insert(HeadingPaths(paths)).insert_law(self).term(Term::Turn, diffuse);
        Ok(())
    }
}

/// D_θ (1/h) at speed v (µm/h), persistence length ℓ_p (µm), with `directions` = d − 1 tangent directions.
pub fn heading_diffusion(speed: f64, persistence_length: f64, directions: f64) -> f64 {
    speed / (directions * persistence_length)
}

fn diffuse(law: Res<Law<HeadingNoise>>, growth: Res<Growth>, mut cones: Cones) {
    let directions = if growth.planar { 1.0 } else { 2.0 };
    let length = law.persistence_length.0;
    cones.for_each(|cone, spring| {
        let speed = cone.identity.speed * spring.speed_factor;
        spring.heading_diffusion += heading_diffusion(speed, length, directions);
    });
}
