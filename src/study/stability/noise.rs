//! Map: the same Brownian paths at Δt, Δt/2, Δt/4, ….
//!
//! The path of a heading is fixed by (seed, axon), not by the step, so a refined step refines *it*: tips of the same axon draw together
//! as Δt falls, and statistics stay what they are. Closed forms: without a pull ⟨cos Δθ⟩ = exp(−v t/ℓ_p) and
//! ⟨x²⟩ = 2 v² (r t − 1 + e^(−r t))/r², r = v/ℓ_p; under a unit pull the heading becomes von Mises, ⟨cos β⟩ = I₁(a)/I₀(a),
//! a = κ ℓ_p/v.

use super::Figure;
use crate::model::components::{GrowthCone, Position, SpringState};
use crate::model::mechanism::Roster;
use crate::record::plot::{Axis, Level, Plot, Series, Stroke};
use crate::record::statistics;
use crate::study::run::{RunError, assembled, read_document};
use bevy_ecs::prelude::With;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::json;

/// Steps Δt (h), each half the one before.
pub const STEPS: [f64; 6] = [0.8, 0.4, 0.2, 0.1, 0.05, 0.025];
/// Duration (h).
const TIME: f64 = 8.0;
/// Speed v_g (µm/h).
const SPEED: f64 = 20.0;
/// Persistence length ℓ_p (µm).
const PERSISTENCE: f64 = 100.0;
/// Turning rate κ (1/h).
const TURNING_RATE: f64 = 0.93;

/// A mean over axons.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

/// Statistics at one step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoisePoint {
    /// Δt (h).
    pub step: f64,
    /// ⟨cos Δθ⟩ without a pull.
    pub free_cosine: Mean,
    /// Mean squared distance from the start without a pull (µm²).
    pub squared_distance: Mean,
    /// ⟨cos β⟩ under a unit pull.
    pub pulled_cosine: Mean,
    /// Root mean square over the axons of the distance between the tips of this step and of its half, under the pull (µm); `null`
    /// for the finest.
    pub apart: Option<f64>,
}

/// One integrator over all steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseOfMethod {
    /// Name of the integrator.
    pub method: &'static str,
    /// One point a step.
    pub points: Vec<NoisePoint>,
}

/// The map of the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseMap {
    /// Axons a run.
    pub axons: usize,
    /// Closed form of ⟨cos Δθ⟩ without a pull.
    pub free_cosine: f64,
    /// Closed form of the mean squared distance (µm²).
    pub squared_distance: f64,
    /// Closed form of ⟨cos β⟩ under the pull.
    pub pulled_cosine: f64,
    /// One entry an integrator.
    pub methods: Vec<NoiseOfMethod>,
}

/// Tip (µm from the start) and cosine of the heading of an axon.
type Tip = ([f64; 2], f64);

/// Runs `axons` axons for each integrator and step.
///
/// # Errors
/// A scene that could not be put together, or that ended early.
pub fn compute(roster: &Roster, axons: usize) -> Result<NoiseMap, RunError> {
    let methods = ["rotation", "heun", "euler"].map(|method| {
        let runs: Result<Vec<_>, RunError> = STEPS
            .into_par_iter()
            .map(|step| Ok((tips(roster, method, step, axons, 0.0)?, tips(roster, method, step, axons, 1.0)?)))
            .collect();
        let runs = runs?;
        let point = |(place, step): (usize, &f64)| {
            let (free, pulled) = &runs[place];
            NoisePoint {
                step: *step,
                free_cosine: mean(free.iter().map(|tip| tip.1)),
                squared_distance: mean(free.iter().map(|(at, _)| at[0] * at[0] + at[1] * at[1])),
                pulled_cosine: mean(pulled.iter().map(|tip| tip.1)),
                apart: runs.get(place + 1).map(|(_, finer)| distance(pulled, finer)),
            }
        };
        Ok(NoiseOfMethod { method, points: STEPS.iter().enumerate().map(point).collect() })
    });
    let rate = SPEED / PERSISTENCE;
    let decay = (-rate * TIME).exp();
    Ok(NoiseMap {
        axons,
        free_cosine: decay,
        squared_distance: 2.0 * SPEED * SPEED * (rate * TIME - 1.0 + decay) / (rate * rate),
        pulled_cosine: bessel_ratio(TURNING_RATE / rate),
        methods: methods.into_iter().collect::<Result<_, RunError>>()?,
    })
}

fn tips(roster: &Roster, method: &str, step: f64, axons: usize, pull: f64) -> Result<Vec<Tip>, RunError> {
    let scene = json!({
        "seed": 2,
        "tissue": { "outline": { "rectangle": { "width": 1000, "height": 1000 } }, "mesh_size": 250 },
        "time": { "duration": TIME, "step": step, "method": method },
        "growth": { "turning_rate": TURNING_RATE },
        "populations": { "axons": {
            "count": axons, "speed": SPEED, "births": { "at": 0 }, "origin": { "points": [[500, 500]] }, "heading": 0
        } },
        "heading_noise": { "persistence_length": PERSISTENCE },
        "constant_pull": { "pull": [pull, 0] }
    });
    let loaded = read_document("noise", scene, roster)?;
    let mut simulation = assembled(&loaded, roster, "noise".as_ref())?;
    while !simulation.is_over() {
        simulation.step().map_err(|fault| RunError::Solve(fault.to_string()))?;
    }
    let world = simulation.world();
    let Some(mut cones) = world.try_query_filtered::<(&Position, &SpringState), With<GrowthCone>>() else {
        return Err(RunError::Internal("a scene of axons has no growth cones".into()));
    };
    let tip = |(at, spring): (&Position, &SpringState)| ([at.0.x - 500.0, at.0.y - 500.0], spring.heading().x);
    Ok(cones.iter(world).map(tip).collect())
}

fn mean(values: impl Iterator<Item = f64>) -> Mean {
    let values: Vec<f64> = values.collect();
    let deviation = statistics::standard_deviation(&values).unwrap_or(0.0);
    Mean { mean: statistics::mean(&values).unwrap_or(f64::NAN), error: deviation / (values.len() as f64).sqrt() }
}

fn distance(a: &[Tip], b: &[Tip]) -> f64 {
    let square = |(a, b): (&Tip, &Tip)| (a.0[0] - b.0[0]).powi(2) + (a.0[1] - b.0[1]).powi(2);
    mean(a.iter().zip(b).map(square)).mean.sqrt()
}

/// I₁(x)/I₀(x) from the power series.
fn bessel_ratio(x: f64) -> f64 {
    let (mut zero, mut one, mut term) = (0.0, 0.0, 1.0);
    for n in 0..60 {
        zero += term;
        one += term * 0.5 * x / f64::from(n + 1);
        term *= 0.25 * x * x / f64::from((n + 1) * (n + 1));
    }
    one / zero
}

impl NoiseMap {
    /// Distance between refinements and the three statistics over Δt.
    pub fn figure(&self) -> Figure {
        let label = |closed_form: f64| vec![Level { name: "closed form".into(), at: closed_form, vertical: false }];
        let statistic = |of: &dyn Fn(&NoisePoint) -> Mean| -> Vec<Series> {
            let one = |map: &NoiseOfMethod| {
                let points = map.points.iter().map(|point| [point.step, of(point).mean]);
                let whisker = |mean: Mean| [mean.mean - 2.0 * mean.error, mean.mean + 2.0 * mean.error];
                let whiskers = map.points.iter().map(|point| whisker(of(point))).collect();
                Series { whiskers, ..Series::new(map.method, points, Stroke::LineAndMarks) }
            };
            self.methods.iter().map(one).collect()
        };
        let apart = |map: &NoiseOfMethod| {
            let points = map.points.iter().filter_map(|point| Some([point.step, point.apart?]));
            Series::new(map.method, points, Stroke::LineAndMarks)
        };
        let plot = |title: &str, y: Axis, series, levels, note: &str| Plot {
            title: title.into(),
            x: Axis::logarithmic("Δt (h)"),
            y,
            series,
            levels,
            marks: Vec::new(),
            note: note.into(),
        };
        let cosine = |label: &str| Axis { range: Some([0.0, 1.0]), ..Axis::linear(label) };
        Figure {
            name: "noise",
            title: "One Brownian path at every step",
            subtitle: "heading noise refined by halves; whiskers: two standard errors",
            plots: vec![
                plot(
                    "the same axon",
                    Axis::logarithmic("distance between tips at Δt and Δt/2 (µm, rms)"),
                    self.methods.iter().map(apart).collect(),
                    Vec::new(),
                    "under a unit pull",
                ),
                plot(
                    "without a pull",
                    cosine("mean cos Δθ"),
                    statistic(&|p| p.free_cosine),
                    label(self.free_cosine),
                    "closed form: exp(−v t / persistence length)",
                ),
                plot(
                    "under a pull",
                    cosine("mean cos β"),
                    statistic(&|p| p.pulled_cosine),
                    label(self.pulled_cosine),
                    "closed form: von Mises, I₁/I₀ of κ/v times the persistence length",
                ),
            ],
        }
    }
}
