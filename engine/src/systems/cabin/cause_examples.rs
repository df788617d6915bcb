//! One cause of each kind: what the page has words for is held against them.

use super::causes::{CabinCause, RayTrouble, told};
use super::watch::CabinAnomaly;
use crate::anomaly::Anomaly;

/// One of each, with figures as they may be.
pub(super) fn examples() -> Vec<Anomaly> {
    use CabinCause as C;
    let ray = |looks_like| C::WrongRay { looks_like, distance_m: 0.02, angles_arcsec: [4.0, -2.0] };
    [
        C::OutOfRange { force_m_s2: 55.0, rate_rad_s: 0.1 },
        C::TimeRepeats,
        C::SensorSilent { silent_s: 8.0 },
        C::Silent,
        C::AllSilent,
        C::Lost,
        C::Contradiction { devices: 4, off_m: 0.05 },
        C::Exchanged { with: "A2".to_owned() },
        C::Misplaced,
        C::WrongFix { off_n_m: [0.05, 0.1, -0.02] },
        C::WrongMake,
        ray(RayTrouble::Prism),
        ray(RayTrouble::Distance),
        ray(RayTrouble::Direction),
        C::Late { late_s: 0.1, sigma_s: 0.003 },
        C::Mounting { level_deg: 1.5, yaw_deg: 2.0 },
        C::NoPose { angles_rad: [0.1, -0.1], legs_m: [2.0; 6] },
        C::LegOff { off_m: 0.08 },
        C::AngleOff { off_rad: 0.002 },
        C::Ahead { ahead_s: 18.0 },
        C::Stuck,
        C::Noisy { times: 4.0 },
        C::BiasLeap { force_m_s2: 0.1, rate_rad_s: 0.0002 },
        C::Creeps { sigmas: 7.0 },
        C::NoStart { why: "expected fixes of three antennas at once, found none".to_owned() },
        C::Unordered { rows: 3 },
        C::BadRows {
            rows: 3,
            column: "slant_m".into(),
            expected: "a distance in metres".into(),
            found: -1.0,
        },
        C::Unknown { rows: 3, found: "antenna A7".to_owned() },
        C::NotStored,
        C::Refused { why: "expected fixes of three antennas at once, found none".to_owned() },
    ]
    .into_iter()
    .map(|cause| told(&CabinAnomaly::new("A3", cause, [1, 2]), None))
    .collect()
}
