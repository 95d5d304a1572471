//! Lists of the stored vertices near each square of a grid over the reference configuration.
//!
//! Squares are numbered along a Morton curve, so that neighbours in the plane are near in memory and in the order of work. A square has
//! a list from the moment something asks for it, and keeps it.

use crate::model::shafts::BLOCK;
use crate::prelude::VertexId;
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Place of a square along the Morton curve.
pub type Square = u64;

/// Squares of a tile, whose lists lie next to each other in memory: 8 by 8.
const TILE: usize = 64;

/// The lists of all squares that have one.
#[derive(Debug, Default)]
pub struct Squares {
    numbers: HashMap<u64, u32, BuildHasherDefault<PlaceHasher>>,
    tiles: Vec<Tile>,
}

/// The lists of 8 by 8 squares, and a bit for each that there is.
#[derive(Debug)]
struct Tile {
    made: u64,
    lists: [Vec<Listed>; TILE],
}

impl Tile {
    /// The list of the square at a place, from now on.
    fn list(&mut self, place: usize) -> &mut Vec<Listed> {
        self.made |= 1 << place;
        &mut self.lists[place]
    }
}

/// Vertices that are put into lists at a time.
const ROUND: usize = 1 << 16;
/// Vertices, and tiles, that are one task.
const TASK: usize = 64;

/// A vertex for the list of a square.
#[derive(Debug, Clone, Copy, Default)]
struct Named {
    square: Square,
    vertex: VertexId,
    /// The parts of the square that it may be near to.
    parts: u16,
}

/// Vertices for lists, tile after tile: those of the n-th stand from `starts[n]` to `starts[n + 1]`.
struct ByTile {
    named: Vec<Named>,
    starts: Vec<u32>,
}

/// Place of a square's tile along the curve, and of the square in it.
fn tile_and_place(square: Square) -> (u64, usize) {
    (square / TILE as u64, (square % TILE as u64) as usize)
}

/// A block of stored vertices in the list of a square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Listed {
    /// The block.
    pub block: u32,
    /// A bit for each vertex that is meant.
    pub vertices: u16,
    /// A bit for each of the 4 by 4 parts of the square to which one of them may be near.
    pub parts: u16,
}

/// Hashes the place of a tile: its bits are spread already, and are mixed once.
#[derive(Debug, Default)]
pub struct PlaceHasher(u64);

impl Hasher for PlaceHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(u64::from(byte)));
    }

    fn write_u64(&mut self, place: u64) {
        let mixed = (self.0 ^ place).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = mixed ^ (mixed >> 32);
    }
}

impl Squares {
    /// The list of a square; none if it has none yet.
    pub fn get(&self, square: Square) -> Option<&[Listed]> {
        let (tile, place) = tile_and_place(square);
        let tile = &self.tiles[*self.numbers.get(&tile)? as usize];
        (tile.made >> place & 1 != 0).then(|| tile.lists[place].as_slice())
    }

    /// The list of a square, if it has one, to be changed.
    pub fn get_mut(&mut self, square: Square) -> Option<&mut Vec<Listed>> {
        let (tile, place) = tile_and_place(square);
        let tile = &mut self.tiles[*self.numbers.get(&tile)? as usize];
        (tile.made >> place & 1 != 0).then(|| &mut tile.lists[place])
    }

    /// The list of a square, from now on.
    pub fn make(&mut self, square: Square) -> &mut Vec<Listed> {
        let (tile, place) = tile_and_place(square);
        let number = self.number(tile);
        self.tiles[number].list(place)
    }

    /// The number of a tile, from now on.
    fn number(&mut self, tile: u64) -> usize {
        let next = self.tiles.len() as u32;
        let number = *self.numbers.entry(tile).or_insert(next);
        if number == next {
            self.tiles.push(Tile { made: 0, lists: std::array::from_fn(|_| Vec::new()) });
        }
        number as usize
    }

    /// Puts vertices with their places (µm) into the lists of all squares of side `side` (µm) that come nearer than `margin` to them: sorted by
    /// tiles, which are then filled in parallel.
    pub fn put(&mut self, vertices: &[(VertexId, [f64; 2])], margin: f64, side: f64) {
        for round in vertices.chunks(ROUND) {
            let near = |&(vertex, at): &(VertexId, [f64; 2])| {
                squares_near(at, margin, side).map(move |(square, parts)| Named { square, vertex, parts })
            };
            let found: Vec<Named> = round.par_iter().with_min_len(TASK).flat_map_iter(near).collect();
            let by_tile = self.sorted(&found);
            let tiles = self.tiles.par_iter_mut().zip(by_tile.starts.par_windows(2));
            tiles.with_min_len(TASK).for_each(|(tile, range)| {
                for &Named { square, vertex, parts } in &by_tile.named[range[0] as usize..range[1] as usize] {
                    name(tile.list(tile_and_place(square).1), vertex, parts);
                }
            });
        }
    }

    /// What was found in the order of its tiles, which are made where they are missing.
    fn sorted(&mut self, found: &[Named]) -> ByTile {
        let mut last = None;
        let mut number = |tile: u64| match last {
            Some((known, number)) if known == tile => number,
            _ => {
                let number = self.number(tile);
                last = Some((tile, number));
                number
            }
        };
        let numbers: Vec<u32> = found.iter().map(|named| number(tile_and_place(named.square).0) as u32).collect();
        // Counting sort: where the next of each tile goes, which ends as where those of the next tile start.
        let mut starts = vec![0; self.tiles.len() + 2];
        numbers.iter().for_each(|&number| starts[number as usize + 2] += 1);
        (2..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut named = vec![Named::default(); found.len()];
        for (found, &number) in found.iter().zip(&numbers) {
            let next: &mut u32 = &mut starts[number as usize + 1];
            named[*next as usize] = *found;
            *next += 1;
        }
        starts.pop();
        ByTile { named, starts }
    }

    /// Forgets all lists.
    pub fn clear(&mut self) {
        self.numbers.clear();
        self.tiles.clear();
    }
}

/// The largest whole number that is not above a number: `f64::floor` is a call on processors for which programs are commonly compiled.
fn floor(x: f64) -> i32 {
    let towards_zero = x as i32;
    towards_zero.saturating_sub(i32::from(f64::from(towards_zero) > x))
}

/// The square of side `side` (µm) that a point lies in.
pub fn square(x: [f64; 2], side: f64) -> Square {
    let [column, row] = x.map(|x| floor(x / side));
    morton(column, row)
}

/// The squares of side `side` that come nearer than `margin` (µm) to a point, rows first, each with a bit for each of its parts
/// that does.
pub fn squares_near(x: [f64; 2], margin: f64, side: f64) -> impl Iterator<Item = (Square, u16)> {
    let low = x.map(|x| floor((x - margin) / side));
    let high = x.map(|x| floor((x + margin) / side));
    let rows = (low[1]..=high[1]).map(move |row| (row, away(f64::from(row) * side, x[1], side)));
    let squares = rows.flat_map(move |(row, rows)| {
        (low[0]..=high[0]).map(move |column| {
            let columns = away(f64::from(column) * side, x[0], side);
            (morton(column, row), within(margin, side, [&columns, &rows]))
        })
    });
    squares.filter(|(_, parts)| *parts != 0)
}

/// Low and high corner (µm) of a square.
pub fn corners(square: Square, side: f64) -> [[f64; 2]; 2] {
    let at = [even_bits(square), even_bits(square >> 1)].map(|bits| f64::from((bits ^ SIGN) as i32));
    [at.map(|i| i * side), at.map(|i| (i + 1.0) * side)]
}

/// Puts negative numbers before the others.
const SIGN: u32 = 1 << 31;

fn morton(column: i32, row: i32) -> Square {
    spread(column as u32 ^ SIGN) | spread(row as u32 ^ SIGN) << 1
}

/// The bits of a number at the even places.
fn spread(bits: u32) -> u64 {
    let mut x = u64::from(bits);
    for (shift, mask) in [
        (16, 0x0000_FFFF_0000_FFFF),
        (8, 0x00FF_00FF_00FF_00FF),
        (4, 0x0F0F_0F0F_0F0F_0F0F),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

fn even_bits(square: Square) -> u32 {
    (0..32).fold(0, |bits, i| bits | (((square >> (2 * i)) & 1) as u32) << i)
}

/// Parts of a square along its side.
const ALONG: usize = 4;

/// The bit of the part of a square of side `side` (µm) that a point in it lies in.
pub fn part_of(x: [f64; 2], side: f64) -> u16 {
    let [column, row] = x.map(|x| {
        let share = x / side;
        (((share - f64::from(floor(share))) * ALONG as f64) as usize).min(ALONG - 1)
    });
    1 << (row * ALONG + column)
}

/// The bits of the parts of a square with this low corner to which a point is nearer than `margin` (µm).
pub fn parts_near(low: [f64; 2], x: [f64; 2], margin: f64, side: f64) -> u16 {
    let [columns, rows] = [0, 1].map(|k| away(low[k], x[k], side));
    within(margin, side, [&columns, &rows])
}

/// Squared distances (µm²) along one axis from the parts of a square that begins at `from` to a point at `x`.
fn away(from: f64, x: f64, side: f64) -> [f64; ALONG] {
    let width = side / ALONG as f64;
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    std::array::from_fn(|i| {
        let from = from + i as f64 * width - x;
        let away = larger(larger(from, -(from + width)), 0.0);
        away * away
    })
}

/// The bits of the parts of a square that are nearer than `margin` (µm), by their squared distances along both axes.
fn within(margin: f64, side: f64, [columns, rows]: [&[f64; ALONG]; 2]) -> u16 {
    // A hair more, for the rounding of places and corners.
    let reach = margin * (1.0 + 1e-9) + 1e-9 * side;
    let near = |part: usize| columns[part % ALONG] + rows[part / ALONG] <= reach * reach;
    (0..ALONG * ALONG).fold(0, |bits, part| bits | u16::from(near(part)) << part)
}

/// Puts a vertex into a list, which is ascending, for some parts of its square.
pub fn name(list: &mut Vec<Listed>, vertex: VertexId, parts: u16) {
    let (block, bit) = (vertex / BLOCK as u32, 1 << (vertex as usize % BLOCK));
    match list.binary_search_by_key(&block, |listed| listed.block) {
        Ok(at) => {
            list[at].vertices |= bit;
            list[at].parts |= parts;
        }
        Err(at) => list.insert(at, Listed { block, vertices: bit, parts }),
    }
}

/// Takes a vertex out of a list.
pub fn unname(list: &mut Vec<Listed>, vertex: VertexId) {
    let (block, bit) = (vertex / BLOCK as u32, 1 << (vertex as usize % BLOCK));
    if let Ok(at) = list.binary_search_by_key(&block, |listed| listed.block) {
        list[at].vertices &= !bit;
        if list[at].vertices == 0 {
            list.remove(at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_holds_the_points_between_its_corners_on_both_sides_of_the_origin() {
        for x in [[0.0, 0.0], [-0.1, 7.9], [123.4, -987.6], [-4e6, 4e6]] {
            let [low, high] = corners(square(x, 2.5), 2.5);
            assert!((0..2).all(|k| low[k] <= x[k] && x[k] < high[k]), "{x:?} {low:?} {high:?}");
        }
    }

    #[test]
    fn the_squares_near_a_point_are_those_that_its_disc_meets() {
        let near: Vec<_> = squares_near([0.2, 3.0], 1.5, 2.0).map(|(square, _)| square).collect();
        let expected =
            [[-1.0, 1.5], [0.5, 1.5], [-1.0, 2.5], [0.5, 2.5], [-1.0, 4.5], [0.5, 4.5]].map(|x| square(x, 2.0));
        assert_eq!(near, expected);
    }

    #[test]
    fn lists_stay_ascending_and_lose_what_is_taken_out() {
        let mut squares = Squares::default();
        assert!(squares.get(3).is_none() && squares.get_mut(3).is_none());
        for (vertex, parts) in [(35, 1), (2, 2), (33, 4), (0, 2), (900, 8)] {
            name(squares.make(3), vertex, parts);
        }
        let listed = |block, vertices, parts| Listed { block, vertices, parts };
        let (first, last) = (listed(0, 0b101, 2), listed(112, 0b10000, 8));
        assert_eq!(squares.get(3), Some(&[first, listed(4, 0b1010, 5), last][..]));
        unname(squares.make(3), 900);
        unname(squares.make(3), 35);
        assert_eq!(squares.get(3), Some(&[first, listed(4, 0b10, 5)][..]));
    }

    #[test]
    fn a_point_is_near_to_the_parts_that_its_disc_meets() {
        let side = 8.0;
        let here = [0.0; 2];
        assert_eq!(parts_near(here, [1.0, 1.0], 0.9, side), 1);
        assert_eq!(parts_near(here, [-3.0, 1.0], 3.1, side), 1);
        assert_eq!(parts_near(here, [1.9, 1.9], 0.12, side), 0b0001_0011, "the corner is farther");
        assert_eq!(parts_near(here, [4.0, 4.0], 6.0, side), u16::MAX);
        for i in 0..400 {
            let x = [0.02 * f64::from(i), 8.0 - 0.019 * f64::from(i + 1)];
            assert_eq!(parts_near(here, x, 0.0, side) & part_of(x, side), part_of(x, side), "{x:?}");
        }
        assert_eq!(part_of([-1.0, -7.0], side), 1 << 3);
    }

    #[test]
    fn lists_that_are_filled_tile_by_tile_are_those_filled_one_by_one_in_any_order() {
        let (margin, side) = (7.0, 10.0);
        let at = |i: u32| [f64::from(i * 37 % 211) - 90.0, 1.3 * f64::from(i * 53 % 197) - 60.0];
        let vertices: Vec<_> = (0..3000).map(|i| (i, at(i))).collect();
        let (mut together, mut apart) = (Squares::default(), Squares::default());
        together.put(&vertices[..2000], margin, side);
        together.put(&vertices[2000..], margin, side);
        for &(vertex, at) in vertices.iter().rev() {
            squares_near(at, margin, side).for_each(|(square, parts)| name(apart.make(square), vertex, parts));
        }
        for (square, _) in vertices.iter().flat_map(|(_, at)| squares_near(*at, margin, side)) {
            assert!(together.get(square).is_some() && together.get(square) == apart.get(square));
        }
    }
}
