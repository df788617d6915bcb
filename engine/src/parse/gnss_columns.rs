//! Positions of a GNSS antenna as a stream of a session: its columns, and how a log in any of the forms becomes rows of them.

use crate::parse::error::ParseError;
use crate::parse::gnss::{self, GnssClock, LEAP_SECONDS};
use crate::stream::Rows;
use crate::system::Column;

/// The columns of such a stream. A system that declares these reads its logs as CSV, as RTKLIB's `.pos` or as NMEA.
pub const COLUMNS: &[Column] = &[
    column("lat_deg", true, "Latitude of the antenna's phase centre, WGS84, degrees."),
    column("lon_deg", true, "Longitude, degrees."),
    column("height_m", true, "Height above the ellipsoid, m."),
    column("sigma_e_m", true, "Sigma east, m."),
    column("sigma_n_m", true, "Sigma north, m."),
    column("sigma_u_m", true, "Sigma up, m."),
    column("quality", true, "fixed, float or single in files; 1, 2 or 5 in what is streamed."),
];

const fn column(name: &'static str, required: bool, about: &'static str) -> Column {
    Column { name, required, about }
}

/// Whether these are the columns of such a stream.
pub(super) fn are_of(columns: &[Column]) -> bool {
    columns.iter().map(|column| column.name).eq(COLUMNS.iter().map(|column| column.name))
}

/// Reads a whole log. Times of day in UTC become such in GPS time, as all others are.
///
/// # Errors
///
/// At the first thing that is wrong.
pub(super) fn read(bytes: &[u8]) -> Result<Rows, ParseError> {
    let file = gnss::read(bytes)?;
    let ahead_ns = match file.clock {
        GnssClock::MidnightUtc => LEAP_SECONDS * 1_000_000_000,
        GnssClock::Session | GnssClock::Gps => 0,
    };
    let mut rows = Rows::new(COLUMNS.len());
    for row in &file.rows {
        let [e, n, u] = row.sigma_n_m.unwrap_or([f64::NAN; 3]);
        let place = row.place;
        let values = [place.latitude_deg, place.longitude_deg, place.height_m, e, n, u, row.quality.number()];
        rows.push(row.t_ns + ahead_ns, values);
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_of_any_form_becomes_rows_of_the_same_columns() {
        let csv = b"t_s,lat_deg,lon_deg,height_m,sigma_e_m,sigma_n_m,sigma_u_m,quality\n0.2,40.1,-105.1,1601.4,0.01,0.02,0.03,float\n";
        let pos = b"% GPST latitude(deg)\n2023/08/27 20:15:00.249 40.1 -105.1 1601.4 2 12 0.02 0.01 0.03\n";
        let of = |bytes: &[u8]| {
            let rows = read(bytes).unwrap();
            rows.get(0).unwrap().1.to_vec()
        };
        assert_eq!(of(csv), [40.1, -105.1, 1601.4, 0.01, 0.02, 0.03, 2.0]);
        assert_eq!(of(pos), of(csv));
        assert!(are_of(COLUMNS) && !are_of(&COLUMNS[1..]));
    }
}
