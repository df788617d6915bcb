//! Databases of every released state of the schema, opened by the store of today: nothing they hold is lost, and all
//! of it can be read.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use futures_util::TryStreamExt;
use lodestep_engine::systems::pedestrian::BOTH;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, ConnectOptions, SqliteConnection};
use tempfile::TempDir;
use uuid::Uuid;

use super::sessions::Filter;
use super::track::{self, TrackKind};
use super::{
    Store, accounts, anomalies, audit, backup, charts, fault_changes, fault_photos, faults, inspectors, jobs,
    lab_runs, lab_tracks, logs, mappings, marker_changes, marker_imports, marker_residuals, markers,
    parameter_sets, raw_chunks, reports, sessions, sign_ins, site_parameters, stands, stream_chunks,
    stream_visits, tokens, visits, webhook_deliveries, webhooks,
};

/// The rows of a database: by table, each row as the SQL text of its columns.
type Rows = BTreeMap<String, Vec<BTreeMap<String, String>>>;

/// Every stored database, by the step that it is of.
fn databases() -> BTreeMap<u32, PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/databases");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let step = |path: &Path| path.file_name().unwrap().to_str().unwrap()[..4].parse().unwrap();
    files.map(|path| (step(&path), path)).collect()
}

/// The numbers of the steps.
fn steps() -> Vec<u32> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../migrations");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name());
    // Beside the steps lie the README and the whole schema.
    let mut steps: Vec<u32> = files.filter_map(|name| name.to_str()?.get(..4)?.parse().ok()).collect();
    steps.sort_unstable();
    steps
}

fn unpacked(path: &Path) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let mut bytes = Vec::new();
    GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_end(&mut bytes).unwrap();
    let database = folder.path().join("lodestep.db");
    std::fs::write(&database, bytes).unwrap();
    (folder, database)
}

/// All rows, read as they are. `columns` names what to read of each table; without it, all.
async fn rows(database: &Path, columns: Option<&Rows>) -> Rows {
    let mut db: SqliteConnection =
        SqliteConnectOptions::new().filename(database).read_only(true).connect().await.unwrap();
    let tables: Vec<String> = sqlx::query_scalar(
        "select name from sqlite_master where type = 'table' and name not like '\\_sqlx%' escape '\\'
         and name not like 'sqlite%' order by name",
    )
    .fetch_all(&mut db)
    .await
    .unwrap();
    let mut all = Rows::new();
    for table in tables {
        let named: Vec<String> = match columns {
            Some(columns) => match columns.get(name_in(columns, &table)).and_then(|rows| rows.first()) {
                Some(row) => row.keys().cloned().collect(),
                None => continue,
            },
            None => sqlx::query_scalar("select name from pragma_table_info(?1)")
                .bind(&table)
                .fetch_all(&mut db)
                .await
                .unwrap(),
        };
        let before = columns.map_or(&table[..], |columns| name_in(columns, &table)).to_owned();
        let pairs: Vec<String> = named
            .iter()
            .map(|name| match columns {
                Some(_) => format!("'{name}', quote({})", column_of_today(&before, name)),
                None => format!("'{name}', quote({name})"),
            })
            .collect();
        let sql = format!("select json_object({}) from {table} order by 1", pairs.join(", "));
        let told: Vec<String> = sqlx::query_scalar(AssertSqlSafe(sql)).fetch_all(&mut db).await.unwrap();
        all.insert(before, told.iter().map(|row| serde_json::from_str(row).unwrap()).collect());
    }
    all
}

/// What a table of today is called in a database of some step.
fn name_in<'a>(rows: &Rows, table: &'a str) -> &'a str {
    if table == "carriers" && !rows.contains_key("carriers") { "inspectors" } else { table }
}

/// What a column is called since step 18.
fn column_of_today<'a>(table: &str, column: &'a str) -> &'a str {
    match (table, column) {
        ("sessions", "inspector_id") => "carrier_id",
        ("logs" | "raw_chunks" | "stream_chunks" | "anomalies", "foot") => "stream",
        ("track_points", "left_e_m") => "part_0_e_m",
        ("track_points", "left_n_m") => "part_0_n_m",
        ("track_points", "left_u_m") => "part_0_u_m",
        ("track_points", "right_e_m") => "part_1_e_m",
        ("track_points", "right_n_m") => "part_1_n_m",
        ("track_points", "right_u_m") => "part_1_u_m",
        ("track_points", "left_stance") => "part_0_stance",
        ("track_points", "right_stance") => "part_1_stance",
        _ => column,
    }
}

/// What a later step changed on purpose in what was there before.
fn as_of_today(mut rows: Rows) -> Rows {
    // Step 18: the feet of a session are its streams; saved states are of no use to a newer program.
    rows.remove("live_states");
    let text = |word: &str| format!("'{word}'");
    let mut streams = Vec::new();
    for session in rows.get_mut("sessions").into_iter().flatten() {
        let Some(feet) = session.remove("feet") else { continue };
        for (number, name) in
            ["left", "right"].into_iter().enumerate().filter(|(_, name)| feet.contains(name))
        {
            streams.push(BTreeMap::from([
                ("session_id".to_owned(), session["id"].clone()),
                ("number".to_owned(), number.to_string()),
                ("name".to_owned(), text(name)),
                ("role".to_owned(), text(&format!("{name}_foot"))),
                ("kind".to_owned(), text("imu")),
            ]));
        }
    }
    if !streams.is_empty() {
        rows.insert("streams".to_owned(), streams);
    }
    for fault in rows.get_mut("faults").into_iter().flatten() {
        // Step 9: what was closed counts as verified.
        if fault["state"] == "'closed'" {
            fault.insert("state".into(), "'verified'".into());
        }
    }
    // Step 16: what came live has a table of its own.
    let chunks = rows.get_mut("raw_chunks").map(std::mem::take).unwrap_or_default();
    let (streamed, of_logs): (Vec<_>, Vec<_>) = chunks.into_iter().partition(|row| row["log_id"] == "NULL");
    rows.insert("raw_chunks".into(), of_logs);
    for mut row in streamed {
        row.retain(|column, _| !["id", "log_id"].contains(&column.as_str()));
        rows.entry("stream_chunks".into()).or_default().push(row);
    }
    rows.values_mut().for_each(|rows| rows.sort());
    rows
}

#[tokio::test]
async fn no_row_of_a_released_database_is_lost_or_changed() {
    let databases = databases();
    // Every step of the schema has one: scripts/database-fixtures makes that of a new step.
    assert_eq!(databases.keys().copied().collect::<Vec<_>>(), steps(), "a database is missing or too many");
    for (step, path) in databases {
        let (_folder, database) = unpacked(&path);
        let before = rows(&database, None).await;
        assert!(
            before.values().all(|rows| !rows.is_empty()),
            "{step}: an empty table proves nothing: {before:?}"
        );
        Store::open(&database, 1).await.unwrap().close().await;
        let before = as_of_today(before);
        let after = rows(&database, Some(&before)).await;
        assert_eq!(as_of_today(after), before, "step {step}");
        backup::check(&database).await.unwrap();
    }
}

#[tokio::test]
async fn every_released_database_passes_for_a_backup_as_it_is() {
    for (step, path) in databases() {
        let (_folder, database) = unpacked(&path);
        let checked = backup::check(&database).await;
        assert!(checked.is_ok(), "step {step}: {checked:?}");
    }
}

#[tokio::test]
async fn everything_in_a_released_database_can_be_read() {
    for (step, path) in databases() {
        let (_folder, database) = unpacked(&path);
        let store = Store::open(&database, 1).await.unwrap();
        let read = read_everything(&store).await;
        // What every database has from its first day.
        for (what, count) in [
            ("inspectors", 1),
            ("sessions", 2),
            ("logs", 1),
            ("samples", 15),
            ("points", 4),
            ("visits", 1),
            ("anomalies", 1),
            ("markers", 2),
            ("faults", 2),
            ("jobs", 1),
            ("residuals", 1),
        ] {
            assert!(read[what] >= count, "step {step}: {what}: {read:?}");
        }
        for (what, since) in [
            ("stream visits", 2),
            ("stands", 4),
            ("reports", 5),
            ("accounts", 6),
            ("sign-ins", 6),
            ("tokens", 6),
            ("audit", 6),
            ("marker changes", 7),
            ("marker imports", 7),
            ("charts", 8),
            ("fault changes", 9),
            ("photos", 9),
            ("mappings", 10),
            ("parameter sets", 11),
            ("lab runs", 11),
            ("webhooks", 12),
            ("deliveries", 12),
            ("figures of anomalies", 15),
            ("site parameters", 15),
        ] {
            assert_eq!(
                read.get(what).is_some_and(|count| *count > 0),
                step >= since,
                "step {step}: {what}: {read:?}"
            );
        }
        store.close().await;
    }
}

/// Asks every question that lists something; how much there is of each.
async fn read_everything(store: &Store) -> BTreeMap<&'static str, usize> {
    let db = store.read();
    let mut read = BTreeMap::new();
    let mut count = |what: &'static str, count: usize| *read.entry(what).or_default() += count;
    count("inspectors", inspectors::list(db).await.unwrap().len());
    let all = sessions::list(db, Filter { inspector_id: None, state: None }).await.unwrap();
    count("sessions", all.len());
    for session in all.iter().map(|session| session.id) {
        for log in logs::of_session(db, session).await.unwrap() {
            let chunks: Vec<_> = raw_chunks::of_log(db, log.id).try_collect().await.unwrap();
            count("samples", chunks.iter().map(|chunk| chunk.readings.len()).sum());
            count("logs", 1);
        }
        for stream in BOTH {
            let chunks: Vec<_> = stream_chunks::of_stream(db, session, stream).try_collect().await.unwrap();
            count("samples", chunks.iter().map(|chunk| chunk.readings.len()).sum());
        }
        for run in [TrackKind::Main, TrackKind::Filtered, TrackKind::WithoutMarkers] {
            let points: Vec<_> = track::points(db, session, run).try_collect().await.unwrap();
            count("points", points.len());
        }
        count("visits", visits::of_session(db, session).await.unwrap().len());
        count("stream visits", stream_visits::of_session(db, session).await.unwrap().len());
        let found = anomalies::of_session(db, session).await.unwrap();
        count("anomalies", found.len());
        count("figures of anomalies", found.iter().filter(|anomaly| anomaly.found.figures.is_some()).count());
        count("stands", stands::of_session(db, session).await.unwrap().len());
        count("reports", usize::from(reports::get(db, session).await.unwrap().is_some()));
        count("charts", charts::of_session(db, session).await.unwrap().len());
    }
    for marker in markers::list(db).await.unwrap() {
        count("markers", 1);
        count("marker changes", marker_changes::of_marker(db, &marker.name).await.unwrap().len());
    }
    count("residuals", marker_residuals::all(db).await.unwrap().len());
    for import in marker_imports::list(db, 100).await.unwrap() {
        let plan = marker_imports::plan(db, import.id).await.unwrap();
        serde_json::from_str::<serde_json::Value>(&plan).unwrap();
        count("marker imports", marker_imports::file(db, import.id).await.unwrap().len());
    }
    for fault in faults::list(db, None).await.unwrap() {
        count("faults", 1);
        count("fault changes", fault_changes::of_fault(db, fault.id).await.unwrap().len());
        for photo in fault_photos::of_fault(db, fault.id).await.unwrap() {
            count("photos", fault_photos::body(db, fault.id, photo.id).await.unwrap().unwrap().1.len());
        }
    }
    count("jobs", jobs::list(db, 100).await.unwrap().len());
    count("parameter sets", parameter_sets::list(db).await.unwrap().len());
    count("site parameters", usize::from(site_parameters::newest(db).await.unwrap().id > 0));
    for session in &all {
        let held = site_parameters::chosen(db, session.site_parameters_id).await.unwrap();
        assert_eq!(held.id, session.site_parameters_id.unwrap_or(0));
        for run in lab_runs::list(db, &[session.id], 100).await.unwrap() {
            count("lab runs", lab_tracks::get(db, run.id).await.unwrap().len());
        }
    }
    for hook in webhooks::list(db).await.unwrap() {
        count("webhooks", 1);
        count("deliveries", webhook_deliveries::of_webhook(db, hook.id, 100).await.unwrap().len());
    }
    count("mappings", mappings::list(db).await.unwrap().len());
    count("audit", audit::list(db, &audit::Wanted { limit: 100, ..Default::default() }).await.unwrap().len());
    count("tokens", tokens::list(db, None).await.unwrap().len());
    for account in accounts::list(db).await.unwrap() {
        count("accounts", 1);
        count("sign-ins", sign_ins::of_account(db, account.id).await.unwrap().len());
    }
    assert!(sessions::get(db, Uuid::nil()).await.unwrap().is_none());
    read
}
