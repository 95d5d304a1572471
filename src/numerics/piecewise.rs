//! Straight lines between given points, constant beyond the ends.

/// Value and slope at `x` of the line through `points` (place, value), their places ascending; none without points.
pub fn value_and_slope(points: &[[f64; 2]], x: f64) -> Option<(f64, f64)> {
    let after = points.partition_point(|point| point[0] <= x);
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some([from, low]), Some([to, high])) => {
            Some((low + (high - low) * (x - from) / (to - from), (high - low) / (to - from)))
        }
        (Some([_, end]), None) | (None, Some(&[_, end])) => Some((end, 0.0)),
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_points_it_is_a_straight_line_and_beyond_them_constant() {
        let points = [[1.0, 2.0], [3.0, 8.0], [4.0, 8.0]];
        assert_eq!(value_and_slope(&points, 1.5), Some((3.5, 3.0)));
        assert_eq!(value_and_slope(&points, 3.0), Some((8.0, 0.0)));
        assert_eq!(
            (value_and_slope(&points, 0.0), value_and_slope(&points, 9.0)),
            (Some((2.0, 0.0)), Some((8.0, 0.0)))
        );
        assert_eq!(value_and_slope(&[], 1.0), None);
    }
}
