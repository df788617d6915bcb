//! Positions that something else has worked out, shown as they come: a receiver's, a tag's, a tracker's.
//!
//! The smallest system there is, and the example of how one moves in (`ARCHITECTURE.md`): one stream of rows, a point a row.

mod system;

use crate::anomaly::Cause;
use crate::cause::SensorCause;
use crate::geo::Site;
use crate::stream::Kind;
use crate::system::{Column, Declaration, Simulated, SimulatedStream, StreamRule};

use self::system::Config;

/// Sigma of a fix that does not say how sure it is, on each axis, m.
const UNKNOWN_SIGMA_M: f64 = 10.0;

/// Positions as a system.
pub const DECLARATION: Declaration = Declaration {
    name: "fixes",
    title: "Positions that another system has worked out",
    source: "",
    carrier_kind: "instrument",
    former_keys: None,
    streams: &[StreamRule {
        role: "fixes",
        name: "fix",
        title: "Positions east-north-up from the site's origin",
        kind: Kind::Values,
        columns: &[
            column("e_m", true, "East of the site's origin, m."),
            column("n_m", true, "North of the site's origin, m."),
            column("u_m", true, "Above the site's origin, m."),
            column("sigma_m", false, "How sure the position is, 1σ on each axis, m; 10 m where it is empty."),
        ],
        least: 1,
        most: 1,
    }],
    instrument: None,
    parts: &[],
    has_tilt: false,
    places_itself: true,
    aids: &[],
    parameters: &[],
    parameter_groups: &[],
    charts: &[],
    anomalies: || {
        let causes = [SensorCause::NotFinite, SensorCause::TimeGoesBack { back_by_s: 0.5 }];
        causes.iter().map(|cause| cause.anomaly(None, [1, 2], 3)).collect()
    },
    log_clocks: None,
    not_stored: |stream| SensorCause::NotFinite.anomaly(Some(stream), [0; 2], 0),
    config: || Box::new(Config),
    simulate: Some(circle),
};

const fn column(name: &'static str, required: bool, about: &'static str) -> Column {
    Column { name, required, about }
}

/// Once around a circle of 50 m in five minutes, a fix a second, exact.
fn circle(_seed: u64, _site: &Site) -> Simulated {
    let place = |t_s: f64| {
        let turn_rad = t_s / 300.0 * std::f64::consts::TAU;
        [50.0 * libm::cos(turn_rad), 50.0 * libm::sin(turn_rad), 0.0]
    };
    let truth: Vec<(i64, [f64; 3])> =
        (0..=300).map(|second| (second * 1_000_000_000, place(second as f64))).collect();
    let rows = truth.iter().map(|(t_ns, [e, n, u])| (*t_ns, vec![*e, *n, *u, 0.5])).collect();
    let stream = DECLARATION.usual_streams().swap_remove(0);
    Simulated { streams: vec![SimulatedStream { stream, rows }], start_n_m: place(0.0), truth }
}
