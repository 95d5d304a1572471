//! Colours of figures, built in OKLab so that equal steps of the quantity look like equal steps of tone.
//!
//! Each effect of a cue has an *ink*: a ramp from clear to a pale tint whose perceived lightness falls linearly while
//! hue stays, purple for attraction and light blue for repulsion (as in the paper's figures). Inks lie on the tissue like
//! glazes: the light that leaves is tissue × ink × ink, channel by channel in linear light, so where both cues are the
//! tints blend and neither hides the other. Purple and blue were set apart in hue *and* lightness, so that they differ
//! for red–green-blind readers too. OKLab: B. Ottosson (2020), <https://bottosson.github.io/posts/oklab/>.

/// Linear-light sRGB, each channel 0…1.
pub type LinearRgb = [f64; 3];

/// What a cue does to an axon that senses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// The axon turns up the gradient.
    Attract,
    /// The axon turns down the gradient.
    Repel,
}

/// Entries of a ramp table.
const STEPS: usize = 256;

/// The ink of one effect as a table over the share 0 (clear) … 1 (full).
#[derive(Debug, Clone, PartialEq)]
pub struct Ramp {
    table: Vec<LinearRgb>,
}

impl Ramp {
    /// The ink for an effect.
    pub fn of(effect: Effect) -> Self {
        let full = match effect {
            Effect::Attract => OkLch { lightness: 0.68, chroma: 0.140, hue: 300.0 },
            Effect::Repel => OkLch { lightness: 0.88, chroma: 0.080, hue: 210.0 },
        };
        let tint = |step: usize| {
            let share = step as f64 / (STEPS - 1) as f64;
            let lightness = 1.0 - share * (1.0 - full.lightness);
            OkLch { lightness, chroma: share * full.chroma, hue: full.hue }.to_linear()
        };
        Self { table: (0..STEPS).map(tint).collect() }
    }

    /// The transmitted light at a share; shares outside 0…1 are clamped, and what is not a number is clear.
    pub fn at(&self, share: f64) -> LinearRgb {
        let position = share.clamp(0.0, 1.0) * (STEPS - 1) as f64;
        let (below, part) = (position.floor() as usize, position.fract());
        let (low, high) = (self.table[below], self.table[(below + 1).min(STEPS - 1)]);
        if part > 0.0 { [0, 1, 2].map(|channel| low[channel] + part * (high[channel] - low[channel])) } else { low }
    }
}

/// A colour by perceived lightness (0…1), chroma and hue (degrees) in OKLab.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OkLch {
    lightness: f64,
    chroma: f64,
    hue: f64,
}

impl OkLch {
    fn to_linear(self) -> LinearRgb {
        let (sine, cosine) = self.hue.to_radians().sin_cos();
        oklab_to_linear([self.lightness, self.chroma * cosine, self.chroma * sine])
    }
}

/// What leaves when light passes one layer and then another: the product, channel by channel.
pub fn glaze(below: LinearRgb, above: LinearRgb) -> LinearRgb {
    [below[0] * above[0], below[1] * above[1], below[2] * above[2]]
}

/// Eight-bit sRGB of linear light, clamped to the gamut.
pub fn to_srgb(linear: LinearRgb) -> [u8; 3] {
    linear.map(|channel| {
        let channel = channel.clamp(0.0, 1.0);
        let encoded = if channel <= 0.003_130_8 { 12.92 * channel } else { 1.055 * channel.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded).round() as u8
    })
}

/// Linear light of eight-bit sRGB.
pub fn from_srgb(srgb: [u8; 3]) -> LinearRgb {
    srgb.map(|channel| {
        let encoded = f64::from(channel) / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
}

/// The hexadecimal notation `#rrggbb`.
pub fn hexadecimal(srgb: [u8; 3]) -> String {
    format!("#{:02x}{:02x}{:02x}", srgb[0], srgb[1], srgb[2])
}

fn oklab_to_linear(lab: [f64; 3]) -> LinearRgb {
    let cube = |a: f64, b: f64| (lab[0] + a * lab[1] + b * lab[2]).powi(3);
    let long = cube(0.396_337_777_4, 0.215_803_757_3);
    let medium = cube(-0.105_561_345_8, -0.063_854_172_8);
    let short = cube(-0.089_484_177_5, -1.291_485_548_0);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701_0 * short,
    ]
}

/// OKLab (lightness 0…1, green–red, blue–yellow) of linear light; differences of about 0.02 are just visible.
pub fn to_oklab(rgb: LinearRgb) -> [f64; 3] {
    let root = |r: f64, g: f64, b: f64| (r * rgb[0] + g * rgb[1] + b * rgb[2]).cbrt();
    let long = root(0.412_221_470_8, 0.536_332_536_3, 0.051_445_992_9);
    let medium = root(0.211_903_498_2, 0.680_699_545_1, 0.107_396_956_6);
    let short = root(0.088_302_461_9, 0.281_718_837_6, 0.629_978_700_5);
    [
        0.210_454_255_3 * long + 0.793_617_785_0 * medium - 0.004_072_046_8 * short,
        1.977_998_495_1 * long - 2.428_592_205_0 * medium + 0.450_593_709_9 * short,
        0.025_904_037_1 * long + 0.782_771_766_2 * medium - 0.808_675_766_0 * short,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::theme;

    const EFFECTS: [Effect; 2] = [Effect::Attract, Effect::Repel];

    /// Deuteranopia in linear light: Machado, Oliveira & Fernandes (2009), severity 1.
    fn as_deuteranope(rgb: LinearRgb) -> LinearRgb {
        let row = |r: f64, g: f64, b: f64| (r * rgb[0] + g * rgb[1] + b * rgb[2]).clamp(0.0, 1.0);
        [
            row(0.367_322, 0.860_646, -0.227_968),
            row(0.280_085, 0.672_501, 0.047_413),
            row(-0.011_820, 0.042_940, 0.968_881),
        ]
    }

    fn difference(one: LinearRgb, other: LinearRgb) -> f64 {
        let (one, other) = (to_oklab(one), to_oklab(other));
        (0..3).map(|i| (one[i] - other[i]).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn oklab_and_srgb_are_inverses_of_their_inverses() {
        for srgb in [[0, 0, 0], [255, 255, 255], [12, 200, 99], [250, 3, 128]] {
            let linear = from_srgb(srgb);
            assert_eq!(to_srgb(linear), srgb);
            assert_eq!(to_srgb(oklab_to_linear(to_oklab(linear))), srgb);
        }
        let red = to_oklab([1.0, 0.0, 0.0]);
        for (found, published) in red.iter().zip([0.627_955, 0.224_863, 0.125_846]) {
            assert!((found - published).abs() < 1e-5, "{red:?}");
        }
    }

    #[test]
    fn lightness_falls_at_every_step_and_linearly() {
        for effect in EFFECTS {
            let ramp = Ramp::of(effect);
            let lightness: Vec<f64> = (0..=64).map(|i| to_oklab(ramp.at(f64::from(i) / 64.0))[0]).collect();
            assert!(lightness.windows(2).all(|pair| pair[1] < pair[0]), "{effect:?}");
            let step = (lightness[64] - lightness[0]) / 64.0;
            assert!(lightness.windows(2).all(|pair| ((pair[1] - pair[0]) / step - 1.0).abs() < 0.1), "{effect:?}");
        }
    }

    #[test]
    fn inks_stay_in_the_gamut_and_begin_clear() {
        for effect in EFFECTS {
            let ramp = Ramp::of(effect);
            assert_eq!(to_srgb(ramp.at(0.0)), [255, 255, 255]);
            assert_eq!(ramp.at(f64::NAN), ramp.at(0.0));
            for i in 0..=100 {
                let colour = ramp.at(f64::from(i) / 100.0);
                assert!(colour.iter().all(|channel| (-1e-6..=1.0 + 1e-6).contains(channel)), "{effect:?} {colour:?}");
            }
        }
    }

    #[test]
    fn the_two_inks_differ_for_a_deuteranope_wherever_they_are_strong() {
        let (purple, blue) = (Ramp::of(Effect::Attract), Ramp::of(Effect::Repel));
        for i in 5..=10 {
            for j in 5..=10 {
                let pair = (purple.at(f64::from(i) / 10.0), blue.at(f64::from(j) / 10.0));
                let seen = difference(as_deuteranope(pair.0), as_deuteranope(pair.1));
                assert!(seen > 0.04, "purple {i}/10, blue {j}/10: {seen}");
            }
        }
    }

    #[test]
    fn dark_shafts_stand_out_even_where_both_inks_are_full() {
        let both = glaze(Ramp::of(Effect::Attract).at(1.0), Ramp::of(Effect::Repel).at(1.0));
        let ground = glaze(from_srgb(theme::TISSUE), both);
        let contrast = to_oklab(ground)[0] - to_oklab(from_srgb(theme::SHAFT))[0];
        assert!(contrast > 0.25, "lightness contrast {contrast}");
    }

    #[test]
    fn tip_colours_differ_from_each_other_for_a_deuteranope() {
        let colours = [theme::GROWING, theme::ARRIVED, theme::STALLED, theme::LEFT].map(from_srgb);
        for (i, &one) in colours.iter().enumerate() {
            for &other in &colours[i + 1..] {
                assert!(difference(as_deuteranope(one), as_deuteranope(other)) > 0.1, "{one:?} {other:?}");
            }
        }
    }
}
