//! Six structures by which neighbours are found, and none.

use crate::load::{MARGIN, REACH};
use rstar::primitives::GeomWithData;
use rstar::{AABB, ParentNode, RTree, RTreeNode};

/// Side of a square that has a list (µm).
const SQUARE: f64 = 3.0 * REACH;
/// How far a cone may go from where its own list was made (µm).
const SKIN: f64 = REACH;

/// A structure by which neighbours are found.
pub trait Neighbours {
    /// One for a square tissue of a side (µm), with nothing in it.
    fn new(side: f64) -> Self;

    /// Takes in a vertex that was laid at a place (µm).
    fn insert(&mut self, vertex: u32, at: [f64; 2]);

    /// Calls `act` for vertices, among them all whose segments may be within reach of a cone at a place (µm).
    fn near(&mut self, cone: u32, at: [f64; 2], act: impl FnMut(u32));

    /// Bytes that are held, with the room in vectors.
    fn bytes(&self) -> usize;
}

/// Looks at everything.
pub struct Everything(u32);

impl Neighbours for Everything {
    fn new(_: f64) -> Self {
        Self(0)
    }

    fn insert(&mut self, _: u32, _: [f64; 2]) {
        self.0 += 1;
    }

    fn near(&mut self, _: u32, _: [f64; 2], act: impl FnMut(u32)) {
        (0..self.0).for_each(act);
    }

    fn bytes(&self) -> usize {
        0
    }
}

type Entry = GeomWithData<[f64; 2], u32>;

/// An R-tree of vertices.
pub struct Tree(RTree<Entry>);

impl Tree {
    /// Vertices in a box that is widened by a reach (µm).
    fn ask(&self, [low, high]: [[f64; 2]; 2], reach: f64) -> impl Iterator<Item = u32> + '_ {
        let envelope = AABB::from_corners(low.map(|x| x - reach), high.map(|x| x + reach));
        self.0.locate_in_envelope(envelope).map(|entry| entry.data)
    }
}

/// A structure that is asked for the vertices near a place.
pub trait Asked: Neighbours {
    /// Vertices within a reach (µm) of a place along both axes, and perhaps some others.
    fn within(&self, at: [f64; 2], reach: f64) -> impl Iterator<Item = u32> + '_;
}

impl Asked for Tree {
    fn within(&self, at: [f64; 2], reach: f64) -> impl Iterator<Item = u32> + '_ {
        self.ask([at, at], reach)
    }
}

impl Neighbours for Tree {
    fn new(_: f64) -> Self {
        Self(RTree::new())
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        self.0.insert(Entry::new(at, vertex));
    }

    fn near(&mut self, _: u32, at: [f64; 2], act: impl FnMut(u32)) {
        self.within(at, MARGIN).for_each(act);
    }

    /// Estimated: a node tells how many children it has, not for how many it has room; by default that is seven.
    fn bytes(&self) -> usize {
        fn nodes(node: &ParentNode<Entry>) -> usize {
            let below = |child: &RTreeNode<Entry>| match child {
                RTreeNode::Leaf(_) => 0,
                RTreeNode::Parent(node) => nodes(node),
            };
            1 + node.children().iter().map(below).sum::<usize>()
        }
        7 * size_of::<RTreeNode<Entry>>() * nodes(self.0.root())
    }
}

/// A list for each square of a grid.
struct Squares {
    side: f64,
    columns: usize,
    lists: Vec<Vec<u32>>,
}

impl Squares {
    fn new(side_of_tissue: f64, side: f64) -> Self {
        let columns = (side_of_tissue / side).ceil() as usize;
        Self { side, columns, lists: vec![Vec::new(); columns * columns] }
    }

    /// Column or row of a coordinate (µm), the nearest for one outside.
    fn index(&self, x: f64) -> usize {
        ((x / self.side) as usize).min(self.columns - 1)
    }

    /// The square that a place lies in.
    fn of(&self, at: [f64; 2]) -> usize {
        self.index(at[1]) * self.columns + self.index(at[0])
    }

    /// Low and high corner (µm) of a square.
    fn corners(&self, square: usize) -> [[f64; 2]; 2] {
        let at = [square % self.columns, square / self.columns];
        [at.map(|i| i as f64 * self.side), at.map(|i| (i + 1) as f64 * self.side)]
    }

    /// The squares that come within a reach (µm) of a place along both axes.
    fn near(&self, at: [f64; 2], reach: f64) -> impl Iterator<Item = usize> + use<> {
        let columns = self.columns;
        let [across, along] = at.map(|x| self.index(x - reach)..=self.index(x + reach));
        along.flat_map(move |row| across.clone().map(move |column| row * columns + column))
    }

    fn bytes(&self) -> usize {
        let inside: usize = self.lists.iter().map(|list| list.capacity() * size_of::<u32>()).sum();
        self.lists.capacity() * size_of::<Vec<u32>>() + inside
    }
}

/// An R-tree, and lists of the squares for which it has been asked.
pub struct TreeLists {
    tree: Tree,
    squares: Squares,
    asked: Vec<bool>,
}

impl Neighbours for TreeLists {
    fn new(side: f64) -> Self {
        let squares = Squares::new(side, SQUARE);
        Self { tree: Tree::new(side), asked: vec![false; squares.lists.len()], squares }
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        self.tree.insert(vertex, at);
        for square in self.squares.near(at, MARGIN).filter(|square| self.asked[*square]) {
            self.squares.lists[square].push(vertex);
        }
    }

    fn near(&mut self, _: u32, at: [f64; 2], act: impl FnMut(u32)) {
        let square = self.squares.of(at);
        if !std::mem::replace(&mut self.asked[square], true) {
            let corners = self.squares.corners(square);
            self.squares.lists[square].extend(self.tree.ask(corners, MARGIN));
        }
        self.squares.lists[square].iter().copied().for_each(act);
    }

    fn bytes(&self) -> usize {
        self.tree.bytes() + self.squares.bytes() + self.asked.capacity()
    }
}

/// Cells with the vertices in them.
pub struct Cells(Squares);

impl Neighbours for Cells {
    fn new(side: f64) -> Self {
        Self(Squares::new(side, MARGIN))
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        let cell = self.0.of(at);
        self.0.lists[cell].push(vertex);
    }

    fn near(&mut self, _: u32, at: [f64; 2], act: impl FnMut(u32)) {
        self.within(at, MARGIN).for_each(act);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

impl Asked for Cells {
    fn within(&self, at: [f64; 2], reach: f64) -> impl Iterator<Item = u32> + '_ {
        self.0.near(at, reach).flat_map(|cell| &self.0.lists[cell]).copied()
    }
}

/// A list for each cone of what is near it or will be until it has gone by the skin: what a structure finds that is asked then, and what is laid
/// later.
pub struct Skins<A> {
    asked: A,
    /// Where each cone was when its list was made, and the list.
    lists: Vec<([f64; 2], Vec<u32>)>,
    /// The cones, by these places.
    cones: Squares,
}

impl<A: Asked> Neighbours for Skins<A> {
    fn new(side: f64) -> Self {
        Self { asked: A::new(side), lists: Vec::new(), cones: Squares::new(side, SQUARE) }
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        self.asked.insert(vertex, at);
        for cone in self.cones.near(at, MARGIN + SKIN).flat_map(|square| &self.cones.lists[square]) {
            let (made, list) = &mut self.lists[*cone as usize];
            if (made[0] - at[0]).abs().max((made[1] - at[1]).abs()) <= MARGIN + SKIN {
                list.push(vertex);
            }
        }
    }

    fn near(&mut self, cone: u32, at: [f64; 2], act: impl FnMut(u32)) {
        let number = cone as usize;
        self.lists.resize_with(self.lists.len().max(number + 1), || ([f64::INFINITY; 2], Vec::new()));
        let (made, list) = &mut self.lists[number];
        if (made[0] - at[0]).hypot(made[1] - at[1]) > SKIN {
            let [before, now] = [*made, at].map(|place| self.cones.of(place));
            if made[0].is_finite() {
                self.cones.lists[before].retain(|other| *other != cone);
            }
            self.cones.lists[now].push(cone);
            *made = at;
            list.clear();
            list.extend(self.asked.within(at, MARGIN + SKIN));
        }
        list.iter().copied().for_each(act);
    }

    fn bytes(&self) -> usize {
        let inside: usize = self.lists.iter().map(|(_, list)| list.capacity() * size_of::<u32>()).sum();
        let heads = self.lists.capacity() * size_of::<([f64; 2], Vec<u32>)>();
        self.asked.bytes() + self.cones.bytes() + heads + inside
    }
}

/// Squares with the vertices near them.
pub struct GridLists(Squares);

impl Neighbours for GridLists {
    fn new(side: f64) -> Self {
        Self(Squares::new(side, SQUARE))
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        for square in self.0.near(at, MARGIN) {
            self.0.lists[square].push(vertex);
        }
    }

    fn near(&mut self, _: u32, at: [f64; 2], act: impl FnMut(u32)) {
        self.0.lists[self.0.of(at)].iter().copied().for_each(act);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}
