//! When a fault was seen, by the clock of its walk's track.

use std::collections::HashSet;

use time::OffsetDateTime;

use crate::error::Result;
use crate::state::App;
use crate::store::clock_ties::{self, ClockTie};
use crate::store::logs::{self, LogState};
use crate::store::sessions::Session;
use crate::store::visits::{self, Origin, Visit};
use crate::utc;

/// Accepted markers for each rejected one, at least: a marker may be mistyped, but a clock that is off has most rejected.
const ACCEPTED_FOR_EACH_REJECTED: usize = 3;

/// How the clock by which a walk's faults are keyed in stands to the track's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Clock {
    /// The track's time less the keyed one, and its sigma, s.
    Known { offset_s: f64, sigma_s: f64 },
    /// The track's time of what was keyed in is not known.
    Unknown,
}

/// A moment of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// On the session's clock, ns: as it was keyed in where the track's time is not known.
    pub(super) t_ns: i64,
    /// How well that is known, 1σ, s; `None`: not at all.
    pub(super) sigma_s: Option<f64>,
}

impl Clock {
    /// What an instant by the keyed clock is in the walk.
    pub(super) fn moment(self, session: &Session, at: OffsetDateTime) -> Moment {
        let keyed_ns = utc::to_us(at).saturating_sub(utc::to_us(session.started_at)).saturating_mul(1_000);
        match self {
            Clock::Unknown => Moment { t_ns: keyed_ns, sigma_s: None },
            Clock::Known { offset_s, sigma_s } => Moment {
                t_ns: keyed_ns.saturating_add((offset_s * 1e3).round() as i64 * 1_000_000),
                sigma_s: Some(sigma_s),
            },
        }
    }
}

/// The clock of what was keyed in at `keyed_at`, which is when the server had it.
pub(super) async fn clock(app: &App, session: &Session, keyed_at: OffsetDateTime) -> Result<Clock> {
    let db = app.store.read();
    let mut logs = logs::of_session(db, session.id).await?;
    logs.retain(|log| log.state == LogState::Accepted);
    let Some(first_log) = logs.first() else {
        // A device's own clock; or nothing has come yet, and there is no track to be at odds with.
        return Ok(Clock::Known { offset_s: 0.0, sigma_s: 0.0 });
    };
    let tie = clock_ties::of_session(db, session.id).await?;
    let visits = visits::of_session(db, session.id).await?;
    Ok(of(tie, &visits, keyed_at < first_log.created_at))
}

/// What a tie says, and without one the visits; `waited` for its logs: keyed in at a kiosk, before anybody knew the log.
fn of(tie: Option<ClockTie>, visits: &[Visit], waited: bool) -> Clock {
    let one_clock = Clock::Known { offset_s: 0.0, sigma_s: 0.0 };
    match tie {
        Some(tie) if tie.state.moves() => {
            Clock::Known { offset_s: tie.offset_s, sigma_s: tie.sigma_s.unwrap_or(0.0) }
        }
        Some(tie) if tie.state.is_known() => one_clock,
        _ => {
            let weighed = visits.iter().any(|v| v.origin == Origin::Keyed && v.outcome.is_some());
            let known = if weighed { is_on_one_clock(visits) } else { !waited };
            if known { one_clock } else { Clock::Unknown }
        }
    }
}

/// Whether the markers that were keyed in lie on the track at the times at which they were. One marker shows nothing:
/// who stands there longer than the clock is off has it accepted.
fn is_on_one_clock(visits: &[Visit]) -> bool {
    let keyed = visits.iter().filter(|visit| visit.origin == Origin::Keyed);
    let (mut accepted, mut rejected, mut markers) = (0, 0, HashSet::new());
    for visit in keyed {
        match &visit.outcome {
            Some(outcome) if outcome.accepted => {
                accepted += 1;
                markers.insert(visit.marker.as_str());
            }
            Some(_) => rejected += 1,
            None => {}
        }
    }
    markers.len() >= 2 && accepted >= ACCEPTED_FOR_EACH_REJECTED * rejected
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::clock_ties::TieState;
    use crate::store::visits::Outcome;

    fn visit(marker: &str, accepted: bool) -> Visit {
        Visit {
            id: uuid::Uuid::now_v7(),
            session_id: uuid::Uuid::nil(),
            marker: marker.to_owned(),
            t_start_ns: 0,
            t_end_ns: 0,
            origin: Origin::Keyed,
            keyed_shift_ns: 0,
            created_at: utc::now(),
            outcome: Some(Outcome {
                t_applied_ns: 0,
                accepted,
                nis: 1.0,
                degrees_of_freedom: 2,
                before_minus_marker_m: [0.0; 3],
                after_minus_marker_m: [0.0; 3],
                reason: String::new(),
            }),
        }
    }

    fn tie(state: TieState) -> Option<ClockTie> {
        let tied_at = utc::now();
        Some(ClockTie { state, offset_s: 240.0, sigma_s: Some(0.7), keyed: 5, matched: 4, tied_at })
    }

    #[test]
    fn a_tied_clock_moves_and_the_same_clock_does_not() {
        assert_eq!(of(tie(TieState::Tied), &[], true), Clock::Known { offset_s: 240.0, sigma_s: 0.7 });
        assert_eq!(of(tie(TieState::Same), &[], true), Clock::Known { offset_s: 0.0, sigma_s: 0.0 });
    }

    #[test]
    fn without_a_tie_the_visits_say_whether_it_is_one_clock() {
        let good = [visit("A1", true), visit("A2", true)];
        assert_eq!(of(tie(TieState::TooFew), &good, true), Clock::Known { offset_s: 0.0, sigma_s: 0.0 });
        let bad = [visit("A1", true), visit("A2", false), visit("A3", false)];
        assert_eq!(of(tie(TieState::Unmatched), &bad, false), Clock::Unknown);
        assert_eq!(of(None, &[visit("A1", true), visit("A1", true)], false), Clock::Unknown, "one marker");
    }

    #[test]
    fn what_waited_for_its_log_without_a_marker_has_no_time_in_it() {
        assert_eq!(of(None, &[], true), Clock::Unknown);
        assert_eq!(of(None, &[], false), Clock::Known { offset_s: 0.0, sigma_s: 0.0 });
    }
}
