//! One row of the rover's track, and its text.

use std::fmt::Write as _;

use crate::geo::Geodetic;
use crate::gnss::solution::{Fix, Solution};
use crate::gnss::time::GpsTime;

/// What a row's position rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Quality {
    /// Whole ambiguities, and less than 5 cm of sigma in plan.
    Fixed,
    /// Phases of both stations, ambiguities not whole or the plan not sharp enough.
    Float,
    /// Ranges, and no satellite.
    Uwb,
    /// The rover's own code; no base.
    Single,
    /// No observation of this epoch was used.
    Predicted,
}

impl Quality {
    /// All, best first.
    pub const ALL: [Quality; 5] =
        [Quality::Fixed, Quality::Float, Quality::Uwb, Quality::Single, Quality::Predicted];

    /// As charts number it, from 1 for the best.
    pub fn number(self) -> f64 {
        f64::from(self as u8 + 1)
    }

    /// In the words that receivers share.
    pub fn fix(self) -> Fix {
        match self {
            Quality::Fixed => Fix::Fixed,
            Quality::Float => Fix::Float,
            Quality::Single => Fix::Single,
            Quality::Uwb | Quality::Predicted => Fix::Estimated,
        }
    }

    /// As files spell it.
    pub fn word(self) -> &'static str {
        match self {
            Quality::Fixed => "fixed",
            Quality::Float => "float",
            Quality::Uwb => "uwb",
            Quality::Single => "single",
            Quality::Predicted => "predicted",
        }
    }
}

/// Where the rover was at one time tag.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Seconds since the first row; of the ranges' file where there are no satellites.
    pub t_s: f64,
    /// GPS week and second of the week of the receiver's time tag; none without satellites.
    pub gps_time: Option<(i32, f64)>,
    /// East, north, up, m.
    pub p_n_m: [f64; 3],
    /// Latitude and longitude in degrees, ellipsoidal height in m; none without satellites.
    pub geodetic: Option<[f64; 3]>,
    /// Standard deviations east, north, up, m.
    pub sigma_n_m: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
    /// What the position rests on.
    pub quality: Quality,
    /// Squared norm of the second best integers over that of the best, where they were searched.
    pub ratio: Option<f64>,
    /// Satellites used.
    pub satellites: usize,
    /// Anchors used.
    pub anchors: usize,
    /// How much older the base's epoch is, s; none where no base was used.
    pub base_age_s: Option<f64>,
}

/// The first line of a track.
pub const HEADER: &str = "t_s,gps_week,gps_tow_s,e_m,n_m,u_m,lat_deg,lon_deg,height_m,sigma_e_m,sigma_n_m,sigma_u_m,\
                          quality,ratio,satellites,anchors\n";

impl Row {
    /// The row as other programs read it; none where nobody knows where on the Earth it is, or when.
    pub fn solution(&self) -> Option<Solution> {
        let ((week, tow_s), [latitude_deg, longitude_deg, height_m]) = (self.gps_time?, self.geodetic?);
        Some(Solution {
            time: GpsTime::from_week(week, tow_s),
            place: Geodetic { latitude_deg, longitude_deg, height_m },
            sigma_n_m: self.sigma_n_m,
            covariance_en_m2: self.covariance_en_m2,
            fix: self.quality.fix(),
            satellites: Some(self.satellites),
            base_age_s: self.base_age_s,
            ratio: self.ratio,
        })
    }

    /// Appends the row as a line.
    pub fn write(&self, out: &mut String) {
        let _ = write!(out, "{:.4},", self.t_s);
        match self.gps_time {
            Some((week, tow_s)) => {
                let _ = write!(out, "{week},{tow_s:.4}");
            }
            None => out.push(','),
        }
        let [e, n, u] = self.p_n_m;
        let _ = write!(out, ",{e:.5},{n:.5},{u:.5}");
        match self.geodetic {
            Some([lat, lon, height]) => {
                let _ = write!(out, ",{lat:.10},{lon:.10},{height:.5}");
            }
            None => out.push_str(",,,"),
        }
        let [e, n, u] = self.sigma_n_m;
        let _ = write!(out, ",{e:.5},{n:.5},{u:.5},{},", self.quality.word());
        if let Some(ratio) = self.ratio {
            let _ = write!(out, "{ratio:.2}");
        }
        let _ = writeln!(out, ",{},{}", self.satellites, self.anchors);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_without_satellites_leaves_week_and_ellipsoidal_coordinates_empty() {
        let row = Row {
            t_s: 1.5,
            gps_time: None,
            p_n_m: [1.0, 2.0, 3.0],
            geodetic: None,
            sigma_n_m: [0.1, 0.2, 0.3],
            covariance_en_m2: 0.0,
            quality: Quality::Uwb,
            ratio: None,
            satellites: 0,
            anchors: 3,
            base_age_s: None,
        };
        let mut text = String::new();
        row.write(&mut text);
        assert_eq!(text, "1.5000,,,1.00000,2.00000,3.00000,,,,0.10000,0.20000,0.30000,uwb,,0,3\n");
        assert_eq!(text.matches(',').count(), HEADER.matches(',').count());
    }
}
