//! Where the methods fail, and what the program does then: one map a file, each a set of numbers and a figure.
//!
//! | map | fails | what the program does |
//! |---|---|---|
//! | [`turning`] | explicit integrators beyond κΔt = 2 and 2.785 | a note; `rotation` is the default |
//! | [`cue_mesh`] | concentrations below zero on coarse or obtuse meshes | lumped mass, flips; else a note, and zero is sensed |
//! | [`stretched_mesh`] | a stretched mesh is no longer Delaunay | edges are flipped for the field, with a note |
//! | [`compression`] | St. Venant–Kirchhoff in compression | a typed error with load, cell, stretch; `neo_hookean` goes on |
//! | [`degenerate`] | scenes at the rim of what makes sense | each ends, or is refused with its place |
//! | [`noise`] | (nothing should) | one Brownian path at every step |

pub mod compression;
mod compression_figure;
pub mod constant_pull;
pub mod cue_mesh;
pub mod degenerate;
mod degenerate_figure;
pub mod degenerate_scenes;
pub mod noise;
pub mod stretched_mesh;
pub mod turning;

use super::run::{RunError, write_json, write_picture};
use crate::model::mechanism::Roster;
use crate::record::plot::{Plot, draw};
use serde::Serialize;
use std::path::Path;

/// All maps: `stability.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stability {
    /// Integrators of the turning law.
    pub turning: turning::TurningMap,
    /// Cues on coarse meshes.
    pub cue_mesh: cue_mesh::CueMeshMap,
    /// Cues on a stretched mesh.
    pub stretched_mesh: stretched_mesh::StretchMap,
    /// The matrix in compression.
    pub compression: compression::CompressionMap,
    /// Degenerate scenes.
    pub degenerate: degenerate::DegenerateMap,
    /// Refinement of noise.
    pub noise: noise::NoiseMap,
}

/// The figure of one map.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its files, without ending.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// A line below the title.
    pub subtitle: &'static str,
    /// Its plots.
    pub plots: Vec<Plot>,
}

/// The roster with the pull that integrators are exercised with.
pub fn with_constant_pull(roster: &Roster) -> Roster {
    roster.clone().with::<constant_pull::ConstantPull>()
}

impl Stability {
    /// Computes all maps with the mechanisms of a roster; `tick` is called with the share done.
    ///
    /// # Errors
    /// Something that the maps themselves need could not be solved. What is *meant* to fail is a result.
    pub fn compute(roster: &Roster, tick: impl Fn(f64)) -> Result<Self, RunError> {
        let roster = with_constant_pull(roster);
        let done = |maps: u8| tick(f64::from(maps) / 6.0);
        let turning = turning::compute(&roster, 81)?;
        done(1);
        let cue_mesh = cue_mesh::compute(41)?;
        done(2);
        let stretched_mesh = stretched_mesh::compute(15)?;
        done(3);
        let compression = compression::compute(&compression::Effort::full())?;
        done(4);
        let degenerate = degenerate::compute(&roster);
        done(5);
        let noise = noise::compute(&roster, 400)?;
        done(6);
        Ok(Self { turning, cue_mesh, stretched_mesh, compression, degenerate, noise })
    }

    /// The figures, one a map.
    pub fn figures(&self) -> Vec<Figure> {
        vec![
            self.turning.figure(),
            self.cue_mesh.figure(),
            self.stretched_mesh.figure(),
            self.compression.figure(),
            self.degenerate.figure(),
            self.noise.figure(),
        ]
    }

    /// Writes `stability.json` and for each map its figure as SVG and PNG into `folder`.
    ///
    /// # Errors
    /// The file that could not be written, or the figure that could not be drawn.
    pub fn write(&self, folder: &Path) -> Result<(), RunError> {
        write_json(&folder.join("stability.json"), self)?;
        for Figure { name, title, subtitle, plots } in self.figures() {
            write_picture(folder, name, &draw(title, subtitle, &plots)?)?;
        }
        Ok(())
    }
}

/// `count` ≥ 2 values from the first of `ends` to the last, evenly spread in the logarithm.
pub fn logarithmic(ends: [f64; 2], count: usize) -> Vec<f64> {
    let [low, high] = ends.map(f64::ln);
    let last = (count.max(2) - 1) as f64;
    (0..count.max(2)).map(|i| (low + (high - low) * i as f64 / last).exp()).collect()
}

/// Something that a map needs could not be solved.
fn unsolved(error: impl std::fmt::Display) -> RunError {
    RunError::Solve(error.to_string())
}
