//! What was done to read a log that is not as it should be: each kind with its figures, so that nothing is put right in
//! silence.

use crate::anomaly::{Anomaly, AnomalyKind, Cause};
use crate::figures::{Figures, figures};
use crate::word::Word;

/// The times of a log are not those at which its rows were taken, and were put right.
pub const TIMES_PUT_RIGHT: AnomalyKind = AnomalyKind(Word::declared("times_put_right", 15));
/// The clock of a log was set on the way.
pub const CLOCK_SET: AnomalyKind = AnomalyKind(Word::declared("clock_set", 16));
/// Lines of a log could not be read.
pub const LINES_LEFT_OUT: AnomalyKind = AnomalyKind(Word::declared("lines_left_out", 17));
/// The clocks of two logs of one walk differ.
pub const CLOCKS_APART: AnomalyKind = AnomalyKind(Word::declared("clocks_apart", 18));

/// The kinds that come from reading a log, and not from computing its session.
pub const KINDS: [AnomalyKind; 4] = [TIMES_PUT_RIGHT, CLOCK_SET, LINES_LEFT_OUT, CLOCKS_APART];

/// What was done with a log, by how much.
#[derive(Clone, Debug, PartialEq)]
pub enum LogCause {
    /// Rows carry the times at which they arrived, or times with a jitter.
    ArrivalTimes {
        /// Between the earliest and the latest of all but a tenth of the rows, s.
        spread_s: f64,
        /// Rows a second, by the log itself, Hz.
        rate_hz: f64,
    },
    /// Many rows share one time.
    CoarseTimes {
        /// How many share one.
        rows_per_time: f64,
        /// From one time to the next, s.
        step_s: f64,
        /// Rows a second, by the log itself, Hz.
        rate_hz: f64,
    },
    /// The times say nothing: the rows were counted, at the rate that was given.
    TimesByRate {
        /// Rows a second, as given, Hz.
        given_rate_hz: f64,
    },
    /// Single times contradict those around them.
    TimesReplaced {
        /// How many.
        replaced: f64,
    },
    /// Rows stand in the file in another order than they were taken in.
    RowsReordered {
        /// How many came late.
        reordered: f64,
    },
    /// The clock was set; the rows go on.
    ClockSet {
        /// By how much it went forward; less than zero: back, s.
        forward_by_s: f64,
    },
    /// Lines that are no row.
    LinesLeftOut {
        /// How many.
        lines: f64,
        /// The first of them.
        first_line: f64,
        /// Why, for the first ones, as sentences.
        reasons: Vec<String>,
    },
    /// Readings beside rate and force that are none.
    ValuesLeftOut {
        /// How many.
        values: f64,
        /// The line of the first of them.
        first_line: f64,
        /// Why, for the first ones, as sentences.
        reasons: Vec<String>,
    },
    /// The file holds several recordings, each below its names.
    Recordings {
        /// How many.
        recordings: f64,
    },
    /// The clock began again at its end, as a counter of some bits does.
    ClockWraps {
        /// How often.
        wraps: f64,
        /// After how long, s.
        after_s: f64,
    },
    /// Bytes of zero or other filling between or behind the rows.
    Filling {
        /// How many.
        filling_bytes: f64,
    },
    /// Rows in which all values are zero or missing.
    EmptyRows {
        /// How many.
        empty_rows: f64,
    },
    /// The packed file ends before its end or goes on behind it.
    Packing {
        /// What is wrong with it.
        packing: &'static str,
    },
    /// Something else, in the words of who read it.
    Noted {
        /// What, as a sentence.
        note: String,
    },
    /// The clock of this log is another than that of the first log of the walk.
    ClocksApart {
        /// By how much it is ahead, s.
        ahead_by_s: f64,
        /// How sure that is, s.
        sigma_s: f64,
    },
}

impl Cause for LogCause {
    fn kind(&self) -> AnomalyKind {
        match self {
            LogCause::ArrivalTimes { .. }
            | LogCause::CoarseTimes { .. }
            | LogCause::TimesByRate { .. }
            | LogCause::TimesReplaced { .. }
            | LogCause::RowsReordered { .. } => TIMES_PUT_RIGHT,
            LogCause::ClockSet { .. } | LogCause::ClockWraps { .. } => CLOCK_SET,
            LogCause::LinesLeftOut { .. }
            | LogCause::ValuesLeftOut { .. }
            | LogCause::Recordings { .. }
            | LogCause::Filling { .. }
            | LogCause::EmptyRows { .. }
            | LogCause::Packing { .. }
            | LogCause::Noted { .. } => LINES_LEFT_OUT,
            LogCause::ClocksApart { .. } => CLOCKS_APART,
        }
    }

    fn sentence(&self) -> String {
        match self {
            LogCause::ArrivalTimes { spread_s, rate_hz } => format!(
                "the times are those at which the rows arrived, within {spread_s:.3} s, not those at which they were taken: the rows were spread evenly again, {rate_hz:.2} a second"
            ),
            LogCause::CoarseTimes { rows_per_time, step_s, rate_hz } => format!(
                "the times were cut to steps of {step_s:.3} s, {rows_per_time:.1} rows share one: the rows were spread evenly again, {rate_hz:.2} a second"
            ),
            LogCause::TimesByRate { given_rate_hz } => format!(
                "the times have lost their digits: the rows were counted, {given_rate_hz} a second as given; missing rows do not show"
            ),
            LogCause::TimesReplaced { replaced } => format!(
                "the times of {replaced} rows contradict those around them, and were replaced by times between these"
            ),
            LogCause::RowsReordered { reordered } => {
                format!("{reordered} rows came late, and were put back into the order of their times")
            }
            LogCause::ClockSet { forward_by_s } if *forward_by_s < 0.0 => format!(
                "the clock was set back by {:.3} s, or another recording begins: the rows go on without a gap",
                -forward_by_s
            ),
            LogCause::ClockSet { forward_by_s } => {
                format!("the clock was set forward by {forward_by_s:.3} s: the rows go on without a gap")
            }
            LogCause::LinesLeftOut { lines, first_line, reasons } => format!(
                "lines that could not be read and were left out: {lines}, the first is line {first_line}: {}",
                reasons.join("; ")
            ),
            LogCause::ValuesLeftOut { values, first_line, reasons } => format!(
                "readings of field or pressure that are none and were left out: {values}, the first in line {first_line}: {}",
                reasons.join("; ")
            ),
            LogCause::Recordings { recordings } => {
                format!(
                    "the names of the columns stand in the file again: {recordings} recordings were read one after the other"
                )
            }
            LogCause::ClockWraps { wraps, after_s } => format!(
                "the clock began again {wraps} times, after {after_s:.3} s each: the rows go on without a gap"
            ),
            LogCause::Filling { filling_bytes } => {
                format!("{filling_bytes} bytes of filling, such as zeros, were left out")
            }
            LogCause::EmptyRows { empty_rows } => {
                format!("{empty_rows} rows without any value were left out")
            }
            LogCause::Packing { packing } => format!("the packed file {packing}: what is in it was read"),
            LogCause::Noted { note } => note.clone(),
            LogCause::ClocksApart { ahead_by_s, sigma_s } => format!(
                "the clock of this log is ahead of the other log's by {ahead_by_s:.2} s (sigma {sigma_s:.2} s), as the steps of both show: it was set to the other"
            ),
        }
    }

    fn figures(&self) -> Figures {
        match self {
            LogCause::ArrivalTimes { spread_s, rate_hz } => {
                figures([("spread_s", (*spread_s).into()), ("rate_hz", (*rate_hz).into())])
            }
            LogCause::CoarseTimes { rows_per_time, step_s, rate_hz } => figures([
                ("rows_per_time", (*rows_per_time).into()),
                ("step_s", (*step_s).into()),
                ("rate_hz", (*rate_hz).into()),
            ]),
            LogCause::TimesByRate { given_rate_hz } => figures([("given_rate_hz", (*given_rate_hz).into())]),
            LogCause::TimesReplaced { replaced } => figures([("replaced", (*replaced).into())]),
            LogCause::RowsReordered { reordered } => figures([("reordered", (*reordered).into())]),
            LogCause::ClockSet { forward_by_s } => figures([("forward_by_s", (*forward_by_s).into())]),
            LogCause::LinesLeftOut { lines, first_line, reasons } => figures([
                ("lines", (*lines).into()),
                ("first_line", (*first_line).into()),
                ("reasons", reasons.join("; ").as_str().into()),
            ]),
            LogCause::ValuesLeftOut { values, first_line, reasons } => figures([
                ("values", (*values).into()),
                ("first_line", (*first_line).into()),
                ("reasons", reasons.join("; ").as_str().into()),
            ]),
            LogCause::Recordings { recordings } => figures([("recordings", (*recordings).into())]),
            LogCause::ClockWraps { wraps, after_s } => {
                figures([("wraps", (*wraps).into()), ("after_s", (*after_s).into())])
            }
            LogCause::Filling { filling_bytes } => figures([("filling_bytes", (*filling_bytes).into())]),
            LogCause::EmptyRows { empty_rows } => figures([("empty_rows", (*empty_rows).into())]),
            LogCause::Packing { packing } => figures([("packing", (*packing).into())]),
            LogCause::Noted { note } => figures([("note", note.as_str().into())]),
            LogCause::ClocksApart { ahead_by_s, sigma_s } => {
                figures([("ahead_by_s", (*ahead_by_s).into()), ("sigma_s", (*sigma_s).into())])
            }
        }
    }
}

impl LogCause {
    /// An example of every one, for the test of the message files.
    pub fn examples() -> Vec<LogCause> {
        vec![
            LogCause::ArrivalTimes { spread_s: 0.04, rate_hz: 100.0 },
            LogCause::CoarseTimes { rows_per_time: 100.0, step_s: 1.0, rate_hz: 100.0 },
            LogCause::TimesByRate { given_rate_hz: 100.0 },
            LogCause::TimesReplaced { replaced: 1.0 },
            LogCause::RowsReordered { reordered: 1.0 },
            LogCause::ClockSet { forward_by_s: -3600.0 },
            LogCause::LinesLeftOut {
                lines: 1.0,
                first_line: 7.0,
                reasons: vec!["line 7 was cut".to_owned()],
            },
            LogCause::ValuesLeftOut {
                values: 2.0,
                first_line: 7.0,
                reasons: vec!["line 7: no number".to_owned()],
            },
            LogCause::Recordings { recordings: 2.0 },
            LogCause::ClockWraps { wraps: 3.0, after_s: 65.536 },
            LogCause::Filling { filling_bytes: 60_000.0 },
            LogCause::EmptyRows { empty_rows: 3.0 },
            LogCause::Packing { packing: "ends in the middle" },
            LogCause::Noted { note: "the last epoch is cut off and was left out".to_owned() },
            LogCause::ClocksApart { ahead_by_s: 3598.0, sigma_s: 0.1 },
        ]
    }

    /// The anomaly of a log whose stream is not known yet.
    pub(super) fn at(&self, t_ns: [i64; 2], rows: u64) -> Anomaly {
        self.anomaly(None, t_ns, rows)
    }
}
