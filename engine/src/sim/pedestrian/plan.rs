//! From a course to footholds and times: which foot goes when, where, and how long both stand.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::foot_motion::FootMotion;
use super::gait::{Foothold, Gait};
use super::path::Path;
use super::rest::Rest;
use super::swing::Swing;
use super::walk::Walker;
use crate::geo::terrain::Anchor;
use crate::sim::motion::Kinematics;
use crate::sim::random::{Purpose, Random};

/// A stretch of a course in one gait.
#[derive(Clone, Debug)]
pub(crate) struct Leg {
    /// Where along the path it ends, m.
    pub(crate) until_m: f64,
    pub(crate) gait: Gait,
    /// Number of steps, where it is not free (stairs have treads).
    pub(crate) steps: Option<usize>,
    /// A stop at its end with both feet side by side.
    pub(crate) stop: Option<Stop>,
}

/// A stop.
#[derive(Clone, Debug)]
pub(crate) struct Stop {
    pub(crate) seconds: f64,
    /// The marker beside which it is.
    pub(crate) marker: Option<Anchor>,
}

/// What is to be walked.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) path: Path,
    /// Standing before the first step, s.
    pub(crate) standing_start_s: f64,
    pub(crate) legs: Vec<Leg>,
    /// The walk is stood out to this time, s.
    pub(crate) stand_until_s: Option<f64>,
    /// Whether the middle of the feet stands at 0, 0, 0 at the start, rather than where the path lies.
    pub(crate) starts_at_origin: bool,
}

/// A stop at a marker.
#[derive(Clone, Debug)]
pub(crate) struct PlannedVisit {
    pub(crate) marker: Anchor,
    pub(crate) t_from_s: f64,
    pub(crate) t_to_s: f64,
}

/// A stretch of one foot's time.
#[derive(Clone, Debug)]
pub(crate) enum Phase {
    Rest(Rest),
    Swing(Box<Swing>),
}

impl Phase {
    pub(crate) fn t_to_s(&self) -> f64 {
        match self {
            Phase::Rest(rest) => rest.t_to_s,
            Phase::Swing(swing) => swing.t_to_s,
        }
    }

    pub(crate) fn is_stance(&self) -> bool {
        matches!(self, Phase::Rest(_))
    }

    pub(crate) fn at(&self, t_s: f64) -> Kinematics {
        match self {
            Phase::Rest(rest) => rest.at(t_s),
            Phase::Swing(swing) => swing.at(t_s),
        }
    }
}

/// A whole walk, planned.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Left, right: without gaps, from time 0 to `end_s`.
    pub(crate) feet: [FootMotion; 2],
    pub(crate) visits: Vec<PlannedVisit>,
    /// The path, where it was walked.
    pub(crate) path: Path,
    pub(crate) end_s: f64,
}

/// Footholds are still for at least so long, s.
const SHORTEST_REST_S: f64 = 0.08;

struct Planner<'a> {
    walker: &'a Walker,
    path: Path,
    timing: Random,
    gait: [Random; 2],
    micro_motion: [Random; 2],
    /// Where each foot stands, and since when.
    standing: [(Foothold, f64); 2],
    phases: [Vec<Phase>; 2],
    next_foot: usize,
    landing_s: f64,
}

/// Plans a course.
pub(crate) fn plan(course: Course, walker: &Walker, seed: u64) -> Plan {
    let mut gait = [0, 1].map(|foot| Random::new(seed, foot, Purpose::Gait));
    let mut path = course.path;
    let mut standing =
        [0, 1].map(|foot| (foothold(&path, walker, foot, 0.0, Gait::Walk, &mut gait[foot]), 0.0));
    if course.starts_at_origin {
        let shift = -0.5 * (standing[0].0.sensor_n_m() + standing[1].0.sensor_n_m());
        path = path.shifted(shift);
        for (foothold, _) in &mut standing {
            foothold.origin_n_m += shift;
        }
    }
    let mut planner = Planner {
        walker,
        path,
        timing: Random::new(seed, Random::COMMON, Purpose::Timing),
        gait,
        micro_motion: [0, 1].map(|foot| Random::new(seed, foot, Purpose::MicroMotion)),
        standing,
        phases: [Vec::new(), Vec::new()],
        next_foot: 1,
        landing_s: 0.0,
    };
    let mut visits = Vec::new();
    let mut along_m = 0.0;
    let mut stop_ends_s = Some(course.standing_start_s);
    for leg in &course.legs {
        let (step_m, _) = walker.step(leg.gait);
        let length_m = leg.until_m - along_m;
        let steps = leg.steps.unwrap_or_else(|| libm::round(length_m / step_m).max(1.0) as usize);
        for step in 1..=steps {
            let to_m = along_m + length_m * step as f64 / steps as f64;
            planner.step(to_m, leg.gait, stop_ends_s.take());
        }
        along_m = leg.until_m;
        if let Some(stop) = &leg.stop {
            // The other foot comes beside.
            planner.step(along_m, leg.gait, None);
            let ends_s = planner.landing_s + stop.seconds;
            if let Some(marker) = &stop.marker {
                let t_from_s = planner.landing_s;
                visits.push(PlannedVisit { marker: marker.clone(), t_from_s, t_to_s: ends_s });
            }
            stop_ends_s = Some(ends_s);
        }
    }
    let planned_s = stop_ends_s.unwrap_or(planner.landing_s + 1.0);
    let end_s = course.stand_until_s.map_or(planned_s, |until_s| planned_s.max(until_s));
    planner.finish(end_s, visits)
}

/// Where a foot is put down that follows the path to this length.
fn foothold(
    path: &Path,
    walker: &Walker,
    foot: usize,
    along_m: f64,
    gait: Gait,
    random: &mut Random,
) -> Foothold {
    let here = path.at(along_m);
    let (sin, cos) = libm::sincos(here.yaw);
    let on_stairs = matches!(gait, Gait::StairsUp | Gait::StairsDown);
    let (pitch_rad, raised_m) = gait.stands_pitched();
    let astray = |random: &mut Random, sigma: f64| sigma * random.normal().clamp(-2.0, 2.0);
    let aside_m = side(foot) * (walker.half_separation_m + astray(random, 0.008));
    let ahead_m = astray(random, if on_stairs { 0.008 } else { 0.02 });
    Foothold {
        origin_n_m: here.position_n_m
            + Vector3::new(
                ahead_m * cos - aside_m * sin,
                ahead_m * sin + aside_m * cos,
                ahead_m * here.slope + raised_m,
            ),
        angles: [
            here.yaw + side(foot) * walker.toe_out_rad + astray(random, 0.03),
            pitch_rad - libm::atan(here.slope) + astray(random, 0.01),
            astray(random, 0.015),
        ],
        along_m,
    }
}

/// Left of the path is positive.
fn side(foot: usize) -> f64 {
    if foot == 0 { 1.0 } else { -1.0 }
}

impl Planner<'_> {
    /// The next foot goes to a length along the path; after a stop it lifts when the stop ends.
    fn step(&mut self, along_m: f64, gait: Gait, stop_ends_s: Option<f64>) {
        let foot = self.next_foot;
        self.next_foot = 1 - foot;
        let shape = gait.shape();
        let (step_m, cycle_s) = self.walker.step(gait);
        let step_s =
            0.5 * cycle_s * (1.0 + self.walker.timing_jitter * self.timing.normal().clamp(-2.5, 2.5));
        let moving_s = 2.0 * shape.moving_share * step_s;
        let landing_s = match stop_ends_s {
            Some(ends_s) => ends_s + moving_s,
            None => self.landing_s + step_s,
        };
        let (stood, since_s) = self.standing[foot];
        let lifts_s = (landing_s - moving_s).max(since_s + SHORTEST_REST_S);

        // Who stands at the start has long stood.
        let sole_m = if since_s > 0.0 { self.walker.sole_m } else { 0.0 };
        let micro_motion = self.walker.micro_motion;
        let rest = Rest::new(stood, (since_s, lifts_s), micro_motion, sole_m, &mut self.micro_motion[foot]);
        let from = rest.to;
        let mut to = foothold(&self.path, self.walker, foot, along_m, gait, &mut self.gait[foot]);
        // The short way round.
        to.angles[0] = from.angles[0] + libm::remainder(to.angles[0] - from.angles[0], TAU);
        let stride_m = (to.origin_n_m - from.origin_n_m).norm();
        let vigour = (stride_m / (2.0 * step_m)).clamp(0.35, 1.1);
        let hardness = 1.0 + 0.15 * self.gait[foot].normal().clamp(-2.0, 2.0);
        let detour_n_m = self.detour_n_m(foot, &from, &to, gait);
        let swing = Swing::new((from, lifts_s), (to, landing_s), shape, vigour, detour_n_m, hardness);
        self.phases[foot].push(Phase::Rest(rest));
        self.phases[foot].push(Phase::Swing(Box::new(swing)));
        self.standing[foot] = (to, landing_s);
        self.landing_s = landing_s;
    }

    /// How far from the straight line the foot is halfway: it follows a bending path, and keeps a
    /// little clear of the standing leg.
    fn detour_n_m(&self, foot: usize, from: &Foothold, to: &Foothold, gait: Gait) -> Vector3<f64> {
        const CLEAR_OF_THE_LEG_M: f64 = 0.012;
        let halfway = self.path.at(0.5 * (from.along_m + to.along_m));
        let (sin, cos) = libm::sincos(halfway.yaw);
        let aside_m = side(foot) * (self.walker.half_separation_m + CLEAR_OF_THE_LEG_M);
        let there = halfway.position_n_m + Vector3::new(-aside_m * sin, aside_m * cos, 0.0);
        let mut detour = there - 0.5 * (from.origin_n_m + to.origin_n_m);
        if matches!(gait, Gait::StairsUp | Gait::StairsDown | Gait::Crawl) {
            detour.z = 0.0;
        }
        // Not ahead or behind: that is the glide's matter.
        let ahead = Vector3::new(cos, sin, 0.0);
        detour - ahead * detour.dot(&ahead)
    }

    fn finish(mut self, end_s: f64, visits: Vec<PlannedVisit>) -> Plan {
        for foot in 0..2 {
            let (stood, since_s) = self.standing[foot];
            let micro_motion = self.walker.micro_motion;
            let sole_m = if since_s > 0.0 { self.walker.sole_m } else { 0.0 };
            let rest = Rest::new(stood, (since_s, end_s), micro_motion, sole_m, &mut self.micro_motion[foot]);
            self.phases[foot].push(Phase::Rest(rest));
        }
        Plan { feet: self.phases.map(FootMotion::new), visits, path: self.path, end_s }
    }
}

#[cfg(test)]
mod tests {
    use super::super::gait::SENSOR_HEIGHT_M;
    use super::*;
    use crate::geo::Site;
    use crate::sim::motion::Motion;
    use crate::sim::motion::tests::largest_inconsistency;
    use crate::sim::pedestrian::WalkKind;

    fn planned(kind: WalkKind, micro_motion: f64) -> Plan {
        let mut walker = Walker { micro_motion, sole_m: 0.006 * micro_motion, ..Walker::default() };
        let course = kind.course(5, &Site::fast(), &mut walker);
        plan(course, &walker, 5)
    }

    fn every_gait() -> [WalkKind; 6] {
        let metres = 20.0;
        let (slow, crawl) = (WalkKind::Slow { metres }, WalkKind::Crawl { metres });
        [WalkKind::Stairs, WalkKind::Running, WalkKind::Spiral, WalkKind::Line { metres }, slow, crawl]
    }

    #[test]
    fn position_velocity_acceleration_attitude_and_rate_belong_together() {
        for kind in every_gait() {
            let plan = planned(kind, 1.0);
            for phase in plan.feet.iter().flat_map(|foot| &foot.phases).skip(3).step_by(7).take(120) {
                let from_s = match phase {
                    Phase::Rest(rest) => rest.t_from_s,
                    Phase::Swing(swing) => swing.t_from_s,
                };
                for share in [0.03, 0.19, 0.29, 0.5, 0.7, 0.81, 0.9, 0.95, 0.99] {
                    let t = from_s + share * (phase.t_to_s() - from_s);
                    let off = largest_inconsistency(|t_s| phase.at(t_s), t);
                    assert!(off < 5e-4, "{kind:?} at {t} s: {off}");
                }
            }
        }
    }

    #[test]
    fn phases_join_without_a_step_in_place_speed_or_force() {
        for kind in every_gait() {
            for foot in &planned(kind, 1.0).feet {
                for pair in foot.phases.windows(2) {
                    let t = pair[0].t_to_s();
                    let (before, after) = (pair[0].at(t), pair[1].at(t));
                    assert!((before.position_n_m - after.position_n_m).norm() < 1e-9, "{kind:?} at {t} s");
                    assert!(
                        (before.velocity_n_m_s - after.velocity_n_m_s).norm() < 1e-9,
                        "{kind:?} at {t} s"
                    );
                    assert!((before.acceleration_n_m_s2 - after.acceleration_n_m_s2).norm() < 1e-6);
                    assert!((before.c_nb - after.c_nb).norm() < 1e-9, "{kind:?} at {t} s");
                    assert!((before.w_nb_b_rad_s - after.w_nb_b_rad_s).norm() < 1e-9, "{kind:?} at {t} s");
                    assert!(pair[0].is_stance() != pair[1].is_stance(), "stance and swing take turns");
                    assert!(pair[1].t_to_s() > t);
                }
            }
        }
    }

    #[test]
    fn without_micro_motion_a_standing_foot_is_perfectly_still() {
        let plan = planned(WalkKind::Line { metres: 20.0 }, 0.0);
        for phase in plan.feet.iter().flat_map(|foot| &foot.phases).filter(|phase| phase.is_stance()) {
            let Phase::Rest(rest) = phase else { continue };
            for share in [0.0, 0.3, 0.8, 1.0] {
                let now = phase.at(rest.t_from_s + share * (rest.t_to_s - rest.t_from_s));
                assert_eq!(now.velocity_n_m_s.norm(), 0.0);
                assert_eq!(now.acceleration_n_m_s2.norm(), 0.0);
                assert_eq!(now.w_nb_b_rad_s.norm(), 0.0);
            }
        }
    }

    #[test]
    fn the_sole_never_goes_underground() {
        for kind in
            every_gait().into_iter().filter(|kind| !matches!(kind, WalkKind::Stairs | WalkKind::Spiral))
        {
            let plan = planned(kind, 1.0);
            let ground_m = plan.feet[0].at(0.0).position_n_m.z - SENSOR_HEIGHT_M;
            for foot in &plan.feet {
                for k in 0..(plan.end_s * 100.0) as usize {
                    let t = k as f64 * 0.01;
                    let now = foot.at(t);
                    for ahead_m in [0.115, -0.13] {
                        let below = Vector3::new(ahead_m, 0.0, -SENSOR_HEIGHT_M);
                        let height_m = (now.position_n_m + now.c_nb * below).z - ground_m;
                        // The sole gives by 6 mm, and the ground is not quite level.
                        assert!(height_m > -0.018, "{kind:?}: {height_m} m at {t} s, {ahead_m} m ahead");
                    }
                }
            }
        }
    }
}
