//! One move of a foot from foothold to foothold: it turns about the ball, travels while the pivot
//! passes from ball to heel, lands with a shock, and turns about the heel until it is flat.

use nalgebra::Vector3;

use super::gait::{Foothold, Shape, rigid_foot};
use crate::sim::jet::Jet;
use crate::sim::motion::Kinematics;

/// Frequency of the shoe's ringing after it lands, Hz.
const SHOCK_HZ: f64 = 26.0;

/// A move between two footholds.
#[derive(Clone, Debug)]
pub(crate) struct Swing {
    pub(crate) from: Foothold,
    pub(crate) to: Foothold,
    pub(crate) t_from_s: f64,
    pub(crate) t_to_s: f64,
    shape: Shape,
    /// Share of the shape's pitch: a short move lifts the heel less.
    vigour: f64,
    /// Halfway, this far from the straight line, m.
    detour_n_m: Vector3<f64>,
    /// Amplitude of the shock's ringing, m.
    shock_n_m: Vector3<f64>,
}

impl Swing {
    /// `vigour` is the share of a full stride; `detour_n_m` bends the way around the standing foot
    /// and along the path; `hardness` scales the shock.
    pub(crate) fn new(
        (from, t_from_s): (Foothold, f64),
        (to, t_to_s): (Foothold, f64),
        shape: Shape,
        vigour: f64,
        detour_n_m: Vector3<f64>,
        hardness: f64,
    ) -> Swing {
        let turning = std::f64::consts::TAU * SHOCK_HZ;
        let (sin, cos) = libm::sincos(to.angles[0]);
        // The ground stops the foot: up first, and backward less than half as hard.
        let amplitude_m = hardness * vigour * shape.shock_m_s2 / (turning * turning);
        let shock_n_m = amplitude_m * Vector3::new(0.4 * cos, 0.4 * sin, -1.0);
        Swing { from, to, t_from_s, t_to_s, shape, vigour, detour_n_m, shock_n_m }
    }

    pub(crate) fn at(&self, t_s: f64) -> Kinematics {
        let Shape { push, landing, travel, climb, .. } = self.shape;
        let u = Jet::progress(t_s, self.t_from_s, self.t_to_s);

        let (pushed, landed, flat) = (
            u.within(0.0, push.1).ramp(),
            u.within(push.1, landing.1).ramp(),
            u.within(landing.1, 1.0).ramp(),
        );
        let pitch = pushed * push.0 + landed * (landing.0 - push.0) + flat * -landing.0;
        let turned = u.ramp();
        let mut angles: [Jet; 3] = std::array::from_fn(|i| {
            Jet::constant(self.from.angles[i]) + turned * (self.to.angles[i] - self.from.angles[i])
        });
        angles[1] = angles[1] + pitch * self.vigour;

        let on_its_way = u.within(travel.0, travel.1);
        let travelled = on_its_way.glide();
        let climbed = u.within(climb.0, climb.1).ramp();
        let aside = on_its_way.bump();
        let pivot_m = Jet::constant(Shape::PUSH_PIVOT_M)
            + on_its_way.ramp() * (self.shape.landing_pivot_m - Shape::PUSH_PIVOT_M);
        let start = self.from.sole_point_n_m(Shape::PUSH_PIVOT_M);
        let way = self.to.sole_point_n_m(self.shape.landing_pivot_m) - start;
        let lift = self.detour_n_m + Vector3::z() * self.shape.clearance_m;
        let shock = self.shock(t_s);
        let pivot_n_m = std::array::from_fn(|i| {
            let along = if i == 2 { climbed } else { travelled };
            Jet::constant(start[i]) + along * way[i] + aside * lift[i] + shock * self.shock_n_m[i]
        });
        rigid_foot(pivot_n_m, pivot_m, angles)
    }

    fn shock(&self, t_s: f64) -> Jet {
        let landed_s = self.t_from_s + self.shape.landing.1 * (self.t_to_s - self.t_from_s);
        let window = Jet::progress(t_s, landed_s, self.t_to_s).bump();
        if window == Jet::default() {
            return window;
        }
        let turning = std::f64::consts::TAU * SHOCK_HZ;
        let angle = Jet { value: (t_s - landed_s) * turning, rate: turning, acceleration: 0.0 };
        window * angle.sin_cos().0
    }
}
