//! What antennas and stations should read, and how that changes with the filter's errors.

use nalgebra::{Matrix3, Vector3};

use super::covariance::Sparse;
use super::filter::{Filter, Measured};
use super::rows::{AntennaRow, RayRow};
use super::states::{ATTITUDE, MOUNTING, POSITION, SURVEY, VELOCITY};
use crate::rotation::{skew, wrap};

/// A point of the body at a moment.
#[derive(Clone, Debug)]
pub(super) struct PointAt {
    pub(super) p_n: Vector3<f64>,
    pub(super) v_n: Vector3<f64>,
    pub(super) c_nb: Matrix3<f64>,
    /// How the place changes with attitude, velocity, position and mounting.
    pub(super) jacobian: Sparse,
}

pub(super) fn push(jacobian: &mut Sparse, state: usize, block: &Matrix3<f64>) {
    for column in 0..3 {
        let [x, y, z] = [block[(0, column)], block[(1, column)], block[(2, column)]];
        jacobian.push((state + column, [x, y, z]));
    }
}

impl Filter {
    /// A point of the body at a time, ns.
    pub(super) fn point(&self, t_ns: i64, place_b: &Vector3<f64>, rate_b: &Vector3<f64>) -> Option<PointAt> {
        let moment = self.past.at(t_ns)?;
        let c_nb = moment.c_nb * self.mounting.transpose();
        let arm_n = c_nb * (place_b - self.rig.lever_b);
        let age_s = (self.t_ns - t_ns) as f64 * 1e-9;
        let cross = skew(&arm_n);
        let mut jacobian = Sparse::with_capacity(36);
        push(&mut jacobian, ATTITUDE, &-cross);
        for axis in 0..3 {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            jacobian.push((POSITION + axis, unit));
            unit[axis] = -age_s;
            jacobian.push((VELOCITY + axis, unit));
        }
        push(&mut jacobian, MOUNTING, &(cross * c_nb));
        let w_n = c_nb * moment.w_nb_b;
        Some(PointAt {
            p_n: moment.p_n + arm_n,
            v_n: moment.v_n + w_n.cross(&arm_n) + c_nb * rate_b,
            c_nb,
            jacobian,
        })
    }

    /// What a fix says; `None` where it is too late to be weighed.
    pub(super) fn measure_antenna(&self, row: &AntennaRow) -> Option<Measured> {
        let antenna = &self.rig.antennas[row.antenna];
        let states = &self.states;
        let delay = states.make_delays + antenna.make;
        let delay_s = self.rig.make_delay_s[antenna.make] + self.x[delay];
        let t_ns = row.t_ns - (delay_s * 1e9) as i64;
        let PointAt { p_n, v_n, c_nb, mut jacobian } =
            self.point(t_ns, &antenna.position_b, &Vector3::zeros())?;
        let from_centre = antenna.position_b - self.rig.antenna_centre_b();
        let x = |k: usize| Vector3::new(self.x[k], self.x[k + 1], self.x[k + 2]);
        let surveyed = x(SURVEY) + x(SURVEY + 3).cross(&from_centre);
        let (make, own) = (states.make(antenna.make), states.antenna(row.antenna));
        if self.tuning.calibration {
            push(&mut jacobian, SURVEY, &c_nb);
            push(&mut jacobian, SURVEY + 3, &(c_nb * -skew(&from_centre)));
            jacobian.push((delay, [-v_n.x, -v_n.y, -v_n.z]));
            for axis in 0..3 {
                let mut unit = [0.0; 3];
                unit[axis] = 1.0;
                jacobian.push((make + axis, unit));
                jacobian.push((own + axis, unit));
            }
        }
        let [plan, height] = self.tuning.antenna_white;
        let white = Vector3::from(row.sigma_n).component_mul(&Vector3::new(plan, plan, height));
        Some(Measured {
            jacobian,
            innovation: Vector3::from(row.position_n) - (p_n + c_nb * surveyed + x(make) + x(own)),
            noise: Matrix3::from_diagonal(&white.component_mul(&white)) * self.scatter[0],
        })
    }

    /// What the stations delay, ns.
    pub(super) fn station_delay_ns(&self) -> i64 {
        ((self.rig.station.delay_s + self.x[self.states.station_delay]) * 1e9) as i64
    }

    /// What a ray says; `None` where it is too late to be weighed, or its prism is nowhere.
    pub(super) fn measure_ray(&self, row: &RayRow) -> Option<Measured> {
        let station = &self.rig.station;
        let t_ns = row.t_ns - self.station_delay_ns();
        let place = self.place_of(row.target, t_ns)?;
        let PointAt { p_n, v_n, c_nb, jacobian: of_place } = self.point(t_ns, &place.at_b, &place.rate_b)?;
        let ray_n = p_n - self.rig.stations_n[row.station];
        let (plan_m, slant_m) = (libm::hypot(ray_n.x, ray_n.y).max(1e-3), ray_n.norm().max(1e-3));
        let sin_zenith = plan_m / slant_m;
        let by_place = ray_jacobian(&ray_n);

        let mut jacobian = Sparse::with_capacity(of_place.len() + 16);
        let mut add = |state: usize, column: Vector3<f64>| {
            let h = by_place * column;
            jacobian.push((state, [h.x, h.y, h.z]));
        };
        for (state, column) in of_place {
            add(state, Vector3::from(column));
        }
        let mut noise_n = v_n * v_n.transpose() * station.delay_jitter_s.powi(2);
        if let Some(by_legs) = place.by_legs {
            // A longer reading that is a bias is a shorter leg.
            let by_legs_n = c_nb * by_legs;
            if self.tuning.calibration {
                // By later encoders the platform has gone farther.
                let gone_b = place.rate_b * self.of_velocity(&place.rate_b, &place);
                add(self.states.encoder_delay, c_nb * gone_b);
                for (axis, by_angle) in place.by_angles.iter().enumerate() {
                    add(self.states.rotator + axis, c_nb * -by_angle);
                }
                for leg in 0..6 {
                    add(self.states.legs + leg, -by_legs_n.column(leg).into_owned());
                }
            }
            noise_n += by_legs_n * by_legs_n.transpose() * self.leg_noise_m2(&place);
            noise_n += Matrix3::identity() * place.unseen_m.powi(2);
        }
        let own = self.states.station(row.station);
        if self.tuning.calibration {
            add(self.states.station_delay, -v_n * self.of_velocity(&v_n, &place));
            jacobian.push((own, [1.0 / sin_zenith, 0.0, 0.0]));
            jacobian.push((own + 1, [0.0, 1.0, 0.0]));
            jacobian.push((own + 2, [0.0, 0.0, 1.0]));
            jacobian.push((own + 3, [1.0 / sin_zenith, 0.0, 0.0]));
            jacobian.push((own + 4, [0.0, 1.0, 0.0]));
            jacobian.push((own + 5, [0.0, 0.0, 1.0]));
        }
        let x = &self.x;
        let predicted = Vector3::new(
            libm::atan2(ray_n.x, ray_n.y) + (x[own] + x[own + 3]) / sin_zenith,
            libm::atan2(plan_m, ray_n.z) + x[own + 1] + x[own + 4],
            slant_m + x[own + 2] + x[own + 5],
        );
        let mut innovation = Vector3::new(row.azimuth_rad, row.zenith_rad, row.slant_m) - predicted;
        innovation.x = wrap(innovation.x);
        let slant_sigma_m = station.slant_m + station.slant_ppm * 1e-6 * slant_m;
        let white = Vector3::new(station.angle_rad / sin_zenith, station.angle_rad, slant_sigma_m);
        let noise = Matrix3::from_diagonal(&white.component_mul(&white)) * self.scatter[1]
            + by_place * noise_n * by_place.transpose();
        Some(Measured { jacobian, innovation, noise })
    }
}

/// How azimuth, zenith angle and distance (rows) change with the place that is looked at.
pub(super) fn ray_jacobian(ray_n: &Vector3<f64>) -> Matrix3<f64> {
    let (plan, slant) = (libm::hypot(ray_n.x, ray_n.y).max(1e-3), ray_n.norm().max(1e-3));
    let (plan_2, slant_2) = (plan * plan, slant * slant);
    Matrix3::new(
        ray_n.y / plan_2,
        -ray_n.x / plan_2,
        0.0,
        ray_n.x * ray_n.z / (plan * slant_2),
        ray_n.y * ray_n.z / (plan * slant_2),
        -plan / slant_2,
        ray_n.x / slant,
        ray_n.y / slant,
        ray_n.z / slant,
    )
}
