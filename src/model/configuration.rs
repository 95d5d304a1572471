//! The configuration that the tissue is in now.
//!
//! A tissue that follows a path has its vertices at hand, all of them brought to the present at each stage. Where they are many and growth
//! cones few, nothing is brought: a vertex that is asked for is reckoned from the path, to the same bits.

use super::components::Site;
use super::tissue::lift;
use crate::numerics::coordinates::AtVertices;
use crate::numerics::hermite::{HermitePath, HermiteWeights};
use crate::numerics::locate::MaterialPoint;
use crate::numerics::simplex_mesh::SimplexMesh;
use bevy_ecs::prelude::Resource;
use nalgebra::{Matrix2, Vector2, Vector3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// Cells that are looked at together for one that is turned over.
const CELLS_AT_A_TIME: u32 = 4096;
/// Room for round-off about where a vertex may be on a path, over its largest coordinate.
const ROUND_OFF: f64 = 1e-12;
/// Vertices that are moved together.
const VERTICES_AT_A_TIME: usize = 4096;
/// Vertices that are asked for about a growth cone at a stage, by what moves and steers it by itself. Ours.
const ABOUT_A_CONE: usize = 16;

/// The configuration φ(·, t): where the vertices are now, and how fast they move.
#[derive(Debug, Clone, Resource)]
pub struct Configuration {
    /// Time of this configuration (h).
    pub time: f64,
    /// Whether the tissue moves at all in this run.
    pub moves: bool,
    /// Load s that this configuration belongs to (0 at rest), the parameter of the path of equilibria.
    pub load: f64,
    /// Rate ṡ of the load (1/h).
    pub load_rate: f64,
    /// Counts the changes of configuration; 0 for the reference.
    pub revision: u64,
    coordinates: Vec<[f64; 2]>,
    velocities: Vec<[f64; 2]>,
    /// Where all vertices are on a path, if they are not at hand.
    on_path: Option<OnPath>,
    /// Bound of ‖F⁻¹‖₂ in the part of the path that this belongs to, where one is known.
    most_pressed: Option<f64>,
    /// Growth cones, and vertices that are asked for about each at a stage; as many as there are where all is looked at.
    cones: usize,
    about_each: usize,
}

/// A place on a path of displacements, and the rate at which the tissue goes along it.
#[derive(Debug, Clone)]
struct OnPath {
    mesh: Arc<SimplexMesh<2>>,
    path: Arc<HermitePath>,
    place: HermiteWeights,
    rate: f64,
}

impl OnPath {
    /// Coordinates (µm) and velocity (µm/h) of a vertex.
    #[inline]
    fn vertex(&self, vertex: usize) -> [[f64; 2]; 2] {
        let (mut x, mut v) = (self.mesh.vertices()[vertex], [0.0; 2]);
        for k in 0..2 {
            let (displacement, slope) = self.path.component(&self.place, 2 * vertex + k);
            x[k] += displacement;
            v[k] = slope * self.rate;
        }
        [x, v]
    }

    /// Coordinates alone.
    #[inline]
    fn coordinates(&self, vertex: usize) -> [f64; 2] {
        let rest = self.mesh.vertices()[vertex];
        let displaced = |k: usize| rest[k] + self.path.value(&self.place, 2 * vertex + k);
        [displaced(0), displaced(1)]
    }

    /// The smallest and the largest coordinates that a vertex has in this part of the path: those of its control points, with room for
    /// round-off.
    fn range(&self, vertex: usize) -> [[f64; 2]; 2] {
        let rest = self.mesh.vertices()[vertex];
        let mut range = [rest; 2];
        for k in 0..2 {
            let control = self.path.bernstein(self.place.part(), 2 * vertex + k).map(|u| rest[k] + u);
            let room = ROUND_OFF * control.iter().fold(rest[k].abs(), |most, x| most.max(x.abs()));
            range[0][k] = control.iter().copied().fold(f64::INFINITY, f64::min) - room;
            range[1][k] = control.iter().copied().fold(f64::NEG_INFINITY, f64::max) + room;
        }
        range
    }

    /// Writes where all vertices are, and their velocities.
    fn bring(&self, coordinates: &mut [[f64; 2]], velocities: &mut [[f64; 2]]) {
        let vertices = (coordinates, velocities).into_par_iter().with_min_len(VERTICES_AT_A_TIME).enumerate();
        vertices.for_each(|(vertex, (x, v))| [*x, *v] = self.vertex(vertex));
    }
}

/// Coordinates (µm) of all vertices at a parameter of a path of displacements, and their derivatives (µm) with respect to it, times a rate.
pub fn along_path(
    mesh: &Arc<SimplexMesh<2>>,
    path: &Arc<HermitePath>,
    (parameter, rate): (f64, f64),
) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let on_path = OnPath { mesh: Arc::clone(mesh), path: Arc::clone(path), place: path.locate(parameter), rate };
    let (mut coordinates, mut velocities) = (vec![[0.0; 2]; mesh.vertex_count()], vec![[0.0; 2]; mesh.vertex_count()]);
    on_path.bring(&mut coordinates, &mut velocities);
    (coordinates, velocities)
}

/// The velocities of a configuration.
struct Velocities<'a>(&'a Configuration);

impl AtVertices<2> for Configuration {
    #[inline]
    fn at(&self, vertex: usize) -> [f64; 2] {
        match &self.on_path {
            None => self.coordinates[vertex],
            Some(on_path) => on_path.coordinates(vertex),
        }
    }
}

impl AtVertices<2> for Velocities<'_> {
    #[inline]
    fn at(&self, vertex: usize) -> [f64; 2] {
        match &self.0.on_path {
            None => self.0.velocities[vertex],
            Some(on_path) => on_path.vertex(vertex)[1],
        }
    }
}

impl Configuration {
    /// The reference configuration, at rest.
    pub fn at_rest(mesh: &SimplexMesh<2>) -> Self {
        Self::of_vertices(mesh.vertices().to_vec())
    }

    /// Vertices that rest at their coordinates (µm).
    pub fn of_vertices(coordinates: Vec<[f64; 2]>) -> Self {
        Self {
            time: 0.0,
            moves: false,
            load: 0.0,
            load_rate: 0.0,
            revision: 0,
            velocities: vec![[0.0; 2]; coordinates.len()],
            coordinates,
            on_path: None,
            most_pressed: None,
            cones: 1,
            about_each: usize::MAX,
        }
    }

    /// Says that what is asked for at a stage lies about so many growth cones, until somebody [looks at more](Self::looks_at_more).
    pub fn is_looked_at_about_cones(&mut self, count: usize) {
        (self.cones, self.about_each) = (count, ABOUT_A_CONE);
    }

    /// Says that so many more vertices are asked for about each growth cone.
    pub fn looks_at_more(&mut self, vertices: usize) {
        self.about_each = self.about_each.saturating_add(vertices);
    }

    /// Says that all of the tissue is looked at in each stage.
    pub fn is_looked_at_everywhere(&mut self) {
        (self.cones, self.about_each) = (1, usize::MAX);
    }

    /// Whether vertices are so many that those which are asked for are better reckoned one by one.
    pub fn is_looked_at_here_and_there(&self) -> bool {
        self.cones.saturating_mul(self.about_each) < self.coordinates.len()
    }

    /// Moves all vertices to a parameter of a path of displacements (µm, flat), along which the tissue goes at a rate (1/h). In each part of the
    /// path ‖F⁻¹‖₂ is at most the given one, if any are known.
    pub fn follow(
        &mut self,
        mesh: &Arc<SimplexMesh<2>>,
        (path, inverse_stretches): (&Arc<HermitePath>, Option<&[f64]>),
        (load, rate): (f64, f64),
    ) {
        let on_path = OnPath { mesh: Arc::clone(mesh), path: Arc::clone(path), place: path.locate(load), rate };
        self.most_pressed = inverse_stretches.and_then(|bounds| bounds.get(on_path.place.part()).copied());
        self.on_path = if self.is_looked_at_here_and_there() {
            Some(on_path)
        } else {
            on_path.bring(&mut self.coordinates, &mut self.velocities);
            None
        };
        (self.load, self.load_rate) = (load, rate);
        self.revision += 1;
    }

    /// Coordinates of a vertex (µm).
    #[inline]
    pub fn vertex(&self, vertex: usize) -> [f64; 2] {
        self.at(vertex)
    }

    /// The part of a path that this belongs to, where vertices are reckoned from it.
    pub fn part(&self) -> Option<usize> {
        self.on_path.as_ref().map(|on_path| on_path.place.part())
    }

    /// The box (µm) that a vertex does not leave as long as the [part](Self::part) is the same: of its coordinates alone where there is none.
    pub fn range(&self, vertex: usize) -> [[f64; 2]; 2] {
        let Some(on_path) = &self.on_path else { return [self.at(vertex); 2] };
        on_path.range(vertex)
    }

    /// Coordinates of all vertices (µm).
    pub fn coordinates(&self) -> Cow<'_, [[f64; 2]]> {
        match &self.on_path {
            None => Cow::Borrowed(&self.coordinates),
            Some(_) => Cow::Owned((0..self.coordinates.len()).map(|vertex| self.at(vertex)).collect()),
        }
    }

    /// Velocities v_φ of all vertices (µm/h); all zero at rest.
    pub fn velocities(&self) -> Cow<'_, [[f64; 2]]> {
        match &self.on_path {
            None => Cow::Borrowed(&self.velocities),
            Some(_) => Cow::Owned((0..self.velocities.len()).map(|vertex| Velocities(self).at(vertex)).collect()),
        }
    }

    /// Puts all vertices at hand, and a vertex elsewhere (µm).
    pub fn displace(&mut self, vertex: usize, to: [f64; 2]) {
        if let Some(on_path) = self.on_path.take() {
            on_path.bring(&mut self.coordinates, &mut self.velocities);
        }
        self.coordinates[vertex] = to;
        self.most_pressed = None;
    }

    /// Position of a material point (µm).
    #[inline]
    pub fn place(&self, mesh: &SimplexMesh<2>, point: MaterialPoint<2>) -> [f64; 2] {
        point.position(mesh, self)
    }

    /// Spatial position of a site (µm).
    #[inline]
    pub fn position(&self, mesh: &SimplexMesh<2>, site: Site) -> Vector3<f64> {
        let [a, b, c] = at_corners(mesh, self, site.cell);
        let [second, third] = site.weights;
        let at = |k: usize| (1.0 - second - third) * a[k] + second * b[k] + third * c[k];
        Vector3::new(at(0), at(1), 0.0)
    }

    /// Velocity v_φ of the tissue at a site (µm/h).
    #[inline]
    pub fn velocity(&self, mesh: &SimplexMesh<2>, site: Site) -> Vector3<f64> {
        lift(site.planar().position(mesh, &Velocities(self)))
    }

    /// Deformation gradient F of a cell.
    pub fn deformation_gradient(&self, mesh: &SimplexMesh<2>, cell: u32) -> Matrix2<f64> {
        gradient_of(mesh, self, cell)
    }

    /// What is wrong with the configuration, if anything: a vertex that is nowhere, or a cell that is flat or turned over.
    pub fn defect(&self, mesh: &SimplexMesh<2>) -> Option<String> {
        let area = |cell: u32| {
            let [a, b, c] = at_corners(mesh, self, cell);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let is_upright = |cell: u32| area(cell) > 0.0;
        // Most often all are: so many at a time without asking between them.
        let count = mesh.cell_count() as u32;
        let cells = |first: u32| first..count.min(first + CELLS_AT_A_TIME);
        let pieces = (0..count.div_ceil(CELLS_AT_A_TIME)).into_par_iter().map(|piece| piece * CELLS_AT_A_TIME);
        let piece = pieces.find_first(|first| !cells(*first).fold(true, |all, cell| all & is_upright(cell)))?;
        let cell = cells(piece).find(|cell| !is_upright(*cell))?;
        let mut places = (0..mesh.vertex_count()).map(|vertex| (vertex, self.at(vertex)));
        if let Some((vertex, [x, y])) = places.find(|(_, x)| !(x[0].is_finite() && x[1].is_finite())) {
            return Some(format!("the tissue's mesh is no longer valid: vertex {vertex} is at ({x:.3}, {y:.3}) um"));
        }
        let middle = |k: usize| at_corners(mesh, self, cell).iter().map(|x| x[k]).sum::<f64>() / 3.0;
        let det = self.deformation_gradient(mesh, cell).determinant();
        let (x, y) = (middle(0), middle(1));
        Some(format!("the tissue is turned over: cell {cell} at ({x:.3}, {y:.3}) um, det F = {det:.4}"))
    }

    /// Spin (rad/h, about z) of the tissue in a cell: the rate at which the rotation of F = R U turns, which is the
    /// skew part of Ḟ F⁻¹ corrected for the turning of the principal axes.
    pub fn rotation_rate(&self, mesh: &SimplexMesh<2>, cell: u32) -> f64 {
        let f = self.deformation_gradient(mesh, cell);
        let rate = gradient_of(mesh, &Velocities(self), cell);
        let (a, b) = (f[(0, 0)] + f[(1, 1)], f[(1, 0)] - f[(0, 1)]);
        let (da, db) = (rate[(0, 0)] + rate[(1, 1)], rate[(1, 0)] - rate[(0, 1)]);
        (a * db - b * da) / (a * a + b * b)
    }

    /// Material velocity: the reference vector F⁻¹ v that belongs to a spatial vector v in a cell.
    pub fn pull_back(&self, mesh: &SimplexMesh<2>, cell: u32, spatial: Vector3<f64>) -> Vector3<f64> {
        if !self.moves {
            return spatial;
        }
        let f = self.deformation_gradient(mesh, cell);
        match f.try_inverse() {
            Some(inverse) => {
                let v = inverse * Vector2::new(spatial.x, spatial.y);
                Vector3::new(v.x, v.y, 0.0)
            }
            None => Vector3::repeat(f64::NAN),
        }
    }

    /// The spatial gradient F⁻ᵀ g of what has the reference gradient g in a cell.
    pub fn push_forward_gradient(&self, mesh: &SimplexMesh<2>, cell: u32, material: Vector3<f64>) -> Vector3<f64> {
        if !self.moves {
            return material;
        }
        match self.deformation_gradient(mesh, cell).try_inverse() {
            Some(inverse) => {
                let g = inverse.transpose() * Vector2::new(material.x, material.y);
                Vector3::new(g.x, g.y, 0.0)
            }
            None => Vector3::repeat(f64::NAN),
        }
    }

    /// The spatial vector F v that belongs to a reference vector v in a cell.
    pub fn push_forward(&self, mesh: &SimplexMesh<2>, cell: u32, material: Vector3<f64>) -> Vector3<f64> {
        if !self.moves {
            return material;
        }
        let v = self.deformation_gradient(mesh, cell) * Vector2::new(material.x, material.y);
        Vector3::new(v.x, v.y, 0.0)
    }

    /// Upper bound of ‖F⁻¹‖₂ over the tissue: a spatial distance r is at most `r · inverse_stretch()` in the reference. Where it is known for a
    /// part of a path it is that.
    pub fn inverse_stretch(&self, mesh: &SimplexMesh<2>) -> f64 {
        if !self.moves {
            return 1.0;
        }
        if let Some(bound) = self.most_pressed {
            return bound;
        }
        let square_in_cell = |cell: u32| {
            let f = self.deformation_gradient(mesh, cell);
            let (half, det) = (0.5 * f.norm_squared(), f.determinant());
            (half + (half * half - det * det).max(0.0).sqrt()) / (det * det)
        };
        let cells = (0..mesh.cell_count() as u32).into_par_iter().with_min_len(1024);
        cells.map(square_in_cell).reduce(|| 0.0, f64::max).sqrt() * (1.0 + 1e-12)
    }
}

/// What the three vertices of a cell have.
#[inline]
fn at_corners(mesh: &SimplexMesh<2>, values: &(impl AtVertices<2> + ?Sized), cell: u32) -> [[f64; 2]; 3] {
    let corners = mesh.cell(cell as usize);
    [values.at(corners[0] as usize), values.at(corners[1] as usize), values.at(corners[2] as usize)]
}

fn gradient_of(mesh: &SimplexMesh<2>, field: &(impl AtVertices<2> + ?Sized), cell: u32) -> Matrix2<f64> {
    let columns = |[a, b, c]: [[f64; 2]; 3]| Matrix2::new(b[0] - a[0], c[0] - a[0], b[1] - a[1], c[1] - a[1]);
    let reference = columns(at_corners(mesh, mesh.vertices(), cell));
    let det = reference.determinant();
    let adjugate = Matrix2::new(reference[(1, 1)], -reference[(0, 1)], -reference[(1, 0)], reference[(0, 0)]);
    columns(at_corners(mesh, field, cell)) * adjugate * (1.0 / det)
}
