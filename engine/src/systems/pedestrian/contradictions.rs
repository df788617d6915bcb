//! What sensors say that cannot all be true: each with what it means for the position.

use crate::anomaly::{AnomalyKind, Cause};
use crate::figures::{Figures, figures};
use crate::word::Word;

/// The magnetic field contradicts the site, gravity or the gyro.
pub const FIELD_CONTRADICTION: AnomalyKind = AnomalyKind(Word::declared("field_contradiction", 31));
/// Rates and specific forces do not belong together: by them a swing does not come to rest where the foot stands.
pub const SWINGS_DO_NOT_CLOSE: AnomalyKind = AnomalyKind(Word::declared("swings_do_not_close", 32));
/// The gyro is not what it was: its bias has changed on the way.
pub const GYRO_CHANGED: AnomalyKind = AnomalyKind(Word::declared("gyro_changed", 38));
/// Two feet contradict each other: they part, or both are in the air.
pub const FEET_CONTRADICT: AnomalyKind = AnomalyKind(Word::declared("feet_contradict", 33));
/// Barometer and track disagree about the height.
pub const HEIGHTS_DISAGREE: AnomalyKind = AnomalyKind(Word::declared("heights_disagree", 34));
/// Fewer samples a second than a walking foot needs.
pub const LOW_RATE: AnomalyKind = AnomalyKind(Word::declared("low_rate", 35));
/// Markers disagree about how a walk is turned whose heading is unknown.
pub const MARKERS_DISAGREE: AnomalyKind = AnomalyKind(Word::declared("markers_disagree", 37));
/// Single samples that have nothing to do with their neighbours.
pub const SPIKES: AnomalyKind = AnomalyKind(Word::declared("spikes", 36));

/// What contradicts what, and by how much.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Contradiction {
    /// While standing the field dips as far up as it should dip down: force or field have the other sign.
    FieldUpsideDown {
        /// The dip that was found, below the horizon positive, degrees.
        dip_deg: f64,
        /// That of the site, degrees.
        site_dip_deg: f64,
    },
    /// While standing the field has another dip or strength than the site's.
    FieldOfAnotherPlace {
        /// The dip that was found, below the horizon positive, degrees.
        dip_deg: f64,
        /// That of the site, degrees.
        site_dip_deg: f64,
        /// The strength that was found, µT.
        found_ut: f64,
        /// That of the site, µT.
        site_ut: f64,
    },
    /// In the swings the field does not turn as the gyro does.
    FieldAgainstGyro {
        /// By how much it is off, as an angle, degrees.
        off_deg: f64,
    },
    /// A swing does not come to rest where the foot stands.
    SwingsDoNotClose {
        /// How fast the foot is then by its strapdown, m/s, on the mean.
        landing_speed_m_s: f64,
    },
    /// The swings of both feet leave the same velocity where the feet stand.
    BothFeetOpen {
        /// How much of their fastest speed, percent.
        open_percent: f64,
    },
    /// The gyro's bias has changed within some strides.
    GyroChanged {
        /// By how much, degrees/s.
        change_deg_s: f64,
    },
    /// The tracks of the feet part.
    FeetPart {
        /// How far they are apart while both stand, m.
        apart_m: f64,
    },
    /// Both feet are in the air at a time, as nobody walks.
    FeetOutOfStep {
        /// For how long in a step, s.
        in_the_air_s: f64,
    },
    /// The barometer has risen while the feet have not, and their forces say that they have: a lift.
    Lifted {
        /// By how much, m.
        rise_m: f64,
    },
    /// The barometer has risen while the feet have not, and nothing else says which is right.
    HeightsDisagree {
        /// By how much, m.
        rise_m: f64,
    },
    /// The pressure has changed while the feet stood still, as their forces say.
    PressureAlone {
        /// By how much as height, m.
        rise_m: f64,
    },
    /// Fewer samples a second than a walking foot needs.
    LowRate {
        /// How many there are, Hz.
        rate_hz: f64,
        /// How many there should be, Hz.
        least_hz: f64,
    },
    /// A single sample that has nothing to do with its neighbours.
    Spike {
        /// How far it is from both, rad/s.
        off_rad_s: f64,
    },
    /// By two markers a walk whose heading is unknown is turned differently.
    MarkersDisagree {
        /// By how much, degrees, counterclockwise positive.
        off_deg: f64,
    },
    /// The markers are where the walk would be seen in a mirror, as by no turn of it.
    MarkersMirrored {
        /// How many markers there have been.
        markers: u32,
    },
    /// Later markers outvote one by which the walk was turned.
    MarkersTurned {
        /// By how much that one was off, degrees, counterclockwise positive.
        off_deg: f64,
    },
}

impl Cause for Contradiction {
    fn kind(&self) -> AnomalyKind {
        match self {
            Contradiction::FieldUpsideDown { .. }
            | Contradiction::FieldOfAnotherPlace { .. }
            | Contradiction::FieldAgainstGyro { .. } => FIELD_CONTRADICTION,
            Contradiction::SwingsDoNotClose { .. } | Contradiction::BothFeetOpen { .. } => {
                SWINGS_DO_NOT_CLOSE
            }
            Contradiction::GyroChanged { .. } => GYRO_CHANGED,
            Contradiction::FeetPart { .. } | Contradiction::FeetOutOfStep { .. } => FEET_CONTRADICT,
            Contradiction::Lifted { .. }
            | Contradiction::HeightsDisagree { .. }
            | Contradiction::PressureAlone { .. } => HEIGHTS_DISAGREE,
            Contradiction::LowRate { .. } => LOW_RATE,
            Contradiction::Spike { .. } => SPIKES,
            Contradiction::MarkersDisagree { .. }
            | Contradiction::MarkersMirrored { .. }
            | Contradiction::MarkersTurned { .. } => MARKERS_DISAGREE,
        }
    }

    fn sentence(&self) -> String {
        match self {
            Contradiction::FieldUpsideDown { dip_deg, site_dip_deg } => format!(
                "while standing the field dips {dip_deg:.1}° where the site's dips {site_dip_deg:.1}°, as far the other way: the specific force or the field has the other sign. The field is left out and the heading is unknown; turn the sign in the mapping of the log's columns"
            ),
            Contradiction::FieldOfAnotherPlace { dip_deg, site_dip_deg, found_ut, site_ut } => format!(
                "while standing the field dips {dip_deg:.1}° and has {found_ut:.0} µT where the site's dips {site_dip_deg:.1}° and has {site_ut:.0} µT: a magnetometer with other axes than the accelerometer, or iron nearby. The field is left out and the heading is unknown; check the axes of the log's columns, or start away from steel"
            ),
            Contradiction::FieldAgainstGyro { off_deg } => format!(
                "when the foot turns, the field is {off_deg:.0}° from where the gyro says that it must be: a magnetometer with other axes than the gyro, or late. The field is left out from here on, and what it has said before counts no more: the heading is unknown"
            ),
            Contradiction::SwingsDoNotClose { landing_speed_m_s } => format!(
                "by rates and forces the foot still moves at {landing_speed_m_s:.2} m/s when it stands: scale, sign, axes or clock of gyro and accelerometer do not belong together. The track is bent by as much, and its sigma says so; check units, axes and times of the log's columns"
            ),
            Contradiction::BothFeetOpen { open_percent } => format!(
                "by rates and forces the swings of both feet leave {open_percent:.1} % of their speed when they end, alike: forces that come late, or clocks that run wrongly. The track is longer or shorter by as much, and its sigma says so; check the times of the log's columns"
            ),
            Contradiction::GyroChanged { change_deg_s } => format!(
                "the gyro's reading at rest has shifted by {change_deg_s:.2} °/s within a few strides: the sensor was knocked, warmed up or slipped on the foot. Its bias is estimated afresh, and the heading's sigma allows for the turn in between"
            ),
            Contradiction::FeetPart { apart_m } => format!(
                "both feet stand, and by their tracks they are {apart_m:.1} m apart: the sensor or the clock of one of them is wrong. The sigma covers either"
            ),
            Contradiction::FeetOutOfStep { in_the_air_s } => format!(
                "both feet are in the air for {in_the_air_s:.2} s of a walking step: the clocks of the two logs are apart, or one file was taken for both feet. What the feet know of each other is left out"
            ),
            Contradiction::Lifted { rise_m } => format!(
                "barometer and specific force say that the standing feet were moved by {rise_m:.1} m upwards, as by a lift: the height follows"
            ),
            Contradiction::HeightsDisagree { rise_m } => format!(
                "the barometer says {rise_m:.1} m more of height than the steps do: a lift, an escalator, or a change of the pressure. The height lies between, and its sigma covers both"
            ),
            Contradiction::PressureAlone { rise_m } => format!(
                "the pressure changed by {rise_m:.1} m of height while the feet stood still by their forces: the height does not follow, and the barometer counts from here anew"
            ),
            Contradiction::LowRate { rate_hz, least_hz } => format!(
                "samples come at {rate_hz:.0} Hz, where a walking foot needs {least_hz:.0} Hz and more: its swings are followed badly, and the sigma says so; set the sensor to a higher rate"
            ),
            Contradiction::Spike { off_rad_s } => format!(
                "a single sample is {off_rad_s:.0} rad/s from both of its neighbours; it is taken as lying between them"
            ),
            Contradiction::MarkersDisagree { off_deg } => format!(
                "the walk's heading is unknown, and by this marker it is turned by {:.0}° against what another one says: one of them is wrong. Until a third decides, the sigma is as large as the way",
                off_deg.abs()
            ),
            Contradiction::MarkersMirrored { markers } => format!(
                "the walk's heading is unknown, and {markers} markers are where it would be seen in a mirror: the markers' east and north are exchanged, or the axes of the sensors are left-handed. No turn is believed; check both"
            ),
            Contradiction::MarkersTurned { off_deg } => format!(
                "the walk's heading is unknown, and most markers agree that it is turned by {:.0}° against what an earlier one said: that one is left out",
                off_deg.abs()
            ),
        }
    }

    fn figures(&self) -> Figures {
        match *self {
            Contradiction::FieldUpsideDown { dip_deg, site_dip_deg } => {
                figures([("dip_deg", dip_deg.into()), ("site_dip_deg", site_dip_deg.into())])
            }
            Contradiction::FieldOfAnotherPlace { dip_deg, site_dip_deg, found_ut, site_ut } => figures([
                ("dip_deg", dip_deg.into()),
                ("site_dip_deg", site_dip_deg.into()),
                ("found_ut", found_ut.into()),
                ("site_ut", site_ut.into()),
            ]),
            Contradiction::FieldAgainstGyro { off_deg } => figures([("off_deg", off_deg.into())]),
            Contradiction::SwingsDoNotClose { landing_speed_m_s } => {
                figures([("landing_speed_m_s", landing_speed_m_s.into())])
            }
            Contradiction::BothFeetOpen { open_percent } => figures([("open_percent", open_percent.into())]),
            Contradiction::GyroChanged { change_deg_s } => figures([("change_deg_s", change_deg_s.into())]),
            Contradiction::FeetPart { apart_m } => figures([("apart_m", apart_m.into())]),
            Contradiction::FeetOutOfStep { in_the_air_s } => figures([("in_the_air_s", in_the_air_s.into())]),
            Contradiction::Lifted { rise_m } => figures([("lifted_m", rise_m.into())]),
            Contradiction::HeightsDisagree { rise_m } => figures([("rise_m", rise_m.into())]),
            Contradiction::PressureAlone { rise_m } => figures([("pressure_rise_m", rise_m.into())]),
            Contradiction::LowRate { rate_hz, least_hz } => {
                figures([("rate_hz", rate_hz.into()), ("least_hz", least_hz.into())])
            }
            Contradiction::Spike { off_rad_s } => figures([("off_rad_s", off_rad_s.into())]),
            Contradiction::MarkersDisagree { off_deg } => figures([("apart_deg", off_deg.abs().into())]),
            Contradiction::MarkersMirrored { markers } => figures([("markers", f64::from(markers).into())]),
            Contradiction::MarkersTurned { off_deg } => figures([("outvoted_deg", off_deg.abs().into())]),
        }
    }
}

impl Contradiction {
    /// An example of every one. Which comes after which is asked of every variant, so that the compiler asks for a new one.
    pub(crate) fn examples() -> impl Iterator<Item = Contradiction> {
        let first = Contradiction::FieldUpsideDown { dip_deg: -40.5, site_dip_deg: 40.3 };
        std::iter::successors(Some(first), |cause| match cause {
            Contradiction::FieldUpsideDown { .. } => Some(Contradiction::FieldOfAnotherPlace {
                dip_deg: -22.8,
                site_dip_deg: 40.3,
                found_ut: 48.0,
                site_ut: 48.1,
            }),
            Contradiction::FieldOfAnotherPlace { .. } => {
                Some(Contradiction::FieldAgainstGyro { off_deg: 52.0 })
            }
            Contradiction::FieldAgainstGyro { .. } => {
                Some(Contradiction::SwingsDoNotClose { landing_speed_m_s: 0.62 })
            }
            Contradiction::SwingsDoNotClose { .. } => Some(Contradiction::BothFeetOpen { open_percent: 1.4 }),
            Contradiction::BothFeetOpen { .. } => Some(Contradiction::GyroChanged { change_deg_s: 0.3 }),
            Contradiction::GyroChanged { .. } => Some(Contradiction::FeetPart { apart_m: 3.4 }),
            Contradiction::FeetPart { .. } => Some(Contradiction::FeetOutOfStep { in_the_air_s: 0.31 }),
            Contradiction::FeetOutOfStep { .. } => Some(Contradiction::Lifted { rise_m: 16.0 }),
            Contradiction::Lifted { .. } => Some(Contradiction::HeightsDisagree { rise_m: 5.0 }),
            Contradiction::HeightsDisagree { .. } => Some(Contradiction::PressureAlone { rise_m: 3.0 }),
            Contradiction::PressureAlone { .. } => {
                Some(Contradiction::LowRate { rate_hz: 20.0, least_hz: 40.0 })
            }
            Contradiction::LowRate { .. } => Some(Contradiction::Spike { off_rad_s: 30.0 }),
            Contradiction::Spike { .. } => Some(Contradiction::MarkersDisagree { off_deg: 71.0 }),
            Contradiction::MarkersDisagree { .. } => Some(Contradiction::MarkersMirrored { markers: 4 }),
            Contradiction::MarkersMirrored { .. } => Some(Contradiction::MarkersTurned { off_deg: 48.0 }),
            Contradiction::MarkersTurned { .. } => None,
        })
    }
}
