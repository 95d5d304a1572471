//! Provider: the deforming matrix, eq. (3).
//!
//! −∇_X·P = 0, U = Û(t) on the named edges that move, P·n = 0 elsewhere; quasi-static, plane strain, P1. The equilibrium
//! depends on one load s(t) ∈ [0, 1] alone, so a few load levels are solved before the run and interpolated by cubic Hermite
//! polynomials; v_φ = ṡ times the derivative of that interpolant. The paper moves top and bottom by "about 20 % of the initial
//! vertical dimension for each side"; ours: outward, held sideways, linear in time, material numbers.
//! Ours too: the tissue may grow by itself, F = F_e F_g with F_g = g I, the mass source that the paper leaves out.

mod growth;
mod loading;
mod own_mesh;
mod supports;

pub use growth::{GrowingRegion, TissueGrowth};
pub use loading::Loading;

use crate::numerics::ellipticity::ellipticity_left;
use crate::numerics::grown::Growth;
use crate::numerics::hermite::Interpolation as Course;
use crate::numerics::hyperelasticity::{Body, Prescribed};
use crate::numerics::load_path::{LoadPath, LoadPathOptions};
use crate::numerics::material::MaterialError;
use crate::numerics::upright::inverse_stretches;
use crate::prelude::*;
use loading::{Equilibria, follow_load};
use std::collections::BTreeMap;
use std::sync::Arc;
use supports::{axis_of, hold_the_middle, outward_normal};

/// What an edge does sideways while it moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sideways {
    /// Held: both components are imposed.
    Held,
    /// Sliding: only the component along the edge's normal is imposed; the edge must be parallel to an axis.
    Sliding,
}

/// What the matrix does between two load levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// The cubic through displacements and their rates: v_φ is continuous.
    Cubic,
    /// The straight line: v_φ jumps at levels. There to be compared with.
    Linear,
}

keys! {
    /// Imposed motion of one named edge, at full load.
    pub struct EdgeMotion {
        /// Motion along the edge's outward normal, as a share of the tissue's extent in that direction; negative is inward.
        #[schemars(extend("exclusiveMinimum" = -0.5, "x-typical" = [-0.2, 0.5]))]
        pub outward: Factor = Factor(0.0),
        /// A further displacement `[x, y]`.
        pub shift: [Length; 2] = [Length(0.0), Length(0.0)],
        /// What the edge does sideways. Ours.
        pub sideways: Sideways = Sideways::Held,
    }

    /// The load s over time: straight lines between the given pairs, constant outside them.
    pub struct LoadCurve {
        /// Times, ascending. Empty: from 0 to the end of the run.
        pub times: Vec<Time> = Vec::new(),
        /// Loads at these times, each in [0, 1].
        pub loads: Vec<Factor> = Vec::new(),
    }

    /// The deforming matrix (eq. 3): hyperelastic, moved at named edges; −∇·P = 0, U = Û on Γ_D.
    pub struct Matrix {
        /// The law of the material: its name, or its name with keys of its own.
        pub material: MaterialChoice = MaterialChoice::of("st_venant_kirchhoff"),
        /// Young's modulus E. It drops out of displacements when only motion is imposed. Source: embryonic mesoderm.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [100.0, 3000.0]))]
        pub young_modulus: Pressure = Pressure(500.0),
        /// Poisson's ratio ν.
        #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 0.5, "x-typical" = [0.2, 0.45]))]
        pub poisson_ratio: Factor = Factor(0.3),
        /// The edges that move, by name; edges not named are free. Empty: top and bottom, outward by 20 %, held; none if it grows.
        pub motion: BTreeMap<String, EdgeMotion> = BTreeMap::new(),
        /// Growth of the tissue by itself, with the load. Ours. Absent: none.
        pub growth: Option<TissueGrowth> = None,
        /// The load over time. Ours: linear over the whole run.
        pub load: LoadCurve = LoadCurve::default(),
        /// Largest error of the interpolated displacement between load levels, over the tissue's size. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 0.1, "x-typical" = [1e-8, 1e-4]))]
        pub tolerance: Factor = Factor(1e-6),
        /// Mesh size on which the matrix is solved, where it is not to be the tissue's own. Displacements are smooth where cues are steep,
        /// so that a coarser mesh may do. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub mesh_size: Option<Length> = None,
        /// What the displacement does between load levels. Ours.
        pub interpolation: Interpolation = Interpolation::Cubic,
    }
}

/// Bytes an unknown that solving takes: tangent, factor and what belongs to them. Ours, measured.
const WORKSPACE: f64 = 2000.0;

impl EdgeMotion {
    /// Whether the edge leaves its place.
    fn acts(&self) -> bool {
        self.outward.0 != 0.0 || self.shift.iter().any(|shift| shift.0 != 0.0)
    }
}

impl LoadCurve {
    /// The largest load that is reached.
    fn largest(&self) -> f64 {
        if self.times.is_empty() { 1.0 } else { self.loads.iter().map(|load| load.0).fold(0.0, f64::max) }
    }
}

impl Matrix {
    /// The motion with its default filled in: top and bottom outward by 20 % each [paper], held sideways; none if the tissue grows.
    fn edges(&self) -> BTreeMap<String, EdgeMotion> {
        if !self.motion.is_empty() || self.growth.is_some() {
            return self.motion.clone();
        }
        let outward = EdgeMotion { outward: Factor(0.2), ..EdgeMotion::default() };
        ["top", "bottom"].map(|name| (name.to_owned(), outward.clone())).into()
    }

    /// Whether any edge moves or anything grows at any time.
    fn moves(&self) -> bool {
        let LoadCurve { times, loads } = &self.load;
        let loaded = times.is_empty() || loads.iter().any(|load| load.0 != 0.0);
        loaded && (self.edges().values().any(EdgeMotion::acts) || self.growth.as_ref().is_some_and(TissueGrowth::acts))
    }

    /// What deforms the tissue, in words.
    fn causes(&self) -> String {
        let edges = self.edges();
        let what = if edges.values().any(EdgeMotion::acts) { "moved" } else { "held" };
        let names = edges.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        let moved = (!edges.is_empty()).then(|| format!("edges {names} are {what}"));
        let grown = self.growth.as_ref().filter(|growth| growth.acts()).map(|growth| match growth.extremes() {
            [low, high] if low == high => format!("the tissue grows to {high} times its length"),
            [low, high] => format!("the tissue grows to {low} to {high} times its length"),
        });
        moved.into_iter().chain(grown).collect::<Vec<_>>().join(", ")
    }

    fn lame(&self) -> Result<Lame, MaterialError> {
        Lame::from_young_poisson(self.young_modulus.0, self.poisson_ratio.0)
    }

    fn law(&self, materials: &Materials) -> Result<Arc<dyn Material<2>>, InstallError> {
        let found = materials.material(&self.material, self.lame().map_err(solve_error)?);
        found.map_err(|wrong| match wrong.into_iter().next() {
            Some(first) => InstallError::Scenario(first.under("/material")),
            None => solve_error("the material was refused"),
        })
    }

    /// Vertices and amplitudes of the imposed motion. A body that could still slide sideways is held at one vertex, one that grows with
    /// no edge held at its middle: supports that carry no force.
    fn prescribed(&self, tissue: &Tissue, growth: &Growth) -> Result<Prescribed<2>, InstallError> {
        let mesh = &tissue.mesh;
        let mut prescribed = Prescribed::none(mesh.vertex_count());
        let mut imposed = [false; 2];
        let mut first_vertex = None;
        for (name, motion) in self.edges() {
            let edge = tissue.edge(&name).ok_or_else(|| no_such_edge(&name, tissue))?;
            let (normal, extent) = outward_normal(tissue, edge);
            let component = axis_of(normal);
            if motion.sideways == Sideways::Sliding && component.is_none() {
                return Err(refuse(&name, "a sliding edge must be parallel to an axis; this one is not"));
            }
            let amplitude = |k: usize| motion.outward.0 * extent * normal[k] + motion.shift[k].0;
            for vertex in tissue.edges[edge].iter().flat_map(|facet| mesh.facet_vertices(*facet)) {
                first_vertex.get_or_insert(vertex as usize);
                for k in (0..2).filter(|k| motion.sideways == Sideways::Held || component == Some(*k)) {
                    prescribed.impose(vertex as usize, k, amplitude(k));
                    imposed[k] = true;
                }
            }
        }
        match first_vertex {
            Some(vertex) => {
                (0..2).filter(|k| !imposed[*k]).for_each(|k| prescribed.impose(vertex, k, 0.0));
            }
            None => hold_the_middle(mesh.vertices(), growth, &mut prescribed),
        }
        Ok(prescribed)
    }

    /// Solves the load path on the mesh that the scene asks for, and takes it over to that of the tissue.
    fn solve(&self, tissue: &Tissue, law: Arc<dyn Material<2>>) -> Result<Equilibria, InstallError> {
        let solved = match self.mesh_size {
            None => self.solve_on(tissue, law)?,
            Some(size) => {
                let own = own_mesh::remeshed(tissue, size.0, &self.outlines())?;
                let solved = self.solve_on(&own, law)?;
                Equilibria { path: own_mesh::taken_over(&solved.path, &own, tissue)?, ..solved }
            }
        };
        let inverse_stretches = inverse_stretches(&tissue.mesh, solved.path.path());
        Ok(Equilibria { inverse_stretches, ..solved })
    }

    fn solve_on(&self, tissue: &Tissue, law: Arc<dyn Material<2>>) -> Result<Equilibria, InstallError> {
        let growth = self.growth.as_ref().map(|growth| growth.of_cells(tissue)).unwrap_or_default();
        let prescribed = self.prescribed(tissue, &growth)?;
        let body =
            Body::new(&tissue.mesh, law, prescribed).and_then(|body| body.growing(growth)).map_err(solve_error)?;
        let interpolation = match self.interpolation {
            Interpolation::Cubic => Course::Cubic,
            Interpolation::Linear => Course::Linear,
        };
        let options = LoadPathOptions { tolerance: self.tolerance.0, interpolation, ..LoadPathOptions::default() };
        let path = LoadPath::solve(&body, &options).map_err(|error| {
            InstallError::Solve(format!(
                "the matrix (eq. 3, /matrix) has no path to its full load: {error}{}",
                remedy(self)
            ))
        })?;
        let mut farthest = vec![0.0; body.unknowns()];
        let largest = self.load.largest();
        path.displacement(largest, &mut farthest);
        let used = 1.0 - ellipticity_left(&body, largest, &farthest);
        Ok(Equilibria { path, used, unknowns: body.unknowns(), inverse_stretches: None })
    }
}

impl Mechanism for Matrix {
    const NAME: &'static str = "matrix";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        let is_missing = |name: &&String| !facts.edges.is_empty() && !facts.edges.contains(name);
        for name in self.edges().keys().filter(is_missing) {
            wrong.push("/motion", unknown_name("edge", name, &facts.edges));
        }
        if let Ok(lame) = self.lame()
            && let Err(refused) = facts.materials.material(&self.material, lame)
        {
            wrong.extend_under("/material", refused);
        }
        let LoadCurve { times, loads } = &self.load;
        wrong.demand(times.len() == loads.len() && times.len() != 1, "/load", || {
            format!("{} times and {} loads: give as many loads as times, two or more", times.len(), loads.len())
        });
        wrong.demand(times.windows(2).all(|w| w[0].0 < w[1].0), "/load/times", || "times must ascend".into());
        self.mesh_size.iter().for_each(|size| facts.mesh_extent.demand(*size, "/mesh_size", &mut wrong));
        wrong.demand(loads.iter().all(|s| (0.0..=1.0).contains(&s.0)), "/load/loads", || {
            "each load lies in [0, 1]; larger motion goes into `motion`".into()
        });
        wrong
    }

    fn outlines(&self) -> Vec<(String, Shape)> {
        self.growth.as_ref().map(TissueGrowth::outlines).unwrap_or_default()
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if !self.moves() {
            model.plan().leave_out("matrix", "no edge moves and nothing grows: the tissue stays at rest");
            return Ok(());
        }
        let law = self.law(model.world.resource::<Materials>())?;
        let tissue = model.world.resource::<Tissue>();
        let inputs = format!("{} {self:?}", tissue.inputs);
        let (equilibria, new) = model.world.resource::<Shelf>().take(&inputs, || self.solve(tissue, law))?;
        let Equilibria { path, used, unknowns, inverse_stretches } = &*equilibria;
        let duration = model.world.resource::<Clock>().grid.hours(model.world.resource::<Clock>().end);
        record(model.world, path, new);
        tell_kinks(model.world, &self.load);
        let report = path.report();
        let why = format!(
            "{}: {unknowns} unknowns{}, {} load levels, {} equilibria",
            self.causes(),
            if self.mesh_size.is_some() { " on a mesh of its own" } else { "" },
            report.levels,
            report.solves
        );
        model.plan().keep("matrix", why);
        model.plan().compare(
            "matrix: ellipticity used up at the largest load",
            *used,
            1.0,
            "less motion, sliding edges or `neo_hookean`",
        );
        let held = path.path().bytes() as f64 + WORKSPACE * *unknowns as f64;
        let (iterations, moved) = ((unknowns * report.newton_iterations) as f64, path.path().components() as f64);
        let mut plan = model.plan();
        plan.hold("matrix", held, Each::Run);
        plan.work("matrix", Work::NewtonUnknown, iterations, Each::Run);
        let curve = self.load.clone();
        let upright = inverse_stretches.is_some();
        let loading = Loading { equilibria, inputs, curve, duration };
        let swelling = loading.swelling(&model.world.resource::<Tissue>().mesh);
        model.plan().swelling = swelling;
        model.insert(loading).insert_law(self);
        if upright {
            model.upright_motion(follow_load);
        } else {
            model.motion(follow_load);
            model.world.resource_mut::<Configuration>().is_looked_at_everywhere();
        }
        model.at_end(move |world| {
            let few = world.resource::<Configuration>().is_looked_at_here_and_there();
            let watched = if upright { 0 } else { world.resource::<Tissue>().mesh.cell_count() };
            let mut plan = world.resource_mut::<Plan>();
            // At each stage and at the step's end.
            for each in [Each::Stage, Each::Step] {
                plan.work("matrix", Work::Moved, if few { 0.0 } else { moved }, each);
                plan.work("matrix", Work::WatchedCell, watched as f64, each);
            }
            Ok(())
        });
        Ok(())
    }
}

fn record(world: &mut World, path: &LoadPath, new: bool) {
    let report = path.report();
    if new {
        let mut counters = world.resource_mut::<Counters>();
        counters.matrix_solves += report.solves as u64;
        counters.newton_iterations += report.newton_iterations as u64;
    }
    let mut health = world.resource_mut::<Health>();
    if !report.met {
        health.note(format!(
            "matrix: {} load levels were not enough; the path is within {:.1e}",
            report.levels, report.defect
        ));
    }
    if let Some(load) = report.unstable_from {
        health.note(format!(
            "matrix: from load {load:.3} on the equilibrium is not stable (negative eigenvalue of the tangent)"
        ));
    }
    world.resource_mut::<Configuration>().moves = true;
}

/// The corners of the load curve are kinks of the tissue's motion.
fn tell_kinks(world: &mut World, load: &LoadCurve) {
    let grid = world.resource::<Clock>().grid;
    let mut kinks = world.get_resource_or_init::<Kinks>();
    load.times.iter().filter(|time| time.0 >= 0.0).for_each(|time| kinks.add(grid.nearest(time.0)));
}

fn remedy(matrix: &Matrix) -> &'static str {
    if matrix.poisson_ratio.0 > 0.49 {
        return ". A Poisson ratio this near 0.5 locks linear triangles; 0.45 or less is advised";
    }
    if matrix.material == Matrix::default().material {
        ". St. Venant-Kirchhoff fails in compression; `\"material\": \"neo_hookean\"` goes further, as does less motion"
    } else {
        ". Less motion, sliding instead of held edges, or a finer mesh may help"
    }
}

fn solve_error(error: impl std::fmt::Display) -> InstallError {
    InstallError::Solve(format!("the matrix (eq. 3, /matrix): {error}"))
}

fn refuse(edge: &str, message: &str) -> InstallError {
    InstallError::Scenario(Violation::new(format!("/motion/{edge}"), message))
}

fn no_such_edge(name: &str, tissue: &Tissue) -> InstallError {
    refuse(name, &unknown_name("edge", name, &tissue.domain.edge_names))
}
