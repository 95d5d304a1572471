//! The degenerate scenes: one cone or two in a small tissue, each with one thing at the rim of what makes sense.

use serde_json::{Value, json};

/// A scene and what it is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// What is degenerate.
    pub about: &'static str,
    /// The scene.
    pub scene: Value,
}

/// A cone at the middle of a tissue of 200 × 150 µm, for 8 h in steps of 3 min, with keys replaced by `patch`.
fn case(name: &'static str, about: &'static str, patch: Value) -> Case {
    let mut scene = json!({
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": 15 },
        "time": { "duration": 8, "step": "3 min" },
        "populations": {
            "cone": { "count": 1, "births": { "at": 0 }, "origin": { "points": [[100, 75]] }, "heading": 30 }
        },
        "output": { "figure_times": [1], "trajectory_interval": "3 min" }
    });
    lay_over(&mut scene, patch);
    Case { name, about, scene }
}

/// Objects are merged key by key; anything else replaces what was there.
fn lay_over(below: &mut Value, above: Value) {
    match (below, above) {
        (Value::Object(below), Value::Object(above)) => {
            above.into_iter().for_each(|(key, value)| lay_over(below.entry(key).or_insert(Value::Null), value));
        }
        (below, above) => *below = above,
    }
}

/// All scenes.
pub fn scenes() -> Vec<Case> {
    [gradients(), places(), borders(), growth(), matrices(), refusals()].concat()
}

/// A cue released over a shape, sensed by a law.
fn sensed(diffusion: &str, mass: &str, sensing: &str, shape: Value) -> Value {
    json!({
        "cues": { "attractant": { "diffusion": diffusion, "mass": mass, "sources": [shape] } },
        "chemotaxis": { "sensing": sensing, "receptors": { "attractant": {} } }
    })
}

fn disc() -> Value {
    json!({ "disc": { "centre": [100, 75], "radius": 15 } })
}

fn gradients() -> Vec<Case> {
    let everywhere = || json!({ "polygon": { "points": [[0, 0], [200, 0], [200, 150], [0, 150]] } });
    let aside = || json!({ "disc": { "centre": [30, 30], "radius": 15 } });
    let wide = "2.5 um^2/s";
    let mut noisy = sensed(wide, "lumped", "direction", disc());
    noisy["heading_noise"] = json!({});
    vec![
        case("source_maximum", "born on the source's maximum", sensed(wide, "lumped", "occupancy", disc())),
        case(
            "source_maximum_direction",
            "the same, sensing the direction",
            sensed(wide, "lumped", "direction", disc()),
        ),
        case("source_maximum_noise", "the same, with heading noise", noisy),
        case("zero_gradient", "the whole tissue releases", sensed(wide, "lumped", "occupancy", everywhere())),
        case(
            "zero_gradient_direction",
            "the same, sensing the direction",
            sensed(wide, "lumped", "direction", everywhere()),
        ),
        case(
            "zero_gradient_noise",
            "the same, by signal to noise",
            sensed(wide, "lumped", "signal_to_noise", everywhere()),
        ),
        case("underflow", "a concentration that underflows", sensed("1e-9 um^2/s", "lumped", "direction", aside())),
        case(
            "coarse_consistent",
            "decay within a cell, consistent mass",
            sensed("0.01 um^2/s", "consistent", "occupancy", aside()),
        ),
        case(
            "coarse_lumped",
            "decay within a cell, lumped mass",
            sensed("0.01 um^2/s", "lumped", "occupancy", aside()),
        ),
    ]
}

fn places() -> Vec<Case> {
    let square = json!({ "cues": { "marker": {
        "sources": [{ "polygon": { "points": [[100, 75], [140, 75], [140, 110], [100, 110]] } }]
    } } });
    let at = |name, about, point: [f64; 2], heading: f64| {
        let mut patch = square.clone();
        patch["time"] = json!({ "duration": 3 });
        patch["populations"] = json!({ "cone": { "origin": { "points": [point] }, "heading": heading } });
        case(name, about, patch)
    };
    let two = |name, about, later: f64| {
        let population = |birth: f64| json!({ "count": 1, "births": { "at": birth }, "origin": { "points": [[40, 75]] }, "heading": 0 });
        let mut two = case(name, about, json!({ "fasciculation": {}, "time": { "duration": 6 } }));
        two.scene["populations"] = json!({ "first": population(0.0), "second": population(later) });
        two
    };
    vec![
        at("on_vertex", "born on a vertex, along an edge of the mesh", [100.0, 75.0], 0.0),
        at("on_edge", "born on an edge, along it", [120.0, 75.0], 0.0),
        at("across_vertex", "through a vertex of the mesh", [90.0, 65.0], 45.0),
        two("coincident_together", "two shafts in one place, grown together", 0.0),
        two("coincident_later", "a cone that follows a shaft from the same point", 2.0),
    ]
}

/// The three rules at the border.
const RULES: [&str; 3] = ["slide", "stall", "leave"];

fn borders() -> Vec<Case> {
    let start = |point: [f64; 2], heading: f64, rule: &str| {
        json!({
            "growth": { "on_border": rule },
            "populations": { "cone": { "origin": { "points": [point] }, "heading": heading } }
        })
    };
    let mut cases = Vec::new();
    let corner = ["corner_slide", "corner_stall", "corner_leave"];
    let outward = ["outward_slide", "outward_stall", "outward_leave"];
    let endless = ["endless_step_slide", "endless_step_stall", "endless_step_leave"];
    for (i, rule) in RULES.into_iter().enumerate() {
        cases.push(case(corner[i], "straight into a corner", start([180.0, 130.0], 45.0, rule)));
        cases.push(case(outward[i], "born on the border, heading out", start([100.0, 0.0], -90.0, rule)));
        let mut patch = start([100.0, 75.0], 30.0, rule);
        patch["time"] = json!({ "duration": 300, "step": 100 });
        cases.push(case(endless[i], "steps ten times longer than the tissue", patch));
    }
    cases
}

fn growth() -> Vec<Case> {
    let attracted = sensed("2.5 um^2/s", "lumped", "occupancy", disc());
    let mut still = attracted.clone();
    lay_over(
        &mut still,
        json!({ "populations": { "cone": { "speed": 0 } }, "heading_noise": {}, "fasciculation": {}, "borders": {} }),
    );
    let mut wild = json!({ "constant_pull": {}, "growth": { "turning_rate": 200 } });
    wild["time"] = json!({ "method": "euler" });
    let away = json!({ "constant_pull": {}, "populations": { "cone": { "heading": 180 } } });
    vec![
        case("speed_zero", "a cone that does not grow, with every mechanism", still),
        case("unstable_euler", "Euler at κΔt = 10", wild),
        case("facing_away", "exactly away from the pull", away),
        case("no_axons", "a population of none", json!({ "populations": { "cone": { "count": 0 } } })),
        case("one_cell", "a mesh size larger than the tissue", json!({ "tissue": { "mesh_size": 1000 } })),
    ]
}

fn matrices() -> Vec<Case> {
    let moved = |material: &str, outward: f64, sideways: &str| {
        let edge = json!({ "outward": outward, "sideways": sideways });
        json!({ "matrix": { "material": material, "motion": { "top": edge, "bottom": edge } } })
    };
    let mut stretched = sensed("0.1 um^2/s", "lumped", "occupancy", disc());
    lay_over(&mut stretched, moved("st_venant_kirchhoff", 0.2, "held"));
    let svk = "st_venant_kirchhoff";
    vec![
        case("stretch", "20 % per side outward, with a cue", stretched),
        case("compression", "20 % per side inward, ends held", moved(svk, -0.2, "held")),
        case("compression_remedy", "the same, neo-Hookean", moved("neo_hookean", -0.2, "held")),
        case("buckling", "19 % per side inward, ends sliding", moved(svk, -0.19, "sliding")),
        case("flat", "45 % per side inward, neo-Hookean, ends sliding", moved("neo_hookean", -0.45, "sliding")),
    ]
}

fn refusals() -> Vec<Case> {
    let cue = |keys: Value| {
        let mut patch = sensed("2.5 um^2/s", "lumped", "occupancy", disc());
        lay_over(&mut patch["cues"]["attractant"], keys);
        patch
    };
    let outside = json!([{ "disc": { "centre": [195, 75], "radius": 15 } }]);
    vec![
        case("no_decay", "k = 0 without flux", cue(json!({ "degradation": 0 }))),
        case("no_diffusion", "D = 0", cue(json!({ "diffusion": 0 }))),
        case("source_outside", "a source across the border", cue(json!({ "sources": outside }))),
        case("incompressible", "ν = 0.5", json!({ "matrix": { "poisson_ratio": 0.5 } })),
        case("inside_out", "ends that would meet", json!({ "matrix": { "motion": { "top": { "outward": -0.5 } } } })),
        case("backward", "a negative speed", json!({ "populations": { "cone": { "speed": -20 } } })),
        case(
            "born_outside",
            "a place of birth outside",
            json!({ "populations": { "cone": { "origin": { "points": [[300, 75]] } } } }),
        ),
        case("no_time", "a step of nothing", json!({ "time": { "step": 0 } })),
    ]
}
