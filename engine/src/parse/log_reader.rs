//! One foot's log in whatever format it came: recognised by its beginning, read piece by piece.

use serde::{Deserialize, Serialize};

use crate::anomaly::Anomaly;
use crate::parse::encoding::Decoder;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::imu_csv::ImuCsv;
use crate::parse::log_format::{self, LogFormat, Note, Recognised};
use crate::parse::mapped_csv::MappedCsv;
use crate::parse::mapping::{FieldUnit, Mapping};
use crate::parse::suggestion::{by_content, suggestion};
use crate::parse::table_head::{TableHead, TextHead};
use crate::parse::times::Times;
use crate::parse::wit_serial::WitSerial;
use crate::sample::ImuSample;

/// A format is recognised by so many bytes: a page of header and some rows.
const HEAD_BYTES: usize = 32 << 10;

/// What is said of a log that it does not say itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(rename = "LogReading"))]
pub struct ReadOptions {
    /// Which column is which channel; recognised by the content, when it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mapping: Option<Mapping>,
    /// Samples a second, Hz, for a log that does not tell the time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// How much one count of the magnetometer is, µT, for a log that tells it in counts; without it
    /// such a field is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field_ut_per_count: Option<f64>,
    /// What the log's own clock shows at the session's start, ns. When it is left out, a canonical log
    /// counts from the session's start, and any other from its first sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_zero_ns: Option<i64>,
}

impl ReadOptions {
    /// Whether it says nothing.
    pub fn is_empty(&self) -> bool {
        *self == ReadOptions::default()
    }
}

/// A push parser for every format: takes bytes in pieces of any size and gives the samples that they
/// complete.
#[derive(Debug)]
pub struct LogReader {
    reading: ReadOptions,
    head: Vec<u8>,
    recognised: Option<Recognised>,
    decoder: Decoder,
    parser: Option<Parser>,
    /// Its lines end in carriage returns alone, as old programs wrote them.
    ends_in_returns: bool,
    times: Times,
    /// The log is one that counts from the session's start.
    counts_from_start: bool,
    zero_ns: Option<i64>,
    first_ns: Option<i64>,
    last_ns: i64,
    samples: u64,
}

enum Parser {
    Canonical(Box<ImuCsv>),
    Mapped(Box<MappedCsv>),
    WitSerial(Box<WitSerial>),
}

impl std::fmt::Debug for Parser {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Parser::Canonical(_) => "Canonical",
            Parser::Mapped(_) => "Mapped",
            Parser::WitSerial(_) => "WitSerial",
        })
    }
}

impl LogReader {
    /// A reader at the start of a log.
    pub fn new(reading: ReadOptions) -> LogReader {
        LogReader {
            decoder: Decoder::default(),
            times: Times::new(reading.rate_hz),
            reading,
            head: Vec::new(),
            recognised: None,
            parser: None,
            ends_in_returns: false,
            counts_from_start: false,
            zero_ns: None,
            first_ns: None,
            last_ns: 0,
            samples: 0,
        }
    }

    /// Takes some bytes and appends the samples that they complete.
    ///
    /// # Errors
    ///
    /// At the first thing that is wrong; the reader is then of no further use.
    pub fn push(&mut self, bytes: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let mut decoder = std::mem::take(&mut self.decoder);
        let bytes = decoder.push(bytes);
        let pushed = self.push_text(&bytes, samples);
        drop(bytes);
        self.decoder = decoder;
        pushed
    }

    fn push_text(&mut self, bytes: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        if self.parser.is_some() {
            return if self.ends_in_returns {
                self.parse(&with_line_feeds(bytes), samples)
            } else {
                self.parse(bytes, samples)
            };
        }
        let more = bytes.len().min(HEAD_BYTES - self.head.len());
        self.head.extend_from_slice(&bytes[..more]);
        if self.head.len() < HEAD_BYTES {
            return Ok(());
        }
        self.begin(false, samples)?;
        self.push_text(&bytes[more..], samples)
    }

    /// The log is over: appends the last samples and says what is wrong with it as a whole.
    ///
    /// # Errors
    ///
    /// When the log holds no sample, or values that can only be in other units.
    pub fn finish(&mut self, samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let rest = std::mem::take(&mut self.decoder).finish();
        self.push_text(&rest, samples)?;
        if self.parser.is_none() {
            self.begin(true, samples)?;
        }
        let before = samples.len();
        let end = match self.parser.as_mut() {
            Some(Parser::Canonical(parser)) => parser.finish(samples),
            Some(Parser::Mapped(parser)) => parser.finish(samples),
            Some(Parser::WitSerial(parser)) => parser.finish(samples),
            None => Ok(()),
        };
        // What came before the end is placed and counted, whatever the end is.
        let timed = self.times.take(samples, before).and_then(|()| self.times.finish(samples));
        self.place(before, samples);
        end.and(timed)
    }

    /// What was done to read the log, by times of the session's clock; all of it is known at the end.
    pub fn anomalies(&self) -> Vec<Anomaly> {
        let zero_ns = self.zero_ns.unwrap_or_default();
        let ends_ns = [self.first_ns.unwrap_or_default(), self.last_ns];
        let mut anomalies = match &self.parser {
            Some(Parser::Canonical(parser)) => parser.anomalies(ends_ns),
            Some(Parser::Mapped(parser)) => parser.anomalies(ends_ns),
            Some(Parser::WitSerial(_)) | None => Vec::new(),
        };
        anomalies.extend(self.times.anomalies());
        for anomaly in &mut anomalies {
            anomaly.t_start_ns = anomaly.t_start_ns.saturating_sub(zero_ns);
            anomaly.t_end_ns = anomaly.t_end_ns.saturating_sub(zero_ns);
        }
        anomalies
    }

    /// How the log is read, once that is known: after the first 32 KiB, or at its end.
    pub fn recognised(&self) -> Option<&Recognised> {
        self.recognised.as_ref()
    }

    /// What the log's own clock showed at its first and at its last sample, ns.
    pub fn clock_ns(&self) -> Option<(i64, i64)> {
        self.first_ns.map(|first_ns| (first_ns, self.last_ns))
    }

    /// How many samples it has given so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The table that the beginning looks like, in a format that is known or not.
    pub fn table(&self) -> Option<TableHead> {
        match self.recognised.as_ref().and_then(|recognised| recognised.table.clone()) {
            Some(table) => Some(table),
            None => {
                let text = TextHead::read(&self.head, self.head.len() < HEAD_BYTES)?;
                text.table().or_else(|| text.headless().map(|(table, _)| table))
            }
        }
    }

    /// The mapping that a table suggests which nobody knows, to be checked.
    pub fn suggested(&self) -> Option<Mapping> {
        if self.recognised.is_some() {
            return None;
        }
        let text = TextHead::read(&self.head, self.head.len() < HEAD_BYTES)?;
        match text.table() {
            Some(table) => suggestion(&table),
            None => text.headless().and_then(|(table, rows)| by_content(&table, &rows)),
        }
    }

    fn begin(&mut self, whole: bool, samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let ReadOptions { mapping, rate_hz, field_ut_per_count, .. } = &self.reading;
        let (rate_hz, field_ut_per_count) = (*rate_hz, *field_ut_per_count);
        if let Some(error) = impossible(rate_hz, field_ut_per_count) {
            return Err(error);
        }
        // A head of binary packets may hold either byte: only text is turned.
        self.ends_in_returns =
            self.head.contains(&b'\r') && !self.head.iter().any(|byte| matches!(byte, b'\n' | 0));
        if self.ends_in_returns {
            self.head = with_line_feeds(&self.head);
        }
        let recognised = match mapping {
            Some(mapping) => by_mapping(mapping.clone(), &self.head, whole),
            None => log_format::recognise(&self.head, whole, rate_hz)?,
        };
        self.parser = Some(match (recognised.format, recognised.mapping.clone()) {
            (LogFormat::WitSerial, _) => {
                Parser::WitSerial(Box::new(WitSerial::new(rate_hz, field_ut_per_count)))
            }
            (LogFormat::Canonical, Some(mapping)) => Parser::Mapped(Box::new(MappedCsv::canonical(mapping)?)),
            (_, Some(mapping)) => Parser::Mapped(Box::new(MappedCsv::new(mapping, field_ut_per_count)?)),
            (_, None) => Parser::Canonical(Box::default()),
        });
        self.counts_from_start = recognised.format == LogFormat::Canonical;
        if let Some(zero_ns) = self.reading.clock_zero_ns {
            self.zero_ns = Some(zero_ns);
        }
        self.recognised = Some(recognised);
        let head = self.head.clone();
        self.parse(&head, samples)
    }

    fn parse(&mut self, bytes: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let before = samples.len();
        let parsed = match self.parser.as_mut() {
            Some(Parser::Canonical(parser)) => parser.push(bytes, samples),
            Some(Parser::Mapped(parser)) => parser.push(bytes, samples),
            Some(Parser::WitSerial(parser)) => parser.push(bytes, samples),
            None => Ok(()),
        };
        let timed = self.times.take(samples, before);
        self.place(before, samples);
        parsed.and(timed)
    }

    /// Turns the log's own clock into the session's, for the samples from this one on.
    fn place(&mut self, from: usize, samples: &mut [ImuSample]) {
        let new = &mut samples[from..];
        let (Some(first), Some(last)) = (new.first(), new.last()) else { return };
        self.first_ns.get_or_insert(first.t_ns);
        self.last_ns = last.t_ns;
        self.samples += new.len() as u64;
        // Seconds since 1970 are no seconds since the session's start, whatever the column is called.
        let from_start = self.counts_from_start && !is_of_a_calendar(first.t_ns);
        let zero_ns = *self.zero_ns.get_or_insert(if from_start { 0 } else { first.t_ns });
        if zero_ns != 0 {
            for sample in new {
                sample.t_ns = sample.t_ns.saturating_sub(zero_ns);
            }
        }
    }
}

/// The same text with line feeds for its carriage returns.
fn with_line_feeds(text: &[u8]) -> Vec<u8> {
    text.iter().map(|byte| if *byte == b'\r' { b'\n' } else { *byte }).collect()
}

/// Whether a time can only be counted from some year, such as 1970: a session has not been going on for three years.
pub fn is_of_a_calendar(t_ns: i64) -> bool {
    const THREE_YEARS_NS: u64 = 94_672_800_000_000_000;
    t_ns.unsigned_abs() > THREE_YEARS_NS
}

fn by_mapping(mapping: Mapping, head: &[u8], whole: bool) -> Recognised {
    let counts =
        mapping.mag.as_ref().is_some_and(|mag| mag.unit == FieldUnit::Counts && mag.one_is.is_none());
    Recognised {
        format: LogFormat::Mapped,
        mapping: Some(mapping),
        table: TextHead::read(head, whole).and_then(|text| text.table()),
        notes: if counts { vec![Note::FieldWithoutUnit] } else { Vec::new() },
    }
}

fn impossible(rate_hz: Option<f64>, field_ut_per_count: Option<f64>) -> Option<ParseError> {
    let wrong = |expected: &str, found: f64, advice: &str| {
        Some(ParseError::new(ParseErrorKind::BadMapping, expected, found.to_string(), advice))
    };
    match (rate_hz, field_ut_per_count) {
        (Some(rate), _) if !(1.0..=10_000.0).contains(&rate) => wrong(
            "a rate of 1 to 10,000 samples a second",
            rate,
            "give the rate that the sensor was set to, in Hz",
        ),
        (_, Some(ut)) if !(1e-6..=1e6).contains(&ut) => wrong(
            "how much a count of the magnetometer is, in µT",
            ut,
            "give a number such as 0.1, or leave it out",
        ),
        _ => None,
    }
}

/// The clock that both feet's logs have in common, at the session's start: the earlier of the first
/// times, where they are near enough to be of one clock. Otherwise each log counts from its own first
/// sample, and it is not known how far apart the two began.
pub fn common_zero_ns(first_ns: [i64; 2]) -> Option<i64> {
    /// Nobody straps the second sensor on an hour after the first.
    const ONE_CLOCK_NS: u64 = 3_600_000_000_000;
    let [a, b] = first_ns;
    (a.abs_diff(b) <= ONE_CLOCK_NS).then_some(a.min(b))
}

#[cfg(test)]
pub(super) fn samples_of(bytes: &[u8]) -> Result<(Recognised, Vec<ImuSample>), ParseError> {
    let mut reader = LogReader::new(ReadOptions::default());
    let mut samples = Vec::new();
    reader.push(bytes, &mut samples)?;
    reader.finish(&mut samples)?;
    let recognised = reader.recognised().cloned();
    Ok((recognised.expect("a log that was read was recognised"), samples))
}

#[cfg(test)]
#[path = "log_reader_tests.rs"]
mod tests;
