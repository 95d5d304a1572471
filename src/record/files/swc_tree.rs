//! Axons as trees of points: the trunk from its origin to its tip, each branch on the point of its parent where it sprouted.

use crate::model::components::GrowthCone;
use crate::model::configuration::Configuration;
use crate::model::growth::Populations;
use crate::model::remodel::SpareCones;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use crate::numerics::locate::MaterialPoint;
use bevy_ecs::prelude::{With, World};
use std::collections::BTreeMap;

/// A point of a tree, and the one before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Where it is (µm).
    pub at: [f64; 2],
    /// Place of the point before it in the list of points; none for the first.
    pub parent: Option<usize>,
}

/// An axon with its branches.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Number of the axon.
    pub axon: u32,
    /// Name of its population.
    pub population: String,
    /// The points, each after its parent.
    pub nodes: Vec<Node>,
}

/// A shaft as it lies: the material points and where they are (µm).
#[derive(Debug, Clone, PartialEq)]
struct Line {
    cone: u32,
    parent: Option<u32>,
    points: Vec<(MaterialPoint<2>, [f64; 2])>,
}

impl Tree {
    /// Σ of the distances of points from their parents (µm), branches too.
    pub fn length(&self) -> f64 {
        let step = |node: &Node| {
            let before = self.nodes[node.parent?].at;
            Some((node.at[0] - before[0]).hypot(node.at[1] - before[1]))
        };
        self.nodes.iter().filter_map(step).sum()
    }

    /// The tree of the shafts of one axon, parents before their branches. A point where the one before it is adds nothing and is left
    /// out; so is a branch that has been drawn back for good, with the fork that no longer holds its parent.
    fn grown(axon: u32, population: String, lines: &[Line]) -> Self {
        let mut nodes: Vec<Node> = Vec::new();
        let mut passed: BTreeMap<u32, Vec<(MaterialPoint<2>, usize)>> = BTreeMap::new();
        for line in lines {
            let Some((origin, at)) = line.points.first() else { continue };
            let parent = line.parent.and_then(|parent| passed.get(&parent)).map_or(&[][..], Vec::as_slice);
            let fork = parent.iter().find(|(point, _)| point == origin).map(|(_, node)| *node);
            let has_length = line.points.iter().any(|(_, place)| place != at);
            if line.parent.is_some() && fork.is_none() && !has_length {
                continue;
            }
            let mut last = fork.or_else(|| line.parent.and_then(|_| nearest(&nodes, *at)));
            let mut own = Vec::new();
            for (point, at) in &line.points {
                if last.is_none_or(|last: usize| nodes[last].at != *at) {
                    nodes.push(Node { at: *at, parent: last });
                    last = Some(nodes.len() - 1);
                }
                own.extend(last.map(|last| (*point, last)));
            }
            passed.insert(line.cone, own);
        }
        Self { axon, population, nodes }
    }
}

/// The node nearest to a place (µm).
fn nearest(nodes: &[Node], at: [f64; 2]) -> Option<usize> {
    let distance = |node: usize| (nodes[node].at[0] - at[0]).hypot(nodes[node].at[1] - at[1]);
    (0..nodes.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
}

/// The axons born so far, in the order of their numbers.
pub fn trees(world: &World) -> Vec<Tree> {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let (shafts, spares) = (world.resource::<Shafts>(), world.resource::<SpareCones>());
    let mut axons: BTreeMap<u32, Vec<Line>> = BTreeMap::new();
    for cone in 0..shafts.count() as u32 {
        let place = |point: MaterialPoint<2>| (point, configuration.place(&tissue.mesh, point));
        let points: Vec<_> = shafts.polyline(cone as usize).into_iter().map(place).collect();
        if !points.is_empty() {
            let line = Line { cone, parent: spares.parent(cone), points };
            axons.entry(spares.root(cone)).or_default().push(line);
        }
    }
    let names = population_names(world);
    let name = |axon: u32| names.get(&axon).cloned().unwrap_or_default();
    axons.into_iter().map(|(axon, lines)| Tree::grown(axon, name(axon), &lines)).collect()
}

fn population_names(world: &World) -> BTreeMap<u32, String> {
    let populations = &world.resource::<Populations>().0;
    let Some(mut cones) = world.try_query_filtered::<&GrowthCone, With<GrowthCone>>() else { return BTreeMap::new() };
    let name = |cone: &GrowthCone| Some((cone.axon, populations.get(usize::from(cone.population))?.name.clone()));
    cones.iter(world).filter_map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(cell: u32) -> MaterialPoint<2> {
        MaterialPoint { cell, weights: [0.25, 0.5] }
    }

    fn line(cone: u32, parent: Option<u32>, points: &[(u32, [f64; 2])]) -> Line {
        Line { cone, parent, points: points.iter().map(|(cell, at)| (point(*cell), *at)).collect() }
    }

    #[test]
    fn a_branch_hangs_on_the_point_where_it_sprouted_and_that_point_stands_once() {
        let trunk = line(0, None, &[(0, [0.0, 0.0]), (1, [0.0, 3.0]), (2, [0.0, 7.0])]);
        let branch = line(5, Some(0), &[(1, [0.0, 3.0]), (9, [4.0, 3.0])]);
        let twig = line(6, Some(5), &[(9, [4.0, 3.0]), (8, [4.0, 5.0])]);
        let tree = Tree::grown(0, String::new(), &[trunk, branch, twig]);
        let parents: Vec<_> = tree.nodes.iter().map(|node| node.parent).collect();
        assert_eq!(parents, [None, Some(0), Some(1), Some(1), Some(3)]);
        assert_eq!(tree.length(), 7.0 + 4.0 + 2.0);
    }

    #[test]
    fn points_that_coincide_stand_once_and_a_shaft_that_was_drawn_back_leaves_nothing() {
        let trunk = line(0, None, &[(0, [1.0, 0.0]), (3, [1.0, 0.0]), (1, [1.0, 2.0]), (4, [1.0, 2.0])]);
        let withdrawn = line(7, Some(0), &[(1, [1.0, 2.0]), (1, [1.0, 2.0])]);
        let further = line(8, Some(0), &[(6, [1.0, 9.0]), (6, [1.0, 9.0])]);
        let tree = Tree::grown(0, String::new(), &[trunk, withdrawn, further]);
        assert_eq!((tree.nodes.len(), tree.length()), (2, 2.0));
        assert_eq!(Tree::grown(1, String::new(), &[line(1, None, &[(0, [0.0; 2]), (0, [0.0; 2])])]).nodes.len(), 1);
    }

    #[test]
    fn a_branch_whose_fork_is_gone_hangs_on_the_nearest_point() {
        let trunk = line(0, None, &[(0, [0.0, 0.0]), (1, [0.0, 10.0])]);
        let branch = line(2, Some(0), &[(5, [1.0, 9.0]), (6, [1.0, 12.0])]);
        let tree = Tree::grown(0, String::new(), &[trunk, branch]);
        assert_eq!(tree.nodes[2], Node { at: [1.0, 9.0], parent: Some(1) });
        assert_eq!(tree.length(), 10.0 + 2.0_f64.sqrt() + 3.0);
    }
}
