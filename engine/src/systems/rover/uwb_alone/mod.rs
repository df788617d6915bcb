//! A tag among anchors, without satellites: ranges in, positions out.
//!
//! Several filters run beside each other, each with a model of the ranges and of the motion ([`model`]) and from each
//! place that explains the first second of ranges ([`start`]). How likely the ranges were under each decides how much
//! it counts: no noise is set for a radio or a carrier. A gross error is rejected by its innovation; where a filter
//! loses the tag it is looked for anew.

mod filter;
mod model;
mod start;
mod tape;
#[cfg(test)]
mod tests;

use crate::sample::SurveyedAnchor;
use crate::systems::rover::anchors::AntennaHeight;
use filter::{Filter, Start};
use model::Model;
use start::Heard;
use tape::{Entry, Tape};

/// What is expected of a tag's ranges where nobody says anything, m: all radios that were met read too far.
pub const EXPECTED_BIAS_M: f64 = 0.15;
/// The window that a start looks at, s.
const WINDOW_S: f64 = 1.2;
/// Likelihoods are forgotten with this time, s: a carrier that stood may go.
const FORGET_S: f64 = 120.0;
/// A filter that is less likely than the best by this, as a logarithm, does not count.
const HOPELESS: f64 = 40.0;
/// Longer than this without a range is a silence, s.
const SILENCE_S: f64 = 3.0;
/// An anchor stands behind a point for so long, s.
const FRESH_S: f64 = 0.5;

/// What is said about a tag.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UwbSettings {
    /// Height of the tag's antenna in the anchors' frame, m.
    pub antenna_height_m: Option<f64>,
    /// Its sigma, m.
    pub antenna_height_sigma_m: Option<f64>,
    /// White noise of a range, m.
    pub range_sigma_m: Option<f64>,
    /// What ranges read too far, m.
    pub range_bias_m: Option<f64>,
    /// Where the tag is at first, m.
    pub initial_position_m: Option<[f64; 3]>,
}

/// A range of the tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UwbRange {
    /// When, ns.
    pub t_ns: i64,
    /// To which anchor, an index into the anchors.
    pub anchor: usize,
    /// How far, m.
    pub range_m: f64,
}

/// A position of the tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UwbPoint {
    /// When, ns.
    pub t_ns: i64,
    /// Where, in the anchors' frame, m.
    pub p_n: [f64; 3],
    /// How sure, m².
    pub covariance: [[f64; 3]; 3],
    /// How many anchors stand behind it; none: it is only predicted.
    pub anchors: usize,
}

/// What became of an anchor's ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnchorUse {
    /// Ranges that were used.
    pub used: u64,
    /// Ranges that were rejected, those that failed included.
    pub rejected: u64,
    /// What its ranges have too much, m.
    pub bias_m: f64,
    /// Sigma of that bias, m.
    pub bias_sigma_m: f64,
    /// White noise of its ranges as learnt, m.
    pub sigma_m: f64,
    /// Quick bias at the end, m.
    pub quick_bias_m: f64,
}

/// How badly the best place explains the ranges of a second or so (anchor and length), in squared sigmas; `None` where
/// fewer than four anchors answer.
pub(super) fn window_cost(
    window: &[(usize, f64)],
    anchors: &[SurveyedAnchor],
    height: &AntennaHeight,
    bias_m: f64,
) -> Option<f64> {
    let heard: Vec<Heard> = window
        .iter()
        .map(|(anchor, range_m)| Heard { t_s: 0.0, anchor: *anchor, range_m: *range_m })
        .collect();
    start::least_cost(&heard, anchors, height, bias_m)
}

#[derive(Clone, Debug)]
struct Member {
    filter: Filter,
    /// Which start it came from.
    place: usize,
    /// Logarithm of its weight, with and without forgetting.
    recent: f64,
    total: f64,
}

/// A start or a new start, which smoothing repeats.
#[derive(Clone, Copy, Debug)]
struct Restarted {
    /// Before this range.
    range: usize,
    place: Start,
}

/// The positions of a tag from its ranges alone.
#[derive(Clone, Debug)]
pub struct UwbAlone {
    anchors: Vec<SurveyedAnchor>,
    height: AntennaHeight,
    settings: UwbSettings,
    bias_m: f64,
    members: Vec<Member>,
    first_places: Vec<Start>,
    restarts: Vec<Restarted>,
    ranges: Vec<UwbRange>,
    t0_ns: Option<i64>,
    window: Vec<Heard>,
    uses: Vec<AnchorUse>,
    last_used_s: Vec<f64>,
    /// Newest ranges: time, and whether the best filter used it.
    recent_fate: std::collections::VecDeque<(f64, bool)>,
    started_ns: Option<i64>,
    /// When ranges came again after a silence; `None` once the tag has been looked for.
    silent_until_s: Option<f64>,
}

impl UwbAlone {
    /// A tag among these anchors.
    pub fn new(anchors: Vec<SurveyedAnchor>, settings: UwbSettings) -> UwbAlone {
        let height = AntennaHeight::of(settings.antenna_height_m, settings.antenna_height_sigma_m, &anchors);
        UwbAlone {
            height,
            bias_m: settings.range_bias_m.unwrap_or(EXPECTED_BIAS_M),
            uses: vec![AnchorUse::default(); anchors.len()],
            last_used_s: vec![f64::NEG_INFINITY; anchors.len()],
            anchors,
            settings,
            members: Vec::new(),
            first_places: Vec::new(),
            restarts: Vec::new(),
            ranges: Vec::new(),
            t0_ns: None,
            window: Vec::new(),
            recent_fate: std::collections::VecDeque::new(),
            started_ns: None,
            silent_until_s: None,
        }
    }

    /// When the tag was found, ns; `None` where it was not.
    pub fn started_ns(&self) -> Option<i64> {
        self.started_ns
    }

    /// How often the tag was lost and found anew.
    pub fn restarts(&self) -> usize {
        self.restarts.len()
    }

    /// What became of each anchor's ranges.
    pub fn anchors(&self) -> Vec<AnchorUse> {
        let mut uses = self.uses.clone();
        if let Some(best) = self.best() {
            for (k, anchor) in uses.iter_mut().enumerate() {
                (anchor.bias_m, anchor.bias_sigma_m) = self.members[best].filter.bias(k);
                anchor.sigma_m = self.members[best].filter.range_sigma(k);
                anchor.quick_bias_m = self.members[best].filter.quick_bias(k);
            }
        }
        uses
    }

    /// Takes the ranges of one time and tells where the tag is, once that is known.
    ///
    /// # Panics
    ///
    /// Where an anchor's index is none of the anchors'.
    pub fn push(&mut self, ranges: &[UwbRange]) -> Option<UwbPoint> {
        let t_ns = ranges.first()?.t_ns;
        let t0_ns = *self.t0_ns.get_or_insert(t_ns);
        let t_s = (t_ns - t0_ns) as f64 * 1e-9;
        if self.ranges.last().is_some_and(|last| (t_ns - last.t_ns) as f64 * 1e-9 > SILENCE_S) {
            self.silent_until_s = Some(t_s);
        }
        for range in ranges {
            if !(range.range_m.is_finite() && range.range_m > 0.0) {
                self.uses[range.anchor].rejected += 1;
                continue;
            }
            self.window.push(Heard { t_s, anchor: range.anchor, range_m: range.range_m });
            self.ranges.push(*range);
            if !self.members.is_empty() {
                self.weigh(self.ranges.len() - 1, t_s);
            }
        }
        self.window.retain(|heard| heard.t_s > t_s - WINDOW_S);
        if self.members.is_empty() {
            self.start(t_s);
        } else {
            self.find_lost(t_s);
        }
        if self.members.is_empty() {
            return None;
        }
        for member in &mut self.members {
            member.filter.propagate(t_s, None);
        }
        Some(self.point(t_ns, t_s))
    }

    fn models(&self) -> Vec<Model> {
        model::bank(self.height.known, self.settings.range_sigma_m)
    }

    fn start(&mut self, t_s: f64) {
        let Some(first) = self.window.first().copied() else { return };
        let places: Vec<Start> = match self.settings.initial_position_m {
            Some(p_n) => vec![Start { p_n, sigma_m: [1.0, 1.0, self.height.sigma_m], speed_m_s: 1.5 }],
            None if t_s - first.t_s < 0.5 * WINDOW_S => return,
            None => start::places(&self.window, &self.anchors, &self.height, self.bias_m)
                .into_iter()
                .map(|place| place.start)
                .collect(),
        };
        if places.is_empty() {
            return;
        }
        // The window is gone over again from its beginning; what came before it found no place.
        let begin = self.ranges.len() - self.window.len();
        self.ranges.drain(..begin);
        for anchor in &mut self.uses {
            anchor.rejected += anchor.used;
            anchor.used = 0;
        }
        let members = self.members_at(&places, first.t_s);
        self.members = members;
        self.first_places = places;
        let t0_ns = self.t0_ns.unwrap_or_default();
        self.started_ns = Some(t0_ns + (t_s * 1e9) as i64);
        for k in 0..self.ranges.len() {
            let t_s = (self.ranges[k].t_ns - t0_ns) as f64 * 1e-9;
            self.weigh(k, t_s);
        }
    }

    fn members_at(&self, places: &[Start], t_s: f64) -> Vec<Member> {
        let mut members = Vec::new();
        for (number, place) in places.iter().enumerate() {
            for model in self.models() {
                let filter = Filter::new(model, self.height, self.bias_m, self.anchors.len(), t_s, place);
                members.push(Member {
                    filter,
                    place: number,
                    recent: model.log_prior,
                    total: model.log_prior,
                });
            }
        }
        members
    }

    fn weigh(&mut self, k: usize, t_s: f64) {
        let range = self.ranges[k];
        let before = if k > 0 { self.ranges[k - 1].t_ns } else { range.t_ns };
        let keep = libm::exp(-((range.t_ns - before) as f64 * 1e-9) / FORGET_S);
        let best = self.best().unwrap_or_default();
        for (number, member) in self.members.iter_mut().enumerate() {
            member.filter.propagate(t_s, None);
            let anchor_n = &self.anchors[range.anchor].p_n;
            let weighed = member.filter.weigh(range.anchor, anchor_n, range.range_m, None);
            member.recent = member.recent * keep + weighed.log_likelihood;
            member.total += weighed.log_likelihood;
            if number == best {
                let anchor = &mut self.uses[range.anchor];
                if weighed.used {
                    anchor.used += 1;
                    self.last_used_s[range.anchor] = t_s;
                } else {
                    anchor.rejected += 1;
                }
                self.recent_fate.push_back((t_s, weighed.used));
            }
        }
        self.drop_places(t_s);
    }

    /// Lets go of starts that the ranges have refuted.
    fn drop_places(&mut self, t_s: f64) {
        const MANY: usize = 40;
        if self.first_places.len() < 2 || !self.ranges.len().is_multiple_of(MANY) || t_s < 2.0 {
            return;
        }
        let best_of = |place: usize| {
            self.members.iter().filter(|m| m.place == place).map(|m| m.recent).fold(f64::MIN, f64::max)
        };
        let tops: Vec<f64> = (0..self.first_places.len()).map(best_of).collect();
        let top = tops.iter().copied().fold(f64::MIN, f64::max);
        self.members.retain(|member| tops[member.place] > top - HOPELESS);
    }

    fn best(&self) -> Option<usize> {
        (0..self.members.len()).max_by(|a, b| self.members[*a].recent.total_cmp(&self.members[*b].recent))
    }

    /// Where most ranges are rejected, the tag is looked for anew.
    fn find_lost(&mut self, t_s: f64) {
        const LOOK_BACK_S: f64 = 3.0;
        const FEWEST: usize = 10;
        while self.recent_fate.front().is_some_and(|(t, _)| *t < t_s - LOOK_BACK_S) {
            self.recent_fate.pop_front();
        }
        let used = self.recent_fate.iter().filter(|(_, used)| *used).count();
        let rejected = self.recent_fate.len() >= FEWEST && used * 5 <= self.recent_fate.len() * 2;
        // After a silence the tag may be anywhere, and ranges bend too much to lead back from there.
        let silent = self.silent_until_s.is_some_and(|from| t_s > from + 0.5 * WINDOW_S);
        if !rejected && !silent {
            return;
        }
        let places = start::places(&self.window, &self.anchors, &self.height, self.bias_m);
        let Some(place) = places.first().filter(|place| place.anchors >= 3) else { return };
        if silent {
            self.silent_until_s = None;
            if !rejected && self.best_is_near(&place.start.p_n) {
                return;
            }
        }
        self.recent_fate.clear();
        for member in &mut self.members {
            member.filter.propagate(t_s, None);
            member.filter.restart(&place.start, None);
        }
        self.restarts.push(Restarted { range: self.ranges.len(), place: place.start });
    }

    /// Whether the best filter is where the newest ranges are.
    fn best_is_near(&self, p_n: &[f64; 3]) -> bool {
        const NEAR_M: f64 = 3.0;
        self.best().is_some_and(|best| {
            let own = self.members[best].filter.p_n();
            (own[0] - p_n[0]).abs() < NEAR_M && (own[1] - p_n[1]).abs() < NEAR_M
        })
    }

    /// The mixture of all filters.
    fn point(&self, t_ns: i64, t_s: f64) -> UwbPoint {
        let top = self.members.iter().map(|m| m.recent).fold(f64::MIN, f64::max);
        let weights: Vec<f64> = self.members.iter().map(|m| libm::exp((m.recent - top).max(-80.0))).collect();
        let sum: f64 = weights.iter().sum();
        let mut p_n = [0.0; 3];
        for (member, weight) in self.members.iter().zip(&weights) {
            let p = member.filter.p_n();
            for k in 0..3 {
                p_n[k] += weight / sum * p[k];
            }
        }
        let mut covariance = [[0.0; 3]; 3];
        for (member, weight) in self.members.iter().zip(&weights) {
            let (p, c) = (member.filter.p_n(), member.filter.covariance());
            for i in 0..3 {
                for j in 0..3 {
                    covariance[i][j] += weight / sum * (c[i][j] + (p[i] - p_n[i]) * (p[j] - p_n[j]));
                }
            }
        }
        let anchors = self.last_used_s.iter().filter(|used| t_s - **used < FRESH_S).count();
        UwbPoint { t_ns, p_n, covariance, anchors }
    }

    /// The points by all of the ranges, in order of time: one for each time at which a range came.
    pub fn smoothed(&self) -> Vec<UwbPoint> {
        let best = self.members.iter().max_by(|a, b| a.total.total_cmp(&b.total));
        let (Some(best), Some(t0_ns), Some(first)) = (best, self.t0_ns, self.ranges.first()) else {
            return Vec::new();
        };
        let seconds = |t_ns: i64| (t_ns - t0_ns) as f64 * 1e-9;
        let place = &self.first_places[best.place];
        let mut filter = Filter::new(
            best.filter.model,
            self.height,
            self.bias_m,
            self.anchors.len(),
            seconds(first.t_ns),
            place,
        );
        let mut tape = Tape::default();
        let mut points: Vec<UwbPoint> = Vec::new();
        let mut last_used_s = vec![f64::NEG_INFINITY; self.anchors.len()];
        let mut restarts = self.restarts.iter().peekable();
        for (k, range) in self.ranges.iter().enumerate() {
            let t_s = seconds(range.t_ns);
            while let Some(restart) = restarts.next_if(|restart| restart.range <= k) {
                filter.restart(&restart.place, Some(&mut tape));
            }
            filter.propagate(t_s, Some(&mut tape));
            let anchor_n = &self.anchors[range.anchor].p_n;
            let weighed = filter.weigh(range.anchor, anchor_n, range.range_m, Some(&mut tape));
            if weighed.used {
                last_used_s[range.anchor] = t_s;
            }
            if self.ranges.get(k + 1).is_none_or(|next| next.t_ns > range.t_ns) {
                let anchors = last_used_s.iter().filter(|used| t_s - **used < FRESH_S).count();
                let (p_n, covariance) = (filter.p_n(), filter.covariance());
                tape.push(Entry::Point { number: points.len(), p_n, rows: filter.position_rows() });
                points.push(UwbPoint { t_ns: range.t_ns, p_n, covariance, anchors });
            }
        }
        for smoothed in tape.smooth(filter.states()) {
            points[smoothed.number].p_n = smoothed.p_n;
            points[smoothed.number].covariance = smoothed.covariance;
        }
        points
    }
}
