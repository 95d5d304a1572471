//! The load path of the matrix over the run: where the tissue is at a time.

use super::LoadCurve;
use crate::model::configuration::along_path;
use crate::numerics::load_path::LoadPath;
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::prelude::*;
use std::sync::Arc;

/// What is solved before the run, and shared by runs whose tissue and matrix are equal.
#[derive(Debug)]
pub(super) struct Equilibria {
    pub path: LoadPath,
    /// Share of ellipticity that the largest load uses up.
    pub used: f64,
    /// Unknowns of a solve.
    pub unknowns: usize,
    /// Bounds of ‖F⁻¹‖₂ for each part of the path, if certainly no cell is ever turned over.
    pub inverse_stretches: Option<Vec<f64>>,
}

/// Instants of the run at which the tissue's area is looked at for the plan.
const INSTANTS: u32 = 4;

/// The solved load path, and the load over time.
#[derive(Debug, Resource)]
pub struct Loading {
    pub(super) equilibria: Arc<Equilibria>,
    pub(super) inputs: String,
    pub(super) curve: LoadCurve,
    pub(super) duration: f64,
}

impl Loading {
    /// The path of equilibria over the load.
    pub fn path(&self) -> &LoadPath {
        &self.equilibria.path
    }

    /// Whether it is known how far the tissue is pressed together in each part of the path.
    pub fn is_bounded(&self) -> bool {
        self.equilibria.inverse_stretches.is_some()
    }

    /// Tissue and matrix that decide the path, as text.
    pub fn inputs(&self) -> &str {
        &self.inputs
    }

    /// Load s and its rate ṡ (1/h) at a time (h); at a corner of the curve the rate is that of the piece before.
    pub fn at(&self, time: f64) -> (f64, f64) {
        let LoadCurve { times, loads } = &self.curve;
        if times.is_empty() {
            return (time / self.duration, 1.0 / self.duration);
        }
        let piece = times.partition_point(|t| t.0 < time);
        if piece == 0 || piece == times.len() {
            return (loads[piece.min(times.len() - 1)].0, 0.0);
        }
        let (start, end) = (times[piece - 1].0, times[piece].0);
        let rate = (loads[piece].0 - loads[piece - 1].0) / (end - start);
        (loads[piece - 1].0 + rate * (time - start), rate)
    }

    /// Times at which the rate of the load jumps (h).
    pub fn kinks(&self) -> Vec<f64> {
        self.curve.times.iter().map(|time| time.0).collect()
    }

    /// Coordinates (µm) and velocities (µm/h) at a time (h); at a corner of the load curve those of the piece before.
    pub fn motion(&self, mesh: &Arc<SimplexMesh<2>>, time: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        along_path(mesh, self.path().path(), self.at(time))
    }

    /// Area over area at rest, minus 1, in the mean over the run.
    pub(super) fn swelling(&self, mesh: &Arc<SimplexMesh<2>>) -> f64 {
        let area = |coordinates: &[[f64; 2]]| -> f64 {
            (0..mesh.cell_count()).map(|cell| mesh.volume(coordinates, cell)).sum()
        };
        let instants = (0..INSTANTS).map(|i| (f64::from(i) + 0.5) / f64::from(INSTANTS) * self.duration);
        let areas: f64 = instants.map(|time| area(&self.configuration(mesh, self.at(time).0).0)).sum();
        areas / f64::from(INSTANTS) / area(mesh.vertices()) - 1.0
    }

    /// Coordinates (µm) and their derivative with respect to the load, at a load.
    pub fn configuration(&self, mesh: &Arc<SimplexMesh<2>>, load: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        along_path(mesh, self.path().path(), (load, 1.0))
    }
}

/// Brings the configuration to the stage time.
pub(super) fn follow_load(
    stage: Res<StageTime>,
    tissue: Res<Tissue>,
    loading: Res<Loading>,
    mut configuration: ResMut<Configuration>,
) {
    if configuration.revision > 0 && configuration.time == stage.0 {
        return;
    }
    let (load, rate) = loading.at(stage.0);
    configuration.time = stage.0;
    if configuration.revision > 0 && configuration.load == load && configuration.load_rate == rate {
        return;
    }
    let Equilibria { path, inverse_stretches, .. } = &*loading.equilibria;
    configuration.follow(&tissue.mesh, (path.path(), inverse_stretches.as_deref()), (load, rate));
}
