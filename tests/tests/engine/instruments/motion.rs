//! A body whose motion is known in closed form, and what a perfect sensor on it reads.

use lodestep_engine::geo::gravity::normal_gravity_m_s2;
use lodestep_engine::geo::{Geodetic, LocalFrame};
use lodestep_engine::ins::layout::SensorStates;
use lodestep_engine::ins::nav_state::NavState;
use lodestep_engine::ins::strapdown::{ImuInterval, Strapdown};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// A site on the ellipsoid itself, where its normal is the direction of normal gravity.
pub(super) const SITE: Geodetic =
    Geodetic { latitude_deg: 25.652_944, longitude_deg: 106.856_667, height_m: 0.0 };

/// A swing: amplitude, angular frequency (rad/s) and phase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Swing(pub(super) f64, pub(super) f64, pub(super) f64);

impl Swing {
    /// Value, first and second derivative.
    fn at(&self, t_s: f64) -> [f64; 3] {
        let Swing(amplitude, w, phase) = *self;
        let (sin, cos) = (w * t_s + phase).sin_cos();
        [amplitude * sin, amplitude * w * cos, -amplitude * w * w * sin]
    }
}

/// A motion: a course at constant velocity with swings of position, and of heading, pitch and roll.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    pub(super) velocity_n_m_s: Vector3<f64>,
    pub(super) position: [Swing; 3],
    pub(super) angles: [Swing; 3],
}

/// Where the body is and how it moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) p_n: Vector3<f64>,
    pub(super) v_n: Vector3<f64>,
    a_n: Vector3<f64>,
    pub(super) c_nb: Matrix3<f64>,
    w_nb_b: Vector3<f64>,
}

impl Motion {
    /// A hand-held pole: tilts of half a radian in a second, steps, a turn to and fro.
    pub(super) fn pole() -> Motion {
        Motion {
            velocity_n_m_s: Vector3::new(0.7, -0.4, 0.0),
            position: [Swing(0.3, 3.1, 0.2), Swing(0.4, 2.3, 1.0), Swing(0.1, 5.7, 0.4)],
            angles: [Swing(1.5, 0.5, 0.3), Swing(0.3, 1.9, 0.0), Swing(0.4, 2.7, 2.0)],
        }
    }

    /// Standing still, tilted.
    pub(super) fn rest() -> Motion {
        let still = |value: f64| Swing(value, 0.0, std::f64::consts::FRAC_PI_2);
        Motion {
            velocity_n_m_s: Vector3::zeros(),
            position: [0.0; 3].map(still),
            angles: [0.6, 0.2, -0.3].map(still),
        }
    }

    pub(super) fn pose(&self, t_s: f64) -> Pose {
        let [e, n, u] = self.position.map(|swing| swing.at(t_s));
        let [heading, pitch, roll] = self.angles.map(|swing| swing.at(t_s));
        let about = |axis: Vector3<f64>, by: f64| Rotation3::new(axis * by).into_inner();
        let (rolled, pitched) = (about(Vector3::y(), roll[0]), about(Vector3::x(), pitch[0]));
        Pose {
            p_n: Vector3::new(e[0], n[0], u[0]) + self.velocity_n_m_s * t_s,
            v_n: Vector3::new(e[1], n[1], u[1]) + self.velocity_n_m_s,
            a_n: Vector3::new(e[2], n[2], u[2]),
            c_nb: about(Vector3::z(), -heading[0]) * pitched * rolled,
            w_nb_b: Vector3::y() * roll[1]
                + rolled.transpose()
                    * (Vector3::x() * pitch[1] - pitched.transpose() * Vector3::z() * heading[1]),
        }
    }

    /// What a perfect sensor reads at one moment: rate and specific force.
    fn reads(&self, frame: &LocalFrame, t_s: f64) -> [Vector3<f64>; 2] {
        let pose = self.pose(t_s);
        let w_ie_n = frame.earth_rate_n();
        let needed_n = pose.a_n + w_ie_n.cross(&pose.v_n) * 2.0 - gravity_along_normal(frame, &pose.p_n);
        [pose.w_nb_b + pose.c_nb.transpose() * w_ie_n, pose.c_nb.transpose() * needed_n]
    }

    /// The readings of a perfect sensor, as means over intervals: Gauss–Legendre of five points in each.
    pub(super) fn readings(&self, frame: &LocalFrame, dt_s: f64, count: usize) -> Vec<ImuInterval> {
        const POINTS: [(f64, f64); 5] = [
            (0.0, 0.568_888_888_888_888_9),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ];
        (0..count)
            .map(|k| {
                let (mut w_ib_b, mut f_b) = (Vector3::zeros(), Vector3::zeros());
                for (at, weight) in POINTS {
                    let [w, f] = self.reads(frame, dt_s * (k as f64 + 0.5 + 0.5 * at));
                    w_ib_b += w * (0.5 * weight);
                    f_b += f * (0.5 * weight);
                }
                ImuInterval { dt_s, w_ib_b, f_b }
            })
            .collect()
    }

    /// The body's rate against n, in b, rad/s.
    pub(super) fn rate_against_n(&self, t_s: f64) -> Vector3<f64> {
        self.pose(t_s).w_nb_b
    }

    /// A strapdown that starts in the true state.
    pub(super) fn start(&self, states: SensorStates) -> Strapdown {
        let Pose { p_n, v_n, c_nb, .. } = self.pose(0.0);
        let (gyro_bias_b, accelerometer_bias_b) = (Vector3::zeros(), Vector3::zeros());
        Strapdown::new(states, NavState { c_nb, v_n, p_n, gyro_bias_b, accelerometer_bias_b })
    }
}

/// Normal gravity by Somigliana's formula along the ellipsoid's normal of the place: another way than the
/// engine's vector field, and the same within 10⁻⁷ m/s² near the ellipsoid.
fn gravity_along_normal(frame: &LocalFrame, p_n: &Vector3<f64>) -> Vector3<f64> {
    let place = frame.to_geodetic((*p_n).into());
    let up_n = frame.c_ln((*p_n).into()).transpose() * Vector3::z();
    up_n * -normal_gravity_m_s2(place.latitude_deg, place.height_m)
}
