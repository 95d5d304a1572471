//! The keys of a population of axons: how many, how fast, where, when and whereto.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::keys;
use crate::model::quantity::{Angle, Factor, Speed, Time};
use crate::model::shape::Point;

keys! {
    /// Axons of one kind that start together.
    pub struct Population {
        /// How many axons.
        pub count: u64 = 500,
        /// The speed of their growth cones.
        #[schemars(extend("minimum" = 0.0, "x-typical" = [3.0, 50.0]))]
        pub speed: Speed = Speed(20.0),
        /// Where they are born.
        pub origin: Origin = Origin::Edge(EdgeOrigin::Name("bottom".to_owned())),
        /// Their first heading: `inner_normal` of the edge they are born on, `random`, or an angle, counter-clockwise from the x axis.
        pub heading: Heading = Heading::Along(Direction::InnerNormal),
        /// When they are born; by default uniformly over the first quarter of the duration.
        pub births: Option<Births> = None,
    }
}

/// Where axons are born.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Evenly spread draws along an edge, or a part of it.
    Edge(EdgeOrigin),
    /// Evenly over the tissue: one in each of as many equal parts of it, in the order of its cells.
    Tissue,
    /// These points \[µm\], over and over: the axon number i starts at the point number i modulo their count.
    Points(#[schemars(length(min = 1))] Vec<Point>),
}

/// An edge, or a part of one.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum EdgeOrigin {
    /// The whole edge of this name.
    Name(String),
    /// A part of an edge.
    Part(EdgePart),
}

/// A part of an edge, from one share of its length to another, counted in the order of its points (a rectangle runs counter-clockwise from
/// the origin).
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgePart {
    /// The edge.
    pub name: String,
    /// The share of its length at which the part begins.
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub from: Factor,
    /// The share at which it ends.
    #[serde(default = "whole")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub to: Factor,
}

fn whole() -> Factor {
    Factor(1.0)
}

/// A first heading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Heading {
    /// A direction that is not given as a number.
    Along(Direction),
    /// An angle, counter-clockwise from the x axis.
    Angle(Angle),
}

/// A direction that is not given as a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Into the tissue, at right angles to the edge.
    InnerNormal,
    /// Any direction, drawn evenly.
    Random,
}

/// When axons are born.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Births {
    /// At times drawn uniformly from an interval.
    Uniform {
        /// Its begin.
        #[serde(default)]
        #[schemars(extend("minimum" = 0.0))]
        from: Time,
        /// Its end.
        #[schemars(extend("minimum" = 0.0))]
        to: Time,
    },
    /// All at this time.
    At(#[schemars(extend("minimum" = 0.0))] Time),
}

impl EdgeOrigin {
    /// The edge with the shares of its length between which axons are born.
    pub fn part(&self) -> EdgePart {
        match self {
            Self::Name(name) => EdgePart { name: name.clone(), from: Factor(0.0), to: whole() },
            Self::Part(part) => part.clone(),
        }
    }
}

impl Population {
    /// The interval in which axons are born \[h\]: the key `births`, or the first quarter of the duration.
    pub fn birth_interval(&self, duration: Time) -> [Time; 2] {
        match self.births {
            Some(Births::Uniform { from, to }) => [from, to],
            Some(Births::At(time)) => [time, time],
            None => [Time(0.0), Time(0.25 * duration.0)],
        }
    }
}
