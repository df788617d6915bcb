//! What the position may be wrong by beyond the covariance of the filter: contradictions that no state stands for. It
//! changes no estimate; it widens what is told, and makes room for the next marker.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::filter::Filter;
use crate::ins::layout::ErrorState;

/// Sigma of a heading of which nothing is known, rad: all directions are as likely.
pub(super) const UNKNOWN_NORTH_RAD: f64 = 1.8;

/// Sigmas beside those of the filter.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Beyond {
    /// In plan, on each axis, m.
    plan_m: f64,
    /// In height, m.
    up_m: f64,
    /// By how much turns may have been misread, counterclockwise positive, rad: those to the left cancel those to the right …
    turned_wrongly_rad: f64,
    /// … but not all of it, rad².
    turned_wrongly_rad2: f64,
    /// Where the walk began of which nothing says how it is turned, m; `None` where something does.
    turned_about_n: Option<Vector3<f64>>,
    /// How far the feet were apart when it was last told, m.
    pub(super) feet_apart_m: f64,
}

impl Beyond {
    /// A way of so many metres, of which a share may be wrong, and a turn that may be wrong by this angle.
    pub(super) fn go_on(&mut self, share: f64, way_m: f64, wrong_rad: f64) {
        self.turned_wrongly_rad += wrong_rad;
        self.turned_wrongly_rad2 += wrong_rad * wrong_rad;
        self.plan_m += (share + self.heading_rad()) * way_m;
        self.up_m += share * way_m;
    }

    /// Sigma of the heading, rad.
    fn heading_rad(&self) -> f64 {
        let squares = self.turned_wrongly_rad * self.turned_wrongly_rad + self.turned_wrongly_rad2;
        squares.sqrt().min(UNKNOWN_NORTH_RAD)
    }

    /// The position may be wrong by so much at least, m.
    pub(super) fn reach(&mut self, plan_m: f64, up_m: f64) {
        self.plan_m = self.plan_m.max(plan_m);
        self.up_m = self.up_m.max(up_m);
    }

    /// Nothing says where north is: what was walked since `place_n` may point anywhere.
    pub(super) fn lose_north(&mut self, place_n: Vector3<f64>) {
        self.turned_about_n.get_or_insert(place_n);
    }

    /// Something says again where north is.
    pub(super) fn find_north(&mut self) {
        self.turned_about_n = None;
    }

    /// What lies beyond the filter in plan, on each axis, m².
    pub(super) fn plan_m2(&self) -> f64 {
        self.plan_m * self.plan_m
    }

    /// Variances on each axis of a position, m², and of the heading, rad².
    pub(super) fn variances(&self, p_n: &Vector3<f64>) -> ([f64; 3], f64) {
        let (mut plan, mut turned) = (self.plan_m * self.plan_m, self.heading_rad() * self.heading_rad());
        if let Some(about_n) = &self.turned_about_n {
            plan += (p_n - about_n).xy().norm_squared();
            turned += UNKNOWN_NORTH_RAD * UNKNOWN_NORTH_RAD;
        }
        ([plan, plan, self.up_m * self.up_m], turned)
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// What lies beyond goes into the filter's covariance, for a visit to be weighed by: it counts anew from here.
    pub(super) fn take_in_beyond(&mut self) {
        let middle_n = self.middle_p_n();
        let (by_axis, _) = self.beyond.variances(&middle_n);
        if by_axis == [0.0; 3] {
            return;
        }
        let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
        self.eskf.add_noise(&positions, &Vector3::from(by_axis));
        (self.beyond.plan_m, self.beyond.up_m) = (0.0, 0.0);
    }

    /// A visit has said where the inspector is.
    pub(super) fn beyond_is_here(&mut self) {
        let middle_n = self.middle_p_n();
        if let Some(about_n) = &mut self.beyond.turned_about_n {
            *about_n = middle_n;
        }
    }

    /// The covariance of the middle of the feet with what lies beyond, m², and the variance of the heading, rad².
    pub(super) fn told_covariance(&self) -> (Matrix3<f64>, f64) {
        let (by_axis, heading) = self.beyond.variances(&self.middle_p_n());
        let own = self.sigma_heading_rad(0);
        (self.middle_covariance() + Matrix3::from_diagonal(&Vector3::from(by_axis)), own * own + heading)
    }
}
