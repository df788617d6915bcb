//! A visit to a marker, as a session is given it.

use serde::{Deserialize, Serialize};

/// What is positioned was at a marker from `t_start_ns` to `t_end_ns`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// The marker's name.
    pub marker: String,
    /// Arrival, ns.
    pub t_start_ns: i64,
    /// Departure, ns.
    pub t_end_ns: i64,
    /// The marker's position, east-north-up, m; `None` for a height that was never surveyed. [`Visit::NOWHERE`] for a point that is
    /// no marker yet, which only a system that surveys is told ([`crate::system::Declaration::surveys`]).
    pub position_n_m: (f64, f64, Option<f64>),
}

impl Visit {
    /// Where a point is that nobody has surveyed.
    pub const NOWHERE: (f64, f64, Option<f64>) = (f64::NAN, f64::NAN, None);

    /// Whether it is of a point that is no marker yet.
    pub fn is_of_a_new_point(&self) -> bool {
        self.position_n_m.0.is_nan()
    }

    /// When it is applied, ns: in the middle of the visit, which forgives a stamp that is early or late.
    pub fn moment_ns(&self) -> i64 {
        self.t_start_ns + (self.t_end_ns - self.t_start_ns) / 2
    }
}
