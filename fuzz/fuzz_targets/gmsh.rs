//! Fuzzes `gmsh`: see `tests/replay/targets.rs`.
#![no_main]
#![allow(dead_code)]

#[path = "../../tests/replay/targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::gmsh(bytes));
