//! What a recording is judged by: motion capture (`t_s,x_m,y_m,z_m`), ground points (`t_s,x_m,y_m`,
//! in a frame of their own) and the simulator's truth (`t_s,e_m,n_m,u_m`, further columns allowed).

use crate::parse::error::ParseError;
use crate::parse::number::{need_finite, need_time_ns};
use crate::parse::table;

/// A known place at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPlace {
    /// When, ns since the session's start.
    pub t_ns: i64,
    /// Where, m; the third is 0 where the file has no height.
    pub position_m: [f64; 3],
}

/// Reads known places.
///
/// # Errors
///
/// At the first thing that is wrong.
pub fn read(bytes: &[u8]) -> Result<Vec<KnownPlace>, ParseError> {
    const KNOWN: [&str; 7] = ["t_s", "x_m", "y_m", "z_m", "e_m", "n_m", "u_m"];
    table::read(
        bytes,
        "t_s,x_m,y_m,z_m",
        |header| {
            let axes =
                if header.find("e_m").is_some() { ["e_m", "n_m", "u_m"] } else { ["x_m", "y_m", "z_m"] };
            let plan = [header.need(axes[0], &KNOWN)?, header.need(axes[1], &KNOWN)?];
            Ok((header.need("t_s", &KNOWN)?, plan, header.find(axes[2]), axes))
        },
        |(time, plan, height, axes), record| {
            let x = need_finite(record, plan[0], axes[0])?;
            let y = need_finite(record, plan[1], axes[1])?;
            let z = height.map_or(Ok(0.0), |index| need_finite(record, index, axes[2]))?;
            Ok(KnownPlace { t_ns: need_time_ns(record, *time, "t_s")?, position_m: [x, y, z] })
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_kinds_are_read() {
        let place = |t_ns, position_m| KnownPlace { t_ns, position_m };
        assert_eq!(read(b"t_s,x_m,y_m\n2.135,1,2\n").unwrap(), [place(2_135_000_000, [1.0, 2.0, 0.0])]);
        assert_eq!(read(b"t_s,x_m,y_m,z_m\n0,1,2,3\n").unwrap(), [place(0, [1.0, 2.0, 3.0])]);
        assert_eq!(read(b"left,t_s,n_m,e_m,u_m\n9,0,2,1,3\n").unwrap(), [place(0, [1.0, 2.0, 3.0])]);
        assert_eq!(read(b"t_s,x_m,y_m\n0,nan,2\n").unwrap_err().code(), "not_a_number");
        assert_eq!(read(b"t_s,x_m\n0,1\n").unwrap_err().code(), "missing_column");
    }
}
