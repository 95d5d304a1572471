//! Replays the seeds of the fuzzer, each as it is, cut short, and with bytes changed: nothing panics.

mod targets;

use miniz_oxide::inflate::decompress_to_vec_zlib;
use targets::{TARGETS, seeds};
use tropism::record::checkpoint::Checkpoint;
use tropism::study::resume::resumed;
use tropism::study::run::{Records, Run, read_document};
use tropism::systems::standard;

/// Changed copies of each seed.
const CHANGES: u64 = 60;

/// A number that depends on its seed alone (SplitMix64).
fn mixed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A seed with up to four bytes changed, dropped or doubled.
fn changed(seed: &[u8], number: u64) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for change in 0..1 + number % 4 {
        if bytes.is_empty() {
            return bytes;
        }
        let draw = mixed(number << 8 | change);
        let place = (draw >> 16) as usize % bytes.len();
        match draw % 4 {
            0 => bytes[place] = (draw >> 8) as u8,
            1 => drop(bytes.remove(place)),
            2 => bytes.insert(place, b"0123456789-.eE{}[]\",: nu"[(draw >> 40) as usize % 24]),
            _ => bytes.truncate(place),
        }
    }
    bytes
}

#[test]
fn the_seeds_of_the_fuzzer_and_their_neighbours_are_read_or_refused() {
    for (name, target) in TARGETS {
        let mut files: Vec<_> = std::fs::read_dir(seeds(name)).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        assert!(!files.is_empty(), "{name} has no seeds");
        for file in files {
            let seed = std::fs::read(&file).unwrap();
            target(&seed);
            for number in 0..CHANGES {
                let bytes = changed(&seed, number);
                let caught = std::panic::catch_unwind(|| target(&bytes));
                assert!(caught.is_ok(), "{name}: change {number} of {}", file.display());
            }
        }
    }
}

/// The scene whose checkpoint and recording are seeds.
const SCENE: &str = include_str!("../../fuzz/corpus/scenario/small_remodelling.json");

/// That scene after some steps, as a checkpoint, and at its end, as a recording whose arrays are not deflated.
fn binary_seeds() -> [(&'static str, &'static str, Vec<u8>); 2] {
    let roster = standard();
    let mut scene: serde_json::Value = serde_json::from_str(SCENE).unwrap();
    // What mechanisms keep is not looked at when it is read back; zippering keeps places of others.
    scene["zippering"].take();
    let loaded = read_document("small", scene, &roster).unwrap();
    let mut run = Run::begin(&loaded, &roster, "small.json".as_ref(), Records::ALL).unwrap();
    let mut steps = 0;
    let ended = run.to_end(|_| {
        steps += 1;
        (steps > 20).then(|| "stopped".to_owned())
    });
    let checkpoint = Checkpoint {
        path: "small.json".into(),
        command: String::new(),
        scene: loaded.merged.to_string(),
        remarks: Vec::new(),
        interval: None,
        time: run.simulation.time(),
        state: run.simulation.keep(),
        recorder: run.keep_records().unwrap(),
    };
    let recording = run.finish(&loaded, &ended.unwrap()).unwrap().recording.unwrap().to_bytes().unwrap();
    let length = u32::from_le_bytes(recording[8..12].try_into().unwrap()) as usize;
    let (head, arrays) = recording.split_at((12 + length).next_multiple_of(8));
    let arrays = decompress_to_vec_zlib(arrays).unwrap();
    [("checkpoint", "whole", checkpoint.to_bytes()), ("recording", "inflated", [head, &arrays].concat())]
}

/// A seed that is refused at its first byte would test nothing.
#[test]
fn the_seeds_of_binary_files_are_of_the_format_that_is_written_now() {
    for (target, name, bytes) in binary_seeds() {
        let stored = std::fs::read(seeds(target).join(name)).unwrap();
        let words = "cargo test --test replay -- --ignored writes it anew";
        assert_eq!(
            stored.len(),
            bytes.len(),
            "fuzz/corpus/{target}/{name} has another length than what is written: {words}"
        );
    }
    let checkpoint = std::fs::read(seeds("checkpoint").join("whole")).unwrap();
    let found = Checkpoint::from_bytes(&checkpoint).unwrap();
    resumed(&found, &standard(), None).map(|resumed| assert!(resumed.run.simulation.time() > 0.0)).unwrap();
}

#[test]
#[ignore = "writes the seeds of checkpoints and recordings anew"]
fn seeds_of_binary_files_are_written() {
    for (target, name, bytes) in binary_seeds() {
        std::fs::write(seeds(target).join(name), bytes).unwrap();
    }
}
