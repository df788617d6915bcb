//! What can be seen to be wrong before anything is computed.

use nalgebra::Vector3;

use super::recording::{Instrument, Recording};
use super::survey::SurveyError;

/// No pole is longer than this, m: a number that is larger is in feet.
const LONGEST_POLE_M: f64 = 4.5;
/// No survey goes farther from its site than this, in plan and height, m.
const FARTHEST_M: [f64; 2] = [20_000.0, 500.0];

/// Looks at the inputs.
///
/// # Errors
///
/// At what cannot be, in a sentence that says what to do.
pub(super) fn check(recording: &Recording, instrument: &Instrument) -> Result<(), SurveyError> {
    let wrong = |sentence: String| Err(SurveyError::Sentence(sentence));
    let (Some(first), Some(last)) = (recording.imu.first(), recording.imu.last()) else {
        return wrong("expected samples of the inertial sensor, found none: check the log".to_owned());
    };
    if let Some(tip_b_m) = instrument.tip_b_m {
        let up_b = instrument.antenna_b_m - tip_b_m;
        if up_b.norm() > LONGEST_POLE_M {
            return wrong(format!(
                "expected a pole of at most {LONGEST_POLE_M} m, found {:.2} m from tip to antenna: give antenna_b_m and tip_b_m in metres, not in feet",
                up_b.norm()
            ));
        }
        let force: Vector3<f64> = recording.imu.iter().map(|sample| Vector3::from(sample.f_b_m_s2)).sum();
        if force.dot(&up_b) < 0.5 * force.norm() * up_b.norm() {
            return wrong(format!(
                "expected the antenna above the tip, found the pole lying or upside down by {:.0}° on the mean of the survey: antenna_b_m and tip_b_m are swapped, or not in the sensor's axes",
                libm::acos((force.dot(&up_b) / (force.norm() * up_b.norm())).clamp(-1.0, 1.0)).to_degrees()
            ));
        }
    } else if instrument.antenna_b_m.norm() > LONGEST_POLE_M {
        return wrong(format!(
            "expected an antenna within {LONGEST_POLE_M} m of the sensor, found {:.2} m: give antenna_b_m in metres, not in feet",
            instrument.antenna_b_m.norm()
        ));
    }
    let within = recording.fixes.iter().filter(|fix| fix.t_ns >= first.t_ns && fix.t_ns <= last.t_ns).count();
    if within < 3 {
        let seconds = |t_ns: i64| t_ns as f64 * 1e-9;
        let fixes = match (recording.fixes.first(), recording.fixes.last()) {
            (Some(a), Some(b)) => format!("{:.1} to {:.1} s", seconds(a.t_ns), seconds(b.t_ns)),
            _ => "no time at all".to_owned(),
        };
        return wrong(format!(
            "expected positions from {:.1} to {:.1} s, when the sensor's samples are, found them at {fixes}: the positions are of another day or another clock",
            seconds(first.t_ns),
            seconds(last.t_ns)
        ));
    }
    let mut far: Vec<&Vector3<f64>> = recording.fixes.iter().map(|fix| &fix.p_n_m).collect();
    far.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let middle = far[far.len() / 2];
    let [plan, height] = FARTHEST_M;
    if middle.xy().norm() > plan || middle.z.abs() > height {
        return wrong(format!(
            "expected positions near the site, found them {:.0} m away in plan and {:.0} m in height: check the site, and that heights are in metres, not in feet",
            middle.xy().norm(),
            middle.z
        ));
    }
    Ok(())
}
