//! What the filter believes of its sensors, to be looked at: nothing in here changes anything.

use nalgebra::Vector3;

use super::filter::{Filter, Setting};
use crate::ins::layout::ErrorState;
use crate::measure::magnetic_heading::magnetic_heading;
use crate::system::SensorState;

/// A stance has to have so many readings of the field, as for the aid itself.
const LEAST_READINGS: u32 = 3;

impl<const B: usize, const F: usize> Filter<B, F> {
    /// The state of every sensor that keeps up.
    pub(crate) fn sensors(&self, setting: &Setting) -> Vec<SensorState> {
        self.present().map(|sensor| self.sensor(setting, sensor)).collect()
    }

    fn sensor(&self, setting: &Setting, sensor: usize) -> SensorState {
        let foot = &self.feet[sensor];
        let sigma = |state: ErrorState| -> [f64; 3] {
            let block = self.eskf.covariance.block(state.of(sensor), state.of(sensor));
            Vector3::from_fn(|axis, _| block[(axis, axis)].max(0.0).sqrt()).into()
        };
        let magnetics = &foot.stance.magnetics;
        let mean_b_ut = if foot.stance.stands && magnetics.readings() >= LEAST_READINGS {
            magnetics.mean_b_ut()
        } else {
            None
        };
        SensorState {
            stream: setting.feet[sensor].stream(),
            t_ns: foot.t_ns,
            stance: foot.stance.stands,
            gyro_bias_b_rad_s: foot.nav.gyro_bias_b.into(),
            sigma_gyro_bias_rad_s: sigma(ErrorState::GyroBias),
            accelerometer_bias_b_m_s2: foot.nav.accelerometer_bias_b.into(),
            sigma_accelerometer_bias_m_s2: sigma(ErrorState::AccelerometerBias),
            magnetic_minus_heading_rad: mean_b_ut.map(|mean_b_ut| {
                magnetic_heading(sensor, &foot.nav.c_nb, &mean_b_ut, setting.declination_rad, 1.0).innovation
                    [0]
            }),
        }
    }
}
