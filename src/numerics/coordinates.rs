//! Vectors at the vertices of a mesh: at hand for all of them, or reckoned for those that are asked for.

/// Gives each vertex its vector, such as its coordinates (µm).
pub trait AtVertices<const D: usize> {
    /// The vector of a vertex of the mesh.
    fn at(&self, vertex: usize) -> [f64; D];
}

impl<const D: usize> AtVertices<D> for [[f64; D]] {
    #[inline]
    fn at(&self, vertex: usize) -> [f64; D] {
        self[vertex]
    }
}

impl<const D: usize> AtVertices<D> for Vec<[f64; D]> {
    #[inline]
    fn at(&self, vertex: usize) -> [f64; D] {
        self[vertex]
    }
}
