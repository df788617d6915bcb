//! Charts of a run that is complete: against the plan, how sure the poses are, and what they rest on.

use super::aids::Aids;
use super::output::Row;
use super::plan::PlannedBody;
use crate::system::ChartValue;

/// Between two values, ns: charts have no finer cells.
const EVERY_NS: i64 = 100_000_000;
const BODIES: [&str; 2] = ["cabin", "platform"];
const AXES: [&str; 3] = ["e", "n", "u"];
const ANGLES: [&str; 3] = ["yaw", "pitch", "roll"];

/// What says where the platform is, by the numbers of the chart `source`.
const ENCODERS: f64 = 1.0;
const OWN_SENSOR: f64 = 2.0;
const HELD: f64 = 3.0;

/// The values so far.
#[derive(Debug, Default)]
pub(super) struct Charts(Vec<ChartValue>);

impl Charts {
    /// Those of a time, with the platform where it is known.
    pub(super) fn add(
        &mut self,
        (cabin, platform): &(Row, Option<Row>),
        planned: Option<&[PlannedBody; 2]>,
        aids: &Aids,
    ) {
        let t_ns = cabin.t_ns;
        if t_ns.rem_euclid(EVERY_NS) != 0 {
            return;
        }
        let mut add = |chart, series: &str, value: f64| {
            if value.is_finite() {
                self.0.push(ChartValue { t_ns, chart, series: series.to_owned(), value });
            }
        };
        for (body, row) in [Some(cabin), platform.as_ref()].into_iter().enumerate() {
            let (Some(row), name) = (row, BODIES[body]) else { continue };
            add("protection_level", name, row.protection_level_m());
            add("sigma_body", name, row.largest_sigma_m());
            add("sigma_angles", name, row.sigma_angles_rad().into_iter().fold(0.0, f64::max));
            add("time_left", name, row.time_left_s.unwrap_or(f64::NAN));
            let angles = row.angles();
            let angles_rad = [angles.heading_rad, angles.pitch_rad, angles.roll_rad];
            if let Some(planned) = planned.map(|both| &both[body]) {
                for (axis, letter) in AXES.iter().enumerate() {
                    add("off_plan", &format!("{name}_{letter}"), row.p_n[axis] - planned.place_n_m[axis]);
                }
                for (angle, off_rad) in ANGLES.iter().zip(planned.off_rad(angles_rad)) {
                    add("off_plan_angles", &format!("{name}_{angle}"), off_rad);
                }
            }
            if body == 1 {
                let by_encoders = row.aids >> aids.encoders() & 1 == 1;
                let source = if by_encoders { ENCODERS } else { OWN_SENSOR };
                add("source", name, if row.is_held { HELD } else { source });
                ANGLES.iter().zip(angles_rad).for_each(|(angle, rad)| add("platform_angles", angle, rad));
            }
        }
        add("state", "cabin", f64::from(cabin.status as u8));
        // The platform's own sensor may be there as a spare.
        let mask = cabin.aids | aids.fresh_of_platform(t_ns);
        for (bit, name) in aids.all().iter().enumerate() {
            add("aids", name, f64::from((mask >> bit & 1) as u8));
        }
    }

    /// Takes them away.
    pub(super) fn take(&mut self) -> Vec<ChartValue> {
        std::mem::take(&mut self.0)
    }
}
