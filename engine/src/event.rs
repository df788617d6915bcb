//! What a session reports: the only thing that leaves the engine.

use serde::{Deserialize, Serialize};

use crate::anomaly::Anomaly;
use crate::stream::StreamId;
use crate::visit::Visit;
use crate::word::Word;

/// One thing that a session found out. Events come in the order in which they became known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Event {
    /// The standing start has been used; points follow.
    Aligned(Alignment),
    /// The track has grown by one epoch.
    Point(TrackPoint),
    /// Points that were already reported have been corrected in hindsight (a visit that was applied at its own past
    /// moment, or smoothing). Each has the time of the point it replaces.
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
    /// Somebody stands somewhere, or stood: reported again, with the same number, when the stand has
    /// ended and whenever hindsight knows more of its candidates.
    Stand(Stand),
}

/// How a session's first attitude and biases were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// The stream that was aligned.
    pub stream: StreamId,
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

/// Where what is positioned is at one epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackPoint {
    /// Time since the session's start, ns.
    pub t_ns: i64,
    /// The position that the system declares as its point, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Heading, clockwise from true north, rad in (−π, π].
    pub heading_rad: f64,
    /// Sigma of the heading, rad.
    pub sigma_heading_rad: f64,
    /// Sigmas of `position_n_m`, m.
    pub sigma_n_m: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
    /// Roll and pitch, where the system knows them.
    pub tilt: Option<Tilt>,
    /// The parts that the system declares, in that order; `None` for one that is not there.
    pub parts: [Option<Part>; MOST_PARTS],
}

/// A point has at most so many parts.
pub const MOST_PARTS: usize = 2;

/// Roll and pitch of the body at one epoch; the heading stands in the point itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tilt {
    /// About the body's x axis, rad in (−π, π].
    pub roll_rad: f64,
    /// About the levelled y axis, nose up positive, rad in [−π/2, π/2].
    pub pitch_rad: f64,
    /// Sigma of the roll, rad.
    pub sigma_roll_rad: f32,
    /// Sigma of the pitch, rad.
    pub sigma_pitch_rad: f32,
}

/// One part of what is positioned at one epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Where it is, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Whether it stands still on the ground.
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

impl VisitOutcome {
    /// Whether there was no marker to hold the visit against: its places then count from the frame's origin.
    pub fn is_of_a_new_point(&self) -> bool {
        self.degrees_of_freedom > 0 && !self.accepted && self.nis == 0.0
    }

    /// Of a visit that could not be weighed at all.
    pub fn turned_down(visit: &Visit, reason: String) -> VisitOutcome {
        VisitOutcome {
            marker: visit.marker.clone(),
            t_ns: visit.moment_ns(),
            before_minus_marker_n_m: [f64::NAN; 3],
            after_minus_marker_n_m: [f64::NAN; 3],
            nis: f64::NAN,
            degrees_of_freedom: 0,
            accepted: false,
            reason,
        }
    }
}

/// A measurement that a system uses beside its strapdown, by the word that the system declares for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AidKind(pub Word);

impl AidKind {
    /// Visits to markers, which every system has: they come last but those that a system declares after them.
    pub const MARKERS: AidKind = AidKind(Word::declared("markers", 4));

    /// Its word.
    pub fn as_str(&self) -> &str {
        self.0.as_str()
    }
}

/// A measurement that was weighed. Rejection is an outcome, not an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AidOutcome {
    /// The moment it applies to, ns.
    pub t_ns: i64,
    /// The stream; `None` where it concerns several.
    pub stream: Option<StreamId>,
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

/// A place at which somebody stands or stood, and the markers that it may be.
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
