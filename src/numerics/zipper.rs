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

/// Shorter than this (µm), a zipped part has no direction.
const NOTHING: f64 = 1e-6;
/// Shorter than this (µm), an arm holds its point. Ours.
const SHORTEST: f64 = 1.0;

impl Arms {
    /// From the vectors (µm) to where the arms end and to the other end of the zipped part. None for an arm shorter than 1 µm.
    pub fn new(arms: [Vector3<f64>; 2], zipped: Vector3<f64>) -> Option<Self> {
        let length = 0.5 * (arms[0].norm() + arms[1].norm());
        let units = [arms[0].try_normalize(SHORTEST)?, arms[1].try_normalize(SHORTEST)?];
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

    /// How long (h) a velocity may be taken as constant: half of what an explicit step may take at most, L η_Z/(2T), since the force changes
    /// by less than 2T/L with the place of the point.
    pub fn instant(&self, arms: &Arms) -> f64 {
        0.25 * arms.length * self.drag / self.tension
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

/// A polyline (µm) with the boxes of its pieces, so that what is far apart is passed over.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxedLine {
    points: Vec<Vector3<f64>>,
    boxes: Vec<Box2>,
}

/// Lowest and highest coordinates.
type Box2 = [Vector3<f64>; 2];

/// Segments in a box.
const PIECE: usize = 8;

impl BoxedLine {
    /// Boxes the pieces of a polyline.
    pub fn new(points: Vec<Vector3<f64>>) -> Self {
        let pieces = points.len().saturating_sub(1).div_ceil(PIECE);
        let boxes = (0..pieces).map(|k| bounds(&points[k * PIECE..points.len().min((k + 1) * PIECE + 1)])).collect();
        Self { points, boxes }
    }

    /// Its points (µm).
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    fn segments(&self, piece: usize) -> impl Iterator<Item = (usize, &[Vector3<f64>])> {
        let first = piece * PIECE;
        self.points[first..].windows(2).take(PIECE).enumerate().map(move |(i, ends)| (first + i, ends))
    }

    /// The first crossing with another polyline in the plane, in the order of this one and then of the other: on each the segment and the
    /// share of it, or none. Touching ends of segments count once; parallel segments do not cross.
    pub fn crossing(&self, other: &Self) -> Option<[(usize, f64); 2]> {
        let mut found: Option<[(usize, f64); 2]> = None;
        for (i, own) in self.boxes.iter().enumerate() {
            for j in (0..other.boxes.len()).filter(|&j| overlap(own, &other.boxes[j])) {
                let pairs = self.segments(i).flat_map(|a| other.segments(j).map(move |b| (a, b)));
                let met = pairs.filter_map(|((k, a), (l, b))| segments_cross(a, b).map(|[s, t]| [(k, s), (l, t)]));
                found =
                    met.fold(found, |first, next| first.filter(|first| places(first) <= places(&next)).or(Some(next)));
            }
            if found.is_some() {
                break;
            }
        }
        found
    }
}

fn places(crossing: &[(usize, f64); 2]) -> (usize, usize) {
    (crossing[0].0, crossing[1].0)
}

/// Shares of two segments at which they cross in the plane.
fn segments_cross(first: &[Vector3<f64>], second: &[Vector3<f64>]) -> Option<[f64; 2]> {
    let (u, v, gap) = (first[1] - first[0], second[1] - second[0], second[0] - first[0]);
    let area = u.x * v.y - u.y * v.x;
    let share = |w: &Vector3<f64>| (gap.x * w.y - gap.y * w.x) / area;
    let shares = [share(&v), share(&u)];
    (area != 0.0 && shares.iter().all(|share| (0.0..1.0).contains(share))).then_some(shares)
}

fn bounds(points: &[Vector3<f64>]) -> Box2 {
    let start = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
    points.iter().fold(start, |[low, high], point| [low.inf(point), high.sup(point)])
}

fn overlap(a: &Box2, b: &Box2) -> bool {
    (0..2).all(|k| a[0][k] <= b[1][k] && b[0][k] <= a[1][k])
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
        let arms = |beta: f64, zipped: f64| {
            Arms::new([at(0.5 * beta) * 30.0, at(-0.5 * beta) * 30.0], at(0.0) * zipped).unwrap()
        };
        assert!(OLFACTORY.velocity(&arms(beta, -1.0)).norm() < 1e-9);
        assert!(OLFACTORY.velocity(&arms(1.2 * beta, -1.0)).x < 0.0);
        assert_eq!(OLFACTORY.velocity(&arms(1.2 * beta, 0.0)), Vector3::zeros());
        assert!(OLFACTORY.velocity(&arms(0.8 * beta, 0.0)).x > 0.0);
    }

    #[test]
    fn the_first_crossing_of_long_lines_is_that_of_all_pairs_of_their_segments() {
        let wave = |turn: f64, count: usize| -> Vec<Vector3<f64>> {
            (0..count).map(|i| Vector3::new(i as f64, 4.0 * (turn * i as f64).sin(), 0.0)).collect()
        };
        for turn in [0.11, 0.3, 0.47] {
            // Both waves start at the origin: that crossing is left out with their first points.
            let (a, b) = (wave(turn, 70)[1..].to_vec(), wave(0.23, 61)[1..].to_vec());
            let expected = (0..68)
                .flat_map(|i| (0..59).map(move |j| (i, j)))
                .find_map(|(i, j)| segments_cross(&a[i..i + 2], &b[j..j + 2]).map(|[s, t]| [(i, s), (j, t)]));
            let found = BoxedLine::new(a).crossing(&BoxedLine::new(b));
            assert_eq!(found, expected);
            assert!(found.is_some());
        }
    }

    #[test]
    fn a_crossing_is_found_where_lines_meet_and_none_where_they_do_not() {
        let line = |points: &[[f64; 2]]| BoxedLine::new(points.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect());
        let crossing = |a: &BoxedLine, b: &BoxedLine| a.crossing(b);
        let a = line(&[[0.0, 0.0], [4.0, 0.0], [4.0, 8.0]]);
        let b = line(&[[10.0, 6.0], [2.0, 2.0], [2.0, 10.0]]);
        assert_eq!(crossing(&a, &b), Some([(1, 0.375), (0, 0.75)]));
        assert_eq!(crossing(&a, &line(&[[0.0, 1.0], [3.0, 1.0]])), None);
        assert_eq!(crossing(&a, &line(&[[0.0, 1.0], [4.0, 1.0 - 1e-9], [5.0, 1.0]])).map(|f| f[0].0), Some(1));
    }
}
