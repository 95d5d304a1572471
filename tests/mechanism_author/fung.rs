//! A law of material as an outside author writes it: with the prelude alone, in one file.
//!
//! Fung's exponential: W = µ/(2b) (exp(b φ) − 1) + λ/2 (ln J)², φ = tr C − 2 − 2 ln J. With H = F − F⁻ᵀ, dφ = 2 H:dF.

use std::sync::Arc;
use tropism::prelude::*;

keys! {
    /// Tissue that stiffens exponentially, W = µ/(2b) (exp(b φ) − 1) + λ/2 (ln J)².
    pub struct FungLaw {
        /// How fast it stiffens, b.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.1, 20.0]))]
        pub stiffening: Factor = Factor(1.0),
    }
}

impl MaterialLaw for FungLaw {
    const NAME: &'static str = "fung";

    fn material(&self, lame: Lame) -> Result<Arc<dyn Material<2>>, Violations> {
        Ok(Arc::new(Fung { lame, stiffening: self.stiffening.0 }))
    }
}

#[derive(Debug)]
struct Fung {
    lame: Lame,
    stiffening: f64,
}

impl Fung {
    /// ln J, F⁻ᵀ and exp(b φ).
    fn parts(&self, f: &Tensor<2>) -> (f64, Tensor<2>, f64) {
        let logarithm = f.determinant().ln();
        let inverse_transpose = f.transpose().try_inverse().unwrap_or_else(Tensor::zeros);
        let phi = f.norm_squared() - 2.0 - 2.0 * logarithm;
        (logarithm, inverse_transpose, (self.stiffening * phi).exp())
    }
}

impl Material<2> for Fung {
    fn name(&self) -> &'static str {
        FungLaw::NAME
    }

    fn energy(&self, f: &Tensor<2>) -> f64 {
        if f.determinant() <= 0.0 {
            return f64::INFINITY;
        }
        let (logarithm, _, exponential) = self.parts(f);
        0.5 * self.lame.mu / self.stiffening * (exponential - 1.0) + 0.5 * self.lame.lambda * logarithm * logarithm
    }

    fn stress(&self, f: &Tensor<2>) -> Tensor<2> {
        let (logarithm, inverse_transpose, exponential) = self.parts(f);
        (f - inverse_transpose) * (self.lame.mu * exponential) + inverse_transpose * (self.lame.lambda * logarithm)
    }

    fn stress_increment(&self, f: &Tensor<2>, df: &Tensor<2>) -> Tensor<2> {
        let Lame { lambda, mu } = self.lame;
        let (logarithm, inverse_transpose, exponential) = self.parts(f);
        let apart = f - inverse_transpose;
        let turned = inverse_transpose * df.transpose() * inverse_transpose;
        (df + turned + apart * (2.0 * self.stiffening * apart.dot(df))) * (mu * exponential)
            + inverse_transpose * (lambda * inverse_transpose.dot(df))
            - turned * (lambda * logarithm)
    }
}
