//! RINEX navigation files of versions 2.10 to 4, bytes to ephemerides.

use super::ephemeris::{Ephemeris, Navigation};
use super::fixed_columns::{Lines, columns, number, of_century, whole};
use super::rinex_error::RinexError;
use super::satellite::{Constellation, Satellite};
use super::time::{GPS_MINUS_BEIDOU_S, GpsTime};

/// Reads a navigation file.
///
/// # Errors
///
/// What is no RINEX navigation file. A file without an ephemeris is no error: another may hold it.
pub fn read(bytes: &[u8]) -> Result<Navigation, RinexError> {
    let mut lines = Lines::new(bytes);
    let first = lines.next().unwrap_or_default();
    if !columns(first, 60, 20).starts_with(b"RINEX VERSION") {
        let advice = "give a RINEX navigation file, version 2.10 to 4";
        return Err(RinexError::new(1, "RINEX VERSION / TYPE in columns 61 to 80", first, advice));
    }
    let version = number(columns(first, 0, 9)).unwrap_or(0.0);
    let kind = columns(first, 20, 1).first().copied().unwrap_or(b' ');
    if !(2.0..5.0).contains(&version) {
        return Err(RinexError::new(
            1,
            "version 2 to 4",
            columns(first, 0, 9),
            "convert the file to RINEX 3.04",
        ));
    }
    if kind == b'O' || !(kind == b'N' || (version < 3.0 && matches!(kind, b'G' | b'H' | b'E' | b'C' | b'J')))
    {
        let advice = "give the navigation file here; observations belong to --rover and --base";
        return Err(RinexError::new(1, "type N (navigation) in column 21", columns(first, 20, 20), advice));
    }
    let mut found = Navigation::default();
    header(&mut lines, &mut found)?;
    // Version 2 has a letter for the file instead of one for each satellite; G is GLONASS there, and passed over.
    let system = if version >= 3.0 {
        None
    } else {
        Some(match kind {
            b'E' => b'E',
            b'C' => b'C',
            b'J' => b'J',
            b'N' => b'G',
            _ => return Ok(found),
        })
    };
    records(&mut lines, system, &mut found);
    Ok(found)
}

fn header(lines: &mut Lines<'_>, found: &mut Navigation) -> Result<(), RinexError> {
    let (mut alpha, mut beta) = (None, None);
    loop {
        let Some(line) = lines.next() else {
            let advice = "the file is cut off; copy it again";
            return Err(RinexError::new(lines.number().max(1), "END OF HEADER", b"", advice));
        };
        let four = |start: usize| -> Option<[f64; 4]> {
            let mut values = [0.0; 4];
            for (k, value) in values.iter_mut().enumerate() {
                *value = number(columns(line, start + 12 * k, 12))?;
            }
            Some(values)
        };
        let label = columns(line, 60, 20).trim_ascii();
        match label {
            b"END OF HEADER" => break,
            b"ION ALPHA" => alpha = four(2),
            b"ION BETA" => beta = four(2),
            b"IONOSPHERIC CORR" if line.starts_with(b"GPSA") => alpha = four(5),
            b"IONOSPHERIC CORR" if line.starts_with(b"GPSB") => beta = four(5),
            _ => {}
        }
    }
    if let (Some([a0, a1, a2, a3]), Some([b0, b1, b2, b3])) = (alpha, beta) {
        found.klobuchar = Some([a0, a1, a2, a3, b0, b1, b2, b3]);
    }
    Ok(())
}

fn records(lines: &mut Lines<'_>, system: Option<u8>, found: &mut Navigation) {
    let indent = if system.is_some() { 3 } else { 4 };
    let mut damaged = 0;
    while let Some(line) = lines.next() {
        // Version 4 names each message before it; those that are no ephemeris have no satellite at the line's beginning.
        if line.starts_with(b"> ") {
            continue;
        }
        let satellite = match system {
            Some(letter) => {
                let mut name = [letter, b' ', b' '];
                name[1..1 + columns(line, 0, 2).len()].copy_from_slice(columns(line, 0, 2));
                (!columns(line, 0, 2).trim_ascii().is_empty())
                    .then(|| Satellite::read(&name, letter))
                    .flatten()
            }
            None => line
                .first()
                .filter(|byte| byte.is_ascii_uppercase())
                .and_then(|_| Satellite::read(columns(line, 0, 3), b'G')),
        };
        let Some(satellite) = satellite else { continue };
        let mut fields = [None; 32];
        read_fields(line, indent, &mut fields[..4]);
        let mut rows = 1;
        while rows < 8 {
            // The next satellite's line has its name where this one's have blanks.
            let follows =
                lines.peek().is_some_and(|next| columns(next, 0, indent - 1).trim_ascii().is_empty());
            if !follows {
                break;
            }
            let Some(next) = lines.next() else { break };
            read_fields_of_row(next, indent, &mut fields[4 * rows..4 * rows + 4]);
            rows += 1;
        }
        match (rows >= 7).then(|| ephemeris(satellite, line, system.is_some(), &fields)).flatten() {
            Some(one) => found.ephemerides.push(one),
            None => damaged += 1,
        }
    }
    if damaged > 0 {
        found
            .notes
            .push(format!("{damaged} ephemerides of the navigation file are incomplete, and are dropped"));
    }
}

/// The three clock terms of a satellite's first line, behind the date.
fn read_fields(line: &[u8], indent: usize, fields: &mut [Option<f64>]) {
    for (k, field) in fields.iter_mut().enumerate().skip(1) {
        *field = number(columns(line, indent + 19 * k, 19));
    }
}

fn read_fields_of_row(line: &[u8], indent: usize, fields: &mut [Option<f64>]) {
    for (k, field) in fields.iter_mut().enumerate() {
        *field = number(columns(line, indent + 19 * k, 19));
    }
}

/// The time of the clock on a satellite's first line.
fn clock_time(satellite: Satellite, line: &[u8], version_2: bool) -> Option<GpsTime> {
    let starts: [(usize, usize); 6] = if version_2 {
        [(2, 3), (5, 3), (8, 3), (11, 3), (14, 3), (17, 5)]
    } else {
        [(3, 5), (8, 3), (11, 3), (14, 3), (17, 3), (20, 3)]
    };
    let mut parts = [0_i16; 5];
    for (part, (start, width)) in parts.iter_mut().zip(starts) {
        *part = whole(columns(line, start, width))?;
    }
    parts[0] = of_century(parts[0]);
    let second = number(columns(line, starts[5].0, starts[5].1))?;
    let offset_s = if satellite.constellation == Constellation::Beidou { GPS_MINUS_BEIDOU_S } else { 0 };
    GpsTime::from_date(parts, second, offset_s)
}

fn ephemeris(
    satellite: Satellite,
    line: &[u8],
    version_2: bool,
    fields: &[Option<f64>; 32],
) -> Option<Ephemeris> {
    let toc = clock_time(satellite, line, version_2)?;
    let offset =
        if satellite.constellation == Constellation::Beidou { GPS_MINUS_BEIDOU_S as f64 } else { 0.0 };
    // The week that is written may be counted in several ways; the clock's date says which one is meant.
    let toe = toc + near_week(fields[12]? + offset - toc.tow_s());
    let sqrt_a = fields[11]?;
    let eccentricity = fields[9]?;
    if !(4000.0..8000.0).contains(&sqrt_a) || !(0.0..0.5).contains(&eccentricity) {
        return None;
    }
    let health = fields[25].unwrap_or(0.0) as i64;
    // QZSS: bit 0 speaks of a signal that is not used here.
    let healthy =
        if satellite.constellation == Constellation::Qzss { health & 0xFE == 0 } else { health == 0 };
    Some(Ephemeris {
        satellite,
        toc,
        toe,
        clock: [fields[1]?, fields[2]?, fields[3]?],
        cr: [fields[17]?, fields[5]?],
        delta_n: fields[6]?,
        m0: fields[7]?,
        cu: [fields[8]?, fields[10]?],
        eccentricity,
        sqrt_a,
        ci: [fields[13]?, fields[15]?],
        omega0: fields[14]?,
        i0: fields[16]?,
        omega: fields[18]?,
        omega_dot: fields[19]?,
        i_dot: fields[20]?,
        healthy,
    })
}

/// A difference of seconds of the week, by as many weeks nearer to zero as it can be.
fn near_week(difference_s: f64) -> f64 {
    let week = super::time::WEEK_S;
    difference_s - libm::round(difference_s / week) * week
}
