//! A matrix that is solved on a mesh of its own.

use crate::common::{assembled, fitted_order, try_load};
use serde_json::{Value, json};
use tropism::prelude::*;
use tropism::simulation::Simulation;
use tropism::systems;

fn scene(mesh_size: f64, matrix: Value) -> Value {
    json!({
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": mesh_size },
        "time": { "duration": 6, "step": "6 min" },
        "populations": { "axons": { "count": 1, "births": { "at": 0 } } },
        "matrix": matrix
    })
}

fn with_mesh(mut matrix: Value, mesh_size: f64) -> Value {
    matrix["mesh_size"] = json!(mesh_size);
    matrix
}

/// Where the vertices of the tissue are half way, and how fast they are.
fn half_way(scene: &Value) -> Vec<[f64; 4]> {
    let mut simulation = assembled(scene, &systems::standard());
    simulation.look_at(3.0);
    let now = simulation.world().resource::<Configuration>();
    now.coordinates().iter().zip(&*now.velocities()).map(|(x, v)| [x[0], x[1], v[0], v[1]]).collect()
}

/// Root mean square of the distance between vertices, in the places `part` names (0 and 1: position, 2 and 3: velocity).
fn apart(a: &[[f64; 4]], b: &[[f64; 4]], part: [usize; 2]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squared = |(a, b): (&[f64; 4], &[f64; 4])| part.iter().map(|&k| (a[k] - b[k]).powi(2)).sum::<f64>();
    (a.iter().zip(b).map(squared).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn an_affine_stretch_is_the_same_on_any_mesh() {
    let motion = json!({ "outward": 0.2, "sideways": "sliding" });
    let matrix = json!({ "motion": { "top": motion, "bottom": motion }, "tolerance": 1e-10 });
    let same = half_way(&scene(20.0, matrix.clone()));
    for mesh_size in [7.0, 20.0, 55.0, 130.0] {
        let own = half_way(&scene(20.0, with_mesh(matrix.clone(), mesh_size)));
        // One vertex holds the block sideways: that of either mesh which the edges name first, both on the same corner.
        let worst = apart(&own, &same, [0, 1]).max(apart(&own, &same, [2, 3]));
        assert!(worst < 1e-7, "{mesh_size}: {worst:e} um");
    }
}

#[test]
fn a_block_with_held_ends_converges_with_the_mesh_of_the_matrix() {
    let matrix = json!({ "tolerance": 1e-8 });
    let fine = half_way(&scene(10.0, with_mesh(matrix.clone(), 2.5)));
    for part in [[0, 1], [2, 3]] {
        let errors = [40.0, 20.0, 10.0]
            .map(|mesh_size| apart(&half_way(&scene(10.0, with_mesh(matrix.clone(), mesh_size))), &fine, part));
        println!("places {part:?}: {errors:.4?} um or um/h, order {:.2}", fitted_order(&errors));
        // Not 2: where a held end meets a free side displacements go with the power 0.71 of the distance (Williams 1952, Poisson ratio 0.3),
        // which lets P1 converge with twice that power.
        assert!((fitted_order(&errors) - 1.42).abs() < 0.2, "{errors:?}");
    }
}

#[test]
fn regions_that_grow_do_so_on_a_mesh_of_their_own_too() {
    let half = [[0, 0], [150, 0], [150, 200], [0, 200]];
    let growing = json!({ "growth": { "regions": [{ "factor": 1.3, "shape": { "polygon": { "points": half } } }] } });
    let fine = half_way(&scene(12.0, growing.clone()));
    let own = half_way(&scene(12.0, with_mesh(growing, 24.0)));
    let rest = half_way(&scene(12.0, json!({ "motion": { "top": {} } })));
    // Free bodies may lie anywhere: lengths are compared.
    let width = |at: &[[f64; 4]]| {
        let x = || at.iter().map(|at| at[0]);
        x().fold(f64::NEG_INFINITY, f64::max) - x().fold(f64::INFINITY, f64::min)
    };
    assert!(
        (width(&own) - width(&fine)).abs() < 0.01 * (width(&fine) - width(&rest)),
        "{} {}",
        width(&own),
        width(&fine)
    );
}

#[test]
fn what_a_mesh_of_its_own_cannot_be_is_told_with_its_place() {
    let roster = systems::standard();
    // The last is refused by what the scene allows: a finer mesh than the tissue's needs more vertices.
    for mesh_size in [1e-3, 0.0, -5.0, 1.0] {
        let mut scene = scene(20.0, json!({ "mesh_size": mesh_size }));
        scene["tissue"]["max_vertices"] = json!(1000);
        let loaded = try_load(&scene, &roster, &[], &[]);
        let refused = match loaded {
            Err(errors) => errors.to_string(),
            Ok(loaded) => Simulation::assemble(&loaded, &roster).map(|_| ()).unwrap_err().to_string(),
        };
        assert!(refused.contains("/matrix/mesh_size"), "{mesh_size}: {refused}");
    }
}
