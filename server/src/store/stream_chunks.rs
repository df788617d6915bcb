//! The chunks of live streams: in the order in which they were written, whosesoever they are, with an index that goes on at
//! its end for all sessions together (`migrations/0016_streams_by_stretches.sql` tells why).
//!
//! A batch that is on disk already is refused by the index within a stretch only; over all of a walk the session's actor takes
//! no number twice (`live/sequence.rs`), and what it takes up again comes from here.

use std::collections::BTreeMap;
#[cfg(not(feature = "cluster"))]
use std::collections::BTreeSet;

use futures_util::{Stream, TryStreamExt};
use lodestep_engine::stream::StreamId;
use sqlx::Row as _;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::many_rows::{Statement, placeholders, shaped, shapes};
use super::raw_chunks::{Packed, Samples, unpack};
use super::{StoreError, columns};

/// Chunks in one statement.
const CHUNKS_PER_STATEMENT: usize = 256;

/// An id less its last so many bits is the part of the table that a chunk lies in.
#[cfg(not(feature = "cluster"))]
const PART_BITS: u32 = 20;

/// `stream_chunks where …`: the chunks of session `$1` that fulfil a condition, out of the index alone: a look into each stretch of
/// the parts in which the session has any.
#[cfg(not(feature = "cluster"))]
macro_rules! chunks {
    ($condition:literal) => {
        concat!("stream_chunks where id in ", ids!($condition))
    };
}

/// The newest of these.
#[cfg(not(feature = "cluster"))]
macro_rules! newest_chunk {
    ($condition:literal) => {
        concat!("stream_chunks where id = (select max(id) from ", ids!($condition), ")")
    };
}

#[cfg(not(feature = "cluster"))]
macro_rules! ids {
    ($condition:literal) => {
        concat!(
            "(with recursive stretch (n) as (select 0 union all select n + 1 from stretch where n < 255)
              select chunk.id from stream_parts parts cross join stretch cross join stream_chunks chunk
              where parts.session_id = $1 and chunk.id >> 12 = (parts.part << 8) + stretch.n
              and chunk.session_id = parts.session_id ",
            $condition,
            ")"
        )
    };
}

/// The chunks of session `$1` that fulfil a condition: PostgreSQL keeps them by their key, which is the fence of the walk, too.
#[cfg(feature = "cluster")]
macro_rules! chunks {
    ($condition:literal) => {
        concat!("stream_chunks chunk where chunk.session_id = $1 ", $condition)
    };
}

#[cfg(feature = "cluster")]
macro_rules! newest_chunk {
    ($condition:literal) => {
        concat!(chunks!($condition), " order by id desc limit 1")
    };
}

/// Adds chunks, each with its session's id, in this order.
pub(super) async fn insert(db: &mut Connection, chunks: Vec<(&str, &Packed)>) -> Result<(), StoreError> {
    if chunks.is_empty() {
        return Ok(());
    }
    let newest = newest_id(&mut *db).await?;
    let chunks: Vec<(i64, &str, &Packed)> =
        (newest + 1..).zip(chunks).map(|(id, (session_id, chunk))| (id, session_id, chunk)).collect();
    for rows in shapes(&chunks, CHUNKS_PER_STATEMENT) {
        let sql = format!(
            "insert into stream_chunks (
                {ID} session_id, stream, first_sequence, sequences, t_first_ns, samples, encoding, body, checksum
             ) values {}",
            placeholders(rows.len(), 9 + usize::from(!ID.is_empty()))
        );
        let query = rows.iter().fold(shaped(sql), |query, &(id, session_id, chunk)| {
            let query = if ID.is_empty() { query } else { query.bind(id) };
            query
                .bind(session_id.to_owned())
                .bind(chunk.stream.name().to_owned())
                .bind(columns::to_column(chunk.first_sequence))
                .bind(columns::to_column(chunk.sequences))
                .bind(chunk.t_first_ns)
                .bind(columns::to_column(chunk.samples))
                .bind(chunk.encoding)
                .bind(chunk.body.clone())
                .bind(chunk.checksum(session_id))
        });
        query.execute(&mut *db).await?;
    }
    note_parts(db, &chunks).await
}

/// Who numbers the chunks: the one writer of SQLite, or PostgreSQL, where several write.
#[cfg(not(feature = "cluster"))]
const ID: &str = "id,";
#[cfg(feature = "cluster")]
const ID: &str = "";

#[cfg(not(feature = "cluster"))]
async fn newest_id(db: &mut Connection) -> Result<i64, StoreError> {
    Ok(sqlx::query_scalar("select coalesce(max(id), 0) from stream_chunks").fetch_one(db).await?)
}

#[cfg(feature = "cluster")]
async fn newest_id(_db: &mut Connection) -> Result<i64, StoreError> {
    Ok(0)
}

/// Notes in which parts of the table these sessions have chunks.
#[cfg(not(feature = "cluster"))]
async fn note_parts(db: &mut Connection, chunks: &[(i64, &str, &Packed)]) -> Result<(), StoreError> {
    let parts: BTreeSet<(&str, i64)> =
        chunks.iter().map(|&(id, session_id, _)| (session_id, id >> PART_BITS)).collect();
    for rows in shapes(&Vec::from_iter(parts), CHUNKS_PER_STATEMENT) {
        let sql = format!(
            "insert into stream_parts (session_id, part) values {} on conflict do nothing",
            placeholders(rows.len(), 2)
        );
        let query = rows
            .iter()
            .fold(shaped(sql), |query, (session_id, part)| query.bind((*session_id).to_owned()).bind(*part));
        query.execute(&mut *db).await?;
    }
    Ok(())
}

/// They are found by their key.
#[cfg(feature = "cluster")]
async fn note_parts(_db: &mut Connection, _chunks: &[(i64, &str, &Packed)]) -> Result<(), StoreError> {
    Ok(())
}

/// The stream's next batch of this stream that is not on disk yet.
pub async fn next_sequence(
    db: impl Executor<'_>,
    session_id: Uuid,
    stream: StreamId,
) -> Result<u64, StoreError> {
    let query = sqlx::query(concat!(
        "select first_sequence + sequences as next from ",
        newest_chunk!("and chunk.stream = $2")
    ));
    let last = query.bind(session_id.to_string()).bind(stream.name().to_owned()).fetch_optional(db).await?;
    Ok(last.map_or(Ok(0), |row| columns::count(&row, "next"))?)
}

/// The samples of one stream in order, chunk by chunk.
pub fn of_stream<'a>(
    db: impl Executor<'a> + 'a,
    session_id: Uuid,
    stream: StreamId,
) -> impl Stream<Item = Result<Samples, StoreError>> + 'a {
    let query = sqlx::query(concat!("select * from ", chunks!("and chunk.stream = $2"), " order by id"));
    unpacked(query.bind(session_id.to_string()).bind(stream.name().to_owned()).fetch(db))
}

/// The samples of all streams in the order in which they came, chunk by chunk.
pub fn as_received<'a>(
    db: impl Executor<'a> + 'a,
    session_id: Uuid,
) -> impl Stream<Item = Result<Samples, StoreError>> + 'a {
    let query = sqlx::query(concat!("select * from ", chunks!(""), " order by id"));
    unpacked(query.bind(session_id.to_string()).fetch(db))
}

/// The same from these batches on; of a stream that is not among them from the first on.
pub fn as_received_from<'a>(
    db: impl Executor<'a> + 'a,
    session_id: Uuid,
    from: &BTreeMap<StreamId, u64>,
) -> impl Stream<Item = Result<Samples, StoreError>> + 'a {
    let query = sqlx::query(concat!(
        "select * from ",
        chunks!(
            "and chunk.first_sequence >= coalesce(
                (select cast(value as bigint) from json_each($2) where key = chunk.stream), 0)"
        ),
        " order by id"
    ));
    let query = query.bind(session_id.to_string());
    unpacked(query.bind(serde_json::to_string(from).unwrap_or_else(|_| "{}".to_owned())).fetch(db))
}

fn unpacked<'a>(
    rows: impl Stream<Item = sqlx::Result<Row>> + 'a,
) -> impl Stream<Item = Result<Samples, StoreError>> + 'a {
    rows.map_err(StoreError::from).and_then(|row| std::future::ready(unpack(&row)))
}

/// How many bytes the samples of a session take.
pub(super) async fn bytes(db: &mut Connection, session_id: Uuid) -> Result<i64, StoreError> {
    let query = sqlx::query(concat!("select coalesce(sum(length(body)), 0) from ", chunks!("")));
    Ok(query.bind(session_id.to_string()).fetch_one(db).await?.try_get(0)?)
}

/// Removes so many chunks of a session; whether there were any.
pub(super) async fn remove_some(
    db: &mut Connection,
    session_id: Uuid,
    at_most: u32,
) -> Result<bool, StoreError> {
    let query = sqlx::query(concat!(
        "delete from stream_chunks where session_id = $1 and id in (select id from ",
        chunks!(""),
        " limit $2)"
    ));
    Ok(query.bind(session_id.to_string()).bind(i64::from(at_most)).execute(db).await?.rows_affected() > 0)
}

/// Asks how many samples there are of a stream.
pub(super) fn samples(session_id: Uuid, stream: StreamId) -> Statement {
    let query = sqlx::query(concat!(
        "select cast(coalesce(sum(samples), 0) as bigint) as samples from ",
        chunks!("and chunk.stream = $2")
    ));
    query.bind(session_id.to_string()).bind(stream.name().to_owned())
}

/// Asks for the chunks of a stream that come next, some hundreds.
pub(super) fn next(session_id: Uuid, stream: StreamId, from_sequence: u64) -> Statement {
    let query = sqlx::query(concat!(
        "select * from ",
        chunks!("and chunk.stream = $2 and chunk.first_sequence >= $3"),
        " order by id limit 500"
    ));
    query.bind(session_id.to_string()).bind(stream.name().to_owned()).bind(columns::to_column(from_sequence))
}

/// Asks which chunks of a stream, by their sequence numbers, hold what was measured between two times, ns.
pub(super) fn sequences_between(session_id: Uuid, stream: StreamId, from_ns: i64, to_ns: i64) -> Statement {
    let query = sqlx::query(concat!(
        "with chunks as (select first_sequence, t_first_ns from ",
        chunks!("and chunk.stream = $2"),
        ")
         select min(first_sequence) as first, max(first_sequence) as last from chunks
         where t_first_ns < $4 and first_sequence >= coalesce(
            (select max(first_sequence) from chunks where t_first_ns <= $3), 0)"
    ));
    query.bind(session_id.to_string()).bind(stream.name().to_owned()).bind(from_ns).bind(to_ns)
}
