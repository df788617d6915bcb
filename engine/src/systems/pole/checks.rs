//! What can be seen to be wrong before anything is computed.

use nalgebra::Vector3;

use super::causes::SurveyCause;
use super::recording::{Instrument, Recording};
use crate::geo::LocalFrame;

/// No pole is longer than this, m: a number that is larger is in feet.
const LONGEST_POLE_M: f64 = 4.5;
/// No survey goes farther from its site than this, in plan and height, m.
const FARTHEST_M: [f64; 2] = [20_000.0, 500.0];
/// A foot in metres.
const FOOT_M: f64 = 0.3048;
/// Heights that are off by more than this are looked at for feet, m.
const UNIT_LOOKED_FOR_M: f64 = 20.0;

/// Looks at the inputs.
///
/// # Errors
///
/// At what cannot be.
pub(super) fn check(
    recording: &Recording,
    instrument: &Instrument,
    frame: &LocalFrame,
) -> Result<(), SurveyCause> {
    let (Some(first), Some(last)) = (recording.imu.first(), recording.imu.last()) else {
        return Err(SurveyCause::NoSamples);
    };
    let longest_m = LONGEST_POLE_M;
    if let Some(tip_b_m) = instrument.tip_b_m {
        let up_b = instrument.antenna_b_m - tip_b_m;
        if up_b.norm() > longest_m {
            return Err(SurveyCause::PoleTooLong { length_m: up_b.norm(), longest_m });
        }
        let force: Vector3<f64> = recording.imu.iter().map(|sample| Vector3::from(sample.f_b_m_s2)).sum();
        if force.dot(&up_b) < 0.5 * force.norm() * up_b.norm() {
            let cos = force.dot(&up_b) / (force.norm() * up_b.norm()).max(f64::MIN_POSITIVE);
            return Err(SurveyCause::UpsideDown { lean_deg: libm::acos(cos.clamp(-1.0, 1.0)).to_degrees() });
        }
    } else if instrument.antenna_b_m.norm() > longest_m {
        return Err(SurveyCause::AntennaTooFar { antenna_m: instrument.antenna_b_m.norm(), longest_m });
    }
    let within = recording.fixes.iter().filter(|fix| fix.t_ns >= first.t_ns && fix.t_ns <= last.t_ns).count();
    if within < 3 {
        let seconds = |t_ns: i64| t_ns as f64 * 1e-9;
        let fixes_s = match (recording.fixes.first(), recording.fixes.last()) {
            (Some(a), Some(b)) => Some([seconds(a.t_ns), seconds(b.t_ns)]),
            _ => None,
        };
        return Err(SurveyCause::OtherTimes {
            samples_s: [seconds(first.t_ns), seconds(last.t_ns)],
            fixes_s,
        });
    }
    near(recording, frame)
}

/// Whether the positions are near the site.
fn near(recording: &Recording, frame: &LocalFrame) -> Result<(), SurveyCause> {
    let mut far: Vec<&Vector3<f64>> = recording.fixes.iter().map(|fix| &fix.p_n_m).collect();
    far.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let middle = far[far.len() / 2];
    let height_m = frame.origin().height_m;
    let found = height_m + middle.z;
    if middle.z.abs() > UNIT_LOOKED_FOR_M {
        // One of the two is in feet where the other, or what it is above the ground, says the same in metres.
        let of_site_m = (found * FOOT_M - height_m).abs();
        let of_fixes_m = (found - height_m * FOOT_M).abs();
        if of_site_m.min(of_fixes_m) < 0.1 * UNIT_LOOKED_FOR_M + 0.01 * height_m.abs() {
            return Err(SurveyCause::HeightsInFeet { found, height_m });
        }
    }
    let [plan_most_m, height_most_m] = FARTHEST_M;
    if middle.xy().norm() > plan_most_m || middle.z.abs() > height_most_m {
        return Err(SurveyCause::FarFromSite { plan_m: middle.xy().norm(), height_m: middle.z });
    }
    Ok(())
}
