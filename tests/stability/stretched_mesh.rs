//! The tissue's mesh after a large stretch.

use std::sync::LazyLock;

use tropism::study::stability::stretched_mesh::{StretchMap, StretchPoint, compute};

static MAP: LazyLock<StretchMap> = LazyLock::new(|| compute(8).unwrap());

fn all() -> impl Iterator<Item = &'static StretchPoint> {
    MAP.upward.iter().chain(&MAP.sideways)
}

#[test]
fn a_mesh_that_is_delaunay_at_rest_is_not_after_the_papers_stretch() {
    for points in [&MAP.upward, &MAP.sideways] {
        let (rest, paper) = (&points[0], &points[4]);
        assert_eq!((rest.not_delaunay, rest.flips), (0.0, 0));
        assert!((paper.stretch - 1.4).abs() < 1e-12 && (paper.across - 0.77).abs() < 0.005, "{paper:?}");
        assert!(paper.not_delaunay > 0.0 && paper.flips > 0, "{paper:?}");
    }
    // Equilateral cells pulled along their rows: the apex passes 90° where λ/2 = √(3/4) √(1 − 3/7 (λ² − 1)), at λ = √(15/8).
    for point in &MAP.sideways {
        let flat = point.stretch > (15.0f64 / 8.0).sqrt();
        assert!(if flat { point.not_delaunay > 0.3 } else { point.not_delaunay < 0.02 }, "{point:?}");
    }
}

#[test]
fn flips_leave_edges_of_source_outlines_only_and_keep_the_lumped_concentration_positive() {
    for point in all() {
        assert!(point.not_delaunay_after_flips <= 0.01, "{point:?}");
        assert!(point.smallest >= 0.0, "{point:?}");
    }
}

#[test]
fn without_flips_the_lumped_concentration_goes_negative() {
    let worst = all().map(|point| point.smallest_without_flips).fold(f64::INFINITY, f64::min);
    assert!(worst < -1e-3, "{worst}");
}
