//! The true motion of cabin and platform: parked, to the source, on it; the cabin on its cables, the platform on rotator and
//! legs, which take up most of the swing.

use nalgebra::Vector3;

use super::super::jet::Jet;
use super::super::jet_rotation::JetRotation;
use super::super::motion::{Kinematics, Motion};
use super::super::random::{Purpose, Random};
use super::RunPlan;
use super::geometry::Geometry;
use super::swing::Swing;

/// The sphere of the dish has its centre so high, and the focus moves on one of half the radius about it, m.
const CENTRE_UP_M: f64 = 300.0;
const FOCUS_RADIUS_M: f64 = 160.0;
/// Of the tilt of the focal axis the cabin takes so much by itself.
const CABIN_TILT: f64 = 0.37;

/// A run's motion.
#[derive(Clone, Debug)]
pub(super) struct Course {
    hold_s: f64,
    slew_s: f64,
    end_s: f64,
    /// Direction to the source as tracking begins, and the pole of the sky, in n.
    source_n: Vector3<f64>,
    pole_n: Vector3<f64>,
    parked_n: Vector3<f64>,
    yaw_rad: [f64; 2],
    shift: [Swing; 3],
    turn: [Swing; 3],
    /// What the legs leave of the swing.
    left: f64,
    legs: [Swing; 3],
    leg_turn: [Swing; 3],
    pivot_b: Vector3<f64>,
    rest_r: Vector3<f64>,
}

/// Everything at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) cabin: Kinematics,
    pub(super) platform: Kinematics,
    pub(super) a_rad: f64,
    pub(super) b_rad: f64,
    pub(super) t_r: Vector3<f64>,
    pub(super) c_rp: nalgebra::Matrix3<f64>,
}

impl Course {
    pub(super) fn drawn(plan: &RunPlan, geometry: &Geometry, seed: u64) -> Course {
        let mut random = Random::new(seed, Random::COMMON, Purpose::Weather);
        let wind = random.uniform(0.7, 1.6);
        let direction = |zenith_rad: f64, azimuth_rad: f64| {
            let (sin_z, cos_z) = libm::sincos(zenith_rad);
            let (sin_a, cos_a) = libm::sincos(azimuth_rad);
            Vector3::new(sin_z * sin_a, sin_z * cos_a, cos_z)
        };
        let turn = std::f64::consts::TAU;
        let source_n = direction(random.uniform(0.02, 0.4), random.uniform(0.0, turn));
        // A source change of at most 0.35 m/s on the mean of its course, or 100 m.
        let reach_rad = (0.2 * plan.slew_s / FOCUS_RADIUS_M).min(0.5);
        // Evenly over the disc of that reach about the source; on the side of the zenith where it would lie too low.
        let (sin_reach, cos_reach) = libm::sincos(reach_rad * random.uniform(0.0, 1.0).sqrt());
        let (sin_side, cos_side) = libm::sincos(random.uniform(0.0, turn));
        let first = source_n.cross(&Vector3::y()).normalize();
        let aside = first * cos_side + source_n.cross(&first) * sin_side;
        let on = |aside: Vector3<f64>| source_n * cos_reach + aside * sin_reach;
        let parked = if on(aside).z > libm::cos(0.4) { on(aside) } else { on(-aside) };
        let (sin_lat, cos_lat) = libm::sincos(geometry.site.latitude_deg.to_radians());
        let mut swings = |rms: f64| [0; 3].map(|_| Swing::drawn(rms, &mut random));
        let (shift, turned) = (swings(0.012 * wind), swings(0.0012 * wind));
        let (legs, leg_turn) = (swings(0.001), swings(0.0005));
        let yaw = random.uniform(-0.4, 0.4);
        Course {
            hold_s: plan.hold_s,
            slew_s: plan.slew_s,
            end_s: plan.hold_s + plan.slew_s + plan.track_s,
            source_n,
            pole_n: Vector3::new(0.0, cos_lat, sin_lat),
            parked_n: parked,
            yaw_rad: [yaw, yaw + random.uniform(-0.08, 0.08)],
            shift,
            turn: turned,
            left: random.uniform(0.05, 0.15),
            legs,
            leg_turn,
            pivot_b: geometry.pivot_b,
            rest_r: geometry.rest_r,
        }
    }

    /// Direction from the focus to the dish's centre and on to the source.
    fn axis(&self, t_s: f64) -> [Jet; 3] {
        const SIDEREAL_RAD_S: f64 = 7.292_115e-5;
        let angle = (Jet::time(t_s) - Jet::constant(self.hold_s + self.slew_s)) * -SIDEREAL_RAD_S;
        let (sin, cos) = angle.sin_cos();
        let along = self.pole_n * self.pole_n.dot(&self.source_n);
        let (out, aside) = (self.source_n - along, self.pole_n.cross(&self.source_n));
        let progress = Jet::progress(t_s, self.hold_s, self.hold_s + self.slew_s).glide();
        let tracked = [0, 1, 2].map(|k| cos * out[k] + sin * aside[k] + Jet::constant(along[k]));
        [0, 1, 2].map(|k| {
            let parked = Jet::constant(self.parked_n[k]);
            parked + (tracked[k] - parked) * progress
        })
    }

    pub(super) fn at_time(&self, t_s: f64, swings: bool) -> State {
        let of = |swing: &Swing| if swings { swing.at(t_s) } else { Jet::default() };
        let axis = self.axis(t_s);
        let progress = Jet::progress(t_s, self.hold_s, self.hold_s + self.slew_s).glide();
        let yaw = Jet::constant(self.yaw_rad[0]) + progress * (self.yaw_rad[1] - self.yaw_rad[0]);
        // In axes that are turned by the yaw: y up front, x to the right.
        let (sin, cos) = yaw.sin_cos();
        let ahead = axis[0] * sin + axis[1] * cos;
        let right = axis[0] * cos - axis[1] * sin;
        // The platform's z points at the source.
        let (pitch, roll) = (ahead * -1.0, right);
        let c_nb = JetRotation::about_z((yaw + of(&self.turn[2])) * -1.0)
            * JetRotation::about_x(pitch * CABIN_TILT + of(&self.turn[0]))
            * JetRotation::about_y(roll * CABIN_TILT + of(&self.turn[1]));
        let a = pitch * (1.0 - CABIN_TILT) - of(&self.turn[0]) * 0.9;
        let b = roll * (1.0 - CABIN_TILT) - of(&self.turn[1]) * 0.9;
        let c_br = JetRotation::about_x(a) * JetRotation::about_y(b);
        let c_rp = JetRotation::about_x(of(&self.leg_turn[0]))
            * JetRotation::about_y(of(&self.leg_turn[1]))
            * JetRotation::about_z(of(&self.leg_turn[2]));

        let sway = [0, 1, 2].map(|k| of(&self.shift[k]));
        let (sin_0, cos_0) = libm::sincos(self.yaw_rad[1]);
        let sway_b = [sway[0] * cos_0 - sway[1] * sin_0, sway[0] * sin_0 + sway[1] * cos_0, sway[2]];
        let t_r = [0, 1, 2]
            .map(|k| Jet::constant(self.rest_r[k]) - sway_b[k] * (1.0 - self.left) + of(&self.legs[k]));
        let hang = c_br.turn(t_r);
        let below_b = [0, 1, 2].map(|k| Jet::constant(self.pivot_b[k]) + hang[k]);
        let below_n = c_nb.turn(below_b);
        // The plan puts the platform at the focus; the cabin is above it and swings.
        let rest_below = c_nb.turn({
            let hang = c_br.turn([0, 1, 2].map(|k| Jet::constant(self.rest_r[k])));
            [0, 1, 2].map(|k| Jet::constant(self.pivot_b[k]) + hang[k])
        });
        let cabin_n = [0, 1, 2].map(|k| {
            let centre = Jet::constant(if k == 2 { CENTRE_UP_M } else { 0.0 });
            centre - axis[k] * FOCUS_RADIUS_M - rest_below[k] + sway[k]
        });
        let platform_n = [0, 1, 2].map(|k| cabin_n[k] + below_n[k]);
        State {
            cabin: Kinematics::from_jets(cabin_n, &c_nb),
            platform: Kinematics::from_jets(platform_n, &(c_nb * c_br * c_rp)),
            a_rad: a.value,
            b_rad: b.value,
            t_r: Vector3::from(t_r.map(|jet| jet.value)),
            c_rp: c_rp.matrix(),
        }
    }

    pub(super) fn end_s(&self) -> f64 {
        self.end_s
    }
}

/// The cabin alone, for its inertial sensor.
pub(super) struct CabinMotion<'a>(pub(super) &'a Course);

/// The platform alone.
pub(super) struct PlatformMotion<'a>(pub(super) &'a Course);

impl Motion for CabinMotion<'_> {
    fn at(&self, t_s: f64) -> Kinematics {
        self.0.at_time(t_s, true).cabin
    }

    fn end_s(&self) -> f64 {
        self.0.end_s()
    }
}

impl Motion for PlatformMotion<'_> {
    fn at(&self, t_s: f64) -> Kinematics {
        self.0.at_time(t_s, true).platform
    }

    fn end_s(&self) -> f64 {
        self.0.end_s()
    }
}
