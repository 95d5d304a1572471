//! Cues that decay within a cell.

use std::sync::LazyLock;

use tropism::study::stability::cue_mesh::{CueMeshMap, CueSeries, compute};

static MAP: LazyLock<CueMeshMap> = LazyLock::new(|| compute(11).unwrap());

fn of(mesh: &str, mass: &str) -> &'static CueSeries {
    MAP.series.iter().find(|map| map.mesh == mesh && map.mass == mass).unwrap()
}

fn smallest(map: &CueSeries) -> f64 {
    map.points.iter().map(|point| point.smallest).fold(f64::INFINITY, f64::min)
}

fn overshoot(map: &CueSeries) -> f64 {
    map.points.iter().map(|point| point.overshoot).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn lumped_mass_keeps_the_bounds_on_delaunay_meshes_and_on_flipped_ones() {
    for mesh in ["acute", "right-angled", "obtuse, flipped"] {
        let map = of(mesh, "lumped");
        assert!(smallest(map) >= 0.0 && overshoot(map) < 1e-13, "{mesh}: {} {}", smallest(map), overshoot(map));
        assert_eq!(map.negative_from, None);
    }
}

#[test]
fn lumped_mass_goes_negative_on_an_obtuse_mesh_that_may_not_be_flipped() {
    let map = of("obtuse", "lumped");
    assert!(smallest(map) < -1e-3, "{}", smallest(map));
    assert!(map.points.iter().all(|point| point.wrong_edges > 0));
}

#[test]
fn the_consistent_mass_is_safe_up_to_8_on_equilateral_cells_and_nowhere_on_right_angled_ones() {
    // k (A + A)/12 ≤ D cot 60° with A = √3/4 h²: k h²/D ≤ 8.
    let acute = of("acute", "consistent");
    assert!((acute.wrong_sign_from.unwrap() - 8.0).abs() < 1e-4, "{:?}", acute.wrong_sign_from);
    // Sharp: the first undershoot beyond round-off comes there as well.
    assert!((acute.negative_from.unwrap() - 8.0).abs() < 1e-2, "{:?}", acute.negative_from);
    // The long side of a right isosceles cell has cot 90° = 0 on both sides.
    assert!(of("right-angled", "consistent").points.iter().all(|point| point.wrong_edges > 0));
}

#[test]
fn the_consistent_mass_undershoots_and_overshoots_by_a_fifth_where_the_mesh_is_far_too_coarse() {
    for mesh in ["acute", "right-angled", "obtuse"] {
        let map = of(mesh, "consistent");
        let (low, high) = (smallest(map), overshoot(map));
        assert!((-0.35..-0.15).contains(&low) && (0.15..0.35).contains(&high), "{mesh}: {low} {high}");
    }
}
