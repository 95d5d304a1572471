//! Provider: the concentration of each cue, eq. (2).
//!
//! −DΔc + kc = Σ_j q 1_{A_j} in Ω_M(t), ∂c/∂n = 0: stationary, so c depends on the load of the tissue alone. It is solved at
//! load levels that an error check chooses and interpolated between them by cubic Hermite polynomials, with the exact dc/ds;
//! once in a tissue at rest; never for a cue that no mechanism reads. What cones sample is the concentration and, unless a key
//! says otherwise, a *recovered*, continuous gradient. Ours: numbers, linear elements with lumped mass by default, sources that
//! ride the tissue and release per current area.

use super::matrix::Loading;
use crate::model::observables::{Observable, Observables};
use crate::numerics::field_path::{self, FieldPath, FieldProblem, FieldSolvers, Order};
use crate::numerics::hermite::Refinement;
use crate::numerics::reaction_diffusion::{Mass as MassMatrix, ReactionDiffusion};
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What stays the same of a source while the tissue deforms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Release {
    /// q per current area: a source that grows releases more.
    PerArea,
    /// Σ q |A_j|, as at rest: q falls as the source grows.
    Total,
}

/// What moves a cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Transport {
    /// It diffuses: in equilibrium with its sources at every instant.
    Diffusing,
    /// It is bound to the matrix: distributed as at rest, then carried by the tissue and diluted by it, c = c₀/J.
    Bound,
}

/// How the degradation term is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mass {
    /// At the vertices: keeps c ≥ 0 on a Delaunay mesh.
    Lumped,
    /// Exactly: smaller error where the mesh resolves √(D/k), undershoots where it does not.
    Consistent,
}

/// Order of the finite elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Element {
    /// P1: c of order 2, its own gradient of order 1.
    Linear,
    /// P2: c of order 3, its own gradient of order 2, four times the unknowns on the same mesh.
    Quadratic,
}

/// What cones sample as the gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gradient {
    /// A continuous one, made from the values around.
    Recovered,
    /// The element's own, which jumps from cell to cell.
    Raw,
}

keys! {
    /// One diffusible cue.
    pub struct Cue {
        /// Diffusivity D. Source: Nodal in zebrafish.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [144.0, 216000.0]))]
        pub diffusion: Diffusivity = Diffusivity(108_000.0),
        /// Degradation rate k; decay length ℓ = √(D/k).
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.36, 18.0]))]
        pub degradation: Rate = Rate(3.6),
        /// Release rate q inside the sources; c → q/k deep inside one. Absent: 50 k · 1 nM. Ours.
        #[schemars(extend("minimum" = 0.0))]
        pub release_rate: Option<ReleaseRate> = None,
        /// What stays the same of the release while the tissue deforms. Ours.
        pub release: Release = Release::PerArea,
        /// What moves it once the tissue deforms. Ours.
        pub transport: Transport = Transport::Diffusing,
        /// How degradation is integrated. Absent: `lumped` for linear elements, `consistent` for quadratic ones, which know no
        /// other. Ours.
        pub mass: Option<Mass> = None,
        /// Order of the finite elements. Ours.
        pub element: Element = Element::Linear,
        /// What cones sample as the gradient. Ours.
        pub gradient: Gradient = Gradient::Recovered,
        /// Where it is released.
        #[schemars(length(min = 1))]
        pub sources: Vec<Shape> = Vec::new(),
    }
}

/// The diffusible cues of a scene, by name (eq. 2); −DΔc + kc = Σ q 1_A in Ω_M(t).
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Cues(pub BTreeMap<String, Cue>);

/// Largest error of the interpolated gradients between load levels: relative, root mean square over the vertices. Ours; well
/// below the error of the gradients themselves.
const LEVEL_TOLERANCE: f64 = 1e-3;
/// Cap on the load levels of a cue.
const MOST_LEVELS: usize = 65;

impl Mechanism for Cues {
    const NAME: &'static str = "cues";

    fn check(&self, _facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        for (name, cue) in &self.0 {
            wrong.demand(!cue.sources.is_empty(), &format!("/{name}/sources"), || {
                "a cue needs at least one source, such as {\"disc\": {\"centre\": [400, 540], \"radius\": 50}}".into()
            });
            let lumped = cue.element == Element::Quadratic && cue.mass == Some(Mass::Lumped);
            wrong.demand(!lumped, &format!("/{name}/mass"), || {
                "quadratic elements have no lumped mass (it would be zero at the vertices); leave `mass` out, or take linear elements".into()
            });
            let bound = cue.transport == Transport::Bound && cue.element == Element::Quadratic;
            wrong.demand(!bound, &format!("/{name}/element"), || {
                "a cue that is bound to the matrix takes linear elements".into()
            });
            for (i, shape) in cue.sources.iter().enumerate() {
                if let Err(found) = shape.check() {
                    wrong.extend_under(&format!("/{name}/sources/{i}"), found);
                }
            }
        }
        wrong
    }

    fn outlines(&self) -> Vec<(String, Shape)> {
        let of = |(name, cue): (&String, &Cue)| {
            let name = name.clone();
            cue.sources.clone().into_iter().enumerate().map(move |(i, shape)| (region(&name, i), shape))
        };
        self.0.iter().flat_map(of).collect()
    }

    fn mesh_errors(&self, tissue: &Tissue) -> Result<Vec<f64>, InstallError> {
        let mut solvers = FieldSolvers::new(&tissue.mesh, tissue.regions.values().cloned().collect());
        let mut worst = vec![0.0; tissue.mesh.cell_count()];
        for (name, cue) in &self.0 {
            let errors = problem(tissue, (name, cue), &tissue.mesh).gradient_errors(&mut solvers);
            let errors = errors.map_err(|error| failed(name, error))?;
            worst.iter_mut().zip(errors).for_each(|(worst, error)| *worst = error.max(*worst));
        }
        Ok(worst)
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self).at_end(solve_demanded);
        model.term(Term::Fields, bring_fields);
        Ok(())
    }
}

/// Name of the mesh region of a cue's source.
fn region(cue: &str, source: usize) -> String {
    format!("cues/{cue}/sources/{source}")
}

/// Concentration and gradient of a cue at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CueSample {
    /// Concentration c (nM), never negative.
    pub concentration: f64,
    /// Gradient ∇c (nM/µm), spatial.
    pub gradient: Vector3<f64>,
}

/// a K_d |∇c|/(K_d + c)² at 10 % per 10 µm across 10 µm and c = K_d.
const OCCUPANCY_REFERENCE: f64 = 0.025;

impl CueSample {
    /// The difference in receptor occupancy across a cone of length a (µm) with dissociation constant K_d (nM), along each
    /// axis, a K_d ∇c/(K_d + c)², over its size at 10 % per 10 µm across 10 µm and c = K_d.
    pub fn occupancy_difference(&self, dissociation: f64, length: f64) -> Vector3<f64> {
        let total = dissociation + self.concentration;
        self.gradient * (length * dissociation / (total * total * OCCUPANCY_REFERENCE))
    }
}

/// What is solved before the run, and shared by runs whose tissue, matrix and demanded cues are equal.
#[derive(Debug, Default)]
struct Solved {
    fields: Vec<FieldPath>,
    solves: usize,
    factorisations: usize,
}

/// The cue fields that mechanisms asked for, in the present configuration.
#[derive(Debug, Resource, Default)]
pub struct CueFields {
    names: Vec<String>,
    solved: Arc<Solved>,
    current: Vec<Vec<f64>>,
    load: Option<f64>,
}

impl CueFields {
    /// Asks for a cue by name at installation.
    pub fn demand(model: &mut ModelBuilder, cue: &str) {
        model.demand(Cues::NAME, cue);
    }

    /// Number of a cue, under which it is sampled.
    pub fn index(&self, cue: &str) -> Option<usize> {
        self.names.iter().position(|name| name == cue)
    }

    /// [`Self::index`] once all fields are solved; `pointer` is the place that names the cue.
    ///
    /// # Errors
    /// A cue that has no field.
    pub fn number(world: &World, cue: &str, pointer: &str) -> Result<usize, InstallError> {
        let number = world.get_resource::<Self>().and_then(|fields| fields.index(cue));
        number.ok_or_else(|| InstallError::Scenario(Violation::new(pointer, "this cue has no field")))
    }

    /// Concentration and gradient of cue `index` at a site.
    #[inline]
    pub fn sample(&self, mesh: &SimplexMesh<2>, index: usize, site: Site) -> CueSample {
        self.sample_from(mesh, index, &self.current[index], site)
    }

    #[inline]
    fn sample_from(&self, mesh: &SimplexMesh<2>, index: usize, values: &[f64], site: Site) -> CueSample {
        let [second, third, _] = site.weights;
        let place = (site.cell as usize, [1.0 - second - third, second, third]);
        let (c, gradient) = self.solved.fields[index].layout.sample(mesh, values, place);
        CueSample { concentration: c.max(0.0), gradient: Vector3::new(gradient[0], gradient[1], 0.0) }
    }

    fn bring_to(&mut self, load: f64) {
        if self.load != Some(load) {
            for (field, values) in self.solved.fields.iter().zip(&mut self.current) {
                field.path.evaluate(load, values);
            }
            self.load = Some(load);
        }
    }

    /// The values of a field at a load: those in use, or interpolated anew where another load was last brought.
    fn at(&self, index: usize, load: f64) -> Cow<'_, [f64]> {
        if self.load == Some(load) {
            return Cow::Borrowed(&self.current[index]);
        }
        let path = &self.solved.fields[index].path;
        let mut values = vec![0.0; path.components()];
        path.evaluate(load, &mut values);
        Cow::Owned(values)
    }
}

fn bring_fields(configuration: Res<Configuration>, mut fields: ResMut<CueFields>) {
    fields.bring_to(configuration.load);
}

fn read_concentration(world: &World, index: usize) -> Vec<f64> {
    let (fields, vertices) = (world.resource::<CueFields>(), world.resource::<Tissue>().mesh.vertex_count());
    let values = fields.at(index, world.resource::<Configuration>().load);
    fields.solved.fields[index].layout.concentrations(&values).take(vertices).map(|c| c.max(0.0)).collect()
}

fn read_sample(world: &World, index: usize, site: Site) -> (f64, Vector3<f64>) {
    let fields = world.resource::<CueFields>();
    let values = fields.at(index, world.resource::<Configuration>().load);
    let sample = fields.sample_from(&world.resource::<Tissue>().mesh, index, &values, site);
    (sample.concentration, sample.gradient)
}

fn solve_demanded(world: &mut World) -> Result<(), InstallError> {
    let cues = world.resource::<Law<Cues>>().0.0.clone();
    let demanded = world.resource::<Demands>().of(Cues::NAME);
    for name in cues.keys().filter(|name| !demanded.contains(name)) {
        world.resource_mut::<Plan>().leave_out(format!("cue `{name}`"), "no mechanism reads it");
    }
    let chosen: Vec<(&str, &Cue)> =
        demanded.iter().filter_map(|name| cues.get_key_value(name)).map(|(name, cue)| (name.as_str(), cue)).collect();
    let moved = world.get_resource::<Loading>().map_or("at rest", Loading::inputs);
    let inputs = format!("{} {moved} {chosen:?}", world.resource::<Tissue>().inputs);
    let (solved, new) = world.resource::<Shelf>().take(&inputs, || solve(world, &chosen))?;
    for (index, ((name, cue), field)) in chosen.iter().zip(&solved.fields).enumerate() {
        let name = (*name).to_owned();
        report(world, (&name, cue), field);
        let observable = Observable { name, index, read: read_concentration, sample: read_sample };
        world.resource_mut::<Observables>().fields.push(observable);
    }
    if new {
        let mut counters = world.resource_mut::<Counters>();
        counters.cue_solves += solved.solves as u64;
        counters.cue_factorisations += solved.factorisations as u64;
    }
    let names = chosen.into_iter().map(|(name, _)| name.to_owned()).collect();
    let current = solved.fields.iter().map(|field| vec![0.0; field.path.components()]).collect();
    world.insert_resource(CueFields { names, solved, current, load: None });
    Ok(())
}

/// Solves cues, one after the other.
fn solve(world: &World, cues: &[(&str, &Cue)]) -> Result<Solved, InstallError> {
    let tissue = world.resource::<Tissue>();
    let (mesh, rest) = (&*tissue.mesh, tissue.mesh.vertices());
    let goal = Refinement { tolerance: LEVEL_TOLERANCE, max_levels: MOST_LEVELS };
    let mut solvers = FieldSolvers::new(mesh, tissue.regions.values().cloned().collect());
    let mut field = |(name, cue): &(&str, &Cue)| {
        let problem = problem(tissue, (name, cue), mesh);
        match world.get_resource::<Loading>() {
            None => problem.solve(&mut solvers, None, goal),
            Some(loading) => problem.solve(&mut solvers, Some(&|load| loading.configuration(rest, load)), goal),
        }
        .map_err(|error| failed(name, error))
    };
    let fields = cues.iter().map(&mut field).collect::<Result<_, _>>()?;
    let work = solvers.work();
    Ok(Solved { fields, solves: work.solves, factorisations: work.factorisations })
}

/// Notes what a cue took and where it falls short.
fn report(world: &mut World, (name, cue): (&str, &Cue), field: &FieldPath) {
    let mesh = Arc::clone(&world.resource::<Tissue>().mesh);
    let problem = problem(world.resource::<Tissue>(), (name, cue), &mesh);
    note(&mut world.resource_mut::<Health>(), name, field);
    let (levels, unknowns) = (field.path.levels().len(), field.unknowns());
    let times = if levels == 1 { "once".to_owned() } else { format!("at {levels} load levels") };
    let kind = if problem.order == Order::Quadratic { " of quadratic elements" } else { "" };
    let mut plan = world.resource_mut::<Plan>();
    plan.keep(format!("cue `{name}`"), format!("read; {unknowns} unknowns{kind}, solved {times}"));
    tell_margins(&mut plan, name, &problem, field);
    let part = format!("cue `{name}`");
    let current = size_of::<f64>() * field.path.components();
    plan.hold(&part, (field.path.bytes() + current) as f64, Each::Run);
    plan.work(&part, Work::FieldUnknown, (levels * unknowns) as f64, Each::Run);
    if levels > 1 {
        plan.work(&part, Work::Interpolated, field.path.components() as f64, Each::Stage);
    }
}

fn failed(cue: &str, error: impl std::fmt::Display) -> InstallError {
    InstallError::Solve(format!("cue `{cue}` (eq. 2): {error}"))
}

/// The cue as a problem of numerics.
fn problem<'m>(tissue: &Tissue, (name, cue): (&str, &Cue), mesh: &'m SimplexMesh<2>) -> FieldProblem<'m> {
    let (order, usual) = match cue.element {
        Element::Linear => (Order::Linear, Mass::Lumped),
        Element::Quadratic => (Order::Quadratic, Mass::Consistent),
    };
    let mass = match cue.mass.unwrap_or(usual) {
        Mass::Lumped => MassMatrix::Lumped,
        Mass::Consistent => MassMatrix::Consistent,
    };
    let gradient = match cue.gradient {
        Gradient::Recovered => field_path::Gradient::Recovered,
        Gradient::Raw => field_path::Gradient::Raw,
    };
    let cells = |i: usize| tissue.regions.get(&region(name, i)).cloned().unwrap_or_default();
    FieldProblem {
        mesh,
        equation: ReactionDiffusion { diffusion: cue.diffusion.0, degradation: cue.degradation.0, mass },
        order,
        gradient,
        sources: (0..cue.sources.len()).map(cells).collect(),
        release_rate: cue.release_rate.map_or(50.0 * cue.degradation.0, |q| q.0),
        bound: cue.transport == Transport::Bound,
        keeps_total: cue.release == Release::Total,
    }
}

/// Edges may be this much longer than advised: meshes come out a little coarser than asked for.
const LENIENCE: f64 = 1.2;

/// Compares the mesh with the decay length ℓ = √(D/k), of which an edge should take a quarter (half of it with quadratic elements,
/// whose nodes are twice as close), and with what the discrete maximum principle asks for.
fn tell_margins(plan: &mut Plan, name: &str, problem: &FieldProblem, field: &FieldPath) {
    let decay_length = problem.equation.decay_length();
    plan.derive(format!("cue `{name}`: decay length"), decay_length, "um");
    let edge = mean_edge(problem.mesh);
    let (share, words) = if problem.order == Order::Linear { (0.25, "a quarter") } else { (0.5, "half") };
    plan.compare(
        format!("cue `{name}`: edge length over {words} of the decay length"),
        edge / (share * decay_length),
        LENIENCE,
        format!(
            "a finer mesh: edges of about {edge:.3} um are long for a decay length of {decay_length:.3} um; {words} is advised"
        ),
    );
    let Some(monotonicity) = field.monotonicity else {
        let why = "quadratic elements do not keep it on any mesh";
        return plan.leave_out(format!("cue `{name}`: discrete maximum principle"), why);
    };
    plan.bound(
        format!("cue `{name}`: Delaunay, largest angles that face an edge over pi"),
        monotonicity.angles,
        1.0,
        "less motion, or a finer mesh at the rims of sources and of the tissue, whose edges are not flipped",
    );
    if problem.equation.mass == MassMatrix::Consistent {
        plan.compare(
            format!("cue `{name}`: maximum principle, consistent mass over diffusion at an edge"),
            monotonicity.consistent_mass,
            1.0,
            "`lumped` mass, or a finer mesh; undershoots are sensed as zero",
        );
    }
}

/// Edge (µm) of an equilateral triangle as large as the mean cell at rest.
fn mean_edge(mesh: &SimplexMesh<2>) -> f64 {
    let areas = (0..mesh.cell_count()).map(|cell| mesh.volume(mesh.vertices(), cell)).sum::<f64>();
    (areas / mesh.cell_count() as f64 * 4.0 / 3f64.sqrt()).sqrt()
}

fn note(health: &mut Health, name: &str, field: &FieldPath) {
    let (path, report) = (&field.path, field.report);
    if let Some(load) = field.flipped_from {
        health.note(format!(
            "cue `{name}`: by load {load:.3} the tissue's mesh is no longer Delaunay; edges are flipped for its field (vertices stay)"
        ));
    }
    if !report.met {
        let (levels, defect) = (path.levels().len(), report.worst_defect);
        health.note(format!("cue `{name}`: {levels} load levels were not enough; gradients are within {defect:.1e}"));
    }
    let nodes = path.levels().iter().flat_map(|level| field.layout.concentrations(&level.value));
    let lowest = nodes.fold(0.0f64, |lowest, c| lowest.min(c));
    if lowest < 0.0 {
        health.note(format!("cue `{name}`: the discrete concentration falls to {lowest:.2e} nM; zero is sensed there"));
    }
}
