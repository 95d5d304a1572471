//! `tropism figure`, `tropism movie` and `report.html`: a finished run is looked at without running it again.

mod common;

use common::Folder;
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output};

/// A folder in which `first` has been run.
fn with_run() -> Folder {
    let folder = Folder::new();
    let scene = json!({
        "description": "a small scene; </script><!-- it says -->",
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 40 },
        "time": { "duration": 4, "step": "6 min" },
        "populations": { "axons": { "count": 6, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] }, "other": {
            "sources": [{ "disc": { "centre": [60, 160], "radius": 25 } }] } },
        "chemotaxis": { "receptors": { "attractant": {}, "other": { "effect": "repel" } } },
        "output": { "frames": 9 }
    });
    folder.write("first.json", &scene.to_string());
    folder.write("second.json", &json!({ "base": "first.json", "seed": 2 }).to_string());
    done(&tropism(&folder, &["first.json"]));
    folder
}

fn tropism(folder: &Folder, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).args(arguments).current_dir(&folder.0).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn done(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", errors(output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn refused(folder: &Folder, arguments: &[&str]) -> String {
    let output = tropism(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", errors(&output));
    errors(&output)
}

fn text(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// Width of a PNG file in pixels.
fn png_width(path: impl AsRef<Path>) -> u32 {
    u32::from_be_bytes(std::fs::read(path).unwrap()[16..20].try_into().unwrap())
}

#[test]
fn a_figure_is_drawn_again_at_any_time_with_any_cue_in_any_width() {
    let folder = with_run();
    let out = folder.0.join("out/first");
    let said = done(&tropism(&folder, &["figure", "out/first"]));
    assert_eq!(said, "out/first/picture.svg\nout/first/picture.png\n");
    let (own, again) = (text(out.join("figure.svg")), text(out.join("picture.svg")));
    for words in ["t = 0 h", "t = 2 h", "t = 4 h", "a small scene", "attractive cue: attractant", "6 growing"] {
        let words = words.replace("6 ", "6\u{a0}");
        assert!(own.contains(&words) && again.contains(&words), "{words}");
    }
    assert_eq!(own.matches("<path").count(), again.matches("<path").count());

    done(&tropism(&folder, &["figure", "out/first", "--time", "90min,3", "--cue", "other", "--out", "a/b.svg"]));
    let svg = text(folder.0.join("a/b.svg"));
    assert!(svg.contains("t = 1.5 h") && svg.contains("t = 3 h") && svg.contains("cue: other"), "{}", &svg[..200]);
    assert!(!svg.contains("attractant") && !folder.0.join("a/b.png").exists());

    done(&tropism(
        &folder,
        &["figure", "out/first/recording.bin", "--time", "4 h", "--size", "85mm", "--out", "one.png"],
    ));
    // 85 mm at 300 dots an inch.
    assert!(png_width(folder.0.join("one.png")).abs_diff(1004) <= 1);
    let said = refused(&folder, &["figure", "out/first", "--time", "1h,2h,3h", "--size", "30mm"]);
    assert!(said.contains("3 panels a row need a width of "), "{said}");

    done(&tropism(&folder, &["second.json"]));
    done(&tropism(&folder, &["figure", "out/first", "out/second", "--time", "2h", "--time", "4h", "--out", "two"]));
    let svg = text(folder.0.join("two.svg"));
    for words in ["first, t = 2 h", "first, t = 4 h", "second, t = 2 h", "second, t = 4 h"] {
        assert!(svg.contains(words), "{words}");
    }
}

#[test]
fn what_is_not_there_is_named_with_what_is() {
    let folder = with_run();
    let cases: [(&[&str], &str); 9] = [
        (&["figure", "nowhere"], "nowhere: no such folder of results"),
        (&["figure", "out"], "out: there is no recording.bin; single runs leave one, unless `output/frames` is 0"),
        (&["movie", "nowhere"], "nowhere: no such folder of results"),
        (&["figure", "out/first", "--cue", "x"], "no cue called `x`; there are: attractant, other"),
        (&["figure", "out/first", "--time", "5h"], "t = 5 h is not there: out/first was recorded from 0 h to 4 h"),
        (&["figure", "out/first", "--time", "5um"], "is a length; a time such as 5"),
        (&["figure", "out/first", "--out", "x.pdf"], "figures end in .svg or .png, not .pdf"),
        (&["movie", "out/first", "--out", "x.avi"], "movies end in .gif, .png (APNG), .apng or .mp4, not .avi"),
        (&["movie", "out/first", "--format", "mov"], "possible values: gif, apng, mp4"),
    ];
    for (arguments, words) in cases {
        let said = refused(&folder, arguments);
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
    let file = folder.0.join("out/first/recording.bin");
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    assert!(refused(&folder, &["movie", "out/first"]).contains("cannot read out/first/recording.bin: "));
    assert!(!folder.0.join("out/first/movie.gif").exists());
    for command in ["figure", "movie"] {
        assert!(done(&tropism(&folder, &[command, "--help"])).contains("RUN"));
    }
}

#[test]
fn a_turning_assay_says_the_mean_angle_that_the_summary_says() {
    let folder = Folder::new();
    let mut scene: Value = serde_json::from_str(include_str!("../scenarios/turning_assay.json")).unwrap();
    scene["populations"]["assayed"]["count"] = json!(40);
    folder.write("scene.json", &scene.to_string());
    done(&tropism(&folder, &["scene.json", "--out", "assayed"]));
    done(&tropism(&folder, &["figure", "assayed", "--assay"]));
    let drawn = text(folder.0.join("assayed/assay.svg"));
    let summary: Value = serde_json::from_str(&text(folder.0.join("assayed/summary.json"))).unwrap();
    // The gradient is to the left of all of them, so that toward it is counter-clockwise. Positions are recorded in steps of 5 nm.
    let mean = summary["morphology"]["turning_angle_deg"]["mean"].as_f64().unwrap();
    assert!(mean > 5.0 && drawn.contains(&format!(">{mean:.1} ± ")), "{mean}");
    assert!(drawn.contains("n\u{a0}=\u{a0}40)") && folder.0.join("assayed/assay.png").exists());
    for wrong in [&["--time", "0.2,0.4"][..], &["assayed"], &["--size", "85mm"], &["--cue", "none"], &["--time", "9h"]]
    {
        refused(&folder, &[&["figure", "assayed", "--assay"], wrong].concat());
    }
}

#[test]
fn seeds_leave_the_density_of_the_shafts_of_all_of_them() {
    let folder = with_run();
    done(&tropism(&folder, &["first.json", "--seeds", "3", "--out", "seeds"]));
    let drawn = text(folder.0.join("seeds/seeds.svg"));
    assert!(drawn.contains("t = 4 h, 3 seeds") && folder.0.join("seeds/seeds.png").exists());
    assert!(text(folder.0.join("seeds/figure.svg")).contains("<path") && !drawn.contains("growing"));
}

#[test]
fn a_movie_has_as_many_frames_as_asked_for() {
    let folder = with_run();
    assert_eq!(done(&tropism(&folder, &["movie", "out/first", "--width", "200"])), "out/first/movie.gif\n");
    let file = std::fs::read(folder.0.join("out/first/movie.gif")).unwrap();
    let mut reader = gif::DecodeOptions::new().read_info(&file[..]).unwrap();
    assert_eq!(reader.width(), 200);
    let mut frames = 0;
    while reader.next_frame_info().unwrap().is_some() {
        frames += 1;
    }
    assert_eq!(frames, 9);
    let arguments = ["movie", "out/first", "--width", "200", "--frames", "5", "--format", "apng", "--out", "still"];
    assert_eq!(done(&tropism(&folder, &arguments)), "still.png\n");
    let file = std::fs::File::open(folder.0.join("still.png")).unwrap();
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 5);
    assert_eq!(reader.info().width, 200);
}

#[test]
fn without_ffmpeg_an_mp4_is_refused_and_with_it_all_frames_are_handed_over() {
    let folder = with_run();
    let with_path = |path: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
        let arguments = ["movie", "out/first", "--width", "64", "--frames", "3", "--out", "m.mp4"];
        command.args(arguments).current_dir(&folder.0).env("PATH", path).output().unwrap()
    };
    let output = with_path("/nowhere");
    assert_eq!(output.status.code(), Some(2));
    assert!(errors(&output).contains("MP4 needs the program ffmpeg"), "{}", errors(&output));
    assert!(!folder.0.join("m.mp4").exists());
    if cfg!(unix) {
        // Stands for ffmpeg: its last argument is the file, and what it reads are the frames.
        let program = folder.write("ffmpeg", "#!/bin/sh\nfor last; do :; done\nexec /bin/cat > \"$last\"\n");
        assert!(Command::new("chmod").arg("+x").arg(&program).status().unwrap().success());
        done(&with_path(&folder.0.display().to_string()));
        let bytes = std::fs::metadata(folder.0.join("m.mp4")).unwrap().len();
        assert!(bytes > 0 && bytes.is_multiple_of(3 * 3 * 64), "{bytes} bytes are three frames of 64 pixels a row");
        let left = std::fs::read_dir(&folder.0)
            .unwrap()
            .filter(|file| file.as_ref().unwrap().file_name().to_string_lossy().contains("partial"));
        assert_eq!(left.count(), 0);
    }
}

#[test]
fn a_report_holds_the_run_and_nothing_in_it_ends_a_script_too_soon() {
    let folder = with_run();
    let out = folder.0.join("out/first");
    let page = text(out.join("report.html"));
    assert!(!page.contains("<!--TROPISM:"));
    let block = |id: &str| {
        let (_, after) = page.split_once(&format!(" id=\"{id}\"")).unwrap();
        after.split_once('>').unwrap().1.split_once("</script>").unwrap().0.to_owned()
    };
    let report: Value = serde_json::from_str(&block("report")).unwrap();
    let words = "a small scene; </script><!-- it says -->";
    assert_eq!(
        (&report["kind"], &report["title"], &report["description"]),
        (&json!("run"), &json!("first"), &json!(words))
    );
    assert_eq!((&report["command"], &report["linkage_distance"]), (&json!("tropism first.json"), &json!(10.0)));
    assert_eq!(report["scenario"]["populations"]["axons"]["count"], json!(6));
    assert_eq!(report["summary"]["counts"]["axons"], json!(6));
    assert_eq!(report["measures"]["time"].as_array().unwrap().len(), 9);
    // Four signs of base64 for three bytes of the file beside it.
    let bytes = std::fs::read(out.join("recording.bin")).unwrap();
    assert_eq!(block("recording").len(), bytes.len().div_ceil(3) * 4);
    assert!(block("recording").starts_with("VFJPUFJFQz"), "TROPREC");

    let set = ["--set", "/output/frames=0", "--out", "bare"];
    done(&tropism(&folder, &[&["first.json"], &set[..]].concat()));
    assert!(!folder.0.join("bare/report.html").exists() && !folder.0.join("bare/recording.bin").exists());
    done(&tropism(&folder, &["first.json", "--seeds", "2", "--out", "seeds"]));
    assert!(!folder.0.join("seeds/recording.bin").exists());
    let plan = done(&tropism(&folder, &["plan", "first.json"]));
    assert!(plan.contains("recording.bin, report.html  9 frames"), "{plan}");
    let plan = done(&tropism(&folder, &["plan", "first.json", "--set", "/output/frames=0"]));
    assert!(plan.contains("recording.bin, report.html  `output/frames` is 0"), "{plan}");
}
