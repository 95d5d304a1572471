//! Faults put in on purpose: the run ends at that step with place and amount, keeps what it has marked incomplete, and ends with code 1;
//! what cannot be written is told, and what had been written stays readable.

mod common;

use common::{Folder, loaded};
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use tropism::prelude::*;
use tropism::record::output::prepare_folder;
use tropism::simulation::Simulation;
use tropism::systems;
use tropism::systems::zippering::MostMoves;

keys! {
    /// Breaks something at a time.
    pub struct Sabotage {
        /// When.
        pub at: Time = Time(2.0),
        /// What: `pull`, `site`, `cell`, `vertex`, `equilibrium`, `zippers` (which may hardly move).
        pub what: String = String::new(),
    }
}

/// The time from which on the tissue is broken.
#[derive(Debug, Clone, Copy, Resource)]
struct Since(f64);

impl Mechanism for Sabotage {
    const NAME: &'static str = "sabotage";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert(Since(self.at.0));
        match self.what.as_str() {
            "pull" => model.term(Term::Turn, spoil_pull),
            "site" => model.phase(Phase::Remodel, spoil_site),
            "cell" => model.motion(turn_cell_over),
            "vertex" => model.motion(lose_vertex),
            "zippers" => model.at_end(|world| {
                world.insert_resource(MostMoves(2));
                Ok(())
            }),
            _ => model.motion(lose_equilibrium),
        };
        model.insert_law(self);
        Ok(())
    }
}

fn spoil_pull(since: Res<Since>, stage: Res<StageTime>, mut cones: Cones) {
    let late = stage.0 > since.0;
    cones.for_each(|cone, spring| {
        if late && cone.index == 1 {
            spring.pull = Vector3::repeat(f64::NAN);
        }
    });
}

fn spoil_site(since: Res<Since>, clock: Res<Clock>, mut cones: Query<&mut Site, With<GrowthCone>>) {
    if clock.hours() > since.0 {
        cones.iter_mut().take(1).for_each(|mut site| site.weights = [f64::NAN; 2]);
    }
}

/// Moves a vertex of a cell far beyond the opposite edge.
fn turn_cell_over(since: Res<Since>, stage: Res<StageTime>, tissue: Res<Tissue>, mut now: ResMut<Configuration>) {
    if stage.0 > since.0 {
        let [a, b, c] = [0, 1, 2].map(|k| tissue.mesh.cell(7)[k] as usize);
        let [at_a, at_b, at_c] = [a, b, c].map(|vertex| now.vertex(vertex));
        let mirrored = |k: usize| at_b[k] + at_c[k] - at_a[k];
        now.displace(a, [mirrored(0), mirrored(1)]);
    }
}

fn lose_vertex(since: Res<Since>, stage: Res<StageTime>, mut now: ResMut<Configuration>) {
    if stage.0 > since.0 {
        let [x, _] = now.vertex(3);
        now.displace(3, [x, f64::INFINITY]);
    }
}

/// What a provider does that solves as it goes.
fn lose_equilibrium(since: Res<Since>, stage: Res<StageTime>, mut health: ResMut<Health>) {
    if stage.0 > since.0 {
        health.report(stage.0, "equilibrium lost at load 0.4: residual 3e-2 after 25 iterations");
    }
}

fn scene() -> Value {
    json!({
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 40 },
        "time": { "duration": 6, "step": "6 min" },
        "populations": { "axons": { "count": 4, "births": { "at": 0 } } },
        "matrix": { "motion": { "top": { "outward": 0.1 } , "bottom": { "outward": 0.0 } } },
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    })
}

fn json_at(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Runs a scene in which something breaks at 2 h as the program would, and gives the account of it.
fn broken(what: &str, method: &str) -> String {
    let folder = Folder::new();
    let mut scene = scene();
    scene["sabotage"] = json!({ "at": 2, "what": what });
    scene["time"]["method"] = json!(method);
    let path = folder.write("scene.json", &scene.to_string());
    let out = folder.0.join("out");
    let arguments = ["tropism", path.to_str().unwrap(), "--out", out.to_str().unwrap(), "--checkpoint", "1s"];
    let code = tropism::run(arguments, systems::standard().with::<Sabotage>());
    assert_eq!(format!("{code:?}"), format!("{:?}", ExitCode::from(1)), "{what}");
    let summary = json_at(&out.join("summary.json"));
    assert_eq!(summary["complete"], json!(false), "{what}");
    let time = summary["time"].as_f64().unwrap();
    assert!((2.0..2.21).contains(&time), "{what}: the run ends at that step, not at {time} h");
    let table = std::fs::read_to_string(out.join("trajectories.csv")).unwrap();
    let last = table.lines().last().unwrap().split(',').next().unwrap().parse::<f64>().unwrap();
    assert!((1.8..2.21).contains(&last), "{what}: what was recorded is kept, up to {last} h");
    assert!(table.lines().skip(1).all(|row| row.split(',').count() == 6));
    assert!(!out.join("checkpoint.bin").exists(), "{what}: there is nothing to go on from");
    assert!(summary["cost"]["seconds"]["checkpoint"].as_f64().unwrap() > 0.0, "{what}: a first one was written");
    let fault = summary["fault"].as_str().unwrap().to_owned();
    assert!(fault.starts_with("at t = 2"), "{what}: {fault}");
    fault
}

#[test]
fn a_state_that_is_not_finite_ends_the_run() {
    for method in ["rotation", "rk4"] {
        let fault = broken("pull", method);
        assert!(fault.contains("axon 1") && fault.contains("finite"), "{fault}");
    }
}

#[test]
fn a_cone_that_is_lost_ends_the_run_with_the_place_where_it_was_last() {
    let fault = broken("site", "rotation");
    assert!(
        fault.contains("growth cone of axon 0 was lost at (") && fault.contains("um: the walk from cell"),
        "{fault}"
    );
}

#[test]
fn a_cell_that_is_turned_over_ends_the_run_with_its_place_and_its_det_f() {
    let fault = broken("cell", "rotation");
    assert!(fault.contains("the tissue is turned over: cell ") && fault.contains("um, det F = -"), "{fault}");
}

#[test]
fn a_mesh_that_is_none_any_more_ends_the_run_with_the_vertex() {
    let fault = broken("vertex", "rotation");
    assert!(fault.contains("the tissue's mesh is no longer valid: vertex 3") && fault.contains("inf"), "{fault}");
}

#[test]
fn an_equilibrium_lost_on_the_way_ends_the_run() {
    assert!(
        broken("equilibrium", "rotation").ends_with("equilibrium lost at load 0.4: residual 3e-2 after 25 iterations")
    );
}

/// Steps a scene until a fault ends it.
fn fault_of(scene: &Value) -> String {
    let roster = systems::standard().with::<Sabotage>();
    let mut simulation = Simulation::assemble(&loaded(scene, &roster), &roster).unwrap();
    while !simulation.is_over() {
        if let Err(fault) = simulation.step() {
            return fault.account;
        }
    }
    panic!("it came to its end");
}

#[test]
fn a_step_that_takes_more_parts_than_any_run_has_patience_for_is_given_up_with_the_key() {
    let mut scene = scene();
    scene["time"] = json!({ "duration": 2, "step": 1, "method": "bogacki_shampine", "tolerance": 1e-12 });
    let fault = fault_of(&scene);
    let words = "takes more than 4000 parts a growing cone to keep errors within 1e-12 um, /time/tolerance: a larger";
    assert!(fault.contains(words), "{fault}");
    scene["time"]["tolerance"] = json!(1e-4);
    let roster = systems::standard();
    let mut simulation = Simulation::assemble(&loaded(&scene, &roster), &roster).unwrap();
    simulation.step().unwrap();
}

#[test]
fn zipper_points_that_do_not_come_to_rest_end_the_run_with_their_place() {
    let axon = |x: f64, heading: f64| json!({ "count": 1, "origin": { "points": [[x, 20]] }, "heading": heading, "births": { "at": 0 }, "speed": 50 });
    let mut scene = json!({
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 40 },
        "time": { "duration": 8, "step": "3 min" },
        "growth": { "on_border": "stall" },
        "populations": { "left": axon(132.0, 78.0), "right": axon(168.0, 102.0) },
        "zippering": { "arm": 20 }
    });
    let roster = systems::standard();
    let mut simulation = Simulation::assemble(&loaded(&scene, &roster), &roster).unwrap();
    while !simulation.is_over() {
        simulation.step().unwrap();
    }
    scene["sabotage"] = json!({ "what": "zippers" });
    let fault = fault_of(&scene);
    let words = "zippering: the points where the shafts 1 and 0 part, at (150.";
    assert!(fault.starts_with(words) && fault.ends_with("do not come to rest within 2 moves in one step"), "{fault}");
}

fn tropism(folder: &Folder, arguments: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap();
    (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn with_scene(scene: &Value) -> Folder {
    let folder = Folder::new();
    folder.write("scene.json", &scene.to_string());
    folder
}

/// The path of equilibria is found before the first step, so a run of hours does not end in its loss.
#[test]
fn a_compression_without_equilibrium_is_refused_before_the_first_step_with_load_cell_and_place() {
    let mut scene = scene();
    scene["matrix"] = json!({ "motion": { "top": { "outward": -0.3 }, "bottom": { "outward": -0.3 } } });
    let folder = with_scene(&scene);
    let (code, words) = tropism(&folder, &["scene.json"]);
    assert_eq!(code, 1, "{words}");
    for part in ["equilibrium lost between s = ", "cell ", "at rest at [", "det F = ", "stretches ["] {
        assert!(words.contains(part), "{part}: {words}");
    }
    assert!(!folder.0.join("out/scene/summary.json").exists());
}

/// Whole or not there: every file under its final name.
fn demand_whole_files(out: &Path) {
    for entry in std::fs::read_dir(out).into_iter().flatten() {
        let path = entry.unwrap().path();
        let (name, bytes) = (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap());
        let whole = match name.as_str() {
            "summary.json" | "manifest.json" => serde_json::from_slice::<Value>(&bytes).is_ok(),
            "trajectories.csv" | "axons.csv" => bytes.ends_with(b"\n"),
            "trajectories.parquet" | "axons.parquet" => bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"),
            "figure.svg" => bytes.ends_with(b"</svg>\n") || bytes.ends_with(b"</svg>"),
            "figure.png" => bytes.ends_with(b"IEND\xaeB`\x82"),
            "checkpoint.bin" | "checkpoint.previous.bin" => {
                tropism::record::checkpoint::Checkpoint::from_bytes(&bytes).is_ok()
            }
            "recording.bin" => tropism::record::recording::Recording::read(&bytes).is_ok(),
            "report.html" => bytes.ends_with(b"</html>\n"),
            other => panic!("{other} is none of the files of a run"),
        };
        assert!(whole, "{name} is not whole");
    }
}

#[test]
fn a_path_that_cannot_be_a_folder_is_refused_at_the_start() {
    let folder = with_scene(&scene());
    folder.write("occupied", "a file");
    for out in ["occupied", "occupied/deeper"] {
        let (code, words) = tropism(&folder, &["scene.json", "--out", out]);
        assert!(code == 1 && words.contains("error: cannot write ") && words.contains("occupied"), "{words}");
    }
    assert_eq!(std::fs::read_to_string(folder.0.join("occupied")).unwrap(), "a file");
}

/// A file system of 48 kB in memory; none where the test may not mount one.
struct Tiny(std::path::PathBuf);

impl Tiny {
    fn mount(options: &str) -> Option<(Folder, Self)> {
        let folder = Folder::new();
        let place = folder.0.join("tiny");
        std::fs::create_dir(&place).unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&place).stderr(Stdio::null());
        let mounted = mount.status().is_ok_and(|status| status.success());
        if !mounted {
            eprintln!("left out: no file system can be mounted here");
        }
        mounted.then(|| (folder, Self(place)))
    }
}

impl Drop for Tiny {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_is_told_and_what_had_been_written_stays_readable() {
    let Some((folder, tiny)) = Tiny::mount("size=48k") else { return };
    let path = folder.write("scene.json", &scene().to_string());
    let arguments = [path.to_str().unwrap(), "--out", tiny.0.to_str().unwrap(), "--checkpoint", "0s"];
    let (code, words) = tropism(&folder, &arguments);
    assert_eq!(code, 1, "{words}");
    assert!(words.contains("cannot write ") && words.contains("No space left on device"), "{words}");
    assert_eq!(words.matches("warning: no checkpoint at t = ").count(), 1, "one warning a reason: {words}");
    demand_whole_files(&tiny.0);
    let summary = std::fs::read_to_string(tiny.0.join("summary.json")).unwrap_or_default();
    assert!(!summary.contains("\"complete\": true"), "results that are not whole: {summary}");
}

#[test]
fn a_folder_that_may_only_be_read_is_refused_at_the_start() {
    let Some((folder, tiny)) = Tiny::mount("size=48k,ro") else { return };
    let path = folder.write("scene.json", &scene().to_string());
    let (code, words) = tropism(&folder, &[path.to_str().unwrap(), "--out", tiny.0.to_str().unwrap()]);
    assert!(code == 1 && words.contains("error: cannot write ") && words.contains("Read-only file system"), "{words}");
}

/// A folder that goes while the run is on its way is made again: nothing is lost but the checkpoints that were in it.
#[test]
fn a_folder_that_vanishes_is_made_again_and_the_results_are_whole() {
    let mut long = scene();
    long["time"]["duration"] = json!(40);
    long["output"]["tables"] = json!("both");
    long["output"]["axons"] = json!({ "interval": 4 });
    let folder = with_scene(&long);
    let child = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .args(["scene.json", "--checkpoint", "0s"])
        .current_dir(&folder.0)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let out = folder.0.join("out/scene");
    while !out.join("checkpoint.previous.bin").exists() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let _ = std::fs::rename(&out, folder.0.join("gone"));
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    demand_whole_files(&out);
    assert!(["trajectories", "axons"].iter().all(|name| out.join(format!("{name}.parquet")).exists()));
    assert_eq!(json_at(&out.join("summary.json"))["complete"], json!(true));
}

/// Runs the binary with standard output on a device or a pipe that is closed.
fn with_output(arguments: &[&str], out: Stdio) -> (i32, String) {
    let folder = with_scene(&scene());
    let mut child = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .args(arguments)
        .current_dir(&folder.0)
        .stdout(out)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    if arguments[0] == "scene.json" {
        demand_whole_files(&folder.0.join("out/scene"));
        assert_eq!(json_at(&folder.0.join("out/scene/summary.json"))["complete"], json!(true));
    }
    (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_reader_that_has_gone_is_no_fault_and_a_full_device_is() {
    for arguments in [
        &["scene.json"][..],
        &["schema"],
        &["mechanisms"],
        &["man"],
        &["completions", "bash"],
        &["--help"],
        &["--version"],
    ] {
        let (code, words) = with_output(arguments, Stdio::piped());
        assert!(code == 0 && !words.contains("panicked"), "{arguments:?}: {words}");
        let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") else { continue };
        let (code, words) = with_output(arguments, full.into());
        assert!(code == 1 && words.contains("error: standard output: No space left on device"), "{words}");
    }
}

#[test]
fn two_runs_do_not_write_into_one_folder_at_a_time() {
    let folder = with_scene(&scene());
    let results = folder.0.join("out/scene");
    let claim = prepare_folder(&results).unwrap();
    let run = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap();
        (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, words) = run(&["scene.json"]);
    assert!(code == 1 && words.contains("another run writes into it; another --out is needed, or patience"), "{words}");
    assert_eq!(std::fs::read_dir(&results).unwrap().count(), 0, "nothing is left");
    drop(claim);
    for arguments in [&["scene.json"][..], &["resume", "out/scene"]] {
        let (code, words) = run(arguments);
        assert_eq!(code, 0, "{words}");
    }
}

#[test]
fn a_closed_standard_error_is_no_fault_either() {
    let folder = with_scene(&scene());
    let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") else { return };
    let status = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .args(["scene.json", "--set", "/heading_noise/diffusion=40"])
        .current_dir(&folder.0)
        .stdout(Stdio::null())
        .stderr(full)
        .status()
        .unwrap();
    assert!(matches!(status.code(), Some(0 | 2)), "{status}");
}

#[test]
fn a_crate_that_does_not_fit_on_the_disk_is_not_left_by_halves() {
    let Some((folder, tiny)) = Tiny::mount("size=48k") else { return };
    let (sources, place) = (env!("CARGO_MANIFEST_DIR"), tiny.0.to_str().unwrap());
    let (code, words) = tropism(&folder, &["new-mechanism", "drift", "--path", place, "--tropism", sources]);
    assert!(code == 1 && words.contains("No space left on device"), "{words}");
    assert_eq!(std::fs::read_dir(&tiny.0).unwrap().count(), 0, "{words}");
}
