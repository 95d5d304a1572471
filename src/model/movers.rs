//! The growing cones during a step: what the methods of the integrator act on, and how a cone moves for good.

use super::brownian::HeadingPaths;
use super::clock::Clock;
use super::components::{GrowthCone, Journey, Position, Site, Spring, SpringState, Status, Velocity};
use super::configuration::Configuration;
use super::growth::{Growth, OnBorder, Targets};
use super::tissue::{Tissue, lift};
use crate::numerics::coordinates::AtVertices;
use crate::numerics::turning::kick;
use crate::numerics::walk::{BorderRule, Walk, WalkEnd, WalkError, WalkRules, nowhere, walk};
use bevy_ecs::prelude::{QueryState, With, World};
use nalgebra::{Vector2, Vector3};
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
    heading: Vector2<f64>,
    /// What few keep besides; made when it is needed.
    besides: Option<Box<Besides>>,
}

/// What is kept of a cone by methods of several stages, or once it is lost.
#[derive(Debug, Clone, Default)]
struct Besides {
    stages: Stages,
    fault: Option<WalkError>,
}

/// What the stages of an explicit method found.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stages {
    /// |v_g| over its nominal value at the start.
    pub(super) drift: f64,
    /// Material velocity and rate of the velocity vector over v_g, for each stage.
    pub(super) rates: [(Vector3<f64>, Vector3<f64>); STAGES],
    /// Heading before the kick of the first half, and what the first stage found: what a shorter step begins from.
    pub(super) unkicked: Vector3<f64>,
    pub(super) sampled: Spring,
    /// Estimated error of the step (µm), for an embedded pair.
    pub(super) error: f64,
    /// Halvings of the clock's step that the cone takes, and the instant (ticks) it has come to.
    pub(super) level: u8,
    pub(super) reached: u64,
}

impl StepStart {
    /// What several stages keep, made if it is not there yet.
    pub(super) fn stages(&mut self) -> &mut Stages {
        &mut self.besides.get_or_insert_default().stages
    }

    /// Site and spring before the first stage, with the pull that it found.
    pub(super) fn taken_back(&mut self) -> (Site, Spring) {
        let site = self.site;
        let Stages { unkicked, sampled, drift, .. } = *self.stages();
        (site, Spring { heading: unkicked, drift, ..sampled })
    }

    /// What the stages so far found.
    pub(super) fn rates(&mut self) -> &[(Vector3<f64>, Vector3<f64>)] {
        &self.stages().rates
    }

    /// Unit heading at the start.
    pub(super) fn heading(&self) -> Vector3<f64> {
        lift(self.heading.into())
    }

    /// Sets the unit heading at the start.
    pub(super) fn set_heading(&mut self, heading: Vector3<f64>) {
        self.heading = heading.xy();
    }

    /// Begins a step; what the stages of the one before found is no longer looked at.
    pub(super) fn begin(&mut self, site: Site, heading: Vector3<f64>) {
        self.site = site;
        self.set_heading(heading);
        self.forgive();
    }

    /// Why the cone was lost, if it was.
    pub(super) fn fault(&self) -> Option<&WalkError> {
        self.besides.as_ref()?.fault.as_ref()
    }

    /// Notes that the cone was lost.
    pub(super) fn blame(&mut self, fault: WalkError) {
        self.besides.get_or_insert_default().fault = Some(fault);
    }

    /// Forgets that it was.
    pub(super) fn forgive(&mut self) {
        if let Some(besides) = &mut self.besides {
            besides.fault = None;
        }
    }
}

/// One cone during a stage.
pub(super) struct Mover<'a> {
    pub(super) cone: &'a GrowthCone,
    pub(super) status: &'a mut Status,
    pub(super) site: &'a mut Site,
    pub(super) position: &'a mut Position,
    pub(super) velocity: &'a mut Velocity,
    pub(super) spring: &'a mut Spring,
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
            Err(fault) => mover.start.blame(fault),
        }
        mover.position.0 = self.configuration.position(&self.tissue.mesh, *mover.site).xy();
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
                mover.start.blame(fault);
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
        mover.velocity.growth = spring.heading.xy() * (mover.cone.speed * spring.speed_factor * spring.drift);
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
                        spring.change(|spring| {
                            act(&step, &mut Mover { cone, status, site, position, velocity, spring, journey, start });
                        });
                    });
            }
        });
    });
}
