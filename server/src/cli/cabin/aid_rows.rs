//! Rows of antennas, stations and encoders, as tables become rows of the engine. A value that no device of a cabin can have is
//! left out with its row; where none of a file's first rows can be, its unit is another, and the file is refused.

use std::ops::RangeInclusive;

use lodestep_engine::parse::imu_csv::ImuCsv;
use lodestep_engine::parse::named_csv::{NameColumn, NamedCsv, NamedRow, NamedTable};
use lodestep_engine::parse::{ParseError, ParseErrorKind};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::cabin::Instrument;
use lodestep_engine::systems::cabin::rows::{AidRow, AntennaRow, EncoderRow, ImuRow, RayRow};

use super::row_file::RowParser;

/// So many rows, all of them impossible, are a file in other units.
const ALL_WRONG: u64 = 12;

/// A kind of file.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Antennas,
    Stations,
    Encoders,
}

/// Makes rows of one kind of file.
pub(super) struct AidParser {
    kind: Kind,
    csv: NamedCsv,
    tables: Vec<NamedRow>,
    good: u64,
    /// Rows that were left out: how many, the first and last of them, ns, and what was wrong with the first.
    pub(super) left_out: Option<LeftOut>,
}

#[derive(Clone, Debug)]
pub(super) struct LeftOut {
    pub(super) count: u64,
    pub(super) from_ns: i64,
    pub(super) to_ns: i64,
    pub(super) why: String,
}

const ANTENNA: [&str; 7] = ["e_m", "n_m", "u_m", "sigma_e_m", "sigma_n_m", "sigma_u_m", "quality"];
const RAY: [&str; 3] = ["azimuth_rad", "zenith_rad", "slant_m"];
const ENCODERS: [&str; 8] =
    ["a_rad", "b_rad", "leg_1_m", "leg_2_m", "leg_3_m", "leg_4_m", "leg_5_m", "leg_6_m"];

impl AidParser {
    pub(super) fn new(kind: Kind, instrument: &Instrument) -> AidParser {
        let column = |name, known: &[String]| NameColumn { name, known: known.to_vec() };
        let table = match kind {
            Kind::Antennas => NamedTable {
                names: vec![column("antenna", &instrument.antennas.names)],
                numbers: &ANTENNA,
                optional: &["ve_m_s", "vn_m_s", "vu_m_s"],
            },
            Kind::Stations => NamedTable {
                names: vec![
                    column("station", &instrument.stations.names),
                    column("target", &instrument.target_names()),
                ],
                numbers: &RAY,
                optional: &[],
            },
            Kind::Encoders => NamedTable { names: Vec::new(), numbers: &ENCODERS, optional: &[] },
        };
        AidParser { kind, csv: NamedCsv::new(table), tables: Vec::new(), good: 0, left_out: None }
    }

    fn convert(&mut self, rows: &mut Vec<AidRow>) -> Result<(), ParseError> {
        for row in std::mem::take(&mut self.tables) {
            match impossible(self.kind, &row) {
                None => {
                    self.good += 1;
                    rows.push(made(self.kind, &row));
                }
                Some((column, expected)) => self.leave_out(&row, column, expected)?,
            }
        }
        Ok(())
    }

    fn leave_out(&mut self, row: &NamedRow, column: usize, expected: &str) -> Result<(), ParseError> {
        let name = self.numbers()[column];
        let found = row.values[column];
        let left = self.left_out.get_or_insert_with(|| LeftOut {
            count: 0,
            from_ns: row.t_ns,
            to_ns: row.t_ns,
            why: format!("{name}: expected {expected}, found {found}"),
        });
        left.count += 1;
        left.to_ns = row.t_ns;
        if left.count < ALL_WRONG || left.count <= self.good {
            return Ok(());
        }
        Err(ParseError {
            kind: ParseErrorKind::OutOfRange,
            line: None,
            column: Some(name.to_owned()),
            expected: expected.to_owned(),
            found: format!("{found} at {} s, and more such rows than others", row.t_ns as f64 * 1e-9),
            advice:
                "check the column's unit: gon or degrees instead of radians, millimetres instead of metres"
                    .to_owned(),
        })
    }

    fn numbers(&self) -> &'static [&'static str] {
        match self.kind {
            Kind::Antennas => &ANTENNA,
            Kind::Stations => &RAY,
            Kind::Encoders => &ENCODERS,
        }
    }
}

impl RowParser for AidParser {
    type Row = AidRow;

    fn push(&mut self, bytes: &[u8], rows: &mut Vec<AidRow>) -> Result<(), ParseError> {
        self.csv.push(bytes, &mut self.tables)?;
        self.convert(rows)
    }

    fn finish(&mut self, rows: &mut Vec<AidRow>) -> Result<(), ParseError> {
        self.csv.finish(&mut self.tables)?;
        self.convert(rows)
    }

    fn t_ns(row: &AidRow) -> i64 {
        row.t_ns()
    }
}

/// The first number of a row that cannot be, by its column, and what was expected.
fn impossible(kind: Kind, row: &NamedRow) -> Option<(usize, &'static str)> {
    const METRES: (RangeInclusive<f64>, &str) = (-5000.0..=5000.0, "metres from the site's origin");
    let limits = |column: usize| -> (RangeInclusive<f64>, &'static str) {
        match (kind, column) {
            (Kind::Antennas, 0..3) => METRES,
            (Kind::Antennas, 3..6) => (1e-5..=100.0, "a sigma in metres"),
            (Kind::Antennas, _) => (0.0..=9.0, "a quality such as 4 (fixed) or 5 (float)"),
            (Kind::Stations, 0) => (-6.284..=6.284, "an azimuth in radians"),
            (Kind::Stations, 1) => (0.0..=std::f64::consts::PI, "a zenith angle in radians, from 0 to π"),
            (Kind::Stations, _) => (1.0..=5000.0, "a distance in metres"),
            (Kind::Encoders, 0..2) => (-0.8..=0.8, "an angle of the rotator in radians, within 0.8"),
            (Kind::Encoders, _) => (0.1..=20.0, "the length of a leg in metres"),
        }
    };
    let columns = match kind {
        Kind::Antennas => 7,
        Kind::Stations => 3,
        Kind::Encoders => 8,
    };
    (0..columns).find_map(|column| {
        let (range, expected) = limits(column);
        (!range.contains(&row.values[column])).then_some((column, expected))
    })
}

fn made(kind: Kind, row: &NamedRow) -> AidRow {
    let v = &row.values;
    let t_ns = row.t_ns;
    match kind {
        Kind::Antennas => AidRow::Antenna(AntennaRow {
            t_ns,
            antenna: row.names[0],
            position_n: [v[0], v[1], v[2]],
            sigma_n: [v[3], v[4], v[5]],
            quality: v[6] as u8,
            velocity_n: Some([v[7], v[8], v[9]]).filter(|v| v.iter().all(|x| x.is_finite())),
        }),
        Kind::Stations => AidRow::Ray(RayRow {
            t_ns,
            station: row.names[0],
            target: row.names[1],
            azimuth_rad: v[0],
            zenith_rad: v[1],
            slant_m: v[2],
        }),
        Kind::Encoders => AidRow::Encoders(EncoderRow {
            t_ns,
            a_rad: v[0],
            b_rad: v[1],
            legs_m: std::array::from_fn(|leg| v[2 + leg]),
        }),
    }
}

/// Canonical logs of inertial sensors.
#[derive(Default)]
pub(super) struct ImuParser {
    csv: ImuCsv,
    samples: Vec<ImuSample>,
}

impl ImuParser {
    fn convert(&mut self, rows: &mut Vec<ImuRow>) {
        rows.extend(self.samples.drain(..).map(|sample| ImuRow {
            t_ns: sample.t_ns,
            w_s: sample.w_ib_b_rad_s,
            f_s: sample.f_b_m_s2,
        }));
    }
}

impl RowParser for ImuParser {
    type Row = ImuRow;

    fn push(&mut self, bytes: &[u8], rows: &mut Vec<ImuRow>) -> Result<(), ParseError> {
        self.csv.push(bytes, &mut self.samples)?;
        self.convert(rows);
        Ok(())
    }

    fn finish(&mut self, rows: &mut Vec<ImuRow>) -> Result<(), ParseError> {
        self.csv.finish(&mut self.samples)?;
        self.convert(rows);
        Ok(())
    }

    fn t_ns(row: &ImuRow) -> i64 {
        row.t_ns
    }
}
