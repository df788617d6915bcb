//! The catalogue of walks.

use std::f64::consts::{FRAC_PI_2, PI};
use std::str::FromStr;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::gait::Gait;
use super::path::Path;
use super::plan::{Course, Leg, Stop};
use super::spiral::spiral;
use crate::geo::Site;

/// A walk of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WalkKind {
    /// Once around 200 m by 500 m on level ground, 1.4 km in about 20 minutes, ending where it began.
    Rectangle,
    /// FAST's spiral road, 3.3 km in 45 minutes, with a stop at an actuator about every 150 m.
    Spiral,
    /// The same, with stops away from any actuator in between: somebody ties a shoe.
    SpiralWithPauses,
    /// Six flights of twelve treads up, and as many down.
    Stairs,
    /// Two laps of 260 m: one walked, most of the second run.
    Running,
    /// A straight line on level ground.
    Line {
        /// How long, m.
        metres: f64,
    },
    /// A straight line, as if looking for something, at half a metre a second.
    Slow {
        /// How long, m.
        metres: f64,
    },
    /// A straight line, run.
    Run {
        /// How long, m.
        metres: f64,
    },
    /// A straight line on hands and knees, the feet dragged.
    Crawl {
        /// How long, m.
        metres: f64,
    },
    /// Once around a square block, turning right, back to where it began.
    Block {
        /// How long, m.
        metres: f64,
    },
    /// Standing still.
    Standing {
        /// How long, s.
        seconds: f64,
    },
}

/// The course is laid out before it is walked, so a walk has an end that memory can hold: a day's.
const LONGEST_LINE_M: f64 = 100_000.0;
const LONGEST_STAND_S: f64 = 86_400.0;
/// A block has corners of a metre and a half.
const SHORTEST_BLOCK_M: f64 = 20.0;

impl FromStr for WalkKind {
    type Err = String;

    /// `rectangle`, `spiral`, `spiral_with_pauses`, `stairs`, `running`, `line:100`, `slow:40`, `run:100`,
    /// `crawl:20`, `block:80` (metres) or `standing:60` (seconds).
    fn from_str(text: &str) -> Result<WalkKind, String> {
        let number = |text: &str, most: f64| text.parse::<f64>().ok().filter(|v| *v > 0.0 && *v <= most);
        match text.split_once(':') {
            None => match text {
                "rectangle" => Some(WalkKind::Rectangle),
                "spiral" => Some(WalkKind::Spiral),
                "spiral_with_pauses" => Some(WalkKind::SpiralWithPauses),
                "stairs" => Some(WalkKind::Stairs),
                "running" => Some(WalkKind::Running),
                _ => None,
            },
            Some(("line", metres)) => number(metres, LONGEST_LINE_M).map(|metres| WalkKind::Line { metres }),
            Some(("slow", metres)) => number(metres, LONGEST_LINE_M).map(|metres| WalkKind::Slow { metres }),
            Some(("run", metres)) => number(metres, LONGEST_LINE_M).map(|metres| WalkKind::Run { metres }),
            Some(("crawl", metres)) => number(metres, LONGEST_LINE_M).map(|metres| WalkKind::Crawl { metres }),
            Some(("block", metres)) => number(metres, LONGEST_LINE_M)
                .filter(|metres| *metres >= SHORTEST_BLOCK_M)
                .map(|metres| WalkKind::Block { metres }),
            Some(("standing", seconds)) => {
                number(seconds, LONGEST_STAND_S).map(|seconds| WalkKind::Standing { seconds })
            }
            Some(_) => None,
        }
        .ok_or_else(|| {
            format!(
                "there is no walk «{text}»: choose rectangle, spiral, spiral_with_pauses, stairs, running, line:METRES, slow:METRES, \
                 run:METRES, crawl:METRES, block:METRES ({SHORTEST_BLOCK_M} at least; all at most {LONGEST_LINE_M}) or standing:SECONDS (at most {LONGEST_STAND_S})"
            )
        })
    }
}

/// Who walks.
#[derive(Clone, Debug, PartialEq)]
pub struct Walker {
    /// Length of a walking step (half a stride), m.
    pub step_m: f64,
    /// Duration of a walking cycle (two steps), s.
    pub cycle_s: f64,
    /// 1σ of a step's duration, as a share.
    pub timing_jitter: f64,
    /// Half the distance between the feet across the path, m.
    pub half_separation_m: f64,
    /// By how much the toes point outward, rad.
    pub toe_out_rad: f64,
    /// The small motion of a standing foot: 1 is usual, 0 is perfectly still.
    pub micro_motion: f64,
    /// How far shoe and foot give under the weight after they have come down, m: 0 for none, 0.005 to
    /// 0.01 for shoes. It comes back when the heel lifts.
    pub sole_m: f64,
}

impl Default for Walker {
    /// 1.25 m/s in strides of 1.3 m.
    fn default() -> Self {
        Walker {
            step_m: 0.65,
            cycle_s: 1.04,
            timing_jitter: 0.015,
            half_separation_m: 0.056,
            toe_out_rad: 0.10,
            micro_motion: 1.0,
            sole_m: 0.0,
        }
    }
}

/// Depth and height of a tread, m.
const TREAD_M: (f64, f64) = (0.29, 0.17);
const TREADS_OF_A_FLIGHT: usize = 12;
/// Every walk begins with so much standing, s.
pub(super) const STANDING_START_S: f64 = 12.0;
/// And ends with so much, s.
const STANDING_END_S: f64 = 5.0;

impl Walker {
    /// Length of a step (m) and duration of a cycle (s) in a gait.
    pub(crate) fn step(&self, gait: Gait) -> (f64, f64) {
        let tread_m = libm::hypot(TREAD_M.0, TREAD_M.1);
        match gait {
            Gait::Walk => (self.step_m, self.cycle_s),
            Gait::Slow => (0.55 * self.step_m, 1.4 * self.cycle_s),
            Gait::Crawl => (0.5 * self.step_m, 1.25 * self.cycle_s),
            Gait::Run => (1.7 * self.step_m, 0.68 * self.cycle_s),
            Gait::StairsUp => (tread_m, 1.15 * self.cycle_s),
            Gait::StairsDown => (tread_m, 1.05 * self.cycle_s),
        }
    }
}

impl WalkKind {
    /// The course; the walker's pace is fitted to it where the walk has a set duration.
    pub(crate) fn course(&self, seed: u64, site: &Site, walker: &mut Walker) -> Course {
        match *self {
            WalkKind::Rectangle => level(rounded_rectangle(200.0, 500.0, 1.5, 1), &[]),
            WalkKind::Spiral => spiral(seed, site, walker, false),
            WalkKind::SpiralWithPauses => spiral(seed, site, walker, true),
            WalkKind::Stairs => stairs(),
            WalkKind::Running => {
                let path = rounded_rectangle(50.0, 83.0, 3.0, 2);
                let lap_m = 0.5 * path.length_m();
                level(path, &[(lap_m, Gait::Walk), (1.85 * lap_m, Gait::Run)])
            }
            WalkKind::Line { metres } => line(metres, Gait::Walk),
            WalkKind::Slow { metres } => line(metres, Gait::Slow),
            WalkKind::Run { metres } => line(metres, Gait::Run),
            WalkKind::Crawl { metres } => line(metres, Gait::Crawl),
            WalkKind::Block { metres } => level(rounded_rectangle(0.25 * metres, 0.25 * metres, 1.5, 1), &[]),
            WalkKind::Standing { seconds } => Course {
                path: Path::from_points([Vector3::zeros(), Vector3::new(0.0, 1.0, 0.0)]),
                standing_start_s: seconds,
                legs: Vec::new(),
                stand_until_s: None,
                starts_at_origin: true,
            },
        }
    }
}

fn end_of_walk() -> Option<Stop> {
    Some(Stop { seconds: STANDING_END_S, marker: None })
}

/// Straight to the north, in one gait to the end.
fn line(metres: f64, gait: Gait) -> Course {
    let mut path = Path::from_points([Vector3::zeros()]);
    path.line_to(Vector3::new(0.0, metres, 0.0));
    let legs = vec![Leg { until_m: path.length_m(), gait, steps: None, stop: end_of_walk() }];
    Course { path, standing_start_s: STANDING_START_S, legs, stand_until_s: None, starts_at_origin: true }
}

/// A course in these gaits up to these lengths, walked to the end after that.
fn level(path: Path, gaits: &[(f64, Gait)]) -> Course {
    let mut legs: Vec<Leg> =
        gaits.iter().map(|&(until_m, gait)| Leg { until_m, gait, steps: None, stop: None }).collect();
    legs.push(Leg { until_m: path.length_m(), gait: Gait::Walk, steps: None, stop: end_of_walk() });
    Course { path, standing_start_s: STANDING_START_S, legs, stand_until_s: None, starts_at_origin: true }
}

/// Laps that start north from the middle of the west side and turn right at each corner.
fn rounded_rectangle(east_m: f64, north_m: f64, radius_m: f64, laps: usize) -> Path {
    let mut path = Path::from_points([Vector3::zeros()]);
    for _ in 0..laps {
        let mut yaw = FRAC_PI_2;
        for corner in [
            Vector3::new(0.0, 0.5 * north_m, 0.0),
            Vector3::new(east_m, 0.5 * north_m, 0.0),
            Vector3::new(east_m, -0.5 * north_m, 0.0),
            Vector3::new(0.0, -0.5 * north_m, 0.0),
        ] {
            let (sin, cos) = libm::sincos(yaw);
            path.line_to(corner - radius_m * Vector3::new(cos, sin, 0.0));
            path.arc(yaw, radius_m, -FRAC_PI_2);
            yaw -= FRAC_PI_2;
        }
        path.line_to(Vector3::zeros());
    }
    path
}

/// Two staircases side by side, up the one and down the other; flights turn back at each landing.
fn stairs() -> Course {
    const FLIGHTS: usize = 6;
    const LANDING_M: f64 = 0.9;
    const TURN_RADIUS_M: f64 = 0.7;
    /// Steps on a landing: short ones, as it turns.
    const LANDING_STEPS: usize = 8;
    let landing_steps = |number: usize| (number > 0).then_some(LANDING_STEPS);
    let (depth, rise) = TREAD_M;
    let flight = TREADS_OF_A_FLIGHT as f64;
    let mut path = Path::from_points([Vector3::zeros()]);
    let mut legs = Vec::new();
    let (mut at, mut east) = (Vector3::new(12.0, 0.0, 0.0), 1.0);
    path.line_to(at);
    for number in 0..2 * FLIGHTS {
        let climbing = number < FLIGHTS;
        let gait = if climbing { Gait::StairsUp } else { Gait::StairsDown };
        legs.push(Leg {
            until_m: path.length_m(),
            gait: Gait::Walk,
            steps: landing_steps(number),
            stop: None,
        });
        at += Vector3::new(east * flight * depth, 0.0, if climbing { flight * rise } else { -flight * rise });
        path.line_to(at);
        legs.push(Leg { until_m: path.length_m(), gait, steps: Some(TREADS_OF_A_FLIGHT), stop: None });
        at.x += east * LANDING_M;
        path.line_to(at);
        if number + 1 < 2 * FLIGHTS {
            // Always the same way round, but on the top floor over to the staircase beside.
            let yaw = if east > 0.0 { 0.0 } else { PI };
            path.arc(yaw, TURN_RADIUS_M, if number + 1 == FLIGHTS { -PI } else { PI });
            at.y = path.at(path.length_m()).position_n_m.y;
            east = -east;
            at.x += east * LANDING_M;
            path.line_to(at);
        }
    }
    at.x += east * 10.0;
    path.line_to(at);
    legs.push(Leg { until_m: path.length_m(), gait: Gait::Walk, steps: None, stop: end_of_walk() });
    let path = path.with_stairs();
    Course { path, standing_start_s: STANDING_START_S, legs, stand_until_s: None, starts_at_origin: true }
}
