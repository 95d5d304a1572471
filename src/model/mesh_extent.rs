//! How many vertices a mesh of a tissue has, before it is made.

use super::quantity::Length;
use super::violation::Violations;

/// Vertices per area over h², for triangles near the equilateral one: 2/√3.
const VERTICES_PER_SQUARE: f64 = 1.154_700_538_379_251_7;

/// What the number of vertices depends on, and how many there may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshExtent {
    /// Area of the tissue at rest (µm²).
    pub area: f64,
    /// Length of its border, holes included (µm).
    pub border: f64,
    /// Vertices that a mesh may have.
    pub max_vertices: u64,
}

impl MeshExtent {
    /// About how many vertices there are if edges are of one size: those inside, or, in a tissue thinner than an edge, those along the border.
    pub fn vertices_at(&self, size: Length) -> f64 {
        (VERTICES_PER_SQUARE * self.area / size.0.powi(2)).max(self.border / size.0)
    }

    /// Demands that a mesh with edges of the size asked for at a place can be: before one is begun that no memory holds.
    pub fn demand(&self, size: Length, pointer: &str, violations: &mut Violations) {
        let (vertices, most) = (self.vertices_at(size), self.max_vertices);
        violations.demand(vertices <= most as f64, pointer, || {
            format!("triangles of {size} would need about {vertices:.1e} vertices; max_vertices is {most}")
        });
    }
}

impl Default for MeshExtent {
    /// Nothing known: nothing refused.
    fn default() -> Self {
        Self { area: 0.0, border: 0.0, max_vertices: u64::MAX }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_go_with_the_area_and_in_a_thin_tissue_with_the_border() {
        let square = MeshExtent { area: 1e6, border: 4e3, max_vertices: 12_000 };
        assert!((square.vertices_at(Length(10.0)) - 11_547.0).abs() < 1.0);
        let mut refused = Violations::new();
        square.demand(Length(10.0), "/a", &mut refused);
        assert!(refused.is_empty(), "{refused}");
        square.demand(Length(1e-9), "/a", &mut refused);
        assert_eq!(
            refused.to_string(),
            "/a: triangles of 1e-9 um would need about 1.2e24 vertices; max_vertices is 12000"
        );
        let thread = MeshExtent { area: 1e-3, border: 2e6, max_vertices: 12_000 };
        assert_eq!(thread.vertices_at(Length(10.0)), 2e5);
    }
}
