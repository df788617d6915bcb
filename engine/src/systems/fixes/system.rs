//! A point a row.

use serde::{Deserialize, Serialize};

use super::{DECLARATION, UNKNOWN_SIGMA_M};
use crate::anomaly::Cause;
use crate::cause::SensorCause;
use crate::event::{AidKind, Event, TrackPoint, VisitOutcome};
use crate::replay::InputStore;
use crate::rotation::azimuth;
use crate::stream::{Reading, StreamId};
use crate::system::{ConfigError, Declaration, NotRestored, Progress, SessionConfig, System, SystemConfig};
use crate::visit::Visit;

/// A state is saved this often, ns.
const SAVED_EVERY_NS: i64 = 60_000_000_000;

/// There is nothing to configure.
#[derive(Clone, Debug)]
pub(super) struct Config;

/// The last point, and how far it is to there.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Fixes {
    last: Option<TrackPoint>,
    distance_m: f64,
    saved_ns: i64,
}

impl System for Fixes {
    fn push(&mut self, stream: StreamId, reading: Reading<'_>, events: &mut Vec<Event>) {
        let Reading::Values { t_ns, values: &[e, n, u, sigma] } = reading else { return };
        let mut wrong = |cause: SensorCause| {
            events.push(Event::Anomaly(cause.anomaly(Some(stream), [t_ns; 2], 1)));
        };
        if ![e, n, u].iter().all(|x| x.is_finite()) {
            return wrong(SensorCause::NotFinite);
        }
        let mut heading_rad = 0.0;
        if let Some(last) = &self.last {
            if t_ns <= last.t_ns {
                return wrong(SensorCause::TimeGoesBack { back_by_s: (last.t_ns - t_ns) as f64 * 1e-9 });
            }
            let [e0, n0, u0] = last.position_n_m;
            self.distance_m += libm::hypot(libm::hypot(e - e0, n - n0), u - u0);
            heading_rad = azimuth(e - e0, n - n0);
        }
        let sigma_m = if sigma > 0.0 { sigma } else { UNKNOWN_SIGMA_M };
        let point = TrackPoint {
            t_ns,
            position_n_m: [e, n, u],
            heading_rad,
            sigma_heading_rad: std::f64::consts::PI,
            sigma_n_m: [sigma_m; 3],
            covariance_en_m2: 0.0,
            tilt: None,
            parts: [None; 2],
        };
        self.last = Some(point);
        events.push(Event::Point(point));
    }

    fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let reason = "positions are shown as they come: a marker does not correct them";
        events.push(Event::Visit(VisitOutcome::turned_down(&visit, reason.to_owned())));
    }

    fn progress(&self) -> Progress {
        Progress { distance_m: self.distance_m, ..Progress::default() }
    }

    fn save(&mut self) -> Option<(i64, Vec<u8>)> {
        let t_ns = self.last?.t_ns;
        if t_ns - self.saved_ns < SAVED_EVERY_NS {
            return None;
        }
        self.saved_ns = t_ns;
        Some((t_ns, postcard::to_allocvec(self).ok()?))
    }
}

impl SystemConfig for Config {
    fn declaration(&self) -> &'static Declaration {
        &DECLARATION
    }

    fn aids(&self) -> Vec<AidKind> {
        Vec::new()
    }

    fn fields(&self) -> serde_json::Map<String, serde_json::Value> {
        serde_json::Map::new()
    }

    fn use_aids(&mut self, _: &[AidKind]) {}

    fn start(
        &self,
        session: &SessionConfig,
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError> {
        DECLARATION.check_streams(&session.streams)?;
        Ok(Box::new(Fixes::default()))
    }

    fn restore(
        &self,
        _: &SessionConfig,
        bytes: &[u8],
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, NotRestored> {
        let fixes: Fixes = postcard::from_bytes(bytes).map_err(|error| NotRestored(error.to_string()))?;
        Ok(Box::new(fixes))
    }
}
