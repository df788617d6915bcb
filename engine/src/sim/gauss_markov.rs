//! An error that wanders and comes back: the first-order Gauss-Markov process, ẋ = −x/τ + white noise.

use super::random::Random;

/// The error on three axes, independent of each other. Stationary: it has its sigma from the start.
#[derive(Clone, Debug)]
pub(crate) struct GaussMarkov {
    sigma: [f64; 3],
    correlation_time_s: f64,
    value: [f64; 3],
    random: Random,
}

impl GaussMarkov {
    /// Begins somewhere in its distribution. `sigma` is that of each axis; the correlation has fallen to 1/e after
    /// `correlation_time_s`.
    pub(crate) fn new(sigma: [f64; 3], correlation_time_s: f64, mut random: Random) -> GaussMarkov {
        let draw = random.normal_3();
        let value = std::array::from_fn(|axis| sigma[axis] * draw[axis]);
        GaussMarkov { sigma, correlation_time_s, value, random }
    }

    /// The error after so much more time, s: the exact transition, whatever the interval.
    pub(crate) fn advance(&mut self, interval_s: f64) -> [f64; 3] {
        let kept = libm::exp(-interval_s / self.correlation_time_s);
        let new = libm::sqrt(-libm::expm1(-2.0 * interval_s / self.correlation_time_s));
        let draw = self.random.normal_3();
        self.value =
            std::array::from_fn(|axis| kept * self.value[axis] + new * self.sigma[axis] * draw[axis]);
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Purpose;
    use super::*;

    #[test]
    fn it_keeps_its_sigma_and_forgets_with_its_time() {
        // 200 seeds, three axes: 3σ of a sample sigma is 9 %, of a correlation 0.12.
        let (mut ends, mut products) = (0.0, 0.0);
        for seed in 0..200 {
            let random = Random::new(seed, 0, Purpose::FixSlowError);
            let mut process = GaussMarkov::new([2.0; 3], 30.0, random);
            let begin = process.advance(0.0);
            // Half the time in steps of 0.2 s, the other half in one.
            for _ in 0..75 {
                process.advance(0.2);
            }
            let end = process.advance(15.0);
            for axis in 0..3 {
                ends += end[axis] * end[axis] / 600.0;
                products += begin[axis] * end[axis] / 600.0;
            }
        }
        assert!((libm::sqrt(ends) / 2.0 - 1.0).abs() < 0.09, "sigma {}", libm::sqrt(ends));
        assert!((products / 4.0 - libm::exp(-1.0)).abs() < 0.12, "correlation {}", products / 4.0);
    }

    #[test]
    fn without_time_it_does_not_move_and_without_sigma_it_is_not_there() {
        let random = || Random::new(3, 0, Purpose::FixSlowError);
        let mut process = GaussMarkov::new([1.0, 0.0, 3.0], 10.0, random());
        let first = process.advance(0.0);
        assert_eq!(process.advance(0.0), first);
        assert!(first[0] != 0.0 && first[1] == 0.0 && process.advance(5.0)[1] == 0.0);
    }
}
