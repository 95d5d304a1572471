//! Eq. (1) in time: the integrator asks for the right-hand side stage by stage, combines, and alone moves cones.
//!
//! `rotation` (default) predicts the midpoint from the last pull, samples the pull L̂ there, and turns by the exact flow of
//! ė = κ(L̂ − (L̂·e)e): half turn – kick – half turn, with the step taken along the heading in the middle. It is of second
//! order, keeps |v_g|, and never overshoots. The cone walks in the mesh as deformed at the midpoint.
//!
//! The explicit methods (the paper's "Runge–Kutta") stand in `explicit.rs`, the choice of their steps by a tolerance
//! in [`super::adaptive`].

use super::adaptive::{adaptive_step, reach};
use super::clock::{Clock, StageTime};
use super::components::Status;
use super::configuration::Configuration;
use super::explicit::explicit_step;
use super::growth::{Growth, Method};
use super::health::{Counters, Health};
use super::movers::{ConeQuery, Mover, Step, StepStart, each_growing};
use super::schedule::{MotionSchedule, RightHandSide};
use super::shafts::Shafts;
use super::stopwatch::Stopwatch;
use super::tissue::Tissue;
use crate::numerics::runge_kutta::{BOGACKI_SHAMPINE, EULER, HEUN, RK4};
use crate::numerics::turning::{rotate_in_plane, turn};
use bevy_ecs::prelude::{Local, World};
use nalgebra::{Rotation3, Vector3};

/// Bytes that are kept of a growth cone during a step.
pub const BYTES_A_STEP: usize = size_of::<StepStart>();

/// Runs one step for all growing cones, up to the clock's next instant, and leaves the tissue there.
pub fn advance(world: &mut World, cones: &mut ConeQuery, mut starts: Local<Vec<StepStart>>) {
    let clock = *world.resource::<Clock>();
    let (from, to) = (clock.now, clock.now + clock.next_step());
    starts.resize_with(cones.iter(world).count(), StepStart::default);
    let mut growing = cones.iter(world).filter(|cone| *cone.1 == Status::Growing).count() as u64;
    if growing > 0 {
        match world.resource::<Growth>().method {
            Method::Rotation => rotation_step(world, cones, &mut starts, (from, to)),
            Method::Euler => explicit_step(world, cones, &mut starts, (from, to), &EULER),
            Method::Heun => explicit_step(world, cones, &mut starts, (from, to), &HEUN),
            Method::Rk4 => explicit_step(world, cones, &mut starts, (from, to), &RK4),
            Method::BogackiShampine => {
                growing = adaptive_step(world, cones, &mut starts, (from, to), &BOGACKI_SHAMPINE)
            }
        }
    }
    let mut counters = world.resource_mut::<Counters>();
    counters.steps += 1;
    counters.cone_steps += growing;
    reach(world, to);
    bring_tissue_to(world, clock.grid.hours(to));
    report_lost_cones(world, &starts);
}

/// A configuration in which a cell has no positive volume carries no cone, whoever made it.
fn report_broken_tissue(world: &mut World) {
    let configuration = world.resource::<Configuration>();
    let broken = configuration.moves.then(|| configuration.defect(&world.resource::<Tissue>().mesh)).flatten();
    if let Some(account) = broken {
        let time = world.resource::<StageTime>().0;
        world.resource_mut::<Health>().report(time, account);
    }
}

fn report_lost_cones(world: &mut World, starts: &[StepStart]) {
    let lost = starts.iter().enumerate().find_map(|(i, start)| Some(i).zip(start.fault()));
    if let Some((i, fault)) = lost {
        let time = world.resource::<StageTime>().0;
        // The tip of the shaft is where the cone was at the end of the last step.
        let last = world.resource::<Shafts>().tip(i as u32).into();
        let at = world.resource::<Configuration>().position(&world.resource::<Tissue>().mesh, last);
        let account = format!("growth cone of axon {i} was lost at ({:.3}, {:.3}) um: {fault}", at.x, at.y);
        world.resource_mut::<Health>().report(time, account);
    }
}

/// Brings the configuration to a time (h).
pub fn bring_tissue_to(world: &mut World, time: f64) {
    world.resource_mut::<Stopwatch>().lap("integrate");
    world.insert_resource(StageTime(time));
    let watched = world.resource_scope::<MotionSchedule, _>(|world, mut motion| {
        motion.schedule.run(world);
        motion.cells_may_turn_over
    });
    if watched {
        report_broken_tissue(world);
    }
    world.resource_mut::<Stopwatch>().lap("matrix motion");
}

/// Runs the right-hand side at the stage's time; not once there is a fault, which fields and neighbours may not survive.
pub fn evaluate_right_hand_side(world: &mut World) {
    if world.resource::<Health>().fault().is_some() {
        return;
    }
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
    mover.start.begin(*mover.site, spring.heading);
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
    let before = turn(&mover.start.heading(), &spring.pull, half_turn);
    let spinning = spun(before, spring.spin * duration, step.growth.planar);
    let after = step.kicked(mover.cone, spinning, spring.heading_diffusion, (step.start(mover.cone), step.to));
    mover.spring.heading = turn(&after, &spring.pull, half_turn);
    let speed = mover.cone.speed * spring.speed_factor;
    let displacement = (before + after) * (0.5 * speed * duration);
    let from = mover.start.site;
    step.travel(mover, from, step.configuration, displacement, speed * duration);
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
