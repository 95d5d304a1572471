//! Files for other tools, outlines from files, and terminal manners, seen from outside. The readers themselves try the files in
//! `.ci/readers`.

mod common;

use common::Folder;
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output};

fn scene() -> Value {
    json!({
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 40 },
        "time": { "duration": 4, "step": "4 min" },
        "populations": { "axons": { "count": 6, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "matrix": { "motion": { "top": { "outward": 0.1 } , "bottom": { "outward": 0.0 } } },
        "borders": {}, "heading_noise": {}
    })
}

fn tropism(folder: &Folder, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn with_scene(scene: &Value) -> Folder {
    let folder = Folder::new();
    folder.write("scene.json", &serde_json::to_string_pretty(scene).unwrap());
    folder
}

/// Runs a scene that must end well.
fn run(folder: &Folder, arguments: &[&str]) -> Output {
    let output = tropism(folder, &[&["scene.json"], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    output
}

/// Names of the files in a folder, sorted.
fn names(folder: impl AsRef<Path>) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

const ALL: [&str; 10] = [
    "--set",
    "/output/tables=both",
    "--set",
    "/output/measures={\"interval\": \"1 h\"}",
    "--set",
    "/output/axons={}",
    "--set",
    "/output/swc={\"interval\": 3}",
    "--set",
    "/output/vtu={\"tissue\": {}, \"fields\": {\"interval\": 2}, \"shafts\": {\"interval\": 2}}",
];

#[test]
fn a_scene_chooses_its_files_each_with_its_own_interval() {
    let folder = with_scene(&scene());
    run(&folder, &ALL);
    let out = folder.0.join("out/scene");
    let expected = [
        "axons.csv",
        "axons.parquet",
        "figure.png",
        "figure.svg",
        "manifest.json",
        "measures.csv",
        "measures.parquet",
        "recording.bin",
        "report.html",
        "summary.json",
        "swc",
        "trajectories.csv",
        "trajectories.parquet",
        "vtu",
    ];
    assert_eq!(names(&out), expected);
    assert_eq!(names(out.join("swc")), ["0000", "0001", "0002"], "at 0, 3 and 4 h");
    assert_eq!(names(out.join("swc/0002")).len(), 6);
    assert_eq!(names(out.join("vtu/tissue")), ["0000.vtu"], "at the end only");
    assert_eq!(names(out.join("vtu/shafts")), ["0000.vtu", "0001.vtu", "0002.vtu"]);
    let pvd = std::fs::read_to_string(out.join("vtu/shafts.pvd")).unwrap();
    assert!(pvd.contains("timestep=\"2\" part=\"0\" file=\"shafts/0001.vtu\""), "{pvd}");
    assert_eq!(std::fs::read_to_string(out.join("measures.csv")).unwrap().lines().count(), 6, "0 to 4 h and the head");
    assert_eq!(std::fs::read_to_string(out.join("axons.csv")).unwrap().lines().count(), 7);
    // Parquet alone takes the place of the text; fewer axons leave none of an earlier run.
    run(
        &folder,
        &["--set", "/output/tables=parquet", "--set", "/output/swc={}", "--set", "/populations/axons/count=2"],
    );
    let alone = names(out.join("swc"));
    assert_eq!(alone.iter().filter(|name| name.ends_with(".swc")).count(), 2, "{alone:?}");
}

#[test]
fn the_lengths_of_trees_are_those_of_the_summary_and_single_points_are_listed() {
    let folder = with_scene(&scene());
    let still = run(&folder, &["--set", "/output/swc={}", "--set", "/populations/axons/speed=0"]);
    let words = "note: swc: 0 files; 6 axons are a single point and in none: 0, 1, 2, 3, 4, 5";
    assert!(errors(&still).contains(words), "{}", errors(&still));
    run(&folder, &["--set", "/output/swc={}", "--set", "/output/axons={}"]);
    let out = folder.0.join("out/scene");
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    let stated = summary["morphology"]["length_um"]["mean"].as_f64().unwrap() * 6.0;
    let mut total = 0.0;
    for name in names(out.join("swc")) {
        let text = std::fs::read_to_string(out.join("swc").join(name)).unwrap();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split(' ').map(|entry| entry.parse().unwrap()).collect())
            .collect();
        for (place, row) in rows.iter().enumerate() {
            assert_eq!((row[0], row[1], row[4], row[5]), (place as f64 + 1.0, 2.0, 0.0, 0.5));
            if row[6] > 0.0 {
                let before = &rows[row[6] as usize - 1];
                total += (row[2] - before[2]).hypot(row[3] - before[3]);
            }
        }
    }
    assert!((total - stated).abs() < 1e-9 * stated, "{total} instead of {stated}");
}

#[test]
#[cfg(unix)]
fn a_new_run_clears_all_files_of_an_earlier_one_and_nothing_else() {
    let folder = with_scene(&scene());
    let (out, own) = (folder.0.join("out/scene"), folder.0.join("own"));
    std::fs::create_dir_all(&own).unwrap();
    std::fs::create_dir_all(&out).unwrap();
    // In a folder that is not yet that of a run nothing is an earlier run's.
    std::fs::write(out.join("axons.csv"), "mine").unwrap();
    run(&folder, &["--set", "/output/frames=0", "--set", "/output/swc={\"archive\": true, \"interval\": 1}"]);
    assert_eq!(std::fs::read_to_string(out.join("axons.csv")).unwrap(), "mine");
    assert_eq!(names(out.join("swc")).len(), 5, "archives at 0 to 4 h");
    run(&folder, &ALL);
    assert_eq!(names(out.join("swc")), ["0000", "0001", "0002"], "archives of the run before are gone");
    let mine = ["mine.csv", "swc/0001/mine.swc", "swc/axon_x.swc", "vtu/tissue/mine.vtu", "vtu/notes.txt"];
    mine.iter().for_each(|name| std::fs::write(out.join(name), "mine").unwrap());
    std::fs::write(out.join(".trajectories.csv.partial"), "of a run that was killed").unwrap();
    std::fs::write(own.join("0000.vtu"), "mine").unwrap();
    std::fs::remove_dir_all(out.join("vtu/fields")).unwrap();
    std::os::unix::fs::symlink(&own, out.join("vtu/fields")).unwrap();
    run(&folder, &["--set", "/output/tables=parquet", "--set", "/output/frames=0", "--set", "/output/figure_times=[]"]);
    let expected = ["manifest.json", "mine.csv", "summary.json", "swc", "trajectories.parquet", "vtu"];
    assert_eq!(names(&out), expected);
    mine.iter().for_each(|name| assert!(out.join(name).exists(), "{name}"));
    assert_eq!(names(out.join("vtu")), ["fields", "notes.txt", "tissue"]);
    assert_eq!(
        (names(out.join("swc")), names(out.join("swc/0001"))),
        (vec!["0001".into(), "axon_x.swc".into()], vec!["mine.swc".into()])
    );
    assert_eq!(names(&own), ["0000.vtu"], "a link is not followed");
    // Runs over seeds write less still.
    std::fs::remove_file(out.join("vtu/fields")).unwrap();
    run(&folder, &ALL);
    run(&folder, &["--seeds", "2", "--set", "/output/figure_times=[]"]);
    assert!(
        !out.join("measures.csv").exists() && !out.join("report.html").exists() && !out.join("vtu/shafts").exists()
    );
}

#[test]
fn a_run_replaces_nothing_that_no_run_has_written() {
    let folder = with_scene(&scene());
    let out = folder.0.join("out/scene");
    std::fs::create_dir_all(out.join("swc")).unwrap();
    // A manifest of something else does not make a folder that of a run.
    let mine = [("manifest.json", "{\"name\": \"a web page\"}"), ("axons.csv", "mine"), ("swc/axon_000.swc", "mine")];
    mine.iter().for_each(|(name, text)| std::fs::write(out.join(name), text).unwrap());
    run(&folder, &[]);
    mine[1..].iter().for_each(|(name, text)| assert_eq!(std::fs::read_to_string(out.join(name)).unwrap(), *text));
    // What is called as a checkpoint and is none.
    let other = folder.0.join("other");
    std::fs::create_dir_all(&other).unwrap();
    std::fs::write(other.join("checkpoint.bin"), "mine").unwrap();
    let refused = tropism(&folder, &["scene.json", "--out", "other", "--checkpoint", "0s"]);
    let words = "cannot write other/checkpoint.bin: no checkpoint of this program, and not replaced";
    assert!(refused.status.code() == Some(1) && errors(&refused).contains(words), "{}", errors(&refused));
    assert_eq!(names(&other), ["checkpoint.bin"]);
    // A scenario that is called as one of its results.
    folder.write("summary.json", &scene().to_string());
    for more in [&[][..], &["--seeds", "2"]] {
        let refused = tropism(&folder, &[&["summary.json", "--out", "."], more].concat());
        let words = "it is the scenario of this run; another name or another --out is needed";
        assert!(refused.status.code() == Some(1) && errors(&refused).contains(words), "{}", errors(&refused));
    }
    assert_eq!(std::fs::read_to_string(folder.0.join("summary.json")).unwrap(), scene().to_string());
}

#[test]
#[cfg(unix)]
fn trees_of_an_earlier_run_go_and_a_link_is_not_followed() {
    let folder = with_scene(&scene());
    let swc =
        |interval: &str| run(&folder, &["--out", "out", "--set", &format!("/output/swc={{\"interval\": {interval}}}")]);
    swc("0.5");
    std::fs::write(folder.0.join("out/swc/0007/mine.txt"), "mine").unwrap();
    swc("3");
    assert_eq!(names(folder.0.join("out/swc")), ["0000", "0001", "0002", "0007"]);
    assert_eq!(names(folder.0.join("out/swc/0007")), ["mine.txt"], "what is not ours stays");
    std::fs::remove_dir_all(folder.0.join("out")).unwrap();
    std::fs::create_dir_all(folder.0.join("out")).unwrap();
    std::fs::create_dir_all(folder.0.join("elsewhere")).unwrap();
    std::os::unix::fs::symlink(folder.0.join("elsewhere"), folder.0.join("out/swc")).unwrap();
    let output = tropism(&folder, &["scene.json", "--out", "out", "--set", "/output/swc={}"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        errors(&output).contains("out/swc: it is a link; a run writes into folders of its own"),
        "{}",
        errors(&output)
    );
    std::os::unix::fs::symlink(folder.0.join("elsewhere"), folder.0.join("out/vtu")).unwrap();
    let output = tropism(&folder, &["scene.json", "--out", "out", "--set", "/output/vtu={\"tissue\": {}}"]);
    assert!(errors(&output).contains("out/vtu: it is a link"), "{}", errors(&output));
    assert!(names(folder.0.join("elsewhere")).is_empty());
}

#[test]
fn sweeps_write_little_and_the_plan_names_what_a_run_writes() {
    let folder = with_scene(&scene());
    run(&folder, &[&ALL[..], &["--seeds", "2"]].concat());
    assert_eq!(
        names(folder.0.join("out/scene")),
        ["figure.png", "figure.svg", "manifest.json", "seeds.png", "seeds.svg", "summary.json", "trajectories.csv"]
    );
    let output = tropism(&folder, &[&["plan", "scene.json"], &ALL[..]].concat());
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["swc/ ", "every 3.000 h", "vtu/tissue.pvd, vtu/tissue/", "measures.csv, measures.parquet"] {
        assert!(words.contains(part), "`{part}` is missing in:\n{words}");
    }
}

#[test]
fn what_is_written_changes_no_result() {
    let folder = with_scene(&scene());
    run(&folder, &["--out", "bare"]);
    run(&folder, &[&ALL[..], &["--out", "full"]].concat());
    let [bare, full] = ["bare", "full"].map(|run| std::fs::read(folder.0.join(run).join("trajectories.csv")).unwrap());
    assert!(bare == full);
}

#[test]
fn an_outline_from_a_file_is_in_the_manifest_and_a_bad_one_is_refused_with_its_place() {
    let mut scene = scene();
    scene["tissue"]["outline"] = json!({ "geojson": { "file": "tissue.geojson", "scale": "0.1 mm" } });
    let folder = with_scene(&scene);
    let line = |name: &str, y: u8| {
        format!(
            r#"{{"type": "Feature", "properties": {{"name": "{name}"}}, "geometry": {{"type": "LineString", "coordinates": [[0, {y}], [3, {y}]]}}}}"#
        )
    };
    let square = r#"{"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [3, 0], [3, 2], [0, 2], [0, 0]]]}}"#;
    let text = format!(
        r#"{{"type": "FeatureCollection", "features": [{square}, {}, {}]}}"#,
        line("bottom", 0),
        line("top", 2)
    );
    folder.write("tissue.geojson", &text);
    run(&folder, &[]);
    let manifest = std::fs::read_to_string(folder.0.join("out/scene/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    let outer = &manifest["scenario"]["tissue"]["outline"]["polygon"]["outer"];
    assert_eq!(outer["edges"], json!(["bottom", "outer", "top", "outer"]));
    assert_eq!(outer["points"][2], json!([300.0, 200.0]));
    folder.write("tissue.geojson", "{\"type\": \"Polygon\",\n \"coordinates\": 3}");
    let output = tropism(&folder, &["scene.json"]);
    assert_eq!(output.status.code(), Some(2));
    let said = errors(&output);
    assert!(said.contains("/tissue/outline/geojson/file: tissue.geojson: no list `coordinates`"), "{said}");
    assert!(said.contains("^^^^^^^^^^^^^^^^"), "the file's name is marked in the scenario: {said}");
}

#[test]
fn an_error_is_drawn_at_its_place_in_the_file() {
    let folder = Folder::new();
    folder.write("scene.json", "{\n  \"time\": { \"stepp\": 1 },\n  \"seed\": -1\n}\n");
    let output = tropism(&folder, &["scene.json", "--set", "/growth=3"]);
    let expected = "error: scene.json: 3 problems
  1. /time/stepp: unknown key; did you mean `step`? (keys here: duration, step, method, tolerance)
      --> scene.json:2:13
     2 |   \"time\": { \"stepp\": 1 },
       |             ^^^^^^^
  2. /seed: -1 is outside what is possible: seed ≥ 0
      --> scene.json:3:11
     3 |   \"seed\": -1
       |           ^^
  3. /growth: 3 is not an object with the keys ";
    assert!(errors(&output).starts_with(expected), "{}", errors(&output));
    assert!(!errors(&output).contains('\u{1b}'), "no colours without a terminal");
    folder.write("scene.json", "{\n  \"seed\": 1,,\n}\n");
    let said = errors(&tropism(&folder, &["scene.json"]));
    assert!(said.ends_with("     2 |   \"seed\": 1,,\n       |             ^\n"), "{said}");
}

/// A Gmsh file: the rectangle of 300 by 200 in a grid of cells, its lower side called `floor`, its middle nodes moved.
fn gmsh(columns: usize, rows: usize) -> String {
    let number = |i: usize, j: usize| 1 + i + j * (columns + 1);
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    for (j, i) in (0..=rows).flat_map(|j| (0..=columns).map(move |i| (j, i))) {
        let inside = i % columns > 0 && j % rows > 0;
        let moved = if inside { 3.0 * ((i * j) as f64).sin() } else { 0.0 };
        let [x, y] = [300.0 * i as f64 / columns as f64 + moved, 200.0 * j as f64 / rows as f64 - moved];
        nodes.push(format!("{} {x} {y} 0", number(i, j)));
    }
    for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
        let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
        elements.extend([format!("2 2 2 1 {a} {b} {c}"), format!("2 2 2 1 {a} {c} {d}")]);
    }
    elements.extend((0..columns).map(|i| format!("1 2 1 1 {} {}", number(i, 0), number(i + 1, 0))));
    let numbered: Vec<_> = elements.iter().zip(1..).map(|(element, i)| format!("{i} {element}")).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"floor\"\n$EndPhysicalNames\n$Nodes\n{}\n{}\n$EndNodes\n\
         $Elements\n{}\n{}\n$EndElements\n",
        nodes.len(),
        nodes.join("\n"),
        numbered.len(),
        numbered.join("\n")
    )
}

#[test]
fn a_mesh_of_gmsh_gives_border_names_and_if_asked_for_its_vertices() {
    let (columns, rows) = (12, 8);
    let mut scene = scene();
    scene["tissue"] =
        json!({ "outline": { "gmsh": { "file": "tissue.msh", "keep_vertices": true } }, "mesh_size": 40 });
    scene["matrix"] = json!({ "motion": { "floor": { "outward": 0.1 }, "outer": { "outward": 0.0 } } });
    scene["populations"]["axons"]["origin"] = json!({ "edge": "floor" });
    let folder = with_scene(&scene);
    folder.write("tissue.msh", &gmsh(columns, rows));
    let vertices = |out: &str| -> u64 {
        let summary = std::fs::read_to_string(folder.0.join(out).join("summary.json")).unwrap();
        serde_json::from_str::<Value>(&summary).unwrap()["cost"]["mesh_vertices"].as_u64().unwrap()
    };
    run(&folder, &["--out", "kept"]);
    assert_eq!(vertices("kept"), ((columns + 1) * (rows + 1)) as u64);
    run(&folder, &["--set", "/tissue/outline/gmsh/keep_vertices=false", "--out", "anew"]);
    assert_ne!(vertices("anew"), vertices("kept"));
    // The manifest runs again without the file.
    std::fs::remove_file(folder.0.join("tissue.msh")).unwrap();
    let manifest = std::fs::read_to_string(folder.0.join("kept/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    folder.write("again.json", &manifest["scenario"].to_string());
    let again = tropism(&folder, &["again.json", "--out", "again"]);
    assert_eq!(again.status.code(), Some(0), "{}", errors(&again));
    let rows = |out: &str| std::fs::read(folder.0.join(out).join("trajectories.csv")).unwrap();
    assert!(rows("kept") == rows("again"));
    for key in ["/tissue/refinement={}", "/tissue/corner_radius=50"] {
        let refined = tropism(&folder, &["again.json", "--set", key]);
        let told = errors(&refined);
        assert!(refined.status.code() == Some(2) && told.contains("gives the vertices inside"), "{told}");
    }
}

#[test]
fn a_scene_puts_another_outline_in_the_place_of_its_base_and_a_file_without_end_is_refused() {
    let folder = with_scene(&scene());
    folder.write("tissue.msh", &gmsh(6, 4));
    let from_base = |tissue: Value, edge: &str| {
        let motion = json!({ "motion": { (edge): { "outward": 0.1 }, "top": null, "bottom": null } });
        let axons = json!({ "axons": { "origin": { "edge": edge } } });
        json!({ "base": "scene.json", "tissue": { "outline": tissue }, "populations": axons, "matrix": motion })
    };
    let filed = from_base(json!({ "rectangle": null, "gmsh": { "file": "tissue.msh" } }), "floor");
    folder.write("filed.json", &filed.to_string());
    folder.write(
        "back.json",
        &json!({
            "base": "filed.json",
            "tissue": { "outline": { "gmsh": null, "rectangle": { "width": 250, "height": 150 } } },
            "populations": { "axons": { "origin": { "edge": "bottom" } } },
            "matrix": { "motion": { "floor": null, "bottom": { "outward": 0.1 } } }
        })
        .to_string(),
    );
    for scene in ["filed.json", "back.json"] {
        let output = tropism(&folder, &[scene]);
        assert_eq!(output.status.code(), Some(0), "{scene}: {}", errors(&output));
    }
    let both = from_base(json!({ "gmsh": { "file": "tissue.msh" } }), "floor");
    folder.write("both.json", &both.to_string());
    let refused = |scene: &str, words: &str| {
        let output = tropism(&folder, &[scene]);
        let told = errors(&output);
        assert!(output.status.code() == Some(2) && told.contains(words), "{told}");
    };
    refused("both.json", "only one of rectangle, gmsh");
    #[cfg(unix)]
    {
        assert!(Command::new("mkfifo").arg(folder.0.join("pipe.msh")).status().unwrap().success());
        let pipe = from_base(json!({ "rectangle": null, "gmsh": { "file": "pipe.msh" } }), "floor");
        folder.write("pipe.json", &pipe.to_string());
        refused("pipe.json", "pipe.msh: no file");
    }
}

#[test]
fn quiet_says_nothing_and_verbose_says_the_phases() {
    let folder = with_scene(&scene());
    let output = run(&folder, &["--quiet"]);
    assert_eq!((output.stdout.as_slice(), errors(&output).as_str()), (&b""[..], ""));
    let output = run(&folder, &["-v"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("  integrate: "));
    for order in [["plan", "scene.json", "--quiet"], ["--quiet", "plan", "scene.json"]] {
        assert!(!tropism(&folder, &order).stdout.is_empty(), "what is asked for is said: {order:?}");
    }
    assert_eq!(tropism(&folder, &["scene.json", "--quiet", "-v"]).status.code(), Some(2));
}

#[test]
fn completions_and_the_man_page_name_every_command() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = tropism(&folder, &["completions", shell]).stdout;
        assert!(String::from_utf8(text).unwrap().contains("new-mechanism"), "{shell}");
    }
    let page = String::from_utf8(tropism(&folder, &["man"]).stdout).unwrap();
    for part in [".TH", "ABLATE", "STABILITY", "NEW\\-MECHANISM", "\\-\\-without"] {
        assert!(page.contains(part) || page.contains(&part.replace("\\-", "-")), "`{part}` is missing");
    }
}
