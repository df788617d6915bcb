//! Positions as canonical CSV: `t_s,lat_deg,lon_deg,height_m,sigma_e_m,sigma_n_m,sigma_u_m,quality`.

use crate::geo::Geodetic;
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::gnss::{GnssClock, GnssFile, GnssQuality, GnssRow, check_place};
use crate::parse::number::{need_finite, need_time_ns};
use crate::parse::table;

const COLUMNS: [&str; 8] =
    ["t_s", "lat_deg", "lon_deg", "height_m", "sigma_e_m", "sigma_n_m", "sigma_u_m", "quality"];

/// Reads a file of positions.
///
/// # Errors
///
/// At the first thing that is wrong.
pub fn read(bytes: &[u8]) -> Result<GnssFile, ParseError> {
    let rows = table::read(
        bytes,
        &COLUMNS.join(","),
        |header| {
            let mut places = [0; 8];
            for (place, column) in places.iter_mut().zip(COLUMNS) {
                *place = header.need(column, &COLUMNS)?;
            }
            Ok(places)
        },
        |places, record| {
            let number = |k: usize| need_finite(record, places[k], COLUMNS[k]);
            let place =
                Geodetic { latitude_deg: number(1)?, longitude_deg: number(2)?, height_m: number(3)? };
            let mut sigma_n_m = [0.0; 3];
            for (k, sigma) in sigma_n_m.iter_mut().enumerate() {
                *sigma = number(4 + k)?;
                if *sigma <= 0.0 {
                    return Err(ParseError::new(
                        ParseErrorKind::OutOfRange,
                        "a sigma above zero",
                        sigma.to_string(),
                        "give the sigma that the receiver says",
                    )
                    .at_line(record.line)
                    .in_column(COLUMNS[4 + k]));
                }
            }
            let quality = match record.field(places[7]).trim_ascii() {
                b"fixed" => GnssQuality::Fixed,
                b"float" => GnssQuality::Float,
                b"single" => GnssQuality::Single,
                other => {
                    return Err(ParseError::new(
                        ParseErrorKind::OutOfRange,
                        "fixed, float or single",
                        quoted(other),
                        "write one of these words",
                    )
                    .at_line(record.line)
                    .in_column(COLUMNS[7]));
                }
            };
            Ok(GnssRow {
                t_ns: need_time_ns(record, places[0], COLUMNS[0])?,
                place: check_place(place, record.line)?,
                sigma_n_m: Some(sigma_n_m),
                quality,
            })
        },
    )?;
    Ok(GnssFile { rows, clock: GnssClock::Session })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_read_and_what_is_wrong_is_named_with_its_line_and_column() {
        let head = COLUMNS.join(",");
        let row = "0.200,25.7649741,106.7095174,457.927,0.013,0.0136,0.0258,fixed";
        let file = read(format!("{head}\n{row}\n").as_bytes()).unwrap();
        assert_eq!(file.clock, GnssClock::Session);
        assert_eq!((file.rows[0].t_ns, file.rows[0].quality), (200_000_000, GnssQuality::Fixed));
        assert_eq!(file.rows[0].sigma_n_m, Some([0.013, 0.0136, 0.0258]));
        for (from, to, column) in
            [("fixed", "rtk", "quality"), ("0.013,", "0,", "sigma_e_m"), ("25.7", "x5.7", "lat_deg")]
        {
            let error = read(format!("{head}\n{}\n", row.replace(from, to)).as_bytes()).unwrap_err();
            assert_eq!((error.line, error.column.as_deref()), (Some(2), Some(column)), "{error}");
        }
        assert!(read(format!("{head}\n{}\n", row.replace("25.7", "95.7")).as_bytes()).is_err());
    }
}
