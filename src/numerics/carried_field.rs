//! A field bound to the matrix: carried by its deformation and diluted by it.
//!
//! What is bound does not diffuse. With the distribution c₀(X) at rest and J = det F,
//!
//! ```text
//! c(φ(X)) = c₀(X) / J.
//! ```
//!
//! At a vertex, J is the volume of the cells around it over their volume at rest, so that the lumped total Σ_i c_i V_i keeps its value to
//! round-off whatever the mesh.

use crate::numerics::cue_element::{Element, divergence};
use crate::numerics::simplex_mesh::SimplexMesh;

/// Volume of the cells around each vertex at `coordinates` (one entry a vertex, µm^D).
pub fn volumes_around<const D: usize>(mesh: &SimplexMesh<D>, coordinates: &[[f64; D]]) -> Vec<f64> {
    gathered(mesh, |cell| mesh.volume(coordinates, cell))
}

/// Derivative of [`volumes_around`] while the vertices move with `velocity` dx/ds.
pub fn volume_rates_around<const D: usize>(
    mesh: &SimplexMesh<D>,
    coordinates: &[[f64; D]],
    velocity: &[[f64; D]],
) -> Vec<f64> {
    gathered(mesh, |cell| {
        let element = Element::new(mesh, coordinates, cell);
        mesh.volume(coordinates, cell) * divergence(&element.velocity_gradient(velocity))
    })
}

/// c and dc/ds of a field that had the values `at_rest` (one entry a vertex) before the vertices came to `coordinates` (µm), where they move
/// with `velocity` dx/ds.
pub fn carried<const D: usize>(
    mesh: &SimplexMesh<D>,
    at_rest: &[f64],
    coordinates: &[[f64; D]],
    velocity: &[[f64; D]],
) -> (Vec<f64>, Vec<f64>) {
    let (before, now) = (volumes_around(mesh, mesh.vertices()), volumes_around(mesh, coordinates));
    let growth = volume_rates_around(mesh, coordinates, velocity);
    let value = |i: usize| at_rest[i] * before[i] / now[i];
    (0..at_rest.len()).map(|i| (value(i), -value(i) * growth[i] / now[i])).unzip()
}

/// Sum of a number of each cell over the cells around each vertex.
fn gathered<const D: usize>(mesh: &SimplexMesh<D>, of_cell: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; mesh.vertex_count()];
    for cell in 0..mesh.cell_count() {
        let value = of_cell(cell);
        mesh.cell(cell).iter().for_each(|&vertex| sums[vertex as usize] += value);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::simplex_mesh::structured_rectangle;

    /// x = (1 + s) X + s X² / 4, y = (1 − s/2) Y, and dx/ds.
    fn moved(mesh: &SimplexMesh<2>, s: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let at = |&[x, y]: &[f64; 2]| {
            ([(1.0 + s) * x + 0.25 * s * x * x, (1.0 - 0.5 * s) * y], [x + 0.25 * x * x, -0.5 * y])
        };
        mesh.vertices().iter().map(at).unzip()
    }

    #[test]
    fn the_total_is_kept_to_round_off_and_rates_are_those_of_differences() {
        let mesh = structured_rectangle(1.5, 1.0, 12, 9).unwrap();
        let at_rest: Vec<f64> = mesh.vertices().iter().map(|x| (-3.0 * x[0]).exp() + 0.2 * x[1]).collect();
        let total = |c: &[f64], x: &[[f64; 2]]| -> f64 {
            c.iter().zip(volumes_around(&mesh, x)).map(|(c, volume)| c * volume / 3.0).sum()
        };
        let (x, w) = moved(&mesh, 0.4);
        let (c, rate) = carried(&mesh, &at_rest, &x, &w);
        assert!((total(&c, &x) / total(&at_rest, mesh.vertices()) - 1.0).abs() < 1e-14);
        let at = |s: f64| {
            let (x, w) = moved(&mesh, s);
            carried(&mesh, &at_rest, &x, &w).0
        };
        let (ahead, behind) = (at(0.4 + 1e-5), at(0.4 - 1e-5));
        for i in 0..c.len() {
            assert!((rate[i] - (ahead[i] - behind[i]) / 2e-5).abs() < 1e-8, "{i}");
        }
    }

    #[test]
    fn an_even_stretch_dilutes_by_its_determinant() {
        let mesh = structured_rectangle(1.0, 1.0, 4, 4).unwrap();
        let at_rest: Vec<f64> = mesh.vertices().iter().map(|x| 1.0 + x[0]).collect();
        let x: Vec<[f64; 2]> = mesh.vertices().iter().map(|x| [1.5 * x[0], 0.8 * x[1]]).collect();
        let (c, rate) = carried(&mesh, &at_rest, &x, &vec![[0.0; 2]; x.len()]);
        assert!(c.iter().zip(&at_rest).all(|(c, c0)| (c * 1.2 - c0).abs() < 1e-14));
        assert!(rate.iter().all(|rate| *rate == 0.0));
    }
}
