//! Whether a leg is off, by the rays to the platform.
//!
//! A leg that reads wrongly puts the platform where it is not: rays of all stations are then off, in a pattern that is the leg's own.
//! Of the rays of the last moments the error of each leg is estimated by itself, as if all others were right (a generalised
//! likelihood ratio). Where one leg explains nearly all, no other does, and several stations are of that opinion, it is that leg.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// What was weighed is forgotten by half in this time, s.
const HALF_S: f64 = 1.0;
/// So many rows, those of long ago counted less, and stations have to be of that opinion.
const FEWEST_ROWS: f64 = 3.0;
const FEWEST_STATIONS: usize = 3;
/// The share of rows that are refused.
const REFUSED: f64 = 0.4;
/// What a leg leaves unexplained of the sum of squares, beside the noise of each row.
const UNEXPLAINED: f64 = 0.1;
const NOISE_OF_ROW: f64 = 6.0;
/// The second best leg leaves so many times more.
const CLEARER: f64 = 2.0;

/// What the rays have said lately.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct LegDoubt {
    /// By leg: its column against itself, and against the innovations.
    own: [f64; 6],
    with: [f64; 6],
    square: f64,
    rows: f64,
    /// Refused rows by station.
    refused: Vec<f64>,
    last_ns: Option<i64>,
}

impl LegDoubt {
    /// A ray to the platform: the columns of its Jacobian for the legs, its innovation, and the inverse of that one's covariance.
    pub(super) fn note(
        &mut self,
        station: usize,
        taken: bool,
        columns: &[Vector3<f64>; 6],
        innovation: &Vector3<f64>,
        information: &Matrix3<f64>,
    ) {
        if self.refused.len() <= station {
            self.refused.resize(station + 1, 0.0);
        }
        let weighed = information * innovation;
        for (leg, column) in columns.iter().enumerate() {
            self.own[leg] += column.dot(&(information * column));
            self.with[leg] += column.dot(&weighed);
        }
        self.square += innovation.dot(&weighed);
        self.rows += 1.0;
        if !taken {
            self.refused[station] += 1.0;
        }
    }

    /// The end of an epoch: the leg that is off, and by how much, m; less than `least_m` is none.
    pub(super) fn pass(&mut self, t_ns: i64, least_m: f64) -> Option<(usize, f64)> {
        let dt_s = self.last_ns.map_or(0.0, |last_ns| (t_ns - last_ns).max(0) as f64 * 1e-9);
        self.last_ns = Some(t_ns);
        let kept = libm::exp2(-dt_s / HALF_S);
        let sums = [&mut self.square, &mut self.rows];
        let sums = sums.into_iter().chain(&mut self.own).chain(&mut self.with).chain(&mut self.refused);
        sums.for_each(|sum| *sum *= kept);

        let refused: f64 = self.refused.iter().sum();
        let stations = self.refused.iter().filter(|refused| **refused > 0.3).count();
        if refused < FEWEST_ROWS || refused < REFUSED * self.rows || stations < FEWEST_STATIONS {
            return None;
        }
        let left = |leg: usize| self.square - self.with[leg] * self.with[leg] / self.own[leg].max(1e-300);
        let best = (0..6).min_by(|a, b| left(*a).total_cmp(&left(*b)))?;
        let second = (0..6).filter(|leg| *leg != best).map(left).fold(f64::INFINITY, f64::min);
        let off_m = self.with[best] / self.own[best].max(1e-300);
        let explains = left(best) < UNEXPLAINED * self.square + NOISE_OF_ROW * self.rows;
        (explains && second > CLEARER * left(best) && off_m.abs() > least_m).then_some((best, off_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of six legs as a station has them that looks from this azimuth.
    fn columns(station: usize) -> [Vector3<f64>; 6] {
        std::array::from_fn(|leg| {
            let turn = station as f64 * 1.1 + leg as f64 * 1.9;
            Vector3::new(libm::sin(turn), libm::cos(turn * 1.7), libm::sin(0.6 * turn + 0.4)) * 0.5
        })
    }

    fn told(
        off: impl Fn(usize, &[Vector3<f64>; 6]) -> Vector3<f64>,
        stations: usize,
    ) -> Option<(usize, f64)> {
        let mut doubt = LegDoubt::default();
        let mut found = None;
        for epoch in 0..20 {
            let station = epoch % stations;
            let columns = columns(station);
            let information = Matrix3::identity() * 1e6;
            doubt.note(station, false, &columns, &off(station, &columns), &information);
            found = found.or(doubt.pass(epoch as i64 * 50_000_000, 0.003));
        }
        found
    }

    #[test]
    fn the_leg_whose_pattern_all_rays_show_is_named_with_its_error() {
        for leg in 0..6 {
            let (found, off_m) = told(|_, columns| columns[leg] * -0.08, 6).expect("a leg");
            assert!(found == leg && (off_m + 0.08).abs() < 1e-6, "{found} {off_m}");
        }
    }

    #[test]
    fn a_platform_that_is_elsewhere_or_two_stations_alone_name_no_leg() {
        // All rays are late: what they show is no leg's pattern.
        assert_eq!(told(|station, _| Vector3::new(0.03, -0.02, 0.01) * (1.0 + station as f64), 6), None);
        assert_eq!(told(|_, columns| columns[2] * 0.08, 2), None);
        // Two legs at once.
        assert_eq!(told(|_, columns| columns[0] * 0.05 + columns[3] * 0.05, 6), None);
    }
}
