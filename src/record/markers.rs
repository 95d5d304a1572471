//! The marks of tips by status, told apart by shape and colour.

use super::colour::hexadecimal;
use super::scene_figure::TipStatus;
use super::svg::{Svg, number};
use super::theme;
use std::fmt::Write;

/// Width of the rim that sets a marker off from what lies below, px.
const RIM: &str = "0.6";

/// Draws the markers of tips of one status: all rims, then all bodies, so that no rim hides the body of a neighbour.
pub(super) fn draw_markers(svg: &mut Svg, status: TipStatus, radius: f64, places: impl Iterator<Item = [f64; 2]>) {
    let data = places.fold(String::new(), |mut data, place| {
        append_marker(&mut data, status, radius, place);
        data
    });
    if data.is_empty() {
        return;
    }
    let fill = hexadecimal(match status {
        TipStatus::Growing => theme::GROWING,
        TipStatus::Arrived => theme::ARRIVED,
        TipStatus::Stalled => theme::STALLED,
        TipStatus::Left => theme::LEFT,
        TipStatus::Retracting => theme::RETRACTING,
        TipStatus::Withdrawn => theme::STALLED,
    });
    let rim = if status == TipStatus::Left { theme::INK } else { "#ffffff" };
    svg.element("path", &[("d", &data), ("fill", "none"), ("stroke", rim), ("stroke-width", RIM)]);
    svg.element("path", &[("d", &data), ("fill", &fill)]);
}

/// Growing: a disc; arrived: a diamond; stalled: a square; left: a triangle; retracting: one that points down; withdrawn: a bar.
fn append_marker(data: &mut String, status: TipStatus, radius: f64, [x, y]: [f64; 2]) {
    let start = |dx: f64, dy: f64| format!("M{} {}", number(x + dx), number(y + dy));
    let r = radius;
    let polygon = |steps: &[[f64; 2]]| {
        steps.iter().fold(String::new(), |text, step| format!("{text}l{} {}", number(step[0]), number(step[1])))
    };
    // Writing to a string cannot fail.
    let _ = match status {
        TipStatus::Growing => {
            let (r, d) = (number(r), number(2.0 * r));
            write!(data, "{}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0", start(-radius, 0.0))
        }
        TipStatus::Arrived => {
            let q = 1.3 * r;
            write!(data, "{}{}z", start(0.0, -q), polygon(&[[q, q], [-q, q], [-q, -q]]))
        }
        TipStatus::Stalled => {
            let q = 0.9 * r;
            write!(data, "{}{}z", start(-q, -q), polygon(&[[2.0 * q, 0.0], [0.0, 2.0 * q], [-2.0 * q, 0.0]]))
        }
        TipStatus::Left => {
            let q = 1.3 * r;
            write!(data, "{}{}z", start(0.0, -q), polygon(&[[q, 1.8 * q], [-2.0 * q, 0.0]]))
        }
        TipStatus::Retracting => {
            let q = 1.3 * r;
            write!(data, "{}{}z", start(0.0, q), polygon(&[[q, -1.8 * q], [-2.0 * q, 0.0]]))
        }
        TipStatus::Withdrawn => {
            let q = 1.1 * r;
            write!(data, "{}{}z", start(-q, -0.4 * q), polygon(&[[2.0 * q, 0.0], [0.0, 0.8 * q], [-2.0 * q, 0.0]]))
        }
    };
}
