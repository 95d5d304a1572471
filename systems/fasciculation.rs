//! Fasciculation: homophilic attraction between growth cones and the shafts of other axons.
//!
//! Ours in form and numbers (the paper's Section 3 is missing from its text): over the parts of other axons' shafts
//! within reach R_f and within ±Θ_s of the heading,
//!
//! ```text
//! F = Σ_axons ∫ h [ w_a g_a(d/R_f) d̂ + w_t g_t(d/R_f) sgn(t·e_g) t ] ds / R_f,   g_a(u) = 27/4 u(1−u)²,  g_t(u) = (1−u)²
//! ```
//!
//! F ← F / max(1, |F|), L̂ += λ_f F. The integral over each straight segment, clipped to reach and sector, is taken in closed
//! form, so it depends neither on Δt nor on how finely a shaft is stored. A fibre is not followed backwards, toward its origin,
//! unless a key allows it. All cones read the shafts of the step's start: the result does not depend on their order, and contact
//! is of first order in Δt whatever the method.

use super::shaft_index::{Asking, Search, ShaftIndex, ShaftScene};
use crate::numerics::contact_integral::Felt;
use crate::numerics::segments::{ContactPull, Contacts, Segments, Touch};
use crate::prelude::*;
use std::collections::BTreeMap;

keys! {
    /// Homophilic attraction to the shafts of other axons; L̂ += λ_f F.
    pub struct Fasciculation {
        /// Strength λ_f. Ours. May exceed 1: contact steers faster than a gradient, else a cone crosses every fibre it meets.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
        pub weight: Factor = Factor(2.0),
        /// Reach R_f of the filopodia. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 20.0]))]
        pub reach: Length = Length(10.0),
        /// Half-angle Θ_s of the sector about the heading in which a cone feels. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 180.0, "x-typical" = [60.0, 180.0]))]
        pub sector: Angle = Angle(120.0),
        /// Weight w_a of the pull toward a shaft. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
        pub attraction: Factor = Factor(0.5),
        /// Weight w_t of the alignment with a shaft. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
        pub alignment: Factor = Factor(0.5),
        /// Whether a fibre is also followed backwards, toward its origin. Ours.
        pub follow_backwards: bool = false,
        /// Adhesion h between populations, row (who feels) by column (who is felt); 1 where nothing is given. Ours.
        pub adhesion: BTreeMap<String, BTreeMap<String, Factor>> = BTreeMap::new(),
        /// How shafts near a cone are found. Ours.
        pub neighbours: Search = Search::Grid,
    }
}

impl Mechanism for Fasciculation {
    const NAME: &'static str = "fasciculation";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        for (row, columns) in &self.adhesion {
            for name in std::iter::once(row).chain(columns.keys()) {
                wrong.demand(facts.populations.contains(name), &format!("/adhesion/{row}"), || {
                    unknown_name("population", name, &facts.populations)
                });
            }
        }
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if !ShaftIndex::install(model, self.reach.0, self.neighbours) {
            return Ok(());
        }
        let populations = &model.world.resource::<Populations>().0;
        let table = AdhesionTable::new(&self.adhesion, populations);
        let fastest = populations.iter().map(|population| population.speed).fold(0.0, f64::max);
        let clock = model.world.resource::<Clock>();
        let (step, bound) = (clock.grid.hours(clock.grid.step_ticks()), self.reach.0 / (5.0 * fastest));
        let mut plan = model.plan();
        plan.compare(
            "fasciculation: step (h) against a fifth of the reach over the speed",
            step,
            bound,
            "a shorter step",
        );
        plan.keep("shaft index", format!("fasciculation feels shafts within {} um", self.reach.0));
        model.pulls_up_to(self.weight.0);
        model.insert(table).insert_law(self).term(Term::Contact, attract);
        Ok(())
    }
}

/// Adhesion h by population index, row-major.
#[derive(Debug, Resource)]
struct AdhesionTable {
    count: usize,
    values: Vec<f64>,
}

impl AdhesionTable {
    fn new(given: &BTreeMap<String, BTreeMap<String, Factor>>, populations: &[Population]) -> Self {
        let value = |row: &Population, column: &Population| {
            given.get(&row.name).and_then(|columns| columns.get(&column.name)).map_or(1.0, |h| h.0)
        };
        let values = populations.iter().flat_map(|row| populations.iter().map(move |column| value(row, column)));
        Self { count: populations.len(), values: values.collect() }
    }

    /// What a population feels of each.
    fn row(&self, population: u16) -> &[f64] {
        let first = population as usize * self.count;
        &self.values[first..first + self.count]
    }
}

/// Attraction profile g_a(u) = 27/4 u (1 − u)² on [0, 1]: zero at contact and at the rim, 1 at its maximum u = 1/3.
pub fn attraction_profile(u: f64) -> f64 {
    6.75 * u * (1.0 - u) * (1.0 - u)
}

/// Alignment profile g_t(u) = (1 − u)² on [0, 1].
pub fn alignment_profile(u: f64) -> f64 {
    (1.0 - u) * (1.0 - u)
}

/// The constants of the law as a cone needs them.
#[derive(Debug, Clone, Copy)]
pub struct ContactLaw {
    /// Reach R_f and sector Θ_s.
    pub felt: Felt,
    /// w_a.
    pub attraction: f64,
    /// w_t.
    pub alignment: f64,
    /// Whether fibres are followed backwards.
    pub follow_backwards: bool,
}

impl From<&Fasciculation> for ContactLaw {
    fn from(law: &Fasciculation) -> Self {
        Self {
            felt: Felt::ahead(law.reach.0, law.sector.radians()),
            attraction: law.attraction.0,
            alignment: law.alignment.0,
            follow_backwards: law.follow_backwards,
        }
    }
}

impl<const D: usize> ContactPull<D> for ContactLaw {
    #[inline(always)]
    fn pull(&self, touch: &Touch<D>) -> [f64; D] {
        let toward = 6.75 * self.attraction / (self.felt.reach * self.felt.reach);
        let backwards = if self.follow_backwards { -1.0 } else { 0.0 };
        let forwards = if touch.along > 0.0 { 1.0 } else { 0.0 };
        let direction = if touch.along < 0.0 { backwards } else { forwards };
        let [w0, w1] = touch.moments;
        let tangential = toward * w1 + self.alignment / self.felt.reach * direction * w0;
        std::array::from_fn(|k| touch.normal[k] * (toward * w0) + touch.tangent[k] * tangential)
    }
}

fn attract(
    law: Res<Law<Fasciculation>>,
    table: Res<AdhesionTable>,
    mut index: ResMut<ShaftIndex>,
    scene: ShaftScene,
    mut counters: ResMut<Counters>,
    mut cones: Cones,
) {
    let contact = ContactLaw::from(&law.0);
    let feel = |contacts: &mut Contacts<2>, cone: &Asking, segments: &Segments<2>| {
        let sum = cone.sum(contacts, segments, (&contact.felt, &contact), table.row(cone.population));
        sum / sum.norm().max(1.0)
    };
    let asked = index.for_each(&scene, &mut cones, feel, |spring, pull| spring.pull += pull * law.weight.0);
    counters.neighbour_queries += asked as u64;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> ContactLaw {
        ContactLaw::from(&Fasciculation::default())
    }

    /// The pull of the segment from `a` to `b`, relative to the cone.
    fn pull(law: &ContactLaw, a: Vector3<f64>, b: Vector3<f64>, e: Vector3<f64>) -> Vector3<f64> {
        let (mut segments, mut contacts) = (Segments::default(), Contacts::<3>::default());
        segments.push(a.into(), b.into(), (0, 0));
        contacts.sum(([0.0; 3], e.into()), &segments, 1, (&law.felt, law), &[1.0]).into()
    }

    /// The integral by brute force: many midpoints, the sector tested point by point.
    fn brute_force(law: &ContactLaw, a: Vector3<f64>, b: Vector3<f64>, e: Vector3<f64>) -> Vector3<f64> {
        let n = 200_000;
        let (t, length) = ((b - a).normalize(), (b - a).norm());
        let mut sum = Vector3::zeros();
        for i in 0..n {
            let d = a + (b - a) * ((i as f64 + 0.5) / n as f64);
            let u = d.norm() / law.felt.reach;
            if u < 1.0 && d.dot(&e) >= law.felt.cos_sector * d.norm() {
                let sign = if t.dot(&e) > 0.0 { 1.0 } else { 0.0 };
                sum += d.normalize() * (law.attraction * attraction_profile(u))
                    + t * (law.alignment * alignment_profile(u) * sign);
            }
        }
        sum * (length / n as f64 / law.felt.reach)
    }

    #[test]
    fn a_segment_pulls_as_its_integral_says_in_any_place() {
        let law = law();
        let e = Vector3::new(0.6, 0.8, 0.0);
        for (a, b) in [
            ([3.0, -20.0, 0.0], [3.0, 20.0, 0.0]),
            ([-8.0, -2.0, 0.0], [9.0, 1.0, 0.0]),
            ([-30.0, 4.0, 0.0], [-1.0, -6.0, 0.0]),
            ([0.5, 0.5, 0.0], [2.5, 7.0, 0.0]),
            ([2.0, -3.0, 4.0], [-5.0, 6.0, -1.0]),
        ] {
            let (a, b) = (Vector3::from(a), Vector3::from(b));
            let error = (pull(&law, a, b, e) - brute_force(&law, a, b, e)).norm();
            assert!(error < 2e-5, "{a} {b}: {error}");
        }
    }

    #[test]
    fn cutting_a_segment_in_pieces_leaves_the_pull() {
        let law = law();
        let e = Vector3::new(0.0, 1.0, 0.0);
        let (a, b) = (Vector3::new(-9.0, 2.0, 0.0), Vector3::new(6.0, 7.0, 0.0));
        let whole = pull(&law, a, b, e);
        for pieces in [2, 3, 7, 40] {
            let sum: Vector3<f64> = (0..pieces)
                .map(|i| {
                    let at = |k: usize| a + (b - a) * (k as f64 / pieces as f64);
                    pull(&law, at(i), at(i + 1), e)
                })
                .sum();
            assert!((sum - whole).norm() < 1e-14, "{pieces}: {}", (sum - whole).norm());
        }
    }

    #[test]
    fn the_pull_turns_with_the_scene() {
        let law = law();
        let turned = nalgebra::Rotation3::from_euler_angles(0.4, -0.3, 1.1);
        let e = Vector3::new(0.28, 0.96, 0.0);
        let (a, b) = (Vector3::new(-4.0, 2.0, 0.0), Vector3::new(6.0, 5.0, 0.0));
        let turned_pull = pull(&law, turned * a, turned * b, turned * e);
        assert!((turned_pull - turned * pull(&law, a, b, e)).norm() < 1e-14);
    }

    #[test]
    fn a_fibre_that_comes_the_other_way_attracts_but_does_not_align() {
        let mut law = law();
        law.attraction = 0.0;
        let e = Vector3::new(0.0, 1.0, 0.0);
        let (a, b) = (Vector3::new(3.0, -5.0, 0.0), Vector3::new(3.0, 5.0, 0.0));
        assert!(pull(&law, a, b, e).y > 0.0);
        assert_eq!(pull(&law, b, a, e), Vector3::zeros());
        law.follow_backwards = true;
        assert!((pull(&law, b, a, e) - pull(&law, a, b, e)).norm() < 1e-15);
    }

    #[test]
    fn coincident_shafts_and_points_behind_the_sector_do_no_harm() {
        let law = law();
        let e = Vector3::new(0.0, 1.0, 0.0);
        let on_top = pull(&law, Vector3::new(0.0, -20.0, 0.0), Vector3::new(0.0, 20.0, 0.0), e);
        assert!(on_top.norm().is_finite() && on_top.x == 0.0);
        let behind = pull(&law, Vector3::new(0.0, -9.0, 0.0), Vector3::new(0.0, -1.0, 0.0), e);
        assert_eq!(behind, Vector3::zeros());
    }
}
