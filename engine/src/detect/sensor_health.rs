//! Whether the samples of one sensor can be believed, judged one by one as they come.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::anomaly::{Anomaly, AnomalyKind, Cause};
use crate::cause::{Channel, SensorCause};
use crate::sample::ImuSample;
use crate::stream::StreamId;

/// Occurrences of one kind that are nearer than this belong together, ns.
const TOGETHER_NS: i64 = 2_000_000_000;
/// Trouble that goes on is told again after this long, ns.
const TELL_AGAIN_NS: i64 = 60_000_000_000;
/// A time stamp so far ahead is believed when the next one says the same, ns: one that is wrong would
/// make all that follow look as if time went back.
const DOUBTFUL_JUMP_NS: i64 = 10_000_000_000;
/// No time stamp is farther from the session's start, years.
const LONGEST_TIME_YEARS: f64 = 100.0;
/// The same, either way.
const LONGEST_TIME_NS: std::ops::RangeInclusive<i64> = -3_155_760_000_000_000_000..=3_155_760_000_000_000_000;
/// A sensor whose samples come less often than this has gaps and no rate, ns.
const SLOWEST_NS: i64 = 1_500_000_000;
/// An axis that repeats itself to the bit for so long does not measure, ns.
const STUCK_NS: i64 = 1_000_000_000;
/// … and for at least so many samples.
const STUCK_SAMPLES: u32 = 50;
/// A rate that is clipped lies above this, rad/s (the smallest usual range is ±500 °/s).
const SMALLEST_RATE_RANGE_RAD_S: f64 = 8.5;
/// A specific force that is clipped lies above this, m/s² (the smallest usual range is ±2 g).
const SMALLEST_FORCE_RANGE_M_S2: f64 = 19.0;
/// No magnetometer shows more, µT.
const IMPOSSIBLE_FIELD_UT: f64 = 1e5;
/// From above the highest mountain to below the deepest mine.
const POSSIBLE_PRESSURE_HPA: std::ops::RangeInclusive<f64> = 250.0..=1300.0;

/// What the body that carries a sensor never does: a reading beyond is broken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// It never turns faster, rad/s.
    pub largest_rate_rad_s: f64,
    /// It is never pushed harder, m/s².
    pub largest_force_m_s2: f64,
}

/// Watches the samples of one inertial sensor.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SensorHealth {
    stream: StreamId,
    limits: Limits,
    last_t_ns: Option<i64>,
    /// The time of the sample before, if it was left out because it was so far ahead.
    jumped_to_ns: Option<i64>,
    last: [f64; 6],
    same_for: [u32; 6],
    same_since_ns: [i64; 6],
    interval_ns: i64,
    /// The last step that was far longer than usual, ns, and how many like it came one after the other.
    long_step_ns: i64,
    long_steps: u32,
    /// What goes on, by kind.
    open: BTreeMap<AnomalyKind, Anomaly>,
}

impl SensorHealth {
    /// For the samples of a stream, on a body of these limits.
    pub fn new(stream: StreamId, limits: Limits) -> Self {
        SensorHealth {
            stream,
            limits,
            last_t_ns: None,
            jumped_to_ns: None,
            last: [f64::NAN; 6],
            same_for: [0; 6],
            same_since_ns: [0; 6],
            interval_ns: 10_000_000,
            long_step_ns: 0,
            long_steps: 0,
            open: BTreeMap::new(),
        }
    }

    /// The sample as it may be used: without a magnetometer or pressure value that is not a number or
    /// beyond all reason; `None` when it must not be used at all. Anomalies that have come to their
    /// end are appended.
    pub fn admit(&mut self, sample: &ImuSample, told: &mut Vec<Anomaly>) -> Option<ImuSample> {
        self.admit_with(sample, told, |_| None::<SensorCause>)
    }

    /// The same, with a check of the system's own on samples of which time, rate and specific force can be believed.
    pub fn admit_with<C: Cause>(
        &mut self,
        sample: &ImuSample,
        told: &mut Vec<Anomaly>,
        own_check: impl FnOnce(&ImuSample) -> Option<C>,
    ) -> Option<ImuSample> {
        let t_ns = sample.t_ns;
        if !LONGEST_TIME_NS.contains(&t_ns) {
            let cause = SensorCause::TimeOfAnotherAge { farthest_years: LONGEST_TIME_YEARS };
            self.note(cause, self.last_t_ns.unwrap_or(0), told);
            return None;
        }
        if let Some(last_ns) = self.last_t_ns {
            let step_ns = t_ns - last_ns;
            if step_ns <= 0 {
                let cause = if step_ns == 0 {
                    SensorCause::RepeatedTime
                } else {
                    SensorCause::TimeGoesBack { back_by_s: -seconds(step_ns) }
                };
                self.note(cause, last_ns, told);
                return None;
            }
            if step_ns > DOUBTFUL_JUMP_NS && !self.jump_is_confirmed(t_ns) {
                self.jumped_to_ns = Some(t_ns);
                return None;
            }
            if let Some(ahead_ns) = self.jumped_to_ns.take().filter(|jumped_to_ns| *jumped_to_ns > t_ns) {
                self.note(SensorCause::TimeAhead { ahead_by_s: seconds(ahead_ns - last_ns) }, last_ns, told);
            }
        }
        self.close_old(t_ns, told);
        let channels = channels(sample);
        if channels.iter().any(|x| !x.is_finite()) {
            self.note(SensorCause::NotFinite, t_ns, told);
            return None;
        }
        let Limits { largest_rate_rad_s, largest_force_m_s2 } = self.limits;
        if channels[..3].iter().any(|x| x.abs() > largest_rate_rad_s)
            || channels[3..].iter().any(|x| x.abs() > largest_force_m_s2)
        {
            let cause = SensorCause::ImpossibleMotion { largest_rate_rad_s, largest_force_m_s2 };
            self.note(cause, t_ns, told);
            return None;
        }
        if let Some(last_ns) = self.last_t_ns.replace(t_ns) {
            self.watch_interval(last_ns, t_ns - last_ns, told);
        }
        self.watch_axes(t_ns, &channels, told);
        if let Some(cause) = own_check(sample) {
            self.note(cause, t_ns, told);
        }
        let mut admitted = *sample;
        if sample.mag_b_ut.is_some_and(|mag| mag.iter().any(|x| x.is_nan() || x.abs() >= IMPOSSIBLE_FIELD_UT))
        {
            admitted.mag_b_ut = None;
            self.note(SensorCause::ImpossibleField { largest_field_ut: IMPOSSIBLE_FIELD_UT }, t_ns, told);
        }
        if sample.pressure_hpa.is_some_and(|hpa| !POSSIBLE_PRESSURE_HPA.contains(&hpa)) {
            admitted.pressure_hpa = None;
            let (lowest_hpa, highest_hpa) = (*POSSIBLE_PRESSURE_HPA.start(), *POSSIBLE_PRESSURE_HPA.end());
            self.note(SensorCause::ImpossiblePressure { lowest_hpa, highest_hpa }, t_ns, told);
        }
        Some(admitted)
    }

    /// No more samples come: tells what is still open.
    pub fn finish(&mut self, told: &mut Vec<Anomaly>) {
        told.extend(std::mem::take(&mut self.open).into_values());
    }

    /// Whether the sample before has jumped to about this time, too.
    fn jump_is_confirmed(&self, t_ns: i64) -> bool {
        self.jumped_to_ns.is_some_and(|jumped_to_ns| (1..=DOUBTFUL_JUMP_NS).contains(&(t_ns - jumped_to_ns)))
    }

    fn watch_interval(&mut self, last_ns: i64, step_ns: i64, told: &mut Vec<Anomaly>) {
        let usual_ns = self.interval_ns;
        if step_ns > (usual_ns * 7 / 2).max(50_000_000) {
            // Three steps alike are no gaps: that is how often a sample comes.
            let alike = (step_ns - self.long_step_ns).abs() < step_ns / 4;
            self.long_steps = if alike { self.long_steps + 1 } else { 1 };
            self.long_step_ns = step_ns;
            if self.long_steps >= 3 && step_ns < SLOWEST_NS {
                self.interval_ns = step_ns;
                return;
            }
            let gap = SensorCause::Gap { silence_s: seconds(step_ns), usual_interval_s: seconds(usual_ns) };
            let samples = (step_ns / usual_ns.max(1)).max(1) as u64 - 1;
            told.push(gap.anomaly(Some(self.stream), [last_ns, last_ns + step_ns], samples));
        } else {
            self.long_steps = 0;
            // Follows the usual interval, slowly enough not to follow jitter.
            self.interval_ns += (step_ns - usual_ns) / 32;
        }
    }

    fn watch_axes(&mut self, t_ns: i64, channels: &[f64; 6], told: &mut Vec<Anomaly>) {
        for (axis, value) in channels.iter().enumerate() {
            if *value != self.last[axis] {
                self.last[axis] = *value;
                self.same_for[axis] = 1;
                self.same_since_ns[axis] = t_ns;
                continue;
            }
            self.same_for[axis] += 1;
            let smallest_range = if axis < 3 { SMALLEST_RATE_RANGE_RAD_S } else { SMALLEST_FORCE_RANGE_M_S2 };
            let (channel, reading) = (Channel::at(axis), *value);
            if self.same_for[axis] >= 3 && value.abs() > smallest_range && self.same_for[axis] < STUCK_SAMPLES
            {
                self.note(SensorCause::EndOfRange { channel, reading }, t_ns, told);
            }
            if self.same_for[axis] >= STUCK_SAMPLES && t_ns - self.same_since_ns[axis] >= STUCK_NS {
                self.note(SensorCause::StuckAxis { channel, reading }, t_ns, told);
            }
        }
    }

    /// Notes trouble that somebody else has found; it is told when it has come to its end.
    pub fn note(&mut self, cause: impl Cause, t_ns: i64, told: &mut Vec<Anomaly>) {
        let kind = cause.kind();
        if let Some(open) = self.open.get_mut(&kind) {
            // A sample that was left out does not count against the times that follow it.
            open.t_end_ns = open.t_end_ns.max(t_ns);
            open.samples += 1;
            if t_ns - open.t_start_ns > TELL_AGAIN_NS {
                told.extend(self.open.remove(&kind));
            }
            return;
        }
        self.open.insert(kind, cause.anomaly(Some(self.stream), [t_ns; 2], 1));
    }

    fn close_old(&mut self, t_ns: i64, told: &mut Vec<Anomaly>) {
        if !self.open.values().any(|anomaly| t_ns - anomaly.t_end_ns > TOGETHER_NS) {
            return;
        }
        self.open.retain(|_, anomaly| {
            let goes_on = t_ns - anomaly.t_end_ns <= TOGETHER_NS;
            if !goes_on {
                told.push(anomaly.clone());
            }
            goes_on
        });
    }
}

fn channels(sample: &ImuSample) -> [f64; 6] {
    let ([gx, gy, gz], [ax, ay, az]) = (sample.w_ib_b_rad_s, sample.f_b_m_s2);
    [gx, gy, gz, ax, ay, az]
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { largest_rate_rad_s: 90.0, largest_force_m_s2: 2000.0 };

    fn quiet(k: i64) -> ImuSample {
        let wobble = ((k * 7919) % 1009) as f64 * 1e-5;
        ImuSample {
            t_ns: k * 10_000_000,
            w_ib_b_rad_s: [wobble, -wobble, 2.0 * wobble],
            f_b_m_s2: [wobble, 3.0 * wobble, 9.8 + wobble],
            mag_b_ut: None,
            pressure_hpa: None,
        }
    }

    fn found(change: impl Fn(i64, &mut ImuSample)) -> (Vec<Anomaly>, usize) {
        let mut health = SensorHealth::new(StreamId::named("body"), LIMITS);
        let (mut told, mut admitted) = (Vec::new(), 0);
        for k in 0..600 {
            let mut sample = quiet(k);
            change(k, &mut sample);
            admitted += usize::from(health.admit(&sample, &mut told).is_some());
        }
        health.finish(&mut told);
        (told, admitted)
    }

    #[test]
    fn a_healthy_sensor_has_nothing_to_tell() {
        assert_eq!(found(|_, _| {}), (vec![], 600));
    }

    #[test]
    fn each_trouble_is_named_with_its_time_and_stream() {
        type Trouble = fn(i64, &mut ImuSample);
        let cases: [(AnomalyKind, Trouble, usize); 6] = [
            (
                AnomalyKind::GAP,
                |k, s| {
                    if k >= 300 {
                        s.t_ns += 700_000_000
                    }
                },
                600,
            ),
            (
                AnomalyKind::REPEATED_TIME,
                |k, s| {
                    if k == 300 {
                        s.t_ns -= 10_000_000
                    }
                },
                599,
            ),
            (
                AnomalyKind::BACKWARD_TIME,
                |k, s| {
                    if k == 300 {
                        s.t_ns -= 50_000_000
                    }
                },
                599,
            ),
            (
                AnomalyKind::SATURATION,
                |k, s| {
                    if (300..305).contains(&k) {
                        s.w_ib_b_rad_s[1] = 34.9
                    }
                },
                600,
            ),
            (
                AnomalyKind::STUCK_AXIS,
                |k, s| {
                    if (300..450).contains(&k) {
                        s.f_b_m_s2[0] = 0.125
                    }
                },
                600,
            ),
            (
                AnomalyKind::NOT_FINITE,
                |k, s| {
                    if k == 300 {
                        s.f_b_m_s2[2] = f64::NAN
                    }
                },
                599,
            ),
        ];
        for (kind, change, admitted) in cases {
            let (told, let_in) = found(change);
            assert_eq!(told.iter().map(|a| a.kind).collect::<Vec<_>>(), [kind]);
            assert_eq!(let_in, admitted, "{kind:?}");
            assert_eq!(told[0].stream, Some(StreamId::named("body")));
            assert!(
                (2_900_000_000..=3_500_000_000).contains(&told[0].t_start_ns)
                    || kind == AnomalyKind::STUCK_AXIS,
                "{told:?}"
            );
        }
    }

    #[test]
    fn a_stamp_far_ahead_costs_one_sample_and_a_long_pause_no_more() {
        let (told, admitted) = found(|k, s| {
            if k == 300 {
                s.t_ns += 3_600_000_000_000;
            }
        });
        assert_eq!(admitted, 599);
        assert_eq!(told.iter().map(|a| a.kind).collect::<Vec<_>>(), [AnomalyKind::BACKWARD_TIME]);
        assert!(told[0].detail.contains("3600.0 s ahead"), "{}", told[0].detail);
        let (told, admitted) = found(|k, s| {
            if k >= 300 {
                s.t_ns += 3_600_000_000_000;
            }
        });
        assert_eq!(admitted, 599);
        assert_eq!(told.iter().map(|a| a.kind).collect::<Vec<_>>(), [AnomalyKind::GAP]);
    }

    #[test]
    fn a_second_of_readings_that_are_no_numbers_is_one_gap() {
        let (told, admitted) = found(|k, s| {
            if (300..400).contains(&k) {
                s.f_b_m_s2[2] = f64::NAN;
            }
        });
        assert_eq!(admitted, 500);
        let kinds: Vec<_> = told.iter().map(|a| (a.kind, a.samples)).collect();
        assert_eq!(kinds, [(AnomalyKind::GAP, 100), (AnomalyKind::NOT_FINITE, 100)]);
    }

    #[test]
    fn a_magnetic_value_that_cannot_be_counts_as_missing() {
        for value in [f64::NAN, f64::INFINITY, -1e300] {
            let (mut health, mut told) = (SensorHealth::new(StreamId::named("body"), LIMITS), Vec::new());
            let sample = ImuSample { mag_b_ut: Some([value, 1.0, 2.0]), ..quiet(0) };
            assert_eq!(health.admit(&sample, &mut told).unwrap().mag_b_ut, None);
            health.finish(&mut told);
            assert_eq!(told[0].kind, AnomalyKind::NOT_FINITE);
        }
    }

    #[test]
    fn a_pressure_that_cannot_be_counts_as_missing() {
        for (hpa, admitted) in
            [(f64::NAN, None), (-5.0, None), (0.0, None), (1e9, None), (890.2, Some(890.2))]
        {
            let mut health = SensorHealth::new(StreamId::named("body"), LIMITS);
            let sample = ImuSample { pressure_hpa: Some(hpa), ..quiet(0) };
            assert_eq!(health.admit(&sample, &mut Vec::new()).unwrap().pressure_hpa, admitted);
        }
    }
}
