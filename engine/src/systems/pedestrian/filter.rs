//! The joint filter of one or two feet: both strapdowns, one error covariance, all aids.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::foot::{Foot, Step};
use super::tuning::Tuning;
use super::walked::Walked;
use crate::detect::swing::Following;
use crate::event::{AidKind, AidOutcome, Anomaly, AnomalyKind, Event, FootPoint, TrackPoint, VisitOutcome};
use crate::ins::error_model::Transition;
use crate::ins::eskf::Eskf;
use crate::ins::layout::{BLOCKS_A_SENSOR, ErrorState};
use crate::ins::mechanization::advance;
use crate::ins::observation::Observation;
use crate::measure::foot_separation::{foot_separation, stride_symmetry};
use crate::measure::height::{height, pressure_height_m};
use crate::measure::magnetic_heading::magnetic_heading;
use crate::measure::magnetic_rate::magnetic_rate;
use crate::measure::marker_position::marker_position;
use crate::measure::zero_angular_rate::zero_angular_rate;
use crate::measure::zero_velocity::zero_velocity;
use crate::rotation::{heading, level};
use crate::sample;
use crate::session::{Aids, Visit};

/// A step longer than this is not integrated: what the foot did meanwhile is unknown, s.
const LONGEST_STEP_S: f64 = 0.2;
/// How fast a foot may have moved on the mean while nothing was known of it, m/s.
const UNKNOWN_SPEED_M_S: f64 = 1.5;
/// Strides whose symmetry means something, m.
const SHORTEST_STRIDE_M: f64 = 0.7;
const LONGEST_STRIDE_M: f64 = 2.5;
/// 99.9 % of three normal squares.
const GATE_3: f64 = 16.27;
/// 99.9 % of two normal squares.
const GATE_2: f64 = 13.82;
/// 99.9 % of one normal square.
const GATE_1: f64 = 10.83;
/// A visit is turned down beyond this: one in ten million of three normal squares.
const GATE_VISIT: f64 = 35.0;
/// The heading of the linearised filter means nothing beyond this sigma, rad.
const HEADING_UNCERTAIN_RAD: f64 = 0.5;

/// What the filter needs to know besides the samples.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub(crate) tuning: Tuning,
    pub(crate) aids: Aids,
    pub gravity_m_s2: f64,
    pub(crate) declination_rad: f64,
    /// The feet in the order of their sensors' numbers.
    pub(crate) feet: Vec<sample::Foot>,
}

/// What a step asks of the history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Demand {
    /// Nothing.
    None,
    /// This foot has never been nearer to the other in its swing: remember this moment.
    Remember {
        /// The swinging foot's sensor.
        sensor: usize,
    },
    /// The swing of this foot has passed the other: go back to the moment remembered and apply the
    /// separation there.
    GoBack {
        /// The swinging foot's sensor.
        sensor: usize,
    },
}

/// The state of everything that changes from sample to sample, for `F` feet with `B` = 5F
/// three-vectors of error; a copy of it is a checkpoint.
#[derive(Clone, Debug)]
pub(crate) struct Filter<const B: usize, const F: usize> {
    pub(crate) eskf: Eskf<B>,
    pub(crate) feet: [Foot; F],
    pub(crate) walked: Walked,
    /// How many of the session's visits have been applied.
    pub(crate) visits_applied: usize,
    /// When the last accepted visit was, ns, and how far had been walked by then, m.
    pub(crate) last_marker: (i64, f64),
    /// Innovation of the last visit, if it was turned down.
    turned_down: Option<Vector3<f64>>,
    heading_uncertain: bool,
}

impl<const B: usize, const F: usize> Filter<B, F> {
    pub(crate) fn new(feet: [Foot; F]) -> Self {
        let start_ns = feet.iter().map(|foot| foot.t_ns).min().unwrap_or(0);
        Filter {
            eskf: Eskf::new(),
            feet,
            walked: Walked::default(),
            visits_applied: 0,
            last_marker: (start_ns, 0.0),
            turned_down: None,
            heading_uncertain: false,
        }
    }

    /// Goes on by one sample. Outcomes are appended to `told`.
    #[inline]
    pub(crate) fn step(&mut self, setting: &Setting, step: &Step, told: &mut Vec<Event>) -> Demand {
        let sensor = step.sensor;
        let dt_s = seconds(step.t_ns - self.feet[sensor].t_ns);
        if dt_s > LONGEST_STEP_S {
            self.lose(setting, sensor, dt_s);
        } else if dt_s > 0.0 {
            let foot = &mut self.feet[sensor];
            let made = advance(
                &mut foot.nav,
                &foot.last_w_ib_b,
                &step.w_ib_b,
                &step.f_b,
                dt_s,
                setting.gravity_m_s2,
            );
            foot.transition.extend(&made, &foot.nav.c_nb);
        }
        let foot = &mut self.feet[sensor];
        foot.t_ns = step.t_ns;
        foot.last_w_ib_b = step.w_ib_b;
        if foot.transition.dt_s() >= setting.tuning.covariance_interval_s * 0.99 {
            self.propagate(setting, sensor);
        }
        match (self.feet[sensor].stance.stands, step.stance) {
            (false, true) => {
                self.touch_down(setting, step, told);
                Demand::None
            }
            (true, true) => {
                self.stand(setting, step, dt_s, told);
                Demand::None
            }
            (true, false) => {
                self.lift_off(setting, sensor, told);
                Demand::None
            }
            (false, false) => self.swing(setting, sensor),
        }
    }

    fn propagate(&mut self, setting: &Setting, sensor: usize) {
        self.feet[sensor].transition.apply(&mut self.eskf.covariance, sensor, &setting.tuning.imu_noise);
    }

    /// Brings the covariance of every foot up to its last sample.
    pub(crate) fn propagate_all(&mut self, setting: &Setting) {
        for sensor in 0..F {
            if self.feet[sensor].transition.dt_s() > 0.0 {
                self.propagate(setting, sensor);
            }
        }
    }

    fn swing(&mut self, setting: &Setting, sensor: usize) -> Demand {
        if F < 2 || !setting.aids.separation {
            return Demand::None;
        }
        let other = &self.feet[1 - sensor];
        let (other_stands, other_p_n) = (other.stance.stands, other.nav.p_n);
        let foot = &mut self.feet[sensor];
        if !other_stands {
            return Demand::None;
        }
        match foot.swing.follow(&foot.nav.p_n, &foot.nav.v_n, &other_p_n) {
            Following::Nothing => Demand::None,
            Following::Nearest => Demand::Remember { sensor },
            Following::Passed => Demand::GoBack { sensor },
        }
    }

    fn touch_down(&mut self, setting: &Setting, step: &Step, told: &mut Vec<Event>) {
        let sensor = step.sensor;
        if F == 2 && setting.aids.separation {
            self.apply_symmetry(setting, sensor);
        }
        self.feet[sensor].stance.begin(step.t_ns);
        self.stand(setting, step, 0.0, told);
    }

    /// The separation of the feet, at the moment that `self` is a memory of.
    pub(crate) fn apply_separation(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        self.propagate_all(setting);
        let tuning = &setting.tuning;
        let along_n = *self.feet[sensor].swing.velocity_then_n();
        let observation = foot_separation(
            &self.feet[0].nav.p_n,
            &self.feet[1].nav.p_n,
            &along_n,
            tuning.separation_m,
            tuning.separation_sigma_m,
        );
        let (nis, accepted) = self.update(&observation, GATE_1);
        self.feet[sensor].swing.mark_used();
        told.push(Event::Aid(AidOutcome {
            t_ns: self.feet[sensor].t_ns,
            foot: None,
            aid: AidKind::Separation,
            nis,
            degrees_of_freedom: 1,
            updates: 1,
            accepted,
        }));
    }

    /// The stride that this foot has just made lies evenly about the other foot.
    fn apply_symmetry(&mut self, setting: &Setting, sensor: usize) {
        let foot = &self.feet[sensor];
        let (from_p_n, to_p_n) = (*foot.swing.start_p_n(), foot.nav.p_n);
        let length_m = (to_p_n - from_p_n).xy().norm();
        if !foot.swing.has_begun() || !(SHORTEST_STRIDE_M..LONGEST_STRIDE_M).contains(&length_m) {
            return;
        }
        let other = &self.feet[1 - sensor];
        // At heel strike the other may be about to leave the ground: where it stood is meant.
        let standing_p_n = if other.stance.stands { other.nav.p_n } else { *other.swing.start_p_n() };
        let just_left = seconds(foot.t_ns - other.swing.begun_ns()) < 0.25;
        let stood_just_now = other.stance.stands || (other.swing.has_begun() && just_left);
        if !stood_just_now {
            return;
        }
        self.propagate_all(setting);
        let sigma_along_m = setting.tuning.symmetry_share * length_m;
        let observation = stride_symmetry(
            sensor,
            1 - sensor,
            &from_p_n,
            &to_p_n,
            &standing_p_n,
            sigma_along_m,
            setting.tuning.symmetry_sigma_up_m,
        );
        self.update(&observation, GATE_2);
    }

    fn stand(&mut self, setting: &Setting, step: &Step, dt_s: f64, told: &mut Vec<Event>) {
        let sensor = step.sensor;
        let tuning = &setting.tuning;
        let foot = &mut self.feet[sensor];
        if foot.lost {
            self.find_level(step);
        }
        let foot = &mut self.feet[sensor];
        let w_nb_b = step.w_ib_b - foot.nav.gyro_bias_b;
        let stance = &mut foot.stance;
        stance.samples += 1;
        stance.rate_sum += step.w_ib_b;
        stance.force_sum += step.f_b;
        if let Some(pressure_hpa) = step.pressure_hpa {
            stance.pressure.0 += pressure_hpa;
            stance.pressure.1 += 1;
        }
        stance.magnetics.extend(&w_nb_b, dt_s, step.mag_b_ut.as_ref());
        let held_s =
            if stance.held_ns == i64::MIN { f64::INFINITY } else { seconds(step.t_ns - stance.held_ns) };
        if setting.aids.zupt && held_s >= tuning.covariance_interval_s * 0.99 {
            stance.held_ns = step.t_ns;
            if foot.transition.dt_s() > 0.0 {
                self.propagate(setting, sensor);
            }
            let v_n = self.feet[sensor].nav.v_n;
            let observation = zero_velocity(sensor, &v_n, step.zupt_sigma_m_s);
            let (nis, _) = self.update(&observation, f64::INFINITY);
            let stance = &mut self.feet[sensor].stance;
            stance.nis_sum += nis;
            stance.updates += 1;
        }
        // Somebody who stands for long: take the stand in pieces, so that a live track profits.
        let stood_s = seconds(step.t_ns - self.feet[sensor].stance.heading_ns);
        if stood_s >= 5.0 {
            self.close_stance(setting, sensor, told);
            let since_ns = self.feet[sensor].stance.since_ns;
            self.feet[sensor].stance.begin(step.t_ns);
            self.feet[sensor].stance.since_ns = since_ns;
        }
    }

    fn lift_off(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        self.close_stance(setting, sensor, told);
        let foot = &mut self.feet[sensor];
        foot.stance.stands = false;
        let p_n = foot.nav.p_n;
        let t_ns = foot.t_ns;
        foot.swing.begin(&p_n, t_ns);
        let azimuth_rad = heading(&foot.nav.c_nb);
        self.walked.stand(sensor, &p_n, azimuth_rad);
    }

    /// What a whole stance has shown: heading, rates, and whether the sensor hangs right.
    fn close_stance(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        if self.feet[sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, sensor);
        }
        let foot = &self.feet[sensor];
        let t_ns = foot.t_ns;
        let which = Some(setting.feet[sensor]);
        let outcome = |aid, nis, degrees_of_freedom, updates, accepted| {
            Event::Aid(AidOutcome { t_ns, foot: which, aid, nis, degrees_of_freedom, updates, accepted })
        };
        if foot.stance.updates > 0 {
            let nis = foot.stance.nis_sum / f64::from(foot.stance.updates);
            told.push(outcome(AidKind::Zupt, nis, 3, foot.stance.updates, true));
        }
        self.check_mounting(setting, sensor, told);
        if setting.aids.maru
            && let Some((nis, accepted)) = self.apply_rates(setting, sensor)
        {
            told.push(outcome(AidKind::Maru, nis, 3, 1, accepted));
        }
        if setting.aids.heading
            && let Some((nis, accepted)) = self.apply_heading(setting, sensor)
        {
            told.push(outcome(AidKind::Heading, nis, 1, 1, accepted));
        }
        if setting.aids.altimeter
            && let Some((nis, accepted)) = self.apply_height(setting, sensor)
        {
            told.push(outcome(AidKind::Altimeter, nis, 1, 1, accepted));
        }
        self.watch_heading(setting, sensor, told);
    }

    /// The height by the mean pressure of the stance; the first one takes the zero.
    fn apply_height(&mut self, setting: &Setting, sensor: usize) -> Option<(f64, bool)> {
        let foot = &mut self.feet[sensor];
        let (sum_hpa, readings) = foot.stance.pressure;
        if readings < 3 {
            return None;
        }
        let risen_m = pressure_height_m(sum_hpa / f64::from(readings));
        let p_n = foot.nav.p_n;
        let zero_m = *foot.altimeter_zero_m.get_or_insert(p_n.z - risen_m);
        let observation = height(sensor, &p_n, zero_m + risen_m, setting.tuning.altimeter_sigma_m);
        Some(self.update(&observation, GATE_1))
    }

    fn apply_heading(&mut self, setting: &Setting, sensor: usize) -> Option<(f64, bool)> {
        let tuning = &setting.tuning;
        let foot = &self.feet[sensor];
        if foot.stance.magnetics.readings() < 3 {
            return None;
        }
        let mag_b_ut = foot.stance.magnetics.mean_b_ut()?;
        let strength_ut = mag_b_ut.norm();
        if !(tuning.weakest_field_ut..=tuning.strongest_field_ut).contains(&strength_ut) {
            return Some((f64::INFINITY, false));
        }
        let observation = magnetic_heading(
            sensor,
            &foot.nav.c_nb,
            &mag_b_ut,
            setting.declination_rad,
            tuning.magnetic_heading_sigma_rad,
        );
        Some(self.update(&observation, GATE_1))
    }

    /// Magnetic angular rate over the stance; and for somebody who stands for long, the mean rate.
    fn apply_rates(&mut self, setting: &Setting, sensor: usize) -> Option<(f64, bool)> {
        let tuning = &setting.tuning;
        let foot = &self.feet[sensor];
        let stance = &foot.stance;
        let stood_s = seconds(foot.t_ns - stance.heading_ns);
        let ends = stance.magnetics.ends();
        let rate_mean = stance.rate_sum / f64::from(stance.samples.max(1));
        let gyro_bias_b = foot.nav.gyro_bias_b;
        let mut outcome = None;
        if let Some(ends) = ends {
            let change_ut = (ends.end_b_ut.norm() - ends.start_b_ut.norm()).abs();
            if change_ut < tuning.steady_field_ut {
                let sigma_ut = tuning.magnetometer_noise_ut * (2.0 / ends.readings as f64).sqrt() + 0.1;
                let observation = magnetic_rate(
                    sensor,
                    &ends.start_b_ut,
                    &ends.end_b_ut,
                    &ends.turn,
                    ends.duration_s,
                    sigma_ut,
                );
                outcome = Some(self.update(&observation, GATE_3));
            } else {
                outcome = Some((f64::INFINITY, false));
            }
        }
        if stood_s >= tuning.standing_s {
            let observation = zero_angular_rate(sensor, &rate_mean, &gyro_bias_b, tuning.sway_rad / stood_s);
            let zero_rate = self.update(&observation, GATE_3);
            outcome = outcome.or(Some(zero_rate));
        }
        outcome
    }

    /// After a stance gravity should stand upright; three times out of eight far from it means that
    /// the axes are not what the log says, or that the sensor has slipped.
    fn check_mounting(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let foot = &mut self.feet[sensor];
        if foot.stance.samples < 5 {
            return;
        }
        let f_n = foot.nav.c_nb * (foot.stance.force_sum / f64::from(foot.stance.samples));
        let tilt_rad = libm::atan2(f_n.xy().norm(), f_n.z);
        let before = foot.tilted_stances.count_ones();
        foot.tilted_stances = (foot.tilted_stances << 1) | u8::from(tilt_rad > 0.35);
        if before < 3 && foot.tilted_stances.count_ones() >= 3 {
            told.push(Event::Anomaly(Anomaly {
                kind: AnomalyKind::WrongMounting,
                foot: Some(setting.feet[sensor]),
                t_start_ns: foot.stance.since_ns,
                t_end_ns: foot.t_ns,
                samples: u64::from(foot.stance.samples),
                detail: format!(
                    "in stance the specific force stands {:.0}° from upright: the axes of gyro and accelerometer do not belong together, or the sensor has slipped; check that the log's axes are right-handed and the sensor is tied down",
                    tilt_rad.to_degrees()
                ),
            }));
        }
    }

    fn watch_heading(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let sigma = self.sigma_heading_rad(sensor);
        let uncertain = sigma > HEADING_UNCERTAIN_RAD;
        if uncertain && !self.heading_uncertain {
            let t_ns = self.feet[sensor].t_ns;
            told.push(Event::Anomaly(Anomaly {
                kind: AnomalyKind::HeadingUncertain,
                foot: Some(setting.feet[sensor]),
                t_start_ns: t_ns,
                t_end_ns: t_ns,
                samples: 0,
                detail: format!(
                    "the heading is uncertain by {:.0}° (1σ): only a marker or the magnetometer can mend it",
                    sigma.to_degrees()
                ),
            }));
        }
        self.heading_uncertain = uncertain;
    }

    /// Nothing is known of this foot for `dt_s`: it may be anywhere near, at any attitude.
    fn lose(&mut self, setting: &Setting, sensor: usize, dt_s: f64) {
        if self.feet[sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, sensor);
        }
        let foot = &mut self.feet[sensor];
        foot.nav.v_n = Vector3::zeros();
        foot.transition = Transition::none();
        foot.lost = true;
        foot.stance.stands = false;
        foot.swing = Default::default();
        let covariance = &mut self.eskf.covariance;
        let way_m = UNKNOWN_SPEED_M_S * dt_s;
        let height_m = 0.2 * dt_s;
        covariance.isolate(
            ErrorState::Velocity.of(sensor),
            Matrix3::identity() * (UNKNOWN_SPEED_M_S * UNKNOWN_SPEED_M_S),
        );
        let turn = (0.3 * dt_s).min(1.0);
        let heading_variance =
            covariance.block(ErrorState::Attitude.of(sensor), ErrorState::Attitude.of(sensor))[(2, 2)];
        covariance.isolate(
            ErrorState::Attitude.of(sensor),
            Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, heading_variance + turn * turn)),
        );
        let position = covariance.upper_mut(ErrorState::Position.of(sensor), ErrorState::Position.of(sensor));
        position[(0, 0)] += way_m * way_m;
        position[(1, 1)] += way_m * way_m;
        position[(2, 2)] += height_m * height_m;
    }

    /// Levels a foot that was lost by its specific force in the first sample of a stance.
    fn find_level(&mut self, step: &Step) {
        let foot = &mut self.feet[step.sensor];
        foot.nav.c_nb = level(&(step.f_b - foot.nav.accelerometer_bias_b), heading(&foot.nav.c_nb));
        foot.nav.v_n = Vector3::zeros();
        foot.lost = false;
    }

    /// A visit, applied to the feet as they are now.
    pub(crate) fn apply_visit(&mut self, setting: &Setting, visit: &Visit, t_ns: i64) -> VisitOutcome {
        self.propagate_all(setting);
        let (east_m, north_m, up_m) = visit.position_n_m;
        let middle = self.middle_p_n();
        let marker_n_m = Vector3::new(east_m, north_m, up_m.unwrap_or(middle.z));
        let sigma = setting.tuning.marker_sigma_m;
        // A height that was never surveyed is measured with a sigma that says nothing; and as height
        // drifts by scale errors that are no state, it weighs less the more it is off, so that it
        // never turns a visit down that is right in plan.
        let sigma_up = if up_m.is_some() { sigma.max((middle.z - marker_n_m.z).abs() / 4.0) } else { 1e4 };
        let sigma_m = Vector3::new(sigma, sigma, sigma_up);
        let positions: Vec<(usize, Vector3<f64>)> =
            self.feet.iter().enumerate().map(|(sensor, foot)| (sensor, foot.nav.p_n)).collect();
        let before = middle - marker_n_m;
        let mut outcome = VisitOutcome {
            marker: visit.marker.clone(),
            t_ns,
            before_minus_marker_n_m: before.into(),
            after_minus_marker_n_m: before.into(),
            nis: 0.0,
            degrees_of_freedom: if up_m.is_some() { 3 } else { 2 },
            accepted: false,
            reason: String::new(),
        };
        let observation = marker_position(&positions, &marker_n_m, &sigma_m);
        let (nis, accepted) = self.update(&observation, GATE_VISIT);
        outcome.nis = nis;
        outcome.accepted = accepted;
        // Two visits in a row that both say the same of the track outweigh the track.
        if !accepted
            && self.turned_down.is_some_and(|last| (last - before).norm() < 5.0 + 0.3 * before.norm())
        {
            self.widen_position(&before);
            outcome.accepted = self.update(&observation, f64::INFINITY).1;
        }
        self.turned_down = (!outcome.accepted).then_some(before);
        if outcome.accepted {
            self.last_marker = (t_ns, self.walked.distance_m(F));
            if up_m.is_some() {
                // A surveyed height is a better zero than one that has drifted since the start.
                for foot in &mut self.feet {
                    foot.altimeter_zero_m = None;
                }
            }
        } else {
            outcome.reason = format!(
                "{:.1} m from the marker in plan, where the track is sure to {:.1} m (1σ): a wrong marker, or a track that has gone astray; a second visit that says the same will be believed",
                before.xy().norm(),
                self.sigma_plan_m()
            );
        }
        outcome.after_minus_marker_n_m = (self.middle_p_n() - marker_n_m).into();
        outcome
    }

    /// Adds to the position's uncertainty, the same for all feet, so that an error `by` is nothing
    /// special any more.
    fn widen_position(&mut self, by: &Vector3<f64>) {
        for a in 0..F {
            for b in a..F {
                let block =
                    self.eskf.covariance.upper_mut(ErrorState::Position.of(a), ErrorState::Position.of(b));
                for axis in 0..3 {
                    block[(axis, axis)] += by.norm_squared();
                }
            }
        }
    }

    #[inline]
    fn update<const M: usize>(&mut self, observation: &Observation<M>, gate: f64) -> (f64, bool) {
        let update = self.eskf.update(observation, gate);
        let Some(correction) = update.correction else { return (update.nis, false) };
        for (sensor, foot) in self.feet.iter_mut().enumerate() {
            foot.nav.correct(sensor, &correction);
            self.walked.shift(sensor, &-correction[ErrorState::Position.of(sensor)]);
        }
        (update.nis, true)
    }

    fn middle_p_n(&self) -> Vector3<f64> {
        self.feet.iter().map(|foot| foot.nav.p_n).sum::<Vector3<f64>>() / F as f64
    }

    /// Covariance of the middle of the feet, m².
    fn middle_covariance(&self) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        for a in 0..F {
            for b in 0..F {
                sum += self.eskf.covariance.block(ErrorState::Position.of(a), ErrorState::Position.of(b));
            }
        }
        sum / (F * F) as f64
    }

    fn sigma_plan_m(&self) -> f64 {
        let covariance = self.middle_covariance();
        (covariance[(0, 0)] + covariance[(1, 1)]).max(0.0).sqrt()
    }

    fn sigma_heading_rad(&self, sensor: usize) -> f64 {
        let attitude = ErrorState::Attitude.of(sensor);
        self.eskf.covariance.block(attitude, attitude)[(2, 2)].max(0.0).sqrt()
    }

    /// Length of the path so far, m.
    pub(crate) fn distance_m(&self) -> f64 {
        self.walked.distance_m(F)
    }

    /// Where the inspector is at `t_ns`, the time of the last step.
    #[inline]
    pub(crate) fn point(&self, setting: &Setting, t_ns: i64) -> TrackPoint {
        let mut feet = [None; 2];
        let mut middle = Vector3::zeros();
        for (sensor, foot) in self.feet.iter().enumerate() {
            // A foot whose last sample is older than the epoch has moved on at its velocity.
            let late_s = seconds(t_ns - foot.t_ns);
            let p_n = if late_s > 0.0 && late_s < 0.05 {
                foot.nav.p_n + foot.nav.v_n * late_s
            } else {
                foot.nav.p_n
            };
            middle += p_n;
            feet[setting.feet[sensor].index()] =
                Some(FootPoint { position_n_m: p_n.into(), stance: foot.stance.stands });
        }
        middle /= F as f64;
        let covariance = self.middle_covariance();
        let sigma = |axis: usize| covariance[(axis, axis)].max(0.0).sqrt();
        let [left, right] = feet;
        TrackPoint {
            t_ns,
            position_n_m: middle.into(),
            heading_rad: self.walked.heading_rad(heading(&self.feet[0].nav.c_nb)),
            sigma_heading_rad: self.sigma_heading_rad(0),
            sigma_n_m: [sigma(0), sigma(1), sigma(2)],
            covariance_en_m2: covariance[(0, 1)],
            left,
            right,
        }
    }

    /// Whether all numbers are finite and no variance negative.
    pub(crate) fn is_sound(&self) -> bool {
        self.feet.iter().all(|foot| foot.nav.is_finite()) && self.eskf.covariance.is_sound()
    }

    /// Gives the blocks of one foot their first covariance.
    pub(crate) fn set_first_covariance(&mut self, sensor: usize, variances: [Matrix3<f64>; BLOCKS_A_SENSOR]) {
        for (k, block) in variances.into_iter().enumerate() {
            self.eskf.covariance.set_diagonal(sensor * BLOCKS_A_SENSOR + k, block);
        }
    }

    /// Makes the first positions of both feet known to each other by `sigma_m` on each axis, while
    /// the session's own start is known by `start_sigma_m`.
    pub(crate) fn set_first_positions(&mut self, start_sigma_m: f64, sigma_m: f64) {
        let common = SMatrix::<f64, 3, 3>::identity() * (start_sigma_m * start_sigma_m);
        for a in 0..F {
            for b in a..F {
                let own = if a == b { Matrix3::identity() * (sigma_m * sigma_m) } else { Matrix3::zeros() };
                *self.eskf.covariance.upper_mut(ErrorState::Position.of(a), ErrorState::Position.of(b)) =
                    common + own;
            }
        }
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
