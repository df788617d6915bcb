//! What a log is worth, before anything is made of it: its rate, its gaps, whether it was clipped,
//! whether it begins with the stand that alignment needs, and a small chart.
//!
//! In bounded memory, whatever the length of the log.

use serde::Serialize;

use crate::sample::ImuSample;
use crate::stream::Reading;

/// Samples by which the usual interval is judged.
const JUDGED_BY: usize = 512;
/// An interval so many times the usual one is a gap.
const GAP_INTERVALS: f64 = 2.5;
/// Gaps that are told one by one.
const GAPS_TOLD: usize = 20;
/// Bins of the chart.
const BINS: usize = 240;
/// First rows that are shown.
const ROWS_SHOWN: usize = 8;
/// A foot stands while it turns no faster than this, bias included, rad/s …
const STILL_RAD_S: f64 = 0.15;
/// … and is pushed by no more or less than this besides gravity, m/s².
const STILL_M_S2: f64 = 1.0;
const GRAVITY_M_S2: f64 = 9.8;
/// A sensor moved for this long has ended the stand, ns: a single knock has not.
const KNOCK_NS: i64 = 100_000_000;
/// A value that is clipped lies above these: the smallest usual ranges, ±250 °/s and ±2 g.
const LEAST_CLIPPED: [f64; 2] = [4.3, 19.0];
/// So many samples of one axis at its very extreme are no coincidence.
const FEWEST_CLIPPED: u64 = 3;

/// Takes the samples of one log as they come.
#[derive(Clone, Debug, Default)]
pub struct LogSurvey {
    samples: u64,
    first_ns: i64,
    last_ns: i64,
    /// Start and length of the first intervals, until it is known what is usual.
    early: Vec<(i64, i64)>,
    usual_ns: f64,
    gaps: Vec<Gap>,
    gap_count: u64,
    gap_ns: i64,
    repeated: u64,
    backward: u64,
    extremes: [Extreme; 6],
    still_until_ns: Option<i64>,
    moving_since_ns: Option<i64>,
    stand_over: bool,
    with_field: u64,
    with_pressure: u64,
    field_sum_ut: f64,
    rows: Vec<Vec<Option<f64>>>,
    chart: Chart,
}

/// The largest value of an axis, and how often it was reached.
#[derive(Clone, Copy, Debug, Default)]
struct Extreme {
    value: f64,
    times: u64,
}

/// A time without samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "LogGap"))]
pub struct Gap {
    /// Since the session's start, s.
    pub t_s: f64,
    /// How long, s.
    pub length_s: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "LogSurvey"))]
pub struct Survey {
    /// How many samples.
    pub samples: u64,
    /// Time of the first one since the session's start, s.
    pub t_first_s: f64,
    /// Time of the last one, s.
    pub t_last_s: f64,
    /// From the first to the last, s; 0 where the clock went back behind the first.
    pub duration_s: f64,
    /// Samples a second, by the usual interval, Hz; `None` for fewer than two samples.
    pub rate_hz: Option<f64>,
    /// How many times samples are missing.
    pub gaps: u64,
    /// How long all these times are together, s.
    pub gaps_s: f64,
    /// The first of them.
    pub first_gaps: Vec<Gap>,
    /// Samples at the time of the one before.
    pub repeated_times: u64,
    /// Samples before the time of the one before.
    pub backward_times: u64,
    /// Samples of an axis of the angular rate at the end of its range.
    pub clipped_rates: u64,
    /// The same of the specific force.
    pub clipped_forces: u64,
    /// Largest angular rate on an axis, rad/s.
    pub largest_rate_rad_s: f64,
    /// Largest specific force on an axis, m/s².
    pub largest_force_m_s2: f64,
    /// How long the sensor stands still at the beginning, s.
    pub still_s: f64,
    /// Share of samples with a magnetic field.
    pub field_share: f64,
    /// Mean length of the field, µT (counts, where it has no unit); `None` without one.
    pub field_mean_ut: Option<f64>,
    /// Share of samples with an air pressure.
    pub pressure_share: f64,
    /// The first samples: `[t_s, gyr x y z, acc x y z, mag x y z, pressure]`, or the time and the values of a row;
    /// `None` for a missing value.
    pub first_rows: Vec<Vec<Option<f64>>>,
    /// The lengths of rate and force over time.
    pub chart: ChartView,
}

/// Least and most of two quantities in even stretches of time.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "LogChart"))]
pub struct ChartView {
    /// Start of the first stretch, s.
    pub t_first_s: f64,
    /// Length of a stretch, s.
    pub step_s: f64,
    /// Least and most of the length of the angular rate, rad/s; `None` for a stretch without samples.
    pub rate_rad_s: Vec<Option<[f64; 2]>>,
    /// The same of the specific force, m/s².
    pub force_m_s2: Vec<Option<[f64; 2]>>,
}

impl LogSurvey {
    /// Takes one reading: of a row of numbers its time alone is judged.
    pub fn take(&mut self, reading: Reading<'_>) {
        let t_ns = reading.t_ns();
        if self.samples == 0 {
            self.first_ns = t_ns;
            self.last_ns = t_ns;
        } else {
            self.take_interval(t_ns.saturating_sub(self.last_ns), self.last_ns);
        }
        self.last_ns = t_ns;
        self.samples += 1;
        if self.rows.len() < ROWS_SHOWN {
            self.rows.push(match reading {
                Reading::Imu(sample) => row(sample),
                Reading::Values { values, .. } => {
                    let values = values.iter().map(|value| (!value.is_nan()).then_some(*value));
                    std::iter::once(Some(seconds(t_ns))).chain(values).collect()
                }
            });
        }
        if let Reading::Imu(sample) = reading {
            self.take_sample(sample);
        }
    }

    fn take_sample(&mut self, sample: &ImuSample) {
        for (extreme, value) in
            self.extremes.iter_mut().zip(sample.w_ib_b_rad_s.iter().chain(&sample.f_b_m_s2))
        {
            extreme.take(value.abs());
        }
        let (rate, force) = (length(sample.w_ib_b_rad_s), length(sample.f_b_m_s2));
        self.take_stillness(sample.t_ns, rate, force);
        if let Some(field) = sample.mag_b_ut.map(length).filter(|field| field.is_finite()) {
            self.with_field += 1;
            self.field_sum_ut += field;
        }
        self.with_pressure += u64::from(sample.pressure_hpa.is_some());
        self.chart.take(sample.t_ns, [rate, force]);
    }

    fn take_interval(&mut self, interval_ns: i64, from_ns: i64) {
        match interval_ns {
            0 => self.repeated += 1,
            i64::MIN..0 => self.backward += 1,
            _ if self.usual_ns > 0.0 => self.judge(from_ns, interval_ns),
            _ => {
                self.early.push((from_ns, interval_ns));
                if self.early.len() == JUDGED_BY {
                    self.judge_early();
                }
            }
        }
    }

    /// The median of the first intervals is the usual one.
    fn judge_early(&mut self) {
        let early = std::mem::take(&mut self.early);
        let mut lengths: Vec<i64> = early.iter().map(|(_, length_ns)| *length_ns).collect();
        lengths.sort_unstable();
        let Some(median) = lengths.get(lengths.len() / 2) else { return };
        self.usual_ns = *median as f64;
        for (from_ns, length_ns) in early {
            self.judge(from_ns, length_ns);
        }
    }

    fn judge(&mut self, from_ns: i64, interval_ns: i64) {
        if interval_ns as f64 <= GAP_INTERVALS * self.usual_ns {
            return;
        }
        self.gap_count += 1;
        self.gap_ns = self.gap_ns.saturating_add(interval_ns);
        if self.gaps.len() < GAPS_TOLD {
            self.gaps.push(Gap { t_s: seconds(from_ns), length_s: seconds(interval_ns) });
        }
    }

    fn take_stillness(&mut self, t_ns: i64, rate: f64, force: f64) {
        if self.stand_over {
            return;
        }
        // Not a number is not still.
        if rate <= STILL_RAD_S && (force - GRAVITY_M_S2).abs() <= STILL_M_S2 {
            self.moving_since_ns = None;
            self.still_until_ns = Some(t_ns);
        } else {
            let since_ns = *self.moving_since_ns.get_or_insert(t_ns);
            self.stand_over = t_ns.saturating_sub(since_ns) >= KNOCK_NS;
        }
    }

    /// What was found in the samples so far.
    pub fn finish(mut self) -> Survey {
        self.judge_early();
        let share = |count: u64| if self.samples == 0 { 0.0 } else { count as f64 / self.samples as f64 };
        let clipped = |axes: std::ops::Range<usize>, least: f64| {
            let at_end = |extreme: &&Extreme| extreme.value > least && extreme.times >= FEWEST_CLIPPED;
            self.extremes[axes].iter().filter(at_end).map(|extreme| extreme.times).sum()
        };
        let largest =
            |axes: std::ops::Range<usize>| self.extremes[axes].iter().map(|e| e.value).fold(0.0, f64::max);
        let still_ns =
            self.still_until_ns.map_or(0, |until_ns| until_ns.saturating_sub(self.first_ns).max(0));
        Survey {
            samples: self.samples,
            t_first_s: seconds(self.first_ns),
            t_last_s: seconds(self.last_ns),
            duration_s: seconds(self.last_ns.saturating_sub(self.first_ns).max(0)),
            rate_hz: (self.usual_ns > 0.0).then(|| 1e9 / self.usual_ns),
            gaps: self.gap_count,
            gaps_s: seconds(self.gap_ns),
            repeated_times: self.repeated,
            backward_times: self.backward,
            clipped_rates: clipped(0..3, LEAST_CLIPPED[0]),
            clipped_forces: clipped(3..6, LEAST_CLIPPED[1]),
            largest_rate_rad_s: largest(0..3),
            largest_force_m_s2: largest(3..6),
            still_s: seconds(still_ns),
            field_share: share(self.with_field),
            field_mean_ut: (self.with_field > 0).then(|| self.field_sum_ut / self.with_field as f64),
            pressure_share: share(self.with_pressure),
            first_rows: self.rows,
            first_gaps: self.gaps,
            chart: self.chart.view(),
        }
    }
}

impl Extreme {
    fn take(&mut self, value: f64) {
        if value > self.value && value.is_finite() {
            *self = Extreme { value, times: 1 };
        } else if value == self.value {
            self.times += 1;
        }
    }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

fn seconds(ns: i64) -> f64 {
    ns as f64 / 1e9
}

fn row(sample: &ImuSample) -> Vec<Option<f64>> {
    let inertial = sample.w_ib_b_rad_s.iter().chain(&sample.f_b_m_s2).map(|value| Some(*value));
    let mag = (0..3).map(|axis| sample.mag_b_ut.map(|mag| mag[axis]));
    std::iter::once(Some(seconds(sample.t_ns)))
        .chain(inertial)
        .chain(mag)
        .chain([sample.pressure_hpa])
        .collect()
}

/// Least and most of two quantities; where the time runs out, two stretches become one.
#[derive(Clone, Debug, Default)]
struct Chart {
    first_ns: Option<i64>,
    step_ns: f64,
    bins: Vec<[Option<[f64; 2]>; 2]>,
}

impl Chart {
    fn take(&mut self, t_ns: i64, values: [f64; 2]) {
        let first_ns = *self.first_ns.get_or_insert(t_ns);
        if self.bins.is_empty() {
            self.bins = vec![[None; 2]; BINS];
            self.step_ns = 1e7;
        }
        let since_ns = t_ns.saturating_sub(first_ns) as f64;
        if since_ns < 0.0 {
            return;
        }
        while since_ns >= self.step_ns * BINS as f64 {
            for bin in 0..BINS / 2 {
                let [a, b] = [self.bins[2 * bin], self.bins[2 * bin + 1]];
                self.bins[bin] = [joined(a[0], b[0]), joined(a[1], b[1])];
            }
            self.bins[BINS / 2..].fill([None; 2]);
            self.step_ns *= 2.0;
        }
        let bin = &mut self.bins[((since_ns / self.step_ns) as usize).min(BINS - 1)];
        for (range, value) in bin.iter_mut().zip(values) {
            if value.is_finite() {
                *range = joined(*range, Some([value, value]));
            }
        }
    }

    fn view(&self) -> ChartView {
        let last = self.bins.iter().rposition(|bin| bin[0].is_some()).map_or(0, |last| last + 1);
        ChartView {
            t_first_s: seconds(self.first_ns.unwrap_or(0)),
            step_s: self.step_ns / 1e9,
            rate_rad_s: self.bins[..last].iter().map(|bin| bin[0]).collect(),
            force_m_s2: self.bins[..last].iter().map(|bin| bin[1]).collect(),
        }
    }
}

fn joined(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> Option<[f64; 2]> {
    match (a, b) {
        (Some([low, high]), Some([other_low, other_high])) => {
            Some([low.min(other_low), high.max(other_high)])
        }
        (some, None) | (None, some) => some,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t_ns: i64, rate: f64, force: f64) -> ImuSample {
        ImuSample {
            t_ns,
            w_ib_b_rad_s: [0.0, rate, 0.0],
            f_b_m_s2: [0.0, 0.0, force],
            mag_b_ut: Some([0.0, 30.0, 40.0]),
            pressure_hpa: None,
        }
    }

    fn survey(samples: impl IntoIterator<Item = ImuSample>) -> Survey {
        let mut survey = LogSurvey::default();
        samples.into_iter().for_each(|sample| survey.take((&sample).into()));
        survey.finish()
    }

    /// Twelve seconds of standing, then steps that are clipped at ±2000 °/s, at 100 Hz.
    fn walk() -> impl Iterator<Item = ImuSample> {
        (0..6000).filter(|i| !(3000..3050).contains(i)).map(|i| {
            let swing = i >= 1200 && i % 100 < 30;
            sample(i * 10_000_000, if swing { 34.9 } else { 0.02 }, if swing { 25.0 } else { 9.8 })
        })
    }

    #[test]
    fn a_walk_with_a_gap_that_was_clipped() {
        let found = survey(walk());
        assert_eq!((found.samples, found.gaps, found.repeated_times), (5950, 1, 0));
        assert_eq!(found.rate_hz, Some(100.0));
        assert!((found.duration_s - 59.99).abs() < 1e-9 && (found.gaps_s - 0.51).abs() < 1e-9, "{found:?}");
        assert!((found.first_gaps[0].t_s - 29.99).abs() < 1e-9);
        assert!((found.still_s - 11.99).abs() < 1e-9, "{}", found.still_s);
        assert!(found.clipped_rates > 1000 && found.clipped_forces > 1000);
        assert_eq!((found.field_share, found.field_mean_ut), (1.0, Some(50.0)));
        assert_eq!(found.first_rows[1][0..3], [Some(0.01), Some(0.0), Some(0.02)]);
        assert_eq!(found.first_rows[1][10], None);
    }

    #[test]
    fn the_chart_spans_the_walk_and_keeps_its_extremes() {
        let chart = survey(walk()).chart;
        assert!(chart.rate_rad_s.len() > BINS / 3 && chart.rate_rad_s.len() <= BINS);
        assert!((chart.rate_rad_s.len() as f64 * chart.step_s - 60.0).abs() < chart.step_s);
        assert_eq!(chart.rate_rad_s[0], Some([0.02, 0.02]));
        assert!(chart.force_m_s2.iter().flatten().any(|range| *range == [9.8, 25.0]));
    }

    #[test]
    fn a_knock_does_not_end_the_stand_and_the_first_step_does() {
        let knocked = (0..2000).map(|i| sample(i * 10_000_000, 0.0, if i == 300 { 30.0 } else { 9.8 }));
        assert!((survey(knocked).still_s - 19.99).abs() < 1e-9);
        let at_once = (0..2000).map(|i| sample(i * 10_000_000, 3.0, 12.0));
        assert_eq!(survey(at_once).still_s, 0.0);
    }

    #[test]
    fn times_that_cannot_be_are_counted_and_harm_nothing() {
        let times = [0, 10, 10, 5, i64::MAX, i64::MIN, 0];
        let found = survey(times.map(|t_ns| sample(t_ns, f64::NAN, f64::INFINITY)));
        assert_eq!((found.repeated_times, found.backward_times), (1, 2));
        assert_eq!(found.still_s, 0.0);
        let back = survey([10, 0].map(|t_ns| sample(t_ns * 1_000_000_000, 0.0, 9.8)));
        assert_eq!((back.duration_s, back.still_s), (0.0, 0.0), "no time is negative");
        assert_eq!(survey([]).rate_hz, None);
    }
}
