//! Axons as SWC (Cannon et al., J. Neurosci. Methods 84:49, 1998, doi:10.1016/S0165-0270(98)00091-0): one tree a file, points in µm.
//!
//! A line is `id type x y z radius parent`, ids from 1, type 2 (axon), parent −1 for the first point. The model has no soma: the first
//! point is where the axon leaves it, on its surface. It has no radius either: that is a key. The model is planar: z = 0. An axon that is
//! a single point has no file, since readers refuse it; it is listed in the notes.

use super::super::csv::format_number;
use super::super::output::{Partial, WriteError, clear_folder, no_link, write_unsynced};
use super::swc_tree::{Tree, trees};
use super::{Output, OutputError};
use crate::model::clock::Clock;
use crate::model::keep::{Damage, Keep, KeptBytes};
use crate::scenario::scene::Swc;
use bevy_ecs::prelude::World;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::io::{Cursor, Error, Write as _};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// `swc/axon_17.swc`, or the same in `swc.zip`; with an interval `swc/0000/…`, numbered.
pub struct SwcFiles {
    folder: PathBuf,
    keys: Swc,
    looks: usize,
    single: BTreeSet<u32>,
    written: usize,
}

impl SwcFiles {
    /// Begins in the folder of results.
    ///
    /// # Errors
    /// A link in the place of the folder of trees.
    pub fn create(folder: &Path, keys: Swc) -> Result<Self, OutputError> {
        if !keys.archive {
            no_link(&folder.join("swc"))?;
        }
        Ok(Self { folder: folder.to_owned(), keys, looks: 0, single: BTreeSet::new(), written: 0 })
    }

    /// Where the files of this look go.
    fn place(&self) -> PathBuf {
        let place = self.folder.join("swc");
        if self.keys.interval.is_some() { place.join(format!("{:04}", self.looks)) } else { place }
    }
}

impl Output for SwcFiles {
    fn look(&mut self, world: &World) -> Result<(), OutputError> {
        let hours = world.resource::<Clock>().hours();
        let (whole, single): (Vec<_>, Vec<_>) = trees(world).into_iter().partition(|tree| tree.nodes.len() > 1);
        let width = whole.iter().map(|tree| tree.axon).max().unwrap_or(0).to_string().len();
        let files = whole.iter().map(|tree| (format!("axon_{:0width$}.swc", tree.axon), text(tree, hours, &self.keys)));
        match self.keys.archive {
            true => write_archive(&self.place().with_extension("zip"), files)?,
            false => write_folder(&self.place(), files)?,
        }
        self.looks += 1;
        self.written = whole.len();
        self.single = single.iter().map(|tree| tree.axon).collect();
        Ok(())
    }

    fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        self.looks.keep(into);
        Ok(())
    }

    fn restore(&mut self, from: &mut KeptBytes) -> Result<(), OutputError> {
        self.looks = from.read()?;
        if u32::try_from(self.looks).is_err() {
            return Err(Damage(format!("{} looks at shafts are more than any run takes", self.looks)).into());
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<String>, OutputError> {
        if self.single.is_empty() {
            return Ok(Vec::new());
        }
        let numbers: Vec<String> = self.single.iter().map(u32::to_string).collect();
        let (count, files) = (self.single.len(), self.written);
        let noun = if count == 1 { "axon is" } else { "axons are" };
        Ok(vec![format!("swc: {files} files; {count} {noun} a single point and in none: {}", numbers.join(", "))])
    }
}

/// A tree as a file.
fn text(tree: &Tree, hours: f64, keys: &Swc) -> String {
    let (axon, population) = (tree.axon, tree.population.replace(char::is_control, " "));
    let mut text = format!(
        "# tropism {}: axon {axon}, population {population}, t = {} h\n\
         # Lengths in um. The model has no soma: the first point is where the axon leaves its surface. The radius is set.\n\
         # length {} um\n# id type x y z radius parent\n",
        env!("CARGO_PKG_VERSION"),
        format_number(hours),
        format_number(tree.length()),
    );
    let radius = format_number(keys.radius.0);
    for (place, node) in tree.nodes.iter().enumerate() {
        let [x, y] = node.at.map(|x| if x == 0.0 { "0".to_owned() } else { format_number(x) });
        // Writing to a string cannot fail.
        let _ = match node.parent {
            Some(parent) => writeln!(text, "{} 2 {x} {y} 0 {radius} {}", place + 1, parent + 1),
            None => writeln!(text, "{} 2 {x} {y} 0 {radius} -1", place + 1),
        };
    }
    text
}

fn write_folder(folder: &Path, files: impl Iterator<Item = (String, String)>) -> Result<(), WriteError> {
    clear_folder(folder, "swc")?;
    for (name, text) in files {
        write_unsynced(&folder.join(name), text.as_bytes())?;
    }
    Ok(())
}

/// Writes an archive. Entries have no date, so that the same run gives the same bytes.
fn write_archive(path: &Path, files: impl Iterator<Item = (String, String)>) -> Result<(), WriteError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    let mut add = |name: String, text: String| -> Result<(), Error> {
        archive.start_file(name, options)?;
        archive.write_all(text.as_bytes())
    };
    let refused = |source: Error| WriteError { path: path.to_owned(), source };
    for (name, text) in files {
        add(name, text).map_err(refused)?;
    }
    let bytes = archive.finish().map_err(|error| refused(error.into()))?;
    let mut file = Partial::create(path)?;
    file.write(bytes.get_ref())?;
    file.commit()
}

#[cfg(test)]
mod tests {
    use super::super::swc_tree::Node;
    use super::*;

    fn tree() -> Tree {
        let node = |at, parent| Node { at, parent };
        let nodes = vec![
            node([-0.0, 0.0], None),
            node([3.0, 4.0], Some(0)),
            node([3.0, 1e-7], Some(1)),
            node([5.0, 4.0], Some(1)),
        ];
        Tree { axon: 17, population: "left\neye".into(), nodes }
    }

    #[test]
    fn a_file_has_ids_from_one_type_two_and_a_first_point_without_a_parent() {
        let text = text(&tree(), 1.5, &Swc::default());
        let (head, rows): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with('#'));
        assert!(head[0].ends_with("axon 17, population left eye, t = 1.5 h"), "{head:?}");
        let expected = ["1 2 0 0 0 0.5 -1", "2 2 3 4 0 0.5 1", "3 2 3 1e-7 0 0.5 2", "4 2 5 4 0 0.5 2"];
        assert_eq!(rows, expected);
        assert!(head.contains(&"# length 10.9999999 um"), "{head:?}");
    }

    #[test]
    fn an_archive_is_the_same_bytes_each_time_and_a_folder_forgets_the_axons_of_an_earlier_run() {
        let folder = std::env::temp_dir().join(format!("tropism-swc-{}", std::process::id()));
        let files = || [("axon_1.swc".to_owned(), "1".to_owned())].into_iter();
        let archive = |name: &str| {
            write_archive(&folder.join(name), files()).unwrap();
            std::fs::read(folder.join(name)).unwrap()
        };
        assert_eq!(archive("a.zip"), archive("b.zip"));
        std::fs::create_dir_all(folder.join("swc")).unwrap();
        std::fs::write(folder.join("swc/axon_2.swc"), "old").unwrap();
        std::fs::write(folder.join("swc/notes.txt"), "not ours").unwrap();
        write_folder(&folder.join("swc"), files()).unwrap();
        let mut names: Vec<_> =
            std::fs::read_dir(folder.join("swc")).unwrap().map(|f| f.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["axon_1.swc", "notes.txt"]);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
