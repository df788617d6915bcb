//! One stream's log on its way from a file: unpacked, parsed and handed on piece by piece.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::Result;
use indicatif::ProgressBar;
use lodestep_engine::parse::log_format::LogFormat;
use lodestep_engine::parse::log_reader::common_zero_ns;
use lodestep_engine::parse::{Reading, StreamReader};
use lodestep_engine::stream::Readings;
use lodestep_engine::system::StreamRule;
use lodestep_engine::systems::catalogue;

use crate::cli::failure::Failure;
use crate::sessions::in_time_order::StreamReadings;
use crate::sessions::unpack::{Unpack, UnpackError, UnpackLimits};

/// Unpacked bytes that are parsed at a time.
const PIECE_BYTES: usize = 64 << 10;

/// A file of one's own may unpack to any size: it is read in pieces and never held.
pub(super) const NO_LIMITS: UnpackLimits = UnpackLimits { max_unpacked_bytes: u64::MAX, max_ratio: u64::MAX };

/// A log that is being read.
pub(super) struct LogFile {
    path: PathBuf,
    unpack: Unpack<Watched>,
    reader: StreamReader,
    buffer: Vec<u8>,
    ended: bool,
}

/// A file whose reading moves a progress bar.
struct Watched {
    file: File,
    bar: ProgressBar,
}

impl Read for Watched {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.file.read(buffer)?;
        self.bar.inc(n as u64);
        Ok(n)
    }
}

impl LogFile {
    /// Opens a log of the usual system that says all of itself, and adds its size to the bar's length.
    pub(super) fn open(path: &Path, bar: &ProgressBar) -> Result<LogFile> {
        LogFile::open_as(path, Reading::default(), bar)
    }

    /// The same, to be read as this says.
    pub(super) fn open_as(path: &Path, reading: Reading, bar: &ProgressBar) -> Result<LogFile> {
        LogFile::open_of(&catalogue::usual().streams[0], path, reading, bar)
    }

    /// Opens the log of a stream of this rule, to be read as this says, and adds its size to the bar's length.
    pub(super) fn open_of(
        rule: &'static StreamRule,
        path: &Path,
        reading: Reading,
        bar: &ProgressBar,
    ) -> Result<LogFile> {
        let file = open(path)?;
        bar.inc_length(file.metadata().map_or(0, |metadata| metadata.len()));
        let unpack = Unpack::new(Watched { file, bar: bar.clone() }, NO_LIMITS)
            .map_err(|error| Failure::bad_input(path, error))?;
        Ok(LogFile {
            path: path.to_owned(),
            unpack,
            reader: StreamReader::new(rule, reading).map_err(|error| Failure::bad_input(path, error))?,
            buffer: vec![0; PIECE_BYTES],
            ended: false,
        })
    }
}

impl StreamReadings for LogFile {
    fn next_piece(&mut self) -> Result<Readings> {
        let mut readings = self.reader.none();
        while readings.is_empty() && !self.ended {
            let n =
                self.unpack.read(&mut self.buffer).map_err(|error| Failure::bad_input(&self.path, error))?;
            let parsed = if n == 0 {
                self.ended = true;
                self.reader.finish(&mut readings)
            } else {
                self.reader.push(&self.buffer[..n], &mut readings)
            };
            parsed.map_err(|error| Failure::bad_input(&self.path, error))?;
        }
        Ok(readings)
    }
}

/// What the clocks of the logs of inertial sensors show at the session's start, where that has to be said: logs of another
/// maker's clock count from the earliest first sample, so that the sensors stay together.
pub(super) fn shared_zero_ns(paths: &[&Path], reading: &Reading) -> Result<Option<i64>> {
    let mut ends: Option<[i64; 2]> = None;
    for path in paths {
        let mut log = LogFile::open_as(path, reading.clone(), &ProgressBar::hidden())?;
        while log.reader.clock_ns().is_none() && !log.ended {
            log.next_piece()?;
        }
        let canonical = log.reader.recognised().is_none_or(|r| r.format == LogFormat::Canonical);
        let Some((first_ns, _)) = log.reader.clock_ns().filter(|_| !canonical) else { return Ok(None) };
        let [least, most] = ends.unwrap_or([first_ns; 2]);
        ends = Some([least.min(first_ns), most.max(first_ns)]);
    }
    Ok(ends.filter(|_| paths.len() > 1).and_then(common_zero_ns))
}

/// Opens an input file, or says why it cannot be.
pub(super) fn open(path: &Path) -> Result<File> {
    let cannot = |error: &dyn std::fmt::Display| Failure::bad_input(path, format!("cannot be read: {error}"));
    let file = File::open(path).map_err(|error| cannot(&error))?;
    if file.metadata().is_ok_and(|metadata| metadata.is_dir()) {
        return Err(cannot(&"it is a folder; name the file in it"));
    }
    Ok(file)
}

/// Reads a small input file whole, unpacked where it is packed.
pub(super) fn read_small(path: &Path) -> Result<Vec<u8>> {
    /// Markers, visits or truth of the longest walk, many times over.
    const MOST_BYTES: u64 = 512 << 20;
    let limits = UnpackLimits { max_unpacked_bytes: MOST_BYTES, max_ratio: u64::MAX };
    let mut unpack = match Unpack::new(open(path)?, limits) {
        Ok(unpack) => unpack,
        // An empty table has its own sentence.
        Err(UnpackError::Empty) => return Ok(Vec::new()),
        Err(error) => return Err(Failure::bad_input(path, error)),
    };
    let mut bytes = Vec::new();
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        match unpack.read(&mut piece).map_err(|error| Failure::bad_input(path, error))? {
            0 => return Ok(bytes),
            n => bytes.extend_from_slice(&piece[..n]),
        }
    }
}

/// The same of a text, such as TOML.
pub(super) fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read_small(path)?)
        .map_err(|_| Failure::bad_input(path, "expected text in UTF-8, found other bytes: save it as UTF-8"))
}
