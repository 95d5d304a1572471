//! Snapshots as panels of a figure.

use super::colour;
use super::scene_figure::{BorderLine, CueLayer, FigureError, Panel, SceneFigure, Tip, TipStatus, draw};
use super::snapshot::{FieldView, Snapshot, TipView};
use super::svg::Svg;
use crate::model::components::Status;
use crate::model::observables::Effect;

/// The figure of a run, one panel a snapshot.
///
/// # Errors
/// No snapshot, or data that are not finite.
pub fn scene_figure(title: &str, subtitle: &str, snapshots: &[Snapshot]) -> Result<Svg, FigureError> {
    let panels =
        snapshots.iter().map(|snapshot| panel(format!("t = {} h", rounded(snapshot.time)), snapshot)).collect();
    draw(&SceneFigure::new(title, subtitle, panels))
}

/// The figure of several runs of one scene, one panel a snapshot: the density of the shafts of all of them, over tissue and cues of
/// the first.
///
/// # Errors
/// As [`scene_figure`].
pub fn pooled_figure(title: &str, subtitle: &str, runs: &[&[Snapshot]]) -> Result<Svg, FigureError> {
    let Some((first, others)) = runs.split_first() else { return Err(FigureError::NoPanel) };
    let pooled = |(place, snapshot): (usize, &Snapshot)| {
        let further = others.iter().filter_map(|run| run.get(place));
        let label = format!("t = {} h, {} seeds", rounded(snapshot.time), runs.len());
        let mut panel = panel(label, snapshot);
        panel.shafts.extend(further.flat_map(|snapshot| snapshot.shafts.iter().cloned()));
        panel.tips.clear();
        panel
    };
    let panels = first.iter().enumerate().map(pooled).collect();
    draw(&SceneFigure { most_lines: 0, ..SceneFigure::new(title, subtitle, panels) })
}

/// One snapshot as a panel with a label. Cues that nothing turns by are left out.
pub fn panel(label: String, snapshot: &Snapshot) -> Panel {
    let border = |(name, points): &(String, Vec<[f64; 2]>)| BorderLine { name: name.clone(), points: points.clone() };
    Panel {
        label,
        note: String::new(),
        vertices: snapshot.vertices.clone(),
        cells: snapshot.cells.clone(),
        borders: snapshot.borders.iter().map(border).collect(),
        cues: snapshot.fields.iter().filter_map(cue).collect(),
        shafts: snapshot.shafts.clone(),
        tips: snapshot.tips.iter().filter_map(tip).collect(),
        targets: snapshot.targets.iter().map(|(_, ring)| ring.clone()).collect(),
    }
}

fn rounded(time: f64) -> f64 {
    (time * 100.0).round() / 100.0
}

fn cue(field: &FieldView) -> Option<CueLayer> {
    let effect = match field.effect? {
        Effect::Attract => colour::Effect::Attract,
        Effect::Repel => colour::Effect::Repel,
    };
    Some(CueLayer { name: field.name.clone(), effect, concentration: field.concentration.clone() })
}

fn tip(tip: &TipView) -> Option<Tip> {
    let status = match tip.status {
        Status::Unborn => return None,
        Status::Withdrawn if tip.is_branch => return None,
        Status::Growing | Status::Waiting => TipStatus::Growing,
        Status::Arrived => TipStatus::Arrived,
        Status::Stalled => TipStatus::Stalled,
        Status::Left => TipStatus::Left,
        Status::Retracting => TipStatus::Retracting,
        Status::Withdrawn => TipStatus::Withdrawn,
    };
    Some(Tip { position: tip.position, status })
}
