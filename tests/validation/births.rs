//! Births are uniform over their edge and their interval.

use crate::common::cones;
use serde_json::{Value, json};
use tropism::prelude::{GrowthCone, Site, Tissue, With};
use tropism::systems;

const COUNT: usize = 2000;

/// Kolmogorov–Smirnov distance from the uniform distribution over [0, 1].
fn distance_from_uniform(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let gaps = values.iter().enumerate().map(|(i, x)| (x - i as f64 / n).max((i + 1) as f64 / n - x));
    gaps.fold(0.0, f64::max)
}

fn assert_uniform(values: Vec<f64>, what: &str) {
    let limit = 1.949 / (values.len() as f64).sqrt();
    let distance = distance_from_uniform(values);
    println!("{what}: Kolmogorov-Smirnov distance {distance:.4}, 0.1 % limit {limit:.4}");
    assert!(distance < limit, "{what}: {distance} > {limit}");
}

/// Shares of the interval and of the width at which axons are born.
fn births(origin: Value, seed: u64) -> (Vec<f64>, Vec<[f64; 2]>) {
    let scene = json!({
        "seed": seed,
        "tissue": { "outline": { "rectangle": { "width": 800, "height": 600 } }, "mesh_size": 90 },
        "time": { "duration": 72 },
        "populations": { "axons": { "count": COUNT, "origin": origin, "births": { "uniform": { "from": 3, "to": 18 } } } }
    });
    let simulation = crate::common::assembled(&scene, &systems::standard());
    let world = simulation.world();
    let times = cones(world).iter().map(|cone| (cone.birth_time - 3.0) / 15.0).collect();
    let tissue = world.resource::<Tissue>();
    // Before birth a cone's site is where it will be born.
    let mut origins = world.try_query_filtered::<&Site, With<GrowthCone>>().unwrap();
    let place = |origin: &Site| tissue.reference_position(*origin);
    (times, origins.iter(world).map(place).map(|x| [x.x, x.y]).collect())
}

#[test]
fn births_are_uniform_over_the_edge_and_the_interval_and_the_two_are_unrelated() {
    let (times, places) = births(json!({ "edge": "bottom" }), 1);
    assert!(places.iter().all(|x| x[1].abs() < 1e-12));
    assert!(times.iter().all(|t| (-1e-6..=1.0 + 1e-6).contains(t)));
    let shares: Vec<f64> = places.iter().map(|x| x[0] / 800.0).collect();
    let covariance: f64 = times.iter().zip(&shares).map(|(a, b)| (a - 0.5) * (b - 0.5)).sum::<f64>() / COUNT as f64;
    assert!((12.0 * covariance).abs() < 4.0 / (COUNT as f64).sqrt(), "correlation {}", 12.0 * covariance);
    assert_uniform(times, "birth times");
    assert_uniform(shares, "birth places");
}

#[test]
fn births_on_a_part_of_an_edge_are_uniform_over_that_part() {
    let (_, places) = births(json!({ "edge": { "name": "right", "from": 0.25, "to": 0.75 } }), 2);
    assert!(places.iter().all(|x| (x[0] - 800.0).abs() < 1e-9));
    assert_uniform(places.iter().map(|x| (x[1] - 150.0) / 300.0).collect(), "birth places on a part");
}
