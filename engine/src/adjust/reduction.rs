//! Decorrelation of ambiguities by whole numbers (Teunissen 1995): Q = L' D L, and Z with determinant ±1 that makes L nearly the
//! identity and D nearly sorted.

use nalgebra::DMatrix;

/// L (unit lower triangle), D and Z' of a covariance: Z' Q Z = L' D L.
#[derive(Clone, Debug)]
pub(super) struct Reduced {
    pub(super) l: DMatrix<f64>,
    pub(super) d: Vec<f64>,
    /// Each row is one of the new ambiguities, in terms of the old.
    pub(super) z_t: DMatrix<f64>,
}

/// Decorrelates; none of a covariance that is not positive.
pub(super) fn reduce(q: &DMatrix<f64>) -> Option<Reduced> {
    let n = q.nrows();
    let (l, d) = factors(q)?;
    let mut reduced = Reduced { l, d, z_t: DMatrix::identity(n, n) };
    // From the last pair to the first; after a swap the pairs before are looked at anew.
    let mut j = n.saturating_sub(2);
    let mut clean_from = j;
    if n < 2 {
        return Some(reduced);
    }
    loop {
        if j <= clean_from {
            for i in j + 1..n {
                reduced.round(i, j);
            }
        }
        let l = reduced.l[(j + 1, j)];
        let swapped = reduced.d[j] + l * l * reduced.d[j + 1];
        if swapped + 1e-6 * reduced.d[j + 1] < reduced.d[j + 1] {
            reduced.swap(j, swapped);
            clean_from = j;
            j = n - 2;
        } else if j == 0 {
            return Some(reduced);
        } else {
            j -= 1;
        }
    }
}

/// Q = L' D L from the last row to the first.
fn factors(q: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<f64>)> {
    let n = q.nrows();
    let mut a = q.clone();
    let mut l = DMatrix::zeros(n, n);
    let mut d = vec![0.0; n];
    for i in (0..n).rev() {
        d[i] = a[(i, i)];
        if d[i] <= 0.0 || !d[i].is_finite() {
            return None;
        }
        let root = d[i].sqrt();
        for j in 0..=i {
            l[(i, j)] = a[(i, j)] / root;
        }
        for j in 0..i {
            for k in 0..=j {
                a[(j, k)] -= l[(i, k)] * l[(i, j)];
            }
        }
        for j in 0..=i {
            l[(i, j)] /= root;
        }
    }
    Some((l, d))
}

impl Reduced {
    /// Takes as many whole times row i from column j that |L(i, j)| ≤ ½.
    fn round(&mut self, i: usize, j: usize) {
        let mu = libm::round(self.l[(i, j)]);
        if mu == 0.0 {
            return;
        }
        let n = self.d.len();
        for k in i..n {
            self.l[(k, j)] -= mu * self.l[(k, i)];
        }
        for k in 0..n {
            self.z_t[(j, k)] -= mu * self.z_t[(i, k)];
        }
    }

    /// Swaps the ambiguities j and j + 1; `d` is what the second one's variance becomes.
    fn swap(&mut self, j: usize, d: f64) {
        let n = self.d.len();
        let l = self.l[(j + 1, j)];
        let eta = self.d[j] / d;
        let lambda = self.d[j + 1] * l / d;
        self.d[j] = eta * self.d[j + 1];
        self.d[j + 1] = d;
        for k in 0..j {
            let (upper, lower) = (self.l[(j, k)], self.l[(j + 1, k)]);
            self.l[(j, k)] = lower - l * upper;
            self.l[(j + 1, k)] = eta * upper + lambda * lower;
        }
        self.l[(j + 1, j)] = lambda;
        for k in j + 2..n {
            self.l.swap((k, j), (k, j + 1));
        }
        for k in 0..n {
            self.z_t.swap((j, k), (j + 1, k));
        }
    }
}
