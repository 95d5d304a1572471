//! Cone release: growth cones give off cues that other cones turn by, attraction that bundles or repulsion that debundles.
//!
//! Hentschel and van Ooyen (Proc. R. Soc. Lond. B 266, 1999): cones release an attractant, and near their target a repellent the more
//! the more of the target's cue they sense. What cones give off spreads fast against their growth, so it is in equilibrium with where
//! they are: a sum of Green's functions of −DΔc + kc. Ours: a cone is a disc of radius a that releases evenly at the rate q (nM/h), so
//! that nothing is singular; with ℓ = √(D/k), α = a/ℓ and the distance r from another cone,
//!
//! ```text
//! c(r) = (q/k) α I₁(α) K₀(r/ℓ)               outside: (q a²/(2D)) K₀(r/ℓ) for a small cone
//! c(r) = (q/k) [1 − α K₁(α) I₀(r/ℓ)]         inside; dc/dr is continuous
//! L̂ += clip₁(Σ_i ± λ_i a_s K_i ∇c_i/(K_i + c_i)²/0.025),   q_j ← q c_t^n/(C^n + c_t^n) where a cue c_t activates the release
//! ```
//!
//! Ours as well: a cone does not feel its own release; only growing cones release, arrived ones have stopped; borders of the tissue
//! are not seen; the sensing. Cones farther than 8ℓ are left out: each would add less than 3e-4 of what it does at ℓ. All positions
//! are those of the stage, so the order of the integrator is kept; sums are taken in the order of the cones' numbers.

use super::cue_fields::Cues;
use crate::numerics::bessel::{decaying, growing};
use crate::prelude::*;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use std::collections::BTreeMap;

/// Whether a released cue attracts or repels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Released {
    /// Cones turn toward other cones.
    Attract,
    /// Cones turn away from other cones.
    Repel,
}

keys! {
    /// A cue of the tissue that switches a release on; factor c^n/(C^n + c^n) at the cone.
    pub struct Activation {
        /// The cue, one of `cues`.
        pub cue: String = String::new(),
        /// Concentration C of half the full release. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub half_at: Concentration = Concentration(1.0),
        /// Exponent n. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 16.0, "x-typical" = [1.0, 4.0]))]
        pub steepness: Factor = Factor(2.0),
    }

    /// One cue that cones give off and sense.
    pub struct ReleasedCue {
        /// Whether it attracts or repels.
        pub effect: Released = Released::Attract,
        /// Weight λ. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
        pub weight: Factor = Factor(1.0),
        /// Diffusivity D. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [144.0, 216000.0]))]
        pub diffusion: Diffusivity = Diffusivity(3_600.0),
        /// Degradation rate k; decay length ℓ = √(D/k). Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.36, 18.0]))]
        pub degradation: Rate = Rate(3.6),
        /// Release rate q inside a cone. Absent: 50 k · 1 nM. Ours.
        #[schemars(extend("minimum" = 0.0))]
        pub release_rate: Option<ReleaseRate> = None,
        /// Dissociation constant K of its receptor.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.3, 3.0]))]
        pub dissociation_constant: Concentration = Concentration(1.0),
        /// What switches its release on. Absent: it is always released.
        pub activated_by: Option<Activation> = None,
    }

    /// Cues that growth cones themselves release; L̂ += clip₁(Σ ± λ s), c = Σ_j (q/k) (a/ℓ) I₁(a/ℓ) K₀(r_j/ℓ).
    pub struct ConeRelease {
        /// Radius a of a cone, inside which it releases. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [2.0, 10.0]))]
        pub cone_radius: Length = Length(5.0),
        /// Length a_s across which a cone compares concentrations.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 15.0]))]
        pub sensing_length: Length = Length(10.0),
        /// The cues, by names of their own.
        pub cues: BTreeMap<String, ReleasedCue> = BTreeMap::new(),
    }
}

/// Cones farther than this many decay lengths are left out.
const CUT_OFF: f64 = 8.0;
/// Parts of a radius in the table of a cone's field: cubics are within 1e-7 of the field at the rim, and closer beyond.
const PARTS_A_RADIUS: f64 = 32.0;
/// Cap on the parts of the table.
const MOST_PARTS: f64 = 65_536.0;
/// Cones of one task at least: fixed, so that the work is cut the same way on any number of threads.
const CHUNK: usize = 16;

impl Mechanism for ConeRelease {
    const NAME: &'static str = "cone_release";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        wrong.demand(!self.cues.is_empty(), "/cues", || {
            "name what cones release, such as {\"attractant\": {\"effect\": \"attract\"}}".into()
        });
        for (name, cue) in &self.cues {
            if let Some(activation) = &cue.activated_by {
                Cues::demand_known(facts, &mut wrong, &activation.cue, &format!("/cues/{name}/activated_by/cue"));
            }
        }
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        for activation in self.cues.values().filter_map(|cue| cue.activated_by.as_ref()) {
            CueFields::demand(model, &activation.cue);
        }
        for (name, cue) in &self.cues {
            let length = (cue.diffusion.0 / cue.degradation.0).sqrt();
            model.plan().derive(format!("released cue `{name}`: decay length"), length, "um");
        }
        model.pulls_up_to(1.0);
        model.plan().work(Self::NAME, Work::Neighbourhood, self.cues.len() as f64, Each::ConeStage);
        model.acts_between_cones();
        model.insert_law(self).term(Term::Sample, steer).at_end(bind);
        Ok(())
    }
}

/// The field of one cone: a disc of radius a that releases evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct Plume {
    /// Decay length ℓ (µm).
    pub length: f64,
    /// Radius a (µm).
    pub radius: f64,
    /// q/k (nM).
    pub level: f64,
    /// α I₁(α), of the outside.
    outside: f64,
    /// α K₁(α), of the inside.
    inside: f64,
    /// c, dc/dr and d²c/dr² at the rim and every `spacing` (µm) from there to the cut-off: cubics between them.
    table: Vec<[f64; 3]>,
    spacing: f64,
}

impl Plume {
    /// The field of a cone of `radius` (µm) for D (µm²/h), k (1/h) and q (nM/h).
    pub fn new((diffusion, degradation): (f64, f64), release: f64, radius: f64) -> Self {
        let length = (diffusion / degradation).sqrt();
        let alpha = radius / length;
        let ([_, i1], [_, k1]) = (growing(alpha), decaying(alpha));
        let level = release / degradation;
        let mut plume =
            Self { length, radius, level, outside: alpha * i1, inside: alpha * k1, table: Vec::new(), spacing: 1.0 };
        let way = (CUT_OFF * length - radius).max(0.0);
        let parts = (way / radius * PARTS_A_RADIUS).ceil().clamp(1.0, MOST_PARTS);
        plume.spacing = way / parts;
        plume.table = (0..=parts as usize)
            .filter(|_| way > 0.0)
            .map(|i| {
                let r = radius + i as f64 * plume.spacing;
                let (c, slope) = plume.outside(r);
                [c, slope, c / (length * length) - slope / r]
            })
            .collect();
        plume
    }

    fn outside(&self, distance: f64) -> (f64, f64) {
        let [k0, k1] = decaying(distance / self.length);
        (self.level * self.outside * k0, -self.level * self.outside * k1 / self.length)
    }

    /// c (nM) and dc/dr (nM/µm) at a distance r (µm) from the cone's middle.
    pub fn at(&self, distance: f64) -> (f64, f64) {
        if distance < self.radius {
            let [i0, i1] = growing(distance / self.length);
            return (self.level * (1.0 - self.inside * i0), -self.level * self.inside * i1 / self.length);
        }
        let place = (distance - self.radius) / self.spacing;
        match self.table.get(place as usize..).unwrap_or_default() {
            [from, to, ..] => {
                let t = place.fract();
                let cubic = |k: usize| {
                    let r = 1.0 - t;
                    let ends = (1.0 + 2.0 * t) * r * r * from[k] + t * t * (3.0 - 2.0 * t) * to[k];
                    ends + self.spacing * t * r * (r * from[k + 1] - t * to[k + 1])
                };
                (cubic(0), cubic(1))
            }
            _ => self.outside(distance),
        }
    }

    /// What a cone at `from` (µm) senses of cones at the given places, each releasing the given share of q.
    pub fn sum(&self, from: Vector3<f64>, others: impl Iterator<Item = (Vector3<f64>, f64)>) -> CueSample {
        let mut sample = CueSample { concentration: 0.0, gradient: Vector3::zeros() };
        for (place, share) in others {
            let away = from - place;
            let distance = away.norm();
            if distance <= CUT_OFF * self.length {
                let (c, slope) = self.at(distance);
                sample.concentration += share * c;
                if distance > 0.0 {
                    sample.gradient += away * (share * slope / distance);
                }
            }
        }
        sample
    }
}

impl Activation {
    /// Share of the full release at a concentration (nM) of the activating cue.
    pub fn share(&self, concentration: f64) -> f64 {
        let ratio = (concentration / self.half_at.0).powf(self.steepness.0);
        if ratio.is_finite() { ratio / (1.0 + ratio) } else { 1.0 }
    }
}

/// A released cue as systems need it.
#[derive(Debug, Clone)]
struct Bound {
    plume: Plume,
    signed_weight: f64,
    dissociation: f64,
    activation: Option<(usize, Activation)>,
}

#[derive(Debug, Resource)]
struct Plumes(Vec<Bound>);

fn bind(world: &mut World) -> Result<(), InstallError> {
    let law = world.resource::<Law<ConeRelease>>();
    let mut bound = Vec::new();
    for (name, cue) in &law.cues {
        let pointer = format!("/cues/{name}/activated_by/cue");
        let number = |activation: &Activation| {
            CueFields::number(world, &activation.cue, &pointer).map(|number| (number, activation.clone()))
        };
        let release = cue.release_rate.map_or(50.0 * cue.degradation.0, |q| q.0);
        let sign = if cue.effect == Released::Attract { 1.0 } else { -1.0 };
        bound.push(Bound {
            plume: Plume::new((cue.diffusion.0, cue.degradation.0), release, law.cone_radius.0),
            signed_weight: sign * cue.weight.0,
            dissociation: cue.dissociation_constant.0,
            activation: cue.activated_by.as_ref().map(number).transpose()?,
        });
    }
    world.insert_resource(Plumes(bound));
    Ok(())
}

fn steer(
    law: Res<Law<ConeRelease>>,
    plumes: Res<Plumes>,
    tissue: Res<Tissue>,
    fields: Option<Res<CueFields>>,
    mut cones: Cones,
) {
    let growing = cones.collect(|cone, _| (cone.position, cone.site));
    let shares: Vec<Vec<f64>> = plumes
        .0
        .iter()
        .map(|bound| match (&bound.activation, &fields) {
            (Some((cue, activation)), Some(fields)) => {
                let share =
                    |(_, site): &(_, Site)| activation.share(fields.sample(&tissue.mesh, *cue, *site).concentration);
                growing.iter().map(share).collect()
            }
            _ => vec![1.0; growing.len()],
        })
        .collect();
    let entry = |(i, (place, _)): (usize, &(Vector3<f64>, Site))| GeomWithData::new([place.x, place.y], i);
    let tree = RTree::bulk_load(growing.iter().enumerate().map(entry).collect());
    let farthest = plumes.0.iter().map(|bound| CUT_OFF * bound.plume.length).fold(0.0, f64::max);
    let pull = |near: &mut Vec<usize>, (own, (place, _)): (usize, &(Vector3<f64>, Site))| {
        near.clear();
        let found = tree.locate_within_distance([place.x, place.y], farthest * farthest);
        near.extend(found.map(|entry| entry.data).filter(|other| *other != own));
        near.sort_unstable();
        let mut sum = Vector3::zeros();
        for (bound, shares) in plumes.0.iter().zip(&shares) {
            let others = near.iter().map(|&other| (growing[other].0, shares[other]));
            let sample = bound.plume.sum(*place, others);
            sum += sample.occupancy_difference(bound.dissociation, law.sensing_length.0) * bound.signed_weight;
        }
        sum / sum.norm().max(1.0)
    };
    let pulls: Vec<_> = growing.par_iter().enumerate().with_min_len(CHUNK).map_init(Vec::new, pull).collect();
    cones.add_pulls(&pulls, 1.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plume() -> Plume {
        Plume::new((3600.0, 3.6), 180.0, 5.0)
    }

    #[test]
    fn what_a_cone_releases_is_degraded_and_its_field_solves_the_equation_on_both_sides_of_its_rim() {
        let plume = plume();
        let (mut total, dr) = (0.0, 0.01);
        for i in 0..100_000 {
            let r = (f64::from(i) + 0.5) * dr;
            total += plume.at(r).0 * std::f64::consts::TAU * r * dr;
        }
        let released = 180.0 * std::f64::consts::PI * 25.0;
        assert!((3.6 * total / released - 1.0).abs() < 1e-6, "{}", 3.6 * total / released);
        let ((below, slope_below), (above, slope_above)) = (plume.at(5.0 - 1e-9), plume.at(5.0));
        assert!((below - above).abs() < 1e-8 && (slope_below - slope_above).abs() < 1e-8);
        for r in [1.0, 3.0, 8.0, 40.0, 150.0] {
            let h = 1e-3 * r;
            let [left, middle, right] = [r - h, r, r + h].map(|r| plume.at(r));
            assert!(((right.0 - left.0) / (2.0 * h) - middle.1).abs() < 1e-5 * middle.1.abs(), "{r}");
            let curvature = (right.1 - left.1) / (2.0 * h) + middle.1 / r;
            let source = if r < 5.0 { 180.0 } else { 0.0 };
            let left_over = 3600.0 * curvature - 3.6 * middle.0 + source;
            assert!(left_over.abs() < 1e-4 * (3.6 * middle.0 + source), "{r} {left_over}");
        }
    }

    #[test]
    fn the_table_of_a_field_is_as_good_as_the_field() {
        let plume = plume();
        for i in 0..5000 {
            let r = 5.0 + 0.05 * f64::from(i);
            let (found, exact) = (plume.at(r), plume.outside(r));
            assert!((found.0 / exact.0 - 1.0).abs() < 1e-7 && (found.1 / exact.1 - 1.0).abs() < 1e-7, "{r}");
        }
    }

    #[test]
    fn two_small_cones_feel_the_green_function_of_each_other() {
        let (length, q) = (50.0, 400.0);
        let plume = Plume::new((9000.0, 9000.0 / (length * length)), q, 0.05);
        let amount = q * std::f64::consts::PI * 0.05 * 0.05;
        for r in [10.0, 50.0, 90.0] {
            let away = Vector3::new(0.6, -0.8, 0.0) * r;
            let sample = plume.sum(away, std::iter::once((Vector3::zeros(), 1.0)));
            let [k0, k1] = decaying(r / length);
            let c = amount / (std::f64::consts::TAU * 9000.0) * k0;
            let slope = amount / (std::f64::consts::TAU * 9000.0 * length) * k1;
            assert!((sample.concentration / c - 1.0).abs() < 1e-6);
            assert!((sample.gradient + away / r * slope).norm() < 1e-6 * slope, "toward the other");
        }
    }

    #[test]
    fn the_cones_left_out_are_those_beyond_eight_decay_lengths() {
        let plume = plume();
        let at = |r: f64| plume.sum(Vector3::x() * r, std::iter::once((Vector3::zeros(), 1.0))).gradient.norm();
        let length = plume.length;
        assert_eq!(at(8.001 * length), 0.0);
        assert!(at(7.999 * length) > 0.0 && at(7.999 * length) < 3e-4 * at(length));
    }

    #[test]
    fn an_activated_release_is_half_at_its_concentration_and_saturates() {
        let activation = Activation { half_at: Concentration(2.0), steepness: Factor(3.0), ..Activation::default() };
        assert_eq!((activation.share(0.0), activation.share(2.0)), (0.0, 0.5));
        assert!((activation.share(4.0) - 8.0 / 9.0).abs() < 1e-14 && activation.share(1e200) == 1.0);
        let plume = plume();
        let whole = plume.sum(Vector3::x() * 20.0, std::iter::once((Vector3::zeros(), 1.0)));
        let none = plume.sum(Vector3::x() * 20.0, std::iter::once((Vector3::zeros(), 0.0)));
        assert!(none.gradient == Vector3::zeros() && whole.gradient.x < 0.0);
    }

    #[test]
    fn what_is_sensed_turns_with_the_scene_and_two_at_one_place_do_not_feel_a_direction() {
        let (plume, turned) = (plume(), Rotation3::from_euler_angles(0.0, 0.0, 1.1));
        let places = [Vector3::new(12.0, 3.0, 0.0), Vector3::new(-4.0, 31.0, 0.0), Vector3::new(1.0, -2.0, 0.0)];
        let of = |rotation: Rotation3<f64>| plume.sum(Vector3::zeros(), places.iter().map(|&x| (rotation * x, 0.7)));
        let (sample, other) = (of(Rotation3::identity()), of(turned));
        assert!((other.gradient - turned * sample.gradient).norm() < 1e-14);
        assert!((other.concentration - sample.concentration).abs() < 1e-14);
        let same = plume.sum(places[0], std::iter::once((places[0], 1.0)));
        assert!(same.gradient == Vector3::zeros() && same.concentration > 0.0);
    }
}
