//! Integer least squares: the whole vector nearest to a float one in the norm of its covariance, the second nearest, and how likely
//! rounding one after the other would be right.

use nalgebra::{DMatrix, DVector};

use super::reduction::{Reduced, reduce};
use super::search::two_best;

/// The two best whole vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Integers {
    /// The nearest.
    pub best: Vec<f64>,
    /// The second nearest.
    pub second: Vec<f64>,
    /// Squared norms of both.
    pub norms: [f64; 2],
    /// Probability that sequential rounding of the decorrelated vector is right: a lower bound of that of the nearest.
    pub success: f64,
}

impl Integers {
    /// The second norm over the first; the greater the clearer.
    pub fn ratio(&self) -> f64 {
        if self.norms[0] > 0.0 { self.norms[1] / self.norms[0] } else { f64::INFINITY }
    }
}

/// Why there are no whole vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IntegersError {
    /// Nothing to do.
    #[error("expected at least one ambiguity, found none")]
    Empty,
    /// Sizes that do not fit, or numbers that are none.
    #[error(
        "expected a covariance with as many rows and columns as there are ambiguities, all of them finite numbers"
    )]
    Shape,
    /// Not a covariance.
    #[error("expected a positive definite covariance; found one that is not")]
    NotPositive,
    /// The search was given up.
    #[error("the covariance is too wide to search in reasonable time; expected sigmas of fewer cycles")]
    TooWide,
}

/// Steps after which a search gives up: thousands of times what honest problems take.
const MOST_STEPS: usize = 5_000_000;

/// Finds the two best whole vectors of `a` with covariance `q`.
///
/// # Errors
///
/// See [`IntegersError`].
pub fn integers(a: &[f64], q: &DMatrix<f64>) -> Result<Integers, IntegersError> {
    integers_within(a, q, MOST_STEPS)
}

/// The same, giving up after so many steps of the search: what contradicts its covariance is far from every whole vector.
///
/// # Errors
///
/// See [`IntegersError`].
pub fn integers_within(a: &[f64], q: &DMatrix<f64>, most_steps: usize) -> Result<Integers, IntegersError> {
    let n = a.len();
    if n == 0 {
        return Err(IntegersError::Empty);
    }
    if q.nrows() != n || q.ncols() != n || a.iter().chain(q.iter()).any(|value| !value.is_finite()) {
        return Err(IntegersError::Shape);
    }
    let reduced = reduce(q).ok_or(IntegersError::NotPositive)?;
    // Near zero, so that large counts of cycles lose no digits.
    let whole: Vec<f64> = a.iter().map(|value| libm::round(*value)).collect();
    let rest = DVector::from_iterator(n, a.iter().zip(&whole).map(|(value, whole)| value - whole));
    let z = &reduced.z_t * rest;
    let [first, second] =
        two_best(&reduced.l, &reduced.d, z.as_slice(), most_steps).ok_or(IntegersError::TooWide)?;
    let back = reduced.z_t.clone().lu();
    let to_cycles = |z: Vec<f64>| -> Result<Vec<f64>, IntegersError> {
        let solved = back.solve(&DVector::from_vec(z)).ok_or(IntegersError::NotPositive)?;
        Ok(solved.iter().zip(&whole).map(|(value, whole)| libm::round(*value) + whole).collect())
    };
    let success = bootstrapped(&reduced);
    Ok(Integers {
        norms: [first.norm, second.norm],
        best: to_cycles(first.z)?,
        second: to_cycles(second.z)?,
        success,
    })
}

/// Probability that sequential rounding is right, without searching; none of a covariance that is not positive.
pub fn success_rate(q: &DMatrix<f64>) -> Option<f64> {
    reduce(q).map(|reduced| bootstrapped(&reduced))
}

fn bootstrapped(reduced: &Reduced) -> f64 {
    // 2 Φ(1 / 2σ) − 1 of each conditional variance.
    reduced.d.iter().map(|d| libm::erf(0.5 / (2.0 * d).sqrt())).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A covariance of n ambiguities, strongly correlated as those of one epoch are, from a counted seed.
    fn problem(n: usize, seed: u64) -> (Vec<f64>, DMatrix<f64>) {
        let mut state = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let directions = DMatrix::from_fn(n, 3, |_, _| draw());
        let mut q = &directions * directions.transpose() * 4.0;
        for k in 0..n {
            q[(k, k)] += 0.02 + 0.05 * (draw() + 0.5);
        }
        (DVector::from_fn(n, |_, _| 40.0 * draw()).as_slice().to_vec(), q)
    }

    fn norm(a: &[f64], z: &[f64], inverse: &DMatrix<f64>) -> f64 {
        let v = DVector::from_iterator(a.len(), a.iter().zip(z).map(|(a, z)| a - z));
        (v.transpose() * inverse * &v)[(0, 0)]
    }

    #[test]
    fn brute_force_finds_nothing_better_and_the_same_second() {
        for n in 2..=4 {
            for seed in 0..12 {
                let (a, q) = problem(n, seed);
                let found = integers(&a, &q).unwrap();
                let inverse = q.clone().try_inverse().unwrap();
                // Every whole vector that could be as near as the second has |a − z| ≤ √(norm · variance) in each element.
                let span: Vec<(i64, i64)> = (0..n)
                    .map(|k| {
                        let reach = (found.norms[1] * q[(k, k)]).sqrt() + 1e-9;
                        ((a[k] - reach).ceil() as i64, (a[k] + reach).floor() as i64)
                    })
                    .collect();
                let mut norms = Vec::new();
                let mut z: Vec<i64> = span.iter().map(|(low, _)| *low).collect();
                'all: loop {
                    norms.push(norm(&a, &z.iter().map(|z| *z as f64).collect::<Vec<_>>(), &inverse));
                    for k in 0..n {
                        z[k] += 1;
                        if z[k] <= span[k].1 {
                            continue 'all;
                        }
                        z[k] = span[k].0;
                    }
                    break;
                }
                norms.sort_by(f64::total_cmp);
                assert!((norms[0] - found.norms[0]).abs() < 1e-8 * (1.0 + norms[0]), "n {n}, seed {seed}");
                assert!((norms[1] - found.norms[1]).abs() < 1e-8 * (1.0 + norms[1]), "n {n}, seed {seed}");
                assert!((norm(&a, &found.best, &inverse) - found.norms[0]).abs() < 1e-8 * (1.0 + norms[0]));
                assert!((norm(&a, &found.second, &inverse) - found.norms[1]).abs() < 1e-8 * (1.0 + norms[1]));
            }
        }
    }

    #[test]
    fn what_is_published_of_lambda_is_met() {
        // Teunissen's example of three ambiguities (The LAMBDA method, LGR series 12, 1996).
        let q =
            DMatrix::from_row_slice(3, 3, &[6.290, 5.978, 0.544, 5.978, 6.292, 2.340, 0.544, 2.340, 6.288]);
        let found = integers(&[5.450, 3.100, 2.970], &q).unwrap();
        assert_eq!(found.best, [5.0, 3.0, 4.0]);
        assert_eq!(found.second, [6.0, 4.0, 4.0]);
        assert!(
            (found.norms[0] - 0.218_331).abs() < 1e-4 && (found.norms[1] - 0.307_273).abs() < 1e-4,
            "{:?}",
            found.norms
        );
    }

    #[test]
    fn one_ambiguity_is_rounded_and_its_success_is_the_normal_integral() {
        let found = integers(&[1_000_000_000.3], &DMatrix::from_element(1, 1, 0.01)).unwrap();
        assert_eq!((found.best[0], found.second[0]), (1_000_000_000.0, 1_000_000_001.0));
        // 2 Φ(5) − 1.
        assert!((found.success - 0.999_999_426_7).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_covariance_is_named() {
        let q = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert_eq!(integers(&[0.1, 0.2], &q), Err(IntegersError::NotPositive));
        assert_eq!(integers(&[0.1], &q), Err(IntegersError::Shape));
        assert_eq!(integers(&[], &DMatrix::zeros(0, 0)), Err(IntegersError::Empty));
    }
}
