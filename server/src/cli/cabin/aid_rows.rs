//! Rows of antennas, stations and encoders, as tables become rows of the engine.

use lodestep_engine::parse::imu_csv::ImuCsv;
use lodestep_engine::parse::named_csv::{NameColumn, NamedCsv, NamedRow, NamedTable};
use lodestep_engine::parse::{ParseError, ParseErrorKind};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::cabin::Instrument;
use lodestep_engine::systems::cabin::intake::{Device, Impossible, Intake};
use lodestep_engine::systems::cabin::rows::{AidRow, ImuRow};

use super::row_file::RowParser;

/// Makes rows of one kind of file.
pub(super) struct AidParser {
    csv: NamedCsv,
    tables: Vec<NamedRow>,
    /// Checks them one by one.
    pub(super) intake: Intake,
}

impl AidParser {
    pub(super) fn new(device: Device, instrument: &Instrument) -> AidParser {
        let known = match device {
            Device::Antennas => vec![instrument.antennas.names.clone()],
            Device::Stations => vec![instrument.stations.names.clone(), instrument.target_names()],
            Device::Encoders => Vec::new(),
        };
        let columns = device.columns();
        let (named, numbers) = columns.split_at(known.len());
        let names = named.iter().zip(known).map(|(column, known)| NameColumn { name: column.name, known });
        let of = |required| {
            numbers.iter().filter(|column| column.required == required).map(|column| column.name).collect()
        };
        let table = NamedTable { names: names.collect(), numbers: of(true), optional: of(false) };
        AidParser { csv: NamedCsv::new(table), tables: Vec::new(), intake: Intake::new(device, instrument) }
    }

    fn convert(&mut self, rows: &mut Vec<AidRow>) -> Result<(), ParseError> {
        for row in std::mem::take(&mut self.tables) {
            // Devices by their places in the instrument's lists, counted from 1.
            let places = row.names.iter().map(|place| *place as f64 + 1.0);
            let values: Vec<f64> = places.chain(row.values.iter().copied()).collect();
            rows.extend(self.intake.take(row.t_ns, &values).map_err(other_unit)?);
        }
        Ok(())
    }
}

fn other_unit(impossible: Impossible) -> ParseError {
    let Impossible { column, expected, found, t_ns } = impossible;
    ParseError {
        kind: ParseErrorKind::OutOfRange,
        line: None,
        column: Some(column.to_owned()),
        expected: expected.to_owned(),
        found: format!("{found} at {} s, and more such rows than others", t_ns as f64 * 1e-9),
        advice: Impossible::ADVICE.to_owned(),
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
