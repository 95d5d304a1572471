//! Provider: the concentration of each cue, eq. (2).
//!
//! −DΔc + kc = Σ_j q 1_{A_j} in Ω_M(t), ∂c/∂n = 0: stationary, so c depends on the load of the tissue alone. It is solved at
//! load levels that an error check chooses and interpolated between them by cubic Hermite polynomials, with the exact dc/ds;
//! once in a tissue at rest; never for a cue that no mechanism reads. What cones sample is the concentration and, unless a key
//! says otherwise, a *recovered*, continuous gradient. Ours: numbers, linear elements with lumped mass by default, sources that
//! ride the tissue and release per current area. A transient cue depends on time alone, not on cones: it is solved once, before the
//! run, as a path in time ([`crate::numerics::transient_field`]).

use super::cue_keys::region;
pub use super::cue_keys::{Cue, Element, Gradient, Mass, Release, Start, Transport};
use super::matrix::Loading;
use crate::model::observables::{Observable, Observables};
use crate::numerics::field_path::{Along, FieldPath, FieldPathError, FieldProblem, FieldSolvers, Order};
use crate::numerics::hermite::{HermiteWeights, Refinement};
use crate::numerics::reaction_diffusion::Mass as MassMatrix;
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::transient_field::solve_in_time;
use crate::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

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

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        for (name, cue) in &self.0 {
            wrong.extend_under(&format!("/{name}"), cue.check(&facts.mesh_extent));
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
            let errors = cue.problem(tissue, name, &tissue.mesh).gradient_errors(&mut solvers);
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

impl Cues {
    /// Demands that the scene has a cue, named at a place of a mechanism's block.
    pub(super) fn demand_known(facts: &Facts, wrong: &mut Violations, cue: &str, pointer: &str) {
        let known = facts.names_in(Self::NAME);
        wrong.demand(known.iter().any(|name| name == cue), pointer, || unknown_name("cue", cue, &known));
    }
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
    current: Vec<Current>,
}

/// A field at a parameter of its path: all its values at hand, or only where they are on the path.
#[derive(Debug)]
struct Current {
    parameter: Option<f64>,
    values: Vec<f64>,
    on_path: Option<HermiteWeights>,
}

/// Load of the tissue and time (h) at which fields are wanted.
#[derive(Debug, Clone, Copy)]
struct Moment {
    load: f64,
    time: f64,
}

impl Moment {
    fn of(world: &World) -> Self {
        Self { load: world.resource::<Configuration>().load, time: world.resource::<StageTime>().0 }
    }

    /// The parameter of a field's path.
    fn along(&self, field: &FieldPath) -> f64 {
        match field.along {
            Along::Load => self.load,
            Along::Time => self.time,
        }
    }
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
        let (Current { values, on_path, .. }, path) = (&self.current[index], &self.solved.fields[index].path);
        match on_path {
            None => self.sample_from(mesh, index, |i| values[i], site),
            Some(place) => self.sample_from(mesh, index, |i| path.value(place, i), site),
        }
    }

    #[inline]
    fn sample_from(&self, mesh: &SimplexMesh<2>, index: usize, value: impl Fn(usize) -> f64, site: Site) -> CueSample {
        let [second, third] = site.weights;
        let place = (site.cell as usize, [1.0 - second - third, second, third]);
        let (c, gradient) = self.solved.fields[index].layout.sample(mesh, value, place);
        CueSample { concentration: c.max(0.0), gradient: Vector3::new(gradient[0], gradient[1], 0.0) }
    }

    /// Brings the fields to a moment: all their values, or, where few are asked for, none.
    fn bring_to(&mut self, moment: Moment, few: bool) {
        for (field, current) in self.solved.fields.iter().zip(&mut self.current) {
            let parameter = moment.along(field);
            if current.parameter != Some(parameter) {
                let here_and_there = few && field.path.levels().len() > 1;
                current.on_path = here_and_there.then(|| field.path.locate(parameter));
                if !here_and_there {
                    current.values.resize(field.path.components(), 0.0);
                    field.path.evaluate(parameter, &mut current.values);
                }
                current.parameter = Some(parameter);
            }
        }
    }

    /// The values of a field at a moment: those in use, or interpolated anew where another one was last brought.
    fn at(&self, index: usize, moment: Moment) -> Cow<'_, [f64]> {
        let field = &self.solved.fields[index];
        let parameter = moment.along(field);
        let Current { parameter: here, on_path, .. } = &self.current[index];
        if *here == Some(parameter) && on_path.is_none() {
            return Cow::Borrowed(&self.current[index].values);
        }
        let mut values = vec![0.0; field.path.components()];
        field.path.evaluate(parameter, &mut values);
        Cow::Owned(values)
    }
}

fn bring_fields(configuration: Res<Configuration>, stage: Res<StageTime>, mut fields: ResMut<CueFields>) {
    let moment = Moment { load: configuration.load, time: stage.0 };
    fields.bring_to(moment, configuration.is_looked_at_here_and_there());
}

fn read_concentration(world: &World, index: usize) -> Vec<f64> {
    let (fields, vertices) = (world.resource::<CueFields>(), world.resource::<Tissue>().mesh.vertex_count());
    let values = fields.at(index, Moment::of(world));
    fields.solved.fields[index].layout.concentrations(&values).take(vertices).map(|c| c.max(0.0)).collect()
}

fn read_sample(world: &World, index: usize, site: Site) -> (f64, Vector3<f64>) {
    let fields = world.resource::<CueFields>();
    let values = fields.at(index, Moment::of(world));
    let sample = fields.sample_from(&world.resource::<Tissue>().mesh, index, |i| values[i], site);
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
    let mut inputs = format!("{} {moved} {chosen:?}", world.resource::<Tissue>().inputs);
    if chosen.iter().any(|(_, cue)| cue.transport == Transport::Transient) {
        let Clock { grid, end, .. } = *world.resource::<Clock>();
        inputs += &format!(" to {:?} h", grid.hours(end));
        let mut kinks = world.get_resource_or_init::<Kinks>();
        chosen.iter().flat_map(|(_, cue)| cue.switches()).for_each(|time| kinks.add(grid.nearest(time)));
    }
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
    let empty = |_: &FieldPath| Current { parameter: None, values: Vec::new(), on_path: None };
    let current = solved.fields.iter().map(empty).collect();
    world.insert_resource(CueFields { names, solved, current });
    Ok(())
}

/// Solves cues, one after the other.
fn solve(world: &World, cues: &[(&str, &Cue)]) -> Result<Solved, InstallError> {
    let tissue = world.resource::<Tissue>();
    let mesh = &*tissue.mesh;
    let goal = Refinement { tolerance: LEVEL_TOLERANCE, max_levels: MOST_LEVELS };
    let room = world.resource::<Plan>().room_left();
    let mut solvers = FieldSolvers::new(mesh, tissue.regions.values().cloned().collect()).within(room);
    let loading = world.get_resource::<Loading>();
    let clock = world.resource::<Clock>();
    let at_load =
        |load: f64| loading.map_or_else(Default::default, |loading| loading.configuration(&tissue.mesh, load));
    let at_time = |time: f64| loading.map_or_else(Default::default, |loading| loading.motion(&tissue.mesh, time));
    let mut field = |(name, cue): &(&str, &Cue)| {
        let problem = cue.problem(tissue, name, mesh);
        let kinks = loading.map_or_else(Vec::new, Loading::kinks);
        match cue.course(clock.grid.hours(clock.end), kinks) {
            None => problem.solve(&mut solvers, loading.map(|_| &at_load as _), goal),
            Some(course) => solve_in_time(&problem, &mut solvers, loading.map(|_| &at_time as _), &course),
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
    let problem = cue.problem(world.resource::<Tissue>(), name, &mesh);
    note(&mut world.resource_mut::<Health>(), name, field);
    let (levels, unknowns) = (field.path.levels().len(), field.unknowns());
    let steps = field.report.solves;
    let (times, solves, work) = match field.along {
        Along::Time => (format!("in {steps} steps of time, {levels} levels kept"), steps, Work::SteppedUnknown),
        Along::Load if levels == 1 => ("once".to_owned(), levels, Work::FieldUnknown),
        Along::Load => (format!("at {levels} load levels"), levels, Work::FieldUnknown),
    };
    let kind = if problem.order == Order::Quadratic { " of quadratic elements" } else { "" };
    let few = levels > 1 && world.resource::<Configuration>().is_looked_at_here_and_there();
    let mut plan = world.resource_mut::<Plan>();
    plan.keep(format!("cue `{name}`"), format!("read; {unknowns} unknowns{kind}, solved {times}"));
    tell_margins(&mut plan, name, &problem, field);
    let part = format!("cue `{name}`");
    let current = if few { 0 } else { size_of::<f64>() * field.path.components() };
    plan.hold(&part, (field.path.bytes() + current) as f64, Each::Run);
    plan.work(&part, work, (solves * unknowns) as f64, Each::Run);
    if levels > 1 && !few {
        plan.work(&part, Work::Interpolated, field.path.components() as f64, Each::Stage);
    }
}

fn failed(cue: &str, error: FieldPathError) -> InstallError {
    let account = format!("cue `{cue}` (eq. 2, /cues/{cue}): {error}");
    match error {
        FieldPathError::NoRoom { .. } => InstallError::NoRoom(account),
        _ => InstallError::Solve(account),
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
    if let Some(parameter) = field.flipped_from {
        let when = match field.along {
            Along::Load => format!("load {parameter:.3}"),
            Along::Time => format!("{parameter:.3} h"),
        };
        health.note(format!(
            "cue `{name}`: by {when} the tissue's mesh is no longer Delaunay; edges are flipped for its field (vertices stay)"
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
