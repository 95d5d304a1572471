//! The block of the references, 1.5 × 1 with E = 1, and how its ends are moved.

use std::sync::Arc;

use serde_json::Value;
use tropism::numerics::hyperelasticity::{Body, Prescribed};
use tropism::numerics::material::{Lame, Material, NeoHookean, StVenantKirchhoff};
use tropism::numerics::ogden::Ogden;
use tropism::numerics::simplex_mesh::{SimplexMesh, structured_rectangle};

pub const WIDTH: f64 = 1.5;
pub const HEIGHT: f64 = 1.0;

pub fn svk(poisson: f64) -> Arc<dyn Material<2>> {
    Arc::new(StVenantKirchhoff { lame: Lame::from_young_poisson(1.0, poisson).unwrap() })
}

pub fn neo_hookean(poisson: f64) -> Arc<dyn Material<2>> {
    Arc::new(NeoHookean { lame: Lame::from_young_poisson(1.0, poisson).unwrap() })
}

pub fn ogden(poisson: f64) -> Arc<dyn Material<2>> {
    Arc::new(Ogden { lame: Lame::from_young_poisson(1.0, poisson).unwrap(), exponent: -8.0 })
}

/// `columns` must be even, so that a vertex stands at `(W/2, 0)`.
pub fn block(columns: usize, rows: usize) -> SimplexMesh<2> {
    structured_rectangle(WIDTH, HEIGHT, columns, rows).unwrap()
}

/// Top and bottom moved outward by `amplitude` each: clamped, or sliding with one vertex held sideways.
pub fn moved_ends(mesh: &SimplexMesh<2>, material: Arc<dyn Material<2>>, amplitude: f64, clamped: bool) -> Body<'_, 2> {
    let mut prescribed = Prescribed::none(mesh.vertex_count());
    for (vertex, &[x, y]) in mesh.vertices().iter().enumerate() {
        if y == 0.0 || y == HEIGHT {
            prescribed.impose(vertex, 1, if y == 0.0 { -amplitude } else { amplitude });
            if clamped || (x == 0.5 * WIDTH && y == 0.0) {
                prescribed.impose(vertex, 0, 0.0);
            }
        }
    }
    Body::new(mesh, material, prescribed).unwrap()
}

/// Sum of the vertical reactions of the top.
pub fn reaction_of_the_top(body: &Body<'_, 2>, forces: &[f64]) -> f64 {
    let on_top = |vertex: &usize| body.mesh().vertices()[*vertex][1] == HEIGHT;
    body.resultant(forces, (0..body.mesh().vertex_count()).filter(on_top))[1]
}

/// A reference from `assets/reference`.
pub fn reference(name: &str) -> Value {
    let path = format!("{}/assets/reference/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

pub fn array(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

/// Slope of the line that fits `log(error)` against `log(size)` best.
pub fn fitted_order(sizes: &[f64], errors: &[f64]) -> f64 {
    let n = sizes.len() as f64;
    let mean = |values: &[f64]| values.iter().map(|value| value.ln()).sum::<f64>() / n;
    let (x, y) = (mean(sizes), mean(errors));
    let covariance: f64 = sizes.iter().zip(errors).map(|(s, e)| (s.ln() - x) * (e.ln() - y)).sum();
    covariance / sizes.iter().map(|s| (s.ln() - x).powi(2)).sum::<f64>()
}
