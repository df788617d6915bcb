//! What a survey happens in: the pole, its sensor, its receiver, the ground and who walks with it.
//!
//! The usual world is one kind of pole with one class of sensor, whose figures differ little from seed to seed. A drawn world is
//! another pole at each seed. Its ranges are those of data sheets and of field work, never of what an estimator copes with:
//! inertial sensors from a phone's chip to the tactical grade of MEMS, receivers of 1 to 20 positions a second that say
//! of themselves half or twice what is true, aluminium and carbon poles of 1.4 to 2.5 m, lawn and concrete.

use std::str::FromStr;

use nalgebra::{Matrix2, Matrix3, Rotation3, Vector3};

use super::super::imu::ImuModel;
use super::super::random::{Purpose, Random};
use super::gnss::GnssModel;

/// Which worlds surveys happen in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Worlds {
    /// One kind of pole.
    #[default]
    Usual,
    /// Another pole, sensor, receiver, ground and walker at each seed.
    Drawn,
}

impl FromStr for Worlds {
    type Err = String;

    fn from_str(text: &str) -> Result<Worlds, String> {
        match text {
            "usual" => Ok(Worlds::Usual),
            "drawn" => Ok(Worlds::Drawn),
            _ => Err(format!("expected one of usual, drawn, found {text:?}")),
        }
    }
}

/// A world.
#[derive(Clone, Debug)]
pub(super) struct World {
    /// Latitude and longitude, degrees, and height, m.
    pub(super) origin: [f64; 3],
    pub(super) pole: PoleModel,
    pub(super) imu: ImuModel,
    pub(super) more: MoreBias,
    pub(super) gnss: GnssModel,
    pub(super) gait: Gait,
    pub(super) ground: Ground,
    pub(super) opening: Opening,
}

/// The pole.
#[derive(Clone, Debug)]
pub(super) struct PoleModel {
    /// From the sensor, in the pole's axes (z up the pole), m.
    pub(super) antenna_m: Vector3<f64>,
    pub(super) tip_m: Vector3<f64>,
    /// How the sensor sits on it.
    pub(super) c_bs: Matrix3<f64>,
    /// 1σ of what was measured of the arms, m.
    pub(super) measured_m: f64,
    /// How far the tip rolls as the pole leans by one, m.
    pub(super) roundness_m: f64,
    /// How far the sensor is bent aside while the pole carries a load, m: as it leans by a fifth, and by the push of a step.
    pub(super) bend_m: [f64; 2],
    /// Ringing: speed at the strike, m/s; rate, Hz; time in which it decays by e, s.
    pub(super) ring: [[f64; 2]; 3],
}

/// What the gyro's and the accelerometer's bias have more than turn-on and random walk.
#[derive(Clone, Debug)]
pub(super) struct MoreBias {
    /// Of the gyro while walking, rad/s.
    pub(super) walking: Vector3<f64>,
    /// Of the gyro by specific force, rad/s per m/s².
    pub(super) by_force: Matrix3<f64>,
    /// Gyro (rad/s) and accelerometer (m/s²): what they change by as the sensor warms up, and as it comes under the roof.
    pub(super) warm: [Vector3<f64>; 2],
    pub(super) roof: [Vector3<f64>; 2],
    /// Both come about with this time, s.
    pub(super) warms_in_s: f64,
}

/// How it is walked with.
#[derive(Clone, Debug)]
pub(super) struct Gait {
    /// Between two landings, m.
    pub(super) step_m: [f64; 2],
    /// On the ground, in the air, and on the point, s.
    pub(super) ground_s: [f64; 2],
    pub(super) air_s: [f64; 2],
    pub(super) point_s: [f64; 2],
    /// How high the tip is lifted, m.
    pub(super) lift_m: f64,
    /// Lean at a landing and at the lift-off, rad.
    pub(super) leans: [[f64; 2]; 2],
    /// How the pole is turned in the hand from landing to landing, rad.
    pub(super) turn_rad: f64,
    /// How much the hand trembles, rad.
    pub(super) tremble_rad: f64,
}

/// What it lands on.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    /// Share of the landings in which the tip slips, and by how much in plan and height, m.
    pub(super) slips: f64,
    pub(super) slip_m: [f64; 2],
    /// How far the tip sinks at most in each landing, m, and for how long it does, s.
    pub(super) sink_m: f64,
    pub(super) sinks_s: f64,
}

/// The leaning under open sky.
#[derive(Clone, Debug)]
pub(super) struct Opening {
    /// Held before it, s.
    pub(super) held_s: f64,
    /// How long it is leaned at the start and at the end, s.
    pub(super) lasts_s: [f64; 2],
    /// Amplitudes of a wave of leaning and of turning, rad.
    pub(super) lean_rad: f64,
    pub(super) turn_rad: f64,
    /// How fast, of the usual.
    pub(super) pace: f64,
}

/// What a seed's world is made of, for a person to read.
pub fn described(worlds: Worlds, seed: u64) -> String {
    format!("{:#?}", World::of(worlds, seed))
}

impl World {
    pub(super) fn of(worlds: Worlds, seed: u64) -> World {
        match worlds {
            Worlds::Usual => World::usual(seed),
            Worlds::Drawn => super::drawn::world(seed),
        }
    }

    /// The usual one.
    pub(super) fn usual(seed: u64) -> World {
        let mut world = Random::new(seed, Random::COMMON, Purpose::Calibration);
        let mut draw = |from: f64, to: f64| world.uniform(from, to);
        let origin = [draw(-60.0, 60.0), draw(-180.0, 180.0), draw(0.0, 1500.0)];
        let half_m = draw(0.9, 1.05);
        let antenna_m = Vector3::new(draw(-0.03, 0.03), draw(-0.03, 0.03), half_m);
        let tip_m = Vector3::new(draw(-0.03, 0.03), draw(-0.03, 0.03), draw(0.0, 0.1) - half_m);
        let roundness_m = draw(0.0, 0.01);
        let walking = Vector3::new(draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-1.0, 1.0)) * 6e-4;
        let class = draw(0.7, 1.4);
        let sky = [draw(0.7, 1.3), draw(0.7, 1.3)];
        World {
            origin,
            pole: PoleModel {
                antenna_m,
                tip_m,
                c_bs: Matrix3::identity(),
                measured_m: 0.002,
                roundness_m,
                bend_m: [0.0; 2],
                ring: [[0.03, 0.15], [7.0, 15.0], [0.06, 0.14]],
            },
            imu: ImuModel {
                rate_hz: 200.0,
                averaging: true,
                gyro_noise_deg_s_rthz: 0.004 * class,
                gyro_bias_deg_s: 0.35,
                gyro_bias_walk_deg_s_rts: 9e-4 * class,
                accel_noise_m_s2_rthz: 0.001 * class,
                accel_bias_m_s2: 0.08,
                accel_bias_walk_m_s2_rts: 2e-4 * class,
                scale: 1e-3 * class,
                misalignment_rad: 1e-3 * class,
                gyro_range_deg_s: 1000.0,
                accel_range_g: 16.0,
                sixteen_bits: true,
            },
            more: MoreBias {
                walking,
                by_force: Matrix3::zeros(),
                warm: [Vector3::zeros(); 2],
                roof: [Vector3::zeros(); 2],
                warms_in_s: 300.0,
            },
            gnss: GnssModel::usual(sky),
            gait: Gait {
                step_m: [1.85, 2.15],
                ground_s: [0.68, 1.02],
                air_s: [1.75, 2.25],
                point_s: [7.5, 10.5],
                lift_m: 0.15,
                leans: [[0.08, 0.2], [0.1, 0.24]],
                turn_rad: 0.05,
                tremble_rad: 0.002,
            },
            ground: Ground { slips: 0.35, slip_m: [0.003, 0.0008], sink_m: 0.0, sinks_s: 0.2 },
            opening: Opening { held_s: 6.0, lasts_s: [60.0; 2], lean_rad: 0.11, turn_rad: 0.15, pace: 1.0 },
        }
    }

    /// The arms as they were measured, in the sensor's axes, m: antenna and tip.
    pub(super) fn told(&self, normal: &mut Random) -> [Vector3<f64>; 2] {
        let told = [self.pole.antenna_m, self.pole.tip_m]
            .map(|arm| arm + Vector3::from(normal.normal_3()) * self.pole.measured_m);
        told.map(|arm| self.pole.c_bs.tr_mul(&arm))
    }

    /// By how much the phase centre moves as the pole leans by one to the east, and to the north, m.
    pub(super) fn phase(&self, normal: &mut Random) -> Matrix2<f64> {
        Matrix2::from_fn(|_, _| self.gnss.phase_m * normal.normal())
    }
}

/// A mounting that is turned any way about the pole and tilted by this, rad.
pub(super) fn mounting(turned_rad: f64, tilted_rad: [f64; 2]) -> Matrix3<f64> {
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), tilted_rad[0])
        * Rotation3::from_axis_angle(&Vector3::y_axis(), tilted_rad[1]);
    (Rotation3::from_axis_angle(&Vector3::z_axis(), turned_rad) * tilt).into_inner()
}

impl MoreBias {
    /// What a reading at a time has more, of which so much of the extra bias of walking; under the roof since `roof_s`: rate
    /// (rad/s) and specific force (m/s²).
    pub(super) fn at(
        &self,
        t_s: f64,
        walked: f64,
        roof_s: f64,
        f: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let share = |since_s: f64| 1.0 - libm::exp(-since_s.max(0.0) / self.warms_in_s);
        let (warm, roof) = (share(t_s), share(t_s - roof_s));
        let [gyro, force] = [0, 1].map(|of: usize| self.warm[of] * warm + self.roof[of] * roof);
        (gyro + self.walking * walked + self.by_force * f, force)
    }
}
