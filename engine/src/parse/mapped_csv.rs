//! A table of samples whose columns a [`Mapping`] describes: one row a sample, whatever stands before
//! the header.

use std::borrow::Cow;

use crate::anomaly::Anomaly;
use crate::parse::clock_text::{self, DAY_NS};
use crate::parse::encoding::legacy;
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::left_out::{self, Decimals, LeftOut};
use crate::parse::lines::{Line, Lines};
use crate::parse::mapping::{Axes, Delimiter, Factor, FieldUnit, Mapping, TimeUnit};
use crate::parse::number::{bad_number, is_missing, number, seconds_to_ns};
use crate::parse::records::{Record, not_text};
use crate::parse::units_check::{Said, UnitsCheck};
use crate::sample::ImuSample;

/// The header stands within so many lines.
const HEADER_WITHIN: u64 = 500;
const BOM: &[u8] = b"\xEF\xBB\xBF";

/// A push parser: takes bytes in pieces of any size and gives the samples that they complete. Times
/// are those of the file's own clock.
pub(super) struct MappedCsv {
    lines: Lines,
    rows: Rows,
}

struct Rows {
    mapping: Mapping,
    /// What the field is multiplied by besides its unit; `None` leaves it out.
    field_factor: Option<f64>,
    places: Option<Places>,
    fields: usize,
    first: Option<String>,
    clock: Clock,
    units: UnitsCheck,
    rows: u64,
    samples: u64,
    left_out: LeftOut,
    decimals: Decimals,
    /// The names have stood in the table again: a row of their units may follow.
    units_row_follows: bool,
}

/// Where the channels stand in a row.
struct Places {
    time: Option<usize>,
    gyr: [usize; 3],
    acc: [usize; 3],
    mag: Option<[usize; 3]>,
    pressure: Option<usize>,
}

/// What the time column has come to.
#[derive(Default)]
struct Clock {
    last_ticks: i64,
    wrapped_ticks: i64,
    last_day_ns: i64,
    days_ns: i64,
}

impl MappedCsv {
    /// A parser at the start of a file.
    ///
    /// # Errors
    ///
    /// When the mapping does not hold together.
    pub(super) fn new(mapping: Mapping, field_ut_per_count: Option<f64>) -> Result<MappedCsv, ParseError> {
        MappedCsv::of(mapping, field_ut_per_count, false)
    }

    /// The same for the canonical log, which a spreadsheet has written anew.
    pub(super) fn canonical(mapping: Mapping) -> Result<MappedCsv, ParseError> {
        MappedCsv::of(mapping, None, true)
    }

    fn of(
        mapping: Mapping,
        field_ut_per_count: Option<f64>,
        canonical: bool,
    ) -> Result<MappedCsv, ParseError> {
        mapping.check()?;
        let field_factor = match &mapping.mag {
            // What a 1 is may stand in the mapping itself.
            Some(Axes { unit: FieldUnit::Counts, one_is, .. }) => {
                field_ut_per_count.or_else(|| one_is.map(|_| 1.0))
            }
            _ => Some(1.0),
        };
        let said = Said::by(&mapping, canonical);
        Ok(MappedCsv {
            lines: Lines::parted_by(mapping.delimiter.byte()),
            rows: Rows {
                mapping,
                field_factor,
                places: None,
                fields: 0,
                first: None,
                clock: Clock::default(),
                units: UnitsCheck::new(said),
                rows: 0,
                samples: 0,
                left_out: LeftOut::default(),
                decimals: Decimals::default(),
                units_row_follows: false,
            },
        })
    }

    pub(super) fn push(&mut self, bytes: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let MappedCsv { lines, rows } = self;
        lines.push(bytes, |line| rows.take(line, samples))
    }

    pub(super) fn finish(&mut self, samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let MappedCsv { lines, rows } = self;
        lines.finish(|line| rows.take(line, samples))?;
        if let Some(error) = not_text(lines.head(), &[]) {
            return Err(error);
        }
        rows.left_out.finish()?;
        if rows.places.is_none() {
            return Err(rows.no_header());
        }
        if rows.samples == 0 {
            return Err(ParseError::new(
                ParseErrorKind::EmptyFile,
                "a row for every sample below the header",
                if rows.rows == 0 { "no row" } else { "no row with an angular rate and a specific force" },
                "check that the recorder wrote the log, and export it again",
            ));
        }
        rows.units.finish()
    }

    /// Lines and bytes that were left out, within these times of the log's clock.
    pub(super) fn anomalies(&self, t_ns: [i64; 2]) -> Vec<Anomaly> {
        self.rows.left_out.anomalies(self.lines.filling_bytes(), t_ns)
    }
}

impl Rows {
    fn take(&mut self, line: &Line<'_>, out: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let record = match line {
            Line::Record(record) => record,
            Line::TooLong(_) if self.places.is_none() => return Ok(()),
            Line::TooLong(line) => return self.left_out.line(left_out::too_long(*line)),
        };
        if self.places.is_none() {
            return self.look_for_header(record, out);
        }
        // A row of units stands between the names and the numbers, and a table may begin again with its names.
        if !self.is_of_words(record) {
            return self.take_row(record, out);
        }
        if self.begins_again(record) {
            self.left_out.header();
        } else if self.left_out.has_rows() && !self.units_row_follows {
            return self.take_row(record, out);
        }
        self.units_row_follows = self.left_out.has_rows() && !self.units_row_follows;
        Ok(())
    }

    /// Whether the names of the mapping stand in a row again, perhaps in another order, which holds from here on.
    fn begins_again(&mut self, record: &Record<'_>) -> bool {
        if !self.left_out.has_rows() {
            return false;
        }
        let names: Vec<String> = record.fields().map(|field| name_of(field).into_owned()).collect();
        let Some(places) = Places::find(&names, &self.mapping) else { return false };
        self.fields = 1 + places.all().max().unwrap_or(0);
        self.places = Some(places);
        true
    }

    /// Whether no channel of a row is a number, and none says that there is no value.
    fn is_of_words(&self, record: &Record<'_>) -> bool {
        let Some(places) = &self.places else { return false };
        // All but a few rows are told by their first channel.
        if record.len() < self.fields || record.field(places.gyr[0]).first().is_some_and(u8::is_ascii_digit) {
            return false;
        }
        let row = Row { record, decimal_comma: true };
        let mut channels = places.gyr.iter().chain(&places.acc);
        channels.all(|&at| number(&row.text(at)).is_none() && !is_missing(record.field(at)))
    }

    fn take_row(&mut self, record: &Record<'_>, out: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        self.units_row_follows = false;
        let sample = match self.sample(record) {
            Ok(Some(sample)) => sample,
            Ok(None) => return Ok(()),
            Err(error) => return self.left_out.line(error),
        };
        if self.decimals.cut(record.field(record.len() - 1), record.ended) {
            return self.left_out.line(left_out::cut(record.line));
        }
        self.units.take(&sample)?;
        self.samples += 1;
        self.left_out.row();
        out.push(sample);
        Ok(())
    }

    /// A row as a sample; `None` where it has no rate or no force.
    fn sample(&mut self, record: &Record<'_>) -> Result<Option<ImuSample>, ParseError> {
        let Some(places) = &self.places else { return Ok(None) };
        self.rows += 1;
        let needed = self.fields;
        if record.len() < needed {
            let whole: Vec<&[u8]> = record.fields().collect();
            return Err(ParseError::new(
                ParseErrorKind::WrongFieldCount,
                format!("at least {needed} fields, as in the header"),
                format!("{} in {}", record.len(), quoted(&whole.join(&self.mapping.delimiter.byte()))),
                "complete the line, or delete it if the recorder was switched off while it wrote",
            )
            .at_line(record.line));
        }
        let decimal_comma = self.mapping.delimiter != Delimiter::Comma;
        let row = Row { record, decimal_comma };
        let mut inertial = places.gyr.iter().chain(&places.acc);
        if inertial.clone().all(|&at| row.missing(at)) {
            // A row for a packet that was lost; where several streams were merged, one of another stream.
            if !self.mapping.skip_rows_without_inertial {
                self.left_out.empty_row();
            }
            return Ok(None);
        }
        if self.mapping.skip_rows_without_inertial && inertial.any(|&at| row.missing(at)) {
            return Ok(None);
        }
        let w_ib_b_rad_s = row.axes(places.gyr, &self.mapping.gyr)?;
        let f_b_m_s2 = row.axes(places.acc, &self.mapping.acc)?;
        let mut odd = None;
        let mag_b_ut = match (places.mag, &self.mapping.mag, self.field_factor) {
            (Some(at), Some(axes), Some(factor)) if !at.iter().any(|&i| row.missing(i)) => {
                let field = row.axes(at, axes).map_err(|error| odd = Some(error)).ok();
                field.map(|field| field.map(|value| value * factor))
            }
            _ => None,
        };
        let pressure_hpa = match (places.pressure, &self.mapping.pressure) {
            (Some(at), Some(scalar)) if !row.missing(at) => {
                let pressure = row.number(at, &scalar.column).map_err(|error| odd = Some(error)).ok();
                pressure.map(|pressure| pressure * scalar.unit.factor())
            }
            _ => None,
        };
        if let Some(odd) = odd {
            self.left_out.value(odd);
        }
        let t_ns = self.clock.tell(&row, places.time, &self.mapping, self.rows - 1)?;
        Ok(Some(ImuSample {
            t_ns,
            w_ib_b_rad_s,
            f_b_m_s2,
            mag_b_ut: mag_b_ut.filter(|mag| mag.iter().all(|value| !value.is_nan())),
            pressure_hpa: pressure_hpa.filter(|value| !value.is_nan()),
        }))
    }

    /// Takes a line for the header when all the columns are in it.
    fn look_for_header(&mut self, record: &Record<'_>, out: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let names: Vec<String> = record.fields().map(|field| name_of(field).into_owned()).collect();
        if let Some(places) = Places::by_number(record, &self.mapping) {
            self.fields = 1 + places.all().max().unwrap_or(0);
            self.places = Some(places);
            return self.take_row(record, out);
        }
        if self.first.is_none() {
            let line: String = names.join(", ").chars().take(160).collect();
            self.first = Some(line);
        }
        if record.line > HEADER_WITHIN {
            return Err(self.no_header());
        }
        let Some(places) = Places::find(&names, &self.mapping) else { return Ok(()) };
        if let Some(column) = self.mapping.columns().into_iter().find(|c| {
            let clean = c.trim();
            names.iter().filter(|name| name.as_str() == clean).count() > 1
        }) {
            return Err(ParseError::new(
                ParseErrorKind::RepeatedColumn,
                "every column once",
                format!("\"{column}\" more than once in the header"),
                "remove or rename one of the two",
            )
            .at_line(record.line)
            .in_column(column));
        }
        self.fields = 1 + places.all().max().unwrap_or(0);
        self.places = Some(places);
        Ok(())
    }

    fn no_header(&self) -> ParseError {
        ParseError::new(
            ParseErrorKind::MissingColumn,
            format!("a line with the columns {}", self.mapping.columns().join(", ")),
            match &self.first {
                Some(line) => format!("no such line; the file begins \"{line}\""),
                None => "nothing".to_owned(),
            },
            "choose the mapping that belongs to this file, or map its columns anew",
        )
    }
}

impl Places {
    /// Of a table without a header: the mapping names the columns by their numbers, from 1.
    fn by_number(record: &Record<'_>, mapping: &Mapping) -> Option<Places> {
        let names: Vec<String> = (1..=record.len()).map(|number| number.to_string()).collect();
        let places = Places::find(&names, mapping)?;
        let row = Row { record, decimal_comma: mapping.delimiter != Delimiter::Comma };
        let is_number = |at: usize| number(&row.text(at)).is_some();
        places.gyr.iter().chain(&places.acc).all(|at| is_number(*at)).then_some(places)
    }

    fn find(names: &[String], mapping: &Mapping) -> Option<Places> {
        let place = |wanted: &str| names.iter().position(|name| name == wanted.trim());
        let three =
            |columns: &[String; 3]| Some([place(&columns[0])?, place(&columns[1])?, place(&columns[2])?]);
        Some(Places {
            time: match &mapping.time.column {
                Some(column) => Some(place(column)?),
                None => None,
            },
            gyr: three(&mapping.gyr.columns)?,
            acc: three(&mapping.acc.columns)?,
            mag: match &mapping.mag {
                Some(axes) => Some(three(&axes.columns)?),
                None => None,
            },
            pressure: match &mapping.pressure {
                Some(scalar) => Some(place(&scalar.column)?),
                None => None,
            },
        })
    }

    fn all(&self) -> impl Iterator<Item = usize> {
        let three = self.gyr.into_iter().chain(self.acc);
        three.chain(self.mag.into_iter().flatten()).chain(self.time).chain(self.pressure)
    }
}

/// A row and how its numbers are written.
struct Row<'a> {
    record: &'a Record<'a>,
    decimal_comma: bool,
}

impl Row<'_> {
    /// Whether a field says that there is no value.
    fn missing(&self, index: usize) -> bool {
        is_missing(self.record.field(index))
    }

    fn text(&self, index: usize) -> Cow<'_, [u8]> {
        let field = self.record.field(index);
        if self.decimal_comma && field.contains(&b',') {
            return Cow::Owned(field.iter().map(|b| if *b == b',' { b'.' } else { *b }).collect());
        }
        Cow::Borrowed(field)
    }

    fn number(&self, index: usize, column: &str) -> Result<f64, ParseError> {
        number(&self.text(index)).ok_or_else(|| bad_number(self.record, index, column))
    }

    fn axes<U: Factor>(&self, at: [usize; 3], axes: &Axes<U>) -> Result<[f64; 3], ParseError> {
        let factor = axes.unit.factor() * axes.one_is.unwrap_or(1.0);
        let mut values = [0.0; 3];
        for ((value, index), column) in values.iter_mut().zip(at).zip(&axes.columns) {
            *value = self.number(index, column)? * factor;
        }
        Ok(values)
    }
}

impl Clock {
    /// The time of a row on the file's clock, ns.
    fn tell(
        &mut self,
        row: &Row<'_>,
        place: Option<usize>,
        mapping: &Mapping,
        rows_before: u64,
    ) -> Result<i64, ParseError> {
        let source = &mapping.time;
        let column = source.column.as_deref().unwrap_or_default();
        let bad = |expected: &str| {
            let found = place.map_or_else(String::new, |at| quoted(row.record.field(at)));
            ParseError::new(
                ParseErrorKind::BadTime,
                expected,
                found,
                "check which column the time is in, and its unit",
            )
            .at_line(row.record.line)
            .in_column(column)
        };
        let of_rate = |samples: f64| samples / source.rate_hz.unwrap_or(1.0) * 1e9;
        let Some(place) = place else {
            return Ok(of_rate(rows_before as f64).round() as i64);
        };
        let field = row.text(place);
        if source.unit == TimeUnit::DateTime {
            let ns = clock_text::read(&field)
                .ok_or_else(|| bad("a date and time such as 2026-05-01 08:00:00.120"))?;
            return self.days(ns).ok_or_else(|| bad("a time within a hundred years"));
        }
        let finite = || bad("a finite time that fits the unit");
        if let Some(wraps_at) = source.wraps_at {
            let ticks = number(&field).filter(|ticks| ticks.abs() < 9e15).ok_or_else(finite)?;
            let ticks = self.unwrapped(ticks as i64, wraps_at).ok_or_else(finite)?;
            return match source.unit.ns() {
                Some(ns) => ticks.checked_mul(ns).ok_or_else(finite),
                None => Ok(of_rate(ticks as f64).round() as i64),
            };
        }
        match source.unit.ns() {
            Some(unit_ns) => scaled_ns(&field, unit_ns).ok_or_else(finite),
            None if source.unit == TimeUnit::Ticks => match number(&field).map(of_rate) {
                Some(ns) if ns.abs() < 9e18 => Ok(ns.round() as i64),
                _ => Err(finite()),
            },
            None => match number(&field).filter(|samples| samples.abs() < 9e9) {
                Some(samples) => Ok(of_rate(samples).round() as i64),
                None => Err(finite()),
            },
        }
    }

    /// A counter that began again at 0 goes on.
    fn unwrapped(&mut self, ticks: i64, wraps_at: u64) -> Option<i64> {
        let wraps_at = i64::try_from(wraps_at).ok()?;
        let step = ticks.checked_sub(self.last_ticks)?;
        if step < -wraps_at / 2 {
            self.wrapped_ticks = self.wrapped_ticks.checked_add(wraps_at)?;
        } else if step > wraps_at / 2 && self.wrapped_ticks > 0 {
            // A row from before the counter began again came late.
            self.wrapped_ticks -= wraps_at;
        }
        self.last_ticks = ticks;
        self.wrapped_ticks.checked_add(ticks)
    }

    /// A time of day without a date goes on over midnight.
    fn days(&mut self, ns: i64) -> Option<i64> {
        if (0..DAY_NS).contains(&ns) && ns < self.last_day_ns - DAY_NS / 2 {
            self.days_ns = self.days_ns.checked_add(DAY_NS)?;
        } else if (0..DAY_NS).contains(&ns) && ns > self.last_day_ns + DAY_NS / 2 && self.days_ns > 0 {
            self.days_ns -= DAY_NS;
        }
        self.last_day_ns = ns;
        self.days_ns.checked_add(ns)
    }
}

/// A decimal number of some unit as whole nanoseconds, exact where the unit allows it.
fn scaled_ns(field: &[u8], unit_ns: i64) -> Option<i64> {
    if unit_ns == 1_000_000_000 {
        return seconds_to_ns(field);
    }
    let text = std::str::from_utf8(field).ok()?.trim();
    if let Ok(whole) = text.parse::<i64>() {
        return whole.checked_mul(unit_ns);
    }
    let ns = number(field)? * unit_ns as f64;
    (ns.abs() < 9e18).then_some(ns.round() as i64)
}

/// The name of a column: UTF-8, GBK or western letters, without the blanks around it.
pub(super) fn name_of(field: &[u8]) -> Cow<'_, str> {
    let field = field.strip_prefix(BOM).unwrap_or(field);
    let text = match std::str::from_utf8(field) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => legacy(field).unwrap_or(encoding_rs::GBK).decode_without_bom_handling(field).0,
    };
    match text {
        Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
        Cow::Owned(text) => Cow::Owned(text.trim().to_owned()),
    }
}

#[cfg(test)]
#[path = "mapped_csv_tests.rs"]
mod tests;
