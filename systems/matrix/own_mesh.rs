//! A mesh for the matrix alone, coarser (or finer) than that of cues and axons.
//!
//! Displacements of a tissue under imposed motion are smooth where cues are steep, and a solve of eq. (3) costs many of eq. (2). So the
//! matrix may be solved on a mesh of its own, and its displacements and their rates taken over, linear in each of its cells, at the
//! vertices of the tissue's mesh. Both meshes have the same border, since outlines are polygons. Ours.

use crate::numerics::load_path::LoadPath;
use crate::numerics::locate::MaterialPoint;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::planar_domain::PlanarDomain;
use crate::numerics::triangulate::MeshOptions;
use crate::prelude::*;

/// The tissue with another mesh, evenly of `size` (µm), fitted to some outlines.
///
/// # Errors
/// A mesh that cannot be made, at `/mesh_size`.
pub fn remeshed(tissue: &Tissue, size: f64, outlines: &[(String, Shape)]) -> Result<Tissue, InstallError> {
    let options = MeshOptions { size, ..tissue.options };
    let domain = PlanarDomain { vertices: Vec::new(), ..tissue.domain.clone() };
    let shapes = outlines.iter().map(|(name, shape)| (name.as_str(), shape));
    Tissue::meshed(domain, shapes, (options, &Grading::even(size)), &tissue.inputs)
        .map_err(|error| InstallError::Scenario(Violation::new("/mesh_size", error.to_string())))
}

/// What was solved on the mesh of `from`, on that of `tissue`.
///
/// # Errors
/// A vertex of the tissue's mesh that lies outside by more than rounding; a cell of it that the displacement at a level of the path turns over.
pub fn taken_over(path: &LoadPath, from: &Tissue, tissue: &Tissue) -> Result<LoadPath, InstallError> {
    let place = |&[x, y]: &[f64; 2]| {
        let site = from.locate([x, y]).map(|site| site.planar());
        site.ok_or_else(|| InstallError::Solve(format!("the mesh of the matrix does not reach ({x:.4}, {y:.4}) um")))
    };
    let places = tissue.mesh.vertices().iter().map(place).collect::<Result<Vec<MaterialPoint<2>>, _>>()?;
    let taken = path.mapped(|values| {
        let vectors: Vec<[f64; 2]> = values.chunks_exact(2).map(|u| [u[0], u[1]]).collect();
        places.iter().flat_map(|place| place.interpolate_vector(&from.mesh, &vectors)).collect()
    });
    for level in taken.path().levels() {
        let displaced = tissue.mesh.vertices().iter().zip(level.value.chunks_exact(2));
        let moved = Configuration::of_vertices(displaced.map(|(x, u)| [x[0] + u[0], x[1] + u[1]]).collect());
        if let Some(defect) = moved.defect(&tissue.mesh) {
            return Err(InstallError::Solve(format!(
                "the matrix (eq. 3, /matrix) was solved on a mesh of its own, whose displacements do not fit the tissue's: at load {:.3} {defect}; a \
                 finer /matrix/mesh_size is needed",
                level.parameter
            )));
        }
    }
    Ok(taken)
}
