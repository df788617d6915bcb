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

/// A sensor reads no more than this beside gravity when it stands, m/s².
const MOST_BIAS_M_S2: f64 = 0.6;
/// So many samples say what it reads.
const FEWEST_AT_REST: usize = 200;

/// The force over the window about a sample.
struct Window {
    from_ns: i64,
    to_ns: i64,
    /// Length of its mean, m/s².
    length_m_s2: f64,
    /// Whether it stays the same.
    steady: bool,
}

/// The contacts that the sensor feels: carried to the tip and turned into one frame, its specific force is what it is at rest
/// for as long as the tip stands. `gyro_bias_b` is what is known of the gyro's bias.
pub(super) fn by_feel(
    imu: &[ImuSample],
    instrument: &Instrument,
    at_rest_m_s2: f64,
    gyro_bias_b: &Vector3<f64>,
) -> Vec<Interval> {
    let mut contacts: Vec<Interval> = Vec::new();
    for window in windows(imu, instrument, gyro_bias_b) {
        if window.steady && (window.length_m_s2 - at_rest_m_s2).abs() < MOST_FROM_GRAVITY_M_S2 {
            match contacts.last_mut() {
                Some(contact) if window.from_ns <= contact.to_ns + BRIDGED_NS => contact.to_ns = window.to_ns,
                _ => contacts.push(Interval { from_ns: window.from_ns, to_ns: window.to_ns }),
            }
        }
    }
    contacts
}

/// What an accelerometer reads up the pole when the tip stands, m/s²: gravity, and its own bias, which may be more than what
/// is allowed for. From samples of which most are of a standing tip; where too few are steady, gravity.
pub(super) fn force_at_rest(
    imu: &[ImuSample],
    instrument: &Instrument,
    gravity_m_s2: f64,
    gyro_bias_b: &Vector3<f64>,
) -> f64 {
    let mut lengths: Vec<f64> = windows(imu, instrument, gyro_bias_b)
        .filter(|window| window.steady && (window.length_m_s2 - gravity_m_s2).abs() < MOST_BIAS_M_S2)
        .map(|window| window.length_m_s2)
        .collect();
    if lengths.len() < FEWEST_AT_REST {
        return gravity_m_s2;
    }
    lengths.sort_by(f64::total_cmp);
    lengths[lengths.len() / 2]
}

fn windows(
    imu: &[ImuSample],
    instrument: &Instrument,
    gyro_bias_b: &Vector3<f64>,
) -> impl Iterator<Item = Window> {
    let felt = instrument.tip_b_m.map_or(Vec::new(), |tip_b_m| felt_at_tip(imu, &tip_b_m, gyro_bias_b));
    // Sums of the force and its square over the samples before each.
    let mut sums = Vec::with_capacity(felt.len() + 1);
    sums.push((Vector3::zeros(), 0.0));
    for force in &felt {
        let (sum, squares): (Vector3<f64>, f64) = sums[sums.len() - 1];
        sums.push((sum + force, squares + force.norm_squared()));
    }
    let (mut first, mut last) = (0, 0);
    imu[..felt.len()].iter().map(move |sample| {
        while imu[first].t_ns < sample.t_ns - HALF_WINDOW_NS {
            first += 1;
        }
        while last < imu.len() && imu[last].t_ns <= sample.t_ns + HALF_WINDOW_NS {
            last += 1;
        }
        let count = (last - first) as f64;
        let (from_ns, to_ns) = (imu[first].t_ns, imu[last - 1].t_ns);
        let whole = to_ns - from_ns > HALF_WINDOW_NS * 3 / 2;
        let mean = (sums[last].0 - sums[first].0) / count;
        let spread = ((sums[last].1 - sums[first].1) / count - mean.norm_squared()).max(0.0).sqrt();
        Window { from_ns, to_ns, length_m_s2: mean.norm(), steady: whole && spread < MOST_SPREAD_M_S2 }
    })
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
    /// Those in which the tip did not stand.
    left_out: Vec<bool>,
    at: usize,
    /// The last stand that is over or may go on, and whether it is the first.
    stand: Option<(Interval, bool)>,
    whole_ns: i64,
    gone_ns: i64,
}

/// What is taken off the ground for shorter than a step has not been walked with, ns.
const STEP_NS: i64 = 600_000_000;

impl Walking {
    /// Over these contacts but for those that are left out.
    pub(super) fn new(contacts: &[Interval], left_out: Vec<bool>, whole_s: f64, gone_s: f64) -> Walking {
        let ns = |s: f64| (s * 1e9) as i64;
        let contacts = contacts.to_vec();
        Walking { contacts, left_out, at: 0, stand: None, whole_ns: ns(whole_s), gone_ns: ns(gone_s) }
    }

    /// In this contact the tip does not stand: it is carried evenly, or on something that moves. Taken for a stand it would make
    /// one of two others and the way between them.
    pub(super) fn leave_out(&mut self, contact: usize) {
        self.left_out[contact] = true;
    }

    /// At a time that is no earlier than the one before.
    pub(super) fn at(&mut self, t_ns: i64) -> f64 {
        while self.contacts.get(self.at).is_some_and(|contact| contact.to_ns < t_ns) {
            if !self.left_out[self.at] {
                self.stand = Some(self.with(&self.contacts[self.at]));
            }
            self.at += 1;
        }
        let next = (self.at..self.contacts.len()).find(|k| !self.left_out[*k]);
        // Now, or between two parts of one stand.
        let now = next.map(|next| self.with(&self.contacts[next])).filter(|(stand, _)| stand.from_ns <= t_ns);
        match now {
            Some((_, true)) => 0.0,
            Some((stand, false)) => {
                let since_ns = t_ns - stand.from_ns;
                let left = (self.gone_ns - since_ns) as f64 / (self.gone_ns - self.whole_ns) as f64;
                left.clamp(0.0, 1.0)
            }
            // Before its first stand nobody knows what the pole is in for.
            None if self.stand.is_none() => 0.0,
            None => 1.0,
        }
    }

    /// The stand that a contact is of, and whether it is the first.
    fn with(&self, contact: &Interval) -> (Interval, bool) {
        match self.stand {
            Some((stand, first)) if contact.from_ns - stand.to_ns < STEP_NS => {
                (Interval { from_ns: stand.from_ns, to_ns: contact.to_ns }, first)
            }
            stand => (*contact, stand.is_none()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn a_switch_that_chatters_says_one_contact_and_a_touch_none() {
        let rows = [
            (0, true),
            (1000 * MS, false),
            (3000 * MS, true),
            (3012 * MS, false),
            (3034 * MS, true),
            (3900 * MS, false),
            (5000 * MS, true),
            (5050 * MS, false),
            (6000 * MS, true),
        ];
        let contacts = by_switch(&rows, 8000 * MS);
        let expected = [(0, 1000), (3000, 3900), (6000, 8000)];
        let expected = expected.map(|(from, to)| Interval { from_ns: from * MS, to_ns: to * MS });
        assert_eq!(contacts, expected);
    }

    /// A pole that turns about its tip for two seconds, and is then carried about for two.
    #[test]
    fn contact_is_felt_while_the_pole_turns_about_its_tip_and_not_while_the_tip_is_carried() {
        let tip_b_m = Vector3::new(0.0, 0.0, -1.0);
        let instrument = Instrument { antenna_b_m: Vector3::z(), tip_b_m: Some(tip_b_m) };
        let g = 9.8;
        let imu: Vec<ImuSample> = (0..800)
            .map(|k| {
                let t_s = k as f64 * 0.005;
                // Leaning by θ = 0.3 sin 2t about y; the sensor is 1 m above the tip.
                let (sin, cos) = libm::sincos(2.0 * t_s);
                let (lean, rate, turning) = (0.3 * sin, 0.6 * cos, -1.2 * sin);
                let (sin, cos) = libm::sincos(lean);
                let carried = if t_s < 2.0 { 0.0 } else { 3.0 * libm::sin(6.0 * t_s) };
                let f_b = Vector3::new(turning - g * sin + carried, 0.0, g * cos - rate * rate);
                ImuSample {
                    t_ns: k * 5 * MS,
                    w_ib_b_rad_s: [0.0, rate, 0.0],
                    f_b_m_s2: f_b.into(),
                    mag_b_ut: None,
                    pressure_hpa: None,
                }
            })
            .collect();
        let contacts = by_feel(&imu, &instrument, g, &Vector3::zeros());
        let [contact] = contacts[..] else { panic!("{contacts:?}") };
        assert!(contact.from_ns < 100 * MS, "{contact:?}");
        assert!((1800 * MS..2100 * MS).contains(&contact.to_ns), "{contact:?}");
    }

    #[test]
    fn what_walking_adds_to_the_bias_goes_when_the_pole_is_held() {
        let contacts = [(0, 1000), (3000, 3900), (6000, 16000)];
        let contacts = contacts.map(|(from, to)| Interval { from_ns: from * MS, to_ns: to * MS });
        let mut walking = Walking::new(&contacts, vec![false; 3], 1.0, 2.0);
        let at: Vec<f64> =
            [500, 2000, 3500, 5000, 6900, 7500, 9000].into_iter().map(|t| walking.at(t * MS)).collect();
        assert_eq!(at, [0.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.0]);
    }

    #[test]
    fn a_tip_that_is_carried_evenly_between_two_stands_does_not_make_one_of_them() {
        let contacts = [(0, 1000), (3000, 3900), (4300, 4700), (5100, 6000), (6300, 16000)];
        let contacts = contacts.map(|(from, to)| Interval { from_ns: from * MS, to_ns: to * MS });
        let mut walking = Walking::new(&contacts, vec![false; 5], 1.0, 2.0);
        assert_eq!(walking.at(3500 * MS), 1.0);
        walking.leave_out(2);
        // Without it the stand of 5.1 s is one of its own, and goes on at 6.3 s.
        let at: Vec<f64> =
            [4500, 5000, 5900, 6100, 6600, 8000].into_iter().map(|t| walking.at(t * MS)).collect();
        assert_eq!(at, [1.0, 1.0, 1.0, 1.0, 0.5, 0.0]);
    }

    /// Its accelerometer reads 0.25 m/s² too much up the pole: more than is allowed for between gravity and what a tip feels that
    /// stands.
    #[test]
    fn contact_is_felt_by_a_sensor_that_reads_too_much() {
        let instrument =
            Instrument { antenna_b_m: Vector3::z(), tip_b_m: Some(Vector3::new(0.0, 0.0, -1.0)) };
        let imu: Vec<ImuSample> = (0..1000)
            .map(|k| ImuSample {
                t_ns: k * 5 * MS,
                w_ib_b_rad_s: [0.0; 3],
                f_b_m_s2: [0.0, 0.0, 10.05],
                mag_b_ut: None,
                pressure_hpa: None,
            })
            .collect();
        let at_rest_m_s2 = force_at_rest(&imu, &instrument, 9.8, &Vector3::zeros());
        assert!((at_rest_m_s2 - 10.05).abs() < 1e-9, "{at_rest_m_s2}");
        assert_eq!(by_feel(&imu, &instrument, at_rest_m_s2, &Vector3::zeros()).len(), 1);
        assert!(by_feel(&imu, &instrument, 9.8, &Vector3::zeros()).is_empty());
        assert_eq!(force_at_rest(&imu[..100], &instrument, 9.8, &Vector3::zeros()), 9.8);
    }
}
