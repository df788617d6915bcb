//! A mapping offered for a table that nobody knows, from the names of its columns, their units and its first rows.

use crate::parse::clock_text;
use crate::parse::mapping::{
    Axes, FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, Scalar, TimeSource, TimeUnit,
};
use crate::parse::table_head::TableHead;

const RATES: &[&str] =
    &["gyr", "angularvelocity", "angularrate", "angvel", "omega", "rotationrate", "角速度", "陀螺"];
const FORCES: &[&str] = &["acc", "specificforce", "加速度", "比力"];
const FIELDS: &[&str] = &["mag", "field", "磁"];
const PRESSURES: &[&str] = &["press", "baro", "气压"];
const TIMES: &[&str] =
    &["timestamp", "time", "ts", "t", "secs", "seconds", "ms", "us", "时间", "片上时间", "clock"];
/// The free acceleration lacks gravity, and filtered axes of the world are none of the sensor.
const OTHERS: &[&str] = &["free", "linear", "user", "global", "world", "bias", "线性"];

/// The mapping that the table suggests; `None` where time, rate or force cannot be told.
pub(super) fn suggestion(table: &TableHead) -> Option<Mapping> {
    let columns: Vec<Column> = (0..table.columns.len()).map(|at| Column::of(table, at)).collect();
    let three = |words: &[&str], short: &[char]| -> Option<[usize; 3]> {
        let axis = |axis: char| columns.iter().position(|column| column.is_axis(words, short, axis));
        Some([axis('x')?, axis('y')?, axis('z')?])
    };
    let named = |at: [usize; 3]| at.map(|at| table.columns[at].clone());
    let first =
        table.rows.iter().find(|row| row.iter().filter(|cell| number(cell).is_some()).count() >= 6)?;
    let value = |at: usize| number(first.get(at)?);
    let gyr = three(RATES, &['g', 'w'])?;
    let acc = three(FORCES, &['a', 'f'])?;
    let [x, y, z] = [value(acc[0])?, value(acc[1])?, value(acc[2])?];
    let force = match columns[acc[0]].unit.as_str() {
        "g" => ForceUnit::G,
        "m/s2" | "m/s^2" | "m/s²" | "ms2" | "m_s2" | "ms-2" | "米/秒2" => ForceUnit::MS2,
        // At the start of a log the foot stands.
        _ => match (x * x + y * y + z * z).sqrt() {
            length if (0.8..1.25).contains(&length) => ForceUnit::G,
            length if (8.0..12.0).contains(&length) => ForceUnit::MS2,
            _ => return None,
        },
    };
    let rate = match columns[gyr[0]].unit.as_str() {
        "deg/s" | "°/s" | "dps" | "degs" | "deg_s" | "度/秒" => RateUnit::DegS,
        "rad/s" | "rads" | "rad_s" | "弧度/秒" => RateUnit::RadS,
        // Who tells forces in g tells rates in degrees; the page asks, and the log's content is checked.
        _ if force == ForceUnit::G => RateUnit::DegS,
        _ => RateUnit::RadS,
    };
    let mag = three(FIELDS, &['m', 'h']).map(|at| Axes {
        columns: named(at),
        unit: match columns[at[0]].unit.as_str() {
            "ut" | "µt" | "μt" | "微特" => FieldUnit::Ut,
            "gauss" | "gs" => FieldUnit::Gauss,
            "mgauss" | "mg" => FieldUnit::Mgauss,
            _ => FieldUnit::Counts,
        },
    });
    let pressure = columns.iter().position(|column| PRESSURES.iter().any(|word| column.name.contains(word)));
    let pressure = pressure.and_then(|at| {
        let unit = match columns[at].unit.as_str() {
            "hpa" | "mbar" => PressureUnit::Hpa,
            "pa" => PressureUnit::Pa,
            "kpa" => PressureUnit::Kpa,
            _ => match value(at)? {
                hpa if (500.0..1100.0).contains(&hpa) => PressureUnit::Hpa,
                pa if (50_000.0..110_000.0).contains(&pa) => PressureUnit::Pa,
                kpa if (50.0..110.0).contains(&kpa) => PressureUnit::Kpa,
                _ => return None,
            },
        };
        Some(Scalar { column: table.columns[at].clone(), unit })
    });
    let time = TIMES.iter().find_map(|word| columns.iter().position(|column| column.name == *word))?;
    let mapping = Mapping {
        delimiter: table.delimiter,
        time: TimeSource {
            column: Some(table.columns[time].clone()),
            unit: time_unit(table, time, &columns[time])?,
            rate_hz: None,
            wraps_at: None,
        },
        gyr: Axes { columns: named(gyr), unit: rate },
        acc: Axes { columns: named(acc), unit: force },
        mag,
        pressure,
        skip_rows_without_inertial: false,
    };
    mapping.check().ok()?;
    Some(mapping)
}

/// By what is said, or by how far two rows are apart: a sensor on a body has some tens to thousands of rows a second.
fn time_unit(table: &TableHead, at: usize, column: &Column) -> Option<TimeUnit> {
    let cells: Vec<&str> = table.rows.iter().filter_map(|row| row.get(at)).map(String::as_str).collect();
    if cells.iter().any(|cell| clock_text::is_time(cell.as_bytes())) {
        return Some(TimeUnit::DateTime);
    }
    match column.unit.as_str() {
        "s" | "sec" | "秒" => return Some(TimeUnit::S),
        "ms" | "毫秒" => return Some(TimeUnit::Ms),
        "us" | "µs" | "μs" | "微秒" => return Some(TimeUnit::Us),
        "ns" => return Some(TimeUnit::Ns),
        _ => {}
    }
    let times: Vec<f64> = cells.iter().filter_map(|cell| number(cell)).collect();
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    Some(match *steps.get(steps.len() / 2)? {
        step if step < 0.2 => TimeUnit::S,
        step if step < 200.0 => TimeUnit::Ms,
        step if step < 200_000.0 => TimeUnit::Us,
        _ => TimeUnit::Ns,
    })
}

fn number(cell: &str) -> Option<f64> {
    cell.trim().replace(',', ".").parse().ok()
}

/// A column's name and unit, spelt alike.
struct Column {
    /// Lower case, without unit, brackets and what parts words.
    name: String,
    unit: String,
}

impl Column {
    fn of(table: &TableHead, at: usize) -> Column {
        let lower = table.columns[at].to_lowercase().replace('Â', "").replace("â", "");
        let (name, said) = match lower.split_once(['(', '[', '（']) {
            Some((name, rest)) => (name, rest.split([')', ']', '）']).next().unwrap_or_default()),
            None => (lower.as_str(), ""),
        };
        // A row of units stands below the names.
        let below = table.rows.first().and_then(|row| row.get(at)).map_or("", String::as_str);
        let unit = if said.is_empty() && number(below).is_none() { below } else { said };
        let unit: String = unit.to_lowercase().chars().filter(|c| !c.is_whitespace()).collect();
        let name: String = name.chars().filter(|c| !c.is_whitespace() && !"_-./:".contains(*c)).collect();
        Column { name, unit: unit.trim_matches(['(', ')', '[', ']']).replace("sec", "s") }
    }

    /// Whether it is this axis of a quantity with one of these names, or a letter and the axis alone.
    fn is_axis(&self, words: &[&str], short: &[char], axis: char) -> bool {
        let letters: Vec<char> = self.name.chars().collect();
        if let [quantity, last] = letters[..] {
            return short.contains(&quantity) && last == axis;
        }
        if OTHERS.iter().any(|word| self.name.contains(word)) {
            return false;
        }
        words.iter().any(|word| {
            self.name.find(word).is_some_and(|at| {
                let behind = &self.name[at + word.len()..];
                behind.ends_with(axis)
                    || self.name[..at].ends_with(axis)
                    || behind.chars().find(|c| "xyz".contains(*c)) == Some(axis) && behind.len() < 14
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::mapping::Delimiter;

    fn of(header: &str, rows: &[&str]) -> Option<Mapping> {
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        suggestion(&TableHead {
            delimiter: Delimiter::Comma,
            columns: cells(header),
            rows: rows.iter().map(|row| cells(row)).collect(),
        })
    }

    #[test]
    fn names_units_and_content_say_which_column_is_which() {
        let rows = ["0,0.1,0,9.8,0,0,0", "0.01,0.1,0,9.8,0,0,0"];
        let plain = of("t,ax,ay,az,gx,gy,gz", &rows).unwrap();
        assert_eq!(plain.gyr, Axes { columns: ["gx", "gy", "gz"].map(str::to_owned), unit: RateUnit::RadS });
        assert_eq!((plain.acc.unit, plain.time.unit), (ForceUnit::MS2, TimeUnit::S));
        let units = of(
            "Time,Foot/Acceleration/X,Foot/Acceleration/Y,Foot/Acceleration/Z,Foot/Angular Velocity/X,Foot/Angular Velocity/Y,Foot/Angular Velocity/Z",
            &["s,m/s^2,m/s^2,m/s^2,rad/s,rad/s,rad/s", rows[0], rows[1]],
        )
        .unwrap();
        assert_eq!(units.acc.columns[2], "Foot/Acceleration/Z");
        assert_eq!((units.gyr.unit, units.time.unit), (RateUnit::RadS, TimeUnit::S));
        let chinese = of(
            "时间,加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),角速度Z(°/s)",
            &["2026-11-25 09:30:00.5,0,0,1,0,0,0", "2026-11-25 09:30:00.51,0,0,1,0,0,0"],
        )
        .unwrap();
        assert_eq!((chinese.gyr.unit, chinese.acc.unit), (RateUnit::DegS, ForceUnit::G));
        assert_eq!(chinese.time.unit, TimeUnit::DateTime);
        let ms = of("ms,accX,accY,accZ,gyroX,gyroY,gyroZ", &["0,0,0,1,0,0,0", "10,0,0,1,0,0,0"]).unwrap();
        assert_eq!((ms.time.unit, ms.gyr.unit), (TimeUnit::Ms, RateUnit::DegS));
    }

    #[test]
    fn what_cannot_be_told_is_not_offered() {
        let row = ["0,0.1,0,9.8,0,0,0"];
        assert_eq!(of("a,b,c,d,e,f,g", &row), None);
        assert_eq!(of("t,freeaccx,freeaccy,freeaccz,gx,gy,gz", &row), None);
        assert_eq!(of("t,ax,ay,az,gx,gy,gz", &["0,3,4,4500,0,0,0"]), None, "counts");
    }
}
