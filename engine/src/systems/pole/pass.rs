//! One way through a recording, from a start to the end.

use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3};
use serde::Serialize;

use super::aids::{FIX, GNSS};
use super::contact::{Interval, Walking};
use super::filter::Filter;
use super::landing::{Landing, Standing};
use super::recording::{Fix, Quality};
use super::states::{BLOCKS, STATES};
use super::tuning::Tuning;
use crate::event::AidOutcome;
use crate::ins::earth::Earth;
use crate::ins::eskf::Eskf;
use crate::ins::layout::ErrorState::{Attitude, Velocity};
use crate::ins::linear_maps::Rows;
use crate::ins::strapdown::ImuInterval;
use crate::ins::tape::Tape;
use crate::sample::ImuSample;

/// A sample that comes later than this after the one before leaves a gap, s.
const GAP_S: f64 = 0.05;
/// What may have happened in a gap: rate, rad/s, and acceleration, m/s².
const IN_A_GAP: [f64; 2] = [0.3, 1.0];
/// The covariance is kept this often for the way back, s.
const KEPT_EVERY_S: f64 = 4.0;
/// So many fixes in a row that are refused are not chance.
const MOST_FIXES_REFUSED: usize = 3;

/// Where no fix comes for longer than this there is a gap, ns.
pub(super) const LONG_GAP_NS: i64 = 3_000_000_000;

/// What all passes have in common.
#[derive(Debug)]
pub(super) struct Setting<'a> {
    pub(super) tuning: &'a Tuning,
    pub(super) earth: &'a Earth,
    pub(super) imu: &'a [ImuSample],
    pub(super) fixes: &'a [Fix],
    /// Stretches of fixes in the middle of a gap of which nobody knows whether they are right: first fix, the one after the
    /// last, and whether they have proved right.
    pub(super) islands: &'a [Island],
    pub(super) contacts: &'a [Interval],
    /// Which of the contacts are left out.
    pub(super) restless: &'a [bool],
    /// Whether contacts are felt: then a tip that is carried evenly may be taken for one that stands.
    pub(super) felt: bool,
    /// When the tip is felt to stand still; `None` where nobody has looked.
    pub(super) still: Option<&'a [Interval]>,
}

impl Setting<'_> {
    /// Whether something stirred the tip between these times.
    pub(super) fn is_stirred(&self, from_ns: i64, to_ns: i64) -> bool {
        self.still.is_some_and(|still| {
            let after = still.partition_point(|interval| interval.to_ns < to_ns);
            still.get(after).is_none_or(|interval| interval.from_ns > from_ns)
        })
    }
}

/// A stretch of fixes with no other before and after it for some time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Island {
    /// The first of its fixes, and the one after its last.
    pub(super) fixes: [usize; 2],
    /// Whether it has proved right.
    pub(super) trusted: bool,
}

/// How far off an island is, by all else: at its last fix.
#[derive(Clone, Debug)]
pub(super) struct Doubt {
    pub(super) island: usize,
    pub(super) look: usize,
    /// The slow error as the filter had it, m, with its covariance and how it sees all errors.
    pub(super) slow_n_m: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
    pub(super) rows: Rows<3, BLOCKS>,
}

/// What is wanted of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The errors of the start.
    Start,
    /// The filter's own track.
    Filtered,
    /// Nothing but the filter as it is.
    Live,
    /// All that smoothing needs.
    Smoothed,
}

/// Where the pole is, as the strapdown has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) t_ns: i64,
    pub(super) c_nb: Matrix3<f64>,
    pub(super) p_n: Vector3<f64>,
    /// Estimated lever arms and roundness at that time.
    pub(super) antenna_b_m: Vector3<f64>,
    pub(super) tip_b_m: Option<Vector3<f64>>,
    pub(super) roundness_m: f64,
    /// How many looks at the errors came before it.
    pub(super) after: usize,
    /// Whether the tip stands on the ground.
    pub(super) stands: bool,
}

/// A look at the errors: they were brought up to date, and what could be measured was.
#[derive(Clone, Debug)]
pub(super) struct Look {
    pub(super) t_ns: i64,
    /// Covariance of position (touch or antenna) and heading before the measurements, where it is wanted.
    pub(super) covariance: Matrix4<f64>,
    /// How these four see all errors.
    pub(super) rows: Option<Rows<4, BLOCKS>>,
    /// How the errors show in these four.
    pub(super) shows: Vec<(usize, SMatrix<f64, 4, 3>)>,
    /// Covariance of position and heading after the measurements.
    pub(super) after: Matrix4<f64>,
}

/// A fix and what became of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed {
    pub(super) t_ns: i64,
    pub(super) nis: f64,
    pub(super) used: bool,
}

impl Weighed {
    /// As the outcome of an aid.
    pub(super) fn outcome(&self) -> AidOutcome {
        AidOutcome {
            t_ns: self.t_ns,
            stream: Some(GNSS),
            aid: FIX,
            nis: self.nis,
            degrees_of_freedom: 3,
            updates: 1,
            accepted: self.used,
        }
    }
}

/// How a gap closes: where the fixes come back, against where the way through it has led.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Closure {
    /// When they come back, s.
    pub at_s: f64,
    /// For how long there was none, s.
    pub gap_s: f64,
    /// The way's end minus the fix, east, north and up, m.
    pub off_m: [f64; 3],
    /// The same in sigmas, by axis on the mean.
    pub sigmas: f64,
}

/// What a pass leaves.
#[derive(Debug)]
pub(super) struct Pass {
    pub(super) start: Filter,
    pub(super) end: Filter,
    pub(super) poses: Vec<Pose>,
    pub(super) looks: Vec<Look>,
    pub(super) tape: Tape,
    /// Filters as they were before the measurements of a look, for the way back.
    pub(super) kept: Vec<(usize, Eskf<BLOCKS>)>,
    pub(super) weighed: Vec<Weighed>,
    pub(super) landings: Vec<Landing>,
    /// Episodes of solutions that jumped: start, ns.
    pub(super) jumps: Vec<i64>,
    /// How the gaps close.
    pub(super) closures: Vec<Closure>,
    /// What is known of each island that is not trusted.
    pub(super) doubts: Vec<Doubt>,
    /// Sigma of the heading at the end of each stretch of fixes: time, ns, and rad.
    pub(super) headings: Vec<(i64, f64)>,
    /// Gaps in the samples: end, ns, and length, s.
    pub(super) sample_gaps: Vec<(i64, f64)>,
}

/// Goes through the recording from sample `first` on, where the filter is `start`; poses are given at every multiple of
/// `every_ns`.
pub(super) fn go(setting: &Setting<'_>, start: &Filter, first: usize, wanted: Wanted, every_ns: i64) -> Pass {
    let mut runner = Runner::new(setting, start, first, wanted);
    let imu = setting.imu;
    let mut next_pose_ns = (imu[first].t_ns + every_ns - 1).div_euclid(every_ns) * every_ns;
    for k in first + 1..imu.len() {
        let (from, to) = (&imu[k - 1], &imu[k]);
        if to.t_ns <= runner.t_ns {
            continue;
        }
        runner.interval(setting, from, to);
        if wanted != Wanted::Start && to.t_ns >= next_pose_ns {
            runner.pose();
            next_pose_ns = (to.t_ns + 1 + every_ns - 1).div_euclid(every_ns) * every_ns;
        }
    }
    runner.look(setting);
    runner.finish()
}

/// A pass under way. What it goes through is handed to it anew at each step, and may have grown.
#[derive(Debug)]
pub(super) struct Runner {
    wanted: Wanted,
    pub(super) filter: Filter,
    pub(super) walking: Walking,
    pub(super) t_ns: i64,
    /// The rate as last read, rad/s.
    pub(super) w_ib_b: Vector3<f64>,
    next_fix: usize,
    pub(super) next_contact: usize,
    pub(super) standing: Option<Standing>,
    /// The contact at whose start the place was drawn last.
    pub(super) landed: Option<usize>,
    episode: Option<(Quality, Option<usize>)>,
    fixes_refused: usize,
    kept_ns: i64,
    /// An island that ends at this look.
    doubted: Option<usize>,
    pub(super) pass: Pass,
}

impl Runner {
    pub(super) fn new(setting: &Setting<'_>, start: &Filter, first: usize, wanted: Wanted) -> Runner {
        let landing = &setting.tuning.landing;
        let t_ns = setting.imu[first].t_ns;
        let mut filter = start.clone();
        filter.eskf.tape = Tape::default();
        filter.eskf.tape.set_recording(wanted != Wanted::Filtered && wanted != Wanted::Live);
        let pass = Pass {
            start: start.clone(),
            end: start.clone(),
            poses: Vec::new(),
            looks: Vec::new(),
            tape: Tape::default(),
            kept: Vec::new(),
            weighed: Vec::new(),
            landings: vec![Landing::default(); setting.contacts.len()],
            jumps: Vec::new(),
            closures: Vec::new(),
            doubts: Vec::new(),
            headings: Vec::new(),
            sample_gaps: Vec::new(),
        };
        Runner {
            wanted,
            filter,
            walking: Walking::new(
                setting.contacts,
                setting.restless.to_vec(),
                landing.walking_whole_s,
                landing.walking_gone_s,
            ),
            t_ns,
            w_ib_b: Vector3::zeros(),
            next_fix: setting.fixes.partition_point(|fix| fix.t_ns <= t_ns),
            next_contact: 0,
            standing: None,
            landed: None,
            episode: None,
            fixes_refused: 0,
            kept_ns: i64::MIN / 2,
            doubted: None,
            pass,
        }
    }

    /// Goes on from one sample to the next, with a look at every fix in between and where it is time for one.
    pub(super) fn interval(&mut self, setting: &Setting<'_>, from: &ImuSample, to: &ImuSample) {
        let gap_s = (to.t_ns - from.t_ns) as f64 * 1e-9;
        while let Some(fix) = setting.fixes.get(self.next_fix).filter(|fix| fix.t_ns <= to.t_ns) {
            // A fix within half a millisecond of a sample is of that moment.
            let t_ns = if to.t_ns - fix.t_ns < 500_000 { to.t_ns } else { fix.t_ns };
            self.advance(setting, to, t_ns);
            self.look(setting);
            self.next_fix += 1;
        }
        self.advance(setting, to, to.t_ns);
        if gap_s > GAP_S {
            self.pass.sample_gaps.push((to.t_ns, gap_s));
            self.filter.propagate(setting.tuning, setting.earth);
            let [rate, force] = IN_A_GAP;
            let states = STATES.imu;
            let variance = |sigma: f64| Vector3::repeat((sigma * gap_s).powi(2));
            self.filter.eskf.add_noise(&[states.block(Attitude)], &variance(rate));
            self.filter.eskf.add_noise(&[states.block(Velocity)], &variance(force));
        }
        let in_contact = self.contact_now(setting);
        if in_contact.is_none() {
            // It does not stand until the next look.
            self.standing = None;
        }
        let lands = in_contact.is_some() && self.standing.as_ref().map(|s| s.contact) != in_contact;
        let [standing_s, moving_s] = setting.tuning.step_s;
        let step_s = match (in_contact, setting.tuning.zero_velocity_m_s) {
            (Some(_), Some(_)) => 0.0,
            (Some(_), None) => standing_s,
            (None, _) => moving_s,
        };
        if lands || self.filter.unpropagated_s() > (step_s - 1e-3).max(0.0) {
            self.look(setting);
        }
    }

    fn advance(&mut self, setting: &Setting<'_>, sample: &ImuSample, t_ns: i64) {
        if t_ns <= self.t_ns {
            return;
        }
        let dt_s = (t_ns - self.t_ns) as f64 * 1e-9;
        let interval = ImuInterval {
            dt_s,
            w_ib_b: Vector3::from(sample.w_ib_b_rad_s),
            f_b: Vector3::from(sample.f_b_m_s2),
        };
        let walking = self.walking.at(t_ns);
        self.filter.advance(setting.earth, &interval, walking);
        self.w_ib_b = interval.w_ib_b;
        self.t_ns = t_ns;
    }

    /// Brings the errors up to date, and measures what can be measured now.
    fn look(&mut self, setting: &Setting<'_>) {
        self.filter.propagate(setting.tuning, setting.earth);
        if self.wanted == Wanted::Live {
            self.weigh_fix(setting);
            self.weigh_stand(setting);
            return;
        }
        let shows = self.filter.shows();
        let full = self.wanted == Wanted::Smoothed;
        let covariance_of = |filter: &Filter| {
            let rows = filter.eskf.covariance.seen_by(&shows);
            let covariance: Matrix4<f64> =
                shows.iter().map(|(block, jacobian)| jacobian * rows.block(*block).transpose()).sum();
            (rows, covariance)
        };
        let before = full.then(|| covariance_of(&self.filter));
        self.filter.eskf.tape.mark_moment();
        if !matches!(self.wanted, Wanted::Filtered | Wanted::Live)
            && self.t_ns - self.kept_ns >= (KEPT_EVERY_S * 1e9) as i64
        {
            self.kept_ns = self.t_ns;
            let tape = std::mem::take(&mut self.filter.eskf.tape);
            self.pass.kept.push((self.pass.looks.len(), self.filter.eskf.clone()));
            self.filter.eskf.tape = tape;
        }
        self.weigh_fix(setting);
        self.weigh_stand(setting);
        self.filter.eskf.tape.mark_moment();
        if let Some(island) = self.doubted.take() {
            let slow = STATES.slow.block();
            let rows = self.filter.eskf.covariance.seen_by(&[(slow, Matrix3::identity())]);
            self.pass.doubts.push(Doubt {
                island,
                look: self.pass.looks.len(),
                slow_n_m: self.filter.slow_n,
                covariance: self.filter.eskf.covariance.block(slow, slow),
                rows,
            });
        }
        let after = match self.wanted {
            Wanted::Filtered => {
                let shows = self.filter.shows();
                let rows = self.filter.eskf.covariance.seen_by(&shows);
                shows.iter().map(|(block, jacobian)| jacobian * rows.block(*block).transpose()).sum()
            }
            Wanted::Start | Wanted::Live | Wanted::Smoothed => Matrix4::zeros(),
        };
        let (rows, covariance) = before.map_or((None, Matrix4::zeros()), |(rows, c)| (Some(rows), c));
        self.pass.looks.push(Look { t_ns: self.t_ns, covariance, rows, shows, after });
    }

    fn weigh_fix(&mut self, setting: &Setting<'_>) {
        let Some(fix) = setting.fixes.get(self.next_fix) else { return };
        if (fix.t_ns - self.t_ns).abs() >= 500_000 {
            return;
        }
        let gnss = &setting.tuning.gnss;
        let shares = |[plan, height]: [f64; 2]| Vector3::new(plan, plan, height);
        let at_least = |sigma: Vector3<f64>, least: f64| sigma.map(|sigma| sigma.max(least));
        let slow = at_least(fix.sigma_n_m.component_mul(&shares(gnss.slow_share)), gnss.least_slow_m);
        let mut white = at_least(fix.sigma_n_m.component_mul(&shares(gnss.white_share)), gnss.least_white_m);
        let worst = |least: f64| match least {
            0.0 => Vector3::zeros(),
            least => at_least(fix.sigma_n_m * 2.0, least),
        };
        let number = self.next_fix;
        let island = setting
            .islands
            .iter()
            .position(|island| !island.trusted && (island.fixes[0]..island.fixes[1]).contains(&number));
        let episode = (fix.quality, island);
        if self.episode != Some(episode) {
            self.episode = Some(episode);
            match episode {
                (Quality::Fixed, None) => self.filter.draw_slow_error(slow, gnss.slow_time_s),
                (Quality::Single, _) => {
                    self.filter.draw_slow_error(worst(gnss.single_m), gnss.float_time_s);
                }
                _ => self.filter.draw_slow_error(worst(gnss.float_m), gnss.float_time_s),
            }
        }
        if fix.quality != Quality::Fixed && setting.tuning.zero_velocity_m_s.is_none() {
            white = at_least(fix.sigma_n_m * 0.5, 0.05);
        }
        let observation = self.filter.fix(&fix.p_n_m, &white, &self.w_ib_b);
        let (nis, used) = self.filter.weigh(&observation, gnss.gate);
        let since_ns = number.checked_sub(1).map_or(0, |last| fix.t_ns - setting.fixes[last].t_ns);
        if since_ns > LONG_GAP_NS && episode == (Quality::Fixed, None) {
            self.pass.closures.push(Closure {
                at_s: fix.t_ns as f64 * 1e-9,
                gap_s: since_ns as f64 * 1e-9,
                off_m: observation.innovation.into(),
                sigmas: (nis / 3.0).sqrt(),
            });
        }
        self.pass.weighed.push(Weighed { t_ns: fix.t_ns, nis, used });
        if used {
            self.fixes_refused = 0;
        } else {
            self.fixes_refused += 1;
        }
        if self.fixes_refused >= MOST_FIXES_REFUSED {
            // What comes now is not what was before. It may be what was before that; otherwise nobody knows which of
            // the two is right.
            self.fixes_refused = 0;
            self.filter.draw_slow_error(slow, gnss.slow_time_s);
            let (_, back) = self.filter.weigh(&self.filter.fix(&fix.p_n_m, &white, &self.w_ib_b), gnss.gate);
            if !back {
                self.pass.jumps.push(fix.t_ns);
                self.filter.draw_slow_error(worst(gnss.float_m), gnss.float_time_s);
                self.filter.weigh(&self.filter.fix(&fix.p_n_m, &white, &self.w_ib_b), f64::INFINITY);
            }
        }
        let last = setting.fixes.get(number + 1).is_none_or(|next| next.t_ns - fix.t_ns > LONG_GAP_NS);
        if last {
            let states = STATES.imu;
            let attitude = self.filter.eskf.covariance.block(states.block(Attitude), states.block(Attitude));
            self.pass.headings.push((fix.t_ns, attitude[(2, 2)].sqrt()));
        }
        if let (Some(island), true) = (island, self.wanted == Wanted::Smoothed) {
            let ends = setting.islands[island].fixes[1] == number + 1;
            if ends {
                self.doubted = Some(island);
            }
        }
    }

    fn pose(&mut self) {
        let pose = self.pose_of(&self.filter, self.t_ns);
        self.pass.poses.push(pose);
    }

    fn pose_of(&self, filter: &Filter, t_ns: i64) -> Pose {
        let nav = &filter.strapdown.nav;
        Pose {
            t_ns,
            c_nb: nav.c_nb,
            p_n: nav.p_n,
            antenna_b_m: filter.antenna.arm_b_m,
            tip_b_m: filter.tip.map(|tip| tip.arm_b_m),
            roundness_m: filter.roundness_m,
            after: self.pass.looks.len(),
            stands: self.standing.is_some(),
        }
    }

    /// There are other contacts than before, or one has got its end; those that it has come past are the same.
    pub(super) fn contacts_changed(&mut self, setting: &Setting<'_>) {
        let landing = &setting.tuning.landing;
        self.pass.landings.resize(setting.contacts.len(), Landing::default());
        let left_out = self.pass.landings.iter().map(|landing| landing.restless).collect();
        self.walking =
            Walking::new(setting.contacts, left_out, landing.walking_whole_s, landing.walking_gone_s);
    }

    /// The filter as it would be after more samples, of which nothing is measured; and its pose there.
    pub(super) fn ahead(&self, tuning: &Tuning, earth: &Earth, samples: &[ImuSample]) -> (Filter, Pose) {
        let mut filter = self.filter.clone();
        let mut walking = self.walking.clone();
        let mut t_ns = self.t_ns;
        for sample in samples {
            let interval = ImuInterval {
                dt_s: (sample.t_ns - t_ns) as f64 * 1e-9,
                w_ib_b: Vector3::from(sample.w_ib_b_rad_s),
                f_b: Vector3::from(sample.f_b_m_s2),
            };
            t_ns = sample.t_ns;
            filter.advance(earth, &interval, walking.at(t_ns));
        }
        filter.propagate(tuning, earth);
        let pose = self.pose_of(&filter, t_ns);
        (filter, pose)
    }

    fn finish(mut self) -> Pass {
        self.pass.tape = std::mem::take(&mut self.filter.eskf.tape);
        self.pass.end = self.filter;
        self.pass
    }
}
