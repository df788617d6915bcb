//! The sensor on a shoe: the CMP10A by its figures, a perfect one, and what lies between.

use nalgebra::{Matrix3, Vector3};

use crate::sim::barometer::{Barometer, BarometerModel};
use crate::sim::earth::Earth;
use crate::sim::imu::{Imu, ImuModel, ImuTriads};
use crate::sim::magnetism::FieldAnomalies;
use crate::sim::magnetometer::{Magnetometer, MagnetometerModel};
use crate::sim::motion::Mounting;
use crate::sim::random::{Purpose, Random};

/// What a walker wears, and what it feels beside the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorModel {
    /// Gyros and accelerometers.
    pub imu: ImuModel,
    /// The magnetometer; `None` for a log without its readings.
    pub magnetometer: Option<MagnetometerModel>,
    /// The barometer; `None` for a log without pressures.
    pub barometer: Option<BarometerModel>,
    /// Magnetic anomalies along the way.
    pub field_anomalies: FieldAnomalies,
    /// Whether the gyros feel the Earth's rotation, and the accelerometers Coriolis' force.
    pub earth_rotation: bool,
    /// How left and right sensors sit on the foot: roll, pitch (nose down positive), yaw, degrees.
    pub mounting_deg: [[f64; 3]; 2],
    /// 1σ by which each of these angles differs from walk to walk, degrees.
    pub mounting_spread_deg: f64,
}

/// On the instep: nose down along the laces, not quite straight.
const INSTEP_DEG: [[f64; 3]; 2] = [[3.0, 24.0, 6.0], [-4.0, 27.0, -9.0]];

impl SensorModel {
    /// The CMP10A of Yahboom, as worn for paper 1.
    pub fn cmp10a() -> SensorModel {
        SensorModel {
            imu: ImuModel {
                rate_hz: 100.0,
                averaging: true,
                gyro_noise_deg_s_rthz: 0.01,
                gyro_bias_deg_s: 0.4,
                gyro_bias_walk_deg_s_rts: 0.0015,
                accel_noise_m_s2_rthz: 1.8e-3,
                accel_bias_m_s2: 0.06,
                accel_bias_walk_m_s2_rts: 2e-4,
                scale: 0.004,
                misalignment_rad: 0.003,
                gyro_range_deg_s: 2000.0,
                accel_range_g: 16.0,
                sixteen_bits: true,
            },
            magnetometer: Some(MagnetometerModel {
                noise_ut: 0.25,
                hard_iron_ut: 0.7,
                soft_iron: 0.012,
                sixteen_bits: true,
            }),
            barometer: Some(BarometerModel {
                noise_m: 0.25,
                offset_m: 30.0,
                drift_m_rts: 0.01,
                has_steps: true,
            }),
            field_anomalies: FieldAnomalies { strength_ut: 8.0, every_m: 25.0, width_m: 1.0 },
            earth_rotation: true,
            mounting_deg: INSTEP_DEG,
            mounting_spread_deg: 2.0,
        }
    }

    /// A sensor without errors, on a foot on an Earth that does not turn.
    pub fn perfect() -> SensorModel {
        SensorModel {
            imu: ImuModel::perfect(),
            magnetometer: Some(MagnetometerModel::perfect()),
            barometer: Some(BarometerModel::perfect()),
            field_anomalies: FieldAnomalies { strength_ut: 0.0, every_m: 25.0, width_m: 1.0 },
            earth_rotation: false,
            mounting_deg: INSTEP_DEG,
            mounting_spread_deg: 0.0,
        }
    }
}

impl Default for SensorModel {
    fn default() -> Self {
        SensorModel::cmp10a()
    }
}

/// The sensor on one foot: its errors have been drawn.
#[derive(Clone, Debug)]
pub(super) struct ShoeSensor {
    pub(super) imu: Imu,
    pub(super) magnetometer: Option<Magnetometer>,
    pub(super) barometer: Option<Barometer>,
}

impl ShoeSensor {
    pub(super) fn new(model: &SensorModel, earth: Earth, seed: u64, foot: usize) -> ShoeSensor {
        // One fixed order of draws, each made whether or not its sigma is zero or its sensor is there.
        let mut calibration = Random::new(seed, foot, Purpose::Calibration);
        let triads = ImuTriads::new(&model.imu, seed, foot, &mut calibration);
        let none = MagnetometerModel::perfect();
        let magnetometer = Magnetometer::new(
            model.magnetometer.as_ref().unwrap_or(&none),
            &mut calibration,
            Random::new(seed, foot, Purpose::MagneticNoise),
        );
        let [roll, pitch, yaw]: [f64; 3] = std::array::from_fn(|i| {
            (model.mounting_deg[foot][i] + model.mounting_spread_deg * calibration.normal()).to_radians()
        });
        // The foot's frame has its origin where the sensor is.
        let mounting = Mounting { lever_arm_b_m: Vector3::zeros(), c_bs: mounting(roll, pitch, yaw) };
        ShoeSensor {
            imu: Imu::of(triads, &model.imu, mounting, earth),
            magnetometer: model.magnetometer.is_some().then_some(magnetometer),
            barometer: model
                .barometer
                .as_ref()
                .map(|barometer| Barometer::new(barometer, model.imu.rate_hz, seed, foot)),
        }
    }
}

/// From the sensor's axes to the foot's: roll, then pitch, then yaw, rad.
fn mounting(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(roll), libm::sincos(pitch), libm::sincos(yaw));
    let about_z = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    let about_y = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    about_z * about_y * about_x
}
