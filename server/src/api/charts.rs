//! Charts of a session: series by time, decimated by the smallest and the largest value.

use axum::extract::State;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use crate::charts::answer::{Charts, Window, charts};
use crate::error::{Error, Result};
use crate::http::{Json, Path, Query, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::{sessions, track};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/charts", Right::Read, show)
        .about("get_session_charts", "Series of a walk for charts, by the extremes of each step in time")
}

/// Values of a line, when nothing is said, and at most.
const BUCKETS: usize = 800;
const MOST_BUCKETS: usize = 5_000;
/// Times are nanoseconds in 64 bits: a century is far from their end, s.
const LATEST_S: f64 = 3e9;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ChartsQuery {
    /// Seconds since the session's start; the walk's own, when left out.
    from_s: Option<f64>,
    /// Seconds since the session's start; the walk's own, when left out.
    to_s: Option<f64>,
    /// Values of a line.
    buckets: Option<usize>,
    /// Which charts, with commas in between; all, when left out.
    #[serde(default)]
    charts: String,
}

async fn show(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(asked): Query<ChartsQuery>,
) -> Result<Json<Charts>> {
    let session = sessions::get(app.store.read(), id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", id))?;
    let span = track::span(app.store.read(), id).await?;
    let (first_ns, last_ns) = span.unwrap_or((0, 0));
    let moment = |asked: Option<f64>, else_ns: i64| match asked {
        None => Ok(else_ns),
        Some(at_s) if at_s.abs() <= LATEST_S => Ok((at_s * 1e9).round() as i64),
        Some(at_s) => Err(wrong_window(format!("{at_s}"))),
    };
    let window = Window {
        from_ns: moment(asked.from_s, first_ns)?,
        to_ns: moment(asked.to_s, last_ns + 1)?,
        buckets: asked.buckets.unwrap_or(BUCKETS),
        charts: asked.charts.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect(),
    };
    if window.from_ns >= window.to_ns && span.is_some() {
        return Err(wrong_window(format!(
            "{} to {}",
            window.from_ns as f64 * 1e-9,
            window.to_ns as f64 * 1e-9
        )));
    }
    if !(1..=MOST_BUCKETS).contains(&window.buckets) {
        return Err(Error::invalid(
            "wrong_buckets",
            format!(
                "expected buckets from 1 to {MOST_BUCKETS}, found {}: ask for about as many as the chart has pixels",
                window.buckets
            ),
        ));
    }
    Ok(Json(charts(&app, &session, window).await?))
}

fn wrong_window(found: String) -> Error {
    Error::invalid(
        "wrong_window",
        format!(
            "expected from_s before to_s, in seconds since the session's start, found {found}: leave both out for the whole walk"
        ),
    )
}
