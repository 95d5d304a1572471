//! What was recorded before a checkpoint: what no run can have recorded is refused, and whatever is changed in it, nothing panics.

use crate::common::loaded;
use crate::{scene, whole};
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use tropism::model::keep::{Keep, KeptBytes};
use tropism::record::checkpoint::Checkpoint;
use tropism::record::recorder::Recorder;
use tropism::scenario::load::Loaded;
use tropism::study::resume::resumed;
use tropism::systems;

/// A small scene that is recorded in all ways, in a tissue that moves or rests, and two checkpoints of its run.
fn recorded(moves: bool) -> (Loaded, [Checkpoint; 2]) {
    let mut scene = scene();
    if !moves {
        scene.as_object_mut().unwrap().remove("matrix");
    }
    scene["time"]["duration"] = json!(6);
    scene["populations"]["axons"] = json!({ "count": 3, "births": { "uniform": { "from": 0, "to": 1 } } });
    scene["tissue"]["mesh_size"] = json!(150);
    scene["output"] = json!({ "frames": 7, "figure_times": [0.2, 0.5, 1.0], "trajectory_interval": "1 h" });
    let loaded = loaded(&scene, &systems::standard());
    let (_, taken) = whole(&loaded, Path::new("busy.json"), &[0.4, 0.8]);
    (loaded, taken.try_into().unwrap())
}

/// What spoils records.
type Spoil<'a> = &'a dyn Fn(&mut Recorder);

fn refusal(checkpoint: &Checkpoint, recorder: &Recorder) -> Option<String> {
    let mut bytes = Vec::new();
    recorder.keep(&mut bytes);
    recorder.trajectories.keep_streamed(&mut bytes).unwrap();
    let forged = Checkpoint { recorder: bytes, ..checkpoint.clone() };
    resumed(&forged, &systems::standard(), None).err().map(|error| error.to_string())
}

#[test]
fn records_that_no_run_can_have_made_are_refused() {
    let (_, [earlier, later]) = recorded(true);
    let own = |checkpoint: &Checkpoint| KeptBytes::new(&checkpoint.recorder).read::<Recorder>().unwrap();
    assert_eq!(refusal(&earlier, &own(&earlier)), None);
    assert!(own(&earlier).snapshots.len() == 1 && own(&later).snapshots.len() == 2, "pictures on the way");
    let breaks: [(&str, Spoil); 9] = [
        ("look at other instants", &|recorder| *recorder = own(&later)),
        ("a film is there that was not asked for, or not there", &|recorder| {
            recorder.given_up = Some("no room".into())
        }),
        ("a film is there that was not asked for, or not there", &|recorder| drop(recorder.take_film())),
        ("those of another table", &|recorder| {
            recorder.trajectories = tropism::record::csv::CsvTable::new(&[("time", "h")]);
        }),
        ("a picture shows another scene", &|recorder| {
            let twice = recorder.snapshots.clone();
            recorder.snapshots.extend(twice);
        }),
        ("a picture shows another scene", &|recorder| recorder.snapshots[0].cells[0] = u32::MAX),
        ("a picture shows another scene", &|recorder| _ = recorder.snapshots[0].tips.pop()),
        ("a picture shows another scene", &|recorder| recorder.snapshots[0].vertices[0][0] = f64::NAN),
        ("a picture shows another scene", &|recorder| _ = recorder.snapshots[0].fields[0].concentration.pop()),
    ];
    for (place, (reason, spoil)) in breaks.iter().enumerate() {
        let mut recorder = own(&earlier);
        spoil(&mut recorder);
        let words = refusal(&earlier, &recorder).unwrap_or_else(|| panic!("break {place} is gone on from"));
        assert!(words.contains("does not fit: records: ") && words.contains(reason), "break {place}: {words}");
    }
}

#[test]
fn whatever_is_changed_in_records_is_refused_or_gone_on_from_to_the_end() {
    let (loaded, [checkpoint, _]) = recorded(false);
    let mut refused = 0;
    let places: Vec<usize> = (0..checkpoint.recorder.len()).step_by(checkpoint.recorder.len() / 80).collect();
    for (turn, place) in places.iter().enumerate() {
        let mut recorder = checkpoint.recorder.clone();
        let end = recorder.len().min(place + 8);
        let word =
            [u64::MAX, 0, 1 << 20, u64::from_le_bytes([0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0])][turn % 4].to_le_bytes();
        recorder[*place..end].copy_from_slice(&word[..end - place]);
        let forged = Checkpoint { recorder, ..checkpoint.clone() };
        let went = catch_unwind(AssertUnwindSafe(|| {
            resumed(&forged, &systems::standard(), None).is_ok_and(|mut found| {
                let ended = found.run.to_end(|_| None).unwrap();
                found.run.finish(&loaded, &ended).unwrap();
                true
            })
        }));
        refused += u32::from(!went.unwrap_or_else(|_| panic!("a word at {place} of {}", checkpoint.recorder.len())));
    }
    assert!(refused > 15 && (refused as usize) < places.len(), "{refused} of {} are refused", places.len());
}
