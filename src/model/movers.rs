//! The growing cones during a step: what the methods of the integrator act on, and how a cone moves for good.

use super::brownian::HeadingPaths;
use super::clock::Clock;
use super::components::{GrowthCone, Journey, Position, Site, SpringState, Status, Velocity};
use super::configuration::Configuration;
use super::growth::{Growth, OnBorder, Targets};
use super::tissue::Tissue;
use crate::numerics::coordinates::AtVertices;
use crate::numerics::turning::kick;
use crate::numerics::walk::{BorderRule, Walk, WalkEnd, WalkError, WalkRules, nowhere, walk};
use bevy_ecs::prelude::{QueryState, With, World};
use nalgebra::Vector3;
use rayon::prelude::*;

const CHUNK: usize = 64;
/// Stages of the longest tableau.
const STAGES: usize = 4;

pub(super) type ConeData = (
    &'static GrowthCone,
    &'static mut Status,
    &'static mut Site,
    &'static mut Position,
    &'static mut Velocity,
    &'static mut SpringState,
    &'static mut Journey,
);

/// The cones as the integrator sees them.
pub(super) type ConeQuery = QueryState<ConeData, With<GrowthCone>>;

/// What is kept of a cone during a step.
#[derive(Debug, Clone, Default)]
pub struct StepStart {
    pub(super) site: Site,
    pub(super) heading: Vector3<f64>,
    pub(super) drift: f64,
    /// What methods of several stages keep besides; made when one of them needs it.
    stages: Option<Box<Stages>>,
    pub(super) fault: Option<Box<WalkError>>,
}

/// What the stages of an explicit method found.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stages {
    /// Material velocity and rate of the velocity vector over v_g, for each stage.
    pub(super) rates: [(Vector3<f64>, Vector3<f64>); STAGES],
    /// Heading before the kick of the first half, and what the first stage found: what a shorter step begins from.
    pub(super) unkicked: Vector3<f64>,
    pub(super) sampled: SpringState,
    /// Estimated error of the step (µm), for an embedded pair.
    pub(super) error: f64,
    /// Halvings of the clock's step that the cone takes, and the instant (ticks) it has come to.
    pub(super) level: u8,
    pub(super) reached: u64,
}

impl StepStart {
    /// What several stages keep, made if it is not there yet.
    pub(super) fn stages(&mut self) -> &mut Stages {
        self.stages.get_or_insert_default()
    }

    /// Site and spring state before the first stage, with the pull that it found.
    pub(super) fn taken_back(&mut self) -> (Site, SpringState) {
        let (site, drift) = (self.site, self.drift);
        let Stages { unkicked, sampled, .. } = *self.stages();
        (site, SpringState { heading: unkicked, drift, ..sampled })
    }

    /// What the stages so far found; nothing before the first.
    pub(super) fn rates(&self) -> &[(Vector3<f64>, Vector3<f64>)] {
        self.stages.as_deref().map_or(&[], |stages| &stages.rates)
    }

    /// Begins a step; what the stages of the one before found is no longer looked at.
    pub(super) fn begin(&mut self, site: Site, heading: Vector3<f64>, drift: f64) {
        (self.site, self.heading, self.drift, self.fault) = (site, heading, drift, None);
    }
}

/// One cone during a stage.
pub(super) struct Mover<'a> {
    pub(super) cone: &'a GrowthCone,
    pub(super) status: &'a mut Status,
    pub(super) site: &'a mut Site,
    pub(super) position: &'a mut Position,
    pub(super) velocity: &'a mut Velocity,
    pub(super) spring: &'a mut SpringState,
    pub(super) journey: &'a mut Journey,
    pub(super) start: &'a mut StepStart,
}

/// What all cones share during a step.
pub(super) struct Step<'a> {
    pub(super) tissue: &'a Tissue,
    pub(super) configuration: &'a Configuration,
    pub(super) growth: &'a Growth,
    pub(super) targets: &'a Targets,
    pub(super) noise: Option<&'a HeadingPaths>,
    pub(super) from: u64,
    pub(super) to: u64,
    pub(super) tick: f64,
}

impl Step<'_> {
    /// Instant at which a cone starts this step: its birth, if that falls into it.
    pub(super) fn start(&self, cone: &GrowthCone) -> u64 {
        cone.birth.max(self.from)
    }

    /// How long a cone grows in this step (h).
    pub(super) fn duration(&self, cone: &GrowthCone) -> f64 {
        (self.to - self.start(cone)) as f64 * self.tick
    }

    /// Puts a cone at a trial site for sampling: `forward` (µm, spatial) from where it is, without leaving the tissue.
    pub(super) fn place(&self, mover: &mut Mover, forward: Vector3<f64>) {
        mover.spring.clear();
        match walk(
            &self.tissue.mesh,
            self.configuration,
            mover.site.planar(),
            flat(forward),
            &nowhere(BorderRule::Slide),
        ) {
            Ok(walked) => *mover.site = walked.point.into(),
            Err(fault) => mover.start.fault = Some(fault.into()),
        }
        mover.position.0 = self.configuration.position(&self.tissue.mesh, *mover.site);
    }

    /// Heading after the Brownian increment over a span of ticks: dθ = √(2 D_θ) dW.
    pub(super) fn kicked(
        &self,
        cone: &GrowthCone,
        heading: Vector3<f64>,
        diffusion: f64,
        span: (u64, u64),
    ) -> Vector3<f64> {
        match self.noise {
            Some(noise) if diffusion > 0.0 => {
                let scale = (2.0 * diffusion).sqrt();
                let increments = if self.growth.planar {
                    let [dw] = noise.0.increment(cone.axon, span.0, span.1);
                    [dw, 0.0]
                } else {
                    noise.0.increment(cone.axon, span.0, span.1)
                };
                kick(&heading, increments.map(|dw| scale * dw), self.growth.planar)
            }
            _ => heading,
        }
    }

    /// Moves a cone for good: `displacement` in the configuration `coordinates`, with `length` µm grown on the way.
    pub(super) fn travel(
        &self,
        mover: &mut Mover,
        from: Site,
        coordinates: &(impl AtVertices<2> + ?Sized),
        displacement: Vector3<f64>,
        length: f64,
    ) {
        let border = match self.growth.on_border {
            OnBorder::Slide => BorderRule::Slide,
            OnBorder::Stall | OnBorder::Leave => BorderRule::Stop,
        };
        let rules = WalkRules { border, stop_at: |cell: u32| self.targets.contains(cell) };
        match walk(&self.tissue.mesh, coordinates, from.planar(), flat(displacement), &rules) {
            Ok(walked) => self.settle(mover, walked, length),
            Err(fault) => {
                *mover.site = from;
                mover.start.fault = Some(fault.into());
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

/// The planar part of a vector.
pub(super) fn flat(vector: Vector3<f64>) -> [f64; 2] {
    [vector.x, vector.y]
}

/// Runs `act` for each growing cone, in parallel; each writes only itself.
pub(super) fn each_growing(
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
