//! Linear functions of the errors, a row of numbers each.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// `M` linear functions of the errors of `B` three-vectors: an M × 3B matrix. A row lies in memory as one
/// piece, so that loops along it take several numbers at a time on every processor.
#[derive(Clone, Copy, Debug)]
pub struct Rows<const M: usize, const B: usize>(pub(super) [[[f64; 3]; B]; M]);

impl<const M: usize, const B: usize> Serialize for Rows<M, B> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.0.as_flattened().serialize(to)
    }
}

impl<'de, const M: usize, const B: usize> Deserialize<'de> for Rows<M, B> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let cells = Vec::<[f64; 3]>::deserialize(from)?;
        let mut rows = Rows::zeros();
        if cells.len() != M * B {
            return Err(D::Error::custom(format!(
                "expected {M} rows of {B} vectors, found {} vectors",
                cells.len()
            )));
        }
        rows.0.as_flattened_mut().copy_from_slice(&cells);
        Ok(rows)
    }
}

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

    /// Adds `other`.
    #[inline]
    pub(super) fn add(&mut self, other: &Self) {
        for m in 0..M {
            add_multiples(self.row_mut(m), &[1.0], &[other.row(m)]);
        }
    }

    /// Takes `other` off.
    #[inline]
    pub(super) fn subtract(&mut self, other: &Self) {
        for m in 0..M {
            add_multiples(self.row_mut(m), &[-1.0], &[other.row(m)]);
        }
    }

    /// The rows see nothing of the error of vector `i` any more.
    pub(super) fn clear(&mut self, i: usize) {
        for row in &mut self.0 {
            row[i] = [0.0; 3];
        }
    }

    /// The rows see the error of vector `a` after `factor` times that of `b` has been added to it.
    pub(super) fn add_multiple(&mut self, a: usize, b: usize, factor: &Matrix3<f64>) {
        for row in &mut self.0 {
            let grown = factor * Vector3::from(row[b]);
            row[a].iter_mut().zip(&grown).for_each(|(cell, x)| *cell += x);
        }
    }

    /// The rows see the error of vector `i` after it has been scaled, axis by axis.
    pub(super) fn scale(&mut self, i: usize, by: &Vector3<f64>) {
        for row in &mut self.0 {
            row[i].iter_mut().zip(by).for_each(|(cell, by)| *cell *= by);
        }
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
        let rows = std::array::from_fn::<_, M, _>(|m| self.row(m));
        SVector::from(dots(&rows, &[flat.as_flattened()])[0])
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
        let (rows, others) = (
            std::array::from_fn::<_, M, _>(|m| self.row(m)),
            std::array::from_fn::<_, N, _>(|n| other.row(n)),
        );
        SMatrix::from(dots(&rows, &others))
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

/// Adds `by` times three rows to three others.
#[inline(always)]
pub(super) fn add_product<const W: usize>(
    to: &mut [[[f64; 3]; W]; 3],
    by: &Matrix3<f64>,
    from: &[[[f64; 3]; W]; 3],
) {
    let from = from.each_ref().map(|row| row.as_flattened());
    for (r, to) in to.iter_mut().enumerate() {
        add_multiples(to.as_flattened_mut(), &[by[(r, 0)], by[(r, 1)], by[(r, 2)]], &from);
    }
}

/// The sums of products of each of `N` rows with each of `M`, m first. Even and odd places are summed apart:
/// the same order on every processor.
#[inline(always)]
pub(super) fn dots<const N: usize, const M: usize>(of: &[&[f64]; N], with: &[&[f64]; M]) -> [[f64; N]; M] {
    let length = of[0].len();
    let (of, with) = (of.map(|row| &row[..length]), with.map(|row| &row[..length]));
    let mut sums = [[[0.0; 2]; N]; M];
    for k in (0..length / 2).map(|half| 2 * half) {
        for (sums, with) in sums.iter_mut().zip(&with) {
            for (sum, of) in sums.iter_mut().zip(&of) {
                sum[0] += with[k] * of[k];
                sum[1] += with[k + 1] * of[k + 1];
            }
        }
    }
    let last = length - length % 2;
    std::array::from_fn(|m| {
        std::array::from_fn(|n| {
            let odd = if last < length { with[m][last] * of[n][last] } else { 0.0 };
            sums[m][n][0] + sums[m][n][1] + odd
        })
    })
}
