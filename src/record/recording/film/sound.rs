//! Whether a film that was read back can be that of a run of its scene.

use super::{Film, FilmedCue, STATUSES};
use crate::model::clock::Clock;
use crate::model::configuration::Configuration;
use crate::model::observables::Observables;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use bevy_ecs::prelude::World;

impl Film {
    /// Whether a run may have made it on its way to `world`: frames in order, and in each as many vertices, values and tips as the
    /// scene has.
    pub(in crate::record) fn may_be_of(&self, world: &World) -> bool {
        let (mesh, frames) = (&world.resource::<Tissue>().mesh, self.times.len());
        let ascending = |numbers: &[usize]| numbers.windows(2).all(|pair| pair[0] < pair[1]);
        let there = |numbers: &[usize]| ascending(numbers) && numbers.last().is_none_or(|last| *last < frames);
        let now = world.resource::<Clock>().hours();
        let in_time = self.times.windows(2).all(|pair| pair[0] < pair[1])
            && self.times.iter().all(|time| (0.0..=now).contains(time));
        let shapes = if world.resource::<Configuration>().moves { frames } else { frames.min(1) };
        let has_vertices =
            self.vertices.len() == shapes && self.vertices.iter().all(|all| all.len() == mesh.vertex_count());
        let fields = &world.resource::<Observables>().fields;
        let has_fields = self.cues.len() == if frames == 0 { 0 } else { fields.len() }
            && self.cues.iter().zip(fields).all(|(cue, field)| {
                let values = (field.read)(world, field.index).len();
                there(&cue.frames)
                    && cue.begins()
                    && cue.fields.len() == cue.frames.len()
                    && cue.fields.iter().all(|all| all.len() == values)
            });
        let shafts = world.resource::<Shafts>().count();
        let has_tips = self.tips.len() == frames
            && self
                .tips
                .iter()
                .all(|tips| tips.len() == shafts && tips.iter().all(|tip| usize::from(tip.status) < STATUSES.len()));
        in_time
            && there(&self.figure_frames)
            && has_vertices
            && has_fields
            && has_tips
            && self.shafts.is_of(if frames == 0 { 0 } else { shafts }, mesh.cell_count())
    }
}

impl FilmedCue {
    /// Whether the first frame has its field.
    fn begins(&self) -> bool {
        self.frames.first() == Some(&0)
    }
}
