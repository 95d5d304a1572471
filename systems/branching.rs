//! Branching: growth cones that split, and branches that sprout from the shaft behind them.
//!
//! Each growing cone branches at the instants of a Poisson process whose rate may depend on a cue where the cone is, as target-derived
//! factors make axons branch (Cohen-Cory and Fraser, Nature 378, 1995, doi:10.1038/378192a0; Gibson and Ma, Development 138, 2011,
//! doi:10.1242/dev.046441 for the two ways):
//!
//! ```text
//! P(branch in dt) = r g dt,   g = c/(c_half + c), or 1 without a cue.
//! ```
//!
//! Splitting: both cones leave at half the angle from the old heading. Collateral: the branch leaves a vertex of the shaft, drawn evenly, at
//! the angle from the shaft, and the cone goes on. The side is drawn. Ours: the law in c, and that a branch begins at the end of the step in
//! which its instant falls (of first order in the step). Instants are those of the largest rate r, kept with probability g, so that cones
//! with the same number branch at the same instants whatever else goes on.

use super::cue_fields::Cues;
use crate::numerics::turning::rotate_in_plane;
use crate::prelude::*;

keys! {
    /// New growth cones from old ones; dP = r c/(c_half + c) dt.
    pub struct Branching {
        /// Rate r at which a growing cone branches at most. Ours.
        #[schemars(extend("minimum" = 0.0, "maximum" = 100.0, "x-typical" = [0.005, 0.2]))]
        pub rate: Rate = Rate(0.03),
        /// Whether the cone itself splits or the shaft behind it sprouts.
        pub kind: BranchKind = BranchKind::Splitting,
        /// Angle between the two cones after splitting, or between a collateral and its shaft. Ours.
        #[schemars(extend("minimum" = 0.0, "maximum" = 180.0, "x-typical" = [30.0, 120.0]))]
        pub angle: Angle = Angle(60.0),
        /// Branches that an axon has at most.
        #[schemars(extend("minimum" = 1, "maximum" = 64))]
        pub most: u64 = 4,
        /// The cue that branching needs; without one the rate is r everywhere.
        pub cue: Option<String> = None,
        /// Concentration at which the rate is half of r.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.5, 50.0]))]
        pub half_concentration: Concentration = Concentration(5.0),
    }
}

/// How a branch begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BranchKind {
    /// The growth cone splits in two.
    Splitting,
    /// A branch sprouts from the shaft.
    Collateral,
}

/// The next instant (h) at which a cone may branch, and how many came before.
#[derive(Debug, Clone, Copy, Component)]
struct Budding {
    next: f64,
    count: u64,
}

kept! { struct Budding { next, count } }

/// What the draws are keyed by besides cone and count, and the number of the cue.
#[derive(Debug, Clone, Copy, Resource)]
struct Buds {
    seed: u64,
    stream: Stream,
    cue: Option<usize>,
}

impl Mechanism for Branching {
    const NAME: &'static str = "branching";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        if let Some(cue) = &self.cue {
            Cues::demand_known(facts, &mut wrong, cue, "/cue");
        }
        wrong
    }

    fn spare_cones(&self) -> u32 {
        self.most as u32
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        let (seed, stream, rate) = (model.seed(), model.stream(), self.rate.0);
        if let Some(cue) = &self.cue {
            CueFields::demand(model, cue);
        }
        let grid = model.world.resource::<Clock>().grid;
        model.attach(move |cone: &GrowthCone| Budding {
            next: cone.birth_time(&grid) + waiting_time(seed, stream, (cone.axon, 0), rate),
            count: 0,
        });
        model.keep_of_cones::<Budding>();
        let cue = self.cue.clone();
        model.at_end(move |world| {
            let cue = cue.map(|cue| CueFields::number(world, &cue, "/cue")).transpose()?;
            world.insert_resource(Buds { seed, stream, cue });
            Ok(())
        });
        let spares = model.world.resource::<Shafts>().count() as u64 * self.most / (1 + self.most);
        model.plan().keep(
            "cones for branches",
            format!("{spares} wait for branches; what is expected of cones leaves them out"),
        );
        model.insert_law(self).phase(Phase::Remodel, branch);
        Ok(())
    }
}

/// Share g = c/(c_half + c) of the largest rate at a concentration c (nM, not negative).
pub fn rate_factor(concentration: f64, half: f64) -> f64 {
    concentration / (half + concentration)
}

/// Time (h) from the instant `count` − 1 of a cone to the next, exponential with mean 1/`rate` (1/h): none comes at rate 0.
fn waiting_time(seed: u64, stream: Stream, (cone, count): (u32, u64), rate: f64) -> f64 {
    let share = KeyedRng::new(seed, cone, stream, 2 * count).share();
    if rate > 0.0 { -(-share).ln_1p() / rate } else { f64::INFINITY }
}

fn branch(
    law: Res<Law<Branching>>,
    buds: Res<Buds>,
    fields: Option<Res<CueFields>>,
    mut budding: Query<&mut Budding>,
    mut remodelling: Remodelling,
) {
    let now = remodelling.clock.hours();
    let Ok(mut tables) = budding.contiguous_iter_mut() else { return };
    let Some(mut budding) = tables.next() else { return };
    let factor = |cone: &Standing, tissue: &Tissue| match (&fields, buds.cue) {
        (Some(fields), Some(cue)) => {
            rate_factor(fields.sample(&tissue.mesh, cue, cone.site).concentration, law.half_concentration.0)
        }
        _ => 1.0,
    };
    let standing = remodelling.standing();
    for (i, cone) in standing.iter().enumerate().filter(|(_, cone)| cone.status == Status::Growing) {
        let mut cone = *cone;
        while budding[i].next <= now && remodelling.may_branch(cone.identity.axon) {
            let count = budding[i].count;
            let mut draws = KeyedRng::new(buds.seed, cone.identity.axon, buds.stream, 2 * count + 1);
            let (kept, side, place) = (draws.share(), draws.share(), draws.share());
            let after = (cone.identity.axon, count + 1);
            budding[i] = Budding {
                next: budding[i].next + waiting_time(buds.seed, buds.stream, after, law.rate.0),
                count: count + 1,
            };
            if kept < factor(&cone, &remodelling.tissue) {
                let angle = law.angle.radians() * if side < 0.5 { 1.0 } else { -1.0 };
                if let Some(branch) = begin(&mut remodelling, law.kind, &mut cone, (angle, place)) {
                    let first = waiting_time(buds.seed, buds.stream, (branch, 0), law.rate.0);
                    budding[branch as usize] = Budding { next: now + first, count: 0 };
                }
            }
        }
    }
}

/// Begins a branch at an angle (rad); a collateral at the vertex that a share in [0, 1) of them all names.
fn begin(
    remodelling: &mut Remodelling,
    kind: BranchKind,
    cone: &mut Standing,
    (angle, share): (f64, f64),
) -> Option<u32> {
    let parent = cone.identity.axon;
    match kind {
        BranchKind::Splitting => {
            let branch = remodelling.sprout(parent, Place::Tip, rotate_in_plane(&cone.heading, 0.5 * angle))?;
            cone.heading = rotate_in_plane(&cone.heading, -0.5 * angle);
            remodelling.head(parent, cone.heading);
            Some(branch)
        }
        BranchKind::Collateral => {
            let stored: Vec<VertexId> = remodelling.shafts.vertices(parent as usize).collect();
            // The origin is no place to sprout from, and a vertex at the tip has no direction.
            let inner = stored.get(1..).filter(|inner| !inner.is_empty())?;
            let place = (share * inner.len() as f64) as usize;
            let at = |vertex: VertexId| remodelling.position(remodelling.shafts.point(vertex).into());
            let along = (at(inner[place]) - at(stored[place])).try_normalize(0.0)?;
            remodelling.sprout(parent, Place::Vertex(inner[place]), rotate_in_plane(&along, angle))
        }
    }
}
