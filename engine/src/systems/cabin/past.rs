//! Where the inertial sensor has been in the last moments: what a late row is weighed against.

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::rotation::cayley;

/// For how long it is kept, ns: twice the longest delay that an instrument may have.
const KEPT_NS: i64 = 800_000_000;

/// The sensor at a moment.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Moment {
    pub(super) t_ns: i64,
    pub(super) c_nb: Matrix3<f64>,
    pub(super) v_n: Vector3<f64>,
    pub(super) p_n: Vector3<f64>,
    /// Rate against n, in b, rad/s.
    pub(super) w_nb_b: Vector3<f64>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Past(VecDeque<Moment>);

impl Past {
    pub(super) fn push(&mut self, moment: Moment) {
        while self.0.front().is_some_and(|first| first.t_ns < moment.t_ns - KEPT_NS) {
            self.0.pop_front();
        }
        self.0.push_back(moment);
    }

    /// The sensor at a time, from the nearest moment; `None` before the first that is kept.
    pub(super) fn at(&self, t_ns: i64) -> Option<Moment> {
        let first = self.0.front()?;
        if t_ns < first.t_ns - 10_000_000 {
            return None;
        }
        let after = self.0.partition_point(|moment| moment.t_ns < t_ns).min(self.0.len() - 1);
        let near = self.0[after];
        let dt_s = (t_ns - near.t_ns) as f64 * 1e-9;
        let before = after.checked_sub(1).map(|before| self.0[before]);
        let a_n = before.map_or(Vector3::zeros(), |before| {
            (near.v_n - before.v_n) / ((near.t_ns - before.t_ns) as f64 * 1e-9).max(1e-3)
        });
        Some(Moment {
            t_ns,
            c_nb: near.c_nb * cayley(&(near.w_nb_b * dt_s)),
            v_n: near.v_n + a_n * dt_s,
            p_n: near.p_n + near.v_n * dt_s + a_n * (0.5 * dt_s * dt_s),
            w_nb_b: near.w_nb_b,
        })
    }

    /// A correction of the newest moment holds for all, the position's with that of the velocity.
    pub(super) fn correct(&mut self, phi: &Vector3<f64>, velocity: &Vector3<f64>, position: &Vector3<f64>) {
        let Some(now_ns) = self.0.back().map(|moment| moment.t_ns) else { return };
        let turn = cayley(phi);
        for moment in &mut self.0 {
            let dt_s = (moment.t_ns - now_ns) as f64 * 1e-9;
            moment.c_nb = turn * moment.c_nb;
            moment.v_n += velocity;
            moment.p_n += position + velocity * dt_s;
        }
    }
}
