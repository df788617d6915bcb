//! A track as CSV, a row an epoch. Numbers are written as short as they can be without losing a
//! bit, so that two tracks can be compared by their text.

use std::fmt::Write as _;

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
