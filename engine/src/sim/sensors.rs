//! What a sensor makes of the truth: the CMP10A by its figures, a perfect one, and what lies between.

use nalgebra::{Matrix3, Vector3};

use super::random::{Purpose, Random};

/// A sensor's errors, each given so that zero means none.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorModel {
    /// Samples per second.
    pub rate_hz: f64,
    /// Whether a reading is the mean over the interval that it ends, or the value at its instant.
    pub averaging: bool,
    /// Gyro noise, °/s/√Hz: a reading at rate f has sigma noise · √f.
    pub gyro_noise_deg_s_rthz: f64,
    /// Turn-on bias of each gyro, 1σ, °/s.
    pub gyro_bias_deg_s: f64,
    /// Random walk of that bias, °/s/√s.
    pub gyro_bias_walk_deg_s_rts: f64,
    /// Accelerometer noise, m/s²/√Hz.
    pub accel_noise_m_s2_rthz: f64,
    /// Bias of each accelerometer, 1σ, m/s².
    pub accel_bias_m_s2: f64,
    /// Random walk of that bias, m/s²/√s.
    pub accel_bias_walk_m_s2_rts: f64,
    /// Scale factor error of gyros and accelerometers, 1σ.
    pub scale: f64,
    /// Misalignment of each of their axes towards each other, 1σ, rad.
    pub misalignment_rad: f64,
    /// Largest rate, °/s; infinite for none.
    pub gyro_range_deg_s: f64,
    /// Largest specific force, in g of 9.80665 m/s²; infinite for none.
    pub accel_range_g: f64,
    /// Whether readings are rounded to 16 bits of the range.
    pub sixteen_bits: bool,
    /// Whether the log has magnetometer readings.
    pub magnetometer: bool,
    /// Magnetometer noise of each reading and axis, µT.
    pub mag_noise_ut: f64,
    /// Hard iron on each axis, 1σ, µT.
    pub hard_iron_ut: f64,
    /// Soft iron: 1σ of each element by which the matrix differs from the identity.
    pub soft_iron: f64,
    /// Strength of the magnetic anomalies along the way, µT.
    pub anomaly_ut: f64,
    /// How far apart they are, m.
    pub anomaly_every_m: f64,
    /// Their 1σ half width, m: what is felt is about four times as wide.
    pub anomaly_width_m: f64,
    /// Whether the log has pressures.
    pub barometer: bool,
    /// Barometer noise of each reading, m.
    pub baro_noise_m: f64,
    /// Offset of the day's pressure from the standard atmosphere, 1σ, m.
    pub baro_offset_m: f64,
    /// Drift of weather and sensor, m/√s.
    pub baro_drift_m_rts: f64,
    /// Whether the gyros feel the Earth's rotation, and the accelerometers Coriolis' force.
    pub earth_rotation: bool,
    /// How left and right sensors sit on the foot: roll, pitch (nose down positive), yaw, degrees.
    pub mounting_deg: [[f64; 3]; 2],
    /// 1σ by which each of these angles differs from walk to walk, degrees.
    pub mounting_spread_deg: f64,
}

/// On the instep: nose down along the laces, not quite straight.
const INSTEP_DEG: [[f64; 3]; 2] = [[3.0, 24.0, 6.0], [-4.0, 27.0, -9.0]];
/// Standard gravity, m/s².
const G0_M_S2: f64 = 9.806_65;
/// Range of the magnetometer, µT.
const MAG_RANGE_UT: f64 = 800.0;
/// Least step of a pressure, hPa.
const PRESSURE_STEP_HPA: f64 = 0.01;

impl SensorModel {
    /// The CMP10A of Yahboom, as worn for paper 1.
    pub fn cmp10a() -> SensorModel {
        SensorModel {
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
            magnetometer: true,
            mag_noise_ut: 0.25,
            hard_iron_ut: 0.7,
            soft_iron: 0.012,
            anomaly_ut: 8.0,
            anomaly_every_m: 25.0,
            anomaly_width_m: 1.0,
            barometer: true,
            baro_noise_m: 0.25,
            baro_offset_m: 30.0,
            baro_drift_m_rts: 0.01,
            earth_rotation: true,
            mounting_deg: INSTEP_DEG,
            mounting_spread_deg: 2.0,
        }
    }

    /// A sensor without errors, on a foot on an Earth that does not turn.
    pub fn perfect() -> SensorModel {
        SensorModel {
            rate_hz: 100.0,
            averaging: true,
            gyro_noise_deg_s_rthz: 0.0,
            gyro_bias_deg_s: 0.0,
            gyro_bias_walk_deg_s_rts: 0.0,
            accel_noise_m_s2_rthz: 0.0,
            accel_bias_m_s2: 0.0,
            accel_bias_walk_m_s2_rts: 0.0,
            scale: 0.0,
            misalignment_rad: 0.0,
            gyro_range_deg_s: f64::INFINITY,
            accel_range_g: f64::INFINITY,
            sixteen_bits: false,
            magnetometer: true,
            mag_noise_ut: 0.0,
            hard_iron_ut: 0.0,
            soft_iron: 0.0,
            anomaly_ut: 0.0,
            anomaly_every_m: 25.0,
            anomaly_width_m: 1.0,
            barometer: true,
            baro_noise_m: 0.0,
            baro_offset_m: 0.0,
            baro_drift_m_rts: 0.0,
            earth_rotation: false,
            mounting_deg: INSTEP_DEG,
            mounting_spread_deg: 0.0,
        }
    }

    /// Time between samples, ns.
    pub fn period_ns(&self) -> i64 {
        libm::round(1e9 / self.rate_hz) as i64
    }
}

impl Default for SensorModel {
    fn default() -> Self {
        SensorModel::cmp10a()
    }
}

/// What is physically there for one reading, in the sensor's frame b.
pub(crate) struct Stimulus {
    pub(crate) w_ib_b_rad_s: Vector3<f64>,
    pub(crate) f_b_m_s2: Vector3<f64>,
    pub(crate) field_b_ut: Vector3<f64>,
    /// Height above the ellipsoid, m.
    pub(crate) height_m: f64,
}

/// What the sensor says of it.
pub(crate) struct Reading {
    pub(crate) w_ib_b_rad_s: [f64; 3],
    pub(crate) f_b_m_s2: [f64; 3],
    pub(crate) mag_b_ut: Option<[f64; 3]>,
    pub(crate) pressure_hpa: Option<f64>,
}

/// A triad of gyros or accelerometers.
#[derive(Clone, Debug)]
struct Triad {
    sensitivity: Matrix3<f64>,
    bias: Vector3<f64>,
    bias_step: f64,
    noise: f64,
    range: f64,
    step: Option<f64>,
    noise_stream: Random,
    walk_stream: Random,
}

impl Triad {
    fn read(&mut self, truth: &Vector3<f64>) -> [f64; 3] {
        let ideal = self.sensitivity * truth + self.bias;
        let (noise, walk) = (self.noise_stream.normal_3(), self.walk_stream.normal_3());
        std::array::from_fn(|axis| {
            self.bias[axis] += self.bias_step * walk[axis];
            digitise(ideal[axis] + self.noise * noise[axis], self.range, self.step)
        })
    }
}

/// A reading within the range, in whole steps.
fn digitise(value: f64, range: f64, step: Option<f64>) -> f64 {
    match step {
        // The highest code of a two's-complement converter is one step below the range.
        Some(step) => (libm::round(value / step) * step).clamp(-range, range - step),
        None => value.clamp(-range, range),
    }
}

/// One sensor of one walk: its errors have been drawn.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    gyro: Triad,
    accel: Triad,
    soft_iron: Matrix3<f64>,
    hard_iron_ut: Vector3<f64>,
    mag_noise: Random,
    baro_noise: Random,
    weather: Random,
    height_error_m: f64,
    model: SensorModel,
    /// From b to the foot's frame f.
    pub(crate) c_b_f: Matrix3<f64>,
}

impl Sensor {
    pub(crate) fn new(model: &SensorModel, seed: u64, foot: usize) -> Sensor {
        // One fixed order of draws, each made whether or not its sigma is zero.
        let mut draw = Random::new(seed, foot, Purpose::Calibration);
        let interval_rts = libm::sqrt(1.0 / model.rate_hz);
        let root_hz = libm::sqrt(model.rate_hz);
        let step = |range: f64| (model.sixteen_bits && range.is_finite()).then(|| range / 32768.0);
        let mut triad = |bias: f64, walk: f64, noise: f64, range: f64, purpose: Purpose, axis: usize| Triad {
            bias: bias * Vector3::from(draw.normal_3()),
            sensitivity: Matrix3::identity()
                + Matrix3::from_diagonal(&(model.scale * Vector3::from(draw.normal_3())))
                + off_diagonal(model.misalignment_rad, &mut draw),
            bias_step: walk * interval_rts,
            noise: noise * root_hz,
            range,
            step: step(range),
            noise_stream: Random::new(seed, foot, purpose),
            walk_stream: Random::new(seed, foot + 16 * axis, Purpose::BiasWalk),
        };
        let gyro = triad(
            model.gyro_bias_deg_s.to_radians(),
            model.gyro_bias_walk_deg_s_rts.to_radians(),
            model.gyro_noise_deg_s_rthz.to_radians(),
            model.gyro_range_deg_s.to_radians(),
            Purpose::GyroNoise,
            1,
        );
        let accel = triad(
            model.accel_bias_m_s2,
            model.accel_bias_walk_m_s2_rts,
            model.accel_noise_m_s2_rthz,
            model.accel_range_g * G0_M_S2,
            Purpose::AccelNoise,
            2,
        );
        let hard_iron_ut = model.hard_iron_ut * Vector3::from(draw.normal_3());
        let soft_iron = Matrix3::identity() + Matrix3::from_fn(|_, _| model.soft_iron * draw.normal());
        let [roll, pitch, yaw]: [f64; 3] = std::array::from_fn(|i| {
            (model.mounting_deg[foot][i] + model.mounting_spread_deg * draw.normal()).to_radians()
        });
        let mut weather = Random::new(seed, 2, Purpose::Weather);
        Sensor {
            gyro,
            accel,
            soft_iron,
            hard_iron_ut,
            mag_noise: Random::new(seed, foot, Purpose::MagneticNoise),
            baro_noise: Random::new(seed, foot, Purpose::BarometerNoise),
            height_error_m: model.baro_offset_m * weather.normal(),
            weather,
            model: model.clone(),
            c_b_f: mounting(roll, pitch, yaw),
        }
    }

    /// Takes the next reading.
    pub(crate) fn read(&mut self, truth: &Stimulus) -> Reading {
        let mag_b_ut = self.model.magnetometer.then(|| {
            let field = self.soft_iron * truth.field_b_ut + self.hard_iron_ut;
            let noise = self.mag_noise.normal_3();
            let step = self.model.sixteen_bits.then_some(MAG_RANGE_UT / 32768.0);
            let range = if self.model.sixteen_bits { MAG_RANGE_UT } else { f64::INFINITY };
            std::array::from_fn(|axis| {
                digitise(field[axis] + self.model.mag_noise_ut * noise[axis], range, step)
            })
        });
        let pressure_hpa = self.model.barometer.then(|| {
            // Both feet draw the same weather.
            self.height_error_m +=
                self.model.baro_drift_m_rts / libm::sqrt(self.model.rate_hz) * self.weather.normal();
            let noise_m = self.model.baro_noise_m * self.baro_noise.normal();
            let hpa = standard_pressure_hpa(truth.height_m + self.height_error_m + noise_m);
            digitise(hpa, f64::INFINITY, self.model.sixteen_bits.then_some(PRESSURE_STEP_HPA))
        });
        Reading {
            w_ib_b_rad_s: self.gyro.read(&truth.w_ib_b_rad_s),
            f_b_m_s2: self.accel.read(&truth.f_b_m_s2),
            mag_b_ut,
            pressure_hpa,
        }
    }
}

fn off_diagonal(sigma: f64, draw: &mut Random) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| if row == column { 0.0 } else { sigma * draw.normal() })
}

/// From b to f: roll, then pitch, then yaw, rad.
fn mounting(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(roll), libm::sincos(pitch), libm::sincos(yaw));
    let about_z = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    let about_y = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    about_z * about_y * about_x
}

/// Pressure of the standard atmosphere at a height, hPa.
fn standard_pressure_hpa(height_m: f64) -> f64 {
    1013.25 * libm::pow(1.0 - height_m / 44_330.0, 5.255)
}
