//! A covariance stored and worked on by 3×3 blocks.
//!
//! Only the blocks on and above the diagonal are kept, and the diagonal blocks are made symmetric
//! after every change: with rounding left alone there, the joint filter of two feet loses its
//! positive definiteness within minutes.
//!
//! A row of the matrix lies in memory as one piece: nearly all the work is a multiple of one row added
//! to another, and that goes several numbers at a time.

use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::linear_maps::{Rows, add_multiples, add_product, dots};
use super::sensor_map::Five;

/// The covariance of `B` three-vectors: a symmetric 3B × 3B matrix.
#[derive(Clone, Debug)]
pub struct BlockCovariance<const B: usize> {
    /// `upper[i][r]` is row r of the blocks (i, j) for all j. What lies below the diagonal, j < i, is
    /// room to work in: nobody counts on what is there.
    upper: [[[[f64; 3]; B]; 3]; B],
}

impl<const B: usize> Serialize for BlockCovariance<B> {
    /// The blocks on and above the diagonal, row by row.
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let rows = self.upper.iter().enumerate().flat_map(|(i, rows)| rows.iter().map(move |row| &row[i..]));
        let cells: Vec<[f64; 3]> = rows.flatten().copied().collect();
        cells.serialize(to)
    }
}

impl<'de, const B: usize> Deserialize<'de> for BlockCovariance<B> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let cells = Vec::<[f64; 3]>::deserialize(from)?;
        let expected = 3 * B * (B + 1) / 2;
        if cells.len() != expected {
            return Err(D::Error::custom(format!(
                "expected {expected} rows of blocks, found {}",
                cells.len()
            )));
        }
        let mut covariance = BlockCovariance::zeros();
        let mut cells = cells.into_iter();
        for (i, rows) in covariance.upper.iter_mut().enumerate() {
            for cell in rows.iter_mut().flat_map(|row| &mut row[i..]) {
                *cell = cells.next().unwrap_or_default();
            }
        }
        Ok(covariance)
    }
}

impl<const B: usize> BlockCovariance<B> {
    /// All zero.
    pub fn zeros() -> Self {
        BlockCovariance { upper: [[[[0.0; 3]; B]; 3]; B] }
    }

    /// The covariance of vector i with vector j.
    #[inline]
    pub fn block(&self, i: usize, j: usize) -> Matrix3<f64> {
        if i <= j { self.stored(i, j) } else { self.stored(j, i).transpose() }
    }

    #[inline]
    fn stored(&self, i: usize, j: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|r, c| self.upper[i][r][j][c])
    }

    /// Puts `block` in the place (i, j) and its transpose in the place (j, i).
    #[inline]
    pub(super) fn set(&mut self, i: usize, j: usize, block: &Matrix3<f64>) {
        for r in 0..3 {
            for c in 0..3 {
                if i <= j {
                    self.upper[i][r][j][c] = block[(r, c)];
                } else {
                    self.upper[j][c][i][r] = block[(r, c)];
                }
            }
        }
    }

    /// Brings the rows of vector i up to date between number `first` and the diagonal.
    #[inline]
    fn fill_left(&mut self, i: usize, first: usize) {
        let (before, from_i) = self.upper.split_at_mut(i);
        let rows = &mut from_i[0];
        for (j, of_j) in before.iter().enumerate().skip(first) {
            for r in 0..3 {
                rows[r][j] = [of_j[0][i][r], of_j[1][i][r], of_j[2][i][r]];
            }
        }
    }

    /// Brings the columns of vector i above the diagonal up to date from its rows.
    #[inline]
    fn take_over_left(&mut self, i: usize) {
        let (before, from_i) = self.upper.split_at_mut(i);
        let rows = &from_i[0];
        for (j, of_j) in before.iter_mut().enumerate() {
            for (c, row) in of_j.iter_mut().enumerate() {
                row[i] = [rows[0][j][c], rows[1][j][c], rows[2][j][c]];
            }
        }
    }

    /// Sets the covariance of vector i with itself.
    pub fn set_diagonal(&mut self, i: usize, block: Matrix3<f64>) {
        self.set(i, i, &block);
    }

    /// Adds `variance`, by axis, to every covariance among `blocks`: a noise that they have in common.
    pub(super) fn add_common_noise(&mut self, blocks: &[usize], variance: &Vector3<f64>) {
        for (k, a) in blocks.iter().enumerate() {
            for b in &blocks[k..] {
                let (row, column) = (*a.min(b), *a.max(b));
                for axis in 0..3 {
                    self.upper[row][axis][column][axis] += variance[axis];
                }
            }
        }
    }

    /// Forgets what vector i has to do with all others and gives it the covariance `block`.
    pub(super) fn isolate(&mut self, i: usize, block: Matrix3<f64>) {
        for j in 0..B {
            self.set(i, j, &Matrix3::zeros());
        }
        self.set_diagonal(i, block);
    }

    /// Gives vector `to` the error of vector `from`.
    pub(super) fn copy(&mut self, from: usize, to: usize) {
        let squared = self.block(from, from);
        for j in (0..B).filter(|j| *j != to) {
            self.set(to, j, &self.block(from, j));
        }
        self.set_diagonal(to, squared);
    }

    /// Makes the diagonal block i symmetric to the bit.
    #[inline]
    fn symmetrise(&mut self, i: usize) {
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let mean = 0.5 * (self.upper[i][row][i][column] + self.upper[i][column][i][row]);
            self.upper[i][row][i][column] = mean;
            self.upper[i][column][i][row] = mean;
        }
    }

    /// H P for the Jacobians H of a measurement: its covariance with all errors.
    #[inline]
    pub(crate) fn seen_by<const M: usize>(&self, jacobians: &[(usize, SMatrix<f64, M, 3>)]) -> Rows<M, B> {
        let mut seen = Rows::zeros();
        for (i, jacobian) in jacobians {
            for m in 0..M {
                for axis in 0..3 {
                    // Most Jacobians are mostly zero.
                    let factor = jacobian[(m, axis)];
                    if factor != 0.0 {
                        let (before, from_i) = seen.0[m].split_at_mut(*i);
                        let row = self.upper[*i][axis][*i..].as_flattened();
                        add_multiples(from_i.as_flattened_mut(), &[factor], &[row]);
                        for (j, block) in before.iter_mut().enumerate() {
                            for (c, cell) in block.iter_mut().enumerate() {
                                *cell += factor * self.upper[j][c][*i][axis];
                            }
                        }
                    }
                }
            }
        }
        seen
    }

    /// Takes `gain' · cross_covariance` off: the covariance after an update, where `cross_covariance` is
    /// H·P and `gain` is S⁻¹·H·P.
    #[inline]
    pub(super) fn subtract_product<const M: usize>(
        &mut self,
        gain: &Rows<M, B>,
        cross_covariance: &Rows<M, B>,
    ) {
        for i in 0..B {
            for r in 0..3 {
                add_multiples::<M>(
                    self.upper[i][r][i..].as_flattened_mut(),
                    &std::array::from_fn(|m| -gain.0[m][i][r]),
                    &std::array::from_fn(|m| cross_covariance.0[m][i..].as_flattened()),
                );
            }
            self.symmetrise(i);
        }
    }

    /// A · P for rows A.
    #[inline]
    pub(super) fn times_rows<const M: usize>(&self, a: &Rows<M, B>) -> Rows<M, B> {
        let mut product = Rows::zeros();
        for i in 0..B {
            // The rows of a vector from the diagonal on, and what they are below it.
            let rows = self.upper[i].each_ref().map(|row| row[i..].as_flattened());
            for m in 0..M {
                add_multiples(product.0[m][i..].as_flattened_mut(), &a.0[m][i], &rows);
            }
            let beyond = rows.map(|row| &row[3..]);
            let sums = dots(&beyond, &a.0.each_ref().map(|row| row[i + 1..].as_flattened()));
            for (row, sums) in product.0.iter_mut().zip(&sums) {
                row[i].iter_mut().zip(sums).for_each(|(cell, sum)| *cell += sum);
            }
        }
        product
    }

    /// The matrix times a vector, block by block.
    pub(super) fn times(&self, v: &[Vector3<f64>; B]) -> [Vector3<f64>; B] {
        let row = Rows([v.map(Into::into)]);
        self.times_rows(&row).0[0].map(Vector3::from)
    }

    /// Takes `t · d` and its transpose off, where `t` is zero but for the rows of vector `at`.
    #[inline]
    pub(super) fn subtract_both_products<const M: usize>(
        &mut self,
        at: usize,
        t: &SMatrix<f64, 3, M>,
        d: &Rows<M, B>,
    ) {
        self.fill_left(at, 0);
        let product = d.times(&-t);
        for (to, row) in self.upper[at].iter_mut().zip(&product.0) {
            add_multiples(to.as_flattened_mut(), &[1.0], &[row.as_flattened()]);
        }
        self.take_over_left(at);
        for r in 0..3 {
            for c in 0..3 {
                self.upper[at][r][at][c] += product.0[c][at][r];
            }
        }
        self.symmetrise(at);
    }

    /// The whole matrix, N = 3B on a side: for tests and reports.
    pub fn dense(&self) -> nalgebra::DMatrix<f64> {
        nalgebra::DMatrix::from_fn(3 * B, 3 * B, |r, c| self.block(r / 3, c / 3)[(r % 3, c % 3)])
    }

    /// Whether every number in it is finite.
    pub(super) fn is_finite(&self) -> bool {
        (0..B).all(|i| self.upper[i].iter().all(|row| row[i..].as_flattened().iter().all(|x| x.is_finite())))
    }

    /// Whether every number in it is finite and no variance is negative.
    pub fn is_sound(&self) -> bool {
        self.is_finite() && (0..B).all(|i| (0..3).all(|k| self.upper[i][k][i][k] >= 0.0))
    }

    /// P ← E P E', where E maps the five vectors from number `first` on. The others take part by what they
    /// have to do with these.
    #[inline]
    pub(super) fn transform(&mut self, first: usize, map: impl Fn(Five) -> Five) {
        // Of the rows themselves what lies left of the vectors is not stored.
        for i in first..first + 5 {
            self.fill_left(i, first);
        }
        let Some(rows) = self.upper[first..].first_chunk_mut::<5>() else { return };
        for column in 3 * first..3 * B {
            let mut five = [[0.0; 3]; 5];
            for (five, rows) in five.iter_mut().zip(&*rows) {
                for (x, row) in five.iter_mut().zip(rows) {
                    *x = row.as_flattened()[column];
                }
            }
            let five = map(five);
            for (five, rows) in five.iter().zip(&mut *rows) {
                for (x, row) in five.iter().zip(rows) {
                    row.as_flattened_mut()[column] = *x;
                }
            }
        }
        // From the right: among themselves, and for those before them.
        for row in self.upper[..first + 5].as_flattened_mut() {
            if let Some(five) = row[first..].first_chunk_mut::<5>() {
                *five = map(*five);
            }
        }
        for i in first..first + 5 {
            self.symmetrise(i);
        }
    }

    /// P ← E P E' where E adds `factor` times the error of vector `b` to that of vector `a`.
    #[inline]
    pub(super) fn add_multiple(&mut self, a: usize, b: usize, factor: &Matrix3<f64>) {
        debug_assert!(a != b, "a multiple of itself is a scaling");
        self.fill_left(a, 0);
        self.fill_left(b, 0);
        let Ok([rows_a, rows_b]) = self.upper.get_disjoint_mut([a, b]) else { return };
        add_product(rows_a, factor, rows_b);
        // From the right, too, where a meets itself.
        let with_b: [[[f64; 3]; 1]; 3] = std::array::from_fn(|c| [std::array::from_fn(|r| rows_a[r][b][c])]);
        let mut growth = [[[0.0; 3]]; 3];
        add_product(&mut growth, factor, &with_b);
        for r in 0..3 {
            for c in 0..3 {
                rows_a[r][a][c] += growth[c][0][r];
            }
        }
        self.take_over_left(a);
        self.symmetrise(a);
    }

    /// P ← E P E', where E turns each of these vectors by `r`.
    pub(super) fn turn(&mut self, vectors: &[usize], r: &Matrix3<f64>) {
        for i in 0..B {
            for j in i..B {
                let mut block = self.stored(i, j);
                if vectors.contains(&i) {
                    block = r * block;
                }
                if vectors.contains(&j) {
                    block *= r.transpose();
                }
                self.set(i, j, &block);
            }
            self.symmetrise(i);
        }
    }

    /// Scales the error of vector i, axis by axis.
    #[inline]
    pub(super) fn scale(&mut self, i: usize, by: &Vector3<f64>) {
        for j in 0..=i {
            for row in &mut self.upper[j] {
                for (cell, by) in row[i].iter_mut().zip(by) {
                    *cell *= by;
                }
            }
        }
        for (row, by) in self.upper[i].iter_mut().zip(by) {
            for cell in row[i..].as_flattened_mut() {
                *cell *= by;
            }
        }
        self.symmetrise(i);
    }

    /// Adds noise of this variance, by axis, to the error of vector i.
    #[inline]
    pub(super) fn add_noise(&mut self, i: usize, variance: &Vector3<f64>) {
        for axis in 0..3 {
            self.upper[i][axis][i][axis] += variance[axis];
        }
    }

    /// Adds one noise of this variance, by axis, to the error of vector j, and `share` of it to that of i.
    #[inline]
    pub(super) fn add_shared_noise(&mut self, i: usize, j: usize, share: f64, variance: &Vector3<f64>) {
        let (row, column) = (i.min(j), i.max(j));
        for axis in 0..3 {
            self.upper[i][axis][i][axis] += share * share * variance[axis];
            self.upper[row][axis][column][axis] += share * variance[axis];
            self.upper[j][axis][j][axis] += variance[axis];
        }
    }
}
