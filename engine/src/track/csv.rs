//! A track as CSV, a row an epoch. Numbers are written as short as they can be without losing a
//! bit, so that two tracks can be compared by their text.

use std::fmt::Write as _;
use std::io;

use crate::event::{Part, TrackPoint};
use crate::system::{Declaration, PartRule};

/// The columns that every track has, with their units. `heading_rad` runs clockwise from true north.
const COLUMNS: [&str; 8] = ["t_s", "e_m", "n_m", "u_m", "heading_rad", "sigma_e_m", "sigma_n_m", "sigma_u_m"];
/// Those of a system whose points have roll and pitch.
const TILT_COLUMNS: [&str; 4] = ["roll_rad", "pitch_rad", "sigma_roll_rad", "sigma_pitch_rad"];

/// The columns of a system's tracks: those that every track has, roll and pitch where it has them, the place of each part,
/// and whether the parts stand.
pub fn columns(system: &Declaration) -> Vec<String> {
    let mut columns: Vec<String> = COLUMNS.iter().map(|name| (*name).to_owned()).collect();
    if system.has_tilt {
        columns.extend(TILT_COLUMNS.iter().map(|name| (*name).to_owned()));
    }
    for PartRule { name, .. } in system.parts {
        columns.extend(["e_m", "n_m", "u_m"].map(|axis| format!("{name}_{axis}")));
    }
    let standing = system.parts.iter().filter(|part| part.has_stance);
    columns.extend(standing.map(|part| format!("{}_stance", part.name)));
    columns
}

/// Appends the header.
pub fn push_header(system: &Declaration, out: &mut String) {
    out.push_str(&columns(system).join(","));
    out.push('\n');
}

/// Appends a row; the fields of a part that is not there are empty.
pub fn push_row(system: &Declaration, point: &TrackPoint, out: &mut String) {
    push_seconds(point.t_ns, out);
    let [e, n, u] = point.position_n_m;
    let [sigma_e, sigma_n, sigma_u] = point.sigma_n_m;
    push_numbers(&[e, n, u, point.heading_rad, sigma_e, sigma_n, sigma_u], out);
    if system.has_tilt {
        match &point.tilt {
            Some(tilt) => {
                let sigmas = [tilt.sigma_roll_rad, tilt.sigma_pitch_rad].map(f64::from);
                push_numbers(&[tilt.roll_rad, tilt.pitch_rad, sigmas[0], sigmas[1]], out);
            }
            None => out.push_str(",,,,"),
        }
    }
    let parts = || system.parts.iter().zip(&point.parts);
    for (_, part) in parts() {
        match part {
            Some(part) => push_numbers(&part.position_n_m, out),
            None => out.push_str(",,,"),
        }
    }
    for (_, part) in parts().filter(|(rule, _)| rule.has_stance) {
        out.push_str(match part {
            Some(Part { stance: true, .. }) => ",1",
            Some(Part { stance: false, .. }) => ",0",
            None => ",",
        });
    }
    out.push('\n');
}

fn push_numbers(values: &[f64], out: &mut String) {
    for value in values {
        write!(out, ",{value}").expect("writing to a string cannot fail");
    }
}

/// Appends whole nanoseconds as decimal seconds, exactly and without trailing zeros.
pub fn push_seconds(t_ns: i64, out: &mut String) {
    if t_ns < 0 {
        out.push('-');
    }
    let magnitude = t_ns.unsigned_abs();
    let (seconds, rest) = (magnitude / 1_000_000_000, magnitude % 1_000_000_000);
    write!(out, "{seconds}").expect("writing to a string cannot fail");
    if rest != 0 {
        write!(out, ".{rest:09}").expect("writing to a string cannot fail");
        out.truncate(out.trim_end_matches('0').len());
    }
}

/// Writes points, header first.
///
/// # Errors
///
/// When `out` does not take it.
pub fn write<'a>(
    system: &Declaration,
    points: impl IntoIterator<Item = &'a TrackPoint>,
    out: &mut impl io::Write,
) -> io::Result<()> {
    const PIECE_BYTES: usize = 1 << 16;
    let mut text = String::with_capacity(PIECE_BYTES + 1024);
    push_header(system, &mut text);
    for point in points {
        push_row(system, point, &mut text);
        if text.len() >= PIECE_BYTES {
            out.write_all(text.as_bytes())?;
            text.clear();
        }
    }
    out.write_all(text.as_bytes())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::track) fn point() -> TrackPoint {
        TrackPoint {
            t_ns: 1_250_000_000,
            position_n_m: [1.0, -2.5, 0.1],
            heading_rad: 0.3,
            sigma_heading_rad: 0.01,
            sigma_n_m: [0.1, 0.2, 0.3],
            covariance_en_m2: 0.001,
            tilt: None,
            parts: [None, Some(Part { position_n_m: [1.1, -2.4, 0.0], stance: true })],
        }
    }

    #[test]
    fn seconds_are_written_exactly() {
        let text = |t_ns| {
            let mut out = String::new();
            push_seconds(t_ns, &mut out);
            out
        };
        assert_eq!(text(0), "0");
        assert_eq!(text(-1_500_000_000), "-1.5");
        assert_eq!(text(100_000_000_000), "100");
        assert_eq!(text(i64::MIN), "-9223372036.854775808");
        assert_eq!(text(1), "0.000000001");
    }
}
