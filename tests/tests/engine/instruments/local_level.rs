//! The strapdown in the frame that is fixed to Earth against one as a textbook writes it: in the local level
//! frame that moves along, with transport rate (P. D. Groves, *Principles of GNSS, inertial, and multisensor
//! integrated navigation systems*, 2013, section 5.4). Two frames, one motion.

use lodestep_engine::geo::ellipsoid::{EARTH_RATE_RAD_S, ECCENTRICITY_SQUARED, SEMI_MAJOR_M};
use lodestep_engine::geo::gravity::normal_gravity_m_s2;
use lodestep_engine::geo::{Geodetic, LocalFrame};
use lodestep_engine::ins::earth::Earth;
use lodestep_engine::ins::layout::Layout;
use lodestep_engine::ins::strapdown::ImuInterval;
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::motion::{Motion, SITE, Swing};

/// The state in the local level frame l: east, north, up of the place itself.
#[derive(Clone, Copy, Debug)]
struct LocalLevel {
    latitude: f64,
    longitude: f64,
    height_m: f64,
    v_l: Vector3<f64>,
    c_lb: Matrix3<f64>,
    /// 1, or 0 for a frame that is taken to stay level by itself.
    transport: f64,
}

impl LocalLevel {
    fn radii_m(&self) -> (f64, f64) {
        let w2 = 1.0 - ECCENTRICITY_SQUARED * self.latitude.sin().powi(2);
        let meridian = SEMI_MAJOR_M * (1.0 - ECCENTRICITY_SQUARED) / w2.powf(1.5);
        (meridian + self.height_m, SEMI_MAJOR_M / w2.sqrt() + self.height_m)
    }

    fn earth_rate_l(&self) -> Vector3<f64> {
        Vector3::new(0.0, self.latitude.cos(), self.latitude.sin()) * EARTH_RATE_RAD_S
    }

    /// How the level frame turns under a moving vehicle.
    fn transport_rate_l(&self, v_l: &Vector3<f64>) -> Vector3<f64> {
        let (meridian_m, normal_m) = self.radii_m();
        Vector3::new(-v_l.y / meridian_m, v_l.x / normal_m, v_l.x * self.latitude.tan() / normal_m)
            * self.transport
    }

    fn gravity_l(&self) -> Vector3<f64> {
        // Above the ellipsoid gravity leans a little to the equator (Groves, equation 2.140).
        let lean = -8.08e-9 * self.height_m * (2.0 * self.latitude).sin();
        Vector3::new(0.0, lean, -normal_gravity_m_s2(self.latitude.to_degrees(), self.height_m))
    }

    fn advance(&mut self, reading: &ImuInterval) {
        let dt_s = reading.dt_s;
        // Twice: the second time with the means of the first.
        let before = *self;
        let mut mean = *self;
        for _ in 0..2 {
            let (w_ie, w_el) = (mean.earth_rate_l(), mean.transport_rate_l(&mean.v_l));
            let after = |share: f64| {
                Rotation3::new((w_ie + w_el) * (-dt_s * share)).into_inner()
                    * before.c_lb
                    * Rotation3::new(reading.w_ib_b * (dt_s * share)).into_inner()
            };
            let c_lb = after(1.0);
            // Simpson's rule over the interval.
            let f_l = (before.c_lb + after(0.5) * 4.0 + c_lb) * reading.f_b / 6.0;
            let acceleration = f_l + mean.gravity_l() - (w_ie * 2.0 + w_el).cross(&mean.v_l);
            let v_l = before.v_l + acceleration * dt_s;
            let v_mean = (before.v_l + v_l) * 0.5;
            let (meridian_m, normal_m) = mean.radii_m();
            *self = LocalLevel {
                latitude: before.latitude + v_mean.y / meridian_m * dt_s,
                longitude: before.longitude + v_mean.x / (normal_m * mean.latitude.cos()) * dt_s,
                height_m: before.height_m + v_mean.z * dt_s,
                v_l,
                c_lb,
                transport: self.transport,
            };
            mean = LocalLevel {
                latitude: 0.5 * (before.latitude + self.latitude),
                longitude: 0.5 * (before.longitude + self.longitude),
                height_m: 0.5 * (before.height_m + self.height_m),
                v_l: v_mean,
                c_lb,
                transport: self.transport,
            };
        }
    }
}

#[test]
fn over_fifty_kilometres_it_is_the_motion_that_transport_rate_gives_in_a_level_frame() {
    const DT_S: f64 = 0.02;
    let frame = LocalFrame::new(SITE);
    let earth = Earth::turning(&frame);
    // Half an hour by car, in a straight line through the tangent plane, with bends.
    let motion = Motion {
        velocity_n_m_s: Vector3::new(22.0, 18.0, 0.0),
        position: [Swing(60.0, 0.05, 0.0), Swing(80.0, 0.04, 0.0), Swing(3.0, 0.1, 0.0)],
        angles: [Swing(0.8, 0.05, 0.0), Swing(0.05, 0.3, 0.0), Swing(0.05, 0.4, 0.0)],
    };
    let states = Layout::of_strapdowns(1).without_scale_factors(0);
    let mut strapdown = motion.start(states);
    let start = frame.to_geodetic(strapdown.nav.p_n.into());
    let level = LocalLevel {
        latitude: start.latitude_deg.to_radians(),
        longitude: start.longitude_deg.to_radians(),
        height_m: start.height_m,
        v_l: strapdown.nav.v_n,
        c_lb: strapdown.nav.c_nb,
        transport: 1.0,
    };
    let mut levels = [level, LocalLevel { transport: 0.0, ..level }];
    for reading in motion.readings(&frame, DT_S, 90_000) {
        strapdown.advance(&earth, &reading);
        levels.iter_mut().for_each(|level| level.advance(&reading));
    }
    let [(p_n, with), (other_p_n, without)] = levels.map(|level| {
        let place = Geodetic {
            latitude_deg: level.latitude.to_degrees(),
            longitude_deg: level.longitude.to_degrees(),
            height_m: level.height_m,
        };
        (Vector3::from(frame.to_local_m(place)), level)
    });
    assert!(p_n.norm() > 50_000.0);
    let c_ln = frame.c_ln(p_n.into());
    let apart = [
        (strapdown.nav.p_n - p_n).norm(),
        (c_ln * strapdown.nav.v_n - with.v_l).norm(),
        (c_ln * strapdown.nav.c_nb - with.c_lb).norm(),
    ];
    assert!(apart[0] < 1.0 && apart[1] < 2e-3 && apart[2] < 1e-6, "{apart:?}");
    // What the test would see of a transport rate left out.
    assert!((strapdown.nav.p_n - other_p_n).norm() > 10_000.0, "{other_p_n} {without:?}");
}
