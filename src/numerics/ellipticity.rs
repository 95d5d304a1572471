//! How far a deformed body is from losing ellipticity.

use crate::numerics::hyperelasticity::Body;
use crate::numerics::material::{Tensor, acoustic_minimum, principal_stretches};
use rayon::prelude::*;

/// Cells looked at: those of the smallest stretches, since it is compression that takes ellipticity.
const MOST_CELLS: usize = 32;

/// Smallest eigenvalue of the acoustic tensor over directions and over the most compressed cells, over its value at rest
/// (dimensionless): 1 at rest, 0 where ellipticity is lost, negative beyond. Of a body that grows the elastic part of the deformation
/// counts, `F_e = F/g`.
///
/// `displacement`: µm, flat, stride `D`, at a load. See [`acoustic_minimum`].
pub fn ellipticity_left<const D: usize>(body: &Body<'_, D>, load: f64, displacement: &[f64]) -> f64 {
    let at_rest = acoustic_minimum(body.material(), &Tensor::<D>::identity());
    let elastic = |cell: usize| body.law(load, cell).elastic(&body.deformation_gradient(displacement, cell));
    let compressed = |cell: usize| {
        let stretches = principal_stretches(&elastic(cell));
        stretches.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let mut cells: Vec<(f64, usize)> = (0..body.mesh().cell_count()).map(|cell| (compressed(cell), cell)).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    cells.truncate(MOST_CELLS);
    let left = |&(_, cell): &(f64, usize)| acoustic_minimum(body.material(), &elastic(cell));
    let smallest = cells.par_iter().map(left).collect::<Vec<_>>().into_iter().fold(f64::INFINITY, f64::min);
    if cells.is_empty() { 1.0 } else { smallest / at_rest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::hyperelasticity::Prescribed;
    use crate::numerics::material::{Lame, StVenantKirchhoff};
    use crate::numerics::planar_domain::PlanarDomain;
    use crate::numerics::triangulate::{MeshOptions, triangulate};
    use std::sync::Arc;

    #[test]
    fn it_is_one_at_rest_and_gone_where_the_confined_block_loses_it() {
        let fitted = triangulate(&PlanarDomain::rectangle(1.5, 1.0), &[], &MeshOptions::of_size(0.25)).unwrap();
        let lame = Lame::from_young_poisson(1.0, 0.3).unwrap();
        let mut held = Prescribed::none(fitted.mesh.vertex_count());
        (0..2).for_each(|vertex| (0..2).for_each(|k| held.impose(vertex, k, 0.0)));
        let body = Body::new(&fitted.mesh, Arc::new(StVenantKirchhoff { lame }), held).unwrap();
        let squeezed = |stretch: f64| -> Vec<f64> {
            fitted.mesh.vertices().iter().flat_map(|x| [0.0, (stretch - 1.0) * x[1]]).collect()
        };
        assert!((ellipticity_left(&body, 1.0, &squeezed(1.0)) - 1.0).abs() < 1e-12);
        // The confined block at ν = 0.3 loses it at a stretch of 0.7056.
        assert!(ellipticity_left(&body, 1.0, &squeezed(0.715)) > 0.0);
        assert!(ellipticity_left(&body, 1.0, &squeezed(0.695)) < 0.0);
        assert!(ellipticity_left(&body, 1.0, &squeezed(1.3)) > 0.9);
    }
}
