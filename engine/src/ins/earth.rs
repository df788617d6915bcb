//! Earth under the strapdown: how n turns in inertial space, and gravity at a place.
//!
//! n is fixed to Earth: the tangent plane at the site's origin, which does not follow the vehicle. So it turns
//! against the Earth frame not at all, and the transport rate of the textbooks, w_en, which is the turning of a
//! frame that stays level under a moving vehicle, is zero: w_in = w_ie + w_en = w_ie. What transport rate does
//! in a level frame, gravity does here, by leaning back towards the origin with distance. Both are the same
//! motion in other coordinates; a Cartesian frame is exact at any distance and has no singular place, so one
//! option is enough:
//!
//! Ċ = C \[w_ib×\] − \[w_ie×\] C,  v̇ = C f + g(p) − 2 w_ie × v,  ṗ = v.
//!
//! g is normal gravity, the centrifugal acceleration included. The true vertical leaves the normal one by 5″ to
//! 30″ (the deflection of the vertical), and true gravity is some 0.3 mm/s² stronger or weaker: the first is a
//! part of an estimated attitude, the second is told by a site with a gravity of its own.
//! Attitudes against the local level of a place far out are `c_ln * c_nb`
//! ([`LocalFrame::c_ln`](crate::geo::LocalFrame::c_ln)).

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::geo::LocalFrame;

/// How n turns, and gravity in it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Earth {
    w_ie_n: Vector3<f64>,
    gravity: Gravity,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Gravity {
    /// The same everywhere, m/s².
    Uniform(Vector3<f64>),
    /// Normal gravity of each place and what gravity differs from it by, m/s².
    Normal { frame: LocalFrame, anomaly_n: Vector3<f64>, gradient_n: Matrix3<f64> },
}

impl Earth {
    /// An Earth that neither turns nor curves: n is inertial, and gravity is the same everywhere. What sensors
    /// whose bias is far above 15 °/h can be computed with, over ways of some hundred metres.
    pub fn still(gravity_m_s2: f64) -> Earth {
        Earth { w_ie_n: Vector3::zeros(), gravity: Gravity::Uniform(Vector3::z() * -gravity_m_s2) }
    }

    /// Earth as it turns, with normal gravity by place and height.
    pub fn turning(frame: &LocalFrame) -> Earth {
        let gravity = Gravity::Normal {
            frame: *frame,
            anomaly_n: Vector3::zeros(),
            gradient_n: frame.gravity_gradient_n(&Vector3::zeros()),
        };
        Earth { w_ie_n: frame.earth_rate_n(), gravity }
    }

    /// One that turns at any rate, without gravity: for tests in which Earth's own rate would not show.
    #[cfg(test)]
    pub(crate) fn spinning(w_ie_n: Vector3<f64>) -> Earth {
        Earth { w_ie_n, gravity: Gravity::Uniform(Vector3::zeros()) }
    }

    /// The same with gravity at the origin as strong as it was measured there; elsewhere it differs from the
    /// normal one by as much.
    #[must_use]
    pub fn with_gravity_at_origin(mut self, gravity_m_s2: f64) -> Earth {
        match &mut self.gravity {
            Gravity::Uniform(g_n) => *g_n = Vector3::z() * -gravity_m_s2,
            Gravity::Normal { frame, anomaly_n, .. } => {
                let normal_n = frame.gravity_n(&Vector3::zeros());
                *anomaly_n = normal_n.normalize() * (gravity_m_s2 - normal_n.norm());
            }
        }
        self
    }

    /// Earth's rate in n, w_ie_n, rad/s. As n is fixed to Earth it is w_in_n, too.
    pub fn w_ie_n(&self) -> Vector3<f64> {
        self.w_ie_n
    }

    /// Gravity at a place, in n, m/s².
    #[inline]
    pub fn gravity_n(&self, p_n: &Vector3<f64>) -> Vector3<f64> {
        match &self.gravity {
            Gravity::Uniform(g_n) => *g_n,
            Gravity::Normal { frame, anomaly_n, .. } => frame.gravity_n(p_n) + anomaly_n,
        }
    }

    /// How gravity changes with place at the origin, ∂g/∂p in n, 1/s²: it pulls an error of the position back in
    /// plan (Schuler) and drives it on in height.
    pub fn gravity_gradient_n(&self) -> Matrix3<f64> {
        match &self.gravity {
            Gravity::Uniform(_) => Matrix3::zeros(),
            Gravity::Normal { gradient_n, .. } => *gradient_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Geodetic;

    fn frame() -> LocalFrame {
        LocalFrame::new(Geodetic { latitude_deg: 25.652_944, longitude_deg: 106.856_667, height_m: 1110.0 })
    }

    #[test]
    fn a_measured_gravity_holds_at_the_origin_and_differs_from_the_normal_one_alike_elsewhere() {
        let normal = Earth::turning(&frame());
        let measured = normal.with_gravity_at_origin(9.7861);
        assert!((measured.gravity_n(&Vector3::zeros()).norm() - 9.7861).abs() < 1e-12);
        let far = Vector3::new(30_000.0, -20_000.0, 400.0);
        let differ = [Vector3::zeros(), far].map(|p_n| measured.gravity_n(&p_n) - normal.gravity_n(&p_n));
        assert!((differ[0] - differ[1]).norm() < 1e-14);
        assert!(
            (Earth::still(9.8).with_gravity_at_origin(9.7).gravity_n(&far) + Vector3::z() * 9.7).norm()
                < 1e-15
        );
    }

    #[test]
    fn the_gradient_is_how_gravity_changes_around_the_origin() {
        let earth = Earth::turning(&frame());
        let step = Vector3::new(700.0, -900.0, 300.0);
        let found = earth.gravity_n(&step) - earth.gravity_n(&-step);
        assert!((found - earth.gravity_gradient_n() * step * 2.0).norm() < 1e-9);
        assert_eq!(Earth::still(9.8).gravity_gradient_n(), Matrix3::zeros());
        assert_eq!(Earth::still(9.8).w_ie_n(), Vector3::zeros());
    }
}
