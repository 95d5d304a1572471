//! `manifest.json`: what was run, with what.

use crate::scenario::load::Loaded;
use serde::Serialize;
use serde_json::Value;

/// Everything needed to run a scene again.
#[derive(Debug, Clone, Serialize)]
pub struct Manifest {
    /// Name of the scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// Version of the program.
    pub version: &'static str,
    /// Threads the run could use; results do not depend on it.
    pub threads: usize,
    /// Threads the host has.
    pub host_threads: usize,
    /// Operating system and processor family.
    pub platform: String,
    /// The scenario after `base`, `--without` and `--set`.
    pub scenario: Value,
}

impl Manifest {
    /// The manifest of a loaded scene.
    pub fn of(loaded: &Loaded) -> Self {
        Self {
            scene: loaded.scene.name.clone(),
            seed: loaded.scene.seed,
            version: env!("CARGO_PKG_VERSION"),
            threads: rayon::current_num_threads(),
            host_threads: std::thread::available_parallelism().map_or(1, usize::from),
            platform: format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH),
            scenario: loaded.merged.clone(),
        }
    }
}
