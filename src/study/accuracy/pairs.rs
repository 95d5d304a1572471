//! Pairs of a step and a mesh size to choose from, and what a run with one is held against.

use super::difference;
use super::sequence::{Pilot, Sequence};

/// A step (h) and a mesh size (µm) to try.
pub struct Pair {
    pub values: (f64, f64),
    /// Places in their sequences; a size between two has the place of the finer one.
    pub places: (usize, usize),
    /// What the whole scene would take with them (ns).
    pub time: f64,
}

impl Pair {
    /// Each step with each mesh size, and with those half-way between two, in order of time; a cone takes `cone` ns at a stage. The
    /// finest, by which the others are judged, are not among them.
    pub fn all(steps: &Sequence, meshes: &Sequence, cone: f64) -> Vec<Self> {
        let mut pairs = Vec::new();
        for (i, step) in steps.judged() {
            for (j, mesh) in meshes.judged() {
                let time = steps.costs[i].on(&meshes.costs[j].rates, cone);
                let between = j.checked_sub(1).map(|before| (meshes.values[before] * mesh).sqrt());
                let sizes = between.into_iter().chain([mesh]);
                pairs.extend(sizes.map(|mesh| Self { values: (step, mesh), places: (i, j), time }));
            }
        }
        pairs.sort_by(|a, b| a.time.total_cmp(&b.time));
        pairs
    }
}

/// A run with the finest of both, and bounds of its own error: by step and mesh, taken to be independent of that of others, and by the
/// mesh of the matrix, which all have in common.
pub struct Judge {
    pub finest: Pilot,
    pub tail: f64,
    pub by_matrix: f64,
}

impl Judge {
    /// The error of a run.
    pub fn error(&self, pilot: &Pilot) -> f64 {
        difference(&pilot.tips, &self.finest.tips).hypot(self.tail) + self.by_matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::accuracy::sequence::Cost;

    #[test]
    fn each_step_meets_each_size_and_those_between_in_order_of_time() {
        let sequence = |values: &[f64]| Sequence {
            values: values.to_vec(),
            errors: vec![0.0; values.len() - 1],
            costs: vec![Cost::default(); values.len()],
            settled: 0,
            tail: 0.0,
        };
        let (steps, mut meshes) = (sequence(&[2.0, 1.0, 0.5]), sequence(&[16.0, 4.0, 1.0]));
        for (cost, time) in meshes.costs.iter_mut().zip([5.0, 7.0, 9.0]) {
            cost.rates.run = time;
        }
        let pairs: Vec<_> = Pair::all(&steps, &meshes, 0.0).iter().map(|pair| (pair.values, pair.places)).collect();
        let expected = [
            ((2.0, 16.0), (0, 0)),
            ((1.0, 16.0), (1, 0)),
            ((2.0, 8.0), (0, 1)),
            ((2.0, 4.0), (0, 1)),
            ((1.0, 8.0), (1, 1)),
            ((1.0, 4.0), (1, 1)),
        ];
        assert_eq!(pairs, expected);
        let given = Pair::all(&Sequence::fixed(3.0), &meshes, 0.0);
        assert_eq!(given.len(), 3, "a value that the scene gives is its own finest");
    }
}
