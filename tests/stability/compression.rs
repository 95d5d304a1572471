//! The matrix in compression.

use std::sync::LazyLock;

use tropism::study::stability::compression::{
    Case, CompressionMap, Effort, FARTHEST, Law, March, Sides, compute, ellipticity, inertia,
};

static MAP: LazyLock<CompressionMap> = LazyLock::new(|| {
    compute(&Effort { poisson: vec![0.0, 0.3, 0.45], rows: vec![8], clamped_rows: vec![8, 16], points: 26 }).unwrap()
});

fn svk(poisson: f64, sides: Sides) -> Case {
    Case { law: Law::StVenantKirchhoff, poisson, sides }
}

/// Smallest eigenvalue of Q = (N·SN) I + (λ + µ) FN⊗FN + µ FFᵀ, St. Venant–Kirchhoff's acoustic tensor by hand, with E = 1, at
/// F = diag(a, s).
fn by_hand(poisson: f64, [a, s]: [f64; 2]) -> f64 {
    let mu = 0.5 / (1.0 + poisson);
    let lambda = 2.0 * mu * poisson / (1.0 - 2.0 * poisson);
    let strain = [0.5 * (a * a - 1.0), 0.5 * (s * s - 1.0)];
    let stress = strain.map(|e| lambda * (strain[0] + strain[1]) + 2.0 * mu * e);
    let at = |angle: f64| {
        let n = [angle.cos(), angle.sin()];
        let push = stress[0] * n[0] * n[0] + stress[1] * n[1] * n[1];
        let fn_ = [a * n[0], s * n[1]];
        let xx = push + (lambda + mu) * fn_[0] * fn_[0] + mu * a * a;
        let yy = push + (lambda + mu) * fn_[1] * fn_[1] + mu * s * s;
        let xy = (lambda + mu) * fn_[0] * fn_[1];
        0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt()
    };
    (0..=20_000).map(|i| at(f64::from(i) / 20_000.0 * std::f64::consts::PI)).fold(f64::INFINITY, f64::min)
}

fn across(poisson: f64, sides: Sides, s: f64) -> f64 {
    match sides {
        Sides::Confined => 1.0,
        Sides::Free => (1.0 + poisson / (1.0 - poisson) * (1.0 - s * s)).sqrt(),
    }
}

#[test]
fn ellipticity_is_lost_at_the_figures_of_the_model() {
    for (poisson, sides, wanted) in
        [(0.3, Sides::Free, 0.610), (0.3, Sides::Confined, 0.706), (0.45, Sides::Confined, 0.906)]
    {
        let found = ellipticity(svk(poisson, sides), 26).unwrap().lost_at.unwrap();
        assert!((found - wanted).abs() < 6e-4, "ν = {poisson}, {sides:?}: {found} for {wanted}");
    }
}

#[test]
fn the_smallest_acoustic_eigenvalue_is_that_of_the_tensor_written_by_hand() {
    for map in MAP.ellipticity.iter().filter(|map| map.law == Law::StVenantKirchhoff) {
        for &[stretch, found] in &map.curve {
            let wanted = by_hand(map.poisson, [across(map.poisson, map.sides, stretch), stretch]);
            assert!((found - wanted).abs() < 1e-7, "{map:?}: {found} for {wanted} at {stretch}");
        }
        let lost = map.lost_at.unwrap();
        let sign = |s: f64| by_hand(map.poisson, [across(map.poisson, map.sides, s), s]).signum();
        assert_eq!((sign(lost + 1e-4), sign(lost - 1e-4)), (1.0, -1.0), "{map:?}");
    }
}

#[test]
fn neo_hookean_stays_elliptic_on_the_way() {
    for map in MAP.ellipticity.iter().filter(|map| map.law == Law::NeoHookean) {
        assert_eq!(map.lost_at, None);
        assert!(map.curve.iter().all(|[_, eigenvalue]| *eigenvalue > 0.3), "{map:?}");
    }
}

#[test]
fn the_force_has_its_maximum_at_one_over_root_three_whatever_the_poisson_ratio_and_the_sides() {
    for map in &MAP.force {
        assert!((map.maximum_at - 1.0 / 3f64.sqrt()).abs() < 1e-6, "{map:?}");
        // Free sides: P = E/(1−ν²) s (s² − 1)/2; confined: E (1−ν)/((1+ν)(1−2ν)) in its place.
        let nu = map.poisson;
        let modulus = match map.sides {
            Sides::Free => 1.0 / (1.0 - nu * nu),
            Sides::Confined => (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        };
        for &[s, force] in &map.curve {
            let wanted = modulus * 0.5 * s * (1.0 - s * s);
            assert!((force - wanted).abs() < 1e-12, "{map:?}: {force} for {wanted} at {s}");
        }
    }
    assert_eq!(MAP.force.len(), 6);
}

#[test]
fn the_discrete_tangent_turns_indefinite_at_164_per_cent_a_side_before_ellipticity_goes() {
    let found = [8, 16].map(|rows| inertia(svk(0.3, Sides::Free), rows).unwrap().per_side.unwrap());
    // The error is of second order in the mesh size.
    let limit = found[1] + (found[1] - found[0]) / 3.0;
    println!("first negative eigenvalue at {found:.2?} % a side, extrapolated {limit:.2} %");
    assert!((limit - 16.4).abs() < 0.1, "{found:?} {limit}");
    let elliptic = 50.0 * (1.0 - ellipticity(svk(0.3, Sides::Free), 26).unwrap().lost_at.unwrap());
    assert!((elliptic - 19.5).abs() < 0.05 && limit < elliptic - 2.5, "{limit} {elliptic}");
}

fn marches(law: Law, clamped: bool) -> impl Iterator<Item = &'static March> {
    MAP.newton.iter().filter(move |march| march.law == law && march.clamped == clamped)
}

#[test]
fn no_path_turns_a_cell_inside_out_and_every_early_end_names_load_cell_and_stretch() {
    for march in &MAP.newton {
        assert!(march.min_jacobian > 0.0, "{march:?}");
        assert!(march.iterations.iter().all(|level| (1.0..=25.0).contains(&level[1])), "{march:?}");
        match &march.ended_by {
            None => assert_eq!(march.reached, FARTHEST),
            Some(account) => {
                assert!(march.reached > FARTHEST);
                for word in ["load", "cell ", "det F = ", "stretches", "iterations", "residual"] {
                    assert!(account.contains(word), "{account}");
                }
            }
        }
    }
}

#[test]
fn held_ends_lose_st_venant_kirchhoff_earlier_on_a_finer_mesh_and_neo_hookean_goes_past() {
    let reached = |law| marches(law, true).map(|march| march.reached).collect::<Vec<_>>();
    let (soft, hard) = (reached(Law::StVenantKirchhoff), reached(Law::NeoHookean));
    println!("held ends, 8 and 16 rows: St. Venant-Kirchhoff to {soft:?}, neo-Hookean to {hard:?}");
    // Two independent codes lose it at 10.7 % a side on 16 rows.
    assert!((50.0 * (1.0 - soft[1]) - 10.7).abs() < 0.1, "{soft:?}");
    assert!(soft[0] < soft[1], "{soft:?}");
    assert_eq!(hard, [FARTHEST, FARTHEST]);
}

#[test]
fn unstable_equilibria_are_told_on_the_way_and_neo_hookean_passes_20_per_cent_without_one() {
    for march in marches(Law::StVenantKirchhoff, false) {
        let first = march.unstable_from.unwrap();
        assert!(march.iterations.iter().filter(|level| level[0] > first).all(|level| level[1] < 6.0), "{march:?}");
    }
    for march in marches(Law::NeoHookean, false) {
        assert!(march.unstable_from.is_none_or(|stretch| stretch < 0.6), "{march:?}");
    }
}
