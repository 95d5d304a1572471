//! Replays the seeds of the fuzzer, each as it is, cut short, and with bytes changed: nothing panics.

mod targets;

use targets::{TARGETS, seeds};

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
