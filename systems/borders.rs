//! Short-range repulsion along the borders, which keeps axons inside.
//!
//! The paper: "along the borders short-range repulsive cues are used to keep axons confined". Ours: its form,
//! B = Σ over named edges of n_in exp(−d / ℓ_b), d the distance to the edge's nearest point and n_in the unit vector from that
//! point to the cone; each edge counts once, however many segments it has, and no PDE is solved for it. A pull alone cannot
//! confine: a cone that meets the wall at less than the angle of [`escape_angle`] from its normal crosses, and then
//! `on_border` decides.

use crate::numerics::simplex_mesh::BorderFacet;
use crate::prelude::*;
use nalgebra::Vector2;
use std::ops::Range;

keys! {
    /// Short-range repulsion along the borders; L̂ += λ_b Σ_edges n_in exp(−d/ℓ_b).
    pub struct Borders {
        /// Strength λ_b of the pull at the border. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 8.0]))]
        pub weight: Factor = Factor(4.0),
        /// Range ℓ_b over which it decays. Ours; the paper says "short".
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [2.0, 20.0]))]
        pub range: Length = Length(5.0),
    }
}

impl Mechanism for Borders {
    const NAME: &'static str = "borders";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        let turning_rate = model.world.resource::<Growth>().turning_rate;
        let fastest = model.world.resource::<Populations>().0.iter().map(|p| p.speed).fold(0.0, f64::max);
        let angle = escape_angle(turning_rate, self.weight.0, self.range.0, fastest).to_degrees();
        model.plan().keep(
            "borders",
            format!("cones that come within {angle:.1} deg of a border's normal reach it; then `on_border` decides"),
        );
        // Two edges at a corner.
        model.pulls_up_to(2.0 * self.weight.0);
        let facets = model.world.resource::<Tissue>().mesh.border().len();
        model.plan().work(Self::NAME, Work::BorderFacet, facets as f64, Each::ConeStage);
        model.insert(EdgeBoxes::default()).insert_law(self);
        model.term(Term::Contact, (bound_edges, repel).chain());
        Ok(())
    }
}

/// Beyond this many ranges a border adds less than the rounding of a pull of 1, and is left out.
const RANGES: f64 = 40.0;

/// Where the edges are in the present configuration, or in the part of a path that it belongs to.
#[derive(Debug, Default, Resource)]
struct EdgeBoxes {
    holds: Option<Holds>,
    edges: Vec<EdgeBox>,
}

/// For how long boxes hold.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Holds {
    Revision(u64),
    Part(usize),
}

type Bounds = [[f64; 2]; 2];

/// Bounding box of a named edge, and of each run of so many of its facets; the ends of these, where all vertices are at hand.
#[derive(Debug)]
struct EdgeBox {
    whole: Bounds,
    runs: Vec<Bounds>,
    ends: Option<Vec<Ends>>,
}

/// Both ends of a facet (µm), with the tissue to their left.
type Ends = [Vector2<f64>; 2];

/// Facets of a run.
const RUN: usize = 8;

/// Largest angle (rad) between a cone's heading and the wall's normal at which it still crosses:
/// sin θ = exp(−κ λ_b ℓ_b / v). Turning rate κ in 1/h, range in µm, speed in µm/h.
pub fn escape_angle(turning_rate: f64, weight: f64, range: f64, speed: f64) -> f64 {
    (-turning_rate * weight * range / speed).exp().asin()
}

fn bound_edges(tissue: Res<Tissue>, configuration: Res<Configuration>, mut boxes: ResMut<EdgeBoxes>) {
    let holds = configuration.part().map_or(Holds::Revision(configuration.revision), Holds::Part);
    if boxes.holds == Some(holds) {
        return;
    }
    boxes.holds = Some(holds);
    let of_edge = |facets: &Vec<BorderFacet>| {
        let runs: Vec<_> = facets.chunks(RUN).map(|run| bounding_box(&tissue, &configuration, run)).collect();
        let ends = || facets.iter().map(|facet| facet_ends(&tissue, &configuration, *facet)).collect();
        let at_hand = configuration.part().is_none();
        EdgeBox { whole: runs.iter().copied().fold(NOWHERE, both), runs, ends: at_hand.then(ends) }
    };
    boxes.edges = tissue.edges.iter().map(of_edge).collect();
}

/// The box about nothing.
const NOWHERE: Bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];

/// The box about two.
fn both(a: Bounds, b: Bounds) -> Bounds {
    [[0, 1].map(|k| a[0][k].min(b[0][k])), [0, 1].map(|k| a[1][k].max(b[1][k]))]
}

fn bounding_box(tissue: &Tissue, configuration: &Configuration, facets: &[BorderFacet]) -> Bounds {
    let vertices = facets.iter().flat_map(|facet| tissue.mesh.facet_vertices(*facet));
    vertices.map(|vertex| configuration.range(vertex as usize)).fold(NOWHERE, both)
}

fn repel(
    law: Res<Law<Borders>>,
    tissue: Res<Tissue>,
    configuration: Res<Configuration>,
    boxes: Res<EdgeBoxes>,
    mut cones: Cones,
) {
    let (weight, range) = (law.weight.0, law.range.0);
    cones.for_each(|cone, spring| {
        let x = cone.position.xy();
        for (facets, edge) in tissue.edges.iter().zip(&boxes.edges) {
            if squared_distance_to_box(x, &edge.whole) < (RANGES * range).powi(2) {
                let pull = match &edge.ends {
                    Some(ends) => edge_pull(&edge.runs, (facets.len(), |i| ends[i]), x, range),
                    None => {
                        let ends = |i: usize| facet_ends(&tissue, &configuration, facets[i]);
                        edge_pull(&edge.runs, (facets.len(), ends), x, range)
                    }
                };
                spring.pull += Vector3::new(pull.x, pull.y, 0.0) * weight;
            }
        }
    });
}

fn squared_distance_to_box(x: Vector2<f64>, bounds: &Bounds) -> f64 {
    let outside = |k: usize| (bounds[0][k] - x[k]).max(x[k] - bounds[1][k]).max(0.0);
    outside(0).powi(2) + outside(1).powi(2)
}

/// From the nearest point of a facet to x.
#[inline]
fn from_facet([a, b]: Ends, x: Vector2<f64>) -> Vector2<f64> {
    let share = ((x - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    x - (a + (b - a) * share)
}

/// Of the first facet that is nearest to x: squared distance (µm²) and number.
#[inline]
fn nearest_of(facets: Range<usize>, ends: &impl Fn(usize) -> Ends, x: Vector2<f64>) -> (f64, usize) {
    let mut best = (f64::INFINITY, facets.start);
    for i in facets {
        let squared = from_facet(ends(i), x).norm_squared();
        best = if squared < best.0 { (squared, i) } else { best };
    }
    best
}

/// n_in exp(−d/ℓ) of an edge of so many facets at x: n_in from the edge's nearest point to x (the facet's inner normal on the edge itself).
fn edge_pull(
    runs: &[Bounds],
    (count, ends): (usize, impl Fn(usize) -> Ends),
    x: Vector2<f64>,
    range: f64,
) -> Vector2<f64> {
    let facets = |run: usize| run * RUN..count.min((run + 1) * RUN);
    let bounded = runs.iter().map(|bounds| squared_distance_to_box(x, bounds));
    let closest = bounded.clone().zip(0..).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, run)| run);
    let found = nearest_of(facets(closest), &ends, x);
    let mut best = (f64::INFINITY, 0);
    for (run, squared) in bounded.enumerate() {
        // A hair less than the distance to the box, for rounding: what is skipped is not the nearest.
        if squared * (1.0 - 1e-9) <= found.0 {
            let other = if run == closest { found } else { nearest_of(facets(run), &ends, x) };
            best = if other.0 < best.0 { other } else { best };
        }
    }
    let (nearest, facet) = best;
    if nearest >= (RANGES * range).powi(2) {
        return Vector2::zeros();
    }
    let (distance, [a, b]) = (nearest.sqrt(), ends(facet));
    let along = b - a;
    let inward =
        if distance > 0.0 { from_facet([a, b], x) / distance } else { Vector2::new(-along.y, along.x).normalize() };
    inward * (-distance / range).exp()
}

fn facet_ends(tissue: &Tissue, configuration: &Configuration, facet: BorderFacet) -> Ends {
    let corners = tissue.mesh.cell(facet.cell as usize);
    [1, 2].map(|k| configuration.vertex(corners[(facet.face as usize + k) % 3] as usize).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_escape_angle_at_the_defaults_is_the_one_the_model_states() {
        let degrees = escape_angle(0.93, 4.0, 5.0, 20.0).to_degrees();
        assert!((degrees - 23.0).abs() < 0.5, "{degrees}");
        assert_eq!(escape_angle(0.93, 0.0, 5.0, 20.0).to_degrees(), 90.0);
    }
}
