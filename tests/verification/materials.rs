//! One test for every law of material that the program has: a law that joins the registry is covered by it as it stands.

use nalgebra::Matrix2;
use std::sync::Arc;
use tropism::numerics::law_check::law_defects;
use tropism::numerics::material::{Lame, Material, NeoHookean, Tensor};
use tropism::prelude::MaterialChoice;
use tropism::systems;

#[test]
fn every_registered_law_has_its_derivatives_its_rest_its_hookes_law_and_passes_the_patch_test() {
    let roster = systems::standard();
    let names = roster.materials().names();
    assert_eq!(names, ["st_venant_kirchhoff", "neo_hookean", "ogden"]);
    for name in names {
        for (young, poisson) in [(1.0, 0.0), (1.0, 0.3), (500.0, 0.45)] {
            let lame = Lame::from_young_poisson(young, poisson).unwrap();
            let law = roster.materials().material(&MaterialChoice::of(name), lame).unwrap();
            assert_eq!(law.name(), name);
            let defects = law_defects(&law, lame);
            let scale = if young > 1.0 { 1e-6 } else { 1e-7 };
            assert!(defects.worst() < scale, "{name}, E = {young}, nu = {poisson}: {defects:?}");
            assert!(defects.objectivity < 1e-13 && defects.stress_at_rest < 1e-15, "{name}: {defects:?}");
            assert!(defects.small_strain < 1e-14 && defects.patch < 1e-12, "{name}: {defects:?}");
        }
    }
}

/// A neo-Hookean law with one thing wrong.
#[derive(Debug)]
struct Wrong {
    sound: NeoHookean,
    fault: &'static str,
}

impl Material<2> for Wrong {
    fn name(&self) -> &'static str {
        "wrong"
    }

    fn energy(&self, f: &Tensor<2>) -> f64 {
        self.sound.energy(f) + if self.fault == "prestress" { 0.01 * f.trace() } else { 0.0 }
    }

    fn stress(&self, f: &Tensor<2>) -> Tensor<2> {
        let prestress = if self.fault == "prestress" { Matrix2::identity() * 0.01 } else { Matrix2::zeros() };
        self.sound.stress(f) * if self.fault == "stress" { 1.001 } else { 1.0 } + prestress
    }

    fn stress_increment(&self, f: &Tensor<2>, df: &Tensor<2>) -> Tensor<2> {
        let factor = if self.fault == "tangent" || self.fault == "stress" { 1.001 } else { 1.0 };
        self.sound.stress_increment(f, df) * factor
    }
}

#[test]
fn the_shared_test_notices_a_thousandth_of_stress_or_tangent_a_stress_at_rest_and_another_stiffness() {
    let lame = Lame::from_young_poisson(1.0, 0.3).unwrap();
    let of = |fault, softer: f64| {
        let law: Arc<dyn Material<2>> = Arc::new(Wrong { sound: NeoHookean { lame }, fault });
        law_defects(&law, Lame { lambda: lame.lambda, mu: lame.mu * softer })
    };
    assert!(of("", 1.0).worst() < 1e-7);
    assert!(of("stress", 1.0).derivatives > 1e-5 && of("tangent", 1.0).derivatives > 1e-5);
    let stressed = of("prestress", 1.0);
    assert!(stressed.stress_at_rest > 1e-3 && stressed.objectivity > 1e-3 && stressed.derivatives < 1e-7);
    assert!(of("", 1.001).small_strain > 1e-4);
}
