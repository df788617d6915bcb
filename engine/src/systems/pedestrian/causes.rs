//! What can be wrong with a walk: its feet, their mounting, the standing start, the compass.

use super::contradictions::Contradiction;
use super::side::Side;
use crate::anomaly::{Anomaly, AnomalyKind, Cause};
use crate::cause::SensorCause;
use crate::figures::{Figures, figures};
use crate::word::Word;

/// The foot sets off more often than any foot can.
pub const IMPOSSIBLE_CADENCE: AnomalyKind = AnomalyKind(Word::declared("impossible_cadence", 8));
/// One foot's log is not there, begins late, ends early or is silent while the other goes on.
pub const FOOT_MISSING: AnomalyKind = AnomalyKind(Word::declared("foot_missing", 11));
/// A foot moves, and no contact with the ground is recognised.
pub const NO_CONTACT: AnomalyKind = AnomalyKind(Word::declared("no_contact", 30));

/// What is wrong, and by how much.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum WalkCause {
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
        side: Side,
    },
    /// A foot of a stored session of both without any sample.
    FootNotStored {
        /// Which.
        side: Side,
    },
    /// A foot whose samples begin after the other's.
    FootLate {
        /// Which.
        side: Side,
        /// By how much, s.
        late_s: f64,
    },
    /// A foot whose samples end before the other's.
    FootEarly {
        /// Which.
        side: Side,
        /// By how much, s.
        early_s: f64,
    },
    /// A foot that sends no more, while the other goes on.
    FootSilent {
        /// Which.
        side: Side,
        /// For how long the other waits, s.
        longest_silence_s: f64,
    },
    /// The heading's sigma has passed what the linearised filter can be trusted with.
    HeadingUncertain {
        /// The sigma, degrees.
        sigma_heading_deg: f64,
    },
    /// No contact for longer than any step takes.
    NoContact {
        /// For how long, s.
        flown_s: f64,
    },
}

impl Cause for WalkCause {
    fn kind(&self) -> AnomalyKind {
        match self {
            WalkCause::TiltedInStance { .. } | WalkCause::FastLandings { .. } => AnomalyKind::WRONG_MOUNTING,
            WalkCause::ImpossibleCadence { .. } => IMPOSSIBLE_CADENCE,
            WalkCause::NoStillStart { .. } => AnomalyKind::NO_STILL_START,
            WalkCause::MagneticField { .. } => AnomalyKind::MAGNETIC_FIELD,
            WalkCause::FootAbsent { .. }
            | WalkCause::FootNotStored { .. }
            | WalkCause::FootLate { .. }
            | WalkCause::FootEarly { .. }
            | WalkCause::FootSilent { .. } => FOOT_MISSING,
            WalkCause::HeadingUncertain { .. } => AnomalyKind::HEADING_UNCERTAIN,
            WalkCause::NoContact { .. } => NO_CONTACT,
        }
    }

    fn sentence(&self) -> String {
        match self {
            WalkCause::TiltedInStance { tilt_deg } => {
                wrong_axes(&format!("in stance the specific force stands {tilt_deg:.0}° from upright"))
            }
            WalkCause::FastLandings { landing_speed_m_s } => {
                wrong_axes(&format!("the swings end at {landing_speed_m_s:.1} m/s where the foot stands"))
            }
            WalkCause::ImpossibleCadence { per_s, most_per_s } => format!(
                "the foot sets off {per_s:.0} times a second, where none does more than {most_per_s:.0} times: check the unit of the time, the sensor's clock, and that the sensor is tied down"
            ),
            WalkCause::NoStillStart { wanted_still_s } => format!(
                "no still second at the start; the quietest moment was used for levelling, and the gyro bias is unknown at first: stand still for {wanted_still_s} s before walking"
            ),
            WalkCause::MagneticField { weakest_ut, strongest_ut, stances, found_ut } => format!(
                "the field has been outside {weakest_ut:.0} to {strongest_ut:.0} µT for {stances} stances, now {found_ut:.0} µT: steel nearby, or a magnetometer that needs calibrating; the heading goes on by the gyro"
            ),
            WalkCause::FootAbsent { side } => {
                format!("the {} foot has no samples at all; the other goes on alone", side.name())
            }
            WalkCause::FootNotStored { side } => format!(
                "expected samples of the {} foot, found none: the track was computed without it",
                side.name()
            ),
            WalkCause::FootLate { side, late_s } => {
                format!("the {} foot begins {late_s:.1} s late; the other goes on alone", side.name())
            }
            WalkCause::FootEarly { side, early_s } => {
                format!("the {} foot ends {early_s:.1} s early; the other goes on alone", side.name())
            }
            WalkCause::FootSilent { side, .. } => {
                format!("the {} foot is silent; the other goes on alone", side.name())
            }
            WalkCause::HeadingUncertain { sigma_heading_deg } => format!(
                "the heading is uncertain by {sigma_heading_deg:.0}° (1σ): only a marker or the magnetometer can mend it"
            ),
            WalkCause::NoContact { flown_s } => format!(
                "the foot has moved for {flown_s:.1} s without a contact with the ground that could be recognised: the track goes on freely and its sigma grows; look at the kind of motion and at how the sensor is tied"
            ),
        }
    }

    fn figures(&self) -> Figures {
        match *self {
            WalkCause::TiltedInStance { tilt_deg } => figures([("tilt_deg", tilt_deg.into())]),
            WalkCause::FastLandings { landing_speed_m_s } => {
                figures([("landing_speed_m_s", landing_speed_m_s.into())])
            }
            WalkCause::ImpossibleCadence { per_s, most_per_s } => {
                figures([("per_s", per_s.into()), ("most_per_s", most_per_s.into())])
            }
            WalkCause::NoStillStart { wanted_still_s } => {
                figures([("wanted_still_s", wanted_still_s.into())])
            }
            WalkCause::MagneticField { weakest_ut, strongest_ut, stances, found_ut } => figures([
                ("weakest_ut", weakest_ut.into()),
                ("strongest_ut", strongest_ut.into()),
                ("stances", f64::from(stances).into()),
                ("found_ut", found_ut.into()),
            ]),
            WalkCause::FootLate { late_s, .. } => figures([("late_s", late_s.into())]),
            WalkCause::FootEarly { early_s, .. } => figures([("early_s", early_s.into())]),
            WalkCause::FootSilent { longest_silence_s, .. } => {
                figures([("longest_silence_s", longest_silence_s.into())])
            }
            WalkCause::HeadingUncertain { sigma_heading_deg } => {
                figures([("sigma_heading_deg", sigma_heading_deg.into())])
            }
            WalkCause::NoContact { flown_s } => figures([("flown_s", flown_s.into())]),
            WalkCause::FootAbsent { .. } | WalkCause::FootNotStored { .. } => Figures::new(),
        }
    }
}

impl WalkCause {
    /// An example of every one. Which comes after which is asked of every variant, so that the compiler asks for a new one.
    fn examples() -> impl Iterator<Item = WalkCause> {
        let first = WalkCause::TiltedInStance { tilt_deg: 40.0 };
        std::iter::successors(Some(first), |cause| match cause {
            WalkCause::TiltedInStance { .. } => Some(WalkCause::FastLandings { landing_speed_m_s: 1.5 }),
            WalkCause::FastLandings { .. } => {
                Some(WalkCause::ImpossibleCadence { per_s: 27.0, most_per_s: 8.0 })
            }
            WalkCause::ImpossibleCadence { .. } => Some(WalkCause::NoStillStart { wanted_still_s: 10.0 }),
            WalkCause::NoStillStart { .. } => Some(WalkCause::MagneticField {
                weakest_ut: 40.0,
                strongest_ut: 60.0,
                stances: 5,
                found_ut: 71.0,
            }),
            WalkCause::MagneticField { .. } => Some(WalkCause::FootAbsent { side: Side::Left }),
            WalkCause::FootAbsent { .. } => Some(WalkCause::FootNotStored { side: Side::Right }),
            WalkCause::FootNotStored { .. } => Some(WalkCause::FootLate { side: Side::Left, late_s: 12.0 }),
            WalkCause::FootLate { .. } => Some(WalkCause::FootEarly { side: Side::Right, early_s: 12.0 }),
            WalkCause::FootEarly { .. } => {
                Some(WalkCause::FootSilent { side: Side::Left, longest_silence_s: 1.0 })
            }
            WalkCause::FootSilent { .. } => Some(WalkCause::HeadingUncertain { sigma_heading_deg: 31.0 }),
            WalkCause::HeadingUncertain { .. } => Some(WalkCause::NoContact { flown_s: 3.0 }),
            WalkCause::NoContact { .. } => None,
        })
    }
}

/// An anomaly of every kind and sentence that a walk can have, for the test of the message files.
pub(crate) fn examples() -> Vec<Anomaly> {
    SensorCause::examples()
        .map(|cause| cause.anomaly(None, [1, 2], 3))
        .chain(WalkCause::examples().map(|cause| cause.anomaly(None, [1, 2], 3)))
        .chain(Contradiction::examples().map(|cause| cause.anomaly(None, [1, 2], 3)))
        .collect()
}

fn wrong_axes(found: &str) -> String {
    format!(
        "{found}: the axes of gyro and accelerometer do not belong together, or the sensor has slipped; check that the log's axes are right-handed and the sensor is tied down"
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_example_comes_back_from_json_and_every_kind_is_among_them() {
        let all = examples();
        let kinds: BTreeSet<AnomalyKind> = all.iter().map(|anomaly| anomaly.kind).collect();
        assert_eq!(kinds.len(), 23);
        for anomaly in all {
            let read: Anomaly = serde_json::from_str(&serde_json::to_string(&anomaly).unwrap()).unwrap();
            assert_eq!(read, anomaly);
        }
    }
}
