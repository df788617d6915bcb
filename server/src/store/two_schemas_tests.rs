//! The schema of PostgreSQL, held against what the steps of SQLite make: the same tables with the same columns, and null where null
//! may be.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};

use super::migrations;

/// By table and column: whether it may be null.
type Columns = BTreeMap<String, BTreeMap<String, bool>>;

/// What SQLite needs to find chunks, and PostgreSQL does not.
const ONLY_SQLITE: &str = "stream_parts";
/// Who writes, where a file is held by its folder; and what lies in files of that folder.
const ONLY_POSTGRES: [&str; 2] = ["database_owner", "upload_pieces"];

async fn of_sqlite() -> Columns {
    let mut db = SqliteConnection::connect("sqlite::memory:").await.unwrap();
    migrations::run(&mut db).await.unwrap();
    let names = "select name from sqlite_schema where type = 'table'
        and name not like 'sqlite\\_%' escape '\\' and name not like '\\_sqlx%' escape '\\'";
    let names: Vec<String> = sqlx::query_scalar(names).fetch_all(&mut db).await.unwrap();
    let mut tables = Columns::new();
    for table in names {
        let sql = format!("select name, \"notnull\" = 0 and pk = 0 from pragma_table_info('{table}')");
        let columns: Vec<(String, bool)> =
            sqlx::query_as(AssertSqlSafe(sql)).fetch_all(&mut db).await.unwrap();
        tables.insert(table, columns.into_iter().collect());
    }
    tables
}

/// As its steps are written: each column in a line of its own.
fn of_postgres() -> Columns {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../migrations/postgres");
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let text: String = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    let mut tables = Columns::new();
    let mut within: Option<String> = None;
    for line in text.lines().map(|line| line.split("--").next().unwrap_or_default().trim()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["create", "table", name, "("] => {
                tables.insert(name.to_owned(), BTreeMap::new());
                within = Some(name.to_owned());
            }
            [");"] => within = None,
            ["alter", "table", name, "add", "column", column, ..] => {
                tables.get_mut(name).unwrap().insert(column.to_owned(), may_be_null(line));
            }
            [name, ..] if !matches!(name, "primary" | "unique" | "check" | "foreign") => {
                if let Some(table) = &within {
                    let column = name.trim_matches('"').to_owned();
                    tables.get_mut(table).unwrap().insert(column, may_be_null(line));
                }
            }
            _ => {}
        }
    }
    tables
}

fn may_be_null(column: &str) -> bool {
    !["not null", "primary key", "as identity"].iter().any(|word| column.contains(word))
}

#[tokio::test]
async fn both_databases_have_the_same_tables_with_the_same_columns() {
    let (mut sqlite, mut postgres) = (of_sqlite().await, of_postgres());
    assert!(sqlite.remove(ONLY_SQLITE).is_some());
    for table in ONLY_POSTGRES {
        assert!(postgres.remove(table).is_some());
    }
    assert!(postgres.len() > 30, "{postgres:?}");
    for table in sqlite.keys().chain(postgres.keys()) {
        let told = "a step of SQLite's has its like in migrations/postgres (migrations/README.md)";
        assert_eq!(sqlite.get(table), postgres.get(table), "{table}: {told}");
    }
}
