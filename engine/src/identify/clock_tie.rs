//! Ties a kiosk's clock to a log's: visits that were keyed in, against the stands found in the log.
//!
//! Each pair of a keyed visit and a stand proposes an offset. An offset is as good as the number of
//! visits that then fall on stands at places the track agrees with, up to one shift and one rotation
//! of the whole track. An offset that another one nearly equals is ambiguous: rows of actuators are
//! regular, and a walk along one looks the same a stop later.

/// A marker that was keyed in: its surveyed place, m east and north, and the kiosk's time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyedVisit {
    /// Surveyed place of the marker, east and north, m.
    pub p_n_m: [f64; 2],
    /// Time by the kiosk's clock, s.
    pub t_s: f64,
    /// It may be off by so much either way, s: on paper times are whole minutes.
    pub half_s: f64,
}

/// A stand of the log: its span by the log's clock and its place by the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackStand {
    /// Place by the track, east and north, m.
    pub p_n_m: [f64; 2],
    /// Begin of the stand by the log's clock, s.
    pub t_start_s: f64,
    /// End of the stand by the log's clock, s.
    pub t_end_s: f64,
    /// Way walked since the log began, m.
    pub way_m: f64,
}

/// What ties the two clocks.
#[derive(Clone, Debug, PartialEq)]
pub enum ClockTie {
    /// One offset explains the visits, and no other nearly as well.
    Tied {
        /// The log's time less the kiosk's, s.
        offset_s: f64,
        /// Standard deviation of the offset, s.
        sigma_s: f64,
        /// Index of the visit and of its stand, in order of the visits.
        matched: Vec<(usize, usize)>,
    },
    /// Two offsets explain the visits about as well: somebody must be asked.
    Ambiguous,
    /// No offset explains enough visits.
    None,
}

/// Offsets beyond this are not considered, s: a clock is minutes off, and a log may be switched on well before its walk.
const LARGEST_OFFSET_S: f64 = 3600.0;
/// A visit is keyed this long before or after its stand at the most, s.
const KEYED_BESIDE_S: f64 = 3.0;
/// Offsets nearer to each other than this are one, s.
const SAME_OFFSET_S: f64 = 6.0;
/// Least number of visits that tie two clocks: two places give the shift and the rotation.
pub const LEAST_MATCHED: usize = 4;
/// The best offset matches at least this many visits more than any other.
const AHEAD: usize = 2;
/// A person stands this far from the marker, one sigma, m.
const BESIDE_MARKER_M: f64 = 1.0;
/// Error of the track in proportion to the way between two stands, one sigma.
const DRIFT: f64 = 0.02;
/// The track may be turned by this at the most, rad.
const LARGEST_TURN_RAD: f64 = 0.6;
/// A key is pressed so long before or after the stand, one sigma, s.
const PRESSED_BESIDE_S: f64 = 0.7;

/// Ties the kiosk's clock to the log's. `start_n_m`: where the track begins (east and north, m), when that is
/// a known place; then the track may be turned about it, but not shifted.
#[must_use]
pub fn tie_clocks(keyed: &[KeyedVisit], stands: &[TrackStand], start_n_m: Option<[f64; 2]>) -> ClockTie {
    let mut proposed: Vec<(f64, Vec<(usize, usize)>)> = Vec::new();
    for visit in keyed {
        for stand in stands {
            let offset_s = 0.5 * (stand.t_start_s + stand.t_end_s) - visit.t_s;
            if offset_s.abs() <= LARGEST_OFFSET_S {
                proposed.push((offset_s, falling_on(keyed, stands, offset_s)));
            }
        }
    }
    // Those that few visits fall on in time need no look at the places.
    proposed.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then(a.0.total_cmp(&b.0)));
    let mut votes: Vec<(f64, Vec<(usize, usize)>)> = Vec::new();
    let mut most = 0_usize;
    for (offset_s, pairs) in proposed {
        if pairs.len() < LEAST_MATCHED.max((most + 1).saturating_sub(AHEAD)) {
            break;
        }
        let set = agreeing(keyed, stands, &pairs, start_n_m);
        most = most.max(set.len());
        votes.push((offset_s, set));
    }
    let best = votes.iter().max_by_key(|vote| vote.1.len()).filter(|vote| vote.1.len() >= LEAST_MATCHED);
    let Some(best) = best else {
        return ClockTie::None;
    };
    let matched = best.1.clone();
    let (offset_s, sigma_s) = offset_of(keyed, stands, &matched);
    // Of times that are whole minutes, offsets less than two of them apart fit alike.
    let same_s = SAME_OFFSET_S + 4.0 * keyed.iter().map(|visit| visit.half_s).fold(0.0, f64::max);
    let is_rival = |vote: &&(f64, Vec<(usize, usize)>)| {
        (vote.0 - offset_s).abs() > same_s && (offset_of(keyed, stands, &vote.1).0 - offset_s).abs() > same_s
    };
    let second = votes.iter().filter(is_rival).map(|vote| vote.1.len()).max().unwrap_or(0);
    if second + AHEAD > matched.len() || 2 * matched.len() <= keyed.len() {
        return ClockTie::Ambiguous;
    }
    ClockTie::Tied { offset_s, sigma_s, matched }
}

/// The visits that fall on a stand once the offset is applied.
fn falling_on(keyed: &[KeyedVisit], stands: &[TrackStand], offset_s: f64) -> Vec<(usize, usize)> {
    let on = |visit: &KeyedVisit| {
        let (t_s, beside_s) = (visit.t_s + offset_s, KEYED_BESIDE_S + visit.half_s);
        stands.iter().position(|stand| t_s >= stand.t_start_s - beside_s && t_s <= stand.t_end_s + beside_s)
    };
    keyed.iter().enumerate().filter_map(|(k, visit)| Some((k, on(visit)?))).collect()
}

/// The largest set of pairs that one shift and one rotation of the track, fixed by two of them, explains.
fn agreeing(
    keyed: &[KeyedVisit],
    stands: &[TrackStand],
    pairs: &[(usize, usize)],
    start_n_m: Option<[f64; 2]>,
) -> Vec<(usize, usize)> {
    let mut best = Vec::new();
    for (i, a) in pairs.iter().enumerate() {
        for b in &pairs[i + 1..] {
            let d_marker = between(keyed[a.0].p_n_m, keyed[b.0].p_n_m);
            let d_track = between(stands[a.1].p_n_m, stands[b.1].p_n_m);
            let cross = d_track[0] * d_marker[1] - d_track[1] * d_marker[0];
            let dot = d_track[0] * d_marker[0] + d_track[1] * d_marker[1];
            let turn_rad = libm::atan2(cross, dot);
            if a.1 == b.1 || turn_rad.abs() > LARGEST_TURN_RAD {
                continue;
            }
            let (sin, cos) = (libm::sin(turn_rad), libm::cos(turn_rad));
            // Whether the way from `a` to another place is the same by the track and by the survey.
            let is_there = |d: [f64; 2], m: [f64; 2], way_m: f64| {
                let off_m = libm::hypot(cos * d[0] - sin * d[1] - m[0], sin * d[0] + cos * d[1] - m[1]);
                off_m <= 3.0 * libm::hypot(2.0 * BESIDE_MARKER_M, DRIFT * way_m)
            };
            let (at, marker, way_a_m) = (stands[a.1].p_n_m, keyed[a.0].p_n_m, stands[a.1].way_m);
            let starts_right =
                start_n_m.is_none_or(|start| is_there(between(at, start), between(marker, start), way_a_m));
            if !starts_right {
                continue;
            }
            let agrees = |pair: &&(usize, usize)| {
                let way_m = (stands[pair.1].way_m - way_a_m).abs();
                is_there(between(at, stands[pair.1].p_n_m), between(marker, keyed[pair.0].p_n_m), way_m)
            };
            let set: Vec<_> = pairs.iter().filter(agrees).copied().collect();
            if set.len() > best.len() {
                best = set;
            }
        }
    }
    best
}

fn between(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    [to[0] - from[0], to[1] - from[1]]
}

/// The offset that puts all visits onto their stands, and its standard deviation, s. Each pair bounds it from
/// both sides; it is as likely anywhere between the bounds.
fn offset_of(keyed: &[KeyedVisit], stands: &[TrackStand], matched: &[(usize, usize)]) -> (f64, f64) {
    let (mut least_s, mut most_s) = (f64::NEG_INFINITY, f64::INFINITY);
    for &(k, s) in matched {
        least_s = least_s.max(stands[s].t_start_s - keyed[k].t_s - keyed[k].half_s);
        most_s = most_s.min(stands[s].t_end_s - keyed[k].t_s + keyed[k].half_s);
    }
    if matched.is_empty() {
        return (0.0, f64::INFINITY);
    }
    // Bounds that cross come of keys pressed before or after the stand.
    (0.5 * (least_s + most_s), libm::hypot((most_s - least_s) / libm::sqrt(12.0), PRESSED_BESIDE_S))
}

#[cfg(test)]
#[path = "clock_tie_tests.rs"]
mod clock_tie_tests;
