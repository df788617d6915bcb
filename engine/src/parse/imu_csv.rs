//! The canonical log of one foot: CSV with a header, any column order, one row a sample.

use crate::anomaly::Anomaly;
use crate::parse::error::{ParseError, no_rows};
use crate::parse::header::Header;
use crate::parse::left_out::{self, Decimals, LeftOut};
use crate::parse::lines::{Line, Lines};
use crate::parse::number::{is_missing, need_number, need_time_ns, optional_number};
use crate::parse::records::{Record, not_text};
use crate::parse::units_check::{Said, UnitsCheck};
use crate::sample::ImuSample;

/// The columns of the log, with their units: seconds, rad/s, m/s², µT, hPa.
pub const COLUMNS: [&str; 11] = [
    "t_s",
    "gyr_x_rad_s",
    "gyr_y_rad_s",
    "gyr_z_rad_s",
    "acc_x_m_s2",
    "acc_y_m_s2",
    "acc_z_m_s2",
    "mag_x_ut",
    "mag_y_ut",
    "mag_z_ut",
    "pressure_hpa",
];

/// A push parser: takes bytes in pieces of any size and gives the samples that they complete.
pub struct ImuCsv {
    lines: Lines,
    rows: Rows,
}

impl ImuCsv {
    /// A parser at the start of a file.
    pub fn new() -> ImuCsv {
        ImuCsv {
            lines: Lines::parted_by(b','),
            rows: Rows {
                header: None,
                units: UnitsCheck::new(Said::CANONICAL),
                samples: 0,
                left_out: LeftOut::default(),
                decimals: Decimals::default(),
            },
        }
    }

    /// Takes some bytes and appends the samples that they complete.
    ///
    /// # Errors
    ///
    /// At the first thing that is wrong; the parser is then of no further use.
    pub fn push(&mut self, bytes: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let ImuCsv { lines, rows } = self;
        let head = head_with(lines.head(), bytes);
        lines.push(bytes, |line| rows.take(line, &head, samples))
    }

    /// The file is over: appends the last sample, when no line feed ends it, and says what is wrong
    /// with the file as a whole.
    ///
    /// # Errors
    ///
    /// When the file holds no sample, or values that can only be in other units.
    pub fn finish(&mut self, samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let ImuCsv { lines, rows } = self;
        let head = lines.head().to_vec();
        lines.finish(|line| rows.take(line, &head, samples))?;
        rows.left_out.finish()?;
        if rows.samples == 0 {
            return Err(no_rows(rows.header.is_some(), &COLUMNS.join(","), "sample"));
        }
        rows.units.finish()
    }

    /// How many samples it has given so far.
    pub fn samples(&self) -> u64 {
        self.rows.samples
    }

    /// Lines and bytes that were left out, within these times of the log's clock.
    pub(super) fn anomalies(&self, t_ns: [i64; 2]) -> Vec<Anomaly> {
        self.rows.left_out.anomalies(self.lines.filling_bytes(), t_ns)
    }

    /// The columns of the file that say nothing to the engine and were left alone.
    pub fn ignored_columns(&self) -> Vec<String> {
        let Some((header, _)) = &self.rows.header else { return Vec::new() };
        header.names().iter().filter(|name| !COLUMNS.contains(&name.as_str())).cloned().collect()
    }
}

impl Default for ImuCsv {
    fn default() -> Self {
        ImuCsv::new()
    }
}

impl std::fmt::Debug for ImuCsv {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ImuCsv").field("samples", &self.rows.samples).finish_non_exhaustive()
    }
}

/// The first bytes of the file once `bytes` will have been taken in.
fn head_with(head: &[u8], bytes: &[u8]) -> Vec<u8> {
    head.iter().chain(bytes).take(8).copied().collect()
}

struct Rows {
    header: Option<(Header, Places)>,
    units: UnitsCheck,
    samples: u64,
    left_out: LeftOut,
    decimals: Decimals,
}

/// Where each column stands in the file.
struct Places {
    time: usize,
    inertial: [usize; 6],
    mag: Option<[usize; 3]>,
    pressure: Option<usize>,
}

impl Rows {
    fn take(&mut self, line: &Line<'_>, head: &[u8], out: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let record = match line {
            Line::Record(record) => record,
            Line::TooLong(line) if self.header.is_none() => {
                return Err(not_text(head, head).unwrap_or_else(|| left_out::too_long(*line)));
            }
            Line::TooLong(line) => return self.left_out.line(left_out::too_long(*line)),
        };
        let Some((header, places)) = &self.header else {
            // Of the head only the first line, which is here whole however the file was cut.
            let first = head.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default();
            if let Some(error) = not_text(head, first) {
                return Err(error);
            }
            let header = Header::read(record, head, &COLUMNS[..7].join(","))?;
            let places = Places::find(&header)?;
            self.header = Some((header, places));
            return Ok(());
        };
        let mut odd = None;
        let sample = match header.check_width(record).and_then(|()| places.sample(record, &mut odd)) {
            Ok(sample) => sample,
            Err(error) => return self.no_row(record, error),
        };
        if let Some(odd) = odd {
            self.left_out.value(odd);
        }
        if self.decimals.cut(record.field(record.len() - 1), record.ended) {
            return self.left_out.line(left_out::cut(record.line));
        }
        self.units.take(&sample)?;
        self.samples += 1;
        self.left_out.row();
        out.push(sample);
        Ok(())
    }

    /// A line that is no row: one of a lost packet, the names once more, or one that cannot be read.
    fn no_row(&mut self, record: &Record<'_>, error: ParseError) -> Result<(), ParseError> {
        let Some((header, places)) = &self.header else { return Ok(()) };
        if record.len() == header.len() && places.inertial.iter().all(|at| is_missing(record.field(*at))) {
            self.left_out.empty_row();
            return Ok(());
        }
        if record.fields().any(|field| field.trim_ascii() == COLUMNS[0].as_bytes())
            && let Ok(again) = Header::read(record, &[], &COLUMNS[..7].join(","))
            && let Ok(places) = Places::find(&again)
        {
            self.header = Some((again, places));
            self.left_out.header();
            return Ok(());
        }
        self.left_out.line(error)
    }
}

impl Places {
    fn find(header: &Header) -> Result<Places, ParseError> {
        let need = |i: usize| header.need(COLUMNS[i], &COLUMNS);
        let mut inertial = [0; 6];
        for (i, place) in inertial.iter_mut().enumerate() {
            *place = need(1 + i)?;
        }
        // One axis of the magnetometer says that the others are meant to be there.
        let any_mag = COLUMNS[7..10].iter().any(|name| header.find(name).is_some());
        let mag = if any_mag { Some([need(7)?, need(8)?, need(9)?]) } else { None };
        Ok(Places { time: need(0)?, inertial, mag, pressure: header.find(COLUMNS[10]) })
    }

    /// A row as a sample; a field or a pressure that is none stands in `odd`.
    fn sample(&self, record: &Record<'_>, odd: &mut Option<ParseError>) -> Result<ImuSample, ParseError> {
        let mut inertial = [0.0; 6];
        for (i, value) in inertial.iter_mut().enumerate() {
            *value = need_number(record, self.inertial[i], COLUMNS[1 + i])?;
        }
        let [gx, gy, gz, ax, ay, az] = inertial;
        let mut optional = |index: usize, column: &str| match optional_number(record, index, column) {
            Ok(value) => value,
            Err(error) => {
                odd.get_or_insert(error);
                None
            }
        };
        let mag_b_ut = match self.mag {
            Some([x, y, z]) => {
                let x = optional(x, COLUMNS[7]);
                let y = optional(y, COLUMNS[8]);
                let z = optional(z, COLUMNS[9]);
                x.zip(y).zip(z).map(|((x, y), z)| [x, y, z])
            }
            None => None,
        };
        let pressure_hpa = self.pressure.and_then(|index| optional(index, COLUMNS[10]));
        Ok(ImuSample {
            t_ns: need_time_ns(record, self.time, COLUMNS[0])?,
            w_ib_b_rad_s: [gx, gy, gz],
            f_b_m_s2: [ax, ay, az],
            mag_b_ut,
            pressure_hpa,
        })
    }
}

/// Appends samples as rows of the canonical log; `header` first writes the line of names.
pub fn write(samples: &[ImuSample], header: bool, out: &mut String) {
    use std::fmt::Write as _;
    if header {
        out.push_str(&COLUMNS.join(","));
        out.push('\n');
    }
    for sample in samples {
        crate::track::csv::push_seconds(sample.t_ns, out);
        let inertial = sample.w_ib_b_rad_s.iter().chain(&sample.f_b_m_s2).map(|v| Some(*v));
        let mag = (0..3).map(|i| sample.mag_b_ut.map(|m| m[i]));
        for value in inertial.chain(mag).chain([sample.pressure_hpa]) {
            out.push(',');
            if let Some(value) = value {
                write!(out, "{value}").expect("writing to a string cannot fail");
            }
        }
        out.push('\n');
    }
}

#[cfg(test)]
#[path = "imu_csv_tests.rs"]
mod tests;
