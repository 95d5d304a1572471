//! Leaders and followers: at a decision region leaders slow down, followers do not.
//!
//! Pioneer growth cones of commissural axons slow down at the midline, followers pass it at full speed along them; where pioneers are
//! missing the first follower slows as they do (Bak and Fraser, Development 130, 2003, doi:10.1242/dev.00713). Ours, the rule: a
//! cone is a follower at an instant when it feels the shaft of another axon within its reach and a sector ahead; else it leads. In
//! a decision region
//!
//! ```text
//! v ← v f  for leaders,   v ← v  for followers.
//! ```
//!
//! All cones read the shafts of the step's start.

use super::shaft_index::{Asking, Search, ShaftIndex, ShaftScene};
use crate::numerics::contact_integral::Felt;
use crate::numerics::segments::{ContactPull, Contacts, Segments, Touch};
use crate::prelude::*;
use std::collections::BTreeMap;

keys! {
    /// Slowing of leaders, not of followers, in decision regions; v = f v₀ for a cone that feels no shaft ahead.
    pub struct LeaderFollower {
        /// The decision regions, by name.
        pub regions: BTreeMap<String, Shape> = BTreeMap::new(),
        /// Factor f on a leader's speed. Ours.
        #[schemars(extend("minimum" = 0.0, "maximum" = 1.0, "x-typical" = [0.2, 1.0]))]
        pub leader_speed: Factor = Factor(0.4),
        /// Reach within which a shaft is followed. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 20.0]))]
        pub reach: Length = Length(10.0),
        /// Half-angle of the sector about the heading in which a shaft is ahead. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 180.0, "x-typical" = [30.0, 120.0]))]
        pub sector: Angle = Angle(60.0),
    }
}

/// For each cell of the mesh, whether it lies in a decision region.
#[derive(Debug, Resource)]
struct DecisionCells(Vec<bool>);

impl Mechanism for LeaderFollower {
    const NAME: &'static str = "leader_follower";

    fn check(&self, _facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        wrong.demand(!self.regions.is_empty(), "/regions", || {
            "give a region, such as {\"midline\": {\"disc\": {\"centre\": [400, 300], \"radius\": 40}}}".into()
        });
        for (name, shape) in &self.regions {
            if let Err(found) = shape.check() {
                wrong.extend_under(&format!("/regions/{name}"), found);
            }
        }
        wrong
    }

    fn outlines(&self) -> Vec<(String, Shape)> {
        self.regions.iter().map(|(name, shape)| (region(name), shape.clone())).collect()
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        let tissue = model.world.resource::<Tissue>();
        let mut cells = vec![false; tissue.mesh.cell_count()];
        for name in self.regions.keys() {
            tissue.regions.get(&region(name)).into_iter().flatten().for_each(|&cell| cells[cell as usize] = true);
        }
        let followed = ShaftIndex::install(model, self.reach.0, Search::default());
        model.insert(DecisionCells(cells)).insert_law(self);
        if followed {
            model.term(Term::Contact, slow_leaders);
        } else {
            model.term(Term::Contact, slow_alone);
        }
        Ok(())
    }
}

fn region(name: &str) -> String {
    format!("{}/regions/{name}", LeaderFollower::NAME)
}

/// How much shaft is ahead: ∫ (1 − d/R)² ds (µm), in the first component.
#[derive(Debug, Clone, Copy)]
pub struct Ahead {
    /// Reach and sector.
    pub felt: Felt,
}

impl<const D: usize> ContactPull<D> for Ahead {
    #[inline(always)]
    fn pull(&self, touch: &Touch<D>) -> [f64; D] {
        std::array::from_fn(|k| if k == 0 { touch.moments[0] } else { 0.0 })
    }
}

impl From<&LeaderFollower> for Ahead {
    fn from(law: &LeaderFollower) -> Self {
        Self { felt: Felt::ahead(law.reach.0, law.sector.radians()) }
    }
}

/// The factor on the speed of a cone, by whether it is in a decision region and how much shaft (µm) it feels ahead.
pub fn factor(leader_speed: f64, inside: bool, ahead: f64) -> f64 {
    if inside && ahead <= 0.0 { leader_speed } else { 1.0 }
}

fn slow_leaders(
    law: Res<Law<LeaderFollower>>,
    cells: Res<DecisionCells>,
    mut index: ResMut<ShaftIndex>,
    scene: ShaftScene,
    mut cones: Cones,
) {
    let ahead = Ahead::from(&law.0);
    let feel = |contacts: &mut Contacts<2>, cone: &Asking, segments: &Segments<2>| {
        let inside = cells.0[cone.site.cell as usize];
        let felt = if inside { cone.sum(contacts, segments, (&ahead.felt, &ahead), &[1.0]).x } else { 0.0 };
        factor(law.leader_speed.0, inside, felt)
    };
    index.for_each(&scene, &mut cones, feel, |spring, factor| spring.speed_factor *= factor);
}

/// An axon alone leads.
fn slow_alone(law: Res<Law<LeaderFollower>>, cells: Res<DecisionCells>, mut cones: Cones) {
    cones.for_each(|cone, spring| {
        spring.speed_factor *= factor(law.leader_speed.0, cells.0[cone.site.cell as usize], 0.0);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ahead(a: [f64; 2], b: [f64; 2], heading: [f64; 2]) -> f64 {
        let law = Ahead::from(&LeaderFollower::default());
        let (mut segments, mut contacts) = (Segments::default(), Contacts::<2>::default());
        segments.push(a, b, (0, 0));
        contacts.sum(([0.0; 2], heading), &segments, 1, (&law.felt, &law), &[1.0])[0]
    }

    #[test]
    fn only_a_leader_in_a_region_slows_down() {
        assert_eq!(factor(0.4, true, 0.0), 0.4);
        assert_eq!((factor(0.4, true, 0.1), factor(0.4, false, 0.0)), (1.0, 1.0));
        assert_eq!(factor(1.0, true, 0.0), 1.0, "no strength, no change");
    }

    #[test]
    fn a_shaft_ahead_makes_a_follower_and_one_behind_or_far_does_not() {
        let up = [0.0, 1.0];
        assert!(ahead([0.5, -40.0], [0.5, 40.0], up) > 1.0);
        assert_eq!(ahead([0.5, -40.0], [0.5, -0.5], up), 0.0);
        assert_eq!(ahead([11.0, -40.0], [11.0, 40.0], up), 0.0);
        // A straight shaft on the axis: ∫₀¹⁰ (1 − s/10)² ds = 10/3.
        assert!((ahead([0.0, 0.0], [0.0, 40.0], up) - 10.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_ahead_does_not_depend_on_the_directions_of_the_axes() {
        let (sine, cosine) = 0.7f64.sin_cos();
        let turn = |[x, y]: [f64; 2]| [cosine * x - sine * y, sine * x + cosine * y];
        let (a, b, up) = ([1.0, -40.0], [3.0, 40.0], [0.0, 1.0]);
        assert!((ahead(turn(a), turn(b), turn(up)) - ahead(a, b, up)).abs() < 1e-13);
    }
}
