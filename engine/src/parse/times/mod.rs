//! The times of a log put right: stamps are evidence of when a row was taken, not the truth.
//!
//! The first rows are held until it is known what the stamps are. Where they are regular, rows pass as they are, and only
//! what contradicts its surroundings is looked at ([`regular`]): a clock that was set, a single wrong stamp, rows in
//! another order. Where they are those of arrival, or many rows share one, rows are spread evenly at the rate of the log
//! itself ([`even`]). Where they say nothing, the rate has to be given.

mod even;
mod fit;
mod regular;
#[cfg(test)]
mod tests;

use self::even::Even;
use self::fit::{Stamps, Verdict};
use self::regular::Regular;
use crate::anomaly::Anomaly;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::remark::LogCause;
use crate::sample::ImuSample;

/// Rows by which stamps are judged.
const JUDGED_BY: usize = 512;
/// No more rows are held while stamps are so coarse that the rate does not show.
const MOST_HELD: usize = 30_000;

/// Puts the times of one log right.
#[derive(Debug)]
pub struct Times {
    rate_hz: Option<f64>,
    state: State,
    found: Found,
}

#[derive(Debug)]
enum State {
    Undecided { held: Vec<ImuSample>, look_at: usize },
    Regular(Box<Regular>),
    Even(Box<Even>),
}

/// What was found and done, gathered by kind.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    told: Vec<Anomaly>,
    gathered: Vec<(LogCause, [i64; 2], u64)>,
    /// Steps of the clock back: a counter goes back by the same again and again.
    backs: Vec<Back>,
}

/// Steps of the clock back by the same.
#[derive(Clone, Copy, Debug)]
struct Back {
    by_s: f64,
    /// Of the first and the last of them, ns.
    t_ns: [i64; 2],
    steps: u64,
}

/// Two steps back that differ by less, as a share, are those of one counter.
const SAME_STEP: f64 = 0.02;

/// Steps of a clock that are told one by one.
const MOST_TOLD: usize = 20;

impl Found {
    /// Something that is told once for each time it happens, as far as that bears telling.
    fn tell(&mut self, cause: &LogCause, t_ns: i64) {
        if let LogCause::ClockSet { forward_by_s } = cause
            && *forward_by_s < 0.0
        {
            let by_s = -forward_by_s;
            let room = self.backs.len() < MOST_TOLD;
            match self.backs.iter_mut().find(|back| (back.by_s / by_s - 1.0).abs() < SAME_STEP) {
                Some(back) => {
                    back.t_ns[1] = t_ns;
                    back.steps += 1;
                }
                None if room => {
                    self.backs.push(Back { by_s, t_ns: [t_ns; 2], steps: 1 });
                }
                None => {}
            }
            return;
        }
        if self.told.len() < MOST_TOLD {
            self.told.push(cause.at([t_ns; 2], 1));
        }
    }

    /// Something that is told once for all the rows that it concerns; `count` is given how many these are.
    fn gather(&mut self, rows: u64, t_ns: i64, count: impl Fn(u64) -> LogCause) {
        let name = std::mem::discriminant(&count(0));
        match self.gathered.iter_mut().find(|(cause, ..)| std::mem::discriminant(cause) == name) {
            Some((cause, [_, end_ns], all)) => {
                *all += rows;
                *end_ns = t_ns.max(*end_ns);
                *cause = count(*all);
            }
            None => self.gathered.push((count(rows), [t_ns; 2], rows)),
        }
    }

    fn anomalies(&self) -> Vec<Anomaly> {
        let gathered = self.gathered.iter().map(|(cause, t_ns, rows)| cause.at(*t_ns, *rows));
        let mut anomalies: Vec<Anomaly> = self.told.clone();
        anomalies.extend(self.backs.iter().map(|Back { by_s, t_ns, steps }| match steps {
            1 => LogCause::ClockSet { forward_by_s: -by_s }.at(*t_ns, 1),
            _ => LogCause::ClockWraps { wraps: *steps as f64, after_s: *by_s }.at(*t_ns, *steps),
        }));
        anomalies.extend(gathered);
        anomalies
    }
}

impl Times {
    /// For a log of which nobody said how many rows a second it has, or somebody did.
    pub fn new(rate_hz: Option<f64>) -> Times {
        Times {
            rate_hz,
            state: State::Undecided { held: Vec::new(), look_at: JUDGED_BY },
            found: Found::default(),
        }
    }

    /// Takes the rows from number `from` on, and leaves in their place those whose times are known.
    ///
    /// # Errors
    ///
    /// When the times are in another unit, or say nothing and no rate was given.
    pub fn take(&mut self, rows: &mut Vec<ImuSample>, from: usize) -> Result<(), ParseError> {
        let mut new = match &self.state {
            State::Undecided { .. } => rows.split_off(from),
            _ => Vec::new(),
        };
        let undecided = matches!(self.state, State::Undecided { .. });
        while let State::Undecided { held, look_at } = &mut self.state {
            // As many as are judged, however they come.
            let missing = (*look_at - held.len()).min(new.len());
            held.extend(new.drain(..missing));
            if held.len() < *look_at {
                return Ok(());
            }
            self.decide(false, rows)?;
        }
        let from = if undecided { rows.len() } else { from };
        rows.append(&mut new);
        match &mut self.state {
            State::Regular(regular) => regular.take(rows, from, &mut self.found),
            State::Even(even) => even.take(rows, from, &mut self.found),
            State::Undecided { .. } => {}
        }
        Ok(())
    }

    /// The log is over: appends the rows that are left.
    ///
    /// # Errors
    ///
    /// As [`Self::take`].
    pub fn finish(&mut self, rows: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        if matches!(self.state, State::Undecided { .. }) {
            self.decide(true, rows)?;
        }
        match &mut self.state {
            State::Regular(regular) => regular.finish(rows, &mut self.found),
            State::Even(even) => even.finish(rows, &mut self.found),
            State::Undecided { .. } => {}
        }
        Ok(())
    }

    /// What was found and done so far, by times of the log's clock.
    pub fn anomalies(&self) -> Vec<Anomaly> {
        let mut anomalies = match &self.state {
            State::Even(even) => even.anomaly().into_iter().collect(),
            _ => Vec::new(),
        };
        anomalies.extend(self.found.anomalies());
        anomalies
    }

    fn decide(&mut self, end: bool, rows: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let State::Undecided { held, look_at } = &mut self.state else { return Ok(()) };
        let last = end || held.len() >= MOST_HELD;
        let verdict = fit::judge(&Stamps::of(held), self.rate_hz, last)?;
        self.state = match verdict {
            Verdict::Wait => {
                *look_at = 2 * held.len();
                return Ok(());
            }
            Verdict::Regular { interval_ns } => State::Regular(Box::new(Regular::new(interval_ns, held))),
            Verdict::Even(fit) => State::Even(Box::new(Even::new(fit, held))),
        };
        // The rows that were held come first.
        match &mut self.state {
            State::Regular(regular) => regular.take_held(rows, &mut self.found),
            State::Even(even) => even.take_held(rows, &mut self.found),
            State::Undecided { .. } => {}
        }
        Ok(())
    }
}

/// The error for stamps that are in another unit than seconds, or what was said.
fn other_unit(interval_s: f64, looks_like: &str, advice: String) -> ParseError {
    ParseError::new(
        ParseErrorKind::BadTime,
        "times in seconds, or in the unit that was chosen, with at least two rows a second",
        format!("a row every {interval_s} s: these look like {looks_like}"),
        advice,
    )
    .in_column("t_s")
}
