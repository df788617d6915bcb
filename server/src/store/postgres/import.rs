//! A one-machine database is moved in: every row of the file, in one transaction, and then read back and compared.

use std::path::Path;

use futures_util::TryStreamExt;
use sha2::{Digest, Sha256};
use sqlx::sqlite::{SqliteConnectOptions, SqliteRow};
use sqlx::{AssertSqlSafe, ConnectOptions as _, Connection as _, Row as _, SqliteConnection};

use super::dialect::{Connection, Row};
use super::{StoreError, VERSION, migrations, open};

/// Rows that are written in one statement, and bytes of them.
const ROWS: usize = 2_000;
const BYTES: usize = 4 << 20;

/// What was moved in of one table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moved {
    /// Its name.
    pub table: String,
    /// How many rows it has, in both databases.
    pub rows: u64,
    /// The hash over all of their values, in the order of their keys; the same of both.
    pub sha256: String,
}

/// A column, as PostgreSQL has it.
#[derive(Clone, Debug)]
struct Column {
    name: String,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Integer,
    Real,
    Text,
    Bytes,
    Boolean,
}

/// One value, of either database.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Null,
    Integer(i64),
    Real(f64),
    Text(String),
    Bytes(Vec<u8>),
    Boolean(bool),
}

struct Table {
    name: String,
    columns: Vec<Column>,
    /// By which rows are told apart, in a list for `order by`.
    key: String,
}

/// Moves a database file into the empty database at this address; what was moved, by table.
///
/// # Errors
///
/// When the file is not of this version, the database at the address is not empty, or anything is not the same afterwards: then
/// nothing of it stays there.
pub async fn import(file: &Path, address: &Path) -> Result<Vec<Moved>, StoreError> {
    let mut from = SqliteConnectOptions::new()
        .filename(file)
        .create_if_missing(false)
        .read_only(true)
        .pragma("trusted_schema", "off")
        .connect()
        .await?;
    let steps = "select coalesce(max(version), 0) from _sqlx_migrations where success";
    let version: i64 = sqlx::query_scalar(steps).fetch_one(&mut from).await?;
    if version != VERSION {
        return Err(StoreError::Open(format!(
            "expected a database of version {VERSION}, found one of version {version}: start the one-machine server of this version on it once"
        )));
    }
    let mut to = open::options(address).await?.connect().await?;
    migrations::run(&mut to).await?;
    let mut transaction = to.begin().await?;
    let mut moved = Vec::new();
    for table in tables(&mut transaction).await? {
        move_in(&mut from, &mut transaction, &table).await?;
        moved.push(compared(&mut from, &mut transaction, &table).await?);
    }
    transaction.commit().await?;
    from.close().await?;
    to.close().await?;
    Ok(moved)
}

/// The tables that both have, each after those that it names.
async fn tables(db: &mut Connection) -> Result<Vec<Table>, StoreError> {
    let mut tables = Vec::new();
    for name in migrations::tables() {
        let columns = "select column_name::text, data_type::text from information_schema.columns
             where table_schema = current_schema() and table_name = $1 order by ordinal_position";
        let columns: Vec<(String, String)> = sqlx::query_as(columns).bind(name).fetch_all(&mut *db).await?;
        let columns: Vec<Column> = columns
            .into_iter()
            .map(|(name, kind)| Ok(Column { name, kind: kind_of(&kind)? }))
            .collect::<Result<_, StoreError>>()?;
        let key = "select a.attname::text from pg_index i
             join pg_attribute a on a.attrelid = i.indrelid and a.attnum = any(i.indkey)
             where i.indrelid = quote_ident($1)::regclass and i.indisprimary
             order by array_position(i.indkey::int2[], a.attnum)";
        let key: Vec<String> = sqlx::query_scalar(key).bind(name).fetch_all(&mut *db).await?;
        // Chunks of streams lie in the file in the order of their numbers.
        let has_number = columns.iter().any(|column| column.name == "id" && column.kind == Kind::Integer);
        let key = if has_number { "id".to_owned() } else { quoted(key.iter()) };
        tables.push(Table { name: name.to_owned(), columns, key });
    }
    Ok(tables)
}

fn kind_of(word: &str) -> Result<Kind, StoreError> {
    Ok(match word {
        "bigint" => Kind::Integer,
        "double precision" => Kind::Real,
        "text" => Kind::Text,
        "bytea" => Kind::Bytes,
        "boolean" => Kind::Boolean,
        other => return Err(StoreError::Open(format!("expected a column of a known type, found {other}"))),
    })
}

fn quoted<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

impl Table {
    /// Names of the schema, which this program has made.
    fn select(&self) -> AssertSqlSafe<String> {
        let columns = quoted(self.columns.iter().map(|column| &column.name));
        AssertSqlSafe(format!("select {columns} from {} order by {}", self.name, self.key))
    }

    fn insert(&self) -> AssertSqlSafe<String> {
        let columns = quoted(self.columns.iter().map(|column| &column.name));
        let arrays: Vec<String> = self
            .columns
            .iter()
            .zip(1..)
            .map(|(column, number)| format!("${number}::{}[]", column.kind.word()))
            .collect();
        AssertSqlSafe(format!(
            "insert into {} ({columns}) select * from unnest({})",
            self.name,
            arrays.join(", ")
        ))
    }
}

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Kind::Integer => "bigint",
            Kind::Real => "double precision",
            Kind::Text => "text",
            Kind::Bytes => "bytea",
            Kind::Boolean => "boolean",
        }
    }
}

async fn move_in(from: &mut SqliteConnection, to: &mut Connection, table: &Table) -> Result<(), StoreError> {
    // The one row that a new database begins with.
    if table.name == "marker_revision" {
        sqlx::query("delete from marker_revision").execute(&mut *to).await?;
    }
    let count = AssertSqlSafe(format!("select count(*) from {}", table.name));
    let found: i64 = sqlx::query_scalar(count).fetch_one(&mut *to).await?;
    if found > 0 {
        return Err(StoreError::Open(format!(
            "expected an empty database, found {found} rows in {}: make another one to move into",
            table.name
        )));
    }
    let mut rows = sqlx::query(table.select()).fetch(from);
    let (mut piece, mut bytes) = (Vec::new(), 0);
    while let Some(row) = rows.try_next().await? {
        let values = of_sqlite(&row, table)?;
        bytes += values.iter().map(Value::bytes).sum::<usize>();
        piece.push(values);
        if piece.len() >= ROWS || bytes >= BYTES {
            insert(to, table, std::mem::take(&mut piece)).await?;
            bytes = 0;
        }
    }
    insert(to, table, piece).await?;
    if table.key == "id" {
        let next = AssertSqlSafe(format!(
            "select setval(pg_get_serial_sequence('{0}', 'id'), coalesce(max(id), 1), max(id) is not null) from {0}",
            table.name
        ));
        sqlx::query(next).execute(to).await?;
    }
    Ok(())
}

async fn insert(db: &mut Connection, table: &Table, rows: Vec<Vec<Value>>) -> Result<(), StoreError> {
    if rows.is_empty() {
        return Ok(());
    }
    let mut columns: Vec<Vec<Value>> = table.columns.iter().map(|_| Vec::with_capacity(rows.len())).collect();
    for row in rows {
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
    }
    let mut query = sqlx::query(table.insert());
    for (column, values) in table.columns.iter().zip(columns) {
        query = match column.kind {
            Kind::Integer => query.bind(each(values, |value| match value {
                Value::Integer(value) => Some(value),
                _ => None,
            })),
            Kind::Real => query.bind(each(values, |value| match value {
                Value::Real(value) => Some(value),
                _ => None,
            })),
            Kind::Text => query.bind(each(values, |value| match value {
                Value::Text(value) => Some(value),
                _ => None,
            })),
            Kind::Bytes => query.bind(each(values, |value| match value {
                Value::Bytes(value) => Some(value),
                _ => None,
            })),
            Kind::Boolean => query.bind(each(values, |value| match value {
                Value::Boolean(value) => Some(value),
                _ => None,
            })),
        };
    }
    query.execute(db).await?;
    Ok(())
}

fn each<T>(values: Vec<Value>, of: impl Fn(Value) -> Option<T>) -> Vec<Option<T>> {
    values.into_iter().map(of).collect()
}

fn of_sqlite(row: &SqliteRow, table: &Table) -> sqlx::Result<Vec<Value>> {
    let value = |(index, column): (usize, &Column)| -> sqlx::Result<Value> {
        Ok(match column.kind {
            Kind::Integer => row.try_get::<Option<i64>, _>(index)?.map_or(Value::Null, Value::Integer),
            Kind::Real => row.try_get::<Option<f64>, _>(index)?.map_or(Value::Null, Value::Real),
            Kind::Text => row.try_get::<Option<String>, _>(index)?.map_or(Value::Null, Value::Text),
            Kind::Bytes => row.try_get::<Option<Vec<u8>>, _>(index)?.map_or(Value::Null, Value::Bytes),
            Kind::Boolean => row.try_get::<Option<bool>, _>(index)?.map_or(Value::Null, Value::Boolean),
        })
    };
    table.columns.iter().enumerate().map(value).collect()
}

fn of_postgres(row: &Row, table: &Table) -> sqlx::Result<Vec<Value>> {
    let value = |(index, column): (usize, &Column)| -> sqlx::Result<Value> {
        Ok(match column.kind {
            Kind::Integer => row.try_get::<Option<i64>, _>(index)?.map_or(Value::Null, Value::Integer),
            Kind::Real => row.try_get::<Option<f64>, _>(index)?.map_or(Value::Null, Value::Real),
            Kind::Text => row.try_get::<Option<String>, _>(index)?.map_or(Value::Null, Value::Text),
            Kind::Bytes => row.try_get::<Option<Vec<u8>>, _>(index)?.map_or(Value::Null, Value::Bytes),
            Kind::Boolean => row.try_get::<Option<bool>, _>(index)?.map_or(Value::Null, Value::Boolean),
        })
    };
    table.columns.iter().enumerate().map(value).collect()
}

impl Value {
    fn bytes(&self) -> usize {
        match self {
            Value::Text(text) => text.len(),
            Value::Bytes(bytes) => bytes.len(),
            _ => 8,
        }
    }

    /// Adds it to a hash, with its length where it has one, so that no two rows look alike.
    fn hash(&self, hash: &mut Sha256) {
        match self {
            Value::Null => hash.update([0]),
            Value::Integer(value) => hash.update([&[1][..], &value.to_le_bytes()].concat()),
            Value::Real(value) => hash.update([&[2][..], &value.to_bits().to_le_bytes()].concat()),
            Value::Text(text) => {
                hash.update([&[3][..], &(text.len() as u64).to_le_bytes()].concat());
                hash.update(text);
            }
            Value::Bytes(bytes) => {
                hash.update([&[4][..], &(bytes.len() as u64).to_le_bytes()].concat());
                hash.update(bytes);
            }
            Value::Boolean(value) => hash.update([5, u8::from(*value)]),
        }
    }
}

/// How many rows, and a hash over them.
#[derive(Default)]
struct Told {
    rows: u64,
    hash: Sha256,
}

impl Told {
    fn add(&mut self, row: &[Value]) {
        self.rows += 1;
        row.iter().for_each(|value| value.hash(&mut self.hash));
    }

    fn end(self) -> (u64, String) {
        (self.rows, self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

async fn compared(
    from: &mut SqliteConnection,
    to: &mut Connection,
    table: &Table,
) -> Result<Moved, StoreError> {
    let (mut there, mut here) = (Told::default(), Told::default());
    let mut rows = sqlx::query(table.select()).fetch(from);
    while let Some(row) = rows.try_next().await? {
        there.add(&of_sqlite(&row, table)?);
    }
    let mut rows = sqlx::query(table.select()).fetch(to);
    while let Some(row) = rows.try_next().await? {
        here.add(&of_postgres(&row, table)?);
    }
    let (there, here) = (there.end(), here.end());
    if there != here {
        return Err(StoreError::Open(format!(
            "expected in {} the {} rows of the file with the hash {}, found {} with the hash {}: nothing was moved in",
            table.name, there.0, there.1, here.0, here.1
        )));
    }
    Ok(Moved { table: table.name.clone(), rows: here.0, sha256: here.1 })
}
