//! A field in time against closed forms: decay of a cosine mode, conserved totals, the stationary limit, the carried limit.

use std::f64::consts::PI;
use tropism::numerics::carried_field::{carried, volumes_around};
use tropism::numerics::field_path::{FieldPath, FieldPathError, FieldProblem, FieldSolvers, Gradient, Order};
use tropism::numerics::reaction_diffusion::{Mass, ReactionDiffusion};
use tropism::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};
use tropism::numerics::transient_field::{Course, Start, solve_in_time};

const WIDTH: f64 = 100.0;
const HEIGHT: f64 = 40.0;

fn mesh() -> SimplexMesh<2> {
    structured_rectangle(WIDTH, HEIGHT, 20, 8).unwrap()
}

/// The left tenth releases; D in µm²/h, k in 1/h.
fn problem(mesh: &SimplexMesh<2>, diffusion: f64, degradation: f64) -> FieldProblem<'_> {
    let left = |cell: &u32| mesh.cell(*cell as usize).iter().all(|&v| mesh.vertices()[v as usize][0] <= 0.1001 * WIDTH);
    FieldProblem {
        mesh,
        equation: ReactionDiffusion { diffusion, degradation, mass: Mass::Lumped },
        order: Order::Linear,
        gradient: Gradient::Recovered,
        sources: vec![(0..mesh.cell_count() as u32).filter(left).collect()],
        release_rate: 5.0,
        bound: false,
        keeps_total: true,
    }
}

fn course(end: f64, start: Start) -> Course {
    let release = [f64::INFINITY; 2];
    Course { start, end, release, kinks: Vec::new(), tolerance: 1e-4, halvings: 3, most_levels: 1000 }
}

/// So many equal steps; levels are some of them.
fn fixed(halvings: u32, course: Course) -> Course {
    Course { tolerance: f64::INFINITY, halvings, ..course }
}

fn solvers<'m>(problem: &FieldProblem<'m>) -> FieldSolvers<'m> {
    FieldSolvers::new(problem.mesh, problem.sources.clone())
}

fn solve(problem: &FieldProblem, course: &Course) -> FieldPath {
    solve_in_time(problem, &mut solvers(problem), None, course).unwrap()
}

fn concentrations(field: &FieldPath, time: f64) -> Vec<f64> {
    let mut values = vec![0.0; field.path.components()];
    field.path.evaluate(time, &mut values);
    field.layout.concentrations(&values).collect()
}

/// Bends and stretches the tissue, dx/dt included; a kink of its velocity at t = 0.5, one-sided as the path asks for it.
fn moved(mesh: &SimplexMesh<2>, time: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let (s, rate) = if time <= 0.5 { (0.6 * time, 0.6) } else { (0.3 - 0.2 * (time - 0.5), -0.2) };
    let at = |&[x, y]: &[f64; 2]| {
        let bend = x + 0.3 * x * x / WIDTH;
        ([x + s * bend, y * (1.0 - 0.5 * s)], [rate * bend, -0.5 * rate * y])
    };
    mesh.vertices().iter().map(at).unzip()
}

fn total(mesh: &SimplexMesh<2>, c: &[f64], x: &[[f64; 2]]) -> f64 {
    c.iter().zip(volumes_around(mesh, x)).map(|(c, volume)| c * volume / 3.0).sum()
}

fn bump(mesh: &SimplexMesh<2>) -> Vec<f64> {
    mesh.vertices().iter().map(|x| 0.2 + (-((x[0] - 30.0) / 15.0).powi(2)).exp() + 0.01 * x[1]).collect()
}

#[test]
fn a_cosine_mode_decays_as_its_eigenvalue_says_with_an_error_of_order_two_in_the_step() {
    let mesh = mesh();
    let (diffusion, degradation, end) = (1000.0, 1.5, 0.8);
    let mode: Vec<f64> = mesh.vertices().iter().map(|x| (PI * x[0] / WIDTH).cos()).collect();
    let problem = problem(&mesh, diffusion, degradation);
    let last = |halvings: u32| {
        let field = solve(&problem, &fixed(halvings, course(end, Start::Given(mode.clone()))));
        let level = field.path.levels().last().unwrap().clone();
        let of = |values: &[f64]| field.layout.concentrations(values).collect::<Vec<f64>>();
        [of(&level.value), of(&level.slope)]
    };
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let fine = last(10);
    let eigenvalue = diffusion * (PI / WIDTH).powi(2) + degradation;
    let exact: Vec<f64> = mode.iter().map(|mode| mode * (-eigenvalue * end).exp()).collect();
    let rate: Vec<f64> = exact.iter().map(|c| -eigenvalue * c).collect();
    // What is left is the mesh's error, worst in corners.
    assert!(apart(&fine[0], &exact) < 2e-3 && apart(&fine[1], &rate) < 6e-3, "{}", apart(&fine[0], &exact));
    let coarse = [4, 5, 6].map(last);
    for part in 0..2 {
        let errors = [0, 1, 2].map(|i: usize| apart(&coarse[i][part], &fine[part]));
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.15), "{part}: {orders:?} {errors:?}");
    }
}

#[test]
fn the_amount_is_kept_to_round_off_while_the_tissue_bends_and_stretches() {
    let mesh = mesh();
    let problem = problem(&mesh, 3000.0, 0.0);
    let configurations = |time: f64| moved(&mesh, time);
    let course = Course { kinks: vec![0.5], ..course(1.0, Start::Given(bump(&mesh))) };
    let field = solve_in_time(&problem, &mut solvers(&problem), Some(&configurations), &course).unwrap();
    let before = total(&mesh, &bump(&mesh), mesh.vertices());
    let levels = field.path.levels();
    assert!(levels.len() > 8);
    for level in levels {
        let c: Vec<f64> = field.layout.concentrations(&level.value).collect();
        let now = total(&mesh, &c, &moved(&mesh, level.parameter).0);
        assert!((now / before - 1.0).abs() < 1e-12, "{} {}", level.parameter, now / before - 1.0);
    }
    // It has spread, and been stretched, all the same.
    let last = concentrations(&field, 1.0);
    let spread = |c: &[f64]| c.iter().fold(0.0f64, |m, c| c.max(m)) / c.iter().fold(f64::INFINITY, |m, c| c.min(m));
    assert!(spread(&last) < 0.3 * spread(&bump(&mesh)));
}

#[test]
fn what_is_released_between_two_times_is_there_and_the_path_has_its_kinks_there() {
    let mesh = mesh();
    let problem = problem(&mesh, 2000.0, 0.0);
    let configurations = |time: f64| moved(&mesh, time);
    let pulse = Course { release: [0.3, 0.7], kinks: vec![0.5], ..course(1.0, Start::Nothing) };
    let field = solve_in_time(&problem, &mut solvers(&problem), Some(&configurations), &pulse).unwrap();
    let released = 5.0 * 0.1 * WIDTH * HEIGHT;
    for level in field.path.levels() {
        let c: Vec<f64> = field.layout.concentrations(&level.value).collect();
        let now = total(&mesh, &c, &moved(&mesh, level.parameter).0);
        let expected = released * (level.parameter.clamp(0.3, 0.7) - 0.3);
        assert!((now - expected).abs() < 1e-11 * released, "{} {now} {expected}", level.parameter);
    }
    let times: Vec<f64> = field.path.levels().iter().map(|level| level.parameter).collect();
    for kink in [0.3, 0.5, 0.7f64] {
        assert!(times.contains(&kink) && times.contains(&kink.next_up()), "{kink}");
    }
    let at = |time: f64| concentrations(&field, time);
    assert!(at(0.29).iter().all(|c| *c == 0.0) && at(0.31)[0] > 0.0);
}

#[test]
fn slopes_in_time_are_those_of_differences_of_the_amounts() {
    let mesh = mesh();
    let problem = problem(&mesh, 2000.0, 1.0);
    let configurations = |time: f64| moved(&mesh, time);
    let course = Course { tolerance: 1e-7, release: [0.0, 2.0], ..course(0.4, Start::Given(bump(&mesh))) };
    let field = solve_in_time(&problem, &mut solvers(&problem), Some(&configurations), &course).unwrap();
    let levels = field.path.levels();
    let middle = levels.len() / 2;
    let (a, b) = (&levels[middle], &levels[middle + 1]);
    let h = b.parameter - a.parameter;
    let scale = a.slope.iter().fold(0.0f64, |m, s| s.abs().max(m));
    for (i, (start, end)) in a.slope.iter().zip(&b.slope).enumerate() {
        let chord = (b.value[i] - a.value[i]) / h;
        assert!((chord - 0.5 * (start + end)).abs() < 2e-3 * scale, "{i} {chord} {start} {end}");
    }
}

#[test]
fn long_after_the_start_the_field_is_the_stationary_one_and_from_there_it_does_not_move() {
    let mesh = mesh();
    let problem = problem(&mesh, 3000.0, 3.0);
    let goal = tropism::numerics::hermite::Refinement { tolerance: 1e-3, max_levels: 5 };
    let stationary = problem.solve(&mut solvers(&problem), None, goal).unwrap();
    let expected = concentrations(&stationary, 0.0);
    let largest = expected.iter().fold(0.0f64, |m, c| c.max(m));
    let apart = |field: &FieldPath, time: f64| {
        concentrations(field, time).iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
    };
    let always = |start| Course { release: [0.0, f64::INFINITY], ..course(8.0, start) };
    let risen = solve(&problem, &always(Start::Nothing));
    // What is left of the start falls as exp(−kt): half an hour is early, 24 lives are late.
    assert!(apart(&risen, 0.5) > 0.05 && apart(&risen, 8.0) < 1e-5, "{} {}", apart(&risen, 0.5), apart(&risen, 8.0));
    let still = solve(&problem, &always(Start::Stationary));
    for time in [0.1, 1.0, 8.0] {
        assert!(apart(&still, time) < 1e-11, "{time} {}", apart(&still, time));
    }
    // Gradients are those of the stationary field as well.
    let (level, exact) = (risen.path.levels().last().unwrap(), &stationary.path.levels()[0].value);
    assert!(risen.layout.gradient_defect(&mesh, (&level.value, exact), 1e-6) < 1e-4);
}

#[test]
fn without_diffusion_and_decay_it_is_carried_and_diluted_as_a_bound_field() {
    let mesh = mesh();
    let problem = problem(&mesh, 1e-9, 0.0);
    let configurations = |time: f64| moved(&mesh, time);
    let at_rest = bump(&mesh);
    let course = Course { kinks: vec![0.5], ..course(1.0, Start::Given(at_rest.clone())) };
    let field = solve_in_time(&problem, &mut solvers(&problem), Some(&configurations), &course).unwrap();
    for level in field.path.levels() {
        let (x, velocity) = moved(&mesh, level.parameter);
        let (c, rate) = carried(&mesh, &at_rest, &x, &velocity);
        let slopes = field.layout.concentrations(&level.slope);
        for ((found, slope), (c, rate)) in
            field.layout.concentrations(&level.value).zip(slopes).zip(c.iter().zip(&rate))
        {
            assert!((found - c).abs() < 1e-9 && (slope - rate).abs() < 1e-8, "{found} {c} {slope} {rate}");
        }
    }
}

#[test]
fn at_rest_a_factor_serves_all_steps_of_one_length_and_a_step_takes_three_solves() {
    let mesh = mesh();
    let problem = problem(&mesh, 1000.0, 1.0);
    let mut solvers = solvers(&problem);
    let course = fixed(5, Course { release: [0.0, 9.0], ..course(1.0, Start::Nothing) });
    let field = solve_in_time(&problem, &mut solvers, None, &course).unwrap();
    let work = solvers.work();
    assert_eq!((work.symbolic, work.factorisations, work.solves), (1, 1, 3 * 32));
    assert_eq!(field.report.solves, 32);
    let configurations = |time: f64| moved(&mesh, 0.3 * time);
    solve_in_time(&problem, &mut solvers, Some(&configurations), &course).unwrap();
    assert_eq!(solvers.work().factorisations, 1 + 2 * 32);
}

#[test]
fn the_error_follows_the_tolerance_and_superfluous_levels_are_left_out() {
    let mesh = mesh();
    let problem = problem(&mesh, 5000.0, 2.0);
    let with = |tolerance: f64| {
        let course = Course { tolerance, release: [0.0, 1.0], most_levels: 5000, ..course(2.0, Start::Nothing) };
        solve(&problem, &course)
    };
    let exact = with(3e-8);
    let times: Vec<f64> = (1..200).map(|i| 0.01 * f64::from(i)).collect();
    let largest = times.iter().flat_map(|&time| concentrations(&exact, time)).fold(0.0, f64::max);
    for tolerance in [1e-3, 1e-4] {
        let field = with(tolerance);
        let difference = |&time: &f64| -> f64 {
            let pairs = concentrations(&field, time).into_iter().zip(concentrations(&exact, time));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let worst = times.iter().map(difference).fold(0.0, f64::max) / largest;
        assert!(worst < 10.0 * tolerance, "{worst:e} at {tolerance:e}");
        assert!(worst > 0.05 * tolerance, "{worst:e} at {tolerance:e}: steps are far too short");
        assert!(field.report.worst_defect <= tolerance);
        assert!(2 * field.path.levels().len() < field.report.solves + 6, "{}", field.report.solves);
    }
    let few = Course { most_levels: 5, release: [0.0, 1.0], ..course(2.0, Start::Nothing) };
    let refused = solve_in_time(&problem, &mut solvers(&problem), None, &few);
    assert!(matches!(refused, Err(FieldPathError::TooManyLevels { levels: 5, .. })));
}
