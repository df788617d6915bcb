//! What one inertial sensor says at one instant.

use serde::{Deserialize, Serialize};

/// One reading of one sensor, in SI units and in the sensor's own body frame b, calibrated only as
/// far as the device does it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImuSample {
    /// Time since the session's start, on the session's clock, ns.
    pub t_ns: i64,
    /// Angular rate of the body against inertial space, in b, rad/s.
    pub w_ib_b_rad_s: [f64; 3],
    /// Specific force in b, m/s²: at rest it points up and has the length g.
    pub f_b_m_s2: [f64; 3],
    /// Magnetic flux density in b, µT; `None` where the log has no value.
    pub mag_b_ut: Option<[f64; 3]>,
    /// Air pressure, hPa; `None` where the log has no value.
    pub pressure_hpa: Option<f64>,
}

impl ImuSample {
    /// The sample with the decimals that a logger writes: far finer than a sensor's own steps, and a
    /// third of the bytes.
    pub fn as_logged(&self) -> ImuSample {
        let rounded = |value: f64, steps_per_unit: f64| (value * steps_per_unit).round() / steps_per_unit;
        ImuSample {
            t_ns: self.t_ns,
            w_ib_b_rad_s: self.w_ib_b_rad_s.map(|value| rounded(value, 1e6)),
            f_b_m_s2: self.f_b_m_s2.map(|value| rounded(value, 1e5)),
            mag_b_ut: self.mag_b_ut.map(|mag_ut| mag_ut.map(|value| rounded(value, 1e3))),
            pressure_hpa: self.pressure_hpa.map(|value| rounded(value, 1e4)),
        }
    }

    /// The readings in single precision: 24 bits hold all that a sensor of 16 has to say, and a walk of
    /// a working day then fits in memory.
    pub fn in_single_precision(&self) -> ImuSample {
        let single = |x: f64| f64::from(x as f32);
        ImuSample {
            t_ns: self.t_ns,
            w_ib_b_rad_s: self.w_ib_b_rad_s.map(single),
            f_b_m_s2: self.f_b_m_s2.map(single),
            mag_b_ut: self.mag_b_ut.map(|mag| mag.map(single)),
            pressure_hpa: self.pressure_hpa.map(single),
        }
    }
}

/// A surveyed UWB anchor.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyedAnchor {
    /// Its name, which no other has.
    pub name: String,
    /// East, north and up of its antenna in the survey's frame, m.
    pub p_n: [f64; 3],
}

/// A range from a UWB tag to an anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TagRange {
    /// When it was measured, by the clock of the ranges, ns.
    pub t_ns: i64,
    /// The anchor, an index into [`TagRanges::anchors`].
    pub anchor: usize,
    /// The range as measured, m; may be negative or far off, and NaN where it failed.
    pub range_m: f64,
}

/// The ranges of a tag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TagRanges {
    /// The anchors' names, in the order in which they first answer.
    pub anchors: Vec<String>,
    /// The ranges in order of time; those of one time in the order in which they came.
    pub rows: Vec<TagRange>,
    /// What was put right or left out, in sentences.
    pub notes: Vec<String>,
}
