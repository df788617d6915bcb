//! One body with an inertial sensor, and what is fixed to it: the cabin with antennas, prisms and the jointed platform under
//! it, or the platform by itself with its own prisms.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::instrument::{Instrument, matrix, vectors};
use super::joints::Joints;
use crate::ins::earth::Earth;

/// Where a prism sits.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) enum Target {
    /// On the body itself, in its axes, m.
    Body(Vector3<f64>),
    /// On the platform that joints carry, in p, m.
    Platform(Vector3<f64>),
    /// On another body: of no use here.
    Elsewhere,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Rig {
    pub(super) earth: Earth,
    /// Whether an inertial sensor is read.
    pub(super) has_imu: bool,
    /// From the body's origin to the inertial sensor, in b, m.
    pub(super) lever_b: Vector3<f64>,
    pub(super) c_bs: Matrix3<f64>,
    pub(super) mounting_sigma_rad: f64,
    pub(super) noise: SensorNoise,
    pub(super) antennas: Vec<Antenna>,
    pub(super) antenna_sigma_m: f64,
    /// What each make delays, s.
    pub(super) make_delay_s: Vec<f64>,
    pub(super) make_names: Vec<String>,
    pub(super) make_delay_sigma_s: f64,
    pub(super) stations_n: Vec<Vector3<f64>>,
    pub(super) station: StationNoise,
    pub(super) targets: Vec<Target>,
    pub(super) joints: Option<Joints>,
    pub(super) leg_sigma_m: f64,
    /// What the encoders delay, and how well that is known, s.
    pub(super) encoder_delay_s: f64,
    pub(super) encoder_delay_sigma_s: f64,
    pub(super) rotator_sigma_rad: f64,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Antenna {
    pub(super) position_b: Vector3<f64>,
    pub(super) make: usize,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct SensorNoise {
    pub(super) gyro_bias_rad_s: f64,
    pub(super) accelerometer_bias_m_s2: f64,
    pub(super) accelerometer_scale: f64,
    pub(super) angle_random_walk: f64,
    pub(super) velocity_random_walk: f64,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct StationNoise {
    pub(super) position_m: f64,
    pub(super) delay_s: f64,
    pub(super) delay_sigma_s: f64,
    pub(super) delay_jitter_s: f64,
    pub(super) angle_rad: f64,
    pub(super) slant_m: f64,
    pub(super) slant_ppm: f64,
}

impl Rig {
    /// The cabin; `with_joints` says whether encoders are read.
    pub(super) fn of_cabin(instrument: &Instrument, with_joints: bool) -> Rig {
        let makes = instrument.makes();
        let make_of = |name: &str| makes.iter().position(|make| *make == name).unwrap_or(0);
        let body = vectors(&instrument.targets_cabin.position_b).into_iter().map(Target::Body);
        let jointed = vectors(&instrument.targets_platform.position_p)
            .into_iter()
            .map(|place| if with_joints { Target::Platform(place) } else { Target::Elsewhere });
        Rig {
            lever_b: Vector3::from(instrument.imu.position_b),
            c_bs: matrix(&instrument.imu.c_b_s),
            mounting_sigma_rad: instrument.imu.mounting_sigma_rad,
            antennas: (vectors(&instrument.antennas.position_b).into_iter())
                .zip(&instrument.antennas.make)
                .map(|(position_b, make)| Antenna { position_b, make: make_of(make) })
                .collect(),
            make_delay_s: makes.iter().map(|make| instrument.antennas.delay_s[*make]).collect(),
            make_names: makes.iter().map(ToString::to_string).collect(),
            targets: body.chain(jointed).collect(),
            joints: with_joints.then(|| Joints::new(instrument)),
            ..Rig::bare(instrument)
        }
    }

    /// The platform by itself: by its own inertial sensor, where that is read, and the stations.
    pub(super) fn of_platform(instrument: &Instrument, with_imu: bool) -> Rig {
        let elsewhere = instrument.targets_cabin.names.iter().map(|_| Target::Elsewhere);
        let own = vectors(&instrument.targets_platform.position_p).into_iter().map(Target::Body);
        let mut rig = Rig { targets: elsewhere.chain(own).collect(), ..Rig::bare(instrument) };
        rig.has_imu = with_imu && instrument.platform_imu.is_some();
        if let Some(imu) = instrument.platform_imu.as_ref().filter(|_| rig.has_imu) {
            rig.lever_b = Vector3::from(imu.position_p);
            rig.c_bs = matrix(&imu.c_p_s);
            rig.mounting_sigma_rad = imu.mounting_sigma_rad;
        }
        rig
    }

    /// Earth, stations and the class of sensor, and nothing on the body.
    fn bare(instrument: &Instrument) -> Rig {
        let (imu, stations) = (&instrument.imu, &instrument.stations);
        Rig {
            earth: instrument.earth(),
            has_imu: true,
            lever_b: Vector3::zeros(),
            c_bs: Matrix3::identity(),
            mounting_sigma_rad: 0.0,
            noise: SensorNoise {
                gyro_bias_rad_s: imu.gyro_bias_sigma_rad_s,
                accelerometer_bias_m_s2: imu.accelerometer_bias_sigma_m_s2,
                accelerometer_scale: imu.accelerometer_scale_sigma,
                angle_random_walk: imu.angle_random_walk_rad_sqrt_s,
                velocity_random_walk: imu.velocity_random_walk_m_s_sqrt_s,
            },
            antennas: Vec::new(),
            antenna_sigma_m: instrument.antennas.position_sigma_m,
            make_delay_s: Vec::new(),
            make_names: Vec::new(),
            make_delay_sigma_s: instrument.antennas.delay_sigma_s,
            stations_n: vectors(&stations.position_n),
            station: StationNoise {
                position_m: stations.position_sigma_m,
                delay_s: stations.delay_s,
                delay_sigma_s: stations.delay_sigma_s,
                delay_jitter_s: stations.delay_jitter_s,
                angle_rad: stations.angle_sigma_rad,
                slant_m: stations.slant_sigma_m,
                slant_ppm: stations.slant_ppm,
            },
            targets: Vec::new(),
            joints: None,
            leg_sigma_m: instrument.stewart.leg_sigma_m,
            encoder_delay_s: instrument.stewart.delay_s,
            encoder_delay_sigma_s: instrument.stewart.delay_sigma_s,
            rotator_sigma_rad: instrument.rotator.angle_sigma_rad,
        }
    }

    /// The middle of the antennas, in b, m.
    pub(super) fn antenna_centre_b(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self.antennas.iter().map(|antenna| antenna.position_b).sum();
        sum / (self.antennas.len().max(1) as f64)
    }
}
