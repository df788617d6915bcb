//! From float ambiguities to whole ones: which are tried, when an answer is believed, when it is held.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::arcs::{Ambiguity, Group, Key, group};
use super::differences::Difference;
use super::noise::Noise;
use super::satellites::{Arcs, drop_arcs};
use super::state::State;
use crate::adjust::integers::{Integers, integers_within, success_rate};

/// The lowest bootstrapped success rate with which integers are searched.
const SUCCESS: f64 = 0.999;
/// The second best must be so many times as far as the best.
const RATIO: f64 = 3.0;
/// Below, not even an answer that fits far better than assumed would be believed.
const WORTH_SEARCHING: f64 = 0.8;
/// So many ambiguities say by their own fit how good the covariance is; with a second best this far away and this success rate they
/// are believed at once.
const MANY: usize = 16;
const FAR: f64 = 6.0;
const SUCCESS_OF_MANY: f64 = 0.97;
/// So few ambiguities of one band leave too little beyond the position to say how well they fit.
const LEAST_SHARP: usize = 6;
/// Steps of a search: an answer that is far from every whole vector is no answer.
const MOST_STEPS: usize = 20_000;
/// Variance with which whole cycles are taken, cycles².
const WHOLE_VARIANCE: f64 = 1e-8;

/// Whole cycles that passed every test.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Cycles of each arc in the gauge of its group, and the arc's number.
    cycles: BTreeMap<Key, (u32, f64)>,
    /// Rows of ambiguities (index, coefficient), and their whole values.
    rows: Vec<(Vec<(usize, f64)>, f64)>,
    /// The second norm over the first.
    pub ratio: f64,
    /// Bootstrapped success rate.
    pub success: f64,
    /// Directions between satellites, of one group each, that the answer holds.
    pub directions: usize,
}

/// What a search came to.
#[derive(Clone, Debug, Default)]
pub struct Search {
    /// The answer that passed.
    pub answer: Option<Answer>,
    /// The ratio that was found, passed or not.
    pub ratio: Option<f64>,
}

struct Candidate {
    key: Key,
    index: usize,
    arc: u32,
    elevation_rad: f64,
    wavelength_m: f64,
    /// What stays in the phase from epoch to epoch and no covariance shows: multipath, and half of the atmosphere; m.
    lasting_m: f64,
    /// What stays of the ionosphere, m on this band.
    ionosphere_m: f64,
}

/// Searches whole values of the float ambiguities of this epoch, whose clocks are still in the state.
pub fn search(
    state: &State,
    arcs: &Arcs,
    differences: &[Difference],
    noise: &Noise,
    distance_m: f64,
) -> Search {
    let mut held: BTreeMap<Group, usize> = BTreeMap::new();
    let mut candidates = Vec::new();
    for difference in differences.iter().filter(|one| one.phase_m.is_some()) {
        let key = (difference.satellite, difference.band);
        let Some(arc) = arcs.by_key.get(&key).filter(|arc| arc.epochs != u32::MAX) else { continue };
        match arc.ambiguity {
            Ambiguity::Held(_) => *held.entry(group(&key)).or_default() += 1,
            Ambiguity::Float(index) if !arc.half_cycle => {
                candidates.push(Candidate {
                    key,
                    index,
                    arc: arc.id,
                    elevation_rad: difference.elevation_rad,
                    wavelength_m: difference.wavelength_m,
                    lasting_m: noise.lasting_m(difference),
                    ionosphere_m: noise.ionosphere_m(difference, distance_m),
                });
            }
            Ambiguity::Float(_) => {}
        }
    }
    // Highest first, so that what is left out is what is lowest.
    candidates.sort_by(|a, b| b.elevation_rad.total_cmp(&a.elevation_rad).then(a.key.cmp(&b.key)));
    let mut found = Search::default();
    let mut size = candidates.len();
    for _ in 0..10 {
        let (rows, cycles) = rows_of(state, &candidates[..size], &held);
        if rows.is_empty() {
            break;
        }
        let (a, mut q) = moments(state, &rows);
        let sharp =
            one_band(&candidates[..size]) && success_rate(&q).is_some_and(|success| success >= SUCCESS);
        add_lasting(&mut q, &rows, &candidates[..size]);
        if success_rate(&q).is_some_and(|success| success >= WORTH_SEARCHING)
            && let Ok(whole) = integers_within(&a, &q, MOST_STEPS)
            && believed(&whole, &q, sharp)
        {
            found.ratio = Some(whole.ratio());
            found.answer = Some(answer(rows, cycles, &whole, &candidates[..size], &held));
            return found;
        }
        // Something does not fit, or is not sharp enough: once more without the lowest eighth.
        let next = size - (size / 8).max(1);
        if next < 4 {
            break;
        }
        size = next;
    }
    found
}

/// Whether whole cycles are believed: the fit is no worse than chance allows, the second best is far, and rounding would succeed.
///
/// `sharp` is for receivers with one band, which wait for fifteen equal answers: rounding would succeed if nothing lasted in the phases.
/// What lasts is assumed, not measured, and where few phases are there it alone keeps the success rate down for minutes. A second best
/// that is far says by the data themselves that less of it is there.
fn believed(whole: &Integers, q: &DMatrix<f64>, sharp: bool) -> bool {
    let n = whole.best.len();
    if whole.norms[0] > limit(n) || whole.ratio() < RATIO {
        return false;
    }
    if whole.success >= SUCCESS {
        return true;
    }
    if sharp && n >= LEAST_SHARP && whole.ratio() >= FAR {
        return true;
    }
    if n < MANY || whole.ratio() < FAR {
        return false;
    }
    // The variance factor at most, two of its own sigmas above what the fit shows.
    let of = n as f64;
    let factor = (whole.norms[0] / of * (1.0 + 2.0 * (2.0 / of).sqrt())).min(1.0);
    success_rate(&(q * factor)).is_some_and(|success| success >= SUCCESS_OF_MANY)
}

fn one_band(candidates: &[Candidate]) -> bool {
    candidates.iter().all(|one| one.key.1 == candidates[0].key.1)
}

type Rows = Vec<Vec<(usize, f64)>>;

/// The rows of whole combinations, with the arc of each and what is added to it to be in its group's gauge.
fn rows_of(
    state: &State,
    candidates: &[Candidate],
    held: &BTreeMap<Group, usize>,
) -> (Rows, Vec<(Key, u32, f64)>) {
    let mut references: BTreeMap<Group, (usize, f64)> = BTreeMap::new();
    let (mut rows, mut cycles) = (Rows::new(), Vec::new());
    for candidate in candidates {
        let of = group(&candidate.key);
        if held.contains_key(&of) {
            // What is held makes the clock's gauge whole, and with it every other arc of the group.
            rows.push(vec![(candidate.index, 1.0)]);
            cycles.push((candidate.key, candidate.arc, 0.0));
        } else if let Some(&(reference, gauge)) = references.get(&of) {
            rows.push(vec![(candidate.index, 1.0), (reference, -1.0)]);
            cycles.push((candidate.key, candidate.arc, gauge));
        } else {
            references.insert(of, (candidate.index, libm::round(state.x[candidate.index])));
        }
    }
    (rows, cycles)
}

fn moments(state: &State, rows: &[Vec<(usize, f64)>]) -> (Vec<f64>, DMatrix<f64>) {
    let a = rows.iter().map(|row| state.row_value(row)).collect();
    let q = DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
        let mut covariance = 0.0;
        for &(k, a) in &rows[i] {
            for &(l, b) in &rows[j] {
                covariance += a * b * state.covariance(k, l);
            }
        }
        covariance
    });
    (a, q)
}

/// Adds what lasts to the covariance: errors of the phases that are the same in every epoch of an arc look like cycles.
fn add_lasting(q: &mut DMatrix<f64>, rows: &Rows, candidates: &[Candidate]) {
    let by_index: BTreeMap<usize, &Candidate> = candidates.iter().map(|one| (one.index, one)).collect();
    for i in 0..rows.len() {
        for j in 0..=i {
            let mut sum = 0.0;
            for (k, a) in &rows[i] {
                for (l, b) in &rows[j] {
                    let (Some(one), Some(other)) = (by_index.get(k), by_index.get(l)) else { continue };
                    if one.key.0 != other.key.0 {
                        continue;
                    }
                    let mut shared = one.ionosphere_m * other.ionosphere_m;
                    if k == l {
                        shared += one.lasting_m * one.lasting_m;
                    }
                    sum += a * b * shared / (one.wavelength_m * other.wavelength_m);
                }
            }
            q[(i, j)] += sum;
            if i != j {
                q[(j, i)] += sum;
            }
        }
    }
}

/// The 99.9 % quantile of χ² with n degrees of freedom, by Wilson and Hilferty.
fn limit(n: usize) -> f64 {
    let n = n as f64;
    let cube = 1.0 - 2.0 / (9.0 * n) + 3.09 * (2.0 / (9.0 * n)).sqrt();
    n * cube * cube * cube
}

fn answer(
    rows: Rows,
    cycles: Vec<(Key, u32, f64)>,
    whole: &Integers,
    candidates: &[Candidate],
    held: &BTreeMap<Group, usize>,
) -> Answer {
    let mut by_key = BTreeMap::new();
    for ((key, arc, gauge), value) in cycles.iter().zip(&whole.best) {
        by_key.insert(*key, (*arc, value + gauge));
    }
    // The reference itself is whole in its own gauge.
    for (candidate, gauge) in candidates
        .iter()
        .filter(|one| !held.contains_key(&group(&one.key)))
        .filter_map(|one| {
            (!by_key.contains_key(&one.key)).then(|| {
                let gauge =
                    cycles.iter().find(|(key, ..)| group(key) == group(&one.key)).map(|(.., gauge)| *gauge);
                gauge.map(|gauge| (one, gauge))
            })?
        })
        .collect::<Vec<_>>()
    {
        by_key.insert(candidate.key, (candidate.arc, gauge));
    }
    let mut by_group: BTreeMap<Group, usize> = BTreeMap::new();
    for key in by_key.keys() {
        *by_group.entry(group(key)).or_default() += 1;
    }
    let mut by_system = BTreeMap::new();
    for (of, count) in by_group {
        let directions = count + held.get(&of).copied().unwrap_or(0) - 1;
        let most = by_system.entry(of.0).or_insert(0);
        *most = directions.max(*most);
    }
    Answer {
        cycles: by_key,
        rows: rows.into_iter().zip(whole.best.iter().copied()).collect(),
        ratio: whole.ratio(),
        success: whole.success,
        directions: by_system.values().sum(),
    }
}

impl Answer {
    /// Makes a state obey the answer.
    pub fn apply(&self, state: &mut State) {
        for (row, whole) in &self.rows {
            let innovation = whole - state.row_value(row);
            state.update(row, innovation, WHOLE_VARIANCE);
        }
    }

    /// Holds the answer: the state obeys it, and its ambiguities are known from now on. `end` is where clocks begin.
    pub fn hold(&self, state: &mut State, arcs: &mut Arcs) {
        self.apply(state);
        let mut gone = Vec::new();
        for (key, (id, cycles)) in &self.cycles {
            if let Some(arc) = arcs.by_key.get_mut(key).filter(|arc| arc.id == *id)
                && let Ambiguity::Float(index) = arc.ambiguity
            {
                arc.ambiguity = Ambiguity::Held(*cycles);
                gone.push(index);
            }
        }
        let kept: Vec<usize> = (0..state.len()).filter(|index| !gone.contains(index)).collect();
        state.retain(&kept);
        super::satellites::renumber(arcs, &kept);
    }

    /// Whether this answer says the same of the arcs that both know; none where they share too few.
    pub fn agrees(&self, other: &Answer) -> Option<bool> {
        let mut offsets: BTreeMap<Group, f64> = BTreeMap::new();
        let mut shared = 0;
        for (key, (arc, cycles)) in &self.cycles {
            let Some((_, before)) = other.cycles.get(key).filter(|(id, _)| id == arc) else { continue };
            shared += 1;
            let offset = *offsets.entry(group(key)).or_insert(cycles - before);
            if cycles - before != offset {
                return Some(false);
            }
        }
        (2 * shared >= self.cycles.len()).then_some(true)
    }
}

/// Makes every held arc float again: what was held has proved wrong. The arcs begin anew.
pub fn release(state: &mut State, arcs: &mut Arcs) {
    let held: Vec<Key> = arcs
        .by_key
        .iter()
        .filter(|(_, arc)| matches!(arc.ambiguity, Ambiguity::Held(_)))
        .map(|(key, _)| *key)
        .collect();
    let end = state.len();
    drop_arcs(state, arcs, &held, end);
}
