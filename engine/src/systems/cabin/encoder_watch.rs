//! Encoders of rotator and legs that hang, and angles of the rotator that leap.
//!
//! A reading that never changes while it always did before is none. An angle that leaps by itself and stays there has not turned a
//! rotator of tons: what it leapt by is taken off its readings, and the state of its error is uncertain again, as for a leg.

use serde::{Deserialize, Serialize};

use super::filter::Filter;
use super::legs::Seated;
use super::rows::EncoderRow;

/// A channel hangs after so many readings of the same number, where it never had a quarter of that before.
const STUCK_AFTER: u32 = 12;
/// It has lived where it has changed so often.
const LIVES_AFTER: u32 = 20;
/// A rotator does not turn faster in less than this, rad/s², and smaller leaps are none, rad.
const ACCELERATION_RAD_S2: f64 = 0.02;
const LEAST_RAD: f64 = 3e-4;
const LEAP_SIGMAS: f64 = 6.0;
/// Readings farther apart say nothing of a leap, ns.
const LONGEST_NS: i64 = 260_000_000;
/// An angle reads wrongly where it is off by so much, rad.
const WRONG_RAD: f64 = 1e-4;

/// Angles a and b, then the legs.
const CHANNELS: usize = 8;

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct EncoderWatch {
    last: Option<EncoderRow>,
    before: Option<EncoderRow>,
    same: [u32; CHANNELS],
    longest_same: [u32; CHANNELS],
    changes: [u32; CHANNELS],
    leapt: Option<(usize, f64)>,
    /// What is taken off each angle, rad.
    pub(super) off_rad: [f64; 2],
}

fn channels(row: &EncoderRow) -> [f64; CHANNELS] {
    let [one, two, three, four, five, six] = row.legs_m;
    [row.a_rad, row.b_rad, one, two, three, four, five, six]
}

/// A channel as it is told.
pub(super) fn channel_name(channel: usize) -> String {
    match channel {
        0 => "rotator_a".to_owned(),
        1 => "rotator_b".to_owned(),
        leg => format!("leg_{}", leg - 1),
    }
}

impl EncoderWatch {
    /// The reading before the last.
    pub(super) fn before(&self) -> Option<EncoderRow> {
        self.before
    }

    /// The channels that hang, by a reading as it came.
    pub(super) fn stuck(&mut self, row: &EncoderRow) -> Vec<usize> {
        let mut stuck = Vec::new();
        if let Some(last) = &self.last {
            for (k, (now, last)) in channels(row).into_iter().zip(channels(last)).enumerate() {
                let same = if now == last { self.same[k] + 1 } else { 0 };
                if same == 0 && self.same[k] < STUCK_AFTER {
                    self.longest_same[k] = self.longest_same[k].max(self.same[k]);
                }
                self.same[k] = same;
                self.changes[k] = self.changes[k].saturating_add(u32::from(same == 0));
                let has_lived = self.changes[k] >= LIVES_AFTER;
                if has_lived && same >= STUCK_AFTER && 4 * self.longest_same[k] < STUCK_AFTER {
                    stuck.push(k);
                }
            }
        }
        self.before = self.last.replace(*row);
        stuck
    }

    /// The angle that is off the line of the last two readings, and by how much, rad; `sigma_rad` is the maker's. Asked after `stuck`
    /// has taken the reading.
    fn leap(&self, earlier: &EncoderRow, sigma_rad: f64) -> Option<(usize, f64)> {
        let (row, last) = (self.last?, self.before?);
        let (dt_ns, dt_before_ns) = (row.t_ns - last.t_ns, last.t_ns - earlier.t_ns);
        if dt_ns <= 0 || dt_before_ns <= 0 || dt_ns.max(dt_before_ns) > LONGEST_NS {
            return None;
        }
        let (dt_s, dt_before_s) = (dt_ns as f64 * 1e-9, dt_before_ns as f64 * 1e-9);
        let turned = 0.5 * ACCELERATION_RAD_S2 * dt_s * (dt_s + dt_before_s);
        let most = (LEAP_SIGMAS * sigma_rad).max(LEAST_RAD) + turned;
        let off = |angle: fn(&EncoderRow) -> f64| {
            angle(&row) - angle(&last) - (angle(&last) - angle(earlier)) * (dt_s / dt_before_s)
        };
        let off_rad = [off(|row| row.a_rad), off(|row| row.b_rad)];
        let axis = usize::from(off_rad[1].abs() > off_rad[0].abs());
        (off_rad[axis].abs() > most).then_some((axis, off_rad[axis]))
    }
}

impl Filter {
    /// Whether an angle has leapt by this reading, as it came: told at once, taken off when the next reading is there, too.
    pub(super) fn angle_leap(&mut self, earlier: Option<EncoderRow>) -> Option<Seated> {
        let watch = &mut self.encoder_watch;
        if let Some((axis, by_rad)) = watch.leapt.take() {
            // It has leapt by the reading before: is it still there?
            let (row, last) = (watch.last?, watch.before?);
            let moved = if axis == 0 { row.a_rad - last.a_rad } else { row.b_rad - last.b_rad };
            if moved * by_rad > -0.5 * by_rad * by_rad {
                watch.off_rad[axis] += by_rad;
                let state = self.states.rotator + axis;
                self.open(state, LEAST_RAD + 0.05 * by_rad.abs());
            }
            return None;
        }
        let (axis, by_rad) = watch.leap(&earlier?, self.rig.rotator_sigma_rad)?;
        watch.leapt = Some((axis, by_rad));
        Some(Seated::Turned { axis, by_rad })
    }

    /// The angles that read wrongly, and what each reads too much, rad.
    pub(super) fn wrong_angles(&self) -> impl Iterator<Item = (usize, f64)> + use<'_> {
        let most_rad = WRONG_RAD.max(6.0 * self.rig.rotator_sigma_rad);
        (0..2).filter_map(move |axis| {
            let off_rad = self.encoder_watch.off_rad[axis] + self.x[self.states.rotator + axis];
            (off_rad.abs() > most_rad).then_some((axis, off_rad))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(k: i64, legs_m: [f64; 6], a_rad: f64) -> EncoderRow {
        EncoderRow { t_ns: k * 50_000_000, a_rad, b_rad: 0.02 + 1e-5 * (k % 7) as f64, legs_m }
    }

    fn legs(k: i64) -> [f64; 6] {
        std::array::from_fn(|leg| 2.0 + 1e-3 * libm::sin(0.06 * k as f64 + leg as f64))
    }

    #[test]
    fn a_channel_that_lived_and_hangs_is_named_and_one_that_stands_from_the_beginning_is_not() {
        let mut watch = EncoderWatch::default();
        for k in 0..100 {
            let mut legs_m = legs(k);
            if k >= 50 {
                legs_m[2] = legs(50)[2];
            }
            let stuck = watch.stuck(&row(k, legs_m, 0.1));
            assert_eq!(stuck, if k >= 62 { vec![4] } else { vec![] }, "{k}");
        }
        assert_eq!(channel_name(4), "leg_3");
    }

    #[test]
    fn an_angle_that_leaps_is_seen_and_one_that_turns_is_not() {
        let mut watch = EncoderWatch::default();
        for k in 0..60 {
            let swing = 2e-3 * libm::sin(0.06 * k as f64);
            let earlier = watch.before;
            let _ = watch.stuck(&row(k, legs(k), swing + if k >= 40 { 2e-3 } else { 0.0 }));
            let Some(earlier) = earlier else { continue };
            let found = watch.leap(&earlier, 2e-6);
            if k == 40 {
                let (axis, by_rad) = found.unwrap();
                assert!(axis == 0 && (by_rad - 2e-3).abs() < 5e-5, "{by_rad}");
            } else {
                assert!(found.is_none() || k == 41, "{k}: {found:?}");
            }
        }
    }
}
