//! A conforming mesh of simplices: triangles for `D = 2`, tetrahedra for `D = 3`.
//!
//! The mesh holds topology and the *reference* coordinates. Whatever depends on where the vertices are now takes the
//! coordinates as an argument (`&[[f64; D]]`, one entry a vertex, µm), so one mesh serves every configuration of the tissue.
//!
//! Cells are stored flat with stride `D + 1`. Face `i` of a cell is the one opposite its local vertex `i`.

use crate::numerics::coordinates::AtVertices;
/// Marks "no neighbour" in [`SimplexMesh::neighbour`]: the face lies on the border of the domain.
pub const BORDER: u32 = u32::MAX;

/// Why a mesh was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A cell names a vertex that does not exist.
    #[error("cell {cell} names vertex {vertex}, but there are only {count} vertices")]
    NoSuchVertex {
        /// The cell.
        cell: usize,
        /// The vertex named.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// A cell has no volume, or is turned inside out.
    #[error("cell {cell} has the signed volume {volume}, which must be positive")]
    NotPositive {
        /// The cell.
        cell: usize,
        /// Its signed volume.
        volume: f64,
    },
    /// A face belongs to more than two cells.
    #[error("cell {cell} shares a face with more than one other cell")]
    NotConforming {
        /// The cell.
        cell: usize,
    },
    /// The flat list of cells has the wrong length.
    #[error("{length} cell entries are no multiple of {stride}")]
    Stride {
        /// Entries given.
        length: usize,
        /// Entries a cell.
        stride: usize,
    },
}

/// One face on the border of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BorderFacet {
    /// The cell that the face belongs to.
    pub cell: u32,
    /// The local vertex opposite the face.
    pub face: u8,
    /// Index into the names of the domain's edges (several facets make one named edge).
    pub edge: u16,
}

/// A conforming mesh of `D`-simplices with its topology.
#[derive(Debug, Clone)]
pub struct SimplexMesh<const D: usize> {
    vertices: Vec<[f64; D]>,
    cells: Vec<u32>,
    neighbours: Vec<u32>,
    border: Vec<BorderFacet>,
}

impl<const D: usize> SimplexMesh<D> {
    /// Vertices of a cell, and entries a cell in the flat lists.
    pub const STRIDE: usize = D + 1;

    /// Builds a mesh from reference coordinates and a flat list of cells, each positively oriented
    /// (counter-clockwise triangles). Every border facet gets edge 0; name them by [`Self::name_border`].
    ///
    /// # Errors
    /// A vertex out of range, a cell without positive volume, or a face shared by more than two cells.
    pub fn new(vertices: Vec<[f64; D]>, cells: Vec<u32>) -> Result<Self, MeshError> {
        if !cells.len().is_multiple_of(Self::STRIDE) {
            return Err(MeshError::Stride { length: cells.len(), stride: Self::STRIDE });
        }
        for (cell, corners) in cells.chunks_exact(Self::STRIDE).enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(MeshError::NoSuchVertex { cell, vertex, count: vertices.len() });
            }
        }
        let neighbours = Self::match_faces(vertices.len(), &cells)?;
        let mut mesh = Self { vertices, cells, neighbours, border: Vec::new() };
        for cell in 0..mesh.cell_count() {
            let volume = mesh.volume(&mesh.vertices, cell);
            if volume.is_nan() || volume <= 0.0 {
                return Err(MeshError::NotPositive { cell, volume });
            }
        }
        mesh.border = mesh.collect_border();
        Ok(mesh)
    }

    /// The cell across each face of `cells` (flat), or [`BORDER`]. Faces are sorted into those with the same lowest vertex, of
    /// which there are few.
    ///
    /// # Errors
    /// A face shared by more than two cells: the first cell that is one too many.
    pub(crate) fn match_faces(vertices: usize, cells: &[u32]) -> Result<Vec<u32>, MeshError> {
        let face = |slot: u32| {
            let (cell, opposite) = (slot as usize / Self::STRIDE, slot as usize % Self::STRIDE);
            let mut corners: [u32; D] =
                std::array::from_fn(|k| cells[cell * Self::STRIDE + k + usize::from(k >= opposite)]);
            corners.sort_unstable();
            corners
        };
        let slots = 0..cells.len() as u32;
        let mut ends = vec![0u32; vertices + 1];
        slots.clone().for_each(|slot| ends[face(slot)[0] as usize + 1] += 1);
        (0..vertices).for_each(|vertex| ends[vertex + 1] += ends[vertex]);
        let starts = ends.clone();
        let mut sorted = vec![0u32; cells.len()];
        for slot in slots {
            let end = &mut ends[face(slot)[0] as usize];
            sorted[*end as usize] = slot;
            *end += 1;
        }
        let mut neighbours = vec![BORDER; cells.len()];
        let mut surplus: Option<u32> = None;
        for (&start, &end) in starts.iter().zip(&ends) {
            let with_this = &mut sorted[start as usize..end as usize];
            with_this.sort_unstable_by_key(|&slot| (face(slot), slot));
            for same in with_this.chunk_by(|&one, &other| face(one) == face(other)) {
                if let [one, other, rest @ ..] = same {
                    neighbours[*one as usize] = other / Self::STRIDE as u32;
                    neighbours[*other as usize] = one / Self::STRIDE as u32;
                    surplus = rest.first().copied().into_iter().chain(surplus).min();
                }
            }
        }
        match surplus {
            Some(slot) => Err(MeshError::NotConforming { cell: slot as usize / Self::STRIDE }),
            None => Ok(neighbours),
        }
    }

    fn collect_border(&self) -> Vec<BorderFacet> {
        let on_border = |slot: &usize| self.neighbours[*slot] == BORDER;
        (0..self.neighbours.len())
            .filter(on_border)
            .map(|slot| BorderFacet { cell: (slot / Self::STRIDE) as u32, face: (slot % Self::STRIDE) as u8, edge: 0 })
            .collect()
    }

    /// Gives each border facet the edge that `edge_of` returns for the centroid of its reference position (µm).
    pub fn name_border(&mut self, edge_of: impl Fn([f64; D]) -> u16) {
        let named: Vec<u16> = self
            .border
            .iter()
            .map(|facet| {
                let mut centroid = [0.0; D];
                for vertex in self.facet_vertices(*facet) {
                    let x = self.vertices[vertex as usize];
                    (0..D).for_each(|i| centroid[i] += x[i] / D as f64);
                }
                edge_of(centroid)
            })
            .collect();
        for (facet, edge) in self.border.iter_mut().zip(named) {
            facet.edge = edge;
        }
    }

    /// Bytes that the mesh takes.
    pub fn bytes(&self) -> usize {
        let topology = size_of_val(&self.cells[..]) + size_of_val(&self.neighbours[..]);
        size_of_val(&self.vertices[..]) + topology + size_of_val(&self.border[..])
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.len() / Self::STRIDE
    }

    /// Reference coordinates, one entry a vertex (µm).
    pub fn vertices(&self) -> &[[f64; D]] {
        &self.vertices
    }

    /// All cells, flat, stride `D + 1`.
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }

    /// The `D + 1` vertices of one cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.cells[cell * Self::STRIDE..(cell + 1) * Self::STRIDE]
    }

    /// The cell across face `face` of `cell`, or [`BORDER`].
    pub fn neighbour(&self, cell: usize, face: usize) -> u32 {
        self.neighbours[cell * Self::STRIDE + face]
    }

    /// The cell across each face, or [`BORDER`]: flat, stride `D + 1`.
    pub fn neighbours(&self) -> &[u32] {
        &self.neighbours
    }

    /// The facets on the border of the domain, in order of their cells.
    pub fn border(&self) -> &[BorderFacet] {
        &self.border
    }

    /// The `D` vertices of a border facet, in the order they have in their cell (for `D = 2` so that the domain lies to the
    /// left of first → last, for either face).
    pub fn facet_vertices(&self, facet: BorderFacet) -> impl Iterator<Item = u32> + '_ {
        self.face_vertices(facet.cell, facet.face)
    }

    /// The same of a face of a cell, by the local vertex opposite to it.
    pub fn face_vertices(&self, cell: u32, face: u8) -> impl Iterator<Item = u32> + '_ {
        let corners = self.cell(cell as usize);
        (1..Self::STRIDE).map(move |k| corners[(face as usize + k) % Self::STRIDE])
    }

    /// Edge vectors of a cell from its vertex 0: column `i` is `x_{i+1} − x_0` (µm), at the given coordinates.
    pub fn edge_vectors(&self, coordinates: &(impl AtVertices<D> + ?Sized), cell: usize) -> [[f64; D]; D] {
        let corners = self.cell(cell);
        let origin = coordinates.at(corners[0] as usize);
        std::array::from_fn(|i| {
            let x = coordinates.at(corners[i + 1] as usize);
            std::array::from_fn(|k| x[k] - origin[k])
        })
    }

    /// Signed volume of a cell (area in the plane, µm²) at the given coordinates.
    pub fn volume(&self, coordinates: &[[f64; D]], cell: usize) -> f64 {
        let factorial: f64 = (1..=D).map(|i| i as f64).product();
        determinant(&self.edge_vectors(coordinates, cell)) / factorial
    }

    /// Gradients of the `D + 1` barycentric coordinates of a cell (1/µm), written into `gradients`, and its signed volume.
    ///
    /// `gradients` has `D + 1` rows; row `i` is ∇λ_i. They sum to zero.
    pub fn barycentric_gradients(
        &self,
        coordinates: &(impl AtVertices<D> + ?Sized),
        cell: usize,
        gradients: &mut [[f64; D]],
    ) -> f64 {
        let edges = self.edge_vectors(coordinates, cell);
        let det = determinant(&edges);
        gradients[0] = [0.0; D];
        for i in 0..D {
            let row = inverse_row(&edges, det, i);
            for k in 0..D {
                gradients[0][k] -= row[k];
            }
            gradients[i + 1] = row;
        }
        let factorial: f64 = (1..=D).map(|i| i as f64).product();
        det / factorial
    }
}

/// Determinant of the matrix whose columns are given, `D ≤ 3`.
pub fn determinant<const D: usize>(columns: &[[f64; D]; D]) -> f64 {
    match D {
        1 => columns[0][0],
        2 => columns[0][0] * columns[1][1] - columns[0][1] * columns[1][0],
        3 => {
            let cross = cross(&columns[1], &columns[2]);
            columns[0][0] * cross[0] + columns[0][1] * cross[1] + columns[0][2] * cross[2]
        }
        _ => unreachable!("simplices of dimension {D} are not supported"),
    }
}

/// Row `i` of the inverse of the matrix whose columns are given: the vector dual to column `i`.
fn inverse_row<const D: usize>(columns: &[[f64; D]; D], det: f64, i: usize) -> [f64; D] {
    let mut row = [0.0; D];
    match D {
        1 => row[0] = 1.0 / det,
        2 => {
            let other = columns[1 - i];
            let sign = if i == 0 { 1.0 } else { -1.0 };
            row[0] = sign * other[1] / det;
            row[1] = -sign * other[0] / det;
        }
        3 => {
            let cross = cross(&columns[(i + 1) % 3], &columns[(i + 2) % 3]);
            (0..D).for_each(|k| row[k] = cross[k] / det);
        }
        _ => unreachable!("simplices of dimension {D} are not supported"),
    }
    row
}

fn cross<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A structured mesh of the rectangle `(0, width) × (0, height)`, `columns × rows` cells, each cut from lower left to upper
/// right into (a, b, d), (a, d, c); vertex `(i, j)` has the number `j (columns + 1) + i`.
///
/// # Errors
/// Those of [`SimplexMesh::new`], when a side or a count is not positive.
pub fn structured_rectangle(width: f64, height: f64, columns: usize, rows: usize) -> Result<SimplexMesh<2>, MeshError> {
    let vertex = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    let mut vertices = Vec::with_capacity((columns + 1) * (rows + 1));
    for j in 0..=rows {
        for i in 0..=columns {
            vertices.push([width * i as f64 / columns as f64, height * j as f64 / rows as f64]);
        }
    }
    let mut cells = Vec::with_capacity(6 * columns * rows);
    for j in 0..rows {
        for i in 0..columns {
            let (a, b, c, d) = (vertex(i, j), vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j + 1));
            cells.extend([a, b, d, a, d, c]);
        }
    }
    SimplexMesh::new(vertices, cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_of_barycentric_coordinates_are_dual_to_the_edges_in_the_plane_and_in_space() {
        let triangle = SimplexMesh::<2>::new(vec![[0.0, 0.0], [2.0, 0.5], [0.3, 1.0]], vec![0, 1, 2]).unwrap();
        let mut g = [[0.0; 2]; 3];
        let area = triangle.barycentric_gradients(triangle.vertices(), 0, &mut g);
        assert!((area - 0.5 * (2.0 - 0.15)).abs() < 1e-15);
        for (i, g) in g.iter().enumerate() {
            for (j, x) in triangle.vertices().iter().enumerate() {
                let value = g[0] * (x[0] - 0.3) + g[1] * (x[1] - 1.0) + if i == 2 { 1.0 } else { 0.0 };
                assert!((value - f64::from(i == j)).abs() < 1e-14);
            }
        }
        let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.1, 1.5, 0.3], [0.0, 0.4, 2.0]];
        let tetrahedron = SimplexMesh::<3>::new(corners, vec![0, 1, 2, 3]).unwrap();
        let mut g = [[0.0; 3]; 4];
        tetrahedron.barycentric_gradients(tetrahedron.vertices(), 0, &mut g);
        let edges = tetrahedron.edge_vectors(tetrahedron.vertices(), 0);
        for i in 0..3 {
            for (j, edge) in edges.iter().enumerate() {
                let dot: f64 = (0..3).map(|k| g[i + 1][k] * edge[k]).sum();
                assert!((dot - f64::from(i == j)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_structured_rectangle_covers_its_area_and_knows_its_border() {
        let mesh = structured_rectangle(1.5, 1.0, 6, 4).unwrap();
        let area: f64 = (0..mesh.cell_count()).map(|cell| mesh.volume(mesh.vertices(), cell)).sum();
        assert!((area - 1.5).abs() < 1e-14);
        assert_eq!(mesh.border().len(), 2 * (6 + 4));
        for cell in 0..mesh.cell_count() {
            for face in 0..3 {
                let other = mesh.neighbour(cell, face);
                assert!(other == BORDER || (0..3).any(|f| mesh.neighbour(other as usize, f) == cell as u32));
            }
        }
    }

    #[test]
    fn an_inverted_cell_is_refused_by_number() {
        let error = SimplexMesh::<2>::new(vec![[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]], vec![0, 1, 2]).unwrap_err();
        assert_eq!(error, MeshError::NotPositive { cell: 0, volume: -0.5 });
    }
}
