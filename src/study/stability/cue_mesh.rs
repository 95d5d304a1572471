//! Map: a cue whose decay length √(D/k) is far below the mesh, eq. (2), from `k h²/D` = 0.1 to 1e4.
//!
//! With release k inside the source the exact concentration lies in [0, 1]; what the discrete one adds to that, below or above, is the
//! mesh's. The P1 matrix keeps the bounds (discrete maximum principle) if every off-diagonal entry is ≤ 0: edge by edge
//! `k (A₁+A₂)/12 ≤ (D/2)(cot α₁ + cot α₂)` with the consistent mass, `0 ≤ cot α₁ + cot α₂` (Delaunay) with the lumped one. Hence
//! consistent: an equilateral mesh keeps them up to k h²/D = 8, a right-angled one never; lumped: both always, an obtuse mesh not,
//! unless its edges are flipped.
//!
//! All lattices have edges of length h along their rows; "obtuse" has the vertices of the equilateral one and the other diagonals
//! (120°, 30°, 30°), once as meshed and once as the solver treats it, which flips edges.

use super::{Figure, logarithmic, unsolved};
use crate::numerics::reaction_diffusion::{Mass, ReactionDiffusion, Source, StationarySolver};
use crate::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};
use crate::record::plot::{Axis, Level, Plot, Series, Stroke};
use crate::study::run::RunError;
use rayon::prelude::*;
use serde::Serialize;

/// Cells along each side of the lattices; h = 1.
const SIDE: usize = 24;
/// Radius of the source, in h.
const RADIUS: f64 = 4.0;

/// One solution.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CuePoint {
    /// k h²/D.
    pub stiffness: f64,
    /// Smallest concentration over q/k; exactly it would be above 0.
    pub smallest: f64,
    /// Largest concentration over q/k, less 1; exactly it would be below 0.
    pub overshoot: f64,
    /// Edges whose entry in the matrix has the wrong sign.
    pub wrong_edges: usize,
}

/// One mesh with one mass.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CueSeries {
    /// `acute`, `right-angled`, `obtuse` or `obtuse, flipped`.
    pub mesh: &'static str,
    /// `consistent` or `lumped`.
    pub mass: &'static str,
    /// The k h²/D from which some edge has the wrong sign; `null` if none.
    pub wrong_sign_from: Option<f64>,
    /// The k h²/D from which there is a concentration below zero by more than round-off; `null` if none.
    pub negative_from: Option<f64>,
    /// Its points.
    pub points: Vec<CuePoint>,
}

/// The map of cues on coarse meshes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CueMeshMap {
    /// One entry a mesh and mass.
    pub series: Vec<CueSeries>,
}

/// A lattice, and which of its edges the solver may flip.
struct Lattice {
    name: &'static str,
    mesh: SimplexMesh<2>,
    source: Vec<u32>,
    /// Regions that are kept whole: every cell by itself where no edge may be flipped.
    regions: Vec<Vec<u32>>,
}

/// Computes the map at `count` values of k h²/D, evenly spread in the logarithm from 0.1 to 1e4.
///
/// # Errors
/// A solve that failed.
pub fn compute(count: usize) -> Result<CueMeshMap, RunError> {
    let mut series = Vec::new();
    for lattice in lattices()? {
        for mass in [Mass::Consistent, Mass::Lumped] {
            series.push(over_stiffness(&lattice, mass, count)?);
        }
    }
    Ok(CueMeshMap { series })
}

fn over_stiffness(lattice: &Lattice, mass: Mass, count: usize) -> Result<CueSeries, RunError> {
    let points: Result<Vec<_>, RunError> =
        logarithmic([0.1, 1e4], count).into_par_iter().map(|stiffness| solve(lattice, mass, stiffness)).collect();
    let points = points?;
    let first = |wrong: &dyn Fn(&CuePoint) -> bool| onset(lattice, mass, &points, wrong);
    Ok(CueSeries {
        mesh: lattice.name,
        mass: if mass == Mass::Lumped { "lumped" } else { "consistent" },
        wrong_sign_from: first(&|point| point.wrong_edges > 0)?,
        negative_from: first(&|point| point.smallest < -1e-12)?,
        points,
    })
}

/// The first k h²/D that is wrong, by bisection between points; the lowest of the map if all are.
fn onset(
    lattice: &Lattice,
    mass: Mass,
    points: &[CuePoint],
    wrong: &dyn Fn(&CuePoint) -> bool,
) -> Result<Option<f64>, RunError> {
    let Some(first) = points.iter().position(wrong) else { return Ok(None) };
    let mut high = points[first].stiffness;
    let Some(before) = first.checked_sub(1) else { return Ok(Some(high)) };
    let mut low = points[before].stiffness;
    while high / low > 1.0 + 1e-6 {
        let middle = (low * high).sqrt();
        if wrong(&solve(lattice, mass, middle)?) { high = middle } else { low = middle }
    }
    Ok(Some((low * high).sqrt()))
}

fn solve(lattice: &Lattice, mass: Mass, stiffness: f64) -> Result<CuePoint, RunError> {
    let law = ReactionDiffusion { diffusion: 1.0, degradation: stiffness, mass };
    let mut solver = StationarySolver::new(&lattice.mesh, &lattice.regions).map_err(unsolved)?;
    let system = solver.system(&law, lattice.mesh.vertices()).map_err(unsolved)?;
    let field = system.solve(&[Source::new(&lattice.source, stiffness)]).map_err(unsolved)?;
    let report = system.edge_report().unwrap_or_default();
    let wrong_edges = match mass {
        Mass::Lumped => report.not_delaunay + report.obtuse_at_border,
        Mass::Consistent => report.consistent_mass,
    };
    Ok(CuePoint {
        stiffness,
        smallest: field.iter().copied().fold(f64::INFINITY, f64::min),
        overshoot: field.iter().copied().fold(f64::NEG_INFINITY, f64::max) - 1.0,
        wrong_edges,
    })
}

fn lattices() -> Result<Vec<Lattice>, RunError> {
    let side = SIDE as f64;
    let lattice = |name, mesh: SimplexMesh<2>, flips: bool| {
        let source = source_cells(&mesh);
        let each_alone = || (0..mesh.cell_count() as u32).map(|cell| vec![cell]).collect();
        let regions = if flips { vec![source.clone()] } else { each_alone() };
        Lattice { name, mesh, source, regions }
    };
    Ok(vec![
        lattice("acute", sheared(false)?, true),
        lattice("right-angled", structured_rectangle(side, side, SIDE, SIDE).map_err(unsolved)?, true),
        lattice("obtuse", sheared(true)?, false),
        lattice("obtuse, flipped", sheared(true)?, true),
    ])
}

/// The equilateral lattice, or the same vertices with the long diagonals.
fn sheared(obtuse: bool) -> Result<SimplexMesh<2>, RunError> {
    let square = structured_rectangle(SIDE as f64, SIDE as f64, SIDE, SIDE).map_err(unsolved)?;
    let vertices = square.vertices().iter().map(|[x, y]| [x + 0.5 * y, 0.75f64.sqrt() * y]).collect();
    // The square (a, b, d, c) comes as (a, b, d), (a, d, c): a–d is its long diagonal once sheared.
    let of_square = |&[a, b, d, _, _, c]: &[u32; 6]| if obtuse { [a, b, d, a, d, c] } else { [a, b, c, b, d, c] };
    let (squares, _) = square.cells().as_chunks::<6>();
    SimplexMesh::new(vertices, squares.iter().flat_map(of_square).collect()).map_err(unsolved)
}

/// The cells whose centroid lies within [`RADIUS`] of the middle of the lattice.
fn source_cells(mesh: &SimplexMesh<2>) -> Vec<u32> {
    let mean = |vertices: &mut dyn Iterator<Item = [f64; 2]>| {
        let (sum, count) = vertices.fold(([0.0; 2], 0.0), |(s, n), x| ([s[0] + x[0], s[1] + x[1]], n + 1.0));
        sum.map(|x| x / count)
    };
    let middle = mean(&mut mesh.vertices().iter().copied());
    let near = |cell: &u32| {
        let centroid = mean(&mut mesh.cell(*cell as usize).iter().map(|&v| mesh.vertices()[v as usize]));
        (centroid[0] - middle[0]).hypot(centroid[1] - middle[1]) < RADIUS
    };
    (0..mesh.cell_count() as u32).filter(near).collect()
}

impl CueMeshMap {
    /// Smallest concentration and overshoot over k h²/D.
    pub fn figure(&self) -> Figure {
        let plot = |title: &str, label: &str, of: &dyn Fn(&CuePoint) -> f64, levels, note: &str| Plot {
            title: title.into(),
            x: Axis::logarithmic("k h²/D"),
            y: Axis::linear(label),
            series: self
                .series
                .iter()
                .map(|map| {
                    let stroke = if map.mass == "lumped" { Stroke::Dashed } else { Stroke::Line };
                    let points = map.points.iter().map(|point| [point.stiffness, of(point)]);
                    Series::new(format!("{}, {}", map.mesh, map.mass), points, stroke)
                })
                .collect(),
            levels,
            marks: Vec::new(),
            note: note.into(),
        };
        let eight = Level { name: "8".into(), at: 8.0, vertical: true };
        Figure {
            name: "cue_mesh",
            title: "A cue that decays within a cell",
            subtitle: "release over a disc of radius 4 h; exact values lie between 0 and 1",
            plots: vec![
                plot(
                    "below zero",
                    "smallest c k/q",
                    &|point| point.smallest,
                    vec![eight],
                    "up to 8 the consistent mass is safe on equilateral cells",
                ),
                plot(
                    "above the source's plateau",
                    "largest c k/q − 1",
                    &|point| point.overshoot,
                    Vec::new(),
                    "lumped mass on a Delaunay mesh: none of either",
                ),
            ],
        }
    }
}
