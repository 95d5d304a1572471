//! Growth of the tissue as a scene writes it. Ours: the paper leaves the mass source out.

use crate::numerics::grown::Growth;
use crate::prelude::*;

keys! {
    /// Isotropic growth, g = 1 + s (G − 1) with the load s.
    pub struct TissueGrowth {
        /// Ratio G of lengths after and before at full load, wherever no region says otherwise; below 1 the tissue shrinks.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.5, 2.0]))]
        pub factor: Factor = Factor(1.0),
        /// Regions that grow by factors of their own; where two overlap, the later one counts. The mesh is fitted to them.
        pub regions: Vec<GrowingRegion> = Vec::new(),
    }
}

/// A region of the tissue that grows by a factor of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrowingRegion {
    /// Ratio G of lengths in the region at full load.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.5, 2.0]))]
    pub factor: Factor,
    /// Where, in the tissue at rest.
    pub shape: Shape,
}

impl TissueGrowth {
    /// Whether anything grows or shrinks.
    pub fn acts(&self) -> bool {
        self.factors().any(|factor| factor != 1.0)
    }

    /// The smallest and the largest factor.
    pub fn extremes(&self) -> [f64; 2] {
        self.factors().fold([f64::INFINITY, 0.0], |[low, high], factor| [low.min(factor), high.max(factor)])
    }

    /// All factors that are named.
    fn factors(&self) -> impl Iterator<Item = f64> {
        self.regions.iter().map(|region| region.factor.0).chain([self.factor.0])
    }

    /// The shapes that the mesh is fitted to, by their place in the scene.
    pub fn outlines(&self) -> Vec<(String, Shape)> {
        let named = |(index, region): (usize, &GrowingRegion)| (outline(index), region.shape.clone());
        self.regions.iter().enumerate().map(named).collect()
    }

    /// The factor of every cell; nothing where nothing grows.
    pub fn of_cells(&self, tissue: &Tissue) -> Growth {
        if !self.acts() {
            return Growth::default();
        }
        let mut factors = vec![self.factor.0; tissue.mesh.cell_count()];
        for (index, region) in self.regions.iter().enumerate() {
            let cells = tissue.regions.get(&outline(index)).into_iter().flatten();
            cells.for_each(|&cell| factors[cell as usize] = region.factor.0);
        }
        Growth::by(factors)
    }
}

fn outline(index: usize) -> String {
    format!("matrix/growth/regions/{index}/shape")
}
