//! Morphology of a whole run: arrivals, path shape, turning, dispersion and fascicles.
//!
//! One [`AxonRecord`] an axon or branch goes into a [`Tally`], which keeps no path, one [`Morphology`] comes out. A measure that has no axons to speak of is `None`
//! (JSON `null`); no measure is ever NaN. Angles are radians inside and degrees in what is reported (the field's name
//! says so), positive counter-clockwise.

use super::fascicles::{Crossings, Height, HeightMeasures};
use super::statistics::Distribution;
use serde::Serialize;

/// What is known of one *born* axon, or of a branch, at the moment of measuring.
#[derive(Debug, Clone, PartialEq)]
pub struct AxonRecord {
    /// Index of its population.
    pub population: u16,
    /// The shaft in space, origin → tip, µm.
    pub shaft: Vec<[f64; 2]>,
    /// When the axon was born, h.
    pub birth_time: f64,
    /// When the first of its growth cones reached the target, h; none if none has.
    pub arrival_time: Option<f64>,
    /// Whether it is a branch: its shaft counts, but arrivals, births and turning are those of axons.
    pub is_branch: bool,
    /// Whether it has been drawn back for good: there is no shaft to measure.
    pub is_withdrawn: bool,
    /// Heading at birth (any length but zero).
    pub initial_heading: [f64; 2],
    /// Heading now (any length but zero).
    pub final_heading: [f64; 2],
}

/// What to look at besides the axons.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureOptions {
    /// Heights to look at, as shares of the tissue's extent in y.
    pub shares: Vec<f64>,
    /// Lowest y of the tissue now, µm.
    pub y_min: f64,
    /// Highest y of the tissue now, µm.
    pub y_max: f64,
    /// Linkage distance of fascicles, µm.
    pub linkage: f64,
}

/// Arrivals among a group of axons.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hits {
    /// Axons born.
    pub born: usize,
    /// Axons whose growth cone has reached the target.
    pub arrived: usize,
    /// Hit fraction: arrived/born; none if nobody was born.
    pub fraction: Option<f64>,
}

/// The morphology of a run: what a biologist would read off the preparation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Morphology {
    /// Arrivals of all axons.
    pub hits: Hits,
    /// Arrivals of the axons born in the first half of the birth window, (first birth + last birth)/2 excluded. Both
    /// halves are empty if all axons were born at once.
    pub hits_early: Hits,
    /// Arrivals of the axons born in the second half of the birth window: followers, where there are pioneers.
    pub hits_late: Hits,
    /// Time from birth to arrival of the axons that arrived, h.
    pub travel_time_h: Option<Distribution>,
    /// Length of the shafts along the path, µm.
    pub length_um: Option<Distribution>,
    /// Straightness: distance from origin to tip over the length of the path (1 is straight); shafts of no length are
    /// left out.
    pub straightness: Option<Distribution>,
    /// Turning angle as assays measure it: from the initial heading to the line from origin to tip, in (−180°, 180°],
    /// counter-clockwise positive. Mean and SD are those of the numbers (not circular), fit for angles well below 180°.
    pub turning_angle_deg: Option<Distribution>,
    /// Turn of the heading itself: from the initial to the final heading, same convention; about twice the turning angle
    /// of the assay.
    pub heading_turn_deg: Option<Distribution>,
    /// Dispersion and fascicles, one entry a height.
    pub heights: Vec<HeightMeasures>,
}

/// When an axon was born, and when it arrived (h).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trunk {
    birth_time: f64,
    arrival_time: Option<f64>,
}

/// Measures of axons, one after the other.
#[derive(Debug, Clone)]
pub struct Tally {
    linkage: f64,
    trunks: Vec<Trunk>,
    lengths: Vec<f64>,
    straightnesses: Vec<f64>,
    turning_angles: Vec<f64>,
    heading_turns: Vec<f64>,
    crossings: Vec<Crossings>,
}

impl Tally {
    /// Of no axon yet.
    pub fn new(options: &MeasureOptions) -> Self {
        let height = |&share: &f64| Height { share, y_min: options.y_min, y_max: options.y_max };
        Self {
            linkage: options.linkage,
            trunks: Vec::new(),
            lengths: Vec::new(),
            straightnesses: Vec::new(),
            turning_angles: Vec::new(),
            heading_turns: Vec::new(),
            crossings: options.shares.iter().map(|share| Crossings::new(height(share))).collect(),
        }
    }

    /// Looks at an axon.
    pub fn add(&mut self, axon: &AxonRecord) {
        self.lengths.extend(finite(Some(path_length(&axon.shaft)).filter(|_| !axon.is_withdrawn)));
        self.straightnesses.extend(finite(straightness(&axon.shaft)));
        self.crossings.iter_mut().for_each(|crossings| crossings.add(&axon.shaft, axon.population));
        if axon.is_branch {
            return;
        }
        let turning = turning_angle(axon.initial_heading, &axon.shaft);
        self.turning_angles.extend(finite(turning.map(f64::to_degrees)));
        let turn = signed_angle(axon.initial_heading, axon.final_heading);
        self.heading_turns.extend(finite(turn.map(f64::to_degrees)));
        self.trunks.push(Trunk { birth_time: axon.birth_time, arrival_time: axon.arrival_time });
    }

    /// The measures of the axons looked at.
    pub fn measure(self) -> Morphology {
        let (early, late) = split_birth_window(&self.trunks);
        let travel = |trunk: &Trunk| finite(trunk.arrival_time.map(|arrival| arrival - trunk.birth_time));
        let travel_times: Vec<f64> = self.trunks.iter().filter_map(travel).collect();
        Morphology {
            hits: count_hits(&self.trunks),
            hits_early: count_hits(&early),
            hits_late: count_hits(&late),
            travel_time_h: Distribution::of(&travel_times),
            length_um: Distribution::of(&self.lengths),
            straightness: Distribution::of(&self.straightnesses),
            turning_angle_deg: Distribution::of(&self.turning_angles),
            heading_turn_deg: Distribution::of(&self.heading_turns),
            heights: self.crossings.into_iter().map(|crossings| crossings.measure(self.linkage)).collect(),
        }
    }
}

/// A value, if there is one and it is finite.
fn finite(value: Option<f64>) -> Option<f64> {
    value.filter(|value| value.is_finite())
}

/// Length of a polyline, Σ|x_{i+1} − x_i|, in µm; 0 for fewer than two points.
pub fn path_length(path: &[[f64; 2]]) -> f64 {
    path.windows(2).map(|ends| (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1])).sum()
}

/// End-to-end distance over path length, in 0…1; none for a path of no length.
pub fn straightness(path: &[[f64; 2]]) -> Option<f64> {
    let length = path_length(path);
    let chord = chord(path)?;
    (length > 0.0).then(|| (chord[0].hypot(chord[1]) / length).min(1.0))
}

/// The angle from `initial_heading` to the line from the path's start to its end, rad in (−π, π], counter-clockwise
/// positive; none for a closed path or a heading of no length.
pub fn turning_angle(initial_heading: [f64; 2], path: &[[f64; 2]]) -> Option<f64> {
    signed_angle(initial_heading, chord(path)?)
}

/// The angle from `from` to `to`, atan2(from × to, from · to), rad in (−π, π], counter-clockwise positive; none if either
/// has no length.
pub fn signed_angle(from: [f64; 2], to: [f64; 2]) -> Option<f64> {
    let cross = from[0] * to[1] - from[1] * to[0];
    let dot = from[0] * to[0] + from[1] * to[1];
    // A cross product of −0 would put an exact reversal at −π.
    (cross != 0.0 || dot != 0.0).then(|| (cross + 0.0).atan2(dot))
}

/// The vector from a path's start to its end.
fn chord(path: &[[f64; 2]]) -> Option<[f64; 2]> {
    let (start, end) = (path.first()?, path.last()?);
    Some([end[0] - start[0], end[1] - start[1]])
}

/// Counts arrivals.
fn count_hits(axons: &[Trunk]) -> Hits {
    let (born, arrived) = (axons.len(), axons.iter().filter(|axon| axon.arrival_time.is_some()).count());
    Hits { born, arrived, fraction: (born > 0).then(|| arrived as f64 / born as f64) }
}

/// The axons born before the middle of the birth window, and the others; two empty lists if the window has no length.
fn split_birth_window(axons: &[Trunk]) -> (Vec<Trunk>, Vec<Trunk>) {
    let times = || axons.iter().map(|axon| axon.birth_time);
    match (times().reduce(f64::min), times().reduce(f64::max)) {
        (Some(first), Some(last)) if first < last => {
            axons.iter().partition(|axon| axon.birth_time < 0.5 * (first + last))
        }
        _ => (Vec::new(), Vec::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI};

    fn straight(birth_time: f64, arrival_time: Option<f64>, angle: f64) -> AxonRecord {
        // Starts upward, ends at `angle` (counter-clockwise) from upward.
        let end = [-300.0 * angle.sin(), 300.0 * angle.cos()];
        AxonRecord {
            population: 0,
            shaft: vec![[0.0, 0.0], end],
            birth_time,
            arrival_time,
            is_branch: false,
            is_withdrawn: false,
            initial_heading: [0.0, 1.0],
            final_heading: end,
        }
    }

    fn measure(axons: &[AxonRecord], options: &MeasureOptions) -> Morphology {
        let mut tally = Tally::new(options);
        axons.iter().for_each(|axon| tally.add(axon));
        tally.measure()
    }

    fn options() -> MeasureOptions {
        MeasureOptions { shares: vec![0.25, 0.75], y_min: 0.0, y_max: 200.0, linkage: 10.0 }
    }

    #[test]
    fn the_straightness_of_a_semicircle_is_two_over_pi() {
        let count = 10_000;
        let point = |i: u32| {
            let angle = PI * f64::from(i) / f64::from(count);
            [50.0 * angle.cos(), 50.0 * angle.sin()]
        };
        let semicircle: Vec<[f64; 2]> = (0..=count).map(point).collect();
        assert!((straightness(&semicircle).unwrap() - FRAC_2_PI).abs() < 1e-8);
        assert!((path_length(&semicircle) - 50.0 * PI).abs() < 1e-5);
        assert!((turning_angle([0.0, 1.0], &semicircle).unwrap() - FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn turning_angles_of_plus_and_minus_theta_have_mean_zero_and_sd_theta_root_two() {
        let theta = 0.3;
        let axons = [straight(0.0, None, theta), straight(0.0, None, -theta)];
        let turning = measure(&axons, &options()).turning_angle_deg.unwrap();
        assert!(turning.mean.abs() < 1e-12);
        assert!((turning.max - theta.to_degrees()).abs() < 1e-12, "counter-clockwise is positive");
        assert!((turning.sd.unwrap() - theta.to_degrees() * 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_reversal_is_plus_180_degrees_whatever_the_sign_of_zero() {
        assert_eq!(signed_angle([0.0, 1.0], [0.0, -1.0]), Some(PI));
        assert_eq!(signed_angle([0.0, 1.0], [-0.0, -1.0]), Some(PI));
        assert_eq!(signed_angle([0.0, 0.0], [0.0, 1.0]), None);
    }

    #[test]
    fn hits_are_counted_by_halves_of_the_birth_window() {
        // Window 0…16 h, middle 8 h: three early of which one arrives, two late of which both arrive.
        let axons = [
            straight(0.0, Some(30.0), 0.0),
            straight(2.0, None, 0.0),
            straight(7.9, None, 0.0),
            straight(8.0, Some(28.0), 0.0),
            straight(16.0, Some(40.0), 0.0),
        ];
        let measures = measure(&axons, &options());
        assert_eq!(measures.hits, Hits { born: 5, arrived: 3, fraction: Some(0.6) });
        assert_eq!(measures.hits_early.fraction, Some(1.0 / 3.0));
        assert_eq!(measures.hits_late.fraction, Some(1.0));
        let travel = measures.travel_time_h.unwrap();
        assert_eq!((travel.n, travel.min, travel.max), (3, 20.0, 30.0));
    }

    #[test]
    fn axons_born_at_once_have_no_early_and_late_halves() {
        let measures = measure(&[straight(1.0, None, 0.0), straight(1.0, None, 0.0)], &options());
        assert_eq!(measures.hits_early, Hits { born: 0, arrived: 0, fraction: None });
        assert_eq!(measures.hits_late.fraction, None);
    }

    #[test]
    fn nobody_and_newborns_give_nulls_and_no_nan() {
        let mut newborn = straight(0.0, None, 0.0);
        newborn.shaft = vec![[5.0, 0.0]];
        for axons in [vec![], vec![newborn]] {
            let measures = measure(&axons, &options());
            assert_eq!(measures.straightness, None);
            assert_eq!(measures.turning_angle_deg, None);
            let json = serde_json::to_string(&measures).unwrap();
            assert!(json.contains("\"straightness\":null") && !json.contains("NaN"));
        }
    }

    #[test]
    fn heights_are_those_of_the_tissue_now() {
        let measures = measure(&[straight(0.0, None, 0.0)], &options());
        let heights: Vec<f64> = measures.heights.iter().map(|height| height.y_um).collect();
        assert_eq!(heights, [50.0, 150.0]);
        assert_eq!(measures.heights[1].crossing, 1);
    }
}
