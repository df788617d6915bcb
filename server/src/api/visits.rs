//! Visits: told as JSON or as a CSV file, listed with what became of them.

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use lodestep_engine::parse::visits_csv;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::extract::Path;
use super::{Needs, Routes, json_body};
use crate::auth::Caller;
use crate::error::{Error, Place, Result};
use crate::rights::Right;
use crate::sessions::stand_choice;
use crate::sessions::tell_visits::{self, TellVisits, Told};
use crate::state::App;
use crate::store::sessions;
use crate::store::visits::{self, Visit};

/// Longest time that a visit may name, s: a year.
const LATEST_S: f64 = 366.0 * 86_400.0;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/visits", Right::Read, list)
        .about("The visits of a walk with their outcomes")
        .gives::<Vec<Visit>>()
        .post("/sessions/{id}/visits", Needs::OwnSession, tell)
        .about("Tells of visits, in JSON or CSV")
        .takes::<OneOrMore>()
        .gives::<TellVisits>()
        .delete("/sessions/{id}/visits/{visit_id}", Needs::OwnSession, take_back)
        .about("Takes a visit back")
}

async fn list(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<axum::Json<Vec<Visit>>> {
    if sessions::get(app.store.read(), session_id).await?.is_none() {
        return Err(Error::not_found("session", session_id));
    }
    Ok(axum::Json(visits::of_session(app.store.read(), session_id).await?))
}

async fn take_back(
    State(app): State<App>,
    caller: Caller,
    Path((session_id, visit_id)): Path<(Uuid, Uuid)>,
) -> Result<StatusCode> {
    stand_choice::take_visit_back(&app, &caller, session_id, visit_id).await?;
    Ok(StatusCode::NO_CONTENT)
}

async fn tell(
    State(app): State<App>,
    caller: Caller,
    Path(session_id): Path<Uuid>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<(StatusCode, axum::Json<TellVisits>)> {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    let told = match kind.split(';').next().unwrap_or_default().trim() {
        "application/json" => from_json(&body)?,
        "text/csv" => from_csv(&body)?,
        _ => {
            return Err(Error::http(
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "json_or_csv_expected",
                format!("expected Content-Type application/json or text/csv, found {kind:?}"),
            ));
        }
    };
    let told = tell_visits::tell(&app, &caller, session_id, told).await?;
    let status = if told.added > 0 { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, axum::Json(told)))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Row {
    marker: String,
    t_start_s: f64,
    t_end_s: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
enum OneOrMore {
    One(Row),
    More(Vec<Row>),
}

fn from_json(body: &[u8]) -> Result<Vec<Told>> {
    let rows: OneOrMore = json_body::read(body)?;
    let rows = match rows {
        OneOrMore::One(row) => vec![row],
        OneOrMore::More(rows) => rows,
    };
    rows.into_iter()
        .zip(1..)
        .map(|(row, line)| {
            Ok(Told {
                marker: row.marker,
                t_start_ns: to_ns(row.t_start_s, "t_start_s", line)?,
                t_end_ns: to_ns(row.t_end_s, "t_end_s", line)?,
                line,
            })
        })
        .collect()
}

fn to_ns(t_s: f64, column: &str, line: u64) -> Result<i64> {
    if t_s.abs() <= LATEST_S {
        return Ok((t_s * 1e9).round() as i64);
    }
    Err(Error::invalid_at(
        "bad_time",
        format!("visit {line}: expected {column} in seconds since the session's start, found {t_s}"),
        Place { line: Some(line), column: Some(column.to_owned()), ..Place::default() },
    ))
}

fn from_csv(body: &[u8]) -> Result<Vec<Told>> {
    let rows = visits_csv::read(body).map_err(|error| {
        let place = Place { line: error.line, column: error.column.clone(), ..Place::default() };
        Error::invalid_at(error.code(), format!("{error}. No visit was stored"), place)
    })?;
    // The header is line 1.
    let told = rows.into_iter().zip(2..).map(|(row, line)| Told {
        marker: row.marker,
        t_start_ns: row.t_start_ns,
        t_end_ns: row.t_end_ns,
        line,
    });
    Ok(told.collect())
}
