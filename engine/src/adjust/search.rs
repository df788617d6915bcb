//! The two best whole vectors of decorrelated ambiguities: depth first, nearest first, within an ellipsoid that shrinks to the second
//! best found (Chang, Yang, Zhou 2005).

use nalgebra::DMatrix;

/// A whole vector and its squared norm.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) z: Vec<f64>,
    pub(super) norm: f64,
}

/// The two vectors nearest to `a` in the norm of (L' D L)⁻¹, best first; none where the search takes more than `most_steps`.
pub(super) fn two_best(l: &DMatrix<f64>, d: &[f64], a: &[f64], most_steps: usize) -> Option<[Candidate; 2]> {
    let n = a.len();
    let mut best: Vec<Candidate> = Vec::with_capacity(3);
    let mut bound = f64::INFINITY;
    // What the ambiguities behind k move those before by, row by row; nothing moves by the last row.
    let mut shifts = DMatrix::<f64>::zeros(n, n);
    let mut conditional = vec![0.0; n];
    let mut z = vec![0.0; n];
    let mut step = vec![0.0; n];
    let mut norm = vec![0.0; n + 1];
    let mut k = n - 1;
    let begin = |k: usize, conditional: &[f64], z: &mut [f64], step: &mut [f64]| {
        z[k] = libm::round(conditional[k]);
        step[k] = if conditional[k] < z[k] { -1.0 } else { 1.0 };
        conditional[k] - z[k]
    };
    conditional[k] = a[k];
    let mut off = begin(k, &conditional, &mut z, &mut step);
    for _ in 0..most_steps {
        let so_far = norm[k + 1] + off * off / d[k];
        if so_far < bound {
            if k > 0 {
                norm[k] = so_far;
                let here = z[k] - conditional[k];
                for j in 0..k {
                    shifts[(k - 1, j)] = shifts[(k, j)] + here * l[(k, j)];
                }
                k -= 1;
                conditional[k] = a[k] + shifts[(k, k)];
                off = begin(k, &conditional, &mut z, &mut step);
                continue;
            }
            best.push(Candidate { z: z.clone(), norm: so_far });
            best.sort_by(|p, q| p.norm.total_cmp(&q.norm));
            best.truncate(2);
            if best.len() == 2 {
                bound = best[1].norm;
            }
        } else {
            if k == n - 1 {
                let second = best.pop()?;
                return Some([best.pop()?, second]);
            }
            k += 1;
        }
        // The next nearest on the other side.
        z[k] += step[k];
        step[k] = -step[k] - if step[k] > 0.0 { 1.0 } else { -1.0 };
        off = conditional[k] - z[k];
    }
    None
}
