//! A rigid body's true motion in time, in closed form: what every simulated sensor samples.
//!
//! b is the frame of the body; a sensor s sits on it at a lever arm, in a mounting of its own. n is the site's navigation
//! frame: it turns with the Earth.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::earth::Earth;
use super::jet::Jet;
use super::jet_rotation::JetRotation;

/// The true motion of a body.
pub trait Motion {
    /// How the body moves at a time since the start, s; between 0 and [`end_s`](Motion::end_s).
    fn at(&self, t_s: f64) -> Kinematics;

    /// When the motion ends, s.
    fn end_s(&self) -> f64;

    /// Whether rate and force change so slowly from one time to another, s, that the mean of both ends is their mean. A sensor
    /// that averages then asks for no instant between.
    fn is_slow(&self, from_s: f64, to_s: f64) -> bool {
        let _ = (from_s, to_s);
        false
    }
}

impl<M: Motion> Motion for &M {
    fn at(&self, t_s: f64) -> Kinematics {
        (**self).at(t_s)
    }

    fn end_s(&self) -> f64 {
        (**self).end_s()
    }

    fn is_slow(&self, from_s: f64, to_s: f64) -> bool {
        (**self).is_slow(from_s, to_s)
    }
}

/// How a body moves at one instant: position, attitude, and the first two derivatives of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematics {
    /// Position of the origin of b in n, m.
    pub position_n_m: Vector3<f64>,
    /// Its velocity against n, m/s.
    pub velocity_n_m_s: Vector3<f64>,
    /// Its acceleration against n, m/s².
    pub acceleration_n_m_s2: Vector3<f64>,
    /// Attitude: turns b into n.
    pub c_nb: Matrix3<f64>,
    /// Rate of b against n, in b, rad/s.
    pub w_nb_b_rad_s: Vector3<f64>,
    /// The derivative of that rate, in b, rad/s².
    pub w_dot_nb_b_rad_s2: Vector3<f64>,
}

impl Kinematics {
    /// The motion of which position and attitude are known as jets.
    pub fn from_jets(position_n_m: [Jet; 3], c_nb: &JetRotation) -> Kinematics {
        Kinematics {
            position_n_m: Vector3::from(position_n_m.map(|jet| jet.value)),
            velocity_n_m_s: Vector3::from(position_n_m.map(|jet| jet.rate)),
            acceleration_n_m_s2: Vector3::from(position_n_m.map(|jet| jet.acceleration)),
            c_nb: c_nb.matrix(),
            w_nb_b_rad_s: c_nb.rate_rad_s(),
            w_dot_nb_b_rad_s2: c_nb.rate_derivative_rad_s2(),
        }
    }

    /// The motion of another point of the same body, `lever_arm_b_m` from its origin; the axes stay.
    pub fn at_lever_arm(&self, lever_arm_b_m: &Vector3<f64>) -> Kinematics {
        let (w, arm) = (&self.w_nb_b_rad_s, lever_arm_b_m);
        let w_arm = w.cross(arm);
        Kinematics {
            position_n_m: self.position_n_m + self.c_nb * arm,
            velocity_n_m_s: self.velocity_n_m_s + self.c_nb * w_arm,
            acceleration_n_m_s2: self.acceleration_n_m_s2
                + self.c_nb * (self.w_dot_nb_b_rad_s2.cross(arm) + w.cross(&w_arm)),
            ..*self
        }
    }

    /// Attitude as a quaternion that turns b into n.
    pub fn q_nb(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(self.c_nb))
    }

    /// Heading of the x axis of b, clockwise from true north, rad in (−π, π].
    pub fn heading_rad(&self) -> f64 {
        libm::atan2(self.c_nb[(0, 0)], self.c_nb[(1, 0)])
    }

    /// Rate of b against inertial space, in b, rad/s: what a gyro measures.
    pub fn w_ib_b_rad_s(&self, earth: &Earth) -> Vector3<f64> {
        self.w_nb_b_rad_s + self.c_nb.tr_mul(&earth.rate_n_rad_s())
    }

    /// Specific force at the origin of b, in b, m/s²: what an accelerometer measures. Acceleration against n, Coriolis'
    /// acceleration, and what holds the body against gravity, which has the centrifugal part in it.
    pub fn f_b_m_s2(&self, earth: &Earth) -> Vector3<f64> {
        let f_n = self.acceleration_n_m_s2 + 2.0 * earth.rate_n_rad_s().cross(&self.velocity_n_m_s)
            - earth.gravity_n_m_s2(&self.position_n_m);
        self.c_nb.tr_mul(&f_n)
    }
}

/// How a sensor s sits on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// From the origin of b to that of s, in b, m.
    pub lever_arm_b_m: Vector3<f64>,
    /// Turns s into b.
    pub c_bs: Matrix3<f64>,
}

impl Mounting {
    /// At the origin of b, with its axes.
    pub fn at_origin() -> Mounting {
        Mounting { lever_arm_b_m: Vector3::zeros(), c_bs: Matrix3::identity() }
    }

    /// How the place of the sensor moves; the axes are still those of b.
    pub fn place(&self, body: &Kinematics) -> Kinematics {
        if self.lever_arm_b_m == Vector3::zeros() { *body } else { body.at_lever_arm(&self.lever_arm_b_m) }
    }

    /// How the sensor moves whose place moves so: its axes in place of those of b.
    pub fn turned(&self, place: &Kinematics) -> Kinematics {
        Kinematics {
            c_nb: place.c_nb * self.c_bs,
            w_nb_b_rad_s: self.c_bs.tr_mul(&place.w_nb_b_rad_s),
            w_dot_nb_b_rad_s2: self.c_bs.tr_mul(&place.w_dot_nb_b_rad_s2),
            ..*place
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geo::Site;

    /// A body that swings and turns on three axes and goes round a bend: nothing of it is constant.
    pub(crate) struct Tumbling;

    impl Motion for Tumbling {
        fn at(&self, t_s: f64) -> Kinematics {
            let t = Jet::time(t_s);
            let (sway, surge) = ((t * 1.7).sin_cos(), (t * 0.4).sin_cos());
            let position = [surge.0 * 3.0 + sway.0 * 0.1, surge.1 * 3.0, sway.1 * 0.2 + t * 0.3];
            let c_nb = JetRotation::about_z(t * 0.5 + sway.0 * 0.3)
                * JetRotation::about_x(surge.0 * 0.6)
                * JetRotation::about_y(sway.1 * 0.4);
            Kinematics::from_jets(position, &c_nb)
        }

        fn end_s(&self) -> f64 {
            20.0
        }
    }

    /// The largest of what position, velocity, attitude and rate miss against central differences.
    pub(crate) fn largest_inconsistency(at: impl Fn(f64) -> Kinematics, t_s: f64) -> f64 {
        let h = 1e-5;
        let [before, now, after] = [t_s - h, t_s, t_s + h].map(at);
        let slope = |before: Vector3<f64>, after: Vector3<f64>| (after - before) / (2.0 * h);
        let turning = now.c_nb.tr_mul(&(after.c_nb - before.c_nb)) / (2.0 * h);
        [
            slope(before.position_n_m, after.position_n_m) - now.velocity_n_m_s,
            slope(before.velocity_n_m_s, after.velocity_n_m_s) - now.acceleration_n_m_s2,
            Vector3::new(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)]) - now.w_nb_b_rad_s,
            slope(before.w_nb_b_rad_s, after.w_nb_b_rad_s) - now.w_dot_nb_b_rad_s2,
        ]
        .iter()
        .map(Vector3::norm)
        .fold((now.c_nb.tr_mul(&now.c_nb) - Matrix3::identity()).norm(), f64::max)
    }

    #[test]
    fn position_attitude_and_their_derivatives_belong_together_at_the_origin_and_at_a_lever_arm() {
        let mounting = Mounting {
            lever_arm_b_m: Vector3::new(0.3, -1.2, 0.8),
            c_bs: Rotation3::from_scaled_axis(Vector3::new(0.4, -0.2, 1.1)).into_inner(),
        };
        for k in 0..200 {
            let t_s = 0.1 * f64::from(k);
            let origin = largest_inconsistency(|t_s| Tumbling.at(t_s), t_s);
            let sensor =
                largest_inconsistency(|t_s| mounting.turned(&mounting.place(&Tumbling.at(t_s))), t_s);
            assert!(origin < 1e-8 && sensor < 1e-8, "{origin}, {sensor} at {t_s} s");
        }
    }

    #[test]
    fn strapdown_with_the_earth_s_rate_returns_the_motion_that_was_sampled() {
        // Trapezoids of 0.1 ms against the closed form, over 20 s: what remains is the integrator's.
        let earth = Earth::new(&Site::fast(), true);
        let h = 1e-4;
        let start = Tumbling.at(0.0);
        let (mut q_nb, mut v_n, mut p_n) = (start.q_nb(), start.velocity_n_m_s, start.position_n_m);
        let felt = |t_s: f64| {
            let now = Tumbling.at(t_s);
            (now.w_ib_b_rad_s(&earth), now.f_b_m_s2(&earth))
        };
        let mut last = felt(0.0);
        for k in 1..=200_000 {
            let now = felt(f64::from(k) * h);
            let w_nb_b = 0.5 * (last.0 + now.0) - q_nb.inverse() * earth.rate_n_rad_s();
            let middle = q_nb * UnitQuaternion::from_scaled_axis(0.5 * h * w_nb_b);
            let a_n = middle * (0.5 * (last.1 + now.1)) + earth.gravity_n_m_s2(&p_n)
                - 2.0 * earth.rate_n_rad_s().cross(&v_n);
            p_n += h * v_n + 0.5 * h * h * a_n;
            v_n += h * a_n;
            q_nb *= UnitQuaternion::from_scaled_axis(h * w_nb_b);
            last = now;
        }
        let end = Tumbling.at(Tumbling.end_s());
        assert!((p_n - end.position_n_m).norm() < 5e-5, "{} m", (p_n - end.position_n_m).norm());
        assert!((v_n - end.velocity_n_m_s).norm() < 5e-6, "{} m/s", (v_n - end.velocity_n_m_s).norm());
        assert!(q_nb.angle_to(&end.q_nb()) < 1e-7, "{} rad", q_nb.angle_to(&end.q_nb()));
        // Without the Earth it would be metres: 20 s at 7e-5 rad/s under gravity.
        let without = Earth::new(&Site::fast(), false);
        let off = start.w_ib_b_rad_s(&earth) - start.w_ib_b_rad_s(&without);
        assert!((off.norm() - earth.rate_n_rad_s().norm()).abs() < 1e-12);
    }

    #[test]
    fn heading_is_that_of_the_x_axis_clockwise_from_north() {
        let facing = |angle: f64| {
            let c_nb = JetRotation::about_z(Jet::constant(angle));
            Kinematics::from_jets([Jet::default(); 3], &c_nb).heading_rad()
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!((facing(0.0) - quarter).abs() < 1e-15, "east");
        assert!(facing(quarter).abs() < 1e-15, "north");
        assert!((facing(2.0 * quarter) + quarter).abs() < 1e-15, "west");
    }
}
