//! What the index is expected to hold and to cost, for the plan.

use super::places::BYTES_A_BLOCK;
use super::squares::Listed;
use super::{Entry, PART, Search};
use crate::model::shafts::BLOCK;
use crate::prelude::*;
use crate::systems::matrix::Loading;
use rstar::RTreeNode;

/// Parts of lists that a stored vertex takes, with the room in them. Ours, measured.
const LISTED: f64 = 4.0;
/// Room in the nodes of the tree over what stands in them. Ours, measured.
const SLACK: f64 = 1.5;

/// Says what the index holds and what looking `reach` far (µm) costs.
pub(super) fn tell(model: &mut ModelBuilder, reach: f64, search: Search) {
    let entries = match search {
        Search::All => 0.0,
        Search::Grid => LISTED * size_of::<Listed>() as f64,
        Search::Tree => SLACK * size_of::<RTreeNode<Entry>>() as f64,
    };
    let bytes = entries + BYTES_A_BLOCK as f64 / BLOCK as f64;
    let is_bounded = model.world.get_resource::<Loading>().is_none_or(Loading::is_bounded);
    let looked_at = if is_bounded { 0 } else { model.world.resource::<Tissue>().mesh.cell_count() };
    let even = evenly_spread(model.world, reach);
    let mut plan = model.plan();
    plan.hold(PART, bytes, Each::ShaftVertex);
    plan.work(PART, Work::Indexed, 1.0, Each::ShaftVertex);
    plan.work(PART, Work::DeformedCell, looked_at as f64, Each::Stage);
    plan.work(PART, Work::Neighbourhood, 1.0, Each::ConeStage);
    plan.work(PART, Work::EvenSegment, even, Each::ConeStage);
}

/// Even neighbours from which on axons that grow abreast are drawn into bundles, and how many times denser these become at most. Ours, measured.
const BUNDLING: (f64, f64) = (4.2, 3.0);

/// Segments within a square of half side `reach` (µm) about a cone, if half of the way of all axons lay before it and were evenly spread
/// over the longer side of the box of all births, widened by the reach, times its shorter side and the way of one axon; and more where many
/// grow abreast, which gather in bundles.
fn evenly_spread(world: &World, reach: f64) -> f64 {
    let mut origins = world.try_query_filtered::<&Site, With<GrowthCone>>();
    let tissue = world.resource::<Tissue>();
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for origin in origins.iter_mut().flat_map(|origins| origins.iter(world)) {
        let at = tissue.reference_position(*origin);
        (low, high) = (low.inf(&at), high.sup(&at));
    }
    let shafts = world.resource::<Shafts>();
    let clock = world.resource::<Clock>();
    let fastest = world.resource::<Populations>().0.iter().map(|population| population.speed).fold(0.0, f64::max);
    let (extent, way) = (high - low, fastest * clock.grid.hours(clock.end));
    let (width, depth) = (extent.max().max(0.0) + 2.0 * reach, extent.x.min(extent.y).max(0.0));
    let abreast = if way > 0.0 { way / (depth + way) } else { 1.0 };
    let even = 0.5 * shafts.count() as f64 / width * (2.0 * reach).powi(2) / shafts.mean_segment() * abreast;
    even * (1.0 + abreast * ((even / BUNDLING.0).clamp(1.0, BUNDLING.1) - 1.0))
}
