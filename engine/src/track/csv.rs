//! A track as CSV, a row an epoch. Numbers are written as short as they can be without losing a
//! bit, so that two tracks can be compared by their text.

use std::fmt::Write as _;
use std::io;

use crate::event::{FootPoint, TrackPoint};

/// The columns of a track, with their units. `heading_rad` runs clockwise from true north.
pub const COLUMNS: [&str; 16] = [
    "t_s",
    "e_m",
    "n_m",
    "u_m",
    "heading_rad",
    "sigma_e_m",
    "sigma_n_m",
    "sigma_u_m",
    "left_e_m",
    "left_n_m",
    "left_u_m",
    "right_e_m",
    "right_n_m",
    "right_u_m",
    "left_stance",
    "right_stance",
];

/// Appends the header.
pub fn push_header(out: &mut String) {
    out.push_str(&COLUMNS.join(","));
    out.push('\n');
}

/// Appends a row; the fields of a foot that is not recorded are empty.
pub fn push_row(point: &TrackPoint, out: &mut String) {
    push_seconds(point.t_ns, out);
    let [e, n, u] = point.position_n_m;
    let [sigma_e, sigma_n, sigma_u] = point.sigma_n_m;
    push_numbers(&[e, n, u, point.heading_rad, sigma_e, sigma_n, sigma_u], out);
    for foot in [&point.left, &point.right] {
        match foot {
            Some(foot) => push_numbers(&foot.position_n_m, out),
            None => out.push_str(",,,"),
        }
    }
    for foot in [&point.left, &point.right] {
        out.push_str(match foot {
            Some(FootPoint { stance: true, .. }) => ",1",
            Some(FootPoint { stance: false, .. }) => ",0",
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
    points: impl IntoIterator<Item = &'a TrackPoint>,
    out: &mut impl io::Write,
) -> io::Result<()> {
    const PIECE_BYTES: usize = 1 << 16;
    let mut text = String::with_capacity(PIECE_BYTES + 1024);
    push_header(&mut text);
    for point in points {
        push_row(point, &mut text);
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
            left: None,
            right: Some(FootPoint { position_n_m: [1.1, -2.4, 0.0], stance: true }),
        }
    }

    #[test]
    fn a_missing_foot_is_empty_fields() {
        let mut out = Vec::new();
        write(&[point()], &mut out).unwrap();
        assert_eq!(
            String::from_utf8(out).unwrap(),
            "t_s,e_m,n_m,u_m,heading_rad,sigma_e_m,sigma_n_m,sigma_u_m,left_e_m,left_n_m,left_u_m,\
             right_e_m,right_n_m,right_u_m,left_stance,right_stance\n\
             1.25,1,-2.5,0.1,0.3,0.1,0.2,0.3,,,,1.1,-2.4,0,,1\n"
        );
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
