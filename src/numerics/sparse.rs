//! Sparse symmetric systems: a pattern that comes from the mesh, values assembled into it, and direct factors whose
//! symbolic part is kept.
//!
//! A pattern never comes from values, so that exact zeros of one configuration do not drop entries of the next.
//! Only the lower triangle is stored, by columns. The factorisations are faer's, run on one thread.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::{LdltError, LdltRegularization};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    LdltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
    supernodal::SupernodalLdltRef,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::numerics::dissection::{inverse, postordered};

/// An unknown that is prescribed: it has no row in the system.
pub const PRESCRIBED: u32 = u32::MAX;

/// Why a factorisation failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SparseError {
    /// The matrix is not positive definite (Cholesky).
    #[error("the matrix is not positive definite (pivot {pivot})")]
    NotPositiveDefinite {
        /// Number of the pivot, in elimination order.
        pivot: usize,
    },
    /// The matrix is singular (LDLT).
    #[error("the matrix is singular (pivot {pivot} is zero)")]
    Singular {
        /// Number of the pivot, in elimination order.
        pivot: usize,
    },
    /// The library gave up: out of memory, or more than 2³² entries.
    #[error("the sparse factorisation could not be set up: {0}")]
    Setup(String),
}

/// Sparsity pattern of a symmetric matrix, with the place of each element's entries and the symbolic factor.
#[derive(Debug)]
pub struct SymmetricPattern {
    unknowns: usize,
    column_start: Vec<u32>,
    rows: Vec<u32>,
    /// For each element and each pair of its local unknowns with `i ≥ j`, the place of the value; `u32::MAX` if prescribed.
    slots: Vec<u32>,
    local: usize,
    symbolic: SymbolicCholesky<u32>,
}

impl SymmetricPattern {
    /// Builds the pattern of a matrix from the unknowns of its elements, flat with stride `local`; an entry [`PRESCRIBED`] has no row.
    /// `order[p]` is the row eliminated as the `p`-th, best by [`crate::numerics::dissection::nested_dissection`]; it has one
    /// entry a row. The symbolic factorisation is done here, once.
    ///
    /// # Errors
    /// [`SparseError::Setup`] when memory or the index type do not suffice.
    pub fn in_order(order: &[u32], elements: &[u32], local: usize) -> Result<Arc<Self>, SparseError> {
        let unknowns = order.len();
        let (column_start, rows) = lower_triangle(unknowns, (elements, local));
        let mut slots = Vec::with_capacity(elements.len() * (local + 1) / 2);
        for element in elements.chunks_exact(local) {
            for i in 0..local {
                for j in 0..=i {
                    slots.push(find_slot(&column_start, &rows, element[i], element[j]));
                }
            }
        }
        let structure = SymbolicSparseColMatRef::new_checked(unknowns, unknowns, &column_start, None, &rows);
        let order = postordered(&column_start, &rows, order);
        let place = inverse(&order);
        let ordering = SymmetricOrdering::Custom(PermRef::new_checked(&order, &place, unknowns));
        let symbolic = factorize_symbolic_cholesky(structure, Side::Lower, ordering, Default::default())
            .map_err(|error| SparseError::Setup(format!("{error:?}")))?;
        Ok(Arc::new(Self { unknowns, column_start, rows, slots, local, symbolic }))
    }

    /// Number of rows.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Stored entries of the lower triangle.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }
}

/// Visits column and row of every entry of the lower triangle, those of several elements several times.
fn for_lower_entries(unknowns: usize, (elements, local): (&[u32], usize), mut visit: impl FnMut(u32, u32)) {
    elements.chunks_exact(local).for_each(|element| for_lower_pairs(element, &mut visit));
    (0..unknowns as u32).for_each(|i| visit(i, i));
}

/// The lower triangle's pattern, diagonal included, by columns: where each begins, and its rows, ascending.
fn lower_triangle(unknowns: usize, (elements, local): (&[u32], usize)) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; unknowns + 1];
    for_lower_entries(unknowns, (elements, local), |column, _| starts[column as usize + 1] += 1);
    (0..unknowns).for_each(|column| starts[column + 1] += starts[column]);
    let (mut ends, mut rows) = (starts.clone(), vec![0u32; starts[unknowns] as usize]);
    for_lower_entries(unknowns, (elements, local), |column, row| {
        let end = &mut ends[column as usize];
        rows[*end as usize] = row;
        *end += 1;
    });
    // Each column without what stands in it twice.
    let mut kept = 0;
    for column in 0..unknowns {
        let (start, end) = (starts[column] as usize, ends[column] as usize);
        rows[start..end].sort_unstable();
        starts[column] = kept as u32;
        for place in start..end {
            if place == start || rows[place] != rows[place - 1] {
                rows[kept] = rows[place];
                kept += 1;
            }
        }
    }
    starts[unknowns] = kept as u32;
    rows.truncate(kept);
    (starts, rows)
}

fn for_lower_pairs(element: &[u32], mut visit: impl FnMut(u32, u32)) {
    for (i, &a) in element.iter().enumerate() {
        for &b in &element[..=i] {
            if a != PRESCRIBED && b != PRESCRIBED {
                visit(a.min(b), a.max(b));
            }
        }
    }
}

fn find_slot(column_start: &[u32], rows: &[u32], a: u32, b: u32) -> u32 {
    if a == PRESCRIBED || b == PRESCRIBED {
        return u32::MAX;
    }
    let (column, row) = (a.min(b), a.max(b));
    let from = column_start[column as usize] as usize;
    let to = column_start[column as usize + 1] as usize;
    let place = rows[from..to].binary_search(&row).unwrap_or_default();
    (from + place) as u32
}

/// A symmetric matrix on a pattern: the values of its lower triangle.
#[derive(Debug, Clone)]
pub struct SymmetricMatrix {
    pattern: Arc<SymmetricPattern>,
    values: Vec<f64>,
}

impl SymmetricMatrix {
    /// The zero matrix on a pattern.
    pub fn zero(pattern: &Arc<SymmetricPattern>) -> Self {
        Self { pattern: Arc::clone(pattern), values: vec![0.0; pattern.entries()] }
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<SymmetricPattern> {
        &self.pattern
    }

    /// Sets every value to zero, keeping the pattern.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Adds the matrix of element `element`: `entry(i, j)` is asked for local `i ≥ j`, in row order.
    pub fn add_element(&mut self, element: usize, mut entry: impl FnMut(usize, usize) -> f64) {
        let local = self.pattern.local;
        let stride = local * (local + 1) / 2;
        let mut slots = self.pattern.slots[element * stride..(element + 1) * stride].iter();
        for i in 0..local {
            for j in 0..=i {
                let slot = slots.next().map_or(u32::MAX, |&slot| slot);
                if slot != u32::MAX {
                    self.values[slot as usize] += entry(i, j);
                }
            }
        }
    }

    /// Adds to the diagonal, one entry a row.
    pub fn add_diagonal(&mut self, diagonal: &[f64]) {
        for (&start, value) in self.pattern.column_start.iter().zip(diagonal) {
            self.values[start as usize] += value;
        }
    }

    /// `y = A x`, both of length `unknowns`.
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for column in 0..self.pattern.unknowns {
            let from = self.pattern.column_start[column] as usize;
            let to = self.pattern.column_start[column + 1] as usize;
            for place in from..to {
                let row = self.pattern.rows[place] as usize;
                y[row] += self.values[place] * x[column];
                if row != column {
                    y[column] += self.values[place] * x[row];
                }
            }
        }
        y
    }

    fn as_faer(&self) -> SparseColMatRef<'_, u32, f64> {
        let n = self.pattern.unknowns;
        let structure =
            SymbolicSparseColMatRef::new_checked(n, n, &self.pattern.column_start, None, &self.pattern.rows);
        SparseColMatRef::new(structure, &self.values)
    }

    /// Cholesky factor `A = L Lᵀ`.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`] with the pivot.
    pub fn cholesky(&self) -> Result<Factor, SparseError> {
        let symbolic = &self.pattern.symbolic;
        let mut values = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        symbolic
            .factorize_numeric_llt(
                &mut values,
                self.as_faer(),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut buffer(scratch)?),
                Default::default(),
            )
            .map_err(|LltError::NonPositivePivot { index }| SparseError::NotPositiveDefinite { pivot: index })?;
        Ok(Factor { pattern: Arc::clone(&self.pattern), values, kind: FactorKind::Cholesky })
    }

    /// Factor `A = L D Lᵀ` without pivoting, for tangents that may go indefinite.
    ///
    /// # Errors
    /// [`SparseError::Singular`] with the pivot.
    pub fn ldlt(&self) -> Result<Factor, SparseError> {
        let symbolic = &self.pattern.symbolic;
        let mut values = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        symbolic
            .factorize_numeric_ldlt(
                &mut values,
                self.as_faer(),
                Side::Lower,
                LdltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut buffer(scratch)?),
                Default::default(),
            )
            .map_err(|LdltError::ZeroPivot { index }| SparseError::Singular { pivot: index })?;
        Ok(Factor { pattern: Arc::clone(&self.pattern), values, kind: FactorKind::Ldlt })
    }
}

fn buffer(scratch: faer::dyn_stack::StackReq) -> Result<MemBuffer, SparseError> {
    MemBuffer::try_new(scratch).map_err(|_| SparseError::Setup("out of memory".into()))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FactorKind {
    Cholesky,
    Ldlt,
}

/// A numeric factor that solves systems.
#[derive(Debug)]
pub struct Factor {
    pattern: Arc<SymmetricPattern>,
    values: Vec<f64>,
    kind: FactorKind,
}

impl Factor {
    /// Solves `A x = b` in place for one or several right-hand sides, one after the other in `b`
    /// (length a multiple of `unknowns`).
    ///
    /// # Errors
    /// [`SparseError::Setup`] when scratch memory is refused.
    pub fn solve(&self, b: &mut [f64]) -> Result<(), SparseError> {
        let n = self.pattern.unknowns;
        if n == 0 {
            return Ok(());
        }
        let columns = b.len() / n;
        let symbolic = &self.pattern.symbolic;
        let mut memory = buffer(symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq))?;
        let stack = MemStack::new(&mut memory);
        let b = MatMut::from_column_major_slice_mut(b, n, columns);
        match self.kind {
            FactorKind::Cholesky => {
                LltRef::new(symbolic, &self.values).solve_in_place_with_conj(Conj::No, b, Par::Seq, stack);
            }
            FactorKind::Ldlt => {
                LdltRef::new(symbolic, &self.values).solve_in_place_with_conj(Conj::No, b, Par::Seq, stack);
            }
        }
        Ok(())
    }

    /// Number of negative eigenvalues of the matrix: negative entries of `D` (Sylvester's law of inertia); zero for a
    /// Cholesky factor.
    pub fn negative_eigenvalues(&self) -> usize {
        if self.kind == FactorKind::Cholesky {
            return 0;
        }
        match self.pattern.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(symbolic) => {
                let starts = symbolic.col_ptr();
                starts[..starts.len() - 1].iter().filter(|&&start| self.values[start as usize] < 0.0).count()
            }
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let factor = SupernodalLdltRef::<u32, f64>::new(symbolic, &self.values);
                (0..symbolic.n_supernodes())
                    .map(|s| {
                        let block = factor.supernode(s).val();
                        (0..block.ncols()).filter(|&j| block[(j, j)] < 0.0).count()
                    })
                    .sum()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::dissection::nested_dissection;
    use crate::numerics::simplex_mesh::structured_rectangle;

    /// A chain of `n` springs to a wall, with one spring of stiffness `weak`: tridiagonal.
    fn chain(n: usize, weak: f64) -> SymmetricMatrix {
        let elements: Vec<u32> =
            (0..n).flat_map(|i| [if i == 0 { PRESCRIBED } else { i as u32 - 1 }, i as u32]).collect();
        let order: Vec<u32> = (0..n as u32).collect();
        let pattern = SymmetricPattern::in_order(&order, &elements, 2).unwrap();
        let mut matrix = SymmetricMatrix::zero(&pattern);
        for element in 0..n {
            let stiffness = if element == n / 2 { weak } else { 1.0 };
            matrix.add_element(element, |i, j| if i == j { stiffness } else { -stiffness });
        }
        matrix
    }

    #[test]
    fn a_chain_of_springs_pulled_at_its_end_stretches_linearly() {
        let matrix = chain(50, 1.0);
        for factor in [matrix.cholesky().unwrap(), matrix.ldlt().unwrap()] {
            let mut b = vec![0.0; 100];
            b[49] = 1.0;
            b[99] = 2.0;
            factor.solve(&mut b).unwrap();
            for i in 0..50 {
                assert!((b[i] - (i + 1) as f64).abs() < 1e-11);
                assert!((b[50 + i] - 2.0 * (i + 1) as f64).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn any_order_of_elimination_solves_the_same_system() {
        let mesh = structured_rectangle(1.5, 1.0, 30, 20).unwrap();
        let fill = |pattern: &SymmetricPattern| pattern.symbolic.len_val();
        let solved = |pattern: Arc<SymmetricPattern>| {
            let mut matrix = SymmetricMatrix::zero(&pattern);
            let cells = mesh.cell_count();
            (0..cells).for_each(|cell| matrix.add_element(cell, |i, j| if i == j { 1.1 } else { -0.5 }));
            let mut x: Vec<f64> = (0..mesh.vertex_count()).map(|i| (i as f64).sin()).collect();
            matrix.ldlt().unwrap().solve(&mut x).unwrap();
            x
        };
        let order = nested_dissection(mesh.vertices(), mesh.cells(), 3);
        let dissected = SymmetricPattern::in_order(&order, mesh.cells(), 3).unwrap();
        let backwards: Vec<u32> = (0..mesh.vertex_count() as u32).rev().collect();
        let given = SymmetricPattern::in_order(&backwards, mesh.cells(), 3).unwrap();
        assert!(fill(&dissected) < fill(&given), "{} {}", fill(&dissected), fill(&given));
        let (one, other) = (solved(dissected), solved(given));
        assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-11));
    }

    #[test]
    fn inertia_counts_the_negative_spring_and_cholesky_refuses_it() {
        let matrix = chain(20, -0.5);
        assert_eq!(matrix.ldlt().unwrap().negative_eigenvalues(), 1);
        assert!(matches!(matrix.cholesky(), Err(SparseError::NotPositiveDefinite { .. })));
    }

    #[test]
    fn multiply_undoes_solve() {
        let matrix = chain(30, 3.0);
        let x: Vec<f64> = (0..30).map(|i| (i as f64).sin()).collect();
        let mut b = matrix.multiply(&x);
        matrix.cholesky().unwrap().solve(&mut b).unwrap();
        assert!(x.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-10));
    }
}
