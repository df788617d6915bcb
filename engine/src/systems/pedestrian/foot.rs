//! What is kept of one foot.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::doubts::Doubts;
use super::field_reach::FieldReach;
use super::filter::seconds;
use super::ride::Ride;
use super::stance_magnetics::StanceMagnetics;
use super::swing::Swing;
use super::tuning::Tuning;
use crate::ins::error_model::Transition;
use crate::ins::nav_state::NavState;

/// A stance or two say little of the field that a walk goes through: so many count as undisturbed before the first.
const UNSEEN_STANCES: f64 = 2.0;

/// A sample with the decision about its stance, ready for the filter.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Step {
    /// Number of the sensor: its place in the joint state.
    pub(crate) sensor: usize,
    /// Time, ns.
    pub(crate) t_ns: i64,
    /// Angular rate as read, rad/s.
    pub(crate) w_ib_b: Vector3<f64>,
    /// Specific force as read, m/s².
    pub(crate) f_b: Vector3<f64>,
    /// Magnetic field as read, µT.
    pub(crate) mag_b_ut: Option<Vector3<f64>>,
    /// Air pressure as read, hPa.
    pub(crate) pressure_hpa: Option<f64>,
    /// Whether the foot stands.
    pub(crate) stance: bool,
    /// Whether it may stand, if its strapdown has come to rest.
    pub(crate) doubtful: bool,
    /// Sigma of the velocity if it stands, m/s.
    pub(crate) zupt_sigma_m_s: f64,
    /// Whether it begins a new epoch.
    pub(crate) opens_epoch: bool,
}

/// One foot: its strapdown, and what the present stance or swing has shown so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FootState {
    pub(crate) nav: NavState,
    pub(crate) transition: Transition,
    pub(crate) t_ns: i64,
    pub(crate) last_w_ib_b: Vector3<f64>,
    pub(crate) stance: Stance,
    pub(crate) swing: Swing,
    /// Whether the attitude is to be levelled afresh at the next stance, after a long gap.
    pub(crate) lost: bool,
    /// Stances in which gravity stood far from up, one bit each, the newest lowest.
    pub(crate) tilted_stances: u8,
    /// Swings that did not come to rest at their end, likewise.
    pub(crate) fast_landings: u8,
    /// How many stances in a row saw a field that cannot be the site's.
    pub(crate) odd_field_stances: u32,
    /// Estimated compass deviation A, B, C, rad (see `slow_errors`).
    pub(crate) deviation_rad: Vector3<f64>,
    /// Estimated stride error along, across and upwards, shares of the way in plan.
    pub(crate) stride_error: Vector3<f64>,
    /// How far the strapdown has moved since the covariance last took account of it, m.
    pub(crate) moved_n: Vector3<f64>,
    /// Mean field of this foot's undisturbed stances: horizontal and vertical part, µT.
    pub(crate) usual_field_ut: Option<(f64, f64)>,
    /// Mean square of how far the field of a stance was from the usual, as an angle of its horizontal part, rad².
    pub(crate) field_spread_rad2: f64,
    /// Stances in that mean, up to those that it goes back to.
    pub(crate) field_stances: f64,
    /// How far such a field reaches.
    pub(crate) field_reach: FieldReach,
    /// Height in the filter less pressure height when the altimeter's zero was taken, m.
    pub(crate) altimeter_zero_m: Option<f64>,
    /// The fastest that the foot has been in this swing, m/s.
    pub(crate) fastest_m_s: f64,
    /// Whether the detector was sure of the present contact at any moment.
    pub(crate) sure_contact: bool,
    /// For how many strides doubtful contacts are still believed at once.
    pub(crate) hasty_strides: u8,
    /// Since when the foot has looked still, ns.
    pub(crate) quiet_since_ns: i64,
    /// Whether strapdown and detector have contradicted each other since then, for as long as a stance.
    pub(crate) contradicted: bool,
    /// When it was last told that a swing does not end, ns.
    pub(crate) endless_told_ns: Option<i64>,
    /// What its swings contradict.
    pub(crate) doubts: Doubts,
    /// What it feels upwards while it stands.
    pub(crate) ride: Ride,
}

/// The present stance, or the last one.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Stance {
    /// Whether the foot stands.
    pub(crate) stands: bool,
    pub(crate) since_ns: i64,
    /// When the velocity was last held at zero, ns.
    pub(crate) held_ns: i64,
    /// When the heading was last taken in this stance, ns.
    pub(crate) heading_ns: i64,
    pub(crate) nis_sum: f64,
    pub(crate) updates: u32,
    pub(crate) rate_sum: Vector3<f64>,
    pub(crate) force_sum: Vector3<f64>,
    /// Attitude in the first sample, as the swing has left it.
    pub(crate) first_c_nb: Matrix3<f64>,
    /// Speed in the first sample, m/s.
    pub(crate) first_speed_m_s: f64,
    pub(crate) samples: u32,
    /// Sum of the pressures, hPa, and how many there are.
    pub(crate) pressure: (f64, u32),
    pub(crate) magnetics: StanceMagnetics,
}

impl FootState {
    /// A foot in the state `nav`, at its first sample.
    pub(crate) fn new(nav: NavState, t_ns: i64, w_ib_b: Vector3<f64>) -> Self {
        FootState {
            nav,
            transition: Transition::none(),
            t_ns,
            last_w_ib_b: w_ib_b,
            stance: Stance::default(),
            swing: Swing::default(),
            lost: false,
            tilted_stances: 0,
            fast_landings: 0,
            odd_field_stances: 0,
            deviation_rad: Vector3::zeros(),
            stride_error: Vector3::zeros(),
            moved_n: Vector3::zeros(),
            usual_field_ut: None,
            field_spread_rad2: 0.0,
            field_stances: UNSEEN_STANCES,
            field_reach: FieldReach::default(),
            altimeter_zero_m: None,
            fastest_m_s: 0.0,
            sure_contact: false,
            hasty_strides: 0,
            quiet_since_ns: t_ns,
            contradicted: false,
            endless_told_ns: None,
            doubts: Doubts::default(),
            ride: Ride::default(),
        }
    }
}

impl FootState {
    /// Turns all that is written in n about the vertical through `about_n`.
    pub(crate) fn turn(&mut self, r: &Matrix3<f64>, about_n: &Vector3<f64>) {
        self.nav.c_nb = r * self.nav.c_nb;
        self.nav.v_n = r * self.nav.v_n;
        self.nav.p_n = about_n + r * (self.nav.p_n - about_n);
        self.moved_n = r * self.moved_n;
        self.swing.turn(r, about_n);
        self.stance.first_c_nb = r * self.stance.first_c_nb;
    }
}

impl Stance {
    /// The foot has come to stand at `t_ns`.
    pub(crate) fn begin(&mut self, t_ns: i64) {
        self.stands = true;
        self.since_ns = t_ns;
        self.held_ns = i64::MIN;
        self.heading_ns = t_ns;
        self.nis_sum = 0.0;
        self.updates = 0;
        self.rate_sum = Vector3::zeros();
        self.force_sum = Vector3::zeros();
        self.samples = 0;
        self.pressure = (0.0, 0);
        self.magnetics.begin();
    }

    /// Whether the velocity is to be held at zero: at touch-down, then once in an interval, and the longer
    /// the foot has stood, the longer not again.
    #[inline]
    pub(crate) fn is_hold_due(&self, t_ns: i64, tuning: &Tuning) -> bool {
        if self.held_ns == i64::MIN {
            return true;
        }
        let stood_s = seconds(t_ns - self.since_ns);
        let interval_s = tuning.hold_interval_s;
        let least_s = (tuning.hold_share * stood_s).clamp(interval_s, tuning.longest_hold_s.max(interval_s));
        seconds(t_ns - self.held_ns) >= least_s * 0.99
    }
}
