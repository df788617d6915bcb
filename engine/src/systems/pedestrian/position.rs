//! Where the inspector is, how sure that is, and which way he faces: what the filter tells.

use nalgebra::{Matrix3, Vector3};

use super::filter::{Filter, Setting, seconds};
use crate::event::{Part, TrackPoint};
use crate::ins::layout::ErrorState;
use crate::rotation::heading;

/// A foot whose last sample is so much older than the other's is left out, ns: the inspector has
/// gone on without it.
const LEFT_BEHIND_NS: i64 = 500_000_000;

impl<const B: usize, const F: usize> Filter<B, F> {
    /// The sensors of the feet that keep up.
    pub(super) fn present(&self) -> impl Iterator<Item = usize> + Clone {
        let newest_ns = self.feet.iter().map(|foot| foot.t_ns).max().unwrap_or(0);
        let keeps_up = self.feet.each_ref().map(|foot| newest_ns - foot.t_ns <= LEFT_BEHIND_NS);
        (0..F).filter(move |sensor| keeps_up[*sensor])
    }

    pub(super) fn middle_p_n(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self.present().map(|sensor| self.feet[sensor].nav.p_n).sum();
        sum / self.present().count() as f64
    }

    /// Covariance of the middle of the feet, m².
    pub(super) fn middle_covariance(&self) -> Matrix3<f64> {
        let (mut sum, mut pairs) = (Matrix3::zeros(), 0);
        for a in self.present() {
            for b in self.present() {
                sum += self.eskf.covariance.block(ErrorState::Position.of(a), ErrorState::Position.of(b));
                pairs += 1;
            }
        }
        sum / f64::from(pairs)
    }

    pub(super) fn sigma_plan_m(&self) -> f64 {
        let covariance = self.told_covariance().0;
        (covariance[(0, 0)] + covariance[(1, 1)]).max(0.0).sqrt()
    }

    pub(super) fn sigma_heading_rad(&self, sensor: usize) -> f64 {
        let attitude = ErrorState::Attitude.of(sensor);
        self.eskf.covariance.block(attitude, attitude)[(2, 2)].max(0.0).sqrt()
    }

    /// Length of the path so far, m.
    pub(crate) fn distance_m(&self) -> f64 {
        self.walked.distance_m(F)
    }

    /// For how long a foot whose last sample is so late is taken to have gone on at its velocity, s.
    pub(super) fn carried_on_s(late_s: f64) -> f64 {
        if late_s > 0.0 && late_s < 0.05 { late_s } else { 0.0 }
    }

    /// Where the inspector is at `t_ns`, the time of the last step.
    #[inline]
    pub(crate) fn middle_point(&self, setting: &Setting, t_ns: i64) -> TrackPoint {
        let mut feet = [None; 2];
        let mut middle = Vector3::zeros();
        for sensor in self.present() {
            let foot = &self.feet[sensor];
            // A foot whose last sample is older than the epoch has moved on at its velocity.
            let late_s = Self::carried_on_s(seconds(t_ns - foot.t_ns));
            let p_n = if late_s > 0.0 { foot.nav.p_n + foot.nav.v_n * late_s } else { foot.nav.p_n };
            middle += p_n;
            feet[setting.feet[sensor].index()] =
                Some(Part { position_n_m: p_n.into(), stance: foot.stance.stands });
        }
        middle /= self.present().count() as f64;
        let (covariance, heading_variance) = self.told_covariance();
        let sigma = |axis: usize| covariance[(axis, axis)].max(0.0).sqrt();
        TrackPoint {
            t_ns,
            position_n_m: middle.into(),
            heading_rad: self.walked.heading_rad(heading(&self.feet[0].nav.c_nb)),
            sigma_heading_rad: heading_variance.sqrt(),
            sigma_n_m: [sigma(0), sigma(1), sigma(2)],
            covariance_en_m2: covariance[(0, 1)],
            tilt: None,
            parts: feet,
        }
    }
}
