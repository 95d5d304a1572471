//! Whether a mesh that follows a path ever turns a cell over, and how far it is pressed together: for certain, not at samples.
//!
//! Between two levels a vertex moves along a cubic, so the two edges a(t), b(t) of a cell from its vertex 0 are cubics in Bernstein form with
//! four control vectors each, and twice the signed area is a polynomial of degree six with the coefficients
//!
//! ```text
//! d_k = Σ_{i+j=k} C(3,i) C(3,j) / C(6,k)  a_i × b_j,   k = 0 … 6.
//! ```
//!
//! A polynomial lies between the smallest and the largest of its Bernstein coefficients: where all are positive, so is the area. The
//! converse does not hold; a cell that comes near to being turned over may fail the test and never be. In the same way F(t) is a mean of the
//! four F_i that belong to the control vectors, so that
//!
//! ```text
//! ‖F⁻¹(t)‖₂ = ‖F(t)‖₂ / det F(t) ≤ max_i ‖F_i‖₂ · d₀ / min_k d_k,   d₀ that of the cell at rest.
//! ```

use crate::numerics::hermite::HermitePath;
use crate::numerics::simplex_mesh::{SimplexMesh, determinant};
use crate::numerics::vector::between;
use rayon::prelude::*;

/// Share of a cell's area at rest that is left for round-off.
const MARGIN: f64 = 1e-9;
/// What round-off may add where vertices are reckoned from the path.
const ROUND_OFF: f64 = 1.0 + 1e-10;
/// Cells that are looked at together.
const CELLS_AT_A_TIME: usize = 1024;

/// C(3, i) and C(6, k).
const CUBIC: [f64; 4] = [1.0, 3.0, 3.0, 1.0];
const SEXTIC: [f64; 7] = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];

/// A bound of ‖F⁻¹‖₂ in all cells for each part of a path of displacements (µm, flat, two a vertex), if every cell certainly has a positive
/// area all along it.
pub fn inverse_stretches(mesh: &SimplexMesh<2>, path: &HermitePath) -> Option<Vec<f64>> {
    let cells = |part: usize| {
        let cells = (0..mesh.cell_count()).into_par_iter().with_min_len(CELLS_AT_A_TIME);
        cells.map(move |cell| inverse_stretch(mesh, path, (cell, part)))
    };
    (0..path.parts()).map(|part| cells(part).try_reduce(|| 0.0, |a, b| Some(a.max(b)))).collect()
}

fn inverse_stretch(mesh: &SimplexMesh<2>, path: &HermitePath, (cell, part): (usize, usize)) -> Option<f64> {
    let corners = mesh.cell(cell);
    let controls = |vertex: u32| {
        let [x, y] = mesh.vertices()[vertex as usize];
        let [u, v] = [0, 1].map(|k| path.bernstein(part, 2 * vertex as usize + k));
        [0, 1, 2, 3].map(|i| [x + u[i], y + v[i]])
    };
    let [origin, first, second] = [0, 1, 2].map(|i| controls(corners[i]));
    let edges = [0, 1, 2, 3].map(|i| [between(&origin[i], &first[i]), between(&origin[i], &second[i])]);
    let mut area = [0.0; 7];
    for i in 0..4 {
        for j in 0..4 {
            area[i + j] += CUBIC[i] * CUBIC[j] / SEXTIC[i + j] * determinant(&[edges[i][0], edges[j][1]]);
        }
    }
    let rest = mesh.edge_vectors(mesh.vertices(), cell);
    let at_rest = determinant(&rest);
    let least = area.iter().copied().fold(f64::INFINITY, f64::min);
    // Not what is no number either.
    let upright = least > MARGIN * at_rest && area.iter().all(|d| d.is_finite());
    let largest = edges.iter().map(|edges| stretch(&rest, edges)).fold(0.0, f64::max);
    upright.then(|| largest * at_rest / least * ROUND_OFF)
}

/// ‖F‖₂ of the map that takes the edges of a cell at rest to others.
fn stretch(rest: &[[f64; 2]; 2], edges: &[[f64; 2]; 2]) -> f64 {
    let scale = 1.0 / determinant(rest);
    let entry = |k: usize, towards: [f64; 2]| scale * (edges[0][k] * towards[0] + edges[1][k] * towards[1]);
    let (dual_x, dual_y) = ([rest[1][1], -rest[0][1]], [-rest[1][0], rest[0][0]]);
    let f = [[entry(0, dual_x), entry(0, dual_y)], [entry(1, dual_x), entry(1, dual_y)]];
    let half = 0.5 * f.as_flattened().iter().map(|x| x * x).sum::<f64>();
    let det = f[0][0] * f[1][1] - f[0][1] * f[1][0];
    (half + (half * half - det * det).max(0.0).sqrt()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::hermite::Level;
    use crate::numerics::simplex_mesh::structured_rectangle;

    /// Levels at 0, 1 of a block whose top is pressed to a share of its height, with slopes as of a straight path times `eagerness`.
    fn pressed(to: f64, eagerness: f64) -> (SimplexMesh<2>, HermitePath) {
        let mesh = structured_rectangle(2.0, 1.0, 4, 2).unwrap();
        let displacement: Vec<f64> = mesh.vertices().iter().flat_map(|[_, y]| [0.0, (to - 1.0) * y]).collect();
        let slope: Vec<f64> = displacement.iter().map(|u| eagerness * u).collect();
        let level = |parameter: f64, value: Vec<f64>| Level { parameter, value, slope: slope.clone() };
        let still = vec![0.0; displacement.len()];
        let path = HermitePath::new(vec![level(0.0, still), level(1.0, displacement)]).unwrap();
        (mesh, path)
    }

    #[test]
    fn a_block_that_is_pressed_evenly_stays_upright_until_it_is_flat() {
        for (to, upright) in [(0.5, true), (0.01, true), (0.0, false), (-0.5, false)] {
            let (mesh, path) = pressed(to, 1.0);
            let found = inverse_stretches(&mesh, &path);
            assert_eq!(found.is_some(), upright, "{to}");
            // F = diag(1, s) with s from 1 down to `to`: its control values are just these.
            assert!(found.is_none_or(|bounds| (bounds[0] * to - 1.0).abs() < 1e-9), "{to}");
        }
    }

    #[test]
    fn what_turns_over_between_two_levels_that_are_upright_is_seen() {
        // u(t) = (to − 1) y [t + (e − 1) t (1 − t)(1 − 2t)]: beyond y for some t between, though upright at both ends.
        let (mesh, path) = pressed(0.05, 12.0);
        let least = (0..=1000).map(|k| path.component(&path.locate(1e-3 * f64::from(k)), 2 * 14 + 1).0);
        assert!(least.fold(0.0, f64::min) < -1.0, "the top passes the bottom");
        assert_eq!(inverse_stretches(&mesh, &path), None);
        let (mesh, path) = pressed(0.5, 1.5);
        assert!(inverse_stretches(&mesh, &path).is_some());
    }

    /// Displacements of all vertices at a parameter.
    fn at(path: &HermitePath, parameter: f64) -> Vec<[f64; 2]> {
        let mut flat = vec![0.0; path.components()];
        path.evaluate(parameter, &mut flat);
        flat.chunks_exact(2).map(|u| [u[0], u[1]]).collect()
    }

    #[test]
    fn no_cell_of_a_sheared_and_pressed_block_is_pressed_together_beyond_the_bound() {
        let mesh = structured_rectangle(2.0, 1.0, 6, 4).unwrap();
        let displacement = |s: f64| -> Vec<f64> {
            mesh.vertices()
                .iter()
                .flat_map(|[x, y]| [0.4 * s * y * y + 0.1 * s * s * x, -0.3 * s * y * (1.0 + 0.3 * x)])
                .collect()
        };
        let slope = |s: f64| -> Vec<f64> {
            mesh.vertices().iter().flat_map(|[x, y]| [0.4 * y * y + 0.2 * s * x, -0.3 * y * (1.0 + 0.3 * x)]).collect()
        };
        let level = |s: f64| Level { parameter: s, value: displacement(s), slope: slope(s) };
        let path = HermitePath::new([0.0, 0.4, 1.0].map(level).to_vec()).unwrap();
        let bounds = inverse_stretches(&mesh, &path).unwrap();
        let mut most = [0.0f64; 2];
        for k in 0..=100 {
            let s = 0.01 * f64::from(k);
            let places = mesh.vertices().iter().zip(at(&path, s)).map(|(x, u)| [x[0] + u[0], x[1] + u[1]]);
            let moved: Vec<[f64; 2]> = places.collect();
            let pressed = (0..mesh.cell_count()).map(|cell| {
                let (rest, now) = (mesh.edge_vectors(mesh.vertices(), cell), mesh.edge_vectors(&moved, cell));
                stretch(&now, &rest)
            });
            let part = path.locate(s).part();
            most[part] = pressed.fold(most[part], f64::max);
        }
        for (most, bound) in most.into_iter().zip(bounds) {
            assert!(most <= bound * (1.0 + 1e-9) && bound < 1.3 * most, "{most} {bound}");
        }
    }
}
