//! The balance of forces where two adhering threads part.
//!
//! Threads under tension T adhere with a force S. At the zipper point the arms leave along unit vectors u₁ and u₂, the zipped part along u_z:
//!
//! ```text
//! F = T(u₁ + u₂) + (2T − S) u_z,   v = F / (2 η_e (cos β/2 − 1)²/L + η_Z),   cos β = u₁·u₂.
//! ```
//!
//! With u_z against the bisector, F = S − 2T(1 − cos β/2) along it (Šmít et al. 2017, doi:10.7554/eLife.19907).

use nalgebra::Vector3;

/// What is known of a zipper point: unit vectors along its arms and its zipped part, and the mean length of its arms (µm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arms {
    units: [Vector3<f64>; 2],
    zipped: Option<Vector3<f64>>,
    length: f64,
}

/// Shorter than this (µm), an arm or a zipped part has no direction.
const NOTHING: f64 = 1e-6;

impl Arms {
    /// From the vectors (µm) to where the arms end and to the other end of the zipped part. None for an arm of no length.
    pub fn new(arms: [Vector3<f64>; 2], zipped: Vector3<f64>) -> Option<Self> {
        let length = 0.5 * (arms[0].norm() + arms[1].norm());
        let units = [arms[0].try_normalize(NOTHING)?, arms[1].try_normalize(NOTHING)?];
        Some(Self { units, zipped: zipped.try_normalize(NOTHING), length })
    }

    /// The angle β between the arms (rad).
    pub fn angle(&self) -> f64 {
        self.units[0].cross(&self.units[1]).norm().atan2(self.units[0].dot(&self.units[1]))
    }
}

/// The forces and drags of zippering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Tension T (pN).
    pub tension: f64,
    /// Adhesion S (pN).
    pub adhesion: f64,
    /// Drag η_Z of the zipper point (pN·h/µm).
    pub drag: f64,
    /// Elongational viscosity η_e (pN·h).
    pub elongational_viscosity: f64,
}

impl Balance {
    /// The angle β* (rad) at which nothing moves, cos β*/2 = 1 − S/(2T). Valid for S ≤ 2T.
    pub fn angle(&self) -> f64 {
        2.0 * (1.0 - 0.5 * self.adhesion / self.tension).clamp(-1.0, 1.0).acos()
    }

    /// Velocity of a zipper point (µm/h). One with nothing zipped moves along the bisector of its arms, or not at all if it would unzip.
    pub fn velocity(&self, arms: &Arms) -> Vector3<f64> {
        let (sum, half) = (arms.units[0] + arms.units[1], (0.5 * arms.angle()).cos());
        let drag = 2.0 * self.elongational_viscosity * (half - 1.0).powi(2) / arms.length + self.drag;
        let bisector = sum.try_normalize(NOTHING).unwrap_or_default();
        let back = arms.zipped.unwrap_or(-bisector);
        let force = sum * self.tension + back * (2.0 * self.tension - self.adhesion);
        if arms.zipped.is_none() && force.dot(&bisector) <= 0.0 { Vector3::zeros() } else { force / drag }
    }
}

/// The first crossing of two polylines in the plane, in the order of the first: on each the segment and the share of it, or none. Touching
/// ends of segments count once; parallel segments do not cross.
pub fn crossing(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Option<[(usize, f64); 2]> {
    let pairs = a.windows(2).enumerate();
    pairs.flat_map(|(i, first)| b.windows(2).enumerate().map(move |(j, second)| (i, first, j, second))).find_map(
        |(i, first, j, second)| {
            let (u, v, gap) = (first[1] - first[0], second[1] - second[0], second[0] - first[0]);
            let area = u.x * v.y - u.y * v.x;
            let share = |w: &Vector3<f64>| (gap.x * w.y - gap.y * w.x) / area;
            let (s, t) = (share(&v), share(&u));
            let inside = area != 0.0 && (0.0..1.0).contains(&s) && (0.0..1.0).contains(&t);
            inside.then_some([(i, s), (j, t)])
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLFACTORY: Balance = Balance { tension: 679.0, adhesion: 102.0, drag: 1.2, elongational_viscosity: 100.0 };

    fn at(angle: f64) -> Vector3<f64> {
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    }

    #[test]
    fn alike_arms_move_along_their_bisector_as_the_formula_says() {
        for (beta, length) in [(0.2, 40.0), (0.7, 25.0), (1.4, 60.0f64)] {
            let bisector = 0.9;
            let arms = [at(bisector + 0.5 * beta) * length, at(bisector - 0.5 * beta) * length];
            let arms = Arms::new(arms, at(bisector) * -3.0).unwrap();
            let half: f64 = (0.5 * beta).cos();
            let force = 102.0 - 2.0 * 679.0 * (1.0 - half);
            let expected = force / (2.0 * 100.0 * (half - 1.0).powi(2) / length + 1.2);
            let found = OLFACTORY.velocity(&arms);
            assert!((found - at(bisector) * expected).norm() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn nothing_moves_at_the_angle_of_balance_of_olfactory_axons_and_nothing_opens_that_is_not_zipped() {
        let beta = OLFACTORY.angle();
        assert!(((0.5 * beta).cos() - (1.0 - 102.0 / 1358.0)).abs() < 1e-12);
        // Measured: 51.2 degrees on average, most often 42.
        assert!((42.0..51.2).contains(&beta.to_degrees()), "{}", beta.to_degrees());
        let arms = |beta: f64, zipped: f64| Arms::new([at(0.5 * beta), at(-0.5 * beta)], at(0.0) * zipped).unwrap();
        assert!(OLFACTORY.velocity(&arms(beta, -1.0)).norm() < 1e-9);
        assert!(OLFACTORY.velocity(&arms(1.2 * beta, -1.0)).x < 0.0);
        assert_eq!(OLFACTORY.velocity(&arms(1.2 * beta, 0.0)), Vector3::zeros());
        assert!(OLFACTORY.velocity(&arms(0.8 * beta, 0.0)).x > 0.0);
    }

    #[test]
    fn a_crossing_is_found_where_lines_meet_and_none_where_they_do_not() {
        let line = |points: &[[f64; 2]]| points.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect::<Vec<_>>();
        let a = line(&[[0.0, 0.0], [4.0, 0.0], [4.0, 8.0]]);
        let b = line(&[[10.0, 6.0], [2.0, 2.0], [2.0, 10.0]]);
        assert_eq!(crossing(&a, &b), Some([(1, 0.375), (0, 0.75)]));
        assert_eq!(crossing(&a, &line(&[[0.0, 1.0], [3.0, 1.0]])), None);
        assert_eq!(crossing(&a, &line(&[[0.0, 1.0], [4.0, 1.0 - 1e-9], [5.0, 1.0]])).map(|f| f[0].0), Some(1));
    }
}
