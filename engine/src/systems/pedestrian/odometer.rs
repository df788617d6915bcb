//! How far an inspector has walked, and which way the body faces.

use crate::rotation::{azimuth, wrap};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Path length by stances, and the angle from the sensor's x axis to the direction of walking.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Walked {
    last_stand_p_n: [Option<Vector3<f64>>; 2],
    /// Length of each foot's path, m.
    distance_m: [f64; 2],
    /// Sums of sine and cosine of (direction of the stride − azimuth of the x axis) of sensor 0.
    mounting: (f64, f64),
    /// The angle of those sums, rad.
    mounting_rad: f64,
}

/// A foot shuffles less than this between two stances without having walked, m.
const SHORTEST_STRIDE_M: f64 = 0.1;

impl Walked {
    /// Foot number `sensor` stands at `p_n`, its x axis at the azimuth `heading_rad`.
    pub(crate) fn stand(&mut self, sensor: usize, p_n: &Vector3<f64>, heading_rad: f64) {
        let Some(before) = self.last_stand_p_n[sensor] else {
            self.last_stand_p_n[sensor] = Some(*p_n);
            return;
        };
        let stride = p_n - before;
        let length = stride.norm();
        if length < SHORTEST_STRIDE_M {
            return;
        }
        self.distance_m[sensor] += length;
        self.last_stand_p_n[sensor] = Some(*p_n);
        if sensor == 0 && stride.xy().norm() > 0.5 {
            let offset = azimuth(stride.x, stride.y) - heading_rad;
            self.mounting.0 += libm::sin(offset);
            self.mounting.1 += libm::cos(offset);
            self.mounting_rad = libm::atan2(self.mounting.0, self.mounting.1);
        }
    }

    /// The track was moved by a correction: the next stride is measured from there.
    pub(crate) fn shift(&mut self, sensor: usize, by_n: &Vector3<f64>) {
        if let Some(p_n) = &mut self.last_stand_p_n[sensor] {
            *p_n += by_n;
        }
    }

    /// The track was turned about the vertical through `about_n`.
    pub(crate) fn turn(&mut self, r: &Matrix3<f64>, about_n: &Vector3<f64>) {
        for p_n in self.last_stand_p_n.iter_mut().flatten() {
            *p_n = about_n + r * (*p_n - about_n);
        }
    }

    /// Length of the path, the mean of the feet that walk, m.
    pub(crate) fn distance_m(&self, feet: usize) -> f64 {
        self.distance_m[..feet].iter().sum::<f64>() / feet as f64
    }

    /// The direction in which the inspector faces when the x axis of sensor 0 has the azimuth
    /// `x_axis_rad`: the same until there has been a stride.
    pub(crate) fn heading_rad(&self, x_axis_rad: f64) -> f64 {
        wrap(x_axis_rad + self.mounting_rad)
    }
}
