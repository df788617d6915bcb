//! Ranges in tight coupling: each at its own time, with a slow and a quick bias for each anchor, what a pane adds, and the offset of their clock.
//!
//! What a pane of glass adds must not go into the slow bias, or the hall behind it is off by as much. So the quick bias is loose and slow
//! while satellites are seen, and becomes quiet only for an anchor whose ranges have been quiet over epochs that satellites fixed.

use nalgebra::Vector3;

use super::state::{POSITION, RANGES, State, VELOCITY};

/// An anchor as the coupling knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct CoupledAnchor {
    /// Its name.
    pub name: String,
    /// East, north, up at the base, m.
    pub p_n: Vector3<f64>,
}

/// A range of the tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledRange {
    /// Seconds of the GPS week by the ranges' clock.
    pub t_s: f64,
    /// Which anchor.
    pub anchor: usize,
    /// Length, m.
    pub range_m: f64,
}

/// What becomes of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeOutcome {
    /// It moved the state.
    Used,
    /// Its innovation is out of what can be.
    Rejected,
}

/// How much of the sky is in sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sky {
    /// Satellites on all sides.
    Open,
    /// Few satellites, or none since a moment ago: what stands between tag and anchors changes with every step.
    Door,
    /// No satellite.
    Hall,
}

/// How the bend of a range over an uncertain position is treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bend {
    /// Not at all: the position is sharp, or what it lacks is never seen.
    Flat,
    /// By its mean and variance, as if it were new with every range.
    SecondOrder,
    /// As an error that many ranges share.
    Doubtful,
}

/// What is assumed of radios and walls.
#[derive(Clone, Copy, Debug)]
struct Tuning {
    bias_m: f64,
    bias_sigma_m: f64,
    noise_m: f64,
    clock_sigma_s: f64,
}

/// Quick bias among anchors, with no satellite in sight: correlation time s, sigma m.
const INSIDE: [f64; 2] = [1.5, 0.08];
/// With satellites in sight, before anything is learnt.
const OUTSIDE: [f64; 2] = [20.0, 0.2];
/// The quietest that is learnt, m.
const QUIET_M: f64 = 0.015;
/// What a pane or a wall adds where satellites are in sight, m: expected, sigma. It never shortens a way.
const PANE: [f64; 2] = [0.15, 0.1];
/// On the way through a door.
const DOOR: [f64; 2] = [1.5, 0.16];
/// A pane is behind or before the rover within about this time, s.
const PASSAGE_S: f64 = 0.7;
/// How much of the quick bias is new where satellites come into sight or go out of it, m.
const CHANGE_M: f64 = 0.1;
/// Random walk of the slow bias, m/√s.
const SLOW_WALK: f64 = 0.001;
/// A bias beyond so many sigmas of what radios have is no radio's.
const USUAL_SIGMAS: f64 = 2.0;
/// Innovations beyond are rejected, in sigmas.
const GATE: f64 = 4.0;
/// Ranges that share the error of the place at which they are linearised.
const SHARED: f64 = 30.0;
/// So many rejections one after the other, and the quick bias is taken to have jumped.
const JUMP: u32 = 12;

/// What is learnt of one anchor over fixed epochs.
#[derive(Clone, Copy, Debug, Default)]
struct Learnt {
    /// Running middle of what ranges have too much, m.
    middle: f64,
    /// The last one's distance from it, m.
    last: f64,
    /// Mean product of neighbours' distances from it, m², and their mean square.
    products: f64,
    squares: f64,
    last_t_s: f64,
    /// Seconds and ranges of fixed epochs behind it.
    seconds: f64,
    count: u32,
    /// Nothing stands in between.
    plain: bool,
}

/// Time over which the middle of an anchor's ranges is taken, and over which it is learnt how they move about it, s.
const MIDDLE_S: f64 = 12.0;
const MEMORY_S: f64 = 30.0;
/// Products of neighbours below which ranges are in plain view, and above which they are no more, m².
const PLAIN_M2: [f64; 2] = [0.0012, 0.0018];

impl Learnt {
    /// What the mean product is at most, two of its sigmas above what was found.
    fn at_most_m2(&self) -> f64 {
        let behind = f64::from(self.count).min(MEMORY_S / self.seconds.max(1e-3) * f64::from(self.count));
        self.products + 2.0 * self.squares / behind.max(1.0).sqrt()
    }
}

/// The ranges' part of the filter.
#[derive(Clone, Debug)]
pub struct Coupling {
    anchors: Vec<CoupledAnchor>,
    offset_n: Vector3<f64>,
    tuning: Tuning,
    learnt: Vec<Learnt>,
    rejected_in_a_row: Vec<u32>,
    /// How much of the sky is in sight.
    sky: Sky,
    /// How much of a pane stands in between, 0 to 1: it comes and goes as the rover passes the door.
    behind: f64,
    /// Ranges used, by anchor.
    pub used: Vec<usize>,
    /// Ranges rejected, by anchor.
    pub rejected: Vec<usize>,
}

impl Coupling {
    /// The anchors and what the instrument says of the tag.
    pub fn new(anchors: Vec<CoupledAnchor>, tag: &super::instrument::Tag) -> Coupling {
        let count = anchors.len();
        Coupling {
            anchors,
            offset_n: Vector3::from(tag.antenna_offset_m),
            tuning: Tuning {
                bias_m: tag.range_bias_m.unwrap_or(0.2),
                bias_sigma_m: 0.08,
                noise_m: tag.range_sigma_m.unwrap_or(0.06),
                clock_sigma_s: 0.03,
            },
            learnt: vec![Learnt::default(); count],
            rejected_in_a_row: vec![0; count],
            sky: Sky::Open,
            behind: 1.0,
            used: vec![0; count],
            rejected: vec![0; count],
        }
    }

    /// The number of states.
    pub fn states(&self) -> usize {
        3 * self.anchors.len() + 1
    }

    /// Index of the clock's offset.
    pub fn clock(&self) -> usize {
        RANGES + 3 * self.anchors.len()
    }

    /// The anchors.
    pub fn anchors(&self) -> &[CoupledAnchor] {
        &self.anchors
    }

    /// UWB antenna minus satellite antenna.
    pub fn offset_n(&self) -> Vector3<f64> {
        self.offset_n
    }

    /// Sets the priors of its states.
    pub fn start(&self, state: &mut State) {
        let tuning = &self.tuning;
        for k in 0..self.anchors.len() {
            state.reset(RANGES + 3 * k, tuning.bias_m, tuning.bias_sigma_m * tuning.bias_sigma_m);
            state.reset(RANGES + 3 * k + 1, 0.0, OUTSIDE[1] * OUTSIDE[1]);
            state.reset(RANGES + 3 * k + 2, PANE[0], PANE[1] * PANE[1]);
        }
        state.reset(self.clock(), 0.0, tuning.clock_sigma_s * tuning.clock_sigma_s);
    }

    /// Lets biases grow over a time, and says which states faded by what.
    pub fn grow(&mut self, state: &mut State, dt_s: f64, sky: Sky, in_sight: bool) -> Vec<(usize, f64)> {
        let mut factors = Vec::with_capacity(self.anchors.len());
        let changed = self.sky != sky;
        self.sky = sky;
        let aim = f64::from(u8::from(in_sight));
        self.behind += (aim - self.behind) * (1.0 - libm::exp(-dt_s / PASSAGE_S));
        for k in 0..self.anchors.len() {
            let outside_m = self.outside_sigma_m(k);
            let [time_s, sigma_m] = match sky {
                Sky::Open => [OUTSIDE[0], outside_m],
                Sky::Door => [DOOR[0], DOOR[1].min(outside_m)],
                Sky::Hall => INSIDE,
            };
            let factor = libm::exp(-dt_s / time_s);
            state.fade(RANGES + 3 * k + 1, factor, sigma_m * sigma_m * (1.0 - factor * factor));
            factors.push((RANGES + 3 * k + 1, factor));
            state.add_variance(RANGES + 3 * k, SLOW_WALK * SLOW_WALK * dt_s);
            if changed {
                let new = CHANGE_M.min(outside_m);
                state.add_variance(RANGES + 3 * k + 1, new * new);
            }
        }
        factors
    }

    /// Decides which anchors are in plain view.
    pub fn judge(&mut self, state: &mut State) {
        for k in 0..self.anchors.len() {
            // Ranges that stay the same while the rover moves in sight of satellites come through nothing.
            let learnt = &mut self.learnt[k];
            let pane = RANGES + 3 * k + 2;
            // But what stays the same and is more than radios have is a pane after all: into the hall it must not go.
            let sum_m = state.x[RANGES + 3 * k] + state.x[pane];
            let usual = sum_m < self.tuning.bias_m + USUAL_SIGMAS * self.tuning.bias_sigma_m;
            if !learnt.plain && usual && learnt.seconds > 12.0 && learnt.at_most_m2() < PLAIN_M2[0] {
                learnt.plain = true;
                let innovation = -state.x[pane];
                state.update(&[(pane, 1.0)], innovation, 0.02 * 0.02);
            } else if learnt.plain && learnt.products > PLAIN_M2[1] {
                learnt.plain = false;
                state.reset(pane, PANE[0], PANE[1] * PANE[1]);
            }
        }
    }

    /// How large the quick bias of an anchor is with satellites in sight.
    fn outside_sigma_m(&self, k: usize) -> f64 {
        if self.learnt[k].plain { QUIET_M } else { OUTSIDE[1] }
    }

    /// Takes a range at the state's time.
    pub fn weigh(
        &mut self,
        state: &mut State,
        range: &CoupledRange,
        fixed: bool,
        bend: Bend,
    ) -> RangeOutcome {
        let k = range.anchor;
        let (slow, quick, pane, clock) =
            (RANGES + 3 * k, RANGES + 3 * k + 1, RANGES + 3 * k + 2, self.clock());
        let v = Vector3::new(state.x[VELOCITY], state.x[VELOCITY + 1], state.x[VELOCITY + 2]);
        let p = Vector3::new(state.x[POSITION], state.x[POSITION + 1], state.x[POSITION + 2]);
        // What was stamped late belongs to an earlier place.
        let d = p - v * state.x[clock] + self.offset_n - self.anchors[k].p_n;
        let distance = d.norm().max(0.05);
        let u = d / distance;
        let row = [
            (POSITION, u.x),
            (POSITION + 1, u.y),
            (POSITION + 2, u.z),
            (slow, 1.0),
            (quick, 1.0),
            (pane, self.behind),
            (clock, -u.dot(&v)),
        ];
        let behind = self.behind * state.x[pane];
        let mut innovation = range.range_m - distance - state.x[slow] - state.x[quick] - behind;
        let mut noise = self.tuning.noise_m * self.tuning.noise_m;
        // A filter that lags in a turn looks like a clock that is late: only where satellites say where the rover is can the
        // offset be learnt. Elsewhere it is an uncertainty, and stays what it is.
        let row = if fixed {
            &row[..]
        } else {
            let late = row[6].1;
            noise += late * late * state.covariance(clock, clock);
            &row[..6]
        };
        if bend != Bend::Flat {
            let (mean, variance) = second_order(state, &u, distance);
            if bend == Bend::SecondOrder {
                innovation -= mean;
                noise += variance;
            } else {
                noise += SHARED * (mean * mean + variance);
            }
        }
        let variance = state.row_variance(row) + noise;
        if innovation * innovation > GATE * GATE * variance {
            self.rejected[k] += 1;
            self.rejected_in_a_row[k] += 1;
            if self.rejected_in_a_row[k] >= JUMP {
                state.add_variance(quick, 0.25);
                self.rejected_in_a_row[k] = 0;
            }
            return RangeOutcome::Rejected;
        }
        self.rejected_in_a_row[k] = 0;
        if fixed {
            self.learn(k, range.t_s, range.range_m - distance);
        }
        // Between three and four sigmas a range counts less.
        let normal = innovation.abs() / variance.sqrt();
        if normal > 2.5 {
            noise += variance * (normal / 2.5 - 1.0);
        }
        state.update(row, innovation, noise);
        self.used[k] += 1;
        RangeOutcome::Used
    }

    fn learn(&mut self, k: usize, t_s: f64, residual_m: f64) {
        let learnt = &mut self.learnt[k];
        let dt_s = t_s - learnt.last_t_s;
        learnt.last_t_s = t_s;
        if learnt.count == 0 || !(0.0..2.0).contains(&dt_s) {
            learnt.middle = if learnt.count == 0 { residual_m } else { learnt.middle };
            learnt.last = residual_m - learnt.middle;
            learnt.count += 1;
            return;
        }
        learnt.count += 1;
        learnt.seconds += dt_s;
        let share = (1.0 - libm::exp(-dt_s / MIDDLE_S)).max(1.0 / f64::from(learnt.count));
        learnt.middle += share * (residual_m - learnt.middle);
        // White noise is in no product of neighbours; what lasts longer than from one to the next is.
        let off = (residual_m - learnt.middle).clamp(-0.5, 0.5);
        let share = (1.0 - libm::exp(-dt_s / MEMORY_S)).max(1.0 / f64::from(learnt.count));
        learnt.products += share * (off * learnt.last - learnt.products);
        learnt.squares += share * (off * off - learnt.squares);
        learnt.last = off;
    }
}

/// What the bend of a range adds to its mean and variance for a position that is uncertain (½ tr(BP), ½ tr(BPBP)).
fn second_order(state: &State, u: &Vector3<f64>, distance: f64) -> (f64, f64) {
    let p = nalgebra::Matrix3::from_fn(|i, j| state.covariance(i, j));
    let b = (nalgebra::Matrix3::identity() - u * u.transpose()) / distance;
    let bp = b * p;
    (0.5 * bp.trace(), 0.5 * (bp * bp).trace())
}

/// Where a search for the tag begins, east and north: around the anchors, amid them, and where the circles of each two meet. Across the
/// line of two anchors lies a place that fits these two as well, and a search that begins outside may end in no other.
fn starts(anchors: &[CoupledAnchor], middles: &[(usize, f64)], center: &Vector3<f64>) -> Vec<[f64; 2]> {
    let mut all = vec![[center.x, center.y]];
    for k in 0..16 {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 16.0);
        all.push([center.x + middles[0].1 * sin, center.y + middles[0].1 * cos]);
    }
    for (i, &(a, from_a)) in middles.iter().enumerate() {
        for &(b, from_b) in &middles[i + 1..] {
            let line = (anchors[b].p_n - anchors[a].p_n).xy();
            let length = line.norm().max(0.1);
            // From a along the line, and off it.
            let along = (length * length + from_a * from_a - from_b * from_b) / (2.0 * length);
            let off = (from_a * from_a - along * along).max(0.0).sqrt();
            let unit = line / length;
            for side in [-off, off] {
                let meeting = anchors[a].p_n.xy() + unit * along;
                all.push([meeting.x - side * unit.y, meeting.y + side * unit.x]);
            }
        }
    }
    all
}

/// Where ranges alone put the tag: the best of many starts around the anchors, at a height near theirs. None of fewer than three anchors.
pub fn locate(coupling: &Coupling, ranges: &[CoupledRange], height_m: Option<f64>) -> Option<Vector3<f64>> {
    let anchors = coupling.anchors();
    let mut middles: Vec<(usize, f64)> = Vec::new();
    for k in 0..anchors.len() {
        let mut of: Vec<f64> =
            ranges.iter().filter(|range| range.anchor == k).map(|range| range.range_m).collect();
        of.sort_by(f64::total_cmp);
        if let Some(middle) = of.get(of.len() / 2) {
            middles.push((k, middle - coupling.tuning.bias_m));
        }
    }
    if middles.len() < 3 {
        return None;
    }
    let center = anchors.iter().map(|anchor| anchor.p_n).sum::<Vector3<f64>>() / anchors.len() as f64;
    let height = height_m.unwrap_or(center.z);
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for [e, n] in starts(anchors, &middles, &center) {
        let mut p = Vector3::new(e, n, height);
        for _ in 0..25 {
            let mut n = nalgebra::Matrix2::<f64>::identity() * 1e-4;
            let mut g = nalgebra::Vector2::<f64>::zeros();
            for &(k, range) in &middles {
                let d = p - anchors[k].p_n;
                let distance = d.norm().max(0.1);
                let u = nalgebra::Vector2::new(d.x, d.y) / distance;
                let off = range - distance;
                let weight = 1.0 / (1.0 + off * off);
                n += u * u.transpose() * weight;
                g += u * (off * weight);
            }
            let step = n.try_inverse()? * g;
            p.x += step.x;
            p.y += step.y;
        }
        let cost: f64 =
            middles.iter().map(|&(k, range)| ((p - anchors[k].p_n).norm() - range).abs().min(5.0)).sum();
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, p));
        }
    }
    best.map(|(_, p)| p - coupling.offset_n)
}

#[cfg(test)]
mod tests {
    use super::super::instrument::Tag;
    use super::*;

    #[test]
    fn a_tag_amid_three_anchors_is_not_taken_for_its_mirror_image() {
        let places = [[9.57, -16.57, 2.84], [3.87, 3.82, 2.89], [-14.52, -2.53, 1.23]];
        let anchors: Vec<CoupledAnchor> = places
            .iter()
            .map(|place| CoupledAnchor { name: format!("{}", place[0]), p_n: Vector3::from(*place) })
            .collect();
        let coupling = Coupling::new(anchors.clone(), &Tag::default());
        for k in 0..20 {
            let truth = Vector3::new(f64::from(k) - 8.0, -1.0 - 0.3 * f64::from(k), -0.2);
            let ranges: Vec<CoupledRange> = (0..3)
                .map(|anchor| CoupledRange {
                    t_s: 0.0,
                    anchor,
                    range_m: (truth - anchors[anchor].p_n).norm() + 0.2,
                })
                .collect();
            let found = locate(&coupling, &ranges, None).expect("three anchors");
            assert!((found - truth).xy().norm() < 1.5, "{truth:?} {found:?}");
        }
    }
}
