//! Small vectors of any dimension.

/// `a · b`.
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}

/// `|a|`.
pub(crate) fn norm<const D: usize>(a: &[f64; D]) -> f64 {
    dot(a, a).sqrt()
}

/// `to − from`.
pub(crate) fn between<const D: usize>(from: &[f64; D], to: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| to[k] - from[k])
}

/// The part of a vector perpendicular to all of some orthonormal ones.
pub(crate) fn without<const D: usize>(mut vector: [f64; D], orthonormal: &[[f64; D]]) -> [f64; D] {
    for unit in orthonormal {
        let along = dot(&vector, unit);
        (0..D).for_each(|k| vector[k] -= along * unit[k]);
    }
    vector
}

/// Orthonormal vectors with the span of the given ones (Gram–Schmidt in their order).
pub(crate) fn orthonormal<const D: usize>(vectors: &[[f64; D]]) -> Vec<[f64; D]> {
    let mut found: Vec<[f64; D]> = Vec::new();
    for vector in vectors {
        let rest = without(*vector, &found);
        let length = norm(&rest);
        if length > 1e-6 * norm(vector) && found.len() < D {
            found.push(rest.map(|x| x / length));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orthonormal_vectors_span_what_was_given_and_leave_out_what_depends() {
        let given = [[3.0, 4.0, 0.0], [6.0, 8.0, 0.0], [1.0, 0.0, 2.0]];
        let found = orthonormal(&given);
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|v| (norm(v) - 1.0).abs() < 1e-15) && dot(&found[0], &found[1]).abs() < 1e-15);
        assert!(given.iter().all(|v| norm(&without(*v, &found)) < 1e-14));
        assert_eq!(between(&[1.0, 2.0], &[3.0, 5.0]), [2.0, 3.0]);
    }
}
