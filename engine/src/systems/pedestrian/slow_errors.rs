//! What errs slowly, and is the same from stance to stance: the error states beside the strapdown's.
//!
//! Taken for independent noise, these make a filter sure of a wrong track: a compass deviation turns
//! every heading of a straight walk alike, a scale error stretches every stride, the weather lifts
//! every height. As states they are what they are, and turns, markers and the other foot show them.
//!
//! | block | of | components |
//! |---|---|---|
//! | deviation | each foot | A, B, C of the ship's compass, rad: δ = A + B·sin ψ + C·cos ψ, ψ the azimuth of the x axis. A is what does not turn with the foot (soft iron, mounting, declination), B and C hard iron |
//! | stride | each foot | what a stride reads too much: along it, across it to the left, and upwards, as shares of its length in plan (scale factors and misalignment, which zero velocity cannot see) |
//! | surroundings | both feet | the field's deflection by what stands around, rad; the pressure's drift, as height, m; the separation of the feet, m |
//!
//! Like the biases of the notation page each is estimated as nominal value + residual error, where
//! the residual is true − estimated.

use nalgebra::{Matrix3, RowVector3, Vector3};
use serde::{Deserialize, Serialize};

use super::filter::{Filter, Setting, seconds};
use super::foot::FootState;
use super::tuning::{SlowErrorsTuning, Tuning};
use crate::ins::layout::{BLOCKS_A_SENSOR, ErrorState};

/// Blocks of one foot: those of its strapdown, deviation and stride.
pub(crate) const BLOCKS_A_FOOT: usize = BLOCKS_A_SENSOR + 2;

/// Blocks of the joint filter of `feet` feet.
pub(crate) const fn blocks(feet: usize) -> usize {
    BLOCKS_A_FOOT * feet + 1
}

/// The block of a foot's compass deviation. The strapdowns' blocks come first, foot by foot.
pub(crate) const fn deviation(sensor: usize, feet: usize) -> usize {
    BLOCKS_A_SENSOR * feet + 2 * sensor
}

/// The block of a foot's stride error.
pub(crate) const fn stride(sensor: usize, feet: usize) -> usize {
    BLOCKS_A_SENSOR * feet + 2 * sensor + 1
}

/// The block of what both feet share.
pub(crate) const fn surroundings(feet: usize) -> usize {
    BLOCKS_A_FOOT * feet
}

/// How a compass deviation turns the field's azimuth when the x axis has the azimuth `heading_rad`:
/// azimuth = declination + row · (A, B, C).
pub(crate) fn deviation_row(heading_rad: f64) -> RowVector3<f64> {
    RowVector3::new(1.0, libm::sin(heading_rad), libm::cos(heading_rad))
}

/// How much too far a way `moved_n` is read: the product with the stride error.
#[inline]
pub(crate) fn stride_matrix(moved_n: &Vector3<f64>) -> Matrix3<f64> {
    let (east, north) = (moved_n.x, moved_n.y);
    let length = (east * east + north * north).sqrt();
    Matrix3::new(east, -north, 0.0, north, east, 0.0, 0.0, 0.0, length)
}

/// The components of the surroundings.
pub(crate) const DEFLECTION: usize = 0;
pub(crate) const PRESSURE_DRIFT: usize = 1;
pub(crate) const SEPARATION: usize = 2;

/// What is assumed of a field of which nothing is known counts as so many components that were seen, more than two.
const FIRST_COMPONENTS: f64 = 4.0;
/// So much at least is kept of a deflection on the way between two stances, however long.
const LEAST_KEPT: f64 = 1e-3;

/// A row that sees one component of the surroundings.
pub(crate) fn surroundings_row(component: usize, by: f64) -> RowVector3<f64> {
    let mut row = RowVector3::zeros();
    row[component] = by;
    row
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// Gives the slow errors their first covariance.
    pub(crate) fn set_first_slow_errors(&mut self, tuning: &Tuning) {
        let squares = |a: f64, b: f64, c: f64| Matrix3::from_diagonal(&Vector3::new(a * a, b * b, c * c));
        let slow = &tuning.slow_errors;
        for sensor in 0..F {
            let (turning, fixed) = (slow.hard_iron_deviation_rad, slow.fixed_deviation_rad);
            let (plan, up) = (slow.stride_share, slow.stride_up_share);
            self.eskf.covariance.set_diagonal(deviation(sensor, F), squares(fixed, turning, turning));
            self.eskf.covariance.set_diagonal(stride(sensor, F), squares(plan, plan, up));
        }
        let shared = slow.common_deviation_rad * slow.common_deviation_rad;
        let both: [usize; F] = std::array::from_fn(|sensor| deviation(sensor, F));
        self.eskf.add_noise(&both, &Vector3::new(shared, 0.0, 0.0));
        let deflection_rad = slow.first_deflection_rad.max(slow.deflection_rad);
        let first = squares(deflection_rad, slow.first_pressure_sigma_m, tuning.separation_spread_m);
        self.eskf.covariance.set_diagonal(surroundings(F), first);
    }

    /// The compass of a foot may be off by so much more, rad, whichever way the foot points.
    pub(crate) fn doubt_compass(&mut self, sensor: usize, rad: f64) {
        self.eskf.add_noise(&[deviation(sensor, F)], &Vector3::repeat(0.5 * rad * rad));
    }

    /// The foot has moved by `moved_n` according to its strapdown: takes the estimated stride error
    /// off the position at once; its covariance follows in [`Self::stretch`].
    #[inline]
    pub(super) fn shorten(&mut self, sensor: usize, moved_n: &Vector3<f64>) {
        let foot = &mut self.feet[sensor];
        foot.nav.p_n -= stride_matrix(moved_n) * foot.stride_error;
        foot.moved_n += moved_n;
    }

    /// Brings the covariance of the position up to how far the foot has moved. As nothing but an
    /// update asks for it, once a swing is enough.
    pub(super) fn stretch(&mut self, sensor: usize) {
        let moved_n = std::mem::take(&mut self.feet[sensor].moved_n);
        if moved_n == Vector3::zeros() {
            return;
        }
        let position = ErrorState::Position.of(sensor);
        self.eskf.add_multiple(position, stride(sensor, F), &stride_matrix(&moved_n));
    }

    /// Variance of the field's deflection, rad²: as large as the field of this walk says, and at least as assumed; as is
    /// assumed of a field of which nothing is known, until enough places have been seen.
    ///
    /// What stands around bends the field any way. Two of the three components show, in the strength of the horizontal
    /// and of the vertical part from stance to stance; the third, which turns it, is as large as each of those on the mean.
    fn deflection_rad2(&self, slow: &SlowErrorsTuning) -> f64 {
        let seen = self.feet.iter().map(|foot| 0.5 * foot.field_spread_rad2).fold(0.0, f64::max);
        let shown = seen.max(slow.deflection_rad * slow.deflection_rad);
        let first = shown.max(slow.first_deflection_rad * slow.first_deflection_rad);
        let places = self.feet.iter().map(|foot| foot.field_reach.places(slow.deflection_length_m));
        // Each place shows two components. Of a variance that is only estimated from n of them, what comes next has one
        // that is larger by n/(n − 2).
        let components = 2.0 * places.fold(0.0, f64::max);
        (FIRST_COMPONENTS * first + components * shown) / (FIRST_COMPONENTS + components - 2.0)
    }

    /// Over which way a deflection stays the same, m: the part that this walk shows by the length that it shows, the part
    /// that is only assumed by the assumed one.
    fn deflection_length_m(&self, slow: &SlowErrorsTuning) -> f64 {
        let (assumed_rad, assumed_m) = (slow.deflection_rad, slow.deflection_length_m);
        let shown = |foot: &FootState| 0.5 * foot.field_spread_rad2;
        let most = self.feet.iter().max_by(|a, b| shown(a).total_cmp(&shown(b)));
        let Some(foot) = most else { return assumed_m };
        let share = shown(foot) / (shown(foot) + assumed_rad * assumed_rad);
        assumed_m + share * (foot.field_reach.length_m(assumed_m) - assumed_m)
    }

    /// The slow errors go on by what a foot, now standing, has walked since the last stance of any.
    pub(super) fn drift(&mut self, setting: &Setting, sensor: usize) {
        let slow = &setting.tuning.slow_errors;
        let place_n = self.feet[sensor].nav.p_n;
        let t_ns = self.feet[sensor].t_ns;
        let walked_m = (place_n - self.slow.place_n).xy().norm();
        let elapsed_s = seconds(t_ns - self.slow.t_ns).max(0.0);
        self.slow.place_n = place_n;
        self.slow.t_ns = t_ns;
        let kept = libm::exp(-walked_m / self.deflection_length_m(slow)).max(LEAST_KEPT);
        self.slow.surroundings[DEFLECTION] *= kept;
        let block = surroundings(F);
        self.eskf.scale(block, &Vector3::new(kept, 1.0, 1.0));
        let grown = |density: f64| density * density * elapsed_s;
        let deflection = self.deflection_rad2(slow) * (1.0 - kept * kept);
        let drift =
            Vector3::new(deflection, grown(slow.pressure_drift_m_sqrt_s) * self.pressure_unrest(), 0.0);
        self.eskf.add_noise(&[block], &drift);
        for other in 0..F {
            let walks = [
                (deviation(other, F), slow.deviation_walk_rad_sqrt_s),
                (stride(other, F), slow.stride_walk_sqrt_s),
            ];
            for (block, density) in walks {
                self.eskf.add_noise(&[block], &Vector3::repeat(grown(density)));
            }
        }
    }
}

/// The nominal values that both feet share, and when and where they were last brought up to date.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Slow {
    /// Deflection of the field, rad; drift of the pressure, m; separation, m.
    pub(crate) surroundings: Vector3<f64>,
    pub(super) place_n: Vector3<f64>,
    t_ns: i64,
}

impl Slow {
    pub(crate) fn new(place_n: Vector3<f64>, t_ns: i64) -> Self {
        Slow { surroundings: Vector3::zeros(), place_n, t_ns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::nav_state::NavState;
    use crate::systems::pedestrian::foot::FootState;

    #[test]
    fn every_block_has_a_place_of_its_own() {
        for feet in [1, 2] {
            let mut places: Vec<usize> = (0..BLOCKS_A_SENSOR * feet).collect();
            for sensor in 0..feet {
                places.extend([deviation(sensor, feet), stride(sensor, feet)]);
            }
            places.push(surroundings(feet));
            assert_eq!(places, (0..blocks(feet)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_stride_error_stretches_turns_and_lifts_the_way() {
        let moved_n = Vector3::new(3.0, 4.0, 1.0);
        let read = |error: Vector3<f64>| stride_matrix(&moved_n) * error;
        assert_eq!(read(Vector3::x()), Vector3::new(3.0, 4.0, 0.0));
        assert_eq!(read(Vector3::y()), Vector3::new(-4.0, 3.0, 0.0));
        assert_eq!(read(Vector3::z()), Vector3::new(0.0, 0.0, 5.0));
    }

    #[test]
    fn how_far_the_field_is_deflected_is_learnt_from_its_strength_and_dip() {
        let nav = NavState {
            c_nb: Matrix3::identity(),
            v_n: Vector3::zeros(),
            p_n: Vector3::zeros(),
            gyro_bias_b: Vector3::zeros(),
            accelerometer_bias_b: Vector3::zeros(),
        };
        // Disturbances of so much on every axis, in a field of 37 µT to the north and 30 µT down.
        for disturbance_ut in [0.0, 4.0, 8.0] {
            let mut filter =
                Filter::<{ blocks(1) }, 1>::new([FootState::new(nav.clone(), 0, Vector3::zeros())]);
            for k in 0..400 {
                filter.feet[0].nav.p_n.x += 2.0;
                let wave = |frequency: f64| 2.0_f64.sqrt() * libm::sin(f64::from(k) * frequency);
                let off_ut = Vector3::new(wave(0.71), wave(0.53), wave(0.37)) * disturbance_ut;
                filter.weigh_field(0, &(Vector3::new(0.0, 37.0, -30.0) + off_ut));
            }
            let slow = SlowErrorsTuning::default();
            let (learnt_rad, drawn_rad) = (filter.deflection_rad2(&slow).sqrt(), disturbance_ut / 37.0);
            let expected_rad = drawn_rad.max(slow.deflection_rad);
            assert!((learnt_rad / expected_rad - 1.0).abs() < 0.3, "{learnt_rad} {drawn_rad}");
        }
    }

    #[test]
    fn a_hard_iron_on_the_x_axis_deviates_as_the_sine_of_the_heading() {
        // A field of strength 1 to the north and iron of 0.01 along the x axis, at every heading.
        for heading_rad in [-2.0, -0.5, 0.0, 0.7, 1.6, 3.0] {
            let field = Vector3::new(0.0, 1.0, 0.0)
                + 0.01 * Vector3::new(libm::sin(heading_rad), libm::cos(heading_rad), 0.0);
            let deviation_rad = crate::rotation::azimuth(field.x, field.y);
            let expected = (deviation_row(heading_rad) * Vector3::new(0.0, 0.01, 0.0))[0];
            assert!((deviation_rad - expected).abs() < 1e-4, "{deviation_rad} {expected}");
        }
    }
}
