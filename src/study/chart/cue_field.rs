//! The cue fields' chart: element, gradient, mass and mesh size against the errors of c, ∇c and heading.

use super::work_precision::{ErrorKind, Factor, short};
use crate::model::observables::Observables;
use crate::model::tissue::Tissue;
use crate::scenario::load::Loaded;
use crate::simulation::Simulation;
use crate::study::laboratory::{Laboratory, Setting, angle_between, root_mean_square, spread_points};
use crate::study::run::RunError;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Mesh sizes over the scene's own: two decades of unknowns.
const SIZES: [f64; 8] = [2.0, 1.414, 1.0, 0.707, 0.5, 0.354, 0.25, 0.177];
/// The finest mesh for quadratic elements, which have four times the unknowns.
const FINEST_QUADRATIC: f64 = 0.35;
/// Mesh of the reference, quadratic.
const REFERENCE: f64 = 0.177;
/// The reference is judged by the same with this mesh.
const SECOND: f64 = 0.25;
const POINTS: usize = 10_000;
/// A relative change of the concentration over a cone (1/µm) below which nothing is sensed: 1 % over 10 µm.
const SENSED: f64 = 1e-3;
/// Method, element, gradient, mass.
const METHODS: [(&str, &str, &str, &str); 5] = [
    ("P1, raw gradient", "linear", "raw", "lumped"),
    ("P1, recovered, lumped", "linear", "recovered", "lumped"),
    ("P1, recovered, consistent", "linear", "recovered", "consistent"),
    ("P2", "quadratic", "recovered", "consistent"),
    (REFINED, "linear", "recovered", "lumped"),
];
/// The method whose mesh is refined locally: from a size four times as large, to a tolerance in proportion to it.
const REFINED: &str = "P1, recovered, refined";
const COARSER: f64 = 4.0;
const TOLERANCE: f64 = 0.1;

/// What a cone would sense at each point, for each cue.
type Sensed = Vec<Vec<(f64, Vector3<f64>)>>;

/// Error of the cue fields against the time for mesh and solves, in the tissue at rest; none in a scene that reads no cue.
///
/// # Errors
/// A scene that cannot be assembled.
pub fn chart(laboratory: &Laboratory, tick: &dyn Fn(f64)) -> Result<Option<Factor>, RunError> {
    let scene = laboratory.scene()?;
    let without: &[&str] = if scene.blocks.contains_key("matrix") { &["matrix"] } else { &[] };
    let at_rest = laboratory.load(without, &[])?;
    let own = laboratory.assemble(&at_rest)?;
    if own.world().resource::<Observables>().fields.is_empty() {
        return Ok(None);
    }
    let points = spread_points(&at_rest, &own, POINTS);
    let exact_at = |size: f64| {
        let set = keys(&scene, size, METHODS[3]);
        Ok::<_, RunError>(sensed(&laboratory.assemble(&laboratory.load(without, &set)?)?, &points))
    };
    let exact = exact_at(REFERENCE)?;
    let floor = errors(&exact_at(SECOND)?, &exact);
    let settings: Vec<Setting> = METHODS
        .iter()
        .flat_map(|method| SIZES.map(|size| setting(&scene, size, *method)))
        .filter(|(quadratic, size, _)| !quadratic || *size >= FINEST_QUADRATIC)
        .map(|(_, _, setting)| setting)
        .collect();
    let mut found = Vec::new();
    for (done, setting) in settings.iter().enumerate() {
        tick(done as f64 / settings.len() as f64);
        let loaded = laboratory.load(without, &setting.set)?;
        let (simulation, seconds) = laboratory.timed_assembly(&loaded, &["mesh", "cues"])?;
        let mesh = &simulation.world().resource::<Tissue>().mesh;
        let counts = [("vertices", mesh.vertex_count()), ("cells", mesh.cell_count())];
        let counts = counts.map(|(name, count)| (name.to_owned(), count as f64)).into();
        found.push(setting.point(seconds, errors(&sensed(&simulation, &points), &exact), counts));
    }
    let kind = |(name, label, order): &(&str, &str, i32)| ErrorKind {
        name: (*name).to_owned(),
        label: (*label).to_owned(),
        // What two meshes differ by, shared out by the order of the method.
        floor: floor[*name] / ((SECOND / REFERENCE).powi(*order) - 1.0),
        levels: BTreeMap::new(),
    };
    let remark = format!(
        "Tissue at rest; worst of the cues; {} points spread evenly, at which squares are averaged (L2, and H1 for gradients); time for \
         mesh and solves. Headings are compared where c changes by more than 1 % over 10 um. Reference: P2 with {} of the mesh size.",
        points.len(),
        short(REFERENCE)
    );
    Ok(Some(Factor {
        name: "cue_field".into(),
        title: "Cue fields".into(),
        knob: "mesh size (um)".into(),
        errors: KINDS.iter().map(kind).collect(),
        points: found,
        remark,
        advice: String::new(),
    }))
}

/// Name, label, and order of the reference; cones turn by the direction, which is why it comes first.
const KINDS: [(&str, &str, i32); 4] = [
    ("heading", "rms error of the gradient's direction (degrees)", 2),
    ("gradient", "relative L2 error of the gradient", 2),
    ("concentration", "relative L2 error of c", 3),
    ("gradient_at_points", "rms over points of the gradient's relative error", 2),
];

fn setting(scene: &Loaded, size: f64, method: (&str, &str, &str, &str)) -> (bool, f64, Setting) {
    let mesh_size = size * scene.scene.tissue.mesh_size.0;
    let setting = Setting {
        method: method.0.to_owned(),
        words: format!("mesh size {} um", short(mesh_size)),
        knob: mesh_size,
        set: keys(scene, size, method),
        default: size == 1.0 && method.0 == METHODS[1].0,
    };
    (method.1 == "quadratic", size, setting)
}

fn keys(scene: &Loaded, size: f64, (name, element, gradient, mass): (&str, &str, &str, &str)) -> Vec<String> {
    let cues = scene.merged.get("cues").and_then(serde_json::Value::as_object);
    let names = cues.into_iter().flat_map(|cues| cues.keys());
    let of_cue = |name: &String| {
        let at = format!("/cues{}", crate::model::violation::pointer_token(name));
        [format!("{at}/element={element}"), format!("{at}/gradient={gradient}"), format!("{at}/mass={mass}")]
    };
    let own = size * scene.scene.tissue.mesh_size.0;
    let mesh = if name == REFINED {
        let (tolerance, size) = (TOLERANCE * size, COARSER * own);
        vec![
            format!("/tissue/mesh_size={size:e}"),
            format!("/tissue/refinement/tolerance={tolerance:e}"),
            "/tissue/refinement/levels=8".to_owned(),
        ]
    } else {
        vec![format!("/tissue/mesh_size={own:e}"), "/tissue/refinement=null".to_owned()]
    };
    names.flat_map(of_cue).chain(mesh).collect()
}

fn sensed(simulation: &Simulation, points: &[[f64; 2]]) -> Sensed {
    let world = simulation.world();
    let tissue = world.resource::<Tissue>();
    let sites: Vec<_> = points.iter().map(|point| tissue.locate(*point)).collect();
    let none = (f64::NAN, Vector3::repeat(f64::NAN));
    let fields = &world.resource::<Observables>().fields;
    let at = |field: &crate::model::observables::Observable| {
        sites.iter().map(|site| site.map_or(none, |site| (field.sample)(world, field.index, site))).collect()
    };
    fields.iter().map(at).collect()
}

/// The worst of the cues, for each error.
fn errors(found: &Sensed, exact: &Sensed) -> BTreeMap<String, f64> {
    let of_cue = |(found, exact): (&Vec<_>, &Vec<_>)| errors_of_cue(found, exact);
    let worst =
        found.iter().zip(exact).map(of_cue).fold([0.0f64; 4], |worst, one| [0, 1, 2, 3].map(|k| worst[k].max(one[k])));
    KINDS.iter().zip(worst).map(|((name, _, _), value)| ((*name).to_owned(), value)).collect()
}

fn errors_of_cue(found: &[(f64, Vector3<f64>)], exact: &[(f64, Vector3<f64>)]) -> [f64; 4] {
    let pairs = || found.iter().zip(exact);
    let relative = |difference: f64, size: f64| if size > 0.0 { difference / size } else { difference };
    let gradient = root_mean_square(pairs().map(|(a, b)| (a.1 - b.1).norm()));
    let concentration = root_mean_square(pairs().map(|(a, b)| a.0 - b.0));
    let felt = || pairs().filter(|(_, b)| b.1.norm() > SENSED * b.0);
    let heading = root_mean_square(felt().map(|(a, b)| angle_between(&a.1, &b.1)));
    [
        heading,
        relative(gradient, root_mean_square(exact.iter().map(|b| b.1.norm()))),
        relative(concentration, root_mean_square(exact.iter().map(|b| b.0))),
        root_mean_square(felt().map(|(a, b)| (a.1 - b.1).norm() / b.1.norm())),
    ]
}
