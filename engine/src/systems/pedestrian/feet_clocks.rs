//! How far the clocks of two feet are apart, by their steps: while one foot swings the other stands, and they take turns.

use super::side::Side;
use crate::sample::ImuSample;
use crate::stream::{Reading, StreamId};
use crate::system::{ClockAhead, LogClocks};

/// A foot that turns faster swings, rad/s …
const SWINGS_RAD_S: f64 = 1.5;
/// … until it has turned slower than this, rad/s …
const STANDS_RAD_S: f64 = 0.8;
/// … for so long, ns.
const STANDS_NS: i64 = 100_000_000;
/// Swings by which clocks are compared.
const MOST_SWINGS: usize = 400;
/// Fewer say nothing.
const FEWEST_SWINGS: usize = 6;
/// Zones are apart by multiples of this, s.
const ZONE_S: f64 = 900.0;
/// The farthest zones, in multiples.
const MOST_ZONES: i32 = 104;
/// Clocks that were set by hand are off by no more, s.
const BY_HAND_S: f64 = 30.0;
/// Offsets are tried in steps of this, s.
const STEP_S: f64 = 0.04;
/// Swings of one foot that are nearer than this belong to one walk, s.
const ONE_WALK_S: f64 = 2.5;
/// What a turn out of turn costs, in seconds in which both feet swing.
const OUT_OF_TURN_S: f64 = 0.5;
/// What a whole step at the start or the end of a walk costs, where the other foot's is half of it, s: one starts and
/// ends with half a step.
const NO_HALF_STEP_S: f64 = 1.0;
/// Places that cost no more than this more are as likely, s.
const DOUBT_S: f64 = 0.5;
/// Rows farther apart than this, s, say nothing of the turn between them.
const LONGEST_ROW_S: f64 = 0.1;
/// Clocks that cost less than this for each swing are one, s.
const AGREES_S: f64 = 0.15;

/// When a foot swings, by the clock of its log.
#[derive(Clone, Debug, Default)]
pub struct Swings {
    ends_ns: Option<[i64; 2]>,
    since_ns: Option<i64>,
    fast_ns: i64,
    /// How far it has turned in this swing, rad.
    turned_rad: f64,
    swings: Vec<Swing>,
}

/// One swing.
#[derive(Clone, Copy, Debug)]
struct Swing {
    ends_ns: [i64; 2],
    turned_rad: f64,
}

impl Swings {
    /// Whether more would not say more.
    pub fn are_enough(&self) -> bool {
        self.swings.len() >= MOST_SWINGS
    }

    /// Takes the next row.
    pub fn take(&mut self, row: &ImuSample) {
        let t_ns = row.t_ns;
        let last_ns = self.ends_ns.map_or(t_ns, |ends| ends[1]);
        let since_last_s = (t_ns.saturating_sub(last_ns) as f64 / 1e9).clamp(0.0, LONGEST_ROW_S);
        self.ends_ns = Some([self.ends_ns.map_or(t_ns, |ends| ends[0]), t_ns]);
        let [x, y, z] = row.w_ib_b_rad_s;
        let turn = (x * x + y * y + z * z).sqrt();
        if turn > SWINGS_RAD_S && self.since_ns.is_none() && self.swings.len() < MOST_SWINGS {
            self.since_ns = Some(t_ns);
            self.turned_rad = 0.0;
        }
        if turn.is_finite() {
            self.turned_rad += turn * since_last_s;
        }
        if turn > STANDS_RAD_S {
            self.fast_ns = t_ns;
        } else if let Some(since_ns) = self.since_ns
            && t_ns.saturating_sub(self.fast_ns) > STANDS_NS
        {
            let ends_ns = [since_ns, self.fast_ns];
            self.swings.push(Swing { ends_ns, turned_rad: self.turned_rad });
            self.since_ns = None;
        }
    }
}

/// How far the clock of one foot's log is ahead of the other's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeetClocks {
    /// Both are one clock, or nothing shows that they are not.
    Together,
    /// The second is ahead of the first.
    Apart {
        /// By how much, s.
        ahead_by_s: f64,
        /// How sure that is, s.
        sigma_s: f64,
    },
    /// They do not fit together as they are, and how they would does not show.
    Unknown,
}

impl FeetClocks {
    /// Compares the swings of two feet.
    pub fn between(first: &Swings, second: &Swings) -> FeetClocks {
        let (Some(a), Some(b)) = (first.ends_ns, second.ends_ns) else { return FeetClocks::Together };
        let pair = Pair::new(first, second);
        let common_ns = a[1].min(b[1]).saturating_sub(a[0].max(b[0]));
        let shorter_ns = a[1].saturating_sub(a[0]).min(b[1].saturating_sub(b[0]));
        let meet = common_ns > shorter_ns / 2;
        let swings = (pair.a.len() + pair.b.len()) as f64;
        let as_is = pair.cost(0.0);
        if pair.a.len().min(pair.b.len()) < FEWEST_SWINGS || meet && as_is <= AGREES_S * swings {
            return FeetClocks::Together;
        }
        // Feet that run, or of which one was dragged along, agree with no offset well: what they show is believed.
        let unknown = if meet { FeetClocks::Together } else { FeetClocks::Unknown };
        let start_s = (b[0].saturating_sub(a[0])) as f64 / 1e9;
        let centres = (-MOST_ZONES..=MOST_ZONES).map(|k| f64::from(k) * ZONE_S).chain([start_s]);
        let mut tried: Vec<(f64, f64)> = Vec::new();
        for centre in centres.filter(|centre| pair.overlap(*centre)) {
            let steps = (BY_HAND_S / STEP_S) as i32;
            tried.extend((-steps..=steps).map(|k| {
                let ahead_s = centre + f64::from(k) * STEP_S;
                (ahead_s, pair.cost(ahead_s))
            }));
        }
        let Some(best) = tried.iter().map(|tried| tried.1).min_by(f64::total_cmp) else { return unknown };
        let mut as_good: Vec<f64> =
            tried.iter().filter(|tried| tried.1 <= best + 0.1).map(|tried| tried.0).collect();
        let ahead_by_s = median(&mut as_good);
        let width_s = as_good.last().zip(as_good.first()).map_or(0.0, |(last, first)| last - first);
        // Another place that is nearly as good: nobody can tell them apart.
        let doubtful = tried.iter().any(|(at, cost)| (at - ahead_by_s).abs() > 0.5 && *cost < best + DOUBT_S);
        if best > AGREES_S * swings || width_s > 1.0 || doubtful || meet && 3.0 * best > as_is {
            return unknown;
        }
        FeetClocks::Apart { ahead_by_s, sigma_s: (0.5 * width_s).max(STEP_S) }
    }
}

/// Both feet's logs on their way to be compared.
#[derive(Clone, Debug, Default)]
pub(super) struct FeetLogClocks {
    swings: [Swings; 2],
    rows: [u64; 2],
}

/// Swings are looked for in so many rows.
const MOST_ROWS: u64 = 1_000_000;

impl LogClocks for FeetLogClocks {
    fn take(&mut self, stream: StreamId, reading: Reading<'_>) {
        if let (Some(side), Reading::Imu(row)) = (Side::of(stream), reading) {
            self.swings[side.index()].take(row);
            self.rows[side.index()] += 1;
        }
    }

    fn has_enough(&self, stream: StreamId) -> bool {
        Side::of(stream)
            .is_none_or(|side| self.swings[side.index()].are_enough() || self.rows[side.index()] >= MOST_ROWS)
    }

    fn ahead(&self) -> Option<ClockAhead> {
        match FeetClocks::between(&self.swings[0], &self.swings[1]) {
            FeetClocks::Apart { ahead_by_s, sigma_s } => {
                Some(ClockAhead { stream: Side::Right.stream(), ahead_by_s, sigma_s })
            }
            FeetClocks::Together | FeetClocks::Unknown => None,
        }
    }
}

/// A swing on the way through both feet's: when it was, s after the first row of the first foot, and how far it turned.
#[derive(Clone, Copy, Debug)]
struct Turn {
    is_first_foot: bool,
    ends_s: [f64; 2],
    turned_rad: f64,
}

/// The swings of two feet.
struct Pair {
    a: Vec<Turn>,
    b: Vec<Turn>,
    a_ends: [f64; 2],
    b_ends: [f64; 2],
}

impl Pair {
    fn new(first: &Swings, second: &Swings) -> Pair {
        let zero_ns = first.ends_ns.map_or(0, |ends| ends[0]);
        let s = |t_ns: i64| t_ns.saturating_sub(zero_ns) as f64 / 1e9;
        let of = |swings: &Swings, is_first_foot: bool| {
            let turn = |swing: &Swing| Turn {
                is_first_foot,
                ends_s: swing.ends_ns.map(s),
                turned_rad: swing.turned_rad,
            };
            swings.swings.iter().map(turn).collect()
        };
        let ends = |swings: &Swings| swings.ends_ns.unwrap_or_default().map(s);
        Pair { a: of(first, true), b: of(second, false), a_ends: ends(first), b_ends: ends(second) }
    }

    /// Whether the logs have half of the shorter one in common.
    fn overlap(&self, ahead_s: f64) -> bool {
        let b = self.b_ends.map(|t| t - ahead_s);
        let common = self.a_ends[1].min(b[1]) - self.a_ends[0].max(b[0]);
        common + BY_HAND_S > 0.5 * (self.a_ends[1] - self.a_ends[0]).min(b[1] - b[0])
    }

    /// How badly the swings take turns, s.
    fn cost(&self, ahead_s: f64) -> f64 {
        let mut cost = 0.0;
        let mut before: [Option<Turn>; 2] = [None; 2];
        for turn in self.in_order(ahead_s) {
            let last = before[1].filter(|last| turn.ends_s[0] - last.ends_s[1] < ONE_WALK_S);
            if let Some(last) = last {
                if last.is_first_foot == turn.is_first_foot {
                    cost += OUT_OF_TURN_S;
                } else {
                    let both = last.ends_s[1].min(turn.ends_s[1]) - turn.ends_s[0].max(last.ends_s[0]);
                    cost += both.max(0.0);
                    if before[0].is_none() {
                        cost += NO_HALF_STEP_S * larger(last, turn);
                    }
                }
            } else {
                cost += end_of(before);
            }
            before = [last, Some(turn)];
        }
        cost + end_of(before)
    }

    /// The swings of both feet in order, where the clock of the second is ahead by so much.
    fn in_order(&self, ahead_s: f64) -> impl Iterator<Item = Turn> {
        let (mut i, mut j) = (0, 0);
        std::iter::from_fn(move || {
            let a = self.a.get(i).copied();
            let b = self.b.get(j).map(|turn| Turn { ends_s: turn.ends_s.map(|t| t - ahead_s), ..*turn });
            let middle = |turn: Turn| turn.ends_s[0] + turn.ends_s[1];
            let first = match (a, b) {
                (Some(a), Some(b)) => middle(a) <= middle(b),
                (a, _) => a.is_some(),
            };
            if first {
                i += 1;
                a
            } else {
                j += 1;
                b
            }
        })
    }
}

/// What the last two swings of a walk cost.
fn end_of(before: [Option<Turn>; 2]) -> f64 {
    match before {
        [Some(last), Some(end)] if last.is_first_foot != end.is_first_foot => {
            NO_HALF_STEP_S * larger(end, last)
        }
        _ => 0.0,
    }
}

/// By how much a swing turns more than another, as a share of both, less than zero where it turns less.
fn larger(one: Turn, other: Turn) -> f64 {
    let both = one.turned_rad + other.turned_rad;
    if both > 0.0 { ((one.turned_rad - other.turned_rad) / both).clamp(-0.5, 0.5) } else { 0.0 }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_feet_with_other_clocks_are_brought_together_by_their_steps() {
        let (mut left, mut right) = (Swings::default(), Swings::default());
        let foot = |k: usize, after_s: f64| {
            let t_s = k as f64 / 100.0;
            let walks = (12.0..45.0).contains(&t_s) || (52.0..70.0).contains(&t_s);
            let swing = if walks && (t_s - after_s).rem_euclid(1.12) < 0.42 { 5.0 } else { 0.01 };
            ImuSample {
                t_ns: (t_s * 1e9) as i64,
                w_ib_b_rad_s: [0.0, swing, 0.0],
                f_b_m_s2: [0.0, 0.0, 9.8],
                mag_b_ut: None,
                pressure_hpa: None,
            }
        };
        for k in 0..8000 {
            left.take(&foot(k, 0.0));
            let mut row = foot(k, 0.56);
            row.t_ns += 3_598_000_000_000;
            right.take(&row);
        }
        let FeetClocks::Apart { ahead_by_s, sigma_s } = FeetClocks::between(&left, &right) else { panic!() };
        assert!((ahead_by_s - 3598.0).abs() < 0.15 && sigma_s < 0.3, "{ahead_by_s} {sigma_s}");
        let mut near = Swings::default();
        (0..8000).for_each(|k| near.take(&foot(k, 0.56)));
        assert_eq!(FeetClocks::between(&left, &near), FeetClocks::Together);
    }
}
