//! Visits: told as JSON or as a CSV file, listed with what became of them.

use axum::body::Bytes;
use axum::extract::{FromRequest, Request, State};
use axum::http::StatusCode;
use lodestep_engine::parse::visits_csv;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Place, Result};
use crate::http::extract::{NOT_READ, NOT_THE_JSON, content_type, not_read};
use crate::http::media::{Csv, Media};
use crate::http::operation::Content;
use crate::http::{Describer, Json, MaybeNew, Needs, NoContent, Path, RequestPart, Routes, read_json};
use crate::rights::Right;
use crate::sessions::add_visits::{self, AddedVisits, Told};
use crate::sessions::stand_choice;
use crate::state::App;
use crate::store::sessions;
use crate::store::visits::{self, Visit};

/// Longest time that a visit may name, s: a year.
const LATEST_S: f64 = 366.0 * 86_400.0;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/visits", Right::Read, list)
        .about("list_visits", "The visits of a walk with their outcomes")
        .post("/sessions/{id}/visits", Needs::OwnSession, tell)
        .about("add_visits", "Tells of visits, in JSON or CSV")
        .delete("/sessions/{id}/visits/{visit_id}", Needs::OwnSession, take_back)
        .about("delete_visit", "Takes a visit back")
}

async fn list(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<Json<Vec<Visit>>> {
    if sessions::get(app.store.read(), session_id).await?.is_none() {
        return Err(Error::not_found("session", session_id));
    }
    Ok(Json(visits::of_session(app.store.read(), session_id).await?))
}

async fn take_back(
    State(app): State<App>,
    caller: Caller,
    Path((session_id, visit_id)): Path<(Uuid, Uuid)>,
) -> Result<NoContent> {
    stand_choice::take_visit_back(&app, &caller, session_id, visit_id).await?;
    Ok(NoContent)
}

async fn tell(
    State(app): State<App>,
    caller: Caller,
    Path(session_id): Path<Uuid>,
    VisitsBody(told): VisitsBody,
) -> Result<MaybeNew<Json<AddedVisits>>> {
    let added = add_visits::add(&app, &caller, session_id, told).await?;
    Ok(MaybeNew::of(added.added > 0, Json(added)))
}

/// Visits as JSON or as a CSV file.
struct VisitsBody(Vec<Told>);

impl<S: Send + Sync> FromRequest<S> for VisitsBody {
    type Rejection = Error;

    async fn from_request(request: Request, state: &S) -> Result<Self> {
        let kind = content_type(request.headers()).unwrap_or_default().to_owned();
        let body = Bytes::from_request(request, state).await.map_err(not_read)?;
        match kind.split(';').next().unwrap_or_default().trim() {
            "application/json" => from_json(&body).map(VisitsBody),
            "text/csv" => from_csv(&body).map(VisitsBody),
            _ => Err(Error::http(
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "json_or_csv_expected",
                format!("expected Content-Type application/json or text/csv, found {kind:?}"),
            )),
        }
    }
}

impl RequestPart for VisitsBody {
    fn describe(to: &mut Describer<'_>) {
        let schema = to.taken::<NewVisits>();
        to.takes(Content::json(schema));
        to.takes(Csv::content());
        to.refuses([(StatusCode::UNSUPPORTED_MEDIA_TYPE, "json_or_csv_expected")]);
        to.refuses(NOT_THE_JSON);
        to.refuses(NOT_READ);
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewVisit {
    #[schemars(example = &"A17")]
    marker: String,
    t_start_s: f64,
    t_end_s: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
enum NewVisits {
    One(NewVisit),
    More(Vec<NewVisit>),
}

fn from_json(body: &[u8]) -> Result<Vec<Told>> {
    let rows: NewVisits = read_json(body)?;
    let rows = match rows {
        NewVisits::One(row) => vec![row],
        NewVisits::More(rows) => rows,
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
