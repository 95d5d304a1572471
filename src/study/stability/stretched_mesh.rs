//! Map: the tissue's mesh after a large stretch.
//!
//! A mesh that is Delaunay at rest is stretched homogeneously as the matrix would be with free sides (ν = 0.3): by λ along and by
//! √(1 − ν/(1−ν)(λ²−1)) across, upward as in the paper or sideways. The rows of the mesh lie along x: pulled upward its triangles
//! grow tall and stay acute but for those around sources; pulled sideways they grow flat. Where the angles facing an edge come to more than 180° the lumped matrix loses the sign that keeps
//! c ≥ 0. Remedy: edges are flipped for the diffusion matrix, vertices stay; edges of source outlines are not flipped.

use super::{Figure, unsolved};
use crate::numerics::delaunay::{Triangles, region_labels};
use crate::numerics::planar_domain::{Outline, PlanarDomain};
use crate::numerics::reaction_diffusion::{Mass, ReactionDiffusion, Source, StationarySolver};
use crate::numerics::triangulate::{FittedMesh, MeshOptions, smallest_angle, triangulate};
use crate::record::plot::{Axis, Level, Plot, Series, Stroke};
use crate::study::run::RunError;
use rayon::prelude::*;
use serde::Serialize;

/// Poisson's ratio.
const POISSON: f64 = 0.3;
/// Mesh size (µm).
const SIZE: f64 = 20.0;
/// Diffusion (µm²/h) and degradation (1/h): a decay length of 10 µm, half the mesh size.
const LAW: ReactionDiffusion = ReactionDiffusion { diffusion: 360.0, degradation: 3.6, mass: Mass::Lumped };

/// The mesh at one stretch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StretchPoint {
    /// Stretch λ.
    pub stretch: f64,
    /// Stretch across.
    pub across: f64,
    /// Smallest angle of a cell (degrees).
    pub smallest_angle: f64,
    /// Share of the interior edges that are not Delaunay.
    pub not_delaunay: f64,
    /// The same after flips; what is left lies on the outlines of sources.
    pub not_delaunay_after_flips: f64,
    /// Edges flipped.
    pub flips: usize,
    /// Smallest lumped concentration over q/k without flips.
    pub smallest_without_flips: f64,
    /// Smallest lumped concentration over q/k as the program computes it.
    pub smallest: f64,
}

/// The map of the stretched mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StretchMap {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Interior edges of the mesh.
    pub edges: usize,
    /// One point a stretch upward.
    pub upward: Vec<StretchPoint>,
    /// One point a stretch sideways.
    pub sideways: Vec<StretchPoint>,
}

/// Computes the map at `count` stretches, evenly spread from 1 to 1.7.
///
/// # Errors
/// A mesh or a solve that failed.
pub fn compute(count: usize) -> Result<StretchMap, RunError> {
    let domain = PlanarDomain::rectangle(800.0, 600.0);
    let outlines = [Outline::disc([400.0, 500.0], 50.0, SIZE)];
    let fitted = triangulate(&domain, &outlines, &MeshOptions::of_size(SIZE)).map_err(unsolved)?;
    let at = |i: usize| 1.0 + 0.7 * i as f64 / (count.max(2) - 1) as f64;
    let along = |axis: usize| -> Result<Vec<StretchPoint>, RunError> {
        (0..count.max(2)).into_par_iter().map(|i| point(&fitted, at(i), axis)).collect()
    };
    let edges = Triangles::of(&fitted.mesh).edge_report(fitted.mesh.vertices(), 1.0, 0.0).interior;
    Ok(StretchMap { vertices: fitted.mesh.vertex_count(), edges, upward: along(1)?, sideways: along(0)? })
}

/// Stretch across a stretch λ with free sides.
fn across(stretch: f64) -> f64 {
    (1.0 - POISSON / (1.0 - POISSON) * (stretch * stretch - 1.0)).sqrt()
}

fn point(fitted: &FittedMesh, stretch: f64, axis: usize) -> Result<StretchPoint, RunError> {
    let (mesh, across) = (&fitted.mesh, across(stretch));
    let factor = |k: usize| if k == axis { stretch } else { across };
    let now: Vec<[f64; 2]> = mesh.vertices().iter().map(|[x, y]| [factor(0) * x, factor(1) * y]).collect();
    let mut triangles = Triangles::of(mesh);
    let share = |triangles: &Triangles| {
        let report = triangles.edge_report(&now, 1.0, 0.0);
        report.not_delaunay as f64 / report.interior as f64
    };
    let not_delaunay = share(&triangles);
    let flips = triangles.flip_to_delaunay(&now, &region_labels(mesh.cell_count(), &fitted.regions));
    let smallest = |regions: &[Vec<u32>]| {
        let sources = [Source::new(&fitted.regions[0], LAW.degradation)];
        let mut solver = StationarySolver::new(mesh, regions).map_err(unsolved)?;
        let field = solver.solve(&LAW, &now, &sources).map_err(unsolved)?;
        Ok::<f64, RunError>(field.into_iter().fold(f64::INFINITY, f64::min))
    };
    // Cells of different regions are never flipped: each by itself, and the mesh stays as it is.
    let each_alone: Vec<Vec<u32>> = (0..mesh.cell_count() as u32).map(|cell| vec![cell]).collect();
    Ok(StretchPoint {
        stretch,
        across,
        smallest_angle: smallest_angle(mesh, &now).to_degrees(),
        not_delaunay,
        not_delaunay_after_flips: share(&triangles),
        flips,
        smallest_without_flips: smallest(&each_alone)?,
        smallest: smallest(&fitted.regions)?,
    })
}

impl StretchMap {
    /// Edges that lose the sign, and the smallest concentration, over the stretch.
    pub fn figure(&self) -> Figure {
        let over = |of: &dyn Fn(&StretchPoint) -> [f64; 2]| {
            let line = |name: &str, stroke, points: &[StretchPoint], which: usize| {
                Series::new(name, points.iter().map(|point| [point.stretch, of(point)[which]]), stroke)
            };
            vec![
                line("upward, as meshed", Stroke::LineAndMarks, &self.upward, 0),
                line("upward, after flips", Stroke::Dashed, &self.upward, 1),
                line("sideways, as meshed", Stroke::LineAndMarks, &self.sideways, 0),
                line("sideways, after flips", Stroke::Dashed, &self.sideways, 1),
            ]
        };
        let paper = || vec![Level { name: "20 % a side".into(), at: 1.4, vertical: true }];
        let plot = |title: &str, label: &str, series, note: &str| Plot {
            title: title.into(),
            x: Axis::linear("stretch λ"),
            y: Axis::linear(label),
            series,
            levels: paper(),
            marks: Vec::new(),
            note: note.into(),
        };
        Figure {
            name: "stretched_mesh",
            title: "The tissue's mesh after a large stretch",
            subtitle: "stretched by λ with free sides, ν = 0.3",
            plots: vec![
                plot(
                    "edges that are not Delaunay",
                    "share of the interior edges (%)",
                    over(&|p| [100.0 * p.not_delaunay, 100.0 * p.not_delaunay_after_flips]),
                    "what flips leave lies on source outlines",
                ),
                plot(
                    "lumped concentration",
                    "smallest c k/q",
                    over(&|p| [p.smallest_without_flips, p.smallest]),
                    "decay length: half the mesh size",
                ),
            ],
        }
    }
}
