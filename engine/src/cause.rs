//! What can be wrong with any inertial sensor or its data, and with a filter that uses it: each with its figures and its
//! sentence. What only one system can meet stands with that system.

use crate::anomaly::{AnomalyKind, Cause};
use crate::figures::{Figures, figures};

/// One of the six channels of an inertial sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// A rate, by its axis.
    Rate(usize),
    /// A specific force, by its axis.
    Force(usize),
}

impl Channel {
    /// The channel at a place among rates and specific forces, x, y, z each.
    pub fn at(place: usize) -> Channel {
        if place < 3 { Channel::Rate(place) } else { Channel::Force(place % 3) }
    }

    /// Its column in a log.
    pub fn name(self) -> &'static str {
        const RATES: [&str; 3] = ["gyr_x_rad_s", "gyr_y_rad_s", "gyr_z_rad_s"];
        const FORCES: [&str; 3] = ["acc_x_m_s2", "acc_y_m_s2", "acc_z_m_s2"];
        match self {
            Channel::Rate(axis) => RATES[axis],
            Channel::Force(axis) => FORCES[axis],
        }
    }

    fn figures(self, reading: f64) -> Figures {
        let name = match self {
            Channel::Rate(_) => "reading_rad_s",
            Channel::Force(_) => "reading_m_s2",
        };
        figures([("channel", self.name().into()), (name, reading.into())])
    }
}

/// What is wrong, and by how much.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorCause {
    /// No samples for longer than several intervals.
    Gap {
        /// For how long, s.
        silence_s: f64,
        /// How long it takes from one sample to the next otherwise, s.
        usual_interval_s: f64,
    },
    /// A time stamp equal to the one before.
    RepeatedTime,
    /// A time stamp before the one before.
    TimeGoesBack {
        /// By how much, s.
        back_by_s: f64,
    },
    /// A single time stamp far ahead of those around it.
    TimeAhead {
        /// By how much, s.
        ahead_by_s: f64,
    },
    /// A time stamp that no session can have.
    TimeOfAnotherAge {
        /// The farthest that is believed, years.
        farthest_years: f64,
    },
    /// A reading that stays at the end of its range.
    EndOfRange {
        /// Which.
        channel: Channel,
        /// Where it stays.
        reading: f64,
    },
    /// A reading beyond what the body can do.
    ImpossibleMotion {
        /// The largest rate that is believed, rad/s.
        largest_rate_rad_s: f64,
        /// The largest specific force that is believed, m/s².
        largest_force_m_s2: f64,
    },
    /// A reading that does not change any more.
    StuckAxis {
        /// Which.
        channel: Channel,
        /// Where it stays.
        reading: f64,
    },
    /// A rate or specific force that is not a finite number.
    NotFinite,
    /// A magnetic value that is not a finite number, or larger than any field.
    ImpossibleField {
        /// The largest that is believed, µT.
        largest_field_ut: f64,
    },
    /// A pressure that is not a number, or of no place on Earth.
    ImpossiblePressure {
        /// The lowest that is believed, hPa.
        lowest_hpa: f64,
        /// The highest that is believed, hPa.
        highest_hpa: f64,
    },
    /// The specific force at rest is not that of gravity.
    ImpossibleRestGravity {
        /// What the sensor shows, m/s².
        rest_m_s2: f64,
        /// What it should show, m/s².
        gravity_m_s2: f64,
    },
    /// The filter met a number it could not use and went on from its last sound state.
    FilterReset,
}

impl Cause for SensorCause {
    fn kind(&self) -> AnomalyKind {
        match self {
            SensorCause::Gap { .. } => AnomalyKind::GAP,
            SensorCause::RepeatedTime => AnomalyKind::REPEATED_TIME,
            SensorCause::TimeGoesBack { .. }
            | SensorCause::TimeAhead { .. }
            | SensorCause::TimeOfAnotherAge { .. } => AnomalyKind::BACKWARD_TIME,
            SensorCause::EndOfRange { .. } | SensorCause::ImpossibleMotion { .. } => AnomalyKind::SATURATION,
            SensorCause::StuckAxis { .. } => AnomalyKind::STUCK_AXIS,
            SensorCause::NotFinite
            | SensorCause::ImpossibleField { .. }
            | SensorCause::ImpossiblePressure { .. } => AnomalyKind::NOT_FINITE,
            SensorCause::ImpossibleRestGravity { .. } => AnomalyKind::IMPOSSIBLE_REST_GRAVITY,
            SensorCause::FilterReset => AnomalyKind::FILTER_RESET,
        }
    }

    fn sentence(&self) -> String {
        match self {
            SensorCause::Gap { silence_s, usual_interval_s } => {
                format!("no samples for {silence_s:.3} s, where one comes every {usual_interval_s:.4} s")
            }
            SensorCause::RepeatedTime => {
                "the time stamp equals the one before; the sample is left out".to_owned()
            }
            SensorCause::TimeGoesBack { back_by_s } => format!(
                "the time goes back by {back_by_s:.4} s; samples are left out until it passes where it was"
            ),
            SensorCause::TimeAhead { ahead_by_s } => format!(
                "a time stamp is {ahead_by_s:.1} s ahead of those around it; the sample is left out"
            ),
            SensorCause::TimeOfAnotherAge { .. } => {
                "a time stamp is a hundred years from the session's start; the sample is left out".to_owned()
            }
            SensorCause::EndOfRange { channel, reading } => {
                format!("{} stays at {reading:.2}, the end of its range", channel.name())
            }
            SensorCause::ImpossibleMotion { largest_rate_rad_s, largest_force_m_s2 } => format!(
                "a rate above {largest_rate_rad_s} rad/s or a specific force above {largest_force_m_s2} m/s²; the sample is left out"
            ),
            SensorCause::StuckAxis { channel, reading } => {
                format!("{} has read {reading} without any change for a second and more", channel.name())
            }
            SensorCause::NotFinite => {
                "a rate or specific force is not a finite number; the sample is left out".to_owned()
            }
            SensorCause::ImpossibleField { .. } => {
                "a magnetic value is not a finite number, or beyond all reason; it counts as missing"
                    .to_owned()
            }
            SensorCause::ImpossiblePressure { lowest_hpa, highest_hpa } => format!(
                "a pressure is not between {lowest_hpa} and {highest_hpa} hPa; it counts as missing"
            ),
            SensorCause::ImpossibleRestGravity { rest_m_s2, gravity_m_s2 } => format!(
                "at rest the specific force is {rest_m_s2:.2} m/s² where gravity is {gravity_m_s2:.2} m/s²: check the accelerometer's scale and units"
            ),
            SensorCause::FilterReset => {
                "the filter came to a number that is none and went on from the last sound state; look at the samples in this stretch".to_owned()
            }
        }
    }

    fn figures(&self) -> Figures {
        match *self {
            SensorCause::Gap { silence_s, usual_interval_s } => {
                figures([("silence_s", silence_s.into()), ("usual_interval_s", usual_interval_s.into())])
            }
            SensorCause::TimeGoesBack { back_by_s } => figures([("back_by_s", back_by_s.into())]),
            SensorCause::TimeAhead { ahead_by_s } => figures([("ahead_by_s", ahead_by_s.into())]),
            SensorCause::TimeOfAnotherAge { farthest_years } => {
                figures([("farthest_years", farthest_years.into())])
            }
            SensorCause::EndOfRange { channel, reading } | SensorCause::StuckAxis { channel, reading } => {
                channel.figures(reading)
            }
            SensorCause::ImpossibleMotion { largest_rate_rad_s, largest_force_m_s2 } => figures([
                ("largest_rate_rad_s", largest_rate_rad_s.into()),
                ("largest_force_m_s2", largest_force_m_s2.into()),
            ]),
            SensorCause::ImpossibleField { largest_field_ut } => {
                figures([("largest_field_ut", largest_field_ut.into())])
            }
            SensorCause::ImpossiblePressure { lowest_hpa, highest_hpa } => {
                figures([("lowest_hpa", lowest_hpa.into()), ("highest_hpa", highest_hpa.into())])
            }
            SensorCause::ImpossibleRestGravity { rest_m_s2, gravity_m_s2 } => {
                figures([("rest_m_s2", rest_m_s2.into()), ("gravity_m_s2", gravity_m_s2.into())])
            }
            SensorCause::RepeatedTime | SensorCause::NotFinite | SensorCause::FilterReset => Figures::new(),
        }
    }
}

impl SensorCause {
    /// An example of every one, for the test of the message files. Which comes after which is asked of every variant, so
    /// that the compiler asks for a new one.
    pub fn examples() -> impl Iterator<Item = SensorCause> {
        let first = SensorCause::Gap { silence_s: 2.5, usual_interval_s: 0.01 };
        std::iter::successors(Some(first), |cause| match cause {
            SensorCause::Gap { .. } => Some(SensorCause::RepeatedTime),
            SensorCause::RepeatedTime => Some(SensorCause::TimeGoesBack { back_by_s: 0.5 }),
            SensorCause::TimeGoesBack { .. } => Some(SensorCause::TimeAhead { ahead_by_s: 3600.0 }),
            SensorCause::TimeAhead { .. } => Some(SensorCause::TimeOfAnotherAge { farthest_years: 100.0 }),
            SensorCause::TimeOfAnotherAge { .. } => {
                Some(SensorCause::EndOfRange { channel: Channel::Rate(0), reading: 34.9 })
            }
            SensorCause::EndOfRange { channel: Channel::Rate(_), .. } => {
                Some(SensorCause::EndOfRange { channel: Channel::Force(2), reading: -156.9 })
            }
            SensorCause::EndOfRange { channel: Channel::Force(_), .. } => {
                Some(SensorCause::ImpossibleMotion { largest_rate_rad_s: 90.0, largest_force_m_s2: 2000.0 })
            }
            SensorCause::ImpossibleMotion { .. } => {
                Some(SensorCause::StuckAxis { channel: Channel::Rate(1), reading: 0.125 })
            }
            SensorCause::StuckAxis { channel: Channel::Rate(_), .. } => {
                Some(SensorCause::StuckAxis { channel: Channel::Force(1), reading: 9.8 })
            }
            SensorCause::StuckAxis { channel: Channel::Force(_), .. } => Some(SensorCause::NotFinite),
            SensorCause::NotFinite => Some(SensorCause::ImpossibleField { largest_field_ut: 1e5 }),
            SensorCause::ImpossibleField { .. } => {
                Some(SensorCause::ImpossiblePressure { lowest_hpa: 250.0, highest_hpa: 1300.0 })
            }
            SensorCause::ImpossiblePressure { .. } => {
                Some(SensorCause::ImpossibleRestGravity { rest_m_s2: 1.0, gravity_m_s2: 9.79 })
            }
            SensorCause::ImpossibleRestGravity { .. } => Some(SensorCause::FilterReset),
            SensorCause::FilterReset => None,
        })
    }
}
