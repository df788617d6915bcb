//! How the server itself is: version, storage, backups.

use axum::extract::State;
use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::Serialize;
use time::OffsetDateTime;

use crate::auth::Caller;
use crate::backup::{self, NotMade};
use crate::error::{Error, Result};
use crate::http::{Created, Json, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::{audit, sessions};
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/server", Right::Administer, show)
        .about("get_server", "Version, storage, the last backup")
}

/// Those that take as long as the database is large.
pub(super) fn long_routes() -> Routes {
    Routes::new()
        .post("/backups", Right::Administer, back_up)
        .about("create_backup", "Makes a backup in the data folder")
}

#[derive(Serialize, JsonSchema)]
struct ServerStatus {
    #[schemars(example = &"0.1.0")]
    version: &'static str,
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    started_at: OffsetDateTime,
    database_bytes: u64,
    free_bytes: Option<u64>,
    sessions: usize,
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    last_backup_at: Option<OffsetDateTime>,
    /// Why the last backup could not be restored as it is; none, where it is good.
    #[schemars(example = None::<&str>)]
    last_backup_problem: Option<String>,
    /// When all that is stored was last read to its end, to see whether it has changed on the disk.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    scrubbed_at: Option<OffsetDateTime>,
    /// What has, each in a sentence.
    #[schemars(example = [crate::examples::DAMAGE])]
    damaged: Vec<String>,
}

async fn show(State(app): State<App>) -> Result<Json<ServerStatus>> {
    let database = app.config.database();
    let bytes = |ending: &str| {
        let mut name = database.as_os_str().to_owned();
        name.push(ending);
        std::fs::metadata(name).map_or(0, |file| file.len())
    };
    let round = app.scrubbed.round();
    Ok(Json(ServerStatus {
        version: env!("CARGO_PKG_VERSION"),
        started_at: app.started_at,
        database_bytes: bytes("") + bytes("-wal"),
        free_bytes: fs4::available_space(&app.config.data).ok(),
        sessions: sessions::list(app.store.read(), sessions::Filter::default()).await?.len(),
        last_backup_at: backup::newest(&app.config.data),
        last_backup_problem: app.last_backup.why_not_good(),
        scrubbed_at: round.ended_at,
        damaged: round.damaged.into_iter().collect(),
    }))
}

/// A backup that has just been made.
#[derive(Serialize, JsonSchema)]
struct BackupFile {
    #[schemars(example = &"lodestep-20261128T081500Z.db")]
    file: String,
    bytes: u64,
    /// What is damaged in it as it is in the database; all else can be read.
    #[schemars(example = [crate::examples::DAMAGE])]
    damaged: Vec<String>,
}

async fn back_up(State(app): State<App>, caller: Caller) -> Result<Created<Json<BackupFile>>> {
    let data = app.config.data.clone();
    let made = backup::make(&data, &backup::folder(&data), backup::ASKED_FOR).await.map_err(told)?;
    let file = made.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let entry = caller.did("backup.made", &file, None, Some(serde_json::json!({"bytes": made.bytes})));
    app.store.writer().run(move |db| Box::pin(async move { audit::insert(db, &entry).await })).await?;
    Ok(Created(Json(BackupFile { file, bytes: made.bytes, damaged: made.damaged })))
}

/// What is told of a backup that was not made: nothing that was kept is lost by it.
fn told(why: NotMade) -> Error {
    let detail = why.to_string();
    match why {
        NotMade::NoRoom { .. } => Error::http(StatusCode::INSUFFICIENT_STORAGE, "disk_full", detail),
        NotMade::Another(_) => Error::conflict("backup_running", detail),
        NotMade::NotGood(_) => Error::http(StatusCode::INTERNAL_SERVER_ERROR, "no_good_backup", detail),
        NotMade::Failed(error) => Error::Internal(error),
    }
}
