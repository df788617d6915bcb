//! The height's sigma and its settling as formulas: equations (1) to (4) of the [module](super).

use nalgebra::{Matrix2, Vector2};

use super::Setup;

/// Growth of the height's variance by zero velocity alone, m²/s: equation (1).
pub fn drift_m2_s(setup: &Setup) -> f64 {
    let (q, r_s) = (setup.q_m2_s3(), setup.stance_knowledge());
    let stance_s = setup.stride_s * setup.stance_share;
    let swing_s = setup.stride_s - stance_s;
    let kappa = (q * r_s).sqrt();
    let bend = q * swing_s * swing_s / (2.0 * kappa) / libm::tanh(0.5 * kappa * stance_s);
    let bridge = q * swing_s * swing_s * swing_s / 12.0;
    ((stance_s + 2.0 * swing_s) / r_s + bend + bridge) / setup.stride_s
}

/// Sigma of the height once it has settled, m: equation (3).
pub fn sigma_m(setup: &Setup) -> f64 {
    let (drift, r_h) = (drift_m2_s(setup), setup.height_knowledge());
    let epsilon = drift * (r_h / setup.q_m2_s3()).sqrt();
    ((drift / r_h).sqrt() * (1.0 + 2.0 * epsilon).sqrt() / (1.0 + epsilon)).sqrt()
}

/// Variance of the velocity of somebody who stands, m²/s²: zero velocity at every sample.
pub(crate) fn standing_velocity_m2_s2(setup: &Setup) -> f64 {
    (setup.q_m2_s3() / setup.stance_knowledge()).sqrt()
}

/// How the sigma goes to what it settles at: equation (4).
#[derive(Clone, Debug)]
pub struct Settling {
    settled: Matrix2<f64>,
    /// P₀ − P∞.
    excess: Matrix2<f64>,
    closed_loop: Matrix2<f64>,
    /// N of F'N + N F = −diag(r_h, r_v).
    knowledge: Matrix2<f64>,
    /// a and b of the closed loop's λ² + a λ + b.
    polynomial: (f64, f64),
}

/// The sigma counts as settled within this share of its last value.
pub const SETTLED_WITHIN: f64 = 0.1;

/// Times at which the settling is looked at before it is narrowed down.
const STEPS: u32 = 2000;

impl Settling {
    /// From a height of sigma `start_sigma_m`, m, after a standing start.
    pub fn new(setup: &Setup, start_sigma_m: f64) -> Settling {
        let (q, r_h, r_v) = (setup.q_m2_s3(), setup.height_knowledge(), 1.0 / drift_m2_s(setup));
        let b = (q * r_h).sqrt();
        let a = (q * r_v + 2.0 * b).sqrt();
        let p_hv = q.sqrt() / (r_h.sqrt() + r_v * q.sqrt());
        let (p_hh, p_vv) = (a * (1.0 - r_v * p_hv) / r_h, a * p_hv);
        let closed_loop = Matrix2::new(-r_h * p_hh, 1.0 - r_v * p_hv, -r_h * p_hv, -r_v * p_vv);
        let settled = Matrix2::new(p_hh, p_hv, p_hv, p_vv);
        Settling {
            settled,
            excess: Matrix2::new(start_sigma_m * start_sigma_m, 0.0, 0.0, standing_velocity_m2_s2(setup))
                - settled,
            closed_loop,
            knowledge: lyapunov(&closed_loop, &Vector2::new(r_h, r_v)),
            polynomial: (a, b),
        }
    }

    /// Sigma of the height at the time `t_s` after the start, m.
    pub fn sigma_m(&self, t_s: f64) -> f64 {
        let psi = self.transition(t_s);
        let gathered = self.knowledge - psi.transpose() * self.knowledge * psi;
        let taken = Matrix2::identity() + gathered * self.excess;
        // The determinant of 1 + W E is positive as long as the covariance is one.
        let inverse = Matrix2::new(taken[(1, 1)], -taken[(0, 1)], -taken[(1, 0)], taken[(0, 0)])
            / (taken[(0, 0)] * taken[(1, 1)] - taken[(0, 1)] * taken[(1, 0)]);
        let left = psi * self.excess * inverse * psi.transpose();
        (self.settled[(0, 0)] + left[(0, 0)]).max(0.0).sqrt()
    }

    /// From when on the sigma stays within [`SETTLED_WITHIN`] of its last value, s.
    pub fn settled_after_s(&self) -> f64 {
        let last_m = self.settled[(0, 0)].sqrt();
        let outside = |t_s: f64| (self.sigma_m(t_s) / last_m - 1.0).abs() > SETTLED_WITHIN;
        // After 40 times that of the slowest mode nothing is left of any start.
        let horizon_s = 40.0 * self.slowest_mode_s();
        // By even steps of the time's logarithm, from the end: the last one outside.
        let step = |k: u32| horizon_s * libm::pow(1e-7, 1.0 - f64::from(k) / f64::from(STEPS));
        let Some(k) = (0..STEPS).rev().find(|k| outside(step(*k))) else { return 0.0 };
        let (mut early, mut late) = (step(k), step(k + 1));
        for _ in 0..40 {
            let middle = 0.5 * (early + late);
            if outside(middle) {
                early = middle;
            } else {
                late = middle;
            }
        }
        late
    }

    /// In which time the slowest mode of the filter fades to 1/e, s.
    pub(crate) fn slowest_mode_s(&self) -> f64 {
        let (a, b) = self.polynomial;
        let root = (0.25 * a * a - b).max(0.0).sqrt();
        // a/2 − root, without the cancellation.
        (0.5 * a + root) / b
    }

    /// e^{Ft} of a 2×2 F with λ² + a λ + b, by Cayley and Hamilton.
    fn transition(&self, t_s: f64) -> Matrix2<f64> {
        let (a, b) = self.polynomial;
        let half = 0.5 * a;
        let discriminant = half * half - b;
        let size = discriminant.abs().sqrt();
        // c = e^{−at/2} cosh(root t), s = e^{−at/2} sinh(root t)/root; circular where the root is imaginary.
        let (c, s) = if size * t_s < 1e-6 {
            let fade = libm::exp(-half * t_s);
            (fade, fade * t_s)
        } else if discriminant > 0.0 {
            // half − size cancels where the two modes are far apart.
            let slow = libm::exp(-b / (half + size) * t_s);
            let fast = libm::exp(-(half + size) * t_s);
            (0.5 * (slow + fast), 0.5 * (slow - fast) / size)
        } else {
            let (sin, cos) = libm::sincos(size * t_s);
            let fade = libm::exp(-half * t_s);
            (fade * cos, fade * sin / size)
        };
        Matrix2::identity() * c + (self.closed_loop + Matrix2::identity() * half) * s
    }
}

/// N of F'N + N F = −diag(m): three linear equations in closed form.
fn lyapunov(f: &Matrix2<f64>, m: &Vector2<f64>) -> Matrix2<f64> {
    let trace = f[(0, 0)] + f[(1, 1)];
    let determinant = f[(0, 0)] * f[(1, 1)] - f[(0, 1)] * f[(1, 0)];
    // N = −(det F · M + adj(F)' M adj(F)) / (2 · trace F · det F).
    let adjugate = Matrix2::new(f[(1, 1)], -f[(0, 1)], -f[(1, 0)], f[(0, 0)]);
    let m = Matrix2::from_diagonal(m);
    -(m * determinant + adjugate.transpose() * m * adjugate) / (2.0 * trace * determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_setups() -> Vec<Setup> {
        let mut setups = Vec::new();
        for altimeter_sigma_m in [0.001, 0.1, 3.0] {
            for velocity_random_walk_m_s_sqrt_s in [2e-4, 2e-3, 0.03] {
                for altimeter_rate_hz in [1.0, 50.0] {
                    setups.push(Setup {
                        altimeter_sigma_m,
                        velocity_random_walk_m_s_sqrt_s,
                        altimeter_rate_hz,
                        ..Setup::default()
                    });
                }
            }
        }
        setups
    }

    #[test]
    fn the_settled_covariance_solves_the_riccati_equation() {
        for setup in some_setups() {
            let (q, r_h, r_v) = (setup.q_m2_s3(), setup.height_knowledge(), 1.0 / drift_m2_s(&setup));
            let p = Settling::new(&setup, 1.0).settled;
            let (hh, hv, vv) = (p[(0, 0)], p[(0, 1)], p[(1, 1)]);
            let small = |sum: f64, of: f64| assert!((sum / of).abs() < 1e-9, "{setup:?}: {sum} of {of}");
            small(2.0 * hv - r_h * hh * hh - r_v * hv * hv, hv);
            small(vv - r_h * hh * hv - r_v * hv * vv, vv);
            small(q - r_h * hv * hv - r_v * vv * vv, q);
            assert!((hh.sqrt() / sigma_m(&setup) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_drift_solves_its_differential_equation() {
        // The mean of u over a cycle, u'' = q (r u − 1), by shooting from the stance's middle, where the
        // slope is zero, to the swing's middle, where it is zero, too.
        for setup in some_setups() {
            let (q, r_s) = (setup.q_m2_s3(), setup.stance_knowledge());
            let (half_stance_s, half_s) = (0.5 * setup.stride_s * setup.stance_share, 0.5 * setup.stride_s);
            let steps = 40_000;
            let dt = half_s / f64::from(steps);
            let shoot = |u0: f64| {
                let (mut u, mut slope, mut sum) = (u0, 0.0, 0.0);
                for k in 0..steps {
                    let r = if (f64::from(k) + 0.5) * dt < half_stance_s { r_s } else { 0.0 };
                    let middle = u + 0.5 * dt * slope;
                    slope += dt * q * (r * middle - 1.0);
                    u = middle + 0.5 * dt * slope;
                    sum += middle;
                }
                (slope, sum / f64::from(steps))
            };
            // Both are linear in the start value: the slope at the swing's middle must vanish.
            let ((slope_0, mean_0), (slope_1, mean_1)) = (shoot(0.0), shoot(1.0));
            let share = -slope_0 / (slope_1 - slope_0);
            let mean = mean_0 + share * (mean_1 - mean_0);
            let closed = drift_m2_s(&setup);
            assert!((closed / mean - 1.0).abs() < 1e-3, "{setup:?}: {closed} {mean}");
        }
    }

    #[test]
    fn the_limits_are_those_of_the_text() {
        // Dull: the altimeter's sigma and zero velocity's alone.
        let dull = Setup {
            velocity_random_walk_m_s_sqrt_s: 1e-4,
            altimeter_sigma_m: 30.0,
            altimeter_rate_hz: 1.0,
            ..Setup::default()
        };
        let Setup { imu_rate_hz, stance_share, .. } = dull;
        let limit = dull.altimeter_sigma_m * dull.zupt_sigma_m_s / (imu_rate_hz * stance_share).sqrt();
        assert!((sigma_m(&dull) / limit.sqrt() - 1.0).abs() < 0.01);
        // Sharp: zero velocity has no part in it.
        let sharp = Setup { altimeter_sigma_m: 1e-6, ..Setup::default() };
        let limit = 2f64.sqrt() * sharp.q_m2_s3().powf(0.25) * sharp.height_knowledge().powf(-0.75);
        assert!((sigma_m(&sharp).powi(2) / limit - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_settling_solves_the_riccati_equation_in_time() {
        for setup in some_setups() {
            for start_sigma_m in [0.0, 0.3, 5.0] {
                let settling = Settling::new(&setup, start_sigma_m);
                let (q, r_h, r_v) = (setup.q_m2_s3(), setup.height_knowledge(), 1.0 / drift_m2_s(&setup));
                let mut p = settling.settled + settling.excess;
                let rates = |p: &Matrix2<f64>| {
                    let (hh, hv, vv) = (p[(0, 0)], p[(0, 1)], p[(1, 1)]);
                    let off = vv - r_h * hh * hv - r_v * hv * vv;
                    Matrix2::new(
                        2.0 * hv - r_h * hh * hh - r_v * hv * hv,
                        off,
                        off,
                        q - r_h * hv * hv - r_v * vv * vv,
                    )
                };
                // Runge and Kutta, steps that grow from where the start is steepest.
                let (mut t_s, mut compared) = (0.0, 0);
                let fastest = settling.polynomial.0 + r_h * start_sigma_m * start_sigma_m;
                for k in 0..4000 {
                    let dt = 0.02 / (settling.polynomial.0 + r_h * p[(0, 0)]).max(fastest * 1e-12);
                    let k1 = rates(&p);
                    let k2 = rates(&(p + k1 * (0.5 * dt)));
                    let k3 = rates(&(p + k2 * (0.5 * dt)));
                    let k4 = rates(&(p + k3 * dt));
                    p += (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0);
                    t_s += dt;
                    if k % 100 == 0 {
                        let closed = settling.sigma_m(t_s);
                        let relative = closed / p[(0, 0)].sqrt() - 1.0;
                        assert!(relative.abs() < 1e-3, "{setup:?} {start_sigma_m} {t_s}: {relative}");
                        compared += 1;
                    }
                }
                assert_eq!(compared, 40);
            }
        }
    }

    #[test]
    fn it_has_settled_when_it_says_so() {
        for setup in some_setups() {
            for start_sigma_m in [0.0, 1.0, 50.0] {
                let settling = Settling::new(&setup, start_sigma_m);
                let at_s = settling.settled_after_s();
                let last_m = sigma_m(&setup);
                let share = |t_s: f64| (settling.sigma_m(t_s) / last_m - 1.0).abs();
                for k in 1..200 {
                    assert!(share(at_s * (1.0 + 0.1 * f64::from(k))) <= SETTLED_WITHIN + 1e-9);
                }
                assert!(at_s == 0.0 || share(at_s * 0.999) > SETTLED_WITHIN * 0.99);
            }
        }
    }
}
