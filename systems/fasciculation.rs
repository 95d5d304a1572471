//! Fasciculation: homophilic attraction between growth cones and the shafts of other axons.
//!
//! Ours in form and numbers (the paper's Section 3 is missing from its text): over the parts of other axons' shafts
//! within reach R_f and within ±Θ_s of the heading,
//!
//! ```text
//! F = Σ_axons ∫ h [ w_a g_a(d/R_f) d̂ + w_t g_t(d/R_f) sgn(t·e_g) t ] ds / R_f,   g_a(u) = 27/4 u(1−u)²,  g_t(u) = (1−u)²
//! ```
//!
//! F ← F / max(1, |F|), L̂ += λ_f F. The integral is taken over clipped segments with a fixed quadrature, so it depends neither
//! on Δt nor on how finely a shaft is stored. A fibre is not followed backwards, toward its origin, unless a key allows it. All
//! cones read the shafts of the step's start: the result does not depend on their order, and contact is of first order in
//! Δt whatever the method.

use super::shaft_index::{ShaftIndex, ShaftScene};
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
        let populations = &model.world.resource::<Populations>().0;
        if populations.iter().map(|population| population.count).sum::<usize>() < 2 {
            return Ok(());
        }
        let table = AdhesionTable::new(&self.adhesion, populations);
        ShaftIndex::install(model);
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

    fn between(&self, row: u16, column: u16) -> f64 {
        self.values[row as usize * self.count + column as usize]
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
    /// Reach R_f (µm).
    pub reach: f64,
    /// cos Θ_s.
    pub cos_sector: f64,
    /// w_a.
    pub attraction: f64,
    /// w_t.
    pub alignment: f64,
    /// Whether fibres are followed backwards.
    pub follow_backwards: bool,
}

impl From<&Fasciculation> for ContactLaw {
    fn from(law: &Fasciculation) -> Self {
        let sector = law.sector.radians();
        Self {
            reach: law.reach.0,
            cos_sector: if law.sector.0 >= 180.0 { -2.0 } else { sector.cos() },
            attraction: law.attraction.0,
            alignment: law.alignment.0,
            follow_backwards: law.follow_backwards,
        }
    }
}

/// Longest panel of the quadrature, as a share of the reach: two Gauss points each.
const PANEL: f64 = 0.5;
/// Gauss points of a panel, from its middle, in half-lengths.
const GAUSS: f64 = 0.577_350_269_189_625_8;

impl ContactLaw {
    /// The integral of the law over one straight shaft segment from `a` to `b` (µm, relative to the cone), which grew in
    /// that direction, for a cone with unit heading `e`; without h, dimensionless.
    pub fn segment_pull(&self, a: Vector3<f64>, b: Vector3<f64>, e: Vector3<f64>) -> Vector3<f64> {
        let chord = b - a;
        let length = chord.norm();
        if length == 0.0 {
            return Vector3::zeros();
        }
        let t = chord / length;
        let Some((low, high)) = clip_to_ball(a, t, length, self.reach) else { return Vector3::zeros() };
        let mut cuts = [low, high, high, high];
        let pieces = self.cut_by_sector(a, t, e, &mut cuts);
        let mut sum = Vector3::zeros();
        for piece in cuts[..=pieces].windows(2) {
            let middle = a + t * (0.5 * (piece[0] + piece[1]));
            if piece[1] > piece[0] && middle.dot(&e) >= self.cos_sector * middle.norm() {
                sum += self.quadrature(a, t, e, piece[0], piece[1]);
            }
        }
        sum / self.reach
    }

    /// Adds the places in (low, high) at which the segment crosses the sector's rim; returns the number of pieces.
    fn cut_by_sector(&self, a: Vector3<f64>, t: Vector3<f64>, e: Vector3<f64>, cuts: &mut [f64; 4]) -> usize {
        let (low, high) = (cuts[0], cuts[1]);
        if self.cos_sector < -1.0 {
            return 1;
        }
        let c2 = self.cos_sector * self.cos_sector;
        let (te, ae) = (t.dot(&e), a.dot(&e));
        let qa = te * te - c2;
        let qb = te * ae - c2 * a.dot(&t);
        let qc = ae * ae - c2 * a.norm_squared();
        let root = qb * qb - qa * qc;
        if root <= 0.0 || qa == 0.0 {
            return 1;
        }
        let root = root.sqrt();
        let (first, second) = ((-qb - root) / qa, (-qb + root) / qa);
        let mut pieces = 1;
        for s in [first.min(second), first.max(second)] {
            if s > low && s < high {
                cuts[pieces] = s;
                pieces += 1;
            }
        }
        cuts[pieces] = high;
        pieces
    }

    fn quadrature(&self, a: Vector3<f64>, t: Vector3<f64>, e: Vector3<f64>, low: f64, high: f64) -> Vector3<f64> {
        let along = t.dot(&e);
        let direction = if along > 0.0 {
            1.0
        } else if along < 0.0 && self.follow_backwards {
            -1.0
        } else {
            0.0
        };
        let panels = ((high - low) / (PANEL * self.reach)).ceil().max(1.0);
        let half = 0.5 * (high - low) / panels;
        let (mut toward, mut aligned) = (Vector3::zeros(), 0.0);
        for panel in 0..panels as usize {
            let middle = low + (2 * panel + 1) as f64 * half;
            for s in [middle - GAUSS * half, middle + GAUSS * half] {
                let d = a + t * s;
                let distance = d.norm();
                let u = (distance / self.reach).min(1.0);
                // g_a(u) d̂ = 27/4 (1 − u)² d / R_f, which needs no division at contact.
                toward += d * (6.75 * (1.0 - u) * (1.0 - u));
                aligned += alignment_profile(u);
            }
        }
        (toward * (self.attraction / self.reach) + t * (self.alignment * direction * aligned)) * half
    }
}

/// The part of the segment a + s t, 0 ≤ s ≤ length, inside the ball of radius r about the origin.
fn clip_to_ball(a: Vector3<f64>, t: Vector3<f64>, length: f64, r: f64) -> Option<(f64, f64)> {
    let nearest = -a.dot(&t);
    let gap = (a + t * nearest).norm_squared();
    if gap >= r * r {
        return None;
    }
    let half = (r * r - gap).sqrt();
    let (low, high) = ((nearest - half).max(0.0), (nearest + half).min(length));
    (low < high).then_some((low, high))
}

fn attract(
    law: Res<Law<Fasciculation>>,
    table: Res<AdhesionTable>,
    index: Res<ShaftIndex>,
    scene: ShaftScene,
    axons: Res<ShaftPopulations>,
    mut counters: ResMut<Counters>,
    mut cones: Cones,
) {
    let contact = ContactLaw::from(&law.0);
    counters.neighbour_queries += cones.for_each_init(Vec::new, |found, cone, spring| {
        index.candidates(&scene, cone.site, contact.reach, found);
        let mut sum = Vector3::zeros();
        scene.for_segments(found, cone.index as u32, |shaft, start, end| {
            let adhesion = table.between(cone.identity.population, axons.0[shaft as usize]);
            if adhesion != 0.0 {
                let (a, b) = (start - cone.position, end - cone.position);
                sum += contact.segment_pull(a, b, spring.heading) * adhesion;
            }
        });
        spring.pull += sum * (law.weight.0 / sum.norm().max(1.0));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> ContactLaw {
        ContactLaw::from(&Fasciculation::default())
    }

    /// The integral by brute force: many midpoints, the sector tested point by point.
    fn brute_force(law: &ContactLaw, a: Vector3<f64>, b: Vector3<f64>, e: Vector3<f64>) -> Vector3<f64> {
        let n = 200_000;
        let (t, length) = ((b - a).normalize(), (b - a).norm());
        let mut sum = Vector3::zeros();
        for i in 0..n {
            let d = a + (b - a) * ((i as f64 + 0.5) / n as f64);
            let u = d.norm() / law.reach;
            if u < 1.0 && d.dot(&e) >= law.cos_sector * d.norm() {
                let sign = if t.dot(&e) > 0.0 { 1.0 } else { 0.0 };
                sum += d.normalize() * (law.attraction * attraction_profile(u))
                    + t * (law.alignment * alignment_profile(u) * sign);
            }
        }
        sum * (length / n as f64 / law.reach)
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
            let error = (law.segment_pull(a, b, e) - brute_force(&law, a, b, e)).norm();
            assert!(error < 2e-3, "{a} {b}: {error}");
        }
    }

    #[test]
    fn cutting_a_segment_in_pieces_leaves_the_pull() {
        let law = law();
        let e = Vector3::new(0.0, 1.0, 0.0);
        let (a, b) = (Vector3::new(-9.0, 2.0, 0.0), Vector3::new(6.0, 7.0, 0.0));
        let whole = law.segment_pull(a, b, e);
        for pieces in [2, 3, 7, 40] {
            let sum: Vector3<f64> = (0..pieces)
                .map(|i| {
                    let at = |k: usize| a + (b - a) * (k as f64 / pieces as f64);
                    law.segment_pull(at(i), at(i + 1), e)
                })
                .sum();
            assert!((sum - whole).norm() < 2e-3, "{pieces}: {}", (sum - whole).norm());
        }
    }

    #[test]
    fn the_pull_turns_with_the_scene() {
        let law = law();
        let turned = nalgebra::Rotation3::from_euler_angles(0.4, -0.3, 1.1);
        let e = Vector3::new(0.28, 0.96, 0.0);
        let (a, b) = (Vector3::new(-4.0, 2.0, 0.0), Vector3::new(6.0, 5.0, 0.0));
        let pull = law.segment_pull(turned * a, turned * b, turned * e);
        assert!((pull - turned * law.segment_pull(a, b, e)).norm() < 1e-14);
    }

    #[test]
    fn a_fibre_that_comes_the_other_way_attracts_but_does_not_align() {
        let mut law = law();
        law.attraction = 0.0;
        let e = Vector3::new(0.0, 1.0, 0.0);
        let (a, b) = (Vector3::new(3.0, -5.0, 0.0), Vector3::new(3.0, 5.0, 0.0));
        assert!(law.segment_pull(a, b, e).y > 0.0);
        assert_eq!(law.segment_pull(b, a, e), Vector3::zeros());
        law.follow_backwards = true;
        assert!((law.segment_pull(b, a, e) - law.segment_pull(a, b, e)).norm() < 1e-15);
    }

    #[test]
    fn coincident_shafts_and_points_behind_the_sector_do_no_harm() {
        let law = law();
        let e = Vector3::new(0.0, 1.0, 0.0);
        let on_top = law.segment_pull(Vector3::new(0.0, -20.0, 0.0), Vector3::new(0.0, 20.0, 0.0), e);
        assert!(on_top.norm().is_finite() && on_top.x == 0.0);
        let behind = law.segment_pull(Vector3::new(0.0, -9.0, 0.0), Vector3::new(0.0, -1.0, 0.0), e);
        assert_eq!(behind, Vector3::zeros());
    }
}
