//! The house rules: which room may name which, how long a file may be, and what may stand in none.

mod source;

use source::{Mention, Source, sources};

/// What one room may name. The rule's text is what a broken rule is answered with.
struct Room {
    folder: &'static str,
    /// Rooms of the crate, or single files of theirs; `systems` for any of its files.
    rooms: &'static [&'static str],
    /// Packages, the standard library always.
    packages: &'static [&'static str],
    rule: &'static str,
}

const SEAM: &[&str] = &["serde", "serde_json", "serde_path_to_error", "schemars"];

/// Files of the model that belong to the seam and may name serde and schemars.
const SEAM_FILES: &[&str] = &[
    "src/model/mechanism.rs",
    "src/model/material_law.rs",
    "src/model/quantity.rs",
    "src/model/quantity_macro.rs",
    "src/model/keys.rs",
    "src/model/shape.rs",
    "src/model/health.rs",
    "src/model/plan.rs",
];

/// Files of `systems/` that other mechanisms may name.
const PROVIDERS: &[&str] = &["cue_fields", "cue_keys", "matrix", "shaft_index"];

const ROOMS: &[Room] = &[
    Room {
        folder: "src/numerics",
        rooms: &["numerics"],
        packages: &["nalgebra", "faer", "rstar", "rayon", "spade", "thiserror", "pulp"],
        rule: "numerics names the standard library, nalgebra, faer, rstar, rayon, spade, thiserror, pulp and itself; no ECS, no JSON, no other room",
    },
    Room {
        folder: "src/model",
        rooms: &["model", "numerics", "keys", "kept", "quantity"],
        packages: &["bevy_ecs", "nalgebra", "rand", "rand_distr", "rayon", "thiserror"],
        rule: "model names numerics and itself, never scenario, record, systems, simulation or study; serde and schemars in the seam, the counters and the plan only",
    },
    Room {
        folder: "systems",
        rooms: &["prelude", "numerics", "model", "systems", "keys", "kept", "quantity"],
        packages: &["nalgebra", "rstar", "rayon", "rand_distr", "thiserror"],
        rule: "a mechanism names the prelude, numerics, the model and provider files",
    },
    Room {
        folder: "src/scenario",
        // Outlines are checked with the same plane geometry that meshes them.
        rooms: &["scenario", "model", "keys", "numerics::polygon"],
        packages: &["resvg", "serde", "serde_json", "serde_path_to_error", "schemars", "strsim", "thiserror"],
        rule: "scenario names serde, its file readers, the model's seam and numerics::polygon; never bevy_ecs or faer, no other numerics",
    },
    Room {
        folder: "src/record",
        rooms: &["record", "model", "numerics", "scenario", "kept"],
        packages: &[
            "base64",
            "bevy_ecs",
            "crc32fast",
            "flate2",
            "gif",
            "serde",
            "serde_json",
            "miniz_oxide",
            "nalgebra",
            "png",
            "rand",
            "rayon",
            "resvg",
            "thiserror",
            "ttf_parser",
            "zip",
        ],
        rule: "record reads the model and writes files; it never names systems, simulation or study",
    },
    Room {
        folder: "src/simulation",
        rooms: &["simulation", "model", "numerics", "scenario"],
        packages: &["bevy_ecs", "nalgebra", "rand", "thiserror"],
        rule: "simulation takes the roster as an argument and never names systems",
    },
    Room {
        folder: "src/study",
        rooms: &["study", "simulation", "scenario", "record", "model", "numerics", "prelude", "keys"],
        packages: &["bevy_ecs", "serde", "serde_json", "nalgebra", "rayon", "thiserror"],
        rule: "study names simulation, scenario and record; numerics and the prelude too, since maps of stability exercise methods by themselves and under a pull of their own; never systems, which come as a roster",
    },
    Room {
        folder: "src/terminal",
        rooms: &["terminal", "study", "record", "scenario", "model", "new_mechanism"],
        packages: &["clap", "clap_complete", "clap_mangen", "indicatif", "rayon", "serde", "serde_json", "signal_hook"],
        rule: "the terminal names what it calls: study, record, scenario and the model's vocabulary; never numerics or systems",
    },
];

/// The packages of the manifest, and the package itself.
fn packages() -> Vec<String> {
    let manifest = include_str!("../../Cargo.toml");
    let section = manifest.split("[dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
    section.lines().filter_map(|line| line.split_once(" = ")).map(|(name, _)| name.replace('-', "_")).collect()
}

fn is_allowed(room: &Room, source: &Source, mention: &Mention, packages: &[String]) -> bool {
    let first = mention.segments[0].as_str();
    if first == "crate" {
        let within = |allowed: &&str| {
            mention.segments[1..].iter().map(String::as_str).take(allowed.split("::").count()).eq(allowed.split("::"))
        };
        return room.rooms.iter().any(within);
    }
    let seam = SEAM_FILES.contains(&source.path.as_str()) && SEAM.contains(&first);
    !packages.iter().any(|package| package == first) || room.packages.contains(&first) || seam
}

fn broken(sources: &[Source], rule: &str, breaks: impl Fn(&Source, &Mention) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    for source in sources {
        for mention in source.mentions().iter().filter(|mention| breaks(source, mention)) {
            found.push(format!("{}:{}: `{}`: {rule}", source.path, mention.line, mention.segments.join("::")));
        }
    }
    found
}

fn assert_none(found: Vec<String>) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn each_room_names_only_the_rooms_and_packages_it_may() {
    let packages = packages();
    assert!(packages.len() > 10 && packages.contains(&"bevy_ecs".to_owned()));
    for room in ROOMS {
        let sources = sources(room.folder);
        assert!(!sources.is_empty(), "{} has no sources", room.folder);
        assert_none(broken(&sources, room.rule, |source, mention| !is_allowed(room, source, mention, &packages)));
    }
}

#[test]
fn every_folder_of_src_has_its_rule() {
    let folders: Vec<_> =
        sources("src").iter().filter_map(|s| s.path.rsplit_once('/').map(|(f, _)| f.to_owned())).collect();
    for folder in folders.iter().filter(|folder| *folder != "src") {
        assert!(ROOMS.iter().any(|room| folder.starts_with(room.folder)), "{folder} is a room without a rule");
    }
}

#[test]
fn a_mechanism_names_no_other_mechanisms_file() {
    let rule = format!("a mechanism names no other mechanism's file; providers are {}", PROVIDERS.join(", "));
    let files: Vec<_> = sources("systems").into_iter().filter(|source| source.path != "systems/mod.rs").collect();
    let own = |source: &Source| source.path.trim_start_matches("systems/").trim_end_matches(".rs").to_owned();
    assert_none(broken(&files, &rule, |source, mention| match mention.segments.as_slice() {
        [root, room, file, ..] if root == "crate" && room == "systems" => {
            !PROVIDERS.contains(&file.as_str()) && *file != own(source)
        }
        _ => false,
    }));
}

#[test]
fn only_doors_touch_files_and_only_the_command_line_prints() {
    let rule = "model, numerics and systems touch no files";
    for folder in ["src/numerics", "src/model", "systems", "src/simulation"] {
        assert_none(broken(&sources(folder), rule, |_, mention| {
            mention.segments[0] == "std"
                && ["fs", "io", "net", "process", "env"].contains(&mention.segments[1].as_str())
        }));
    }
    let rule = "only the command line prints, by the words of src/terminal/voice.rs";
    for source in sources("src").into_iter().chain(sources("systems")) {
        for word in ["println!", "eprintln!", "print!", "eprint!"] {
            assert!(!source.code.contains(word), "{}: {word}: {rule}", source.path);
        }
    }
}

#[test]
fn record_and_study_change_nothing_in_the_world() {
    for source in sources("src/record").into_iter().chain(sources("src/study")) {
        for word in ["&mut World", "ResMut", "resource_mut", "world_mut", "query_mut"] {
            assert!(!source.code.contains(word), "{}: `{word}`: record and study only read the world", source.path);
        }
    }
}

#[test]
fn a_mechanism_takes_the_world_only_while_it_is_installed() {
    let rule = "outside a provider, `&mut World` is for finishing the installation (ModelBuilder::at_end)";
    for source in sources("systems") {
        let name = source.path.trim_start_matches("systems/").trim_end_matches(".rs");
        for line in source.code.lines().filter(|line| line.contains("&mut World") && !PROVIDERS.contains(&name)) {
            assert!(line.contains("Result<(), InstallError>"), "{}: {}: {rule}", source.path, line.trim());
        }
    }
}

#[test]
fn the_clock_on_the_wall_is_read_by_the_stopwatch_alone() {
    let rule = "wall-clock time is read by src/model/stopwatch.rs alone, so that it never enters results";
    for folder in ["src", "systems"] {
        assert_none(broken(&sources(folder), rule, |source, mention| {
            mention.segments.iter().any(|segment| segment == "Instant" || segment == "SystemTime")
                && source.path != "src/model/stopwatch.rs"
        }));
    }
}

#[test]
fn main_names_the_root_of_the_crate_and_the_roster() {
    let main: Vec<_> = sources("src").into_iter().filter(|source| source.path == "src/main.rs").collect();
    assert_eq!(main.len(), 1);
    assert_none(broken(&main, "main is arguments in, exit code out", |_, mention| {
        let path = mention.segments.join("::");
        mention.segments[0] == "crate" && path != "crate::run" && path != "crate::standard"
    }));
}

#[test]
fn no_file_is_longer_than_450_lines_without_its_tests() {
    for source in sources("src").into_iter().chain(sources("systems")) {
        let lines = source.text.lines().count();
        assert!(lines <= 450, "{} has {lines} lines: a file of one matter stays under 450", source.path);
    }
}

#[test]
fn nothing_is_left_half_done_and_nothing_panics() {
    for source in sources("src").into_iter().chain(sources("systems")) {
        for word in ["TODO", "FIXME", "XXX", "HACK"] {
            assert!(!source.text.contains(word), "{}: {word}: finish it or file an issue", source.path);
        }
        for word in ["dbg!", ".unwrap()", ".expect(", "panic!(", "todo!(", "unimplemented!("] {
            let line = source.code.lines().position(|line| line.contains(word));
            assert!(line.is_none(), "{}:{}: `{word}`: errors are values", source.path, line.unwrap_or(0) + 1);
        }
    }
}

/// The schedule refuses systems without an order that share what one of them writes. What is written behind a shared reference it does
/// not see.
#[test]
fn nothing_is_written_behind_the_back_of_the_schedule() {
    let rule = "state that systems share is written by `ResMut` or a query, where the schedule sees it; the shelf, which is taken away before the first step, may lock";
    for source in sources("src/model").into_iter().chain(sources("systems")) {
        for word in
            ["Mutex", "RwLock", "Atomic", "RefCell", "UnsafeCell", "OnceLock", "OnceCell", "LazyLock", "thread_local!"]
        {
            let line = source.code.lines().position(|line| line.contains(word));
            let line = line.filter(|_| source.path != "src/model/shelf.rs");
            assert!(line.is_none(), "{}:{}: `{word}`: {rule}", source.path, line.unwrap_or(0) + 1);
        }
    }
}

/// The rules rest on this: a checker that finds nothing would let everything pass.
#[test]
fn the_checker_sees_uses_groups_and_paths_but_not_comments_and_strings() {
    let code = source::without_comments_and_strings(
        "use crate::{model::clock::Clock, record};\n// crate::secret::x\nlet a = \"crate::hidden::y\"; let q = '\"';\nfn f(w: &bevy_ecs::world::World) { super::walk::<2>(); }",
    );
    let found: Vec<_> = source::mentions(&code).into_iter().map(|m| (m.line, m.segments.join("::"))).collect();
    let wanted =
        [(1, "crate::model::clock::Clock"), (1, "crate::record"), (4, "bevy_ecs::world::World"), (4, "super::walk")];
    assert_eq!(found, wanted.map(|(line, path)| (line, path.to_owned())));
}
