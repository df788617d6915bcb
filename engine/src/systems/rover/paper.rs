//! The straight reading of paper 5, to compare with: every epoch by itself, double differences and ranges in one adjustment (11)(12),
//! ranges without a bias and of the nearest time, weights by Helmert's components of two groups (13)–(15), whole cycles by the ratio
//! of 3.
//!
//! Single differences with free clocks give what double differences give. A component of so few redundant observations may come out
//! zero or negative; it has a floor here, or the paper's experiment could not be computed.

use nalgebra::Vector3;

use super::coupling::{CoupledAnchor, CoupledRange};
use super::differences::{Base, Pair, differences, seen};
use super::filter::Position;
use super::fixing::search;
use super::instrument::Instrument;
use super::noise::Noise;
use super::row::Quality;
use super::satellites::{Arcs, weigh};
use super::state::{POSITION, State};
use crate::gnss::ephemeris::Navigation;
use crate::gnss::satellite::Constellation;

/// Plan sigma under which whole cycles are called fixed, m.
const PLAN_SIGMA_M: f64 = 0.05;
/// Rounds of Helmert's estimate.
const ROUNDS: usize = 4;
/// Sigma of a range at first, m.
const RANGE_SIGMA_M: f64 = 0.05;
/// Components are kept within these.
const FACTORS: [f64; 2] = [0.1, 100.0];
/// A range this far from its anchor's last ones is an outlier, m: what an autoregression of slow motion would say.
const JUMP_M: f64 = 2.0;

/// What stays the same over a run.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// The base.
    pub base: &'a Base,
    /// Orbits.
    pub navigation: &'a Navigation,
    /// Systems to use.
    pub systems: &'a [Constellation],
    /// What is known beforehand.
    pub instrument: &'a Instrument,
    /// The anchors.
    pub anchors: &'a [CoupledAnchor],
    /// Receivers have two bands.
    pub two_bands: bool,
}

/// The range of each anchor that is nearest to a time, without jumps against the anchor's last one.
pub fn nearest(
    ranges: &[CoupledRange],
    anchors: usize,
    t_s: f64,
    last: &mut [Option<f64>],
) -> Vec<CoupledRange> {
    let mut found = Vec::new();
    for anchor in 0..anchors {
        let of = ranges.iter().filter(|range| range.anchor == anchor);
        let Some(range) = of.min_by(|a, b| (a.t_s - t_s).abs().total_cmp(&(b.t_s - t_s).abs())) else {
            continue;
        };
        let jumped = last[anchor].is_some_and(|last| (range.range_m - last).abs() > JUMP_M);
        last[anchor] = Some(range.range_m);
        if !jumped {
            found.push(*range);
        }
    }
    found
}

/// One epoch. `start_n` is where it is linearised; none with too few observations.
pub fn epoch(
    setting: &Setting<'_>,
    pair: Option<Pair<'_>>,
    ranges: &[CoupledRange],
    start_n: [f64; 3],
) -> Option<Position> {
    let mask = setting.instrument.gnss.elevation_mask_deg.unwrap_or(10.0).to_radians();
    let seen = pair
        .map(|pair| seen(pair, setting.base, setting.navigation, setting.systems, mask))
        .unwrap_or_default();
    if seen.len() < 3 && ranges.len() < 3 {
        return None;
    }
    let offset = Vector3::from(setting.instrument.uwb.antenna_offset_m);
    let mut at = Vector3::from(start_n);
    let mut factors = [1.0, 1.0];
    let mut answer = None;
    for _ in 0..ROUNDS {
        let mut state = State::new(&[at.x, at.y, at.z, 0.0, 0.0, 0.0], &[30.0, 30.0, 30.0, 1e-3, 1e-3, 1e-3]);
        let rows: Vec<_> = ranges
            .iter()
            .map(|range| {
                let d = at + offset - setting.anchors[range.anchor].p_n;
                let distance = d.norm().max(0.05);
                let u = d / distance;
                let row = [(POSITION, u.x), (POSITION + 1, u.y), (POSITION + 2, u.z)];
                (row, range.range_m - distance + u.dot(&at))
            })
            .collect();
        let range_variance = RANGE_SIGMA_M * RANGE_SIGMA_M * factors[1];
        for (row, value) in &rows {
            let innovation = value - state.row_value(row);
            state.update(row, innovation, range_variance);
        }
        let differences = differences(&seen, setting.base, &at);
        let mut noise =
            Noise::new(setting.two_bands, &setting.instrument.gnss, 1.0, false).scaled(factors[0]);
        let mut arcs = Arcs::default();
        let result = weigh(&mut state, &mut arcs, &differences, &at, &mut noise, 1, at.norm());
        let mut of_ranges = [0.0, 0.0];
        for (row, value) in &rows {
            let residual = value - state.row_value(row);
            of_ranges[0] += residual * residual / range_variance;
            of_ranges[1] += (1.0 - state.row_variance(row) / range_variance).clamp(0.0, 1.0);
        }
        for (factor, [squares, redundancy]) in factors.iter_mut().zip([result.fit, of_ranges]) {
            if redundancy > 0.3 {
                *factor = (*factor * squares / redundancy).clamp(FACTORS[0], FACTORS[1]);
            }
        }
        at = Vector3::new(state.x[0], state.x[1], state.x[2]);
        let found = search(&state, &arcs, &differences, &noise, at.norm());
        if let Some(whole) = &found.answer {
            whole.apply(&mut state);
        }
        let sigma_n: [f64; 3] = std::array::from_fn(|axis| state.sigma(axis));
        let fixed = found.answer.is_some() && libm::hypot(sigma_n[0], sigma_n[1]) < PLAN_SIGMA_M;
        let quality = match (fixed, result.satellites) {
            (true, _) => Quality::Fixed,
            (false, 0) => Quality::Uwb,
            (false, _) => Quality::Float,
        };
        answer = Some(Position {
            p_n: [state.x[0], state.x[1], state.x[2]],
            sigma_n,
            covariance_en_m2: state.covariance(0, 1),
            quality,
            ratio: found.ratio,
            satellites: result.satellites,
        });
    }
    answer.filter(|position| libm::hypot(position.sigma_n[0], position.sigma_n[1]) < 20.0)
}
