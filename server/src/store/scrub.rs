//! Looks whether what is stored is as it was written: every chunk of samples, every point of a track, every chart, lab run and photo
//! that has a checksum, piece by piece. What is damaged is named; nothing is changed.

use sha2::{Digest, Sha256};
use sqlx::Row as _;

use super::dialect::{Connection, Row};
use super::{StoreError, charts, lab_tracks, raw_chunks, track};

/// Rows in a piece, of tables with large rows and with small ones.
const LARGE: i64 = 32;
const SMALL: i64 = 2_000;
/// Rows that are named; of more it is said how many there are.
const MOST_NAMED: usize = 20;

/// How far a look has come: the table, and the key of its last row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    table: usize,
    after: Key,
}

/// The key of a row: of three words and a number those that the table has.
#[derive(Clone, Debug, PartialEq)]
struct Key([String; 3], i64);

impl Default for Key {
    fn default() -> Key {
        Key(Default::default(), i64::MIN)
    }
}

/// What one piece came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Looked {
    /// Rows that were looked at.
    pub rows: u64,
    /// What is damaged, each in a sentence.
    pub damaged: Vec<String>,
    /// Where to go on; `None` at the end.
    pub next: Option<Place>,
}

/// A table: its statement (key after `$1` to `$4`, at most `$5` rows), its rows' key, and whether a row is as it was written.
struct Table {
    name: &'static str,
    rows: i64,
    select: &'static str,
    key: fn(&Row) -> sqlx::Result<Key>,
    check: fn(&Row) -> Result<(), StoreError>,
}

static TABLES: [Table; 6] = [
    Table {
        name: "raw_chunks",
        rows: LARGE,
        select: "select * from raw_chunks where id > $4 order by id limit $5",
        key: by_id,
        check: raw_chunks::check,
    },
    #[cfg(feature = "cluster")]
    Table {
        name: "stream_chunks",
        rows: SMALL,
        select: "select * from stream_chunks where (session_id, id) > ($1, $4) order by session_id, id limit $5",
        key: |row| Ok(Key([row.try_get("session_id")?, String::new(), String::new()], row.try_get("id")?)),
        check: raw_chunks::check,
    },
    #[cfg(not(feature = "cluster"))]
    Table {
        name: "stream_chunks",
        rows: SMALL,
        select: "select * from stream_chunks where id > $4 order by id limit $5",
        key: by_id,
        check: raw_chunks::check,
    },
    Table {
        name: "lab_tracks",
        rows: LARGE,
        select: "select * from lab_tracks where run_id > $1 order by run_id limit $5",
        key: |row| Ok(Key([row.try_get("run_id")?, String::new(), String::new()], 0)),
        check: lab_tracks::check,
    },
    Table {
        name: "fault_photos",
        rows: LARGE,
        select: "select * from fault_photos where id > $1 order by id limit $5",
        key: |row| Ok(Key([row.try_get("id")?, String::new(), String::new()], 0)),
        check: check_photo,
    },
    Table {
        name: "session_charts",
        rows: LARGE,
        select: "select * from session_charts where (session_id, chart, series) > ($1, $2, $3)
                 order by session_id, chart, series limit $5",
        key: |row| Ok(Key([row.try_get("session_id")?, row.try_get("chart")?, row.try_get("series")?], 0)),
        check: charts::check,
    },
    Table {
        name: "track_points",
        rows: SMALL,
        select: "select * from track_points where (session_id, run, t_ns) > ($1, $2, $4)
                 order by session_id, run, t_ns limit $5",
        key: |row| {
            Ok(Key([row.try_get("session_id")?, row.try_get("run")?, String::new()], row.try_get("t_ns")?))
        },
        check: track::check,
    },
];

fn by_id(row: &Row) -> sqlx::Result<Key> {
    Ok(Key(Default::default(), row.try_get("id")?))
}

fn check_photo(row: &Row) -> Result<(), StoreError> {
    let (id, expected): (&str, &str) = (row.try_get("id")?, row.try_get("sha256")?);
    let body: &[u8] = row.try_get("body")?;
    let found: String = Sha256::digest(body).iter().map(|byte| format!("{byte:02x}")).collect();
    if found == expected {
        return Ok(());
    }
    let (what, why) =
        (format!("photo {id}"), format!("expected bytes with the SHA-256 {expected}, found {found}"));
    Err(StoreError::Damaged { what, why })
}

/// Looks at the next piece.
pub async fn look(db: &mut Connection, place: Place) -> Result<Looked, StoreError> {
    let Some(table) = TABLES.get(place.table) else { return Ok(Looked::default()) };
    let next_table = Some(Place { table: place.table + 1, after: Key::default() });
    let Place { after: Key([first, second, third], number), .. } = place;
    let query = sqlx::query(table.select).bind(first).bind(second).bind(third).bind(number).bind(table.rows);
    let rows = match query.fetch_all(db).await.map_err(StoreError::from) {
        Ok(rows) => rows,
        // Whatever is behind this page of the table cannot be come by.
        Err(StoreError::Corrupt(why)) => {
            let damaged = vec![format!("the table {} cannot be read to its end: {why}", table.name)];
            return Ok(Looked { rows: 0, damaged, next: next_table });
        }
        Err(error) => return Err(error),
    };
    let mut looked = Looked { rows: rows.len() as u64, ..Looked::default() };
    for row in &rows {
        match (table.check)(row) {
            Ok(()) => {}
            Err(error @ StoreError::Damaged { .. }) => looked.damaged.push(error.to_string()),
            // A value of another type than its column has.
            Err(error) => looked.damaged.push(format!("a row of {} cannot be read: {error}", table.name)),
        }
    }
    let last = rows.last().filter(|_| rows.len() as i64 == table.rows).map(table.key).transpose()?;
    looked.next = match last {
        Some(after) => Some(Place { table: place.table, after }),
        None => next_table.filter(|next| next.table < TABLES.len()),
    };
    Ok(looked)
}

/// Looks at all of it, at once; what is damaged, as far as it is named.
pub async fn look_at_all(db: &mut Connection) -> Result<Vec<String>, StoreError> {
    let (mut place, mut damaged, mut more) = (Some(Place::default()), Vec::new(), 0);
    while let Some(at) = place {
        let looked = look(db, at).await?;
        for what in looked.damaged {
            if damaged.len() < MOST_NAMED { damaged.push(what) } else { more += 1 }
        }
        place = looked.next;
    }
    if more > 0 {
        damaged.push(format!("{more} more"));
    }
    Ok(damaged)
}
