//! A recording as snapshots: at its frames what was seen, between them what lies halfway.
//!
//! Positions, concentrations and tips go in straight lines from frame to frame; a tip has the status of the frame before. A vertex of
//! a shaft is there from its time to its end, times compared in the steps in which they are stored.

use super::film::{STATUSES, quantised_time};
use super::{FULL, NO_PARENT, RecordedCue, Recording, STAYS};
use crate::model::components::Status;
use crate::model::observables::Effect;
use crate::record::snapshot::{FieldView, Snapshot, TipView};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A time between two frames: the one before, the one after (or the same), and the share of the way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moment {
    time: f64,
    before: usize,
    after: usize,
    share: f64,
}

impl Moment {
    fn between(&self, before: f64, after: f64) -> f64 {
        if self.share > 0.0 { before + self.share * (after - before) } else { before }
    }
}

impl Recording {
    /// First and last time (h).
    pub fn span(&self) -> (f64, f64) {
        let frames = &self.header.frames;
        (frames.first().copied().unwrap_or_default(), frames.last().copied().unwrap_or_default())
    }

    /// The times that the scene's own figure shows (h), or the last one if it shows none.
    pub fn figure_times(&self) -> Vec<f64> {
        let times: Vec<f64> = self.header.figure_frames.iter().map(|&frame| self.header.frames[frame]).collect();
        if times.is_empty() { vec![self.span().1] } else { times }
    }

    /// The scene at a time (h), which is brought into the recording's span.
    pub fn snapshot(&self, time: f64) -> Snapshot {
        let moment = self.moment(time);
        let vertices = self.vertices_at(&moment);
        let tips = self.tips_at(&moment);
        Snapshot {
            time: moment.time,
            cells: self.cells.clone(),
            borders: self.borders_at(&vertices),
            fields: self.fields_at(&moment),
            shafts: tips.iter().map(|tip| self.shaft_at(&moment, tip, &vertices)).collect(),
            targets: self.targets_at(&vertices),
            tips,
            vertices,
        }
    }

    /// Columns over the frames: time (h), axons born and in each state, mean length of their shafts (µm; 0 before the first birth).
    pub fn measures(&self) -> BTreeMap<String, Vec<f64>> {
        let rows: Vec<BTreeMap<String, f64>> = self.header.frames.par_iter().map(|time| self.measured(*time)).collect();
        let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for (name, value) in rows.into_iter().flatten() {
            columns.entry(name).or_default().push(value);
        }
        columns
    }

    fn measured(&self, time: f64) -> BTreeMap<String, f64> {
        let moment = self.moment(time);
        let (vertices, tips) = (self.vertices_at(&moment), self.tips_at(&moment));
        let axons: Vec<&TipView> = tips.iter().filter(|tip| !tip.is_branch).collect();
        let length = |tip: &&TipView| {
            let shaft = self.shaft_at(&moment, tip, &vertices);
            shaft.windows(2).map(|ends| (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1])).sum::<f64>()
        };
        let (born, sum) = (axons.len() as f64, axons.iter().map(length).sum::<f64>());
        let of_status = |status: &Status| axons.iter().filter(|tip| tip.status == *status).count() as f64;
        let mut row: BTreeMap<String, f64> =
            STATUSES[1..].iter().map(|status| (status.word().to_owned(), of_status(status))).collect();
        row.insert("time".into(), time);
        row.insert("born".into(), born);
        row.insert("mean_length".into(), if born > 0.0 { sum / born } else { 0.0 });
        row
    }

    fn moment(&self, time: f64) -> Moment {
        let frames = &self.header.frames;
        let (first, last) = self.span();
        let time = if time > first { time.min(last) } else { first };
        let before = frames.partition_point(|frame| *frame <= time).saturating_sub(1);
        let after = (before + 1).min(frames.len().saturating_sub(1));
        let (from, to) = (frames[before], frames[after]);
        let share = if to > from { (time - from) / (to - from) } else { 0.0 };
        Moment { time, before, after, share }
    }

    /// A quantised point as a position (µm).
    fn place(&self, x: u16, y: u16) -> [f64; 2] {
        let [left, low, right, high] = self.header.bounds;
        [left + f64::from(x) / FULL * (right - left), low + f64::from(y) / FULL * (high - low)]
    }

    /// Points of a frame of a flat array with `count` points each.
    fn points<'a>(&'a self, items: &'a [u16], count: usize, frame: usize) -> impl Iterator<Item = [f64; 2]> + 'a {
        items[2 * count * frame..2 * count * (frame + 1)].chunks_exact(2).map(|pair| self.place(pair[0], pair[1]))
    }

    fn vertices_at(&self, moment: &Moment) -> Vec<[f64; 2]> {
        let last = self.vertex_frames().saturating_sub(1);
        let of = |frame: usize| self.points(&self.vertices, self.vertex_count, frame.min(last));
        of(moment.before)
            .zip(of(moment.after))
            .map(|(from, to)| [0, 1].map(|axis| moment.between(from[axis], to[axis])))
            .collect()
    }

    fn borders_at(&self, vertices: &[[f64; 2]]) -> Vec<(String, Vec<[f64; 2]>)> {
        let borders = self.header.borders.iter();
        borders
            .map(|border| (border.name.clone(), border.vertices.iter().map(|&v| vertices[v as usize]).collect()))
            .collect()
    }

    fn targets_at(&self, vertices: &[[f64; 2]]) -> Vec<(String, Vec<[f64; 2]>)> {
        let ring = |target: &super::RecordedTarget| {
            let points = target.cells.iter().zip(&target.weights);
            let mut ring: Vec<_> = points.map(|(&cell, &weights)| self.in_cell(cell, weights, vertices)).collect();
            ring.extend(ring.first().copied());
            (target.name.clone(), ring)
        };
        self.header.targets.iter().map(ring).collect()
    }

    /// Position of a material point (µm), from the weights of its cell's vertices 1 and 2 times 65535.
    fn in_cell(&self, cell: u32, weights: [u16; 2], vertices: &[[f64; 2]]) -> [f64; 2] {
        let weights = weights.map(|weight| f64::from(weight) / FULL);
        let corners = &self.cells[3 * cell as usize..3 * cell as usize + 3];
        let [a, b, c] = [0, 1, 2].map(|corner| vertices[corners[corner] as usize]);
        [0, 1].map(|axis| a[axis] + weights[0] * (b[axis] - a[axis]) + weights[1] * (c[axis] - a[axis]))
    }

    fn fields_at(&self, moment: &Moment) -> Vec<FieldView> {
        let view = |(cue, fields): (&RecordedCue, &Vec<u16>)| {
            let of = |frame: usize| {
                let place = cue.frames.partition_point(|stored| *stored <= frame).saturating_sub(1);
                fields[place * self.vertex_count..(place + 1) * self.vertex_count].iter()
            };
            let pairs = of(moment.before).zip(of(moment.after));
            let concentration =
                |(from, to): (&u16, &u16)| cue.maximum * moment.between(f64::from(*from), f64::from(*to)) / FULL;
            let effect = cue.effect.as_deref().map(|word| match word {
                "repel" => Effect::Repel,
                _ => Effect::Attract,
            });
            FieldView { name: cue.name.clone(), effect, concentration: pairs.map(concentration).collect() }
        };
        self.header.cues.iter().zip(&self.cues).map(view).collect()
    }

    fn tips_at(&self, moment: &Moment) -> Vec<TipView> {
        let count = self.header.axon_count;
        let of = |frame: usize| self.points(&self.tip_position, count, frame);
        let (from, to) = (of(moment.before), of(moment.after));
        let tip = |(axon, (from, to)): (usize, ([f64; 2], [f64; 2]))| {
            let at = |frame: usize| count * frame + axon;
            let word = self.header.status_words[usize::from(self.tip_status[at(moment.before)])].as_str();
            let status = STATUSES.into_iter().find(|status| status.word() == word)?;
            let angle = f64::from(self.tip_heading[at(moment.before)]) / 256.0 * TAU;
            (status != Status::Unborn).then(|| TipView {
                axon: axon as u32,
                position: [0, 1].map(|axis| moment.between(from[axis], to[axis])),
                heading: [angle.cos(), angle.sin()],
                status,
                is_branch: self.axon_parent[axon] != NO_PARENT,
            })
        };
        from.zip(to).enumerate().filter_map(tip).collect()
    }

    fn shaft_at(&self, moment: &Moment, tip: &TipView, vertices: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let axon = tip.axon as usize;
        let now = quantised_time(moment.time, self.span().1);
        let is_there = |&vertex: &usize| {
            let end = self.shaft_end.as_ref().map_or(STAYS, |ends| ends[vertex]);
            self.shaft_time[vertex] <= now && (end == STAYS || now < end)
        };
        let stored = self.shaft_start[axon] as usize..self.shaft_start[axon + 1] as usize;
        let place = |vertex: usize| {
            let weights = [self.shaft_weights[2 * vertex], self.shaft_weights[2 * vertex + 1]];
            self.in_cell(self.shaft_cell[vertex], weights, vertices)
        };
        stored.filter(is_there).map(place).chain([tip.position]).collect()
    }
}
