//! What is wrong with a stream or its data: kind, time, sentence, and the figures of the sentence.

use serde::{Deserialize, Serialize};

use crate::figures::Figures;
use crate::stream::StreamId;
use crate::word::Word;

/// Something that is wrong with a sensor or with its data, at a time and on a stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anomaly {
    /// What it is.
    pub kind: AnomalyKind,
    /// Which stream; `None` when it concerns the session.
    pub stream: Option<StreamId>,
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
            (anomaly.kind, anomaly.stream, anomaly.t_start_ns, anomaly.t_end_ns, anomaly.samples)
        };
        said(self) == said(other) && self.detail == other.detail
    }
}

/// A kind of anomaly, by its word. Those that any system can have are declared here, the others by the systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AnomalyKind(pub Word);

impl AnomalyKind {
    /// No samples for longer than several intervals.
    pub const GAP: AnomalyKind = AnomalyKind(Word::declared("gap", 0));
    /// A time stamp equal to the one before.
    pub const REPEATED_TIME: AnomalyKind = AnomalyKind(Word::declared("repeated_time", 1));
    /// A time stamp before the one before.
    pub const BACKWARD_TIME: AnomalyKind = AnomalyKind(Word::declared("backward_time", 2));
    /// A reading at the end of the sensor's range.
    pub const SATURATION: AnomalyKind = AnomalyKind(Word::declared("saturation", 3));
    /// An axis that does not change.
    pub const STUCK_AXIS: AnomalyKind = AnomalyKind(Word::declared("stuck_axis", 4));
    /// A reading that is not a number, or infinite.
    pub const NOT_FINITE: AnomalyKind = AnomalyKind(Word::declared("not_finite", 5));
    /// The specific force at rest is not that of gravity.
    pub const IMPOSSIBLE_REST_GRAVITY: AnomalyKind =
        AnomalyKind(Word::declared("impossible_rest_gravity", 6));
    /// The sensors are mounted in a way that contradicts their motion, or one fell out of place.
    pub const WRONG_MOUNTING: AnomalyKind = AnomalyKind(Word::declared("wrong_mounting", 7));
    /// The session did not start with a still stretch.
    pub const NO_STILL_START: AnomalyKind = AnomalyKind(Word::declared("no_still_start", 9));
    /// The magnetic field is not that of the site.
    pub const MAGNETIC_FIELD: AnomalyKind = AnomalyKind(Word::declared("magnetic_field", 10));
    /// A stream has no samples, begins late, ends early or is silent while others go on.
    pub const STREAM_MISSING: AnomalyKind = AnomalyKind(Word::declared("stream_missing", 12));
    /// The heading's sigma has passed what the linearised filter can be trusted with.
    pub const HEADING_UNCERTAIN: AnomalyKind = AnomalyKind(Word::declared("heading_uncertain", 13));
    /// The filter met a number it could not use and restarted from its last sound state.
    pub const FILTER_RESET: AnomalyKind = AnomalyKind(Word::declared("filter_reset", 14));

    /// Its word.
    pub fn as_str(&self) -> &str {
        self.0.as_str()
    }
}

/// What lies behind an anomaly, with its figures.
pub trait Cause {
    /// Its kind.
    fn kind(&self) -> AnomalyKind;
    /// What was expected and what was found, in a sentence with units. It is part of a track's hash: another wording
    /// would make stored tracks look different.
    fn sentence(&self) -> String;
    /// The figures of the sentence. With the kind, their names say which sentence it is.
    fn figures(&self) -> Figures;

    /// The anomaly that reports it.
    fn anomaly(&self, stream: Option<StreamId>, [t_start_ns, t_end_ns]: [i64; 2], samples: u64) -> Anomaly {
        Anomaly {
            kind: self.kind(),
            stream,
            t_start_ns,
            t_end_ns,
            samples,
            detail: self.sentence(),
            figures: Some(self.figures()),
        }
    }
}
