//! What a run leaves to be looked at again: it shows what the run showed, and a file that is not whole is refused.

mod common;

use common::{loaded, recorded};
use serde_json::{Value, json};
use std::sync::OnceLock;
use tropism::record::recording::{Recording, RecordingError};
use tropism::record::snapshot::Snapshot;
use tropism::study::run::Finished;
use tropism::systems::standard;

/// A tissue that stretches, two cues, a target, births on the way, branches and pruning: all that a recording holds.
fn scene() -> Value {
    json!({
        "description": "all that a recording holds </script>",
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 30 },
        "time": { "duration": 8, "step": "4 min" },
        "populations": {
            "early": { "count": 5, "births": { "uniform": { "from": 0, "to": 1 } } },
            "late": { "count": 3, "births": { "at": 3.1 } }
        },
        "targets": { "bulb": { "disc": { "centre": [150, 160], "radius": 25 } } },
        "matrix": { "motion": { "top": { "outward": 0.1 } , "bottom": { "outward": 0.0 } } },
        "cues": {
            "attractant": { "sources": [{ "disc": { "centre": [150, 160], "radius": 25 } }] },
            "unturned": { "sources": [{ "disc": { "centre": [150, 40], "radius": 25 } }] }
        },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "borders": {}, "heading_noise": {},
        "branching": { "rate": 0.3, "angle": 60, "cue": "unturned", "half_concentration": "0.001 nM" },
        "retraction": { "prune_after": "3 h", "speed": "60 um/h" },
        "output": { "figure_times": [0, 0.33, 0.77, 1], "frames": 17 }
    })
}

fn finished(scene: &Value) -> Finished {
    recorded(&loaded(scene, &standard()), &standard())
}

fn recording(scene: &Value) -> (Recording, Vec<Snapshot>) {
    let finished = finished(scene);
    (finished.recording.unwrap(), finished.recorder.snapshots)
}

/// A small recording as bytes.
fn bytes() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let mut small = scene();
        small["tissue"]["mesh_size"] = json!(60);
        small["output"]["frames"] = json!(4);
        recording(&small).0.to_bytes().unwrap()
    })
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn distance_to_line(point: [f64; 2], line: &[[f64; 2]]) -> f64 {
    let to_piece = |ends: &[[f64; 2]]| {
        let d = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let p = [point[0] - ends[0][0], point[1] - ends[0][1]];
        let t = ((d[0] * p[0] + d[1] * p[1]) / (d[0] * d[0] + d[1] * d[1]).max(1e-300)).clamp(0.0, 1.0);
        (p[0] - t * d[0]).hypot(p[1] - t * d[1])
    };
    line.windows(2).map(to_piece).fold(f64::INFINITY, f64::min)
}

/// Largest distance of a point of either line from the other.
fn apart(one: &[[f64; 2]], other: &[[f64; 2]]) -> f64 {
    let farthest =
        |from: &[[f64; 2]], to: &[[f64; 2]]| from.iter().map(|point| distance_to_line(*point, to)).fold(0.0, f64::max);
    farthest(one, other).max(farthest(other, one))
}

fn assert_near(points: &[[f64; 2]], others: &[[f64; 2]], tolerance: f64, what: &str) {
    assert_eq!(points.len(), others.len(), "{what}");
    let worst = points.iter().zip(others).map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max);
    assert!(worst <= tolerance, "{what}: {worst} > {tolerance}");
}

/// That a snapshot made from a recording shows what one of the run shows.
fn assert_same(again: &Snapshot, seen: &Snapshot, quantum: f64) {
    // Half a quantum in x and in y, and the single precision of what is kept of the run.
    let near = 0.5 * quantum * 2f64.sqrt() + 1e-4;
    assert_eq!((again.time, &again.cells), (seen.time, &seen.cells));
    assert_near(&again.vertices, &seen.vertices, near, "vertices");
    for (again, seen) in again.borders.iter().zip(&seen.borders).chain(again.targets.iter().zip(&seen.targets)) {
        assert_eq!(again.0, seen.0);
        assert_near(&again.1, &seen.1, near, &seen.0);
    }
    assert_eq!((again.borders.len(), again.targets.len()), (seen.borders.len(), seen.targets.len()));
    for (again, seen) in again.fields.iter().zip(&seen.fields) {
        assert_eq!((&again.name, again.effect), (&seen.name, seen.effect));
        let most = seen.concentration.iter().copied().fold(0.0, f64::max);
        let worst = again.concentration.iter().zip(&seen.concentration).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-5 * most.max(1.0), "{}: {worst}", seen.name);
    }
    assert_eq!((again.fields.len(), again.tips.len()), (seen.fields.len(), seen.tips.len()));
    for (again, seen) in again.tips.iter().zip(&seen.tips) {
        assert_eq!((again.axon, again.status, again.is_branch), (seen.axon, seen.status, seen.is_branch));
        assert!(distance(again.position, seen.position) <= near, "{again:?} {seen:?}");
        let turned = (again.heading[0] * seen.heading[0] + again.heading[1] * seen.heading[1]).clamp(-1.0, 1.0).acos();
        assert!(turned <= std::f64::consts::PI / 256.0 + 1e-6, "{again:?} {seen:?}");
    }
    for (again, seen) in again.shafts.iter().zip(&seen.shafts) {
        // Weights are quantised in cells of the mesh's size, which is far below that of the box.
        let far = apart(again, seen);
        assert!(far <= 2.0 * near, "shafts lie {far} um apart");
    }
}

fn quantum(recording: &Recording) -> f64 {
    let [left, low, right, high] = recording.header.bounds;
    (right - left).max(high - low) / 65535.0
}

#[test]
fn a_recording_reads_back_as_it_was_and_shows_what_the_run_showed() {
    let (recording, snapshots) = recording(&scene());
    let read = Recording::read(&recording.to_bytes().unwrap()).unwrap();
    assert!(read == recording);
    assert_eq!(read.header.figure_frames.len(), snapshots.len());
    assert_eq!(read.header.frames.len(), 17 + 2, "two of the figure's times fall between the frames");
    assert!(read.shaft_end.is_some(), "pruning strikes shafts out");
    assert!(snapshots.last().unwrap().tips.iter().any(|tip| tip.is_branch));
    assert!(read.axon_parent.iter().any(|&parent| parent < 8));
    for (time, seen) in read.figure_times().into_iter().zip(&snapshots) {
        assert_same(&read.snapshot(time), seen, quantum(&read));
    }
    let last = |name: &str| *read.header.measures[name].last().unwrap();
    assert_eq!((last("born"), last("time")), (8.0, 8.0));
    assert!(read.header.measures.values().all(|column| column.len() == 19));
    assert_eq!(read.header.cues.iter().map(|cue| cue.effect.as_deref()).collect::<Vec<_>>(), [Some("attract"), None]);
}

#[test]
fn shafts_that_zip_are_seen_as_they_were_at_each_frame() {
    let zippering: Value = serde_json::from_str(include_str!("../scenarios/zippering.json")).unwrap();
    let mut zippering = zippering;
    zippering["output"] = json!({ "figure_times": [0.5, 0.58, 0.6, 0.7, 0.9, 1], "frames": 33 });
    let (recording, snapshots) = recording(&zippering);
    let read = Recording::read(&recording.to_bytes().unwrap()).unwrap();
    assert!(read.shaft_end.is_some());
    for (time, seen) in read.figure_times().into_iter().zip(&snapshots) {
        assert_same(&read.snapshot(time), seen, quantum(&read));
    }
    // Zipping moves shafts, so the end is not what lay there before.
    let (before, after) = (&snapshots[1].shafts, &snapshots[5].shafts);
    assert!(before.iter().zip(after).any(|(before, after)| apart(before, after) > 5.0));
}

#[test]
fn between_frames_everything_lies_between() {
    let (recording, _) = recording(&scene());
    let [from, to] = [recording.header.frames[6], recording.header.frames[7]];
    let [before, middle, after] = [from, 0.5 * (from + to), to].map(|time| recording.snapshot(time));
    assert_eq!(middle.time, 0.5 * (from + to));
    for ((a, b), c) in before.vertices.iter().zip(&middle.vertices).zip(&after.vertices) {
        assert!(distance(*b, [0.5 * (a[0] + c[0]), 0.5 * (a[1] + c[1])]) < 1e-9);
    }
    assert!(middle.tips.iter().zip(&before.tips).any(|(a, b)| distance(a.position, b.position) > 1.0));
    // Beyond the ends there is nothing else.
    assert_eq!((recording.snapshot(-1.0).time, recording.snapshot(f64::NAN).time), (0.0, 0.0));
    assert_eq!(recording.snapshot(1e9).time, 8.0);
}

#[test]
fn a_tissue_at_rest_is_stored_once_and_no_frames_leave_no_recording() {
    let mut still = scene();
    still.as_object_mut().unwrap().remove("matrix");
    let (recording, _) = recording(&still);
    assert_eq!(recording.vertex_frames(), 1);
    assert!(recording.header.cues.iter().all(|cue| cue.frames == [0]), "a field at rest is stored once");
    let with = finished(&still);
    still["output"]["frames"] = json!(0);
    let without = finished(&still);
    assert!(without.recording.is_none());
    assert!(with.recorder.trajectories.as_str() == without.recorder.trajectories.as_str(), "looking changes nothing");
    let output = loaded(&json!({}), &standard()).scene.output;
    assert_eq!((output.frames(20_000), output.frames(20_001)), (73, 0));
}

#[test]
fn frames_are_those_asked_for_and_without_a_figure_the_end_is_shown() {
    let mut broken = scene();
    broken["output"]["frames"] = json!(3);
    broken["output"]["figure_times"] = json!([]);
    let (recording, _) = recording(&broken);
    assert_eq!(recording.header.frames, [0.0, 4.0, 8.0]);
    assert_eq!(recording.figure_times(), [8.0]);
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused_with_a_reason() {
    let whole = bytes();
    assert!(Recording::read(whole).is_ok());
    for length in 0..whole.len() {
        let error = Recording::read(&whole[..length]).expect_err("a part is no whole");
        assert!(error.to_string().contains("cut off"), "{length} of {}: {error}", whole.len());
    }
}

/// The file with something in its header changed.
fn with_header(change: impl Fn(&mut Value)) -> Result<Recording, RecordingError> {
    let whole = bytes();
    let length = u32::from_le_bytes(whole[8..12].try_into().unwrap()) as usize;
    let mut header: Value = serde_json::from_slice(&whole[12..12 + length]).unwrap();
    change(&mut header);
    let text = header.to_string();
    let mut file = [&whole[..8], &(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    file.resize(file.len().next_multiple_of(8), 0);
    file.extend_from_slice(&whole[(12 + length).next_multiple_of(8)..]);
    Recording::read(&file)
}

#[test]
fn what_does_not_fit_is_refused_with_its_name() {
    assert!(with_header(|_| ()).is_ok());
    let cases: [(&str, Value, &str); 14] = [
        ("/version", json!(2), "it has version 2; this program reads version 1"),
        ("/version", Value::Null, "no `version`"),
        ("/frames/1", json!(0), "`frames` does not ascend"),
        ("/axon_count", json!(7), "array `tip_position`: it has"),
        ("/axon_count", json!(u64::MAX), "array `tip_position`: it has"),
        ("/box", json!([0, 0, 0, 1]), "`box` is no box"),
        ("/arrays/cells/offset", json!(3), "array `cells`: its offset 3 is no place for it"),
        ("/arrays/tip_status/offset", json!(u64::MAX / 2), "array `tip_status`"),
        ("/arrays/vertices/length", json!(u64::MAX / 4), "array `vertices`"),
        ("/arrays/vertices/coding", json!("zigzag"), "the coding `zigzag` is unknown"),
        ("/arrays/shaft_time/type", json!("f64"), "array `shaft_time`: its type is unknown"),
        ("/cues/0/frames", json!([0, 9999]), "array `cue_0`: it has"),
        ("/populations", json!(["early"]), "array `axon_population`: it names number 1 of 1"),
        ("/borders/0/vertices/0", json!(4_000_000), "`borders`: what is said of `bottom`"),
    ];
    for (pointer, value, words) in cases {
        let change = |header: &mut Value| *header.pointer_mut(pointer).unwrap() = value.clone();
        let error = with_header(change).expect_err(pointer).to_string();
        assert!(error.contains(words), "{pointer}: {error}");
    }
    let missing = |header: &mut Value| drop(header["arrays"].as_object_mut().unwrap().remove("cells"));
    assert!(with_header(missing).unwrap_err().to_string().contains("array `cells`: it is not there"));
    assert_eq!(Recording::read(b"no recording at all"), Err(RecordingError::NotOne));
}

/// What a file with one bit changed reads as.
fn with_bit(place: usize, bit: u32) -> Result<Recording, RecordingError> {
    let mut file = bytes().to_vec();
    file[place] ^= 1 << bit;
    Recording::read(&file)
}

/// A changed bit may go unnoticed in a word of the header, but it never ends in a panic; the arrays are those that were
/// written, or it is noticed. (Deflate has more than one word for the same bytes, as where a pattern repeats.)
#[test]
fn a_changed_bit_is_survived_and_no_array_is_read_that_was_not_written() {
    let whole = bytes();
    let written = Recording::read(whole).unwrap();
    let length = u32::from_le_bytes(whole[8..12].try_into().unwrap()) as usize;
    let arrays = (12 + length).next_multiple_of(8);
    let (mut noticed, mut same) = (0, 0);
    for (place, bit) in (0..whole.len()).flat_map(|place| (0..8).map(move |bit| (place, bit))) {
        match with_bit(place, bit) {
            Ok(recording) if place < arrays => drop(recording.snapshot(4.0)),
            Ok(recording) => {
                assert_eq!(recording, written, "bit {bit} of byte {place}");
                same += 1;
            }
            Err(_) => noticed += 1,
        }
    }
    assert!(100 * same < noticed, "{same} changes read as if nothing had changed, {noticed} are noticed");
}
