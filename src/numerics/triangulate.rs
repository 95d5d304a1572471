//! A mesh of a planar domain that is fitted to the outlines of sources and targets.
//!
//! Border and outlines are cut where they meet, sampled at the wanted size and kept as edges of a constrained Delaunay
//! triangulation; an equilateral lattice fills the room between them; Delaunay refinement then mends angles only. So the
//! mesh conforms to every outline (a region's area is the outline's, to round-off), is Delaunay, and has no obtuse angle
//! facing a border or outline edge, which is what the discrete maximum principle asks of it. A domain that gives vertices is filled
//! by these instead of a lattice.
//!
//! Vertices and cells are numbered along a Morton curve: neighbours in the plane are neighbours in memory.

use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};

use crate::numerics::arrangement::{Arrangement, Narrow};
use crate::numerics::lattice::filling;
use crate::numerics::mesh_grading::Grading;
use crate::numerics::nearest_side::NearestSide;
use crate::numerics::planar_domain::{DomainError, Outline, PlanarDomain};
use crate::numerics::polygon::{
    MERGE_TOLERANCE, bounding_box, cross, distance, dot, minus, nearest_on_side, sides, signed_area,
};
use crate::numerics::side_tree::{Inside, SideTree};
use crate::numerics::simplex_mesh::{MeshError, SimplexMesh};

/// How fine and how good the mesh shall be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Wanted length of an edge (µm).
    pub size: f64,
    /// Smallest angle that refinement shall reach (radians); above 0.5 (29°) it may not end.
    pub min_angle: f64,
    /// Most vertices allowed.
    pub max_vertices: usize,
}

impl MeshOptions {
    /// The options for edges of `size` µm: 27°, at most two million vertices.
    pub fn of_size(size: f64) -> Self {
        Self { size, min_angle: 27.0_f64.to_radians(), max_vertices: 2_000_000 }
    }
}

/// A mesh fitted to outlines.
#[derive(Debug, Clone)]
pub struct FittedMesh {
    /// The mesh, its border facets named after the domain's edges.
    pub mesh: SimplexMesh<2>,
    /// For each outline the cells inside it, ascending. Outlines may overlap.
    pub regions: Vec<Vec<u32>>,
    /// Smallest angle of all cells (radians).
    pub min_angle: f64,
}

/// Why a domain could not be meshed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TriangulationError {
    /// The domain is not made of proper polygons.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// An outline is not a proper polygon.
    #[error("outline {outline} is no proper polygon: {error}")]
    Outline {
        /// Index of the outline.
        outline: usize,
        /// What is wrong with it.
        error: DomainError,
    },
    /// An option makes no sense.
    #[error("the mesh option {option} is {value}, which is not {wanted}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What it has to be.
        wanted: &'static str,
    },
    /// An outline leaves the domain.
    #[error("outline {outline} is not inside the domain at ({}, {}) µm", point[0], point[1])]
    OutlineOutside {
        /// Index of the outline.
        outline: usize,
        /// A point of it that is outside, or a point of a hole that it covers.
        point: [f64; 2],
    },
    /// Outlines cross one another in too many places.
    #[error("outlines have more than {limit} points, with those in which they cross one another")]
    Crossings {
        /// Most points allowed.
        limit: usize,
    },
    /// Sides come so near to one another that cells between them would be too many.
    #[error(
        "sides come within {distance:.1e} µm of one another at ({:.4}, {:.4}) µm: a mesh without small angles would need more than {limit} \
         vertices there. Move them apart (shapes may touch), or ask for a smaller size",
        point[0],
        point[1]
    )]
    Narrow {
        /// Index of the first outline that goes through the point; none if it is of the domain.
        outline: Option<usize>,
        /// Where sides come nearest (µm).
        point: [f64; 2],
        /// How near (µm).
        distance: f64,
        /// How many vertices may be added to mend angles.
        limit: usize,
    },
    /// More vertices would be needed than are allowed.
    #[error("the mesh needs more than {limit} vertices at the size {size} µm")]
    TooManyVertices {
        /// Most vertices allowed.
        limit: usize,
        /// Size of the mesh (µm).
        size: f64,
    },
    /// The cells of an outline do not cover it.
    #[error("the cells of outline {outline} cover {area} µm² of its {wanted} µm²")]
    NotFitted {
        /// Index of the outline.
        outline: usize,
        /// Area of the cells (µm²).
        area: f64,
        /// Area of the outline (µm²).
        wanted: f64,
    },
    /// The triangulation library refused a coordinate.
    #[error("the triangulation refused a point: {0}")]
    Library(String),
    /// The triangles do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Triangulates a domain so that the mesh conforms to its border and to all outlines.
///
/// `outlines` are closed polygons inside the domain (they may touch its border, and overlap each other); regions come back
/// in their order. The result is the same to the last bit for the same input.
///
/// # Errors
/// An improper domain, outline or option; an outline that is not inside the domain; too many vertices.
pub fn triangulate(
    domain: &PlanarDomain,
    outlines: &[Outline],
    options: &MeshOptions,
) -> Result<FittedMesh, TriangulationError> {
    triangulate_graded(domain, outlines, options, &Grading::even(options.size))
}

/// [`triangulate`] with shorter edges where a grading (of the same size) asks for them.
///
/// # Errors
/// As [`triangulate`].
pub fn triangulate_graded(
    domain: &PlanarDomain,
    outlines: &[Outline],
    options: &MeshOptions,
    grading: &Grading,
) -> Result<FittedMesh, TriangulationError> {
    check_options(options)?;
    domain.check()?;
    let ground = Ground::of(domain);
    for (index, outline) in outlines.iter().enumerate() {
        outline.check("the shape").map_err(|error| TriangulationError::Outline { outline: index, error })?;
        check_inside((domain, &ground), index, outline)?;
    }
    let segments: Vec<_> = domain
        .rings()
        .flat_map(|ring| sides(&ring.points))
        .chain(outlines.iter().flat_map(|outline| sides(&outline.points)))
        .collect();
    let along: f64 = segments.iter().map(|&[a, b]| distance(a, b) / options.size).sum();
    if along > options.max_vertices as f64 {
        return Err(TriangulationError::TooManyVertices { limit: options.max_vertices, size: options.size });
    }
    let limit = CROSSINGS[0] + CROSSINGS[1] * segments.len();
    let constraints = Arrangement::within(&segments, merged(domain), limit)
        .ok_or(TriangulationError::Crossings { limit })?
        .sampled(options.size, |point| grading.size_at(point));
    let (vertices, triangles) = refined_triangles(domain, (&constraints, outlines), options, grading)?;
    let (vertices, cells) = kept_and_renumbered(domain, &vertices, &triangles);
    let mut mesh = SimplexMesh::new(vertices, cells)?;
    let outline = NearestSide::of(domain);
    mesh.name_border(|midpoint| outline.edge_at(midpoint));
    let regions = regions(&mesh, outlines)?;
    let min_angle = smallest_angle(&mesh, mesh.vertices());
    Ok(FittedMesh { mesh, regions, min_angle })
}

/// Smallest angle of all cells (radians) at the given coordinates (µm).
pub fn smallest_angle(mesh: &SimplexMesh<2>, coordinates: &[[f64; 2]]) -> f64 {
    let corners = |cell: usize| -> [[f64; 2]; 3] { std::array::from_fn(|i| coordinates[mesh.cell(cell)[i] as usize]) };
    let angle = |x: &[[f64; 2]; 3], i: usize| {
        let (a, b) = (minus(x[(i + 1) % 3], x[i]), minus(x[(i + 2) % 3], x[i]));
        cross(a, b).atan2(dot(a, b))
    };
    (0..mesh.cell_count())
        .flat_map(|cell| {
            let x = corners(cell);
            [0, 1, 2].map(|i| angle(&x, i))
        })
        .fold(f64::INFINITY, f64::min)
}

fn check_options(options: &MeshOptions) -> Result<(), TriangulationError> {
    if !(options.size > 0.0 && options.size.is_finite()) {
        return Err(TriangulationError::Option { option: "size", value: options.size, wanted: "positive" });
    }
    if !(0.0..=0.6).contains(&options.min_angle) {
        let wanted = "between 0 and 0.6 radians";
        return Err(TriangulationError::Option { option: "min_angle", value: options.min_angle, wanted });
    }
    Ok(())
}

/// Where outlines have to lie: sides and inside of a domain.
struct Ground {
    border: SideTree,
    inside: Inside,
    /// Distance (µm) within which a point counts as on the border.
    tolerance: f64,
}

impl Ground {
    fn of(domain: &PlanarDomain) -> Self {
        let border = SideTree::of(domain.rings().flat_map(|ring| sides(&ring.points)).collect());
        Self { border, inside: Inside::of(domain), tolerance: 10.0 * merged(domain) }
    }

    fn holds(&self, point: [f64; 2]) -> bool {
        self.inside.contains(point) || self.border.pass(point, self.tolerance)
    }

    /// A point of a side that does not lie inside, if there is one: of its ends and of the middles of the pieces into which the border cuts it.
    fn outside(&self, [from, to]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
        let mut shares = vec![0.0, 1.0];
        for [a, b] in self.border.near(&[from, to], self.tolerance).into_iter().map(|place| self.border.side(place)) {
            let divisor = cross(minus(to, from), minus(b, a));
            shares.push(cross(minus(a, from), minus(b, a)) / divisor);
        }
        shares.retain(|share| (0.0..=1.0).contains(share));
        shares.sort_by(f64::total_cmp);
        let at = |share: f64| [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
        let middles = shares.windows(2).map(|pair| at(0.5 * (pair[0] + pair[1])));
        std::iter::once(from).chain(middles).find(|point| !self.holds(*point))
    }
}

/// Every point of an outline must be inside; and it may not cover a hole.
fn check_inside(
    (domain, ground): (&PlanarDomain, &Ground),
    index: usize,
    outline: &Outline,
) -> Result<(), TriangulationError> {
    let outline_sides = SideTree::of_ring(&outline.points);
    let covered = |point: &&[f64; 2]| outline_sides.enclose(**point) && !outline_sides.pass(**point, ground.tolerance);
    let outside = sides(&outline.points).find_map(|side| ground.outside(side));
    match outside.or_else(|| domain.holes.iter().flat_map(|hole| &hole.points).find(covered).copied()) {
        Some(point) => Err(TriangulationError::OutlineOutside { outline: index, point }),
        None => Ok(()),
    }
}

/// Vertices that may be added to mend angles: so many, and so many for each that size and shapes ask for. Elsewhere they are a few in a hundred;
/// between sides that nearly touch they go with length over distance.
const MENDING: [usize; 2] = [50_000, 4];

/// Points that outlines may have with their crossings: so many, and so many for each side.
const CROSSINGS: [usize; 2] = [20_000, 4];

/// Squares of the size that the box around a domain may hold, over the vertices that are allowed: a slanted strip fills little of it.
const EMPTY_BOX: f64 = 10.0;

/// Distance (µm) within which points of a domain and its outlines are one.
fn merged(domain: &PlanarDomain) -> f64 {
    MERGE_TOLERANCE * domain.diameter()
}

/// Vertices, and triangles by their numbers.
type Soup = (Vec<[f64; 2]>, Vec<[u32; 3]>);

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

fn refined_triangles(
    domain: &PlanarDomain,
    (constraints, outlines): (&Arrangement, &[Outline]),
    options: &MeshOptions,
    grading: &Grading,
) -> Result<Soup, TriangulationError> {
    let too_many = TriangulationError::TooManyVertices { limit: options.max_vertices, size: options.size };
    let [low, high] = bounding_box(&domain.outer.points);
    let (squares, most) = (|area: f64| area / (options.size * options.size), options.max_vertices as f64);
    if squares(domain.area()) + constraints.points.len() as f64 > most
        || squares((high[0] - low[0]) * (high[1] - low[1])) > EMPTY_BOX * most
    {
        return Err(too_many);
    }
    let mut points = constraints.points.clone();
    points.extend(filling(domain, (constraints, outlines), options.size, grading));
    points.extend(frame(domain, constraints));
    if points.len() > options.max_vertices {
        return Err(too_many);
    }
    let settled = |x: f64| if x.abs() < 1e-100 { 0.0 } else { x };
    let points: Vec<_> = points.iter().map(|p| Point2::new(settled(p[0]), settled(p[1]))).collect();
    let count = points.len();
    let library = |error: spade::InsertionError| TriangulationError::Library(error.to_string());
    let mut cdt = Cdt::bulk_load_cdt(points, Vec::new()).map_err(library)?;
    if cdt.num_vertices() != count {
        return Err(TriangulationError::Library(format!("{} points coincide", count - cdt.num_vertices())));
    }
    let handle = |i: u32| spade::handles::FixedVertexHandle::from_index(i as usize);
    for &[from, to] in &constraints.segments {
        cdt.add_constraint_and_split(handle(from), handle(to), |point| point);
    }
    let (room, limit) = (options.max_vertices - count, MENDING[0] + MENDING[1] * count);
    let mut refined = |vertices: usize| {
        let limited = RefinementParameters::new().with_angle_limit(AngleLimit::from_rad(options.min_angle));
        cdt.refine(limited.with_max_additional_vertices(vertices)).refinement_complete
    };
    if !refined(room.min(limit)) {
        let narrow = constraints.narrowest();
        // Between folds of the border nothing is kept, but mended all the same.
        let is_outside = narrow.is_some_and(|narrow| !domain.contains(narrow.middle));
        if !(is_outside && limit < room && refined(room - limit)) {
            let narrow = narrow.filter(|narrow| !is_outside && (limit < room || narrow.is_to_blame()));
            return Err(narrow.map_or(too_many, |Narrow { point, distance, .. }| {
                let through = |outline: &Outline| {
                    sides(&outline.points).any(|side| nearest_on_side(side, point).distance <= merged(domain))
                };
                let (outline, limit) = (outlines.iter().position(through), limit.min(room));
                TriangulationError::Narrow { outline, point, distance, limit }
            }));
        }
    }
    let vertices = cdt.vertices().map(|v| [v.position().x, v.position().y]).collect();
    let triangles = cdt.inner_faces().map(|face| face.vertices().map(|v| v.index() as u32)).collect();
    Ok((vertices, triangles))
}

/// Corners of a box well outside the domain. Points on a slanted side lie on it only up to round-off, so that they and the convex hull
/// would enclose triangles without a height, which no refinement mends; with a box around, the hull is the box's. Sides parallel
/// to an axis are exact and need none, unless an outline that touches one does so up to round-off and takes it along.
fn frame(domain: &PlanarDomain, constraints: &Arrangement) -> Vec<[f64; 2]> {
    let slanted = |[a, b]: &[[f64; 2]; 2]| a[0] != b[0] && a[1] != b[1];
    let border: Vec<_> = domain.rings().flat_map(|ring| sides(&ring.points)).collect();
    if !border.iter().any(slanted) {
        let tree = SideTree::of(border);
        let beside = |point: &[f64; 2]| {
            let near = tree.near(&[*point; 2], merged(domain)).into_iter().map(|place| tree.side(place));
            let nearest = near.map(|side| nearest_on_side(side, *point).distance).fold(f64::INFINITY, f64::min);
            nearest > 0.0 && nearest <= merged(domain)
        };
        if !constraints.points.iter().any(beside) {
            return Vec::new();
        }
    }
    let [low, high] = domain.bounding_box();
    let room = 0.5 * domain.diameter();
    let (x, y) = ([low[0] - room, high[0] + room], [low[1] - room, high[1] + room]);
    vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]]
}

/// Drops what is outside, and numbers the rest along a Morton curve.
fn kept_and_renumbered(
    domain: &PlanarDomain,
    vertices: &[[f64; 2]],
    triangles: &[[u32; 3]],
) -> (Vec<[f64; 2]>, Vec<u32>) {
    let [low, high] = domain.bounding_box();
    let scale = [0, 1].map(|i| f64::from(u32::MAX) / (high[i] - low[i]));
    let code = |p: [f64; 2]| morton([0, 1].map(|i| ((p[i] - low[i]) * scale[i]) as u32));
    let inside = Inside::of(domain);
    let centroid = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| vertices[v as usize]);
        [(a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0]
    };
    let mut kept: Vec<(u64, [u32; 3])> = triangles
        .iter()
        .map(|triangle| (centroid(triangle), triangle))
        .filter(|(centre, _)| inside.contains(*centre))
        .map(|(centre, triangle)| (code(centre), *triangle))
        .collect();
    kept.sort_unstable();
    let mut used: Vec<(u64, u32)> =
        kept.iter().flat_map(|(_, t)| *t).map(|v| (code(vertices[v as usize]), v)).collect();
    used.sort_unstable();
    used.dedup();
    let mut number = vec![u32::MAX; vertices.len()];
    used.iter().zip(0..).for_each(|(&(_, vertex), new)| number[vertex as usize] = new);
    let cells = kept.iter().flat_map(|(_, t)| t.map(|v| number[v as usize])).collect();
    (used.iter().map(|&(_, vertex)| vertices[vertex as usize]).collect(), cells)
}

fn morton([x, y]: [u32; 2]) -> u64 {
    let spread = |x: u32| {
        let mut x = u64::from(x);
        for (shift, mask) in [
            (16, 0x0000_ffff_0000_ffff),
            (8, 0x00ff_00ff_00ff_00ff),
            (4, 0x0f0f_0f0f_0f0f_0f0f),
            (2, 0x3333_3333_3333_3333),
            (1, 0x5555_5555_5555_5555),
        ] {
            x = (x | (x << shift)) & mask;
        }
        x
    };
    spread(x) | (spread(y) << 1)
}

fn regions(mesh: &SimplexMesh<2>, outlines: &[Outline]) -> Result<Vec<Vec<u32>>, TriangulationError> {
    let centroids: Vec<[f64; 2]> = (0..mesh.cell_count())
        .map(|cell| {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.vertices()[mesh.cell(cell)[i] as usize]);
            [(a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0]
        })
        .collect();
    let mut regions = Vec::with_capacity(outlines.len());
    for (index, outline) in outlines.iter().enumerate() {
        let [low, high] = outline.bounding_box();
        let tree = SideTree::of_ring(&outline.points);
        let in_box = |p: [f64; 2]| (0..2).all(|i| low[i] <= p[i] && p[i] <= high[i]);
        let inside = |cell: &u32| in_box(centroids[*cell as usize]) && tree.enclose(centroids[*cell as usize]);
        let cells: Vec<u32> = (0..mesh.cell_count() as u32).filter(inside).collect();
        let area: f64 = cells.iter().map(|&cell| mesh.volume(mesh.vertices(), cell as usize)).sum();
        let wanted = signed_area(&outline.points).abs();
        if (area - wanted).abs() > 1e-9 * wanted {
            return Err(TriangulationError::NotFitted { outline: index, area, wanted });
        }
        regions.push(cells);
    }
    Ok(regions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::delaunay::Triangles;
    use crate::numerics::planar_domain::Ring;
    use crate::numerics::polygon::distance;

    fn paper_outlines() -> Vec<Outline> {
        let mut outlines = vec![Outline::disc([400.0, 540.0], 50.0, 15.0)];
        for centre in [[60.0, 60.0], [740.0, 60.0], [60.0, 540.0], [740.0, 540.0]] {
            outlines.push(Outline::disc(centre, 30.0, 15.0));
        }
        outlines
    }

    fn region_area(fitted: &FittedMesh, region: usize) -> f64 {
        fitted.regions[region].iter().map(|&c| fitted.mesh.volume(fitted.mesh.vertices(), c as usize)).sum()
    }

    fn total_area(fitted: &FittedMesh) -> f64 {
        (0..fitted.mesh.cell_count()).map(|c| fitted.mesh.volume(fitted.mesh.vertices(), c)).sum()
    }

    #[test]
    fn a_domain_that_gives_vertices_is_filled_by_these_alone() {
        // A domain that is not convex, meshed once; its vertices, those inside moved, then come back, also those of the border.
        let points = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.5, 1.2], [0.0, 2.0]];
        let domain = PlanarDomain::new(Ring { points, edges: vec![0; 5] }, Vec::new(), vec!["side".into()]);
        let first = triangulate(&domain, &[], &MeshOptions::of_size(0.2)).unwrap().mesh;
        let mut on_border = vec![false; first.vertex_count()];
        first.border().iter().for_each(|facet| first.facet_vertices(*facet).for_each(|v| on_border[v as usize] = true));
        let moved = |(i, (x, border)): (usize, (&[f64; 2], &bool))| {
            let by = if *border { 0.0 } else { 0.01 * (i as f64).sin() };
            [x[0] + by, x[1] - by]
        };
        let wanted: Vec<_> = first.vertices().iter().zip(&on_border).enumerate().map(moved).collect();
        let inside = wanted.iter().zip(&on_border).filter(|(_, border)| !**border).map(|(x, _)| *x);
        // Points outside, on the border and in the way of an outline do no harm.
        let vertices: Vec<_> = inside.chain([[9.0, 9.0], [1.0, 0.0], [1.5, 1.9]]).collect();
        let again = PlanarDomain { vertices, ..domain.clone() };
        let second = triangulate(&again, &[], &MeshOptions::of_size(0.2)).unwrap().mesh;
        let sorted = |vertices: &[[f64; 2]]| {
            let mut vertices = vertices.to_vec();
            vertices.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
            vertices
        };
        assert_eq!((sorted(&wanted), first.cell_count()), (sorted(second.vertices()), second.cell_count()));
        let disc = Outline::disc([0.8, 0.8], 0.3, 0.2);
        let fitted = triangulate(&again, std::slice::from_ref(&disc), &MeshOptions::of_size(0.2)).unwrap();
        let area = region_area(&fitted, 0);
        assert!((area - disc.area()).abs() < 1e-12 && fitted.min_angle > 0.4, "{area} {}", fitted.min_angle);
    }

    #[test]
    fn slanted_sides_are_meshed_with_as_few_vertices_as_straight_ones() {
        let corner = |x: f64, y: f64| [x, y];
        let hexagon = (0..6).map(|i| {
            let angle = std::f64::consts::PI * (f64::from(i) / 3.0 + 0.1);
            corner(100.0 + 90.0 * angle.cos(), 100.0 + 90.0 * angle.sin())
        });
        let mut polygons = vec![
            vec![corner(0.0, 0.0), corner(200.0, 0.0), corner(90.0, 140.0)],
            vec![corner(0.0, 0.0), corner(200.0, 0.0), corner(170.0, 150.0), corner(30.0, 150.0)],
            hexagon.collect(),
        ];
        for x in [170.0, 210.0, 230.0, 240.0, 250.0] {
            polygons.push(vec![corner(0.0, 0.0), corner(200.0, 0.0), corner(x, 150.0), corner(0.0, 150.0)]);
        }
        for points in polygons {
            for size in [5.0, 15.0, 30.0] {
                let edges = vec![0; points.len()];
                let ring = Ring { points: points.clone(), edges };
                let domain = PlanarDomain::new(ring, Vec::new(), vec!["border".into()]);
                let fitted = triangulate(&domain, &[], &MeshOptions::of_size(size)).unwrap();
                assert!((total_area(&fitted) / domain.area() - 1.0).abs() < 1e-12, "{points:?}");
                let expected = domain.area() / (size * size) * 1.155;
                let count = fitted.mesh.vertex_count() as f64;
                assert!(count < 3.0 * expected + 60.0, "{points:?} at {size}: {count} for {expected}");
                assert!(fitted.min_angle > 25f64.to_radians(), "{points:?}: {}", fitted.min_angle);
            }
        }
    }

    #[test]
    fn the_papers_scene_gets_a_fitted_mesh_without_small_angles() {
        let domain = PlanarDomain::rectangle(800.0, 600.0);
        let outlines = paper_outlines();
        let fitted = triangulate(&domain, &outlines, &MeshOptions::of_size(15.0)).unwrap();
        assert!(fitted.min_angle.to_degrees() >= 25.0, "{}", fitted.min_angle.to_degrees());
        assert!((2000..4000).contains(&fitted.mesh.vertex_count()), "{}", fitted.mesh.vertex_count());
        assert!((total_area(&fitted) / 480_000.0 - 1.0).abs() < 1e-13);
        for (region, outline) in outlines.iter().enumerate() {
            assert!((region_area(&fitted, region) / outline.area() - 1.0).abs() < 1e-12);
        }
        for facet in fitted.mesh.border() {
            let ends: Vec<_> = fitted.mesh.facet_vertices(*facet).map(|v| fitted.mesh.vertices()[v as usize]).collect();
            let on = |i: usize, x: f64| ends.iter().all(|p| p[i] == x);
            assert!([on(1, 0.0), on(0, 800.0), on(1, 600.0), on(0, 0.0)][facet.edge as usize]);
        }
    }

    #[test]
    fn overlapping_touching_and_tiny_outlines_keep_their_areas() {
        let domain = PlanarDomain::rectangle(200.0, 100.0);
        let outlines = [
            Outline::disc([60.0, 50.0], 30.0, 10.0),
            Outline::disc([90.0, 47.0], 30.0, 10.0),
            Outline::rectangle([120.0, 0.0], [150.0, 40.0]),
            Outline::rectangle([150.0, 20.0], [200.0, 60.0]),
            Outline::disc([20.0, 6.5], 5.0, 10.0),
            Outline::disc([180.0, 80.0], 2.0, 10.0),
        ];
        let fitted = triangulate(&domain, &outlines, &MeshOptions::of_size(10.0)).unwrap();
        for (region, outline) in outlines.iter().enumerate() {
            let error = region_area(&fitted, region) / outline.area() - 1.0;
            assert!(error.abs() < 1e-12, "region {region}: {error:e}");
            assert!(fitted.regions[region].is_sorted());
        }
        assert!(fitted.regions[0].iter().any(|cell| fitted.regions[1].contains(cell)));
        assert!(fitted.min_angle > 0.1, "{}", fitted.min_angle.to_degrees());
    }

    #[test]
    fn a_polygon_that_is_not_convex_keeps_its_hole_and_its_named_edges() {
        let outer = Ring {
            points: vec![[0.0, 0.0], [300.0, 0.0], [300.0, 200.0], [150.0, 80.0], [0.0, 200.0]],
            edges: vec![0, 1, 2, 2, 1],
        };
        let hole = Outline::disc([150.0, 40.0], 15.0, 10.0).points;
        let hole = Ring { edges: vec![3; hole.len()], points: hole };
        let names = ["bottom", "side", "notch", "vessel"].map(String::from).to_vec();
        let domain = PlanarDomain::new(outer, vec![hole], names);
        let source = [Outline::disc([60.0, 60.0], 20.0, 10.0)];
        let fitted = triangulate(&domain, &source, &MeshOptions::of_size(10.0)).unwrap();
        assert!((total_area(&fitted) / domain.area() - 1.0).abs() < 1e-12);
        assert!((region_area(&fitted, 0) / source[0].area() - 1.0).abs() < 1e-12);
        assert!(fitted.min_angle.to_degrees() >= 25.0, "{}", fitted.min_angle.to_degrees());
        let mut lengths = [0.0; 4];
        for facet in fitted.mesh.border() {
            let ends: Vec<_> = fitted.mesh.facet_vertices(*facet).map(|v| fitted.mesh.vertices()[v as usize]).collect();
            lengths[facet.edge as usize] += distance(ends[0], ends[1]);
        }
        let wanted = [300.0, 400.0, 2.0 * 150.0_f64.hypot(120.0)];
        for (edge, wanted) in wanted.iter().enumerate() {
            assert!((lengths[edge] / wanted - 1.0).abs() < 1e-12);
        }
        assert!(lengths[3] > 2.0 * 3.0 * 15.0);
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig {
            failure_persistence: None,
            ..proptest::prelude::ProptestConfig::with_cases(40)
        })]

        #[test]
        fn discs_anywhere_inside_are_fitted_however_they_overlap(
            discs in proptest::collection::vec((0.0..1.0f64, 0.0..1.0f64, 2.0..25.0f64), 1..5),
        ) {
            let place = |share: f64, radius: f64, extent: f64| 1.05 * radius + share * (extent - 2.1 * radius);
            let disc = |&(x, y, r): &(f64, f64, f64)| Outline::disc([place(x, r, 120.0), place(y, r, 80.0)], r, 6.0);
            let outlines: Vec<_> = discs.iter().map(disc).collect();
            let domain = PlanarDomain::rectangle(120.0, 80.0);
            let fitted = triangulate(&domain, &outlines, &MeshOptions::of_size(6.0)).unwrap();
            proptest::prop_assert!((total_area(&fitted) / 9600.0 - 1.0).abs() < 1e-12);
            for (region, outline) in outlines.iter().enumerate() {
                proptest::prop_assert!((region_area(&fitted, region) / outline.area() - 1.0).abs() < 1e-12);
            }
            let report = Triangles::of(&fitted.mesh).edge_report(fitted.mesh.vertices(), 1.0, 0.0);
            proptest::prop_assert!(report.monotone_lumped(), "{:?}", report);
        }
    }

    #[test]
    fn the_same_input_gives_the_same_bits() {
        let domain = PlanarDomain::rectangle(300.0, 200.0);
        let mesh = || triangulate(&domain, &[Outline::disc([150.0, 90.0], 40.0, 12.0)], &MeshOptions::of_size(12.0));
        let (one, two) = (mesh().unwrap(), mesh().unwrap());
        assert_eq!(one.mesh.vertices(), two.mesh.vertices());
        assert_eq!(one.mesh.cells(), two.mesh.cells());
        assert_eq!(one.regions, two.regions);
    }

    #[test]
    fn an_outline_outside_is_refused_by_index_and_point() {
        let domain = PlanarDomain::rectangle(100.0, 100.0);
        let good = Outline::disc([50.0, 50.0], 10.0, 5.0);
        let bad = Outline::rectangle([80.0, 10.0], [120.0, 30.0]);
        let refused = triangulate(&domain, &[good, bad], &MeshOptions::of_size(10.0)).unwrap_err();
        assert!(matches!(refused, TriangulationError::OutlineOutside { outline: 1, point } if point[0] > 100.0));
        let hole = Outline::disc([50.0, 50.0], 10.0, 5.0).points;
        let hole = Ring { edges: vec![0; hole.len()], points: hole };
        let pierced = PlanarDomain::new(domain.outer.clone(), vec![hole], domain.edge_names.clone());
        for cover in [Outline::disc([50.0, 50.0], 20.0, 5.0), Outline::rectangle([45.0, 45.0], [90.0, 55.0])] {
            let refused = triangulate(&pierced, &[cover], &MeshOptions::of_size(10.0)).unwrap_err();
            assert!(matches!(refused, TriangulationError::OutlineOutside { outline: 0, .. }));
        }
    }

    #[test]
    fn sides_that_nearly_touch_are_refused_where_they_do_before_they_ask_for_many_vertices() {
        let domain = PlanarDomain::rectangle(200.0, 150.0);
        let beside = |gap: f64| {
            [[40.0, 60.0], [60.0 + gap, 80.0]].map(|[from, to]| Outline::rectangle([from, 40.0], [to, 60.0]))
        };
        // Between sides at a distance g vertices are about as far apart: their number goes with 1/g.
        let meshed = |gap| triangulate(&domain, &beside(gap), &MeshOptions::of_size(15.0));
        let [apart, near, nearer] = [10.0, 0.02, 0.01].map(|gap| meshed(gap).unwrap().mesh.vertex_count() as f64);
        assert!(((nearer - apart) / (near - apart) - 2.0).abs() < 0.2, "{apart} {near} {nearer}");
        let refused = meshed(1e-5).unwrap_err();
        let TriangulationError::Narrow { outline: Some(0), point, distance, limit: 50_000.. } = refused else {
            panic!("{refused}")
        };
        assert!((distance - 1e-5).abs() < 1e-12 && point[0] == 60.0, "{point:?} {distance}");
        // The border has no index, and a size at which as many are wanted anyway is served.
        let slit = Ring { points: vec![[40.0, 1e-5], [60.0, 1e-5], [60.0, 9.0], [40.0, 9.0]], edges: vec![0; 4] };
        let slit = PlanarDomain::new(domain.outer.clone(), vec![slit], domain.edge_names.clone());
        let refused = triangulate(&slit, &[], &MeshOptions::of_size(15.0)).unwrap_err();
        assert!(matches!(refused, TriangulationError::Narrow { outline: None, .. }), "{refused}");
        assert!(triangulate(&domain, &beside(5e-4), &MeshOptions::of_size(1.0)).is_ok());
    }

    #[test]
    fn an_outline_that_touches_the_border_up_to_round_off_needs_no_more_vertices_than_one_that_does_exactly() {
        let domain = PlanarDomain::rectangle(100.0, 99.9);
        let count = |top: f64| {
            let outline = [Outline::rectangle([10.0, 40.0], [60.0, top])];
            let fitted = triangulate(&domain, &outline, &MeshOptions::of_size(10.0)).unwrap();
            assert!(
                (total_area(&fitted) / 9990.0 - 1.0).abs() < 1e-9 && fitted.min_angle > 25f64.to_radians(),
                "{top}"
            );
            fitted.mesh.vertex_count()
        };
        let exact = count(99.9);
        for top in [3.0 * 33.3, 99.9 - 1e-12, 99.9 - 1e-9, 99.9 + 1e-12] {
            assert!(count(top).abs_diff(exact) < 10, "{top}: {} for {exact}", count(top));
        }
    }

    #[test]
    fn a_border_may_have_folds_as_near_as_one_likes_since_nothing_is_kept_between() {
        let fold = vec![
            [0.0, 0.0],
            [300.0, 0.0],
            [300.0, 200.0],
            [150.001, 200.0],
            [150.0, 20.0],
            [149.999, 200.0],
            [0.0, 200.0],
        ];
        let edges = vec![0; fold.len()];
        let domain = PlanarDomain::new(Ring { points: fold, edges }, Vec::new(), vec!["border".into()]);
        let fitted = triangulate(&domain, &[], &MeshOptions::of_size(15.0)).unwrap();
        assert!((total_area(&fitted) / domain.area() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn outlines_that_cross_in_too_many_places_are_refused_before_all_are_found() {
        let domain = PlanarDomain::rectangle(400.0, 400.0);
        let bars = |i: u32| {
            let at = 10.0 + f64::from(i);
            let upright = Outline::rectangle([at, 5.0], [at + 0.5, 395.0]);
            [upright, Outline::rectangle([5.0, at], [395.0, at + 0.5])]
        };
        let outlines: Vec<Outline> = (0..200).flat_map(bars).collect();
        let refused = triangulate(&domain, &outlines, &MeshOptions::of_size(20.0)).unwrap_err();
        assert!(matches!(refused, TriangulationError::Crossings { limit: 20_000.. }), "{refused}");
    }

    #[test]
    fn a_mesh_that_would_be_too_large_or_senseless_is_refused() {
        let domain = PlanarDomain::rectangle(100.0, 100.0);
        let options = MeshOptions { max_vertices: 1000, ..MeshOptions::of_size(1.0) };
        let refused = triangulate(&domain, &[], &options).unwrap_err();
        assert_eq!(refused, TriangulationError::TooManyVertices { limit: 1000, size: 1.0 });
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                triangulate(&domain, &[], &MeshOptions::of_size(size)),
                Err(TriangulationError::Option { option: "size", .. })
            ));
        }
    }
}
