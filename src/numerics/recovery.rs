//! A continuous gradient recovered at the vertices from nodal values (polynomial-preserving recovery).
//!
//! The gradient of a P1 field is constant in a cell and jumps at faces; a path integrated through it loses its order. Around
//! each vertex a quadratic is fitted by least squares to the nodal values of its neighbours, and its gradient at the vertex is
//! taken (Zhang and Naga, SIAM J. Sci. Comput. 26, 2005, doi:10.1137/S1064827503402837): of second order, exact for quadratics on any mesh. It is linear in the values,
//!
//! ```text
//! G_i = Σ_j w_ij (c_j − c_i),
//! ```
//!
//! so the weights of one configuration serve all fields and their rates ([`GradientOperator`]).
//!
//! Where no flux passes the border the normal slope is not fitted but known: at a straight border all odd powers of the normal
//! coordinate are left out, at a curved one the linear power is, in a convex corner the gradient has no component along any of
//! the normals. Re-entrant corners, where the gradient is singular, are left alone.

use crate::numerics::simplex_mesh::SimplexMesh;
use crate::numerics::vector::{between, dot, norm, orthonormal, without};

/// Most terms of a quadratic (in space).
const TERMS: usize = 10;

/// Facets whose normals are closer than this (cosine; 35°) belong to one smooth border.
const SMOOTH: f64 = 0.82;

/// Facets whose normals are closer than this (cosine; 2.6°) belong to one straight border.
const STRAIGHT: f64 = 0.999;

/// A pivot below this share of its diagonal entry means that the patch does not determine the quadratic.
const WEAK_PIVOT: f64 = 1e-7;

/// Patches around the vertices of a mesh: topology only, built once.
#[derive(Debug, Clone)]
pub struct GradientRecovery<const D: usize> {
    neighbour_starts: Vec<u32>,
    neighbours: Vec<u32>,
    facet_starts: Vec<u32>,
    /// Vertices of the border facets at each vertex.
    facets: Vec<[u32; D]>,
    /// The vertex opposite each of these facets in its cell, which tells inside from outside.
    opposite: Vec<u32>,
}

/// The weights of the recovered gradient in one configuration.
#[derive(Debug, Clone)]
pub struct GradientOperator<const D: usize> {
    starts: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<[f64; D]>,
}

impl<const D: usize> GradientOperator<D> {
    /// Recovered gradient at every vertex (unit of the values per µm) of nodal `values`, one entry a vertex.
    pub fn apply(&self, values: &[f64]) -> Vec<[f64; D]> {
        let gradient = |vertex: usize| {
            let mut sum = [0.0; D];
            for place in self.starts[vertex] as usize..self.starts[vertex + 1] as usize {
                let difference = values[self.columns[place] as usize] - values[vertex];
                (0..D).for_each(|k| sum[k] += self.weights[place][k] * difference);
            }
            sum
        };
        (0..self.starts.len() - 1).map(gradient).collect()
    }
}

/// What is known of the gradient at a vertex.
enum Constraint<const D: usize> {
    Free,
    /// No component along the normal; the border is straight or curved there.
    Normal([f64; D], bool),
    /// No component in the span of these orthonormal vectors.
    Span(Vec<[f64; D]>),
}

/// Which powers of the local coordinates are fitted. Coordinate 0 is the normal one.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Basis {
    Quadratic,
    /// No odd power of the normal coordinate.
    Even,
    /// No linear power of the normal coordinate.
    NoNormalSlope,
    Linear,
}

/// A term as a product of two of the coordinates `y_0 … y_{D−1}, 1`.
type Term = [usize; 2];

impl Basis {
    fn terms(self, dimension: usize) -> Vec<Term> {
        let one = dimension;
        let fits = |&[a, b]: &Term| match self {
            Self::Quadratic => true,
            Self::Even => (a == 0) == (b == 0),
            Self::NoNormalSlope => !(a == 0 && b == one),
            Self::Linear => b == one,
        };
        (0..=one).flat_map(|a| (a..=one).map(move |b| [a, b])).filter(fits).collect()
    }
}

impl<const D: usize> GradientRecovery<D> {
    /// Gathers the patches of a mesh.
    pub fn new(mesh: &SimplexMesh<D>) -> Self {
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(mesh.cells().len() * D);
        for cell in 0..mesh.cell_count() {
            let corners = mesh.cell(cell);
            for &a in corners {
                pairs.extend(corners.iter().filter(|&&b| b != a).map(|&b| (a, b)));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut corners: Vec<(u32, [u32; D], u32)> = Vec::new();
        for &facet in mesh.border() {
            let mut vertices = [0; D];
            mesh.facet_vertices(facet).zip(&mut vertices).for_each(|(vertex, place)| *place = vertex);
            let opposite = mesh.cell(facet.cell as usize)[facet.face as usize];
            corners.extend(vertices.iter().map(|&vertex| (vertex, vertices, opposite)));
        }
        corners.sort_unstable();
        Self {
            neighbour_starts: starts(mesh.vertex_count(), pairs.iter().map(|pair| pair.0)),
            neighbours: pairs.into_iter().map(|pair| pair.1).collect(),
            facet_starts: starts(mesh.vertex_count(), corners.iter().map(|corner| corner.0)),
            facets: corners.iter().map(|corner| corner.1).collect(),
            opposite: corners.iter().map(|corner| corner.2).collect(),
        }
    }

    /// Recovered gradient at every vertex (unit of the values per µm): [`Self::operator`] applied once.
    pub fn recover(&self, coordinates: &[[f64; D]], values: &[f64], no_flux: bool) -> Vec<[f64; D]> {
        self.operator(coordinates, no_flux).apply(values)
    }

    /// The recovery's weights in the configuration `coordinates` (one entry a vertex, µm); `no_flux` uses that the field has no
    /// normal slope at the border.
    pub fn operator(&self, coordinates: &[[f64; D]], no_flux: bool) -> GradientOperator<D> {
        let mut fit = Fit::new(coordinates);
        let mut operator = GradientOperator { starts: vec![0], columns: Vec::new(), weights: Vec::new() };
        operator.columns.reserve(self.neighbours.len());
        operator.weights.reserve(self.neighbours.len());
        let mut patch = Vec::new();
        for vertex in 0..self.neighbour_starts.len() - 1 {
            let constraint = if no_flux { self.constraint(coordinates, vertex) } else { Constraint::Free };
            let basis = match constraint {
                Constraint::Normal(_, true) => Basis::Even,
                Constraint::Normal(_, false) => Basis::NoNormalSlope,
                _ => Basis::Quadratic,
            };
            let normal = if let Constraint::Normal(normal, _) = &constraint { Some(*normal) } else { None };
            fit.place(vertex, normal);
            patch.clear();
            patch.extend_from_slice(self.ring(vertex));
            let fitted = fit.solve(&patch, basis) || {
                self.enlarge(vertex, &mut patch);
                fit.solve(&patch, basis) || fit.solve(&patch, Basis::Linear)
            };
            if fitted {
                let span: &[[f64; D]] = if let Constraint::Span(span) = &constraint { span } else { &[] };
                operator.columns.extend_from_slice(&patch);
                operator.weights.extend(fit.weights.iter().map(|weight| without(*weight, span)));
            }
            operator.starts.push(operator.columns.len() as u32);
        }
        operator
    }

    fn ring(&self, vertex: usize) -> &[u32] {
        &self.neighbours[self.neighbour_starts[vertex] as usize..self.neighbour_starts[vertex + 1] as usize]
    }

    /// Adds the neighbours of the patch's vertices.
    fn enlarge(&self, vertex: usize, patch: &mut Vec<u32>) {
        for place in 0..patch.len() {
            patch.extend_from_slice(self.ring(patch[place] as usize));
        }
        patch.sort_unstable();
        patch.dedup();
        patch.retain(|&other| other as usize != vertex);
    }

    fn constraint(&self, coordinates: &[[f64; D]], vertex: usize) -> Constraint<D> {
        let range = self.facet_starts[vertex] as usize..self.facet_starts[vertex + 1] as usize;
        let normals: Vec<[f64; D]> =
            range.clone().map(|facet| outward(coordinates, &self.facets[facet], self.opposite[facet])).collect();
        let mut groups: Vec<[f64; D]> = Vec::new();
        for normal in &normals {
            match groups.iter_mut().find(|group| dot(group, normal) > SMOOTH * norm(group) * norm(normal)) {
                Some(group) => (0..D).for_each(|k| group[k] += normal[k]),
                None => groups.push(*normal),
            }
        }
        match groups.as_slice() {
            [] => Constraint::Free,
            [one] => {
                let unit = one.map(|x| x / norm(one));
                let straight = normals.iter().all(|normal| dot(normal, &unit) > STRAIGHT * norm(normal));
                Constraint::Normal(unit, straight)
            }
            several => {
                let at = coordinates[vertex];
                let convex = range.flat_map(|facet| self.facets[facet]).all(|other| {
                    let away = between(&at, &coordinates[other as usize]);
                    several.iter().all(|normal| dot(&away, normal) <= 0.1 * norm(&away) * norm(normal))
                });
                if convex { Constraint::Span(orthonormal(several)) } else { Constraint::Free }
            }
        }
    }
}

/// The least-squares problem of one vertex, in coordinates scaled by the patch and turned to the normal.
struct Fit<'a, const D: usize> {
    coordinates: &'a [[f64; D]],
    terms: [(Basis, Vec<Term>); 4],
    vertex: usize,
    frame: [[f64; D]; D],
    rows: Vec<[f64; TERMS]>,
    weights: Vec<[f64; D]>,
}

impl<'a, const D: usize> Fit<'a, D> {
    fn new(coordinates: &'a [[f64; D]]) -> Self {
        let all = [Basis::Quadratic, Basis::Even, Basis::NoNormalSlope, Basis::Linear];
        let terms = all.map(|basis| (basis, basis.terms(D)));
        Self { coordinates, terms, vertex: 0, frame: [[0.0; D]; D], rows: Vec::new(), weights: Vec::new() }
    }

    fn place(&mut self, vertex: usize, normal: Option<[f64; D]>) {
        self.vertex = vertex;
        let axis = |k: usize| std::array::from_fn(|l| f64::from(u8::from(k == l)));
        self.frame = std::array::from_fn(axis);
        if let Some(normal) = normal {
            let mut candidates = vec![normal];
            let mut axes: Vec<[f64; D]> = (0..D).map(axis).collect();
            axes.sort_by(|a, b| dot(a, &normal).abs().total_cmp(&dot(b, &normal).abs()));
            candidates.extend(axes);
            let turned = orthonormal(&candidates);
            self.frame.iter_mut().zip(turned).for_each(|(place, vector)| *place = vector);
        }
    }

    /// Solves for the weights of the patch, `false` if it does not determine the polynomial.
    fn solve(&mut self, patch: &[u32], basis: Basis) -> bool {
        let Some(index) = self.terms.iter().position(|(known, _)| *known == basis) else { return false };
        let terms = &self.terms[index].1;
        let count = terms.len();
        if patch.len() + 1 < count {
            return false;
        }
        let origin = self.coordinates[self.vertex];
        let away =
            |other: u32| -> [f64; D] { std::array::from_fn(|k| self.coordinates[other as usize][k] - origin[k]) };
        let radius = patch.iter().map(|&other| norm(&away(other))).fold(0.0, f64::max);
        self.rows.clear();
        let mut normal = [[0.0; TERMS]; TERMS];
        normal[count - 1][count - 1] = 1.0;
        for &other in patch {
            let away = away(other);
            let mut local = [1.0; 4];
            (0..D).for_each(|k| local[k] = dot(&away, &self.frame[k]) / radius);
            local[D] = 1.0;
            let mut row = [0.0; TERMS];
            terms.iter().zip(&mut row).for_each(|([a, b], value)| *value = local[*a] * local[*b]);
            for i in 0..count {
                (0..=i).for_each(|j| normal[i][j] += row[i] * row[j]);
            }
            self.rows.push(row);
        }
        if !factor(&mut normal, count) {
            return false;
        }
        self.weights.clear();
        self.weights.resize(patch.len(), [0.0; D]);
        for axis in 0..D {
            let Some(slope) = terms.iter().position(|term| *term == [axis, D]) else { continue };
            let mut unit = [0.0; TERMS];
            unit[slope] = 1.0 / radius;
            substitute(&normal, count, &mut unit);
            for (row, weight) in self.rows.iter().zip(&mut self.weights) {
                let share: f64 = (0..count).map(|i| row[i] * unit[i]).sum();
                (0..D).for_each(|k| weight[k] += share * self.frame[axis][k]);
            }
        }
        true
    }
}

/// Cholesky factor in place, `false` at a weak pivot.
fn factor(matrix: &mut [[f64; TERMS]; TERMS], count: usize) -> bool {
    for i in 0..count {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let rest = matrix[i][j] - known;
            if i != j {
                matrix[i][j] = rest / matrix[j][j];
            } else if rest > WEAK_PIVOT * matrix[i][i] {
                matrix[i][i] = rest.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

fn substitute(factor: &[[f64; TERMS]; TERMS], count: usize, b: &mut [f64; TERMS]) {
    for i in 0..count {
        let known: f64 = (0..i).map(|k| factor[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / factor[i][i];
    }
    for i in (0..count).rev() {
        let known: f64 = (i + 1..count).map(|k| factor[k][i] * b[k]).sum();
        b[i] = (b[i] - known) / factor[i][i];
    }
}

fn starts(count: usize, sorted: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut starts = vec![0; count + 1];
    sorted.for_each(|vertex| starts[vertex as usize + 1] += 1);
    (0..count).for_each(|i| starts[i + 1] += starts[i]);
    starts
}

/// Normal of a facet, away from the vertex `opposite`, as long as the facet is large (up to a constant).
fn outward<const D: usize>(coordinates: &[[f64; D]], facet: &[u32; D], opposite: u32) -> [f64; D] {
    let origin = coordinates[facet[0] as usize];
    let to = |vertex: u32| between(&origin, &coordinates[vertex as usize]);
    let along: Vec<[f64; D]> = facet[1..].iter().map(|&vertex| to(vertex)).collect();
    let size: f64 = along.iter().map(norm).product();
    let inward = without(to(opposite), &orthonormal(&along));
    let scale = -size / norm(&inward).max(f64::MIN_POSITIVE);
    inward.map(|x| x * scale)
}
