//! Walks that are looked for, a page at a time; and what staff say of one.

use axum::extract::State;
use schemars::JsonSchema;
use serde::Deserialize;
use time::OffsetDateTime;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Json, Path, Query, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::audit;
use crate::store::session_search::{self, Flag, Mode, Note, Page, Sort, Wanted};
use crate::store::sessions::SessionState;
use crate::utc;

/// Walks on a page, unless others are asked for.
const USUAL: u32 = 50;
const MOST: u32 = 500;
/// Letters in a note.
const NOTE_LENGTH: usize = 500;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/search", Right::Read, search)
        .about("search_sessions", "Walks by who, when, how they came and how they went, a page at a time")
        .get("/sessions/{id}/note", Right::Read, show)
        .about("get_session_note", "What staff say of a walk")
        .put("/sessions/{id}/note", Right::WalkForOthers, set)
        .about("set_session_note", "Marks a walk, or says something of it")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SearchQuery {
    /// Words in the title, the note or the inspector's name, or the beginning of the id.
    text: Option<String>,
    inspector_id: Option<Uuid>,
    state: Option<SessionState>,
    /// Begun at this instant or later.
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    from: Option<OffsetDateTime>,
    /// Begun before this instant.
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    to: Option<OffsetDateTime>,
    mode: Option<Mode>,
    /// Words of closure, rejected, anomalies, gap, starred and noted with commas in between: all of them.
    flags: Option<String>,
    #[serde(default)]
    sort: Sort,
    /// The smallest, the oldest first.
    #[serde(default)]
    ascending: bool,
    limit: Option<u32>,
    offset: Option<u32>,
}

async fn search(State(app): State<App>, Query(query): Query<SearchQuery>) -> Result<Json<Page>> {
    let mut flags = Vec::new();
    for word in query.flags.iter().flat_map(|words| words.split(',')).filter(|word| !word.is_empty()) {
        let flag: Flag = serde_json::from_value(word.into()).map_err(|_| {
            Error::invalid(
                "wrong_flags",
                format!(
                    "expected closure, rejected, anomalies, gap, starred or noted with commas in between in flags, found {word:?}: choose from these"
                ),
            )
        })?;
        flags.push(flag);
    }
    let wanted = Wanted {
        text: query.text.map(|text| text.trim().to_owned()).filter(|text| !text.is_empty()),
        inspector_id: query.inspector_id,
        state: query.state,
        from: query.from,
        to: query.to,
        mode: query.mode,
        flags,
        sort: query.sort,
        ascending: query.ascending,
        limit: query.limit.unwrap_or(USUAL).clamp(1, MOST),
        offset: query.offset.unwrap_or(0),
    };
    Ok(Json(session_search::page(app.store.read(), &wanted).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Note>> {
    let note = session_search::note(app.store.read(), id).await?;
    Ok(Json(note.ok_or_else(|| Error::not_found("session", id))?))
}

async fn set(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(given): Json<Note>,
) -> Result<Json<Note>> {
    let note = Note { note: given.note.trim().to_owned(), ..given };
    let length = note.note.chars().count();
    if length > NOTE_LENGTH {
        return Err(Error::invalid(
            "wrong_note",
            format!("expected a note of at most {NOTE_LENGTH} letters, found {length}: shorten it"),
        ));
    }
    let row = note.clone();
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let former = session_search::note(&mut *db, id).await?;
                let former = former.ok_or_else(|| Error::not_found("session", id))?;
                if former == row {
                    return Ok(());
                }
                session_search::set_note(&mut *db, id, &row, (&caller.who, utc::now())).await?;
                let (before, after) = (serde_json::to_value(&former).ok(), serde_json::to_value(&row).ok());
                audit::insert(db, &caller.did("session.noted", id, before, after)).await?;
                Ok::<_, Error>(())
            })
        })
        .await?;
    Ok(Json(note))
}
