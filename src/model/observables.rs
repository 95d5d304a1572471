//! Fields that pictures may show: providers say what they have, mechanisms say what it does to cones.

use super::components::Site;
use crate::kept;
use bevy_ecs::prelude::{Resource, World};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// What a field does to the cones that sense it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Cones turn up its gradient.
    Attract,
    /// Cones turn down its gradient.
    Repel,
}

kept! { enum Effect { Attract, Repel } }

/// Nodal values of a field in the world's present configuration.
pub type FieldReader = fn(&World, usize) -> Vec<f64>;

/// Value of a field (nM for a concentration) and its spatial gradient (per µm) at a material site, in the world's present
/// configuration.
pub type FieldSampler = fn(&World, usize, Site) -> (f64, Vector3<f64>);

/// One field on the vertices of the tissue's mesh.
#[derive(Debug, Clone)]
pub struct Observable {
    /// Its name in the scenario.
    pub name: String,
    /// Number under which its provider knows it.
    pub index: usize,
    /// Reads its nodal values.
    pub read: FieldReader,
    /// Reads value and gradient at a site (see [`crate::model::tissue::Tissue::locate`]), as cones sense them.
    pub sample: FieldSampler,
}

/// All fields of a scene that can be shown, and what they do.
#[derive(Debug, Clone, Default, Resource)]
pub struct Observables {
    /// The fields, in the order of their providers.
    pub fields: Vec<Observable>,
    /// What a field does, by its name; the first word counts.
    pub effects: BTreeMap<String, Effect>,
}
