//! Gmsh MSH 2.2 and 4.1 in ASCII: triangles in a plane of constant z; physical lines name what they cover. What is taken is the border,
//! sides that belong to one triangle, joined to rings, and the nodes of triangles that are not on it.

use super::{Found, FoundRing};
use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

const LINE: usize = 1;
const TRIANGLE: usize = 2;

/// The border of a mesh.
pub(super) fn read(text: &str) -> Result<Found, String> {
    let mut lines = Lines { lines: text.lines(), number: 0 };
    let mut mesh = Mesh::default();
    while let Some(section) = lines.next_filled() {
        match section {
            "$MeshFormat" => mesh.version = version(&mut lines)?,
            "$PhysicalNames" => mesh.read_names(&mut lines)?,
            "$Entities" => mesh.read_entities(&mut lines)?,
            "$Nodes" if mesh.version == 4 => mesh.read_nodes_4(&mut lines)?,
            "$Nodes" => mesh.read_nodes_2(&mut lines)?,
            "$Elements" if mesh.version == 4 => mesh.read_elements_4(&mut lines)?,
            "$Elements" => mesh.read_elements_2(&mut lines)?,
            other if other.starts_with('$') => lines.skip_section(other)?,
            other => return Err(lines.wrong(&format!("`{other}` is no section ($Nodes, …)"))),
        }
    }
    mesh.border()
}

/// A text line by line.
struct Lines<'a> {
    lines: std::str::Lines<'a>,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next_filled(&mut self) -> Option<&'a str> {
        loop {
            let line = self.lines.next()?.trim();
            self.number += 1;
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    fn wrong(&self, message: &str) -> String {
        format!("line {}: {message}", self.number)
    }

    fn line(&mut self) -> Result<&'a str, String> {
        self.next_filled().ok_or_else(|| self.wrong("the file ends in the middle of a section"))
    }

    /// The numbers of the next line, at least `least` of them.
    fn numbers<T: FromStr>(&mut self, least: usize) -> Result<Vec<T>, String> {
        let line = self.line()?;
        let numbers: Result<Vec<T>, _> = line.split_whitespace().map(T::from_str).collect();
        let numbers = numbers.map_err(|_| self.wrong(&format!("`{line}` where numbers belong")))?;
        if numbers.len() < least {
            return Err(self.wrong(&format!("{} numbers where {least} belong", numbers.len())));
        }
        Ok(numbers)
    }

    /// The numbers of the next line, none of them infinite or no number.
    fn finite(&mut self, least: usize) -> Result<Vec<f64>, String> {
        let numbers: Vec<f64> = self.numbers(least)?;
        match numbers.iter().find(|number| !number.is_finite()) {
            Some(wrong) => Err(self.wrong(&format!("{wrong} where a finite number belongs"))),
            None => Ok(numbers),
        }
    }

    fn end(&mut self, section: &str) -> Result<(), String> {
        let line = self.line()?;
        if line == section { Ok(()) } else { Err(self.wrong(&format!("`{line}` where {section} belongs"))) }
    }

    fn skip_section(&mut self, section: &str) -> Result<(), String> {
        let end = section.replacen('$', "$End", 1);
        while self.line()? != end {}
        Ok(())
    }
}

fn version(lines: &mut Lines) -> Result<usize, String> {
    let line = lines.line()?;
    let mut words = line.split_whitespace();
    let (version, kind) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let number = match version {
        "2.2" => 2,
        "4.1" => 4,
        _ => return Err(lines.wrong(&format!("version {version}; 2.2 and 4.1 are taken"))),
    };
    if kind != "0" {
        return Err(lines.wrong("a binary file; save it as ASCII"));
    }
    lines.end("$EndMeshFormat").map(|()| number)
}

/// What is kept of a file.
#[derive(Default)]
struct Mesh {
    version: usize,
    /// Names of physical lines by tag.
    names: BTreeMap<usize, String>,
    /// Physical line of each curve.
    curves: BTreeMap<usize, usize>,
    nodes: BTreeMap<usize, [f64; 3]>,
    triangles: Vec<[usize; 3]>,
    /// Physical line of each piece of a line, by its ends in order.
    pieces: BTreeMap<[usize; 2], usize>,
}

impl Mesh {
    fn read_names(&mut self, lines: &mut Lines) -> Result<(), String> {
        let count: usize = lines.numbers(1)?[0];
        for _ in 0..count {
            let line = lines.line()?;
            let mut words = line.splitn(3, char::is_whitespace);
            let (dimension, tag) = (words.next().unwrap_or_default(), words.next().and_then(|tag| tag.parse().ok()));
            let name = words.next().map(|name| name.trim().trim_matches('"').to_owned());
            let (Some(tag), Some(name)) = (tag, name) else {
                return Err(lines.wrong(&format!("`{line}` is no physical name: dimension, tag, \"name\"")));
            };
            if dimension == "1" {
                self.names.insert(tag, name);
            }
        }
        lines.end("$EndPhysicalNames")
    }

    fn read_entities(&mut self, lines: &mut Lines) -> Result<(), String> {
        let counts: Vec<usize> = lines.numbers(4)?;
        for _ in 0..counts[0] {
            lines.line()?;
        }
        for _ in 0..counts[1] {
            let curve: Vec<f64> = lines.numbers(8)?;
            if let Some(physical) = (curve[7] > 0.0).then(|| curve.get(8)).flatten() {
                self.curves.insert(curve[0] as usize, *physical as usize);
            }
        }
        lines.skip_section("$Entities")
    }

    fn read_nodes_2(&mut self, lines: &mut Lines) -> Result<(), String> {
        let count: usize = lines.numbers(1)?[0];
        for _ in 0..count {
            let node = lines.finite(4)?;
            self.nodes.insert(node[0] as usize, [node[1], node[2], node[3]]);
        }
        lines.end("$EndNodes")
    }

    fn read_nodes_4(&mut self, lines: &mut Lines) -> Result<(), String> {
        let blocks: usize = lines.numbers(4)?[0];
        for _ in 0..blocks {
            let count: usize = lines.numbers(4)?[3];
            let mut tags: Vec<usize> = Vec::new();
            for _ in 0..count {
                tags.push(lines.numbers(1)?[0]);
            }
            for tag in tags {
                let place = lines.finite(3)?;
                self.nodes.insert(tag, [place[0], place[1], place[2]]);
            }
        }
        lines.end("$EndNodes")
    }

    fn read_elements_2(&mut self, lines: &mut Lines) -> Result<(), String> {
        let count: usize = lines.numbers(1)?[0];
        for _ in 0..count {
            let element: Vec<usize> = lines.numbers(3)?;
            let nodes = element.get(element[2].saturating_add(3)..).unwrap_or_default();
            // A tag of 0 says that there is none.
            let physical = element.get(3).copied().filter(|tag| element[2] > 0 && *tag > 0);
            self.add(lines, (element[1], physical), nodes)?;
        }
        lines.end("$EndElements")
    }

    fn read_elements_4(&mut self, lines: &mut Lines) -> Result<(), String> {
        let blocks: usize = lines.numbers(4)?[0];
        for _ in 0..blocks {
            let block: Vec<usize> = lines.numbers(4)?;
            let physical = self.curves.get(&block[1]).copied().filter(|_| block[0] == 1);
            for _ in 0..block[3] {
                let element: Vec<usize> = lines.numbers(1)?;
                self.add(lines, (block[2], physical), &element[1..])?;
            }
        }
        lines.end("$EndElements")
    }

    /// Keeps a line or a triangle; points are of no use, and anything else is no planar mesh of triangles.
    fn add(&mut self, lines: &Lines, (kind, physical): (usize, Option<usize>), nodes: &[usize]) -> Result<(), String> {
        match (kind, nodes, physical) {
            (LINE, [a, b], Some(physical)) => drop(self.pieces.insert([*a.min(b), *a.max(b)], physical)),
            (TRIANGLE, [a, b, c], _) => self.triangles.push([*a, *b, *c]),
            (15 | LINE, ..) => {}
            _ => return Err(lines.wrong(&format!("an element of type {kind}; lines (1) and triangles (2) are taken"))),
        }
        Ok(())
    }

    fn place(&self, node: usize) -> Result<[f64; 3], String> {
        self.nodes.get(&node).copied().ok_or_else(|| format!("an element names node {node}, which is not there"))
    }

    fn border(&self) -> Result<Found, String> {
        let first = self.triangles.first().ok_or("no triangles in it")?;
        let level = self.place(first[0])?[2];
        let mut next: BTreeMap<usize, usize> = BTreeMap::new();
        let mut sides: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for &corners in &self.triangles {
            let [a, b, c] = [self.place(corners[0])?, self.place(corners[1])?, self.place(corners[2])?];
            if [a, b, c].iter().any(|place| place[2] != level) {
                return Err("the mesh is not planar: z is not the same everywhere".to_owned());
            }
            let left = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
            let [a, b, c] = if left { corners } else { [corners[0], corners[2], corners[1]] };
            [[a, b], [b, c], [c, a]].into_iter().for_each(|side| *sides.entry(side).or_default() += 1);
        }
        for &[a, b] in sides.keys().filter(|[a, b]| !sides.contains_key(&[*b, *a])) {
            if next.insert(a, b).is_some() {
                return Err(format!("two borders meet at node {a}"));
            }
        }
        let on_border: BTreeSet<usize> = next.keys().copied().collect();
        let mut found = Found::default();
        while let Some((&start, _)) = next.first_key_value() {
            let (mut ring, mut at) = (FoundRing::default(), start);
            while let Some(to) = next.remove(&at) {
                let [x, y, _] = self.place(at)?;
                ring.points.push([x, y]);
                let physical = self.pieces.get(&[at.min(to), at.max(to)]);
                ring.names.push(physical.map(|tag| self.names.get(tag).cloned().unwrap_or(format!("{tag}"))));
                at = to;
            }
            found.rings.push(ring);
        }
        let mut inside: Vec<usize> = self.triangles.iter().flatten().copied().collect();
        inside.sort_unstable();
        inside.dedup();
        for node in inside.into_iter().filter(|node| !on_border.contains(node)) {
            let [x, y, _] = self.place(node)?;
            found.inside.push([x, y]);
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles, one of them clockwise, its lower side called `base`, in both versions.
    fn square(version: usize) -> String {
        let names = "$PhysicalNames\n1\n1 7 \"base\"\n$EndPhysicalNames\n";
        if version == 2 {
            return format!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}$Nodes\n4\n1 0 0 0\n2 5 0 0\n3 5 5 0\n4 0 5 0\n$EndNodes\n\
                 $Elements\n5\n1 15 2 0 1 1\n2 1 2 7 1 1 2\n3 2 2 9 1 1 2 3\n4 2 2 9 1 1 4 3\n5 1 2 0 2 2 3\n$EndElements\n"
            );
        }
        format!(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{names}$Entities\n0 1 1 0\n3 0 0 0 5 0 0 1 7 0\n1 0 0 0 5 5 0 0 0\n$EndEntities\n\
             $Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n0 0 0\n5 0 0\n5 5 0\n0 5 0\n$EndNodes\n\
             $Elements\n2 3 1 3\n1 3 1 1\n1 1 2\n2 1 2 2\n2 1 2 3\n3 1 4 3\n$EndElements\n"
        )
    }

    #[test]
    fn both_versions_give_the_border_with_the_names_of_physical_lines() {
        for version in [2, 4] {
            let found = read(&square(version)).unwrap();
            let names = [Some("base".to_owned()), None, None, None];
            let points = vec![[0.0, 0.0], [5.0, 0.0], [5.0, 5.0], [0.0, 5.0]];
            assert_eq!(found.rings, [FoundRing { points, names: names.to_vec() }], "{version}");
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let cases = [
            (square(2).replace("2.2 0", "1.0 0"), "line 2: version 1.0"),
            (square(2).replace("2.2 0", "2.2 1"), "line 2: a binary file"),
            (square(2).replace("2 5 0 0", "2 5 zero 0"), "line 11: `2 5 zero 0` where numbers belong"),
            (square(2).replace("2 5 0 0", "2 nan 0 0"), "line 11: NaN where a finite number belongs"),
            (square(2).replace("3 2 2 9 1 1 2 3", "3 3 2 9 1 1 2 3 4"), "line 19: an element of type 3"),
            (square(2).replace("1 1 4 3\n", "1 1 4 8\n"), "node 8, which is not there"),
            (square(4).replace("5 5 0\n0 5 0\n$EndN", "5 5 1\n0 5 0\n$EndN"), "not planar"),
            (square(4).split("$Elements").next().unwrap().to_owned(), "no triangles"),
            (square(4).replace("$EndElements\n", ""), "the file ends"),
            ("hello".to_owned(), "line 1: `hello` is no section"),
        ];
        for (text, words) in cases {
            let message = read(&text).unwrap_err();
            assert!(message.contains(words), "{message} instead of {words}");
        }
    }
}
