//! `tropism chart SCENE`: error against time for every choice that a scene offers, one factor at a time and then
//! together.
//!
//! Every choice is a scenario key, so a chart is a set of variants of one scene: each is put together (and run, where that is
//! what costs), timed several times in one process, and compared with a reference far finer than the rest, whose own error is
//! estimated and drawn as a floor.

mod cones;
mod cue_field;
mod matrix;
mod neighbours;
pub mod report;
mod together;
mod whole_scene;
pub mod work_precision;

use super::laboratory::Laboratory;
use super::run::RunError;
use work_precision::Factor;

/// Names of the factors, as `--only` takes them.
pub const FACTORS: [&str; 6] = ["cue_field", "matrix", "cones", "neighbours", "together", "whole_scene"];

/// Error against time for the choices of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Name of the scene.
    pub scene: String,
    /// Threads that worked.
    pub threads: usize,
    /// How often each setting was timed.
    pub repetitions: usize,
    /// The choices.
    pub factors: Vec<Factor>,
}

/// Measures the named factors (all of [`FACTORS`] if none is named); those that the scene has no use for are left out.
///
/// # Errors
/// A scene that cannot be assembled or run.
pub fn chart(laboratory: &Laboratory, only: &[String], tick: &dyn Fn(f64)) -> Result<Chart, RunError> {
    let wanted: Vec<&str> =
        FACTORS.into_iter().filter(|name| only.is_empty() || only.iter().any(|o| o == name)).collect();
    let mut factors: Vec<Factor> = Vec::new();
    for (done, name) in wanted.iter().enumerate() {
        let tick = |share: f64| tick((done as f64 + share) / wanted.len() as f64);
        match *name {
            "cue_field" => factors.extend(cue_field::chart(laboratory, &tick)?),
            "matrix" => factors.extend(matrix::charts(laboratory, &tick)?),
            "cones" => factors.extend(cones::charts(laboratory, &tick)?),
            "neighbours" => factors.extend(neighbours::chart(laboratory, &tick)?),
            "together" => factors.extend(together::chart(laboratory, &tick)?),
            _ => factors.push(whole_scene::chart(laboratory, &tick)?),
        }
    }
    for factor in factors.iter_mut().filter(|factor| factor.advice.is_empty()) {
        factor.advice = factor.errors.first().map(|error| factor.choice(error)).unwrap_or_default();
    }
    let (threads, repetitions) = (rayon::current_num_threads(), laboratory.repetitions);
    Ok(Chart { scene: laboratory.scene()?.scene.name, threads, repetitions, factors })
}
