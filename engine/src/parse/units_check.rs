//! Logs in degrees per second or in g: found out by values that no foot can have in SI units.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::sample::ImuSample;

/// Above the range of every foot sensor: ±2000 °/s are 34.9 rad/s.
const MOST_RATE_RAD_S: f64 = 40.0;
/// At rest the length of the specific force in g is 1; in m/s² a foot is next to never so close to
/// free fall, and never for half of its walk.
const REST_IN_G: std::ops::RangeInclusive<f64> = 0.8..=1.2;
/// Fewer rows than these are no ground for a verdict.
const FEWEST_ROWS: u64 = 50;
/// After so many rows the verdict need not wait for the end of the file.
const EARLY_ROWS: u64 = 20_000;

/// Counts the values that look like other units.
#[derive(Clone, Debug, Default)]
pub(super) struct UnitsCheck {
    rows: u64,
    too_fast: u64,
    fastest_rad_s: f64,
    like_g: u64,
}

impl UnitsCheck {
    pub(super) fn take(&mut self, sample: &ImuSample) -> Result<(), ParseError> {
        self.rows += 1;
        let [x, y, z] = sample.w_ib_b_rad_s.map(f64::abs);
        let fastest = x.max(y).max(z);
        if fastest > MOST_RATE_RAD_S && fastest.is_finite() {
            self.too_fast += 1;
            self.fastest_rad_s = self.fastest_rad_s.max(fastest);
        }
        let [x, y, z] = sample.f_b_m_s2;
        let length = (x * x + y * y + z * z).sqrt();
        self.like_g += u64::from(REST_IN_G.contains(&length));
        if self.rows == EARLY_ROWS { self.finish() } else { Ok(()) }
    }

    pub(super) fn finish(&self) -> Result<(), ParseError> {
        if self.rows < FEWEST_ROWS {
            return Ok(());
        }
        // A few wild values are a sensor's trouble; one row in fifty is a unit's.
        if self.too_fast * 50 > self.rows {
            return Err(ParseError::new(
                ParseErrorKind::DegreesNotRadians,
                "angular rates in rad/s, at most 34.9 (±2000 °/s)",
                format!(
                    "more than {MOST_RATE_RAD_S} in {} of {} rows, up to {:.1}: these look like degrees per second",
                    self.too_fast, self.rows, self.fastest_rad_s
                ),
                "multiply the three gyr columns by π/180",
            )
            .in_column("gyr_x_rad_s, gyr_y_rad_s, gyr_z_rad_s"));
        }
        if self.like_g * 2 > self.rows {
            return Err(ParseError::new(
                ParseErrorKind::GNotMetres,
                "specific force in m/s², about 9.8 long at rest",
                format!(
                    "a length near 1 in {} of {} rows: these look like multiples of g",
                    self.like_g, self.rows
                ),
                "multiply the three acc columns by 9.80665",
            )
            .in_column("acc_x_m_s2, acc_y_m_s2, acc_z_m_s2"));
        }
        Ok(())
    }
}
