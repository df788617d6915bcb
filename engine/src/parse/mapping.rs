//! Which column of a table is which channel, in which unit: what a format's file finds out by itself,
//! and what people say of a table that nobody knows.

use serde::{Deserialize, Serialize};

use crate::parse::error::{ParseError, ParseErrorKind};

/// The length of one standard gravity, m/s²: what a sensor means by g.
const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
/// Letters in the name of a column.
const MOST_NAME_CHARS: usize = 100;

/// A table of one foot's samples, described.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(rename = "LogMapping"))]
pub struct Mapping {
    /// What stands between two fields.
    #[serde(default)]
    pub delimiter: Delimiter,
    /// When a sample was taken.
    pub time: TimeSource,
    /// The angular rate.
    pub gyr: Axes<RateUnit>,
    /// The specific force, gravity included.
    pub acc: Axes<ForceUnit>,
    /// The magnetic field, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mag: Option<Axes<FieldUnit>>,
    /// The air pressure, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Scalar<PressureUnit>>,
    /// Whether rows without rate or force are left out: tables into which several streams were merged
    /// have them. Otherwise such a row is an error.
    #[serde(default)]
    pub skip_rows_without_inertial: bool,
}

/// What stands between two fields of a row. A table parted by anything but commas may write its
/// decimals with one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", schemars(rename = "LogDelimiter"))]
pub enum Delimiter {
    /// A comma.
    #[default]
    Comma,
    /// A semicolon.
    Semicolon,
    /// A tabulator.
    Tab,
    /// A vertical bar.
    Bar,
    /// Blanks, as many as there are.
    Blanks,
}

impl Delimiter {
    /// All of them, the usual one first.
    pub const ALL: [Delimiter; 5] =
        [Delimiter::Comma, Delimiter::Tab, Delimiter::Semicolon, Delimiter::Bar, Delimiter::Blanks];

    /// The byte.
    pub const fn byte(self) -> u8 {
        match self {
            Delimiter::Comma => b',',
            Delimiter::Semicolon => b';',
            Delimiter::Tab => b'\t',
            Delimiter::Bar => b'|',
            Delimiter::Blanks => b' ',
        }
    }
}

/// When a sample was taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(rename = "LogTimeSource"))]
pub struct TimeSource {
    /// The column; none when the rows only come one after the other, `rate_hz` of them a second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(example = &"time"))]
    pub column: Option<String>,
    /// How that column tells time.
    #[serde(default)]
    pub unit: TimeUnit,
    /// Samples a second, Hz, where the column counts samples or there is none; ticks a second, where it counts ticks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// The value at which the device's counter begins again at 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wraps_at: Option<u64>,
}

/// How a column tells time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", schemars(rename = "LogTimeUnit"))]
pub enum TimeUnit {
    /// Seconds.
    #[default]
    S,
    /// Milliseconds.
    Ms,
    /// Tenths of a millisecond.
    Ticks10Khz,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// A number that grows by one with every sample.
    Samples,
    /// Ticks of a clock, of which `rate_hz` are a second.
    Ticks,
    /// Days, as a spreadsheet keeps dates.
    Days,
    /// A date and time of day, or a time of day.
    DateTime,
}

impl TimeUnit {
    /// Nanoseconds in one; `None` where it takes a rate or a calendar.
    pub(super) const fn ns(self) -> Option<i64> {
        match self {
            TimeUnit::S => Some(1_000_000_000),
            TimeUnit::Ms => Some(1_000_000),
            TimeUnit::Ticks10Khz => Some(100_000),
            TimeUnit::Us => Some(1_000),
            TimeUnit::Ns => Some(1),
            TimeUnit::Days => Some(86_400_000_000_000),
            TimeUnit::Samples | TimeUnit::Ticks | TimeUnit::DateTime => None,
        }
    }
}

/// Three columns of one quantity, in the sensor's own axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(rename = "{U}Axes"))]
pub struct Axes<U> {
    /// The columns of x, y and z.
    #[cfg_attr(feature = "schema", schemars(example = xyz()))]
    pub columns: [String; 3],
    /// Their unit.
    pub unit: U,
    /// How many of the unit a 1 in the columns is, where they are in counts of the sensor or in a share of the unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(example = 0.061))]
    pub one_is: Option<f64>,
}

impl<U: Copy> Axes<U> {
    /// Columns in this unit.
    pub(super) fn of(columns: [String; 3], unit: U) -> Axes<U> {
        Axes { columns, unit, one_is: None }
    }
}

/// What columns may be called; a function, for a derive by itself reads no arrays.
#[cfg(feature = "schema")]
fn xyz() -> [&'static str; 3] {
    ["x", "y", "z"]
}

/// One column of one quantity.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(rename = "{U}Column"))]
pub struct Scalar<U> {
    /// The column.
    #[cfg_attr(feature = "schema", schemars(example = &"pressure"))]
    pub column: String,
    /// Its unit.
    pub unit: U,
}

/// The unit of an angular rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum RateUnit {
    /// Radians a second.
    RadS,
    /// Degrees a second.
    DegS,
    /// Thousandths of a degree a second.
    MdegS,
}

/// The unit of a specific force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ForceUnit {
    /// Metres per second squared.
    MS2,
    /// Standard gravities.
    G,
    /// Thousandths of a standard gravity.
    Mg,
}

/// The unit of a magnetic flux density.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FieldUnit {
    /// Microtesla.
    Ut,
    /// Gauss: 100 µT.
    Gauss,
    /// Milligauss: 0.1 µT.
    Mgauss,
    /// Nanotesla.
    Nt,
    /// Counts, or shares of the field where it was calibrated: left out unless it is said how much one is
    /// (see [`ReadOptions`](crate::parse::log_reader::ReadOptions)).
    Counts,
}

/// The unit of an air pressure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum PressureUnit {
    /// Hectopascal, which is a millibar.
    Hpa,
    /// Pascal.
    Pa,
    /// Kilopascal.
    Kpa,
    /// Millimetres of mercury.
    Mmhg,
}

/// A unit that is a multiple of the engine's own.
pub(super) trait Factor: Copy {
    /// One of it in the engine's unit.
    fn factor(self) -> f64;
}

impl Factor for RateUnit {
    fn factor(self) -> f64 {
        match self {
            RateUnit::RadS => 1.0,
            RateUnit::DegS => std::f64::consts::PI / 180.0,
            RateUnit::MdegS => std::f64::consts::PI / 180_000.0,
        }
    }
}

impl Factor for ForceUnit {
    fn factor(self) -> f64 {
        match self {
            ForceUnit::MS2 => 1.0,
            ForceUnit::G => STANDARD_GRAVITY_M_S2,
            ForceUnit::Mg => 1e-3 * STANDARD_GRAVITY_M_S2,
        }
    }
}

impl Factor for FieldUnit {
    fn factor(self) -> f64 {
        match self {
            FieldUnit::Ut => 1.0,
            FieldUnit::Gauss => 100.0,
            FieldUnit::Mgauss => 0.1,
            FieldUnit::Nt => 1e-3,
            FieldUnit::Counts => 1.0,
        }
    }
}

impl Factor for PressureUnit {
    fn factor(self) -> f64 {
        match self {
            PressureUnit::Hpa => 1.0,
            PressureUnit::Pa => 0.01,
            PressureUnit::Kpa => 10.0,
            PressureUnit::Mmhg => 1.333_223_684,
        }
    }
}

impl Mapping {
    /// The columns that have to be in the header, in the order of the channels.
    pub fn columns(&self) -> Vec<&str> {
        let mut all: Vec<&str> = self.time.column.iter().map(String::as_str).collect();
        all.extend(self.gyr.columns.iter().map(String::as_str));
        all.extend(self.acc.columns.iter().map(String::as_str));
        all.extend(self.mag.iter().flat_map(|axes| &axes.columns).map(String::as_str));
        all.extend(self.pressure.iter().map(|scalar| scalar.column.as_str()));
        all
    }

    /// Whether it says all that is needed, and nothing twice.
    ///
    /// # Errors
    ///
    /// When a column is not named or stands for two channels, or a rate is missing or impossible.
    pub fn check(&self) -> Result<(), ParseError> {
        let wrong = |expected: &str, found: String, advice: &str| {
            Err(ParseError::new(ParseErrorKind::BadMapping, expected, found, advice))
        };
        let columns = self.columns();
        for (i, column) in columns.iter().enumerate() {
            let chars = column.chars().count();
            if column.trim().is_empty() || chars > MOST_NAME_CHARS {
                return wrong(
                    "the name of a column for every channel",
                    format!("a name of {chars} characters"),
                    "choose a column of the table for it",
                );
            }
            if columns[..i].contains(column) {
                return wrong(
                    "every column for one channel only",
                    format!("\"{column}\" for two"),
                    "choose another column for one of the two",
                );
            }
        }
        let scales = [self.gyr.one_is, self.acc.one_is, self.mag.as_ref().and_then(|mag| mag.one_is)];
        if let Some(one_is) =
            scales.into_iter().flatten().find(|one_is| !(1e-9..=1e9).contains(&one_is.abs()))
        {
            return wrong(
                "how many of its unit a 1 in a column is, other than 0",
                format!("{one_is}"),
                "give a number such as 0.061, by the sensor's data sheet, or leave one_is out",
            );
        }
        let ticks = self.time.column.is_some() && self.time.unit == TimeUnit::Ticks;
        let needs_rate = self.time.column.is_none() || self.time.unit == TimeUnit::Samples;
        match self.time.rate_hz {
            None if ticks => wrong(
                "how many ticks of the time's column are a second",
                "nothing".to_owned(),
                "give rate_hz, such as 32768",
            ),
            Some(rate_hz) if ticks && (1.0..=1e10).contains(&rate_hz) => Ok(()),
            Some(rate_hz) if !(1.0..=10_000.0).contains(&rate_hz) => wrong(
                "a rate of 1 to 10,000 samples a second",
                format!("{rate_hz}"),
                "give the rate that the sensor was set to, in Hz",
            ),
            None if needs_rate => wrong(
                "a column with the time, or the rate of the samples",
                "neither".to_owned(),
                "choose the time's column, or give the rate that the sensor was set to, in Hz",
            ),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn example() -> Mapping {
        let axes = |name: &str| ["x", "y", "z"].map(|axis| format!("{name}{axis}"));
        Mapping {
            delimiter: Delimiter::Semicolon,
            time: TimeSource {
                column: Some("t".to_owned()),
                unit: TimeUnit::Ms,
                rate_hz: None,
                wraps_at: None,
            },
            gyr: Axes::of(axes("g"), RateUnit::DegS),
            acc: Axes::of(axes("a"), ForceUnit::G),
            mag: None,
            pressure: None,
            skip_rows_without_inertial: false,
        }
    }

    #[test]
    fn a_mapping_is_kept_as_json() {
        let text = serde_json::to_string(&example()).unwrap();
        assert!(
            text.contains(
                r#""time":{"column":"t","unit":"ms"},"gyr":{"columns":["gx","gy","gz"],"unit":"deg_s"}"#
            ),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<Mapping>(&text).unwrap(), example());
        assert!(serde_json::from_str::<Mapping>(&text.replace("deg_s", "rpm")).is_err());
    }

    #[test]
    fn what_cannot_be_is_said() {
        example().check().unwrap();
        let mut twice = example();
        twice.acc.columns[2] = "gx".to_owned();
        assert!(twice.check().unwrap_err().to_string().contains("\"gx\" for two"));
        let mut unnamed = example();
        unnamed.acc.columns[2] = " ".to_owned();
        assert_eq!(unnamed.check().unwrap_err().code(), "bad_mapping");
        let mut no_rate = example();
        no_rate.time = TimeSource { column: None, unit: TimeUnit::S, rate_hz: None, wraps_at: None };
        assert!(no_rate.check().unwrap_err().advice.contains("in Hz"));
        no_rate.time.rate_hz = Some(32_768.0);
        assert_eq!(no_rate.check().unwrap_err().code(), "bad_mapping");
        let ticks =
            TimeSource { column: Some("t".to_owned()), unit: TimeUnit::Ticks, ..no_rate.time.clone() };
        Mapping { time: ticks, ..example() }.check().unwrap();
        let mut nothing = example();
        nothing.acc.one_is = Some(0.0);
        assert!(nothing.check().unwrap_err().expected.contains("a 1 in a column"));
        no_rate.time.rate_hz = Some(0.0);
        assert_eq!(no_rate.check().unwrap_err().code(), "bad_mapping");
    }

    #[test]
    fn units_are_worth_what_they_are() {
        assert!((RateUnit::DegS.factor() * 180.0 - std::f64::consts::PI).abs() < 1e-15);
        assert_eq!(FieldUnit::Gauss.factor(), 1e3 * FieldUnit::Mgauss.factor());
        assert_eq!(ForceUnit::G.factor(), 1e3 * ForceUnit::Mg.factor());
        assert_eq!(PressureUnit::Kpa.factor(), 1e3 * PressureUnit::Pa.factor());
    }
}
