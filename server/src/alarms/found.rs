//! What is wrong now.

use std::collections::BTreeMap;

use time::OffsetDateTime;
use uuid::Uuid;

use super::{Heard, Limits, Watched};
use crate::store::alarms::{Alarm, AlarmKind};
use crate::store::faults::{Fault, FaultState, Severity};
use crate::utc;

/// All alarms that stand now, by key; `standing` are those that stood when it was looked at last.
pub(super) fn found(
    watched: &Watched,
    limits: &Limits,
    standing: &BTreeMap<String, Alarm>,
    now: OffsetDateTime,
) -> BTreeMap<String, Alarm> {
    let lost = watched.heard.iter().filter_map(|heard| lost(heard, limits, standing, now));
    let still = watched.heard.iter().filter_map(|heard| still(heard, limits, standing, now));
    let faults = watched.faults.iter().filter_map(|fault| unseen(fault, now));
    lost.chain(still).chain(faults).map(|alarm| (alarm.key.clone(), alarm)).collect()
}

fn of_session(heard: &Heard, kind: AlarmKind, since_ns: i64, now: OffsetDateTime) -> Alarm {
    let word = match kind {
        AlarmKind::Lost => "lost",
        AlarmKind::Standing => "standing",
        AlarmKind::Fault => "fault",
    };
    Alarm {
        key: format!("{word}:{}:{since_ns}", heard.session_id),
        kind,
        session_id: Some(heard.session_id),
        inspector_id: Some(heard.inspector_id),
        fault_id: None,
        since: utc::at(heard.started_at, since_ns),
        raised_at: now,
    }
}

/// Nothing has been heard for long. One that was raised stays until something is heard or the walk ends, however long that takes.
fn lost(
    heard: &Heard,
    limits: &Limits,
    standing: &BTreeMap<String, Alarm>,
    now: OffsetDateTime,
) -> Option<Alarm> {
    let silent_for = now - heard.received_at;
    if silent_for <= limits.lost_after {
        return None;
    }
    // The last position is told by its own moment while it is streamed and by the stored track's after a restart: what was raised since it
    // came is the same silence.
    let is_it = |alarm: &&Alarm| {
        of(alarm, heard.session_id) && alarm.kind == AlarmKind::Lost && alarm.raised_at >= heard.received_at
    };
    if let Some(raised) = standing.values().find(is_it) {
        return Some(raised.clone());
    }
    let mut alarm = of_session(heard, AlarmKind::Lost, heard.last_ns, now);
    alarm.since = heard.received_at;
    (silent_for <= limits.gone_after).then_some(alarm)
}

/// Somebody is heard of and has not moved for long. Corrections move the moment at which they came there: it is one alarm all the same.
fn still(
    heard: &Heard,
    limits: &Limits,
    standing: &BTreeMap<String, Alarm>,
    now: OffsetDateTime,
) -> Option<Alarm> {
    let since_ns = heard.stays_since_ns?;
    let stayed_s = (heard.last_ns - since_ns) as f64 / 1e9;
    if now - heard.received_at > limits.lost_after || stayed_s < limits.standing_after?.as_secs_f64() {
        return None;
    }
    let is_it = |alarm: &&Alarm| of(alarm, heard.session_id) && alarm.kind == AlarmKind::Standing;
    let raised = standing.values().find(is_it).cloned();
    Some(raised.unwrap_or_else(|| of_session(heard, AlarmKind::Standing, since_ns, now)))
}

fn of(alarm: &Alarm, session_id: Uuid) -> bool {
    alarm.session_id == Some(session_id)
}

/// A fault of high severity that nobody has taken on.
fn unseen(fault: &Fault, now: OffsetDateTime) -> Option<Alarm> {
    let is_open = fault.state == FaultState::Open && fault.severity == Severity::High;
    is_open.then(|| Alarm {
        key: format!("fault:{}", fault.id),
        kind: AlarmKind::Fault,
        session_id: fault.session_id,
        inspector_id: Some(fault.inspector_id),
        fault_id: Some(fault.id),
        since: fault.reported_at,
        raised_at: now,
    })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const LIMITS: Limits = Limits {
        lost_after: Duration::from_secs(60),
        gone_after: Duration::from_secs(3_600),
        standing_after: Some(Duration::from_secs(900)),
        one_spot_m: 3.0,
    };

    fn at_s(s: i64) -> OffsetDateTime {
        utc::at(OffsetDateTime::UNIX_EPOCH, s * 1_000_000_000)
    }

    /// Heard last at this second of the walk, after having stayed since that one.
    fn heard(last_s: i64, stays_since_s: i64) -> Heard {
        Heard {
            session_id: Uuid::from_u128(7),
            inspector_id: Uuid::from_u128(8),
            started_at: at_s(0),
            last_ns: last_s * 1_000_000_000,
            position_m: [0.0; 3],
            sigma_m: [1.0; 3],
            received_at: at_s(last_s),
            stays_since_ns: Some(stays_since_s * 1_000_000_000),
        }
    }

    fn keys(found: &BTreeMap<String, Alarm>) -> Vec<String> {
        found.keys().cloned().collect()
    }

    fn look(heard: &Heard, standing: &BTreeMap<String, Alarm>, now_s: i64) -> BTreeMap<String, Alarm> {
        let watched = Watched { heard: vec![heard.clone()], faults: Vec::new() };
        found(&watched, &LIMITS, standing, at_s(now_s))
    }

    #[test]
    fn silence_is_an_alarm_until_something_is_heard() {
        let session = Uuid::from_u128(7);
        let none = BTreeMap::new();
        assert!(look(&heard(100, 95), &none, 160).is_empty());
        let lost = look(&heard(100, 95), &none, 161);
        assert_eq!(keys(&lost), [format!("lost:{session}:100000000000")]);
        assert_eq!(lost.values().next().unwrap().since, at_s(100));
        assert_eq!(keys(&look(&heard(100, 95), &lost, 90_000)), keys(&lost), "raised ones stay");
        assert!(look(&heard(100, 95), &none, 90_000).is_empty(), "who left long ago raises none");
        assert!(look(&heard(200, 195), &lost, 201).is_empty());
        assert_eq!(
            keys(&look(&heard(99, 95), &lost, 170)),
            keys(&lost),
            "the same silence by the stored track"
        );
        let again = look(&heard(200, 195), &lost, 261);
        assert_eq!(keys(&again), [format!("lost:{session}:200000000000")], "heard of, and lost once more");
    }

    #[test]
    fn who_stays_on_one_spot_is_one_alarm_wherever_corrections_put_its_beginning() {
        let session = Uuid::from_u128(7);
        let none = BTreeMap::new();
        assert!(look(&heard(999, 100), &none, 1_000).is_empty());
        let stands = look(&heard(1_000, 100), &none, 1_001);
        assert_eq!(keys(&stands), [format!("standing:{session}:100000000000")]);
        assert_eq!(keys(&look(&heard(1_100, 90), &stands, 1_101)), keys(&stands));
        assert!(look(&heard(1_100, 1_090), &stands, 1_101).is_empty(), "it has moved");
        let lost = look(&heard(1_100, 90), &stands, 1_200);
        assert_eq!(
            keys(&lost),
            [format!("lost:{session}:1100000000000")],
            "of the lost nobody knows whether they stand"
        );
    }

    #[test]
    fn what_is_no_person_may_stand() {
        let pole = Heard { stays_since_ns: None, ..heard(5_000, 0) };
        assert!(look(&pole, &BTreeMap::new(), 5_001).is_empty());
    }
}
