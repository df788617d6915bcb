//! The stands of a walk as a sequence: which markers they were at, all together.
//!
//! A hypothesis says at which marker the newest stand was, or that it was at none, and knows how far
//! the track is off if that is true. A new stand lets each branch into the markers within its reach,
//! weighed by how well they fit; those that fit badly die out, and those that agree on the last two
//! stands and on the error are merged, remembering by which shares they came from which. Going back
//! over these shares gives each past stand its marks by all that is known now: hindsight.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::likelihood::weigh;
use super::markers::Markers;
use super::track_error::{Stretch, TrackError};
use super::tuning::IdentificationTuning;

/// Hypotheses that are kept.
const KEPT: usize = 200;
/// Those less probable than this are dropped.
const LEAST: f64 = 1e-8;
/// Hypotheses are merged whose errors in plan are nearer than this, m.
const ALIKE_M: f64 = 1.0;

/// At which marker (its number), or at none.
pub(super) type Mark = Option<usize>;

/// What is seen of one stand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Seen {
    /// How the track came here from the stand before.
    pub(super) stretches: Vec<Stretch>,
    /// Where the track has it, m.
    pub(super) position_n_m: Vector3<f64>,
    /// Name of the marker that was keyed in and not turned down: it is saved, and numbers change with the database.
    pub(super) keyed: Option<String>,
}

#[derive(Clone, Debug)]
struct Hypothesis {
    weight: f64,
    error: TrackError,
    /// Stands at none, as an expectation once hypotheses were merged.
    none_stands: f64,
    /// The marks of the stand before and of the newest.
    last: [Option<Mark>; 2],
    /// The hypotheses before the newest stand from which it came, with their shares.
    came_from: Vec<(usize, f64)>,
}

/// All that is thought of a walk's stands.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Hypotheses {
    #[serde(skip)]
    tuning: IdentificationTuning,
    seen: Vec<Seen>,
    /// The hypotheses before each stand, and after the last.
    #[serde(skip)]
    thought: Vec<Vec<Hypothesis>>,
}

impl Hypotheses {
    pub(super) fn new(tuning: IdentificationTuning) -> Hypotheses {
        let first = Hypothesis {
            weight: 1.0,
            error: TrackError::at_start(&tuning),
            none_stands: 0.0,
            last: [None; 2],
            came_from: Vec::new(),
        };
        Hypotheses { tuning, seen: Vec::new(), thought: vec![vec![first]] }
    }

    /// Thinks all of it again: of those that were saved there is only what was seen, from which the rest follows.
    pub(super) fn think_again(&mut self, markers: &Markers, tuning: IdentificationTuning) {
        let seen = std::mem::take(&mut self.seen);
        *self = Hypotheses { seen, ..Hypotheses::new(tuning) };
        self.think_from(0, markers);
    }

    /// Takes the next stand.
    pub(super) fn take(&mut self, seen: Seen, markers: &Markers) {
        self.seen.push(seen);
        self.think_from(self.seen.len() - 1, markers);
    }

    /// A marker was keyed in for a stand: thinks again from there.
    pub(super) fn key(&mut self, stand: usize, marker: &str, markers: &Markers) {
        self.seen[stand].keyed = Some(marker.to_owned());
        self.think_from(stand, markers);
    }

    /// The marks of each stand with their probabilities, by all that is known now.
    pub(super) fn marks(&self) -> Vec<BTreeMap<Mark, f64>> {
        let mut marks = vec![BTreeMap::new(); self.seen.len()];
        let newest = &self.thought[self.thought.len() - 1];
        let mut shares: Vec<f64> = newest.iter().map(|hypothesis| hypothesis.weight).collect();
        for (stand, marks) in marks.iter_mut().enumerate().rev() {
            let mut earlier = vec![0.0; self.thought[stand].len()];
            for (hypothesis, share) in self.thought[stand + 1].iter().zip(shares) {
                *marks.entry(hypothesis.last[1].flatten()).or_insert(0.0) += share;
                for (parent, part) in &hypothesis.came_from {
                    earlier[*parent] += share * part;
                }
            }
            shares = earlier;
        }
        marks
    }

    fn think_from(&mut self, stand: usize, markers: &Markers) {
        self.thought.truncate(stand + 1);
        for (stands_before, seen) in self.seen.iter().enumerate().skip(stand) {
            let next = branch(&self.thought[stands_before], stands_before, seen, markers, &self.tuning);
            self.thought.push(next);
        }
    }
}

/// A branch before it is known whether it is worth carrying on.
struct Branch {
    parent: usize,
    mark: Mark,
    weight: f64,
    with_height: bool,
}

fn branch(
    before: &[Hypothesis],
    stands_before: usize,
    seen: &Seen,
    markers: &Markers,
    tuning: &IdentificationTuning,
) -> Vec<Hypothesis> {
    let mut came: Vec<Hypothesis> = before.to_vec();
    let mut branches = Vec::new();
    let keyed = seen.keyed.as_deref().and_then(|name| markers.find(name));
    for (parent, hypothesis) in came.iter_mut().enumerate() {
        for stretch in &seen.stretches {
            hypothesis.error.walk(stretch, tuning);
        }
        hypothesis.came_from = vec![(parent, 1.0)];
        let place = seen.position_n_m - hypothesis.error.mean.fixed_rows::<3>(0);
        let covariance = hypothesis.error.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let weighed = weigh(&place, &covariance, tuning.beside_sigma_m, markers);
        // What the walk has shown of this inspector's stops counts beside the first guess.
        let none_share =
            (tuning.none_stands + hypothesis.none_stands) / (tuning.none_of + stands_before as f64);
        let unkeyed = if keyed.is_some() { tuning.slip } else { 1.0 };
        let with_height = weighed.with_height;
        let mut push = |mark: Mark, prior: f64, density: f64| {
            let weight = hypothesis.weight * prior * density;
            if weight > 0.0 {
                branches.push(Branch { parent, mark, weight, with_height });
            }
        };
        push(None, unkeyed * none_share, weighed.none);
        for (number, density) in weighed.near {
            let believed = if keyed == Some(number) { 1.0 - tuning.slip } else { 0.0 };
            // The prior of a keyed one is not shared out over the database: as much as a hundred others.
            push(Some(number), unkeyed * (1.0 - none_share) + 100.0 * believed, density);
        }
    }
    let all: f64 = branches.iter().map(|branch| branch.weight).sum();
    if all <= 0.0 {
        // Nothing fits: it stays as it was thought, and this stand is at none.
        for hypothesis in &mut came {
            hypothesis.last = [hypothesis.last[1], Some(None)];
        }
        return came;
    }
    branches.sort_by(|a, b| b.weight.total_cmp(&a.weight).then((a.parent, a.mark).cmp(&(b.parent, b.mark))));
    branches.truncate(2 * KEPT);
    branches.retain(|branch| branch.weight >= LEAST * all);
    let mut after: Vec<Hypothesis> = Vec::new();
    for branch in branches {
        let hypothesis = came[branch.parent].at(&branch, seen, markers, tuning);
        let twin = after.iter().position(|other| {
            other.last == hypothesis.last
                && (other.error.mean - hypothesis.error.mean).fixed_rows::<2>(0).norm() < ALIKE_M
        });
        match twin {
            Some(twin) => after[twin].merge(hypothesis),
            None if after.len() < KEPT => after.push(hypothesis),
            None => {}
        }
    }
    let kept: f64 = after.iter().map(|hypothesis| hypothesis.weight).sum();
    for hypothesis in &mut after {
        hypothesis.weight /= kept;
    }
    after
}

impl Hypothesis {
    /// This one, if the newest stand is where a branch says.
    fn at(
        &self,
        branch: &Branch,
        seen: &Seen,
        markers: &Markers,
        tuning: &IdentificationTuning,
    ) -> Hypothesis {
        let mut there = self.clone();
        there.weight = branch.weight;
        there.last = [self.last[1], Some(branch.mark)];
        match branch.mark {
            None => there.none_stands += 1.0,
            Some(number) => {
                let (e_m, n_m, u_m) = markers.get(number).position_n_m;
                let sigma = tuning.beside_sigma_m;
                let sigma_up = if branch.with_height && u_m.is_some() { sigma } else { 1e4 };
                let marker = Vector3::new(e_m, n_m, u_m.unwrap_or(seen.position_n_m.z));
                there.error.learn(&(seen.position_n_m - marker), &Vector3::new(sigma, sigma, sigma_up));
            }
        }
        there
    }

    fn merge(&mut self, other: Hypothesis) {
        let all = self.weight + other.weight;
        let (own, others) = (self.weight / all, other.weight / all);
        self.error.merge(self.weight, &other.error, other.weight);
        self.none_stands = self.none_stands * own + other.none_stands * others;
        for (_, share) in &mut self.came_from {
            *share *= own;
        }
        for (parent, share) in other.came_from {
            match self.came_from.iter_mut().find(|(known, _)| *known == parent) {
                Some((_, known)) => *known += share * others,
                None => self.came_from.push((parent, share * others)),
            }
        }
        self.weight = all;
    }
}

#[cfg(test)]
#[path = "hypotheses_tests.rs"]
mod tests;
