//! Where an inspector was at a time, and how sure that is.

use lodestep_engine::event::TrackPoint;

use super::candidates::{PlanPosition, candidates};
use super::clock::Moment;
use crate::error::Result;
use crate::sessions::unknown_start::is_unknown;
use crate::state::App;
use crate::store::faults::Candidate;
use crate::store::sessions::Session;
use crate::store::visits::{self, Origin, Visit};
use crate::store::{markers, track};

/// How fast an inspector may have walked since the last known position, m/s.
const WALKING_M_S: f64 = 1.4;
/// A position older than this says nothing about now, s.
const OLDEST_S: f64 = 600.0;
/// How near an inspector stands to a marker that is keyed in, and how well a session's given start is known, one
/// sigma, m.
const STANDING_SIGMA_M: f64 = 1.0;

/// A position with what it is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// East-north-up, m.
    pub(super) position_m: [f64; 3],
    /// Its sigmas, m.
    pub(super) sigma_m: [f64; 3],
    /// Its covariance of east and north, m².
    pub(super) covariance_en_m2: f64,
}

/// Where the inspector of this session was at a moment; `None` when nothing near that time is known.
pub(super) async fn place(app: &App, session: &Session, moment: Moment) -> Result<Option<Place>> {
    let t_ns = moment.t_ns;
    if let Some(sigma_s) = moment.sigma_s
        && let Some(point) = on_track(app, session, t_ns).await?
    {
        // What was seen before the walk's own clock began was not seen at its first point.
        let age_ns = if t_ns < point.t_ns { (-t_ns).max(0) } else { t_ns - point.t_ns };
        let place = if is_unknown(point.sigma_n_m) { None } else { aged(known(&point), age_ns as f64 / 1e9) };
        return Ok(match place {
            Some(place) => Some(unsure_by(place, moved_m(app, session, t_ns, sigma_s).await?)),
            None => None,
        });
    }
    if let Some(place) = at_last_marker(app, session, t_ns).await? {
        return Ok(Some(place));
    }
    let start = &session.start;
    Ok(if start.known { aged(standing_at(start.position_m), t_ns.max(0) as f64 / 1e9) } else { None })
}

/// The track's point at a time, its first one before it begins.
async fn on_track(app: &App, session: &Session, t_ns: i64) -> Result<Option<TrackPoint>> {
    let db = app.store.read();
    Ok(match track::last_at(db, session.id, t_ns).await? {
        Some(point) => Some(point),
        None => track::first(db, session.id).await?,
    })
}

/// How far the track moves within the sigma of a time, east and north, m.
async fn moved_m(app: &App, session: &Session, t_ns: i64, sigma_s: f64) -> Result<[f64; 2]> {
    let sigma_ns = (sigma_s * 1e9) as i64;
    let before = on_track(app, session, t_ns.saturating_sub(sigma_ns)).await?;
    let after = on_track(app, session, t_ns.saturating_add(sigma_ns)).await?;
    Ok(match (before, after) {
        (Some(before), Some(after)) => {
            [0, 1].map(|axis| 0.5 * (after.position_n_m[axis] - before.position_n_m[axis]).abs())
        }
        _ => [0.0; 2],
    })
}

fn unsure_by(place: Place, [e_m, n_m]: [f64; 2]) -> Place {
    let [e, n, u] = place.sigma_m;
    Place { sigma_m: [e.hypot(e_m), n.hypot(n_m), u], ..place }
}

/// Where the marker that was keyed in last says that the inspector is; `None` when there is none that is recent.
async fn at_last_marker(app: &App, session: &Session, t_ns: i64) -> Result<Option<Place>> {
    let db = app.store.read();
    let visits = visits::of_session(db, session.id).await?;
    let keyed_at_ns = |visit: &&Visit| visit.t_start_ns - visit.keyed_shift_ns;
    let keyed = visits.iter().filter(|visit| visit.origin == Origin::Keyed && keyed_at_ns(visit) <= t_ns);
    let Some(last) = keyed.max_by_key(keyed_at_ns) else { return Ok(None) };
    let Some(marker) = markers::get(db, &last.marker).await? else { return Ok(None) };
    let height_m = marker.u_m.unwrap_or(session.start.position_m[2]);
    let age_ns = t_ns.saturating_sub(last.t_end_ns - last.keyed_shift_ns).max(0);
    Ok(aged(standing_at([marker.e_m, marker.n_m, height_m]), age_ns as f64 / 1e9))
}

/// The actuators that a fault at this place may be about, likeliest first.
pub(super) async fn candidates_at(app: &App, place: &Place) -> Result<Vec<Candidate>> {
    let at = PlanPosition {
        e_m: place.position_m[0],
        n_m: place.position_m[1],
        variance_e_m2: place.sigma_m[0] * place.sigma_m[0],
        variance_n_m2: place.sigma_m[1] * place.sigma_m[1],
        covariance_en_m2: place.covariance_en_m2,
    };
    Ok(candidates(&at, &markers::list(app.store.read()).await?))
}

fn standing_at(position_m: [f64; 3]) -> Place {
    Place { position_m, sigma_m: [STANDING_SIGMA_M; 3], covariance_en_m2: 0.0 }
}

fn known(point: &TrackPoint) -> Place {
    Place {
        position_m: point.position_n_m,
        sigma_m: point.sigma_n_m,
        covariance_en_m2: point.covariance_en_m2,
    }
}

/// The same place, `age_s` later: as unsure as a walk in any direction makes it.
fn aged(place: Place, age_s: f64) -> Option<Place> {
    if age_s > OLDEST_S {
        return None;
    }
    let [e, n, u] = place.sigma_m;
    // Points are a tenth of a second apart; only a gap counts.
    let walked = if age_s > 1.0 { WALKING_M_S * age_s } else { 0.0 };
    Some(Place { sigma_m: [e.hypot(walked), n.hypot(walked), u], ..place })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SURE: Place =
        Place { position_m: [1.0, 2.0, 3.0], sigma_m: [0.3, 0.4, 0.5], covariance_en_m2: 0.01 };

    #[test]
    fn a_fresh_position_is_taken_as_it_is() {
        assert_eq!(aged(SURE, 0.1), Some(SURE));
    }

    #[test]
    fn an_old_position_is_less_sure_and_a_very_old_one_is_none() {
        let old = aged(SURE, 10.0).unwrap();
        assert_eq!(old.position_m, SURE.position_m);
        assert!((old.sigma_m[0] - 0.3_f64.hypot(14.0)).abs() < 1e-12);
        assert_eq!(aged(SURE, 601.0), None);
    }
}
