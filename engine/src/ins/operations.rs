//! What may happen to errors from one moment to the next, as a few linear operations.
//!
//! A filter applies them to its covariance; a smoother goes back over them, one by one ([`super::adjoint`]).

use nalgebra::{Matrix3, Vector3};

/// What the error of one vector is multiplied by before it is added to that of another.
pub trait Factor {
    /// The factor times a block.
    fn times(&self, block: &Matrix3<f64>) -> Matrix3<f64>;

    /// The factor as a value that can be kept.
    fn kept(&self) -> KeptFactor;
}

impl Factor for Matrix3<f64> {
    #[inline(always)]
    fn times(&self, block: &Matrix3<f64>) -> Matrix3<f64> {
        self * block
    }

    fn kept(&self) -> KeptFactor {
        KeptFactor::Matrix(*self)
    }
}

impl Factor for f64 {
    #[inline(always)]
    fn times(&self, block: &Matrix3<f64>) -> Matrix3<f64> {
        block * *self
    }

    fn kept(&self) -> KeptFactor {
        KeptFactor::Scalar(*self)
    }
}

/// The factor `[v×]`: a cross product costs two thirds of a matrix product.
#[derive(Clone, Copy, Debug)]
pub struct Cross(pub Vector3<f64>);

impl Factor for Cross {
    #[inline(always)]
    fn times(&self, block: &Matrix3<f64>) -> Matrix3<f64> {
        let v = &self.0;
        let mut product = Matrix3::zeros();
        for c in 0..3 {
            product[(0, c)] = v.y * block[(2, c)] - v.z * block[(1, c)];
            product[(1, c)] = v.z * block[(0, c)] - v.x * block[(2, c)];
            product[(2, c)] = v.x * block[(1, c)] - v.y * block[(0, c)];
        }
        product
    }

    fn kept(&self) -> KeptFactor {
        KeptFactor::Cross(self.0)
    }
}

/// A factor that was taken down.
#[derive(Clone, Copy, Debug)]
pub enum KeptFactor {
    /// A number.
    Scalar(f64),
    /// `[v×]`.
    Cross(Vector3<f64>),
    /// A matrix.
    Matrix(Matrix3<f64>),
}

/// The operations that a transition is made of.
pub trait ErrorOperations {
    /// Adds `factor` times the error of vector `b` to that of vector `a`.
    fn add_multiple(&mut self, a: usize, b: usize, factor: &impl Factor);

    /// Scales the error of vector `i`, axis by axis.
    fn scale(&mut self, i: usize, by: &Vector3<f64>);

    /// Adds noise of this variance, by axis, to the error of vector `i`.
    fn add_noise(&mut self, i: usize, variance: &Vector3<f64>);
}

/// One operation that was taken down.
#[derive(Clone, Copy, Debug)]
pub(super) enum Operation {
    AddMultiple { a: usize, b: usize, factor: KeptFactor },
    Scale { i: usize, by: Vector3<f64> },
    AddNoise { i: usize, variance: Vector3<f64> },
}

impl ErrorOperations for Vec<Operation> {
    fn add_multiple(&mut self, a: usize, b: usize, factor: &impl Factor) {
        self.push(Operation::AddMultiple { a, b, factor: factor.kept() });
    }

    fn scale(&mut self, i: usize, by: &Vector3<f64>) {
        self.push(Operation::Scale { i, by: *by });
    }

    fn add_noise(&mut self, i: usize, variance: &Vector3<f64>) {
        self.push(Operation::AddNoise { i, variance: *variance });
    }
}
