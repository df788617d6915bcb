//! The samples as they were measured, in chunks: written once, never changed. What came in logs is asked for here, what
//! came live in `stream_chunks`.

use futures_util::{Stream, TryStreamExt};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::{Reading, Readings, StreamId};
use sqlx::Row as _;
use uuid::Uuid;

use super::checksum::Checksum;
use super::dialect::{Executor, Row};
use super::{StoreError, columns, sample_columns, stream_chunks};

/// 88 bytes a sample, as the first migration tells it, as one zstd frame: how samples were packed until step 14.
const PLAIN_IN_ZSTD: i64 = 1;
/// By columns, as `sample_columns` tells it.
const BY_COLUMNS: i64 = 2;
/// Rows of numbers, by columns, as `sample_columns` tells it.
const ROWS: i64 = 3;

/// Bytes of one sample in the first layout: the time and ten channels, eight bytes each.
const SAMPLE_BYTES: usize = 88;

/// More samples than any chunk holds: a log's have some thousands.
const MOST_SAMPLES: usize = 1 << 20;

/// Readings of one stream, in the order of its log.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Whose.
    pub stream: StreamId,
    /// Number of the first batch (stream) or of the chunk (log).
    pub first_sequence: u64,
    /// How many batches or chunks these are.
    pub sequences: u64,
    /// The readings.
    pub readings: Readings,
}

/// Samples packed for their column.
#[derive(Clone, Debug)]
pub struct Packed {
    pub(super) stream: StreamId,
    pub(super) first_sequence: u64,
    pub(super) sequences: u64,
    pub(super) t_first_ns: i64,
    pub(super) samples: u64,
    pub(super) encoding: i64,
    pub(super) body: Vec<u8>,
}

/// Appends a reading: a sample in the layout of encoding 1, a row as its time and its numbers.
pub(crate) fn lay_out(reading: &Reading<'_>, plain: &mut Vec<u8>) {
    plain.extend_from_slice(&reading.t_ns().to_le_bytes());
    let mut number = |value: &f64| plain.extend_from_slice(&value.to_le_bytes());
    match reading {
        Reading::Imu(sample) => {
            let mag_ut = sample.mag_b_ut.unwrap_or([f64::NAN; 3]);
            [sample.w_ib_b_rad_s, sample.f_b_m_s2, mag_ut].as_flattened().iter().for_each(&mut number);
            number(&sample.pressure_hpa.unwrap_or(f64::NAN));
        }
        Reading::Values { values, .. } => values.iter().for_each(number),
    }
}

impl Packed {
    /// Packs samples; done by the caller's thread, so that the one writer only writes.
    pub fn new(batch: &Samples) -> Result<Packed, StoreError> {
        let mut body = Vec::with_capacity(batch.readings.len() * SAMPLE_BYTES / 2);
        let encoding = match &batch.readings {
            Readings::Imu(samples) => {
                sample_columns::write(samples, &mut body);
                BY_COLUMNS
            }
            Readings::Values(rows) => {
                sample_columns::write_rows(rows, &mut body);
                ROWS
            }
        };
        Ok(Packed {
            stream: batch.stream,
            first_sequence: batch.first_sequence,
            sequences: batch.sequences,
            t_first_ns: batch.readings.get(0).map_or(0, |reading| reading.t_ns()),
            samples: batch.readings.len() as u64,
            encoding,
            body,
        })
    }

    /// How many bytes it takes in the table.
    pub fn bytes(&self) -> usize {
        self.body.len()
    }

    /// The bytes as they go into the table.
    pub fn body(&self) -> &[u8] {
        &self.body
    }

    /// What its row is checked by.
    pub(super) fn checksum(&self, session_id: &str) -> i64 {
        let counts = [
            columns::to_column(self.first_sequence),
            columns::to_column(self.sequences),
            self.t_first_ns,
            columns::to_column(self.samples),
            self.encoding,
        ];
        checksum(session_id, self.stream.name(), counts, &self.body).column()
    }

    /// Takes its bytes out, to be set aside elsewhere until [`put_body`](Self::put_body).
    pub(crate) fn take_body(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.body)
    }

    /// Puts back the bytes that were taken out.
    pub(crate) fn put_body(&mut self, body: Vec<u8>) {
        self.body = body;
    }
}

/// Adds a chunk of a log.
pub async fn insert(
    db: impl Executor<'_>,
    session_id: Uuid,
    log_id: Uuid,
    chunk: Packed,
) -> Result<(), StoreError> {
    let checksum = chunk.checksum(&session_id.to_string());
    sqlx::query(
        "insert into raw_chunks (
            session_id, stream, log_id, first_sequence, sequences, t_first_ns, samples, encoding, body, checksum
         ) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
    )
    .bind(session_id.to_string())
    .bind(chunk.stream.name().to_owned())
    .bind(log_id.to_string())
    .bind(columns::to_column(chunk.first_sequence))
    .bind(columns::to_column(chunk.sequences))
    .bind(chunk.t_first_ns)
    .bind(columns::to_column(chunk.samples))
    .bind(chunk.encoding)
    .bind(chunk.body)
    .bind(checksum)
    .execute(db)
    .await?;
    Ok(())
}

/// Removes so many chunks of a log; whether there were any.
pub async fn clear_some(db: impl Executor<'_>, log_id: Uuid, at_most: u32) -> Result<bool, StoreError> {
    let query = sqlx::query(
        "delete from raw_chunks where id in (select id from raw_chunks where log_id = $1 limit $2)",
    )
    .bind(log_id.to_string())
    .bind(i64::from(at_most));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// The samples of a log in order, chunk by chunk.
pub fn of_log<'a>(
    db: impl Executor<'a> + 'a,
    log_id: Uuid,
) -> impl Stream<Item = Result<Samples, StoreError>> + 'a {
    sqlx::query("select * from raw_chunks where log_id = $1 order by first_sequence")
        .bind(log_id.to_string())
        .fetch(db)
        .map_err(StoreError::from)
        .and_then(|row| std::future::ready(unpack(&row)))
}

/// Where the readings of one stream come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A log that was handed in.
    Log(Uuid),
    /// The live stream of a session.
    Stream {
        /// The session.
        session_id: Uuid,
        /// The stream.
        stream: StreamId,
    },
}

/// How many samples there are of this origin.
pub async fn samples(db: impl Executor<'_>, origin: Origin) -> Result<u64, StoreError> {
    let query = match origin {
        Origin::Log(log_id) => sqlx::query(
            "select cast(coalesce(sum(samples), 0) as bigint) as samples from raw_chunks where log_id = $1",
        )
        .bind(log_id.to_string()),
        Origin::Stream { session_id, stream } => stream_chunks::samples(session_id, stream),
    };
    columns::count(&query.fetch_one(db).await?, "samples").map_err(StoreError::from)
}

/// The chunks that come next, from this sequence number on: at least one where there is one, and
/// not many more than hold `samples`. Unlike the streams above it leaves the connection free
/// between two calls.
pub async fn next(
    db: impl Executor<'_>,
    origin: Origin,
    from_sequence: u64,
    samples: u64,
) -> Result<Vec<Samples>, StoreError> {
    // The driver reads ahead of what it is asked for, so the limit is the statement's.
    let query = match origin {
        Origin::Log(log_id) => sqlx::query(
            "select * from raw_chunks where log_id = $2 and first_sequence >= $1
             order by first_sequence limit 1",
        )
        .bind(columns::to_column(from_sequence))
        .bind(log_id.to_string()),
        Origin::Stream { session_id, stream } => stream_chunks::next(session_id, stream, from_sequence),
    };
    let mut rows = query.fetch(db);
    let (mut chunks, mut held) = (Vec::new(), 0);
    while held < samples
        && let Some(row) = rows.try_next().await?
    {
        let chunk = unpack(&row)?;
        held += chunk.readings.len() as u64;
        chunks.push(chunk);
    }
    Ok(chunks)
}

/// Which chunks, by their sequence numbers, hold what was measured between two times, ns: those that begin
/// there, and the one before. `None` where there are none.
pub async fn sequences_between(
    db: impl Executor<'_>,
    origin: Origin,
    from_ns: i64,
    to_ns: i64,
) -> Result<Option<(u64, u64)>, StoreError> {
    let query = match origin {
        Origin::Log(log_id) => sqlx::query(
            "select min(first_sequence) as first, max(first_sequence) as last from raw_chunks
             where log_id = $1 and t_first_ns < $3 and first_sequence >= coalesce(
                (select max(first_sequence) from raw_chunks where log_id = $1 and t_first_ns <= $2), 0)",
        )
        .bind(log_id.to_string())
        .bind(from_ns)
        .bind(to_ns),
        Origin::Stream { session_id, stream } => {
            stream_chunks::sequences_between(session_id, stream, from_ns, to_ns)
        }
    };
    let row = query.fetch_one(db).await?;
    let (first, last) = (columns::optional_count(&row, "first")?, columns::optional_count(&row, "last")?);
    Ok(first.zip(last))
}

/// Of a chunk's row; `counts` are its columns from `first_sequence` to `encoding`.
fn checksum(session_id: &str, stream: &str, counts: [i64; 5], body: &[u8]) -> Checksum {
    let named = Checksum::default().text(session_id).text(stream);
    counts.into_iter().fold(named, Checksum::integer).bytes(body)
}

/// Whether a row of either table is as it was written.
pub(super) fn check(row: &Row) -> Result<(), StoreError> {
    let (session_id, stream): (&str, &str) = (row.try_get("session_id")?, row.try_get("stream")?);
    let mut counts = [0; 5];
    let names = ["first_sequence", "sequences", "t_first_ns", "samples", "encoding"];
    for (count, name) in counts.iter_mut().zip(names) {
        *count = row.try_get(name)?;
    }
    checksum(session_id, stream, counts, row.try_get("body")?).agrees(row, || {
        format!("samples of session {session_id} (stream {stream}, chunk {}, at {} ns)", counts[0], counts[2])
    })
}

/// A row's samples, of either table.
pub(super) fn unpack(row: &Row) -> Result<Samples, StoreError> {
    check(row)?;
    let id: i64 = row.try_get("id")?;
    let damaged = |why: String| StoreError::Damaged { what: format!("raw chunk {id}"), why };
    let (encoding, body) = (row.try_get("encoding")?, row.try_get("body")?);
    let readings = unpacked(encoding, body, columns::count(row, "samples")?).map_err(damaged)?;
    Ok(Samples {
        stream: columns::stream(row, "stream")?,
        first_sequence: columns::count(row, "first_sequence")?,
        sequences: columns::count(row, "sequences")?,
        readings,
    })
}

/// So many samples out of a packed body.
///
/// # Errors
///
/// When the body does not hold them, in a sentence.
pub fn unpacked(encoding: i64, body: &[u8], samples: u64) -> Result<Readings, String> {
    // What a damaged count asks for is never reserved.
    let count = usize::try_from(samples).ok().filter(|count| *count <= MOST_SAMPLES);
    let count = count
        .ok_or_else(|| format!("expected at most {MOST_SAMPLES} samples in a chunk, found {samples}"))?;
    match encoding {
        PLAIN_IN_ZSTD => {
            let expected = count * SAMPLE_BYTES;
            let plain = zstd::bulk::decompress(body, expected).map_err(|error| error.to_string())?;
            if plain.len() != expected {
                return Err(format!("expected {expected} bytes, found {}", plain.len()));
            }
            Ok(Readings::Imu(plain.chunks_exact(SAMPLE_BYTES).map(sample).collect()))
        }
        BY_COLUMNS => sample_columns::read(body, count).map(Readings::Imu).map_err(str::to_owned),
        ROWS => sample_columns::read_rows(body, count).map(Readings::Values).map_err(str::to_owned),
        other => Err(format!("expected an encoding from {PLAIN_IN_ZSTD} to {ROWS}, found {other}")),
    }
}

/// One sample from its bytes.
fn sample(bytes: &[u8]) -> ImuSample {
    let mut words = bytes.as_chunks::<8>().0.iter().copied();
    let t_ns = words.next().map_or(0, i64::from_le_bytes);
    let mut next = || words.next().map_or(f64::NAN, f64::from_le_bytes);
    let mut vector = || [next(), next(), next()];
    let (w_ib_b_rad_s, f_b_m_s2, mag_b_ut) = (vector(), vector(), vector());
    let pressure_hpa = next();
    ImuSample {
        t_ns,
        w_ib_b_rad_s,
        f_b_m_s2,
        // Three NaN stand for a missing reading; one alone is a broken axis, and stays what it was.
        mag_b_ut: (!mag_b_ut.iter().all(|value| value.is_nan())).then_some(mag_b_ut),
        pressure_hpa: (!pressure_hpa.is_nan()).then_some(pressure_hpa),
    }
}
