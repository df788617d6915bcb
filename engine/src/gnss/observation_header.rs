//! The header of a RINEX observation file: what its columns are.

use super::fixed_columns::{Lines, columns, number, whole};
use super::rinex_error::RinexError;
use super::satellite::Constellation;
use super::time::GPS_MINUS_BEIDOU_S;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Pseudorange.
    Code,
    /// Carrier phase.
    Phase,
    /// Signal strength.
    Strength,
    /// Anything else: Doppler, a channel number, a band that is not used here.
    Other,
}

/// A column of a system's satellites.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// What it holds.
    pub kind: Kind,
    /// Which of the satellite's signals it belongs to: a place in [`Columns::signals`].
    pub signal: usize,
    /// What values are divided by.
    pub scale: f64,
}

/// The columns of one system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// In the order of the file.
    pub columns: Vec<Column>,
    /// Band and way of tracking of each signal.
    pub signals: Vec<(u8, u8)>,
    /// As the header spells them.
    names: Vec<[u8; 3]>,
}

/// The header, as far as it matters.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Times a hundred: 211, 304.
    pub version: u32,
    /// The file's system: `G`, `C`, … or `M` for several.
    pub system: u8,
    /// Columns by system; a file of version 2 has the same for all.
    pub columns: [Columns; 4],
    /// Number of columns of systems that are passed over, as version 2 has its lines by it.
    pub column_count_2: usize,
    /// Position of the marker, Earth-centred, m.
    pub approximate_position_m: Option<[f64; 3]>,
    /// The antenna above, east and north of the marker, m.
    pub antenna_delta_hen_m: [f64; 3],
    /// What is added to the file's time to make it GPS time, s.
    pub to_gps_time_s: i64,
    /// Phases of the second band count half cycles (a receiver that squares the signal).
    pub second_band_half_cycles: bool,
    names_2: Vec<[u8; 3]>,
    continued: Option<usize>,
    scale_of: Option<(usize, f64)>,
}

impl Header {
    /// Reads up to the end of the header.
    ///
    /// # Errors
    ///
    /// Not a RINEX observation file, one whose version is not known, or one without an end of its header.
    pub fn read(lines: &mut Lines<'_>) -> Result<Header, RinexError> {
        let first = lines.next().unwrap_or_default();
        let label = columns(first, 60, 20).trim_ascii();
        if label.starts_with(b"CRINEX") || columns(first, 20, 7) == b"COMPACT" {
            return Err(RinexError::new(
                1,
                "RINEX",
                first,
                "unpack the Hatanaka compression first (crx2rnx)",
            ));
        }
        if !label.starts_with(b"RINEX VERSION") {
            let advice = "give a RINEX observation file, version 2.10 to 4";
            return Err(RinexError::new(1, "RINEX VERSION / TYPE in columns 61 to 80", first, advice));
        }
        if columns(first, 20, 1) != b"O" {
            let advice = "give the observation file here; navigation files belong to --nav";
            return Err(RinexError::new(
                1,
                "type O (observations) in column 21",
                columns(first, 20, 20),
                advice,
            ));
        }
        let version = number(columns(first, 0, 9)).unwrap_or(0.0);
        if !(2.0..5.0).contains(&version) {
            return Err(RinexError::new(
                1,
                "version 2 to 4",
                columns(first, 0, 9),
                "convert the file to RINEX 3.04",
            ));
        }
        let system = match columns(first, 40, 1).first() {
            None | Some(b' ') => b'G',
            Some(letter) => *letter,
        };
        let mut header = Header {
            version: libm::round(version * 100.0) as u32,
            system,
            columns: Default::default(),
            column_count_2: 0,
            approximate_position_m: None,
            antenna_delta_hen_m: [0.0; 3],
            to_gps_time_s: if system == b'C' { GPS_MINUS_BEIDOU_S } else { 0 },
            second_band_half_cycles: false,
            names_2: Vec::new(),
            continued: None,
            scale_of: None,
        };
        loop {
            let Some(line) = lines.next() else {
                let advice = "the file is cut off; copy it again";
                return Err(RinexError::new(lines.number().max(1), "END OF HEADER", b"", advice));
            };
            if columns(line, 60, 20).starts_with(b"END OF HEADER") {
                break;
            }
            header.take(line);
        }
        header.finish();
        Ok(header)
    }

    /// Takes one line of the header, or of an event that changes it; labels that do not matter are passed over.
    pub fn take(&mut self, line: &[u8]) {
        let label = columns(line, 60, 20).trim_ascii();
        match label {
            b"SYS / # / OBS TYPES" => self.take_types_3(line),
            b"# / TYPES OF OBSERV" => self.take_types_2(line),
            b"SYS / SCALE FACTOR" => self.take_scale(line),
            b"APPROX POSITION XYZ" => {
                let xyz = [0, 14, 28].map(|start| number(columns(line, start, 14)).unwrap_or(0.0));
                // All zeros stand for a position that is not known.
                self.approximate_position_m = (xyz.iter().map(|x| x * x).sum::<f64>() > 1e12).then_some(xyz);
            }
            b"ANTENNA: DELTA H/E/N" => {
                self.antenna_delta_hen_m =
                    [0, 14, 28].map(|start| number(columns(line, start, 14)).unwrap_or(0.0));
            }
            // Lines with satellites' names change single ones; receivers of that kind do so for none.
            b"WAVELENGTH FACT L1/2" if whole(columns(line, 12, 6)).unwrap_or(0) == 0 => {
                self.second_band_half_cycles = whole(columns(line, 6, 6)) == Some(2);
            }
            b"TIME OF FIRST OBS" => match columns(line, 48, 3) {
                b"BDT" | b"BDS" => self.to_gps_time_s = GPS_MINUS_BEIDOU_S,
                b"GPS" | b"GAL" | b"QZS" => self.to_gps_time_s = 0,
                _ => {}
            },
            _ => {}
        }
    }

    fn take_types_3(&mut self, line: &[u8]) {
        let letter = line.first().copied().unwrap_or(b' ');
        if letter != b' ' {
            self.continued = Constellation::from_letter(letter).map(Constellation::index);
            if let Some(system) = self.continued {
                self.columns[system] = Columns::default();
            }
        }
        let Some(system) = self.continued else { return };
        let count =
            if letter == b' ' { usize::MAX } else { whole(columns(line, 3, 3)).unwrap_or(0).max(0) as usize };
        let known = self.columns[system].names.len();
        for k in 0..13.min(count.saturating_sub(known)) {
            let name = columns(line, 7 + 4 * k, 3);
            if name.trim_ascii().is_empty() {
                break;
            }
            self.columns[system].names.push(padded(name));
        }
        self.finish_system(system);
    }

    fn take_types_2(&mut self, line: &[u8]) {
        if whole(columns(line, 0, 6)).is_some() {
            self.names_2.clear();
        }
        for k in 0..9 {
            let name = columns(line, 10 + 6 * k, 2).trim_ascii();
            if !name.is_empty() {
                self.names_2.push(padded(name));
            }
        }
        self.column_count_2 = self.names_2.len();
        for system in 0..4 {
            self.columns[system].names.clone_from(&self.names_2);
            self.finish_system(system);
        }
    }

    fn take_scale(&mut self, line: &[u8]) {
        let letter = line.first().copied().unwrap_or(b' ');
        if letter != b' ' {
            let factor = f64::from(whole(columns(line, 2, 4)).unwrap_or(1).max(1));
            self.scale_of = Constellation::from_letter(letter).map(|system| (system.index(), factor));
            if let Some((system, factor)) = self.scale_of
                && whole(columns(line, 8, 2)).unwrap_or(0) == 0
            {
                self.columns[system].columns.iter_mut().for_each(|column| column.scale = factor);
            }
        }
        let Some((system, factor)) = self.scale_of else { return };
        for k in 0..12 {
            let name = padded(columns(line, 11 + 4 * k, 3));
            let columns = &mut self.columns[system];
            if let Some(place) = columns.names.iter().position(|known| *known == name) {
                columns.columns[place].scale = factor;
            }
        }
    }

    fn finish(&mut self) {
        self.continued = None;
        self.scale_of = None;
    }

    fn finish_system(&mut self, system: usize) {
        let constellation = Constellation::ALL[system];
        let version = self.version;
        let columns = &mut self.columns[system];
        columns.signals.clear();
        columns.columns.clear();
        for &name in &columns.names {
            let meaning = if version < 300 {
                meaning_2(constellation, name)
            } else {
                meaning_3(constellation, name, version)
            };
            let (kind, signal) = match meaning {
                Some((kind, band, attribute)) => {
                    let place = columns.signals.iter().position(|known| *known == (band, attribute));
                    let place = place.unwrap_or_else(|| {
                        columns.signals.push((band, attribute));
                        columns.signals.len() - 1
                    });
                    (kind, place)
                }
                None => (Kind::Other, 0),
            };
            columns.columns.push(Column { kind, signal, scale: 1.0 });
        }
    }
}

fn padded(name: &[u8]) -> [u8; 3] {
    let mut padded = [b' '; 3];
    for (to, from) in padded.iter_mut().zip(name) {
        *to = *from;
    }
    padded
}

fn kind_of(letter: u8) -> Option<Kind> {
    match letter {
        b'C' | b'P' => Some(Kind::Code),
        b'L' => Some(Kind::Phase),
        b'S' => Some(Kind::Strength),
        _ => None,
    }
}

/// Version 3: `C1C`. The second band of BeiDou (B1I) was spelt `1I` in 3.02.
fn meaning_3(constellation: Constellation, name: [u8; 3], version: u32) -> Option<(Kind, u8, u8)> {
    let kind = kind_of(name[0])?;
    let mut band = name[1].checked_sub(b'0')?;
    let mut attribute = name[2];
    if constellation == Constellation::Beidou
        && band == 1
        && (version <= 302 || matches!(attribute, b'I' | b'Q'))
    {
        band = 2;
    }
    // 3.01 and 3.00 have no attribute for some.
    if attribute == b' ' {
        attribute = b'C';
    }
    super::signal::frequency_hz(constellation, band)?;
    Some((kind, band, attribute))
}

/// Version 2: `L1`, `C1`, `P2`. The phase of a band belongs to the code that receivers of that time put beside it.
fn meaning_2(constellation: Constellation, name: [u8; 3]) -> Option<(Kind, u8, u8)> {
    let kind = kind_of(name[0])?;
    let mut band = name[1].checked_sub(b'0')?;
    if constellation == Constellation::Beidou && band == 1 {
        band = 2;
    }
    super::signal::frequency_hz(constellation, band)?;
    let attribute = match (constellation, band, name[0]) {
        (Constellation::Gps, 1, b'P') => b'P',
        (Constellation::Gps, 2, b'C') => b'X',
        (Constellation::Gps, 2, _) => b'W',
        (Constellation::Gps, 1, _) => b'C',
        (Constellation::Beidou, ..) => b'I',
        _ => b'X',
    };
    Some((kind, band, attribute))
}
