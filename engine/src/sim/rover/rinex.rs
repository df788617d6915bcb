//! A made world's observations and orbits as RINEX 3.04.

use std::fmt::Write as _;

use super::clock::Instant;
use super::orbit::{Satellite, System};
use super::receiver::Observed;

/// The observations of one station.
pub(super) fn observations(
    name: &str,
    p_e: [f64; 3],
    sky: &[Satellite],
    epochs: &[(Instant, Vec<Observed>)],
) -> String {
    let mut out = String::new();
    let mut line = |text: &str, label: &str| {
        let _ = writeln!(out, "{text:<60}{label:<20}");
    };
    line(&format!("{:>9}{:11}{:<20}{:<20}", "3.04", "", "OBSERVATION DATA", "M"), "RINEX VERSION / TYPE");
    line(&format!("{:<20}{:<20}{:<20}", "lodestep simulate", "", ""), "PGM / RUN BY / DATE");
    line(name, "MARKER NAME");
    line(&format!("{:14.4}{:14.4}{:14.4}", p_e[0], p_e[1], p_e[2]), "APPROX POSITION XYZ");
    line(&format!("{:14.4}{:14.4}{:14.4}", 0.0, 0.0, 0.0), "ANTENNA: DELTA H/E/N");
    line("G    6 C1C L1C S1C C2W L2W S2W", "SYS / # / OBS TYPES");
    line("C    6 C2I L2I S2I C6I L6I S6I", "SYS / # / OBS TYPES");
    line(&format!("{:10.3}", 1.0), "INTERVAL");
    if let Some((first, _)) = epochs.first() {
        let (year, month, day, hour, minute, second) = first.civil();
        line(
            &format!("{year:6}{month:6}{day:6}{hour:6}{minute:6}{second:13.7}     GPS"),
            "TIME OF FIRST OBS",
        );
    }
    line("", "END OF HEADER");
    for (tag, observed) in epochs.iter().filter(|(_, observed)| !observed.is_empty()) {
        let (year, month, day, hour, minute, second) = tag.civil();
        let _ = writeln!(
            out,
            "> {year:04} {month:02} {day:02} {hour:02} {minute:02}{second:11.7}  0{:3}",
            observed.len()
        );
        for one in observed {
            let satellite = &sky[one.satellite];
            let _ = write!(out, "{}{:02}", satellite.system.letter(), satellite.number);
            for band in 0..2 {
                let strength = ((one.snr_db_hz[band] / 6.0) as u8).clamp(1, 9);
                let lli = if one.lli[band] > 0 { one.lli[band].to_string() } else { " ".to_owned() };
                let _ = write!(out, "{:14.3} {strength}", one.code_m[band]);
                let _ = write!(out, "{:14.3}{lli}{strength}", one.phase_cycles[band]);
                let _ = write!(out, "{:14.3}  ", one.snr_db_hz[band]);
            }
            out.truncate(out.trim_end().len());
            out.push('\n');
        }
    }
    out
}

/// The orbits of a sky.
pub(super) fn navigation(sky: &[Satellite]) -> String {
    let mut out = String::new();
    let mut line = |text: &str, label: &str| {
        let _ = writeln!(out, "{text:<60}{label:<20}");
    };
    line(
        &format!("{:>9}{:11}{:<20}{:<20}", "3.04", "", "N: GNSS NAV DATA", "M: MIXED"),
        "RINEX VERSION / TYPE",
    );
    line(&format!("{:<20}{:<20}{:<20}", "lodestep simulate", "", ""), "PGM / RUN BY / DATE");
    line(&format!("{:6}", 18), "LEAP SECONDS");
    line("", "END OF HEADER");
    for system in [System::Gps, System::Bds] {
        sky.iter()
            .filter(|satellite| satellite.system == system)
            .for_each(|satellite| satellite.write(&mut out));
    }
    out
}
