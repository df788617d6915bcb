//! How good the receivers' observations are: assumed at first, learnt from their own residuals.

use std::collections::{BTreeMap, VecDeque};

use super::arcs::Key;
use super::differences::Difference;
use crate::adjust::variance_components::VarianceComponent;

/// Noise of code and phase of single differences.
#[derive(Clone, Debug)]
pub struct Noise {
    code_sigma_m: f64,
    phase_sigma_m: f64,
    /// Given by the instrument, and not learnt.
    code_given: bool,
    phase_given: bool,
    code: VarianceComponent,
    phase: VarianceComponent,
    /// How alike residuals of code are from one epoch to the next, and from one to the `far`th after it.
    next: Likeness,
    later: Likeness,
    far: usize,
    /// The last `far` residuals of each code, in sigmas, newest last.
    last: BTreeMap<Key, VecDeque<f64>>,
    carried: bool,
}

/// Correlation of residuals a fixed number of epochs apart.
#[derive(Clone, Copy, Debug)]
struct Likeness {
    products: f64,
    squares: f64,
}

impl Likeness {
    fn take(&mut self, before: f64, now: f64) {
        let keep = 1.0 - 1.0 / 3000.0;
        self.products = self.products * keep + now * before;
        self.squares = self.squares * keep + 0.5 * (now * now + before * before);
    }

    fn rho(&self) -> f64 {
        (self.products / self.squares).clamp(0.0, 0.97)
    }
}

/// Epochs this far apart, s, tell multipath that stays for minutes from noise that is a little alike.
const FAR_S: f64 = 10.0;
/// No likeness is followed over more epochs than this: what lasts longer is a bias, and covered by what codes are worth at best.
const LONGEST_PHI: f64 = 0.99;

/// Code and phase of geodetic receivers at the zenith, m; code at its worth when epochs follow each other by the second.
const GEODETIC: [f64; 2] = [0.8, 0.003];
/// Of receivers with one band, m.
const CHEAP: [f64; 2] = [3.0, 0.006];

impl Noise {
    /// Before anything is known but whether receivers have two bands, and what the instrument says.
    pub fn new(
        two_bands: bool,
        given: &super::instrument::Receiver,
        interval_s: f64,
        carried: bool,
    ) -> Noise {
        let [code, phase] = if two_bands { GEODETIC } else { CHEAP };
        // Neighbouring epochs share their multipath: twice as many are not twice as good.
        let dense = if carried { (1.0 / interval_s.clamp(0.05, 1.0)).sqrt() } else { 1.0 };
        Noise {
            code_sigma_m: given.code_sigma_m.unwrap_or(code * dense),
            phase_sigma_m: given.phase_sigma_m.unwrap_or(phase),
            code_given: given.code_sigma_m.is_some(),
            phase_given: given.phase_sigma_m.is_some(),
            code: VarianceComponent::new(10.0, 4000.0, 0.01, 400.0),
            phase: VarianceComponent::new(60.0, 1500.0, 0.5, 50.0),
            next: Likeness { products: 10.0, squares: 20.0 },
            later: Likeness { products: 0.0, squares: 20.0 },
            far: ((FAR_S / interval_s.max(0.05)).round() as usize).clamp(2, 50),
            last: BTreeMap::new(),
            carried,
        }
    }

    /// The same with all variances multiplied.
    pub fn scaled(mut self, factor: f64) -> Noise {
        let root = factor.sqrt();
        self.code_sigma_m *= root;
        self.phase_sigma_m *= root;
        self
    }

    fn shape(difference: &Difference) -> f64 {
        let sin = libm::sin(difference.elevation_rad).max(0.1);
        let weak = if difference.strength_db_hz > 0.0 {
            libm::pow(10.0, f64::from((30.0 - difference.strength_db_hz).max(0.0)) / 10.0)
        } else {
            1.0
        };
        (1.0 + 1.0 / (sin * sin)) * weak
    }

    /// Variance of a difference of code, m².
    pub fn code_variance(&self, difference: &Difference) -> f64 {
        let learnt = self.learnt_of_code();
        self.code_sigma_m * self.code_sigma_m * Noise::shape(difference) * learnt
    }

    /// Variance of a difference of phase, m²; `distance_m` between the stations leaves some of the atmosphere.
    pub fn phase_variance(&self, difference: &Difference, distance_m: f64) -> f64 {
        let learnt = if self.phase_given { 1.0 } else { self.phase.factor().max(1.0) };
        let atmosphere = 1.0e-6 * distance_m;
        (self.phase_sigma_m * self.phase_sigma_m * learnt + atmosphere * atmosphere / 2.0)
            * Noise::shape(difference)
    }

    /// What the variance of code is multiplied by. No code is believed to be better than half a metre over time.
    fn learnt_of_code(&self) -> f64 {
        if self.code_given {
            return 1.0;
        }
        let least = (0.5 / self.code_sigma_m) * (0.5 / self.code_sigma_m);
        (self.code.factor() * self.alike()).max(least.min(1.0))
    }

    /// What stays in a difference of phases from epoch to epoch, m: multipath of a geodetic antenna is as large as the noise itself;
    /// the noise that is assumed of a cheap receiver holds some of it already.
    pub fn lasting_m(&self, difference: &Difference) -> f64 {
        let share = if self.phase_sigma_m > 1.5 * GEODETIC[1] { 0.5 } else { 1.0 };
        share * self.phase_variance(difference, 0.0).sqrt()
    }

    /// What stays of the ionosphere between both stations on this band, m.
    pub fn ionosphere_m(&self, difference: &Difference, distance_m: f64) -> f64 {
        let ratio = difference.wavelength_m / 0.190_3;
        let sin = libm::sin(difference.elevation_rad);
        // The layer at 350 km is met at a steeper angle than the horizon's.
        let slant = 1.0 / (0.3 + 0.7 * sin);
        1.5e-6 * distance_m * slant * ratio * ratio
    }

    /// By how much the variance of code grows as errors of neighbouring epochs are alike: 1 + 2 Σρₖ.
    fn alike(&self) -> f64 {
        if !self.carried {
            return 1.0;
        }
        let (next, later) = (self.next.rho(), self.later.rho());
        // At first nothing is known of it; the sigma that is assumed holds some already.
        let of_neighbours = ((1.0 + next) / (1.0 - next)).max(1.0);
        // Noise beside an error that lasts: ρₖ = a φᵏ, and the neighbours alone would show little of it.
        if later < 0.05 || next <= later {
            return if later < 0.05 { of_neighbours } else { lasting(later, LONGEST_PHI).max(of_neighbours) };
        }
        let phi = libm::pow(later / next, 1.0 / (self.far - 1) as f64).min(LONGEST_PHI);
        lasting(next / phi, phi).max(of_neighbours)
    }

    /// Takes the residual of a code: v, the variance that was assumed, and its share of the redundancy.
    pub fn take_code(&mut self, key: Key, residual_m: f64, variance: f64, redundancy: f64) {
        let assumed = variance / self.learnt_of_code();
        let scaled = residual_m * residual_m / assumed;
        self.code.take(scaled.min(25.0 * self.code.factor()), redundancy);
        // In sigmas as learnt: what is assumed at first must not decide how much a residual says of its likeness to the next.
        let normal = residual_m / (assumed * self.code.factor()).sqrt();
        let of_code = self.last.entry(key).or_default();
        if let Some(before) = of_code.back() {
            self.next.take(*before, normal);
        }
        if of_code.len() == self.far
            && let Some(before) = of_code.pop_front()
        {
            self.later.take(before, normal);
        }
        of_code.push_back(normal);
    }

    /// Takes the squared residual of a phase over its variance, and its share of the redundancy.
    pub fn take_phase(&mut self, residual_m: f64, variance: f64, redundancy: f64) {
        let learnt = if self.phase_given { 1.0 } else { self.phase.factor().max(1.0) };
        let scaled = residual_m * residual_m / variance * learnt;
        self.phase.take(scaled.min(16.0 * self.phase.factor()), redundancy);
    }
}

/// 1 + 2 Σ a φᵏ over all later epochs.
fn lasting(a: f64, phi: f64) -> f64 {
    1.0 + 2.0 * a.min(1.0) * phi / (1.0 - phi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::satellite::{Constellation, Satellite};
    use crate::systems::rover::instrument::Receiver;

    /// Of errors ε + m, white noise beside a first-order Markov process, by how much their sum over a long time is larger than of white ones.
    fn inflation(share_lasting: f64, tau_s: f64) -> f64 {
        let phi = libm::exp(-1.0 / tau_s);
        1.0 + 2.0 * share_lasting * phi / (1.0 - phi)
    }

    fn uniform(dice: &mut u64) -> f64 {
        *dice ^= *dice << 13;
        *dice ^= *dice >> 7;
        *dice ^= *dice << 17;
        (*dice >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn learnt(share_lasting: f64, tau_s: f64, sigma_m: f64) -> Noise {
        let mut noise = Noise::new(false, &Receiver::default(), 1.0, true);
        let phi = libm::exp(-1.0 / tau_s);
        let mut dice = 7_u64;
        let mut normal = || (0..12).map(|_| uniform(&mut dice)).sum::<f64>() - 6.0;
        let mut slow = [0.0; 8];
        for _ in 0..4000 {
            for (number, slow) in (1_u8..).zip(&mut slow) {
                let key = (Satellite { constellation: Constellation::Gps, number }, 0);
                *slow = *slow * phi + normal() * (1.0 - phi * phi).sqrt();
                let error =
                    sigma_m * (share_lasting.sqrt() * *slow + (1.0 - share_lasting).sqrt() * normal());
                let variance = noise.code_sigma_m * noise.code_sigma_m * noise.learnt_of_code();
                noise.take_code(key, error, variance, 1.0);
            }
        }
        noise
    }

    #[test]
    fn codes_whose_errors_last_count_for_less_by_as_much_as_they_last() {
        for (share, tau_s) in [(0.0, 10.0), (0.5, 10.0), (0.6, 30.0), (0.9, 20.0)] {
            for sigma_m in [0.5, 2.0, 6.0] {
                let noise = learnt(share, tau_s, sigma_m);
                let ratio = noise.alike() / inflation(share, tau_s);
                assert!((0.6..1.6).contains(&ratio), "{share} {tau_s} s {sigma_m} m: {ratio}");
            }
        }
    }
}
