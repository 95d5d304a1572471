//! The binary: what it writes, what it says, and with which code it ends.

mod common;

use common::Folder;
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output};

fn scene() -> Value {
    json!({
        "description": "a small scene",
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 25 },
        "time": { "duration": 4, "step": "4 min" },
        "populations": { "axons": { "count": 8, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "targets": { "bulb": { "disc": { "centre": [150, 60], "radius": 25 } } },
        "matrix": { "motion": { "top": { "outward": 0.1 } , "bottom": { "outward": 0.0 } } },
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "fasciculation": {}, "borders": {}, "heading_noise": {}
    })
}

/// Runs the binary in a folder.
fn tropism(folder: &Folder, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn with_scene(scene: &Value) -> Folder {
    let folder = Folder::new();
    folder.write("scene.json", &scene.to_string());
    folder
}

fn json_at(path: impl AsRef<Path>) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Runs a scene that must be refused, and gives what was said.
fn refusal(scene: &Value, arguments: &[&str]) -> String {
    let folder = with_scene(scene);
    let output = tropism(&folder, &[&["scene.json"], arguments].concat());
    assert_eq!(code(&output), 2, "{}", errors(&output));
    assert!(!folder.0.join("out").exists(), "a refused scene must leave nothing behind");
    errors(&output)
}

#[test]
fn a_run_leaves_its_seven_files_and_ends_with_zero() {
    let folder = with_scene(&scene());
    let output = tropism(&folder, &["scene.json"]);
    assert_eq!(code(&output), 0, "{}", errors(&output));
    let out = folder.0.join("out/scene");
    let mut files: Vec<_> =
        std::fs::read_dir(&out).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    let expected = [
        "figure.png",
        "figure.svg",
        "manifest.json",
        "recording.bin",
        "report.html",
        "summary.json",
        "trajectories.csv",
    ];
    assert_eq!(files, expected);
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(words.contains("scene: t = 4 h; 8 axons:") && words.contains("results in out/scene"), "{words}");
    assert!(!errors(&output).contains('\u{1b}'), "no progress bar without a terminal");
    assert_eq!(&std::fs::read(out.join("figure.png")).unwrap()[..8], b"\x89PNG\r\n\x1a\n");
    assert!(std::fs::read_to_string(out.join("figure.svg")).unwrap().contains("</svg>"));
    let table = std::fs::read_to_string(out.join("trajectories.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("time [h],axon,status,x [um],y [um],heading [deg]"));
    assert!(table.lines().count() > 50 && lines.all(|line| line.split(',').all(|entry| !entry.is_empty())));
    assert!(!table.contains("NaN") && !table.contains("inf"));
}

#[test]
fn a_plan_is_printed_and_leaves_nothing_behind() {
    let folder = with_scene(&scene());
    let output = tropism(&folder, &["plan", "scene.json", "--without", "matrix"]);
    assert_eq!(code(&output), 0, "{}", errors(&output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        words.contains("does not need\n") && words.contains("matrix                      the scene has no such block")
    );
    assert!(!folder.0.join("out").exists());
    let output =
        tropism(&folder, &["plan", "scene.json", "--json", "--threads", "1", "--set", "/populations/axons/count=1"]);
    let plan: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(plan["steps"], json!(60));
    assert_eq!(code(&tropism(&folder, &["plan", "scene.json", "--set", "/seed=-1"])), 2);
    assert_eq!(code(&tropism(&folder, &["plan"])), 2);
}

#[test]
fn the_summary_is_complete() {
    let folder = with_scene(&scene());
    assert_eq!(code(&tropism(&folder, &["scene.json", "--out", "results"])), 0);
    let summary = json_at(folder.0.join("results/summary.json"));
    let number = |pointer: &str| {
        summary
            .pointer(pointer)
            .and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{pointer} is no number: {summary:#}"))
    };
    for pointer in [
        "/seed",
        "/time",
        "/counts/axons",
        "/counts/unborn",
        "/counts/growing",
        "/counts/arrived",
        "/counts/stalled",
        "/counts/left",
        "/morphology/hits/fraction",
        "/morphology/hits_early/fraction",
        "/morphology/hits_late/fraction",
        "/morphology/length_um/mean",
        "/morphology/straightness/mean",
        "/morphology/turning_angle_deg/mean",
        "/morphology/heading_turn_deg/mean",
        "/morphology/heights/0/spread_um",
        "/morphology/heights/0/fascicles/count",
        "/morphology/heights/0/fascicles/mean_size",
        "/morphology/heights/0/fascicles/largest_fraction",
        "/morphology/heights/0/fascicles/linkage_um",
        "/morphology/heights/2/share",
        "/speed_drift",
        "/derived/axons/turning_rate",
        "/derived/axons/omega",
        "/derived/axons/omega_filopodia_time",
        "/derived/axons/turning_radius",
        "/cost/steps",
        "/cost/cone_steps",
        "/cost/stages",
        "/cost/cue_solves",
        "/cost/matrix_solves",
        "/cost/peak_memory_mib",
        "/cost/seconds/integrate",
    ] {
        number(pointer);
    }
    let statuses = ["unborn", "growing", "arrived", "stalled", "left"];
    assert_eq!(statuses.iter().map(|s| number(&format!("/counts/{s}"))).sum::<f64>(), 8.0);
    assert_eq!((summary["complete"].clone(), summary["fault"].clone()), (json!(true), Value::Null));
    assert_eq!(number("/time"), 4.0);
    assert_eq!(number("/morphology/hits/arrived"), number("/counts/arrived"));
    // ω = √(2 κ v_g / l₀) with the defaults κ = 0.93, v_g = 20, l₀ = 10, and δt = 2 min.
    let omega = (2.0f64 * 0.93 * 20.0 / 10.0).sqrt();
    assert!((number("/derived/axons/omega") - omega).abs() < 1e-12);
    assert!((number("/derived/axons/omega_filopodia_time") - omega / 30.0).abs() < 1e-12);
    let shares: f64 = summary["cost"]["share"].as_object().unwrap().values().filter_map(Value::as_f64).sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
}

#[test]
fn the_scenario_of_the_manifest_gives_the_same_bits_again() {
    let folder = with_scene(&json!({ "base": "below.json", "seed": 9 }));
    folder.write("below.json", &scene().to_string());
    let changed = ["--without", "borders", "--set", "/populations/axons/count=5", "--threads", "2"];
    let output = tropism(&folder, &[&["scene.json", "--out", "first"], &changed[..]].concat());
    assert_eq!(code(&output), 0, "{}", errors(&output));
    let manifest = json_at(folder.0.join("first/manifest.json"));
    for key in ["scene", "seed", "version", "threads", "host_threads", "platform", "scenario"] {
        assert!(manifest.get(key).is_some_and(|value| !value.is_null()), "the manifest has no `{key}`");
    }
    assert_eq!((&manifest["seed"], &manifest["threads"]), (&json!(9), &json!(2)));
    assert_eq!(manifest["scenario"]["populations"]["axons"]["count"], json!(5));
    assert!(manifest["scenario"].get("base").is_none() && manifest["scenario"].get("borders").is_none());
    folder.write("again.json", &manifest["scenario"].to_string());
    assert_eq!(code(&tropism(&folder, &["again.json", "--out", "second", "--threads", "1"])), 0);
    for file in ["trajectories.csv", "figure.svg", "figure.png"] {
        let [first, second] = ["first", "second"].map(|run| std::fs::read(folder.0.join(run).join(file)).unwrap());
        assert!(first == second, "{file} differs");
    }
    let again = json_at(folder.0.join("second/manifest.json"));
    assert_eq!(again["scenario"], manifest["scenario"]);
}

#[test]
fn seeds_give_every_measure_a_mean_and_an_interval() {
    let folder = with_scene(&scene());
    let output = tropism(&folder, &["scene.json", "--out", "seeds", "--seeds", "3"]);
    assert_eq!(code(&output), 0, "{}", errors(&output));
    let summary = json_at(folder.0.join("seeds/summary.json"));
    assert_eq!(summary["seeds"], json!([5, 6, 7]));
    assert_eq!(summary["runs"].as_array().unwrap().len(), 3);
    for name in ["hits.arrived", "counts.growing", "length_um.mean", "straightness.mean", "heights.0.spread_um"] {
        let values: Vec<f64> =
            summary["values"][name].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
        let of = |key: &str| summary["measures"][name][key].as_f64().unwrap_or_else(|| panic!("{name} has no {key}"));
        assert!((of("mean") - values.iter().sum::<f64>() / 3.0).abs() < 1e-9, "{name}");
        let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        // A mean of resampled values may leave their range by round-off.
        let (least, most) = (least - 1e-12 * least.abs(), most + 1e-12 * most.abs());
        assert!(
            least <= of("low") && of("low") <= of("mean") && of("mean") <= of("high") && of("high") <= most,
            "{name}: {values:?} {}",
            summary["measures"][name]
        );
        assert_eq!(of("n"), 3.0);
    }
    let lengths = summary["values"]["length_um.mean"].as_array().unwrap();
    assert!(lengths[0] != lengths[1] && lengths[1] != lengths[2], "each seed is a run of its own");
}

#[test]
fn help_and_version_are_no_errors_and_bad_arguments_are() {
    let folder = Folder::new();
    for argument in ["--help", "--version"] {
        let output = tropism(&folder, &[argument]);
        assert_eq!((code(&output), errors(&output).as_str()), (0, ""));
    }
    for arguments in [&[][..], &["a.json", "b.json"], &["a.json", "--seeds", "0"], &["a.json", "--threads", "many"]] {
        assert_eq!(code(&tropism(&folder, arguments)), 2, "{arguments:?}");
    }
}

#[test]
fn a_missing_file_is_named() {
    let folder = Folder::new();
    let output = tropism(&folder, &["nowhere.json"]);
    assert_eq!(code(&output), 2);
    assert!(errors(&output).contains("nowhere.json: no such file"), "{}", errors(&output));
    folder.write("scene.json", r#"{ "base": "gone.json" }"#);
    let output = tropism(&folder, &["scene.json"]);
    assert_eq!(code(&output), 2);
    assert!(errors(&output).contains("/base: ") && errors(&output).contains("gone.json: no such file"));
    folder.write("scene.json", "{ \"seed\": 1,, }");
    let output = tropism(&folder, &["scene.json"]);
    assert_eq!(code(&output), 2);
    assert!(errors(&output).contains("line 1"), "{}", errors(&output));
}

#[test]
fn all_problems_of_a_scene_come_at_once_each_with_its_place() {
    let mut scene = scene();
    scene["time"]["durration"] = json!(3);
    scene["matrix"]["poisson_ratio"] = json!(0.5);
    scene["populations"]["axons"]["speed"] = json!("20 um");
    scene["fasiculation"] = json!({});
    let said = refusal(&scene, &["--without", "bordres", "--set", "/seed", "--set", "/tissue/mesh_size=\"2 h\""]);
    for words in [
        "7 problems",
        "/time/durration: unknown key; did you mean `duration`?",
        "/matrix/poisson_ratio: 0.5 is outside what is possible: 0 ≤ poisson_ratio < 0.5",
        "/populations/axons/speed: \"20 um\" is a length; a speed such as 20 or \"20 um/h\" belongs here",
        "/fasiculation: unknown key; did you mean `fasciculation`?",
        "--without bordres: no such mechanism; did you mean `borders`?",
        "--set /seed: no `=`",
        "/tissue/mesh_size: \"2 h\" is a time; a length such as 2 or \"2 um\" belongs here (from --set)",
    ] {
        assert!(said.contains(words), "`{words}` is missing in:\n{said}");
    }
}

#[test]
fn names_that_do_not_exist_in_the_scene_are_refused_with_those_that_do() {
    let mut scene = scene();
    scene["chemotaxis"]["receptors"]["repellent"] = json!({});
    scene["matrix"]["motion"]["topp"] = json!({ "outward": 0.1 });
    let said = refusal(&scene, &[]);
    assert!(
        said.contains("/chemotaxis/receptors/repellent: there is no cue called `repellent`; there are: attractant")
    );
    assert!(said.contains("/matrix/motion: there is no edge called `topp`; there are: bottom, right, top, left"));
}

#[test]
fn who_names_a_mechanism_that_is_not_there_learns_of_all_that_are() {
    let said = refusal(&scene(), &["--without", "nope"]);
    assert!(said.contains("--without nope: no such mechanism (mechanisms: matrix, cues, "), "{said}");
    let output = tropism(&Folder::new(), &["mechanisms", "nope"]);
    assert_eq!(code(&output), 2);
    let said = errors(&output);
    assert!(said.contains("there is no mechanism `nope` (there are: matrix, ") && said.contains("zippering"), "{said}");
}

#[test]
#[cfg(unix)]
fn a_pipe_with_a_name_is_no_scenario() {
    let folder = Folder::new();
    assert!(Command::new("mkfifo").arg(folder.0.join("pipe.json")).status().unwrap().success());
    let output = tropism(&folder, &["pipe.json"]);
    assert!(errors(&output).contains("pipe.json: no file to be read from its beginning to its end"));
    assert_eq!(code(&output), 2);
}

#[test]
fn results_that_cannot_be_written_end_with_one() {
    let folder = with_scene(&scene());
    folder.write("in_the_way", "");
    let output = tropism(&folder, &["scene.json", "--out", "in_the_way"]);
    assert_eq!(code(&output), 1);
    assert!(errors(&output).contains("cannot write in_the_way"), "{}", errors(&output));
}

#[test]
fn an_ablation_tables_every_arm_and_ends_with_one_if_any_failed() {
    let folder = with_scene(&scene());
    let short = ["--set", "/time/duration=1", "--set", "/populations/axons/count=3", "--without", "fasciculation"];
    let output = tropism(&folder, &[&["ablate", "scene.json", "--seeds", "2", "--threads", "2"], &short[..]].concat());
    assert_eq!(code(&output), 0, "{}", errors(&output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in [
        "scene: 6 arms, 2 seeds\n",
        "\n  full model  ",
        "\n  without heading_noise  ",
        "\n  skipped: without cues, because /chemotaxis: ",
        "results in out/scene-ablation",
    ] {
        assert!(words.contains(part), "`{part}` is missing in:\n{words}");
    }
    assert!(!words.contains("fasciculation"), "what the scene lacks is no arm");
    let out = folder.0.join("out/scene-ablation");
    let mut files: Vec<_> =
        std::fs::read_dir(&out).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    assert_eq!(files, ["ablation.csv", "ablation.json", "figure.png", "figure.svg", "manifest.json", "report.html"]);

    let mut broken = scene();
    broken["matrix"] = json!({ "motion": { "top": { "outward": -0.2 }, "bottom": { "outward": -0.2 } } });
    folder.write("broken.json", &broken.to_string());
    let output = tropism(&folder, &[&["ablate", "broken.json", "--seeds", "1"], &short[..]].concat());
    assert_eq!(code(&output), 1);
    let arms = json_at(folder.0.join("out/broken-ablation/ablation.json"))["arms"].clone();
    assert_eq!((&arms[0]["complete"], &arms[1]["complete"]), (&json!(false), &json!(true)), "{arms}");
    assert!(arms[0]["failures"][0]["account"].as_str().unwrap().contains("equilibrium lost"));
    assert_eq!(code(&tropism(&folder, &["ablate", "scene.json", "--seeds", "0"])), 2);
    assert_eq!(code(&tropism(&folder, &["ablate", "scene.json", "--without", "nothing"])), 2);
}

#[test]
fn stability_knows_before_it_begins_whether_its_folder_can_be_written() {
    let folder = Folder::new();
    folder.write("occupied", "");
    let output = tropism(&folder, &["stability", "--out", "occupied"]);
    assert_eq!(code(&output), 1);
    assert!(errors(&output).contains("occupied"), "{}", errors(&output));
    assert_eq!(code(&tropism(&folder, &["stability", "--help"])), 0);
}

#[test]
fn a_compression_that_has_no_equilibrium_ends_with_one_and_says_load_cell_and_stretch() {
    let mut scene = scene();
    scene["matrix"] = json!({ "motion": { "top": { "outward": -0.2 }, "bottom": { "outward": -0.2 } } });
    let folder = with_scene(&scene);
    let output = tropism(&folder, &["scene.json"]);
    assert_eq!(code(&output), 1);
    let said = errors(&output);
    for words in ["equilibrium lost between s = ", "cell ", "stretches [", "det F = ", "neo_hookean"] {
        assert!(said.contains(words), "`{words}` is missing in:\n{said}");
    }
}

/// 10¹⁰ axons take more than a terabyte; a machine that has it would need another number here.
#[test]
fn a_scene_that_does_not_fit_into_memory_is_refused_before_anything_is_made_of_it() {
    let mut large = scene();
    large["populations"]["axons"]["count"] = json!(10_000_000_000_u64);
    let said = refusal(&large, &[]);
    for words in ["does not fit into memory", "TB", "leaves", "axons", "--memory any"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let folder = with_scene(&large);
    for command in ["plan", "ablate", "bench", "chart"] {
        let output = tropism(&folder, &[command, "scene.json"]);
        assert_eq!(code(&output), 2, "{command}");
        assert!(errors(&output).contains("does not fit into memory"), "{command}: {}", errors(&output));
    }
}

#[test]
fn the_room_of_a_run_can_be_said_and_a_refused_run_writes_no_results() {
    let folder = with_scene(&scene());
    let with = |size: &str, more: &[&str]| tropism(&folder, &[&["scene.json", "--memory", size], more].concat());
    // Axons and mesh alone would fit into 1 MB: it is the field that does not.
    let output = with("1MB", &[]);
    assert_eq!(code(&output), 2, "{}", errors(&output));
    let words = "does not fit into memory: cue `attractant` (eq. 2, /cues/attractant): levels of its field, 1 so far";
    assert!(errors(&output).contains(words), "{}", errors(&output));
    assert!(!folder.0.join("out/scene/summary.json").exists());
    for size in ["any", "1TB"] {
        assert_eq!(code(&with(size, &[])), 0, "{size}");
    }
    let output = with("60MB", &["--seeds", "64", "--threads", "64"]);
    assert_eq!(code(&output), 2, "{}", errors(&output));
    assert!(errors(&output).contains("for 64 runs at once"), "{}", errors(&output));
    assert_eq!(code(&with("60", &[])), 2, "a size has a unit");
    let load = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/load.json");
    let output = tropism(&folder, &["bench", load, "--axons", "100,100000000", "--memory", "10GB", "--out", "bench"]);
    assert_eq!(code(&output), 2, "{}", errors(&output));
    let words = "with /parameters/axons=100000000 does not fit into memory";
    assert!(errors(&output).contains(words), "{}", errors(&output));
    let output = tropism(&folder, &["plan", "scene.json", "--memory", "1MB"]);
    assert_eq!(code(&output), 0);
    assert!(errors(&output).contains("does not fit into memory"), "{}", errors(&output));
}
