//! Runs that are killed, and runs that are stopped: at random moments, also while they write. They go on from their checkpoints until
//! they are done, and leave what an undisturbed run leaves.
//!
//! `TROPISM_KILLS=200 cargo test --test kill -- --nocapture` kills as often as that; without it ten times.
#![cfg(unix)]

mod common;

use common::Folder;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tropism::prelude::{KeyedRng, Stream};
use tropism::record::checkpoint::Checkpoint;

/// Everything that has state of its own, in well under a second.
fn scene() -> Value {
    json!({
        "seed": 3,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 100 },
        "time": { "duration": 16, "step": "8 min" },
        "populations": { "axons": { "count": 12, "births": { "uniform": { "from": 0, "to": 5 } } } },
        "targets": { "bulb": { "disc": { "centre": [150, 150], "radius": 25 } } },
        "growth": { "on_border": "stall" },
        "matrix": { "tolerance": 1e-3, "motion": { "top": { "outward": 0.1 } , "bottom": { "outward": 0.0 } } },
        "cues": {
            "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] },
            "repellent": { "diffusion": "2.5 um^2/s", "sources": [{ "disc": { "centre": [50, 80], "radius": 20 } }] }
        },
        "chemotaxis": { "receptors": { "attractant": {}, "repellent": { "effect": "repel" } } },
        "fasciculation": {}, "borders": {}, "heading_noise": {},
        "branching": { "rate": 0.1, "most": 2, "kind": "collateral" },
        "retraction": { "prune_after": 9, "collapse": { "cue": "repellent", "above": 5, "distance": 15 } },
        "zippering": { "arm": 5 },
        "output": { "figure_times": [0.5, 1] }
    })
}

fn tropism(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command.args(arguments).args(["--threads", "1"]).current_dir(folder).stdin(Stdio::null());
    command
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A report without its summary, which is compared by itself, and without what was typed.
fn report(page: &str) -> String {
    let opening = "<script type=\"application/json\" id=\"report\">";
    let (before, rest) = page.split_once(opening).unwrap();
    let (data, after) = rest.split_once("</script>").unwrap();
    let mut data: Value = serde_json::from_str(data).unwrap();
    ["summary", "command"].iter().for_each(|key| assert!(data.as_object_mut().unwrap().remove(*key).is_some()));
    format!("{before}{data}{after}")
}

/// The files of a run, but for what the clock on the wall says.
fn files(out: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(out)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let mut bytes = std::fs::read(&path).unwrap();
            if name == "summary.json" {
                let mut summary: Value = serde_json::from_slice(&bytes).unwrap();
                let cost = summary["cost"].as_object_mut().unwrap();
                ["seconds", "share", "peak_memory_mib"].iter().for_each(|key| assert!(cost.remove(*key).is_some()));
                bytes = summary.to_string().into_bytes();
            }
            if name == "report.html" {
                bytes = report(&String::from_utf8(bytes).unwrap()).into_bytes();
            }
            (name, bytes)
        })
        .collect();
    files.sort();
    files
}

/// What a run that nobody disturbs leaves, and how long it takes.
fn undisturbed(folder: &Folder) -> (Vec<(String, Vec<u8>)>, Duration) {
    folder.write("scene.json", &scene().to_string());
    let begun = Instant::now();
    let output = tropism(&folder.0, &["scene.json", "--out", "whole"]).output().unwrap();
    assert!(output.status.success(), "{}", words(&output));
    (files(&folder.0.join("whole")), begun.elapsed())
}

/// Demands that nothing under a final name is a part of a file; returns whether a checkpoint is there.
fn demand_whole(out: &Path) -> bool {
    let there = |name: &str| Some(out.join(name)).filter(|path| path.exists());
    for path in ["summary.json", "manifest.json"].into_iter().filter_map(there) {
        serde_json::from_slice::<Value>(&std::fs::read(&path).unwrap()).unwrap();
    }
    if let Some(table) = there("trajectories.csv") {
        assert!(std::fs::read(table).unwrap().ends_with(b"\n"));
    }
    if let Some(picture) = there("figure.png") {
        assert!(std::fs::read(picture).unwrap().ends_with(b"IEND\xaeB`\x82"));
    }
    let checkpoints: Vec<PathBuf> =
        ["checkpoint.bin", "checkpoint.previous.bin"].into_iter().filter_map(there).collect();
    checkpoints.iter().for_each(|path| {
        Checkpoint::read(path).unwrap_or_else(|error| panic!("{} {error}", path.display()));
    });
    !checkpoints.is_empty()
}

fn temporaries(out: &Path) -> usize {
    let names = std::fs::read_dir(out).into_iter().flatten().map(|entry| entry.unwrap().file_name());
    names.filter(|name| name.to_string_lossy().ends_with(".partial")).count()
}

/// Waits for a while, or for the end of the child.
fn wait(child: &mut Child, longest: Duration) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < longest {
        if child.try_wait().unwrap().is_some() {
            return true;
        }
        std::thread::sleep(Duration::from_micros(500));
    }
    false
}

#[test]
fn runs_killed_at_random_moments_go_on_and_leave_what_undisturbed_ones_leave() {
    let wanted: usize = std::env::var("TROPISM_KILLS").ok().and_then(|count| count.parse().ok()).unwrap_or(10);
    let folder = Folder::new();
    let (expected, alone) = undisturbed(&folder);
    let out = folder.0.join("killed");
    let mut draws = KeyedRng::new(1, 0, Stream::named("kill"), 0);
    let (mut kills, mut runs, mut before_first, mut while_writing) = (0, 0, 0, 0);
    while kills < wanted {
        let _ = std::fs::remove_dir_all(&out);
        runs += 1;
        let mut done = false;
        while !done {
            let arguments: &[&str] = match demand_whole(&out) {
                true => &["resume", "killed"],
                false => &["scene.json", "--out", "killed", "--checkpoint", "0s"],
            };
            let mut child = tropism(&folder.0, arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
            let moment = alone.mul_f64(draws.share());
            done = wait(&mut child, if kills < wanted { moment } else { Duration::from_secs(600) });
            if !done {
                child.kill().unwrap();
                kills += 1;
            }
            let output = child.wait_with_output().unwrap();
            if done {
                assert!(output.status.success(), "{}", words(&output));
            } else {
                while_writing += usize::from(temporaries(&out) > 0);
                before_first += usize::from(!demand_whole(&out));
            }
        }
        // What a kill left half-written is under no final name, and goes with the next checkpoint.
        let found: Vec<_> = files(&out).into_iter().filter(|(name, _)| !name.ends_with(".partial")).collect();
        let names: Vec<_> = found.iter().map(|(name, _)| name).collect();
        assert!(found == expected, "after {kills} kills something differs among {names:?}");
    }
    eprintln!(
        "{kills} kills, {while_writing} of them while a file was written, {before_first} before the first checkpoint, in {runs} runs: \
         all the same as the undisturbed one ({alone:?} alone)"
    );
}

/// Sends a signal to a run once it has written a checkpoint; once more where the run came to its end before the signal came to it.
fn signalled(folder: &Folder, arguments: &[&str], signal: &str) -> Output {
    let second = folder.0.join("stopped/checkpoint.previous.bin");
    let mut tries = (0..20).map(|_| {
        let mut child = tropism(&folder.0, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        while !second.exists() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().unwrap();
        child.wait_with_output().unwrap()
    });
    tries.find(|output| !output.status.success()).expect("a signal that comes before the end")
}

#[test]
fn a_signal_finishes_the_step_writes_what_there_is_and_says_so() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = Folder::new();
        let (expected, _) = undisturbed(&folder);
        let output = signalled(&folder, &["scene.json", "--out", "stopped", "--checkpoint", "0s"], signal);
        assert_eq!(output.status.code(), Some(code), "{}", words(&output));
        let said = words(&output);
        let sentence = format!("h: stopped by SIG{signal}; `tropism resume stopped` goes on from here");
        assert!(said.contains("error: the run ended at t = ") && said.contains(&sentence), "{said}");
        let out = folder.0.join("stopped");
        assert!(demand_whole(&out));
        let summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(summary["complete"], json!(false));
        assert!(summary["fault"].as_str().unwrap().contains("stopped by SIG"), "{summary}");
        for file in ["trajectories.csv", "figure.svg", "figure.png", "manifest.json", "recording.bin", "report.html"] {
            assert!(out.join(file).exists(), "{file}");
        }
        let resumed = tropism(&folder.0, &["resume", "stopped"]).output().unwrap();
        assert!(resumed.status.success() && words(&resumed).contains("resumed at t = "), "{}", words(&resumed));
        assert!(files(&out) == expected, "SIG{signal}");
        let again = tropism(&folder.0, &["resume", "stopped"]).output().unwrap();
        assert!(again.status.success());
        let said = String::from_utf8_lossy(&again.stdout).into_owned();
        assert!(said.contains("the run came to its end; there is nothing to resume"), "{said}");
    }
}

/// Sends SIGINT to a child, and tells whether it ends within a time.
fn ends_by_interrupt(child: &mut Child, within: Duration) -> bool {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    wait(child, within)
}

#[test]
fn a_signal_within_a_long_step_or_a_long_mesh_is_heard_at_once_if_it_is_the_second() {
    use std::os::unix::process::ExitStatusExt;
    let folder = Folder::new();
    let mut long = scene();
    long["time"] = json!({ "duration": 8, "step": 2, "method": "bogacki_shampine", "tolerance": 1e-12 });
    long["populations"]["axons"] = json!({ "count": 500, "births": { "at": 0 } });
    folder.write("long_step.json", &long.to_string());
    let mut large = scene();
    large["tissue"]["mesh_size"] = json!(0.3);
    folder.write("long_mesh.json", &large.to_string());
    let begun = |arguments: &[&str], there: &str| {
        let mut child = tropism(&folder.0, arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        while !folder.0.join(there).exists() {
            assert!(!wait(&mut child, Duration::from_millis(5)), "it ended before it was stopped");
        }
        assert!(!wait(&mut child, Duration::from_millis(300)), "it ended before it was stopped");
        child
    };
    // The manifest is written just before the first step.
    let mut child = begun(&["long_step.json", "--out", "step"], "step/manifest.json");
    let (soon, ever) = (Duration::from_millis(500), Duration::from_secs(60));
    assert!(!ends_by_interrupt(&mut child, soon), "the first finishes the step, which takes longer");
    assert!(ends_by_interrupt(&mut child, ever), "the second ends the program at once");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!demand_whole(&folder.0.join("step")) && !folder.0.join("step/summary.json").exists());
    // A run by itself catches signals from its first step on; before, the first ends it as it ends any program.
    let mut child = begun(&["long_mesh.json", "--out", "mesh"], "mesh");
    assert!(ends_by_interrupt(&mut child, ever), "before the first step the first ends the program");
    assert_eq!(child.wait().unwrap().signal(), Some(2));
    assert_eq!(std::fs::read_dir(folder.0.join("mesh")).unwrap().count(), 0, "nothing was written");
    let mut child = begun(&["long_mesh.json", "--out", "seeds", "--seeds", "2", "--memory", "any"], "seeds");
    let first = ends_by_interrupt(&mut child, soon);
    assert!(first || ends_by_interrupt(&mut child, ever), "the second ends the program at once, in a mesh too");
}

#[test]
fn signals_that_come_together_are_one_and_a_refused_resume_disturbs_nothing() {
    let folder = Folder::new();
    let mut long = scene();
    // A million steps, as below.
    long["time"] = json!({ "duration": 1000, "step": "0.05 min" });
    long["output"] = json!({ "figure_times": [1], "axons": { "interval": 100 }, "tables": "both" });
    folder.write("scene.json", &long.to_string());
    let results = folder.0.join("out/scene");
    let mut child = tropism(&folder.0, &["scene.json"]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // The manifest is written just before the first step.
    while !results.join("manifest.json").exists() {
        assert!(!wait(&mut child, Duration::from_millis(5)), "it ended before it was stopped");
    }
    assert!(!wait(&mut child, Duration::from_millis(300)), "it ended before it was stopped");
    let partial = results.join(".axons.parquet.partial");
    assert!(partial.exists());
    std::fs::write(results.join("checkpoint.bin"), b"none").unwrap();
    let refused = tropism(&folder.0, &["resume", "out/scene"]).output().unwrap();
    assert!(words(&refused).contains("another run writes into it"), "{}", words(&refused));
    assert!(partial.exists(), "the run's own file is still there");
    std::fs::remove_file(results.join("checkpoint.bin")).unwrap();
    let twice = format!("kill -TERM {0}; kill -TERM {0}", child.id());
    assert!(Command::new("sh").args(["-c", &twice]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(143), "{}", words(&output));
    assert!(demand_whole(&results) && results.join("summary.json").exists());
}

#[test]
fn a_command_that_writes_at_its_end_says_that_it_was_stopped() {
    let folder = Folder::new();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    let mut child =
        command.args(["stability", "--out", "maps"]).current_dir(&folder.0).stderr(Stdio::piped()).spawn().unwrap();
    while !folder.0.join("maps").exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", words(&output));
    assert!(words(&output).contains("stopped by SIGINT: what this command had not written by now is not there"));
}

#[test]
fn a_run_without_checkpoints_can_be_stopped_and_resumed_too_and_seeds_end_clean() {
    let folder = Folder::new();
    let mut long = scene();
    // A million steps: it does not come to its end on any machine before it is stopped.
    long["time"] = json!({ "duration": 1000, "step": "0.05 min" });
    long["populations"]["axons"]["births"] = json!({ "uniform": { "from": 0, "to": 900 } });
    folder.write("scene.json", &long.to_string());
    let ablation = ["ablate", "scene.json", "--out", "ablation", "--seeds", "2"];
    for arguments in
        [&["scene.json", "--out", "plain"][..], &["scene.json", "--out", "plain", "--seeds", "500"], &ablation]
    {
        // Signals are caught from the first step on: one that comes earlier ends the program as it ends any.
        let interrupted = [300, 1000, 3000, 10_000, 30_000].into_iter().map(|delay| {
            let mut child = tropism(&folder.0, arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
            assert!(!wait(&mut child, Duration::from_millis(delay)), "it ended before it was stopped");
            assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
            child.wait_with_output().unwrap()
        });
        let output = { interrupted }.find(|output| output.status.code().is_some()).unwrap();
        let said = words(&output);
        assert_eq!(output.status.code(), Some(130), "{said}");
        assert!(said.contains("stopped by SIGINT"), "{said}");
        if arguments.len() == 3 {
            assert!(demand_whole(&folder.0.join("plain")), "a checkpoint to go on from");
        }
        if arguments[0] == "ablate" {
            let table = std::fs::read(folder.0.join("ablation/ablation.json")).unwrap();
            assert_eq!(serde_json::from_slice::<Value>(&table).unwrap()["complete"], json!(false));
        }
    }
}

#[test]
fn a_new_run_does_not_go_on_from_the_checkpoints_of_the_one_before() {
    let folder = Folder::new();
    let (expected, _) = undisturbed(&folder);
    let stopped = signalled(&folder, &["scene.json", "--out", "stopped", "--checkpoint", "0s"], "INT");
    assert_eq!(stopped.status.code(), Some(130));
    let anew = tropism(&folder.0, &["scene.json", "--out", "stopped"]).output().unwrap();
    assert!(anew.status.success());
    assert!(files(&folder.0.join("stopped")) == expected, "no checkpoint is left");
    let refused = tropism(&folder.0, &["resume", "nowhere"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(words(&refused).contains("nowhere has no checkpoint.bin: there is nothing to resume"));
    let both = tropism(&folder.0, &["scene.json", "--checkpoint", "1min", "--seeds", "2"]).output().unwrap();
    assert_eq!(both.status.code(), Some(2));
    let wrong = tropism(&folder.0, &["scene.json", "--checkpoint", "10 um"]).output().unwrap();
    assert!(wrong.status.code() == Some(2) && words(&wrong).contains("--checkpoint"), "{}", words(&wrong));
}
