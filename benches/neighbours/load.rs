//! Axons that grow, and what a cone makes of the segments that it is shown.

use crate::structures::Neighbours;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

const SEED: u64 = 1;
/// Side of the square that an axon has to itself at the start (µm).
const SPACING: f64 = 30.0;
/// Growth in a step (µm).
const STEP_LENGTH: f64 = 2.0;
/// Largest turn in a step (radians).
const TURN: f64 = 0.2;
/// How far a cone feels (µm).
pub const REACH: f64 = 10.0;
/// Longest segment that a structure has to expect (µm), as in the program.
const LONGEST: f64 = 12.0;
/// How far from a cone the first vertex of a segment within its reach may be (µm).
pub const MARGIN: f64 = REACH + LONGEST;

/// Segments within reach of all cones, and the sum of their distances (1e-6 µm).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Found {
    pub count: u64,
    pub distances: u64,
}

/// A vertex that was laid.
pub struct Vertex {
    pub at: [f64; 2],
    axon: u32,
}

/// Axons that grow. All lay their vertices at the same step, in the order of their numbers.
pub struct Load {
    pub side: f64,
    random: Xoshiro256PlusPlus,
    tips: Vec<[f64; 2]>,
    headings: Vec<f64>,
    pub vertices: Vec<Vertex>,
}

impl Load {
    /// So many axons at their starts, with nothing laid.
    pub fn new(axons: usize) -> Self {
        let columns = (axons as f64).sqrt().ceil() as u32;
        let mut places: Vec<[u32; 2]> =
            (0..columns).flat_map(|row| (0..columns).map(move |column| [column, row])).collect();
        places.sort_by_key(|place| morton(*place));
        places.truncate(axons);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let tips = places.iter().map(|at| at.map(|i| SPACING * (f64::from(i) + random.random::<f64>()))).collect();
        let headings = places.iter().map(|_| std::f64::consts::TAU * random.random::<f64>()).collect();
        Self { side: SPACING * f64::from(columns), random, tips, headings, vertices: Vec::new() }
    }

    /// Lays a vertex at each tip, and returns their numbers.
    pub fn lay_vertices(&mut self) -> std::ops::Range<usize> {
        let first = self.vertices.len();
        self.vertices.extend((0..).zip(&self.tips).map(|(axon, &at)| Vertex { at, axon }));
        first..self.vertices.len()
    }

    /// Turns all headings a little, and lets all tips grow by a step.
    pub fn grow(&mut self) {
        for (tip, heading) in self.tips.iter_mut().zip(&mut self.headings) {
            *heading += TURN * (2.0 * self.random.random::<f64>() - 1.0);
            let (sin, cos) = heading.sin_cos();
            let next = [tip[0] + STEP_LENGTH * cos, tip[1] + STEP_LENGTH * sin];
            *tip = next.map(|x| if x > self.side { 2.0 * self.side - x } else { x.abs() });
            let mirrored = [0, 1].map(|k| if tip[k] == next[k] { 1.0 } else { -1.0 });
            *heading = (mirrored[1] * sin).atan2(mirrored[0] * cos);
        }
    }

    /// What all cones find by a structure.
    pub fn find(&self, neighbours: &mut impl Neighbours) -> Found {
        let mut found = Found::default();
        for (axon, &tip) in (0..).zip(&self.tips) {
            neighbours.near(axon, tip, |vertex| {
                if let Some(distance) = self.distance(vertex as usize, axon, tip) {
                    found.count += 1;
                    found.distances += (1e6 * distance).round() as u64;
                }
            });
        }
        found
    }

    /// Distance (µm) of the segment that begins at a vertex from the tip of an axon, if it is another's and within reach.
    #[inline]
    fn distance(&self, vertex: usize, axon: u32, tip: [f64; 2]) -> Option<f64> {
        let first = &self.vertices[vertex];
        let from = [tip[0] - first.at[0], tip[1] - first.at[1]];
        if first.axon == axon || dot(from, from) > MARGIN * MARGIN {
            return None;
        }
        let end = self.vertices.get(vertex + self.tips.len()).map_or(self.tips[first.axon as usize], |next| next.at);
        let along = [end[0] - first.at[0], end[1] - first.at[1]];
        let share = (dot(from, along) / dot(along, along).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let away = [from[0] - share * along[0], from[1] - share * along[1]];
        let squared = dot(away, away);
        (squared <= REACH * REACH).then(|| squared.sqrt())
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Place along the Morton curve.
fn morton([column, row]: [u32; 2]) -> u64 {
    let bit = |number: u32, i: u32| u64::from(number >> i & 1);
    (0..32).fold(0, |place, i| place | bit(column, i) << (2 * i) | bit(row, i) << (2 * i + 1))
}
