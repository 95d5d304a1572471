//! The figure of a turning assay: paths from one start with the first heading upward, and how the angles they turned by are spread.
//!
//! Each path is moved to the origin and turned so that its cone first headed upward; where a cue's gradient lies to the left of that
//! heading it is mirrored, so that to the right is up the gradient in all of them, as experiments are drawn. The turning angle is that from
//! the first heading to the line from start to end; it is positive toward the gradient, which tells attraction from repulsion.
//! Without a cue nothing is mirrored, and angles are positive to the right.

use crate::record::measures::{path_length, signed_angle, turning_angle};
use crate::record::plot::{Axis, Level, Plot, Series, Stroke};
use crate::record::recording::Recording;
use crate::record::snapshot::Snapshot;
use crate::record::statistics::{mean, standard_deviation};

/// Points of the mean path.
const MEAN_POINTS: usize = 40;
/// Width of the frame of the paths over its height.
const ASPECT: f64 = 1.15;
/// Room about the paths, as a share of their extent.
const ROOM: f64 = 1.1;

/// The axons of a turning assay.
#[derive(Debug, Clone, PartialEq)]
pub struct Assay {
    /// Paths (µm), from the origin, first heading up, gradient to the right.
    pub paths: Vec<Vec<[f64; 2]>>,
    /// Turning angles (degrees), toward the gradient positive.
    pub angles: Vec<f64>,
    /// Direction of the mean gradient, rightward of the first heading (degrees), and the cue it is of.
    pub gradient: Option<(f64, String)>,
}

impl Assay {
    /// The axons that are there at a time (h) of a recording, by the gradient of one cue: the one named, or the first; none if the
    /// recording has no first headings.
    pub fn of(recording: &Recording, time: f64, cue: Option<&str>) -> Option<Self> {
        let headings = recording.axon_heading.as_ref()?;
        let snapshot = recording.snapshot(time);
        let field = snapshot.fields.iter().find(|field| cue.is_none_or(|name| field.name == name));
        let (mut paths, mut angles, mut leans) = (Vec::new(), Vec::new(), Vec::new());
        for (tip, shaft) in snapshot.tips.iter().zip(&snapshot.shafts).filter(|(tip, _)| !tip.is_branch) {
            let (Some(&heading), Some(&start)) = (headings.get(tip.axon as usize), shaft.first()) else { continue };
            let (sine, cosine) = f64::from(heading).sin_cos();
            let heading = [cosine, sine];
            let slope = field.and_then(|field| gradient(&snapshot, &field.concentration, start));
            let lean = slope.and_then(|slope| signed_angle(heading, slope));
            // Angles are counter-clockwise, the figure's to the right.
            let side = if lean.is_some_and(|lean| lean > 0.0) { 1.0 } else { -1.0 };
            let Some(angle) = turning_angle(heading, shaft) else { continue };
            angles.push(side * angle.to_degrees());
            leans.extend(lean.map(|lean| (side * lean).to_degrees()));
            paths.push(shaft.iter().map(|x| upright([x[0] - start[0], x[1] - start[1]], heading, side)).collect());
        }
        let gradient = mean(&leans).zip(field).map(|(lean, field)| (lean, field.name.clone()));
        Some(Self { paths, angles, gradient })
    }

    /// Mean turning angle and its standard error (degrees); none without an axon.
    pub fn mean_angle(&self) -> Option<(f64, Option<f64>)> {
        let error = standard_deviation(&self.angles).map(|deviation| deviation / (self.angles.len() as f64).sqrt());
        mean(&self.angles).map(|mean| (mean, error))
    }

    /// The two plots: the paths, and the share of axons that turned by an angle or less.
    pub fn plots(&self) -> Vec<Plot> {
        vec![self.path_plot(), self.angle_plot()]
    }

    /// Mean and standard error in words.
    fn in_words(&self) -> String {
        let toward = self.gradient.as_ref().map_or("to the right", |_| "toward the gradient");
        match self.mean_angle() {
            Some((mean, Some(error))) => {
                format!(
                    "{mean:.1} ± {error:.1} deg {toward} (mean ± standard error, n\u{a0}=\u{a0}{})",
                    self.angles.len()
                )
            }
            Some((mean, None)) => format!("{mean:.1} deg {toward} (n\u{a0}=\u{a0}1)"),
            None => "no axon has turned yet".to_owned(),
        }
    }

    fn path_plot(&self) -> Plot {
        let farthest = |of: fn(&[f64; 2]) -> f64| self.paths.iter().flatten().map(of).fold(1.0, f64::max);
        let [side, above, below] = [farthest(|x| x[0].abs()), farthest(|x| x[1]), farthest(|x| -x[1])];
        // One scale for both axes.
        let height = (ROOM * (above + below)).max(2.0 * ROOM * side / ASPECT);
        let half = 0.5 * ASPECT * height;
        // A point that is no number parts one path from the next.
        let apart = self.paths.iter().flat_map(|path| path.iter().copied().chain([[f64::NAN; 2]]));
        let ray = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            [[0.0; 2], [0.6 * above * sine, 0.6 * above * cosine]]
        };
        let mut series = vec![
            Series::new("axons", apart, Stroke::Hair),
            Series::new("", [], Stroke::Line),
            Series::new("mean path", self.mean_path(), Stroke::Line),
        ];
        if let Some((lean, cue)) = &self.gradient {
            series.push(Series::new(format!("up the gradient of {cue}"), ray(*lean), Stroke::Dashed));
        }
        Plot {
            title: "Paths, first heading upward".into(),
            x: Axis { range: Some([-half, half]), ..Axis::linear("to the right (um)") },
            y: Axis {
                range: Some([-ROOM * below, height - ROOM * below]),
                ..Axis::linear("along the first heading (um)")
            },
            series,
            levels: Vec::new(),
            marks: Vec::new(),
            note: String::new(),
        }
    }

    fn angle_plot(&self) -> Plot {
        let mut angles = self.angles.clone();
        angles.sort_by(f64::total_cmp);
        let count = angles.len() as f64;
        let steps = angles.iter().enumerate().flat_map(|(i, &angle)| {
            let share = |k: usize| k as f64 / count;
            [[angle, share(i)], [angle, share(i + 1)]]
        });
        let mut levels = vec![Level { name: "straight on".into(), at: 0.0, vertical: true }];
        levels.extend(self.mean_angle().map(|(at, _)| Level { name: "mean".into(), at, vertical: true }));
        let toward = self.gradient.as_ref().map_or("to the right", |_| "toward the gradient");
        Plot {
            title: "Turning angles".into(),
            x: Axis::linear(format!("turning angle (deg), {toward} positive")),
            y: Axis { range: Some([0.0, 1.0]), ..Axis::linear("share of axons that turned by no more") },
            series: vec![Series::new("axons", steps, Stroke::Line)],
            levels,
            marks: Vec::new(),
            note: self.in_words(),
        }
    }

    /// The mean of all paths at equal shares of their lengths.
    fn mean_path(&self) -> Vec<[f64; 2]> {
        let count = self.paths.len() as f64;
        let mean_at = |share: f64| {
            let places = self.paths.iter().map(|path| at_share(path, share));
            places.fold([0.0; 2], |sum, x| [sum[0] + x[0] / count, sum[1] + x[1] / count])
        };
        if self.paths.is_empty() {
            return Vec::new();
        }
        (0..=MEAN_POINTS).map(|i| mean_at(i as f64 / MEAN_POINTS as f64)).collect()
    }
}

/// A vector turned so that `heading` points upward, mirrored to the right of it if `side` is 1.
fn upright([x, y]: [f64; 2], heading: [f64; 2], side: f64) -> [f64; 2] {
    let [along, left] = [x * heading[0] + y * heading[1], y * heading[0] - x * heading[1]];
    [side * left, along]
}

/// The gradient (nM/µm) of a linear field in the triangle that a point lies in; none outside, or where there is none.
fn gradient(snapshot: &Snapshot, concentration: &[f64], at: [f64; 2]) -> Option<[f64; 2]> {
    const RIM: f64 = -1e-6;
    snapshot.cells.chunks_exact(3).find_map(|cell| {
        let [a, b, c] = [0, 1, 2].map(|k| snapshot.vertices[cell[k] as usize]);
        let (u, v, w) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]], [at[0] - a[0], at[1] - a[1]]);
        let area = u[0] * v[1] - u[1] * v[0];
        let weights = [(w[0] * v[1] - w[1] * v[0]) / area, (u[0] * w[1] - u[1] * w[0]) / area];
        let is_inside = weights[0] >= RIM && weights[1] >= RIM && weights[0] + weights[1] <= 1.0 - RIM;
        let [f, g, h] = [0, 1, 2].map(|k| concentration[cell[k] as usize]);
        let slope = [((g - f) * v[1] - (h - f) * u[1]) / area, ((h - f) * u[0] - (g - f) * v[0]) / area];
        (is_inside && slope != [0.0; 2]).then_some(slope)
    })
}

/// The point at a share of a path's length.
fn at_share(path: &[[f64; 2]], share: f64) -> [f64; 2] {
    let mut left = share * path_length(path);
    for ends in path.windows(2) {
        let own = path_length(ends);
        if own >= left && own > 0.0 {
            let part = left / own;
            return [0, 1].map(|k| ends[0][k] + part * (ends[1][k] - ends[0][k]));
        }
        left -= own;
    }
    path.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_turned_upright_and_its_gradient_put_to_the_right() {
        // Heading east, the gradient north: a left turn, which is mirrored to the right.
        assert_eq!(upright([3.0, 2.0], [1.0, 0.0], 1.0), [2.0, 3.0]);
        // The gradient south: a right turn stays one.
        assert_eq!(upright([3.0, -2.0], [1.0, 0.0], -1.0), [2.0, 3.0]);
        let [aside, along] = upright([0.6, 0.8], [0.6, 0.8], 1.0);
        assert!(aside.abs() < 1e-15 && (along - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_mean_and_its_error_are_those_of_the_angles_and_the_mean_path_is_halfway() {
        let paths = vec![vec![[0.0, 0.0], [0.0, 4.0]], vec![[0.0, 0.0], [4.0, 0.0]]];
        let assay = Assay { paths, angles: vec![0.0, 90.0], gradient: None };
        let (mean, error) = assay.mean_angle().unwrap();
        assert!((mean - 45.0).abs() < 1e-12 && (error.unwrap() - 45.0).abs() < 1e-12);
        let path = assay.mean_path();
        assert!(path.iter().zip(0..).all(|(x, i)| {
            let half = 2.0 * f64::from(i) / MEAN_POINTS as f64;
            (x[0] - half).abs() < 1e-12 && (x[1] - half).abs() < 1e-12
        }));
        assert!(assay.angle_plot().note.starts_with("45.0 ± 45.0 deg to the right"));
    }

    #[test]
    fn a_gradient_is_that_of_the_linear_field_and_none_outside() {
        let snapshot = Snapshot {
            time: 0.0,
            vertices: vec![[1.0, 1.0], [3.0, 1.0], [1.0, 4.0]],
            cells: vec![0, 1, 2],
            borders: Vec::new(),
            fields: Vec::new(),
            shafts: Vec::new(),
            tips: Vec::new(),
            targets: Vec::new(),
        };
        // c = 2 + 3x − 5y
        let slope = gradient(&snapshot, &[0.0, 6.0, -15.0], [1.5, 1.5]).unwrap();
        assert!((slope[0] - 3.0).abs() < 1e-12 && (slope[1] + 5.0).abs() < 1e-12, "{slope:?}");
        assert_eq!(gradient(&snapshot, &[0.0, 6.0, -15.0], [3.0, 3.0]), None);
    }

    #[test]
    fn an_assay_without_axons_says_so() {
        let assay = Assay { paths: Vec::new(), angles: Vec::new(), gradient: None };
        assert_eq!(assay.angle_plot().note, "no axon has turned yet");
        assert!(assay.mean_path().is_empty() && assay.plots().len() == 2);
    }
}
