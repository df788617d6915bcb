//! One place, weighed against the markers around it and against standing anywhere.

use nalgebra::{Matrix3, Vector3};

use super::markers::Markers;

/// Who stands at no marker stands anywhere between them: a kernel about each marker, as wide as the
/// lattice, makes an even density of them where there are markers, at the ground's own height. Sigmas
/// in plan and upwards, m.
const ANYWHERE_SIGMA_M: (f64, f64) = (4.0, 1.5);
/// But not beside one: who stands there is at it. The hole about each marker, its sigma in m, and what
/// part of the even density it takes out of a lattice of 10 m (0.0115 markers/m² · 2π · sigma²).
const BESIDE_SIGMA_M: f64 = 1.7;
const BESIDE_SHARE: f64 = 0.21;
/// Where markers stand alone, so much of the kernel is left.
const LEAST_LEFT: f64 = 0.1;
/// The density far from all markers, 1/m² (over height, where it counts): nothing can be ruled out.
const FAR_AWAY: f64 = 1e-6;
/// Markers beyond so many sigmas are not weighed.
const REACH_SIGMAS: f64 = 5.5;

/// Densities of a place under each marker within reach, and under none of them; as if there were one
/// marker a share of the database's number, which cancels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Weighed {
    /// Numbers of the markers with their densities.
    pub(super) near: Vec<(usize, f64)>,
    /// The density of standing anywhere.
    pub(super) none: f64,
    /// Whether heights were weighed, too.
    pub(super) with_height: bool,
}

/// Weighs a place that is known with this covariance. Height counts where every marker within reach
/// has one.
pub(super) fn weigh(
    place_n_m: &Vector3<f64>,
    covariance_m2: &Matrix3<f64>,
    beside_sigma_m: f64,
    markers: &Markers,
) -> Weighed {
    if !covariance_m2.iter().chain(place_n_m).all(|number| number.is_finite()) {
        return Weighed { near: Vec::new(), none: FAR_AWAY, with_height: false };
    }
    let largest_m2 = covariance_m2[(0, 0)] + covariance_m2[(1, 1)];
    let (anywhere_m, anywhere_up_m) = ANYWHERE_SIGMA_M;
    let within_m = REACH_SIGMAS * libm::sqrt(largest_m2 + anywhere_m * anywhere_m);
    let numbers = markers.near(&place_n_m.xy(), within_m);
    let with_height = numbers.iter().all(|&number| markers.get(number).position_n_m.2.is_some());
    let spread = |plan_m: f64, up_m: f64| {
        let own = Vector3::new(plan_m * plan_m, plan_m * plan_m, up_m * up_m);
        Normal::new(&(covariance_m2 + Matrix3::from_diagonal(&own)), with_height)
    };
    let at_marker = spread(beside_sigma_m, beside_sigma_m);
    let anywhere = spread(anywhere_m, libm::hypot(anywhere_up_m, beside_sigma_m));
    let beside = spread(BESIDE_SIGMA_M, libm::hypot(anywhere_up_m, beside_sigma_m));
    let mut near = Vec::with_capacity(numbers.len());
    let (mut evenly, mut taken_out) = (0.0, 0.0);
    for number in numbers {
        let (e_m, n_m, u_m) = markers.get(number).position_n_m;
        let off = place_n_m - Vector3::new(e_m, n_m, u_m.unwrap_or(place_n_m.z));
        near.push((number, at_marker.density(&off)));
        evenly += anywhere.density(&off);
        taken_out += BESIDE_SHARE * beside.density(&off);
    }
    let none = FAR_AWAY + (evenly - taken_out).max(LEAST_LEFT * evenly) / (1.0 - BESIDE_SHARE);
    Weighed { near, none, with_height }
}

/// A normal density in plan, or in plan and height.
struct Normal {
    information: Matrix3<f64>,
    factor: f64,
}

impl Normal {
    fn new(covariance_m2: &Matrix3<f64>, with_height: bool) -> Normal {
        let mut covariance = *covariance_m2;
        if !with_height {
            for axis in 0..2 {
                covariance[(axis, 2)] = 0.0;
                covariance[(2, axis)] = 0.0;
            }
            covariance[(2, 2)] = 1.0;
        }
        // A covariance that its variances do not allow (rounding) must not turn the Gaussian inside out.
        let most = 0.999 * libm::sqrt(covariance[(0, 0)] * covariance[(1, 1)]);
        covariance[(0, 1)] = covariance[(0, 1)].max(-most).min(most);
        covariance[(1, 0)] = covariance[(0, 1)];
        let mut information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        let mut volume = std::f64::consts::TAU * libm::sqrt(covariance.determinant().max(0.0));
        if with_height {
            volume *= libm::sqrt(std::f64::consts::TAU);
        } else {
            information[(2, 2)] = 0.0;
        }
        Normal { information, factor: if volume > 0.0 { 1.0 / volume } else { 0.0 } }
    }

    fn density(&self, off: &Vector3<f64>) -> f64 {
        self.factor * libm::exp(-0.5 * off.dot(&(self.information * off)))
    }
}
