//! Checks of a scene that compare keys with each other, which a schema cannot state.

use std::collections::BTreeSet;

use super::names::{is_name, no_name};
use super::scene::{Births, Direction, Heading, Method, Origin, Outline, Population, Ring, Scene, Tissue};
use super::suggest::advice;
use crate::model::quantity::{Time, format_number};
use crate::model::shape::{Shape, check_ring, coordinates};
use crate::model::violation::{Violations, pointer_token};
use crate::numerics::polygon::{Inside, SideTree};

/// A run of more steps than this would not end.
const MOST_STEPS: f64 = 1e9;

impl Scene {
    /// Checks what no single key shows: edges and points that exist, intervals that run forward, a mesh and a number of steps that can
    /// be afforded.
    ///
    /// # Errors
    /// Every violation, with its pointer from the top of the scene.
    pub fn check(&self) -> Result<(), Violations> {
        self.check_except(&BTreeSet::new())
    }

    /// The same without the checks that look into one of the top-level keys named, which are known to be wrong already.
    ///
    /// # Errors
    /// As for [`Scene::check`].
    pub fn check_except(&self, broken: &BTreeSet<String>) -> Result<(), Violations> {
        let sound = |names: &[&str]| !names.iter().any(|name| broken.contains(*name));
        let mut violations = Violations::new();
        violations.demand(is_name(&self.name) || !sound(&["name"]), "/name", || no_name(&self.name));
        let nameable = !self.name.contains(['/', '\\', '\0']) && ![".", ".."].contains(&self.name.as_str());
        violations.demand(nameable || !sound(&["name"]), "/name", || {
            format!("\"{}\" cannot be the name of a directory of results", self.name)
        });
        if sound(&["tissue"]) {
            check_tissue(&self.tissue, &mut violations);
        }
        if sound(&["time"]) {
            self.check_time(&mut violations);
        }
        for (name, population) in self.populations.iter().filter(|_| sound(&["populations"])) {
            let pointer = format!("/populations{}", pointer_token(name));
            if sound(&["tissue"]) {
                check_origin(population, &self.tissue.outline, &pointer, &mut violations);
            }
            if sound(&["time"]) {
                check_births(population, self.time.duration, &pointer, &mut violations);
            }
        }
        for (name, target) in self.targets.iter().filter(|_| sound(&["targets"])) {
            let pointer = format!("/targets{}", pointer_token(name));
            check_region(
                target,
                sound(&["tissue"]).then_some(&self.tissue.outline),
                (&pointer, "the target"),
                &mut violations,
            );
        }
        violations.into_result()
    }

    fn check_time(&self, violations: &mut Violations) {
        let (duration, step) = (self.time.duration, self.time.step);
        violations.demand(step <= duration, "/time/step", || format!("{step} is longer than the duration, {duration}"));
        let steps = duration.0 / step.0;
        violations.demand(steps <= MOST_STEPS, "/time/step", || {
            format!("{steps:.1e} steps of {step} fill the duration of {duration}; at most {MOST_STEPS:e} are run")
        });
        let adaptive = self.time.method == Method::BogackiShampine;
        violations.demand(adaptive || self.time.tolerance.is_none(), "/time/tolerance", || {
            "only the method \"bogacki_shampine\" chooses its steps by a tolerance; leave the key out or set the method".to_owned()
        });
    }
}

fn check_tissue(tissue: &Tissue, violations: &mut Violations) {
    if let Outline::Polygon { outer, holes, vertices } = &tissue.outline {
        let mut found = Violations::new();
        check_named_ring(outer, "/tissue/outline/polygon/outer", &mut found);
        let border = Inside::within(SideTree::of_ring(&outer.coordinates()), Vec::new());
        for (index, hole) in holes.iter().enumerate() {
            let pointer = format!("/tissue/outline/polygon/holes/{index}");
            check_named_ring(hole, &pointer, &mut found);
            let outside = hole.coordinates().iter().position(|&point| !border.holds(point, round_off(point)));
            if let Some(point) = outside {
                found.push(format!("{pointer}/points/{point}"), "the hole reaches out of the outer border");
            }
        }
        if !found.is_empty() {
            return violations.extend_under("", found);
        }
        for (key, given) in
            [("refinement", tissue.refinement.is_some()), ("corner_radius", tissue.corner_radius.is_some())]
        {
            violations.demand(vertices.is_empty() || !given, &format!("/tissue/{key}"), || {
                "the outline gives the vertices inside; leave out one of both".to_owned()
            });
        }
    }
    tissue.mesh_extent().demand(tissue.mesh_size, "/tissue/mesh_size", violations);
}

fn check_named_ring(ring: &Ring, pointer: &str, violations: &mut Violations) {
    let mut found = Violations::new();
    check_ring(&ring.coordinates(), &format!("{pointer}/points"), &mut found);
    violations.extend_under("", found);
    let (sides, names) = (ring.points.len(), ring.edges.len());
    violations.demand(names == 0 || names == sides, &format!("{pointer}/edges"), || {
        format!("{names} names for {sides} sides; each side takes one")
    });
}

fn check_origin(population: &Population, outline: &Outline, pointer: &str, violations: &mut Violations) {
    match &population.origin {
        Origin::Edge(origin) => {
            let (part, names) = (origin.part(), outline.edge_names());
            violations.demand(names.contains(&part.name), &format!("{pointer}/origin/edge"), || {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                format!("the outline has no edge \"{}\"{}", part.name, advice(&part.name, "edges", &names, '"'))
            });
            violations.demand(part.from < part.to, &format!("{pointer}/origin/edge"), || {
                format!("the part from {} to {} has no length", part.from, part.to)
            });
        }
        Origin::Tissue => demand_direction(population, "the inside of a tissue has", pointer, violations),
        Origin::Points(points) => {
            let inside = inside_of(outline);
            for (index, point) in coordinates(points).into_iter().enumerate() {
                violations.demand(
                    inside.holds(point, round_off(point)),
                    &format!("{pointer}/origin/points/{index}"),
                    || format!("[{}, {}] lies outside the tissue", format_number(point[0]), format_number(point[1])),
                );
            }
            demand_direction(population, "points have", pointer, violations);
        }
    }
}

/// Demands a heading that does not need an edge.
fn demand_direction(population: &Population, what: &str, pointer: &str, violations: &mut Violations) {
    let along = population.heading == Heading::Along(Direction::InnerNormal);
    violations.demand(!along, &format!("{pointer}/heading"), || {
        format!("{what} no inner normal; give an angle such as 90, or \"random\"")
    });
}

fn check_births(population: &Population, duration: Time, pointer: &str, violations: &mut Violations) {
    let [from, to] = population.birth_interval(duration);
    let pointer = format!("{pointer}/births");
    if let Some(Births::Uniform { .. }) = population.births {
        violations.demand(from <= to, &pointer, || format!("from {from} to {to} runs backwards"));
    }
    violations
        .demand(from < duration, &pointer, || format!("the first birth, at {from}, is not before the end, {duration}"));
}

/// Checks that a region is a proper shape and lies inside the tissue; `place` is its pointer and what to call it.
pub(super) fn check_region(
    region: &Shape,
    outline: Option<&Outline>,
    place: (&str, &str),
    violations: &mut Violations,
) {
    if let Err(found) = region.check() {
        return violations.extend_under(place.0, found);
    }
    let inside = outline.is_none_or(|outline| lies_inside(region, outline));
    violations.demand(inside, place.0, || format!("{} lies outside the tissue, or partly so", place.1));
}

/// The inside of a tissue.
fn inside_of(outline: &Outline) -> Inside {
    let tree = |ring: &Ring| SideTree::of_ring(&ring.coordinates());
    Inside::within(tree(&outline.outer()), outline.holes().iter().map(tree).collect())
}

/// How far (µm) from a point its round-off may lead.
fn round_off(point: [f64; 2]) -> f64 {
    1e-12 * (1.0 + point[0].abs() + point[1].abs())
}

/// Points of a disc's rim that are looked at.
const RIM: usize = 64;

/// Whether a region lies inside the tissue, judged by the corners of a polygon and by points on the rim of a disc.
fn lies_inside(region: &Shape, outline: &Outline) -> bool {
    let inside = inside_of(outline);
    match region {
        Shape::Disc { centre, radius } => (0..RIM).all(|i| {
            let angle = std::f64::consts::TAU * i as f64 / RIM as f64;
            let reach = radius.0 * (1.0 - 1e-9);
            let point = [centre[0].0 + reach * angle.cos(), centre[1].0 + reach * angle.sin()];
            inside.holds(point, round_off(point))
        }),
        Shape::Polygon { points } => coordinates(points).iter().all(|&point| inside.holds(point, round_off(point))),
    }
}
