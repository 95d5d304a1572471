//! Keys of one cue, what they may not say together, and the problem of numerics that they mean.

use crate::numerics::field_path::{self, FieldProblem, Order};
use crate::numerics::reaction_diffusion::{Mass as MassMatrix, ReactionDiffusion};
use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::transient_field::{Course, Start as Beginning};
use crate::prelude::*;

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
    /// It diffuses in time: ∂c/∂t + ∇·(c v_φ) = DΔc − kc + q 1_A, carried by the tissue and conserved.
    Transient,
    /// It is bound to the matrix: distributed as at rest, then carried by the tissue and diluted by it, c = c₀/J.
    Bound,
}

/// What is there of a transient cue at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// Nothing: it spreads from its sources.
    Nothing,
    /// The stationary field of its sources.
    Stationary,
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
        /// What is there of a transient cue at the beginning. Absent: `nothing`. Ours.
        pub start: Option<Start> = None,
        /// Time from which the sources of a transient cue release. Absent: from the start. Ours.
        #[schemars(extend("minimum" = 0.0))]
        pub release_from: Option<Time> = None,
        /// Time until which the sources of a transient cue release. Absent: to the end. Ours.
        #[schemars(extend("minimum" = 0.0))]
        pub release_until: Option<Time> = None,
        /// Largest error of a step in time of a transient cue, over its largest concentration so far. Absent: 1e-4. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 0.1, "x-typical" = [1e-6, 1e-3]))]
        pub time_tolerance: Option<Factor> = None,
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

/// √(D/k) over the length of the tissue's border, at most.
const LONGEST_DECAY: f64 = 1e3;
/// Default of `time_tolerance`.
const TIME_TOLERANCE: f64 = 1e-4;
/// A step is at most an eighth of the time between two kinks.
const HALVINGS: u32 = 3;
/// Cap on the levels in time of a transient cue.
const MOST_TIMES: usize = 513;

impl Cue {
    /// What a schema cannot say.
    pub(super) fn check(&self, extent: &MeshExtent) -> Violations {
        let mut wrong = Violations::new();
        self.check_decay_length(extent.border, &mut wrong);
        wrong.demand(!self.sources.is_empty(), "/sources", || {
            "a cue needs at least one source, such as {\"disc\": {\"centre\": [400, 540], \"radius\": 50}}".into()
        });
        let lumped = self.element == Element::Quadratic && self.mass == Some(Mass::Lumped);
        wrong.demand(!lumped, "/mass", || {
            "quadratic elements have no lumped mass (it would be zero at the vertices); leave `mass` out, or take linear elements".into()
        });
        let plain = self.transport == Transport::Diffusing || self.element == Element::Linear;
        wrong.demand(plain, "/element", || match self.transport {
            Transport::Transient => "a transient cue takes linear elements".into(),
            _ => "a cue that is bound to the matrix takes linear elements".into(),
        });
        self.check_time(&mut wrong);
        for (i, shape) in self.sources.iter().enumerate() {
            if let Err(found) = shape.check() {
                wrong.extend_under(&format!("/sources/{i}"), found);
            }
        }
        wrong
    }

    /// Where D ∇²c is so much larger than k c that their sum has lost the latter to round-off, no equilibrium is found.
    fn check_decay_length(&self, border: f64, wrong: &mut Violations) {
        let most = self.degradation.0 * (LONGEST_DECAY * border).powi(2);
        wrong.demand(border == 0.0 || self.diffusion.0 <= most, "/diffusion", || {
            format!(
                "{} and a degradation of {} make a decay length of {:.1e} um, over {LONGEST_DECAY} times the border of the tissue, in which the \
                 cue is the same everywhere; a diffusion of at most {most:.1e} um2/h is allowed with that degradation",
                self.diffusion,
                self.degradation,
                (self.diffusion.0 / self.degradation.0).sqrt(),
            )
        });
    }

    fn check_time(&self, wrong: &mut Violations) {
        let transient = self.transport == Transport::Transient;
        wrong.demand(!(transient && self.mass == Some(Mass::Consistent)), "/mass", || {
            "a transient cue takes lumped mass: with a consistent one short steps undershoot around a front".into()
        });
        let given = [
            (self.start.is_some(), "/start"),
            (self.release_from.is_some(), "/release_from"),
            (self.release_until.is_some(), "/release_until"),
            (self.time_tolerance.is_some(), "/time_tolerance"),
        ];
        for (_, key) in given.into_iter().filter(|(given, _)| *given && !transient) {
            wrong.push(key, "only a transient cue has a course in time; say `\"transport\": \"transient\"`");
        }
        let [from, until] = self.release_times();
        wrong.demand(from < until, "/release_until", || {
            format!("{until} h is not after {from} h, when the release begins")
        });
    }

    /// From when to when it is released (h).
    fn release_times(&self) -> [f64; 2] {
        [self.release_from.map_or(0.0, |t| t.0), self.release_until.map_or(f64::INFINITY, |t| t.0)]
    }

    /// Times at which the release begins or ends (h), inside a run.
    pub(super) fn switches(&self) -> impl Iterator<Item = f64> {
        self.release_times().into_iter().filter(|&time| time > 0.0 && time.is_finite())
    }

    /// Its course to the `end` (h) of a run whose tissue has `kinks` (h); none unless it is transient.
    pub(super) fn course(&self, end: f64, kinks: Vec<f64>) -> Option<Course> {
        (self.transport == Transport::Transient).then(|| Course {
            start: match self.start {
                None | Some(Start::Nothing) => Beginning::Nothing,
                Some(Start::Stationary) => Beginning::Stationary,
            },
            end,
            release: self.release_times(),
            kinks,
            tolerance: self.time_tolerance.map_or(TIME_TOLERANCE, |tolerance| tolerance.0),
            halvings: HALVINGS,
            most_levels: MOST_TIMES,
        })
    }

    /// The cue as a problem of numerics.
    pub(super) fn problem<'m>(&self, tissue: &Tissue, name: &str, mesh: &'m SimplexMesh<2>) -> FieldProblem<'m> {
        let (order, usual) = match self.element {
            Element::Linear => (Order::Linear, Mass::Lumped),
            Element::Quadratic => (Order::Quadratic, Mass::Consistent),
        };
        let mass = match self.mass.unwrap_or(usual) {
            Mass::Lumped => MassMatrix::Lumped,
            Mass::Consistent => MassMatrix::Consistent,
        };
        let gradient = match self.gradient {
            Gradient::Recovered => field_path::Gradient::Recovered,
            Gradient::Raw => field_path::Gradient::Raw,
        };
        let cells = |i: usize| tissue.regions.get(&region(name, i)).cloned().unwrap_or_default();
        FieldProblem {
            mesh,
            equation: ReactionDiffusion { diffusion: self.diffusion.0, degradation: self.degradation.0, mass },
            order,
            gradient,
            sources: (0..self.sources.len()).map(cells).collect(),
            release_rate: self.release_rate.map_or(50.0 * self.degradation.0, |q| q.0),
            bound: self.transport == Transport::Bound,
            keeps_total: self.release == Release::Total,
        }
    }
}

/// Name of the mesh region of a cue's source.
pub(super) fn region(cue: &str, source: usize) -> String {
    format!("cues/{cue}/sources/{source}")
}
