//! A tag that the filter has lost: with one anchor silent the mirror image across the other two takes over, and what speaks
//! against it is rejected as gross. Then the ranges of the last second are asked anew.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::coupling::{CoupledRange, Coupling, RangeOutcome, locate};
use super::state::{POSITION, RANGES, State, VELOCITY};

/// How far back it is looked, s.
const WINDOW_S: f64 = 1.5;
/// So many rejections of one anchor among them are no accident.
const REJECTED: usize = 4;
/// A residual beyond counts no more, m.
const MOST_M: f64 = 2.0;
/// The sigma of a place that is found anew, m, and of the velocity there, m/s.
const PLACE_M: f64 = 0.7;
const SPEED_M_S: f64 = 1.2;

/// The newest ranges and what became of them.
#[derive(Clone, Debug, Default)]
pub struct LostTag {
    recent: VecDeque<(CoupledRange, bool)>,
    /// How often the tag was found anew.
    pub found: usize,
}

impl LostTag {
    /// Takes a range among anchors alone, and puts the state to another place where the newest ranges are there and not here.
    pub fn take(
        &mut self,
        range: &CoupledRange,
        outcome: RangeOutcome,
        state: &mut State,
        coupling: &Coupling,
    ) {
        while self.recent.front().is_some_and(|(first, _)| first.t_s < range.t_s - WINDOW_S) {
            self.recent.pop_front();
        }
        self.recent.push_back((*range, outcome == RangeOutcome::Used));
        if outcome == RangeOutcome::Used {
            return;
        }
        let rejected =
            self.recent.iter().filter(|(other, used)| other.anchor == range.anchor && !used).count();
        let used = self.recent.iter().filter(|(other, used)| other.anchor == range.anchor && *used).count();
        if rejected < REJECTED || used >= rejected {
            return;
        }
        let window: Vec<CoupledRange> = self.recent.iter().map(|(range, _)| *range).collect();
        let offset = coupling.offset_n();
        let here = Vector3::new(state.x[POSITION], state.x[POSITION + 1], state.x[POSITION + 2]);
        let Some(there) = locate(coupling, &window, Some(here.z + offset.z)) else { return };
        let cost = |p: &Vector3<f64>| -> f64 {
            let tag = p + offset;
            let residual = |one: &CoupledRange| {
                let length = (tag - coupling.anchors()[one.anchor].p_n).norm();
                (one.range_m - state.x[RANGES + 3 * one.anchor] - length).abs().min(MOST_M)
            };
            window.iter().map(|one| residual(one).powi(2)).sum::<f64>() / window.len() as f64
        };
        let (cost_here, cost_there) = (cost(&here), cost(&there));
        if cost_there > 0.3 * cost_here || cost_there.sqrt() > PLACE_M {
            return;
        }
        for axis in 0..2 {
            state.reset(POSITION + axis, there[axis], PLACE_M * PLACE_M);
            state.reset(VELOCITY + axis, 0.0, SPEED_M_S * SPEED_M_S);
        }
        self.recent.clear();
        self.found += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::super::coupling::CoupledAnchor;
    use super::super::instrument::Tag;
    use super::*;

    #[test]
    fn the_mirror_image_is_left_once_the_third_anchor_has_spoken() {
        let places = [[0.0, 0.0], [10.0, 0.0], [5.0, 9.0]];
        let anchors: Vec<CoupledAnchor> = places
            .iter()
            .map(|[e, n]| CoupledAnchor { name: format!("{e}"), p_n: Vector3::new(*e, *n, 1.0) })
            .collect();
        let coupling = Coupling::new(anchors.clone(), &Tag::default());
        let truth = Vector3::new(4.0, 3.0, 1.0);
        // Across the line of the first two.
        let mut state = State::new(&[4.0, -3.0, 1.0, 0.0, 0.0, 0.0], &[0.2; 6]);
        state.push_many(coupling.states(), 0.01);
        coupling.start(&mut state);
        let mut lost = LostTag::default();
        for k in 0..12_usize {
            let anchor = k % 3;
            let range = CoupledRange {
                t_s: 0.1 * k as f64,
                anchor,
                range_m: (truth - anchors[anchor].p_n).norm() + 0.2,
            };
            let outcome = if anchor == 2 { RangeOutcome::Rejected } else { RangeOutcome::Used };
            lost.take(&range, outcome, &mut state, &coupling);
        }
        assert_eq!(lost.found, 1);
        assert!((state.x[0] - 4.0).abs() < 0.2 && (state.x[1] - 3.0).abs() < 0.2, "{:?}", &state.x[..2]);
        assert!(state.sigma(0) > 0.5);
    }
}
