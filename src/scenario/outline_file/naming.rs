//! Which closed line is the outer border, and what the sides are called by the lines along them.

use super::{Found, FoundRing};
use crate::numerics::polygon::{SideTree, contains_or_touches};

/// Lines name a side up to this share of the outline's extent away from it.
const REACH: f64 = 1e-5;

/// The rings, the outer one first, with the names that lines give their sides.
pub(super) fn named(found: Found) -> Result<Vec<FoundRing>, String> {
    let Found { mut rings, lines, .. } = found;
    rings.iter_mut().for_each(tidy);
    if let Some(ring) = rings.iter().find(|ring| ring.points.len() < 3) {
        return Err(format!("a closed line of {} points encloses nothing", ring.points.len()));
    }
    if rings.iter().flat_map(|ring| &ring.points).flatten().any(|x| !x.is_finite()) {
        return Err("a coordinate is not finite".to_owned());
    }
    rings.sort_by(|a, b| b.area().total_cmp(&a.area()));
    let Some(outer) = rings.first() else { return Err("no closed line in it: an outline is a polygon".to_owned()) };
    if let Some(place) = rings[1..].iter().position(|ring| !contains_or_touches(&outer.points, ring.points[0])) {
        let [x, y] = rings[1 + place].points[0];
        return Err(format!("closed lines beside each other: the one through ({x}, {y}) lies outside of the largest"));
    }
    let reach = REACH * extent(&outer.points);
    let pieces = |line: &[[f64; 2]]| SideTree::of(line.windows(2).map(|ends| [ends[0], ends[1]]).collect());
    let trees: Vec<_> = lines.iter().map(|(name, line)| (name, pieces(line))).collect();
    for ring in &mut rings {
        let count = ring.points.len();
        for side in 0..count {
            let (a, b) = (ring.points[side], ring.points[(side + 1) % count]);
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            let along = |line: &SideTree| [a, middle, b].iter().all(|point| line.pass(*point, reach));
            if let Some((name, _)) = trees.iter().find(|(_, line)| along(line)) {
                ring.names[side] = Some((*name).clone());
            }
        }
    }
    let unused = lines.iter().find(|(name, _)| !rings.iter().any(|ring| ring.names.contains(&Some(name.clone()))));
    match unused {
        Some((name, _)) => Err(format!("the line \"{name}\" lies along no side of the outline")),
        None => Ok(rings),
    }
}

/// Leaves out points that repeat the one before them, and gives each side a place for its name.
fn tidy(ring: &mut FoundRing) {
    ring.names.resize(ring.points.len(), None);
    let mut place = 0;
    while place < ring.points.len() && ring.points.len() > 1 {
        let next = (place + 1) % ring.points.len();
        if ring.points[place] == ring.points[next] {
            ring.points.remove(place);
            ring.names.remove(place);
        } else {
            place += 1;
        }
    }
}

fn extent(points: &[[f64; 2]]) -> f64 {
    let span = |k: usize| {
        let values = points.iter().map(|point| point[k]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    span(0).max(span(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(points: &[[f64; 2]]) -> FoundRing {
        FoundRing { points: points.to_vec(), names: Vec::new() }
    }

    #[test]
    fn the_largest_ring_is_the_outer_one_and_lines_along_sides_name_them() {
        let square = ring(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]]);
        let hole = ring(&[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]);
        let lines =
            vec![("top".to_owned(), vec![[5.0, 4.0], [0.0, 4.0]]), ("slit".to_owned(), vec![[2.0, 1.0], [2.0, 2.0]])];
        let rings = named(Found { rings: vec![hole, square], lines, ..Found::default() }).unwrap();
        assert_eq!(rings[0].points, [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        assert_eq!(rings[0].names, [None, None, Some("top".to_owned()), None]);
        assert_eq!(rings[1].names, [None, Some("slit".to_owned()), None]);
    }

    #[test]
    fn what_is_no_outline_is_refused() {
        let square = |x: f64| ring(&[[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]]);
        let refusal = |rings: Vec<FoundRing>, lines| named(Found { rings, lines, ..Found::default() }).unwrap_err();
        assert!(refusal(vec![], vec![]).contains("no closed line"));
        assert!(refusal(vec![square(0.0), square(3.0)], vec![]).contains("beside each other"));
        assert!(refusal(vec![ring(&[[0.0, 0.0], [1.0, 0.0]])], vec![]).contains("encloses nothing"));
        assert!(refusal(vec![ring(&[[0.0, f64::NAN], [1.0, 0.0], [2.0, 2.0]])], vec![]).contains("not finite"));
        let stray = vec![("stray".to_owned(), vec![[7.0, 7.0], [8.0, 8.0]])];
        assert!(refusal(vec![square(0.0)], stray).contains("\"stray\" lies along no side"));
    }
}
