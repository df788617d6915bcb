//! Where an inspector was at a time, and how sure that is.

use lodestep_engine::event::TrackPoint;

use crate::error::Result;
use crate::state::App;
use crate::store::sessions::Session;
use crate::store::track;

/// How fast an inspector may have walked since the last known position, m/s.
const WALKING_M_S: f64 = 1.4;
/// A position older than this says nothing about now, s.
const OLDEST_S: f64 = 600.0;
/// How well a session's given start is known, one sigma, m.
const START_SIGMA_M: f64 = 1.0;

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

/// Where the inspector of this session was at `t_ns`; `None` when nothing near that time is known.
pub(super) async fn place(app: &App, session: &Session, t_ns: i64) -> Result<Option<Place>> {
    let db = app.store.read();
    // Before its first point the inspector stood at the start.
    let point = match track::last_at(db, session.id, t_ns).await? {
        Some(point) => Some(point),
        None => track::first(db, session.id).await?,
    };
    Ok(match point {
        Some(point) => aged(known(&point), (t_ns - point.t_ns).max(0) as f64 / 1e9),
        None => {
            let start = Place {
                position_m: session.start.position_m,
                sigma_m: [START_SIGMA_M; 3],
                covariance_en_m2: 0.0,
            };
            aged(start, t_ns.max(0) as f64 / 1e9)
        }
    })
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
