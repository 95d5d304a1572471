//! One VTU file (VTK's XML format of unstructured grids): points, cells and their data, in base64, numbers with all their bits.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::fmt::Write;

/// Cells of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// A piece of a line between two points. (Polylines are one cell each, but meshio does not know them.)
    Line = 3,
    /// A triangle.
    Triangle = 5,
}

/// Data of points or cells.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// A number each.
    Scalars(Vec<f64>),
    /// A planar vector each; z is 0.
    Vectors(Vec<[f64; 2]>),
    /// A whole number each.
    Integers(Vec<i64>),
}

/// A grid with its data.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Where the points are (µm); z is 0.
    pub points: Vec<[f64; 2]>,
    /// What all cells are.
    pub kind: CellKind,
    /// The points of all cells, one cell after the other.
    pub connectivity: Vec<i64>,
    /// Name (with the unit in brackets) and data of the points.
    pub point_data: Vec<(String, Values)>,
    /// Name and data of the cells.
    pub cell_data: Vec<(String, Values)>,
}

impl CellKind {
    /// Points of a cell.
    fn points(self) -> usize {
        match self {
            Self::Line => 2,
            Self::Triangle => 3,
        }
    }
}

impl Grid {
    /// The grid as a file.
    pub fn to_vtu(&self) -> String {
        let stride = self.kind.points();
        let (points, cells) = (self.points.len(), self.connectivity.len() / stride);
        let ends: Vec<i64> = (1..=cells).map(|cell| (cell * stride) as i64).collect();
        let mut text = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n"
        );
        section(&mut text, "Points", [("Points", &Values::Vectors(self.points.clone()))].into_iter());
        text += "<Cells>\n";
        array(&mut text, ("Int64", "connectivity", 1), &whole(&self.connectivity));
        array(&mut text, ("Int64", "offsets", 1), &whole(&ends));
        array(&mut text, ("UInt8", "types", 1), &vec![self.kind as u8; cells]);
        text += "</Cells>\n";
        section(&mut text, "PointData", self.point_data.iter().map(|(name, values)| (name.as_str(), values)));
        section(&mut text, "CellData", self.cell_data.iter().map(|(name, values)| (name.as_str(), values)));
        text + "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    }
}

fn section<'a>(text: &mut String, name: &str, arrays: impl Iterator<Item = (&'a str, &'a Values)>) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "<{name}>");
    for (name, values) in arrays {
        match values {
            Values::Scalars(numbers) => array(text, ("Float64", name, 1), &real(numbers.iter().copied())),
            Values::Vectors(vectors) => {
                array(text, ("Float64", name, 3), &real(vectors.iter().flat_map(|[x, y]| [*x, *y, 0.0])));
            }
            Values::Integers(numbers) => array(text, ("Int64", name, 1), &whole(numbers)),
        }
    }
    let _ = writeln!(text, "</{name}>");
}

/// Bytes of an array with their number in front, in base64 as one.
fn array(text: &mut String, (kind, name, components): (&str, &str, usize), bytes: &[u8]) {
    // With a number of one, meshio makes a table of a list.
    let components = if components == 1 { String::new() } else { format!(" NumberOfComponents=\"{components}\"") };
    let _ = write!(text, "<DataArray type=\"{kind}\" Name=\"{}\"{components} format=\"binary\">", escaped(name));
    BASE64_STANDARD.encode_string([&(bytes.len() as u64).to_le_bytes(), bytes].concat(), text);
    text.push_str("</DataArray>\n");
}

fn real(numbers: impl Iterator<Item = f64>) -> Vec<u8> {
    numbers.flat_map(f64::to_le_bytes).collect()
}

fn whole(numbers: &[i64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// A text as the value of an XML attribute.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;").replace(char::is_control, " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The array of a name, from base64 to its bytes without their number.
    fn bytes(text: &str, name: &str) -> Vec<u8> {
        let line = text.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
        let code = line.split_once('>').unwrap().1.strip_suffix("</DataArray>").unwrap();
        let all = BASE64_STANDARD.decode(code).unwrap();
        assert_eq!(u64::from_le_bytes(all[..8].try_into().unwrap()) as usize, all.len() - 8);
        all[8..].to_vec()
    }

    #[test]
    fn a_grid_keeps_every_bit_and_is_well_formed() {
        let grid = Grid {
            points: vec![[0.1, -0.0], [1.0 / 3.0, 5e-324], [2.0, 2.0]],
            kind: CellKind::Triangle,
            connectivity: vec![0, 1, 2],
            point_data: vec![("a \"<&> [nM]".into(), Values::Scalars(vec![1.0, 2.0, f64::MAX]))],
            cell_data: vec![("axon".into(), Values::Integers(vec![-7]))],
        };
        let text = grid.to_vtu();
        let numbers: Vec<f64> =
            bytes(&text, "Points").chunks(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect();
        let expected: [f64; 9] = [0.1, -0.0, 0.0, 1.0 / 3.0, 5e-324, 0.0, 2.0, 2.0, 0.0];
        assert!(numbers.iter().zip(expected).all(|(a, b)| a.to_bits() == b.to_bits()) && numbers.len() == 9);
        assert_eq!((bytes(&text, "types"), bytes(&text, "offsets")), (vec![5], 3i64.to_le_bytes().to_vec()));
        assert_eq!(bytes(&text, "axon"), i64::to_le_bytes(-7));
        let document = resvg::usvg::roxmltree::Document::parse(&text).unwrap();
        let names: Vec<_> = document.descendants().filter_map(|node| node.attribute("Name")).collect();
        assert_eq!(names, ["Points", "connectivity", "offsets", "types", "a \"<&> [nM]", "axon"]);
    }
}
