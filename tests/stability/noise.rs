//! The same Brownian path at Δt, Δt/2, Δt/4, ….

use std::sync::LazyLock;

use tropism::study::stability::noise::{Mean, NoiseMap, compute};

use crate::roster;

static MAP: LazyLock<NoiseMap> = LazyLock::new(|| compute(&roster(), 200).unwrap());

fn near(found: Mean, wanted: f64) -> bool {
    (found.mean - wanted).abs() < 4.0 * found.error
}

#[test]
fn headings_without_a_pull_are_the_same_sums_at_every_step() {
    for map in &MAP.methods {
        let first = map.points[0].free_cosine.mean;
        for point in &map.points {
            assert!((point.free_cosine.mean - first).abs() < 1e-12, "{}: {point:?}", map.method);
            assert!(near(point.free_cosine, MAP.free_cosine), "{point:?}, wanted {}", MAP.free_cosine);
            assert!(near(point.squared_distance, MAP.squared_distance), "{point:?}, wanted {}", MAP.squared_distance);
        }
    }
}

#[test]
fn under_a_pull_statistics_are_von_mises_at_fine_steps_and_with_rotation_at_every_step() {
    for map in &MAP.methods {
        for point in map.points.iter().filter(|point| map.method == "rotation" || point.step < 0.15) {
            assert!(near(point.pulled_cosine, MAP.pulled_cosine), "{}: {point:?}, {}", map.method, MAP.pulled_cosine);
        }
    }
}

#[test]
fn each_halving_of_the_step_brings_the_tips_of_the_same_axons_together() {
    for map in &MAP.methods {
        let apart: Vec<f64> = map.points.iter().filter_map(|point| point.apart).collect();
        assert_eq!(apart.len(), map.points.len() - 1);
        assert!(apart.windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{}: {apart:?}", map.method);
    }
}
