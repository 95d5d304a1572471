//! A mesh for the matrix alone, coarser (or finer) than that of cues and axons.
//!
//! Displacements of a tissue under imposed motion are smooth where cues are steep, and a solve of eq. (3) costs many of eq. (2). So the
//! matrix may be solved on a mesh of its own, and its displacements and their rates taken over, linear in each of its cells, at the
//! vertices of the tissue's mesh. Both meshes have the same border, since outlines are polygons. Ours.

use crate::numerics::load_path::LoadPath;
use crate::numerics::locate::MaterialPoint;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::planar_domain::{Outline, PlanarDomain};
use crate::numerics::polygon::nearest_on_side;
use crate::numerics::simplex_mesh::BorderFacet;
use crate::numerics::triangulate::{MeshOptions, triangulate_graded};
use crate::prelude::*;

/// The tissue with another mesh, evenly of `size` (µm), fitted to some outlines.
pub fn remeshed(tissue: &Tissue, size: f64, outlines: &[(String, Shape)]) -> Result<Tissue, InstallError> {
    let refuse = |error: String| InstallError::Scenario(Violation::new("/mesh_size", error));
    let grading = Grading::even(size);
    let lines: Vec<Outline> = outlines.iter().map(|(_, shape)| shape.outline(&grading)).collect();
    let domain = PlanarDomain { vertices: Vec::new(), ..tissue.domain.clone() };
    let fitted = triangulate_graded(&domain, &lines, &MeshOptions::of_size(size), &grading)
        .map_err(|error| refuse(error.to_string()))?;
    let names = outlines.iter().map(|(name, _)| name.clone());
    Ok(Tissue::new(domain, fitted.mesh, names.zip(fitted.regions).collect(), &tissue.inputs))
}

/// What was solved on the mesh of `from`, on that of `tissue`.
///
/// # Errors
/// A cell of the tissue's mesh that the displacement at a level of the path turns over.
pub fn taken_over(path: &LoadPath, from: &Tissue, tissue: &Tissue) -> Result<LoadPath, InstallError> {
    let places: Vec<MaterialPoint<2>> = tissue.mesh.vertices().iter().map(|&at| nearest(from, at)).collect();
    let taken = path.mapped(|values| {
        let vectors: Vec<[f64; 2]> = values.chunks_exact(2).map(|u| [u[0], u[1]]).collect();
        places.iter().flat_map(|place| place.interpolate_vector(&from.mesh, &vectors)).collect()
    });
    for level in taken.path().levels() {
        let mut moved = Configuration::at_rest(&tissue.mesh);
        for (x, u) in moved.coordinates.iter_mut().zip(level.value.chunks_exact(2)) {
            *x = [x[0] + u[0], x[1] + u[1]];
        }
        if let Some(defect) = moved.defect(&tissue.mesh) {
            return Err(InstallError::Solve(format!(
                "the matrix (eq. 3) was solved on a mesh of its own, whose displacements do not fit the tissue's: at load {:.3} {defect}; a \
                 finer /matrix/mesh_size is needed",
                level.parameter
            )));
        }
    }
    Ok(taken)
}

/// Where a point (µm) lies in the mesh of a tissue; one outside by rounding lies on the border.
fn nearest(tissue: &Tissue, point: [f64; 2]) -> MaterialPoint<2> {
    if let Some(site) = tissue.locate(point) {
        return site.planar();
    }
    let mesh = &tissue.mesh;
    let place = |v: u32| mesh.vertices()[v as usize];
    let on_facet = |facet: &BorderFacet| {
        let ends: Vec<_> = mesh.facet_vertices(*facet).map(place).collect();
        nearest_on_side([ends[0], ends[1]], point)
    };
    let found = mesh.border().iter().min_by(|a, b| on_facet(a).distance.total_cmp(&on_facet(b).distance));
    let Some(facet) = found else { return MaterialPoint::centroid(0) };
    let at = on_facet(facet).point;
    let corners = mesh.cell(facet.cell as usize);
    let [a, b, c] = [0, 1, 2].map(|i| place(corners[i]));
    let area = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let whole = area(a, b, c);
    MaterialPoint { cell: facet.cell, weights: [area(a, at, c) / whole, area(a, b, at) / whole] }
}
