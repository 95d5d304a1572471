//! The laws of the matrix's material that come with the program, as a scene names them. Their mathematics stands in
//! `numerics/material.rs` and `numerics/ogden.rs`.

use crate::numerics::material::{NeoHookean, StVenantKirchhoff};
use crate::numerics::ogden::Ogden;
use crate::prelude::*;
use std::sync::Arc;

keys! {
    /// As in the paper, W = λ/2 (tr E)² + µ E:E; soft in compression, where it fails.
    pub struct StVenantKirchhoffLaw {}

    /// Ours: stays well-posed in compression, W = µ/2 (tr C − d − 2 ln J) + λ/4 (J² − 1 − 2 ln J).
    pub struct NeoHookeanLaw {}

    /// Ours: one term; stiffens or softens, W = 2µ/α² (Σλᵢ^α − d − α ln J) + λ/4 (J² − 1 − 2 ln J).
    pub struct OgdenLaw {
        /// Exponent α of the principal stretches λᵢ, not 0; with 2 it is neo-Hookean. Brain tissue: −20 to −5.
        #[schemars(extend("x-typical" = [-20.0, 20.0]))]
        pub exponent: Factor = Factor(8.0),
    }
}

impl MaterialLaw for StVenantKirchhoffLaw {
    const NAME: &'static str = "st_venant_kirchhoff";

    fn material(&self, lame: Lame) -> Result<Arc<dyn Material<2>>, Violations> {
        Ok(Arc::new(StVenantKirchhoff { lame }))
    }
}

impl MaterialLaw for NeoHookeanLaw {
    const NAME: &'static str = "neo_hookean";

    fn material(&self, lame: Lame) -> Result<Arc<dyn Material<2>>, Violations> {
        Ok(Arc::new(NeoHookean { lame }))
    }
}

impl MaterialLaw for OgdenLaw {
    const NAME: &'static str = "ogden";

    fn material(&self, lame: Lame) -> Result<Arc<dyn Material<2>>, Violations> {
        if self.exponent.0 == 0.0 {
            return Err(Violation::new("/exponent", "an exponent of zero has no energy; 2 is neo-Hookean").into());
        }
        Ok(Arc::new(Ogden { lame, exponent: self.exponent.0 }))
    }
}
