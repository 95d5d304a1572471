//! Provider: an R-tree over the shafts, for whoever asks for what lies near a cone.
//!
//! The tree lives in the *reference* configuration, where stored vertices never move, so that it only ever grows. Each
//! shaft segment stands in it as its first vertex; a segment is at most `Shafts::longest` long, so a ball of radius
//! r‖F⁻¹‖ + longest about the cone holds the first vertices of all segments within the spatial distance r. Segments that
//! end at a live tip need no entry of their own: their end is looked up.

use crate::prelude::*;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};

/// Name under which mechanisms ask for the index.
pub const NAME: &str = "shaft_index";

type Entry = GeomWithData<[f64; 2], VertexId>;

/// The neighbour index over all shaft segments.
#[derive(Debug, Resource, Default)]
pub struct ShaftIndex {
    tree: RTree<Entry>,
}

impl ShaftIndex {
    /// Puts the index into a model, once, whoever asks first.
    pub fn install(model: &mut ModelBuilder) {
        if !model.world.contains_resource::<ShaftIndex>() {
            model.insert(ShaftIndex::default()).phase(Phase::Neighbours, index_new_vertices);
        }
    }

    /// First vertices of all segments that may come within `reach` (µm, spatial) of a site, in ascending order, written
    /// into `found`. The order does not depend on how the tree grew.
    pub fn candidates(&self, scene: &ShaftScene, site: Site, reach: f64, found: &mut Vec<VertexId>) {
        let centre = scene.tissue.reference_position(site);
        let radius = reach * scene.configuration.inverse_stretch + scene.shafts.longest;
        let corner = |sign: f64| [centre.x + sign * radius, centre.y + sign * radius];
        let near = |point: &[f64; 2]| (point[0] - centre.x).hypot(point[1] - centre.y) <= radius;
        found.clear();
        found.extend(
            self.tree
                .locate_in_envelope_intersecting(AABB::from_corners(corner(-1.0), corner(1.0)))
                .filter(|entry| near(entry.geom()))
                .map(|entry| entry.data),
        );
        found.sort_unstable();
    }
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
    /// Position of a stored vertex now (µm).
    pub fn vertex(&self, vertex: VertexId) -> Vector3<f64> {
        self.configuration.position(&self.tissue.mesh, self.shafts.point(vertex).into())
    }

    /// Position now of what follows a stored vertex (µm).
    pub fn end(&self, successor: Successor) -> Vector3<f64> {
        let point = match successor {
            Successor::Vertex(next) => self.shafts.point(next),
            Successor::Tip(shaft) => self.shafts.tip(shaft),
        };
        self.configuration.position(&self.tissue.mesh, point.into())
    }

    /// Calls `visit(shaft, start, end)` for each segment of a sorted list that belongs to another shaft than `own`.
    pub fn for_segments(&self, list: &[VertexId], own: u32, mut visit: impl FnMut(u32, Vector3<f64>, Vector3<f64>)) {
        let mut last = None;
        for &vertex in list {
            let shaft = self.shafts.owner(vertex);
            if shaft == own {
                continue;
            }
            let start = match last {
                Some((Successor::Vertex(next), end)) if next == vertex => end,
                _ => self.vertex(vertex),
            };
            let successor = self.shafts.successor(vertex);
            let end = self.end(successor);
            visit(shaft, start, end);
            last = Some((successor, end));
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
        index.tree.insert(Entry::new([at.x, at.y], vertex));
        counters.indexed_segments += 1;
    }
}
