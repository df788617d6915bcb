//! Broadcast orbits and clocks as a stream of numbers: a row is one ephemeris of one satellite. A log is RINEX, read whole.

use crate::gnss::ephemeris::{Ephemeris, Navigation};
use crate::gnss::navigation_reader;
use crate::gnss::time::GpsTime;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::observation_rows::{number_of, satellite_of};
use crate::stream::Rows;
use crate::system::Column;

/// The columns of such a stream. A system that declares these reads its logs as RINEX.
pub const COLUMNS: &[Column] = &[
    column("week", "GPS week of the orbit's reference time, counted on without rolling over."),
    column("toe_s", "Second of that week, GPS time, s."),
    column("satellite", "100, 200, 300 or 400 for GPS, BeiDou, Galileo or QZSS, and the number."),
    column("toc_minus_toe_s", "The clock's reference time after the orbit's, s."),
    column("clock_s", "Clock offset, s."),
    column("clock_s_s", "Its drift, s/s."),
    column("clock_s_s2", "The drift's change, s/s²."),
    column("sqrt_a", "Square root of the semi-major axis, √m."),
    column("eccentricity", "Eccentricity."),
    column("m0_rad", "Mean anomaly at the reference time."),
    column("delta_n_rad_s", "Correction of the mean motion."),
    column("omega0_rad", "Longitude of the ascending node at the beginning of the week."),
    column("omega_dot_rad_s", "Its rate."),
    column("omega_rad", "Argument of perigee."),
    column("i0_rad", "Inclination at the reference time."),
    column("i_dot_rad_s", "Its rate."),
    column("cuc_rad", "Cosine term of the argument of latitude."),
    column("cus_rad", "Its sine term."),
    column("crc_m", "Cosine term of the radius."),
    column("crs_m", "Its sine term."),
    column("cic_rad", "Cosine term of the inclination."),
    column("cis_rad", "Its sine term."),
    column("healthy", "1 where the satellite says that it is well, else 0."),
    column("alpha_0", "Klobuchar's coefficients of the ionosphere, where the message has them."),
    column("alpha_1", "Likewise."),
    column("alpha_2", "Likewise."),
    column("alpha_3", "Likewise."),
    column("beta_0", "Likewise."),
    column("beta_1", "Likewise."),
    column("beta_2", "Likewise."),
    column("beta_3", "Likewise."),
];

const fn column(name: &'static str, about: &'static str) -> Column {
    Column { name, required: false, about }
}

/// Whether these are the columns of such a stream.
pub(super) fn are_of(columns: &[Column]) -> bool {
    columns.iter().map(|column| column.name).eq(COLUMNS.iter().map(|column| column.name))
}

/// Reads a whole log: its rows, and what was passed over, a sentence each.
///
/// # Errors
///
/// What is no such RINEX file, or holds no orbit of a system that is known here.
pub fn read(bytes: &[u8]) -> Result<(Rows, Vec<String>), ParseError> {
    let file = navigation_reader::read(bytes).map_err(|error| {
        ParseError::new(ParseErrorKind::UnknownFormat, error.expected, error.found, error.advice)
            .at_line(error.line as u64)
    })?;
    let rows = rows_of(&file);
    if rows.is_empty() {
        return Err(ParseError::new(
            ParseErrorKind::EmptyFile,
            "orbits of GPS, BeiDou, Galileo or QZSS",
            "none",
            "give the navigation file of the day on which the rover observed",
        ));
    }
    Ok((rows, file.notes))
}

/// The rows of a file of orbits; times count from the week of its first one.
pub fn rows_of(file: &Navigation) -> Rows {
    let mut rows = Rows::new(COLUMNS.len());
    let mut sorted: Vec<&Ephemeris> = file.ephemerides.iter().collect();
    sorted.sort_by_key(|one| one.toe);
    let Some(first) = sorted.first() else { return rows };
    let zero = GpsTime::from_week(first.toe.week(), 0.0);
    for one in sorted {
        push(one, file.klobuchar, zero, &mut rows);
    }
    rows
}

/// Appends the row of an ephemeris, with a time that counts from `zero`.
pub fn push(one: &Ephemeris, klobuchar: Option<[f64; 8]>, zero: GpsTime, rows: &mut Rows) {
    let [clock, drift, change] = one.clock;
    let values = [
        f64::from(one.toe.week()),
        one.toe.tow_s(),
        number_of(one.satellite),
        one.toc.since(one.toe),
        clock,
        drift,
        change,
        one.sqrt_a,
        one.eccentricity,
        one.m0,
        one.delta_n,
        one.omega0,
        one.omega_dot,
        one.omega,
        one.i0,
        one.i_dot,
        one.cu[0],
        one.cu[1],
        one.cr[0],
        one.cr[1],
        one.ci[0],
        one.ci[1],
        f64::from(u8::from(one.healthy)),
    ];
    rows.push(one.toe.ns - zero.ns, values.into_iter().chain(klobuchar.unwrap_or([f64::NAN; 8])));
}

/// Adds the ephemeris of a row to the others; what is no such row is left out. Says whether it was one.
pub fn take(values: &[f64], navigation: &mut Navigation) -> bool {
    let Some((orbit, klobuchar)) = values.split_first_chunk::<23>() else { return false };
    let [week, toe_s, satellite, toc_s, clock, drift, change, sqrt_a, eccentricity, m0, delta_n, omega0, ..] =
        *orbit;
    let [.., omega_dot, omega, i0, i_dot, cuc, cus, crc, crs, cic, cis, healthy] = *orbit;
    let (Some(satellite), Some(toe)) = (satellite_of(satellite), GpsTime::from_row(week, toe_s)) else {
        return false;
    };
    if !orbit.iter().all(|value| value.is_finite()) {
        return false;
    }
    navigation.ephemerides.push(Ephemeris {
        satellite,
        toc: toe + toc_s,
        toe,
        clock: [clock, drift, change],
        sqrt_a,
        eccentricity,
        m0,
        delta_n,
        omega0,
        omega_dot,
        omega,
        i0,
        i_dot,
        cu: [cuc, cus],
        cr: [crc, crs],
        ci: [cic, cis],
        healthy: healthy == 1.0,
    });
    if navigation.klobuchar.is_none()
        && let Some(klobuchar) = klobuchar.first_chunk::<8>()
        && klobuchar.iter().all(|value| value.is_finite())
    {
        navigation.klobuchar = Some(*klobuchar);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::satellite::{Constellation, Satellite};

    #[test]
    fn an_ephemeris_comes_back_from_its_row_to_the_last_bit() {
        let toe = GpsTime::from_week(2340, 597_600.0);
        let one = |constellation, number, toe: GpsTime| Ephemeris {
            satellite: Satellite { constellation, number },
            toc: toe + 16.0,
            toe,
            clock: [1e-4 / 3.0, -1e-12, 0.0],
            sqrt_a: 5153.7,
            eccentricity: 0.01 / 3.0,
            m0: 1.0,
            delta_n: 4e-9,
            omega0: -2.0,
            omega_dot: -8e-9,
            omega: 0.5,
            i0: 0.96,
            i_dot: 1e-10,
            cu: [1e-6, 2e-6],
            cr: [200.5, -20.25],
            ci: [1e-7, -1e-7],
            healthy: number != 9,
        };
        let file = Navigation {
            ephemerides: vec![
                one(Constellation::Gps, 9, toe + 7_200.0),
                one(Constellation::Qzss, 2, toe),
                one(Constellation::Beidou, 60, toe),
            ],
            klobuchar: Some([1e-8, 0.0, -6e-8, 0.0, 9e4, 0.0, -2e5, 1.0 / 3.0]),
            notes: Vec::new(),
        };
        let rows = rows_of(&file);
        let mut back = Navigation::default();
        assert!(rows.iter().all(|(_, values)| take(values, &mut back)));
        let mut sorted = file.ephemerides.clone();
        sorted.rotate_left(1);
        assert_eq!((back.ephemerides, back.klobuchar), (sorted, file.klobuchar));
        assert!(!take(&[f64::NAN; 31], &mut Navigation::default()));
        assert!(!take(&[1.0; 5], &mut Navigation::default()));
    }
}
