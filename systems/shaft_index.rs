//! Provider: what lies near a growth cone, from an R-tree over the shafts.
//!
//! The tree lives in the *reference* configuration, where stored vertices never move, so that it only ever grows. Each
//! shaft segment stands in it as its first vertex; a segment is at most `Shafts::longest` long, so a ball of radius
//! r‖F⁻¹‖ + longest about a cone holds the first vertices of all segments within the spatial distance r. Segments that
//! end at a live tip need no entry of their own: their end is looked up.
//!
//! The tree is not asked every step. Cones that sit in one square of a coarse grid share a list of candidates, which is asked
//! of the tree when the first cone enters the square, kept up to date as vertices are laid, and dropped when the last cone
//! has gone. Lists hold more than is near and are sorted; what is not within reach adds exactly nothing, so results are those of
//! looking at every segment of every shaft, to the last bit.

use crate::prelude::*;
use rayon::prelude::*;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};
use std::collections::HashMap;

type Entry = GeomWithData<[f64; 2], VertexId>;
type Square = [i32; 2];

/// Side of a square over the reach.
const SIDE: f64 = 1.5;
/// Room for ‖F⁻¹‖ to grow before lists are made anew.
const ROOM: f64 = 1.05;
/// Cones that share one gathering of segments: enough to share the work, few enough to spread it over threads.
const SHARED: usize = 16;

/// A cone that asks for its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asking {
    /// Place of the cone, which is the number of its own shaft.
    pub index: u32,
    /// Index of its population.
    pub population: u16,
    /// Material site.
    pub site: Site,
    /// Position (µm).
    pub position: Vector3<f64>,
    /// Unit heading.
    pub heading: Vector3<f64>,
}

/// A straight piece of a shaft as it lies now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Its start (µm), nearer to the shaft's origin.
    pub start: Vector3<f64>,
    /// Unit tangent, toward the tip.
    pub tangent: Vector3<f64>,
    /// Length (µm), positive.
    pub length: f64,
    /// The shaft it belongs to.
    pub shaft: u32,
}

/// The neighbour index over all shaft segments.
#[derive(Debug, Resource, Default)]
pub struct ShaftIndex {
    tree: RTree<Entry>,
    reach: f64,
    radius: f64,
    lists: HashMap<Square, Vec<VertexId>>,
}

impl ShaftIndex {
    /// Puts the index into a model for mechanisms that look `reach` far (µm); the farthest counts.
    pub fn install(model: &mut ModelBuilder, reach: f64) {
        match model.world.get_resource_mut::<ShaftIndex>() {
            Some(mut index) => index.reach = index.reach.max(reach),
            None => {
                model.insert(ShaftIndex { reach, ..ShaftIndex::default() });
                model.phase(Phase::Neighbours, index_new_vertices);
            }
        }
    }

    /// Calls `act` for each cone with all segments that may lie within `reach` of it, those of its own shaft included, and
    /// returns what it makes of them, in the order of the cones. The order of segments is that of their vertices.
    pub fn for_each<T: Send>(
        &mut self,
        scene: &ShaftScene,
        cones: &[Asking],
        act: impl Fn(&Asking, &[Segment]) -> T + Sync,
    ) -> Vec<T> {
        let side = SIDE * self.reach;
        let mut order: Vec<(Square, u32)> =
            cones.iter().zip(0..).map(|(cone, i)| (square(scene.reference(cone.site), side), i)).collect();
        order.sort_unstable();
        self.prepare(scene, &order);
        let groups: Vec<&[(Square, u32)]> =
            order.chunk_by(|a, b| a.0 == b.0).flat_map(|group| group.chunks(SHARED)).collect();
        let mut found: Vec<(u32, T)> = groups
            .par_iter()
            .map_init(Vec::new, |segments, group| {
                scene.gather(&self.lists[&group[0].0], group, cones, self.reach, segments);
                let each = |&(_, i): &(Square, u32)| (i, act(&cones[i as usize], segments));
                group.iter().map(each).collect::<Vec<_>>()
            })
            .flatten_iter()
            .collect();
        found.sort_unstable_by_key(|(i, _)| *i);
        found.into_iter().map(|(_, value)| value).collect()
    }

    /// Makes sure that there is a valid list for each square in use, and for no other.
    fn prepare(&mut self, scene: &ShaftScene, order: &[(Square, u32)]) {
        let needed = self.reach * scene.configuration.inverse_stretch;
        if needed > self.radius {
            self.radius = needed * if scene.configuration.moves { ROOM } else { 1.0 };
            self.lists.clear();
        }
        self.lists.retain(|square, _| order.binary_search_by_key(square, |(other, _)| *other).is_ok());
        let mut missing: Vec<Square> = order.iter().map(|(square, _)| *square).collect();
        missing.dedup();
        missing.retain(|square| !self.lists.contains_key(square));
        let margin = self.radius + scene.shafts.longest;
        let side = SIDE * self.reach;
        let made: Vec<_> = missing.into_par_iter().map(|at| (at, ask(&self.tree, at, side, margin))).collect();
        self.lists.extend(made);
    }

    fn add(&mut self, vertex: VertexId, at: [f64; 2], longest: f64) {
        self.tree.insert(Entry::new(at, vertex));
        let side = SIDE * self.reach;
        let margin = self.radius + longest;
        let low = square(Vector3::new(at[0] - margin, at[1] - margin, 0.0), side);
        let high = square(Vector3::new(at[0] + margin, at[1] + margin, 0.0), side);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                if let Some(list) = self.lists.get_mut(&[x, y]) {
                    list.insert(list.partition_point(|other| *other < vertex), vertex);
                }
            }
        }
    }
}

fn square(x: Vector3<f64>, side: f64) -> Square {
    [(x.x / side).floor() as i32, (x.y / side).floor() as i32]
}

/// All vertices within a margin of a square, ascending.
fn ask(tree: &RTree<Entry>, [x, y]: Square, side: f64, margin: f64) -> Vec<VertexId> {
    let low = [f64::from(x) * side - margin, f64::from(y) * side - margin];
    let high = [f64::from(x + 1) * side + margin, f64::from(y + 1) * side + margin];
    let near = tree.locate_in_envelope_intersecting(AABB::from_corners(low, high));
    let mut list: Vec<VertexId> = near.map(|entry| entry.data).collect();
    list.sort_unstable();
    list
}

/// Tissue, configuration and shafts together: what turns material segments into places.
#[derive(SystemParam)]
pub struct ShaftScene<'w> {
    /// The tissue.
    pub tissue: Res<'w, Tissue>,
    /// Its configuration.
    pub configuration: Res<'w, Configuration>,
    /// The shafts.
    pub shafts: Res<'w, Shafts>,
}

impl ShaftScene<'_> {
    fn reference(&self, site: Site) -> Vector3<f64> {
        self.tissue.reference_position(site)
    }

    /// Position of a stored vertex now (µm).
    fn vertex(&self, vertex: VertexId) -> Vector3<f64> {
        self.configuration.position(&self.tissue.mesh, self.shafts.point(vertex).into())
    }

    /// Position now of what follows a stored vertex (µm).
    fn end(&self, successor: Successor) -> Vector3<f64> {
        match successor {
            Successor::Vertex(next) => self.vertex(next),
            Successor::Tip(shaft) => self.configuration.position(&self.tissue.mesh, self.shafts.tip(shaft).into()),
        }
    }

    /// The segments of a sorted list that come near any cone of a group.
    fn gather(
        &self,
        list: &[VertexId],
        group: &[(Square, u32)],
        cones: &[Asking],
        reach: f64,
        segments: &mut Vec<Segment>,
    ) {
        let positions = || group.iter().map(|(_, i)| cones[*i as usize].position);
        let low = positions().fold(Vector3::repeat(f64::INFINITY), |m, x| m.inf(&x)).add_scalar(-reach);
        let high = positions().fold(Vector3::repeat(f64::NEG_INFINITY), |m, x| m.sup(&x)).add_scalar(reach);
        segments.clear();
        let mut last = None;
        for &vertex in list {
            let start = match last {
                Some((Successor::Vertex(next), end)) if next == vertex => end,
                _ => self.vertex(vertex),
            };
            let successor = self.shafts.successor(vertex);
            let end = self.end(successor);
            last = Some((successor, end));
            let apart = |k: usize| start[k].max(end[k]) < low[k] || start[k].min(end[k]) > high[k];
            if apart(0) || apart(1) || apart(2) {
                continue;
            }
            let chord = end - start;
            let length = chord.norm();
            if length > 0.0 {
                segments.push(Segment { start, tangent: chord / length, length, shaft: self.shafts.owner(vertex) });
            }
        }
    }
}

fn index_new_vertices(
    tissue: Res<Tissue>,
    mut shafts: ResMut<Shafts>,
    mut index: ResMut<ShaftIndex>,
    mut counters: ResMut<Counters>,
) {
    for vertex in shafts.take_laid() {
        let at = tissue.reference_position(shafts.point(vertex).into());
        index.add(vertex, [at.x, at.y], shafts.longest);
        counters.indexed_segments += 1;
    }
}
