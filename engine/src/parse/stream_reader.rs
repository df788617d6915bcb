//! The log of any stream, read by the kind of its readings.

use crate::anomaly::Anomaly;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::log_reader::{LogReader, ReadOptions};
use crate::parse::mapping::Mapping;
use crate::parse::remark::LogCause;
use crate::parse::table_head::{TableHead, TextHead};
use crate::parse::values_csv::ValuesCsv;
use crate::parse::{gnss_columns, navigation_rows, observation_rows, range_rows};
use crate::stream::{Kind, Readings, Rows};
use crate::system::{Column, StreamRule};

/// A push parser for the log of a stream: takes bytes in pieces of any size and gives the readings that they complete.
#[derive(Debug)]
pub enum StreamReader {
    /// Of an inertial sensor, in any format that is known.
    Imu(Box<LogReader>),
    /// Rows of numbers, in the columns that the system declares.
    Values(Box<ValuesReader>),
}

/// Reads rows of numbers and puts them on the session's clock.
#[derive(Debug)]
pub struct ValuesReader {
    parser: RowsParser,
    columns: usize,
    zero_ns: i64,
    clock_ns: Option<(i64, i64)>,
    head: Vec<u8>,
    notes: Vec<String>,
}

#[derive(Debug)]
enum RowsParser {
    /// A table of the declared columns.
    Table(Box<ValuesCsv>),
    /// A form of its own, which is kept until the log is over.
    Whole(Vec<u8>, ReadWhole),
}

/// Reads a whole log: its rows, and what was passed over or put right, a sentence each.
type ReadWhole = fn(&[u8]) -> Result<(Rows, Vec<String>), ParseError>;

/// Whether columns are those of a form.
type IsForm = fn(&[Column]) -> bool;

/// How the log of a stream of these columns is read, where it is no table of them.
fn whole(columns: &[Column]) -> Option<ReadWhole> {
    let forms: [(IsForm, ReadWhole); 4] = [
        (gnss_columns::are_of, |bytes| gnss_columns::read(bytes).map(|rows| (rows, Vec::new()))),
        (observation_rows::are_of, observation_rows::read),
        (navigation_rows::are_of, navigation_rows::read),
        (range_rows::are_of, range_rows::read),
    ];
    forms.into_iter().find(|(are_of, _)| are_of(columns)).map(|(_, read)| read)
}

/// The beginning of a table that is kept to be shown.
const HEAD_BYTES: usize = 32 << 10;

impl StreamReader {
    /// A reader at the start of the log of a stream of this rule.
    ///
    /// # Errors
    ///
    /// When something is said of rows of numbers that can only be said of an inertial sensor's log.
    pub fn new(rule: &'static StreamRule, reading: ReadOptions) -> Result<StreamReader, ParseError> {
        Ok(match rule.kind {
            Kind::Imu => StreamReader::Imu(Box::new(LogReader::new(reading))),
            Kind::Values => StreamReader::Values(Box::new(ValuesReader::new(rule, &reading)?)),
        })
    }

    /// No readings yet, of the kind that this reader gives.
    pub fn none(&self) -> Readings {
        match self {
            StreamReader::Imu(_) => Readings::Imu(Vec::new()),
            StreamReader::Values(values) => Readings::Values(Rows::new(values.columns)),
        }
    }

    /// Takes some bytes and appends the readings that they complete to `readings`, which began as [`Self::none`].
    ///
    /// # Errors
    ///
    /// At the first thing that is wrong; the reader is then of no further use.
    pub fn push(&mut self, bytes: &[u8], readings: &mut Readings) -> Result<(), ParseError> {
        match (self, readings) {
            (StreamReader::Imu(reader), Readings::Imu(samples)) => reader.push(bytes, samples),
            (StreamReader::Values(reader), Readings::Values(rows)) => reader.push(bytes, rows),
            _ => Err(other_kind()),
        }
    }

    /// The log is over: appends the last readings and says what is wrong with it as a whole.
    ///
    /// # Errors
    ///
    /// When the log holds no reading, or values that can only be in other units.
    pub fn finish(&mut self, readings: &mut Readings) -> Result<(), ParseError> {
        match (self, readings) {
            (StreamReader::Imu(reader), Readings::Imu(samples)) => reader.finish(samples),
            (StreamReader::Values(reader), Readings::Values(rows)) => reader.finish(rows),
            _ => Err(other_kind()),
        }
    }

    /// What was done to read the log, by times of the session's clock; all of it is known at the end.
    pub fn anomalies(&self) -> Vec<Anomaly> {
        match self {
            StreamReader::Imu(reader) => reader.anomalies(),
            StreamReader::Values(reader) => reader.anomalies(),
        }
    }

    /// What the log's own clock showed at its first and at its last reading, ns.
    pub fn clock_ns(&self) -> Option<(i64, i64)> {
        match self {
            StreamReader::Imu(reader) => reader.clock_ns(),
            StreamReader::Values(reader) => reader.clock_ns,
        }
    }

    /// How the log of an inertial sensor is read, once that is known.
    pub fn recognised(&self) -> Option<&Recognised> {
        match self {
            StreamReader::Imu(reader) => reader.recognised(),
            StreamReader::Values(_) => None,
        }
    }

    /// The table that the beginning of the log looks like.
    pub fn table(&self) -> Option<TableHead> {
        match self {
            StreamReader::Imu(reader) => reader.table(),
            StreamReader::Values(reader) => {
                /// A time and a number.
                const FEWEST_COLUMNS: usize = 2;
                TextHead::read(&reader.head, reader.head.len() < HEAD_BYTES)?.table_of(FEWEST_COLUMNS)
            }
        }
    }

    /// The mapping that a table of an inertial sensor suggests which nobody knows, to be checked.
    pub fn suggested(&self) -> Option<Mapping> {
        match self {
            StreamReader::Imu(reader) => reader.suggested(),
            StreamReader::Values(_) => None,
        }
    }

    /// The format that the log was found to be in; the canonical one as long as that is not known.
    pub fn format(&self) -> LogFormat {
        match self {
            StreamReader::Imu(reader) => {
                reader.recognised().map_or(LogFormat::Canonical, |recognised| recognised.format)
            }
            StreamReader::Values(_) => LogFormat::Canonical,
        }
    }
}

impl ValuesReader {
    fn new(rule: &'static StreamRule, reading: &ReadOptions) -> Result<ValuesReader, ParseError> {
        let ReadOptions { mapping, rate_hz, field_ut_per_count, clock_zero_ns } = reading;
        let said = [
            (mapping.is_some(), "a mapping"),
            (rate_hz.is_some(), "rate_hz"),
            (field_ut_per_count.is_some(), "field_ut_per_count"),
        ];
        if let Some((_, what)) = said.into_iter().find(|(said, _)| *said) {
            return Err(ParseError::new(
                ParseErrorKind::BadMapping,
                format!(
                    "rows in the columns of the stream {} and nothing said of them but clock_zero_ns",
                    rule.name
                ),
                what,
                "leave it out: it is for the log of an inertial sensor",
            ));
        }
        Ok(ValuesReader {
            parser: match whole(rule.columns) {
                Some(read) => RowsParser::Whole(Vec::new(), read),
                None => RowsParser::Table(Box::new(ValuesCsv::new(rule.columns))),
            },
            columns: rule.columns.len(),
            zero_ns: clock_zero_ns.unwrap_or(0),
            clock_ns: None,
            head: Vec::new(),
            notes: Vec::new(),
        })
    }

    fn anomalies(&self) -> Vec<Anomaly> {
        let (first_ns, last_ns) = self.clock_ns.unwrap_or_default();
        let at_ns = [first_ns, last_ns].map(|t_ns| t_ns.saturating_sub(self.zero_ns));
        self.notes.iter().map(|note| LogCause::Noted { note: note.clone() }.at(at_ns, 0)).collect()
    }

    fn push(&mut self, bytes: &[u8], rows: &mut Rows) -> Result<(), ParseError> {
        let more = bytes.len().min(HEAD_BYTES - self.head.len());
        self.head.extend_from_slice(&bytes[..more]);
        let mut new = Rows::new(self.columns);
        let parsed = match &mut self.parser {
            RowsParser::Table(table) => table.push(bytes, &mut new),
            RowsParser::Whole(kept, _) => {
                kept.extend_from_slice(bytes);
                Ok(())
            }
        };
        self.place(&new, rows);
        parsed
    }

    fn finish(&mut self, rows: &mut Rows) -> Result<(), ParseError> {
        let mut new = Rows::new(self.columns);
        let end = match &mut self.parser {
            RowsParser::Table(table) => table.finish(&mut new),
            RowsParser::Whole(kept, read) => read(kept).map(|(rows, notes)| {
                new = rows;
                self.notes = notes;
            }),
        };
        self.place(&new, rows);
        end
    }

    /// Turns the log's own clock into the session's.
    fn place(&mut self, new: &Rows, rows: &mut Rows) {
        for (t_ns, values) in new.iter() {
            self.clock_ns = Some((self.clock_ns.map_or(t_ns, |(first_ns, _)| first_ns), t_ns));
            rows.push(t_ns.saturating_sub(self.zero_ns), values.iter().copied());
        }
    }
}

fn other_kind() -> ParseError {
    ParseError::new(
        ParseErrorKind::UnknownFormat,
        "readings of the kind that the stream has",
        "those of another kind",
        "read the log of each stream into readings of its own",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::Column;

    const RULE: StreamRule = StreamRule {
        role: "positions",
        name: "fix",
        title: "",
        kind: Kind::Values,
        columns: &[
            Column { name: "e_m", required: true, about: "" },
            Column { name: "n_m", required: true, about: "" },
            Column { name: "u_m", required: true, about: "" },
        ],
        least: 1,
        most: 1,
    };
    const POSITIONS: &StreamRule = &RULE;
    const SENSOR: &StreamRule = &StreamRule { kind: Kind::Imu, columns: &[], ..RULE };

    fn read(reading: ReadOptions, text: &str) -> Result<Readings, ParseError> {
        let mut reader = StreamReader::new(POSITIONS, reading)?;
        let mut readings = reader.none();
        reader.push(text.as_bytes(), &mut readings)?;
        reader.finish(&mut readings)?;
        Ok(readings)
    }

    #[test]
    fn rows_are_put_on_the_session_s_clock() {
        let text = "t_s,e_m,n_m,u_m\n100,1,2,3\n101.5,4,5,6\n";
        let times = |reading| {
            let readings = read(reading, text).unwrap();
            readings.iter().map(|reading| reading.t_ns()).collect::<Vec<_>>()
        };
        assert_eq!(times(ReadOptions::default()), [100_000_000_000, 101_500_000_000]);
        let said = ReadOptions { clock_zero_ns: Some(100_000_000_000), ..ReadOptions::default() };
        assert_eq!(times(said), [0, 1_500_000_000]);
    }

    #[test]
    fn what_is_said_of_an_inertial_sensor_is_refused_of_rows() {
        let said = ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() };
        let error = read(said.clone(), "").unwrap_err();
        assert_eq!(error.code(), "bad_mapping");
        assert!(error.to_string().contains("rate_hz"), "{error}");
        assert!(StreamReader::new(SENSOR, said).is_ok());
    }

    #[test]
    fn the_log_of_an_inertial_sensor_is_no_log_of_positions_and_the_other_way_round() {
        let imu =
            "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n0,0,0,0,0,0,9.8\n";
        let error = read(ReadOptions::default(), imu).unwrap_err();
        assert_eq!((error.code(), error.column.as_deref()), ("missing_column", Some("e_m")));
        let mut reader = StreamReader::new(SENSOR, ReadOptions::default()).unwrap();
        let mut readings = reader.none();
        reader.push(b"t_s,e_m,n_m,u_m\n0,1,2,3\n", &mut readings).unwrap();
        let error = reader.finish(&mut readings).unwrap_err();
        assert_eq!((error.code(), error.column.as_deref()), ("missing_column", Some("gyr_x_rad_s")));
        assert_eq!(readings, Readings::Imu(Vec::new()));
        let mut rows = Readings::Values(Rows::new(3));
        assert_eq!(reader.push(b"0", &mut rows).unwrap_err().code(), "unknown_format");
    }
}
