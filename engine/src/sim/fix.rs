//! Position fixes of a point on a moving body: what a GNSS receiver, a total station or a tag says of it.

use std::ops::Range;

use nalgebra::Vector3;

use super::gauss_markov::GaussMarkov;
use super::motion::Motion;
use super::random::{Purpose, Random};

/// How a source of fixes errs, each error given so that zero means none.
#[derive(Clone, Debug, PartialEq)]
pub struct FixModel {
    /// Fixes per second.
    pub rate_hz: f64,
    /// From the origin of b to the antenna, prism or tag, in b, m.
    pub lever_arm_b_m: [f64; 3],
    /// Error that is new in each fix, 1σ east, north, up, m.
    pub white_sigma_n_m: [f64; 3],
    /// Error that lasts, first-order Gauss-Markov, 1σ east, north, up, m: multipath, atmosphere, base station.
    pub slow_sigma_n_m: [f64; 3],
    /// Its correlation time, s.
    pub slow_time_s: f64,
    /// The sigma that each fix states, east, north, up, m: not always the one it has.
    pub stated_sigma_n_m: [f64; 3],
    /// When there are no fixes, ns: from the first time to before the second. The slow error goes on meanwhile.
    pub outages_ns: Vec<Range<i64>>,
}

/// One position fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Time since the motion's start, ns.
    pub t_ns: i64,
    /// Position of the antenna, prism or tag, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// The sigma that it states, m.
    pub sigma_n_m: [f64; 3],
}

/// The fixes of one source, made as they are asked for.
#[derive(Clone, Debug)]
pub struct FixSource<M> {
    motion: M,
    lever_arm_b_m: Vector3<f64>,
    model: FixModel,
    white: Random,
    slow: GaussMarkov,
    period_ns: i64,
    epoch: i64,
}

impl<M: Motion> FixSource<M> {
    /// The source on a body of this motion. Another `stream` of the same seed errs otherwise, as a second receiver does.
    pub fn new(motion: M, model: &FixModel, seed: u64, stream: usize) -> FixSource<M> {
        let slow = Random::new(seed, stream, Purpose::FixSlowError);
        FixSource {
            motion,
            lever_arm_b_m: Vector3::from(model.lever_arm_b_m),
            white: Random::new(seed, stream, Purpose::FixNoise),
            slow: GaussMarkov::new(model.slow_sigma_n_m, model.slow_time_s, slow),
            period_ns: libm::round(1e9 / model.rate_hz) as i64,
            model: model.clone(),
            epoch: 0,
        }
    }
}

impl<M: Motion> Iterator for FixSource<M> {
    type Item = Fix;

    /// The next fix that is no outage; `None` after the motion's end.
    fn next(&mut self) -> Option<Fix> {
        loop {
            let t_ns = self.epoch * self.period_ns;
            let t_s = t_ns as f64 * 1e-9;
            if t_s > self.motion.end_s() {
                return None;
            }
            // Errors are drawn whether or not there is a fix: an outage does not change those that remain.
            let slow = self.slow.advance(if self.epoch == 0 { 0.0 } else { self.period_ns as f64 * 1e-9 });
            let white = self.white.normal_3();
            self.epoch += 1;
            if self.model.outages_ns.iter().any(|outage| outage.contains(&t_ns)) {
                continue;
            }
            let place = self.motion.at(t_s).at_lever_arm(&self.lever_arm_b_m).position_n_m;
            let error = |axis: usize| slow[axis] + self.model.white_sigma_n_m[axis] * white[axis];
            return Some(Fix {
                t_ns,
                position_n_m: std::array::from_fn(|axis| place[axis] + error(axis)),
                sigma_n_m: self.model.stated_sigma_n_m,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::motion::tests::Tumbling;
    use super::*;

    /// RTK at 5 Hz on a mast.
    fn rtk() -> FixModel {
        FixModel {
            rate_hz: 5.0,
            lever_arm_b_m: [0.1, -0.2, 1.5],
            white_sigma_n_m: [0.003, 0.003, 0.006],
            slow_sigma_n_m: [0.008, 0.008, 0.016],
            slow_time_s: 40.0,
            stated_sigma_n_m: [0.01, 0.01, 0.02],
            outages_ns: Vec::new(),
        }
    }

    fn fixes(model: &FixModel, seed: u64, stream: usize) -> Vec<Fix> {
        FixSource::new(Tumbling, model, seed, stream).collect()
    }

    fn true_place(model: &FixModel, fix: &Fix) -> Vector3<f64> {
        Tumbling.at(fix.t_ns as f64 * 1e-9).at_lever_arm(&Vector3::from(model.lever_arm_b_m)).position_n_m
    }

    #[test]
    fn without_errors_a_fix_is_the_place_of_the_antenna_at_its_time() {
        let none = [0.0; 3];
        let model = FixModel { white_sigma_n_m: none, slow_sigma_n_m: none, ..rtk() };
        let all = fixes(&model, 1, 0);
        assert_eq!(all.len(), 101, "20 s at 5 Hz, both ends included");
        for (k, fix) in all.iter().enumerate() {
            assert_eq!(fix.t_ns, 200_000_000 * k as i64);
            assert_eq!(Vector3::from(fix.position_n_m), true_place(&model, fix));
            assert_eq!(fix.sigma_n_m, model.stated_sigma_n_m);
        }
    }

    #[test]
    fn white_and_slow_errors_have_their_sigmas_over_the_seeds() {
        let model = rtk();
        let (mut squares, mut step_squares, mut count, mut steps) = ([0.0; 3], [0.0; 3], 0.0, 0.0);
        for seed in 0..120 {
            let errors: Vec<Vector3<f64>> = fixes(&model, seed, 0)
                .iter()
                .map(|fix| Vector3::from(fix.position_n_m) - true_place(&model, fix))
                .collect();
            for axis in 0..3 {
                squares[axis] += errors.iter().map(|error| error[axis] * error[axis]).sum::<f64>();
                step_squares[axis] +=
                    errors.windows(2).map(|w| (w[1][axis] - w[0][axis]).powi(2)).sum::<f64>();
            }
            count += errors.len() as f64;
            steps += (errors.len() - 1) as f64;
        }
        for axis in 0..3 {
            // The slow error hardly changes in 20 s: 120 seeds are 120 draws of it, and 3σ of their sigma is 20 %.
            let (white, slow) = (model.white_sigma_n_m[axis], model.slow_sigma_n_m[axis]);
            let sigma = libm::sqrt(squares[axis] / count);
            assert!((sigma / libm::hypot(white, slow) - 1.0).abs() < 0.2, "axis {axis}: {sigma} m");
            // From fix to fix it is nearly all white: 2 σ², and 2 σ_s² (1 − e^(−0.2/40)) by the slow one.
            let step = libm::sqrt(step_squares[axis] / steps);
            let expected =
                libm::sqrt(2.0 * white * white - 2.0 * slow * slow * libm::expm1(-0.2 / model.slow_time_s));
            assert!((step / expected - 1.0).abs() < 0.03, "axis {axis}: {step} m, expected {expected}");
        }
    }

    #[test]
    fn an_outage_takes_fixes_away_and_leaves_the_others_to_the_bit() {
        let outages_ns = vec![3_000_000_000..5_000_000_000, 19_000_000_000..i64::MAX];
        let (whole, cut) =
            (fixes(&rtk(), 7, 0), fixes(&FixModel { outages_ns: outages_ns.clone(), ..rtk() }, 7, 0));
        let mut left = whole;
        left.retain(|fix| !outages_ns.iter().any(|outage| outage.contains(&fix.t_ns)));
        assert_eq!(left.len(), 85);
        assert_eq!(cut, left);
    }

    #[test]
    fn another_stream_is_another_receiver_and_the_same_seed_gives_the_same_fixes() {
        assert_eq!(fixes(&rtk(), 5, 0), fixes(&rtk(), 5, 0));
        let (first, second) = (fixes(&rtk(), 5, 0), fixes(&rtk(), 5, 3));
        assert!(first.iter().zip(&second).all(|(a, b)| a.position_n_m != b.position_n_m));
    }
}
