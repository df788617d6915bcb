//! What a survey is computed from.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::anomaly::Anomaly;
use crate::sample::ImuSample;

/// The pole: what is fixed to the sensor, from it, in its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instrument {
    /// To the phase centre of the antenna, m.
    pub antenna_b_m: Vector3<f64>,
    /// To the tip, m; `None` for a sensor in the hand, which nothing stands on the ground with.
    pub tip_b_m: Option<Vector3<f64>>,
}

/// How the receiver came to a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// Carrier phase with whole ambiguities.
    Fixed,
    /// Carrier phase with ambiguities as they come.
    Float,
    /// By code alone.
    Single,
}

impl Quality {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Quality::Fixed => "fixed",
            Quality::Float => "float",
            Quality::Single => "single",
        }
    }
}

/// A position of the antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Time on the sensor's clock, ns.
    pub t_ns: i64,
    /// Phase centre, east-north-up from the site's origin, m.
    pub p_n_m: Vector3<f64>,
    /// Its sigmas as the receiver says them, m.
    pub sigma_n_m: Vector3<f64>,
    /// How it came about.
    pub quality: Quality,
}

/// A stretch of time in which the tip was held on a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// The point's name.
    pub name: String,
    /// Start, ns.
    pub t_start_ns: i64,
    /// End, ns.
    pub t_end_ns: i64,
}

/// All that was recorded.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Samples, means over the interval before their time, in order of time.
    pub imu: Vec<ImuSample>,
    /// Positions of the antenna in order of time.
    pub fixes: Vec<Fix>,
    /// The switch in the tip, a row at each change; `None` without a switch.
    pub switch: Option<Vec<(i64, bool)>>,
    /// When the tip was held on which point.
    pub stops: Vec<Stop>,
    /// What was left out of the samples and the positions.
    pub left_out: Vec<Anomaly>,
}

impl Recording {
    /// The same with the positions on the sensor's clock, where the receiver's shows so much more, s.
    pub(super) fn together(&self, apart_s: f64) -> Recording {
        let mut together = self.clone();
        let apart_ns = libm::round(apart_s * 1e9) as i64;
        together.fixes.iter_mut().for_each(|fix| fix.t_ns -= apart_ns);
        together
    }
}
