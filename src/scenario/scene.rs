//! The core keys of a scene: the tissue, time, growth, the populations of axons, the targets and the output. The documentation here is
//! the reference of the keys; defaults and usual ranges are those of the model. Mechanisms bring their own blocks.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::keys;
use crate::model::quantity::{Factor, Length, Rate, Time};
use crate::model::shape::Shape;

pub use super::files::{Every, Swc, Tables, Vtu};
pub use super::population::{Births, Direction, EdgeOrigin, EdgePart, Heading, Origin, Population};
pub use super::tissue::{Outline, Ring, Tissue};

keys! {
    /// A scene: what grows where, for how long, and what is written down. Every key has a default.
    pub struct Scene {
        /// Where an editor finds the schema of scenes, as `tropism schema` prints it. It is not taken over from a base.
        #[serde(rename = "$schema")]
        pub schema: Option<String> = None,
        /// The file this one is a merge patch (RFC 7396) on, relative to this file. A base may have a base of its own.
        pub base: Option<String> = None,
        /// The name in outputs; by default the name of the file without its ending. It is not taken over from a base.
        pub name: String = String::new(),
        /// What the scene shows, in a sentence. It is not taken over from a base.
        pub description: String = String::new(),
        /// Numbers by name, for texts that begin with `=`: with `"axons": 400`, `"= 20*sqrt(axons) um"` is `"400 um"`. A parameter may be such
        /// a text over those before it.
        pub parameters: BTreeMap<String, f64> = BTreeMap::new(),
        /// The seed of every random draw.
        pub seed: u64 = 1,
        /// Root mean square error of tips over the length of their paths, in place of mesh size, step and load levels, which
        /// are then found by pilot runs without contact and noise; those that are given all the same are kept.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 0.5, "x-typical" = [1e-4, 0.05]))]
        pub accuracy: Option<Factor> = None,
        /// The space axons grow in.
        pub space: Space = Space::Planar,
        /// The tissue at rest and its mesh.
        pub tissue: Tissue = Tissue::default(),
        /// How long, and in which steps.
        pub time: TimeKeys = TimeKeys::default(),
        /// What growth cones have in common.
        pub growth: Growth = Growth::default(),
        /// The populations of axons by name; by default one, `axons`, with the defaults of its keys.
        pub populations: BTreeMap<String, Population> = BTreeMap::from([("axons".to_owned(), Population::default())]),
        /// The targets by name: an axon that enters one has arrived. None by default.
        pub targets: BTreeMap<String, Shape> = BTreeMap::new(),
        /// What is written down.
        pub output: Output = Output::default(),
    }

    /// How long the scene runs, and in which steps.
    pub struct TimeKeys {
        /// The time simulated.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [1.0, 240.0]))]
        pub duration: Time = Time(72.0),
        /// The time step of the growth cones, for `bogacki_shampine` the largest; a fifth of the reach of contact over the speed is
        /// an upper bound.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub step: Time = Time(1.0 / 60.0),
        /// The integrator of the turning law.
        pub method: Method = Method::Rotation,
        /// The largest error of a cone's step of `bogacki_shampine`, 0.01 um by default; no other method takes it.
        #[schemars(extend("minimum" = 1e-12, "x-typical" = [1e-6, 1.0]))]
        pub tolerance: Option<Length> = None,
    }

    /// What growth cones have in common.
    pub struct Growth {
        /// κ: how fast a full pull turns a heading.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [0.57, 2.0]))]
        pub turning_rate: Rate = Rate(0.93),
        /// l₀: the length of a filopodium, over which pulls act.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 15.0]))]
        pub filopodium_length: Length = Length(10.0),
        /// δt: the life of a filopodium.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub filopodia_time: Time = Time(2.0 / 60.0),
        /// Whether the rotation of the tissue turns headings as it turns shafts.
        pub heading_follows: HeadingFollows = HeadingFollows::None,
        /// What a growth cone does that meets the border.
        pub on_border: OnBorder = OnBorder::Slide,
    }

    /// What is written down.
    pub struct Output {
        /// The time between two points of a stored trajectory.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub trajectory_interval: Time = Time(10.0 / 60.0),
        /// When figures are drawn, as shares of the duration.
        #[schemars(inner(range(min = 0.0, max = 1.0)))]
        pub figure_times: Vec<Factor> = vec![Factor(0.0), Factor(0.5), Factor(1.0)],
        /// How many frames a recording of the run has, at equal times from start to end; those of figures come besides. 0 for no recording.
        /// By default 73, or none with more than 20 000 axons.
        #[schemars(extend("minimum" = 0, "maximum" = 10_000))]
        pub frames: Option<u32> = None,
        /// Shafts nearer than this belong to one fascicle.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub linkage_distance: Length = Length(10.0),
        /// The heights at which spread and fascicles are measured, as shares of the height of the tissue.
        #[schemars(inner(range(min = 0.0, max = 1.0)))]
        pub heights: Vec<Factor> = vec![Factor(0.25), Factor(0.5), Factor(0.75)],
        /// The form of tables.
        pub tables: Tables = Tables::Csv,
        /// A table `measures`: a row a time, with the numbers of the summary.
        pub measures: Option<Every> = None,
        /// A table `axons`: a row an axon or branch, and time.
        pub axons: Option<Every> = None,
        /// Axons as SWC, for NeuroM, MorphIO and navis.
        pub swc: Option<Swc> = None,
        /// Tissue, fields and shafts as VTU, for ParaView, meshio and pyvista.
        pub vtu: Option<Vtu> = None,
    }
}

impl Output {
    /// Frames of a recording, or the default for a number of axons.
    pub fn frames(&self, axons: u64) -> u32 {
        const MOST_AXONS: u64 = 20_000;
        self.frames.unwrap_or(if axons > MOST_AXONS { 0 } else { 73 })
    }
}

impl TimeKeys {
    /// The tolerance of a step, or its default.
    pub fn tolerance(&self) -> Length {
        self.tolerance.unwrap_or(Length(1e-2))
    }
}

/// The space axons grow in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Space {
    /// The plane; every z is exactly 0.
    Planar,
}

/// The integrator of the turning law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The exact rotation for a frozen pull, pull sampled at the midpoint: order 2, stable for every step.
    Rotation,
    /// Explicit Euler: order 1, stable for κΔt < 2.
    Euler,
    /// Heun: order 2, stable for κΔt < 2.
    Heun,
    /// The classical Runge–Kutta method: order 4, stable for κΔt < 2.785.
    Rk4,
    /// The embedded pair of Bogacki and Shampine in steps that `tolerance` chooses: order 3, stable for κΔt < 2.512.
    BogackiShampine,
}

/// Whether the rotation of the tissue turns headings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingFollows {
    /// Headings do not feel the tissue turn, as in the paper.
    None,
    /// Headings turn with the rotation of the deformation gradient.
    Spin,
}

/// What a growth cone does that meets the border.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnBorder {
    /// It moves on along the border.
    Slide,
    /// It stops there for good.
    Stall,
    /// It leaves the scene.
    Leave,
}
