//! SVG: visible closed shapes are rings, visible open lines name the sides that they run along by their `id`. Curves become straight
//! sides. The drawing's y points down, the tissue's up: it stands as it is seen, its lower edge at y = 0.
//!
//! Coordinates have single precision (24 bits). Nothing that the drawing refers to is read.

use super::{Found, FoundRing};
use resvg::tiny_skia::{PathSegment, Point};
use resvg::usvg::{Group, ImageHrefResolver, Node, Options, Path, Tree};

/// Straight sides of a whole drawing at most.
const MOST_SIDES: usize = 100_000;

/// The shapes of a drawing; `tolerance` in its units.
pub(super) fn read(text: &str, tolerance: f64) -> Result<Found, String> {
    let blind = ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
    let options = Options { image_href_resolver: blind, ..Options::default() };
    let tree = Tree::from_str(text, &options).map_err(|error| error.to_string())?;
    let mut found = Found::default();
    add(tree.root(), (f64::from(tree.size().height()), tolerance), (&mut found, &mut 0))?;
    Ok(found)
}

fn add(group: &Group, drawing: (f64, f64), (found, sides): (&mut Found, &mut usize)) -> Result<(), String> {
    for node in group.children() {
        match node {
            Node::Group(inner) => add(inner, drawing, (found, sides))?,
            Node::Path(path) => add_path(path, drawing, (found, sides))?,
            Node::Image(_) | Node::Text(_) => {}
        }
    }
    Ok(())
}

/// Adds the parts of a path: closed ones as rings, open ones as lines.
fn add_path(
    path: &Path,
    (height, tolerance): (f64, f64),
    (found, sides): (&mut Found, &mut usize),
) -> Result<(), String> {
    let Some(placed) = path.data().clone().transform(path.abs_transform()) else { return Ok(()) };
    let upright = |point: Point| [f64::from(point.x), height - f64::from(point.y)];
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut end = |points: &mut Vec<[f64; 2]>, closed: bool| -> Result<(), String> {
        let points = std::mem::take(points);
        let closed = closed || (points.len() > 3 && points.first() == points.last());
        match (closed, points.len(), path.id()) {
            (_, 0 | 1, _) => {}
            (true, ..) => found.rings.push(FoundRing { points, names: Vec::new() }),
            (false, _, "") => {
                return Err("an open line without `id`: the id is what the sides along it are called".to_owned());
            }
            (false, _, name) => found.lines.push((name.to_owned(), points)),
        }
        Ok(())
    };
    for segment in placed.segments() {
        let before = points.len();
        match segment {
            PathSegment::MoveTo(to) => {
                end(&mut points, false)?;
                points.push(upright(to));
            }
            PathSegment::LineTo(to) => points.push(upright(to)),
            PathSegment::QuadTo(control, to) => curve(&mut points, &[upright(control), upright(to)], tolerance)?,
            PathSegment::CubicTo(one, two, to) => {
                curve(&mut points, &[upright(one), upright(two), upright(to)], tolerance)?
            }
            PathSegment::Close => end(&mut points, true)?,
        }
        *sides += points.len().saturating_sub(before);
        if *sides > MOST_SIDES {
            return Err(too_many_sides());
        }
    }
    end(&mut points, false)
}

/// Adds straight pieces of a Bézier curve from the last point on. With n pieces they are at most d(d−1)M/(8n²) away, where d is the degree
/// and M the largest second difference of the control points.
fn curve(points: &mut Vec<[f64; 2]>, controls: &[[f64; 2]], tolerance: f64) -> Result<(), String> {
    let Some(&start) = points.last() else { return Ok(()) };
    let all: Vec<[f64; 2]> = std::iter::once(start).chain(controls.iter().copied()).collect();
    let degree = (all.len() - 1) as f64;
    let bend = |three: &[[f64; 2]]| {
        let second = |k: usize| three[0][k] - 2.0 * three[1][k] + three[2][k];
        second(0).hypot(second(1))
    };
    let most = all.windows(3).map(bend).fold(0.0, f64::max);
    let pieces = (degree * (degree - 1.0) * most / (8.0 * tolerance)).sqrt().ceil().max(1.0);
    if pieces > MOST_SIDES as f64 {
        return Err(too_many_sides());
    }
    points.extend((1..=pieces as usize).map(|i| casteljau(&all, i as f64 / pieces)));
    Ok(())
}

fn too_many_sides() -> String {
    format!("its curves would become more than {MOST_SIDES} straight sides; a larger tolerance makes fewer")
}

/// The point of a Bézier curve at t ∈ [0, 1].
fn casteljau(controls: &[[f64; 2]], t: f64) -> [f64; 2] {
    match controls {
        [only] => *only,
        _ => {
            let between = |pair: &[[f64; 2]]| [0, 1].map(|k| (1.0 - t) * pair[0][k] + t * pair[1][k]);
            casteljau(&controls.windows(2).map(between).collect::<Vec<_>>(), t)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::polygon::signed_area;

    fn drawing(inside: &str) -> String {
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"50\">{inside}</svg>")
    }

    #[test]
    fn a_rectangle_stands_upright_and_a_line_names_by_its_id() {
        let text =
            drawing("<rect x='10' y='20' width='30' height='20'/><path id='base' stroke='red' d='M 10 40 H 40'/>");
        let found = read(&text, 0.1).unwrap();
        let mut points = found.rings[0].points.clone();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        points.dedup();
        assert_eq!(points, [[10.0, 10.0], [10.0, 30.0], [40.0, 10.0], [40.0, 30.0]]);
        assert_eq!(found.lines, [("base".to_owned(), vec![[10.0, 10.0], [40.0, 10.0]])]);
    }

    #[test]
    fn a_circle_is_flattened_to_the_tolerance() {
        for tolerance in [1.0, 0.01] {
            let found = read(&drawing("<g transform='translate(5 0)'><circle cx='45' cy='25' r='20'/></g>"), tolerance)
                .unwrap();
            let points = &found.rings[0].points;
            let sagitta = |pair: &[[f64; 2]]| {
                let middle = [0.5 * (pair[0][0] + pair[1][0]), 0.5 * (pair[0][1] + pair[1][1])];
                20.0 - (middle[0] - 50.0).hypot(middle[1] - 25.0)
            };
            let worst = points.windows(2).map(sagitta).fold(0.0, f64::max);
            // A circle of Bézier curves is itself off by 3e-4 of its radius.
            assert!(worst < tolerance + 6e-3, "{worst}");
            let area = signed_area(points).abs();
            assert!((area / (std::f64::consts::PI * 400.0) - 1.0).abs() < 0.1 * tolerance.sqrt(), "{area}");
        }
    }

    #[test]
    fn curves_that_need_more_sides_than_memory_should_hold_are_refused() {
        for radius in ["1e9", "14444444444444444444444440"] {
            let circle = drawing(&format!("<g transform='rotate(10)'><circle cx='45' cy='25' r='{radius}'/></g>"));
            assert!(read(&circle, 1e-6).unwrap_err().contains("a larger tolerance"), "{radius}");
        }
    }

    #[test]
    fn what_is_no_drawing_is_refused_and_nothing_outside_is_read() {
        assert!(read("<svg", 1.0).is_err());
        assert!(read(&drawing("<path stroke='red' d='M 0 0 L 9 9'/>"), 1.0).unwrap_err().contains("without `id`"));
        let found = read(&drawing("<image href='/etc/hostname' width='9' height='9'/>"), 1.0).unwrap();
        assert_eq!(found, Found::default());
    }
}
