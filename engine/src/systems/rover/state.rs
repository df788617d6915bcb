//! The estimate and its covariance, updated row by row; it knows no sensor.

/// Index of the position's first element.
pub const POSITION: usize = 0;
/// Index of the velocity's first element.
pub const VELOCITY: usize = 3;
/// Index of the first state of the ranges.
pub const RANGES: usize = 6;

/// Estimate and covariance of any number of elements; the first six are position and velocity.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// The estimate.
    pub x: Vec<f64>,
    /// The covariance, row by row; symmetric to the last bit.
    p: Vec<f64>,
    /// A column of the gain, kept so that no update allocates.
    gain: Vec<f64>,
}

impl State {
    /// Elements at `values` with these standard deviations, uncorrelated.
    pub fn new(values: &[f64], sigmas: &[f64]) -> State {
        let mut state = State::default();
        for (value, sigma) in values.iter().zip(sigmas) {
            state.push(*value, sigma * sigma);
        }
        state
    }

    /// The number of elements.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The covariance of two elements.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        self.p[i * self.len() + j]
    }

    /// A row of the covariance.
    pub fn covariance_row(&self, i: usize) -> &[f64] {
        let n = self.len();
        &self.p[i * n..(i + 1) * n]
    }

    /// The standard deviation of an element.
    pub fn sigma(&self, i: usize) -> f64 {
        self.covariance(i, i).max(0.0).sqrt()
    }

    /// Appends an element that is correlated with nothing, and says its index.
    pub fn push(&mut self, value: f64, variance: f64) -> usize {
        let n = self.len();
        let mut p = Vec::with_capacity((n + 1) * (n + 1));
        for row in self.p.chunks_exact(n.max(1)).take(n) {
            p.extend_from_slice(row);
            p.push(0.0);
        }
        p.resize((n + 1) * (n + 1), 0.0);
        p[n * (n + 1) + n] = variance;
        self.p = p;
        self.x.push(value);
        n
    }

    /// Appends `count` elements of zero with this variance; the first one's index.
    pub fn push_many(&mut self, count: usize, variance: f64) -> usize {
        let n = self.len();
        let m = n + count;
        let mut p = vec![0.0; m * m];
        for i in 0..n {
            p[i * m..i * m + n].copy_from_slice(&self.p[i * n..(i + 1) * n]);
        }
        for i in n..m {
            p[i * m + i] = variance;
        }
        self.p = p;
        self.x.resize(m, 0.0);
        n
    }

    /// Keeps the elements at these indices, which ascend, and forgets the others.
    pub fn retain(&mut self, kept: &[usize]) {
        let n = self.len();
        let mut p = Vec::with_capacity(kept.len() * kept.len());
        for &i in kept {
            p.extend(kept.iter().map(|&j| self.p[i * n + j]));
        }
        self.p = p;
        self.x = kept.iter().map(|&i| self.x[i]).collect();
    }

    /// Forgets what is known of an element: it gets this value and variance, correlated with nothing.
    pub fn reset(&mut self, i: usize, value: f64, variance: f64) {
        let n = self.len();
        for j in 0..n {
            self.p[i * n + j] = 0.0;
            self.p[j * n + i] = 0.0;
        }
        self.p[i * n + i] = variance;
        self.x[i] = value;
    }

    /// Adds to the variance of an element.
    pub fn add_variance(&mut self, i: usize, variance: f64) {
        let n = self.len();
        self.p[i * n + i] += variance;
    }

    /// Multiplies an element by a factor and adds to its variance: a bias that fades.
    pub fn fade(&mut self, i: usize, factor: f64, variance: f64) {
        let n = self.len();
        self.x[i] *= factor;
        for j in 0..n {
            self.p[i * n + j] *= factor;
            self.p[j * n + i] *= factor;
        }
        self.p[i * n + i] += variance;
    }

    /// Moves position by velocity over `dt_s`, which may be negative, under an acceleration that is white noise of the densities
    /// `q` (east, north, up, m²/s³).
    pub fn propagate(&mut self, dt_s: f64, q: [f64; 3]) {
        let n = self.len();
        let step = dt_s.abs();
        for (axis, q) in q.into_iter().enumerate() {
            let (i, v) = (POSITION + axis, VELOCITY + axis);
            self.x[i] += dt_s * self.x[v];
            for j in 0..n {
                self.p[i * n + j] += dt_s * self.p[v * n + j];
            }
            for j in 0..n {
                self.p[j * n + i] += dt_s * self.p[j * n + v];
            }
            self.p[i * n + i] += q * step * step * step / 3.0;
            self.p[i * n + v] += q * step * dt_s / 2.0;
            self.p[v * n + i] = self.p[i * n + v];
            self.p[v * n + v] += q * step;
        }
    }

    /// The variance that a row of (index, coefficient) has by the covariance alone: h P h'.
    pub fn row_variance(&self, row: &[(usize, f64)]) -> f64 {
        let mut variance = 0.0;
        for (k, &(i, a)) in row.iter().enumerate() {
            variance += a * a * self.covariance(i, i);
            for &(j, b) in &row[..k] {
                variance += 2.0 * a * b * self.covariance(i, j);
            }
        }
        variance
    }

    /// The value of a row of (index, coefficient).
    pub fn row_value(&self, row: &[(usize, f64)]) -> f64 {
        row.iter().map(|&(i, a)| a * self.x[i]).sum()
    }

    /// Takes one measurement: *measured − expected*, its row, and its variance. Answers the variance of the innovation.
    pub fn update(&mut self, row: &[(usize, f64)], innovation: f64, variance: f64) -> f64 {
        let n = self.len();
        self.gain.clear();
        self.gain.resize(n, 0.0);
        for &(i, a) in row {
            for (g, p) in self.gain.iter_mut().zip(&self.p[i * n..(i + 1) * n]) {
                *g += a * p;
            }
        }
        let total = variance + row.iter().map(|&(i, a)| a * self.gain[i]).sum::<f64>();
        if total <= 0.0 {
            return total;
        }
        // Scaled by the root, so that the product is symmetric to the last bit.
        let root = total.sqrt();
        for g in &mut self.gain {
            *g /= root;
        }
        let step = innovation / root;
        for (x, g) in self.x.iter_mut().zip(&self.gain) {
            *x += g * step;
        }
        for (i, row) in self.p.chunks_exact_mut(n).enumerate() {
            let g_i = self.gain[i];
            if g_i != 0.0 {
                for (p, g) in row.iter_mut().zip(&self.gain) {
                    *p -= g_i * g;
                }
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_one_by_one_give_what_least_squares_gives_at_once() {
        // Two elements with priors 1 and 4, measured as their sum (3, variance 1) and their difference (1, variance 2).
        let mut state = State::new(&[0.0, 0.0], &[1.0, 2.0]);
        for (second, measured, variance) in [(1.0, 3.0, 1.0), (-1.0, 1.0, 2.0)] {
            let row = [(0, 1.0), (1, second)];
            let innovation = measured - state.row_value(&row);
            state.update(&row, innovation, variance);
        }
        // Normal equations by hand: N = [[1+1+.5, 1-.5], [1-.5, .25+1+.5]], b = [3+.5, 3-.5].
        let (a, b, c) = (2.5, 0.5, 1.75);
        let det = a * c - b * b;
        assert!((state.x[0] - (c * 3.5 - b * 2.5) / det).abs() < 1e-12);
        assert!((state.x[1] - (a * 2.5 - b * 3.5) / det).abs() < 1e-12);
        assert!((state.covariance(0, 1) + b / det).abs() < 1e-12);
        assert_eq!(state.covariance(0, 1).to_bits(), state.covariance(1, 0).to_bits());
    }

    #[test]
    fn elements_come_and_go_without_touching_the_others() {
        let mut state = State::new(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]);
        state.update(&[(0, 1.0), (2, 1.0)], 0.5, 1.0);
        let before = (state.x[2], state.covariance(0, 2));
        let first = state.push_many(2, 7.0);
        assert_eq!((first, state.len(), state.covariance(4, 4)), (3, 5, 7.0));
        state.retain(&[0, 2, 4]);
        assert_eq!((state.x[1], state.covariance(0, 1)), before);
    }

    #[test]
    fn there_and_back_again_the_position_is_the_same_and_less_sure() {
        let mut state = State::new(&[0.0, 0.0, 0.0, 1.0, 2.0, 3.0], &[0.1; 6]);
        state.propagate(0.5, [1.0; 3]);
        assert_eq!(state.x[..3], [0.5, 1.0, 1.5]);
        state.propagate(-0.5, [1.0; 3]);
        assert_eq!(state.x[..3], [0.0; 3]);
        assert!(state.covariance(0, 0) > 0.01);
    }
}
