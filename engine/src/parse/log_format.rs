//! Which format a log is in, by what is in it; its name is never asked.

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::imu_csv;
use crate::parse::mapping::{FieldUnit, Mapping};
use crate::parse::records::not_text;
use crate::parse::suggestion::suggestion;
use crate::parse::table_head::{TableHead, TextHead};
use crate::parse::{apdm, microstrain, shimmer, wit_serial, wit_table, x_io, xsens};

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
        let counts = mapping.mag.as_ref().is_some_and(|mag| mag.unit == FieldUnit::Counts);
        let notes = if counts { vec![Note::FieldWithoutUnit] } else { Vec::new() };
        Recognised { format, mapping: Some(mapping), table: Some(table), notes }
    }
}

/// The formats that are known, for the answer to another one.
const KNOWN: &str = "a log in a known format: the canonical CSV (t_s,gyr_x_rad_s,…), x-io NGIMU or x-IMU3 CSV, MicroStrain SensorConnect CSV, Xsens MT Manager or DOT export, WitMotion text log or serial dump, Shimmer Consensys export, APDM CSV; or a ZIP archive of one sensor's files (Sensor Logger, Phyphox, x-IMU3)";

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
            return Ok(canonical(Some(text.shown(&header))));
        }
        let known = x_io::recognise(&text, &header, rate_hz)
            .or_else(|| microstrain::recognise(&text, &header))
            .or_else(|| xsens::recognise(&text, &header, rate_hz))
            .or_else(|| wit_table::recognise(&text, &header, rate_hz))
            .or_else(|| shimmer::recognise(&text, &header))
            .or_else(|| apdm::recognise(&text, &header));
        if let Some(known) = known {
            return known;
        }
    }
    match text.table() {
        Some(table) => Err(ParseError::new(
            ParseErrorKind::UnknownFormat,
            KNOWN,
            format!("a table with the columns {}", quoted(table.columns.join(", ").as_bytes())),
            match suggestion(&table).and_then(|mapping| serde_json::to_string(&mapping).ok()) {
                Some(mapping) => format!(
                    "say which column is which channel, and in which unit; the names suggest this mapping, to be checked: {mapping}"
                ),
                None => {
                    "say which column is which channel, and in which unit, or export the log in one of these"
                        .to_owned()
                }
            },
        )),
        // Nothing that looks like a table: the canonical reader says what it misses.
        None => Ok(canonical(None)),
    }
}
