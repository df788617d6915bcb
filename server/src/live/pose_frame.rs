//! A pose as the control system is sent it: little endian, laid out in `docs/poses.md`.

use std::time::Duration;

use lodestep_engine::anomaly::AnomalyKind;
use lodestep_engine::system::{AidState, BodyPose, Pose, PoseState};

/// Bytes of the head, of a body and of an aid.
const HEAD_BYTES: usize = 40;
const BODY_BYTES: usize = 132;
const AID_BYTES: usize = 4;

const MAGIC: &[u8; 4] = b"LPOS";
const VERSION: u16 = 2;
/// The state of a pose whose sensor has been silent for longer than it can be predicted.
const SILENT: u8 = 4;
/// A pose is predicted beyond its sample for so long at most, and then no longer valid.
const VALID_FOR: Duration = Duration::from_millis(100);
/// A pose older than this is flagged.
const FRESH_FOR: Duration = Duration::from_millis(10);
/// The alarm is announced from this share of the budget on.
const NEAR: f64 = 0.8;
/// How a body's position may leave its prediction, m in s to the power of 1.5: 5.1 sigmas of a velocity that wanders by 0.06 m/s in
/// a second.
const UNSEEN_M: f64 = 0.18;

/// Bits of a body.
mod bits {
    pub(super) const KNOWN: u32 = 1;
    pub(super) const MEASURED: u32 = 2;
    pub(super) const VALID: u32 = 4;
    pub(super) const ALARM: u32 = 8;
    pub(super) const NEAR: u32 = 16;
}

/// Bytes of the frames of a session with so many aids.
pub(crate) const fn frame_bytes(aids: usize) -> usize {
    HEAD_BYTES + 2 * BODY_BYTES + aids * AID_BYTES
}

/// The frame of a pose whose sample came in `age` ago, predicted to now; `troubles` are the kinds of trouble in the order in which
/// they are numbered from 1.
pub(crate) fn encode(pose: &Pose, sequence: u64, age: Duration, troubles: &[AnomalyKind]) -> Vec<u8> {
    let frame_bytes = frame_bytes(pose.aid_states.len());
    let mut bytes = Vec::with_capacity(frame_bytes);
    let age_ns = i64::try_from(age.as_nanos()).unwrap_or(i64::MAX);
    let is_silent = age > VALID_FOR;
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&(frame_bytes as u16).to_le_bytes());
    bytes.extend_from_slice(&sequence.to_le_bytes());
    bytes.extend_from_slice(&pose.t_ns.saturating_add(age_ns).to_le_bytes());
    bytes.extend_from_slice(&u32::try_from(age.as_micros()).unwrap_or(u32::MAX).to_le_bytes());
    bytes.push(if is_silent { SILENT } else { state(pose.state) });
    bytes.push(u8::from(age > FRESH_FOR));
    bytes.extend([pose.bodies.len() as u8, pose.aid_states.len() as u8]);
    bytes.extend_from_slice(&pose.aids.to_le_bytes());
    let known = pose.state != PoseState::Aligning && !is_silent;
    for body in &pose.bodies {
        push_body(body.as_ref(), known, age.as_secs_f64(), &mut bytes);
    }
    for aid in &pose.aid_states {
        push_aid(aid, age.as_secs_f64(), troubles, &mut bytes);
    }
    bytes
}

fn push_aid(aid: &AidState, age_s: f64, troubles: &[AnomalyKind], bytes: &mut Vec<u8>) {
    // Ten minutes and more, and never, are the largest number.
    let since = ((aid.since_s + age_s) * 100.0).round().min(f64::from(u16::MAX)) as u16;
    let number = aid.trouble.and_then(|kind| troubles.iter().position(|known| *known == kind));
    bytes.extend_from_slice(&since.to_le_bytes());
    bytes.extend_from_slice(&number.map_or(0, |number| number as u16 + 1).to_le_bytes());
}

fn state(state: PoseState) -> u8 {
    match state {
        PoseState::Aligning => 0,
        PoseState::Full => 1,
        PoseState::Reduced => 2,
        PoseState::Coasting => 3,
    }
}

fn push_body(body: Option<&BodyPose>, known: bool, age_s: f64, bytes: &mut Vec<u8>) {
    let Some(body) = body else {
        bytes.extend([f64::NAN; 6].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([f32::NAN; 20].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend_from_slice(&0_u32.to_le_bytes());
        return;
    };
    let ahead = |x: &[f64; 3], rate: &[f64; 3]| [0, 1, 2].map(|axis| x[axis] + age_s * rate[axis]);
    let position = ahead(&body.position_n_m, &body.velocity_n_m_s);
    // What stands is known to no more than what moves: level enough that rates about east and north are those of pitch and roll.
    let [w_e, w_n, w_u] = body.rate_n_rad_s;
    let (sin, cos) = body.angles_rad[0].sin_cos();
    let angles = ahead(&body.angles_rad, &[-w_u, w_e * cos - w_n * sin, w_e * sin + w_n * cos]);
    let unseen_m = UNSEEN_M * age_s.powf(1.5);
    let (level_m, three_sigma_m) = (body.protection_level_m + unseen_m, body.three_sigma_m + unseen_m);
    let mut flags = bits::KNOWN;
    let mut set = |bit, when| flags |= if when { bit } else { 0 };
    set(bits::MEASURED, body.is_measured);
    set(bits::VALID, known && body.is_measured && level_m.is_finite());
    // Of a NaN neither holds, so that it alarms.
    let within = |most_m: f64| three_sigma_m <= most_m;
    set(bits::ALARM, !within(body.budget_m));
    set(bits::NEAR, !within(NEAR * body.budget_m));
    bytes.extend(position.iter().chain(&angles).flat_map(|x| x.to_le_bytes()));
    let small = [
        body.velocity_n_m_s,
        body.rate_n_rad_s,
        body.sigma_n_m,
        body.sigma_angles_rad,
        body.off_plan_n_m,
        body.off_plan_rad,
    ];
    let rest = [level_m, body.time_left_s.unwrap_or(f64::NAN)];
    bytes.extend(small.iter().flatten().chain(&rest).flat_map(|x| (*x as f32).to_le_bytes()));
    bytes.extend_from_slice(&flags.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(level_m: f64) -> Pose {
        let body = BodyPose {
            position_n_m: [10.0, -20.0, 150.0],
            velocity_n_m_s: [0.1, 0.0, -0.2],
            angles_rad: [0.0, 0.01, -0.02],
            rate_n_rad_s: [0.01, 0.02, -0.03],
            sigma_n_m: [0.001; 3],
            sigma_angles_rad: [1e-4; 3],
            off_plan_n_m: [0.003, f64::NAN, 0.0],
            off_plan_rad: [0.0, 0.002, f64::NAN],
            protection_level_m: 1.7 * level_m,
            three_sigma_m: level_m,
            budget_m: 0.015,
            time_left_s: None,
            is_measured: true,
        };
        let aid_states = vec![
            AidState { since_s: 0.005, trouble: None },
            AidState { since_s: f64::INFINITY, trouble: Some(AnomalyKind::STUCK_AXIS) },
            AidState { since_s: 12.3, trouble: Some(AnomalyKind::SATURATION) },
        ];
        let bodies = [Some(body), None];
        Pose { t_ns: 5_000_000_000, state: PoseState::Full, aids: 0b1011, aid_states, bodies }
    }

    const TROUBLES: [AnomalyKind; 2] = [AnomalyKind::GAP, AnomalyKind::STUCK_AXIS];

    fn encode(pose: &Pose, sequence: u64, age: Duration) -> Vec<u8> {
        super::encode(pose, sequence, age, &TROUBLES)
    }

    fn double(bytes: &[u8], at: usize) -> f64 {
        f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
    }

    fn flags(bytes: &[u8], body: usize) -> u32 {
        let at = 40 + 132 * body + 128;
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    }

    #[test]
    fn a_frame_is_laid_out_as_documented_and_predicted_to_now() {
        let bytes = encode(&pose(0.006), 7, Duration::from_millis(2));
        assert_eq!(bytes.len(), 316);
        assert_eq!(&bytes[..8], b"LPOS\x02\x00\x3c\x01");
        assert_eq!(bytes[30..32], [2, 3], "bodies and aids");
        assert_eq!(i64::from_le_bytes(bytes[16..24].try_into().unwrap()), 5_002_000_000);
        assert_eq!((bytes[24], bytes[28], bytes[29]), (0xd0, 1, 0), "2000 µs, full, fresh");
        assert!(
            (double(&bytes, 40) - 10.0002).abs() < 1e-12 && (double(&bytes, 56) - 149.9996).abs() < 1e-12
        );
        // Clockwise from north, so against the rate about up; pitch by the rate about east, which is to the right.
        assert!((double(&bytes, 64) - 6e-5).abs() < 1e-12 && (double(&bytes, 72) - 0.010_02).abs() < 1e-12);
        assert_eq!(flags(&bytes, 0), 1 | 2 | 4);
        assert!(double(&bytes, 172).is_nan());
        assert_eq!(bytes[40 + 112..40 + 116], 0.002_f32.to_le_bytes(), "pitch off the plan");
        // Since it last corrected, with the age of the pose, and the number of its trouble; one that is not listed has none.
        assert_eq!(bytes[304..], [1, 0, 0, 0, 0xff, 0xff, 2, 0, 0xce, 0x04, 0, 0]);
        assert_eq!(flags(&bytes, 1), 0, "a body of which nothing is known");
    }

    #[test]
    fn the_alarm_comes_before_the_limit_and_what_is_old_is_not_valid() {
        let of = |level_m, ms| flags(&encode(&pose(level_m), 0, Duration::from_millis(ms)), 0);
        assert_eq!(of(0.013, 0), 1 | 2 | 4 | 16);
        assert_eq!(of(0.016, 0), 1 | 2 | 4 | 8 | 16);
        assert_eq!(of(f64::NAN, 0), 1 | 2 | 8 | 16);
        let old = encode(&pose(0.006), 0, Duration::from_millis(150));
        assert_eq!((old[28], old[29], flags(&old, 0) & 4), (4, 1, 0));
        let aligning = Pose { state: PoseState::Aligning, ..pose(0.006) };
        assert_eq!(flags(&encode(&aligning, 0, Duration::ZERO), 0) & 4, 0);
    }
}
