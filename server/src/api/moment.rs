//! Where everybody was at a moment that is past.

use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use time::OffsetDateTime;

use crate::error::{Error, Result};
use crate::http::{Json, Query, Routes};
use crate::rights::Right;
use crate::sessions::unknown_start::is_unknown;
use crate::state::App;
use crate::store::sessions::{self, Session};
use crate::store::track::{self, TrackKind};
use crate::utc;

/// No walk takes longer: one that began earlier was left open.
const LONGEST: time::Duration = time::Duration::hours(48);
/// How much of the way there is told, unless so much else is asked for, s.
const USUAL_TRAIL_S: f64 = 300.0;
const LONGEST_TRAIL_S: f64 = 3_600.0;
/// Vertices of the way there are so far apart, ns.
const SPACING_NS: i64 = 1_000_000_000;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/moment", Right::Read, show)
        .about("get_moment", "Where everybody was at a moment that is past")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MomentQuery {
    /// The moment.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    at: OffsetDateTime,
    /// How much of the way there is told, s: 300, when it is left out.
    trail_s: Option<f64>,
}

/// A moment of the site.
#[derive(Serialize, JsonSchema)]
struct Moment {
    /// Which.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    at: OffsetDateTime,
    /// The walks that were under way, the oldest first.
    walks: Vec<WalkThen>,
}

/// A walk at that moment.
#[derive(Serialize, JsonSchema)]
struct WalkThen {
    /// As it is today.
    session: Session,
    /// Where it was; null where nothing was known of it yet.
    position: Option<PositionThen>,
    /// The way there: `[t_ns, e_m, n_m]`, oldest first.
    trail: Vec<(i64, f64, f64)>,
}

/// Where somebody was: the last point at or before the moment.
#[derive(Serialize, JsonSchema)]
struct PositionThen {
    /// Time since the session's start, ns.
    t_ns: i64,
    /// How long before the moment that was, s.
    age_s: f64,
    /// East-north-up, m.
    position_m: [f64; 3],
    /// Clockwise from true north, rad.
    heading_rad: f64,
    /// Its sigma, rad.
    sigma_heading_rad: f64,
    /// Sigmas of east, north, up, m.
    sigma_m: [f64; 3],
    /// Covariance of east and north, m².
    covariance_en_m2: f64,
}

async fn show(State(app): State<App>, Query(query): Query<MomentQuery>) -> Result<Json<Moment>> {
    let trail_s = query.trail_s.unwrap_or(USUAL_TRAIL_S);
    if !(0.0..=LONGEST_TRAIL_S).contains(&trail_s) {
        return Err(Error::invalid(
            "wrong_trail",
            format!(
                "expected 0 to {LONGEST_TRAIL_S} s in trail_s, found {trail_s}: leave it out for {USUAL_TRAIL_S} s"
            ),
        ));
    }
    let db = app.store.read();
    let mut walks = Vec::new();
    for session in sessions::under_way(db, query.at, LONGEST).await? {
        let then_us = utc::to_us(query.at).saturating_sub(utc::to_us(session.started_at));
        let then_ns = then_us.saturating_mul(1_000);
        let last = track::last_at(db, session.id, then_ns).await?.filter(|last| !is_unknown(last.sigma_n_m));
        let from_ns = then_ns.saturating_sub((trail_s * 1e9) as i64);
        let way =
            track::thinned(db, session.id, TrackKind::Main, (from_ns, then_ns), (SPACING_NS, 0)).await?;
        let way = way.into_iter().filter(|point| !is_unknown(point.sigma_n_m));
        let position = last.map(|last| PositionThen {
            t_ns: last.t_ns,
            age_s: then_ns.saturating_sub(last.t_ns) as f64 / 1e9,
            position_m: last.position_n_m,
            heading_rad: last.heading_rad,
            sigma_heading_rad: last.sigma_heading_rad,
            sigma_m: last.sigma_n_m,
            covariance_en_m2: last.covariance_en_m2,
        });
        let trail = way.map(|point| (point.t_ns, point.position_n_m[0], point.position_n_m[1])).collect();
        walks.push(WalkThen { session, position, trail });
    }
    Ok(Json(Moment { at: query.at, walks }))
}
