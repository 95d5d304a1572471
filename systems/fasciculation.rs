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

use super::shaft_index::{Asking, Segment, ShaftIndex, ShaftScene};
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
        ShaftIndex::install(model, self.reach.0);
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

impl ContactLaw {
    /// The integral of the law over one straight shaft segment, for a cone at `x` (µm) with unit heading `e`; without h,
    /// dimensionless.
    ///
    /// With s from the point nearest to the cone, n the vector from the cone to that point, ρ = √(n² + s²), u = ρ/R_f, both
    /// terms need only W₀ = ∫(1−u)² ds and W₁ = ∫(1−u)² s ds, since g_a(u) d̂ = 27/4 (1−u)² (n + s t)/R_f.
    #[inline]
    pub fn segment_pull(&self, segment: &Segment, x: Vector3<f64>, e: Vector3<f64>) -> Vector3<f64> {
        let t = segment.tangent;
        let from_cone = segment.start - x;
        let nearest = -from_cone.dot(&t);
        let n = from_cone + t * nearest;
        let (first, last) = (-nearest, segment.length - nearest);
        let (gap, room) = (n.norm_squared(), self.reach * self.reach - n.norm_squared());
        let outside = first.max(-last).max(0.0);
        if outside * outside >= room {
            return Vector3::zeros();
        }
        let half = room.sqrt();
        let (low, high) = (first.max(-half), last.min(half));
        let (along, across) = (t.dot(&e), n.dot(&e));
        let mut weights = [0.0; 2];
        if self.cos_sector <= 0.0 && across + along * low >= 0.0 && across + along * high >= 0.0 {
            weights = self.moments(gap, low, high);
        } else {
            let cuts = self.sector_cuts(gap, along, across, (low, high));
            for piece in cuts.windows(2) {
                let middle = 0.5 * (piece[0] + piece[1]);
                let distance = (gap + middle * middle).sqrt();
                if piece[1] > piece[0] && across + along * middle >= self.cos_sector * distance {
                    let part = self.moments(gap, piece[0], piece[1]);
                    weights = [weights[0] + part[0], weights[1] + part[1]];
                }
            }
        }
        self.combine(n, t, along, weights)
    }

    /// The pull from W₀ and W₁.
    fn combine(&self, n: Vector3<f64>, t: Vector3<f64>, along: f64, [w0, w1]: [f64; 2]) -> Vector3<f64> {
        let direction = match (along > 0.0, along < 0.0 && self.follow_backwards) {
            (true, _) => 1.0,
            (false, true) => -1.0,
            (false, false) => 0.0,
        };
        let toward = 6.75 * self.attraction / (self.reach * self.reach);
        n * (toward * w0) + t * (toward * w1 + self.alignment * direction * w0 / self.reach)
    }

    /// W₀ and W₁ over low ≤ s ≤ high, with n² = `gap`, in closed form:
    /// ∫u ds = [sρ + n² asinh(s/|n|)]/(2R), ∫u s ds = ρ³/(3R), u² a polynomial.
    #[inline]
    fn moments(&self, gap: f64, low: f64, high: f64) -> [f64; 2] {
        let r = 1.0 / self.reach;
        let (rho_low, rho_high) = ((gap + low * low).sqrt(), (gap + high * high).sqrt());
        // asinh(high/|n|) − asinh(low/|n|) by one logarithm, without cancellation for either sign.
        let log = if gap < 1e-24 {
            0.0
        } else if low >= 0.0 {
            ((high + rho_high) / (low + rho_low)).ln()
        } else if high <= 0.0 {
            ((rho_low - low) / (rho_high - high)).ln()
        } else {
            ((high + rho_high) * (rho_low - low) / gap).ln()
        };
        let (low2, high2) = (low * low, high * high);
        let linear = high - low;
        let w0 = linear - r * (high * rho_high - low * rho_low + gap * log)
            + r * r * (gap * linear + (high2 * high - low2 * low) / 3.0);
        let (cube_low, cube_high) = (rho_low * rho_low * rho_low, rho_high * rho_high * rho_high);
        let w1 = 0.5 * (high2 - low2) - r * (cube_high - cube_low) * (2.0 / 3.0)
            + r * r * (0.5 * gap * (high2 - low2) + 0.25 * (high2 * high2 - low2 * low2));
        [w0, w1]
    }

    /// low, the places between at which the segment crosses the sector's rim, high: (n·e + s t·e)² = cos²Θ_s (n² + s²).
    /// Roots that belong to the mirrored cone cut for nothing, which does no harm.
    fn sector_cuts(&self, gap: f64, along: f64, across: f64, (low, high): (f64, f64)) -> [f64; 4] {
        let c2 = self.cos_sector * self.cos_sector;
        let (a, b, c) = (along * along - c2, along * across, across * across - c2 * gap);
        let discriminant = b * b - a * c;
        if self.cos_sector < -1.0 || discriminant <= 0.0 || a == 0.0 {
            return [low, high, high, high];
        }
        let root = discriminant.sqrt();
        let (one, two) = ((-b - root) / a, (-b + root) / a);
        [low, one.min(two).clamp(low, high), one.max(two).clamp(low, high), high]
    }
}

fn attract(
    law: Res<Law<Fasciculation>>,
    table: Res<AdhesionTable>,
    mut index: ResMut<ShaftIndex>,
    scene: ShaftScene,
    axons: Res<ShaftPopulations>,
    mut counters: ResMut<Counters>,
    mut cones: Cones,
) {
    let contact = ContactLaw::from(&law.0);
    let asking = cones.collect(|cone, spring| Asking {
        index: cone.index as u32,
        population: cone.identity.population,
        site: cone.site,
        position: cone.position,
        heading: spring.heading,
    });
    counters.neighbour_queries += asking.len() as u64;
    let pulls = index.for_each(&scene, &asking, |cone, segments| {
        let mut sum = Vector3::zeros();
        for segment in segments.iter().filter(|segment| segment.shaft != cone.index) {
            let adhesion = table.between(cone.population, axons.0[segment.shaft as usize]);
            sum += contact.segment_pull(segment, cone.position, cone.heading) * adhesion;
        }
        sum / sum.norm().max(1.0)
    });
    cones.add_pulls(&pulls, law.weight.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> ContactLaw {
        ContactLaw::from(&Fasciculation::default())
    }

    /// The pull of the segment from `a` to `b`, relative to the cone.
    fn pull(law: &ContactLaw, a: Vector3<f64>, b: Vector3<f64>, e: Vector3<f64>) -> Vector3<f64> {
        let length = (b - a).norm();
        let segment = Segment { start: a, tangent: (b - a) / length, length, shaft: 0 };
        law.segment_pull(&segment, Vector3::zeros(), e)
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
