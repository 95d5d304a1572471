//! Order of elimination for the systems of a mesh: nested dissection by coordinates.
//!
//! Vertices are halved across the longer side of their box; those of one half that share a cell with the other half part the two
//! and are eliminated last, and each half is ordered in the same way. On a mesh of `n` vertices of even density in the plane a
//! factor then has `O(n log n)` entries and costs `O(n^{3/2})` operations, the least that is possible (George 1973). Where vertices crowd
//! along a line, as between sides that nearly touch, the longer side of the box may be across it, and half of them would part the others: a part that
//! is too large for an even mesh gives way to a smaller one across another side.
//!
//! The order is then made a *postorder* of the elimination tree, in which the parent of column `j` is the first row below the
//! diagonal of column `j` of the factor: a column comes straight before its parent wherever it can, so that columns of like
//! structure lie side by side and are treated as one block.

/// Parts of at most so many vertices are left as they lie.
const LEAF: usize = 12;
/// Vertices between two halves of an even mesh over √n (n^{2/3} in space), at most: an equilateral one has about 1.1.
const THICKEST: f64 = 4.0;
/// No column: the parent of a root.
const NONE: u32 = u32::MAX;

/// Orders the vertices of a mesh for elimination: entry `p` is the vertex that is eliminated as the `p`-th. `coordinates` has one
/// entry a vertex; `cells` are flat with `stride` vertices each. Any coordinates give a valid order; few entries in the
/// factor follow where vertices of a cell lie close together.
pub fn nested_dissection<const D: usize>(coordinates: &[[f64; D]], cells: &[u32], stride: usize) -> Vec<u32> {
    let mut dissection = Dissection { coordinates, cells, stride, side: vec![Side::Settled; coordinates.len()] };
    let mut order: Vec<u32> = (0..coordinates.len() as u32).collect();
    let every_cell = (0..(cells.len() / stride) as u32).collect();
    dissection.split(&mut order, every_cell);
    order
}

/// Where a vertex lies in the part that is being split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    /// In another part, or between two.
    Settled,
    Low,
    High,
}

struct Dissection<'a, const D: usize> {
    coordinates: &'a [[f64; D]],
    cells: &'a [u32],
    stride: usize,
    side: Vec<Side>,
}

impl<const D: usize> Dissection<'_, D> {
    /// Orders `part`, whose vertices are joined by the cells `within` and no others.
    fn split(&mut self, part: &mut [u32], within: Vec<u32>) {
        if part.len() <= LEAF {
            // However the selections above have shuffled them.
            part.sort_unstable();
            return;
        }
        let longest = self.longest_axis(part);
        let mut between = self.halved(part, longest, &within);
        if between.len() as f64 > THICKEST * (part.len() as f64).powf(1.0 - 1.0 / D as f64) {
            let sizes = (0..D).map(|axis| self.halved(part, axis, &within).len());
            let thinnest =
                (0..D).zip(sizes).min_by_key(|(axis, size)| (*size, *axis)).map_or(longest, |(axis, _)| axis);
            between = self.halved(part, thinnest, &within);
        }
        between.iter().for_each(|&vertex| self.side[vertex as usize] = Side::Settled);
        let on = |half: Side| part.iter().copied().filter(|&vertex| self.side[vertex as usize] == half).collect();
        let (low, high): (Vec<u32>, Vec<u32>) = (on(Side::Low), on(Side::High));
        let (first, rest) = part.split_at_mut(low.len());
        let (second, last) = rest.split_at_mut(high.len());
        first.copy_from_slice(&low);
        second.copy_from_slice(&high);
        last.copy_from_slice(&between);
        let (mut cells_low, mut cells_high) = (Vec::new(), Vec::new());
        for &cell in &within {
            let has = |side| self.corners(cell).iter().any(|&vertex| self.side[vertex as usize] == side);
            if has(Side::Low) {
                cells_low.push(cell);
            } else if has(Side::High) {
                cells_high.push(cell);
            }
        }
        drop(within);
        low.iter().chain(&high).for_each(|&vertex| self.side[vertex as usize] = Side::Settled);
        self.split(first, cells_low);
        self.split(second, cells_high);
    }

    /// Halves a part across an axis, and returns what lies between the halves.
    fn halved(&mut self, part: &mut [u32], axis: usize, within: &[u32]) -> Vec<u32> {
        let place = |vertex: u32| self.coordinates[vertex as usize][axis];
        let middle = part.len() / 2;
        part.select_nth_unstable_by(middle, |&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        part[..middle].iter().for_each(|&vertex| self.side[vertex as usize] = Side::Low);
        part[middle..].iter().for_each(|&vertex| self.side[vertex as usize] = Side::High);
        self.separator(within)
    }

    fn corners(&self, cell: u32) -> &[u32] {
        &self.cells[cell as usize * self.stride..(cell as usize + 1) * self.stride]
    }

    /// The vertices of one side that share a cell with the other: of that side which has fewer of them.
    fn separator(&self, within: &[u32]) -> Vec<u32> {
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for &cell in within {
            let on = |side| self.corners(cell).iter().copied().filter(move |&v| self.side[v as usize] == side);
            if on(Side::Low).next().is_some() && on(Side::High).next().is_some() {
                low.extend(on(Side::Low));
                high.extend(on(Side::High));
            }
        }
        for side in [&mut low, &mut high] {
            side.sort_unstable();
            side.dedup();
        }
        if low.len() < high.len() { low } else { high }
    }

    fn longest_axis(&self, part: &[u32]) -> usize {
        let extent = |axis: usize| {
            let along = part.iter().map(|&vertex| self.coordinates[vertex as usize][axis]);
            let (low, high) =
                along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        (1..D).fold(0, |best, axis| if extent(axis) > extent(best) { axis } else { best })
    }
}

/// Turns an order of elimination into one of the same fill that is a postorder of the elimination tree. The matrix is given by
/// the lower triangle of its pattern, in columns.
pub fn postordered(column_start: &[u32], rows: &[u32], order: &[u32]) -> Vec<u32> {
    let parent = elimination_tree(column_start, rows, order);
    let n = order.len();
    // Children of each column in ascending order, those of the virtual column `n` being the roots.
    let (mut first_child, mut next_sibling) = (vec![NONE; n + 1], vec![NONE; n]);
    for column in (0..n).rev() {
        let above = if parent[column] == NONE { n } else { parent[column] as usize };
        next_sibling[column] = first_child[above];
        first_child[above] = column as u32;
    }
    let mut postorder = Vec::with_capacity(n);
    let mut path: Vec<u32> = Vec::new();
    let mut root = first_child[n];
    while root != NONE {
        path.push(root);
        while let Some(&column) = path.last() {
            let child = first_child[column as usize];
            if child == NONE {
                postorder.push(order[column as usize]);
                path.pop();
            } else {
                first_child[column as usize] = next_sibling[child as usize];
                path.push(child);
            }
        }
        root = next_sibling[root as usize];
    }
    postorder
}

/// Parent of each column, by place in the order; [`NONE`] for a root. Liu's algorithm, with short-cuts to ancestors.
fn elimination_tree(column_start: &[u32], rows: &[u32], order: &[u32]) -> Vec<u32> {
    let n = order.len();
    let place = inverse(order);
    let mut earlier_start = vec![0u32; n + 1];
    let entries = || {
        (0..n).flat_map(|column| {
            let range = column_start[column] as usize..column_start[column + 1] as usize;
            rows[range].iter().map(move |&row| (column, row as usize))
        })
    };
    let place = &place;
    let ends = |(column, row): (usize, usize)| (place[column].min(place[row]), place[column].max(place[row]));
    entries().for_each(|entry| earlier_start[ends(entry).1 as usize + 1] += 1);
    (0..n).for_each(|i| earlier_start[i + 1] += earlier_start[i]);
    let mut free = earlier_start.clone();
    let mut earlier = vec![0u32; rows.len()];
    for (low, high) in entries().map(ends) {
        earlier[free[high as usize] as usize] = low;
        free[high as usize] += 1;
    }
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for column in 0..n {
        for &start in &earlier[earlier_start[column] as usize..earlier_start[column + 1] as usize] {
            let mut climber = start;
            while climber != NONE && climber != column as u32 {
                let next = std::mem::replace(&mut ancestor[climber as usize], column as u32);
                if next == NONE {
                    parent[climber as usize] = column as u32;
                }
                climber = next;
            }
        }
    }
    parent
}

/// The inverse of a permutation.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let mut place = vec![0; order.len()];
    for (p, &index) in order.iter().enumerate() {
        place[index as usize] = p as u32;
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::simplex_mesh::structured_rectangle;

    fn is_permutation(order: &[u32]) -> bool {
        let mut sorted = order.to_vec();
        sorted.sort_unstable();
        sorted.into_iter().eq(0..order.len() as u32)
    }

    #[test]
    fn every_vertex_is_eliminated_once_wherever_the_vertices_lie() {
        let mesh = structured_rectangle(1.5, 1.0, 30, 20).unwrap();
        let order = nested_dissection(mesh.vertices(), mesh.cells(), 3);
        assert!(is_permutation(&order));
        let heaped = vec![[0.0; 2]; mesh.vertex_count()];
        assert!(is_permutation(&nested_dissection(&heaped, mesh.cells(), 3)));
        assert!(nested_dissection::<2>(&[], &[], 3).is_empty());
    }

    #[test]
    fn the_last_vertices_part_the_mesh_in_two_halves() {
        let mesh = structured_rectangle(2.0, 1.0, 20, 10).unwrap();
        let order = nested_dissection(mesh.vertices(), mesh.cells(), 3);
        let place = inverse(&order);
        // A column has 11 vertices; a half of the 231 may end within one, and then a row more is needed.
        let parts = |low: u32, between: u32| {
            mesh.cells().chunks_exact(3).all(|cell| {
                let places = || cell.iter().map(|&v| place[v as usize]).filter(|&p| p < 231 - between);
                places().all(|p| p < low) || places().all(|p| p >= low)
            })
        };
        assert!((11..=12).any(|between| (100..=120).any(|low| parts(low, between))));
        for vertex in &order[231 - 11..] {
            assert!((mesh.vertices()[*vertex as usize][0] - 1.0).abs() < 0.11);
        }
    }

    #[test]
    fn vertices_that_crowd_along_a_line_are_parted_across_it() {
        // A thin strip, but for two corners that draw its box wide: the longer side of that is across the strip.
        let mesh = structured_rectangle(1e-3, 1.0, 2, 200).unwrap();
        let mut x = mesh.vertices().to_vec();
        let last = x.len() - 1;
        (x[0], x[last]) = ([-5.0, 0.0], [5.0, 1.0]);
        let place = inverse(&nested_dissection(&x, mesh.cells(), 3));
        let n = x.len() as u32;
        // Three vertices lie abreast: once the last six are gone, the lower half has no part in the upper.
        let halves = |low: u32| {
            mesh.cells().chunks_exact(3).all(|cell| {
                let places = || cell.iter().map(|&v| place[v as usize]).filter(|&p| p < n - 6);
                places().all(|p| p < low) || places().all(|p| p >= low)
            })
        };
        assert!((n / 2 - 8..=n / 2 + 8).any(halves));
    }

    #[test]
    fn in_a_postorder_the_descendants_of_a_column_lie_straight_before_it() {
        let mesh = structured_rectangle(1.5, 1.0, 12, 9).unwrap();
        let n = mesh.vertex_count();
        let mut entries: Vec<(u32, u32)> = (0..n as u32).map(|i| (i, i)).collect();
        for cell in mesh.cells().chunks_exact(3) {
            entries.extend([(0, 1), (1, 2), (0, 2)].map(|(i, j)| (cell[i].min(cell[j]), cell[i].max(cell[j]))));
        }
        entries.sort_unstable();
        entries.dedup();
        let start: Vec<u32> =
            (0..=n as u32).map(|column| entries.partition_point(|entry| entry.0 < column) as u32).collect();
        let rows: Vec<u32> = entries.iter().map(|entry| entry.1).collect();
        // Neighbours lie far apart in this order; 7 does not divide the 130 vertices.
        let given: Vec<u32> = (0..n as u32).map(|i| 7 * i % n as u32).collect();
        let order = postordered(&start, &rows, &given);
        assert!(is_permutation(&order));
        let parent = elimination_tree(&start, &rows, &order);
        let (mut size, mut first): (Vec<usize>, Vec<usize>) = (vec![1; n], (0..n).collect());
        for column in 0..n {
            assert_eq!(first[column] + size[column], column + 1, "column {column}");
            if let Some(above) = Some(parent[column] as usize).filter(|&above| above < n) {
                assert!(above > column);
                size[above] += size[column];
                first[above] = first[above].min(first[column]);
            }
        }
        assert_eq!(parent.iter().filter(|&&above| above == NONE).count(), 1);
    }
}
