//! Steps of cones' own size that a tolerance chooses: their error, their cost, that what was rejected leaves no trace, and that no cone
//! takes the steps of another.

use crate::common::{ConeState, assembled, cones, ended, fitted_order, hash_of_states};
use crate::figures::{self, Curve};
use crate::front::Front;
use crate::trajectories::{reference, scene as reference_scene, with_exact_field, worst_errors_and_cost};
use serde_json::{Value, json};
use tropism::model::adaptive::AdaptiveSteps;
use tropism::model::shafts::Shafts;
use tropism::prelude::*;
use tropism::systems;

const PAIR: &str = "bogacki_shampine";

fn roster() -> Roster {
    systems::standard().with::<Front>()
}

/// Cones that cross a thin layer in which their pull changes.
fn front(method: &str, step: f64, tolerance: Option<f64>) -> Value {
    json!({
        "tissue": { "outline": { "rectangle": { "width": 400, "height": 400 } }, "mesh_size": 40 },
        "time": { "duration": 6.4, "step": step, "method": method, "tolerance": tolerance },
        "growth": { "turning_rate": 2 },
        "populations": { "axons": {
            "count": 3, "births": { "at": 0 }, "origin": { "points": [[200, 40], [150, 44], [250, 62]] }, "heading": 120
        } },
        "front": {}
    })
}

/// Everything at once, with births all the time.
fn full(step: f64, tolerance: f64) -> Value {
    json!({
        "seed": 3,
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": 20 },
        "time": { "duration": 3.2, "step": step, "method": PAIR, "tolerance": tolerance },
        "populations": { "axons": { "count": 30, "births": { "uniform": { "from": 0, "to": 2.9 } } } },
        "matrix": { "load": { "times": [0.9, 1.23456, 2], "loads": [0, 1, 0.5] } },
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [100, 120], "radius": 20 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    })
}

fn farthest(a: &[ConeState], b: &[ConeState]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max)
}

#[test]
fn with_any_error_allowed_the_pair_is_a_method_of_order_three_in_position_and_in_heading() {
    let reference = reference("trajectories");
    let errors = [4, 8, 16].map(|steps| {
        let mut scene = with_exact_field(reference_scene(&reference, PAIR, steps, 0.1));
        scene["time"]["tolerance"] = json!(1e6);
        let (errors, cost) = worst_errors_and_cost(&reference, &scene);
        assert_eq!((cost.steps, cost.rejected_steps, cost.stages), (20 * steps as u64, 0, 80 * steps as u64));
        errors
    });
    for (kind, what) in ["position", "heading"].into_iter().enumerate() {
        let order = fitted_order(&errors.map(|e| e[kind]));
        println!("pair: {what}: order {order:.3}, errors {:?}", errors.map(|e| e[kind]));
        assert!((order - 3.0).abs() < 0.15, "{what}: order {order}");
    }
}

#[test]
fn the_error_of_a_run_is_proportional_to_the_tolerance_over_three_decades() {
    let reference = reference("trajectories");
    // Down from where the largest step is no longer good enough.
    let tolerances: Vec<f64> = (0..=10).map(|k| 1e-6 * 0.5f64.powi(k)).collect();
    let errors: Vec<[f64; 2]> = tolerances
        .iter()
        .map(|&tolerance| {
            let mut scene = with_exact_field(reference_scene(&reference, PAIR, 1, 0.1));
            scene["time"]["tolerance"] = json!(tolerance);
            let (errors, cost) = worst_errors_and_cost(&reference, &scene);
            println!(
                "tolerance {tolerance:.2e}: errors {errors:?}, {} stages, {} rejected",
                cost.stages, cost.rejected_steps
            );
            errors
        })
        .collect();
    for steps in [1, 2, 4, 8] {
        let scene = with_exact_field(reference_scene(&reference, "rk4", steps, 0.1));
        let (errors, cost) = worst_errors_and_cost(&reference, &scene);
        println!("rk4, {steps} steps an interval: errors {errors:?}, {} stages", cost.stages);
    }
    let mut plots = Vec::new();
    for (kind, what) in ["position", "heading"].into_iter().enumerate() {
        let errors: Vec<f64> = errors.iter().map(|e| e[kind]).collect();
        let slope = fitted_order(&errors);
        println!("{what}: error ~ tolerance^{slope:.3}");
        assert!((slope - 1.0).abs() < 0.12, "{what}: {slope}");
        let curve = Curve::new("bogacki_shampine", &tolerances, &errors, [1.0, slope]);
        let axes = ["tolerance (µm)", ["largest error (µm)", "largest error (rad)"][kind]];
        plots.push(figures::orders(what, axes, &[curve]));
    }
    let words = [
        "The turning law: steps that a tolerance chooses",
        "eight reference trajectories, compared at 20 times; the numbers are fitted exponents",
    ];
    figures::write("tolerance", words, &plots);
}

#[test]
fn a_sharp_front_is_met_with_short_steps_and_crossed_within_the_tolerance() {
    let exact = cones(ended(&front("rk4", 0.4 / 1024.0, None), &roster()).world());
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let run = ended(&front(PAIR, 0.4, Some(tolerance)), &roster());
        let (error, cost) = (farthest(&cones(run.world()), &exact), run.counters());
        println!("tolerance {tolerance:.0e}: error {error:.2e} um, {cost:?}");
        assert!(cost.rejected_steps > 3 && error < 20.0 * tolerance, "{error:e}");
    }
}

/// Evaluations of the pull of single cones, four a step.
fn evaluations(cost: &Counters) -> u64 {
    4 * (cost.cone_steps + cost.rejected_steps)
}

#[test]
fn at_equal_error_a_sharp_front_costs_fewer_evaluations_than_with_fixed_steps() {
    let thin = |method: &str, step: f64, tolerance: Option<f64>| {
        let mut scene = front(method, step, tolerance);
        scene["front"]["width"] = json!(0.02);
        ended(&scene, &roster())
    };
    let exact = cones(thin("rk4", 0.4 / 2048.0, None).world());
    let pair = thin(PAIR, 0.4, Some(1e-3));
    let (error, needed) = (farthest(&cones(pair.world()), &exact), evaluations(&pair.counters()));
    let fixed: Vec<_> = (4..10)
        .map(|halvings| {
            let run = thin("rk4", 0.4 * 0.5f64.powi(halvings), None);
            (farthest(&cones(run.world()), &exact), evaluations(&run.counters()))
        })
        .collect();
    println!("pair: {error:.2e} um with {needed} evaluations; rk4: {fixed:?}");
    let (_, of_fixed) = fixed.iter().find(|run| run.0 <= error).unwrap();
    assert!(2 * needed < *of_fixed, "{needed} against {of_fixed}");
}

/// Cones that cross a sharp front one after the other.
fn crossing(count: usize, tolerance: f64) -> Value {
    let mut scene = front(PAIR, 0.4, Some(tolerance));
    let places: Vec<_> = (0..count).map(|i| [120 + 10 * i, 30 + 8 * i]).collect();
    scene["populations"]["axons"]["count"] = json!(count);
    scene["populations"]["axons"]["origin"] = json!({ "points": places });
    scene
}

#[test]
fn a_cone_takes_the_same_steps_whoever_else_is_there() {
    let all = ended(&crossing(8, 1e-4), &roster());
    let mut steps = 0;
    for (i, cone) in cones(all.world()).iter().enumerate() {
        let mut scene = crossing(8, 1e-4);
        scene["populations"]["axons"]["count"] = json!(1);
        scene["populations"]["axons"]["origin"]["points"] = json!([[120 + 10 * i, 30 + 8 * i]]);
        let alone = ended(&scene, &roster());
        let tip = &cones(alone.world())[0];
        assert_eq!((tip.position, tip.spring.heading), (cone.position, cone.spring.heading), "cone {i}");
        steps += alone.counters().cone_steps;
    }
    assert_eq!(all.counters().cone_steps, steps);
    assert!(steps > 8 * 16 + 50, "{steps}: the front asks for short steps");
}

/// Says that cones act on one another, and adds nothing.
#[derive(Debug, Default, Deserialize, JsonSchema)]
struct Coupled {}

impl Mechanism for Coupled {
    const NAME: &'static str = "coupled";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.acts_between_cones();
        Ok(())
    }
}

#[test]
fn where_cones_act_on_one_another_all_take_the_steps_of_the_one_that_needs_the_shortest() {
    let roster = roster().with::<Coupled>();
    let own = ended(&crossing(8, 1e-3), &roster);
    let mut scene = crossing(8, 1e-3);
    scene["coupled"] = json!({});
    let mut together = assembled(&scene, &roster);
    while !together.is_over() {
        together.step().unwrap();
        let levels = &together.world().resource::<AdaptiveSteps>().levels;
        assert!(levels.iter().all(|level| *level == levels[0]), "{levels:?}");
    }
    let exact = cones(
        ended(
            &{
                let mut fixed = crossing(8, 1e-3);
                fixed["time"] = front("rk4", 0.4 / 1024.0, None)["time"].clone();
                fixed
            },
            &roster,
        )
        .world(),
    );
    let errors = [&own, &together].map(|run| farthest(&cones(run.world()), &exact));
    let counts = [&own, &together].map(|run| evaluations(&run.counters()));
    println!(
        "own: {:.2e} um with {}, together: {:.2e} um with {} evaluations",
        errors[0], counts[0], errors[1], counts[1]
    );
    assert!(errors.iter().all(|error| *error < 2e-2), "{errors:?}");
    assert!(2 * counts[0] < counts[1], "{counts:?}");
}

#[test]
fn cones_are_born_inside_steps_and_those_of_a_rejected_rest_wait_for_their_own_step() {
    let mut simulation = assembled(&full(0.8, 1e-2), &roster());
    while !simulation.is_over() {
        simulation.step().unwrap();
        let (world, now) = (simulation.world(), simulation.world().resource::<Clock>().now);
        for (shaft, cone) in cones(world).iter().enumerate() {
            assert_eq!(cone.status == Status::Unborn, cone.identity.birth >= now);
            assert_eq!(world.resource::<Shafts>().polyline(shaft).is_empty(), cone.status == Status::Unborn);
        }
    }
    let cost = simulation.counters();
    println!("{cost:?}");
    assert!(cost.rejected_steps > 3);
    assert!(cones(simulation.world()).iter().all(|cone| cone.status != Status::Unborn));
    // Without noise and contact the error is that of the smooth part, for late-born cones as for others.
    let smooth = |method: &str, step: f64, tolerance: Option<f64>| {
        let mut scene = front(method, step, tolerance);
        scene["populations"]["axons"]["count"] = json!(12);
        scene["populations"]["axons"]["births"] = json!({ "uniform": { "from": 0, "to": 3 } });
        ended(&scene, &roster())
    };
    let exact = cones(smooth("rk4", 0.4 / 1024.0, None).world());
    let error = farthest(&cones(smooth(PAIR, 0.4, Some(1e-3)).world()), &exact);
    println!("born inside steps: error {error:.2e} um");
    assert!(error < 2e-2, "{error:e}");
}

#[test]
fn a_rejected_step_leaves_no_trace() {
    let ended_with = |step: f64| {
        let mut scene = full(step, 1e-5);
        scene["populations"]["axons"]["births"] = json!({ "at": 0 });
        scene["fasciculation"] = Value::Null;
        ended(&scene, &roster())
    };
    // All steps that stand are shorter than the largest of these, so that more are tried with it, and the same stand.
    let (fine, coarse) = (ended_with(0.4), ended_with(1.6));
    let [few, more] = [&fine, &coarse].map(|run| run.counters());
    assert!(more.rejected_steps > few.rejected_steps, "{few:?} {more:?}");
    assert_eq!(few.cone_steps, more.cone_steps);
    let tips = |run: &tropism::simulation::Simulation| {
        cones(run.world()).iter().map(|cone| (cone.position, cone.spring.heading, cone.status)).collect::<Vec<_>>()
    };
    assert_eq!(tips(&fine), tips(&coarse));
}

#[test]
fn looking_between_steps_changes_nothing_and_the_clock_meets_its_steps_and_the_corners_of_the_load() {
    let interrupted = |other: bool| {
        let mut simulation = assembled(&full(0.8, 1e-2), &roster());
        let mut met = Vec::new();
        while !simulation.is_over() {
            simulation.step().unwrap();
            met.push(simulation.world().resource::<Clock>().now);
            if other {
                simulation.bring_tissue_here();
            }
        }
        (met, hash_of_states(simulation.world()))
    };
    let (met, hash) = interrupted(false);
    assert_eq!((met.clone(), hash), interrupted(true));
    let grid = assembled(&full(0.8, 1e-2), &roster()).world().resource::<Clock>().grid;
    assert!((1..=4).all(|k| met.contains(&(k * grid.step_ticks()))));
    assert!([0.9, 1.23456, 2.0].iter().all(|&time| met.contains(&grid.nearest(time))));
}

#[test]
fn the_noise_is_no_error_and_a_finer_tolerance_meets_the_same_brownian_path() {
    let noisy = |tolerance: f64| {
        let mut scene = front(PAIR, 0.4, Some(tolerance));
        scene["heading_noise"] = json!({});
        scene
    };
    let mut alone = noisy(1e-9);
    alone["front"] = Value::Null;
    let cost = ended(&alone, &roster()).counters();
    assert_eq!((cost.steps, cost.rejected_steps), (16, 0), "kicks alone ask for no short steps");
    let tips: Vec<_> =
        [1e-2, 1e-4, 1e-6, 1e-8].map(|tolerance| cones(ended(&noisy(tolerance), &roster()).world())).into();
    let apart: Vec<f64> = tips.windows(2).map(|pair| farthest(&pair[0], &pair[1])).collect();
    println!("tips of successive tolerances are apart by {apart:.3?} um");
    assert!(apart[2] < 0.5 && apart[2] < 0.5 * apart[0], "{apart:?}");
}

#[test]
fn a_jump_that_no_step_resolves_is_crossed_and_noted() {
    let mut scene = front(PAIR, 1e-2, Some(1e-12));
    scene["time"]["duration"] = json!(1e-2);
    scene["front"] = json!({ "width": 0, "height": 40.0005 });
    let simulation = ended(&scene, &roster());
    let notes = simulation.world().resource::<Health>().notes().join("; ");
    println!("{notes}; {:?}", simulation.counters());
    assert!(
        notes.contains("the tolerance was missed in ") && notes.contains(" steps of one tick, by an error of up to")
    );
}
