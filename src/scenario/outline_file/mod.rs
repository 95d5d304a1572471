//! Outlines from files of other programs: GeoJSON, SVG, Gmsh. On loading a scene the file gives way to the polygon that it describes,
//! so that everything behind sees a polygon, and the manifest runs again without the file.
//!
//! A scene reads no file outside of its own folder: paths are relative to the scenario, without `..`, and no link leads out.

mod geojson;
mod gmsh;
mod naming;
mod svg;

use super::folder::inside;
use super::merge::strip_nulls;
use super::read::{NO_FILE, read_text};
use crate::keys;
use crate::model::quantity::Length;
use crate::model::violation::Violation;
use crate::numerics::polygon::signed_area;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::Path;

/// Points of an outline from a file, with those of the lines that name its sides.
const MOST_POINTS: usize = 20_000;
/// Vertices inside a mesh from a file.
const MOST_VERTICES: usize = 200_000;

keys! {
    /// A file with an outline in it.
    pub struct OutlineFile {
        /// The file, relative to the scenario and inside its folder.
        pub file: String = String::new(),
        /// How long one unit of the file is.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub scale: Length = Length(1.0),
        /// The largest distance between a curve of an SVG and the straight sides put in its place.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub tolerance: Length = Length(0.5),
    }

    /// A file with a mesh in it.
    pub struct MeshFile {
        /// The file, relative to the scenario and inside its folder.
        pub file: String = String::new(),
        /// How long one unit of the file is.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub scale: Length = Length(1.0),
        /// Whether the vertices inside are kept, as `polygon.vertices`; otherwise the inside is meshed anew with `mesh_size`.
        pub keep_vertices: bool = false,
    }
}

/// An outline in a file, by the file's format.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FiledOutline {
    /// A polygon of GeoJSON; lines with a `name` along it name its sides.
    Geojson(OutlineFile),
    /// Closed shapes of an SVG drawing, y upward from its lower edge; open lines along them name the sides by their `id`.
    Svg(OutlineFile),
    /// A Gmsh mesh of triangles, MSH 2.2 or 4.1 in ASCII; physical lines name the sides of its border.
    Gmsh(MeshFile),
}

impl FiledOutline {
    /// The file, and how long one of its units is (µm).
    fn file_and_scale(&self) -> (&str, f64) {
        match self {
            Self::Geojson(keys) | Self::Svg(keys) => (&keys.file, keys.scale.0),
            Self::Gmsh(keys) => (&keys.file, keys.scale.0),
        }
    }
}

/// Closed lines with names of their sides, open lines that name sides, and vertices of a mesh inside, in units of the file.
#[derive(Debug, Clone, PartialEq, Default)]
struct Found {
    rings: Vec<FoundRing>,
    lines: Vec<(String, Vec<[f64; 2]>)>,
    inside: Vec<[f64; 2]>,
}

/// A closed line; a side has the number of its first point.
#[derive(Debug, Clone, PartialEq, Default)]
struct FoundRing {
    points: Vec<[f64; 2]>,
    names: Vec<Option<String>>,
}

impl FoundRing {
    /// Area inside, in units of the file squared.
    fn area(&self) -> f64 {
        signed_area(&self.points).abs()
    }
}

/// Puts the polygon of the file in the place of `/tissue/outline` if that names one; `folder` is that of the scenario with the key.
///
/// # Errors
/// A violation at that key: a path that leads out of the folder, a file that cannot be read, what is wrong in it and where.
pub fn take_in(document: &mut Value, folder: &Path) -> Result<(), Violation> {
    let Some(outline) = document.pointer_mut("/tissue/outline") else { return Ok(()) };
    strip_nulls(outline);
    let format = outline.as_object().and_then(|keys| keys.keys().next().cloned()).unwrap_or_default();
    if !["geojson", "svg", "gmsh"].contains(&format.as_str()) {
        return Ok(());
    }
    let at = |key: &str, message: String| Violation::new(format!("/tissue/outline/{format}{key}"), message);
    let filed: FiledOutline = serde_json::from_value(outline.clone()).map_err(|error| at("", error.to_string()))?;
    let (file, _) = filed.file_and_scale();
    let text = read_inside(folder, file).map_err(|message| at("/file", message))?;
    *outline = polygon(&filed, &text).map_err(|message| at("/file", format!("{file}: {message}")))?;
    Ok(())
}

/// The polygon that the text of a file describes, as it stands under `/tissue/outline`; coordinates in µm.
///
/// # Errors
/// What is wrong in the text, and where.
pub fn polygon(filed: &FiledOutline, text: &str) -> Result<Value, String> {
    let (_, scale) = filed.file_and_scale();
    let mut found = match filed {
        FiledOutline::Geojson(_) => geojson::read(text),
        FiledOutline::Svg(keys) => svg::read(text, keys.tolerance.0 / keys.scale.0),
        FiledOutline::Gmsh(_) => gmsh::read(text),
    }?;
    let in_rings: usize = found.rings.iter().map(|ring| ring.points.len()).sum();
    let count = in_rings + found.lines.iter().map(|(_, line)| line.len()).sum::<usize>();
    if count > MOST_POINTS {
        return Err(format!("{count} points; at most {MOST_POINTS} are taken"));
    }
    let inside = std::mem::take(&mut found.inside);
    if inside.len() > MOST_VERTICES {
        return Err(format!("{} vertices inside; at most {MOST_VERTICES} are taken", inside.len()));
    }
    let rings = naming::named(found)?;
    let scaled = |points: &[[f64; 2]]| -> Vec<_> { points.iter().map(|point| point.map(|x| x * scale)).collect() };
    let written = |(place, ring): (usize, &FoundRing)| {
        let points = scaled(&ring.points);
        let default = if place == 0 { "outer" } else { "hole" };
        let edges: Vec<_> = ring.names.iter().map(|name| name.as_deref().unwrap_or(default)).collect();
        json!({ "points": points, "edges": edges })
    };
    let mut written: Vec<Value> = rings.iter().enumerate().map(written).collect();
    let outer = written.remove(0);
    let mut polygon = json!({ "outer": outer, "holes": written });
    if matches!(filed, FiledOutline::Gmsh(keys) if keys.keep_vertices) {
        polygon["vertices"] = json!(scaled(&inside));
    }
    Ok(json!({ "polygon": polygon }))
}

/// The text of a file inside a folder.
fn read_inside(folder: &Path, file: &str) -> Result<String, String> {
    let path = inside(folder, file)?;
    if !path.exists() {
        return Err(format!("{file}: no such file beside the scenario"));
    }
    if !path.is_file() {
        return Err(format!("{file}: {NO_FILE}"));
    }
    read_text(&path).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("tropism-outline-{}-{name}", std::process::id()));
        std::fs::create_dir_all(folder.join("inside")).unwrap();
        folder
    }

    #[test]
    fn a_file_gives_way_to_its_polygon_in_micrometres() {
        let folder = folder("taken");
        let square = r#"{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]]]}"#;
        std::fs::write(folder.join("inside/a.geojson"), square).unwrap();
        let mut scene = json!({"tissue": {"outline": {"geojson": {"file": "inside/a.geojson", "scale": "1 mm"}}}});
        take_in(&mut scene, &folder).unwrap();
        let outer = &scene["tissue"]["outline"]["polygon"]["outer"];
        assert_eq!(outer["points"], json!([[0.0, 0.0], [2000.0, 0.0], [2000.0, 1000.0], [0.0, 1000.0]]));
        assert_eq!(outer["edges"], json!(["outer", "outer", "outer", "outer"]));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn no_path_leads_out_of_the_folder_of_the_scenario() {
        let folder = folder("out");
        std::fs::write(folder.join("secret.geojson"), "{}").unwrap();
        let inside = folder.join("inside");
        #[cfg(unix)]
        std::os::unix::fs::symlink(folder.join("secret.geojson"), inside.join("link.geojson")).unwrap();
        let refusal = |file: &str| {
            let mut scene = json!({"tissue": {"outline": {"geojson": {"file": file}}}});
            let error = take_in(&mut scene, &inside).unwrap_err();
            assert_eq!(error.pointer, "/tissue/outline/geojson/file");
            error.message
        };
        for file in ["../secret.geojson", "/etc/passwd", "", "a/../../secret.geojson"] {
            assert!(refusal(file).contains("is not the name of a file in the folder"), "{file}");
        }
        assert!(refusal("none.geojson").ends_with("no such file beside the scenario"));
        #[cfg(unix)]
        assert!(refusal("link.geojson").ends_with("leads out of the folder of the scenario"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
