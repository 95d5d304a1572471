//! Re-entrant corners: gradients of cues converge slowly on even meshes, and as elsewhere on meshes graded toward the corner.

use std::f64::consts::FRAC_PI_2;

use tropism::numerics::locate::SeedGrid;
use tropism::numerics::mesh_grading::{Grading, LEAST_CORNER};
use tropism::numerics::planar_domain::{Outline, PlanarDomain, Ring};
use tropism::numerics::reaction_diffusion::{Mass, ReactionDiffusion, Source, StationarySolver};
use tropism::numerics::recovery::GradientRecovery;
use tropism::numerics::simplex_mesh::SimplexMesh;
use tropism::numerics::triangulate::{MeshOptions, triangulate, triangulate_graded};

use crate::block::fitted_order;
use crate::figures::{self, Curve};

/// The square (−1, 1)² without its fourth quadrant: 270° inside at the origin.
fn ell() -> PlanarDomain {
    let points = vec![[0.0, 0.0], [0.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    PlanarDomain::new(Ring { edges: vec![0; points.len()], points }, Vec::new(), vec!["wall".into()])
}

/// Released at the end of one arm, over all its width, so that the field has no other corner.
fn release() -> Outline {
    Outline::rectangle([-1.0, -1.0], [0.0, -0.5])
}

fn meshed(size: f64, radius: Option<f64>) -> (SimplexMesh<2>, Vec<u32>) {
    let mut grading = Grading::even(size);
    if let Some(radius) = radius {
        ell().reentrant_corners(LEAST_CORNER).iter().for_each(|corner| grading.toward_corner(corner, radius));
    }
    let mut fitted = triangulate_graded(&ell(), &[release()], &MeshOptions::of_size(size), &grading).unwrap();
    (fitted.mesh, fitted.regions.remove(0))
}

/// Recovered gradients at places 0.2 to 0.28 from the corner, on all its sides.
fn gradients((mesh, region): &(SimplexMesh<2>, Vec<u32>)) -> Vec<[f64; 2]> {
    let (x, regions) = (mesh.vertices(), std::slice::from_ref(region));
    let law = ReactionDiffusion { diffusion: 1.0, degradation: 1.0, mass: Mass::Consistent };
    let mut solver = StationarySolver::new(mesh, regions).unwrap();
    let nodal = solver.solve(&law, x, &[Source::new(region, 100.0)]).unwrap();
    let recovered = GradientRecovery::new(mesh).recover(x, &nodal, true);
    let grid = SeedGrid::new(mesh, x);
    let places = (0..400).map(|i| {
        let (turn, away) = (f64::from(i % 25), f64::from(i / 25));
        let (turn, away) = (FRAC_PI_2 * (0.04 + 2.92 * turn / 24.0), 0.2 + 0.08 * away / 15.0);
        [away * turn.cos(), away * turn.sin()]
    });
    places.map(|place| grid.locate(mesh, x, place).unwrap().interpolate_vector(mesh, &recovered)).collect()
}

fn rms(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let off = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    (a.iter().zip(b).map(off).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn grading_toward_a_re_entrant_corner_gives_back_the_second_order_of_the_recovered_gradient() {
    // The reference is graded farther out, so that its edges grow elsewhere than those of what is measured.
    let reference = gradients(&meshed(0.008, Some(1.0)));
    let scale = rms(&reference, &vec![[0.0; 2]; reference.len()]);
    let sizes = [0.16, 0.08, 0.04, 0.02];
    let errors =
        [None, Some(0.25)].map(|radius| sizes.map(|size| rms(&gradients(&meshed(size, radius)), &reference) / scale));
    let [even, graded] = errors.map(|errors| fitted_order(&sizes, &errors));
    // 2 λ = 2 π / (3 π / 2)
    assert!((even - 4.0 / 3.0).abs() < 0.2, "{errors:?}: {even}");
    assert!(graded > 1.8, "{errors:?}: {graded}");
    assert!(errors[1][3] < 0.2 * errors[0][3], "{errors:?}");
    let curves = [("even", errors[0], [4.0 / 3.0, even]), ("graded", errors[1], [2.0, graded])]
        .map(|(name, errors, orders)| Curve::new(name, &sizes, &errors, orders));
    let axes = ["mesh size (arm of the L = 1)", "rms error of ∇c (rms of ∇c = 1)"];
    let words = [
        "Cue fields: a re-entrant corner of 270°",
        "recovered gradient, 0.2 to 0.28 from the corner; the numbers are fitted orders",
    ];
    figures::write("re_entrant_corner", words, &[figures::orders("L-shaped tissue", axes, &curves)]);
}

#[test]
fn a_tissue_without_re_entrant_corners_has_the_even_mesh_to_the_last_bit() {
    let domain = PlanarDomain::rectangle(1.5, 1.0);
    let options = MeshOptions::of_size(0.1);
    let mut grading = Grading::even(0.1);
    domain.reentrant_corners(LEAST_CORNER).iter().for_each(|corner| grading.toward_corner(corner, 0.5));
    let [even, graded] = [triangulate(&domain, &[], &options), triangulate_graded(&domain, &[], &options, &grading)]
        .map(|fitted| fitted.unwrap().mesh);
    assert!(even.vertices() == graded.vertices() && even.cells() == graded.cells());
}
