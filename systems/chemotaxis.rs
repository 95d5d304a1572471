//! Chemotaxis: growth cones turn up or down the gradients of cues.
//!
//! L̂ += clip₁(Σ_i λ_i(t) s_i), s_i = ± G(c_i, ∇c_i) ∇c_i/|∇c_i|, clip₁(v) = v / max(1, |v|). The paper gives the weights λ_i(t) as an idea
//! ("time availability of receptors", "receptor-mediated silencing"); ours is every form and number:
//! λ_i(t) = λ_i0 · availability(t) · Π_{j≠i} (1 − η_ij c_j / (K_j + c_j)), and the three ways G of sensing.

use super::cue_fields::{CueFields, CueSample, Cues};
use crate::model::components::ReceptorWeights;
use crate::model::cones::ConesWith;
use crate::model::observables::{Effect as Seen, Observables};
use crate::numerics::piecewise::value_and_slope;
use crate::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How strong the pull of a gradient is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// 1 where |∇c| a / c exceeds the threshold, else 0: the paper's reading.
    Direction,
    /// Difference of receptor occupancy across the cone, a K_d |∇c| / (K_d + c)², over 0.025, its value at 10 % per 10 µm and c = K_d.
    Occupancy,
    /// μ √(γ/(1+γ)³), γ = c/K_d, μ = a |∇c| / c, over its value 0.1/√8 at the same point.
    SignalToNoise,
}

/// Whether a cue attracts or repels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Up the gradient.
    Attract,
    /// Down the gradient.
    Repel,
}

/// The time that availability runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClockOf {
    /// The age of the axon.
    Age,
    /// The time of the scene.
    Scene,
}

keys! {
    /// When a receptor is available: a logistic onset and offset, or a table.
    pub struct Availability {
        /// Time at which it is half there. Absent: from the start.
        pub onset: Option<Time> = None,
        /// Time at which it is half gone. Absent: never.
        pub offset: Option<Time> = None,
        /// Time scale of onset and offset; 0 is a step.
        #[schemars(extend("minimum" = 0.0))]
        pub width: Time = Time(1.0),
        /// Pairs [time in h, availability in [0, 1]], ascending, joined by straight lines; instead of onset and offset.
        pub table: Vec<[f64; 2]> = Vec::new(),
        /// Whose clock it runs on. Ours: the axon's age.
        pub clock: ClockOf = ClockOf::Age,
    }

    /// How a cue silences a receptor: factor 1 − η c/(K + c).
    pub struct Silencing {
        /// Strength η.
        #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
        pub strength: Factor = Factor(1.0),
        /// Concentration K of half effect. Absent: the dissociation constant of that receptor.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub half_at: Option<Concentration> = None,
    }

    /// One receptor: what it does with the cue of its name.
    pub struct Receptor {
        /// Whether the cue attracts or repels.
        pub effect: Effect = Effect::Attract,
        /// Weight λ_i0. Ours.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
        pub weight: Factor = Factor(1.0),
        /// Dissociation constant K_d.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.3, 3.0]))]
        pub dissociation_constant: Concentration = Concentration(1.0),
        /// When it is available. Absent: always.
        pub availability: Option<Availability> = None,
        /// Which other cues silence it.
        pub silenced_by: BTreeMap<String, Silencing> = BTreeMap::new(),
        /// The populations that have it. Empty: all.
        pub populations: Vec<String> = Vec::new(),
    }

    /// Turning by the gradients of diffusible cues; L̂ += clip₁(Σ λ_i s_i).
    pub struct Chemotaxis {
        /// How strong the pull of a gradient is. Ours: occupancy; the paper's reading is `direction`.
        pub sensing: Sensing = Sensing::Occupancy,
        /// Length a across which a cone compares concentrations.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 15.0]))]
        pub sensing_length: Length = Length(10.0),
        /// Smallest relative difference |∇c| a / c that `direction` senses. Source: Goodhill 1997.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.001, 0.05]))]
        pub threshold: Factor = Factor(0.01),
        /// The receptors, by the name of the cue that each senses.
        pub receptors: BTreeMap<String, Receptor> = BTreeMap::new(),
    }
}

impl Mechanism for Chemotaxis {
    const NAME: &'static str = "chemotaxis";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        let cues = facts.names_in(Cues::NAME);
        if cues.is_empty() && !self.receptors.is_empty() {
            wrong.push("", "the scene has no cues for these receptors; leave `chemotaxis` out as well");
            return wrong;
        }
        for (name, receptor) in &self.receptors {
            let at = format!("/receptors/{name}");
            Cues::demand_known(facts, &mut wrong, name, &at);
            for other in receptor.silenced_by.keys() {
                let place = format!("{at}/silenced_by/{other}");
                Cues::demand_known(facts, &mut wrong, other, &place);
                wrong.demand(other != name, &place, || "a receptor cannot be silenced by its own cue".into());
            }
            for population in receptor.populations.iter().filter(|p| !facts.populations.contains(p)) {
                wrong.push(format!("{at}/populations"), unknown_name("population", population, &facts.populations));
            }
            if let Some(availability) = &receptor.availability {
                availability.check(&format!("{at}/availability"), &mut wrong);
            }
        }
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if self.receptors.is_empty() {
            model.plan().leave_out(Self::NAME, "no receptor is given: nothing is sensed");
            return Ok(());
        }
        for (name, receptor) in &self.receptors {
            CueFields::demand(model, name);
            receptor.silenced_by.keys().for_each(|other| CueFields::demand(model, other));
            let seen = match receptor.effect {
                Effect::Attract => Seen::Attract,
                Effect::Repel => Seen::Repel,
            };
            model.world.resource_mut::<Observables>().effects.entry(name.clone()).or_insert(seen);
        }
        let names: Vec<String> =
            model.world.resource::<Populations>().0.iter().map(|population| population.name.clone()).collect();
        let initial: Vec<Arc<[f64]>> = names.iter().map(|name| self.initial_weights(name)).collect();
        model.attach(move |cone| ReceptorWeights(initial[cone.population as usize].clone()));
        let changing = self.receptors.values().any(|r| r.availability.is_some() || !r.silenced_by.is_empty());
        if changing {
            model.plan().keep("receptor weights over time", "availability or silencing changes them");
            model.term(Term::Weigh, weigh);
        } else {
            model.plan().leave_out("receptor weights over time", "no receptor has an availability or is silenced");
        }
        model.pulls_up_to(1.0);
        model.plan().work(Self::NAME, Work::Sampled, self.receptors.len() as f64, Each::ConeStage);
        model.insert_law(self).term(Term::Sample, sample).at_end(bind_receptors);
        Ok(())
    }
}

impl Chemotaxis {
    fn initial_weights(&self, population: &String) -> Arc<[f64]> {
        let weight = |r: &Receptor| {
            if r.populations.is_empty() || r.populations.contains(population) { r.weight.0 } else { 0.0 }
        };
        self.receptors.values().map(weight).collect()
    }
}

impl Availability {
    fn check(&self, at: &str, wrong: &mut Violations) {
        let table = &self.table;
        wrong.demand(table.is_empty() || (self.onset.is_none() && self.offset.is_none()), at, || {
            "give either a table or an onset and offset".into()
        });
        wrong
            .demand(table.windows(2).all(|w| w[0][0] < w[1][0]), &format!("{at}/table"), || "times must ascend".into());
        wrong.demand(table.iter().all(|pair| (0.0..=1.0).contains(&pair[1])), &format!("{at}/table"), || {
            "an availability lies in [0, 1]".into()
        });
    }

    /// Availability in [0, 1] at a time (h) of its own clock.
    pub fn at(&self, time: f64) -> f64 {
        if !self.table.is_empty() {
            return value_and_slope(&self.table, time).map_or(1.0, |(value, _)| value);
        }
        let rise = |from: f64| {
            if self.width.0 > 0.0 { logistic((time - from) / self.width.0) } else { f64::from(time >= from) }
        };
        self.onset.map_or(1.0, |t| rise(t.0)) * self.offset.map_or(1.0, |t| 1.0 - rise(t.0))
    }
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// A receptor bound to the numbers of its cues.
#[derive(Debug, Clone)]
struct Bound {
    cue: usize,
    sign: f64,
    receptor: Receptor,
    /// (cue, η, K) of each silencing.
    silencing: Vec<(usize, f64, f64)>,
}

#[derive(Debug, Resource)]
struct Receptors(Vec<Bound>);

fn bind_receptors(world: &mut World) -> Result<(), InstallError> {
    let law = world.resource::<Law<Chemotaxis>>();
    let number = |name: &String| CueFields::number(world, name, &format!("/receptors/{name}"));
    let mut bound = Vec::new();
    for (name, receptor) in &law.receptors {
        let mut silencing = Vec::new();
        for (other, rule) in &receptor.silenced_by {
            let own = law.receptors.get(other).map_or(1.0, |r| r.dissociation_constant.0);
            silencing.push((number(other)?, rule.strength.0, rule.half_at.map_or(own, |k| k.0)));
        }
        let sign = if receptor.effect == Effect::Attract { 1.0 } else { -1.0 };
        bound.push(Bound { cue: number(name)?, sign, receptor: receptor.clone(), silencing });
    }
    world.insert_resource(Receptors(bound));
    Ok(())
}

/// λ_i(t) of every cone.
fn weigh(
    receptors: Res<Receptors>,
    populations: Res<Populations>,
    (tissue, fields): (Res<Tissue>, Res<CueFields>),
    (clock, stage): (Res<Clock>, Res<StageTime>),
    mut cones: ConesWith<ReceptorWeights>,
) {
    cones.for_each(|cone, _, weights| {
        let population = &populations.0[cone.identity.population as usize].name;
        for (weight, bound) in Arc::make_mut(&mut weights.0).iter_mut().zip(&receptors.0) {
            let receptor = &bound.receptor;
            if !receptor.populations.is_empty() && !receptor.populations.contains(population) {
                continue;
            }
            let available = receptor.availability.as_ref().map_or(1.0, |availability| {
                let born = match availability.clock {
                    ClockOf::Age => cone.identity.birth_time(&clock.grid),
                    ClockOf::Scene => 0.0,
                };
                availability.at(stage.0 - born)
            });
            let unsilenced: f64 = bound
                .silencing
                .iter()
                .map(|&(cue, strength, half)| {
                    let c = fields.sample(&tissue.mesh, cue, cone.site).concentration;
                    1.0 - strength * c / (half + c)
                })
                .product();
            *weight = receptor.weight.0 * available * unsilenced;
        }
    });
}

fn sample(
    law: Res<Law<Chemotaxis>>,
    receptors: Res<Receptors>,
    tissue: Res<Tissue>,
    fields: Res<CueFields>,
    mut cones: Cones,
) {
    let sense = Sense { sensing: law.sensing, length: law.sensing_length.0, threshold: law.threshold.0 };
    cones.for_each(|cone, spring| {
        let mut sum = Vector3::zeros();
        for (weight, bound) in cone.receptors.iter().zip(&receptors.0) {
            if *weight != 0.0 {
                let sample = fields.sample(&tissue.mesh, bound.cue, cone.site);
                sum += sense.pull(sample, bound.receptor.dissociation_constant.0) * (bound.sign * weight);
            }
        }
        spring.pull += sum / sum.norm().max(1.0);
    });
}

/// How a gradient becomes a pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sense {
    /// The way of sensing.
    pub sensing: Sensing,
    /// Length a (µm).
    pub length: f64,
    /// Threshold of `direction`.
    pub threshold: f64,
}

impl Sense {
    /// G(c, ∇c) ∇c/|∇c| (dimensionless) for a dissociation constant K_d (nM); zero where there is nothing to sense.
    pub fn pull(&self, sample: CueSample, dissociation: f64) -> Vector3<f64> {
        let CueSample { concentration: c, gradient } = sample;
        let size = gradient.norm();
        if size == 0.0 {
            return Vector3::zeros();
        }
        match self.sensing {
            Sensing::Direction if size * self.length > self.threshold * c => gradient / size,
            Sensing::Direction => Vector3::zeros(),
            Sensing::Occupancy => sample.occupancy_difference(dissociation, self.length),
            Sensing::SignalToNoise if c > 0.0 => {
                let occupied = 1.0 + c / dissociation;
                let noise = (1.0 / (c * dissociation * occupied.powi(3))).sqrt();
                gradient * (self.length * noise * 8f64.sqrt() / 0.1)
            }
            Sensing::SignalToNoise => Vector3::zeros(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sense(sensing: Sensing) -> Sense {
        Sense { sensing, length: 10.0, threshold: 0.01 }
    }

    /// 10 % per 10 µm at concentration c.
    fn assay(c: f64) -> CueSample {
        CueSample { concentration: c, gradient: Vector3::new(0.0, 0.01 * c, 0.0) }
    }

    #[test]
    fn every_sensing_pulls_with_one_at_ten_percent_per_ten_micrometres_and_half_occupancy() {
        for sensing in [Sensing::Direction, Sensing::Occupancy, Sensing::SignalToNoise] {
            for dissociation in [0.3, 1.0, 3.0] {
                let pull = sense(sensing).pull(assay(dissociation), dissociation);
                assert!((pull - Vector3::y()).norm() < 1e-14, "{sensing:?} {pull}");
            }
        }
    }

    #[test]
    fn formulas_follow_the_model_away_from_that_point() {
        let (c, k) = (0.37, 1.9);
        let (a, g) = (10.0, 0.01 * c);
        let occupancy = a * k * g / ((k + c) * (k + c)) / 0.025;
        assert!((sense(Sensing::Occupancy).pull(assay(c), k).y - occupancy).abs() < 1e-14);
        let gamma: f64 = c / k;
        let noise = a * g / c * (gamma / (1.0 + gamma).powi(3)).sqrt() / (0.1 / 8f64.sqrt());
        assert!((sense(Sensing::SignalToNoise).pull(assay(c), k).y - noise).abs() < 1e-14);
    }

    #[test]
    fn nothing_is_sensed_without_a_gradient_or_below_the_threshold() {
        let flat = CueSample { concentration: 1.0, gradient: Vector3::zeros() };
        let weak = CueSample { concentration: 1.0, gradient: Vector3::new(0.9e-3, 0.0, 0.0) };
        let none = CueSample { concentration: 0.0, gradient: Vector3::new(1e-3, 0.0, 0.0) };
        for sensing in [Sensing::Direction, Sensing::Occupancy, Sensing::SignalToNoise] {
            assert_eq!(sense(sensing).pull(flat, 1.0), Vector3::zeros());
            assert!(sense(sensing).pull(none, 1.0).norm().is_finite());
        }
        assert_eq!(sense(Sensing::Direction).pull(weak, 1.0), Vector3::zeros());
    }

    #[test]
    fn availability_rises_falls_steps_and_follows_a_table() {
        let pulse = Availability { onset: Some(Time(2.0)), offset: Some(Time(6.0)), ..Availability::default() };
        assert!((pulse.at(2.0) - 0.5 * (1.0 - logistic(-4.0))).abs() < 1e-15);
        assert!(pulse.at(-20.0) < 1e-9 && pulse.at(30.0) < 1e-9 && pulse.at(4.0) > 0.7);
        let step = Availability { onset: Some(Time(2.0)), width: Time(0.0), ..Availability::default() };
        assert_eq!((step.at(1.999), step.at(2.0)), (0.0, 1.0));
        let table = Availability { table: vec![[1.0, 0.25], [3.0, 1.0]], ..Availability::default() };
        assert_eq!((table.at(0.0), table.at(2.0), table.at(9.0)), (0.25, 0.625, 1.0));
    }
}
