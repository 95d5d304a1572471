//! How a stationary field and its gradient lie in one vector, and how both are read at a place.
//!
//! What is interpolated along the load is one vector a field: concentrations and gradients together, so that a place is read
//! from it without the mesh's present coordinates. Which elements the field has and how its gradient is made decide what stands
//! where ([`FieldLayout`]).

use std::sync::Arc;

use crate::numerics::quadratic_element::shape;
use crate::numerics::quadratic_field::QuadraticNodes;
use crate::numerics::simplex_mesh::SimplexMesh;

/// Values a node where c, ∂c/∂x, ∂c/∂y are interleaved.
const STRIDE: usize = 3;

/// What stands where in a field's vector, on a planar mesh.
#[derive(Debug, Clone)]
pub enum FieldLayout {
    /// Linear elements, continuous gradient: c, ∂c/∂x, ∂c/∂y of each vertex; both linear in a cell.
    Vertices,
    /// Linear elements, their own gradient: c of each vertex (so many), then ∂c/∂x, ∂c/∂y of each cell, constant there.
    Cells(usize),
    /// Quadratic elements, continuous gradient: c, ∂c/∂x, ∂c/∂y of each node; both quadratic in a cell.
    Nodes(Arc<QuadraticNodes<2>>),
    /// Quadratic elements, their own gradient: c of each node, then ∂c/∂x, ∂c/∂y of the three corners of each cell, linear there.
    Corners(Arc<QuadraticNodes<2>>),
}

impl FieldLayout {
    /// c and ∇c in a cell at barycentric `weights`, from the components of the field's vector. c may be negative.
    #[inline]
    pub fn sample(
        &self,
        mesh: &SimplexMesh<2>,
        value: impl Fn(usize) -> f64,
        (cell, weights): (usize, [f64; 3]),
    ) -> (f64, [f64; 2]) {
        let Self::Vertices = self else { return self.sample_other(mesh, value, (cell, weights)) };
        let mut sum = [0.0; STRIDE];
        for (weight, &corner) in weights.into_iter().zip(mesh.cell(cell)) {
            let at = corner as usize * STRIDE;
            (0..STRIDE).for_each(|k| sum[k] += weight * value(at + k));
        }
        (sum[0], [sum[1], sum[2]])
    }

    #[inline(never)]
    fn sample_other(
        &self,
        mesh: &SimplexMesh<2>,
        value: impl Fn(usize) -> f64,
        (cell, weights): (usize, [f64; 3]),
    ) -> (f64, [f64; 2]) {
        let shape = shape::<2>(&[weights[0], weights[1], weights[2], 0.0]);
        let sum = |places: &[u32], shares: &[f64], (first, stride): (usize, usize)| -> f64 {
            places.iter().zip(shares).map(|(&place, share)| share * value(first + stride * place as usize)).sum()
        };
        match self {
            Self::Vertices => {
                let at = |k| sum(mesh.cell(cell), &weights, (k, STRIDE));
                (at(0), [at(1), at(2)])
            }
            Self::Cells(vertices) => {
                let gradient = vertices + 2 * cell;
                (sum(mesh.cell(cell), &weights, (0, 1)), [value(gradient), value(gradient + 1)])
            }
            Self::Nodes(nodes) => {
                let at = |k| sum(nodes.cell(cell), &shape, (k, STRIDE));
                (at(0), [at(1), at(2)])
            }
            Self::Corners(nodes) => {
                let first = nodes.count() + 6 * cell;
                let gradient = [0, 1].map(|k| sum(&[0, 1, 2], &weights, (first + k, 2)));
                (sum(nodes.cell(cell), &shape, (0, 1)), gradient)
            }
        }
    }

    /// Numbers of a field.
    pub fn components(&self, mesh: &SimplexMesh<2>) -> usize {
        match self {
            Self::Vertices => STRIDE * mesh.vertex_count(),
            Self::Cells(vertices) => vertices + 2 * mesh.cell_count(),
            Self::Nodes(nodes) => STRIDE * nodes.count(),
            Self::Corners(nodes) => nodes.count() + 6 * mesh.cell_count(),
        }
    }

    /// c of the unknowns, vertices first.
    pub fn concentrations<'v>(&self, values: &'v [f64]) -> impl Iterator<Item = f64> + use<'v> {
        let (count, stride) = match self {
            Self::Vertices | Self::Nodes(_) => (values.len() / STRIDE, STRIDE),
            Self::Cells(vertices) => (*vertices, 1),
            Self::Corners(nodes) => (nodes.count(), 1),
        };
        values.iter().step_by(stride).take(count).copied()
    }

    /// Puts a field and its gradients, in the order of the layout, into one vector.
    pub fn pack(&self, c: &[f64], gradients: &[[f64; 2]]) -> Vec<f64> {
        match self {
            Self::Vertices | Self::Nodes(_) => c.iter().zip(gradients).flat_map(|(c, g)| [*c, g[0], g[1]]).collect(),
            Self::Cells(_) | Self::Corners(_) => {
                c.iter().copied().chain(gradients.iter().flat_map(|g| [g[0], g[1]])).collect()
            }
        }
    }

    /// Root mean square of the relative error of the gradients of `interpolated`; a gradient smaller than `flat` (1/µm) times the
    /// concentration beside it has that size.
    pub fn gradient_defect(&self, mesh: &SimplexMesh<2>, (interpolated, exact): (&[f64], &[f64]), flat: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0f64);
        let mut add = |c: f64, a: &[f64], b: &[f64]| {
            let size = b[0].hypot(b[1]).max(flat * c.abs());
            if size > 0.0 {
                sum += ((a[0] - b[0]).hypot(a[1] - b[1]) / size).powi(2).min(1.0);
                count += 1.0;
            }
        };
        let (nodes, vertex_of): (usize, &dyn Fn(usize) -> u32) = match self {
            Self::Vertices | Self::Nodes(_) => {
                let pairs = interpolated.chunks_exact(STRIDE).zip(exact.chunks_exact(STRIDE));
                pairs.for_each(|(a, b)| add(b[0], &a[1..], &b[1..]));
                return (sum / count.max(1.0)).sqrt();
            }
            Self::Cells(vertices) => (*vertices, &|gradient| mesh.cell(gradient)[0]),
            Self::Corners(nodes) => (nodes.count(), &|gradient| mesh.cells()[gradient]),
        };
        let pairs = interpolated[nodes..].chunks_exact(2).zip(exact[nodes..].chunks_exact(2));
        pairs.enumerate().for_each(|(gradient, (a, b))| add(exact[vertex_of(gradient) as usize], a, b));
        (sum / count.max(1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::simplex_mesh::structured_rectangle;

    #[test]
    fn a_quadratic_is_read_exactly_from_nodes_and_from_corners() {
        let mesh = structured_rectangle(2.0, 1.0, 3, 2).unwrap();
        let nodes = Arc::new(QuadraticNodes::new(&mesh));
        let field = |[x, y]: [f64; 2]| 1.0 + x - 2.0 * y + x * x - 3.0 * x * y;
        let slope = |[x, y]: [f64; 2]| [1.0 + 2.0 * x - 3.0 * y, -2.0 - 3.0 * x];
        let places = nodes.positions(mesh.vertices());
        let c: Vec<f64> = places.iter().map(|&x| field(x)).collect();
        let at_nodes: Vec<_> = places.iter().map(|&x| slope(x)).collect();
        let at_corners: Vec<_> = mesh.cells().iter().map(|&v| slope(mesh.vertices()[v as usize])).collect();
        for (layout, gradients) in
            [(FieldLayout::Nodes(Arc::clone(&nodes)), at_nodes), (FieldLayout::Corners(nodes), at_corners)]
        {
            let values = layout.pack(&c, &gradients);
            assert_eq!(layout.concentrations(&values).collect::<Vec<_>>(), c);
            for cell in 0..mesh.cell_count() {
                let weights = [0.2, 0.5, 0.3];
                let corners = mesh.cell(cell).iter().map(|&v| mesh.vertices()[v as usize]);
                let x = corners.zip(weights).fold([0.0; 2], |x, (v, w)| [x[0] + w * v[0], x[1] + w * v[1]]);
                let (value, gradient) = layout.sample(&mesh, |i| values[i], (cell, weights));
                assert!((value - field(x)).abs() < 1e-14);
                assert!((0..2).all(|k| (gradient[k] - slope(x)[k]).abs() < 1e-13), "{gradient:?}");
            }
        }
    }

    #[test]
    fn round_off_in_a_corner_is_no_defect_and_a_wrong_gradient_is() {
        let mesh = structured_rectangle(1.0, 1.0, 1, 1).unwrap();
        let exact = [1.0, 1e-20, 0.0, 1.0, 0.01, 0.0];
        let rounded = [1.0, -3e-20, 1e-20, 1.0, 0.01, 0.0];
        let wrong = [1.0, 0.0, 0.0, 1.0, 0.01, 0.002];
        let expected = 0.2 / 2f64.sqrt();
        assert!(FieldLayout::Vertices.gradient_defect(&mesh, (&rounded, &exact), 1e-6) < 1e-12);
        assert!((FieldLayout::Vertices.gradient_defect(&mesh, (&wrong, &exact), 1e-6) - expected).abs() < 1e-12);
        let cells = FieldLayout::Cells(4);
        let apart = |v: [f64; 6]| cells.pack(&[1.0; 4], &[[v[1], v[2]], [v[4], v[5]]]);
        assert!(cells.gradient_defect(&mesh, (&apart(rounded), &apart(exact)), 1e-6) < 1e-12);
        assert!((cells.gradient_defect(&mesh, (&apart(wrong), &apart(exact)), 1e-6) - expected).abs() < 1e-12);
    }
}
