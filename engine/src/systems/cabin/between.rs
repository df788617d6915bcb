//! Where the platform is in the cabin between two readings of the encoders, and a little beyond the last.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Rotation3, Vector3, Vector6};

use super::filter::Filter;
use super::joints::PlatformInCabin;
use super::rig::Target;
use super::rows::RayRow;
use super::session::EPOCH_NS;

/// The platform's attitude c_bp, how it changes with the legs, and the rotator's axes in b.
pub(super) type PlatformAttitude = (Matrix3<f64>, Matrix6<f64>, [Vector3<f64>; 2]);

/// Encoders are read across a hole, and beyond their last reading, for so long at least, ns.
const HOLE_NS: i64 = 160_000_000;
/// Beyond the last reading for one and a half times the usual time between two and an epoch, and so long at least and at most, ns.
const HELD_AFTER_NS: i64 = 125_000_000;
const HELD_MOST_NS: i64 = 450_000_000;
/// Between the two readings by whose line the platform goes on beyond the last, at least, ns: its noise is theirs, divided by this.
const LINE_NS: i64 = 100_000_000;
/// A ray waits for the next reading for the usual time between two and this, ns; it then is still among the strapdown's last moments.
const WAITS_NS: i64 = 150_000_000;
const WAITS_MOST_NS: i64 = 500_000_000;
/// How the platform accelerates in the cabin, which a line from reading to reading does not know: sigma, m/s².
const UNSEEN_M_S2: f64 = 0.07;

/// A place in b that may move and depend on the legs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) at_b: Vector3<f64>,
    pub(super) rate_b: Vector3<f64>,
    /// Variance of that on each axis by the noise of two readings, as how much the variance of a reading counts in it, 1/s².
    rate_readings: f64,
    pub(super) by_legs: Option<Matrix3x6<f64>>,
    /// How it changes with the rotator's angles.
    pub(super) by_angles: [Vector3<f64>; 2],
    /// How much the variance of a reading counts in it.
    readings: f64,
    /// What acceleration may have done since, m.
    pub(super) unseen_m: f64,
}

impl Place {
    fn fixed(at_b: Vector3<f64>) -> Place {
        let rate_b = Vector3::zeros();
        Place {
            at_b,
            rate_b,
            rate_readings: 0.0,
            by_legs: None,
            by_angles: [Vector3::zeros(); 2],
            readings: 1.0,
            unseen_m: 0.0,
        }
    }

    pub(super) fn at_rest(self) -> Place {
        Place { rate_b: Vector3::zeros(), ..self }
    }
}

/// Two readings, and where a time lies on the line through them: 0 at the first, 1 at the second, more beyond.
struct Between<'a> {
    from: &'a PlatformInCabin,
    to: &'a PlatformInCabin,
    span_s: f64,
    share: f64,
    /// When the second was there, ns, and how long after it the time is, s; `None` up to it.
    beyond: Option<(i64, f64)>,
}

impl Filter {
    /// What the encoders delay, ns.
    pub(super) fn encoder_delay_ns(&self) -> i64 {
        ((self.rig.encoder_delay_s + self.x[self.states.encoder_delay]) * 1e9) as i64
    }

    /// The usual time between two readings of the encoders, ns.
    pub(super) fn between_readings_ns(&self) -> i64 {
        let tags = self.seats.iter().map(|(seat_ns, _)| *seat_ns);
        tags.clone().zip(tags.skip(1)).map(|(a, b)| b - a).min().unwrap_or(0)
    }

    /// Whether the encoders still say where the platform is at a time, ns.
    pub(super) fn is_seated(&self, t_ns: i64) -> bool {
        self.seats.back().is_some_and(|(last_ns, _)| t_ns - last_ns < self.held_after_ns())
    }

    fn held_after_ns(&self) -> i64 {
        (self.between_readings_ns() * 3 / 2 + EPOCH_NS).clamp(HELD_AFTER_NS, HELD_MOST_NS)
    }

    /// Whether a ray to the platform, known at a time, is weighed better when the next reading of the encoders is there: beyond the
    /// last one the noise of a rate would pass for a delay. `reading_ns` is the newest one that has come and was not yet taken.
    pub(super) fn waits_for_reading(&self, ray: &RayRow, t_ns: i64, reading_ns: Option<i64>) -> bool {
        let is_on_platform = matches!(self.rig.targets.get(ray.target), Some(Target::Platform(_)));
        let shown_ns = ray.t_ns - self.station_delay_ns() + self.encoder_delay_ns();
        // What has come and was not yet taken counts: by the last one taken the encoders would seem to be silent.
        let newest_ns = self
            .seats
            .back()
            .map(|(last_ns, _)| reading_ns.map_or(*last_ns, |come_ns| come_ns.max(*last_ns)));
        let waits_ns = (self.between_readings_ns() + WAITS_NS).min(WAITS_MOST_NS);
        is_on_platform
            && t_ns - ray.t_ns < waits_ns
            && newest_ns
                .is_some_and(|newest_ns| shown_ns > newest_ns && t_ns - newest_ns < self.held_after_ns())
    }

    fn between(&self, t_ns: i64) -> Option<Between<'_>> {
        let t_ns = t_ns + self.encoder_delay_ns();
        let count = self.seats.len();
        let after = self.seats.partition_point(|(seat_ns, _)| *seat_ns < t_ns);
        let second = after.clamp(1, count.max(2) - 1).min(count.checked_sub(1)?);
        let (to_ns, to) = &self.seats[second];
        let near = second.saturating_sub(1);
        let far = (0..near).rev().find(|k| to_ns - self.seats[*k].0 >= LINE_NS);
        let is_line = |k: &usize| after >= count && to_ns - self.seats[*k].0 <= 2 * LINE_NS;
        let first = far.filter(is_line).filter(|_| to_ns - self.seats[near].0 < LINE_NS).unwrap_or(near);
        let (from_ns, from) = &self.seats[first];
        if (t_ns - from_ns).abs().min((t_ns - to_ns).abs()) > HOLE_NS.max(self.held_after_ns()) {
            return None;
        }
        let beyond =
            (after >= count).then(|| (to_ns - self.encoder_delay_ns(), (t_ns - to_ns) as f64 * 1e-9));
        let span_s = (to_ns - from_ns) as f64 * 1e-9;
        if span_s <= 0.0 || span_s > 0.5 {
            let near = if (t_ns - from_ns).abs() < (t_ns - to_ns).abs() { from } else { to };
            return Some(Between { from: near, to: near, span_s: 0.0, share: 1.0, beyond: None });
        }
        Some(Between { from, to, span_s, share: (t_ns - from_ns) as f64 * 1e-9 / span_s, beyond })
    }

    /// Where a prism is in b at a time; `None` where the encoders do not say.
    pub(super) fn place_of(&self, target: usize, t_ns: i64) -> Option<Place> {
        match self.rig.targets.get(target)? {
            Target::Body(at_b) => Some(Place::fixed(*at_b)),
            Target::Elsewhere => None,
            Target::Platform(place_p) => self.on_platform(place_p, t_ns),
        }
    }

    /// A point of the platform in b at a time.
    pub(super) fn on_platform(&self, place_p: &Vector3<f64>, t_ns: i64) -> Option<Place> {
        let Between { from, to, span_s, share, beyond } = self.between(t_ns)?;
        let ((from_b, _), (to_b, by_legs)) = (from.point(place_p), to.point(place_p));
        let by_angles = to.axes_b.map(|axis_b| axis_b.cross(&(to_b - to.pivot_b)));
        let [a_rad, b_rad] = self.angle_biases();
        let biased_b = by_legs * self.leg_biases() + by_angles[0] * a_rad + by_angles[1] * b_rad;
        let (from_b, to_b) = (from_b - biased_b, to_b - biased_b);
        let rate_b = if span_s > 0.0 { (to_b - from_b) / span_s } else { Vector3::zeros() };
        let weights = [1.0 - share, share];
        let mut place = Place {
            at_b: from_b + (to_b - from_b) * share,
            rate_b,
            rate_readings: if span_s > 0.0 { 2.0 / (span_s * span_s) } else { 0.0 },
            by_legs: Some(by_legs),
            by_angles,
            readings: weights.iter().map(|weight| weight * weight).sum::<f64>().max(1.0),
            unseen_m: UNSEEN_M_S2 * (share * (share - 1.0)).abs() * span_s * span_s / 2.0,
        };
        if let Some((share, (to_ns, after_s))) = self.steady.in_n().zip(beyond)
            && let Some((at_b, rate_b)) = self.goes_on_in_n([&from_b, &to_b], [to_ns, t_ns], span_s, after_s)
        {
            place = Place { at_b, rate_b, unseen_m: share * place.unseen_m, ..place };
        }
        Some(place)
    }

    /// The platform's attitude in b at a time, how it changes with the legs, and the rotator's axes.
    pub(super) fn platform_attitude(&self, t_ns: i64) -> Option<PlatformAttitude> {
        let Between { from, to, share, .. } = self.between(t_ns)?;
        let turned = Rotation3::from_matrix_unchecked(to.c_bp * from.c_bp.transpose()).scaled_axis();
        Some((Rotation3::from_scaled_axis(turned * share).into_inner() * from.c_bp, to.by_legs, to.axes_b))
    }

    /// The variance of a leg in a place, from row to row, m².
    pub(super) fn leg_noise_m2(&self, place: &Place) -> f64 {
        (self.tuning.leg_noise * self.rig.leg_sigma_m).powi(2) * place.readings
    }

    /// By how much less than the velocity of a place is known of it, of 1: two noisy readings make a rate of their own noise where
    /// there is hardly any, and a delay must not be found in that (the shrinkage of James and Stein).
    pub(super) fn of_velocity(&self, velocity: &Vector3<f64>, place: &Place) -> f64 {
        let Some(by_legs) = place.by_legs else { return 1.0 };
        let reading_m2 = (self.tuning.leg_noise * self.rig.leg_sigma_m).powi(2);
        let noise = reading_m2 * place.rate_readings * by_legs.norm_squared();
        (1.0 - noise / velocity.norm_squared().max(1e-12)).max(0.0)
    }

    /// What the rotator's angles are estimated to read too much, rad.
    pub(super) fn angle_biases(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.x[self.states.rotator + axis])
    }

    /// The estimated biases of the legs, m: reading − length.
    pub(super) fn leg_biases(&self) -> Vector6<f64> {
        Vector6::from_fn(|leg, _| self.x[self.states.legs + leg])
    }
}
