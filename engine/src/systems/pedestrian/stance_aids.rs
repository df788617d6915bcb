//! What a standing foot gives the filter: zero velocity at every moment, and at the end of the stance
//! its rates, its heading, its height, and whether the sensor still hangs right.

use nalgebra::{Matrix3, Vector3};

use super::aids;
use super::causes::WalkCause;
use super::filter::{Filter, GATE_1, GATE_3, Setting, seconds};
use super::foot::{FootState, Step};
use super::side::Side;
use super::slow_errors::{
    DEFLECTION, PRESSURE_DRIFT, deviation, deviation_row, surroundings, surroundings_row,
};
use crate::anomaly::Cause;
use crate::event::{AidOutcome, Event};
use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;
use crate::measure::height::{height, pressure_height_m};
use crate::measure::magnetic_heading::magnetic_heading;
use crate::measure::magnetic_rate::magnetic_rate;
use crate::measure::zero_angular_rate::zero_angular_rate;
use crate::measure::zero_velocity::zero_velocity;
use crate::rotation::heading;

/// The heading of the linearised filter means nothing beyond this sigma, rad.
const HEADING_UNCERTAIN_RAD: f64 = 0.5;
/// Stances that are shorter say nothing of the mounting: a foot that runs is taken to stand in
/// mid-swing now and then, s.
const SHORTEST_STAND_S: f64 = 0.2;
/// So many stances in a row in a field that cannot be the site's, and it is told.
const ODD_FIELD_STANCES: u32 = 5;
/// How much a stance counts in what field is usual for a foot.
const USUAL_FIELD_SHARE: f64 = 0.03;
/// Beyond this from the usual a field counts less, µT: more than a foot's own iron does in a turn.
const STRANGE_FIELD_UT: f64 = 2.0;
/// The iron that a foot carries adds no more than this to the site's field, µT.
const CARRIED_FIELD_UT: f64 = 3.0;
/// A swing that is integrated rightly ends slower than this, m/s: 0.1 at most for the CMP10A, 0.8 for
/// recorded walks; with two axes swapped it ends at 1.5 to 4.
const FASTEST_LANDING_M_S: f64 = 1.5;
/// By then a foot that has come down has taken up the velocity that its swing was wrong by, s.
const SETTLED_S: f64 = 0.15;
/// How much a stance counts in how well the altimeter agrees.
const ALTIMETER_NIS_SHARE: f64 = 0.03;
/// A pressure that disagrees for longer is no door that opens, s.
const LASTING_PRESSURE_S: f64 = 7.0;
/// A stride of a walk takes about so long, s.
const STEADY_STRIDE_S: f64 = 1.0;
/// Doors, ventilation and gusts change the pressure by no more than this, as height, m.
const MOST_BY_AIR_M: f64 = 4.0;
/// A compass that disagrees for so many stances,
pub(super) const LASTING_COMPASS_STANCES: u32 = 8;
/// and so far, has met no passing iron, m.
const LASTING_COMPASS_M: f64 = 12.0;
/// By what share of the way a place is doubted when compass and gyro have contradicted each other once,
const CONTRADICTED_ONCE: f64 = 0.05;
/// and again,
const CONTRADICTED_AGAIN: f64 = 0.6;
/// and when a sensor is mounted otherwise than its log says.
const WRONGLY_MOUNTED: f64 = 0.3;
/// In a stance so long, s,
const SURE_STAND_S: f64 = 0.4;
/// a tilt of this is no matter of integration, rad: the sensor was turned on the foot.
const SLIPPED_RAD: f64 = 0.5;
/// Somebody who stands for longer is taken in pieces of this length, so that a live track profits, s.
const PIECE_OF_A_STAND_S: f64 = 5.0;

impl<const B: usize, const F: usize> Filter<B, F> {
    pub(super) fn stand(&mut self, setting: &Setting, step: &Step, dt_s: f64, told: &mut Vec<Event>) {
        let sensor = step.sensor;
        let foot = &mut self.feet[sensor];
        if foot.lost {
            self.find_level(step);
        }
        let foot = &mut self.feet[sensor];
        let w_nb_b = step.w_ib_b - foot.nav.gyro_bias_b;
        let stance = &mut foot.stance;
        if stance.samples == 0 {
            stance.first_c_nb = foot.nav.c_nb;
            stance.first_speed_m_s = foot.nav.v_n.norm();
        }
        stance.samples += 1;
        stance.rate_sum += step.w_ib_b;
        stance.force_sum += step.f_b;
        if let Some(pressure_hpa) = step.pressure_hpa {
            stance.pressure.0 += pressure_hpa;
            stance.pressure.1 += 1;
        }
        stance.magnetics.extend(&w_nb_b, dt_s, step.mag_b_ut.as_ref());
        if setting.aids.zupt {
            self.hold(setting, step);
        }
        let stood_s = seconds(step.t_ns - self.feet[sensor].stance.heading_ns);
        if stood_s >= PIECE_OF_A_STAND_S {
            self.close_stance(setting, sensor, told);
            let since_ns = self.feet[sensor].stance.since_ns;
            self.feet[sensor].stance.begin(step.t_ns);
            self.feet[sensor].stance.since_ns = since_ns;
        }
    }

    /// Holds the velocity at zero, often when the foot has just come down and then ever less so, but as much
    /// the firmer: in all, a stance says as much as if it were held once in every interval.
    fn hold(&mut self, setting: &Setting, step: &Step) {
        let sensor = step.sensor;
        let interval_s = setting.tuning.hold_interval_s;
        let stance = &mut self.feet[sensor].stance;
        if !stance.is_hold_due(step.t_ns, &setting.tuning) {
            return;
        }
        let since_s =
            if stance.held_ns == i64::MIN { interval_s } else { seconds(step.t_ns - stance.held_ns) };
        let sigma_m_s = step.zupt_sigma_m_s * (interval_s / since_s).min(1.0).sqrt();
        stance.held_ns = step.t_ns;
        if self.feet[sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, sensor);
        }
        let before_v_n = self.feet[sensor].nav.v_n;
        let observation = zero_velocity(sensor, &before_v_n, sigma_m_s);
        let (nis, _) = self.update(&observation, f64::INFINITY);
        let slip_time_s = setting.tuning.slip_time_s;
        let foot = &mut self.feet[sensor];
        let taken_n = before_v_n - foot.nav.v_n;
        // What the swing has left is no slip.
        if seconds(step.t_ns - foot.stance.since_ns) > SETTLED_S {
            let kept = (1.0 - since_s / slip_time_s).max(0.0);
            let stance = &mut foot.stance;
            stance.missed_n = stance.missed_n * kept + (stance.taken_n + taken_n * 0.5) * since_s;
            stance.taken_n = stance.taken_n * kept + taken_n;
        }
        let stance = &mut self.feet[sensor].stance;
        stance.nis_sum += nis;
        stance.updates += 1;
    }

    /// What a whole stance has shown: heading, rates, and whether the sensor hangs right.
    pub(super) fn close_stance(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        if self.feet[sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, sensor);
        }
        self.stretch(sensor);
        self.drift(setting, sensor);
        let foot = &self.feet[sensor];
        let t_ns = foot.t_ns;
        let stream = Some(setting.feet[sensor].stream());
        let outcome = |aid, nis, degrees_of_freedom, updates, accepted| {
            Event::Aid(AidOutcome { t_ns, stream, aid, nis, degrees_of_freedom, updates, accepted })
        };
        if foot.stance.updates > 0 {
            let nis = foot.stance.nis_sum / f64::from(foot.stance.updates);
            told.push(outcome(aids::ZUPT, nis, 3, foot.stance.updates, true));
        }
        self.check_mounting(setting, sensor, told);
        self.check_field(setting, sensor, told);
        if setting.aids.maru
            && let Some((nis, accepted)) = self.apply_rates(setting, sensor)
        {
            told.push(outcome(aids::MARU, nis, 3, 1, accepted));
        }
        if setting.aids.heading
            && let Some((nis, accepted)) = self.apply_heading(setting, sensor, told)
        {
            told.push(outcome(aids::HEADING, nis, 1, 1, accepted));
        }
        if setting.aids.altimeter
            && let Some((nis, accepted)) = self.apply_height(setting, sensor, told)
        {
            told.push(outcome(aids::ALTIMETER, nis, 1, 1, accepted));
        }
        self.watch_heading(setting, sensor, told);
    }

    /// The height by the mean pressure of the stance; the first one takes the zero.
    pub(super) fn apply_height(
        &mut self,
        setting: &Setting,
        sensor: usize,
        told: &mut Vec<Event>,
    ) -> Option<(f64, bool)> {
        let foot = &mut self.feet[sensor];
        let (sum_hpa, readings) = foot.stance.pressure;
        if readings < 3 {
            return None;
        }
        let risen_m = pressure_height_m(sum_hpa / f64::from(readings));
        let p_n = foot.nav.p_n;
        let zero_m = *foot.altimeter_zero_m.get_or_insert(p_n.z - risen_m);
        let drift_m = self.slow.surroundings[PRESSURE_DRIFT];
        // An altimeter that is off more than it may be is worse than assumed: its innovations say by how much.
        let sigma_m = setting.tuning.altimeter_sigma_m * foot.altimeter_nis.max(1.0).sqrt();
        let observation = height(sensor, &p_n, zero_m + risen_m - drift_m, sigma_m)
            .with(surroundings(F), surroundings_row(PRESSURE_DRIFT, -1.0));
        let (nis, accepted) = self.update(&observation, GATE_1);
        let foot = &mut self.feet[sensor];
        foot.altimeter_nis += ALTIMETER_NIS_SHARE * (nis.min(GATE_1) - foot.altimeter_nis);
        // Or the steps are: that they drift apart does not say which of both does.
        let worse = (foot.altimeter_nis - 1.0).max(0.0);
        let walk_m = setting.tuning.imu_noise.height_random_walk_m_sqrt_s;
        self.eskf.add_noise(
            &[ErrorState::Position.of(sensor)],
            &Vector3::new(0.0, 0.0, walk_m * walk_m * worse * STEADY_STRIDE_S),
        );
        let foot = &mut self.feet[sensor];
        if accepted {
            foot.altimeter_doubt.end();
            return Some((nis, true));
        }
        let off_m = -observation.innovation[0];
        let (times, lasted_s) = foot.altimeter_doubt.go_on(foot.t_ns, off_m > 0.0);
        let large = off_m.abs() > 1.5 * MOST_BY_AIR_M;
        if times < 2 || (lasted_s < LASTING_PRESSURE_S && !large) {
            return Some((nis, false));
        }
        foot.altimeter_doubt.end();
        let cause = WalkCause::HeightContradicted { pressure_minus_track_m: off_m };
        told.push(of_stance(&cause, setting.feet[sensor], foot));
        // Something has carried the walker up or down, or the pressure has changed otherwise, by little at most.
        let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
        self.eskf.add_noise(&positions, &Vector3::new(0.0, 0.0, off_m * off_m));
        let by_air_m = off_m.abs().min(MOST_BY_AIR_M);
        let mut drift = Vector3::zeros();
        drift[PRESSURE_DRIFT] = by_air_m * by_air_m;
        self.eskf.add_noise(&[surroundings(F)], &drift);
        Some(self.update(&observation, f64::INFINITY))
    }

    pub(super) fn apply_heading(
        &mut self,
        setting: &Setting,
        sensor: usize,
        told: &mut Vec<Event>,
    ) -> Option<(f64, bool)> {
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
        let c_nb = foot.nav.c_nb;
        let disturbed_rad = self.weigh_field(sensor, &(c_nb * mag_b_ut));
        let sigma_rad = libm::hypot(tuning.magnetic_heading_sigma_rad, disturbed_rad);
        let observation = self.heading_observation(setting, sensor, &c_nb, &mag_b_ut, sigma_rad);
        let (nis, accepted) = self.update(&observation, GATE_1);
        let foot = &mut self.feet[sensor];
        if accepted {
            foot.compass_doubt.end();
            foot.compass_believed_n = foot.nav.p_n;
            return Some((nis, true));
        }
        let off_rad = observation.innovation[0];
        let (times, _) = foot.compass_doubt.go_on(foot.t_ns, off_rad > 0.0);
        let way_m = (foot.nav.p_n - foot.compass_believed_n).xy().norm();
        if times < LASTING_COMPASS_STANCES || way_m < LASTING_COMPASS_M {
            return Some((nis, false));
        }
        foot.compass_doubt.end();
        let cause = WalkCause::HeadingContradicted { compass_minus_gyro_deg: off_rad.to_degrees() };
        told.push(of_stance(&cause, setting.feet[sensor], foot));
        self.doubted_share = if self.doubted_share > 0.0 { CONTRADICTED_AGAIN } else { CONTRADICTED_ONCE };
        let foot = &mut self.feet[sensor];
        // Either may be wrong, by as much, and the way since they last agreed with it.
        let way_m = way_m * off_rad.abs().min(2.0);
        foot.compass_believed_n = foot.nav.p_n;
        let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
        self.eskf.add_noise(&positions, &Vector3::new(way_m * way_m, way_m * way_m, 0.0));
        let turned = off_rad * off_rad;
        self.eskf.add_noise(&[ErrorState::Attitude.of(sensor)], &Vector3::new(0.0, 0.0, turned));
        self.eskf.add_noise(&[deviation(sensor, F)], &Vector3::new(turned, 0.0, 0.0));
        Some(self.update(&observation, f64::INFINITY))
    }

    /// The field's azimuth, with what deviates it as far as that is estimated.
    fn heading_observation(
        &self,
        setting: &Setting,
        sensor: usize,
        c_nb: &Matrix3<f64>,
        mag_b_ut: &Vector3<f64>,
        sigma_rad: f64,
    ) -> Observation<1> {
        let row = deviation_row(heading(c_nb));
        let deviated_rad = (row * self.feet[sensor].deviation_rad)[0] + self.slow.surroundings[DEFLECTION];
        magnetic_heading(sensor, c_nb, mag_b_ut, setting.declination_rad + deviated_rad, sigma_rad)
            .with(deviation(sensor, F), -row)
            .with(surroundings(F), surroundings_row(DEFLECTION, -1.0))
    }

    /// The heading of the standing start, of which nothing else is known.
    pub(crate) fn take_first_heading(
        &mut self,
        setting: &Setting,
        sensor: usize,
        c_nb: &Matrix3<f64>,
        mag_b_ut: &Vector3<f64>,
    ) {
        let b_n_ut = c_nb * mag_b_ut;
        let found = (b_n_ut.xy().norm(), b_n_ut.z);
        // What a foot carries itself is usual for it; more stands beside the start.
        let usual = setting
            .site_field_ut
            .filter(|site| libm::hypot(found.0 - site.0, found.1 - site.1) > CARRIED_FIELD_UT)
            .unwrap_or(found);
        self.feet[sensor].usual_field_ut = Some(usual);
        // A start beside iron shows in strength and dip, where the site's are known.
        let disturbed_rad = self.weigh_field(sensor, &b_n_ut);
        let sigma_rad = libm::hypot(setting.tuning.magnetic_heading_sigma_rad, disturbed_rad);
        let mut observation = self.heading_observation(setting, sensor, c_nb, mag_b_ut, sigma_rad);
        // The attitude was taken from this very field: what is left is rounding.
        observation.innovation[0] = 0.0;
        self.update(&observation, f64::INFINITY);
    }

    /// How far the field of a stance may be turned by what makes its strength and dip unusual, rad;
    /// learns what is usual for this foot.
    ///
    /// A disturbance points anywhere. Of its three components two show, in the horizontal and in the
    /// vertical strength, and the third, which turns the field, is as large as those on the mean.
    fn weigh_field(&mut self, sensor: usize, b_n_ut: &Vector3<f64>) -> f64 {
        let (horizontal_ut, up_ut) = (b_n_ut.xy().norm(), b_n_ut.z);
        let usual = self.feet[sensor].usual_field_ut.get_or_insert((horizontal_ut, up_ut));
        let (off_horizontal_ut, off_up_ut) = (horizontal_ut - usual.0, up_ut - usual.1);
        let off_ut = libm::hypot(off_horizontal_ut, off_up_ut);
        // What is unusual pulls little on what is usual.
        let share = USUAL_FIELD_SHARE * (STRANGE_FIELD_UT / off_ut.max(STRANGE_FIELD_UT));
        usual.0 += share * off_horizontal_ut;
        usual.1 += share * off_up_ut;
        off_ut / horizontal_ut.max(1.0)
    }

    /// Magnetic angular rate over the stance; and for somebody who stands for long, the mean rate.
    pub(super) fn apply_rates(&mut self, setting: &Setting, sensor: usize) -> Option<(f64, bool)> {
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

    /// A field that is never the site's own: a magnet nearby, or a magnetometer that needs calibrating.
    fn check_field(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let tuning = &setting.tuning;
        let foot = &mut self.feet[sensor];
        let Some(mag_b_ut) = foot.stance.magnetics.mean_b_ut() else { return };
        let strength_ut = mag_b_ut.norm();
        if (tuning.weakest_field_ut..=tuning.strongest_field_ut).contains(&strength_ut) {
            foot.odd_field_stances = 0;
            return;
        }
        foot.odd_field_stances += 1;
        if foot.odd_field_stances == ODD_FIELD_STANCES {
            let cause = WalkCause::MagneticField {
                weakest_ut: tuning.weakest_field_ut,
                strongest_ut: tuning.strongest_field_ut,
                stances: ODD_FIELD_STANCES,
                found_ut: strength_ut,
            };
            told.push(of_stance(&cause, setting.feet[sensor], foot));
        }
    }

    /// After a swing gravity should stand upright and the foot come to rest by its own strapdown.
    /// Three times out of eight far from the one, or six from the other, means that the axes are not
    /// what the log says, or that the sensor has slipped.
    pub(super) fn check_mounting(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let foot = &mut self.feet[sensor];
        if seconds(foot.t_ns - foot.stance.since_ns) < SHORTEST_STAND_S {
            return;
        }
        // By the attitude that the swing has left: zero velocity would level the foot in the stance.
        let f_n = foot.stance.first_c_nb * (foot.stance.force_sum / f64::from(foot.stance.samples));
        let tilt_rad = libm::atan2(f_n.xy().norm(), f_n.z);
        let speed_m_s = foot.stance.first_speed_m_s;
        let tilted = |foot: &FootState| foot.tilted_stances.count_ones() >= 3;
        let fast = |foot: &FootState| foot.fast_landings.count_ones() >= 6;
        let before = (tilted(foot), fast(foot));
        foot.tilted_stances = (foot.tilted_stances << 1) | u8::from(tilt_rad > 0.35);
        foot.fast_landings = (foot.fast_landings << 1) | u8::from(speed_m_s > FASTEST_LANDING_M_S);
        let slipped = tilt_rad > SLIPPED_RAD
            && !foot.slipped
            && seconds(foot.t_ns - foot.stance.since_ns) > SURE_STAND_S;
        foot.slipped = tilt_rad > SLIPPED_RAD;
        let cause = if (tilted(foot) && !before.0) || slipped {
            WalkCause::TiltedInStance { tilt_deg: tilt_rad.to_degrees() }
        } else if fast(foot) && !before.1 {
            WalkCause::FastLandings { landing_speed_m_s: speed_m_s }
        } else {
            return;
        };
        told.push(of_stance(&cause, setting.feet[sensor], foot));
        self.doubted_share = self.doubted_share.max(WRONGLY_MOUNTED);
    }

    pub(super) fn watch_heading(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let sigma = self.sigma_heading_rad(sensor);
        let uncertain = sigma > HEADING_UNCERTAIN_RAD;
        if uncertain && !self.heading_uncertain {
            let t_ns = self.feet[sensor].t_ns;
            let cause = WalkCause::HeadingUncertain { sigma_heading_deg: sigma.to_degrees() };
            told.push(Event::Anomaly(cause.anomaly(Some(setting.feet[sensor].stream()), [t_ns; 2], 0)));
        }
        self.heading_uncertain = uncertain;
    }
}

/// What a stance has shown to be wrong, from its beginning until now.
fn of_stance(cause: &WalkCause, side: Side, foot: &FootState) -> Event {
    let samples = u64::from(foot.stance.samples);
    Event::Anomaly(cause.anomaly(Some(side.stream()), [foot.stance.since_ns, foot.t_ns], samples))
}
