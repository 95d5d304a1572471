//! The shafts as they were at each frame, from what has changed between frames.
//!
//! Shafts only grow, unless a mechanism draws them back or lays them anew. Then what was stored before differs from what is there
//! now from some vertex on: the old vertices end at this frame, and the new ones begin with it.

use crate::kept;
use crate::model::shafts::Shafts;

/// A vertex that was stored at a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SeenVertex {
    pub(super) cell: u32,
    pub(super) weights: [f32; 2],
    /// When the cone passed it (h).
    passed: f32,
    /// Since when it is there (h).
    pub(super) since: f32,
    /// At which frame it was gone (h); infinite while it is there.
    pub(super) until: f32,
}

/// All vertices of all shafts that were there at any frame.
#[derive(Debug, Clone, Default)]
pub(super) struct ShaftHistory {
    shafts: Vec<SeenShaft>,
    seen: usize,
    struck: bool,
}

/// Of one shaft: all vertices, and which of them are there now, both from the origin on.
#[derive(Debug, Clone, Default)]
struct SeenShaft {
    vertices: Vec<SeenVertex>,
    present: Vec<u32>,
}

kept! { struct SeenVertex { cell, weights, passed, since, until } }
kept! { struct ShaftHistory { shafts, seen, struck } }
kept! { struct SeenShaft { vertices, present } }

impl ShaftHistory {
    /// Looks at the shafts at a frame (h).
    pub(super) fn observe(&mut self, shafts: &Shafts, time: f64) {
        self.shafts.resize_with(shafts.count(), SeenShaft::default);
        for (number, shaft) in self.shafts.iter_mut().enumerate() {
            let before = shaft.vertices.len();
            let now = shafts.vertices(number).map(|vertex| {
                let point = shafts.point(vertex);
                let (weights, passed) = (point.weights.map(|weight| weight as f32), shafts.time(vertex));
                SeenVertex { cell: point.cell, weights, passed, since: passed, until: f32::INFINITY }
            });
            self.struck |= shaft.observe(now, time as f32);
            self.seen += shaft.vertices.len() - before;
        }
    }

    /// Whether it is of so many shafts on a mesh of so many cells, each with vertices that are there in their order.
    pub(super) fn is_of(&self, shafts: usize, cells: usize) -> bool {
        let seen: usize = self.shafts.iter().map(|shaft| shaft.vertices.len()).sum();
        let in_order = |shaft: &SeenShaft| {
            let present = &shaft.present;
            present.windows(2).all(|pair| pair[0] < pair[1])
                && present.last().is_none_or(|&last| (last as usize) < shaft.vertices.len())
                && shaft.vertices.iter().all(|vertex| (vertex.cell as usize) < cells)
        };
        self.shafts.len() == shafts && self.seen == seen && self.shafts.iter().all(in_order)
    }

    /// Bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        self.seen * Self::bytes_a_vertex() + self.shafts.len() * size_of::<SeenShaft>()
    }

    /// Bytes that a vertex takes.
    pub(super) fn bytes_a_vertex() -> usize {
        size_of::<SeenVertex>() + size_of::<u32>()
    }

    /// Whether any vertex was ever struck out.
    pub(super) fn has_struck(&self) -> bool {
        self.struck
    }

    /// The vertices of each shaft: all that were there at any frame, in order.
    pub(super) fn shafts(&self) -> impl Iterator<Item = &[SeenVertex]> {
        self.shafts.iter().map(|shaft| shaft.vertices.as_slice())
    }
}

impl SeenShaft {
    /// Takes the vertices that are there now; says whether any that was there before is gone.
    fn observe(&mut self, now: impl Iterator<Item = SeenVertex>, time: f32) -> bool {
        let mut now = now.peekable();
        let kept = self.present.iter().take_while(|&&place| {
            let vertex = &self.vertices[place as usize];
            now.next_if(|new| vertex.is(new)).is_some()
        });
        let kept = kept.count();
        let struck = kept < self.present.len();
        for place in self.present.drain(kept..) {
            self.vertices[place as usize].until = time;
        }
        for vertex in now {
            self.present.push(self.vertices.len() as u32);
            let since = if struck { time } else { vertex.since };
            self.vertices.push(SeenVertex { since, ..vertex });
        }
        struck
    }
}

impl SeenVertex {
    /// Whether two are the same vertex, seen at two frames.
    fn is(&self, other: &Self) -> bool {
        (self.cell, self.weights, self.passed) == (other.cell, other.weights, other.passed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::components::Site;
    use crate::model::shafts::ShaftPoint;

    fn site(x: f64) -> Site {
        Site { cell: 0, weights: [x, 0.1] }
    }

    /// Weights of what a history says was there at a time.
    fn there(history: &ShaftHistory, time: f32) -> Vec<f32> {
        let shaft = history.shafts().next().unwrap();
        let seen = shaft.iter().filter(|vertex| vertex.since <= time && time < vertex.until);
        seen.map(|vertex| vertex.weights[0]).collect()
    }

    #[test]
    fn what_is_drawn_back_and_laid_anew_was_there_before_and_is_not_after() {
        let mut shafts = Shafts::new(1, 0.0, 0.01);
        let mut history = ShaftHistory::default();
        shafts.start(0, site(0.0), [0.0, 0.0], 0.0);
        let at = |site: Site| [site.weights[0], 0.0];
        (1..=4).map(f64::from).for_each(|i| shafts.extend(0, (site(0.1 * i), [0.1 * i, 0.0]), i, at));
        history.observe(&shafts, 4.0);
        assert!(!history.has_struck());
        let first = there(&history, 4.0);
        assert_eq!(first.len(), shafts.vertices(0).count());
        assert_eq!(there(&history, 0.0), [0.0]);
        let point = |x: f64| ShaftPoint { site: site(x), time: 3.0 };
        shafts.lay_anew(0, 2, &[point(0.15), point(0.16)], point(0.17));
        history.observe(&shafts, 5.0);
        assert!(history.has_struck());
        assert_eq!(there(&history, 4.0), first);
        assert_eq!(there(&history, 5.0), [0.0, first[1], 0.15, 0.16]);
        shafts.lay_anew(0, 1, &[], point(0.05));
        history.observe(&shafts, 6.0);
        assert_eq!((there(&history, 5.5).len(), there(&history, 6.0).len()), (4, 1));
        assert_eq!(history.bytes(), history.seen * ShaftHistory::bytes_a_vertex() + size_of::<SeenShaft>());
    }
}
