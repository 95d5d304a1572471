//! Materials and homogeneous states against `closed_forms.json`.

use nalgebra::{Matrix2, Vector2};
use serde_json::Value;
use tropism::numerics::hyperelasticity::{Body, Prescribed};
use tropism::numerics::load_path::{LoadPath, LoadPathOptions};
use tropism::numerics::material::{Lame, acoustic_minimum, check_derivatives};
use tropism::numerics::newton::{Equilibrium, NewtonOptions, equilibrium};
use tropism::numerics::runge_kutta::RK4;
use tropism::numerics::simplex_mesh::SimplexMesh;

use crate::block::{
    HEIGHT, WIDTH, array, block, moved_ends, neo_hookean, number, ogden, reaction_of_the_top, reference, svk,
};

fn matrix(value: &Value) -> Matrix2<f64> {
    Matrix2::from_fn(|i, k| number(&value[i][k]))
}

fn rotation(degrees: f64) -> Matrix2<f64> {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    Matrix2::new(cosine, -sine, sine, cosine)
}

fn close(found: f64, wanted: f64, tolerance: f64, what: &str) {
    assert!((found - wanted).abs() <= tolerance, "{what}: {found} for {wanted}");
}

/// Stretch across the pull with free sides, from the closed form.
fn lambda_x(poisson: f64, lambda_y: f64) -> f64 {
    (1.0 - poisson / (1.0 - poisson) * (lambda_y * lambda_y - 1.0)).sqrt()
}

/// Equilibria of the block with sliding ends at each stretch, each from the tangent predictor of the one before; the load is
/// the vertical strain `λ_y − 1`.
fn march(body: &Body<'_, 2>, stretches: &[f64]) -> Vec<Equilibrium> {
    let mut last = equilibrium(body, 0.0, &vec![0.0; body.unknowns()], &NewtonOptions::default()).unwrap();
    let mut load = 0.0;
    let step = |&stretch: &f64| {
        let way = stretch - 1.0 - load;
        load = stretch - 1.0;
        let guess: Vec<f64> = last.displacement.iter().zip(&last.rate).map(|(u, du)| u + way * du).collect();
        last = equilibrium(body, load, &guess, &NewtonOptions::default()).unwrap();
        last.clone()
    };
    stretches.iter().map(step).collect()
}

#[test]
fn a_block_with_sliding_ends_and_free_sides_has_the_uniaxial_closed_form() {
    let forms = reference("closed_forms.json");
    let mesh = block(6, 4);
    for poisson in [0.3, 0.45] {
        let body = moved_ends(&mesh, svk(poisson), 0.5 * HEIGHT, false);
        for extends in [true, false] {
            let of_branch =
                |row: &&Value| number(&row["nu"]) == poisson && (number(&row["lambda_y"]) >= 1.0) == extends;
            let mut rows: Vec<&Value> = array(&forms["uniaxial"]["table"]).iter().filter(of_branch).collect();
            rows.sort_by(|a, b| (number(&a["lambda_y"]) - 1.0).abs().total_cmp(&(number(&b["lambda_y"]) - 1.0).abs()));
            let stretches: Vec<f64> = rows.iter().map(|row| number(&row["lambda_y"])).collect();
            for (row, found) in rows.iter().zip(march(&body, &stretches)) {
                check_uniaxial(&body, poisson, row, &found);
            }
        }
    }
}

fn check_uniaxial(body: &Body<'_, 2>, poisson: f64, row: &Value, found: &Equilibrium) {
    let at = |key: &str| number(&row[key]);
    let what = |quantity: &str| format!("{quantity} at nu {poisson}, stretch {}", at("lambda_y"));
    let right = body.mesh().vertices().iter().position(|x| *x == [WIDTH, HEIGHT]).unwrap();
    let across = 1.0 + 2.0 * found.displacement[2 * right] / WIDTH;
    close(across, at("lambda_x"), 1e-11, &what("lambda_x"));
    close(2.0 * found.rate[2 * right] / WIDTH, at("dlambda_x_dlambda_y"), 1e-10, &what("its rate"));
    close(found.min_jacobian, at("detF"), 1e-11, &what("det F"));
    close(found.energy / (WIDTH * HEIGHT), at("energy_density"), 1e-12, &what("energy"));
    let forces = body.internal_forces(1.0, &found.displacement);
    close(reaction_of_the_top(body, &forces) / WIDTH, at("P_yy"), 1e-12, &what("P_yy"));
    let gradient = Matrix2::new(across, 0.0, 0.0, at("lambda_y"));
    // The table's minimum is over 720 directions: the closed form repeats it there, and ours is that over all directions.
    let scanned = |directions| scanned_acoustic_minimum(poisson, [across, at("lambda_y")], directions);
    close(scanned(720), at("acoustic_min"), 1e-11, &what("acoustic minimum of the table"));
    close(acoustic_minimum(body.material(), &gradient), scanned(36_000), 1e-8, &what("acoustic minimum"));
}

/// Smallest eigenvalue of `Q(N) = (N·S N) I + (λ + µ) FN ⊗ FN + µ F Fᵀ` over some directions, for a diagonal `F`.
fn scanned_acoustic_minimum(poisson: f64, [a, b]: [f64; 2], directions: usize) -> f64 {
    let Lame { lambda, mu } = Lame::from_young_poisson(1.0, poisson).unwrap();
    let strain = [0.5 * (a * a - 1.0), 0.5 * (b * b - 1.0)];
    let stress = strain.map(|own| lambda * (strain[0] + strain[1]) + 2.0 * mu * own);
    let smallest = |k: usize| {
        let (y, x) = (std::f64::consts::PI * k as f64 / directions as f64).sin_cos();
        let along = stress[0] * x * x + stress[1] * y * y;
        let xx = along + (lambda + mu) * (a * x).powi(2) + mu * a * a;
        let yy = along + (lambda + mu) * (b * y).powi(2) + mu * b * b;
        0.5 * (xx + yy) - (0.5 * (xx - yy)).hypot((lambda + mu) * a * x * b * y)
    };
    (0..directions).map(smallest).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_force_on_the_block_has_its_maximum_at_a_stretch_of_one_over_root_three() {
    let mesh = block(4, 2);
    let body = moved_ends(&mesh, svk(0.3), 0.5 * HEIGHT, false);
    let peak = 1.0 / 3f64.sqrt();
    let states = march(&body, &[0.9, 0.8, 0.7, 0.65, 0.6, peak + 1e-4, peak - 1e-4]);
    let stiffness = |state: &Equilibrium| {
        reaction_of_the_top(&body, &body.force_increment(1.0, &state.displacement, &state.rate)) / WIDTH
    };
    let [.., before, after] = &states[..] else { unreachable!() };
    // dP/dλ = E'/2 (3λ² − 1), E' = E/(1 − ν²).
    close(stiffness(before), 0.5 / 0.91 * (3.0 * (peak + 1e-4).powi(2) - 1.0), 1e-10, "stiffness before");
    close(stiffness(after), 0.5 / 0.91 * (3.0 * (peak - 1e-4).powi(2) - 1.0), 1e-10, "stiffness after");
    assert!(stiffness(before) > 0.0 && stiffness(after) < 0.0);
}

/// A block whose inner vertices are pushed about by up to 30 % of a cell.
fn distorted_block() -> SimplexMesh<2> {
    let regular = block(6, 4);
    let mut vertices = regular.vertices().to_vec();
    for (k, x) in vertices.iter_mut().enumerate() {
        if x[0] > 0.0 && x[0] < WIDTH && x[1] > 0.0 && x[1] < HEIGHT {
            x[0] += 0.25 * 0.3 * (12.9 * k as f64).sin();
            x[1] += 0.25 * 0.3 * (78.2 * k as f64).cos();
        }
    }
    SimplexMesh::new(vertices, regular.cells().to_vec()).unwrap()
}

#[test]
fn a_homogeneous_state_is_found_exactly_on_a_distorted_mesh_by_both_materials() {
    let forms = reference("closed_forms.json");
    let gradient = matrix(&forms["patch_test"]["F"]);
    let strain = gradient - Matrix2::identity();
    let mesh = distorted_block();
    let mut prescribed = Prescribed::none(mesh.vertex_count());
    for (vertex, x) in mesh.vertices().iter().enumerate() {
        if x[0] == 0.0 || x[0] == WIDTH || x[1] == 0.0 || x[1] == HEIGHT {
            prescribed.impose_all(vertex, (strain * Vector2::from(*x)).into());
        }
    }
    for poisson in [0.3, 0.45] {
        for material in [svk(poisson), neo_hookean(poisson), ogden(poisson)] {
            let body = Body::new(&mesh, material.clone(), prescribed.clone()).unwrap();
            let path = LoadPath::solve(&body, &LoadPathOptions::default()).unwrap();
            let mut u = vec![0.0; body.unknowns()];
            path.displacement(1.0, &mut u);
            for (vertex, x) in mesh.vertices().iter().enumerate() {
                let exact = strain * Vector2::from(*x);
                close(u[2 * vertex], exact.x, 1e-13, "u_x");
                close(u[2 * vertex + 1], exact.y, 1e-13, "u_y");
            }
            close(body.energy(1.0, &u), WIDTH * HEIGHT * material.energy(&gradient), 1e-13, "energy");
            let stress = material.stress(&body.deformation_gradient(&u, 17));
            assert!((stress - material.stress(&gradient)).norm() < 1e-12);
        }
        let key = poisson.to_string();
        let wanted = matrix(&forms["patch_test"]["P"][&key]);
        assert!((svk(poisson).stress(&gradient) - wanted).norm() < 1e-14, "{poisson}");
        close(svk(poisson).energy(&gradient), number(&forms["patch_test"]["energy_density"][&key]), 1e-15, "energy");
    }
}

#[test]
fn a_rigid_rotation_costs_nothing() {
    let forms = reference("closed_forms.json");
    let mesh = distorted_block();
    for material in [svk(0.3), neo_hookean(0.3), ogden(0.3)] {
        let body = moved_ends(&mesh, material, 0.2, true);
        for degrees in array(&forms["rigid_rotation"]["angles_deg"]).iter().map(number) {
            let strain = rotation(degrees) - Matrix2::identity();
            let u: Vec<f64> =
                mesh.vertices().iter().flat_map(|x| <[f64; 2]>::from(strain * Vector2::from(*x))).collect();
            close(body.energy(1.0, &u), 0.0, 1e-15, "energy");
            assert!(body.internal_forces(1.0, &u).iter().all(|force| force.abs() < 1e-14), "{degrees}");
            close(body.lowest_jacobian(&u).0, 1.0, 1e-14, "det F");
        }
    }
}

#[test]
fn the_observer_may_turn_without_changing_the_stress() {
    let forms = reference("closed_forms.json");
    let gradient = matrix(&forms["patch_test"]["F"]);
    let turn = rotation(number(&forms["objectivity"]["angle_deg"]));
    for poisson in [0.3, 0.45] {
        let wanted = matrix(&forms["objectivity"]["P_QF"][&poisson.to_string()]);
        assert!((svk(poisson).stress(&(turn * gradient)) - wanted).norm() < 1e-14);
        for material in [svk(poisson), neo_hookean(poisson), ogden(poisson)] {
            let turned = turn * gradient;
            close(material.energy(&turned), material.energy(&gradient), 1e-15, "energy");
            assert!((material.stress(&turned) - turn * material.stress(&gradient)).norm() < 1e-14);
            assert!(check_derivatives(material.as_ref(), &turned) < 1e-9);
        }
    }
}

#[test]
fn simple_shear_and_equal_stretches_have_their_closed_forms() {
    let forms = reference("closed_forms.json");
    let shear = matrix(&forms["simple_shear"]["F"]);
    for poisson in [0.3, 0.45] {
        let key = poisson.to_string();
        let wanted = matrix(&forms["simple_shear"]["P"][&key]);
        assert!((svk(poisson).stress(&shear) - wanted).norm() < 1e-15 * 4.0);
        let pressed = svk(poisson).stress(&(Matrix2::identity() * 0.8));
        let wanted = Matrix2::identity() * number(&forms["equibiaxial"]["P_at_s_0.8"][&key]);
        assert!((pressed - wanted).norm() < 1e-15 * 4.0);
    }
}

#[test]
fn ellipticity_is_lost_where_the_table_says() {
    let forms = reference("closed_forms.json");
    for row in array(&forms["uniaxial"]["limits_table"]) {
        let poisson = number(&row["nu"]);
        let limit = |across: &dyn Fn(f64) -> f64| {
            let stable = |stretch: f64| {
                acoustic_minimum(svk(poisson).as_ref(), &Matrix2::new(across(stretch), 0.0, 0.0, stretch)) > 0.0
            };
            let (mut low, mut high) = (0.5, 0.999);
            for _ in 0..36 {
                let middle = 0.5 * (low + high);
                if stable(middle) { high = middle } else { low = middle }
            }
            low
        };
        let (free, confined) = (limit(&|stretch| lambda_x(poisson, stretch)), limit(&|_| 1.0));
        // The table's minimum is over 720 directions: it loses ellipticity a little late.
        let late = free - number(&row["ellipticity_lost_free_lateral_lambda_y"]);
        assert!((-1e-10..4e-6).contains(&late), "free sides at {poisson}: {free}");
        let late = confined - number(&row["ellipticity_lost_confined_lambda_x_1_lambda_y"]);
        assert!((-1e-10..4e-6).contains(&late), "confined at {poisson}: {confined}");
        if poisson == 0.0 {
            close(free, 2.0 - 2f64.sqrt(), 1e-10, "the limit without Poisson's effect");
        }
    }
}

#[test]
fn an_axon_carried_by_a_stretching_block_follows_its_closed_form() {
    let forms = reference("closed_forms.json");
    let case = &forms["carried_axon"];
    let pair = |key: &str| Vector2::new(number(&case[key][0]), number(&case[key][1]));
    let (centre, start, speed, end) = (pair("centre"), pair("x0"), pair("v_g"), pair("x_at_t"));
    let (rate, duration) = (number(&case["b"]), number(&case["t"]));
    let mesh = block(4, 2);
    let body = moved_ends(&mesh, svk(number(&case["nu"])), 0.5 * HEIGHT * rate * duration, false);
    let options = LoadPathOptions { tolerance: 1e-10, max_levels: 400, ..LoadPathOptions::default() };
    let path = LoadPath::solve(&body, &options).unwrap();
    assert!(path.report().met);
    let mut u = vec![0.0; body.unknowns()];
    let mut gradient_at = |time: f64| {
        path.displacement(time / duration, &mut u);
        body.deformation_gradient(&u, 5)
    };
    let steps = 40;
    let carried = |velocity: Vector2<f64>, gradient_at: &mut dyn FnMut(f64) -> Matrix2<f64>| {
        let mut site = start - centre;
        let step = duration / steps as f64;
        for k in 0..steps {
            // The site does not enter the right-hand side of a homogeneous state.
            let slope = |c: f64, gradient: &mut dyn FnMut(f64) -> Matrix2<f64>| {
                gradient(step * (k as f64 + c)).try_inverse().unwrap() * velocity
            };
            for (b, c) in RK4.b.iter().zip(RK4.c) {
                site += slope(*c, gradient_at) * (b * step);
            }
        }
        (site, centre + gradient_at(duration) * site)
    };
    let (_, found) = carried(speed, &mut gradient_at);
    assert!((found - end).norm() < 1e-9, "{found} for {end}");
    assert_eq!(carried(Vector2::zeros(), &mut gradient_at).0, start - centre);
}
