//! Contradictions that show on the way: does a swing come to rest, do two feet stay together? What is contradicted
//! is left out, or the sigmas take account of it (`beyond`).

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::both_feet_open::Closing;
use super::contradictions::Contradiction;
use super::field_turn::FieldTurn;
use super::filter::{Filter, Setting, seconds};
use super::gyro_jump::GyroJump;
use crate::anomaly::Cause;
use crate::event::Event;
use crate::ins::layout::ErrorState;
use crate::rotation::{heading, wrap};

/// Over about so many swings a mean is taken.
const SWINGS_OF_A_MEAN: f64 = 8.0;
/// A foot that was slower, m/s, or came less far, m, has not swung.
const SLOWEST_SWING_M_S: f64 = 1.5;
const SHORTEST_SWING_M: f64 = 0.4;
/// What a swing's velocity fails to come to rest by, as a share of its fastest, where all belongs together.
const CLOSES_SHARE: f64 = 0.06;
/// Beyond this it is told.
const OPEN_SHARE: f64 = 0.2;
/// After so many swings.
const OPEN_SWINGS: u32 = 6;
/// Feet that both stand are nearer to each other than this in plan, m …
const FARTHEST_STEP_M: f64 = 2.0;
/// … and in height.
const HIGHEST_STEP_M: f64 = 1.2;
/// Both feet of a walker are in the air for less than this in a step, as a detector finds it, s.
const IN_THE_AIR_S: f64 = 0.32;
/// A swing that is faster belongs to a run, in which both feet fly, m/s.
const FASTEST_WALK_M_S: f64 = 6.0;
/// A swing that takes longer is none, s.
const LONGEST_SWING_S: f64 = 1.2;
/// Where a foot out of step may be, m.
const OUT_OF_STEP_M: f64 = 0.5;
/// A length of the specific force at rest that differs from gravity by less than this share is a matter of bias: three
/// sigmas of it.
const BIAS_SHARE: f64 = 0.0245;

/// What the swings of one foot have said so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Doubts {
    /// The field is not used.
    pub(crate) field_left_out: bool,
    /// Whether the field turns with the foot.
    pub(super) field_turn: FieldTurn,
    swings: u32,
    /// Mean square of the velocity that a swing fails to come to rest by, as a share of its fastest;
    open_share2: f64,
    /// and the mean of it along, across and above the swing's way: what is the same in every swing.
    open_shares: Vector3<f64>,
    /// The same speed, m/s.
    landing_m_s: f64,
    told_open: bool,
    heading_before_rad: f64,
    /// What the length of the force at rest leaves of a scale, as a share.
    pub(crate) force_share: f64,
    /// Steps in which both feet were in the air, one bit each, the newest lowest.
    in_the_air: u8,
    /// How its gyro's bias has been.
    pub(super) gyro_jump: GyroJump,
    /// What its swings leave open on the mean,
    pub(super) closing: Closing,
    /// and what both feet have of it in common, as a share, once it has been told.
    pub(super) common_share: f64,
}

impl Doubts {
    /// Of a foot whose force at rest has this length where gravity has that, m/s².
    pub(crate) fn at_rest(rest_m_s2: f64, gravity_m_s2: f64) -> Doubts {
        let off_share = (rest_m_s2 / gravity_m_s2 - 1.0).abs();
        let beyond2 = off_share * off_share - BIAS_SHARE * BIAS_SHARE;
        Doubts { force_share: beyond2.clamp(0.0, 1.0).sqrt(), ..Doubts::default() }
    }

    /// Turns what is written in n about the vertical.
    pub(super) fn turn(&mut self, r: &Matrix3<f64>) {
        self.field_turn.turn(r);
        self.heading_before_rad = wrap(self.heading_before_rad - libm::atan2(r[(1, 0)], r[(0, 0)]));
    }

    /// What a swing's way may be wrong by, as a share: a scale of the forces, and what does not close.
    fn way_share(&self) -> f64 {
        self.force_share.max(self.open_share()).max(self.common_share)
    }

    /// What a swing fails to come to rest by, as a share, beyond what sensors that belong together explain: turns may be
    /// wrong by as much, too.
    fn open_share(&self) -> f64 {
        if self.swings < OPEN_SWINGS {
            return 0.0;
        }
        // What differs from swing to swing is not one way: a run is none the worse for it, unless it is beyond all measure.
        let every_time = if self.told_open { self.open_share2 } else { self.open_shares.norm_squared() };
        (every_time - CLOSES_SHARE * CLOSES_SHARE).max(0.0).sqrt()
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// A swing has come to its end: what it says.
    pub(super) fn judge_swing(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let foot = &self.feet[sensor];
        if foot.lost || !foot.swing.has_begun() {
            return;
        }
        self.judge_field(setting, sensor, told);
        self.judge_gyro(setting, sensor, told);
        self.judge_closing(setting, sensor, told);
        if F == 2 {
            self.judge_common_closing(setting, sensor, told);
            self.judge_feet(setting, sensor, told);
        }
    }

    pub(super) fn tell(
        &self,
        setting: &Setting,
        sensor: usize,
        cause: &Contradiction,
        told: &mut Vec<Event>,
    ) {
        let foot = &self.feet[sensor];
        let stream = Some(setting.feet[sensor].stream());
        let since_ns = foot.swing.begun_ns().max(foot.stance.since_ns).min(foot.t_ns);
        told.push(Event::Anomaly(cause.anomaly(stream, [since_ns, foot.t_ns], 0)));
    }

    /// The velocity that is left where a foot comes down: what scale, signs, axes and clock make of the swing. How far
    /// the way is wrong by them, and the turns, adds up all one way.
    fn judge_closing(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let foot = &mut self.feet[sensor];
        let (speed_m_s, fastest_m_s) = (foot.nav.v_n.norm(), foot.fastest_m_s);
        let heading_rad = heading(&foot.nav.c_nb);
        let turned_rad = wrap(heading_rad - foot.doubts.heading_before_rad);
        foot.doubts.heading_before_rad = heading_rad;
        let way_n = foot.nav.p_n - foot.swing.start_p_n();
        let way_m = way_n.xy().norm();
        let swung_s = seconds(foot.t_ns - foot.swing.begun_ns());
        if fastest_m_s < SLOWEST_SWING_M_S || way_m < SHORTEST_SWING_M || swung_s > LONGEST_SWING_S {
            return;
        }
        let v_n = foot.nav.v_n / fastest_m_s;
        let (along, across) = (v_n.xy().dot(&way_n.xy()) / way_m, v_n.xy().perp(&way_n.xy()) / way_m);
        let doubts = &mut foot.doubts;
        doubts.swings += 1;
        let swings = f64::from(doubts.swings).min(SWINGS_OF_A_MEAN);
        let share = (speed_m_s / fastest_m_s).min(1.0);
        doubts.open_share2 += (share * share - doubts.open_share2) / swings;
        let open = Vector3::new(along, across, v_n.z);
        doubts.open_shares += (open - doubts.open_shares) / swings;
        doubts.closing.take(&open);
        doubts.landing_m_s += (speed_m_s - doubts.landing_m_s) / swings;
        let (open, way) = (doubts.open_share(), doubts.way_share());
        // Of two feet each makes half of the way of their middle.
        let turned_rad = if doubts.swings > 1 { turned_rad } else { 0.0 };
        self.beyond.go_on(way, way_m / F as f64, open * turned_rad / F as f64);
        if doubts.open_share2.sqrt() > OPEN_SHARE && doubts.swings >= OPEN_SWINGS && !doubts.told_open {
            doubts.told_open = true;
            let landing_speed_m_s = doubts.landing_m_s;
            self.tell(setting, sensor, &Contradiction::SwingsDoNotClose { landing_speed_m_s }, told);
        }
    }

    /// Two feet that stand are a step apart, and of a walker's feet one stands.
    fn judge_feet(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let other = 1 - sensor;
        let (foot, its) = (&self.feet[sensor], &self.feet[other]);
        let (begun_ns, its_begun_ns) = (foot.swing.begun_ns(), its.swing.begun_ns());
        if its.lost || !its.swing.has_begun() || seconds(foot.t_ns - its.t_ns).abs() > 0.2 {
            return;
        }
        let swung_s = seconds(foot.t_ns - begun_ns);
        if swung_s < LONGEST_SWING_S && foot.fastest_m_s.max(its.fastest_m_s) < FASTEST_WALK_M_S {
            let its_end_ns = if its.stance.stands { its.stance.since_ns } else { foot.t_ns };
            let in_the_air_s = seconds(its_end_ns - begun_ns.max(its_begun_ns)).max(0.0);
            let doubts = &mut self.feet[sensor].doubts;
            let before = doubts.in_the_air.count_ones() >= 5;
            doubts.in_the_air = (doubts.in_the_air << 1) | u8::from(in_the_air_s > IN_THE_AIR_S);
            if doubts.in_the_air.count_ones() >= 5 && !before && !self.feet_out_of_step {
                self.feet_out_of_step = true;
                self.tell(setting, sensor, &Contradiction::FeetOutOfStep { in_the_air_s }, told);
                self.beyond.reach(OUT_OF_STEP_M, 0.0);
            }
        }
        if !self.feet[other].stance.stands {
            return;
        }
        let apart_n = self.feet[sensor].nav.p_n - self.feet[other].nav.p_n;
        let [own, its] = [ErrorState::Position.of(sensor), ErrorState::Position.of(other)];
        let covariance = &self.eskf.covariance;
        let shared = covariance.block(own, its);
        let variance = covariance.block(own, own) + covariance.block(its, its) - shared - shared.transpose();
        let plan2 = apart_n.xy().norm_squared();
        let too_far =
            plan2 > FARTHEST_STEP_M * FARTHEST_STEP_M && plan2 > 9.0 * (variance[(0, 0)] + variance[(1, 1)]);
        let ridden = self.feet.iter().any(|foot| foot.ride.moves(foot.t_ns));
        let too_high =
            !ridden && apart_n.z.abs() > HIGHEST_STEP_M && apart_n.z * apart_n.z > 9.0 * variance[(2, 2)];
        // Either may be where it says, and both may have gone as far astray: told once, and again when it is twice as far.
        let [plan_m, up_m] = [plan2.sqrt(), apart_n.z.abs()];
        let apart_m = apart_n.norm();
        if !(too_far || too_high) || apart_m < 2.0 * self.beyond.feet_apart_m {
            return;
        }
        self.beyond.feet_apart_m = apart_m;
        self.beyond.reach(if too_far { plan_m } else { 0.0 }, if too_high { up_m } else { 0.0 });
        self.tell(setting, sensor, &Contradiction::FeetPart { apart_m }, told);
    }
}
