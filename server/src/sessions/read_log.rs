//! Reads an uploaded log whole, from its bytes as sent to packed chunks, before anything is stored.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use lodestep_engine::anomaly::{Anomaly, Cause as _};
use lodestep_engine::parse::log_format::LogFormat;
use lodestep_engine::parse::remark::LogCause;
use lodestep_engine::parse::{ParseError, ReadOptions, StreamReader};
use lodestep_engine::stream::{Readings, StreamId};
use lodestep_engine::system::StreamRule;
use sha2::{Digest, Sha256};

use super::spill::Spill;
use super::unpack::{Packing, Unpack, UnpackError, UnpackLimits};
use crate::store::StoreError;
use crate::store::raw_chunks::{Packed, Samples};

/// Samples in one chunk: 82 s at 100 Hz, 0.7 MB before packing.
const SAMPLES_A_CHUNK: usize = 8_192;

/// Bytes given to the parser at a time.
const PIECE_BYTES: usize = 64 << 10;

/// A log that was read to its end and found right.
pub(crate) struct ReadLog {
    pub(crate) packing: Packing,
    pub(crate) format: LogFormat,
    pub(crate) samples: u64,
    /// Times of the first and the last sample, ns.
    pub(crate) t_first_ns: i64,
    pub(crate) t_last_ns: i64,
    /// What was done to read it.
    pub(crate) anomalies: Vec<Anomaly>,
    /// Its samples, ready for the store.
    pub(crate) chunks: Spill,
}

/// Why a log was not accepted.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReadLogError {
    #[error(transparent)]
    Unpack(#[from] UnpackError),
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// Not the log's fault.
    #[error("the log's samples cannot be set aside: {0}")]
    Spill(io::Error),
    /// Not the log's fault.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// The SHA-256 of a file's bytes, lower-case hex.
pub(crate) fn sha256(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; PIECE_BYTES];
    loop {
        match file.read(&mut buffer)? {
            0 => break,
            n => hasher.update(&buffer[..n]),
        }
    }
    Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Reads the log of a stream at `path`, by its rule and as `reading` says, setting packed samples aside in `spill_path`.
pub(crate) fn read_log(
    path: &Path,
    spill_path: &Path,
    (stream, rule): (StreamId, &'static StreamRule),
    reading: ReadOptions,
    limits: UnpackLimits,
) -> Result<ReadLog, ReadLogError> {
    let file = File::open(path).map_err(UnpackError::Io)?;
    let mut unpack = Unpack::new(file, limits)?;
    let mut reader = StreamReader::new(rule, reading)?;
    let spill = Spill::create(spill_path).map_err(ReadLogError::Spill)?;
    let mut chunks = Chunks::new(stream, reader.none(), spill);
    match parse(&mut unpack, &mut reader, &mut chunks) {
        // What does not read as a log may be a bomb: that is the more useful thing to say.
        Err(ReadLogError::Parse(error)) => {
            unpack.judge_packing()?;
            return Err(error.into());
        }
        other => other?,
    }
    let mut anomalies = reader.anomalies();
    if let Some(packing) = unpack.odd_end() {
        let ends_ns = [chunks.first_t_ns.unwrap_or_default(), chunks.last_t_ns];
        anomalies.push(LogCause::Packing { packing }.anomaly(None, ends_ns, 0));
    }
    if let Some(note) = unpack.note() {
        let ends_ns = [chunks.first_t_ns.unwrap_or_default(), chunks.last_t_ns];
        anomalies.push(LogCause::Noted { note: note.to_owned() }.anomaly(None, ends_ns, 0));
    }
    let anomalies = anomalies.into_iter().map(|found| Anomaly { stream: Some(stream), ..found }).collect();
    Ok(ReadLog { anomalies, ..chunks.finish(unpack.packing(), reader.format())? })
}

fn parse(
    unpack: &mut Unpack<File>,
    reader: &mut StreamReader,
    chunks: &mut Chunks,
) -> Result<(), ReadLogError> {
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        match unpack.read(&mut piece)? {
            0 => break,
            n => reader.push(&piece[..n], &mut chunks.waiting)?,
        }
        chunks.pack_full()?;
    }
    reader.finish(&mut chunks.waiting)?;
    Ok(())
}

/// Samples on their way into chunks.
struct Chunks {
    stream: StreamId,
    waiting: Readings,
    samples: u64,
    first_t_ns: Option<i64>,
    last_t_ns: i64,
    spill: Spill,
}

impl Chunks {
    fn new(stream: StreamId, waiting: Readings, spill: Spill) -> Chunks {
        Chunks { stream, waiting, samples: 0, first_t_ns: None, last_t_ns: 0, spill }
    }

    /// Packs as many full chunks as there are.
    fn pack_full(&mut self) -> Result<(), ReadLogError> {
        while self.waiting.len() >= SAMPLES_A_CHUNK {
            let later = self.waiting.split_off(SAMPLES_A_CHUNK);
            let full = std::mem::replace(&mut self.waiting, later);
            self.pack(full)?;
        }
        Ok(())
    }

    fn pack(&mut self, readings: Readings) -> Result<(), ReadLogError> {
        let last = readings.len().checked_sub(1).and_then(|last| readings.get(last));
        let (Some(first), Some(last)) = (readings.get(0), last) else { return Ok(()) };
        self.first_t_ns.get_or_insert(first.t_ns());
        self.last_t_ns = last.t_ns();
        self.samples += readings.len() as u64;
        let first_sequence = self.spill.chunks() as u64;
        let packed = Packed::new(&Samples { stream: self.stream, first_sequence, sequences: 1, readings })?;
        self.spill.push(packed).map_err(ReadLogError::Spill)
    }

    fn finish(mut self, packing: Packing, format: LogFormat) -> Result<ReadLog, ReadLogError> {
        self.pack_full()?;
        let rest = self.waiting.split_off(0);
        self.pack(rest)?;
        Ok(ReadLog {
            packing,
            format,
            samples: self.samples,
            t_first_ns: self.first_t_ns.unwrap_or_default(),
            t_last_ns: self.last_t_ns,
            anomalies: Vec::new(),
            chunks: self.spill,
        })
    }
}
