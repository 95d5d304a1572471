//! Steric repulsion: growth cones keep off the shafts of other axons below a distance.
//!
//! Ours in form and numbers: over the parts of other axons' shafts within the distance r_s,
//!
//! ```text
//! F = −Σ_axons ∫ g(d/r_s) d̂ ds / r_s,   g(u) = 27/4 u (1 − u)²,   L̂ += λ_s F / max(1, |F|)
//! ```
//!
//! with d̂ from the cone to the shaft: zero on the shaft itself, where no side is the nearer, largest at r_s/3, zero at r_s. The integral
//! over each straight segment is in closed form. All cones read the shafts of the step's start.

use super::shaft_index::{Asking, Search, ShaftIndex, ShaftScene};
use crate::numerics::contact_integral::Felt;
use crate::numerics::segments::{ContactPull, Contacts, Segments, Touch};
use crate::prelude::*;

keys! {
    /// Repulsion from the shafts of other axons below a distance; L̂ += λ_s F, F = −Σ ∫ g(d/r_s) d̂ ds/r_s.
    pub struct StericRepulsion {
        /// Strength λ_s. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 8.0]))]
        pub weight: Factor = Factor(2.0),
        /// Distance r_s below which shafts repel. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.5, 10.0]))]
        pub distance: Length = Length(3.0),
    }
}

impl Mechanism for StericRepulsion {
    const NAME: &'static str = "steric_repulsion";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if ShaftIndex::install(model, self.distance.0, Search::default()) {
            model.pulls_up_to(self.weight.0);
            model.insert_law(self).term(Term::Contact, repel);
        }
        Ok(())
    }
}

/// The law as a cone needs it.
#[derive(Debug, Clone, Copy)]
pub struct Repulsion {
    /// r_s, all around.
    pub felt: Felt,
}

impl Repulsion {
    /// Repulsion below a distance (µm).
    pub fn below(distance: f64) -> Self {
        Self { felt: Felt::around(distance) }
    }
}

impl<const D: usize> ContactPull<D> for Repulsion {
    #[inline(always)]
    fn pull(&self, touch: &Touch<D>) -> [f64; D] {
        let away = -6.75 / (self.felt.reach * self.felt.reach);
        let [w0, w1] = touch.moments;
        std::array::from_fn(|k| touch.normal[k] * (away * w0) + touch.tangent[k] * (away * w1))
    }
}

fn repel(law: Res<Law<StericRepulsion>>, mut index: ResMut<ShaftIndex>, scene: ShaftScene, mut cones: Cones) {
    let contact = Repulsion::below(law.distance.0);
    let feel = |contacts: &mut Contacts<2>, cone: &Asking, segments: &Segments<2>| {
        let sum = cone.sum(contacts, segments, (&contact.felt, &contact), &[1.0]);
        sum / sum.norm().max(1.0)
    };
    index.for_each(&scene, &mut cones, feel, |spring, pull| spring.pull += pull * law.weight.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull(a: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> {
        let law = Repulsion::below(3.0);
        let (mut segments, mut contacts) = (Segments::default(), Contacts::<3>::default());
        segments.push(a.into(), b.into(), (0, 0));
        contacts.sum(([0.0; 3], [0.0, 1.0, 0.0]), &segments, 1, (&law.felt, &law), &[1.0]).into()
    }

    #[test]
    fn a_long_shaft_repels_as_its_integral_says_from_any_side() {
        for d in [0.5, 1.0, 2.5] {
            let found = pull(Vector3::new(d, -50.0, 0.0), Vector3::new(d, 50.0, 0.0));
            let n = 400_000;
            let ds = 100.0 / f64::from(n);
            let of = |i: i32| {
                let s = -50.0 + (f64::from(i) + 0.5) * ds;
                let far = d.hypot(s);
                let u = far / 3.0;
                if u < 1.0 { -6.75 * u * (1.0 - u) * (1.0 - u) * d / far * ds / 3.0 } else { 0.0 }
            };
            let expected: f64 = (0..n).map(of).sum();
            assert!((found.x - expected).abs() < 1e-7 && found.y.abs() < 1e-13, "{d}: {found} {expected}");
            let other_side = pull(Vector3::new(-d, 50.0, 0.0), Vector3::new(-d, -50.0, 0.0));
            assert!((other_side + found).norm() < 1e-14);
        }
    }

    #[test]
    fn nothing_is_felt_beyond_the_distance_or_on_the_shaft_itself() {
        assert_eq!(pull(Vector3::new(3.01, -50.0, 0.0), Vector3::new(3.01, 50.0, 0.0)), Vector3::zeros());
        assert!(pull(Vector3::new(0.0, -50.0, 0.0), Vector3::new(0.0, 50.0, 0.0)).norm() < 1e-13);
    }

    #[test]
    fn the_pull_turns_with_the_scene() {
        let turned = Rotation3::from_euler_angles(0.4, -0.3, 1.1);
        let (a, b) = (Vector3::new(-4.0, 0.7, 0.0), Vector3::new(6.0, 1.4, 0.0));
        assert!((pull(turned * a, turned * b) - turned * pull(a, b)).norm() < 1e-14);
    }
}
