//! What antennas and stations should read, and how that changes with the filter's errors.

use nalgebra::{Matrix3, Matrix3x6, Vector3};

use super::covariance::Sparse;
use super::filter::{Filter, Measured};
use super::rig::Target;
use super::rows::{AntennaRow, RayRow};
use super::states::{ATTITUDE, MOUNTING, POSITION, SURVEY, VELOCITY};
use crate::rotation::{skew, wrap};

/// Encoders are read across a hole of so long at most, ns.
const LONGEST_HOLE_NS: i64 = 160_000_000;

/// A point of the body at a moment.
#[derive(Clone, Debug)]
pub(super) struct PointAt {
    pub(super) p_n: Vector3<f64>,
    pub(super) v_n: Vector3<f64>,
    pub(super) c_nb: Matrix3<f64>,
    /// How the place changes with attitude, velocity, position and mounting.
    pub(super) jacobian: Sparse,
}

/// A place in b that may move and depend on the legs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) at_b: Vector3<f64>,
    rate_b: Vector3<f64>,
    by_legs: Option<Matrix3x6<f64>>,
}

impl Place {
    pub(super) fn rate_b(&self) -> Vector3<f64> {
        self.rate_b
    }

    pub(super) fn at_rest(self) -> Place {
        Place { rate_b: Vector3::zeros(), ..self }
    }
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
            noise: Matrix3::from_diagonal(&white.component_mul(&white)),
        })
    }

    /// Where a prism is in b at a time; `None` where the encoders do not say.
    pub(super) fn place_of(&self, target: usize, t_ns: i64) -> Option<Place> {
        match self.rig.targets.get(target)? {
            Target::Body(at_b) => Some(Place { at_b: *at_b, rate_b: Vector3::zeros(), by_legs: None }),
            Target::Elsewhere => None,
            Target::Platform(place_p) => self.on_platform(place_p, t_ns),
        }
    }

    /// A point of the platform in b at a time, between the readings of the encoders around it.
    pub(super) fn on_platform(&self, place_p: &Vector3<f64>, t_ns: i64) -> Option<Place> {
        let after =
            self.seats.partition_point(|(seat_ns, _)| *seat_ns < t_ns).clamp(1, self.seats.len().max(1));
        let ((from_ns, from), (to_ns, to)) =
            (self.seats.get(after - 1)?, self.seats.get(after).or_else(|| self.seats.back())?);
        if (t_ns - from_ns).abs().min((t_ns - to_ns).abs()) > LONGEST_HOLE_NS {
            return None;
        }
        let ((from_b, _), (to_b, by_legs)) = (from.point(place_p), to.point(place_p));
        let biased_b = by_legs * self.leg_biases();
        let (from_b, to_b) = (from_b - biased_b, to_b - biased_b);
        let span_s = (to_ns - from_ns) as f64 * 1e-9;
        if span_s <= 0.0 || span_s > 0.5 {
            return Some(Place { at_b: to_b, rate_b: Vector3::zeros(), by_legs: Some(by_legs) });
        }
        let rate_b = (to_b - from_b) / span_s;
        let at_b = from_b + rate_b * ((t_ns - from_ns) as f64 * 1e-9);
        Some(Place { at_b, rate_b, by_legs: Some(by_legs) })
    }

    /// The encoders' reading that is nearest to a time, ns.
    pub(super) fn seat_near(&self, t_ns: i64) -> Option<&(i64, super::joints::PlatformInCabin)> {
        self.seats.iter().min_by_key(|(seat_ns, _)| (seat_ns - t_ns).abs())
    }

    /// The estimated biases of the legs, m: reading − length.
    pub(super) fn leg_biases(&self) -> nalgebra::Vector6<f64> {
        nalgebra::Vector6::from_fn(|leg, _| self.x[self.states.legs + leg])
    }

    /// What a ray says; `None` where it is too late to be weighed, or its prism is nowhere.
    pub(super) fn measure_ray(&self, row: &RayRow) -> Option<Measured> {
        let station = &self.rig.station;
        let delay_s = station.delay_s + self.x[self.states.station_delay];
        let t_ns = row.t_ns - (delay_s * 1e9) as i64;
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
                for leg in 0..6 {
                    add(self.states.legs + leg, -by_legs_n.column(leg).into_owned());
                }
            }
            noise_n +=
                by_legs_n * by_legs_n.transpose() * (self.tuning.leg_noise * self.rig.leg_sigma_m).powi(2);
        }
        let own = self.states.station(row.station);
        if self.tuning.calibration {
            add(self.states.station_delay, -v_n);
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
        let noise =
            Matrix3::from_diagonal(&white.component_mul(&white)) + by_place * noise_n * by_place.transpose();
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
