//! A run that stops and goes on from its checkpoint leaves what it would have left: the same bits, for every scenario and mechanism, on
//! any number of threads.

#[path = "../common/mod.rs"]
mod common;
mod records;
mod refused;

use common::{Folder, hash_of_states, loaded};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tropism::model::keep::Keep;
use tropism::record::checkpoint::Checkpoint;
use tropism::record::scene_view::scene_figure;
use tropism::scenario::load::{Loaded, Request};
use tropism::study::report::Asked;
use tropism::study::resume::{Checkpoints, resumed};
use tropism::study::run::{Ended, Records, Run, read};
use tropism::systems;

/// What a run leaves, but for what the clock on the wall says.
#[derive(Debug, PartialEq)]
struct Outputs {
    trajectories: String,
    summary: Value,
    figure: String,
    recorder: Vec<u8>,
    states: u64,
}

fn outputs(loaded: &Loaded, mut run: Run) -> Outputs {
    run.simulation.bring_tissue_here();
    let states = hash_of_states(run.simulation.world());
    let ended = if run.simulation.is_over() { Ended::Done } else { panic!("not over") };
    let finished = run.finish(loaded, &ended).unwrap();
    let mut summary = serde_json::to_value(&finished.summary).unwrap();
    for key in ["seconds", "share", "peak_memory_mib"] {
        summary["cost"].as_object_mut().unwrap().remove(key).unwrap();
    }
    let mut recorder = Vec::new();
    finished.recorder.keep(&mut recorder);
    let figure = scene_figure(&loaded.scene.name, &loaded.scene.description, &finished.recorder.snapshots);
    let figure = figure.map(|figure| figure.finish()).unwrap_or_default();
    Outputs { trajectories: finished.recorder.trajectories.as_str().to_owned(), summary, figure, recorder, states }
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// Runs a scene to its end, with a checkpoint at each of some shares of it.
fn whole(loaded: &Loaded, path: &Path, shares: &[f64]) -> (Outputs, Vec<Checkpoint>) {
    let mut run =
        Run::begin(loaded, &systems::standard(), path, Records::ALL).unwrap_or_else(|error| panic!("{error}"));
    let checkpoints = Checkpoints::new(Path::new("nowhere"), None, (Asked { loaded, command: "tropism" }, path));
    let mut taken = Vec::new();
    let ended = run.to_end(|run| {
        if shares.get(taken.len()).is_some_and(|share| run.simulation.progress() >= *share) {
            taken.push(checkpoints.of(run).unwrap());
        }
        None
    });
    assert_eq!(ended.unwrap(), Ended::Done, "{}", path.display());
    assert_eq!(taken.len(), shares.len(), "{}", path.display());
    (outputs(loaded, run), taken)
}

/// Goes on from the bytes of a checkpoint in a world of its own.
fn gone_on(checkpoint: &Checkpoint, threads: usize) -> Outputs {
    let read = Checkpoint::from_bytes(&checkpoint.to_bytes()).unwrap();
    on_threads(threads, || {
        let found = resumed(&read, &systems::standard(), None).unwrap_or_else(|error| panic!("{error}"));
        let mut run = found.run;
        assert_eq!(run.to_end(|_| None).unwrap(), Ended::Done);
        outputs(&found.loaded, run)
    })
}

/// Demands that a scene stopped at 30 % and at 70 % gives what it gives unstopped.
fn demand_the_same(loaded: &Loaded, path: &Path) {
    let (expected, taken) = on_threads(2, || whole(loaded, path, &[0.3, 0.7]));
    for (checkpoint, threads) in taken.iter().zip([1, 2]) {
        let found = gone_on(checkpoint, threads);
        let place = format!("{} from {} h on {threads} threads", path.display(), checkpoint.time);
        assert_eq!(found.summary, expected.summary, "{place}");
        assert!(found.trajectories == expected.trajectories, "{place}: trajectories differ");
        assert!(found.figure == expected.figure, "{place}: figures differ");
        assert!(found == expected, "{place}: states differ");
    }
}

fn scenarios() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    files.sort();
    assert!(files.len() > 20);
    files
}

/// A scenario with few axons, on a coarse mesh, in long steps; whole in time, so that everything in it happens.
fn shortened(path: &Path) -> Loaded {
    let roster = systems::standard();
    let request = Request { path: path.to_owned(), ..Request::default() };
    let loaded = read(&request, &roster).unwrap_or_else(|error| panic!("{error}"));
    let first = &loaded.scene;
    let few = |count: u64| count.min(if first.populations.len() > 1 { 6 } else { 10 });
    let mut set: Vec<String> =
        first.populations.iter().map(|(name, keys)| format!("/populations/{name}/count={}", few(keys.count))).collect();
    set.push(format!("/tissue/mesh_size={}", 4.0 * first.tissue.mesh_size.0));
    set.push(format!("/time/step={}", 8.0 * first.time.step.0));
    // How closely equilibria are followed is no matter of history.
    set.extend(loaded.blocks.contains_key("matrix").then(|| "/matrix/tolerance=1e-3".to_owned()));
    // The size of this one follows from its number of axons.
    let text = std::fs::read_to_string(path).unwrap();
    set.extend(text.contains("\"parameters\"").then(|| "/parameters/axons=100".to_owned()));
    read(&Request { set, ..request }, &roster).unwrap_or_else(|error| panic!("{error}"))
}

fn demand_of_scenarios(part: usize) {
    for path in scenarios().iter().skip(part).step_by(2) {
        demand_the_same(&shortened(path), path);
    }
}

#[test]
fn every_scenario_goes_on_bit_for_bit_one_half() {
    demand_of_scenarios(0);
}

#[test]
fn every_scenario_goes_on_bit_for_bit_other_half() {
    demand_of_scenarios(1);
}

/// All mechanisms that know of each other's shafts, in a tissue that deforms.
fn scene() -> Value {
    json!({
        "name": "busy", "seed": 11,
        "tissue": { "outline": { "rectangle": { "width": 400, "height": 300 } }, "mesh_size": 100 },
        "time": { "duration": 14, "step": "12 min" },
        "populations": { "axons": { "count": 10, "births": { "uniform": { "from": 0, "to": 6 } } } },
        "targets": { "bulb": { "disc": { "centre": [200, 240], "radius": 30 } } },
        "growth": { "on_border": "stall" },
        "matrix": { "tolerance": 1e-3 },
        "cues": {
            "attractant": { "sources": [{ "disc": { "centre": [200, 240], "radius": 40 } }] },
            "repellent": { "diffusion": "2.5 um^2/s", "sources": [{ "disc": { "centre": [50, 150], "radius": 20 } }] }
        },
        "chemotaxis": { "receptors": { "attractant": {}, "repellent": { "effect": "repel" } } },
        "fasciculation": {}, "borders": {}, "heading_noise": {},
        "branching": { "rate": 0.1, "most": 3, "kind": "collateral" },
        "retraction": { "prune_after": 9, "collapse": { "cue": "repellent", "above": 5, "distance": 15 } },
        "zippering": { "arm": 5 }
    })
}

#[test]
fn shafts_that_are_remodelled_go_on_whatever_finds_the_neighbours() {
    for neighbours in ["grid", "tree", "all"] {
        let mut scene = scene();
        scene["fasciculation"]["neighbours"] = json!(neighbours);
        demand_the_same(&loaded(&scene, &systems::standard()), Path::new("busy.json"));
    }
}

#[test]
fn every_method_goes_on_and_so_do_steps_that_a_tolerance_chooses() {
    for method in ["euler", "heun", "rk4", "bogacki_shampine"] {
        let mut scene = scene();
        scene["time"]["method"] = json!(method);
        if method == "bogacki_shampine" {
            scene["time"]["tolerance"] = json!(0.05);
        }
        demand_the_same(&loaded(&scene, &systems::standard()), Path::new("busy.json"));
    }
}

#[test]
fn checkpoints_at_every_step_change_nothing_and_each_of_them_would_do() {
    let mut scene = scene();
    scene["time"]["duration"] = json!(6);
    let loaded = loaded(&scene, &systems::standard());
    let path = Path::new("busy.json");
    let (expected, none) = whole(&loaded, path, &[]);
    let shares: Vec<f64> = (1..30).map(|step| f64::from(step) / 30.0).collect();
    let (watched, taken) = whole(&loaded, path, &shares);
    assert!(none.is_empty() && watched == expected);
    for checkpoint in taken.iter().step_by(12) {
        assert!(gone_on(checkpoint, 1) == expected, "{} h", checkpoint.time);
    }
}

/// All files below a folder, by their paths.
fn files_below(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(place) = folders.pop() {
        for path in std::fs::read_dir(place).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push((path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn files_for_other_tools_go_on_where_they_were() {
    let every = json!({ "interval": 1 });
    let mut scene: Value = serde_json::from_str(include_str!("../../scenarios/smoke.json")).unwrap();
    scene["time"]["duration"] = json!(6);
    scene["output"] = json!({
        "tables": "both", "measures": every, "axons": every, "swc": every,
        "vtu": { "tissue": every, "fields": every, "shafts": every }
    });
    let (loaded, path) = (loaded(&scene, &systems::standard()), Path::new("scene.json"));
    let [whole, stopped] = [Folder::new(), Folder::new()];
    let begun = |folder: &Folder| {
        let mut run = Run::begin(&loaded, &systems::standard(), path, Records::ALL).unwrap();
        run.writes_into(&folder.0, &loaded).unwrap();
        run
    };
    let mut run = begun(&whole);
    let ended = run.to_end(|_| None).unwrap();
    run.finish(&loaded, &ended).unwrap();
    let expected = files_below(&whole.0);
    assert!(expected.len() > 30, "{} files", expected.len());

    let checkpoints =
        Checkpoints::new(Path::new("nowhere"), None, (Asked { loaded: &loaded, command: "tropism" }, path));
    let mut run = begun(&stopped);
    let mut taken = None;
    let ended = run.to_end(|run| {
        if taken.is_none() && run.simulation.progress() > 0.45 {
            taken = Some(checkpoints.of(run).unwrap());
        }
        (run.simulation.progress() > 0.6).then(|| "stopped".to_owned())
    });
    run.finish(&loaded, &ended.unwrap()).unwrap();
    assert!(files_below(&stopped.0) != expected);
    let mut resumed =
        resumed(&taken.unwrap(), &systems::standard(), Some(&stopped.0)).unwrap_or_else(|error| panic!("{error}"));
    let ended = resumed.run.to_end(|_| None).unwrap();
    resumed.run.finish(&resumed.loaded, &ended).unwrap();
    for (found, expected) in files_below(&stopped.0).iter().zip(&expected) {
        assert_eq!(found.0, expected.0);
        assert!(found.1 == expected.1, "{} differs", found.0.display());
    }
}
