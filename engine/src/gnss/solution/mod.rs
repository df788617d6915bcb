//! Positions as satellite receivers and their programs tell them, for other programs to read: RTKLIB's [`pos`] and [`nmea`].

use crate::geo::Geodetic;
use crate::gnss::time::GpsTime;

pub mod nmea;
pub mod pos;

/// What a position rests on, in the words that receivers share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fix {
    /// Carrier phase with whole ambiguities.
    Fixed,
    /// Carrier phase with ambiguities as they come.
    Float,
    /// Code, without a base.
    Single,
    /// Something other than satellites.
    Estimated,
}

/// One position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Of the position.
    pub time: GpsTime,
    /// Where it is, on WGS84.
    pub place: Geodetic,
    /// Standard deviations east, north, up, m.
    pub sigma_n_m: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
    /// What it rests on.
    pub fix: Fix,
    /// Satellites used; none where it is not known.
    pub satellites: Option<usize>,
    /// How much older the base's epoch is, s; none where no base was used.
    pub base_age_s: Option<f64>,
    /// Squared norm of the second best integers over that of the best; none where they were not searched.
    pub ratio: Option<f64>,
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Fixed, then without satellites a moment before midnight, west and south.
    pub(in crate::gnss) fn two() -> [Solution; 2] {
        let fixed = Solution {
            time: GpsTime::from_calendar(2024, 6, 24, 8, 20, 100_000_000),
            place: Geodetic {
                latitude_deg: 40.096_691_637,
                longitude_deg: 105.147_166_512,
                height_m: 1601.4312,
            },
            sigma_n_m: [0.0081, 0.0123, 0.0204],
            covariance_en_m2: -4e-5,
            fix: Fix::Fixed,
            satellites: Some(14),
            base_age_s: Some(1.0),
            ratio: Some(12.34),
        };
        let estimated = Solution {
            time: GpsTime::from_calendar(2024, 7, 1, 0, 0, 17_999_800_000),
            place: Geodetic { latitude_deg: -33.999_999_999_9, longitude_deg: -151.0, height_m: -12.5 },
            fix: Fix::Estimated,
            satellites: Some(0),
            base_age_s: None,
            ratio: None,
            ..fixed
        };
        [fixed, estimated]
    }
}
