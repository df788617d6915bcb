//! Which contacts of a foot with the ground were taken for stances, and how still the foot truly was.

use serde::Serialize;

use crate::parse::truth_csv::KnownPlace;

/// How a foot truly was at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootInstant {
    /// When, ns.
    pub t_ns: i64,
    /// Where, up last, m.
    pub position_m: [f64; 3],
    /// How fast, m/s.
    pub speed_m_s: f64,
    /// Whether it was on the ground and not on its way.
    pub in_contact: bool,
}

/// What was made of the contacts of one walk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StanceErrors {
    /// Contacts that lie in the time that was told of.
    pub contacts: usize,
    /// Of these, in how many the foot was not taken to stand for a single instant.
    pub missed: usize,
    /// How often the foot was taken to stand while it was on its way, from beginning to end.
    pub false_stances: usize,
    /// Instants of all contacts, and in how many of them the foot was taken to stand.
    pub instants: (usize, usize),
    /// Instants in which the foot was taken to stand, in contact or not, and the sum of the squares of its
    /// true speed in them, m²/s².
    pub held: (usize, f64),
    /// Stances that were told whole, and how far the foot truly rose in them, in all, m: a filter that
    /// holds it at zero does not see this.
    pub risen: (usize, f64),
    /// Length of the foot's true path, contact by contact, m.
    pub path_m: f64,
}

/// A foot that moves less than this between two contacts has not walked, m.
const SHORTEST_STRIDE_M: f64 = 0.1;
/// What was told of an instant holds for so long, ns.
const TOLD_HOLDS_NS: i64 = 40_000_000;

/// Holds what was told, in order of time, against the truth.
pub fn stances(truth: &[FootInstant], told: &[(i64, bool)]) -> StanceErrors {
    let mut errors = StanceErrors::default();
    let stands: Vec<Option<bool>> = truth.iter().map(|instant| told_at(told, instant.t_ns)).collect();
    let mut last_place_m: Option<[f64; 3]> = None;
    for (from, to, in_contact) in runs(truth.iter().map(|instant| Some(instant.in_contact))) {
        if !in_contact || stands[from..to].contains(&None) {
            continue;
        }
        let held = stands[from..to].iter().filter(|stands| **stands == Some(true)).count();
        errors.contacts += 1;
        errors.missed += usize::from(held == 0);
        errors.instants.0 += to - from;
        errors.instants.1 += held;
        let place_m = truth[(from + to) / 2].position_m;
        let stride_m = last_place_m.map_or(f64::INFINITY, |last| distance_m(&last, &place_m));
        if stride_m >= SHORTEST_STRIDE_M {
            errors.path_m += if stride_m.is_finite() { stride_m } else { 0.0 };
            last_place_m = Some(place_m);
        }
    }
    for (from, to, held) in runs(stands.iter().copied()) {
        if !held {
            continue;
        }
        let stance = &truth[from..to];
        errors.false_stances += usize::from(stance.iter().all(|instant| !instant.in_contact));
        errors.held.0 += stance.len();
        errors.held.1 += stance.iter().map(|instant| instant.speed_m_s * instant.speed_m_s).sum::<f64>();
        if from > 0 && to < truth.len() {
            errors.risen.0 += 1;
            errors.risen.1 += stance[stance.len() - 1].position_m[2] - stance[0].position_m[2];
        }
    }
    errors
}

impl StanceErrors {
    /// Takes in those of another walk.
    pub fn add(&mut self, other: &StanceErrors) {
        self.contacts += other.contacts;
        self.missed += other.missed;
        self.false_stances += other.false_stances;
        self.instants.0 += other.instants.0;
        self.instants.1 += other.instants.1;
        self.held.0 += other.held.0;
        self.held.1 += other.held.1;
        self.risen.0 += other.risen.0;
        self.risen.1 += other.risen.1;
        self.path_m += other.path_m;
    }

    /// In how much of the contacts the foot was taken to stand, percent.
    pub fn held_percent(&self) -> f64 {
        100.0 * self.instants.1 as f64 / self.instants.0 as f64
    }

    /// True speed of the foot where it was taken to stand, rms, m/s.
    pub fn held_speed_m_s(&self) -> f64 {
        (self.held.1 / self.held.0 as f64).sqrt()
    }

    /// How far the foot truly rose in a stance, on the mean, m: it sinks where this is negative.
    pub fn risen_m(&self) -> f64 {
        self.risen.1 / self.risen.0 as f64
    }
}

/// A foot that is slower than this is in contact, m/s: a running one rolls at up to half of it.
const SLOW_M_S: f64 = 0.4;
/// A contact lasts at least so long, and a gap between two, s.
const SHORTEST_S: f64 = 0.06;
/// The speed is taken over so long to either side: the cameras err by half a millimetre, s.
const SPEED_HALF_WINDOW_S: f64 = 0.015;

/// The contacts of a foot under motion capture, by its speed.
pub fn foot_instants(places: &[KnownPlace]) -> Vec<FootInstant> {
    let last = places.len().saturating_sub(1);
    let span_s = |from: usize, to: usize| (places[to].t_ns - places[from].t_ns) as f64 * 1e-9;
    if last == 0 || span_s(0, last) <= 0.0 {
        return Vec::new();
    }
    let interval_s = span_s(0, last) / last as f64;
    let half = (SPEED_HALF_WINDOW_S / interval_s).round().max(1.0) as usize;
    let mut instants: Vec<FootInstant> = (0..=last)
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half).min(last));
            let speed_m_s =
                distance_m(&places[from].position_m, &places[to].position_m) / span_s(from, to).max(1e-9);
            let KnownPlace { t_ns, position_m } = places[k];
            FootInstant { t_ns, position_m, speed_m_s, in_contact: speed_m_s < SLOW_M_S }
        })
        .collect();
    // A moment's pause in a swing is no contact, nor does a jerk end one.
    let least = (SHORTEST_S / interval_s).round() as usize;
    for short in [false, true] {
        let found = runs(instants.iter().map(|instant| Some(instant.in_contact)));
        for (from, to, in_contact) in found {
            if in_contact == short && to - from < least && from > 0 && to <= last {
                instants[from..to].iter_mut().for_each(|instant| instant.in_contact = !short);
            }
        }
    }
    instants
}

/// What was told of the newest instant that is not after this one.
fn told_at(told: &[(i64, bool)], t_ns: i64) -> Option<bool> {
    let after = told.partition_point(|(told_ns, _)| *told_ns <= t_ns);
    let (told_ns, stands) = told[..after].last()?;
    (t_ns - told_ns <= TOLD_HOLDS_NS).then_some(*stands)
}

/// Runs of equal values, as index ranges with the value; what is unknown belongs to none.
fn runs(values: impl Iterator<Item = Option<bool>>) -> Vec<(usize, usize, bool)> {
    let mut found: Vec<(usize, usize, bool)> = Vec::new();
    for (k, value) in values.enumerate() {
        let Some(value) = value else { continue };
        match found.last_mut() {
            Some((_, to, same)) if *to == k && *same == value => *to = k + 1,
            _ => found.push((k, k + 1, value)),
        }
    }
    found
}

fn distance_m(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: i64 = 10_000_000;

    /// Half a second on the ground, half a second on its way, five times; sinking by 4 mm in each contact.
    fn truth() -> Vec<FootInstant> {
        (0..500)
            .map(|k| {
                let (stride, phase) = (k / 100, k % 100);
                let in_contact = phase < 50;
                let swung = f64::from((phase - 50).max(0)) / 50.0;
                let sunk_m = if in_contact { -4e-3 * f64::from(phase) / 49.0 } else { -4e-3 };
                FootInstant {
                    t_ns: i64::from(k) * STEP_NS,
                    position_m: [1.3 * (f64::from(stride) + swung), 0.0, sunk_m + 4e-3 * swung],
                    speed_m_s: if in_contact { 0.03 } else { 2.6 },
                    in_contact,
                }
            })
            .collect()
    }

    fn told(stands: impl Fn(usize) -> bool) -> Vec<(i64, bool)> {
        (0..500).map(|k| (k as i64 * STEP_NS, stands(k))).collect()
    }

    #[test]
    fn a_detector_that_sees_every_contact_misses_none() {
        let errors = stances(&truth(), &told(|k| k % 100 < 50));
        assert_eq!((errors.contacts, errors.missed, errors.false_stances), (5, 0, 0));
        assert!((errors.held_percent() - 100.0).abs() < 1e-9);
        assert!((errors.held_speed_m_s() - 0.03).abs() < 1e-9);
        assert!((errors.risen_m() + 4e-3).abs() < 1e-9, "{errors:?}");
        assert!((errors.path_m - 4.0 * 1.3).abs() < 1e-9, "{errors:?}");
    }

    #[test]
    fn a_missed_contact_a_false_stance_and_a_foot_held_too_long_are_told() {
        // Nothing in the second contact; a moment in the third swing; the fourth is held into the swing.
        let errors = stances(
            &truth(),
            &told(|k| (k % 100 < 50 && k / 100 != 1) || (270..280).contains(&k) || (350..355).contains(&k)),
        );
        assert_eq!((errors.contacts, errors.missed, errors.false_stances), (5, 1, 1));
        assert!((errors.held_percent() - 80.0).abs() < 1e-9);
        let expected = ((200.0 * 0.03 * 0.03 + 15.0 * 2.6 * 2.6) / 215.0_f64).sqrt();
        assert!((errors.held_speed_m_s() - expected).abs() < 1e-9);
    }

    #[test]
    fn contacts_of_which_nothing_was_told_do_not_count() {
        let late: Vec<_> = told(|k| k % 100 < 50).into_iter().skip(130).collect();
        assert_eq!(stances(&truth(), &late).contacts, 3);
        assert_eq!(stances(&truth(), &[]), StanceErrors::default());
    }

    #[test]
    fn contacts_under_motion_capture_are_found_by_speed_and_last() {
        // 200 Hz: a second at rest with a jerk in it, a second at 1.3 m/s with a moment's pause, a second at rest.
        let mut x_m = 0.0;
        let places: Vec<KnownPlace> = (0..600)
            .map(|k| {
                let moves = ((200..400).contains(&k) && !(296..303).contains(&k)) || (100..102).contains(&k);
                x_m += if moves { 1.3 / 200.0 } else { 0.0 };
                KnownPlace { t_ns: k * 5_000_000, position_m: [x_m, 0.0, 0.0] }
            })
            .collect();
        let found = runs(foot_instants(&places).iter().map(|instant| Some(instant.in_contact)));
        let [(0, ends, true), (_, lands, false), (_, 600, true)] = found[..] else { panic!("{found:?}") };
        assert!((196..=203).contains(&ends) && (397..=404).contains(&lands), "{found:?}");
        assert!(foot_instants(&places[..1]).is_empty() && foot_instants(&[]).is_empty());
    }
}
