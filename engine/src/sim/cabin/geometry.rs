//! The instrument of a seed: as surveyed, and how it is in truth.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::super::random::{Purpose, Random};
use crate::geo::Site;

/// Where everything is fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    pub(super) site: Site,
    pub(super) imu_b: Vector3<f64>,
    pub(super) c_bs: Matrix3<f64>,
    pub(super) platform_imu_p: Vector3<f64>,
    pub(super) c_ps: Matrix3<f64>,
    pub(super) antennas_b: Vec<Vector3<f64>>,
    pub(super) delay_s: [f64; 2],
    pub(super) stations_n: Vec<Vector3<f64>>,
    pub(super) station_delay_s: f64,
    pub(super) cabin_targets_b: Vec<Vector3<f64>>,
    pub(super) platform_targets_p: Vec<Vector3<f64>>,
    pub(super) pivot_b: Vector3<f64>,
    pub(super) joints_r: Vec<Vector3<f64>>,
    pub(super) joints_p: Vec<Vector3<f64>>,
    pub(super) rest_r: Vector3<f64>,
}

/// Prisms on the cabin; those on the platform are counted on from here.
pub const PRISMS_ON_CABIN: usize = 6;
/// Sigmas that the instrument's file states.
pub(super) const MOUNTING_RAD: f64 = 1.7e-4;
pub(super) const SURVEY_M: f64 = 0.001;
pub(super) const PILLAR_M: f64 = 0.0003;
pub(super) const DELAY_SIGMA_S: f64 = 0.008;
pub(super) const STATION_DELAY_SIGMA_S: f64 = 0.002;
pub(super) const JITTER_S: f64 = 0.003;
pub(super) const ANGLE_RAD: f64 = 2.4e-6;
pub(super) const SLANT_M: f64 = 0.0005;
pub(super) const LEG_M: f64 = 0.001;
pub(super) const ROTATOR_RAD: f64 = 2e-6;

impl Geometry {
    pub(super) fn drawn(seed: u64) -> Geometry {
        let mut random = Random::new(seed, Random::COMMON, Purpose::Course);
        let ring = |count: usize, radius_m: f64, height_m: f64, from_deg: f64| -> Vec<Vector3<f64>> {
            (0..count)
                .map(|k| {
                    let (sin, cos) = libm::sincos((from_deg + 360.0 / count as f64 * k as f64).to_radians());
                    Vector3::new(radius_m * sin, radius_m * cos, height_m)
                })
                .collect()
        };
        let quarter_turns = |about: Vector3<f64>, turns: f64| {
            Rotation3::from_scaled_axis(about * (turns * std::f64::consts::FRAC_PI_2))
                .into_inner()
                .map(libm::round)
        };
        let c_bs = quarter_turns(Vector3::z(), libm::round(random.uniform(-1.4, 2.4)));
        let c_ps = quarter_turns(Vector3::z(), libm::round(random.uniform(-1.4, 2.4)));
        let radius_m = random.uniform(6.0, 7.0);
        let antennas_b = ring(6, radius_m, random.uniform(0.9, 1.4), random.uniform(0.0, 60.0));
        let stations_n = ring(6, 1.0, 0.0, random.uniform(0.0, 60.0))
            .into_iter()
            .map(|toward| {
                let out_m = random.uniform(50.0, 155.0);
                let (sin, cos) = libm::sincos(random.uniform(-0.3, 0.3));
                let turned =
                    Vector3::new(toward.x * cos - toward.y * sin, toward.x * sin + toward.y * cos, 0.0);
                // On the dish, a sphere of 300 m about a point 300 m up.
                turned * out_m + Vector3::z() * (300.0 - libm::sqrt(300.0 * 300.0 - out_m * out_m) + 2.5)
            })
            .collect();
        let joint_pair = |radius_m: f64, spread_rad: f64, from: f64, height_m: f64| -> Vec<Vector3<f64>> {
            (0..6)
                .map(|k| {
                    let side = if k % 2 == 0 { -spread_rad } else { spread_rad };
                    let third = (k / 2) as f64 * std::f64::consts::TAU / 3.0;
                    let (sin, cos) = libm::sincos(from + third + side);
                    Vector3::new(radius_m * sin, radius_m * cos, height_m)
                })
                .collect()
        };
        let joints_r = joint_pair(2.3, 0.84, 0.0, -0.4);
        let joints_p = joint_pair(1.9, 0.245, 0.0, 0.25);
        Geometry {
            site: Site::fast(),
            imu_b: Vector3::new(
                random.uniform(-0.8, 0.8),
                random.uniform(-0.8, 0.8),
                random.uniform(0.1, 0.5),
            ),
            c_bs,
            platform_imu_p: Vector3::new(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), 0.1),
            c_ps,
            antennas_b,
            delay_s: [random.uniform(0.07, 0.1), random.uniform(0.1, 0.13)],
            stations_n,
            station_delay_s: 0.01,
            cabin_targets_b: ring(PRISMS_ON_CABIN, 6.3, -1.0, 40.0),
            platform_targets_p: ring(3, 1.75, -0.35, 0.0),
            pivot_b: Vector3::new(0.0, 0.0, -0.8),
            joints_r,
            joints_p,
            rest_r: Vector3::new(0.0, 0.0, -2.35),
        }
    }

    /// The instrument's file.
    pub(super) fn to_toml(&self) -> String {
        let vector = |v: &Vector3<f64>| format!("[{:.6}, {:.6}, {:.6}]", v.x, v.y, v.z);
        let list = |all: &[Vector3<f64>]| {
            let rows: Vec<String> = all.iter().map(|v| format!("  {},\n", vector(v))).collect();
            format!("[\n{}]", rows.concat())
        };
        let rows = |m: &Matrix3<f64>| list(&[0, 1, 2].map(|k| m.row(k).transpose()));
        let names = |letter: char, count: usize| {
            let all: Vec<String> = (1..=count).map(|k| format!("\"{letter}{k}\"")).collect();
            format!("[{}]", all.join(", "))
        };
        let site = &self.site;
        let mut text = format!(
            "[site]\nlatitude_deg = {}\nlongitude_deg = {}\nheight_m = {:.3}\ngravity_m_s2 = {}\n\n",
            site.latitude_deg, site.longitude_deg, site.height_m, site.gravity_m_s2
        );
        text += &format!(
            "[imu]\nposition_b = {}\nc_b_s = {}\nmounting_sigma_rad = {MOUNTING_RAD:e}\ngyro_bias_sigma_rad_s = 4.85e-8\n\
             angle_random_walk_rad_sqrt_s = 2.9e-7\naccelerometer_bias_sigma_m_s2 = 9.8e-4\n\
             velocity_random_walk_m_s_sqrt_s = 1.0e-4\ngyro_scale_sigma = 2.0e-5\naccelerometer_scale_sigma = 1.0e-4\n\n",
            vector(&self.imu_b),
            rows(&self.c_bs)
        );
        text += &format!(
            "[platform_imu]\nposition_p = {}\nc_p_s = {}\nmounting_sigma_rad = {MOUNTING_RAD:e}\n\n",
            vector(&self.platform_imu_p),
            rows(&self.c_ps)
        );
        text += &format!(
            "[antennas]\nnames = {}\nmake = [\"L\", \"B\", \"L\", \"B\", \"L\", \"B\"]\nposition_b = {}\nposition_sigma_m = {SURVEY_M}\n\
             delay_s = {{ L = {:.3}, B = {:.3} }}\ndelay_sigma_s = {DELAY_SIGMA_S}\n\n",
            names('A', 6),
            list(&self.antennas_b),
            self.delay_s[0],
            self.delay_s[1]
        );
        text += &format!(
            "[stations]\nnames = {}\nposition_n = {}\nposition_sigma_m = {PILLAR_M}\ndelay_s = {}\n\
             delay_sigma_s = {STATION_DELAY_SIGMA_S}\ndelay_jitter_s = {JITTER_S}\nangle_sigma_rad = {ANGLE_RAD:e}\n\
             slant_sigma_m = {SLANT_M}\nslant_ppm = 1.0\n\n",
            names('S', 6),
            list(&self.stations_n),
            self.station_delay_s
        );
        text += &format!(
            "[targets_cabin]\nnames = {}\nposition_b = {}\n\n[targets_platform]\nnames = {}\nposition_p = {}\n\n",
            names('C', 6),
            list(&self.cabin_targets_b),
            names('P', 3),
            list(&self.platform_targets_p)
        );
        text += &format!(
            "[rotator]\npivot_b = {}\nangle_sigma_rad = {ROTATOR_RAD:e}\n\n[stewart]\njoint_r = {}\njoint_p = {}\nrest_r = {}\nleg_sigma_m = {LEG_M}\n",
            vector(&self.pivot_b),
            list(&self.joints_r),
            list(&self.joints_p),
            vector(&self.rest_r)
        );
        text
    }
}
