//! A row of the result: pose, how sure it is, and what it rests on.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::covariance::Sparse;
use super::filter::Filter;
use super::measure::push;
use super::states::{MOUNTING, VELOCITY};
use super::tape::Columns;
use crate::rotation::{Angles, Forward, cayley, skew};

/// How far the filter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// The attitude is still being found.
    Aligning,
    /// Every kind of aid that the run has corrects it.
    Full,
    /// Some kind of aid is missing.
    Reduced,
    /// No position aid in the last half second.
    Coasting,
}

impl Status {
    /// As files have it.
    pub fn word(self) -> &'static str {
        match self {
            Status::Aligning => "aligning",
            Status::Full => "full",
            Status::Reduced => "reduced",
            Status::Coasting => "coasting",
        }
    }
}

/// One row: the cabin's pose, or the platform's.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    /// When, ns.
    pub t_ns: i64,
    /// Position of the origin in n, m.
    pub p_n: Vector3<f64>,
    /// Attitude: turns the body into n.
    pub c_nb: Matrix3<f64>,
    /// Velocity of the origin in n, m/s.
    pub v_n: Vector3<f64>,
    /// Covariance of position (m) and of a small rotation in n (rad), in this order.
    pub covariance: Matrix6<f64>,
    /// How far the filter is.
    pub status: Status,
    /// What has corrected it within the last half second: bits of [`Aids`](super::aids::Aids).
    pub aids: u64,
    /// Seconds until the sigma, at its present growth, is at a third of the budget; `None` while it does not grow.
    pub time_left_s: Option<f64>,
    /// Whether it is where the body was last, as no device says it any more.
    pub is_held: bool,
}

/// Three-dimensional errors stay within so many sigmas of the least certain direction in all but 10⁻⁵ of the epochs, where they
/// are normal: the quantile of a χ² of three is 25.9.
const PROTECTION: f64 = 5.1;

/// How the platform moves in the cabin where no encoder says it: sigma after a second, and at most, m.
const UNSEEN_M_S: f64 = 0.02;
const UNSEEN_M: f64 = 0.08;

impl Row {
    /// Heading of y, its elevation, and the roll about it, rad.
    pub fn angles(&self) -> Angles {
        Angles::of(&self.c_nb, Forward::Y)
    }

    /// Sigmas of the position east, north and up, m.
    pub fn sigma_n_m(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.covariance[(axis, axis)].max(0.0).sqrt())
    }

    /// Sigmas of yaw, pitch and roll, rad.
    pub fn sigma_angles_rad(&self) -> [f64; 3] {
        self.angles().sigmas_rad(&self.covariance.fixed_view::<3, 3>(3, 3).into_owned())
    }

    /// The position is within so much of the truth but for one epoch in ten thousand, m.
    pub fn protection_level_m(&self) -> f64 {
        PROTECTION * self.largest_sigma_m()
    }

    /// Sigma of the position in its least certain direction, m.
    pub fn largest_sigma_m(&self) -> f64 {
        let position = self.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        position.symmetric_eigenvalues().max().max(0.0).sqrt()
    }

    /// The row where it is told while a correction is spread over some epochs: so far off, which its sigma says, too.
    pub(super) fn behind(mut self, behind_n: &Vector3<f64>) -> Row {
        self.p_n += behind_n;
        let mut position = self.covariance.fixed_view_mut::<3, 3>(0, 0);
        position += behind_n * behind_n.transpose();
        self
    }

    pub(super) fn smoothed(
        &self,
        moved: &Vector6<f64>,
        less: &Matrix6<f64>,
        velocity: &Vector3<f64>,
        _velocity_less: &Vector3<f64>,
    ) -> Row {
        let mut covariance = self.covariance - less;
        covariance = (covariance + covariance.transpose()) * 0.5;
        for k in 0..6 {
            // Rounding must not leave less than nothing.
            covariance[(k, k)] = covariance[(k, k)].max(1e-3 * self.covariance[(k, k)]);
        }
        Row {
            p_n: self.p_n + moved.fixed_rows::<3>(0),
            c_nb: cayley(&moved.fixed_rows::<3>(3).into_owned()) * self.c_nb,
            v_n: self.v_n + velocity,
            covariance,
            ..self.clone()
        }
    }
}

/// A pose with its Jacobians by place, attitude and velocity.
pub(super) struct Pose {
    p_n: Vector3<f64>,
    c_nb: Matrix3<f64>,
    v_n: Vector3<f64>,
    jacobians: [Sparse; 3],
    noise: Matrix6<f64>,
    is_held: bool,
}

impl Pose {
    pub(super) fn place(&self) -> Vector3<f64> {
        self.p_n
    }

    pub(super) fn is_held(&self) -> bool {
        self.is_held
    }
}

impl Filter {
    /// Rate of turn against n, in n, rad/s.
    pub(super) fn rate_n(&self) -> Vector3<f64> {
        self.nav().c_nb * self.w_nb_b()
    }

    /// The platform's, by its attitudes over a twentieth of a second.
    pub(super) fn platform_rate_n(&self, t_ns: i64) -> Vector3<f64> {
        const OVER_NS: i64 = 50_000_000;
        let (Some(then), Some(now)) = (self.platform(t_ns - OVER_NS), self.platform(t_ns)) else {
            return self.rate_n();
        };
        let turned = nalgebra::Rotation3::from_matrix_unchecked(now.c_nb * then.c_nb.transpose());
        turned.scaled_axis() / (OVER_NS as f64 * 1e-9)
    }

    /// The body's origin at a time near the strapdown's, ns.
    pub(super) fn body(&self, t_ns: i64) -> Option<Pose> {
        let point = self.point(t_ns, &Vector3::zeros(), &Vector3::zeros())?;
        let velocity = self.velocity_jacobian(&point.c_nb, &Vector3::zeros());
        let mut turned = Sparse::new();
        push(&mut turned, super::states::ATTITUDE, &Matrix3::identity());
        push(&mut turned, MOUNTING, &-point.c_nb);
        let jacobians = [point.jacobian, turned, velocity];
        Some(Pose {
            p_n: point.p_n,
            c_nb: point.c_nb,
            v_n: point.v_n,
            jacobians,
            noise: Matrix6::zeros(),
            is_held: false,
        })
    }

    /// The platform's origin, by the encoders; where they are silent, as they had it last; `None` before they began.
    pub(super) fn platform(&self, t_ns: i64) -> Option<Pose> {
        let origin = Vector3::zeros();
        let (last_ns, _) = *self.seats.back()?;
        let told = self.on_platform(&origin, t_ns).filter(|_| self.is_seated(t_ns));
        let (place, seated_ns) = match told {
            Some(place) => (place, t_ns),
            None => (self.on_platform(&origin, last_ns)?.at_rest(), last_ns),
        };
        let held_s = (t_ns - seated_ns) as f64 * 1e-9;
        let point = self.point(t_ns, &place.at_b, &place.rate_b)?;
        let (c_bp, seat_by_legs, axes_b) = self.platform_attitude(seated_ns)?;
        let velocity = self.velocity_jacobian(&point.c_nb, &place.at_b);
        let turn_by_legs = seat_by_legs.fixed_rows::<3>(3).into_owned();
        let by_legs_n = (point.c_nb * seat_by_legs.fixed_rows::<3>(0), point.c_nb * turn_by_legs);
        let mut moved = point.jacobian;
        let mut turned = Sparse::new();
        push(&mut turned, super::states::ATTITUDE, &Matrix3::identity());
        push(&mut turned, MOUNTING, &-point.c_nb);
        let mut by_legs = nalgebra::Matrix6::zeros();
        for leg in 0..6 {
            let (place, turn) = (by_legs_n.0.column(leg), by_legs_n.1.column(leg));
            moved.push((self.states.legs + leg, [-place[0], -place[1], -place[2]]));
            turned.push((self.states.legs + leg, [-turn[0], -turn[1], -turn[2]]));
            by_legs.fixed_view_mut::<3, 1>(0, leg).copy_from(&place);
            by_legs.fixed_view_mut::<3, 1>(3, leg).copy_from(&turn);
        }
        let mut angles_b = Vector3::zeros();
        for (axis, axis_b) in axes_b.iter().enumerate() {
            let (place_n, turn_n) = (point.c_nb * place.by_angles[axis], point.c_nb * axis_b);
            moved.push((self.states.rotator + axis, [-place_n.x, -place_n.y, -place_n.z]));
            turned.push((self.states.rotator + axis, [-turn_n.x, -turn_n.y, -turn_n.z]));
            angles_b += axis_b * self.angle_biases()[axis];
        }
        let delayed = point.c_nb * place.rate_b;
        moved.push((self.states.encoder_delay, [delayed.x, delayed.y, delayed.z]));
        let unbiased = cayley(&-(turn_by_legs * self.leg_biases() + angles_b)) * c_bp;
        let mut noise = by_legs * by_legs.transpose() * self.leg_noise_m2(&place);
        let unseen_m = (UNSEEN_M_S * held_s).min(UNSEEN_M);
        for axis in 0..3 {
            noise[(axis, axis)] += unseen_m * unseen_m + place.unseen_m * place.unseen_m;
            noise[(axis + 3, axis + 3)] += self.rig.rotator_sigma_rad.powi(2) + (unseen_m / 2.0).powi(2);
        }
        Some(Pose {
            p_n: point.p_n,
            c_nb: point.c_nb * unbiased,
            v_n: point.v_n,
            jacobians: [moved, turned, velocity],
            noise,
            is_held: held_s > 0.0,
        })
    }

    /// How the velocity of a place of b changes with the errors: to the first order the sensor's own, and the gyros' bias.
    fn velocity_jacobian(&self, c_nb: &Matrix3<f64>, at_b: &Vector3<f64>) -> Sparse {
        let mut jacobian = Sparse::new();
        push(&mut jacobian, VELOCITY, &Matrix3::identity());
        let arm_n = c_nb * (at_b - self.rig.lever_b);
        push(&mut jacobian, super::states::GYRO_BIAS, &(skew(&arm_n) * c_nb));
        jacobian
    }

    /// The pose as a row, and its columns for a smoother.
    pub(super) fn row(&self, t_ns: i64, pose: &Pose, with_columns: bool) -> (Row, Columns) {
        let products: Vec<[Vec<f64>; 3]> =
            pose.jacobians.iter().map(|jacobian| self.covariance.times_transposed(jacobian)).collect();
        let mut covariance = pose.noise;
        for row in 0..2 {
            for (column, product) in products.iter().take(2).enumerate() {
                let mut block = Matrix3::zeros();
                for (state, h) in &pose.jacobians[row] {
                    for r in 0..3 {
                        for c in 0..3 {
                            block[(r, c)] += h[r] * product[c][*state];
                        }
                    }
                }
                let mut place = covariance.fixed_view_mut::<3, 3>(3 * row, 3 * column);
                place += block;
            }
        }
        covariance = (covariance + covariance.transpose()) * 0.5;
        let row = Row {
            t_ns,
            p_n: pose.p_n,
            c_nb: pose.c_nb,
            v_n: pose.v_n,
            covariance,
            status: Status::Aligning,
            aids: 0,
            time_left_s: None,
            is_held: pose.is_held,
        };
        let columns = if with_columns { products.into_iter().flatten().collect() } else { Columns::new() };
        (row, columns)
    }
}
