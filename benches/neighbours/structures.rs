//! Four structures by which neighbours are found, and none.

use crate::load::{MARGIN, REACH};
use rstar::primitives::GeomWithData;
use rstar::{AABB, ParentNode, RTree, RTreeNode};

/// Side of a square that has a list (µm).
const SQUARE: f64 = 3.0 * REACH;

/// A structure by which neighbours are found.
pub trait Neighbours {
    /// One for a square tissue of a side (µm), with nothing in it.
    fn new(side: f64) -> Self;

    /// Takes in a vertex that was laid at a place (µm).
    fn insert(&mut self, vertex: u32, at: [f64; 2]);

    /// Calls `act` for vertices, among them all whose segments may be within reach of a place (µm).
    fn near(&mut self, at: [f64; 2], act: impl FnMut(u32));

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

    fn near(&mut self, _: [f64; 2], act: impl FnMut(u32)) {
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
    /// Vertices in a box, widened by the margin.
    fn ask(&self, low: [f64; 2], high: [f64; 2]) -> impl Iterator<Item = u32> + '_ {
        let envelope = AABB::from_corners(low.map(|x| x - MARGIN), high.map(|x| x + MARGIN));
        self.0.locate_in_envelope(envelope).map(|entry| entry.data)
    }
}

impl Neighbours for Tree {
    fn new(_: f64) -> Self {
        Self(RTree::new())
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        self.0.insert(Entry::new(at, vertex));
    }

    fn near(&mut self, at: [f64; 2], act: impl FnMut(u32)) {
        self.ask(at, at).for_each(act);
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

    /// The squares that come within the margin of a place along both axes.
    fn near(&self, at: [f64; 2]) -> impl Iterator<Item = usize> + use<> {
        let columns = self.columns;
        let [across, along] = at.map(|x| self.index(x - MARGIN)..=self.index(x + MARGIN));
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
        for square in self.squares.near(at).filter(|square| self.asked[*square]) {
            self.squares.lists[square].push(vertex);
        }
    }

    fn near(&mut self, at: [f64; 2], act: impl FnMut(u32)) {
        let square = self.squares.of(at);
        if !std::mem::replace(&mut self.asked[square], true) {
            let [low, high] = self.squares.corners(square);
            self.squares.lists[square].extend(self.tree.ask(low, high));
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

    fn near(&mut self, at: [f64; 2], act: impl FnMut(u32)) {
        self.0.near(at).flat_map(|cell| &self.0.lists[cell]).copied().for_each(act);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

/// Squares with the vertices near them.
pub struct GridLists(Squares);

impl Neighbours for GridLists {
    fn new(side: f64) -> Self {
        Self(Squares::new(side, SQUARE))
    }

    fn insert(&mut self, vertex: u32, at: [f64; 2]) {
        for square in self.0.near(at) {
            self.0.lists[square].push(vertex);
        }
    }

    fn near(&mut self, at: [f64; 2], act: impl FnMut(u32)) {
        self.0.lists[self.0.of(at)].iter().copied().for_each(act);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}
