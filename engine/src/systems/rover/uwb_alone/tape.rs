//! What a filter did, and its errors by all of the ranges: the modified Bryson–Frazier smoother, which goes back over
//! the updates and needs no inverse.

/// One thing that a filter did.
#[derive(Clone, Debug)]
pub(super) enum Entry {
    /// A step in time: x_k ← decay_k x_k, and positions go along with velocities.
    Step { decay: Vec<f64>, along: [f64; 3] },
    /// A range was weighed with this row, P Hᵀ, innovation variance and innovation.
    Range { row: [(usize, f64); 8], gain_times_s: Vec<f64>, s: f64, innovation_m: f64 },
    /// Position and velocity were found anew: what came later says nothing of them earlier.
    Restart,
    /// A point was told: its position and the rows of the covariance.
    Point { number: usize, p_n: [f64; 3], rows: [Vec<f64>; 3] },
}

/// What a filter did, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    entries: Vec<Entry>,
}

/// A position by all of the ranges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smoothed {
    /// Which point.
    pub(super) number: usize,
    /// Its position, m.
    pub(super) p_n: [f64; 3],
    /// Its covariance, m².
    pub(super) covariance: [[f64; 3]; 3],
}

impl Tape {
    pub(super) fn push(&mut self, entry: Entry) {
        self.entries.push(entry);
    }

    /// The points by all of the ranges, the last first; `n` is the number of states.
    pub(super) fn smooth(&self, n: usize) -> Vec<Smoothed> {
        let mut lambda = vec![0.0; n];
        let mut information = vec![0.0; n * n];
        let mut out = Vec::new();
        for entry in self.entries.iter().rev() {
            match entry {
                Entry::Point { number, p_n, rows } => {
                    out.push(point(*number, p_n, rows, &lambda, &information, n));
                }
                Entry::Range { row, gain_times_s, s, innovation_m } => {
                    update_back(row, gain_times_s, *s, *innovation_m, &mut lambda, &mut information, n);
                }
                Entry::Step { decay, along } => step_back(decay, along, &mut lambda, &mut information, n),
                Entry::Restart => {
                    for k in 0..6 {
                        lambda[k] = 0.0;
                        for j in 0..n {
                            information[k * n + j] = 0.0;
                            information[j * n + k] = 0.0;
                        }
                    }
                }
            }
        }
        out
    }
}

/// x + P λ and P − P Λ P, for the position.
fn point(
    number: usize,
    p_n: &[f64; 3],
    rows: &[Vec<f64>; 3],
    lambda: &[f64],
    information: &[f64],
    n: usize,
) -> Smoothed {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let turned: [Vec<f64>; 3] =
        std::array::from_fn(|k| (0..n).map(|j| dot(&information[j * n..(j + 1) * n], &rows[k])).collect());
    Smoothed {
        number,
        p_n: std::array::from_fn(|k| p_n[k] + dot(&rows[k], lambda)),
        covariance: std::array::from_fn(|i| std::array::from_fn(|j| rows[i][j] - dot(&rows[i], &turned[j]))),
    }
}

/// λ ← Hᵀ ν / S + (I − K H)ᵀ λ, Λ ← Hᵀ H / S + (I − K H)ᵀ Λ (I − K H).
fn update_back(
    row: &[(usize, f64); 8],
    gain_times_s: &[f64],
    s: f64,
    innovation_m: f64,
    lambda: &mut [f64],
    information: &mut [f64],
    n: usize,
) {
    let gain_lambda: f64 = gain_times_s.iter().zip(lambda.iter()).map(|(g, l)| g * l).sum::<f64>() / s;
    let mut gain_information = vec![0.0; n];
    for (value, row) in gain_information.iter_mut().zip(information.chunks_exact(n)) {
        *value = row.iter().zip(gain_times_s).map(|(i, g)| i * g).sum::<f64>() / s;
    }
    let gain_twice: f64 = gain_information.iter().zip(gain_times_s).map(|(i, g)| i * g).sum::<f64>() / s;
    for (k, h) in row {
        lambda[*k] += h * (innovation_m / s - gain_lambda);
    }
    for (k, h) in row {
        for j in 0..n {
            information[k * n + j] -= h * gain_information[j];
            information[j * n + k] -= h * gain_information[j];
        }
    }
    for (i, hi) in row {
        for (j, hj) in row {
            information[i * n + j] += hi * hj * (1.0 / s + gain_twice);
        }
    }
}

/// λ ← Fᵀ λ, Λ ← Fᵀ Λ F.
fn step_back(decay: &[f64], along: &[f64; 3], lambda: &mut [f64], information: &mut [f64], n: usize) {
    for k in 0..3 {
        lambda[3 + k] = along[k] * lambda[k] + decay[3 + k] * lambda[3 + k];
        lambda[k] *= decay[k];
    }
    for k in 6..n {
        lambda[k] *= decay[k];
    }
    for row in information.chunks_exact_mut(n) {
        for k in 0..3 {
            row[3 + k] = along[k] * row[k] + decay[3 + k] * row[3 + k];
            row[k] *= decay[k];
        }
        for k in 6..n {
            row[k] *= decay[k];
        }
    }
    for j in 0..n {
        for k in 0..3 {
            information[(3 + k) * n + j] =
                along[k] * information[k * n + j] + decay[3 + k] * information[(3 + k) * n + j];
            information[k * n + j] *= decay[k];
        }
        for k in 6..n {
            information[k * n + j] *= decay[k];
        }
    }
}
