//! A look inside while a walk goes on: what the filter believes of each foot's sensor.

use super::{Session, Walk};
use crate::system::SensorState;

impl Session {
    /// The state of the sensors that keep up, left first; none before the walk is aligned.
    pub fn sensors(&self) -> Vec<SensorState> {
        match &self.walk {
            Walk::Waiting => Vec::new(),
            Walk::OneFoot(history) => history.filter().sensors(history.setting()),
            Walk::TwoFeet(history) => history.filter().sensors(history.setting()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Site;
    use crate::sample::Foot;
    use crate::session::SessionConfig;
    use crate::sim::{SensorModel, WalkKind, simulate};

    #[test]
    fn a_look_inside_tells_biases_with_sigmas_and_the_field_s_heading_and_changes_nothing() {
        let site = Site::fast();
        let walk = simulate(&WalkKind::Line { metres: 20.0 }, 1, &site, &SensorModel::cmp10a());
        let config = SessionConfig {
            initial_position_n_m: walk.start_n_m(),
            declination_rad: site.declination_deg.to_radians(),
            gravity_m_s2: site.gravity_m_s2,
            ..SessionConfig::default()
        };
        let (mut looked_at, mut left_alone) = (Session::new(config.clone()), Session::new(config));
        let (mut told, mut same) = (Vec::new(), Vec::new());
        let (mut headings, mut last) = (0, Vec::new());
        assert!(looked_at.sensors().is_empty());
        for (left, right) in walk.left.iter().zip(&walk.right) {
            for (foot, sample) in [(Foot::Left, left), (Foot::Right, right)] {
                looked_at.push(foot, sample, &mut told);
                left_alone.push(foot, sample, &mut same);
            }
            let sensors = looked_at.sensors();
            let fields = sensors.iter().filter_map(|sensor| sensor.magnetic_minus_heading_rad);
            headings += fields.inspect(|off_rad| assert!(off_rad.abs() < 0.5, "{off_rad}")).count();
            if !sensors.is_empty() {
                last = sensors;
            }
        }
        assert_eq!(told, same);
        assert!(headings > 100, "{headings}");
        assert_eq!(last.iter().map(|sensor| sensor.foot).collect::<Vec<_>>(), Foot::BOTH);
        for sensor in last {
            for (bias, sigma) in sensor.gyro_bias_b_rad_s.iter().zip(sensor.sigma_gyro_bias_rad_s) {
                assert!(sigma > 0.0 && sigma < 0.02 && bias.abs() < 0.1, "{bias} ± {sigma} rad/s");
            }
            let forces = sensor.accelerometer_bias_b_m_s2.iter().zip(sensor.sigma_accelerometer_bias_m_s2);
            for (bias, sigma) in forces {
                assert!(sigma > 0.0 && sigma <= 0.08 && bias.abs() < 0.5, "{bias} ± {sigma} m/s²");
            }
        }
    }
}
