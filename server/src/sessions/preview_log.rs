//! What a log would be read as, before anything of it is kept.

use std::io::Read;

use lodestep_engine::anomaly::Cause as _;
use lodestep_engine::parse::log_format::{LogFormat, Note};
use lodestep_engine::parse::log_survey::{LogSurvey, Survey};
use lodestep_engine::parse::mapping::{Delimiter, Mapping};
use lodestep_engine::parse::remark::LogCause;
use lodestep_engine::parse::{ParseError, ReadOptions, StreamReader};
use lodestep_engine::stream::Kind;
use lodestep_engine::system::StreamRule;
use schemars::JsonSchema;
use serde::Serialize;

use super::unpack::{Unpack, UnpackError, UnpackLimits};
use crate::error::{Place, Problem};

/// Bytes given to the reader at a time.
const PIECE_BYTES: usize = 64 << 10;

/// What was found. Where something is wrong with the log, `problem` says so, and the rest is what was
/// found before that.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "LogPreview")]
pub(crate) struct Preview {
    /// Its format; `None` when it is none that is known.
    format: Option<LogFormat>,
    /// Which of its columns is which channel, where it is a table of another's making.
    mapping: Option<Mapping>,
    /// Which column is which channel by names, units and values, to be checked, where the format is not known.
    suggestion: Option<Mapping>,
    /// What should be known about it.
    notes: Vec<Note>,
    /// What stands between the fields of its table.
    delimiter: Option<Delimiter>,
    /// The columns of its table.
    #[schemars(example = ["t_s", "gyr_x_rad_s"])]
    columns: Vec<String>,
    /// The first rows of its table, as they stand in the file.
    #[schemars(example = [["0.00", "0.001"], ["0.01", "0.002"]])]
    rows: Vec<Vec<String>>,
    /// What the log's own clock shows at its first and last sample, ns.
    clock_ns: Option<[i64; 2]>,
    /// Whether only a part of the log was there to be looked at.
    part: bool,
    /// Whether the field is told in counts, as nobody said how much one is.
    field_in_counts: bool,
    /// What was done to read it, as far as it was looked at, in sentences.
    #[schemars(example = ["line 5002 was left out: expected 7 numbers, found 3"])]
    remarks: Vec<String>,
    /// What its samples are worth.
    survey: Survey,
    /// What is wrong with it.
    #[schemars(example = None::<()>)]
    problem: Option<Problem>,
}

/// Reads the log of a stream of this rule to its end, or what there is of a `part` of one, and keeps nothing.
pub(crate) fn preview(
    source: impl Read,
    rule: &'static StreamRule,
    limits: UnpackLimits,
    reading: ReadOptions,
    part: bool,
) -> Result<Preview, UnpackError> {
    let field_unsaid = reading.field_ut_per_count.is_none();
    // A field in counts is looked at as it is: how large it is says how much a count may be.
    let field_ut_per_count = match rule.kind {
        Kind::Imu => reading.field_ut_per_count.or(Some(1.0)),
        Kind::Values => reading.field_ut_per_count,
    };
    let mut survey = LogSurvey::default();
    let mut reader = match StreamReader::new(rule, ReadOptions { field_ut_per_count, ..reading }) {
        Ok(reader) => reader,
        Err(error) => return Ok(Preview::of_nothing(part, error)),
    };
    let read = read_through(source, limits, part, &mut reader, &mut survey);
    let mut remarks: Vec<String> = reader.anomalies().into_iter().map(|anomaly| anomaly.detail).collect();
    let problem = match read {
        Ok(odd_end) => {
            remarks.extend(odd_end.map(|packing| LogCause::Packing { packing }.sentence()));
            None
        }
        Err(Trouble::Parse(error)) => Some(problem(error)),
        Err(Trouble::Unpack(error)) => return Err(error),
    };
    let recognised = reader.recognised();
    let notes = recognised.map_or_else(Vec::new, |recognised| recognised.notes.clone());
    let table = reader.table();
    Ok(Preview {
        format: match rule.kind {
            Kind::Imu => recognised.map(|recognised| recognised.format),
            Kind::Values => reader.clock_ns().map(|_| LogFormat::Canonical),
        },
        mapping: recognised.and_then(|recognised| recognised.mapping.clone()),
        suggestion: reader.suggested(),
        field_in_counts: field_unsaid && notes.contains(&Note::FieldWithoutUnit),
        notes,
        delimiter: table.as_ref().map(|table| table.delimiter),
        columns: table.as_ref().map_or_else(Vec::new, |table| table.columns.clone()),
        rows: table.map_or_else(Vec::new, |table| table.rows),
        clock_ns: reader.clock_ns().map(|(first, last)| [first, last]),
        part,
        remarks,
        survey: survey.finish(),
        problem,
    })
}

impl Preview {
    /// Of a log that was not looked into: what was said of it is wrong.
    fn of_nothing(part: bool, error: ParseError) -> Preview {
        Preview {
            format: None,
            mapping: None,
            suggestion: None,
            notes: Vec::new(),
            delimiter: None,
            columns: Vec::new(),
            rows: Vec::new(),
            clock_ns: None,
            part,
            field_in_counts: false,
            remarks: Vec::new(),
            survey: LogSurvey::default().finish(),
            problem: Some(problem(error)),
        }
    }
}

enum Trouble {
    Parse(ParseError),
    Unpack(UnpackError),
}

fn read_through(
    source: impl Read,
    limits: UnpackLimits,
    part: bool,
    reader: &mut StreamReader,
    survey: &mut LogSurvey,
) -> Result<Option<&'static str>, Trouble> {
    let mut unpack = match Unpack::new(source, limits) {
        Ok(unpack) => unpack,
        // What is in an archive stands at its end, which is not there.
        Err(UnpackError::Archive { .. }) if part => return Ok(None),
        Err(error) => return Err(Trouble::Unpack(error)),
    };
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let mut readings = reader.none();
        let read = match unpack.read(&mut piece) {
            Ok(read) => read,
            // A part of a packed log ends where it was cut.
            Err(UnpackError::Truncated { .. }) if part => 0,
            Err(error) => return Err(Trouble::Unpack(error)),
        };
        let parsed = match read {
            // The last line of a part is half a line.
            0 if part && (reader.recognised().is_some() || reader.clock_ns().is_some()) => Ok(()),
            0 => reader.finish(&mut readings),
            read => reader.push(&piece[..read], &mut readings),
        };
        readings.iter().for_each(|reading| survey.take(reading));
        parsed.map_err(Trouble::Parse)?;
        if read == 0 {
            // Where a part was cut is known.
            return Ok(unpack.odd_end().filter(|_| !part));
        }
    }
}

fn problem(error: ParseError) -> Problem {
    let place = Place { line: error.line, column: error.column.clone(), ..Place::default() };
    crate::error::Error::invalid_at(error.code(), error.to_string(), place).into_problem()
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use lodestep_engine::systems::catalogue;

    use super::*;

    const LIMITS: UnpackLimits = UnpackLimits { max_unpacked_bytes: 1 << 30, max_ratio: 200 };

    fn foot() -> &'static StreamRule {
        &catalogue::usual().streams[0]
    }

    fn log(rows: usize) -> String {
        let mut text =
            "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n".to_owned();
        for i in 0..rows {
            text += &format!("{},0.001,0.002,{},0.1,0.2,9.7\n", i as f64 * 0.01, i % 7);
        }
        text
    }

    #[test]
    fn a_part_of_a_packed_log_is_looked_at_as_far_as_it_goes() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(log(20_000).as_bytes()).unwrap();
        let packed = encoder.finish().unwrap();
        let half = &packed[..packed.len() / 2];
        let seen = preview(half, foot(), LIMITS, ReadOptions::default(), true).unwrap();
        assert!(seen.problem.is_none() && seen.part);
        assert!(seen.survey.samples > 5_000 && seen.survey.samples < 15_000, "{}", seen.survey.samples);
        assert_eq!((seen.format, seen.survey.rate_hz), (Some(LogFormat::Canonical), Some(100.0)));
        // Of a whole file the same is told.
        let whole = preview(half, foot(), LIMITS, ReadOptions::default(), false).unwrap();
        assert!(whole.problem.is_none() && whole.survey.samples >= seen.survey.samples);
        assert!(whole.remarks.iter().any(|remark| remark.contains("cut off")), "{:?}", whole.remarks);
    }

    #[test]
    fn one_wrong_line_is_left_out_and_told_and_mostly_wrong_ones_are_a_problem() {
        let text = log(5_000) + "50.0,0,0,zero,0,0,9.8\n";
        let seen = preview(text.as_bytes(), foot(), LIMITS, ReadOptions::default(), false).unwrap();
        assert_eq!((seen.survey.samples, seen.columns.len()), (5_000, 7));
        assert!(seen.problem.is_none() && seen.remarks[0].contains("line 5002"), "{:?}", seen.remarks);
        let text = log(1_000) + &"50.0,0,0,zero,0,0,9.8\n".repeat(1_001);
        let seen = preview(text.as_bytes(), foot(), LIMITS, ReadOptions::default(), false).unwrap();
        let problem = seen.problem.unwrap();
        assert_eq!((&*problem.code, problem.place.unwrap().line), ("not_a_number", Some(1_002)));
        assert!(problem.detail.contains("1001 of 2001 lines"), "{}", problem.detail);
    }

    #[test]
    fn an_unknown_table_shows_its_columns() {
        let seen =
            preview(&b"a,b,c,d,e,f,g\n1,2,3,4,5,6,7\n"[..], foot(), LIMITS, ReadOptions::default(), false)
                .unwrap();
        assert_eq!((seen.format, seen.columns.len(), seen.rows.len()), (None, 7, 1));
        assert_eq!(seen.problem.unwrap().code, "unknown_format");
    }

    #[test]
    fn rows_of_numbers_are_looked_at_by_the_columns_of_their_stream() {
        let fixes = &catalogue::named("fixes").unwrap().streams[0];
        let log = "t_s,e_m,n_m,u_m\n0,1,2,3\n1,1,2,3\n2,1,2,3\n";
        let seen = preview(log.as_bytes(), fixes, LIMITS, ReadOptions::default(), false).unwrap();
        assert!(seen.problem.is_none());
        assert_eq!((seen.format, seen.survey.rate_hz), (Some(LogFormat::Canonical), Some(1.0)));
        assert_eq!((seen.columns.len(), seen.rows.len(), seen.clock_ns), (4, 3, Some([0, 2_000_000_000])));
        assert_eq!(seen.survey.first_rows[0], [Some(0.0), Some(1.0), Some(2.0), Some(3.0), None]);
        let said = ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() };
        let wrong = preview(log.as_bytes(), fixes, LIMITS, said, false).unwrap();
        assert_eq!(wrong.problem.unwrap().code, "bad_mapping");
        let foot = preview(log.as_bytes(), foot(), LIMITS, ReadOptions::default(), false).unwrap();
        assert_eq!(foot.problem.unwrap().code, "missing_column");
    }
}
