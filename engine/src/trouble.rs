//! What can be wrong with a sensor or its data: one kind of trouble after the other, with its figures and its sentence.

mod sentence;

use crate::event::{Anomaly, AnomalyKind};
use crate::figures::{Figures, figures};
use crate::sample::Foot;

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
pub enum Trouble {
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
    /// A time stamp that no walk can have.
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
    /// A reading beyond what a foot can do.
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
    /// A rate or specific force that is no number.
    NotFinite,
    /// A magnetic value that is no number, or larger than any field.
    ImpossibleField {
        /// The largest that is believed, µT.
        largest_field_ut: f64,
    },
    /// A pressure that is no number, or of no place on Earth.
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
    /// Gravity does not stand upright after a swing.
    TiltedInStance {
        /// By how much, degrees.
        tilt_deg: f64,
    },
    /// A swing does not come to rest where the foot stands.
    FastLandings {
        /// How fast the foot is by its strapdown, m/s.
        landing_speed_m_s: f64,
    },
    /// The foot sets off more often than any foot can.
    ImpossibleCadence {
        /// How often, 1/s.
        per_s: f64,
        /// The most that is believed, 1/s.
        most_per_s: f64,
    },
    /// The session did not start with a still stretch.
    NoStillStart {
        /// How long one should stand, s.
        wanted_still_s: f64,
    },
    /// The magnetic field is not that of the site.
    MagneticField {
        /// The weakest that can be the site's, µT.
        weakest_ut: f64,
        /// The strongest that can be the site's, µT.
        strongest_ut: f64,
        /// For how many stances it has been outside.
        stances: u32,
        /// What it is now, µT.
        found_ut: f64,
    },
    /// A foot without any sample in a session that is of both.
    FootAbsent {
        /// Which.
        foot: Foot,
    },
    /// A foot of a stored session of both without any sample.
    FootNotStored {
        /// Which.
        foot: Foot,
    },
    /// A foot whose samples begin after the other's.
    FootLate {
        /// Which.
        foot: Foot,
        /// By how much, s.
        late_s: f64,
    },
    /// A foot whose samples end before the other's.
    FootEarly {
        /// Which.
        foot: Foot,
        /// By how much, s.
        early_s: f64,
    },
    /// A foot that sends no more, while the other goes on.
    FootSilent {
        /// Which.
        foot: Foot,
        /// For how long the other waits, s.
        longest_silence_s: f64,
    },
    /// The heading's sigma has passed what the linearised filter can be trusted with.
    HeadingUncertain {
        /// The sigma, degrees.
        sigma_heading_deg: f64,
    },
    /// The filter met a number it could not use and went on from its last sound state.
    FilterReset,
}

impl Trouble {
    /// The anomaly that tells of it.
    pub fn anomaly(&self, foot: Option<Foot>, [t_start_ns, t_end_ns]: [i64; 2], samples: u64) -> Anomaly {
        Anomaly {
            kind: self.kind(),
            foot,
            t_start_ns,
            t_end_ns,
            samples,
            detail: self.sentence(),
            figures: Some(self.figures()),
        }
    }

    /// Its kind.
    pub fn kind(&self) -> AnomalyKind {
        match self {
            Trouble::Gap { .. } => AnomalyKind::Gap,
            Trouble::RepeatedTime => AnomalyKind::RepeatedTime,
            Trouble::TimeGoesBack { .. } | Trouble::TimeAhead { .. } | Trouble::TimeOfAnotherAge { .. } => {
                AnomalyKind::BackwardTime
            }
            Trouble::EndOfRange { .. } | Trouble::ImpossibleMotion { .. } => AnomalyKind::Saturation,
            Trouble::StuckAxis { .. } => AnomalyKind::StuckAxis,
            Trouble::NotFinite | Trouble::ImpossibleField { .. } | Trouble::ImpossiblePressure { .. } => {
                AnomalyKind::NotFinite
            }
            Trouble::ImpossibleRestGravity { .. } => AnomalyKind::ImpossibleRestGravity,
            Trouble::TiltedInStance { .. } | Trouble::FastLandings { .. } => AnomalyKind::WrongMounting,
            Trouble::ImpossibleCadence { .. } => AnomalyKind::ImpossibleCadence,
            Trouble::NoStillStart { .. } => AnomalyKind::NoStillStart,
            Trouble::MagneticField { .. } => AnomalyKind::MagneticField,
            Trouble::FootAbsent { .. }
            | Trouble::FootNotStored { .. }
            | Trouble::FootLate { .. }
            | Trouble::FootEarly { .. }
            | Trouble::FootSilent { .. } => AnomalyKind::FootMissing,
            Trouble::HeadingUncertain { .. } => AnomalyKind::HeadingUncertain,
            Trouble::FilterReset => AnomalyKind::FilterReset,
        }
    }

    /// Its figures.
    pub fn figures(&self) -> Figures {
        match *self {
            Trouble::Gap { silence_s, usual_interval_s } => {
                figures([("silence_s", silence_s.into()), ("usual_interval_s", usual_interval_s.into())])
            }
            Trouble::TimeGoesBack { back_by_s } => figures([("back_by_s", back_by_s.into())]),
            Trouble::TimeAhead { ahead_by_s } => figures([("ahead_by_s", ahead_by_s.into())]),
            Trouble::TimeOfAnotherAge { farthest_years } => {
                figures([("farthest_years", farthest_years.into())])
            }
            Trouble::EndOfRange { channel, reading } | Trouble::StuckAxis { channel, reading } => {
                channel.figures(reading)
            }
            Trouble::ImpossibleMotion { largest_rate_rad_s, largest_force_m_s2 } => figures([
                ("largest_rate_rad_s", largest_rate_rad_s.into()),
                ("largest_force_m_s2", largest_force_m_s2.into()),
            ]),
            Trouble::ImpossibleField { largest_field_ut } => {
                figures([("largest_field_ut", largest_field_ut.into())])
            }
            Trouble::ImpossiblePressure { lowest_hpa, highest_hpa } => {
                figures([("lowest_hpa", lowest_hpa.into()), ("highest_hpa", highest_hpa.into())])
            }
            Trouble::ImpossibleRestGravity { rest_m_s2, gravity_m_s2 } => {
                figures([("rest_m_s2", rest_m_s2.into()), ("gravity_m_s2", gravity_m_s2.into())])
            }
            Trouble::TiltedInStance { tilt_deg } => figures([("tilt_deg", tilt_deg.into())]),
            Trouble::FastLandings { landing_speed_m_s } => {
                figures([("landing_speed_m_s", landing_speed_m_s.into())])
            }
            Trouble::ImpossibleCadence { per_s, most_per_s } => {
                figures([("per_s", per_s.into()), ("most_per_s", most_per_s.into())])
            }
            Trouble::NoStillStart { wanted_still_s } => figures([("wanted_still_s", wanted_still_s.into())]),
            Trouble::MagneticField { weakest_ut, strongest_ut, stances, found_ut } => figures([
                ("weakest_ut", weakest_ut.into()),
                ("strongest_ut", strongest_ut.into()),
                ("stances", f64::from(stances).into()),
                ("found_ut", found_ut.into()),
            ]),
            Trouble::FootLate { late_s, .. } => figures([("late_s", late_s.into())]),
            Trouble::FootEarly { early_s, .. } => figures([("early_s", early_s.into())]),
            Trouble::FootSilent { longest_silence_s, .. } => {
                figures([("longest_silence_s", longest_silence_s.into())])
            }
            Trouble::HeadingUncertain { sigma_heading_deg } => {
                figures([("sigma_heading_deg", sigma_heading_deg.into())])
            }
            Trouble::RepeatedTime
            | Trouble::NotFinite
            | Trouble::FootAbsent { .. }
            | Trouble::FootNotStored { .. }
            | Trouble::FilterReset => Figures::new(),
        }
    }

    /// One of each, for whoever has to have words for all of them. Which comes after which is asked of every kind, so
    /// that the compiler asks for a new one.
    pub fn one_of_each() -> impl Iterator<Item = Trouble> {
        let first = Trouble::Gap { silence_s: 2.5, usual_interval_s: 0.01 };
        std::iter::successors(Some(first), |trouble| match trouble {
            Trouble::Gap { .. } => Some(Trouble::RepeatedTime),
            Trouble::RepeatedTime => Some(Trouble::TimeGoesBack { back_by_s: 0.5 }),
            Trouble::TimeGoesBack { .. } => Some(Trouble::TimeAhead { ahead_by_s: 3600.0 }),
            Trouble::TimeAhead { .. } => Some(Trouble::TimeOfAnotherAge { farthest_years: 100.0 }),
            Trouble::TimeOfAnotherAge { .. } => {
                Some(Trouble::EndOfRange { channel: Channel::Rate(0), reading: 34.9 })
            }
            Trouble::EndOfRange { channel: Channel::Rate(_), .. } => {
                Some(Trouble::EndOfRange { channel: Channel::Force(2), reading: -156.9 })
            }
            Trouble::EndOfRange { channel: Channel::Force(_), .. } => {
                Some(Trouble::ImpossibleMotion { largest_rate_rad_s: 90.0, largest_force_m_s2: 2000.0 })
            }
            Trouble::ImpossibleMotion { .. } => {
                Some(Trouble::StuckAxis { channel: Channel::Rate(1), reading: 0.125 })
            }
            Trouble::StuckAxis { channel: Channel::Rate(_), .. } => {
                Some(Trouble::StuckAxis { channel: Channel::Force(1), reading: 9.8 })
            }
            Trouble::StuckAxis { channel: Channel::Force(_), .. } => Some(Trouble::NotFinite),
            Trouble::NotFinite => Some(Trouble::ImpossibleField { largest_field_ut: 1e5 }),
            Trouble::ImpossibleField { .. } => {
                Some(Trouble::ImpossiblePressure { lowest_hpa: 250.0, highest_hpa: 1300.0 })
            }
            Trouble::ImpossiblePressure { .. } => {
                Some(Trouble::ImpossibleRestGravity { rest_m_s2: 1.0, gravity_m_s2: 9.79 })
            }
            Trouble::ImpossibleRestGravity { .. } => Some(Trouble::TiltedInStance { tilt_deg: 40.0 }),
            Trouble::TiltedInStance { .. } => Some(Trouble::FastLandings { landing_speed_m_s: 1.5 }),
            Trouble::FastLandings { .. } => Some(Trouble::ImpossibleCadence { per_s: 27.0, most_per_s: 8.0 }),
            Trouble::ImpossibleCadence { .. } => Some(Trouble::NoStillStart { wanted_still_s: 10.0 }),
            Trouble::NoStillStart { .. } => Some(Trouble::MagneticField {
                weakest_ut: 40.0,
                strongest_ut: 60.0,
                stances: 5,
                found_ut: 71.0,
            }),
            Trouble::MagneticField { .. } => Some(Trouble::FootAbsent { foot: Foot::Left }),
            Trouble::FootAbsent { .. } => Some(Trouble::FootNotStored { foot: Foot::Right }),
            Trouble::FootNotStored { .. } => Some(Trouble::FootLate { foot: Foot::Left, late_s: 12.0 }),
            Trouble::FootLate { .. } => Some(Trouble::FootEarly { foot: Foot::Right, early_s: 12.0 }),
            Trouble::FootEarly { .. } => {
                Some(Trouble::FootSilent { foot: Foot::Left, longest_silence_s: 1.0 })
            }
            Trouble::FootSilent { .. } => Some(Trouble::HeadingUncertain { sigma_heading_deg: 31.0 }),
            Trouble::HeadingUncertain { .. } => Some(Trouble::FilterReset),
            Trouble::FilterReset => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_comes_up_and_every_figure_is_a_finite_number_or_a_name() {
        let all: Vec<Trouble> = Trouble::one_of_each().collect();
        let mut kinds: Vec<AnomalyKind> = all.iter().map(Trouble::kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        // The last of the enumeration is the largest, and they are numbered from nought.
        assert_eq!(kinds.len(), AnomalyKind::FilterReset as usize + 1);
        for trouble in &all {
            let anomaly = trouble.anomaly(None, [1, 2], 3);
            let read: Anomaly = serde_json::from_str(&serde_json::to_string(&anomaly).unwrap()).unwrap();
            assert_eq!(read, anomaly);
        }
    }
}
