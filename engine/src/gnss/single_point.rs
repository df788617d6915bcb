//! A station's place by its own code: where linearisation starts, and what is left without a base.

use nalgebra::{DMatrix, DVector, Vector3};

use super::ephemeris::Navigation;
use super::geometry::{at_transmission, azimuth_elevation, sight};
use super::observations::Epoch;
use super::satellite::Constellation;
use super::signal::{bands, frequency_hz, preference};
use super::{ionosphere, troposphere};
use crate::geo::{Geodetic, LocalFrame};

/// A place by code alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SinglePoint {
    /// Earth-centred, m.
    pub p_e: Vector3<f64>,
    /// Standard deviations east, north, up, m.
    pub sigma_n_m: [f64; 3],
    /// Satellites used.
    pub satellites: usize,
    /// Root of the mean squared residual, m.
    pub rms_m: f64,
}

/// Standard deviation of code at the zenith, atmosphere and orbits included, m.
const SIGMA_M: f64 = 2.0;
/// Below, satellites are left out, rad.
const MASK: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// The place of a receiver at an epoch; none with too few satellites, or where they contradict each other.
pub fn locate(epoch: &Epoch, navigation: &Navigation, near: Option<Vector3<f64>>) -> Option<SinglePoint> {
    let mut seen = Vec::new();
    for tracked in &epoch.satellites {
        let constellation = tracked.satellite.constellation;
        let signals = epoch.signals_of(tracked);
        let best = bands(constellation).iter().find_map(|&band| {
            let of_band = signals.iter().filter(|signal| signal.band == band && signal.code_m != 0.0);
            of_band.max_by_key(|signal| preference(constellation, band, signal.attribute))
        });
        let (Some(signal), Some(ephemeris)) = (best, navigation.nearest(tracked.satellite, epoch.time))
        else {
            continue;
        };
        let state = at_transmission(ephemeris, epoch.time, signal.code_m);
        let hz = frequency_hz(constellation, signal.band).unwrap_or(1.0);
        seen.push((constellation, signal.code_m, state, (1_575.42e6 / hz) * (1_575.42e6 / hz)));
    }
    let mut dropped = vec![false; seen.len()];
    let mut at = near.unwrap_or_default();
    // The worst satellite is left out, as long as enough remain and something is far off.
    for _ in 0..4 {
        let (found, worst) = adjust(&seen, &dropped, at, epoch, navigation)?;
        at = found.p_e;
        match worst {
            Some(worst) => dropped[worst] = true,
            None => return (found.rms_m < 30.0).then_some(found),
        }
    }
    None
}

type Seen = (Constellation, f64, super::ephemeris::SatelliteState, f64);

fn adjust(
    seen: &[Seen],
    dropped: &[bool],
    start: Vector3<f64>,
    epoch: &Epoch,
    navigation: &Navigation,
) -> Option<(SinglePoint, Option<usize>)> {
    let mut p_e = start;
    let mut clocks = [0.0; 4];
    for round in 0..12 {
        let high = p_e.norm() > 6.0e6;
        let place = Geodetic::from_ecef_m(p_e.into());
        let c_ne = LocalFrame::new(place).c_ne();
        let mut rows = Vec::new();
        for (k, (constellation, code_m, state, iono_scale)) in seen.iter().enumerate() {
            if dropped[k] {
                continue;
            }
            let line = sight(&state.p_e, &p_e);
            let (azimuth, elevation) = azimuth_elevation(&line.to_satellite_e, &c_ne);
            let mut expected = line.range_m - super::signal::LIGHT_M_S * state.clock_s;
            let mut sigma = SIGMA_M;
            if high {
                if elevation < MASK {
                    continue;
                }
                expected += troposphere::delay_m(place, elevation);
                if let Some(coefficients) = &navigation.klobuchar {
                    expected +=
                        iono_scale * ionosphere::delay_m(coefficients, epoch.time, place, azimuth, elevation);
                }
                sigma = SIGMA_M / libm::sin(elevation);
            }
            rows.push((k, *constellation, line.to_satellite_e, code_m - expected, sigma));
        }
        let mut systems: Vec<usize> = rows.iter().map(|row| row.1.index()).collect();
        systems.sort_unstable();
        systems.dedup();
        let unknowns = 3 + systems.len();
        if rows.len() < unknowns {
            return None;
        }
        let mut a = DMatrix::zeros(rows.len(), unknowns);
        let mut b = DVector::zeros(rows.len());
        for (r, (_, constellation, unit, innovation, sigma)) in rows.iter().enumerate() {
            for axis in 0..3 {
                a[(r, axis)] = -unit[axis] / sigma;
            }
            let clock = systems.iter().position(|s| *s == constellation.index())?;
            a[(r, 3 + clock)] = 1.0 / sigma;
            b[r] = (innovation - clocks[constellation.index()]) / sigma;
        }
        let cholesky = a.tr_mul(&a).cholesky()?;
        let step = cholesky.solve(&a.tr_mul(&b));
        p_e += Vector3::new(step[0], step[1], step[2]);
        for (k, system) in systems.iter().enumerate() {
            clocks[*system] += step[3 + k];
        }
        if step.rows(0, 3).norm() > 1e-3 || round < 2 {
            continue;
        }
        let residuals = &b - &a * &step;
        let redundancy = rows.len() - unknowns;
        let rms = (residuals.norm_squared() / redundancy.max(1) as f64).sqrt();
        let worst = (0..rows.len()).max_by(|&i, &j| residuals[i].abs().total_cmp(&residuals[j].abs()))?;
        // Four sigmas, and of the others three times: one cannot be told from the rest with a redundancy of one.
        let odd = redundancy >= 2 && residuals[worst].abs() > 5.0;
        let covariance = cholesky.inverse();
        let in_e = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let in_n = c_ne * in_e * c_ne.transpose() * rms.max(1.0).powi(2);
        let point = SinglePoint {
            p_e,
            sigma_n_m: [in_n[(0, 0)].sqrt(), in_n[(1, 1)].sqrt(), in_n[(2, 2)].sqrt()],
            satellites: rows.len(),
            rms_m: rms * SIGMA_M,
        };
        return Some((point, odd.then_some(rows[worst].0)));
    }
    None
}
