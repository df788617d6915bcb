//! An inertial sensor on a moving body: gyros and accelerometers with their errors.

use nalgebra::Vector3;

use super::earth::Earth;
use super::motion::{Kinematics, Motion, Mounting};
use super::random::{Purpose, Random};
use super::triad::{Triad, TriadErrors};

/// An inertial sensor's errors, each given so that zero means none.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuModel {
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
}

/// Standard gravity, m/s².
const G0_M_S2: f64 = 9.806_65;

impl ImuModel {
    /// A sensor without errors: means over 10 ms.
    pub fn perfect() -> ImuModel {
        ImuModel {
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
        }
    }

    /// Time between samples, ns.
    pub fn period_ns(&self) -> i64 {
        libm::round(1e9 / self.rate_hz) as i64
    }

    fn triad(&self, bias: f64, bias_walk: f64, noise: f64, range: f64) -> TriadErrors {
        TriadErrors {
            bias,
            bias_step: bias_walk * libm::sqrt(1.0 / self.rate_hz),
            noise: noise * libm::sqrt(self.rate_hz),
            scale: self.scale,
            misalignment_rad: self.misalignment_rad,
            range,
            step: (self.sixteen_bits && range.is_finite()).then(|| range / 32768.0),
        }
    }

    fn gyros(&self) -> TriadErrors {
        self.triad(
            self.gyro_bias_deg_s.to_radians(),
            self.gyro_bias_walk_deg_s_rts.to_radians(),
            self.gyro_noise_deg_s_rthz.to_radians(),
            self.gyro_range_deg_s.to_radians(),
        )
    }

    fn accelerometers(&self) -> TriadErrors {
        self.triad(
            self.accel_bias_m_s2,
            self.accel_bias_walk_m_s2_rts,
            self.accel_noise_m_s2_rthz,
            self.accel_range_g * G0_M_S2,
        )
    }
}

/// One reading, in the sensor's frame s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// Rate against inertial space, rad/s.
    pub w_is_s_rad_s: [f64; 3],
    /// Specific force, m/s².
    pub f_s_m_s2: [f64; 3],
}

/// Nodes and weights of Gauss and Legendre's quadrature on [0, 1]: exact for polynomials of degree 5.
const QUADRATURE: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// One sensor: its errors have been drawn. It samples a motion in order of time.
#[derive(Clone, Debug)]
pub struct Imu {
    gyros: Triad,
    accelerometers: Triad,
    mounting: Mounting,
    earth: Earth,
    period_ns: i64,
    averaging: bool,
    /// A mean is taken over so many parts of its interval.
    parts: u32,
    /// Time, rate and specific force at the last sample, in s.
    last: Option<(f64, Vector3<f64>, Vector3<f64>)>,
}

impl Imu {
    /// A sensor on a body; another `stream` of the same seed errs otherwise, as a second sensor does.
    pub fn new(model: &ImuModel, mounting: Mounting, earth: Earth, seed: u64, stream: usize) -> Imu {
        let mut calibration = Random::new(seed, stream, Purpose::Calibration);
        let triads = ImuTriads::new(model, seed, stream, &mut calibration);
        Imu::of(triads, model, mounting, earth)
    }

    /// A sensor of which the triads have been drawn.
    pub(super) fn of(triads: ImuTriads, model: &ImuModel, mounting: Mounting, earth: Earth) -> Imu {
        let ImuTriads { gyros, accelerometers } = triads;
        let (period_ns, averaging) = (model.period_ns(), model.averaging);
        Imu { gyros, accelerometers, mounting, earth, period_ns, averaging, parts: 1, last: None }
    }

    /// The same, whose means follow what lasts no longer than this, s: a blow is shorter than the interval of a slow sensor.
    #[must_use]
    pub(super) fn following(mut self, shortest_s: f64) -> Imu {
        self.parts = libm::ceil(self.period_ns as f64 * 1e-9 / shortest_s - 1e-6).max(1.0) as u32;
        self
    }

    /// Takes the reading at a time, ns, one period after the last. Returns it with the true motion of the sensor, in its own
    /// axes.
    pub fn sample(&mut self, motion: &impl Motion, t_ns: i64) -> (Kinematics, ImuReading) {
        let t_s = t_ns as f64 * 1e-9;
        let place = self.mounting.place(&motion.at(t_s));
        let now = self.felt(&place);
        let mean = match self.last {
            Some((last_s, w, f)) if self.averaging => {
                if motion.is_slow(last_s, t_s) {
                    ((w + now.0) * 0.5, (f + now.1) * 0.5)
                } else {
                    self.mean(motion, t_s)
                }
            }
            _ => now,
        };
        self.last = Some((t_s, now.0, now.1));
        let reading = ImuReading {
            w_is_s_rad_s: self.gyros.read(&mean.0),
            f_s_m_s2: self.accelerometers.read(&mean.1),
        };
        (self.mounting.turned(&place), reading)
    }

    /// Rate and specific force over the interval that ends at a time, in s.
    fn mean(&self, motion: &impl Motion, t_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let part_s = self.period_ns as f64 * 1e-9 / f64::from(self.parts);
        let mut mean = (Vector3::zeros(), Vector3::zeros());
        for part in 0..self.parts {
            let end_s = t_s - f64::from(part) * part_s;
            for (node, weight) in QUADRATURE {
                let (w, f) = self.felt(&self.mounting.place(&motion.at(end_s - (1.0 - node) * part_s)));
                mean.0 += w * (weight / f64::from(self.parts));
                mean.1 += f * (weight / f64::from(self.parts));
            }
        }
        mean
    }

    /// True rate and specific force at an instant, in s.
    fn felt(&self, place: &Kinematics) -> (Vector3<f64>, Vector3<f64>) {
        let c_bs = &self.mounting.c_bs;
        (c_bs.tr_mul(&place.w_ib_b_rad_s(&self.earth)), c_bs.tr_mul(&place.f_b_m_s2(&self.earth)))
    }
}

/// The triads of a sensor, drawn apart from it where other sensors share its calibration's stream.
pub(super) struct ImuTriads {
    gyros: Triad,
    accelerometers: Triad,
}

impl ImuTriads {
    pub(super) fn new(model: &ImuModel, seed: u64, stream: usize, calibration: &mut Random) -> ImuTriads {
        // The walks of both biases are for one purpose: streams from 16 and from 32 on.
        let walk = |triad: usize| Random::new(seed, stream + 16 * triad, Purpose::BiasWalk);
        let noise = |purpose| Random::new(seed, stream, purpose);
        ImuTriads {
            gyros: Triad::new(model.gyros(), calibration, noise(Purpose::GyroNoise), walk(1)),
            accelerometers: Triad::new(
                model.accelerometers(),
                calibration,
                noise(Purpose::AccelNoise),
                walk(2),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, UnitQuaternion};

    use super::super::motion::tests::Tumbling;
    use super::*;
    use crate::geo::Site;

    /// A body at rest whose axes are those of n.
    struct AtRest;

    impl Motion for AtRest {
        fn at(&self, _: f64) -> Kinematics {
            let c_nb = super::super::jet_rotation::JetRotation::constant(&nalgebra::Matrix3::identity());
            Kinematics::from_jets([super::super::jet::Jet::default(); 3], &c_nb)
        }

        fn end_s(&self) -> f64 {
            f64::INFINITY
        }

        fn is_slow(&self, _: f64, _: f64) -> bool {
            true
        }
    }

    fn mounting() -> Mounting {
        Mounting {
            lever_arm_b_m: Vector3::new(0.4, -0.1, 1.3),
            c_bs: Rotation3::from_scaled_axis(Vector3::new(0.2, -0.4, 0.9)).into_inner(),
        }
    }

    #[test]
    fn integrating_a_perfect_sensor_at_a_lever_arm_returns_the_motion_of_its_own_place() {
        let earth = Earth::curved(&Site::fast(), true);
        let model = ImuModel { rate_hz: 1000.0, ..ImuModel::perfect() };
        let (mut imu, dt) = (Imu::new(&model, mounting(), earth, 1, 0), 1e-3);
        let (start, _) = imu.sample(&Tumbling, 0);
        let (mut q_ns, mut v_n, mut p_n) = (start.q_nb(), start.velocity_n_m_s, start.position_n_m);
        let mut truth = start;
        for k in 1..=20_000 {
            let (now, reading) = imu.sample(&Tumbling, k * model.period_ns());
            let turned = Vector3::from(reading.w_is_s_rad_s) * dt;
            let c_earth = UnitQuaternion::from_scaled_axis(earth.rate_n_rad_s() * -dt);
            // Halfway, by half of the turn and half of the Earth's.
            let middle = UnitQuaternion::from_scaled_axis(earth.rate_n_rad_s() * (-0.5 * dt))
                * q_ns
                * UnitQuaternion::from_scaled_axis(0.5 * turned);
            let a_n = middle * Vector3::from(reading.f_s_m_s2) + earth.gravity_n_m_s2(&p_n)
                - 2.0 * earth.rate_n_rad_s().cross(&v_n);
            p_n += v_n * dt + a_n * (0.5 * dt * dt);
            v_n += a_n * dt;
            q_ns = c_earth * q_ns * UnitQuaternion::from_scaled_axis(turned);
            truth = now;
        }
        assert!(q_ns.angle_to(&truth.q_nb()) < 1e-6, "{} rad", q_ns.angle_to(&truth.q_nb()));
        assert!((v_n - truth.velocity_n_m_s).norm() < 1e-4, "{} m/s", (v_n - truth.velocity_n_m_s).norm());
        assert!((p_n - truth.position_n_m).norm() < 1e-3, "{} m", (p_n - truth.position_n_m).norm());
    }

    #[test]
    fn a_mean_is_that_of_many_instants() {
        let earth = Earth::new(&Site::fast(), true);
        let mut coarse =
            Imu::new(&ImuModel { rate_hz: 20.0, ..ImuModel::perfect() }, mounting(), earth, 1, 0);
        let instants = ImuModel { rate_hz: 20_000.0, averaging: false, ..ImuModel::perfect() };
        let mut fine = Imu::new(&instants, mounting(), earth, 1, 0);
        coarse.sample(&Tumbling, 0);
        let (_, mean) = coarse.sample(&Tumbling, 50_000_000);
        let mut sum = (Vector3::zeros(), Vector3::zeros());
        for k in 0..1000 {
            let (_, instant) = fine.sample(&Tumbling, 25_000 + 50_000 * k);
            sum.0 += Vector3::from(instant.w_is_s_rad_s) * 1e-3;
            sum.1 += Vector3::from(instant.f_s_m_s2) * 1e-3;
        }
        assert!((sum.0 - Vector3::from(mean.w_is_s_rad_s)).norm() < 1e-7);
        assert!((sum.1 - Vector3::from(mean.f_s_m_s2)).norm() < 1e-6);
    }

    #[test]
    fn at_rest_it_feels_gravity_and_the_earth_and_without_rotation_gravity_alone() {
        let site = Site::fast();
        for rotates in [true, false] {
            let earth = Earth::new(&site, rotates);
            let mut imu = Imu::new(&ImuModel::perfect(), Mounting::at_origin(), earth, 1, 0);
            for k in 0..3 {
                let (_, reading) = imu.sample(&AtRest, k * 10_000_000);
                assert_eq!(reading.w_is_s_rad_s, <[f64; 3]>::from(earth.rate_n_rad_s()));
                assert_eq!(reading.f_s_m_s2, [0.0, 0.0, site.gravity_m_s2]);
            }
        }
    }

    #[test]
    fn biases_walks_and_noise_have_their_sigmas_over_the_seeds() {
        // 0.2 °/s turn-on, 0.02 °/s/√s walk, 0.01 °/s/√Hz noise; at 50 Hz over 10 s.
        let model = ImuModel {
            rate_hz: 50.0,
            gyro_bias_deg_s: 0.2,
            gyro_bias_walk_deg_s_rts: 0.02,
            gyro_noise_deg_s_rthz: 0.01,
            ..ImuModel::perfect()
        };
        let earth = Earth::new(&Site::fast(), false);
        let (mut first, mut moved, mut between) = (0.0, 0.0, 0.0);
        for seed in 0..200 {
            let mut imu = Imu::new(&model, Mounting::at_origin(), earth, seed, 0);
            let rates: Vec<Vector3<f64>> = (0..=500)
                .map(|k| Vector3::from(imu.sample(&AtRest, k * model.period_ns()).1.w_is_s_rad_s))
                .collect();
            let third = |v: Vector3<f64>| v.norm_squared() / 3.0;
            first += third(rates[0]) / 200.0;
            moved += third(rates[500] - rates[0]) / 200.0;
            between += rates.windows(2).map(|w| third(w[1] - w[0])).sum::<f64>() / 500.0 / 200.0;
        }
        let deg = |variance: f64| libm::sqrt(variance).to_degrees();
        let noise = 0.01 * libm::sqrt(50.0);
        // 600 draws: 3σ of a sample sigma is 9 %.
        for (found, expected, tolerance) in [
            (deg(first), libm::hypot(0.2, noise), 0.09),
            (deg(moved), libm::hypot(0.02 * libm::sqrt(10.0), noise * libm::sqrt(2.0)), 0.09),
            (deg(between), libm::hypot(noise * libm::sqrt(2.0), 0.02 / libm::sqrt(50.0)), 0.02),
        ] {
            assert!((found / expected - 1.0).abs() < tolerance, "{found} °/s, expected {expected}");
        }
    }
}
