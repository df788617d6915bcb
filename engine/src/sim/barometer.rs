//! A barometer: noise of its own, and the day's weather, which all barometers of a carrier share.

use super::random::{Purpose, Random};
use super::triad::digitise;

/// A barometer's errors as heights, each given so that zero means none.
#[derive(Clone, Debug, PartialEq)]
pub struct BarometerModel {
    /// Noise of each reading, m.
    pub noise_m: f64,
    /// Offset of the day's pressure from the standard atmosphere, 1σ, m.
    pub offset_m: f64,
    /// Drift of weather and sensor, m/√s.
    pub drift_m_rts: f64,
    /// Whether readings are rounded to whole steps of 0.01 hPa.
    pub has_steps: bool,
}

/// Least step of a pressure, hPa.
const STEP_HPA: f64 = 0.01;

impl BarometerModel {
    /// Without errors.
    pub fn perfect() -> BarometerModel {
        BarometerModel { noise_m: 0.0, offset_m: 0.0, drift_m_rts: 0.0, has_steps: false }
    }
}

/// One barometer: its errors have been drawn.
#[derive(Clone, Debug)]
pub(crate) struct Barometer {
    noise: Random,
    weather: Random,
    height_error_m: f64,
    drift_step_m: f64,
    model: BarometerModel,
}

impl Barometer {
    /// A barometer that reads so often.
    pub(crate) fn new(model: &BarometerModel, rate_hz: f64, seed: u64, stream: usize) -> Barometer {
        let mut weather = Random::new(seed, Random::COMMON, Purpose::Weather);
        Barometer {
            noise: Random::new(seed, stream, Purpose::BarometerNoise),
            height_error_m: model.offset_m * weather.normal(),
            weather,
            drift_step_m: model.drift_m_rts / libm::sqrt(rate_hz),
            model: model.clone(),
        }
    }

    /// The next reading at a height above the ellipsoid, m; hPa.
    pub(crate) fn read(&mut self, height_m: f64) -> f64 {
        self.height_error_m += self.drift_step_m * self.weather.normal();
        let noise_m = self.model.noise_m * self.noise.normal();
        let hpa = standard_pressure_hpa(height_m + self.height_error_m + noise_m);
        digitise(hpa, f64::INFINITY, self.model.has_steps.then_some(STEP_HPA))
    }
}

/// Pressure of the standard atmosphere at a height, hPa.
fn standard_pressure_hpa(height_m: f64) -> f64 {
    1013.25 * libm::pow(1.0 - height_m / 44_330.0, 5.255)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn height_m(hpa: f64) -> f64 {
        44_330.0 * (1.0 - libm::pow(hpa / 1013.25, 1.0 / 5.255))
    }

    #[test]
    fn two_barometers_share_the_weather_and_not_the_noise() {
        let model = BarometerModel { noise_m: 0.3, offset_m: 20.0, drift_m_rts: 0.1, has_steps: false };
        let (mut offset, mut drift, mut apart) = (0.0, 0.0, 0.0);
        for seed in 0..300 {
            let mut pair = [0, 1].map(|stream| Barometer::new(&model, 10.0, seed, stream));
            let heights: Vec<[f64; 2]> = (0..1000)
                .map(|_| pair.each_mut().map(|barometer| height_m(barometer.read(1100.0)) - 1100.0))
                .collect();
            offset += heights[0][0] * heights[0][0] / 300.0;
            drift += (heights[999][0] - heights[0][0]).powi(2) / 300.0;
            apart += heights.iter().map(|[a, b]| (a - b) * (a - b)).sum::<f64>() / 300_000.0;
        }
        for (found, expected, tolerance) in [
            (offset, 20.0, 0.13),
            // 0.1 m/√s over 100 s, and the noise of both ends.
            (drift, libm::sqrt(1.0 + 2.0 * 0.09), 0.13),
            (apart, 0.3 * std::f64::consts::SQRT_2, 0.01),
        ] {
            let found = libm::sqrt(found);
            assert!((found / expected - 1.0).abs() < tolerance, "{found} m, expected {expected}");
        }
    }

    #[test]
    fn without_errors_the_height_comes_back_and_with_steps_it_is_in_whole_hundredths() {
        let mut perfect = Barometer::new(&BarometerModel::perfect(), 10.0, 1, 0);
        assert!((height_m(perfect.read(1234.5)) - 1234.5).abs() < 1e-6);
        let mut stepped =
            Barometer::new(&BarometerModel { has_steps: true, ..BarometerModel::perfect() }, 10.0, 1, 0);
        let steps = stepped.read(1234.5) * 100.0;
        assert!((steps - libm::round(steps)).abs() < 1e-9);
    }
}
