//! Linear functions of the errors, a row of numbers each.

use nalgebra::{SMatrix, SVector, Vector3};

/// `M` linear functions of the errors of `B` three-vectors: an M × 3B matrix. A row lies in memory as one
/// piece, so that loops along it take several numbers at a time on every processor.
#[derive(Clone, Copy, Debug)]
pub struct Rows<const M: usize, const B: usize>(pub(super) [[[f64; 3]; B]; M]);

impl<const M: usize, const B: usize> Rows<M, B> {
    /// All zero.
    pub fn zeros() -> Self {
        Rows([[[0.0; 3]; B]; M])
    }

    #[inline(always)]
    pub(super) fn row(&self, m: usize) -> &[f64] {
        self.0[m].as_flattened()
    }

    #[inline(always)]
    pub(super) fn row_mut(&mut self, m: usize) -> &mut [f64] {
        self.0[m].as_flattened_mut()
    }

    /// The part that sees the error of vector `i`.
    #[inline]
    pub fn block(&self, i: usize) -> SMatrix<f64, M, 3> {
        SMatrix::from_fn(|m, axis| self.0[m][i][axis])
    }

    /// `left` times the rows.
    #[inline]
    pub(super) fn times<const N: usize>(&self, left: &SMatrix<f64, N, M>) -> Rows<N, B> {
        let mut product = Rows::zeros();
        for n in 0..N {
            let factors: [f64; M] = std::array::from_fn(|m| left[(n, m)]);
            add_multiples::<M>(product.row_mut(n), &factors, &std::array::from_fn(|m| self.row(m)));
        }
        product
    }

    /// The rows' values for these errors.
    #[inline]
    pub(super) fn of(&self, errors: &[Vector3<f64>; B]) -> SVector<f64, M> {
        let mut flat = [[0.0; 3]; B];
        for (flat, error) in flat.iter_mut().zip(errors) {
            *flat = (*error).into();
        }
        SVector::from_fn(|m, _| dot(self.row(m), flat.as_flattened()))
    }

    /// A' v: for each vector, how much the rows weighted by `v` see of it.
    #[inline]
    pub(super) fn transposed_times(&self, v: &SVector<f64, M>) -> [Vector3<f64>; B] {
        let mut sum = [[0.0; 3]; B];
        let factors: [f64; M] = std::array::from_fn(|m| v[m]);
        add_multiples::<M>(sum.as_flattened_mut(), &factors, &std::array::from_fn(|m| self.row(m)));
        sum.map(Vector3::from)
    }

    /// A · other', from row to row.
    #[inline]
    pub(super) fn times_transposed<const N: usize>(&self, other: &Rows<N, B>) -> SMatrix<f64, M, N> {
        SMatrix::from_fn(|m, n| dot(self.row(m), other.row(n)))
    }
}

/// Adds factors · rows to a row.
#[inline(always)]
pub(super) fn add_multiples<const K: usize>(to: &mut [f64], factors: &[f64; K], of: &[&[f64]; K]) {
    let length = to.len();
    let of = of.map(|row| &row[..length]);
    for k in 0..length {
        let mut sum = to[k];
        for (factor, row) in factors.iter().zip(&of) {
            sum += factor * row[k];
        }
        to[k] = sum;
    }
}

/// The sum of products, in four partial sums: the same order on every processor.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a, b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    ((sums[0] + sums[2]) + (sums[1] + sums[3])) + rest
}
