//! How good the receivers' observations are: assumed at first, learnt from their own residuals.

use std::collections::BTreeMap;

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
    /// How alike residuals of neighbouring epochs are: sums of products and of squares.
    products: f64,
    squares: f64,
    last: BTreeMap<Key, f64>,
    carried: bool,
}

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
            products: 10.0,
            squares: 20.0,
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

    /// By how much the variance of code grows as errors of neighbouring epochs are alike: (1 + ρ) / (1 − ρ).
    fn alike(&self) -> f64 {
        if !self.carried {
            return 1.0;
        }
        let rho = (self.products / self.squares).clamp(0.0, 0.97);
        // At first nothing is known of it; the sigma that is assumed holds some already.
        ((1.0 + rho) / (1.0 - rho)).max(1.0)
    }

    /// Takes the residual of a code: v, the variance that was assumed, and its share of the redundancy.
    pub fn take_code(&mut self, key: Key, residual_m: f64, variance: f64, redundancy: f64) {
        let assumed =
            variance / if self.code_given { 1.0 } else { (self.code.factor() * self.alike()).max(0.4) };
        let scaled = residual_m * residual_m / assumed;
        self.code.take(scaled.min(25.0 * self.code.factor()), redundancy);
        let normal = residual_m / assumed.sqrt();
        if let Some(before) = self.last.insert(key, normal) {
            let keep = 1.0 - 1.0 / 3000.0;
            self.products = self.products * keep + normal * before;
            self.squares = self.squares * keep + 0.5 * (normal * normal + before * before);
        }
    }

    /// Takes the squared residual of a phase over its variance, and its share of the redundancy.
    pub fn take_phase(&mut self, residual_m: f64, variance: f64, redundancy: f64) {
        let learnt = if self.phase_given { 1.0 } else { self.phase.factor().max(1.0) };
        let scaled = residual_m * residual_m / variance * learnt;
        self.phase.take(scaled.min(16.0 * self.phase.factor()), redundancy);
    }
}
