//! What a mechanism costs, in instructions: `cargo bench --bench instructions` (needs valgrind; about a minute and a half).
//!
//! The program runs itself under callgrind, which counts the instructions of N steps of a small scene after N others, on one thread, and
//! nothing of what happens before. Twice so: with the roster that comes with the program, and with one that has the scene's mechanisms
//! only. Off is absence, so both must agree, the least of a few counts each: within 0.1 %, or the program ends with 1. Then a table: one mechanism after the other joins
//! the scene. What the largest scene takes may not exceed the number stored in `instructions.json` by more than 3 %; where it is less by
//! as much, the number is to be stored anew (`-- --store`).

use serde_json::{Value, json};
use std::process::{Command, ExitCode};
use tropism::prelude::Roster;
use tropism::simulation::Simulation;
use tropism::study::run::read_document;
use tropism::systems;

/// Steps before the count, and steps that are counted.
const STEPS: usize = 30;
/// Largest difference of the two rosters, as a share.
const ALLOWED: f64 = 1e-3;
/// How often both are counted again where they differ by more: addresses and hashes are drawn anew in each process and move a count by
/// up to 0.3 %, so that the least of several is what counts.
const COUNTS: usize = 6;
/// Growth over the stored number that is allowed, as a share.
const GROWTH: f64 = 0.03;
/// Where the number is stored.
const STORED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/instructions.json");
/// Marks a run that valgrind watches.
const CHILD: &str = "--watched";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    match arguments.iter().position(|argument| argument == CHILD) {
        Some(place) => watched(&arguments[place + 1..]),
        None => compare(arguments.iter().any(|argument| argument == "--store")),
    }
}

/// The blocks in the order in which they join the scene; one that needs another comes after it.
fn blocks() -> Vec<(&'static str, Value)> {
    let band = [[0, 60], [200, 60], [200, 90], [0, 90]];
    let motion = json!({ "outward": 0.1 });
    let disc = json!({ "disc": { "centre": [100, 130], "radius": 15 } });
    vec![
        ("heading_noise", json!({})),
        ("borders", json!({})),
        ("matrix", json!({ "motion": { "top": motion, "bottom": motion } })),
        ("cues", json!({ "attractant": { "sources": [disc] } })),
        ("chemotaxis", json!({ "receptors": { "attractant": {} } })),
        ("fasciculation", json!({})),
        ("growth_rate_modulation", json!({ "cue": "attractant" })),
        ("steric_repulsion", json!({ "distance": "8 um" })),
        ("leader_follower", json!({ "regions": { "band": { "polygon": { "points": band } } } })),
        ("durotaxis", json!({ "profile": [[0, 200], [200, 800]] })),
        ("bending_stiffness", json!({})),
    ]
}

/// Scene number `number` has the first so many blocks.
fn scene(number: usize) -> Value {
    let mut scene = json!({
        "seed": 1,
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": 15 },
        "time": { "duration": 6, "step": "3 min" },
        "populations": { "axons": { "count": 40, "speed": 12, "births": { "at": 0 } } }
    });
    blocks().into_iter().take(number).for_each(|(name, block)| scene[name] = block);
    scene
}

/// The roster of the program, or one of the first so many mechanisms alone, in the order of the program's.
fn roster(whole: bool, number: usize) -> Roster {
    if whole {
        return systems::standard();
    }
    let names: Vec<&str> = blocks().into_iter().take(number).map(|(name, _)| name).collect();
    let own = systems::standard().names().into_iter().filter(|name| names.contains(name));
    own.fold(Roster::new(), |roster, name| match name {
        "matrix" => {
            roster.with::<systems::matrix::Matrix>().with_material::<systems::materials::StVenantKirchhoffLaw>()
        }
        "cues" => roster.with::<systems::cue_fields::Cues>(),
        "chemotaxis" => roster.with::<systems::chemotaxis::Chemotaxis>(),
        "fasciculation" => roster.with::<systems::fasciculation::Fasciculation>(),
        "borders" => roster.with::<systems::borders::Borders>(),
        "heading_noise" => roster.with::<systems::heading_noise::HeadingNoise>(),
        _ => panic!("no roster of its own with `{name}`"),
    })
}

/// One run: `whole` or `own`, and the number of the scene.
fn watched(arguments: &[String]) -> ExitCode {
    let number = arguments[1].parse::<usize>().expect("a number");
    let roster = roster(arguments[0] == "whole", number);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let cone_steps = pool.install(|| {
        let loaded = read_document("scene", scene(number), &roster).unwrap_or_else(|error| panic!("{error}"));
        let mut simulation = Simulation::assemble(&loaded, &roster).unwrap_or_else(|error| panic!("{error}"));
        take_steps(&mut simulation);
        let before = simulation.counters().cone_steps;
        counted_steps(&mut simulation);
        simulation.counters().cone_steps - before
    });
    println!("cone-steps {cone_steps}");
    ExitCode::SUCCESS
}

fn take_steps(simulation: &mut Simulation) {
    (0..STEPS).for_each(|_| simulation.step().unwrap_or_else(|fault| panic!("{fault}")));
}

/// The steps that callgrind counts: it knows them by the name of this function.
#[inline(never)]
fn counted_steps(simulation: &mut Simulation) {
    take_steps(simulation);
}

/// Instructions a cone-step of scene `number`.
fn per_cone_step(kind: &str, number: usize) -> Result<f64, String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=*counted_steps*", "--callgrind-out-file=/dev/null"])
        .arg(own)
        .args([CHILD, kind, &number.to_string()])
        .output()
        .map_err(|error| format!("valgrind, which counts the instructions, could not be started: {error}"))?;
    let [said, counted] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    let after =
        |text: &str, word: &str| text.lines().find_map(|line| line.split_once(word)?.1.trim().parse::<f64>().ok());
    match (after(&counted, "Collected :"), after(&said, "cone-steps")) {
        (Some(instructions), Some(cone_steps)) if instructions > 0.0 => Ok(instructions / cone_steps),
        _ => Err(format!("a run of scene {number} ended without its counts:\n{said}{counted}")),
    }
}

fn compare(store: bool) -> ExitCode {
    let judged = report().and_then(|(equal, now)| Ok(equal & if store { keep(now)? } else { within(now)? }));
    match judged {
        Ok(passed) => ExitCode::from(u8::from(!passed)),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

/// Stores the number of the largest scene.
fn keep(now: f64) -> Result<bool, String> {
    let stored = json!({ "instructions_a_cone_step": now.round() });
    std::fs::write(STORED, format!("{stored:#}\n")).map_err(|error| format!("{STORED}: {error}"))?;
    Ok(true)
}

/// Whether the number of the largest scene keeps to the stored one.
fn within(now: f64) -> Result<bool, String> {
    let text = std::fs::read_to_string(STORED).map_err(|error| format!("{STORED}: {error}"))?;
    let stored = serde_json::from_str::<Value>(&text).ok().and_then(|value| value["instructions_a_cone_step"].as_f64());
    let stored = stored.ok_or_else(|| format!("{STORED}: no instructions_a_cone_step"))?;
    let growth = now / stored - 1.0;
    println!("\n{now:.0} instructions a cone-step with all of them, stored {stored:.0}: {:+.2} %", 100.0 * growth);
    if growth.abs() > GROWTH {
        let advice = if growth > 0.0 { "find out why" } else { "store it by -- --store" };
        eprintln!("that is more than {:.0} % away: {advice}", 100.0 * GROWTH);
    }
    Ok(growth <= GROWTH)
}

/// Prints both tables: whether absent mechanisms cost nothing, and what the largest scene takes.
fn report() -> Result<(bool, f64), String> {
    println!("instructions a cone-step; 40 cones, {STEPS} steps after {STEPS}, one thread");
    println!("{:>12} {:>12} {:>10}   mechanisms of the scene", "own roster", "whole roster", "difference");
    let mut equal = true;
    for number in [0, 2, 6] {
        let (mut own, mut whole) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..COUNTS {
            (own, whole) = (own.min(per_cone_step("own", number)?), whole.min(per_cone_step("whole", number)?));
            if (whole / own - 1.0).abs() <= ALLOWED {
                break;
            }
        }
        let difference = whole / own - 1.0;
        equal &= difference.abs() <= ALLOWED;
        let names: Vec<&str> = blocks().into_iter().take(number).map(|(name, _)| name).collect();
        let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        println!("{own:>12.1} {whole:>12.1} {:>+9.4}%   {names}", 100.0 * difference);
    }
    println!("\n{:>12} {:>12}   one more mechanism", "in all", "more");
    let mut before = per_cone_step("whole", 0)?;
    println!("{before:>12.1} {:>12}   none", "");
    for (place, (name, _)) in blocks().iter().enumerate() {
        let now = per_cone_step("whole", place + 1)?;
        println!("{now:>12.1} {:>+12.1}   {name}", now - before);
        before = now;
    }
    if !equal {
        eprintln!("mechanisms that a scene does not have cost it more than {:.1} % of its step", 100.0 * ALLOWED);
    }
    Ok((equal, before))
}
