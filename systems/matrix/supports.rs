//! Which way the edges of a tissue face, and how one is held that no edge holds.

use crate::numerics::grown::Growth;
use crate::numerics::hyperelasticity::Prescribed;
use crate::prelude::*;

/// Holds the vertex nearest to the middle, and keeps the one farthest from it from turning about it: one component of it moves as it
/// would if all cells grew by the mean factor.
pub fn hold_the_middle(rest: &[[f64; 2]], growth: &Growth, prescribed: &mut Prescribed<2>) {
    let mean = |k: usize| rest.iter().map(|x| x[k]).sum::<f64>() / rest.len() as f64;
    let distance = |from: [f64; 2], v: usize| (rest[v][0] - from[0]).hypot(rest[v][1] - from[1]);
    let middle = [mean(0), mean(1)];
    let nearest = (0..rest.len()).min_by(|&a, &b| distance(middle, a).total_cmp(&distance(middle, b)));
    let Some(nearest) = nearest else { return };
    prescribed.impose_all(nearest, [0.0; 2]);
    let held = rest[nearest];
    let farthest = (0..rest.len()).max_by(|&a, &b| distance(held, a).total_cmp(&distance(held, b)));
    if let Some(farthest) = farthest {
        let arm = [rest[farthest][0] - held[0], rest[farthest][1] - held[1]];
        let component = usize::from(arm[0].abs() >= arm[1].abs());
        prescribed.impose(farthest, component, (growth.mean() - 1.0) * arm[component]);
    }
}

/// Mean outward unit normal of an edge at rest, and the tissue's extent (µm) in that direction.
pub fn outward_normal(tissue: &Tissue, edge: usize) -> ([f64; 2], f64) {
    let rest = tissue.mesh.vertices();
    let mut sum = [0.0; 2];
    for facet in &tissue.edges[edge] {
        let ends: Vec<_> = tissue.mesh.facet_vertices(*facet).map(|v| rest[v as usize]).collect();
        sum = [sum[0] + ends[1][1] - ends[0][1], sum[1] + ends[0][0] - ends[1][0]];
    }
    let norm = sum[0].hypot(sum[1]).max(f64::MIN_POSITIVE);
    let normal = sum.map(|x| x / norm);
    let heights = rest.iter().map(|x| x[0] * normal[0] + x[1] * normal[1]);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    (normal, high - low)
}

/// The axis that a unit vector lies along, if any.
pub fn axis_of(normal: [f64; 2]) -> Option<usize> {
    (0..2).find(|&k| (normal[k].abs() - 1.0).abs() < 1e-9)
}
