//! Explicit Runge–Kutta methods, by their tableaus.
//!
//! They act on the vector v_g, whose modulus therefore drifts, and on the material velocity Ẋ = F⁻¹ v_g in the reference
//! configuration, where the domain does not move and stages may be combined. Their kicks: half the Brownian increment
//! before the step, half after it.

use super::clock::Clock;
use super::components::Spring;
use super::integrator::{bring_tissue_to, evaluate_right_hand_side};
use super::movers::{ConeQuery, Mover, Step, StepStart, each_growing, flat};
use crate::numerics::runge_kutta::ButcherTableau;
use crate::numerics::turning::perpendicular_part;
use crate::numerics::walk::{BorderRule, nowhere, walk};
use bevy_ecs::prelude::World;
use nalgebra::Vector3;
use std::ops::Range;

/// A whole step over a span of ticks.
pub(super) fn explicit_step(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    span: (u64, u64),
    tableau: &ButcherTableau,
) {
    run_stages(world, cones, starts, span, (tableau, 0..tableau.stages()));
    each_growing(world, cones, starts, span, |step, mover| finish(step, mover, tableau));
}

/// Evaluates some of the stages of a step; those before them must have been.
pub(super) fn run_stages(
    world: &mut World,
    cones: &mut ConeQuery,
    starts: &mut [StepStart],
    span: (u64, u64),
    (tableau, stages): (&ButcherTableau, Range<usize>),
) {
    let grid = world.resource::<Clock>().grid;
    let (from, to) = (grid.hours(span.0), grid.hours(span.1));
    for stage in stages {
        bring_tissue_to(world, from + tableau.c[stage] * (to - from));
        each_growing(world, cones, starts, span, |step, mover| enter_stage(step, mover, tableau, stage));
        evaluate_right_hand_side(world);
        each_growing(world, cones, starts, span, |step, mover| keep_rates(step, mover, stage));
    }
}

fn enter_stage(step: &Step, mover: &mut Mover, tableau: &ButcherTableau, stage: usize) {
    let spring = &mut *mover.spring;
    if stage == 0 {
        mover.start.begin(*mover.site, spring.heading);
        mover.start.stages().drift = spring.drift;
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
        Err(fault) => mover.start.blame(fault),
    }
    mover.position.0 = step.configuration.position(&step.tissue.mesh, *mover.site).xy();
}

fn keep_rates(step: &Step, mover: &mut Mover, stage: usize) {
    if stage == 0 {
        let start = step.start(mover.cone);
        let middle = start + (step.to - start) / 2;
        let heading = mover.start.heading();
        let stages = mover.start.stages();
        (stages.unkicked, stages.sampled) = (heading, *mover.spring);
        mover.spring.heading = step.kicked(mover.cone, heading, mover.spring.heading_diffusion, (start, middle));
        mover.start.set_heading(mover.spring.heading);
    }
    let spring = &*mover.spring;
    let velocity = spring.heading * (mover.cone.speed * spring.speed_factor * spring.drift);
    let material = step.configuration.pull_back(&step.tissue.mesh, mover.site.cell, velocity);
    let turning = perpendicular_part(&spring.pull, &spring.heading) * step.growth.turning_rate
        + spring.spin.cross(&(spring.heading * spring.drift));
    mover.start.stages().rates[stage] = (material, turning);
}

/// Moves a cone by the weights of the tableau.
pub(super) fn finish(step: &Step, mover: &mut Mover, tableau: &ButcherTableau) {
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

/// Begins a step of another length with a cone that was taken back. What its first stage sampled holds for any length; only the kick of
/// the first half is another.
pub(super) fn start_again(step: &Step, mover: &mut Mover) {
    let start = &mut *mover.start;
    let unkicked = start.stages().unkicked;
    start.set_heading(unkicked);
    start.forgive();
    keep_rates(step, mover, 0);
}

/// By how much the two methods of an embedded pair differ after a step, all of whose stages have been evaluated:
/// displacement (µm, in the present configuration) and velocity vector over v_g.
pub(super) fn difference(step: &Step, mover: &mut Mover, pair: &ButcherTableau) -> (Vector3<f64>, Vector3<f64>) {
    let duration = step.duration(mover.cone);
    let (mut shift, mut vector) = (Vector3::zeros(), Vector3::zeros());
    for ((b, other), (velocity, turning)) in pair.b.iter().zip(pair.embedded).zip(mover.start.rates()) {
        shift += velocity * ((b - other) * duration);
        vector += turning * ((b - other) * duration);
    }
    (step.configuration.push_forward(&step.tissue.mesh, mover.site.cell, shift), vector)
}

/// Displacement (reference, µm) and velocity vector over v_g after `duration` with the weights of a tableau row.
fn combined(start: &mut StepStart, weights: &[f64], duration: f64) -> (Vector3<f64>, Vector3<f64>) {
    let mut shift = Vector3::zeros();
    let mut vector = start.heading() * start.stages().drift;
    for (&weight, (velocity, turning)) in weights.iter().zip(start.rates()) {
        shift += velocity * (weight * duration);
        vector += turning * (weight * duration);
    }
    (shift, vector)
}

fn set_vector(spring: &mut Spring, vector: Vector3<f64>) {
    let norm = vector.norm();
    if norm > 0.0 {
        spring.heading = vector / norm;
        spring.drift = norm;
    }
}
