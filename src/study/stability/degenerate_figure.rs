//! The figure of the degenerate scenes.

use super::Figure;
use super::degenerate::{DegenerateMap, End, Outcome};
use crate::record::plot::{Axis, Plot, Series, Stroke};

impl DegenerateMap {
    /// Paths at the border; distances from a maximum or in no gradient; the gap between coincident shafts.
    pub fn figure(&self) -> Figure {
        let lines = |names: &[&str], stroke: Stroke, of: &dyn Fn(&Outcome) -> Vec<[f64; 2]>| -> Vec<Series> {
            let shown = names.iter().filter_map(|name| self.scene(name));
            shown.map(|outcome| Series::new(words(outcome.name), of(outcome), stroke)).collect()
        };
        let plot = |title: &str, x: Axis, y: Axis, series, note: String| Plot {
            title: title.into(),
            x,
            y,
            series,
            levels: Vec::new(),
            marks: Vec::new(),
            note,
        };
        let path = |outcome: &Outcome| {
            outcome.paths.first().map(|path| path.iter().map(|[_, x, y]| [*x, *y]).collect()).unwrap_or_default()
        };
        let from_middle = |outcome: &Outcome| outcome.distances_from([100.0, 75.0]);
        let count = |end: End| self.scenes.iter().filter(|outcome| outcome.end == end).count();
        let ends = format!(
            "of {} scenes {} end, {} by a fault; {} cannot be solved, {} are refused",
            self.scenes.len(),
            count(End::Complete) + count(End::Fault),
            count(End::Fault),
            count(End::Unsolved),
            count(End::Refused)
        );
        Figure {
            name: "degenerate",
            title: "Degenerate scenes",
            subtitle: "cones of 20 µm/h in a tissue of 200 × 150 µm",
            plots: vec![
                plot(
                    "at the border",
                    Axis { range: Some([175.0, 205.0]), ..Axis::linear("x (µm)") },
                    Axis { range: Some([125.0, 155.0]), ..Axis::linear("y (µm)") },
                    lines(
                        &["corner_slide", "corner_leave", "endless_step_slide", "endless_step_stall"],
                        Stroke::LineAndMarks,
                        &path,
                    ),
                    ends,
                ),
                plot(
                    "without a gradient",
                    Axis::linear("t (h)"),
                    Axis::linear("distance from the start (µm)"),
                    lines(
                        &["source_maximum", "source_maximum_noise", "zero_gradient", "facing_away"],
                        Stroke::Line,
                        &from_middle,
                    ),
                    "leaving a maximum a cone looks straight away from the pull, which turns nothing; noise ends that"
                        .into(),
                ),
                plot(
                    "two shafts in one place",
                    Axis::linear("t (h)"),
                    Axis { range: Some([0.0, 1.0]), ..Axis::linear("distance of the second from the first (µm)") },
                    lines(&["coincident_together", "coincident_later"], Stroke::Line, &Outcome::gap),
                    "attraction vanishes at contact: round-off does not part them".into(),
                ),
            ],
        }
    }
}

fn words(name: &str) -> String {
    name.replace('_', " ")
}
