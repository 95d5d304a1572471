//! How fast this machine is now: a fixed piece of the program's own work, timed.
//!
//! A mesh with a cue solved on it, and headings that turn on their way: what cells and cones take, in parts that are alike. The piece is
//! small, so it tells little of how fast memory is.

use crate::model::stopwatch::Elapsed;
use crate::numerics::planar_domain::{Outline, PlanarDomain};
use crate::numerics::reaction_diffusion::{Mass, ReactionDiffusion, Source, StationarySolver};
use crate::numerics::triangulate::{MeshOptions, triangulate};
use crate::numerics::turning::{integral_of_turn, turn};
use nalgebra::Vector3;
use std::hint::black_box;

/// Seconds of the piece on the reference machine, of which the nanoseconds in [`seconds`](super::seconds) are.
const REFERENCE: f64 = 0.009;
/// How often it is timed, and which of the times counts, the shortest being 0: what others do meanwhile makes some of them longer.
const REPETITIONS: usize = 12;
const COUNTED: usize = 2;
/// Turns of headings.
const TURNS: usize = 40_000;

/// Seconds that this machine takes for what takes the reference machine one, on one thread; none if there is no telling.
pub fn pace() -> Option<f64> {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
    alone.install(|| {
        let (whole, used) = (Elapsed::default(), own_seconds());
        let mut seconds: Vec<f64> = (0..REPETITIONS).map(|_| timed()).collect::<Option<_>>()?;
        seconds.sort_by(f64::total_cmp);
        // Others may have had the processor meanwhile.
        let share = used.and_then(|before| Some((own_seconds()? - before) / whole.seconds()));
        Some(seconds[COUNTED] * share.unwrap_or(1.0).min(1.0) / REFERENCE)
    })
}

/// Seconds of processor time that this thread has used, where the system tells.
fn own_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(1e-9 * text.split(' ').next()?.parse::<f64>().ok()?)
}

fn timed() -> Option<f64> {
    let time = Elapsed::default();
    black_box(field()?);
    black_box(turned());
    Some(time.seconds())
}

/// A cue around a disc in a square, 1.15 · 50² vertices.
fn field() -> Option<Vec<f64>> {
    let disc = Outline::disc([0.5, 0.5], 0.1, 0.02);
    let fitted = triangulate(&PlanarDomain::rectangle(1.0, 1.0), &[disc], &MeshOptions::of_size(0.02)).ok()?;
    let law = ReactionDiffusion { diffusion: 1.0, degradation: 100.0, mass: Mass::Lumped };
    let sources = [Source::new(&fitted.regions[0], 100.0)];
    let mut solver = StationarySolver::new(&fitted.mesh, &fitted.regions).ok()?;
    solver.solve(&law, fitted.mesh.vertices(), &sources).ok()
}

/// A place that a heading has led to, turning after one pull and another.
fn turned() -> Vector3<f64> {
    let (mut heading, mut place) = (Vector3::x(), Vector3::zeros());
    for i in 0..TURNS {
        let angle = 0.1 * i as f64;
        let pull = Vector3::new(angle.cos(), angle.sin(), 0.0);
        place += integral_of_turn(&heading, &pull, 1.0, 0.05);
        heading = turn(&heading, &pull, 0.05);
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_piece_does_what_it_says() {
        let field = field().unwrap();
        assert!((2500..4000).contains(&field.len()) && field.iter().all(|c| c.is_finite()));
        assert!(turned().norm().is_finite());
        assert!(pace().unwrap() > 0.0);
    }
}
