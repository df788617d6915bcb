//! The track of a survey as CSV.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use lodestep_engine::systems::pole::survey::Row;

use crate::cli::output_file;

const HEADER: &str =
    "t_s,e_m,n_m,u_m,antenna_e_m,antenna_n_m,antenna_u_m,sigma_e_m,sigma_n_m,sigma_u_m,contact\n";

/// Writes the track.
pub(super) fn write(path: &Path, rows: &[Row]) -> Result<()> {
    output_file::write(path, |out| {
        out.write_all(HEADER.as_bytes())?;
        let mut line = String::new();
        for row in rows {
            line.clear();
            // A string takes whatever is written to it.
            let _ = write!(line, "{:.4}", row.t_ns as f64 * 1e-9);
            match row.tip_n_m {
                Some(tip) => tip.iter().for_each(|x| drop(write!(line, ",{x:.4}"))),
                None => line.push_str(",,,"),
            }
            row.antenna_n_m.iter().for_each(|x| drop(write!(line, ",{x:.4}")));
            row.sigma_n_m.iter().for_each(|x| drop(write!(line, ",{x:.4}")));
            line.push_str(if row.contact { ",1\n" } else { ",0\n" });
            out.write_all(line.as_bytes())?;
        }
        Ok(())
    })
}
