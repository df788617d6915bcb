//! Rows whose stamps are regular pass as they are. A stamp that does not follow the one before is held with some rows
//! after it, which show what it is: a gap, a clock that was set, a single wrong stamp, or rows in another order.

use std::collections::VecDeque;

use super::Found;
use super::fit::median;
use crate::parse::remark::LogCause;
use crate::sample::ImuSample;

/// Rows that show what a stamp is.
const AHEAD: usize = 64;
/// A stamp so many intervals after the one before needs no look.
const USUAL: f64 = 1.5;
/// Wrong stamps in a row that are replaced.
const MOST_WRONG: usize = 8;
/// Rows among which the order is looked at.
const MOST_LATE: usize = 16;
/// A silence that is shorter is a gap, whatever else it may be, ns.
const LEAST_SET_NS: i64 = 10_000_000_000;
/// A longer one is a clock that was set: no recorder waits for a day within one walk.
const DAY_NS: i64 = 86_400_000_000_000;
/// Zones are apart by multiples of this, ns.
const ZONE_NS: i64 = 900_000_000_000;

/// Whether a silence that the stamps show is a clock that was set rather than a gap, by its length alone.
pub(super) fn is_clock_set(silence_ns: i64, interval_ns: f64) -> bool {
    let beyond = silence_ns.saturating_sub(interval_ns as i64);
    let off_zone = beyond.saturating_add(ZONE_NS / 2).rem_euclid(ZONE_NS) - ZONE_NS / 2;
    silence_ns > DAY_NS
        || beyond > ZONE_NS - 1_000_000_000 && off_zone.abs() as f64 <= (2.0 * interval_ns).min(5e7)
}

/// Passes regular rows on.
#[derive(Debug)]
pub(super) struct Regular {
    interval_ns: f64,
    longest_ns: i64,
    /// Added to the stamps: steps of the clock that were bridged, ns.
    offset_ns: i64,
    before: Option<ImuSample>,
    waiting: VecDeque<ImuSample>,
}

impl Regular {
    pub(super) fn new(interval_ns: f64, held: &mut Vec<ImuSample>) -> Regular {
        let mut regular = Regular {
            interval_ns: 0.0,
            longest_ns: 0,
            offset_ns: 0,
            before: None,
            waiting: std::mem::take(held).into(),
        };
        regular.set_interval(interval_ns);
        regular
    }

    fn set_interval(&mut self, interval_ns: f64) {
        self.interval_ns = interval_ns.max(1.0);
        self.longest_ns = (USUAL * self.interval_ns) as i64;
    }

    pub(super) fn take_held(&mut self, rows: &mut Vec<ImuSample>, found: &mut Found) {
        // The first stamp may be the wrong one: what follows says so.
        self.look_at_first(found);
        self.give(rows, AHEAD, found);
    }

    pub(super) fn take(&mut self, rows: &mut Vec<ImuSample>, from: usize, found: &mut Found) {
        let mut at = from;
        if self.waiting.is_empty()
            && let Some(before) = &self.before
        {
            let mut last_ns = before.t_ns;
            while let Some(row) = rows.get_mut(at) {
                let t_ns = row.t_ns.wrapping_add(self.offset_ns);
                if !(1..=self.longest_ns).contains(&t_ns.wrapping_sub(last_ns)) {
                    break;
                }
                row.t_ns = t_ns;
                last_ns = t_ns;
                at += 1;
            }
            if at > from {
                self.before = rows.get(at - 1).copied();
            }
        }
        if at < rows.len() {
            self.waiting.extend(rows.drain(at..));
            self.give(rows, AHEAD, found);
        }
    }

    pub(super) fn finish(&mut self, rows: &mut Vec<ImuSample>, found: &mut Found) {
        self.give(rows, 1, found);
    }

    /// Gives the rows whose times are known, as long as `enough` wait.
    fn give(&mut self, rows: &mut Vec<ImuSample>, enough: usize, found: &mut Found) {
        while let Some(first) = self.waiting.front() {
            let usual = self.before.is_none_or(|before| {
                let step_ns = first.t_ns.wrapping_add(self.offset_ns).wrapping_sub(before.t_ns);
                (1..=self.longest_ns).contains(&step_ns)
            });
            if !usual {
                if self.waiting.len() < enough {
                    return;
                }
                self.look(found);
            }
            self.pass(rows);
        }
    }

    fn pass(&mut self, rows: &mut Vec<ImuSample>) {
        let Some(mut row) = self.waiting.pop_front() else { return };
        row.t_ns = row.t_ns.saturating_add(self.offset_ns);
        // A row that goes back all the same is left to the user of the log; time goes on from the newest.
        if self.before.is_none_or(|before| before.t_ns < row.t_ns) {
            self.before = Some(row);
        }
        rows.push(row);
    }

    fn stamp(&self, at: usize) -> Option<i64> {
        Some(self.waiting.get(at)?.t_ns.saturating_add(self.offset_ns))
    }

    fn look_at_first(&mut self, found: &mut Found) {
        let (Some(first), Some(second), Some(third)) = (self.stamp(0), self.stamp(1), self.stamp(2)) else {
            return;
        };
        let follows = |a: i64, b: i64| (1..=2 * self.longest_ns).contains(&b.saturating_sub(a));
        if follows(second, third) && !follows(first, second) {
            if is_empty(&self.waiting[0]) {
                self.waiting.pop_front();
                found.gather(1, second, |rows| LogCause::EmptyRows { empty_rows: rows as f64 });
                return;
            }
            let gap_ns = second.saturating_sub(first);
            if gap_ns <= 0 || gap_ns > LEAST_SET_NS {
                self.waiting[0].t_ns = self.waiting[1].t_ns.saturating_sub(self.interval_ns as i64);
                found.gather(1, second, |rows| LogCause::TimesReplaced { replaced: rows as f64 });
            }
        }
    }

    /// A stamp does not follow: puts right what has to be, so that the first row that waits can pass.
    fn look(&mut self, found: &mut Found) {
        let Some(before) = self.before else { return };
        let last_ns = before.t_ns;
        if is_empty(&self.waiting[0]) && self.waiting.len() > 1 {
            self.waiting.pop_front();
            found.gather(1, last_ns, |rows| LogCause::EmptyRows { empty_rows: rows as f64 });
            // What comes next is looked at by itself.
            let step_ns = self.stamp(0).unwrap_or(last_ns).saturating_sub(last_ns);
            if (1..=2 * self.longest_ns).contains(&step_ns) || self.waiting.is_empty() {
                return;
            }
        }
        if self.sort(last_ns, found) || self.replace(last_ns, found) {
            return;
        }
        let Some(first_ns) = self.stamp(0) else { return };
        let step_ns = first_ns.saturating_sub(last_ns);
        let goes_on = self.goes_on();
        let interval_ns = self.interval_ns as i64;
        if step_ns <= 0 && goes_on && step_ns < -interval_ns / 4
            || step_ns > LEAST_SET_NS
                && goes_on
                && (is_clock_set(step_ns, self.interval_ns) || self.is_continuous(&before))
        {
            let set_by_ns = step_ns.saturating_sub(interval_ns);
            self.offset_ns = self.offset_ns.saturating_sub(set_by_ns);
            found.tell(&LogCause::ClockSet { forward_by_s: set_by_ns as f64 / 1e9 }, last_ns);
        }
        if goes_on {
            self.learn();
        }
    }

    /// Puts rows that came late back into order, where that makes their times regular.
    fn sort(&mut self, last_ns: i64, found: &mut Found) -> bool {
        let among = self.waiting.len().min(MOST_LATE);
        let stamps: Vec<i64> = (0..among).filter_map(|k| self.stamp(k)).collect();
        if stamps.iter().any(|t_ns| *t_ns <= last_ns) || stamps.is_sorted() {
            return false;
        }
        let mut order: Vec<usize> = (0..among).collect();
        order.sort_by_key(|k| stamps[*k]);
        let least = (0.5 * self.interval_ns) as i64;
        let most = 4 * self.longest_ns;
        let regular = order
            .windows(2)
            .all(|pair| (least..=most).contains(&stamps[pair[1]].saturating_sub(stamps[pair[0]])));
        if !regular || stamps[order[0]].saturating_sub(last_ns) > self.longest_ns {
            return false;
        }
        let rows: Vec<ImuSample> = order.iter().map(|k| self.waiting[*k]).collect();
        rows.into_iter().enumerate().for_each(|(k, row)| self.waiting[k] = row);
        let late = stamps.windows(2).filter(|pair| pair[1] < pair[0]).count() as u64;
        found.gather(late, last_ns, |rows| LogCause::RowsReordered { reordered: rows as f64 });
        true
    }

    /// Replaces a few wrong stamps before one that goes on from the last good one.
    fn replace(&mut self, last_ns: i64, found: &mut Found) -> bool {
        for wrong in 1..=MOST_WRONG {
            let (Some(after_ns), next_ns) = (self.stamp(wrong), self.stamp(wrong + 1)) else { return false };
            let expected = (wrong + 1) as f64 * self.interval_ns;
            let off = after_ns.saturating_sub(last_ns) as f64 - expected;
            let goes_on = next_ns
                .is_none_or(|next_ns| (1..=2 * self.longest_ns).contains(&next_ns.saturating_sub(after_ns)));
            if off.abs() > 0.6 * self.interval_ns || !goes_on {
                continue;
            }
            let in_order = (0..wrong).filter_map(|k| self.stamp(k)).chain([after_ns]).collect::<Vec<_>>();
            if in_order[0] > last_ns && in_order.windows(2).all(|pair| pair[0] < pair[1]) {
                return false;
            }
            let step = after_ns.saturating_sub(last_ns) as f64 / (wrong + 1) as f64;
            for k in 0..wrong {
                let t_ns = last_ns.saturating_add((step * (k + 1) as f64).round() as i64);
                self.waiting[k].t_ns = t_ns.saturating_sub(self.offset_ns);
            }
            found.gather(wrong as u64, last_ns, |rows| LogCause::TimesReplaced { replaced: rows as f64 });
            return true;
        }
        false
    }

    /// Whether the rows that wait follow each other as rows do.
    fn goes_on(&self) -> bool {
        let ahead = self.waiting.len().min(AHEAD);
        let regular = self
            .waiting
            .iter()
            .zip(self.waiting.iter().skip(1))
            .take(ahead)
            .filter(|(a, b)| (1..=4 * self.longest_ns).contains(&b.t_ns.saturating_sub(a.t_ns)))
            .count();
        ahead >= 2 && regular * 10 >= (ahead - 1) * 7
    }

    /// Learns another rate from the rows that wait.
    fn learn(&mut self) {
        let mut intervals: Vec<f64> = self
            .waiting
            .iter()
            .zip(self.waiting.iter().skip(1))
            .take(AHEAD)
            .map(|(a, b)| b.t_ns.saturating_sub(a.t_ns) as f64)
            .filter(|interval| *interval > 0.0)
            .collect();
        if intervals.len() >= 8
            && let Some(interval_ns) = median(&mut intervals)
        {
            self.set_interval(interval_ns);
        }
    }

    /// Whether the first row that waits goes on from the row before as if no time had passed: in the middle of a swing,
    /// or at rest to the noise.
    fn is_continuous(&self, before: &ImuSample) -> bool {
        let Some(first) = self.waiting.front() else { return false };
        let rows = || self.waiting.iter().zip(self.waiting.iter().skip(1)).take(AHEAD);
        let turns = |row: &ImuSample| length(row.w_ib_b_rad_s);
        let step = distance(before.w_ib_b_rad_s, first.w_ib_b_rad_s);
        let push = distance(before.f_b_m_s2, first.f_b_m_s2);
        if turns(before) > 1.0 && turns(first) > 1.0 {
            let near = |of: fn(&ImuSample) -> [f64; 3]| {
                rows().take(4).map(|(a, b)| distance(of(a), of(b))).fold(0.0, f64::max)
            };
            return step <= 2.0 * near(|row| row.w_ib_b_rad_s)
                && push <= 2.0 * near(|row| row.f_b_m_s2)
                && step < 0.3 * turns(before);
        }
        let still = |row: &ImuSample| turns(row) < 0.15;
        let field = match (before.mag_b_ut, first.mag_b_ut) {
            (Some(a), Some(b)) => distance(a, b) < 2.0,
            _ => true,
        };
        still(before) && self.waiting.iter().take(AHEAD).all(still) && push < 0.2 && field
    }
}

/// A row in which nothing was measured.
fn is_empty(row: &ImuSample) -> bool {
    let nothing = |values: &[f64; 3]| values.iter().all(|value| *value == 0.0 || value.is_nan());
    nothing(&row.w_ib_b_rad_s) && nothing(&row.f_b_m_s2)
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    length([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
}
