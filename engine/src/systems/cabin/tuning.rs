//! How the devices err beyond what their makers state: shares of the stated sigmas, and how long an error lasts.
//!
//! The shares are those of the two recordings with truth that came with the instrument. Everything scales with the sigma
//! that a row or the instrument states, so a better receiver is believed more.

use serde::{Deserialize, Serialize};

/// A first-order Gauss–Markov error: its sigma as a multiple of the stated one, and its correlation time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Lasting {
    pub(super) share: f64,
    pub(super) time_s: f64,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Tuning {
    /// Error that a make's antennas share, of the stated sigma: base station and sky. In plan and in height.
    pub(super) make: [Lasting; 2],
    /// Each antenna's own lasting error: multipath. In plan and in height.
    pub(super) antenna: [Lasting; 2],
    /// What is white of a fix, of the stated sigma, in plan and in height.
    pub(super) antenna_white: [f64; 2],
    /// Pointing of a station that lasts, of the stated angle.
    pub(super) pointing: Lasting,
    /// Refraction, of the stated angle, in azimuth and in zenith angle.
    pub(super) refraction: [Lasting; 2],
    /// Distance error that lasts, of the stated distance sigma.
    pub(super) slant: Lasting,
    /// Noise of a leg from row to row with the wave of its screw, of the stated leg sigma.
    pub(super) leg_noise: f64,
    /// By how much the sigma of a stated delay is widened: a late make has to be found, not refused.
    pub(super) delay: f64,
    /// Bias instability of the inertial sensors, of their turn-on bias.
    pub(super) bias_walk: Lasting,
    /// Whether mounting, scale factors, delays and the survey of the antennas are states.
    pub(super) calibration: bool,
    /// Most that a measurement of three numbers may have as its normalised innovation squared.
    pub(super) gate: f64,
}

impl Tuning {
    /// The joint filter.
    pub(super) const OWN: Tuning = Tuning {
        make: [Lasting { share: 0.86, time_s: 90.0 }, Lasting { share: 0.76, time_s: 90.0 }],
        antenna: [Lasting { share: 0.48, time_s: 30.0 }, Lasting { share: 0.58, time_s: 30.0 }],
        antenna_white: [0.21, 0.34],
        pointing: Lasting { share: 2.6, time_s: 4.0 },
        refraction: [Lasting { share: 2.1, time_s: 600.0 }, Lasting { share: 2.9, time_s: 600.0 }],
        slant: Lasting { share: 4.0, time_s: 6.0 },
        leg_noise: 0.18,
        delay: 2.5,
        bias_walk: Lasting { share: 0.05, time_s: 300.0 },
        calibration: true,
        gate: 30.0,
    };

    /// Paper 3 as it is read straight: white errors of the stated sigmas, and no states but its fifteen.
    pub(super) const PAPER: Tuning = Tuning {
        make: [Lasting { share: 0.0, time_s: 90.0 }; 2],
        antenna: [Lasting { share: 0.0, time_s: 30.0 }; 2],
        antenna_white: [1.0, 1.0],
        pointing: Lasting { share: 0.0, time_s: 4.0 },
        refraction: [Lasting { share: 0.0, time_s: 600.0 }; 2],
        slant: Lasting { share: 0.0, time_s: 6.0 },
        leg_noise: 0.18,
        delay: 0.0,
        bias_walk: Lasting { share: 0.05, time_s: 300.0 },
        calibration: false,
        gate: 1e6,
    };
}
