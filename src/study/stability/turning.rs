//! Map: every integrator of the turning law, eq. (1), from `κΔt` = 0.01 to 100.
//!
//! Under a constant unit pull a step of an explicit method takes a small angle β to `R(−κΔt) β`, `R` its stability polynomial:
//! `|R| ≤ 1` up to 2 (Euler, Heun) and 2.785 (RK4). An explicit step also lengthens v_g: one of Euler from the angle β by
//! √(1 + (κΔt sin β)²). A longer v_g turns more slowly, so beyond the limit the angle does not grow
//! for ever: |v_g| grows until κΔt over its growth is back at the limit. Beyond κΔt = 1 Euler swings over the pull (R < 0); Heun and RK4
//! (R > 0) turn away from it instead. `rotation` takes tan(β/2) to tan(β/2) exp(−κΔt) and keeps |v_g|.
//!
//! Every figure comes from the integrators that runs use, in a scene of one cone.

use super::Figure;
use crate::model::components::{GrowthCone, SpringState};
use crate::model::health::Health;
use crate::model::mechanism::Roster;
use crate::record::plot::{Axis, Level, Plot, Series, Stroke};
use crate::simulation::Simulation;
use crate::study::run::{RunError, assembled, read_document};
use bevy_ecs::prelude::With;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::json;

/// Names of the integrators, as in scenarios.
pub const METHODS: [&str; 4] = ["euler", "heun", "rk4", "rotation"];
/// Steps that each cone takes.
pub const STEPS: usize = 40;
/// The angle (degrees) at which swings start.
pub const START: f64 = 30.0;
/// The small angle (rad) at which amplification is measured.
pub const SMALL_ANGLE: f64 = 1e-6;

/// What one integrator does with one step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TurningPoint {
    /// κΔt.
    pub rate_times_step: f64,
    /// Factor by which one step changes a small angle.
    pub amplification: f64,
    /// |v_g| over its nominal value after the first step from [`START`].
    pub first_growth: f64,
    /// |v_g| over its nominal value after [`STEPS`] steps from [`START`].
    pub growth: f64,
    /// The farthest that a cone swings beyond the pull on its way from [`START`] (degrees); 0 if it never does.
    pub overshoot: f64,
    /// The angle to the pull after [`STEPS`] steps from [`START`] (degrees, absolute).
    pub residual: f64,
    /// Whether the scene's notes warn of the step.
    pub warned: bool,
}

/// One integrator over all steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MethodMap {
    /// Name of the integrator.
    pub method: &'static str,
    /// κΔt at which a small angle begins to grow; `null` if it never does up to the largest step of the map.
    pub limit: Option<f64>,
    /// Its points.
    pub points: Vec<TurningPoint>,
}

/// The map of the integrators.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TurningMap {
    /// One entry an integrator.
    pub methods: Vec<MethodMap>,
}

/// Heading angle (rad) and |v_g| over its nominal value, after each step.
type Swing = Vec<[f64; 2]>;

/// Computes the map at `count` steps κΔt, evenly spread in the logarithm from 0.01 to 100.
///
/// # Errors
/// A scene that could not be put together, or that ended early.
pub fn compute(roster: &Roster, count: usize) -> Result<TurningMap, RunError> {
    let methods = METHODS.map(|method| {
        let points: Result<Vec<_>, RunError> =
            super::logarithmic([0.01, 100.0], count).into_par_iter().map(|x| point(roster, method, x)).collect();
        let points = points?;
        let limit = limit(roster, method, &points)?;
        Ok(MethodMap { method, limit, points })
    });
    Ok(TurningMap { methods: methods.into_iter().collect::<Result<_, RunError>>()? })
}

fn point(roster: &Roster, method: &str, rate_times_step: f64) -> Result<TurningPoint, RunError> {
    let (swing, warned) = swing(roster, method, rate_times_step, START, STEPS)?;
    let beyond = swing.iter().map(|[angle, _]| -angle.to_degrees()).fold(0.0, f64::max);
    let last = swing.last().copied().unwrap_or([f64::NAN; 2]);
    Ok(TurningPoint {
        rate_times_step,
        amplification: amplification(roster, method, rate_times_step)?,
        first_growth: swing.first().map_or(f64::NAN, |first| first[1]),
        growth: last[1],
        overshoot: beyond,
        residual: last[0].to_degrees().abs(),
        warned,
    })
}

fn amplification(roster: &Roster, method: &str, rate_times_step: f64) -> Result<f64, RunError> {
    let (swing, _) = swing(roster, method, rate_times_step, SMALL_ANGLE.to_degrees(), 1)?;
    Ok(swing.first().map_or(f64::NAN, |first| first[0].abs() / SMALL_ANGLE))
}

/// The step at which amplification passes 1, by bisection.
fn limit(roster: &Roster, method: &str, points: &[TurningPoint]) -> Result<Option<f64>, RunError> {
    let Some(first) = points.iter().position(|point| point.amplification > 1.0) else { return Ok(None) };
    let mut low = first.checked_sub(1).map_or(0.0, |before| points[before].rate_times_step);
    let mut high = points[first].rate_times_step;
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        if amplification(roster, method, middle)? > 1.0 { high = middle } else { low = middle }
    }
    Ok(Some(0.5 * (low + high)))
}

/// One slow cone under a unit pull along x for `steps` steps of 1 h, and whether the scene warns of the step.
fn swing(
    roster: &Roster,
    method: &str,
    rate_times_step: f64,
    degrees: f64,
    steps: usize,
) -> Result<(Swing, bool), RunError> {
    let scene = json!({
        "tissue": { "outline": { "rectangle": { "width": 100, "height": 100 } }, "mesh_size": 50 },
        "time": { "duration": steps, "step": 1, "method": method },
        "growth": { "turning_rate": rate_times_step },
        "populations": { "cone": {
            "count": 1, "speed": 1e-3, "births": { "at": 0 }, "origin": { "points": [[50, 50]] }, "heading": degrees
        } },
        "constant_pull": {}
    });
    let loaded = read_document("turning", scene, roster)?;
    let mut simulation = assembled(&loaded, roster, "turning".as_ref())?;
    let mut swing = Vec::with_capacity(steps);
    while !simulation.is_over() {
        simulation.step().map_err(|fault| RunError::Solve(fault.to_string()))?;
        swing.extend(state(&simulation));
    }
    let notes = simulation.world().resource::<Health>().notes();
    Ok((swing, notes.iter().any(|note| note.contains("kappa times step"))))
}

fn state(simulation: &Simulation) -> Option<[f64; 2]> {
    let world = simulation.world();
    let mut cones = world.try_query_filtered::<&SpringState, With<GrowthCone>>()?;
    let spring = cones.iter(world).next()?.seen();
    Some([spring.heading.y.atan2(spring.heading.x), spring.drift])
}

impl TurningMap {
    /// Amplification, growth of |v_g| and overshoot over κΔt.
    pub fn figure(&self) -> Figure {
        let over = |y: &dyn Fn(&TurningPoint) -> f64| {
            let line = |map: &MethodMap| {
                let stroke = if map.method == "rotation" { Stroke::Dashed } else { Stroke::Line };
                Series::new(map.method, map.points.iter().map(|point| [point.rate_times_step, y(point)]), stroke)
            };
            self.methods.iter().map(line).collect::<Vec<_>>()
        };
        let limits = || {
            let rk4 = self.methods.iter().find(|map| map.method == "rk4").and_then(|map| map.limit);
            let level = |at: f64| Level { name: format!("{at:.3}"), at, vertical: true };
            [Some(2.0), rk4].into_iter().flatten().map(level).collect::<Vec<_>>()
        };
        let plot = |title: &str, label: &str, logarithmic, range, series, note: &str| Plot {
            title: title.into(),
            x: Axis::logarithmic("κΔt"),
            y: Axis { label: label.into(), logarithmic, range },
            series,
            levels: limits(),
            marks: Vec::new(),
            note: note.into(),
        };
        Figure {
            name: "turning",
            title: "Integrators of the turning law",
            subtitle: "one cone under a constant unit pull, steps of κΔt from 0.01 to 100",
            plots: vec![
                plot(
                    "a small angle",
                    "|β after| / |β before|, one step",
                    true,
                    Some([1e-3, 1e3]),
                    over(&|point| point.amplification),
                    "above 1 a small angle grows",
                ),
                plot(
                    "speed",
                    "|v_g| / v_g after 40 steps from 30°",
                    true,
                    None,
                    over(&|point| point.growth),
                    "rotation keeps 1",
                ),
                plot(
                    "overshoot",
                    "farthest beyond the pull from 30° (degrees)",
                    false,
                    Some([0.0, 180.0]),
                    over(&|point| point.overshoot),
                    "rotation never overshoots",
                ),
            ],
        }
    }
}
