//! Eq. (1) in time: the integrator asks for the right-hand side stage by stage, combines, and alone moves cones.
//!
//! `rotation` (default) predicts the midpoint from the last pull, samples the pull L̂ there, and turns by the exact flow of
//! ė = κ(L̂ − (L̂·e)e): half turn – kick – half turn, with the step taken along the heading in the middle. It is of second
//! order, keeps |v_g|, and never overshoots. The cone walks in the mesh as deformed at the midpoint.
//!
//! The explicit methods (the paper's "Runge–Kutta") act on the vector v_g, whose modulus therefore drifts, and on the
//! material velocity Ẋ = F⁻¹ v_g in the reference configuration. Their kicks: half the Brownian increment before the
//! step, half after it.

use super::brownian::BrownianTree;
use super::clock::{Clock, StageTime};
use super::components::{GrowthCone, Journey, Position, Site, SpringState, Status, Velocity};
use super::growth::{Growth, Method, OnBorder, Targets};
use super::health::{Counters, Health};
use super::schedule::{MotionSchedule, RightHandSide};
use super::stopwatch::Stopwatch;
use super::tissue::{Configuration, Tissue};
use crate::numerics::runge_kutta::{ButcherTableau, EULER, HEUN, RK4};
use crate::numerics::turning::{kick, perpendicular_part, rotate_in_plane, turn};
use crate::numerics::walk::{BorderRule, Walk, WalkEnd, WalkError, WalkRules, nowhere, walk};
use bevy_ecs::prelude::{Local, QueryState, Resource, With, World};
use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;

const CHUNK: usize = 64;
/// Stages of the longest tableau.
const STAGES: usize = 4;

/// The Brownian paths of headings; absent in a scene without heading diffusion.
#[derive(Debug, Clone, Copy, Resource)]
pub struct HeadingPaths(pub BrownianTree);

type ConeData = (
    &'static GrowthCone,
    &'static mut Status,
    &'static mut Site,
    &'static mut Position,
    &'static mut Velocity,
    &'static mut SpringState,
    &'static mut Journey,
);

/// The cones as the integrator sees them.
type ConeQuery = QueryState<ConeData, With<GrowthCone>>;

/// What is kept of a cone during a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepStart {
    site: Site,
    heading: Vector3<f64>,
    drift: f64,
    /// Material velocity and rate of the velocity vector over v_g, for each stage.
    rates: [(Vector3<f64>, Vector3<f64>); STAGES],
    fault: Option<WalkError>,
}

/// One cone during a stage.
struct Mover<'a> {
    cone: &'a GrowthCone,
    status: &'a mut Status,
    site: &'a mut Site,
    position: &'a mut Position,
    velocity: &'a mut Velocity,
    spring: &'a mut SpringState,
    journey: &'a mut Journey,
    start: &'a mut StepStart,
}

/// What all cones share during a step.
struct Step<'a> {
    tissue: &'a Tissue,
    configuration: &'a Configuration,
    growth: &'a Growth,
    targets: &'a Targets,
    noise: Option<&'a HeadingPaths>,
    from: u64,
    to: u64,
    tick: f64,
}

/// Runs one step for all growing cones, up to the clock's next instant, and leaves the tissue at that instant.
pub fn advance(world: &mut World, cones: &mut ConeQuery, mut starts: Local<Vec<StepStart>>) {
    let clock = *world.resource::<Clock>();
    let (from, to) = (clock.now, clock.now + clock.next_step());
    starts.resize(cones.iter(world).count(), StepStart::default());
    let growing = cones.iter(world).filter(|cone| *cone.1 == Status::Growing).count() as u64;
    if growing > 0 {
        match world.resource::<Growth>().method {
            Method::Rotation => rotation_step(world, cones, &mut starts, (from, to)),
            Method::Euler => explicit_step(world, cones, &mut starts, (from, to), &EULER),
            Method::Heun => explicit_step(world, cones, &mut starts, (from, to), &HEUN),
            Method::Rk4 => explicit_step(world, cones, &mut starts, (from, to), &RK4),
        }
    }
    let mut counters = world.resource_mut::<Counters>();
    counters.steps += 1;
    counters.cone_steps += growing;
    world.resource_mut::<Clock>().now = to;
    bring_tissue_to(world, clock.grid.hours(to));
    report_lost_cones(world, &starts);
}

fn report_lost_cones(world: &mut World, starts: &[StepStart]) {
    let lost = starts.iter().enumerate().find_map(|(i, start)| start.fault.as_ref().map(|fault| (i, fault)));
    if let Some((i, fault)) = lost {
        let time = world.resource::<StageTime>().0;
        world.resource_mut::<Health>().report(time, format!("growth cone {i} was lost: {fault}"));
    }
}

/// Brings the configuration to a time (h).
pub fn bring_tissue_to(world: &mut World, time: f64) {
    world.resource_mut::<Stopwatch>().lap("integrate");
    world.insert_resource(StageTime(time));
    world.resource_scope::<MotionSchedule, _>(|world, mut motion| motion.0.run(world));
    world.resource_mut::<Stopwatch>().lap("matrix motion");
}

fn evaluate_right_hand_side(world: &mut World) {
    world.resource_mut::<Counters>().stages += 1;
    world.resource_mut::<Stopwatch>().lap("integrate");
    world.resource_scope::<RightHandSide, _>(|world, mut stage| stage.0.run(world));
}

fn rotation_step(world: &mut World, cones: &mut ConeQuery, starts: &mut [StepStart], span: (u64, u64)) {
    let grid = world.resource::<Clock>().grid;
    bring_tissue_to(world, 0.5 * (grid.hours(span.0) + grid.hours(span.1)));
    each_growing(world, cones, starts, span, predict_midpoint);
    evaluate_right_hand_side(world);
    each_growing(world, cones, starts, span, finish_rotation);
}

/// Half a step along the heading, and half a turn by the last pull: a guess of second order, good enough to sample at.
fn predict_midpoint(step: &Step, mover: &mut Mover) {
    let half = 0.5 * step.duration(mover.cone);
    let spring = &mut *mover.spring;
    *mover.start =
        StepStart { site: *mover.site, heading: spring.heading, drift: spring.drift, ..StepStart::default() };
    let speed = mover.cone.speed * spring.speed_factor;
    let forward = spring.heading * (speed * half);
    spring.heading = spun(
        turn(&spring.heading, &spring.pull, step.growth.turning_rate * half),
        spring.spin * half,
        step.growth.planar,
    );
    step.place(mover, forward);
}

fn finish_rotation(step: &Step, mover: &mut Mover) {
    let duration = step.duration(mover.cone);
    let half_turn = 0.5 * step.growth.turning_rate * duration;
    let spring = *mover.spring;
    let before = turn(&mover.start.heading, &spring.pull, half_turn);
    let spinning = spun(before, spring.spin * duration, step.growth.planar);
    let after = step.kicked(mover.cone, spinning, spring.heading_diffusion, (step.start(mover.cone), step.to));
    mover.spring.heading = turn(&after, &spring.pull, half_turn);
    let speed = mover.cone.speed * spring.speed_factor;
    let displacement = (before + after) * (0.5 * speed * duration);
    let from = mover.start.site;
    let coordinates = &step.configuration.coordinates;
    step.travel(mover, from, coordinates, displacement, speed * duration);
}

fn explicit_step(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    span: (u64, u64),
    tableau: &ButcherTableau,
) {
    let grid = world.resource::<Clock>().grid;
    let (from, to) = (grid.hours(span.0), grid.hours(span.1));
    for stage in 0..tableau.b.len() {
        bring_tissue_to(world, from + tableau.c[stage] * (to - from));
        each_growing(world, cones, starts, span, |step, mover| enter_stage(step, mover, tableau, stage));
        evaluate_right_hand_side(world);
        each_growing(world, cones, starts, span, |step, mover| keep_rates(step, mover, stage));
    }
    each_growing(world, cones, starts, span, |step, mover| finish_explicit(step, mover, tableau));
}

fn enter_stage(step: &Step, mover: &mut Mover, tableau: &ButcherTableau, stage: usize) {
    let spring = &mut *mover.spring;
    if stage == 0 {
        *mover.start =
            StepStart { site: *mover.site, heading: spring.heading, drift: spring.drift, ..StepStart::default() };
    }
    let duration = step.duration(mover.cone);
    let (shift, vector) = combined(mover.start, tableau.a[stage], duration);
    let from = mover.start.site;
    *mover.site = from;
    set_vector(spring, vector);
    spring.clear();
    match walk(&step.tissue.mesh, step.tissue.mesh.vertices(), from.planar(), flat(shift), &nowhere(BorderRule::Slide))
    {
        Ok(walked) => *mover.site = walked.point.into(),
        Err(fault) => mover.start.fault = Some(fault),
    }
    mover.position.0 = step.configuration.position(&step.tissue.mesh, *mover.site);
}

fn keep_rates(step: &Step, mover: &mut Mover, stage: usize) {
    if stage == 0 {
        let start = step.start(mover.cone);
        let middle = start + (step.to - start) / 2;
        let heading = mover.start.heading;
        mover.start.heading = step.kicked(mover.cone, heading, mover.spring.heading_diffusion, (start, middle));
        mover.spring.heading = mover.start.heading;
    }
    let spring = &*mover.spring;
    let velocity = spring.heading * (mover.cone.speed * spring.speed_factor * spring.drift);
    let material = step.configuration.pull_back(&step.tissue.mesh, mover.site.cell, velocity);
    let turning = perpendicular_part(&spring.pull, &spring.heading) * step.growth.turning_rate
        + spring.spin.cross(&(spring.heading * spring.drift));
    mover.start.rates[stage] = (material, turning);
}

fn finish_explicit(step: &Step, mover: &mut Mover, tableau: &ButcherTableau) {
    let start = step.start(mover.cone);
    let middle = start + (step.to - start) / 2;
    let duration = step.duration(mover.cone);
    let (shift, vector) = combined(mover.start, tableau.b, duration);
    set_vector(mover.spring, vector);
    let diffusion = mover.spring.heading_diffusion;
    mover.spring.heading = step.kicked(mover.cone, mover.spring.heading, diffusion, (middle, step.to));
    let length = mover.cone.speed * mover.spring.speed_factor * mover.spring.drift * duration;
    let from = mover.start.site;
    step.travel(mover, from, step.tissue.mesh.vertices(), shift, length);
}

/// Displacement (reference, µm) and velocity vector over v_g after `duration` with the weights of a tableau row.
fn combined(start: &StepStart, weights: &[f64], duration: f64) -> (Vector3<f64>, Vector3<f64>) {
    let mut shift = Vector3::zeros();
    let mut vector = start.heading * start.drift;
    for (&weight, (velocity, turning)) in weights.iter().zip(&start.rates) {
        shift += velocity * (weight * duration);
        vector += turning * (weight * duration);
    }
    (shift, vector)
}

fn set_vector(spring: &mut SpringState, vector: Vector3<f64>) {
    let norm = vector.norm();
    if norm > 0.0 {
        spring.heading = vector / norm;
        spring.drift = norm;
    }
}

fn spun(heading: Vector3<f64>, angle: Vector3<f64>, planar: bool) -> Vector3<f64> {
    if angle == Vector3::zeros() {
        heading
    } else if planar {
        rotate_in_plane(&heading, angle.z)
    } else {
        Rotation3::new(angle) * heading
    }
}

fn flat(vector: Vector3<f64>) -> [f64; 2] {
    [vector.x, vector.y]
}

impl Step<'_> {
    /// Instant at which a cone starts this step: its birth, if that falls into it.
    fn start(&self, cone: &GrowthCone) -> u64 {
        cone.birth.max(self.from)
    }

    /// How long a cone grows in this step (h).
    fn duration(&self, cone: &GrowthCone) -> f64 {
        (self.to - self.start(cone)) as f64 * self.tick
    }

    /// Puts a cone at a trial site for sampling: `forward` (µm, spatial) from where it is, without leaving the tissue.
    fn place(&self, mover: &mut Mover, forward: Vector3<f64>) {
        mover.spring.clear();
        let coordinates = &self.configuration.coordinates;
        match walk(&self.tissue.mesh, coordinates, mover.site.planar(), flat(forward), &nowhere(BorderRule::Slide)) {
            Ok(walked) => *mover.site = walked.point.into(),
            Err(fault) => mover.start.fault = Some(fault),
        }
        mover.position.0 = self.configuration.position(&self.tissue.mesh, *mover.site);
    }

    /// Heading after the Brownian increment over a span of ticks: dθ = √(2 D_θ) dW.
    fn kicked(&self, cone: &GrowthCone, heading: Vector3<f64>, diffusion: f64, span: (u64, u64)) -> Vector3<f64> {
        match self.noise {
            Some(noise) if diffusion > 0.0 => {
                let scale = (2.0 * diffusion).sqrt();
                let increment = noise.0.increment(cone.axon, span.0, span.1);
                kick(&heading, increment.map(|dw| scale * dw), self.growth.planar)
            }
            _ => heading,
        }
    }

    /// Moves a cone for good: `displacement` in the configuration `coordinates`, with `length` µm grown on the way.
    fn travel(&self, mover: &mut Mover, from: Site, coordinates: &[[f64; 2]], displacement: Vector3<f64>, length: f64) {
        let border = match self.growth.on_border {
            OnBorder::Slide => BorderRule::Slide,
            OnBorder::Stall | OnBorder::Leave => BorderRule::Stop,
        };
        let rules = WalkRules { border, stop_at: |cell: u32| self.targets.contains(cell) };
        match walk(&self.tissue.mesh, coordinates, from.planar(), flat(displacement), &rules) {
            Ok(walked) => self.settle(mover, walked, length),
            Err(fault) => {
                *mover.site = from;
                mover.start.fault = Some(fault);
            }
        }
    }

    fn settle(&self, mover: &mut Mover, walked: Walk<2>, length: f64) {
        *mover.site = walked.point.into();
        let end = match (walked.end, self.growth.on_border) {
            (WalkEnd::Reached, _) | (WalkEnd::Border { .. }, OnBorder::Slide) => None,
            (WalkEnd::Entered(_), _) => Some(Status::Arrived),
            (WalkEnd::Border { .. }, OnBorder::Leave) => Some(Status::Left),
            (WalkEnd::Border { .. }, OnBorder::Stall) => Some(Status::Stalled),
        };
        if let Some(status) = end {
            *mover.status = status;
            let start = self.start(mover.cone) as f64 * self.tick;
            mover.journey.ended = start + walked.travelled * self.duration(mover.cone);
        }
        mover.journey.length += length * walked.travelled;
        mover.journey.worst_drift = mover.journey.worst_drift.max((mover.spring.drift - 1.0).abs());
        let spring = &*mover.spring;
        mover.velocity.growth = spring.heading * (mover.cone.speed * spring.speed_factor * spring.drift);
    }
}

/// Runs `act` for each growing cone, in parallel; each writes only itself.
fn each_growing(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    span: (u64, u64),
    act: impl Fn(&Step, &mut Mover) + Sync,
) {
    world.resource_scope::<Configuration, _>(|world, configuration| {
        world.resource_scope::<Tissue, _>(|world, tissue| {
            let (growth, targets) = (*world.resource::<Growth>(), world.resource::<Targets>().clone());
            let noise = world.get_resource::<HeadingPaths>().copied();
            let step = Step {
                tissue: &tissue,
                configuration: &configuration,
                growth: &growth,
                targets: &targets,
                noise: noise.as_ref(),
                from: span.0,
                to: span.1,
                tick: world.resource::<Clock>().grid.tick(),
            };
            let Ok(tables) = cones.query_mut(world).contiguous_iter_inner() else { return };
            let mut rest = &mut starts[..];
            for (identities, mut status, mut site, mut position, mut velocity, mut spring, mut journey) in tables {
                let (here, beyond) = rest.split_at_mut(identities.len().min(rest.len()));
                rest = beyond;
                (
                    identities,
                    status.bypass_change_detection(),
                    site.bypass_change_detection(),
                    position.bypass_change_detection(),
                    velocity.bypass_change_detection(),
                    spring.bypass_change_detection(),
                    journey.bypass_change_detection(),
                    here,
                )
                    .into_par_iter()
                    .with_min_len(CHUNK)
                    .filter(|(_, status, ..)| **status == Status::Growing)
                    .for_each(|(cone, status, site, position, velocity, spring, journey, start)| {
                        act(&step, &mut Mover { cone, status, site, position, velocity, spring, journey, start });
                    });
            }
        });
    });
}
