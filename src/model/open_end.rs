//! The part of a shaft between its last stored vertex and its tip: the directions in which the tip may go on.
//!
//! Each point passed at a distance r from the anchor, the last stored vertex, allows chords within tolerance/r of its own
//! direction. What all points allow is a sector, kept as tangents of angles from a first direction.

use crate::kept;

/// The sector of allowed directions (all in the reference configuration, µm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OpenEnd {
    anchor: [f64; 2],
    axis: [f64; 2],
    low: f64,
    high: f64,
    far: f64,
}

kept! { struct OpenEnd { anchor, axis, low, high, far } }

impl OpenEnd {
    /// Of a shaft that has not begun.
    pub(super) const NONE: Self = Self { anchor: [0.0; 2], axis: [0.0; 2], low: 0.0, high: 0.0, far: 0.0 };

    /// An end of no length.
    pub(super) fn at(anchor: [f64; 2]) -> Self {
        Self { anchor, ..Self::NONE }
    }

    /// A straight end from `anchor` to `tip`, however long.
    pub(super) fn chord(anchor: [f64; 2], tip: [f64; 2], tolerance: f64, longest: f64) -> Self {
        let fresh = Self::at(anchor);
        fresh.widened(tip, tolerance, longest).unwrap_or(fresh)
    }

    /// The end with its tip at `to`, or `None` when the chord from the anchor to `to` would pass a point of the path at more than
    /// the tolerance, or be longer than `longest`.
    pub(super) fn widened(&self, to: [f64; 2], tolerance: f64, longest: f64) -> Option<Self> {
        let end = *self;
        let chord = [to[0] - end.anchor[0], to[1] - end.anchor[1]];
        let length = chord[0].hypot(chord[1]);
        if end.far == 0.0 {
            if length == 0.0 {
                return Some(end);
            }
            let axis = [chord[0] / length, chord[1] / length];
            let slope = tolerance / length;
            return Some(Self { axis, low: -slope, high: slope, far: length, ..end });
        }
        let along = chord[0] * end.axis[0] + chord[1] * end.axis[1];
        let across = chord[1] * end.axis[0] - chord[0] * end.axis[1];
        if along <= 0.5 * length || length > longest || length < end.far {
            return None;
        }
        let slope = across / along;
        if slope < end.low || slope > end.high {
            return None;
        }
        let room = tolerance / along;
        let (low, high) = (end.low.max(slope - room), end.high.min(slope + room));
        Some(Self { low, high, far: end.far.max(length), ..end })
    }
}
