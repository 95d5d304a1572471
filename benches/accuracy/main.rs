//! Whether `"accuracy"` keeps what it says, and at what price: `cargo bench --bench accuracy`.
//!
//! Each scene is settled as a run would settle it. The error that is reached is measured over all axons of the scene
//! without contact and noise, against a reference of a quarter of the mesh size (at most a 48th of the tissue's smaller
//! side, no more than 400 000 vertices) and a sixteenth of the step (1024 steps or more), the matrix on a mesh of its own
//! of a quarter of its size (no more than 100 000 vertices). The price is the time of
//! assembly and run at the choice over that of the cheapest of a grid of fixed settings that meets the same accuracy against the same reference: mesh sizes in ratios of √2, four of
//! them coarser than the choice and two finer, each with steps in ratios of 2 from 32 times the choice's down to a
//! quarter of it, on meshes with and without grading toward corners where the choice has it. Seconds are CPU time of one thread, median of three; two scenes at a time, each on a thread of its
//! own.

#[path = "../shared/cpu.rs"]
mod cpu;
mod scenes;

use cpu::cpu_seconds;
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use tropism::prelude::Roster;
use tropism::scenario::load::Request;
use tropism::study::accuracy::find;
use tropism::study::laboratory::{Laboratory, chaotic, cones, root_mean_square, run_until};
use tropism::study::run::RunError;
use tropism::systems;

const REPETITIONS: usize = 3;
/// Vertices of a reference at most.
const MOST_VERTICES: f64 = 4e5;
/// Cells along the tissue's smaller side and steps of a reference at least.
const REFERENCE_CELLS: f64 = 48.0;
const REFERENCE_STEPS: f64 = 1024.0;
/// Mesh sizes of the grid, as powers of √2 of the choice, coarse ones first.
const MESHES: std::ops::RangeInclusive<i32> = -2..=4;
/// Steps of the grid, as powers of 2 of the choice.
const STEPS: std::ops::RangeInclusive<i32> = -2..=5;

/// The key of the matrix' own mesh.
const MATRIX_MESH: &str = "/matrix/mesh_size=";
/// The key of the grading.
const CORNERS: &str = "/tissue/corner_radius=";

/// Tips with the lengths of their paths.
type Tips = Vec<(Vector3<f64>, f64)>;

/// Mesh size (µm), step (h), and whether the mesh is graded toward corners where the choice is.
#[derive(Clone, Copy, PartialEq)]
struct Fixed {
    mesh: f64,
    step: f64,
    graded: bool,
}

struct Row {
    number: u64,
    asked: f64,
    reached: f64,
    estimated: f64,
    claimed: bool,
    chosen: Fixed,
    seconds: f64,
    best: Fixed,
    best_seconds: f64,
    pilot_seconds: f64,
    finer: f64,
    split: usize,
}

fn main() {
    let numbers = Numbered::of_arguments();
    let folder = std::env::temp_dir().join(format!("tropism-accuracy-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let (next, rows) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    println!("{}", Row::HEAD);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
                while let Some(number) = numbers.at(next.fetch_add(1, Ordering::Relaxed)) {
                    match pool.install(|| measured(number, &folder)) {
                        Ok(row) => {
                            println!("{}", row.line());
                            rows.lock().expect("no panic before").push(row);
                        }
                        Err(refusal) => println!("{number:>5} is refused: {refusal}"),
                    }
                }
            });
        }
    });
    let _ = std::fs::remove_dir_all(&folder);
    summarise(&rows.into_inner().expect("no panic before"));
}

/// The scenes asked for by number, or all.
struct Numbered(Vec<u64>);

impl Numbered {
    fn of_arguments() -> Self {
        let given: Vec<u64> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
        Self(if given.is_empty() { (0..scenes::COUNT).collect() } else { given })
    }

    fn at(&self, place: u64) -> Option<u64> {
        self.0.get(place as usize).copied()
    }
}

impl Row {
    const HEAD: &'static str = "scene   asked  reached estimated  split  mesh um    step h  finer  seconds |  \
        mesh um    step h  seconds  ratio | pilots s";

    fn ratio(&self) -> f64 {
        self.seconds / self.best_seconds
    }

    fn met(&self) -> bool {
        self.reached <= self.asked
    }

    fn line(&self) -> String {
        let Self { number, asked, reached, estimated, chosen, seconds, best, best_seconds, .. } = self;
        let mark = if self.met() {
            ' '
        } else if self.claimed {
            '!'
        } else {
            '-'
        };
        format!(
            "{number:>5} {asked:>7} {reached:>8.5}{mark} {estimated:>8.5} {:>6} {:>8.3} {:>9.5} {:>6.1} {seconds:>8.3} | \
             {:>8.3} {:>9.5} \
             {best_seconds:>8.3} {:>6.2} | {:>8.2}",
            self.split,
            chosen.mesh,
            chosen.step,
            self.finer,
            best.mesh,
            best.step,
            self.ratio(),
            self.pilot_seconds
        )
    }
}

fn summarise(rows: &[Row]) {
    let met = rows.iter().filter(|row| row.met()).count();
    let claimed = rows.iter().filter(|row| row.claimed).count();
    let of_claimed = rows.iter().filter(|row| row.claimed && row.met()).count();
    println!("met: {met} of {} scenes; {of_claimed} of the {claimed} that were said to be met", rows.len());
    let mut ratios: Vec<f64> = rows.iter().filter(|row| row.met()).map(Row::ratio).collect();
    if ratios.is_empty() {
        return;
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
    let below = ratios.iter().filter(|ratio| **ratio <= 2.0).count();
    println!(
        "price over that of the cheapest fixed setting, where met: \
         median {:.2}, 95th percentile {:.2}, at most {:.2}; {below} of {} within 2",
        at(0.5),
        at(0.95),
        at(1.0),
        ratios.len()
    );
}

/// A scene to measure.
struct Bench<'a> {
    laboratory: Laboratory<'a>,
    /// Keys besides mesh size and step that were found.
    others: Vec<String>,
    duration: f64,
}

/// Measures a scene, or says why it cannot be run: a matrix may have no equilibrium at its full load.
fn measured(number: u64, folder: &Path) -> Result<Row, RunError> {
    let (scene, asked) = scenes::scene(number);
    let path = folder.join(format!("{number}.json"));
    std::fs::write(&path, scene.to_string()).expect("a file");
    let roster: Roster = systems::standard();
    let request = Request { path, without: Vec::new(), set: Vec::new() };
    let laboratory = Laboratory::new(&request, &roster);
    let start = cpu_seconds();
    let found = find(&laboratory)?.expect("an accuracy");
    let pilot_seconds = cpu_seconds() - start;
    let key = |name: &str| {
        let value = found.set.iter().find_map(|key| key.strip_prefix(name)).expect("a key that was found");
        value.parse::<f64>().expect("a number")
    };
    let chosen = Fixed { mesh: key("/tissue/mesh_size="), step: key("/time/step="), graded: true };
    let others: Vec<String> = found
        .set
        .iter()
        .filter(|key| !key.starts_with("/tissue/mesh_size=") && !key.contains("step="))
        .cloned()
        .collect();
    let duration = scene["time"]["duration"].as_f64().expect("a duration");
    let bench = Bench { laboratory, others, duration };
    let (reference, finer) = bench.reference(chosen, asked, &scene)?;
    let (tips, seconds) = bench.run(chosen, &[])?;
    let reached = error(&tips, &reference);
    let split =
        tips.iter().zip(&reference).filter(|(a, b)| b.1 > 0.0 && (a.0 - b.0).norm() / b.1 > 10.0 * asked).count();
    let best = bench.best(chosen, seconds, asked, &reference);
    let (seconds, best_seconds) = bench.compared(chosen, best)?;
    let estimated = found.estimated;
    Ok(Row {
        number,
        asked,
        reached,
        estimated,
        claimed: found.met,
        chosen,
        seconds,
        best,
        best_seconds,
        pilot_seconds,
        finer,
        split,
    })
}

impl Bench<'_> {
    /// Tips at the end, and the seconds of assembly and run.
    fn run(&self, fixed: Fixed, more: &[String]) -> Result<(Tips, f64), RunError> {
        let mut set = self.others.clone();
        set.retain(|key| fixed.graded || !key.starts_with(CORNERS));
        set.push(format!("/tissue/mesh_size={:e}", fixed.mesh));
        set.push(format!("/time/step={:e}", fixed.step));
        set.extend(more.iter().cloned());
        let without = chaotic(&self.laboratory.scene().expect("a scene"));
        let loaded = self.laboratory.load(&without, &set).expect("a scene");
        let start = cpu_seconds();
        let mut simulation = self.laboratory.assemble(&loaded)?;
        run_until(&mut simulation, self.duration)?;
        let seconds = cpu_seconds() - start;
        Ok((cones(&simulation).iter().map(|cone| (cone.position, cone.length)).collect(), seconds))
    }

    /// Tips of the reference, and how many times its mesh is finer than the choice.
    fn reference(&self, chosen: Fixed, asked: f64, scene: &serde_json::Value) -> Result<(Tips, f64), RunError> {
        let outline = &scene["tissue"]["outline"];
        let corner = &outline["polygon"]["outer"]["points"][2];
        let side = |name: &str, k: usize| outline["rectangle"][name].as_f64().or(corner[k].as_f64()).expect("a side");
        let finest = (1.155 * side("width", 0) * side("height", 1) / MOST_VERTICES).sqrt();
        let coarsest = side("width", 0).min(side("height", 1)) / REFERENCE_CELLS;
        let mesh = (chosen.mesh / 4.0).min(coarsest).max(finest);
        let step = (chosen.step / 16.0).min(self.duration / REFERENCE_STEPS);
        let mut more = Vec::new();
        if scene.get("matrix").is_some() {
            let own = self.others.iter().find_map(|key| key.strip_prefix(MATRIX_MESH)?.parse::<f64>().ok());
            let own = own.map(|own| (own / 4.0).min(coarsest).max(2.0 * finest));
            more.push(format!("/matrix/tolerance={:e}", 1e-4 * asked));
            more.push(format!("{MATRIX_MESH}{}", own.map_or("null".to_owned(), |size| format!("{size:e}"))));
        }
        Ok((self.run(Fixed { mesh, step, graded: true }, &more)?.0, chosen.mesh / mesh))
    }

    /// The cheapest fixed setting that can be run and meets the accuracy; the choice itself if none is cheaper.
    fn best(&self, chosen: Fixed, seconds: f64, asked: f64, reference: &Tips) -> Fixed {
        let (mut best, mut least) = (chosen, seconds);
        let corners = self.others.iter().any(|key| key.starts_with(CORNERS));
        let sizes = MESHES.rev().map(|k| chosen.mesh * 2f64.powf(0.5 * f64::from(k)));
        let meshes = sizes.flat_map(|mesh| [(mesh, true), (mesh, false)]).filter(|(_, graded)| *graded || corners);
        for (mesh, graded) in meshes {
            for step in STEPS.rev().map(|k| chosen.step * 2f64.powi(k)).filter(|step| *step < 0.25 * self.duration) {
                let Ok((tips, seconds)) = self.run(Fixed { mesh, step, graded }, &[]) else { break };
                if error(&tips, reference) <= asked && seconds < least {
                    (best, least) = (Fixed { mesh, step, graded }, seconds);
                }
                if seconds >= least {
                    break;
                }
            }
        }
        best
    }

    /// Seconds of the choice and of the best, in turn, median of each.
    fn compared(&self, chosen: Fixed, best: Fixed) -> Result<(f64, f64), RunError> {
        let pairs = (0..REPETITIONS)
            .map(|_| Ok((self.run(chosen, &[])?.1, self.run(best, &[])?.1)))
            .collect::<Result<Vec<(f64, f64)>, RunError>>()?;
        let median = |pick: fn(&(f64, f64)) -> f64| {
            let mut seconds: Vec<f64> = pairs.iter().map(pick).collect();
            seconds.sort_by(f64::total_cmp);
            seconds[seconds.len() / 2]
        };
        Ok((median(|pair| pair.0), if chosen == best { median(|pair| pair.0) } else { median(|pair| pair.1) }))
    }
}

/// Root mean square of the distance between tips over the length of their paths.
fn error(tips: &Tips, reference: &Tips) -> f64 {
    let grown = tips.iter().zip(reference).filter(|(_, reference)| reference.1 > 0.0);
    root_mean_square(grown.map(|(tip, reference)| (tip.0 - reference.0).norm() / reference.1))
}
