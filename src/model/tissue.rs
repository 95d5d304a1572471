//! The tissue Ω_M: its mesh in the reference configuration, and the configuration it is in now.

use super::components::Site;
use super::shape::Shape;
use crate::numerics::locate::SeedGrid;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::planar_domain::PlanarDomain;
use crate::numerics::polygon::{nearest_on_side, sides};
use crate::numerics::simplex_mesh::{BorderFacet, SimplexMesh};
use crate::numerics::triangulate::{FittedMesh, MeshOptions, TriangulationError, triangulate_graded};
use bevy_ecs::prelude::Resource;
use nalgebra::{Matrix2, Vector2, Vector3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Cells that are looked at together for one that is turned over.
const AT_A_TIME: u32 = 4096;

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
        for list in &mut edges {
            order_along(&domain, &mesh, list);
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

/// The configuration φ(·, t): where the vertices are now, and how fast they move.
#[derive(Debug, Clone, Resource)]
pub struct Configuration {
    /// Time of this configuration (h).
    pub time: f64,
    /// Vertex coordinates x(t) (µm).
    pub coordinates: Vec<[f64; 2]>,
    /// Vertex velocities v_φ (µm/h); all zero at rest.
    pub velocities: Vec<[f64; 2]>,
    /// Whether the tissue moves at all in this run.
    pub moves: bool,
    /// Load s that this configuration belongs to (0 at rest), the parameter of the path of equilibria.
    pub load: f64,
    /// Rate ṡ of the load (1/h).
    pub load_rate: f64,
    /// Counts the changes of configuration; 0 for the reference.
    pub revision: u64,
}

impl Configuration {
    /// The reference configuration, at rest.
    pub fn at_rest(mesh: &SimplexMesh<2>) -> Self {
        Self {
            time: 0.0,
            coordinates: mesh.vertices().to_vec(),
            velocities: vec![[0.0; 2]; mesh.vertex_count()],
            moves: false,
            load: 0.0,
            load_rate: 0.0,
            revision: 0,
        }
    }

    /// Spatial position of a site (µm).
    #[inline]
    pub fn position(&self, mesh: &SimplexMesh<2>, site: Site) -> Vector3<f64> {
        let [a, b, c] = at_corners(mesh, &self.coordinates, site.cell);
        let [second, third, _] = site.weights;
        let at = |k: usize| (1.0 - second - third) * a[k] + second * b[k] + third * c[k];
        Vector3::new(at(0), at(1), 0.0)
    }

    /// Velocity v_φ of the tissue at a site (µm/h).
    #[inline]
    pub fn velocity(&self, mesh: &SimplexMesh<2>, site: Site) -> Vector3<f64> {
        lift(site.planar().position(mesh, &self.velocities))
    }

    /// Deformation gradient F of a cell.
    pub fn deformation_gradient(&self, mesh: &SimplexMesh<2>, cell: u32) -> Matrix2<f64> {
        gradient_of(mesh, &self.coordinates, cell)
    }

    /// What is wrong with the configuration, if anything: a vertex that is nowhere, or a cell that is flat or turned over.
    pub fn defect(&self, mesh: &SimplexMesh<2>) -> Option<String> {
        let area = |cell: u32| {
            let [a, b, c] = at_corners(mesh, &self.coordinates, cell);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let is_upright = |cell: u32| area(cell) > 0.0;
        // Most often all are: so many at a time without asking between them.
        let count = mesh.cell_count() as u32;
        let cells = |first: u32| first..count.min(first + AT_A_TIME);
        let pieces = (0..count.div_ceil(AT_A_TIME)).into_par_iter().map(|piece| piece * AT_A_TIME);
        let piece = pieces.find_first(|first| !cells(*first).fold(true, |all, cell| all & is_upright(cell)))?;
        let cell = cells(piece).find(|cell| !is_upright(*cell))?;
        let nowhere = |x: &[f64; 2]| !(x[0].is_finite() && x[1].is_finite());
        if let Some(vertex) = self.coordinates.iter().position(nowhere) {
            let [x, y] = self.coordinates[vertex];
            return Some(format!("the tissue's mesh is no longer valid: vertex {vertex} is at ({x:.3}, {y:.3}) um"));
        }
        let middle =
            |k: usize| mesh.cell(cell as usize).iter().map(|v| self.coordinates[*v as usize][k]).sum::<f64>() / 3.0;
        let det = self.deformation_gradient(mesh, cell).determinant();
        let (x, y) = (middle(0), middle(1));
        Some(format!("the tissue is turned over: cell {cell} at ({x:.3}, {y:.3}) um, det F = {det:.4}"))
    }

    /// Spin (rad/h, about z) of the tissue in a cell: the rate at which the rotation of F = R U turns, which is the
    /// skew part of Ḟ F⁻¹ corrected for the turning of the principal axes.
    pub fn rotation_rate(&self, mesh: &SimplexMesh<2>, cell: u32) -> f64 {
        let f = self.deformation_gradient(mesh, cell);
        let rate = gradient_of(mesh, &self.velocities, cell);
        let (a, b) = (f[(0, 0)] + f[(1, 1)], f[(1, 0)] - f[(0, 1)]);
        let (da, db) = (rate[(0, 0)] + rate[(1, 1)], rate[(1, 0)] - rate[(0, 1)]);
        (a * db - b * da) / (a * a + b * b)
    }

    /// Material velocity: the reference vector F⁻¹ v that belongs to a spatial vector v in a cell.
    pub fn pull_back(&self, mesh: &SimplexMesh<2>, cell: u32, spatial: Vector3<f64>) -> Vector3<f64> {
        if !self.moves {
            return spatial;
        }
        let f = self.deformation_gradient(mesh, cell);
        match f.try_inverse() {
            Some(inverse) => {
                let v = inverse * Vector2::new(spatial.x, spatial.y);
                Vector3::new(v.x, v.y, 0.0)
            }
            None => Vector3::repeat(f64::NAN),
        }
    }

    /// The spatial gradient F⁻ᵀ g of what has the reference gradient g in a cell.
    pub fn push_forward_gradient(&self, mesh: &SimplexMesh<2>, cell: u32, material: Vector3<f64>) -> Vector3<f64> {
        if !self.moves {
            return material;
        }
        match self.deformation_gradient(mesh, cell).try_inverse() {
            Some(inverse) => {
                let g = inverse.transpose() * Vector2::new(material.x, material.y);
                Vector3::new(g.x, g.y, 0.0)
            }
            None => Vector3::repeat(f64::NAN),
        }
    }

    /// The spatial vector F v that belongs to a reference vector v in a cell.
    pub fn push_forward(&self, mesh: &SimplexMesh<2>, cell: u32, material: Vector3<f64>) -> Vector3<f64> {
        if !self.moves {
            return material;
        }
        let v = self.deformation_gradient(mesh, cell) * Vector2::new(material.x, material.y);
        Vector3::new(v.x, v.y, 0.0)
    }

    /// Upper bound of ‖F⁻¹‖₂ over the tissue: a spatial distance r is at most `r · inverse_stretch()` in the reference.
    pub fn inverse_stretch(&self, mesh: &SimplexMesh<2>) -> f64 {
        if !self.moves {
            return 1.0;
        }
        let square_in_cell = |cell: u32| {
            let f = self.deformation_gradient(mesh, cell);
            let (half, det) = (0.5 * f.norm_squared(), f.determinant());
            (half + (half * half - det * det).max(0.0).sqrt()) / (det * det)
        };
        let cells = (0..mesh.cell_count() as u32).into_par_iter().with_min_len(1024);
        cells.map(square_in_cell).reduce(|| 0.0, f64::max).sqrt() * (1.0 + 1e-12)
    }
}

/// What the three vertices of a cell have.
#[inline]
fn at_corners(mesh: &SimplexMesh<2>, values: &[[f64; 2]], cell: u32) -> [[f64; 2]; 3] {
    let corners = mesh.cell(cell as usize);
    [values[corners[0] as usize], values[corners[1] as usize], values[corners[2] as usize]]
}

fn gradient_of(mesh: &SimplexMesh<2>, field: &[[f64; 2]], cell: u32) -> Matrix2<f64> {
    let columns = |values: &[[f64; 2]]| {
        let [a, b, c] = at_corners(mesh, values, cell);
        Matrix2::new(b[0] - a[0], c[0] - a[0], b[1] - a[1], c[1] - a[1])
    };
    let reference = columns(mesh.vertices());
    let det = reference.determinant();
    let adjugate = Matrix2::new(reference[(1, 1)], -reference[(0, 1)], -reference[(1, 0)], reference[(0, 0)]);
    columns(field) * adjugate * (1.0 / det)
}

/// Sorts the facets of an edge by where they lie along the rings of the outline.
fn order_along(domain: &PlanarDomain, mesh: &SimplexMesh<2>, facets: &mut [BorderFacet]) {
    let sides: Vec<_> = domain.rings().flat_map(|ring| sides(&ring.points)).collect();
    let place = |facet: &BorderFacet| {
        let ends: Vec<_> = mesh.facet_vertices(*facet).map(|v| mesh.vertices()[v as usize]).collect();
        let middle = [0.5 * (ends[0][0] + ends[1][0]), 0.5 * (ends[0][1] + ends[1][1])];
        let nearest = |a: &usize, b: &usize| {
            let distance = |i: usize| nearest_on_side(sides[i], middle).distance;
            distance(*a).total_cmp(&distance(*b))
        };
        let side = (0..sides.len()).min_by(nearest).unwrap_or_default();
        let start = sides[side][0];
        (side, (middle[0] - start[0]).hypot(middle[1] - start[1]))
    };
    facets.sort_by(|a, b| {
        let (a, b) = (place(a), place(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
}

/// A planar point as a 3-vector with z exactly 0.
#[inline]
pub fn lift(point: [f64; 2]) -> Vector3<f64> {
    Vector3::new(point[0], point[1], 0.0)
}
