//! The figures that decide how well a height is known.

/// Sensors and gait of one foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Noise of one altimeter reading, 1σ, m; independent from reading to reading.
    pub altimeter_sigma_m: f64,
    /// Altimeter readings a second, Hz; at most one for each IMU sample.
    pub altimeter_rate_hz: f64,
    /// IMU samples a second, Hz; each one of a stance is a zero velocity.
    pub imu_rate_hz: f64,
    /// Velocity random walk, m/s/√s: the accelerometer's noise density.
    pub velocity_random_walk_m_s_sqrt_s: f64,
    /// Noise of one zero velocity, 1σ, m/s.
    pub zupt_sigma_m_s: f64,
    /// Gait cycle of one foot, s: from lift to lift.
    pub stride_s: f64,
    /// Share of the gait cycle in which the foot stands.
    pub stance_share: f64,
}

impl Default for Setup {
    /// The CMP10A by its data sheet (1.8 mm/s²/√Hz, 100 Hz) with its barometer (0.25 m) read at 20 Hz,
    /// zero velocity as in paper 1 (0.017 m/s), and the simulated walkers' gait.
    fn default() -> Setup {
        Setup {
            altimeter_sigma_m: 0.25,
            altimeter_rate_hz: 20.0,
            imu_rate_hz: 100.0,
            velocity_random_walk_m_s_sqrt_s: 1.8e-3,
            zupt_sigma_m_s: 0.017,
            stride_s: 1.04,
            stance_share: 0.43,
        }
    }
}

impl Setup {
    /// Paper 2, section III: 0.023 mg/√Hz, an altimeter at 20 Hz. The paper tells neither its zero
    /// velocity's sigma nor its gait; these are the defaults.
    pub const fn paper() -> Setup {
        Setup {
            altimeter_sigma_m: 0.1,
            altimeter_rate_hz: 20.0,
            imu_rate_hz: 100.0,
            velocity_random_walk_m_s_sqrt_s: 0.023e-3 * 9.806_65,
            zupt_sigma_m_s: 0.017,
            stride_s: 1.04,
            stance_share: 0.43,
        }
    }

    /// What cannot be, as a sentence that names the figure.
    pub fn check(&self) -> Result<(), String> {
        let Setup { imu_rate_hz, altimeter_rate_hz, stride_s, stance_share, .. } = *self;
        for (name, value, unit) in [
            ("altimeter sigma", self.altimeter_sigma_m, "m"),
            ("altimeter rate", altimeter_rate_hz, "Hz"),
            ("IMU rate", imu_rate_hz, "Hz"),
            ("velocity random walk", self.velocity_random_walk_m_s_sqrt_s, "m/s/√s"),
            ("zero-velocity sigma", self.zupt_sigma_m_s, "m/s"),
            ("stride", stride_s, "s"),
        ] {
            if !(value.is_finite() && (1e-9..=1e9).contains(&value)) {
                return Err(format!("the {name} has to be a positive number of {unit}, found {value}"));
            }
        }
        if !(stance_share > 0.0 && stance_share < 1.0) {
            return Err(format!(
                "the stance share has to lie between 0 and 1, such as 0.43, found {stance_share}"
            ));
        }
        if altimeter_rate_hz > imu_rate_hz {
            return Err(format!(
                "an altimeter is read at most once for each IMU sample: {altimeter_rate_hz} Hz is more than {imu_rate_hz} Hz"
            ));
        }
        if stance_share * stride_s * imu_rate_hz < 1.0 {
            return Err(format!(
                "a stance of {stance_share} × {stride_s} s holds no IMU sample at {imu_rate_hz} Hz"
            ));
        }
        Ok(())
    }

    /// Density of the velocity's random walk, m²/s³: q.
    pub(crate) fn q_m2_s3(&self) -> f64 {
        self.velocity_random_walk_m_s_sqrt_s * self.velocity_random_walk_m_s_sqrt_s
    }

    /// What the altimeter tells of the height a second, 1/(m² s): r_h.
    pub(crate) fn height_knowledge(&self) -> f64 {
        self.altimeter_rate_hz / (self.altimeter_sigma_m * self.altimeter_sigma_m)
    }

    /// What zero velocity tells of the velocity in a second of stance, s/m²: r_s.
    pub(crate) fn stance_knowledge(&self) -> f64 {
        self.imu_rate_hz / (self.zupt_sigma_m_s * self.zupt_sigma_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_named() {
        assert_eq!(Setup::default().check(), Ok(()));
        assert_eq!(Setup::paper().check(), Ok(()));
        let base = Setup::default();
        for (wrong, named) in [
            (Setup { altimeter_sigma_m: 0.0, ..base }, "altimeter sigma"),
            (Setup { zupt_sigma_m_s: f64::NAN, ..base }, "zero-velocity sigma"),
            (Setup { stride_s: -1.0, ..base }, "stride"),
            (Setup { stance_share: 1.0, ..base }, "stance share"),
            (Setup { altimeter_rate_hz: 101.0, ..base }, "at most once"),
            (Setup { imu_rate_hz: 20.0, stride_s: 0.1, ..base }, "no IMU sample"),
        ] {
            let sentence = wrong.check().unwrap_err();
            assert!(sentence.contains(named), "{sentence}");
        }
    }
}
