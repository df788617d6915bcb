//! When the tip stands on the ground: by the switch in it, or by what the sensor feels.

use nalgebra::{Matrix3, Vector3};

use super::recording::Instrument;
use crate::rotation::cayley;
use crate::sample::ImuSample;

/// A stretch of time, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Interval {
    /// Start.
    pub(super) from_ns: i64,
    /// End.
    pub(super) to_ns: i64,
}

/// A switch that opens for no longer than this has chattered, ns.
const CHATTER_NS: i64 = 150_000_000;
/// A contact that is shorter than this says nothing, ns.
const SHORTEST_NS: i64 = 200_000_000;

/// The contacts that a switch says, with its chatter taken out.
pub(super) fn by_switch(rows: &[(i64, bool)], end_ns: i64) -> Vec<Interval> {
    let mut contacts: Vec<Interval> = Vec::new();
    let mut since = None;
    let mut close = |from_ns: i64, to_ns: i64| match contacts.last_mut() {
        Some(last) if from_ns - last.to_ns < CHATTER_NS => last.to_ns = to_ns,
        _ => contacts.push(Interval { from_ns, to_ns }),
    };
    for (t_ns, on) in rows {
        match (on, since) {
            (true, None) => since = Some(*t_ns),
            (false, Some(from_ns)) => {
                close(from_ns, *t_ns);
                since = None;
            }
            _ => {}
        }
    }
    if let Some(from_ns) = since {
        close(from_ns, end_ns);
    }
    contacts.retain(|contact| contact.to_ns - contact.from_ns >= SHORTEST_NS);
    contacts
}

/// Half of the window over which the tip is watched, ns.
const HALF_WINDOW_NS: i64 = 200_000_000;
/// Half of the time over which the angular acceleration is taken, ns.
const HALF_DIFFERENCE_NS: i64 = 15_000_000;
/// Largest spread of the specific force at a tip that stands, m/s².
const MOST_SPREAD_M_S2: f64 = 0.4;
/// Largest difference of its length from gravity, m/s².
const MOST_FROM_GRAVITY_M_S2: f64 = 0.2;
/// Contacts that are parted by less than this are one, ns.
const BRIDGED_NS: i64 = 40_000_000;

/// The contacts that the sensor feels: carried to the tip and turned into one frame, its specific force is gravity's for
/// as long as the tip stands. `gyro_bias_b` is what is known of the gyro's bias.
pub(super) fn by_feel(
    imu: &[ImuSample],
    instrument: &Instrument,
    gravity_m_s2: f64,
    gyro_bias_b: &Vector3<f64>,
) -> Vec<Interval> {
    let Some(tip_b_m) = instrument.tip_b_m else { return Vec::new() };
    let felt = felt_at_tip(imu, &tip_b_m, gyro_bias_b);
    // Sums of the force and its square over the samples before each.
    let mut sums = Vec::with_capacity(felt.len() + 1);
    sums.push((Vector3::zeros(), 0.0));
    for force in &felt {
        let (sum, squares): (Vector3<f64>, f64) = sums[sums.len() - 1];
        sums.push((sum + force, squares + force.norm_squared()));
    }
    let mut contacts: Vec<Interval> = Vec::new();
    let (mut first, mut last) = (0, 0);
    for sample in imu {
        while imu[first].t_ns < sample.t_ns - HALF_WINDOW_NS {
            first += 1;
        }
        while last < imu.len() && imu[last].t_ns <= sample.t_ns + HALF_WINDOW_NS {
            last += 1;
        }
        let count = (last - first) as f64;
        let whole = imu[last - 1].t_ns - imu[first].t_ns > HALF_WINDOW_NS * 3 / 2;
        let mean = (sums[last].0 - sums[first].0) / count;
        let spread = ((sums[last].1 - sums[first].1) / count - mean.norm_squared()).max(0.0).sqrt();
        let stands =
            whole && spread < MOST_SPREAD_M_S2 && (mean.norm() - gravity_m_s2).abs() < MOST_FROM_GRAVITY_M_S2;
        if stands {
            let (from_ns, to_ns) = (imu[first].t_ns, imu[last - 1].t_ns);
            match contacts.last_mut() {
                Some(contact) if from_ns <= contact.to_ns + BRIDGED_NS => contact.to_ns = to_ns,
                _ => contacts.push(Interval { from_ns, to_ns }),
            }
        }
    }
    contacts
}

/// The specific force at the tip, turned into the frame of the first sample.
fn felt_at_tip(imu: &[ImuSample], tip_b_m: &Vector3<f64>, gyro_bias_b: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let rate = |k: usize| Vector3::from(imu[k].w_ib_b_rad_s) - gyro_bias_b;
    let mut c = Matrix3::identity();
    let mut felt = Vec::with_capacity(imu.len());
    let (mut before, mut after) = (0, 0);
    for k in 0..imu.len() {
        let t_ns = imu[k].t_ns;
        let w = rate(k);
        if k > 0 {
            let dt_s = (t_ns - imu[k - 1].t_ns) as f64 * 1e-9;
            if dt_s < 0.1 {
                c *= cayley(&(w * dt_s));
            }
        }
        while imu[before].t_ns < t_ns - HALF_DIFFERENCE_NS {
            before += 1;
        }
        while after + 1 < imu.len() && imu[after].t_ns < t_ns + HALF_DIFFERENCE_NS {
            after += 1;
        }
        let span_s = (imu[after].t_ns - imu[before].t_ns) as f64 * 1e-9;
        let turning = if span_s > 0.0 { (rate(after) - rate(before)) / span_s } else { Vector3::zeros() };
        let force = Vector3::from(imu[k].f_b_m_s2) + turning.cross(tip_b_m) + w.cross(&w.cross(tip_b_m));
        felt.push(c * force);
    }
    felt
}

/// How much of the extra bias of walking is there at a time: whole in the air and for some time after a landing, then
/// less and less.
#[derive(Clone, Debug)]
pub(super) struct Walking {
    contacts: Vec<Interval>,
    at: usize,
    whole_ns: i64,
    gone_ns: i64,
}

impl Walking {
    /// Over these contacts.
    pub(super) fn new(contacts: &[Interval], whole_s: f64, gone_s: f64) -> Walking {
        // What is taken off the ground for shorter than a step has not been walked with.
        const STEP_NS: i64 = 600_000_000;
        let mut stands: Vec<Interval> = Vec::new();
        for contact in contacts {
            match stands.last_mut() {
                Some(last) if contact.from_ns - last.to_ns < STEP_NS => last.to_ns = contact.to_ns,
                _ => stands.push(*contact),
            }
        }
        let ns = |s: f64| (s * 1e9) as i64;
        Walking { contacts: stands, at: 0, whole_ns: ns(whole_s), gone_ns: ns(gone_s) }
    }

    /// At a time that is no earlier than the one before.
    pub(super) fn at(&mut self, t_ns: i64) -> f64 {
        while self.contacts.get(self.at).is_some_and(|contact| contact.to_ns < t_ns) {
            self.at += 1;
        }
        match self.contacts.get(self.at) {
            Some(contact) if contact.from_ns <= t_ns => {
                if self.at == 0 {
                    return 0.0;
                }
                let since_ns = t_ns - contact.from_ns;
                let left = (self.gone_ns - since_ns) as f64 / (self.gone_ns - self.whole_ns) as f64;
                left.clamp(0.0, 1.0)
            }
            // Before its first stand nobody knows what the pole is in for.
            _ if self.at == 0 => 0.0,
            _ => 1.0,
        }
    }
}
