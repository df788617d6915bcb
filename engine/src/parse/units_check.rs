//! Logs in other units than is said of them: found out by values that no foot can have.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::sample::ImuSample;

/// Above the range of every foot sensor: ±2000 °/s are 34.9 rad/s.
const MOST_RATE_RAD_S: f64 = 40.0;
/// At rest the length of the specific force in g is 1; in m/s² a foot is next to never so close to
/// free fall, and never for half of its walk.
const REST_IN_G: std::ops::RangeInclusive<f64> = 0.8..=1.2;
/// No foot is pushed harder than this for half of its walk: more than six g, m/s².
const MOST_AT_REST_M_S2: f64 = 60.0;
/// A force that differs from gravity by so much belongs to a foot in motion, m/s².
const MOVING_M_S2: f64 = 3.0;
/// A foot that walks turns faster than this in every step, rad/s.
const SLOWEST_STEP_RAD_S: f64 = 0.35;
/// Fewer rows in motion than these are no ground for a verdict on what is slow.
const FEWEST_MOVING: u64 = 200;
/// Fewer rows than these are no ground for a verdict.
const FEWEST_ROWS: u64 = 50;
/// After so many rows the verdict need not wait for the end of the file.
const EARLY_ROWS: u64 = 20_000;

/// What was said of the units: decides which mistakes are possible and what helps against them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Said {
    /// The file is the canonical log, whose columns name their units.
    pub(super) canonical: bool,
    /// The rates were said to be in degrees per second.
    pub(super) degrees: bool,
    /// The forces were said to be in g.
    pub(super) g: bool,
}

/// Counts the values that look like other units.
#[derive(Clone, Debug, Default)]
pub(super) struct UnitsCheck {
    said: Said,
    moving: u64,
    heavy: u64,
    rows: u64,
    too_fast: u64,
    fastest_rad_s: f64,
    like_g: u64,
}

impl UnitsCheck {
    pub(super) fn new(said: Said) -> UnitsCheck {
        UnitsCheck { said, ..UnitsCheck::default() }
    }

    pub(super) fn take(&mut self, sample: &ImuSample) -> Result<(), ParseError> {
        self.rows += 1;
        let [x, y, z] = sample.w_ib_b_rad_s.map(f64::abs);
        let fastest = x.max(y).max(z);
        if fastest.is_finite() {
            self.too_fast += u64::from(fastest > MOST_RATE_RAD_S);
            self.fastest_rad_s = self.fastest_rad_s.max(fastest);
        }
        let [x, y, z] = sample.f_b_m_s2;
        let length = (x * x + y * y + z * z).sqrt();
        self.like_g += u64::from(REST_IN_G.contains(&length));
        self.heavy += u64::from(length > MOST_AT_REST_M_S2);
        self.moving += u64::from((length - 9.8).abs() > MOVING_M_S2 && length < MOST_AT_REST_M_S2);
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
                if self.said.canonical {
                    "multiply the three gyr columns by π/180"
                } else {
                    "choose deg/s as the unit of the angular rate"
                },
            )
            .in_column(self.gyr()));
        }
        if self.like_g * 2 > self.rows {
            return Err(ParseError::new(
                ParseErrorKind::GNotMetres,
                "specific force in m/s², about 9.8 long at rest",
                format!(
                    "a length near 1 in {} of {} rows: these look like multiples of g",
                    self.like_g, self.rows
                ),
                if self.said.canonical {
                    "multiply the three acc columns by 9.80665"
                } else {
                    "choose g as the unit of the specific force, or the columns that include gravity"
                },
            )
            .in_column(self.acc()));
        }
        self.finish_converted()
    }

    /// What only a conversion can have done.
    fn finish_converted(&self) -> Result<(), ParseError> {
        if self.said.g && self.heavy * 2 > self.rows {
            return Err(ParseError::new(
                ParseErrorKind::MetresNotG,
                "specific force in g, about 1 long at rest",
                format!(
                    "more than 6 g in {} of {} rows: these look like metres per second squared",
                    self.heavy, self.rows
                ),
                "choose m/s² as the unit of the specific force",
            )
            .in_column(self.acc()));
        }
        if self.said.degrees && self.moving >= FEWEST_MOVING && self.fastest_rad_s < SLOWEST_STEP_RAD_S {
            return Err(ParseError::new(
                ParseErrorKind::RadiansNotDegrees,
                "angular rates in deg/s, of some hundreds in every step",
                format!(
                    "at most {:.1} in {} rows, in {} of which the sensor is in motion: these look like radians per second",
                    self.fastest_rad_s.to_degrees(),
                    self.rows,
                    self.moving
                ),
                "choose rad/s as the unit of the angular rate",
            )
            .in_column(self.gyr()));
        }
        Ok(())
    }

    fn gyr(&self) -> &'static str {
        if self.said.canonical { "gyr_x_rad_s, gyr_y_rad_s, gyr_z_rad_s" } else { "the angular rate" }
    }

    fn acc(&self) -> &'static str {
        if self.said.canonical { "acc_x_m_s2, acc_y_m_s2, acc_z_m_s2" } else { "the specific force" }
    }
}
