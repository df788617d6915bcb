//! Rows of a device's log, checked one by one: a number that no such device can have leaves its row out, and where most of a log is
//! so, its unit is another and the log is refused.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::causes::CabinCause;
use super::instrument::Instrument;
use super::rows::{AidRow, AntennaRow, EncoderRow, RayRow};
use super::watch::CabinAnomaly;
use crate::parse::name_number;
use crate::system::Column;

/// So many rows, all of them impossible, are a log in other units.
const ALL_WRONG: u64 = 12;

/// Which devices write a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Device {
    /// Antennas.
    Antennas,
    /// Total stations.
    Stations,
    /// Encoders of rotator and legs.
    Encoders,
}

const fn column(name: &'static str, required: bool, about: &'static str) -> Column {
    Column { name, required, about }
}

/// Columns of an antenna's fixes.
pub(super) const ANTENNA_COLUMNS: &[Column] = &[
    column(
        "antenna",
        true,
        "Its name in files; streamed, its place in the instrument's list from 1, or its name as docs/cabin.md packs it.",
    ),
    column("e_m", true, "East of the site's origin, m."),
    column("n_m", true, "North, m."),
    column("u_m", true, "Up, m."),
    column("sigma_e_m", true, "Sigma east, m."),
    column("sigma_n_m", true, "Sigma north, m."),
    column("sigma_u_m", true, "Sigma up, m."),
    column("quality", true, "4 fixed, 5 float."),
    column("ve_m_s", false, "Velocity east by Doppler, m/s."),
    column("vn_m_s", false, "Velocity north, m/s."),
    column("vu_m_s", false, "Velocity up, m/s."),
];

/// Columns of a station's rays.
pub(super) const STATION_COLUMNS: &[Column] = &[
    column("station", true, "Its name, as for an antenna."),
    column(
        "target",
        true,
        "The prism's name; streamed also its place among those of cabin and then platform.",
    ),
    column("azimuth_rad", true, "Clockwise from north, rad."),
    column("zenith_rad", true, "From straight up, rad."),
    column("slant_m", true, "Distance, m."),
];

/// Columns of the encoders.
pub(super) const ENCODER_COLUMNS: &[Column] = &[
    column("a_rad", true, "First angle of the rotator, rad."),
    column("b_rad", true, "Second angle, rad."),
    column("leg_1_m", true, "Length of a leg, m."),
    column("leg_2_m", true, "Length, m."),
    column("leg_3_m", true, "Length, m."),
    column("leg_4_m", true, "Length, m."),
    column("leg_5_m", true, "Length, m."),
    column("leg_6_m", true, "Length, m."),
];

impl Device {
    /// The devices' name.
    pub fn name(self) -> &'static str {
        match self {
            Device::Antennas => "antennas",
            Device::Stations => "stations",
            Device::Encoders => "encoders",
        }
    }

    /// The columns of its rows.
    pub fn columns(self) -> &'static [Column] {
        match self {
            Device::Antennas => ANTENNA_COLUMNS,
            Device::Stations => STATION_COLUMNS,
            Device::Encoders => ENCODER_COLUMNS,
        }
    }

    /// Columns of names come first.
    fn names(self) -> usize {
        match self {
            Device::Antennas => 1,
            Device::Stations => 2,
            Device::Encoders => 0,
        }
    }
}

/// Why a log is refused: most of its rows have a number that cannot be.
#[derive(Clone, Debug, PartialEq)]
pub struct Impossible {
    /// In which column.
    pub column: &'static str,
    /// What was expected there.
    pub expected: &'static str,
    /// What was found.
    pub found: f64,
    /// When, ns.
    pub t_ns: i64,
}

impl Impossible {
    /// What to do.
    pub const ADVICE: &'static str =
        "check the column's unit: gon or degrees instead of radians, millimetres instead of metres";

    /// In a sentence.
    pub fn sentence(&self, device: Device) -> String {
        format!(
            "{}, column {}: expected {}, found {} at {} s, and more such rows than others; {}",
            device.name(),
            self.column,
            self.expected,
            self.found,
            self.t_ns as f64 * 1e-9,
            Impossible::ADVICE
        )
    }
}

/// One log's rows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Intake {
    device: Device,
    names: [Vec<String>; 2],
    good: u64,
    left_out: Option<([i64; 2], u64, CabinCause)>,
    unknown: Option<([i64; 2], u64, String)>,
    unordered: Option<([i64; 2], u64)>,
    latest_ns: i64,
}

impl Intake {
    /// Before the first row.
    pub fn new(device: Device, instrument: &Instrument) -> Intake {
        let names = match device {
            Device::Antennas => [instrument.antennas.names.clone(), Vec::new()],
            Device::Stations => [instrument.stations.names.clone(), instrument.target_names()],
            Device::Encoders => [Vec::new(), Vec::new()],
        };
        Intake { device, names, good: 0, left_out: None, unknown: None, unordered: None, latest_ns: i64::MIN }
    }

    /// Takes a row: values in the order of the device's columns. `None` where it is left out.
    ///
    /// # Errors
    ///
    /// When most rows so far cannot be of such a device.
    pub fn take(&mut self, t_ns: i64, values: &[f64]) -> Result<Option<AidRow>, Impossible> {
        let mut places = [0; 2];
        for (column, place) in places.iter_mut().enumerate().take(self.device.names()) {
            let value = values.get(column).copied().unwrap_or(f64::NAN);
            match self.place(column, value) {
                Some(found) => *place = found,
                None => {
                    let what = self.device.columns()[column].name;
                    let found = name_number::name(value).unwrap_or_else(|| value.to_string());
                    let known = self.unknown.get_or_insert(([t_ns; 2], 0, format!("{what} {found}")));
                    known.0[1] = t_ns;
                    known.1 += 1;
                    return Ok(None);
                }
            }
        }
        let numbers = values.get(self.device.names()..).unwrap_or_default();
        if let Some((column, expected)) = impossible(self.device, numbers) {
            let name = self.device.columns()[self.device.names() + column].name;
            self.leave_out(t_ns, name, expected, numbers.get(column).copied().unwrap_or(f64::NAN))?;
            return Ok(None);
        }
        self.good += 1;
        if t_ns < self.latest_ns {
            let (ends, rows) = self.unordered.get_or_insert(([t_ns; 2], 0));
            *ends = [ends[0].min(t_ns), ends[1].max(t_ns)];
            *rows += 1;
        }
        self.latest_ns = self.latest_ns.max(t_ns);
        Ok(Some(made(self.device, t_ns, places, numbers)))
    }

    /// A device by its place in the list, counted from 1, or by its name.
    fn place(&self, column: usize, value: f64) -> Option<usize> {
        let names = &self.names[column];
        if value < name_number::FIRST_NAME {
            let in_list = value >= 1.0 && value <= names.len() as f64 && value.fract() == 0.0;
            return in_list.then(|| value as usize - 1);
        }
        let name = name_number::name(value)?;
        names.iter().position(|known| *known == name)
    }

    fn leave_out(
        &mut self,
        t_ns: i64,
        column: &'static str,
        expected: &'static str,
        found: f64,
    ) -> Result<(), Impossible> {
        let first = || {
            (
                [t_ns; 2],
                0,
                CabinCause::BadRows { rows: 0, column: column.into(), expected: expected.into(), found },
            )
        };
        let left = self.left_out.get_or_insert_with(first);
        left.0[1] = t_ns;
        left.1 += 1;
        if left.1 < ALL_WRONG || left.1 <= self.good {
            return Ok(());
        }
        Err(Impossible { column, expected, found, t_ns })
    }

    /// Which kinds of trouble there have been: rows out of order, impossible ones, and unknown devices.
    pub(super) fn troubles(&self) -> [bool; 3] {
        [self.unordered.is_some(), self.left_out.is_some(), self.unknown.is_some()]
    }

    /// The first device that the instrument does not have, where there is one.
    pub fn unknown(&self) -> Option<&str> {
        self.unknown.as_ref().map(|(_, _, found)| found.as_str())
    }

    /// What was wrong with the log itself.
    pub fn anomalies(&self) -> Vec<CabinAnomaly> {
        let of = |cause, ends_ns| CabinAnomaly::new(self.device.name(), cause, ends_ns);
        let unordered = self.unordered.map(|(ends_ns, rows)| of(CabinCause::Unordered { rows }, ends_ns));
        let left_out = self.left_out.as_ref().map(|(ends_ns, rows, first)| {
            let mut cause = first.clone();
            if let CabinCause::BadRows { rows: counted, .. } = &mut cause {
                *counted = *rows;
            }
            of(cause, *ends_ns)
        });
        let unknown = self.unknown.as_ref().map(|(ends_ns, rows, found)| {
            of(CabinCause::Unknown { rows: *rows, found: found.clone() }, *ends_ns)
        });
        [unordered, left_out, unknown].into_iter().flatten().collect()
    }
}

/// The first number that cannot be, by its place behind the names, and what was expected.
fn impossible(device: Device, numbers: &[f64]) -> Option<(usize, &'static str)> {
    const METRES: (RangeInclusive<f64>, &str) = (-5000.0..=5000.0, "metres from the site's origin");
    let limits = |column: usize| -> (RangeInclusive<f64>, &'static str) {
        match (device, column) {
            (Device::Antennas, 0..3) => METRES,
            (Device::Antennas, 3..6) => (1e-5..=100.0, "a sigma in metres"),
            (Device::Antennas, _) => (0.0..=9.0, "a quality such as 4 (fixed) or 5 (float)"),
            (Device::Stations, 0) => (-6.284..=6.284, "an azimuth in radians"),
            (Device::Stations, 1) => (0.0..=std::f64::consts::PI, "a zenith angle in radians, from 0 to π"),
            (Device::Stations, _) => (1.0..=5000.0, "a distance in metres"),
            (Device::Encoders, 0..2) => (-0.8..=0.8, "an angle of the rotator in radians, within 0.8"),
            (Device::Encoders, _) => (0.1..=20.0, "the length of a leg in metres"),
        }
    };
    let columns = match device {
        Device::Antennas => 7,
        Device::Stations => 3,
        Device::Encoders => 8,
    };
    (0..columns).find_map(|column| {
        let (range, expected) = limits(column);
        let possible = numbers.get(column).is_some_and(|number| range.contains(number));
        (!possible).then_some((column, expected))
    })
}

/// A row of numbers that can be.
fn made(device: Device, t_ns: i64, places: [usize; 2], v: &[f64]) -> AidRow {
    let at = |column: usize| v.get(column).copied().unwrap_or(f64::NAN);
    match device {
        Device::Antennas => AidRow::Antenna(AntennaRow {
            t_ns,
            antenna: places[0],
            position_n: [at(0), at(1), at(2)],
            sigma_n: [at(3), at(4), at(5)],
            quality: at(6) as u8,
            velocity_n: Some([at(7), at(8), at(9)]).filter(|v| v.iter().all(|x| x.is_finite())),
        }),
        Device::Stations => AidRow::Ray(RayRow {
            t_ns,
            station: places[0],
            target: places[1],
            azimuth_rad: at(0),
            zenith_rad: at(1),
            slant_m: at(2),
        }),
        Device::Encoders => AidRow::Encoders(EncoderRow {
            t_ns,
            a_rad: at(0),
            b_rad: at(1),
            legs_m: std::array::from_fn(|leg| at(2 + leg)),
        }),
    }
}
