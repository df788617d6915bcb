//! A mapping offered for a table that nobody knows, from the names of its columns, their units and its first rows.

use crate::parse::clock_text;
use crate::parse::column_name::ColumnName;
use crate::parse::mapping::{
    Axes, FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, Scalar, TimeSource, TimeUnit,
};
use crate::parse::table_head::TableHead;
use crate::parse::units_check::Looks;

const RATES: &[&str] = &[
    "gyr",
    "giro",
    "angularvelocity",
    "angularrate",
    "angvel",
    "omega",
    "rotationrate",
    "rateofturn",
    "turnrate",
    "winkelgeschwindigkeit",
    "drehrate",
    "vitesseangulaire",
    "velocidadangular",
    "velocitaangolare",
    "угловаяскорость",
    "гироскоп",
    "角速度",
    "角速率",
    "陀螺",
    "ジャイロ",
    "각속도",
    "자이로",
];
/// Rates about the axes by the names of the turns, x first.
const TURNS: [&str; 3] = ["rollrate", "pitchrate", "yawrate"];
const FORCES: &[&str] = &[
    "acc",
    "acel",
    "specificforce",
    "beschleunigung",
    "ускорение",
    "акселерометр",
    "加速度",
    "比力",
    "加计",
    "가속도",
];
const FIELDS: &[&str] = &["mag", "champ", "campo", "магн", "磁", "자기"];
const PRESSURES: &[&str] =
    &["press", "presion", "baro", "druck", "давление", "气压", "気圧", "压力", "压强", "기압"];
/// Names that are the time whatever else they hold …
const TIMES: &[&str] = &[
    "timestamp",
    "time",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "время",
    "时间",
    "時間",
    "时刻",
    "時刻",
    "시간",
    "elapsed",
    "stamp",
];
/// … and those that are it by themselves.
const TIMES_ALONE: &[&str] = &[
    "t", "ts", "s", "sec", "secs", "second", "seconds", "ms", "us", "clock", "date", "datetime", "日期",
    "utc", "epoch",
];
/// The free acceleration lacks gravity, and filtered axes of the world are none of the sensor.
const OTHERS: &[&str] = &[
    "free",
    "linear",
    "user",
    "global",
    "world",
    "earth",
    "bias",
    "offset",
    "magnitude",
    "angularacc",
    "线性",
    "角加速度",
    "lineaire",
    "lineal",
    "accuracy",
];

/// The mapping that the table suggests; `None` where time, rate or force cannot be told.
pub(super) fn suggestion(table: &TableHead) -> Option<Mapping> {
    let columns: Vec<ColumnName> = (0..table.columns.len()).map(|at| column(table, at)).collect();
    let value = first_values(table)?;
    let gyr = rates(&columns)?;
    let acc = forces(&columns).or_else(|| with_gravity_all_the_same(&columns, &value))?;
    let (force, one_is) = match columns[acc[0]].unit.as_str() {
        "g" => (ForceUnit::G, None),
        "mg" => (ForceUnit::Mg, None),
        unit if is_m_s2(unit) => (ForceUnit::MS2, None),
        // At the start of a log the foot stands.
        _ => Looks::of_gravity(length(acc.map(|at| value(at).unwrap_or(f64::NAN))))?.unit(),
    };
    let rate = match columns[gyr[0]].unit.as_str() {
        "deg/s" | "dps" | "degs" => RateUnit::DegS,
        "mdeg/s" | "mdps" => RateUnit::MdegS,
        "rad/s" | "rads" | "弧度/s" => RateUnit::RadS,
        // Counts of the rate are of a size that the table does not tell.
        _ if one_is.is_some() => return None,
        // Who tells forces in g tells rates in degrees; the page asks, and the log's content is checked.
        _ if force != ForceUnit::MS2 => RateUnit::DegS,
        _ => RateUnit::RadS,
    };
    let named = |at: [usize; 3]| at.map(|at| table.columns[at].clone());
    let mag = three(&columns, FIELDS, &['m', 'h', 'b']).map(|at| {
        let unit = match columns[at[0]].unit.as_str() {
            "ut" | "微特" | "微特斯拉" => FieldUnit::Ut,
            "gauss" | "gs" | "g" | "高斯" => FieldUnit::Gauss,
            "mgauss" | "mg" | "mgs" => FieldUnit::Mgauss,
            "nt" => FieldUnit::Nt,
            // The Earth's field.
            "" => match length(at.map(|at| value(at).unwrap_or(f64::NAN))) {
                ut if (20.0..70.0).contains(&ut) => FieldUnit::Ut,
                gauss if (0.2..0.7).contains(&gauss) => FieldUnit::Gauss,
                _ => FieldUnit::Counts,
            },
            _ => FieldUnit::Counts,
        };
        Axes::of(named(at), unit)
    });
    let pressure = columns.iter().position(|column| {
        PRESSURES.iter().any(|word| column.name.contains(word)) && !column.name.contains("altitude")
    });
    let pressure = pressure.and_then(|at| {
        let unit = match columns[at].unit.as_str() {
            "hpa" | "mbar" | "百帕" => PressureUnit::Hpa,
            "pa" | "帕" => PressureUnit::Pa,
            "kpa" | "千帕" => PressureUnit::Kpa,
            "mmhg" | "torr" => PressureUnit::Mmhg,
            _ => air(value(at)?)?,
        };
        Some(Scalar { column: table.columns[at].clone(), unit })
    });
    let (time, unit) = time_of(table, &columns)?;
    let mapping = Mapping {
        delimiter: table.delimiter,
        time: TimeSource { column: Some(table.columns[time].clone()), unit, rate_hz: None, wraps_at: None },
        gyr: Axes::of(named(gyr), rate),
        acc: Axes { columns: named(acc), unit: force, one_is },
        mag,
        pressure,
        skip_rows_without_inertial: false,
    };
    mapping.check().ok()?;
    Some(mapping)
}

/// How many counts gravity is in a table whose names say which columns are the forces, where they look like counts.
pub(super) fn counts_for_g(table: &TableHead) -> Option<u32> {
    let columns: Vec<ColumnName> = (0..table.columns.len()).map(|at| column(table, at)).collect();
    let (value, acc) = (first_values(table)?, forces(&columns)?);
    match Looks::of_gravity(length(acc.map(|at| value(at).unwrap_or(f64::NAN))))? {
        Looks::Counts(counts) => Some(counts),
        _ => None,
    }
}

/// The mapping that a table of numbers without names suggests: a time that grows, forces as long as gravity, rates beside
/// them of a sensor at rest.
pub(super) fn by_content(table: &TableHead, rows: &[Vec<f64>]) -> Option<Mapping> {
    let width = table.columns.len();
    let of = |at: usize| rows.iter().filter_map(move |row| row.get(at)).copied();
    let grows = |at: &usize| {
        let values: Vec<f64> = of(*at).collect();
        values.windows(2).all(|pair| pair[0] <= pair[1]) && values.first() < values.last()
    };
    let time = (0..width).find(grows)?;
    let lengths = |at: usize| -> Vec<f64> {
        rows.iter()
            .filter_map(|row| Some(length([*row.get(at)?, *row.get(at + 1)?, *row.get(at + 2)?])))
            .collect()
    };
    let free = |at: usize| !(at..at + 3).contains(&time) && at + 3 <= width;
    let middle = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let (acc, looks) = (0..width).filter(|at| free(*at)).find_map(|at| {
        let looks = Looks::of_gravity(middle(lengths(at))?)?;
        (looks == Looks::Metres || looks == Looks::G || looks == Looks::Mg).then_some((at, looks))
    })?;
    let (force, one_is) = looks.unit();
    let rate_unit = if looks == Looks::Metres { RateUnit::RadS } else { RateUnit::DegS };
    let at_rest = if looks == Looks::Metres { 0.3 } else { 15.0 };
    let beside = [acc.checked_sub(3), Some(acc + 3)];
    let mut rates = beside
        .into_iter()
        .flatten()
        .filter(|at| free(*at) && middle(lengths(*at)).is_some_and(|length| length < at_rest));
    let gyr = rates.next().filter(|_| rates.next().is_none())?;
    let three = |at: usize| [0, 1, 2].map(|axis| table.columns[at + axis].clone());
    let times: Vec<f64> = of(time).collect();
    let mapping = Mapping {
        delimiter: table.delimiter,
        time: TimeSource {
            column: Some(table.columns[time].clone()),
            unit: by_steps(&times)?,
            rate_hz: None,
            wraps_at: None,
        },
        gyr: Axes::of(three(gyr), rate_unit),
        acc: Axes { columns: three(acc), unit: force, one_is },
        mag: None,
        pressure: None,
        skip_rows_without_inertial: false,
    };
    mapping.check().ok()?;
    Some(mapping)
}

fn column(table: &TableHead, at: usize) -> ColumnName {
    // A row of units stands below the names.
    let below = table.rows.first().and_then(|row| row.get(at)).map_or("", String::as_str);
    ColumnName::of(&table.columns[at], if number(below).is_none() { below } else { "" })
}

/// The numbers of the first row that has enough of them.
fn first_values(table: &TableHead) -> Option<impl Fn(usize) -> Option<f64>> {
    let first =
        table.rows.iter().find(|row| row.iter().filter(|cell| number(cell).is_some()).count() >= 6)?;
    Some(move |at: usize| number(first.get(at)?))
}

fn three(columns: &[ColumnName], words: &[&str], short: &[char]) -> Option<[usize; 3]> {
    let axes = |names: [char; 3]| -> Option<[usize; 3]> {
        let axis = |axis: char| {
            columns.iter().position(|column| {
                !OTHERS.iter().any(|word| column.name.contains(word)) && column.is_axis(words, short, axis)
            })
        };
        Some([axis(names[0])?, axis(names[1])?, axis(names[2])?])
    };
    [['x', 'y', 'z'], ['0', '1', '2'], ['1', '2', '3']].into_iter().find_map(axes)
}

fn rates(columns: &[ColumnName]) -> Option<[usize; 3]> {
    three(columns, RATES, &['g', 'w']).or_else(|| {
        let turn = |name: &str| columns.iter().position(|column| column.name.contains(name));
        let [roll, pitch, yaw] = TURNS.map(turn);
        Some([roll?, pitch?, yaw?])
    })
}

fn forces(columns: &[ColumnName]) -> Option<[usize; 3]> {
    three(columns, FORCES, &['a', 'f'])
}

/// Of what is called linear acceleration, as ROS calls what its sensors measure, where gravity is in it.
fn with_gravity_all_the_same(
    columns: &[ColumnName],
    value: &impl Fn(usize) -> Option<f64>,
) -> Option<[usize; 3]> {
    let called: Vec<ColumnName> = columns
        .iter()
        .map(|column| ColumnName { name: column.name.replace("linear", ""), unit: column.unit.clone() })
        .collect();
    let at = forces(&called)?;
    let looks = Looks::of_gravity(length(at.map(|at| value(at).unwrap_or(f64::NAN))))?;
    matches!(looks, Looks::Metres | Looks::G).then_some(at)
}

fn is_m_s2(unit: &str) -> bool {
    matches!(unit, "m/s2" | "ms2" | "ms-2" | "mps2" | "米/s2" | "m/s/s")
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// The unit in which this is a pressure of the air.
fn air(value: f64) -> Option<PressureUnit> {
    match value {
        hpa if (500.0..1100.0).contains(&hpa) => Some(PressureUnit::Hpa),
        pa if (50_000.0..110_000.0).contains(&pa) => Some(PressureUnit::Pa),
        kpa if (50.0..110.0).contains(&kpa) => Some(PressureUnit::Kpa),
        _ => None,
    }
}

/// The column of the time and its unit: of those that are called so, the first that differs from row to row.
fn time_of(table: &TableHead, columns: &[ColumnName]) -> Option<(usize, TimeUnit)> {
    let is_time = |column: &ColumnName| {
        TIMES_ALONE.contains(&column.name.as_str())
            || TIMES.iter().any(|word| column.name.contains(word))
            || column.name.is_empty() && column.unit == "s"
    };
    let cells = |at: usize| -> Vec<&str> {
        let rows = table.rows.iter().filter_map(|row| row.get(at)).map(|cell| cell.trim());
        rows.filter(|cell| number(cell).is_some() || clock_text::is_time(cell.as_bytes())).collect()
    };
    let named: Vec<usize> =
        (0..columns.len()).filter(|at| is_time(&columns[*at]) && !cells(*at).is_empty()).collect();
    let differs = |at: &&usize| cells(**at).windows(2).all(|pair| pair[0] != pair[1]);
    let at = *named.iter().find(differs).or(named.first())?;
    let cells = cells(at);
    if cells.iter().any(|cell| clock_text::is_time(cell.as_bytes())) {
        return Some((at, TimeUnit::DateTime));
    }
    let said = match (columns[at].unit.as_str(), columns[at].name.as_str()) {
        ("s" | "sec" | "secs" | "second" | "seconds" | "秒", _) => Some(TimeUnit::S),
        ("ms" | "msec" | "毫秒", _) => Some(TimeUnit::Ms),
        ("us" | "usec" | "微秒", _) => Some(TimeUnit::Us),
        ("ns" | "nsec" | "纳秒", _) => Some(TimeUnit::Ns),
        _ => None,
    };
    let times: Vec<f64> = cells.iter().filter_map(|cell| number(cell)).collect();
    Some((at, said.or_else(|| by_steps(&times))?))
}

/// By how far two rows are apart: a sensor on a body has some tens to thousands of rows a second. Where they have one time, by
/// how long ago 1970 was.
fn by_steps(times: &[f64]) -> Option<TimeUnit> {
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let first = *times.first()?;
    Some(match steps.get(steps.len() / 2).copied() {
        // A spreadsheet's date: days since 1900.
        Some(step) if step < 1e-4 && (20_000.0..90_000.0).contains(&first) => TimeUnit::Days,
        Some(step) if step < 0.2 => TimeUnit::S,
        Some(step) if step < 200.0 => TimeUnit::Ms,
        Some(step) if step < 200_000.0 => TimeUnit::Us,
        Some(_) => TimeUnit::Ns,
        None if first > 1e17 => TimeUnit::Ns,
        None if first > 1e14 => TimeUnit::Us,
        None if first > 1e11 => TimeUnit::Ms,
        None if (20_000.0..90_000.0).contains(&first) => TimeUnit::Days,
        None => TimeUnit::S,
    })
}

fn number(cell: &str) -> Option<f64> {
    cell.trim().replace(',', ".").parse().ok()
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
        assert_eq!(plain.gyr, Axes::of(["gx", "gy", "gz"].map(str::to_owned), RateUnit::RadS));
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
    fn names_of_many_loggers_languages_and_units_are_understood() {
        use FieldUnit::{Gauss, Mgauss, Ut};
        use ForceUnit::{G, MS2, Mg};
        use RateUnit::{DegS, MdegS, RadS};
        let row = |t: &str, f: &str| format!("{t},0,0,{f},0,0,0,0,0.3,0.3");
        for (header, f, first, second, time, force, rate, field) in [
            (
                "timestamp_ms,acc_x_mg,acc_y_mg,acc_z_mg,gyro_x_mdps,gyro_y_mdps,gyro_z_mdps,mag_x_mgauss,mag_y_mgauss,mag_z_mgauss",
                "1000",
                "0",
                "10",
                TimeUnit::Ms,
                Mg,
                MdegS,
                Some(Mgauss),
            ),
            (
                "Zeit (s),Beschleunigung x (m/s²),Beschleunigung y (m/s²),Beschleunigung z (m/s²),Drehrate x (rad/s),Drehrate y (rad/s),Drehrate z (rad/s),Magnetfeld x (µT),Magnetfeld y (µT),Magnetfeld z (µT)",
                "9.8",
                "0",
                "0.01",
                TimeUnit::S,
                MS2,
                RadS,
                Some(Ut),
            ),
            (
                "时间戳,X轴加速度(g),Y轴加速度(g),Z轴加速度(g),X轴角速度(°/s),Y轴角速度(°/s),Z轴角速度(°/s),X轴磁场,Y轴磁场,Z轴磁场",
                "1",
                "1764063000000",
                "1764063000010",
                TimeUnit::Ms,
                G,
                DegS,
                Some(Gauss),
            ),
            (
                "epoch,accel[0],accel[1],accel[2],gyro[0],gyro[1],gyro[2],a,b,c",
                "1",
                "1764063000000000",
                "1764063000010000",
                TimeUnit::Us,
                G,
                DegS,
                None,
            ),
            (
                "Temps (ms),Accélération X [m/s^2],Accélération Y [m/s^2],Accélération Z [m/s^2],Vitesse angulaire X [deg/s],Vitesse angulaire Y [deg/s],Vitesse angulaire Z [deg/s],a,b,c",
                "9.8",
                "0",
                "10",
                TimeUnit::Ms,
                MS2,
                DegS,
                None,
            ),
            (
                "date,ax,ay,az,roll rate (deg/sec),pitch rate (deg/sec),yaw rate (deg/sec),bx,by,bz",
                "1",
                "45987.3958333",
                "45987.3958334",
                TimeUnit::Days,
                G,
                DegS,
                Some(Gauss),
            ),
        ] {
            let found = of(header, &[&row(first, f), &row(second, f)]).unwrap_or_else(|| panic!("{header}"));
            let units = (found.time.unit, found.acc.unit, found.gyr.unit, found.mag.map(|mag| mag.unit));
            assert_eq!(units, (time, force, rate, field), "{header}");
        }
    }

    #[test]
    fn numbers_without_names_are_told_by_what_they_are() {
        let text = "0.00 0.01 -0.02 0.01 0.1 0.2 9.8\n0.01 0.01 -0.02 0.01 0.1 0.2 9.8\n0.02 0.01 -0.02 0.01 0.1 0.2 9.8\n";
        let head = crate::parse::table_head::TextHead::read(text.as_bytes(), true).unwrap();
        let (table, rows) = head.headless().unwrap();
        let found = by_content(&table, &rows).unwrap();
        assert_eq!(found.columns(), ["1", "2", "3", "4", "5", "6", "7"]);
        assert_eq!((found.delimiter, found.acc.unit), (Delimiter::Blanks, ForceUnit::MS2));
    }

    #[test]
    fn what_cannot_be_told_is_not_offered() {
        let row = ["0,0.1,0,9.8,0,0,0"];
        assert_eq!(of("a,b,c,d,e,f,g", &row), None);
        assert_eq!(of("t,freeaccx,freeaccy,freeaccz,gx,gy,gz", &row), None);
        assert_eq!(of("t,ax,ay,az,gx,gy,gz", &["0,3,4,4500,0,0,0"]), None, "counts");
    }
}
