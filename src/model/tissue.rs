//! The tissue Ω_M: its mesh in the reference configuration, and the configuration it is in now.

use super::components::Site;
use super::shape::Shape;
use crate::numerics::locate::SeedGrid;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::nearest_side::NearestSide;
use crate::numerics::planar_domain::PlanarDomain;
use crate::numerics::simplex_mesh::{BorderFacet, SimplexMesh};
use crate::numerics::triangulate::{FittedMesh, MeshOptions, TriangulationError, triangulate_graded};
use bevy_ecs::prelude::Resource;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The tissue at rest: geometry, mesh, named edges and named regions. It never changes during a run.
#[derive(Debug, Clone, Resource)]
pub struct Tissue {
    /// The outline as the scenario gave it.
    pub domain: PlanarDomain,
    /// The mesh, in the reference configuration Ω⁰.
    pub mesh: Arc<SimplexMesh<2>>,
    /// Cells of each outline that the mesh was fitted to, by name (`cues/NAME/0`, `targets/NAME`, …).
    pub regions: BTreeMap<String, Vec<u32>>,
    /// Border facets of each named edge (in the order of `domain.edge_names`), each list in the order of the outline's points.
    pub edges: Vec<Vec<BorderFacet>>,
    /// How fine and how good the mesh was to be.
    pub options: MeshOptions,
    /// What it was made from, as text: equal inputs, equal tissue.
    pub inputs: Arc<str>,
    seeds: SeedGrid<2>,
}

impl Tissue {
    /// Meshes a domain, fitted to named shapes, all of it given by `inputs`.
    ///
    /// # Errors
    /// A domain or shape that cannot be meshed as the options ask; outlines are counted as the shapes come.
    pub fn meshed<'s>(
        domain: PlanarDomain,
        shapes: impl Iterator<Item = (&'s str, &'s Shape)>,
        (options, grading): (MeshOptions, &Grading),
        inputs: &str,
    ) -> Result<Self, TriangulationError> {
        let (names, outlines): (Vec<_>, Vec<_>) = shapes.map(|(name, shape)| (name, shape.outline(grading))).unzip();
        let FittedMesh { mesh, regions, .. } = triangulate_graded(&domain, &outlines, &options, grading)?;
        let regions = names.into_iter().map(str::to_owned).zip(regions).collect();
        let mut edges = vec![Vec::new(); domain.edge_names.len()];
        for facet in mesh.border() {
            if let Some(list) = edges.get_mut(facet.edge as usize) {
                list.push(*facet);
            }
        }
        let outline = NearestSide::of(&domain);
        for list in &mut edges {
            order_along(&outline, &mesh, list);
        }
        let seeds = SeedGrid::new(&mesh, mesh.vertices());
        Ok(Self { domain, mesh: Arc::new(mesh), regions, edges, options, inputs: inputs.into(), seeds })
    }

    /// Index of a named edge.
    pub fn edge(&self, name: &str) -> Option<usize> {
        self.domain.edge_names.iter().position(|edge| edge == name)
    }

    /// The site of a point of the reference configuration (µm), `None` outside.
    pub fn locate(&self, point: [f64; 2]) -> Option<Site> {
        self.seeds.locate(&self.mesh, self.mesh.vertices(), point).map(Site::from)
    }

    /// Reference position X of a site (µm).
    pub fn reference_position(&self, site: Site) -> Vector3<f64> {
        lift(site.planar().position(&self.mesh, self.mesh.vertices()))
    }
}

/// Sorts the facets of an edge by where they lie along the rings of the outline.
fn order_along(outline: &NearestSide, mesh: &SimplexMesh<2>, facets: &mut Vec<BorderFacet>) {
    let place = |facet: BorderFacet| {
        let ends: Vec<_> = mesh.facet_vertices(facet).map(|v| mesh.vertices()[v as usize]).collect();
        let middle = [0.5 * (ends[0][0] + ends[1][0]), 0.5 * (ends[0][1] + ends[1][1])];
        let side = outline.place(middle).unwrap_or_default();
        let start = outline.side(side)[0];
        ((side, (middle[0] - start[0]).hypot(middle[1] - start[1])), facet)
    };
    let mut placed: Vec<_> = facets.drain(..).map(place).collect();
    placed.sort_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    facets.extend(placed.into_iter().map(|(_, facet)| facet));
}

/// A planar point as a 3-vector with z exactly 0.
#[inline]
pub fn lift(point: [f64; 2]) -> Vector3<f64> {
    Vector3::new(point[0], point[1], 0.0)
}
