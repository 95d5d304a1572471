//! The neighbours' chart: a grid and an R-tree, both with lists, against a look at every segment of every shaft.

use super::work_precision::{Factor, Point, short, time};
use crate::study::laboratory::{Laboratory, Setting, cones};
use crate::study::run::RunError;
use std::collections::BTreeMap;

/// Axons of a population as shares of the scene's own.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 1.0];
/// The part of the run that is timed.
const RUN_SHARE: f64 = 0.25;
const METHODS: [(&str, &str); 3] = [("grid", "grid"), ("R-tree", "tree"), ("every segment", "all")];

/// Time for contact against the number of axons; none in a scene without contact.
///
/// # Errors
/// A scene that cannot be assembled or run; methods that disagree in a single bit.
pub fn chart(laboratory: &Laboratory, tick: &dyn Fn(f64)) -> Result<Option<Factor>, RunError> {
    let scene = laboratory.scene()?;
    if !scene.blocks.contains_key("fasciculation") {
        return Ok(None);
    }
    let stop = RUN_SHARE * scene.scene.time.duration.0;
    let mut points = Vec::new();
    for (done, share) in SHARES.into_iter().enumerate() {
        tick(done as f64 / SHARES.len() as f64);
        let scaled = |count: u64| ((share * count as f64).round() as u64).max(1);
        let token = crate::model::violation::pointer_token;
        let populations = scene.scene.populations.iter();
        let counts: Vec<String> =
            populations.map(|(name, p)| format!("/populations{}/count={}", token(name), scaled(p.count))).collect();
        let axons: u64 = scene.scene.populations.values().map(|p| scaled(p.count)).sum();
        let mut seen = Vec::new();
        for (method, key) in METHODS {
            let set = [counts.as_slice(), &[format!("/fasciculation/neighbours={key}")]].concat();
            let loaded = laboratory.load(&[], &set)?;
            let (simulation, seconds) = laboratory.timed_run(&loaded, stop, &["neighbours", "contact"])?;
            let setting = Setting {
                method: method.to_owned(),
                words: format!("{axons} axons"),
                knob: axons as f64,
                set,
                default: share == 1.0 && key == METHODS[0].1,
            };
            let counters = simulation.counters();
            let counts = [("segments", counters.indexed_segments), ("queries", counters.neighbour_queries)];
            let counts = counts.map(|(name, count)| (name.to_owned(), count as f64)).into();
            points.push(setting.point(seconds, BTreeMap::new(), counts));
            seen.push(cones(&simulation));
        }
        if seen.windows(2).any(|pair| pair[0] != pair[1]) {
            return Err(RunError::Internal(format!("the neighbour searches disagree for {axons} axons")));
        }
    }
    let remark =
        format!("Up to t = {} h. All give every cone the same place and heading, to the last bit.", short(stop));
    Ok(Some(Factor {
        name: "neighbours".into(),
        title: "Neighbours: grid and R-tree with lists against every segment".into(),
        knob: "axons".into(),
        errors: Vec::new(),
        advice: compare(&points),
        points,
        remark,
    }))
}

fn compare(points: &[Point]) -> String {
    let last = |(method, _): (&str, &str)| points.iter().rev().find(|point| point.method == method);
    match METHODS.map(last) {
        [Some(grid), Some(tree), Some(all)] => format!(
            "At {} the grid takes {}; the tree takes {} times as long, a look at every segment {} times.",
            grid.setting,
            time(grid.seconds.median),
            short(tree.seconds.median / grid.seconds.median),
            short(all.seconds.median / grid.seconds.median)
        ),
        _ => String::new(),
    }
}
