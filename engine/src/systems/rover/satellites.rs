//! How an epoch of satellites enters the state: code and phase as single differences, with clocks that are free in each epoch.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::arcs::{Ambiguity, Arc, Group, Key, Known, group};
use super::differences::Difference;
use super::noise::Noise;
use super::state::{POSITION, State};

/// Prior of a clock, m, once the middle of what codes say is taken off.
const CLOCK_SIGMA_M: f64 = 100.0;
/// Normalised residuals above speak of a slip.
const SLIP: f64 = 4.5;
/// The same where few satellites check each other.
const SLIP_OF_FEW: f64 = 8.0;
/// Normalised residuals of code above make it count less.
const CODE_LIMIT: f64 = 3.5;
/// Rounds of looking for what does not fit.
const MOST_ROUNDS: usize = 12;
/// Residuals of less than this share of their variance say nothing of their own observation.
const TESTABLE: f64 = 0.05;

/// All arcs, and the count of those there have been.
#[derive(Clone, Debug, Default)]
pub struct Arcs {
    /// By satellite and band.
    pub by_key: BTreeMap<Key, Arc>,
    /// Arcs there have been.
    pub count: u32,
    /// Slips that no flag told.
    pub slips_found: usize,
    /// Slips that a flag told.
    pub slips_told: usize,
    /// Whole cycles that were held, by the arc's beginning.
    pub found: Known,
}

impl Arcs {
    /// Begins an arc.
    pub(super) fn begin(
        &mut self,
        key: Key,
        ambiguity: Ambiguity,
        difference: &Difference,
        epoch: u64,
        gauge: u32,
    ) {
        self.count += 1;
        let arc = Arc {
            id: self.count,
            ambiguity,
            epochs: 0,
            last_seen: epoch,
            half_cycle: difference.half_cycle,
            attributes: difference.attributes,
            began: epoch,
            gauge,
        };
        self.by_key.insert(key, arc);
    }
}

/// One scalar observation.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Which of the differences.
    of: usize,
    is_phase: bool,
    /// Index of its clock.
    clock: usize,
    /// Measured − expected at the place of linearisation, whole cycles taken off where they are held, m.
    value_m: f64,
    variance: f64,
    /// Not used in this round.
    dropped: bool,
}

/// What an epoch gave.
#[derive(Clone, Debug, Default)]
pub struct EpochResult {
    /// Satellites used.
    pub satellites: usize,
    /// Satellites whose phases are held.
    pub held_satellites: usize,
    /// Differences of held phases between satellites of one group: directions with whole numbers.
    pub held_directions: usize,
    /// Indices of phase clocks by group; valid until [`forget_clocks`].
    pub phase_clocks: BTreeMap<Group, usize>,
    /// First clock's index.
    pub first_clock: usize,
    /// Held arcs that had to be given up in this epoch.
    pub given_up: usize,
    /// Held arcs that were looked at.
    pub held: usize,
    /// v'Pv of all observations, and their redundancy.
    pub fit: [f64; 2],
}

/// Takes an epoch's differences, linearised at `at_n`. Clocks stay in the state until [`forget_clocks`].
pub fn weigh(
    state: &mut State,
    arcs: &mut Arcs,
    differences: &[Difference],
    at_n: &Vector3<f64>,
    noise: &mut Noise,
    epoch: u64,
    distance_m: f64,
) -> EpochResult {
    let mut result = EpochResult::default();
    // The middle of what codes say of each system's clock.
    let mut middles: BTreeMap<Group, f64> = BTreeMap::new();
    for difference in differences {
        let of = (difference.satellite.constellation, 0);
        if let std::collections::btree_map::Entry::Vacant(place) = middles.entry(of) {
            let mut codes: Vec<f64> = differences
                .iter()
                .filter(|other| other.satellite.constellation == of.0)
                .filter_map(|other| other.code_m)
                .collect();
            codes.sort_by(f64::total_cmp);
            place.insert(codes.get(codes.len() / 2).copied().unwrap_or(0.0));
        }
    }
    // New arcs get a state before the clocks, which are forgotten after the epoch.
    for difference in differences {
        let key = (difference.satellite, difference.band);
        let (Some(phase_m), false) = (difference.phase_m, arcs.by_key.contains_key(&key)) else { continue };
        let middle = middles.get(&(difference.satellite.constellation, 0)).copied().unwrap_or(0.0);
        let start = (phase_m - difference.code_m.unwrap_or(middle)) / difference.wavelength_m;
        let sigma = 50.0 / difference.wavelength_m;
        let index = state.push(start, sigma * sigma);
        arcs.begin(key, Ambiguity::Float(index), difference, epoch, 0);
    }
    result.first_clock = state.len();
    let mut clocks: BTreeMap<(bool, Group), usize> = BTreeMap::new();
    for difference in differences {
        let of = (difference.satellite.constellation, difference.band);
        for (is_phase, there) in [(false, difference.code_m.is_some()), (true, difference.phase_m.is_some())]
        {
            if there {
                let next = result.first_clock + clocks.len();
                clocks.entry((is_phase, of)).or_insert(next);
            }
        }
    }
    state.push_many(clocks.len(), CLOCK_SIGMA_M * CLOCK_SIGMA_M);
    for (&(is_phase, of), &index) in &clocks {
        if is_phase {
            result.phase_clocks.insert(of, index);
        }
    }
    let mut rows = Vec::with_capacity(2 * differences.len());
    for (is_phase, _) in [(false, ()), (true, ())] {
        for (k, difference) in differences.iter().enumerate() {
            let of = (difference.satellite.constellation, difference.band);
            let middle = middles.get(&(of.0, 0)).copied().unwrap_or(0.0);
            let (value, variance) = if is_phase {
                (difference.phase_m, noise.phase_variance(difference, distance_m))
            } else {
                (difference.code_m, noise.code_variance(difference))
            };
            if let (Some(value), Some(&clock)) = (value, clocks.get(&(is_phase, of))) {
                rows.push(Row { of: k, is_phase, clock, value_m: value - middle, variance, dropped: false });
            }
        }
    }
    let before = state.clone();
    for round in 0..MOST_ROUNDS {
        if round > 0 {
            state.clone_from(&before);
            reset_slipped(state, arcs, differences, &rows, &middles);
        }
        for row in &rows {
            if !row.dropped {
                let (list, count, value) = row_of(row, differences, arcs, at_n);
                let list = &list[..count];
                let innovation = value - state.row_value(list);
                state.update(list, innovation, row.variance);
            }
        }
        if round + 1 == MOST_ROUNDS {
            break;
        }
        let Some((worst, _)) = worst(state, differences, arcs, &rows, at_n) else { break };
        let difference = &differences[rows[worst].of];
        let key = (difference.satellite, difference.band);
        if rows[worst].is_phase {
            if let Some(arc) = arcs.by_key.get_mut(&key)
                && arc.epochs != u32::MAX
            {
                if matches!(arc.ambiguity, Ambiguity::Held(_)) {
                    result.given_up += 1;
                    rows[worst].dropped = true;
                }
                arc.epochs = u32::MAX;
                arcs.slips_found += 1;
            } else {
                rows[worst].dropped = true;
            }
        } else {
            rows[worst].variance *= 9.0;
        }
    }
    for row in &rows {
        if row.dropped {
            continue;
        }
        let difference = &differences[row.of];
        let (list, count, value) = row_of(row, differences, arcs, at_n);
        let list = &list[..count];
        let residual = value - state.row_value(list);
        let redundancy = (1.0 - state.row_variance(list) / row.variance).clamp(0.0, 1.0);
        let key = (difference.satellite, difference.band);
        result.fit[0] += residual * residual / row.variance;
        result.fit[1] += redundancy;
        if redundancy > TESTABLE {
            if row.is_phase {
                noise.take_phase(residual, row.variance, redundancy);
            } else {
                noise.take_code(key, residual, noise.code_variance(difference).max(1e-6), redundancy);
            }
        }
    }
    count(arcs, differences, epoch, &mut result);
    result
}

/// Gives arcs that slipped in this epoch a state of their own, or begins theirs anew.
fn reset_slipped(
    state: &mut State,
    arcs: &mut Arcs,
    differences: &[Difference],
    rows: &[Row],
    middles: &BTreeMap<Group, f64>,
) {
    for row in rows.iter().filter(|row| row.is_phase) {
        let difference = &differences[row.of];
        let key = (difference.satellite, difference.band);
        let Some(arc) = arcs.by_key.get_mut(&key).filter(|arc| arc.epochs == u32::MAX) else { continue };
        let middle = middles.get(&(difference.satellite.constellation, 0)).copied().unwrap_or(0.0);
        let code = difference.code_m.map_or(0.0, |code| code - middle);
        let start = (row.value_m - code) / difference.wavelength_m;
        let sigma = 50.0 / difference.wavelength_m;
        if let Ambiguity::Float(index) = arc.ambiguity {
            state.reset(index, start, sigma * sigma);
        }
        // A held arc that slipped has no state in this epoch: its phase is left out, and it begins anew in the next.
    }
}

/// The row of an observation, its length, and measured − expected with what is held taken off.
fn row_of(
    row: &Row,
    differences: &[Difference],
    arcs: &Arcs,
    at_n: &Vector3<f64>,
) -> ([(usize, f64); 5], usize, f64) {
    let difference = &differences[row.of];
    let unit = difference.row_n;
    let mut list = [
        (POSITION, unit.x),
        (POSITION + 1, unit.y),
        (POSITION + 2, unit.z),
        (row.clock, 1.0),
        (row.clock, 0.0),
    ];
    let mut value = row.value_m + unit.dot(at_n);
    let mut length = 4;
    if row.is_phase
        && let Some(arc) = arcs.by_key.get(&(difference.satellite, difference.band))
    {
        match arc.ambiguity {
            Ambiguity::Float(index) => {
                list[4] = (index, difference.wavelength_m);
                length = 5;
            }
            Ambiguity::Held(cycles) => value -= cycles * difference.wavelength_m,
        }
    }
    (list, length, value)
}

/// The observation that fits worst, if it is worse than chance allows.
fn worst(
    state: &State,
    differences: &[Difference],
    arcs: &Arcs,
    rows: &[Row],
    at_n: &Vector3<f64>,
) -> Option<(usize, f64)> {
    let mut worst = None;
    let mut most = 1.0;
    // With few satellites a phase is held against ranges and motion only, whose errors are no noise.
    let slip = if directions(differences) >= 5 { SLIP } else { SLIP_OF_FEW };
    for (k, row) in rows.iter().enumerate() {
        if row.dropped {
            continue;
        }
        let (list, count, value) = row_of(row, differences, arcs, at_n);
        let list = &list[..count];
        let variance = row.variance - state.row_variance(list);
        if variance < TESTABLE * row.variance {
            continue;
        }
        let normal = (value - state.row_value(list)).abs() / variance.sqrt();
        let excess = normal / if row.is_phase { slip } else { CODE_LIMIT };
        if excess > most {
            most = excess;
            worst = Some((k, normal));
        }
    }
    worst
}

fn count(arcs: &mut Arcs, differences: &[Difference], epoch: u64, result: &mut EpochResult) {
    let mut satellites: Vec<_> = differences.iter().map(|one| one.satellite).collect();
    satellites.dedup();
    result.satellites = satellites.len();
    let mut held: Vec<Key> = Vec::new();
    for difference in differences.iter().filter(|one| one.phase_m.is_some()) {
        let key = (difference.satellite, difference.band);
        if let Some(arc) = arcs.by_key.get_mut(&key) {
            arc.last_seen = epoch;
            if arc.epochs != u32::MAX {
                arc.epochs += 1;
                if matches!(arc.ambiguity, Ambiguity::Held(_)) {
                    held.push(key);
                }
            }
        }
    }
    result.held = held.len();
    let mut groups: BTreeMap<Group, usize> = BTreeMap::new();
    for key in &held {
        *groups.entry(group(key)).or_default() += 1;
    }
    let mut by_system: BTreeMap<_, usize> = BTreeMap::new();
    for (of, count) in groups {
        let most = by_system.entry(of.0).or_insert(0);
        *most = (*most).max(count.saturating_sub(1));
    }
    result.held_directions = by_system.values().sum();
    held.dedup_by_key(|key| key.0);
    result.held_satellites = held.len();
}

/// Takes the clocks of an epoch out of the state again, and the arcs that ended.
pub fn forget_clocks(state: &mut State, arcs: &mut Arcs, result: &EpochResult, epoch: u64, longest_gap: u64) {
    let ended: Vec<Key> = arcs
        .by_key
        .iter()
        .filter(|(_, arc)| arc.last_seen + longest_gap < epoch || arc.epochs == u32::MAX)
        .filter(|(_, arc)| !(arc.epochs == u32::MAX && matches!(arc.ambiguity, Ambiguity::Float(_))))
        .map(|(key, _)| *key)
        .collect();
    // A float arc that slipped has begun anew in its own state.
    for arc in arcs.by_key.values_mut() {
        if arc.epochs == u32::MAX && matches!(arc.ambiguity, Ambiguity::Float(_)) {
            arc.epochs = 1;
            arcs.count += 1;
            arc.id = arcs.count;
            arc.began = epoch;
        }
    }
    drop_arcs(state, arcs, &ended, result.first_clock);
}

/// Takes arcs out of the state, and everything from index `end` on.
pub fn drop_arcs(state: &mut State, arcs: &mut Arcs, ended: &[Key], end: usize) {
    let mut gone: Vec<usize> = Vec::new();
    for key in ended {
        if let Some(Arc { ambiguity: Ambiguity::Float(index), .. }) = arcs.by_key.remove(key) {
            gone.push(index);
        }
    }
    if gone.is_empty() && end == state.len() {
        return;
    }
    let kept: Vec<usize> = (0..end.min(state.len())).filter(|index| !gone.contains(index)).collect();
    state.retain(&kept);
    renumber(arcs, &kept);
}

/// Follows arcs' states to their new indices; those that are not kept must have been held or removed before.
pub fn renumber(arcs: &mut Arcs, kept: &[usize]) {
    for arc in arcs.by_key.values_mut() {
        if let Ambiguity::Float(index) = &mut arc.ambiguity
            && let Ok(place) = kept.binary_search(index)
        {
            *index = place;
        }
    }
}

/// Directions between satellites of one system each.
pub(super) fn directions(differences: &[Difference]) -> usize {
    let mut by_system = [0_usize; 4];
    let mut before = None;
    for one in differences.iter().filter(|one| one.phase_m.is_some()) {
        if before != Some(one.satellite) {
            by_system[one.satellite.constellation.index()] += 1;
            before = Some(one.satellite);
        }
    }
    by_system.iter().map(|count| count.saturating_sub(1)).sum()
}
