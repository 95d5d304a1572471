//! What a checkpoint must hold, and what is not gone on from: cut, damaged, of another scene or version, or of a state that no run comes to.

use crate::common::{Folder, loaded};
use crate::{Outputs, gone_on, outputs, scene, shortened, whole};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;
use tropism::model::keep::{Keep, KeptBytes};
use tropism::record::checkpoint::{Checkpoint, NAMES, paths};
use tropism::study::resume::{Found, pick_up, resumed};
use tropism::study::run::RunError;
use tropism::systems;

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
    // A pipe would keep the reader waiting.
    #[cfg(unix)]
    {
        std::fs::remove_file(&newest).unwrap();
        assert!(Command::new("mkfifo").arg(&newest).status().unwrap().success());
        let (_, refused, time) = picked_up(&folder);
        assert!(time == earlier.time && refused[0].contains("it is no file to be read"), "{refused:?}");
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
