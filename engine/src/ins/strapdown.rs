//! The strapdown of an instrument: Earth rate, gravity by place, scale factors, and readings that are means over
//! their interval.
//!
//! [`mechanization`](super::mechanization) is the short one for feet, whose sensors' bias is far above all this.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::earth::Earth;
use super::earth_transition::{Coupling, EarthTransition, Sample};
use super::eskf::Eskf;
use super::imu_noise::{GaussMarkov, ImuNoise};
use super::layout::ErrorState::{Attitude, Position, Velocity};
use super::layout::{SensorStates, StateVariable, correction_of};
use super::nav_state::NavState;
use crate::rotation::cayley;

/// Readings of an inertial sensor: means over the interval that ends at their time.
#[derive(Clone, Copy, Debug)]
pub struct ImuInterval {
    /// Length of the interval, s; above zero.
    pub dt_s: f64,
    /// Angular rate as read, rad/s.
    pub w_ib_b: Vector3<f64>,
    /// Specific force as read, m/s².
    pub f_b: Vector3<f64>,
}

/// One strapdown: its nominal state, and the transition of its errors since they were last propagated.
///
/// Readings are (1 + s) · truth + b on each axis, with scale factor s and bias b.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Strapdown {
    states: SensorStates,
    /// Attitude, velocity, position and biases.
    pub nav: NavState,
    /// Scale factors of the gyro by axis of b, of 1.
    pub gyro_scale: Vector3<f64>,
    /// Scale factors of the accelerometer by axis of b, of 1.
    pub accelerometer_scale: Vector3<f64>,
    before: Option<Before>,
    transition: EarthTransition,
}

/// The interval before: increments of angle and velocity, in b.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Before {
    dt_s: f64,
    turned_b: Vector3<f64>,
    pushed_b: Vector3<f64>,
}

impl Strapdown {
    /// In the state `nav` with scale factors of zero.
    pub fn new(states: SensorStates, nav: NavState) -> Strapdown {
        Strapdown {
            states,
            nav,
            gyro_scale: Vector3::zeros(),
            accelerometer_scale: Vector3::zeros(),
            before: None,
            transition: EarthTransition::default(),
        }
    }

    /// Where its error states stand.
    pub fn states(&self) -> SensorStates {
        self.states
    }

    /// A rate as read, less the estimated bias and scale factor, rad/s.
    pub fn corrected_rate(&self, w_ib_b: &Vector3<f64>) -> Vector3<f64> {
        (w_ib_b - self.nav.gyro_bias_b).component_mul(&gain(&self.gyro_scale))
    }

    /// A specific force as read, less the estimated bias and scale factor, m/s².
    pub fn corrected_force(&self, f_b: &Vector3<f64>) -> Vector3<f64> {
        (f_b - self.nav.accelerometer_bias_b).component_mul(&gain(&self.accelerometer_scale))
    }

    /// Goes on by one interval of readings.
    ///
    /// Rate and specific force are taken to change linearly from interval to interval, which gives coning,
    /// sculling and the rotation of the velocity increment (P. G. Savage, *Strapdown inertial navigation
    /// integration algorithm design*, Journal of Guidance, Control, and Dynamics 21, 1998); after a gap they are
    /// taken to be constant.
    pub fn advance(&mut self, earth: &Earth, interval: &ImuInterval) {
        let dt_s = interval.dt_s;
        let (w_ib_b, f_b) = (self.corrected_rate(&interval.w_ib_b), self.corrected_force(&interval.f_b));
        let (turned_b, pushed_b) = (w_ib_b * dt_s, f_b * dt_s);
        let mut rotation_b = turned_b;
        let mut velocity_b = pushed_b + swept(&turned_b, &pushed_b);
        if let Some(before) = self.before.filter(|before| (0.5..2.0).contains(&(dt_s / before.dt_s))) {
            let share = dt_s * dt_s / (6.0 * before.dt_s * (before.dt_s + dt_s));
            rotation_b += before.turned_b.cross(&turned_b) * share;
            velocity_b += (before.turned_b.cross(&pushed_b) + before.pushed_b.cross(&turned_b)) * share;
        }
        self.before = Some(Before { dt_s, turned_b, pushed_b });

        let (w_ie_n, nav) = (earth.w_ie_n(), &mut self.nav);
        let c_nb_before = nav.c_nb;
        nav.c_nb = cayley(&(w_ie_n * -dt_s)) * (c_nb_before * cayley(&rotation_b));
        let pushed_n = c_nb_before * velocity_b;
        // On the mean n has turned by half of the interval.
        let pushed_n = pushed_n - w_ie_n.cross(&pushed_n) * (0.5 * dt_s);
        let v_n_before = nav.v_n;
        let g_n = earth.gravity_n(&(nav.p_n + v_n_before * (0.5 * dt_s)));
        let v_n_mean = v_n_before + (pushed_n + g_n * dt_s) * 0.5;
        nav.v_n += pushed_n + (g_n - w_ie_n.cross(&v_n_mean) * 2.0) * dt_s;
        nav.p_n += (v_n_before + nav.v_n) * (0.5 * dt_s);

        self.transition.extend(
            &Sample {
                dt_s,
                c_nb: &((c_nb_before + nav.c_nb) * 0.5),
                pushed_n: &pushed_n,
                w_ib_b: &w_ib_b,
                f_b: &f_b,
                gyro_gain: &gain(&self.gyro_scale),
                accelerometer_gain: &gain(&self.accelerometer_scale),
            },
            self.states.gyro_scale().is_some() || self.states.accelerometer_scale().is_some(),
        );
    }

    /// How long ago its errors were propagated last, s of its own samples.
    pub fn unpropagated_s(&self) -> f64 {
        self.transition.dt_s()
    }

    /// For a filter that finds the growth of its errors by itself: what this has gathered for [`propagate`](Strapdown::propagate)
    /// is set aside.
    pub(crate) fn forget_transition(&mut self) {
        self.transition = EarthTransition::default();
    }

    /// Brings the filter's errors up to the last sample: to be called before a measurement is weighed, and not
    /// necessarily at every sample.
    ///
    /// As their errors do, the nominal biases and scale factors fade with their correlation times.
    pub fn propagate<const B: usize>(&mut self, eskf: &mut Eskf<B>, earth: &Earth, noise: &ImuNoise) {
        let dt_s = self.transition.dt_s();
        if dt_s == 0.0 {
            return;
        }
        let transition = std::mem::take(&mut self.transition);
        eskf.propagate_on_earth(&transition.propagation(earth, noise), self.states.sensor());
        self.nav.gyro_bias_b *= noise.gyro_bias_rad_s.kept(dt_s);
        self.nav.accelerometer_bias_b *= noise.accelerometer_bias_m_s2.kept(dt_s);
        let scale = transition.scale();
        if let Some(variable) = self.states.gyro_scale() {
            let process = noise.gyro_scale_factor;
            propagate_scale(eskf, &self.states, variable, &scale.gyro, &process, dt_s);
            self.gyro_scale *= process.kept(dt_s);
        }
        if let Some(variable) = self.states.accelerometer_scale() {
            let process = noise.accelerometer_scale_factor;
            propagate_scale(eskf, &self.states, variable, &scale.accelerometer, &process, dt_s);
            self.accelerometer_scale *= process.kept(dt_s);
        }
    }

    /// Takes estimated errors off the state: `correction` is the whole error vector of the filter.
    pub fn correct<const B: usize>(&mut self, correction: &[Vector3<f64>; B]) {
        self.nav.correct(self.states.sensor(), correction);
        self.gyro_scale += correction_of(correction, self.states.gyro_scale());
        self.accelerometer_scale += correction_of(correction, self.states.accelerometer_scale());
    }

    /// Whether every number of the state is finite.
    pub fn is_finite(&self) -> bool {
        self.nav.is_finite() && self.gyro_scale.iter().chain(&self.accelerometer_scale).all(|x| x.is_finite())
    }
}

/// What a velocity increment gains by the turn of the body under it: (1 − cos θ)/θ² θ×Δv + (θ − sin θ)/θ³ θ×(θ×Δv),
/// by the first terms of both series.
fn swept(turned_b: &Vector3<f64>, pushed_b: &Vector3<f64>) -> Vector3<f64> {
    let squared = turned_b.norm_squared();
    let once = turned_b.cross(pushed_b);
    once * (0.5 - squared / 24.0) + turned_b.cross(&once) * (1.0 / 6.0 - squared / 120.0)
}

/// 1/(1 + s) by axis.
fn gain(scale: &Vector3<f64>) -> Vector3<f64> {
    scale.map(|scale| 1.0 / (1.0 + scale))
}

/// A scale factor's error has acted on the strapdown's through `coupling`, and goes on itself.
fn propagate_scale<const B: usize>(
    eskf: &mut Eskf<B>,
    states: &SensorStates,
    variable: StateVariable,
    coupling: &Coupling,
    process: &GaussMarkov,
    dt_s: f64,
) {
    let block = variable.block();
    let acted =
        [(Attitude, &coupling.attitude), (Velocity, &coupling.velocity), (Position, &coupling.position)];
    // An accelerometer turns nothing.
    for (state, factor) in acted.into_iter().filter(|(_, factor)| **factor != Matrix3::zeros()) {
        eskf.add_multiple(states.block(state), block, factor);
    }
    let (kept, growth) = (process.kept(dt_s), process.growth(dt_s));
    if kept != 1.0 {
        eskf.scale(block, &Vector3::repeat(kept));
    }
    if growth > 0.0 {
        eskf.add_noise(&[block], &Vector3::repeat(growth));
    }
}

#[cfg(test)]
#[path = "strapdown_tests.rs"]
mod tests;
