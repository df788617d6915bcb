//! What clients see, as `docs/wire.md` tells it. A row of the store that is shown as it is has its
//! shape in `store`; what is put together for the wire has it here.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use time::OffsetDateTime;
use uuid::Uuid;

use crate::store::alarms::{Acknowledged, Alarm};
use crate::store::anomalies::Anomaly;
use crate::store::clock_ties::ClockTie;
use crate::store::faults::Fault;
use crate::store::inspectors::Inspector;
use crate::store::jobs::Job;
use crate::store::logs::Log;
use crate::store::sessions::Session;
use crate::store::stands::Stand;
use crate::store::visits::Visit;

/// A session with what hangs on it: `GET /sessions/{id}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SessionView {
    /// The session itself.
    #[serde(flatten)]
    pub session: Session,
    /// Its logs, oldest first.
    pub logs: Vec<Log>,
    /// How many visits were told.
    pub visits: u64,
    /// How many anomalies were found.
    pub anomalies: u64,
    /// How the clock of what was keyed in stands to that of the logs; null where there was nothing to tie.
    pub clock_tie: Option<ClockTie>,
}

/// One thing that has changed: what the feed sends on. Published after it is on disk, never before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Change {
    /// An inspector is somewhere.
    Position(Position),
    /// A stretch of a trail was corrected in hindsight.
    Revision {
        /// Whose trail.
        session_id: Uuid,
        /// `[t_ns, e_m, n_m]`, oldest first; replaces the trail from the first to the last of these times.
        points: Vec<(i64, f64, f64)>,
    },
    /// A session began, changed its state or its summary, or was deleted.
    Session {
        /// As it stands now; `None` only with `deleted`.
        #[serde(skip_serializing_if = "Option::is_none")]
        session: Option<Session>,
        /// The id of a session that is gone.
        #[serde(skip_serializing_if = "Option::is_none")]
        deleted: Option<Uuid>,
    },
    /// A visit was told or weighed.
    Visit(Visit),
    /// A visit was taken back.
    VisitRemoved {
        /// Whose it was.
        session_id: Uuid,
        /// Which.
        id: Uuid,
    },
    /// Somebody stands somewhere, or more is known of where somebody stood.
    Stands {
        /// Whose they are.
        session_id: Uuid,
        /// Whether these are all there are; otherwise they take the place of those of their numbers.
        all: bool,
        /// By number.
        stands: Vec<Stand>,
    },
    /// A sensor is in trouble.
    Anomaly(Anomaly),
    /// A fault was reported or closed.
    Fault {
        /// As it stands now.
        fault: Fault,
    },
    /// Somebody has to see to something.
    AlarmRaised {
        /// To what.
        alarm: Alarm,
    },
    /// It is so no longer.
    AlarmEnded {
        /// The alarm's key.
        key: String,
    },
    /// An alarm was acknowledged.
    Alarm {
        /// Which, by whom and when.
        acknowledged: Acknowledged,
    },
    /// The marker table has changed: fetch it again.
    Markers {
        /// Counts its changes.
        revision: i64,
    },
    /// A job has come further.
    Job {
        /// As it stands now.
        job: Job,
    },
    /// An inspector was added, renamed or removed.
    Inspectors {
        /// All of them, as they are now.
        inspectors: Vec<Inspector>,
    },
}

impl Change {
    /// The session that this concerns, when it concerns one.
    pub fn session_id(&self) -> Option<Uuid> {
        match self {
            Change::Position(position) => Some(position.session_id),
            Change::Revision { session_id, .. }
            | Change::VisitRemoved { session_id, .. }
            | Change::Stands { session_id, .. } => Some(*session_id),
            Change::Session { session, deleted } => session.as_ref().map(|session| session.id).or(*deleted),
            Change::Visit(visit) => Some(visit.session_id),
            Change::Anomaly(anomaly) => Some(anomaly.session_id),
            Change::Fault { .. }
            | Change::AlarmRaised { .. }
            | Change::AlarmEnded { .. }
            | Change::Alarm { .. }
            | Change::Markers { .. }
            | Change::Job { .. }
            | Change::Inspectors { .. } => None,
        }
    }
}

/// Where an inspector is, and how sure that is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// The walk.
    pub session_id: Uuid,
    /// Who walks.
    pub inspector_id: Uuid,
    /// Time since the session's start, ns.
    pub t_ns: i64,
    /// East-north-up, m.
    pub position_m: [f64; 3],
    /// Clockwise from true north, rad.
    pub heading_rad: f64,
    /// Sigmas of east, north, up, m.
    pub sigma_m: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
    /// Over the ground, m/s.
    pub speed_m_s: f64,
    /// What the inspector does.
    pub state: Motion,
    /// Seconds since the last accepted visit, or since the start.
    pub since_marker_s: f64,
    /// Metres walked since then.
    pub since_marker_m: f64,
    /// Metres walked since the start.
    pub distance_m: f64,
    /// When the server had it.
    #[serde(with = "time::serde::rfc3339")]
    pub received_at: OffsetDateTime,
}

/// What an inspector does, as far as the samples tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "InspectorMotion")]
pub enum Motion {
    /// The streams move.
    Walking,
    /// Both stand.
    Standing,
    /// Nothing has come for some seconds.
    Silent,
}
