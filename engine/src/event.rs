//! What a session tells: the only thing that leaves the engine.

use serde::{Deserialize, Serialize};

use crate::figures::Figures;
use crate::sample::Foot;

/// One thing that a session found out. Events come in the order in which they became known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Event {
    /// The standing start has been used; points follow.
    Aligned(Alignment),
    /// The track has grown by one epoch.
    Point(TrackPoint),
    /// Points that were already told have been corrected in hindsight (a separation of the feet or
    /// a visit that was applied at its own past moment). Each has the time of the point it replaces.
    Revision {
        /// The corrected points, oldest first; an unbroken run of epochs.
        points: Vec<TrackPoint>,
    },
    /// A visit has been used, or turned down.
    Visit(VisitOutcome),
    /// Something is wrong with a sensor or with its data.
    Anomaly(Anomaly),
    /// A measurement has been weighed: its innovation and whether it was used.
    Aid(AidOutcome),
    /// The inspector stands somewhere, or stood: told again, with the same number, when the stand has
    /// ended and whenever hindsight knows more of its candidates.
    Stand(Stand),
}

/// How a session's first attitude and biases were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// The foot that was aligned.
    pub foot: Foot,
    /// Start and end of the stretch that was used, ns.
    pub t_start_ns: i64,
    /// End of the stretch that was used, ns.
    pub t_end_ns: i64,
    /// Heading of the sensor's x axis, clockwise from true north, rad.
    pub heading_rad: f64,
    /// Its sigma, rad.
    pub sigma_heading_rad: f64,
    /// Where the heading comes from: `given`, `magnetic` or `assumed`.
    pub heading_source: HeadingSource,
    /// Gyro bias found at rest, in b, rad/s.
    pub gyro_bias_b_rad_s: [f64; 3],
    /// Mean length of the specific force at rest, m/s².
    pub rest_specific_force_m_s2: f64,
}

/// Where a first heading comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeadingSource {
    /// The caller gave it.
    Given,
    /// From the magnetometer and the declination.
    Magnetic,
    /// Nothing is known: the first sensor's x axis is taken to point east.
    Assumed,
}

/// Where the inspector is at one epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackPoint {
    /// Time since the session's start, ns.
    pub t_ns: i64,
    /// The middle of the feet (the one foot, when there is one), east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Heading, clockwise from true north, rad in (−π, π].
    pub heading_rad: f64,
    /// Sigma of the heading, rad.
    pub sigma_heading_rad: f64,
    /// Sigmas of `position_n_m`, m.
    pub sigma_n_m: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
    /// The left foot, where it is recorded.
    pub left: Option<FootPoint>,
    /// The right foot, where it is recorded.
    pub right: Option<FootPoint>,
}

/// One foot at one epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FootPoint {
    /// The sensor, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Whether the foot stands.
    pub stance: bool,
}

/// What became of a visit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VisitOutcome {
    /// The marker's name.
    pub marker: String,
    /// The moment at which it was applied, ns.
    pub t_ns: i64,
    /// Position before the correction minus the marker's, east-north-up, m.
    pub before_minus_marker_n_m: [f64; 3],
    /// Position after the correction minus the marker's, east-north-up, m.
    pub after_minus_marker_n_m: [f64; 3],
    /// Normalised innovation squared.
    pub nis: f64,
    /// How many axes were measured (2 where the marker has no height).
    pub degrees_of_freedom: u8,
    /// Whether it was used.
    pub accepted: bool,
    /// Why it was not, in a sentence; empty when it was.
    pub reason: String,
}

/// Something that is wrong with a sensor or with its data, at a time and on a foot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anomaly {
    /// What it is.
    pub kind: AnomalyKind,
    /// Which foot; `None` when it concerns the session.
    pub foot: Option<Foot>,
    /// When it began, ns.
    pub t_start_ns: i64,
    /// When it ended, ns.
    pub t_end_ns: i64,
    /// How many samples it concerns.
    pub samples: u64,
    /// What was expected and what was found, in a sentence with units.
    pub detail: String,
    /// The figures of that sentence, by name; `None` where it was stored before they were kept.
    #[serde(default)]
    pub figures: Option<Figures>,
}

impl Anomaly {
    /// Whether both say the same, with figures or without.
    pub fn says_the_same(&self, other: &Anomaly) -> bool {
        let said = |anomaly: &Anomaly| {
            (anomaly.kind, anomaly.foot, anomaly.t_start_ns, anomaly.t_end_ns, anomaly.samples)
        };
        said(self) == said(other) && self.detail == other.detail
    }
}

/// The kinds of sensor trouble that are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AnomalyKind {
    /// No samples for longer than several intervals.
    Gap,
    /// A time stamp equal to the one before.
    RepeatedTime,
    /// A time stamp before the one before.
    BackwardTime,
    /// A reading at the end of the sensor's range.
    Saturation,
    /// An axis that does not change.
    StuckAxis,
    /// A reading that is not a number, or infinite.
    NotFinite,
    /// The specific force at rest is not that of gravity.
    ImpossibleRestGravity,
    /// The two sensors are mounted in a way that contradicts their motion, or one fell out of place.
    WrongMounting,
    /// The foot sets off more often than any foot can.
    ImpossibleCadence,
    /// The session did not start with a still stretch.
    NoStillStart,
    /// The magnetic field is not that of the site.
    MagneticField,
    /// One foot's log begins late, ends early or is silent while the other goes on.
    FootMissing,
    /// The heading's sigma has passed what the linearised filter can be trusted with.
    HeadingUncertain,
    /// The filter met a number it could not use and restarted a foot from the last stance.
    FilterReset,
}

/// The aids a session can use beside the strapdown itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AidKind {
    /// Zero velocity in stance.
    Zupt,
    /// Magnetic heading.
    Heading,
    /// Magnetic angular rate.
    Maru,
    /// Smallest separation of the feet.
    Separation,
    /// Marker position.
    Markers,
    /// Height by the barometer.
    Altimeter,
}

/// A measurement that was weighed. Rejection is an outcome, not an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AidOutcome {
    /// The moment it applies to, ns.
    pub t_ns: i64,
    /// The foot; `None` where it concerns both.
    pub foot: Option<Foot>,
    /// Which aid.
    pub aid: AidKind,
    /// Normalised innovation squared, mean over the updates that this outcome stands for.
    pub nis: f64,
    /// Degrees of freedom of one update.
    pub degrees_of_freedom: u8,
    /// How many updates this outcome stands for (a stance is told as one).
    pub updates: u32,
    /// Whether it was used.
    pub accepted: bool,
}

/// A place at which the inspector stands or stood, and the markers that it may be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stand {
    /// Counts the stands of a session from 1.
    pub number: u32,
    /// When the feet came to rest, ns.
    pub t_start_ns: i64,
    /// When the first foot lifted, ns; the latest time known while it lasts.
    pub t_end_ns: i64,
    /// Whether the inspector still stands there.
    pub lasts: bool,
    /// Where the track had it when it was first told, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Likeliest first, and last the share of standing at none of those named. They add up to 1.
    pub candidates: Vec<MarkerCandidate>,
    /// The visit that was made of it, if one was used.
    pub visit: Option<StandVisit>,
}

/// A marker that a place may be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkerCandidate {
    /// Its name; `None` for the share of everything that is not named.
    pub marker: Option<String>,
    /// How probable it is, 0 to 1.
    pub probability: f64,
    /// How far it is from the place in plan, m.
    pub distance_m: Option<f64>,
}

/// A visit that belongs to a stand.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StandVisit {
    /// The marker's name.
    pub marker: String,
    /// Whether the engine made it, as it was nearly certain; otherwise somebody keyed it in.
    pub automatic: bool,
}
