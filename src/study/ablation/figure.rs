//! The figure of an ablation: the end of the first seed's run in each arm, side by side.

use super::{Ablation, Arm};
use crate::record::scene_figure::{FigureError, Panel, SceneFigure, draw};
use crate::record::scene_view::panel;
use crate::record::svg::Svg;

impl Ablation {
    /// A panel an arm whose first run came to its end; none if there is no such arm.
    ///
    /// # Errors
    /// Data that are not finite.
    pub fn figure(&self) -> Result<Option<Svg>, FigureError> {
        let panels: Vec<Panel> = self.arms.iter().filter_map(|arm| self.panel(arm)).collect();
        let Some(end) = self.arms.iter().find_map(|arm| arm.end.as_ref()) else { return Ok(None) };
        let (hours, seed) = (end.time, self.seeds.first().copied().unwrap_or_default());
        let subtitle =
            format!("The end of the run (t = {hours} h) in each arm, with the random numbers of seed {seed}");
        draw(&SceneFigure::new(format!("{}: ablation", self.scene), subtitle, panels)).map(Some)
    }

    fn panel(&self, arm: &Arm) -> Option<Panel> {
        let first = |measure: &str| arm.values.get(measure).and_then(|row| *row.first()?);
        let mut notes = Vec::new();
        notes.extend(first("hits.fraction").map(|fraction| format!("hit\u{a0}fraction\u{a0}{fraction:.2}")));
        let spread = self.heights.len().checked_sub(1).and_then(|last| first(&format!("heights.{last}.spread_um")));
        notes.extend(spread.map(|spread| format!("spread\u{a0}{spread:.0}\u{a0}µm")));
        Some(Panel { note: notes.join(", "), ..panel(arm.name.clone(), arm.end.as_ref()?) })
    }
}
