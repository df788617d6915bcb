//! The log of any stream, read by the kind of its readings.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::log_format::LogFormat;
use crate::parse::log_reader::{LogReader, Reading};
use crate::parse::values_csv::ValuesCsv;
use crate::stream::{Kind, Readings, Rows};
use crate::system::StreamRule;

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
    parser: ValuesCsv,
    columns: usize,
    zero_ns: i64,
}

impl StreamReader {
    /// A reader at the start of the log of a stream of this rule.
    ///
    /// # Errors
    ///
    /// When something is said of rows of numbers that can only be said of an inertial sensor's log.
    pub fn new(rule: &'static StreamRule, reading: Reading) -> Result<StreamReader, ParseError> {
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

    /// Takes some bytes and gives the readings that they complete.
    ///
    /// # Errors
    ///
    /// At the first thing that is wrong; the reader is then of no further use.
    pub fn push(&mut self, bytes: &[u8]) -> Result<Readings, ParseError> {
        match self {
            StreamReader::Imu(reader) => {
                let mut samples = Vec::new();
                reader.push(bytes, &mut samples)?;
                Ok(Readings::Imu(samples))
            }
            StreamReader::Values(values) => {
                let mut rows = Rows::new(values.columns);
                values.parser.push(bytes, &mut rows)?;
                Ok(Readings::Values(values.placed(rows)))
            }
        }
    }

    /// The log is over: gives the last readings and says what is wrong with it as a whole.
    ///
    /// # Errors
    ///
    /// When the log holds no reading, or values that can only be in other units.
    pub fn finish(&mut self) -> Result<Readings, ParseError> {
        match self {
            StreamReader::Imu(reader) => {
                let mut samples = Vec::new();
                reader.finish(&mut samples)?;
                Ok(Readings::Imu(samples))
            }
            StreamReader::Values(values) => {
                let mut rows = Rows::new(values.columns);
                values.parser.finish(&mut rows)?;
                Ok(Readings::Values(values.placed(rows)))
            }
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
    fn new(rule: &'static StreamRule, reading: &Reading) -> Result<ValuesReader, ParseError> {
        let Reading { mapping, rate_hz, field_ut_per_count, clock_zero_ns } = reading;
        let said = [
            (mapping.is_some(), "a mapping"),
            (rate_hz.is_some(), "rate_hz"),
            (field_ut_per_count.is_some(), "field_ut_per_count"),
        ];
        if let Some((_, what)) = said.into_iter().find(|(said, _)| *said) {
            return Err(ParseError::new(
                ParseErrorKind::BadMapping,
                format!("rows in the columns of the stream {} and nothing said of them but clock_zero_ns", rule.name),
                what,
                "leave it out: it is for the log of an inertial sensor",
            ));
        }
        let columns = rule.columns.len();
        Ok(ValuesReader { parser: ValuesCsv::new(rule.columns), columns, zero_ns: clock_zero_ns.unwrap_or(0) })
    }

    /// Turns the log's own clock into the session's.
    fn placed(&self, rows: Rows) -> Rows {
        if self.zero_ns == 0 {
            return rows;
        }
        let mut placed = Rows::new(self.columns);
        for (t_ns, values) in rows.iter() {
            placed.push(t_ns.saturating_sub(self.zero_ns), values.iter().copied());
        }
        placed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::{fixes, pedestrian};

    fn read(reading: Reading, text: &str) -> Result<Readings, ParseError> {
        let mut reader = StreamReader::new(&fixes::DECLARATION.streams[0], reading)?;
        let mut readings = reader.none();
        readings.append(reader.push(text.as_bytes())?);
        readings.append(reader.finish()?);
        Ok(readings)
    }

    #[test]
    fn rows_are_put_on_the_session_s_clock() {
        let text = "t_s,e_m,n_m,u_m\n100,1,2,3\n101.5,4,5,6\n";
        let times = |reading| {
            let readings = read(reading, text).unwrap();
            readings.iter().map(|reading| reading.t_ns()).collect::<Vec<_>>()
        };
        assert_eq!(times(Reading::default()), [100_000_000_000, 101_500_000_000]);
        let said = Reading { clock_zero_ns: Some(100_000_000_000), ..Reading::default() };
        assert_eq!(times(said), [0, 1_500_000_000]);
    }

    #[test]
    fn what_is_said_of_an_inertial_sensor_is_refused_of_rows() {
        let said = Reading { rate_hz: Some(100.0), ..Reading::default() };
        let error = read(said.clone(), "").unwrap_err();
        assert_eq!(error.code(), "bad_mapping");
        assert!(error.to_string().contains("rate_hz"), "{error}");
        assert!(StreamReader::new(&pedestrian::DECLARATION.streams[0], said).is_ok());
    }

    #[test]
    fn the_log_of_an_inertial_sensor_is_no_log_of_positions_and_the_other_way_round() {
        let imu = "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n0,0,0,0,0,0,9.8\n";
        let error = read(Reading::default(), imu).unwrap_err();
        assert_eq!((error.code(), error.column.as_deref()), ("missing_column", Some("e_m")));
        let mut reader = StreamReader::new(&pedestrian::DECLARATION.streams[0], Reading::default()).unwrap();
        reader.push(b"t_s,e_m,n_m,u_m\n0,1,2,3\n").unwrap();
        let error = reader.finish().unwrap_err();
        assert_eq!((error.code(), error.column.as_deref()), ("missing_column", Some("gyr_x_rad_s")));
        assert_eq!(reader.none(), Readings::Imu(Vec::new()));
    }
}
