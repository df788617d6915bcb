//! An instrument as its file says it, and what is refused.

use super::*;

/// Six antennas, three stations, a platform on six legs.
const TEXT: &str = r#"
[site]
latitude_deg = 25.65
longitude_deg = 106.86
height_m = 840.0
gravity_m_s2 = 9.7874

[imu]
position_b = [0.5, -0.3, 0.3]
c_b_s = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
mounting_sigma_rad = 1.7e-4
gyro_bias_sigma_rad_s = 4.85e-8
angle_random_walk_rad_sqrt_s = 2.9e-7
accelerometer_bias_sigma_m_s2 = 9.8e-4
velocity_random_walk_m_s_sqrt_s = 1.0e-4
gyro_scale_sigma = 2.0e-5
accelerometer_scale_sigma = 1.0e-4

[platform_imu]
position_p = [-0.2, 0.2, 0.1]
c_p_s = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
mounting_sigma_rad = 1.7e-4

[antennas]
names = ["A1", "A2", "A3", "A4", "A5", "A6"]
make = ["L", "B", "L", "B", "L", "B"]
position_b = [
  [0.0, 6.5, 1.2], [5.629, 3.25, 1.2], [5.629, -3.25, 1.2], [0.0, -6.5, 1.2], [-5.629, -3.25, 1.2], [-5.629, 3.25, 1.2],
]
position_sigma_m = 0.001
delay_s = { L = 0.09, B = 0.12 }
delay_sigma_s = 0.008

[stations]
names = ["S1", "S2", "S3"]
position_n = [[100.0, 0.0, 20.0], [-60.0, 90.0, 22.0], [-50.0, -80.0, 18.0]]
position_sigma_m = 0.0003
delay_s = 0.01
delay_sigma_s = 0.002
delay_jitter_s = 0.003
angle_sigma_rad = 2.4e-6
slant_sigma_m = 0.0005
slant_ppm = 1.0

[targets_cabin]
names = ["C1", "C2", "C3"]
position_b = [[4.0, 4.8, -1.0], [6.2, -1.1, -1.0], [-6.2, 1.1, -1.0]]

[targets_platform]
names = ["P1", "P2", "P3"]
position_p = [[0.0, 1.75, -0.35], [1.516, -0.875, -0.35], [-1.516, -0.875, -0.35]]

[rotator]
pivot_b = [0.0, 0.0, -0.8]
angle_sigma_rad = 2.0e-6

[stewart]
joint_r = [
  [-1.709, 1.539, -0.4], [1.709, 1.539, -0.4], [2.187, 0.711, -0.4],
  [0.478, -2.250, -0.4], [-0.478, -2.250, -0.4], [-2.187, 0.711, -0.4],
]
joint_p = [
  [-0.460, 1.844, 0.25], [0.460, 1.844, 0.25], [1.826, -0.524, 0.25],
  [1.367, -1.320, 0.25], [-1.367, -1.320, 0.25], [-1.826, -0.524, 0.25],
]
rest_r = [0.0, 0.0, -2.35]
leg_sigma_m = 0.001
"#;

pub(crate) fn example() -> Instrument {
    Instrument::from_toml(TEXT).unwrap()
}

#[test]
fn an_instrument_is_read_and_knows_its_makes_and_prisms() {
    let instrument = example();
    assert_eq!(instrument.makes(), ["B", "L"]);
    assert_eq!(instrument.target_names(), ["C1", "C2", "C3", "P1", "P2", "P3"]);
    assert!((instrument.earth().gravity_n(&Vector3::zeros()).norm() - 9.7874).abs() < 1e-9);
}

#[test]
fn what_contradicts_itself_is_refused_with_where_and_what() {
    for (from, to, told) in [
        ("[rotator]", "[rotors]", "[rotator]"),
        ("\"A5\", \"A6\"]", "\"A5\"]", "[antennas] position_b: expected 5 entries"),
        ("\"L\", \"B\", \"L\", \"B\", \"L\", \"B\"", "\"L\", \"B\", \"L\"", "[antennas] make"),
        ("\"A2\"", "\"A1\"", "found \"A1\" twice"),
        ("[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]", "a reflection"),
        (
            "[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]",
            "[0.0, 1.1, 0.0], [-1.0, 0.0, 0.0]",
            "[imu] c_b_s: expected a rotation",
        ),
        ("B = 0.12", "B = 2.0", "delay_s.B: expected seconds from 0 to 0.4, found 2"),
        ("B = 0.12", "C = 0.12", "none for \"B\""),
        ("gravity_m_s2 = 9.7874", "gravity_m_s2 = 1.0", "[site] gravity_m_s2"),
        ("pivot_b = [0.0, 0.0, -0.8]", "pivot_b = [0.0, 0.0, -800.0]", "[rotator] pivot_b: expected metres"),
        ("leg_sigma_m = 0.001", "leg_sigma_m = 1.0", "[stewart] leg_sigma_m"),
        ("slant_sigma_m = 0.0005\n", "", "slant_sigma_m"),
        ("height_m = 840.0", "height_m = high", "expected TOML"),
    ] {
        assert!(TEXT.contains(from), "{from}");
        let error = Instrument::from_toml(&TEXT.replacen(from, to, 1)).unwrap_err();
        assert!(error.to_string().contains(told), "{to}: {error}");
    }
}
