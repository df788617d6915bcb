//! One stream's log on its way from a file: unpacked, parsed and handed on piece by piece.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::Result;
use indicatif::ProgressBar;
use lodestep_engine::anomaly::{Anomaly, Cause as _};
use lodestep_engine::parse::log_format::LogFormat;
use lodestep_engine::parse::log_reader::{common_zero_ns, is_of_a_calendar};
use lodestep_engine::parse::remark::LogCause;
use lodestep_engine::parse::{ReadOptions, StreamReader};
use lodestep_engine::stream::Readings;
use lodestep_engine::system::StreamRule;
use lodestep_engine::systems::catalogue;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::feet_clocks::{FeetClocks, Swings};

use crate::cli::failure::Failure;
use crate::sessions::archive;
use crate::sessions::merge_by_time::StreamReadings;
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
        LogFile::open_as(path, ReadOptions::default(), bar)
    }

    /// The same, to be read as this says.
    pub(super) fn open_as(path: &Path, reading: ReadOptions, bar: &ProgressBar) -> Result<LogFile> {
        LogFile::open_of(&catalogue::usual().streams[0], path, reading, bar)
    }

    /// Opens the log of a stream of this rule, to be read as this says, and adds its size to the bar's length.
    pub(super) fn open_of(
        rule: &'static StreamRule,
        path: &Path,
        reading: ReadOptions,
        bar: &ProgressBar,
    ) -> Result<LogFile> {
        let unpack = if path.is_dir() {
            Unpack::of_files(&tables_in(path)?, NO_LIMITS)
        } else {
            let file = open(path)?;
            bar.inc_length(file.metadata().map_or(0, |metadata| metadata.len()));
            Unpack::new(Watched { file, bar: bar.clone() }, NO_LIMITS)
        };
        let unpack = unpack.map_err(|error| Failure::bad_input(path, error))?;
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

    fn anomalies(&self) -> Vec<Anomaly> {
        let mut anomalies = self.reader.anomalies();
        if let Some(packing) = self.unpack.odd_end() {
            let ends_ns = self.reader.clock_ns().map_or([0; 2], |(first, last)| [first, last]);
            anomalies.push(LogCause::Packing { packing }.anomaly(None, ends_ns, 0));
        }
        if let Some(note) = self.unpack.note() {
            let ends_ns = self.reader.clock_ns().map_or([0; 2], |(first, last)| [first, last]);
            anomalies.push(LogCause::Noted { note: note.to_owned() }.anomaly(None, ends_ns, 0));
        }
        anomalies
    }
}

/// The clocks of both feet's logs at the session's start.
#[derive(Clone, Debug, Default)]
pub(super) struct Clocks {
    zero_ns: [Option<i64>; 2],
    /// What is to be told of them.
    pub(super) anomaly: Option<Anomaly>,
}

impl Clocks {
    /// What the clock of this foot's log shows at the session's start, where that has to be said.
    pub(super) fn zero_ns(&self, side: Side) -> Option<i64> {
        self.zero_ns[usize::from(side == Side::Right)]
    }
}

/// Brings the clocks of both feet's logs together, where they are not those of the session: by what they show, or where
/// that cannot be, by the steps of both feet.
pub(super) fn clocks_of_feet(paths: [&Path; 2], reading: &ReadOptions) -> Result<Clocks> {
    /// Swings by which clocks are compared, and the rows in which they are looked for.
    const MOST_ROWS: u64 = 1_000_000;
    /// Canonical logs count from the session's start: such as begin within this of each other do, ns.
    const TOGETHER_NS: u64 = 60_000_000_000;
    let mut first_ns = [0; 2];
    let mut swings = [Swings::default(), Swings::default()];
    // The clock as it is: counted from no zero.
    let as_is = || ReadOptions { clock_zero_ns: Some(0), ..reading.clone() };
    let mut from_start = false;
    for foot in 0..2 {
        let mut log = LogFile::open_as(paths[foot], as_is(), &ProgressBar::hidden())?;
        while log.reader.clock_ns().is_none() && !log.ended {
            log.next_piece()?;
        }
        first_ns[foot] = log.reader.clock_ns().map_or(0, |(first, _)| first);
        let canonical = log.reader.recognised().is_none_or(|r| r.format == LogFormat::Canonical);
        from_start |= canonical && !is_of_a_calendar(first_ns[foot]);
    }
    if from_start && first_ns[0].abs_diff(first_ns[1]) < TOGETHER_NS {
        return Ok(Clocks::default());
    }
    for foot in 0..2 {
        let mut log = LogFile::open_as(paths[foot], as_is(), &ProgressBar::hidden())?;
        let mut rows = 0;
        while !log.ended && !swings[foot].are_enough() && rows < MOST_ROWS {
            let piece = log.next_piece()?;
            rows += piece.len() as u64;
            if let Readings::Imu(samples) = piece {
                samples.iter().for_each(|sample| swings[foot].take(sample));
            }
        }
    }
    match FeetClocks::between(&swings[0], &swings[1]) {
        FeetClocks::Together if from_start => Ok(Clocks::default()),
        FeetClocks::Together => {
            let zero_ns = common_zero_ns(first_ns);
            Ok(Clocks { zero_ns: [zero_ns; 2], anomaly: None })
        }
        FeetClocks::Apart { ahead_by_s, sigma_s } => {
            let ahead_ns = (ahead_by_s * 1e9).round() as i64;
            // What was keyed in counts from where the session's own logs do.
            let earliest_ns = first_ns[0].min(first_ns[1].saturating_sub(ahead_ns));
            let zero_ns = if from_start { 0 } else { earliest_ns };
            let cause = LogCause::ClocksApart { ahead_by_s, sigma_s };
            Ok(Clocks {
                zero_ns: [Some(zero_ns), Some(zero_ns.saturating_add(ahead_ns))],
                anomaly: Some(cause.anomaly(Some(Side::Right.stream()), [0; 2], 0)),
            })
        }
        FeetClocks::Unknown => Err(Failure::bad_input(
            paths[1],
            format!(
                "expected the clock of {}, found one that shows {:.1} s more at the first row, and steps that do not take turns with that foot's at any offset; check that both files are of one walk, set the times of one to the other's clock, or process one foot alone",
                paths[0].display(),
                (first_ns[1].saturating_sub(first_ns[0])) as f64 / 1e9
            ),
        )),
    }
}

/// What the clocks of the logs of inertial sensors show at the session's start, where that has to be said: logs of another
/// maker's clock count from the earliest first sample, so that the sensors stay together.
pub(super) fn shared_zero_ns(paths: &[&Path], reading: &ReadOptions) -> Result<Option<i64>> {
    let mut ends: Option<[i64; 2]> = None;
    for path in paths {
        let mut log = LogFile::open_as(path, reading.clone(), &ProgressBar::hidden())?;
        while log.reader.clock_ns().is_none() && !log.ended {
            log.next_piece()?;
        }
        let canonical = log.reader.recognised().is_none_or(|r| r.format == LogFormat::Canonical);
        let own = |&(first_ns, _): &(i64, i64)| !canonical || is_of_a_calendar(first_ns);
        let Some((first_ns, _)) = log.reader.clock_ns().filter(own) else { return Ok(None) };
        let [least, most] = ends.unwrap_or([first_ns; 2]);
        ends = Some([least.min(first_ns), most.max(first_ns)]);
    }
    Ok(ends.filter(|_| paths.len() > 1).and_then(common_zero_ns))
}

/// The tables in a folder, as a logger writes one for each of its sensors, in the order of their names.
fn tables_in(folder: &Path) -> Result<Vec<(String, Vec<u8>)>> {
    let cannot = |error: io::Error| Failure::bad_input(folder, format!("cannot be read: {error}"));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_file() && archive::is_table(&name) {
            files.push((name, std::fs::read(&path).map_err(cannot)?));
        }
    }
    files.sort();
    Ok(files)
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
