//! Tissue that grows by itself, F = F_e F_g: free growth, confined growth, a strip that bends, and the path over the load.

use std::sync::Arc;

use crate::block::{HEIGHT, WIDTH, block, neo_hookean, ogden, reaction_of_the_top, svk};
use tropism::numerics::ellipticity::ellipticity_left;
use tropism::numerics::grown::Growth;
use tropism::numerics::hyperelasticity::{Body, BodyError, Prescribed};
use tropism::numerics::load_path::{LoadPath, LoadPathOptions};
use tropism::numerics::material::{Lame, Material, StVenantKirchhoff};
use tropism::numerics::newton::{Equilibrium, NewtonOptions, equilibrium};
use tropism::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};

/// A body whose cells grow as `factor` says of their centres, held where `held` says.
fn growing<'m>(
    mesh: &'m SimplexMesh<2>,
    material: Arc<dyn Material<2>>,
    held: impl Fn([f64; 2], usize) -> bool,
    factor: impl Fn([f64; 2]) -> f64,
) -> Body<'m, 2> {
    let mut prescribed = Prescribed::none(mesh.vertex_count());
    for (vertex, x) in mesh.vertices().iter().enumerate() {
        (0..2).filter(|&k| held(*x, k)).for_each(|k| prescribed.impose(vertex, k, 0.0));
    }
    let centre = |cell: usize| {
        let corners = mesh.cell(cell);
        [0, 1].map(|k| corners.iter().map(|&v| mesh.vertices()[v as usize][k]).sum::<f64>() / 3.0)
    };
    let factors = (0..mesh.cell_count()).map(|cell| factor(centre(cell))).collect();
    Body::new(mesh, material, prescribed).unwrap().growing(Growth::by(factors)).unwrap()
}

fn solve(body: &Body<'_, 2>, load: f64, guess: &[f64]) -> Equilibrium {
    equilibrium(body, load, guess, &NewtonOptions::default()).unwrap()
}

#[test]
fn a_block_that_grows_freely_is_larger_and_free_of_stress() {
    let mesh = block(6, 4);
    for material in [svk(0.3), neo_hookean(0.3), ogden(0.3)] {
        let sliding = |x: [f64; 2], k: usize| x[k] == 0.0 && (k == 1 || x[1] == 0.0);
        let body = growing(&mesh, material, sliding, |_| 1.3);
        let path = LoadPath::solve(&body, &LoadPathOptions::default()).unwrap();
        let mut u = vec![0.0; body.unknowns()];
        for load in [0.5, 0.83, 1.0] {
            path.displacement(load, &mut u);
            for (x, u) in mesh.vertices().iter().zip(u.chunks_exact(2)) {
                (0..2).for_each(|k| assert!((u[k] - 0.3 * load * x[k]).abs() < 1e-12));
            }
            assert!(body.internal_forces(load, &u).iter().all(|force| force.abs() < 1e-13));
            assert!(body.energy(load, &u) < 1e-15);
        }
        assert!((ellipticity_left(&body, 1.0, &u) - 1.0).abs() < 1e-9, "what is grown is not stretched");
    }
}

#[test]
fn a_block_that_grows_between_fixed_edges_presses_as_the_closed_form_says() {
    let mesh = block(6, 4);
    let Lame { lambda, mu } = Lame::from_young_poisson(1.0, 0.3).unwrap();
    let on_border = |x: [f64; 2], _: usize| x[0] == 0.0 || x[0] == WIDTH || x[1] == 0.0 || x[1] == HEIGHT;
    // F = I, so F_e = I/g and P = g P_e(I/g).
    let g: f64 = 1.15;
    let svk_stress = (lambda + mu) * (1.0 / (g * g) - 1.0);
    let neo_stress = mu * (1.0 - g * g) + 0.5 * lambda * (1.0 / (g * g) - g * g);
    for (material, stress) in [(svk(0.3), svk_stress), (neo_hookean(0.3), neo_stress)] {
        let body = growing(&mesh, material, on_border, |_| g);
        let found = solve(&body, 1.0, &vec![0.0; body.unknowns()]);
        assert!(found.displacement.iter().all(|u| u.abs() < 1e-13));
        let pressure = reaction_of_the_top(&body, &body.internal_forces(1.0, &found.displacement)) / WIDTH;
        assert!(stress < -0.2 && (pressure - stress).abs() < 1e-13, "{pressure} {stress}");
    }
}

#[test]
fn the_rate_along_the_load_is_the_derivative_of_the_equilibrium_where_a_half_grows() {
    let mesh = block(6, 4);
    for material in [svk(0.3), neo_hookean(0.3), ogden(0.3)] {
        let body = growing(&mesh, material, |x, _| x[1] == 0.0, |x| if x[0] < 0.75 { 1.4 } else { 0.9 });
        let path = LoadPath::solve(&body, &LoadPathOptions::default()).unwrap();
        let mut u = vec![0.0; body.unknowns()];
        path.displacement(0.37, &mut u);
        let [before, here, after] = [0.3695, 0.37, 0.3705].map(|load| solve(&body, load, &u));
        let size = here.rate.iter().fold(0.0f64, |size, rate| size.max(rate.abs()));
        for (i, rate) in here.rate.iter().enumerate() {
            let quotient = (after.displacement[i] - before.displacement[i]) / 1e-3;
            assert!((quotient - rate).abs() < 1e-6 * size, "{i}: {quotient} {rate}");
            assert!((u[i] - here.displacement[i]).abs() < 1e-6 * body.size());
        }
        assert!(path.report().met && path.report().levels <= 17, "{:?}", path.report());
        assert_eq!(path.report().unstable_from, None);
    }
}

#[test]
fn a_strip_of_which_one_half_grows_bends_as_timoshenko_says() {
    // Two layers of equal thickness and stiffness: the curvature is 3ε/(2h) for a mismatch ε over the whole thickness h.
    let (length, mismatch) = (10.0, 0.004);
    let mesh = structured_rectangle(length, 1.0, 160, 16).unwrap();
    let material = Arc::new(StVenantKirchhoff { lame: Lame::from_young_poisson(1.0, 0.0).unwrap() });
    let held = |x: [f64; 2], k: usize| x[0] == 0.0 && (k == 0 || x[1] == 0.5);
    let body = growing(&mesh, material, held, |x| if x[1] > 0.5 { 1.0 } else { 1.0 + mismatch });
    let found = solve(&body, 1.0, &vec![0.0; body.unknowns()]);
    let deflection = |at: f64| {
        let vertex = mesh.vertices().iter().position(|x| (x[0] - at).abs() < 1e-9 && x[1] == 0.5).unwrap();
        found.displacement[2 * vertex + 1]
    };
    let curvature = (deflection(7.5) - 2.0 * deflection(5.0) + deflection(2.5)) / 2.5f64.powi(2);
    assert!((curvature / (1.5 * mismatch) - 1.0).abs() < 0.03, "{curvature} {}", 1.5 * mismatch);
}

#[test]
fn factors_that_are_not_one_a_cell_or_not_positive_are_refused() {
    let mesh = block(2, 1);
    let with = |factors: Vec<f64>| {
        let mut prescribed = Prescribed::none(mesh.vertex_count());
        (0..2).for_each(|vertex| prescribed.impose_all(vertex, [0.0; 2]));
        Body::new(&mesh, svk(0.3), prescribed).unwrap().growing(Growth::by(factors)).map(|_| ())
    };
    assert_eq!(with(vec![1.1; 4]), Ok(()));
    assert_eq!(with(vec![1.1; 3]), Err(BodyError::Growth { given: 3, cells: 4, smallest: 1.1 }));
    assert!(matches!(with(vec![1.1, 0.0, 1.0, 1.0]), Err(BodyError::Growth { smallest: 0.0, .. })));
    assert!(with(vec![1.1, f64::NAN, 1.0, 1.0]).is_err());
}
