//! RTKLIB's solution file, `.pos`, in degrees and metres with times in GPS time. Mind the order: north before east.

use std::io::{self, Write};

use super::{Fix, Solution};

/// Writes the header and a line for each position.
///
/// # Errors
///
/// When `out` does not take it.
pub fn write(solutions: impl IntoIterator<Item = Solution>, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "% program   : Lodestep")?;
    writeln!(
        out,
        "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,7:dr,ns=# of satellites)"
    )?;
    writeln!(
        out,
        "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  \
         sdeu(m)  sdun(m) age(s)  ratio"
    )?;
    solutions.into_iter().try_for_each(|solution| line(&solution, out))
}

fn line(solution: &Solution, out: &mut impl Write) -> io::Result<()> {
    let [east, north, up] = solution.sigma_n_m;
    let covariance = solution.covariance_en_m2;
    // A covariance is told as the root of its size, with its sign.
    let north_east = libm::copysign(libm::sqrt(covariance.abs()), covariance);
    writeln!(
        out,
        "{} {:14.9} {:14.9} {:10.4} {:3} {:3} {north:8.4} {east:8.4} {up:8.4} {north_east:8.4} {:8.4} {:8.4} {:6.2} {:6.1}",
        solution.time.calendar_ms().replace('-', "/"),
        solution.place.latitude_deg,
        solution.place.longitude_deg,
        solution.place.height_m,
        number(solution.fix),
        solution.satellites.unwrap_or(0),
        0.0,
        0.0,
        solution.base_age_s.unwrap_or(0.0),
        solution.ratio.unwrap_or(0.0),
    )
}

/// As RTKLIB numbers it; what rests on no satellite counts as dead reckoning.
fn number(fix: Fix) -> u8 {
    match fix {
        Fix::Fixed => 1,
        Fix::Float => 2,
        Fix::Single => 5,
        Fix::Estimated => 7,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::solution::tests::two;

    #[test]
    fn each_position_is_a_line_of_fifteen_fields() {
        let mut out = Vec::new();
        write(two(), &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<Vec<&str>> = text
            .lines()
            .filter(|line| !line.starts_with('%'))
            .map(|line| line.split_whitespace().collect())
            .collect();
        assert_eq!(
            lines[0],
            [
                "2024/06/24",
                "08:20:00.100",
                "40.096691637",
                "105.147166512",
                "1601.4312",
                "1",
                "14",
                "0.0123",
                "0.0081",
                "0.0204",
                "-0.0063",
                "0.0000",
                "0.0000",
                "1.00",
                "12.3"
            ]
        );
        // A fraction that rounds up carries into the second.
        assert_eq!(lines[1][..3], ["2024/07/01", "00:00:18.000", "-34.000000000"]);
        assert_eq!((lines[1][5], lines[1].len()), ("7", 15));
    }
}
