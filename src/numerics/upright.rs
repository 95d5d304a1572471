//! Whether a mesh that follows a path ever turns a cell over: for certain, not at samples.
//!
//! Between two levels a vertex moves along a cubic, so the two edges a(t), b(t) of a cell from its vertex 0 are cubics in Bernstein form with
//! four control vectors each, and twice the signed area is a polynomial of degree six with the coefficients
//!
//! ```text
//! d_k = Σ_{i+j=k} C(3,i) C(3,j) / C(6,k)  a_i × b_j,   k = 0 … 6.
//! ```
//!
//! A polynomial lies between the smallest and the largest of its Bernstein coefficients: where all are positive, so is the area. The
//! converse does not hold; a cell that comes near to being turned over may fail the test and never be.

use crate::numerics::hermite::HermitePath;
use crate::numerics::simplex_mesh::SimplexMesh;
use rayon::prelude::*;

/// Share of a cell's area at rest that is left for round-off.
const MARGIN: f64 = 1e-9;
/// Cells that are looked at together.
const CELLS_AT_A_TIME: usize = 1024;

/// C(3, i) and C(6, k).
const CUBIC: [f64; 4] = [1.0, 3.0, 3.0, 1.0];
const SEXTIC: [f64; 7] = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];

/// Whether every cell has a positive area all along a path of displacements (µm, flat, two a vertex). `false` says nothing.
pub fn stays_upright(mesh: &SimplexMesh<2>, path: &HermitePath) -> bool {
    let parts = path.parts();
    let cells = (0..mesh.cell_count()).into_par_iter().with_min_len(CELLS_AT_A_TIME);
    cells.all(|cell| (0..parts).all(|part| is_upright(mesh, path, (cell, part))))
}

fn is_upright(mesh: &SimplexMesh<2>, path: &HermitePath, (cell, part): (usize, usize)) -> bool {
    let corners = mesh.cell(cell);
    let controls = |vertex: u32| {
        let [x, y] = mesh.vertices()[vertex as usize];
        let [u, v] = [0, 1].map(|k| path.bernstein(part, 2 * vertex as usize + k));
        [0, 1, 2, 3].map(|i| [x + u[i], y + v[i]])
    };
    let [origin, first, second] = [0, 1, 2].map(|i| controls(corners[i]));
    let mut area = [0.0; 7];
    for i in 0..4 {
        for j in 0..4 {
            let (a, b) = (between(origin[i], first[i]), between(origin[j], second[j]));
            area[i + j] += CUBIC[i] * CUBIC[j] / SEXTIC[i + j] * (a[0] * b[1] - a[1] * b[0]);
        }
    }
    let least = MARGIN * mesh.volume(mesh.vertices(), cell);
    area.iter().all(|coefficient| *coefficient > least)
}

fn between(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [b[0] - a[0], b[1] - a[1]]
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
            assert_eq!(stays_upright(&mesh, &path), upright, "{to}");
        }
    }

    #[test]
    fn what_turns_over_between_two_levels_that_are_upright_is_seen() {
        // u(t) = (to − 1) y [t + (e − 1) t (1 − t)(1 − 2t)]: beyond y for some t between, though upright at both ends.
        let (mesh, path) = pressed(0.05, 8.0);
        let least = (0..=1000).map(|k| path.component(&path.locate(1e-3 * f64::from(k)), 2 * 14 + 1).0);
        assert!(least.fold(0.0, f64::min) < -1.0, "the top passes the bottom");
        assert!(!stays_upright(&mesh, &path));
        let (mesh, path) = pressed(0.5, 1.5);
        assert!(stays_upright(&mesh, &path));
    }
}
