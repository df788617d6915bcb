//! The last equation of paper 2, section II-B, as it is printed.

use super::Setup;

/// What the paper prints for P₃₃, in SI units:
///
/// (√(VRW² t_stride ω² t_off / (N_stance N_on)) − VRW² t_stride / (3 N_on N_stance t_on))^½ · alt/√dt.
///
/// `None` where the difference is negative: an altimeter that is read at every IMU sample leaves no
/// t_off. By its name the number is a variance; the paper plots it as a standard deviation. Read as its
/// text says: t_stride is the swing, N_stance the zero velocities of a gait cycle, N_on and t_on the
/// altimeter's readings in a cycle and the IMU samples' time that they take, t_off the rest of the
/// cycle, dt the IMU's interval.
pub fn printed_p33(setup: &Setup) -> Option<f64> {
    let dt_s = 1.0 / setup.imu_rate_hz;
    let swing_s = setup.stride_s * (1.0 - setup.stance_share);
    let zero_velocities = setup.stride_s * setup.stance_share * setup.imu_rate_hz;
    let readings = setup.stride_s * setup.altimeter_rate_hz;
    let on_s = readings * dt_s;
    let off_s = setup.stride_s - on_s;
    let q = setup.q_m2_s3();
    let zupt_variance = setup.zupt_sigma_m_s * setup.zupt_sigma_m_s;
    let grown = (q * swing_s * zupt_variance * off_s / (zero_velocities * readings)).sqrt();
    let taken = q * swing_s / (3.0 * readings * zero_velocities * on_s);
    // Written so that a NaN is none.
    (grown - taken >= 0.0).then(|| (grown - taken).sqrt() * setup.altimeter_sigma_m / dt_s.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::vertical::closed_form::sigma_m;

    #[test]
    fn it_is_the_printed_equation_worked_out_by_hand() {
        // dt 0.01 s, swing 0.5 s, 50 zero velocities, 20 readings that take 0.2 s of 1 s.
        let setup = Setup {
            altimeter_sigma_m: 2.0,
            altimeter_rate_hz: 20.0,
            imu_rate_hz: 100.0,
            velocity_random_walk_m_s_sqrt_s: 0.1,
            zupt_sigma_m_s: 0.2,
            stride_s: 1.0,
            stance_share: 0.5,
        };
        let grown = (0.01_f64 * 0.5 * 0.04 * 0.8 / (50.0 * 20.0)).sqrt();
        let taken = 0.01 * 0.5 / (3.0 * 20.0 * 50.0 * 0.2);
        let expected = (grown - taken).sqrt() * 2.0 / 0.1;
        assert!((printed_p33(&setup).unwrap() / expected - 1.0).abs() < 1e-12);
        assert_eq!(printed_p33(&Setup { altimeter_rate_hz: 100.0, ..setup }), None);
    }

    #[test]
    fn its_units_do_not_balance() {
        // The same walk with times told in milliseconds: a variance of a height would stay what it is.
        let setup = Setup::default();
        let per_ms = 1e-3;
        let in_ms = Setup {
            altimeter_rate_hz: setup.altimeter_rate_hz * per_ms,
            imu_rate_hz: setup.imu_rate_hz * per_ms,
            velocity_random_walk_m_s_sqrt_s: setup.velocity_random_walk_m_s_sqrt_s * per_ms * per_ms.sqrt(),
            zupt_sigma_m_s: setup.zupt_sigma_m_s * per_ms,
            stride_s: setup.stride_s / per_ms,
            ..setup
        };
        let (right, other) = (sigma_m(&setup), sigma_m(&in_ms));
        assert!((other / right - 1.0).abs() < 1e-9, "{right} {other}");
        let ratio = printed_p33(&in_ms).unwrap() / printed_p33(&setup).unwrap();
        assert!(!(0.5..2.0).contains(&ratio), "{ratio}");
    }
}
