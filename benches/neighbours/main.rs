//! What finding the neighbours of growth cones costs with six structures, by themselves: `cargo bench --bench neighbours`, or
//! `cargo bench --bench neighbours -- 1000 20000` for other numbers of axons.
//!
//! Load: axons start one in 30 µm by 30 µm of a square with walls that reflect, and are numbered along a Morton curve, so that neighbours
//! in number are near in space. Each keeps a heading of its own, which turns by a little at random, and grows by 2 µm a step; at its start
//! and every five steps it lays a vertex. A segment leads from a vertex to the next of its axon, or to the tip. At each step each cone
//! counts the segments of other axons within 10 µm, and adds their distances up, rounded to 1e-6 µm as integers, so that no order
//! shows. All structures must find the same at each step, and the same as looking at everything (up to a thousand axons, the first steps).
//!
//! - *tree, asked*: an R-tree of the vertices, asked by each cone at each step.
//! - *tree, lists*: the same tree, asked once for each square of three reaches, when the first cone comes to it; what is laid later is added
//!   to the lists that there are. A cone looks at the list of its square.
//! - *grid, asked*: cells of the reach and the longest segment, each with the vertices in it; a cone looks at 3 by 3 of them.
//! - *grid, lists*: squares of three reaches; a vertex is put into the lists of all squares near it as it is laid, and a cone looks at the list
//!   of its square.
//! - *tree, skins*; *grid, skins*: a list for each cone of what lies within the reach and a skin as wide about where it was, made by asking the tree or the cells
//!   when it has gone by the skin; what is laid meanwhile is added to the lists of the cones near it.
//!
//! The lists are plain: vertices by number, without the parts of squares that `systems/shaft_index.rs` has. What is looked at is judged by the
//! same function, which drops a segment that begins too far off before it looks for its end. Seconds are CPU time of one thread, those of
//! asking with the lists that are made on the way; medians of three up to 10 000 axons, one run each beyond, the six in turn.

#[path = "../shared/cpu.rs"]
mod cpu;
mod load;
mod structures;

use cpu::cpu_seconds;
use load::{Found, Load};
use structures::{Cells, Everything, GridLists, Neighbours, Skins, Tree, TreeLists};

/// Numbers of axons where none are given.
const AXONS: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];
/// Axons of which some are timed several times over, at most.
const REPEATED: usize = 10_000;
const REPETITIONS: usize = 3;
/// Axons that are held against looking at everything, at most, and the steps for which they are.
const CHECKED: usize = 1_000;
const CHECKED_STEPS: usize = 20;

const STEPS: usize = 60;
/// Steps from one vertex to the next.
const STEPS_A_VERTEX: usize = 5;

fn main() {
    let given: Vec<usize> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let numbers = if given.is_empty() { AXONS.to_vec() } else { given };
    println!(
        "{:>8} {:>5} {:<12} {:>9} {:>9} {:>12} {:>9} {:>6}",
        "axons", "steps", "structure", "insert s", "ask s", "ns/cone-step", "MiB", "ratio"
    );
    numbers.into_iter().for_each(compare);
}

/// Times all structures with a number of axons, sees that they find the same, and prints a line for each.
fn compare(axons: usize) {
    let structures: [(&str, Runner); 6] = [
        ("tree, asked", run::<Tree>),
        ("tree, lists", run::<TreeLists>),
        ("grid, asked", run::<Cells>),
        ("grid, lists", run::<GridLists>),
        ("tree, skins", run::<Skins<Tree>>),
        ("grid, skins", run::<Skins<Cells>>),
    ];
    let repetitions = if axons <= REPEATED { REPETITIONS } else { 1 };
    let mut runs = structures.map(|_| Vec::new());
    for _ in 0..repetitions {
        for (runs, (_, run)) in runs.iter_mut().zip(structures) {
            runs.push(run(axons, STEPS));
        }
    }
    let found = runs[0][0].found.clone();
    assert!(runs.iter().flatten().all(|run| run.found == found), "all structures find the same");
    if axons <= CHECKED {
        let all = run::<Everything>(axons, CHECKED_STEPS).found;
        assert_eq!(all, found[..CHECKED_STEPS], "what is found is all that there is");
    }
    let cone_steps = (axons * STEPS) as f64;
    let times = runs.each_ref().map(|runs| (median(runs, |run| run.insert), median(runs, |run| run.ask)));
    let least = times.iter().map(|(insert, ask)| insert + ask).fold(f64::INFINITY, f64::min);
    for (((name, _), runs), (insert, ask)) in structures.iter().zip(&runs).zip(times) {
        let total = insert + ask;
        println!(
            "{axons:>8} {STEPS:>5} {name:<12} {insert:>9.4} {ask:>9.4} {:>12.0} {:>9.1} {:>6.2}",
            1e9 * total / cone_steps,
            runs[0].bytes as f64 / f64::from(1 << 20),
            total / least
        );
    }
    let count = found.iter().map(|found| found.count).sum::<u64>() as f64;
    println!("{axons:>8} {STEPS:>5} all find the same {:.2} segments within reach of a cone", count / cone_steps);
}

fn median(runs: &[Run], seconds: impl Fn(&Run) -> f64) -> f64 {
    let mut seconds: Vec<f64> = runs.iter().map(seconds).collect();
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

/// What a structure took, and what was found by it at each step.
struct Run {
    insert: f64,
    ask: f64,
    bytes: usize,
    found: Vec<Found>,
}

/// Runs a number of axons for a number of steps.
type Runner = fn(usize, usize) -> Run;

/// Lets axons grow for some steps, with one structure to find neighbours by.
fn run<N: Neighbours>(axons: usize, steps: usize) -> Run {
    let mut load = Load::new(axons);
    let mut neighbours = N::new(load.side);
    let mut run = Run { insert: 0.0, ask: 0.0, bytes: 0, found: Vec::with_capacity(steps) };
    for step in 0..steps {
        if step % STEPS_A_VERTEX == 0 {
            let laid = load.lay_vertices();
            let start = cpu_seconds();
            laid.for_each(|vertex| neighbours.insert(vertex as u32, load.vertices[vertex].at));
            run.insert += cpu_seconds() - start;
        }
        load.grow();
        let start = cpu_seconds();
        let found = load.find(&mut neighbours);
        run.ask += cpu_seconds() - start;
        run.found.push(found);
    }
    run.bytes = neighbours.bytes();
    run
}
