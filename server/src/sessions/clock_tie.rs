//! Ties the clock by which a walk's markers were keyed in to that of its logs, and moves the visits by the offset.
//!
//! A kiosk counts from its own *Start*, a log from its first sample, and either clock may be minutes off. The stands
//! of the log, of a run that knows no marker, say which offset puts the visits where the track stood.

use std::collections::HashMap;

use futures_util::FutureExt;
use lodestep_engine::event::{Stand, TrackPoint};
use lodestep_engine::identify::{self, KeyedVisit, LEAST_MATCHED, TrackStand, tie_clocks};
use tokio::runtime::Handle;
use uuid::Uuid;

use super::computation;
use super::parameters::Wanted;
use super::process::{ProcessError, blocking};
use super::replace_result::gone_when_dangling;
use super::stored_session::StoredSession;
use super::thinning;
use crate::jobs::progress::Progress;
use crate::state::App;
use crate::store::clock_ties::{self, ClockTie, TieState};
use crate::store::visits::{self, Origin, Visit};
use crate::store::{Store, markers};
use crate::utc;

/// Offsets up to this are none, s: a key is pressed a moment before or after the stand.
const SAME_CLOCK_S: f64 = 3.0;

/// A visit longer than this may have been anywhere in its span, s: on paper times are whole minutes.
const PRECISE_S: f64 = 20.0;

/// Measures the offset of an uploaded walk with keyed visits, notes it and moves the visits. Where somebody has given
/// it, that holds.
pub(super) async fn tie(app: &App, session_id: Uuid, progress: Progress) -> Result<Progress, ProcessError> {
    let db = app.store.read();
    let mut keyed = visits::of_session(db, session_id).await?;
    keyed.retain(|visit| visit.origin == Origin::Keyed);
    if keyed.is_empty() {
        return Ok(progress);
    }
    let former = clock_ties::of_session(db, session_id).await?;
    if let Some(given) = former.filter(|former| former.state == TieState::Given) {
        let shift_ns = to_ns(given.offset_s);
        let moved = keyed.iter().map(|visit| (visit.id, shift_ns)).collect();
        let tie = ClockTie { keyed: keyed.len() as u64, ..given };
        write(app, session_id, tie, moved).await?;
        return Ok(progress);
    }
    let walk = StoredSession::read(app, session_id, Wanted::Site).await?;
    if !walk.is_of_logs() {
        return Ok(progress);
    }
    let unmoved = || keyed.iter().map(|visit| (visit.id, 0)).collect::<Vec<_>>();
    let nothing = |state| ClockTie {
        state,
        offset_s: 0.0,
        sigma_s: None,
        keyed: keyed.len() as u64,
        matched: 0,
        tied_at: utc::now(),
    };
    if keyed.len() < LEAST_MATCHED || walk.config.identification.is_none() {
        write(app, session_id, nothing(TieState::TooFew), unmoved()).await?;
        return Ok(progress);
    }
    let start = &walk.session.start;
    let start_n_m = start.known.then_some([start.position_m[0], start.position_m[1]]);
    let cell_ns = thinning::cell_ns(app.config.track_rate_hz);
    let (stands, _, progress) = blocking(app, walk, progress, move |store, runtime, walk, progress| {
        stands_without_markers(store, runtime, walk, cell_ns, progress)
    })
    .await?;
    let places: HashMap<_, _> =
        markers::list(db).await?.into_iter().map(|marker| (marker.name, [marker.e_m, marker.n_m])).collect();
    let (rows, keyed_at): (Vec<&Visit>, Vec<KeyedVisit>) = keyed
        .iter()
        .filter_map(|visit| Some((visit, keyed_visit(visit, *places.get(&visit.marker)?))))
        .unzip();
    let (tie, moved) = match tie_clocks(&keyed_at, &stands, start_n_m) {
        identify::ClockTie::Ambiguous => (nothing(TieState::Ambiguous), unmoved()),
        identify::ClockTie::None => (nothing(TieState::Unmatched), unmoved()),
        identify::ClockTie::Tied { offset_s, sigma_s, matched } => {
            let same = offset_s.abs() <= SAME_CLOCK_S.max(2.0 * sigma_s);
            let tie = ClockTie {
                state: if same { TieState::Same } else { TieState::Tied },
                offset_s,
                sigma_s: Some(sigma_s),
                matched: matched.len() as u64,
                ..nothing(TieState::Same)
            };
            let stand_of: HashMap<Uuid, &TrackStand> =
                matched.iter().map(|&(k, stand)| (rows[k].id, &stands[stand])).collect();
            let by_stand = |visit: &Visit| (visit.id, shift_onto(visit, offset_s, stand_of.get(&visit.id)));
            (tie, if same { unmoved() } else { keyed.iter().map(by_stand).collect() })
        }
    };
    write(app, session_id, tie, moved).await?;
    Ok(progress)
}

/// A visit by the clock by which it was keyed in.
fn keyed_visit(visit: &Visit, p_n_m: [f64; 2]) -> KeyedVisit {
    let middle_ns = visit.t_start_ns / 2 + visit.t_end_ns / 2 - visit.keyed_shift_ns;
    let span_s = (visit.t_end_ns - visit.t_start_ns) as f64 / 1e9;
    let half_s = if span_s > PRECISE_S { 0.5 * span_s } else { 0.0 };
    KeyedVisit { p_n_m, t_s: middle_ns as f64 / 1e9, half_s }
}

/// What is added to a visit's keyed times, ns: the offset, and where it was matched to a stand, what is left to lie
/// in it.
fn shift_onto(visit: &Visit, offset_s: f64, stand: Option<&&TrackStand>) -> i64 {
    let from_s = (visit.t_start_ns - visit.keyed_shift_ns) as f64 / 1e9;
    let to_s = (visit.t_end_ns - visit.keyed_shift_ns) as f64 / 1e9;
    let shift_s = match stand {
        None => offset_s,
        Some(stand) => {
            let (least_s, most_s) = (stand.t_start_s - from_s, stand.t_end_s - to_s);
            if least_s <= most_s { offset_s.clamp(least_s, most_s) } else { 0.5 * (least_s + most_s) }
        }
    };
    to_ns(shift_s)
}

/// To the millisecond, as times are keyed in.
fn to_ns(t_s: f64) -> i64 {
    (t_s * 1e3).round() as i64 * 1_000_000
}

/// The stands of a run without markers, with the way walked until each.
fn stands_without_markers(
    store: &Store,
    runtime: &Handle,
    walk: &mut StoredSession,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<Vec<TrackStand>, ProcessError> {
    let mut run = walk.begin_to_tie()?;
    run.thin(cell_ns);
    let fed = computation::feed(&mut run, walk.samples_in_order(store, runtime), |_| {
        progress.tell("tying_clocks", 0.0);
        !progress.is_stopping()
    });
    if !fed.map_err(ProcessError::Read)? {
        return Err(ProcessError::Stopping);
    }
    Ok(with_ways(&run.track.stands, &run.track.points))
}

fn with_ways(stands: &[Stand], points: &[TrackPoint]) -> Vec<TrackStand> {
    let (mut way_m, mut before) = (0.0, points.first());
    let mut points = points.iter().peekable();
    let mut told = Vec::new();
    for stand in stands {
        while let Some(point) = points.next_if(|point| point.t_ns <= stand.t_start_ns) {
            if let Some(before) = before {
                let [e, n, _] = before.position_n_m;
                way_m += (point.position_n_m[0] - e).hypot(point.position_n_m[1] - n);
            }
            before = Some(point);
        }
        told.push(TrackStand {
            p_n_m: [stand.position_n_m[0], stand.position_n_m[1]],
            t_start_s: stand.t_start_ns as f64 / 1e9,
            t_end_s: stand.t_end_ns as f64 / 1e9,
            way_m,
        });
    }
    told
}

async fn write(
    app: &App,
    session_id: Uuid,
    tie: ClockTie,
    moved: Vec<(Uuid, i64)>,
) -> Result<(), ProcessError> {
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                visits::shift(&mut *db, &moved).await?;
                clock_ties::set(&mut *db, session_id, &tie).await
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visit(from_s: i64, to_s: i64, shift_s: i64) -> Visit {
        let ns = |t_s: i64| (t_s + shift_s) * 1_000_000_000;
        Visit {
            id: Uuid::now_v7(),
            session_id: Uuid::nil(),
            marker: "A1".to_owned(),
            t_start_ns: ns(from_s),
            t_end_ns: ns(to_s),
            origin: Origin::Keyed,
            keyed_shift_ns: shift_s * 1_000_000_000,
            created_at: utc::now(),
            outcome: None,
        }
    }

    #[test]
    fn a_visit_is_moved_onto_its_stand_whatever_it_was_moved_by_before() {
        let stand = TrackStand { p_n_m: [0.0; 2], t_start_s: 340.0, t_end_s: 350.0, way_m: 0.0 };
        for before_s in [0, -70] {
            let visit = visit(100, 104, before_s);
            assert_eq!(shift_onto(&visit, 241.0, Some(&&stand)), 241_000_000_000, "it lies in its stand");
            assert_eq!(shift_onto(&visit, 238.0, Some(&&stand)), 240_000_000_000, "it is moved to the begin");
            assert_eq!(shift_onto(&visit, 250.0, Some(&&stand)), 246_000_000_000, "it is moved to the end");
            assert_eq!(shift_onto(&visit, 250.0, None), 250_000_000_000);
        }
        assert_eq!(keyed_visit(&visit(100, 104, 50), [1.0, 2.0]).t_s, 102.0);
    }
}
