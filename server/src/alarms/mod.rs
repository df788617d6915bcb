//! What somebody has to see to: who is lost, who has not moved for long, and faults of high severity.
//!
//! [`watch`] looks once a second at what the dashboards were told, has [`found`] say what is wrong now, notes what is new or over in the
//! store and tells it to dashboards and webhooks. So an alarm is raised once, for everybody, whether or not a page is open.

mod found;
mod watch;

use std::time::Duration;

use time::OffsetDateTime;
use uuid::Uuid;

use crate::config::Config;
use crate::store::faults::Fault;

pub(crate) use watch::work;

/// From when on something is an alarm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// Nothing was heard of a session for so long: lost.
    pub(crate) lost_after: Duration,
    /// It left without saying so: nothing new is raised of it.
    pub(crate) gone_after: Duration,
    /// A person has stayed on one spot for so long; `None`: never.
    pub(crate) standing_after: Option<Duration>,
    /// What one spot is, m: wider than the track of somebody who stands drifts and is corrected.
    pub(crate) one_spot_m: f64,
}

impl Limits {
    /// As the server was set up.
    pub(crate) fn of(config: &Config) -> Limits {
        let seconds = |s: u32| Duration::from_secs(u64::from(s));
        Limits {
            lost_after: seconds(config.lost_after_s),
            gone_after: seconds(config.gone_after_s),
            standing_after: (config.standing_after_s > 0).then(|| seconds(config.standing_after_s)),
            one_spot_m: 3.0,
        }
    }
}

/// What is looked at.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watched {
    /// Live sessions.
    pub(crate) heard: Vec<Heard>,
    /// Faults that stand.
    pub(crate) faults: Vec<Fault>,
}

/// A live session of which something was heard.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Heard {
    /// Which.
    pub(crate) session_id: Uuid,
    /// Who.
    pub(crate) inspector_id: Uuid,
    /// When it began.
    pub(crate) started_at: OffsetDateTime,
    /// The last position, on the session's clock, ns.
    pub(crate) last_ns: i64,
    /// East-north-up, m.
    pub(crate) position_m: [f64; 3],
    /// Sigmas of east, north, up, m.
    pub(crate) sigma_m: [f64; 3],
    /// When the server had it.
    pub(crate) received_at: OffsetDateTime,
    /// Since when a person has been on one spot, ns; `None` of what is no person.
    pub(crate) stays_since_ns: Option<i64>,
}
