//! Bending stiffness: the shaft resists being curved, the first extension that the paper names.
//!
//! Ours, its form: the shaft behind a growth cone pulls the heading into its own direction t, the unit vector from the point at the
//! arc length ℓ_b behind the tip to the cone,
//!
//! ```text
//! L̂ += λ_B t.
//! ```
//!
//! On an arc of radius R the chord lags by ℓ_b/(2R), so the shaft turns back with κ λ_B sin(ℓ_b/(2R)): a torque in proportion to
//! curvature, as of an elastic rod. Limits: λ_B = 0 or ℓ_b → 0, no resistance; λ_B → ∞, a straight line. What turns a cone with
//! the pull p across its heading then makes an arc of 1/R = κ p/(v + κ λ_B ℓ_b/2) where ℓ_b ≪ R. The shaft is that of the
//! step's start: of first order in Δt whatever the method.

use crate::prelude::*;

keys! {
    /// Resistance of the shaft to being curved; L̂ += λ_B t, t from a point of the shaft behind the tip to the tip.
    pub struct BendingStiffness {
        /// Strength λ_B. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 10.0]))]
        pub weight: Factor = Factor(1.0),
        /// Length ℓ_b of the shaft that resists. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 100.0]))]
        pub length: Length = Length(20.0),
    }
}

impl Mechanism for BendingStiffness {
    const NAME: &'static str = "bending_stiffness";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.pulls_up_to(self.weight.0);
        model.insert_law(self).term(Term::Turn, straighten);
        Ok(())
    }
}

/// Unit vector to a polyline's start (the tip) from its point at arc length `length` (µm), or from its end if it is shorter; zero if
/// it has no length.
pub fn direction_over(length: f64, mut points: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let Some(tip) = points.next() else { return Vector3::zeros() };
    let (mut at, mut left) = (tip, length);
    for next in points {
        let side = next - at;
        let far = side.norm();
        if far >= left {
            at += side * (left / far);
            break;
        }
        (at, left) = (next, left - far);
    }
    (tip - at).try_normalize(0.0).unwrap_or_else(Vector3::zeros)
}

fn straighten(
    law: Res<Law<BendingStiffness>>,
    tissue: Res<Tissue>,
    configuration: Res<Configuration>,
    shafts: Res<Shafts>,
    mut cones: Cones,
) {
    let place = |vertex| configuration.position(&tissue.mesh, shafts.point(vertex).into());
    cones.for_each(|cone, spring| {
        let behind = shafts.vertices_backwards(cone.index).map(place);
        let path = std::iter::once(cone.position).chain(behind);
        spring.pull += direction_over(law.length.0, path) * law.weight.0;
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arc of radius R (µm) up to the origin, where it heads along y, tip first.
    fn arc(radius: f64) -> impl Iterator<Item = Vector3<f64>> {
        (0..400).map(move |i| {
            let angle = 0.25 * f64::from(i) / radius;
            Vector3::new(radius * (1.0 - angle.cos()), -radius * angle.sin(), 0.0)
        })
    }

    #[test]
    fn the_chord_of_an_arc_lags_by_half_its_angle() {
        for (radius, length) in [(50.0, 20.0), (30.0, 40.0), (1000.0, 5.0)] {
            let direction = direction_over(length, arc(radius));
            let lag = direction.x.atan2(direction.y);
            assert!((lag.abs() - 0.5 * length / radius).abs() < 1e-3 * length / radius, "{lag}");
        }
    }

    #[test]
    fn a_short_shaft_counts_whole_and_one_without_length_not_at_all() {
        let points = [Vector3::new(0.0, 4.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];
        assert_eq!(direction_over(100.0, points.into_iter()), Vector3::y());
        assert_eq!(direction_over(100.0, [points[0], points[0]].into_iter()), Vector3::zeros());
        assert_eq!(direction_over(100.0, std::iter::empty()), Vector3::zeros());
    }

    #[test]
    fn the_direction_turns_with_the_scene() {
        let turned = Rotation3::from_euler_angles(0.4, -0.3, 1.1);
        let direction = direction_over(33.0, arc(60.0));
        let turned_direction = direction_over(33.0, arc(60.0).map(|x| turned * x));
        assert!((turned_direction - turned * direction).norm() < 1e-13);
    }
}
