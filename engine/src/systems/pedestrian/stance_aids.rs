//! What a standing foot gives the filter: zero velocity at every moment, and at the end of the stance
//! its rates, its heading, its height, and whether the sensor still hangs right.

use nalgebra::{Matrix3, Vector2, Vector3};

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
pub(super) const SHORTEST_STAND_S: f64 = 0.2;
/// So many stances in a row in a field that cannot be the site's, and it is told.
const ODD_FIELD_STANCES: u32 = 5;
/// How much a stance counts in what field is usual for a foot: a hundred of them are a way that no crate and hardly a hall is
/// as long as.
const USUAL_FIELD_SHARE: f64 = 0.01;
/// Beyond this from the usual a field counts less, µT: more than a foot's own iron does in a turn.
const STRANGE_FIELD_UT: f64 = 2.0;
/// Below this a horizontal field tells no direction, µT.
const WEAKEST_HORIZONTAL_UT: f64 = 1.0;
/// A swing that is integrated rightly ends slower than this, m/s: 0.1 at most for the CMP10A, 0.8 for
/// recorded walks; with two axes swapped it ends at 1.5 to 4.
pub(super) const FASTEST_LANDING_M_S: f64 = 1.5;
/// Somebody who stands for longer is taken in pieces of this length, so that a live track profits, s.
const PIECE_OF_A_STAND_S: f64 = 5.0;
/// And who is taken up or down meanwhile, in pieces of this one, s.
const PIECE_OF_A_RIDE_S: f64 = 1.0;

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
        let rides = self.feet[sensor].ride.moves(step.t_ns);
        if stood_s >= if rides { PIECE_OF_A_RIDE_S } else { PIECE_OF_A_STAND_S } {
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
        let observation = zero_velocity(sensor, &self.feet[sensor].nav.v_n, sigma_m_s);
        let (nis, _) = self.update(&observation, f64::INFINITY);
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
            && let Some((nis, accepted)) = self.apply_heading(setting, sensor)
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
        let observation = height(sensor, &p_n, zero_m + risen_m - drift_m, setting.tuning.altimeter_sigma_m)
            .with(surroundings(F), surroundings_row(PRESSURE_DRIFT, -1.0));
        Some(self.weigh_height(setting, sensor, &observation, GATE_1, told))
    }

    pub(super) fn apply_heading(&mut self, setting: &Setting, sensor: usize) -> Option<(f64, bool)> {
        let tuning = &setting.tuning;
        let foot = &self.feet[sensor];
        if foot.stance.magnetics.readings() < 3 || foot.doubts.field_left_out {
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
        Some(self.update(&observation, GATE_1))
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
        let sigma_rad = setting.tuning.magnetic_heading_sigma_rad;
        let mut observation = self.heading_observation(setting, sensor, c_nb, mag_b_ut, sigma_rad);
        // The attitude was taken from this very field: what is left is rounding.
        observation.innovation[0] = 0.0;
        self.update(&observation, f64::INFINITY);
        let b_n_ut = c_nb * mag_b_ut;
        self.feet[sensor].usual_field_ut = Some((b_n_ut.xy().norm(), b_n_ut.z));
    }

    /// How far the field of a stance may be turned by what makes its strength and dip unusual, rad;
    /// learns what is usual for this foot.
    ///
    /// A disturbance points anywhere. Of its three components two show, in the horizontal and in the
    /// vertical strength, and the third, which turns the field, is as large as those on the mean.
    pub(super) fn weigh_field(&mut self, sensor: usize, b_n_ut: &Vector3<f64>) -> f64 {
        let (horizontal_ut, up_ut) = (b_n_ut.xy().norm(), b_n_ut.z);
        let usual = self.feet[sensor].usual_field_ut.get_or_insert((horizontal_ut, up_ut));
        let (off_horizontal_ut, off_up_ut) = (horizontal_ut - usual.0, up_ut - usual.1);
        let off_ut = libm::hypot(off_horizontal_ut, off_up_ut);
        // What is unusual pulls little on what is usual.
        let share = USUAL_FIELD_SHARE * (STRANGE_FIELD_UT / off_ut.max(STRANGE_FIELD_UT));
        usual.0 += share * off_horizontal_ut;
        usual.1 += share * off_up_ut;
        let disturbed_rad = off_ut / horizontal_ut.max(WEAKEST_HORIZONTAL_UT);
        let foot = &mut self.feet[sensor];
        foot.field_stances = (foot.field_stances + 1.0).min(1.0 / USUAL_FIELD_SHARE);
        foot.field_spread_rad2 +=
            (disturbed_rad.min(1.0).powi(2) - foot.field_spread_rad2) / foot.field_stances;
        foot.field_reach.take(&foot.nav.p_n, Vector2::new(off_horizontal_ut, off_up_ut));
        disturbed_rad
    }

    /// Magnetic angular rate over the stance; and for somebody who stands for long, the mean rate.
    pub(super) fn apply_rates(&mut self, setting: &Setting, sensor: usize) -> Option<(f64, bool)> {
        let tuning = &setting.tuning;
        let foot = &self.feet[sensor];
        let stance = &foot.stance;
        let stood_s = seconds(foot.t_ns - stance.heading_ns);
        let ends = stance.magnetics.ends().filter(|_| !foot.doubts.field_left_out);
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
        let cause = if tilted(foot) && !before.0 {
            WalkCause::TiltedInStance { tilt_deg: tilt_rad.to_degrees() }
        } else if fast(foot) && !before.1 {
            WalkCause::FastLandings { landing_speed_m_s: speed_m_s }
        } else {
            return;
        };
        told.push(of_stance(&cause, setting.feet[sensor], foot));
    }

    pub(super) fn watch_heading(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let sigma = self.told_covariance().1.max(self.sigma_heading_rad(sensor).powi(2)).sqrt();
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
