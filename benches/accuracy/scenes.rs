//! Scenes drawn by a fixed sequence of numbers: nothing in them was chosen by what came out.

use serde_json::{Map, Value, json};

/// Scenes there are.
pub const COUNT: u64 = 36;

/// What is asked for, in turn.
const ASKED: [f64; 3] = [0.03, 0.01, 0.003];

/// SplitMix64: numbers that depend on the scene's own number only.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// Evenly spread in the logarithm.
    fn across(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next())
    }

    fn happens(&mut self, share: f64) -> bool {
        self.next() < share
    }
}

/// A disc: centre and radius (µm).
type Disc = ([f64; 2], f64);

/// The tissue of a scene.
struct Ground {
    width: f64,
    height: f64,
    /// By how much the left side leans inward at the top, where it does.
    slant: Option<f64>,
    hole: Option<Disc>,
}

impl Ground {
    fn drawn(number: u64, numbers: &mut Numbers) -> Self {
        let (width, height) = (numbers.between(200.0, 800.0), numbers.between(150.0, 600.0));
        let slant = (number % 5 == 3).then(|| numbers.between(0.1, 0.3) * width);
        let centre = [numbers.between(0.35, 0.65) * width, numbers.between(0.3, 0.6) * height];
        let hole = (number % 5 == 4).then(|| (centre, numbers.between(0.06, 0.12) * width.min(height)));
        Self { width, height, slant, hole }
    }

    fn outline(&self) -> Value {
        let Self { width, height, slant, hole } = self;
        if slant.is_none() && hole.is_none() {
            return json!({ "rectangle": { "width": width, "height": height } });
        }
        let lean = slant.unwrap_or(0.0);
        let outer = [[0.0, 0.0], [*width, 0.0], [*width, *height], [lean, *height]];
        let mut polygon = Map::new();
        polygon.insert("outer".into(), json!({ "points": outer, "edges": ["bottom", "right", "top", "left"] }));
        if let Some((centre, radius)) = hole {
            let corner = |i: i32| {
                let angle = f64::from(i) * std::f64::consts::FRAC_PI_3;
                [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
            };
            let corners: Vec<_> = (0..6).map(corner).collect();
            polygon.insert("holes".into(), json!([{ "points": corners }]));
        }
        json!({ "polygon": polygon })
    }

    /// A disc that lies clear of the border, of the hole and of other discs.
    fn disc(&self, numbers: &mut Numbers, others: &[Disc]) -> Option<Disc> {
        let most = (0.15 * self.width.min(self.height)).min(50.0);
        let lean = self.slant.unwrap_or(0.0);
        let draw = |numbers: &mut Numbers| {
            let radius = numbers.between(12.0, most);
            let low = lean + radius + 8.0;
            ([numbers.between(low, self.width - radius - 8.0), numbers.between(0.25, 0.95) * self.height], radius)
        };
        let clear = |disc: &Disc| {
            let apart = |other: &Disc| (disc.0[0] - other.0[0]).hypot(disc.0[1] - other.0[1]) > disc.1 + other.1 + 10.0;
            disc.0[1] + disc.1 + 8.0 < self.height && others.iter().chain(&self.hole).all(apart)
        };
        (0..200).map(|_| draw(numbers)).find(clear)
    }
}

fn disc_of((centre, radius): Disc) -> Value {
    json!({ "disc": { "centre": centre, "radius": radius } })
}

/// A scene and the accuracy it asks for.
pub fn scene(number: u64) -> (Value, f64) {
    let mut numbers = Numbers(number);
    let ground = Ground::drawn(number, &mut numbers);
    let asked = ASKED[(number / 3 % 3) as usize];
    let speed = numbers.between(10.0, 40.0);
    let duration = (numbers.between(0.5, 2.0) * ground.height / speed).clamp(10.0, 60.0);
    let mut scene = json!({
        "seed": number + 1,
        "accuracy": asked,
        "tissue": { "outline": ground.outline() },
        "time": { "duration": duration },
        "growth": { "turning_rate": numbers.across(0.3, 3.0) },
        "populations": { "axons": { "count": numbers.between(20.0, 80.0) as u64, "speed": speed } },
    });
    let discs = with_cues(&mut scene, &ground, &mut numbers);
    if let Some(&disc) = discs.first().filter(|_| numbers.happens(0.3)) {
        scene["targets"] = json!({ "goal": disc_of(disc) });
    }
    if numbers.happens(0.4) {
        scene["borders"] = json!({ "range": numbers.between(3.0, 15.0) });
    }
    if !number.is_multiple_of(3) {
        let share = numbers.between(0.05, 0.25);
        let top = match number % 3 {
            1 => json!({ "outward": share }),
            _ => json!({ "shift": [share * ground.height, 0] }),
        };
        scene["matrix"] = json!({ "motion": { "top": top, "bottom": { "outward": 0 } } });
    }
    (scene, asked)
}

/// One to three cues with one or two discs each; returns all discs.
fn with_cues(scene: &mut Value, ground: &Ground, numbers: &mut Numbers) -> Vec<Disc> {
    let (mut discs, mut cues, mut receptors) = (Vec::new(), Map::new(), Map::new());
    let count = 1 + (3.0 * numbers.next()) as usize;
    for name in ["first", "second", "third"].into_iter().take(count) {
        let mut sources = Vec::new();
        for _ in 0..if numbers.happens(0.3) { 2 } else { 1 } {
            if let Some(disc) = ground.disc(numbers, &discs) {
                discs.push(disc);
                sources.push(disc_of(disc));
            }
        }
        if sources.is_empty() {
            continue;
        }
        let (decay_length, degradation) = (numbers.across(30.0, 400.0), numbers.across(0.5, 10.0));
        let diffusion = degradation * decay_length * decay_length;
        cues.insert(name.into(), json!({ "diffusion": diffusion, "degradation": degradation, "sources": sources }));
        let effect = if name == "first" || numbers.happens(0.4) { "attract" } else { "repel" };
        receptors.insert(name.into(), json!({ "effect": effect, "weight": numbers.between(0.3, 1.0) }));
    }
    let sensing = if numbers.happens(0.5) { "direction" } else { "occupancy" };
    scene["cues"] = Value::Object(cues);
    scene["chemotaxis"] = json!({ "sensing": sensing, "receptors": receptors });
    discs
}
