//! The filter of the pole: a strapdown with its errors, and what they are measured with.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::coupling::RateCoupling;
use super::states::{BLOCKS, STATES};
use super::tuning::Tuning;
use crate::ins::earth::Earth;
use crate::ins::eskf::Eskf;
use crate::ins::imu_noise::GaussMarkov;
use crate::ins::layout::ErrorState::{AccelerometerBias, Attitude, GyroBias, Position, Velocity};
use crate::ins::lever_arm::LeverArm;
use crate::ins::nav_state::NavState;
use crate::ins::observation::Observation;
use crate::ins::strapdown::{ImuInterval, Strapdown};
use crate::measure::tip_velocity::tip_velocity;
use crate::rotation::skew;

/// A tip that is drawn anew may be anywhere within this, m.
const ANYWHERE_M: f64 = 3.0;

/// Everything that is estimated, and how its errors are correlated.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    pub(super) strapdown: Strapdown,
    pub(super) eskf: Eskf<BLOCKS>,
    pub(super) cross: [Vector3<f64>; 2],
    pub(super) walking_b: Vector3<f64>,
    pub(super) antenna: LeverArm,
    pub(super) tip: Option<LeverArm>,
    /// Up the pole, in b.
    up_b: Vector3<f64>,
    pub(super) phase: [Vector3<f64>; 2],
    pub(super) slow_n: Vector3<f64>,
    /// Stationary sigma by axis, m, and how long it stays, s.
    slow: (Vector3<f64>, f64),
    pub(super) roundness_m: f64,
    pub(super) place_n: Vector3<f64>,
    /// What the receiver's clock shows more than the sensor's, s.
    pub(super) clock_s: f64,
    couplings: [RateCoupling; 3],
}

/// How sure the first attitude and position are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Certainty {
    /// Covariance of the attitude error, rad².
    pub(super) attitude: Matrix3<f64>,
    /// Sigma of the position, m.
    pub(super) position_m: f64,
}

impl Filter {
    /// At the start, in this state.
    pub(super) fn new(
        tuning: &Tuning,
        nav: NavState,
        certainty: &Certainty,
        antenna_b_m: Vector3<f64>,
        tip_b_m: Option<Vector3<f64>>,
    ) -> Filter {
        let start = &tuning.start;
        let mut eskf = Eskf::<BLOCKS>::new();
        let mut set = |block: usize, sigmas: Vector3<f64>| {
            eskf.covariance.set_diagonal(block, Matrix3::from_diagonal(&sigmas.component_mul(&sigmas)));
        };
        let imu = STATES.imu;
        let all = Vector3::repeat;
        set(imu.block(GyroBias), all(start.gyro_bias_rad_s));
        set(imu.block(Position), all(certainty.position_m));
        set(imu.block(Velocity), all(start.velocity_m_s));
        set(imu.block(AccelerometerBias), all(start.accelerometer_bias_m_s2));
        for scale in [imu.gyro_scale(), imu.accelerometer_scale()].into_iter().flatten() {
            set(scale.block(), all(start.scale));
        }
        STATES.cross.iter().for_each(|cross| set(cross.block(), all(start.cross_rad)));
        set(STATES.antenna.block(), all(start.lever_arm_m));
        set(STATES.clock.block(), Vector3::new(start.clock_s, 0.0, 0.0));
        // What is in the hand leans in no way that is known, and walks without a stick.
        if tip_b_m.is_some() {
            let [plan, height] = start.phase_m;
            STATES.phase.iter().for_each(|phase| set(phase.block(), Vector3::new(plan, plan, height)));
            set(STATES.walking.block(), all(start.walking_rad_s));
            set(STATES.tip.block(), all(start.lever_arm_m));
            set(STATES.roundness.block(), Vector3::new(start.roundness_m, 0.0, 0.0));
        }
        eskf.covariance.set_diagonal(imu.block(Attitude), certainty.attitude);
        let up_b = tip_b_m.map_or(Vector3::z(), |tip_b_m| (antenna_b_m - tip_b_m).normalize());
        Filter {
            strapdown: Strapdown::new(imu, nav),
            eskf,
            cross: [Vector3::zeros(); 2],
            walking_b: Vector3::zeros(),
            antenna: LeverArm::estimated(antenna_b_m, STATES.antenna),
            tip: tip_b_m.map(|tip_b_m| LeverArm::estimated(tip_b_m, STATES.tip)),
            up_b,
            phase: [Vector3::zeros(); 2],
            slow_n: Vector3::zeros(),
            slow: (Vector3::zeros(), f64::INFINITY),
            roundness_m: 0.0,
            place_n: Vector3::zeros(),
            clock_s: 0.0,
            couplings: Default::default(),
        }
    }

    /// Goes on by an interval of readings, in which so much of the extra bias of walking is there.
    pub(super) fn advance(&mut self, earth: &Earth, interval: &ImuInterval, walking: f64) {
        let rate = interval.w_ib_b - self.strapdown.nav.gyro_bias_b;
        let seen = [Vector3::new(rate.y, rate.z, rate.x), Vector3::new(rate.z, rate.x, rate.y)];
        let extra = self.cross[0].component_mul(&seen[0])
            + self.cross[1].component_mul(&seen[1])
            + self.walking_b * walking;
        let before = self.strapdown.nav.c_nb;
        self.strapdown.advance(earth, &ImuInterval { w_ib_b: interval.w_ib_b - extra, ..*interval });
        let c_nb = (before + self.strapdown.nav.c_nb) * 0.5;
        let dt_s = interval.dt_s;
        let pushed_n = c_nb * self.strapdown.corrected_force(&interval.f_b) * dt_s;
        let [first, second, third] = &mut self.couplings;
        first.extend(dt_s, &c_nb, &pushed_n, &seen[0]);
        second.extend(dt_s, &c_nb, &pushed_n, &seen[1]);
        if self.tip.is_some() {
            third.extend(dt_s, &c_nb, &pushed_n, &Vector3::repeat(walking));
        }
    }

    /// How long ago the errors were brought up to date, s.
    pub(super) fn unpropagated_s(&self) -> f64 {
        self.strapdown.unpropagated_s()
    }

    /// Brings the errors up to the last interval.
    pub(super) fn propagate(&mut self, tuning: &Tuning, earth: &Earth) {
        let dt_s = self.strapdown.unpropagated_s();
        if dt_s == 0.0 {
            return;
        }
        self.strapdown.propagate(&mut self.eskf, earth, &tuning.imu);
        let of = [STATES.cross[0], STATES.cross[1], STATES.walking];
        for (coupling, variable) in self.couplings.iter_mut().zip(of) {
            coupling.apply(&mut self.eskf, variable.block());
        }
        let (sigma, time_s) = self.slow;
        let process = GaussMarkov { sigma: 1.0, correlation_time_s: time_s };
        let (kept, growth) = (process.kept(dt_s), process.growth(dt_s));
        if growth > 0.0 {
            let slow = STATES.slow.block();
            self.eskf.scale(slow, &Vector3::repeat(kept));
            self.slow_n *= kept;
            self.eskf.add_noise(&[slow], &(sigma.component_mul(&sigma) * growth));
        }
    }

    /// The slow error of the solution is another one from here on, with these sigmas (m), and stays so long (s).
    pub(super) fn draw_slow_error(&mut self, sigma_n_m: Vector3<f64>, time_s: f64) {
        self.slow = (sigma_n_m, time_s);
        self.slow_n = Vector3::zeros();
        let block = Matrix3::from_diagonal(&sigma_n_m.component_mul(&sigma_n_m));
        self.eskf.isolate(STATES.slow.block(), block);
    }

    /// How the pole leans: east and north components of the unit vector up it.
    fn up_n(&self) -> Vector3<f64> {
        self.strapdown.nav.c_nb * self.up_b
    }

    /// The measurement that the solution is at `p_n_m`, with so much noise of its own, while the gyro reads `w_ib_b`: where
    /// the receiver's clock is ahead by δ the antenna was there δ earlier, and was behind by v δ.
    pub(super) fn fix(
        &self,
        p_n_m: &Vector3<f64>,
        white_n_m: &Vector3<f64>,
        w_ib_b: &Vector3<f64>,
    ) -> Observation<3> {
        let noise = Matrix3::from_diagonal(&white_n_m.component_mul(white_n_m));
        let position = self.antenna.position(&self.strapdown);
        let up_n = self.up_n();
        let leaning = self.phase[0] * up_n.x + self.phase[1] * up_n.y;
        let nav = &self.strapdown.nav;
        let turning = (w_ib_b - nav.gyro_bias_b).cross(&self.antenna.arm_b_m);
        let antenna_n_m_s = nav.v_n + nav.c_nb * turning;
        let mut by_clock = Matrix3::zeros();
        by_clock.set_column(0, &antenna_n_m_s);
        let measured = p_n_m - self.slow_n - leaning + antenna_n_m_s * self.clock_s;
        let observation = position
            .observed(&self.strapdown, &self.antenna, &measured, &noise)
            .with_variable(Some(STATES.slow), -Matrix3::identity())
            .with_variable(Some(STATES.clock), by_clock);
        match self.tip {
            None => observation,
            Some(_) => observation
                .with_variable(Some(STATES.phase[0]), Matrix3::identity() * -up_n.x)
                .with_variable(Some(STATES.phase[1]), Matrix3::identity() * -up_n.y),
        }
    }

    /// Where the tip touches the ground, or would; `None` without a tip.
    pub(super) fn touch_n_m(&self) -> Option<Vector3<f64>> {
        let tip = self.tip.as_ref()?;
        let mut lean_n = self.up_n();
        lean_n.z = 0.0;
        let nav = &self.strapdown.nav;
        Some(nav.p_n + nav.c_nb * tip.arm_b_m - lean_n * self.roundness_m)
    }

    /// The measurement that the tip touches the ground where it has stood.
    pub(super) fn stands(&self, [plan_m, height_m]: [f64; 2]) -> Option<Observation<3>> {
        let tip = self.tip.as_ref()?;
        let up_n = self.up_n();
        let lean_n = Vector3::new(up_n.x, up_n.y, 0.0);
        // The tip is where the ground is and as far on as it has rolled.
        let stands_n = self.place_n + lean_n * self.roundness_m;
        let (plan, height) = (plan_m * plan_m, height_m * height_m);
        let noise = Matrix3::from_diagonal(&Vector3::new(plan, plan, height));
        let mut by_roundness = Matrix3::zeros();
        by_roundness.set_column(0, &lean_n);
        let mut rolled = skew(&up_n) * -self.roundness_m;
        rolled.row_mut(2).fill(0.0);
        let position = tip.position(&self.strapdown);
        let states = self.strapdown.states();
        Some(
            Observation::new(position.p_n - stands_n, noise)
                .with(states.block(Position), Matrix3::identity())
                .with(states.block(Attitude), position.by_attitude + rolled)
                .with_variable(tip.state, position.by_arm)
                .with_variable(Some(STATES.roundness), by_roundness)
                .with_variable(Some(STATES.place), -Matrix3::identity()),
        )
    }

    /// The measurement that the tip has no velocity while the gyro reads `w_ib_b`.
    pub(super) fn has_no_velocity(
        &self,
        earth: &Earth,
        w_ib_b: &Vector3<f64>,
        sigma_m_s: f64,
    ) -> Option<Observation<3>> {
        let tip = self.tip.as_ref()?;
        Some(tip_velocity(&self.strapdown, tip, w_ib_b, earth, sigma_m_s))
    }

    /// The tip stands at a place of which nothing is known but what the filter knows of the tip.
    pub(super) fn land(&mut self) {
        let Some(touch_n_m) = self.touch_n_m() else { return };
        self.place_n = touch_n_m;
        let anywhere = Matrix3::from_diagonal_element(ANYWHERE_M * ANYWHERE_M);
        self.eskf.isolate(STATES.place.block(), anywhere);
    }

    /// The ground has crept.
    pub(super) fn creep(&mut self, creep_m_sqrt_s: [f64; 2], dt_s: f64) {
        let [plan, height] = creep_m_sqrt_s.map(|creep| creep * creep * dt_s);
        self.eskf.add_noise(&[STATES.place.block()], &Vector3::new(plan, plan, height));
    }

    /// Weighs a measurement; gives its normalised innovation squared and whether it was used.
    pub(super) fn weigh(&mut self, observation: &Observation<3>, gate: f64) -> (f64, bool) {
        let update = self.eskf.update(observation, gate);
        match update.correction {
            Some(correction) => {
                self.correct(&correction);
                (update.nis, true)
            }
            None => (update.nis, false),
        }
    }

    /// Takes estimated errors off the state.
    pub(super) fn correct(&mut self, correction: &[Vector3<f64>; BLOCKS]) {
        self.strapdown.correct(correction);
        for (cross, variable) in self.cross.iter_mut().zip(STATES.cross) {
            *cross += correction[variable.block()];
        }
        self.walking_b += correction[STATES.walking.block()];
        self.antenna.correct(correction);
        for (phase, variable) in self.phase.iter_mut().zip(STATES.phase) {
            *phase += correction[variable.block()];
        }
        self.slow_n += correction[STATES.slow.block()];
        if let Some(tip) = &mut self.tip {
            tip.correct(correction);
        }
        self.roundness_m += correction[STATES.roundness.block()].x;
        self.place_n -= correction[STATES.place.block()];
        self.clock_s += correction[STATES.clock.block()].x;
    }

    /// How the errors show in what is reported: the position of the touch (or the antenna without a tip), and the heading
    /// about the vertical. For each block three columns.
    pub(super) fn shows(&self) -> Vec<(usize, SMatrix<f64, 4, 3>)> {
        let states = self.strapdown.states();
        let mut by_attitude = SMatrix::<f64, 4, 3>::zeros();
        by_attitude[(3, 2)] = 1.0;
        let mut shows = vec![(states.block(Position), upper(&Matrix3::identity()))];
        match &self.tip {
            None => {
                let position = self.antenna.position(&self.strapdown);
                by_attitude += upper(&position.by_attitude);
                shows.push((STATES.antenna.block(), upper(&position.by_arm)));
            }
            Some(tip) => {
                let position = tip.position(&self.strapdown);
                let up_n = self.up_n();
                let mut rolled = skew(&up_n) * -self.roundness_m;
                rolled.row_mut(2).fill(0.0);
                by_attitude += upper(&(position.by_attitude + rolled));
                let mut by_roundness = Matrix3::zeros();
                by_roundness.set_column(0, &Vector3::new(up_n.x, up_n.y, 0.0));
                shows.push((STATES.tip.block(), upper(&position.by_arm)));
                shows.push((STATES.roundness.block(), upper(&by_roundness)));
            }
        }
        shows.push((states.block(Attitude), by_attitude));
        shows
    }
}

/// The first three of four rows.
fn upper(m: &Matrix3<f64>) -> SMatrix<f64, 4, 3> {
    SMatrix::from_fn(|r, c| if r < 3 { m[(r, c)] } else { 0.0 })
}

#[cfg(test)]
#[path = "filter_tests.rs"]
mod tests;
