//! Fascicles: how dispersed and how bundled the axons are where they cross a height.
//!
//! A height is a horizontal line y = share · (y_max − y_min) + y_min of the tissue *as it is now*. Each shaft is counted
//! once, at its **first** crossing of the line on the way from origin to tip. Axons whose crossings lie no further than a
//! *linkage distance* from the next one belong to one fascicle: single linkage, which on a line is cutting the sorted
//! positions wherever the gap is wider than that distance. Ours: the paper judges fascicles by eye.

use super::statistics;
use serde::Serialize;

/// Single-linkage clusters of the axons that cross one height.
///
/// Sizes count axons. "Fascicle" means a cluster of two axons or more unless said otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fascicles {
    /// Two neighbours at most this far apart (µm) belong together.
    pub linkage_um: f64,
    /// How many fascicles of two axons or more there are.
    pub count: usize,
    /// Mean size of the fascicles of two axons or more, every *fascicle* counting once; none without a fascicle.
    pub mean_size: Option<f64>,
    /// Mean size of the cluster that an *axon* finds itself in, Σ size²/Σ size over all clusters, single axons included
    /// as size 1: every axon counts once, so a stray axon hardly changes it. None if no axon crosses.
    pub mean_size_per_axon: Option<f64>,
    /// Share of the crossing axons that lie in the largest cluster (1/n if all are single); none if no axon crosses.
    pub largest_fraction: Option<f64>,
    /// Share of the crossing axons that lie in any fascicle of two axons or more; none if no axon crosses.
    pub bundled_fraction: Option<f64>,
}

/// What is seen on one horizontal line across the tissue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeightMeasures {
    /// The height as a share of the tissue's extent in y: 0 at the bottom, 1 at the top.
    pub share: f64,
    /// The same height in µm.
    pub y_um: f64,
    /// How many axons cross it.
    pub crossing: usize,
    /// Mean of the crossing positions x in µm; none if no axon crosses.
    pub mean_x_um: Option<f64>,
    /// Spread: sample standard deviation of the crossing positions x in µm; none with fewer than two axons.
    pub spread_um: Option<f64>,
    /// Share of the crossing axons whose nearest neighbour on the line is of their own population: 1 where populations are sorted,
    /// Σ n_k(n_k − 1)/(n(n − 1)) on average where they are mixed. None with fewer than two axons, or of one population only.
    pub like_neighbours: Option<f64>,
    /// The bundles on the line.
    pub fascicles: Fascicles,
}

/// The height line to look at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Height {
    /// Share of the extent in y, 0…1.
    pub share: f64,
    /// Lowest y of the tissue now, µm.
    pub y_min: f64,
    /// Highest y of the tissue now, µm.
    pub y_max: f64,
}

impl Height {
    /// y = share · (y_max − y_min) + y_min, in µm.
    pub fn y(&self) -> f64 {
        self.share * (self.y_max - self.y_min) + self.y_min
    }
}

/// The shafts that cross a height.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossings {
    height: Height,
    /// x (µm) of each, and its population.
    found: Vec<(f64, u16)>,
}

impl Crossings {
    /// None yet.
    pub fn new(height: Height) -> Self {
        Self { height, found: Vec::new() }
    }

    /// Looks at a shaft (origin → tip, µm) of a population.
    pub fn add(&mut self, shaft: &[[f64; 2]], population: u16) {
        self.found.extend(first_crossing(shaft, self.height.y()).map(|x| (x, population)));
    }

    /// Dispersion and bundling of the shafts that cross, with linkage distance `linkage` in µm (the reach of a filopodium, 10 µm, is
    /// natural).
    pub fn measure(self, linkage: f64) -> HeightMeasures {
        let positions: Vec<f64> = self.found.iter().map(|(x, _)| *x).collect();
        HeightMeasures {
            share: self.height.share,
            y_um: self.height.y(),
            crossing: positions.len(),
            mean_x_um: statistics::mean(&positions),
            spread_um: statistics::standard_deviation(&positions),
            like_neighbours: like_neighbours(self.found),
            fascicles: find_fascicles(&positions, linkage),
        }
    }
}

/// Share of crossings (x in µm, population) whose nearest neighbour is of their own population; of two as near, the one to the left.
fn like_neighbours(mut crossings: Vec<(f64, u16)>) -> Option<f64> {
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let several = crossings.iter().any(|(_, kind)| *kind != crossings[0].1);
    let is_like = |i: &usize| {
        let (x, kind) = crossings[*i];
        let before = i.checked_sub(1).map(|j| crossings[j]);
        let after = crossings.get(i + 1).copied();
        let nearest = match (before, after) {
            (Some(left), Some(right)) if right.0 - x < x - left.0 => Some(right),
            (Some(left), _) => Some(left),
            (None, right) => right,
        };
        nearest.is_some_and(|(_, other)| other == kind)
    };
    let like = (0..crossings.len()).filter(is_like).count();
    several.then(|| like as f64 / crossings.len() as f64)
}

/// The x (µm) at which a shaft, walked from its origin, first meets the line at `y`, by linear interpolation; none if it
/// never does. A vertex on the line is a crossing, the origin included.
pub fn first_crossing(shaft: &[[f64; 2]], y: f64) -> Option<f64> {
    let origin = shaft.first()?;
    if origin[1] == y {
        return Some(origin[0]);
    }
    shaft.windows(2).find_map(|ends| {
        let (before, after) = (ends[0][1] - y, ends[1][1] - y);
        let crosses = after == 0.0 || (before < 0.0) != (after < 0.0);
        let along = before / (before - after);
        let x = ends[0][0] + along * (ends[1][0] - ends[0][0]);
        (crosses && x.is_finite()).then_some(x)
    })
}

/// Clusters positions (µm, any order) by single linkage with the distance `linkage` (µm, inclusive).
pub fn find_fascicles(positions: &[f64], linkage: f64) -> Fascicles {
    let sizes = cluster_sizes(positions, linkage);
    let axons = positions.len() as f64;
    let bundles: Vec<f64> = sizes.iter().filter(|&&s| s >= 2).map(|&s| s as f64).collect();
    let largest = sizes.iter().copied().max();
    Fascicles {
        linkage_um: linkage,
        count: bundles.len(),
        mean_size: statistics::mean(&bundles),
        mean_size_per_axon: largest.map(|_| sizes.iter().map(|&s| (s * s) as f64).sum::<f64>() / axons),
        largest_fraction: largest.map(|size| size as f64 / axons),
        bundled_fraction: largest.map(|_| bundles.iter().fold(0.0, |sum, size| sum + size) / axons),
    }
}

/// The sizes of the single-linkage clusters, from left to right.
fn cluster_sizes(positions: &[f64], linkage: f64) -> Vec<usize> {
    let mut sorted = positions.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.chunk_by(|left, right| right - left <= linkage).map(<[f64]>::len).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn upright(positions: &[f64]) -> Vec<Vec<[f64; 2]>> {
        positions.iter().map(|&x| vec![[x, 0.0], [x, 100.0]]).collect()
    }

    fn measured(shafts: &[Vec<[f64; 2]>], populations: &[u16], height: Height) -> HeightMeasures {
        let mut crossings = Crossings::new(height);
        shafts.iter().zip(populations).for_each(|(shaft, population)| crossings.add(shaft, *population));
        crossings.measure(10.0)
    }

    #[test]
    fn clusters_on_known_positions_have_the_known_sizes() {
        // Gaps: 4, 5 | 30 | 30, 5 (inclusive) …: clusters of 3, 1 and 2.
        let fascicles = find_fascicles(&[40.0, 9.0, 0.0, 4.0, 75.0, 70.0], 5.0);
        assert_eq!(fascicles.count, 2);
        assert_eq!(fascicles.mean_size, Some(2.5));
        assert_eq!(fascicles.mean_size_per_axon, Some((9.0 + 1.0 + 4.0) / 6.0));
        assert_eq!(fascicles.largest_fraction, Some(0.5));
        assert_eq!(fascicles.bundled_fraction, Some(5.0 / 6.0));
    }

    #[test]
    fn single_axons_make_no_fascicle_but_are_their_own_cluster() {
        let fascicles = find_fascicles(&[0.0, 20.0, 40.0, 60.0], 10.0);
        assert_eq!((fascicles.count, fascicles.mean_size), (0, None));
        assert_eq!(fascicles.mean_size_per_axon, Some(1.0));
        assert_eq!((fascicles.largest_fraction, fascicles.bundled_fraction), (Some(0.25), Some(0.0)));
    }

    #[test]
    fn the_spread_of_an_arithmetic_sequence_is_its_closed_form() {
        // SD of d·{0, …, n−1} with divisor n − 1 is d √(n(n+1)/12).
        let (count, step) = (21, 7.0);
        let shafts = upright(&(0..count).map(|i| step * f64::from(i)).collect::<Vec<_>>());
        let height = Height { share: 0.75, y_min: -20.0, y_max: 120.0 };
        let measures = measured(&shafts, &vec![0; shafts.len()], height);
        assert_eq!(measures.y_um, 85.0);
        assert_eq!(measures.crossing, 21);
        assert!((measures.mean_x_um.unwrap() - 70.0).abs() < 1e-12);
        let expected = step * (f64::from(count * (count + 1)) / 12.0).sqrt();
        assert!((measures.spread_um.unwrap() - expected).abs() < 1e-12);
        assert_eq!(measures.fascicles.largest_fraction, Some(1.0));
    }

    #[test]
    fn neighbours_are_like_where_populations_are_sorted_and_unlike_where_they_alternate() {
        let shafts = upright(&[0.0, 3.0, 7.0, 50.0, 52.0]);
        let height = Height { share: 0.5, y_min: 0.0, y_max: 100.0 };
        let like = |kinds: [u16; 5]| measured(&shafts, &kinds, height).like_neighbours;
        assert_eq!(like([0, 0, 0, 1, 1]), Some(1.0));
        assert_eq!(like([0, 1, 0, 1, 0]), Some(0.0));
        assert_eq!(like([0, 0, 1, 0, 1]), Some(0.4));
        assert_eq!(like([2; 5]), None);
    }

    #[test]
    fn only_the_first_crossing_counts_whichever_way_the_shaft_runs() {
        let zigzag = [[0.0, 0.0], [10.0, 10.0], [20.0, 0.0], [30.0, 10.0]];
        assert_eq!(first_crossing(&zigzag, 2.5), Some(2.5));
        let reversed: Vec<[f64; 2]> = zigzag.iter().rev().copied().collect();
        assert_eq!(first_crossing(&reversed, 2.5), Some(22.5));
        assert_eq!(first_crossing(&zigzag, 0.0), Some(0.0));
        assert_eq!(first_crossing(&zigzag, 10.0), Some(10.0));
        assert_eq!(first_crossing(&zigzag, 10.1), None);
    }

    #[test]
    fn nobody_on_the_line_leaves_everything_unsaid() {
        let height = Height { share: 0.5, y_min: 0.0, y_max: 600.0 };
        for shafts in [vec![], vec![vec![]], upright(&[3.0])] {
            let measures = measured(&shafts, &vec![0; shafts.len()], height);
            assert_eq!((measures.crossing, measures.spread_um, measures.mean_x_um), (0, None, None));
            let json = serde_json::to_value(&measures).unwrap();
            assert!(json["fascicles"]["largest_fraction"].is_null());
            assert!(json["fascicles"]["mean_size"].is_null());
        }
    }
}
