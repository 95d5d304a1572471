//! Whether a scene fits into memory. One that does not is refused before it starts, with both figures, rather than ended by the kernel on
//! its way.
//!
//! What a run may take is what the user says, or what the machine has free: the least of `MemAvailable` in `/proc/meminfo` and of what
//! the memory limits of the process's control groups (versions 1 and 2) leave, with what the process holds already. Where the
//! system does not tell, nothing is refused.

use super::estimate::Estimate;
use super::estimate::outlook::outlook;
use super::run::RunError;
use crate::record::summary::memory_mib;
use crate::scenario::scene::Scene;
use std::path::{Path, PathBuf};

/// Bytes in a mebibyte and in a kibibyte.
const MEBIBYTE: f64 = 1_048_576.0;
const KIBIBYTE: f64 = 1024.0;
const MEGABYTE: f64 = 1e6;

/// Units of memory, in bytes.
const UNITS: [(&str, f64); 8] = [
    ("kB", 1e3),
    ("MB", 1e6),
    ("GB", 1e9),
    ("TB", 1e12),
    ("KiB", KIBIBYTE),
    ("MiB", MEBIBYTE),
    ("GiB", 1024.0 * MEBIBYTE),
    ("TiB", 1024.0 * 1024.0 * MEBIBYTE),
];

/// The memory that a run may take.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Room {
    /// What the machine has free.
    #[default]
    Free,
    /// So much (bytes).
    Given(f64),
    /// Any amount: nothing is refused.
    Any,
}

impl Room {
    /// A room from a text such as `8GB` or `512 MiB`, from `any`, or from `free`.
    ///
    /// # Errors
    /// A text that is neither, or an amount that is not positive.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "any" => return Ok(Self::Any),
            "free" => return Ok(Self::Free),
            _ => {}
        }
        let amount = UNITS.iter().find_map(|(unit, bytes)| {
            let number: f64 = text.strip_suffix(unit)?.trim_end().parse().ok()?;
            Some(number * bytes)
        });
        match amount {
            Some(bytes) if bytes > 0.0 && bytes.is_finite() => Ok(Self::Given(bytes)),
            _ => Err("an amount with its unit belongs here, such as 8GB or 512MiB, or `any`, or `free`".to_owned()),
        }
    }

    /// Lets a scene through whose axons and mesh alone fit.
    ///
    /// # Errors
    /// As [`Self::admit`].
    pub fn admit_outlook(self, scene: &Scene) -> Result<(), RunError> {
        self.admit(&scene.name, &outlook(scene), 1)
    }

    /// Bytes that axons and mesh of a scene, before anything is made of it, leave to what is solved, if there is a bound.
    pub fn beside(self, scene: &Scene) -> Option<f64> {
        let bytes = match self {
            Self::Any => return None,
            Self::Given(bytes) => bytes - memory_mib("VmRSS:").unwrap_or_default() * MEBIBYTE,
            Self::Free => free(Path::new("/"))?.0,
        };
        Some(bytes - outlook(scene).total * MEGABYTE)
    }

    /// Lets a scene through that needs `estimate` (MB), `at_once` times.
    ///
    /// # Errors
    /// A scene that does not fit: both figures, what takes most, and how to have it run all the same.
    pub fn admit(self, scene: &str, estimate: &Estimate, at_once: usize) -> Result<(), RunError> {
        let (bytes, told) = match self {
            Self::Any => return Ok(()),
            Self::Given(bytes) => (bytes, "`--memory` allows".to_owned()),
            Self::Free => match free(Path::new("/")) {
                Some((bytes, source)) => {
                    let held = memory_mib("VmRSS:").unwrap_or_default() * MEBIBYTE;
                    (bytes + held, format!("{source} leaves"))
                }
                None => return Ok(()),
            },
        };
        let needed = estimate.total * MEGABYTE * at_once as f64;
        if needed <= bytes {
            return Ok(());
        }
        let most =
            estimate.parts.iter().take(3).map(|part| format!("{} {}", part.name, amount(part.amount * MEGABYTE)));
        let most = most.collect::<Vec<_>>().join(", ");
        let runs = if at_once > 1 { format!(" for {at_once} runs at once") } else { String::new() };
        let less = if at_once > 1 { "fewer `--threads` take less; " } else { "" };
        Err(RunError::Arguments(format!(
            "{scene} does not fit into memory: it needs about {}{runs}, {told} {}. Most of it (a run): {most}. \
             It has not been started; {less}`--memory any` runs it all the same",
            amount(needed),
            amount(bytes)
        )))
    }
}

/// An amount of memory in words, from bytes.
fn amount(bytes: f64) -> String {
    let (unit, size) = UNITS[..4].iter().rev().find(|(_, size)| bytes >= *size).unwrap_or(&UNITS[0]);
    let number = bytes / size;
    if number < 1e4 { format!("{number:.1} {unit}") } else { format!("{number:.1e} {unit}") }
}

/// Bytes that are free for this process, and what says so; `root` is the root of the file system.
fn free(root: &Path) -> Option<(f64, String)> {
    let machine = available(root).map(|bytes| (bytes, "MemAvailable".to_owned()));
    machine.into_iter().chain(groups(root)).min_by(|a, b| a.0.total_cmp(&b.0))
}

fn available(root: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(root.join("proc/meminfo")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * KIBIBYTE)
}

/// What the limit of each control group that the process is in leaves.
fn groups(root: &Path) -> Vec<(f64, String)> {
    let text = std::fs::read_to_string(root.join("proc/self/cgroup")).unwrap_or_default();
    let mut found = Vec::new();
    for line in text.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(group)) = (parts.next(), parts.next()) else { continue };
        let (top, limit, used) = match controllers {
            "" => ("sys/fs/cgroup", "memory.max", "memory.current"),
            "memory" => ("sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
            _ => continue,
        };
        let top = root.join(top);
        let below: PathBuf = group.trim_start_matches('/').into();
        for folder in below.ancestors().map(|path| top.join(path)) {
            let left = number(&folder.join(limit)).zip(number(&folder.join(used)));
            let left = left.map(|(limit, used)| (limit - used + cached(&folder)).max(0.0));
            found.extend(left.map(|bytes| (bytes, "the memory limit of its control group".to_owned())));
        }
    }
    found
}

/// A file's number; none where it says `max`.
fn number(path: &Path) -> Option<f64> {
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}

/// Bytes of files that a group's usage counts, and that the kernel gives back when memory is asked for.
fn cached(folder: &Path) -> f64 {
    let text = std::fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let of = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.trim().parse::<f64>().ok());
    of("total_inactive_file ").or(of("inactive_file ")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::estimate::Share;

    fn machine(name: &str, files: &[(&str, &str)]) -> PathBuf {
        let root = std::env::temp_dir().join(format!("tropism-room-{}-{name}", std::process::id()));
        for (file, text) in files {
            let path = root.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        root
    }

    /// 90 MB a run.
    fn estimate() -> Estimate {
        let part = |name: &str, amount| Share { name: name.into(), amount };
        Estimate { total: 90.0, parts: vec![part("mesh", 60.0), part("axons", 30.0)] }
    }

    #[test]
    fn amounts_are_read_with_their_unit() {
        for (text, bytes) in [("8GB", 8e9), ("1.5 MB", 1.5e6), ("2KiB", 2048.0), ("1 TiB", 1_099_511_627_776.0)] {
            assert_eq!(Room::parse(text), Ok(Room::Given(bytes)), "{text}");
        }
        assert_eq!((Room::parse("any"), Room::parse("free")), (Ok(Room::Any), Ok(Room::Free)));
        for text in ["", "8", "GB", "-1GB", "0MB", "NaN MB", "inf GB", "8 gb", "any GB"] {
            assert!(Room::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_scene_is_refused_where_it_does_not_fit_and_only_there() {
        assert!(Room::Given(90.0e6).admit("a", &estimate(), 1).is_ok());
        let said = Room::Given(89.0e6).admit("a", &estimate(), 1).unwrap_err().to_string();
        for words in ["about 90.0 MB", "allows 89.0 MB", "mesh 60.0 MB, axons 30.0 MB", "--memory any"] {
            assert!(said.contains(words), "{words}: {said}");
        }
        assert!(
            Room::Given(179.0e6).admit("a", &estimate(), 2).unwrap_err().to_string().contains("for 2 runs at once")
        );
        assert!(Room::Given(180.0e6).admit("a", &estimate(), 2).is_ok());
        assert!(Room::Any.admit("a", &Estimate { total: f64::INFINITY, ..estimate() }, 1).is_ok());
    }

    #[test]
    fn what_is_free_is_the_least_of_the_machine_and_the_groups() {
        let meminfo = ("proc/meminfo", "MemTotal: 9000 kB\nMemAvailable: 4000 kB\n");
        let alone = machine("alone", &[meminfo]);
        assert_eq!(free(&alone).unwrap(), (4000.0 * 1024.0, "MemAvailable".to_owned()));
        let second = [
            meminfo,
            ("proc/self/cgroup", "0::/jobs/mine\n"),
            ("sys/fs/cgroup/jobs/mine/memory.max", "max\n"),
            ("sys/fs/cgroup/jobs/mine/memory.current", "7\n"),
            ("sys/fs/cgroup/jobs/memory.max", "5000\n"),
            ("sys/fs/cgroup/jobs/memory.current", "2000\n"),
            ("sys/fs/cgroup/jobs/memory.stat", "anon 9\ninactive_file 500\n"),
        ];
        let (bytes, source) = free(&machine("second", &second)).unwrap();
        assert_eq!((bytes, source.contains("control group")), (3500.0, true));
        let first = [
            meminfo,
            ("proc/self/cgroup", "4:cpu:/jobs\n3:memory:/jobs\n"),
            ("sys/fs/cgroup/memory/jobs/memory.limit_in_bytes", "800"),
            ("sys/fs/cgroup/memory/jobs/memory.usage_in_bytes", "900"),
        ];
        assert_eq!(free(&machine("first", &first)).unwrap().0, 0.0);
        assert_eq!(free(&machine("nothing", &[("proc/version", "")])), None);
        for name in ["alone", "second", "first", "nothing"] {
            std::fs::remove_dir_all(machine(name, &[])).unwrap();
        }
    }
}
