//! `summary.json`: what came out, and what it cost.

use super::measures::{MeasureOptions, Morphology, Tally};
use super::snapshot::{arrivals, each_axon, extent_in_y, tips};
use crate::model::clock::Clock;
use crate::model::components::{GrowthCone, Journey, Status};
use crate::model::configuration::Configuration;
use crate::model::growth::{Growth, Populations, Targets};
use crate::model::health::{Counters, Fault, Health};
use crate::model::plan::Plan;
use crate::model::shafts::Shafts;
use crate::model::stopwatch::Stopwatch;
use crate::model::tissue::Tissue;
use crate::numerics::turning::derived;
use bevy_ecs::prelude::{With, World};
use serde::Serialize;
use std::collections::BTreeMap;

/// How many axons are in which state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Axons of the scene.
    pub axons: usize,
    /// Not yet born.
    pub unborn: usize,
    /// Growing.
    pub growing: usize,
    /// Inside a target, with one of its cones at least.
    pub arrived: usize,
    /// Stopped at the border, or at a fork that holds it.
    pub stalled: usize,
    /// Gone across the border.
    pub left: usize,
    /// Drawing back.
    pub retracting: usize,
    /// Drawn back for good.
    pub withdrawn: usize,
    /// Branches that sprouted, whatever their tips are doing; the other counts are of axons.
    pub branches: usize,
}

impl std::fmt::Display for Counts {
    /// `24 axons with 43 branches: 14 arrived, 10 withdrawn`; the states of the paper's scenes always, others where there are any.
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { axons, arrived, growing, stalled, left, unborn, .. } = self;
        write!(formatter, "{axons} axons")?;
        if self.branches > 0 {
            write!(formatter, " with {} branches", self.branches)?;
        }
        write!(formatter, ": {arrived} arrived, {growing} growing, {stalled} stalled, {left} left, {unborn} unborn")?;
        for (count, word) in [(self.retracting, "retracting"), (self.withdrawn, "withdrawn")] {
            if count > 0 {
                write!(formatter, ", {count} {word}")?;
            }
        }
        Ok(())
    }
}

/// Quantities that follow from the keys of `growth`, for one population.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DerivedConstants {
    /// Turning rate κ (1/h).
    pub turning_rate: f64,
    /// Pulsation ω = √(2 κ v_g / l₀) (1/h).
    pub omega: f64,
    /// ω δt, which the derivation of eq. (1) wants small.
    pub omega_filopodia_time: f64,
    /// Radius of the tightest turn v_g/κ (µm); `null` when nothing turns.
    pub turning_radius: Option<f64>,
}

/// What a run cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// How often each costly thing was done.
    #[serde(flatten)]
    pub counters: Counters,
    /// Vertices of the mesh.
    pub mesh_vertices: usize,
    /// Vertices stored for all shafts.
    pub shaft_vertices: usize,
    /// Wall seconds of the run, by phase.
    pub seconds: BTreeMap<&'static str, f64>,
    /// Share of each phase in the sum of the seconds.
    pub share: BTreeMap<&'static str, f64>,
    /// Largest resident memory of the process so far (MiB); `null` where the system does not say.
    pub peak_memory_mib: Option<f64>,
}

/// Everything in `summary.json` of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// Time reached (h).
    pub time: f64,
    /// Whether the run came to its end.
    pub complete: bool,
    /// What ended it early.
    pub fault: Option<String>,
    /// How many axons are in which state.
    pub counts: Counts,
    /// What a biologist reads.
    pub morphology: Morphology,
    /// Largest relative drift of |v_g| (0 for `rotation`).
    pub speed_drift: f64,
    /// Derived constants of eq. (1), by population.
    pub derived: BTreeMap<String, DerivedConstants>,
    /// What the scene needed and what it did not, and how near its limits were.
    pub plan: Plan,
    /// What the user should know of.
    pub notes: Vec<String>,
    /// What it cost.
    pub cost: Cost,
}

/// Names and choices that a summary needs besides the world.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryOptions {
    /// Name of the scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// Heights at which the morphology is measured, as shares of the tissue's height.
    pub heights: Vec<f64>,
    /// Linkage distance of fascicles (µm).
    pub linkage: f64,
}

impl Summary {
    /// Looks at a world whose tissue has been brought to the present.
    pub fn of(world: &World, options: &SummaryOptions, fault: Option<&Fault>) -> Self {
        let clock = world.resource::<Clock>();
        let (y_min, y_max) = extent_in_y(world.resource::<Configuration>());
        let measures = MeasureOptions { shares: options.heights.clone(), y_min, y_max, linkage: options.linkage };
        Self {
            scene: options.scene.clone(),
            seed: options.seed,
            time: clock.hours(),
            complete: fault.is_none() && clock.is_over(),
            fault: fault.map(ToString::to_string),
            counts: counts(world),
            morphology: morphology(world, &measures),
            speed_drift: speed_drift(world),
            derived: constants(world),
            plan: world.resource::<Plan>().clone(),
            notes: world.resource::<Health>().notes().to_vec(),
            cost: cost(world),
        }
    }
}

/// The morphology; without targets there is no hit fraction.
pub fn morphology(world: &World, options: &MeasureOptions) -> Morphology {
    let mut tally = Tally::new(options);
    each_axon(world, |axon| tally.add(&axon));
    let mut found = tally.measure();
    if world.resource::<Targets>().cells.is_empty() {
        for hits in [&mut found.hits, &mut found.hits_early, &mut found.hits_late] {
            hits.fraction = None;
        }
    }
    found
}

/// How many axons are in which state.
pub fn counts(world: &World) -> Counts {
    let axons = world.resource::<Populations>().0.iter().map(|population| population.count).sum();
    let mut counts = Counts { axons, ..Counts::default() };
    let arrivals = arrivals(world);
    for tip in tips(world) {
        if tip.is_branch {
            counts.branches += 1;
            continue;
        }
        match if arrivals.contains_key(&tip.axon) { Status::Arrived } else { tip.status } {
            Status::Unborn => {}
            Status::Growing | Status::Waiting => counts.growing += 1,
            Status::Arrived => counts.arrived += 1,
            Status::Stalled => counts.stalled += 1,
            Status::Left => counts.left += 1,
            Status::Retracting => counts.retracting += 1,
            Status::Withdrawn => counts.withdrawn += 1,
        }
    }
    let Counts { growing, arrived, stalled, left, retracting, withdrawn, .. } = counts;
    counts.unborn = axons - growing - arrived - stalled - left - retracting - withdrawn;
    counts
}

fn speed_drift(world: &World) -> f64 {
    let Some(mut cones) = world.try_query_filtered::<&Journey, With<GrowthCone>>() else { return 0.0 };
    cones.iter(world).map(|journey| journey.worst_drift).fold(0.0, f64::max)
}

/// Derived constants of eq. (1), by population.
pub fn constants(world: &World) -> BTreeMap<String, DerivedConstants> {
    let growth = world.resource::<Growth>();
    let of = |speed: f64| {
        let found = derived(growth.turning_rate, growth.filopodium_length, speed, growth.filopodia_time);
        DerivedConstants {
            turning_rate: growth.turning_rate,
            omega: found.omega,
            omega_filopodia_time: found.omega_filopodia_time,
            turning_radius: found.turning_radius.is_finite().then_some(found.turning_radius),
        }
    };
    world.resource::<Populations>().0.iter().map(|p| (p.name.clone(), of(p.speed))).collect()
}

fn cost(world: &World) -> Cost {
    let seconds = world.resource::<Stopwatch>().seconds().clone();
    let total: f64 = seconds.values().sum::<f64>().max(f64::MIN_POSITIVE);
    Cost {
        counters: *world.resource::<Counters>(),
        mesh_vertices: world.resource::<Tissue>().mesh.vertex_count(),
        shaft_vertices: world.resource::<Shafts>().vertex_count(),
        share: seconds.iter().map(|(phase, s)| (*phase, s / total)).collect(),
        seconds,
        peak_memory_mib: memory_mib("VmHWM:"),
    }
}

/// Resident memory of this process (MiB), where the system tells: `VmRSS:` now, `VmHWM:` the largest so far.
pub fn memory_mib(name: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with(name))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Seconds of processor time that the threads of this process have used, those that have ended left out; none where the system does
/// not tell.
pub fn cpu_seconds() -> Option<f64> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let nanoseconds = |thread: std::fs::DirEntry| -> Option<f64> {
        let line = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        line.split(' ').next()?.parse().ok()
    };
    Some(1e-9 * threads.filter_map(|thread| nanoseconds(thread.ok()?)).sum::<f64>())
}
