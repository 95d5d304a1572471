//! What a scene needs and what it does not, told by those who decide it while the scene is put together, and how near the
//! chosen steps and methods come to their limits.

use bevy_ecs::prelude::Resource;
use serde::Serialize;
use std::fmt;

/// A part of the program that the scene has work for, or not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// A mechanism, field, solve, index or output.
    pub name: String,
    /// Whether the scene has it.
    pub kept: bool,
    /// Why.
    pub why: String,
}

/// A quantity beside the limit up to which a method or a derivation holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    /// What is compared.
    pub name: String,
    /// Its value in this scene.
    pub value: f64,
    /// The largest value that is advised.
    pub limit: f64,
    /// What to do when it is too near.
    pub advice: String,
}

impl Margin {
    /// Whether the limit is passed.
    pub fn is_passed(&self) -> bool {
        self.value > self.limit
    }

    /// Whether less than a quarter of the limit is left.
    pub fn is_thin(&self) -> bool {
        self.value > 0.75 * self.limit
    }
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, limit, advice } = self;
        write!(f, "{name}: {value:.3}; {limit:.3} or less is advised ({advice})")
    }
}

/// The plan of a scene.
#[derive(Debug, Clone, Default, PartialEq, Resource, Serialize)]
pub struct Plan {
    /// What is kept and what is left out.
    pub parts: Vec<Part>,
    /// How near the limits are.
    pub margins: Vec<Margin>,
    /// The strongest pull |L̂| that the scene's mechanisms can add up to.
    pub strongest_pull: f64,
}

impl Plan {
    /// Notes a part that the scene needs.
    pub fn keep(&mut self, name: impl Into<String>, why: impl Into<String>) {
        self.parts.push(Part { name: name.into(), kept: true, why: why.into() });
    }

    /// Notes a part that the scene has no use for.
    pub fn leave_out(&mut self, name: impl Into<String>, why: impl Into<String>) {
        self.parts.push(Part { name: name.into(), kept: false, why: why.into() });
    }

    /// Notes a quantity with its limit.
    pub fn compare(&mut self, name: impl Into<String>, value: f64, limit: f64, advice: impl Into<String>) {
        self.margins.push(Margin { name: name.into(), value, limit, advice: advice.into() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_is_thin_before_it_is_passed() {
        let margin = |value| Margin { name: "x".into(), value, limit: 2.0, advice: "less".into() };
        let seen = [1.0, 1.6, 2.0, 2.1].map(|value| (margin(value).is_thin(), margin(value).is_passed()));
        assert_eq!(seen, [(false, false), (true, false), (true, false), (true, true)]);
        assert_eq!(margin(2.1).to_string(), "x: 2.100; 2.000 or less is advised (less)");
    }
}
