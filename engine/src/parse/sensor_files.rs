//! Sensors in files of their own, as phone loggers and the x-IMU3 write them, joined by time to one canonical log.
//!
//! | who | files | columns |
//! |---|---|---|
//! | x-IMU3 | `Inertial.csv`, `Magnetometer.csv` | `Timestamp (us)`, `Gyroscope X (deg/s)`, `Accelerometer X (g)` … |
//! | Sensor Logger | `Gyroscope.csv`, `TotalAcceleration.csv`, or `Accelerometer.csv` with `Gravity.csv`, `Magnetometer.csv`, `Barometer.csv` | `time,seconds_elapsed,z,y,x` |
//! | Phyphox | `Gyroscope.csv`, `Accelerometer.csv`, `Magnetometer.csv`, `Pressure.csv` | `Time (s)`, `X (m/s^2)` … |
//! | anybody | names with gyro, acc, mag, baro or press | a time, and x, y, z |
//!
//! The rates' times are those of the log. Forces are put between their neighbours by time; where these are far apart, as in
//! a gap, there is no row. A field and a pressure stand in the first row at or after their own time. Acceleration without gravity
//! (linear, user, free; Sensor Logger's `Accelerometer`) is no specific force: it is used with the gravity that belongs to it, or not.

use std::fmt::Write as _;

use crate::parse::clock_text;
use crate::parse::column_name::ColumnName;
use crate::parse::encoding::Decoder;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::imu_csv;
use crate::parse::mapping::Delimiter;
use crate::parse::number::number;
use crate::parse::table_head::TextHead;

/// The length of one standard gravity, m/s².
const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
/// A file's header is within so many bytes.
const HEAD_BYTES: usize = 32 << 10;
/// The fewest columns of such a file: a time and a value.
const FEWEST_COLUMNS: usize = 2;
/// By so many readings at the start a unit is told.
const UNIT_READINGS: usize = 500;
/// Neighbours farther apart than so many usual intervals are none.
const NEIGHBOURS: i64 = 5;
/// And never those that are nearer than this, ns.
const NEAR_NS: i64 = 50_000_000;

/// A file as it was sent.
#[derive(Clone, Copy, Debug)]
pub struct SensorFile<'a> {
    /// Its name, with or without a path.
    pub name: &'a str,
    /// What is in it.
    pub bytes: &'a [u8],
}

/// Files that have become one log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Joined {
    /// The log, canonical CSV.
    pub csv: String,
    /// What was done with which file, as a sentence.
    pub note: String,
}

/// What a file tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Quantity {
    Rate,
    Force,
    /// Acceleration without gravity.
    Linear,
    Gravity,
    Field,
    Pressure,
}

/// The readings of one quantity, in the order of time.
struct Readings {
    quantity: Quantity,
    /// The file's name without its path.
    file: String,
    /// The unit that its header says, spelt alike; empty where it says none.
    unit: String,
    rows: Vec<(i64, [f64; 3])>,
    /// Lines that are no row.
    left_out: usize,
}

/// Joins the files of one sensor to one log.
///
/// # Errors
///
/// Where there are no rates or no specific forces among them, or their units or times cannot be told.
pub fn join(files: &[SensorFile<'_>]) -> Result<Joined, ParseError> {
    let mut found: Vec<Readings> =
        files.iter().flat_map(read).filter(|readings| !readings.rows.is_empty()).collect();
    let uncalibrated = |readings: &Readings| readings.file.to_lowercase().contains("uncalibrated");
    let of_rates: Vec<&str> = found
        .iter()
        .filter(|readings| readings.quantity == Quantity::Rate && !uncalibrated(readings))
        .map(|readings| readings.file.as_str())
        .collect();
    if of_rates.len() > 1 {
        return Err(ParseError::new(
            ParseErrorKind::UnknownFormat,
            "the files of one sensor",
            format!("{} files of angular rates: {}", of_rates.len(), of_rates.join(", ")),
            "send the files of each sensor in an archive, or a folder, of their own",
        ));
    }
    let mut take = |quantity: Quantity| {
        let most = found
            .iter()
            .enumerate()
            .filter(|(_, readings)| readings.quantity == quantity)
            // What the phone has calibrated itself is better, where it is there.
            .max_by_key(|(_, readings)| (!uncalibrated(readings), readings.rows.len()))?
            .0;
        Some(found.swap_remove(most))
    };
    let names = || files.iter().map(|file| short(file.name)).collect::<Vec<_>>().join(", ");
    let missing = |what: &str, advice: &str| {
        ParseError::new(
            ParseErrorKind::UnknownFormat,
            format!("a file of {what} among those of one sensor"),
            format!("the files {}", names()),
            advice.to_owned(),
        )
    };
    let mut rates = take(Quantity::Rate).ok_or_else(|| {
        missing(
            "angular rates (Gyroscope.csv, Inertial.csv)",
            "export the gyroscope, too, into the same folder or archive",
        )
    })?;
    let mut note = Vec::new();
    let forces = match (take(Quantity::Force), take(Quantity::Linear), take(Quantity::Gravity)) {
        (Some(mut force), _, _) => {
            to_m_s2(&mut force)?;
            force
        }
        (None, Some(linear), Some(gravity)) => {
            note.push(format!("{} and {} were added", linear.file, gravity.file));
            let mut sum = added(linear, &gravity);
            to_m_s2(&mut sum)?;
            sum
        }
        (None, Some(linear), None) => {
            return Err(missing(
                "specific forces with gravity (Accelerometer.csv, TotalAcceleration.csv)",
                &format!("{} lacks gravity: export total acceleration, or the gravity, too", linear.file),
            ));
        }
        _ => {
            return Err(missing(
                "specific forces (Accelerometer.csv, TotalAcceleration.csv)",
                "export the accelerometer, too, into the same folder or archive",
            ));
        }
    };
    to_rad_s(&mut rates, &forces)?;
    let field = take(Quantity::Field).and_then(|field| to_ut(field, &mut note));
    let pressure = take(Quantity::Pressure).and_then(|pressure| to_hpa(pressure, &mut note));
    let mut csv = String::with_capacity(rates.rows.len() * 96);
    csv.push_str(&imu_csv::COLUMNS.join(","));
    csv.push('\n');
    let without = write(&mut csv, &rates, &forces, field.as_ref(), pressure.as_ref());
    if csv.lines().nth(1).is_none() {
        return Err(missing(
            "forces at the times of the rates",
            "the files do not overlap in time: take those of one recording",
        ));
    }
    let all = [Some(&rates), Some(&forces), field.as_ref(), pressure.as_ref()];
    let mut used: Vec<&str> = all.iter().flatten().map(|readings| readings.file.as_str()).collect();
    used.dedup();
    note.insert(0, format!("{} were joined by time", used.join(", ")));
    if without > 0 {
        note.push(format!("{without} rows have no force near in time and were left out"));
    }
    for readings in all.into_iter().flatten().filter(|readings| readings.left_out > 0) {
        note.push(format!(
            "{} lines of {} could not be read and were left out",
            readings.left_out, readings.file
        ));
    }
    Ok(Joined { csv, note: note.join("; ") })
}

/// The file's name without its path.
fn short(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// What a file tells; an x-IMU3's `Inertial.csv` tells two quantities.
fn read(file: &SensorFile<'_>) -> Vec<Readings> {
    let mut decoder = Decoder::default();
    let mut text = decoder.push(file.bytes).into_owned();
    text.extend(decoder.finish());
    let head = &text[..text.len().min(HEAD_BYTES)];
    let Some(table) =
        TextHead::read(head, text.len() <= HEAD_BYTES).and_then(|head| head.table_of(FEWEST_COLUMNS))
    else {
        return Vec::new();
    };
    let columns: Vec<(String, String)> = table.columns.iter().map(|name| name_and_unit(name)).collect();
    let Some(time) = time_column(&columns) else { return Vec::new() };
    let name = short(file.name).to_lowercase();
    let stem = name.split('.').next().unwrap_or_default();
    // Sensor Logger's `Accelerometer` is without gravity.
    let logger = columns.iter().any(|(name, _)| name == "secondselapsed");
    let mut quantities = Vec::new();
    for quantity in [
        Quantity::Rate,
        Quantity::Force,
        Quantity::Linear,
        Quantity::Gravity,
        Quantity::Field,
        Quantity::Pressure,
    ] {
        let at = if quantity == Quantity::Pressure {
            let one = columns.iter().position(|(name, _)| of_column(name) == Some(quantity));
            one.map(|at| [at; 3])
        } else {
            axes(&columns, |name| of_column(name) == Some(quantity)).or_else(|| {
                let own = of_file(stem, logger) == Some(quantity);
                own.then(|| axes(&columns, |name| of_column(name).is_none())).flatten()
            })
        };
        quantities.extend(at.map(|at| (quantity, at)));
    }
    quantities
        .into_iter()
        .map(|(quantity, at)| {
            let unit = columns[at[0]].1.clone();
            let (rows, left_out) = rows(&text, table.delimiter, time, &columns[time].1, at);
            Readings { quantity, file: short(file.name).to_owned(), unit, rows, left_out }
        })
        .collect()
}

/// A column's name without blanks and marks, and its unit, both in small letters.
fn name_and_unit(column: &str) -> (String, String) {
    let ColumnName { name, unit } = ColumnName::of(column, "");
    (name.chars().filter(|c| c.is_alphanumeric()).collect(), unit)
}

/// The column of the time: by the wall clock, where there is one, so that two sensors can be brought together.
fn time_column(columns: &[(String, String)]) -> Option<usize> {
    ["time", "timestamp", "t", "unixtime", "systemtime", "secondselapsed", "elapsed", "seconds", "ms"]
        .iter()
        .find_map(|word| columns.iter().position(|(name, _)| name == word))
        .or_else(|| {
            let words = ["time", "zeit", "temps", "tiempo", "tempo", "时间", "時間", "время"];
            columns.iter().position(|(name, _)| words.iter().any(|word| name.starts_with(word)))
        })
}

/// The columns of x, y and z among those of which this holds.
fn axes(columns: &[(String, String)], of: impl Fn(&str) -> bool) -> Option<[usize; 3]> {
    let axis = |axis: char| columns.iter().position(|(name, _)| of(name) && name.ends_with(axis));
    Some([axis('x')?, axis('y')?, axis('z')?])
}

/// What a name of a column or a file speaks of.
fn of_column(name: &str) -> Option<Quantity> {
    let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
    if has(&["bias", "accuracy", "magnitude", "absolute", "orientation"]) {
        None
    } else if has(&[
        "linear",
        "lineaire",
        "lineal",
        "useracc",
        "freeacc",
        "线性加速度",
        "线加速度",
        "ohneg",
        "withoutg",
    ]) {
        Some(Quantity::Linear)
    } else if has(&["gravity", "schwerkraft", "gravite", "gravedad", "重力"]) && !has(&["acceleration"]) {
        Some(Quantity::Gravity)
    } else if has(&[
        "gyr",
        "giro",
        "angularvel",
        "angularrate",
        "rotationrate",
        "winkelgeschwindigkeit",
        "drehrate",
        "vitesseangulaire",
        "velocidadangular",
        "角速度",
        "陀螺",
        "ジャイロ",
        "гироскоп",
    ]) {
        Some(Quantity::Rate)
    } else if has(&["acc", "beschleunigung", "acel", "加速度", "加计", "ускорение", "акселерометр"])
    {
        Some(Quantity::Force)
    } else if has(&["mag", "champ", "campo", "磁", "магн"]) {
        Some(Quantity::Field)
    } else if has(&["press", "presion", "baro", "druck", "气压", "気圧", "压力", "давление"]) {
        Some(Quantity::Pressure)
    } else {
        None
    }
}

fn of_file(stem: &str, logger: bool) -> Option<Quantity> {
    // In brackets stands what kind it is, as in «acceleration (without g)».
    let (name, rest) = name_and_unit(stem);
    let name = name + &rest;
    match of_column(&name) {
        Some(Quantity::Force) if logger && !name.contains("total") => Some(Quantity::Linear),
        other => other,
    }
}

/// The rows of a file, in the order of time, and how many lines below the first row are none.
fn rows(
    text: &[u8],
    delimiter: Delimiter,
    time: usize,
    time_unit: &str,
    at: [usize; 3],
) -> (Vec<(i64, [f64; 3])>, usize) {
    let (mut found, mut left_out) = (Vec::new(), 0);
    // Whether the time is a date and time of day.
    let mut dated = None;
    for line in text.split(|byte| *byte == b'\n') {
        let fields: Vec<&[u8]> = line.split(|byte| *byte == delimiter.byte()).map(unquoted).collect();
        let value = |index: usize| fields.get(index).and_then(|field| cell(field, delimiter));
        let clock = || fields.get(time).and_then(|field| clock_text::read(field)).map(|ns| ns as f64);
        let t = match dated {
            None => value(time).map(|t| (t, false)).or_else(|| clock().map(|t| (t, true))),
            Some(false) => value(time).map(|t| (t, false)),
            Some(true) => clock().map(|t| (t, true)),
        };
        if found.is_empty() {
            dated = t.map(|(_, dated)| dated);
        }
        let row = t.map(|(t, _)| t).zip(value(at[0]).zip(value(at[1])).zip(value(at[2])));
        match row {
            Some((t, ((x, y), z))) => {
                let exact = if dated == Some(true) { None } else { exact(fields[time]) };
                found.push((exact.unwrap_or(t), [x, y, z]));
            }
            None if !found.is_empty() && !line.trim_ascii().is_empty() => left_out += 1,
            None => {}
        }
    }
    let ns = match time_unit {
        _ if dated == Some(true) => 1.0,
        "s" | "sec" | "seconds" => 1e9,
        "ms" => 1e6,
        "us" => 1e3,
        "ns" => 1.0,
        _ => by_steps(&found),
    };
    let mut rows: Vec<(i64, [f64; 3])> =
        found.into_iter().map(|(t, value)| ((t * ns).round() as i64, value)).collect();
    rows.sort_by_key(|row| row.0);
    rows.dedup_by_key(|row| row.0);
    (rows, left_out)
}

fn unquoted(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    field.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\"")).unwrap_or(field)
}

/// A finite number, with a comma for a point where commas do not part fields.
fn cell(field: &[u8], delimiter: Delimiter) -> Option<f64> {
    let comma = delimiter != Delimiter::Comma && field.contains(&b',');
    let pointed: Vec<u8>;
    let field = if comma {
        pointed = field.iter().map(|byte| if *byte == b',' { b'.' } else { *byte }).collect();
        &pointed
    } else {
        field
    };
    number(field).filter(|value| value.is_finite())
}

/// The number as it is; nanoseconds since 1970 are exact to a quarter of a microsecond.
fn exact(field: &[u8]) -> Option<f64> {
    std::str::from_utf8(field).ok()?.parse::<i64>().ok().map(|whole| whole as f64)
}

/// Nanoseconds in the unit of these times, by how far two rows are apart: a sensor has some to thousands of rows a second.
fn by_steps(rows: &[(f64, [f64; 3])]) -> f64 {
    let mut steps: Vec<f64> = rows
        .windows(2)
        .take(UNIT_READINGS)
        .map(|pair| pair[1].0 - pair[0].0)
        .filter(|step| *step > 0.0)
        .collect();
    steps.sort_by(f64::total_cmp);
    match steps.get(steps.len() / 2) {
        Some(step) if *step < 2.0 => 1e9,
        Some(step) if *step < 2e3 => 1e6,
        Some(step) if *step < 2e6 => 1e3,
        _ => 1.0,
    }
}

/// The median length of the first readings.
fn usual_length(readings: &Readings) -> f64 {
    let mut lengths: Vec<f64> = readings
        .rows
        .iter()
        .take(UNIT_READINGS)
        .map(|(_, [x, y, z])| (x * x + y * y + z * z).sqrt())
        .collect();
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied().unwrap_or_default()
}

fn scale(readings: &mut Readings, by: f64) {
    for (_, value) in &mut readings.rows {
        *value = value.map(|x| by * x);
    }
}

fn unknown_unit(readings: &Readings, expected: &str, found: f64) -> ParseError {
    ParseError::new(
        ParseErrorKind::MappingNeeded,
        format!("{expected} in {}", readings.file),
        format!("readings of {found:.3} at its start, unit {:?}", readings.unit),
        "export the values in a unit that the header names, or map the columns of one joined table",
    )
}

/// While somebody stands the force is as long as gravity.
fn to_m_s2(force: &mut Readings) -> Result<(), ParseError> {
    let length = usual_length(force);
    let by = match force.unit.as_str() {
        "g" => STANDARD_GRAVITY_M_S2,
        "mg" => 1e-3 * STANDARD_GRAVITY_M_S2,
        "m/s2" | "ms-2" | "m/s/s" => 1.0,
        _ => match length {
            g if (0.7..1.4).contains(&g) => STANDARD_GRAVITY_M_S2,
            metres if (7.0..13.0).contains(&metres) => 1.0,
            mg if (700.0..1400.0).contains(&mg) => 1e-3 * STANDARD_GRAVITY_M_S2,
            _ => return Err(unknown_unit(force, "specific forces in m/s², g or mg", length)),
        },
    };
    scale(force, by);
    Ok(())
}

/// Who tells forces in g tells rates in degrees.
fn to_rad_s(rates: &mut Readings, forces: &Readings) -> Result<(), ParseError> {
    let degrees = match rates.unit.as_str() {
        "deg/s" | "dps" => true,
        "rad/s" | "rads" => false,
        _ => matches!(forces.unit.as_str(), "g" | "mg"),
    };
    if degrees {
        scale(rates, 1f64.to_radians());
    }
    let fastest =
        rates.rows.iter().map(|(_, [x, y, z])| x.abs().max(y.abs()).max(z.abs())).fold(0.0, f64::max);
    if fastest > 90.0 {
        return Err(unknown_unit(rates, "angular rates in rad/s or deg/s", fastest));
    }
    Ok(())
}

/// By the Earth's field, which has 22 to 67 µT; what is in no unit is left out.
fn to_ut(mut field: Readings, note: &mut Vec<String>) -> Option<Readings> {
    let by = match (field.unit.as_str(), usual_length(&field)) {
        ("ut", _) => 1.0,
        ("gauss" | "gs" | "g", _) => 100.0,
        ("mgauss" | "mg", _) => 0.1,
        ("nt", _) => 1e-3,
        ("", ut) if (15.0..100.0).contains(&ut) => 1.0,
        ("", gauss) if (0.15..1.0).contains(&gauss) => 100.0,
        ("", mgauss) if (150.0..1000.0).contains(&mgauss) => 0.1,
        _ => {
            note.push(format!("{} was left out: its field is in no known unit", field.file));
            return None;
        }
    };
    scale(&mut field, by);
    Some(field)
}

fn to_hpa(mut pressure: Readings, note: &mut Vec<String>) -> Option<Readings> {
    let first = pressure.rows.first().map_or(0.0, |row| row.1[0]);
    let by = match first {
        hpa if (250.0..1300.0).contains(&hpa) => 1.0,
        kpa if (25.0..130.0).contains(&kpa) => 10.0,
        pa if (25_000.0..130_000.0).contains(&pa) => 0.01,
        _ => {
            note.push(format!("{} was left out: its pressure is of no place on Earth", pressure.file));
            return None;
        }
    };
    scale(&mut pressure, by);
    Some(pressure)
}

/// Acceleration without gravity, and the gravity that belongs to it.
fn added(mut linear: Readings, gravity: &Readings) -> Readings {
    let mut near = Near::new(gravity);
    linear.rows.retain_mut(|(t_ns, value)| {
        let Some(gravity) = near.between(*t_ns) else { return false };
        *value = std::array::from_fn(|axis| value[axis] + gravity[axis]);
        true
    });
    linear.quantity = Quantity::Force;
    linear
}

/// Goes through readings in the order of time.
struct Near<'a> {
    rows: &'a [(i64, [f64; 3])],
    at: usize,
    farthest_ns: i64,
}

impl<'a> Near<'a> {
    fn new(readings: &'a Readings) -> Near<'a> {
        let rows = &readings.rows;
        let mut steps: Vec<i64> = rows.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        let middle = steps.len() / 2;
        let usual_ns = if steps.is_empty() { 0 } else { *steps.select_nth_unstable(middle).1 };
        Near { rows, at: 0, farthest_ns: (NEIGHBOURS * usual_ns).max(NEAR_NS) }
    }

    /// The reading at a time, between its neighbours; `None` where these are far apart.
    fn between(&mut self, t_ns: i64) -> Option<[f64; 3]> {
        while self.at + 1 < self.rows.len() && self.rows[self.at + 1].0 <= t_ns {
            self.at += 1;
        }
        let (before_ns, before) = *self.rows.get(self.at).filter(|row| row.0 <= t_ns)?;
        if before_ns == t_ns {
            return Some(before);
        }
        let (after_ns, after) = *self.rows.get(self.at + 1)?;
        if after_ns - before_ns > self.farthest_ns {
            return None;
        }
        let share = (t_ns - before_ns) as f64 / (after_ns - before_ns) as f64;
        Some(std::array::from_fn(|axis| before[axis] + share * (after[axis] - before[axis])))
    }

    /// The newest reading that has come since the last call and up to a time.
    fn fresh(&mut self, t_ns: i64) -> Option<[f64; 3]> {
        let mut newest = None;
        while let Some((_, value)) = self.rows.get(self.at).filter(|row| row.0 <= t_ns) {
            newest = Some(*value);
            self.at += 1;
        }
        newest
    }
}

/// Writes the rows; says how many rates have no force near in time.
fn write(
    csv: &mut String,
    rates: &Readings,
    forces: &Readings,
    field: Option<&Readings>,
    pressure: Option<&Readings>,
) -> usize {
    let mut force = Near::new(forces);
    let (mut field, mut pressure) = (field.map(Near::new), pressure.map(Near::new));
    let mut without = 0;
    for (t_ns, [wx, wy, wz]) in &rates.rows {
        let Some([fx, fy, fz]) = force.between(*t_ns) else {
            without += 1;
            continue;
        };
        let (whole_s, rest_ns) = (t_ns.div_euclid(1_000_000_000), t_ns.rem_euclid(1_000_000_000));
        let mut row = format!("{whole_s}.{rest_ns:09},{wx},{wy},{wz},{fx},{fy},{fz},");
        match field.as_mut().and_then(|field| field.fresh(*t_ns)) {
            Some([x, y, z]) => write!(row, "{x},{y},{z},"),
            None => write!(row, ",,,"),
        }
        .expect("writing to a string cannot fail");
        if let Some([hpa, ..]) = pressure.as_mut().and_then(|pressure| pressure.fresh(*t_ns)) {
            write!(row, "{hpa}").expect("writing to a string cannot fail");
        }
        csv.push_str(&row);
        csv.push('\n');
    }
    without
}

#[cfg(test)]
#[path = "sensor_files_tests.rs"]
mod tests;
