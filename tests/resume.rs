//! A run that stops and goes on from its checkpoint leaves what it would have left: the same bits, for every scenario and mechanism, on
//! any number of threads.

mod common;

use common::{Folder, hash_of_states, loaded};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use tropism::model::keep::{Keep, KeptBytes};
use tropism::record::checkpoint::{Checkpoint, NAMES, paths};
use tropism::record::scene_view::scene_figure;
use tropism::scenario::load::{Loaded, Request};
use tropism::study::report::Asked;
use tropism::study::resume::{Checkpoints, Found, pick_up, resumed};
use tropism::study::run::{Ended, Records, Run, RunError, read};
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

/// The parts of a state by their names.
fn parts(state: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut from = KeptBytes::new(state);
    let mut parts = Vec::new();
    while from.left() > 0 {
        let name: String = from.read().unwrap();
        let length: usize = from.read().unwrap();
        parts.push((name, from.take(length).unwrap().to_vec()));
    }
    parts
}

/// The part of a state that has a name.
fn part_of(state: &[u8], name: &str) -> Vec<u8> {
    parts(state).into_iter().find(|(own, _)| own == name).unwrap().1
}

/// A state with another part under one name.
fn with_part(state: &[u8], name: &str, other: &[u8]) -> Vec<u8> {
    let mut mixed = Vec::new();
    for (own, part) in parts(state) {
        let part = if own == name { other.to_vec() } else { part };
        own.keep(&mut mixed);
        part.len().keep(&mut mixed);
        mixed.extend(part);
    }
    mixed
}

/// These tests see it when a mechanism forgets what it should have kept.
#[test]
fn what_each_mechanism_remembers_matters() {
    let zippering = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/zippering.json");
    let busy = ["branching/Budding", "retraction/Retreat", "retraction/Retreats", "journeys"];
    for (loaded, path, parts) in [
        (loaded(&scene(), &systems::standard()), Path::new("busy.json"), &busy[..]),
        (shortened(&zippering), &zippering, &["zippering/Zippers"]),
    ] {
        let (expected, taken) = whole(&loaded, path, &[0.0, 0.4, 0.55, 0.7, 0.85]);
        let (first, later) = taken.split_first().unwrap();
        for part in parts {
            let forgotten = |checkpoint: &Checkpoint| {
                let state = with_part(&checkpoint.state, part, &part_of(&first.state, part));
                gone_on(&Checkpoint { state, ..checkpoint.clone() }, 1) != expected
            };
            assert!(later.iter().any(forgotten), "{part} could as well be forgotten");
        }
    }
}

/// What a mechanism kept names shafts, cells and times; none may be of another run.
#[test]
fn what_no_run_can_have_made_a_mechanism_remember_is_refused() {
    let zippering = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/zippering.json");
    let refusal = |checkpoint: &Checkpoint, name: &str, part: &[u8]| {
        let state = with_part(&checkpoint.state, name, part);
        let forged = Checkpoint { state, ..checkpoint.clone() };
        resumed(&forged, &systems::standard(), None).err().map(|error| error.to_string())
    };
    for (loaded, path, name) in [
        (loaded(&scene(), &systems::standard()), Path::new("busy.json"), "retraction/Retreats"),
        (shortened(&zippering), &zippering, "zippering/Zippers"),
    ] {
        let (_, taken) = whole(&loaded, path, &[0.5, 0.85]);
        let own = part_of(&taken[0].state, name);
        assert_eq!(refusal(&taken[0], name, &own), None);
        let of_later = refusal(&taken[0], name, &part_of(&taken[1].state, name)).unwrap();
        assert!(of_later.contains(name) && of_later.contains("no run of this scene"), "{of_later}");
        if name == "zippering/Zippers" {
            // The time of the last look; shafts at rest; lines by their shafts, each from its first point's cell on.
            let late = part_of(&taken[1].state, name);
            let resting = u64::from_le_bytes(late[8..16].try_into().unwrap()) as usize;
            let first_shaft = 16 + 4 * resting + 8;
            for place in [first_shaft, first_shaft + 4 + 8] {
                let mut forged = late.clone();
                forged[place..place + 4].fill(0xff);
                let words = refusal(&taken[1], name, &forged).unwrap();
                assert!(words.contains("no run of this scene"), "{words}");
            }
        }
    }
}

/// A folder with two checkpoints of a run, and what the run leaves in the end.
fn with_checkpoints() -> (Folder, Outputs, [Checkpoint; 2]) {
    let folder = Folder::new();
    let mut scene = scene();
    scene["time"]["duration"] = json!(2);
    scene["populations"]["axons"] = json!({ "count": 3 });
    let loaded = loaded(&scene, &systems::standard());
    let (expected, taken) = whole(&loaded, Path::new("busy.json"), &[0.3, 0.7]);
    taken.iter().for_each(|checkpoint| checkpoint.write(&folder.0).unwrap());
    (folder, expected, taken.try_into().unwrap())
}

fn picked_up(folder: &Folder) -> (Outputs, Vec<String>, f64) {
    match pick_up(&folder.0, &systems::standard()).unwrap_or_else(|error| panic!("{error}")) {
        Found::Stopped(found) => {
            let time = found.run.simulation.time();
            let mut run = found.run;
            run.to_end(|_| None).unwrap();
            (outputs(&found.loaded, run), found.refused, time)
        }
        Found::Finished => panic!("finished"),
    }
}

fn refusal(folder: &Folder) -> String {
    match pick_up(&folder.0, &systems::standard()) {
        Err(error @ RunError::Resume(_)) => error.to_string(),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("something was picked up"),
    }
}

#[test]
fn a_checkpoint_that_is_cut_or_damaged_is_refused_and_the_one_before_is_used() {
    let (folder, expected, [earlier, later]) = with_checkpoints();
    let newest = folder.0.join(NAMES[0]);
    let bytes = std::fs::read(&newest).unwrap();
    assert_eq!(bytes, later.to_bytes());
    let (found, refused, time) = picked_up(&folder);
    assert!(found == expected && refused.is_empty() && time == later.time);
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 4;
    for (spoilt, reason) in [
        (&bytes[..bytes.len() - 1], "is cut or too long"),
        (&bytes[..10], "is cut or too long"),
        (&[][..], "is cut or too long"),
        (&damaged, "is damaged: its checksum is"),
        (b"PK and what else a file may hold", "is no checkpoint of tropism"),
    ] {
        std::fs::write(&newest, spoilt).unwrap();
        let (found, refused, time) = picked_up(&folder);
        assert!(found == expected && time == earlier.time, "{reason}");
        assert!(refused.len() == 1 && refused[0].contains(reason), "{refused:?}");
    }
    // Killed between the two renames: only the one before has its name.
    std::fs::remove_file(&newest).unwrap();
    assert_eq!(picked_up(&folder).2, earlier.time);
}

#[test]
fn every_cut_and_every_flipped_bit_of_a_whole_checkpoint_is_refused() {
    let (_folder, _, [_, checkpoint]) = with_checkpoints();
    let bytes = checkpoint.to_bytes();
    assert!(Checkpoint::from_bytes(&bytes).unwrap() == checkpoint);
    let accepted = (0..bytes.len()).filter(|cut| Checkpoint::from_bytes(&bytes[..*cut]).is_ok()).count();
    assert_eq!(accepted, 0, "of {} cuts", bytes.len());
    let mut flipped = bytes.clone();
    // A checksum over so many bytes for each bit would take long: every bit of the header, and one a byte of every 97th byte.
    for bit in (0..8 * 64).chain((64..bytes.len()).step_by(97).map(|byte| 8 * byte + byte % 8)) {
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(Checkpoint::from_bytes(&flipped).is_err(), "bit {bit}");
        flipped[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn a_checkpoint_of_another_scenario_is_refused() {
    let (folder, _, [earlier, later]) = with_checkpoints();
    let merged: Value = serde_json::from_str(&later.scene).unwrap();
    let mut other = merged.clone();
    other["seed"] = json!(12);
    folder.write("manifest.json", &json!({ "scenario": other }).to_string());
    let words = refusal(&folder);
    assert_eq!(words.matches("it is of another scenario than manifest.json beside it").count(), 2, "{words}");
    folder.write("manifest.json", &json!({ "scenario": merged }).to_string());
    assert_eq!(picked_up(&folder).2, later.time);
    // A scene whose state is another: one axon more.
    let mut grown = merged;
    grown["populations"]["axons"]["count"] = json!(4);
    std::fs::remove_file(folder.0.join("manifest.json")).unwrap();
    Checkpoint { scene: grown.to_string(), ..later }.write(&folder.0).unwrap();
    earlier.write(&folder.0).unwrap();
    let [newest, previous] = paths(&folder.0);
    std::fs::rename(previous, newest).unwrap();
    let words = refusal(&folder);
    assert!(words.contains("does not fit: `identities`: 12 growth cones instead of 16"), "{words}");
}

#[test]
fn a_run_that_does_not_fit_into_memory_any_more_is_not_gone_on_with() {
    let (folder, ..) = with_checkpoints();
    let before = paths(&folder.0).map(|path| std::fs::read(path).unwrap());
    let program = Command::new(env!("CARGO_BIN_EXE_tropism"));
    let output = { program }.arg("resume").arg(&folder.0).args(["--memory", "1MB"]).output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && words.contains("does not fit into memory"), "{words}");
    assert!(paths(&folder.0).map(|path| std::fs::read(path).unwrap()) == before, "nothing is lost");
}

#[test]
fn a_checkpoint_of_another_version_is_refused() {
    let (folder, _, [_, later]) = with_checkpoints();
    let mut bytes = later.to_bytes();
    let format = bytes[8];
    bytes[8] += 1;
    paths(&folder.0).iter().for_each(|path| std::fs::write(path, &bytes).unwrap());
    let words = refusal(&folder);
    let expected = format!("has format {}; this program reads format {format}", format + 1);
    assert_eq!(words.matches(&expected).count(), 2, "{words}");
}

#[test]
fn a_folder_with_nothing_to_resume_says_so() {
    let folder = Folder::new();
    let words = |folder: &Folder| match pick_up(&folder.0, &systems::standard()) {
        Err(error @ RunError::Arguments(_)) => error.to_string(),
        _ => panic!("something was picked up"),
    };
    assert!(words(&folder).ends_with("has no checkpoint.bin: there is nothing to resume"));
    folder.write("summary.json", r#"{"complete": false, "fault": "at t = 3 h: a cone was lost"}"#);
    assert!(words(&folder).ends_with("the run there ended at t = 3 h: a cone was lost"));
    folder.write("summary.json", r#"{"complete": true, "fault": null}"#);
    assert!(matches!(pick_up(&folder.0, &systems::standard()), Ok(Found::Finished)));
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
    let mut scene: Value = serde_json::from_str(include_str!("../scenarios/smoke.json")).unwrap();
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
