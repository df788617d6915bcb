//! What the devices on and around the cabin make of its motion.

use nalgebra::{Rotation3, Vector3};

use super::super::earth::Earth;
use super::super::imu::{Imu, ImuModel};
use super::super::motion::{Kinematics, Mounting};
use super::super::random::{Purpose, Random};
use super::RunPlan;
use super::course::{CabinMotion, Course, PlatformMotion, State};
use super::fault::FaultKind;
use super::geometry::{
    DELAY_SIGMA_S, Geometry, MOUNTING_RAD, PILLAR_M, ROTATOR_RAD, STATION_DELAY_SIGMA_S, SURVEY_M,
};
use super::rows::{EncoderReading, PoseTruth, SimulatedRun};
use crate::rotation::{Angles, Forward};
use crate::sample::ImuSample;

/// Time between two samples of an inertial sensor, and between two rows of antennas and encoders, ns.
const SAMPLE_NS: i64 = 5_000_000;
pub(super) const ROW_NS: i64 = 50_000_000;

/// A run's devices, with all that is constant of their errors drawn.
pub(super) struct Devices<'a> {
    pub(super) plan: &'a RunPlan,
    pub(super) geometry: &'a Geometry,
    pub(super) course: &'a Course,
    pub(super) seed: u64,
    /// Where antennas, prisms and stations are in truth.
    pub(super) antennas_b: Vec<Vector3<f64>>,
    pub(super) stations_n: Vec<Vector3<f64>>,
    pub(super) delay_s: [f64; 2],
    pub(super) station_delay_s: f64,
    /// By how much the world's sigmas differ from the usual.
    pub(super) scale: f64,
    mounting_rad: [Vector3<f64>; 2],
    leg_bias_m: [f64; 6],
}

impl<'a> Devices<'a> {
    pub(super) fn new(
        plan: &'a RunPlan,
        geometry: &'a Geometry,
        course: &'a Course,
        seed: u64,
    ) -> Devices<'a> {
        let mut survey = Random::new(seed, Random::COMMON, Purpose::Survey);
        let mut moved = |all: &[Vector3<f64>], sigma: f64| -> Vec<Vector3<f64>> {
            all.iter().map(|place| place + Vector3::from(survey.normal_3()) * sigma).collect()
        };
        let (antennas_b, stations_n) =
            (moved(&geometry.antennas_b, SURVEY_M), moved(&geometry.stations_n, PILLAR_M));
        let mounting_rad = [0, 1].map(|_| Vector3::from(survey.normal_3()) * MOUNTING_RAD);
        let delay_s = geometry.delay_s.map(|stated_s| stated_s + DELAY_SIGMA_S * survey.normal());
        Devices {
            plan,
            geometry,
            course,
            seed,
            antennas_b,
            stations_n,
            delay_s,
            station_delay_s: geometry.station_delay_s + STATION_DELAY_SIGMA_S * survey.normal(),
            scale: survey.uniform(0.8, 1.25),
            mounting_rad,
            leg_bias_m: [0; 6].map(|_| 0.0006 * survey.normal()),
        }
    }

    pub(super) fn run(&self) -> SimulatedRun {
        SimulatedRun {
            instrument: self.geometry.to_toml(),
            imu: self.cabin_imu(),
            platform_imu: self.platform_imu(),
            antennas: self.antennas(),
            stations: self.stations(),
            encoders: self.encoders(),
            truth: self.poses(ROW_NS, true),
            plan: self.poses(200_000_000, false),
            notes: self.notes(),
        }
    }

    pub(super) fn is(&self, kind: FaultKind, t_s: f64) -> bool {
        self.plan.faults.iter().any(|fault| fault.holds(kind, t_s))
    }

    pub(super) fn at(&self, t_s: f64) -> State {
        self.course.at_time(t_s, true)
    }

    fn end_ns(&self) -> i64 {
        (self.course.end_s() * 1e9) as i64
    }

    pub(super) fn ticks(&self, every_ns: i64) -> impl Iterator<Item = i64> + use<> {
        let end_ns = self.end_ns();
        (0..).map(move |k| k * every_ns).take_while(move |t_ns| *t_ns <= end_ns)
    }

    fn cabin_imu(&self) -> Vec<ImuSample> {
        let turned = Rotation3::from_scaled_axis(self.mounting_rad[0]).into_inner() * self.geometry.c_bs;
        let mounting = Mounting { lever_arm_b_m: self.geometry.imu_b, c_bs: turned };
        let mut sensors = [0, 3].map(|stream| self.sensor(mounting, stream));
        let motion = CabinMotion(self.course);
        let restarts = self.plan.faults.iter().filter(|fault| fault.kind == FaultKind::Restart);
        let restarted_s = restarts.map(|fault| fault.from_s).fold(f64::INFINITY, f64::min);
        let mut samples = Vec::new();
        for t_ns in self.ticks(SAMPLE_NS).skip(1) {
            let t_s = t_ns as f64 * 1e-9;
            let sensor = &mut sensors[usize::from(t_s > restarted_s)];
            let (_, reading) = sensor.sample(&motion, t_ns);
            if !self.is(FaultKind::Restart, t_s) {
                samples.push(sample(t_ns, &reading));
            }
        }
        samples
    }

    fn platform_imu(&self) -> Vec<ImuSample> {
        let turned = Rotation3::from_scaled_axis(self.mounting_rad[1]).into_inner() * self.geometry.c_ps;
        let mounting = Mounting { lever_arm_b_m: self.geometry.platform_imu_p, c_bs: turned };
        let mut sensor = self.sensor(mounting, 1);
        let motion = PlatformMotion(self.course);
        self.ticks(SAMPLE_NS).skip(1).map(|t_ns| sample(t_ns, &sensor.sample(&motion, t_ns).1)).collect()
    }

    /// A sensor of table 1 of the paper.
    fn sensor(&self, mounting: Mounting, stream: usize) -> Imu {
        let model = ImuModel {
            rate_hz: 200.0,
            gyro_noise_deg_s_rthz: 2.9e-7_f64.to_degrees(),
            gyro_bias_deg_s: 4.85e-8_f64.to_degrees(),
            accel_noise_m_s2_rthz: 1e-4,
            accel_bias_m_s2: 9.8e-4,
            scale: 2e-5,
            ..ImuModel::perfect()
        };
        Imu::new(&model, mounting, Earth::curved(&self.geometry.site, true), self.seed, stream)
    }

    fn encoders(&self) -> Vec<EncoderReading> {
        let mut noise = Random::new(self.seed, Random::COMMON, Purpose::EncoderNoise);
        let phases = [0; 6].map(|_| noise.uniform(0.0, std::f64::consts::TAU));
        // Drawn apart: a fault does not change the others' noise.
        let mut faults = Random::new(self.seed, Random::COMMON, Purpose::Fault);
        let wrong_m =
            [0; 6].map(|_| faults.uniform(0.02, 0.1) * if faults.normal() > 0.0 { 1.0 } else { -1.0 });
        let mut rows = Vec::new();
        for t_ns in self.ticks(ROW_NS) {
            let state = self.at(t_ns as f64 * 1e-9);
            let angles_rad = [state.a_rad, state.b_rad].map(|angle| angle + ROTATOR_RAD * noise.normal());
            let legs_m = std::array::from_fn(|leg| {
                let arm_r = state.c_rp * self.geometry.joints_p[leg];
                let length_m = (state.t_r + arm_r - self.geometry.joints_r[leg]).norm();
                // A screw's wave, once in 10 mm.
                let wave = libm::sin(length_m / 0.010 * std::f64::consts::TAU + phases[leg]) * 0.00018;
                let t_s = t_ns as f64 * 1e-9;
                let wrong_m = if self.is(FaultKind::WrongLeg(leg), t_s) { wrong_m[leg] } else { 0.0 };
                length_m + self.leg_bias_m[leg] + wave + wrong_m + 0.0001 * noise.normal()
            });
            if !self.is(FaultKind::NoEncoders, t_ns as f64 * 1e-9) {
                rows.push(EncoderReading { t_ns, angles_rad, legs_m });
            }
        }
        rows
    }

    fn poses(&self, every_ns: i64, swings: bool) -> Vec<PoseTruth> {
        self.ticks(every_ns)
            .map(|t_ns| {
                let state = self.course.at_time(t_ns as f64 * 1e-9, swings);
                PoseTruth {
                    t_ns,
                    cabin: pose(&state.cabin),
                    platform: pose(&state.platform),
                    velocity_n_m_s: state.cabin.velocity_n_m_s.into(),
                }
            })
            .collect()
    }

    fn notes(&self) -> Vec<String> {
        let [l, b] = self.delay_s;
        let mut notes = vec![
            format!("delays in truth: L {l:.4} s, B {b:.4} s, stations {:.4} s", self.station_delay_s),
            format!("biases of the legs: {:?} m", self.leg_bias_m),
            format!("errors of the antennas: {:.2} of the usual", self.scale),
        ];
        notes.extend(self.plan.faults.iter().map(|fault| format!("fault: {fault}")));
        notes
    }
}

fn pose(body: &Kinematics) -> [f64; 6] {
    let Angles { heading_rad, pitch_rad, roll_rad } = Angles::of(&body.c_nb, Forward::Y);
    let p = body.position_n_m;
    [p.x, p.y, p.z, heading_rad, pitch_rad, roll_rad]
}

fn sample(t_ns: i64, reading: &super::super::imu::ImuReading) -> ImuSample {
    // Nine digits, as instruments of this class write.
    let digits = |x: f64, unit: f64| libm::round(x / unit) * unit;
    ImuSample {
        t_ns,
        w_ib_b_rad_s: reading.w_is_s_rad_s.map(|x| digits(x, 1e-12)),
        f_b_m_s2: reading.f_s_m_s2.map(|x| digits(x, 1e-9)),
        mag_b_ut: None,
        pressure_hpa: None,
    }
}
