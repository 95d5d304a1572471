//! Polylines reduced to what is visible (Douglas & Peucker 1973).

use crate::numerics::polygon::distance_to_segment;

/// The points of a polyline that are needed to stay within `tolerance` (same unit as the points) of every point of it;
/// the first and the last are kept. Points that are not finite are left out first.
pub fn simplify(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let points: Vec<[f64; 2]> = points.iter().copied().filter(|p| p[0].is_finite() && p[1].is_finite()).collect();
    let Some(last) = points.len().checked_sub(1) else { return points };
    let mut kept = vec![false; points.len()];
    kept[0] = true;
    kept[last] = true;
    let mut open = vec![(0, last)];
    while let Some((start, end)) = open.pop() {
        if let Some(split) = farthest_beyond(&points, start, end, tolerance) {
            kept[split] = true;
            open.push((start, split));
            open.push((split, end));
        }
    }
    points.into_iter().zip(kept).filter_map(|(point, keep)| keep.then_some(point)).collect()
}

/// The point between `start` and `end` that lies farthest from the segment between them, if farther than the tolerance.
fn farthest_beyond(points: &[[f64; 2]], start: usize, end: usize, tolerance: f64) -> Option<usize> {
    let mut farthest = (tolerance, None);
    for index in start + 1..end {
        let distance = distance_to_segment(points[index], [points[start], points[end]]);
        if distance > farthest.0 {
            farthest = (distance, Some(index));
        }
    }
    farthest.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_keeps_only_its_ends_and_a_corner_stays() {
        let line: Vec<[f64; 2]> = (0..100).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(simplify(&line, 1e-9), [line[0], line[99]]);
        assert_eq!(
            simplify(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0]], 0.1),
            [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]
        );
    }

    #[test]
    fn every_point_left_out_lies_within_the_tolerance() {
        let wave: Vec<[f64; 2]> = (0..2000).map(|i| [0.05 * f64::from(i), 7.0 * (0.01 * f64::from(i)).sin()]).collect();
        let simple = simplify(&wave, 0.2);
        assert!(simple.len() < 40, "{}", simple.len());
        for &point in &wave {
            let nearest =
                simple.windows(2).map(|ends| distance_to_segment(point, [ends[0], ends[1]])).fold(f64::MAX, f64::min);
            assert!(nearest <= 0.2 + 1e-12, "{nearest}");
        }
    }

    #[test]
    fn nothing_a_point_and_what_is_not_finite_are_survived() {
        assert!(simplify(&[], 1.0).is_empty());
        assert_eq!(simplify(&[[1.0, 2.0]], 1.0), [[1.0, 2.0]]);
        assert_eq!(simplify(&[[1.0, 2.0], [f64::NAN, 0.0]], 1.0), [[1.0, 2.0]]);
    }
}
