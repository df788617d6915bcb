//! Rows spread evenly: a line that follows the stamps slowly, and goes over gaps and steps of the clock with them.

use std::collections::VecDeque;

use super::Found;
use super::fit::Fit;
use super::regular::is_clock_set;
use crate::anomaly::Anomaly;
use crate::parse::remark::LogCause;
use crate::sample::ImuSample;

/// Rows that are looked at ahead.
const AHEAD: usize = 64;
/// How fast the line follows the stamps, ns: a sensor's clock drifts over minutes.
const FOLLOWS_NS: f64 = 20e9;
/// Stamps that are off the line by less are no gap, ns.
const LEAST_GAP_NS: f64 = 100e6;

/// Spreads rows evenly.
#[derive(Debug)]
pub(super) struct Even {
    fit: Fit,
    base_ns: i64,
    interval_ns: f64,
    /// Time of the row to come, ns after the base.
    next_ns: f64,
    /// Taken off the stamps: steps of the clock that were bridged, ns.
    offset_ns: f64,
    last_stamp_ns: Option<i64>,
    rows_since_anchor: f64,
    last_ns: Option<i64>,
    waiting: VecDeque<ImuSample>,
    ends_ns: [i64; 2],
    rows: u64,
}

impl Even {
    pub(super) fn new(fit: Fit, held: &mut Vec<ImuSample>) -> Even {
        let base_ns = held.first().map_or(0, |row| row.t_ns);
        Even {
            fit,
            base_ns,
            interval_ns: fit.interval_ns,
            next_ns: fit.first_ns,
            offset_ns: 0.0,
            last_stamp_ns: None,
            rows_since_anchor: 0.0,
            last_ns: None,
            waiting: std::mem::take(held).into(),
            ends_ns: [base_ns; 2],
            rows: 0,
        }
    }

    pub(super) fn take_held(&mut self, rows: &mut Vec<ImuSample>, found: &mut Found) {
        while self.waiting.len() > AHEAD {
            self.give(rows, found);
        }
    }

    pub(super) fn take(&mut self, rows: &mut Vec<ImuSample>, from: usize, found: &mut Found) {
        self.waiting.extend(rows.drain(from..));
        self.take_held(rows, found);
    }

    pub(super) fn finish(&mut self, rows: &mut Vec<ImuSample>, found: &mut Found) {
        while !self.waiting.is_empty() {
            self.give(rows, found);
        }
    }

    pub(super) fn anomaly(&self) -> Option<Anomaly> {
        let rate_hz = 1e9 / self.interval_ns;
        let cause = match self.fit {
            Fit { by_rate: true, .. } => LogCause::TimesByRate { given_rate_hz: rate_hz },
            Fit { rows_per_stamp, spread_ns, .. } if rows_per_stamp > 1.0 => {
                LogCause::CoarseTimes { rows_per_time: rows_per_stamp, step_s: spread_ns / 1e9, rate_hz }
            }
            Fit { spread_ns, .. } => LogCause::ArrivalTimes { spread_s: spread_ns / 1e9, rate_hz },
        };
        (self.rows > 0).then(|| cause.at(self.ends_ns, self.rows))
    }

    /// The stamp of a waiting row, ns after the base.
    fn stamp(&self, at: usize) -> f64 {
        (self.waiting[at].t_ns.saturating_sub(self.base_ns)) as f64 - self.offset_ns
    }

    /// Gives the oldest row.
    fn give(&mut self, rows: &mut Vec<ImuSample>, found: &mut Found) {
        if !self.fit.by_rate {
            self.follow(found);
        }
        let Some(mut row) = self.waiting.pop_front() else { return };
        self.last_stamp_ns = Some(row.t_ns);
        let mut t_ns = self.base_ns.saturating_add(self.next_ns.round() as i64);
        if let Some(last_ns) = self.last_ns {
            t_ns = t_ns.max(last_ns.saturating_add(1));
        }
        row.t_ns = t_ns;
        self.last_ns = Some(t_ns);
        if self.rows == 0 {
            self.ends_ns[0] = t_ns;
        }
        self.ends_ns[1] = t_ns;
        self.rows += 1;
        self.next_ns += self.interval_ns;
        rows.push(row);
    }

    fn follow(&mut self, found: &mut Found) {
        self.rows_since_anchor += 1.0;
        let coarse = self.fit.rows_per_stamp > 1.0;
        let bound_ns = (1.5 * self.fit.spread_ns + 2.0 * self.interval_ns).max(LEAST_GAP_NS);
        let off_ns = self.stamp(0) - self.next_ns;
        if off_ns.abs() > bound_ns {
            self.step(bound_ns, found);
            return;
        }
        // The first row of a stamp says when it was, others only that it was later.
        if coarse && self.last_stamp_ns == Some(self.waiting[0].t_ns) {
            return;
        }
        let Some(last_stamp_ns) = self.last_stamp_ns else { return };
        let lag_ns = if coarse { 0.5 * self.interval_ns } else { 0.0 };
        // A stamp after a lost one says too little of where in it the row lies.
        let jumped = (self.waiting[0].t_ns.saturating_sub(last_stamp_ns)) as f64;
        if coarse && jumped > 1.5 * self.fit.spread_ns {
            return;
        }
        let off_ns = off_ns + lag_ns;
        let share = (self.rows_since_anchor * self.interval_ns / FOLLOWS_NS).min(0.5);
        self.next_ns += share * off_ns;
        self.interval_ns += 0.25 * share * share * off_ns / self.rows_since_anchor;
        self.rows_since_anchor = 0.0;
    }

    /// The stamp has left the line: alone, or all that follow with it.
    fn step(&mut self, bound_ns: f64, found: &mut Found) {
        let offs: Vec<f64> = (0..self.waiting.len().min(AHEAD))
            .map(|k| self.stamp(k) - self.next_ns - k as f64 * self.interval_ns)
            .collect();
        let all_away = |sign: f64| offs.iter().all(|off| sign * off > bound_ns);
        let t_ns = self.base_ns.saturating_add(self.next_ns as i64);
        if all_away(1.0) {
            // What came least late says how long nothing came.
            let least = offs.iter().copied().fold(f64::INFINITY, f64::min);
            let step_ns = least + 0.5 * self.fit.spread_ns;
            if is_clock_set(step_ns as i64, self.interval_ns) {
                self.offset_ns += step_ns;
                found.tell(&LogCause::ClockSet { forward_by_s: step_ns / 1e9 }, t_ns);
            } else {
                self.next_ns += step_ns;
            }
        } else if all_away(-1.0) {
            let most = offs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let step_ns = most - 0.5 * self.fit.spread_ns;
            self.offset_ns += step_ns;
            found.tell(&LogCause::ClockSet { forward_by_s: step_ns / 1e9 }, t_ns);
        }
    }
}
