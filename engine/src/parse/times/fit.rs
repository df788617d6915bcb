//! What the stamps of the first rows are, and the straight line through those that are not regular.

use super::other_unit;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::sample::ImuSample;

/// Fewer rows are no ground for a verdict.
const FEWEST_ROWS: usize = 64;
/// A quarter of the rows with the stamp of the row before: the stamps are coarse.
const COARSE_SHARE: f64 = 0.25;
/// An interval below this share of the mean one is no interval of a sensor …
const SHORT: f64 = 0.35;
/// … and so large a share of them no accident.
const SHORT_SHARE: f64 = 0.12;
/// Intervals that scatter so much, for their mean, are not those of a sensor, where the count of rows keeps up with time.
const SCATTER: f64 = 0.2;
/// That far, in intervals, rows may then be off the line.
const BOUNDED_INTERVALS: f64 = 1.2;
/// Nothing keeps a row back for longer, ns.
const LONGEST_DELAY_NS: f64 = 1e9;
/// Changes of a coarse stamp by which the rate is known, while more rows may come.
const ENOUGH_CHANGES: usize = 9;
/// … and at the end of the log.
const FEWEST_CHANGES: usize = 3;
/// A sensor on a body has more rows a second than this.
const SLOWEST_HZ: f64 = 2.0;
/// … and fewer than this.
const FASTEST_HZ: f64 = 20_000.0;
/// From a row to the next of a usual sensor, s.
const USUAL_S: f64 = 0.01;
/// No sensor on a body has rows nearer to each other, on the mean, s.
const SHORTEST_S: f64 = 2.5e-4;

/// What stamps are.
#[derive(Debug)]
pub(super) enum Verdict {
    /// More rows are needed.
    Wait,
    /// As they should be.
    Regular { interval_ns: f64 },
    /// Rows have to be spread evenly.
    Even(Fit),
}

/// How rows are spread evenly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Time of the first row, ns after its stamp.
    pub(super) first_ns: f64,
    /// From a row to the next, ns.
    pub(super) interval_ns: f64,
    /// How far stamps are apart that say the same, ns.
    pub(super) spread_ns: f64,
    /// Rows that share a stamp; 1 where stamps are those of arrival.
    pub(super) rows_per_stamp: f64,
    /// The stamps say nothing.
    pub(super) by_rate: bool,
}

/// The stamps of some rows, ns after the first.
pub(super) struct Stamps {
    all: Vec<f64>,
    /// Rows with the stamp and the values of the row before.
    twice: usize,
}

impl Stamps {
    pub(super) fn of(rows: &[ImuSample]) -> Stamps {
        let first_ns = rows.first().map_or(0, |row| row.t_ns);
        let same = |pair: &&[ImuSample]| {
            pair[0].t_ns == pair[1].t_ns
                && pair[0].w_ib_b_rad_s == pair[1].w_ib_b_rad_s
                && pair[0].f_b_m_s2 == pair[1].f_b_m_s2
        };
        Stamps {
            all: rows.iter().map(|row| row.t_ns.saturating_sub(first_ns) as f64).collect(),
            twice: rows.windows(2).filter(same).count(),
        }
    }

    fn intervals(&self) -> impl Iterator<Item = f64> {
        self.all.windows(2).map(|pair| pair[1] - pair[0])
    }
}

/// Judges stamps; `last` when no more rows are waited for.
pub(super) fn judge(stamps: &Stamps, rate_hz: Option<f64>, last: bool) -> Result<Verdict, ParseError> {
    let rows = stamps.all.len();
    let regular = |interval_ns: f64| Ok(Verdict::Regular { interval_ns });
    let mut positive: Vec<f64> = stamps.intervals().filter(|interval| *interval > 0.0).collect();
    let usual_ns = median(&mut positive);
    if rows < FEWEST_ROWS {
        return regular(usual_ns.unwrap_or(1e7));
    }
    let same = stamps.intervals().filter(|interval| *interval == 0.0).count();
    if (same - stamps.twice) as f64 >= COARSE_SHARE * rows as f64 {
        return coarse(stamps, rate_hz, last);
    }
    let Some(usual_ns) = usual_ns else { return coarse(stamps, rate_hz, last) };
    check_unit(usual_ns)?;
    let every: Vec<(f64, f64)> = (0..rows).map(|k| (k as f64, stamps.all[k])).collect();
    let Some(line) = Line::through(&every) else { return regular(usual_ns) };
    check_not_too_fast(line.slope)?;
    let short = stamps.intervals().filter(|interval| *interval < SHORT * line.slope).count() - stamps.twice;
    let scatter = deviation(stamps.intervals().filter(|i| (0.0..4.0 * line.slope).contains(i)), line.slope);
    let arrival = short as f64 >= SHORT_SHARE * rows as f64 && line.spread <= LONGEST_DELAY_NS;
    let jitter = scatter > SCATTER * line.slope && line.spread <= BOUNDED_INTERVALS * line.slope;
    if !(arrival || jitter) {
        return regular(usual_ns);
    }
    Ok(Verdict::Even(Fit {
        first_ns: line.at_zero,
        interval_ns: line.slope,
        spread_ns: line.spread,
        rows_per_stamp: 1.0,
        by_rate: false,
    }))
}

/// Many rows share one stamp: what is known is where it changes.
fn coarse(stamps: &Stamps, rate_hz: Option<f64>, last: bool) -> Result<Verdict, ParseError> {
    let all = &stamps.all;
    let changes: Vec<(f64, f64)> =
        (1..all.len()).filter(|k| all[*k] > all[*k - 1]).map(|k| (k as f64, all[k])).collect();
    if changes.len() < ENOUGH_CHANGES && !last {
        return Ok(Verdict::Wait);
    }
    let by_rate = |rate_hz: f64, by_rate: bool, step_ns: f64| {
        let interval_ns = 1e9 / rate_hz;
        Ok(Verdict::Even(Fit {
            first_ns: 0.0,
            interval_ns,
            spread_ns: step_ns,
            rows_per_stamp: step_ns / interval_ns,
            by_rate,
        }))
    };
    let Some(line) = Line::through(&changes).filter(|_| changes.len() >= FEWEST_CHANGES) else {
        return match rate_hz {
            Some(rate_hz) => by_rate(rate_hz, true, 0.0),
            None => Err(lost_digits(all.len(), changes.len() + 1)),
        };
    };
    let rate_of_log_hz = 1e9 / line.slope;
    if !(SLOWEST_HZ..FASTEST_HZ).contains(&rate_of_log_hz) {
        return match rate_hz {
            Some(rate_hz) => by_rate(rate_hz, true, 0.0),
            None => Err(lost_digits(all.len(), changes.len() + 1)),
        };
    }
    let mut steps: Vec<f64> = changes.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
    let step_ns = median(&mut steps).unwrap_or(line.slope);
    Ok(Verdict::Even(Fit {
        // Where the stamp changes, up to an interval has passed since.
        first_ns: line.at_zero + 0.5 * line.slope,
        interval_ns: line.slope,
        spread_ns: step_ns.max(line.spread),
        rows_per_stamp: step_ns / line.slope,
        by_rate: false,
    }))
}

fn check_unit(interval_ns: f64) -> Result<(), ParseError> {
    let interval_s = interval_ns / 1e9;
    if interval_s < 1.0 / SLOWEST_HZ {
        return Ok(());
    }
    if interval_s == 1.0 {
        let advice = "give the rate, in Hz, and choose the number of the sample as the unit of the time, or divide it by the rate";
        return Err(other_unit(interval_s, "numbers of rows", advice.to_owned()));
    }
    /// The unit, in how many of which a second is; what to choose; and how unusual that is.
    const UNITS: [(&str, f64, &str, f64); 6] = [
        ("milliseconds", 1e3, "ms as their unit", 0.0),
        ("microseconds", 1e6, "µs as their unit", 0.0),
        ("nanoseconds", 1e9, "ns as their unit", 0.0),
        ("tenths of a millisecond", 1e4, "ticks10_khz as their unit", 1.0),
        ("ticks of a clock of 32768 Hz", 32_768.0, "ticks as their unit, with rate_hz 32768", 1.0),
        ("ticks of 100 ns", 1e7, "ticks as their unit, with rate_hz 10000000", 1.0),
    ];
    let unlikely = |(_, per_s, _, unusual): &(&str, f64, &str, f64)| off_usual(interval_s / per_s) + unusual;
    let likely = UNITS.iter().min_by(|a, b| unlikely(a).total_cmp(&unlikely(b)));
    let (looks_like, per_s, choice, _) = likely.unwrap_or(&UNITS[0]);
    Err(other_unit(interval_s, looks_like, format!("divide the times by {per_s}, or choose {choice}")))
}

/// How far an interval is from that of a usual sensor, as a logarithm.
fn off_usual(interval_s: f64) -> f64 {
    libm::fabs(libm::log(interval_s / USUAL_S))
}

/// Times of which thousands of rows share a millisecond are in a larger unit than was said.
fn check_not_too_fast(interval_ns: f64) -> Result<(), ParseError> {
    let interval_s = interval_ns / 1e9;
    if interval_s > SHORTEST_S || interval_s <= 0.0 {
        return Ok(());
    }
    const UNITS: [(&str, f64); 5] = [
        ("minutes", 60.0),
        ("hours", 3_600.0),
        ("days, as a spreadsheet keeps dates", 86_400.0),
        ("a unit a thousand times as long", 1e3),
        ("a unit a million times as long", 1e6),
    ];
    let likely =
        UNITS.iter().min_by(|a, b| off_usual(interval_s * a.1).total_cmp(&off_usual(interval_s * b.1)));
    let (looks_like, times) = likely.unwrap_or(&UNITS[0]);
    Err(other_unit(
        interval_s,
        looks_like,
        format!("multiply the times by {times}, or choose their unit (days, for dates of a spreadsheet)"),
    ))
}

fn lost_digits(rows: usize, stamps: usize) -> ParseError {
    ParseError::new(
        ParseErrorKind::BadTime,
        "a time of its own for every row",
        format!("{stamps} different times in {rows} rows: the times have lost their digits"),
        "export them in full, or give the rate that the sensor was set to, in Hz",
    )
    .in_column("t_s")
}

/// A straight line through stamps over row numbers.
struct Line {
    at_zero: f64,
    slope: f64,
    /// Nine tenths of the stamps are within this, ns.
    spread: f64,
}

impl Line {
    /// By least squares, of the points up to the first step or gap.
    fn through(points: &[(f64, f64)]) -> Option<Line> {
        let lag = (points.len() / 4).max(1);
        let slope_of = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
        let mut slopes: Vec<f64> =
            (lag..points.len()).map(|k| slope_of(points[k - lag], points[k])).collect();
        let slope = median(&mut slopes).filter(|slope| *slope > 0.0)?;
        let mut off: Vec<f64> = points.iter().map(|(x, y)| y - slope * x).collect();
        let spread = {
            let mut near: Vec<f64> = off[..lag.max(2).min(off.len())].to_vec();
            spread_of(&mut near).max(2.0 * slope)
        };
        // A step is where the stamps leave the line and do not come back.
        let middle = median(&mut off[..lag.max(2).min(points.len())].to_vec())?;
        let away = |k: &f64| (k - middle).abs() > 4.0 * spread + 0.02 * slope * points.len() as f64;
        let until = match off.iter().position(away) {
            Some(at)
                if at >= FEWEST_ROWS && off[at..].iter().filter(|k| away(k)).count() * 2 > off.len() - at =>
            {
                at
            }
            _ => points.len(),
        };
        let points = &points[..until];
        let count = points.len() as f64;
        let mean_x = points.iter().map(|point| point.0).sum::<f64>() / count;
        let mean_y = points.iter().map(|point| point.1 - slope * point.0).sum::<f64>() / count;
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y) in points {
            xx += (x - mean_x) * (x - mean_x);
            xy += (x - mean_x) * (y - slope * x - mean_y);
        }
        let slope = if xx > 0.0 { slope + xy / xx } else { slope };
        let at_zero = mean_y - (xy / xx.max(1e-300)) * mean_x;
        off = points.iter().map(|(x, y)| y - slope * x).collect();
        Some(Line { at_zero, slope, spread: spread_of(&mut off) })
    }
}

fn spread_of(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values.get((share * (values.len().saturating_sub(1)) as f64) as usize).copied();
    at(0.95).zip(at(0.05)).map_or(0.0, |(high, low)| high - low)
}

fn deviation(values: impl Iterator<Item = f64>, mean: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for value in values {
        sum += (value - mean) * (value - mean);
        count += 1.0;
    }
    (sum / count.max(1.0)).sqrt()
}

/// The value in the middle.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
