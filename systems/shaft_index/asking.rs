//! A cone that looks at shafts.

use crate::model::cones::Bearing;
use crate::numerics::contact_integral::Felt;
use crate::numerics::segments::{ContactPull, Contacts, Segments};
use crate::prelude::*;

/// A cone that asks for its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asking {
    /// Place of the cone, which is the number of its own shaft.
    pub index: u32,
    /// Index of its population.
    pub population: u16,
    /// Material site.
    pub site: Site,
    /// Position (µm).
    pub position: Vector3<f64>,
    /// Unit heading.
    pub heading: Vector3<f64>,
}

impl Asking {
    /// The cone at a place, of a population, as it asks.
    #[inline]
    pub fn new(index: u32, population: u16, Bearing { site, position, heading }: Bearing) -> Self {
        Self { index, population, site, position, heading }
    }

    /// What the cone makes of segments other than its own by a law, times its adhesion to their kinds.
    #[inline]
    pub fn sum(
        &self,
        contacts: &mut Contacts<2>,
        segments: &Segments<2>,
        felt_by: (&Felt, &impl ContactPull<2>),
        adhesion: &[f64],
    ) -> Vector3<f64> {
        let state = (self.position.xy().into(), self.heading.xy().into());
        let [x, y] = contacts.sum(state, segments, self.index, felt_by, adhesion);
        Vector3::new(x, y, 0.0)
    }
}
