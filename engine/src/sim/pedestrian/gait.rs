//! How a foot goes: the shape of one move for walking, running, stairs and crawling, and where on the foot
//! the sensor, the toe and the heel are.
//!
//! The foot's frame f: x forward, y left, z up, origin on the ground below the sensor. Angles turn it
//! from the navigation frame by yaw about up (from east, anticlockwise), then pitch about y (toe down
//! positive), then roll about x.

use nalgebra::{Matrix3, Vector3};

use crate::sim::jet::Jet;
use crate::sim::motion::Kinematics;

/// Height of the sensor above the sole, m: it sits in the laces on the instep.
pub(crate) const SENSOR_HEIGHT_M: f64 = 0.075;
/// The ball of the foot ahead of the sensor, m: about it the foot turns when the heel lifts.
const BALL_M: f64 = 0.115;
/// The heel behind the sensor, m: on it the foot lands.
const HEEL_M: f64 = -0.13;

/// A way to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gait {
    /// Level or sloping ground, heel first.
    Walk,
    /// The same as if looking for something: short steps, little lift, soft landings.
    Slow,
    /// With a flight phase, short stances and hard landings.
    Run,
    /// Up a stair, a tread a step, the whole foot at once.
    StairsUp,
    /// Down a stair, toes first.
    StairsDown,
    /// On hands and knees: the toes stay down and are dragged to where the knee goes.
    Crawl,
}

/// The shape of one move: fractions are of the move's duration, from the heel's lift to the flat foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shape {
    /// Share of the gait cycle in which the foot moves.
    pub(crate) moving_share: f64,
    /// Largest toe-down pitch after the push, rad, and when.
    pub(crate) push: (f64, f64),
    /// Pitch at landing, rad (toe up is negative), and when.
    pub(crate) landing: (f64, f64),
    /// When the pivot travels.
    pub(crate) travel: (f64, f64),
    /// When the height changes from that of the old to that of the new foothold.
    pub(crate) climb: (f64, f64),
    /// Lift of the pivot halfway, m.
    pub(crate) clearance_m: f64,
    /// Where on the foot it lands, m ahead of the sensor.
    pub(crate) landing_pivot_m: f64,
    /// Peak acceleration of the shock at landing, m/s².
    pub(crate) shock_m_s2: f64,
}

impl Gait {
    pub(crate) fn shape(self) -> Shape {
        match self {
            Gait::Walk => Shape {
                moving_share: 0.57,
                push: (0.72, 0.34),
                landing: (-0.32, 0.86),
                travel: (0.22, 0.92),
                climb: (0.22, 0.92),
                clearance_m: 0.045,
                landing_pivot_m: HEEL_M,
                shock_m_s2: 32.0,
            },
            Gait::Slow => Shape {
                moving_share: 0.46,
                push: (0.42, 0.34),
                landing: (-0.16, 0.86),
                travel: (0.20, 0.92),
                climb: (0.20, 0.92),
                clearance_m: 0.025,
                landing_pivot_m: HEEL_M,
                shock_m_s2: 12.0,
            },
            Gait::Crawl => Shape {
                moving_share: 0.48,
                push: (0.16, 0.30),
                landing: (-0.10, 0.84),
                travel: (0.06, 0.94),
                climb: (0.06, 0.94),
                clearance_m: 0.006,
                landing_pivot_m: BALL_M,
                shock_m_s2: 8.0,
            },
            Gait::Run => Shape {
                moving_share: 0.73,
                push: (1.0, 0.36),
                landing: (-0.18, 0.86),
                travel: (0.16, 0.94),
                climb: (0.16, 0.94),
                clearance_m: 0.10,
                landing_pivot_m: HEEL_M,
                shock_m_s2: 62.0,
            },
            Gait::StairsUp => Shape {
                moving_share: 0.55,
                push: (0.45, 0.32),
                landing: (-0.06, 0.84),
                travel: (0.20, 0.94),
                climb: (0.10, 0.62),
                clearance_m: 0.04,
                landing_pivot_m: BALL_M,
                shock_m_s2: 15.0,
            },
            Gait::StairsDown => Shape {
                moving_share: 0.56,
                push: (0.40, 0.32),
                landing: (0.28, 0.84),
                travel: (0.16, 0.78),
                climb: (0.40, 0.94),
                clearance_m: 0.03,
                landing_pivot_m: BALL_M,
                shock_m_s2: 28.0,
            },
        }
    }
}

/// A crawling foot points its toes down and back, rad.
const CRAWL_PITCH_RAD: f64 = 0.8;

impl Gait {
    /// How a foot stands in this gait: pitch against the ground, rad, and how far the point of the ground
    /// below the sensor's place on the sole is from it, m.
    pub(crate) fn stands_pitched(self) -> (f64, f64) {
        match self {
            Gait::Crawl => (CRAWL_PITCH_RAD, BALL_M * libm::sin(CRAWL_PITCH_RAD)),
            Gait::Walk | Gait::Slow | Gait::Run | Gait::StairsUp | Gait::StairsDown => (0.0, 0.0),
        }
    }
}

impl Shape {
    pub(crate) const PUSH_PIVOT_M: f64 = BALL_M;
}

/// Where a foot stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Foothold {
    /// Origin of f, east-north-up, m.
    pub(crate) origin_n_m: Vector3<f64>,
    /// Yaw, pitch, roll, rad.
    pub(crate) angles: [f64; 3],
    /// Length along the path, m.
    pub(crate) along_m: f64,
}

/// The motion of a foot, with the sensor's place for its origin, of which one point, `pivot_m` ahead of the sensor on the sole,
/// is at `pivot_n_m`, under these angles.
pub(crate) fn rigid_foot(pivot_n_m: [Jet; 3], pivot_m: Jet, [yaw, pitch, roll]: [Jet; 3]) -> Kinematics {
    let ((sy, cy), (sp, cp), (sr, cr)) = (yaw.sin_cos(), pitch.sin_cos(), roll.sin_cos());
    let (sp_cr, sp_sr) = (sp * cr, sp * sr);
    let x_axis = [cy * cp, sy * cp, sp * -1.0];
    let z_axis = [cy * sp_cr + sy * sr, sy * sp_cr - cy * sr, cp * cr];
    let y_axis = [
        cy.value * sp_sr.value - sy.value * cr.value,
        sy.value * sp_sr.value + cy.value * cr.value,
        cp.value * sr.value,
    ];
    let sensor: [Jet; 3] =
        std::array::from_fn(|i| pivot_n_m[i] + z_axis[i] * SENSOR_HEIGHT_M - x_axis[i] * pivot_m);
    Kinematics {
        position_n_m: Vector3::from(sensor.map(|jet| jet.value)),
        velocity_n_m_s: Vector3::from(sensor.map(|jet| jet.rate)),
        acceleration_n_m_s2: Vector3::from(sensor.map(|jet| jet.acceleration)),
        c_nb: Matrix3::from_columns(&[
            Vector3::from(x_axis.map(|jet| jet.value)),
            Vector3::from(y_axis),
            Vector3::from(z_axis.map(|jet| jet.value)),
        ]),
        w_nb_b_rad_s: Vector3::new(
            roll.rate - yaw.rate * sp.value,
            pitch.rate * cr.value + yaw.rate * cp.value * sr.value,
            yaw.rate * cp.value * cr.value - pitch.rate * sr.value,
        ),
        w_dot_nb_b_rad_s2: Vector3::new(
            roll.acceleration - yaw.acceleration * sp.value - yaw.rate * sp.rate,
            pitch.acceleration * cr.value
                + pitch.rate * cr.rate
                + yaw.acceleration * cp.value * sr.value
                + yaw.rate * (cp.rate * sr.value + cp.value * sr.rate),
            yaw.acceleration * cp.value * cr.value + yaw.rate * (cp.rate * cr.value + cp.value * cr.rate)
                - pitch.acceleration * sr.value
                - pitch.rate * sr.rate,
        ),
    }
}

impl Foothold {
    /// The point of the sole that lies so far ahead of the sensor, in n, m.
    pub(crate) fn sole_point_n_m(&self, ahead_m: f64) -> Vector3<f64> {
        let [yaw, pitch, _] = self.angles;
        let ((sy, cy), (sp, cp)) = (libm::sincos(yaw), libm::sincos(pitch));
        self.origin_n_m + ahead_m * Vector3::new(cy * cp, sy * cp, -sp)
    }

    /// Where the sensor of a foot is that stands here without moving, in n, m.
    pub(crate) fn sensor_n_m(&self) -> Vector3<f64> {
        let origin = [self.origin_n_m.x, self.origin_n_m.y, self.origin_n_m.z].map(Jet::constant);
        rigid_foot(origin, Jet::default(), self.angles.map(Jet::constant)).position_n_m
    }
}
