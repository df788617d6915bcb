//! Has the gyro's bias changed on the way? Standing feet tell it again and again; a sensor that was knocked, heated or
//! has slipped where it is tied shows a bias that runs off far faster than the walk that the filter believes in.

use std::collections::VecDeque;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::contradictions::Contradiction;
use super::filter::{Filter, Setting, seconds};
use crate::event::Event;
use crate::ins::layout::ErrorState;

/// Swings over which two estimates of the bias are compared.
const SWINGS: usize = 12;
/// The change squared over the variance that it would have is below this in a sensor that is what it was: eight sigmas, as
/// neighbouring stances do not tell it independently.
const GATE: f64 = 64.0;
/// A smaller change is no contradiction, rad/s: warmth does as much to a cheap gyro, and so does the other foot where that is broken, for
/// what holds the feet together hands its errors on.
const SMALLEST_RAD_S: f64 = 0.004;
/// Where the other foot's estimate has changed by more than this share of it, it is not this gyro that has changed.
const OTHER_SHARE: f64 = 0.5;

/// The bias of one foot's gyro as it was after each of the last swings.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct GyroJump {
    seen: VecDeque<(i64, Vector3<f64>, Vector3<f64>)>,
}

impl GyroJump {
    /// Takes what is estimated at `t_ns`, rad/s, with its variances. The change since some swings ago, rad/s, and the time
    /// since then, s, if it contradicts a bias that walks by `walk_rad_s_sqrt_s`.
    fn take(
        &mut self,
        t_ns: i64,
        bias_b: Vector3<f64>,
        variances: Vector3<f64>,
        walk_rad_s_sqrt_s: f64,
    ) -> Option<(f64, f64)> {
        self.seen.push_back((t_ns, bias_b, variances));
        if self.seen.len() <= SWINGS {
            return None;
        }
        let (before_ns, before_b, before) = self.seen.pop_front()?;
        let (change_b, elapsed_s) = (bias_b - before_b, seconds(t_ns - before_ns));
        let walked = walk_rad_s_sqrt_s * walk_rad_s_sqrt_s * elapsed_s;
        // What is known later is known from the same stances, and more: the variance of the change is at most this.
        let squares: f64 = (0..3).map(|axis| change_b[axis].powi(2) / (before[axis] + walked)).sum();
        let change_rad_s = change_b.norm();
        (squares > GATE && change_rad_s > SMALLEST_RAD_S).then_some((change_rad_s, elapsed_s))
    }

    /// How much the bias has changed over the swings that are remembered, rad/s.
    fn changed_rad_s(&self, bias_b: &Vector3<f64>) -> f64 {
        self.seen.front().map_or(0.0, |(_, before_b, _)| (bias_b - before_b).norm())
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// A swing has come to its end: is the gyro what it was?
    pub(super) fn judge_gyro(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let block = ErrorState::GyroBias.of(sensor);
        let variances = self.eskf.covariance.block(block, block).diagonal();
        let walk_rad_s_sqrt_s = setting.tuning.imu_noise.gyro_bias_random_walk_rad_s_sqrt_s;
        let other_rad_s = if F == 2 {
            let other = &self.feet[1 - sensor];
            other.doubts.gyro_jump.changed_rad_s(&other.nav.gyro_bias_b)
        } else {
            0.0
        };
        let foot = &mut self.feet[sensor];
        // Without a field, a stance of a step tells nothing of the turn about the vertical, and swings spoil the rest.
        let aids = &setting.aids;
        if foot.stance.magnetics.readings() < 3 || foot.doubts.field_left_out || !(aids.zupt && aids.maru) {
            foot.doubts.gyro_jump.seen.clear();
            return;
        }
        let (t_ns, bias_b) = (foot.t_ns, foot.nav.gyro_bias_b);
        let jump = &mut foot.doubts.gyro_jump;
        let Some((change_rad_s, elapsed_s)) = jump.take(t_ns, bias_b, variances, walk_rad_s_sqrt_s) else {
            return;
        };
        jump.seen.clear();
        if other_rad_s > OTHER_SHARE * change_rad_s {
            return;
        }
        let way_m = (foot.nav.p_n - self.last_sure_place_n).xy().norm();
        self.tell(
            setting,
            sensor,
            &Contradiction::GyroChanged { change_deg_s: change_rad_s.to_degrees() },
            told,
        );
        // The change was in the heading for as long as it took to be seen, and what is seen is only a part of it. From here
        // on the bias is sought anew.
        let turned_rad = change_rad_s * elapsed_s;
        self.eskf.add_noise(&[block], &Vector3::repeat(change_rad_s * change_rad_s));
        self.eskf
            .add_noise(&[ErrorState::Attitude.of(sensor)], &Vector3::new(0.0, 0.0, turned_rad * turned_rad));
        self.beyond.reach(turned_rad.min(1.0) * way_m / F as f64, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bias_that_walks_is_none_and_one_that_runs_off_is() {
        let (walk, variances) = (2.6e-5, Vector3::repeat(1e-8));
        let run = |off_rad_s: f64| {
            let mut jump = GyroJump::default();
            (0..60).any(|k| {
                let bias_b = Vector3::new(0.01, 0.0, -0.003 + off_rad_s * f64::from(k));
                jump.take(i64::from(k) * 1_100_000_000, bias_b, variances, walk).is_some()
            })
        };
        assert!(!run(2e-5));
        assert!(run(5e-4));
    }
}
