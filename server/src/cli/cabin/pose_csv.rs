//! Poses as CSV.

use std::io::{self, Write};

use lodestep_engine::systems::cabin::{Aids, Row};
use lodestep_engine::track::csv::push_seconds;

/// The columns.
pub(super) const HEADER: &str = "t_s,e_m,n_m,u_m,yaw_rad,pitch_rad,roll_rad,sigma_e_m,sigma_n_m,sigma_u_m,\
                                 sigma_yaw_rad,sigma_pitch_rad,sigma_roll_rad,status,aids,protection_level_m,\
                                 v_e_m_s,v_n_m_s,v_u_m_s,time_left_s";

/// Writes rows; the header is written before the first.
pub(super) fn write(rows: &[Row], aids: &Aids, out: &mut impl Write) -> io::Result<()> {
    let mut line = String::new();
    for row in rows {
        line.clear();
        push_seconds(row.t_ns, &mut line);
        let angles = row.angles();
        let [e, n, u] = row.sigma_n_m();
        let [yaw, pitch, roll] = row.sigma_angles_rad();
        let time_left = row.time_left_s.map(|left_s| format!("{left_s:.1}")).unwrap_or_default();
        writeln!(
            out,
            "{line},{:.6},{:.6},{:.6},{:.9},{:.9},{:.9},{e:.6},{n:.6},{u:.6},{yaw:.9},{pitch:.9},{roll:.9},{},{},{:.6},{:.6},{:.6},{:.6},{time_left}",
            row.p_n.x,
            row.p_n.y,
            row.p_n.z,
            angles.heading_rad,
            angles.pitch_rad,
            angles.roll_rad,
            row.status.word(),
            aids.names(row.aids),
            row.protection_level_m(),
            row.v_n.x,
            row.v_n.y,
            row.v_n.z,
        )?;
    }
    Ok(())
}
