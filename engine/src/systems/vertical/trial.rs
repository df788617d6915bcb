//! The filter at work on drawn noise: whether its errors are as large as its covariance says.

use super::riccati::Riccati;

/// Gait cycles of one trial.
const CYCLES: f64 = 10.0;

/// Errors of the height over one stretch of walking, as the mean of their squares, m².
///
/// `settled` is the filter after [`Riccati::settle`]; the errors begin as its covariance says. `normal`
/// draws independent standard normals.
pub fn mean_square_m2(settled: &Riccati, normal: &mut impl FnMut() -> f64) -> f64 {
    let setup = *settled.setup();
    let mut filter = settled.clone();
    let (p_hh, p_hv, p_vv) = filter.covariance();
    let first = normal();
    let mut height_m = p_hh.sqrt() * first;
    let mut velocity_m_s =
        p_hv / p_hh.sqrt() * first + (p_vv - p_hv * p_hv / p_hh).max(0.0).sqrt() * normal();
    let dt_s = 1.0 / setup.imu_rate_hz;
    let walk = setup.velocity_random_walk_m_s_sqrt_s * dt_s.sqrt();
    let samples = (CYCLES * setup.stride_s * setup.imu_rate_hz).ceil() as u64;
    let mut sum = 0.0;
    for _ in 0..samples {
        // White noise of the acceleration over the interval moves velocity and height together.
        let (pushed, early) = (normal(), normal());
        height_m += dt_s * velocity_m_s + walk * dt_s * (0.5 * pushed + early / 12f64.sqrt());
        velocity_m_s += walk * pushed;
        let gains = filter.step();
        if let Some([to_h, to_v]) = gains.zero_velocity {
            let innovation = velocity_m_s + setup.zupt_sigma_m_s * normal();
            height_m -= to_h * innovation;
            velocity_m_s -= to_v * innovation;
        }
        if let Some([to_h, to_v]) = gains.altimeter {
            let innovation = height_m + setup.altimeter_sigma_m * normal();
            height_m -= to_h * innovation;
            velocity_m_s -= to_v * innovation;
        }
        sum += height_m * height_m;
    }
    sum / samples as f64
}

/// Root mean square of the height's error over so many trials, m.
pub fn rms_m(settled: &Riccati, trials: u32, normal: &mut impl FnMut() -> f64) -> f64 {
    let sum: f64 = (0..trials).map(|_| mean_square_m2(settled, normal)).sum();
    (sum / f64::from(trials)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::vertical::Setup;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn the_errors_of_many_seeds_are_as_large_as_the_sigma() {
        // 600 trials tell a sigma to 1/√1200 = 3 % where the error lasts as long as a trial.
        for (altimeter_sigma_m, altimeter_rate_hz) in
            [(0.001, 20.0), (0.05, 20.0), (1.0, 20.0), (0.1, 1.0), (0.1, 100.0)]
        {
            let setup = Setup { altimeter_sigma_m, altimeter_rate_hz, ..Setup::default() };
            let mut filter = Riccati::new(&setup, 1.0);
            let sigma_m = filter.settle().unwrap().rms_m;
            let mut random = Pcg64Mcg::new(1);
            let rms_m = rms_m(&filter, 600, &mut || StandardNormal.sample(&mut random));
            assert!((rms_m / sigma_m - 1.0).abs() < 0.1, "{setup:?}: {rms_m} m, sigma {sigma_m} m");
        }
    }
}
