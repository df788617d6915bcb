//! What can be wrong with the cabin's devices, and why its poses cannot be found: each with its figures and its sentence.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::watch::CabinAnomaly;
use crate::anomaly::{Anomaly, AnomalyKind, Cause};
use crate::figures::{Figure, Figures, figures};
use crate::stream::StreamId;
use crate::word::Word;

const fn kind(word: &str, order: u8) -> AnomalyKind {
    AnomalyKind(Word::declared(word, order))
}

/// What a refused ray looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RayTrouble {
    /// Another prism.
    Prism,
    /// A wrong distance.
    Distance,
    /// A wrong direction.
    Direction,
}

impl RayTrouble {
    fn word(self) -> &'static str {
        match self {
            RayTrouble::Prism => "wrong_prism",
            RayTrouble::Distance => "wrong_distance",
            RayTrouble::Direction => "wrong_direction",
        }
    }
}

/// What is wrong with a device, and by how much.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum CabinCause {
    /// Readings that no cabin can have.
    OutOfRange {
        /// Specific force, m/s².
        force_m_s2: f64,
        /// Rate, rad/s.
        rate_rad_s: f64,
    },
    /// A sample that is not later than the one before.
    TimeRepeats,
    /// An inertial sensor of which nothing came for a while.
    SensorSilent {
        /// For how long, s.
        silent_s: f64,
    },
    /// A device that writes nothing.
    Silent,
    /// All devices of a kind write nothing.
    AllSilent,
    /// Nothing agrees with the pose any more.
    Lost,
    /// Most devices of a kind contradict the pose at once.
    Contradiction {
        /// How many.
        devices: u64,
        /// By how much, root mean square of the worst, m.
        off_m: f64,
    },
    /// Two antennas, or prisms, in each other's place.
    Exchanged {
        /// The other.
        with: String,
    },
    /// A fix that the instrument contradicts.
    Misplaced,
    /// A fix that is not where the pose has it.
    WrongFix {
        /// How far east, north and up, m.
        off_n_m: [f64; 3],
    },
    /// All antennas of a make at once.
    WrongMake,
    /// A ray that is not where the pose has it.
    WrongRay {
        /// What it looks like.
        looks_like: RayTrouble,
        /// By how much in distance, m.
        distance_m: f64,
        /// By how much in azimuth and zenith angle, arc seconds.
        angles_arcsec: [f64; 2],
    },
    /// Rows that are later than the instrument says.
    Late {
        /// By how much, s.
        late_s: f64,
        /// How sure that is, s.
        sigma_s: f64,
    },
    /// An inertial sensor that says another attitude than antennas and prisms.
    Mounting {
        /// Level, degrees.
        level_deg: f64,
        /// Yaw, degrees.
        yaw_deg: f64,
    },
    /// Legs that no pose fits.
    NoPose {
        /// Angles of the rotator, rad.
        angles_rad: [f64; 2],
        /// Lengths, m.
        legs_m: [f64; 6],
    },
    /// A leg whose readings are off by more than a bias.
    LegOff {
        /// What it reads too much, m.
        off_m: f64,
    },
    /// An angle of the rotator whose readings are off.
    AngleOff {
        /// What it reads too much, rad.
        off_rad: f64,
    },
    /// Streamed rows with tags far ahead of the inertial sensor's.
    Ahead {
        /// By how much, s.
        ahead_s: f64,
    },
    /// There is no pose yet though rows come.
    NoStart {
        /// Why, in a sentence.
        why: String,
    },
    /// A sensor that reads the same again and again.
    Stuck,
    /// Samples, or rows of a kind of device, that scatter more than is stated.
    Noisy {
        /// How many times the stated sigma.
        times: f64,
    },
    /// An inertial sensor whose readings leapt and whose biases have followed: the leap was its own.
    BiasLeap {
        /// The leap, m/s².
        force_m_s2: f64,
        /// The same of the gyro, rad/s.
        rate_rad_s: f64,
    },
    /// An error that creeps in: it is where its own process does not bring it.
    Creeps {
        /// How many times its sigma.
        sigmas: f64,
    },
    /// Rows that came after ones with a later tag.
    Unordered {
        /// How many.
        rows: u64,
    },
    /// Rows whose numbers no such device can have.
    BadRows {
        /// How many.
        rows: u64,
        /// In which column, first.
        column: Cow<'static, str>,
        /// What was expected there.
        expected: Cow<'static, str>,
        /// What was found.
        found: f64,
    },
    /// Rows of a device that the instrument does not have.
    Unknown {
        /// How many.
        rows: u64,
        /// What was found.
        found: String,
    },
    /// A stream without readings.
    NotStored,
    /// There is no pose, or no more of them.
    Refused {
        /// Why, in a sentence.
        why: String,
    },
}

impl CabinCause {
    /// The word of its kind.
    pub fn word(&self) -> &'static str {
        use CabinCause as C;
        match self {
            C::OutOfRange { .. } => "out_of_range",
            C::TimeRepeats => "time_repeats",
            C::SensorSilent { .. } | C::Silent | C::AllSilent => "silent",
            C::Lost => "lost",
            C::Contradiction { .. } => "contradiction",
            C::Exchanged { .. } => "exchanged",
            C::Misplaced | C::WrongFix { .. } => "wrong_fix",
            C::WrongMake => "wrong_make",
            C::WrongRay { looks_like, .. } => looks_like.word(),
            C::Late { .. } => "late",
            C::Mounting { .. } => "mounting",
            C::NoPose { .. } => "no_pose",
            C::LegOff { .. } => "wrong_length",
            C::AngleOff { .. } => "wrong_angle",
            C::Ahead { .. } => "clock_ahead",
            C::Stuck => "stuck",
            C::Noisy { .. } => "noisy",
            C::BiasLeap { .. } => "bias_leap",
            C::Creeps { .. } => "creeps",
            C::NoStart { .. } => "no_start",
            C::Unordered { .. } => "unordered",
            C::BadRows { .. } => "bad_rows",
            C::Unknown { .. } => "unknown_device",
            C::NotStored => "stream_missing",
            C::Refused { .. } => "no_cabin",
        }
    }

    /// In a sentence, without the device.
    pub fn sentence(&self) -> String {
        use CabinCause as C;
        match self {
            C::OutOfRange { force_m_s2, rate_rad_s } => format!(
                "expected readings of a cabin, found {force_m_s2:.3} m/s² and {rate_rad_s:.3} rad/s; the sample was left out"
            ),
            C::TimeRepeats => {
                "expected later samples, found one at the same time; it was left out".to_owned()
            }
            C::SensorSilent { silent_s } => {
                format!("no samples for {silent_s:.2} s; its biases are taken to be others")
            }
            C::Silent => "it writes nothing".to_owned(),
            C::AllSilent => "none of them writes".to_owned(),
            C::Lost => "nothing agreed with the pose for three seconds; it was found anew".to_owned(),
            C::Contradiction { devices, off_m } => format!(
                "{devices} of them contradict the pose at once, by {:.0} mm: a clock, the encoders or the inertial sensor is off; poses are told with as much more sigma",
                1e3 * off_m
            ),
            C::Exchanged { with } => format!("it stands where {with} should: the two are exchanged"),
            C::Misplaced => "it is not where the instrument has it beside the others".to_owned(),
            C::WrongFix { off_n_m: [e, n, u] } => format!(
                "told as fixed, it is {:.0} mm off ({:.0} {:.0} {:.0})",
                1e3 * libm::sqrt(e * e + n * n + u * u),
                1e3 * e,
                1e3 * n,
                1e3 * u
            ),
            C::WrongMake => "all antennas of the make are off at once: its base station".to_owned(),
            C::WrongRay { distance_m, angles_arcsec: [azimuth, zenith], .. } => format!(
                "off by {:.1} mm of distance and {azimuth:.1}″, {zenith:.1}″ of azimuth and zenith angle",
                1e3 * distance_m
            ),
            C::Late { late_s, sigma_s } => format!(
                "its rows are {:.0} ms later than stated, by the pose itself ({:.0} ms)",
                1e3 * late_s,
                1e3 * sigma_s
            ),
            C::Mounting { level_deg, yaw_deg } => format!(
                "the inertial sensor says another attitude than antennas and prisms do: {level_deg:.2}° of level and {yaw_deg:.1}° of yaw apart; check the mounting (c_b_s), and which antenna is which"
            ),
            C::NoPose { angles_rad: [a, b], legs_m } => {
                format!("no pose of the platform fits a {a} rad, b {b} rad and legs {legs_m:?} m")
            }
            C::LegOff { off_m } => format!(
                "it reads {:.1} mm too much, by its own leap or by the stations' rays: that is taken off, and its sigma is widened",
                1e3 * off_m
            ),
            C::AngleOff { off_rad } => format!(
                "it reads {:.2} mrad too much, by its own leap or by the stations' rays: that is taken off, and its sigma is widened",
                1e3 * off_rad
            ),
            C::Ahead { ahead_s } => format!(
                "its clock is {ahead_s:.1} s ahead of the inertial sensor's; such rows are left out: set the clock"
            ),
            C::Stuck => "it reads the same again and again; such samples are left out".to_owned(),
            C::Noisy { times } => format!(
                "it scatters {times:.1} times as much as stated; poses are told with as much more sigma"
            ),
            C::BiasLeap { force_m_s2, rate_rad_s } => format!(
                "its readings leapt by {force_m_s2:.3} m/s² and {rate_rad_s:.6} rad/s and stayed there: its biases are estimated afresh"
            ),
            C::Creeps { sigmas } => format!(
                "its error creeps away, {sigmas:.0} sigmas from what it may be; it is taken to be unknown"
            ),
            C::Unordered { rows } => {
                format!("{rows} rows came after ones with a later tag; each was put at its own")
            }
            C::BadRows { rows, column, expected, found } => {
                format!("{rows} rows were left out; {column}: expected {expected}, found {found}")
            }
            C::Unknown { rows, found } => {
                format!("{rows} rows were left out: the instrument has no {found}")
            }
            C::NotStored => "a stream of the session has no readings".to_owned(),
            C::NoStart { why } | C::Refused { why } => why.clone(),
        }
    }

    fn figures(&self) -> Figures {
        use CabinCause as C;
        let count = |n: &u64| Figure::Number(*n as f64);
        match self {
            C::OutOfRange { force_m_s2, rate_rad_s } => {
                figures([("force_m_s2", (*force_m_s2).into()), ("rate_rad_s", (*rate_rad_s).into())])
            }
            C::SensorSilent { silent_s } => figures([("silent_s", (*silent_s).into())]),
            C::Contradiction { devices, off_m } => {
                figures([("devices", count(devices)), ("off_m", (*off_m).into())])
            }
            C::Exchanged { with } => figures([("with", with.as_str().into())]),
            C::WrongFix { off_n_m: [e, n, u] } => {
                figures([("off_e_m", (*e).into()), ("off_n_m", (*n).into()), ("off_u_m", (*u).into())])
            }
            C::WrongRay { distance_m, angles_arcsec: [azimuth, zenith], .. } => figures([
                ("distance_m", (*distance_m).into()),
                ("azimuth_arcsec", (*azimuth).into()),
                ("zenith_arcsec", (*zenith).into()),
            ]),
            C::Late { late_s, sigma_s } => {
                figures([("late_s", (*late_s).into()), ("sigma_s", (*sigma_s).into())])
            }
            C::Mounting { level_deg, yaw_deg } => {
                figures([("level_deg", (*level_deg).into()), ("yaw_deg", (*yaw_deg).into())])
            }
            C::NoPose { angles_rad: [a, b], .. } => figures([("a_rad", (*a).into()), ("b_rad", (*b).into())]),
            C::LegOff { off_m } => figures([("off_m", (*off_m).into())]),
            C::BiasLeap { force_m_s2, rate_rad_s } => {
                figures([("force_m_s2", (*force_m_s2).into()), ("rate_rad_s", (*rate_rad_s).into())])
            }
            C::AngleOff { off_rad } => figures([("off_rad", (*off_rad).into())]),
            C::Noisy { times } => figures([("times", (*times).into())]),
            C::Creeps { sigmas } => figures([("sigmas", (*sigmas).into())]),
            C::Ahead { ahead_s } => figures([("ahead_s", (*ahead_s).into())]),
            C::Unordered { rows } => figures([("rows", count(rows))]),
            C::BadRows { rows, column, found, .. } => figures([
                ("rows", count(rows)),
                ("column", column.as_ref().into()),
                ("found", (*found).into()),
            ]),
            C::Unknown { rows, found } => figures([("rows", count(rows)), ("found", found.as_str().into())]),
            C::TimeRepeats
            | C::Silent
            | C::AllSilent
            | C::Lost
            | C::Misplaced
            | C::WrongMake
            | C::Stuck
            | C::NotStored => Figures::new(),
            C::NoStart { why } | C::Refused { why } => figures([("why", why.as_str().into())]),
        }
    }

    pub(super) fn kind(&self) -> AnomalyKind {
        use CabinCause as C;
        match self {
            C::OutOfRange { .. } => kind("out_of_range", 60),
            C::TimeRepeats => kind("time_repeats", 61),
            C::SensorSilent { .. } | C::Silent | C::AllSilent => kind("silent", 62),
            C::Lost => kind("lost", 63),
            C::Contradiction { .. } => kind("contradiction", 77),
            C::Exchanged { .. } => kind("exchanged", 64),
            C::Misplaced | C::WrongFix { .. } => kind("wrong_fix", 65),
            C::WrongMake => kind("wrong_make", 66),
            C::WrongRay { looks_like: RayTrouble::Prism, .. } => kind("wrong_prism", 67),
            C::WrongRay { looks_like: RayTrouble::Distance, .. } => kind("wrong_distance", 68),
            C::WrongRay { .. } => kind("wrong_direction", 69),
            C::Late { .. } => kind("late", 70),
            C::Mounting { .. } => kind("mounting", 71),
            C::NoPose { .. } => kind("no_pose", 72),
            C::LegOff { .. } => kind("wrong_length", 78),
            C::AngleOff { .. } => kind("wrong_angle", 85),
            C::Ahead { .. } => kind("clock_ahead", 79),
            C::Stuck => kind("stuck", 80),
            C::Noisy { .. } => kind("noisy", 82),
            C::BiasLeap { .. } => kind("bias_leap", 83),
            C::Creeps { .. } => kind("creeps", 84),
            C::NoStart { .. } => kind("no_start", 81),
            C::Unordered { .. } => kind("unordered", 73),
            C::BadRows { .. } => kind("bad_rows", 74),
            C::Unknown { .. } => kind("unknown_device", 75),
            C::Refused { .. } => kind("no_cabin", 76),
            C::NotStored => AnomalyKind::STREAM_MISSING,
        }
    }
}

/// A cause with the device that it is of.
#[derive(Debug)]
struct OfDevice<'a> {
    device: &'a str,
    cause: &'a CabinCause,
}

impl Cause for OfDevice<'_> {
    fn kind(&self) -> AnomalyKind {
        self.cause.kind()
    }

    fn sentence(&self) -> String {
        match self.cause {
            CabinCause::Refused { why } => why.clone(),
            cause => format!("{}: {}", self.device, cause.sentence()),
        }
    }

    fn figures(&self) -> Figures {
        let mut figures = self.cause.figures();
        if !matches!(self.cause, CabinCause::Refused { .. }) {
            figures.insert("device".to_owned(), self.device.into());
        }
        figures
    }
}

/// As a session tells it: of the device's stream.
pub(super) fn told(found: &CabinAnomaly, stream: Option<StreamId>) -> Anomaly {
    let rows = match &found.cause {
        CabinCause::Unordered { rows }
        | CabinCause::BadRows { rows, .. }
        | CabinCause::Unknown { rows, .. } => *rows,
        _ => 0,
    };
    OfDevice { device: &found.source, cause: &found.cause }.anomaly(stream, found.ends_ns, rows)
}
