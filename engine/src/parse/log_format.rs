//! Which format a log is in, by what is in it; its name is never asked.

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::imu_csv;
use crate::parse::mapping::{
    Delimiter, FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit,
};
use crate::parse::records::not_text;
use crate::parse::suggestion::{by_content, counts_for_g, suggestion};
use crate::parse::table_head::{Candidate, TableHead, TextHead};
use crate::parse::{apdm, microstrain, phone_table, shimmer, wit_serial, wit_table, x_io, xsens};

/// The formats of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum LogFormat {
    /// Lodestep's own CSV.
    Canonical,
    /// x-io NGIMU and x-IMU3.
    XIo,
    /// MicroStrain SensorConnect and MIP Monitor.
    MicroStrain,
    /// Xsens (Movella) MT Manager and DOT.
    Xsens,
    /// WitMotion, the serial line as it came.
    WitSerial,
    /// WitMotion's text logs.
    WitTable,
    /// Shimmer, as Consensys exports it.
    Shimmer,
    /// APDM's Opal, and tables that name their channels as its do.
    Apdm,
    /// Applications that log a phone's sensors into one table: `AndroSensor`, `SensorLog`, Physics Toolbox.
    PhoneTable,
    /// A table whose columns somebody mapped.
    Mapped,
}

impl LogFormat {
    /// As tables and messages spell it.
    pub const fn name(self) -> &'static str {
        match self {
            LogFormat::Canonical => "canonical",
            LogFormat::XIo => "x_io",
            LogFormat::MicroStrain => "micro_strain",
            LogFormat::Xsens => "xsens",
            LogFormat::WitSerial => "wit_serial",
            LogFormat::WitTable => "wit_table",
            LogFormat::Shimmer => "shimmer",
            LogFormat::Apdm => "apdm",
            LogFormat::PhoneTable => "phone_table",
            LogFormat::Mapped => "mapped",
        }
    }
}

/// What should be known about a log that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", schemars(rename = "LogNote"))]
pub enum Note {
    /// The magnetic field is in counts: it is left out unless it is said how much one is.
    FieldWithoutUnit,
}

/// A log of which it is known how to read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognised {
    /// Its format.
    pub format: LogFormat,
    /// How its columns are read; `None` where the format has none or fixes them.
    pub mapping: Option<Mapping>,
    /// Its header and first rows; `None` for a binary dump.
    pub table: Option<TableHead>,
    /// What should be known about it.
    pub notes: Vec<Note>,
}

impl Recognised {
    pub(super) fn table(format: LogFormat, mapping: Mapping, table: TableHead) -> Recognised {
        let counts =
            mapping.mag.as_ref().is_some_and(|mag| mag.unit == FieldUnit::Counts && mag.one_is.is_none());
        let notes = if counts { vec![Note::FieldWithoutUnit] } else { Vec::new() };
        Recognised { format, mapping: Some(mapping), table: Some(table), notes }
    }
}

/// The formats that are known, for the answer to another one.
const KNOWN: &str = "a log in a known format: the canonical CSV (t_s,gyr_x_rad_s,…), x-io NGIMU or x-IMU3 CSV, MicroStrain SensorConnect CSV, Xsens MT Manager or DOT export, WitMotion text log or serial dump, Shimmer Consensys export, APDM CSV, AndroSensor, SensorLog or Physics Toolbox CSV; or a ZIP archive of one sensor's files (Sensor Logger, Phyphox, x-IMU3)";

/// Recognises a log by its first bytes; unless they are the `whole` file, more follow.
///
/// # Errors
///
/// When the format is none of the known ones, or a known one that does not say what is needed.
pub(super) fn recognise(head: &[u8], whole: bool, rate_hz: Option<f64>) -> Result<Recognised, ParseError> {
    if wit_serial::recognise(head) {
        return Ok(Recognised {
            format: LogFormat::WitSerial,
            mapping: None,
            table: None,
            notes: vec![Note::FieldWithoutUnit],
        });
    }
    let canonical = |table: Option<TableHead>| Recognised {
        format: LogFormat::Canonical,
        mapping: None,
        table,
        notes: Vec::new(),
    };
    // What is no text has its own sentence in the canonical reader.
    let Some(text) = TextHead::read(head, whole) else { return Ok(canonical(None)) };
    if not_text(&head[..head.len().min(8)], &[]).is_some() {
        return Ok(canonical(None));
    }
    for header in text.candidates() {
        if imu_csv::COLUMNS.iter().filter(|column| header.names.find(column).is_some()).count() >= 2 {
            let mapping = if is_plain(&text, &header) { None } else { canonical_mapping(&header) };
            return Ok(Recognised { mapping, ..canonical(Some(text.shown(&header))) });
        }
        let known = x_io::recognise(&text, &header, rate_hz)
            .or_else(|| microstrain::recognise(&text, &header))
            .or_else(|| xsens::recognise(&text, &header, rate_hz))
            .or_else(|| wit_table::recognise(&text, &header, rate_hz))
            .or_else(|| shimmer::recognise(&text, &header))
            .or_else(|| apdm::recognise(&text, &header))
            .or_else(|| phone_table::recognise(&text, &header));
        if let Some(known) = known {
            return known;
        }
    }
    match text.table() {
        Some(table) => Err(ParseError::new(
            ParseErrorKind::UnknownFormat,
            KNOWN,
            format!("a table with the columns {}", quoted(table.columns.join(", ").as_bytes())),
            match (suggestion(&table).map(|mapping| to_json(&mapping)), counts_for_g(&table)) {
                (Some(mapping), _) => format!(
                    "say which column is which channel, and in which unit; the names suggest this mapping, to be checked: {mapping}"
                ),
                (None, Some(counts)) => format!(
                    "map its columns: the forces look like counts of the sensor, {counts} for g (unit g, one_is {}); say by one_is how many deg/s a count of the rates is, too",
                    1.0 / f64::from(counts)
                ),
                (None, None) => {
                    "say which column is which channel, and in which unit, or export the log in one of these"
                        .to_owned()
                }
            },
        )),
        None => match text.headless() {
            Some((table, rows)) => Err(ParseError::new(
                ParseErrorKind::MissingHeader,
                format!("a header such as \"{}\"", imu_csv::COLUMNS[..7].join(",")),
                format!(
                    "{} columns of numbers without names, which begin {}",
                    table.columns.len(),
                    quoted(table.rows.first().map_or_else(String::new, |row| row.join(", ")).as_bytes())
                ),
                match by_content(&table, &rows).map(|mapping| to_json(&mapping)) {
                    Some(mapping) => format!(
                        "put the names of the columns into the first line, or map the columns by their numbers, from 1; the values suggest this mapping, to be checked: {mapping}"
                    ),
                    None => "put the names of the columns into the first line, or map the columns by their numbers, from 1".to_owned(),
                },
            )
            .at_line(1)),
            // Nothing that looks like a table: the canonical reader says what it misses.
            None => Ok(canonical(None)),
        },
    }
}

fn to_json(mapping: &Mapping) -> String {
    serde_json::to_string(mapping).expect("every key is a string and no field can fail to serialise")
}

/// Whether a canonical header stands as the canonical reader has it: first of all lines, parted by commas, its names to
/// the letter.
fn is_plain(text: &TextHead, header: &Candidate<'_>) -> bool {
    let exact = |column: &&&str| header.names.find(column).is_none() || header.names.all.contains(*column);
    header.delimiter == Delimiter::Comma
        && text.before(header).iter().all(|line| line.trim().is_empty())
        && imu_csv::COLUMNS.iter().all(|column| exact(&column))
}

/// The canonical columns in a table that a spreadsheet has written anew: below other lines, parted otherwise, with decimal
/// commas, in capitals.
fn canonical_mapping(header: &Candidate<'_>) -> Option<Mapping> {
    let names = &header.names;
    let time = names.one(&[("t_s", TimeUnit::S)])?;
    Some(Mapping {
        delimiter: header.delimiter,
        time: TimeSource { column: Some(time.column), unit: time.unit, rate_hz: None, wraps_at: None },
        gyr: names.axes(&[("gyr_{}_rad_s", RateUnit::RadS)])?,
        acc: names.axes(&[("acc_{}_m_s2", ForceUnit::MS2)])?,
        mag: names.axes(&[("mag_{}_ut", FieldUnit::Ut)]),
        pressure: names.one(&[("pressure_hpa", PressureUnit::Hpa)]),
        skip_rows_without_inertial: false,
    })
}
