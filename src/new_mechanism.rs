//! A crate with one mechanism of its own, written from templates: it builds, runs and is tested as it is.
//!
//! The templates are a working mechanism called `steady_pull`; a new one is a copy under another name.

use std::path::{Path, PathBuf};

use crate::record::output::{WriteError, write_atomically};

/// The templates by the paths they are written to.
const FILES: [(&str, &str); 7] = [
    ("Cargo.toml", include_str!("../assets/new_mechanism/manifest.toml")),
    ("README.md", include_str!("../assets/new_mechanism/README.md")),
    ("rustfmt.toml", include_str!("../rustfmt.toml")),
    (".cargo/config.toml", include_str!("../assets/new_mechanism/config.toml")),
    ("src/main.rs", include_str!("../assets/new_mechanism/main.rs")),
    ("src/steady_pull.rs", LAW),
    ("scenarios/steady_pull.json", include_str!("../assets/new_mechanism/scenario.json")),
];

const LAW: &str = include_str!("../assets/new_mechanism/mechanism.rs");

/// The name of the templates' mechanism and that of its type.
const TEMPLATE: [&str; 2] = ["steady_pull", "SteadyPull"];

const LONGEST_NAME: usize = 40;

const KEYWORDS: [&str; 52] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn", "else",
    "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod",
    "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static", "struct", "super", "trait", "true",
    "try", "type", "typeof", "union", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// Names that a package, its program or its file cannot have.
const RESERVED: [&str; 11] =
    ["main", "tropism", "std", "core", "alloc", "proc_macro", "test", "build", "deps", "examples", "incremental"];

/// What is asked for.
#[derive(Debug, Clone)]
pub struct NewMechanism<'a> {
    /// Name of the mechanism, its crate and its file.
    pub name: &'a str,
    /// The folder in which the crate's folder is made.
    pub parent: &'a Path,
    /// The sources of tropism; none: the nearest folder with them above the program or the current folder.
    pub sources: Option<&'a Path>,
    /// Keys that stand at the top of a scene already: of mechanisms and others.
    pub taken: &'a [String],
}

/// Why no crate was written.
#[derive(Debug, thiserror::Error)]
pub enum NewMechanismError {
    /// The name, or a folder, will not do.
    #[error("{0}")]
    Refused(String),
    /// A file could not be written.
    #[error("{0}")]
    Write(#[from] WriteError),
}

/// The crate that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Its folder.
    pub folder: PathBuf,
    /// Its files, relative to the folder.
    pub files: Vec<String>,
    /// The sources of tropism that it depends on.
    pub sources: PathBuf,
}

impl NewMechanism<'_> {
    /// Writes the crate into `parent/name`, which must not exist.
    ///
    /// # Errors
    /// A name that cannot be one or is taken, a folder that exists, sources that are none; a file that cannot be written.
    pub fn write(&self) -> Result<Written, NewMechanismError> {
        check_name(self.name, self.taken).map_err(NewMechanismError::Refused)?;
        let folder = self.parent.join(self.name);
        if folder.symlink_metadata().is_ok() {
            let message = format!("{} exists already; nothing is written over", folder.display());
            return Err(NewMechanismError::Refused(message));
        }
        let sources = match self.sources {
            Some(folder) => Sources::find(folder),
            None => Sources::nearest(),
        };
        let sources = sources.map_err(NewMechanismError::Refused)?;
        if sources.depend_on(self.name) {
            let message =
                format!("`{}` cannot be the name of a mechanism: tropism depends on a crate of this name", self.name);
            return Err(NewMechanismError::Refused(message));
        }
        match self.fill(&folder, &sources) {
            Ok(files) => Ok(Written { folder, files, sources: sources.folder }),
            Err(error) => {
                // A part of a crate is of no use; if it cannot be removed, nothing more can be done.
                let _ = std::fs::remove_dir_all(&folder);
                Err(error.into())
            }
        }
    }

    fn fill(&self, folder: &Path, sources: &Sources) -> Result<Vec<String>, WriteError> {
        let mut files = Vec::new();
        for (path, template) in FILES {
            let path = path.replace(TEMPLATE[0], self.name);
            write_atomically(&folder.join(&path), sources.fill(template, self.name).as_bytes())?;
            files.push(path);
        }
        if let Some(lock) = &sources.lock {
            write_atomically(&folder.join("Cargo.lock"), lock.as_bytes())?;
            files.push("Cargo.lock".to_owned());
        }
        Ok(files)
    }
}

/// The sources of tropism, and what a crate beside them takes over.
struct Sources {
    folder: PathBuf,
    /// The tables of profiles in its manifest.
    profiles: String,
    /// The versions of all that it depends on.
    lock: Option<String>,
}

impl Sources {
    /// Those above the program, which lies among what was built of them, else above the current folder. The program does not remember where
    /// it was built: its bytes are the same wherever that was.
    fn nearest() -> Result<Self, String> {
        let starts = [std::env::current_exe(), std::env::current_dir()];
        let found =
            starts.iter().flatten().flat_map(|start| start.ancestors()).find_map(|folder| Self::find(folder).ok());
        found.ok_or_else(|| {
            "no sources of tropism lie above the program or this folder; name them by --tropism PATH".to_owned()
        })
    }

    fn find(folder: &Path) -> Result<Self, String> {
        let refuse = |why: &str| format!("{} {why}; name the sources of tropism by --tropism PATH", folder.display());
        let folder = folder.canonicalize().map_err(|error| refuse(&format!("cannot be read ({error})")))?;
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).map_err(|_| refuse("has no Cargo.toml"))?;
        if !manifest.lines().any(|line| line.trim() == "name = \"tropism\"") {
            return Err(refuse("holds another package"));
        }
        let lock = std::fs::read_to_string(folder.join("Cargo.lock")).ok();
        Ok(Self { profiles: profiles_of(&manifest), lock, folder })
    }

    /// Whether a crate of this name is among what tropism is built of.
    fn depend_on(&self, name: &str) -> bool {
        let line = format!("name = \"{name}\"");
        self.lock.as_ref().is_some_and(|lock| lock.lines().any(|found| found == line))
    }

    fn fill(&self, template: &str, name: &str) -> String {
        let quoted =
            |path: &Path| format!("\"{}\"", path.display().to_string().replace('\\', "/").replace('"', "\\\""));
        template
            .replace(TEMPLATE[0], name)
            .replace(TEMPLATE[1], &type_name(name))
            .replace("\"TROPISM\"", &quoted(&self.folder))
            .replace("\"TARGET\"", &quoted(&self.folder.join("target")))
            .replace("PROFILES\n", &self.profiles)
    }
}

/// The tables `[profile…]` of a manifest, without comments.
fn profiles_of(manifest: &str) -> String {
    let mut inside = false;
    let mut tables = Vec::new();
    for line in manifest.lines().filter(|line| !line.trim_start().starts_with('#') && !line.trim().is_empty()) {
        if line.starts_with('[') {
            inside = line.starts_with("[profile");
            if inside && !tables.is_empty() {
                tables.push("");
            }
        }
        if inside {
            tables.push(line);
        }
    }
    tables.iter().map(|line| format!("{line}\n")).collect()
}

/// `SteadyPull` of `steady_pull`.
fn type_name(name: &str) -> String {
    let capital = |part: &str| part[..1].to_uppercase() + &part[1..];
    name.split('_').filter(|part| !part.is_empty()).map(capital).collect()
}

/// Whether a name can be that of a module, a crate, a key and, in capitals, a type of the template.
fn check_name(name: &str, taken: &[String]) -> Result<(), String> {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let formed = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(letters)
        && !name.contains("__")
        && !name.ends_with('_');
    if !formed || name.len() > LONGEST_NAME {
        return Err(format!(
            "`{name}` cannot be the name of a mechanism: it takes small letters, digits and single underscores, begins with a letter, and has at most {LONGEST_NAME} characters, as in `steady_pull`"
        ));
    }
    if KEYWORDS.contains(&name) {
        return Err(format!("`{name}` cannot be the name of a mechanism: it is a keyword of Rust"));
    }
    if taken.iter().any(|key| key == name) {
        return Err(format!("`{name}` is a key of scenes already; see `tropism mechanisms`"));
    }
    let type_name = type_name(name);
    let used = |word: &str| word == type_name && word != TEMPLATE[1];
    let shadows = LAW.split(|c: char| !c.is_alphanumeric() && c != '_').any(used);
    if shadows || RESERVED.contains(&name) {
        return Err(format!("`{name}` cannot be the name of a mechanism: the name has another meaning in its crate"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_would_not_compile_or_are_taken_are_refused_with_the_reason() {
        let taken = ["borders".to_owned()];
        for (name, words) in [
            ("", "small letters"),
            ("Drift", "small letters"),
            ("2nd", "small letters"),
            ("_x", "small letters"),
            ("a__b", "small letters"),
            ("a-b", "small letters"),
            ("größe", "small letters"),
            ("../up", "small letters"),
            ("match", "keyword"),
            ("borders", "key of scenes"),
            ("law", "another meaning"),
            ("angle", "another meaning"),
            ("main", "another meaning"),
            ("tropism", "another meaning"),
        ] {
            let refusal = check_name(name, &taken).unwrap_err();
            assert!(refusal.contains(words), "{name}: {refusal}");
        }
        for name in ["galvanotaxis", "steady_pull", "pull_2", "drift"] {
            assert_eq!(check_name(name, &taken), Ok(()), "{name}");
        }
        assert_eq!(type_name("growth_cone_2x"), "GrowthCone2x");
    }

    #[test]
    fn the_name_of_a_crate_that_tropism_is_built_of_is_refused_and_leaves_nothing() {
        let parent = std::env::temp_dir().join(format!("tropism-new-{}", std::process::id()));
        let new = |name| NewMechanism {
            name,
            parent: &parent,
            sources: Some(env!("CARGO_MANIFEST_DIR").as_ref()),
            taken: &[],
        };
        let refusal = new("bevy_ecs").write().unwrap_err().to_string();
        assert!(refusal.contains("tropism depends on a crate of this name"), "{refusal}");
        assert!(!parent.exists());
    }

    #[test]
    fn profiles_are_taken_over_whole() {
        let manifest = "[package]\nname = \"tropism\"\n# why\n[profile.release]\na = 1\n\n[profile.dev]\n# why\nb = 2\n[lints]\nc = 3\n";
        assert_eq!(profiles_of(manifest), "[profile.release]\na = 1\n\n[profile.dev]\nb = 2\n");
    }
}
