//! What may happen to errors from one moment to the next, as a few linear operations.
//!
//! A filter applies them to its covariance; a smoother goes back over them, transposed and from the last
//! to the first ([`super::adjoint`]).

use nalgebra::{Matrix3, Vector3};

use super::rows::add_multiples;

/// What the error of one vector is multiplied by before it is added to that of another.
#[derive(Clone, Copy, Debug)]
pub(super) enum Factor {
    /// A number.
    Scalar(f64),
    /// `[v×]`: a cross product costs two thirds of a matrix product.
    Cross(Vector3<f64>),
    /// A matrix.
    Matrix(Matrix3<f64>),
}

impl Factor {
    #[inline]
    pub(super) fn transposed(&self) -> Factor {
        match self {
            Factor::Scalar(by) => Factor::Scalar(*by),
            Factor::Cross(v) => Factor::Cross(-v),
            Factor::Matrix(by) => Factor::Matrix(by.transpose()),
        }
    }

    #[inline]
    pub(super) fn times(&self, v: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Factor::Scalar(by) => v * *by,
            Factor::Cross(by) => by.cross(v),
            Factor::Matrix(by) => by * v,
        }
    }

    /// Adds the factor times the three rows `from` to the three rows `to`.
    #[inline]
    pub(super) fn add_to<const W: usize>(&self, to: &mut [[[f64; 3]; W]; 3], from: &[[[f64; 3]; W]; 3]) {
        let [x, y, z] = from.each_ref().map(|row| row.as_flattened());
        let [to_x, to_y, to_z] = to.each_mut().map(|row| row.as_flattened_mut());
        match self {
            Factor::Scalar(by) => {
                add_multiples(to_x, &[*by], &[x]);
                add_multiples(to_y, &[*by], &[y]);
                add_multiples(to_z, &[*by], &[z]);
            }
            Factor::Cross(v) => {
                add_multiples(to_x, &[-v.z, v.y], &[y, z]);
                add_multiples(to_y, &[v.z, -v.x], &[x, z]);
                add_multiples(to_z, &[-v.y, v.x], &[x, y]);
            }
            Factor::Matrix(by) => {
                add_multiples(to_x, &[by[(0, 0)], by[(0, 1)], by[(0, 2)]], &[x, y, z]);
                add_multiples(to_y, &[by[(1, 0)], by[(1, 1)], by[(1, 2)]], &[x, y, z]);
                add_multiples(to_z, &[by[(2, 0)], by[(2, 1)], by[(2, 2)]], &[x, y, z]);
            }
        }
    }
}

/// One operation.
#[derive(Clone, Copy, Debug)]
pub(super) enum Operation {
    /// Adds `factor` times the error of vector `b` to that of vector `a`.
    AddMultiple { a: usize, b: usize, factor: Factor },
    /// Scales the error of vector `i`, axis by axis.
    Scale { i: usize, by: Vector3<f64> },
}

impl Operation {
    #[inline]
    pub(super) fn transposed(&self) -> Operation {
        match self {
            Operation::AddMultiple { a, b, factor } => {
                Operation::AddMultiple { a: *b, b: *a, factor: factor.transposed() }
            }
            Operation::Scale { .. } => *self,
        }
    }

    /// Applies it from the left to a matrix that has three rows for each of the vectors from number
    /// `first` on; it touches no others.
    #[inline]
    pub(super) fn apply<const W: usize, const G: usize>(
        &self,
        first: usize,
        rows: &mut [[[[f64; 3]; W]; 3]; G],
    ) {
        match self {
            Operation::AddMultiple { a, b, factor } => {
                if let Ok([to, from]) = rows.get_disjoint_mut([a - first, b - first]) {
                    factor.add_to(to, from);
                }
            }
            Operation::Scale { i, by } => {
                for (row, by) in rows[i - first].iter_mut().zip(by) {
                    row.as_flattened_mut().iter_mut().for_each(|cell| *cell *= by);
                }
            }
        }
    }

    /// Applies its transpose from the right to rows of a matrix that has three columns for each vector.
    #[inline]
    pub(super) fn apply_right<const W: usize>(&self, rows: &mut [[[f64; 3]; W]]) {
        match *self {
            Operation::AddMultiple { a, b, factor } => match factor {
                Factor::Scalar(by) => add_to_columns(rows, a, b, |from| from.map(|x| x * by)),
                Factor::Cross(v) => add_to_columns(rows, a, b, |[x, y, z]| {
                    [v.y * z - v.z * y, v.z * x - v.x * z, v.x * y - v.y * x]
                }),
                Factor::Matrix(by) => add_to_columns(rows, a, b, |[x, y, z]| {
                    [0, 1, 2].map(|r| by[(r, 0)] * x + by[(r, 1)] * y + by[(r, 2)] * z)
                }),
            },
            Operation::Scale { i, by } => {
                for row in rows {
                    for (cell, by) in row[i].iter_mut().zip(&by) {
                        *cell *= by;
                    }
                }
            }
        }
    }
}

/// Adds the product with the columns of vector b to those of vector a.
#[inline(always)]
fn add_to_columns<const W: usize>(
    rows: &mut [[[f64; 3]; W]],
    a: usize,
    b: usize,
    product: impl Fn([f64; 3]) -> [f64; 3],
) {
    for row in rows {
        let from = product(row[b]);
        for (cell, x) in row[a].iter_mut().zip(from) {
            *cell += x;
        }
    }
}
